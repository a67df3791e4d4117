//! Tests of a relay that does not fly to setpoints.

extern crate std;

use std::vec::Vec;

use super::{APART, One, at, config};
use crate::guard::{Fence, Guard, HoldReason};
use crate::place::Placement;
use crate::side::Side;
use crate::time::Instant;

/// Three relays in a row, 100 m apart. In the tests a pilot takes control of the middle one.
struct Row {
    all: [One; 3],
}

impl Row {
    fn new() -> Self {
        let neighbours = |k: u16| [(k > 1).then(|| k - 1), (k < 3).then(|| k + 1)];
        let mut row = Self {
            all: [1_u16, 2, 3].map(|k| {
                let x_m = 100.0 * f32::from(k);
                let mut one = One::new([None, None], x_m, x_m);
                let seed = 7 + u32::from(k);
                one.guard = Guard::new(config(), neighbours(k), seed, Instant::ZERO);
                one.guard.set_goal(at(x_m));
                one.is_at(x_m);
                one.is_at(x_m);
                one
            }),
        };
        row.talk();
        assert!(row.all.iter().all(|one| one.guard.has_arrived()));
        row
    }

    /// Exchanges messages between the three relays until none is pending.
    fn talk(&mut self) {
        for _ in 0..8 {
            for k in 0..3 {
                self.all[k].guard.remind();
                while self.speak(k).is_some() {}
            }
        }
    }

    /// Delivers the next fence message of relay `k` (0 to 2) to its neighbour, and returns the message. `None` if none
    /// is pending.
    fn speak(&mut self, k: usize) -> Option<Fence> {
        let (side, to, fence) = self.all[k].guard.poll()?;
        let from = u16::try_from(k).unwrap_or(0) + 1;
        self.all[usize::from(to) - 1].receive(side.other(), from, fence);
        Some(fence)
    }

    fn take(&mut self) {
        let one = &mut self.all[1];
        assert!(one.guard.control(one.now, false));
        assert!(!one.guard.control(one.now, false), "that is no news");
    }

    fn give(&mut self) {
        let one = &mut self.all[1];
        assert!(one.guard.control(one.now, true));
    }

    fn setpoint(&mut self, k: usize) -> Option<f32> {
        let one = &mut self.all[k];
        one.guard.steer(one.now).map(|place| place.x_m)
    }
}

/// Checks rule 15 of the guard: neighbours of a drone in manual control come no nearer to it.
#[test]
fn no_relay_comes_nearer_to_one_in_manual_flight() {
    let mut row = Row::new();
    row.take();
    assert_eq!(row.setpoint(1), None);
    row.all[1].is_at(200.0);
    assert_eq!(row.setpoint(1), None, "a report changes nothing");
    row.talk();
    assert_eq!(row.all[1].guard.poll(), None);
    for (k, toward, away) in [(0, 180.0, 50.0), (2, 220.0, 350.0)] {
        let x_m = row.setpoint(k);
        row.all[k].guard.set_goal(at(toward));
        assert_eq!(row.setpoint(k), x_m);
        let side = if k == 0 {
            Side::Downstream
        } else {
            Side::Upstream
        };
        let reason = row.all[k].guard.hold_reason(side);
        assert_eq!(reason, Some(HoldReason::NotFlown));
        let high = Placement {
            altitude_m: 90.0,
            ..at(away)
        };
        row.all[k].guard.set_goal(high);
        row.all[k].guard.steer(row.all[k].now);
        assert_eq!(
            row.all[k].guard.setpoint(),
            Some(high),
            "it is otherwise free"
        );
    }
    assert_eq!(row.all[1].guard.hold_reason(Side::Upstream), None);
    // Both may move after an operator has reported the drone as gone.
    row.all[0].guard.set_goal(at(180.0));
    row.all[0].guard.forget(Side::Downstream, false);
    assert_eq!(row.setpoint(0), Some(180.0));
}

/// Checks rule 15 of the guard: neighbours do not fly through a drone in manual control on their way.
#[test]
fn no_relay_flies_through_a_drone_in_manual_flight() {
    for (y_m, expected_m) in [(0.0, 80.0), (6.0, 80.0), (20.0, 20.0)] {
        let mut row = Row::new();
        row.take();
        let drone = Placement { y_m, ..at(70.0) };
        let now = row.all[1].now;
        row.all[1].guard.position(now, drone);
        row.talk();
        row.all[0].guard.set_goal(at(20.0));
        assert_eq!(row.setpoint(0), Some(expected_m), "{y_m}");
        let reason = row.all[0].guard.hold_reason(Side::Downstream);
        let expected = (expected_m > 20.0).then_some(HoldReason::NotFlown);
        assert_eq!(reason, expected);
        // The drone is no longer in the way.
        row.all[1].guard.position(now, at(200.0));
        row.talk();
        assert_eq!(row.setpoint(0), Some(20.0));
    }
}

