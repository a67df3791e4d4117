//! Exchange of newer missions with neighbours and the ground, and measurements from the ground.

use super::Node;
use crate::event::Event;
use crate::node::mission_update::{Offered, accepts_uploads};
use crate::sample::Sample;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::digest::MissionId;
use crate::wire::message::{Hello, Message};
use crate::wire::upload::{Upload, UploadError};

impl Node {
    /// Handles a message from the ground station at `side` (Tx or Rx). Returns false for a message that no ground
    /// station may send.
    pub(super) fn on_ground(
        &mut self,
        now: Instant,
        side: Side,
        from: u16,
        message: &Message,
    ) -> bool {
        let base = self.member.digest;
        match message {
            Message::Offer { .. } | Message::Hello(_) | Message::Level { .. }
                if message.digest() != Some(base) =>
            {
                self.refuse_mission(now, side, from);
            }
            Message::Offer {
                upload,
                offer_number,
            } => {
                if self.check_nonce(now, *offer_number) {
                    self.store_upload(now, upload);
                }
                self.layers.update.answer_ground(side, true, None);
            }
            Message::Hello(hello) => {
                let is_older = hello.latest_mission < self.layers.update.latest();
                let requested = is_older.then_some(hello.offer_number);
                self.layers
                    .update
                    .answer_ground(side, hello.requests_reply, requested);
            }
            Message::Level { power_w, .. } => self.handle_sample(
                now,
                match side {
                    Side::Upstream => Sample::Transmitter { power_w: *power_w },
                    Side::Downstream => Sample::Receiver { power_w: *power_w },
                },
            ),
            Message::Watch { .. } => self.on_telemetry(now, side, from, message),
            _ => return false,
        }
        true
    }

    /// Returns the next message for the ground station at `side`, with the station's node number.
    ///
    /// The message is a hello or the requested upload; `None` if neither is pending.
    pub(super) fn next_for_ground(&mut self, now: Instant, side: Side) -> Option<(u16, Message)> {
        let to = self.member.station(side);
        if !self.layers.update.poll_ground_hello(side) {
            let (upload, offer_number) = self.layers.update.poll_requested(side)?;
            return Some((
                to,
                Message::Offer {
                    upload,
                    offer_number,
                },
            ));
        }
        let offer_number = self.layers.update.next_hello_nonce(now, &self.member);
        let hello = Hello {
            neighbour: 0,
            requests_view: false,
            ..self.hello(now, side, false, offer_number)
        };
        Some((to, Message::Hello(hello)))
    }

    /// Returns true if `nonce` was in a recent hello of this relay. Otherwise counts the offer as stale.
    fn check_nonce(&mut self, now: Instant, nonce: u16) -> bool {
        let is_recent = self.layers.update.is_recent_nonce(nonce, now, &self.member);
        if !is_recent {
            bump(&mut self.telemetry.stats.stale);
        }
        is_recent
    }

    /// Handles a mission offer from node `from` at `side`. The node has loaded the same mission before flight.
    ///
    /// An offer must repeat the nonce (random number) of a recent hello of this relay. If it does not, this relay sends
    /// a hello with a nonce for the next offer. A valid offer is answered only if this relay now has its mission or a
    /// newer one, or has refused it. Otherwise the answer would trigger the same offer again.
    pub(super) fn on_offer(
        &mut self,
        now: Instant,
        side: Side,
        from: u16,
        upload: &Upload,
        offer_number: u16,
    ) {
        if !accepts_uploads(&self.member) {
            return bump(&mut self.telemetry.stats.unsigned);
        }
        if !self.check_nonce(now, offer_number) {
            return self.schedule_hello(side, from, false);
        }
        let id = upload.id();
        let neighbour = self.layers.neighbours.at_mut(side);
        if neighbour.node() == from {
            neighbour.latest_mission = neighbour.latest_mission.max(Some(id));
        }
        self.store_upload(now, upload);
        let refused = self.layers.update.refused_mission(self.member.active);
        if self.layers.update.latest() >= id || refused == Some(id) {
            self.schedule_hello(side, from, false);
        }
    }

