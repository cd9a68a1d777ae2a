//! The spacecraft node; see `swath_space::spacecraft`.

fn main() -> std::process::ExitCode {
    swath_node::node::exit_code(swath_space::spacecraft::wiring::run())
}
