//! Guards beside a relay that leaves the chain, and of a relay that joins from a hover. Messages are passed by hand.

use uav_relay::guard::config::{Geofence, GuardConfig};
use uav_relay::guard::{Fence, Guard, HoldReason};
use uav_relay::{Duration, Instant, Placement, Side};

/// Separation of the relays, m.
const APART_M: f32 = 10.0;

fn config() -> GuardConfig {
    GuardConfig {
        geofence: Geofence {
            least_x_m: 0.0,
            most_x_m: 1_000.0,
            least_y_m: -50.0,
            most_y_m: 50.0,
            least_altitude_m: 20.0,
            most_altitude_m: 120.0,
        },
        separation_m: APART_M,
        relays: 3,
        hover_m: 0.0,
        lag: Duration::from_millis(200),
    }
}

fn at(x_m: f32) -> Placement {
    Placement::on_line(x_m, 50.0)
}

/// Three relays that hover in a row, 100 m apart.
struct Row {
    all: [Guard; 3],
    now: Instant,
}

impl Row {
    fn new() -> Self {
        let mut row = Self {
            all: [1_u16, 2, 3].map(|node| {
                let neighbours = [(node > 1).then(|| node - 1), (node < 3).then(|| node + 1)];
                Guard::new(config(), neighbours, 7 + u32::from(node), Instant::ZERO)
            }),
            now: Instant::ZERO,
        };
        for (guard, x_m) in row.all.iter_mut().zip([100.0, 200.0, 300.0]) {
            guard.set_goal(at(x_m));
        }
        row.fly();
        assert!(row.all.iter().all(Guard::has_arrived));
        row
    }

    /// Moves all drones to their setpoints, and exchanges messages, until nothing changes.
    fn fly(&mut self) {
        for _ in 0..20 {
            self.now = self.now + Duration::from_millis(1_000);
            for (index, guard) in self.all.iter_mut().enumerate() {
                let place = guard.setpoint();
                guard.position(self.now, place.unwrap_or(at(100.0 + 100.0 * index as f32)));
                guard.steer(self.now);
                guard.remind();
            }
            for index in 0..3 {
                while let Some((side, to, fence)) = self.all[index].poll() {
                    let from = u16::try_from(index).unwrap() + 1;
                    let receiver = &mut self.all[usize::from(to) - 1];
                    let from_side = match side {
                        Side::Upstream => Side::Downstream,
                        Side::Downstream => Side::Upstream,
                    };
                    receiver.handle_fence(from_side, from, &fence);
                    receiver.steer(self.now);
                }
            }
        }
    }

    /// Gives all relays the order for relay `node` to leave, 0 for none.
    fn order(&mut self, node: u16) {
        for guard in &mut self.all {
            guard.set_leaver(node);
        }
        self.fly();
    }

    /// Links relays 1 and 3, and makes both approach relay 2. Returns the x of the setpoints of relays 1 and 3, m.
    fn close_up(&mut self) -> [f32; 2] {
        self.all[0].set_neighbour(Side::Downstream, Some(3));
        self.all[2].set_neighbour(Side::Upstream, Some(1));
        self.all[0].set_goal(at(195.0));
        self.all[2].set_goal(at(205.0));
        self.fly();
        [0, 2].map(|index: usize| self.all[index].setpoint().unwrap().x_m)
    }
}

#[test]
fn relays_close_up_to_one_that_leaves() {
    let mut row = Row::new();
    row.order(2);
    assert!(row.all[0].is_answered() && row.all[1].is_still());
    // The separation from the drone at 200 m, which still hovers.
    assert_eq!(row.close_up(), [190.0, 210.0]);
    assert_eq!(row.all[1].setpoint(), Some(at(200.0)));
    for (index, side) in [(0, Side::Downstream), (2, Side::Upstream)] {
        assert_eq!(row.all[index].hold_reason(side), Some(HoldReason::Lost));
        row.all[index].forget(side, false);
    }
    row.fly();
    assert_eq!(row.all[0].setpoint(), Some(at(195.0)), "it is gone");
}

/// Checks that the neighbours of a lost relay keep clear of it if it has no order to leave.
///
/// Each neighbour keeps half of the separation from its fence to the lost relay. The fence is the plane halfway between
/// the two relays' agreed positions.
#[test]
fn relays_keep_clear_of_a_lost_relay_without_an_order() {
    // Halfway between the two agreed positions, and half of the separation on both sides.
    assert_eq!(Row::new().close_up(), [145.0, 255.0]);
}

/// Checks that no neighbour approaches relay 2, which must leave, while a pilot flies relay 2.
#[test]
fn no_relay_closes_up_to_a_pilot() {
    let mut row = Row::new();
    let now = row.now;
    assert!(row.all[1].control(now, false));
    row.fly();
    row.order(2);
    assert!(row.all[0].is_answered(), "no reply is awaited from a pilot");
    assert_eq!(row.close_up(), [100.0, 300.0]);
}

