//! The words after `--ros-args`, as ROS 2 users know them.

use std::collections::BTreeMap;
use std::path::Path;

use tracing::Level;
use yaml_serde::Value as Yaml;

use crate::error::RosError;
use crate::graph::CLOCK;
use crate::names::Names;
use crate::value::Value;

/// What a process was told with `--ros-args`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RosArgs {
    remaps: Vec<Remap>,
    overrides: Vec<Override>,
    log_levels: Vec<(Option<String>, Level)>,
    rosout_off: bool,
}

#[derive(Clone, Debug, PartialEq)]
struct Remap {
    node: Option<String>,
    from: String,
    to: String,
}

/// A value for a parameter of the nodes whose fully qualified name matches a pattern.
#[derive(Clone, Debug, PartialEq)]
struct Override {
    /// Node name of `-p node:name:=value`, or the pattern of a parameter file.
    scope: Scope,
    name: String,
    value: Value,
}

#[derive(Clone, Debug, PartialEq)]
enum Scope {
    /// Every node of the process.
    Process,
    /// The node with this name, whatever its namespace.
    Node(String),
    /// The nodes whose fully qualified name matches, with `*` for a part and `**` for any parts.
    Pattern(String),
}

impl RosArgs {
    /// Takes the words between `--ros-args` and `--` (or the end) out of a command line, and
    /// returns the rest, for the program's own parser, with what they say.
    ///
    /// # Errors
    /// [`RosError::Argument`] for a word that is not understood, [`RosError::ParameterFile`] for a file that cannot be used.
    pub fn split(words: impl IntoIterator<Item = String>) -> Result<(Vec<String>, Self), RosError> {
        let mut rest = Vec::new();
        let mut args = Self::default();
        let mut words = words.into_iter();
        while let Some(word) = words.next() {
            if word != "--ros-args" {
                rest.push(word);
                continue;
            }
            while let Some(option) = words.next() {
                match option.as_str() {
                    "--" => break,
                    "--ros-args" => {}
                    _ => args.option(&option, &mut words)?,
                }
            }
        }
        Ok((rest, args))
    }

    fn option(&mut self, option: &str, words: &mut impl Iterator<Item = String>) -> Result<(), RosError> {
        let mut value = || words.next().ok_or_else(|| argument(option, "it needs a value after it"));
        match option {
            "-r" | "--remap" => self.remap(&value()?),
            "-p" | "--param" => self.parameter(&value()?),
            "--params-file" => self.parameter_file(Path::new(&value()?)),
            "--log-level" => self.log_level(&value()?),
            "--disable-rosout-logs" => {
                self.rosout_off = true;
                Ok(())
            }
            "--enable-rosout-logs" => {
                self.rosout_off = false;
                Ok(())
            }
            // Other ways of logging and enclaves have nothing to act on here.
            "--enable-stdout-logs"
            | "--disable-stdout-logs"
            | "--enable-external-lib-logs"
            | "--disable-external-lib-logs" => Ok(()),
            "-e" | "--enclave" | "--log-config-file" | "--log-file-name" => value().map(|_| ()),
            _ => Err(argument(option, "it is not an option of --ros-args")),
        }
    }

    fn remap(&mut self, rule: &str) -> Result<(), RosError> {
        let (from, to) = rule
            .split_once(":=")
            .filter(|(from, to)| !from.is_empty() && !to.is_empty())
            .ok_or_else(|| argument(rule, "a remapping is written from:=to"))?;
        let (node, from) = match from.split_once(':') {
            Some((node, from)) => (Some(node.to_owned()), from),
            None => (None, from),
        };
        self.remaps.push(Remap { node, from: from.to_owned(), to: to.to_owned() });
        Ok(())
    }

    fn parameter(&mut self, rule: &str) -> Result<(), RosError> {
        let (name, text) = rule
            .split_once(":=")
            .filter(|(name, _)| !name.is_empty())
            .ok_or_else(|| argument(rule, "a parameter is written name:=value"))?;
        let (scope, name) = match name.split_once(':') {
            Some((node, name)) => (Scope::Node(node.to_owned()), name),
            None => (Scope::Process, name),
        };
        let value = Value::from_text(text).map_err(|reason| argument(rule, &reason))?;
        self.overrides.push(Override { scope, name: name.to_owned(), value });
        Ok(())
    }

