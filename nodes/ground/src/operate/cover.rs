//! `swath strips cover`: files become strips without a mission.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use swath_node::out;

use super::files::{CuttingArgs, Files, cut_json, cut_text, write_file};

/// `swath strips cover`.
#[derive(Debug, Args)]
pub struct CoverArgs {
    /// Files with lines and areas, `-` for standard input
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Write the strips to this file, as GeoJSON
    #[arg(short, long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    cutting: CuttingArgs,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
}

/// Follows lines and covers areas, and says how well.
///
/// # Errors
/// When a file cannot be used, the strips cannot be written, or something is no strip.
pub fn cover(args: &CoverArgs) -> Result<()> {
    let cutting = args.cutting.usual()?;
    let import = Files::read(&args.files)?.cut(&cutting);
    if let Some(path) = &args.out {
        write_file(path, &import)?;
    }
    let to_stdout = args.out.as_ref().is_some_and(|path| path.as_os_str() == "-");
    if args.json {
        let report = serde_json::json!({
            "shapes": import.shapes, "strips": import.orders.len(), "cut": cut_json(&import.cut),
            "refused": import.refused.iter().map(ToString::to_string).collect::<Vec<_>>(),
        });
        out::print_line(report)?;
    } else if !to_stdout {
        out::print_line(format_args!(
            "{}{} lines and areas: {} strips",
            cut_text(&import.cut),
            import.shapes,
            import.orders.len()
        ))?;
    }
    match import.refused.len() {
        0 => Ok(()),
        refused => bail!("{refused} parts are no strips"),
    }
}
