//! How far from its receiver the sender of a hop may stand in a field: Algorithm 4's way back from Rx, in closed form.
//!
//! Where the node that hears a hop stands is known, and with it the Upsilon it hears through. With that node at (x0, h0),
//! its sender at (x0 - d, h) and A = p Upsilon(x0) / `mu_los` for a sender of p watts, E(SIR) >= gamma is
//!
//! ```text
//! d^2 <= A / gamma - (h - h0)^2
//! ```
//!
//! the paper's eq. (num), with relays that differ in altitude. For the last hop x0 = D, h0 = 0 and A = p Upsilon(D) / eta.
//! The printed algorithm lets a place become negative; here a sender stops where there is just room for those before it.
//!
//! Accuracy: `retreats_agree_with_the_reference` in `host-tests/tests/stochastic.rs` asserts it in f64.

use crate::mission::Mission;
use crate::root::sqrt;
use crate::sir::{Station, square};

/// One hop, from where it is heard: ready to be evaluated for many targets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Retreat {
    /// A of the module's text without its Upsilon, for the hop to Rx with it.
    gain: f32,
    /// (h - h0)^2, m^2.
    climb_squared: f32,
    /// The least step to the sender, m.
    least_step: f32,
    /// The first place the sender may take, m.
    end_m: f32,
    /// Whether it is Rx that hears it.
    to_rx: bool,
}

impl Retreat {
    /// The hop that relay `index`, `own`, feeds to a relay at `altitude_m`; `None` for the one to Rx.
    pub fn new(mission: &Mission, own: Station, index: u16, altitude_m: Option<f32>) -> Self {
        let climb = own.at.altitude_m - altitude_m.unwrap_or(0.0);
        Self {
            gain: match altitude_m {
                Some(_) => mission.relay_gain(own.power_w).value(),
                None => mission.receiver_gain(own.power_w),
            },
            climb_squared: square(climb),
            // The receiver stands on the ground: its altitude alone keeps the tail clear of it.
            least_step: match altitude_m {
                Some(_) => mission.least_step(square(climb)),
                None => 0.0,
            },
            end_m: mission.end_for(index, 0.0),
            to_rx: altitude_m.is_none(),
        }
    }

    /// The place nearest to Tx in [end, `from_m`] from which the sender still meets `target`; `None` if there is none.
    ///
    /// `target` is a linear SIR above zero, `from_m` the receiver's place in [0, D], `quiet` what it hears through: Upsilon
    /// there over the field's largest, above 0, or 1 at Rx. The place is rounded toward the receiver. Constant work.
    pub fn reach(&self, target: f32, from_m: f32, quiet: f32) -> Option<f32> {
        let room = from_m - self.end_m;
        if room < self.least_step {
            return None;
        }
        // Cut at 1e9 m, far beyond any end: of infinity there is no root.
        let squared = (self.gain * quiet / target).min(1e18) - self.climb_squared;
        if !(squared >= 0.0) {
            return None;
        }
        let d = sqrt(squared);
        if d >= room {
            return Some(self.end_m);
        }
        if d < self.least_step {
            return None;
        }
        let place = from_m - d;
        let place = if from_m - place > d {
            place.next_up()
        } else {
            place
        };
        // Two relays never share a place, however short the hop.
        (place < from_m || self.to_rx).then_some(place)
    }
}
