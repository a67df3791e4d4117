//! One side of a relay: which node it takes for its neighbour there, and what it does about silence.
//!
//! | state | the node taken is lost | it says that it takes another, or does not hear this relay | a hello comes from a node not taken that hears this relay | time passes |
//! | --- | --- | --- | --- | --- |
//! | `Linked` | `Searching` on a shared channel, else it goes on asking | `Pairing` | taken instead after a hold-down, if it is better | - |
//! | `Pairing` | `Searching` | - | as above | after a span `Searching` |
//! | `Searching` | - | - | taken, a farther one not before nearer ones could be heard; one that comes and goes after a hold-down | after a span `NoPeer` |
//! | `NoPeer` | - | - | taken, if it takes this relay; else, or if it comes and goes, after a hold-down | the four nearest nodes are sent a hello every `dead_after`, every half of `probe_after` once one was heard |
//!
//! A span is `dead_after` less `probe_after`, or as long as a run of lost frames may be by what the channel has shown. A node that has been taken is paired with until it says that it has taken this relay, too.
//! A node that takes another one is not taken. *Better* is a nearer node that has somebody beyond it who hears it, and a farther one by which more
//! relays hang together: then the link that is missing is on the other side of the node taken, and it is left out. Where two links cross, as
//! 1 - 3 and 2 - 4 do while 2 and 3 do not hear each other, neither of the two parts could go on: of them that of the node nearest to Rx is
//! given up, 4 takes 3, and 2 is left out.
//!
//! While it searches, it sends hellos to the four nearest nodes there: as many as three relays in a row may be lost at once. In a hold-down
//! a node has to be heard all through: `probe_after` at first; after a fourth loss on that side `dead_after`, and twice as long after every
//! other one up to sixteen times, so that a link that comes and goes disturbs the chain less and less. A loss is forgotten after 32 times
//! `dead_after` without another. A node that has come back is a reason for a new view `probe_after` later: the other one beside it may be
//! about to take it, too.

use super::liveness::{Liveness, patience, tick};
use crate::jitter::Jitter;
use crate::node::context::Proposer;
use crate::node::timing::{first_pass, longest_lease};
use crate::settings::{Settings, Wiring};
use crate::time::{Duration, Instant};
use crate::wire::digest::MissionId;

/// Nodes on one side that are sent a hello.
pub(crate) const CANDIDATES: u16 = 4;

/// So many times in a row a node has to say that it does not hear this relay: an answer or two may be lost.
const UNHEARD: u8 = 8;

/// Handshakes in a row under a node's number that are signed with another key.
#[cfg(feature = "auth")]
const FORGED: u8 = 3;

/// How often something was so for each of the nearest nodes, in a row; the nearest first.
#[derive(Clone, Copy, Debug, Default)]
struct InRow([u8; CANDIDATES as usize]);

impl InRow {
    /// It was so once more, of the node `distance` nodes away, or it was not; whether it has been so `most` times just now.
    fn count(&mut self, distance: u16, so: bool, most: u8) -> bool {
        let at = usize::from(distance).wrapping_sub(1);
        let Some(times) = self.0.get_mut(at) else {
            return false;
        };
        if !so {
            *times = 0;
            return false;
        }
        let reached = *times + 1 == most;
        *times = times.saturating_add(1).min(most);
        reached
    }
}

/// Doublings of the hold-down.
const DOUBLINGS: u8 = 4;

/// Losses after which a link is not one that comes and goes yet.
const FORGIVEN: u8 = 3;

/// After so many times `dead_after` without another, a loss is forgotten.
const MEMORY: u32 = 32;

/// A node that is not taken, and hears this relay.
#[expect(
    clippy::struct_excessive_bools,
    reason = "four things that its hello says"
)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) node: u16,
    /// How many places away it is, and whether toward Rx.
    pub(crate) distance: u16,
    pub(crate) downstream: bool,
    /// Whether it takes this relay for its neighbour.
    pub(crate) pairs: bool,
    /// Whether it is nearer than the one taken.
    pub(crate) nearer: bool,
    /// Whether it has somebody beyond it.
    pub(crate) ready: bool,
    /// Whether more relays hang together by it than by the one taken.
    pub(crate) longer: bool,
}

