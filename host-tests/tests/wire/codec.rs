//! A second codec, written from the rules in `FORMAT.md` and not from the crate's code. It holds no postcard, and takes CRC
//! and COBS from other crates.

use crc::{CRC_32_ISCSI, Crc};
use serde::Deserialize;
use uav_relay::Profile;
use uav_relay::placement::PerTarget;
use uav_relay::placement::ladder::Ladder;
use uav_relay::placement::verdict::Verdict;
use uav_relay::wire::frame::Header;
use uav_relay::wire::message::{Answer, Message, MessageError, Sweep};

/// What a body says, field by field.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) enum Said {
    Sweep {
        number: u16,
        mission: u16,
        anchor: f32,
        gap: u8,
        growth: u8,
        altitude_m: f32,
        power_w: f32,
        reaches: Vec<f32>,
    },
    Verdict {
        number: u16,
        mission: u16,
        commit: Option<u8>,
        slacks: Vec<f32>,
    },
    Busy {
        number: u16,
    },
    Heartbeat {
        mission: u16,
        answer: bool,
    },
}

impl Said {
    /// The bytes of the body.
    pub(crate) fn body(&self) -> Vec<u8> {
        let mut out = Vec::new();
        match self {
            Self::Sweep {
                number,
                mission,
                anchor,
                gap,
                growth,
                altitude_m,
                power_w,
                reaches,
            } => {
                out.push(0);
                out.extend(number.to_le_bytes());
                out.extend(mission.to_le_bytes());
                out.extend(anchor.to_le_bytes());
                out.extend([*gap, *growth]);
                out.extend(altitude_m.to_le_bytes());
                out.extend(power_w.to_le_bytes());
                list(&mut out, reaches);
            }
            Self::Verdict {
                number,
                mission,
                commit,
                slacks,
            } => {
                out.push(1);
                out.extend(number.to_le_bytes());
                out.extend(mission.to_le_bytes());
                match commit {
                    None => out.push(0),
                    Some(target) => out.extend([1, *target]),
                }
                list(&mut out, slacks);
            }
            Self::Busy { number } => {
                out.push(2);
                out.extend(number.to_le_bytes());
            }
            Self::Heartbeat { mission, answer } => {
                out.push(3);
                out.extend(mission.to_le_bytes());
                out.push(u8::from(*answer));
            }
        }
        out
    }

    /// The message that says this.
    pub(crate) fn message(&self) -> Message {
        let per_target = |numbers: &[f32]| PerTarget::from_slice(numbers).unwrap();
        match self.clone() {
            Self::Sweep {
                number,
                mission,
                anchor,
                gap,
                growth,
                altitude_m,
                power_w,
                reaches,
            } => Message::Sweep(Sweep {
                number,
                mission,
                ladder: Ladder::from_parts(anchor, gap, growth).unwrap(),
                profile: Profile {
                    altitude_m,
                    power_w,
                },
                reaches: per_target(&reaches),
            }),
            Self::Verdict {
                number,
                mission,
                commit,
                slacks,
            } => Message::Verdict(Answer {
                number,
                mission,
                verdict: Verdict {
                    commit,
                    slacks: per_target(&slacks),
                },
            }),
            Self::Busy { number } => Message::Busy { sweep: number },
            Self::Heartbeat { mission, answer } => Message::Heartbeat { mission, answer },
        }
    }

    /// What a body says, or why it is refused.
    pub(crate) fn read(body: &[u8]) -> Result<Self, MessageError> {
        let mut rest = Reader(body);
        let said = rest.said().ok_or(MessageError::Encoding)?;
        if !rest.0.is_empty() {
            return Err(MessageError::Encoding);
        }
        if said.in_range() {
            Ok(said)
        } else {
            Err(MessageError::Value)
        }
    }

