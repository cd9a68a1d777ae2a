//! What validation checks on each topic.

use super::report::{Report, SHOWN, TopicReport};
use crate::error::chain;
use crate::reader::{BagTopic, Message};
use crate::schema::{Schema, Visitor, decode};
use crate::topic::is_type_name;

/// Checks the messages of one topic one after the other.
pub(super) struct TopicCheck {
    name: String,
    schema: Option<Schema>,
    report: TopicReport,
    last_time: Option<u64>,
    /// Sequence numbers seen: least, greatest, and whether they are in use at all.
    sequences: Option<(u32, u32)>,
    bad_cdr: u64,
}

struct Nothing;
impl Visitor for Nothing {}

impl TopicCheck {
    /// Checks what is known before the first message.
    pub(super) fn new(topic: &BagTopic, report: &mut Report) -> Self {
        let name = topic.topic.name.clone();
        let mut fault = |text: String| report.faults.push(format!("{name}: {text}"));
        if topic.topic.message_encoding != "cdr" {
            fault(format!("message encoding {:?} is not \"cdr\"", topic.topic.message_encoding));
        }
        if !is_type_name(&topic.topic.type_name) {
            fault(format!("type {:?} is not of the form pkg/msg/Type", topic.topic.type_name));
        }
        check_hash(topic, &mut fault);
        if let Some(Err(error)) = topic.topic.offered_qos() {
            fault(chain(&error));
        }
        let schema = match (topic.topic.schema_encoding(), topic.parse_schema()) {
            (_, Ok(schema)) => Some(schema),
            ("ros2msg" | "ros2idl", Err(error)) => {
                fault(chain(&error));
                None
            }
            ("" | "unknown", _) => {
                report.warnings.push(format!("{name}: no schema known for {}", topic.topic.type_name));
                None
            }
            (other, _) => {
                fault(format!("schema encoding {other:?} is neither \"ros2msg\" nor \"ros2idl\""));
                None
            }
        };
        if topic.topic.offered_qos().is_none() {
            report.warnings.push(format!("{name}: the channel has no offered_qos_profiles"));
        }
        let report = TopicReport { topic: name.clone(), ..TopicReport::default() };
        Self { name, schema, report, last_time: None, sequences: None, bad_cdr: 0 }
    }

    /// Takes in the next message in order of time.
    pub(super) fn message(&mut self, message: &Message<'_>, faults: &mut Vec<String>) {
        self.report.messages += 1;
        if let Some(last) = self.last_time {
            let gap = message.log_time.saturating_sub(last);
            self.report.longest_gap_ns = self.report.longest_gap_ns.max(gap);
        }
        self.last_time = Some(message.log_time);
        let sequence = message.sequence;
        self.sequences = Some(match self.sequences {
            None => (sequence, sequence),
            Some((least, greatest)) => {
                self.report.out_of_order += u64::from(sequence < greatest);
                (least.min(sequence), greatest.max(sequence))
            }
        });
        let Some(schema) = &self.schema else { return };
        if let Err(error) = decode(schema, message.data, &mut Nothing) {
            self.bad_cdr += 1;
            if self.bad_cdr <= SHOWN {
                let (name, time) = (&self.name, message.log_time);
                faults.push(format!("{name}, message {sequence} at {time} ns: {}", chain(&error)));
            }
        }
    }

    /// Judges the topic as a whole.
    pub(super) fn finish(
        mut self,
        topic: &BagTopic,
        max_gap_ns: Option<u64>,
        faults: &mut Vec<String>,
        warnings: &mut Vec<String>,
    ) -> TopicReport {
        let (name, report) = (&self.name, &mut self.report);
        if self.bad_cdr > SHOWN {
            faults.push(format!("{name}: {} more messages do not decode", self.bad_cdr - SHOWN));
        }
        if report.messages != topic.messages {
            let (found, said) = (report.messages, topic.messages);
            faults.push(format!("{name}: {found} messages found, statistics say {said}"));
        }
        // Writers that do not count leave every sequence number at zero.
        if let Some((least, greatest)) = self.sequences.filter(|(_, greatest)| *greatest > 0) {
            let span = u64::from(greatest - least) + 1;
            report.missing = span.saturating_sub(report.messages);
        } else {
            report.out_of_order = 0;
        }
        if report.missing > 0 {
            let (n, of) = (report.missing, report.missing + report.messages);
            faults.push(format!("{name}: {n} of {of} sequence numbers are missing"));
        }
        if report.out_of_order > 0 {
            let n = report.out_of_order;
            warnings.push(format!("{name}: {n} messages were recorded after one of a later time"));
        }
        if let Some(limit) = max_gap_ns.filter(|limit| report.longest_gap_ns > *limit) {
            let gap = report.longest_gap_ns;
            faults.push(format!("{name}: {gap} ns without a message, the limit is {limit} ns"));
        }
        self.report
    }
}

/// Checks the type's hash; an empty one, or none, is one that was not known.
fn check_hash(topic: &BagTopic, fault: &mut impl FnMut(String)) {
    let hash = topic.topic.type_hash();
    if hash.is_empty() {
        return;
    }
    let digits = hash.strip_prefix("RIHS01_");
    if !digits.is_some_and(|d| d.len() == 64 && d.bytes().all(|b| b.is_ascii_hexdigit())) {
        fault(format!("topic_type_hash {hash:?} is no RIHS01 hash"));
    }
    let known = swath_msgs::Interface::find(&topic.topic.type_name);
    if let Some(known) = known.filter(|k| k.schema.as_bytes() == topic.topic.schema() && k.type_hash != hash) {
        fault(format!("topic_type_hash {hash:?} is not the type's, {}", known.type_hash));
    }
}
