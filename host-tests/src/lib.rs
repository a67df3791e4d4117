//! What the tests of uav-relay share.

pub mod firmware;
pub mod fixtures;
pub mod flights;
#[cfg(target_os = "linux")]
pub mod python;
