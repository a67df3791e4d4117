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
