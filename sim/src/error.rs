//! Everything that `sim` can refuse.

use thiserror::Error;

/// A value that the simulation cannot take.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SimError {
    /// A configuration value is outside its range (NaN always is).
    #[error("{name} is {value}, outside {min} to {max}")]
    OutOfRange {
        /// Path of the setting, as in the configuration file.
        name: &'static str,
        /// The value given.
        value: f64,
        /// Least value allowed.
        min: f64,
        /// Greatest value allowed.
        max: f64,
    },
    /// A range whose lower end is above its upper end.
    #[error("{name} runs from {min} down to {max}")]
    EmptyRange {
        /// Path of the setting.
        name: &'static str,
        /// Lower end given.
        min: f64,
        /// Upper end given.
        max: f64,
    },
    /// Principal inertias that no rigid body has.
    #[error(
        "spacecraft.inertia_kg_m2[{axis}] is {own}, more than the other two together, {others}: no body is like that"
    )]
    Inertia {
        /// Index of the axis.
        axis: usize,
        /// Its inertia [kg m²].
        own: f64,
        /// Sum of the other two [kg m²].
        others: f64,
    },
    /// A control frequency whose period is no whole number of nanoseconds.
    #[error(
        "control frequency {frequency_hz} Hz is outside 0.1 to 100 Hz or its period is not a whole number of nanoseconds"
    )]
    Frequency {
        /// The frequency given [Hz].
        frequency_hz: f64,
    },
    /// A name that is no error of the plant.
    #[error(
        "`{name}` is no error of the plant: expected none, or torque-10%, inertia+5% and the like, noise and delay, \
         joined by commas"
    )]
    UnknownPlantError {
        /// The name given.
        name: String,
    },
    /// A name that is no station's.
    #[error("no station `{name}` in the catalogue, which has {known}")]
    UnknownStation {
        /// The name given.
        name: String,
        /// Names that there are.
        known: String,
    },
    /// A transmitter without anybody who listens.
    #[error("resources.transmitter_rate_bps is not 0, but there are no stations to send to")]
    DownlinkWithoutStations,
    /// A strip that cannot be flown.
    #[error(transparent)]
    Strip(#[from] StripError),
}

/// Why a strip is refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum StripError {
    /// A number that is NaN or infinite.
    #[error("{field} is {value}, not a finite number")]
    NotFinite {
        /// Field of the request.
        field: &'static str,
        /// The value given.
        value: f64,
    },
    /// A latitude beyond a pole.
    #[error("{field} {value_deg}° is outside -90° to 90°")]
    Latitude {
        /// Field of the request.
        field: &'static str,
        /// The value given [deg].
        value_deg: f64,
    },
    /// A longitude outside -180° to 360°.
    #[error("{field} {value_deg}° is outside -180° to 360°")]
    Longitude {
        /// Field of the request.
        field: &'static str,
        /// The value given [deg].
        value_deg: f64,
    },
    /// A priority outside [0, 1].
    #[error("priority {priority} is outside 0 to 1")]
    Priority {
        /// The value given.
        priority: f64,
    },
    /// An acquisition speed outside the imager's range.
    #[error("acquisition speed {speed_m_s} m/s is outside {min_m_s} to {max_m_s} m/s")]
    Speed {
        /// The value given [m/s].
        speed_m_s: f64,
        /// Least speed [m/s].
        min_m_s: f64,
        /// Greatest speed [m/s].
        max_m_s: f64,
    },
    /// A strip that is too short or too long.
    #[error("length {length_km:.3} km is outside {min_km} to {max_km} km")]
    Length {
        /// Great-circle length [km].
        length_km: f64,
        /// Least length [km].
        min_km: f64,
        /// Greatest length [km].
        max_km: f64,
    },
    /// Start and end on opposite sides of the Earth: the great circle is undefined.
    #[error("start and end are antipodal: the great circle between them is undefined")]
    Antipodal,
    /// A strip that is never visible within the planning horizon.
    #[error("no imaging window opens within {horizon_s} s")]
    NoWindow {
        /// How far ahead windows were sought [s].
        horizon_s: f64,
    },
}
