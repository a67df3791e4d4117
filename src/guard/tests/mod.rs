//! Tests of the guard's rules. The tests pass the messages.

use crate::guard::config::{Geofence, GuardConfig};
use crate::guard::own::{Own, ReachableInterval};
use crate::guard::{Fence, Guard, HoldReason};
use crate::place::Placement;
use crate::side::Side;
use crate::time::{Duration, Instant};

mod halted;
mod released;

const APART: f32 = 10.0;

pub(crate) fn config() -> GuardConfig {
    GuardConfig {
        geofence: Geofence {
            least_x_m: 0.0,
            most_x_m: 1000.0,
            least_y_m: -50.0,
            most_y_m: 50.0,
            least_altitude_m: 20.0,
            most_altitude_m: 120.0,
        },
        separation_m: APART,
        relays: 12,
        hover_m: 0.0,
        lag: Duration::from_millis(200),
    }
}

fn at(x_m: f32) -> Placement {
    Placement::on_line(x_m, 50.0)
}

/// Returns a neighbour's first message, at `x_m`, with the agreed x `target_m`. The neighbour does not know the
/// association number of the relay under test yet.
fn fence(association: u16, x_m: f32, target_m: f32) -> Fence {
    Fence {
        association,
        echo: 0,
        number: 0,
        x_m,
        target_m,
        across: at(0.0).cross_section(),
        apart_m: APART,
        flags: 0,
    }
}

/// Guard of one relay under test, and the time of the test.
struct One {
    guard: Guard,
    now: Instant,
}

impl One {
    fn new(neighbours: [Option<u16>; 2], x_m: f32, target_m: f32) -> Self {
        let mut one = Self {
            guard: Guard::new(config(), neighbours, 7, Instant::ZERO),
            now: Instant::ZERO,
        };
        one.guard.set_goal(at(target_m));
        one.is_at(x_m);
        one.is_at(x_m);
        one
    }

    /// Reports the x `x_m` to the guard, 1 s after the previous report.
    fn is_at(&mut self, x_m: f32) {
        self.now = self.now + Duration::from_millis(1000);
        self.guard.position(self.now, at(x_m));
        let _ = self.guard.steer(self.now);
    }

    fn setpoint(&mut self) -> f32 {
        self.guard.steer(self.now).unwrap().x_m
    }

    fn sent(&mut self, side: Side) -> Fence {
        self.guard.steer(self.now);
        self.guard.follower.association.due = true;
        self.guard.owner.association.due = true;
        let mut sent = None;
        while let Some((to, _, fence)) = self.guard.poll() {
            if to == side {
                sent = Some(fence);
            }
        }
        sent.unwrap()
    }

    fn receive(&mut self, side: Side, from: u16, fence: Fence) {
        self.guard.handle_fence(side, from, &fence);
        self.guard.steer(self.now);
    }
}

#[test]
fn a_guard_is_at_most_432_bytes() {
    assert!(size_of::<Guard>() <= 432, "{}", size_of::<Guard>());
    assert_eq!(size_of::<Fence>(), 28);
}

#[test]
fn no_setpoint_before_an_agreed_position_and_a_report() {
    let mut guard = Guard::new(config(), [None, None], 7, Instant::from_millis(1000));
    let now = Instant::from_millis(2000);
    assert_eq!(guard.steer(now), None);
    guard.set_goal(at(300.0));
    assert_eq!(guard.steer(now), None);
    guard.position(Instant::from_millis(999), at(100.0));
    assert_eq!(guard.steer(now), None, "that was before the start");
    guard.position(now, at(-5_001.0));
    assert_eq!(guard.steer(now), None, "that is too far outside the box");
    guard.position(now, at(100.0));
    assert_eq!(guard.steer(now), Some(at(100.0)), "it holds first");
    assert_eq!(guard.steer(now), Some(at(300.0)), "it is alone");
}

#[test]
fn setpoints_stay_in_the_geofence_and_bad_input_is_counted() {
    let mut one = One::new([None, None], 100.0, 100.0);
    let far = Placement {
        x_m: 5000.0,
        y_m: -60.0,
        altitude_m: 1.0,
    };
    one.guard.set_goal(far);
    let cut = Placement {
        x_m: 1000.0,
        y_m: -50.0,
        altitude_m: 20.0,
    };
    assert_eq!(one.guard.steer(one.now), Some(cut));
    one.guard.set_goal(at(f32::NAN));
    one.guard.position(one.now, at(f32::INFINITY));
    one.guard
        .handle_fence(Side::Upstream, 1, &fence(1, 2e7, 0.0));
    assert_eq!(one.guard.refused(), 3);
    assert_eq!(one.guard.steer(one.now), Some(cut));
}

