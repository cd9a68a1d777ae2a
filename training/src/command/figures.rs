//! `swath-train figures`: the paper's Figures 3, 4 and 5 from recorded runs and evaluations.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use serde::Deserialize;
use swath_sim::planner::PlannerSpec;
use swath_training::config::{EnvironmentConfig, RunConfig};
use swath_training::figures::{self, Bars, Box, Curve};

use super::output::say;

/// Names of Figures 3 and 5.
const CURVES: &str = "fig3";
const DENSITIES: &str = "fig5";

/// Options of `swath-train figures`.
#[derive(Debug, Args)]
pub struct FiguresArgs {
    /// A learning curve of Fig. 3: LABEL=progress.jsonl; curves of one label are averaged
    #[arg(long = "curve", value_name = "LABEL=FILE", value_parser = labelled)]
    curves: Vec<(String, PathBuf)>,
    /// A figure like Fig. 4, rewards by planner: its name and the JSON of `swath-train evaluate`
    #[arg(long = "evaluation", value_name = "NAME=FILE", value_parser = named)]
    evaluations: Vec<(String, PathBuf)>,
    /// JSON of `swath-train evaluate --requests N` for Fig. 5, one for each density
    #[arg(long = "density", value_name = "FILE")]
    densities: Vec<PathBuf>,
    /// Folder for the SVG and PNG files
    #[arg(long, value_name = "FOLDER", default_value = "out/figures")]
    out: PathBuf,
}

/// What is read of an evaluation: planners, or with `--plant` planners of each plant.
#[derive(Debug, Deserialize)]
struct Evaluation {
    missions: MissionSettings,
    #[serde(default)]
    planners: Vec<PlannerResult>,
    #[serde(default)]
    plants: Vec<PlantResult>,
}

#[derive(Debug, Deserialize)]
struct MissionSettings {
    requests: [u32; 2],
}

#[derive(Debug, Deserialize)]
struct PlantResult {
    plant: String,
    planners: Vec<PlannerResult>,
}

#[derive(Debug, Deserialize)]
struct PlannerResult {
    planner: String,
    missions: Vec<MissionResult>,
    reward_per_orbit: Mean,
    attempts_per_orbit: Mean,
    priority: Option<Mean>,
    t_pre_s: Option<Mean>,
    t_acq_s: Option<Mean>,
}

#[derive(Debug, Deserialize)]
struct MissionResult {
    reward_per_orbit: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
struct Mean {
    mean: f64,
    deviation: Option<f64>,
}

fn labelled(text: &str) -> Result<(String, PathBuf), String> {
    let (label, file) = text.split_once('=').ok_or("give NAME=FILE")?;
    Ok((label.to_owned(), file.into()))
}

/// A figure's name, which becomes one of a file in the output folder.
fn named(text: &str) -> Result<(String, PathBuf), String> {
    let (name, file) = labelled(text)?;
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
        return Err(format!(
            "a figure's name has letters, digits, '-', '_' and '.', and does not begin with '.': {name:?}"
        ));
    }
    Ok((name, file))
}

