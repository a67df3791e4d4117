//! Cost of authentication tags, and of a sweep of signed frames.

use core::hint::black_box;
use cortex_m_semihosting::hprintln;
use uav_relay::wire::message::MAX_BODY;
use uav_relay::{Auth, Instant, Key, MAX_FRAME, Mission, Phase, Port, Relay, Settings};

use super::counter::{instructions, next_frame, relay};
use super::missions::mission;

pub(crate) const KEY: Key = Key::new([0xA5; 32]);

/// Returns the number of instructions for the authentication tag of `body` payload bytes.
fn tag(body: usize) -> u32 {
    const LONGEST: [u8; 231] = [0x5A; 231];
    let signed = black_box(LONGEST.get(..10 + body).unwrap_or_default());
    instructions(|| KEY.tag(1 << 32, 2 << 32, signed))
}

/// Exchanges frames between two relays until neither has any to send.
fn exchange_all(upper: &mut Relay, lower: &mut Relay, now: Instant) {
    loop {
        let (down, up) = (next_frame(upper, now), next_frame(lower, now));
        if let Some((frame, len)) = down {
            lower.handle_bytes(now, Port::Upstream, frame.get(..len).unwrap_or_default());
        }
        if let Some((frame, len)) = up {
            upper.handle_bytes(now, Port::Downstream, frame.get(..len).unwrap_or_default());
        }
        if down.is_none() && up.is_none() {
            return;
        }
    }
}

/// Measures the instructions for authentication tags, a signed sweep message, and a rejected replay.
///
/// A sweep message tries several target SIRs along the chain.
#[inline(never)] // keeps its relays off the stack of other measurements
pub(crate) fn auth() {
    const THREE: Mission = mission(3);
    hprintln!("tag_32 {}", tag(32));
    hprintln!("tag_84 {}", tag(84));
    hprintln!("tag_longest {}", tag(MAX_BODY));
    let settings = Settings {
        predict: false,
        auth: Some(Auth { key: KEY, epoch: 1 }),
        ..Settings::default()
    };
    let mut head = relay(1, settings, THREE);
    let mut middle = relay(2, settings, THREE);
    let mut tail = relay(3, settings, THREE);
    let start = Instant::ZERO;
    // The handshakes must end before the first sweep. The last relay sends its handshake first.
    exchange_all(&mut middle, &mut tail, start);
    exchange_all(&mut head, &mut middle, start);
    exchange_all(&mut middle, &mut tail, start);
    let mut now = start;
    while head.phase() == Phase::Planning {
        now = head.poll_timeout().unwrap_or(now);
        head.handle_timeout(now);
    }
    let Some((frame, len)) = next_frame(&mut head, now) else {
        return;
    };
    let bytes = frame.get(..len).unwrap_or_default();
    hprintln!("signed_sweep_bytes {}", len);
    let mut sent = None;
    let through = instructions(|| {
        middle.handle_bytes(now, Port::Upstream, bytes);
        let mut out = [0; MAX_FRAME];
        sent = middle.poll_transmit(now, &mut out);
        black_box(&out);
    });
    hprintln!("signed_sweep {}", through);
    hprintln!(
        "passed_on {}",
        u32::from(sent.is_some_and(|sent| sent.len > 90))
    );
    // The frame is a replay. With a valid tag its rejection takes longest.
    let before = middle.stats().replayed;
    let refused = instructions(|| middle.handle_bytes(now, Port::Upstream, bytes));
    hprintln!("refused {}", refused);
    hprintln!("replayed {}", middle.stats().replayed - before);
}
