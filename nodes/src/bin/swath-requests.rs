//! The requests node; see `swath_ground::requests`.

fn main() -> std::process::ExitCode {
    swath_node::node::exit_code(swath_ground::requests::wiring::run())
}
