//! Reports of this relay's state to a ground station that watches, and those that it hands on.

use super::Node;
use crate::features::{AUTH, TELEMETRY};
use crate::node::context::OwnState;
use crate::node::round::state::Phase;
use crate::side::Side;
use crate::stats::bump;
use crate::time::{Duration, Instant};
use crate::wire::CANDIDATES;
use crate::wire::message::Message;

/// Maximum time by which telemetry waits on a shared channel while the relays agree on positions.
const PATIENCE: Duration = Duration::from_millis(2_000);

/// Maximum time by which telemetry waits on a shared channel during the first agreement.
const FIRST_PATIENCE: Duration = Duration::from_millis(6_000);

impl Node {
    /// Handles a telemetry message of node `from` at `side`: a Watch (request for reports) or a Report. The node need
    /// not be a neighbour.
    pub(super) fn on_telemetry(&mut self, now: Instant, side: Side, from: u16, message: &Message) {
        if !AUTH {
            return; // Ground stations sign all frames.
        }
        if message.digest() != Some(self.member.digest) {
            self.refuse_mission(now, side, from);
        } else if !(self.reporting).handle(now, &self.member, (side, from), message) {
            bump(&mut self.telemetry.stats.stale);
        }
    }

    /// Records the control state of the drone, as numbered in reports; the numbers begin with 1. See
    /// [`Reporting::handle_control`](crate::node::reports::Reporting).
    #[cfg(feature = "telemetry")]
    pub(crate) fn report_control(&mut self, control: u16) {
        self.reporting.handle_control(&self.member, control);
    }

    /// Records that a frame of node `from` to node `to` was received on the shared channel.
    pub(crate) fn on_channel(&mut self, now: Instant, from: u16, to: u16) {
        self.reporting.handle_frame(now, &self.member, from, to);
    }

    /// Returns the next telemetry message (Watch or Report) with its side and its destination. `None` if none is
    /// pending.
    pub(super) fn next_telemetry(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        let wait = self.telemetry_waits();
        if !self.reporting.is_due(now, wait) {
            return None;
        }
        let own = if TELEMETRY {
            self.own(now)
        } else {
            OwnState::default()
        };
        let (member, neighbours) = (&self.member, &self.layers.neighbours);
        self.reporting.poll(now, member, neighbours, wait, own)
    }

    /// Returns the delay of telemetry reports, which keeps the channel free for an agreement on positions. It is above
    /// 0 only on a shared channel during such an agreement.
    pub(super) fn telemetry_waits(&self) -> Duration {
        let is_idle = matches!(
            self.phase(),
            Phase::Holding | Phase::Infeasible | Phase::NoQuorum
        );
        match self.agreed_place() {
            _ if is_idle || !self.searches() || !TELEMETRY => Duration::from_micros(0),
            Some(_) => PATIENCE,
            None => FIRST_PATIENCE,
        }
    }

    fn own(&self, now: Instant) -> OwnState {
        let hold = |side| self.hold_reason(side).map_or(0, |reason| reason as u16 + 1);
        let silent = |side| u16::from(self.layers.neighbours.at(side).is_silent());
        let sides = [Side::Upstream, Side::Downstream];
        let ([a, b], [c, d]) = (sides.map(hold), sides.map(silent));
        let holds_lease = u16::from(self.lease().is_some());
        let is_duplicated = u16::from(self.duplicate.is_observed(now, &self.member.settings));
        let flags = 512 * (c + 2 * d + 4 * holds_lease) + 28_672 * is_duplicated;
        let state = self.phase() as u16 + 8 * a + 64 * b + flags;
        OwnState {
            state,
            refusals: self.refusals(now),
            setpoint: self.setpoint(),
            agreed: self.agreed_place(),
        }
    }

