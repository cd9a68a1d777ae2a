//! Settings of power, data and momentum, and the two profiles that they start from.

use serde::{Deserialize, Serialize};

use crate::config::range::in_range;
use crate::config::station::Station;
use crate::error::SimError;

/// Where settings that are left out come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// A satellite of 330 kg as it is built: 450 W of panels, 500 Wh, magnetic rods, X band to seven stations.
    #[default]
    Minisat,
    /// BSK-RL's: its 272 W panel, 120 Wh, 50 images of storage, thrusters, wheels that fail at 1500 rpm.
    Bsk,
}

/// How the transmitter's antenna is pointed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Antenna {
    /// It steers itself: data come down in every contact, whatever the satellite does.
    Steerable,
    /// It is fixed to the body: data come down in downlink tasks, which point it at the Earth's centre.
    BodyFixed,
}

/// What takes momentum out of the wheels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Desaturation {
    /// Nothing.
    None,
    /// Magnetic rods, at all times.
    Rods,
    /// Thrusters, in desaturation tasks.
    Thrusters,
}

/// Which file is sent first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DownlinkOrder {
    /// The oldest.
    Oldest,
    /// The one that is worth most a bit.
    Worth,
}

/// Which reward a mission counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RewardKind {
    /// A strip's priority when it is imaged.
    Imaged,
    /// A strip's priority when its last bit is on the ground.
    Delivered,
}

