//! Tests of leases, of the leader's orders, and of the requests that it collects.

extern crate std;

use std::vec::Vec;

use super::{Current, Lease, longest_lease};
use crate::mission::Mission;
use crate::mission::tests::paper;
use crate::node::context::{Context, Member, OtherLeases};
use crate::settings::Settings;
use crate::time::{Duration, Instant};
use crate::view::ViewId;
use crate::wire::message::{AT_ONCE, Leave, Nodes, OwnRequests, Requests};

/// Returns the lease duration that the leader announces after a view change, in tenths of a second. Before the
/// change the leader is in view 1, and its lease renewal has been outstanding for 40 s. The new view, number `base`
/// + 1, replaces view `base`, and no relay is lost.
fn span_after(base: u32) -> u16 {
    let settings = Settings::default();
    let view = |number: u32| ViewId::from_bits(number << 10 | 1);
    let mut lease = Lease::new(1, Instant::ZERO, &settings);
    lease.bounds.accepted = (view(1), Instant::ZERO);
    lease.current = Some(Current {
        number: 7,
        span: 150,
    });
    lease.circulation.start(Instant::ZERO);
    let now = Instant::ZERO + Duration::from_millis(40_000);
    lease.accept_view(now, (view(base + 1), view(base)), now, false);
    lease.announced_span(&settings)
}

#[test]
fn an_unfinished_pulse_of_the_last_view_counts_as_slow() {
    assert!(span_after(1) >= 1_200);
}

#[test]
fn an_unfinished_pulse_of_a_relay_left_out_does_not_count() {
    assert_eq!(span_after(2), 150);
}

#[cfg(feature = "departures")]
fn context(member: &Member, at_s: u64) -> Context<'_> {
    Context {
        now: Instant::from_millis(1_000 * at_s),
        member,
        latest: member.active,
        is_last_reachable: false,
        other_leases: OtherLeases::NONE,
    }
}

fn nodes(all: &[u16]) -> Nodes {
    let mut nodes = [0; AT_ONCE];
    nodes[..all.len()].copy_from_slice(all);
    nodes
}

/// Returns requests to leave: node numbers and endurances, s.
fn leaves(all: &[(u16, u16)]) -> [Leave; AT_ONCE] {
    let mut leaves = [Leave::NONE; AT_ONCE];
    for (place, (node, endurance_s)) in leaves.iter_mut().zip(all) {
        (place.node, place.endurance_s) = (*node, *endurance_s);
    }
    leaves
}

/// Returns the requests of relay `node`, which is in place. It has the endurance `left_s`, s, if it wants to leave.
fn own(node: u16, left_s: Option<u16>) -> OwnRequests {
    let leave = left_s.map_or(Leave::NONE, |endurance_s| Leave { node, endurance_s });
    OwnRequests {
        node,
        gap: 1,
        leave,
        spare: 0,
        in_place: true,
    }
}

/// Checks that the most urgent requests are kept, and of two near relays the more urgent one.
#[test]
fn the_most_urgent_requests_are_kept() {
    let kept = |wishes: &[(u16, u16)]| {
        let all = wishes.iter().rev();
        let all = all.fold(Requests::NONE, |all, (node, left_s)| {
            all.with(&own(*node, Some(*left_s)), nodes(&[]))
        });
        all.leaves
    };
    assert_eq!(kept(&[(1, 90), (7, 80)]), leaves(&[(7, 80), (1, 90)]));
    // Relay 1 knows only that relay 6 is at least the second one from here.
    assert_eq!(kept(&[(1, 90), (6, 80)]), leaves(&[(6, 80)]));
    assert_eq!(kept(&[(1, 80), (6, 80)]), leaves(&[(1, 80)]));
    assert_eq!(
        kept(&[(1, 70), (5, 80), (11, 90)]),
        leaves(&[(1, 70), (11, 90)])
    );
    assert_eq!(
        kept(&[(1, 90), (5, 80), (10, 70)]),
        leaves(&[(10, 70), (1, 90)])
    );
    let six = [(1, 60), (11, 50), (21, 40), (31, 30), (41, 20), (51, 70)];
    assert_eq!(
        kept(&six),
        leaves(&[(41, 20), (31, 30), (21, 40), (11, 50)])
    );
}

/// Returns the times, s, at which the leader's orders state that some relay is not in place. The leader agrees at 0
/// s, and every 5 s, until 300 s, gives orders after a renewal that reports `is_in_place(time)`.
#[cfg(feature = "departures")]
fn not_in_place(respacing_s: u64, is_in_place: impl Fn(u64) -> bool) -> Vec<u64> {
    let settings = Settings {
        respacing: Duration::from_millis(1_000 * respacing_s),
        ..Settings::default()
    };
    let member = Member::new(Mission::try_new(paper(3)).unwrap(), settings, 1);
    let mut lease = Lease::new(1, Instant::ZERO, &settings);
    lease.on_agreement(Instant::ZERO, true);
    let mut gives = |at_s: u64| {
        let context = context(&member, at_s);
        lease.requests = Some(Requests {
            in_place: is_in_place(at_s),
            ..Requests::NONE
        });
        lease.orders = lease.next_orders(&context);
        lease.orders.in_place
    };
    let all = (5..=300).step_by(5);
    all.filter(|at_s| !gives(*at_s)).collect()
}

