//! Flight modes as operators know them.

use super::kind::Kind;

/// Flight mode of the autopilot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FlightMode {
    /// OFFBOARD or GUIDED: the relay sets the target.
    Companion,
    /// Mode in which the pilot steers with the sticks.
    Sticks,
    /// Hold or LOITER: the drone holds its position.
    Hold,
    /// BRAKE: the drone stops and holds its position.
    Brake,
    /// RTL or SMART_RTL: the drone returns.
    Return,
    /// Landing mode.
    Land,
    /// Another mode: a mission, a take-off.
    Other,
}

impl FlightMode {
    /// Returns the mode by its number.
    pub(super) const fn of(kind: Kind, custom_mode: u32) -> Self {
        match kind {
            Kind::Px4 => match (custom_mode >> 16 & 0xFF, custom_mode >> 24) {
                (6, _) => Self::Companion,
                (4, 3) => Self::Hold,
                (4, 5) => Self::Return,
                (4, 6) => Self::Land,
                (4, _) => Self::Other,
                _ => Self::Sticks,
            },
            Kind::ArduCopter => match custom_mode {
                4 => Self::Companion,
                5 => Self::Hold,
                6 | 21 | 27 => Self::Return,
                9 => Self::Land,
                17 => Self::Brake,
                0 | 1 | 2 | 7 | 11 | 13 | 14 | 15 | 16 => Self::Sticks,
                _ => Self::Other,
            },
        }
    }
}

/// Reason for which the relay no longer controls the drone.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ReleaseCause {
    /// Another mode was chosen, by the pilot or by a ground station.
    Chosen,
    /// The autopilot's failsafe.
    Failsafe,
    /// The autopilot's fence was breached.
    Fence,
    /// Interrupted or late link. A PX4 may be in its failsafe, which a stream of targets would end.
    Link,
}

/// Release of control: its cause, and the present mode of the autopilot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Release {
    /// Cause of the release.
    pub cause: ReleaseCause,
    /// Present mode of the autopilot.
    pub mode: FlightMode,
}

impl Release {
    /// Returns the line for the operator, in two parts.
    pub(super) const fn text(self) -> [&'static str; 2] {
        let mode = match self.mode {
            FlightMode::Companion => "relay: released",
            FlightMode::Sticks => "relay: released, manual mode",
            FlightMode::Hold => "relay: released, holds position",
            FlightMode::Brake => "relay: released, BRAKE",
            FlightMode::Return => "relay: released, returns (RTL)",
            FlightMode::Land => "relay: released, lands",
            FlightMode::Other => "relay: released, another mode",
        };
        let cause = match self.cause {
            ReleaseCause::Chosen => "",
            ReleaseCause::Failsafe => ": failsafe",
            ReleaseCause::Fence => ": fence",
            ReleaseCause::Link => ": link interrupted",
        };
        [mode, cause]
    }
}

/// Reason for which the pilot cannot engage the drone, or for which the granted mode was not used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WaitReason {
    /// The autopilot is in its failsafe. It ends when the pilot chooses a mode.
    Failsafe,
    /// Bytes from the autopilot arrive late.
    Link,
    /// OFFBOARD or GUIDED was chosen before this link started. Another mode has to be chosen first.
    Found,
    /// No mode chosen by the pilot was observed yet.
    Unseen,
    /// No position is known, or none near the line.
    Position,
    /// The relay is not ready ([`handle_ready`](super::Autopilot::handle_ready)).
    NotReady,
}

impl WaitReason {
    /// Returns the line for the operator.
    pub(super) const fn text(self) -> &'static str {
        match self {
            Self::Failsafe => "relay: waits, autopilot in failsafe",
            Self::Link => "relay: waits, autopilot link delayed",
            Self::Found => "relay: waits, change the mode first",
            Self::Unseen => "relay: waits, no mode change seen",
            Self::Position => "relay: waits, no position near the line",
            Self::NotReady => "relay: waits, out of order",
        }
    }
}
