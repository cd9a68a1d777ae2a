//! Files of requests on the command line, and how their lines and areas become strips.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Result, ensure};
use clap::Args;
use serde_json::{Value, json};
use swath_msgs::swath_msgs as msg;
use swath_node::out;
use swath_ros::{RosArgs, graph};
use swath_sim::config::SimConfig;

use super::client::Operator;
use swath_mission::orders::feature::{Feature, Part};
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::orders::formats::Features;
use swath_mission::orders::found::{Cut, Import, Shown};
use swath_mission::orders::import::{features, import_features, write};
use swath_mission::orders::rows::Rows;
use swath_mission::orders::short_lines::ShortLines;
use swath_node::orders::cutting_of;

/// How lines and areas become strips.
#[derive(Debug, Args)]
pub struct CuttingArgs {
    /// Longest strip [km]; the mission's limit without this
    #[arg(long)]
    max_length_km: Option<f64>,
    /// Width of what the camera shows [km]; the mission's without this
    #[arg(long)]
    swath_km: Option<f64>,
    /// Greatest distance of a line from its strips [km]; half a swath without this
    #[arg(long)]
    tolerance_km: Option<f64>,
    /// Direction of the strips of areas: that with the fewest, that of the satellite's passes, or a heading clockwise
    /// from north [deg]
    #[arg(long, allow_hyphen_values = true, value_name = "fewest|passes|DEG", default_value_t)]
    rows: Rows,
    /// What becomes of lines that are shorter than the shortest strip
    #[arg(long, value_name = "refuse|stretch|join", default_value_t)]
    short_lines: ShortLines,
}

/// How long a dry run waits for a mission to tell its limits.
const DRY_PATIENCE: Duration = Duration::from_secs(3);

impl CuttingArgs {
    /// With the limits of the mission that is flying.
    ///
    /// # Errors
    /// When nobody answers or an option is out of range.
    pub fn of_mission(&self, operator: &Operator) -> Result<Cutting> {
        self.usual()?;
        let limits = operator.desk(&graph::GET_LIMITS)?.call(msg::GetLimitsRequest::default())?;
        self.with(&cutting_of(&limits))
    }

    /// With the limits of the mission that is flying, if one is, else with the usual ones.
    ///
    /// # Errors
    /// When an option is out of range.
    pub fn of_any(&self, ros: &RosArgs) -> Result<Cutting> {
        self.usual()?;
        let operator = Operator::start(ros)?;
        let limits = operator.desk_within(&graph::GET_LIMITS, DRY_PATIENCE);
        match limits.and_then(|desk| desk.call(msg::GetLimitsRequest::default())) {
            Ok(limits) => self.with(&cutting_of(&limits)),
            Err(_) => {
                out::say("no mission is flying in this domain: strips are cut by the usual limits");
                self.usual()
            }
        }
    }

    /// With the usual limits.
    ///
    /// # Errors
    /// When an option is out of range.
    pub fn usual(&self) -> Result<Cutting> {
        self.with(&Cutting::of(&SimConfig::default()))
    }

    fn with(&self, limits: &Cutting) -> Result<Cutting> {
        let within = |name: &str, value: Option<f64>, least: f64, greatest: f64| match value {
            Some(value) if !(least..=greatest).contains(&value) => {
                anyhow::bail!("--{name} is {value}, outside {least} to {greatest}")
            }
            value => Ok(value),
        };
        let longest_km = within("max-length-km", self.max_length_km, 1.0, 5000.0)?.unwrap_or(limits.longest_km);
        let swath_km = within("swath-km", self.swath_km, 0.1, 1000.0)?.unwrap_or(limits.swath_km);
        let tolerance_km = within("tolerance-km", self.tolerance_km, 0.01, 1000.0)?.unwrap_or(0.5 * swath_km);
        Ok(Cutting {
            shortest_km: limits.shortest_km.min(longest_km),
            longest_km,
            swath_km,
            tolerance_km,
            rows: self.rows,
            short_lines: self.short_lines,
            ..*limits
        })
    }
}

