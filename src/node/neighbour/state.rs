//! One side of a relay: which node it takes for its neighbour there, and what it does about silence.
//!
//! | state | the node taken is lost | its hello does not name this relay | a hello comes from a node not taken that hears this relay | time passes |
//! | --- | --- | --- | --- | --- |
//! | `Linked` | `Searching` on a shared channel, else it goes on asking | `Pairing` | taken instead after `probe_after`, if it is better and its link is not held down | without a quorum for three times `dead_after`, and every four times from then on, `Searching` |
//! | `Pairing` | `Searching` | - | as above | after a span `Searching`; without a quorum as above |
//! | `Searching` | - | - | taken unless its link is held down, a farther one not before nearer ones could be heard; one that was given up for want of a quorum after `probe_after` | after a span `NoPeer` |
//! | `NoPeer` | - | - | taken unless its link is held down, if it takes this relay; else after `probe_after` | the four nearest nodes are sent a hello every `dead_after`, every half of `probe_after` once one was heard |
//!
//! A span is `dead_after` less `probe_after`, or as long as a run of lost frames may be by what the channel has shown. A node that has been
//! taken is paired with until its hello names this relay and hears it, or anything else comes from it: then it is `Linked`. A hello of the
//! linked one that names this relay but does not hear it ends nothing, since a run of lost frames is measured by silence.
//! A node that takes another one is not taken. *Better* is a nearer node that has somebody beyond it who hears it, and a farther one by which more
//! relays hang together, or all that the last view had beyond the node taken: then the link that is missing is on the other side of the node
//! taken, and it is left out. Where two links cross, as 1 - 3 and 2 - 4 do while 2 and 3 do not hear each other, neither of the two parts
//! could go on: of them that of the node nearest to Rx is given up, 4 takes 3, and 2 is left out.
//!
//! While it pairs or searches, it sends hellos that ask to the four nearest nodes there, the one taken among them: as many as three relays in
//! a row may be lost at once. Where a node is taken after `probe_after` it has to be heard all through that; of several the nearest one counts.
//! A link is held down after its third loss (`damping`): its node is not taken, and hellos do not report it as heard, until it
//! has been heard for `dead_after`, and twice as long after every further loss up to six times, so that a flapping link disturbs
//! the chain less and less. While the side has no neighbour, the loss of a candidate counts, too. If no candidate answers for `probe_after`,
//! all links of the side share the losses of the link that was lost last. Losses are forgotten 32 times `dead_after` after the last one.
//! To a neighbour that is lost, on wires, nothing but questions is sent until something comes from it. A node that has come back is a reason
//! for a new view `probe_after` later: the other one beside it may be about to take it, too.
//!
//! The side also holds what the nodes there say in their hellos, the nodes of the last view, and the heartbeats and hellos that are owed.

use super::damping::Damping;
use super::hearing::Hellos;
use super::hearing::{CANDIDATES, Hearing, InRow, ToldOf, mask};
use super::liveness::{Liveness, patience, tick};
use crate::node::context::Proposer;
use crate::node::timing::{first_pass, longest_lease};
use crate::settings::{Settings, Wiring};
use crate::time::{Duration, Instant, Jitter};
use crate::wire::digest::MissionId;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum NeighbourState {
    NoPeer,
    /// The other node has taken this one, too, as far as it has said.
    Linked,
    /// It has not, or not any more.
    Pairing {
        since: Instant,
    },
    Searching {
        since: Instant,
    },
}

/// One side.
#[derive(Clone, Debug)]
pub(crate) struct Neighbour {
    /// The node taken, 0 for none.
    pub(super) node: u16,
    pub(super) agreed: AgreedNodes,
    /// A node that has come back is not counted before: the other side may be about to take it, too.
    grace: Instant,
    state: NeighbourState,
    pub(super) liveness: Liveness,
    pub(super) damping: Damping,
    /// The node that was taken when the links were given up; 0 for none.
    given_up: u16,
    /// Start of the last search.
    searches_since: Instant,
    /// How far away the node taken is.
    pub(super) distance: u16,
    /// The nodes that have said that they hear this relay.
    pub(super) both_ways: Hearing,
    /// Whom the nodes on this side take here, the nearest first; 0 for none.
    pub(super) taken_by: [u16; CANDIDATES as usize],
    /// When a node that is not taken was heard last.
    near: Option<Instant>,
    /// The nodes heard since `since`, and in the span before: bit 0 is the nearest one.
    pub(super) hearing: Hearing,
    /// How often each of them said that it does not hear this relay.
    pub(super) unheard: InRow,
    /// Those that were told of as found since another one was linked, or lost: bit 0 is the nearest one.
    found: u8,
    /// Those of another mission.
    pub(super) strangers: ToldOf,
    /// How often a handshake under its number was signed with another key.
    #[cfg(feature = "auth")]
    pub(super) forged: InRow,
    /// How long after one question the next one is asked.
    tick: Duration,
    /// How long a sign of life is waited for until one is asked for.
    patience: Duration,
    jitter: Jitter,
    pub(super) signs: Signs,
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
    /// Number of the ground's hello that asks for the upload held here; 0 for none.
    #[cfg(feature = "upload")]
    pub(crate) ground_asks: u16,
    /// When to look for a sign of life again.
    look_at: Option<Instant>,
    pub(super) hellos: Hellos,
}

