//! Distribution of a newer mission in flight.
//!
//! Any relay next to the ground station accepts an offer. Each hello states its sender's mission. A relay offers its
//! mission to a neighbour with an older one. It requests a view if its stored mission is newer than the active one. A
//! proposal names the mission of the view, and only relays that have exactly that mission forward it. So all members of
//! a granted view have its mission. A relay that misses the decision, or loses the mission, cannot take part in
//! anything before it flies that mission too.
//!
//! An offer repeats the nonce of a recent hello of its receiver. The nonce changes after `dead_after`. The current
//! and the previous nonce are valid until twice `dead_after` after their last use. So an offer that was recorded or
//! withheld is worthless later, although its tag is right.
//!
//! A relay that has an offer to make, but no recent hello of the neighbour, sends a hello that requests one. Offers are
//! repeated up to sixteen times until the neighbour reports the mission: first after four hop times, then less and less
//! often.
//!
//! | event | action |
//! | --- | --- |
//! | hello received, older mission | offer the newer one |
//! | hello received, newer mission | reply with a hello, to be offered that mission |
//! | offer received, newer mission | store it; `Event::Uploaded`; send a hello; offer it to the neighbour on the other side; request a view |
//! | offer received, mission not newer | reply with a hello |
//! | offer received, no valid line on earth, outside the relay's own geofence, or fitted slots against the settings | count it; `Event::UploadRefused` once; state that mission as refused in hellos; reply with a hello |
//! | hello received, stored mission refused | state the same in hellos, until the mission is flown or a newer one is stored; once send a hello to the other neighbour |
//! | offer received, answers no recent hello | count it as stale; reply with a hello, which the next offer can answer |
//! | proposal due, next relay has an older or unknown mission | offer the newer one first |
//! | offer due, no recent hello of the neighbour | send a hello that requests one; answer that with the offer |
//! | proposal received, names another mission than the stored one | reply with a hello; do not join |
//! | decision received, view granted | fly its mission; `Event::Adopted` |

use super::context::Member;
use super::context::earliest;
use crate::features::UPLOAD;
use crate::geodetic::{LineError, Sites};
use crate::guard::config::Geofence;
use crate::mission::{Band, Mission, MissionConfig};
use crate::serial_number::next_nonzero;
use crate::side::Side;
use crate::time::{Instant, Jitter};
use crate::wire::digest::{MissionId, between};
use crate::wire::upload::{Upload, UploadError, check_line};

/// Random number (nonce) in this relay's hellos, 0 for none, with the times of its first and last use.
///
/// A mission offer to this relay must repeat the nonce. So an old recording of an offer is recognised.
#[derive(Clone, Copy, Debug)]
struct HelloNonce {
    nonce: u16,
    first: Instant,
    last: Instant,
}

/// Mission offers to the neighbour on one side, and replies to the ground station on that side.
#[derive(Clone, Copy, Debug)]
struct Offering {
    /// Nonce in the neighbour's last hello, repeated by the next offer to the neighbour. 0 before the first hello.
    nonce: u16,
    /// Time at which the neighbour's last hello was received; `None` without a hello.
    heard: Option<Instant>,
    /// True if an offer of the newest mission must be sent to this neighbour.
    is_due: bool,
    /// Time of the next repetition of the offer; `None` if none is scheduled.
    at: Option<Instant>,
    /// Number of offers sent since the mission or the neighbour last changed.
    tries: u8,
    /// True if a hello to the ground station on this side is pending.
    ground_hello_due: bool,
    /// Nonce of the ground station's request for the uploaded mission, repeated in the reply. 0 without a request.
    ground_nonce: u16,
}

impl Offering {
    const NONE: Self = Self {
        nonce: 0,
        heard: None,
        is_due: false,
        at: None,
        tries: 0,
        ground_hello_due: false,
        ground_nonce: 0,
    };
}

/// Result of handling a mission that a neighbour has offered.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Offered {
    /// The offered mission is newer than the stored one, and has been stored.
    Stored,
    /// The mission is rejected: it contradicts the Tx and Rx positions, the geofence or the settings.
    ///
    /// `is_new` is true at the first rejection of this mission.
    Refused { why: LineError, is_new: bool },
    /// The mission is ignored: it is not newer than the stored one, or is for a different chain.
    Passed,
}

