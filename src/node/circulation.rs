//! Message that travels along the chain to the last relay, and the reply with its result.
//!
//! View proposals, lease renewals and the messages of an agreement on positions all travel this way. The initiator
//! sends a message to its neighbour, and every relay forwards it. The last relay knows the result, and a reply with the
//! result goes back through all of them. One [`Circulation`] is the state of one relay for one such message. The
//! calling layer stores the payload. It also classifies received messages as new, duplicate or stale.
//!
//! | stage | event | action | next stage |
//! | --- | --- | --- | --- |
//! | any | message received or created ([`start`](Circulation::start)) | forward it | `Outstanding` |
//! | any | result known ([`complete`](Circulation::complete)) | send the reply, unless this relay is the initiator | `Completed` |
//! | any | message given up ([`withdraw`](Circulation::withdraw), [`cancel`](Circulation::cancel)) | - | `Idle`, `Cancelled` |
//! | `Idle`, `Outstanding` | duplicate received | reply that it is in progress; retransmit soon | unchanged |
//! | `Outstanding` | "in progress" received | wait for the whole round trip | unchanged |
//! | `Outstanding` | timer expired | forward it again | unchanged |
//! | `Completed`, `Cancelled` | duplicate received | send the reply again | unchanged |
//! | `Completed` | timer expired | send the reply again, unasked | unchanged |
//!
//! # Timing
//!
//! A relay waits for a reply as long as the round trip over the remaining hops takes, plus two hops. It waits [`SLOW`]
//! times as long if relays compute on the way. The relay next to a lost frame has the shortest timer, so one loss costs
//! one retransmission.
//!
//! A timer that expires shows that the channel loses frames. This message and the next [`MEMORY`] messages are then
//! retransmitted after four hop times, and again after eight. The retransmissions end when a neighbour replies that the
//! message is in progress. That neighbour recognises the losses from the duplicate, and does the same. So a loss costs
//! the whole round trip once, and not at every hop of a long chain. A random eighth is added to each wait, so that
//! relays on a shared channel do not retransmit at the same time.
//!
//! Replies are not acknowledged. On a lossy channel a reply is sent again without a request. The number of repetitions
//! is that of the binary digits of its number of hops. Without them the previous relay would have to wait for its
//! timer.

use crate::time::{Duration, Instant, Jitter};

/// Factor on the wait for a reply if each relay computes before it forwards the message. The message is then twice as
/// long as others, and each relay needs up to thirty steps of its computation.
const SLOW: u32 = 4;

/// Number of retransmissions after which the wait for the reply no longer doubles.
///
/// The wait after n retransmissions is 2 << n hop times, at most eight.
const LOG_MOST: u32 = 2;

/// Wait before the first retransmission on a lossy channel, in hop times. The next relay's acknowledgement normally
/// arrives earlier.
const SOON: u32 = 4;

/// Number of messages after a loss during which the channel still counts as lossy.
const MEMORY: u8 = 8;

/// State of one relay for a message that travels along the chain and back.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) enum Stage {
    /// No message is known.
    Idle,
    /// The reply has not arrived yet. The message has been forwarded, or must be forwarded next.
    Outstanding,
    /// The result of the message is known.
    Completed,
    /// The message was cancelled after it was sent.
    ///
    /// Duplicates of it are still answered, but the neighbour's reply to it no longer proves that the neighbour is
    /// alive.
    Cancelled,
}

/// Reply of this relay to a message that the previous relay has sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Reply {
    /// Reply with the message's result: this relay knows the result, or the message was cancelled.
    Result,
    /// The message was received, and its result is not known yet.
    InProgress,
}

/// Hops along the chain from this relay to the relay that replies. The retransmission timeout follows from their
/// number.
#[derive(Clone, Copy)]
pub(crate) struct Path {
    /// Time to transmit and handle one frame over one hop.
    pub(crate) hop_time: Duration,
    /// Number of hops on the path.
    pub(crate) hops: u16,
    /// True if each relay on the path computes before it forwards the message.
    pub(crate) slow: bool,
}

