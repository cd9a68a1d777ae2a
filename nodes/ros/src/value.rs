//! Values of parameters: as ROS types them, as YAML writes them, as Rust reads them.

use swath_msgs::rcl_interfaces::{ParameterType, ParameterValue};
use yaml_serde::Value as Yaml;

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A truth value.
    Bool(bool),
    /// A 64-bit integer.
    Integer(i64),
    /// A 64-bit float.
    Double(f64),
    /// A text.
    String(String),
    /// A list of bytes.
    Bytes(Vec<u8>),
    /// A list of truth values.
    Bools(Vec<bool>),
    /// A list of 64-bit integers.
    Integers(Vec<i64>),
    /// A list of 64-bit floats.
    Doubles(Vec<f64>),
    /// A list of texts.
    Strings(Vec<String>),
}

impl Value {
    /// Name of the type, for people.
    #[must_use]
    pub const fn type_name(&self) -> &'static str {
        match self {
            Self::Bool(_) => "bool",
            Self::Integer(_) => "integer",
            Self::Double(_) => "double",
            Self::String(_) => "string",
            Self::Bytes(_) => "byte array",
            Self::Bools(_) => "bool array",
            Self::Integers(_) => "integer array",
            Self::Doubles(_) => "double array",
            Self::Strings(_) => "string array",
        }
    }

    /// One of the [`ParameterType`] constants.
    #[must_use]
    pub const fn type_code(&self) -> u8 {
        match self {
            Self::Bool(_) => ParameterType::PARAMETER_BOOL,
            Self::Integer(_) => ParameterType::PARAMETER_INTEGER,
            Self::Double(_) => ParameterType::PARAMETER_DOUBLE,
            Self::String(_) => ParameterType::PARAMETER_STRING,
            Self::Bytes(_) => ParameterType::PARAMETER_BYTE_ARRAY,
            Self::Bools(_) => ParameterType::PARAMETER_BOOL_ARRAY,
            Self::Integers(_) => ParameterType::PARAMETER_INTEGER_ARRAY,
            Self::Doubles(_) => ParameterType::PARAMETER_DOUBLE_ARRAY,
            Self::Strings(_) => ParameterType::PARAMETER_STRING_ARRAY,
        }
    }

    /// The value of a YAML scalar or list.
    ///
    /// # Errors
    /// A text that says why it is no value of a parameter.
    pub fn from_yaml(yaml: &Yaml) -> Result<Self, String> {
        match yaml {
            Yaml::Bool(value) => Ok(Self::Bool(*value)),
            Yaml::Number(number) => match (number.as_i64(), number.as_f64()) {
                (Some(value), _) => Ok(Self::Integer(value)),
                (None, Some(value)) if !number.is_u64() => Ok(Self::Double(value)),
                _ => Err(format!("{number} is outside the 64-bit integers")),
            },
            Yaml::String(text) => Ok(Self::String(text.clone())),
            Yaml::Sequence(items) => list(items),
            Yaml::Null => Err("it has no value".to_owned()),
            Yaml::Mapping(_) | Yaml::Tagged(_) => Err("it is not a scalar or a list".to_owned()),
        }
    }

    /// The value written as text, as after `-p name:=`.
    ///
    /// # Errors
    /// A text that says why it is no value of a parameter.
    pub fn from_text(text: &str) -> Result<Self, String> {
        let yaml: Yaml = yaml_serde::from_str(text).map_err(|error| error.to_string())?;
        Self::from_yaml(&yaml)
    }

    /// The value as one of the same type as `like`: whole numbers are taken for doubles.
    pub(crate) fn coerced(self, like: &Self) -> Result<Self, String> {
        let value = match (self, like) {
            (Self::Integer(value), Self::Double(_)) => Self::Double(value as f64),
            (Self::Integers(values), Self::Doubles(_)) => {
                Self::Doubles(values.into_iter().map(|value| value as f64).collect())
            }
            // An empty list of YAML has no type.
            (Self::Strings(values), like) if values.is_empty() => like.emptied(),
            (value, _) => value,
        };
        if value.type_code() == like.type_code() {
            Ok(value)
        } else {
            Err(format!("{} is needed, {} was given", like.type_name(), value.type_name()))
        }
    }

    fn emptied(&self) -> Self {
        match self {
            Self::Bytes(_) => Self::Bytes(Vec::new()),
            Self::Bools(_) => Self::Bools(Vec::new()),
            Self::Integers(_) => Self::Integers(Vec::new()),
            Self::Doubles(_) => Self::Doubles(Vec::new()),
            _ => Self::Strings(Vec::new()),
        }
    }

    /// The value as a message.
    pub(crate) fn to_msg(&self) -> ParameterValue {
        let mut message = ParameterValue { r#type: self.type_code(), ..Default::default() };
        match self.clone() {
            Self::Bool(value) => message.bool_value = value,
            Self::Integer(value) => message.integer_value = value,
            Self::Double(value) => message.double_value = value,
            Self::String(value) => message.string_value = value,
            Self::Bytes(values) => message.byte_array_value = values,
            Self::Bools(values) => message.bool_array_value = values,
            Self::Integers(values) => message.integer_array_value = values,
            Self::Doubles(values) => message.double_array_value = values,
            Self::Strings(values) => message.string_array_value = values,
        }
        message
    }

    /// The value of a message.
    pub(crate) fn from_msg(message: &ParameterValue) -> Result<Self, String> {
        Ok(match message.r#type {
            ParameterType::PARAMETER_BOOL => Self::Bool(message.bool_value),
            ParameterType::PARAMETER_INTEGER => Self::Integer(message.integer_value),
            ParameterType::PARAMETER_DOUBLE => Self::Double(message.double_value),
            ParameterType::PARAMETER_STRING => Self::String(message.string_value.clone()),
            ParameterType::PARAMETER_BYTE_ARRAY => Self::Bytes(message.byte_array_value.clone()),
            ParameterType::PARAMETER_BOOL_ARRAY => Self::Bools(message.bool_array_value.clone()),
            ParameterType::PARAMETER_INTEGER_ARRAY => Self::Integers(message.integer_array_value.clone()),
            ParameterType::PARAMETER_DOUBLE_ARRAY => Self::Doubles(message.double_array_value.clone()),
            ParameterType::PARAMETER_STRING_ARRAY => Self::Strings(message.string_array_value.clone()),
            ParameterType::PARAMETER_NOT_SET => return Err("it cannot be unset".to_owned()),
            other => return Err(format!("{other} is not a parameter type")),
        })
    }
}

