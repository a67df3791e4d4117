//! What a relay that signs does beyond that: which frames count, and its own with their tags.

use super::incoming::read;
use crate::node::Node;
use crate::node::duplicate::Sender;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::frame::{self, FrameBuf, Header, Opened};
use crate::wire::message::Message;
use crate::wire::session::{Checked, Session};

/// One in so many questions to a silent neighbour goes with a handshake that asks: the neighbour may believe another node of this relay's
/// number, and its answer shows which.
const QUESTIONS: u16 = 4;

/// A frame from a neighbour, or from somebody who says so.
pub(super) fn receive(
    node: &mut Node,
    session: &mut Session,
    now: Instant,
    side: Side,
    frame: &Opened<'_>,
) {
    let checked = session.check(now, frame.header.sender, frame);
    // A passive relay waits for the other node itself: the neighbours show the nonce of one that is gone, too.
    if let Some(rival) = session.poll_rival()
        && !node.is_passive()
    {
        node.hear_duplicate(now, Sender::Rival(rival));
    }
    match checked {
        Checked::Fresh { first } => {
            node.is_signed_right(side, frame.header.sender);
            node.meet(side, frame.header.sender, first);
            read(node, now, side, frame);
        }
        Checked::Handshake { first } => {
            bump(&mut node.stats_mut().handshakes);
            node.is_signed_right(side, frame.header.sender);
            node.meet(side, frame.header.sender, first);
        }
        Checked::Unproven => {
            bump(&mut node.stats_mut().handshakes);
            node.called(side, frame.header.sender);
        }
        Checked::Unsigned => bump(&mut node.stats_mut().unsigned),
        Checked::Forged => {
            bump(&mut node.stats_mut().forged);
            // The tag of anything else is wrong, too, while the two do not know each other's nonces yet.
            if frame.handshake {
                node.is_forged(side, frame.header.sender);
            }
        }
        Checked::Replayed => bump(&mut node.stats_mut().replayed),
        Checked::WentBack => {
            bump(&mut node.stats_mut().replayed);
            node.went_back(side, frame.header.sender);
        }
    }
}

/// Writes the next frame with a tag, a handshake before anything else.
pub(super) fn next(
    node: &mut Node,
    session: &mut Session,
    now: Instant,
    header: &mut Header,
    frame: &mut FrameBuf,
) -> Option<(Side, usize)> {
    if let Some(number) = node.poll_sessions() {
        session.restart(number);
    }
    if let Some((_, to)) = node.poll_claim() {
        session.ask(to);
    }
    session.pin(node.neighbours());
    let len = if let Some(len) = greeting(session, header, frame) {
        len
    } else {
        let (_, to, message) = node.poll_message(now)?;
        if let Message::Heartbeat { ask, .. } = message
            && ask != 0
            && ask % QUESTIONS == 0
        {
            session.ask_silent(to);
        }
        if node.shows_its_nonce(&message) {
            session.show(to);
        }
        if let Message::Hello(hello) = message
            && hello.ask
            && !hello.is_heard(header.sender, to)
        {
            // It may have been switched on since: then it reads nothing else, and has nothing to say by itself.
            session.ask_silent(to);
        }
        say(session, to, &message, header, frame)?
    };
    let side = if header.destination < header.sender {
        Side::Upstream
    } else {
        Side::Downstream
    };
    Some((side, len))
}

/// Writes a handshake that is owed to some node.
pub(crate) fn greeting(
    session: &mut Session,
    header: &mut Header,
    frame: &mut FrameBuf,
) -> Option<usize> {
    let to = session.take_handshake()?;
    header.destination = to;
    let body = session.handshake(to);
    let signer = session.signer(to);
    Some(frame::encode_handshake(*header, &body, signer, frame))
}

/// Writes `message` to node `to`, or a handshake in its place if it could not be read there: it is said again once it can.
pub(crate) fn say(
    session: &mut Session,
    to: u16,
    message: &Message,
    header: &mut Header,
    frame: &mut FrameBuf,
) -> Option<usize> {
    if !session.knows(to) {
        session.greet(to);
        return greeting(session, header, frame);
    }
    header.destination = to;
    let signer = session.signer(to);
    Some(frame::encode_signed(*header, message, signer, frame))
}
