//! Telemetry: the state of every relay, passed along the chain to a ground station.

use crate::flight::autopilot::state::State;
use crate::guard::HoldReason;
use crate::node::round::state::Phase;
use crate::place::Placement;
use crate::time::Instant;
use crate::wire::CANDIDATES;
use crate::wire::message::{Coarse, Detail, Entry};

/// State that a relay has reported to the ground station through the chain.
///
/// In a field with two values, the first value is for the neighbour toward Tx, the second for the neighbour toward Rx.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Report {
    /// Number of the relay in the mission, from 1 (next to Tx) to N.
    pub relay: u16,
    /// Time at which the relay was in the reported state, on the ground station's clock.
    pub at: Instant,
    /// Position of the drone by its autopilot; `None` if the autopilot has no position.
    pub position: Option<Placement>,
    /// Setpoint of the drone; `None` if the drone has none.
    pub setpoint: Option<Placement>,
    /// Position on which the chain has agreed for this relay; `None` before an agreement.
    pub agreed: Option<Placement>,
    /// Phase of the relay in the agreement on positions.
    pub phase: Phase,
    /// True while the relay has a lease ([`Relay::lease`](crate::Relay::lease)). While it has the lease, it may rely on
    /// the agreed positions.
    pub holds_lease: bool,
    /// Control state of the drone; `None` for a relay without an autopilot link.
    pub control: Option<State>,
    /// Reasons why the drone holds its position. The first is about the neighbour toward Tx, the second about the one
    /// toward Rx.
    pub hold_reasons: [Option<HoldReason>; 2],
    /// Node numbers of the relay's neighbours toward Tx and toward Rx; `None` for no neighbour.
    pub neighbours: [Option<u16>; 2],
    /// Silent neighbours, toward Tx and toward Rx: true if the relay does not receive this neighbour now.
    pub silent: [bool; 2],
    /// True if the relay has recently received a second node with its own number. Recently means within three times the
    /// setting `dead_after`.
    pub is_duplicated: bool,
    /// True while the drone's autopilot flies to a position that is not the setpoint sent by the relay.
    pub refuses_setpoint: bool,
    /// Number of the nearest node with a different mission, which the relay ignores. `None` for none.
    pub other_mission: Option<u16>,
    /// Number of the nearest node whose last handshakes were not made with the relay's key. `None` for none.
    pub other_key: Option<u16>,
    /// Number of the nearest node that has started with an epoch (start counter) not above its last one. The relay
    /// rejects its frames. `None` for none.
    pub old_epoch: Option<u16>,
    /// Interference power last measured at this relay, W, rounded to 0.8 %; `None` if not measured.
    pub interference_w: Option<f32>,
    /// Version of the mission that the relay flies; `None` in a report without *details*.
    ///
    /// Details are the version, `setpoint`, `agreed`, `neighbours` and `interference_w`. A relay sends them only with every
    /// eighth report; see [`Report::update`].
    pub version: Option<u16>,
}

/// Phases in the order of their numbers in a report.
const PHASES: [Phase; 8] = [
    Phase::Idle,
    Phase::Planning,
    Phase::Waiting,
    Phase::Answered,
    Phase::Holding,
    Phase::Infeasible,
    Phase::ViewChange,
    Phase::NoQuorum,
];

/// Control states in the order of their numbers in a report, from 1. The last one is [`Entry::REFUSED`].
const CONTROLS: [State; 6] = [
    State::Silent,
    State::Grounded,
    State::Standby,
    State::Engaged,
    State::Blind,
    State::Engaged,
];

const _: () = assert!(
    State::Silent as u16 + 1 == Entry::SILENT
        && State::Engaged as u16 + 1 == Entry::ENGAGED
        && State::Blind as u16 + 1 == Entry::BLIND
);

/// Hold reasons in the order of their numbers in a report, from 1.
const HOLDS: [HoldReason; 7] = [
    HoldReason::Unheard,
    HoldReason::Order,
    HoldReason::Close,
    HoldReason::Lost,
    HoldReason::NotFlown,
    HoldReason::Pending,
    HoldReason::Halted,
];

/// Returns the number of the node that the relay in `entry` ignores; `None` for none.
///
/// Only one reason is considered: a different mission if `first` is 1, a different key if `first` is 9, an old epoch if
/// `first` is 17. `first` is the lowest code of this reason in the entry.
fn refused(entry: &Entry, first: u16) -> Option<u16> {
    match entry.refusal().checked_sub(first)? {
        toward_tx @ 0..CANDIDATES => entry.relay().checked_sub(toward_tx + 1),
        toward_rx if toward_rx < 2 * CANDIDATES => Some(entry.relay() + toward_rx + 1 - CANDIDATES),
        _ => None,
    }
}

/// Returns the element of `all` with this number, counted from 1; `None` for 0 or a number too large.
fn numbered<T: Copy>(all: &[T], number: u16) -> Option<T> {
    all.get(usize::from(number).checked_sub(1)?).copied()
}

impl Report {
    /// Replaces this report by `newer`, another report of the same relay. If `newer` has no details, those of this report
    /// are kept.
    ///
    /// Returns false, and changes nothing, if `newer` is not newer: copies of a report arrive by several ways. Times of
    /// reports are times of the station's clock, which must not run backward.
    pub fn update(&mut self, newer: Self) -> bool {
        if newer.at <= self.at {
            return false;
        }
        let before = core::mem::replace(self, newer);
        if self.version.is_none() {
            self.setpoint = before.setpoint;
            self.agreed = before.agreed;
            self.neighbours = before.neighbours;
            self.interference_w = before.interference_w;
            self.version = before.version;
        }
        true
    }

