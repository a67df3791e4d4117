//! Messages of each kind, and a relay to receive them.

use host_tests::fixtures::{NETWORK, paper};
use uav_relay::wire::digest::digest;
use uav_relay::wire::frame;
use uav_relay::wire::frame::{Header, MAX_FRAME};
use uav_relay::{
    Band, Duration, Field, FieldPoint, Instant, Interference, MissionConfig, Port, Relay, Wiring,
};

use super::codec::{
    Fenced, Greeting, Handed, Heard, Judged, Said, Seats, Shifted, Swept, plain, wire,
};
use super::offer::{Offer, offer};
use super::receive::{drain, relay_of};
use super::stream::unstuffed;
use super::votes::{granted, id, proposed};

/// Field with almost no interference.
pub(crate) const WEAK: Field = Field::new(&[FieldPoint {
    x_m: 0.0,
    upsilon_per_w: 1e32,
}]);

/// Numbers of the first two passes of a leader's life.
pub(crate) const FIRST: u16 = 64;
pub(crate) const SECOND: u16 = 65;

/// Returns the paper's scenario with another interference, a band of 20 m to 300 m, and lateral room.
pub(crate) fn mission(interference: Interference) -> MissionConfig {
    MissionConfig {
        interference,
        band: Band {
            least_m: 20.0,
            most_m: 300.0,
        },
        lateral: Band {
            least_m: -60.0,
            most_m: 40.0,
        },
        ..paper(8)
    }
}

/// Returns the paper's scenario with its interferer, a band of 20 m to 300 m, and lateral room.
pub(crate) fn source() -> MissionConfig {
    mission(paper(8).interference)
}

/// Encodes a frame to relay `own` from the side of `port`.
pub(crate) fn framed(own: u16, port: Port, said: &Said) -> Vec<u8> {
    let header = Header {
        network: NETWORK,
        sender: if port == Port::Upstream {
            own - 1
        } else {
            own + 1
        },
        destination: own,
        counter: 0,
    };
    wire(&plain(header, &said.body()))
}

/// Returns the ports and messages that `relay` sends at `now`, without claims.
pub(crate) fn sent(relay: &mut Relay, now: Instant) -> Vec<(Port, Said)> {
    let mut out = sent_with_claims(relay, now);
    out.retain(|(_, said)| !matches!(said, Said::Claim { .. }));
    out
}

/// Returns the ports and messages that `relay` sends at `now`.
pub(crate) fn sent_with_claims(relay: &mut Relay, now: Instant) -> Vec<(Port, Said)> {
    let mut out = Vec::new();
    let mut buffer = [0; MAX_FRAME];
    relay.persist(|_| true);
    while let Some(transmit) = relay.poll_transmit(now, &mut buffer) {
        let plain = unstuffed(&buffer[..transmit.len - 1]).unwrap();
        assert!(frame::decode(&plain).is_ok());
        let said = Said::read(&plain[10..plain.len() - 4]).unwrap();
        out.push((transmit.port, said));
    }
    out
}

/// Advances time until `relay` is idle, at most a second. Returns the messages sent.
pub(crate) fn settle(relay: &mut Relay, now: &mut Instant) -> Vec<(Port, Said)> {
    let mut out = sent(relay, *now);
    for _ in 0..1000 {
        *now = *now + Duration::from_millis(1);
        relay.handle_timeout(*now);
        out.extend(sent(relay, *now));
    }
    out
}

/// Returns a collection with the profile of relay `index`.
pub(crate) fn seats(number: u16, mission: u16, index: u16) -> Seats {
    Seats {
        number,
        view_digest: mission,
        after: 0,
        seats: vec![(index, 30.0, 0.5)],
    }
}

/// Returns the echo of a claim to the receiver's number.
const fn an_echo() -> Said {
    Said::Claim {
        number: 1,
        other_number: 0,
        flags: 2,
    }
}

