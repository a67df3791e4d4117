//! Selection of the neighbour on one side of a relay, and reaction to its silence.
//!
//! | state | neighbour lost | hello of the neighbour does not name this relay | hello received from another node that receives this relay | timer |
//! | --- | --- | --- | --- | --- |
//! | `Linked` | shared channel: `Searching`; otherwise continue to send heartbeat requests | `Pairing` | selected instead after `probe_after`, if it is better and its link is not held down | without a quorum for three times `dead_after`, and every four times from then on: `Searching` |
//! | `Pairing` | `Searching` | - | as above | after the wait below: `Searching`; without a quorum as above |
//! | `Searching` | - | - | selected unless its link is held down; a farther one not before nearer ones could be received; one whose link was dropped without a quorum after `probe_after` | after the wait below: `NoPeer` |
//! | `NoPeer` | - | - | selected unless its link is held down: at once if it has selected this relay, else after `probe_after` | hello to the four nearest nodes every `dead_after`, every half of `probe_after` once one was received |
//!
//! The wait is `dead_after` less `probe_after`, or the longest plausible run of lost frames on this channel if that is
//! longer. A selected neighbour is `Pairing` until its hello names this relay and reports reception of this relay, or
//! until any other message of it arrives. Then it is `Linked`. A hello of the linked node that names this relay, but
//! does not report reception of this relay, changes nothing, because a run of lost frames is measured by silence. A
//! node that has selected a different node is not selected.
//!
//! *Better* is a nearer node that the node beyond it receives. A farther node is better in two cases. Either more
//! relays follow it than follow the neighbour. Or as many follow it as followed the neighbour in the last view. In the
//! second case the neighbour has no link on its other side, and the chain continues without it.
//!
//! A neighbour that is ordered to leave is replaced at once by the node beyond it. A node that was the neighbour before
//! the present one is selected again without a waiting time.
//!
//! Two links can cross, such as 1 - 3 and 2 - 4 while 2 and 3 do not receive each other. Neither part of the chain
//! could then continue. So the link of the node nearest to Rx is given up: 4 selects 3, and 2 is left out.
//!
//! In `Pairing` and `Searching` the side sends hellos that request an answer to the four nearest nodes, including the
//! selected one. The reason is that up to three relays in a row may be lost at once. A node that is selected after
//! `probe_after` must be received without a gap for that time. Of several nodes the nearest one counts. Links that were
//! lost repeatedly are held down (see [`damping`](super::damping)). On wires, only heartbeat requests are sent to a lost
//! neighbour until it answers.
//!
//! A node that returns causes a request for a new view `probe_after` later. The node on its other side may be about to
//! select it, too. During this grace period, proposals from the returned node that would leave relays out are dropped,
//! and retransmitted later.

use super::damping::Damping;
use super::hearing::Hellos;
use super::hearing::{CANDIDATES, ConsecutiveCounts, Hearing, Refusals, mask};
use super::liveness::{Liveness, patience, tick};
use crate::node::context::Proposer;
use crate::node::context::{first_pass, longest_lease};
use crate::settings::{Settings, Wiring};
use crate::time::{Duration, Instant, Jitter};
use crate::wire::digest::MissionId;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum NeighbourState {
    NoPeer,
    /// Mutual selection: by the node's last report, this relay and the node have selected each other.
    Linked,
    /// One-sided selection: this relay has selected the node, which has not, or no longer, selected it.
    Pairing {
        since: Instant,
    },
    Searching {
        since: Instant,
    },
}

