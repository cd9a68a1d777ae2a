//! Orders as GeoJSON features.

use super::order::Order;
use crate::time_text;

/// A request as a GeoJSON feature.
#[must_use]
pub fn feature_of(order: &Order) -> serde_json::Value {
    let request = &order.request;
    let mut feature = serde_json::json!({
        "type": "Feature",
        "properties": {
            "name": order.name,
            "client_ref": order.client_ref,
            "submitter": order.submitter,
            "priority": request.priority,
            "acquisition_speed_m_s": request.acquisition_speed_m_s,
            "bidirectional": request.bidirectional,
        },
        "geometry": {
            "type": "LineString",
            "coordinates": [
                [request.start_longitude_deg, request.start_latitude_deg],
                [request.end_longitude_deg, request.end_latitude_deg],
            ],
        },
    });
    let properties = &mut feature["properties"];
    for (key, ns) in [("valid_from", order.valid_from_ns), ("valid_until", order.valid_until_ns)] {
        if ns > 0 {
            properties[key] = time_text::format(ns).into();
        }
    }
    if order.hold_for_approval {
        properties["hold_for_approval"] = true.into();
    }
    if order.max_attempts > 0 {
        properties["max_attempts"] = order.max_attempts.into();
    }
    if let Some(part) = &order.part {
        properties["order_ref"] = part.order_ref.clone().into();
        properties["part"] = part.number.into();
        properties["parts"] = part.of.into();
        properties["share"] = part.share.into();
    }
    feature
}
