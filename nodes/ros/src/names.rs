//! Names of nodes, topics and services: the rules of ROS 2, expansion, remapping, and their DDS form.

use ros2_client::NodeName;

use crate::error::RosError;

/// Name and namespace of a node, with the remapping rules that apply to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    node: NodeName,
    remaps: Vec<(String, String)>,
}

impl Names {
    /// Names of the node `name` in `namespace` (absolute, `/` for none), which renames topics and
    /// services by `remaps`, pairs of names before and after; the first that matches counts.
    ///
    /// # Errors
    /// [`RosError::Name`] for a name that breaks the rules of ROS.
    pub fn new(namespace: &str, name: &str, remaps: &[(String, String)]) -> Result<Self, RosError> {
        let absolute = format!("/{}", namespace.trim_matches('/'));
        if absolute != "/" {
            check(&absolute)?;
        }
        check_token(name, name)?;
        let node = NodeName::new(&absolute, name)
            .map_err(|_| RosError::Name { name: name.to_owned(), reason: "it is no name of a node" })?;
        let mut names = Self { node, remaps: Vec::new() };
        for (from, to) in remaps {
            let pair = (names.expand(from)?, names.expand(to)?);
            names.remaps.push(pair);
        }
        Ok(names)
    }

    /// The namespace, absolute.
    #[must_use]
    pub fn namespace(&self) -> &str {
        self.node.namespace()
    }

    /// The name within the namespace.
    #[must_use]
    pub fn name(&self) -> &str {
        self.node.base_name()
    }

    /// Namespace and name, such as `/swath/spacecraft`.
    #[must_use]
    pub fn fully_qualified(&self) -> String {
        self.node.fully_qualified_name()
    }

    /// The name that a topic or service really has, after expansion and remapping.
    ///
    /// # Errors
    /// [`RosError::Name`] when the name breaks the rules of ROS.
    pub fn resolve(&self, name: &str) -> Result<String, RosError> {
        let expanded = self.expand(name)?;
        let renamed = self.remaps.iter().find(|(from, _)| *from == expanded);
        Ok(renamed.map_or(expanded, |(_, to)| to.clone()))
    }

    /// Makes a name absolute: relative names are in the namespace, `~` stands for the node.
    fn expand(&self, name: &str) -> Result<String, RosError> {
        let absolute = if name.starts_with('/') {
            name.to_owned()
        } else if name == "~" {
            self.fully_qualified()
        } else if let Some(rest) = name.strip_prefix("~/") {
            format!("{}/{rest}", self.fully_qualified())
        } else {
            format!("{}/{name}", self.namespace().trim_end_matches('/'))
        };
        check(&absolute)?;
        Ok(absolute)
    }
}

/// DDS name of a topic.
pub(crate) fn dds_topic(fully_qualified: &str) -> String {
    format!("rt{fully_qualified}")
}

/// DDS names of a service's request and response topics.
pub(crate) fn dds_service(fully_qualified: &str) -> (String, String) {
    (format!("rq{fully_qualified}Request"), format!("rr{fully_qualified}Reply"))
}

/// DDS name of a type, such as `std_msgs::msg::dds_::Header_`.
pub(crate) fn dds_type(type_name: &str) -> Result<String, RosError> {
    let parts: Vec<&str> = type_name.split('/').collect();
    match parts[..] {
        [package, kind @ ("msg" | "srv" | "action"), name] if !package.is_empty() && !name.is_empty() => {
            Ok(format!("{package}::{kind}::dds_::{name}_"))
        }
        _ => Err(RosError::Name { name: type_name.to_owned(), reason: "a type is written package/msg/Name" }),
    }
}

fn check(absolute: &str) -> Result<(), RosError> {
    absolute[1..].split('/').try_for_each(|token| check_token(absolute, token))
}

fn check_token(name: &str, token: &str) -> Result<(), RosError> {
    let reason = if token.is_empty() {
        "a part between slashes is empty"
    } else if token.starts_with(|c: char| c.is_ascii_digit()) {
        "a part starts with a digit"
    } else if !token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
        "only letters, digits, underscores and slashes are allowed"
    } else if token.contains("__") {
        "there are two underscores in a row"
    } else {
        return Ok(());
    };
    Err(RosError::Name { name: name.to_owned(), reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(remaps: &[(&str, &str)]) -> Names {
        let remaps: Vec<_> = remaps.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect();
        Names::new("/swath", "spacecraft", &remaps).unwrap()
    }

    #[test]
    fn relative_absolute_and_private_names_are_expanded() {
        let names = names(&[]);
        assert_eq!(names.resolve("spacecraft/state").unwrap(), "/swath/spacecraft/state");
        assert_eq!(names.resolve("/clock").unwrap(), "/clock");
        assert_eq!(names.resolve("~/get_parameters").unwrap(), "/swath/spacecraft/get_parameters");
        assert_eq!(names.fully_qualified(), "/swath/spacecraft");
        let root = Names::new("/", "spacecraft", &[]).unwrap();
        assert_eq!(root.resolve("state").unwrap(), "/state");
        assert_eq!(root.fully_qualified(), "/spacecraft");
    }

    #[test]
    fn remapping_compares_expanded_names() {
        let names = names(&[("/swath/a", "b"), ("c", "/d"), ("~/e", "~/f"), ("c", "/never")]);
        assert_eq!(names.resolve("a").unwrap(), "/swath/b");
        assert_eq!(names.resolve("/swath/c").unwrap(), "/d");
        assert_eq!(names.resolve("~/e").unwrap(), "/swath/spacecraft/f");
        assert_eq!(names.resolve("/a").unwrap(), "/a");
    }

    #[test]
    fn invalid_names_are_refused_with_the_rule() {
        let names = names(&[]);
        for (name, reason) in [
            ("a//b", "a part between slashes is empty"),
            ("a/", "a part between slashes is empty"),
            ("", "a part between slashes is empty"),
            ("a/2b", "a part starts with a digit"),
            ("a-b", "only letters, digits, underscores and slashes are allowed"),
            ("a__b", "there are two underscores in a row"),
        ] {
            let error = names.resolve(name).unwrap_err().to_string();
            assert!(error.ends_with(reason), "{error}");
        }
        assert!(Names::new("/swath", "a/b", &[]).is_err());
        assert!(Names::new("/sw ath", "a", &[]).is_err());
    }

    #[test]
    fn types_have_their_dds_form() {
        assert_eq!(dds_type("std_msgs/msg/Header").unwrap(), "std_msgs::msg::dds_::Header_");
        assert!(dds_type("std_msgs/Header").is_err());
    }
}
