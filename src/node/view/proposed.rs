//! A proposal, as one relay sees it, and what comes of it.

use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;
use crate::wire::message::Poll;

/// A proposal, as one relay sees it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Proposed {
    /// The new view.
    pub(crate) view: ViewId,
    /// The mission that it is to fly.
    pub(crate) mission_id: MissionId,
    /// This relay's place in it, from 1 at the leader.
    pub(crate) place: u16,
    /// What it has gathered, this relay's voice included.
    pub(super) poll: Poll,
    /// The one node that it was handed on to: were it handed to another one, too, two views could bear its name.
    pub(super) handed_to: Option<u16>,
    /// The view that the decision follows, once that is known.
    pub(crate) base: View,
    /// How many have taken part in it, once that is known.
    pub(super) there: u16,
    /// What was decided on, once that is known; `None` if too few are there.
    pub(super) decided: Option<View>,
    pub(super) lease_left: u16,
}

/// What came of a proposal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conclusion {
    /// How many have taken part.
    pub(super) there: u16,
    /// The view that is followed.
    pub(super) base: View,
    pub(super) view: Option<View>,
    pub(super) lease_left: u16,
}

/// What is to be sent.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub(super) struct ViewDue {
    pub(super) proposal: bool,
    pub(super) decision: bool,
    pub(super) busy: bool,
}
