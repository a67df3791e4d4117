//! Relay that receives random data: each frame is counted once, without panics or setpoints.

use std::cell::Cell;
use std::collections::BTreeMap;

use host_tests::fixtures::{self, NETWORK, paper};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use uav_relay::wire::auth::TAG;
use uav_relay::wire::deframe::DeframeError;
use uav_relay::wire::frame::{self, Header, MAX_FRAME};
use uav_relay::wire::message::Message;
use uav_relay::{
    Duration, Field, FieldPoint, Instant, Interference, Mission, MissionConfig, Port, Relay,
    Settings, Stats, Wiring,
};

use super::codec::{Said, sealed};
use super::config;
use super::stream::{chunks, unstuffed};
use super::stream_strategies::pieces;

/// Field in which a chain of eight is feasible.
pub(crate) const FIELD: Field = Field::new(&[
    FieldPoint {
        x_m: -100.0,
        upsilon_per_w: 1e8,
    },
    FieldPoint {
        x_m: 500.0,
        upsilon_per_w: 3e7,
    },
    FieldPoint {
        x_m: 900.0,
        upsilon_per_w: 2e8,
    },
]);

/// Returns relay `index` of `relays` in the paper's scenario, on network 7.
pub(crate) fn relay(index: u16, relays: u16, wiring: Wiring) -> Relay {
    relay_of(paper(relays), index, wiring)
}

pub(crate) fn relay_of(mission: MissionConfig, index: u16, wiring: Wiring) -> Relay {
    let mission = Mission::try_new(mission).unwrap();
    let settings = Settings {
        wiring,
        ..Settings::default()
    };
    fixtures::relay(mission, index, settings)
}

/// Returns the counters of which each received frame increments one.
fn of_frames(stats: &Stats) -> [(&'static str, u32); 9] {
    [
        ("crc", stats.crc),
        ("foreign", stats.foreign),
        ("malformed", stats.malformed),
        ("misaddressed", stats.misaddressed),
        ("overheard", stats.overheard),
        ("oversized", stats.oversized),
        ("received", stats.received),
        ("truncated", stats.truncated),
        ("version", stats.version),
    ]
}

/// Returns the names of the reception counters above zero.
pub(crate) fn counted(stats: &Stats) -> Vec<&'static str> {
    let of_messages = [
        ("misdirected", stats.misdirected),
        ("mission", stats.mission),
        ("repeated", stats.repeated),
        ("stale", stats.stale),
        // Messages at a relay without a key.
        ("unsigned", stats.unsigned),
        ("view", stats.view),
    ];
    let mut names: Vec<&str> = of_frames(stats)
        .into_iter()
        .chain(of_messages)
        .filter_map(|(name, count)| (count > 0).then_some(name))
        .collect();
    names.sort_unstable();
    names
}

/// Returns the documented counter for the bytes between two delimiters, at relay `own` of 8.
fn by_the_rules(chunk: &[u8], own: u16, neighbours: [Option<u16>; 2], port: Port) -> &'static str {
    let plain = match unstuffed(chunk) {
        Ok(plain) => plain,
        Err(DeframeError::Oversized) => return "oversized",
        Err(_) => return "truncated",
    };
    let Some(bytes) = plain.len().checked_sub(4).filter(|&bytes| bytes >= 10) else {
        return "truncated";
    };
    let checked = &plain[..bytes];
    if sealed(checked.to_vec()) != plain {
        return "crc";
    }
    let word = |at: usize| u16::from(checked[at]) | u16::from(checked[at + 1]) << 8;
    let flags = word(2) >> 12;
    if word(0) >> 12 != 1 || ![0, 1, 3].contains(&flags) {
        return "version";
    }
    if flags != 0 && bytes < 10 + TAG {
        return "truncated";
    }
    if word(4) != NETWORK {
        return "foreign";
    }
    if word(2) & 0x0FFF != own {
        return if port == Port::Shared {
            "overheard"
        } else {
            "misaddressed"
        };
    }
    let sender = word(0) & 0x0FFF;
    let near = match port {
        Port::Upstream => sender == own - 1,
        Port::Downstream => sender == own + 1,
        Port::Shared => sender != own && sender.abs_diff(own) <= 4,
    };
    if !near || !(1..=8).contains(&sender) {
        return "misaddressed";
    }
    if flags != 0 {
        return "version";
    }
    match Said::read(&checked[10..]) {
        Err(_) => "malformed",
        Ok(Said::Hello(_) | Said::Claim { .. }) => "received",
        // Only Tx and Rx send that.
        Ok(Said::Level { .. }) => "misaddressed",
        Ok(_) if neighbours.contains(&Some(sender)) => "received",
        Ok(_) => "misaddressed",
    }
}

