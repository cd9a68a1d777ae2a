//! The plots of a report, as SVG texts.

use std::fmt::Display;
use std::ops::Range;
use std::sync::Once;

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::story::{Resources, Story, Strip, Task};
use crate::debrief::places::{Place, cut_at_antimeridian};

/// Imaged, and successful.
pub const GREEN: RGBColor = RGBColor(44, 160, 44);
/// Tried in vain, and limits.
pub const RED: RGBColor = RGBColor(214, 39, 40);
/// Slewing.
pub const AMBER: RGBColor = RGBColor(255, 187, 88);
/// Never tried, and waiting.
pub const GREY: RGBColor = RGBColor(140, 140, 140);
/// The satellite's way, and sums.
pub const BLUE: RGBColor = RGBColor(31, 119, 180);
/// What was predicted, and the z axis.
const PURPLE: RGBColor = RGBColor(148, 103, 189);
/// Land.
const SAND: RGBColor = RGBColor(232, 228, 218);
/// One for each axis.
const AXES: [(&str, RGBColor); 3] = [("x", BLUE), ("y", RGBColor(255, 127, 14)), ("z", PURPLE)];

const WIDTH: u32 = 1120;
const FONT: &str = "sans-serif";

/// Coastlines: rings of longitude,latitude [deg] to a tenth of a degree, one a line. Natural Earth 4.1, 1:110 million
/// (public domain).
const LAND: &str = include_str!("land.txt");

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws one plot of a height [px].
fn draw(height: u32, plot: impl FnOnce(&Area<'_>) -> Result<()>) -> Result<String> {
    register_font();
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        plot(&area)?;
        area.present().map_err(failed)?;
    }
    Ok(svg)
}

fn failed(error: impl Display) -> anyhow::Error {
    anyhow!("cannot plot: {error}")
}

/// Text is measured with a font of our own, so that the plots come out the same everywhere.
fn register_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // It is a valid font; were it not, the labels alone would be missing.
        let _ = plotters::style::register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    });
}

fn chart<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
    (x_name, y_name): (&str, &str),
) -> Result<Chart<'a, 'b>> {
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(x, y)
        .map_err(failed)?;
    let mut mesh = chart.configure_mesh();
    mesh.x_desc(x_name).y_desc(y_name).label_style((FONT, 15)).light_line_style(WHITE).bold_line_style(GREY.mix(0.3));
    mesh.x_label_formatter(&|x| short(*x)).y_label_formatter(&|y| short(*y)).draw().map_err(failed)?;
    Ok(chart)
}

