//! Measurements of a relay, and the interference that it derives from them at its setpoint.
//!
//! The estimate is replaced once the number of samples of `Settings::measure` has been taken at a position. Before that the
//! estimate of the last position is used, so a relay reports the same value during one agreement.

use crate::features::FIELD;
use crate::field::estimate::{Estimate, Estimator};
use crate::field::is_upsilon;
use crate::mission::Mission;
use crate::place::Placement;
use crate::settings::Measure;
use crate::sir::square;

/// Measurement of a relay or of a ground station, which the firmware gives to the relay.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Sample {
    /// Interference power at a relay's setpoint, for a mission with an interference field. A field is a known
    /// distribution of the interference along x.
    Interference {
        /// Received interference power, W: above 0, at most `Measure::i_max_w`.
        power_w: f32,
    },
    /// Mean interference power at a position, for the estimate of an unknown interferer.
    ///
    /// The firmware averages it until the relative error of the mean is the one in
    /// [`Listen`](crate::sensing::Listen). It excludes the signals of the chain, and includes the receiver's noise,
    /// which the relay subtracts (`MissionConfig::noise_w`).
    Heard {
        /// Position of the drone at the measurement. Each coordinate differs from that of Tx by at most 100 times the
        /// distance from Tx to Rx.
        at: Placement,
        /// Received power, W: 1e-30 to 1e6 (`MEASURED_W`) above the noise.
        power_w: f32,
    },
    /// Mean interference power measured at Tx, on the ground. The firmware gives it to one of the first four relays,
    /// usually relay 1.
    Transmitter {
        /// Received power, W: 1e-30 to 1e6.
        power_w: f32,
    },
    /// Mean interference power measured at Rx, on the ground. The firmware gives the value to the last relay of the view. It may also give
    /// it to the three relays before that one, each of which uses it when it is the last relay.
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
    /// Returns true for measurements from which an unknown interferer is estimated. They need `Settings::listen`.
    pub(crate) const fn is_heard(self) -> bool {
        matches!(
            self,
            Self::Heard { .. } | Self::Transmitter { .. } | Self::Receiver { .. }
        )
    }
}

/// Average of the interference samples that the firmware has measured at the setpoint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meter {
    estimator: Option<(Estimator, u32)>,
    published: Option<f32>,
}

impl Meter {
    pub(crate) const fn new(measure: Option<Measure>) -> Self {
        Self {
            estimator: match measure {
                Some(Measure { i_max_w, samples }) if FIELD => {
                    Some((Estimator::new(i_max_w), samples))
                }
                _ => None,
            },
            published: None,
        }
    }

    /// Adds a sample; returns true if it was accepted. `at` is relay 1's setpoint, by which a measured SIR of the
    /// first hop is converted to interference; `None` at other relays.
    pub(crate) fn take(
        &mut self,
        mission: &Mission,
        at: Option<Placement>,
        sample: Sample,
    ) -> bool {
        let Some((estimator, wanted)) = self.estimator.as_mut().filter(|_| FIELD) else {
            return false;
        };
        let power_w = match (sample, at) {
            (Sample::Interference { power_w }, _) => power_w,
            (Sample::FirstHop { sir }, Some(at)) => {
                let squared = square(at.x_m) + square(at.y_m) + square(at.altitude_m);
                mission.first_hop_power_w(squared) / sir
            }
            _ => return false,
        };
        let before = estimator.accepted();
        estimator.push(power_w);
        let used = estimator.accepted() > before;
        if used && estimator.accepted() == *wanted {
            let upsilon = estimator.estimate().map(|estimate| estimate.upsilon_per_w);
            // Without a valid estimate the agreed field is better than the estimate of another position.
            self.published = upsilon.filter(|upsilon| is_upsilon(*upsilon));
        }
        used
    }

    /// Discards the samples averaged so far, because the relay moves.
    pub(crate) fn restart(&mut self) {
        if let Some((estimator, _)) = &mut self.estimator {
            estimator.clear();
        }
    }

    pub(crate) fn estimate(&self) -> Option<Estimate> {
        self.estimator.as_ref()?.0.estimate()
    }

    pub(crate) const fn published(&self) -> Option<f32> {
        if FIELD { self.published } else { None }
    }
}
