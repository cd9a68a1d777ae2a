//! Readers that the mission does not need: they are served, and hold up nobody.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Duration;

use swath_msgs::swath_msgs::SpacecraftState;
use swath_ros::{Node, Publisher, Subscription, Trouble, graph};

use crate::common::{PATIENCE, Trial, eventually, python};
use crate::stranger::Stranger;

/// More than RustDDS holds for readers that acknowledge nothing.
const TICKS: u64 = 20_000;

/// The two nodes of the control loop.
struct Loop {
    states: Publisher<SpacecraftState>,
    received: Subscription<SpacecraftState>,
    spacecraft: Node,
    guidance: Node,
}

impl Loop {
    fn start(trial: &Trial) -> Self {
        let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
        let guidance = trial.start(graph::GUIDANCE, "").unwrap();
        let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
        let received = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
        spacecraft.wait_for_peers(&[graph::GUIDANCE], PATIENCE).unwrap();
        Self { states, received, spacecraft, guidance }
    }

    /// Sends these ticks, each when the one before has arrived.
    fn fly(&self, ticks: std::ops::Range<u64>) {
        for tick in ticks {
            self.states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
            assert_eq!(self.received.wait(self.guidance.signal(), PATIENCE).unwrap().unwrap().tick, tick);
        }
        assert_eq!(self.received.lost(), 0);
    }
}

const STATE_TYPE: &str = "swath_msgs::msg::dds_::SpacecraftState_";

#[test]
fn a_reader_that_never_acknowledges_is_served_and_holds_up_nobody() {
    let trial = Trial::new(12);
    let mission = Loop::start(&trial);
    let mut stranger = Stranger::new(trial.domain, 1);
    stranger.announce_reader(&format!("rt{}", trial.full("spacecraft/state")), STATE_TYPE);
    eventually(|| (mission.states.matched() == 2).then_some(()));
    mission.fly(0..TICKS);
    // The beginning of a state: an empty header, then the tick.
    stranger
        .receive(&[&[0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0][..], &9_u64.to_le_bytes()].concat());
    assert_eq!(mission.spacecraft.notices(), []);
}

#[test]
fn a_member_that_lags_is_let_go_and_told_of() {
    let trial = Trial::new(13);
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let mut stranger = Stranger::new(trial.domain, 2);
    // It says that it is guidance, so it is waited for; then it never acknowledges.
    let mut identity = [text(&trial.namespace), text("guidance"), text("")].concat();
    // The number of its start.
    identity.resize(identity.len().next_multiple_of(8) + 8, 0);
    stranger.announce_writer("swath_identity", "swath_msgs::msg::dds_::Identity_");
    std::thread::sleep(Duration::from_millis(300));
    stranger.write(1, &[&[0, 1, 0, 0][..], &identity].concat());
    stranger.announce_reader(&format!("rt{}", trial.full("spacecraft/state")), STATE_TYPE);
    eventually(|| (states.matched() == 1).then_some(()));
    std::thread::sleep(Duration::from_millis(300));
    for tick in 0..TICKS {
        states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
    }
    let notices = spacecraft.notices();
    assert_eq!(notices.len(), 1, "{notices:?}");
    assert_eq!(notices[0].trouble, Trouble::Lagging);
    assert_eq!(notices[0].topic, trial.full("spacecraft/state"));
}

/// A text as CDR writes it, filled up to a multiple of four.
fn text(text: &str) -> Vec<u8> {
    let mut bytes = (text.len() as u32 + 1).to_le_bytes().to_vec();
    bytes.extend_from_slice(text.as_bytes());
    bytes.resize((bytes.len() + 1).next_multiple_of(4), 0);
    bytes
}

/// A reader of CycloneDDS in a process of its own.
struct Reader {
    child: Child,
    lines: BufReader<ChildStdout>,
}

impl Reader {
    /// One that ends when it has heard the tick `last` and nothing more comes.
    fn start(trial: &Trial, last: u64) -> Self {
        let mut command = python("reader.py");
        command.arg(trial.domain.to_string()).arg(trial.full("spacecraft/state")).arg(last.to_string());
        command.env("CYCLONEDDS_URI", "<General><Interfaces><NetworkInterface name='lo'/></Interfaces></General>");
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap());
        Self { child, lines }
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.lines.read_line(&mut line).unwrap();
        line.trim().to_owned()
    }

    fn signal(&self, signal: &str) {
        assert!(Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap().success());
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn readers_of_cyclonedds_that_sleep_or_die_hold_up_nobody() {
    let trial = Trial::new(14);
    let mission = Loop::start(&trial);
    let mut readers: Vec<Reader> = (0..3).map(|_| Reader::start(&trial, TICKS + 99)).collect();
    readers.push(Reader::start(&trial, TICKS - 1));
    eventually(|| (mission.states.matched() == 5).then_some(()));
    std::thread::sleep(Duration::from_secs(1));
    mission.fly(0..10);
    for reader in &mut readers {
        assert_eq!((reader.line().as_str(), reader.line().as_str()), ("ready", "reading"));
    }
    readers[0].signal("-STOP");
    readers[1].signal("-STOP");
    readers[2].signal("-KILL");
    mission.fly(10..TICKS);
    // The healthy one has heard all, and one that wakes up hears what comes from then on.
    assert_eq!(readers[3].line(), format!("{TICKS} received, the last is {}", TICKS - 1));
    readers[0].signal("-CONT");
    std::thread::sleep(Duration::from_secs(1));
    mission.fly(TICKS..TICKS + 100);
    assert!(readers[0].line().ends_with(&format!("the last is {}", TICKS + 99)), "{TICKS}");
    // Those that are silent for longer than their lease are told of.
    let mut silent = 0;
    eventually(|| {
        for notice in mission.spacecraft.notices() {
            assert_eq!((notice.trouble, notice.topic.as_str()), (Trouble::Lagging, mission.states.topic()), "{notice}");
            assert!(notice.text.ends_with("is silent, and served no longer"), "{notice}");
            silent += notice.count;
        }
        (silent >= 2).then_some(())
    });
}
