//! Relays at equal distances; a single one in the middle.

use crate::reference::Link;

/// The places of the relays, m from Tx: k D / (N + 1). Work: one division a relay.
pub fn places(link: &Link) -> Vec<f64> {
    let hops = (link.len() + 1) as f64;
    (1..=link.len())
        .map(|k| link.distance_m * k as f64 / hops)
        .collect()
}
