//! Uploads: offers that relays can fly, their stored part, and their digest.

use serde_json::json;
use uav_relay_decode::envelope::sealed;

use super::message::WireMessage;

/// Names of the fields with the surveyed positions of Tx and Rx. All are 0 for a mission without these positions.
pub(crate) const SITES: [&str; 6] = [
    "tx_lat_e7",
    "tx_lon_e7",
    "tx_amsl_mm",
    "rx_lat_e7",
    "rx_lon_e7",
    "rx_amsl_mm",
];

/// Offset of the number of relays from the start of an offer's body, bytes. A body is a frame without header and CRC.
const RELAYS: usize = 5;
/// Offset of the noise power from the start of an offer's body, bytes. A body is a frame without header and CRC.
const NOISE: usize = 83;
/// Offset in an offer's body, bytes, of the fields of the direction Rx to Tx. They are `reverse` and the power of Rx.
const BACK: usize = 87;
/// Offset in an offer's body, bytes, of the SNR gap for time slots that are as long as each hop needs.
const GAP: usize = 95;
const SITES_AT: usize = 99;

/// Length of a mission offer's body, bytes.
pub(crate) const BYTES: usize = 125;
/// Length of the part of a mission offer's body that a relay stores, bytes. This is the whole body without the number
/// of the answered hello.
pub(crate) const KEPT: usize = 123;

/// Returns an offer of mission `version` that eight relays can fly. Their mission before flight has the digest
/// `base`.
pub(crate) fn upload(version: u16, base: u16) -> WireMessage {
    let fields = json!({
        "version": version, "base": base, "relays": 8, "distance_m": 1000.0, "min_separation_m": 4.0,
        "tx_power_w": 80.0, "altitude_m": 20.0, "power_w": 1.0,
        "interferer_power_w": 62.5, "interferer_x_m": 600.0, "interferer_y_m": -250.5, "tolerance": 1e-4,
        "mu_los": 7000.0, "mu_nlos": 900_000.5, "eta": 7000.25,
        "altitude_min_m": 20.0, "altitude_max_m": 300.0, "lateral_min_m": -60.0, "lateral_max_m": 40.5,
        "noise_w": 0.0, "reverse": 0.0, "rx_power_w": 80.0, "fitted_gap": 0.0, "tx_lat_e7": 0, "tx_lon_e7": 0, "tx_amsl_mm": 0,
        "rx_lat_e7": 0, "rx_lon_e7": 0, "rx_amsl_mm": 0, "offer_number": 0,
    });
    WireMessage::new("Offer", &fields)
}

/// Returns the offer with surveyed positions of Tx and Rx: latitude, longitude and height of each.
pub(crate) fn with_sites(offer: &WireMessage, sites: [i32; 6]) -> WireMessage {
    let sites = SITES.into_iter().zip(sites);
    offer.with(sites.map(|(name, number)| (name, json!(number))).collect())
}

/// Returns the part of an offer that a relay stores across a reboot.
pub(crate) fn kept(offer: &WireMessage) -> Vec<u8> {
    offer.body()[..KEPT].to_vec()
}

/// Returns the digest and version of an offered mission.
///
/// The digest is the low half of a CRC-32C of the mission's numbers. If the offer has surveyed positions of Tx and
/// Rx, the digest also covers these.
pub(crate) fn mission_id(offer: &WireMessage) -> (u16, u16) {
    let body = offer.body();
    let mut covered = body[RELAYS..NOISE].to_vec();
    // Noise and a relative SIR of 0 are left out.
    let fits = offer.number("fitted_gap") > 0.0;
    if offer.number("noise_w") > 0.0 || fits {
        covered.extend(&body[NOISE..BACK]);
    }
    if offer.number("reverse") > 0.0 || fits {
        covered.extend(&body[BACK..GAP]);
    }
    if fits {
        covered.extend(&body[GAP..SITES_AT]);
    }
    let digest = between(offer, low_half(&covered));
    (digest, offer.number("version") as u16)
}

/// Returns the mission digest `digest` combined with the Tx and Rx positions of `offer`, if any.
pub(crate) fn between(offer: &WireMessage, digest: u16) -> u16 {
    let sites = &offer.body()[SITES_AT..KEPT];
    if sites.iter().all(|byte| *byte == 0) {
        return digest;
    }
    low_half(&[&digest.to_le_bytes()[..], sites].concat())
}

/// Returns the low 16 bits of the CRC-32C of `bytes`.
pub(crate) fn low_half(bytes: &[u8]) -> u16 {
    let sealed = sealed(bytes.to_vec());
    u16::from_le_bytes([sealed[bytes.len()], sealed[bytes.len() + 1]])
}
