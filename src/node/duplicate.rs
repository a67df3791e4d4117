//! Duplicate index: a second node uses this relay's node number. At most one of the two nodes may have a setpoint.
//!
//! Each start has a 30-bit *claim number*, drawn from the seed of `Relay::new`. Two nodes with one number compare their
//! claims. The larger epoch makes the larger claim. With equal epochs, the larger claim number makes the larger claim.
//! A relay is
//! *active* or *passive*. A passive relay has no setpoint, takes no part in the protocol, and sends only claims.
//!
//! Without a key the claim number is sent in a Claim message to a neighbour. The other node with this index receives
//! the claim directly, or as the neighbour's echo. A claim also contains the claim number that its sender has received
//! last. Only a claim that contains this relay's number is known to have been sent after this relay's start. With a
//! key, the lower half of the nonces starts at the claim number. Handshakes contain this nonce, and neighbours show the
//! largest nonce that they have received.
//!
//! | state | event | action | next state |
//! | --- | --- | --- | --- |
//! | any | own claim, or frame with a tag of its own, received | none: an echo of its own radio | same |
//! | any | claim of another node received, the first for twice `dead_after` | `Event::DuplicateIndex` | same |
//! | active | other frame with its own index received, no key | send a claim, and 8 more every four `hop_time`; none if an echo of its own was received within `probe_after` | active |
//! | active | smaller claim, or one that does not name its own | send a claim, and 32 more every four `hop_time` while the other node is not known to be passive | active |
//! | active | claim of a passive node | send a claim | active |
//! | active | larger claim of the same epoch; it has held a position since before it first received the other node; its claim number plus 2^31 is the larger one | raise its claim number by 2^31; send claims as before, with a key one and 8 more | active |
//! | active | larger claim otherwise | drop its agreed position | passive |
//! | active | on links, no key: 2.25, 2.75, 3.75, 5.75, 9.75, 17.75 s after it became active, 0.25, 0.75 s and so on after a claim of another active node, then every `dead_after` | send a claim | active |
//! | active | on a shared channel, with a key: one message of each lease renewal sent | send a handshake after it | active |
//! | passive | every quarter of `probe_after`, no key | send a claim with the flag passive | passive |
//! | passive | claim of an active node, or other frame with its own index received | restart the timer | passive |
//! | passive | handshake of a neighbour that shows the nonce of the other node | none: the neighbour may not know yet that the node is gone | passive |
//! | passive | timer of twice `dead_after`, and a random part of up to an eighth more, expired | leave the view; request a new one | active |
//! | passive | its firmware reports that the other node is gone | raise its claim number above the other one; leave the view; request a new one | active |
//!
//! Claims are sent at most once in four `hop_time`.
//!
//! # Safety
//! A relay becomes passive as soon as it receives a larger claim, and the order of claims is total. If two active nodes exchange
//! claims, the one with the smaller claim therefore becomes passive, unless it raises its claim number; since it does so only
//! once, the exchange ends after three claims. Only a relay that had a position before it first received the other node raises
//! its number. It therefore keeps its position when a copy of it is switched on later, although that copy may have been placed in
//! a new view meanwhile.
//!
//! With a key, only a handshake with the right tag counts as a claim, and no other frame with this relay's index is answered. A
//! replayed handshake has no effect: one of this relay has an older epoch or its own claim number, and one of another node is
//! still true or superseded by a larger claim. A message with its own index cannot be verified, because its tag covers nonces
//! that only its two ends know: it raises the event and restarts the timer of a passive relay, but makes no relay passive. The
//! neighbours apply the same order: they accept the larger nonce, and show it to the node that sends the smaller one. Once the
//! node of the larger nonce has been silent for `dead_after` they forget it, and accept the next one.
//!
//! Two nodes with one index can propose views with the same identifier for different members. Therefore a relay that becomes
//! active drops its view, lease and proposal, as after a restart with its vote record; no relay takes part in a lease renewal
//! before it has agreed on its position in the view; and a decision that does not follow the views known to a relay makes it
//! request a later one.

use crate::settings::{Settings, Wiring};
use crate::time::{Duration, Instant, Jitter};
use crate::wire::message::Claim;
use crate::wire::session::{RAISED, Rival, Sender};

/// Wait before the first claim that this relay sends unasked. The intervals between later claims double.
///
/// Claims let two nodes with one node number detect each other.
const FIRST_CLAIM: Duration = Duration::from_millis(250);

