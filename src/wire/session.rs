//! Sessions: authentication of received frames and signing of sent ones, with one session per node.
//!
//! Toward each other node a relay has a *nonce*: its epoch in the upper half, and in the lower half a number that
//! counts up from the relay's claim number (`node::duplicate`). A frame's tag covers two nonces: the sender's toward
//! the receiver, and the receiver's toward the sender. So a recorded frame is rejected once one of the two has
//! restarted or has forgotten the other. A node learns the other's nonce from a *handshake*. The body of a handshake is
//! the sender's nonce, the receiver's nonce as far as the sender knows it, and a flag: true if the sender still lacks
//! the proof that the receiver is present.
//!
//! | handshake with the right tag and | action |
//! | --- | --- |
//! | a nonce below the known one, or a counter that was accepted before | none; it is counted as a replay. Five of one older epoch in a row with rising counters, and nothing newer between them, are reported: the node's epoch went back |
//! | a nonce above the known one | the node has restarted: start a new session |
//! | a nonce below the known one, of the same epoch and of another claim number | another node of that number: reply if it asks, so that it learns of the node that this relay accepts |
//! | the same, and the node of the known nonce has been silent for `dead_after` | forget that node, and start a new session |
//! | a foreign nonce of this relay's number | another node of this relay's number, which the sender accepts: see `node::duplicate` |
//! | this relay's own nonce | proof that the node is present |
//! | a request, and none of the above | reply only |
//!
//! Exactly one handshake answers a request that starts a session, that has not this relay's nonce, or that comes from a node
//! with proved presence; nothing else is answered. So replayed frames cause at most one handshake each, which is replaced by
//! another pending message, if there is one.
//!
//! A recorded handshake can be new to a relay only if the relay has just started or had forgotten its sender. It does
//! not contain this relay's new nonce, so it is no proof that its sender is present: it causes only a handshake in
//! reply. If its nonce is old, the current nonce is larger and replaces it. So it does no lasting harm: before the
//! current handshake, nothing can be sent to that node.

use super::auth::{Auth, Key, Nonces, Signer, TAG, Window, is_same};
use super::frame::Opened;
use crate::time::{Duration, Instant};

/// Actual sender of a frame that bears this relay's own node number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Sender {
    /// The relay itself: the received frame is an echo of a frame that this relay has sent.
    Itself,
    /// Second node with this node number, whose claim is not known. With signed frames it can be a forger.
    Unknown,
    /// Second node that uses this relay's node number, and its claim to that number.
    Rival(Rival),
}

/// Claim of a second node to this relay's node number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Rival {
    pub(crate) number: u32,
    /// True if the claiming node's epoch (start counter) is newer than this relay's. False if both epochs are equal.
    pub(crate) newer_epoch: bool,
    /// True if the claiming node is passive: it has no setpoint and does not take part in the chain.
    pub(crate) passive: bool,
    /// True if the claim was certainly sent after this relay's start. The proof is a signature, or a copy of this
    /// relay's claim number in the message.
    pub(crate) is_current: bool,
}

/// Bit of a claim number, set by a relay that has a position when a second node uses its node number. The claim number
/// is then larger than any claim number without this bit. Of two nodes with the same number, the one with the larger
/// claim number keeps the node number.
pub(crate) const RAISED: u32 = 1 << 31;

/// Length of an authentication handshake's body, bytes.
pub(crate) const HANDSHAKE_LENGTH: usize = 17;

const PEERS: usize = 8;

/// Maximum difference between the lower halves of two nonces that one node makes in one epoch. The lower half is random
/// at a node's start and then counts up. A larger difference therefore shows that two nodes use the same node number.
const MAX_GAP: u32 = 1 << 12;

