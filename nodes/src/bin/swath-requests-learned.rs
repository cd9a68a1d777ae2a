//! The requests node with the learned policies at hand: in missions with a radio it predicts what one will decide.

fn main() -> std::process::ExitCode {
    swath_node::node::exit_code(swath_ground::requests::wiring::run(&swath_nodes::POLICIES))
}