/// Runs the command.
pub fn figures(args: &FiguresArgs) -> Result<()> {
    if args.curves.is_empty() && args.evaluations.is_empty() && args.densities.is_empty() {
        bail!("nothing to draw: give --curve, --evaluation or --density");
    }
    let mut names: Vec<&str> = args.evaluations.iter().map(|(name, _)| name.as_str()).collect();
    names.extend((!args.curves.is_empty()).then_some(CURVES));
    names.extend((!args.densities.is_empty()).then_some(DENSITIES));
    names.sort_unstable();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        bail!("two figures are called {}: give --evaluation another name", twice[0]);
    }
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;
    if !args.curves.is_empty() {
        let orbits = episode_orbits(args.curves.iter().map(|(_, path)| path.as_path()));
        figures::learning_curves(&args.out.join(CURVES), &curves(&args.curves)?, orbits)?;
    }
    for (name, path) in &args.evaluations {
        let boxes: Vec<Box> = evaluation(path)?.into_iter().map(boxed).collect();
        figures::boxes(&args.out.join(name), &boxes).with_context(|| format!("cannot draw {}", path.display()))?;
    }
    if !args.densities.is_empty() {
        figures::densities(&args.out.join(DENSITIES), &density_bars(&args.densities)?)?;
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

/// Steps and mean returns of the updates during which an episode ended. A line that a killed run left torn is told and
/// left out.
fn returns(path: &Path) -> Result<Vec<(f64, f64)>> {
    let text = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let text = String::from_utf8_lossy(&text);
    let (mut points, mut whole) = (Vec::new(), 0);
    for (number, line) in text.lines().enumerate() {
        let update = serde_json::from_str::<serde_json::Value>(line).unwrap_or_default();
        let Some(steps) = update["steps"].as_f64() else {
            say(&format!("warning: line {} of {} is torn and left out", number + 1, path.display()));
            continue;
        };
        whole += 1;
        points.extend(update["return"].as_f64().map(|value| (steps, value)));
    }
    if whole == 0 {
        bail!("{} is no progress file: no line of it is one of an update", path.display());
    }
    Ok(points)
}

/// Length of the episodes of all curves, where their runs lie beside them and agree.
fn episode_orbits<'a>(mut progress: impl Iterator<Item = &'a Path>) -> Option<f64> {
    let orbits = |path: &Path| {
        let run =
            path.file_name()?.to_str()?.strip_suffix("progress.jsonl").map(|before| format!("{before}run.toml"))?;
        match RunConfig::load(&path.with_file_name(run)).ok()?.environment {
            EnvironmentConfig::Strips(strips) => Some(strips.episode.orbits),
            EnvironmentConfig::Toy(_) => None,
        }
    };
    let first = orbits(progress.next()?)?;
    progress.all(|path| orbits(path) == Some(first)).then_some(first)
}

/// What an evaluation says of each planner, under a label of its own.
struct Labelled {
    label: String,
    requests: String,
    result: PlannerResult,
}

fn evaluation(path: &Path) -> Result<Vec<Labelled>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let found: Evaluation =
        serde_json::from_str(&text).with_context(|| format!("{} is no evaluation", path.display()))?;
    let requests = match found.missions.requests {
        [least, most] if least == most => least.to_string(),
        [least, most] => format!("{least} to {most}"),
    };
    let several = found.plants.len() > 1;
    let on_plants = found.plants.into_iter().flat_map(|it| {
        let plant = (several || it.plant != "none").then_some(it.plant);
        it.planners.into_iter().map(move |result| (plant.clone(), result))
    });
    let results: Vec<_> = found.planners.into_iter().map(|result| (None, result)).chain(on_plants).collect();
    if results.is_empty() {
        bail!("{} holds no planner: there is nothing to draw", path.display());
    }
    let labels = labels(&results.iter().map(|(plant, it)| (it.planner.as_str(), plant.as_deref())).collect::<Vec<_>>());
    let labelled = results.into_iter().zip(labels);
    Ok(labelled.map(|((_, result), label)| Labelled { label, requests: requests.clone(), result }).collect())
}

/// Labels of planners on plants: short where that tells them apart, else with the whole path of their file, else with a
/// number.
fn labels(planners: &[(&str, Option<&str>)]) -> Vec<String> {
    let label = |planner: &str, plant: Option<&str>| match plant {
        Some(plant) => format!("{planner}, {plant}"),
        None => planner.to_owned(),
    };
    let short: Vec<String> = planners.iter().map(|(planner, plant)| label(&short(planner), *plant)).collect();
    let whole: Vec<String> = planners.iter().map(|(planner, plant)| label(planner, *plant)).collect();
    let mut labels: Vec<String> = Vec::with_capacity(planners.len());
    for (own, whole) in short.iter().zip(&whole) {
        let alone = short.iter().filter(|other| *other == own).count() == 1;
        let wanted = if alone { own } else { whole };
        let before = labels.iter().filter(|label| label.split(" (").next() == Some(wanted)).count();
        labels.push(if before == 0 { wanted.clone() } else { format!("{wanted} ({})", before + 1) });
    }
    labels
}