/// Additional wait before the first unasked claim to the node number. It applies after a start, and after the relay was
/// passive. A hundred relays need about this time for their first agreement.
const AFTER_START: Duration = Duration::from_millis(2_000);

/// Longest of the doubled intervals between unasked claims. After an interval of this length, claims follow every
/// `dead_after`. Claims let two nodes with one node number detect each other.
const LAST_INTERVAL: Duration = Duration::from_millis(8_000);

/// Number of claims that this relay sends in answer to a claim of a node with the same number. The interval between
/// them is [`least_interval`].
const DEFENCES: u8 = 32;

/// Number of claims that this relay sends after a frame of a second node with its node number. The frame contains no
/// claim.
///
/// With signed frames: number of claims that this relay sends after it has raised its claim number.
const REPEATED_CLAIMS: u8 = 8;

/// Returns the minimum interval between this relay's claims to its node number. Without this limit, the claims of two
/// relays with one number, and the echoes of these claims, could fill the channel.
fn least_interval(settings: &Settings) -> Duration {
    settings.hop_time.times(4)
}

/// Returns the interval between a passive relay's claims to its node number. It is a quarter of `probe_after`. A
/// passive relay sends many claims before it becomes active again, so the loss of a few claims does no harm.
const fn passive_interval(settings: &Settings) -> Duration {
    Duration::from_micros(settings.probe_after.as_micros() / 4)
}

/// State of this relay's claims to its node number, and of a duplicate (a node with the same number).
#[derive(Clone, Debug)]
pub(crate) struct IndexClaims {
    number: u32,
    /// Largest claim number received from a second node with this relay's node number and epoch. If it exceeds this
    /// relay's own, this relay becomes passive.
    rival: u32,
    /// Last claim number received from a second node with this relay's node number; 0 if there is none.
    last_rival: u32,
    /// Time of the last frame from a second node with this relay's number (duplicate). The flag is true if this relay
    /// already had a position when the first such frame arrived. `None` before the first such frame.
    contest: Option<(Instant, bool)>,
    /// Last times at which two nodes with the same number were detected; `None` if never. Entry 0 is for this relay's
    /// number, entry 1 for a neighbour's.
    observed: [Option<Instant>; 2],
    /// Time at which this relay last received one of its own frames back (echo); `None` if never.
    echoed: Option<Instant>,
    /// Time at which a passive relay becomes active again; `None` while this relay is active.
    passive_until: Option<Instant>,
    /// Time of this relay's next unasked claim to its node number; `None` if none is scheduled.
    next_claim: Option<Instant>,
    /// Interval between the next unasked claim to the node number and the claim after it.
    interval: Duration,
    /// Number of claims still to be sent against a duplicate of this relay's node number. The interval between them is
    /// [`least_interval`].
    defences: u8,
    /// Earliest time at which the next claim may be scheduled. This limits the rate of Claim messages.
    quiet_until: Instant,
    claim_due: bool,
    /// True if all authentication sessions must be restarted with this relay's present claim number.
    sessions_due: bool,
    jitter: Jitter,
}

/// Node number that two nodes use: this relay's own, or a neighbour's.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Duplicated {
    Own,
    Neighbour,
}

impl IndexClaims {
    pub(crate) fn new(seed: u32, now: Instant, settings: &Settings) -> Self {
        let mut jitter = Jitter::new(seed);
        let number = (jitter.draw() >> 2).max(1);
        let mut duplicate = Self {
            number,
            rival: 0,
            last_rival: 0,
            contest: None,
            observed: [None; 2],
            echoed: None,
            passive_until: None,
            next_claim: None,
            interval: FIRST_CLAIM,
            defences: 0,
            quiet_until: now,
            claim_due: false,
            sessions_due: false,
            jitter,
        };
        duplicate.schedule_unprompted(now + AFTER_START, settings);
        duplicate
    }

    pub(crate) const fn number(&self) -> u32 {
        self.number
    }

    /// Records that two nodes use the same number. Returns true if a report is due: two such nodes were not observed in
    /// the last 2 * `dead_after`.
    pub(crate) fn should_report(
        &mut self,
        now: Instant,
        duplicated: Duplicated,
        settings: &Settings,
    ) -> bool {
        let [own, neighbour] = &mut self.observed;
        let observed = match duplicated {
            Duplicated::Own => own,
            Duplicated::Neighbour => neighbour,
        };
        let since = observed.replace(now).map(|observed| now.since(observed));
        since.is_none_or(|since| since > settings.dead_after.times(2))
    }

