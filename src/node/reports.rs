//! Reports of the relays' states, on their way to a ground station that watches.
//!
//! | event | action |
//! | --- | --- |
//! | new Watch received from a side | report toward that side for 60 s; hand the Watch on to the other side |
//! | the same Watch received again | none, but a sender nearer to the station becomes the destination of reports |
//! | Report received from a side, the other side is watched | store its entries; send them with the next report, which is due now |
//! | that Report answers an older Watch | hand the newest Watch on again, at most every second: to the neighbour, or to the sender if it is four numbers away |
//! | first frame of a new session with the relay one number away | hand the Watch of the other side on to it |
//! | own control state, or that in a stored entry, has changed and [begins an alarm](begins_alarm); a node is refused for another mission | send the entry ahead of its turn, also during an agreement |
//! | report due | send the own entry if it is due, and stored ones that fit; for three periods, entries that were sent and not replaced again |
//!
//! On a shared channel a station sends its Watches to the eight nearest relays, which report to it. A Watch is also handed on to the relay
//! four numbers away, repeatedly until that relay reports, unless it sends to the station itself. Every fourth one goes to the neighbour, too. So reports skip relays. Without a destination, or before a handshake with it, reports go to the neighbour. A relay that has sent no frame for 2.5 s is no destination. The time between two reports of a relay is proportional to the first one's
//! length, so that the reports of all relays take less than a tenth of the data rate. Without the feature `telemetry`,
//! `forwarding` takes the place of this file.

use core::num::NonZeroU16;

use heapless::Vec;

use super::context::{Member, OwnState};
use super::neighbour::Neighbours;
use super::neighbour::hearing::{CANDIDATES, mask};
use crate::mission::MAX_RELAYS;
use crate::place::Placement;
use crate::serial_number::is_newer;
use crate::settings::Wiring;
use crate::side::Side;
use crate::time::{Duration, Instant};
use crate::wire::STATION_REACH;
use crate::wire::message::{Coarse, Detail, Entry, Message, Reports};

/// Time for which a relay goes on sending reports after the last Watch that it has received. A Watch is a ground
/// station's request for reports.
const WATCHED: Duration = Duration::from_millis(60_000);

/// Time for which a relay sends its reports to the sender of the last Watch. A Watch is a request for reports. Ten
/// lost Watches in a row do not change this destination.
const DESTINED: Duration = Duration::from_millis(55_000);

/// Time without any frame from a relay after which no more reports are sent to this relay. For a station as the
/// destination of reports, this time is three times as long.
const UNHEARD: Duration = Duration::from_millis(2_500);

/// Time without a report from a relay after which the Watch to it (request for reports) is repeated.
const UNCONFIRMED: Duration = Duration::from_millis(3000);

/// Maximum number of times that the interval between repetitions of a Watch doubles. A Watch is a request for
/// reports.
const MOST_DOUBLINGS: u8 = 3;

/// Value of `Watched::unconfirmed` while the far relay sends its reports directly to the station. The far relay has a
/// node number four farther from the station than this relay.
const DIRECT: u8 = MOST_DOUBLINGS + 1;

/// Minimum time between two repetitions of a Watch to relays that have not received it. A Watch is a request for
/// reports.
const REPEAT_AFTER: Duration = Duration::from_millis(1_000);

/// Time by which a report that begins an alarm may be sent earlier than other reports. Those wait until the telemetry's
/// share of the data rate allows them.
const AHEAD: Duration = Duration::from_millis(2_000);

/// Minimum time from one state that a relay reports about itself to the next one. It is longer than [`ROUNDING`], so
/// that the next state is not taken for a copy of the previous one.
const STEP: Duration = Duration::from_millis(500);

/// Maximum time difference of two copies of an entry that came through different relays. An entry is the state of a
/// relay in a report. The copies differ because each relay rounds the age of an entry.
const ROUNDING: Duration = Duration::from_millis(300);

/// Extra delay of an alarm from each relay to the next one nearer to the station, on a shared channel. If all drones
/// have the same fault, the relays farther from the station thus report first.
const SPREAD: Duration = Duration::from_millis(30);

/// Age above which a position of the drone counts as unknown.
const OLD: Duration = Duration::from_millis(2_000);

