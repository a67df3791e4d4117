//! Which passes a relay may take part in: each once, in order, from the first one of its view on.
//!
//! One weakness is excused, of chains in a closed loop. A relay that was rebooted in the midst of the first pass of a view takes part
//! in it again. If a relay has measured something else since, it hands on something else than before; the next relay calls for a
//! view when it hears that, but may have handed back already what came of the pass as it was, or do so yet: the hop between those
//! two then misses the target until the new view. Frames with tags are not taken that late.

use proptest::{prop_assert, prop_assert_eq};
use uav_relay::wire::digest::digest;
use uav_relay::{Relay, Stats, ViewId};

use super::Checked;
use super::ledger::Ledger;
use super::scenario::Scenario;
use super::wires::Pass;

/// The first pass of a leader's life or view has a number divisible by this, and no other one has.
const FIRST: u16 = 64;

/// So many numbers behind a pass is one that is over; a leader that is told to begin again may leave as many unsaid.
const NEAR: u16 = 32;

/// What a view adds to the digest of the mission: its lower half, and its upper half with the bytes turned round.
fn mark(view: ViewId) -> u16 {
    let [a, b, c, d] = view.bits().to_le_bytes();
    u16::from_le_bytes([a, b]).wrapping_add(u16::from_le_bytes([d, c]))
}

/// The number after `last`.
const fn next(last: u16) -> u16 {
    let next = last.wrapping_add(1);
    // First ones are left out.
    next.wrapping_add(next.is_multiple_of(FIRST) as u16)
}

/// What a pass was to a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Met {
    TakenUp,
    Again,
    /// One that is over: late.
    Late,
    /// Of another view, of another life of the leader, or one before which something was missed.
    Foreign,
}

impl Ledger {
    /// What relay `at` says of its view. A new one begins without a pass.
    pub(crate) fn look_up(&mut self, relay: &Relay) -> Checked {
        let view = relay.view();
        prop_assert!(view >= self.view, "{view:?} after {:?}", self.view);
        if view > self.view {
            self.view = view;
            self.pass = None;
        }
        Ok(())
    }

    /// The relay, which `stands` somewhere or nowhere and may have been `suspended` by a view change, was handed a pass, and counted from `before` to `after`.
    pub(crate) fn meets(
        &mut self,
        scenario: &Scenario,
        pass: Pass,
        stands: bool,
        suspended: bool,
        before: &Stats,
        after: &Stats,
    ) -> Checked<Met> {
        let view = digest(&scenario.mission).wrapping_add(mark(self.view));
        let met = match self.rule(pass.number) {
            _ if pass.digest != view => Met::Foreign,
            // Its view is being changed.
            _ if suspended => Met::Late,
            // Places are moved where there are some.
            Met::TakenUp if pass.moves && !stands => Met::Foreign,
            // Rebooted in the midst of the pass before, it does not know what the others brought along.
            Met::TakenUp if pass.follows && self.begins_anew() && after.stale > before.stale => {
                Met::Foreign
            }
            met => met,
        };
        let other = u32::from(pass.digest != view);
        prop_assert_eq!(
            after.view - before.view,
            other,
            "of another view: {:?}",
            pass
        );
        let stale = after.stale - before.stale;
        let again = after.repeated - before.repeated;
        let counted = match met {
            Met::TakenUp => stale == 0 && again == 0,
            // What is not the same but for its number is of another life.
            Met::Again => stale + again == 1,
            Met::Late => stale == 1,
            Met::Foreign => stale + other == 1,
        };
        prop_assert!(counted, "{pass:?} is {met:?} after {:?}", self.pass);
        if met == Met::TakenUp {
            self.pass = Some(pass.number);
        }
        Ok(met)
    }

    /// Whether its pass is the first one of its view, and it has taken part in it in a life before.
    pub(crate) fn begins_anew(&self) -> bool {
        self.pass
            .is_some_and(|pass| pass.is_multiple_of(FIRST) && self.passes_before.contains(&pass))
    }

    fn rule(&self, number: u16) -> Met {
        let is_first = number.is_multiple_of(FIRST);
        let Some(last) = self.pass else {
            return if is_first { Met::TakenUp } else { Met::Foreign };
        };
        let (ahead, behind) = (number.wrapping_sub(last), last.wrapping_sub(number));
        match () {
            () if ahead == 0 => Met::Again,
            () if number == next(last) => Met::TakenUp,
            () if behind <= NEAR => Met::Late,
            () => Met::Foreign,
        }
    }

    /// The relay hands a pass onward: the one that it has taken up, or, as the leader, one that is new. The leader's first one
    /// may never have been said: another may have come between, or its neighbour could not read it.
    pub(crate) fn says(&mut self, scenario: &Scenario, leads: bool, pass: Pass) -> Checked {
        let view = digest(&scenario.mission).wrapping_add(mark(self.view));
        prop_assert_eq!(pass.digest, view, "a pass of another view is said");
        match self.pass {
            _ if !leads => prop_assert_eq!(Some(pass.number), self.pass, "said, not heard"),
            Some(last) if last != pass.number => {
                let ahead = pass.number.wrapping_sub(last);
                let is_later = ahead <= NEAR && !pass.number.is_multiple_of(FIRST);
                prop_assert!(is_later, "pass {} begun after {last}", pass.number);
            }
            _ => {}
        }
        self.pass = Some(pass.number);
        Ok(())
    }
}
