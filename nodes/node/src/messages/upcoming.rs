//! The strips to choose among, as whoever keeps the requests offers them.

use swath_mission::orders::order::Order;
use swath_mission::requests::logic::Offer;
use swath_msgs::swath_msgs as msg;
use swath_sim::requests::catalogue::Candidate;

use crate::orders::strip;
use crate::stamp::{EARTH_FRAME, Stamper};

/// What the planner is offered; `request` gives what was asked for under an identity.
#[must_use]
pub fn upcoming_strips<'a>(
    stamper: &Stamper,
    offer: &Offer,
    request: impl Fn(&Candidate) -> Option<&'a Order>,
) -> msg::UpcomingStrips {
    let candidates = offer.candidates.iter().filter_map(|candidate| {
        Some(msg::Candidate {
            strip: strip(candidate.id.0, request(candidate)?),
            window_open_tick: candidate.window.open.0,
            window_close_tick: candidate.window.close.0,
            t_acq_ticks: candidate.t_acq,
            twin: candidate.twin.map_or(0, |id| id.0),
        })
    });
    msg::UpcomingStrips {
        header: stamper.header(offer.tick, EARTH_FRAME),
        tick: offer.tick.0,
        task: offer.task,
        candidates: candidates.collect::<Vec<_>>(),
        pending: offer.pending as u64,
        fulfilled: offer.fulfilled as u64,
    }
}