    /// Returns true if a second node with this relay's number was received recently.
    ///
    /// Recently means within the last three periods of `dead_after`.
    ///
    /// A node that was passive sends claims again after up to 2.25 periods, so two periods are too short.
    pub(crate) fn is_observed(&self, now: Instant, settings: &Settings) -> bool {
        let [own, _] = self.observed;
        own.is_some_and(|at| now.since(at) < settings.dead_after.times(3))
    }

    /// Returns the sender of a claim to this relay's node number: this relay itself or a duplicate.
    pub(crate) fn rival(&self, claim: Claim) -> Sender {
        if claim.number | RAISED == self.number | RAISED {
            return Sender::Itself;
        }
        Sender::Rival(Rival {
            number: claim.number,
            newer_epoch: false,
            passive: claim.passive,
            is_current: claim.other_number | RAISED == self.number | RAISED,
        })
    }

    pub(crate) const fn other_number(&self) -> u32 {
        self.last_rival
    }

    /// Records a frame of a second node with this relay's number. Returns true if this relay may
    /// defend the number now, and could when the first such frame arrived.
    fn could_always_defend(&mut self, now: Instant, may_defend: bool, settings: &Settings) -> bool {
        let known = self.contest;
        let known = known.filter(|(at, _)| now.since(*at) <= settings.dead_after.times(2));
        let held = known.map_or(may_defend, |(_, held)| held);
        self.contest = Some((now, held));
        held && may_defend
    }

    /// Handles a frame whose sender has this relay's node number. Returns true if this relay becomes passive.
    /// `may_defend` is true if this relay has a setpoint, and a lease or a pending lease.
    pub(crate) fn handle_frame(
        &mut self,
        now: Instant,
        sender: Sender,
        may_defend: bool,
        settings: &Settings,
    ) -> bool {
        match sender {
            Sender::Itself => {
                self.echoed = Some(now);
                self.defences = 0;
            }
            Sender::Unknown if self.is_passive() => self.become_passive(now, settings),
            Sender::Unknown => {
                let echoes = self.echoed;
                let echoes = echoes.is_some_and(|at| now.since(at) < settings.probe_after);
                if settings.auth.is_none() && !echoes {
                    self.could_always_defend(now, may_defend, settings);
                    self.defences = self.defences.max(REPEATED_CLAIMS);
                    self.schedule_unprompted(now, settings);
                    self.schedule_claim(now, settings);
                }
            }
            Sender::Rival(rival) => return self.compare(now, rival, may_defend, settings),
        }
        false
    }

    /// Compares a duplicate's claim to this relay's number with this relay's own claim. Returns true if this relay
    /// becomes passive.
    fn compare(
        &mut self,
        now: Instant,
        rival: Rival,
        may_defend: bool,
        settings: &Settings,
    ) -> bool {
        let held = self.could_always_defend(now, may_defend, settings);
        if !rival.newer_epoch {
            self.rival = self.rival.max(rival.number);
            self.last_rival = rival.number;
        }
        if self.is_passive() {
            if !rival.passive {
                self.become_passive(now, settings);
            }
            return false;
        }
        let larger = rival.newer_epoch || rival.number > self.number;
        if !larger || rival.passive || !rival.is_current {
            self.defend(now, rival, settings);
            return false;
        }
        let raised = self.number | RAISED;
        if !rival.newer_epoch && held && raised > rival.number {
            self.number = raised;
            self.sessions_due = true;
            self.defend(now, rival, settings);
            if settings.auth.is_some() {
                // A replayed frame must not trigger claims again.
                self.defences = REPEATED_CLAIMS;
                self.schedule_unprompted(now, settings);
            }
            return false;
        }
        self.become_passive(now, settings);
        self.claim_due = settings.auth.is_none();
        let next = now + passive_interval(settings);
        self.next_claim = settings.auth.is_none().then_some(next);
        true
    }

    /// Schedules a claim to this relay's node number. Does nothing shortly after the last claim ([`least_interval`]).
    fn schedule_claim(&mut self, now: Instant, settings: &Settings) {
        if self.quiet_until <= now {
            self.quiet_until = now + least_interval(settings);
            self.claim_due = true;
        }
    }

    /// Schedules claims in answer to a duplicate's claim `rival` to this relay's number. The claims are repeated for
    /// some seconds, or until the duplicate is passive. With signed frames only one claim is sent.
    fn defend(&mut self, now: Instant, rival: Rival, settings: &Settings) {
        self.defences = 0;
        if !rival.passive {
            if settings.auth.is_none() {
                self.defences = DEFENCES;
            }
            self.schedule_unprompted(now, settings);
        }
        self.schedule_claim(now, settings);
    }

