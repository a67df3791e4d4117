//! Relays where the signal alone says: the chain that makes the weakest received signal as strong as it can be.
//!
//! The signal of a hop is p_t / (eta (d^2 + h^2)) from Tx, p_u / (mu_LoS d^2) between relays and p_u / (eta (d^2 + h^2)) to
//! Rx. Each falls with the length of its hop, so the best chain is the one whose hops, each as long as one common signal
//! allows, just cover the distance. With one relay this is the place of the largest min{p_t / (x^2 + h^2), p_u / ((D - x)^2 +
//! h^2)}.
//!
//! No relay can stand nearer to the ground than straight above it. Where the hops are longer than the distance even then,
//! many chains are equally good, and the one is taken that shortens every hop in the same proportion.

use uav_relay_scenario::scene::{Relay, Scene};

/// Halvings of the common signal: enough for any f64 bracket to close.
const HALVINGS: u32 = 200;

/// The places of the relays, m from Tx, in order. Altitude and power of the first relay hold for all of them.
///
/// Empty without relays. Work: two hundred lengths of a chain, and N places.
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

/// How long hops may be for a received signal of so many watts.
struct Hops<'a> {
    scene: &'a Scene,
    relay: &'a Relay,
}

impl Hops<'_> {
    /// The strongest signal that the weaker of the two outer hops can have, W: its relay straight above the ground station.
    fn strongest(&self) -> f64 {
        let height = self.relay.altitude_m;
        self.scene.tx_w.min(self.relay.power_w) / (self.scene.eta * height * height)
    }

    /// A hop between the ground and the relays' altitude, along x, m.
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

    /// All hops of the chain together, m.
    fn span(&self, signal_w: f64) -> f64 {
        let between = (self.scene.relays.len() - 1) as f64 * self.between(signal_w);
        self.first(signal_w) + between + self.outer(self.relay.power_w, signal_w)
    }
}
