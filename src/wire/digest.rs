//! The 16-bit digest of a mission, by which relays tell whether they fly the same one.

use super::crc::Crc32c;
use crate::mission::Mission;

/// The low half of a CRC-32C over every parameter of `mission`; `FORMAT.md` has their order.
///
/// It tells mistakes apart, not adversaries: two different missions share a digest once in 65 536.
pub fn digest(mission: &Mission) -> u16 {
    let c = mission.config();
    let mut crc = Crc32c::new();
    crc.update(&c.relays.to_le_bytes());
    for number in [
        c.distance_m,
        c.min_separation_m,
        c.tx_power_w,
        c.common.altitude_m,
        c.common.power_w,
        c.interferer.power_w,
        c.interferer.x_m,
        c.interferer.y_m,
        c.tolerance,
    ] {
        crc.update(&number.to_le_bytes());
    }
    for number in [c.channel.mu_los(), c.channel.mu_nlos(), c.channel.eta()] {
        crc.update(&number.to_le_bytes());
    }
    let [a, b, ..] = crc.finish().to_le_bytes();
    u16::from_le_bytes([a, b])
}

#[cfg(test)]
mod tests {
    use super::digest;
    use crate::mission::tests::paper;
    use crate::mission::{Mission, MissionConfig};

    #[test]
    fn the_digest_tells_missions_apart() {
        let of = |change: fn(&mut MissionConfig)| {
            let mut config = paper(8);
            change(&mut config);
            digest(&Mission::try_new(config).unwrap())
        };
        let same = of(|_| ());
        assert_eq!(same, of(|_| ()));
        assert_ne!(same, of(|c| c.relays = 9));
        assert_ne!(same, of(|c| c.interferer.y_m = c.interferer.y_m.next_up()));
        assert_ne!(same, of(|c| c.tolerance = 2e-4));
    }
}
