//! What is told of the radio, of the ground's plan and of resources, made from their messages.

use serde::Serialize;
use swath_msgs::swath_msgs as msg;
use utoipa::ToSchema;

use crate::ticks::milliseconds;

/// Tasks of one plan that are told, the next first: a day of them.
pub const PLANNED: usize = 1000;

/// The radio, as the ground knows it.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[schema(as = RadioLink)]
pub struct Link {
    /// Whether the ground can send.
    pub open: bool,
    /// Orders that are not known to be on board.
    pub waiting_orders: u64,
    /// Changes of requests that are not known to be on board.
    pub waiting_changes: u64,
    /// Requests that are known to be on board.
    pub on_board: u64,
    /// Requests that are known to be imaged.
    pub imaged: u64,
    /// Images that are on the ground as a whole.
    pub delivered: u64,
    /// Frames that were sent.
    pub frames_sent: u64,
    /// Frames that were heard whole.
    pub frames_heard: u64,
    /// Frames that were heard damaged.
    pub frames_damaged: u64,
    /// Tick on board that housekeeping tells of; none while none has come down.
    pub housekeeping: Option<u64>,
    /// Number of the task then.
    pub housekeeping_task: u64,
    /// Strips on board that were to be imaged then.
    pub housekeeping_pending: u64,
    /// Strips that were imaged by then.
    pub housekeeping_imaged: u64,
    /// Passes that are under way or to come, the next first.
    pub passes: Vec<Pass>,
}

/// A pass of the satellite over a station.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[schema(as = RadioPass)]
pub struct Pass {
    /// Name of the station.
    pub station: String,
    /// When the station hears the satellite first [ms].
    pub rise_ms: f64,
    /// When it hears it no more [ms].
    pub set_ms: f64,
    /// Greatest elevation [deg].
    pub elevation_deg: f64,
}

/// What the satellite is going to do, as the ground predicts it, and how far what came down was as predicted.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[schema(as = PredictedPlan)]
pub struct Plan {
    /// Tick of the housekeeping that it rests on; 0 for the mission's start.
    pub since: u64,
    /// Tick up to which it goes.
    pub until: u64,
    /// Imaging tasks, in order.
    pub tasks: Vec<Planned>,
    /// Tasks of which there is no room to tell.
    pub left_out: u64,
    /// Imaging tasks that came to be known.
    pub compared: u64,
    /// Of those, tasks that were exactly as predicted.
    pub equal: u64,
    /// Strips that came to be known as imaged.
    pub imaged: u64,
    /// Of those, strips that were predicted to be, within two minutes.
    pub foretold: u64,
    /// How often flight and plan have parted.
    pub partings: u64,
    /// First imaging task that was not as predicted when they parted last, 0 if they never did.
    pub parted_task: u64,
    /// Its first tick.
    pub parted: u64,
    /// Why, in words.
    pub parted_reason: String,
}

/// An imaging task that is predicted.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[schema(as = PredictedTask)]
pub struct Planned {
    /// Its number.
    pub task: u64,
    /// The strip.
    pub strip: u64,
    /// First tick of the transition.
    pub start: u64,
    /// Tick at which imaging begins.
    pub imaging: u64,
    /// Tick at which it ends.
    pub end: u64,
    /// Whether the strip is imaged.
    pub success: bool,
    /// Tick at which the ground will know that, 0 for later than the plan goes.
    pub known: u64,
}

/// Power, data and momentum as the simulator has them.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct Resources {
    /// Charge of the battery over its capacity.
    pub battery: f64,
    /// Share of the Sun's disc that is seen.
    pub illumination: f64,
    /// Power of the solar array [W].
    pub generated_w: f64,
    /// Power of all loads [W].
    pub load_w: f64,
    /// Bits stored over the bits that there is room for.
    pub storage: f64,
    /// Bits that wait to be sent.
    pub to_send_bits: u64,
    /// Whether a station hears the satellite.
    pub in_contact: bool,
    /// Momentum of the wheel that has most [N m s].
    pub momentum_nms: f64,
    /// The same over its limit; none where nobody has said what that is.
    pub momentum: Option<f64>,
    /// What has failed and is not mended: `none`, `battery_empty` or `wheel_momentum`.
    pub safe_mode: &'static str,
}

/// The radio, as the ground knows it; passes without an elevation have no form in JSON.
#[must_use]
pub fn link(status: &msg::LinkStatus) -> Link {
    let pass = |pass: &msg::RadioPass| Pass {
        station: pass.station.clone(),
        rise_ms: milliseconds(&pass.rise),
        set_ms: milliseconds(&pass.set),
        elevation_deg: pass.elevation.to_degrees(),
    };
    Link {
        open: status.open,
        waiting_orders: status.waiting_orders,
        waiting_changes: status.waiting_changes,
        on_board: status.on_board,
        imaged: status.imaged,
        delivered: status.delivered,
        frames_sent: status.frames_sent,
        frames_heard: status.frames_heard,
        frames_damaged: status.frames_damaged,
        housekeeping: status.has_housekeeping.then_some(status.housekeeping_tick),
        housekeeping_task: status.housekeeping_task,
        housekeeping_pending: status.housekeeping_pending,
        housekeeping_imaged: status.housekeeping_imaged,
        passes: status.passes.iter().filter(|pass| pass.elevation.is_finite()).map(pass).collect(),
    }
}

/// What the satellite is going to do, as the ground predicts it.
#[must_use]
pub fn plan(plan: &msg::PredictedPlan) -> Plan {
    let planned = |task: &msg::PredictedTask| Planned {
        task: task.task,
        strip: task.strip_id,
        start: task.start_tick,
        imaging: task.imaging_tick,
        end: task.end_tick,
        success: task.success,
        known: task.known_tick,
    };
    Plan {
        since: plan.since_tick,
        until: plan.until_tick,
        tasks: plan.tasks.iter().take(PLANNED).map(planned).collect(),
        left_out: plan.tasks.len().saturating_sub(PLANNED) as u64,
        compared: plan.compared,
        equal: plan.equal,
        imaged: plan.imaged,
        foretold: plan.foretold,
        partings: plan.partings,
        parted_task: plan.parted_task,
        parted: plan.parted_tick,
        parted_reason: plan.parted_reason.clone(),
    }
}

/// Power, data and momentum, with the limit of momentum where it is known [N m s]; none where something is no number.
#[must_use]
pub fn resources(state: &msg::ResourceState, momentum_max_nms: Option<f64>) -> Option<Resources> {
    let battery = state.charge / state.capacity;
    let numbers = [battery, state.illumination, state.generated_power, state.load_power, state.wheel_momentum];
    let storage = if state.storage_bits > 0 { state.stored_bits as f64 / state.storage_bits as f64 } else { 0.0 };
    numbers.iter().all(|number| number.is_finite()).then(|| Resources {
        battery,
        illumination: state.illumination,
        generated_w: state.generated_power,
        load_w: state.load_power,
        storage,
        to_send_bits: state.to_send_bits,
        in_contact: state.in_contact,
        momentum_nms: state.wheel_momentum,
        momentum: momentum_max_nms.map(|limit| state.wheel_momentum / limit),
        safe_mode: match state.safe_mode {
            msg::ResourceState::SAFE_MODE_BATTERY_EMPTY => "battery_empty",
            msg::ResourceState::SAFE_MODE_WHEEL_MOMENTUM => "wheel_momentum",
            _ => "none",
        },
    })
}
