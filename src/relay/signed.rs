//! What a relay that signs does beyond that: which frames count, and its own with their tags.

use super::incoming::read;
use crate::node::stats::bump;
use crate::node::{Node, Side};
use crate::time::Instant;
use crate::wire::frame::{self, FrameBuf, Header, Opened};
use crate::wire::session::{Checked, Session};

/// A frame from a neighbour, or from somebody who says so.
pub(super) fn receive(
    node: &mut Node,
    session: &mut Session,
    now: Instant,
    side: Side,
    frame: &Opened<'_>,
) {
    match session.check(frame.header.sender, frame) {
        Checked::Fresh { first } => {
            node.meet(now, side, frame.header.sender, first);
            read(node, now, side, frame);
        }
        Checked::Hello { first } => {
            bump(&mut node.stats.hellos);
            node.meet(now, side, frame.header.sender, first);
        }
        Checked::Unproven => bump(&mut node.stats.hellos),
        Checked::Unsigned => bump(&mut node.stats.unsigned),
        Checked::Forged => bump(&mut node.stats.forged),
        Checked::Replayed => bump(&mut node.stats.replayed),
    }
}

/// Writes the next frame with a tag, a hello before anything else.
pub(super) fn next(
    node: &mut Node,
    session: &mut Session,
    now: Instant,
    header: &mut Header,
    frame: &mut FrameBuf,
) -> Option<(Side, usize)> {
    session.pin(node.neighbours());
    if let Some(to) = session.take_hello() {
        return Some(hello(session, to, header, frame));
    }
    let (side, to, message) = node.poll_message(now)?;
    if !session.knows(to) {
        // It could not be read there; it is said again once it can.
        session.greet(to);
        let to = session.take_hello()?;
        return Some(hello(session, to, header, frame));
    }
    header.destination = to;
    let signer = session.signer(to);
    Some((side, frame::encode_signed(*header, &message, signer, frame)))
}

/// Writes a hello to node `to`.
fn hello(
    session: &mut Session,
    to: u16,
    header: &mut Header,
    frame: &mut FrameBuf,
) -> (Side, usize) {
    header.destination = to;
    let side = if to < header.sender {
        Side::Upstream
    } else {
        Side::Downstream
    };
    let body = session.hello(to);
    let signer = session.signer(to);
    (side, frame::encode_hello(*header, &body, signer, frame))
}
