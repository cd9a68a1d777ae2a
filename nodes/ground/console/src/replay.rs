//! A recorded mission: its bag told to the ledger, message by message.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use swath_bags::cli::{MANIFEST, MANIFEST_TEXT};
use swath_bags::schema::{Schema, adapt};
use swath_bags::{Bag, BagTopic, Filter, Topic, TopicPattern};
use swath_mission::file::Mission;
use swath_msgs::RosMessage;
use swath_msgs::swath_msgs as msg;
use swath_ros::{Cdr, decode, graph};

use crate::ledger::Ledger;

/// What a bag says of itself.
pub struct Recording {
    /// Name of the mission.
    pub title: String,
    /// Least elevation of the satellite over a target's horizon [deg].
    pub elevation_min_deg: f64,
}

/// Reads a bag into the ledger.
///
/// # Errors
/// When the bag cannot be read, or holds no mission of this namespace.
pub fn read(path: &Path, namespace: &str, ledger: &mut Ledger) -> Result<Recording> {
    let bag = Bag::open(path)?;
    let mission = mission(&bag).with_context(|| format!("{} holds no mission", path.display()))?;
    ledger.know(&mission);
    let readers = readers(&bag, namespace.trim_end_matches('/'))?;
    let names: Vec<String> = bag.topics().iter().map(|topic| topic.topic.name.clone()).collect();
    let wanted: Vec<String> =
        names.iter().zip(&readers).filter(|(_, reader)| reader.is_some()).map(|(name, _)| name.clone()).collect();
    if wanted.is_empty() {
        bail!("the bag has no topic of {namespace}: is --namespace right?");
    }
    let topics = TopicPattern::new(&wanted, None, None)?;
    let mut messages = bag.messages(&Filter { topics, ..Filter::default() })?;
    while let Some(message) = messages.next()? {
        if let Some(reader) = readers.get(message.topic).and_then(Option::as_ref) {
            let time = message.log_time;
            reader(ledger, message.data).with_context(|| format!("{} at {time} ns", names[message.topic]))?;
        }
    }
    Ok(Recording { title: mission.name, elevation_min_deg: mission.sim.imaging.elevation_min_deg })
}

/// Tells the ledger of a message of one topic.
type Reader = Box<dyn Fn(&mut Ledger, &[u8]) -> Result<()>>;

/// A reader for each topic of the bag that the console knows.
fn readers(bag: &Bag, namespace: &str) -> Result<Vec<Option<Reader>>> {
    // Before the request manager settled rewards, guidance told of tasks that ended.
    let settled = format!("{namespace}/{}", graph::TASK_RESULTS.entry.name);
    let settled_apart = bag.topics().iter().any(|topic| topic.topic.name == settled);
    let tell_of_points = move |ledger: &mut Ledger, point: &msg::DecisionPoint| {
        if !settled_apart {
            point.result.iter().for_each(|result| ledger.result(result));
        }
    };
    let of = |topic: &BagTopic| -> Result<Option<Reader>> {
        let topic = &topic.topic;
        let name = topic.name.strip_prefix(namespace).and_then(|name| name.strip_prefix('/')).unwrap_or(&topic.name);
        let is = |entry: graph::Entry| entry.name == name;
        Ok(Some(match name {
            _ if is(graph::STRIP_EVENTS.entry) => reader(topic, Ledger::strip)?,
            _ if is(graph::SUB_SATELLITE_POINT.entry) => reader(topic, Ledger::point)?,
            _ if is(graph::WHEELS.entry) => reader(topic, Ledger::wheels)?,
            _ if is(graph::GUIDANCE_STATUS.entry) => reader(topic, Ledger::guidance)?,
            _ if is(graph::PLANNER_TASK.entry) => reader(topic, Ledger::task)?,
            _ if is(graph::TASK_RESULTS.entry) => reader(topic, Ledger::result)?,
            _ if is(graph::DECISION_POINT.entry) => reader(topic, tell_of_points)?,
            _ if is(graph::UPCOMING_STRIPS.entry) => reader(topic, Ledger::offer)?,
            _ if is(graph::PLANNER_DECISION.entry) => reader(topic, Ledger::choice)?,
            _ if is(graph::PLANNER_STATUS.entry) => reader(topic, Ledger::planner)?,
            _ if is(graph::REQUEST_SUMMARY.entry) => reader(topic, Ledger::summary)?,
            _ if is(graph::LINK_STATUS.entry) => reader(topic, Ledger::link)?,
            _ if is(graph::PREDICTED_PLAN.entry) => reader(topic, Ledger::plan)?,
            _ if is(graph::RESOURCES.entry) => reader(topic, Ledger::resources)?,
            _ if is(graph::STANDING_ALARMS.entry) => reader(topic, Ledger::standing)?,
            _ if is(graph::ALARM_EVENTS.entry) => reader(topic, Ledger::alarm_event)?,
            _ if is(graph::DIAGNOSTICS.entry) => reader(topic, Ledger::diagnostics)?,
            _ => return Ok(None),
        }))
    };
    bag.topics().iter().map(of).collect()
}