/// Neighbour on one side of this relay: its selection, its liveness and the search for it.
#[derive(Clone, Debug)]
pub(crate) struct Neighbour {
    /// Node number of the selected neighbour; 0 if there is none.
    pub(super) node: u16,
    pub(super) agreed: AgreedNodes,
    /// End of the grace period after the selection of a neighbour. In it this relay requests no new view, because the
    /// relay on the neighbour's other side may select the neighbour, too: one view change is enough for both.
    grace: Instant,
    state: NeighbourState,
    pub(super) liveness: Liveness,
    pub(super) damping: Damping,
    /// Node whose link was dropped because there was no quorum; 0 once a different node has been selected.
    dropped: u16,
    /// Previous neighbour, which was replaced by a nearer node; 0 for none.
    replaced: u16,
    /// Time at which the last search for a neighbour began.
    searches_since: Instant,
    /// Distance to the selected neighbour, in relays along the chain: 1 for the next node number.
    pub(super) distance: u16,
    /// Nodes on this side of the relay that have recently reported that they receive this relay.
    pub(super) two_way: Hearing,
    /// Neighbours that the four nearest nodes on this side have selected toward this relay; 0 for none. The entry of
    /// the nearest node is the first.
    pub(super) selection: [u16; CANDIDATES as usize],
    /// Time of the last frame on this side of the relay from a node that is not the neighbour. `None` if there was
    /// none.
    unselected_at: Option<Instant>,
    /// Nodes on this side of the relay that it has recently received.
    pub(super) hearing: Hearing,
    /// Number of consecutive hellos of each node that do not report reception of this relay.
    pub(super) not_received: ConsecutiveCounts,
    /// Bit mask of the nodes reported as found since a neighbour was last linked or lost. Bit 0 is the nearest node.
    reported_found: u8,
    /// Nodes on this side of the relay whose mission, epoch or key it has recently refused.
    pub(crate) refusals: Refusals,
    /// Number of consecutive handshakes with a wrong key, for each node on this side of the relay.
    pub(super) forged: ConsecutiveCounts,
    /// Interval between heartbeat requests to a silent neighbour.
    tick: Duration,
    /// Silence of the neighbour after which a heartbeat is requested.
    patience: Duration,
    jitter: Jitter,
    pub(super) heartbeat: PendingHeartbeat,
    /// Newest mission that the neighbour has reported as stored; `None` before its first report.
    pub(crate) latest_mission: Option<MissionId>,
    /// Time of the next check of the neighbour's silence, or of the next hellos of the search. `None` if neither is
    /// needed.
    check_at: Option<Instant>,
    pub(super) hellos: Hellos,
}

impl Neighbour {
    /// State before the relay starts. All values are zero, so that no copy is kept in flash.
    pub(super) const NONE: Self = Self {
        node: 0,
        agreed: AgreedNodes::on(0),
        grace: Instant::ZERO,
        state: NeighbourState::NoPeer,
        liveness: Liveness::NONE,
        damping: Damping::new(Instant::ZERO),
        dropped: 0,
        replaced: 0,
        searches_since: Instant::ZERO,
        distance: 0,
        two_way: Hearing::new(Instant::ZERO),
        selection: [0; CANDIDATES as usize],
        unselected_at: None,
        hearing: Hearing::new(Instant::ZERO),
        not_received: ConsecutiveCounts::NONE,
        reported_found: 0,
        refusals: Refusals::NONE,
        forged: ConsecutiveCounts::NONE,
        tick: Duration::from_micros(0),
        patience: Duration::from_micros(0),
        jitter: Jitter::NONE,
        heartbeat: PendingHeartbeat::NONE,
        latest_mission: None,
        check_at: None,
        hellos: Hellos::NONE,
    };