/// Checks rule 1 of the guard: a relay stays beyond its upstream neighbour's fence. This holds even if the
/// downstream neighbour started too close to the relay.
#[test]
fn a_relay_between_two_fences_keeps_its_promise() {
    let mut one = One::new([Some(1), Some(3)], 100.0, 100.0);
    for side in [Side::Downstream, Side::Upstream] {
        let handshake = fence(9, 0.0, 0.0);
        let from = if side == Side::Upstream { 1 } else { 3 };
        one.receive(side, from, handshake);
        let said = one.sent(side);
        let answer = Fence {
            echo: said.association,
            number: u16::from(side == Side::Upstream),
            x_m: if side == Side::Upstream { 98.0 } else { 104.0 },
            ..handshake
        };
        one.receive(side, from, answer);
    }
    assert_eq!(
        one.setpoint().to_bits(),
        98.0_f32.to_bits(),
        "94 would be clear of relay 3"
    );
}

/// Checks rule 9 of the guard: a relay stays the separation away from a lost neighbour's last position.
#[test]
fn a_lost_relay_is_kept_clear_of() {
    let mut one = One::new([None, Some(2)], 100.0, 400.0);
    let mut lost = One::new([Some(1), None], 300.0, 300.0);
    for _ in 0..4 {
        lost.receive(Side::Upstream, 1, one.sent(Side::Downstream));
        one.receive(Side::Downstream, 2, lost.sent(Side::Upstream));
    }
    assert_eq!(one.setpoint().to_bits(), 290.0_f32.to_bits());
    one.guard.set_neighbour(Side::Downstream, None);
    assert_eq!(one.setpoint().to_bits(), 290.0_f32.to_bits());
    assert_eq!(
        one.guard.hold_reason(Side::Downstream),
        Some(HoldReason::Lost)
    );
    one.guard.forget(Side::Downstream, false);
    assert_eq!(one.setpoint().to_bits(), 400.0_f32.to_bits());

    lost.guard.set_goal(at(50.0));
    let least = lost.setpoint();
    assert!(least >= 300.0 - 200.0);
    lost.guard.set_neighbour(Side::Upstream, None);
    assert_eq!(lost.setpoint().to_bits(), least.to_bits());
    lost.guard.forget(Side::Upstream, false);
    assert_eq!(lost.setpoint().to_bits(), 50.0_f32.to_bits());
}