    /// Stores `upload` if it is newer than the stored mission. If it contradicts the positions of Tx and Rx or the
    /// geofence, the mission is refused, counted, and reported once.
    fn store_upload(&mut self, now: Instant, upload: &Upload) {
        match self.layers.update.store_if_newer(&self.member, upload) {
            Offered::Stored => self.on_stored(now),
            Offered::Refused { why, is_new } => {
                bump(&mut self.telemetry.stats.mission);
                if is_new {
                    self.raise(Event::UploadRefused { why });
                }
            }
            Offered::Passed => {}
        }
    }

    /// Reports the newly stored mission, offers it to both neighbours, and requests a view that uses it.
    fn on_stored(&mut self, now: Instant) {
        self.raise(Event::Uploaded);
        // The leader needs the mission to propose it, and the other relays need it before the proposal reaches them.
        for side in [Side::Upstream, Side::Downstream] {
            self.layers.update.schedule_offer(side);
            self.layers.update.reset_offers(side);
        }
        self.layers.view.request.start(now);
    }

    pub(crate) fn handle_upload(
        &mut self,
        now: Instant,
        upload: &Upload,
    ) -> Result<(), UploadError> {
        self.layers.update.accept_upload(&self.member, upload)?;
        self.on_stored(now);
        Ok(())
    }

    /// Restores the stored mission `upload` after a start, as the active mission.
    pub(crate) fn resume(&mut self, upload: &Upload) -> Result<(), UploadError> {
        let untouched = self.layers.view.is_untouched() && self.layers.round.is_untouched();
        let mission = self.layers.update.resume(&self.member, upload, untouched)?;
        self.adopt(mission, upload.id(), None);
        Ok(())
    }

    pub(crate) const fn upload(&self) -> Option<&Upload> {
        self.layers.update.upload()
    }

    /// Handles a neighbour's report that the mission `refused` is refused. The neighbour itself, or a relay beyond the
    /// neighbour, has refused this mission.
    pub(super) fn on_refused(&mut self, side: Side, refused: MissionId) {
        let is_held = refused == self.layers.update.latest() && refused != self.member.active;
        if !is_held || !accepts_uploads(&self.member) {
            return;
        }
        self.layers.update.stop_offers(side);
        if self.layers.update.record_refused(refused) {
            let other = side.other();
            let to = self.layers.neighbours.at(other).node();
            if to != 0 {
                self.schedule_hello(other, to, false);
            }
        }
    }

    /// Compares `holds`, the stored mission of node `from` at `side`, with this relay's newest mission. If `holds` is
    /// older, an offer is scheduled. If it is newer, a hello that requests an offer is scheduled.
    pub(super) fn compare_missions(&mut self, side: Side, from: u16, holds: MissionId) {
        if !accepts_uploads(&self.member) {
            return;
        }
        let latest = self.layers.update.latest();
        if holds >= latest {
            self.layers.update.stop_offers(side);
        }
        if holds > latest {
            self.schedule_hello(side, from, false);
        } else if holds < latest {
            self.layers.update.schedule_offer(side);
        } else if self.layers.neighbours.at(side).latest_mission != Some(latest)
            && side == self.onward()
            && self
                .layers
                .view
                .outstanding()
                .is_some_and(|proposed| proposed.mission_id == latest)
        {
            // The view proposal was waiting for the neighbour's mission.
            self.layers.view.resend();
        }
    }

    /// Returns the pending mission offer to the neighbour at `side`; `None` if none is pending. An offer must answer a
    /// recent hello of the neighbour. Without such a hello, the result is a hello of this relay that requests a hello
    /// of the neighbour.
    pub(super) fn next_offer(&mut self, now: Instant, side: Side) -> Option<(Side, u16, Message)> {
        let neighbour = self.layers.neighbours.at(side);
        let (to, holds) = (neighbour.node(), neighbour.latest_mission);
        let update = &mut self.layers.update;
        let (upload, offer_number) = update.poll_offer((side, to), holds, now, &self.member)?;
        let message = if let Some(offer_number) = offer_number {
            Message::Offer {
                upload,
                offer_number,
            }
        } else {
            let offer_number = update.next_hello_nonce(now, &self.member);
            Message::Hello(self.hello(now, side, true, offer_number))
        };
        Some((side, to, message))
    }
}
