//! `swath passes`: when stations see the satellite of a mission, from its file alone.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use serde_json::Value;
use swath_mission::file::Mission;
use swath_mission::link::config::{LinkConfig, LinkMode};
use swath_mission::link::passes::{Pass, passes};
use swath_mission::time_text;
use swath_node::out;
use swath_node::stamp::Stamper;
use swath_sim::time::Tick;

/// `swath passes`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  swath passes examples/missions/passes.toml\n  \
    swath passes examples/missions/one_orbit.toml --station weilheim --station santiago --hours 48")]
pub struct PassesArgs {
    /// Mission file (TOML).
    mission: PathBuf,
    /// Stations of the catalogue instead of the mission's; may be given several times.
    #[arg(long = "station", value_name = "NAME")]
    stations: Vec<String>,
    /// First time of interest; the mission's epoch without it.
    #[arg(long, value_parser = time_text::parse)]
    from: Option<u64>,
    /// How far to look from there [h].
    #[arg(long, default_value_t = 24.0)]
    hours: f64,
    /// Seed instead of the mission's.
    #[arg(long)]
    seed: Option<u64>,
    /// Print JSON lines.
    #[arg(long)]
    json: bool,
}

/// Longest look ahead [h]: ten years.
const HOURS_MAX: f64 = 87_660.0;

/// Prints passes.
///
/// # Errors
/// When the mission is not valid or names no stations, or a time is out of range.
pub fn run(args: &PassesArgs) -> Result<()> {
    let mut mission = Mission::read(&args.mission)?;
    mission.seed = args.seed.unwrap_or(mission.seed);
    if !args.stations.is_empty() {
        let link = mission.link.take().unwrap_or_default();
        mission.link = Some(LinkConfig { stations: args.stations.clone(), own_stations: Vec::new(), ..link });
        mission.validate()?;
    }
    let Some(link) = &mission.link else {
        bail!("mission {} has no [link], so no stations: name some with --station", args.mission.display())
    };
    if !(0.0..=HOURS_MAX).contains(&args.hours) {
        bail!("--hours is {}, outside 0 to {HOURS_MAX}", args.hours);
    }
    for unseen in mission.stations_never_seen()? {
        out::say(unseen);
    }
    let model = mission.model()?;
    let stamper = Stamper::new(mission.epoch_unix_s, model.period);
    let from = args.from.map_or(Tick(0), |from| stamper.tick_from(&swath_ros::stamp(from)));
    let to = Tick(from.0.saturating_add((args.hours * 3600.0 / model.period.seconds()) as u64));
    let found = passes(&link.all_stations()?, &model, &mission.orbit(&model), (from, to));
    let time = |tick: Tick| time_text::format(stamper.nanoseconds(tick));
    if !args.json {
        out::print(&table(&found, link, time))?;
        return Ok(());
    }
    for pass in &found {
        if !out::print_line(pass_json(pass, link, time)?)? {
            break;
        }
    }
    Ok(())
}

/// Data that a pass has room for [bit]: up, down.
fn room(pass: &Pass, link: &LinkConfig) -> (f64, f64) {
    (pass.duration_s * link.uplink_bps, pass.duration_s * link.downlink_bps)
}

fn pass_json(pass: &Pass, link: &LinkConfig, time: impl Fn(Tick) -> String) -> Result<Value> {
    let mut value = serde_json::to_value(pass)?;
    let (up_bits, down_bits) = room(pass, link);
    if let Some(fields) = value.as_object_mut() {
        fields.insert("rise".to_owned(), time(pass.rise_tick).into());
        fields.insert("set".to_owned(), time(pass.set_tick).into());
        fields.insert("up_bits".to_owned(), up_bits.into());
        fields.insert("down_bits".to_owned(), down_bits.into());
    }
    Ok(value)
}

fn table(found: &[Pass], link: &LinkConfig, time: impl Fn(Tick) -> String) -> String {
    let mut text = format!(
        "{:<16} {:<24} {:<24} {:>7} {:>9} {:>9} {:>10} {:>10}\n",
        "station", "rise", "set", "length", "elevation", "range", "room up", "room down"
    );
    for pass in found {
        let (up, down) = room(pass, link);
        _ = writeln!(
            text,
            "{:<16} {:<24} {:<24} {:>5.0} s {:>7.1}° {:>6.0} km {:>5.1} Mbit {:>5.1} Gbit",
            pass.station,
            time(pass.rise_tick),
            time(pass.set_tick),
            pass.duration_s,
            pass.elevation_max_deg,
            pass.range_min_km,
            up / 1e6,
            down / 1e9
        );
    }
    if found.is_empty() {
        text += "no passes\n";
    }
    if link.mode == LinkMode::Always {
        text += "mode = \"always\": the link does not wait for passes\n";
    }
    text
}
