//! Where exactly these relays would be if nothing had ever happened.

use super::chain::run;
use super::optima::{Places, alone, places_of};
use super::setup::Setup;

/// The places of a chain of just `nodes` that nothing happens to.
pub fn undisturbed(setup: &Setup, nodes: &[u16], version: u16) -> Places {
    places_of(&run(alone(setup, nodes, version)?).ok()?)
}