    /// Starts this side of the relay at `now`. `node` is the neighbour configured in the mission; 0 for none.
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
        self.two_way = Hearing::new(now);
        self.hearing = Hearing::new(now);
        self.jitter = Jitter::new(seed);
        self.distance = 1;
        self.reported_found = mask(1);
        self.grace = now;
        self.tick = tick(settings, all);
        self.patience = patience(settings, all);
        if node == 0 {
            return;
        }
        self.node = node;
        self.agreed = AgreedNodes::on(node);
        self.state = NeighbourState::Linked;
        // During this relay's absence other relays may have closed the gap that it left, so it announces itself soon.
        let soon = Duration::from_micros(settings.probe_after.as_micros() / 4);
        let wait = match settings.wiring {
            // The first message along the chain arrives without a request.
            Wiring::Pair => self.patience.max(first_pass(settings, all)),
            Wiring::Shared => soon,
        };
        self.check_at = Some(now + wait);
    }

    pub(crate) const fn node(&self) -> u16 {
        self.node
    }

    /// Returns true if this side of the relay has no neighbour and no longer searches for one.
    pub(crate) fn has_no_peer(&self) -> bool {
        self.state == NeighbourState::NoPeer
    }

    /// Returns true for a short time after a neighbour was selected. During this time no new view is requested.
    pub(crate) fn has_grace(&self, now: Instant) -> bool {
        now < self.grace
    }

    /// Returns true if the selected neighbour has been received and is not lost.
    pub(crate) const fn is_present(&self) -> bool {
        self.liveness.is_present()
    }

    /// Returns true if the selected neighbour is lost and has not been received since.
    pub(crate) const fn is_silent(&self) -> bool {
        self.liveness.is_silent()
    }

    /// Records that the neighbour was alive at time `at`. Returns true if the neighbour counted as lost before.
    pub(crate) fn record_sign_of_life(&mut self, now: Instant, at: Instant) -> bool {
        let back = self.liveness.record_sign_of_life(at);
        if self.is_mutual() {
            let next = (self.liveness.last_sign_of_life() + self.patience).max(now + self.tick);
            // An answer to an old message must not make the next check earlier.
            let next = self.check_at.map_or(next, |at| at.max(next));
            // A new neighbour triggers a view request at the end of its grace period.
            let waits = self.node != self.agreed.counted() && now < self.grace;
            self.check_at = Some(if waits { next.min(self.grace) } else { next });
        }
        back
    }

    /// Returns true if this relay and its neighbour have selected each other. The selection of the neighbour is that in
    /// its last report.
    pub(crate) fn is_mutual(&self) -> bool {
        self.state == NeighbourState::Linked
    }

    /// Records whether the neighbour has selected this relay (`mutual`). Returns true if the selection has changed.
    pub(crate) fn set_mutual(&mut self, mutual: bool, now: Instant) -> bool {
        let (next, wait) = match (self.state, mutual) {
            (NeighbourState::Pairing { .. }, true) => (NeighbourState::Linked, self.patience),
            (NeighbourState::Linked, false) => (NeighbourState::Pairing { since: now }, self.tick),
            _ => return false,
        };
        self.state = next;
        if mutual {
            self.reported_found &= mask(self.distance);
        }
        self.check_at = Some(now + wait);
        true
    }

    /// Returns true if the neighbour must be reported as found now, and marks it as reported.
    pub(crate) const fn should_report_found(&mut self) -> bool {
        let before = self.reported_found;
        self.reported_found |= mask(self.distance);
        self.reported_found != before
    }

    /// Restarts the measurement of the neighbour's silence at `now`, after this relay's computation.
    ///
    /// Relays send nothing while they compute. Returns false, and does nothing, unless the neighbour is linked, not
    /// lost, and a member of the view.
    pub(crate) fn excuse_silence(&mut self, now: Instant, settings: &Settings) -> bool {
        let excused = self.state == NeighbourState::Linked
            && self.is_agreed()
            && self.liveness.excuse_silence(now);
        if excused {
            self.check_at = Some(now + settings.probe_after);
        }
        excused
    }

    /// Returns true if a check of the neighbour's silence or the next hellos of the search are due.
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        self.check_at.is_some_and(|at| at <= now)
    }

    pub(crate) const fn next_timeout(&self) -> Option<Instant> {
        self.check_at
    }

    /// Handles the timer of this side. Returns true if this call has found the neighbour to be lost.
    ///
    /// A neighbour is not lost before a silence of `dead`. If `can_search` is true, as on a shared channel, a different
    /// node can be selected in place of a lost neighbour. `interval` is the time between heartbeat requests; `None` for
    /// the usual time.
    pub(crate) fn handle_timeout(
        &mut self,
        now: Instant,
        settings: &Settings,
        dead: Duration,
        can_search: bool,
        interval: Option<Duration>,
    ) -> bool {
        let step = self.jitter.spread(interval.unwrap_or(self.tick));
        let span = settings
            .dead_after
            .as_micros()
            .saturating_sub(settings.probe_after.as_micros());
        let run = self
            .liveness
            .longest_gap(self.tick)
            .min(longest_lease(settings));
        let span = run.max(Duration::from_micros(span));
        let is_over = |since: Instant| now.since(since) >= span;
        let mut lost = false;
        let mut next_check = now + step;
        match self.state {
            NeighbourState::Linked => {
                let silence = self.liveness.review_silence(now, dead, step, settings);
                lost = silence.lost;
                self.heartbeat.request = true;
                if lost && can_search {
                    let counts = self.liveness.loses_few_frames();
                    self.damping
                        .record_loss(self.distance, counts, now, settings);
                    self.search(now);
                } else {
                    next_check = silence.next_check;
                }
            }
            NeighbourState::Pairing { since } => {
                lost = self
                    .liveness
                    .review_silence(now, settings.dead_after, step, settings)
                    .lost;
                self.hellos.schedule_all();
                if lost || is_over(since) {
                    self.search(now);
                }
            }
            NeighbourState::Searching { since } => {
                self.hellos.schedule_all();
                if is_over(since) {
                    self.state = NeighbourState::NoPeer;
                }
            }
            NeighbourState::NoPeer => {
                self.hellos.schedule_all();
                let often = Duration::from_micros((settings.probe_after.as_micros() / 2).max(1));
                let wait = if self.has_recent_unselected(now, settings) {
                    often
                } else {
                    settings.dead_after
                };
                next_check = now + self.jitter.spread(wait);
            }
        }
        if lost {
            self.reported_found = 0;
        }
        self.check_at = Some(next_check);
        lost
    }

    /// Returns the silence of a node after which the link to it counts as lost.
    ///
    /// The usual result is `dead_after`. A side that receives no node sends hellos only every `dead_after`, and a few
    /// lost frames then cause a silence several times as long. For such a side the result is the maximum duration of a
    /// lease.
    fn longest_gap(&self, now: Instant, settings: &Settings) -> Duration {
        if self.has_no_peer() && !self.has_recent_unselected(now, settings) {
            longest_lease(settings)
        } else {
            settings.dead_after
        }
    }

    fn has_recent_unselected(&self, now: Instant, settings: &Settings) -> bool {
        self.unselected_at
            .is_some_and(|near| now.since(near) <= settings.dead_after)
    }

    /// Records a frame of a node that is not selected. A side without a neighbour then sends its next hellos soon.
    pub(crate) fn record_unselected(&mut self, now: Instant, settings: &Settings) {
        if self.has_no_peer() && !self.has_recent_unselected(now, settings) {
            self.check_at = Some(now + self.tick);
        }
        self.unselected_at = Some(now);
    }

    /// Returns the start of the search while this side of the relay has no neighbour; otherwise `None`.
    pub(super) const fn searching_since(&self) -> Option<Instant> {
        match self.state {
            NeighbourState::NoPeer | NeighbourState::Searching { .. } => Some(self.searches_since),
            NeighbourState::Linked | NeighbourState::Pairing { .. } => None,
        }
    }

    /// Gives up the selected neighbour. If `ends` is true, no search follows, because the chain ends at this relay, or
    /// this relay leaves the chain.
    pub(crate) fn give_up(&mut self, now: Instant, ends: bool) {
        self.search(now);
        self.heartbeat = PendingHeartbeat::NONE;
        self.check_at = Some(now + self.tick);
        if ends {
            self.state = NeighbourState::NoPeer;
        }
    }

    /// Forgets earlier losses of links. A relay outside of the chain exchanges few frames with the nodes beside it, so its
    /// gaps in the reception are no losses.
    pub(crate) fn forget_losses(&mut self, now: Instant) {
        self.damping.begin(now);
    }

    /// Schedules hellos that request an answer, to the four nearest nodes on this side of the relay.
    pub(crate) const fn schedule_hellos(&mut self) {
        self.hellos.schedule_all();
    }

    const fn search(&mut self, now: Instant) {
        self.node = 0;
        self.searches_since = now;
        self.state = NeighbourState::Searching { since: now };
        self.damping.clear();
        self.hellos.schedule_all();
    }

    /// Returns true if `node` was the neighbour whose link was dropped last for lack of a quorum.
    ///
    /// False once any node has been selected.
    const fn was_dropped(&self, node: u16) -> bool {
        node != 0 && self.dropped == node
    }

    /// Drops the selected neighbour and starts a search, because too few relays for a quorum are reachable.
    pub(crate) fn drop_link(&mut self, now: Instant) {
        if matches!(
            self.state,
            NeighbourState::Linked | NeighbourState::Pairing { .. }
        ) {
            self.dropped = self.node;
            self.search(now);
            self.check_at = Some(now + self.tick);
        }
    }

    /// Selects `candidate` if this side of the relay has no neighbour, or if the candidate is better. A candidate is
    /// better if it is nearer, or if more relays can be reached through it. Returns true if the candidate was selected.
    ///
    /// The candidate has sent a hello, receives this relay, and has selected this relay, no node, or a node farther
    /// away.
    pub(crate) fn consider_candidate(
        &mut self,
        candidate: Candidate,
        now: Instant,
        settings: &Settings,
    ) -> bool {
        let node = candidate.node;
        let none = Duration::from_micros(0);
        let distance = candidate.distance;
        // A flapping link must first have been up for a while.
        if self.damping.is_held_down(distance, now, settings) {
            return false;
        }
        let is_selected = match self.state {
            NeighbourState::Searching { since } => {
                // A nearer node may be received soon, or a node other than the one whose link was dropped.
                let wait = if self.was_dropped(node) {
                    settings.probe_after
                } else {
                    self.tick.times(u32::from(candidate.beyond()) * 2)
                };
                now.since(since) >= wait
            }
            NeighbourState::NoPeer => {
                candidate.pairs || self.damping.has_waited(distance, none, now, settings)
            }
            NeighbourState::Linked | NeighbourState::Pairing { .. } => {
                // If two relays could each leave out a node, only the relay nearer to Rx does, unless that takes long.
                let waits = !candidate.nearer && candidate.downstream;
                let more = if waits {
                    settings.dead_after.times(2)
                } else {
                    none
                };
                let is_known = node == self.replaced && !candidate.nearer && !waits;
                candidate.passes
                    || candidate.is_better()
                        && (is_known || self.damping.has_waited(distance, more, now, settings))
            }
        };
        if !is_selected {
            return false;
        }
        if !matches!(self.state, NeighbourState::Searching { .. }) && !candidate.passes {
            self.grace = now + settings.probe_after;
        }
        self.heartbeat = PendingHeartbeat::NONE;
        self.dropped = 0;
        self.replaced = if candidate.nearer { self.node } else { 0 };
        self.node = node;
        self.distance = candidate.distance;
        self.state = NeighbourState::Pairing { since: now };
        let flaps = self.damping.has_slow_flapping(now, settings);
        let was_down = self.damping.was_down(self.distance);
        self.liveness.renew(now, was_down, flaps);
        self.damping.clear();
        self.check_at = Some(now + self.tick);
        true
    }
}

