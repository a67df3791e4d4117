//! Damping of flapping links: how long a node must be received before it is selected.
//!
//! Each side counts how often it has lost the links to its four nearest nodes. Lost frames alone are no loss of the
//! link. A link with more than two losses is held down: its node is neither selected nor reported as received until it
//! has been received without a gap for `dead_after`. Every further loss doubles this time, up to six times
//! `dead_after`. Hellos omit links that are held down, so that no other relay makes room for a node that could not be
//! linked.
//!
//! A gap is a silence of more than `dead_after`. While the side has no neighbour and receives no node, a gap is a
//! silence of more than eight times `dead_after`. Such a side sends requests only every `dead_after`, so a few lost
//! frames make a silence of several times that.
//!
//! | state of the side | event | losses |
//! | --- | --- | --- |
//! | linked | neighbour lost, few frames lost on the channel | one more for its link |
//! | linked | neighbour lost, many frames lost on the channel | unchanged, unless the link is held down or its node is then silent for longer than `dead_after` |
//! | without a neighbour | candidate heard again after a gap | one more for its link |
//! | without a neighbour | first answer of any candidate, `probe_after` after the search began or later | all links: at least those of the link that was lost last |
//!
//! The last row is a partition: all links of the side were down together. Suppose that each link were counted alone.
//! The chain would then link the second nearest node once the nearest one is held down, and every link would be
//! forgiven two losses. A side forgets the losses of a link 32 times `dead_after` after the last one.

use super::hearing::{CANDIDATES, mask};
use crate::settings::Settings;
use crate::time::{Duration, Instant};

/// Maximum number of doublings of the hold-down of a flapping link. A link flaps if it is lost repeatedly.
const MAX_DOUBLINGS: u8 = 3;

/// Maximum time for which a flapping link is not used (hold-down), in units of `dead_after`.
const MAX_HOLD_DOWN: u32 = 6;

/// Maximum number of recent losses of a link before it counts as flapping.
const MAX_FORGIVEN: u8 = 2;

/// Minimum time between two losses of a slowly flapping link, in units of `dead_after`.
const SLOW_INTERVAL: u32 = 10;

/// Time without a loss of a link after which older losses are forgotten, in units of `dead_after`.
const MEMORY: u32 = 32;

/// Reception of one node without long gaps: its distance, and the times of its first and last frame.
#[derive(Clone, Copy, Debug)]
struct Heard {
    distance: u16,
    since: Instant,
    last: Instant,
}

impl Heard {
    /// Returns the reception record of the node at `distance` after a frame from this node at `now`. The record begins
    /// anew if the node was silent for longer than `gap`, or if `known` is the record of a different node.
    fn updated(known: Option<Self>, distance: u16, now: Instant, gap: Duration) -> Self {
        let since = match known {
            Some(known) if known.distance == distance && now.since(known.last) <= gap => {
                known.since
            }
            _ => now,
        };
        Self {
            distance,
            since,
            last: now,
        }
    }
}

/// Losses of the link to one node. After several losses the link is not used for a while.
#[derive(Clone, Copy, Debug)]
struct Link {
    /// Time of the last loss of the link.
    lost_at: Instant,
    /// Reception of the node since the last loss of the link; `None` if no frame has arrived since.
    back: Option<Heard>,
    losses: u8,
    /// True if `losses` does not include the last loss, because the channel lost many frames. The loss is included if
    /// the node turns out to have been silent for longer than `dead_after`.
    excused: bool,
    /// True if the node was silent for longer than `dead_after` after the last loss.
    was_down: bool,
    /// Time between the last two losses of the link; 0 if `losses` was 0 before the last one.
    interval: Duration,
}

impl Link {
    const fn new(now: Instant) -> Self {
        Self {
            lost_at: now,
            back: None,
            losses: 0,
            excused: false,
            was_down: false,
            interval: Duration::from_micros(0),
        }
    }

    /// Returns the number of recent losses of the link; 0 if the last loss was long ago.
    #[inline(never)] // called from many places
    fn recent(&self, now: Instant, settings: &Settings) -> u8 {
        if now.since(self.lost_at) >= settings.dead_after.times(MEMORY) {
            0
        } else {
            self.losses
        }
    }

