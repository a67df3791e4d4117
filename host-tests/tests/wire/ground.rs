//! Messages between the ground stations at Tx and Rx and a relay.

use uav_relay::wire::digest::digest;
use uav_relay::{Event, Port, Relay, Wiring};

use super::codec::Said;
use super::kinds::{FIRST, one_of_each};
use super::receive::{counted, relay};
use super::signed::{Peer, said, with_key};
use super::uploads::{NOW, held, hello, mission_id, upload};
use super::votes::{ASKS, FLIES, FORMS, FRESH, READY, between, events, long};

/// Returns the messages of relay 1 to Tx, or of relay 8 to Rx.
fn told(relay: &mut Relay, ground: u16) -> Vec<Said> {
    let told = said(relay, NOW);
    let told = told.into_iter().filter(|(to, _)| *to == ground);
    told.map(|(_, said)| said).collect()
}

#[test]
fn tx_and_rx_offer_and_ask_and_are_told() {
    for (own, ground, port) in [
        (1, 0, Port::Upstream),
        (8, 9, Port::Downstream),
        (1, 0, Port::Shared),
        (4, 0, Port::Shared),
        (5, 9, Port::Shared),
        (8, 9, Port::Shared),
    ] {
        let wiring = match port {
            Port::Shared => Wiring::Shared,
            _ => Wiring::Pair,
        };
        let mut relay = with_key(own, wiring);
        let base = digest(relay.mission());
        let mut ground_peer = Peer::meets(&mut relay, own, ground, port);
        // Its other side is still silent; and a leader awaits no pass.
        let flags = if own == 1 { 0 } else { FRESH };
        assert_eq!(told(&mut relay, ground), [], "it has only become known");
        // The hello counts the relays connected away from the ground station: only itself while it is fresh.
        let behind = if own == 1 { 8 } else { 1 };
        let first = long(behind, hello(base, 0, (base, 0), flags | FLIES));
        ground_peer.says(&mut relay, NOW, &hello(base, 0, (1, 1), READY));
        assert_eq!(told(&mut relay, ground), [], "it has not asked");
        ground_peer.says(&mut relay, NOW, &hello(base, 0, (1, 1), ASKS | FORMS));
        assert_eq!(told(&mut relay, ground), [first], "{own}");
        assert_eq!(events(&mut relay), []);
        let newer = upload(1, base);
        ground_peer.says(&mut relay, NOW, &Said::Offer(newer));
        assert_eq!(held(&relay), Some(mission_id(&newer)));
        assert_eq!(events(&mut relay), [Event::Uploaded]);
        let holds = long(behind, hello(base, 0, mission_id(&newer), flags));
        let taken = told(&mut relay, ground);
        assert_eq!(taken, std::slice::from_ref(&holds), "{own}");
        ground_peer.says(&mut relay, NOW, &Said::Offer(newer));
        assert_eq!(told(&mut relay, ground), [holds], "{own}: once more");
        assert_eq!(counted(relay.stats()), ["received"]);
        assert!(!relay.neighbours().contains(&Some(ground)));
    }
}

#[test]
fn what_tx_and_rx_may_not_say_is_misaddressed() {
    let mut relay = with_key(1, Wiring::Pair);
    let base = digest(relay.mission());
    let peer = Peer::meets(&mut relay, 1, 0, Port::Upstream);
    said(&mut relay, NOW);
    for one in one_of_each(FIRST, base) {
        let mut after = relay.clone();
        peer.clone().says(&mut after, NOW, &one);
        let expected = match one {
            Said::Hello(_) | Said::Offer(_) | Said::Level { .. } => "received",
            _ => "misaddressed",
        };
        assert_eq!(counted(after.stats()), [expected], "{one:?}");
        // The relay does not listen.
        let refused = u32::from(matches!(one, Said::Level { .. }));
        assert_eq!(after.stats().samples_rejected, refused, "{one:?}");
    }
    for one in [
        Said::Offer(upload(1, base ^ 1)),
        hello(base ^ 1, 0, (1, 1), ASKS),
        Said::Level {
            mission: base ^ 1,
            power_w: 1e-9,
        },
    ] {
        let mut after = relay.clone();
        peer.clone().says(&mut after, NOW, &one);
        assert_eq!(counted(after.stats()), ["mission", "received"], "{one:?}");
        assert_eq!((said(&mut after, NOW), held(&after)), (vec![], None));
    }
}

#[test]
fn tx_and_rx_are_heard_by_the_nearest_with_a_key_alone() {
    for (own, ground, port) in [
        (2, 0, Port::Upstream),
        (7, 9, Port::Downstream),
        (5, 0, Port::Shared),
        (4, 9, Port::Shared),
    ] {
        let wiring = match port {
            Port::Shared => Wiring::Shared,
            _ => Wiring::Pair,
        };
        let mut far = with_key(own, wiring);
        let offer = Said::Offer(upload(1, digest(far.mission())));
        let bytes = between(ground, own, &offer);
        far.handle_bytes(NOW, port, &bytes);
        assert_eq!(counted(far.stats()), ["misaddressed"], "{own}");
        let own = own.abs_diff(ground).min(4).abs_diff(ground);
        let mut near = relay(own, 8, Wiring::Shared);
        let bytes = between(ground, own, &offer);
        near.handle_bytes(NOW, Port::Shared, &bytes);
        assert_eq!(counted(near.stats()), ["misaddressed"], "{own}");
    }
}