/// State of one relay for a message that travels along the chain, and for the reply on its way back.
#[derive(Clone, Debug)]
pub(crate) struct Circulation {
    stage: Stage,
    started_at: Instant,
    completed_at: Instant,
    is_forward_due: bool,
    reply_due: Option<Reply>,
    /// Number of retransmissions of the message since the next relay's last reply.
    retries: u8,
    /// True once the next relay has acknowledged the message.
    is_received: bool,
    /// True if the channel counts as lossy, because this or a recent message was lost.
    is_lossy: bool,
    /// Number of later messages for which the channel still counts as lossy.
    lossy_messages: u8,
    /// Number of unasked repetitions of the reply still to be sent. The channel is lossy, and the reply is repeated
    /// even if no duplicate of the message arrives.
    replies_left: u8,
    jitter: Jitter,
    timer: Option<Instant>,
}

impl Circulation {
    /// Creates the state of a relay without a message. `seed` randomises the retransmission timeouts.
    pub(crate) const fn new(seed: u32) -> Self {
        Self {
            stage: Stage::Idle,
            started_at: Instant::ZERO,
            completed_at: Instant::ZERO,
            is_forward_due: false,
            reply_due: None,
            retries: 0,
            is_received: false,
            is_lossy: false,
            lossy_messages: 0,
            replies_left: 0,
            jitter: Jitter::new(seed),
            timer: None,
        }
    }

    /// Test helper: returns the state at `stage`, with all times zero.
    #[cfg(test)]
    pub(crate) const fn at_stage(stage: Stage) -> Self {
        Self {
            stage,
            ..Self::new(1)
        }
    }

    #[cfg(test)]
    pub(crate) const fn stage(&self) -> Stage {
        self.stage
    }

    /// Returns true from the start of the message until its result is known.
    pub(crate) const fn is_outstanding(&self) -> bool {
        matches!(self.stage, Stage::Outstanding)
    }

    /// Returns the time at which this relay received or created the message. `None` without a message, and for a
    /// cancelled one.
    pub(crate) const fn started_at(&self) -> Option<Instant> {
        match self.stage {
            Stage::Outstanding | Stage::Completed => Some(self.started_at),
            Stage::Idle | Stage::Cancelled => None,
        }
    }

    /// Returns the time at which this relay learned the result. `None` while the result is unknown, and for a cancelled
    /// message.
    pub(crate) const fn completed_at(&self) -> Option<Instant> {
        match self.stage {
            Stage::Completed => Some(self.completed_at),
            Stage::Idle | Stage::Outstanding | Stage::Cancelled => None,
        }
    }

    /// Starts a new message at this relay, and schedules its transmission to the next relay.
    pub(crate) const fn start(&mut self, now: Instant) {
        self.stop(Stage::Outstanding);
        self.started_at = now;
        self.is_forward_due = true;
        self.retries = 0;
        self.is_received = false;
        self.is_lossy = self.lossy_messages > 0;
        self.lossy_messages = self.lossy_messages.saturating_sub(1);
    }

    /// Records that the result is known, and schedules the reply. `path` leads to the initiator of the message. The
    /// initiator passes a path of no hops, and sends no reply.
    #[inline(never)] // called from many places
    pub(crate) fn complete(&mut self, now: Instant, path: Path) {
        self.stop(Stage::Completed);
        self.completed_at = now;
        self.reply_due = (path.hops > 0).then_some(Reply::Result);
        self.repeat_reply(now, path);
    }

    /// Completes the message at its initiator, which sends no reply.
    pub(crate) const fn close(&mut self) {
        self.stop(Stage::Completed);
    }

    /// Withdraws the message, as if this relay had never received it. Duplicates are then not answered with a result.
    pub(crate) const fn withdraw(&mut self) {
        self.stop(Stage::Idle);
    }

    /// Cancels the message: it counts as completed, without a result.
    ///
    /// The time at which the message was sent is discarded. Otherwise a later message of the neighbour could count as
    /// the reply to this message, and would wrongly prove that the neighbour is alive.
    pub(crate) const fn cancel(&mut self) {
        self.stop(Stage::Cancelled);
    }

    #[inline(never)] // called from many places
    const fn stop(&mut self, stage: Stage) {
        self.stage = stage;
        self.is_forward_due = false;
        self.reply_due = None;
        self.replies_left = 0;
        self.timer = None;
    }

    /// Handles a repetition of the message from the previous relay. `path` leads to the initiator of the message.
    pub(crate) fn on_duplicate(&mut self, now: Instant, path: Path) {
        self.is_lossy = true;
        if matches!(self.stage, Stage::Completed | Stage::Cancelled) {
            self.reply_due = Some(Reply::Result);
            self.repeat_reply(now, path);
            return;
        }
        self.reply_due = Some(Reply::InProgress);
        let soon = now + self.jitter.spread(path.hop_time.times(SOON));
        if !self.is_received && self.timer.is_some_and(|at| at > soon) {
            self.timer = Some(soon);
        }
    }

