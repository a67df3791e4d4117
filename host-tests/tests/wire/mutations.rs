//! Mutated golden bodies: the crate accepts exactly those that the tables permit.

use uav_relay::wire::message::{Message, MessageError};

use super::golden::{vectors, written};
use super::message::WireMessage;

const ENCODING: Result<(), MessageError> = Err(MessageError::Encoding);
const VALUE: Result<(), MessageError> = Err(MessageError::Value);

/// Limits in the tables of the format. Each is also tried with the other sign, and with the next numbers.
const BOUNDS: [f64; 20] = [
    0.0,
    1e-30,
    1e-9,
    1e-6,
    1e-3,
    0.1,
    1.0,
    20.0,
    1e5,
    1e6,
    1e7,
    1e9,
    2e9,
    1e12,
    1e20,
    1e30,
    1e32,
    1e50,
    f32::MIN_POSITIVE as f64,
    f32::MAX as f64,
];

const NODES: [u16; 20] = [
    0,
    1,
    2,
    3,
    8,
    9,
    63,
    64,
    255,
    999,
    1000,
    1001,
    1023,
    4093,
    4094,
    4095,
    4096,
    32767,
    65534,
    u16::MAX,
];

const SITES: [i32; 2] = [900_000_000, 1_800_000_000];

/// Returns all 4-byte numbers to try in a body: f32, view identifiers and coordinates of Tx and Rx. In messages whose
/// rules compare numbers, the body's own numbers and the numbers next to these are added.
fn quads(message: &str, body: &[u8]) -> Vec<[u8; 4]> {
    let mut floats: Vec<f32> = BOUNDS.iter().map(|bound| *bound as f32).collect();
    let own = match message {
        "Offer" | "Proposal" | "Decision" => body,
        _ => &[],
    };
    let own = own.windows(4).map(|quad| quad.try_into().unwrap());
    floats.extend(own.clone().map(f32::from_le_bytes));
    let near = floats
        .iter()
        .flat_map(|one| [one.next_down(), *one, one.next_up()]);
    let mut quads: Vec<[u8; 4]> = near
        .flat_map(|one| [one, -one])
        .chain([f32::NAN, -f32::NAN, f32::from_bits(0x7F80_0001)])
        .map(f32::to_le_bytes)
        .collect();
    let views = [0, 1, 2, 4_194_303].into_iter().flat_map(|number: u32| {
        let nodes = NODES.iter().filter(|node| **node < 1024);
        nodes.map(move |node| number << 10 | u32::from(*node))
    });
    let views = views.chain(own.map(u32::from_le_bytes));
    let near = views.flat_map(|view| [view.wrapping_sub(1), view, view.wrapping_add(1)]);
    quads.extend(near.map(u32::to_le_bytes));
    let near = SITES.iter().flat_map(|site| [site - 1, *site, site + 1]);
    quads.extend(near.flat_map(|site| [site, -site]).map(i32::to_le_bytes));
    quads.sort_unstable();
    quads.dedup();
    quads
}

/// Returns f64 to try in an offer: limits, path-loss factors, and the f64 next to each of these. The factors are those
/// in the body, and each of those times 1e20.
fn octets(body: &[u8]) -> Vec<[u8; 8]> {
    let own = body
        .windows(8)
        .map(|octet| f64::from_le_bytes(octet.try_into().unwrap()));
    let all = own.flat_map(|factor| [factor, 1e20 * factor]).chain(BOUNDS);
    let near = all.flat_map(|one| [one.next_down(), one, one.next_up(), -one]);
    let strange = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    near.chain(strange).map(f64::to_le_bytes).collect()
}

/// Asserts that the crate decodes or refuses a body as the tables of the format do. Returns the result of both.
fn compared(body: &[u8], name: &str) -> Result<(), MessageError> {
    let read = Message::decode(body);
    let verdict = read.as_ref().map(|_| ()).map_err(|error| *error);
    assert_eq!(verdict, WireMessage::verdict(body), "{name}: {body:02x?}");
    if let Ok(message) = read {
        assert_eq!(written(&message), body, "{name}");
    }
    verdict
}

/// Numbers of message bodies by result of decoding: accepted, wrongly encoded, out of range.
#[derive(Default, Debug)]
struct VerdictCounts([usize; 3]);

impl VerdictCounts {
    fn compared(&mut self, body: &[u8], name: &str) {
        let verdict = compared(body, name);
        let verdicts = [Ok(()), ENCODING, VALUE];
        self.0[verdicts.iter().position(|one| *one == verdict).unwrap()] += 1;
    }
}

#[test]
fn numbers_at_any_offset_are_checked_as_in_the_tables() {
    let mut seen = VerdictCounts::default();
    for vector in vectors().frames {
        let (name, body) = (&vector.name, &vector.body);
        let mut changed = |at: usize, bytes: &[u8]| {
            let mut body = body.clone();
            if let Some(place) = body.get_mut(at..at + bytes.len()) {
                place.copy_from_slice(bytes);
                seen.compared(&body, name);
            }
        };
        let (quads, octets) = (quads(&vector.message, body), octets(body));
        for at in 0..body.len() {
            for byte in 0..=u8::MAX {
                changed(at, &[byte]);
            }
            for pair in [0, 1, 2, 255]
                .map(|a| [0, 1, 2, 255].map(|b| [a, b]))
                .as_flattened()
            {
                changed(at, pair);
            }
            for node in NODES {
                changed(at, &node.to_le_bytes());
            }
            for quad in &quads {
                changed(at, quad);
            }
            for octet in octets.iter().filter(|_| vector.message == "Offer") {
                changed(at, octet);
            }
        }
    }
    println!("{seen:?}");
    assert!(seen.0.iter().all(|count| *count > 50_000), "{seen:?}");
}

#[test]
fn damaged_bodies_are_checked_as_in_the_tables() {
    let mut seen = VerdictCounts::default();
    for vector in vectors().frames {
        let (name, body) = (&vector.name, &vector.body);
        for at in 0..body.len() {
            let (before, rest) = body.split_at(at);
            assert_eq!(compared(before, name), ENCODING, "{name}, {at}");
            // The byte as a varint of two to ten bytes.
            for more in 0..9 {
                let padded = [&[rest[0] | 0x80][..], &vec![0x80; more], &[0], &rest[1..]].concat();
                seen.compared(&[before, &padded].concat(), name);
            }
            // Another count, with as many elements of f32 or of seats, and with an empty Option.
            for (count, size) in (0..=20).flat_map(|count: u8| [(count, 4), (count, 10)]) {
                let zeros = vec![0; size * usize::from(count)];
                let counted = [before, &[count], &zeros].concat();
                seen.compared(&counted, name);
                seen.compared(&[&counted[..], &[0]].concat(), name);
            }
        }
        for extra in 0..=u8::MAX {
            let longer = [&body[..], &[extra]].concat();
            assert_eq!(compared(&longer, name), ENCODING, "{name}, {extra}");
        }
    }
    println!("{seen:?}");
    assert!(seen.0.iter().all(|count| *count > 1_000), "{seen:?}");
}
