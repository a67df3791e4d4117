//! Effect of each operation on a chain.

use proptest::prop_assert;
use uav_relay::{Duration, Sample};

use super::Checked;
use super::chain::World;
use super::operation::Operation;
use super::scenario::{Kind, SAMPLES};
use super::wires::end;

impl World<'_> {
    pub(crate) fn apply(&mut self, operation: &Operation) -> Checked {
        self.wires.hurry(self.now);
        match *operation {
            Operation::Deliver(line) => self.deliver(line, 0, 1),
            Operation::Drop(line) => self.deliver(line, 0, 0),
            Operation::Twice(line) => self.deliver(line, 0, 2),
            Operation::Overtake(line, behind) => self.deliver(line, 1 + behind % 4, 1),
            Operation::Burst(line, frames) => self.burst(line, frames),
            Operation::Delay(line, ms) => {
                self.delay(line, ms);
                Ok(())
            }
            Operation::Damage(line, ref bytes) => self.damage(line, bytes),
            Operation::Tick => self.tick(),
            Operation::Wait(ms) => self.wait(Duration::from_millis(u64::from(ms))),
            Operation::Sleep(ms) => {
                self.now = self.now + Duration::from_millis(u64::from(ms));
                Ok(())
            }
            Operation::Flow(ms) => {
                let until = self.now + Duration::from_millis(u64::from(ms));
                while self.flow(until)? {}
                self.now = until;
                self.turn_all()
            }
            Operation::Reboot(relay, seed) => self.reboot(relay, seed),
            Operation::Cut(link, bytes) => self.cut(link, bytes),
            Operation::Join(link) => {
                self.wires.join(usize::from(link) % self.wires.links());
                Ok(())
            }
            Operation::Restart => self.restart(),
            Operation::Replay(line, which) => self.replay(line, which),
            Operation::Measure(relay, part) => self.measure(relay, part),
        }
    }

    /// Delivers a frame in transit on `line`, one direction of a link, `times` times; with 0 it is lost. The frame overtakes `behind`
    /// frames in transit; with 0 it is the next frame to arrive.
    fn deliver(&mut self, line: u8, behind: u8, times: usize) -> Checked {
        let Some(line) = self.wires.pick(line) else {
            return Ok(());
        };
        let Some(frame) = self.wires.take(line, behind) else {
            return Ok(());
        };
        self.tally.add(match (behind, times) {
            (0, 0) => "frames lost",
            (0, 1) => "frames delivered",
            (0, _) => "frames doubled",
            _ => "frames overtaking",
        });
        for _ in 0..times {
            self.arrive(line, &frame.bytes, &frame)?;
        }
        Ok(())
    }

    fn replay(&mut self, line: u8, which: u8) -> Checked {
        let line = usize::from(line) % (2 * self.wires.links());
        let recorded = self.wires.recorded(line, which);
        let Some(frame) = recorded.filter(|_| self.scenario.signs()) else {
            return Ok(());
        };
        self.tally.add("frames replayed");
        self.arrive(line, &frame.bytes, &frame)
    }

    fn burst(&mut self, line: u8, frames: u8) -> Checked {
        let Some(line) = self.wires.pick(line) else {
            return Ok(());
        };
        for _ in 0..frames {
            if let Some(frame) = self.wires.take(line, 0) {
                self.tally.add("frames in bursts");
                self.deliver_and_check(line, &frame.bytes, &frame)?;
            }
        }
        self.turn(end(line).0)
    }

    fn delay(&mut self, line: u8, ms: u16) {
        if let Some(line) = self.wires.pick(line) {
            self.tally.add("frames delayed");
            let due = self.now + Duration::from_millis(u64::from(ms));
            self.wires.delay(line, due);
        }
    }

    fn damage(&mut self, line: u8, changes: &[(u8, u8)]) -> Checked {
        let Some(line) = self.wires.pick(line) else {
            return Ok(());
        };
        let Some(frame) = self.wires.take(line, 0) else {
            return Ok(());
        };
        let mut bytes = frame.bytes.clone();
        for (at, bits) in changes {
            let at = usize::from(*at) % bytes.len();
            bytes[at] ^= bits;
        }
        self.tally.add("frames damaged");
        self.arrive(line, &bytes, &frame)
    }

    fn reboot(&mut self, relay: u8, seed: u32) -> Checked {
        let at = usize::from(relay) % self.relays.len();
        let is_leader = at == self.scenario.leader();
        self.tally.add(if is_leader {
            "leaders rebooted"
        } else {
            "others rebooted"
        });
        self.epochs += 1;
        self.relays[at] = self.scenario.relay(at, seed, self.epochs, self.now);
        if let Some(record) = &self.ledgers[at].record {
            let resumed = self.relays[at].resume_view(self.now, record);
            prop_assert!(resumed.is_ok(), "{resumed:?}");
        }
        self.wires.forget(at);
        self.ledgers[at].reboot(self.now, self.epochs);
        self.turn(at)
    }

    fn cut(&mut self, link: u8, bytes: u8) -> Checked {
        let link = usize::from(link) % self.wires.links();
        self.tally.add("links cut");
        for (line, next) in self.wires.cut(link) {
            if let Some(frame) = next {
                let through = usize::from(bytes) % frame.bytes.len();
                self.arrive(line, &frame.bytes[..through], &frame)?;
            }
        }
        Ok(())
    }

    pub(crate) fn restart(&mut self) -> Checked {
        let leader = self.scenario.leader();
        self.tally.add("restarts");
        self.relays[leader].restart(self.now);
        self.turn(leader)
    }

    /// Passes interference samples to a relay, at about `part` per cent of the interference in its mission.
    ///
    /// Without a field of interference in the mission, the samples are about `part` per cent of 1 W.
    fn measure(&mut self, relay: u8, part: u8) -> Checked {
        let at = usize::from(relay) % self.relays.len();
        let field = self.scenario.mission.field();
        let x_m = self.relays[at].setpoint().map_or(0.0, |place| place.x_m);
        let agreed_w = field.map_or(1.0, |field| field.upsilon(x_m).recip());
        for sample in 0..SAMPLES {
            let spread = if sample % 2 == 0 { 0.7 } else { 1.3 };
            let power_w = agreed_w * f32::from(part) * 0.01 * spread;
            let sample = Sample::Interference { power_w };
            self.relays[at].handle_sample(self.now, sample);
        }
        if self.scenario.kind != Kind::Measured {
            self.ledgers[at].refuses(SAMPLES);
        }
        let before = self.ledgers[at].measured_per_w;
        self.turn(at)?;
        if self.ledgers[at].measured_per_w != before {
            self.tally.add("measurements taken");
        }
        Ok(())
    }
}
