//! Which parameter of a mission was refused.

/// Which parameter of a [`MissionConfig`](crate::MissionConfig) was refused, and its range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MissionError {
    /// `relays` is not within 1 to [`MAX_RELAYS`](crate::mission::MAX_RELAYS).
    Relays,
    /// `distance_m` is not within 1 to 1e6.
    Distance,
    /// `min_separation_m` is not within 0 to 1e5.
    Separation,
    /// The relays, `min_separation_m` (and a rounding of 5e-7 `distance_m`) apart, are longer than `distance_m`.
    TooManyForDistance,
    /// `tx_power_w` is not within 1e-6 to 1e6.
    TxPower,
    /// `common.altitude_m` is not within 0.1 to 1e5, or `common.power_w` not within 1e-6 to 1e6.
    Common,
    /// `band` is not in order, not within 0.1 to 1e5, or leaves out `common.altitude_m`.
    Band,
    /// `lateral` is not in order, not within -1e5 to 1e5, or leaves out 0.
    Lateral,
    /// `interferer.power_w` is not within 1e-6 to 1e9.
    InterfererPower,
    /// `interferer.x_m` or `interferer.y_m` is not within -1e7 to 1e7.
    InterfererPlace,
    /// `noise_w` is not within 0 to 1, or is above 1e12 times what of the interferer arrives a metre from it.
    Noise,
    /// The crate was built without its feature `field`.
    Field,
    /// `tolerance` is not within 1e-6 to 0.1.
    Tolerance,
}

impl core::fmt::Display for MissionError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Relays => "relays must be within 1 to 1000",
            Self::Distance => "distance_m must be within 1 to 1e6",
            Self::Separation => "min_separation_m must be within 0 to 1e5",
            Self::TooManyForDistance => {
                "(relays - 1) x min_separation_m must not be above distance_m"
            }
            Self::TxPower => "tx_power_w must be within 1e-6 to 1e6",
            Self::Common => {
                "common.altitude_m must be within 0.1 to 1e5, common.power_w within 1e-6 to 1e6"
            }
            Self::Band => {
                "band must be within 0.1 to 1e5, from least to most, with common.altitude_m in it"
            }
            Self::Lateral => "lateral must be within -1e5 to 1e5, from least to most, with 0 in it",
            Self::InterfererPower => "interferer.power_w must be within 1e-6 to 1e9",
            Self::InterfererPlace => "interferer.x_m and y_m must be within -1e7 to 1e7",
            Self::Noise => {
                "noise_w must be within 0 to 1, and at most 1e12 times what of the interferer arrives a metre from it"
            }
            Self::Field => "a field of interference needs the feature `field`",
            Self::Tolerance => "tolerance must be within 1e-6 to 0.1",
        })
    }
}

impl core::error::Error for MissionError {}
