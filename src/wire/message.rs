//! What neighbours say to each other. The bodies are postcard; `FORMAT.md` has their byte tables.
//!
//! The types on the wire hold bytes, and their values are checked where they become messages: what [`Message::decode`]
//! returns is in range.

use serde::{Deserialize, Serialize};

use crate::mission::Profile;
use crate::placement::PerTarget;
use crate::placement::ladder::{Ladder, TARGETS};
use crate::placement::verdict::Verdict;

/// The longest body: a sweep with a full ladder.
pub const MAX_BODY: usize = 84;

/// No slack or reach in metres is larger: a place is at most 1e6, a reach of the last hop is cut at 1e9.
const FARTHEST_M: f32 = 2e9;

/// One message between neighbours.
#[derive(Clone, PartialEq, Debug)]
pub enum Message {
    /// Toward Rx: targets, and how far the sender reaches for each.
    Sweep(Sweep),
    /// Toward Tx: what became of them. It acknowledges the sweep of the same number.
    Verdict(Answer),
    /// Toward Tx: the sweep of this number has arrived, its verdict has not. Sent for a repeated sweep only.
    Busy {
        /// The number of the sweep.
        sweep: u16,
    },
    /// Either way: a sign of life from a link that would be silent otherwise.
    Heartbeat {
        /// The sender's mission digest, so that a wrong configuration shows before take-off.
        mission: u16,
        /// Whether the sender asks for a heartbeat in return.
        answer: bool,
    },
}

/// One pass of targets along the chain, as one relay hands it to the next.
#[derive(Clone, PartialEq, Debug)]
pub struct Sweep {
    /// Number of the sweep, wrapping.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// The targets.
    pub ladder: Ladder,
    /// What the sender holds.
    pub profile: Profile,
    /// The sender's place for each target, m along x; shorter than the ladder where the upper targets cannot be met.
    pub reaches: PerTarget,
}

/// The verdict on one sweep, as it travels back.
#[derive(Clone, PartialEq, Debug)]
pub struct Answer {
    /// Number of the sweep.
    pub number: u16,
    /// [`super::digest::digest`] of the sender.
    pub mission: u16,
    /// What became of the targets.
    pub verdict: Verdict,
}

/// Why a body is no message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MessageError {
    /// Not the one encoding of any message, or bytes are left over.
    Encoding,
    /// A number is not finite or outside its range.
    Value,
}

impl core::fmt::Display for MessageError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Encoding => "the body is not a message",
            Self::Value => "a number in the message is outside its range",
        })
    }
}

impl core::error::Error for MessageError {}

/// The wire form; the order of variants and fields is the format.
#[derive(Serialize, Deserialize)]
enum Body {
    Sweep {
        number: [u8; 2],
        mission: [u8; 2],
        anchor: f32,
        gap: u8,
        growth: u8,
        altitude_m: f32,
        power_w: f32,
        reaches: PerTarget,
    },
    Verdict {
        number: [u8; 2],
        mission: [u8; 2],
        commit: Option<u8>,
        slacks: PerTarget,
    },
    Busy {
        number: [u8; 2],
    },
    Heartbeat {
        mission: [u8; 2],
        answer: bool,
    },
}

impl Body {
    /// Bytes of the shortest encoding. postcard reads longer ones too, whose tag or count is padded with empty varint bytes,
    /// and how many it puts up with depends on the width of a usize: what one node took, another would refuse.
    fn shortest(&self) -> usize {
        match self {
            Self::Sweep { reaches, .. } => 20 + 4 * reaches.len(),
            Self::Verdict { commit, slacks, .. } => {
                7 + usize::from(commit.is_some()) + 4 * slacks.len()
            }
            Self::Busy { .. } => 3,
            Self::Heartbeat { .. } => 4,
        }
    }
}

impl Message {
    /// Writes the body into `buffer` and returns how many bytes it takes, at most [`MAX_BODY`]; `None` if it does not fit.
    pub fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let body = match self {
            Self::Sweep(sweep) => {
                let (anchor, gap, growth) = sweep.ladder.parts();
                Body::Sweep {
                    number: sweep.number.to_le_bytes(),
                    mission: sweep.mission.to_le_bytes(),
                    anchor,
                    gap,
                    growth,
                    altitude_m: sweep.profile.altitude_m,
                    power_w: sweep.profile.power_w,
                    reaches: sweep.reaches.clone(),
                }
            }
            Self::Verdict(answer) => Body::Verdict {
                number: answer.number.to_le_bytes(),
                mission: answer.mission.to_le_bytes(),
                commit: answer.verdict.commit,
                slacks: answer.verdict.slacks.clone(),
            },
            Self::Busy { sweep } => Body::Busy {
                number: sweep.to_le_bytes(),
            },
            Self::Heartbeat { mission, answer } => Body::Heartbeat {
                mission: mission.to_le_bytes(),
                answer: *answer,
            },
        };
        postcard::to_slice(&body, buffer)
            .ok()
            .map(|written| written.len())
    }

    /// The message in `bytes`, with every number in its range. Work linear in their number, at most [`MAX_BODY`] of use.
    ///
    /// # Errors
    /// [`MessageError::Encoding`] if it is not one message in its shortest form and nothing else, [`MessageError::Value`] for
    /// a number that is not finite or outside its range.
    #[inline(never)]
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let (body, rest): (Body, _) =
            postcard::take_from_bytes(bytes).map_err(|_| MessageError::Encoding)?;
        if !rest.is_empty() || bytes.len() != body.shortest() {
            return Err(MessageError::Encoding);
        }
        Ok(match body {
            Body::Sweep {
                number,
                mission,
                anchor,
                gap,
                growth,
                altitude_m,
                power_w,
                reaches,
            } => {
                let ladder = Ladder::from_parts(anchor, gap, growth).ok_or(MessageError::Value)?;
                let profile = Profile {
                    altitude_m,
                    power_w,
                };
                let reaches = in_range(reaches, 0.0)?;
                if !profile.is_valid() || reaches.len() > ladder.len() {
                    return Err(MessageError::Value);
                }
                Self::Sweep(Sweep {
                    number: u16::from_le_bytes(number),
                    mission: u16::from_le_bytes(mission),
                    ladder,
                    profile,
                    reaches,
                })
            }
            Body::Verdict {
                number,
                mission,
                commit,
                slacks,
            } => {
                let slacks = in_range(slacks, -FARTHEST_M)?;
                if commit.is_some_and(|target| usize::from(target) >= TARGETS) {
                    return Err(MessageError::Value);
                }
                Self::Verdict(Answer {
                    number: u16::from_le_bytes(number),
                    mission: u16::from_le_bytes(mission),
                    verdict: Verdict { commit, slacks },
                })
            }
            Body::Busy { number } => Self::Busy {
                sweep: u16::from_le_bytes(number),
            },
            Body::Heartbeat { mission, answer } => Self::Heartbeat {
                mission: u16::from_le_bytes(mission),
                answer,
            },
        })
    }
}

/// The numbers, if all are within [`least`, `FARTHEST_M`].
fn in_range(numbers: PerTarget, least: f32) -> Result<PerTarget, MessageError> {
    if numbers
        .iter()
        .all(|number| (least..=FARTHEST_M).contains(number))
    {
        Ok(numbers)
    } else {
        Err(MessageError::Value)
    }
}
