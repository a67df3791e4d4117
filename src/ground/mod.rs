//! Ground station at the transmitter or the receiver: uploads missions and reports interference.
//!
//! | progress | state of the polled relay | action |
//! | --- | --- | --- |
//! | `Offering` | has an older mission, or has not answered | send a hello every second, and the mission in reply to the relay's hello; after three unanswered hellos poll the next of the four nearest relays |
//! | `Stored` | has stored the new mission, flies another | poll every second |
//! | `Adopted` | flies the new mission; it is not known if all relays of its view do | poll every second |
//! | `Flown` | all relays of its view fly the mission; relays outside a view take no part until they do | done |
//! | `Refused` | refuses the mission, or knows of a relay that does | done: another upload with a larger version is needed |
//! | `Outdated` | has a newer mission, or, before any relay has the upload, another mission with the upload's version | done: the upload needs a larger version |

use crate::features::TELEMETRY;
use crate::mission::Mission;
use crate::sensing::sums::is_level;
use crate::serial_number::next_nonzero;
use crate::settings::Wiring;
use crate::side::Side;
use crate::stats::{Stats, bump};
use crate::time::{Duration, Instant, MonotonicClock};
use crate::view::ViewId;
use crate::wire::auth::Auth;
use crate::wire::deframe::Deframer;
use crate::wire::digest::{MissionId, digest};
use crate::wire::endpoint::{Endpoint, Sent};
use crate::wire::frame::{FrameBuf, MAX_FRAME};
use crate::wire::message::{Detail, Entry, Hello, Message, Reports};
use crate::wire::session::Checked;
use crate::wire::upload::{Upload, UploadError};
use crate::wire::{CANDIDATES, STATION_REACH};

/// Time from a relay's last frame until a different node with the same number is accepted. Relays use
/// `Settings::dead_after` instead.
const GONE_AFTER: Duration = Duration::from_millis(15_000);

/// Time after which a hello (status request) to the polled relay is repeated if there was no answer.
const REPEAT_AFTER: Duration = Duration::from_millis(1_000);

/// Maximum number of received reports that wait for [`Ground::poll_report`].
///
/// Without the feature `telemetry` it is 1, and no report is received.
const REPORTED: usize = if TELEMETRY { 64 } else { 1 };

/// Interval in which every relay in radio reach is sent one request for the reports of all relays.
const WATCH_EVERY: Duration = Duration::from_millis(5_000);

/// Number of unanswered hellos (status requests) to one relay after which the next relay is polled.
const QUERIES_PER_RELAY: u8 = 3;

