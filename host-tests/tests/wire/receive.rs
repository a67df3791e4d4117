//! Relay that receives random data: each frame is counted once, without panics or setpoints.

use std::cell::Cell;
use std::collections::BTreeMap;

use host_tests::fixtures::{NETWORK, paper};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use uav_relay::wire::auth::TAG;
use uav_relay::wire::deframe::DeframeError;
use uav_relay::wire::frame::{self, Header};
use uav_relay::wire::message::Message;
use uav_relay::{Duration, Interference, MissionConfig, Port, Stats, Wiring};
use uav_relay_decode::envelope::sealed;

use super::bench::{Bench, OF_FRAMES, of_frames};
use super::config;
use super::kinds::FIELD;
use super::message::WireMessage;
use super::strategies::pieces;
use super::stream::{chunks, unstuffed};

/// Returns the name of the counter that a received frame must increment at relay `own` of 8. `chunk` has the bytes of
/// the frame between two delimiters.
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
    let Ok(message) = WireMessage::read(&checked[10..]) else {
        return "malformed";
    };
    match message.name() {
        "Hello" | "Claim" | "Watch" | "Report" => "received",
        // Only Tx and Rx send that.
        "Level" => "misaddressed",
        _ if neighbours.contains(&Some(sender)) => "received",
        _ => "misaddressed",
    }
}

/// Draws frame headers: mostly from the neighbours of relay 4 to this relay.
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

/// Sends random pieces of frames to relay `index` of 8. Asserts that each counter named in `expected` exceeds 5.
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
            let mut bench = Bench::of(mission, index, wiring);
            let mut streams: BTreeMap<String, Vec<u8>> = BTreeMap::new();
            let mut wanted = of_frames(&Stats::default());
            let wired = |port| (wiring == Wiring::Shared) == (port == Port::Shared);
            for (port, piece, wait_ms) in steps {
                let stream = streams.entry(format!("{port:?}")).or_default();
                for frame in piece.split_inclusive(|byte| *byte == 0) {
                    let silent = bench.is_passive();
                    let neighbours = bench.neighbours();
                    let now = bench.now;
                    bench.handle_bytes(now, port, frame);
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
                bench.sent();
                bench.now = bench.now + Duration::from_millis(wait_ms);
                let now = bench.now;
                bench.handle_timeout(now);
                bench.sent();
            }
            prop_assert_eq!(of_frames(bench.stats()), wanted.clone());
            prop_assert_eq!(bench.setpoint(), None);
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
fn every_frame_is_counted_once() {
    let of_air = OF_FRAMES;
    let mut on_links = of_air.to_vec();
    on_links.retain(|name| *name != "overheard");
    let links = &[Port::Upstream, Port::Downstream];
    for interference in [paper(8).interference, Interference::Field(FIELD)] {
        fed_with_anything(interference, 4, Wiring::Pair, links, &on_links);
        fed_with_anything(interference, 1, Wiring::Pair, links, &["misaddressed"]);
        fed_with_anything(interference, 4, Wiring::Shared, &[Port::Shared], &of_air);
    }
}

#[test]
fn bytes_at_an_unused_port_are_dropped() {
    let all = &[Port::Upstream, Port::Downstream, Port::Shared];
    for wiring in [Wiring::Pair, Wiring::Shared] {
        fed_with_anything(paper(8).interference, 4, wiring, all, &["received"]);
    }
}
