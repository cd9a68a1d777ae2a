//! Parameters of a node: declared with default and description, given at start, changed while running.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::{Arc, Mutex};

use swath_msgs::rcl_interfaces::{FloatingPointRange, IntegerRange, Parameter, ParameterDescriptor};

use crate::cli::RosArgs;
use crate::error::RosError;
use crate::names::Names;
use crate::signal::lock;
use crate::value::{Typed, Value};

/// What a parameter is, before it is declared.
#[derive(Clone, Debug)]
pub struct Spec<T> {
    name: &'static str,
    default: T,
    description: &'static str,
    range: Option<RangeInclusive<f64>>,
    read_only: bool,
}

impl<T: Typed> Spec<T> {
    /// A parameter that may be changed while the node runs.
    pub const fn new(name: &'static str, default: T, description: &'static str) -> Self {
        Self { name, default, description, range: None, read_only: false }
    }

    /// The parameter cannot be changed once the node runs.
    #[must_use]
    pub fn read_only(mut self) -> Self {
        self.read_only = true;
        self
    }

    /// The number lies in this range.
    #[must_use]
    pub fn in_range(mut self, range: RangeInclusive<f64>) -> Self {
        self.range = Some(range);
        self
    }
}

/// The parameters of a node. Clones are the same parameters.
#[derive(Clone)]
pub struct Parameters {
    shared: Arc<Mutex<Store>>,
}

#[derive(Default)]
struct Store {
    declared: BTreeMap<String, Declared>,
    given: BTreeMap<String, Value>,
    addressed: Vec<String>,
    changes: Vec<Parameter>,
    revision: u64,
}

struct Declared {
    value: Value,
    description: &'static str,
    range: Option<RangeInclusive<f64>>,
    read_only: bool,
}

impl Parameters {
    /// No parameters yet, with the values that the command line and files give.
    pub(crate) fn new(args: &RosArgs, names: &Names) -> Self {
        let store = Store {
            given: args.overrides(names),
            addressed: args.addressed(names).into_iter().map(str::to_owned).collect(),
            ..Store::default()
        };
        Self { shared: Arc::new(Mutex::new(store)) }
    }

    /// Declares a parameter and returns its value: the one given at start, or else the default.
    ///
    /// # Errors
    /// If the value given is of another type or out of range, or the name is taken.
    pub fn declare<T: Typed>(&self, spec: Spec<T>) -> Result<T, RosError> {
        let mut store = lock(&self.shared);
        let failed = |reason: String| RosError::Parameter { name: spec.name.to_owned(), reason };
        if store.declared.contains_key(spec.name) {
            return Err(failed("it is declared twice".to_owned()));
        }
        let default = spec.default.into_value();
        let mut declared = Declared {
            value: default.clone(),
            description: spec.description,
            range: spec.range,
            read_only: spec.read_only,
        };
        let given = store.given.get(spec.name).cloned().unwrap_or(default);
        declared.value = declared.checked(given).map_err(failed)?;
        let value =
            T::from_value(&declared.value).ok_or_else(|| failed("its type and its value disagree".to_owned()))?;
        store.declared.insert(spec.name.to_owned(), declared);
        Ok(value)
    }

    /// Checks that no value was given on the command line to a parameter that there is not.
    ///
    /// To be called once all parameters are declared. Values in parameter files may be meant for
    /// others and are not checked.
    ///
    /// # Errors
    /// [`RosError::Parameter`] for the first such value, with the names that there are.
    pub fn check_given(&self) -> Result<(), RosError> {
        let store = lock(&self.shared);
        match store.addressed.iter().find(|name| !store.declared.contains_key(*name)) {
            None => Ok(()),
            Some(name) => {
                let known: Vec<&str> = store.declared.keys().map(String::as_str).collect();
                Err(RosError::Parameter {
                    name: name.clone(),
                    reason: format!("there is none of this name, there are {}", known.join(", ")),
                })
            }
        }
    }

    /// The value of a parameter, if it is declared with this type.
    #[must_use]
    pub fn get<T: Typed>(&self, name: &str) -> Option<T> {
        lock(&self.shared).declared.get(name).and_then(|declared| T::from_value(&declared.value))
    }

    /// A number that grows with every change.
    #[must_use]
    pub fn revision(&self) -> u64 {
        lock(&self.shared).revision
    }

    /// Sets a parameter as a ROS user would.
    ///
    /// # Errors
    /// [`RosError::Parameter`] when there is none of this name, or it cannot have the value.
    pub fn set(&self, name: &str, value: Value) -> Result<(), RosError> {
        self.set_all(vec![(name.to_owned(), value)])
    }

    /// Sets several parameters, or none if one cannot be set.
    pub(crate) fn set_all(&self, values: Vec<(String, Value)>) -> Result<(), RosError> {
        let mut store = lock(&self.shared);
        let mut checked = Vec::new();
        for (name, value) in values {
            let value =
                store.settable(&name, value).map_err(|reason| RosError::Parameter { name: name.clone(), reason })?;
            checked.push((name, value));
        }
        for (name, value) in checked {
            store.changes.push(Parameter { name: name.clone(), value: value.to_msg() });
            store.revision += 1;
            if let Some(declared) = store.declared.get_mut(&name) {
                declared.value = value;
            }
        }
        Ok(())
    }

