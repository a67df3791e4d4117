//! Simulated chain that runs the relays' code, message by message.

use uav_relay::{Method, Mission, Placement, Schedule};

use super::error::FigureError;
use super::walk;
use uav_relay_sim::simulator::chain;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::Setup;

/// Result of a settled chain.
#[derive(Clone, PartialEq, Debug)]
pub struct Flown {
    /// Positions from Tx to Rx.
    pub places: Vec<Placement>,
    /// SIR of the worst hop, linear.
    pub sir: f64,
    /// SIR before Algorithm 2 and after each of its rounds, linear.
    pub rounds: Vec<f32>,
    /// Passes along the chain.
    pub sweeps: u32,
    /// Frames sent on all links.
    pub messages: u64,
    /// Bytes sent on all links.
    pub bytes: u64,
}

/// Simulates `mission` until it settles; `predict` lets the leader first solve the chain itself.
///
/// # Errors
/// [`FigureError::Setup`] or [`FigureError::Unsettled`].
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
            sir: walk::worst(mission, &places),
            places,
            rounds: outcome.rounds,
            sweeps: outcome.sweeps,
            messages: outcome.messages,
            bytes: outcome.bytes,
        }),
        _ => Err(FigureError::Unsettled("a simulated chain")),
    }
}
