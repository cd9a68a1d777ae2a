//! Which nodes of a mission another program than the launcher starts.

use serde::{Deserialize, Serialize};

use crate::faults::grammar::Process;
use crate::faults::{FaultPlan, FaultPlanError, What};

/// Who starts a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// The launcher, which also starts it again.
    #[default]
    Launched,
    /// Another program takes its place: its messages count by its name in ROS, and nobody starts it again.
    External,
}

/// `[nodes]` of a mission file: who starts the nodes whose place another program may take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Origins {
    /// The guidance.
    pub guidance: Origin,
    /// The planner.
    pub planner: Origin,
}

impl Origins {
    /// Names of nodes that may be external.
    pub const NAMES: [&str; 2] = ["guidance", "planner"];

    /// A node is external from now on; whether there is such a node.
    pub fn set_external(&mut self, name: &str) -> bool {
        match name {
            "guidance" => self.guidance = Origin::External,
            "planner" => self.planner = Origin::External,
            _ => return false,
        }
        true
    }

    /// Names of the nodes that are.
    #[must_use]
    pub fn external(&self) -> Vec<&'static str> {
        let all = [self.guidance, self.planner].into_iter().zip(Self::NAMES);
        all.filter(|(origin, _)| *origin == Origin::External).map(|(_, name)| name).collect()
    }

    /// Checks that nothing is ordered to befall a process that nobody here starts.
    ///
    /// # Errors
    /// The first order that does.
    pub fn fits(&self, faults: &FaultPlan) -> Result<(), FaultPlanError> {
        let external = self.external();
        let hits = |process: Process| external.contains(&process.name());
        faults.each(
            |fault| !matches!(fault.what, What::Process(process, _) if hits(process)),
            "flown",
            "a node that another program takes the place of cannot be struck",
        )
    }
}

#[cfg(test)]
mod tests {
    use crate::file::Mission;

    #[test]
    fn an_external_node_is_named_and_cannot_be_struck() {
        let read = |text: &str| -> Result<Mission, String> {
            let mission: Mission = toml::from_str(text).map_err(|error| error.to_string())?;
            mission.validate().map_err(|error| error.to_string())?;
            Ok(mission)
        };
        assert!(read("").unwrap().nodes.external().is_empty());
        let mission = read("[nodes]\nplanner = \"external\"").unwrap();
        assert_eq!(mission.nodes.external(), ["planner"]);
        let again: Mission = toml::from_str(&toml::to_string(&mission).unwrap()).unwrap();
        assert_eq!(again.nodes, mission.nodes);
        let struck = "[nodes]\nplanner = \"external\"\n[faults]\nplan = [\"planner:kill@60s\"]";
        assert!(read(struck).unwrap_err().contains("planner:kill@60s cannot be flown"));
        assert!(read(&struck.replace("planner:kill", "guidance:kill")).is_ok());
        assert!(read("[nodes]\nspacecraft = \"external\"").unwrap_err().contains("unknown field `spacecraft`"));
    }
}
