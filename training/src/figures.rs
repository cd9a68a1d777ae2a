//! The paper's Figures 3, 4 and 5, each as SVG and PNG.

use std::path::{Path, PathBuf};
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

/// Height of the labels [px].
const LABEL_SIZE: i32 = 16;

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
    /// Strips asked for, as the axis names them.
    pub requests: String,
    /// Reward per orbit, mean and deviation; 0 for none.
    pub reward: (f64, f64),
    /// Priority of imaged strips, mean and deviation; 0 for none.
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
    pub fn average(label: &str, runs: &[Vec<(f64, f64)>]) -> Self {
        let ends = runs.iter().map(|run| run.last().map_or(0.0, |point| point.0));
        let end = ends.fold(f64::INFINITY, f64::min);
        let at = |index: usize| end * (index + 1) as f64 / POINTS as f64;
        let points = (0..POINTS).filter_map(|index| {
            let steps = at(index);
            let values: Option<Vec<f64>> = runs.iter().map(|run| smoothed(run, steps)).collect();
            let spread = crate::evaluate::spread_of(&values?)?;
            Some((steps, spread.mean, spread.deviation.unwrap_or(0.0)))
        });
        Self { label: label.to_owned(), points: points.collect() }
    }
}

/// Mean of a run over the window that ends at `steps`; none when nothing ended in it.
fn smoothed(run: &[(f64, f64)], steps: f64) -> Option<f64> {
    let inside = run.iter().filter(|(at, _)| *at <= steps && *at > steps - SMOOTHING_STEPS);
    let (sum, count) = inside.fold((0.0, 0.0), |(sum, count), (_, value)| (sum + value, count + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// Fig. 3: return over training steps. `orbits` is the length of an episode, where it is known.
///
/// # Errors
/// Files that cannot be written, and curves without a point.
pub fn learning_curves(path: &Path, curves: &[Curve], orbits: Option<f64>) -> Result<()> {
    for curve in curves {
        if curve.points.is_empty() {
            return Err(nothing(&format!("curve {}: no episode ended in all of its runs", curve.label)));
        }
    }
    let reward = match orbits {
        Some(orbits) => format!("reward per episode of {orbits} orbits"),
        None => "reward per episode".to_owned(),
    };
    draw(path, SIZE, curves.len(), &Plot::Curves { curves, reward: &reward })
}

/// Fig. 4: reward per orbit of each planner.
///
/// # Errors
/// Files that cannot be written, and planners without a mission.
pub fn boxes(path: &Path, boxes: &[Box]) -> Result<()> {
    if let Some(empty) = boxes.iter().find(|it| it.values.is_empty()) {
        return Err(nothing(&format!("{} flew no mission", empty.label)));
    }
    draw(path, (boxes_width(boxes), SIZE.1), boxes.len(), &Plot::Boxes(boxes))
}

/// Fig. 5: behaviour over the density of requests.
///
/// # Errors
/// Files that cannot be written.
pub fn densities(path: &Path, bars: &[Bars]) -> Result<()> {
    draw(path, (1200, 860), bars.len(), &Plot::Densities(bars))
}

fn nothing(what: &str) -> TrainingError {
    TrainingError::NoResult(format!("nothing to draw: {what}"))
}

/// Width at which no label under a box touches the next [px].
fn boxes_width(boxes: &[Box]) -> u32 {
    register_font();
    let font = ("sans-serif", LABEL_SIZE).into_font();
    let widths = boxes.iter().filter_map(|it| font.box_size(&it.label).ok());
    let widest = widths.map(|(width, _)| width).max().unwrap_or(0);
    // The axis has one slot more than there are boxes.
    SIZE.0.max(110 + (boxes.len() as u32 + 1) * (widest + 16))
}

enum Plot<'a> {
    Curves { curves: &'a [Curve], reward: &'a str },
    Boxes(&'a [Box]),
    Densities(&'a [Bars]),
}

type Area<DB> = DrawingArea<DB, Shift>;
type Drawn<DB> = std::result::Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

fn draw(path: &Path, size: (u32, u32), parts: usize, plot: &Plot) -> Result<()> {
    if parts == 0 {
        return Err(nothing(&path.display().to_string()));
    }
    register_font();
    let failed = |error: &dyn std::fmt::Display, path: &Path| {
        TrainingError::file("write", path)(std::io::Error::other(error.to_string()))
    };
    let svg = with_ending(path, "svg");
    plot.onto(&SVGBackend::new(&svg, size).into_drawing_area()).map_err(|error| failed(&error, &svg))?;
    let png = with_ending(path, "png");
    plot.onto(&BitMapBackend::new(&png, size).into_drawing_area()).map_err(|error| failed(&error, &png))
}

/// A path with an ending more, whatever points its name has.
fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut path = path.as_os_str().to_owned();
    path.push(".");
    path.push(ending);
    path.into()
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
            Plot::Curves { curves, reward } => draw_curves(area, curves, reward)?,
            Plot::Boxes(boxes) => draw_boxes(area, boxes)?,
            Plot::Densities(bars) => draw_densities(area, bars)?,
        }
        area.present()
    }
}

fn draw_curves<DB: DrawingBackend>(area: &Area<DB>, curves: &[Curve], reward: &str) -> Drawn<DB> {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let end = points().map(|point| point.0).fold(1.0, f64::max);
    let top = points().map(|point| point.1 + point.2).fold(1.0, f64::max);
    let bottom = points().map(|point| point.1 - point.2).fold(0.0, f64::min);
    let (unit, unit_name) = if end < 2e5 { (1e3, "thousand") } else { (1e6, "million") };
    let mut chart = ChartBuilder::on(area)
        .margin(16)
        .caption("mean over 50 000 steps; band: standard deviation over runs", ("sans-serif", LABEL_SIZE))
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..end / unit, 1.08 * bottom..1.08 * top)?;
    chart
        .configure_mesh()
        .x_desc(format!("training steps [{unit_name}]"))
        .y_desc(reward)
        .light_line_style(WHITE)
        .label_style(("sans-serif", 18))
        .draw()?;
    for (curve, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
        let line = curve.points.iter().map(|point| (point.0 / unit, point.1));
        let upper = curve.points.iter().map(|point| (point.0 / unit, point.1 + point.2));
        let lower = curve.points.iter().rev().map(|point| (point.0 / unit, point.1 - point.2));
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
    let quartiles: Vec<Quartiles> = boxes.iter().map(|it| Quartiles::new(&it.values)).collect();
    let drawn = || quartiles.iter().flat_map(Quartiles::values);
    let (bottom, top) = (drawn().fold(0.0, f32::min), drawn().fold(1.0, f32::max));
    let mut chart = ChartBuilder::on(area)
        .margin(16)
        .caption("box: quartiles; whiskers: 1.5 times its height from it", ("sans-serif", LABEL_SIZE))
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d((0..boxes.len()).into_segmented(), 1.08 * bottom..1.08 * top)?;
    chart
        .configure_mesh()
        .x_desc("planner")
        .y_desc("reward per orbit, one value a mission")
        .x_labels(boxes.len() + 1)
        .x_label_formatter(&|place| match place {
            SegmentValue::CenterOf(index) => labels.get(*index).copied().unwrap_or("").to_owned(),
            _ => String::new(),
        })
        .light_line_style(WHITE)
        .label_style(("sans-serif", LABEL_SIZE))
        .draw()?;
    let drawn = quartiles.iter().zip(COLOURS.iter().cycle()).enumerate().map(|(index, (quartiles, colour))| {
        Boxplot::new_vertical(SegmentValue::CenterOf(index), quartiles).width(40).style(colour.stroke_width(2))
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
    Panel {
        title: "reward per orbit, ± deviation over missions",
        value: |it| it.reward.0,
        deviation: |it| it.reward.1,
        part: |_| 0.0,
    },
    Panel {
        title: "priority of imaged strips, ± deviation over missions",
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
        draw_panel(part, panel, bars)?;
    }
    Ok(())
}

/// Items without those that came before.
fn unique<'a>(items: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = Vec::new();
    for item in items {
        if !seen.contains(&item) {
            seen.push(item);
        }
    }
    seen
}

fn draw_panel<DB: DrawingBackend>(area: &Area<DB>, panel: &Panel, bars: &[Bars]) -> Drawn<DB> {
    let planners = unique(bars.iter().map(|it| it.planner.as_str()));
    let densities = unique(bars.iter().map(|it| it.requests.as_str()));
    let top = bars.iter().map(|it| (panel.value)(it) + (panel.deviation)(it)).fold(1e-3, f64::max);
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .caption(panel.title, ("sans-serif", 20))
        .x_label_area_size(46)
        .y_label_area_size(52)
        .build_cartesian_2d(0.0..densities.len() as f64, 0.0..1.25 * top)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        // A mark every half: those between two whole numbers stand in the middle of a group.
        .x_labels(2 * densities.len() + 1)
        .x_label_formatter(&|place| {
            let middle = (place.fract() - 0.5).abs() < 1e-6;
            densities.get(*place as usize).filter(|_| middle).copied().unwrap_or("").to_owned()
        })
        .x_desc("strips asked for")
        .light_line_style(WHITE)
        .label_style(("sans-serif", 15))
        .draw()?;
    let width = 0.8 / planners.len() as f64;
    for (number, (planner, colour)) in planners.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let own = bars.iter().filter(|it| it.planner == *planner).filter_map(|it| {
            let group = densities.iter().position(|density| *density == it.requests)?;
            Some((group as f64 + 0.1 + number as f64 * width, it))
        });
        let bar = |left: f64, height: f64, opacity: f64| {
            Rectangle::new([(left, 0.0), (left + 0.92 * width, height)], colour.mix(opacity).filled())
        };
        chart
            .draw_series(own.clone().map(|(left, it)| bar(left, (panel.value)(it), 0.6)))?
            .label(*planner)
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], colour.mix(0.6).filled()));
        chart.draw_series(own.clone().map(|(left, it)| bar(left, (panel.part)(it), 1.0)))?;
        chart.draw_series(own.filter(|(_, it)| (panel.deviation)(it) > 0.0).map(|(left, it)| {
            let (value, deviation) = ((panel.value)(it), (panel.deviation)(it));
            let middle = left + 0.46 * width;
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

    fn bars(requests: &str) -> Bars {
        Bars {
            planner: "three".into(),
            requests: requests.into(),
            reward: (30.0, 2.0),
            priority: (0.8, 0.1),
            t_pre_s: 40.0,
            t_acq_s: 70.0,
            attempts: 50.0,
        }
    }

    fn text(path: &Path) -> String {
        std::fs::read_to_string(with_ending(path, "svg")).unwrap()
    }

    #[test]
    fn every_figure_is_drawn_as_svg_and_png_with_its_labels() {
        let folder = tempfile::tempdir().unwrap();
        let curve = Curve { label: "one".into(), points: vec![(0.0, 1.0, 0.5), (1e6, 3.0, 0.5)] };
        learning_curves(&folder.path().join("fig3"), &[curve], Some(6.0)).unwrap();
        boxes(&folder.path().join("fig4"), &[Box { label: "two".into(), values: vec![1.0, 2.0, 4.0] }]).unwrap();
        densities(&folder.path().join("fig5"), &[bars("2000"), bars("3000")]).unwrap();
        for (name, label) in [("fig3", "one"), ("fig4", "two"), ("fig5", "three")] {
            let path = folder.path().join(name);
            assert!(text(&path).contains(label));
            let png = std::fs::read(with_ending(&path, "png")).unwrap();
            assert!(png.starts_with(b"\x89PNG") && png.len() > 2000, "{name}");
        }
    }

    #[test]
    fn axes_say_what_is_drawn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.b");
        let curve = |end: f64| Curve { label: "<one>".into(), points: vec![(0.0, 1.0, 0.5), (end, 3.0, 0.5)] };
        learning_curves(&path, &[curve(1e6)], Some(0.5)).unwrap();
        let drawn = text(&path);
        assert!(drawn.contains("reward per episode of 0.5 orbits") && drawn.contains("training steps [million]"));
        assert!(drawn.contains("&lt;one&gt;"), "labels are text");
        learning_curves(&path, &[curve(4e4)], None).unwrap();
        let drawn = text(&path);
        assert!(!drawn.contains("orbits") && drawn.contains("training steps [thousand]"));
        densities(&path, &[bars("2000"), bars("3000 to 4000")]).unwrap();
        let drawn = text(&path);
        assert!(drawn.contains("2000\n") && drawn.contains("3000 to 4000\n") && drawn.contains("strips asked for"));
    }

    #[test]
    fn labels_under_boxes_have_room() {
        let long = |count: usize| -> Vec<Box> {
            let label = "hop-ppo+lookahead, torque-10%".to_owned();
            (0..count).map(|_| Box { label: label.clone(), values: vec![1.0, 2.0] }).collect()
        };
        assert_eq!(boxes_width(&long(1)), SIZE.0);
        let font = ("sans-serif", LABEL_SIZE).into_font();
        let label = font.box_size(&long(1)[0].label).unwrap().0;
        assert!(boxes_width(&long(12)) > 12 * (label + 10), "{label}");
    }

    #[test]
    fn nothing_to_draw_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("figure");
        let empty = Curve { label: "one".into(), points: Vec::new() };
        for error in [
            learning_curves(&path, &[], None),
            learning_curves(&path, &[empty], None),
            boxes(&path, &[]),
            boxes(&path, &[Box { label: "two".into(), values: Vec::new() }]),
            densities(&path, &[]),
        ] {
            assert!(error.unwrap_err().to_string().contains("nothing to draw"));
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