/// Checks rule 9: a relay that joins on the wrong side of a lost drone holds its position.
///
/// Otherwise it could fly through the drone, of which it knows nothing.
#[test]
fn a_relay_on_the_wrong_side_of_a_lost_drone_does_not_join() {
    // Relay 3 is lost at 300 m: relay 2 joins between relay 1 and it.
    for (x_m, joins) in [(320.0, false), (301.0, false), (299.0, true), (250.0, true)] {
        let mut one = One::new([None, Some(3)], 100.0, 400.0);
        let mut lost = One::new([Some(1), None], 300.0, 300.0);
        for _ in 0..4 {
            lost.receive(Side::Upstream, 1, one.sent(Side::Downstream));
            one.receive(Side::Downstream, 3, lost.sent(Side::Upstream));
        }
        assert_eq!(one.setpoint().to_bits(), 290.0_f32.to_bits());
        one.guard.set_goal(at(100.0));
        one.setpoint();
        one.is_at(100.0);
        one.is_at(100.0);
        one.guard.set_neighbour(Side::Downstream, None);
        let mut fresh = One::new([Some(1), None], x_m, 200.0);
        one.guard.set_neighbour(Side::Downstream, Some(2));
        let mut talk = |one: &mut One| {
            for _ in 0..4 {
                fresh.receive(Side::Upstream, 1, one.sent(Side::Downstream));
                one.receive(Side::Downstream, 2, fresh.sent(Side::Upstream));
            }
            fresh.setpoint()
        };
        let expected_m = if joins { 200.0 } else { x_m };
        assert_eq!(talk(&mut one).to_bits(), expected_m.to_bits(), "{x_m}");
        assert_eq!(one.guard.has_lost(Side::Downstream), !joins);
        let reason = one.guard.hold_reason(Side::Downstream);
        assert_eq!(reason, (!joins).then_some(HoldReason::Lost), "{x_m}");
        one.guard.forget(Side::Downstream, false);
        assert_eq!(talk(&mut one).to_bits(), 200.0_f32.to_bits(), "{x_m}");
    }
    // Relay 3 has arrived at 300 m, far beyond its fence, when it is lost: relay 2 is on the right side.
    let mut one = One::new([None, Some(3)], 100.0, 100.0);
    let mut lost = One::new([Some(1), None], 300.0, 300.0);
    for _ in 0..4 {
        lost.receive(Side::Upstream, 1, one.sent(Side::Downstream));
        one.receive(Side::Downstream, 3, lost.sent(Side::Upstream));
    }
    one.guard.set_neighbour(Side::Downstream, Some(4));
    one.guard.set_neighbour(Side::Downstream, Some(2));
    let mut fresh = One::new([Some(1), None], 240.0, 200.0);
    for _ in 0..4 {
        fresh.receive(Side::Upstream, 1, one.sent(Side::Downstream));
        one.receive(Side::Downstream, 2, fresh.sent(Side::Upstream));
    }
    assert_eq!(fresh.setpoint().to_bits(), 200.0_f32.to_bits());
    assert!(!one.guard.has_lost(Side::Downstream));
    // Relay 2 is lost at 300 m: relay 3 joins between it and relay 4.
    for (x_m, joins) in [(280.0, false), (299.0, false), (301.0, true), (350.0, true)] {
        let mut last = One::new([Some(2), None], 500.0, 200.0);
        let mut lost = One::new([None, Some(4)], 300.0, 300.0);
        for _ in 0..4 {
            lost.receive(Side::Downstream, 4, last.sent(Side::Upstream));
            last.receive(Side::Upstream, 2, lost.sent(Side::Downstream));
        }
        assert_eq!(last.setpoint().to_bits(), 310.0_f32.to_bits());
        last.guard.set_goal(at(500.0));
        last.setpoint();
        last.is_at(500.0);
        last.is_at(500.0);
        last.guard.set_neighbour(Side::Upstream, None);
        let mut fresh = One::new([None, Some(4)], x_m, 400.0);
        last.guard.set_neighbour(Side::Upstream, Some(3));
        let mut talk = |last: &mut One| {
            for _ in 0..4 {
                fresh.receive(Side::Downstream, 4, last.sent(Side::Upstream));
                last.receive(Side::Upstream, 3, fresh.sent(Side::Downstream));
            }
            fresh.setpoint()
        };
        let expected_m = if joins { 400.0 } else { x_m };
        assert_eq!(talk(&mut last).to_bits(), expected_m.to_bits(), "{x_m}");
        assert_eq!(last.guard.has_lost(Side::Upstream), !joins);
        let reason = last.guard.hold_reason(Side::Upstream);
        assert_eq!(reason, (!joins).then_some(HoldReason::Lost), "{x_m}");
        last.guard.forget(Side::Upstream, false);
        assert_eq!(talk(&mut last).to_bits(), 400.0_f32.to_bits(), "{x_m}");
    }
}

/// Checks rule 9 for a neighbour that restarts and is lost before it has joined again.
///
/// A relay on the wrong side of the lost drone does not join.
#[test]
fn a_neighbour_that_restarts_and_is_lost_is_remembered() {
    for (x_m, joins) in [(320.0, false), (250.0, true)] {
        let mut one = One::new([None, Some(3)], 100.0, 100.0);
        let mut lost = One::new([Some(1), None], 300.0, 300.0);
        for _ in 0..4 {
            lost.receive(Side::Upstream, 1, one.sent(Side::Downstream));
            one.receive(Side::Downstream, 3, lost.sent(Side::Upstream));
        }
        for _ in 0..3 {
            one.receive(Side::Downstream, 3, fence(9, 300.0, 300.0));
        }
        one.guard.set_neighbour(Side::Downstream, None);
        let mut fresh = One::new([Some(1), None], x_m, 200.0);
        one.guard.set_neighbour(Side::Downstream, Some(2));
        for _ in 0..4 {
            fresh.receive(Side::Upstream, 1, one.sent(Side::Downstream));
            one.receive(Side::Downstream, 2, fresh.sent(Side::Upstream));
        }
        let expected_m = if joins { 200.0 } else { x_m };
        assert_eq!(fresh.setpoint().to_bits(), expected_m.to_bits(), "{x_m}");
    }
    for (x_m, joins) in [(280.0, false), (350.0, true)] {
        let mut last = One::new([Some(2), None], 500.0, 500.0);
        let mut lost = One::new([None, Some(4)], 300.0, 300.0);
        for _ in 0..4 {
            lost.receive(Side::Downstream, 4, last.sent(Side::Upstream));
            last.receive(Side::Upstream, 2, lost.sent(Side::Downstream));
        }
        for _ in 0..3 {
            last.receive(Side::Upstream, 2, fence(9, 300.0, 300.0));
        }
        last.guard.set_neighbour(Side::Upstream, None);
        let mut fresh = One::new([None, Some(4)], x_m, 400.0);
        last.guard.set_neighbour(Side::Upstream, Some(3));
        for _ in 0..4 {
            fresh.receive(Side::Downstream, 4, last.sent(Side::Upstream));
            last.receive(Side::Upstream, 3, fresh.sent(Side::Downstream));
        }
        let expected_m = if joins { 400.0 } else { x_m };
        assert_eq!(fresh.setpoint().to_bits(), expected_m.to_bits(), "{x_m}");
    }
}

