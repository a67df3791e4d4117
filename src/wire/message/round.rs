//! Messages of passes along the chain: sweeps, verdicts, profiles, tokens of Algorithm 2, measurements.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::field::is_upsilon;
use crate::mission::{Interferer, MAX_RELAYS};
use crate::optimiser::PerTarget;
use crate::optimiser::ladder::{Ladder, TARGETS};
use crate::optimiser::local::Local;
use crate::optimiser::pass::Verdict;
use crate::place::{CrossSection, Placement, Station};
use crate::sensing::estimate::{InterferenceEstimate, NumberedEstimate, Spread};
use crate::sensing::sums::{Level, SUMS, Sums, is_level, is_power};
use crate::wire::MAX_NODE;
use crate::wire::message::parts::{
    FARTHEST_M, MessageError, PassId, Word, checked_place, in_range, is_beside, profile, read,
    require, tag, take, take_targets, write,
};

/// Sweep message: target SIRs, and for each target the sender's farthest x that meets it.
///
/// The message travels along the chain in a pass. "Farthest" is in the direction in which the message travels: at every
/// x after the farthest x, the hop to the sender misses the target.
#[derive(Clone, PartialEq, Debug)]
pub struct Sweep {
    /// Number of the pass along the chain, which rises from pass to pass and wraps.
    pub number: u16,
    /// Digest of the sender's mission and view, which the receiver compares with its own.
    pub view_digest: u16,
    /// Target SIRs that this pass along the chain tries.
    pub ladder: Ladder,
    /// Lateral offset, altitude and transmit power of the sender.
    pub relay: Station,
    /// True if relays use offsets and altitudes that are optimised together with x (method `Joint`). False if they use
    /// the configured lateral offsets and altitudes.
    pub chosen: bool,
    /// Measured mean of 1 / I (Upsilon) at the sender's position, in 1/W; I is the interference power. `None` if the
    /// receiver must use the mission's interference field.
    pub measured_per_w: Option<f32>,
    /// List of the sender's farthest x, m, in the direction of the pass, that meets each target SIR. The list begins
    /// with the lowest target, and ends before the first target that cannot be met.
    pub reaches: PerTarget,
}

/// Fields at the start of all kinds of sweep messages. The list of farthest x, one for each target SIR, is at the end
/// of the message.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct SweepHead {
    pass: PassId,
    /// Lower of the two middle target SIRs, or the only target. The other targets follow from `gap` and `growth`. A
    /// negative sign marks a plain pass, in which every relay takes the farthest x that meets the target.
    anchor: f32,
    gap: u8,
    growth: u8,
    altitude_m: f32,
    power_w: f32,
}

impl SweepHead {
    fn of(sweep: &Sweep) -> Self {
        let (anchor, gap, growth) = sweep.ladder.parts();
        Self {
            pass: PassId::new(sweep.number, sweep.view_digest),
            anchor: if sweep.ladder.is_plain() {
                -anchor
            } else {
                anchor
            },
            gap,
            growth,
            altitude_m: sweep.relay.cross_section.altitude_m,
            power_w: sweep.relay.power_w,
        }
    }
}

impl Sweep {
    /// Encodes the sweep into `buffer`; returns its length, or `None` if it does not fit. The measured
    /// interference or the lateral offset, if any, precedes the list of the sender's farthest x for each target SIR.
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let (head, reaches) = (SweepHead::of(self), &self.reaches);
        match self.measured_per_w {
            _ if self.chosen => write(
                &(tag::ASIDE, head, self.relay.cross_section.y_m, reaches),
                buffer,
            ),
            None => write(&(tag::SWEEP, head, reaches), buffer),
            Some(upsilon_per_w) => write(&(tag::MEASURED, head, upsilon_per_w, reaches), buffer),
        }
    }

    pub(super) fn decode(tag: u8, body: &[u8]) -> Result<Self, MessageError> {
        let (head, rest): (SweepHead, _) = take(body)?;
        let (between, rest) = match tag {
            tag::SWEEP => (0.0, rest),
            _ => take(rest)?,
        };
        let (reaches, []) = take_targets(rest)? else {
            return Err(MessageError::Encoding);
        };
        let measured_per_w = (tag == tag::MEASURED).then_some(between);
        let chosen = tag == tag::ASIDE;
        let y_m = if chosen { between } else { 0.0 };
        let SweepHead {
            anchor,
            gap,
            growth,
            altitude_m,
            power_w,
            pass,
        } = head;
        let ladder = Ladder::from_parts(anchor.abs(), gap, growth).ok_or(MessageError::Value)?;
        require(
            reaches.len() <= ladder.len()
                && in_range(&reaches, 0.0)
                && measured_per_w.is_none_or(is_upsilon)
                && is_beside(y_m)
                && profile(altitude_m, power_w).is_some(),
        )?;
        Ok(Self {
            number: pass.number(),
            view_digest: pass.digest(),
            ladder: ladder.plainly(anchor < 0.0),
            relay: Station {
                cross_section: CrossSection { y_m, altitude_m },
                power_w,
            },
            chosen,
            measured_per_w,
            reaches,
        })
    }
}

