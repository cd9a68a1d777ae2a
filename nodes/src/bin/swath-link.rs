//! The link node; see `swath_space::link`.

fn main() -> std::process::ExitCode {
    swath_node::node::exit_code(swath_space::link::wiring::run())
}
