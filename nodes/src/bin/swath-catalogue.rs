//! The on-board catalogue node; see `swath_space::catalogue`.

fn main() -> std::process::ExitCode {
    swath_node::node::exit_code(swath_space::catalogue::wiring::run())
}
