//! A pass of targets along the chain, and the verdict on it, which travels back.

use serde::{Deserialize, Serialize};

use super::parts::{FARTHEST_M, PassId, in_range, is_beside, profile};
use crate::field::is_upsilon;
use crate::optimiser::PerTarget;
use crate::optimiser::ladder::{Ladder, TARGETS};
use crate::optimiser::verdict::Verdict;
use crate::place::{CrossSection, Station};

/// One pass of targets along the chain, as one relay hands it to the next.
#[derive(Clone, PartialEq, Debug)]
pub struct Sweep {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// The targets.
    pub ladder: Ladder,
    /// Where the sender flies across the line, and its power.
    pub relay: Station,
    /// Whether relays are to be where the joint method has each of them across the line, and not where they were given.
    pub chosen: bool,
    /// Upsilon as the sender measures it where it stands, 1/W, in a closed loop.
    pub measured_per_w: Option<f32>,
    /// The sender's place for each target, m along x; shorter than the ladder where the upper targets cannot be met.
    pub reaches: PerTarget,
}

/// What a sweep says beside targets and reaches. Each kind is a message of its own on the wire.
#[derive(Clone, Copy)]
pub(super) enum SweepKind {
    Plain,
    /// Upsilon, 1/W.
    Measured(f32),
    /// How far from the line the sender is, m.
    Aside(f32),
}

impl SweepKind {
    pub(super) const fn of(sweep: &Sweep) -> Self {
        match sweep.measured_per_w {
            _ if sweep.chosen => Self::Aside(sweep.relay.at.y_m),
            None => Self::Plain,
            Some(upsilon_per_w) => Self::Measured(upsilon_per_w),
        }
    }

    /// Bytes of the body of such a sweep.
    pub(super) fn length(self, reaches: &PerTarget) -> usize {
        let more = match self {
            Self::Plain => 0,
            Self::Measured(_) | Self::Aside(_) => 4,
        };
        20 + more + 4 * reaches.len()
    }
}

/// What a sweep of each kind begins with; its reaches come last.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct SweepHead {
    pass: PassId,
    /// Below zero for a plain pass.
    anchor: f32,
    gap: u8,
    growth: u8,
    altitude_m: f32,
    power_w: f32,
}

impl SweepHead {
    pub(super) fn of(sweep: &Sweep) -> Self {
        let (anchor, gap, growth) = sweep.ladder.parts();
        Self {
            pass: PassId::new(sweep.number, sweep.mission),
            anchor: if sweep.ladder.is_plain() {
                -anchor
            } else {
                anchor
            },
            gap,
            growth,
            altitude_m: sweep.relay.at.altitude_m,
            power_w: sweep.relay.power_w,
        }
    }

    pub(super) fn checked(self, kind: SweepKind, reaches: PerTarget) -> Option<Sweep> {
        let (y_m, measured_per_w) = match kind {
            SweepKind::Plain => (None, None),
            SweepKind::Measured(upsilon_per_w) => (None, Some(upsilon_per_w)),
            SweepKind::Aside(y_m) => (Some(y_m), None),
        };
        let ladder = Ladder::from_parts(self.anchor.abs(), self.gap, self.growth)?
            .plainly(self.anchor < 0.0);
        let fits = reaches.len() <= ladder.len() && in_range(&reaches, 0.0);
        let measured = measured_per_w.is_none_or(is_upsilon);
        let beside = y_m.is_none_or(is_beside);
        let own = profile(self.altitude_m, self.power_w)?;
        (fits && measured && beside).then_some(Sweep {
            number: self.pass.number(),
            mission: self.pass.mission(),
            ladder,
            relay: Station {
                at: CrossSection {
                    y_m: y_m.unwrap_or(0.0),
                    altitude_m: own.altitude_m,
                },
                power_w: own.power_w,
            },
            chosen: y_m.is_some(),
            measured_per_w,
            reaches,
        })
    }
}

/// The verdict on one sweep, as it travels back.
#[derive(Clone, PartialEq, Debug)]
pub struct Answer {
    /// Number of the sweep.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// What became of the targets.
    pub verdict: Verdict,
    /// Where the receiver is to stand when a target is committed, m along x; `None` for its own reach.
    pub stand: Option<f32>,
    /// Whether the sender or a relay after it differs from what the mission says of all.
    pub own: bool,
}

#[derive(Serialize, Deserialize)]
pub(super) struct AnswerBody {
    pass: PassId,
    own: bool,
    commit: Option<u8>,
    slacks: PerTarget,
    stand: Option<f32>,
}

impl AnswerBody {
    pub(super) fn of(answer: &Answer) -> Self {
        Self {
            pass: PassId::new(answer.number, answer.mission),
            own: answer.own,
            commit: answer.verdict.commit,
            slacks: answer.verdict.slacks.clone(),
            stand: answer.stand,
        }
    }

    pub(super) fn length(&self) -> usize {
        let stand = if self.stand.is_some() { 4 } else { 0 };
        9 + usize::from(self.commit.is_some()) + 4 * self.slacks.len() + stand
    }

    pub(super) fn checked(self) -> Option<Answer> {
        let known = self
            .commit
            .is_none_or(|target| usize::from(target) < TARGETS);
        let placed = self.stand.is_none_or(|x_m| (0.0..=1e6).contains(&x_m));
        let sound = in_range(&self.slacks, -FARTHEST_M) && known && placed;
        sound.then_some(Answer {
            number: self.pass.number(),
            mission: self.pass.mission(),
            verdict: Verdict {
                commit: self.commit,
                slacks: self.slacks,
            },
            own: self.own,
            stand: self.stand,
        })
    }
}