/// Wait before a mission offer is first repeated, in hop times.
const OFFER_HOPS: u32 = 4;
/// Number of mission offers after which their interval doubles with each further offer.
const OFFERS_AT_A_PACE: u8 = 4;
/// Maximum number of repetitions of a mission offer to one neighbour.
const OFFERS: u8 = 16;

/// Missions stored by this relay, and its offers of the newest mission to its neighbours.
#[derive(Clone, Debug)]
pub(crate) struct MissionUpdate {
    /// Identifier of the newest mission that this relay has stored.
    latest: MissionId,
    /// State of mission uploads. Empty without the feature `upload`.
    uploads: [Uploads; UPLOAD as usize],
}

#[derive(Clone, Copy, Debug)]
struct Uploads {
    /// Newest uploaded mission. `None` if this relay has only the mission loaded before flight.
    upload: Option<Upload>,
    /// Positions of Tx and Rx in the active mission; `None` if the configured positions apply. The x axis runs from Tx
    /// to Rx.
    sites: Option<Sites>,
    /// Distance from Tx to Rx in the mission loaded before flight, m.
    loaded_m: f32,
    /// Range of altitudes in the mission loaded before flight, m. The relays' common altitude is within the range.
    loaded_band: Band,
    /// Last mission that this relay or any other relay has refused; `None` if there is none.
    refused: Option<MissionId>,
    /// Current and previous nonce (random number) in this relay's hellos. A mission offer must repeat either nonce.
    hello_nonces: [HelloNonce; 2],
    /// Mission offers to the neighbour toward Tx and to the neighbour toward Rx.
    offering: [Offering; 2],
    jitter: Jitter,
}

/// Returns true if this relay accepts uploaded missions, which requires signed frames.
pub(crate) const fn accepts_uploads(member: &Member) -> bool {
    UPLOAD && member.settings.auth.is_some()
}

impl MissionUpdate {
    pub(crate) fn new(member: &Member, seed: u32, now: Instant) -> Self {
        let current = HelloNonce {
            nonce: Jitter::new(seed).number(),
            first: now,
            last: now,
        };
        let loaded = member.mission.config();
        let uploads = Uploads {
            upload: None,
            sites: None,
            loaded_m: loaded.distance_m,
            loaded_band: altitudes_of(loaded),
            refused: None,
            hello_nonces: [
                current,
                HelloNonce {
                    nonce: 0,
                    ..current
                },
            ],
            offering: [Offering::NONE; 2],
            jitter: Jitter::new(seed),
        };
        Self {
            latest: member.active,
            uploads: [uploads; UPLOAD as usize],
        }
    }

    const fn uploads(&self) -> Option<&Uploads> {
        self.uploads.first()
    }

    pub(crate) const fn latest(&self) -> MissionId {
        self.latest
    }

    /// Returns the active mission or the stored upload, whichever `id` identifies; otherwise `None`.
    pub(crate) fn mission_of(&self, member: &Member, id: MissionId) -> Option<Mission> {
        if id == member.active {
            return Some(member.mission);
        }
        let upload = self.upload().filter(|_| id == self.latest)?;
        Mission::try_new(*upload.config()).ok()
    }

    /// Returns the nonce for the next hello, which a mission offer must repeat. 0 if this relay accepts no uploads. The
    /// nonce changes every `dead_after`.
    pub(crate) fn next_hello_nonce(&mut self, now: Instant, member: &Member) -> u16 {
        let uploads = self.uploads.first_mut();
        let Some(uploads) = uploads.filter(|_| accepts_uploads(member)) else {
            return 0;
        };
        let [current, before] = &mut uploads.hello_nonces;
        if now.since(current.first) >= member.settings.dead_after {
            *before = *current;
            current.nonce = next_nonzero(current.nonce);
            current.first = now;
        }
        current.last = now;
        current.nonce
    }

