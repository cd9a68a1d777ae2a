//! Keeps files from importing each other, directly or around corners.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Crates in which no two files import each other.
const CRATES: &[&str] = &["sim", "nodes/mission", "nodes/node", "nodes/space", "nodes/ground"];

/// The path of a module within its crate.
type Module = Vec<String>;

/// The modules of a crate, with their product code.
fn modules(folder: &Path, within: &Module, found: &mut BTreeMap<Module, String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let inner = || within.iter().cloned().chain([name.clone()]).collect::<Module>();
        if path.is_dir() {
            modules(&path, &inner(), found);
        } else if path.extension().is_some_and(|it| it == "rs") {
            let module = if ["lib", "mod"].contains(&name.as_str()) { within.clone() } else { inner() };
            let text = fs::read_to_string(&path).unwrap();
            let product = text.split("#[cfg(test)]\nmod tests").next().unwrap();
            let lines = product.lines().map(|line| line.split("//").next().unwrap());
            found.insert(module, lines.collect::<Vec<_>>().join(" "));
        }
    }
}

/// `a::{b, c::{d, e}}` as `a::b`, `a::c::d`, `a::c::e`.
fn spread(path: &str) -> Vec<String> {
    let Some((before, inside)) = path.split_once('{') else { return vec![path.trim().to_owned()] };
    let inside = inside.trim_end().trim_end_matches('}');
    let (mut depth, mut parts) = (0, vec![String::new()]);
    for letter in inside.chars() {
        depth += i32::from(letter == '{') - i32::from(letter == '}');
        if letter == ',' && depth == 0 {
            parts.push(String::new());
        } else {
            parts.last_mut().unwrap().push(letter);
        }
    }
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| spread(part)).map(|part| format!("{}{part}", before.trim())).collect()
}

/// Everything that a module's code names by a path.
fn paths(code: &str) -> Vec<String> {
    let statements = code.split("use ").skip(1).filter_map(|rest| rest.split_once(';'));
    let mut paths: Vec<_> = statements.flat_map(|(statement, _)| spread(statement)).collect();
    let words = code.split(|letter: char| !(letter.is_alphanumeric() || letter == '_' || letter == ':'));
    paths.extend(words.filter(|word| word.contains("::")).map(str::to_owned));
    paths
}

/// The modules that a module imports.
fn imports(module: &Module, code: &str, modules: &BTreeMap<Module, String>) -> BTreeSet<Module> {
    let target = |path: String| {
        let parts: Vec<_> = path.split("::").map(|part| part.trim().to_owned()).collect();
        let ups = parts.iter().take_while(|part| *part == "super").count();
        let (base, rest) = match parts[0].as_str() {
            "crate" => (&[][..], &parts[1..]),
            "self" => (&module[..], &parts[1..]),
            "super" => (module.get(..module.len().checked_sub(ups)?)?, &parts[ups..]),
            first if modules.contains_key(&[module, &[first.to_owned()][..]].concat()) => (&module[..], &parts[..]),
            _ => return None,
        };
        let full = [base, rest].concat();
        (0..=full.len()).rev().map(|length| full[..length].to_vec()).find(|it| modules.contains_key(it))
    };
    paths(code).into_iter().filter_map(target).filter(|it| it != module).collect()
}

#[test]
fn no_two_files_import_each_other() {
    for name in CRATES {
        let mut found = BTreeMap::new();
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name).join("src");
        modules(&folder, &Vec::new(), &mut found);
        let mut left: BTreeMap<_, _> = found.iter().map(|(it, code)| (it.clone(), imports(it, code, &found))).collect();
        assert!(left.values().any(|imports| !imports.is_empty()), "{name}: no import is seen");
        // Whoever imports nothing that is left is on no circle.
        while let Some(free) = left.iter().find(|(_, imports)| !imports.iter().any(|it| left.contains_key(it))) {
            let free = free.0.clone();
            left.remove(&free);
        }
        assert!(left.is_empty(), "{name}: on a circle, or importing one: {:?}", left.keys().collect::<Vec<_>>());
    }
}
