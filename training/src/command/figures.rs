//! `swath-train figures`: the paper's Figures 3, 4 and 5 from recorded runs and evaluations.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use clap::Args;
use serde::Deserialize;
use swath_training::figures::{self, Bars, Box, Curve};

/// Options of `swath-train figures`.
#[derive(Debug, Args)]
pub struct FiguresArgs {
    /// A learning curve of Fig. 3: LABEL=progress.jsonl; curves of one label are averaged
    #[arg(long = "curve", value_name = "LABEL=FILE", value_parser = labelled)]
    curves: Vec<(String, PathBuf)>,
    /// A figure like Fig. 4, rewards by planner: its name and the JSON of `swath-train evaluate`
    #[arg(long = "evaluation", value_name = "NAME=FILE", value_parser = labelled)]
    evaluations: Vec<(String, PathBuf)>,
    /// JSON of `swath-train evaluate --requests N` for Fig. 5, one for each density
    #[arg(long = "density", value_name = "FILE")]
    densities: Vec<PathBuf>,
    /// Folder for the SVG and PNG files
    #[arg(long, value_name = "FOLDER", default_value = "out/figures")]
    out: PathBuf,
}

/// What is read of an evaluation.
#[derive(Debug, Deserialize)]
struct Evaluation {
    missions: MissionSettings,
    planners: Vec<PlannerResult>,
}

#[derive(Debug, Deserialize)]
struct MissionSettings {
    requests: [u32; 2],
}

#[derive(Debug, Deserialize)]
struct PlannerResult {
    planner: String,
    missions: Vec<MissionResult>,
    reward_per_orbit: Mean,
    attempts_per_orbit: Mean,
    priority: Mean,
    t_pre_s: Mean,
    t_acq_s: Mean,
}

#[derive(Debug, Deserialize)]
struct MissionResult {
    reward_per_orbit: f64,
}

#[derive(Debug, Deserialize)]
struct Mean {
    mean: f64,
    deviation: f64,
}

fn labelled(text: &str) -> Result<(String, PathBuf), String> {
    let (label, file) = text.split_once('=').ok_or("give NAME=FILE")?;
    Ok((label.to_owned(), file.into()))
}

/// Runs the command.
pub fn figures(args: &FiguresArgs) -> Result<()> {
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;
    if !args.curves.is_empty() {
        figures::learning_curves(&args.out.join("fig3"), &curves(&args.curves)?)?;
    }
    for (name, path) in &args.evaluations {
        let boxes: Vec<Box> = evaluation(path)?.planners.iter().map(boxed).collect();
        figures::boxes(&args.out.join(name), &boxes)?;
    }
    if !args.densities.is_empty() {
        figures::densities(&args.out.join("fig5"), &density_bars(&args.densities)?)?;
    }
    Ok(())
}

fn curves(files: &[(String, PathBuf)]) -> Result<Vec<Curve>> {
    let mut runs: BTreeMap<&str, Vec<Vec<(f64, f64)>>> = BTreeMap::new();
    for (label, path) in files {
        runs.entry(label).or_default().push(returns(path)?);
    }
    Ok(runs.into_iter().map(|(label, runs)| Curve::average(label, &runs)).collect())
}

/// Steps and mean returns of the updates during which an episode ended.
fn returns(path: &Path) -> Result<Vec<(f64, f64)>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut points = Vec::new();
    for line in text.lines() {
        let update: serde_json::Value =
            serde_json::from_str(line).with_context(|| format!("{} is no progress file", path.display()))?;
        if let (Some(steps), Some(value)) = (update["steps"].as_f64(), update["return"].as_f64()) {
            points.push((steps, value));
        }
    }
    Ok(points)
}

fn evaluation(path: &Path) -> Result<Evaluation> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is no evaluation", path.display()))
}

fn boxed(planner: &PlannerResult) -> Box {
    let rewards = planner.missions.iter().map(|mission| mission.reward_per_orbit).collect();
    Box { label: short(&planner.planner), values: rewards }
}

/// The planner's name without the folder of its file.
fn short(planner: &str) -> String {
    match planner.split_once(':') {
        Some((kind, file)) if file.parse::<f64>().is_err() => {
            let stem = Path::new(file).file_stem().and_then(|stem| stem.to_str());
            stem.filter(|stem| *stem != "policy").unwrap_or(kind).to_owned()
        }
        _ => planner.to_owned(),
    }
}

fn density_bars(files: &[PathBuf]) -> Result<Vec<Bars>> {
    let evaluations = files.iter().map(|path| evaluation(path)).collect::<Result<Vec<_>>>()?;
    let first = evaluations.first().ok_or_else(|| anyhow!("no evaluation is given"))?;
    let names: Vec<String> = first.planners.iter().map(|it| it.planner.clone()).collect();
    let mut bars = Vec::new();
    for name in names {
        for evaluation in &evaluations {
            let found = evaluation.planners.iter().find(|it| it.planner == name);
            let planner = found.with_context(|| format!("{name} is not in every evaluation"))?;
            bars.push(Bars {
                planner: short(&name),
                requests: evaluation.missions.requests[0],
                reward: (planner.reward_per_orbit.mean, planner.reward_per_orbit.deviation),
                priority: (planner.priority.mean, planner.priority.deviation),
                t_pre_s: planner.t_pre_s.mean,
                t_acq_s: planner.t_acq_s.mean,
                attempts: planner.attempts_per_orbit.mean,
            });
        }
    }
    Ok(bars)
}