/// Reply to a sweep message: result for each target, and the position that the destination must take.
#[derive(Clone, PartialEq, Debug)]
pub struct SweepVerdict {
    /// Number of the pass along the chain, as in the sweep message that is answered.
    pub number: u16,
    /// Digest of the sender's mission and view, which the receiver compares with its own.
    pub view_digest: u16,
    /// Result of the sweep: the target that the chain commits to, if any, and the slack for each target. The slack is
    /// the maximum length of a chain that meets the target, minus the distance from Tx to Rx.
    pub verdict: Verdict,
    /// x to which the destination of this reply must move if a target is committed, m. If it is `None`, the destination
    /// takes the farthest x that it sent for this target in its sweep message.
    pub required_x_m: Option<f32>,
    /// True if the sender, or a relay after it in the pass, has an individual profile (altitude and power). The power
    /// or the fixed altitude of such a relay differs from the mission's common profile.
    pub own: bool,
}

impl SweepVerdict {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        let Verdict { commit, slacks } = &self.verdict;
        let body = (
            tag::VERDICT,
            pass,
            self.own,
            commit,
            slacks,
            self.required_x_m,
        );
        write(&body, buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let ((pass, own, commit), rest): ((PassId, bool, Option<u8>), _) = take(body)?;
        let (slacks, rest) = take_targets(rest)?;
        let required_x_m: Option<f32> = read(rest)?;
        let known = commit.is_none_or(|target| usize::from(target) < TARGETS);
        let placed = required_x_m.is_none_or(|x_m| (0.0..=1e6).contains(&x_m));
        require(in_range(&slacks, -FARTHEST_M) && known && placed)?;
        Ok(Self {
            number: pass.number(),
            view_digest: pass.digest(),
            verdict: Verdict { commit, slacks },
            own,
            required_x_m,
        })
    }
}

/// Maximum number of relay profiles (altitude and power) in one message.
pub const MOST_NAMED: usize = 8;

/// Profile of a relay, altitude and power, that differs from the mission's common profile.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OwnSeat {
    /// Index of the relay among the members of the view. The relay next to Tx has index 1.
    pub index: u16,
    /// Fixed altitude of the relay, m; 0 if the altitude is not fixed and the relay chooses it.
    pub held_m: f32,
    /// Transmit power of the relay, W.
    pub power_w: f32,
}

/// List of relay profiles (altitude and power), by rising index of the relays.
pub type OwnSeats = Vec<OwnSeat, MOST_NAMED>;

/// Message that collects relay profiles (altitude and power). On the way along the chain it has the profiles of the
/// relays up to the sender. The reply has the profiles of all relays of the chain.
#[derive(Clone, PartialEq, Debug)]
pub struct Roster {
    /// Number of the pass along the chain, which rises from pass to pass and wraps.
    pub number: u16,
    /// Digest of the sender's mission and view, which the receiver compares with its own.
    pub view_digest: u16,
    /// Index of the relay up to which earlier passes have collected the profiles; 0 in the first pass.
    pub after: u16,
    /// Profiles of relays with an index above `after`. If the list is full, the next pass collects the remaining
    /// profiles.
    pub seats: OwnSeats,
}

/// Relay profiles on the wire: index, altitude in m (0 if the relay chooses), and power in W.
type SeatsBody = Vec<(Word, f32, f32), MOST_NAMED>;

