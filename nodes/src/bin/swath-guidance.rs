//! The guidance node; see `swath_nodes::guidance`.

fn main() -> std::process::ExitCode {
    swath_nodes::node::exit_code(swath_nodes::guidance::wiring::run())
}
