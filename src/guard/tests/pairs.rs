//! Tests of two relays and the fence between them.

use super::{One, at, config, fence};
use crate::guard::{Fence, Guard, HoldReason};
use crate::place::Placement;
use crate::side::Side;
use crate::time::{Duration, Instant};

/// Exact setpoints of the two, m along x.
#[derive(PartialEq, Debug)]
struct Both(f32, f32);

/// Relay 1 toward Tx and relay 2 toward Rx, with one fence between them.
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
        let fence = self.owner.says(Side::Downstream);
        self.follower.hears(Side::Upstream, 1, fence);
    }

    fn answer(&mut self) {
        let fence = self.follower.says(Side::Upstream);
        self.owner.hears(Side::Downstream, 2, fence);
    }

    /// Exchanges all messages until nothing changes.
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

/// Rule 8.
#[test]
fn nobody_moves_before_the_other_one_was_heard() {
    let mut pair = Pair::new([100.0, 200.0], [300.0, 150.0]);
    assert_eq!(pair.setpoints(), Both(100.0, 300.0));
    pair.ask();
    assert_eq!(pair.setpoints(), Both(100.0, 300.0));
    assert_eq!(
        pair.owner.guard.hold_reason(Side::Downstream),
        Some(HoldReason::Unheard)
    );
    // Away from the expected position of the other one, which may be its real one.
    pair.owner.guard.commit(at(50.0));
    pair.follower.guard.commit(at(400.0));
    assert_eq!(pair.setpoints(), Both(100.0, 300.0));
    pair.talk();
    assert_eq!(pair.setpoints(), Both(50.0, 400.0));
}

/// Rules 3, 4 and 6: a fence to the right is requested, and approached as the other relay clears it.
#[test]
fn the_keeper_follows_the_kept_relay() {
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
    assert!(pair.owner.guard.is_there() && pair.follower.guard.is_there());
    assert!(
        !pair.owner.guard.remind() && !pair.follower.guard.remind(),
        "nothing is left to say"
    );
}