/// Candidate for the neighbour on one side: an unselected node that receives this relay.
#[expect(
    clippy::struct_excessive_bools,
    reason = "five things that its hello says"
)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) node: u16,
    /// Distance of the candidate, in relays; 1 for the next node number.
    pub(crate) distance: u16,
    /// True for a candidate toward Rx, false for one toward Tx.
    pub(crate) downstream: bool,
    /// True if the candidate has selected this relay as its neighbour.
    pub(crate) pairs: bool,
    /// True if the candidate is nearer to this relay than the selected neighbour.
    pub(crate) nearer: bool,
    /// True if the candidate reports that it fits between this relay and the selected neighbour.
    pub(crate) ready: bool,
    /// True if more relays can be reached through the candidate than through the selected neighbour.
    pub(crate) longer: bool,
    /// True if the candidate replaces the selected neighbour, which is ordered to leave the chain. The candidate is the
    /// node on that neighbour's far side.
    pub(crate) passes: bool,
}

impl Candidate {
    /// Returns the number of nodes between this relay and the candidate, without the nearest of them.
    ///
    /// The nearest of them is lost. Each of the others could still answer, and so delays the selection of the
    /// candidate.
    pub(super) const fn beyond(self) -> u16 {
        self.distance.saturating_sub(2)
    }

