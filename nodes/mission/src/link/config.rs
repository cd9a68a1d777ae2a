//! `[link]` of a mission file: stations, rates, delay and loss of the radio.

use serde::{Deserialize, Serialize};
use swath_sim::config::SimConfig;
use swath_sim::config::station::Station;
use swath_sim::error::SimError;
use swath_sim::world::stations::NeverSeen;
use thiserror::Error;

/// How far ahead the ground predicts where a mission does not say [h].
const PREDICTION_H: f64 = 12.0;

/// When the radio can be heard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LinkMode {
    /// While a station sees the satellite.
    #[default]
    Passes,
    /// At all times, as through relay satellites: stations do not matter, and the delay is that of processing.
    Always,
}

/// `[link]` of a mission file: the radio between ground and satellite. Without it the two are one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LinkConfig {
    /// When it can be heard.
    pub mode: LinkMode,
    /// Names of stations of the catalogue.
    pub stations: Vec<String>,
    /// Stations of one's own.
    pub own_stations: Vec<Station>,
    /// Elevation above which stations of the catalogue hear the satellite [deg].
    pub mask_deg: f64,
    /// Rate to the satellite [bit/s].
    pub uplink_bps: f64,
    /// Rate to the ground [bit/s].
    pub downlink_bps: f64,
    /// Time between reception and use of a frame [s]; the way that light takes comes on top, and the sum is rounded up
    /// to ticks.
    pub processing_s: f64,
    /// Probability that a frame does not arrive [1].
    pub loss: f64,
    /// Data of an imaged strip [bit]; 0 for images that need not come down.
    pub strip_bits: f64,
    /// Simulated time without a frame from the ground after which the ground is taken to be lost, until one is heard [h];
    /// it never is without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command_loss_h: Option<f64>,
    /// What the satellite does then.
    #[serde(skip_serializing_if = "CommandLossMode::is_default")]
    pub command_loss_mode: CommandLossMode,
    /// How far ahead the ground predicts what the satellite is going to do [h], 0 for no prediction. Without it 12 h, and
    /// nothing in lockstep, where nobody looks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prediction_h: Option<f64>,
}

impl Default for LinkConfig {
    fn default() -> Self {
        Self {
            mode: LinkMode::default(),
            stations: Vec::new(),
            own_stations: Vec::new(),
            mask_deg: 10.0,
            uplink_bps: 64e3,
            downlink_bps: 50e6,
            processing_s: 0.2,
            loss: 0.0,
            strip_bits: 200e6,
            command_loss_h: None,
            command_loss_mode: CommandLossMode::default(),
            prediction_h: None,
        }
    }
}

/// What a satellite does that hears nothing of the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CommandLossMode {
    /// It holds its attitude and images nothing.
    #[default]
    Hold,
    /// It goes on with what is on board, and raises the alarm.
    Continue,
}

impl CommandLossMode {
    #[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// Why a `[link]` cannot be flown.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LinkConfigError {
    /// A name that is no station's.
    #[error(transparent)]
    Unknown(SimError),
    /// A station that cannot be.
    #[error("station {name}: {source}")]
    Station {
        /// Name of the station.
        name: String,
        /// What is wrong with it.
        source: SimError,
    },
    /// Two stations of one name.
    #[error("station {0} is there twice")]
    Twice(String),
    /// A number is out of range.
    #[error("{name} is {value}, outside {min} to {max}")]
    OutOfRange {
        /// The setting.
        name: &'static str,
        /// Value given.
        value: f64,
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// Passes over nothing.
    #[error(
        "mode is \"passes\", but stations and own_stations are empty: name at least one station, or set mode to \"always\""
    )]
    NoStations,
    /// Two settings for one thing.
    #[error(
        "strip_bits is {0}, but with [resources] images come down as the imager and the transmitter there say: \
             set it to 0"
    )]
    TwoImages(f64),
}

impl LinkConfig {
    /// All stations, those of the catalogue first.
    ///
    /// # Errors
    /// When the catalogue has no station of a name.
    pub fn all_stations(&self) -> Result<Vec<Station>, LinkConfigError> {
        let named = self.stations.iter().map(|name| {
            let station = Station::named(name).map_err(LinkConfigError::Unknown)?;
            Ok(Station { mask_deg: self.mask_deg, ..station })
        });
        named.chain(self.own_stations.iter().cloned().map(Ok)).collect()
    }

    /// Stations that an orbit never sees.
    ///
    /// # Errors
    /// When the catalogue has no station of a name.
    pub fn never_seen(&self, config: &SimConfig) -> Result<Vec<NeverSeen>, LinkConfigError> {
        Ok(self.all_stations()?.iter().filter_map(|station| station.never_seen(config)).collect())
    }

    /// How far ahead the ground predicts in a mission of a pace [h]; 0 for no prediction.
    #[must_use]
    pub fn predicts_h(&self, pace: f64) -> f64 {
        self.prediction_h.unwrap_or(if pace > 0.0 { PREDICTION_H } else { 0.0 })
    }