/// Ground station at the transmitter or the receiver: uploads missions and reports interference.
///
/// It does no input or output (sans-IO). After every input call [`poll_transmit`](Self::poll_transmit) until it returns
/// `None`, then wait for a byte or for [`poll_timeout`](Self::poll_timeout). The station accepts any bytes, and ignores
/// frames that are not addressed to it.
///
/// ```
/// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
/// use uav_relay::MAX_FRAME;
/// use uav_relay::{Auth, Ground, Instant, Interference, Interferer, Key, Mission, MissionConfig, Progress, Side, Upload, Wiring};
///
/// # fn example(loaded: &Mission, mut send: impl FnMut(&[u8]), received: &[u8]) -> Result<Progress, Box<dyn core::error::Error>> {
/// // The jammer has moved.
/// let jammer = Interferer { power_w: 80.0, x_m: 700.0, y_m: -300.0 };
/// let config = MissionConfig { interference: Interference::Source(jammer), ..*loaded.config() };
/// let upload = Upload::new(loaded, 1, config)?;
/// let auth = Auth { key: Key::new([7; 32]), epoch: 1 };
/// let mut ground = Ground::new(loaded, Side::Upstream, 7, Wiring::Pair, auth);
/// let now = Instant::ZERO;
/// ground.upload(now, upload)?;
///
/// // One turn of the main loop.
/// ground.handle_bytes(received);
/// ground.handle_timeout(now);
/// let mut frame = [0; MAX_FRAME];
/// while let Some(len) = ground.poll_transmit(&mut frame) {
///     send(&frame[..len]);
/// }
/// # Ok(ground.progress())
/// # }
/// # let mut sent = 0;
/// # assert_eq!(example(&paper::MISSION, |_| sent += 1, &[])?, Progress::Offering);
/// # assert_eq!(sent, 1, "a handshake, before anything else");
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Ground {
    base: u16,
    end: Side,
    node: u16,
    /// Number of relays that can receive the station: one over a wire, up to four over a shared channel.
    reach: u16,
    upload: Option<Upload>,
    progress: Progress,
    /// Number of the last query for the relays' mission. A relay repeats the number in its answer. 0 if no query was
    /// sent.
    query_number: u16,
    flown: Option<FlownMission>,
    /// Distance from the station to the polled relay, counted in relays: 1 is the nearest relay.
    distance: u16,
    unanswered: u8,
    /// Newest mission that the polled relay has stored, as reported in its last hello. `None` before its first hello.
    relay_mission: Option<MissionId>,
    /// True after the station has sent a hello (status request), until the polled relay sends a hello.
    query_sent: bool,
    /// Number in the polled relay's last hello. The station repeats this number when it offers the mission. `None` if
    /// no offer is due.
    offer_number: Option<u16>,
    due: bool,
    repeat_at: Option<Instant>,
    /// Clock of the station's timers. This clock never runs backwards.
    clock: MonotonicClock,
    reports: PendingReports,
    watching: Watching,
    deframer: Deframer,
    endpoint: Endpoint,
    stats: Stats,
}

impl Ground {
    /// Creates a ground station for relays that have loaded the mission `base` before flight.
    ///
    /// `end` is the end of the chain at which the station stands: `Upstream` at Tx, `Downstream` at Rx. The epoch
    /// (start counter) in `auth` must be larger at every start.
    pub fn new(base: &Mission, end: Side, network: u16, wiring: Wiring, auth: Auth) -> Self {
        let all = base.relays();
        let watching = Watching::new(auth.parts().1, all, wiring);
        let node = match end {
            Side::Upstream => 0,
            Side::Downstream => all + 1,
        };
        let mut endpoint = Endpoint::new(network, node);
        endpoint.sign(auth, 0, GONE_AFTER);
        Self {
            base: digest(base),
            end,
            node,
            reach: watching.reach.min(CANDIDATES),
            upload: None,
            progress: Progress::Idle,
            query_number: 0,
            flown: None,
            distance: 1,
            unanswered: 0,
            relay_mission: None,
            query_sent: false,
            offer_number: None,
            due: false,
            repeat_at: None,
            clock: MonotonicClock::new(Instant::ZERO),
            reports: PendingReports::NONE,
            watching,
            deframer: Deframer::new(),
            endpoint,
            stats: Stats::default(),
        }
    }

    /// Queries the mission that the relays fly; [`Ground::flown`] returns the answer. The query ends an upload in
    /// progress.
    ///
    /// The polled relay also sends the uploaded mission that it has stored, if any. The station thus learns the changes
    /// made by earlier uploads.
    pub fn request_flown(&mut self, now: Instant) {
        self.cancel();
        self.flown = None;
        self.query_number = next_nonzero(self.query_number);
        self.start(now);
    }

    /// Returns the mission of the polled relay. `None` until the relay has answered [`Ground::request_flown`].
    pub const fn flown(&self) -> Option<&FlownMission> {
        self.flown.as_ref()
    }

    /// Starts to upload the mission `upload` to the relays. Replaces an upload in progress.
    ///
    /// # Errors
    /// Returns [`UploadError::Base`] if the upload is for relays that loaded a mission other than this station's.
    pub fn upload(&mut self, now: Instant, upload: Upload) -> Result<(), UploadError> {
        if upload.base() != self.base {
            return Err(UploadError::Base);
        }
        self.upload = Some(upload);
        self.progress = Progress::Offering;
        self.start(now);
        Ok(())
    }

