//! The programs as a ROS 2 package, so that `ros2 run` and `ros2 launch` find them.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use anyhow::{Context, Result};

/// Name of the package.
const PACKAGE: &str = "swath";

/// The programs of the package, as cargo builds them.
const PROGRAMS: &[&str] = &[
    "swath",
    "swath-bag",
    "swath-catalogue",
    "swath-console",
    "swath-guidance",
    "swath-link",
    "swath-planner",
    "swath-requests",
    "swath-requests-learned",
    "swath-spacecraft",
];

/// Lays out the folder `prefix` as ament has it: programs as links to those in `programs`, everything else copied from
/// the repository `root`.
///
/// # Errors
/// When a program has not been built, or a file cannot be written.
pub fn lay_out(root: &Path, programs: &Path, prefix: &Path) -> Result<()> {
    let index = prefix.join("share/ament_index/resource_index/packages");
    let (share, lib) = (prefix.join("share").join(PACKAGE), prefix.join("lib").join(PACKAGE));
    for folder in [&index, &share.join("launch"), &lib] {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let marker = index.join(PACKAGE);
    fs::write(&marker, "").with_context(|| format!("cannot write {}", marker.display()))?;
    copy(&root.join("nodes/package.xml"), &share.join("package.xml"))?;
    copy(&root.join("nodes/launch/swath.launch.py"), &share.join("launch/swath.launch.py"))?;
    for name in PROGRAMS {
        let (program, link) = (programs.join(name), lib.join(name));
        let program = program.canonicalize().with_context(|| format!("there is no {}", program.display()))?;
        if link.is_symlink() {
            fs::remove_file(&link).with_context(|| format!("cannot replace {}", link.display()))?;
        }
        symlink(program, &link).with_context(|| format!("cannot make {}", link.display()))?;
    }
    Ok(())
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::copy(from, to).with_context(|| format!("cannot copy {} to {}", from.display(), to.display()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prefix_has_what_ament_looks_for_and_can_be_laid_out_again() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let temp = tempfile::tempdir().unwrap();
        let (programs, prefix) = (temp.path().join("release"), temp.path().join("prefix"));
        fs::create_dir(&programs).unwrap();
        let missing = lay_out(root, &programs, &prefix).unwrap_err().to_string();
        assert!(missing.starts_with("there is no ") && missing.ends_with("release/swath"), "{missing}");
        for name in PROGRAMS {
            fs::write(programs.join(name), name).unwrap();
        }
        for _ in 0..2 {
            lay_out(root, &programs, &prefix).unwrap();
            for name in PROGRAMS {
                assert_eq!(fs::read_to_string(prefix.join("lib/swath").join(name)).unwrap(), *name);
            }
        }
        assert!(prefix.join("share/ament_index/resource_index/packages/swath").is_file());
        assert!(prefix.join("share/swath/launch/swath.launch.py").is_file());
        let package = fs::read_to_string(prefix.join("share/swath/package.xml")).unwrap();
        assert!(package.contains("<name>swath</name>"), "{package}");
    }
}