    /// Returns true if the candidate should replace the selected neighbour. A nearer candidate must be `ready`. Through
    /// a farther candidate more relays must be reachable.
    pub(super) const fn is_better(self) -> bool {
        if self.nearer { self.ready } else { self.longer }
    }
}

impl Neighbour {
    /// Returns true if the neighbour has changed since the last decision on a view. The change counts only once the new
    /// neighbour is linked, or once the search has ended without success.
    pub(crate) fn has_changed(&self, now: Instant) -> bool {
        let changed = self.node != self.agreed.counted();
        changed && (self.has_no_peer() || self.is_mutual() && !self.has_grace(now))
    }

    /// Returns true if the selected neighbour is also the neighbour in the agreed view.
    pub(crate) const fn is_agreed(&self) -> bool {
        self.node == self.agreed.node()
    }

    /// Records the origin of a view proposal: the neighbour on this side, or this relay itself. A relay makes proposals
    /// only if it has no neighbour toward the leader.
    pub(crate) const fn proposed_by(&mut self, proposer: Proposer) {
        self.agreed.proposed_by(proposer, self.node);
    }

    /// Records that a view proposal was granted. Its sender becomes the neighbour in the view, on this side of the
    /// relay.
    pub(crate) const fn agree_with_proposer(&mut self) {
        self.agreed.agree_with_proposer();
    }

