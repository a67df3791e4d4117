//! A chain of relays simulated on a PC, and what the tools and tests of uav-relay share.

pub mod baseline;
pub mod brief;
pub mod cases;
pub mod command;
pub mod figures;
pub mod firmware;
pub mod fuzzing;
pub mod plan;
pub mod random;
pub mod reference;
pub mod report;
pub mod scenario;
pub mod several;
pub mod sim;
pub mod stack;
pub mod svg;
pub mod toolchain;
