//! What no plan can exceed: imaging as a liquid, and slewing for nothing.

use super::passes::Passes;
use crate::learn::episode::Env;

/// Width of the bins of time [ticks].
const BIN: u64 = 120;

/// An upper bound of the reward that is still to be had in an episode.
///
/// A plan images one strip at a time, each within a window and for T_acq. Relaxed: transitions take no time, imaging may
/// be interrupted, divided between windows and done in part for part of the reward. Time is cut into bins; a strip may
/// fill of a bin what lies between the opening of a window and its closing + T_acq. The strips that can be served
/// together then form a polymatroid, so that serving them by falling priority per second, each as far as rerouting
/// allows, is optimal (Edmonds 1970).
#[must_use]
pub fn upper_bound(env: &Env) -> f64 {
    let mut flow = Flow::new(env);
    let mut order: Vec<usize> = (0..flow.strips.len()).collect();
    let density = |strip: &Strip| strip.priority / strip.need as f64;
    order.sort_by(|&a, &b| density(&flow.strips[b]).total_cmp(&density(&flow.strips[a])).then(a.cmp(&b)));
    let mut reward = 0.0;
    for strip in order {
        let served = flow.serve(strip);
        let strip = &flow.strips[strip];
        reward += strip.priority * served as f64 / strip.need as f64;
    }
    reward
}

struct Strip {
    priority: f64,
    need: u64,
    /// Bins that it may use: the bin, how much of it, how much of it is used.
    shares: Vec<Share>,
}

#[derive(Clone, Copy)]
struct Share {
    bin: usize,
    most: u64,
    used: u64,
}

struct Bin {
    spare: u64,
    /// No rerouting can make room here any more.
    closed: bool,
    /// Strips that may use it, and where it stands among their shares.
    users: Vec<(usize, usize)>,
}

struct Flow {
    strips: Vec<Strip>,
    bins: Vec<Bin>,
}

impl Flow {
    fn new(env: &Env) -> Self {
        let (begin, end) = (env.now().0, env.horizon().0);
        let count = end.saturating_sub(begin).div_ceil(BIN) as usize;
        let edge = |bin: usize| begin + bin as u64 * BIN;
        let bin = |i| Bin { spare: edge(i + 1).min(end) - edge(i), closed: false, users: Vec::new() };
        let mut flow = Self { strips: Vec::new(), bins: (0..count).map(bin).collect() };
        let mut by_strip: std::collections::BTreeMap<_, Vec<_>> = std::collections::BTreeMap::new();
        for pass in Passes::new(env.catalogue()).all() {
            let linked = env.catalogue().get(pass.id).and_then(|entry| entry.linked);
            // Twins are paid once: they count as one strip with the windows of both.
            by_strip.entry(linked.map_or(pass.id, |twin| twin.min(pass.id))).or_default().push(*pass);
        }
        for passes in by_strip.values() {
            let mut most = std::collections::BTreeMap::<usize, u64>::new();
            for pass in passes {
                let (from, to) =
                    (pass.window.open.0.max(begin), (pass.window.close.0 + u64::from(pass.t_acq)).min(end));
                let bins = if from < to { (from - begin) / BIN..(to - begin).div_ceil(BIN) } else { 0..0 };
                for bin in bins.map(|bin| bin as usize) {
                    let overlap = to.min(edge(bin + 1)) - from.max(edge(bin));
                    let share = most.entry(bin).or_default();
                    *share = (*share + overlap).min(BIN);
                }
            }
            let number = flow.strips.len();
            let shares: Vec<Share> = most.into_iter().map(|(bin, most)| Share { bin, most, used: 0 }).collect();
            for (place, share) in shares.iter().enumerate() {
                flow.bins[share.bin].users.push((number, place));
            }
            let (priority, need) = (passes[0].strip.priority, u64::from(passes[0].t_acq).max(1));
            flow.strips.push(Strip { priority, need, shares });
        }
        flow
    }

    /// Gives a strip as much time as can be had without taking any from those served before.
    fn serve(&mut self, strip: usize) -> u64 {
        let mut served = 0;
        while served < self.strips[strip].need {
            let Some(more) = self.augment(strip, self.strips[strip].need - served) else { break };
            served += more;
        }
        served
    }

    /// Moves up to `most` along a shortest path from a strip to a bin with room; `None` when there is none.
    fn augment(&mut self, strip: usize, most: u64) -> Option<u64> {
        // How each bin was reached: by which strip, through which of its shares, and from which bin.
        let mut reached: std::collections::BTreeMap<usize, (usize, usize, Option<usize>)> = Default::default();
        let mut queue = std::collections::VecDeque::new();
        self.reach(strip, None, &mut reached, &mut queue);
        let mut seen = std::collections::BTreeSet::from([strip]);
        while let Some(bin) = queue.pop_front() {
            if self.bins[bin].spare > 0 {
                return Some(self.push(bin, most, &reached));
            }
            let users: Vec<usize> = self.bins[bin]
                .users
                .iter()
                .filter(|&&(user, place)| self.strips[user].shares[place].used > 0)
                .map(|&(user, _)| user)
                .collect();
            for user in users {
                if seen.insert(user) {
                    self.reach(user, Some(bin), &mut reached, &mut queue);
                }
            }
        }
        // Nothing leads out of the bins reached, and nothing ever will.
        for bin in reached.into_keys() {
            self.bins[bin].closed = true;
        }
        None
    }

    fn reach(
        &self,
        strip: usize,
        from: Option<usize>,
        reached: &mut std::collections::BTreeMap<usize, (usize, usize, Option<usize>)>,
        queue: &mut std::collections::VecDeque<usize>,
    ) {
        for (place, share) in self.strips[strip].shares.iter().enumerate() {
            let open = share.used < share.most && !self.bins[share.bin].closed;
            if open && !reached.contains_key(&share.bin) {
                reached.insert(share.bin, (strip, place, from));
                queue.push_back(share.bin);
            }
        }
    }

    fn push(
        &mut self,
        bin: usize,
        most: u64,
        reached: &std::collections::BTreeMap<usize, (usize, usize, Option<usize>)>,
    ) -> u64 {
        let mut path = Vec::new();
        let mut at = Some(bin);
        while let Some(bin) = at {
            let (strip, place, from) = reached[&bin];
            path.push((strip, place, from));
            at = from;
        }
        let place_of =
            |flow: &Self, strip: usize, bin: usize| flow.strips[strip].shares.iter().position(|share| share.bin == bin);
        let mut amount = most.min(self.bins[bin].spare);
        for &(strip, place, from) in &path {
            let share = self.strips[strip].shares[place];
            amount = amount.min(share.most - share.used);
            if let Some(place) = from.and_then(|from| place_of(self, strip, from)) {
                amount = amount.min(self.strips[strip].shares[place].used);
            }
        }
        self.bins[bin].spare -= amount;
        for &(strip, place, from) in &path {
            self.strips[strip].shares[place].used += amount;
            if let Some(place) = from.and_then(|from| place_of(self, strip, from)) {
                self.strips[strip].shares[place].used -= amount;
            }
        }
        amount
    }
}