    fn become_passive(&mut self, now: Instant, settings: &Settings) {
        self.passive_until = Some(now + self.jitter.spread(settings.dead_after.times(2)));
    }

    /// Starts periodic claims if frames on wired links are not signed, or if `defences` is above 0.
    ///
    /// On a shared channel a relay receives the frames of a duplicate directly.
    fn schedule_unprompted(&mut self, now: Instant, settings: &Settings) {
        self.interval = FIRST_CLAIM;
        let unasked = settings.wiring == Wiring::Pair && settings.auth.is_none();
        let announces = unasked || self.defences > 0;
        self.next_claim = announces.then(|| now + self.jitter.spread(FIRST_CLAIM));
    }

    pub(crate) const fn is_passive(&self) -> bool {
        self.passive_until.is_some()
    }

    /// Returns true if a claim to this relay's node number must be sent now, and marks it as sent.
    pub(crate) const fn poll_claim(&mut self) -> bool {
        core::mem::replace(&mut self.claim_due, false)
    }

    /// Returns this relay's claim number if it must restart its authentication sessions; otherwise `None`. Claim
    /// numbers distinguish two nodes with one node number. A relay that has raised its claim number restarts its
    /// sessions with the new number.
    pub(crate) fn poll_sessions(&mut self) -> Option<u32> {
        core::mem::replace(&mut self.sessions_due, false).then_some(self.number)
    }

    /// Handles expired timers of the claims to the node number. Returns true if this relay was passive and becomes
    /// active.
    pub(crate) fn handle_timeout(&mut self, now: Instant, settings: &Settings) -> bool {
        if self.passive_until.is_some_and(|until| until <= now) {
            self.activate(now, settings);
            return true;
        }
        if self.next_claim.is_some_and(|at| at <= now) {
            self.claim_due = true;
            let interval = if self.is_passive() {
                Some(passive_interval(settings))
            } else if let Some(left) = self.defences.checked_sub(1) {
                self.defences = left;
                Some(least_interval(settings))
            } else if settings.wiring == Wiring::Shared || settings.auth.is_some() {
                None
            } else if self.interval < LAST_INTERVAL {
                self.interval = self.interval.times(2);
                Some(self.interval)
            } else {
                Some(settings.dead_after)
            };
            self.next_claim = interval.map(|interval| now + self.jitter.spread(interval));
        }
        false
    }

    fn activate(&mut self, now: Instant, settings: &Settings) {
        self.passive_until = None;
        self.sessions_due = true;
        self.schedule_unprompted(now + AFTER_START, settings);
    }

