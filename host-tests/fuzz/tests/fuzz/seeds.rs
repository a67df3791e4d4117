//! Seeds of the corpora: golden frames, recorded flights, the example scenarios.
//!
//! ```sh
//! cargo test -p uav-relay-fuzz --test fuzz -- --ignored write_the_seeds
//! cd host-tests
//! cargo +nightly fuzz run relay                # and so on, for as long as you like; then
//! cargo +nightly fuzz cmin relay -- -use_counters=0 -set_cover_merge=1
//! ```

use std::fs;

use uav_relay::MAX_FRAME;
use uav_relay::{Identity, Instant, Port, Relay, Settings};
use uav_relay_decode::vectors::{Frame, Vectors};
use uav_relay_fuzz::input::Input;
use uav_relay_fuzz::watch::NETWORK;
use uav_relay_fuzz::{TARGETS, setting};

use super::folder;

/// Number of frames taken from a simulated flight; they include several of each kind of pass message.
///
/// A pass is a message along the chain and back.
const FRAMES: usize = 24;

const MOST_WAKES: u8 = 64;

fn golden() -> Vec<Frame> {
    Vectors::load().unwrap().frames
}

/// Returns corpus inputs for the target `deframe`: test vectors, in one input with noise between them.
///
/// The first two bytes of an input are two lengths. The remaining bytes are cut alternately into pieces of these
/// lengths.
fn deframe() -> Vec<Vec<u8>> {
    let wires: Vec<_> = golden().into_iter().map(|frame| frame.wire).collect();
    let cut = |stream: &[u8]| [&[4, 9], stream].concat();
    let all = [
        &wires[0],
        &[5, 1, 0, 0][..],
        &wires[6],
        &[0x55; 260],
        &wires[16],
    ]
    .concat();
    let mut seeds: Vec<_> = wires.iter().map(|wire| cut(wire)).collect();
    seeds.push(cut(&all));
    seeds
}

/// Returns corpus inputs for the target `frame`: each test vector without its check sequence.
fn frame() -> Vec<Vec<u8>> {
    golden()
        .iter()
        .map(|frame| frame.plain[..frame.plain.len() - 4].to_vec())
        .collect()
}

fn scenario() -> Vec<Vec<u8>> {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples");
    ["scenario", "multi_interferer", "field", "altitudes"]
        .iter()
        .map(|name| fs::read(format!("{examples}/{name}.toml")).unwrap())
        .collect()
}

/// Returns the first bytes of inputs. They select mission, number of relays, method and parameters of Algorithm 2.
fn missions() -> Vec<Vec<u8>> {
    let align = (0..6).flat_map(|mission| [0, 8].map(|how| vec![mission, 3, how]));
    let joint = [1, 33, 65, 73].map(|how| vec![1, 3, how]);
    let adjust = [vec![1, 3, 2, 0, 2, 20, 0], vec![1, 3, 2, 65, 2, 20, 0, 5]];
    align.chain(joint).chain(adjust).collect()
}

/// Returns corpus inputs for the target `chain`.
///
/// Together they contain all missions and operations, frame faults and mission uploads. Rounds of messages come before
/// and after each operation.
fn chain() -> Vec<Vec<u8>> {
    let with = |mission: &[u8], operations: &[u8]| {
        // Seed, four relays without individual settings, to the end.
        [mission, &[1, 0], &[0; 4], &[3], operations].concat()
    };
    let mut seeds: Vec<_> = missions()
        .iter()
        .map(|mission| with(mission, &[0, 13, 127, 0, 13, 127]))
        .collect();
    // Each of the fifteen operations, between rounds.
    for operation in 0..15 {
        let operations = [0, 13, 9, 1, operation, 5, 1, 2, 0, 13, 60];
        seeds.push(with(&[1, 3, 1], &operations));
    }
    // Damaged, cut, lost, doubled and reordered frames, noise and a restart, on links and on one channel.
    let faults = [
        &[
            0, 13, 2, 1, 5, 3, 7, 0, 13, 2, 1, 6, 9, 1, 1, 0, 1, 7, 0, 3, 5, 1, 0,
        ][..],
        &[
            0, 13, 9, 1, 3, 2, 4, 1, 5, 5, 1, 2, 3, 0, 13, 40, 0, 10, 0, 13, 1,
        ],
        &[1, 5, 6, 2, 2, 6, 4, 0, 0, 13, 60],
    ]
    .concat();
    seeds.extend([0, 64].map(|how| with(&[0, 3, how], &faults)));
    // Signed frames: relay 2 receives a newer mission, and another one while relay 3 reboots.
    let uploads = [
        &[0, 13, 60, 1, 13, 0][..],
        &[0x99; 8],
        &[2, 11, 0, 13, 0],
        &[0x55; 8],
        &[0, 13, 127],
    ]
    .concat();
    seeds.extend([8, 72].map(|how| with(&[0, 3, how], &uploads)));
    // Relay 2 holds its altitude, so that profiles are collected.
    let mixed = |how| {
        let rounds = [0, 13, 127].repeat(8);
        [&[1, 3, how, 1, 0][..], &[0, 4, 0, 0], &[3], &rounds].concat()
    };
    seeds.extend([1, 65].map(mixed));
    seeds
}