impl Neighbour {
    /// Before it has begun. All of it is zeros: nothing else could be made without a copy in flash.
    pub(super) const NONE: Self = Self {
        node: 0,
        agreed: AgreedNodes::on(0),
        grace: Instant::ZERO,
        state: NeighbourState::NoPeer,
        liveness: Liveness::NONE,
        damping: Damping::new(Instant::ZERO),
        given_up: 0,
        searches_since: Instant::ZERO,
        distance: 0,
        both_ways: Hearing::new(Instant::ZERO),
        taken_by: [0; CANDIDATES as usize],
        near: None,
        hearing: Hearing::new(Instant::ZERO),
        unheard: InRow::NONE,
        found: 0,
        strangers: ToldOf::NONE,
        #[cfg(feature = "auth")]
        forged: InRow::NONE,
        tick: Duration::from_micros(0),
        patience: Duration::from_micros(0),
        jitter: Jitter::NONE,
        signs: Signs::NONE,
        holds: None,
        #[cfg(feature = "upload")]
        asked: 0,
        #[cfg(feature = "upload")]
        offer: false,
        #[cfg(feature = "upload")]
        ground: false,
        #[cfg(feature = "upload")]
        ground_asks: 0,
        look_at: None,
        hellos: Hellos::NONE,
    };

    /// The side where `node` is taken to be, 0 for none, from now on.
    #[inline(never)] // a relay has two of them
    pub(super) fn begin(
        &mut self,
        node: u16,
        all: u16,
        seed: u32,
        now: Instant,
        settings: &Settings,
    ) {
        self.liveness = Liveness::new(now);
        self.damping.begin(now);
        self.both_ways = Hearing::new(now);
        self.hearing = Hearing::new(now);
        self.jitter = Jitter::new(seed);
        self.distance = 1;
        self.found = mask(1);
        self.grace = now;
        self.tick = tick(settings, all);
        self.patience = patience(settings, all);
        if node == 0 {
            return;
        }
        self.node = node;
        self.agreed = AgreedNodes::on(node);
        self.state = NeighbourState::Linked;
        // Where others may have closed up since, it makes itself known soon.
        let soon = Duration::from_micros(settings.probe_after.as_micros() / 4);
        let wait = match settings.wiring {
            // The first pass comes without being asked for.
            Wiring::Pair => self.patience.max(first_pass(settings, all)),
            Wiring::Shared => soon,
        };
        self.look_at = Some(now + wait);
    }

    /// The node taken, 0 for none.
    pub(crate) const fn node(&self) -> u16 {
        self.node
    }

    /// Whether nobody is there, and nobody is sought any more.
    pub(crate) fn has_no_peer(&self) -> bool {
        self.state == NeighbourState::NoPeer
    }

    /// Whether whoever is there has come back just now.
    pub(crate) fn has_grace(&self, now: Instant) -> bool {
        now < self.grace
    }

    /// Whether the node taken has been heard and is not lost.
    pub(crate) const fn is_there(&self) -> bool {
        self.liveness.is_there()
    }

    /// Whether the node taken is lost, and nothing has come from it since.
    pub(crate) const fn is_silent(&self) -> bool {
        self.liveness.is_silent()
    }

    /// The neighbour was there `at` that time or later; whether it had been lost until now.
    pub(crate) fn confirmed(&mut self, now: Instant, at: Instant) -> bool {
        let back = self.liveness.confirmed(at);
        if self.is_mutual() {
            let next = (self.liveness.heard() + self.patience).max(now + self.tick);
            // What answers something said long ago is no reason to ask sooner.
            let next = self.look_at.map_or(next, |at| at.max(next));
            // Another node than before is to be counted once its grace is over.
            let waits = self.node != self.agreed.counted() && now < self.grace;
            self.look_at = Some(if waits { next.min(self.grace) } else { next });
        }
        back
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
        if mutual {
            self.found &= mask(self.distance);
        }
        self.look_at = Some(now + wait);
        true
    }