    /// Returns true if the `nonce` of a mission offer was in a recent hello of this relay.
    ///
    /// Recent means within the last two periods of `dead_after`.
    pub(crate) fn is_recent_nonce(&self, nonce: u16, now: Instant, member: &Member) -> bool {
        let span = member.settings.dead_after.times(2);
        let is_it = |own: &HelloNonce| own.nonce == nonce && now.since(own.last) <= span;
        nonce != 0
            && self
                .uploads()
                .is_some_and(|it| it.hello_nonces.iter().any(is_it))
    }

    fn offering(&mut self, side: Side) -> Option<&mut Offering> {
        let [upstream, downstream] = &mut self.uploads.first_mut()?.offering;
        Some(match side {
            Side::Upstream => upstream,
            Side::Downstream => downstream,
        })
    }

    /// Records the nonce in a hello of the neighbour at `side`. The next mission offer repeats this nonce.
    pub(crate) fn record_neighbour_nonce(&mut self, side: Side, nonce: u16, now: Instant) {
        if let Some(offering) = self.offering(side) {
            offering.nonce = nonce;
            offering.heard = Some(now);
        }
    }

    pub(crate) fn schedule_offer(&mut self, side: Side) {
        if let Some(offering) = self.offering(side) {
            offering.is_due = true;
        }
    }

    /// Resets the count of offers to the neighbour at `side`, because the mission or the neighbour is new.
    pub(crate) fn reset_offers(&mut self, side: Side) {
        if let Some(offering) = self.offering(side) {
            offering.tries = 0;
        }
    }

    pub(crate) fn stop_offers(&mut self, side: Side) {
        if let Some(offering) = self.offering(side) {
            offering.at = None;
        }
    }

    /// Returns the pending mission offer to the neighbour `to` at `side`, and marks it as sent.
    ///
    /// `holds` is the newest mission that the neighbour has reported; `None` if unknown. The result has the
    /// nonce of the neighbour's hello, which the offer repeats. The nonce is `None` if the hello is older than half of
    /// `dead_after`. Then the caller must first request a new hello.
    pub(crate) fn poll_offer(
        &mut self,
        (side, to): (Side, u16),
        holds: Option<MissionId>,
        now: Instant,
        member: &Member,
    ) -> Option<(Upload, Option<u16>)> {
        let settings = &member.settings;
        let is_due = core::mem::take(&mut self.offering(side)?.is_due);
        let upload = self.offer_for(holds).filter(|_| is_due && to != 0)?;
        let tries = self.offering(side)?.tries;
        let hops = OFFER_HOPS << (tries / OFFERS_AT_A_PACE).min(OFFERS);
        let wait = settings.hop_time.times(hops).min(settings.probe_after);
        let at = now + self.uploads.first_mut()?.jitter.spread(wait);
        let offering = self.offering(side)?;
        offering.at = (tries < OFFERS).then_some(at);
        offering.tries = tries.saturating_add(1);
        let is_valid = |heard: Instant| now.since(heard).times(2) <= settings.dead_after;
        let answers = offering.heard.is_some_and(is_valid);
        Some((upload, answers.then_some(offering.nonce)))
    }

