//! Serde adapters that refuse texts and sequences beyond the bound of their interface file.

use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Adapter of `T[<=N]`.
pub(crate) struct Sequence<const N: usize>;

impl<const N: usize> Sequence<N> {
    pub(crate) fn serialize<T: Serialize, S: Serializer>(values: &[T], serializer: S) -> Result<S::Ok, S::Error> {
        check::<N>(values.len()).map_err(S::Error::custom)?;
        values.serialize(serializer)
    }

    pub(crate) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<T>, D::Error> {
        let values = Vec::deserialize(deserializer)?;
        check::<N>(values.len()).map_err(D::Error::custom)?;
        Ok(values)
    }
}

/// Adapter of `string<=N`, N in bytes.
pub(crate) struct Text<const N: usize>;

impl<const N: usize> Text<N> {
    pub(crate) fn serialize<S: Serializer>(text: &str, serializer: S) -> Result<S::Ok, S::Error> {
        check::<N>(text.len()).map_err(S::Error::custom)?;
        text.serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
        let text = String::deserialize(deserializer)?;
        check::<N>(text.len()).map_err(D::Error::custom)?;
        Ok(text)
    }
}

fn check<const N: usize>(length: usize) -> Result<(), String> {
    if length > N {
        return Err(format!("length {length} exceeds the bound {N}"));
    }
    Ok(())
}
