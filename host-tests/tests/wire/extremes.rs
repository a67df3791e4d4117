//! Coverage of the golden vectors: every kind of message with all extremes.

use super::codec::{
    Call, Decided, Greeting, Handed, Heard, Judged, Proposed, Said, Shifted, SizedView, Swept,
};
use super::offer::Offer;

use super::golden::*;

#[test]
#[expect(clippy::too_many_lines, reason = "a line or more for each message")]
fn the_vectors_hold_every_kind_and_every_extreme() {
    let frames = vectors().frames;
    let some = |what: fn(&Said) -> bool| {
        assert!(frames.iter().any(|vector| what(&vector.message)));
    };
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.reaches.len() == 16));
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.gap == 0 && sweep.reaches.len() == 1));
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.reaches.is_empty()));
    some(|said| matches!(said, Said::Sweep(Swept { gap: 255, .. })));
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.anchor == f32::MIN_POSITIVE));
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.anchor == f32::MAX));
    some(
        |said| matches!(said, Said::Verdict(Judged { commit: None, slacks, .. }) if slacks.is_empty()),
    );
    some(
        |said| matches!(said, Said::Verdict(Judged { commit: Some(15), slacks, .. }) if slacks.len() == 16),
    );
    some(|said| matches!(said, Said::Busy { .. }));
    some(|said| {
        matches!(
            said,
            Said::Heartbeat {
                ask: 1..,
                answer: 0,
                ..
            }
        )
    });
    some(|said| {
        matches!(
            said,
            Said::Heartbeat {
                ask: 0,
                answer: 1..,
                ..
            }
        )
    });
    some(|said| {
        matches!(
            said,
            Said::Heartbeat {
                ask: u16::MAX,
                answer: u16::MAX,
                ..
            }
        )
    });
    some(|said| matches!(said, Said::Pulse { lease: 1, .. }));
    some(|said| {
        matches!(
            said,
            Said::Pulse {
                lease: u16::MAX,
                ..
            }
        )
    });
    some(|said| matches!(said, Said::Pulsed { done: true, .. }));
    some(|said| matches!(said, Said::Pulsed { done: false, .. }));
    some(|said| matches!(said, Said::Measured { sweep, .. } if sweep.reaches.len() == 16));
    some(|said| matches!(said, Said::Measured { upsilon_per_w, .. } if *upsilon_per_w == 1e-9));
    some(|said| matches!(said, Said::Measured { upsilon_per_w, .. } if *upsilon_per_w == 1e32));
    some(|said| matches!(said, Said::Aside { sweep, .. } if sweep.reaches.len() == 16));
    some(
        |said| matches!(said, Said::Aside { y_m, sweep } if *y_m == -1e5 && sweep.reaches.is_empty()),
    );
    some(|said| matches!(said, Said::Aside { y_m, .. } if *y_m == 1e5));
    for count in [0, 1, 8] {
        assert!(frames.iter().any(
            |vector| matches!(&vector.message, Said::Gather(seats) if seats.seats.len() == count)
        ));
        assert!(frames.iter().any(
            |vector| matches!(&vector.message, Said::Gathered(seats) if seats.seats.len() == count)
        ));
    }
    some(|said| matches!(said, Said::Gather(seats) if seats.after > 0));
    some(|said| matches!(said, Said::Gather(seats) if seats.seats.contains(&(1000, 1e5, 1e6))));
    some(|said| matches!(said, Said::Gathered(seats) if seats.seats.contains(&(1, 0.1, 1e-6))));
    some(
        |said| matches!(said, Said::Gathered(seats) if seats.seats.iter().any(|seat| seat.1 == 0.0)),
    );
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.anchor < 0.0));
    some(|said| matches!(said, Said::Verdict(Judged { stand: None, .. })));
    some(|said| matches!(said, Said::Verdict(Judged { stand: Some(x_m), .. }) if *x_m == 0.0));
    some(|said| matches!(said, Said::Verdict(Judged { stand: Some(x_m), .. }) if *x_m == 1e6));
    some(|said| matches!(said, Said::Verdict(Judged { own: true, .. })));
    some(|said| matches!(said, Said::Verdict(Judged { own: false, .. })));
    some(|said| matches!(said, Said::Token(Handed { turn: 0, .. })));
    some(|said| matches!(said, Said::Token(Handed { turn: 1, .. })));
    some(|said| {
        matches!(
            said,
            Said::Token(Handed {
                turn: 2,
                columns: 0,
                ..
            })
        )
    });
    some(|said| {
        matches!(
            said,
            Said::Token(Handed {
                turn: 2,
                columns: 2,
                rows: 255,
                ..
            })
        )
    });
    some(|said| matches!(said, Said::Moved(Shifted { any: true, .. })));
    some(|said| matches!(said, Said::Moved(Shifted { worst, .. }) if *worst == f32::MAX));
    let longest = |of_four: bool| {
        let known = frames
            .iter()
            .filter(|vector| !of_four || bytes(&vector.body)[0] < 4);
        known.map(|vector| vector.wire().len()).max()
    };
    assert_eq!(longest(true), Some(100));
    assert_eq!(longest(false), Some(129));
}

