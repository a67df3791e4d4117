//! The way down to the highest target that a chain can meet where lower ones may be out of reach: in an uneven field.
//!
//! A relay that steps back may come to where less is heard of the interference, and from there reach farther than one that
//! did not have to. So the slack of a target is a curve with hills, and the first of them that rises above zero, from the
//! top, is looked for: in steps of [`STEP`], and closer where a hill's top between two of them may just rise above it.
//!
//! The top itself comes first, alone: the target that the last hop meets with the relay right above Rx. Just below it a
//! small change of the target takes that relay far (the square root of the hop begins there), so the steps begin small.

use super::ladder::{Ladder, TARGETS};
use super::verdict::met;

/// From one target to the next, relative. A hill that is narrower may be missed.
pub const STEP: f32 = 0.0025;

/// The first steps, below the top; each sixteen are twice as wide as those before.
const FIRST_STEP: f32 = 1e-5;

/// How often a hill's top is looked at more closely.
const LOOKS: u8 = 2;

/// What has been found.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Found {
    /// A target that is met, below one that is not.
    Bracket,
    /// None yet: what to try next.
    Nothing(Ladder),
}

/// Where the search is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Scan {
    /// The highest target of the next step down.
    top: f32,
    /// From one target to the next, relative; 0 for the top alone.
    step: f32,
    /// How often the hill in sight may still be looked at more closely.
    looks: u8,
    /// Whether what is tried now is no step of the scan.
    aside: bool,
}

impl Scan {
    pub(crate) const fn new(top: f32) -> Self {
        Self {
            top,
            step: 0.0,
            looks: LOOKS,
            aside: false,
        }
    }

    /// Something else is tried first.
    pub(crate) fn put_off(&mut self) {
        self.aside = true;
    }

    /// The targets from the top downward.
    pub(crate) fn ladder(self) -> Ladder {
        if self.step > 0.0 {
            let span = 1.0 + self.step * (TARGETS - 1) as f32;
            Ladder::spanning(self.top / span, self.top)
        } else {
            Ladder::single(self.top)
        }
    }

    /// Takes the `slacks` of `targets`.
    pub(crate) fn advance(&mut self, targets: &[f32], slacks: &[f32]) -> Found {
        if core::mem::take(&mut self.aside) {
            return Found::Nothing(self.ladder());
        }
        if met(slacks) > 0 {
            return Found::Bracket;
        }
        if self.looks > 0
            && let Some((low, high)) = hill(targets, slacks)
        {
            if self.looks == LOOKS {
                self.step_down(targets);
            }
            self.looks -= 1;
            return Found::Nothing(Ladder::between(low, high));
        }
        if self.looks == LOOKS {
            self.step_down(targets);
        }
        self.looks = LOOKS;
        Found::Nothing(self.ladder())
    }

    /// The next step begins with the two lowest of these, so that a hill there has both its sides.
    fn step_down(&mut self, targets: &[f32]) {
        if let Some(&top) = targets.get(1) {
            self.top = top;
        }
        self.step = (2.0 * self.step).clamp(FIRST_STEP, STEP);
    }
}

/// The targets on both sides of the highest hill whose top may lie above zero; the slacks themselves are all below.
fn hill(targets: &[f32], slacks: &[f32]) -> Option<(f32, f32)> {
    let mut best: Option<(f32, (f32, f32))> = None;
    for (around, [before, top, after]) in targets.windows(3).zip(triples(slacks)) {
        // Its top is above `top` by less than what `top` is above the lower of its sides.
        let may_rise = top + (top - before.min(after)) >= 0.0;
        if top >= before
            && top >= after
            && may_rise
            && best.is_none_or(|(highest, _)| top > highest)
            && let [low, _, high] = around
        {
            best = Some((top, (*low, *high)));
        }
    }
    best.map(|(_, sides)| sides)
}

fn triples(slacks: &[f32]) -> impl Iterator<Item = [f32; 3]> {
    slacks.windows(3).filter_map(|three| match three {
        [before, top, after] => Some([*before, *top, *after]),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::{Found, Scan};
    use crate::placement::PerTarget;

    /// Runs the scan on a curve of slacks; the target met in the end, and the passes it took.
    fn run(top: f32, slack: impl Fn(f32) -> f32) -> Option<(f32, u32)> {
        let mut scan = Scan::new(top);
        let mut ladder = scan.ladder();
        for passes in 1..1000 {
            let targets = ladder.targets();
            let mut slacks = PerTarget::new();
            for &target in &targets {
                slacks.push(slack(target)).unwrap();
            }
            match scan.advance(&targets, &slacks) {
                Found::Bracket => {
                    let met = slacks.iter().rposition(|slack| *slack >= 0.0).unwrap();
                    return Some((targets[met], passes));
                }
                Found::Nothing(next) => ladder = next,
            }
        }
        None
    }

    #[test]
    fn the_first_hill_from_the_top_is_found() {
        // Met from 7.0 to 7.2 and below 2.
        let (target, _) = run(50.0, |g| if g < 2.0 { 1.0 } else { 0.1 - (g - 7.1).abs() }).unwrap();
        assert!((7.18..=7.2).contains(&target), "{target}");
        let (target, _) = run(50.0, |g| 2.0 - g).unwrap();
        assert!((1.99..=2.0).contains(&target), "{target}");
    }

    #[test]
    fn a_hill_between_two_steps_is_looked_at() {
        // 0.0004 wide at 7.1, a fortieth of a step, on slopes that are wider.
        let (target, _) = run(50.0, |g| 0.0002 - (g - 7.1).abs()).unwrap();
        assert!((target - 7.1).abs() <= 0.0002, "{target}");
    }
}
