//! Chains that find an interferer that nobody told them of, in random scenes, against the chain that was told.
//!
//! `COUNT=1000` flies as many scenes a row, `SEED` begins elsewhere.

mod scenes;

mod following;
mod found;
mod steady;