    fn in_range(&self) -> bool {
        match self {
            Self::Sweep {
                anchor,
                gap,
                growth,
                altitude_m,
                power_w,
                reaches,
                ..
            } => {
                let targets = targets(*anchor, *gap, *growth);
                (*gap > 0 || *growth == 0)
                    && targets[0] >= f32::MIN_POSITIVE
                    && targets[targets.len() - 1] < f32::INFINITY
                    && (0.1..=1e5).contains(altitude_m)
                    && (1e-6..=1e6).contains(power_w)
                    && reaches.len() <= targets.len()
                    && reaches.iter().all(|reach| (0.0..=2e9).contains(reach))
            }
            Self::Verdict { commit, slacks, .. } => {
                commit.is_none_or(|target| target <= 15)
                    && slacks.iter().all(|slack| (-2e9..=2e9).contains(slack))
            }
            Self::Busy { .. } | Self::Heartbeat { .. } => true,
        }
    }
}

fn list(out: &mut Vec<u8>, numbers: &[f32]) {
    out.push(u8::try_from(numbers.len()).unwrap());
    for number in numbers {
        out.extend(number.to_le_bytes());
    }
}

/// What is left of a body; every method is `None` where the bytes are no such thing.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*taken)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take().map(|[byte]| byte)
    }

    fn word(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn real(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    fn list(&mut self) -> Option<Vec<f32>> {
        let count = self.byte().filter(|&count| count <= 16)?;
        (0..count).map(|_| self.real()).collect()
    }

    fn said(&mut self) -> Option<Said> {
        Some(match self.byte()? {
            0 => Said::Sweep {
                number: self.word()?,
                mission: self.word()?,
                anchor: self.real()?,
                gap: self.byte()?,
                growth: self.byte()?,
                altitude_m: self.real()?,
                power_w: self.real()?,
                reaches: self.list()?,
            },
            1 => Said::Verdict {
                number: self.word()?,
                mission: self.word()?,
                commit: match self.byte()? {
                    0 => None,
                    1 => Some(self.byte()?),
                    _ => return None,
                },
                slacks: self.list()?,
            },
            2 => Said::Busy {
                number: self.word()?,
            },
            3 => Said::Heartbeat {
                mission: self.word()?,
                answer: match self.byte()? {
                    0 => false,
                    1 => true,
                    _ => return None,
                },
            },
            _ => return None,
        })
    }
}

/// A ladder's targets. Every step is worked out in f64, where sum, product and quotient of two f32 keep more than twice
/// their digits, and then rounded to f32: the same as one f32 operation, by another route.
#[expect(clippy::cast_possible_truncation, reason = "this is the rounding")]
pub(crate) fn targets(anchor: f32, gap: u8, growth: u8) -> Vec<f32> {
    if gap == 0 {
        return vec![anchor];
    }
    let wide = f64::from;
    let narrow = |value: f64| value as f32;
    let (e, m) = (i32::from(gap >> 3), f64::from(gap & 7));
    let ratio = 1.0 + f64::from(growth) / 16.0;
    let mut gaps = [narrow((1.0 + m / 8.0) * 2_f64.powi(e - 25)); 8];
    let mut targets = vec![anchor; 16];
    for k in 0..7 {
        gaps[k + 1] = narrow(wide(gaps[k]) * ratio);
    }
    for k in 0..8 {
        let step = narrow(wide(targets[7 + k]) * wide(gaps[k]));
        targets[8 + k] = narrow(wide(targets[7 + k]) + wide(step));
    }
    for k in 1..8 {
        let factor = narrow(1.0 + wide(gaps[k]));
        targets[7 - k] = narrow(wide(targets[8 - k]) / wide(factor));
    }
    targets
}

/// The ten bytes before the body.
pub(crate) fn header(header: Header) -> Vec<u8> {
    let mut out = Vec::new();
    out.extend((0x1000 | header.sender).to_le_bytes());
    out.extend(header.destination.to_le_bytes());
    out.extend(header.network.to_le_bytes());
    out.extend(header.counter.to_le_bytes());
    out
}

/// `bytes` and their CRC.
pub(crate) fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc = Crc::<u32>::new(&CRC_32_ISCSI).checksum(&bytes);
    bytes.extend(crc.to_le_bytes());
    bytes
}

/// A frame before COBS around any body.
pub(crate) fn plain(head: Header, body: &[u8]) -> Vec<u8> {
    sealed([&header(head), body].concat())
}

/// COBS and the delimiter.
pub(crate) fn wire(plain: &[u8]) -> Vec<u8> {
    let mut out = cobs::encode_vec(plain);
    out.push(0);
    out
}
