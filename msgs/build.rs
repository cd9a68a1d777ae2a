//! Generates the Rust types, schema texts and type hashes from the interface files.

#[path = "src/definition/mod.rs"]
#[allow(dead_code, unused_imports, reason = "the generator reads single files only")]
mod definition;
#[path = "build/describe.rs"]
mod describe;
#[path = "build/emit.rs"]
mod emit;
#[path = "build/model.rs"]
mod model;
#[path = "build/parse.rs"]
mod parse;

use std::path::{Path, PathBuf};
use std::{env, fs, io};

use describe::Catalogue;
use model::Service;

fn main() {
    if let Err(error) = generate() {
        eprintln!("error: {error}");
        std::process::exit(1);
    }
}

fn generate() -> Result<(), String> {
    let mut catalogue = Catalogue::new();
    let mut services = Vec::new();
    for (package, folder) in packages()? {
        read_package(&package, &folder, &mut catalogue, &mut services)?;
    }
    let source = emit::source(&catalogue, &services)?;
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set")?);
    fs::write(out.join("interfaces.rs"), source).map_err(|error| error.to_string())?;
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-changed=src/definition");
    for folder in ["msg", "srv", "standard"] {
        println!("cargo::rerun-if-changed={folder}");
    }
    Ok(())
}

/// Our own package and the standard ones, with their folders.
fn packages() -> Result<Vec<(String, PathBuf)>, String> {
    let mut packages = vec![("swath_msgs".to_owned(), PathBuf::from("."))];
    for folder in entries(Path::new("standard"))?.into_iter().filter(|path| path.is_dir()) {
        packages.push((stem(&folder), folder));
    }
    Ok(packages)
}

fn read_package(
    package: &str,
    folder: &Path,
    catalogue: &mut Catalogue,
    services: &mut Vec<Service>,
) -> Result<(), String> {
    for kind in ["msg", "srv"] {
        let folder = folder.join(kind);
        if !folder.is_dir() {
            continue;
        }
        for file in entries(&folder)? {
            let in_file = |error: String| format!("{}: {error}", file.display());
            if file.extension().is_none_or(|extension| extension != kind) {
                return Err(in_file(format!("is not a .{kind} file")));
            }
            let text = fs::read_to_string(&file).map_err(|error| in_file(error.to_string()))?;
            let mut add = |message: model::Message| {
                catalogue.insert(message.type_name(), message);
            };
            if kind == "msg" {
                add(parse::message(package, &stem(&file), &text).map_err(in_file)?);
            } else {
                let service = parse::service(package, &stem(&file), &text).map_err(in_file)?;
                add(service.request.clone());
                add(service.response.clone());
                services.push(service);
            }
        }
    }
    Ok(())
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let read =
        || -> io::Result<Vec<PathBuf>> { fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path())).collect() };
    let mut paths = read().map_err(|error| format!("{}: {error}", folder.display()))?;
    paths.sort();
    Ok(paths)
}

fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}
