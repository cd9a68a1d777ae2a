//! A bound on the memory of a process.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

use crate::error::RosError;

/// From now on this process gets no more than so many megabytes [10^6 B] of memory of its own; 0 is no bound.
///
/// An allocation beyond it ends the process, which can be started again: better one process than all of the machine.
/// Files and libraries that are mapped do not count.
pub(crate) fn bound(megabytes: u64) -> Result<(), RosError> {
    if megabytes == 0 {
        return Ok(());
    }
    let maximum = getrlimit(Resource::Data).maximum;
    let wanted = megabytes.saturating_mul(1_000_000);
    let current = Some(maximum.map_or(wanted, |maximum| maximum.min(wanted)));
    setrlimit(Resource::Data, Rlimit { current, maximum }).map_err(|error| RosError::System {
        what: "the memory of this process cannot be bounded",
        source: error.into(),
    })
}
