//! Interference measurements and estimates, in both directions.

use serde::{Deserialize, Serialize};
use uav_relay::Interferer;
use uav_relay::sensing::belief::{Belief, Spread, Told};
use uav_relay::wire::message::{Heard as Taken, Message};

use super::{Said, fields};

/// Content of a Sense or Sensed message.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Heard {
    pub(crate) number: u16,
    pub(crate) view_digest: u16,
    /// Number and kind of the current estimate.
    #[serde(rename = "estimate_number")]
    pub(crate) estimate: u16,
    #[serde(rename = "estimate")]
    pub(crate) kind: u8,
    /// Power, X and Y of the source, and its power at the receiver.
    #[serde(flatten, with = "fields::source")]
    pub(crate) source: [f32; 4],
    #[serde(flatten, with = "fields::sums")]
    pub(crate) sums: [f32; 18],
    /// Power at the receiver, and its number of measurements.
    #[serde(flatten, with = "fields::receiver")]
    pub(crate) receiver: [f32; 2],
    pub(crate) excluded: u16,
}

impl Heard {
    /// Decodes the message by the crate, because only relays can add sums.
    pub(super) fn message(said: &Said) -> Message {
        let message = Message::decode(&said.body()).unwrap();
        let ((Said::Sense(own), Message::Sense(hearing))
        | (Said::Sensed(own), Message::Sensed(hearing))) = (said, &message)
        else {
            panic!("{message:?}");
        };
        assert!(own.is(hearing), "{hearing:?}");
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
            number: self.estimate,
            belief,
        };
        // Only this shows that the sums are in order.
        let sums = format!("Sums {{ numbers: {:?} }}", self.sums);
        hearing.number == self.number
            && hearing.view_digest == self.view_digest
            && hearing.estimate == told
            && format!("{:?}", hearing.sums) == sums
            && [hearing.receiver.power_w, hearing.receiver.count] == self.receiver
            && hearing.excluded == self.excluded
    }
}
