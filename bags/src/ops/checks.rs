//! What validation checks on each topic.

use super::validate::{Report, SHOWN, TopicReport};
use crate::{
    error::chain,
    qos,
    reader::{BagTopic, Message},
    schema::{Schema, Visitor, decode},
    topic::is_type_name,
};

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
        check_metadata(topic, &mut fault);
        let schema = match (topic.topic.schema_encoding.as_str(), topic.parse_schema()) {
            ("ros2msg", Ok(schema)) => Some(schema),
            ("ros2msg", Err(error)) => {
                fault(chain(&error));
                None
            }
            ("", _) => {
                let text = format!("{name}: no schema known for {}", topic.topic.type_name);
                report.warnings.push(text);
                None
            }
            (other, _) => {
                fault(format!("schema encoding {other:?} is not \"ros2msg\""));
                None
            }
        };
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

fn check_metadata(topic: &BagTopic, fault: &mut impl FnMut(String)) {
    match topic.metadata.get("offered_qos_profiles").map(|yaml| qos::from_yaml(yaml)) {
        None => fault("the channel has no offered_qos_profiles".to_owned()),
        Some(Err(error)) => fault(chain(&error)),
        Some(Ok(_)) => {}
    }
    let Some(hash) = topic.metadata.get("topic_type_hash") else {
        fault("the channel has no topic_type_hash".to_owned());
        return;
    };
    let digits = hash.strip_prefix("RIHS01_");
    let formed = digits.is_some_and(|d| d.len() == 64 && d.bytes().all(|b| b.is_ascii_hexdigit()));
    if !hash.is_empty() && !formed {
        fault(format!("topic_type_hash {hash:?} is no RIHS01 hash"));
    }
    let known = swath_msgs::Interface::find(&topic.topic.type_name);
    if let Some(known) = known.filter(|k| k.schema == topic.topic.schema && k.type_hash != hash) {
        fault(format!("topic_type_hash {hash:?} is not the type's, {}", known.type_hash));
    }
}
