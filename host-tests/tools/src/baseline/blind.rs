//! Interference-blind baseline: the chain that maximises the weakest received signal.
//!
//! The received power of a hop is p_t / (eta (d^2 + h^2)) from Tx, p_u / (mu_LoS d^2) between relays and p_u / (eta (d^2 + h^2))
//! to Rx. It falls with the hop length, so the best chain has the hop lengths at which all received powers are equal and the hops
//! just span the distance. With one relay this maximises min{p_t / (x^2 + h^2), p_u / ((D - x)^2 + h^2)}.
//!
//! The outer hops are at least as long as the altitude. If the hops span more than the distance even then, many chains are
//! equally good; the one that shortens every hop in the same proportion is used.

use uav_relay_scenario::scene::{Relay, Scene};

/// Bisection steps on the common received power: enough for any f64 bracket to close.
const HALVINGS: u32 = 200;

/// Returns the positions of the relays in order, m from Tx.
///
/// The altitude and power of the first relay are used for all. Empty without relays. Work: 200 chain lengths and N positions.
pub fn places(scene: &Scene) -> Vec<f64> {
    let Some(relay) = scene.relays.first() else {
        return Vec::new();
    };
    let hops = Hops { scene, relay };
    let strongest = hops.strongest();
    let mut signal = strongest;
    if hops.span(strongest) < scene.distance_m {
        let (mut covers, mut falls_short) = (0.0, strongest);
        for _ in 0..HALVINGS {
            signal = f64::midpoint(covers, falls_short);
            if hops.span(signal) >= scene.distance_m {
                covers = signal;
            } else {
                falls_short = signal;
            }
        }
    }
    let share = (scene.distance_m / hops.span(signal)).min(1.0);
    let (first, between) = (share * hops.first(signal), share * hops.between(signal));
    (0..scene.relays.len())
        .map(|before| (first + before as f64 * between).min(scene.distance_m))
        .collect()
}

/// Hop lengths as a function of the received power, W.
struct Hops<'a> {
    scene: &'a Scene,
    relay: &'a Relay,
}

impl Hops<'_> {
    /// Returns the strongest signal possible on the weaker outer hop, W. Its relay straight above the ground station.
    fn strongest(&self) -> f64 {
        let height = self.relay.altitude_m;
        self.scene.tx_w.min(self.relay.power_w) / (self.scene.eta * height * height)
    }

    /// Returns the horizontal length of a hop between the ground and the relays' altitude, m.
    fn outer(&self, power_w: f64, signal_w: f64) -> f64 {
        let height = self.relay.altitude_m;
        let squared = power_w / (self.scene.eta * signal_w) - height * height;
        squared.max(0.0).sqrt()
    }

    fn first(&self, signal_w: f64) -> f64 {
        self.outer(self.scene.tx_w, signal_w)
    }

    fn between(&self, signal_w: f64) -> f64 {
        (self.relay.power_w / (self.scene.mu_los * signal_w)).sqrt()
    }

    fn span(&self, signal_w: f64) -> f64 {
        let between = (self.scene.relays.len() - 1) as f64 * self.between(signal_w);
        self.first(signal_w) + between + self.outer(self.relay.power_w, signal_w)
    }
}
