//! Frames to and from the protocol. Address and tag of a frame are checked before its message is decoded.

use super::Port;
use crate::event::NodeEvent;
use crate::node::Node;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::endpoint::{Endpoint, Sent};
use crate::wire::frame::{FrameBuf, Opened};
use crate::wire::message::Message;
use crate::wire::session::{Checked, Rival, Sender, Session};

/// Number of unanswered heartbeat requests to a neighbour after which a handshake requests a reply.
///
/// The reply shows if the neighbour communicates with a different node that has this relay's number.
const QUESTIONS: u16 = 4;

/// Handles an intact frame of this relay's network, received at `port`.
pub(super) fn receive(
    node: &mut Node,
    endpoint: &mut Endpoint,
    now: Instant,
    port: Port,
    frame: &Opened<'_>,
) {
    let (own, header) = (node.member().node, frame.header);
    let is_duplicate = header.sender == own;
    if port == Port::Shared {
        node.on_channel(now, header.sender, header.destination);
    }
    if header.destination != own && port == Port::Shared {
        bump(&mut node.stats_mut().overheard);
        if is_duplicate {
            receive_duplicate(node, endpoint, now, frame);
        }
        return;
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
        return receive_addressed(node, endpoint, now, side, frame);
    }
    bump(&mut node.stats_mut().misaddressed);
    if is_duplicate {
        receive_duplicate(node, endpoint, now, frame);
    } else if let Some(through) = through {
        node.on_received_at_both_ports(now, through, header.sender);
    }
}

/// Handles a frame whose sender has this relay's node number.
fn receive_duplicate(node: &mut Node, endpoint: &Endpoint, now: Instant, frame: &Opened<'_>) {
    if let Some(session) = endpoint.session() {
        return node.on_duplicate_index(now, session.sender(frame));
    }
    if frame.tag.is_some() {
        return;
    }
    let sender = match Message::decode(frame.body) {
        Err(_) => return,
        Ok(Message::Claim(claim)) if claim.echo => return,
        Ok(Message::Claim(claim)) => node.rival(claim),
        Ok(_) => Sender::Unknown,
    };
    node.on_duplicate_index(now, sender);
}

/// Handles a frame that is addressed to this relay. Its sender is a ground station, a neighbour, or a node that could
/// become a neighbour.
fn receive_addressed(
    node: &mut Node,
    endpoint: &mut Endpoint,
    now: Instant,
    side: Side,
    frame: &Opened<'_>,
) {
    if let Some(checked) = endpoint.check(now, frame, node.stats_mut()) {
        let rival = endpoint.session_mut().and_then(Session::poll_rival);
        return receive_signed(node, rival, checked, now, side, frame);
    }
    if frame.tag.is_some() {
        return bump(&mut node.stats_mut().version);
    }
    decode(node, now, side, frame);
}

fn receive_signed(
    node: &mut Node,
    rival: Option<Rival>,
    checked: Checked,
    now: Instant,
    side: Side,
    frame: &Opened<'_>,
) {
    // A passive relay waits until it receives the duplicate's frames directly. Neighbours also repeat the nonce of a
    // node that is gone.
    if let Some(rival) = rival
        && !node.is_passive()
    {
        node.on_duplicate_index(now, Sender::Rival(rival));
    }
    let sender = frame.header.sender;
    match checked {
        Checked::Fresh { first } => {
            node.on_key_match(side, sender);
            node.on_authentic(now, side, sender, first);
            decode(node, now, side, frame);
        }
        Checked::Handshake { first } => {
            node.on_key_match(side, sender);
            node.on_authentic(now, side, sender, first);
        }
        Checked::Unproven => node.on_handshake(side, sender),
        // While the two nodes do not know each other's nonces, the tag of any frame other than a handshake is wrong.
        Checked::Forged if frame.handshake => node.on_forged(now, side, sender),
        Checked::WentBack => node.refuse(now, side, sender, NodeEvent::Epoch),
        Checked::Unsigned | Checked::Forged | Checked::Replayed => {}
    }
}

fn decode(node: &mut Node, now: Instant, side: Side, frame: &Opened<'_>) {
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

/// Writes the next frame into `frame`, and returns its destination and length. `None` if nothing is pending. Handshakes
/// come before messages.
pub(super) fn poll_transmit(
    node: &mut Node,
    endpoint: &mut Endpoint,
    now: Instant,
    frame: &mut FrameBuf,
) -> Option<Sent> {
    if endpoint.is_exhausted() {
        return None;
    }
    if let Some(session) = endpoint.session_mut() {
        if node.is_passive() {
            return None;
        }
        if let Some(number) = node.poll_sessions() {
            session.restart(number);
        }
        if let Some((_, to)) = node.poll_claim() {
            session.request_reply(to);
        }
        if let Some(to) = node.reporting.poll_greeting() {
            session.request_reply(to);
        }
        session.pin(node.neighbours());
        let sent = endpoint.transmit_handshake(frame, node.stats_mut());
        if sent.is_some() {
            return sent;
        }
    }
    let (side, mut to, message) = node.poll_message(now)?;
    if let Some(session) = endpoint.session_mut() {
        schedule_handshake(node, session, to, &message);
        if matches!(message, Message::Watch { .. } | Message::Report(_)) && !session.knows(to) {
            // The neighbour already knows this relay. If the handshake succeeds, the next report goes to that
            // neighbour.
            session.greet(to);
            let [before, after] = node.neighbours();
            let near = match side {
                Side::Upstream => before,
                Side::Downstream => after,
            };
            to = near.unwrap_or(to);
        }
    }
    endpoint.transmit(to, &message, frame, node.stats_mut())
}

/// Schedules a handshake to node `to` if the sending of `message` to this node requires one.
fn schedule_handshake(node: &Node, session: &mut Session, to: u16, message: &Message) {
    if let Message::Heartbeat { request: ask, .. } = message
        && *ask != 0
        && ask % QUESTIONS == 0
    {
        session.request_reply_of_silent(to);
    }
    if let Some(number) = node.handshake_of(message) {
        session.show(to, number);
    }
    if let Message::Hello(hello) = message
        && hello.requests_reply
        && !hello.is_heard(node.member().node, to)
    {
        // The node may have restarted. Then it accepts only handshakes, and sends nothing unasked.
        session.request_reply_of_silent(to);
    }
}
