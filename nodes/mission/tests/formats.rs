//! The same lines and areas in every format that is read are the same strips.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::path::{Path, PathBuf};

use rand::{RngExt as _, SeedableRng as _};
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::orders::formats::{self, Source};
use swath_mission::orders::found::Import;
use swath_mission::orders::import::{import, import_features};
use swath_sim::config::SimConfig;

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats").join(name)
}

fn cutting() -> Cutting {
    Cutting::of(&SimConfig::default())
}

fn read(name: &str) -> Import {
    import(&path(name), &cutting()).unwrap()
}

fn damaged(name: &str, damage: impl FnOnce(&mut Source)) -> Result<Import, String> {
    let bytes = |name: String| std::fs::read(path(&name)).ok();
    let stem = name.split('.').next().unwrap();
    let mut source = Source::alone(name, bytes(name.to_owned()).unwrap());
    source.beside.table = bytes(format!("{stem}.dbf"));
    damage(&mut source);
    let features = formats::read(&source).map_err(|error| error.to_string())?;
    Ok(import_features(features, Path::new(name), &cutting()))
}

#[test]
fn what_ogr2ogr_makes_of_a_file_is_the_same_strips() {
    for name in ["lines", "areas"] {
        let expected = read(&format!("{name}.geojson"));
        assert_eq!(expected.refused, []);
        assert!(expected.orders.len() > 7, "{}", expected.orders.len());
        for format in ["geojsons", "kml", "csv", "shp", "fgb", "gpkg"] {
            let found = read(&format!("{name}.{format}"));
            assert_eq!(common::difference(&found, &expected, true), None, "{name}.{format}");
        }
    }
    // GPX knows names alone.
    assert_eq!(common::difference(&read("lines.gpx"), &read("lines.geojson"), false), None);
    let orders = read("lines.shp").orders;
    let parana = orders.iter().find(|order| order.name.starts_with("Río Paraná")).unwrap();
    assert_eq!((parana.max_attempts, parana.request.acquisition_speed_m_s), (3, 2500.5), "names of ten letters");
    assert_eq!(parana.valid_from_ns, 1_767_225_600_000_000_000);
}

#[test]
fn what_lies_beside_a_file_counts() {
    let with_prj = |text: &str| damaged("lines.shp", |it| it.beside.reference_system = Some(text.into()));
    let error = with_prj(r#"PROJCS["WGS_1984_UTM_Zone_32N",GEOGCS["GCS_WGS_1984","#).unwrap_err();
    assert!(error.starts_with("is in WGS_1984_UTM_Zone_32N: convert it with `ogr2ogr"), "{error}");
    assert!(with_prj(r#"GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984""#).is_ok());
    let bare = damaged("lines.shp", |it| it.beside.table = None).unwrap();
    assert!(bare.refused.is_empty() && bare.orders[0].name.starts_with("lines-1"), "{:?}", bare.orders[0]);
    // A row that is deleted takes its shape with it.
    let deleted = damaged("lines.shp", |it| {
        let table = it.beside.table.as_mut().unwrap();
        let first = usize::from(u16::from_le_bytes([table[8], table[9]]));
        table[first] = b'*';
    });
    let deleted = deleted.unwrap();
    assert!(deleted.refused.is_empty() && deleted.orders[0].name.starts_with("Faults in two"), "{deleted:?}");
    let error = damaged("lines.gpkg", |it| it.beside.log = Some(vec![0; 32])).unwrap_err();
    assert!(error.contains("another program has it open"), "{error}");
    for name in ["lines.shx", "lines.dbf"] {
        let error = damaged("lines.shp", |it| it.path = name.into()).unwrap_err();
        assert_eq!(error, "belongs to a Shapefile: the .shp beside it is read");
    }
}

#[test]
fn one_bad_record_costs_itself() {
    let whole = read("lines.shp").orders.len();
    // The type of the second shape becomes one that nobody knows.
    let damaged_shape = damaged("lines.shp", |it| {
        let words = i32::from_be_bytes(it.bytes[104..108].try_into().unwrap());
        let second = 100 + 8 + usize::try_from(2 * words).unwrap();
        it.bytes[second + 8] = 99;
    });
    let import = damaged_shape.unwrap();
    assert_eq!(import.refused.len(), 1, "{:?}", import.refused);
    assert!(import.refused[0].to_string().contains("feature 2:"), "{}", import.refused[0]);
    assert!(!import.orders.is_empty() && import.orders.len() < whole);
    let torn = damaged("lines.fgb", |it| it.bytes.truncate(it.bytes.len() - 40)).unwrap();
    assert!(torn.refused[0].reason.contains("ends in the middle") && !torn.orders.is_empty(), "{torn:?}");
}

#[test]
fn other_reference_systems_are_refused_by_name_in_every_format() {
    let error = damaged("lines.gpkg", |it| {
        // The table's reference system becomes another one that the file knows.
        let database = swath_gpkg::rusqlite::Connection::open(path("lines.gpkg")).unwrap();
        let mut copy = swath_gpkg::rusqlite::Connection::open_in_memory().unwrap();
        swath_gpkg::rusqlite::backup::Backup::new(&database, &mut copy).unwrap().step(-1).unwrap();
        copy.execute_batch("UPDATE gpkg_geometry_columns SET srs_id = -1").unwrap();
        it.bytes = copy.serialize("main").unwrap().to_vec();
    });
    assert!(error.unwrap_err().starts_with("is in NONE:-1 (Undefined Cartesian SRS): convert it"));
    let error = damaged("lines.fgb", |it| {
        let code = 4326_i32.to_le_bytes();
        let at = it.bytes.windows(4).position(|four| four == code).unwrap();
        it.bytes[at..at + 4].copy_from_slice(&32_632_i32.to_le_bytes());
    });
    assert!(error.unwrap_err().starts_with("is in EPSG:32632: convert it"));
}

#[test]
fn damaged_files_are_refused_or_read_and_nothing_panics() {
    let mut rng = rand::rngs::StdRng::seed_from_u64(7);
    let mut whole = 0;
    for name in ["lines.shp", "lines.fgb", "lines.gpkg", "areas.shp", "areas.fgb", "areas.gpkg"] {
        for _ in 0..500 {
            let changes = rng.random_range(1..4);
            let found = damaged(name, |source| {
                let table = source.beside.table.as_mut().filter(|_| changes == 2);
                let bytes = table.unwrap_or(&mut source.bytes);
                for _ in 0..changes {
                    // Half of the changes in the first bytes, where counts and types stand.
                    let end = if rng.random_bool(0.5) { 200 } else { bytes.len() };
                    let at = rng.random_range(0..end.min(bytes.len()));
                    bytes[at] = rng.random_range(0..=255);
                }
                if rng.random_bool(0.1) {
                    bytes.truncate(rng.random_range(0..bytes.len()));
                }
            });
            whole += usize::from(found.is_ok_and(|import| import.refused.is_empty()));
        }
    }
    assert!(whole > 300, "only {whole} were still whole");
}
