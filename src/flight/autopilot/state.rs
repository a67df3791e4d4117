//! States of the link to an autopilot.
//!
//! | state | messages sent | next state |
//! | --- | --- | --- |
//! | `Silent` | HEARTBEAT | autopilot received: `Grounded` |
//! | `Grounded` | also requests for messages, TIMESYNC | nothing received for 3 s: `Silent`; armed and in the air: `Standby` |
//! | `Standby` | also, to a PX4 once a mode was chosen and the relay is ready, the present position as a target | nothing received: `Silent`; on the ground or disarmed: `Grounded`; mode granted after a mode was chosen, position known: `Engaged` |
//! | `Engaged` | also the target, on its way to the setpoint | nothing received: `Silent`; on the ground or disarmed: `Grounded`; another mode, or the choice was cleared: `Standby`; no position for 1 s, or the link of an ArduCopter late: `Blind` |
//! | `Blind` | also the last target, frozen | as `Engaged`; position known for 1 s, or for 10 s if it was blind in the last minute: `Engaged`, from the drone's own position |
//!
//! *A mode was chosen* is an observation of this link. It is not stored across restarts:
//!
//! | autopilot | set by a heartbeat that is not late, in a mode | cleared at |
//! | --- | --- | --- |
//! | PX4 | other than OFFBOARD, `system_status` ACTIVE (4) | start, restart, disarming; `system_status` CRITICAL (5) or above; nothing received for 0.8 s; no echo of the last 1.5 s; a position that arrives 1 s late; a target that is sent 0.6 s late |
//! | ArduCopter | other than GUIDED, not CRITICAL | start, restart, disarming; no heartbeat for 3 s |
//!
//! A link that finds OFFBOARD or GUIDED granted therefore engages nothing and sends no targets. The pilot has to choose another
//! mode first, and is told so. Only the pilot's choice of a mode ends a PX4's failsafe. Nothing else changes a state: no setpoint,
//! and no message of a neighbour.

/// Control state of the drone.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// No autopilot is received.
    #[default]
    Silent,
    /// The drone is on the ground, or not armed.
    Grounded,
    /// Drone in the air that is not controlled by the relay.
    Standby,
    /// Controlled by the relay: the drone flies to its setpoint.
    Engaged,
    /// Controlled by the relay without a known position: the last target is kept.
    Blind,
}

/// Observations that determine the state.
#[expect(
    clippy::struct_excessive_bools,
    reason = "what is seen of an autopilot, each for itself"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Observed {
    /// True if the autopilot was received within 3 s.
    pub(super) there: bool,
    /// True if the drone is armed and in the air.
    pub(super) flying: bool,
    /// True if the pilot has chosen the mode in which a companion sets the target. The choice was made since this link started.
    pub(super) granted: bool,
    /// True if the position is known.
    pub(super) located: bool,
}

impl State {
    /// Returns the state after `observed`.
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
            // One transition per call: each state sends its messages before the next one.
            Self::Silent => Self::Grounded,
            Self::Grounded => Self::Standby,
            _ if !granted => Self::Standby,
            Self::Standby if !located => Self::Standby,
            Self::Standby | Self::Engaged | Self::Blind if located => Self::Engaged,
            Self::Standby | Self::Engaged | Self::Blind => Self::Blind,
        }
    }

    /// Returns true if the drone flies to the relay's setpoint.
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