    /// Returns true during the hold-down: the link was lost repeatedly and must not be used. The hold-down ends once
    /// the node has been received for long enough without a long silence.
    fn is_held_down(&self, now: Instant, settings: &Settings) -> bool {
        let Some(more) = self.losses.checked_sub(MAX_FORGIVEN + 1) else {
            return false;
        };
        let times = (1 << more.min(MAX_DOUBLINGS)).min(MAX_HOLD_DOWN);
        let span = settings.dead_after.times(times);
        self.back.is_none_or(|back| now.since(back.since) < span)
    }

    /// Records a loss of the link. `losses` is the number of recent losses before this one.
    ///
    /// If `counted` is false, the number does not include this loss until the node has been silent for longer than
    /// `dead_after` after it.
    fn record_loss(&mut self, losses: u8, counted: bool, now: Instant) {
        *self = Self {
            lost_at: now,
            back: None,
            losses: losses.saturating_add(u8::from(counted)),
            excused: !counted,
            was_down: false,
            interval: if self.losses == 0 {
                Duration::from_micros(0)
            } else {
                now.since(self.lost_at)
            },
        };
    }
}

/// Losses of the links to the four nearest nodes on one side of the relay, nearest node first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Damping {
    /// Node that will be selected once it has been received for long enough without a long silence. `None` if there is
    /// none.
    candidate: Option<Heard>,
    links: [Link; CANDIDATES as usize],
}

impl Damping {
    pub(super) const fn new(now: Instant) -> Self {
        Self {
            candidate: None,
            links: [Link::new(now); CANDIDATES as usize],
        }
    }

    /// Clears the record of lost links at the start of the relay.
    ///
    /// It changes the value in place, because a copy would need more stack than any other step of the start.
    pub(super) fn begin(&mut self, now: Instant) {
        for link in &mut self.links {
            *link = Link::new(now);
        }
    }

    fn link(&self, distance: u16) -> Option<&Link> {
        self.links.get(usize::from(distance).wrapping_sub(1))
    }

    fn link_mut(&mut self, distance: u16) -> Option<&mut Link> {
        self.links.get_mut(usize::from(distance).wrapping_sub(1))
    }

    /// Records the loss of the link to the node `distance` relays away. `counts` is false if the channel loses many
    /// frames. The number of losses then rises only if the link flaps.
    ///
    /// If a different link on this side of the relay flaps, the lost link takes over that link's number of losses, if
    /// it is larger. The reason is that all links on one side cross the same gap in the chain.
    pub(super) fn record_loss(
        &mut self,
        distance: u16,
        counts: bool,
        now: Instant,
        settings: &Settings,
    ) {
        let most = self.links.iter().map(|link| link.recent(now, settings));
        let most = most.max().filter(|most| *most > MAX_FORGIVEN).unwrap_or(0);
        if let Some(link) = self.link_mut(distance) {
            let known = link.recent(now, settings).max(most);
            link.record_loss(known, counts || known > MAX_FORGIVEN, now);
        }
    }

    /// Records a frame of the node `distance` relays away. A long silence of the node before this frame counts as a
    /// loss of the link.
    ///
    /// `searching_since` is the start of the search; `None` if this side has a neighbour. During a search, a link
    /// counts as lost if its node has answered and then was silent for longer than `gap`.
    pub(super) fn record_hello(
        &mut self,
        distance: u16,
        searching_since: Option<Instant>,
        gap: Duration,
        now: Instant,
        settings: &Settings,
    ) {
        if searching_since.is_some_and(|asks| self.is_unanswered(asks, now, settings)) {
            self.equalise_losses(now, settings);
        }
        let Some(link) = self.link_mut(distance) else {
            return;
        };
        let last = link.back.map_or(link.lost_at, |back| back.last);
        let silence = now.since(last);
        if link.back.is_some() {
            if silence > gap && searching_since.is_some_and(|asks| last >= asks) {
                link.record_loss(link.recent(now, settings), true, now);
                link.was_down = true;
            }
        } else if silence > settings.dead_after && (link.losses > 0 || link.excused) {
            link.was_down = true;
            link.losses = link.losses.saturating_add(u8::from(link.excused));
            link.excused = false;
        }
        link.back = Some(Heard::updated(link.back, distance, now, gap));
    }

    /// Returns true if no node has answered the search for a neighbour that began at `since`. False until the search
    /// has lasted for `probe_after`.
    fn is_unanswered(&self, since: Instant, now: Instant, settings: &Settings) -> bool {
        let answers = |link: &Link| link.back.is_some_and(|back| back.last >= since);
        now.since(since) >= settings.probe_after && !self.links.iter().any(answers)
    }

