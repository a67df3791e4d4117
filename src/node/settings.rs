//! Who a relay is and how it behaves, checked once when it is switched on.

use crate::mission::{Mission, Profile};
use crate::placement::search::Schedule;
use crate::time::Duration;

/// Which relay this is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity {
    /// Number of the network; frames of any other are ignored.
    pub network: u16,
    /// Place in the chain, 1 (next to the transmitter) to N.
    pub index: u16,
}

/// How the relay is connected to its neighbours.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Wiring {
    /// A link of its own to each neighbour: two serial ports.
    #[default]
    Pair,
    /// One channel that both neighbours, and perhaps others, hear: one radio.
    Shared,
}

/// What a firmware may choose.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// What this relay holds, if not what the mission has in common.
    pub profile: Option<Profile>,
    /// Which targets the head tries; the others follow.
    pub schedule: Schedule,
    /// Whether the head first solves the chain from the mission, with the bracketed schedule: one round trip if it is right.
    pub predict: bool,
    /// Two links or one channel.
    pub wiring: Wiring,
    /// The longest that a full frame takes from one relay's `poll_transmit` to the next one's, its computing included; above 0.
    pub hop_time: Duration,
    /// After this long without a frame from a neighbour it is asked for a sign of life; above 0.
    pub quiet: Duration,
    /// After this long without one it counts as lost; above `quiet`.
    pub lost: Duration,
}

impl Default for Settings {
    /// Bracketed with prediction, two links of 57 600 baud or faster, a silent neighbour lost after 15 s.
    fn default() -> Self {
        Self {
            profile: None,
            schedule: Schedule::Bracketed,
            predict: true,
            wiring: Wiring::Pair,
            hop_time: Duration::from_millis(30),
            quiet: Duration::from_millis(5_000),
            lost: Duration::from_millis(15_000),
        }
    }
}

/// Which part of an [`Identity`] or of [`Settings`] was refused, and its range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SetupError {
    /// `index` is not within 1 to the mission's N.
    Index,
    /// `profile.altitude_m` is not within 0.1 to 1e5, or `profile.power_w` not within 1e-6 to 1e6.
    Profile,
    /// The step of the fixed-step schedule is not a number above 0.
    Step,
    /// `hop_time` is zero.
    HopTime,
    /// `quiet` is zero, or `lost` not above it.
    Silence,
}

impl core::fmt::Display for SetupError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Index => "index must be within 1 to the mission's number of relays",
            Self::Profile => {
                "profile.altitude_m must be within 0.1 to 1e5, profile.power_w within 1e-6 to 1e6"
            }
            Self::Step => "the fixed step must be above 0",
            Self::HopTime => "hop_time must be above 0",
            Self::Silence => "quiet must be above 0 and lost above quiet",
        })
    }
}

impl core::error::Error for SetupError {}

/// Checks both against the mission.
pub(crate) fn check(
    mission: &Mission,
    identity: Identity,
    settings: &Settings,
) -> Result<(), SetupError> {
    if identity.index < 1 || identity.index > mission.relays() {
        return Err(SetupError::Index);
    }
    if settings.profile.is_some_and(|profile| !profile.is_valid()) {
        return Err(SetupError::Profile);
    }
    if let Schedule::FixedStep { step } = settings.schedule
        && !(step > 0.0 && step.is_finite())
    {
        return Err(SetupError::Step);
    }
    if settings.hop_time.as_micros() == 0 {
        return Err(SetupError::HopTime);
    }
    if settings.quiet.as_micros() == 0 || settings.lost <= settings.quiet {
        return Err(SetupError::Silence);
    }
    Ok(())
}