    fn parameter_file(&mut self, path: &Path) -> Result<(), RosError> {
        let failed = |reason: String| RosError::ParameterFile { path: path.display().to_string(), reason };
        let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
        let yaml: Yaml = yaml_serde::from_str(&text).map_err(|error| failed(error.to_string()))?;
        self.overrides.extend(read_nodes("", &yaml).map_err(failed)?);
        Ok(())
    }

    fn log_level(&mut self, text: &str) -> Result<(), RosError> {
        let (logger, name) = match text.split_once(":=") {
            Some((logger, name)) => (Some(logger.to_owned()), name),
            None => (None, text),
        };
        let level = match name.to_ascii_lowercase().as_str() {
            "debug" => Level::DEBUG,
            "info" => Level::INFO,
            "warn" | "warning" => Level::WARN,
            "error" | "fatal" => Level::ERROR,
            _ => {
                return Err(argument(text, "a log level is one of debug, info, warn, error and fatal"));
            }
        };
        self.log_levels.push((logger, level));
        Ok(())
    }

    /// The same, for nodes in this namespace.
    #[must_use]
    pub fn in_namespace(mut self, namespace: &str) -> Self {
        self.remaps.push(Remap { node: None, from: "__ns".to_owned(), to: namespace.to_owned() });
        self
    }

    /// The same, with a value for a parameter of every node of the process.
    #[must_use]
    pub fn with_parameter(mut self, name: &str, value: Value) -> Self {
        self.overrides.push(Override { scope: Scope::Process, name: name.to_owned(), value });
        self
    }

    /// The names of the node that the program calls `name` and puts into the namespace `usual`; in another one `/clock`
    /// is that namespace's, too.
    ///
    /// # Errors
    /// [`RosError::Name`] when the name or the namespace breaks the rules of ROS.
    pub fn names(&self, usual: &str, name: &str) -> Result<Names, RosError> {
        let mine: Vec<&Remap> =
            self.remaps.iter().filter(|rule| rule.node.as_deref().is_none_or(|n| n == name)).collect();
        let last =
            |keys: &[&str]| mine.iter().rev().find(|rule| keys.contains(&rule.from.as_str())).map(|rule| &*rule.to);
        let namespace = last(&["__ns"]).unwrap_or(usual);
        let new_name = last(&["__node", "__name"]).unwrap_or(name);
        if !namespace.starts_with('/') {
            return Err(RosError::Name { name: namespace.to_owned(), reason: "a namespace starts with a slash" });
        }
        let topics = mine.iter().filter(|rule| !rule.from.starts_with("__"));
        let topics = topics.map(|rule| (rule.from.clone(), rule.to.clone()));
        // In a namespace of its own a mission has a time of its own.
        let clock = (namespace != usual).then(|| {
            let clock = CLOCK.entry.name;
            (clock.to_owned(), format!("{}{clock}", namespace.trim_end_matches('/')))
        });
        let topics: Vec<(String, String)> = topics.chain(clock).collect();
        Names::new(namespace, new_name, &topics)
    }

    /// The values given to parameters of a node; of several for one name, the last.
    #[must_use]
    pub fn overrides(&self, names: &Names) -> BTreeMap<String, Value> {
        self.overrides
            .iter()
            .filter(|entry| entry.scope.contains(names))
            .map(|entry| (entry.name.clone(), entry.value.clone()))
            .collect()
    }

    /// Names of parameters that were meant for this very node, and not for whomever they fit.
    pub(crate) fn addressed(&self, names: &Names) -> Vec<&str> {
        self.overrides
            .iter()
            .filter(|entry| !matches!(entry.scope, Scope::Pattern(_)))
            .filter(|entry| entry.scope.contains(names))
            .map(|entry| entry.name.as_str())
            .collect()
    }

