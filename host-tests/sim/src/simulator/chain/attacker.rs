//! Frames of the attacker.

use rand::RngExt;
use uav_relay::{Duration, Port, Wiring};

use super::super::attack::{AttackKind, Attacker, fate};
use super::super::forge::{Way, destination, forge};
use super::super::queue::QueuedEvent;
use super::recorded::link;
use super::state::{Chain, Member};

/// Retry delay of an attacker that has no recorded frame yet.
const WAIT: Duration = Duration::from_millis(10);

impl Chain {
    /// Creates the attacker of the setup and schedules its frames.
    pub(super) fn expect_an_attack(&mut self) {
        let Some(attack) = self.setup.attack else {
            return;
        };
        let mut attacker = Attacker::new(attack, self.setup.seed);
        for (at, kind) in attacker.plan(&self.setup.link) {
            self.queue.put(at, 0, QueuedEvent::AttackKind(kind));
            self.ahead += 1;
        }
        self.attacker = Some(attacker);
    }

    /// Sends one frame of the attacker to a living relay, or retries later if there is nothing to replay.
    pub(super) fn strike(&mut self, kind: AttackKind) {
        let now = self.now;
        let Some(mut attacker) = self.attacker.take() else {
            return;
        };
        let frame = match kind {
            AttackKind::Forge => {
                let way = self.way(&mut attacker);
                let heard = attacker.recall(now);
                let heard = heard.as_ref().map(|heard| heard.bytes.as_slice());
                let bytes = forge(&self.setup.mission, way, heard, &mut attacker.rng);
                Some((self.port(way), bytes))
            }
            AttackKind::Replay => attacker
                .recall(now)
                .map(|recorded| (recorded.port, recorded.bytes)),
        };
        match frame {
            Some((port, bytes)) => {
                let astray = kind == AttackKind::Replay && attacker.rng.random_range(0..4) == 0;
                let to = destination(&bytes).filter(|_| !astray);
                if let Some(to) = self.reached(to, &mut attacker) {
                    self.hit(to, kind, port, &bytes);
                }
            }
            None if now < attacker.attack.until => {
                self.queue.put(now + WAIT, 0, QueuedEvent::AttackKind(kind));
                self.ahead += 1;
            }
            None => {}
        }
        self.attacker = Some(attacker);
    }

    /// Returns a random relay and a possible neighbour or ground station as the sender.
    fn way(&self, attacker: &mut Attacker) -> Way {
        let relays = self.setup.mission.relays();
        let reach = match self.setup.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => 4,
        };
        let to = attacker.rng.random_range(1..=relays);
        let off = attacker.rng.random_range(1..=reach);
        let before = attacker.rng.random::<bool>() && off <= to || to + off > relays + 1;
        Way {
            from: if before {
                to.saturating_sub(off)
            } else {
                to + off
            },
            to,
        }
    }

    fn port(&self, way: Way) -> Port {
        match self.setup.settings.wiring {
            Wiring::Shared => Port::Shared,
            Wiring::Pair if way.from < way.to => Port::Upstream,
            Wiring::Pair => Port::Downstream,
        }
    }

    /// Returns the index (from 0) of relay `to` (from 1). If that one is not alive, it is a random living relay.
    fn reached(&self, to: Option<u16>, attacker: &mut Attacker) -> Option<usize> {
        let living = |member: &Member| member.killed.is_none();
        let meant = to.and_then(|to| usize::from(to).checked_sub(1));
        let meant = meant.filter(|index| self.members.get(*index).is_some_and(living));
        meant.or_else(|| {
            let count = self.members.iter().filter(|member| living(member)).count();
            let pick = attacker.rng.random_range(0..count.max(1));
            let all = self.members.iter().enumerate();
            let picked = |(_, member): &(usize, &Member)| living(member);
            all.filter(picked).nth(pick).map(|(index, _)| index)
        })
    }

    /// Delivers the frame and records how the relay classified it.
    fn hit(&mut self, index: usize, kind: AttackKind, port: Port, bytes: &[u8]) {
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        let before = *member.relay.stats();
        member.relay.handle_bytes(self.now, port, bytes);
        let name = fate(&before, member.relay.stats());
        *self.outcome.struck.counted.entry((kind, name)).or_default() += 1;
        let note = match kind {
            AttackKind::Forge => "forged by the attacker",
            AttackKind::Replay => "replayed by the attacker",
        };
        self.keep_frame(self.now, link(index, port), bytes, note.to_owned());
        self.drain(index);
    }
}