/// Checks that a relay reaches its agreed position once its order to leave is withdrawn.
#[test]
fn a_relay_that_stays_gets_its_room_back() {
    let mut row = Row::new();
    row.order(2);
    row.all[1].set_goal(at(170.0));
    row.order(0);
    assert_eq!(row.all[1].setpoint(), Some(at(170.0)));
}

/// Creates the guard of relay 1, which reports the positions `reports` before its first agreement. If `lost` is true,
/// relay 3 replaces the neighbour, relay 2, before relay 2 has sent any message.
fn joining(reports: &[(u64, f32)], lost: bool) -> (Guard, Instant) {
    let mut guard = Guard::new(config(), [None, Some(2)], 7, Instant::ZERO);
    let mut now = Instant::ZERO;
    for (at_ms, x_m) in reports {
        now = Instant::from_millis(*at_ms);
        guard.position(now, at(*x_m));
    }
    if lost {
        guard.set_neighbour(Side::Downstream, Some(3));
    }
    guard.set_goal(at(400.0));
    guard.steer(now);
    (guard, now)
}

/// Returns true if the position in the guard's next message permits the neighbour to move.
fn offers(guard: &mut Guard) -> bool {
    let sent = guard.poll().expect("it sends its position");
    sent.2.flags & Fence::UNPLACED == 0
}

const HOVER: [(u64, f32); 4] = [
    (1_000, 100.0),
    (1_100, 100.0),
    (1_200, 100.0),
    (1_300, 100.0),
];

#[test]
fn a_relay_that_joins_from_a_hover_is_known_at_once() {
    assert!(offers(&mut joining(&HOVER, false).0));
    let others: [(&[(u64, f32)], &str); 3] = [
        (&HOVER[..2], "shorter than the lag"),
        (
            &[
                (1_000, 100.0),
                (1_100, 101.0),
                (1_200, 102.0),
                (1_300, 103.0),
            ],
            "on its way",
        ),
        (&[(1_000, 100.0), (4_000, 100.0)], "no reports between"),
    ];
    for (reports, why) in others {
        assert!(!offers(&mut joining(reports, false).0), "{why}");
    }
}

/// Checks that a hovering relay that joins does not approach a lost drone that never sent it a message.
#[test]
fn a_relay_that_joins_keeps_clear_of_a_lost_one() {
    let (mut guard, mut now) = joining(&HOVER, true);
    let mut next = Guard::new(config(), [Some(1), None], 9, Instant::ZERO);
    next.set_goal(at(500.0));
    for _ in 0..20 {
        now = now + Duration::from_millis(1_000);
        for (one, x_m) in [(&mut guard, 100.0), (&mut next, 500.0)] {
            one.position(now, at(x_m));
            one.steer(now);
            one.remind();
        }
        while let Some((_, _, fence)) = guard.poll() {
            next.handle_fence(Side::Upstream, 1, &fence);
        }
        while let Some((_, _, fence)) = next.poll() {
            guard.handle_fence(Side::Downstream, 3, &fence);
        }
    }
    assert_eq!(guard.steer(now), Some(at(100.0)));
    assert_eq!(guard.hold_reason(Side::Downstream), Some(HoldReason::Lost));
    guard.forget(Side::Downstream, false);
    assert_eq!(guard.steer(now), Some(at(400.0)));
}

/// Checks that a neighbour without a known position does not make the relay open the chain.
///
/// In an open chain, neighbours are at least the minimum separation apart along x.
#[test]
fn a_neighbour_without_a_position_is_not_too_close() {
    let (mut guard, now) = joining(&HOVER, false);
    let (_, _, sent) = guard.poll().expect("it sends its position");
    let reply = Fence {
        association: 5,
        echo: sent.association,
        number: 0,
        flags: Fence::UNPLACED,
        x_m: 300.0,
        target_m: 300.0,
        ..sent
    };
    guard.handle_fence(Side::Downstream, 2, &reply);
    guard.steer(now);
    let (_, _, next) = guard.poll().expect("it replies");
    assert_eq!(next.flags & Fence::REQUESTS_OPENING, 0);
}

/// Checks that a hover under the pilot's control does not permit the neighbour to move at once.
#[test]
fn a_hover_in_manual_flight_does_not_count() {
    let mut guard = Guard::new(config(), [None, Some(2)], 7, Instant::ZERO);
    guard.control(Instant::from_millis(10), false);
    for at_ms in (1_000..2_000).step_by(100) {
        guard.position(Instant::from_millis(at_ms), at(100.0));
    }
    guard.control(Instant::from_millis(2_000), true);
    let now = Instant::from_millis(2_100);
    guard.position(now, at(100.0));
    guard.set_goal(at(400.0));
    guard.steer(now);
    assert!(!offers(&mut guard));
}