/// Minimum time between two reports of a relay.
const LEAST_PERIOD: Duration = Duration::from_millis(500);

/// Age from which an entry (relay's state in a report) is no longer forwarded. The largest age in a message, 25.5 s,
/// also stands for any larger age.
const OLDEST: Duration = Duration::from_millis(25_000);

/// Number of entries (states of other relays) that a relay stores until it forwards them.
const STORED: usize = 16;

/// Length of a report without its entries, including frame and tag, bytes.
const FRAME: u32 = 32;

/// Assumed length of an entry (relay's state) in a report, bytes. It includes a part of the report's frame, and a part
/// of the details (additional state of one relay).
const SHARE: u32 = 24;

/// Reports of this relay, and the reports of other relays that it forwards to a ground station.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reporting {
    /// Last position of the drone and the time of its measurement; `None` if unknown.
    position: Option<(Instant, Placement)>,
    /// Control state of the drone, as numbered in reports; 0 without an autopilot.
    control: u16,
    /// Last measured interference, W; 0 without a measurement.
    power_w: f32,
    /// Time of the state that this relay last reported about itself.
    reported: Instant,
    stored: Vec<Stored, STORED>,
    watched: [Watched; 2],
    /// Time of the last call of `handle_timeout`. Timers that were due at that time are left out of the next timeout.
    checked: Instant,
}

/// Entry (state of another relay) that this relay has received and forwards.
#[derive(Clone, Debug)]
struct Stored {
    entry: Entry,
    detail: Option<Detail>,
    /// Time at which the relay was in the state of this entry.
    at: Instant,
    /// Earliest time at which the entry may be sent, or sent again. Each transmission moves this time to one period
    /// later. By then a newer entry has usually replaced this entry.
    from: Instant,
    rank: Rank,
}

/// Order in which stored entries (relays' states) are sent: `Alarm`, `New`, `Sent`, `Detailed`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Rank {
    /// The entry was sent with its details (additional state of the relay). The details are not sent again, even if a
    /// copy of the entry with details arrives through a different relay.
    Detailed,
    /// The entry was sent without details.
    Sent,
    New,
    /// The entry was not sent yet, and begins an alarm.
    Alarm,
}

/// State of this relay's reports toward one side, where a ground station has requested them.
#[derive(Clone, Copy, Debug, Default)]
struct Watched {
    number: u16,
    until: Instant,
    /// Node to which reports are sent until the time `to_until`; `None` for the neighbour.
    to: Option<u16>,
    to_until: Instant,
    /// Time of the last frame from node `to`, whatever the destination of the frame.
    heard: Instant,
    /// Number of the last Watch received from the relay four node numbers nearer to the station. A Watch is a request
    /// for reports.
    far_number: u16,
    /// Nodes to which the Watch (request for reports) must be forwarded at the time `hand_on_at`. A bit mask of their
    /// distances from this relay.
    hand_on: u8,
    hand_on_at: Instant,
    /// Time of the last report of the far relay, or of the last frame of that relay to the station. The far relay has a
    /// node number four farther from the station than this relay.
    ///
    /// `unconfirmed` is `DIRECT` after a frame to the station. Otherwise it counts the Watches (requests for reports)
    /// sent to the far relay since the time `confirmed`.
    confirmed: Instant,
    unconfirmed: u8,
    /// Node to which a handshake must be sent that requests a reply; `None` if there is none.
    to_greet: Option<NonZeroU16>,
    /// Time at which the next report must be sent. Unless it begins an alarm, it is sent no earlier than `free`.
    due: Instant,
    /// Time from which the telemetry's share of the data rate allows a report.
    free: Instant,
    /// Time from which this relay's own entry (its state) is part of a report.
    own_from: Instant,
    /// Number of entries that this relay has sent about itself, wrapping.
    count: u8,
    /// True if entries (states of other relays) have arrived since this relay's last report.
    is_fed: bool,
    /// True if a change of this relay's state begins an alarm that has not been reported.
    is_alarmed: bool,
    /// True if a stored entry (state of another relay) begins an alarm and has not been sent.
    stores_alarm: bool,
}

impl Reporting {
    pub(crate) fn handle_position(&mut self, at: Instant, place: Placement) {
        self.position = Some((at, place));
    }

    pub(crate) fn handle_measured(&mut self, power_w: f32) {
        self.power_w = power_w;
    }

