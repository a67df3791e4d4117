//! The pass on which relays add up what they hear, and what came of it.

use serde::{Deserialize, Serialize};

use super::parts::{MessageError, PassId, Word, read, write};
use crate::mission::Interferer;
use crate::sensing::belief::{Belief, Spread, Told};
use crate::sensing::level::{Level, is_power};
use crate::sensing::sums::{SUMS, Sums};
use crate::wire::node_number::MAX_NODE;

/// Bytes of the body: the tag, the pass, what is believed, the sums, what the receiver hears and who is off.
pub(super) const LENGTH: usize = 1 + 4 + 19 + 4 * SUMS + 8 + 2;

/// Onward: what is believed of the interference, and what the relays up to the sender hear. Back: what those from the sender on do.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Heard {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// What all of them believe from now on.
    pub told: Told,
    /// What is heard.
    pub sums: Sums,
    /// What the receiver hears.
    pub receiver: Level,
    /// Back: the node number of a relay that hears something else than all the others, whose share has been left out; 0 for none.
    pub off: u16,
}

/// A belief as one byte and four numbers, all of them 0 where they mean nothing.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct BeliefBody {
    number: Word,
    kind: u8,
    source: [f32; 3],
    receiver_w: f32,
}

const MISSION: u8 = 0;
const EVEN: u8 = 1;
const TOWARD_TX: u8 = 2;
const TOWARD_RX: u8 = 3;
const SOURCE: u8 = 4;

impl BeliefBody {
    const fn of(told: Told) -> Self {
        let (kind, source, receiver_w) = match told.belief {
            Belief::Mission => (MISSION, [0.0; 3], 0.0),
            Belief::Unknown(Spread::Even) => (EVEN, [0.0; 3], 0.0),
            Belief::Unknown(Spread::TowardTx) => (TOWARD_TX, [0.0; 3], 0.0),
            Belief::Unknown(Spread::TowardRx) => (TOWARD_RX, [0.0; 3], 0.0),
            Belief::Source { source, receiver_w } => {
                (SOURCE, [source.power_w, source.x_m, source.y_m], receiver_w)
            }
        };
        Self {
            number: Word::new(told.number),
            kind,
            source,
            receiver_w,
        }
    }

    fn checked(self) -> Option<Told> {
        let [power_w, x_m, y_m] = self.source;
        let bare = self.source.map(f32::to_bits) == [0; 3] && self.receiver_w.to_bits() == 0;
        let belief = match self.kind {
            MISSION if bare => Belief::Mission,
            EVEN if bare => Belief::Unknown(Spread::Even),
            TOWARD_TX if bare => Belief::Unknown(Spread::TowardTx),
            TOWARD_RX if bare => Belief::Unknown(Spread::TowardRx),
            SOURCE => {
                let source = Interferer { power_w, x_m, y_m };
                (source.is_valid() && is_power(self.receiver_w)).then_some(Belief::Source {
                    source,
                    receiver_w: self.receiver_w,
                })?
            }
            _ => return None,
        };
        Some(Told {
            number: self.number.number(),
            belief,
        })
    }
}

/// The sums in two parts: postcard has no longer tuples.
type Parts = ([f32; 9], [f32; SUMS - 9]);

impl Heard {
    /// The message of this tag, onward or back.
    pub(super) fn encode(&self, tag: u8, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.mission);
        let [a, b, c, d, e, f, g, h, i, rest @ ..] = self.sums.numbers;
        let sums: Parts = ([a, b, c, d, e, f, g, h, i], rest);
        let told = BeliefBody::of(self.told);
        write(
            &(
                tag,
                pass,
                told,
                sums,
                [self.receiver.power_w, self.receiver.count],
                Word::new(self.off),
            ),
            buffer,
        )
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, told, (head, rest), [power_w, count], off): (
            PassId,
            BeliefBody,
            Parts,
            [f32; 2],
            Word,
        ) = read(body)?;
        let [a, b, c, d, e, f, g, h, i] = head;
        let [j, k, l, m, n, o, p, q, r] = rest;
        let sums = Sums {
            numbers: [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r],
        };
        let told = told.checked().ok_or(MessageError::Value)?;
        let off = off.number();
        let receiver = Level { power_w, count };
        if !(sums.is_sound() && receiver.is_sound() && off <= MAX_NODE) {
            return Err(MessageError::Value);
        }
        Ok(Self {
            number: pass.number(),
            mission: pass.mission(),
            told,
            sums,
            receiver,
            off,
        })
    }
}
