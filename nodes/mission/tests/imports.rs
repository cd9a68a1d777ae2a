//! Files of requests as people bring them: what is read, what is refused and how it is told.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;

use rand::{RngExt as _, SeedableRng as _};
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::orders::formats::{self, Source};
use swath_mission::orders::found::{Import, Shown};
use swath_mission::orders::import::import_features;
use swath_mission::orders::order::Order;
use swath_mission::orders::short_lines::ShortLines;
use swath_mission::shapes::cover_area::shows;
use swath_mission::shapes::sphere::{Arc, direction};
use swath_sim::config::SimConfig;

const KML: &str = r#"<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document><Folder><Placemark id="k">
    <name>x</name><ExtendedData><Data name="priority"><value>0.7</value></Data></ExtendedData>
    <LineString><coordinates>10,45,0 12,46,0</coordinates></LineString></Placemark></Folder></Document></kml>"#;
const GPX: &str = r#"<?xml version="1.0"?><gpx version="1.1" creator="c"><trk><name>x</name><trkseg>
    <trkpt lat="45" lon="10"/><trkpt lat="46" lon="12"/></trkseg></trk></gpx>"#;
const GEOJSON: &str = r#"{"type":"Feature","properties":{"name":"x"},
    "geometry":{"type":"LineString","coordinates":[[10,45],[12,46]]}}"#;
const CSV: &str = "name,start_lat,start_lon,end_lat,end_lon\nx,45,10,46,12\n";

fn try_read(name: &str, bytes: &[u8]) -> Result<Import, String> {
    let features = formats::read(&Source::alone(name, bytes)).map_err(|error| error.to_string())?;
    Ok(import_features(features, Path::new(name), &Cutting::of(&SimConfig::default())))
}

fn read(name: &str, text: &str) -> Import {
    try_read(name, text.as_bytes()).unwrap()
}

/// Orders of a text in which nothing is refused.
fn orders(name: &str, text: &str) -> Vec<Order> {
    let import = read(name, text);
    assert_eq!(import.refused, []);
    import.orders
}

fn faults(name: &str, text: &str) -> Vec<String> {
    read(name, text).refused.iter().map(ToString::to_string).collect()
}

fn collection(features: &str) -> String {
    format!(r#"{{"type":"FeatureCollection","features":[{features}]}}"#)
}

#[test]
fn the_same_line_in_every_format_is_the_same_strip() {
    let [expected] = &orders("a.geojson", GEOJSON)[..] else { panic!("one strip") };
    let texts = [
        ("b.geojsons", format!("\u{1e}{}\n", GEOJSON.replace('\n', " "))),
        ("bom.geojson", format!("\u{feff}{GEOJSON}")),
        ("d.kml", KML.to_owned()),
        ("e.gpx", GPX.to_owned()),
        ("f.wkt", "LINESTRING(10 45, 12 46)\n".to_owned()),
        ("g.wkt", "SRID=4326;MULTILINESTRING Z ((10 45 0, 12 46 0))".to_owned()),
        ("h.csv", CSV.to_owned()),
        ("i.csv", "name;WKT\nx;\"LINESTRING (10 45, 12 46)\"\n".to_owned()),
        ("-", collection(GEOJSON)),
    ];
    for (name, text) in texts {
        let [order] = &orders(name, &text)[..] else { panic!("{name}: one strip") };
        let place = |order: &Order| {
            let it = &order.request;
            [it.start_longitude_deg, it.start_latitude_deg, it.end_longitude_deg, it.end_latitude_deg]
        };
        assert_eq!(place(order), place(expected), "{name}");
    }
    let kml = &orders("d.kml", KML)[0];
    assert_eq!((kml.request.priority, kml.client_ref.as_str(), kml.name.as_str()), (0.7, "k", "x"));
}

#[test]
fn sequences_and_lines_of_geojson_are_many_features() {
    let one = GEOJSON.replace('\n', " ");
    assert_eq!(orders("a.geojsonl", &format!("{one}\n{}\n", one.replace("12,46", "13,46"))).len(), 2);
    assert_eq!(orders("a.geojsons", &format!("\u{1e}{one}\n\u{1e}{}", one.replace("12,46", "13,46"))).len(), 2);
}

#[test]
fn a_collection_of_geometries_is_one_feature_of_several_parts() {
    let text = r#"{"type":"Feature","properties":{"name":"n","client_ref":"r"},"geometry":{"type":"GeometryCollection",
        "geometries":[{"type":"LineString","coordinates":[[10,45],[12,46]]},{"type":"Point","coordinates":[1,2]},
        {"type":"MultiLineString","coordinates":[[[20,45],[22,46]]]}]}}"#;
    let import = read("c.geojson", text);
    let names: Vec<_> = import.orders.iter().map(|order| (order.name.as_str(), order.client_ref.as_str())).collect();
    assert_eq!(names, [("n 1", "r 1"), ("n 3", "r 3")]);
    assert_eq!(
        import.refused[0].to_string(),
        "requests c.geojson, feature 1, part 2: a Point is no strip: expected a line or an area"
    );
}