    /// Ends an upload or a query in progress. The station offers no mission to the relays after that.
    ///
    /// A relay that has already stored the mission still offers this mission to its neighbours.
    pub fn cancel(&mut self) {
        self.upload = None;
        self.progress = Progress::Idle;
        self.offer_number = None;
        self.due = false;
        self.repeat_at = None;
    }

    /// Schedules the first hello of an upload or a query, to the polled relay.
    fn start(&mut self, now: Instant) {
        self.relay_mission = None;
        self.offer_number = None;
        self.unanswered = 0;
        self.due = true;
        self.repeat_at = Some(self.clock.advance(now) + REPEAT_AFTER);
    }

    /// Sends the interference measured at this station to the relays in reach.
    ///
    /// `power_w` is the mean received power, with the receiver's noise but without the signals of transmitter and
    /// relays. Average for so long that its relative error is that of [`Listen`](crate::Listen). One measurement per
    /// [`Listen::every`](crate::Listen::every) is enough. Returns false, and does nothing, if `power_w` is outside
    /// 1e-30 to 1e6 W.
    ///
    /// Over a wire one frame of 23 bytes and a tag is sent, on a shared channel one such frame to each of the four
    /// nearest relays. A relay that is absent or has restarted is sent a handshake instead. Reports are not
    /// acknowledged: the next report replaces a lost report.
    pub fn measured(&mut self, power_w: f32) -> bool {
        if !is_level(power_w) {
            return false;
        }
        if self.reports.record(power_w, self.reach) {
            for distance in 1..=self.reach {
                self.endpoint.greet(self.at(distance));
            }
        }
        true
    }

    /// Returns the progress of the mission upload.
    pub const fn progress(&self) -> Progress {
        self.progress
    }

    /// Returns the number of intact frames that the station rejected. The reasons are a sender out of radio reach, a
    /// sender with a different mission, and a frame that is unsigned, forged, replayed or malformed.
    pub fn refused(&self) -> u32 {
        let stats = &self.stats;
        let unknown = stats.unsigned.saturating_add(stats.misaddressed);
        let untrue = stats.forged.saturating_add(stats.replayed);
        let other = stats.mission.saturating_add(stats.malformed);
        unknown.saturating_add(untrue).saturating_add(other)
    }

    /// Returns the counters of sent and received frames.
    ///
    /// The counter `mission` is for frames of relays that loaded a different mission before flight, `foreign` for
    /// frames of other networks, and `overheard` for frames addressed to other nodes.
    pub const fn stats(&self) -> &Stats {
        &self.stats
    }

    /// Returns the node numbers of the relays in direct reach, nearest first. The second value is true if the relay has
    /// proven that it has the key.
    ///
    /// After a new handshake with a relay, the value for this relay is false until the relay answers. Work: four relays
    /// at most.
    pub fn relays_in_reach(&self) -> impl Iterator<Item = (u16, bool)> {
        let nodes = (1..=self.reach).map(|distance| self.at(distance));
        nodes.map(|node| (node, self.endpoint.knows(node)))
    }