/// Checks that a spare that never arrives is called no longer, for the proposer of a view of two.
///
/// The proposer keeps no quorum without a spare. If the spare never arrives, the other relay may leave.
#[cfg(feature = "departures")]
#[test]
fn a_called_spare_that_never_arrives_is_called_no_longer() {
    let settings = Settings::default();
    let mission = Mission::try_new(paper(3)).unwrap();
    let mut member = Member::new(mission, settings, 1);
    member.mission = mission.with_relays(2).unwrap();
    let mut lease = Lease::new(1, Instant::ZERO, &settings);
    lease.on_agreement(Instant::ZERO, true);
    let mut called = |at_s: u64, spare: u16| {
        let context = context(&member, at_s);
        lease.requests = Some(Requests {
            leaves: leaves(&[(1, u16::MAX)]),
            spares: nodes(&[spare]),
            in_place: true,
        });
        lease.orders = lease.next_orders(&context);
        assert_eq!(lease.orders.leavers, nodes(&[]), "{at_s} s");
        lease.orders.joiners[0]
    };
    assert_eq!([5, 10].map(|at_s| called(at_s, 3)), [0, 3]);
    assert_eq!(called(15, 0), 3);
    let most_s = longest_lease(&settings).as_micros() / 1_000_000;
    assert_eq!(called(most_s, 0), 3);
    assert_eq!(called(most_s + 10, 0), 0);
    assert_eq!(called(most_s + 20, 3), 3);
}

/// Checks that the leader calls a spare without a request to leave only if relays are too few. A spare that never arrives is called no longer.
#[cfg(feature = "departures")]
#[test]
fn a_spare_is_called_while_relays_are_too_few() {
    let called = |flying: u16, reports: &[(u64, u16)]| {
        let settings = Settings {
            flying,
            ..Settings::default()
        };
        let member = Member::new(Mission::try_new(paper(3)).unwrap(), settings, 1);
        let mut lease = Lease::new(1, Instant::ZERO, &settings);
        lease.on_agreement(Instant::ZERO, true);
        let mut joiners = Vec::new();
        for &(at_s, spare) in reports {
            lease.requests = Some(Requests {
                spares: nodes(&[spare]),
                ..Requests::NONE
            });
            lease.orders = lease.next_orders(&context(&member, at_s));
            assert_eq!(lease.orders.leavers, nodes(&[]));
            joiners.push(lease.orders.joiners[0]);
        }
        joiners
    };
    let most_s = longest_lease(&Settings::default()).as_micros() / 1_000_000;
    let reports = [(5, 0), (10, 5), (15, 0), (most_s + 5, 0), (most_s + 15, 0)];
    assert_eq!(called(0, &reports), [0; 5]);
    assert_eq!(called(3, &reports), [0; 5]);
    assert_eq!(called(4, &reports), [0, 5, 5, 5, 0]);
}

/// Checks that a relay that has waited too long is ordered to leave only while all relays are in place.
///
/// During a motion the neighbour toward Tx would wait for the fence beside the relay, and the neighbour toward Rx
/// would give it up. An order that was given remains.
#[cfg(feature = "departures")]
#[test]
fn a_late_departure_waits_for_the_end_of_a_motion() {
    let settings = Settings::default();
    let member = Member::new(Mission::try_new(paper(3)).unwrap(), settings, 1);
    let mut lease = Lease::new(1, Instant::ZERO, &settings);
    lease.on_agreement(Instant::ZERO, true);
    let mut ordered = |at_s: u64, endurance_s: u16, in_place: bool| {
        lease.requests = Some(Requests {
            leaves: leaves(&[(2, endurance_s)]),
            in_place,
            ..Requests::NONE
        });
        lease.orders = lease.next_orders(&context(&member, at_s));
        lease.orders.leavers[0]
    };
    assert_eq!([5, 10, 15].map(|at_s| ordered(at_s, 5, false)), [0; 3]);
    assert_eq!(ordered(20, 5, true), 2);
    assert_eq!(ordered(25, 0, false), 2);
}

