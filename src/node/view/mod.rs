//! The view change: how the chain comes to a new view of who is in it.
//!
//! A *view* is the chain as it was agreed on last: how many relays there are, and the place of each. View 0 is the chain as the
//! mission has it. Every pass bears its view in its digest, so none is taken up in another view. When a relay finds
//! somebody else beside it than in its view, or gets a pass that it cannot take part in, it asks toward the leader for a new
//! one, hop by hop, until it comes. The leader is whoever has nobody before it: it proposes the view, the proposal goes onward and
//! counts who is there, and the decision travels back.
//!
//! | what a relay finds | what it does |
//! | --- | --- |
//! | another node beside it than agreed on, which has taken it, too; or nobody | asks for a view |
//! | a pass of another view, of another incarnation of its leader, or one that comes after others which it missed | asks for a view |
//! | no pass for a while after it was switched on | asks for a view |
//! | a hello that asks, of a neighbour that knows as new a view, or has just been switched on | asks for a view |
//! | a newer mission than the one it flies | asks for a view, which flies it if all hold it |
//! | a proposal, when it is the last | decides, by the rules of [`electorate`] |
//! | a pulse of its view, in which it has agreed on no place | asks for a view |
//! | a decision on its proposal that follows an older view than it knows to be agreed on: another node has the proposer's number | asks for a later one |
//! | it becomes active again after another node had its number | leaves the view, and asks for one |
//! | the lease of its view has run out | asks for a view, less and less often |
//! | a view was refused | asks for one after `probe_after` as soon as anything is new, else after up to eight times that; alone it asks itself first, and proposes where it would not be refused |
//! | a view far ahead of all that it has heard of | takes in 256 numbers of the way to it on each hearing |
//! | no quorum for three times `dead_after` | gives its links up and searches anew, on a shared channel |
//!
//! | file | one idea |
//! | --- | --- |
//! | [`change`] | the states of a proposal and of the decision on it, what is sent of it, and what is due |
//! | [`asking`] | when this relay asks for a view |
//! | [`electorate`] | who may decide, and what a relay has said in the votes |
//! | [`record`] | that, as it is stored |
//! | `model` | a test: all that can happen to a chain of three or four |

pub(crate) mod asking;
pub(crate) mod change;
pub(crate) mod electorate;
#[cfg(test)]
#[cfg(not(target_os = "none"))]
mod model;
pub(crate) mod record;
#[cfg(test)]
mod tests;
