//! Stack use of a relay's calls.

use core::hint::black_box;
use cortex_m_semihosting::hprintln;
use uav_relay::{Instant, MAX_FRAME, Mission, Phase, Port, Relay, Settings};

use super::counter::relay;
use super::missions::mission;

/// Measures the maximum stack use of a relay's calls, bytes.
///
/// The stack is first filled with a pattern. The bytes that the calls overwrite are counted.
#[inline(never)] // keeps its relays off the stack of other measurements
pub(crate) fn stack() {
    const TWO: Mission = mission(2);
    let mut head = relay(1, Settings::default(), TWO);
    let mut tail = relay(2, Settings::default(), TWO);
    let used = used_stack(|| {
        let mut now = Instant::ZERO;
        while head.phase() == Phase::Planning {
            now = head.poll_timeout().unwrap_or(now);
            head.handle_timeout(now);
        }
        exchange(&mut head, &mut tail, Port::Upstream, now);
        exchange(&mut tail, &mut head, Port::Downstream, now);
    });
    hprintln!("stack {}", used);
    hprintln!(
        "agreed {}",
        u32::from(head.setpoint().is_some() && tail.setpoint().is_some())
    );
}

pub(crate) fn exchange(from: &mut Relay, to: &mut Relay, at: Port, now: Instant) {
    let mut frame = [0; MAX_FRAME];
    from.persist(|_| true);
    while let Some(transmit) = from.poll_transmit(now, &mut frame) {
        to.handle_bytes(now, at, frame.get(..transmit.len).unwrap_or_default());
    }
}

/// Number of stack words filled with the pattern: more than any call uses.
pub(crate) const PAINTED: usize = 1024;

pub(crate) const PAINT: u32 = 0xC0FF_EE11;

/// Returns the bytes of stack that `work` uses below this function's frame.
#[inline(never)]
pub(crate) fn used_stack(work: impl FnOnce()) -> u32 {
    paint();
    work();
    unpainted_bytes()
}

/// Fills the stack that the next call will use with a pattern.
#[inline(never)]
pub(crate) fn paint() {
    let mut words = [0_u32; PAINTED];
    for word in &mut words {
        *word = black_box(PAINT);
    }
    black_box(&words);
}

/// Returns the number of stack bytes that no longer have the pattern of [`paint`].
///
/// The array of this function is at the same stack addresses as the array of [`paint`], and is not initialised.
#[inline(never)]
pub(crate) fn unpainted_bytes() -> u32 {
    let words = core::mem::MaybeUninit::<[u32; PAINTED]>::uninit();
    let first = black_box(words.as_ptr().cast::<u32>());
    let untouched = (0..PAINTED)
        // SAFETY: the address is inside the array. The array's content is arbitrary on purpose, and a volatile read of
        // it is allowed.
        .take_while(|at| unsafe { first.add(*at).read_volatile() } == PAINT)
        .count();
    u32::try_from(4 * (PAINTED - untouched)).unwrap_or(u32::MAX)
}
