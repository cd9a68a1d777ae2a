//! Where in ROS a mission flies: its namespace.

use clap::Args;
use swath_ros::RosArgs;

/// Which of several missions in one domain.
#[derive(Clone, Debug, Default, Args)]
pub struct Place {
    /// Namespace of the mission's nodes, such as /sat2 [default: /swath]
    #[arg(long, global = true, value_name = "NAMESPACE")]
    namespace: Option<String>,
}

impl Place {
    /// What a node there is told, besides what was said after `--ros-args`.
    #[must_use]
    pub fn args(&self, ros: &RosArgs) -> RosArgs {
        match &self.namespace {
            Some(namespace) => ros.clone().in_namespace(namespace),
            None => ros.clone(),
        }
    }
}
