//! Start windows: when the imaging of a strip can begin so that eq. 12 holds to its end.

use nalgebra::Vector3;

use crate::config::SimConfig;
use crate::time::{Tick, TickPeriod};
use crate::world::orbit::Orbit;
use crate::world::strip::Strip;

/// Ticks at which imaging may start, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First tick.
    pub open: Tick,
    /// Last tick.
    pub close: Tick,
}

impl Window {
    /// Whether imaging may start at `tick`.
    #[must_use]
    pub fn contains(&self, tick: Tick) -> bool {
        self.open <= tick && tick <= self.close
    }
}

/// Spacing of the points of a strip at which visibility is sought [s], as in BSK-RL.
const CHECKPOINT_SPACING_S: f64 = 30.0;
/// Spacing of the points of a strip at which its least elevation is sought [s].
const ELEVATION_SPACING_S: f64 = 2.0;
/// Windows are drawn in by this much before they are rounded to ticks, for the roots' own error [s].
const ROOT_MARGIN_S: f64 = 1e-6;
/// How far before a span its first pass may culminate [s]: longer than half of any pass.
const PASS_MARGIN_S: f64 = 1200.0;

/// Finds start windows by the roots of the visibility function.
///
/// A ground point P is visible while the central angle between it and the satellite is below λ, that is while
/// g(t) = r̂(t)·P̂(t) > cos λ. Over a revolution g has one maximum, near the point where the satellite passes P; Newton
/// steps find it and the two crossings of cos λ around it. A strip's window is the intersection of its points'
/// visibilities, each shifted by the time at which the target is there.
#[derive(Clone, Debug)]
pub struct WindowFinder {
    node_N: Vector3<f64>,
    ahead_N: Vector3<f64>,
    argument_at_epoch: f64,
    mean_motion: f64,
    earth_at_epoch: f64,
    earth_rate: f64,
    cos_limit: f64,
    /// Earth's radius over the orbit's.
    ratio: f64,
    period: TickPeriod,
}

/// A pass of the satellite over a ground point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pass {
    /// When the point's limit is crossed coming [s since the epoch].
    pub rise_s: f64,
    /// When it is crossed going [s since the epoch].
    pub set_s: f64,
    /// Cosine of the least central angle.
    pub cos_greatest: f64,
}

/// g and its first two derivatives in time.
struct Visibility {
    g: f64,
    g_dot: f64,
    g_ddot: f64,
}

impl WindowFinder {
    /// A finder for an orbit and the elevation limit of a configuration.
    #[must_use]
    pub fn new(config: &SimConfig, orbit: &Orbit, period: TickPeriod) -> Self {
        let elevation = config.imaging.elevation_min_deg.to_radians();
        let ratio = config.earth.radius_m / orbit.radius;
        let limit = libm::acos(ratio * libm::cos(elevation)) - elevation;
        Self::with_limit(config, orbit, period, libm::cos(limit))
    }

    /// A finder of passes up to a central angle between a ground point and the satellite, given as its cosine.
    #[must_use]
    pub(crate) fn with_limit(config: &SimConfig, orbit: &Orbit, period: TickPeriod, cos_limit: f64) -> Self {
        let ratio = config.earth.radius_m / orbit.radius;
        Self {
            node_N: orbit.node_N,
            ahead_N: orbit.ahead_N,
            argument_at_epoch: orbit.argument.angle_at(0.0, period),
            mean_motion: orbit.mean_motion,
            earth_at_epoch: config.earth.angle_at_epoch_deg.to_radians(),
            earth_rate: config.earth.rotation_rad_s,
            cos_limit,
            ratio,
            period,
        }
    }

    /// Start windows of a strip that close after `from` and open before `to`, in order, appended to `windows`.
    pub fn find(&self, strip: &Strip, from: Tick, to: Tick, windows: &mut Vec<Window>) {
        let duration = self.period.duration_s(strip.acquisition_ticks(self.period));
        let (from_s, to_s) = (self.period.time_s(from), self.period.time_s(to));
        let revolution = std::f64::consts::TAU / self.mean_motion;
        let mut culmination = self.nearest_culmination(&strip.start_E, from_s - PASS_MARGIN_S);
        while culmination < to_s + PASS_MARGIN_S {
            if let Some((open_s, close_s)) = self.window_around(strip, duration, culmination) {
                let window = self.to_ticks(open_s, close_s);
                if window.open <= window.close && window.close > from && window.open < to {
                    windows.push(window);
                }
            }
            culmination = self.nearest_culmination(&strip.start_E, culmination + revolution);
        }
    }

    /// Passes over a ground point that end after `from_s` and begin before `to_s` [s], in order.
    pub(crate) fn passes(&self, point_E: &Vector3<f64>, from_s: f64, to_s: f64, mut each: impl FnMut(Pass)) {
        let revolution = std::f64::consts::TAU / self.mean_motion;
        let mut culmination = self.nearest_culmination(point_E, from_s - PASS_MARGIN_S);
        while culmination < to_s + PASS_MARGIN_S {
            if let Some(pass) = self.pass(point_E, culmination)
                && pass.set_s > from_s
                && pass.rise_s < to_s
            {
                each(pass);
            }
            culmination = self.nearest_culmination(point_E, culmination + revolution);
        }
    }

