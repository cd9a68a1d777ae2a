//! What becomes of lines that are shorter than a strip may be.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::shapes::sphere::{Place, angle, direction};

/// What becomes of lines that are shorter than a strip may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShortLines {
    /// They are strips as they are, which are refused.
    #[default]
    Refuse,
    /// Their strips are stretched to the least length, on both sides alike.
    Stretch,
    /// Lines of a feature that meet, one of them too short, are one line; what is too short still is stretched.
    Join,
}

impl ShortLines {
    const ALL: [Self; 3] = [Self::Refuse, Self::Stretch, Self::Join];

    fn name(self) -> &'static str {
        match self {
            Self::Refuse => "refuse",
            Self::Stretch => "stretch",
            Self::Join => "join",
        }
    }
}

impl FromStr for ShortLines {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|it| it.name() == text);
        found.ok_or_else(|| format!("`{text}` is neither `refuse`, `stretch` nor `join`"))
    }
}

impl fmt::Display for ShortLines {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Most lines that are looked at where one ends: at a hub of thousands, the first ones are as good as the others.
const NEIGHBOURS_MAX: usize = 8;

/// A line, and its number among those of its feature.
pub type Numbered = (usize, Vec<Place>);

/// Joins lines of which one begins where another ends and one of both is shorter than `least`: within `reach`, nearest
/// first, both angles [rad]. Directions are kept; a joined line has the number of its first part, and lines come in the
/// order of their numbers.
#[must_use]
pub fn joined(lines: Vec<Numbered>, least: f64, reach: f64) -> Vec<Numbered> {
    let ends: Vec<Option<Ends>> = lines.iter().map(|(_, line)| Ends::new(line, least)).collect();
    let mut chains = Chains::new(lines.len());
    for (_, from, to) in meetings(&ends, reach) {
        chains.link(from, to);
    }
    let mut lines: Vec<Option<Numbered>> = lines.into_iter().map(Some).collect();
    let mut out = Vec::new();
    for first in (0..lines.len()).filter(|i| chains.before[*i].is_none()) {
        let Some((number, mut line)) = lines[first].take() else { continue };
        let mut at = first;
        while let Some(next) = chains.after[at] {
            line.extend(lines[next].take().map(|(_, line)| line).unwrap_or_default());
            at = next;
        }
        out.push((number, line));
    }
    out.sort_by_key(|(number, _)| *number);
    out
}

/// Where a line begins and ends, and whether it is too short.
struct Ends {
    start: Vector3<f64>,
    end: Vector3<f64>,
    short: bool,
}

impl Ends {
    fn new(line: &[Place], least: f64) -> Option<Self> {
        if line.iter().flatten().any(|number| !number.is_finite()) {
            return None;
        }
        let points: Vec<_> = line.iter().map(|place| direction(*place)).collect();
        let (&start, &end) = (points.first()?, points.last()?);
        let length: f64 = points.windows(2).map(|two| angle(&two[0], &two[1])).sum();
        Some(Self { start, end, short: length < least })
    }
}

/// Pairs of lines that meet, the nearest first.
fn meetings(ends: &[Option<Ends>], reach: f64) -> Vec<(f64, usize, usize)> {
    let cell = |at: &Vector3<f64>| [at.x, at.y, at.z].map(|it| (it / reach.max(1e-9)).floor() as i64);
    let mut starts: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (i, ends) in ends.iter().enumerate() {
        if let Some(ends) = ends {
            starts.entry(cell(&ends.start)).or_default().push(i);
        }
    }
    let around = |[x, y, z]: [i64; 3]| (0..27_i64).map(move |k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
    let mut found = Vec::new();
    for (from, one) in ends.iter().enumerate() {
        let Some(one) = one else { continue };
        let near = around(cell(&one.end)).filter_map(|cell| starts.get(&cell)).flatten().copied();
        let meets = |to: usize| {
            let other = ends[to].as_ref().filter(|other| to != from && (one.short || other.short))?;
            let distance = angle(&one.end, &other.start);
            (distance <= reach).then_some((distance, from, to))
        };
        found.extend(near.filter_map(meets).take(NEIGHBOURS_MAX));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    found
}

/// Lines one after the other.
struct Chains {
    before: Vec<Option<usize>>,
    after: Vec<Option<usize>>,
    /// A line of the same chain, nearer to the one that stands for it; that one is its own.
    same: Vec<usize>,
}

impl Chains {
    fn new(count: usize) -> Self {
        Self { before: vec![None; count], after: vec![None; count], same: (0..count).collect() }
    }

    fn chain(&mut self, mut line: usize) -> usize {
        while self.same[line] != line {
            self.same[line] = self.same[self.same[line]];
            line = self.same[line];
        }
        line
    }

    /// Puts a line behind another, unless either is taken or that would close a ring.
    fn link(&mut self, from: usize, to: usize) {
        let (a, b) = (self.chain(from), self.chain(to));
        if a != b && self.after[from].is_none() && self.before[to].is_none() {
            (self.after[from], self.before[to]) = (Some(to), Some(from));
            self.same[b] = a;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEAST: f64 = 0.003;
    const REACH: f64 = 0.001;

    fn join(lines: &[&[Place]]) -> Vec<(usize, usize)> {
        let lines = lines.iter().enumerate().map(|(i, line)| (i + 1, line.to_vec())).collect();
        joined(lines, LEAST, REACH).into_iter().map(|(number, line)| (number, line.len())).collect()
    }

    #[test]
    fn short_lines_that_meet_are_one_whatever_their_order() {
        let [a, b, c] = [[[0.0, 0.0], [0.1, 0.0]], [[0.1, 0.0], [0.2, 0.0]], [[0.2, 0.001], [0.3, 0.0]]];
        assert_eq!(join(&[&a, &b, &c]), [(1, 6)]);
        assert_eq!(join(&[&c, &a, &b]), [(2, 6)]);
        let backward = [[0.2, 0.0], [0.1, 0.0]];
        assert_eq!(join(&[&a, &backward]), [(1, 2), (2, 2)], "directions are kept");
    }

    #[test]
    fn long_lines_stay_apart_and_take_short_ones() {
        let (one, other, short) = ([[0.0, 0.0], [3.0, 0.0]], [[3.0, 0.0], [6.0, 0.0]], [[6.0, 0.0], [6.1, 0.0]]);
        assert_eq!(join(&[&one, &other]), [(1, 2), (2, 2)]);
        assert_eq!(join(&[&one, &other, &short]), [(1, 2), (2, 4)]);
    }

    #[test]
    fn rings_are_opened_hubs_are_left_and_no_line_is_lost() {
        let corners: [Place; 4] = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]];
        let ring: Vec<[Place; 2]> = (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]).collect();
        assert_eq!(join(&ring.iter().map(|it| &it[..]).collect::<Vec<_>>()), [(1, 8)]);
        let hub: Vec<[Place; 2]> = (0..50).map(|i| [[1.0, 1.0], [1.1, 1.0 + 0.001 * f64::from(i)]]).collect();
        assert_eq!(join(&hub.iter().map(|it| &it[..]).collect::<Vec<_>>()).len(), 50);
        let broken: [Place; 2] = [[0.1, 0.0], [f64::NAN, 0.0]];
        assert_eq!(join(&[&[[0.0, 0.0], [0.1, 0.0]], &broken, &[]]), [(1, 2), (2, 2), (3, 0)]);
    }
}
