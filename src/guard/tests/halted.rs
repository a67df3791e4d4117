//! Tests of starts anywhere in the air, and of the halt of a chain with one relay out of order.

use super::*;

fn aside(x_m: f32, y_m: f32, altitude_m: f32) -> Placement {
    Placement {
        x_m,
        y_m,
        altitude_m,
    }
}

impl One {
    /// Reports the position `place` to the guard, 1 s after the previous report.
    fn is_at_place(&mut self, place: Placement) {
        self.now = self.now + Duration::from_millis(1000);
        self.guard.position(self.now, place);
        let _ = self.guard.steer(self.now);
    }
}

/// Returns a message of a neighbour that knows this relay's association. The message has the fence number
/// `number`. The neighbour's x and its agreed x are `x_m`.
fn answer(one: &mut One, side: Side, x_m: f32, number: u16) -> Fence {
    let echo = one.sent(side).association;
    Fence {
        echo,
        number,
        ..fence(9, x_m, x_m)
    }
}

#[test]
fn the_first_setpoint_holds_until_the_order_is_known() {
    let mut one = One {
        guard: Guard::new(config(), [None, Some(2)], 7, Instant::ZERO),
        now: Instant::ZERO,
    };
    one.guard.set_goal(at(60.0));
    // The relay is above its neighbour, to the side, and outside of the geofence.
    let high = aside(100.0, -80.0, 160.0);
    one.is_at_place(high);
    for _ in 0..20 {
        one.is_at_place(high);
        assert_eq!(one.guard.setpoint(), Some(high));
    }
    // The neighbour is reported 3 m beyond. The two move apart along x before either changes its lateral offset or
    // altitude.
    let told = answer(&mut one, Side::Downstream, 103.0, 0);
    one.receive(Side::Downstream, 2, told);
    let first = one.guard.setpoint().unwrap();
    assert_eq!(first.cross_section(), high.cross_section());
    assert!(first.x_m <= 100.0);
    let fence = one.sent(Side::Downstream);
    let told = answer(&mut one, Side::Downstream, fence.x_m + 1.0, fence.number);
    one.receive(Side::Downstream, 2, told);
    assert_eq!(one.guard.setpoint(), Some(at(60.0)));
}

#[test]
fn a_start_outside_the_geofence_goes_no_farther_out() {
    let mut one = One {
        guard: Guard::new(config(), [None, Some(2)], 7, Instant::ZERO),
        now: Instant::ZERO,
    };
    one.guard.set_goal(at(40.0));
    one.is_at_place(at(-30.0));
    one.is_at_place(at(-30.0));
    assert_eq!(one.guard.setpoint(), Some(at(-30.0)));
    let told = answer(&mut one, Side::Downstream, 500.0, 0);
    one.receive(Side::Downstream, 2, told);
    assert_eq!(one.guard.setpoint().map(|place| place.x_m), Some(40.0));
}

/// Checks that relays with an uncertain order along x count as in order if they may pass each other. In all other cases
/// they do not.
///
/// The order is uncertain if their reported x differ by less than the errors of the reports. They may pass each other
/// if lateral offset and altitude keep them at least the separation apart.
#[test]
fn relays_within_the_error_are_in_order_if_they_may_pass() {
    for (up_m, may_pass) in [(0.0, false), (9.9, false), (10.1, true)] {
        for (x_m, is_near) in [(97.0, false), (98.5, true), (101.0, true)] {
            let is_ordered = may_pass && is_near;
            let config = GuardConfig {
                hover_m: 1.0,
                ..config()
            };
            let mut one = One {
                guard: Guard::new(config, [None, Some(2)], 7, Instant::ZERO),
                now: Instant::ZERO,
            };
            one.guard.set_goal(at(60.0));
            one.is_at(100.0);
            one.is_at(100.0);
            let told = Fence {
                across: at(0.0).cross_section(),
                ..answer(&mut one, Side::Downstream, x_m, 0)
            };
            let told = Fence {
                across: crate::place::CrossSection::on_line(50.0 + up_m),
                ..told
            };
            one.receive(Side::Downstream, 2, told);
            let reason = one.guard.hold_reason(Side::Downstream);
            assert_eq!(
                reason != Some(HoldReason::Order),
                is_ordered,
                "{up_m} {x_m}"
            );
            let moves = one.guard.setpoint().is_some_and(|place| place.x_m < 100.0);
            assert_eq!(moves, is_ordered, "{up_m} {x_m}");
        }
    }
}

