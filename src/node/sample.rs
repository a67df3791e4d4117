//! The interference that a relay measures where it stands, and when it believes what it has measured.
//!
//! Samples are gathered until there are as many as `Settings::measure` asks for; only then is what they say used, and until
//! as many have come at another place it does not change: within one agreement a relay always says the same.

use crate::field::estimate::{Estimate, Estimator};
use crate::field::is_upsilon;
use crate::mission::Mission;
use crate::place::Placement;
use crate::settings::Measure;
use crate::sir::square;

/// Whether this crate was built for fields. Without that, no `Settings` with `measure` is taken, and none of the code is reached.
const FIELD: bool = cfg!(feature = "field");

/// One measurement.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Sample {
    /// Received interference power, W.
    Interference {
        /// That power, W: above 0, at most `Measure::i_max_w`.
        power_w: f32,
    },
    /// The mean interference power that was received at a place on the way or where the drone hovers, over enough time that its
    /// relative error is that of [`Listen`](crate::settings::Listen): without the signals of the chain itself; with the noise of the receiver,
    /// which the mission tells (`MissionConfig::noise_w`) and the relay takes off.
    Heard {
        /// Where the drone was: at most 100 D from the transmitter in each coordinate.
        at: Placement,
        /// That power, W: 1e-30 to 1e6 (`MEASURED_W`) above the noise.
        power_w: f32,
    },
    /// The same at the ground transmitter, handed to relay 1, or to any of the first four.
    Transmitter {
        /// That power, W: 1e-30 to 1e6.
        power_w: f32,
    },
    /// The same at the ground receiver, handed to relay N, or to any of the last four: in a view the last relay's counts.
    Receiver {
        /// That power, W: 1e-30 to 1e6.
        power_w: f32,
    },
    /// SIR of the first hop, linear, as relay 1 measures it at its setpoint: what Algorithm 4 compares with the target.
    FirstHop {
        /// That SIR, linear, above 0.
        sir: f32,
    },
}

impl Sample {
    /// Whether it is for a relay that listens.
    pub(crate) const fn is_heard(self) -> bool {
        matches!(
            self,
            Self::Heard { .. } | Self::Transmitter { .. } | Self::Receiver { .. }
        )
    }
}

/// What a relay has measured.
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

    /// Takes a sample, of which `at` is where relay 1 stands; whether it was of use.
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
            // Where nothing can be said, what was agreed is better than what was true elsewhere.
            self.published = upsilon.filter(|upsilon| is_upsilon(*upsilon));
        }
        used
    }

    /// The relay goes elsewhere: what has been gathered says nothing any more.
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
