//! Pass number of a message.

use uav_relay::wire::message::Message;

/// Returns the pass number of a message; `None` for a message without one, such as a lease message.
///
/// A pass is a message along the chain and back.
pub(super) const fn number_of(message: &Message) -> Option<u16> {
    Some(match message {
        Message::Sweep(sweep) => sweep.number,
        Message::Verdict(answer) => answer.number,
        Message::Busy { number: sweep } => *sweep,
        Message::Gather(roster) | Message::Gathered(roster) => roster.number,
        Message::Sense(hearing) | Message::Sensed(hearing) => hearing.number,
        Message::Token(token) => token.number,
        Message::Moved(moved) => moved.number,
        Message::Heartbeat { .. }
        | Message::Pulse(_)
        | Message::Pulsed(_)
        | Message::Hello(_)
        | Message::Proposal(_)
        | Message::Decision(_)
        | Message::Fence { .. }
        | Message::Offer { .. }
        | Message::Level { .. }
        | Message::Claim(_)
        | Message::Watch { .. }
        | Message::Report(_) => return None,
    })
}