/// Returns two relays' measurements of a source that all estimate alike.
pub(crate) fn heard(number: u16, mission: u16) -> Heard {
    let mut sums = [0.0; 18];
    [sums[0], sums[14], sums[15], sums[16], sums[17]] = [2.0, 0.5, 2.0, 64.0, 3.0];
    Heard {
        number,
        view_digest: mission,
        estimate: 1,
        kind: 4,
        source: [62.5, 600.0, -250.0, 1e-6],
        sums,
        receiver: [1e-6, 32.0],
        excluded: 0,
    }
}

/// Returns a message of each tag for the pass `number`.
pub(crate) fn one_of_each(number: u16, mission: u16) -> Vec<Said> {
    let x_m = 400.0;
    let altitude_m = 20.0;
    let power_w = 1.0;
    let view = id(u32::from(number).max(1), 1);
    let sweep = Swept {
        number,
        view_digest: mission,
        anchor: 1.0,
        gap: 0,
        growth: 0,
        altitude_m,
        power_w,
        reaches: vec![x_m],
    };
    vec![
        Said::Sweep(sweep.clone()),
        Said::Verdict(Judged {
            number,
            view_digest: mission,
            own: false,
            commit: Some(0),
            slacks: vec![1.0],
            stand: None,
        }),
        Said::Busy { number },
        Said::Heartbeat {
            mission,
            request: 0,
            reply: 0,
        },
        Said::Measured {
            sweep: sweep.clone(),
            upsilon_per_w: 1e8,
        },
        Said::Aside { sweep, y_m: -12.5 },
        Said::Gather(seats(number, mission, 3)),
        Said::Gathered(seats(number, mission, 5)),
        Said::Token(Handed {
            number,
            view_digest: mission,
            x_m,
            altitude_m,
            power_w,
            turn: 2,
            explore_m: 10.0,
            columns: 0,
            rows: 0,
            sir: 1.0,
        }),
        Said::Moved(Shifted {
            number,
            view_digest: mission,
            x_m: 600.0,
            altitude_m,
            any: true,
            worst: 1.0,
        }),
        Said::Hello(Greeting {
            mission,
            neighbour: 4,
            behind: 1,
            latest_view: view,
            latest_mission: (mission, 0),
            offer_number: 0,
            hears: 1,
            flags: 16,
        }),
        Said::Proposal(proposed(view, (mission, 0), 3, 8)),
        granted(view, (mission, 0), 5, 8),
        Said::Fence(Fenced {
            association: 1,
            line_digest: mission,
            echo: 0,
            number: 1,
            places: [x_m, x_m, 1.0, 1.0, 1.0],
            flags: 3,
        }),
        Said::Offer(Offer {
            base: mission,
            ..offer()
        }),
        Said::Pulse {
            number,
            view_digest: mission,
            lease: 150,
        },
        Said::Pulsed {
            number,
            view_digest: mission,
            done: true,
        },
        Said::Sense(heard(number, mission)),
        Said::Sensed(heard(number, mission)),
        Said::Level {
            mission,
            power_w: 1e-9,
        },
        an_echo(),
    ]
}

/// Returns relay 4 of 8 and the ports from and to which passes go.
pub(crate) fn relay_4(config: MissionConfig) -> (Relay, Port, Port) {
    let relay = relay_of(config, 4, Wiring::Pair);
    match config.interference {
        Interference::Source(_) | Interference::Unknown => {
            (relay, Port::Upstream, Port::Downstream)
        }
        Interference::Field(_) => (relay, Port::Downstream, Port::Upstream),
    }
}

/// Makes `relay` hold its position by pass `number`.
pub(crate) fn placed(relay: &mut Relay, (from, to): (Port, Port), now: &mut Instant, number: u16) {
    let kinds = one_of_each(number, digest(relay.mission()));
    for (port, said) in [(from, &kinds[0]), (to, &kinds[1])] {
        relay.handle_bytes(*now, port, &framed(4, port, said));
        drain(relay, *now);
    }
    assert!(relay.setpoint().is_some());
}