    /// Leaves the view: this side of the relay has no neighbour in an agreed view any more.
    pub(crate) const fn leave(&mut self) {
        self.agreed.agree(0);
    }

    /// Records that a view proposal was refused. This side of the relay requests no new view until its neighbour
    /// changes.
    pub(crate) const fn refuse(&mut self) {
        self.agreed.refuse(self.node);
    }

    /// Records that a view proposal was granted, on the side toward the last relay. If `ends` is true, this relay is
    /// the last one of the view, so that it has no neighbour on this side.
    pub(crate) const fn agree(&mut self, ends: bool) {
        self.agreed.agree(if ends { 0 } else { self.node });
    }
}

/// Node numbers of the neighbour on one side of the relay at the latest decisions on views; 0 for none.
#[derive(Clone, Copy, Debug)]
pub(super) struct AgreedNodes {
    /// Neighbour in the agreed view.
    in_view: u16,
    /// Neighbour at the last decision on a view, granted or refused.
    counted: u16,
    /// Node that sent the last view proposal; 0 if this relay made the proposal itself.
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

    pub(super) const fn node(self) -> u16 {
        self.in_view
    }

    pub(super) const fn counted(self) -> u16 {
        self.counted
    }

    pub(super) const fn proposed_by(&mut self, proposer: Proposer, node: u16) {
        self.proposer = match proposer {
            Proposer::Itself => 0,
            Proposer::Neighbour => node,
        };
    }

    /// Records that a view proposal was granted. Its sender is the neighbour in the view, on this side of the relay.
    pub(super) const fn agree_with_proposer(&mut self) {
        self.agree(self.proposer);
    }

    /// Records that a view proposal was granted with `node` as the neighbour on this side of the relay.
    pub(super) const fn agree(&mut self, node: u16) {
        self.in_view = node;
        self.counted = node;
    }