/// Checks that a moving relay stops before a drone in its way, and stays there despite position noise.
#[test]
fn a_relay_on_its_way_stops_before_a_drone_in_its_way() {
    let mut row = Row::new();
    row.take();
    row.talk();
    row.all[0].guard.set_goal(at(20.0));
    assert_eq!(row.setpoint(0), Some(20.0));
    row.all[0].is_at(90.0);
    let now = row.all[1].now;
    row.all[1].guard.position(now, at(40.0));
    row.talk();
    assert_eq!(row.setpoint(0), Some(40.0 + APART));
    for _ in 0..20 {
        row.all[0].is_at(40.0 + APART);
    }
    assert_eq!(row.setpoint(0), Some(40.0 + APART));
}

/// Checks that a relay beside a drone in manual control moves sideways, up or down only away from it. "Beside" means
/// closer than the separation along x.
#[test]
fn no_relay_moves_across_toward_a_drone_beside_it() {
    for (y_m, moves) in [(-30.0, true), (30.0, false)] {
        let mut row = Row::new();
        row.take();
        let now = row.all[1].now;
        let beside = Placement {
            y_m: 20.0,
            ..at(100.0)
        };
        row.all[1].guard.position(now, beside);
        row.talk();
        let across = Placement { y_m, ..at(100.0) };
        row.all[0].guard.set_goal(across);
        let expected = if moves { across } else { at(100.0) };
        let one = &mut row.all[0];
        assert_eq!(one.guard.steer(one.now), Some(expected));
    }
}

/// Checks that a neighbour that became silent right after its start counts as lost. It had sent only its position, and
/// had no association yet.
#[test]
fn a_relay_that_fell_silent_after_its_start_is_lost() {
    let mut row = Row::new();
    let now = row.all[1].now;
    row.all[1].guard = Guard::new(config(), [Some(1), Some(3)], 99, now);
    row.all[1].guard.position(now, at(200.0));
    row.talk();
    row.all[0].guard.set_neighbour(Side::Downstream, None);
    row.all[0].guard.set_goal(at(195.0));
    assert!(row.setpoint(0) < Some(195.0));
    let reason = row.all[0].guard.hold_reason(Side::Downstream);
    assert_eq!(reason, Some(HoldReason::Lost));
}

/// Checks that a late message from a drone's manual flight does not make the drone an obstacle again.
#[test]
fn a_late_position_of_a_drone_flown_again_is_no_obstacle() {
    let mut row = Row::new();
    row.take();
    row.talk();
    let now = row.all[1].now;
    row.all[1].guard.position(now, at(110.0));
    row.all[1].guard.remind();
    let mut late = Vec::new();
    while let Some((side, _, fence)) = row.all[1].guard.poll() {
        late.extend((side == Side::Upstream).then_some(fence));
    }
    let late = late.pop().expect("it tells its place");
    assert!(late.flags & Fence::UNPLACED != 0);
    row.talk();
    row.give();
    row.all[1].is_at(200.0);
    row.all[1].is_at(200.0);
    row.talk();
    row.all[0].receive(Side::Downstream, 2, late);
    row.all[0].guard.set_goal(at(140.0));
    assert_eq!(row.setpoint(0), Some(140.0));
}

/// Checks that the hold reason states that a restarted neighbour does not fly to setpoints.
///
/// The neighbour's companion computer restarted, and its pilot has not engaged setpoint control again. The limit of x
/// of the neighbour's old association still holds.
#[test]
fn a_relay_reports_that_its_neighbour_is_not_engaged() {
    let mut row = Row::new();
    let neighbours = [Some(1), Some(3)];
    let now = row.all[1].now;
    row.all[1].guard = Guard::new(config(), neighbours, 99, now);
    row.all[1].guard.control(now, false);
    row.all[1].guard.position(now, at(200.0));
    row.talk();
    row.all[0].guard.set_goal(at(195.0));
    let least_m = row.setpoint(0);
    assert!(least_m < Some(195.0));
    row.talk();
    let reason = row.all[0].guard.hold_reason(Side::Downstream);
    assert_eq!(reason, Some(HoldReason::NotFlown));
}

/// Checks that a relay reports `Pending` if a neighbour in setpoint control does not make way for it. It reports this
/// once its setpoint has not changed for five reminders (seconds), and not while it moves.
#[test]
fn a_relay_that_stands_for_long_reports_pending() {
    let mut row = Row::new();
    row.all[0].guard.set_goal(at(180.0));
    let _ = row.setpoint(0);
    let reason = |row: &Row| row.all[0].guard.hold_reason(Side::Downstream);
    assert_eq!(reason(&row), None);
    for _ in 0..5 {
        row.all[0].guard.remind();
    }
    assert_eq!(reason(&row), Some(HoldReason::Pending));
    row.all[1].guard.set_goal(at(300.0));
    row.all[2].guard.set_goal(at(400.0));
    for _ in 0..4 {
        row.talk();
        for k in 0..3 {
            if let Some(x_m) = row.setpoint(k) {
                row.all[k].is_at(x_m);
            }
        }
    }
    assert_eq!(row.setpoint(0), Some(180.0));
    assert_eq!(reason(&row), None);
}

