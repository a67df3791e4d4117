//! Which passes a relay may take part in: each once, in order, from the first one of its view on.
//!
//! One weakness is excused. A relay that was rebooted in the midst of a pass may take part in it again: in the first pass of a view,
//! or in a later one if a first pass that was held up reaches it before. If it has forgotten the altitude it had, or it or the
//! relay before has measured something else since, it takes its place by another pass than the next relay, which has answered
//! before: the hop between those two may miss the target until the next pass. Frames with tags are not taken that late.

use proptest::{prop_assert, prop_assert_eq};
use uav_relay::wire::digest::digest;
use uav_relay::{Relay, Stats};

use super::Checked;
use super::ledger::Ledger;
use super::scenario::Scenario;
use super::wires::Pass;

/// The first pass of a leader's life or view has a number divisible by this, and no other one has.
const FIRST: u16 = 64;

/// So many numbers ahead a pass is a new one, and so many behind one that is over.
const NEAR: u16 = 32;

/// What a pass was to a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Met {
    TakenUp,
    Again,
    /// One that is over: late.
    Late,
    /// Of another view, of another life of the leader, or one whose beginning was missed.
    Foreign,
}

impl Ledger {
    /// What relay `at` says of its view. A new one begins without a pass.
    pub(crate) fn look_up(&mut self, relay: &Relay) -> Checked {
        let view = relay.view();
        prop_assert!(view >= self.view, "view {view} after {}", self.view);
        if view > self.view {
            self.view = view;
            self.pass = None;
        }
        Ok(())
    }

    /// The relay was handed a pass, and counted from `before` to `after`.
    pub(crate) fn meets(
        &mut self,
        scenario: &Scenario,
        pass: Pass,
        before: &Stats,
        after: &Stats,
    ) -> Checked<Met> {
        let view = digest(&scenario.mission).wrapping_add(self.view);
        let met = if pass.digest == view {
            self.rule(pass.number)
        } else {
            Met::Foreign
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

    /// Whether it has taken part in its pass in a life before.
    pub(crate) fn begins_anew(&self) -> bool {
        self.pass
            .is_some_and(|pass| self.passes_before.contains(&pass))
    }

    fn rule(&self, number: u16) -> Met {
        let is_first = number.is_multiple_of(FIRST);
        let Some(last) = self.pass else {
            return if is_first { Met::TakenUp } else { Met::Foreign };
        };
        let (ahead, behind) = (number.wrapping_sub(last), last.wrapping_sub(number));
        match () {
            () if ahead == 0 => Met::Again,
            () if ahead <= NEAR && !is_first => Met::TakenUp,
            () if behind <= NEAR => Met::Late,
            () => Met::Foreign,
        }
    }

    /// The relay hands a pass onward: the one that it has taken up, or, as the leader, one that is new. The leader's first one
    /// may never have been said: another may have come between, or its neighbour could not read it.
    pub(crate) fn says(&mut self, scenario: &Scenario, leads: bool, pass: Pass) -> Checked {
        let view = digest(&scenario.mission).wrapping_add(self.view);
        prop_assert_eq!(pass.digest, view, "a pass of another view is said");
        match self.pass {
            _ if !leads => prop_assert_eq!(Some(pass.number), self.pass, "said, not heard"),
            Some(last) if last != pass.number => {
                let ahead = pass.number.wrapping_sub(last);
                let is_next = ahead <= NEAR && !pass.number.is_multiple_of(FIRST);
                prop_assert!(is_next, "pass {} begun after {last}", pass.number);
            }
            _ => {}
        }
        self.pass = Some(pass.number);
        Ok(())
    }
}