    pub(super) const fn refuse(&mut self, node: u16) {
        self.counted = node;
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PendingHeartbeat {
    /// True if a heartbeat request to the neighbour is pending.
    pub(super) request: bool,
    /// Number of the neighbour's heartbeat request to answer; 0 for none.
    pub(super) reply: u16,
}

impl PendingHeartbeat {
    pub(super) const NONE: Self = Self {
        request: false,
        reply: 0,
    };
}

/// Number of consecutive hellos after which their sender is reported as not receiving this relay.
///
/// A smaller number can result from lost frames.
const NOT_RECEIVED: u8 = 8;

/// Number of consecutive handshakes with a wrong key after which their sender is reported.
const FORGED: u8 = 3;

impl Neighbour {
    /// Returns true if this relay and the node `distance` relays away receive each other. A link that was lost
    /// repeatedly, and is therefore not used for a while (held down), does not count.
    pub(crate) fn is_two_way(&self, distance: u16, now: Instant, settings: &Settings) -> bool {
        let held = self.damping.held_down_nodes(now, settings);
        let is_in = |nodes: u8| mask(distance) & nodes != 0;
        // A linked neighbour that is silent may be about to be lost.
        let is_linked = self.is_mutual() && self.distance == distance;
        is_in(self.two_way.recent(now, settings) & !held)
            || is_linked && self.liveness.is_present() && is_in(self.hearing.recent(now, settings))
    }

    /// Returns true if the neighbour on this side is linked, not lost, and nearer than `distance` relays.
    pub(crate) fn links_within(&self, distance: u16) -> bool {
        self.is_mutual() && self.liveness.is_present() && self.distance < distance
    }

    /// Returns true if the neighbour on this side is linked, not lost, and over `distance` relays away.
    pub(crate) fn has_link_beyond(&self, distance: u16) -> bool {
        self.is_mutual() && self.liveness.is_present() && self.distance > distance
    }

    /// Records a hello of the node `distance` relays away.
    ///
    /// `neighbour` is the node that the sender has selected on its side toward this relay. `hears` is true if the
    /// sender receives this relay.
    pub(crate) fn record_hello(
        &mut self,
        distance: u16,
        neighbour: u16,
        hears: bool,
        now: Instant,
        settings: &Settings,
    ) {
        if let Some(taken) = self
            .selection
            .get_mut(usize::from(distance).wrapping_sub(1))
        {
            *taken = neighbour;
        }
        if hears {
            self.two_way.add(distance, now, settings);
        }
    }

    /// Returns the neighbour that the node `distance` relays away has selected toward this relay. 0 for none.
    pub(crate) fn selected_by(&self, distance: u16) -> u16 {
        let known = self.selection.get(usize::from(distance).wrapping_sub(1));
        known.copied().unwrap_or(0)
    }

    /// Records an intact frame of the node `distance` relays away. `taken` is true if this node is the selected
    /// neighbour.
    pub(crate) fn record_frame(
        &mut self,
        distance: u16,
        taken: bool,
        now: Instant,
        settings: &Settings,
    ) {
        self.hearing.add(distance, now, settings);
        let (asks, gap) = (self.searching_since(), self.longest_gap(now, settings));
        self.damping
            .record_hello(distance, asks, gap, now, settings);
        if taken {
            self.liveness.record_frame();
        }
    }

    /// Returns a bit mask of the recently received nodes; bit 0 is the nearest node. Nodes with flapping links that are
    /// held down are left out.
    pub(crate) fn received_nodes(&self, now: Instant, settings: &Settings) -> u8 {
        let held = self.damping.held_down_nodes(now, settings);
        self.hearing.recent(now, settings) & !held
    }

    /// Records whether the node `distance` relays away receives this relay (`received`). Returns true once, after
    /// [`NOT_RECEIVED`] reports in a row that it does not.
    pub(crate) fn record_reception(&mut self, distance: u16, received: bool) -> bool {
        self.not_received.count(distance, !received, NOT_RECEIVED)
    }

    /// Counts a handshake with a wrong key from the node `distance` relays away. Returns true from the third ([`FORGED`])
    /// such handshake in a row on.
    pub(crate) fn count_forged(&mut self, distance: u16) -> bool {
        self.forged.count(distance, true, FORGED);
        self.forged.has(distance, FORGED)
    }

    /// Resets the refusals for key and epoch of the node `distance` relays away: both are right now.
    pub(crate) fn on_key_match(&mut self, distance: u16) {
        self.forged.count(distance, false, FORGED);
        self.refusals.remove_signer(distance);
    }
}

impl Neighbour {
    /// Records the number of the neighbour's heartbeat request; 0 for none. The next heartbeat answers this request.
    pub(crate) const fn record_request(&mut self, number: u16) {
        if number != 0 {
            self.heartbeat.reply = number;
        }
    }

    /// Returns the time at which the heartbeat request `number` was sent. Called when its reply arrives. `None` if the
    /// request is not among the last few.
    pub(crate) fn record_reply(&self, number: u16) -> Option<Instant> {
        self.liveness.requested_at(number)
    }

    /// Returns the pending heartbeat; `None` if none is pending.
    ///
    /// The values are: destination node, number of this relay's own request, and number of the neighbour's request to
    /// which the heartbeat replies. A number 0 means none.
    pub(crate) fn poll_heartbeat(&mut self, now: Instant) -> Option<(u16, u16, u16)> {
        let PendingHeartbeat { request, reply } = core::mem::take(&mut self.heartbeat);
        if !(request || reply != 0) || self.node == 0 {
            return None;
        }
        let number = if request {
            self.liveness.next_request(now)
        } else {
            0
        };
        Some((self.node, number, reply))
    }

    /// Schedules a hello to the node `distance` relays away. If `ask` is true, the hello requests an answer.
    pub(crate) const fn schedule_hello(&mut self, distance: u16, ask: bool) {
        self.hellos.schedule(distance, ask);
    }

    /// Returns the distance of the nearest node with a pending hello, and marks the hello as sent. The distance is in
    /// relays. The second value is true if the hello requests an answer. `None` if no hello is pending.
    pub(crate) fn poll_hello(&mut self) -> Option<(u16, bool)> {
        self.hellos.poll()
    }
}