/// Returns inputs for the target `relay`: frames of a chain's relays, and operations on one relay.
fn relay() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    for mission in missions() {
        for index in [1, 2, 4] {
            seeds.push(recorded(&mission, index));
        }
        // Wake-ups, a restart, samples, and each kind of message from either side.
        let mut operations = vec![3, 63, 7, 3, 9, 8, 100, 1, 0, 0, 200];
        for tag in 0..15 {
            operations.extend([9, tag % 2, tag, 0, 0, 0, 128, 0, 1, 0, 64, 0, 128, 0, 0]);
        }
        seeds.push([&*mission, &[0, 1, 0, 0, 1, 0, 1, 0], &operations].concat());
    }
    seeds.extend([0, 64].map(formed));
    seeds.extend([refused(), again()]);
    seeds.extend([8, 72].map(uploaded));
    seeds.extend([0, 3].map(by_the_ground));
    seeds
}

/// Returns the bytes of a mission offer to the tested relay from the neighbour at `side`.
///
/// The offer has the next mission version. Its mission is the paper's with the interferer at another position.
fn offer(side: u8) -> Vec<u8> {
    let head = [9, side, 14, 1, 0, 0, 1];
    let interferer = [0, 0, 128, 0, 0, 192, 0, 0, 64];
    [&head[..], &interferer, &[255, 1, 1, 0, 0]].concat()
}

/// Returns an input: the second of four relays, with a key, receives a new mission and adopts it.
///
/// The chain adopts the mission by a new view (membership of the chain). `how` is the input byte that selects the
/// signing key and the wiring.
fn uploaded(how: u8) -> Vec<u8> {
    let head = [0, 3, 0, 1, how, 0, 0, 0, 0, 1, 0];
    let asks = [9, 0, 10, 0, 2, 1, 0, 0, 0, 1, 1, 0];
    let hello = [9, 1, 10, 0, 2, 1, 0, 0, 0, 1, 0, 0];
    // The next view with the held mission: proposed by the leader, decided by the third relay.
    let proposal = [9, 0, 11, 0, 33, 1, 240, 4, 1, 0, 0, 1, 0, 0];
    let decision = [9, 1, 12, 0, 33, 3, 240, 4, 1, 33, 4, 4, 0, 0];
    let wake = [3, 3];
    let parts = [
        &head[..],
        &asks,
        &wake,
        &offer(0),
        &wake,
        &hello,
        &proposal,
        &decision,
        &wake,
    ];
    parts.concat()
}

/// Returns an input: an end relay of four receives two queries and two mission offers from the ground.
///
/// The relay has a signing key. `index` is the relay's index from 0: 0 is next to Tx, 3 next to Rx.
fn by_the_ground(index: u8) -> Vec<u8> {
    let head = [0, 3, 0, index, 8, 0, 0, 0, 0, 1, 0];
    let side = u8::from(index > 0);
    let asks = [9, side, 10, 0, 0, 1, 0, 0, 0, 0, 1, 0];
    let offer = offer(side);
    [&head[..], &asks, &offer, &asks, &offer, &[3, 9]].concat()
}