fn list(items: &[Yaml]) -> Result<Value, String> {
    let values: Vec<Value> = items.iter().map(Value::from_yaml).collect::<Result<_, _>>()?;
    let mixed = || "the items of the list are not all of one type".to_owned();
    let all_of = |pick: fn(&Value) -> bool| values.iter().all(pick);
    if values.is_empty() {
        Ok(Value::Strings(Vec::new()))
    } else if all_of(|value| matches!(value, Value::Bool(_))) {
        collect(&values, bool::from_value).map(Value::Bools).ok_or_else(mixed)
    } else if all_of(|value| matches!(value, Value::Integer(_))) {
        collect(&values, i64::from_value).map(Value::Integers).ok_or_else(mixed)
    } else if all_of(|value| matches!(value, Value::Integer(_) | Value::Double(_))) {
        collect(&values, f64::from_value).map(Value::Doubles).ok_or_else(mixed)
    } else {
        collect(&values, String::from_value).map(Value::Strings).ok_or_else(mixed)
    }
}

fn collect<T>(values: &[Value], convert: fn(&Value) -> Option<T>) -> Option<Vec<T>> {
    values.iter().map(convert).collect()
}

/// A Rust type that a parameter can have.
pub trait Typed: Sized {
    /// The parameter value.
    fn into_value(self) -> Value;
    /// The Rust value, if the parameter value is of this type.
    fn from_value(value: &Value) -> Option<Self>;
}

macro_rules! typed {
    ($($rust:ty => $variant:ident),* $(,)?) => {$(
        impl Typed for $rust {
            fn into_value(self) -> Value {
                Value::$variant(self)
            }

            fn from_value(value: &Value) -> Option<Self> {
                match value {
                    Value::$variant(value) => Some(value.clone()),
                    _ => None,
                }
            }
        }
    )*};
}

typed! {
    bool => Bool,
    i64 => Integer,
    String => String,
    Vec<u8> => Bytes,
    Vec<bool> => Bools,
    Vec<i64> => Integers,
    Vec<f64> => Doubles,
    Vec<String> => Strings,
}

impl Typed for f64 {
    fn into_value(self) -> Value {
        Value::Double(self)
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Double(value) => Some(*value),
            Value::Integer(value) => Some(*value as Self),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_typed_as_yaml_types_it() {
        for (text, value) in [
            ("true", Value::Bool(true)),
            ("-3", Value::Integer(-3)),
            ("1.0", Value::Double(1.0)),
            ("1e3", Value::Double(1000.0)),
            ("hop", Value::String("hop".to_owned())),
            ("'3'", Value::String("3".to_owned())),
            ("[1, 2]", Value::Integers(vec![1, 2])),
            ("[1, 2.5]", Value::Doubles(vec![1.0, 2.5])),
            ("[true, false]", Value::Bools(vec![true, false])),
            ("[a, b]", Value::Strings(vec!["a".to_owned(), "b".to_owned()])),
        ] {
            assert_eq!(Value::from_text(text).unwrap(), value, "{text}");
        }
        assert_eq!(Value::from_text("").unwrap_err(), "it has no value");
        assert_eq!(Value::from_text("{a: 1}").unwrap_err(), "it is not a scalar or a list");
        assert_eq!(Value::from_text("[1, a]").unwrap_err(), "the items of the list are not all of one type");
        assert!(Value::from_text("18446744073709551615").is_err());
        assert!(Value::from_text("[1").is_err());
    }

    #[test]
    fn whole_numbers_do_for_doubles_and_nothing_else_is_mixed() {
        let double = Value::Double(0.0);
        assert_eq!(Value::Integer(2).coerced(&double).unwrap(), Value::Double(2.0));
        assert_eq!(Value::Double(2.0).coerced(&Value::Integer(0)).unwrap_err(), "integer is needed, double was given");
        assert_eq!(Value::Strings(Vec::new()).coerced(&Value::Doubles(vec![1.0])).unwrap(), Value::Doubles(Vec::new()));
    }

    #[test]
    fn every_value_survives_the_message() {
        for value in [
            Value::Bool(true),
            Value::Integer(1),
            Value::Double(0.5),
            Value::String("a".to_owned()),
            Value::Bytes(vec![1]),
            Value::Bools(vec![true]),
            Value::Integers(vec![1]),
            Value::Doubles(vec![0.5]),
            Value::Strings(vec!["a".to_owned()]),
        ] {
            assert_eq!(Value::from_msg(&value.to_msg()).unwrap(), value);
        }
        assert!(Value::from_msg(&ParameterValue::default()).is_err());
        assert!(Value::from_msg(&ParameterValue { r#type: 77, ..Default::default() }).is_err());
    }
}