/// A number for an axis: up to three decimals.
fn short(number: f64) -> String {
    let text = format!("{number:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn legend<'a, 'b: 'a>(chart: &mut Chart<'a, 'b>) -> Result<()> {
    let mut labels = chart.configure_series_labels();
    labels.position(SeriesLabelPosition::UpperRight).background_style(WHITE.mix(0.85)).label_font((FONT, 14));
    labels.draw().map_err(failed)
}

/// A named line; without points there is nothing to draw.
fn line(chart: &mut Chart<'_, '_>, points: &[(f64, f64)], colour: RGBColor, name: &str) -> Result<()> {
    let series = LineSeries::new(points.iter().copied(), colour.stroke_width(1));
    let swatch = move |(x, y)| Rectangle::new([(x, y - 4), (x + 14, y + 4)], colour.filled());
    chart.draw_series(series).map_err(failed)?.label(name).legend(swatch);
    Ok(())
}

/// The world with ground track and strips.
pub fn map(story: &Story) -> Result<String> {
    draw(600, |area| {
        let mut chart = chart(area, -180.0..180.0, -90.0..90.0, ("longitude [deg]", "latitude [deg]"))?;
        let land = land().into_iter().map(|ring| Polygon::new(ring, SAND.filled()));
        chart.draw_series(land).map_err(failed)?;
        let mut lines = |places: &[Place], style: ShapeStyle| -> Result<()> {
            for piece in cut_at_antimeridian(places) {
                let points: Vec<(f64, f64)> = piece.iter().map(|[x, y]| (*x, *y)).collect();
                chart.draw_series(std::iter::once(PathElement::new(points, style))).map_err(failed)?;
            }
            Ok(())
        };
        let colour = |strip: &Strip| match (strip.imaged, strip.attempts) {
            (true, _) => GREEN.stroke_width(3),
            (false, 0) => GREY.stroke_width(1),
            (false, _) => RED.stroke_width(3),
        };
        // What matters most is drawn last.
        for wanted in [(false, false), (false, true), (true, true)] {
            for strip in story.strips.iter().filter(|strip| (strip.imaged, strip.attempts > 0) == wanted) {
                lines(&strip.places, colour(strip))?;
            }
        }
        lines(&story.track, BLUE.stroke_width(2))
    })
}

fn land() -> Vec<Vec<(f64, f64)>> {
    let point = |word: &str| {
        let (longitude, latitude) = word.split_once(',')?;
        Some((longitude.parse().ok()?, latitude.parse().ok()?))
    };
    LAND.lines().map(|line| line.split(' ').filter_map(point).collect()).collect()
}

/// The tasks, one row an orbit: transition, then imaging.
pub fn timeline(story: &Story) -> Result<String> {
    let orbit = story.orbit_s;
    let rows = (story.end_s / orbit).ceil().max(1.0);
    draw(100 + 34 * rows as u32, |area| {
        // The first orbit is the top row.
        let builder = &mut ChartBuilder::on(area);
        let builder = builder.margin(12).x_label_area_size(44).y_label_area_size(64);
        let mut chart = builder.build_cartesian_2d(0.0..orbit, -rows..0.0).map_err(failed)?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc("time in the orbit [s]").y_desc("orbits").label_style((FONT, 15)).disable_mesh();
        mesh.y_labels(rows.min(20.0) as usize + 1).y_label_formatter(&|y| short(-y)).draw().map_err(failed)?;
        let mut bars = Vec::new();
        for task in &story.tasks {
            for (from, to, colour) in phases(task).into_iter().filter(|(from, to, _)| from < to) {
                bars.extend(
                    rows_of(from, to, orbit)
                        .map(|(row, a, b)| Rectangle::new([(a, -row - 0.85), (b, -row - 0.15)], colour.filled())),
                );
            }
        }
        let passes = story.radio.passes.iter().map(|pass| (pass.rise_s, pass.set_s, -0.13, BLUE));
        let foretold = story.radio.foretold().into_iter().map(|(from, to)| (from, to, -0.98, PURPLE));
        for (from, to, low, colour) in passes.chain(foretold) {
            bars.extend(
                rows_of(from, to.min(story.end_s), orbit)
                    .map(|(row, a, b)| Rectangle::new([(a, -row + low), (b, -row + low + 0.11)], colour.filled())),
            );
        }
        chart.draw_series(bars).map_err(failed)?;
        Ok(())
    })
}

fn phases(task: &Task) -> Vec<(f64, f64, RGBColor)> {
    match &task.strip {
        None => vec![(task.start_s, task.end_s, GREY)],
        Some(_) => {
            let imaging = (task.start_s + task.t_pre_s).min(task.end_s);
            let outcome = if task.success { GREEN } else { RED };
            vec![(task.start_s, imaging, AMBER), (imaging, task.end_s, outcome)]
        }
    }
}

/// A span of time on the rows that it touches.
fn rows_of(from: f64, to: f64, orbit: f64) -> impl Iterator<Item = (f64, f64, f64)> {
    let first = (from / orbit).floor() as u64;
    let last = (to / orbit).ceil() as u64;
    (first..last).map(move |row| {
        let start = row as f64 * orbit;
        (row as f64, (from - start).max(0.0), (to - start).min(orbit))
    })
}

/// ‖σ_BR‖ over time on a logarithmic scale, and its limit while imaging.
pub fn attitude_error(story: &Story) -> Result<String> {
    let decades = |error: f64| error.max(1e-6).log10();
    draw(300, |area| {
        let name = ("time [s]", "log10 of the attitude error ‖σ_BR‖");
        let points: Vec<(f64, f64)> = story.attitude_error.iter().map(|(t, error)| (*t, decades(*error))).collect();
        let low = points.iter().map(|point| point.1).fold(decades(story.sigma_max) - 1.0, f64::min);
        let mut chart = chart(area, 0.0..story.end_s, low..0.1, name)?;
        line(&mut chart, &points, BLUE, "attitude error")?;
        let limit = decades(story.sigma_max);
        line(&mut chart, &[(0.0, limit), (story.end_s, limit)], RED, "limit while imaging")?;
        legend(&mut chart)
    })
}

/// A quantity of the three wheels over time, with its limit.
pub fn wheels(story: &Story, series: &[Vec<(f64, f64)>; 3], limit: f64, name: &str) -> Result<String> {
    draw(300, |area| {
        let mut chart = chart(area, 0.0..story.end_s, -1.1 * limit..1.1 * limit, ("time [s]", name))?;
        for (points, (axis, colour)) in series.iter().zip(AXES) {
            line(&mut chart, points, colour, axis)?;
        }
        let end = story.end_s;
        line(&mut chart, &[(0.0, limit), (end, limit), (end, -limit), (0.0, -limit)], RED, "limit")?;
        legend(&mut chart)
    })
}

/// Shares of battery, storage and momentum over time.
pub fn resources(end_s: f64, resources: &Resources) -> Result<String> {
    draw(300, |area| {
        let mut chart = chart(area, 0.0..end_s, 0.0..110.0, ("time [s]", "share [%]"))?;
        line(&mut chart, &resources.illumination, GREY, "sunlight")?;
        line(&mut chart, &resources.charge, GREEN, "battery")?;
        line(&mut chart, &resources.storage, BLUE, "storage")?;
        line(&mut chart, &resources.momentum, AMBER, "momentum")?;
        legend(&mut chart)
    })
}

/// Reward earned so far.
pub fn reward(story: &Story) -> Result<String> {
    let mut sum = 0.0;
    let mut points = vec![(0.0, 0.0)];
    for task in &story.tasks {
        points.push((task.end_s, sum));
        sum += task.reward;
        points.push((task.end_s, sum));
    }
    draw(300, |area| {
        let mut chart = chart(area, 0.0..story.end_s, 0.0..1.1 * sum.max(1.0), ("time [s]", "cumulative reward"))?;
        line(&mut chart, &points, BLUE, "reward")
    })
}

/// How many requests are in which state.
pub fn requests(story: &Story) -> Result<String> {
    let colours = [BLUE, GREEN, RED, AMBER, AXES[2].1, AXES[1].1, GREY];
    let top = story.requests.iter().flat_map(|(_, points)| points).map(|point| point.1).fold(1.0, f64::max);
    draw(300, |area| {
        let mut chart = chart(area, 0.0..story.end_s, 0.0..1.1 * top, ("time [s]", "strip requests"))?;
        for ((name, points), colour) in story.requests.iter().zip(colours.into_iter().cycle()) {
            line(&mut chart, points, colour, name)?;
        }
        legend(&mut chart)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_land_is_where_it_is() {
        let rings = land();
        assert!(rings.iter().all(|ring| ring.len() > 3), "every ring encloses something");
        let all = || rings.iter().flatten();
        assert!(all().all(|(x, y)| (-180.0..=180.0).contains(x) && (-90.0..=90.0).contains(y)));
        // The southern tip of Africa, to half a degree.
        assert!(all().any(|(x, y)| (x - 19.6).abs() < 0.5 && (y + 34.8).abs() < 0.5));
    }

    #[test]
    fn a_span_over_two_orbits_is_cut() {
        let rows: Vec<_> = rows_of(90.0, 130.0, 100.0).collect();
        assert_eq!(rows, [(0.0, 90.0, 100.0), (1.0, 0.0, 30.0)]);
    }
}