/// Returns an input: the last of four relays receives proposed views, a guard message and late frames.
///
/// A view is a membership of the chain. The relay has a collision guard and a position. `wiring` is the input byte that
/// selects the wiring.
fn formed(wiring: u8) -> Vec<u8> {
    let head = [0, 3, 0, 3, wiring, 32, 0, 0, 0, 0, 0, 1, 0];
    let position = [15, 0, 0, 0, 100, 0, 0, 20];
    // The view after its own, with the right digest, for the third position of four in view 0, whose leader is present.
    let proposal = [9, 0, 11, 1, 0, 3, 4, 224, 0, 1];
    let hello = [9, 0, 10, 1, 0, 3, 0, 5];
    let fence = [9, 0, 13, 7, 0, 100, 0, 0, 0, 128, 0, 0, 128];
    let late = [9, 0, 0, 0, 241, 0, 0, 64, 0, 128, 0, 0, 0, 0, 0];
    let far = [9, 46, 10, 1, 0, 4, 0, 9, 3, 8, 9, 46, 10, 1, 0, 4, 0, 9];
    let parts = [&head[..], &position, &proposal, &hello, &proposal, &fence];
    [&parts.concat()[..], &position, &late, &far, &[3, 60]].concat()
}

/// Returns an input: a relay with a signing key receives two frames that it refuses.
///
/// One frame has the digest of another mission; the other frame has no tag (signature).
fn refused() -> Vec<u8> {
    let head = [0, 3, 0, 1, 8, 0, 0, 0, 0, 1, 0];
    let other = [9, 0, 3, 255, 0, 0];
    let bare = [9, 0, 3, 0, 0, 11];
    [&head[..], &other, &bare].concat()
}

/// Returns an input: the second of four relays receives its leader's first sweep message twice.
fn again() -> Vec<u8> {
    let head = [0, 3, 0, 1, 0, 0, 0, 0, 0, 1, 0];
    let pass = [9, 192, 0, 250, 64, 0, 0, 0];
    let targets = [0, 0, 128, 1, 0, 0, 128, 0, 0, 128, 1, 1, 0, 0, 64];
    [&head[..], &pass, &targets].concat()
}

/// Returns an input with the frames that relay `index` receives in a simulated flight of a chain.
fn recorded(prefix: &[u8], index: u16) -> Vec<u8> {
    let mut input = Input::new(prefix);
    let mission = setting::mission(&mut input, 5).unwrap();
    let settings: Settings = setting::of_chain(&mut input, &mission);
    let mut relays: Vec<Relay> = (1..=mission.relays())
        .map(|index| {
            let identity = Identity {
                network: NETWORK,
                index,
            };
            Relay::new(mission, identity, settings, 1, Instant::ZERO).unwrap()
        })
        .collect();
    let own = u8::try_from(index).unwrap() - 1;
    let head = [prefix.get(..2).unwrap(), &[0, own]].concat();
    let mut seed = [&*head, &prefix[2..], &[0, 0, 0, 0, 1, 0]].concat();
    let (mut frames, mut wakes) = (0, 0_u8);
    while frames < FRAMES {
        let Some(now) = relays.iter().filter_map(Relay::poll_timeout).min() else {
            break;
        };
        if now > Instant::from_millis(4_000) {
            break;
        }
        wakes += u8::from(relays[usize::from(own)].poll_timeout() == Some(now));
        for relay in &mut relays {
            relay.handle_timeout(now);
        }
        let mut heard = Vec::new();
        frames += exchange(&mut relays, now, usize::from(own), &mut heard);
        // As many wake-ups as one operation may have.
        if wakes > 0 && (wakes == MOST_WAKES || !heard.is_empty()) {
            seed.extend([3, wakes - 1]);
            wakes = 0;
        }
        seed.extend(heard);
    }
    seed
}

/// Exchanges all pending frames. Appends the frames that relay `own` (from 0) receives to `seed`, and returns the
/// number of these frames.
fn exchange(relays: &mut [Relay], now: Instant, own: usize, seed: &mut Vec<u8>) -> usize {
    let (mut heard, mut said) = (0, true);
    let mut buffer = [0; MAX_FRAME];
    while said {
        said = false;
        for from in 0..relays.len() {
            relays[from].persist(|_| true);
            while let Some(transmit) = relays[from].poll_transmit(now, &mut buffer) {
                let bytes = &buffer[..transmit.len];
                said = true;
                let (to, port) = match transmit.port {
                    Port::Upstream => (from - 1..from, Port::Downstream),
                    Port::Downstream => (from + 1..from + 2, Port::Upstream),
                    Port::Shared => (0..relays.len(), Port::Shared),
                };
                for to in to.filter(|&to| to != from) {
                    relays[to].handle_bytes(now, port, bytes);
                    if to == own {
                        seed.extend([6, port as u8, u8::try_from(bytes.len()).unwrap()]);
                        seed.extend(bytes);
                        heard += 1;
                    }
                }
            }
        }
    }
    heard
}