    /// Returns the nearest nodes with a wrong mission, epoch or key, toward Tx and toward Rx; 0 for none.
    ///
    /// The values are those of [`Entry::refusal`](crate::wire::message::Entry::refusal). Tx and Rx do not count,
    /// because ground stations are no relays. Without the cargo feature `telemetry` both values are 0.
    pub(super) fn refusals(&self, now: Instant) -> [u16; 2] {
        if !TELEMETRY {
            return [0; 2];
        }
        let [before, after] = [Side::Upstream, Side::Downstream].map(|side| {
            let neighbour = self.layers.neighbours.at(side);
            neighbour
                .refusals
                .nearest(now, self.member.relays_to_end(side))
        });
        let firsts = [0, 4 * CANDIDATES, 2 * CANDIDATES];
        let mut kinds = before.into_iter().zip(after).zip(firsts);
        // Missions and epochs are refused by signed frames; the other key may be a forger's.
        let kind = kinds.find(|(nodes, _)| *nodes != (0, 0));
        kind.map_or([0; 2], |((before, after), first)| {
            let numbered = |distance, first| if distance == 0 { 0 } else { first + distance };
            [numbered(before, first), numbered(after, first + CANDIDATES)]
        })
    }
}

#[cfg(test)]
#[cfg(all(feature = "telemetry", feature = "upload"))]
mod tests {
    use super::*;
    use crate::event::NodeEvent;
    use crate::mission::Mission;
    use crate::mission::tests::paper;
    use crate::node::dispatch::tests::{NOW, relay_of};
    use crate::settings::Wiring;
    use crate::wire::message::{Coarse, Detail, Entry, Reports};

    /// Control states of a drone, as numbered in a report.
    const STANDBY: u16 = 3;
    const ENGAGED: u16 = 4;
    const BLIND: u16 = 5;

    const fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    /// Returns a relay of a chain of 8, from which a station at Tx has requested reports. The relay has sent all that is
    /// due at `NOW`.
    fn watched(index: u16, wiring: Wiring) -> Node {
        let mut node = relay_of(Mission::try_new(paper(8)).unwrap(), index, true);
        node.member.settings.wiring = wiring;
        let watch = Message::Watch {
            number: 1,
            mission: node.member.digest,
        };
        let from = if wiring == Wiring::Pair { index - 1 } else { 0 };
        node.on_telemetry(NOW, Side::Upstream, from, &watch);
        node.report_control(STANDBY);
        while reported(&mut node, NOW).is_some() {}
        node
    }

    /// Returns the next report toward Tx that is due at `now`. Reports are not delayed during an agreement on
    /// positions.
    fn reported(node: &mut Node, now: Instant) -> Option<Reports> {
        let own = node.own(now);
        let wait = Duration::from_micros(0);
        loop {
            let neighbours = &node.layers.neighbours;
            let reporting = &mut node.reporting;
            let (_, _, message) = reporting.poll(now, &node.member, neighbours, wait, own)?;
            if let Message::Report(report) = message {
                return Some(report);
            }
        }
    }

    /// Returns the first report in `span` from `now` on, and the time until then.
    fn next(node: &mut Node, now: Instant, span: Duration) -> Option<(Duration, Reports)> {
        (0..span.as_micros() / 10_000).find_map(|step| {
            let after = ms(10 * step);
            Some((after, reported(node, now + after)?))
        })
    }

    fn relays(report: &Reports) -> heapless::Vec<u16, 4> {
        report.entries.iter().map(Entry::relay).collect()
    }

    /// Returns an entry (state of a relay in a report) with this control state and [`Entry::refusal`].
    fn entry(relay: u16, control: u16, refusal: u16) -> Entry {
        Entry::new(
            relay + 1_000 * refusal,
            0,
            4_096 * control,
            Coarse::of(None),
        )
    }

    /// Passes a report of relay `from` with these entries to the node.
    fn receive(
        node: &mut Node,
        now: Instant,
        from: u16,
        entries: &[Entry],
        detail: Option<Detail>,
    ) {
        let mut report = Reports::new(1, node.member.digest);
        report.entries.extend_from_slice(entries).unwrap();
        report.detail = detail;
        node.on_telemetry(now, Side::Downstream, from, &Message::Report(report));
    }

