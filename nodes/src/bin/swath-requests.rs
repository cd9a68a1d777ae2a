//! The requests node; see `swath_ground::requests`.

use swath_mission::fallback::Policies;

fn main() -> std::process::ExitCode {
    swath_node::node::exit_code(swath_ground::requests::wiring::run(&Policies::HAND_WRITTEN))
}