/// Checks that a late fence of an earlier association links no relay on the wrong side of a lost drone.
///
/// The x of a numbered fence is not that of its sender, so it proves nothing of the order.
#[test]
fn a_late_fence_links_no_relay_on_the_wrong_side() {
    let mut last = One::new([Some(2), None], 500.0, 500.0);
    let mut lost = One::new([None, Some(4)], 300.0, 300.0);
    for _ in 0..4 {
        lost.receive(Side::Downstream, 4, last.sent(Side::Upstream));
        last.receive(Side::Upstream, 2, lost.sent(Side::Downstream));
    }
    last.guard.set_neighbour(Side::Upstream, None);
    last.guard.set_neighbour(Side::Upstream, Some(3));
    let mut fresh = One::new([None, Some(4)], 280.0, 400.0);
    let late = Fence {
        echo: 77,
        number: 5,
        ..fence(9, 450.0, 400.0)
    };
    last.receive(Side::Upstream, 3, late);
    for _ in 0..8 {
        fresh.receive(Side::Downstream, 4, last.sent(Side::Upstream));
        last.receive(Side::Upstream, 3, fresh.sent(Side::Downstream));
    }
    assert_eq!(fresh.setpoint().to_bits(), 280.0_f32.to_bits());
    assert!(last.guard.has_lost(Side::Upstream));
}

/// Checks that a late message with an earlier fence does not change the sender's agreed position.
#[test]
fn a_late_fence_does_not_restore_an_earlier_position() {
    let mut pair = Pair::new([100.0, 100.0], [300.0, 300.0]);
    pair.talk();
    let late = pair.owner.sent(Side::Downstream);
    pair.owner.guard.set_goal(at(20.0));
    pair.owner.setpoint();
    pair.owner.is_at(20.0);
    pair.owner.is_at(20.0);
    pair.talk();
    let place = |pair: &Pair| pair.follower.guard.neighbour_place(Side::Upstream);
    assert_eq!(place(&pair), Some(at(20.0)));
    pair.follower.receive(Side::Upstream, 1, late);
    assert_eq!(place(&pair), Some(at(20.0)));
}

/// Checks rule 9 for a relay with a number beyond that of a lost drone toward Rx.
///
/// Its x has to be beyond that of the drone, too.
#[test]
fn a_relay_before_a_lost_drone_with_a_lower_number_does_not_join() {
    for (x_m, joins) in [(250.0, false), (350.0, true)] {
        let mut one = One::new([None, Some(3)], 100.0, 100.0);
        let mut lost = One::new([Some(1), None], 300.0, 300.0);
        for _ in 0..4 {
            lost.receive(Side::Upstream, 1, one.sent(Side::Downstream));
            one.receive(Side::Downstream, 3, lost.sent(Side::Upstream));
        }
        one.guard.set_neighbour(Side::Downstream, Some(4));
        let mut fresh = One::new([Some(1), None], x_m, 400.0);
        for _ in 0..4 {
            fresh.receive(Side::Upstream, 1, one.sent(Side::Downstream));
            one.receive(Side::Downstream, 4, fresh.sent(Side::Upstream));
        }
        let expected_m = if joins { 400.0 } else { x_m };
        assert_eq!(fresh.setpoint().to_bits(), expected_m.to_bits(), "{x_m}");
    }
}

