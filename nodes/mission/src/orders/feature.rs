//! What a file of any format holds: features with properties and with lines and areas in degrees.

use std::str::FromStr;

use serde_json::{Map, Value};

use crate::shapes::sphere::Place;

/// Names of the properties that are understood.
pub const PROPERTIES: [&str; 16] = [
    "name",
    "client_ref",
    "submitter",
    "priority",
    "acquisition_speed_m_s",
    "bidirectional",
    "valid_from",
    "valid_until",
    "hold_for_approval",
    "max_attempts",
    "short_lines",
    "rows",
    "order_ref",
    "part",
    "parts",
    "share",
];

/// A feature of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Feature {
    /// Its properties by name.
    pub properties: Map<String, Value>,
    /// What it is made of, in order.
    pub parts: Vec<Part>,
}

/// A part of a feature.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// A line.
    Line(Vec<Place>),
    /// A polygon: its outer ring and those of its holes.
    Area(Vec<Vec<Place>>),
    /// Something that no strip can come from, by its name.
    Other(String),
}

impl Feature {
    /// A property that is there and not null, under the first of several names.
    #[must_use]
    pub fn property(&self, names: &[&str]) -> Option<&Value> {
        names.iter().find_map(|name| self.properties.get(*name)).filter(|value| !value.is_null())
    }

    /// A text; a number is one too.
    ///
    /// # Errors
    /// When it is neither.
    pub fn text(&self, names: &[&str]) -> Result<Option<String>, String> {
        match self.property(names) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text.clone())),
            Some(Value::Number(number)) => Ok(Some(number.to_string())),
            Some(_) => Err(format!("`{}` must be a text", names[0])),
        }
    }

    /// A number; a text that reads as one, as formats without types have it, is one too.
    ///
    /// # Errors
    /// When it is none.
    pub fn number(&self, name: &str) -> Result<Option<f64>, String> {
        match self.property(&[name]) {
            None => Ok(None),
            Some(Value::String(text)) if text.trim().is_empty() => Ok(None),
            Some(Value::String(text)) => {
                text.trim().parse().map(Some).map_err(|_| format!("`{name}` must be a number"))
            }
            Some(value) => value.as_f64().map(Some).ok_or(format!("`{name}` must be a number")),
        }
    }

    /// A word or number that stands for a choice.
    ///
    /// # Errors
    /// When it is none of the choices.
    pub fn choice<T: FromStr<Err = String>>(&self, name: &str) -> Result<Option<T>, String> {
        let text = self.text(&[name])?.filter(|text| !text.trim().is_empty());
        text.map(|text| text.trim().parse().map_err(|error| format!("`{name}`: {error}"))).transpose()
    }

    /// A flag: true or false, 1 or 0, or such a text.
    ///
    /// # Errors
    /// When it is none.
    pub fn flag(&self, name: &str) -> Result<bool, String> {
        let wrong = || format!("`{name}` must be true or false");
        match self.property(&[name]) {
            None => Ok(false),
            Some(Value::Bool(flag)) => Ok(*flag),
            Some(Value::Number(number)) if [Some(0.0), Some(1.0)].contains(&number.as_f64()) => {
                Ok(number.as_f64() == Some(1.0))
            }
            Some(Value::String(text)) => match text.trim().to_lowercase().as_str() {
                "" | "false" | "0" | "no" => Ok(false),
                "true" | "1" | "yes" => Ok(true),
                _ => Err(wrong()),
            },
            Some(_) => Err(wrong()),
        }
    }
}
