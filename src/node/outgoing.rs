//! What a relay has to say: built from its state when it is asked for, so nothing queues up.

use super::beside::Signs;
use super::exchange::Phase;
use super::timers::Timer;
use super::{GUARD, MEMBERSHIP, Node};
use crate::mission::Heading;
use crate::side::Side;
use crate::time::{Duration, Instant};
use crate::wire::message::Message;

impl Node {
    /// The next message to send, to which node at which side. Call until there is none.
    pub(crate) fn poll_message(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        let heading = self.mission.heading();
        let (onward, backward) = (Side::onward(heading), Side::back(heading));
        let (next, before) = (self.partner(onward), self.partner(backward));
        if core::mem::take(&mut self.onward_due) && self.share.phase() == Phase::Waiting {
            let patience = self.patience();
            self.timers.set(Timer::Repeat, now + patience);
            if let Some(to) = next {
                #[cfg(feature = "upload")]
                if self.share.is_rolling()
                    && let Some(offer) = self.offer(onward)
                {
                    return Some((onward, to, offer));
                }
                let (share, own) = self.parts();
                return share.onward(own).map(|message| (onward, to, message));
            }
        }
        if core::mem::take(&mut self.back_due)
            && self.share.has_answer()
            && let Some(to) = before
        {
            let (share, own) = self.parts();
            return share.back(own).map(|message| (backward, to, message));
        }
        if core::mem::take(&mut self.busy_due)
            && let Some(to) = before
        {
            let sweep = self.share.number();
            return Some((backward, to, Message::Busy { sweep }));
        }
        let mission = self.members.digest;
        for side in [Side::Upstream, Side::Downstream] {
            let beside = self.beside(side);
            let Signs { ask, answer } = core::mem::take(&mut beside.signs);
            if (ask || answer) && beside.node() != 0 {
                let heartbeat = Message::Heartbeat {
                    mission,
                    answer: ask,
                };
                return Some((side, beside.node(), heartbeat));
            }
        }
        if MEMBERSHIP && let Some((side, to, hello)) = self.next_hello() {
            return Some((side, to, Message::Hello(hello)));
        }
        #[cfg(feature = "upload")]
        for side in [Side::Upstream, Side::Downstream] {
            let to = self.beside(side).node();
            if core::mem::take(&mut self.beside(side).offer)
                && to != 0
                && let Some(offer) = self.offer(side)
            {
                return Some((side, to, offer));
            }
            if let Some((to, hello)) = self.next_report(side) {
                return Some((side, to, Message::Hello(hello)));
            }
        }
        if GUARD && let Some(guard) = &mut self.guard {
            let (side, to, fence) = guard.poll()?;
            return Some((side, to, Message::Fence { mission, fence }));
        }
        None
    }

    /// The neighbour at `side` to whom a pass, or what came of it, can be told: one that was counted with this relay, unless it
    /// is being counted.
    fn partner(&mut self, side: Side) -> Option<u16> {
        let calling = self.share.is_rolling();
        let beside = self.beside(side);
        (beside.is_mutual() && (calling || beside.is_agreed())).then_some(beside.node())
    }

    /// How long what comes back of a pass sent now may take.
    pub(super) fn patience(&mut self) -> Duration {
        let hops = u32::from(match self.mission.heading() {
            _ if self.share.is_rolling() => self.members.all,
            Heading::TowardRx => self.mission.relays().saturating_sub(self.members.index),
            Heading::TowardTx => self.members.index.saturating_sub(1),
        });
        let hop_time = self.settings.hop_time;
        self.repeats.patience(hop_time, hops, self.share.is_slow())
    }
}
