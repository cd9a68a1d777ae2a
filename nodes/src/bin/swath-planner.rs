//! The planner node; see `swath_nodes::planner`.

fn main() -> std::process::ExitCode {
    swath_nodes::node::exit_code(swath_nodes::planner::wiring::run(|spec, seed| {
        Ok(swath_training::planners::make(spec, seed)?)
    }))
}
