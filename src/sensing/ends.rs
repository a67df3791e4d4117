//! Faulty receiver of the transmitter or of the ground receiver: its measurements do not fit those of the relays.
//!
//! The expected level at an end follows from the source of the relays' fit and from the mission's path loss over the ground. The
//! two ends:
//!
//! | transmitter | receiver | conclusion |
//! | --- | --- | --- |
//! | fits | does not fit | the receiver's sensor is faulty: its level is ignored, and the mission's path loss is used |
//! | does not fit | fits | the transmitter's sensor is faulty |
//! | does not fit | does not fit, by the same factor | the path loss over the ground differs from the mission's: the receiver's level is used |
//! | does not fit, or no level | does not fit, or another factor | a sensor is faulty or a hill is in the way: the receiver's level is used |
//!
//! At least three relays are required, consistent and more than the unknowns. A faulty end stays so until it fits or the other
//! does not.

use super::doubt::is_apart;
use super::fit::Fit;
use super::level::{EndsOff, Level, Levels};
use super::terms::{UNIT_W, terms};
use crate::mission::Mission;
use crate::place::Placement;

/// Minimum squared difference of an end that does not fit: in squared standard deviations, and absolutely (a factor of 1.5).
const APART: (f64, f64) = (49.0, 0.174);

/// Minimum number of relays; with fewer and two ends, the faulty one is unknown.
const FEWEST: u16 = 3;

/// Ratio of an end's level to the expected one, and its relative variance.
#[derive(Clone, Copy, Debug)]
struct Told {
    ratio: f64,
    unsure: f64,
}

impl Told {
    fn fits(&self) -> bool {
        !is_apart(self.ratio, self.unsure, APART)
    }
}

/// Returns v of an end with `level`, by the mission's path loss over the ground.
pub(super) fn v_at_end(mission: &Mission, level: Level) -> f64 {
    let channel = mission.config().channel;
    f64::from(UNIT_W) * (channel.eta() / channel.mu_nlos()) / f64::from(level.power_w)
}

/// Compares the levels of the ends with `fit`, the fit of the relays' measurements.
pub(super) fn judge(mission: &Mission, fit: &Fit, levels: &Levels, relative_error: f32) -> EndsOff {
    let before = levels.off;
    if mission.relays() < FEWEST || !fit.is_of_one_mind() {
        return before;
    }
    let distance_m = mission.config().distance_m;
    let told = |x_m, level: Level| {
        let there = terms(distance_m, Placement::on_line(x_m, 0.0));
        let expected = fit.value(&there);
        let own = f64::from(relative_error) * f64::from(relative_error);
        let ratio = v_at_end(mission, level) / expected;
        // The difference is relative to the smaller of the two, and so is the error of the expected level.
        let unsure = fit.relative_variance(&there) * (1.0 / (ratio * ratio)).max(1.0);
        let told = Told {
            ratio,
            unsure: fit.variance() + own / f64::from(level.count) + unsure,
        };
        (level.is_heard() && expected > 0.0).then_some(told)
    };
    let transmitter = told(0.0, levels.transmitter);
    let receiver = told(distance_m, levels.receiver);
    let off = |transmitter, receiver, unknown| EndsOff {
        transmitter,
        receiver,
        unknown,
    };
    match (transmitter, receiver) {
        (Some(tx), Some(rx)) if tx.fits() != rx.fits() => off(!tx.fits(), !rx.fits(), false),
        (Some(tx), Some(rx)) if !tx.fits() => {
            let alike = !is_apart(tx.ratio / rx.ratio, tx.unsure + rx.unsure, APART);
            off(false, false, !alike)
        }
        // A faulty end remains faulty; about the other one nothing new is known.
        (None, Some(rx)) if before.receiver && !rx.fits() => before,
        (Some(tx), None) if before.transmitter && !tx.fits() => before,
        (None, Some(end)) | (Some(end), None) => off(false, false, !end.fits()),
        (None, None) => before,
        (Some(_), Some(_)) => EndsOff::NONE,
    }
}
