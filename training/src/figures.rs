//! The paper's Figures 3, 4 and 5, each as SVG and PNG.

use std::path::Path;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::error::{Result, TrainingError};

const SIZE: (u32, u32) = (960, 600);
const COLOURS: [RGBColor; 8] = [
    RGBColor(31, 119, 180),
    RGBColor(214, 39, 40),
    RGBColor(44, 160, 44),
    RGBColor(148, 103, 189),
    RGBColor(255, 127, 14),
    RGBColor(23, 190, 207),
    RGBColor(140, 86, 75),
    RGBColor(127, 127, 127),
];

/// Steps over which a learning curve is smoothed.
const SMOOTHING_STEPS: f64 = 50_000.0;
/// Points of a learning curve.
const POINTS: usize = 200;

/// A learning curve: mean and deviation over runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub label: String,
    /// Steps, mean return, deviation over runs.
    pub points: Vec<(f64, f64, f64)>,
}

/// Rewards per orbit of one planner over missions.
#[derive(Debug, Clone, PartialEq)]
pub struct Box {
    /// Name under the box.
    pub label: String,
    /// One number a mission.
    pub values: Vec<f64>,
}

/// How one planner behaves at one density of requests.
#[derive(Debug, Clone, PartialEq)]
pub struct Bars {
    /// Planner.
    pub planner: String,
    /// Requests at the start.
    pub requests: u32,
    /// Reward per orbit, mean and deviation.
    pub reward: (f64, f64),
    /// Priority of imaged strips, mean and deviation.
    pub priority: (f64, f64),
    /// Mean transition time [s].
    pub t_pre_s: f64,
    /// Mean acquisition time [s].
    pub t_acq_s: f64,
    /// Attempts per orbit.
    pub attempts: f64,
}

impl Curve {
    /// Averages runs given as (steps, return): each is smoothed over 50 000 steps, then mean and
    /// deviation are taken where all runs have come.
    pub fn average(label: &str, runs: &[Vec<(f64, f64)>]) -> Curve {
        let ends = runs.iter().map(|run| run.last().map_or(0.0, |point| point.0));
        let end = ends.fold(f64::INFINITY, f64::min);
        let at = |index: usize| end * (index + 1) as f64 / POINTS as f64;
        let points = (0..POINTS).filter_map(|index| {
            let steps = at(index);
            let values: Option<Vec<f64>> = runs.iter().map(|run| smoothed(run, steps)).collect();
            let spread = crate::evaluate::spread_of(&values?);
            Some((steps, spread.mean, spread.deviation))
        });
        Curve { label: label.to_owned(), points: points.collect() }
    }
}

