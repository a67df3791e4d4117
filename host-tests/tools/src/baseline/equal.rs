//! Equal spacing; a single relay goes to the middle.

use uav_relay_scenario::scene::Scene;

/// Returns the positions k D / (N + 1), m from Tx. Work: one division per relay.
pub fn places(scene: &Scene) -> Vec<f64> {
    let hops = (scene.relays.len() + 1) as f64;
    (1..=scene.relays.len())
        .map(|k| scene.distance_m * k as f64 / hops)
        .collect()
}