/// Number of successive handshakes that prove that a node has restarted with an older epoch. Delayed frames can cause
/// fewer such handshakes.
const WENT_BACK: u8 = 5;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Peer {
    node: u16,
    /// True if a handshake to the remote node of this table entry must be sent.
    handshake: bool,
    /// True if the next handshake requests a reply even from a remote node that has proved its presence. If false, the
    /// handshake requests a reply only while the remote node has not proved its presence.
    requests_reply: bool,
    /// True if the remote node has sent this relay's nonce back. The remote node is then present, and the two nodes
    /// know each other's nonce.
    proven: bool,
    /// Value of `Session::clock` at the last use of this table entry.
    used: u32,
    /// Time of the last frame that proved the node present. A handshake with the largest nonce so far also counts as
    /// proof.
    last_proof: Instant,
    /// Lower half of the nonce that this relay uses for frames to the remote node. The upper half is the epoch.
    own_number: u32,
    /// Largest nonce that the remote node has sent to this relay; 0 if none was received.
    nonce: u64,
    window: Window,
    older: OlderHandshakes,
}

/// Counter of consecutive handshakes of a node with an outdated nonce. Several such handshakes show that the node's
/// epoch went back, or that the node restarted in the same epoch.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct OlderHandshakes {
    epoch: u32,
    /// Frame counter of the last handshake with an outdated nonce, plus one.
    next: u32,
    /// Number of consecutive handshakes with an outdated nonce and rising frame counters.
    times: u8,
}

impl OlderHandshakes {
    /// Counts a handshake with an outdated nonce, its epoch and its frame counter; ignores replays. Returns true
    /// from the fifth (`WENT_BACK`) successive handshake of the same epoch with rising frame counters on.
    const fn count(&mut self, epoch: u32, counter: u32) -> bool {
        if epoch != self.epoch || self.times == 0 {
            *self = Self {
                epoch,
                next: counter.saturating_add(1),
                times: 1,
            };
            return false;
        }
        if counter < self.next {
            return false;
        }
        self.next = counter.saturating_add(1);
        self.times = self.times.saturating_add(1);
        self.times >= WENT_BACK
    }
}

