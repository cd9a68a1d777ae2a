//! The commands of `swath-train`.

pub mod campaign;
mod comparison;
pub mod evaluate;
pub mod figures;
pub mod ground_plan;
mod missions;
mod output;
mod plans;
mod run_folder;
mod session;
pub mod train;

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