    /// Handles the next relay's reply that the message is in progress. `path` leads to the last relay.
    pub(crate) fn on_in_progress(&mut self, now: Instant, path: Path) {
        self.retries = 0;
        self.is_received = true;
        self.await_result(now, path);
    }

    /// Schedules a retransmission if the result of the message is still awaited. Called when the next relay is
    /// reachable again.
    pub(crate) const fn resend(&mut self) {
        self.is_forward_due |= self.is_outstanding();
    }

    /// Returns true if the message must be forwarded now. The caller then calls [`await_result`](Self::await_result).
    pub(crate) fn poll_forward(&mut self) -> bool {
        core::mem::take(&mut self.is_forward_due) && self.is_outstanding()
    }

    /// Starts the retransmission timer of the message forwarded at `now`. `path` leads to the last relay, which sends
    /// the result back.
    pub(crate) fn await_result(&mut self, now: Instant, path: Path) {
        let round_trip = (2 * u32::from(path.hops) + 2) * if path.slow { SLOW } else { 1 };
        let hops = match self.retries {
            0 if self.is_lossy && !self.is_received => round_trip.min(SOON),
            0 => round_trip,
            retries => round_trip.min(2 << u32::from(retries).min(LOG_MOST)),
        };
        self.replies_left = 0;
        self.timer = Some(now + self.jitter.spread(path.hop_time.times(hops)));
    }

    /// Returns the pending reply and marks it as sent; `None` if no reply is pending.
    pub(crate) const fn poll_reply(&mut self) -> Option<Reply> {
        self.reply_due.take()
    }

    fn repeat_reply(&mut self, now: Instant, path: Path) {
        self.timer = None;
        self.replies_left = 0;
        if self.is_lossy {
            let digits = u16::BITS - path.hops.leading_zeros();
            self.replies_left = u8::try_from(digits).unwrap_or(u8::MAX);
            self.await_reply(now, path.hop_time);
        }
    }

    fn await_reply(&mut self, now: Instant, hop_time: Duration) {
        let is_left = self.replies_left > 0;
        self.timer = is_left.then(|| now + self.jitter.spread(hop_time.times(SOON)));
    }

    /// Schedules a retransmission or a repeated reply once the timer has expired. Returns true for a retransmission.
    pub(crate) fn handle_timeout(&mut self, now: Instant, hop_time: Duration) -> bool {
        if self.timer.is_none_or(|at| at > now) {
            return false;
        }
        self.timer = None;
        if self.replies_left > 0 {
            self.replies_left -= 1;
            self.await_reply(now, hop_time);
            self.reply_due = Some(Reply::Result);
            return false;
        }
        // The first retransmission on a lossy channel proves no loss: the neighbour has had no reason yet to reply.
        if self.retries > 0 || self.is_received || !self.is_lossy {
            self.is_lossy = true;
            self.lossy_messages = MEMORY;
        }
        self.retries = self.retries.saturating_add(1);
        self.resend();
        self.is_outstanding()
    }

    pub(crate) const fn next_timeout(&self) -> Option<Instant> {
        self.timer
    }
}

/// Number of consecutive messages with old sequence numbers after which the leader counts as restarted.
pub(crate) const SUSPICIOUS: u8 = 4;

#[derive(Clone, Copy, Debug)]
pub(crate) struct LateMessages(u8);

impl LateMessages {
    pub(crate) const NONE: Self = Self(0);

    /// Counts a message with an old sequence number. Returns true at the fourth such message in a row ([`SUSPICIOUS`]),
    /// and then sets the count to zero.
    pub(crate) const fn count_one(&mut self) -> bool {
        self.0 = self.0.saturating_add(1);
        let suspicious = self.0 >= SUSPICIOUS;
        if suspicious {
            self.0 = 0;
        }
        suspicious
    }
}

#[cfg(test)]
mod tests {
    use super::{Circulation, MEMORY, Path, Reply, SOON, Stage};
    use crate::time::{Duration, Instant};

    const HOP: Duration = Duration::from_millis(10);

    const PATH: Path = Path {
        hop_time: HOP,
        hops: 49,
        slow: false,
    };

    const START: Instant = Instant::from_millis(1_000);

    /// Test helper: starts a message at relay time `now` and forwards it.
    fn send(circulation: &mut Circulation, now: Instant) {
        circulation.start(now);
        assert!(circulation.poll_forward());
        circulation.await_result(now, PATH);
    }