/// Checks that two neighbours in the wrong order along x halt the relay between them. Because of the errors of the
/// reports, each neighbour alone may seem to be on its correct side of this relay.
#[test]
fn two_neighbours_out_of_order_halt_the_relay_between_them() {
    for (up_m, down_m, halts) in [(101.5, 98.5, true), (101.5, 100.5, false)] {
        let config = GuardConfig {
            hover_m: 1.0,
            ..config()
        };
        let mut one = One {
            guard: Guard::new(config, [Some(1), Some(3)], 7, Instant::ZERO),
            now: Instant::ZERO,
        };
        one.guard.set_goal(at(160.0));
        one.is_at(100.0);
        one.is_at(100.0);
        one.receive(Side::Upstream, 1, fence(9, up_m, 50.0));
        one.receive(Side::Downstream, 3, fence(9, down_m, 200.0));
        let told = core::iter::from_fn(|| one.guard.poll());
        let halted = told
            .filter(|(.., fence)| fence.has_flag(Fence::HALTS))
            .count();
        assert_eq!(halted > 0, halts, "{up_m} {down_m}");
    }
}

/// Checks that a moving relay that receives a halt request stops at its last reported position. It continues when the
/// halt ends or expires.
#[test]
fn a_relay_that_halts_on_its_way_stops_there() {
    for forgotten in [false, true] {
        let mut one = One::new([None, Some(2)], 100.0, 300.0);
        let told = answer(&mut one, Side::Downstream, 500.0, 0);
        one.receive(Side::Downstream, 2, told);
        assert!(one.setpoint() > 200.0);
        one.is_at(150.0);
        let goal_m = one.setpoint();
        let halts = Fence {
            flags: Fence::HALTS,
            ..told
        };
        one.receive(Side::Downstream, 2, halts);
        assert_eq!(one.setpoint().to_bits(), 150.0_f32.to_bits());
        assert_eq!(
            one.guard.hold_reason(Side::Downstream),
            Some(HoldReason::Halted)
        );
        one.is_at(160.0);
        assert_eq!(
            one.setpoint().to_bits(),
            150.0_f32.to_bits(),
            "it overshoots"
        );
        if forgotten {
            for _ in 0..14 {
                one.guard.remind();
                assert_eq!(one.setpoint().to_bits(), 150.0_f32.to_bits());
            }
            one.guard.remind();
        } else {
            one.receive(Side::Downstream, 2, told);
        }
        assert_eq!(one.setpoint().to_bits(), goal_m.to_bits());
    }
}

/// Checks that a relay that halts on its way into the geofence stops where it is, outside. At the nearest position
/// inside, there may be a neighbour.
#[test]
fn a_relay_that_halts_outside_the_geofence_stops_there() {
    let mut one = One {
        guard: Guard::new(config(), [None, Some(2)], 7, Instant::ZERO),
        now: Instant::ZERO,
    };
    one.guard.set_goal(at(100.0));
    let high = aside(100.0, 0.0, 180.0);
    one.is_at_place(high);
    one.is_at_place(high);
    let told = answer(&mut one, Side::Downstream, 150.0, 0);
    one.receive(Side::Downstream, 2, told);
    let fence = one.sent(Side::Downstream);
    let told = answer(&mut one, Side::Downstream, fence.x_m + 1.0, fence.number);
    one.receive(Side::Downstream, 2, told);
    assert_eq!(
        one.guard.setpoint(),
        Some(at(100.0)),
        "it sinks into the box"
    );
    let halts = Fence {
        flags: Fence::HALTS,
        ..told
    };
    let midway = aside(100.0, 0.0, 150.0);
    one.guard.position(one.now, midway);
    one.receive(Side::Downstream, 2, halts);
    assert_eq!(one.guard.setpoint(), Some(midway));
    // No report makes the relay go farther out than it was.
    one.receive(Side::Downstream, 2, told);
    one.guard.position(one.now, aside(100.0, 0.0, 190.0));
    one.receive(Side::Downstream, 2, halts);
    assert_eq!(one.guard.setpoint(), Some(high));
}