impl Candidate {
    /// How many nodes there may be between it and the one that was lost.
    const fn beyond(self) -> u16 {
        self.distance.saturating_sub(2)
    }

    /// Whether it is to take the place of another one.
    const fn is_better(self) -> bool {
        if self.nearer { self.ready } else { self.longer }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum NeighbourState {
    /// The other node has taken this one, too, as far as it has said.
    Linked,
    /// It has not, or not any more.
    Pairing {
        since: Instant,
    },
    Searching {
        since: Instant,
    },
    NoPeer,
}

/// A node that may be taken once it has been heard for long enough.
#[derive(Clone, Copy, Debug)]
struct HoldDown {
    node: u16,
    since: Instant,
    heard: Instant,
}

/// Which nodes on one side can be heard.
#[derive(Clone, Copy, Debug)]
struct Hearing {
    since: Instant,
    now: u8,
    before: u8,
}

/// The bit of the node `distance` places away.
const fn mask(distance: u16) -> u8 {
    if distance >= 1 && distance <= CANDIDATES {
        1 << (distance - 1)
    } else {
        0
    }
}

impl Hearing {
    const fn new(now: Instant) -> Self {
        Self {
            since: now,
            now: 0,
            before: 0,
        }
    }

    fn add(&mut self, distance: u16, now: Instant, settings: &Settings) {
        self.age(now, settings);
        self.now |= mask(distance);
    }

    /// Those of the last two spans.
    fn recent(mut self, now: Instant, settings: &Settings) -> u8 {
        self.age(now, settings);
        self.now | self.before
    }

    /// Forgets who was not heard for two spans of `probe_after`.
    fn age(&mut self, now: Instant, settings: &Settings) {
        let span = now.since(self.since);
        if span < settings.probe_after {
            return;
        }
        let old = span >= settings.probe_after.times(2);
        self.before = if old { 0 } else { self.now };
        self.now = 0;
        self.since = now;
    }
}

/// What waits to be sent to the neighbour, apart from passes and what comes back of them.
#[derive(Clone, Copy, Debug, Default)]
struct Signs {
    /// A question whether it is there.
    ask: bool,
    /// The answer to its question of that number, 0 for none.
    answer: u16,
}

/// One side.
#[derive(Clone, Debug)]
pub(crate) struct Neighbour {
    /// The node taken, 0 for none.
    node: u16,
    /// The node that was there when the view was agreed on.
    agreed: u16,
    /// The node that was there when a proposal was decided last, granted or not.
    counted: u16,
    /// A node that has come back is not counted before: the other side may be about to take it, too.
    grace: Instant,
    /// The node that the last proposal came from.
    proposer: u16,
    state: NeighbourState,
    liveness: Liveness,
    hold_down: Option<HoldDown>,
    /// How far away the node taken is.
    distance: u16,
    /// The nodes that have said that they hear this relay.
    both_ways: Hearing,
    /// Whom the nodes on this side take here, the nearest first; 0 for none.
    taken_by: [u16; CANDIDATES as usize],
    /// The node that was lost last, and when.
    lost: u16,
    lost_at: Instant,
    /// When a node that is not taken was heard last.
    near: Option<Instant>,
    /// The nodes heard since `since`, and in the span before: bit 0 is the nearest one.
    hearing: Hearing,
    /// How often each of them said that it does not hear this relay.
    unheard: InRow,
    /// How often a handshake under its number was signed with another key.
    #[cfg(feature = "auth")]
    forged: InRow,
    losses: u8,
    /// How long after one question the next one is asked.
    tick: Duration,
    /// How long a sign of life is waited for until one is asked for.
    patience: Duration,
    jitter: Jitter,
    signs: Signs,
    /// The newest mission that the node taken holds, as far as it has said.
    pub(crate) holds: Option<MissionId>,
    /// The number of its last hello, which an offer to it answers; 0 before any.
    #[cfg(feature = "upload")]
    pub(crate) asked: u16,
    /// Whether a newer one is to be offered to it.
    #[cfg(feature = "upload")]
    pub(crate) offer: bool,
    /// Whether the ground at this side is owed a hello.
    #[cfg(feature = "upload")]
    pub(crate) ground: bool,
    /// When to look for a sign of life again.
    look_at: Option<Instant>,
    /// Candidates that are owed a hello, and those of them that are asked for one: bit 0 is the nearest node.
    hellos: u8,
    asks: u8,
}

impl Neighbour {
    /// The side where `node` is taken to be, 0 for none.
    pub(crate) fn new(node: u16, all: u16, seed: u32, now: Instant, settings: &Settings) -> Self {
        let look_at = if node == 0 {
            None
        } else {
            // Where others may have closed up since, it makes itself known soon.
            let soon = Duration::from_micros(settings.probe_after.as_micros() / 4);
            let wait = match settings.wiring {
                // The first pass comes without being asked for.
                Wiring::Pair => patience(settings, all).max(first_pass(settings, all)),
                Wiring::Shared => soon,
            };
            Some(now + wait)
        };
        Self {
            look_at,
            node,
            agreed: node,
            counted: node,
            grace: now,
            proposer: node,
            state: if node == 0 {
                NeighbourState::NoPeer
            } else {
                NeighbourState::Linked
            },
            liveness: Liveness::new(now),
            hold_down: None,
            distance: 1,
            both_ways: Hearing::new(now),
            taken_by: [0; CANDIDATES as usize],
            lost: 0,
            lost_at: now,
            near: None,
            hearing: Hearing::new(now),
            unheard: InRow::default(),
            #[cfg(feature = "auth")]
            forged: InRow::default(),
            losses: 0,
            tick: tick(settings, all),
            patience: patience(settings, all),
            jitter: Jitter::new(seed),
            signs: Signs {
                ask: false,
                answer: 0,
            },
            holds: None,
            #[cfg(feature = "upload")]
            asked: 0,
            #[cfg(feature = "upload")]
            offer: false,
            #[cfg(feature = "upload")]
            ground: false,
            hellos: 0,
            asks: 0,
        }
    }

    /// The node taken, 0 for none.
    pub(crate) const fn node(&self) -> u16 {
        self.node
    }

    /// Whether nobody is there, and nobody is sought any more.
    pub(crate) fn has_no_peer(&self) -> bool {
        self.state == NeighbourState::NoPeer
    }

    /// Whether the node `distance` places away is heard, and hears this relay.
    pub(crate) fn is_two_way(&self, distance: u16, now: Instant, settings: &Settings) -> bool {
        let known = mask(distance) & self.both_ways.recent(now, settings) != 0;
        known || self.is_mutual() && self.distance == distance && self.liveness.is_there()
    }

    /// Whether the neighbour here is linked, and less than `distance` places away.
    pub(crate) fn comes_along(&self, distance: u16) -> bool {
        self.is_mutual() && self.liveness.is_there() && self.distance < distance
    }

    /// Whether the neighbour here is linked, and more than `distance` places away.
    pub(crate) fn goes_past(&self, distance: u16) -> bool {
        self.is_mutual() && self.liveness.is_there() && self.distance > distance
    }

    /// Node `distance` places away has said which one it takes on this side, and whether it hears this relay.
    pub(crate) fn says(
        &mut self,
        distance: u16,
        neighbour: u16,
        hears: bool,
        now: Instant,
        settings: &Settings,
    ) {
        if let Some(taken) = self.taken_by.get_mut(usize::from(distance).wrapping_sub(1)) {
            *taken = neighbour;
        }
        if hears {
            self.both_ways.add(distance, now, settings);
        }
    }

    /// The node that the one `distance` places away takes on this side, as it said last; 0 for none.
    pub(crate) fn taken_by(&self, distance: u16) -> u16 {
        let known = self.taken_by.get(usize::from(distance).wrapping_sub(1));
        known.copied().unwrap_or(0)
    }

    /// Whether it is certain who is there, and somebody else than when a proposal was decided last.
    pub(crate) fn has_changed(&self, now: Instant) -> bool {
        match self.state {
            NeighbourState::Linked => self.node != self.counted && now >= self.grace,
            NeighbourState::NoPeer => self.counted != 0,
            NeighbourState::Pairing { .. } | NeighbourState::Searching { .. } => false,
        }
    }

    /// Whether it is who was there when the view was agreed on.
    pub(crate) const fn is_agreed(&self) -> bool {
        self.node == self.agreed
    }

    /// A proposal has come from whoever is there, or begins here: then nobody is to be before this relay.
    pub(crate) const fn proposed_by(&mut self, proposer: Proposer) {
        self.proposer = match proposer {
            Proposer::Itself => 0,
            Proposer::Neighbour => self.node,
        };
    }

    /// The proposal that came from this side was granted.
    pub(crate) const fn agree_with_proposer(&mut self) {
        self.agreed = self.proposer;
        self.counted = self.proposer;
    }

    /// It was not granted: there is nothing to ask again until somebody else is there.
    pub(crate) const fn refuse(&mut self) {
        self.counted = self.node;
    }

    /// Whether whoever is there has come back just now.
    pub(crate) fn has_grace(&self, now: Instant) -> bool {
        now < self.grace
    }

    /// The proposal that was granted goes on to whoever is there, or ends here.
    pub(crate) const fn agree(&mut self, ends: bool) {
        self.agreed = if ends { 0 } else { self.node };
        self.counted = self.agreed;
    }

    /// An intact frame from the node `distance` nodes away, which is the one `taken` or not.
    pub(crate) fn heard(&mut self, distance: u16, taken: bool, now: Instant, settings: &Settings) {
        self.hearing.add(distance, now, settings);
        if taken {
            self.liveness.met();
        }
    }

    /// The nodes that were heard lately: bit 0 is the nearest one.
    pub(crate) fn hears(&self, now: Instant, settings: &Settings) -> u8 {
        self.hearing.recent(now, settings)
    }

    /// The node `distance` nodes away has said whether it hears this relay; whether it does not, for the last of so many times in a row.
    pub(crate) fn says_it_hears(&mut self, distance: u16, heard: bool) -> bool {
        self.unheard.count(distance, !heard, UNHEARD)
    }

    /// A handshake under the number of the node `distance` nodes away was signed with another key; whether that is certain now.
    #[cfg(feature = "auth")]
    pub(crate) fn is_forged(&mut self, distance: u16) -> bool {
        self.forged.count(distance, true, FORGED)
    }

    /// The node `distance` nodes away has the key.
    #[cfg(feature = "auth")]
    pub(crate) fn is_signed_right(&mut self, distance: u16) {
        self.forged.count(distance, false, FORGED);
    }

    /// Whether the node taken has been heard and is not lost.
    pub(crate) const fn is_there(&self) -> bool {
        self.liveness.is_there()
    }

    /// The neighbour was there `at` that time or later; whether it had been lost until now.
    pub(crate) fn confirmed(&mut self, now: Instant, at: Instant) -> bool {
        let back = self.liveness.confirmed(at);
        if self.is_mutual() {
            let next = (self.liveness.heard() + self.patience).max(now + self.tick);
            // What answers something said long ago is no reason to ask sooner.
            let next = self.look_at.map_or(next, |at| at.max(next));
            // Another node than before is to be counted once its grace is over.
            let waits = self.node != self.counted && now < self.grace;
            self.look_at = Some(if waits { next.min(self.grace) } else { next });
        }
        back
    }

    /// The neighbour asks for a sign of life, with a question of that number.
    pub(crate) const fn asked(&mut self, number: u16) {
        if number != 0 {
            self.signs.answer = number;
        }
    }

    /// The neighbour has answered the question of that number: when that was asked.
    pub(crate) fn answered(&self, number: u16) -> Option<Instant> {
        self.liveness.answered(number)
    }

    /// Whether somebody is there, and takes this relay for its neighbour, too, as far as it has said.
    pub(crate) fn is_mutual(&self) -> bool {
        self.state == NeighbourState::Linked
    }

    /// The neighbour has said whether it takes this relay for its own; whether that is new.
    pub(crate) fn told(&mut self, mutual: bool, now: Instant) -> bool {
        let (next, wait) = match (self.state, mutual) {
            (NeighbourState::Pairing { .. }, true) => (NeighbourState::Linked, self.patience),
            (NeighbourState::Linked, false) => (NeighbourState::Pairing { since: now }, self.tick),
            _ => return false,
        };
        self.state = next;
        self.look_at = Some(now + wait);
        true
    }

    /// The silence so far of a neighbour of the same view is excused; whether there is one, and it is not lost.
    pub(crate) fn excuse(&mut self, now: Instant, settings: &Settings) -> bool {
        let excused =
            self.state == NeighbourState::Linked && self.is_agreed() && self.liveness.excuse(now);
        if excused {
            self.look_at = Some(now + settings.probe_after);
        }
        excused
    }

    /// Whether it is time to look for a sign of life.
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        self.look_at.is_some_and(|at| at <= now)
    }

    pub(crate) const fn next_timeout(&self) -> Option<Instant> {
        self.look_at
    }

    /// Nothing has come for a while; whether the neighbour counts as lost since this moment, as it does after `dead`. `searches` tells
    /// whether others could be heard here.
    pub(crate) fn handle_timeout(
        &mut self,
        now: Instant,
        settings: &Settings,
        dead: Duration,
        searches: bool,
    ) -> bool {
        let step = self.jitter.spread(self.tick);
        let span = settings
            .dead_after
            .as_micros()
            .saturating_sub(settings.probe_after.as_micros());
        let run = self.liveness.run(self.tick).min(longest_lease(settings));
        let span = run.max(Duration::from_micros(span));
        let is_over = |since: Instant| now.since(since) >= span;
        let mut lost = false;
        let mut look_again = now + step;
        match self.state {
            NeighbourState::Linked => {
                let silence = self.liveness.silent(now, dead, step, settings);
                lost = silence.lost;
                self.signs.ask = true;
                if lost && searches {
                    self.lose(now, settings);
                    self.search(now);
                } else {
                    look_again = silence.look_again;
                }
            }
            NeighbourState::Pairing { since } => {
                lost = self
                    .liveness
                    .silent(now, settings.dead_after, step, settings)
                    .lost;
                self.hello_all();
                if lost || is_over(since) {
                    self.search(now);
                }
            }
            NeighbourState::Searching { since } => {
                self.hello_all();
                if is_over(since) {
                    self.state = NeighbourState::NoPeer;
                }
            }
            NeighbourState::NoPeer => {
                self.hello_all();
                let often = Duration::from_micros((settings.probe_after.as_micros() / 2).max(1));
                let wait = if self.is_near(now, settings) {
                    often
                } else {
                    settings.dead_after
                };
                look_again = now + self.jitter.spread(wait);
            }
        }
        self.look_at = Some(look_again);
        lost
    }

    fn is_near(&self, now: Instant, settings: &Settings) -> bool {
        self.near
            .is_some_and(|near| now.since(near) <= settings.dead_after)
    }

    /// A node that is not taken has been heard: where the chain has ended here so far, and nobody was near, it is looked after.
    pub(crate) fn notice(&mut self, now: Instant, settings: &Settings) {
        if self.has_no_peer() && !self.is_near(now, settings) {
            self.look_at = Some(now + self.tick);
        }
        self.near = Some(now);
    }

    /// The node taken is lost: one more of a link that comes and goes, or the first one for long.
    fn lose(&mut self, now: Instant, settings: &Settings) {
        let long = now.since(self.lost_at) >= settings.dead_after.times(MEMORY);
        let before = if long { 0 } else { self.losses };
        // Where many frames are lost, it is the channel that comes and goes.
        let one = u8::from(self.liveness.is_clear());
        self.losses = before.saturating_add(one);
        self.lost = self.node;
        self.lost_at = now;
    }

    const fn search(&mut self, now: Instant) {
        self.node = 0;
        self.state = NeighbourState::Searching { since: now };
        self.hold_down = None;
        self.hello_all();
    }

    /// A node that is not taken has sent a hello: whether it is taken from now on.
    ///
    /// It is one that hears this relay, and takes it for its neighbour or nobody.
    pub(crate) fn consider(
        &mut self,
        candidate: Candidate,
        now: Instant,
        settings: &Settings,
    ) -> bool {
        let node = candidate.node;
        // A link that comes and goes has to stay for a while first.
        let none = Duration::from_micros(0);
        let flaps = node == self.lost && self.losses > FORGIVEN;
        let takes = match self.state {
            NeighbourState::Searching { since } => {
                // One that is nearer may be about to be heard.
                let wait = self.tick.times(u32::from(candidate.beyond()) * 2);
                now.since(since) >= wait && (!flaps || self.passes(node, none, now, settings))
            }
            NeighbourState::NoPeer => {
                candidate.pairs && !flaps || self.passes(node, none, now, settings)
            }
            NeighbourState::Linked | NeighbourState::Pairing { .. } => {
                // Of two that could leave somebody out the one nearer to Rx does, unless it takes long.
                let waits = !candidate.nearer && candidate.downstream;
                let more = if waits {
                    settings.dead_after.times(2)
                } else {
                    none
                };
                candidate.is_better() && self.passes(node, more, now, settings)
            }
        };
        if !takes {
            return false;
        }
        if !matches!(self.state, NeighbourState::Searching { .. }) {
            self.grace = now + settings.probe_after;
        }
        self.signs = Signs::default();
        self.node = node;
        self.distance = candidate.distance;
        self.state = NeighbourState::Pairing { since: now };
        self.liveness.renew(now);
        self.hold_down = None;
        self.look_at = Some(now + self.tick);
        true
    }

    /// Whether a node that is heard now has been for the whole of its hold-down.
    fn passes(&mut self, node: u16, more: Duration, now: Instant, settings: &Settings) -> bool {
        let since = match self.hold_down {
            Some(known) if known.node == node && now.since(known.heard) <= settings.dead_after => {
                known.since
            }
            _ => now,
        };
        self.hold_down = Some(HoldDown {
            node,
            since,
            heard: now,
        });
        let hold_down = match self.losses.checked_sub(FORGIVEN + 1) {
            None => settings.probe_after,
            Some(more) => settings.dead_after.times(1 << more.min(DOUBLINGS)),
        };
        now.since(since) >= hold_down.max(more)
    }

    /// A heartbeat that is owed: to which node, the number of its question and that of the one it answers.
    pub(crate) fn take_heartbeat(&mut self, now: Instant) -> Option<(u16, u16, u16)> {
        let Signs { ask, answer } = core::mem::take(&mut self.signs);
        if !(ask || answer != 0) || self.node == 0 {
            return None;
        }
        let question = if ask { self.liveness.ask(now) } else { 0 };
        Some((self.node, question, answer))
    }

    /// Owes a hello to the candidate `distance` nodes away, which may be one that asks.
    pub(crate) const fn owe(&mut self, distance: u16, ask: bool) {
        if distance >= 1 && distance <= CANDIDATES {
            let bit = 1 << (distance - 1);
            self.hellos |= bit;
            if ask {
                self.asks |= bit;
            }
        }
    }

    const fn hello_all(&mut self) {
        self.hellos = 0x0F;
        self.asks = 0x0F;
    }

    /// The nearest candidate that is owed a hello: how many nodes away, and whether it is asked.
    pub(crate) fn take_hello(&mut self) -> Option<(u16, bool)> {
        let distance = (1..=CANDIDATES).find(|distance| self.hellos >> (distance - 1) & 1 == 1)?;
        let bit = 1 << (distance - 1);
        self.hellos &= !bit;
        let ask = self.asks & bit != 0;
        self.asks &= !bit;
        Some((distance, ask))
    }
}
