//! Distribution of a newer mission in flight.
//!
//! Any relay next to the ground station accepts an offer. Each hello states the mission that its sender has. A relay offers its
//! mission to a neighbour with an older one, and requests a view if its stored mission is newer than the active one. A proposal
//! names the mission of the view, and only relays that have exactly that mission forward it. So all members of a granted view
//! have its mission. A relay that misses the decision, or loses the mission, cannot take part in anything before it flies that
//! mission too.
//!
//! An offer contains the number of a recent hello of its receiver. The number changes after `dead_after`; it and the previous one
//! are valid until twice `dead_after` after their last use. So a recorded or withheld offer is worthless later, although its tag
//! is right.
//!
//! A relay with an offer to make, but without a recent hello to answer, sends a hello that requests one. Offers are repeated
//! until the neighbour reports the mission: first after four hop times, then less and less often, sixteen times.
//!
//! | event | action |
//! | --- | --- |
//! | hello received, older mission | offer the newer one |
//! | hello received, newer mission | reply with a hello, to be offered that mission |
//! | offer received, newer mission | store it; `Event::Uploaded`; send a hello; offer it to the neighbour on the other side; request a view |
//! | offer received, mission not newer | reply with a hello |
//! | offer received, no valid line on earth or outside the relay's own geofence | count it; `Event::UploadRefused` once; state that mission as refused in hellos; reply with a hello |
//! | hello received, stored mission refused | state the same in hellos, until the mission is flown or a newer one is stored; once send a hello to the other neighbour |
//! | offer received, answers no recent hello | count it as stale; reply with a hello, which the next offer can answer |
//! | proposal due, next relay has an older or unknown mission | offer the newer one first |
//! | offer due, no recent hello of the neighbour | send a hello that requests one; answer that with the offer |
//! | proposal received, names another mission than the stored one | reply with a hello; do not join |
//! | decision received, view granted | fly its mission; `Event::Adopted` |

use super::context::Member;
#[cfg(feature = "upload")]
use super::timing::earliest;
#[cfg(feature = "upload")]
use crate::geodetic::{LineError, Sites};
use crate::mission::Mission;
#[cfg(feature = "upload")]
use crate::settings::Settings;
#[cfg(feature = "upload")]
use crate::side::Side;
use crate::time::Instant;
#[cfg(feature = "upload")]
use crate::time::Jitter;
use crate::wire::digest::MissionId;
#[cfg(feature = "upload")]
use crate::wire::upload::{Upload, UploadError, check_line};

/// True with the feature `upload`; without it uploads are not accepted.
const UPLOAD: bool = cfg!(feature = "upload");

/// Number of this relay's hellos, for the offers that answer them, with its first and last use.
///
/// The number 0 means none.
#[cfg(feature = "upload")]
#[derive(Clone, Copy, Debug)]
struct Asked {
    number: u16,
    first: Instant,
    last: Instant,
}

#[cfg(feature = "upload")]
impl Asked {
    /// Returns true if `number` equals this number, and a hello used it within the last two `dead_after`.
    fn is(&self, number: u16, now: Instant, settings: &Settings) -> bool {
        number != 0
            && number == self.number
            && now.since(self.last).as_micros() <= settings.dead_after.times(2).as_micros()
    }
}

/// State of the offers to the neighbour on one side.
#[cfg(feature = "upload")]
#[derive(Clone, Copy, Debug)]
struct Offering {
    /// Time of the neighbour's last hello, which an offer can answer.
    heard: Option<Instant>,
    /// Time of the next repetition, and number of offers so far.
    at: Option<Instant>,
    tries: u8,
}

#[cfg(feature = "upload")]
impl Offering {
    const NONE: Self = Self {
        heard: None,
        at: None,
        tries: 0,
    };
}

/// Result of an offered mission.
#[cfg(feature = "upload")]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Offered {
    /// Stored.
    Held,
    /// Rejected: no valid line on earth, or outside the geofence; `is_new` for the first time.
    Refused { why: LineError, is_new: bool },
    /// Ignored: not newer, or for other relays.
    Passed,
}

/// Hop times until the first repetition, offers until the time doubles, and number of repetitions.
#[cfg(feature = "upload")]
const OFFER_HOPS: u32 = 4;
#[cfg(feature = "upload")]
const OFFERS_AT_A_PACE: u8 = 4;
#[cfg(feature = "upload")]
const OFFERS: u8 = 16;