    /// Records the drone's control state. A change is reported as soon as the telemetry's share of the data rate
    /// allows it. The beginning of an alarm is reported earlier.
    pub(crate) fn handle_control(&mut self, member: &Member, control: u16) {
        let before = core::mem::replace(&mut self.control, control);
        if before == control {
            return;
        }
        self.schedule(member, begins_alarm(before, control));
    }

    /// Schedules this relay's entry (its state in a report), because its state has changed. `begins` is true if the
    /// change begins an alarm.
    pub(crate) fn schedule(&mut self, member: &Member, begins: bool) {
        let is_spread = begins && matches!(member.settings.wiring, Wiring::Shared);
        let sides = [Side::Upstream, Side::Downstream];
        for (watched, side) in self.watched.iter_mut().zip(sides) {
            let mut from = self.checked;
            if watched.is_alarmed {
                // Further changes do not delay the alarm.
                from = watched.own_from;
            } else if is_spread {
                // If all drones have the same fault, the relays farther from the station report first.
                let behind = member.all.saturating_sub(member.relays_to_end(side)) % 8;
                from = from + SPREAD.times(behind.into());
            }
            from = from.max(self.reported + STEP);
            (watched.due, watched.own_from) = (watched.due.min(from), from);
            watched.is_alarmed |= begins;
        }
    }

    /// Records that a frame of node `from` to node `to` was received.
    pub(crate) fn handle_frame(&mut self, now: Instant, member: &Member, from: u16, to: u16) {
        let sides = [Side::Upstream, Side::Downstream];
        for (watched, side) in self.watched.iter_mut().zip(sides) {
            if watched.to == Some(from) {
                watched.heard = now;
            }
            // The relay four numbers farther from the station reports to the station itself.
            if from == member.beyond(side.other(), CANDIDATES) && to == member.station(side) {
                (watched.confirmed, watched.unconfirmed) = (now, DIRECT);
            }
        }
    }

    /// Schedules a Watch (request for reports) for node `from` at `side`. The node could not verify an earlier Watch.
    pub(crate) fn handle_session(&mut self, now: Instant, member: &Member, side: Side, from: u16) {
        let distance = from.abs_diff(member.node);
        let watched = self.at(side.other());
        if watched.until > Instant::ZERO && distance == 1 {
            watched.hand_on |= mask(1);
            watched.hand_on_at = now;
        }
    }

    /// Handles a Watch (request for reports) or a Report from node `from` at `side`. Returns false if the report has
    /// the state of a relay whose reports cannot come through node `from`.
    pub(crate) fn handle(
        &mut self,
        now: Instant,
        member: &Member,
        (side, from): (Side, u16),
        message: &Message,
    ) -> bool {
        match message {
            Message::Watch { number, .. } => self.on_watch(now, member, (side, from), *number),
            Message::Report(report) => return self.on_report(now, member, (side, from), report),
            _ => {}
        }
        true
    }

    /// Returns the next Watch (request for reports) or Report, with its side and its destination. `None` if none is
    /// due. During an agreement on positions the message is delayed by `wait`, because the agreement needs the
    /// channel.
    pub(crate) fn poll(
        &mut self,
        now: Instant,
        member: &Member,
        neighbours: &Neighbours,
        wait: Duration,
        own: OwnState,
    ) -> Option<(Side, u16, Message)> {
        for side in [Side::Upstream, Side::Downstream] {
            let watched = self.at(side);
            watched.expire(now, member);
            while watched.hand_on != 0 && now >= watched.hand_on_at + wait {
                let distance = if watched.hand_on & 1 != 0 {
                    1
                } else {
                    CANDIDATES
                };
                let number = watched.number;
                watched.hand_on &= !mask(distance);
                let away = side.other();
                let to = if distance == 1 {
                    neighbours.at(away).node()
                } else {
                    member.beyond(away, distance)
                };
                if member.is_relay(to) {
                    let mission = member.digest;
                    if distance == CANDIDATES && now >= watched.confirmed + UNCONFIRMED {
                        // It may have restarted: then it accepts only handshakes.
                        watched.to_greet = NonZeroU16::new(to).filter(|_| watched.unconfirmed > 0);
                        watched.hand_on |= mask(CANDIDATES);
                        watched.hand_on_at = now + REPEAT_AFTER.times(1 << watched.unconfirmed);
                        watched.unconfirmed = (watched.unconfirmed + 1).min(MOST_DOUBLINGS);
                    }
                    return Some((away, to, Message::Watch { number, mission }));
                }
            }
            if watched.report_at(wait).is_some_and(|at| now >= at)
                && let Some(to) = watched.to.or_else(|| neighbours.next(member, side))
                && let Some(report) = self.report(now, member, neighbours, side, own)
            {
                return Some((side, to, Message::Report(report)));
            }
        }
        // What is due without a destination waits for the next event.
        self.checked = now;
        None
    }

