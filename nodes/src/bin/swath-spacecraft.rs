//! The spacecraft node; see `swath_nodes::spacecraft`.

fn main() -> std::process::ExitCode {
    swath_nodes::node::exit_code(swath_nodes::spacecraft::wiring::run())
}
