//! Strips that are flown, from their messages.

use swath_msgs::swath_msgs as msg;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::Strip;

use crate::error::MessageError;
use crate::orders::request_of_strip;

/// The strip of a message, whose acquisition takes `given` ticks.
///
/// # Errors
/// When the strip cannot be flown or takes another time.
pub fn acquisition(model: &Model, message: &msg::Strip, given: u32) -> Result<Strip, MessageError> {
    let strip = strip(model, message)?;
    let expected = strip.acquisition_ticks(model.period);
    if expected != given {
        return Err(MessageError::AcquisitionTime { strip: message.id, expected, given });
    }
    Ok(strip)
}

fn strip(model: &Model, strip: &msg::Strip) -> Result<Strip, MessageError> {
    request_of_strip(strip)
        .to_strip(&model.config.requests, model.config.earth.radius_m)
        .map_err(|source| MessageError::Strip { strip: strip.id, source })
}
