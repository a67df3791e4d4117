//! Messages of the pass that collects the relays' interference measurements.

use serde::{Deserialize, Serialize};

use super::parts::{MessageError, PassId, Word, read, write};
use crate::mission::Interferer;
use crate::sensing::belief::{Belief, Spread, Told};
use crate::sensing::sums::{Level, SUMS, Sums, is_power};
use crate::wire::MAX_NODE;

/// Length of the body: tag, pass id, estimate, sums, receiver's level and the excluded node.
pub(super) const LENGTH: usize = 1 + 4 + 19 + 4 * SUMS + 8 + 2;

/// Interference estimate, and measurements. Onward of the relays up to the sender, back of those from the sender on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Heard {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// New estimate for all relays.
    pub told: Told,
    /// Sums of the measurements.
    pub sums: Sums,
    /// Level at the receiver.
    pub receiver: Level,
    /// Node number of a relay that does not fit the others and is not included in `sums`; 0 for none. Used on the way back.
    pub off: u16,
}

/// Estimate as one byte and four numbers, which are 0 if unused.
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

/// Sums in two parts, since serde has no longer tuples.
type Parts = ([f32; 9], [f32; SUMS - 9]);

impl Heard {
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
