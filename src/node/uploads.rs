//! A newer mission, in flight: who holds it, who is offered it, and when it is flown.
//!
//! Any relay next to the ground takes an offer. Neighbours tell each other in every hello which mission they hold; whoever holds
//! a newer one offers it, and whoever holds a newer one than it flies calls for a view. A proposal names the one mission that the
//! view is to fly, and only a relay that holds just that one hands it on. So a view that is granted is of relays that hold it
//! all, durably or not: one that misses the count, or forgets what it held, can take part in nothing before it flies it, too.
//!
//! | between neighbours | what follows |
//! | --- | --- |
//! | a hello of a node that holds an older mission | it is offered the newer one |
//! | a hello of a node that holds a newer mission | a hello, so that it is offered here |
//! | an offer of a newer mission | held from now on: `Event::Uploaded`; a hello; an offer to the relay before, toward the leader; a call for a view |
//! | an offer of one that is not newer | a hello |
//! | a proposal is due, and the node after holds an older mission or has not said which | it is offered the newer one first |
//! | a proposal that does not name the mission held | a hello, and no part in it |
//! | a count of a view that was granted | its mission is flown: `Event::Adopted` |

use super::Node;
use super::beside::CANDIDATES;
use crate::event::Event;
use crate::mission::Mission;
use crate::settings::Wiring;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::digest::MissionId;
use crate::wire::message::{Hello, Message};
use crate::wire::upload::{Upload, UploadError};

impl Node {
    /// On which side `node` is, if it is the ground transmitter or receiver and near enough to be heard.
    pub(super) fn ground_side(&self, node: u16) -> Option<Side> {
        let (own, all) = (self.members.node, self.members.all);
        let most = match self.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => CANDIDATES,
        };
        let near = self.takes_uploads() && node.abs_diff(own) <= most;
        match node {
            0 if near => Some(Side::Upstream),
            _ if near && node == all.saturating_add(1) => Some(Side::Downstream),
            _ => None,
        }
    }

    /// A message from the ground at `side`; whether it is one for the ground to say.
    pub(super) fn on_ground(&mut self, now: Instant, side: Side, message: &Message) -> bool {
        let base = self.members.digest;
        match message {
            Message::Offer(_) | Message::Hello(_) if message.mission() != Some(base) => {
                self.refuse_mission(side);
            }
            Message::Offer(upload) => {
                self.hold(now, *upload);
                self.beside(side).ground = true;
            }
            Message::Hello(hello) => self.beside(side).ground |= hello.ask,
            _ => return false,
        }
        true
    }

    /// What the ground at `side` is told, once it is owed: to which node.
    pub(super) fn next_report(&mut self, side: Side) -> Option<(u16, Hello)> {
        if !core::mem::take(&mut self.beside(side).ground) {
            return None;
        }
        let to = match side {
            Side::Upstream => 0,
            Side::Downstream => self.members.all.saturating_add(1),
        };
        let hello = Hello {
            neighbour: 0,
            form: false,
            ..self.hello(side, false)
        };
        Some((to, hello))
    }

    /// An offer from node `from` at `side`, for relays that were loaded with the same mission. Answered only by who holds as new
    /// a mission then: any other answer would be answered by the same offer.
    pub(super) fn on_offer(&mut self, now: Instant, side: Side, from: u16, upload: &Upload) {
        if !self.takes_uploads() {
            return bump(&mut self.stats.unsigned);
        }
        let mission_id = upload.id();
        let beside = self.beside(side);
        if beside.node() == from {
            beside.holds = beside.holds.max(Some(mission_id));
        }
        self.hold(now, *upload);
        if self.members.held >= mission_id {
            self.owe_hello(side, from, false);
        }
    }

    /// Whether `upload` is for these relays. None is for relays in a field, even if its base has the digest of their mission.
    fn fits(&self, upload: &Upload) -> bool {
        upload.base() == self.members.digest
            && upload.config().relays == self.members.all
            && self.mission.field().is_none()
    }

    /// Holds `upload` from now on, if it is newer than what is held.
    fn hold(&mut self, now: Instant, upload: Upload) -> bool {
        let mission_id = upload.id();
        let newer = mission_id > self.members.held && self.fits(&upload);
        if newer {
            self.members.held = mission_id;
            self.upload = Some(upload);
            self.pending.raise(Event::Uploaded);
            // The leader has to hold it first; the others are offered it before the proposal comes to them.
            self.beside(Side::back(self.mission.heading())).offer = true;
            self.call(now);
        }
        newer
    }

    /// The same by the relay's own firmware.
    pub(crate) fn handle_upload(
        &mut self,
        now: Instant,
        upload: &Upload,
    ) -> Result<(), UploadError> {
        if !self.takes_uploads() {
            return Err(UploadError::Unsigned);
        }
        if !self.fits(upload) {
            return Err(UploadError::Base);
        }
        if self.hold(now, *upload) {
            Ok(())
        } else {
            Err(UploadError::Old)
        }
    }

    /// A relay that has just been switched on flies `upload`, which it held before.
    pub(crate) fn resume(&mut self, upload: &Upload) -> Result<(), UploadError> {
        if !self.fits(upload) {
            return Err(UploadError::Base);
        }
        if self.members.newest > 0 || self.upload.is_some() || !self.share.is_untouched() {
            return Err(UploadError::Begun);
        }
        let mission = Mission::try_new(*upload.config()).map_err(UploadError::Mission)?;
        self.members.held = upload.id();
        self.upload = Some(*upload);
        self.fly(mission, self.members.held);
        Ok(())
    }

    /// The newest mission held, if it was uploaded.
    pub(crate) const fn upload(&self) -> Option<&Upload> {
        self.upload.as_ref()
    }

    /// The neighbour `from` at `side` says that it holds the mission of mission_id `holds`.
    pub(super) fn compare(&mut self, side: Side, from: u16, holds: MissionId) {
        if !self.takes_uploads() {
            return;
        }
        let held = self.members.held;
        if holds > held {
            self.owe_hello(side, from, false);
        } else if holds < held {
            self.beside(side).offer = true;
        } else if self.beside(side).holds != Some(held)
            && side == Side::onward(self.mission.heading())
            && self
                .share
                .called()
                .is_some_and(|(_, mission_id)| mission_id == held)
        {
            // The proposal had to wait for that.
            self.onward_due = true;
        }
    }

    /// What the neighbour at `side` has to be offered before anything else, if it is.
    pub(super) fn offer(&self, side: Side) -> Option<Message> {
        let beside = match side {
            Side::Upstream => &self.upstream,
            Side::Downstream => &self.downstream,
        };
        let older = beside.holds.is_none_or(|holds| holds < self.members.held);
        self.upload.filter(|_| older).map(Message::Offer)
    }

    /// The mission of mission_id `mission_id`, if it is the one held.
    pub(super) fn uploaded(&self, mission_id: MissionId) -> Option<Mission> {
        let upload = self.upload.filter(|upload| upload.id() == mission_id)?;
        Mission::try_new(*upload.config()).ok()
    }
}

#[cfg(test)]
mod tests;
