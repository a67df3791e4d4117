//! Relays at equal distances; a single one in the middle.

use uav_relay_scenario::scene::Scene;

/// The places of the relays, m from Tx: k D / (N + 1). Work: one division a relay.
pub fn places(scene: &Scene) -> Vec<f64> {
    let hops = (scene.relays.len() + 1) as f64;
    (1..=scene.relays.len())
        .map(|k| scene.distance_m * k as f64 / hops)
        .collect()
}