/// Checks that no further relay is ordered to leave while relays move. The order that was given remains.
#[cfg(feature = "departures")]
#[test]
fn a_further_departure_waits_for_the_end_of_a_motion() {
    let settings = Settings {
        flying: 12,
        ..Settings::default()
    };
    let member = Member::new(Mission::try_new(paper(14)).unwrap(), settings, 1);
    let mut lease = Lease::new(1, Instant::ZERO, &settings);
    lease.on_agreement(Instant::ZERO, true);
    lease.orders.leavers = nodes(&[9]);
    let mut ordered = |at_s: u64, in_place: bool| {
        lease.requests = Some(Requests {
            leaves: leaves(&[(9, 0), (2, 50)]),
            in_place,
            ..Requests::NONE
        });
        lease.orders = lease.next_orders(&context(&member, at_s));
        lease.orders.leavers
    };
    let reports = [(5, false), (10, true), (15, true)];
    let expected = [nodes(&[9]), nodes(&[9]), nodes(&[9, 2])];
    assert_eq!(
        reports.map(|(at_s, in_place)| ordered(at_s, in_place)),
        expected
    );
}

/// Checks that as many relays leave at once as spares have joined, and that the leader leaves alone.
#[cfg(feature = "departures")]
#[test]
fn as_many_relays_leave_as_spares_have_joined() {
    let orders = |flying: u16, wishes: &[(u16, u16)], spares: &[u16]| {
        let settings = Settings {
            flying,
            ..Settings::default()
        };
        let member = Member::new(Mission::try_new(paper(20)).unwrap(), settings, 1);
        let mut lease = Lease::new(1, Instant::ZERO, &settings);
        lease.on_agreement(Instant::ZERO, true);
        lease.orders.in_place = true;
        lease.requests = Some(Requests {
            leaves: leaves(wishes),
            spares: nodes(spares),
            in_place: true,
        });
        let orders = lease.next_orders(&context(&member, 5));
        (orders.leavers, orders.joiners)
    };
    let three = [(19, 40), (8, 60), (2, 80)];
    assert_eq!(
        orders(20, &three, &[22, 23, 24, 25]),
        (nodes(&[]), nodes(&[22, 23, 24]))
    );
    assert_eq!(orders(20, &three, &[22]), (nodes(&[]), nodes(&[22])));
    assert_eq!(orders(20, &three, &[]), (nodes(&[19]), nodes(&[])));
    assert_eq!(orders(18, &three, &[22]), (nodes(&[19, 8]), nodes(&[])));
    assert_eq!(
        orders(11, &three, &[22]),
        (nodes(&three.map(|it| it.0)), nodes(&[]))
    );
    let with_leader = [(19, 40), (8, 60), (1, 80)];
    assert_eq!(orders(11, &with_leader, &[]).0, nodes(&[19, 8]));
    assert_eq!(orders(11, &[(1, 20), (19, 40)], &[]).0, nodes(&[1]));
}

/// Checks that a called spare comes before that of a relay with a more urgent request.
#[cfg(feature = "departures")]
#[test]
fn a_called_spare_comes_before_others() {
    let received = Requests {
        leaves: leaves(&[(9, 60)]),
        spares: nodes(&[7]),
        in_place: true,
    };
    let spares_if_called = |called: u16, gap: u16| {
        let own = OwnRequests {
            spare: 6,
            gap,
            ..own(4, None)
        };
        received.with(&own, nodes(&[called])).spares
    };
    // Spares 6 and 7 are in two gaps, or in one.
    let two = [0, 7, 6, 5].map(|called| spares_if_called(called, 1));
    assert_eq!(two, [[7, 6], [7, 6], [6, 7], [7, 6]].map(|all| nodes(&all)));
    let one = [0, 7, 6, 5].map(|called| spares_if_called(called, 4));
    assert_eq!(one, [7, 7, 6, 7].map(|spare| nodes(&[spare])));
}

/// Checks that relays that move after a later agreement of a view are not in place.
///
/// A single report after the time limit proves nothing: it does not restart the limit.
#[cfg(feature = "departures")]
#[test]
fn relays_in_place_are_asked_again_after_later_agreements() {
    let from_to = |from: u64, to: u64| (from..=to).step_by(5).collect::<Vec<_>>();
    let moved = from_to(105, 155);
    assert_eq!(not_in_place(0, |at_s| at_s <= 100), moved);
    assert_eq!(not_in_place(0, |at_s| at_s <= 100 || at_s == 200), moved);
    let twice = not_in_place(0, |at_s| at_s <= 100 || [200, 205].contains(&at_s));
    assert_eq!(twice, [moved, from_to(210, 260)].concat());
}

/// Checks that the slowest permitted motion ends before its relays count as in place.
#[cfg(feature = "departures")]
#[test]
fn relays_on_a_slow_motion_are_not_in_place() {
    let settings = Settings::default();
    let respacing_s = settings.dead_after.times(4).as_micros() / 1_000_000;
    let all = not_in_place(respacing_s, |at_s| at_s > respacing_s + 30);
    assert_eq!(all.last(), Some(&(respacing_s + 30)));
}
