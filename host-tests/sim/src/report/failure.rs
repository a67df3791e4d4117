//! Error messages for runs that failed.

use super::final_mission::version;
use super::timeline::seconds;
use crate::simulator::outcome::{Ending, Outcome, TimelineEvent};

/// Returns the reason for a failed run, and the upload that was not adopted, if any.
pub(super) fn error(method: &str, outcome: &Outcome) -> Option<String> {
    let error = ended(method, outcome)?;
    // A mission counts as adopted even if its relays are lost.
    let known = version(outcome).max(adopted(outcome));
    let missing = outcome.offered().filter(|newest| *newest > known);
    Some(match missing {
        Some(version) => format!("{error}; mission {version} was not adopted"),
        None => error,
    })
}

/// Returns the newest mission version that any relay adopted; 0 for the original mission.
fn adopted(outcome: &Outcome) -> u16 {
    let versions = outcome.moments.iter().map(|moment| match moment.what {
        TimelineEvent::Adopted(version) => version,
        _ => 0,
    });
    versions.max().unwrap_or(0)
}

fn ended(method: &str, outcome: &Outcome) -> Option<String> {
    match outcome.ending {
        Ending::Settled | Ending::Soaked => None,
        Ending::Infeasible if method.ends_with("-step") => Some(
            "none of the targets that the fixed step takes can be met; a smaller one may find one"
                .to_owned(),
        ),
        Ending::Infeasible => Some("no placement gives every hop an SIR above 0".to_owned()),
        Ending::Broken => {
            let silent: Vec<String> = (1..)
                .zip(&outcome.relays)
                .filter(|(_, relay): &(u16, _)| relay.killed.is_some())
                .map(|(index, _)| index.to_string())
                .collect();
            Some(format!(
                "the chain is broken: relay {} went silent",
                silent.join(", ")
            ))
        }
        Ending::NoQuorum => Some("no quorum: too few relays reach each other".to_owned()),
        Ending::OutOfTime => Some(format!(
            "the chain had not settled after {:.0} s",
            seconds(outcome.ended)
        )),
    }
}
