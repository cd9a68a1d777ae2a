//! The planner node; see `swath_space::planner`.

fn main() -> std::process::ExitCode {
    swath_node::node::exit_code(swath_space::planner::wiring::run(&swath_nodes::POLICIES))
}
