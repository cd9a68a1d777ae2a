//! Log lines of `tracing` on stderr, with simulated time, and on `/rosout`, as ROS has them.

use std::fmt::{self, Write as _};
use std::io::IsTerminal as _;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use swath_msgs::rcl_interfaces::Log;
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::FormatTime;
use tracing_subscriber::layer::{Context, Layer, SubscriberExt as _};

use crate::clock::{SimClock, stamp};
use crate::topic::Publisher;

/// Sends the log lines of this process to stderr and, if there is a publisher, to `/rosout`.
///
/// `name` is the name of the logger. It has no effect when the process logs already.
pub(crate) fn install(name: String, level: Level, clock: SimClock, rosout: Option<Arc<Publisher<Log>>>) {
    let stderr = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        // Colours are for terminals; that nobody reads the log is no reason to panic.
        .with_ansi(std::io::stderr().is_terminal())
        .log_internal_errors(false)
        .with_timer(SimulatedTime(clock))
        .with_target(false);
    let rosout = rosout.map(|publisher| Rosout { name, publisher });
    let subscriber = tracing_subscriber::registry().with(LevelFilter::from_level(level)).with(stderr).with(rosout);
    // Not `try_init`, which would take in the lines of RustDDS: they are many, and sending one on
    // `/rosout` from inside of RustDDS would lock it up.
    if tracing::subscriber::set_global_default(subscriber).is_err() {
        tracing::debug!("the process logs already");
    }
}

struct SimulatedTime(SimClock);

impl FormatTime for SimulatedTime {
    fn format_time(&self, writer: &mut Writer<'_>) -> fmt::Result {
        write!(writer, "{:.3}", self.0.now_ns() as f64 / 1e9)
    }
}

struct Rosout {
    name: String,
    publisher: Arc<Publisher<Log>>,
}

impl<S: Subscriber> Layer<S> for Rosout {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut text = Text::default();
        event.record(&mut text);
        let metadata = event.metadata();
        let line = Log {
            // By the host's clock, as all of ROS stamps its log.
            stamp: stamp(SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos() as u64),
            level: severity(*metadata.level()),
            name: self.name.clone(),
            msg: text.0,
            file: metadata.file().unwrap_or_default().to_owned(),
            function: metadata.module_path().unwrap_or_default().to_owned(),
            line: metadata.line().unwrap_or_default(),
        };
        // A line that cannot be sent is on stderr all the same; logging that would not end.
        drop(self.publisher.publish(&line));
    }
}

const fn severity(level: Level) -> u8 {
    match level {
        Level::ERROR => Log::ERROR,
        Level::WARN => Log::WARN,
        Level::INFO => Log::INFO,
        _ => Log::DEBUG,
    }
}

/// The message of an event, then its fields.
#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        let gap = if self.0.is_empty() { "" } else { " " };
        // Writing to a text does not fail.
        let _ = match field.name() {
            "message" => write!(self.0, "{value:?}"),
            name => write!(self.0, "{gap}{name}={value:?}"),
        };
    }
}
