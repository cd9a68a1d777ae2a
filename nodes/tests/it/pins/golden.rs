//! Golden files: what was said and written once, and how it differs now.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Lines of a difference that are shown of each side.
const SHOWN: usize = 40;

/// Where the pins lie.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/pins")
}

/// The repository, wherever in it these pins lie.
pub fn repository() -> PathBuf {
    let mut above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    above.find(|folder| folder.join("Cargo.lock").is_file()).unwrap().to_owned()
}

/// Holds a text against the golden file of that name; `SWATH_BLESS=1` writes it anew.
pub fn check(name: &str, text: &str) {
    let path = folder().join("golden").join(name);
    if std::env::var_os("SWATH_BLESS").is_some_and(|value| value == "1") {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
        return;
    }
    let golden = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert!(
        golden == text,
        "golden/{name} differs; if it should, say why in the commit that blesses it with SWATH_BLESS=1\n{}",
        difference(&golden, text)
    );
}

/// The lines between the first and the last that differ.
fn difference(golden: &str, text: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) = (golden.lines().collect(), text.lines().collect());
    let same_ahead = old.iter().zip(&new).take_while(|(old, new)| old == new).count();
    let behind = old.iter().rev().zip(new.iter().rev()).take_while(|(old, new)| old == new).count();
    let same_behind = behind.min(old.len().min(new.len()) - same_ahead);
    let mut told = format!("from line {}:\n", same_ahead + 1);
    for (mark, lines) in [('-', &old), ('+', &new)] {
        let differing = &lines[same_ahead..lines.len() - same_behind];
        for line in differing.iter().take(SHOWN) {
            _ = writeln!(told, "{mark} {line}");
        }
        if differing.len() > SHOWN {
            _ = writeln!(told, "{mark} … {} more lines", differing.len() - SHOWN);
        }
    }
    told
}

#[test]
fn a_difference_shows_the_lines_that_differ() {
    assert_eq!(difference("a\nb\nc\nd", "a\nx\ny\nd"), "from line 2:\n- b\n- c\n+ x\n+ y\n");
    assert_eq!(difference("a\na", "a\na\na"), "from line 3:\n+ a\n");
}
