//! Sweep of targets along the chain, and its verdict, which travels back.

use serde::{Deserialize, Serialize};

use super::parts::{
    FARTHEST_M, MessageError, PassId, in_range, is_beside, profile, read, tag, take, take_targets,
    write,
};
use crate::field::is_upsilon;
use crate::optimiser::PerTarget;
use crate::optimiser::ladder::{Ladder, TARGETS};
use crate::optimiser::pass::Verdict;
use crate::place::{CrossSection, Station};

/// Sweep of targets along the chain, from one relay to the next.
#[derive(Clone, PartialEq, Debug)]
pub struct Sweep {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// Targets.
    pub ladder: Ladder,
    /// Cross-section and power of the sender.
    pub relay: Station,
    /// True if relays use the joint method's cross-sections instead of their configured ones.
    pub chosen: bool,
    /// Upsilon measured by the sender at its position, 1/W, in a closed loop.
    pub measured_per_w: Option<f32>,
    /// Reach of the sender for each target, m along x. Shorter than the ladder if the upper targets cannot be met.
    pub reaches: PerTarget,
}

/// Common start of all kinds of sweeps; the reaches come last.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct SweepHead {
    pass: PassId,
    /// Anchor of the ladder; negative for a plain pass.
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
}

impl Sweep {
    /// Encodes the sweep; Upsilon or the lateral offset comes between head and reaches.
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let (head, reaches) = (SweepHead::of(self), &self.reaches);
        match self.measured_per_w {
            _ if self.chosen => write(&(tag::ASIDE, head, self.relay.at.y_m, reaches), buffer),
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
        let y_m = (tag == tag::ASIDE).then_some(between);
        checked(head, y_m, measured_per_w, reaches).ok_or(MessageError::Value)
    }
}

/// Checks the ranges of a sweep; with a `y_m` it is one at the joint method's cross-section.
fn checked(
    head: SweepHead,
    y_m: Option<f32>,
    measured_per_w: Option<f32>,
    reaches: PerTarget,
) -> Option<Sweep> {
    let ladder =
        Ladder::from_parts(head.anchor.abs(), head.gap, head.growth)?.plainly(head.anchor < 0.0);
    let fits = reaches.len() <= ladder.len() && in_range(&reaches, 0.0);
    let measured = measured_per_w.is_none_or(is_upsilon);
    let beside = y_m.is_none_or(is_beside);
    let own = profile(head.altitude_m, head.power_w)?;
    (fits && measured && beside).then_some(Sweep {
        number: head.pass.number(),
        mission: head.pass.mission(),
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

/// Verdict on a sweep; sent back.
#[derive(Clone, PartialEq, Debug)]
pub struct Answer {
    /// Number of the sweep.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// Results of the targets.
    pub verdict: Verdict,
    /// Required position of the destination if a target is committed, m along x; `None` for its own reach.
    pub stand: Option<f32>,
    /// True if the sender or a relay after it has a profile of its own.
    pub own: bool,
}

impl Answer {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.mission);
        let Verdict { commit, slacks } = &self.verdict;
        let body = (tag::VERDICT, pass, self.own, commit, slacks, self.stand);
        write(&body, buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let ((pass, own, commit), rest): ((PassId, bool, Option<u8>), _) = take(body)?;
        let (slacks, rest) = take_targets(rest)?;
        let stand: Option<f32> = read(rest)?;
        let known = commit.is_none_or(|target| usize::from(target) < TARGETS);
        let placed = stand.is_none_or(|x_m| (0.0..=1e6).contains(&x_m));
        if !(in_range(&slacks, -FARTHEST_M) && known && placed) {
            return Err(MessageError::Value);
        }
        Ok(Self {
            number: pass.number(),
            mission: pass.mission(),
            verdict: Verdict { commit, slacks },
            own,
            stand,
        })
    }
}