/// Sends all pending frames of the relay, which must be valid. Returns their number.
pub(crate) fn drain(relay: &mut Relay, now: Instant) -> usize {
    let mut sent = 0;
    let mut buffer = [0; MAX_FRAME];
    relay.persist(|_| true);
    while let Some(transmit) = relay.poll_transmit(now, &mut buffer) {
        let chunk = &buffer[..transmit.len - 1];
        let (header, _) = frame::decode(&unstuffed(chunk).unwrap()).unwrap();
        assert_eq!(header.network, NETWORK);
        sent += 1;
    }
    while relay.poll_event().is_some() {}
    assert!(relay.poll_timeout().is_none_or(|wake| wake > now));
    sent
}

/// Draws headers, mostly to relay 4 from its neighbours.
fn near_relay_4() -> impl Strategy<Value = Header> {
    let network = prop_oneof![8 => Just(NETWORK), 1 => any::<u16>()];
    let sender = prop_oneof![4 => Just(3), 4 => Just(5), 2 => 0..10_u16, 1 => 0..=4095_u16];
    let destination = prop_oneof![8 => Just(4), 1 => 0..10_u16, 1 => 0..=4095_u16];
    (network, sender, destination, any::<u32>()).prop_map(
        |(network, sender, destination, counter)| Header {
            network,
            sender,
            destination,
            counter,
        },
    )
}

/// Feeds relay `index` of 8 with random pieces; all counters of `expected` must occur.
fn fed_with_anything(
    interference: Interference,
    index: u16,
    wiring: Wiring,
    ports: &'static [Port],
    expected: &[&str],
) {
    let mission = MissionConfig {
        interference,
        ..paper(8)
    };
    let seen = Cell::new(BTreeMap::new());
    let steps = (
        proptest::sample::select(ports),
        pieces(near_relay_4()),
        0..2000_u64,
    );
    TestRunner::new(config(400))
        .run(&vec(steps, 0..24), |steps| {
            let mut relay = relay_of(mission, index, wiring);
            let mut streams: BTreeMap<String, Vec<u8>> = BTreeMap::new();
            let mut wanted = of_frames(&Stats::default()).map(|(name, _)| (name, 0));
            let wired = |port| (wiring == Wiring::Shared) == (port == Port::Shared);
            let mut now = Instant::ZERO;
            for (port, piece, wait_ms) in steps {
                let stream = streams.entry(format!("{port:?}")).or_default();
                for frame in piece.split_inclusive(|byte| *byte == 0) {
                    let silent = relay.is_passive();
                    let neighbours = relay.neighbours();
                    relay.handle_bytes(now, port, frame);
                    stream.extend(frame);
                    for chunk in chunks(stream).into_iter().filter(|_| wired(port)) {
                        // A passive relay accepts claims too.
                        let decoded = unstuffed(chunk).map(|plain| frame::decode(&plain));
                        let claims = matches!(decoded, Ok(Ok((_, Message::Claim(_)))));
                        let name = match by_the_rules(chunk, index, neighbours, port) {
                            "received" if silent && !claims => "misaddressed",
                            name => name,
                        };
                        let counter = wanted.iter_mut().find(|(other, _)| *other == name);
                        counter.unwrap().1 += 1;
                    }
                    let rest = stream.iter().rposition(|&byte| byte == 0);
                    stream.drain(..rest.map_or(0, |end| end + 1));
                }
                drain(&mut relay, now);
                now = now + Duration::from_millis(wait_ms);
                relay.handle_timeout(now);
                drain(&mut relay, now);
            }
            prop_assert_eq!(of_frames(relay.stats()), wanted);
            prop_assert_eq!(relay.setpoint(), None);
            let mut all = seen.take();
            for (name, count) in wanted {
                *all.entry(name).or_insert(0) += count;
            }
            seen.set(all);
            Ok(())
        })
        .unwrap();
    let seen = seen.take();
    println!("{seen:?}");
    for name in expected {
        assert!(seen[name] > 5, "{name} hardly ever happened");
    }
}

#[test]
fn with_two_links_every_frame_is_counted_once() {
    let expected = [
        "crc",
        "foreign",
        "malformed",
        "misaddressed",
        "oversized",
        "received",
        "truncated",
        "version",
    ];
    let ports = &[Port::Upstream, Port::Downstream];
    for interference in [paper(8).interference, Interference::Field(FIELD)] {
        fed_with_anything(interference, 4, Wiring::Pair, ports, &expected);
        fed_with_anything(interference, 1, Wiring::Pair, ports, &["misaddressed"]);
    }
}

#[test]
fn on_a_shared_channel_every_frame_is_counted_once() {
    let expected = [
        "crc",
        "foreign",
        "malformed",
        "misaddressed",
        "overheard",
        "oversized",
        "received",
        "truncated",
        "version",
    ];
    for interference in [paper(8).interference, Interference::Field(FIELD)] {
        fed_with_anything(interference, 4, Wiring::Shared, &[Port::Shared], &expected);
    }
}

#[test]
fn bytes_at_a_port_that_is_not_wired_are_dropped() {
    let all = &[Port::Upstream, Port::Downstream, Port::Shared];
    let interference = paper(8).interference;
    fed_with_anything(interference, 4, Wiring::Pair, all, &["received"]);
    fed_with_anything(interference, 4, Wiring::Shared, all, &["received"]);
}