    /// Passes to the relay `node` a message of a different mission, which node `from` has sent.
    fn foreign(node: &mut Node, now: Instant, from: u16) {
        let mission = node.member.digest ^ 1;
        let watch = Message::Watch { number: 1, mission };
        let side = if from < node.member.node {
            Side::Upstream
        } else {
            Side::Downstream
        };
        node.handle_message(now, side, from, &watch);
    }

    #[test]
    fn an_ordinary_change_waits_for_no_further_period() {
        let mut node = watched(1, Wiring::Shared);
        // The time from one entry of the relay to the next.
        let (_, report) = next(&mut node, NOW, ms(20_000)).unwrap();
        assert_eq!(relays(&report), [1]);
        let mut now = NOW + ms(20_000);
        next(&mut node, now, ms(20_000)).unwrap();
        let (period, _) = next(&mut node, now + ms(10), ms(20_000)).unwrap();
        now = now + ms(10_000);
        assert!(next(&mut node, now, ms(20_000)).is_some());
        // The pilot gives the drone back, then another relay's report passes before the relay may report again.
        node.reporting.handle_timeout(now + ms(100));
        node.report_control(ENGAGED);
        receive(&mut node, now + ms(110), 5, &[entry(5, ENGAGED, 0)], None);
        let mut at = now + ms(110);
        loop {
            let (after, report) = next(&mut node, at, ms(20_000)).unwrap();
            at = at + after;
            if relays(&report).contains(&1) {
                // The other relay's report has used a part of this relay's share of the data rate.
                let most = Duration::from_micros(period.as_micros() * 3 / 2);
                assert!(at.since(now) <= most, "{:?} {period:?}", at.since(now));
                break;
            }
        }
    }

    #[test]
    fn alarms_are_spread_on_a_shared_channel_only() {
        for (index, wiring, spread) in [
            (8, Wiring::Shared, 0),
            (6, Wiring::Shared, 60),
            (1, Wiring::Shared, 210),
            (1, Wiring::Pair, 0),
        ] {
            let mut node = watched(index, wiring);
            let now = NOW + ms(700);
            node.reporting.handle_timeout(now);
            node.report_control(BLIND);
            let (after, report) = next(&mut node, now, ms(5_000)).unwrap();
            assert_eq!((after, &relays(&report)[..]), (ms(spread), &[index][..]));
        }
    }

    #[test]
    fn further_changes_do_not_delay_an_alarm() {
        let mut node = watched(1, Wiring::Shared);
        let now = NOW + ms(700);
        for (step, control) in (0..3).zip([BLIND, STANDBY, BLIND]) {
            let now = now + ms(100 * step);
            assert!(step == 0 || reported(&mut node, now).is_none());
            node.reporting.handle_timeout(now);
            node.report_control(control);
        }
        let (after, _) = next(&mut node, now + ms(200), ms(5_000)).unwrap();
        assert_eq!(after, ms(10));
    }

    #[test]
    fn one_report_has_the_own_alarm_and_a_stored_one() {
        let mut node = watched(1, Wiring::Shared);
        let now = NOW + ms(1_000);
        receive(&mut node, now, 5, &[entry(5, ENGAGED, 0)], None);
        while next(&mut node, now, ms(400)).is_some() {}
        let now = now + ms(3_000);
        while reported(&mut node, now).is_some() {}
        let now = now + ms(600);
        node.reporting.handle_timeout(now);
        node.report_control(BLIND);
        receive(&mut node, now, 5, &[entry(5, BLIND, 0)], None);
        let (after, report) = next(&mut node, now, ms(5_000)).unwrap();
        assert_eq!((after, &relays(&report)[..]), (ms(0), &[1, 5][..]));
        assert_eq!(next(&mut node, now, ms(300)), None);
    }

    #[test]
    fn the_alarm_of_a_refusal_outlasts_the_end_of_another_alarm() {
        let mut node = watched(1, Wiring::Shared);
        let now = NOW + ms(1_000);
        node.reporting.handle_timeout(now);
        foreign(&mut node, now, 2);
        node.report_control(ENGAGED);
        assert!(node.telemetry_waits() >= ms(6_000));
        let sent = (0..30).find_map(|step| node.next_telemetry(now + ms(10 * step)));
        let Some((_, _, Message::Report(report))) = sent else {
            panic!("{sent:?}");
        };
        let entry = report.entries.first().unwrap();
        assert_eq!((entry.refusal(), entry.control()), (5, ENGAGED));
    }

