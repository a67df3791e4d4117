//! Which frames a relay takes, and how it signs its own: one session with each node it talks to.
//!
//! For each node it talks to, a relay has a *nonce*: its epoch, and below it a number that counts such entries from the relay's claim
//! number on (`node::duplicate`). A frame's tag covers the sender's nonce toward the receiver and the receiver's toward the sender, so a frame that was
//! recorded before either of them was switched on, or had forgotten the other, is worth nothing. What a relay has to know
//! for that, the other's nonce, comes in a *handshake*: a frame whose body is the sender's nonce, the receiver's as far as the
//! sender knows it, and whether the sender still lacks the proof that the receiver is there.
//!
//! | a handshake with the right tag and | does |
//! | --- | --- |
//! | a nonce below the one known, or a counter that has been taken | nothing; it is counted as a replay. Five of one older epoch in a row with rising counters, and nothing newer between them, are told: the node's epoch went back |
//! | a nonce above the one known | the node has been switched on since: a new session begins |
//! | a nonce below the one known, of the same epoch and of another claim number | another node of that number: it is answered, if it asks, so that it learns of the one that this relay believes |
//! | the same, and the node of the nonce known was silent for `dead_after` | that node is forgotten, and a new session begins |
//! | a nonce of this relay's number that is not its own | another node of this relay's number, which the sender believes: see `node::duplicate` |
//! | this relay's own nonce | it is proof that the node is there now |
//! | a question, and none of that to learn by it here | nothing but the answer |
//!
//! A question that begins a session, that has not this relay's nonce, or that comes from a node already proven to be there is
//! answered by one handshake; nothing else is. So whatever is played at a relay, it says at most one handshake for each frame that
//! comes in, and with something else to say one in place of that.
//!
//! A recorded handshake can be new to a relay only where the relay has just been switched on or had forgotten its sender. What
//! it brings is no proof, as a recorded one can not have this relay's new nonce: it is no sign of life, nothing is sent on
//! its account but a handshake, and a nonce of the past is overtaken by the true one, which is larger. So it does no lasting
//! harm: until the true handshake comes there was nothing to be said to that node anyway.

use super::auth::{Auth, Nonces, Signer, TAG, Window, is_same};
use super::frame::Opened;
use crate::node::duplicate::{RAISED, Rival, Sender};
use crate::time::{Duration, Instant};

/// Bytes of the body of a handshake.
pub(crate) const HELLO: usize = 17;

/// Nodes that a relay remembers at once.
const PEERS: usize = 8;

/// Nonces of one epoch whose numbers are this far apart, or less, are taken for those of one node.
const NEAR: u32 = 1 << 12;

/// So many handshakes of an older epoch in a row are no delayed ones.
const WENT_BACK: u8 = 5;

/// One node that this relay talks to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Peer {
    node: u16,
    /// Whether a handshake is to be sent.
    handshake: bool,
    /// Whether the handshake asks for an answer although the node is proven.
    asks: bool,
    /// Whether it has shown this relay's nonce: it is there, and both know each other.
    proven: bool,
    /// When it was last used, on the session's own clock.
    used: u32,
    /// Time of its last proof, or of its first frame with a larger nonce.
    heard: Instant,
    /// The lower half of this relay's nonce toward it; the upper one is the epoch.
    own: u32,
    /// The largest nonce it has shown, 0 before any.
    other: u64,
    taken: Window,
    older: Older,
}

/// Handshakes of an older epoch, or of the same one begun anew.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Older {
    epoch: u32,
    /// One more than the counter of the last.
    next: u32,
    /// How many came in a row, one after the other by their counters.
    times: u8,
}

impl Older {
    /// One more; whether it is the last of so many that the node itself has to be there. A frame that is played again is none.
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
        self.times == WENT_BACK
    }
}

impl Peer {
    /// The nonces of what is sent to it.
    const fn nonces(&self, epoch: u32) -> Nonces {
        Nonces {
            sender: (epoch as u64) << 32 | self.own as u64,
            receiver: self.other,
        }
    }
}

