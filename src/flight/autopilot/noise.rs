//! What a SiK radio hears between frames, by its RADIO_STATUS, and where the drone was in the air.

use super::vehicle::Vehicle;
use crate::flight::mavlink::incoming::Incoming;
use crate::flight::mavlink::parser::Received;
use crate::flight::mavlink::sik::noise_w;
use crate::node::sample::Sample;
use crate::place::Placement;
use crate::time::Instant;

/// Whether this crate was built to make anything of it.
const SENSING: bool = cfg!(feature = "sensing");

/// The newest that nobody has taken.
#[derive(Clone, Debug)]
pub(super) struct RadioNoise(Option<(Placement, f32)>);

impl RadioNoise {
    pub(super) const NONE: Self = Self(None);

    /// Takes what was received, if it is of that.
    pub(super) fn hear(&mut self, now: Instant, received: &Received, vehicle: &Vehicle) {
        if SENSING && let Some(Incoming::RadioStatus { noise, .. }) = received.message {
            let heard = vehicle.place_in_air(now).zip(noise_w(noise));
            self.0 = heard.or(self.0);
        }
    }

    /// Hands it in.
    pub(super) fn take(&mut self) -> Option<Sample> {
        let (at, power_w) = self.0.take()?;
        Some(Sample::Heard { at, power_w })
    }
}