/// Missions known to one relay, and its offers to the neighbours.
#[derive(Clone, Debug)]
pub(crate) struct MissionUpdate {
    /// Newest stored mission.
    latest: MissionId,
    /// Upload of that mission; `None` for the one loaded before flight.
    #[cfg(feature = "upload")]
    upload: Option<Upload>,
    /// Last mission refused by this relay or by one beyond a neighbour.
    #[cfg(feature = "upload")]
    refused: Option<MissionId>,
    /// Current number of this relay's hellos, and the previous one.
    #[cfg(feature = "upload")]
    asked: [Asked; 2],
    /// Offers toward Tx and toward Rx.
    #[cfg(feature = "upload")]
    offering: [Offering; 2],
    #[cfg(feature = "upload")]
    jitter: Jitter,
}

/// Returns true if uploads are accepted, which requires signed frames.
pub(crate) const fn takes_uploads(member: &Member) -> bool {
    UPLOAD && member.settings.auth.is_some()
}

impl MissionUpdate {
    pub(crate) const fn new(loaded: MissionId, seed: u32, now: Instant) -> Self {
        #[cfg(not(feature = "upload"))]
        let _ = (seed, now);
        #[cfg(feature = "upload")]
        let asked = Asked {
            number: Jitter::new(seed).number(),
            first: now,
            last: now,
        };
        Self {
            latest: loaded,
            #[cfg(feature = "upload")]
            upload: None,
            #[cfg(feature = "upload")]
            refused: None,
            #[cfg(feature = "upload")]
            asked: [asked, Asked { number: 0, ..asked }],
            #[cfg(feature = "upload")]
            offering: [Offering::NONE; 2],
            #[cfg(feature = "upload")]
            jitter: Jitter::new(seed),
        }
    }

    pub(crate) const fn latest(&self) -> MissionId {
        self.latest
    }

    /// Returns mission `id` if it is the active or the stored one.
    pub(crate) fn mission_of(&self, member: &Member, id: MissionId) -> Option<Mission> {
        if id == member.active {
            return Some(member.mission);
        }
        if id != self.latest {
            return None;
        }
        #[cfg(feature = "upload")]
        let held = self
            .upload
            .and_then(|upload| Mission::try_new(*upload.config()).ok());
        #[cfg(not(feature = "upload"))]
        let held = None;
        held
    }
}

#[cfg(feature = "upload")]
impl MissionUpdate {
    /// Returns the number for a hello sent now.
    pub(crate) fn ask(&mut self, now: Instant, settings: &Settings) -> u16 {
        let [current, before] = &mut self.asked;
        if now.since(current.first) >= settings.dead_after {
            *before = *current;
            current.number = match current.number.wrapping_add(1) {
                0 => 1,
                number => number,
            };
            current.first = now;
        }
        current.last = now;
        current.number
    }

    pub(crate) fn asked(&self, answer: u16, now: Instant, settings: &Settings) -> bool {
        self.asked
            .iter()
            .any(|asked| asked.is(answer, now, settings))
    }

    const fn offering(&mut self, side: Side) -> &mut Offering {
        let [upstream, downstream] = &mut self.offering;
        match side {
            Side::Upstream => upstream,
            Side::Downstream => downstream,
        }
    }

    /// Records a hello of the neighbour at `side`, which an offer can answer.
    pub(crate) const fn may_answer(&mut self, side: Side, now: Instant) {
        self.offering(side).heard = Some(now);
    }

    /// Returns true if the last hello at `side` is at most half of `dead_after` old: its number is valid.
    pub(crate) fn has_asked(&mut self, side: Side, now: Instant, settings: &Settings) -> bool {
        let heard = self.offering(side).heard;
        heard.is_some_and(|heard| now.since(heard).times(2) <= settings.dead_after)
    }

    /// Restarts the repetitions at `side`: there is a new mission or a new neighbour.
    pub(crate) const fn begin_offers(&mut self, side: Side) {
        self.offering(side).tries = 0;
    }