    /// Returns the next node to which a handshake must be sent that requests a reply. `None` if there is none.
    pub(crate) fn poll_greeting(&mut self) -> Option<u16> {
        let mut watched = self.watched.iter_mut();
        watched.find_map(|watched| watched.to_greet.take().map(NonZeroU16::get))
    }

    /// Records that the relay's timers have been handled up to `now`.
    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        self.checked = now;
    }

    /// Returns true if a Watch (request for reports) or a Report may be due at `now`.
    pub(crate) fn is_due(&self, now: Instant, wait: Duration) -> bool {
        self.times(wait).any(|at| at <= now)
    }

    /// Returns the time of the next Watch (request for reports) or Report; `None` if there is none.
    pub(crate) fn next_timeout(&self, wait: Duration) -> Option<Instant> {
        self.times(wait).filter(|at| *at > self.checked).min()
    }

    /// Returns the times at which a Watch (request for reports) or a Report is due.
    fn times(&self, wait: Duration) -> impl Iterator<Item = Instant> {
        let times = self.watched.iter().flat_map(move |watched| {
            let hand_on = (watched.hand_on != 0).then(|| watched.hand_on_at + wait);
            [watched.report_at(wait), hand_on]
        });
        times.flatten()
    }
}

/// Returns the time `span` before `at`, at least 0.
const fn earlier(at: Instant, span: Duration) -> Instant {
    Instant::from_micros(at.as_micros().saturating_sub(span.as_micros()))
}

/// Returns true if the change of the control state from `before` to `now` begins an alarm. Each state is a number
/// from 1; 0 stands for unknown.
///
/// An alarm begins if the autopilot is no longer received, has no position any more, or flies to another target, or if
/// the relay no longer controls the drone.
const fn begins_alarm(before: u16, now: u16) -> bool {
    let is_fault = now == Entry::SILENT || now == Entry::BLIND || now == Entry::REFUSED;
    let is_released = before == Entry::ENGAGED || before == Entry::REFUSED && now != Entry::ENGAGED;
    before != now && before != 0 && (is_fault || is_released)
}

impl Watched {
    /// Ends the reports 60 s after the last request for them, and drops silent destinations.
    ///
    /// A destination is dropped if it has sent no request for 55 s, or no frame for 2.5 s (a relay) or 7.5 s (a
    /// station).
    fn expire(&mut self, now: Instant, member: &Member) {
        let is_relay = self.to.is_some_and(|to| member.is_relay(to));
        let is_unheard = now >= self.heard + UNHEARD.times(if is_relay { 1 } else { 3 });
        if now >= self.until {
            *self = Self::default();
        } else if now >= self.to_until || is_unheard {
            self.to = None;
        }
    }

    /// Returns the time of the next report; `None` while no ground station requests reports. A report is delayed by
    /// `wait`, unless it begins an alarm.
    fn report_at(&self, wait: Duration) -> Option<Instant> {
        let mut at = self.due.max(self.free) + wait;
        let ahead = earlier(self.free, AHEAD);
        if self.is_alarmed {
            at = at.min(ahead.max(self.own_from));
        }
        if self.stores_alarm {
            at = at.min(ahead);
        }
        (self.until > Instant::ZERO).then_some(at)
    }
}

impl Reporting {
    const fn at(&mut self, side: Side) -> &mut Watched {
        let [upstream, downstream] = &mut self.watched;
        match side {
            Side::Upstream => upstream,
            Side::Downstream => downstream,
        }
    }

