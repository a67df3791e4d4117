//! How much of the optimum a chain has that has to find its interferer, in random scenes, beside chains that were told.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`wild`] | a random scene, and the runs in it |
//! | [`found`] | still sources: the share by agreement |
//! | [`followed`] | one that passes: the mean share over its way |

pub mod followed;
pub mod found;
pub mod wild;
