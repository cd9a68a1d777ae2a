//! The requests node; see `swath_nodes::requests`.

fn main() -> std::process::ExitCode {
    swath_nodes::node::exit_code(swath_nodes::requests::wiring::run())
}