    /// Raises the number of losses of each link on this side of the relay to that of the link lost last. These links
    /// were lost together, because all of them cross the same gap in the chain.
    fn equalise_losses(&mut self, now: Instant, settings: &Settings) {
        let lost = self.links.iter();
        let lost = lost.filter(|link| link.recent(now, settings) > 0);
        if let Some(last) = lost.max_by_key(|link| link.lost_at).copied() {
            for link in &mut self.links {
                link.losses = link.losses.max(last.losses);
                link.lost_at = last.lost_at;
                link.interval = last.interval;
                link.back = None;
            }
        }
    }

    /// Returns true while the link to the node `distance` relays away flaps and must not be used.
    pub(super) fn is_held_down(&self, distance: u16, now: Instant, settings: &Settings) -> bool {
        let link = self.link(distance);
        link.is_some_and(|link| link.is_held_down(now, settings))
    }

    /// Returns true if a link on this side of the relay has been lost repeatedly, at long intervals. The next loss of
    /// such a link should be detected early.
    pub(super) fn has_slow_flapping(&self, now: Instant, settings: &Settings) -> bool {
        let slow = settings.dead_after.times(SLOW_INTERVAL);
        let is_slow =
            |link: &Link| link.recent(now, settings) > MAX_FORGIVEN && link.interval >= slow;
        self.links.iter().any(is_slow)
    }

    /// Returns true if the last loss of the link to the node `distance` relays away was an outage.
    ///
    /// An outage is a silence of more than `dead_after`.
    pub(super) fn was_down(&self, distance: u16) -> bool {
        self.link(distance).is_some_and(|link| link.was_down)
    }

    /// Returns a bit mask of the nodes whose links flap and must not be used. Bit 0 is the node nearest to this relay.
    pub(super) fn held_down_nodes(&self, now: Instant, settings: &Settings) -> u8 {
        (1..=CANDIDATES)
            .filter(|distance| self.is_held_down(*distance, now, settings))
            .fold(0, |held, distance| held | mask(distance))
    }

    /// Clears the node that was about to be selected as the neighbour.
    pub(super) const fn clear(&mut self) {
        self.candidate = None;
    }

