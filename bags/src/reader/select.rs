//! Which topics and which span of time.

use std::collections::HashSet;

use regex::Regex;

use super::topic::BagTopic;
use crate::error::{BagError, Result};

/// Selects topics by name and by regular expression, as `ros2 bag` does.
#[derive(Debug, Clone, Default)]
pub struct TopicPattern {
    names: Vec<String>,
    regex: Option<Regex>,
    exclude: Vec<Regex>,
}

impl TopicPattern {
    /// Names and an expression add up; without either, all topics are selected. `exclude` takes
    /// away. Expressions must match the whole name.
    ///
    /// # Errors
    /// [`BagError::Option`] when an expression is malformed.
    pub fn new(names: &[String], regex: Option<&str>, exclude: Option<&str>) -> Result<Self> {
        Ok(Self {
            names: names.to_vec(),
            regex: regex.map(|r| whole("--regex", r)).transpose()?,
            exclude: exclude.map(|r| whole("--exclude", r)).transpose()?.into_iter().collect(),
        })
    }

    /// Takes more topics away: names, or expressions for whole names.
    ///
    /// # Errors
    /// [`BagError::Option`] when an expression is malformed.
    pub fn without(mut self, topics: &[String]) -> Result<Self> {
        for topic in topics {
            self.exclude.push(whole("--exclude-topics", topic)?);
        }
        Ok(self)
    }

    /// Exactly these names, none if there are none.
    pub(crate) fn only(names: Vec<String>) -> Self {
        // Nothing is before the start of a text.
        let nothing = names.is_empty().then(|| Regex::new("a^").ok()).flatten();
        Self { names, regex: nothing, exclude: Vec::new() }
    }

    /// Whether a topic is selected.
    #[must_use]
    pub fn selects(&self, topic: &str) -> bool {
        let all = self.names.is_empty() && self.regex.is_none();
        let named = self.names.iter().any(|name| name == topic);
        let matched = self.regex.as_ref().is_some_and(|regex| regex.is_match(topic));
        let excluded = self.exclude.iter().any(|regex| regex.is_match(topic));
        (all || named || matched) && !excluded
    }

    /// The names given one by one.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }
}

/// An expression that must match a whole name.
pub(crate) fn whole(option: &'static str, pattern: &str) -> Result<Regex> {
    Regex::new(&format!("^(?:{pattern})$")).map_err(|e| BagError::Option { option, reason: e.to_string() })
}

/// Which messages are read.
#[derive(Debug, Clone)]
pub struct Filter {
    /// Which topics.
    pub topics: TopicPattern,
    /// Earliest log time, itself included [ns].
    pub from: u64,
    /// Latest log time, itself included [ns].
    pub until: u64,
}

impl Default for Filter {
    /// Everything.
    fn default() -> Self {
        Self { topics: TopicPattern::default(), from: 0, until: u64::MAX }
    }
}

impl Filter {
    /// By topic index: whether it is read.
    pub(super) fn selected(&self, topics: &[BagTopic]) -> Result<Vec<bool>> {
        let known: HashSet<&str> = topics.iter().map(|t| t.topic.name.as_str()).collect();
        for name in self.topics.names() {
            if !known.contains(name.as_str()) {
                let reason = format!("the bag has no topic {name}");
                return Err(BagError::Option { option: "--topic", reason });
            }
        }
        Ok(topics.iter().map(|t| self.topics.selects(&t.topic.name)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_expressions_add_up_and_exclusion_takes_away() {
        let names = ["/a".to_owned()];
        let pattern = TopicPattern::new(&names, Some("/x/.*"), Some(".*/secret")).unwrap();
        assert!(pattern.selects("/a"));
        assert!(pattern.selects("/x/y"));
        assert!(!pattern.selects("/b"));
        assert!(!pattern.selects("/x/secret"));
        assert!(!pattern.selects("/prefix/x/y"), "expressions match whole names");
        assert!(TopicPattern::default().selects("/anything"));
        assert!(TopicPattern::new(&[], Some("("), None).is_err());
        let pattern = TopicPattern::default().without(&["/x/.*".to_owned(), "/y".to_owned()]).unwrap();
        assert!(pattern.selects("/a") && pattern.selects("/yy") && !pattern.selects("/x/y") && !pattern.selects("/y"));
        assert!(!TopicPattern::only(Vec::new()).selects("/a"));
    }
}
