//! Chains that must locate their interferer, compared with chains that know it, in random scenes.
//!
//! | module | content |
//! | --- | --- |
//! | [`scene`] | a random scene and its simulation setups |
//! | [`found`] | static sources: share of the optimum after each agreement |
//! | [`moving`] | a moving source: mean share of the optimum over time |

pub mod found;
pub mod moving;
pub mod scene;
