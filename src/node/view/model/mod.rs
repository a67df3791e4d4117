//! All that can happen to a short chain, one thing after the other: the view change that flies, checked in every order of events.
//!
//! | what happens | how it is modelled |
//! | --- | --- |
//! | a frame | once sent it stays in the air: it arrives any time later, in any order, as often as may be, or never |
//! | links are cut and heal | the chain falls into other parts, any set partition; a relay's neighbours are the next ones of its part |
//! | a relay falls silent | it is a part of its own |
//! | a proposal is timed out | a relay with nobody before it proposes anew, with a larger number than any in its part |
//! | nobody is after a relay any more | it decides, or gives the proposal up |
//! | a pass | who knows that the view it flies is agreed on tells the next one, if that flies it, too |
//! | a relay reboots | it keeps its electorate, and nothing else; or it forgets that, too |
//!
//! How many cuts, proposals and reboots there are is bounded; nothing else is. There is no time: what a lease adds is that the places
//! of a view are not taken before members of the one before have let go of theirs.
//!
//! A view is *in force* from the moment its leader has it accepted by all until a view that follows it is. Views that follow each other
//! one by one are never in force at once, so what is checked is that they are one chain, back to the chain as it was loaded.
//!
//! | file | one idea |
//! | --- | --- |
//! | `chain` | a state |
//! | `frames` | what is in the air |
//! | `check` | what happens |
//! | `healing`, `properties` | what is held against it |
//! | `search` | all of it, one after the other |

mod chain;
mod check;
mod frames;
mod healing;
mod properties;
mod search;

use check::{Check, Rule};
use search::ONE_CHAIN;

/// Cuts, proposals, reboots; whether every state is healed.
fn all_holds(relays: u16, (cuts, proposals, reboots): (u8, u8, u8), heals: bool) {
    Check {
        cuts,
        proposals,
        reboots,
        heals,
        ..Check::of(relays)
    }
    .holds();
}

#[test]
fn chains_of_three_and_four_have_one_view_after_the_other_and_settle_once_healed() {
    all_holds(3, (2, 3, 1), true);
    all_holds(4, (2, 2, 1), true);
    all_holds(4, (2, 3, 0), false);
}

/// The same with more of everything: some minutes.
#[test]
#[ignore = "minutes"]
fn chains_of_three_and_four_hold_through_more() {
    all_holds(3, (3, 3, 1), true);
    all_holds(3, (3, 4, 1), false);
    all_holds(4, (2, 3, 0), true);
    all_holds(4, (3, 3, 0), false);
    all_holds(4, (2, 3, 1), false);
}

/// What it is that finds nothing above: a rule that counts whoever is there comes to two views at once.
#[test]
fn a_rule_that_counts_everybody_is_found_to_break() {
    for relays in [3, 4] {
        let check = Check {
            rule: Rule::Everybody,
            ..Check::of(relays)
        };
        let found = check.search().unwrap();
        assert_eq!(found.what, ONE_CHAIN, "{}", found.how);
    }
}

/// The bound of it all: promises are kept.
#[test]
fn one_that_forgets_what_it_has_said_is_found_to_break_it() {
    let check = Check {
        losses: 1,
        ..Check::of(3)
    };
    assert!(check.search().is_some());
}
