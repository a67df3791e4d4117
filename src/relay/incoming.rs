//! What a relay does with a frame that has come in: checked, addressed and only then read.

use super::port::Port;
use crate::node::Node;
use crate::node::duplicate::Sender;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::frame::{self, FrameError, Opened};
use crate::wire::message::Message;

/// An intact frame that says something to this relay.
pub(super) enum Addressed<'a> {
    /// By a neighbour, or a node that might become one.
    By(Side, Opened<'a>),
    /// Under this relay's own number, whoever it is for.
    ByDuplicate(Opened<'a>),
}

/// One frame, decoded from COBS: whether it is intact, and what it is to this relay.
pub(super) fn addressed<'a>(
    node: &mut Node,
    now: Instant,
    network: u16,
    port: Port,
    plain: &'a [u8],
) -> Option<Addressed<'a>> {
    let own = node.member().node;
    let stats = node.stats_mut();
    let frame = match frame::open(plain) {
        Ok(opened) => opened,
        Err(error) => {
            bump(match error {
                FrameError::Short => &mut stats.truncated,
                FrameError::Crc => &mut stats.crc,
                FrameError::Version => &mut stats.version,
                FrameError::Message(_) => &mut stats.malformed,
            });
            return None;
        }
    };
    let header = frame.header;
    if header.network != network {
        bump(&mut stats.foreign);
        return None;
    }
    let duplicate = header.sender == own;
    if header.destination != own && port == Port::Shared {
        bump(&mut stats.overheard);
        return duplicate.then_some(Addressed::ByDuplicate(frame));
    }
    let through = match port {
        Port::Upstream => Some(Side::Upstream),
        Port::Downstream => Some(Side::Downstream),
        Port::Shared => None,
    };
    let side = node
        .side_of(header.sender)
        .filter(|side| through.is_none_or(|through| through == *side))
        .filter(|_| header.destination == own);
    if let Some(side) = side {
        return Some(Addressed::By(side, frame));
    }
    bump(&mut node.stats_mut().misaddressed);
    if duplicate {
        return Some(Addressed::ByDuplicate(frame));
    }
    if let Some(through) = through {
        node.hear_at_both(now, through, header.sender);
    }
    None
}

/// Returns what a frame under this relay's own number says of its sender, at a relay without a key; `None` if it is no message.
pub(super) fn sender(node: &Node, frame: &Opened<'_>) -> Option<Sender> {
    if frame.tag.is_some() {
        return None;
    }
    Some(match Message::decode(frame.body).ok()? {
        Message::Claim(claim) if claim.echo => return None,
        Message::Claim(claim) => node.rival(claim),
        _ => Sender::Unknown,
    })
}

/// A frame from a neighbour, at a relay that asks for no tag.
pub(super) fn receive(node: &mut Node, now: Instant, side: Side, frame: &Opened<'_>) {
    if frame.tag.is_some() {
        return bump(&mut node.stats_mut().version);
    }
    read(node, now, side, frame);
}

/// A frame whose body counts, if it is one to say to this relay.
pub(super) fn read(node: &mut Node, now: Instant, side: Side, frame: &Opened<'_>) {
    let Ok(message) = Message::decode(frame.body) else {
        return bump(&mut node.stats_mut().malformed);
    };
    let counter = if node.handle_message(now, side, frame.header.sender, &message) {
        &mut node.stats_mut().received
    } else {
        &mut node.stats_mut().misaddressed
    };
    bump(counter);
}