    /// The least severe level that a node logs.
    #[must_use]
    pub fn log_level_of(&self, names: &Names) -> Level {
        let dotted = names.fully_qualified().trim_start_matches('/').replace('/', ".");
        self.log_levels
            .iter()
            .rev()
            .find(|(logger, _)| logger.as_deref().is_none_or(|logger| logger == dotted || logger == names.name()))
            .map_or(Level::INFO, |(_, level)| *level)
    }

    /// Whether log lines go to `/rosout`.
    #[must_use]
    pub fn rosout(&self) -> bool {
        !self.rosout_off
    }
}

impl Scope {
    fn contains(&self, names: &Names) -> bool {
        match self {
            Self::Process => true,
            Self::Node(name) => name == names.name(),
            Self::Pattern(pattern) => {
                let pattern: Vec<&str> = pattern.split('/').collect();
                let full = names.fully_qualified();
                let parts: Vec<&str> = full.trim_start_matches('/').split('/').collect();
                matches(&pattern, &parts)
            }
        }
    }
}

fn matches(pattern: &[&str], parts: &[&str]) -> bool {
    match (pattern.split_first(), parts.split_first()) {
        (None, None) => true,
        (Some((&"**", rest)), _) => (0..=parts.len()).any(|skipped| matches(rest, &parts[skipped..])),
        (Some((token, pattern)), Some((part, parts))) => (*token == "*" || token == part) && matches(pattern, parts),
        _ => false,
    }
}

/// Reads the nodes of a parameter file, which may be nested by namespace.
fn read_nodes(path: &str, yaml: &Yaml) -> Result<Vec<Override>, String> {
    let Yaml::Mapping(entries) = yaml else {
        return Err(format!("`{path}` is not a mapping of nodes"));
    };
    let mut found = Vec::new();
    for (key, value) in entries {
        let key = key.as_str().ok_or_else(|| format!("a key under `{path}` is not a text"))?;
        if key == "ros__parameters" {
            read_parameters(path, "", value, &mut found)?;
        } else {
            let joined = format!("{path}/{}", key.trim_matches('/'));
            found.extend(read_nodes(joined.trim_start_matches('/'), value)?);
        }
    }
    Ok(found)
}

fn read_parameters(node: &str, prefix: &str, yaml: &Yaml, found: &mut Vec<Override>) -> Result<(), String> {
    let Yaml::Mapping(entries) = yaml else {
        return Err(format!("ros__parameters of `{node}` is not a mapping"));
    };
    for (key, value) in entries {
        let key = key.as_str().ok_or_else(|| format!("a parameter of `{node}` has no name"))?;
        let name = if prefix.is_empty() { key.to_owned() } else { format!("{prefix}.{key}") };
        if value.is_mapping() {
            read_parameters(node, &name, value, found)?;
        } else {
            let value = Value::from_yaml(value).map_err(|reason| format!("`{name}`: {reason}"))?;
            found.push(Override { scope: Scope::Pattern(node.to_owned()), name, value });
        }
    }
    Ok(())
}