    /// Schedules the next repetition of the offers whose timers have expired.
    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        for side in [Side::Upstream, Side::Downstream] {
            if let Some(offering) = self.offering(side)
                && offering.at.is_some_and(|at| at <= now)
            {
                offering.at = None;
                offering.is_due = true;
            }
        }
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        let [upstream, downstream] = self.uploads()?.offering;
        earliest(upstream.at, downstream.at)
    }

    /// Schedules replies to the ground station at `side`.
    ///
    /// A hello is scheduled if `hello` is true, and the stored upload if `nonce` is that of a request for it.
    pub(crate) fn answer_ground(&mut self, side: Side, hello: bool, nonce: Option<u16>) {
        if let Some(offering) = self.offering(side) {
            offering.ground_hello_due |= hello;
            offering.ground_nonce = nonce.unwrap_or(offering.ground_nonce);
        }
    }

    /// Returns true if a hello to the ground station at `side` is pending, and marks it as sent.
    pub(crate) fn poll_ground_hello(&mut self, side: Side) -> bool {
        let offering = self.offering(side);
        offering.is_some_and(|offering| core::mem::take(&mut offering.ground_hello_due))
    }

    /// Returns the upload that the ground station at `side` has requested, and the nonce of the request. `None`
    /// without a request, or without a stored upload.
    pub(crate) fn poll_requested(&mut self, side: Side) -> Option<(Upload, u16)> {
        let nonce = core::mem::take(&mut self.offering(side)?.ground_nonce);
        Some((*self.upload().filter(|_| nonce != 0)?, nonce))
    }

    /// Returns the last refused mission. `None` if no mission was refused, if the refused mission is `active`, or if
    /// the stored mission is newer.
    pub(crate) fn refused_mission(&self, active: MissionId) -> Option<MissionId> {
        let refused = self.uploads()?.refused;
        refused.filter(|refused| *refused >= self.latest && *refused != active)
    }

    /// Records a neighbour's report that the mission `refused` is refused. Returns true if this relay has stored that
    /// mission and did not know of the refusal.
    pub(crate) fn record_refused(&mut self, refused: MissionId) -> bool {
        refused == self.latest && self.refuse(refused)
    }

    /// Records that mission `id` is refused. Returns true if this is new.
    fn refuse(&mut self, id: MissionId) -> bool {
        let uploads = self.uploads.first_mut();
        uploads.is_some_and(|uploads| uploads.refused.replace(id) != Some(id))
    }

    /// Stores `upload` if it is newer than the stored mission, and fits this relay's mission and geofence.
    pub(crate) fn store_if_newer(&mut self, member: &Member, upload: &Upload) -> Offered {
        let id = upload.id();
        if id <= self.latest {
            return Offered::Passed;
        }
        match self.fits(member, upload) {
            Ok(()) => {
                self.store(upload);
                Offered::Stored
            }
            Err(UploadError::Line(why)) => Offered::Refused {
                why,
                is_new: self.refuse(id),
            },
            Err(_) => Offered::Passed,
        }
    }

    fn store(&mut self, upload: &Upload) {
        if let Some(uploads) = self.uploads.first_mut() {
            self.latest = upload.id();
            uploads.upload = Some(*upload);
            uploads.refused = None;
        }
    }

    pub(crate) fn accept_upload(
        &mut self,
        member: &Member,
        upload: &Upload,
    ) -> Result<(), UploadError> {
        if !accepts_uploads(member) {
            return Err(UploadError::Unsigned);
        }
        self.fits(member, upload)?;
        match self.store_if_newer(member, upload) {
            Offered::Stored => Ok(()),
            _ => Err(UploadError::Old),
        }
    }

    /// Restores the stored mission `upload` after a start, and returns it. Returns an error if the relay has already
    /// taken part in the chain (`untouched` is false).
    pub(crate) fn resume(
        &mut self,
        member: &Member,
        upload: &Upload,
        untouched: bool,
    ) -> Result<Mission, UploadError> {
        self.fits(member, upload)?;
        if self.upload().is_some() || !untouched {
            return Err(UploadError::Begun);
        }
        let mission = Mission::try_new(*upload.config()).map_err(UploadError::Mission)?;
        self.store(upload);
        Ok(mission)
    }

    /// Returns the uploaded mission; `None` if only the mission loaded before flight is known.
    pub(crate) const fn upload(&self) -> Option<&Upload> {
        match self.uploads() {
            Some(uploads) => uploads.upload.as_ref(),
            None => None,
        }
    }

    /// Returns the upload to offer to a neighbour whose newest mission is `holds` (`None` if unknown). `None` if the
    /// neighbour's mission is not older than the upload, or if there is no upload.
    pub(crate) fn offer_for(&self, holds: Option<MissionId>) -> Option<Upload> {
        let older = holds.is_none_or(|holds| holds < self.latest);
        self.upload().copied().filter(|_| older)
    }

    /// Checks that `upload` fits the loaded mission, the settings, the sites and the geofence.
    ///
    /// The sites are the positions of Tx and Rx. A relay accepts no upload if its interference is configured as a
    /// function of x (a field).
    fn fits(&self, member: &Member, upload: &Upload) -> Result<(), UploadError> {
        let config = upload.config();
        let loaded = self.uploads().ok_or(UploadError::Base)?;
        if upload.base() != member.digest
            || config.relays != member.all
            || member.mission.field().is_some()
        {
            return Err(UploadError::Base);
        }
        if !member.settings.allow_slots_of(config) {
            return Err(UploadError::Line(LineError::Slots));
        }
        let is_other = config.distance_m.to_bits() != loaded.loaded_m.to_bits();
        loaded
            .encloses(member, config, upload.sites().is_some())
            .map_err(UploadError::Line)?;
        match upload.sites() {
            // Relays without Tx and Rx coordinates check this too. So either all relays store the mission or none does.
            Some(sites) => check_line(sites, config.distance_m).map_err(UploadError::Line),
            None if member.settings.sited && is_other => {
                Err(UploadError::Line(LineError::Distance))
            }
            None => Ok(()),
        }
    }
}

