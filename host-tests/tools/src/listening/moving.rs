//! Moving interferer: a chain that tracks it against a chain that keeps its first positions.

use rayon::prelude::*;
use uav_relay::{Instant, Interference, Listen};
use uav_relay_sim::simulator::chain::run;

use super::scene::RandomScene;
use crate::figures::error::FigureError;

/// Start of the evaluation, s after the start of the run.
const BEGUN_S: u32 = 60;

/// Mean ratios of a chain's SIR to the optimum at the same moment, per scene, after the first minute.
#[derive(Clone, Debug, Default)]
pub struct Shares {
    /// Ratios of the chain that tracks the interferer.
    pub followed: Vec<f64>,
    /// Ratios of the chain that keeps its first optimal positions.
    pub stayed: Vec<f64>,
}

/// Returns the ratios in `scenes` scenes while a single interferer passes at a distance of 300 m.
///
/// # Errors
/// [`FigureError`].
pub fn shares(scenes: u64, relays: u16, speed_mps: f64) -> Result<Shares, FigureError> {
    let each: Result<Vec<(f64, f64)>, FigureError> = (0..scenes)
        .into_par_iter()
        .map(|seed| one(seed, relays, speed_mps))
        .collect();
    let (followed, stayed) = each?.into_iter().unzip();
    Ok(Shares { followed, stayed })
}

fn one(seed: u64, relays: u16, speed_mps: f64) -> Result<(f64, f64), FigureError> {
    let mut wild = RandomScene::new(seed, relays, 1);
    // Half-way through, the interferer is beside the middle of the line.
    let span_s = 600.0 / speed_mps.max(3.0) + f64::from(BEGUN_S);
    let half_s = 0.5 * (span_s + f64::from(BEGUN_S));
    wild.place(500.0 - speed_mps * half_s, 300.0);
    let mut setup = wild.flown(Interference::Unknown)?;
    setup.settings.listen = Some(Listen::following(relays));
    let none = FigureError::Unsettled("an interferer that moves");
    let Some(sky) = &mut setup.sky else {
        return Err(none);
    };
    sky.velocity_mps = [speed_mps, 0.0];
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "some minutes"
    )]
    let span_ms = (span_s * 1e3) as u64;
    sky.until = Instant::from_millis(span_ms);
    let sky = sky.clone();
    let outcome = run(setup)?;
    let begun = Instant::from_millis(u64::from(BEGUN_S) * 1_000);
    let (mut followed, mut stayed, mut moments) = (0.0, 0.0, 0.0);
    let mut first = None;
    for stand in outcome.stands.iter().filter(|stand| stand.at >= begun) {
        let scene = sky.scene_at(stand.at);
        let places = wild.with(&scene).told()?;
        let best = scene.chain_sir(&places);
        let first = first.get_or_insert(places);
        followed += scene.chain_sir(&stand.places) / best;
        stayed += scene.chain_sir(first) / best;
        moments += 1.0;
    }
    // At least a minute of samples, one per second.
    if moments > 50.0 {
        Ok((followed / moments, stayed / moments))
    } else {
        Err(none)
    }
}

/// Returns the arithmetic mean; NaN if empty.
#[expect(clippy::cast_precision_loss, reason = "a few")]
pub fn mean(shares: &[f64]) -> f64 {
    shares.iter().sum::<f64>() / shares.len() as f64
}
