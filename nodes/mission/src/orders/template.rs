//! A feature becomes orders: its lines are followed and its areas are covered by strips that share its worth.

use sha2::{Digest as _, Sha256};
use swath_sim::world::strip::StripRequest;

use super::feature::{Feature, Part};
use super::feature_strips::{CutStrip, Cutting, Outline};
use super::found::{Cut, Import, Shown};
use super::geojson::feature_of;
use super::order::{MISSION, Order, Part as OrderPart, rounded};
use crate::shapes::sphere::Place;
use crate::time_text;

/// Priority of a feature that gives none.
const DEFAULT_PRIORITY: f64 = 0.5;
/// Acquisition speed of a feature that gives none [m/s].
pub(super) const DEFAULT_SPEED_M_S: f64 = 3000.0;
/// Names under which features have their names.
const NAMES: [&str; 4] = ["name", "Name", "NAME", "title"];

/// What the strips of a feature have in common.
pub(super) struct Template {
    order: Order,
    /// Whether the feature has a reference of its submitter's own.
    referenced: bool,
    cutting: Cutting,
}

impl Template {
    /// The template of a feature; a name for people that have given none, and how strips are made unless the feature
    /// says otherwise.
    ///
    /// # Errors
    /// When a property cannot be.
    pub(super) fn new(feature: &Feature, fallback: &str, cutting: &Cutting) -> Result<Self, String> {
        let time = |key: &str, of_day: usize| match feature.text(&[key])?.filter(|text| !text.trim().is_empty()) {
            None => Ok(0),
            Some(text) => match time_text::day(&text) {
                Some(day) => Ok(day[of_day]),
                None => time_text::parse(&text).map_err(|error| format!("`{key}`: {error}")),
            },
        };
        let max_attempts = whole(feature, "max_attempts")?;
        let client_ref = feature.text(&["client_ref"])?;
        let request = StripRequest {
            start_latitude_deg: 0.0,
            start_longitude_deg: 0.0,
            end_latitude_deg: 0.0,
            end_longitude_deg: 0.0,
            priority: feature.number("priority")?.unwrap_or(DEFAULT_PRIORITY),
            acquisition_speed_m_s: feature.number("acquisition_speed_m_s")?.unwrap_or(DEFAULT_SPEED_M_S),
            bidirectional: feature.flag("bidirectional")?,
        };
        let order = Order {
            submitter: feature.text(&["submitter"])?.unwrap_or_else(|| MISSION.to_owned()),
            valid_from_ns: time("valid_from", 0)?,
            valid_until_ns: time("valid_until", 1)?,
            hold_for_approval: feature.flag("hold_for_approval")?,
            max_attempts,
            part: part(feature)?,
            ..Order::new(
                client_ref.clone().unwrap_or_default(),
                feature.text(&NAMES)?.unwrap_or_else(|| fallback.to_owned()),
                request,
            )
        };
        let cutting = Cutting {
            rows: feature.choice("rows")?.unwrap_or(cutting.rows),
            short_lines: feature.choice("short_lines")?.unwrap_or(cutting.short_lines),
            ..*cutting
        };
        Ok(Self { order, referenced: client_ref.is_some_and(|text| !text.is_empty()), cutting })
    }

    /// Orders for the strips of a feature's lines and areas: one order of several strips, or a strip that is one itself.
    fn orders(&self, shapes: &[Shape]) -> Vec<Order> {
        let total: f64 = shapes.iter().map(|shape| shape.worth).sum();
        let requests: Vec<Vec<StripRequest>> = shapes
            .iter()
            .map(|shape| {
                let worth = shape.worth / total;
                shape.strips.iter().map(|strip| self.request(strip, strip.share * worth)).collect()
            })
            .collect();
        let all = requests.concat();
        let order_ref = if self.referenced { self.order.client_ref.clone() } else { self.identity(&all) };
        let mut orders = Vec::new();
        for (shape, requests) in shapes.iter().zip(requests) {
            let suffix = &shape.suffix;
            let reference = if self.referenced { format!("{order_ref}{suffix}") } else { self.identity(&requests) };
            let count = requests.len();
            for (k, (strip, request)) in (1..).zip(shape.strips.iter().zip(requests)) {
                let piece = if count > 1 { format!(" {k}/{count}") } else { String::new() };
                let (number, of) = (orders.len() as u32 + 1, all.len() as u32);
                let share = strip.share * (shape.worth / total);
                let part = OrderPart { order_ref: order_ref.clone(), number, of, share };
                orders.push(Order {
                    client_ref: format!("{reference}{piece}"),
                    name: format!("{}{suffix}{piece}", self.order.name),
                    request,
                    part: if all.len() > 1 { Some(part) } else { self.order.part.clone() },
                    ..self.order.clone()
                });
            }
        }
        orders
    }

