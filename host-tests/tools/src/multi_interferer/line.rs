//! The line at one altitude: interference, hop ranges and the SIR of the first hop along x.

use super::crossing::{Crossing, crossings};
use super::spans::Span;
use uav_relay_scenario::hypothetical::mesh::{Centre, graded};
use uav_relay_scenario::scene::Scene;

/// Cell width relative to the distance to the nearest source.
const STEP: f64 = 0.02;

const CELLS: f64 = 500.0;

/// Line above the ground at one altitude. Its samples catch every turn of the interference.
pub(super) struct Line<'a> {
    pub(super) scene: &'a Scene,
    pub(super) altitude_m: f64,
    nodes: Vec<f64>,
    /// Quiet r = (I + N)^(-1/2) at the nodes, W^(-1/2).
    quiet: Vec<f64>,
    slope: Vec<f64>,
    tops: Vec<f64>,
}

/// Hop range at some target SIR, per unit of quiet at the receiver: range = `stride` times quiet, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stride(f64);

impl<'a> Line<'a> {
    pub(super) fn new(scene: &'a Scene, altitude_m: f64) -> Self {
        let mut centres: Vec<Centre> = scene
            .sources
            .iter()
            .map(|source| Centre {
                at: source.x_m,
                width: source.y_m.hypot(altitude_m),
            })
            .collect();
        centres.push(Centre {
            at: 0.0,
            width: altitude_m,
        });
        let d = scene.distance_m;
        let nodes = graded(0.0, d, &centres, STEP, d / CELLS);
        let mut line = Self {
            scene,
            altitude_m,
            nodes,
            quiet: Vec::new(),
            slope: Vec::new(),
            tops: Vec::new(),
        };
        let sampled = line.nodes.iter().map(|&x| line.quiet_and_slope(x));
        (line.quiet, line.slope) = sampled.unzip();
        let rises: Vec<f64> = line.nodes.iter().map(|&x| line.first_rise(x)).collect();
        let turns = crossings(&line.nodes, &rises, 0.0, |x| line.first_rise(x));
        line.tops = falling(&turns);
        line
    }

    fn quiet_and_slope(&self, x: f64) -> (f64, f64) {
        let (mut power, mut change) = (self.scene.noise_w, 0.0);
        for source in &self.scene.sources {
            let dx = x - source.x_m;
            let squared = dx * dx + source.y_m * source.y_m + self.altitude_m * self.altitude_m;
            let received = source.power_w / (self.scene.eta * squared);
            power += received;
            change -= received * 2.0 * dx / squared;
        }
        let quiet = 1.0 / power.sqrt();
        (quiet, -0.5 * quiet * change / power)
    }

    /// Returns half the relative slope of the first hop's SIR at `x`, 1/m.
    fn first_rise(&self, x: f64) -> f64 {
        let (quiet, slope) = self.quiet_and_slope(x);
        slope / quiet - x / (x * x + self.altitude_m * self.altitude_m)
    }

    pub(super) fn first_sir(&self, x: f64) -> f64 {
        self.scene.sir_at(self.scene.tx(), (x, self.altitude_m))
    }

    /// Returns the position in `spans` with the best first hop; `None` if there are no spans.
    pub(super) fn best_first(&self, spans: &[Span]) -> Option<f64> {
        let ends = spans.iter().flat_map(|span| [span.low, span.high]);
        let inside = |x: &&f64| spans.iter().any(|span| span.contains(**x));
        ends.chain(self.tops.iter().filter(inside).copied())
            .max_by(|&a, &b| self.first_sir(a).total_cmp(&self.first_sir(b)))
    }

    /// Returns the stride of a relay with `power_w` watts at `target` (linear, > 0).
    pub(super) fn stride(&self, power_w: f64, target: f64) -> Stride {
        Stride((power_w / (self.scene.mu_los * target)).sqrt())
    }

    /// Returns the sender position nearest to Tx that a receiver at `x` still hears; may lie behind Tx.
    pub(super) fn heard_from(&self, stride: Stride, x: f64) -> f64 {
        x - stride.0 * self.quiet_and_slope(x).0
    }

    /// Returns the local minima of [`Line::heard_from`] inside the line.
    pub(super) fn far_receivers(&self, stride: Stride) -> Vec<f64> {
        // The slope of `heard_from` is 1 - stride x slope of the quiet.
        let level = 1.0 / stride.0;
        falling(&crossings(&self.nodes, &self.slope, level, |x| {
            self.quiet_and_slope(x).1
        }))
    }

    /// Returns the receiver positions whose hop range is at least `apart` metres (>= 0).
    pub(super) fn hearing(&self, stride: Stride, apart: f64) -> Vec<Span> {
        let level = apart / stride.0;
        let turns = crossings(&self.nodes, &self.quiet, level, |x| {
            self.quiet_and_slope(x).0
        });
        let hears = |x: f64| self.quiet_and_slope(x).0 >= level;
        let mut spans = Vec::new();
        let mut low = hears(0.0).then_some(0.0);
        for turn in turns {
            if turn.rising {
                low = Some(turn.at);
            } else if let Some(low) = low.take() {
                spans.push(Span { low, high: turn.at });
            }
        }
        let high = self.scene.distance_m;
        spans.extend(low.map(|low| Span { low, high }));
        spans
    }

    /// Returns the position nearest to Tx at which the last relay meets `target` at Rx. The relay has `power_w` watts; `target` is
    /// linear and above 0.
    ///
    /// At least 0; `None` if the target is missed even above Rx.
    pub(super) fn last_from(&self, power_w: f64, target: f64) -> Option<f64> {
        let scene = self.scene;
        let squared = power_w / (scene.eta * target * (scene.interference_rx_w() + scene.noise_w));
        let across = squared - self.altitude_m * self.altitude_m;
        (across >= 0.0).then(|| (scene.distance_m - across.sqrt()).max(0.0))
    }
}

/// Returns the falling crossings. Maxima of the integral, or points where the function drops below the level.
fn falling(turns: &[Crossing]) -> Vec<f64> {
    let falling = turns.iter().filter(|turn| !turn.rising);
    falling.map(|turn| turn.at).collect()
}
