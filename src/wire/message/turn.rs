//! Token of Algorithm 2, and its result, which travels back.

use serde::{Deserialize, Serialize};

use super::parts::{MessageError, PassId, PlaceBody, profile, read, tag, write};
use crate::optimiser::local::Local;
use crate::place::Placement;

/// Token of Algorithm 2.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Token {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// Current position of the sender.
    pub place: Placement,
    /// Transmit power of the sender, W.
    pub power_w: f32,
    /// Action of this pass.
    pub turn: AdjustStep,
    /// SIR of the chain before this pass, linear; 0 if unknown.
    pub sir: f32,
}

impl Token {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.mission);
        let at = PlaceBody::of(self.place);
        let turn = StepBody::of(self.turn);
        write(
            &(tag::TOKEN, pass, at, self.power_w, turn, self.sir),
            buffer,
        )
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, at, power_w, turn, sir) = read(body)?;
        Self::checked(pass, at, power_w, turn, sir).ok_or(MessageError::Value)
    }

    fn checked(
        pass: PassId,
        at: PlaceBody,
        power_w: f32,
        turn: StepBody,
        sir: f32,
    ) -> Option<Self> {
        let place = at.checked()?;
        Some(Self {
            number: pass.number(),
            mission: pass.mission(),
            place,
            power_w: profile(place.altitude_m, power_w)?.power_w,
            turn: turn.checked()?,
            sir: sir_in_range(sir)?,
        })
    }
}

/// Action of a relay that receives the token.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AdjustStep {
    /// Stay, and learn the neighbours' positions.
    Look,
    /// Move if another position is better.
    Move {
        /// Maximum change of altitude, m: the paper's `epsilon_h`.
        explore_m: f32,
        /// Local search.
        local: Local,
    },
    /// Stay for good.
    Stop,
}

/// Action as one byte and three numbers, which are 0 if unused.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct StepBody {
    kind: u8,
    explore_m: f32,
    columns: u8,
    rows: u8,
}

impl StepBody {
    const fn of(turn: AdjustStep) -> Self {
        let (kind, explore_m, columns, rows) = match turn {
            AdjustStep::Look => (0, 0.0, 0, 0),
            AdjustStep::Stop => (1, 0.0, 0, 0),
            AdjustStep::Move {
                explore_m,
                local: Local::Fine,
            } => (2, explore_m, 0, 0),
            AdjustStep::Move {
                explore_m,
                local: Local::Grid { columns, rows },
            } => (2, explore_m, columns, rows),
        };
        Self {
            kind,
            explore_m,
            columns,
            rows,
        }
    }

    /// Decodes the action; `None` if it is out of range or not the only encoding.
    fn checked(self) -> Option<AdjustStep> {
        let Self {
            kind,
            explore_m,
            columns,
            rows,
        } = self;
        let rest = explore_m.to_bits() == 0 && columns == 0 && rows == 0;
        match kind {
            0 if rest => Some(AdjustStep::Look),
            1 if rest => Some(AdjustStep::Stop),
            2 if (0.0..=1e5).contains(&explore_m) => {
                let local = match (columns, rows) {
                    (0, 0) => Local::Fine,
                    (2.., 2..) => Local::Grid { columns, rows },
                    _ => return None,
                };
                Some(AdjustStep::Move { explore_m, local })
            }
            _ => None,
        }
    }
}

/// Result of a token; sent back.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moved {
    /// Number of the pass.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// Current position of the sender.
    pub place: Placement,
    /// True if the sender or any relay after it has moved.
    pub any: bool,
    /// SIR of the worst hop after the sender, linear.
    pub worst: f32,
}

impl Moved {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.mission);
        let at = PlaceBody::of(self.place);
        write(&(tag::MOVED, pass, at, self.any, self.worst), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, at, any, worst): (PassId, PlaceBody, bool, f32) = read(body)?;
        Ok(Self {
            number: pass.number(),
            mission: pass.mission(),
            place: at.checked().ok_or(MessageError::Value)?,
            any,
            worst: sir_in_range(worst).ok_or(MessageError::Value)?,
        })
    }
}

fn sir_in_range(sir: f32) -> Option<f32> {
    (0.0..=f32::MAX).contains(&sir).then_some(sir)
}