    fn on_watch(&mut self, now: Instant, member: &Member, (side, from): (Side, u16), number: u16) {
        let watched = self.at(side);
        watched.expire(now, member);
        let begins = watched.until == Instant::ZERO;
        let is_next = begins || is_newer(number, watched.number);
        if begins {
            watched.due = now;
            watched.own_from = now;
            watched.count = 0;
        }
        if is_next {
            watched.number = number;
            watched.until = now + WATCHED;
            // The station sends to several relays at once.
            let turn = Duration::from_millis(50).times(u32::from(member.node % 8) + 2);
            watched.hand_on_at = now + turn;
            let is_pair = member.settings.wiring == Wiring::Pair;
            if is_pair || begins || number.is_multiple_of(4) {
                watched.hand_on |= mask(1);
            }
            let is_direct = watched.unconfirmed == DIRECT && now < watched.confirmed + UNCONFIRMED;
            if !is_pair && !is_direct {
                watched.hand_on |= mask(CANDIDATES);
            }
        } else if number != watched.number {
            return;
        }
        let distance = |node: u16| node.abs_diff(member.node);
        if distance(from) == CANDIDATES
            && core::mem::replace(&mut watched.far_number, number) == number
            && !begins
        {
            return; // That relay repeats it, because it does not receive this relay's reports.
        }
        if watched.to.is_none_or(|to| distance(from) >= distance(to)) {
            watched.to = Some(from);
            watched.to_until = now + DESTINED;
            watched.heard = now;
        }
    }

    fn on_report(
        &mut self,
        now: Instant,
        member: &Member,
        (side, from): (Side, u16),
        report: &Reports,
    ) -> bool {
        let is_behind = |relay: u16| match side {
            Side::Upstream => relay <= from,
            Side::Downstream => relay >= from && relay <= member.all,
        };
        if !report.entries.iter().all(|entry| is_behind(entry.relay())) {
            return false;
        }
        let watched = self.at(side.other());
        watched.expire(now, member);
        if watched.until == Instant::ZERO {
            return true;
        }
        if from.abs_diff(member.node) == CANDIDATES {
            (watched.confirmed, watched.unconfirmed) = (now, 0);
        }
        if is_newer(watched.number, report.number()) && now >= watched.hand_on_at + REPEAT_AFTER {
            watched.hand_on_at = now;
            let is_far = from.abs_diff(member.node) == CANDIDATES;
            watched.hand_on |= mask(if is_far { CANDIDATES } else { 1 });
        }
        // A report that waits for an agreement waits no longer for it.
        watched.due = watched.due.min(now);
        watched.is_fed = true;
        let mut detail = report.detail;
        for entry in &report.entries {
            let detail = detail.take();
            if let Some(at) = entry.time(now) {
                let is_alarm = self.store(now, *entry, detail, at);
                self.at(side.other()).stores_alarm |= is_alarm;
            }
        }
        true
    }

    /// Stores an entry if it is newer than the stored entry of the same relay. If the store is full, the new entry
    /// replaces another one: the oldest entry that was already sent, else the oldest entry that begins no alarm. If all
    /// stored entries begin an alarm, the new entry is dropped. Returns true if the entry begins an alarm.
    fn store(&mut self, now: Instant, entry: Entry, detail: Option<Detail>, at: Instant) -> bool {
        let mut stored = Stored {
            entry,
            detail,
            at,
            from: now,
            rank: Rank::New,
        };
        let mut all = self.stored.iter_mut();
        if let Some(old) = all.find(|old| old.entry.relay() == entry.relay()) {
            if at > old.at + ROUNDING {
                let [was, is] = [old.entry, entry].map(|entry| entry.control());
                let is_refusal = old.entry.refusal() == 0 && entry.refusal() > 0;
                let begins = begins_alarm(was, is) || is_refusal;
                stored.rank = if begins {
                    Rank::Alarm
                } else {
                    Rank::New.max(old.rank)
                };
                stored.detail = detail.or(old.detail);
                *old = stored;
                return begins;
            } else if old.detail.is_none() && old.rank > Rank::Detailed {
                old.detail = detail;
            }
        } else if let Err(stored) = self.stored.push(stored) {
            let worst = self.stored.iter_mut().min_by_key(|old| (old.rank, old.at));
            if let Some(worst) = worst
                && worst.rank <= stored.rank
            {
                *worst = stored;
            }
        }
        false
    }

