//! Units of a SiK radio.

/// A unit, 1/1.9 dB, as a power of 2: log2(10) / 19.
const PER_UNIT: f32 = 0.174_838_32;

/// Unit 0, -127 dBm, as a power of 2 of a watt: -15.7 log2(10).
const ZERO: f32 = -52.154_27;

/// Returns the noise power between frames, W, for `noise` of RADIO_STATUS.
///
/// The radio's documentation states `signal_dBm = (RSSI / 1.9) - 127` as an approximation, and the same units for noise. `None`
/// for 255 (unknown), and for 0, which a radio reports before its first measurement and which is below any real noise.
///
/// Source: "SiK Radio, advanced configuration" of ArduPilot, on `LBT_RSSI`; mavros (`3dr_radio`) and INAV convert alike.
pub fn noise_w(noise: u8) -> Option<f32> {
    (1..=254)
        .contains(&noise)
        .then(|| libm::exp2f(ZERO + PER_UNIT * f32::from(noise)))
}

#[cfg(test)]
mod tests {
    use super::noise_w;

    #[test]
    fn the_documented_formula() {
        for noise in 1..=254_u8 {
            let dbm = f64::from(noise) / 1.9 - 127.0;
            let expected = libm::pow(10.0, (dbm - 30.0) / 10.0);
            let heard = noise_w(noise).map(f64::from);
            assert!(heard.is_some_and(|heard| (heard / expected - 1.0).abs() < 1e-5));
        }
        assert_eq!((noise_w(0), noise_w(255)), (None, None));
    }
}
