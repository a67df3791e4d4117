//! Model check of the view change. The code of the firmware in short chains, under every order of events.
//!
//! | event | model |
//! | --- | --- |
//! | frame | remains in the air once sent: received at any later time, in any order, any number of times, or never |
//! | links cut or restored | the chain changes to another set partition; neighbours are the nearest relays of the same part |
//! | relay silent | a part of its own |
//! | proposal timed out | a relay without a predecessor proposes anew, with a larger number than any in its part |
//! | no successor | the relay decides, or abandons the proposal |
//! | pass | a relay that knows its view to be agreed on informs the next relay, if that is in the same view |
//! | reboot | the relay keeps only its acceptor state, or loses that, too |
//!
//! The numbers of cuts, proposals and reboots are bounded, nothing else is. Time is not modelled. The lease adds that positions
//! of a view are not used before members of the previous view have released theirs.
//!
//! A view is *in force* from the time its leader knows that all members have accepted it until a successor is in force. Views
//! that follow each other one by one are never in force together. The check is therefore that all agreed views form one sequence,
//! starting with the initial view.
//!
//! | file | content |
//! | --- | --- |
//! | `chain` | model state |
//! | `frames` | frames in the air |
//! | `check` | transitions |
//! | `healing`, `properties` | checked properties |
//! | `search` | exhaustive search |

mod chain;
mod check;
mod frames;
mod healing;
mod properties;
mod search;

use check::{Check, Rule};
use search::ONE_CHAIN;

/// Checks chains of `relays` relays with so many cuts, proposals and reboots. `heals`: every state is healed.
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

/// Searches larger bounds; takes some minutes.
#[test]
#[ignore = "minutes"]
fn chains_of_three_and_four_hold_through_more() {
    all_holds(3, (3, 3, 1), true);
    all_holds(3, (3, 4, 1), false);
    all_holds(4, (2, 3, 0), true);
    all_holds(4, (3, 3, 0), false);
    all_holds(4, (2, 3, 1), false);
}

/// Shows that the check finds faults: with every present relay voting, two views are in force together.
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

/// Shows that the requirement is needed: without its record a relay breaks its promises.
#[test]
fn one_that_forgets_what_it_has_said_is_found_to_break_it() {
    let check = Check {
        losses: 1,
        ..Check::of(3)
    };
    assert!(check.search().is_some());
}
