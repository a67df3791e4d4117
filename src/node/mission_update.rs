//! A newer mission, in flight: who holds it, who is offered it, and when it is flown.
//!
//! Any relay next to the ground takes an offer. Neighbours tell each other in every hello which mission they hold; whoever holds
//! a newer one offers it, and whoever holds a newer one than it flies asks for a view. A proposal names the one mission that the
//! view is to fly, and only a relay that holds just that one hands it on. So a view that is granted is of relays that hold it
//! all, durably or not: one that misses the decision, or forgets what it held, can take part in nothing before it flies it, too.
//!
//! An offer answers a hello: it bears the number of one that the receiver said lately. The number is another one after `dead_after`, and
//! the one before it is good until then as well, neither for longer than twice `dead_after` after it was last said. So an offer that was
//! recorded or withheld is worth nothing later, though its tag is right.
//!
//! Whoever has an offer to make, and no hello of late that it could answer, says a hello that asks for one. Until the neighbour says that it
//! holds the mission it is offered it again, first after four hops' time, and less and less often: sixteen times.
//!
//! | between neighbours | what follows |
//! | --- | --- |
//! | a hello of a node that holds an older mission | it is offered the newer one |
//! | a hello of a node that holds a newer mission | a hello, so that it is offered here |
//! | an offer of a newer mission | held from now on: `Event::Uploaded`; a hello; an offer to the neighbour on the other side; a request for a view |
//! | an offer of one that is not newer | a hello |
//! | an offer of one for which there is no line on earth, or that leaves the relay's own geofence | it is counted; `Event::UploadRefused`, once; from now on hellos name that mission, as refused; a hello |
//! | a hello that names the mission held, as refused | hellos say so, too, until it is flown or a newer one is held; once a hello to the neighbour on the other side |
//! | an offer that answers no hello of late | it is counted as stale; a hello, which the next one can answer |
//! | a proposal is due, and the node after holds an older mission or has not said which | it is offered the newer one first |
//! | an offer is owed, and the neighbour has said no hello of late | a hello that asks, and the offer answers what comes back |
//! | a proposal that does not name the mission held | a hello, and no part in it |
//! | a decision on a view that was granted | its mission is flown: `Event::Adopted` |

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

/// Whether this crate was built to take a newer mission in flight.
const UPLOAD: bool = cfg!(feature = "upload");

/// A number that hellos bear, for the offers that answer them; 0 for none.
#[cfg(feature = "upload")]
#[derive(Clone, Copy, Debug)]
struct Asked {
    number: u16,
    first: Instant,
    last: Instant,
}

#[cfg(feature = "upload")]
impl Asked {
    /// Whether an offer of that number answers one of the last twice `dead_after`.
    fn is(&self, number: u16, now: Instant, settings: &Settings) -> bool {
        number != 0
            && number == self.number
            && now.since(self.last).as_micros() <= settings.dead_after.times(2).as_micros()
    }
}

/// Offers to the neighbour on one side.
#[cfg(feature = "upload")]
#[derive(Clone, Copy, Debug)]
struct Offering {
    /// When it said a hello last, which an offer answers.
    heard: Option<Instant>,
    /// When it is to be offered the mission again, and how often it has been.
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

/// What became of a mission that was offered.
#[cfg(feature = "upload")]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Offered {
    /// It is held from now on.
    Held,
    /// It would be, but there is no line on earth for it; and whether that is new.
    Refused { why: LineError, is_new: bool },
    /// It is not newer, or for other relays.
    Passed,
}

/// Hop times until an offer is made again, and how often it is until they are twice as many; so often in all.
#[cfg(feature = "upload")]
const OFFER_HOPS: u32 = 4;
#[cfg(feature = "upload")]
const OFFERS_AT_A_PACE: u8 = 4;
#[cfg(feature = "upload")]
const OFFERS: u8 = 16;