/// Checks that a halt request outlasts a reboot of its sender. The rebooted relay does not know the request, so its
/// first messages do not withdraw it.
#[test]
fn a_halt_outlasts_a_reboot_of_its_requester() {
    for side in [Side::Upstream, Side::Downstream] {
        let (neighbours, node, x_m) = match side {
            Side::Upstream => ([Some(1), None], 1, 50.0),
            Side::Downstream => ([None, Some(2)], 2, 150.0),
        };
        let mut one = One::new(neighbours, 100.0, 100.0);
        let halts = Fence {
            flags: Fence::HALTS,
            ..fence(9, x_m, x_m)
        };
        one.receive(side, node, halts);
        assert_eq!(one.guard.hold_reason(side.other()), None);
        let is_halted = |one: &One| match side {
            Side::Upstream => one.guard.follower.association.has_halt_request(),
            Side::Downstream => one.guard.owner.association.has_halt_request(),
        };
        assert!(is_halted(&one));
        for flags in [Fence::LEFT | Fence::UNPLACED, Fence::UNPLACED] {
            let first = Fence {
                flags,
                ..fence(77, x_m, x_m)
            };
            one.receive(side, node, first);
            assert!(is_halted(&one), "{side:?} {flags}");
        }
        let placed = Fence {
            number: 1,
            ..fence(77, x_m, x_m)
        };
        one.receive(side, node, placed);
        assert!(!is_halted(&one), "{side:?}");
    }
}

/// Checks that the chain halts if a drone leaves manual control on the wrong side of a neighbour.
#[test]
fn a_relay_flown_again_out_of_order_requests_a_halt() {
    for side in [Side::Upstream, Side::Downstream] {
        let (neighbours, node, x_m) = match side {
            Side::Upstream => ([Some(1), None], 1, 150.0),
            Side::Downstream => ([None, Some(2)], 2, 50.0),
        };
        let mut one = One {
            guard: Guard::new(config(), neighbours, 7, Instant::ZERO),
            now: Instant::ZERO,
        };
        one.guard.set_goal(at(100.0));
        one.guard.control(one.now, false);
        one.is_at(100.0);
        one.receive(side, node, fence(9, x_m, x_m));
        while one.guard.poll().is_some() {}
        one.guard.control(one.now, true);
        one.is_at(100.0);
        one.is_at(100.0);
        let told = core::iter::from_fn(|| one.guard.poll());
        let halts = told.filter(|(.., fence)| fence.has_flag(Fence::HALTS));
        assert!(halts.count() > 0, "{side:?}");
    }
}

/// Checks that a relay in manual control, and one that has just started, forward a halt request.
#[test]
fn a_halt_passes_a_relay_that_is_not_flown() {
    let mut one = One::new([Some(1), Some(3)], 100.0, 150.0);
    one.guard.control(one.now, false);
    one.guard.position(one.now, at(100.0));
    while one.guard.poll().is_some() {}
    let halts = Fence {
        flags: Fence::HALTS,
        ..fence(9, 150.0, 150.0)
    };
    one.receive(Side::Downstream, 3, halts);
    let (side, node, told) = one.guard.poll().unwrap();
    assert_eq!((side, node), (Side::Upstream, 1));
    let flags = Fence::LEFT | Fence::UNPLACED | Fence::HALTS;
    assert_eq!((told.flags, told.x_m), (flags, 100.0));
    assert!(told.is_valid());
    assert!(one.guard.poll().is_none());
    // The upstream neighbour, which flies to setpoints, then halts, and has no association with this relay.
    let mut before = One::new([None, Some(2)], 50.0, 60.0);
    let known = answer(&mut before, Side::Downstream, 100.0, 0);
    before.receive(Side::Downstream, 2, known);
    before.is_at(55.0);
    before.receive(Side::Downstream, 2, told);
    assert_eq!(before.setpoint().to_bits(), 55.0_f32.to_bits());
}

/// Checks that a relay in manual control reports that it is on the wrong side of a flown neighbour.
#[test]
fn an_unflown_relay_reports_that_it_is_out_of_order() {
    let mut one = One {
        guard: Guard::new(config(), [Some(1), Some(3)], 7, Instant::ZERO),
        now: Instant::ZERO,
    };
    one.guard.control(one.now, false);
    one.guard.position(one.now, at(100.0));
    let reasons =
        |one: &One| [Side::Upstream, Side::Downstream].map(|side| one.guard.hold_reason(side));
    assert_eq!(reasons(&one), [None; 2]);
    let placed = Fence {
        number: 0,
        ..fence(9, 120.0, 0.0)
    };
    one.receive(Side::Upstream, 1, placed);
    assert_eq!(reasons(&one), [Some(HoldReason::Order), None]);
    one.guard.position(one.now, at(130.0));
    assert_eq!(reasons(&one), [None; 2]);
    one.receive(Side::Downstream, 3, fence(9, 110.0, 0.0));
    assert_eq!(reasons(&one), [None, Some(HoldReason::Order)]);
}

