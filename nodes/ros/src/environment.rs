//! What the environment says of the DDS domain, the network and the middleware around.

use std::net::{IpAddr, Ipv4Addr};

use crate::error::RosError;

/// How requests and responses of services are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mapping {
    /// As rmw_cyclonedds does it.
    Cyclone,
    /// As rmw_fastrtps and rmw_connextdds do it.
    Enhanced,
}

impl Mapping {
    /// The mapping that the nodes around use, by the value of `RMW_IMPLEMENTATION`.
    #[must_use]
    pub fn for_middleware(rmw_implementation: Option<&str>) -> Self {
        match rmw_implementation {
            Some(name) if name.contains("fastrtps") || name.contains("connext") => Self::Enhanced,
            _ => Self::Cyclone,
        }
    }
}

/// The DDS domain, the networks to use, and how services are mapped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Environment {
    /// `ROS_DOMAIN_ID`, 0 if unset.
    pub domain: u16,
    /// Whether only this host is talked to: `ROS_LOCALHOST_ONLY=1`, or
    /// `ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST` or a value that ROS does not know.
    pub localhost_only: bool,
    /// By `RMW_IMPLEMENTATION`.
    pub mapping: Mapping,
}

/// The highest domain whose ports fit below 65536.
const DOMAIN_MAX: u16 = 232;

impl Environment {
    /// Reads the environment of the process.
    ///
    /// # Errors
    /// [`RosError::Environment`] for a variable with a value that it cannot have.
    pub fn read() -> Result<Self, RosError> {
        Self::from(|name| std::env::var(name).ok())
    }

    fn from(variable: impl Fn(&str) -> Option<String>) -> Result<Self, RosError> {
        let set = |name| variable(name).filter(|value| !value.is_empty());
        let failed = |name, value: &str, reason: &str| RosError::Environment {
            name,
            value: value.to_owned(),
            reason: reason.to_owned(),
        };
        let domain = match set("ROS_DOMAIN_ID") {
            None => 0,
            Some(text) => match text.parse() {
                Ok(domain) if domain <= DOMAIN_MAX => domain,
                _ => {
                    return Err(failed("ROS_DOMAIN_ID", &text, "it is not a number from 0 to 232"));
                }
            },
        };
        let only = match set("ROS_LOCALHOST_ONLY").as_deref() {
            None | Some("0") => false,
            Some("1") => true,
            Some(text) => return Err(failed("ROS_LOCALHOST_ONLY", text, "it is not 0 or 1")),
        };
        let range = set("ROS_AUTOMATIC_DISCOVERY_RANGE");
        let local = match range.as_deref() {
            None | Some("SUBNET" | "SYSTEM_DEFAULT") => false,
            Some("LOCALHOST") => true,
            Some(text @ "OFF") => {
                let reason = "a mission's nodes must find each other";
                return Err(failed("ROS_AUTOMATIC_DISCOVERY_RANGE", text, reason));
            }
            // As rcl does; there is no log yet.
            Some(text) => {
                eprintln!("ROS_AUTOMATIC_DISCOVERY_RANGE=`{text}` is unknown, only this host is talked to");
                true
            }
        };
        let mapping = Mapping::for_middleware(set("RMW_IMPLEMENTATION").as_deref());
        Ok(Self { domain, localhost_only: only || local, mapping })
    }

    /// The only networks to use, if not all.
    pub(crate) fn networks(&self) -> Option<[IpAddr; 1]> {
        self.localhost_only.then_some([IpAddr::V4(Ipv4Addr::LOCALHOST)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(set: &[(&str, &str)]) -> Result<Environment, RosError> {
        Environment::from(|name| set.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned()))
    }

    #[test]
    fn unset_means_domain_0_everywhere_and_cyclone() {
        let expected = Environment { domain: 0, localhost_only: false, mapping: Mapping::Cyclone };
        assert_eq!(read(&[]).unwrap(), expected);
        assert_eq!(read(&[("ROS_DOMAIN_ID", "")]).unwrap(), expected);
    }

    #[test]
    fn variables_are_read_as_ros_reads_them() {
        assert_eq!(read(&[("ROS_DOMAIN_ID", "42")]).unwrap().domain, 42);
        assert!(read(&[("ROS_LOCALHOST_ONLY", "1")]).unwrap().localhost_only);
        for (range, localhost_only) in
            [("LOCALHOST", true), ("SUBNET", false), ("SYSTEM_DEFAULT", false), ("lan", true)]
        {
            let read = read(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", range)]).unwrap();
            assert_eq!(read.localhost_only, localhost_only, "{range}");
        }
        let fast = read(&[("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")]).unwrap();
        assert_eq!(fast.mapping, Mapping::Enhanced);
    }

    #[test]
    fn nonsense_is_refused() {
        for (name, value) in [
            ("ROS_DOMAIN_ID", "233"),
            ("ROS_DOMAIN_ID", "-1"),
            ("ROS_LOCALHOST_ONLY", "yes"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"),
        ] {
            let error = read(&[(name, value)]).unwrap_err().to_string();
            assert!(error.starts_with(&format!("environment variable {name}=`{value}`")), "{error}");
        }
    }

    #[test]
    fn the_middleware_decides_on_the_mapping() {
        for (name, mapping) in [
            (None, Mapping::Cyclone),
            (Some("rmw_cyclonedds_cpp"), Mapping::Cyclone),
            (Some("rmw_fastrtps_cpp"), Mapping::Enhanced),
            (Some("rmw_fastrtps_dynamic_cpp"), Mapping::Enhanced),
            (Some("rmw_connextdds"), Mapping::Enhanced),
        ] {
            assert_eq!(Mapping::for_middleware(name), mapping, "{name:?}");
        }
    }
}