/// Defines the settings, and the same with every one optional, from which a profile is completed.
macro_rules! settings {
    ($($(#[$doc:meta])* $name:ident: $kind:ty,)*) => {
        /// Power, data and momentum of the satellite; what a file leaves out comes from its profile.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(from = "Partial")]
        pub struct ResourcesConfig {
            /// Where settings that are left out come from.
            pub profile: Profile,
            $($(#[$doc])* pub $name: $kind,)*
        }

        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Partial {
            #[serde(default)]
            profile: Profile,
            $($name: Option<$kind>,)*
        }

        impl From<Partial> for ResourcesConfig {
            fn from(partial: Partial) -> Self {
                let profile = Self::of(partial.profile);
                Self { profile: partial.profile, $($name: partial.$name.unwrap_or(profile.$name),)* }
            }
        }
    };
}

settings! {
    /// Right ascension of the Sun, which stands still [deg].
    sun_right_ascension_deg: f64,
    /// Declination of the Sun [deg].
    sun_declination_deg: f64,
    /// Distance of the Sun [AU].
    sun_distance_au: f64,
    /// Area of the solar array [m²].
    panel_area_m2: f64,
    /// Share of the light that the array turns into power.
    panel_efficiency: f64,
    /// Direction of the array's normal, in B; its length does not matter.
    panel_normal_b: [f64; 3],
    /// Capacity of the battery [Wh].
    battery_capacity_wh: f64,
    /// Charge at the epoch over the capacity.
    battery_initial: f64,
    /// Charge over the capacity below which planners should not let it fall.
    battery_floor: f64,
    /// Load that is always there [W].
    bus_w: f64,
    /// Load of the imager while it images and warms up [W].
    imager_w: f64,
    /// How long the imager warms up before it images [s].
    imager_warm_up_s: f64,
    /// Load of the transmitter while it sends [W].
    transmitter_w: f64,
    /// Load of each wheel that is always there [W].
    wheel_base_w: f64,
    /// Share of the electric power that a wheel's motor turns into work.
    wheel_motor_efficiency: f64,
    /// Share of a wheel's work that comes back when it brakes; below 0, braking costs what driving costs.
    wheel_recovery: f64,
    /// A wheel whose momentum exceeds this has failed [N m s].
    wheel_momentum_max_nms: f64,
    /// What the imager records [bit/s].
    imager_rate_bps: f64,
    /// What can be stored [bit].
    storage_capacity_bits: u64,
    /// What the transmitter sends [bit/s]; 0 for none.
    transmitter_rate_bps: f64,
    /// How the antenna is pointed.
    antenna: Antenna,
    /// Boresight of a body-fixed antenna, in B.
    antenna_axis_b: [f64; 3],
    /// Angle from the boresight up to which a body-fixed antenna sends [deg].
    antenna_half_angle_deg: f64,
    /// Which file is sent first.
    downlink_order: DownlinkOrder,
    /// Names of stations of the catalogue.
    stations: Vec<String>,
    /// Stations of one's own.
    own_stations: Vec<Station>,
    /// What takes momentum out of the wheels.
    desaturation: Desaturation,
    /// Largest dipole of each of three rods on the body axes [A m²].
    rod_dipole_max_am2: f64,
    /// Gain of the rods' law: torque over momentum [1/s].
    rod_gain_per_s: f64,
    /// Load of each rod at its largest dipole [W].
    rod_w: f64,
    /// Largest torque of the thrusters about each body axis [N m].
    thruster_torque_max_nm: f64,
    /// Load of the thrusters while they fire [W].
    thruster_w: f64,
    /// The thrusters fire for one tick of so many.
    thruster_pulse_every: u32,
    /// Whether the Earth's gravity gradient turns the satellite.
    gravity_gradient: bool,
    /// Dipole that the satellite has of itself, in B [A m²].
    residual_dipole_am2: [f64; 3],
    /// Constant torque on the satellite, in B [N m].
    disturbance_nm: [f64; 3],
    /// Which reward counts.
    reward: RewardKind,
    /// Whether a shield keeps every planner from what the battery does not last for.
    shield: bool,
    /// What an episode loses when the battery is empty or a wheel fails.
    failure_penalty: f64,
}

/// Joules in a watt hour.
const J_PER_WH: f64 = 3600.0;
/// The camera's boresight in B is +z.
const CAMERA_B: [f64; 3] = [0.0, 0.0, 1.0];
/// The stations of BSK-RL.
const BSK_STATIONS: [&str; 7] = ["boulder", "merritt", "singapore", "weilheim", "santiago", "dongara", "hawaii"];

impl ResourcesConfig {
    /// The settings of a profile.
    #[must_use]
    pub fn of(profile: Profile) -> Self {
        match profile {
            Profile::Minisat => Self::minisat(),
            Profile::Bsk => Self::bsk(),
        }
    }

    /// A satellite like KhalifaSat (SI-300 bus): 330 kg and 450 W. Base load, loads of imager and transmitter and the
    /// rods are estimates of the class.
    fn minisat() -> Self {
        Self {
            profile: Profile::Minisat,
            sun_right_ascension_deg: 0.0,
            sun_declination_deg: 0.0,
            sun_distance_au: 1.0,
            panel_area_m2: 1.18,
            panel_efficiency: 0.28,
            panel_normal_b: [0.0, 0.0, -1.0],
            battery_capacity_wh: 500.0,
            battery_initial: 0.8,
            battery_floor: 0.25,
            bus_w: 40.0,
            imager_w: 60.0,
            imager_warm_up_s: 10.0,
            transmitter_w: 60.0,
            wheel_base_w: 20.4,
            wheel_motor_efficiency: 0.5,
            wheel_recovery: -1.0,
            // More than the wheels take: they cannot fail by it.
            wheel_momentum_max_nms: 60.0,
            imager_rate_bps: 160e6,
            storage_capacity_bits: 512_000_000_000,
            transmitter_rate_bps: 800e6,
            antenna: Antenna::Steerable,
            antenna_axis_b: CAMERA_B,
            antenna_half_angle_deg: 70.0,
            downlink_order: DownlinkOrder::Worth,
            stations: BSK_STATIONS.map(str::to_owned).to_vec(),
            own_stations: Vec::new(),
            desaturation: Desaturation::Rods,
            rod_dipole_max_am2: 100.0,
            rod_gain_per_s: 0.003,
            rod_w: 3.0,
            thruster_torque_max_nm: 1.0,
            thruster_w: 30.0,
            thruster_pulse_every: 5,
            gravity_gradient: true,
            residual_dipole_am2: [0.0, 1.0, 0.0],
            disturbance_nm: [0.0, 2e-5, 0.0],
            reward: RewardKind::Delivered,
            shield: true,
            failure_penalty: 1.0,
        }
    }

    /// BSK-RL 1.3.8's defaults, with the battery, the wheels' base load and their limit of its published examples.
    fn bsk() -> Self {
        Self {
            profile: Profile::Bsk,
            panel_area_m2: 1.0,
            panel_efficiency: 0.2,
            battery_capacity_wh: 120.0,
            bus_w: 0.0,
            imager_w: 10.0,
            transmitter_w: 15.0,
            wheel_recovery: 0.0,
            // 1500 rpm.
            wheel_momentum_max_nms: 12.5,
            // An image of 8 Mbit, over the 20 s of a middling strip.
            imager_rate_bps: 0.4e6,
            storage_capacity_bits: 400_000_000,
            transmitter_rate_bps: 8e6,
            antenna: Antenna::BodyFixed,
            desaturation: Desaturation::Thrusters,
            gravity_gradient: false,
            residual_dipole_am2: [0.0; 3],
            disturbance_nm: [1e-4, 1e-4, 1e-4],
            ..Self::minisat()
        }
    }

    /// Capacity of the battery [J].
    #[must_use]
    pub fn battery_capacity_j(&self) -> f64 {
        self.battery_capacity_wh * J_PER_WH
    }

    /// Whether data come down in downlink tasks alone.
    #[must_use]
    pub fn antenna_needs_task(&self) -> bool {
        self.antenna == Antenna::BodyFixed
    }

    /// Whether momentum is taken out by thrusters, which takes a task.
    #[must_use]
    pub fn has_thrusters(&self) -> bool {
        self.desaturation == Desaturation::Thrusters
    }

    /// All stations, those of the catalogue first.
    ///
    /// # Errors
    /// When the catalogue lacks a name.
    pub fn all_stations(&self) -> Result<Vec<Station>, SimError> {
        let named = self.stations.iter().map(|name| Station::named(name));
        named.chain(self.own_stations.iter().cloned().map(Ok)).collect()
    }

    /// Checks every value's range; NaN fails each of them.
    ///
    /// # Errors
    /// The first setting that is out of range, with its limits.
    pub fn validate(&self) -> Result<(), SimError> {
        self.validate_ranges()?;
        for (name, direction) in
            [("resources.panel_normal_b", self.panel_normal_b), ("resources.antenna_axis_b", self.antenna_axis_b)]
        {
            let [x, y, z] = direction;
            in_range(name, (x * x + y * y + z * z).sqrt(), 1e-6, 1e6)?;
        }
        self.disturbance_nm.into_iter().try_for_each(|it| in_range("resources.disturbance_nm", it, -1e-2, 1e-2))?;
        self.residual_dipole_am2
            .into_iter()
            .try_for_each(|it| in_range("resources.residual_dipole_am2", it, -100.0, 100.0))?;
        let stations = self.all_stations()?;
        stations.iter().try_for_each(Station::validate)?;
        if self.transmitter_rate_bps > 0.0 && stations.is_empty() {
            return Err(SimError::DownlinkWithoutStations);
        }
        Ok(())
    }

    fn validate_ranges(&self) -> Result<(), SimError> {
        for (name, value, min, max) in [
            ("resources.sun_right_ascension_deg", self.sun_right_ascension_deg, -360.0, 360.0),
            ("resources.sun_declination_deg", self.sun_declination_deg, -90.0, 90.0),
            ("resources.sun_distance_au", self.sun_distance_au, 0.9, 1.1),
            ("resources.panel_area_m2", self.panel_area_m2, 0.0, 1000.0),
            ("resources.panel_efficiency", self.panel_efficiency, 0.0, 1.0),
            ("resources.battery_capacity_wh", self.battery_capacity_wh, 1.0, 1e6),
            ("resources.battery_initial", self.battery_initial, 0.0, 1.0),
            ("resources.battery_floor", self.battery_floor, 0.0, 1.0),
            ("resources.bus_w", self.bus_w, 0.0, 1e5),
            ("resources.imager_w", self.imager_w, 0.0, 1e5),
            ("resources.imager_warm_up_s", self.imager_warm_up_s, 0.0, 600.0),
            ("resources.transmitter_w", self.transmitter_w, 0.0, 1e5),
            ("resources.wheel_base_w", self.wheel_base_w, 0.0, 1e4),
            ("resources.wheel_motor_efficiency", self.wheel_motor_efficiency, 0.01, 1.0),
            ("resources.wheel_recovery", self.wheel_recovery, -1.0, 1.0),
            ("resources.wheel_momentum_max_nms", self.wheel_momentum_max_nms, 0.01, 1e4),
            ("resources.imager_rate_bps", self.imager_rate_bps, 0.0, 1e12),
            ("resources.storage_capacity_bits", self.storage_capacity_bits as f64, 0.0, 1e16),
            ("resources.transmitter_rate_bps", self.transmitter_rate_bps, 0.0, 1e12),
            ("resources.antenna_half_angle_deg", self.antenna_half_angle_deg, 0.0, 180.0),
            ("resources.rod_dipole_max_am2", self.rod_dipole_max_am2, 0.0, 1e4),
            ("resources.rod_gain_per_s", self.rod_gain_per_s, 0.0, 1.0),
            ("resources.rod_w", self.rod_w, 0.0, 1e4),
            ("resources.thruster_torque_max_nm", self.thruster_torque_max_nm, 0.0, 100.0),
            ("resources.thruster_w", self.thruster_w, 0.0, 1e4),
            ("resources.thruster_pulse_every", f64::from(self.thruster_pulse_every), 1.0, 1000.0),
            ("resources.failure_penalty", self.failure_penalty, 0.0, 1e6),
        ] {
            in_range(name, value, min, max)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_valid_and_complete_what_is_left_out() {
        for profile in [Profile::Minisat, Profile::Bsk] {
            let config = ResourcesConfig::of(profile);
            config.validate().unwrap();
            assert_eq!(config.profile, profile);
            let text = toml::to_string(&config).unwrap();
            assert_eq!(toml::from_str::<ResourcesConfig>(&text).unwrap(), config);
        }
        let config: ResourcesConfig = toml::from_str("profile = \"bsk\"\nbus_w = 7.0").unwrap();
        assert_eq!(config, ResourcesConfig { bus_w: 7.0, ..ResourcesConfig::of(Profile::Bsk) });
        assert_eq!(toml::from_str::<ResourcesConfig>("").unwrap(), ResourcesConfig::of(Profile::Minisat));
        let error = toml::from_str::<ResourcesConfig>("battery_wh = 3").unwrap_err().to_string();
        assert!(error.contains("unknown field `battery_wh`"), "{error}");
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let refused = |text: &str| {
            let config: ResourcesConfig = toml::from_str(text).unwrap();
            config.validate().unwrap_err().to_string()
        };
        assert_eq!(refused("panel_area_m2 = -1.0"), "resources.panel_area_m2 is -1, outside 0 to 1000");
        assert_eq!(refused("panel_efficiency = 1.1"), "resources.panel_efficiency is 1.1, outside 0 to 1");
        assert_eq!(refused("battery_floor = 1.5"), "resources.battery_floor is 1.5, outside 0 to 1");
        assert_eq!(
            refused("panel_normal_b = [0.0, 0.0, 0.0]"),
            "resources.panel_normal_b is 0, outside 0.000001 to 1000000"
        );
        assert_eq!(refused("bus_w = nan"), "resources.bus_w is NaN, outside 0 to 100000");
        assert!(refused("stations = [\"atlantis\"]").starts_with("no station `atlantis` in the catalogue"));
        assert_eq!(
            refused("stations = []"),
            "resources.transmitter_rate_bps is not 0, but there are no stations to send to"
        );
        assert!(refused("disturbance_nm = [0.0, 1.0, 0.0]").starts_with("resources.disturbance_nm is 1, outside"));
        let own = "[[own_stations]]\nname = \"a\"\nlatitude_deg = 0.0\nlongitude_deg = 0.0\nmask_deg = 95.0";
        assert_eq!(refused(own), "station.mask_deg is 95, outside 0 to 89");
        toml::from_str::<ResourcesConfig>("stations = []\ntransmitter_rate_bps = 0.0").unwrap().validate().unwrap();
    }
}
