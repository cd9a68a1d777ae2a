//! `play`: a bag's messages onto a ROS 2 domain.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use serde_json::json;
use swath_ros::RosArgs;

use super::common::{ReadArgs, WITH_LOSS, bags, done, overrides, print_json};
use super::copy::seconds;
use super::signals::shutdown_on_signals;
use crate::error::{Result, chain};
use crate::out::say;
use crate::play::{End, LAST_MESSAGES, PlayOptions, Player};
use crate::reader::TopicPattern;

/// Arguments of `play`.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  swath-bag play out/bag --rate 10 --start-offset 600 --topics /swath/spacecraft/state /tf --clock

Keys: space pauses and resumes, right plays the next message while paused, up and down change the rate.
Services: ~/pause, ~/resume, ~/toggle_paused, ~/is_paused, ~/get_rate, ~/set_rate, ~/play_next, ~/burst,
~/seek, ~/stop. Words after --ros-args are those of every ROS 2 program.
Prints {\"event\":\"ready\",…} when every publisher exists, and {\"event\":\"done\",…} at the end.")]
pub struct PlayArgs {
    /// Bag directories or .mcap files, played as one bag
    #[arg(required_unless_present = "input", value_name = "BAG")]
    bags: Vec<PathBuf>,
    /// Another bag, and the kind of its files if you like
    #[arg(short, long, num_args = 1..=2, value_names = ["BAG", "KIND"])]
    input: Vec<String>,
    /// Speed: log time over wall time; 0 is as fast as it goes
    #[arg(short, long, default_value_t = 1.0, value_parser = rate)]
    rate: f64,
    /// Start anew at the end
    #[arg(short = 'l', long = "loop")]
    repeat: bool,
    /// Start so long after the bag's start [s]
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = seconds)]
    start_offset: u64,
    /// Play so much log time [s]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    playback_duration: Option<u64>,
    /// Play until so long after the bag's start [s]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "playback_duration")]
    until: Option<u64>,
    /// Play until a log time [s]; with --playback-duration, until the later of both
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "until")]
    playback_until_sec: Option<u64>,
    /// Play until a log time [ns]
    #[arg(long, value_name = "NANOSECONDS", conflicts_with_all = ["until", "playback_until_sec"])]
    playback_until_nsec: Option<u64>,
    /// Wait before the first message, so that readers are found [s]
    #[arg(short, long, value_name = "SECONDS", default_value = "0.5", value_parser = seconds)]
    delay: u64,
    /// Start paused
    #[arg(short = 'p', long)]
    start_paused: bool,
    /// Publish /clock, so often a second; the bag's own /clock is left out then
    #[arg(long, value_name = "HZ", num_args = 0..=1, default_missing_value = "40", value_parser = frequency)]
    clock: Option<f64>,
    /// Topics to play; all without this and --regex
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    topics: Vec<String>,
    /// Topics to play, by a regular expression for the whole name
    #[arg(short = 'e', long)]
    regex: Option<String>,
    /// Topics to leave out, by a regular expression for the whole name
    #[arg(short = 'x', long, visible_alias = "exclude-regex")]
    exclude: Option<String>,
    /// Topics to leave out: names, or regular expressions for whole names
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    exclude_topics: Vec<String>,
    /// Play a topic under another name
    #[arg(short = 'm', long, value_name = "OLD:=NEW", num_args = 1.., value_parser = renaming)]
    remap: Vec<(String, String)>,
    /// YAML file: by topic, what differs from the recorded QoS
    #[arg(long, value_name = "FILE")]
    qos_profile_overrides_path: Option<PathBuf>,
    /// At the end, wait until every reliable reader has everything, so long at most [ms]; 0 waits without end
    #[arg(long, value_name = "MILLISECONDS")]
    wait_for_all_acked: Option<u64>,
    /// Leave the terminal's keys alone
    #[arg(long)]
    disable_keyboard_controls: bool,
    /// Play into a mission that flies in this domain
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    read: ReadArgs,
}

impl PlayArgs {
    pub(super) fn run(self, ros: &RosArgs) -> Result<ExitCode> {
        let player = Player::start(self.options()?, ros)?;
        let shutdown = shutdown_on_signals(player.signal())?;
        let summary = player.run(&shutdown, |topics| {
            if let Err(error) = print_json(&json!({ "event": "ready", "topics": topics })) {
                tracing::warn!("{}", chain(&error));
            }
        })?;
        print_json(&json!({
            "event": "done",
            "messages": summary.published,
            "refused": summary.refused,
            "wall_seconds": summary.wall.as_secs_f64(),
            "late_p99_ms": summary.late_p99.as_secs_f64() * 1e3,
        }))?;
        if summary.refused > 0 {
            say(&format!("{} messages could not be published", summary.refused));
        }
        let code = done(&summary.faults);
        Ok(if summary.refused == 0 { code } else { ExitCode::from(WITH_LOSS) })
    }

    fn options(self) -> Result<PlayOptions> {
        let until = self.playback_until_nsec.or(self.playback_until_sec);
        let topics = TopicPattern::new(&self.topics, self.regex.as_deref(), self.exclude.as_deref())?;
        Ok(PlayOptions {
            bags: self.bags.into_iter().chain(bags(self.input)).collect(),
            read: self.read.options(),
            topics: topics.without(&self.exclude_topics)?,
            rate: self.rate,
            repeat: self.repeat,
            start_offset: self.start_offset,
            end: End { offset: self.until, duration: self.playback_duration, time: until },
            delay: Duration::from_nanos(self.delay),
            paused: self.start_paused,
            clock_hz: self.clock,
            remap: self.remap.into_iter().collect(),
            qos_overrides: overrides(self.qos_profile_overrides_path.as_deref())?,
            keys: !self.disable_keyboard_controls,
            force: self.force,
            acknowledged: match self.wait_for_all_acked {
                None => Some(LAST_MESSAGES),
                Some(0) => None,
                Some(milliseconds) => Some(Duration::from_millis(milliseconds)),
            },
        })
    }
}

fn rate(text: &str) -> Result<f64, String> {
    in_range(text, 0.0, 1e6)
}

fn frequency(text: &str) -> Result<f64, String> {
    in_range(text, 0.001, 10_000.0)
}

fn in_range(text: &str, least: f64, greatest: f64) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    match (least..=greatest).contains(&value) {
        true => Ok(value),
        false => Err(format!("{value} is outside {least} to {greatest}")),
    }
}

fn renaming(text: &str) -> Result<(String, String), String> {
    let (old, new) = text.split_once(":=").ok_or_else(|| format!("{text:?} is not OLD:=NEW"))?;
    Ok((old.to_owned(), new.to_owned()))
}