    /// Whoever is taken just now is to be told of, unless it was and nobody has been linked or lost since.
    pub(crate) const fn tells_found(&mut self) -> bool {
        let told = self.found;
        self.found |= mask(self.distance);
        self.found != told
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
    /// whether others could be heard here. It is asked again after the
    /// time of `asking`, where that is another than usual.
    pub(crate) fn handle_timeout(
        &mut self,
        now: Instant,
        settings: &Settings,
        dead: Duration,
        searches: bool,
        asking: Option<Duration>,
    ) -> bool {
        let step = self.jitter.spread(asking.unwrap_or(self.tick));
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
                    let counts = self.liveness.is_clear();
                    self.damping.lose(self.distance, counts, now, settings);
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
                self.hellos.owe_all();
                if lost || is_over(since) {
                    self.search(now);
                }
            }
            NeighbourState::Searching { since } => {
                self.hellos.owe_all();
                if is_over(since) {
                    self.state = NeighbourState::NoPeer;
                }
            }
            NeighbourState::NoPeer => {
                self.hellos.owe_all();
                let often = Duration::from_micros((settings.probe_after.as_micros() / 2).max(1));
                let wait = if self.is_near(now, settings) {
                    often
                } else {
                    settings.dead_after
                };
                look_again = now + self.jitter.spread(wait);
            }
        }
        if lost {
            self.found = 0;
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

    /// Returns the start of the search while this side has no neighbour and asks all candidates.
    pub(super) const fn asks_all(&self) -> Option<Instant> {
        match self.state {
            NeighbourState::NoPeer | NeighbourState::Searching { .. } => Some(self.searches_since),
            NeighbourState::Linked | NeighbourState::Pairing { .. } => None,
        }
    }

    const fn search(&mut self, now: Instant) {
        self.node = 0;
        self.searches_since = now;
        self.state = NeighbourState::Searching { since: now };
        self.damping.clear();
        self.hellos.owe_all();
    }

    /// Whether `node` was taken when the links were given up, and nobody else has been since.
    const fn was_given_up(&self, node: u16) -> bool {
        node != 0 && self.given_up == node
    }

    /// Whoever is taken is taken no more, and sought like any other: the part that is linked so has no quorum.
    pub(crate) fn give_up(&mut self, now: Instant) {
        if matches!(
            self.state,
            NeighbourState::Linked | NeighbourState::Pairing { .. }
        ) {
            self.given_up = self.node;
            self.search(now);
            self.look_at = Some(now + self.tick);
        }
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
        let none = Duration::from_micros(0);
        let distance = candidate.distance;
        // A link that comes and goes has to stay for a while first.
        if self.damping.holds(distance, now, settings) {
            return false;
        }
        let takes = match self.state {
            NeighbourState::Searching { since } => {
                // One that is nearer may be about to be heard, or anybody else than the one that led nowhere.
                let wait = if self.was_given_up(node) {
                    settings.probe_after
                } else {
                    self.tick.times(u32::from(candidate.beyond()) * 2)
                };
                now.since(since) >= wait
            }
            NeighbourState::NoPeer => {
                candidate.pairs || self.damping.passes(distance, none, now, settings)
            }
            NeighbourState::Linked | NeighbourState::Pairing { .. } => {
                // Of two that could leave somebody out the one nearer to Rx does, unless it takes long.
                let waits = !candidate.nearer && candidate.downstream;
                let more = if waits {
                    settings.dead_after.times(2)
                } else {
                    none
                };
                candidate.is_better() && self.damping.passes(distance, more, now, settings)
            }
        };
        if !takes {
            return false;
        }
        if !matches!(self.state, NeighbourState::Searching { .. }) {
            self.grace = now + settings.probe_after;
        }
        self.signs = Signs::NONE;
        self.given_up = 0;
        self.node = node;
        self.distance = candidate.distance;
        self.state = NeighbourState::Pairing { since: now };
        let flaps = self.damping.is_slow(now, settings);
        let was_down = self.damping.was_down(self.distance);
        self.liveness.renew(now, was_down, flaps);
        self.damping.clear();
        self.look_at = Some(now + self.tick);
        true
    }
}

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
    pub(super) const fn beyond(self) -> u16 {
        self.distance.saturating_sub(2)
    }

    /// Whether it is to take the place of another one.
    pub(super) const fn is_better(self) -> bool {
        if self.nearer { self.ready } else { self.longer }
    }
}

impl Neighbour {
    /// Whether it is certain who is there, and somebody else than when a proposal was decided last.
    pub(crate) fn has_changed(&self, now: Instant) -> bool {
        let changed = self.node != self.agreed.counted();
        changed && (self.has_no_peer() || self.is_mutual() && !self.has_grace(now))
    }

    /// Whether it is who was there when the view was agreed on.
    pub(crate) const fn is_agreed(&self) -> bool {
        self.node == self.agreed.node()
    }

