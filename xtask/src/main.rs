//! Set-up and the commands of the README: `cargo xtask setup|test|mission|lint|bench|chaos|wheel|web|soak|ament`.

mod ament;
mod bench;
mod examples;
mod fuzz;
mod libtorch;
mod lint;
mod prerequisites;
mod process;
mod soak;
mod venv;
mod web;
mod wheel;

use std::ffi::OsString;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};

/// What `cargo xtask mission` flies.
const MISSION: &str = "examples/missions/one_orbit.toml";

const USAGE: &str = "\
usage: cargo xtask COMMAND

  setup [--test]   make what is missing: the libtorch view (one download of
                   543 MB), and with --test the Python environment of the tests
  test [ARGS…]     set up, then run every test of the workspace and of the
                   Python package; with ARGS, `cargo test ARGS…` alone
  mission [ARGS…]  set up, build, and fly examples/missions/one_orbit.toml; ARGS
                   go to `swath launch` (--help shows them)
  lint             check format, clippy, licences and sources of dependencies, and
                   that all of them are used; builds the tools that are missing
  bench            run every crate's measurements and print one JSON object
  wheel            build the Python package into target/wheels
  chaos [--first SEED] --seeds N [--over-dds]
                   fly N missions whose faults are drawn from their seeds, in one process
                   or over DDS, check what must hold whatever fails, print one JSON object
                   and, of a failure, the command that repeats it
  soak [NAME [SEEDS]]
                   run a long figure to its end and print it as JSON; one that was
                   stopped goes on; without a name, list them
  web [--picture]  test and build the console's page with npm, from its sources into
                   the files that the program holds; with --picture, take the
                   README's picture of it instead: a test flies the mission
  ament [FOLDER]   build the programs and lay them out as the ROS 2 package `swath`
                   in FOLDER (target/ament), for `ros2 run` and `ros2 launch`
  soak python      run the Python package's long examples; they fetch gigabytes
  soak fuzz [N]    fuzz what comes from outside, each target with N inputs (10 million)
";

fn main() -> ExitCode {
    let args: Vec<OsString> = std::env::args_os().skip(1).collect();
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &[OsString]) -> Result<()> {
    let root = repository_root()?;
    let Some((command, rest)) = args.split_first() else {
        bail!("no command given\n\n{USAGE}");
    };
    match command.to_str() {
        Some("setup") => setup(&root, with_tests(rest)?),
        Some("test") => test(&root, rest),
        Some("mission") => mission(&root, rest),
        Some("lint") => lint(&root, rest),
        Some("bench") => bench(&root, rest),
        Some("wheel") => wheel(&root, rest),
        Some("chaos") => chaos(&root, rest),
        Some("soak") => soak(&root, rest),
        Some("web") => web(&root, rest),
        Some("ament") => ament(&root, rest),
        Some("help" | "--help" | "-h") => {
            eprint!("{USAGE}");
            Ok(())
        }
        _ => bail!("there is no command {}\n\n{USAGE}", command.display()),
    }
}

fn with_tests(args: &[OsString]) -> Result<bool> {
    match args {
        [] => Ok(false),
        [flag] if flag == "--test" => Ok(true),
        _ => bail!("setup takes no argument but --test\n\n{USAGE}"),
    }
}

fn setup(root: &Path, tests: bool) -> Result<()> {
    prerequisites::check()?;
    let _lock = process::lock(root)?;
    libtorch::ensure(root)?;
    if tests {
        venv::ensure(root)?;
    }
    Ok(())
}

/// Runs every test in the release profile: what is tested is what is flown, and one build serves both commands. Programs
/// and examples come first: tests run those of other packages too, which cargo does not build for them.
fn test(root: &Path, args: &[OsString]) -> Result<()> {
    setup(root, true)?;
    process::run(process::cargo(root, "build").args(["--release", "--workspace", "--bins", "--examples"]))?;
    let mut cargo = process::cargo(root, "test");
    cargo.args(["--release", "--workspace"]).args(args);
    cargo.env("SWATH_PYTHON", venv::python(root));
    process::run(&mut cargo)?;
    if !args.is_empty() {
        return Ok(());
    }
    let wheel = wheel::build(root)?;
    wheel::install(root, &wheel)?;
    wheel::test(root, &wheel)
}

fn wheel(root: &Path, args: &[OsString]) -> Result<()> {
    if !args.is_empty() {
        bail!("wheel takes no arguments\n\n{USAGE}");
    }
    python_tools(root)?;
    eprintln!("built {}", wheel::build(root)?.display());
    Ok(())
}

