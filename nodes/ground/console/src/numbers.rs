//! Whole numbers as JSON and queries have them: 5 and 5.0 are the same, and none is greater than a signed number can be.

use std::fmt;

use serde::de::{Deserializer, Error, Visitor};
use serde::{Deserialize, de};

/// A whole number from 0 to `i64::MAX`.
///
/// # Errors
/// When it is none.
pub fn whole<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    Ok(Whole::deserialize(deserializer)?.0)
}

/// Several of them.
///
/// # Errors
/// When one is none.
pub fn wholes<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u64>, D::Error> {
    Ok(Vec::<Whole>::deserialize(deserializer)?.into_iter().map(|it| it.0).collect())
}

/// A whole number from 0 to `i32::MAX`.
///
/// # Errors
/// When it is none.
pub fn small<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    let number = whole(deserializer)?;
    let least = i32::try_from(number).map_err(|_| D::Error::custom(format!("{number} is above {}", i32::MAX)))?;
    Ok(least.unsigned_abs())
}

/// A whole number from 0 to `i64::MAX`, or null.
///
/// # Errors
/// When it is neither.
pub fn perhaps_whole<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u64>, D::Error> {
    Ok(Option::<Whole>::deserialize(deserializer)?.map(|it| it.0))
}

/// A whole number from 0 to `i32::MAX`, or null.
///
/// # Errors
/// When it is neither.
pub fn perhaps_small<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u32>, D::Error> {
    Ok(Option::<Small>::deserialize(deserializer)?.map(|it| it.0))
}

#[derive(Deserialize)]
struct Small(#[serde(deserialize_with = "small")] u32);

struct Whole(u64);

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_u64(Reader).map(Self)
    }
}

/// Numbers from here on are all whole, and several are the same (2^53).
const EXACT: f64 = 9_007_199_254_740_992.0;

struct Reader;

impl Visitor<'_> for Reader {
    type Value = u64;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a whole number from 0 to {}", i64::MAX)
    }

    fn visit_u64<E: de::Error>(self, number: u64) -> Result<u64, E> {
        let signed = i64::try_from(number).map_err(|_| E::invalid_value(de::Unexpected::Unsigned(number), &self))?;
        Ok(signed.unsigned_abs())
    }

    fn visit_i64<E: de::Error>(self, number: i64) -> Result<u64, E> {
        u64::try_from(number).map_err(|_| E::invalid_value(de::Unexpected::Signed(number), &self))
    }

    fn visit_f64<E: de::Error>(self, number: f64) -> Result<u64, E> {
        if number.fract() == 0.0 && (0.0..=EXACT).contains(&number) {
            return Ok(number as u64);
        }
        Err(E::invalid_value(de::Unexpected::Float(number), &self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Deserialize)]
    struct Asked {
        #[serde(deserialize_with = "wholes")]
        ids: Vec<u64>,
        #[serde(default, deserialize_with = "perhaps_small")]
        limit: Option<u32>,
    }

    #[test]
    fn five_is_five_however_it_is_written() {
        let asked: Asked =
            serde_json::from_str("{\"ids\": [5, 5.0, 5e0, 0, 9223372036854775807], \"limit\": 2e1}").unwrap();
        assert_eq!((asked.ids, asked.limit), (vec![5, 5, 5, 0, 9_223_372_036_854_775_807], Some(20)));
        let asked: Asked = serde_json::from_str("{\"ids\": [], \"limit\": null}").unwrap();
        assert_eq!((asked.ids, asked.limit), (vec![], None));
    }

    #[test]
    fn what_is_no_whole_number_is_told() {
        for wrong in ["-1", "1.5", "9223372036854775808", "1e300", "\"5\"", "true", "null", "-0.5"] {
            let text = format!("{{\"ids\": [{wrong}]}}");
            let error = serde_json::from_str::<Asked>(&text).err().unwrap().to_string();
            assert!(error.contains("a whole number from 0 to 9223372036854775807"), "{wrong}: {error}");
        }
        let error = serde_json::from_str::<Asked>("{\"ids\": [], \"limit\": 2147483648}").err().unwrap().to_string();
        assert!(error.contains("2147483648 is above 2147483647"), "{error}");
    }
}