    /// Returns the report toward `side` that is due now; `None` if there is nothing to report.
    fn report(
        &mut self,
        now: Instant,
        member: &Member,
        neighbours: &Neighbours,
        side: Side,
        own: OwnState,
    ) -> Option<Reports> {
        let (period, byte) = self.rate(now, member, side);
        let reported = self.reported;
        let (power_w, watched) = (self.power_w, self.at(side));
        let mut report = Reports::new(watched.number, member.digest);
        // An alarm of this relay is part of a report about others, even before its turn.
        let is_due = now >= watched.own_from || watched.is_alarmed && now >= reported + STEP;
        if is_due {
            let entry = self.own_entry(now, member, side, own);
            _ = report.entries.push(entry);
        }
        let is_left = self.add_stored(now, member, side, period, &mut report);
        let watched = self.at(side);
        if is_due && watched.count.is_multiple_of(8) && report.detail.is_none() {
            let distance = |node: u16| u8::try_from(node.abs_diff(member.node)).unwrap_or(0);
            let nodes = neighbours.nodes().map(|node| node.map_or(0, distance));
            let places = [own.setpoint, own.agreed].map(Coarse::of);
            report.detail = Some(Detail::new(places, nodes, power_w, member.active.version));
            watched.count = 1;
        } else if is_due && !watched.count.is_multiple_of(8) {
            watched.count += 1;
        }
        self.schedule_next(
            now,
            member,
            side,
            (period, byte),
            (is_due, is_left),
            &report,
        );
        (!report.entries.is_empty()).then_some(report)
    }

    /// Returns this relay's entry for a report toward `side`, and records the time of the state in it.
    fn own_entry(&mut self, now: Instant, member: &Member, side: Side, own: OwnState) -> Entry {
        let position = self.position.filter(|(at, _)| now.since(*at) < OLD);
        let at = Coarse::of(position.map(|(_, place)| place));
        // A position from before the last entry would not count as newer than that entry.
        let state_at = position.map_or(now, |(at, _)| at);
        self.reported = state_at.max(self.reported + STEP).min(now);
        let age = age(now, self.reported);
        // An entry has room for one node.
        let [before, after] = own.refusals;
        let is_turn = after == 0 || self.at(side).count.is_multiple_of(2);
        let refusal = if before != 0 && is_turn {
            before
        } else {
            after
        };
        let relay = member.node + MAX_RELAYS * refusal;
        Entry::new(relay, age, own.state + 4096 * self.control, at)
    }

    /// Adds the stored entries that fit to a report toward `side`, the most urgent first. Returns true if one that was
    /// not sent yet is left.
    fn add_stored(
        &mut self,
        now: Instant,
        member: &Member,
        side: Side,
        period: Duration,
        report: &mut Reports,
    ) -> bool {
        self.stored.retain(|stored| {
            let age = now.since(stored.at);
            age < OLDEST && (stored.rank > Rank::Sent || age < period.times(3))
        });
        let (mut is_left, mut stores_alarm) = (false, false);
        for rank in [Rank::Alarm, Rank::New, Rank::Sent, Rank::Detailed] {
            for stored in &mut self.stored {
                let is_toward = (stored.entry.relay() > member.node) == (side == Side::Upstream);
                if stored.rank != rank || !is_toward || now < stored.from {
                    continue;
                }
                stored.entry.age = age(now, stored.at);
                if report.entries.push(stored.entry).is_err() {
                    is_left |= rank > Rank::Sent;
                    stores_alarm |= rank == Rank::Alarm;
                    continue;
                }
                stored.rank = stored.rank.min(Rank::Sent);
                if report.detail.is_none() && stored.detail.is_some() {
                    stored.rank = Rank::Detailed;
                    report.detail = stored.detail.take();
                    if let [first, .., last] = report.entries.as_mut_slice() {
                        core::mem::swap(first, last);
                    }
                }
                stored.from = now + period;
            }
        }
        self.at(side).stores_alarm = stores_alarm;
        is_left
    }