    /// A proposal has come from whoever is there, or begins here: then nobody is to be before this relay.
    pub(crate) const fn proposed_by(&mut self, proposer: Proposer) {
        self.agreed.proposed_by(proposer, self.node);
    }

    /// The proposal that came from this side was granted.
    pub(crate) const fn agree_with_proposer(&mut self) {
        self.agreed.agree_with_proposer();
    }

    /// Leaves the view: nobody is here in it.
    pub(crate) const fn leave(&mut self) {
        self.agreed.agree(0);
    }

    /// It was not granted: there is nothing to ask again until somebody else is there.
    pub(crate) const fn refuse(&mut self) {
        self.agreed.refuse(self.node);
    }

    /// The proposal that was granted goes on to whoever is there, or ends here.
    pub(crate) const fn agree(&mut self, ends: bool) {
        self.agreed.agree(if ends { 0 } else { self.node });
    }
}

/// The nodes on one side by what was decided on views, 0 for none.
#[derive(Clone, Copy, Debug)]
pub(super) struct AgreedNodes {
    /// The node that was there when the view was agreed on.
    in_view: u16,
    /// The node that was there when a proposal was decided last, granted or not.
    counted: u16,
    /// The node that the last proposal came from.
    proposer: u16,
}

impl AgreedNodes {
    pub(super) const fn on(node: u16) -> Self {
        Self {
            in_view: node,
            counted: node,
            proposer: node,
        }
    }

    /// The node that was there when the view was agreed on.
    pub(super) const fn node(self) -> u16 {
        self.in_view
    }

    /// The node that was there when a proposal was decided last, granted or not.
    pub(super) const fn counted(self) -> u16 {
        self.counted
    }

    /// A proposal has come from `node`, which is there, or begins here: then nobody is to be before this relay.
    pub(super) const fn proposed_by(&mut self, proposer: Proposer, node: u16) {
        self.proposer = match proposer {
            Proposer::Itself => 0,
            Proposer::Neighbour => node,
        };
    }

    /// The proposal that came from this side was granted.
    pub(super) const fn agree_with_proposer(&mut self) {
        self.agree(self.proposer);
    }

    /// A proposal was granted with `node` on this side.
    pub(super) const fn agree(&mut self, node: u16) {
        self.in_view = node;
        self.counted = node;
    }

    /// It was not granted: there is nothing to ask again until somebody else than `node` is there.
    pub(super) const fn refuse(&mut self, node: u16) {
        self.counted = node;
    }
}

/// What waits to be sent to the neighbour, apart from passes and what comes back of them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Signs {
    /// A question whether it is there.
    pub(super) ask: bool,
    /// The answer to its question of that number, 0 for none.
    pub(super) answer: u16,
}

impl Signs {
    pub(super) const NONE: Self = Self {
        ask: false,
        answer: 0,
    };
}

/// So many times in a row a node has to say that it does not hear this relay: an answer or two may be lost.
const UNHEARD: u8 = 8;

/// Handshakes in a row under a node's number that are signed with another key.
#[cfg(feature = "auth")]
const FORGED: u8 = 3;

impl Neighbour {
    /// Returns true if the node `distance` places away and this relay hear each other, and the link is not held down.
    pub(crate) fn is_two_way(&self, distance: u16, now: Instant, settings: &Settings) -> bool {
        let held = self.damping.held(now, settings);
        let known = mask(distance) & self.both_ways.recent(now, settings) & !held != 0;
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

    /// An intact frame from the node `distance` nodes away, which is the one `taken` or not.
    pub(crate) fn heard(&mut self, distance: u16, taken: bool, now: Instant, settings: &Settings) {
        self.hearing.add(distance, now, settings);
        self.damping.hear(distance, self.asks_all(), now, settings);
        if taken {
            self.liveness.met();
        }
    }

    /// The nodes that were heard lately, without one whose link is held down: bit 0 is the nearest one.
    pub(crate) fn hears(&self, now: Instant, settings: &Settings) -> u8 {
        let held = self.damping.held(now, settings);
        self.hearing.recent(now, settings) & !held
    }

    /// The node `distance` nodes away has said whether it hears this relay; whether it does not, for the last of so many times in a row.
    pub(crate) fn says_it_hears(&mut self, distance: u16, heard: bool) -> bool {
        self.unheard.count(distance, !heard, UNHEARD)
    }

    /// The node `distance` nodes away is of another mission; whether that is to be told.
    pub(crate) fn is_stranger(&mut self, distance: u16, now: Instant) -> bool {
        self.strangers.tell(distance, now)
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
}

impl Neighbour {
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
        self.hellos.owe(distance, ask);
    }

    /// The nearest candidate that is owed a hello: how many nodes away, and whether it is asked.
    pub(crate) fn take_hello(&mut self) -> Option<(u16, bool)> {
        self.hellos.take()
    }
}
