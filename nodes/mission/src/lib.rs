//! What a mission is, without ROS: its file, orders, the life cycle of requests, approval, planners with a fallback,
//! and whole missions in one process.
#![expect(non_snake_case, reason = "frame letters")]

mod absences;
pub mod alarms;
pub mod approval;
pub mod fallback;
pub mod faults;
pub mod file;
pub mod in_process;
mod keeper;
pub mod link;
pub mod mirror;
pub mod orders;
pub mod origin;
pub mod outcome;
pub mod requests;
pub mod shapes;
pub mod supervision;
pub mod task_log;
pub mod time_text;