/// Files as they were read, before anybody is asked how long a strip may be.
pub struct Files(Vec<(PathBuf, Features)>);

impl Files {
    /// Reads files, `-` for standard input.
    ///
    /// # Errors
    /// When a file as a whole cannot be read.
    pub fn read(files: &[PathBuf]) -> Result<Self> {
        ensure!(files.iter().filter(|file| file.as_os_str() == "-").count() < 2, "standard input can be read once");
        Ok(Self(files.iter().map(|file| Ok((file.clone(), features(file)?))).collect::<Result<_>>()?))
    }

    /// How many lines and areas there are; the areas of a feature are one.
    #[must_use]
    pub fn shapes(&self) -> usize {
        let of_feature = |feature: &Feature| {
            let lines = feature.parts.iter().filter(|part| matches!(part, Part::Line(_))).count();
            lines + usize::from(feature.parts.iter().any(|part| matches!(part, Part::Area(_))))
        };
        self.0.iter().flat_map(|(_, features)| features.iter().flatten()).map(of_feature).sum()
    }

    /// Makes strips of them; what is no strip is told on stderr.
    #[must_use]
    pub fn cut(self, cutting: &Cutting) -> Import {
        let mut all = Import::default();
        for (file, features) in self.0 {
            let import = import_features(features, &file, cutting);
            for fault in &import.refused {
                out::say(printable(&fault.to_string()));
            }
            all.shapes += import.shapes;
            all.orders.extend(import.orders);
            all.cut.extend(import.cut);
            all.refused.extend(import.refused);
        }
        all
    }
}

/// Writes strips to a file, `-` for standard output.
///
/// # Errors
/// When it cannot be written.
pub fn write_file(path: &Path, import: &Import) -> Result<()> {
    let path = if path.as_os_str() == "-" { Path::new("/dev/stdout") } else { path };
    Ok(write(path, &import.orders)?)
}

/// What became of lines and areas, for people: of those that are other than their strips.
#[must_use]
pub fn cut_text(cut: &[Cut]) -> String {
    let mut text = String::new();
    for cut in cut.iter().filter(|cut| cut.is_worth_a_word()) {
        let name = printable(&cut.name);
        let strips = if cut.strips == 1 { "1 strip".to_owned() } else { format!("{} strips", cut.strips) };
        _ = match cut.shown {
            Shown::Line { length_km, farthest_km, .. } => writeln!(
                text,
                "cut       {name}: a line of {length_km:.0} km, {strips}, at most {farthest_km:.1} km from it"
            ),
            Shown::Area { square_km, covered, twice } => writeln!(
                text,
                "cut       {name}: an area of {square_km:.0} km², {strips}, {:.1} % shown, {:.1} % twice",
                100.0 * covered,
                100.0 * twice
            ),
        };
        if let Shown::Line { too_short: true, .. } = cut.shown {
            text += "          too short for a strip: --short-lines stretches or joins such lines\n";
        }
        for reason in &cut.left_out {
            _ = writeln!(text, "          left out {}", printable(reason));
        }
    }
    text
}

/// What became of lines and areas, for machines.
#[must_use]
pub fn cut_json(cut: &[Cut]) -> Value {
    let one = |Cut { name, strips, shown, left_out }: &Cut| match shown {
        Shown::Line { length_km, farthest_km, too_short } => json!({
            "line": name, "strips": strips, "length_km": length_km, "farthest_km": farthest_km,
            "too_short": too_short, "left_out": left_out,
        }),
        Shown::Area { square_km, covered, twice } => {
            json!({ "area": name, "strips": strips, "square_km": square_km, "covered": covered, "twice": twice })
        }
    };
    cut.iter().map(one).collect()
}

/// A text of someone else's without what would steer the terminal.
#[must_use]
pub fn printable(text: &str) -> String {
    let escaped =
        |letter: char| if letter.is_control() { letter.escape_default().to_string() } else { letter.to_string() };
    text.chars().map(escaped).collect()
}
