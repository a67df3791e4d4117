//! Liveness: detection of a lost neighbour.
//!
//! A sign of life is an answer to something that this relay sent: a heartbeat reply with the number of its request, the
//! reply to a renewal or another message along the chain, or the next such message. It counts from the time at which
//! this relay sent, so a replayed recording proves nothing.
//!
//! This relay waits for a sign of life for `Settings::probe_after`, or for the round trip through the whole chain if
//! that is longer. Then it sends heartbeat requests until one is answered. The neighbour is lost once both
//! conditions hold:
//!
//! | condition | reason |
//! | --- | --- |
//! | silence of `Settings::dead_after`, or of the lease's duration if that is longer | - |
//! | sixteen unanswered requests, and three times the longest recent run of unanswered requests before a reply | a run of lost frames is not a lost neighbour |
//!
//! This longest run is sixteen at first, and each reply lowers it by an eighth. So a neighbour that is silent after
//! its first frames is lost after 48 requests. After some ten replies it is lost after sixteen, like a neighbour that
//! was never received.
//!
//! A neighbour is also lost after eight times `dead_after`. From then on, a request is sent every `probe_after`.
//! Relays of one view that choose their positions jointly compute at the same time and send nothing meanwhile. The
//! silence of a neighbour in the same view therefore counts from the end of this relay's own computation.

use crate::node::context::longest_lease;
use crate::serial_number::next_nonzero;
use crate::settings::Settings;
use crate::time::{Duration, Instant};

/// Minimum number of unanswered heartbeat requests before a neighbour counts as lost.
///
/// After a silence as long as the maximum lease, it counts as lost in any case.
const MIN_REQUESTS: u16 = 16;

/// Factor that determines how many unanswered heartbeat requests show the loss of a neighbour. At least three times as
/// many are needed as in the longest recent run of unanswered requests.
const MARGIN: u16 = 3;

/// Returns the interval between heartbeat requests to a silent neighbour.
///
/// It is the round trip through `all` relays, but short enough for sixteen requests between a silence of `probe_after`
/// and a silence of `dead_after`.
pub(crate) fn tick(settings: &Settings, all: u16) -> Duration {
    request_interval(settings, all, waiting(settings) / u64::from(MIN_REQUESTS))
}

/// Returns the interval between heartbeat requests before the first agreement on positions.
///
/// The interval is longer than [`tick`], because many relays then search on one channel. It is short enough for three
/// requests between a silence of `probe_after` and a silence of `dead_after`.
pub(crate) fn patient_tick(settings: &Settings, all: u16) -> Duration {
    request_interval(settings, all, third(waiting(settings)))
}

/// Returns the time from the first heartbeat request to the loss of a silent neighbour, in µs. It is `dead_after` -
/// `probe_after`.
const fn waiting(settings: &Settings) -> u64 {
    let dead = settings.dead_after.as_micros();
    dead.saturating_sub(settings.probe_after.as_micros())
}

/// Returns `number` / 3, rounded down, by 32-bit divisions.
///
/// The compiler's 64-bit division would add 0.9 KB to a firmware image.
fn third(number: u64) -> u64 {
    let [a, b, c, d, e, f, g, h] = number.to_le_bytes();
    let low = u32::from_le_bytes([a, b, c, d]);
    let high = u32::from_le_bytes([e, f, g, h]);
    // 2^32 = 3 x 0x5555_5555 + 1.
    let carried = high % 3;
    let rest = carried * 0x5555_5555 + low / 3 + (low % 3 + carried) / 3;
    u64::from(high / 3) << 32 | u64::from(rest)
}

/// Returns the round trip time through a chain of `all` relays, at most `most_micros` µs.
///
/// The result is at least a 64th of [`waiting`], also if `most_micros` is less.
#[inline(never)] // called from `tick` and `patient_tick`
fn request_interval(settings: &Settings, all: u16, most_micros: u64) -> Duration {
    let least = waiting(settings) / 64 + 1;
    let round = settings.hop_time.times(2 * u32::from(all));
    let micros = round.as_micros().clamp(least, most_micros.max(least));
    Duration::from_micros(micros)
}

/// Returns the silence of a neighbour after which a heartbeat is requested.
///
/// It is the longer one of `Settings::probe_after` and the round trip through `all` relays, but at most the longest
/// lease.
pub(crate) fn patience(settings: &Settings, all: u16) -> Duration {
    let round = settings.hop_time.times(2 * u32::from(all) + 2);
    round.min(longest_lease(settings)).max(settings.probe_after)
}

/// Number of latest heartbeat requests to which replies are still accepted.
const REMEMBERED_REQUESTS: usize = 4;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Liveness {
    /// Latest time at which the neighbour was provably alive; at first the start of this relay.
    last_sign: Instant,
    lost: bool,
    /// True if the neighbour has been received since the start, or since it was lost.
    was_received: bool,
    /// Sequence number of the last heartbeat request to the neighbour; 0 if none was sent.
    request_number: u16,
    /// Times of the last heartbeat requests, latest first.
    request_times: [Instant; REMEMBERED_REQUESTS],
    /// Number of heartbeat requests since the neighbour was last known to be alive.
    unanswered: u16,
    /// Longest recent run of unanswered heartbeat requests before a reply. The number measures the losses of the
    /// channel.
    ///
    /// It starts at [`MIN_REQUESTS`] and decays with each reply.
    longest: u16,
}

