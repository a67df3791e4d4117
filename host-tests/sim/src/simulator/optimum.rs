//! Reference positions: where a chain of given relays settles without disturbances.

use super::chain::run;
use super::optima::{Places, alone, places_of};
use super::setup::Setup;

/// Returns the positions in which a chain of only `nodes` settles without faults.
pub fn undisturbed(setup: &Setup, nodes: &[u16], version: u16) -> Places {
    places_of(&run(alone(setup, nodes, version)?).ok()?)
}
