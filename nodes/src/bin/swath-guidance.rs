//! The guidance node; see `swath_space::guidance`.

fn main() -> std::process::ExitCode {
    swath_node::node::exit_code(swath_space::guidance::wiring::run())
}