    /// Schedules the next report toward `side` after `report`, by its [`rate`](Self::rate). `is_due` is true if the
    /// report has this relay's entry, `is_left` if stored entries did not fit.
    fn schedule_next(
        &mut self,
        now: Instant,
        member: &Member,
        side: Side,
        (period, byte): (Duration, Duration),
        (is_due, is_left): (bool, bool),
        report: &Reports,
    ) {
        let changed_from = self.reported + STEP;
        let watched = self.at(side);
        let entries = u32::try_from(report.entries.len()).unwrap_or(0);
        let detail = report.detail.map_or(0, |_| SHARE);
        let half = micros(period) / 2;
        // On a shared channel half a period's share may be sent at once. On wires that would overflow the stores of relays nearer to the station.
        let saved = match member.settings.wiring {
            Wiring::Pair => now,
            Wiring::Shared => earlier(now, Duration::from_micros(half.into())),
        };
        if entries > 0 {
            watched.free = watched.free.max(saved) + byte.times(FRAME + 14 * entries + detail);
        }
        let late = Duration::from_micros((half / 4).into());
        if is_due {
            watched.own_from = now + late.times(6).max(STEP);
            watched.is_alarmed = false;
        }
        watched.due = match (is_left, watched.is_fed) {
            (true, _) => now,
            // The reports of relays behind come first.
            (false, true) => now + period + late,
            (false, false) => {
                now + period
                    + Duration::from_micros(late.as_micros() / 8)
                        .times((5 * u32::from(member.node) + 3 * u32::from(watched.count)) & 7)
            }
        };
        if !is_due && watched.own_from <= changed_from {
            // This relay's state has changed, and is not yet in a report.
            watched.due = watched.due.min(watched.own_from);
        }
        watched.is_fed = false;
    }

    /// Returns the time from one report to the next, for each byte of the first one. With this time the reports of all
    /// relays take an eleventh of the data rate.
    ///
    /// The data rate is assumed to be one sweep in each `hop_time`. On a shared channel it is also at least 2350 bytes
    /// for each relay in each `probe_after`, see [`ChannelLoad`](crate::ChannelLoad). The reports use a tenth of these
    /// bytes, divided among the relays in proportion to their loads. On wires the time is that of the relay nearest to
    /// the station, because this relay has the most to send.
    fn rate(&self, now: Instant, member: &Member, side: Side) -> (Duration, Duration) {
        let settings = &member.settings;
        let hop = (settings.hop_time.as_micros() * 108 / 1_200).clamp(1, 1 << 24);
        let relays = u32::from(member.all);
        let wires = 28 * (relays + 1); // an eighth is in reserve
        let (own, all, byte) = match settings.wiring {
            Wiring::Pair => (wires, wires, hop),
            Wiring::Shared => {
                let most = micros(settings.probe_after) / (235 * relays).max(1);
                let own = load(member, member.relays_to_end(side));
                (own, all_loads(member), hop.min(most.into()))
            }
        };
        let is_both = self.watched.iter().all(|watched| now < watched.until);
        let byte = if is_both { byte * 5 / 2 } else { byte };
        let period = u64::from(all) * byte;
        let byte = Duration::from_micros(period / u64::from(own.max(1)));
        (Duration::from_micros(period).max(LEAST_PERIOD), byte)
    }
}

fn micros(span: Duration) -> u32 {
    u32::try_from(span.as_micros()).unwrap_or(u32::MAX)
}

/// Returns the number of bytes that a relay is assumed to report in each period. `distance` is the difference between
/// its number and the station's number.
///
/// These bytes are the relay's own entry (its state), and the entries of the relays that are 8, 16, 24 and so on
/// numbers farther from the station.
const fn load(member: &Member, distance: u16) -> u32 {
    let behind = member.all.saturating_sub(distance) / STATION_REACH;
    SHARE * (behind as u32 + 2)
}

/// Returns the sum of [`load`] over all distances, 1 to N.
const fn all_loads(member: &Member) -> u32 {
    let all = member.all as u32;
    let (eights, rest) = (all / 8, all % 8);
    SHARE * (2 * all + 4 * eights * eights.saturating_sub(1) + rest * eights)
}

/// Returns the age at `now` of a state that existed at the time `at`, in tenths of a second, rounded. The age includes
/// 20 ms for the transmission.
fn age(now: Instant, at: Instant) -> u8 {
    let tenths = micros(now.since(at)).saturating_add(70_000) / 100_000;
    u8::try_from(tenths).unwrap_or(u8::MAX)
}
