//! Clocks, watchdog and reset cause of this chip, by the crate `uav-relay-chip`.

use core::sync::atomic::{AtomicBool, Ordering};

use uav_relay::{Duration, Instant, Relay};
use uav_relay_chip::clock::{self, Clocks};
use uav_relay_chip::registers::Chip;
use uav_relay_chip::reset::Reset;
use uav_relay_chip::watchdog;

const TURN: Duration = Duration::from_millis(watchdog::TURN_MS);

static WAS_HUNG: AtomicBool = AtomicBool::new(false);

pub(crate) struct Begun {
    pub(crate) clocks: Clocks,
    pub(crate) reset: Reset,
}

/// Starts the watchdog, and then the clocks. If the clocks hang, the watchdog restarts the chip.
///
/// Call it once after a reset, before anything that depends on a clock.
pub(crate) fn begin() -> Begun {
    let reset = Reset::take(&mut Chip);
    WAS_HUNG.store(reset == Reset::Watchdog, Ordering::Relaxed);
    watchdog::start(&mut Chip);
    let clocks = clock::start(&mut Chip, &clock::STM32F405);
    Begun { clocks, reset }
}

/// Returns true if the watchdog has restarted the chip.
#[allow(dead_code, reason = "an image that flies tells its operator")]
pub(crate) fn was_hung() -> bool {
    WAS_HUNG.load(Ordering::Relaxed)
}

pub(crate) fn feed() {
    watchdog::feed(&mut Chip);
}

/// Ends a cycle of the main loop: feeds the watchdog unless a timer of `relay` is overdue.
pub(crate) fn end_turn(relay: &Relay, now: Instant) {
    let due = relay.poll_timeout().map(Instant::as_micros);
    if watchdog::may_feed(now.as_micros(), due) {
        feed();
    }
}

/// Returns the time at which the main loop must wake up: `wake`, but at most [`TURN`] after `now`.
pub(crate) fn latest(now: Instant, wake: Option<Instant>) -> Instant {
    let turn = now + TURN;
    wake.map_or(turn, |wake| wake.min(turn))
}
