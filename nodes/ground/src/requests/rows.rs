//! Rows of the store: orders, requests, changes and attempts as columns.

use rusqlite::{Connection, Row, params};
use swath_sim::task::FailureReason;
use swath_sim::time::Tick;
use swath_sim::world::strip::{StripId, StripRequest};
use swath_sim::world::windows::Window;

use swath_mission::orders::order::{Order, Part};
use swath_mission::requests::journal::{Added, Attempt, Change, Outcome, Progress, Standing};
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::reason_number::Reason;
use swath_mission::requests::request::{Request, Stored};

/// Outcomes in the store: 0 for a success, 1 for cancelled, else the reason code of the failure.
pub(super) fn outcome_code(outcome: Outcome) -> u16 {
    match outcome {
        Outcome::Succeeded => 0,
        Outcome::Cancelled => 1,
        Outcome::Failed(failure) => Reason::from(failure).number(),
    }
}

pub(super) fn outcome(code: u16) -> Outcome {
    match code {
        0 => Outcome::Succeeded,
        1 => Outcome::Cancelled,
        _ => {
            let failure = Reason::from_number(code).and_then(Reason::failure);
            Outcome::Failed(failure.unwrap_or(FailureReason::Interrupted))
        }
    }
}

pub(super) fn tick(row: &Row<'_>, column: usize) -> rusqlite::Result<Tick> {
    Ok(Tick(row.get::<_, i64>(column)?.cast_unsigned()))
}

pub(super) fn number(id: Option<StripId>) -> Option<i64> {
    id.map(|id| id.0.cast_signed())
}

pub(super) fn insert_request(connection: &Connection, added: &Added) -> rusqlite::Result<()> {
    let insert = "INSERT INTO requests (id, client_ref, submitter, name, start_latitude, start_longitude, end_latitude,
            end_longitude, priority, speed, bidirectional, valid_from, valid_until, hold, max_attempts, created, linked,
            supersedes, windows, order_id, order_ref, part, parts, share, state, reason_code, reason, actor, changed)
        VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, ?19, ?20, ?21, ?22,
            ?23, ?24, 0, 0, '', '', 0)";
    let order = &added.order;
    let part = order.part.as_ref();
    let request = &order.request;
    connection.prepare_cached(insert)?.execute(params![
        added.id.0.cast_signed(),
        order.client_ref,
        order.submitter,
        order.name,
        request.start_latitude_deg,
        request.start_longitude_deg,
        request.end_latitude_deg,
        request.end_longitude_deg,
        request.priority,
        request.acquisition_speed_m_s,
        request.bidirectional,
        order.valid_from_ns.cast_signed(),
        order.valid_until_ns.cast_signed(),
        order.hold_for_approval,
        order.max_attempts,
        added.tick.0.cast_signed(),
        number(added.linked),
        number(added.supersedes),
        windows_to_bytes(&added.windows),
        added.order_id.0.cast_signed(),
        part.map_or("", |part| &part.order_ref),
        part.map_or(0, |part| part.number),
        part.map_or(0, |part| part.of),
        part.map_or(0.0, |part| part.share),
    ])?;
    Ok(())
}

pub(super) fn insert_change(connection: &Connection, change: &Change) -> rusqlite::Result<()> {
    let insert = "INSERT INTO changes (request, tick, state, reason_code, reason, actor, refused_ref, refused_name)
        VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)";
    let refused = change.refused.as_ref();
    connection.prepare_cached(insert)?.execute(params![
        change.id.0.cast_signed(),
        change.tick.0.cast_signed(),
        change.state.number(),
        change.reason.0.number(),
        change.reason.1,
        change.actor,
        refused.map(|order| &order.client_ref),
        refused.map(|order| &order.name),
    ])?;
    if change.id.0 == 0 {
        return Ok(());
    }
    let update =
        "UPDATE requests SET state = ?2, reason_code = ?3, reason = ?4, actor = ?5, changed = ?6, attempts = ?7,
            counted = ?8, reward = ?9, imaging = ?10, superseded_by = ?11 WHERE id = ?1";
    let standing = &change.standing;
    connection.prepare_cached(update)?.execute(params![
        change.id.0.cast_signed(),
        change.state.number(),
        change.reason.0.number(),
        change.reason.1,
        change.actor,
        change.tick.0.cast_signed(),
        standing.attempts,
        standing.counted,
        standing.reward,
        standing.imaging.0.cast_signed(),
        number(standing.superseded_by),
    ])?;
    Ok(())
}