    /// Processes received bytes, in pieces of any length. Work: at most one check of an authentication tag per 19
    /// bytes.
    pub fn handle_bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if let Some(decoded) = self.deframer.push(byte)
                && let Some(frame) = self.endpoint.open(decoded, &mut self.stats)
            {
                let header = frame.header;
                let distance = header.sender.abs_diff(self.node);
                self.watching.overheard |= bit(distance);
                self.watching.seen |= bit(distance);
                if header.destination != self.node {
                    bump(&mut self.stats.overheard);
                } else if (1..=self.watching.reach).contains(&distance) {
                    let now = self.clock.now();
                    match self.endpoint.check(now, &frame, &mut self.stats) {
                        Some(Checked::Fresh { .. }) => {
                            self.watching.heard |= bit(distance);
                            let message = Message::decode(frame.body);
                            self.handle_message(header.sender, distance, message.as_ref().ok());
                        }
                        Some(Checked::Handshake { first: true }) => {
                            self.due |= self.is_under_way() || self.is_querying();
                            self.reports.schedule(distance);
                            self.watching.answer(distance);
                        }
                        _ => {}
                    }
                } else {
                    bump(&mut self.stats.misaddressed);
                }
            }
        }
    }

    /// Handles a message of relay `sender`, which is `distance` relays away. `message` is `None` if the frame's body is
    /// malformed.
    fn handle_message(&mut self, sender: u16, distance: u16, message: Option<&Message>) {
        let counter = match message {
            Some(Message::Hello(hello)) if hello.mission == self.base => {
                self.on_hello(sender, distance, *hello);
                &mut self.stats.received
            }
            Some(Message::Hello(_)) => &mut self.stats.mission,
            Some(Message::Offer {
                upload,
                offer_number,
            }) if self.answers_query(upload, *offer_number) => {
                self.on_upload(sender, *upload);
                &mut self.stats.received
            }
            Some(Message::Report(report)) if TELEMETRY => {
                if report.mission() != self.base {
                    &mut self.stats.mission
                } else if self.watching.record(report) {
                    &mut self.stats.received
                } else {
                    &mut self.stats.malformed
                }
            }
            _ => &mut self.stats.malformed,
        };
        bump(counter);
    }

    /// Returns true while the query for the relays' mission is unanswered.
    const fn is_querying(&self) -> bool {
        self.upload.is_none() && self.repeat_at.is_some()
    }

    /// Returns true if `upload`, received in a relay's offer, answers the station's query for the mission.
    ///
    /// `answer` is the number repeated in the offer. It must be the number of the query.
    fn answers_query(&self, upload: &Upload, answer: u16) -> bool {
        self.is_querying() && answer == self.query_number && upload.base() == self.base
    }

    /// Records the uploaded mission that relay `by` has sent as the answer to the query.
    fn on_upload(&mut self, by: u16, upload: Upload) {
        let flies = matches!(&self.flown, Some(flown) if flown.by == by && flown.flies && flown.version == upload.version());
        self.flown = Some(FlownMission {
            by,
            version: upload.version(),
            flies,
            upload: Some(upload),
        });
        self.due = false;
        self.repeat_at = None;
    }

    /// Handles a hello of relay `by`, `distance` relays away, that answers the query for the mission. If the relay has
    /// stored an uploaded mission, it sends this mission in a following message.
    fn on_query_reply(&mut self, by: u16, distance: u16, hello: Hello) {
        self.unanswered = 0;
        self.distance = distance;
        // The refused mission is possibly not the one that the relay has stored. The upload that follows shows the
        // stored one.
        if hello.refused && self.flown.is_some() {
            return;
        }
        let flown = FlownMission {
            by,
            version: hello.latest_mission.version,
            flies: hello.active,
            upload: None,
        };
        if flown.is_known() {
            self.due = false;
            self.repeat_at = None;
        }
        self.flown = Some(flown);
    }

    /// Handles a hello of relay `by`, `distance` relays away. The hello reports the relay's newest mission.
    fn on_hello(&mut self, by: u16, distance: u16, hello: Hello) {
        if self.is_querying() {
            return self.on_query_reply(by, distance, hello);
        }
        let Some(upload) = &self.upload else { return };
        let mission_id = upload.id();
        self.unanswered = 0;
        self.distance = distance;
        // A relay does not store a refused mission, and this upload may not be the refused one.
        let is_refused = hello.refused && hello.latest_mission == mission_id;
        let holds = if hello.refused && !is_refused {
            MissionId {
                version: 0,
                digest: self.base,
            }
        } else {
            hello.latest_mission
        };
        self.relay_mission = Some(holds);
        let progress = if is_refused {
            Progress::Refused { by }
        } else if holds > mission_id {
            Progress::Outdated {
                version: hello.latest_mission.version,
            }
        } else if holds < mission_id
            && holds.version == mission_id.version
            && matches!(self.progress, Progress::Offering)
        {
            // A different station has uploaded a mission with the same version. This upload has reached no relay, and
            // is based on an older mission.
            Progress::Outdated {
                version: holds.version,
            }
        } else if holds < mission_id {
            // A relay also answers an offer with a hello. Only a hello that answers a query causes an offer. Otherwise
            // the exchange would not end.
            if core::mem::take(&mut self.query_sent) {
                self.offer_number = Some(hello.offer_number);
                self.due = true;
            }
            Progress::Offering
        } else if hello.active && hello.active_in_view {
            Progress::Flown {
                by,
                view: hello.latest_view,
                relays: hello.behind,
            }
        } else if hello.active {
            Progress::Adopted { by }
        } else {
            Progress::Stored { by }
        };
        // A final state does not change, even if some relay is not up to date.
        if self.is_under_way() || !is_under_way(progress) {
            self.progress = progress;
        }
        if !self.is_under_way() {
            self.due = false;
            self.repeat_at = None;
        }
    }

    const fn is_under_way(&self) -> bool {
        is_under_way(self.progress)
    }

    /// Schedules the next hello if it is due. Takes constant time.
    ///
    /// The hello goes to the polled relay. If that relay has left three hellos unanswered, it goes to the next relay,
    /// which is then the polled one.
    pub fn handle_timeout(&mut self, now: Instant) {
        let now = self.clock.advance(now);
        if TELEMETRY {
            let is_silent = self.watching.request(now, self.node.into());
            let to = self.at(self.watching.distance);
            if let Some(session) = self.endpoint.session_mut().filter(|_| is_silent) {
                // The relay may have restarted. Then it accepts only handshakes.
                session.request_reply_of_silent(to);
            }
        }
        if self.repeat_at.is_none_or(|again| again > now) {
            return;
        }
        self.unanswered = self.unanswered.saturating_add(1);
        if self.unanswered >= QUERIES_PER_RELAY {
            self.unanswered = 0;
            self.relay_mission = None;
            self.offer_number = None;
            self.distance = if self.distance < self.reach {
                self.distance + 1
            } else {
                1
            };
            // The relay may have restarted, and may not know this node.
            self.endpoint.greet(self.to());
        }
        self.due = true;
        self.repeat_at = Some(now + REPEAT_AFTER);
    }

    fn to(&self) -> u16 {
        self.at(self.distance)
    }

    /// Returns the node number of the relay `distance` relays away; 1 is the nearest.
    fn at(&self, distance: u16) -> u16 {
        match self.end {
            Side::Upstream => distance,
            Side::Downstream => self.node.saturating_sub(distance),
        }
    }

    /// Returns the time by which [`Ground::handle_timeout`] must be called; `None` if no timer runs.
    pub fn poll_timeout(&self) -> Option<Instant> {
        let next = [self.repeat_at, self.watching.repeat_at]
            .into_iter()
            .flatten()
            .min();
        Some(self.clock.external(next?))
    }

    /// Writes the next frame into `frame` and returns its length, bytes. `None` if there is none. Work: one frame is
    /// encoded, and one authentication tag computed.
    pub fn poll_transmit(&mut self, frame: &mut [u8; MAX_FRAME]) -> Option<usize> {
        if self.endpoint.is_exhausted() {
            return None;
        }
        Some(self.next(frame)?.len)
    }

    fn next(&mut self, frame: &mut FrameBuf) -> Option<Sent> {
        let handshake = self.endpoint.transmit_handshake(frame, &mut self.stats);
        if handshake.is_some() {
            return handshake;
        }
        if !core::mem::take(&mut self.due) {
            return self.next_report(frame).or_else(|| self.next_watch(frame));
        }
        let to = self.to();
        let loaded = MissionId {
            version: 0,
            digest: self.base,
        };
        let id = self.upload.map_or(loaded, |upload| upload.id());
        let older = self.relay_mission.is_some_and(|holds| holds < id);
        let offer_number = self
            .offer_number
            .filter(|_| older && self.endpoint.knows(to));
        let message = if let (Some(upload), Some(offer_number)) = (self.upload, offer_number) {
            self.offer_number = None;
            Message::Offer {
                upload,
                offer_number,
            }
        } else {
            let is_query = self.upload.is_none();
            self.query_sent = true;
            Message::Hello(Hello {
                mission: self.base,
                latest_view: ViewId::LOADED,
                hears: 0,
                behind: 1,
                neighbour: 0,
                requests_reply: true,
                requests_view: false,
                fresh: false,
                ready: true,
                latest_mission: id,
                active: false,
                active_in_view: false,
                refused: false,
                outside: false,
                offer_number: if is_query { self.query_number } else { 0 },
            })
        };
        self.endpoint.transmit(to, &message, frame, &mut self.stats)
    }

    /// Writes the interference report for the next relay that needs it; `None` if no report is pending. If the relay
    /// cannot verify frames of this station yet, a handshake is written instead of the report.
    fn next_report(&mut self, frame: &mut FrameBuf) -> Option<Sent> {
        let (distance, power_w) = self.reports.poll(self.reach)?;
        let message = Message::Level {
            mission: self.base,
            power_w,
        };
        let to = self.at(distance);
        self.endpoint.transmit(to, &message, frame, &mut self.stats)
    }

    /// Writes a request for the reports of all relays, to the next relay in reach. `None` if none is pending.
    fn next_watch(&mut self, frame: &mut FrameBuf) -> Option<Sent> {
        if !core::mem::take(&mut self.watching.is_due) {
            return None;
        }
        let (number, mission) = (self.watching.number, self.base);
        let message = Message::Watch { number, mission };
        let to = self.at(self.watching.distance);
        self.endpoint.transmit(to, &message, frame, &mut self.stats)
    }
}

