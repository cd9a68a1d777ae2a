//! The nodes of a mission by name, and where each is: on board, on the ground, or neither.

/// Integrates the dynamics and owns the clock.
pub const SPACECRAFT: &str = "spacecraft";
/// Flies the task in hand.
pub const GUIDANCE: &str = "guidance";
/// Keeps every strip that was ever requested.
pub const REQUEST_MANAGER: &str = "request_manager";
/// Chooses the next task.
pub const PLANNER: &str = "planner";
/// On board, in missions with a radio: keeps the strips that were uplinked, and what became of them.
pub const CATALOGUE: &str = "catalogue";
/// The radio between ground and satellite, in missions that have one.
pub const LINK: &str = "link";
/// Starts and watches the others.
pub const LAUNCHER: &str = "launcher";
/// Writes every topic to a bag.
pub const RECORDER: &str = "recorder";
/// Publishes the topics of a bag.
pub const PLAYER: &str = "player";
/// The page in a browser and the HTTP API, an operator like others.
pub const CONSOLE: &str = "console";
/// Shows topics to Foxglove.
pub const BRIDGE: &str = "bridge";
/// A person's command line or another program.
pub const OPERATOR: &str = "operator";

/// Where a node of a mission is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Segment {
    /// On board.
    Space,
    /// On the ground.
    Ground,
    /// Neither: it makes, watches or records the others, or is the radio between them.
    Simulator,
}

/// Where a node of the table is.
#[must_use]
pub fn segment(node: &str) -> Segment {
    match node {
        SPACECRAFT | GUIDANCE | PLANNER | CATALOGUE => Segment::Space,
        REQUEST_MANAGER | OPERATOR | CONSOLE | BRIDGE => Segment::Ground,
        _ => Segment::Simulator,
    }
}

impl Segment {
    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Space => "space",
            Self::Ground => "ground",
            Self::Simulator => "simulator",
        }
    }
}