    /// The changes since this was last asked.
    pub(crate) fn take_changes(&self) -> Vec<Parameter> {
        std::mem::take(&mut lock(&self.shared).changes)
    }

    /// Names of the declared parameters.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        lock(&self.shared).declared.keys().cloned().collect()
    }

    /// The value of a parameter, of whatever type.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<Value> {
        lock(&self.shared).declared.get(name).map(|declared| declared.value.clone())
    }

    /// What a parameter is, as ROS describes it.
    pub(crate) fn describe(&self, name: &str) -> Option<ParameterDescriptor> {
        lock(&self.shared).declared.get(name).map(|declared| declared.describe(name))
    }
}

impl Store {
    fn settable(&self, name: &str, value: Value) -> Result<Value, String> {
        let declared = self.declared.get(name).ok_or("there is no such parameter")?;
        if declared.read_only {
            return Err("it cannot be changed while the node runs".to_owned());
        }
        declared.checked(value)
    }
}

impl Declared {
    /// The value with the declared type, if it is of that type and in range.
    fn checked(&self, value: Value) -> Result<Value, String> {
        let value = value.coerced(&self.value)?;
        let number = match value {
            Value::Double(number) => number,
            Value::Integer(number) => number as f64,
            _ => return Ok(value),
        };
        match &self.range {
            // NaN is in no range.
            Some(range) if !range.contains(&number) => {
                Err(format!("{number} is outside {} to {}", range.start(), range.end()))
            }
            None if number.is_nan() => Err("it is not a number".to_owned()),
            _ => Ok(value),
        }
    }

    fn describe(&self, name: &str) -> ParameterDescriptor {
        let mut descriptor = ParameterDescriptor {
            name: name.to_owned(),
            r#type: self.value.type_code(),
            description: self.description.to_owned(),
            read_only: self.read_only,
            ..Default::default()
        };
        if let Some(range) = &self.range {
            let (from_value, to_value) = (*range.start(), *range.end());
            if matches!(self.value, Value::Integer(_)) {
                let (from_value, to_value) = (from_value as i64, to_value as i64);
                descriptor.integer_range = vec![IntegerRange { from_value, to_value, step: 0 }];
            } else {
                let range = FloatingPointRange { from_value, to_value, step: 0.0 };
                descriptor.floating_point_range = vec![range];
            }
        }
        descriptor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters(line: &str) -> Parameters {
        let words = line.split_whitespace().map(str::to_owned);
        let args = RosArgs::split(words).unwrap().1;
        Parameters::new(&args, &args.names("/swath", "spacecraft").unwrap())
    }

    fn pace() -> Spec<f64> {
        Spec::new("pace", 0.0, "Speed against real time.").in_range(0.0..=1e6)
    }

    #[test]
    fn defaults_hold_until_something_else_is_given() {
        assert_eq!(parameters("").declare(pace()).unwrap(), 0.0);
        let parameters = parameters("--ros-args -p pace:=2");
        assert_eq!(parameters.declare(pace()).unwrap(), 2.0);
        assert_eq!(parameters.get::<f64>("pace"), Some(2.0));
        assert_eq!(parameters.get::<String>("pace"), None);
        assert!(parameters.declare(pace()).is_err());
    }

    #[test]
    fn wrong_values_are_refused_at_start() {
        for (text, reason) in [
            ("fast", "double is needed, string was given"),
            ("-1.0", "-1 is outside 0 to 1000000"),
            (".nan", "NaN is outside 0 to 1000000"),
        ] {
            let given = parameters(&format!("--ros-args -p pace:={text}"));
            let error = given.declare(pace()).unwrap_err().to_string();
            assert_eq!(error, format!("parameter `pace`: {reason}"));
        }
        let given = parameters("--ros-args -p pase:=1.0");
        given.declare(pace()).unwrap();
        assert_eq!(
            given.check_given().unwrap_err().to_string(),
            "parameter `pase`: there is none of this name, there are pace"
        );
    }

    #[test]
    fn changes_are_checked_counted_and_told() {
        let parameters = parameters("");
        parameters.declare(pace()).unwrap();
        parameters.declare(Spec::new("seed", 1_i64, "Seed.").read_only()).unwrap();
        parameters.set("pace", Value::Double(3.0)).unwrap();
        assert_eq!(parameters.get::<f64>("pace"), Some(3.0));
        assert_eq!(parameters.revision(), 1);
        assert_eq!(parameters.take_changes()[0].value.double_value, 3.0);
        assert!(parameters.take_changes().is_empty());
        let fixed = parameters.set("seed", Value::Integer(2)).unwrap_err().to_string();
        assert_eq!(fixed, "parameter `seed`: it cannot be changed while the node runs");
        let both = vec![("pace".to_owned(), Value::Double(4.0)), ("none".to_owned(), Value::Bool(true))];
        assert!(parameters.set_all(both).is_err());
        assert_eq!(parameters.get::<f64>("pace"), Some(3.0));
    }

    #[test]
    fn descriptions_tell_range_and_type() {
        let parameters = parameters("");
        parameters.declare(pace()).unwrap();
        let descriptor = parameters.describe("pace").unwrap();
        assert_eq!(descriptor.description, "Speed against real time.");
        assert_eq!(descriptor.floating_point_range[0].to_value, 1e6);
        assert!(parameters.describe("none").is_none());
    }
}