/// Checks that a relay does not approach the relays beyond a removed neighbour too early. It first has to receive a
/// message of one of those relays.
#[test]
fn a_relay_keeps_clear_of_relays_beyond_a_cleared_one() {
    let mut one = One::new([Some(2), None], 300.0, 300.0);
    let mut next = One::new([None, Some(3)], 100.0, 100.0);
    one.guard.set_neighbour(Side::Upstream, None);
    one.guard.forget(Side::Upstream, true);
    one.guard.set_goal(at(200.0));
    assert_eq!(one.setpoint().to_bits(), 300.0_f32.to_bits());
    let reason = one.guard.hold_reason(Side::Upstream);
    assert_eq!(reason, Some(HoldReason::Lost));
    // The relay moves away from them before it changes its lateral offset or altitude.
    one.guard.set_goal(Placement {
        y_m: 50.0,
        ..at(200.0)
    });
    assert_eq!(one.guard.steer(one.now), Some(at(310.0)));
    one.is_at(310.0);
    one.guard.set_neighbour(Side::Upstream, Some(1));
    for _ in 0..6 {
        one.receive(Side::Upstream, 1, next.sent(Side::Downstream));
        next.receive(Side::Downstream, 3, one.sent(Side::Upstream));
    }
    one.guard.set_goal(at(200.0));
    assert_eq!(one.setpoint().to_bits(), 200.0_f32.to_bits());
}

#[test]
fn a_relay_never_received_may_be_anywhere() {
    let mut guard = Guard::new(config(), [Some(1), Some(3)], 7, Instant::ZERO);
    guard.set_neighbour(Side::Upstream, None);
    guard.set_neighbour(Side::Downstream, Some(4));
    guard.set_neighbour(Side::Downstream, None);
    let now = Instant::from_millis(1000);
    guard.position(now, at(500.0));
    for target in [100.0, 900.0] {
        guard.set_goal(at(target));
        guard.steer(now);
        assert_eq!(guard.steer(now), Some(at(500.0)));
    }
    guard.forget(Side::Downstream, false);
    assert_eq!(guard.steer(now), Some(at(900.0)));
}

#[test]
fn a_relay_that_turns_stays_within_its_earlier_setpoints() {
    let ms = Duration::from_millis;
    let slow = GuardConfig {
        lag: ms(4_000),
        ..config()
    };
    let mut stretch = ReachableInterval::at(100.0, Instant::ZERO);
    let mut after = |wait, goes: &[f32], is_at| {
        let now = Instant::ZERO + ms(wait);
        for x_m in goes {
            stretch.extend_to(*x_m, now);
        }
        stretch.report(now, is_at, &slow);
        (stretch.low_m, stretch.high_m)
    };
    assert_eq!(after(4_000, &[], 100.0), (100.0, 100.0));
    assert_eq!(after(5_000, &[20.0], 100.0), (20.0, 100.0));
    assert_eq!(
        after(7_000, &[], 70.0),
        (20.0, 100.0),
        "it may be off the ground"
    );
    assert_eq!(after(9_000, &[], 60.0), (20.0, 60.0));
    // The relay flies toward Tx at full speed, and has to turn.
    assert_eq!(after(10_000, &[80.0], 50.0), (20.0, 80.0));
    assert_eq!(after(10_200, &[], 48.0), (20.0, 80.0));
    assert_eq!(after(13_900, &[90.0], 36.0), (20.0, 90.0));
    // By now the relay has stopped and turned. Setpoints on its way do not change that.
    assert_eq!(after(14_000, &[], 36.0), (36.0, 90.0));
    assert_eq!(after(14_200, &[95.0], 38.0), (38.0, 95.0));
    assert_eq!(after(21_000, &[], 95.0), (95.0, 95.0));
}

/// x of the setpoints of relay 1 and relay 2, m. The tests compare them exactly.
#[derive(PartialEq, Debug)]
struct Both(f32, f32);

/// Guards of two neighbours that exchange fence messages. Relay 1, the owner of the fence, is toward Tx, and relay 2,
/// the follower, toward Rx.
struct Pair {
    owner: One,
    follower: One,
}

impl Pair {
    fn new(owner: [f32; 2], follower: [f32; 2]) -> Self {
        Self {
            owner: One::new([None, Some(2)], owner[0], owner[1]),
            follower: One::new([Some(1), None], follower[0], follower[1]),
        }
    }

    fn ask(&mut self) {
        let fence = self.owner.sent(Side::Downstream);
        self.follower.receive(Side::Upstream, 1, fence);
    }

    fn answer(&mut self) {
        let fence = self.follower.sent(Side::Upstream);
        self.owner.receive(Side::Downstream, 2, fence);
    }

    /// Exchanges all messages between the two guards until nothing changes.
    fn talk(&mut self) {
        for _ in 0..8 {
            self.ask();
            self.answer();
        }
    }