fn boxed(planner: Labelled) -> Box {
    let rewards = planner.result.missions.iter().map(|mission| mission.reward_per_orbit).collect();
    Box { label: planner.label, values: rewards }
}

/// The planner's name without the folder of its file.
fn short(planner: &str) -> String {
    let Ok(PlannerSpec::Learned { kind, file: Some(file), lookahead }) = planner.parse() else {
        return planner.to_owned();
    };
    let stem = file.file_stem().and_then(|stem| stem.to_str()).filter(|stem| *stem != "policy").unwrap_or(&kind);
    format!("{stem}{}", if lookahead { "+lookahead" } else { "" })
}

fn density_bars(files: &[PathBuf]) -> Result<Vec<Bars>> {
    let evaluations = files.iter().map(|path| evaluation(path)).collect::<Result<Vec<_>>>()?;
    let mut bars: Vec<Bars> = Vec::new();
    let names = |it: &[Labelled]| it.iter().map(|planner| planner.label.clone()).collect::<Vec<_>>();
    for (evaluation, path) in evaluations.iter().zip(files) {
        if names(evaluation) != names(&evaluations[0]) {
            bail!("{} and {} are not of the same planners", files[0].display(), path.display());
        }
        if bars.iter().any(|bar| bar.requests == evaluation[0].requests) {
            bail!("{} is not the only one of {} strips", path.display(), evaluation[0].requests);
        }
        for Labelled { label, requests, result } in evaluation {
            let (Some(t_pre), Some(t_acq)) = (result.t_pre_s, result.t_acq_s) else {
                bail!("{label} attempted nothing in {}: there is nothing to draw", path.display());
            };
            let pair = |it: Option<Mean>| it.map_or((0.0, 0.0), |it| (it.mean, it.deviation.unwrap_or(0.0)));
            bars.push(Bars {
                planner: label.clone(),
                requests: requests.clone(),
                reward: pair(Some(result.reward_per_orbit)),
                priority: pair(result.priority),
                t_pre_s: t_pre.mean,
                t_acq_s: t_acq.mean,
                attempts: result.attempts_per_orbit.mean,
            });
        }
    }
    bars.sort_by_key(|bar| names(&evaluations[0]).iter().position(|name| *name == bar.planner));
    Ok(bars)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_short_and_stay_apart() {
        let of = |planners: &[(&str, Option<&str>)]| labels(planners);
        let plain =
            ["random", "beam:4x2", "lookahead:8", "hop-ppo:out/x.safetensors", "h-ppo:out/a/policy.safetensors"];
        let plain: Vec<_> = plain.into_iter().map(|planner| (planner, None)).collect();
        assert_eq!(of(&plain), ["random", "beam:4x2", "lookahead:8", "x", "h-ppo"]);
        let same = [("hop-ppo:a/policy.safetensors", None), ("hop-ppo:b/policy.safetensors", None), ("hop-ppo", None)];
        assert_eq!(of(&same), ["hop-ppo:a/policy.safetensors", "hop-ppo:b/policy.safetensors", "hop-ppo"]);
        let heads = [("hop-ppo:x.safetensors", None), ("hop-ppo+lookahead:x.safetensors", None)];
        assert_eq!(of(&heads), ["x", "x+lookahead"]);
        assert_eq!(of(&[("random", None), ("random", None)]), ["random", "random (2)"]);
        let plants = [("random", Some("none")), ("random", Some("torque-10%"))];
        assert_eq!(of(&plants), ["random, none", "random, torque-10%"]);
    }

    #[test]
    fn names_of_figures_are_names_of_files() {
        assert_eq!(named("fig4=a=b.json").unwrap(), ("fig4".to_owned(), "a=b.json".into()));
        for name in ["../x=a", "/tmp/x=a", "a/b=c", ".hidden=a", "=a", "a\\b=c", "fig4"] {
            assert!(named(name).is_err(), "{name}");
        }
    }
}