/// Rules 1 and 5: a fence to the left is lowered as the owner clears it.
#[test]
fn the_kept_relay_follows_the_keeper() {
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

/// Rule 3: messages with an older fence, or late ones, do not count.
#[test]
fn late_messages_grant_nothing() {
    let mut pair = Pair::new([100.0, 100.0], [300.0, 300.0]);
    pair.talk();
    let high = pair.follower.says(Side::Upstream);
    // The fence is lowered to (20 + 120 + 10) / 2, but the follower has not received that yet.
    pair.owner.guard.commit(at(20.0));
    pair.follower.guard.commit(at(120.0));
    pair.answer();
    pair.owner.is_at(20.0);
    let low = pair.owner.says(Side::Downstream);
    assert_eq!(low.x_m.to_bits(), 75.0_f32.to_bits());
    pair.owner.guard.commit(at(290.0));
    pair.owner.hears(Side::Downstream, 2, high);
    assert_eq!(
        pair.owner.setpoint().to_bits(),
        65.0_f32.to_bits(),
        "the fence under way counts"
    );
    pair.follower.hears(Side::Upstream, 1, low);
    assert_eq!(pair.follower.setpoint().to_bits(), 120.0_f32.to_bits());
    pair.talk();
    let raised = pair.owner.says(Side::Downstream);
    assert!(raised.x_m > low.x_m);
    pair.follower.guard.commit(at(80.0));
    pair.follower.hears(Side::Upstream, 1, low);
    assert!(
        pair.follower.setpoint() >= raised.x_m,
        "the old fence is over"
    );
}

/// A report that is older than the setpoint, or too early for its effect, frees nothing.
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

/// Rule 7.
#[test]
fn a_start_too_close_is_opened_before_anything_else() {
    let mut pair = Pair::new([100.0, 500.0], [104.0, 600.0]);
    let high = |x_m| Placement {
        y_m: 30.0,
        ..Placement::on_line(x_m, 90.0)
    };
    pair.follower.guard.commit(high(600.0));
    pair.owner.guard.commit(high(500.0));
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
    pair.follower.guard.commit(at(300.0));
    pair.talk();
    // Away from the expected position of the other one, which is its real one.
    pair.owner.guard.commit(at(250.0));
    pair.follower.guard.commit(at(140.0));
    pair.talk();
    assert_eq!(pair.setpoints(), Both(200.0, 150.0));
    assert_eq!(
        pair.owner.guard.hold_reason(Side::Downstream),
        Some(HoldReason::Order)
    );
}

/// A restarted owner does not know its announced fence. The follower keeps it until it has exchanged messages with the new owner,
/// and ignores old messages afterwards.
#[test]
fn a_new_life_is_told_from_an_old_one() {
    let mut pair = Pair::new([100.0, 100.0], [300.0, 300.0]);
    pair.talk();
    let old = pair.owner.says(Side::Downstream);
    let told = pair.follower.says(Side::Upstream);
    pair.owner = One::new([None, Some(2)], 100.0, 280.0);
    // Another seed, as required.
    pair.owner.guard = {
        let mut guard = Guard::new(config(), [None, Some(2)], 8, Instant::ZERO);
        guard.commit(at(280.0));
        guard
    };
    pair.owner.is_at(100.0);
    pair.owner.is_at(100.0);
    pair.owner.hears(Side::Downstream, 2, told);
    assert_eq!(
        pair.setpoints(),
        Both(100.0, 300.0),
        "what its earlier life was told is void"
    );
    pair.talk();
    assert_eq!(pair.setpoints(), Both(280.0, 300.0));
    pair.follower.guard.commit(at(110.0));
    for _ in 0..2 {
        pair.follower.hears(Side::Upstream, 1, old);
    }
    assert_eq!(pair.follower.setpoint().to_bits(), 295.0_f32.to_bits());
    // Three in a row look like another restart, but grant nothing either.
    pair.follower.hears(Side::Upstream, 1, old);
    assert!(pair.follower.setpoint() >= 295.0);
    pair.talk();
    assert_eq!(
        pair.setpoints(),
        Both(280.0, 290.0),
        "and the two find each other again"
    );
}

/// A relay out of order with one neighbour grants nothing to the other one. It requests a halt, with an x that does not count.
#[test]
fn a_relay_out_of_order_grants_nothing() {
    let mut one = One::new([Some(1), Some(3)], 100.0, 150.0);
    let heard = fence(9, 50.0, 50.0);
    one.hears(Side::Upstream, 1, heard);
    one.is_at(100.0);
    while let Some((side, ..)) = one.guard.poll() {
        assert_eq!(side, Side::Downstream);
    }
    let said = one.says(Side::Downstream);
    let mut beyond = Fence {
        echo: said.association,
        x_m: 90.0,
        ..heard
    };
    one.hears(Side::Downstream, 3, beyond);
    one.is_at(100.0);
    let upward = one.says(Side::Upstream);
    assert_eq!(
        upward.flags & (Fence::HALTS | Fence::UNPLACED | Fence::AGREES),
        Fence::HALTS | Fence::UNPLACED,
        "its neighbour downstream stands before it"
    );
    assert!(one.says(Side::Downstream).flags & Fence::HALTS != 0);
    assert_eq!(
        one.guard.hold_reason(Side::Downstream),
        Some(HoldReason::Order)
    );
    // That message grants nothing to the neighbour upstream.
    let mut owner = One::new([None, Some(2)], 50.0, 60.0);
    let association = owner.says(Side::Downstream).association;
    let told = Fence {
        echo: association,
        ..upward
    };
    owner.hears(Side::Downstream, 2, told);
    owner.is_at(50.0);
    assert_eq!(owner.setpoint().to_bits(), 50.0_f32.to_bits());
    assert_eq!(
        owner.says(Side::Downstream).number,
        0,
        "no fence is announced"
    );
    beyond.x_m = 120.0;
    one.hears(Side::Downstream, 3, beyond);
    // Now its x counts; but it sends no fence downstream before it has received one from upstream.
    assert_eq!(one.says(Side::Upstream).flags & Fence::UNPLACED, 0);
    assert_eq!(one.says(Side::Upstream).x_m.to_bits(), 100.0_f32.to_bits());
    assert_eq!(one.says(Side::Downstream).number, 0);
    assert_eq!(one.setpoint().to_bits(), 100.0_f32.to_bits());
    let upstream = Fence {
        echo: one.says(Side::Upstream).association,
        number: 1,
        x_m: 60.0,
        ..heard
    };
    one.hears(Side::Upstream, 1, upstream);
    assert_ne!(one.says(Side::Downstream).number, 0);
    assert_ne!(one.setpoint().to_bits(), 100.0_f32.to_bits());
}