    /// Creates the report of one relay from `entry`, its state at the time `at`. `detail` has further values of the
    /// relay; `None` without such values.
    ///
    /// Not part of the public interface: tests and tools of this workspace decode captures with it.
    #[doc(hidden)]
    pub fn of(entry: &Entry, detail: Option<Detail>, at: Instant) -> Self {
        let state = entry.state();
        let digit = |unit: u16| state / unit % 8;
        let control = state / 4096;
        let mut report = Self {
            relay: entry.relay(),
            at,
            position: entry.at.place(),
            setpoint: None,
            agreed: None,
            phase: numbered(&PHASES, digit(1) + 1).unwrap_or(Phase::Idle),
            holds_lease: state / 2048 % 2 == 1,
            control: numbered(&CONTROLS, control % 7),
            hold_reasons: [8, 64].map(|unit| numbered(&HOLDS, digit(unit))),
            neighbours: [None; 2],
            silent: [512, 1024].map(|unit| state / unit % 2 == 1),
            is_duplicated: control >= 7,
            refuses_setpoint: control % 7 == Entry::REFUSED,
            other_mission: refused(entry, 1),
            other_key: refused(entry, 1 + 2 * CANDIDATES),
            old_epoch: refused(entry, 1 + 4 * CANDIDATES),
            interference_w: None,
            version: None,
        };
        if let Some(detail) = detail {
            let [before, after] = detail.neighbours.map(u16::from);
            let [before, after] = [
                report.relay.saturating_sub(before),
                report.relay.saturating_add(after),
            ];
            [report.setpoint, report.agreed] = detail.places.map(Coarse::place);
            report.neighbours =
                [before, after].map(|node| Some(node).filter(|node| *node != report.relay));
            report.interference_w = Some(detail.power_w()).filter(|power_w| *power_w > 0.0);
            report.version = Some(detail.version());
        }
        report
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refused_node_is_named_by_its_number() {
        let refused = |refusal: u16, relay: u16| {
            let entry = Entry::new(relay + 1_000 * refusal, 0, 0, Coarse::of(None));
            let report = Report::of(&entry, None, Instant::ZERO);
            let named = [report.other_mission, report.other_key, report.old_epoch];
            (report.relay, named)
        };
        for relay in [5, 1_000] {
            assert_eq!(refused(0, relay), (relay, [None; 3]));
            for distance in 1..=4 {
                let [before, after] = [relay - distance, relay + distance].map(Some);
                assert_eq!(refused(distance, relay), (relay, [before, None, None]));
                assert_eq!(refused(distance + 4, relay), (relay, [after, None, None]));
                assert_eq!(refused(distance + 8, relay), (relay, [None, before, None]));
                assert_eq!(refused(distance + 12, relay), (relay, [None, after, None]));
                assert_eq!(refused(distance + 16, relay), (relay, [None, None, before]));
                assert_eq!(refused(distance + 20, relay), (relay, [None, None, after]));
            }
        }
        // Decoded reports may name nodes before Tx.
        assert_eq!(refused(4, 3), (3, [None; 3]));
    }

    #[test]
    fn details_stay_until_a_newer_report_has_others() {
        let report = |millis, version: Option<u16>| {
            let places = [1.0, 2.0].map(|x_m| Coarse::of(Some(Placement::on_line(x_m, 20.0))));
            let detail = version.map(|version| Detail::new(places, [1, 2], 0.5, version));
            let entry = Entry::new(2, 0, 0, Coarse::of(None));
            Report::of(&entry, detail, Instant::from_millis(millis))
        };
        let mut known = report(100, None);
        assert_eq!(known.version, None);
        for (millis, version, expected) in [
            (100, Some(7), report(100, None)),
            (101, Some(7), report(101, Some(7))),
            (102, None, report(102, Some(7))),
            (101, Some(8), report(102, Some(7))),
            (103, Some(0), report(103, Some(0))),
        ] {
            let is_newer = known.at < Instant::from_millis(millis);
            assert_eq!(known.update(report(millis, version)), is_newer);
            assert_eq!(known, expected);
        }
        assert_eq!(known.neighbours, [Some(1), Some(4)]);
    }

    #[test]
    fn every_part_of_a_state_is_independent() {
        let report = |state| {
            let entry = Entry::new(2, 0, state, Coarse::of(None));
            Report::of(&entry, None, Instant::ZERO)
        };
        let controls = [
            (None, false),
            (Some(State::Silent), false),
            (Some(State::Grounded), false),
            (Some(State::Standby), false),
            (Some(State::Engaged), false),
            (Some(State::Blind), false),
            (Some(State::Engaged), true),
        ];
        for (number, (control, refuses_setpoint)) in (0..).zip(controls) {
            for (holds_lease, is_duplicated) in
                [(false, false), (true, false), (false, true), (true, true)]
            {
                let rest = 4 + 8 * 2 + 64 * 7 + 1024 + 4096 * number;
                let flags = 2048 * u16::from(holds_lease) + 28_672 * u16::from(is_duplicated);
                let report = report(rest + flags);
                assert_eq!(
                    (report.holds_lease, report.is_duplicated, report.phase),
                    (holds_lease, is_duplicated, Phase::Holding)
                );
                assert_eq!(report.silent, [false, true]);
                assert_eq!(
                    report.hold_reasons,
                    [Some(HoldReason::Order), Some(HoldReason::Halted)]
                );
                assert_eq!(
                    (report.control, report.refuses_setpoint),
                    (control, refuses_setpoint)
                );
            }
        }
    }
}