impl Peer {
    const fn nonces(&self, epoch: u32) -> Nonces {
        Nonces {
            sender: (epoch as u64) << 32 | self.own_number as u64,
            receiver: self.nonce,
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Session {
    key: Key,
    epoch: u32,
    /// Silence of a remote node after which a second node with its node number is accepted in its place.
    gone_after: Duration,
    /// Random claim number that this relay draws at its start. If two nodes have the same node number, the one with the
    /// larger claim number keeps it. The lower halves of this relay's nonces count up from the claim number.
    claim: u32,
    /// Lower half of the last nonce that this relay has created.
    last_number: u32,
    /// Claim of a second node to this relay's node number, as shown by a handshake. `None` once the claim has been
    /// read.
    rival: Option<Rival>,
    /// Number of uses of table entries so far, wrapping. Each entry stores the value of its last use.
    clock: u32,
    /// Current neighbours, whose table entries are never replaced.
    pinned: [Option<u16>; 2],
    peers: heapless::Vec<Peer, PEERS>,
    /// Number of the last lease renewal for which this relay has scheduled a handshake to show its nonce.
    shown: Option<u16>,
}

/// Result of authenticating a received frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Checked {
    /// Valid message that was not received before, so its sender is present. `first` is true if this is the sender's
    /// first proof of presence in the session with this relay.
    Fresh { first: bool },
    /// New handshake that contains this relay's current nonce, so its sender is present. `first` is true if this is the
    /// sender's first proof of presence in the session with this relay.
    Handshake { first: bool },
    /// Handshake whose tag is valid, but without this relay's current nonce. An attacker may have recorded it, so it
    /// does not prove that its sender is present.
    Unproven,
    /// Received frame without an authentication tag.
    Unsigned,
    /// Frame whose tag is not the one computed with the key and the nonces of sender and receiver.
    Forged,
    /// Frame with a valid tag that was received before. Also a frame with a counter too old for the check of
    /// duplicates.
    Replayed,
    /// Fifth or later outdated handshake in a row. It proves that the node's epoch went back or was used twice.
    WentBack,
}

impl Session {
    /// Creates an empty session table. This relay's nonces count up from `claim`, drawn at start. Once a remote node
    /// has been silent for `gone_after`, a second node with the same node number is accepted in its place.
    pub(crate) const fn new(auth: Auth, claim: u32, gone_after: Duration) -> Self {
        let (key, epoch) = auth.parts();
        Self {
            key,
            epoch,
            gone_after,
            claim,
            last_number: claim,
            rival: None,
            clock: 0,
            pinned: [None; 2],
            peers: heapless::Vec::new(),
            shown: None,
        }
    }

    /// Protects the table entries of `nodes`, the current neighbours, from replacement. Schedules a handshake to each
    /// neighbour without an entry.
    pub(crate) fn pin(&mut self, nodes: [Option<u16>; 2]) {
        self.pinned = nodes;
        for node in nodes.into_iter().flatten() {
            if self.find(node).is_none() {
                self.greet(node);
            }
        }
    }

    /// Schedules a handshake to node `to`. The node's presence counts as not proved until it replies.
    pub(crate) fn greet(&mut self, to: u16) {
        self.insert(to);
        if let Some(peer) = self.touch(to) {
            peer.handshake = true;
            peer.proven = false;
        }
    }

    /// Removes all table entries, as after a restart. New nonces count up from `claim`, or from the last nonce if that
    /// is larger.
    pub(crate) fn restart(&mut self, claim: u32) {
        if claim > self.last_number {
            self.claim = claim;
            self.last_number = claim;
        }
        self.peers.clear();
    }

    /// Schedules a handshake to node `to` if it has a table entry, once for each lease renewal `number`. The handshake
    /// shows this relay's nonce, so that a second node with this relay's number detects the duplicate.
    pub(crate) fn show(&mut self, to: u16, number: u16) {
        if self.shown == Some(number) {
            return;
        }
        if let Some(peer) = self.peers.iter_mut().find(|peer| peer.node == to) {
            peer.handshake = true;
            self.shown = Some(number);
        }
    }

    /// Schedules a handshake to node `to` that requests a reply. After the reply, each of the two nodes knows the
    /// other's nonce.
    pub(crate) fn request_reply(&mut self, to: u16) {
        self.insert(to);
        if let Some(peer) = self.touch(to) {
            peer.handshake = true;
            peer.requests_reply = true;
        }
    }

    /// Schedules a handshake that requests a reply from node `to`, from which no frames arrive any more.
    ///
    /// Does nothing if node `to` seems to have restarted in the same epoch. The handshake would show that node the
    /// nonce that it used before the restart. The restarted node could then continue its former session, and use frame
    /// counters twice.
    pub(crate) fn request_reply_of_silent(&mut self, to: u16) {
        let begun_anew =
            |peer: &Peer| peer.older.times > 0 && u64::from(peer.older.epoch) == peer.nonce >> 32;
        if !self.find(to).is_some_and(begun_anew) {
            self.request_reply(to);
        }
    }

    /// Returns the claim of a second node to this relay's node number, if a handshake has shown one. Returns each claim
    /// once.
    pub(crate) const fn poll_rival(&mut self) -> Option<Rival> {
        self.rival.take()
    }

    /// Returns a node to which a handshake is pending, and marks the handshake as sent. `None` if no handshake is
    /// pending.
    pub(crate) fn take_handshake(&mut self) -> Option<u16> {
        let peer = self.peers.iter_mut().find(|peer| peer.handshake)?;
        peer.handshake = false;
        Some(peer.node)
    }

    /// Returns true if node `to` can verify the tags of this relay's frames.
    pub(crate) fn knows(&self, to: u16) -> bool {
        self.find(to).is_some_and(|peer| peer.proven)
    }

    pub(crate) fn handshake(&mut self, to: u16) -> [u8; HANDSHAKE_LENGTH] {
        let mut body = [0; HANDSHAKE_LENGTH];
        let epoch = self.epoch;
        if let Some(peer) = self.peers.iter_mut().find(|peer| peer.node == to) {
            let Nonces { sender, receiver } = peer.nonces(epoch);
            let asks = core::mem::take(&mut peer.requests_reply) || !peer.proven;
            let tag = sender.to_le_bytes().into_iter();
            let tag = tag.chain(receiver.to_le_bytes());
            let tag = tag.chain([u8::from(asks)]);
            for (place, byte) in body.iter_mut().zip(tag) {
                *place = byte;
            }
        }
        body
    }

    pub(crate) fn signer(&mut self, to: u16) -> Signer<'_> {
        let epoch = self.epoch;
        let nonces = self
            .touch(to)
            .map_or_else(Nonces::default, |peer| peer.nonces(epoch));
        self.with(nonces)
    }

    const fn with(&self, nonces: Nonces) -> Signer<'_> {
        Signer {
            key: &self.key,
            nonces,
        }
    }

