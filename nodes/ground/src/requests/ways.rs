//! The ways of requests over the radio, and how the radio stands, as messages.

use swath_mission::file::Mission;
use swath_mission::link::ground::{Ground, WayLine};
use swath_mission::link::message::{CHANGES, ORDERS};
use swath_mission::link::passes::{Pass, passes};
use swath_mission::requests::query::page_length;
use swath_msgs::swath_msgs as msg;
use swath_node::stamp::{EARTH_FRAME, Stamper};
use swath_sim::time::Tick;
use swath_sim::vehicle::model::Model;

use super::book::Book;

/// Passes that are told ahead.
const AHEAD: usize = 16;

/// A page of ways; none where there is no radio.
pub(super) fn list(book: &Book, stamper: &Stamper, call: &msg::ListWaysRequest) -> msg::ListWaysResponse {
    let limit = match page_length(call.limit) {
        Ok(limit) => limit,
        Err(refusal) => {
            let (reason_code, reason) = (refusal.code(), refusal.to_string());
            return msg::ListWaysResponse { reason_code, reason, ..Default::default() };
        }
    };
    let Book::Ground(end) = book else { return msg::ListWaysResponse::default() };
    let mut lines = end.ground().lines().skip(usize::try_from(call.after_id).unwrap_or(usize::MAX));
    let ways = lines.by_ref().take(limit).map(|line| way(stamper, &line)).collect::<Vec<_>>();
    msg::ListWaysResponse { ways, more: lines.next().is_some(), ..Default::default() }
}

fn way(stamper: &Stamper, line: &WayLine) -> msg::StripWay {
    let steps = [
        ("queued", Some(line.queued_tick)),
        ("uplinked", line.uplinked_tick),
        ("on_board", line.on_board_tick),
        ("acknowledged", line.acknowledged_tick),
        ("imaged", line.imaged_tick),
        ("known", line.known_tick),
        ("delivered", line.delivered_tick),
    ];
    let step = |(name, tick): (&str, Option<Tick>)| {
        let tick = tick?;
        Some(msg::WayStep { name: name.to_owned(), tick: tick.0, time: stamper.time(tick) })
    };
    msg::StripWay { strip_id: line.strip, steps: steps.into_iter().filter_map(step).collect::<Vec<_>>() }
}

/// The passes of a mission over its stations; none where the radio does not wait for them.
pub(super) fn all_passes(mission: &Mission, model: &Model) -> Vec<Pass> {
    let stations = mission.link.as_ref().and_then(|link| link.all_stations().ok()).unwrap_or_default();
    passes(&stations, model, &mission.orbit(model), (Tick(0), mission.horizon(model)))
}

/// How the radio stands at a tick, as the ground knows it; `open` is whether it can send.
pub(super) fn status(ground: &Ground, stamper: &Stamper, tick: Tick, open: bool, passes: &[Pass]) -> msg::LinkStatus {
    let (waiting, counts, housekeeping) = (ground.waiting_by_class(), ground.counts(), ground.housekeeping());
    let count = |step: fn(&WayLine) -> Option<Tick>| ground.lines().filter(|line| step(line).is_some()).count() as u64;
    let pass = |pass: &Pass| msg::RadioPass {
        station: pass.station.clone(),
        rise_tick: pass.rise_tick.0,
        set_tick: pass.set_tick.0,
        rise: stamper.time(pass.rise_tick),
        set: stamper.time(pass.set_tick),
        elevation: pass.elevation_max_deg.to_radians(),
    };
    msg::LinkStatus {
        header: stamper.header(tick, EARTH_FRAME),
        tick: tick.0,
        open,
        waiting_changes: waiting[CHANGES],
        waiting_orders: waiting[ORDERS],
        on_board: count(|line| line.acknowledged_tick),
        imaged: count(|line| line.known_tick),
        delivered: count(|line| line.delivered_tick),
        frames_sent: counts.sent,
        frames_heard: counts.heard,
        frames_damaged: counts.damaged,
        has_housekeeping: housekeeping.is_some(),
        housekeeping_tick: housekeeping.map_or(0, |it| it.at.0),
        housekeeping_task: housekeeping.map_or(0, |it| it.task),
        housekeeping_pending: housekeeping.map_or(0, |it| it.pending),
        housekeeping_imaged: housekeeping.map_or(0, |it| it.imaged),
        passes: passes.iter().filter(|it| it.set_tick > tick).take(AHEAD).map(pass).collect::<Vec<_>>(),
    }
}
