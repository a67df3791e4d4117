//! What the tests of uav-relay share.

pub mod firmware;
pub mod fixtures;
#[cfg(target_os = "linux")]
pub mod python;
