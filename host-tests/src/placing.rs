//! Comparison of the crate's positions with the f64 reference, without and with noise.

use crate::make;
use chacha20::ChaCha8Rng;
use rand::{Rng, RngExt, SeedableRng};
use uav_relay::optimiser::plan::{self, Agreed};
use uav_relay::optimiser::spacing::Hop;
use uav_relay::sir::Sender;
use uav_relay::{Mission, Placement, Profile, Schedule};
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::{self, Chain, in_noise};
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::Place;
use uav_relay_sim::report::{hop_sirs, place};
use uav_relay_sim::simulator::outcome::Outcome;

/// Machine epsilon of f32, 2^-23.
pub const SINGLE: f64 = f32::EPSILON as f64;

/// Returns the profile of relay `index`: its entry in `own`, else the common profile.
pub fn profile_of(mission: &Mission, own: &[(u16, Profile)], index: u16) -> Profile {
    own.iter()
        .find(|(of, _)| *of == index)
        .map_or(mission.config().common, |(_, profile)| *profile)
}

/// Returns the agreement that the leader predicts; `None` if no target SIR can be met.
///
/// `own` has the profiles that differ from the common one.
pub fn solve(mission: &Mission, own: &[(u16, Profile)]) -> Option<Agreed> {
    let of = |index| profile_of(mission, own, index);
    plan::solve(mission, Schedule::Bracketed, of).ok()
}

/// Returns the relays' positions for the target SIR `target` (linear).
pub fn places(mission: &Mission, own: &[(u16, Profile)], target: f32) -> Vec<Placement> {
    let of = |index| profile_of(mission, own, index);
    (1..=mission.relays())
        .map(|index| place(mission, target, index, of).unwrap())
        .collect()
}

/// Returns the distance of each position from Tx along the line to Rx, m.
pub fn xs(places: &[Placement]) -> Vec<f64> {
    places.iter().map(|place| f64::from(place.x_m)).collect()
}

/// Returns the relays' setpoints at the end of a simulated run.
pub fn setpoints(outcome: &Outcome) -> Vec<Placement> {
    let relays = outcome.relays.iter();
    relays.map(|relay| relay.setpoint.unwrap()).collect()
}

/// Converts a position of the crate (f32) to one of the reference (f64).
pub fn reference(at: Placement) -> Place {
    Place {
        x_m: f64::from(at.x_m),
        y_m: f64::from(at.y_m),
        altitude_m: f64::from(at.altitude_m),
    }
}

/// Compares the hops' SIRs of 4 000 random chains with the f64 reference: at most 1e-6 relative error.
///
/// `draw` draws a chain. `hop_sirs_agree` then draws the x of the chain's relays, in ascending order.
pub fn hop_sirs_agree(rng: &mut ChaCha8Rng, draw: impl Fn(&mut ChaCha8Rng) -> Link) {
    let mut worst = 0.0_f64;
    for _ in 0..4_000 {
        let link = draw(rng);
        let Some((mission, own)) = of_link(&link, 1e-4) else {
            continue;
        };
        let mut x: Vec<f32> = link
            .relays
            .iter()
            .map(|_| (rng.random_range(0.0..=link.distance_m)) as f32)
            .collect();
        x.sort_by(f32::total_cmp);
        let at: Vec<_> = (1..)
            .zip(&x)
            .map(|(index, &x_m)| {
                let profile = profile_of(&mission, &own, index);
                (profile.on_line().cross_section.at(x_m), profile)
            })
            .collect();
        let reference = link.sir_hops(&x.iter().map(|&x| f64::from(x)).collect::<Vec<_>>());
        for (ours, theirs) in hop_sirs(&mission, &at).into_iter().zip(reference) {
            if theirs > 0.0 && theirs < f64::from(f32::MAX) {
                worst = worst.max((ours / theirs - 1.0).abs());
            }
        }
    }
    println!("largest relative error of a hop's SIR: {worst:.2e}");
    assert!(worst < 1e-6, "{worst}");
}

