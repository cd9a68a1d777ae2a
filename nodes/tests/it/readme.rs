//! The README's picture of the node graph is the graph table's.

#[test]
fn the_diagram_is_made_from_the_table() {
    let readme = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../README.md")).unwrap();
    let (_, rest) = readme.split_once("<!-- graph -->\n").unwrap();
    let (shown, _) = rest.split_once("<!-- /graph -->").unwrap();
    let expected = format!("```mermaid\n{}```\n\n{}", swath_ros::graph::mermaid(), swath_ros::graph::table());
    assert_eq!(shown, expected, "put the output of `swath graph` between the marks");
}
