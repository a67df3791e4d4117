//! Measurements that the firmware passes to a relay or a ground station.

use crate::place::Placement;

/// Measurement of a relay or of a ground station.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Sample {
    /// Interference power at a relay's setpoint, for a mission with an interference field.
    ///
    /// In such a mission the interference is known only as a function of x.
    Interference {
        /// Received interference power, W: above 0, at most `Measure::i_max_w`.
        power_w: f32,
    },
    /// Mean interference power at a position, for the estimate of an unknown interferer.
    ///
    /// The firmware averages the power until the relative error of the mean is the error stated in
    /// [`Listen`](crate::sensing::Listen). The power excludes the chain's signals, and includes the receiver's noise.
    /// The relay subtracts this noise (`MissionConfig::noise_w`).
    Heard {
        /// Position of the drone at the measurement. Each coordinate differs from that of Tx by at most 100 times the
        /// distance from Tx to Rx.
        at: Placement,
        /// Received power, W. The power must exceed the receiver's noise by 1e-30 to 1e6 W (`MEASURED_W`).
        power_w: f32,
    },
    /// Mean interference power measured at Tx, on the ground. The firmware passes it to one of the first four relays,
    /// usually relay 1.
    Transmitter {
        /// Received power, W: 1e-30 to 1e6.
        power_w: f32,
    },
    /// Mean interference power measured at Rx, on the ground. The firmware passes it to the last relay of the view. The
    /// firmware can also pass it to each of the three relays before the last one. Such a relay uses the value only once
    /// it is the last relay itself.
    Receiver {
        /// Received power, W: 1e-30 to 1e6.
        power_w: f32,
    },
    /// SIR of the hop from Tx, measured by relay 1 at its setpoint. The relay derives the interference power from it.
    FirstHop {
        /// Signal-to-interference ratio (SIR), linear, above 0.
        sir: f32,
    },
}

impl Sample {
    /// Returns true for measurements of an unknown interferer, which need `Settings::listen`.
    pub(crate) const fn is_heard(self) -> bool {
        matches!(
            self,
            Self::Heard { .. } | Self::Transmitter { .. } | Self::Receiver { .. }
        )
    }
}
