//! Placement by the crate compared with the f64 reference, for chains without and with noise.

use chacha20::ChaCha8Rng;
use rand::{Rng, RngExt, SeedableRng};
use uav_relay::optimiser::plan::{self, Agreed};
use uav_relay::optimiser::spacing::Hop;
use uav_relay::sir::Sender;
use uav_relay::{Mission, Placement, Profile, Schedule};
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::{self, Chain, Style, in_noise};
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::Place;
use uav_relay_sim::report::hop_sirs;
use uav_relay_sim::simulator::outcome::Outcome;

/// Relative spacing of f32 numbers.
pub const SINGLE: f64 = f32::EPSILON as f64;

/// Returns the profile of relay `index`: its own, or the mission's.
pub fn profile_of(mission: &Mission, own: &[(u16, Profile)], index: u16) -> Profile {
    own.iter()
        .find(|(of, _)| *of == index)
        .map_or(mission.config().common, |(_, profile)| *profile)
}

/// Returns the agreement that a leader predicts; `None` if no target can be met.
pub fn solve(mission: &Mission, own: &[(u16, Profile)]) -> Option<Agreed> {
    let of = |index| profile_of(mission, own, index);
    plan::solve(mission, Schedule::Bracketed, of).ok()
}

/// Returns the relays' positions for `target`, which the chain must be able to meet.
pub fn places(mission: &Mission, own: &[(u16, Profile)], target: f32) -> Vec<Placement> {
    let of = |index| profile_of(mission, own, index);
    (1..=mission.relays())
        .map(|index| plan::place(mission, target, index, of).unwrap())
        .collect()
}

/// Returns the positions along Tx-Rx, m.
pub fn xs(places: &[Placement]) -> Vec<f64> {
    places.iter().map(|place| f64::from(place.x_m)).collect()
}

/// Returns the relays' final setpoints.
pub fn setpoints(outcome: &Outcome) -> Vec<Placement> {
    let relays = outcome.relays.iter();
    relays.map(|relay| relay.setpoint.unwrap()).collect()
}

/// Returns a position for the reference.
pub fn reference(at: Placement) -> Place {
    Place {
        x_m: f64::from(at.x_m),
        y_m: f64::from(at.y_m),
        altitude_m: f64::from(at.altitude_m),
    }
}

/// Compares the SIRs of 4 000 random chains, relays at any ordered positions, with the reference. Within 1e-6.
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

/// Solution of a chain, compared with its optimum.
#[derive(Debug)]
pub struct Solved {
    /// Positions along Tx-Rx, m.
    pub x: Vec<f64>,
    /// Relative shortfall from the optimum.
    pub short: f64,
    /// Number of sweeps.
    pub sweeps: u32,
}

/// Solves a chain whose farthest positions are best, and compares it with the optimum. At most `allowed` short, never above.
///
/// `None` if the SIR of every chain is 0, which the solver must report.
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

/// Results of unlike chains.
#[derive(Debug, Default)]
pub struct Mixed {
    /// Number of chains with an agreement.
    pub solved: u32,
    /// Number of chains at the optimum.
    pub best: u32,
    /// Largest number of sweeps of a chain.
    pub sweeps: u32,
}

impl Mixed {
    /// Solves an unlike chain: it meets its agreed target, which is not above the optimum.
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

/// Hop of a random link, its sender's position, and its gain.
#[derive(Debug)]
pub struct DrawnHop {
    /// Link of 1 to 4 relays, in the relays' precision.
    pub link: Link,
    /// Hop in the crate's form.
    pub hop: Hop,
    /// Relay at which the hop ends.
    pub index: u16,
    /// Position of the sender, m.
    pub from: f32,
    /// Limit of the SIR far from sender and interferer.
    pub gain: f64,
    relays: u16,
}

/// Draws a hop; `None` if a relay would reject the link.
pub fn drawn_hop(rng: &mut impl Rng, noisy: bool) -> Option<DrawnHop> {
    let style = Style {
        relays: 1..=4,
        chain: Chain::Any,
    };
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

/// Kinds of reaches seen.
#[derive(Debug, Default)]
pub struct Reaches {
    /// Reaches before the end of the line.
    pub inside: u32,
    /// Reaches beyond positions that miss the target.
    pub leaps: u32,
    /// Number of targets that no position meets.
    pub infeasible: u32,
}

/// Compares `count` reaches with exact ones of targets a millionth lower and higher. The tolerance is two f32 steps.
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
        // Each relay behind keeps a millionth of the distance, which is also the shortest hop.
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
            // Positions in between that miss the target: the reach is beyond the interferer.
            seen.leaps += u32::from((1..40).any(|part| {
                let x = from + f64::from(part) / 40.0 * (place - from);
                link.sir_relay(k, from, x).unwrap() < f64::from(target) * 0.999
            }));
        }
    }
    println!("{compared} reaches: {seen:?}");
    seen
}

/// Returns a random generator of the environment's `SEED`, or of `usual`.
pub fn generator(usual: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(random::seed(usual))
}