    /// Records an offer, or the request for a hello, and starts the timer of the next one.
    pub(crate) fn offered(&mut self, side: Side, now: Instant, settings: &Settings) {
        let tries = self.offering(side).tries;
        let hops = OFFER_HOPS << (tries / OFFERS_AT_A_PACE).min(OFFERS);
        let wait = settings.hop_time.times(hops).min(settings.probe_after);
        let at = now + self.jitter.spread(wait);
        *self.offering(side) = Offering {
            at: (tries < OFFERS).then_some(at),
            tries: tries.saturating_add(1),
            ..*self.offering(side)
        };
    }

    pub(crate) const fn stop_offers(&mut self, side: Side) {
        self.offering(side).at = None;
    }

    /// Returns true once when the timer of the next offer at `side` has expired.
    pub(crate) fn offers_again(&mut self, side: Side, now: Instant) -> bool {
        let offering = self.offering(side);
        let due = offering.at.is_some_and(|at| at <= now);
        if due {
            offering.at = None;
        }
        due
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        let [upstream, downstream] = self.offering;
        earliest(upstream.at, downstream.at)
    }

    /// Returns the refused mission if it is the stored or a newer one, and not `active`.
    pub(crate) fn refused_of(&self, active: MissionId) -> Option<MissionId> {
        self.refused
            .filter(|refused| *refused >= self.latest && *refused != active)
    }

    /// Records a neighbour's refusal; returns true if it is new and concerns the stored mission.
    pub(crate) fn hear_refused(&mut self, refused: MissionId) -> bool {
        refused == self.latest && self.refused.replace(refused) != Some(refused)
    }

    /// Stores `upload` if it is for this relay and newer than the stored mission.
    pub(crate) fn hold(&mut self, member: &Member, upload: &Upload) -> Offered {
        let id = upload.id();
        if id <= self.latest {
            return Offered::Passed;
        }
        match fits(member, upload) {
            Ok(()) => {
                self.latest = id;
                self.upload = Some(*upload);
                self.refused = None;
                Offered::Held
            }
            Err(UploadError::Line(why)) => Offered::Refused {
                why,
                is_new: self.refused.replace(id) != Some(id),
            },
            Err(_) => Offered::Passed,
        }
    }

    pub(crate) fn hand_in(&mut self, member: &Member, upload: &Upload) -> Result<(), UploadError> {
        if !takes_uploads(member) {
            return Err(UploadError::Unsigned);
        }
        fits(member, upload)?;
        match self.hold(member, upload) {
            Offered::Held => Ok(()),
            _ => Err(UploadError::Old),
        }
    }

    /// Restores `upload` after a start, if the relay is still `untouched`; returns its mission.
    pub(crate) fn resume(
        &mut self,
        member: &Member,
        upload: &Upload,
        untouched: bool,
    ) -> Result<Mission, UploadError> {
        fits(member, upload)?;
        if self.upload.is_some() || !untouched {
            return Err(UploadError::Begun);
        }
        let mission = Mission::try_new(*upload.config()).map_err(UploadError::Mission)?;
        self.latest = upload.id();
        self.upload = Some(*upload);
        Ok(mission)
    }

    pub(crate) fn sites(&self) -> Option<Sites> {
        self.upload.and_then(|upload| upload.sites())
    }

    /// Returns the stored mission if it is an upload.
    pub(crate) const fn upload(&self) -> Option<&Upload> {
        self.upload.as_ref()
    }

    /// Returns the upload to offer to a neighbour that `holds` an older or unknown mission.
    pub(crate) fn offer_to(&self, holds: Option<MissionId>) -> Option<Upload> {
        let older = holds.is_none_or(|holds| holds < self.latest);
        self.upload.filter(|_| older)
    }
}

/// Checks that `upload` is for this relay. Relays in a field accept none, even if the digest of the base matches.
#[cfg(feature = "upload")]
fn fits(member: &Member, upload: &Upload) -> Result<(), UploadError> {
    let config = upload.config();
    if upload.base() != member.digest
        || config.relays != member.all
        || member.mission.field().is_some()
    {
        return Err(UploadError::Base);
    }
    let is_other = config.distance_m.to_bits() != member.loaded_m.to_bits();
    member
        .encloses(config, upload.sites().is_some())
        .map_err(UploadError::Line)?;
    match upload.sites() {
        // Relays without a line on earth check it too, so that either all relays store the mission or none.
        Some(sites) => check_line(sites, config.distance_m).map_err(UploadError::Line),
        None if member.settings.sited && is_other => Err(UploadError::Line(LineError::Distance)),
        None => Ok(()),
    }
}
