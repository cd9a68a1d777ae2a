//! Messages as JSON.

use super::{Scalar, Schema, Visitor, decode};
use crate::error::Result;

/// Appends a message as one JSON object.
///
/// Floats that JSON has no number for become the texts `"NaN"`, `"Infinity"` and `"-Infinity"`.
///
/// # Errors
/// [`crate::BagError::Cdr`] as [`decode`] does; `out` then holds half an object.
pub fn to_json(schema: &Schema, data: &[u8], out: &mut Vec<u8>) -> Result<()> {
    decode(schema, data, &mut Json { out })
}

struct Json<'a> {
    out: &'a mut Vec<u8>,
}

impl Json<'_> {
    fn put(&mut self, value: &impl serde::Serialize) {
        let start = self.out.len();
        if serde_json::to_writer(&mut *self.out, value).is_err() {
            // Numbers and texts have no failing conversions; null keeps the object whole.
            self.out.truncate(start);
            self.out.extend_from_slice(b"null");
        }
    }

    fn comma_unless(&mut self, first: bool) {
        if !first {
            self.out.push(b',');
        }
    }
}

impl Visitor for Json<'_> {
    fn begin_struct(&mut self) {
        self.out.push(b'{');
    }

    fn field(&mut self, name: &str, first: bool) {
        self.comma_unless(first);
        self.put(&name);
        self.out.push(b':');
    }

    fn end_struct(&mut self) {
        self.out.push(b'}');
    }

    fn begin_array(&mut self, _len: usize) {
        self.out.push(b'[');
    }

    fn element(&mut self, first: bool) {
        self.comma_unless(first);
    }

    fn end_array(&mut self) {
        self.out.push(b']');
    }

    fn scalar(&mut self, value: Scalar<'_>) {
        match value {
            Scalar::Bool(value) => self.put(&value),
            Scalar::Int(value) => self.put(&value),
            Scalar::Uint(value) => self.put(&value),
            Scalar::F32(value) if value.is_finite() => self.put(&value),
            Scalar::F32(value) => self.put(&name_of(value.into())),
            Scalar::F64(value) if value.is_finite() => self.put(&value),
            Scalar::F64(value) => self.put(&name_of(value)),
            Scalar::Text(value) => self.put(&value),
        }
    }
}

fn name_of(value: f64) -> &'static str {
    match value {
        value if value.is_nan() => "NaN",
        value if value > 0.0 => "Infinity",
        _ => "-Infinity",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_of_every_kind() {
        let text = "\
bool flag
int8 small
uint64 big
float32 f
float64[3] d
string s
Pair[] pairs
===
MSG: a/Pair
int16 x
int16 y
";
        let schema = Schema::parse("a/msg/B", text).unwrap();
        let mut data = vec![0, 1, 0, 0, 1, 0xff, 0, 0, 0, 0, 0, 0];
        data.extend(u64::MAX.to_le_bytes());
        data.extend(0.1f32.to_le_bytes());
        data.extend([0; 4]);
        data.extend([0.1, f64::NAN, f64::NEG_INFINITY].map(f64::to_le_bytes).concat());
        data.extend([4, 0, 0, 0, b'a', b'"', b'b', 0]);
        data.extend([1, 0, 0, 0, 3, 0, 0xfe, 0xff]);
        let mut out = Vec::new();
        to_json(&schema, &data, &mut out).unwrap();
        assert_eq!(
            String::from_utf8(out).unwrap(),
            "{\"flag\":true,\"small\":-1,\"big\":18446744073709551615,\"f\":0.1,\
             \"d\":[0.1,\"NaN\",\"-Infinity\"],\"s\":\"a\\\"b\",\"pairs\":[{\"x\":3,\"y\":-2}]}"
        );
    }
}
