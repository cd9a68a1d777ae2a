//! Reference systems by name: places are longitudes and latitudes of WGS 84, and nothing else is taken for them.

use super::error::FormatError;

/// Codes of WGS 84 and of its longitudes and latitudes.
const CODES: [&str; 4] = ["CRS84", "CRS84h", "4326", "4979"];
/// Names of WGS 84 in well-known text, without what is no letter or digit.
const NAMES: [&str; 4] = ["gcswgs1984", "wgs84", "wgs1984", "wgs84crs84"];

/// Takes WGS 84 by its code, alone or at the end of a name such as `urn:ogc:def:crs:OGC:1.3:CRS84`.
pub(super) fn by_code(name: &str) -> Result<(), FormatError> {
    let code = name.rsplit([':', '/']).next().unwrap_or_default();
    if CODES.contains(&code) { Ok(()) } else { Err(FormatError::Crs { crs: name.to_owned() }) }
}

/// Takes WGS 84 by well-known text of a reference system, in any of its versions.
pub(super) fn by_text(text: &str) -> Result<(), FormatError> {
    let name = text.split('"').nth(1).unwrap_or_else(|| text.trim());
    let letters: String = name.chars().filter(|it| it.is_alphanumeric()).collect::<String>().to_lowercase();
    let geographic = ["GEOG", "GEODCRS", "GEODETICCRS"].iter().any(|word| text.trim_start().starts_with(word));
    if geographic && NAMES.contains(&letters.as_str()) {
        return Ok(());
    }
    Err(FormatError::Crs { crs: name.chars().take(100).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_wgs_84_is_taken_for_it() {
        for name in ["EPSG:4326", "urn:ogc:def:crs:OGC:1.3:CRS84", "http://www.opengis.net/def/crs/OGC/0/CRS84"] {
            assert!(by_code(name).is_ok(), "{name}");
        }
        assert!(by_code("EPSG:32632").unwrap_err().to_string().starts_with("is in EPSG:32632: convert it"));
        let esri = r#"GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]]]"#;
        for text in [esri, r#"GEOGCRS["WGS 84",ENSEMBLE["#, r#"GEODCRS["WGS 84 (CRS84)","#] {
            assert!(by_text(text).is_ok(), "{text}");
        }
        let projected = r#"PROJCS["WGS_1984_UTM_Zone_32N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984"]]]"#;
        assert!(by_text(projected).unwrap_err().to_string().starts_with("is in WGS_1984_UTM_Zone_32N: convert it"));
        for text in [r#"GEOGCS["GCS_North_American_1983",DATUM["#, r#"PROJCS["WGS 84","#, "", "wgs84"] {
            assert!(by_text(text).is_err(), "{text}");
        }
    }
}
