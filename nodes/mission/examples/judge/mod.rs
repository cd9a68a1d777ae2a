//! Lines and areas judged by the strips that would be submitted for them.

mod areas;
mod lines;

pub use areas::Areas;
pub use lines::Lines;

use swath_mission::orders::found::Import;
use swath_mission::shapes::sphere::{Arc, direction};

/// The strips of an import as they would be flown.
pub fn strips(import: &Import) -> Vec<Arc> {
    let arc = |order: &swath_mission::orders::order::Order| {
        let it = &order.request;
        let start = direction([it.start_longitude_deg, it.start_latitude_deg]);
        Arc::new(start, direction([it.end_longitude_deg, it.end_latitude_deg]))
    };
    import.orders.iter().filter_map(arc).collect()
}