#[cfg(feature = "telemetry")]
impl Ground {
    /// Starts (`is_on` is true) or ends the requests for the reports of all relays.
    ///
    /// The station repeats the request every 5 s. Relays report for 60 s after the last request.
    pub fn watch(&mut self, now: Instant, is_on: bool) {
        let now = self.clock.advance(now);
        self.watching.repeat_at = is_on.then_some(now);
        _ = self.watching.request(now, self.node.into());
    }

    /// Returns the numbers of the relays of which frames have arrived since the last call, nearest first.
    ///
    /// Frames to any node count, but only those of the eight nearest relays. Frames to other nodes are not verified:
    /// anyone can send them. Work: eight relays at most.
    pub fn poll_overheard(&mut self) -> impl Iterator<Item = u16> {
        let seen = core::mem::take(&mut self.watching.seen);
        let near = 1..=STATION_REACH.min(self.watching.all);
        let distances = near.filter(move |it| seen & bit(*it) != 0);
        distances.map(|distance| self.at(distance))
    }

    /// Returns the next received report of a relay; `None` if there is none. `now` counts as its arrival.
    ///
    /// Call it after [`handle_bytes`](Self::handle_bytes) until it returns `None`: of more than 64 waiting reports the
    /// newest are dropped. Keep the newest report of each relay by [`Report::update`](crate::Report::update).
    pub fn poll_report(&mut self, now: Instant) -> Option<crate::Report> {
        let mut arrived = core::iter::from_fn(|| self.watching.arrived.pop_front());
        arrived
            .find_map(|(entry, detail)| Some(crate::Report::of(&entry, detail, entry.time(now)?)))
    }
}