    fn setpoints(&mut self) -> Both {
        Both(self.owner.setpoint(), self.follower.setpoint())
    }
}

/// Checks rule 8 of the guard: no relay moves before it has received a message of its neighbour.
#[test]
fn no_relay_moves_before_its_neighbour_is_received() {
    let mut pair = Pair::new([100.0, 200.0], [300.0, 150.0]);
    assert_eq!(pair.setpoints(), Both(100.0, 300.0));
    pair.ask();
    assert_eq!(pair.setpoints(), Both(100.0, 300.0));
    assert_eq!(
        pair.owner.guard.hold_reason(Side::Downstream),
        Some(HoldReason::Unheard)
    );
    // Away from the expected position of the neighbour, which may be right.
    pair.owner.guard.set_goal(at(50.0));
    pair.follower.guard.set_goal(at(400.0));
    assert_eq!(pair.setpoints(), Both(100.0, 300.0));
    pair.talk();
    assert_eq!(pair.setpoints(), Both(50.0, 400.0));
}

/// Checks that relays repeat their messages early only while they wait for a neighbour's message.
#[test]
fn a_relay_that_waits_repeats_its_messages_early() {
    let mut pair = Pair::new([100.0, 100.0], [300.0, 300.0]);
    let drain = |one: &mut One| core::iter::from_fn(|| one.guard.poll()).count();
    for one in [&mut pair.owner, &mut pair.follower] {
        assert!(drain(one) > 0 && one.guard.is_waiting());
        for early in 1..=3 {
            one.guard.remind_early(4);
            assert_eq!(drain(one), 1, "reminder {early}");
        }
    }
    pair.talk();
    pair.talk();
    for one in [&mut pair.owner, &mut pair.follower] {
        drain(one);
        one.guard.restart_second();
        assert!(!one.guard.is_waiting());
        for early in 1..=3 {
            one.guard.remind_early(4);
            assert_eq!(drain(one), 0, "reminder {early}");
        }
    }
}

/// Checks that a relay whose fence is never answered repeats it early only for a limited time.
#[test]
fn a_relay_that_waits_in_vain_repeats_its_messages_less_often() {
    let mut pair = Pair::new([100.0, 120.0], [300.0, 300.0]);
    for _ in 0..4 {
        pair.talk();
    }
    // From now on the neighbour is silent.
    pair.owner.guard.set_goal(at(150.0));
    let seconds = (0..100).take_while(|_| {
        while pair.owner.guard.poll().is_some() {}
        pair.owner.guard.remind();
        pair.owner.guard.is_waiting()
    });
    let waited = seconds.count();
    assert!((20..=30).contains(&waited), "{waited} s");
}

/// Checks rules 3, 4 and 6 of the guard for moves toward Rx. Relay 1 advances only as far as relay 2 has moved.
#[test]
fn the_owner_follows_the_follower() {
    let mut pair = Pair::new([100.0, 200.0], [120.0, 300.0]);
    pair.talk();
    assert_eq!(
        pair.setpoints(),
        Both(110.0, 300.0),
        "half way: (200 + 300 + 10) / 2 is asked for"
    );
    pair.follower.is_at(180.0);
    pair.talk();
    assert_eq!(pair.setpoints(), Both(170.0, 300.0));
    pair.follower.is_at(300.0);
    pair.talk();
    assert_eq!(pair.setpoints(), Both(200.0, 300.0));
    pair.owner.is_at(200.0);
    assert!(pair.owner.guard.has_arrived() && pair.follower.guard.has_arrived());
    assert!(
        !pair.owner.guard.remind() && !pair.follower.guard.remind(),
        "nothing is left to say"
    );
}

/// Checks rules 1 and 5 of the guard for moves toward Tx. First relay 1 moves, then its fence (lower limit of relay 2's
/// x), then relay 2.
#[test]
fn the_follower_follows_the_owner() {
    let mut pair = Pair::new([200.0, 100.0], [300.0, 120.0]);
    pair.talk();
    assert_eq!(pair.setpoints(), Both(100.0, 210.0));
    pair.owner.is_at(150.0);
    pair.talk();
    assert_eq!(pair.setpoints(), Both(100.0, 160.0));
    pair.owner.is_at(100.0);
    pair.talk();
    assert_eq!(pair.setpoints(), Both(100.0, 120.0));
}