    /// Checks every setting; NaN fails each range.
    ///
    /// # Errors
    /// The first that is wrong, with its limits.
    pub fn validate(&self, sim: &SimConfig) -> Result<(), LinkConfigError> {
        for (name, value, min, max) in [
            ("mask_deg", self.mask_deg, 0.0, 89.0),
            ("uplink_bps", self.uplink_bps, 100.0, 1e10),
            ("downlink_bps", self.downlink_bps, 100.0, 1e11),
            ("processing_s", self.processing_s, 0.0, 60.0),
            ("loss", self.loss, 0.0, 0.99),
            ("strip_bits", self.strip_bits, 0.0, 1e13),
            ("prediction_h", self.prediction_h.unwrap_or(0.0), 0.0, 240.0),
            ("command_loss_h", self.command_loss_h.unwrap_or(1.0), 0.01, 1e5),
        ] {
            if !(min..=max).contains(&value) {
                return Err(LinkConfigError::OutOfRange { name, value, min, max });
            }
        }
        let stations = self.all_stations()?;
        for (at, station) in stations.iter().enumerate() {
            let name = station.name.clone();
            station.validate().map_err(|source| LinkConfigError::Station { name: name.clone(), source })?;
            if stations.iter().take(at).any(|other| other.name == name) {
                return Err(LinkConfigError::Twice(name));
            }
        }
        if stations.is_empty() && self.mode == LinkMode::Passes {
            return Err(LinkConfigError::NoStations);
        }
        if sim.resources.is_some() && self.strip_bits > 0.0 {
            return Err(LinkConfigError::TwoImages(self.strip_bits));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        let link: LinkConfig = toml::from_str(text).unwrap();
        link.validate(&SimConfig::default()).unwrap_err().to_string()
    }

    #[test]
    fn what_is_wrong_is_told_with_its_limit() {
        for (text, wanted) in [
            ("stations = [\"atlantis\"]", "no station `atlantis` in the catalogue, which has boulder, merritt,"),
            ("stations = [\"tokyo\", \"tokyo\"]", "station tokyo is there twice"),
            ("stations = [\"tokyo\"]\nmask_deg = 91.0", "mask_deg is 91, outside 0 to 89"),
            (
                "own_stations = [{ name = \"roof\", latitude_deg = 1, longitude_deg = 2, mask_deg = 91.0 }]",
                "station roof: station.mask_deg is 91, outside 0 to 89",
            ),
            ("stations = [\"tokyo\"]\nuplink_bps = 0", "uplink_bps is 0, outside 100 to 10000000000"),
            ("stations = [\"tokyo\"]\ndownlink_bps = nan", "downlink_bps is NaN, outside 100 to 100000000000"),
            ("stations = [\"tokyo\"]\nloss = 1.0", "loss is 1, outside 0 to 0.99"),
            ("stations = [\"tokyo\"]\nprediction_h = -1", "prediction_h is -1, outside 0 to 240"),
            ("stations = [\"tokyo\"]\ncommand_loss_h = 0", "command_loss_h is 0, outside 0.01 to 100000"),
            ("", "mode is \"passes\", but stations and own_stations are empty"),
        ] {
            assert!(refused(text).starts_with(wanted), "{text}: {}", refused(text));
        }
        let sim = SimConfig { resources: Some(toml::from_str("").unwrap()), ..SimConfig::default() };
        let error = LinkConfig { mode: LinkMode::Always, ..LinkConfig::default() }.validate(&sim).unwrap_err();
        assert!(error.to_string().starts_with("strip_bits is 200000000, but with [resources]"), "{error}");
        let mode = toml::from_str::<LinkConfig>("command_loss_mode = \"sleep\"").unwrap_err().to_string();
        assert!(mode.contains("unknown variant `sleep`, expected `hold` or `continue`"), "{mode}");
        assert!(toml::from_str::<LinkConfig>("station = 1").unwrap_err().to_string().contains("unknown field"));
    }

    #[test]
    fn stations_of_the_catalogue_get_the_mask_and_one_that_is_never_seen_is_named() {
        let link: LinkConfig =
            toml::from_str("stations = [\"svalbard\", \"weilheim\"]\nmask_deg = 5.0\nuplink_bps = 4000").unwrap();
        link.validate(&SimConfig::default()).unwrap();
        assert!(link.all_stations().unwrap().iter().all(|station| station.mask_deg == 5.0));
        let unseen = link.never_seen(&SimConfig::default()).unwrap();
        assert_eq!(unseen.len(), 1);
        assert!(
            unseen[0].to_string().starts_with("station svalbard at latitude 78.2° never sees the satellite above 5°")
        );
        LinkConfig { mode: LinkMode::Always, ..LinkConfig::default() }.validate(&SimConfig::default()).unwrap();
    }
}