    #[test]
    fn a_stored_refusal_comes_first_until_it_is_sent() {
        let mut node = watched(1, Wiring::Shared);
        let feed = |node: &mut Node, now, entries: &[Entry]| {
            for entry in entries {
                receive(node, now, 5, &[*entry], None);
            }
        };
        let all = [5, 6, 7, 8].map(|relay| entry(relay, STANDBY, 0));
        feed(&mut node, NOW, &all);
        while next(&mut node, NOW, ms(3_000)).is_some_and(|(after, _)| after < ms(2_000)) {}
        let now = NOW + ms(4_000);
        feed(&mut node, now, &all[..3]);
        feed(&mut node, now, &[entry(8, STANDBY, 1)]);
        feed(&mut node, now + ms(500), &[entry(8, ENGAGED, 1)]);
        let (_, report) = next(&mut node, now + ms(500), ms(3_000)).unwrap();
        let stored = relays(&report).into_iter().find(|relay| *relay != 1);
        assert_eq!(stored, Some(8), "{report:?}");
    }

    /// Checks that the details of an entry that was sent without them are sent once they arrive. An entry is the state
    /// of a relay in a report. The details come with a copy of the entry, through another relay.
    #[test]
    fn details_that_were_not_sent_are_taken_from_a_copy() {
        let mut node = watched(1, Wiring::Shared);
        let detail = Some(Detail::new([Coarse::of(None); 2], [1, 1], 0.0, 7));
        let now = NOW + ms(5_000);
        let entries = [5, 6].map(|relay| entry(relay, ENGAGED, 0));
        receive(&mut node, now, 5, &entries[..1], detail);
        receive(&mut node, now, 6, &entries[1..], None);
        let mut sent = 0;
        for step in 0..40_u8 {
            let now = now + ms(100 * u64::from(step));
            if (1..12).contains(&step) {
                // A copy by another way, which is as old as the entry.
                let mut copied = entries[1];
                copied.age = step;
                receive(&mut node, now, 2, &[copied], detail);
            }
            while let Some(report) = reported(&mut node, now) {
                sent += u8::from(report.detail.is_some() && relays(&report)[0] == 6);
            }
        }
        assert_eq!(sent, 1);
    }

    #[test]
    fn two_nodes_of_another_mission_are_refused_without_a_break() {
        let mut node = watched(3, Wiring::Shared);
        for second in 0..300 {
            let now = NOW + ms(1_000 * second);
            let from = if second % 2 == 0 { 1 } else { 2 };
            foreign(&mut node, now, from);
            assert_eq!(node.refusals(now)[0], if second == 0 { 2 } else { 1 });
        }
        let last = NOW + ms(299_000);
        assert_eq!(node.refusals(last + ms(59_000)), [1, 0]);
        assert_eq!(node.refusals(last + ms(120_000)), [0, 0]);
    }

    /// Checks that only the first refusal of a node with a wrong mission is reported early.
    #[test]
    fn a_refusal_is_an_alarm_once() {
        let mut node = watched(3, Wiring::Shared);
        let mut at: heapless::Vec<u64, 64> = heapless::Vec::new();
        for tenth in 0..1_500 {
            let now = NOW + ms(1_000 + 100 * tenth);
            if tenth < 5 {
                continue;
            }
            foreign(&mut node, now, 2);
            while let Some((_, _, message)) = node.next_telemetry(now) {
                if matches!(message, Message::Report(_)) {
                    at.push(tenth).unwrap();
                }
            }
        }
        // All other reports wait for the first agreement.
        let early = at.windows(2).filter(|pair| pair[1] - pair[0] < 60).count();
        assert!(at[0] < 10 && early == 0, "{at:?}");
    }