/// What one relay holds.
#[derive(Clone, Debug)]
pub(crate) struct MissionUpdate {
    /// The newest mission that it holds.
    latest: MissionId,
    /// The same, if it was uploaded.
    #[cfg(feature = "upload")]
    upload: Option<Upload>,
    /// What was refused last, here or by a relay beyond a neighbour.
    #[cfg(feature = "upload")]
    refused: Option<MissionId>,
    /// The number that hellos bear now, and the one before.
    #[cfg(feature = "upload")]
    asked: [Asked; 2],
    /// Toward Tx and toward Rx.
    #[cfg(feature = "upload")]
    offering: [Offering; 2],
    #[cfg(feature = "upload")]
    jitter: Jitter,
}

/// Whether newer missions are taken in flight: only where frames are signed.
pub(crate) const fn takes_uploads(member: &Member) -> bool {
    UPLOAD && member.settings.auth.is_some()
}

impl MissionUpdate {
    /// A relay that holds the mission that it was loaded with.
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

    /// The mission of that number, if it is the one flown or the one held.
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
    /// The number of a hello that is said now.
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

    /// Whether an offer of that number answers a hello of late.
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

    /// The neighbour at `side` has said a hello, which an offer may answer.
    pub(crate) const fn may_answer(&mut self, side: Side, now: Instant) {
        self.offering(side).heard = Some(now);
    }

    /// Whether it has of late: the number is good for `dead_after` after it was said, and more.
    pub(crate) fn has_asked(&mut self, side: Side, now: Instant, settings: &Settings) -> bool {
        let heard = self.offering(side).heard;
        heard.is_some_and(|heard| now.since(heard).times(2) <= settings.dead_after)
    }

    /// There is something new to offer the neighbour at `side`, or another neighbour.
    pub(crate) const fn begin_offers(&mut self, side: Side) {
        self.offering(side).tries = 0;
    }

    /// It is offered the mission now, or asked for a hello first.
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

    /// The neighbour at `side` has nothing to be offered any more.
    pub(crate) const fn stop_offers(&mut self, side: Side) {
        self.offering(side).at = None;
    }

    /// Whether the neighbour at `side` is to be offered the mission again now.
    pub(crate) fn offers_again(&mut self, side: Side, now: Instant) -> bool {
        let offering = self.offering(side);
        let due = offering.at.is_some_and(|at| at <= now);
        if due {
            offering.at = None;
        }
        due
    }

    /// When it is.
    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        let [upstream, downstream] = self.offering;
        earliest(upstream.at, downstream.at)
    }

    /// The mission that was refused, if it is one of those that a relay flying `active` could fly next: the one held, or a newer one.
    pub(crate) fn refused_of(&self, active: MissionId) -> Option<MissionId> {
        self.refused
            .filter(|refused| *refused >= self.latest && *refused != active)
    }

    /// A neighbour says that the mission of that number is refused; returns true where it is the one held, and this is new.
    pub(crate) fn hear_refused(&mut self, refused: MissionId) -> bool {
        refused == self.latest && self.refused.replace(refused) != Some(refused)
    }

    /// Holds `upload` from now on, if it is for this relay and newer than what it holds.
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

    /// The same by the relay's own firmware.
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

    /// A relay that has just been switched on, `untouched` or not, flies `upload`, which it held before: the mission of it.
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

    /// The sites of the mission held, if it has its own.
    pub(crate) fn sites(&self) -> Option<Sites> {
        self.upload.and_then(|upload| upload.sites())
    }

    /// The newest mission held, if it was uploaded.
    pub(crate) const fn upload(&self) -> Option<&Upload> {
        self.upload.as_ref()
    }

    /// What a neighbour that `holds` a mission has to be offered, if it is an older one or it has not said which.
    pub(crate) fn offer_to(&self, holds: Option<MissionId>) -> Option<Upload> {
        let older = holds.is_none_or(|holds| holds < self.latest);
        self.upload.filter(|_| older)
    }
}

/// Whether `upload` is for this relay. None is for relays in a field, even if its base has the digest of their mission.
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
        // Every relay checks that, whether it flies along a line on earth or not: all hold it, or none does.
        Some(sites) => check_line(sites, config.distance_m).map_err(UploadError::Line),
        None if member.settings.sited && is_other => Err(UploadError::Line(LineError::Distance)),
        None => Ok(()),
    }
}
