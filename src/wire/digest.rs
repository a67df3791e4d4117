//! Digest and identifier of a mission, by which relays detect different missions.

use crc::{Digest, Table};

use super::CRC_32C;
use crate::features::{ALTITUDE, REVERSE};
use crate::geodetic::Sites;
use crate::mission::{Interference, Mission, MissionConfig};

/// Returns the low half of a CRC-32C over every parameter of `mission`, in the order of `FORMAT.md`.
///
/// It detects mistakes, not attacks: two different missions have the same digest with a probability of 1 in 65 536.
pub fn digest(mission: &Mission) -> u16 {
    of(mission.config())
}

impl Mission {
    /// Returns the 16-bit digest of all parameters. Relays detect by it that their missions differ.
    ///
    /// It detects mistakes, not attacks: two different missions have the same digest with a probability of 1 in 65 536.
    pub fn digest(&self) -> u16 {
        digest(self)
    }
}

pub(super) fn of(c: &MissionConfig) -> u16 {
    let mut crc = CRC_32C.digest();
    add(&mut crc, &c.relays.to_le_bytes());
    for number in [
        c.distance_m,
        c.min_separation_m,
        c.tx_power_w,
        c.common.altitude_m,
        c.common.power_w,
    ] {
        add(&mut crc, &number.to_le_bytes());
    }
    match c.interference {
        Interference::Source(interferer) => {
            for number in [interferer.power_w, interferer.x_m, interferer.y_m] {
                add(&mut crc, &number.to_le_bytes());
            }
        }
        // An interferer's power is never 0.
        Interference::Unknown => add(&mut crc, &[0; 12]),
        Interference::Field(field) => {
            for point in field.points() {
                add(&mut crc, &point.x_m.to_le_bytes());
                add(&mut crc, &point.upsilon_per_w.to_le_bytes());
            }
        }
    }
    add(&mut crc, &c.tolerance.to_le_bytes());
    for number in [c.channel.mu_los(), c.channel.mu_nlos(), c.channel.eta()] {
        add(&mut crc, &number.to_le_bytes());
    }
    for band in [c.band, c.lateral] {
        add(&mut crc, &band.least_m.to_le_bytes());
        add(&mut crc, &band.most_m.to_le_bytes());
    }
    let fits = ALTITUDE && c.fitted_gap > 0.0;
    // Noise of 0 is omitted, so that missions without noise keep their earlier digest.
    if c.noise_w > 0.0 || fits {
        add(&mut crc, &c.noise_w.to_le_bytes());
    }
    // Likewise for the way back. With noise or without it, the two numbers make the input longer by eight bytes.
    if REVERSE && c.reverse > 0.0 || fits {
        add(&mut crc, &c.reverse.to_le_bytes());
        add(&mut crc, &c.rx_power_w.to_le_bytes());
    }
    // Fitted slots make the input longer than all others.
    if fits {
        add(&mut crc, &c.fitted_gap.to_le_bytes());
    }
    low_half(crc.finalize())
}

#[inline(never)] // called from many places
fn add(crc: &mut Digest<'_, u32, Table<1>>, bytes: &[u8]) {
    crc.update(bytes);
}

/// Returns `digest` combined with `sites`, the Tx and Rx positions of an uploaded mission. If `sites` is `None`, the
/// result is `digest`.
pub(crate) fn between(digest: u16, sites: Option<Sites>) -> u16 {
    let Some(sites) = sites else { return digest };
    let mut crc = CRC_32C.digest();
    crc.update(&digest.to_le_bytes());
    crc.update(&sites.to_bytes());
    low_half(crc.finalize())
}

const fn low_half(crc: u32) -> u16 {
    let [a, b, ..] = crc.to_le_bytes();
    u16::from_le_bytes([a, b])
}

/// Identifier of a mission: of an uploaded one, or of the mission loaded before flight.
///
/// Ordered by version. If two missions have the same version, the one with the larger digest counts as newer.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MissionId {
    /// Version that the operator gave to the uploaded mission, from 1. 0 for the mission loaded before flight.
    pub version: u16,
    /// Digest of the mission with all relays that it configures, not only those in the current view.
    pub digest: u16,
}