    /// Authenticates an intact frame from node `sender`. Work: the computation of one tag.
    pub(crate) fn check(&mut self, now: Instant, sender: u16, frame: &Opened<'_>) -> Checked {
        let Some(tag) = frame.tag else {
            return Checked::Unsigned;
        };
        if frame.handshake {
            return self
                .check_handshake(now, sender, frame, tag)
                .unwrap_or(Checked::Forged);
        }
        let epoch = self.epoch;
        let Some(nonces) = self.find(sender).map(|peer| peer.nonces(epoch).turned()) else {
            return Checked::Forged;
        };
        if nonces.sender == 0 || !is_same(self.with(nonces).tag(frame.signed), tag) {
            return Checked::Forged;
        }
        let Some(peer) = self.touch(sender) else {
            return Checked::Forged;
        };
        if !peer.window.accept(frame.header.counter) {
            return Checked::Replayed;
        }
        let first = !peer.proven;
        peer.proven = true;
        peer.last_proof = now;
        peer.older.times = 0;
        Checked::Fresh { first }
    }

    /// Checks the authentication tag of a handshake; `None` if the tag is wrong.
    fn check_handshake(
        &mut self,
        now: Instant,
        sender: u16,
        frame: &Opened<'_>,
        tag: [u8; TAG],
    ) -> Option<Checked> {
        let nonces = nonces_of(frame)?;
        let asks = frame.body.last().copied()?;
        if nonces.sender == 0 || !is_same(self.with(nonces).tag(frame.signed), tag) {
            return None;
        }
        if let Sender::Rival(rival) = self.owner(nonces.receiver) {
            self.rival = Some(rival);
        }
        let gone_after = self.gone_after;
        self.peers.retain(|peer| {
            let succeeds = peer.node == sender && is_rival(nonces.sender, peer.nonce);
            !(succeeds && now.since(peer.last_proof) >= gone_after)
        });
        self.insert(sender);
        let epoch = self.epoch;
        let peer = self.touch(sender)?;
        let begins = nonces.sender > peer.nonce;
        if begins {
            peer.nonce = nonces.sender;
            peer.last_proof = now;
            peer.window = Window::default();
            peer.proven = false;
        }
        let proof = nonces.receiver == peer.nonces(epoch).sender;
        // A node that has shown this relay's nonce forgets it only with a new nonce of its own.
        let old = nonces.sender < peer.nonce || peer.proven && !proof;
        if old {
            // Another node of this number must learn of the node that this relay accepts.
            peer.handshake |= asks == 1 && is_rival(nonces.sender, peer.nonce);
            let [.., a, b, c, d] = nonces.sender.to_le_bytes();
            let epoch = u32::from_le_bytes([a, b, c, d]);
            let back = peer.older.count(epoch, frame.header.counter);
            return Some(if back {
                Checked::WentBack
            } else {
                Checked::Replayed
            });
        }
        if !peer.window.accept(frame.header.counter) {
            return Some(Checked::Replayed);
        }
        peer.older.times = 0;
        peer.handshake |= asks == 1 && (begins || !proof || peer.proven);
        if !proof {
            return Some(Checked::Unproven);
        }
        let first = !peer.proven;
        peer.proven = true;
        peer.last_proof = now;
        Some(Checked::Handshake { first })
    }