/// Positions of Tx and Rx in the active mission, which define its x axis.
impl MissionUpdate {
    /// Returns the Tx and Rx positions of the active mission; `None` if the configured positions apply.
    pub(crate) fn sites(&self) -> Option<Sites> {
        self.uploads()?.sites
    }

    /// Returns a digest of the Tx and Rx positions. Equal digests show that two relays use the same x axis.
    pub(crate) fn line_digest(&self, member: &Member) -> u16 {
        between(member.digest, self.sites())
    }

    /// Uses the stored mission's Tx and Rx positions from now on. Returns true if these positions differ from those
    /// used before. Then all relay positions are invalid.
    pub(crate) fn use_sites(&mut self) -> bool {
        let sites = self.upload().and_then(Upload::sites);
        let uploads = self.uploads.first_mut();
        uploads.is_some_and(|uploads| core::mem::replace(&mut uploads.sites, sites) != sites)
    }

    /// Returns the geofence for the active mission; `None` without a guard.
    ///
    /// If the mission's distance from Tx to Rx differs from that of the loaded mission, the maximum x of the geofence
    /// changes by the difference.
    pub(crate) fn geofence(&self, member: &Member) -> Option<Geofence> {
        let mut fence = member.settings.guard?.geofence;
        if self.sites().is_some() {
            let longer_m = member.mission.config().distance_m - self.uploads()?.loaded_m;
            fence.most_x_m = (fence.most_x_m + longer_m).max(fence.least_x_m);
        }
        Some(fence)
    }
}

impl Uploads {
    /// Checks that a mission with `config` is within the configured geofence. The error names the exceeded limit.
    ///
    /// The distance from Tx to Rx is not limited if the mission has its own Tx and Rx positions (`sited`). If an
    /// altitude limit of the geofence equals this relay's fixed altitude, it is replaced by the altitude limit of the
    /// mission loaded before flight. So all relays decide alike.
    fn encloses(
        &self,
        member: &Member,
        config: &MissionConfig,
        sited: bool,
    ) -> Result<(), LineError> {
        let Some(guard) = member.settings.guard else {
            return Ok(());
        };
        let fence = guard.geofence;
        let own_m = member.settings.profile.map(|own| own.altitude_m);
        let edge = |edge_m: f32, loaded_m: f32| match own_m {
            Some(own_m) if own_m.to_bits() == edge_m.to_bits() => loaded_m,
            _ => edge_m,
        };
        let altitudes_m = Band {
            least_m: edge(fence.least_altitude_m, self.loaded_band.least_m),
            most_m: edge(fence.most_altitude_m, self.loaded_band.most_m),
        };
        let is_within = |inner: Band, outer: Band| {
            inner.least_m >= outer.least_m && inner.most_m <= outer.most_m
        };
        let sides_m = Band {
            least_m: fence.least_y_m,
            most_m: fence.most_y_m,
        };
        if !is_within(altitudes_of(config), altitudes_m) {
            Err(LineError::Altitude)
        } else if !is_within(config.lateral, sides_m) {
            Err(LineError::Lateral)
        } else if !sited && config.distance_m > fence.most_x_m.max(self.loaded_m) {
            Err(LineError::Length)
        } else {
            Ok(())
        }
    }
}

/// Returns a mission's range of altitudes, m, extended so that it includes the relays' common altitude.
fn altitudes_of(config: &MissionConfig) -> Band {
    let common_m = config.common.altitude_m;
    Band {
        least_m: config.band.least_m.min(common_m),
        most_m: config.band.most_m.max(common_m),
    }
}