/// Solution that the crate finds for a chain, compared with the reference optimum.
#[derive(Debug)]
pub struct Solved {
    /// Distances of the relays from Tx along the line to Rx, m.
    pub x: Vec<f64>,
    /// Relative shortfall of the SIR from the reference optimum: 1 - SIR / optimum.
    pub short: f64,
    /// Number of sweeps (messages along the chain) for the solution.
    pub sweeps: u32,
}

/// Checks that the crate's SIR is at most `allowed` (relative) below the optimum, and never above.
///
/// The relays of `link` must have equal altitudes; then the crate finds the optimum, since each relay goes as far as
/// the target SIR permits. If no chain has an SIR above 0, the crate must find no solution, and `None` is returned.
pub fn optimum_is_found(
    link: &Link,
    (mission, own): &(Mission, Vec<(u16, Profile)>),
    allowed: f64,
) -> Option<Solved> {
    let agreed = solve(mission, own);
    let Some(best) = link.optimum() else {
        assert!(agreed.is_none(), "{link:?}");
        return None;
    };
    let agreed = agreed.unwrap_or_else(|| panic!("{best} of {link:?}"));
    let x = xs(&places(mission, own, agreed.target));
    let reached = link.chain_sir(&x);
    let short = 1.0 - reached / best;
    assert!(
        (-1e-6..=allowed).contains(&short),
        "{reached} of {best} in {link:?}"
    );
    Some(Solved {
        x,
        short,
        sweeps: agreed.sweeps,
    })
}

/// Results for chains whose relays differ in power and altitude.
#[derive(Debug, Default)]
pub struct Mixed {
    /// Number of chains for which the relays agree on a target SIR.
    pub solved: u32,
    /// Number of chains with an SIR at most 2e-4 (relative) below the reference optimum.
    pub best: u32,
    /// Largest number of sweeps (messages along the chain) for one chain.
    pub sweeps: u32,
}

impl Mixed {
    /// Solves a chain of different relays, and counts the result.
    ///
    /// The SIR of the solved chain must be at least the agreed target SIR, and at most the optimum.
    pub fn meet_what_they_agree_on(&mut self, link: &Link) {
        let Some((mission, own)) = of_link(link, 1e-4) else {
            return;
        };
        let (Some(best), Some(agreed)) = (link.optimum(), solve(&mission, &own)) else {
            return;
        };
        let x = xs(&places(&mission, &own, agreed.target));
        let (reached, promised) = (link.chain_sir(&x), f64::from(agreed.target));
        assert!(
            reached >= promised * (1.0 - 2e-5),
            "{:?} of {promised} at {x:?} in {link:?}",
            link.sir_hops(&x)
        );
        assert!(
            reached <= best * (1.0 + 1e-6),
            "{reached} above {best} in {link:?}"
        );
        let inside = x.iter().all(|x| (0.0..=link.distance_m).contains(x));
        assert!(x.is_sorted() && inside, "{x:?}");
        self.solved += 1;
        self.best += u32::from(reached >= best * (1.0 - 2e-4));
        self.sweeps = self.sweeps.max(agreed.sweeps);
    }
}

/// Hop of a random chain.
#[derive(Debug)]
pub struct DrawnHop {
    /// Random chain of 1 to 4 relays with the tested hop. Its numbers are rounded to f32, as in relays.
    pub link: Link,
    /// Tested hop as the crate represents it. The reference model computes the same hop from `link`.
    pub hop: Hop,
    /// Index of the receiving relay, from 1.
    pub index: u16,
    /// Distance of the sender from Tx along the line to Rx, m.
    pub from: f32,
    /// Linear SIR of the hop without noise at equal distances of sender and interferer from the receiver.
    pub gain: f64,
    relays: u16,
}