/// Returns inputs for the target `mavlink`: frames with noise, and flights with PX4 and ArduCopter.
fn mavlink() -> Vec<Vec<u8>> {
    let heartbeat = [1, 0, 7, 1, 0, 9, 0, 0, 6, 0, 2, 12, 129, 4, 3];
    let noise = [0, 12, 253, 9, 0, 0, 0, 1, 1, 0, 0, 0, 253, 255];
    let false_start = [0, 10, 253, 255, 0, 0, 0, 1, 1, 110, 0, 0];
    let whole = [
        &[0][..],
        &heartbeat,
        &noise,
        &heartbeat,
        &false_start,
        &heartbeat,
    ]
    .concat();
    let tunnel = [0, 1, 5, 7, 1, 1, 8, 253, 9, 0, 0, 0, 1, 1, 0];
    let hurt = [
        0, 2, 1, 7, 1, 0, 3, 1, 2, 3, 20, 16, 3, 2, 7, 1, 0, 3, 9, 9, 9, 30,
    ];
    // Without and with a key; with a key each received frame is followed by its kind of signature.
    let flight = |autopilot: u8, how: &[u8]| {
        let kind = if how.is_empty() { 1 } else { 3 };
        let begins = [&[kind, 255, 63, 255, 63, 100, 0], how].concat();
        let heard = |what: &[u8]| [what, how].concat();
        let heartbeat = heard(&[1, autopilot, 0, 0, 0]);
        let position = heard(&[4, 0, 128, 0, 128, 0, 64, 1]);
        let in_air = heard(&[3, 2]);
        let setpoint = [10, 1, 0, 0, 64, 0, 0, 128, 0, 0, 32];
        let passes = [8, 40];
        let waits = [7, 200, 0];
        let look = [11, 1, 0, 0, 64];
        let taken = heard(&[6, 0]);
        let other_mode = heard(&[1, autopilot, 5, 3, 0, 0]);
        // The receiver moves.
        let moves = [14, 1];
        let parts: [&[u8]; 21] = [
            &begins,
            &heartbeat,
            &position,
            &in_air,
            &heartbeat,
            &position,
            &setpoint,
            &passes,
            &position,
            &look,
            &heartbeat,
            &passes,
            &taken,
            &waits,
            &moves,
            &position,
            &passes,
            &heartbeat,
            &position,
            &other_mode,
            &passes,
        ];
        parts.concat()
    };
    // Clocks of the link (valid, missing, at the largest stamp), replays, clock changes, another key.
    let attacked = [
        flight(0, &[2]),
        vec![
            15, 0, 15, 3, 16, 0, 1, 0, 0, 0, 0, 2, 17, 0, 0, 0, 1, 1, 0, 0, 0, 0, 2, 1, 0, 0, 0, 0,
            200, 1, 0, 0, 0, 0, 210, 1, 0, 0, 0, 0, 245, 1,
        ],
    ]
    .concat();
    vec![
        whole,
        tunnel.to_vec(),
        hurt.to_vec(),
        flight(0, &[]),
        flight(4, &[]),
        flight(0, &[2]),
        flight(4, &[0]),
        flight(0, &[1]),
        attacked,
    ]
}

#[test]
#[ignore = "writes into the corpora"]
fn write_the_seeds() {
    for (name, _) in TARGETS {
        let seeds = match name {
            "deframe" => deframe(),
            "frame" => frame(),
            "relay" => relay(),
            "chain" => chain(),
            "mavlink" => mavlink(),
            _ => scenario(),
        };
        fs::create_dir_all(folder(name)).unwrap();
        for (number, seed) in (1..).zip(seeds) {
            let path = folder(name).join(format!("seed-{number:02}"));
            fs::write(path, seed).unwrap();
        }
    }
}