/// Checks rule 3 of the guard: neither a late message nor a replaced fence moves a relay.
#[test]
fn late_messages_grant_nothing() {
    let mut pair = Pair::new([100.0, 100.0], [300.0, 300.0]);
    pair.talk();
    let high = pair.follower.sent(Side::Upstream);
    // The fence is lowered to (20 + 120 + 10) / 2, but the follower has not received that yet.
    pair.owner.guard.set_goal(at(20.0));
    pair.follower.guard.set_goal(at(120.0));
    pair.answer();
    pair.owner.is_at(20.0);
    let low = pair.owner.sent(Side::Downstream);
    assert_eq!(low.x_m.to_bits(), 75.0_f32.to_bits());
    pair.owner.guard.set_goal(at(290.0));
    pair.owner.receive(Side::Downstream, 2, high);
    assert_eq!(
        pair.owner.setpoint().to_bits(),
        65.0_f32.to_bits(),
        "the fence under way counts"
    );
    pair.follower.receive(Side::Upstream, 1, low);
    assert_eq!(pair.follower.setpoint().to_bits(), 120.0_f32.to_bits());
    pair.talk();
    let raised = pair.owner.sent(Side::Downstream);
    assert!(raised.x_m > low.x_m);
    pair.follower.guard.set_goal(at(80.0));
    pair.follower.receive(Side::Upstream, 1, low);
    assert!(
        pair.follower.setpoint() >= raised.x_m,
        "the old fence is over"
    );
}

/// Checks that an old position report of a relay does not let its neighbour come closer.
///
/// The report is older than the setpoint, or too early to show the setpoint's effect.
#[test]
fn an_old_report_frees_nothing() {
    let mut pair = Pair::new([200.0, 100.0], [300.0, 120.0]);
    pair.talk();
    let now = pair.owner.now;
    pair.owner.guard.position(now, at(100.0));
    pair.owner
        .guard
        .position(now + Duration::from_millis(199), at(100.0));
    pair.talk();
    assert_eq!(pair.setpoints(), Both(100.0, 210.0));
    pair.owner
        .guard
        .position(now + Duration::from_millis(200), at(100.0));
    pair.talk();
    assert_eq!(pair.setpoints(), Both(100.0, 120.0));
}

/// Checks rule 7 of the guard: relays that start closer than the separation first move apart along x.
#[test]
fn a_start_too_close_is_opened_before_anything_else() {
    let mut pair = Pair::new([100.0, 500.0], [104.0, 600.0]);
    let high = |x_m| Placement {
        y_m: 30.0,
        ..Placement::on_line(x_m, 90.0)
    };
    pair.follower.guard.set_goal(high(600.0));
    pair.owner.guard.set_goal(high(500.0));
    pair.talk();
    assert_eq!(pair.setpoints(), Both(94.0, 600.0));
    let low = |one: &One| one.guard.setpoint().unwrap().cross_section() == at(0.0).cross_section();
    assert!(
        low(&pair.owner) && low(&pair.follower),
        "both altitudes wait, and what is aside"
    );
    pair.owner.is_at(94.0);
    pair.follower.is_at(200.0);
    pair.talk();
    assert_eq!(pair.setpoints(), Both(190.0, 600.0));
    assert!(!low(&pair.owner) && !low(&pair.follower));
}

#[test]
fn relays_in_the_wrong_order_stay() {
    let mut pair = Pair::new([200.0, 100.0], [150.0, 300.0]);
    pair.follower.guard.set_goal(at(300.0));
    pair.talk();
    // Away from the expected position of the neighbour, which is right.
    pair.owner.guard.set_goal(at(250.0));
    pair.follower.guard.set_goal(at(140.0));
    pair.talk();
    assert_eq!(pair.setpoints(), Both(200.0, 150.0));
    assert_eq!(
        pair.owner.guard.hold_reason(Side::Downstream),
        Some(HoldReason::Order)
    );
}

