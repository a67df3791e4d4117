//! Cost of accepting a new mission.

use cortex_m_semihosting::hprintln;
use uav_relay::{Auth, Ground, Instant, MAX_FRAME, Mission, Port, Settings, Side, Upload, Wiring};

use super::auth::KEY;
use super::counter::{instructions, next_frame, relay};
use super::missions::mission;

/// Measures the instructions for relay 1 to accept an upload of its own mission as version 1.
#[inline(never)] // keeps its relays off the stack of other measurements
pub(crate) fn upload() {
    const THREE: Mission = mission(3);
    let now = Instant::ZERO;
    let of = |epoch| Auth { key: KEY, epoch };
    let settings = Settings {
        auth: Some(of(1)),
        ..Settings::default()
    };
    let mut relay = relay(1, settings, THREE);
    let mut ground = Ground::new(&THREE, Side::Upstream, 1, Wiring::Pair, of(2));
    let Ok(upload) = Upload::new(&THREE, 1, *THREE.config()) else {
        return;
    };
    let mut frame = [0; MAX_FRAME];
    if ground.upload(now, upload).is_err() {
        return;
    }
    // Handshakes come first. The offer is the frame after which the relay has stored an upload.
    loop {
        while let Some(len) = ground.poll_transmit(&mut frame) {
            let bytes = frame.get(..len).unwrap_or_default();
            let taken = instructions(|| relay.handle_bytes(now, Port::Upstream, bytes));
            if relay.upload().is_some() {
                hprintln!("offer {}", taken);
                hprintln!("offer_bytes {}", len);
                hprintln!("held {}", u32::from(relay.upload() == Some(&upload)));
                return;
            }
        }
        let Some((frame, len)) = next_frame(&mut relay, now) else {
            return;
        };
        ground.handle_bytes(frame.get(..len).unwrap_or_default());
    }
}
