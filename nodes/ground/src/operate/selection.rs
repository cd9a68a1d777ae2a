//! Which strips an operator means: by number, or by what they have in common.

use std::collections::BTreeSet;

use anyhow::{Result, bail};
use clap::Args;
use regex::Regex;
use swath_msgs::swath_msgs as msg;
use swath_ros::graph;

use super::client::{Operator, check};
use swath_mission::requests::index::Area;
use swath_mission::requests::lifecycle::State;

/// Who acts.
#[derive(Debug, Args)]
pub struct Actor {
    /// Who asks for it.
    #[arg(long, default_value = "operator")]
    pub actor: String,
    /// Why.
    #[arg(long, default_value = "")]
    pub reason: String,
}

/// What strips have in common.
#[derive(Clone, Debug, Default, Args)]
pub struct Common {
    /// Only strips of the order with this number
    #[arg(long)]
    pub order: Option<u64>,
    /// Only strips of the line, area or strip with this reference of its submitter's
    #[arg(long = "ref")]
    reference: Option<String>,
    /// Only strips of this submitter
    #[arg(long)]
    pub submitter: Option<String>,
    /// Only strips whose name holds this regular expression
    #[arg(long)]
    name: Option<Regex>,
    /// Only strips in this state; may be given several times
    #[arg(long, value_parser = parse_state)]
    pub state: Vec<State>,
    /// Only strips of which a point lies in south,north,west,east [deg]
    #[arg(long, value_parser = parse_area, allow_hyphen_values = true)]
    pub area: Option<Area>,
}

/// Strips by number, or by what they have in common.
#[derive(Debug, Args)]
pub struct Selection {
    /// Numbers of the strips
    ids: Vec<u64>,
    #[command(flatten)]
    common: Common,
}

impl Common {
    fn is_empty(&self) -> bool {
        let Self { order, reference, submitter, name, state, area } = self;
        order.is_none()
            && reference.is_none()
            && submitter.is_none()
            && name.is_none()
            && state.is_empty()
            && area.is_none()
    }

    /// Whether one order or reference is meant, so that its strips belong together.
    #[must_use]
    pub fn is_one_order(&self) -> bool {
        self.order.is_some() || self.reference.is_some()
    }

    /// Whether a strip that passed state and area passes the rest.
    #[must_use]
    pub fn holds(&self, status: &msg::StripStatus) -> bool {
        self.reference.as_ref().is_none_or(|reference| is_part_of(&status.client_ref, reference))
            && self.submitter.as_ref().is_none_or(|submitter| status.submitter == *submitter)
            && self.name.as_ref().is_none_or(|name| name.is_match(&status.strip.name))
    }

    /// A call for the strips that may be meant.
    #[must_use]
    pub fn call(&self) -> msg::ListStripsRequest {
        let area = self.area.unwrap_or(Area { south_deg: 0.0, north_deg: 0.0, west_deg: 0.0, east_deg: 0.0 });
        msg::ListStripsRequest {
            order_id: self.order.unwrap_or(0),
            states: self.state.iter().map(|state| state.number()).collect::<Vec<_>>(),
            in_area: self.area.is_some(),
            south_deg: area.south_deg,
            north_deg: area.north_deg,
            west_deg: area.west_deg,
            east_deg: area.east_deg,
            limit: 100,
            ..Default::default()
        }
    }
}

impl Selection {
    /// The strips of an order that are not over.
    #[must_use]
    pub fn of_order(order: u64) -> Self {
        Self::having(Common { order: Some(order), ..Common::default() })
    }

    /// Strips that have something in common.
    #[must_use]
    pub fn having(common: Common) -> Self {
        Self { ids: Vec::new(), common }
    }

    /// The numbers that are meant; of two directions of a strip, one.
    ///
    /// # Errors
    /// When nothing is said, nobody answers, or no strip is meant.
    pub fn find(&self, operator: &Operator) -> Result<Vec<u64>> {
        if self.common.is_empty() {
            if self.ids.is_empty() {
                bail!("say which strips: by number, --order, --ref, --submitter, --name, --state or --area");
            }
            return Ok(self.ids.clone());
        }
        if !self.ids.is_empty() {
            bail!("say which strips by number or by what they have in common, not both");
        }
        let mut found = BTreeSet::new();
        for status in pages(operator, &self.common)? {
            // What is over is meant only by those who say so.
            let over = State::from_number(status.state).is_none_or(State::is_final);
            if (!over || !self.common.state.is_empty()) && !found.contains(&status.linked_to) {
                found.insert(status.strip.id);
            }
        }
        if found.is_empty() {
            bail!("no strip is meant");
        }
        Ok(found.into_iter().collect())
    }
}

/// All strips that have something in common, by their numbers.
///
/// # Errors
/// When nobody answers, or a filter is refused.
pub fn pages(operator: &Operator, common: &Common) -> Result<Vec<msg::StripStatus>> {
    let desk = operator.desk(&graph::LIST_STRIPS)?;
    let mut call = common.call();
    let mut found = Vec::new();
    loop {
        let page = desk.call(call.clone())?;
        check(page.reason_code, &page.reason)?;
        call.after_id = page.strips.last().map_or(call.after_id, |status| status.strip.id);
        found.extend(page.strips.into_iter().filter(|status| common.holds(status)));
        if !page.more {
            return Ok(found);
        }
    }
}

fn parse_state(name: &str) -> Result<State, String> {
    State::from_name(name).ok_or_else(|| {
        let names: Vec<_> = State::ALL.iter().map(|state| state.name().replace(' ', "-")).collect();
        format!("expected one of {}", names.join(", "))
    })
}

fn parse_area(text: &str) -> Result<Area, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
    match numbers[..] {
        [south_deg, north_deg, west_deg, east_deg] if text.split(',').count() == 4 => {
            Ok(Area { south_deg, north_deg, west_deg, east_deg })
        }
        _ => Err("expected four numbers: south,north,west,east".to_owned()),
    }
}

/// Whether a reference is that of a line or area, or of a piece of it: `REF`, `REF 2`, `REF 1/3`, `REF 2 1/3`.
fn is_part_of(reference: &str, whole: &str) -> bool {
    let Some(rest) = reference.strip_prefix(whole) else { return false };
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let is_piece = |word: &str| match word.split_once('/') {
        Some((piece, count)) => is_number(piece) && is_number(count),
        None => is_number(word) || word == "area",
    };
    rest.is_empty() || rest.starts_with(' ') && rest[1..].split(' ').all(is_piece)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pieces_of_a_reference_are_part_of_it_and_nothing_else_is() {
        for part in ["po", "po 2", "po 1/3", "po 2 1/3", "po area 11/12"] {
            assert!(is_part_of(part, "po"), "{part}");
        }
        for other in ["po-delta", "po delta", "p", "po 1/", "po  2", "popo"] {
            assert!(!is_part_of(other, "po"), "{other}");
        }
    }
}
