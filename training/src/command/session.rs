//! One process's part of a training run: it learns, reports, saves, and stops when it is asked to.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::{Context, Result};
use indicatif::{MultiProgress, ProgressBar};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level;
use swath_training::TrainingError;
use swath_training::stop::Stop;
use swath_training::tensorboard::events::EventWriter;
use swath_training::tensorboard::scalars::Report;
use swath_training::trainer::Trainer;

use super::output::{bar, say};
use super::run_folder::RunFolder;

/// Exit code of a process that was interrupted.
const INTERRUPTED: i32 = 130;

/// What SIGINT and SIGTERM mean to a run.
#[derive(Clone)]
pub struct Signalled {
    /// Asks the run to save and leave.
    stop: Stop,
    /// Whether there is something to save.
    begun: Arc<AtomicBool>,
    screen: MultiProgress,
}

impl Signalled {
    /// Listens from now on. The first signal asks the run to save and leave, and says so at once; a second one ends the
    /// process, as does one that comes before there is anything to save.
    ///
    /// # Errors
    /// When the system lets nobody listen.
    pub fn listen() -> Result<Self> {
        let signalled = Self { stop: Stop::default(), begun: Arc::default(), screen: MultiProgress::new() };
        let mut signals = Signals::new([SIGINT, SIGTERM]).context("cannot catch Ctrl-C")?;
        let own = signalled.clone();
        std::thread::spawn(move || signals.forever().for_each(|signal| own.hear(signal)));
        Ok(signalled)
    }

    fn hear(&self, signal: i32) {
        let name = low_level::signal_name(signal).unwrap_or("signal");
        if !self.begun.load(Ordering::SeqCst) {
            say(&format!("{name}: nothing to save yet"));
            low_level::exit(INTERRUPTED);
        }
        if self.stop.is_requested() {
            low_level::exit(INTERRUPTED);
        }
        self.stop.request();
        self.say(&format!("{name}: the run is saved as it was before this update; once more to leave at once"));
    }

    /// Says something above the progress bar.
    fn say(&self, text: &str) {
        self.screen.suspend(|| say(text));
    }
}

/// One process's part of a run.
pub struct Session<'a> {
    folder: &'a RunFolder,
    signalled: Signalled,
    bar: ProgressBar,
    events: EventWriter,
    began: Instant,
    first_step: u64,
    /// Steps, or within a warm start decisions shown, at the last save.
    saved_at: u64,
    last_return: f64,
}

impl<'a> Session<'a> {
    /// Readies a run to go on.
    ///
    /// # Errors
    /// An event file that cannot be written.
    pub fn new(folder: &'a RunFolder, trainer: &mut Trainer, signalled: Signalled) -> Result<Self> {
        trainer.stop_on(signalled.stop.clone());
        let events = EventWriter::create(folder.path())?;
        signalled.begun.store(true, Ordering::SeqCst);
        Ok(Self {
            folder,
            signalled,
            bar: ProgressBar::hidden(),
            events,
            began: Instant::now(),
            first_step: trainer.steps(),
            saved_at: trainer.lessons_shown().unwrap_or(trainer.steps()),
            last_return: f64::NAN,
        })
    }

    /// Goes on until the run is finished, has taken `stop_at` steps, or is asked to stop; saves in the end.
    ///
    /// # Errors
    /// Numbers that are not finite, and files that cannot be written.
    pub fn run(&mut self, trainer: &mut Trainer, stop_at: u64) -> Result<()> {
        let outcome = self.warm_start(trainer).and_then(|()| self.learn(trainer, stop_at));
        self.bar.finish_and_clear();
        match outcome.err().map(|error| error.downcast::<TrainingError>()) {
            None | Some(Ok(TrainingError::Stopped)) => self.save(trainer),
            Some(Ok(error)) => Err(error.into()),
            Some(Err(error)) => Err(error),
        }
    }

    /// Learns from the teacher, if the run has one, saving on the way and in the end.
    fn warm_start(&mut self, trainer: &mut Trainer) -> Result<()> {
        let (Some(shown), Some(decisions)) = (trainer.lessons_shown(), trainer.run().warm_start.as_ref()) else {
            return Ok(());
        };
        self.draw(decisions.decisions, "warm start {bar:24} {pos} of {len} decisions  {msg}  {eta} left", shown)?;
        while let Some(report) = trainer.lesson()? {
            let (likelihood, explained) = (report.update.surrogate, report.update.explained_variance);
            self.bar.set_position(report.steps);
            self.bar.set_message(format!("log-likelihood {likelihood:.3}  critic explains {explained:.2}"));
            if self.bar.is_hidden() {
                say(&format!(
                    "warm start: {} decisions shown, log-likelihood {likelihood:.3}, critic explains {explained:.2}",
                    report.steps
                ));
            }
            self.save_when_due(trainer, report.steps);
        }
        self.saved_at = trainer.steps();
        self.save_or_warn(trainer);
        Ok(())
    }

    fn learn(&mut self, trainer: &mut Trainer, stop_at: u64) -> Result<()> {
        self.draw(trainer.run().steps, "{bar:24} {pos} of {len} steps  {msg}  {eta} left", trainer.steps())?;
        self.began = Instant::now();
        while !trainer.is_finished() && trainer.steps() < stop_at {
            let report = trainer.advance()?;
            self.record(&report)?;
            if !trainer.is_finished() {
                self.save_when_due(trainer, trainer.steps());
            }
        }
        Ok(())
    }

    fn draw(&mut self, length: u64, template: &str, position: u64) -> Result<()> {
        self.bar.finish_and_clear();
        self.bar = self.signalled.screen.add(bar(length, template)?);
        self.bar.set_position(position);
        self.bar.reset_eta();
        Ok(())
    }

    /// Saves when enough was learned since the last time.
    fn save_when_due(&mut self, trainer: &Trainer, position: u64) {
        if position < self.saved_at + trainer.run().checkpoint_every {
            return;
        }
        self.saved_at = position;
        self.save_or_warn(trainer);
    }

    fn save_or_warn(&self, trainer: &Trainer) {
        if let Err(error) = self.save(trainer) {
            // The last good checkpoint is still there; there may be room again later.
            self.signalled.say(&format!("warning: {error:#}"));
        }
    }

    fn save(&self, trainer: &Trainer) -> Result<()> {
        let saved = self.folder.save(trainer)?;
        self.signalled.say(&format!("saved {}", saved.display()));
        Ok(())
    }

    fn record(&mut self, report: &Report) -> Result<()> {
        let speed = (report.steps - self.first_step) as f64 / self.began.elapsed().as_secs_f64();
        if report.episode_return.is_finite() {
            self.last_return = report.episode_return;
        }
        let scalars = report.scalars(speed);
        self.events.scalars(report.steps, &scalars, self.folder.path())?;
        let mut line = serde_json::Map::from_iter([("steps".to_owned(), report.steps.into())]);
        line.extend(scalars.iter().map(|(name, value)| ((*name).to_owned(), (*value).into())));
        self.folder.record(&serde_json::Value::Object(line).to_string())?;
        self.bar.set_position(report.steps);
        self.bar.set_message(format!(
            "{speed:.0} steps/s  return {:.2}  {:.2}/orbit  success {:.1} %  T_pre {:.1} s",
            self.last_return,
            report.reward_per_orbit,
            report.success_rate * 100.0,
            report.t_pre_s,
        ));
        Ok(())
    }
}