pub(super) fn insert_attempt(connection: &Connection, attempt: &Attempt) -> rusqlite::Result<()> {
    let insert = "INSERT INTO attempts (task, request, start, finish, t_pre, t_acq, outcome, max_attitude_error,
        min_elevation, reward) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)";
    connection.prepare_cached(insert)?.execute(params![
        attempt.task.cast_signed(),
        attempt.id.0.cast_signed(),
        attempt.start.0.cast_signed(),
        attempt.end.0.cast_signed(),
        attempt.t_pre,
        attempt.t_acq,
        outcome_code(attempt.outcome),
        attempt.max_attitude_error,
        attempt.min_elevation,
        attempt.reward,
    ])?;
    Ok(())
}

pub(super) fn write_progress(connection: &Connection, progress: &Progress) -> rusqlite::Result<()> {
    let replace = "INSERT OR REPLACE INTO progress (one, now, settled, task, request, start, t_pre, t_acq)
        VALUES (1, ?1, ?2, ?3, ?4, ?5, ?6, ?7)";
    let flown = progress.in_flight;
    connection.prepare_cached(replace)?.execute(params![
        progress.now.0.cast_signed(),
        progress.settled.cast_signed(),
        flown.map(|flown| flown.task.cast_signed()),
        flown.map(|flown| flown.id.0.cast_signed()),
        flown.map(|flown| flown.start.0.cast_signed()),
        flown.map(|flown| flown.t_pre),
        flown.map(|flown| flown.t_acq),
    ])?;
    Ok(())
}

/// A request of a row of all columns, in the order of the schema; `None` when a value makes no sense.
pub(super) fn read_request(row: &Row<'_>) -> rusqlite::Result<(u64, Option<Stored>)> {
    let id = row.get::<_, i64>("id")?.cast_unsigned();
    let link = |column: &str| {
        Ok::<_, rusqlite::Error>(row.get::<_, Option<i64>>(column)?.map(|id| StripId(id.cast_unsigned())))
    };
    let at = |column: &str| Ok::<_, rusqlite::Error>(Tick(row.get::<_, i64>(column)?.cast_unsigned()));
    let order = Order {
        client_ref: row.get("client_ref")?,
        submitter: row.get("submitter")?,
        name: row.get("name")?,
        request: StripRequest {
            start_latitude_deg: row.get("start_latitude")?,
            start_longitude_deg: row.get("start_longitude")?,
            end_latitude_deg: row.get("end_latitude")?,
            end_longitude_deg: row.get("end_longitude")?,
            priority: row.get("priority")?,
            acquisition_speed_m_s: row.get("speed")?,
            bidirectional: row.get("bidirectional")?,
        },
        valid_from_ns: row.get::<_, i64>("valid_from")?.cast_unsigned(),
        valid_until_ns: row.get::<_, i64>("valid_until")?.cast_unsigned(),
        hold_for_approval: row.get("hold")?,
        max_attempts: row.get("max_attempts")?,
        part: read_part(row)?,
    };
    let standing = Standing {
        attempts: row.get("attempts")?,
        counted: row.get("counted")?,
        reward: row.get("reward")?,
        imaging: at("imaging")?,
        superseded_by: link("superseded_by")?,
    };
    let state = State::from_number(row.get("state")?);
    let windows = windows_from_bytes(row.get_ref("windows")?.as_blob().unwrap_or_default());
    let reason = Reason::from_number(row.get("reason_code")?);
    let (Some(state), Some(windows), Some(reason)) = (state, windows, reason) else { return Ok((id, None)) };
    let request = Request {
        order,
        state,
        reason: (reason, row.get("reason")?),
        actor: row.get("actor")?,
        created: at("created")?,
        changed: at("changed")?,
        standing,
        supersedes: link("supersedes")?,
        order_id: StripId(row.get::<_, i64>("order_id")?.cast_unsigned()),
    };
    Ok((id, Some(Stored { request, windows, linked: link("linked")? })))
}

fn read_part(row: &Row<'_>) -> rusqlite::Result<Option<Part>> {
    let (order_ref, number): (String, u32) = (row.get("order_ref")?, row.get("part")?);
    if number == 0 {
        return Ok(None);
    }
    Ok(Some(Part { order_ref, number, of: row.get("parts")?, share: row.get("share")? }))
}

pub(super) fn windows_to_bytes(windows: &[Window]) -> Vec<u8> {
    windows.iter().flat_map(|window| [window.open.0.to_le_bytes(), window.close.0.to_le_bytes()]).flatten().collect()
}

pub(super) fn windows_from_bytes(bytes: &[u8]) -> Option<Vec<Window>> {
    let (pairs, rest) = bytes.as_chunks::<16>();
    let number = |half: &[u8]| half.try_into().ok().map(u64::from_le_bytes).map(Tick);
    let windows = pairs.iter().map(|pair| Some(Window { open: number(&pair[..8])?, close: number(&pair[8..])? }));
    let windows = windows.collect::<Option<Vec<_>>>()?;
    let ordered = windows.iter().all(|window| window.open <= window.close);
    (rest.is_empty() && ordered).then_some(windows)
}
