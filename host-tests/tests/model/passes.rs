//! Passes (messages along the chain) in which a relay may take part: each once, in order.
//!
//! The first is the first pass of the relay's view. One weakness of closed-loop chains is excused. A relay that reboots
//! during this pass takes part in it again, and forwards other content if it has measured other interference since. The
//! next relay then requests a new view, but may return the result of the earlier content. Until the new view, the hop
//! between the two misses the target. Frames with tags are not accepted that late.

use proptest::{prop_assert, prop_assert_eq};
use uav_relay::wire::digest::digest;
use uav_relay::{Relay, Stats, ViewId};

use super::Checked;
use super::ledger::Ledger;
use super::scenario::Scenario;
use super::wires::Pass;

/// Factor of the numbers of first passes: no other pass has a multiple of it as its number. A pass is a message that
/// travels along the chain. A first pass is the leader's first one after its start or in a new membership view.
const FIRST: u16 = 64;

/// Largest difference between the number of the last pass and the lower number of a late pass.
///
/// A pass is a round of messages along the chain. If the difference is larger, the received pass counts as a pass from
/// before a reboot. A leader's next number is above its last number by at most this difference.
const NEAR: u16 = 32;

/// Returns the mark of a membership view: passes carry the mission digest plus this mark.
///
/// The mark is the lower half of the view's 32-bit name plus the byte-swapped upper half.
fn mark(view: ViewId) -> u16 {
    let [a, b, c, d] = view.bits().to_le_bytes();
    u16::from_le_bytes([a, b]).wrapping_add(u16::from_le_bytes([d, c]))
}

const fn next(last: u16) -> u16 {
    let next = last.wrapping_add(1);
    // Numbers of first passes are skipped.
    next.wrapping_add(next.is_multiple_of(FIRST) as u16)
}

/// Classification of a received pass, a message that travels along the chain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum PassClass {
    Accepted,
    Again,
    /// Late: the pass (a message along the chain) is already over.
    Late,
    /// Foreign: the pass (a message along the chain) does not continue the known passes.
    ///
    /// The pass is of another membership view, or from before the leader's reboot, or the relay has missed the pass
    /// before it.
    Foreign,
}

impl Ledger {
    /// Checks that a relay's membership view never goes back.
    ///
    /// In a new view, no pass (a round of messages along the chain) counts as received yet.
    pub(crate) fn check_view(&mut self, relay: &Relay) -> Checked {
        let view = relay.view();
        prop_assert!(view >= self.view, "{view:?} after {:?}", self.view);
        if view > self.view {
            self.view = view;
            self.pass = None;
        }
        Ok(())
    }

    /// Checks how a relay counts a received pass, a message that travels along the chain. Returns its classification.
    ///
    /// `stands` is true if the relay has a position, `suspended` if its membership view may be changing. `before` and
    /// `after` are the relay's statistics before and after the pass.
    pub(crate) fn check_received(
        &mut self,
        scenario: &Scenario,
        pass: Pass,
        stands: bool,
        suspended: bool,
        before: &Stats,
        after: &Stats,
    ) -> Checked<PassClass> {
        let view = digest(&scenario.mission).wrapping_add(mark(self.view));
        let met = match self.classify(pass.number) {
            _ if pass.digest != view => PassClass::Foreign,
            // The relay's view is being changed.
            _ if suspended => PassClass::Late,
            // A pass that moves relays needs a position to move.
            PassClass::Accepted if pass.moves && !stands => PassClass::Foreign,
            // The relay rebooted during the previous pass and does not know the others' profiles.
            PassClass::Accepted
                if pass.follows && self.repeats_first_pass() && after.stale > before.stale =>
            {
                PassClass::Foreign
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
            PassClass::Accepted => stale == 0 && again == 0,
            // A pass with the last number but other content is from before a reboot, and stale.
            PassClass::Again => stale + again == 1,
            PassClass::Late => stale == 1,
            PassClass::Foreign => stale + other == 1,
        };
        prop_assert!(counted, "{pass:?} is {met:?} after {:?}", self.pass);
        if met == PassClass::Accepted {
            self.pass = Some(pass.number);
        }
        Ok(met)
    }

    /// Returns true if the relay takes part in its view's first pass a second time, after a reboot.
    ///
    /// A pass is a round of messages along the chain. A view is a membership of the chain.
    pub(crate) fn repeats_first_pass(&self) -> bool {
        self.pass
            .is_some_and(|pass| pass.is_multiple_of(FIRST) && self.passes_before.contains(&pass))
    }

    fn classify(&self, number: u16) -> PassClass {
        let is_first = number.is_multiple_of(FIRST);
        let Some(last) = self.pass else {
            return if is_first {
                PassClass::Accepted
            } else {
                PassClass::Foreign
            };
        };
        let (ahead, behind) = (number.wrapping_sub(last), last.wrapping_sub(number));
        match () {
            () if ahead == 0 => PassClass::Again,
            () if number == next(last) => PassClass::Accepted,
            () if behind <= NEAR => PassClass::Late,
            () => PassClass::Foreign,
        }
    }

    /// Checks a pass, a message that travels along the chain, that the relay sends.
    ///
    /// A leader may send a new pass; any other relay must send the pass that it accepted last.
    pub(crate) fn check_sent(&mut self, scenario: &Scenario, leads: bool, pass: Pass) -> Checked {
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