/// Mean of a run over the window that ends at `steps`; none when nothing ended in it.
fn smoothed(run: &[(f64, f64)], steps: f64) -> Option<f64> {
    let inside = run.iter().filter(|(at, _)| *at <= steps && *at > steps - SMOOTHING_STEPS);
    let (sum, count) = inside.fold((0.0, 0.0), |(sum, count), (_, value)| (sum + value, count + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// Fig. 3: return over training steps.
///
/// # Errors
/// Files that cannot be written.
pub fn learning_curves(path: &Path, curves: &[Curve]) -> Result<()> {
    draw(path, SIZE, &Plot::Curves(curves))
}

/// Fig. 4: reward per orbit of each planner.
///
/// # Errors
/// Files that cannot be written.
pub fn boxes(path: &Path, boxes: &[Box]) -> Result<()> {
    draw(path, SIZE, &Plot::Boxes(boxes))
}

/// Fig. 5: behaviour over the density of requests.
///
/// # Errors
/// Files that cannot be written.
pub fn densities(path: &Path, bars: &[Bars]) -> Result<()> {
    draw(path, (1200, 860), &Plot::Densities(bars))
}

enum Plot<'a> {
    Curves(&'a [Curve]),
    Boxes(&'a [Box]),
    Densities(&'a [Bars]),
}

type Area<DB> = DrawingArea<DB, Shift>;
type Drawn<DB> = std::result::Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

fn draw(path: &Path, size: (u32, u32), plot: &Plot) -> Result<()> {
    register_font();
    let failed = |error: &dyn std::fmt::Display, path: &Path| {
        TrainingError::file("write", path)(std::io::Error::other(error.to_string()))
    };
    let svg = path.with_extension("svg");
    plot.onto(&SVGBackend::new(&svg, size).into_drawing_area()).map_err(|error| failed(&error, &svg))?;
    let png = path.with_extension("png");
    plot.onto(&BitMapBackend::new(&png, size).into_drawing_area()).map_err(|error| failed(&error, &png))
}

/// The figures bring their own font, so that they look the same everywhere.
fn register_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let font = epaint_default_fonts::UBUNTU_LIGHT;
        // It is a valid font; were it not, the labels alone would be missing.
        let _ = plotters::style::register_font("sans-serif", FontStyle::Normal, font);
    });
}

impl Plot<'_> {
    fn onto<DB: DrawingBackend>(&self, area: &Area<DB>) -> Drawn<DB> {
        area.fill(&WHITE)?;
        match self {
            Plot::Curves(curves) => draw_curves(area, curves)?,
            Plot::Boxes(boxes) => draw_boxes(area, boxes)?,
            Plot::Densities(bars) => draw_densities(area, bars)?,
        }
        area.present()
    }
}

fn draw_curves<DB: DrawingBackend>(area: &Area<DB>, curves: &[Curve]) -> Drawn<DB> {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let end = points().map(|point| point.0).fold(1.0, f64::max);
    let top = points().map(|point| point.1 + point.2).fold(1.0, f64::max);
    let mut chart = ChartBuilder::on(area)
        .margin(16)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..end / 1e6, 0.0..1.08 * top)?;
    chart
        .configure_mesh()
        .x_desc("training steps [million]")
        .y_desc("reward per episode of 6 orbits")
        .light_line_style(WHITE)
        .label_style(("sans-serif", 18))
        .draw()?;
    for (curve, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
        let line = curve.points.iter().map(|point| (point.0 / 1e6, point.1));
        let upper = curve.points.iter().map(|point| (point.0 / 1e6, point.1 + point.2));
        let lower = curve.points.iter().rev().map(|point| (point.0 / 1e6, point.1 - point.2));
        let band: Vec<(f64, f64)> = upper.chain(lower).collect();
        chart.draw_series(std::iter::once(Polygon::new(band, colour.mix(0.2))))?;
        chart
            .draw_series(LineSeries::new(line, colour.stroke_width(2)))?
            .label(&curve.label)
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 16, y + 5)], colour.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.8))
        .label_font(("sans-serif", 18))
        .draw()
}

fn draw_boxes<DB: DrawingBackend>(area: &Area<DB>, boxes: &[Box]) -> Drawn<DB> {
    let labels: Vec<&str> = boxes.iter().map(|it| it.label.as_str()).collect();
    let values = || boxes.iter().flat_map(|it| &it.values);
    let top = values().copied().fold(1.0, f64::max) as f32;
    let mut chart = ChartBuilder::on(area)
        .margin(16)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d((0..boxes.len()).into_segmented(), 0.0..1.08 * top)?;
    chart
        .configure_mesh()
        .y_desc("reward per orbit")
        .x_labels(boxes.len() + 1)
        .x_label_formatter(&|place| match place {
            SegmentValue::CenterOf(index) => labels.get(*index).copied().unwrap_or("").to_owned(),
            _ => String::new(),
        })
        .light_line_style(WHITE)
        .label_style(("sans-serif", 16))
        .draw()?;
    let drawn = boxes.iter().zip(COLOURS.iter().cycle()).enumerate().map(|(index, (it, colour))| {
        Boxplot::new_vertical(SegmentValue::CenterOf(index), &Quartiles::new(&it.values))
            .width(40)
            .style(colour.stroke_width(2))
    });
    chart.draw_series(drawn)?;
    Ok(())
}

/// Which quantity a panel of Fig. 5 shows.
struct Panel {
    title: &'static str,
    value: fn(&Bars) -> f64,
    deviation: fn(&Bars) -> f64,
    /// A part of the value that is drawn darker.
    part: fn(&Bars) -> f64,
}

const PANELS: [Panel; 4] = [
    Panel { title: "reward per orbit", value: |it| it.reward.0, deviation: |it| it.reward.1, part: |_| 0.0 },
    Panel {
        title: "priority of imaged strips",
        value: |it| it.priority.0,
        deviation: |it| it.priority.1,
        part: |_| 0.0,
    },
    Panel {
        title: "task duration [s], transition darker",
        value: |it| it.t_pre_s + it.t_acq_s,
        deviation: |_| 0.0,
        part: |it| it.t_pre_s,
    },
    Panel { title: "attempts per orbit", value: |it| it.attempts, deviation: |_| 0.0, part: |_| 0.0 },
];

