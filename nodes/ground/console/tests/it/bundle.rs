//! The bundle in `web/dist` is built from the sources beside it: `cargo xtask web` builds it.

use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

/// As in `web/vite.config.ts`.
const SOURCES: [&str; 5] = ["index.html", "package-lock.json", "package.json", "tsconfig.json", "vite.config.ts"];

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

#[test]
fn the_bundle_is_of_these_sources() {
    let web = Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
    let mut sources = files(&web.join("src"));
    sources.extend(files(&web.join("public")));
    sources.extend(SOURCES.map(|name| web.join(name)));
    let mut names: Vec<_> =
        sources.iter().map(|path| path.strip_prefix(&web).unwrap().to_str().unwrap().to_owned()).collect();
    names.sort();
    let mut hash = Sha256::new();
    for name in names {
        hash.update(format!("{name}\n"));
        hash.update(std::fs::read(web.join(&name)).unwrap());
    }
    let digest = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let built = std::fs::read_to_string(web.join("dist/SOURCES")).unwrap();
    assert_eq!(built.trim(), digest, "web/dist is of other sources: cargo xtask web");
}