#[test]
fn what_is_null_is_unset_and_numbers_are_names() {
    let text = r#"{"type":"Feature","id":17,"properties":{"NAME":42,"priority":null,"bidirectional":null,
        "max_attempts":null},"geometry":{"type":"LineString","coordinates":[[10,45],[12,46]]}}"#;
    let [order] = &orders("a.geojson", text)[..] else { panic!("one strip") };
    assert_eq!((order.name.as_str(), order.client_ref.as_str()), ("42", "17"));
    assert_eq!((order.request.priority, order.request.bidirectional, order.max_attempts), (0.5, false, 0));
}

#[test]
fn other_reference_systems_are_refused_by_name() {
    let with = |name: &str| {
        let crs = format!(r#""crs":{{"type":"name","properties":{{"name":"{name}"}}}},"features""#);
        try_read("a.geojson", collection(GEOJSON).replace(r#""features""#, &crs).as_bytes())
    };
    let error = with("urn:ogc:def:crs:EPSG::3857").unwrap_err();
    assert_eq!(error, "is in urn:ogc:def:crs:EPSG::3857: convert it with `ogr2ogr -t_srs EPSG:4326 OUT.geojson IN`");
    assert_eq!(with("urn:ogc:def:crs:OGC:1.3:CRS84").unwrap().orders.len(), 1);
    assert_eq!(with("EPSG:4326").unwrap().orders.len(), 1);
    let error = try_read("a.wkt", b"SRID=32632;LINESTRING(10 45, 12 46)").unwrap_err();
    assert!(error.contains("SRID=32632"), "{error}");
}

#[test]
fn formats_that_are_not_read_are_named_with_what_converts_them() {
    for (begin, format) in [
        (&b"SQLite format 3\0"[..], "a SQLite file that is no GeoPackage"),
        (b"PK\x03\x04", "a ZIP archive, such as KMZ or a packed Shapefile"),
        (b"\x1f\x8b\x08", "compressed by gzip"),
        (b"PAR1", "GeoParquet"),
        (b"!table\n!version 300", "MapInfo TAB"),
        (b"{\"type\":\"Topology\",\"arcs\":[]}", "TopoJSON"),
        (b"{\"geometryType\":\"esriGeometryPolyline\",\"features\":[]}", "Esri JSON"),
        (b"<?xml version=\"1.0\"?><osm version=\"0.6\"></osm>", "OpenStreetMap XML"),
        (b"<gml:FeatureCollection xmlns:gml=\"http://www.opengis.net/gml\"/>", "GML"),
    ] {
        let error = try_read("a.bin", begin).unwrap_err();
        assert!(error.contains(format) && error.contains("ogr2ogr"), "{error}");
    }
    for begin in [&b"fgb\x03fgb\0"[..], b"fgb\x09fgb\0\0\0"] {
        let error = try_read("a.fgb", begin).unwrap_err();
        assert!(error.starts_with("is not FlatGeobuf: it "), "{error}");
    }
    assert!(try_read("a.txt", b"once upon a time").unwrap_err().contains("of no format that is known"));
    assert!(try_read("a.geojson", b"once upon a time").unwrap_err().contains("is not GeoJSON"));
    assert!(try_read("a.kml", b"<kml><Document>").unwrap_err().contains("is not KML"));
    assert!(try_read("a.csv", b"name,where\nx,there\n").unwrap_err().contains("it needs a column `wkt`"));
}

#[test]
fn one_bad_part_costs_itself_and_all_faults_are_told() {
    let features = [
        GEOJSON,
        r#"{"type":"Feature","properties":{},"geometry":{"type":"LineString","coordinates":[[1,2],["three",4]]}}"#,
        r#"{"type":"Feature","properties":{"priority":"high"},"geometry":{"type":"LineString","coordinates":[[1,2],[3,4]]}}"#,
        r#"{"type":"Feature","properties":{},"geometry":{"type":"MultiLineString","coordinates":[[[1,2]],[[1,2],[3,4]]]}}"#,
        r#"{"type":"Feature","properties":{},"geometry":null}"#,
        r#"{"type":"Feature","properties":{},"geometry":{"type":"Polygon","coordinates":[[[1,95],[2,2],[3,4],[1,95]]]}}"#,
    ];
    let text = collection(&features.join(","));
    assert_eq!(read("f.geojson", &text).orders.len(), 2);
    let faults = faults("f.geojson", &text);
    assert_eq!(faults.len(), 5, "{faults:?}");
    for (fault, expected) in faults.iter().zip([
        "feature 2:",
        "feature 3: `priority` must be a number",
        "feature 4, part 1: a line needs two points",
        "feature 5: it has no geometry",
        "feature 6: 1, 95 is no longitude and latitude",
    ]) {
        assert!(fault.contains(expected), "{fault} lacks {expected}");
    }
}

#[test]
fn whole_circles_work_and_antipodal_neighbours_are_refused_alone() {
    let line = |coordinates: &str| format!(r#"{{"type":"LineString","coordinates":{coordinates}}}"#);
    let equator = orders("equator.geojson", &line("[[-180,0],[0,0],[180,0]]"));
    assert_eq!(equator.len(), 81);
    for (one, next) in equator.iter().zip(&equator[1..]) {
        let turned = (next.request.start_longitude_deg - one.request.end_longitude_deg).rem_euclid(360.0);
        assert!(turned.min(360.0 - turned) < 1e-9, "{turned}");
        let ahead = (one.request.end_longitude_deg - one.request.start_longitude_deg).rem_euclid(360.0);
        assert!(ahead < 4.6, "eastward: {ahead}");
    }
    let parallel = orders("parallel.geojson", &line("[[-180,60],[-90,60],[0,60],[90,60],[180,60]]"));
    assert!(parallel.iter().all(|order| (order.request.end_latitude_deg - 60.0).abs() < 0.06));
    assert_eq!(orders("meridian.geojson", &line("[[10,-90],[10,90]]")).len(), 41);
    let import = read("antipodal3.geojson", &line("[[0,0],[180,0],[180,10]]"));
    assert_eq!(import.orders.len(), 3);
    assert!(import.refused[0].reason.contains("antipodal"), "{:?}", import.refused);
    let beyond = &orders("beyond.geojson", &line("[[370,0],[372,0]]"))[0].request;
    assert_eq!((beyond.start_longitude_deg, beyond.end_longitude_deg), (10.0, 12.0));
}

#[test]
fn an_area_is_one_order_whose_strips_share_its_worth() {
    let text = r#"{"type":"Feature","properties":{"name":"lake","client_ref":"lake","priority":0.8},"geometry":
        {"type":"MultiPolygon","coordinates":[[[[0,0],[1,0],[1,1],[0,1],[0,0]],[[0.4,0.4],[0.6,0.4],[0.6,0.6],[0.4,0.6],[0.4,0.4]]],
        [[[2,0],[2.5,0],[2.5,0.5],[2,0]]]]}}"#;
    let import = read("lake.geojson", text);
    let [cut] = &import.cut[..] else { panic!("{:?}", import.cut) };
    let Shown::Area { square_km, covered, twice } = cut.shown else { panic!("{cut:?}") };
    let degree_km = 111.3_f64;
    let expected = degree_km * degree_km * (1.0 - 0.04 + 0.125);
    assert!((square_km / expected - 1.0).abs() < 0.01, "{square_km} {expected}");
    assert!(covered > 0.99 && twice < 0.15, "{covered} {twice}");
    let worth: f64 = import.orders.iter().map(|order| order.request.priority).sum();
    assert!((worth - 0.8 * covered).abs() < 1e-9, "{worth}");
    let count = import.orders.len();
    assert_eq!(import.orders[0].client_ref, format!("lake 1/{count}"));
}

#[test]
fn identity_does_not_hang_on_position_or_file_name() {
    let second = GEOJSON.replace("12,46", "13,46");
    let before: Vec<_> = orders("lines.geojson", &collection(&format!("{GEOJSON},{second}")));
    let inserted = GEOJSON.replace("12,46", "11,46");
    let after = orders("other.geojson", &collection(&format!("{inserted},{GEOJSON},{second}")));
    let references = |orders: &[Order]| orders.iter().map(|order| order.client_ref.clone()).collect::<Vec<_>>();
    assert_eq!(references(&before), references(&after[1..]));
    assert_ne!(before[0].client_ref, after[0].client_ref);
    let other = GEOJSON.replace(r#""name":"x""#, r#""name":"x","priority":0.6"#);
    assert_ne!(orders("lines.geojson", &other)[0].client_ref, before[0].client_ref, "conditions are part of it");
}

#[test]
fn short_lines_are_stretched_if_that_is_wanted() {
    let text = r#"{"type":"LineString","coordinates":[[10,0],[10.1,0]]}"#;
    let features = || formats::read(&Source::alone("short.geojson", text)).unwrap();
    let cutting = Cutting::of(&SimConfig::default());
    let import = import_features(
        features(),
        Path::new("short.geojson"),
        &Cutting { short_lines: ShortLines::Stretch, ..cutting },
    );
    let config = SimConfig::default();
    import.orders[0].request.to_strip(&config.requests, config.earth.radius_m).unwrap();
    let as_it_is = import_features(features(), Path::new("short.geojson"), &cutting);
    assert!(as_it_is.orders[0].request.to_strip(&config.requests, config.earth.radius_m).is_err());
}

#[test]
fn damaged_files_of_every_format_are_refused_or_read_and_nothing_panics() {
    let area = r#"{"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0,0]]]}"#;
    let seeds: [(&str, Vec<u8>); 7] = [
        ("a.geojson", GEOJSON.into()),
        ("a.geojson", area.into()),
        ("a.kml", KML.into()),
        ("a.gpx", GPX.into()),
        ("a.wkt", b"POLYGON((0 0, 1 0, 1 1, 0 0))".into()),
        ("a.csv", CSV.into()),
        ("a.csv", b"name,wkt\nx,\"LINESTRING(10 45, 12 46)\"\n".into()),
    ];
    let mut rng = rand::rngs::StdRng::seed_from_u64(5);
    let mut read = 0;
    for (name, seed) in &seeds {
        for _ in 0..4000 {
            let mut bytes = seed.clone();
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..bytes.len());
                match rng.random_range(0..4) {
                    0 => bytes[at] = rng.random_range(0..=255),
                    1 => bytes.truncate(at + 1),
                    2 => bytes.insert(at, b"0123456789-.e,[]{}<>\"\n "[rng.random_range(0..23)]),
                    _ => drop(bytes.remove(at)),
                }
                if bytes.is_empty() {
                    bytes.push(b'{');
                }
            }
            read += usize::from(try_read(name, &bytes).is_ok());
        }
    }
    assert!(read > 1000, "only {read} were still read");
}

#[test]
fn short_lines_of_a_feature_are_joined_if_it_says_so() {
    let text = |short_lines: &str| {
        format!(
            r#"{{"type":"Feature","properties":{{"name":"f","client_ref":"f"{short_lines}}},"geometry":{{"type":"MultiLineString",
            "coordinates":[[[10,0],[10.1,0]],[[10.1,0],[10.2,0]],[[10.2,0.001],[10.3,0]],[[20,0],[20.1,0]]]}}}}"#
        )
    };
    let lengths = |text: &str| {
        let import = read("f.geojson", text);
        let config = SimConfig::default();
        let allowed = |order: &Order| order.request.to_strip(&config.requests, config.earth.radius_m).is_ok();
        let short = import.cut.iter().filter(|cut| matches!(cut.shown, Shown::Line { too_short: true, .. })).count();
        (import.orders.len(), import.orders.iter().filter(|order| allowed(order)).count(), short)
    };
    assert_eq!(lengths(&text("")), (4, 0, 4));
    assert_eq!(lengths(&text(r#","short_lines":"stretch""#)), (4, 4, 0));
    let joined = text(r#","short_lines":"join""#);
    assert_eq!(lengths(&joined), (2, 2, 0));
    let names: Vec<_> = orders("f.geojson", &joined).iter().map(|order| order.name.clone()).collect();
    assert_eq!(names, ["f 1", "f 4"]);
    let [Shown::Line { length_km, farthest_km, .. }, _] =
        &read("f.geojson", &joined).cut.iter().map(|cut| cut.shown).collect::<Vec<_>>()[..]
    else {
        panic!("two lines")
    };
    assert!((length_km - 33.5).abs() < 0.1 && *farthest_km < 0.2, "{length_km} {farthest_km}");
    let error = &faults("f.geojson", &text(r#","short_lines":"melt""#))[0];
    assert!(error.ends_with("`short_lines`: `melt` is neither `refuse`, `stretch` nor `join`"), "{error}");
}

#[test]
fn areas_lie_along_the_passes_or_a_heading_if_they_say_so() {
    let area = |rows: &str| {
        format!(
            r#"{{"type":"Feature","properties":{{"name":"a"{rows}}},"geometry":{{"type":"Polygon",
            "coordinates":[[[9,29],[11,29],[11,30],[9,30],[9,29]]]}}}}"#
        )
    };
    let headings = |rows: &str| -> Vec<f64> {
        let heading = |order: &Order| {
            let it = &order.request;
            let east = (it.end_longitude_deg - it.start_longitude_deg) * it.start_latitude_deg.to_radians().cos();
            east.atan2(it.end_latitude_deg - it.start_latitude_deg).to_degrees().rem_euclid(180.0)
        };
        orders("a.geojson", &area(rows)).iter().map(heading).collect()
    };
    let fewest = headings("");
    assert!(fewest.iter().all(|heading| (heading - 90.0).abs() < 2.0), "along its longer side: {fewest:?}");
    let passes = headings(r#","rows":"passes""#);
    // The track of an orbit of 45° at 29.5° of latitude, seen from the ground that turns.
    let track = swath_mission::orders::rows::Passes::of(&SimConfig::default()).headings(29.5_f64.to_radians());
    let near = |heading: &f64| track.iter().any(|it| (it.to_degrees().rem_euclid(180.0) - heading).abs() < 2.0);
    assert!(passes.iter().all(near), "{passes:?} {track:?}");
    assert!(passes.len() > fewest.len());
    assert!(headings(r#","rows":20"#).iter().all(|heading| (heading - 20.0).abs() < 2.0));
    let error = &faults("a.geojson", &area(r#","rows":"north""#))[0];
    assert!(error.contains("`rows`: `north` is neither `fewest`, `passes` nor a heading"), "{error}");
}

#[test]
fn an_area_is_the_same_whoever_wrote_it() {
    let area = |coordinates: &str| {
        let text = format!(r#"{{"type":"Polygon","coordinates":{coordinates}}}"#);
        orders("a.geojson", &text)
    };
    let one = area(
        "[[[179,10],[181,10],[181,11.2],[180.2,11.5],[179,11],[179,10]],[[179.5,10.4],[179.9,10.4],[179.7,10.8],[179.5,10.4]]]",
    );
    assert!(one.len() > 8);
    for other in [
        "[[[-179,10],[-179,11.2],[-179.8,11.5],[179,11],[179,10],[-179,10]],[[179.5,10.4],[179.7,10.8],[179.9,10.4],[179.5,10.4]]]",
        "[[[539,11],[539,10],[539,10],[541,10],[541,11.2],[540.2,11.5],[539,11]],[[179.7,10.8],[179.5,10.4],[179.9,10.4],[179.7,10.8]]]",
    ] {
        let other = area(other);
        assert_eq!(other.len(), one.len());
        let same = |(a, b): (&Order, &Order)| a.client_ref == b.client_ref && a.is_for_the_same_as(b);
        assert!(other.iter().zip(&one).all(same), "{other:?}");
    }
}

#[test]
fn one_bad_area_of_several_costs_itself() {
    let text = r#"{"type":"Feature","properties":{"name":"m"},"geometry":{"type":"MultiPolygon","coordinates":[
        [[[0,0],[1,0],[1,0.5],[0,0]]],[[[0,91],[1,0],[1,1],[0,91]]]]}}"#;
    let import = read("m.geojson", text);
    assert!(!import.orders.is_empty());
    let faults: Vec<_> = import.refused.iter().map(ToString::to_string).collect();
    assert_eq!(faults, ["requests m.geojson, feature 1, part 2: 0, 91 is no longitude and latitude"]);
}

#[test]
fn a_day_counts_from_its_beginning_to_its_end() {
    let text = GEOJSON
        .replace(r#""name":"x""#, r#""name":"x","valid_from":"2026-01-01","valid_until":"2026/01/02 12:00:00+00""#);
    assert_eq!(orders("d.geojson", &text)[0].validity_ns(), (1_767_225_600_000_000_000, 1_767_355_200_000_000_000));
    let text = GEOJSON.replace(r#""name":"x""#, r#""name":"x","valid_until":"2026-01-01""#);
    assert_eq!(orders("d.geojson", &text)[0].valid_until_ns, 1_767_312_000_000_000_000);
}

#[test]
fn a_continent_is_shown_by_the_strips_that_are_submitted() {
    let text = r#"{"type":"Polygon","coordinates":[[[115,-35],[150,-38],[145,-12],[120,-15],[115,-35]]]}"#;
    let import = read("continent.geojson", text);
    let cutting = Cutting::of(&SimConfig::default());
    let arc = |order: &Order| {
        let it = &order.request;
        let start = direction([it.start_longitude_deg, it.start_latitude_deg]);
        Arc::new(start, direction([it.end_longitude_deg, it.end_latitude_deg])).unwrap()
    };
    let arcs: Vec<_> = import.orders.iter().map(arc).collect();
    let mut rng = rand::rngs::StdRng::seed_from_u64(3);
    let width = cutting.swath_km * 1e3 / cutting.radius_m;
    let shown = (0..2000).filter(|_| {
        let point = direction([rng.random_range(122.0..143.0), rng.random_range(-33.0..-17.0)]);
        arcs.iter().any(|arc| shows(arc, &point, width))
    });
    let share = shown.count() as f64 / 2000.0;
    assert!(share > 0.995, "{share}");
}