    /// Least elevation of the satellite seen from the target while a strip is imaged from `start` on [rad].
    #[must_use]
    pub fn least_elevation(&self, strip: &Strip, start: Tick) -> f64 {
        let (from_s, duration) = (self.period.time_s(start), strip.acquisition_time_s());
        let steps = (duration / ELEVATION_SPACING_S).ceil().max(1.0) as u32;
        let elevation = |step: u32| {
            let elapsed = duration * f64::from(step) / f64::from(steps);
            let cos = self.visibility(&strip.target_E(elapsed).0, from_s + elapsed).g.clamp(-1.0, 1.0);
            libm::atan2(cos - self.ratio, (1.0 - cos * cos).sqrt())
        };
        (0..=steps).map(elevation).fold(f64::INFINITY, f64::min)
    }

    fn to_ticks(&self, open_s: f64, close_s: f64) -> Window {
        let dt = self.period.seconds();
        let open = ((open_s + ROOT_MARGIN_S) / dt).ceil().max(0.0);
        let close = ((close_s - ROOT_MARGIN_S) / dt).floor();
        // A window that closed before the epoch becomes an empty one.
        if close < 0.0 {
            return Window { open: Tick(1), close: Tick(0) };
        }
        Window { open: Tick(open as u64), close: Tick(close as u64) }
    }

    /// Times [s] between which imaging can start in the pass that culminates over the strip's start near `culmination`.
    fn window_around(&self, strip: &Strip, duration: f64, culmination: f64) -> Option<(f64, f64)> {
        let Pass { rise_s: mut open, set_s: mut close, .. } = self.pass(&strip.start_E, culmination)?;
        let pieces = (duration / CHECKPOINT_SPACING_S).ceil() as u32;
        for piece in 1..=pieces {
            let elapsed = (f64::from(piece) * CHECKPOINT_SPACING_S).min(duration);
            let pass = self.pass(&strip.target_E(elapsed).0, culmination)?;
            open = open.max(pass.rise_s - elapsed);
            close = close.min(pass.set_s - elapsed);
            if open > close {
                return None;
            }
        }
        (open <= close).then_some((open, close))
    }

    /// The satellite's pass over a point that culminates near `guess` [s].
    fn pass(&self, point_E: &Vector3<f64>, guess: f64) -> Option<Pass> {
        let mut t = guess;
        let mut at = self.visibility(point_E, t);
        for _ in 0..6 {
            // Near a culmination g'' ≈ -n²·g < 0; elsewhere the point is out of sight in this revolution.
            if at.g_ddot >= 0.0 {
                return None;
            }
            let step = at.g_dot / at.g_ddot;
            t -= step;
            at = self.visibility(point_E, t);
            if step.abs() < 1e-3 {
                break;
            }
        }
        if at.g <= self.cos_limit {
            return None;
        }
        // g ≈ g_max·cos(w·(t-t_max)) with w² = -g''/g.
        let rate = (-at.g_ddot / at.g).sqrt();
        let half = libm::acos(self.cos_limit / at.g) / rate;
        let (rise_s, set_s) = (self.crossing(point_E, t - half), self.crossing(point_E, t + half));
        Some(Pass { rise_s, set_s, cos_greatest: at.g })
    }

    /// Root of g - cos λ near `guess`, by Newton's method.
    fn crossing(&self, point_E: &Vector3<f64>, guess: f64) -> f64 {
        let mut t = guess;
        for _ in 0..8 {
            let at = self.visibility(point_E, t);
            let step = (at.g - self.cos_limit) / at.g_dot;
            if !step.is_finite() {
                break;
            }
            t -= step.clamp(-60.0, 60.0);
            if step.abs() < 1e-7 {
                break;
            }
        }
        t
    }

    #[inline]
    fn visibility(&self, point_E: &Vector3<f64>, t: f64) -> Visibility {
        let (n, w) = (self.mean_motion, self.earth_rate);
        let (su, cu) = libm::sincos(self.argument_at_epoch + n * t);
        let (a, b, a_dot, b_dot, a_ddot, b_ddot) = self.in_orbit_plane(point_E, t);
        let g = cu * a + su * b;
        let across = cu * b - su * a;
        let across_dot = cu * b_dot - su * a_dot;
        Visibility {
            g,
            g_dot: n * across + w * (cu * a_dot + su * b_dot),
            g_ddot: -n * n * g + 2.0 * n * w * across_dot + w * w * (cu * a_ddot + su * b_ddot),
        }
    }