fn argument(argument: &str, reason: &str) -> RosError {
    RosError::Argument { argument: argument.to_owned(), reason: reason.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(line: &str) -> Result<(Vec<String>, RosArgs), RosError> {
        RosArgs::split(line.split_whitespace().map(str::to_owned))
    }

    fn args(line: &str) -> RosArgs {
        split(line).unwrap().1
    }

    #[test]
    fn own_words_are_left_to_the_program() {
        let (rest, args) = split("fly --seed 1 --ros-args -p pace:=1.0 -- --verbose --ros-args -p a:=2").unwrap();
        assert_eq!(rest, ["fly", "--seed", "1", "--verbose"]);
        let names = args.names("/swath", "spacecraft").unwrap();
        let expected = [("a", Value::Integer(2)), ("pace", Value::Double(1.0))];
        let expected = expected.map(|(name, value)| (name.to_owned(), value));
        assert_eq!(args.overrides(&names), BTreeMap::from(expected));
    }

    #[test]
    fn nodes_are_renamed_and_moved() {
        let args = args("--ros-args -r __ns:=/a/b -r __node:=craft -r state:=/x -r ~/y:=z");
        let names = args.names("/swath", "spacecraft").unwrap();
        assert_eq!(names.fully_qualified(), "/a/b/craft");
        assert_eq!(names.resolve("state").unwrap(), "/x");
        assert_eq!(names.resolve("~/y").unwrap(), "/a/b/z");
    }

    #[test]
    fn rules_for_another_node_are_passed_over() {
        let args = args("--ros-args -r guidance:__ns:=/g -r guidance:a:=b -p guidance:x:=1 -p spacecraft:x:=2");
        let names = args.names("/swath", "spacecraft").unwrap();
        assert_eq!(names.fully_qualified(), "/swath/spacecraft");
        assert_eq!(names.resolve("a").unwrap(), "/swath/a");
        assert_eq!(args.overrides(&names)["x"], Value::Integer(2));
        assert_eq!(args.addressed(&names), ["x"]);
    }

    #[test]
    fn log_levels_are_general_or_for_a_logger() {
        let names = Names::new("/swath", "spacecraft", &[]).unwrap();
        assert_eq!(RosArgs::default().log_level_of(&names), Level::INFO);
        assert_eq!(args("--ros-args --log-level WARN").log_level_of(&names), Level::WARN);
        let named = args("--ros-args --log-level warn --log-level swath.spacecraft:=debug");
        assert_eq!(named.log_level_of(&names), Level::DEBUG);
        let other = args("--ros-args --log-level guidance:=debug");
        assert_eq!(other.log_level_of(&names), Level::INFO);
        assert!(!args("--ros-args --disable-rosout-logs").rosout());
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (line, error) in [
            ("--ros-args -x", "ros argument `-x`: it is not an option of --ros-args"),
            ("--ros-args -p", "ros argument `-p`: it needs a value after it"),
            ("--ros-args -p pace=1", "ros argument `pace=1`: a parameter is written name:=value"),
            ("--ros-args -p pace:=", "ros argument `pace:=`: it has no value"),
            ("--ros-args -r a:=", "ros argument `a:=`: a remapping is written from:=to"),
            (
                "--ros-args --log-level loud",
                "ros argument `loud`: a log level is one of debug, info, warn, error and fatal",
            ),
        ] {
            assert_eq!(split(line).unwrap_err().to_string(), error);
        }
        assert_eq!(
            args("--ros-args -r __ns:=swath").names("/", "a").unwrap_err().to_string(),
            "`swath` is not a valid name: a namespace starts with a slash"
        );
        let missing = split("--ros-args --params-file /no/such.yaml").unwrap_err().to_string();
        assert!(missing.starts_with("parameter file /no/such.yaml: "), "{missing}");
    }

    #[test]
    fn parameter_files_address_nodes_by_pattern() {
        let yaml = "
/**:
  ros__parameters: {pace: 1.0, shared: all}
/swath/spacecraft:
  ros__parameters:
    pace: 2.0
    wheels: {torque_max: 0.3}
swath:
  guidance:
    ros__parameters: {pace: 3.0}
/*/spacecraft:
  ros__parameters: {starred: true}
other:
  ros__parameters: {pace: 4.0}
";
        let overrides = read_nodes("", &yaml_serde::from_str(yaml).unwrap()).unwrap();
        let args = RosArgs { overrides, ..Default::default() };
        let spacecraft = args.overrides(&Names::new("/swath", "spacecraft", &[]).unwrap());
        assert_eq!(spacecraft["pace"], Value::Double(2.0));
        assert_eq!(spacecraft["shared"], Value::String("all".to_owned()));
        assert_eq!(spacecraft["wheels.torque_max"], Value::Double(0.3));
        assert_eq!(spacecraft["starred"], Value::Bool(true));
        let guidance = args.overrides(&Names::new("/swath", "guidance", &[]).unwrap());
        assert_eq!(guidance["pace"], Value::Double(3.0));
        assert_eq!(guidance.len(), 2);
        let bad: Yaml = yaml_serde::from_str("a: {ros__parameters: {b: [1, x]}}").unwrap();
        assert_eq!(read_nodes("", &bad).unwrap_err(), "`b`: the items of the list are not all of one type");
        let bad: Yaml = yaml_serde::from_str("a: 1").unwrap();
        assert_eq!(read_nodes("", &bad).unwrap_err(), "`a` is not a mapping of nodes");
    }
}
