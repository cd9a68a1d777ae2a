//! The simulated time that a message carries, read from its bytes.

use crate::schema::{Count, Element, Field, Schema};

/// Where messages of a type carry their time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StampPlace {
    /// They begin with a `builtin_interfaces/Time`, alone or in a header.
    Start,
    /// They begin with a sequence whose elements do, as transforms: the first one's counts.
    FirstElement,
    /// Nowhere at the start.
    Nowhere,
}

impl StampPlace {
    /// By a message type's schema.
    pub(crate) fn of(schema: &Schema) -> Self {
        if begins_with_time(schema, 0) {
            return Self::Start;
        }
        match schema.structs[0].fields.first() {
            Some(Field { element: Element::Struct(inner), count: Count::Sequence(_), .. })
                if begins_with_time(schema, *inner) =>
            {
                Self::FirstElement
            }
            _ => Self::Nowhere,
        }
    }

    /// Reads the time [ns] from CDR bytes, encapsulation header included; a stamp of 0 is one that was not set.
    pub(crate) fn read(self, cdr: &[u8]) -> Option<u64> {
        let little = cdr.get(1)? & 1 == 1;
        let word = |at: usize| {
            let bytes = cdr.get(at..at + 4)?.first_chunk()?;
            Some(if little { u32::from_le_bytes(*bytes) } else { u32::from_be_bytes(*bytes) })
        };
        let at = match self {
            Self::Start => 4,
            Self::FirstElement if word(4)? > 0 => 8,
            Self::FirstElement | Self::Nowhere => return None,
        };
        // Seconds are signed; a time before zero has no place in a bag.
        let seconds = u64::try_from(word(at)?.cast_signed()).ok()?;
        Some(seconds * 1_000_000_000 + u64::from(word(at + 4)?)).filter(|stamp| *stamp > 0)
    }
}

/// Whether a struct's first bytes are a time.
fn begins_with_time(schema: &Schema, mut index: usize) -> bool {
    loop {
        let definition = &schema.structs[index];
        if definition.name == "builtin_interfaces/Time" {
            return true;
        }
        match definition.fields.first() {
            Some(Field { element: Element::Struct(inner), count: Count::One, .. }) => index = *inner,
            _ => return false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(type_name: &str) -> StampPlace {
        let known = swath_msgs::Interface::find(type_name).unwrap();
        StampPlace::of(&Schema::parse(type_name, known.schema).unwrap())
    }

    #[test]
    fn where_types_carry_their_time() {
        for type_name in ["std_msgs/msg/Header", "rosgraph_msgs/msg/Clock", "swath_msgs/msg/SpacecraftState"] {
            assert_eq!(place(type_name), StampPlace::Start, "{type_name}");
        }
        assert_eq!(place("tf2_msgs/msg/TFMessage"), StampPlace::FirstElement);
        assert_eq!(place("geometry_msgs/msg/Vector3"), StampPlace::Nowhere);
    }

    #[test]
    fn both_byte_orders_and_short_bytes() {
        let little = [0, 1, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0];
        let big = [0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 3];
        assert_eq!(StampPlace::Start.read(&little), Some(2_000_000_003));
        assert_eq!(StampPlace::Start.read(&big), Some(2_000_000_003));
        assert_eq!(StampPlace::Start.read(&little[..11]), None);
        assert_eq!(StampPlace::Start.read(&[]), None);
        assert_eq!(StampPlace::Start.read(&[0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0]), None);
        let sequence = [&[0, 1, 0, 0, 1, 0, 0, 0][..], &little[4..]].concat();
        assert_eq!(StampPlace::FirstElement.read(&sequence), Some(2_000_000_003));
        assert_eq!(StampPlace::FirstElement.read(&[0, 1, 0, 0, 0, 0, 0, 0]), None);
        assert_eq!(StampPlace::Nowhere.read(&little), None);
    }
}