/// Checks that a restarted relay is recognised, and its late old messages are ignored.
///
/// The restarted relay does not know the fence that it announced. Its neighbour respects this fence until
/// the two have exchanged messages.
#[test]
fn a_restart_is_distinguished_from_late_messages() {
    let mut pair = Pair::new([100.0, 100.0], [300.0, 300.0]);
    pair.talk();
    let old = pair.owner.sent(Side::Downstream);
    let told = pair.follower.sent(Side::Upstream);
    pair.owner = One::new([None, Some(2)], 100.0, 280.0);
    // A restart needs another seed.
    pair.owner.guard = {
        let mut guard = Guard::new(config(), [None, Some(2)], 8, Instant::ZERO);
        guard.set_goal(at(280.0));
        guard
    };
    pair.owner.is_at(100.0);
    pair.owner.is_at(100.0);
    pair.owner.receive(Side::Downstream, 2, told);
    assert_eq!(
        pair.setpoints(),
        Both(100.0, 300.0),
        "what its earlier life was told is void"
    );
    pair.talk();
    assert_eq!(pair.setpoints(), Both(280.0, 300.0));
    pair.follower.guard.set_goal(at(110.0));
    for _ in 0..2 {
        pair.follower.receive(Side::Upstream, 1, old);
    }
    assert_eq!(pair.follower.setpoint().to_bits(), 295.0_f32.to_bits());
    // Three old messages in a row look like another restart, but grant nothing either.
    pair.follower.receive(Side::Upstream, 1, old);
    assert!(pair.follower.setpoint() >= 295.0);
    pair.talk();
    assert_eq!(
        pair.setpoints(),
        Both(280.0, 290.0),
        "and the two find each other again"
    );
}

/// Checks that a relay in the wrong order with its downstream neighbour halts its upstream neighbour.
///
/// The relay's message requests a halt of the upstream neighbour. Usually the x in a message permits a move, but a flag
/// in this message states that it does not.
#[test]
fn a_relay_out_of_order_grants_nothing() {
    let mut one = One::new([Some(1), Some(3)], 100.0, 150.0);
    let heard = fence(9, 50.0, 50.0);
    one.receive(Side::Upstream, 1, heard);
    one.is_at(100.0);
    while let Some((side, ..)) = one.guard.poll() {
        assert_eq!(side, Side::Downstream);
    }
    let said = one.sent(Side::Downstream);
    let mut beyond = Fence {
        echo: said.association,
        x_m: 90.0,
        ..heard
    };
    one.receive(Side::Downstream, 3, beyond);
    one.is_at(100.0);
    let upward = one.sent(Side::Upstream);
    assert_eq!(
        upward.flags & (Fence::HALTS | Fence::UNPLACED | Fence::AGREES),
        Fence::HALTS | Fence::UNPLACED,
        "its neighbour downstream stands before it"
    );
    assert!(one.sent(Side::Downstream).flags & Fence::HALTS != 0);
    assert_eq!(
        one.guard.hold_reason(Side::Downstream),
        Some(HoldReason::Order)
    );
    // That message grants nothing to the upstream neighbour.
    let mut owner = One::new([None, Some(2)], 50.0, 60.0);
    let association = owner.sent(Side::Downstream).association;
    let told = Fence {
        echo: association,
        ..upward
    };
    owner.receive(Side::Downstream, 2, told);
    owner.is_at(50.0);
    assert_eq!(owner.setpoint().to_bits(), 50.0_f32.to_bits());
    assert_eq!(
        owner.sent(Side::Downstream).number,
        0,
        "no fence is announced"
    );
    beyond.x_m = 120.0;
    one.receive(Side::Downstream, 3, beyond);
    // Now the x of the relay counts. But it sends no fence downstream before it has received one from upstream.
    assert_eq!(one.sent(Side::Upstream).flags & Fence::UNPLACED, 0);
    assert_eq!(one.sent(Side::Upstream).x_m.to_bits(), 100.0_f32.to_bits());
    assert_eq!(one.sent(Side::Downstream).number, 0);
    assert_eq!(one.setpoint().to_bits(), 100.0_f32.to_bits());
    let upstream = Fence {
        echo: one.sent(Side::Upstream).association,
        number: 1,
        x_m: 60.0,
        ..heard
    };
    one.receive(Side::Upstream, 1, upstream);
    assert_ne!(one.sent(Side::Downstream).number, 0);
    assert_ne!(one.setpoint().to_bits(), 100.0_f32.to_bits());
}

/// Checks that a relay counts as held up after five reminders without a change of its setpoint.
///
/// Only a different setpoint restarts the count.
#[test]
fn a_setpoint_that_stays_for_five_reminders_is_held_up() {
    let mut own = Own::new(config(), 1, Instant::ZERO);
    own.begin(at(100.0), Instant::ZERO);
    own.goal = Some(at(300.0));
    for reminder in 1..=5 {
        assert!(!own.is_held_up(Side::Downstream, true), "{reminder}");
        own.count_reminder();
        own.set_setpoint(at(100.0), Instant::from_millis(1_000 * reminder));
    }
    assert!(own.is_held_up(Side::Downstream, true));
    assert!(!own.is_held_up(Side::Upstream, true));
    own.set_setpoint(at(101.0), Instant::from_millis(6_000));
    assert!(!own.is_held_up(Side::Downstream, true));
}
