//! Host tools: planner, provisioning of drones, flash images, and published figures.
//!
//! | module | content |
//! | --- | --- |
//! | [`plan`] | how many relays a link needs and where they go, computed without messages |
//! | [`fewest`] | number of relays for a target SIR, and their positions |
//! | [`single`] | the best position of one relay: Theorems 1 to 3, and Algorithm 3 |
//! | [`multi_interferer`] | the best chain against the sum of several interferers |
//! | [`image`] | flash images as `.bin`, `.hex` and `.uf2` |
//! | [`provision`] | the configuration block of a drone |
//! | [`figures`] | the figures of the paper's evaluation, and further ones |
//! | [`listening`] | chains that locate an unknown interferer, in random scenes |
//! | [`baseline`] | baseline placements for the figures |

#![allow(
    clippy::missing_errors_doc,
    reason = "the variants of the error types say when they occur"
)]

pub mod baseline;
pub mod fewest;
pub mod figures;
pub mod image;
pub mod listening;
pub mod multi_interferer;
pub mod plan;
pub mod provision;
pub mod single;
