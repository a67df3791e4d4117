//! Texts that `defmt` prints for events and their reasons. An image stores their numbers only, so the texts take no flash.

#![expect(
    clippy::match_same_arms,
    reason = "the texts differ, which the linter does not see in interned strings"
)]

use crate::event::Event;
use crate::side::Side;

/// Implements `defmt::Format` for an enum, with one text for each variant.
macro_rules! texts {
    ($type:ty { $($variant:pat => $text:literal),* $(,)? }) => {
        impl defmt::Format for $type {
            fn format(&self, f: defmt::Formatter<'_>) {
                let text = match *self {
                    $($variant => defmt::intern!($text),)*
                };
                defmt::write!(f, "{=istr}", text);
            }
        }
    };
}

impl defmt::Format for Event {
    fn format(&self, f: defmt::Formatter<'_>) {
        match (*self, node(*self)) {
            (Self::UploadRefused { why }, _) => defmt::write!(
                f,
                "a newer mission, received by an upload, was rejected: {}",
                why
            ),
            (event, Some(node)) => defmt::write!(f, "node {=u16} {=istr}", node, text(event)),
            (event, None) => defmt::write!(f, "{=istr}", text(event)),
        }
    }
}

/// Returns the index of the node that the event concerns; `None` if the event concerns no node.
const fn node(event: Event) -> Option<u16> {
    match event {
        Event::NeighbourLost { node, .. }
        | Event::NeighbourBack { node, .. }
        | Event::MayLeaveTold { node, .. }
        | Event::NotHeard { node }
        | Event::MissionMismatch { node }
        | Event::KeyMismatch { node }
        | Event::EpochWentBack { node }
        | Event::DuplicateIndex { node }
        | Event::SensorOff { node } => Some(node),
        _ => None,
    }
}

/// Returns the text of an event in a log line. For an event about a node, the log line has the node's number before the
/// text.
fn text(event: Event) -> defmt::Str {
    match event {
        Event::SetpointChanged => defmt::intern!("the setpoint has changed"),
        Event::Converged => defmt::intern!("the relays have agreed on positions"),
        Event::Infeasible => defmt::intern!(
            "no positions give every hop one of the tried target SIRs, so all relays keep their positions: check the mission's interferer, distance and minimum separation"
        ),
        Event::NeighbourLost {
            side: Side::Upstream,
            ..
        } => defmt::intern!("upstream (toward Tx) does not reply: look for that drone"),
        Event::NeighbourLost { .. } => {
            defmt::intern!("downstream (toward Rx) does not reply: look for that drone")
        }
        Event::NeighbourBack {
            side: Side::Upstream,
            ..
        } => defmt::intern!("is now the neighbour upstream (toward Tx)"),
        Event::NeighbourBack { .. } => {
            defmt::intern!("is now the neighbour downstream (toward Rx)")
        }
        Event::NotHeard { .. } => defmt::intern!(
            "does not receive this relay: check this relay's transmitter and that node's receiver"
        ),
        Event::MissionMismatch { .. } => {
            defmt::intern!("has another mission: load the same mission into both")
        }
        Event::KeyMismatch { .. } => defmt::intern!(
            "signs with another key, or an attacker uses its number: give both the same key"
        ),
        Event::EpochWentBack { .. } => defmt::intern!(
            "has started with an epoch (start counter) that is not above its last one, and its frames are rejected: increase its epoch and restart it"
        ),
        Event::DuplicateIndex { .. } => defmt::intern!(
            "shares its number with another node: land one of the two, and give it its own number"
        ),
        Event::SensorOff { .. } => defmt::intern!(
            "measures interference that does not fit the other measurements: its measurements are ignored, check its receiver"
        ),
        Event::ViewAccepted => defmt::intern!(
            "the relays have agreed which of them form the chain (a new view): they agree on new positions next"
        ),
        Event::LeaseLapsed => defmt::intern!(
            "not all relays are reachable, so the last agreement on positions has expired: this relay keeps its setpoint, and asks the others to agree which relays form the chain (a new view)"
        ),
        Event::NoQuorum => defmt::intern!(
            "no quorum: too few relays receive each other to agree on the chain's members: bring the missing relays into range, or land this part of the chain"
        ),
        Event::Uploaded => defmt::intern!("a newer mission has been received by an upload"),
        Event::NewEstimate => {
            defmt::intern!("the estimate of the interferer has changed: new positions follow")
        }
        Event::InterfererUnclear => defmt::intern!(
            "the measurements do not fit a single interferer on the ground, or are too few: the relays keep their last estimate"
        ),
        Event::Adopted => defmt::intern!("the chain flies the uploaded mission"),
        Event::MayLeaveTold { .. } => {
            defmt::intern!(
                "is outside of the chain, and has permission to leave: when its drone has left, report to this relay that the drone is gone"
            )
        }
        Event::MayLeave => {
            defmt::intern!(
                "the chain works without this relay now: this drone has permission to leave"
            )
        }
        Event::EnduranceUnknown => {
            defmt::intern!("remaining time of flight unknown: watch the battery")
        }
        Event::AtReserve => {
            defmt::intern!(
                "the battery lasts only for the way home and the reserve: fly this drone home"
            )
        }
        Event::UploadRefused { .. } => defmt::intern!("a newer mission was rejected"),
    }
}