/// Result of the check of a silent neighbour.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Silence {
    /// True if this check has found that the neighbour is lost.
    pub(crate) lost: bool,
    pub(crate) next_check: Instant,
}

impl Liveness {
    /// State before this relay starts: all zeros.
    pub(super) const NONE: Self = Self {
        longest: 0,
        ..Self::new(Instant::ZERO)
    };

    pub(crate) const fn new(now: Instant) -> Self {
        Self {
            last_sign: now,
            lost: false,
            was_received: false,
            request_number: 0,
            request_times: [now; REMEMBERED_REQUESTS],
            unanswered: 0,
            longest: MIN_REQUESTS,
        }
    }

    /// Restarts the record, because a different node is the neighbour now. The longest run of unanswered heartbeat
    /// requests is kept, because it measures the losses of the channel.
    ///
    /// The requests that the previous node has not answered are such a run, too, unless `was_down` is true: then they
    /// show an outage of the link. If `flaps` is true (the link flaps slowly), the longest run is reset to its initial
    /// value.
    pub(crate) fn renew(&mut self, now: Instant, was_down: bool, flaps: bool) {
        let longest = if flaps {
            MIN_REQUESTS
        } else if was_down {
            self.longest
        } else {
            self.longest.max(self.unanswered)
        };
        *self = Self {
            was_received: true,
            longest,
            ..Self::new(now)
        };
    }

    pub(crate) const fn last_sign_of_life(&self) -> Instant {
        self.last_sign
    }

    /// Returns true if the neighbour has been received and is not lost.
    pub(crate) const fn is_present(&self) -> bool {
        self.was_received && !self.lost
    }

    /// Returns true if the neighbour is lost and has not been received since.
    pub(crate) const fn is_silent(&self) -> bool {
        self.lost && !self.was_received
    }

    /// Returns the longest silence that lost frames alone can cause.
    ///
    /// The time between two heartbeat requests is `tick`.
    pub(crate) fn longest_gap(&self, tick: Duration) -> Duration {
        tick.times(u32::from(self.longest.saturating_mul(MARGIN)))
    }

    /// Returns true if the channel has lost few frames recently.
    pub(crate) const fn loses_few_frames(&self) -> bool {
        self.longest <= MIN_REQUESTS
    }

    /// Records that a frame of the neighbour has been received.
    pub(crate) const fn record_frame(&mut self) {
        self.was_received = true;
    }

    /// Records that the neighbour was alive at time `at`. Returns true if the neighbour counted as lost before.
    pub(crate) fn record_sign_of_life(&mut self, at: Instant) -> bool {
        self.last_sign = self.last_sign.max(at);
        self.was_received = true;
        let lately = self.longest.saturating_sub(self.longest.div_ceil(8));
        self.longest = self.unanswered.max(lately);
        self.unanswered = 0;
        core::mem::take(&mut self.lost)
    }

    /// Records a heartbeat request that is sent at `now`, and returns its number.
    pub(crate) const fn next_request(&mut self, now: Instant) -> u16 {
        self.request_number = next_nonzero(self.request_number);
        let [first, second, third, _] = self.request_times;
        self.request_times = [now, first, second, third];
        self.unanswered = self.unanswered.saturating_add(1);
        self.request_number
    }

    /// Returns the time at which the heartbeat request `number` was sent. `None` for all but the last four requests.
    pub(crate) fn requested_at(&self, number: u16) -> Option<Instant> {
        if number == 0 || self.request_number == 0 {
            return None;
        }
        let before = self.request_number.wrapping_sub(number);
        self.request_times.get(usize::from(before)).copied()
    }

    /// Restarts the measurement of the neighbour's silence at `now`, after this relay's computation.
    ///
    /// Relays send nothing while they compute. Returns false, and does nothing, if the neighbour is lost.
    pub(crate) const fn excuse_silence(&mut self, now: Instant) -> bool {
        if !self.lost {
            self.last_sign = now;
        }
        !self.lost
    }

    /// Checks at `now` if the silent neighbour counts as lost.
    ///
    /// The neighbour is lost only after a silence of at least `dead`. `tick` is the time until the next check.
    pub(crate) fn review_silence(
        &mut self,
        now: Instant,
        dead: Duration,
        tick: Duration,
        settings: &Settings,
    ) -> Silence {
        let silent = now.since(self.last_sign);
        let run = if self.was_received { self.longest } else { 0 };
        let enough = self.unanswered >= run.saturating_mul(MARGIN).max(MIN_REQUESTS);
        let gone = silent >= dead && (enough || silent >= longest_lease(settings));
        let lost = gone && !self.lost;
        self.lost |= gone;
        self.was_received &= !lost;
        let next_check = if self.lost {
            now + settings.probe_after
        } else {
            now + tick
        };
        Silence { lost, next_check }
    }
}

#[cfg(test)]
mod tests {
    use super::third;

    #[test]
    fn a_third_is_exact_over_64_bits() {
        let mut number = u64::MAX;
        while number > 0 {
            for near in [number, number - 1, number ^ 0xFFFF_FFFF, number / 2 + 1] {
                assert_eq!(third(near), near / 3, "{near}");
            }
            number = number / 7 * 5;
        }
        assert_eq!([0, 1, 2, 3].map(third), [0, 0, 0, 1]);
    }
}
