//! Progress of a mission on stderr.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use swath_sim::task::Totals;
use swath_sim::time::{Tick, TickPeriod};

use swath_node::out;

/// A line that is rewritten on a terminal, and repeated now and then elsewhere.
pub struct Progress {
    horizon: Tick,
    period: TickPeriod,
    started: Instant,
    shown: Option<Instant>,
    terminal: bool,
    strip: String,
}

const TERMINAL_INTERVAL: Duration = Duration::from_millis(100);
const LOG_INTERVAL: Duration = Duration::from_secs(5);

impl Progress {
    /// Progress towards `horizon`.
    pub fn new(horizon: Tick, period: TickPeriod) -> Self {
        let terminal = std::io::stderr().is_terminal();
        Self { horizon, period, started: Instant::now(), shown: None, terminal, strip: String::new() }
    }

    /// The strip in hand and the attitude error.
    pub fn status(&mut self, now: Tick, phase: &str, strip: &str, attitude_error: f64, totals: &Totals) {
        self.strip = format!("{phase} {strip} |σ| {attitude_error:.3}");
        self.show(now, totals);
    }

    /// A task has ended.
    pub fn task(&mut self, now: Tick, totals: &Totals) {
        self.show(now, totals);
    }

    fn show(&mut self, now: Tick, totals: &Totals) {
        let interval = if self.terminal { TERMINAL_INTERVAL } else { LOG_INTERVAL };
        if self.shown.is_some_and(|shown| shown.elapsed() < interval) {
            return;
        }
        self.shown = Some(Instant::now());
        let flown = self.period.time_s(now);
        let factor = flown / self.started.elapsed().as_secs_f64().max(1e-3);
        let share = 100.0 * now.0 as f64 / self.horizon.0.max(1) as f64;
        let line = format!(
            "{flown:>7.0} s {share:>3.0} %  {factor:>6.0} x real time  {}/{} imaged  reward {:.2}  {}",
            totals.fulfilled, totals.attempts, totals.reward, self.strip
        );
        let mut stderr = std::io::stderr().lock();
        // Progress is for people: when nobody can read it, the mission goes on.
        let _ = if self.terminal { write!(stderr, "\r\x1b[2K{line}") } else { writeln!(stderr, "{line}") };
        let _ = stderr.flush();
    }

    /// Leaves the line.
    pub fn finish(&self) {
        if self.terminal && self.shown.is_some() {
            out::say("");
        }
    }
}
