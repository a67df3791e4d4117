//! View change: agreement on the members of the chain.
//!
//! A *view* is an agreed membership: the number of relays and the place of each. View 0 is the chain as configured in
//! the mission. Every message of an agreement on positions (a pass along the chain) has a digest that includes the
//! view, so a pass is ignored in any other view.
//!
//! A relay requests a new view if its neighbours differ from its view. It also does so if it receives a pass that it
//! cannot take part in. The request is forwarded from neighbour to neighbour toward the leader, and repeated until
//! there is a new view. The leader, which has no neighbour on that side, proposes the view. The proposal is forwarded
//! to the last relay and collects votes on the way. The decision travels back.
//!
//! | event | action |
//! | --- | --- |
//! | neighbour differs from the view's and has selected this relay, too; or no neighbour | request a view |
//! | pass received of another view, from a restarted leader, or after missed passes | request a view |
//! | no pass for a while after start-up | request a view |
//! | hello received that requests a view, from a neighbour whose latest view is as new, or that has just started | request a view |
//! | mission received that is newer than the active one | request a view, which flies it if all members hold it |
//! | proposal received by the last relay | decide, by the rules of [`electorate`] |
//! | lease renewal received, but no position agreed on in this view | request a view |
//! | decision received that follows an older view than the newest one known to be agreed on: another node uses the proposer's index | request a later view |
//! | active again after another node used this relay's index | leave the view, request a view |
//! | lease expired | request a view, less and less often |
//! | view refused | request one after `probe_after` once anything has changed, else after up to eight times that; a relay that is alone proposes only if its own vote would suffice |
//! | view number received that is far ahead of all known ones | advance the latest known view by at most 4096 numbers per message |
//! | no quorum for three times `dead_after` | on a shared channel: give up the links and search again |
//!
//! | file | content |
//! | --- | --- |
//! | [`change`] | states of a proposal and its decision, their messages and timers, and the timing of view requests |
//! | [`electorate`] | rules of voting and acceptor state |
//! | [`record`] | persistent acceptor state |
//! | `model` | test: exhaustive search of the events in a chain of three or four |

pub(crate) mod change;
pub(crate) mod electorate;
#[cfg(test)]
#[cfg(not(target_os = "none"))]
mod model;
pub(crate) mod record;
#[cfg(test)]
mod tests;