/// Requests for the reports of all relays, and the received reports.
#[derive(Clone, Debug)]
struct Watching {
    /// Number of relays in the mission.
    all: u16,
    /// Number of nearest relays to send requests to: one over a wire, up to eight over a shared channel.
    reach: u16,
    /// Bit mask of relays. A relay's bit is set if it has sent a frame to any node since the last request to it.
    overheard: u8,
    /// Bit mask of relays. A relay's bit is set if it has sent a frame since the last call of [`Ground::poll_overheard`].
    seen: u8,
    /// Time of the next request; `None` while no reports are requested.
    repeat_at: Option<Instant>,
    number: u16,
    /// Distance of the relay to which the newest request goes, in relays; 0 before the first request. `is_due` is true
    /// until the request is sent.
    distance: u16,
    is_due: bool,
    /// Bit mask of relays. A relay's bit is set if it has sent a message to this station since the last request to it.
    heard: u8,
    /// True after the first report.
    has_report: bool,
    arrived: heapless::Deque<(Entry, Option<Detail>), REPORTED>,
}

impl Watching {
    /// Creates the initial state: the station requests no reports.
    ///
    /// The request numbers begin at 1024 times `epoch` (start counter of the station), so that they rise from start to
    /// start. If the station ran for more than 85 minutes, the numbers after its next start can be smaller. Relays then
    /// ignore requests until 60 s after the last request before that start.
    #[expect(clippy::cast_possible_truncation, reason = "six bits are enough")]
    fn new(epoch: u32, all: u16, wiring: Wiring) -> Self {
        let most = match wiring {
            Wiring::Pair => 1,
            Wiring::Shared => STATION_REACH,
        };
        Self {
            all,
            reach: most.min(all),
            overheard: 0,
            seen: 0,
            repeat_at: None,
            number: (epoch as u16) << 10,
            distance: 0,
            is_due: false,
            heard: 0,
            has_report: false,
            arrived: heapless::Deque::new(),
        }
    }

