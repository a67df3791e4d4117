//! Random frames: well-formed with arbitrary numbers, or damaged.

use chacha20::ChaCha8Rng;
use rand::RngExt;
use uav_relay::wire::frame::Header;
use uav_relay_decode::draw::Draw;
use uav_relay_decode::envelope::{before, sealed, stuffed};
use uav_relay_decode::format::Format;
use uav_relay_decode::write::write_fields;

/// Returns a random frame with the message tag `kind`.
///
/// If `kind` equals the number of message tags, the frame is a handshake.
pub(crate) fn frame(format: &Format, kind: usize, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let (layout, flags, mut body) = match format.messages.get(kind) {
        Some(message) => (
            message,
            rng.random_range(0..2),
            vec![u8::try_from(kind).unwrap()],
        ),
        None => (&format.handshake, 3, Vec::new()),
    };
    let mut source = || rng.random();
    let fields = Draw::new(&mut source).arbitrary(&layout.fields);
    write_fields(&fields, &mut body);
    around(&body, flags, rng)
}

/// Returns a frame with this body and a random header with the flags `flags`.
///
/// If `flags` is 0, the frame has no authentication tag, otherwise a random tag.
pub(crate) fn around(body: &[u8], flags: u16, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let header = Header {
        network: rng.random(),
        sender: rng.random_range(0..4_095),
        destination: rng.random_range(0..4_095),
        counter: rng.random(),
    };
    let mut plain = before(header, flags, body);
    if flags > 0 {
        plain.extend(rng.random::<[u8; 8]>());
    }
    stuffed(&sealed(plain))
}

/// Damages a frame at random: changes, removes or adds bytes, or cuts off the end.
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