#[test]
fn the_vectors_hold_every_hello_proposal_and_decision() {
    const MOST: SizedView = SizedView {
        id: u32::MAX - 0x17,
        relays: 1000,
    };
    const BEFORE: SizedView = SizedView {
        id: MOST.id - 1,
        ..MOST
    };
    const LAST: Call = Call {
        of: (u16::MAX, u16::MAX),
        view: MOST.id,
        place: 1000,
    };
    let frames = vectors().frames;
    let some = |what: fn(&Said) -> bool| {
        assert!(frames.iter().any(|vector| what(&vector.message)));
    };
    for flags in [0, 9, 21, 25, 27, 31] {
        assert!(
            frames
                .iter()
                .any(|vector| matches!(vector.message, Said::Hello(hello) if hello.flags == flags))
        );
    }
    some(|said| {
        matches!(said, Said::Hello(hello) if *hello == Greeting {
            mission: u16::MAX,
            neighbour: 1000,
            behind: 1000,
            newest: u32::MAX,
            holds: (u16::MAX, u16::MAX),
            nonce: u16::MAX,
            hears: 15,
            flags: 31,
        })
    });
    some(|said| matches!(said, Said::Hello(hello) if hello.holds.1 == 0 && hello.flags & 16 != 0));
    some(|said| matches!(said, Said::Hello(hello) if hello.holds.1 > 0 && hello.flags & 16 == 0));
    some(|said| matches!(said, Said::Hello(hello) if hello.hears == 5));
    some(
        |said| matches!(said, Said::Proposal(proposal) if proposal.agreed.id == 0 && !proposal.proposer),
    );
    some(|said| matches!(said, Said::Proposal(proposal) if proposal.successor.is_none()));
    some(|said| {
        matches!(said, Said::Proposal(proposal) if *proposal == Proposed {
            call: LAST,
            agreed: BEFORE,
            votes: 1000,
            lease_left: u16::MAX,
            rest: u16::MAX,
            proposer: true,
            successor: Some((BEFORE.id, BEFORE)),
        })
    });
    some(|said| matches!(said, Said::Hello(hello) if hello.behind == 1 && hello.nonce == 0));
    some(|said| matches!(said, Said::Proposal(proposal) if proposal.rest == 0));
    some(|said| matches!(said, Said::Decision(decision) if decision.view.is_none()));
    some(|said| matches!(said, Said::Decision(decision) if decision.base.id == 0));
    some(|said| {
        matches!(
            said,
            Said::Decision(Decided { call, view: Some(view), .. }) if view.id != call.view
        )
    });
    some(|said| {
        matches!(said, Said::Decision(decision) if *decision == Decided {
            call: LAST,
            base: BEFORE,
            view: Some(MOST),
            there: 1000,
            lease_left: u16::MAX,
        })
    });
}

#[test]
fn the_vectors_hold_offers_of_every_extreme() {
    let frames = vectors().frames;
    let some = |what: fn(&Offer) -> bool| {
        assert!(
            frames
                .iter()
                .any(|vector| matches!(&vector.message, Said::Offer(offer) if what(offer)))
        );
    };
    some(|offer| offer.version == 1 && offer.relays == 1 && offer.distance_m == 1.0);
    some(|offer| offer.version == u16::MAX && offer.relays == 1000 && offer.distance_m == 1e6);
    some(|offer| offer.mu_los == 1e30 && offer.mu_nlos == 1e50);
    some(|offer| offer.mu_los == 1e-3 && offer.mu_nlos == offer.eta);
    some(|offer| offer.least_m < offer.most_m && offer.eta < offer.mu_nlos);
    some(|offer| offer.least_m == offer.most_m && offer.eta > offer.mu_los);
    some(|offer| offer.x_m < 0.0 && offer.interferer_w == 1e-6);
    some(|offer| offer.y_m < 0.0 && offer.interferer_w == 1e9);
    some(|offer| offer.left_m == -1e5 && offer.right_m == 1e5);
    some(|offer| offer.left_m == 0.0 && offer.right_m == 0.0);
    some(|offer| offer.left_m < 0.0 && offer.right_m == 0.0);
    some(|offer| offer.noise_w > 0.0);
    some(|offer| [offer.interferer_w, offer.x_m, offer.y_m] == [0.0; 3]);
    some(|offer| offer.sites == [0; 6]);
    some(|offer| offer.sites[..3] == [900_000_000, 1_800_000_000, i32::MAX]);
    some(|offer| offer.sites[3..] == [-900_000_000, -1_800_000_000, i32::MIN]);
    some(|offer| offer.sites[..3] != offer.sites[3..]);
    some(|offer| offer.answer == 0);
    some(|offer| offer.answer == u16::MAX);
}

#[test]
fn the_vectors_hold_hearings_of_every_belief_and_extreme() {
    let frames = vectors().frames;
    let some = |what: fn(&Heard) -> bool| {
        assert!(frames.iter().any(|vector| match &vector.message {
            Said::Sense(heard) | Said::Sensed(heard) => what(heard),
            _ => false,
        }));
    };
    some(|heard| heard.kind == 0 && heard.told == 0);
    some(|heard| heard.kind == 1);
    some(|heard| heard.kind == 2);
    some(|heard| heard.kind == 3);
    some(|heard| heard.kind == 4 && heard.source == [1e9, 1e7, -1e7, 1e6]);
    some(|heard| heard.kind == 4 && heard.source == [1e-6, -1e7, 1e7, 1e-30]);
    some(|heard| heard.kind == 4 && heard.source[3] == 0.0);
    some(|heard| heard.sums == [0.0; 18]);
    some(|heard| heard.sums.map(f32::abs) == [f32::MAX; 18] && heard.sums[2] < 0.0);
    // The sums differ, each in its place.
    some(|heard| {
        let mut sums = heard.sums.map(f32::to_bits);
        sums.sort_unstable();
        sums.windows(2).all(|two| two[0] < two[1])
    });
    some(|heard| heard.receiver == [1e6, 1e9] && heard.off == 4094);
    some(|heard| heard.receiver[0] == 1e-30);
    some(|heard| heard.receiver == [0.0, 0.0] && heard.off == 0);
}
