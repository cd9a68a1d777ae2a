//! What the satellite does besides turning as a message, and back.

use swath_msgs::swath_msgs as msg;
use swath_sim::vehicle::resources::{Activity, Imager};
use swath_sim::world::strip::StripId;

use crate::error::MessageError;

/// Greatest worth of an image that makes sense.
const WORTH_MAX: f64 = 1e6;

/// What the satellite does besides turning.
#[must_use]
pub fn activity_message(activity: &Activity) -> msg::Activity {
    let (imager, strip_id) = match activity.imager {
        Imager::Off => (msg::Activity::IMAGER_OFF, 0),
        Imager::Warm => (msg::Activity::IMAGER_WARM, 0),
        Imager::Records(strip) => (msg::Activity::IMAGER_RECORDS, strip.0),
    };
    msg::Activity {
        imager,
        strip_id,
        downlink: activity.downlink,
        desaturate: activity.desaturate.is_some(),
        desaturate_tick: activity.desaturate.unwrap_or(0),
        image_ended: activity.image_worth.is_some(),
        image_worth: activity.image_worth.unwrap_or(0.0),
    }
}

/// What the satellite does besides turning.
///
/// # Errors
/// When a constant is unknown or a number is not finite or absurd.
pub fn activity(message: &msg::Activity) -> Result<Activity, MessageError> {
    let worth = message.image_worth;
    if !(0.0..=WORTH_MAX).contains(&worth) {
        return Err(MessageError::Number { field: "image_worth", value: worth, limit: WORTH_MAX });
    }
    Ok(Activity {
        imager: match message.imager {
            msg::Activity::IMAGER_OFF => Imager::Off,
            msg::Activity::IMAGER_WARM => Imager::Warm,
            msg::Activity::IMAGER_RECORDS => Imager::Records(StripId(message.strip_id)),
            value => return Err(MessageError::Constant { field: "imager", value }),
        },
        downlink: message.downlink,
        desaturate: message.desaturate.then_some(message.desaturate_tick),
        image_worth: message.image_ended.then_some(worth),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn activities_come_back_and_nonsense_is_refused() {
        for imager in [Imager::Off, Imager::Warm, Imager::Records(StripId(7))] {
            for (desaturate, image_worth) in [(None, None), (Some(0), Some(0.0)), (Some(9), Some(0.75))] {
                let done = Activity { imager, downlink: desaturate.is_some(), desaturate, image_worth };
                assert_eq!(activity(&activity_message(&done)), Ok(done));
            }
        }
        let of = |imager, image_worth| activity(&msg::Activity { imager, image_worth, ..Default::default() });
        assert_eq!(of(3, 0.0), Err(MessageError::Constant { field: "imager", value: 3 }));
        assert!(of(0, f64::NAN).is_err() && of(0, -1.0).is_err());
    }
}