/// What an authenticated relay knows of the nodes it talks to.
#[derive(Clone, Debug)]
pub(crate) struct Session {
    auth: Auth,
    /// Silence after which another node of the same number takes the place of the one that is believed.
    gone_after: Duration,
    /// Claim number: the lower halves of this relay's nonces are above it.
    claim: u32,
    /// Lower half of the last nonce made.
    made: u32,
    /// Claim to this relay's number that the last frame has shown.
    rival: Option<Rival>,
    /// Counts uses of entries, wrapping.
    clock: u32,
    /// Nodes whose entries are kept.
    pinned: [Option<u16>; 2],
    peers: heapless::Vec<Peer, PEERS>,
}

/// What a frame turned out to be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Checked {
    /// A member's, and new: its body counts. Whether it is the first proof that the node is there.
    Fresh { first: bool },
    /// A handshake, new, and proof that the node is there; whether it is the first.
    Handshake { first: bool },
    /// A handshake with the right tag that proves nothing: it may have been recorded.
    Unproven,
    /// Without a tag.
    Unsigned,
    /// With a tag that is wrong, for these nonces at least.
    Forged,
    /// A member's, taken before or too old to tell.
    Replayed,
    /// The same, and the last of so many in a row that the node itself goes on with an older epoch.
    WentBack,
}

impl Session {
    /// A session that knows nobody, of a node with claim number `claim`. A node that is silent for `gone_after` gives way to another one
    /// with its number.
    pub(crate) const fn new(auth: Auth, claim: u32, gone_after: Duration) -> Self {
        Self {
            auth,
            gone_after,
            claim,
            made: claim,
            rival: None,
            clock: 0,
            pinned: [None; 2],
            peers: heapless::Vec::new(),
        }
    }

    /// Keeps the entries of `nodes`, the present neighbours, and no others; those without one are greeted.
    pub(crate) fn pin(&mut self, nodes: [Option<u16>; 2]) {
        self.pinned = nodes;
        for node in nodes.into_iter().flatten() {
            if self.find(node).is_none() {
                self.greet(node);
            }
        }
    }

    /// Owes a handshake to node `to`, with a new entry if there is none, and takes it for unproven until it has answered.
    pub(crate) fn greet(&mut self, to: u16) {
        self.make(to);
        if let Some(peer) = self.touch(to) {
            peer.handshake = true;
            peer.proven = false;
        }
    }

    /// Forgets all nodes. Nonces made from now on are above `claim`, if that is a new claim number.
    pub(crate) fn restart(&mut self, claim: u32) {
        if claim > self.made {
            self.claim = claim;
            self.made = claim;
        }
        self.peers.clear();
    }

    /// Owes a handshake to the known node `to`, for other nodes of this relay's number that receive it, too.
    pub(crate) fn show(&mut self, to: u16) {
        if let Some(peer) = self.peers.iter_mut().find(|peer| peer.node == to) {
            peer.handshake = true;
        }
    }

    /// Owes a handshake to node `to` that asks for one in return, by which its nodes learn this relay's nonce, and this relay theirs.
    pub(crate) fn ask(&mut self, to: u16) {
        self.make(to);
        if let Some(peer) = self.touch(to) {
            peer.handshake = true;
            peer.asks = true;
        }
    }

    /// Owes the same to a silent node, but not while its handshakes are those of a start with a used nonce: shown its own nonce, such a
    /// node would pass for the one that it was, and its nonces and counters would be used twice.
    pub(crate) fn ask_silent(&mut self, to: u16) {
        let begun_anew =
            |peer: &Peer| peer.older.times > 0 && u64::from(peer.older.epoch) == peer.other >> 32;
        if !self.find(to).is_some_and(begun_anew) {
            self.ask(to);
        }
    }

    /// Returns the claim to this relay's number that the last frame has shown.
    pub(crate) const fn poll_rival(&mut self) -> Option<Rival> {
        self.rival.take()
    }

    /// A node that a handshake is to be sent to: it then has been.
    pub(crate) fn take_handshake(&mut self) -> Option<u16> {
        let peer = self.peers.iter_mut().find(|peer| peer.handshake)?;
        peer.handshake = false;
        Some(peer.node)
    }

