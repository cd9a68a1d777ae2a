//! A launcher that cannot kill, as where a process waits for a disk that does not answer: the kernel takes no notice of
//! the signal.

use std::os::unix::process::CommandExt as _;
use std::process::Command;

use libc::{BPF_ABS, BPF_JEQ, BPF_JMP, BPF_K, BPF_LD, BPF_RET, BPF_W, sock_filter, sock_fprog};

/// Where the kernel has the number of a system call, and its second argument.
const NUMBER: u32 = 0;
const SECOND: u32 = 24;

/// The program of this command, and what it starts, sends SIGKILL without effect.
pub fn cannot_kill(command: &mut Command) {
    let load = |at| line(BPF_LD | BPF_W | BPF_ABS, 0, at);
    let unless = |value, skipped| line(BPF_JMP | BPF_JEQ | BPF_K, skipped, value);
    let filter = [
        load(NUMBER),
        unless(libc::SYS_kill as u32, 3),
        load(SECOND),
        unless(libc::SIGKILL as u32, 1),
        // It is done, says the kernel.
        line(BPF_RET | BPF_K, 0, libc::SECCOMP_RET_ERRNO),
        line(BPF_RET | BPF_K, 0, libc::SECCOMP_RET_ALLOW),
    ];
    let install = move || {
        let mut filter = filter;
        let program = sock_fprog { len: filter.len() as u16, filter: filter.as_mut_ptr() };
        // SAFETY: both calls read their arguments alone; the program outlives the call that copies it.
        let done = unsafe {
            libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0
                && libc::prctl(libc::PR_SET_SECCOMP, libc::SECCOMP_MODE_FILTER, &raw const program) == 0
        };
        if done { Ok(()) } else { Err(std::io::Error::last_os_error()) }
    };
    // SAFETY: between fork and exec it makes two system calls and allocates nothing.
    unsafe { command.pre_exec(install) };
}

fn line(code: u32, unless: u8, k: u32) -> sock_filter {
    sock_filter { code: code as u16, jt: 0, jf: unless, k }
}

/// Whether a process has ended, though nobody may have waited for it.
pub fn has_ended(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit_once(')').is_none_or(|(_, rest)| rest.trim_start().starts_with(['Z', 'X']))
}
