//! What a relay does with a frame that has come in: checked, addressed and only then read.

use super::port::Port;
use crate::node::Node;
use crate::node::namesake::Claim;
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
    ByNamesake(Opened<'a>),
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
    let namesake = header.sender == own;
    if header.destination != own && port == Port::Shared {
        bump(&mut stats.overheard);
        return namesake.then_some(Addressed::ByNamesake(frame));
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
    if namesake {
        return Some(Addressed::ByNamesake(frame));
    }
    if let Some(through) = through {
        node.hear_at_both(now, through, header.sender);
    }
    None
}

/// What a frame under this relay's own number says of its sender, at a relay that asks for no tag; `None` if nothing.
pub(super) fn claim(frame: &Opened<'_>) -> Option<Claim> {
    if frame.tag.is_some() {
        return None;
    }
    let message = Message::decode(frame.body).ok()?;
    let fresh = matches!(message, Message::Hello(hello) if hello.fresh);
    let hello = matches!(message, Message::Hello(_));
    let takes_part = hello && !fresh || message.is_of_a_view() || message.is_of_a_proposal();
    Some(if takes_part {
        Claim::TakesPart
    } else {
        Claim::There
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