fn draw_densities<DB: DrawingBackend>(area: &Area<DB>, bars: &[Bars]) -> Drawn<DB> {
    for (part, panel) in area.split_evenly((2, 2)).iter().zip(&PANELS) {
        draw_panel(part, bars, panel)?;
    }
    Ok(())
}

fn draw_panel<DB: DrawingBackend>(area: &Area<DB>, bars: &[Bars], panel: &Panel) -> Drawn<DB> {
    let unique = |mut items: Vec<String>| {
        let mut seen = Vec::new();
        items.retain(|item| {
            !seen.contains(item) && {
                seen.push(item.clone());
                true
            }
        });
        items
    };
    let planners = unique(bars.iter().map(|it| it.planner.clone()).collect());
    let densities = unique(bars.iter().map(|it| it.requests.to_string()).collect());
    let top = bars.iter().map(|it| (panel.value)(it) + (panel.deviation)(it)).fold(0.0, f64::max);
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .caption(panel.title, ("sans-serif", 20))
        .x_label_area_size(36)
        .y_label_area_size(52)
        .build_cartesian_2d(0.0..densities.len() as f64, 0.0..1.25 * top)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_labels(0)
        .x_desc(format!("requests: {}", densities.join(", ")))
        .light_line_style(WHITE)
        .label_style(("sans-serif", 15))
        .draw()?;
    let width = 0.8 / planners.len() as f64;
    for (number, (planner, colour)) in planners.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let own = bars.iter().filter(|it| it.planner == *planner).enumerate();
        let left = |index: usize| index as f64 + 0.1 + number as f64 * width;
        let bar = |index: usize, height: f64, opacity: f64| {
            Rectangle::new([(left(index), 0.0), (left(index) + 0.92 * width, height)], colour.mix(opacity).filled())
        };
        chart
            .draw_series(own.clone().map(|(index, it)| bar(index, (panel.value)(it), 0.6)))?
            .label(planner)
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], colour.mix(0.6).filled()));
        chart.draw_series(own.clone().map(|(index, it)| bar(index, (panel.part)(it), 1.0)))?;
        chart.draw_series(own.filter(|(_, it)| (panel.deviation)(it) > 0.0).map(|(index, it)| {
            let (value, deviation) = ((panel.value)(it), (panel.deviation)(it));
            let middle = left(index) + 0.46 * width;
            PathElement::new([(middle, value - deviation), (middle, value + deviation)], BLACK.stroke_width(1))
        }))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.8))
        .label_font(("sans-serif", 15))
        .draw()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_smoothed_and_averaged_as_far_as_all_have_come() {
        let runs = [vec![(1e5, 10.0), (2e5, 20.0)], vec![(1e5, 14.0), (2e5, 24.0), (3e5, 90.0)]];
        let curve = Curve::average("a", &runs);
        let last = curve.points.last().copied().unwrap();
        assert_eq!((last.0, last.1), (2e5, 22.0));
        assert!((last.2 - 8f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn every_figure_is_drawn_as_svg_and_png_with_its_labels() {
        let folder = tempfile::tempdir().unwrap();
        let curve = Curve { label: "one".into(), points: vec![(0.0, 1.0, 0.5), (1e6, 3.0, 0.5)] };
        learning_curves(&folder.path().join("fig3"), &[curve]).unwrap();
        boxes(&folder.path().join("fig4"), &[Box { label: "two".into(), values: vec![1.0, 2.0, 4.0] }]).unwrap();
        let bars = Bars {
            planner: "three".into(),
            requests: 2000,
            reward: (30.0, 2.0),
            priority: (0.8, 0.1),
            t_pre_s: 40.0,
            t_acq_s: 70.0,
            attempts: 50.0,
        };
        densities(&folder.path().join("fig5"), &[bars]).unwrap();
        for (name, label) in [("fig3", "one"), ("fig4", "two"), ("fig5", "three")] {
            let path = folder.path().join(name);
            assert!(std::fs::read_to_string(path.with_extension("svg")).unwrap().contains(label));
            let png = std::fs::read(path.with_extension("png")).unwrap();
            assert!(png.starts_with(b"\x89PNG") && png.len() > 2000, "{name}");
        }
    }
}
