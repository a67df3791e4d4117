//! What is run before a flight, and on what is published: the planner, the configuration of drones, the figures.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`plan`] | how many relays a link needs, and where they go, without a message |
//! | [`multi_interferer`] | the best chain against several interferers whose powers add up |
//! | [`image`] | what a board is flashed with, as `.bin`, `.hex` and `.uf2` |
//! | [`provision`] | the configuration block of one drone |
//! | [`figures`] | every figure of the paper's evaluation, and this project's own |
//! | [`listening`] | chains that find their interferer, in random scenes |
//! | [`baseline`] | the placements that figures compare with |

pub mod baseline;
pub mod figures;
pub mod image;
pub mod listening;
pub mod multi_interferer;
pub mod plan;
pub mod provision;