/// What an earlier version recorded is read by what the recording says of its types.
fn reader<M: RosMessage + 'static>(topic: &Topic, tell: impl Fn(&mut Ledger, &M) + 'static) -> Result<Reader> {
    ensure!(
        topic.type_name == M::TYPE_NAME,
        "topic {} is of type {}, not {}",
        topic.name,
        topic.type_name,
        M::TYPE_NAME
    );
    let own = Schema::parse(M::TYPE_NAME, M::SCHEMA)?;
    let then = Schema::of(topic)?;
    Ok(Box::new(move |ledger, data| {
        let data = if then == own { data.to_vec() } else { adapt(&then, &own, data)? };
        tell(ledger, &decode(&Cdr::from_bytes(data))?);
        Ok(())
    }))
}

fn mission(bag: &Bag) -> Result<Mission> {
    let manifest = bag.metadata_named(MANIFEST).with_context(|| format!("no metadata record {MANIFEST}"))?;
    let text = manifest.get(MANIFEST_TEXT).with_context(|| format!("{MANIFEST} has no entry {MANIFEST_TEXT}"))?;
    toml::from_str(text).with_context(|| format!("{MANIFEST} is no mission"))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde_json::{Value, json};
    use swath_bags::{BagOptions, BagWriter};
    use swath_ros::encode;

    use super::*;

    const MISSION: &str =
        "name = \"of tests\"\n[link]\nstations = [\"awarua\"]\n[resources]\nwheel_momentum_max_nms = 8.0\n";
    const EPOCH_S: i32 = 1_767_225_600;

    fn write<M: RosMessage>(bag: &BagWriter, topic: &graph::Topic<M>, message: &M) {
        let entry = topic.entry;
        let name = format!("/swath/{}", entry.name);
        let topic = Topic::new(&name, entry.type_name, M::SCHEMA, "", Vec::new()).unwrap();
        bag.write(bag.add_topic(&topic).unwrap(), 1, 1, encode(message).unwrap().as_bytes()).unwrap();
    }

    fn header(seconds: i32) -> swath_msgs::std_msgs::Header {
        let mut header = swath_msgs::std_msgs::Header::default();
        header.stamp.sec = EPOCH_S + seconds;
        header
    }

    #[test]
    fn radio_plan_and_resources_are_read_from_a_bag() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag");
        let bag = BagWriter::create(&path, BagOptions::default()).unwrap();
        bag.add_metadata(MANIFEST, BTreeMap::from([(MANIFEST_TEXT.to_owned(), MISSION.to_owned())]));
        let link = msg::LinkStatus { header: header(10), tick: 20, open: true, imaged: 4, ..Default::default() };
        write(&bag, &graph::LINK_STATUS, &link);
        let tasks = vec![msg::PredictedTask { task: 3, strip_id: 9, start_tick: 100, ..Default::default() }];
        let plan =
            msg::PredictedPlan { header: header(11), tick: 22, compared: 5, equal: 4, tasks, ..Default::default() };
        write(&bag, &graph::PREDICTED_PLAN, &plan);
        let (charge, capacity, wheel_momentum) = (9.0, 12.0, 6.0);
        let state =
            msg::ResourceState { header: header(20), tick: 40, charge, capacity, wheel_momentum, ..Default::default() };
        write(&bag, &graph::RESOURCES, &state);
        bag.close().unwrap();

        let mut ledger = Ledger::default();
        assert_eq!(read(&path, "/swath", &mut ledger).unwrap().title, "of tests");
        let facts: Vec<Value> =
            ledger.after(0, usize::MAX).iter().map(|line| serde_json::from_str(line).unwrap()).collect();
        let of = |kind: &str| facts.iter().find(|fact| fact["kind"] == kind).unwrap();
        assert_eq!((&of("link")["open"], &of("link")["imaged"]), (&json!(true), &json!(4)));
        assert_eq!((&of("plan")["equal"], &of("plan")["tasks"][0]["strip"]), (&json!(4), &json!(9)));
        // The limit is the recorded mission's.
        let resources = of("resources");
        assert_eq!((&resources["battery"], &resources["momentum"]), (&json!(0.75), &json!(0.75)));
    }
}
