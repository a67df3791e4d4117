//! An end whose receiver is broken: the transmitter or the receiver measures something else than follows from what the relays hear.
//!
//! What an end should hear follows from the source that the relays hear and from what the mission says of the path over the ground. Of each end:
//!
//! | the transmitter | the receiver | what follows |
//! | --- | --- | --- |
//! | fits | does not | the receiver's sensor is off: what it says is left out, the mission's path counts |
//! | does not | fits | the transmitter's sensor is off |
//! | does not | does not, by the same factor | the ground takes more or less than the mission says: the receiver counts |
//! | does not, or says nothing | does not, or not alike | nobody knows who is wrong, or a hill is in the way: the receiver counts |
//!
//! The relays have to be three or more, of one mind, and more than the unknowns. An end that was off stays so until it fits, or the other one does not.

use super::doubt::is_apart;
use super::fit::Fit;
use super::level::{EndsOff, Level, Levels};
use super::terms::{UNIT_W, terms};
use crate::mission::Mission;
use crate::place::Placement;

/// Standard deviations, squared, and the least of a difference, squared (a factor of 1.5), from which on an end does not fit.
const APART: (f64, f64) = (49.0, 0.174);

/// Of fewer relays, and two ends, nobody can tell who is wrong.
const FEWEST: u16 = 3;

/// What an end says over what it should, and its variance, relative.
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

/// The v of an end that hears `level`, over the ground that the mission says.
pub(super) fn v_at_end(mission: &Mission, level: Level) -> f64 {
    let channel = mission.config().channel;
    f64::from(UNIT_W) * (channel.eta() / channel.mu_nlos()) / f64::from(level.power_w)
}

/// Holds what the ends say against what the relays hear, whose fit is `fit`.
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
        // The difference is taken relative to the smaller of the two, and so is the error of what is expected.
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
        // The one that was off is still the one; of the other nothing new is known.
        (None, Some(rx)) if before.receiver && !rx.fits() => before,
        (Some(tx), None) if before.transmitter && !tx.fits() => before,
        (None, Some(end)) | (Some(end), None) => off(false, false, !end.fits()),
        (None, None) => before,
        (Some(_), Some(_)) => EndsOff::NONE,
    }
}
