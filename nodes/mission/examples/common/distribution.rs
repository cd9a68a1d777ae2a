//! Distributions of times as a figure: what share of the orders has come to a step after a time.

use std::fmt::Display;
use std::path::Path;

use anyhow::{Result, anyhow};
use plotters::prelude::*;

/// A link's orders: its name, how many there were, and of those that came to a step the time that it took [h].
pub struct Curve {
    pub name: &'static str,
    pub orders: usize,
    pub hours: Vec<f64>,
}

/// A step, with a curve for each link.
pub struct Panel {
    pub step: &'static str,
    pub curves: Vec<Curve>,
}

const FONT: &str = "sans-serif";
const SIZE: (u32, u32) = (1120, 420);
/// Points of a curve.
const POINTS: u32 = 480;
/// Until then [h].
const END_H: f64 = 24.0;
const COLOURS: [RGBColor; 4] =
    [RGBColor(140, 140, 140), RGBColor(44, 160, 44), RGBColor(255, 127, 14), RGBColor(31, 119, 180)];

/// Draws the panels side by side.
///
/// # Errors
/// When the file cannot be written.
pub fn draw(path: &Path, panels: &[Panel]) -> Result<()> {
    // Text is measured with a font of our own, so that the figure comes out the same everywhere.
    let _ = plotters::style::register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    let area = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE).map_err(failed)?;
    for (at, (place, panel)) in area.split_evenly((1, panels.len())).iter().zip(panels).enumerate() {
        let builder = &mut ChartBuilder::on(place);
        let builder = builder.caption(panel.step, (FONT, 18)).margin(10).x_label_area_size(40).y_label_area_size(52);
        let mut chart = builder.build_cartesian_2d(0.0..END_H, 0.0..100.0).map_err(failed)?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc("time since submission [h]").y_desc("share of the orders [%]").label_style((FONT, 13));
        mesh.light_line_style(WHITE).x_labels(7).draw().map_err(failed)?;
        for (curve, colour) in panel.curves.iter().zip(COLOURS) {
            let points = steps(curve);
            let swatch = move |(x, y)| Rectangle::new([(x, y - 3), (x + 12, y + 3)], colour.filled());
            let series = LineSeries::new(points, colour.stroke_width(2));
            chart.draw_series(series).map_err(failed)?.label(curve.name).legend(swatch);
        }
        // There is room for the names of the links in the first of them.
        if at > 0 {
            continue;
        }
        let mut labels = chart.configure_series_labels();
        labels.position(SeriesLabelPosition::LowerRight).background_style(WHITE.mix(0.85)).label_font((FONT, 13));
        labels.draw().map_err(failed)?;
    }
    area.present().map_err(failed)
}

/// The share of the orders [%] that came to the step within a time [h], as steps thinned to what can be seen.
fn steps(curve: &Curve) -> Vec<(f64, f64)> {
    let mut hours = curve.hours.clone();
    hours.sort_by(f64::total_cmp);
    let share = |count: usize| 100.0 * count as f64 / curve.orders.max(1) as f64;
    let points = (0..=POINTS).map(|at| f64::from(at) * END_H / f64::from(POINTS));
    points.map(|hour| (hour, share(hours.partition_point(|it| *it <= hour)))).collect()
}

fn failed(error: impl Display) -> anyhow::Error {
    anyhow!("cannot draw: {error}")
}
