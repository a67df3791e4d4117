//! Random frames: well-formed with arbitrary numbers, and damaged ones.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use uav_relay::CRC_32C;
use uav_relay_decode::format::{Field, Format, Kind};

/// Returns a random frame of the message with tag `kind`; one above the last is a handshake.
pub(crate) fn frame(format: &Format, kind: usize, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let (fields, flags, mut body) = match format.messages.get(kind) {
        Some(message) => (
            &message.fields,
            rng.random_range(0..2),
            vec![u8::try_from(kind).unwrap()],
        ),
        None => (&format.handshake.fields, 3, Vec::new()),
    };
    draw(fields, rng, &mut body);
    around(&body, flags, rng)
}

/// Returns a frame around a body. Header and tag are random; `flags` that are 0 leave out the tag.
pub(crate) fn around(body: &[u8], flags: u16, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let first = 0x1000 | rng.random_range(0..4_095_u16);
    let second = flags << 12 | rng.random_range(0..4_095_u16);
    let mut plain = [first.to_le_bytes(), second.to_le_bytes()].concat();
    plain.extend(rng.random::<[u8; 6]>());
    plain.extend(body);
    if flags > 0 {
        plain.extend(rng.random::<[u8; 8]>());
    }
    plain.extend(CRC_32C.checksum(&plain).to_le_bytes());
    let runs = plain.split(|byte| *byte == 0);
    let mut wire: Vec<u8> = runs
        .flat_map(|run| {
            let code = u8::try_from(run.len() + 1).unwrap();
            [&[code], run].concat()
        })
        .collect();
    wire.push(0);
    wire
}

fn draw(fields: &[Field], rng: &mut ChaCha8Rng, out: &mut Vec<u8>) {
    for field in fields {
        one(&field.kind, rng, out);
    }
}

fn one(kind: &Kind, rng: &mut ChaCha8Rng, out: &mut Vec<u8>) {
    match kind {
        Kind::U8 | Kind::Words(_) => out.push(rng.random_range(0..6)),
        Kind::Flags(names) => out.push(rng.random_range(0..1 << names.len())),
        Kind::U16 | Kind::Digest => out.extend(rng.random::<[u8; 2]>()),
        Kind::U64 => out.extend(rng.random::<[u8; 8]>()),
        Kind::U32 | Kind::I32 | Kind::View => out.extend(rng.random::<[u8; 4]>()),
        Kind::F32 => {
            let number = match rng.random_range(0..4) {
                0 => f32::from_bits(rng.random()),
                1 => 0.0,
                _ => rng.random_range(-2e3..2e3),
            };
            out.extend(number.to_le_bytes());
        }
        Kind::F64 => out.extend(rng.random_range(-1e12..1e12_f64).to_le_bytes()),
        Kind::Bool => out.push(rng.random_range(0..2)),
        Kind::Array(count, of) => (0..*count).for_each(|_| one(of, rng, out)),
        Kind::Option(of) => {
            let some = rng.random::<bool>();
            out.push(some.into());
            if some {
                one(of, rng, out);
            }
        }
        Kind::List(most, of) => {
            let count = rng.random_range(0..=*most);
            out.push(u8::try_from(count).unwrap());
            (0..count).for_each(|_| one(of, rng, out));
        }
        Kind::Group(fields) => draw(fields, rng, out),
    }
}

/// Damages a frame: changes, removes or adds bytes, or cuts off the end.
pub(crate) fn hurt(mut wire: Vec<u8>, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let at = rng.random_range(0..wire.len() - 1);
    match rng.random_range(0..5) {
        0 => wire[at] ^= rng.random_range(1..=255),
        1 => {
            wire.remove(at);
        }
        2 => wire.truncate(at + 1),
        3 => {
            wire.truncate(at + 1);
            wire.push(0);
        }
        _ => {
            let more: Vec<u8> = (0..rng.random_range(1..300))
                .map(|_| rng.random_range(1..=255))
                .collect();
            wire.splice(at..at, more);
        }
    }
    wire
}