    /// Returns the real sender of `frame`, whose header names this relay as the sender. Work: the computation of one
    /// tag.
    pub(crate) fn sender(&self, frame: &Opened<'_>) -> Sender {
        let epoch = self.epoch;
        let own = || Some(self.find(frame.header.destination)?.nonces(epoch));
        let nonces = if frame.handshake {
            nonces_of(frame)
        } else {
            own()
        };
        let Some((nonces, tag)) = nonces.zip(frame.tag) else {
            return Sender::Unknown;
        };
        if !is_same(self.with(nonces).tag(frame.signed), tag) {
            return Sender::Unknown;
        }
        self.owner(nonces.sender)
    }

    /// Returns the node that made `nonce`: this relay, or a second node with this relay's node number. `Unknown` if the
    /// nonce's epoch (start counter) is older than this relay's epoch.
    fn owner(&self, nonce: u64) -> Sender {
        let [number, epoch] = halves(nonce);
        if epoch < self.epoch {
            return Sender::Unknown;
        }
        let made = (number & !RAISED).wrapping_sub(self.claim & !RAISED);
        if epoch == self.epoch && made <= (self.last_number - self.claim).saturating_add(MAX_GAP) {
            return Sender::Itself;
        }
        Sender::Rival(Rival {
            number,
            newer_epoch: epoch > self.epoch,
            passive: false,
            is_current: true,
        })
    }

    fn find(&self, node: u16) -> Option<&Peer> {
        self.peers.iter().find(|peer| peer.node == node)
    }

    /// Returns the table entry of `node` and marks it as just used; `None` if there is no entry.
    fn touch(&mut self, node: u16) -> Option<&mut Peer> {
        self.clock = self.clock.wrapping_add(1);
        let peer = self.peers.iter_mut().find(|peer| peer.node == node)?;
        peer.used = self.clock;
        Some(peer)
    }

    /// Creates a table entry for `node` if there is none.
    ///
    /// A full table replaces its least recently used entry: entries without proof of presence first, pinned entries
    /// never. Once all nonces of the epoch are used, it creates no further entry.
    fn insert(&mut self, node: u16) {
        if self.find(node).is_some() {
            return;
        }
        let Some(made) = self.last_number.checked_add(1) else {
            return;
        };
        self.last_number = made;
        let peer = Peer {
            node,
            handshake: false,
            requests_reply: false,
            proven: false,
            used: self.clock,
            last_proof: Instant::ZERO,
            own_number: made,
            nonce: 0,
            window: Window::default(),
            older: OlderHandshakes::default(),
        };
        if let Err(peer) = self.peers.push(peer) {
            let (pinned, clock) = (self.pinned, self.clock);
            let oldest = self
                .peers
                .iter_mut()
                .filter(|peer| !pinned.contains(&Some(peer.node)))
                .max_by_key(|peer| (!peer.proven, clock.wrapping_sub(peer.used)));
            if let Some(place) = oldest {
                *place = peer;
            }
        }
    }
}

/// Splits a nonce into its lower half (a number) and its upper half (the epoch), in this order.
const fn halves(nonce: u64) -> [u32; 2] {
    let [a, b, c, d, e, f, g, h] = nonce.to_le_bytes();
    [
        u32::from_le_bytes([a, b, c, d]),
        u32::from_le_bytes([e, f, g, h]),
    ]
}

/// Returns true if two nonces of one epoch belong to two nodes with the same node number. The lower halves of such nonces differ by more
/// than [`MAX_GAP`]; the bit [`RAISED`] is ignored.
const fn is_rival(one: u64, other: u64) -> bool {
    let [[one, at], [other, epoch]] = [halves(one), halves(other)];
    at == epoch && (one & !RAISED).abs_diff(other & !RAISED) > MAX_GAP
}

/// Returns the sender's and the receiver's nonce from a handshake's body. `None` if `frame` is no handshake.
fn nonces_of(frame: &Opened<'_>) -> Option<Nonces> {
    let (other, rest) = frame.body.split_first_chunk::<8>()?;
    let (known, &[0 | 1]) = rest.split_first_chunk::<8>()? else {
        return None;
    };
    frame.handshake.then_some(Nonces {
        sender: u64::from_le_bytes(*other),
        receiver: u64::from_le_bytes(*known),
    })
}

#[cfg(feature = "auth")]
#[cfg(test)]
mod tests;
