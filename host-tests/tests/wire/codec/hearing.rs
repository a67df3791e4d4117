//! Interference measurements and estimates, in both directions.

use serde::Deserialize;
use uav_relay::Interferer;
use uav_relay::sensing::belief::{Belief, Spread, Told};
use uav_relay::wire::message::{Heard as Taken, Message};

use super::bytes::{pass, reals, words};
use super::reader::Reader;

/// Content of a Sense or Sensed message.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Heard {
    pub(crate) number: u16,
    pub(crate) mission: u16,
    /// Number and kind of the current estimate.
    pub(crate) told: u16,
    pub(crate) kind: u8,
    /// Power, X and Y of the source, and its power at the receiver.
    pub(crate) source: [f32; 4],
    pub(crate) sums: [f32; 18],
    /// Power at the receiver, and its number of measurements.
    pub(crate) receiver: [f32; 2],
    pub(crate) off: u16,
}

impl Heard {
    pub(super) fn body(&self, tag: u8) -> Vec<u8> {
        let mut out = pass(tag, [self.number, self.mission]);
        words(&mut out, &[self.told]);
        out.push(self.kind);
        reals(&mut out, &self.source);
        reals(&mut out, &self.sums);
        reals(&mut out, &self.receiver);
        words(&mut out, &[self.off]);
        out
    }

    /// Decodes the message by the crate, because only relays can add sums.
    pub(super) fn message(&self, tag: u8) -> Message {
        let message = Message::decode(&self.body(tag)).unwrap();
        let ((17, Message::Sense(hearing)) | (18, Message::Sensed(hearing))) = (tag, &message)
        else {
            panic!("{tag}: {message:?}");
        };
        assert!(self.is(hearing), "{hearing:?}");
        message
    }

    /// Returns true if the crate decoded the same content.
    fn is(&self, hearing: &Taken) -> bool {
        let [power_w, x_m, y_m, receiver_w] = self.source;
        let source = Interferer { power_w, x_m, y_m };
        let belief = match self.kind {
            0 => Belief::Mission,
            1 => Belief::Unknown(Spread::Even),
            2 => Belief::Unknown(Spread::TowardTx),
            3 => Belief::Unknown(Spread::TowardRx),
            _ => Belief::Source { source, receiver_w },
        };
        let told = Told {
            number: self.told,
            belief,
        };
        // Only this shows that the sums are in order.
        let sums = format!("Sums {{ numbers: {:?} }}", self.sums);
        hearing.number == self.number
            && hearing.mission == self.mission
            && hearing.told == told
            && format!("{:?}", hearing.sums) == sums
            && [hearing.receiver.power_w, hearing.receiver.count] == self.receiver
            && hearing.off == self.off
    }

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            number: rest.word()?,
            mission: rest.word()?,
            told: rest.word()?,
            kind: rest.byte()?,
            source: rest.reals()?,
            sums: rest.reals()?,
            receiver: rest.reals()?,
            off: rest.word()?,
        })
    }

    pub(super) fn in_range(&self) -> bool {
        let power = |power_w: f32| power_w.to_bits() == 0 || (1e-30..=1e6).contains(&power_w);
        let [power_w, x_m, y_m, receiver_w] = self.source;
        let believed = match self.kind {
            0..=3 => self.source.map(f32::to_bits) == [0; 4],
            4 => {
                (1e-6..=1e9).contains(&power_w)
                    && x_m.abs() <= 1e7
                    && y_m.abs() <= 1e7
                    && power(receiver_w)
            }
            _ => false,
        };
        let [first, .., squares, places, measurements, age] = self.sums;
        let [heard_w, count] = self.receiver;
        believed
            && self.sums.iter().all(|sum| sum.is_finite())
            && [first, squares, places, measurements, age]
                .iter()
                .all(|sum| *sum >= 0.0)
            && power(heard_w)
            && (0.0..=1e9).contains(&count)
            && self.off <= 4094
    }
}