    /// Records a frame of a candidate `distance` relays away. Returns true if this candidate has been received without
    /// gaps for the longer of `probe_after` and `more`.
    pub(super) fn has_waited(
        &mut self,
        distance: u16,
        more: Duration,
        now: Instant,
        settings: &Settings,
    ) -> bool {
        // If frames of two nodes alternate, only the nearer node counts. Otherwise each would interrupt the record of
        // the other.
        if let Some(known) = self.candidate
            && known.distance < distance
            && now.since(known.last) <= settings.dead_after
        {
            return false;
        }
        let heard = Heard::updated(self.candidate, distance, now, settings.dead_after);
        self.candidate = Some(heard);
        now.since(heard.since) >= settings.probe_after.max(more)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::Damping;
    use crate::settings::Settings;
    use crate::time::{Duration, Instant};

    fn seconds(s: u64) -> Duration {
        Duration::from_millis(1_000 * s)
    }

    /// Returns the initial state for a test: links without losses, the time 1 000 s, and default settings.
    fn begun() -> (Damping, Instant, Settings) {
        let now = Instant::ZERO + seconds(1_000);
        (Damping::new(now), now, Settings::default())
    }

    /// Simulates a loss of the link to the nearest node for 40 s. Meanwhile this side searches for a neighbour, and the
    /// nodes at the distances `heard` (in relays) answer.
    fn outage(side: &mut Damping, now: &mut Instant, heard: &[u16], settings: &Settings) {
        let search = *now;
        side.record_loss(1, true, search, settings);
        for _ in 0..40 {
            *now = *now + seconds(1);
            for distance in heard {
                side.record_hello(*distance, Some(search), settings.dead_after, *now, settings);
            }
        }
        side.record_hello(1, Some(search), settings.dead_after, *now, settings);
    }

    #[test]
    fn the_third_loss_of_a_link_holds_it_down_for_dead_after() {
        let (mut side, mut now, settings) = begun();
        for losses in 1..=3 {
            outage(&mut side, &mut now, &[], &settings);
            assert_eq!(side.is_held_down(1, now, &settings), losses > 2, "{losses}");
        }
        for _ in 0..15 {
            assert!(side.is_held_down(1, now, &settings));
            now = now + seconds(1);
            side.record_hello(1, None, settings.dead_after, now, &settings);
        }
        assert!(!side.is_held_down(1, now, &settings));
    }

    #[test]
    fn each_further_loss_doubles_the_hold_down_up_to_90_s() {
        let (mut side, mut now, settings) = begun();
        let mut spans = Vec::new();
        for _ in 0..8 {
            outage(&mut side, &mut now, &[], &settings);
            let back = now;
            while side.is_held_down(1, now, &settings) {
                now = now + seconds(1);
                side.record_hello(1, None, settings.dead_after, now, &settings);
            }
            spans.push(now.since(back).as_micros() / 1_000_000);
        }
        assert_eq!(spans, [0, 0, 15, 30, 60, 90, 90, 90]);
    }

    #[test]
    fn a_partition_holds_all_links_down() {
        let (mut side, mut now, settings) = begun();
        for losses in 1..=3 {
            assert_eq!(side.held_down_nodes(now, &settings), 0, "{losses}");
            outage(&mut side, &mut now, &[], &settings);
        }
        assert_eq!(side.held_down_nodes(now, &settings), 0b1111);
    }

    #[test]
    fn an_outage_of_one_candidate_holds_one_link_down() {
        let (mut side, mut now, settings) = begun();
        for _ in 0..3 {
            outage(&mut side, &mut now, &[2, 3, 4], &settings);
        }
        assert_eq!(side.held_down_nodes(now, &settings), 0b0001);
    }

    #[test]
    fn a_candidate_that_is_silent_during_a_search_is_lost() {
        let (mut side, mut now, settings) = begun();
        let search = now;
        for second in 0..180 {
            now = now + seconds(1);
            side.record_hello(2, Some(search), settings.dead_after, now, &settings);
            // The nearest node answers for 20 s and is silent for 40 s.
            if second % 60 < 20 {
                side.record_hello(1, Some(search), settings.dead_after, now, &settings);
            }
        }
        assert!(!side.is_held_down(1, now, &settings));
        now = now + seconds(1);
        side.record_hello(1, Some(search), settings.dead_after, now, &settings);
        assert!(side.is_held_down(1, now, &settings));
        assert!(!side.is_held_down(2, now, &settings));
    }

    #[test]
    fn a_silence_between_two_rare_questions_is_no_loss() {
        let (mut side, mut now, settings) = begun();
        let (search, gap) = (now, settings.dead_after.times(8));
        for _ in 0..10 {
            now = now + seconds(100);
            side.record_hello(1, Some(search), gap, now, &settings);
        }
        assert_eq!(side.held_down_nodes(now, &settings), 0);
        for _ in 0..3 {
            now = now + seconds(121);
            side.record_hello(1, Some(search), gap, now, &settings);
        }
        assert_eq!(side.held_down_nodes(now, &settings), 0b0001);
        // The silences between rare answers do not restart the hold-down.
        now = now + seconds(14);
        side.record_hello(1, Some(search), gap, now, &settings);
        assert_eq!(side.held_down_nodes(now, &settings), 0b0001);
        now = now + seconds(40);
        side.record_hello(1, Some(search), gap, now, &settings);
        assert_eq!(side.held_down_nodes(now, &settings), 0);
    }

    #[test]
    fn a_silent_candidate_of_a_linked_side_is_not_lost() {
        let (mut side, mut now, settings) = begun();
        for _ in 0..5 {
            now = now + seconds(60);
            side.record_hello(1, None, settings.dead_after, now, &settings);
        }
        assert_eq!(side.held_down_nodes(now, &settings), 0);
    }

    #[test]
    fn a_loss_is_an_outage_after_a_silence_of_more_than_dead_after() {
        let (mut side, now, settings) = begun();
        side.record_loss(1, false, now, &settings);
        side.record_hello(
            1,
            Some(now),
            settings.dead_after,
            now + seconds(15),
            &settings,
        );
        assert!(!side.was_down(1));
        side.record_loss(1, false, now + seconds(20), &settings);
        let again = now + seconds(36);
        side.record_hello(
            1,
            Some(now + seconds(20)),
            settings.dead_after,
            again,
            &settings,
        );
        assert!(side.was_down(1));
    }

    #[test]
    fn a_link_that_was_never_lost_was_not_down() {
        let (mut side, now, settings) = begun();
        side.record_hello(
            1,
            Some(now),
            settings.dead_after,
            now + seconds(100),
            &settings,
        );
        assert!(!side.was_down(1));
        side.record_hello(2, None, settings.dead_after, now + seconds(200), &settings);
        assert!(!side.was_down(2));
    }
}