/// Log texts of the autopilot's states, modes and events, and the reasons for lost or denied control.
#[cfg(feature = "flight")]
mod autopilot {
    use crate::flight::autopilot::state::{FlightMode, Release, ReleaseCause, State, WaitReason};
    use crate::flight::autopilot::trust::Mistrust;
    use crate::flight::autopilot::{AutopilotEvent, Kind};

    texts!(Kind {
        Kind::Px4 => "PX4",
        Kind::ArduCopter => "ArduCopter",
    });

    texts!(State {
        State::Silent => "no heartbeat for 3 s: check that the autopilot is switched on, check its cable, and set its port to MAVLink 2 and to the data rate of this relay",
        State::Grounded => "on the ground, or not armed",
        State::Standby => "in the air, and not controlled by the relay",
        State::Engaged => "setpoint control engaged",
        State::Blind => "no recent position from the autopilot, so the drone keeps its last target",
    });

    texts!(ReleaseCause {
        ReleaseCause::Chosen => "the pilot or a ground station chose another mode",
        ReleaseCause::Failsafe => "failsafe of the autopilot",
        ReleaseCause::Fence => "fence of the autopilot breached",
        ReleaseCause::Link => "the link to the autopilot was interrupted or late",
    });

    texts!(FlightMode {
        FlightMode::Companion => "OFFBOARD or GUIDED, unchanged",
        FlightMode::Sticks => "manual",
        FlightMode::Hold => "Hold or LOITER",
        FlightMode::Brake => "BRAKE",
        FlightMode::Return => "RTL",
        FlightMode::Land => "LAND",
        FlightMode::Other => "another mode, for example mission or take-off",
    });

    impl defmt::Format for Release {
        fn format(&self, f: defmt::Formatter<'_>) {
            defmt::write!(f, "{}; flight mode: {}", self.cause, self.mode);
        }
    }

    texts!(WaitReason {
        WaitReason::Failsafe => "the autopilot is in a failsafe; choose a mode to end it",
        WaitReason::Link => "messages from the autopilot arrive late: check the link to it",
        WaitReason::Found => "OFFBOARD or GUIDED was chosen before the relay started: choose another mode, then OFFBOARD or GUIDED again",
        WaitReason::Unseen => "the relay has not received the pilot's choice of a mode yet: end the failsafe if there is one, choose a mode other than OFFBOARD and GUIDED, then OFFBOARD or GUIDED",
        WaitReason::Position => "the drone's position is unknown, or not near the line between transmitter and receiver: wait for a position, or fly the drone nearer to the line",
        WaitReason::NotReady => "the relays are not in the order of their numbers along the line from Tx to Rx: fly this drone to the right side of its neighbour first",
    });

    texts!(Mistrust {
        Mistrust::NoKey => "signs its frames and ignores unsigned frames: give this relay the autopilot's key",
        Mistrust::SignsOnly => "signs its frames, but accepts unsigned frames: this relay controls it without a key",
        Mistrust::Unsigned => "does not sign its frames, so they are ignored: load the key into the autopilot, or provision this relay without the autopilot's key",
        Mistrust::OtherKey => "signs with another key than this relay, so its frames are ignored: give the autopilot and this relay the same key",
        Mistrust::Old => "signs with an old timestamp, so its frames are ignored: check the autopilot's clock",
    });

    impl defmt::Format for AutopilotEvent {
        fn format(&self, f: defmt::Formatter<'_>) {
            match self {
                Self::Found(kind) => defmt::write!(f, "found: {}", kind),
                Self::Restarted => defmt::write!(
                    f,
                    "rebooted; setpoint control begins when the pilot chooses OFFBOARD or GUIDED again in the air"
                ),
                Self::State(state) => defmt::write!(f, "{}", state),
                Self::Released(release) => {
                    defmt::write!(f, "setpoint control released: {}", release);
                }
                Self::Waits(reason) => {
                    defmt::write!(f, "setpoint control cannot be engaged: {}", reason);
                }
                Self::Ready => defmt::write!(f, "ready: the pilot may choose OFFBOARD or GUIDED"),
                Self::Refused => defmt::write!(
                    f,
                    "the autopilot flies to a target other than the setpoint that the relay has sent: check whether the setpoint is outside the autopilot's fence"
                ),
                Self::FenceBreached => {
                    defmt::write!(f, "the drone is outside the autopilot's fence");
                }
                Self::OffLine(off) => defmt::write!(
                    f,
                    "the drone is {=u32} m from the line between transmitter and receiver",
                    off.away_m
                ),
                Self::LostCleared { relays, from, .. } => defmt::write!(
                    f,
                    "MAVLink system {=u8}, component {=u8} reports the lost relays {} as landed: this drone no longer keeps clear of them",
                    from.system,
                    from.component,
                    named(relays)
                ),
                Self::ClearRefused { relays, from } => defmt::write!(
                    f,
                    "refused the command of MAVLink system {=u8}, component {=u8} to report the lost relays {} as landed: the command must name all lost relays on one side of this relay (toward Tx or toward Rx), and no other relay",
                    from.system,
                    from.component,
                    named(relays)
                ),
                Self::Mistrusted(why) => defmt::write!(f, "{}", why),
            }
        }
    }

    /// Returns the entries of `relays` before the first 0. Unused entries are 0, at the end of `relays`.
    fn named(relays: &[u16]) -> &[u16] {
        relays.split(|node| *node == 0).next().unwrap_or_default()
    }
}