    /// Schedules a request for reports, if due, to the next relay, from the farthest to the nearest. A relay at a
    /// distance above 4 is left out until a first report has been received, and while it has sent no frame since the
    /// last request to it.
    ///
    /// Returns true if the scheduled relay has sent no message to this station since the last request to it.
    fn request(&mut self, now: Instant, node: u64) -> bool {
        if self.repeat_at.is_none_or(|at| at > now) {
            return false;
        }
        // The first agreement needs the channel.
        let overheard = if self.has_report { self.overheard } else { 0 };
        let is_near = move |it: &u16| *it <= CANDIDATES || overheard & bit(*it) != 0;
        // Two stations do not request at the same time again and again.
        let cycle = WATCH_EVERY.as_micros() + 100_000 * (node % 7);
        let asked = (1..=self.reach).filter(is_near).map(|_| 1).sum::<u64>();
        self.repeat_at = Some(now + Duration::from_micros(cycle / asked.max(1)));
        let mut next = (1..self.distance).rev().find(is_near);
        if next.is_none() {
            self.number = self.number.wrapping_add(1);
            next = (1..=self.reach).rev().find(is_near);
        }
        self.distance = next.unwrap_or(1);
        self.is_due = true;
        let bit = bit(self.distance);
        let is_silent = self.heard & bit == 0;
        self.heard &= !bit;
        self.overheard &= !bit;
        is_silent
    }

    /// Schedules another request to the relay at `distance`, for reports. The relay could not verify an earlier
    /// request.
    const fn answer(&mut self, distance: u16) {
        if self.repeat_at.is_some() && !self.is_due {
            self.distance = distance;
            self.is_due = true;
        }
    }

    /// Records the entries of a report. Returns false, and records none, if an entry has a node number outside the
    /// mission.
    fn record(&mut self, report: &Reports) -> bool {
        let (mut detail, entries) = report.states();
        if entries.iter().any(|entry| entry.relay() > self.all) {
            return false;
        }
        for entry in entries {
            self.has_report = true;
            _ = self.arrived.push_back((*entry, detail.take()));
        }
        true
    }
}

const fn is_under_way(progress: Progress) -> bool {
    matches!(
        progress,
        Progress::Offering | Progress::Stored { .. } | Progress::Adopted { .. }
    )
}

/// Newest mission that a relay has stored, as reported by this relay.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FlownMission {
    /// Node number of the relay that answered the query.
    pub by: u16,
    /// Version of the mission; 0 for the mission that was loaded before flight.
    pub version: u16,
    /// True if the relay flies the mission now, false if it has stored the mission without flying it.
    pub flies: bool,
    /// Uploaded mission with all its parameters. `None` for the mission loaded before flight, and until the relay has
    /// sent the uploaded mission. A relay with older firmware never sends it.
    pub upload: Option<Upload>,
}

