//! Orbit and attitude in the messages that flight dynamics exchanges: CCSDS OEM (502.0-B-2) and AEM (504.0-B-1), KVN.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use swath_mission::time_text;

use super::track::{Track, TrackPoint};
use crate::debrief::recorded::Recorded;

/// The frame that turns with the Earth. The simulation's inertial frame is one of its own, fixed at the mission's epoch.
const FRAME: &str = "ITRF2000";
/// Degrees of the polynomials with which readers interpolate.
const ORBIT_DEGREE: usize = 7;
const ATTITUDE_DEGREE: usize = 1;

/// Writes `orbit.oem`: position [km] and velocity [km/s] in the frame that turns with the Earth.
///
/// # Errors
/// When it cannot be written.
pub fn write_oem(recorded: &Recorded, track: &Track, folder: &Path) -> Result<()> {
    let mut text = head("OEM", "2.0", recorded, track);
    let degree = degree(ORBIT_DEGREE, track);
    text += &meta(&[
        names(recorded),
        vec![("CENTER_NAME", "EARTH".to_owned()), ("REF_FRAME", FRAME.to_owned())],
        times(recorded, track),
        vec![("INTERPOLATION", "LAGRANGE".to_owned()), ("INTERPOLATION_DEGREE", degree)],
    ]);
    for point in &track.points {
        let (r, v) = (point.r_E / 1e3, point.v_E / 1e3);
        let at = time(recorded, point);
        let _ = writeln!(text, "{at} {:.6} {:.6} {:.6} {:.9} {:.9} {:.9}", r.x, r.y, r.z, v.x, v.y, v.z);
    }
    write(folder, "orbit.oem", &text)
}

/// Writes `attitude.aem`: the quaternion from the frame that turns with the Earth to the body, its scalar last.
///
/// # Errors
/// When it cannot be written.
pub fn write_aem(recorded: &Recorded, track: &Track, folder: &Path) -> Result<()> {
    let mut text = head("AEM", "1.0", recorded, track);
    let word = |key, value: &str| (key, value.to_owned());
    text += &meta(&[
        names(recorded),
        vec![word("REF_FRAME_A", FRAME), word("REF_FRAME_B", "SC_BODY_1"), word("ATTITUDE_DIR", "A2B")],
        times(recorded, track),
        vec![word("ATTITUDE_TYPE", "QUATERNION"), word("QUATERNION_TYPE", "LAST")],
        vec![word("INTERPOLATION_METHOD", "LINEAR"), ("INTERPOLATION_DEGREE", degree(ATTITUDE_DEGREE, track))],
    ]);
    text += "DATA_START\n";
    for point in &track.points {
        // The rotation of A's axes into B's, which takes body components to those in A.
        let q = &point.attitude_E;
        let _ = writeln!(text, "{} {:.12} {:.12} {:.12} {:.12}", time(recorded, point), q.i, q.j, q.k, q.w);
    }
    text += "DATA_STOP\n";
    write(folder, "attitude.aem", &text)
}

type Lines = Vec<(&'static str, String)>;

/// The date of creation is the mission's end: what is made of a recording is the same whenever it is made.
fn head(kind: &str, version: &str, recorded: &Recorded, track: &Track) -> String {
    let created = track.points.last().map_or_else(String::new, |it| time(recorded, it));
    let name = &recorded.mission.name;
    format!(
        "CCSDS_{kind}_VERS = {version}\nCOMMENT simulated mission {name}\nCREATION_DATE = {created}\n\
         ORIGINATOR = SWATH\n\n"
    )
}

fn meta(parts: &[Lines]) -> String {
    let lines = parts.iter().flatten().map(|(key, value)| format!("{key} = {value}\n"));
    format!("META_START\n{}META_STOP\n\n", lines.collect::<String>())
}

fn names(recorded: &Recorded) -> Lines {
    let name = recorded.mission.name.to_uppercase();
    vec![("OBJECT_NAME", name.clone()), ("OBJECT_ID", name)]
}

fn times(recorded: &Recorded, track: &Track) -> Lines {
    let at = |point: Option<&TrackPoint>| point.map_or_else(String::new, |it| time(recorded, it));
    let (start, stop) = (at(track.points.first()), at(track.points.last()));
    vec![("TIME_SYSTEM", "UTC".to_owned()), ("START_TIME", start), ("STOP_TIME", stop)]
}

/// The degree of an interpolation, which needs more points than that.
fn degree(usual: usize, track: &Track) -> String {
    usual.min(track.points.len().saturating_sub(1)).max(1).to_string()
}

/// Simulated UTC to the microsecond, without the letter that CCSDS leaves out.
fn time(recorded: &Recorded, point: &TrackPoint) -> String {
    let epoch = u64::from(recorded.mission.epoch_unix_s) * 1_000_000_000;
    let text = time_text::format(epoch.saturating_add((point.time_s * 1e9).round() as u64));
    text.trim_end_matches('Z').to_owned()
}

fn write(folder: &Path, name: &str, text: &str) -> Result<()> {
    let path = folder.join(name);
    fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
}
