//! Control states of the link to an autopilot.
//!
//! | state | messages sent | next state |
//! | --- | --- | --- |
//! | `Silent` | HEARTBEAT | autopilot received: `Grounded` |
//! | `Grounded` | also requests for messages, TIMESYNC | nothing received for 3 s: `Silent`; armed and in the air: `Standby` |
//! | `Standby` | also the present position as a target, to a PX4 once a mode was chosen and the relay is ready | nothing received: `Silent`; on the ground or disarmed: `Grounded`; mode granted after a mode was chosen, position known: `Engaged` |
//! | `Engaged` | also the target, on its way to the setpoint | nothing received: `Silent`; on the ground or disarmed: `Grounded`; another mode, or the choice was cleared: `Standby`; no position for 1 s, or the link of an ArduCopter late: `Blind` |
//! | `Blind` | also the last target, which stands still | as `Engaged`; position known for 1 s, or for 10 s if it was blind in the last minute: `Engaged`, from the drone's position |
//!
//! *A mode was chosen* is an observation of this link. It is not stored across restarts:
//!
//! | autopilot | set by a heartbeat that is not late, in a mode | cleared at |
//! | --- | --- | --- |
//! | PX4 | other than OFFBOARD, `system_status` ACTIVE (4) | start, restart, disarming; `system_status` CRITICAL (5) or above; nothing received for 0.8 s; no echo of the last 1.5 s; a position that arrives 1 s late; a target that is sent 0.6 s late |
//! | ArduCopter | other than GUIDED, not CRITICAL | start, restart, disarming; no heartbeat for 3 s |
//!
//! A link that finds OFFBOARD or GUIDED granted at its start takes no control and sends no targets. The pilot must
//! first choose a different mode, and the operator is informed of this. Only the pilot's choice of a mode ends a PX4's
//! failsafe. Nothing else changes a state: no setpoint, and no message of a neighbour.

/// Control state of the drone. The state shows whether the relay controls the drone, and determines which targets the
/// autopilot gets.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum State {
    /// No autopilot is received on the link.
    #[default]
    Silent,
    /// The drone is on the ground, or not armed.
    Grounded,
    /// The drone is in the air, and the relay does not control it.
    Standby,
    /// The relay controls the drone, which flies to the relay's setpoint.
    Engaged,
    /// The relay controls the drone, but the drone's position is unknown. The autopilot keeps the last target.
    Blind,
}

/// Observations that determine the control state.
#[expect(
    clippy::struct_excessive_bools,
    reason = "what is seen of an autopilot, each for itself"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Observed {
    /// True if a heartbeat of the autopilot was received within the last 3 s.
    pub(super) is_received: bool,
    /// True if the drone is armed and in the air.
    pub(super) flying: bool,
    /// True if the autopilot is in OFFBOARD or GUIDED, and this mode counts as the pilot's choice. In these modes the
    /// relay sets the target.
    pub(super) granted: bool,
    /// True if the drone's position is known.
    pub(super) located: bool,
}

impl State {
    /// Returns the control state that follows from this state and the observations `observed`.
    pub(super) const fn next(self, observed: Observed) -> Self {
        let Observed {
            is_received: there,
            flying,
            granted,
            located,
        } = observed;
        match self {
            _ if !there => Self::Silent,
            _ if !flying => Self::Grounded,
            // One transition per call, so that each state sends its messages before the next one.
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

/// Values of `MAV_TYPE` for vehicles that hover under ArduCopter. Vehicles of other types use the same mode numbers for
/// different modes.
const COPTERS: [u8; 9] = [2, 3, 4, 13, 14, 15, 29, 35, 43];

/// Kind of autopilot firmware: PX4 or ArduCopter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// PX4: the relay controls the drone in the mode OFFBOARD, as long as it sends targets.
    Px4,
    /// ArduCopter: the relay controls the drone in the mode GUIDED. A target stays valid until the next target.
    ArduCopter,
}

impl Kind {
    /// Returns the kind of an autopilot with the given `MAV_AUTOPILOT` and `MAV_TYPE`. `None` if it is not supported.
    pub(super) fn of(autopilot: u8, vehicle: u8) -> Option<Self> {
        match autopilot {
            12 => Some(Self::Px4),
            3 if COPTERS.contains(&vehicle) => Some(Self::ArduCopter),
            _ => None,
        }
    }
}

/// Flight mode of the autopilot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
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
    /// RTL or SMART_RTL: the drone returns to its launch position.
    Return,
    /// Landing mode: the drone descends and lands.
    Land,
    /// Any other mode, such as a mission or a take-off.
    Other,
}

impl FlightMode {
    /// Returns the flight mode that has the number `custom_mode` on an autopilot of the kind `kind`.
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

/// Reason why the relay no longer controls the drone.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum ReleaseCause {
    /// The pilot or a ground station has chosen a different mode.
    Chosen,
    /// The autopilot entered its failsafe.
    Failsafe,
    /// The drone left the autopilot's geofence.
    Fence,
    /// The link to the autopilot was interrupted or late. A PX4 is then possibly in its failsafe, and new targets would
    /// end the failsafe.
    Link,
}

/// Loss of control over the drone: its cause, and the mode of the autopilot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Release {
    /// Reason why the relay has lost control of the drone.
    pub cause: ReleaseCause,
    /// Flight mode of the autopilot when the relay lost control.
    pub mode: FlightMode,
}

impl Release {
    /// Returns the text for the operator about the loss of control, in two parts.
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

/// Reason why the relay cannot control the drone now. Either the pilot cannot give the relay control, or the relay does
/// not use the mode OFFBOARD or GUIDED that the pilot has chosen.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum WaitReason {
    /// The autopilot is in its failsafe. The failsafe ends when the pilot chooses a flight mode.
    Failsafe,
    /// The autopilot's messages arrive late.
    Link,
    /// The autopilot was already in OFFBOARD or GUIDED when this link started. The pilot must choose a different mode,
    /// and then OFFBOARD or GUIDED again.
    Found,
    /// No mode change by the pilot has been received since this link started.
    Unseen,
    /// The drone's position is unknown, or too far from the line Tx to Rx.
    Position,
    /// The relay is not ready ([`handle_ready`](super::Autopilot::handle_ready)).
    NotReady,
}

impl WaitReason {
    /// Returns the text for the operator about this reason.
    pub(super) const fn text(self) -> &'static str {
        match self {
            Self::Failsafe => "relay: waits, autopilot in failsafe",
            Self::Link => "relay: waits, autopilot link delayed",
            Self::Found => "relay: waits, choose another mode first",
            Self::Unseen => "relay: waits for pilot: end failsafe or set mode",
            Self::Position => "relay: waits, position unknown or off the line",
            Self::NotReady => "relay: waits, wrong side of a neighbour",
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
            is_received: bits & 1 != 0,
            flying: bits & 2 != 0,
            granted: bits & 4 != 0,
            located: bits & 8 != 0,
        })
    }

    #[expect(clippy::match_same_arms, reason = "as the table has them")]
    #[test]
    fn the_state_machine_equals_its_table() {
        for state in ALL {
            for seen in observations() {
                let next = state.next(seen);
                let expected = match state {
                    _ if !seen.is_received => State::Silent,
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
    fn a_drone_is_engaged_only_if_granted_in_the_air_and_located() {
        for state in ALL {
            for seen in observations() {
                if state.next(seen).is_flown() {
                    assert!(seen.is_received && seen.flying && seen.granted && seen.located);
                    assert!(
                        !matches!(state, State::Silent | State::Grounded),
                        "without a step between"
                    );
                }
            }
        }
    }
}