/// Checks that a relay that starts beside a silent relay moves away along x before it changes altitude. It then keeps
/// the separation along x until an operator reports the silent relay as gone. Its hold reason is the lost relay.
#[test]
fn a_relay_moves_away_from_a_silent_one_before_across() {
    let mut one = One {
        guard: Guard::new(config(), [Some(1), None], 7, Instant::ZERO),
        now: Instant::ZERO,
    };
    one.guard.set_goal(at(102.0));
    let high = aside(100.0, 0.0, 80.0);
    one.is_at_place(high);
    one.is_at_place(high);
    assert_eq!(one.guard.setpoint(), Some(high));
    one.guard.set_neighbour(Side::Upstream, None);
    one.is_at_place(high);
    assert_eq!(one.guard.setpoint(), Some(aside(110.0, 0.0, 80.0)));
    assert_eq!(
        one.guard.hold_reason(Side::Upstream),
        Some(HoldReason::Lost)
    );
    one.is_at_place(aside(105.0, 0.0, 80.0));
    assert_eq!(one.guard.setpoint(), Some(aside(110.0, 0.0, 80.0)));
    for _ in 0..3 {
        one.is_at_place(aside(110.0, 0.0, 80.0));
    }
    assert_eq!(one.guard.setpoint(), Some(at(110.0)));
    assert_eq!(
        one.guard.hold_reason(Side::Upstream),
        Some(HoldReason::Lost)
    );
    one.guard.forget(Side::Upstream, false);
    one.is_at(110.0);
    assert_eq!(one.guard.setpoint(), Some(at(102.0)));
}

/// Checks that a relay keeps its position if a neighbour on its wrong side becomes silent. The chain halts until an
/// operator reports the silent neighbour as gone.
#[test]
fn a_relay_out_of_order_with_one_that_fell_silent_stays() {
    for side in [Side::Upstream, Side::Downstream] {
        let (neighbours, node, x_m, to_m) = match side {
            Side::Upstream => ([Some(1), Some(3)], 1, 150.0, 300.0),
            Side::Downstream => ([Some(1), Some(3)], 3, 50.0, 20.0),
        };
        let mut one = One::new(neighbours, 100.0, to_m);
        let told = match side {
            Side::Upstream => fence(9, x_m, x_m),
            Side::Downstream => answer(&mut one, side, x_m, 0),
        };
        one.receive(side, node, told);
        assert_eq!(one.guard.hold_reason(side), Some(HoldReason::Order));
        one.guard.set_neighbour(side, None);
        one.guard.set_neighbour(side.other(), None);
        for _ in 0..60 {
            one.is_at(100.0);
            one.guard.remind();
            assert_eq!(one.setpoint().to_bits(), 100.0_f32.to_bits(), "{side:?}");
            assert_eq!(one.guard.hold_reason(side), Some(HoldReason::Order));
        }
        one.guard.forget(side, false);
        one.guard.forget(side.other(), false);
        assert_eq!(one.setpoint().to_bits(), to_m.to_bits(), "{side:?}");
    }
}

/// Checks that a neighbour in manual control causes no halt if its reported position is in order.
#[test]
fn a_reported_position_in_manual_flight_avoids_a_halt() {
    for (x_m, halts) in [(None, true), (Some(90.0), true), (Some(130.0), false)] {
        let mut unflown = One {
            guard: Guard::new(config(), [Some(1), None], 9, Instant::ZERO),
            now: Instant::ZERO,
        };
        unflown.guard.control(unflown.now, false);
        let told = x_m.map(|x_m| {
            unflown.guard.position(unflown.now, at(x_m));
            unflown.guard.poll().unwrap().2
        });
        let mut one = One::new([Some(1), Some(3)], 100.0, 100.0);
        one.receive(Side::Upstream, 1, fence(9, 50.0, 50.0));
        for _ in 0..5 {
            if let Some(told) = told {
                one.receive(Side::Downstream, 3, told);
            }
            one.is_at(100.0);
            one.guard.remind();
        }
        let said = one.sent(Side::Downstream);
        assert_eq!(said.flags & Fence::HALTS != 0, halts, "{x_m:?}");
        assert_eq!(one.setpoint().to_bits(), 100.0_f32.to_bits(), "{x_m:?}");
    }
}

