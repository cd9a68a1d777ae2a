//! Orders as the strips that they were cut into.

use std::collections::BTreeMap;

use anyhow::{Result as Answer, ensure};
use swath_msgs::swath_msgs as msg;

use crate::desks::call;
use crate::problem::Problem;
use crate::server::Server;

/// Requests of one call to the request manager.
const PAGE: u32 = 1000;

/// The strips of an order, by number.
pub struct Group {
    /// How they stand.
    pub strips: Vec<msg::StripStatus>,
    /// What was asked for, of the first.
    pub request: msg::StripRequest,
}

/// Numbers of the strips of every order, in the order of their first ones.
#[must_use]
pub fn all(server: &Server) -> Vec<Vec<u64>> {
    server.site.shared.read(|ledger| {
        let mut groups: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
        for (id, status) in ledger.requests() {
            // A strip that is an order of its own, of a mission that does not number orders.
            groups.entry(if status.order_id == 0 { *id } else { status.order_id }).or_default().push(*id);
        }
        groups.into_values().collect()
    })
}

/// An order by the number of one of its strips; its own number is that of the first.
///
/// # Errors
/// When there is none.
pub fn one(server: &Server, id: &str) -> Result<Vec<u64>, Problem> {
    let unknown = || Problem::unknown(format!("there is no order {id:?}"));
    let number: u64 = id.parse().map_err(|_| unknown())?;
    let group = all(server).into_iter().find(|ids| ids.first() == Some(&number));
    group.ok_or_else(unknown)
}

/// All that an order's answer needs.
///
/// # Errors
/// When the mission does not answer.
pub async fn load(server: &Server, ids: &[u64]) -> Result<Group, Problem> {
    if server.asked.lacks(ids) {
        fetch(server, ids).await?;
    }
    let strips: Vec<_> =
        server.site.shared.read(|ledger| ids.iter().filter_map(|id| ledger.requests().get(id).cloned()).collect());
    let request = ids.first().and_then(|id| server.asked.of(*id));
    let request = request.ok_or_else(|| Problem::unknown(format!("there is no order {ids:?}")))?;
    Ok(Group { strips, request })
}

/// Asks for requests, and tells the ledger how they stand.
///
/// # Errors
/// When the mission does not answer.
pub async fn fetch(server: &Server, ids: &[u64]) -> Result<(), Problem> {
    let (Some(first), Some(last)) = (ids.iter().min().copied(), ids.iter().max().copied()) else { return Ok(()) };
    let found = server.counter()?.ask(move |desks| -> Answer<_> {
        let mut found = Vec::new();
        let after_id = first.saturating_sub(1);
        let mut page = msg::ListStripsRequest { after_id, limit: PAGE, with_requests: true, ..Default::default() };
        loop {
            let answer = call(&desks.list, &page)?;
            ensure!(answer.reason_code == 0, "{} (reason {})", answer.reason, answer.reason_code);
            page.after_id = answer.strips.last().map_or(last, |status| status.strip.id);
            found.extend(answer.strips.into_iter().zip(answer.requests));
            if !answer.more || page.after_id >= last {
                return Ok(found);
            }
        }
    });
    let found = found.await?;
    server.site.shared.update(|ledger| found.iter().for_each(|(status, _)| ledger.strip(status)));
    server.asked.learn(found.into_iter().map(|(status, request)| (status.strip.id, request)));
    Ok(())
}