    /// Handles the report that the duplicate of this relay's number is gone. Returns true if this relay becomes active.
    pub(crate) fn clear(&mut self, now: Instant, settings: &Settings) -> bool {
        let passive = self.is_passive();
        if passive {
            self.number = (self.number | RAISED).max(self.rival.saturating_add(1));
            self.activate(now, settings);
        }
        passive
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        super::context::earliest(self.passive_until, self.next_claim)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::{Claim, Duplicated, IndexClaims, RAISED, Rival, Sender, Settings, Wiring};
    use crate::time::Instant;

    fn at(seconds: u64) -> Instant {
        Instant::from_millis(1_000 * seconds)
    }

    fn duplicate() -> IndexClaims {
        IndexClaims::new(1, at(0), &Settings::default())
    }

    fn rival(number: u32) -> Rival {
        Rival {
            number,
            newer_epoch: false,
            passive: false,
            is_current: true,
        }
    }

    fn claim(number: u32) -> Claim {
        Claim {
            number,
            other_number: 0,
            passive: false,
            echo: true,
        }
    }

    /// Checks that a second node's claim from before this relay's last start is only answered. The claim repeats a
    /// claim number that this relay no longer uses.
    #[test]
    fn a_claim_to_an_earlier_start_is_only_answered() {
        let settings = Settings::default();
        for may_defend in [false, true] {
            let mut duplicate = duplicate();
            let own = duplicate.number();
            let before = Claim {
                other_number: 5,
                ..claim(own + 9)
            };
            let sender = duplicate.rival(before);
            assert!(matches!(sender, Sender::Rival(rival) if !rival.is_current));
            assert!(!duplicate.handle_frame(at(1), sender, may_defend, &settings));
            assert!(duplicate.poll_claim() && !duplicate.is_passive());
            assert_eq!(
                (duplicate.number(), duplicate.other_number()),
                (own, own + 9)
            );
            // The other node is present and answers.
            let answer = Claim {
                other_number: own,
                ..before
            };
            let sender = duplicate.rival(answer);
            assert_eq!(
                duplicate.handle_frame(at(2), sender, may_defend, &settings),
                !may_defend
            );
        }
    }

    /// Checks which of two nodes with the same number becomes passive, for all rows of the state table.
    #[test]
    fn the_smaller_claim_becomes_passive_unless_a_lease_raises_it() {
        let settings = Settings::default();
        let own = duplicate().number();
        assert!(own < RAISED >> 1, "30 bits");
        for (number, raised_wins) in [
            (own - 1, true),
            (own + 1, true),
            (RAISED | (own - 1), true),
            (RAISED | (own + 1), false),
        ] {
            for may_defend in [false, true] {
                for newer_epoch in [false, true] {
                    for passive in [false, true] {
                        let mut duplicate = duplicate();
                        let rival = Rival {
                            number,
                            newer_epoch,
                            passive,
                            is_current: true,
                        };
                        let sender = Sender::Rival(rival);
                        let becomes = duplicate.handle_frame(at(1), sender, may_defend, &settings);
                        let larger = !passive && (newer_epoch || number > own);
                        let raises = larger && !newer_epoch && may_defend && raised_wins;
                        assert_eq!(becomes, larger && !raises, "{rival:?} {may_defend}");
                        assert_eq!(duplicate.is_passive(), becomes);
                        let claimed = if raises { own | RAISED } else { own };
                        assert_eq!(duplicate.number(), claimed);
                        assert_eq!(duplicate.poll_sessions(), raises.then_some(claimed));
                        assert!(duplicate.poll_claim(), "the other one has to know");
                    }
                }
            }
        }
    }

    /// Checks that a relay raises its claim number only if it had a position before its duplicate appeared. After 40 s
    /// of silence, the duplicate's next frame counts as its first one.
    #[test]
    fn a_position_after_the_first_contact_raises_no_claim() {
        let settings = Settings::default();
        for (had_place, later_s, raises) in [(false, 1, false), (true, 1, true), (false, 40, true)]
        {
            let mut duplicate = duplicate();
            let smaller = Sender::Rival(rival(duplicate.number() - 1));
            assert!(!duplicate.handle_frame(at(1), smaller, had_place, &settings));
            let larger = Sender::Rival(rival(duplicate.number() + 1));
            let becomes = duplicate.handle_frame(at(1 + later_s), larger, true, &settings);
            assert_eq!(becomes, !raises, "{had_place} {later_s}");
        }
    }

    #[test]
    fn of_two_relays_with_leases_one_is_passive_after_three_claims() {
        let settings = Settings::default();
        for seeds in [[1, 2], [2, 1], [3, 9], [9, 3]] {
            let mut both = seeds.map(|seed| IndexClaims::new(seed, at(0), &settings));
            let mut claims = 0;
            while both.iter().all(|one| !one.is_passive()) {
                let [from, to] = if claims % 2 == 0 { [0, 1] } else { [1, 0] };
                let claim = rival(both[from].number());
                both[to].handle_frame(at(claims), Sender::Rival(claim), true, &settings);
                claims += 1;
            }
            assert!(claims <= 4, "{claims} with {seeds:?}");
            let active = both.iter().filter(|one| !one.is_passive()).count();
            assert_eq!(active, 1);
        }
    }

    #[test]
    fn a_relay_with_echoes_ignores_its_own_frames() {
        let settings = Settings::default();
        let mut duplicate = duplicate();
        let own = duplicate.number();
        assert_eq!(duplicate.rival(claim(own)), Sender::Itself);
        assert_eq!(duplicate.rival(claim(own | RAISED)), Sender::Itself);
        assert!(!duplicate.handle_frame(at(1), Sender::Unknown, false, &settings));
        assert!(duplicate.poll_claim());
        assert!(!duplicate.handle_frame(at(2), Sender::Itself, false, &settings));
        assert!(!duplicate.handle_frame(at(6), Sender::Unknown, false, &settings));
        assert!(!duplicate.poll_claim());
        duplicate.handle_frame(at(7), Sender::Unknown, false, &settings);
        assert!(duplicate.poll_claim());
    }

    #[test]
    fn claims_are_sent_at_most_once_in_four_hop_times() {
        let settings = Settings::default();
        let mut duplicate = duplicate();
        let smaller = Sender::Rival(rival(0));
        let mut sent = 0;
        for tenth in 0..100 {
            let now = Instant::from_millis(20 * tenth);
            duplicate.handle_frame(now, smaller, false, &settings);
            sent += u32::from(duplicate.poll_claim());
        }
        assert_eq!(sent, 17, "one in 0.12 s");
    }

    #[test]
    fn a_start_is_announced_on_links_and_not_on_a_shared_channel() {
        let settings = Settings {
            wiring: Wiring::Shared,
            ..Settings::default()
        };
        let shared = IndexClaims::new(1, at(0), &settings);
        assert_eq!(shared.next_timeout(), None);
        let settings = Settings::default();
        let mut duplicate = duplicate();
        let mut sent = std::vec::Vec::new();
        for _ in 0..6 {
            let next = duplicate.next_timeout().unwrap();
            assert!(!duplicate.handle_timeout(next, &settings));
            assert!(duplicate.poll_claim());
            sent.push(next.as_micros() / 1_000);
        }
        for (least, at) in [2_250, 2_750, 3_750, 5_750, 9_750, 17_750]
            .into_iter()
            .zip(sent)
        {
            assert!((least..=least + least / 8).contains(&at), "{at}");
        }
        let mut duplicate = IndexClaims::new(1, at(0), &settings);
        let mut sent = 0;
        while let Some(next) = duplicate.next_timeout().filter(|next| *next < at(3_600)) {
            duplicate.handle_timeout(next, &settings);
            sent += u32::from(duplicate.poll_claim());
        }
        assert!((200..=245).contains(&sent), "{sent} in an hour");
    }

    /// Checks that a relay repeats its claim for 4 s after a claim of an active duplicate. The relay stops early once
    /// the duplicate is passive.
    #[test]
    fn an_index_is_defended_for_4_s_or_until_the_other_is_passive() {
        let settings = Settings::default();
        for passive in [false, true] {
            let mut duplicate = duplicate();
            duplicate.handle_frame(at(100), Sender::Rival(rival(0)), false, &settings);
            assert!(duplicate.poll_claim());
            let other = Rival {
                passive: true,
                ..rival(0)
            };
            if passive {
                duplicate.handle_frame(at(101), Sender::Rival(other), false, &settings);
            }
            let mut sent = 0;
            while let Some(next) = duplicate.next_timeout().filter(|next| *next < at(105)) {
                duplicate.handle_timeout(next, &settings);
                sent += u32::from(duplicate.poll_claim());
            }
            let expected = if passive { 3..=4 } else { 33..=36 };
            assert!(expected.contains(&sent), "{sent} {passive}");
        }
    }

    #[test]
    fn a_passive_relay_becomes_active_after_twice_dead_after() {
        let settings = Settings::default();
        let mut duplicate = duplicate();
        let own = duplicate.number();
        let larger = rival(own + 7);
        assert!(duplicate.handle_frame(at(0), Sender::Rival(larger), false, &settings));
        assert!(!duplicate.handle_frame(at(20), Sender::Unknown, false, &settings));
        assert!(!duplicate.handle_frame(at(40), Sender::Rival(larger), false, &settings));
        // A claim of a passive node does not keep a second node passive.
        let passive = Rival {
            passive: true,
            ..larger
        };
        duplicate.handle_frame(at(60), Sender::Rival(passive), false, &settings);
        assert!(!duplicate.handle_timeout(at(69), &settings) && duplicate.poll_claim());
        assert!(duplicate.handle_timeout(at(75), &settings) && !duplicate.is_passive());
        assert_eq!(duplicate.number(), own, "the other one may be there still");
        assert!(duplicate.handle_frame(at(80), Sender::Rival(larger), false, &settings));
        assert!(duplicate.clear(at(81), &settings) && !duplicate.is_passive());
        assert!(duplicate.number() > own + 7 && !duplicate.clear(at(82), &settings));
    }

    #[test]
    fn a_duplicate_index_is_reported_once_until_silence() {
        let settings = Settings::default();
        let mut duplicate = duplicate();
        let mut reported = |seconds, of| duplicate.should_report(at(seconds), of, &settings);
        assert!(reported(1, Duplicated::Own) && reported(1, Duplicated::Neighbour));
        assert!(!reported(31, Duplicated::Own) && !reported(60, Duplicated::Own));
        assert!(reported(91, Duplicated::Own) && reported(91, Duplicated::Neighbour));
    }
}
