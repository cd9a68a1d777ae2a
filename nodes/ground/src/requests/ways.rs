//! The ways of requests over the radio, and how the radio stands, as messages.

use swath_mission::file::Mission;
use swath_mission::link::ground::{Ground, WayLine};
use swath_mission::link::message::{CHANGES, ORDERS};
use swath_mission::link::passes::{Pass, passes};
use swath_mission::requests::query::page_length;
use swath_mission::time_text;
use swath_msgs::swath_msgs as msg;
use swath_node::stamp::{EARTH_FRAME, Stamper};
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::StripId;

use super::book::Book;
use super::foresight::{Foreseen, Foresight};

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
    let foreseen = end.foresight().and_then(Foresight::newest);
    let predicted = |line: &WayLine| {
        let at = usize::try_from(line.strip).ok()?.checked_sub(1)?;
        foreseen?.prediction.ways.get(at)
    };
    let ways = lines.by_ref().take(limit).map(|line| way(stamper, &line, predicted(&line))).collect::<Vec<_>>();
    msg::ListWaysResponse { ways, more: lines.next().is_some(), ..Default::default() }
}

fn way(stamper: &Stamper, line: &WayLine, predicted: Option<&WayLine>) -> msg::StripWay {
    let step = |(name, tick): (&str, Option<Tick>)| {
        let tick = tick?;
        Some(msg::WayStep { name: name.to_owned(), tick: tick.0, time: stamper.time(tick) })
    };
    let done = steps(line);
    let to_come = predicted.map(steps).into_iter().flatten().zip(done).filter(|(_, done)| done.1.is_none());
    msg::StripWay {
        strip_id: line.strip,
        steps: done.into_iter().filter_map(step).collect::<Vec<_>>(),
        predicted: to_come.filter_map(|(predicted, _)| step(predicted)).collect::<Vec<_>>(),
    }
}

fn steps(line: &WayLine) -> [(&'static str, Option<Tick>); 7] {
    [
        ("queued", Some(line.queued_tick)),
        ("uplinked", line.uplinked_tick),
        ("on_board", line.on_board_tick),
        ("acknowledged", line.acknowledged_tick),
        ("imaged", line.imaged_tick),
        ("known", line.known_tick),
        ("delivered", line.delivered_tick),
    ]
}

/// What the satellite is going to do, as the ground predicts it.
pub(super) fn plan(stamper: &Stamper, foreseen: &Foreseen) -> msg::PredictedPlan {
    let Foreseen { prediction, score } = foreseen;
    let known = |id: StripId| prediction.ways.get(id.index()?)?.known_tick;
    let time = |tick: Tick| time_text::format(stamper.nanoseconds(tick));
    let task = |record: &TaskRecord| {
        let (id, imaging) = (record.strip?, record.start.after(record.t_pre));
        let known = known(id).filter(|_| record.success());
        Some(msg::PredictedTask {
            task: record.task,
            strip_id: id.0,
            start_tick: record.start.0,
            imaging_tick: imaging.0,
            imaging: stamper.time(imaging),
            end_tick: record.end.0,
            success: record.success(),
            known_tick: known.map_or(0, |tick| tick.0),
            known: known.map(|tick| stamper.time(tick)).unwrap_or_default(),
        })
    };
    let parted = score.partings.last();
    msg::PredictedPlan {
        header: stamper.header(prediction.at, EARTH_FRAME),
        tick: prediction.at.0,
        since_tick: prediction.since.0,
        until_tick: prediction.until.0,
        tasks: prediction.tasks.iter().filter_map(task).collect::<Vec<_>>(),
        compared: score.tasks,
        equal: score.equal,
        imaged: score.imaged,
        foretold: score.foretold,
        partings: score.partings.len() as u64,
        parted_task: parted.map_or(0, |it| it.task),
        parted_tick: parted.map_or(0, |it| it.at.0),
        parted_reason: parted.map(|it| it.text(time)).unwrap_or_default(),
    }
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
