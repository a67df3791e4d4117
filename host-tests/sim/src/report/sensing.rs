//! Report of a run whose relays had to find the interferer by measuring.

use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::sensing::estimate::InterferenceEstimate;
use uav_relay::{Interference, Interferer, Mission, MissionConfig};

use super::hops::db;
use crate::simulator::chain::run;
use crate::simulator::outcome::Outcome;
use crate::simulator::setup::Setup;
use crate::simulator::true_interference::TrueInterference;
use crate::simulator::watch::without_other_relays;
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::Scene;

/// Interferer as the relays estimate it from their measurements.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct BelievedReport {
    /// Estimated transmit power of the interferer, W.
    pub power_w: f32,
    /// Estimated position along the line from Tx to Rx, m.
    pub x_m: f32,
    /// Estimated lateral offset, m; positive to the right of the line Tx to Rx as seen from Tx. The sign is arbitrary
    /// if relays never left the line.
    pub y_m: f32,
}

/// Quality of the relays' interference estimate, and of the positions chosen with this estimate.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct SensingReport {
    /// Interferer as relay 1 estimates it at the end of the run; absent without an estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub believed: Option<BelievedReport>,
    /// Number of agreements on positions in the run; the first agreement is included.
    pub agreements: u32,
    /// Linear SIR of the worst hop at the end, with the true interferers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub true_sir: Option<f64>,
    /// Linear SIR that the relays would reach if they knew the interferer. Absent if the scenario has several
    /// interferers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimum_sir: Option<f64>,
    /// Ratio of `true_sir`, the SIR at the end, to `optimum_sir`, the SIR with a known interferer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share_of_optimum: Option<f64>,
    /// Mean of `share_of_optimum`, true SIR / optimum SIR, over all measurements since the first agreement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_share_of_optimum: Option<f64>,
}

impl SensingReport {
    /// Creates the report of a run of `setup`; `None` if the relays measured no interference.
    pub fn of(setup: &Setup, outcome: &Outcome) -> Option<Self> {
        let true_interference = setup.true_interference.as_ref()?;
        let believed = outcome.relays.first().map(|relay| relay.believed.estimate);
        let mut report = Self {
            believed: match believed {
                Some(InterferenceEstimate::Source { source, .. }) => Some(BelievedReport {
                    power_w: source.power_w,
                    x_m: source.x_m,
                    y_m: source.y_m,
                }),
                _ => None,
            },
            ..Self::default()
        };
        let mut shares = Vec::new();
        let mut still: Option<(Vec<u16>, Option<f64>)> = None;
        for stand in outcome
            .snapshots
            .iter()
            .filter(|stand| stand.agreements > 0)
        {
            let scene = with_relays(true_interference.scene_at(stand.at), &stand.nodes);
            let sir = scene.chain_sir(&stand.places);
            report.true_sir = Some(sir);
            report.agreements = stand.agreements;
            // The optimum for a fixed interferer and the same relays is computed once.
            let known = still.take().filter(|(nodes, _)| *nodes == stand.nodes);
            let optimum =
                known.map_or_else(|| optimum(setup, &scene, &stand.nodes), |(_, known)| known);
            if !moves(true_interference) {
                still = Some((stand.nodes.clone(), optimum));
            }
            report.optimum_sir = optimum;
            report.share_of_optimum = optimum.map(|optimum| sir / optimum);
            shares.extend(report.share_of_optimum);
        }
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        report.mean_share_of_optimum = (!shares.is_empty()).then_some(mean);
        Some(report)
    }

    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        _ = match self.believed {
            Some(believed) => writeln!(
                text,
                "estimate: an interferer of {:.3} W at x = {:.1} m, |y| = {:.1} m, after {} agreements",
                believed.power_w,
                believed.x_m,
                believed.y_m.abs(),
                self.agreements
            ),
            None => writeln!(text, "estimate: none, after {} agreements", self.agreements),
        };
        if let Some(sir) = self.true_sir {
            _ = write!(text, "true SIR {sir:.6} ({:.3} dB)", db(sir));
            if let (Some(optimum), Some(share), Some(mean)) = (
                self.optimum_sir,
                self.share_of_optimum,
                self.mean_share_of_optimum,
            ) {
                _ = write!(
                    text,
                    ", {share:.4} of the optimum {optimum:.6}; on average {mean:.4} of the optimum since the first agreement"
                );
            }
            text.push('\n');
        }
        text
    }
}

fn moves(true_interference: &TrueInterference) -> bool {
    true_interference
        .velocity_mps
        .iter()
        .any(|speed| speed.abs() > 0.0)
}

/// Returns `scene` with only the relays whose numbers (from 1) are in `nodes`.
fn with_relays(scene: Scene, nodes: &[u16]) -> Scene {
    let relay = |node: &u16| {
        scene
            .relays
            .get(usize::from(*node).checked_sub(1)?)
            .copied()
    };
    let relays = nodes.iter().filter_map(relay).collect();
    Scene { relays, ..scene }
}

/// Simulates a chain of the relays `nodes` that know the interferer; returns the linear SIR they reach.
///
/// `None` unless the scene has exactly one interferer, or if this simulation fails.
fn optimum(setup: &Setup, scene: &Scene, nodes: &[u16]) -> Option<f64> {
    let [source] = scene.sources.as_slice() else {
        return None;
    };
    let mission = Mission::try_new(MissionConfig {
        interference: Interference::Source(Interferer {
            power_w: narrow(source.power_w),
            x_m: narrow(source.x_m),
            y_m: narrow(source.y_m),
        }),
        ..*setup.mission.config()
    })
    .ok()?;
    let told = Setup {
        mission,
        ..setup.clone()
    };
    let mut told = without_other_relays(&told, nodes, 0)?;
    told.settings.listen = None;
    let outcome = run(told).ok()?;
    let places: Option<Vec<_>> = outcome.relays.iter().map(|relay| relay.setpoint).collect();
    Some(scene.chain_sir(&places?))
}
