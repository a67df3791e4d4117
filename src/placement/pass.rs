//! One pass of targets along the chain: what each relay makes of what the one before it hands on, and how the last one ends it.
//!
//! Toward Rx (Algorithm 1) a relay's reach is the farthest place that still *hears* the relay before it well enough; toward
//! Tx (Algorithm 4) the farthest from which it is still *heard*. The rest of the chain, of the search and of the protocol
//! is the same for both.

use super::PerTarget;
use super::ladder::{Ladder, TARGETS};
use super::retreat::Retreat;
use super::spacing::{Hop, receiver_reach};
use super::verdict::Verdict;
use crate::mission::{Heading, Interferer, Mission};
use crate::root::sqrt;
use crate::sir::{self, Sender, Station, square};

/// The relay that a pass comes from, as its message tells.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Behind {
    /// Where it flies across the line, and its power.
    pub relay: Station,
    /// Upsilon as it measures it where it stands, 1/W, if it uses that instead of the agreed field. Means nothing toward Rx.
    pub measured_per_w: Option<f32>,
}

/// Where a pass begins, as reaches: at Tx, or at Rx in a field, for every target.
pub(crate) fn origins(mission: &Mission) -> PerTarget {
    let x_m = match mission.heading() {
        Heading::TowardRx => 0.0,
        Heading::TowardTx => mission.config().distance_m,
    };
    PerTarget::from([x_m; TARGETS])
}

/// Works out the `reaches` of relay `index`, `own`, for as many of the rising `targets` as it can meet.
///
/// `behind` is the relay that the pass comes from and `from` its reaches, m; `None` for the first one, which begins at Tx or Rx.
/// Bounded by a reach a target.
pub fn extend(
    mission: &Mission,
    behind: Option<Behind>,
    index: u16,
    own: Station,
    targets: &[f32],
    from: &[f32],
    reaches: &mut PerTarget,
) {
    reaches.clear();
    let pairs = targets.iter().zip(from);
    if let Some(interferer) = mission.interferer() {
        let end_m = mission.end_for(index, 0.0);
        toward_rx(
            mission,
            interferer,
            behind,
            (index, own),
            end_m,
            pairs,
            reaches,
        );
    } else if let Some(field) = mission.field() {
        let altitude_m = behind.map(|behind| behind.relay.at.altitude_m);
        let measured = behind.and_then(|behind| behind.measured_per_w);
        let hop = Retreat::new(mission, own, index, altitude_m);
        for (&target, &from_m) in pairs {
            // Whatever a neighbour says, nobody stands beyond Rx.
            if from_m > mission.config().distance_m {
                break;
            }
            let quiet = match (altitude_m, measured) {
                (None, _) => 1.0,
                (_, Some(upsilon)) => upsilon / field.largest(),
                _ => field.upsilon(from_m) / field.largest(),
            };
            let Some(place) = hop.reach(target, from_m, quiet) else {
                break;
            };
            if reaches.push(place).is_err() {
                break;
            }
        }
    }
}

/// The same toward Rx for a relay that goes no farther than `end_m`.
fn toward_rx<'a>(
    mission: &Mission,
    interferer: &Interferer,
    behind: Option<Behind>,
    (index, own): (u16, Station),
    end_m: f32,
    pairs: impl Iterator<Item = (&'a f32, &'a f32)>,
    reaches: &mut PerTarget,
) {
    let sender = behind.map_or(Sender::transmitter(mission), |behind| {
        Sender::relay(mission, behind.relay)
    });
    let hop = Hop::new(mission, interferer, sender, index, own.at, end_m);
    for (&target, &from_m) in pairs {
        let Some(place) = hop.reach(target, from_m) else {
            break;
        };
        if reaches.push(place).is_err() {
            break;
        }
    }
}

/// As [`extend`], for relay `index` of a chain by the joint method, which goes no farther than `end_m`, m along x.
pub fn extend_chosen(
    mission: &Mission,
    behind: Option<Behind>,
    (index, own): (u16, Station),
    end_m: f32,
    targets: &[f32],
    from: &[f32],
    reaches: &mut PerTarget,
) {
    reaches.clear();
    if let Some(interferer) = mission.interferer() {
        let pairs = targets.iter().zip(from);
        toward_rx(
            mission,
            interferer,
            behind,
            (index, own),
            end_m,
            pairs,
            reaches,
        );
    }
}

/// The verdict on the pass, by the last relay, `own`, which has these `reaches`.
///
/// Toward Rx the slack of a target is reach + `d_max` - D; toward Tx it is the same seen from the other end, the farthest
/// that the first hop may be minus the reach. `measured_per_w` is the last relay's own Upsilon, if it uses that.
pub fn close(
    mission: &Mission,
    own: Station,
    measured_per_w: Option<f32>,
    ladder: Ladder,
    reaches: &[f32],
) -> Verdict {
    let targets = ladder.targets();
    let mut slacks = PerTarget::new();
    for (&target, &place) in targets.iter().zip(reaches) {
        let Some(slack) = slack(mission, own, measured_per_w, target, place) else {
            break;
        };
        if slacks.push(slack).is_err() {
            break;
        }
    }
    Verdict::new(mission, ladder, &targets, slacks)
}

/// By how much a chain whose last relay, `own`, stands at `place` for `target` overshoots, m: not negative when it
/// closes. `None` where Rx cannot be reached from anywhere.
pub(super) fn slack(
    mission: &Mission,
    own: Station,
    measured_per_w: Option<f32>,
    target: f32,
    place: f32,
) -> Option<f32> {
    let Some(field) = mission.field() else {
        return receiver_reach(mission, own, target)
            .map(|last_hop| place - mission.config().distance_m + last_hop);
    };
    let at = own.at.at(place);
    let quiet = measured_per_w.map_or(sir::quiet(mission, at), |upsilon| upsilon / field.largest());
    // Cut at 1e9 m, as the last hop toward Rx: an infinite slack would not be sent.
    let squared =
        (mission.tx_gain().value() * quiet / target).min(1e18) - square(own.at.altitude_m);
    // Where no place is near enough, by how much the square is negative: it stays continuous in the target.
    Some((sqrt(squared.abs()).copysign(squared) - place).max(-1e9))
}