impl FlownMission {
    /// Returns true once all parameters of the mission are known. Either the relay has sent them, or it has only the
    /// mission loaded before flight, which the station knows.
    pub const fn is_known(&self) -> bool {
        self.version == 0 || self.upload.is_some()
    }
}

/// Progress of a mission upload from the ground station to the relays.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// No mission upload is in progress.
    #[default]
    Idle,
    /// The mission is being offered. No relay has reported yet that it has stored the mission.
    Offering,
    /// A relay has stored the mission. The station polls until the relays fly it.
    Stored {
        /// Node number of the relay that has stored the mission.
        by: u16,
    },
    /// A relay flies the mission. The station does not know yet if all relays do.
    Adopted {
        /// Node number of the relay that flies the mission.
        by: u16,
    },
    /// Complete: all relays of a view (list of the chain's members) fly the mission. Relays outside this view take no
    /// part in the chain before they fly the mission.
    Flown {
        /// Node number of the relay that reports that all relays of its view fly the mission.
        by: u16,
        /// Latest view known to the reporting relay.
        view: ViewId,
        /// Number of relays that fly the mission. Counted are relay `by`, and those relays of its view that are farther
        /// from the station.
        relays: u16,
    },
    /// A relay refuses the mission, so the chain does not fly it. The mission contradicts the Tx and Rx positions, or
    /// the geofence or settings of the relay that refuses it.
    Refused {
        /// Node number of the relay that reports the refusal. The mission is refused by this relay, or by a relay
        /// farther from the station.
        by: u16,
    },
    /// A relay has stored a newer mission than the upload, or a different mission with the same version.
    Outdated {
        /// Version of the mission that the relay has stored.
        version: u16,
    },
}

/// Number of interference reports after which the station repeats its handshake. Without a new handshake, a restarted
/// relay could not verify the reports.
const REPORTS_PER_HANDSHAKE: u8 = 16;

/// Last interference power measured at the station, and the relays to which it must be reported.
#[derive(Clone, Copy, Debug)]
pub(super) struct PendingReports {
    /// Last measured interference power, W; 0 before the first measurement.
    power_w: f32,
    /// Bit mask of the relays to which the power must be reported. Bit d - 1 stands for the relay at distance d.
    pending: u8,
    measurements: u8,
}

impl PendingReports {
    /// State before the first measurement: no report is pending.
    pub(super) const NONE: Self = Self {
        power_w: 0.0,
        pending: 0,
        measurements: 0,
    };

    /// Records the measured interference `power_w`, W, to be reported to the `reach` nearest relays. Returns true if a
    /// handshake must be sent to these relays first.
    pub(super) fn record(&mut self, power_w: f32, reach: u16) -> bool {
        self.power_w = power_w;
        self.pending = (1..=reach).fold(0, |all, distance| all | bit(distance));
        self.measurements = (self.measurements + 1) % REPORTS_PER_HANDSHAKE;
        self.measurements == 0
    }

    /// Schedules the last report again, for the relay at `distance`. That relay has possibly restarted and lost the
    /// report.
    pub(super) fn schedule(&mut self, distance: u16) {
        if self.power_w > 0.0 {
            self.pending |= bit(distance);
        }
    }

    /// Returns the next relay to which the interference must be reported, and the interference power, W.
    ///
    /// The relay is given by its distance in relays, 1 for the nearest. Relays farther than `reach` are left out.
    /// `None` if no report is pending.
    pub(super) fn poll(&mut self, reach: u16) -> Option<(u16, f32)> {
        let distance = (1..=reach).find(|distance| self.pending & bit(*distance) != 0)?;
        self.pending &= !bit(distance);
        Some((distance, self.power_w))
    }
}

/// Returns the bit of the relay at `distance`, 1 to 8, in a bit mask; 0 for other distances.
const fn bit(distance: u16) -> u8 {
    match distance {
        1..=8 => 1 << (distance - 1),
        _ => 0,
    }
}
