//! Instruction counter, and creation of relays.

use core::hint::black_box;
use cortex_m::peripheral::SYST;
use cortex_m_semihosting::debug;
use uav_relay::{Identity, Instant, MAX_FRAME, Mission, Relay, Settings};

pub(crate) const TOP: u32 = 0x00FF_FFFF;

pub(crate) fn ticks<T>(work: impl FnOnce() -> T) -> u32 {
    let before = SYST::get_current();
    black_box(work());
    before.wrapping_sub(SYST::get_current()) & TOP
}

/// Returns the number of instructions that `work` takes, without those of the measurement itself.
///
/// Above 780 000 instructions the result is wrong, because the counter wraps.
pub(crate) fn instructions<T>(work: impl FnOnce() -> T) -> u32 {
    let empty = ticks(|| ());
    // One instruction takes 128 ns: 21.504 ticks at 168 MHz, or 2 688 / 125. The largest count times 125 fits in a u32.
    (ticks(work).saturating_sub(empty) * 125 + 1_344) / 2_688
}

pub(crate) fn relay(index: u16, settings: Settings, of: Mission) -> Relay {
    let identity = Identity { network: 1, index };
    if let Ok(relay) = Relay::new(of, identity, settings, 1, Instant::ZERO) {
        return relay;
    }
    debug::exit(debug::EXIT_FAILURE);
    stop()
}

/// Returns the next frame that `relay` sends, and its length; `None` if nothing is pending.
pub(crate) fn next_frame(relay: &mut Relay, now: Instant) -> Option<([u8; MAX_FRAME], usize)> {
    let mut frame = [0; MAX_FRAME];
    let transmit = relay.poll_transmit(now, &mut frame)?;
    Some((frame, transmit.len))
}

/// Sleeps forever, in case QEMU does not exit.
pub(crate) fn stop() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}
