//! End of a node's links: accepts received frames, and addresses, numbers and signs its own.
//!
//! A relay and a ground station have one each, and interpret the accepted messages themselves.

use super::auth::Auth;
use super::deframe::DeframeError;
use super::frame::{self, FrameBuf, FrameError, Header, Opened};
use super::message::Message;
use super::session::{Checked, Session};
use crate::features::AUTH;
use crate::stats::{Stats, bump};
use crate::time::{Duration, Instant};

/// Frame that is ready to send: its destination and its length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sent {
    pub(crate) to: u16,
    /// Length of the encoded frame, bytes.
    pub(crate) len: usize,
}

/// Endpoint of one node: checks received frames; addresses, numbers and signs sent frames.
#[derive(Clone, Debug)]
pub(crate) struct Endpoint {
    network: u16,
    node: u16,
    counter: u32,
    /// Authentication sessions with other nodes, if this node signs. The array is empty without the feature `auth`.
    session: [Option<Session>; AUTH as usize],
}

impl Endpoint {
    /// Creates the endpoint of node `node` in the network `network`, which does not sign frames.
    pub(crate) fn new(network: u16, node: u16) -> Self {
        Self {
            network,
            node,
            counter: 0,
            session: core::array::from_fn(|_| None),
        }
    }

    /// Signs all frames from now on with the key and epoch in `auth`. This node's nonces count up from `claim`, a
    /// random number drawn at start. Once a remote node has been silent for `gone_after`, a second node with the same
    /// node number is accepted in its place.
    pub(crate) fn sign(&mut self, auth: Auth, claim: u32, gone_after: Duration) {
        if let Some(session) = self.session.first_mut() {
            *session = Some(Session::new(auth, claim, gone_after));
        }
    }

    /// Parses a frame that the deframer has decoded. Returns the frame if it is intact and of this network. Any other
    /// frame is counted in `stats` and dropped.
    pub(crate) fn open<'a>(
        &self,
        decoded: Result<&'a [u8], DeframeError>,
        stats: &mut Stats,
    ) -> Option<Opened<'a>> {
        let error = match decoded.map(frame::open) {
            Ok(Ok(frame)) if frame.header.network == self.network => return Some(frame),
            Ok(Ok(_)) => &mut stats.foreign,
            Ok(Err(FrameError::Short)) | Err(DeframeError::Truncated) => &mut stats.truncated,
            Ok(Err(FrameError::Crc)) => &mut stats.crc,
            Ok(Err(FrameError::Version)) => &mut stats.version,
            Ok(Err(FrameError::Message(_))) => &mut stats.malformed,
            Err(DeframeError::Oversized) => &mut stats.oversized,
        };
        bump(error);
        None
    }

    /// Checks the authentication tag of `frame`; `None` if this node does not use authentication. Counts every result
    /// in `stats`, except a valid new message.
    pub(crate) fn check(
        &mut self,
        now: Instant,
        frame: &Opened<'_>,
        stats: &mut Stats,
    ) -> Option<Checked> {
        let session = self.session_mut()?;
        let checked = session.check(now, frame.header.sender, frame);
        match checked {
            Checked::Fresh { .. } => {}
            Checked::Handshake { .. } | Checked::Unproven => bump(&mut stats.handshakes),
            Checked::Unsigned => bump(&mut stats.unsigned),
            Checked::Forged => bump(&mut stats.forged),
            Checked::Replayed | Checked::WentBack => bump(&mut stats.replayed),
        }
        Some(checked)
    }

    /// Returns true once a signing node has used all values of its frame counter. The node must then restart with a new
    /// epoch before it sends again, because a value must not be used twice.
    pub(crate) const fn is_exhausted(&self) -> bool {
        self.counter == u32::MAX && self.session().is_some()
    }

    /// Encodes `message` to node `to` into `frame`. If node `to` cannot verify this node's tags yet, a handshake is
    /// encoded instead; the caller must then send the message later.
    pub(crate) fn transmit(
        &mut self,
        to: u16,
        message: &Message,
        frame: &mut FrameBuf,
        stats: &mut Stats,
    ) -> Option<Sent> {
        let header = self.header(to);
        let len = match self.session_mut() {
            Some(session) if !session.knows(to) => {
                session.greet(to);
                return self.transmit_handshake(frame, stats);
            }
            Some(session) => frame::encode_signed(header, message, session.signer(to), frame),
            None => frame::encode(header, message, frame),
        };
        Some(self.sent(to, len, stats))
    }

    /// Writes the next pending handshake into `frame`; `None` if no handshake is pending.
    #[inline(never)] // called from two places
    pub(crate) fn transmit_handshake(
        &mut self,
        frame: &mut FrameBuf,
        stats: &mut Stats,
    ) -> Option<Sent> {
        let mut header = self.header(0);
        let session = self.session_mut()?;
        let to = session.take_handshake()?;
        header.destination = to;
        let body = session.handshake(to);
        let len = frame::encode_handshake(header, &body, session.signer(to), frame);
        Some(self.sent(to, len, stats))
    }

    const fn header(&self, destination: u16) -> Header {
        Header {
            network: self.network,
            sender: self.node,
            destination,
            counter: self.counter,
        }
    }

    fn sent(&mut self, to: u16, len: usize, stats: &mut Stats) -> Sent {
        self.counter = self.counter.wrapping_add(1);
        bump(&mut stats.sent);
        Sent { to, len }
    }

    /// Returns the authentication sessions with other nodes; `None` if this node does not sign.
    pub(crate) const fn session(&self) -> Option<&Session> {
        match self.session.first() {
            Some(session) => session.as_ref(),
            None => None,
        }
    }

    pub(crate) const fn session_mut(&mut self) -> Option<&mut Session> {
        match self.session.first_mut() {
            Some(session) => session.as_mut(),
            None => None,
        }
    }

    /// Schedules an authentication handshake to node `to`. Both nodes then learn each other's nonce.
    pub(crate) fn greet(&mut self, to: u16) {
        if let Some(session) = self.session_mut() {
            session.greet(to);
        }
    }

    /// Returns true if node `to` can check this node's authentication tags. Without authentication it always returns
    /// false.
    pub(crate) fn knows(&self, to: u16) -> bool {
        self.session().is_some_and(|session| session.knows(to))
    }

    #[cfg(test)]
    pub(crate) const fn counter_mut(&mut self) -> &mut u32 {
        &mut self.counter
    }
}
