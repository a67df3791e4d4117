//! Chain computed without messages, by the functions that each relay uses for its hop.

use uav_relay::optimiser::ladder::TARGETS;
use uav_relay::optimiser::pass::{Behind, Link, close};
use uav_relay::optimiser::search::Search;
use uav_relay::optimiser::{PerTarget, plan};
use uav_relay::{Heading, Method, Mission, Placement, Profile, Schedule};
use uav_relay_sim::report::hop_sirs;
use uav_relay_sim::simulator::chain;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::Setup;

use super::sheet::FigureError;

/// Chain of equal relays: their positions and its SIR.
#[derive(Clone, PartialEq, Debug)]
pub struct Chain {
    /// Positions of the relays in order from Tx to Rx.
    pub places: Vec<Placement>,
    /// SIR of the chain's worst hop, linear.
    pub sir: f64,
}

/// Returns a chain with each relay as far toward Rx as the SIR `target` (linear, > 0) allows.
///
/// `None` if a hop cannot meet the target. If the target is too high, the last relay is too far from Rx, and the last
/// hop has a lower SIR. The cost is one search for a farthest position for each relay.
pub fn stretched(mission: &Mission, target: f32) -> Option<Chain> {
    let profile = mission.config().common;
    let mut from = PerTarget::from(
        [match mission.heading() {
            Heading::TowardRx => 0.0,
            Heading::TowardTx => mission.config().distance_m,
        }; TARGETS],
    );
    let mut behind = None;
    let mut places = Vec::with_capacity(usize::from(mission.relays()));
    let mut next = Some(mission.leader());
    while let Some(index) = next {
        let mut reaches = PerTarget::new();
        let link = Link {
            mission,
            behind,
            index,
            own: profile.on_line(),
            measured_per_w: None,
            plain: true,
            end_m: None,
            fixed_m: None,
        };
        link.extend(&[target], &from, &mut reaches);
        places.push(Placement::on_line(*reaches.first()?, profile.altitude_m));
        behind = Some(Behind {
            relay: profile.on_line(),
            measured_per_w: None,
        });
        from = reaches;
        next = mission.after(index);
    }
    if mission.heading() == Heading::TowardTx {
        places.reverse();
    }
    let sir = worst(mission, &places);
    Some(Chain { places, sir })
}

/// Pass of messages along the chain in Algorithm 1: its target SIR and the resulting chain.
#[derive(Clone, PartialEq, Debug)]
pub struct Sweep {
    /// Number of the pass of messages, from 1.
    pub number: u32,
    /// Target SIR of every hop in this pass of messages, linear.
    pub target: f32,
    /// Chain with each relay as far from Tx as the target allows; `None` if a hop cannot meet the target.
    pub chain: Option<Chain>,
}

/// Returns all passes of messages along the chain until its positions are final, by Algorithm 1.
///
/// `step` is the decrease of the target SIR from one pass to the next, linear. If the interference is known only along
/// the line Tx-Rx (a field), the algorithm is the paper's Algorithm 4.
pub fn descent(mission: &Mission, step: f64) -> Result<Vec<Sweep>, FigureError> {
    let own = mission.config().common;
    let mut search = Search::new(mission, own, Schedule::FixedStep { step })?;
    let mut sweeps = Vec::new();
    for number in 1.. {
        let ladder = *search.ladder();
        let targets = ladder.targets();
        let &target = targets.first().ok_or(FigureError::Unsettled("a sweep"))?;
        let chain = stretched(mission, target);
        let last = chain.as_ref().and_then(|chain| match mission.heading() {
            Heading::TowardRx => chain.places.last(),
            Heading::TowardTx => chain.places.first(),
        });
        let reached: Vec<f32> = last.map(|place| place.x_m).into_iter().collect();
        let verdict = close(
            &Link {
                mission,
                behind: None,
                index: mission.relays(),
                own: own.on_line(),
                measured_per_w: None,
                plain: true,
                end_m: None,
                fixed_m: None,
            },
            ladder,
            // It has no effect in the direction to Rx.
            &reached,
            &reached,
        );
        sweeps.push(Sweep {
            number,
            target,
            chain,
        });
        if verdict.commit.is_some() {
            break;
        }
        search.advance(&verdict.slacks)?;
    }
    Ok(sweeps)
}

/// Returns the chain that the relays of `mission` agree on by the paper's Algorithm 1.
///
/// If the interference is known only along the line Tx-Rx (a field), it is Algorithm 4.
pub fn settled(mission: &Mission) -> Result<Chain, FigureError> {
    let common = |_| mission.config().common;
    let agreed = plan::solve(mission, Schedule::Bracketed, common)?;
    stretched(mission, agreed.target).ok_or(FigureError::Unsettled("a chain"))
}

/// Returns the SIR of the worst hop of identical relays at `places`, linear; 0 without relays.
pub fn worst(mission: &Mission, places: &[Placement]) -> f64 {
    let power_w = mission.config().common.power_w;
    let standing: Vec<(Placement, Profile)> = places
        .iter()
        .map(|&place| {
            let altitude_m = place.altitude_m;
            (
                place,
                Profile {
                    altitude_m,
                    power_w,
                },
            )
        })
        .collect();
    let sirs = hop_sirs(mission, &standing);
    sirs.into_iter().reduce(f64::min).unwrap_or(0.0)
}

/// Result of a simulated chain after its positions have become final.
#[derive(Clone, PartialEq, Debug)]
pub struct Flown {
    /// Positions of the relays in order from Tx to Rx.
    pub places: Vec<Placement>,
    /// SIR of the chain's worst hop, linear.
    pub sir: f64,
    /// SIR of the worst hop before Algorithm 2 and after each of its rounds, linear.
    pub rounds: Vec<f32>,
    /// Number of passes of messages along the chain until its positions were final.
    pub sweeps: u32,
    /// Number of frames sent on all links.
    pub messages: u64,
    /// Number of bytes sent on all links.
    pub bytes: u64,
}

/// Simulates the chain of `mission` until its positions are final.
///
/// With `predict` the leader first computes the whole chain from the mission.
pub fn fly(
    mission: &Mission,
    method: Method,
    schedule: Schedule,
    predict: bool,
) -> Result<Flown, FigureError> {
    let mut setup = Setup::new(*mission);
    setup.settings.method = method;
    setup.settings.schedule = schedule;
    setup.settings.predict = predict;
    let outcome: Outcome = chain::run(setup)?;
    let places: Option<Vec<Placement>> =
        outcome.relays.iter().map(|relay| relay.setpoint).collect();
    match places {
        Some(places) if outcome.ending == Ending::Settled => Ok(Flown {
            sir: worst(mission, &places),
            places,
            rounds: outcome.rounds,
            sweeps: outcome.sweeps,
            messages: outcome.messages,
            bytes: outcome.bytes,
        }),
        _ => Err(FigureError::Unsettled("a simulated chain")),
    }
}
