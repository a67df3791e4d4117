//! Tests of the guard's rules, with messages passed by hand.

mod halted;
mod pairs;
mod released;

use super::config::{Geofence, GuardConfig};
use super::own::ReachableInterval;
use super::{Fence, Guard, HoldReason};
use crate::place::Placement;
use crate::side::Side;
use crate::time::{Duration, Instant};

const APART: f32 = 10.0;

fn config() -> GuardConfig {
    GuardConfig {
        fence: Geofence {
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

/// Returns a neighbour's first message.
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

/// Guard between `neighbours` that hovers at `x_m`, with the agreed position `target_m`, and the clock.
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
        one.guard.commit(at(target_m));
        one.is_at(x_m);
        one.is_at(x_m);
        one
    }

    /// Reports the relay at `x_m`, long after the last setpoint.
    fn is_at(&mut self, x_m: f32) {
        self.now = self.now + Duration::from_millis(1000);
        self.guard.position(self.now, at(x_m));
        let _ = self.guard.steer(self.now);
    }

    fn setpoint(&mut self) -> f32 {
        self.guard.steer(self.now).unwrap().x_m
    }

    fn says(&mut self, side: Side) -> Fence {
        self.guard.steer(self.now);
        self.guard.follower.association.due = true;
        self.guard.owner.association.due = true;
        let mut said = None;
        while let Some((to, _, fence)) = self.guard.poll() {
            if to == side {
                said = Some(fence);
            }
        }
        said.unwrap()
    }

    fn hears(&mut self, side: Side, from: u16, fence: Fence) {
        self.guard.hear(side, from, &fence);
        self.guard.steer(self.now);
    }
}

#[test]
fn it_is_small() {
    assert!(size_of::<Guard>() <= 424, "{}", size_of::<Guard>());
    assert_eq!(size_of::<Fence>(), 28);
}

#[test]
fn there_is_no_setpoint_before_a_place_and_a_report() {
    let mut guard = Guard::new(config(), [None, None], 7, Instant::from_millis(1000));
    let now = Instant::from_millis(2000);
    assert_eq!(guard.steer(now), None);
    guard.commit(at(300.0));
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
fn nothing_leaves_the_box_and_nonsense_is_counted() {
    let mut one = One::new([None, None], 100.0, 100.0);
    let far = Placement {
        x_m: 5000.0,
        y_m: -60.0,
        altitude_m: 1.0,
    };
    one.guard.commit(far);
    let cut = Placement {
        x_m: 1000.0,
        y_m: -50.0,
        altitude_m: 20.0,
    };
    assert_eq!(one.guard.steer(one.now), Some(cut));
    one.guard.commit(at(f32::NAN));
    one.guard.position(one.now, at(f32::INFINITY));
    one.guard.hear(Side::Upstream, 1, &fence(1, 2e7, 0.0));
    assert_eq!(one.guard.refused(), 3);
    assert_eq!(one.guard.steer(one.now), Some(cut));
}

/// Rule 1, even if the neighbour on the other side started too close.
#[test]
fn a_squeezed_relay_keeps_its_promise() {
    let mut one = One::new([Some(1), Some(3)], 100.0, 100.0);
    for side in [Side::Downstream, Side::Upstream] {
        let handshake = fence(9, 0.0, 0.0);
        let from = if side == Side::Upstream { 1 } else { 3 };
        one.hears(side, from, handshake);
        let said = one.says(side);
        let answer = Fence {
            echo: said.association,
            number: u16::from(side == Side::Upstream),
            x_m: if side == Side::Upstream { 98.0 } else { 104.0 },
            ..handshake
        };
        one.hears(side, from, answer);
    }
    assert_eq!(
        one.setpoint().to_bits(),
        98.0_f32.to_bits(),
        "94 would be clear of relay 3"
    );
}

/// Rule 9.
#[test]
fn a_lost_relay_is_kept_clear_of() {
    let mut one = One::new([None, Some(2)], 100.0, 400.0);
    let mut lost = One::new([Some(1), None], 300.0, 300.0);
    for _ in 0..4 {
        lost.hears(Side::Upstream, 1, one.says(Side::Downstream));
        one.hears(Side::Downstream, 2, lost.says(Side::Upstream));
    }
    assert_eq!(one.setpoint().to_bits(), 290.0_f32.to_bits());
    one.guard.link(Side::Downstream, None);
    assert_eq!(one.setpoint().to_bits(), 290.0_f32.to_bits());
    assert_eq!(
        one.guard.hold_reason(Side::Downstream),
        Some(HoldReason::Lost)
    );
    one.guard.forget(Side::Downstream, false);
    assert_eq!(one.setpoint().to_bits(), 400.0_f32.to_bits());

    lost.guard.commit(at(50.0));
    let least = lost.setpoint();
    assert!(least >= 300.0 - 200.0);
    lost.guard.link(Side::Upstream, None);
    assert_eq!(lost.setpoint().to_bits(), least.to_bits());
    lost.guard.forget(Side::Upstream, false);
    assert_eq!(lost.setpoint().to_bits(), 50.0_f32.to_bits());
}

/// An operator has cleared the lost neighbour; the one beyond it was never heard.
#[test]
fn a_relay_keeps_clear_of_those_beyond_a_cleared_one_until_it_hears_them() {
    let mut one = One::new([Some(2), None], 300.0, 300.0);
    let mut next = One::new([None, Some(3)], 100.0, 100.0);
    one.guard.link(Side::Upstream, None);
    one.guard.forget(Side::Upstream, true);
    one.guard.commit(at(200.0));
    assert_eq!(one.setpoint().to_bits(), 300.0_f32.to_bits());
    let reason = one.guard.hold_reason(Side::Upstream);
    assert_eq!(reason, Some(HoldReason::Lost));
    // It moves away from them before it moves across the line.
    one.guard.commit(Placement {
        y_m: 50.0,
        ..at(200.0)
    });
    assert_eq!(one.guard.steer(one.now), Some(at(310.0)));
    one.is_at(310.0);
    one.guard.link(Side::Upstream, Some(1));
    for _ in 0..6 {
        one.hears(Side::Upstream, 1, next.says(Side::Downstream));
        next.hears(Side::Downstream, 3, one.says(Side::Upstream));
    }
    one.guard.commit(at(200.0));
    assert_eq!(one.setpoint().to_bits(), 200.0_f32.to_bits());
}

#[test]
fn one_that_was_never_heard_may_be_anywhere() {
    let mut guard = Guard::new(config(), [Some(1), Some(3)], 7, Instant::ZERO);
    guard.link(Side::Upstream, None);
    guard.link(Side::Downstream, Some(4));
    guard.link(Side::Downstream, None);
    let now = Instant::from_millis(1000);
    guard.position(now, at(500.0));
    for target in [100.0, 900.0] {
        guard.commit(at(target));
        guard.steer(now);
        assert_eq!(guard.steer(now), Some(at(500.0)));
    }
    guard.forget(Side::Downstream, false);
    assert_eq!(guard.steer(now), Some(at(900.0)));
}

#[test]
fn a_relay_that_turns_flies_on_no_farther_than_it_was_told() {
    let ms = Duration::from_millis;
    let slow = GuardConfig {
        lag: ms(4_000),
        ..config()
    };
    let mut stretch = ReachableInterval::at(100.0, Instant::ZERO);
    let mut after = |wait, goes: &[f32], is_at| {
        let now = Instant::ZERO + ms(wait);
        for x_m in goes {
            stretch.go(*x_m, now);
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
    // It flies toward Tx at full speed, and is to turn.
    assert_eq!(after(10_000, &[80.0], 50.0), (20.0, 80.0));
    assert_eq!(after(10_200, &[], 48.0), (20.0, 80.0));
    assert_eq!(after(13_900, &[90.0], 36.0), (20.0, 90.0));
    // By now it has stopped and turned; setpoints on its way do not change that.
    assert_eq!(after(14_000, &[], 36.0), (36.0, 90.0));
    assert_eq!(after(14_200, &[95.0], 38.0), (38.0, 95.0));
    assert_eq!(after(21_000, &[], 95.0), (95.0, 95.0));
}