    /// Components of a turning ground point along the node and ahead of it, and their first two derivatives with
    /// respect to the Earth's angle.
    #[inline]
    fn in_orbit_plane(&self, point_E: &Vector3<f64>, t: f64) -> (f64, f64, f64, f64, f64, f64) {
        let (s, c) = libm::sincos(self.earth_at_epoch + self.earth_rate * t);
        let (x, y) = (c * point_E.x - s * point_E.y, s * point_E.x + c * point_E.y);
        let (node, ahead) = (&self.node_N, &self.ahead_N);
        let (a_xy, b_xy) = (node.x * x + node.y * y, ahead.x * x + ahead.y * y);
        (
            a_xy + node.z * point_E.z,
            b_xy + ahead.z * point_E.z,
            node.y * x - node.x * y,
            ahead.y * x - ahead.x * y,
            -a_xy,
            -b_xy,
        )
    }

    /// Time near `guess` at which the satellite is closest to a point in argument of latitude [s].
    fn nearest_culmination(&self, point_E: &Vector3<f64>, guess: f64) -> f64 {
        use std::f64::consts::{PI, TAU};
        let mut t = guess;
        for _ in 0..2 {
            let (a, b, ..) = self.in_orbit_plane(point_E, t);
            let behind = libm::atan2(b, a) - (self.argument_at_epoch + self.mean_motion * t);
            let turns = ((behind + PI) / TAU).floor();
            t += (behind - turns * TAU) / self.mean_motion;
        }
        t
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::requests::scenario::ScenarioConfig;
    use crate::rng;
    use crate::vehicle::model::Model;
    use crate::world::frames::{earth_to_inertial, sin_elevation};
    use crate::world::orbit::OrbitPhase;

    /// Windows by looking at every tick: slow, and independent of the roots.
    fn by_every_tick(model: &Model, orbit: &mut Orbit, strip: &Strip, ticks: u64) -> Vec<Window> {
        let t_acq = strip.acquisition_ticks(model.period);
        let mut earth = model.earth.clone();
        let sin_min = libm::sin(model.config.imaging.elevation_min_deg.to_radians());
        let mut visible = |start: u64, j: u32| {
            let tick = Tick(start + u64::from(j));
            let target_E = strip.target_E(model.period.duration_s(j)).0 * model.config.earth.radius_m;
            let target_N = earth_to_inertial(earth.cos_sin(tick), &target_E);
            sin_elevation(&orbit.position(tick), &target_N) > sin_min
        };
        let mut windows: Vec<Window> = Vec::new();
        for start in 0..ticks {
            if visible(start, 0) && (1..=t_acq).all(|j| visible(start, j)) {
                match windows.last_mut() {
                    Some(last) if last.close.0 + 1 == start => last.close = Tick(start),
                    _ => windows.push(Window { open: Tick(start), close: Tick(start) }),
                }
            }
        }
        windows
    }

    #[test]
    fn windows_are_those_found_by_looking_at_every_tick() {
        let model = Model::new(SimConfig::default()).unwrap();
        let requests =
            ScenarioConfig::default().generate(&mut rng::stream(5, rng::CATALOGUE), 60, model.config.earth.radius_m);
        let ticks = 43_200;
        let mut found = 0;
        for (i, request) in requests.iter().enumerate() {
            let phase =
                OrbitPhase { raan_deg: 37.0 * i as f64 % 360.0, argument_of_latitude_deg: 91.0 * i as f64 % 360.0 };
            let mut orbit = Orbit::new(&model.config, phase, model.period);
            let strip = request.to_strip(&model.config.requests, model.config.earth.radius_m).unwrap();
            let mut windows = Vec::new();
            WindowFinder::new(&model.config, &orbit, model.period).find(&strip, Tick(0), Tick(ticks), &mut windows);
            for window in &mut windows {
                window.close = window.close.min(Tick(ticks - 1));
            }
            assert_eq!(windows, by_every_tick(&model, &mut orbit, &strip, ticks), "strip {i}");
            found += windows.len();
        }
        assert!(found > 40, "only {found} windows");
    }

    #[test]
    fn the_least_elevation_is_the_limit_at_a_windows_edge_and_more_within() {
        let model = Model::new(SimConfig::default()).unwrap();
        let orbit =
            Orbit::new(&model.config, OrbitPhase { raan_deg: 0.0, argument_of_latitude_deg: 0.0 }, model.period);
        let finder = WindowFinder::new(&model.config, &orbit, model.period);
        let requests =
            ScenarioConfig::default().generate(&mut rng::stream(5, rng::CATALOGUE), 40, model.config.earth.radius_m);
        let mut looked_at = 0;
        for request in &requests {
            let strip = request.to_strip(&model.config.requests, model.config.earth.radius_m).unwrap();
            let mut windows = Vec::new();
            finder.find(&strip, Tick(0), Tick(86_400), &mut windows);
            for window in windows.iter().filter(|window| window.open.0 > 0 && window.close.since(window.open) > 100) {
                let edge = finder.least_elevation(&strip, window.open).to_degrees();
                assert!((10.0..10.1).contains(&edge), "{edge}");
                let middle = Tick((window.open.0 + window.close.0) / 2);
                assert!(finder.least_elevation(&strip, middle).to_degrees() > edge + 0.1);
                looked_at += 1;
            }
        }
        assert!(looked_at > 20, "only {looked_at} windows");
    }
}