    #[test]
    fn refused_nodes_on_both_sides_take_turns_and_stations_are_none() {
        let mut node = watched(2, Wiring::Shared);
        for second in 0..100 {
            foreign(&mut node, NOW + ms(1_000 * second), 0);
            assert_eq!(node.refusals(NOW + ms(1_000 * second)), [0, 0]);
        }
        let mut named = [0_u16; 2];
        for tenth in 0..600_u16 {
            let now = NOW + ms(100_000 + 100 * u64::from(tenth));
            for from in [1, 3] {
                foreign(&mut node, now, from);
            }
            if tenth % 100 == 0 {
                let watch = Message::Watch {
                    number: tenth / 100 + 2,
                    mission: node.member.digest,
                };
                node.on_telemetry(now, Side::Upstream, 0, &watch);
            }
            while let Some(report) = reported(&mut node, now) {
                let entry = report.entries.iter().find(|it| it.relay() == 2);
                match entry.map_or(0, Entry::refusal) {
                    1 => named[0] += 1,
                    5 => named[1] += 1,
                    _ => {}
                }
            }
        }
        assert!(
            named[0] > 5 && named[0].abs_diff(named[1]) <= named[0] / 4,
            "{named:?}"
        );
        // Behind the last relay there is a station, too.
        let mut last = watched(7, Wiring::Shared);
        foreign(&mut last, NOW, 9);
        assert_eq!(last.refusals(NOW), [0, 0]);
        foreign(&mut last, NOW, 8);
        assert_eq!(last.refusals(NOW), [0, 5]);
    }

    #[test]
    fn another_key_is_forgotten_without_further_handshakes() {
        let mut node = watched(3, Wiring::Shared);
        let forge = |node: &mut Node, now, times| {
            (0..times).for_each(|_| node.on_forged(now, Side::Upstream, 2));
        };
        forge(&mut node, NOW, 2);
        assert_eq!(node.refusals(NOW), [0, 0]);
        forge(&mut node, NOW, 1);
        assert_eq!(node.refusals(NOW + ms(59_000)), [9, 0]);
        assert_eq!(node.refusals(NOW + ms(120_000)), [0, 0]);
        for minute in 1..5 {
            let now = NOW + ms(60_000 * minute);
            assert_eq!(node.refusals(now), [9, 0]);
            forge(&mut node, now, 1);
        }
        node.on_key_match(Side::Upstream, 2);
        assert_eq!(node.refusals(NOW + ms(240_000)), [0, 0]);
        // Tx is a ground station.
        (0..3).for_each(|_| node.on_forged(NOW + ms(240_000), Side::Upstream, 0));
        assert_eq!(node.refusals(NOW + ms(240_000)), [0, 0]);
        // A refused mission comes first, then an old epoch.
        forge(&mut node, NOW + ms(250_000), 3);
        node.refuse(NOW + ms(250_000), Side::Upstream, 1, NodeEvent::Epoch);
        assert_eq!(node.refusals(NOW + ms(250_000)), [18, 0]);
        foreign(&mut node, NOW + ms(250_000), 4);
        assert_eq!(node.refusals(NOW + ms(250_000)), [0, 5]);
    }

    /// Checks that an old epoch is reported ahead of the turn, until a new epoch is received.
    #[test]
    fn an_old_epoch_is_reported_at_once_until_a_new_one() {
        let mut node = watched(3, Wiring::Shared);
        let now = NOW + ms(1_000);
        node.reporting.handle_timeout(now);
        for second in 0..300 {
            let now = now + ms(1_000 * second);
            node.refuse(now, Side::Downstream, 5, NodeEvent::Epoch);
            assert_eq!(node.refusals(now), [0, 22]);
            if second == 0 {
                let (after, report) = next(&mut node, now, ms(5_000)).unwrap();
                let own = report.entries.first().unwrap();
                assert_eq!((own.relay(), own.refusal()), (3, 22));
                assert!(after <= ms(160), "{after:?}");
            }
        }
        let last = now + ms(299_000);
        assert_eq!(node.refusals(last + ms(59_000)), [0, 22]);
        node.on_key_match(Side::Downstream, 5);
        assert_eq!(node.refusals(last), [0, 0]);
    }
}