/// Checks that a late fence message from before a reboot does not count as its sender's position. The x in such a
/// message is that of the fence, which may be far from the sender.
#[test]
fn an_old_fence_gives_no_position_of_its_owner() {
    for (number, is_wrong) in [(0, true), (7, false)] {
        let mut one = One {
            guard: Guard::new(config(), [Some(1), None], 7, Instant::ZERO),
            now: Instant::ZERO,
        };
        one.guard.control(one.now, false);
        one.is_at(163.0);
        one.receive(
            Side::Upstream,
            1,
            Fence {
                number,
                ..fence(9, 250.0, 150.0)
            },
        );
        let reason = one.guard.hold_reason(Side::Upstream);
        assert_eq!(reason == Some(HoldReason::Order), is_wrong, "{reason:?}");
    }
}

/// Checks that a relay reports the lowest x of itself and of the relays downstream. The x of relay 3 is 2.5 m below
/// that of relay 2, which the errors of their reports allow. So relay 2 has to report the x of relay 3.
#[test]
fn gaps_that_are_negative_by_the_error_add_up() {
    let config = GuardConfig {
        hover_m: 2.0,
        ..config()
    };
    let places = [100.0, 103.0, 100.5].map(at);
    let mut guards = [1_u16, 2, 3].map(|k| {
        let neighbours = [(k > 1).then(|| k - 1), (k < 3).then(|| k + 1)];
        Guard::new(config, neighbours, 7 + u32::from(k), Instant::ZERO)
    });
    let mut told = None;
    for second in 1..10 {
        for k in 0..3 {
            let now = Instant::from_millis(1_000 * second);
            let y_m = [0.0, 20.0, -20.0][k];
            let place = Placement { y_m, ..places[k] };
            let end = Placement {
                y_m,
                ..at([90.0, 200.0, 300.0][k])
            };
            let guard = &mut guards[k];
            guard.set_goal(end);
            guard.position(now, place);
            // The relays do not fly to their setpoints here: the message of relay 2 is checked before any move.
            guard.steer(now);
            guard.remind();
            while let Some((side, to, fence)) = guards[k].poll() {
                let counts = fence.flags & (Fence::UNPLACED | Fence::LEFT) == 0;
                if k == 1 && side == Side::Upstream && counts {
                    told = told.or(Some(fence.x_m));
                }
                let from = if k == 0 {
                    1
                } else if k == 1 {
                    2
                } else {
                    3
                };
                guards[usize::from(to) - 1].handle_fence(side.other(), from, &fence);
            }
        }
    }
    let told = told.expect("relay 2 is in order with relay 3");
    assert!((100.0..=100.5).contains(&told), "{told}");
}

/// Checks that relay 2 raises its fence (limit of x for relay 3) after relay 1 has started beside it. Relay 3 was
/// already beyond the old fence.
///
/// Relay 1 is upstream, but reports a larger x than relay 2; the two are in order only because of the errors of
/// reports. So the new fence must be at least the separation beyond relay 1, too (rule 7 of the guard).
#[test]
fn a_new_neighbour_upstream_raises_a_fence_that_was_cleared() {
    let config = GuardConfig {
        hover_m: 2.0,
        ..config()
    };
    let places = [
        Placement {
            y_m: 20.0,
            ..at(202.0)
        },
        at(200.0),
        at(212.0),
    ];
    let mut guards = [1_u16, 2, 3].map(|k| {
        let neighbours = [(k == 2).then_some(1), (k == 2).then_some(3)];
        let neighbours = if k == 3 { [Some(2), None] } else { neighbours };
        Guard::new(config, neighbours, 7 + u32::from(k), Instant::ZERO)
    });
    guards[1].set_neighbour(Side::Upstream, None);
    guards[1].forget(Side::Upstream, false);
    let mut fences = [0.0_f32; 2];
    for second in 1..20 {
        let now = Instant::from_millis(1_000 * second);
        let first = usize::from(second < 10);
        if second == 10 {
            guards[0].set_neighbour(Side::Downstream, Some(2));
            guards[1].set_neighbour(Side::Upstream, Some(1));
        }
        for k in first..3 {
            guards[k].set_goal(places[k]);
            guards[k].position(now, places[k]);
            guards[k].steer(now);
            guards[k].remind();
            while let Some((side, to, fence)) = guards[k].poll() {
                if side == Side::Downstream && fence.number > 0 {
                    fences[k] = fence.x_m;
                }
                let from = u16::try_from(k).unwrap_or(0) + 1;
                guards[usize::from(to) - 1].handle_fence(side.other(), from, &fence);
            }
        }
    }
    let [first_m, second_m] = fences;
    assert!(first_m >= 212.0, "{first_m}");
    assert!(second_m >= first_m, "{second_m} {first_m}");
}