    /// Whether node `to` can read what it is sent.
    pub(crate) fn knows(&self, to: u16) -> bool {
        self.find(to).is_some_and(|peer| peer.proven)
    }

    /// The body of a handshake to node `to`.
    pub(crate) fn handshake(&mut self, to: u16) -> [u8; HELLO] {
        let mut body = [0; HELLO];
        let epoch = self.auth.epoch;
        if let Some(peer) = self.peers.iter_mut().find(|peer| peer.node == to) {
            let Nonces { sender, receiver } = peer.nonces(epoch);
            let asks = core::mem::take(&mut peer.asks) || !peer.proven;
            let told = sender.to_le_bytes().into_iter();
            let told = told.chain(receiver.to_le_bytes());
            let told = told.chain([u8::from(asks)]);
            for (place, byte) in body.iter_mut().zip(told) {
                *place = byte;
            }
        }
        body
    }

    /// What signs frames to node `to`.
    pub(crate) fn signer(&mut self, to: u16) -> Signer<'_> {
        let epoch = self.auth.epoch;
        let nonces = self
            .touch(to)
            .map_or_else(Nonces::default, |peer| peer.nonces(epoch));
        self.with(nonces)
    }

    const fn with(&self, nonces: Nonces) -> Signer<'_> {
        Signer {
            key: &self.auth.key,
            nonces,
        }
    }

    /// Checks an intact frame that says it is from node `sender`. Work: that of one tag.
    pub(crate) fn check(&mut self, now: Instant, sender: u16, frame: &Opened<'_>) -> Checked {
        let Some(told) = frame.tag else {
            return Checked::Unsigned;
        };
        if frame.handshake {
            return self
                .meet(now, sender, frame, told)
                .unwrap_or(Checked::Forged);
        }
        let epoch = self.auth.epoch;
        let Some(nonces) = self.find(sender).map(|peer| peer.nonces(epoch).turned()) else {
            return Checked::Forged;
        };
        if nonces.sender == 0 || !is_same(self.with(nonces).tag(frame.signed), told) {
            return Checked::Forged;
        }
        let Some(peer) = self.touch(sender) else {
            return Checked::Forged;
        };
        if !peer.taken.take(frame.header.counter) {
            return Checked::Replayed;
        }
        let first = !peer.proven;
        peer.proven = true;
        peer.heard = now;
        peer.older.times = 0;
        Checked::Fresh { first }
    }

    /// A handshake; `None` if its tag is wrong.
    fn meet(
        &mut self,
        now: Instant,
        sender: u16,
        frame: &Opened<'_>,
        told: [u8; TAG],
    ) -> Option<Checked> {
        let nonces = said(frame)?;
        let asks = frame.body.last().copied()?;
        if nonces.sender == 0 || !is_same(self.with(nonces).tag(frame.signed), told) {
            return None;
        }
        if let Sender::Rival(rival) = self.owner(nonces.receiver) {
            self.rival = Some(rival);
        }
        let gone_after = self.gone_after;
        self.peers.retain(|peer| {
            let succeeds = peer.node == sender && is_rival(nonces.sender, peer.other);
            !(succeeds && now.since(peer.heard) >= gone_after)
        });
        self.make(sender);
        let epoch = self.auth.epoch;
        let peer = self.touch(sender)?;
        let begins = nonces.sender > peer.other;
        if begins {
            peer.other = nonces.sender;
            peer.heard = now;
            peer.taken = Window::default();
            peer.proven = false;
        }
        let proof = nonces.receiver == peer.nonces(epoch).sender;
        // A node that has shown this relay's nonce does not forget it without a new one of its own.
        let old = nonces.sender < peer.other || peer.proven && !proof;
        if old {
            // Another node of this number has to learn of the one that this relay believes.
            peer.handshake |= asks == 1 && is_rival(nonces.sender, peer.other);
            let [.., a, b, c, d] = nonces.sender.to_le_bytes();
            let epoch = u32::from_le_bytes([a, b, c, d]);
            let back = peer.older.count(epoch, frame.header.counter);
            return Some(if back {
                Checked::WentBack
            } else {
                Checked::Replayed
            });
        }
        if !peer.taken.take(frame.header.counter) {
            return Some(Checked::Replayed);
        }
        peer.older.times = 0;
        peer.handshake |= asks == 1 && (begins || !proof || peer.proven);
        if !proof {
            return Some(Checked::Unproven);
        }
        let first = !peer.proven;
        peer.proven = true;
        peer.heard = now;
        Some(Checked::Handshake { first })
    }

    /// Returns what `frame`, under this relay's own number, says of its sender. Work: that of one tag.
    pub(crate) fn sender(&self, frame: &Opened<'_>) -> Sender {
        let epoch = self.auth.epoch;
        let own = || Some(self.find(frame.header.destination)?.nonces(epoch));
        let nonces = if frame.handshake { said(frame) } else { own() };
        let Some((nonces, told)) = nonces.zip(frame.tag) else {
            return Sender::Unknown;
        };
        if !is_same(self.with(nonces).tag(frame.signed), told) {
            return Sender::Unknown;
        }
        self.owner(nonces.sender)
    }

    /// Returns which node of this relay's number has `nonce`; of an older epoch, or 0, it is not known.
    fn owner(&self, nonce: u64) -> Sender {
        let [number, epoch] = halves(nonce);
        if epoch < self.auth.epoch {
            return Sender::Unknown;
        }
        let made = (number & !RAISED).wrapping_sub(self.claim & !RAISED);
        if epoch == self.auth.epoch && made <= (self.made - self.claim).saturating_add(NEAR) {
            return Sender::Itself;
        }
        Sender::Rival(Rival {
            number,
            newer_epoch: epoch > self.auth.epoch,
            passive: false,
            is_current: true,
        })
    }

    fn find(&self, node: u16) -> Option<&Peer> {
        self.peers.iter().find(|peer| peer.node == node)
    }

    /// The entry of `node`, used now.
    fn touch(&mut self, node: u16) -> Option<&mut Peer> {
        self.clock = self.clock.wrapping_add(1);
        let peer = self.peers.iter_mut().find(|peer| peer.node == node)?;
        peer.used = self.clock;
        Some(peer)
    }

    /// Makes an entry for `node` if it has none: in a full table in place of one that is neither pinned nor proven, if there is
    /// such a one, and of those the one that was not used for longest. After four billion of them there are no more: a nonce
    /// is never used twice.
    fn make(&mut self, node: u16) {
        if self.find(node).is_some() {
            return;
        }
        let Some(made) = self.made.checked_add(1) else {
            return;
        };
        self.made = made;
        let peer = Peer {
            node,
            handshake: false,
            asks: false,
            proven: false,
            used: self.clock,
            heard: Instant::ZERO,
            own: made,
            other: 0,
            taken: Window::default(),
            older: Older::default(),
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

/// Returns the number and the epoch of a nonce.
const fn halves(nonce: u64) -> [u32; 2] {
    let [a, b, c, d, e, f, g, h] = nonce.to_le_bytes();
    [
        u32::from_le_bytes([a, b, c, d]),
        u32::from_le_bytes([e, f, g, h]),
    ]
}

/// Returns true if two nonces of one epoch are of two nodes: their numbers are farther apart than those that a node makes. What a node adds
/// to its claim number to keep its place makes no other node of it.
const fn is_rival(one: u64, other: u64) -> bool {
    let [[one, at], [other, epoch]] = [halves(one), halves(other)];
    at == epoch && (one & !RAISED).abs_diff(other & !RAISED) > NEAR
}

/// The nonces of its sender and its receiver that stand in a handshake; `None` if `frame` is none.
fn said(frame: &Opened<'_>) -> Option<Nonces> {
    let (other, rest) = frame.body.split_first_chunk::<8>()?;
    let (known, &[0 | 1]) = rest.split_first_chunk::<8>()? else {
        return None;
    };
    frame.handshake.then_some(Nonces {
        sender: u64::from_le_bytes(*other),
        receiver: u64::from_le_bytes(*known),
    })
}

#[cfg(test)]
mod tests;