impl Roster {
    pub(super) fn encode(&self, tag: u8, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        let mut parts = SeatsBody::new();
        for seat in &self.seats {
            _ = parts.push((Word::new(seat.index), seat.held_m, seat.power_w));
        }
        write(&(tag, pass, Word::new(self.after), parts), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, after, parts): (PassId, Word, SeatsBody) = read(body)?;
        // The count has no empty varint bytes: see `take_targets`.
        if body.len() != 7 + 10 * parts.len() {
            return Err(MessageError::Encoding);
        }
        let mut roster = Self {
            number: pass.number(),
            view_digest: pass.digest(),
            after: after.number(),
            seats: OwnSeats::new(),
        };
        let mut last = roster.after;
        // By reference, because the code that drops the rest of a by-value iterator could panic.
        for &(index, held_m, power_w) in &parts {
            let index = index.number();
            let chooses = held_m.to_bits() == 0;
            let sound = profile(if chooses { 1.0 } else { held_m }, power_w).is_some();
            require(sound && index > last && index <= MAX_RELAYS)?;
            _ = roster.seats.push(OwnSeat {
                index,
                held_m,
                power_w,
            });
            last = index;
        }
        Ok(roster)
    }
}

/// Token message of Algorithm 2, in which one relay after the other improves its position.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Token {
    /// Number of the pass along the chain, which rises from pass to pass and wraps.
    pub number: u16,
    /// Digest of the sender's mission and view, which the receiver compares with its own.
    pub view_digest: u16,
    /// Current position of the sender.
    pub place: Placement,
    /// Transmit power of the sender, W.
    pub power_w: f32,
    /// Action that every relay takes when it receives the token in this pass: look, move or stop.
    pub turn: AdjustStep,
    /// SIR of the chain's worst hop before this pass, linear; 0 if unknown.
    pub sir: f32,
}

impl Token {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        let at = [self.place.x_m, self.place.altitude_m];
        let turn = StepBody::of(self.turn);
        write(
            &(tag::TOKEN, pass, at, self.power_w, turn, self.sir),
            buffer,
        )
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, at, power_w, turn, sir): (PassId, _, _, StepBody, _) = read(body)?;
        require(is_sir(sir))?;
        Ok(Self {
            number: pass.number(),
            view_digest: pass.digest(),
            place: checked_place(at, power_w)?,
            power_w,
            turn: turn.checked().ok_or(MessageError::Value)?,
            sir,
        })
    }
}

/// Action of each relay that receives the token of Algorithm 2 (stepwise improvement of the positions).
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AdjustStep {
    /// The relay keeps its position, and only stores the positions of its neighbours.
    Look,
    /// The relay moves if a position with a better SIR than its current position exists.
    Move {
        /// Maximum change of the relay's altitude in this move, m: the paper's `epsilon_h`.
        explore_m: f32,
        /// Search method for a position with a better SIR.
        local: Local,
    },
    /// The relay stops moving, because Algorithm 2 (stepwise improvement of the positions) has ended.
    Stop,
}

/// Action of each relay as encoded in a token message: its kind, and the parameters of a move. Parameters that the kind
/// does not use are 0.
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

    /// Returns the decoded action. `None` if a value is out of range, or if an unused number is not 0.
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

/// Reply to a token of Algorithm 2 (stepwise improvement of positions), sent back toward the leader.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moved {
    /// Number of the pass of Algorithm 2 in which the token was received.
    pub number: u16,
    /// Digest of the sender's mission and view, which the receiver compares with its own.
    pub view_digest: u16,
    /// Current position of the sender.
    pub place: Placement,
    /// True if the sender, or a relay that received the token after the sender, has moved in this pass.
    pub position_changed: bool,
    /// Linear SIR of the worst hop from the sender to the end of the chain, in the direction of the pass.
    pub worst_sir: f32,
    /// Transmit power of the sender, W.
    pub power_w: f32,
}

impl Moved {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        let at = [self.place.x_m, self.place.altitude_m];
        let (any, worst) = (self.position_changed, self.worst_sir);
        write(&(tag::MOVED, pass, at, any, worst, self.power_w), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, at, position_changed, worst_sir, power_w): (PassId, _, _, _, _) = read(body)?;
        require(is_sir(worst_sir))?;
        Ok(Self {
            number: pass.number(),
            view_digest: pass.digest(),
            place: checked_place(at, power_w)?,
            position_changed,
            worst_sir,
            power_w,
        })
    }
}

fn is_sir(sir: f32) -> bool {
    (0.0..=f32::MAX).contains(&sir)
}

/// Length of a sensing message's body, bytes. The terms are the message tag, the pass number and digest, the estimate,
/// the sums, the interference level at Rx, and the excluded relay's number.
pub(super) const HEARD: usize = 1 + 4 + 19 + 4 * SUMS + 8 + 2;