    fn sent() -> Circulation {
        let mut circulation = Circulation::new(1);
        send(&mut circulation, START);
        circulation
    }

    /// Returns the time from `now` to the next retransmission, in hop times.
    fn wait(circulation: &Circulation, now: Instant) -> u64 {
        let at = circulation.next_timeout().unwrap();
        at.since(now).as_micros() / HOP.as_micros()
    }

    fn around(hops: u32) -> core::ops::RangeInclusive<u64> {
        u64::from(hops)..=u64::from(hops + hops / 8)
    }

    /// Lets the retransmission timer expire `times` times. Returns the time of the last expiry.
    fn expire(circulation: &mut Circulation, mut now: Instant, times: u32) -> Instant {
        for _ in 0..times {
            now = circulation.next_timeout().unwrap();
            assert!(circulation.handle_timeout(now, HOP));
            assert!(circulation.poll_forward());
            circulation.await_result(now, PATH);
        }
        now
    }

    #[test]
    fn the_whole_round_trip_is_waited_for_once() {
        let mut one = sent();
        assert!(around(100).contains(&wait(&one, START)));
        let now = expire(&mut one, START, 1);
        assert!(around(4).contains(&wait(&one, now)));
        let now = expire(&mut one, now, 1);
        assert!(around(8).contains(&wait(&one, now)));
        one.on_in_progress(now, PATH);
        assert!(around(100).contains(&wait(&one, now)));
        for message in 0..=MEMORY {
            send(&mut one, now);
            let hops = if message < MEMORY { SOON } else { 100 };
            assert!(around(hops).contains(&wait(&one, now)), "{message}");
        }
    }

    #[test]
    fn a_first_retransmission_with_a_reply_extends_no_lossy_period() {
        let mut one = sent();
        expire(&mut one, START, 1);
        for message in 0..=MEMORY {
            send(&mut one, START);
            assert_eq!(one.is_lossy, message < MEMORY, "{message}");
            if one.is_lossy {
                let now = expire(&mut one, START, 1);
                one.on_in_progress(now, PATH);
            }
        }
    }

    #[test]
    fn a_duplicate_hastens_the_retransmission_to_the_next_relay() {
        let mut one = sent();
        one.on_duplicate(START, PATH);
        assert_eq!(one.poll_reply(), Some(Reply::InProgress));
        assert_eq!(one.poll_reply(), None);
        assert!(around(SOON).contains(&wait(&one, START)));
        one.on_in_progress(START, PATH);
        one.on_duplicate(START, PATH);
        assert!(around(100).contains(&wait(&one, START)));
        // A duplicate does not prove that a frame was lost on the next hop.
        send(&mut one, START);
        assert!(around(100).contains(&wait(&one, START)));
    }

    #[test]
    fn replies_on_a_lossy_channel_grow_with_the_digits_of_hops() {
        for (hops, digits) in [(0, 0), (1, 1), (7, 3), (8, 4), (49, 6), (199, 8)] {
            for lossy in [false, true] {
                let (mut one, mut now) = (sent(), START);
                let path = Path { hops, ..PATH };
                one.complete(now, path);
                assert_eq!(one.poll_reply(), (hops > 0).then_some(Reply::Result));
                if lossy {
                    one.on_duplicate(now, path);
                    assert_eq!(one.poll_reply(), Some(Reply::Result));
                }
                let mut times = 0;
                while let Some(at) = one.next_timeout() {
                    assert!(around(SOON).contains(&wait(&one, now)));
                    now = at;
                    assert!(!one.handle_timeout(now, HOP));
                    assert_eq!(one.poll_reply(), Some(Reply::Result));
                    times += 1;
                }
                assert_eq!(times, if lossy { digits } else { 0 }, "{hops}");
                assert!(!one.handle_timeout(now, HOP));
            }
        }
    }

    #[test]
    fn a_withdrawn_or_closed_message_is_not_sent() {
        for (end, stage) in [
            (Circulation::withdraw as fn(&mut Circulation), Stage::Idle),
            (Circulation::close, Stage::Completed),
        ] {
            let mut one = sent();
            one.resend();
            end(&mut one);
            assert_eq!((one.stage(), one.next_timeout()), (stage, None));
            assert!(!one.poll_forward());
            assert_eq!(one.poll_reply(), None);
            one.resend();
            assert!(!one.poll_forward());
        }
    }
}
