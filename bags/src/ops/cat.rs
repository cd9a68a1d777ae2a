//! Prints messages as JSON lines.

use std::collections::BTreeMap;
use std::io::{self, Write};

use super::note;
use crate::error::{BagError, Result, chain};
use crate::reader::{Bag, BagTopic, Filter};
use crate::schema::{Schema, to_json};
use crate::topic::Topic;

/// Writes one JSON object a message: topic, type, time [s], `log_time_ns`, sequence, message.
///
/// A message whose type has no schema, or whose bytes do not fit it, has `error` instead of
/// `message`. Returns the number of messages written.
///
/// # Errors
/// [`BagError::Io`] when `out` refuses; damage is passed over and added to `faults`.
pub fn cat(
    bag: &Bag,
    filter: &Filter,
    limit: Option<u64>,
    out: &mut dyn Write,
    faults: &mut Vec<String>,
) -> Result<u64> {
    let mut schemas: BTreeMap<usize, Result<Schema, String>> = BTreeMap::new();
    let mut messages = bag.messages(filter)?;
    let mut line = Vec::new();
    let mut written = 0;
    while limit.is_none_or(|limit| written < limit) {
        let message = match messages.next() {
            Ok(Some(message)) => message,
            Ok(None) => break,
            Err(error) => {
                note(faults, &error);
                continue;
            }
        };
        let topic = &bag.topics()[message.topic];
        let schema = schemas.entry(message.topic).or_insert_with(|| schema_of(topic));
        line.clear();
        let (name, kind) = (&topic.topic.name, &topic.topic.type_name);
        let start = serde_json::json!({ "topic": name, "type": kind }).to_string();
        line.extend_from_slice(start.trim_end_matches('}').as_bytes());
        let (seconds, nanoseconds) = (message.log_time / 1_000_000_000, message.log_time % 1_000_000_000);
        let (time, sequence) = (message.log_time, message.sequence);
        let times = format!(",\"time\":{seconds}.{nanoseconds:09},\"log_time_ns\":{time},\"sequence\":{sequence},");
        line.extend_from_slice(times.as_bytes());
        put_message(schema.as_ref(), message.data, &mut line);
        line.extend_from_slice(b"}\n");
        out.write_all(&line).map_err(cannot_print)?;
        written += 1;
    }
    out.flush().map_err(cannot_print)?;
    Ok(written)
}

/// The parsed schema of a topic, or why there is none.
fn schema_of(topic: &BagTopic) -> Result<Schema, String> {
    let Topic { type_name, message_encoding, .. } = &topic.topic;
    if message_encoding != "cdr" {
        return Err(format!("message encoding {message_encoding:?} is not cdr"));
    }
    match topic.topic.schema_encoding() {
        "" => Err(format!("no schema known for {type_name}")),
        _ => topic.parse_schema().map_err(|e| chain(&e)),
    }
}

fn put_message(schema: Result<&Schema, &String>, data: &[u8], line: &mut Vec<u8>) {
    let start = line.len();
    line.extend_from_slice(b"\"message\":");
    let error = match schema {
        Ok(schema) => match to_json(schema, data, line) {
            Ok(()) => return,
            Err(error) => chain(&error),
        },
        Err(error) => error.clone(),
    };
    line.truncate(start);
    let error = serde_json::Value::from(error);
    line.extend_from_slice(format!("\"error\":{error}").as_bytes());
}

fn cannot_print(source: io::Error) -> BagError {
    BagError::Io { action: "write to", path: "standard output".into(), source }
}