    fn request(&self, strip: &CutStrip, share: f64) -> StripRequest {
        StripRequest {
            start_latitude_deg: strip.start[1],
            start_longitude_deg: strip.start[0],
            end_latitude_deg: strip.end[1],
            end_longitude_deg: strip.end[0],
            priority: self.order.request.priority * share,
            ..self.order.request.clone()
        }
    }

    /// A reference that is the same whenever the same is asked for, in whatever file and place.
    fn identity(&self, requests: &[StripRequest]) -> String {
        let mut hash = Sha256::new();
        for request in requests {
            let order = Order { name: String::new(), request: rounded(request), part: None, ..self.order.clone() };
            hash.update(feature_of(&order).to_string());
        }
        let digits: String = hash.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        format!("strip-{digits}")
    }
}

fn whole(feature: &Feature, key: &str) -> Result<u32, String> {
    let number = feature.number(key)?.unwrap_or(0.0);
    if number.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&number) {
        return Err(format!("`{key}` must be a whole number"));
    }
    Ok(number as u32)
}

/// Which part of an order a feature is, if it says so.
fn part(feature: &Feature) -> Result<Option<OrderPart>, String> {
    let Some(order_ref) = feature.text(&["order_ref"])?.filter(|text| !text.is_empty()) else { return Ok(None) };
    let share = feature.number("share")?.unwrap_or(1.0);
    Ok(Some(OrderPart { order_ref, number: whole(feature, "part")?, of: whole(feature, "parts")?, share }))
}

/// The strips of a line, or of a feature's areas.
struct Shape {
    strips: Vec<CutStrip>,
    /// What it is worth beside the others of its feature: the ground that it shows [km²].
    worth: f64,
    /// Its number in its feature, behind a name.
    suffix: String,
    /// How well it is shown.
    shown: Shown,
    /// What of it is left out, and why.
    left_out: Vec<String>,
}

/// Takes the lines and areas of a feature; what is wrong with a part goes to `faults` with the part's number.
pub(super) fn take_feature(
    feature: &Feature,
    template: &Template,
    import: &mut Import,
    faults: &mut Vec<(Option<usize>, String)>,
) {
    if feature.parts.is_empty() {
        return faults.push((None, "it has no geometry".to_owned()));
    }
    let cutting = &template.cutting;
    let numbered = |number: usize| (feature.parts.len() > 1).then_some(number);
    let (mut lines, mut areas, mut shapes) = (Vec::new(), Vec::new(), Vec::new());
    for (number, part) in (1..).zip(&feature.parts) {
        match part {
            Part::Line(line) => lines.push((number, line.clone())),
            Part::Area(rings) => match cutting.outline(rings) {
                Ok(outline) => areas.push(outline),
                Err(reason) => faults.push((numbered(number), reason)),
            },
            Part::Other(kind) => {
                faults.push((numbered(number), format!("a {kind} is no strip: expected a line or an area")));
            }
        }
    }
    let has_lines = !lines.is_empty();
    for (number, line) in cutting.lines(lines) {
        match line_shape(&line, numbered(number), cutting) {
            Ok(shape) => {
                faults.extend(shape.left_out.iter().map(|reason| (numbered(number), reason.clone())));
                shapes.push(shape);
            }
            Err(reason) => faults.push((numbered(number), reason)),
        }
    }
    if !areas.is_empty() {
        match area_shape(areas, if has_lines { " area" } else { "" }, cutting) {
            Ok(shape) => shapes.push(shape),
            Err(reason) => faults.push((None, reason)),
        }
    }
    faults.sort_by_key(|(number, _)| *number);
    import.shapes += shapes.len();
    import.orders.extend(template.orders(&shapes));
    import.cut.extend(shapes.into_iter().map(|shape| Cut {
        name: format!("{}{}", template.order.name, shape.suffix),
        strips: shape.strips.len(),
        shown: shape.shown,
        left_out: shape.left_out,
    }));
}

fn line_shape(line: &[Place], number: Option<usize>, cutting: &Cutting) -> Result<Shape, String> {
    let cut = cutting.line(line)?;
    Ok(Shape {
        shown: Shown::Line { length_km: cut.length_km, farthest_km: cut.farthest_km, too_short: cut.too_short },
        worth: cut.length_km.max(cutting.shortest_km) * cutting.swath_km,
        strips: cut.strips,
        suffix: number.map_or_else(String::new, |number| format!(" {number}")),
        left_out: cut.left_out,
    })
}

fn area_shape(areas: Vec<Outline>, suffix: &str, cutting: &Cutting) -> Result<Shape, String> {
    let (strips, cover) = cutting.area(areas)?;
    let square_km = cutting.square_km(&cover);
    Ok(Shape {
        shown: Shown::Area { square_km, covered: cover.covered, twice: cover.twice },
        worth: square_km.max(f64::MIN_POSITIVE),
        strips,
        suffix: suffix.to_owned(),
        left_out: Vec::new(),
    })
}
