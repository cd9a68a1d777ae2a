//! Requests for measurements and tests that submit many.

use swath_msgs::swath_msgs as msg;

/// Request `number` of a submitter, under a reference of its own: spread over the globe so that no two are the same strip.
pub fn request(submitter: &str, number: u64) -> msg::StripRequest {
    let latitude = (number * 37 % 800) as f64 / 10.0 - 40.0;
    let longitude = (number * 101 % 3500) as f64 / 10.0 - 175.0;
    msg::StripRequest {
        client_ref: format!("{submitter}-{number}"),
        submitter: submitter.to_owned(),
        name: format!("strip {number}"),
        start_latitude_deg: latitude,
        start_longitude_deg: longitude,
        end_latitude_deg: latitude + 1.0,
        end_longitude_deg: longitude + 1.5,
        priority: 0.5,
        acquisition_speed: 3000.0,
        ..msg::StripRequest::default()
    }
}