#[test]
fn a_relay_flown_again_begins_as_after_a_start() {
    let mut row = Row::new();
    row.take();
    row.talk();
    row.all[0].guard.set_goal(at(150.0));
    row.all[1].guard.set_goal(at(260.0));
    let before = row.all[1].now;
    row.all[1].now = before + crate::time::Duration::from_millis(1);
    row.give();
    row.all[1].guard.position(before, at(200.0));
    assert_eq!(row.setpoint(1), None, "that was before");
    row.all[1].is_at(195.0);
    assert_eq!(row.setpoint(1), Some(195.0));
    assert_eq!(row.setpoint(0), Some(100.0), "it has not been heard yet");
    row.all[1].is_at(195.0);
    row.talk();
    assert_eq!(row.setpoint(0), Some(150.0));
    assert_eq!(row.setpoint(1), Some(260.0));
    assert_eq!(row.all[0].guard.hold_reason(Side::Downstream), None);
}

/// Checks that a relay repeats the notice that it has left an association. It repeats the notice until the
/// neighbour has started a new association, even if the pilot has given control back before.
#[test]
fn lost_messages_are_repeated() {
    let mut row = Row::new();
    row.take();
    let mut said = 0;
    for _ in 0..3 {
        row.all[1].guard.remind();
        while let Some((_, _, fence)) = row.all[1].guard.poll() {
            assert_eq!(fence.flags, Fence::LEFT);
            assert!(fence.is_valid());
            said += 1;
        }
    }
    assert_eq!(said, 6);
    row.give();
    row.all[1].is_at(200.0);
    row.all[1].is_at(200.0);
    row.all[1].guard.remind();
    let first = row.speak(1).map(|fence| fence.flags);
    assert_eq!(first, Some(Fence::LEFT));
    row.talk();
    assert!(row.all.iter().all(|one| one.guard.has_arrived()));
}

/// Checks that late messages change nothing after a pilot has taken a drone over or given it back.
///
/// For the neighbours, an old fence message does not end the manual control, and an old leave notice does not begin it.
#[test]
fn late_messages_do_not_change_who_is_flown() {
    let mut row = Row::new();
    let old = [Side::Upstream, Side::Downstream].map(|side| row.all[1].sent(side));
    row.take();
    let mut left = [None; 2];
    while let Some((side, _, fence)) = row.all[1].guard.poll() {
        left[usize::from(side == Side::Downstream)] = Some(fence);
    }
    let left = left.map(|fence| fence.expect("both are told"));
    for _ in 0..5 {
        row.all[0].receive(Side::Downstream, 2, left[0]);
        row.all[2].receive(Side::Upstream, 2, left[1]);
        row.all[0].receive(Side::Downstream, 2, old[0]);
        row.all[2].receive(Side::Upstream, 2, old[1]);
    }
    row.all[0].guard.set_goal(at(80.0));
    row.all[2].guard.set_goal(at(320.0));
    assert_eq!(row.setpoint(0), Some(80.0), "it is free to go");
    assert_eq!(row.setpoint(2), Some(320.0), "it is free to go");
    row.talk();
    row.give();
    row.all[1].is_at(200.0);
    row.all[1].is_at(200.0);
    row.talk();
    for _ in 0..5 {
        row.all[0].receive(Side::Downstream, 2, left[0]);
        row.all[2].receive(Side::Upstream, 2, left[1]);
    }
    row.all[0].guard.set_goal(at(200.0 - APART));
    row.all[0].guard.steer(row.all[0].now);
    while row.speak(0).is_some() || row.speak(1).is_some() {}
    assert_eq!(row.setpoint(0), Some(200.0 - APART));
}

/// Checks that two neighbours start a new association after both were in manual control.
#[test]
fn two_neighbours_are_released_and_flown_again() {
    let mut row = Row::new();
    row.take();
    let now = row.all[2].now;
    row.all[2].guard.control(now, false);
    row.talk();
    // Each sends its position now and then, without waiting for a reply.
    assert!(row.all[1].guard.poll().is_none() && row.all[2].guard.poll().is_none());
    row.give();
    row.all[1].is_at(200.0);
    row.all[1].is_at(200.0);
    row.talk();
    row.all[1].guard.set_goal(at(240.0));
    assert_eq!(row.setpoint(1), Some(200.0), "relay 3 has not been heard");
    row.all[2].guard.control(now, true);
    row.all[2].is_at(300.0);
    row.all[2].is_at(300.0);
    row.talk();
    assert_eq!(row.setpoint(1), Some(240.0));
}

#[test]
fn no_relay_flies_before_it_is_engaged() {
    let mut guard = Guard::new(config(), [None, None], 7, Instant::ZERO);
    assert!(!guard.control(Instant::ZERO, true), "it is flown at first");
    assert!(guard.control(Instant::ZERO, false));
    guard.set_goal(at(300.0));
    let ms = Instant::from_millis;
    guard.position(ms(1_000), at(100.0));
    assert_eq!(guard.steer(ms(1_000)), None);
    assert!(guard.control(ms(2_000), true));
    assert_eq!(guard.steer(ms(2_000)), None);
    guard.position(ms(2_100), at(100.0));
    assert_eq!(guard.steer(ms(2_100)), Some(at(100.0)));
    assert_eq!(guard.steer(ms(2_100)), Some(at(300.0)));
}