/// Sensing message: interference estimate, and sums of measurements. On the way along the chain the sums cover the
/// relays up to the sender. In the reply they cover the sender and the relays that the message reached after it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Heard {
    /// Number of the pass along the chain, which rises from pass to pass and wraps.
    pub number: u16,
    /// Digest of the sender's mission and view, which the receiver compares with its own.
    pub view_digest: u16,
    /// Interference estimate that all relays must use.
    pub estimate: NumberedEstimate,
    /// Weighted sums of the relays' measurements.
    pub sums: Sums,
    /// Interference level measured at the ground receiver Rx.
    pub receiver: Level,
    /// Number of the relay whose measurements are inconsistent with those of the other relays; 0 for none. Its
    /// measurements are left out of `sums`. The number is set only in replies (`Sensed`).
    pub excluded: u16,
}

/// Interference estimate on the wire: its number, its kind, an interferer, and the interference at Rx. Values that the
/// kind does not use are 0.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct EstimateBody {
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

impl EstimateBody {
    const fn of(estimate: NumberedEstimate) -> Self {
        let (kind, source, receiver_w) = match estimate.estimate {
            InterferenceEstimate::Mission => (MISSION, [0.0; 3], 0.0),
            InterferenceEstimate::Unknown(Spread::Even) => (EVEN, [0.0; 3], 0.0),
            InterferenceEstimate::Unknown(Spread::TowardTx) => (TOWARD_TX, [0.0; 3], 0.0),
            InterferenceEstimate::Unknown(Spread::TowardRx) => (TOWARD_RX, [0.0; 3], 0.0),
            InterferenceEstimate::Source { source, receiver_w } => {
                (SOURCE, [source.power_w, source.x_m, source.y_m], receiver_w)
            }
        };
        Self {
            number: Word::new(estimate.number),
            kind,
            source,
            receiver_w,
        }
    }

    fn checked(self) -> Option<NumberedEstimate> {
        let [power_w, x_m, y_m] = self.source;
        let bare = self.source.map(f32::to_bits) == [0; 3] && self.receiver_w.to_bits() == 0;
        let estimate = match self.kind {
            MISSION if bare => InterferenceEstimate::Mission,
            EVEN if bare => InterferenceEstimate::Unknown(Spread::Even),
            TOWARD_TX if bare => InterferenceEstimate::Unknown(Spread::TowardTx),
            TOWARD_RX if bare => InterferenceEstimate::Unknown(Spread::TowardRx),
            SOURCE => {
                let source = Interferer { power_w, x_m, y_m };
                (source.is_valid() && is_power(self.receiver_w)).then_some(
                    InterferenceEstimate::Source {
                        source,
                        receiver_w: self.receiver_w,
                    },
                )?
            }
            _ => return None,
        };
        Some(NumberedEstimate {
            number: self.number.number(),
            estimate,
        })
    }
}

/// The 18 measurement sums on the wire, as two arrays of nine numbers each.
type SumsBody = ([f32; 9], [f32; SUMS - 9]);

impl Heard {
    pub(super) fn encode(&self, tag: u8, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        let [a, b, c, d, e, f, g, h, i, rest @ ..] = self.sums.numbers;
        let sums: SumsBody = ([a, b, c, d, e, f, g, h, i], rest);
        let estimate = EstimateBody::of(self.estimate);
        write(
            &(
                tag,
                pass,
                estimate,
                sums,
                [self.receiver.power_w, self.receiver.count],
                Word::new(self.excluded),
            ),
            buffer,
        )
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, estimate, (head, rest), [power_w, count], off): (
            PassId,
            EstimateBody,
            SumsBody,
            [f32; 2],
            Word,
        ) = read(body)?;
        let [a, b, c, d, e, f, g, h, i] = head;
        let [j, k, l, m, n, o, p, q, r] = rest;
        let sums = Sums {
            numbers: [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r],
        };
        let estimate = estimate.checked().ok_or(MessageError::Value)?;
        let off = off.number();
        let receiver = Level { power_w, count };
        require(sums.is_sound() && receiver.is_sound() && off <= MAX_NODE)?;
        Ok(Self {
            number: pass.number(),
            view_digest: pass.digest(),
            estimate,
            sums,
            receiver,
            excluded: off,
        })
    }
}

pub(super) fn encode_level(mission: u16, power_w: f32, buffer: &mut [u8]) -> Option<usize> {
    write(&(tag::LEVEL, Word::new(mission), power_w), buffer)
}

pub(super) fn decode_level(body: &[u8]) -> Result<(u16, f32), MessageError> {
    let (mission, power_w): (Word, f32) = read(body)?;
    require(is_level(power_w))?;
    Ok((mission.number(), power_w))
}
