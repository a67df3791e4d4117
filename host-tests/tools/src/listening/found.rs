//! Static interferers: share of the optimum after each agreement.

use rayon::prelude::*;
use uav_relay::Interference;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::setup::Setup;

use super::scene::{RandomScene, by_agreement};
use crate::figures::error::FigureError;

/// Last agreement that is reported.
pub const LAST: usize = 8;

/// Shares of the optimum after 0 to [`LAST`] agreements based on measurements, one per scene.
pub type Shares = [Vec<f64>; LAST + 1];

/// Returns the shares in `scenes` random scenes, each run with `setup`.
///
/// # Errors
/// [`FigureError`].
pub fn shares(
    scenes: u64,
    relays: u16,
    sources: usize,
    setup: impl Fn(&RandomScene) -> Result<Setup, FigureError> + Sync,
) -> Result<Shares, FigureError> {
    let one = |seed| {
        let wild = RandomScene::new(seed, relays, sources);
        let outcome = run(setup(&wild)?)?;
        let best = wild.optimum()?;
        let sirs = by_agreement(&wild.scene()?, &outcome.stands);
        let last = *sirs
            .last()
            .ok_or(FigureError::Unsettled("a chain that listens"))?;
        let share = |at: usize| sirs.get(at).unwrap_or(&last) / best;
        Ok((0..=LAST).map(share).collect())
    };
    let each: Result<Vec<Vec<f64>>, FigureError> = (0..scenes).into_par_iter().map(one).collect();
    let each = each?;
    Ok(std::array::from_fn(|at| {
        each.iter().filter_map(|one| one.get(at).copied()).collect()
    }))
}

/// Setup without prior knowledge of the interference.
///
/// # Errors
/// [`FigureError`].
pub fn unknown(wild: &RandomScene) -> Result<Setup, FigureError> {
    wild.setup(Interference::Unknown)
}

/// The setup of [`unknown`] with 1 dB of shadowing, independent at each position.
///
/// # Errors
/// [`FigureError`].
pub fn shadowed(wild: &RandomScene) -> Result<Setup, FigureError> {
    let mut setup = unknown(wild)?;
    if let Some(sky) = &mut setup.sky {
        sky.shadow_db = 1.0;
    }
    Ok(setup)
}

/// Setup without measurements. The relays know the interferer, or the paper's hypothetical one for several sources.
///
/// # Errors
/// [`FigureError`].
pub fn hypothetical(wild: &RandomScene) -> Result<Setup, FigureError> {
    let mut setup = unknown(wild)?;
    (setup.mission, _) = uav_relay_scenario::mission::mission(&wild.scenario, wild.relays, 1e-4)?;
    setup.settings.listen = None;
    Ok(setup)
}

/// Returns the `part`-quantile of `numbers`; NaN if empty.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "an index"
)]
pub fn quantile(numbers: &mut [f64], part: f64) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let at = (numbers.len().saturating_sub(1) as f64 * part).round() as usize;
    numbers.get(at).copied().unwrap_or(f64::NAN)
}