/// Draws a hop of a random chain, with receiver noise if `noisy`.
///
/// `None` if a relay would reject the chain's mission.
pub fn drawn_hop(rng: &mut impl Rng, noisy: bool) -> Option<DrawnHop> {
    let style = make::style(1..=4, Chain::Any);
    let mut link = as_relays_know_it(&random::link(rng, &style));
    if noisy {
        link = as_relays_know_it(&in_noise(rng, &link));
    }
    let (mission, own) = of_link(&link, 1e-4)?;
    let index = rng.random_range(1..=mission.relays());
    let profile = profile_of(&mission, &own, index);
    let (sender, from, gain) = if index == 1 {
        (Sender::transmitter(&mission), 0.0, mission.tx_gain())
    } else {
        let before = profile_of(&mission, &own, index - 1).on_line();
        let from = rng.random_range(0.0..0.95) * mission.config().distance_m;
        let gain = mission.relay_gain(profile.power_w);
        (Sender::relay(&mission, before), from, gain)
    };
    let place = profile.on_line().cross_section;
    let hop = Hop::new(&mission, mission.interferer()?, sender, index, place, 0.0);
    Some(DrawnHop {
        link,
        hop,
        index,
        from,
        gain: f64::from(gain.value()),
        relays: mission.relays(),
    })
}

/// Results for the farthest x of a receiver that meets a target SIR, compared with the reference.
#[derive(Debug, Default)]
pub struct Reaches {
    /// Number of hops whose farthest x is limited by the target SIR. Other hops are limited by the position of Rx.
    pub inside: u32,
    /// Number of hops that meet the target SIR at their farthest x, but not at some smaller x.
    ///
    /// The interferer is between that smaller x and the farthest x.
    pub leaps: u32,
    /// Number of hops that meet their target SIR nowhere.
    pub infeasible: u32,
}

/// Compares a receiver's farthest x for a target SIR with the reference, for `count` hops.
///
/// `target` draws a target. The crate's x must be between the exact results for targets 1e-6 (relative) higher and
/// lower. Errors of up to two f32 rounding steps are tolerated.
pub fn reaches_agree(
    rng: &mut ChaCha8Rng,
    count: usize,
    noisy: bool,
    target: impl Fn(&mut ChaCha8Rng, &DrawnHop) -> f32,
) -> Reaches {
    let mut seen = Reaches::default();
    let mut compared = 0;
    while compared < count {
        let Some(of) = drawn_hop(rng, noisy) else {
            continue;
        };
        compared += 1;
        let target = target(rng, &of);
        let (link, k, from) = (&of.link, usize::from(of.index), f64::from(of.from));
        let exact = |by: f64| link.farthest(k, from, f64::from(target) * by);
        let (low, high) = (exact(1.0 - 1e-6), exact(1.0 + 1e-6));
        // The crate keeps a millionth of the distance for each relay behind, and as the shortest hop.
        let spare = link.distance_m * 1.1e-6;
        let room = spare * f64::from(of.relays - of.index + 1);
        let Some(place) = of.hop.reach(target, of.from).map(f64::from) else {
            seen.infeasible += 1;
            let short = high.is_none_or(|high| high - from < spare);
            assert!(short, "{target}: none against {high:?} of {of:?}");
            continue;
        };
        let step = 2.0 * link.distance_m * SINGLE;
        let far = low.expect("a target that is met is met when it is lower");
        assert!(
            place <= far + step,
            "{target}: {place} beyond {far} of {of:?}"
        );
        let near = high.map_or(from, |high| high.min(link.distance_m - room));
        assert!(
            place >= near - step - room,
            "{target}: {place} short of {near} of {of:?}"
        );
        if place < link.distance_m - room {
            seen.inside += 1;
            // If a position in between misses the target, the farthest x is beyond the interferer.
            seen.leaps += u32::from((1..40).any(|part| {
                let x = from + f64::from(part) / 40.0 * (place - from);
                link.sir_relay(k, from, x).unwrap() < f64::from(target) * 0.999
            }));
        }
    }
    println!("{compared} reaches: {seen:?}");
    seen
}

/// Returns a random generator with the seed in the environment variable `SEED`, or `usual`.
pub fn generator(usual: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(random::seed(usual))
}
