//! What a process that computes with libtorch does once, before anything else.

use rayon::ThreadPoolBuilder;
use tch::Device;

use crate::error::{Result, TrainingError};

/// Readies the process: call it as the first statement of `main`.
///
/// A GPU is found only if libtorch's CUDA library is loaded before libtorch is first used; without
/// one on the library path nothing is loaded and everything runs on the CPU.
pub fn prepare() {
    keep_freed_memory();
    // SAFETY: the name is a C string, and loading a library runs no code of ours.
    unsafe {
        libc::dlopen(c"libtorch_cuda.so".as_ptr(), libc::RTLD_NOW | libc::RTLD_GLOBAL);
    }
}

/// Keeps glibc from handing big buffers back to the system after every operation.
#[cfg(target_env = "gnu")]
fn keep_freed_memory() {
    // SAFETY: mallopt takes two integers and is called before other threads exist.
    unsafe {
        libc::mallopt(libc::M_MMAP_MAX, 0);
        libc::mallopt(libc::M_TRIM_THRESHOLD, i32::MAX);
        libc::mallopt(libc::M_TOP_PAD, 64 << 20);
    }
}

#[cfg(not(target_env = "gnu"))]
fn keep_freed_memory() {}

/// Makes the threads that share rollouts, gradients and evaluations; each runs libtorch's
/// operations on itself alone, so that results do not depend on how many there are.
///
/// # Errors
/// When threads were made before, or cannot be.
pub fn make_threads(count: usize) -> Result<()> {
    tch::set_num_threads(1);
    ThreadPoolBuilder::new()
        .num_threads(count)
        .start_handler(|_| tch::set_num_threads(1))
        .build_global()
        .map_err(|error| TrainingError::Environment(error.to_string()))
}

/// The device of a name, `cpu` or `cuda`.
///
/// # Errors
/// Another name, or no CUDA device at hand.
pub fn device(name: &str) -> Result<Device> {
    let refused =
        |limit: &str| TrainingError::Setting { key: "device".into(), value: name.into(), limit: limit.into() };
    match name {
        "cpu" => Ok(Device::Cpu),
        "cuda" if tch::Cuda::is_available() => Ok(Device::Cuda(0)),
        "cuda" => Err(refused("available: no CUDA device, or no libtorch_cuda.so of torch 2.11 on LD_LIBRARY_PATH")),
        _ => Err(refused("cpu or cuda")),
    }
}