/// What builds a wheel, without libtorch.
fn python_tools(root: &Path) -> Result<()> {
    prerequisites::check()?;
    let _lock = process::lock(root)?;
    venv::ensure(root)
}

/// Builds all nodes and the recorder, then becomes `swath launch`.
fn mission(root: &Path, args: &[OsString]) -> Result<()> {
    setup(root, false)?;
    let packages = ["--package", "swath-nodes", "--package", "swath-bags"];
    process::run(process::cargo(root, "build").args(["--quiet", "--release"]).args(packages).arg("--bins"))?;
    let mut cargo = process::cargo(root, "run");
    cargo.args(["--quiet", "--release", "--package", "swath-nodes"]);
    cargo.args(["--bin", "swath", "--", "launch", MISSION]).args(args);
    Err(process::become_command(&mut cargo))
}

fn bench(root: &Path, args: &[OsString]) -> Result<()> {
    if !args.is_empty() {
        bail!("bench takes no arguments\n\n{USAGE}");
    }
    setup(root, false)?;
    bench::run(root)
}

fn lint(root: &Path, args: &[OsString]) -> Result<()> {
    if !args.is_empty() {
        bail!("lint takes no arguments\n\n{USAGE}");
    }
    setup(root, false)?;
    lint::run(root)
}

/// Missions in one process need neither torch nor Python: for those nothing is set up.
fn chaos(root: &Path, args: &[OsString]) -> Result<()> {
    let (over_dds, words): (Vec<_>, Vec<_>) =
        args.iter().map(|word| word.to_str()).partition(|it| *it == Some("--over-dds"));
    let words: Option<Vec<&str>> = words.into_iter().collect();
    let (first, count) = match words.as_deref() {
        Some(["--seeds", count]) => ("0", *count),
        Some(["--first", first, "--seeds", count] | ["--seeds", count, "--first", first]) => (*first, *count),
        _ => bail!("chaos takes --seeds N, and --first SEED and --over-dds\n\n{USAGE}"),
    };
    for (name, text) in [("--first", first), ("--seeds", count)] {
        text.parse::<u64>().with_context(|| format!("{name} {text} is no whole number"))?;
    }
    let (package, example) = match over_dds.is_empty() {
        true => ("swath-mission", "chaos"),
        false => {
            setup(root, false)?;
            process::run(process::cargo(root, "build").args(["--quiet", "--release", "--workspace", "--bins"]))?;
            ("swath-nodes", "chaos_over_dds")
        }
    };
    let mut cargo = process::cargo(root, "run");
    cargo.args(["--quiet", "--release", "--package", package, "--example", example, "--", first, count]);
    Err(process::become_command(&mut cargo))
}

fn soak(root: &Path, args: &[OsString]) -> Result<()> {
    if args == ["python"] {
        python_tools(root)?;
        return wheel::soak(root);
    }
    if let [name, inputs @ ..] = args
        && name == "fuzz"
    {
        prerequisites::check()?;
        let inputs = match inputs {
            [] => None,
            [inputs] => Some(soak::number(inputs)?),
            _ => bail!("soak fuzz takes a number of inputs\n\n{USAGE}"),
        };
        return fuzz::run(root, inputs);
    }
    setup(root, true)?;
    soak::run(root, args)
}

fn web(root: &Path, args: &[OsString]) -> Result<()> {
    match args {
        [] => web::build(root),
        [flag] if flag == "--picture" => {
            setup(root, true)?;
            web::picture(root, &venv::python(root))
        }
        _ => bail!("web takes nothing but --picture\n\n{USAGE}"),
    }
}

fn ament(root: &Path, args: &[OsString]) -> Result<()> {
    let prefix = match args {
        [] => root.join("target/ament"),
        [folder] => std::path::absolute(folder).with_context(|| format!("there is no {}", folder.display()))?,
        _ => bail!("ament takes one folder\n\n{USAGE}"),
    };
    setup(root, false)?;
    let packages = ["--package", "swath-nodes", "--package", "swath-bags", "--bins"];
    process::run(process::cargo(root, "build").arg("--release").args(packages))?;
    ament::lay_out(root, &root.join("target/release"), &prefix)?;
    let line = format!("export AMENT_PREFIX_PATH={}:$AMENT_PREFIX_PATH", prefix.display());
    writeln!(std::io::stdout(), "{line}").context("cannot say where ROS finds the programs")
}

fn repository_root() -> Result<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    let root = folder.context("the xtask folder has no parent")?;
    if !root.join("Cargo.toml").is_file() {
        bail!("{} holds no Cargo.toml: build xtask again where the repository is now", root.display());
    }
    Ok(root.to_path_buf())
}
