//! States of the link to an autopilot.
//!
//! | state | what is sent | leaves it |
//! | --- | --- | --- |
//! | `Silent` | HEARTBEAT | the autopilot is heard: `Grounded` |
//! | `Grounded` | and requests for messages, TIMESYNC | silent 3 s: `Silent`; armed and in the air: `Standby` |
//! | `Standby` | and, to a PX4 once a mode was chosen and the relay is ready, the present position as a target | silent: `Silent`; on the ground or disarmed: `Grounded`; mode granted after a mode was chosen, position known: `Engaged` |
//! | `Engaged` | and the target, on its way to the setpoint | silent: `Silent`; on the ground or disarmed: `Grounded`; another mode, or the choice is forgotten: `Standby`; no position for 1 s, or the link of an ArduCopter late: `Blind` |
//! | `Blind` | and the last target, frozen | as `Engaged`; position known for 1 s, or for 10 s after it was blind in the last minute: `Engaged`, from the drone's own place |
//!
//! *A mode was chosen* is an observation of this link, which no memory of an earlier one replaces:
//!
//! | autopilot | it is set by a heartbeat that is not late, in a mode | it is forgotten at |
//! | --- | --- | --- |
//! | PX4 | other than OFFBOARD, `system_status` ACTIVE (4) | start, restart, disarming; `system_status` CRITICAL (5) or above; nothing heard for 0.8 s; no echo of the last 1.5 s; a position that comes 1 s late; a target that is sent 0.6 s late |
//! | ArduCopter | other than GUIDED, not CRITICAL | start, restart, disarming; no heartbeat for 3 s |
//!
//! So a link that finds OFFBOARD or GUIDED granted engages nothing and streams nothing: the pilot chooses another mode first, and is told so.
//! A PX4's failsafe is ended by the pilot's choice of a mode alone. Nothing else changes a state: no setpoint, no message of a neighbour.

use crate::flight::autopilot::vehicle::Kind;

/// Who flies.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// No autopilot is heard.
    #[default]
    Silent,
    /// The drone is on the ground, or not armed.
    Grounded,
    /// It is in the air, and somebody else flies it.
    Standby,
    /// It flies to the relay's setpoint.
    Engaged,
    /// It would, but nobody knows where it is: it keeps the last target.
    Blind,
}

/// What the state follows from.
#[expect(
    clippy::struct_excessive_bools,
    reason = "what is seen of an autopilot, each for itself"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Observed {
    /// The autopilot was heard within 3 s.
    pub(super) there: bool,
    /// Armed, and in the air.
    pub(super) flying: bool,
    /// The mode lets a companion say where to fly, and the pilot has chosen it before this link.
    pub(super) granted: bool,
    /// The position is known.
    pub(super) located: bool,
}

impl State {
    /// The state after `observed`.
    pub(super) const fn next(self, observed: Observed) -> Self {
        let Observed {
            there,
            flying,
            granted,
            located,
        } = observed;
        match self {
            _ if !there => Self::Silent,
            _ if !flying => Self::Grounded,
            // One step at a time: each state sends what it has to before the next.
            Self::Silent => Self::Grounded,
            Self::Grounded => Self::Standby,
            _ if !granted => Self::Standby,
            Self::Standby if !located => Self::Standby,
            Self::Standby | Self::Engaged | Self::Blind if located => Self::Engaged,
            Self::Standby | Self::Engaged | Self::Blind => Self::Blind,
        }
    }

    /// Whether the relay's setpoint is flown.
    pub const fn is_flown(self) -> bool {
        matches!(self, Self::Engaged)
    }
}

/// What the autopilot is doing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FlightMode {
    /// OFFBOARD or GUIDED: the relay may say where to fly.
    Companion,
    /// A mode that is flown with the sticks.
    Sticks,
    /// It holds its place: Hold, LOITER.
    Hold,
    /// It stops and holds its place: BRAKE.
    Brake,
    /// It returns: RTL, SMART_RTL.
    Return,
    /// It lands.
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

/// Why the drone is not flown by the relay any more.
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
    /// The link was interrupted or late: a PX4 may be in its failsafe, which a stream of targets would end.
    Link,
}

/// A release: its cause, and the mode that the autopilot has now.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Release {
    /// Why.
    pub cause: ReleaseCause,
    /// What the autopilot does now.
    pub mode: FlightMode,
}

impl Release {
    /// Returns the line for the operator, in two parts.
    pub(super) const fn text(self) -> [&'static str; 2] {
        let mode = match self.mode {
            FlightMode::Companion => "relay: released",
            FlightMode::Sticks => "relay: released to the sticks",
            FlightMode::Hold => "relay: released, holds its place",
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

/// Why the pilot cannot engage the drone, or why the mode was found but not used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WaitReason {
    /// The autopilot is in its failsafe. It ends when the pilot chooses a mode.
    Failsafe,
    /// Bytes from the autopilot come late.
    Link,
    /// OFFBOARD or GUIDED was not chosen before this link: another mode has to be chosen first.
    Found,
    /// No mode that the pilot has chosen was seen yet.
    Unseen,
    /// There is no position, or none near the line.
    Position,
    /// The relay is not ready ([`handle_ready`](super::Autopilot::handle_ready)).
    NotReady,
}

impl WaitReason {
    /// Returns the line for the operator.
    pub(super) const fn text(self) -> &'static str {
        match self {
            Self::Failsafe => "relay: waits, the autopilot is in a failsafe",
            Self::Link => "relay: waits, the autopilot's link is late",
            Self::Found => "relay: waits, take another mode first",
            Self::Unseen => "relay: waits, no mode was chosen yet",
            Self::Position => "relay: waits, no position near the line",
            Self::NotReady => "relay: waits, not in order with its neighbours",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Observed, State};

    const ALL: [State; 5] = [
        State::Silent,
        State::Grounded,
        State::Standby,
        State::Engaged,
        State::Blind,
    ];

    fn observations() -> impl Iterator<Item = Observed> {
        (0..16_u8).map(|bits| Observed {
            there: bits & 1 != 0,
            flying: bits & 2 != 0,
            granted: bits & 4 != 0,
            located: bits & 8 != 0,
        })
    }

    #[expect(clippy::match_same_arms, reason = "as the table has them")]
    #[test]
    fn the_table_is_the_machine() {
        for state in ALL {
            for seen in observations() {
                let next = state.next(seen);
                let expected = match state {
                    _ if !seen.there => State::Silent,
                    State::Silent => State::Grounded,
                    _ if !seen.flying => State::Grounded,
                    State::Grounded => State::Standby,
                    _ if !seen.granted => State::Standby,
                    State::Standby if seen.located => State::Engaged,
                    State::Standby => State::Standby,
                    State::Engaged | State::Blind if seen.located => State::Engaged,
                    State::Engaged | State::Blind => State::Blind,
                };
                assert_eq!(next, expected, "{state:?} {seen:?}");
            }
        }
    }

    #[test]
    fn nothing_is_flown_that_is_not_granted_in_the_air_and_known() {
        for state in ALL {
            for seen in observations() {
                if state.next(seen).is_flown() {
                    assert!(seen.there && seen.flying && seen.granted && seen.located);
                    assert!(
                        !matches!(state, State::Silent | State::Grounded),
                        "without a step between"
                    );
                }
            }
        }
    }
}
