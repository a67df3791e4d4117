//! Facade of a relay: bytes and time in, frames and events out. Also the records that survive a reboot.

use super::{Port, Transmit};
use crate::event::Event;
use crate::features::DEPARTURES;
use crate::field::estimate::Estimate;
use crate::geodetic::Sites;
use crate::guard::HoldReason;
use crate::mission::{Interference, Mission, Profile};
use crate::node::Node;
use crate::node::round::state::Phase;
use crate::node::view::record::{RecordError, ViewRecord};
use crate::optimiser::joint::fitted::SlotShares;
use crate::place::Placement;
use crate::pointing::Bearing;
use crate::relay::endurance::Endurance;
use crate::relay::frames;
use crate::sample::Sample;
use crate::sensing::estimate::NumberedEstimate;
use crate::sensing::fit::Unfit;
use crate::settings::{Identity, Settings, SetupError, Wiring, check};
use crate::side::Side;
use crate::stats::Stats;
use crate::time::{Instant, MonotonicClock};
use crate::view::ViewId;
use crate::wire::deframe::Deframer;
use crate::wire::endpoint::Endpoint;
use crate::wire::frame::MAX_FRAME;

use crate::wire::upload::{Upload, UploadError};

/// Relay of the chain: the whole protocol, without input or output (sans-IO).
///
/// # Contract
/// - *Inputs*: [`handle_bytes`](Self::handle_bytes) and [`handle_timeout`](Self::handle_timeout) accept anything, never fail
///   and do a bounded amount of work; [`stats`](Self::stats) counts invalid input.
/// - *Time* is an argument; the relay never reads a clock. Use a monotonic clock. After a backward step, timers and the
///   lease continue as if no time had passed between the two calls; after a forward step they expire. While a part of
///   the chain is out of reach, the other relays wait until the leases of that part have expired. A forward step ends
///   this wait early. Until the leases have expired, two parts of the chain can then fly to positions of different
///   agreements.
/// - *Getters* take constant time and return values of the last agreement. Positions are in metres in the frame of
///   [`MissionConfig`](crate::MissionConfig).
/// - *Outputs* are built from the state on request, so no queue can overflow. After every input, store the record that
///   [`unpersisted`](Self::unpersisted) returns, call [`poll_transmit`](Self::poll_transmit) until it returns `None`,
///   then [`poll_event`](Self::poll_event) until it returns `None`, then sleep until
///   [`poll_timeout`](Self::poll_timeout) or the next byte.
/// - After that, `poll_timeout` is `None` or later than `now`: the loop cannot spin.
/// - *Setpoints* are finite. Their x is from 0 to the distance Tx-Rx, their altitude is the relay's altitude or in the
///   mission's band. They are at least the mission's separation from the neighbours' setpoints of the same agreement.
///   There is no setpoint before the first agreement. Only a new agreement or the relay's move in Algorithm 2 changes
///   the setpoint. After a new mission the setpoint stays until the chain has agreed in that mission, even outside of
///   the new limits. If Tx or Rx have moved, there is no setpoint until then.
///
/// ```
/// use uav_relay::{Band, Channel, Identity, Instant, Interference, Interferer, Mission, MissionConfig, Profile, Relay, Settings};
/// use uav_relay::channel::AirGround;
///
/// let mission = Mission::try_new(MissionConfig {
///     relays: 1,
///     distance_m: 1000.0,
///     min_separation_m: 4.0,
///     tx_power_w: 80.0,
///     common: Profile { altitude_m: 20.0, power_w: 1.0 },
///     channel: Channel::from_db(2e9, 0.1, 21.0, AirGround::Los)?,
///     band: Band::at(20.0),
///     lateral: Band::NONE,
///     interference: Interference::Source(Interferer { power_w: 80.0, x_m: 500.0, y_m: 400.0 }),
///     noise_w: 0.0,
///     reverse: 0.0,
///     rx_power_w: 80.0,
///     fitted_gap: 0.0,
///     tolerance: 1e-4,
/// })?;
/// let identity = Identity { network: 7, index: 1 };
/// let mut relay = Relay::new(mission, identity, Settings::default(), 1, Instant::ZERO)?;
/// while relay.setpoint().is_none() {
///     let now = relay.poll_timeout().expect("a leader has work to do");
///     relay.handle_timeout(now);
/// }
/// let place = relay.setpoint().unwrap();
/// assert!((relay.target().unwrap() / 1.49012151 - 1.0).abs() < 1e-4, "the best any single relay can do");
/// assert!((place.x_m - 349.8).abs() < 0.1, "metres from the transmitter");
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Relay {
    pub(super) node: Node,
    pub(super) endpoint: Endpoint,
    /// Decoders of received frames. Entry 0 is for the upstream port or the shared channel, entry 1 for the downstream
    /// port.
    deframers: [Deframer; 2],
    pub(super) clock: MonotonicClock,
    /// Endurance of the drone. Empty without the feature `departures`.
    pub(super) endurance: [Endurance; DEPARTURES as usize],
}

impl Relay {
    /// Creates a relay that starts at `now`.
    ///
    /// The leader starts the first search for positions without any input. It is relay 1, or relay N in a mission with
    /// an interference field.
    ///
    /// `seed` must differ between boards, even if their image and configuration are the same, and should differ between
    /// starts. Use a chip's unique number, a random number generator, or the noise of RAM after power-up. Two relays
    /// with the same index distinguish each other by their seeds, so that at most one of them has a setpoint. The seed
    /// also affects retransmission timing, message numbers and the messages that a guard considers old, but no
    /// position.
    ///
    /// # Errors
    /// Returns a [`SetupError`] that names the invalid part of `identity` or `settings`.
    pub fn new(
        mission: Mission,
        identity: Identity,
        settings: Settings,
        seed: u32,
        now: Instant,
    ) -> Result<Self, SetupError> {
        check(&mission, identity, &settings)?;
        let mut relay = Self::unbegun(&mission, identity, &settings, seed, now);
        relay.begin(identity, seed, now);
        Ok(relay)
    }

    /// Creates a relay as [`new`](Self::new) does, but directly in `slot`, without use of the stack.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Self::new); `slot` is then unchanged.
    pub fn new_in<'a>(
        slot: &'a mut Option<Self>,
        mission: &Mission,
        identity: Identity,
        settings: &Settings,
        seed: u32,
        now: Instant,
    ) -> Result<&'a mut Self, SetupError> {
        check(mission, identity, settings)?;
        let relay = slot.insert(Self::unbegun(mission, identity, settings, seed, now));
        relay.begin(identity, seed, now);
        Ok(relay)
    }

    fn unbegun(
        mission: &Mission,
        identity: Identity,
        settings: &Settings,
        seed: u32,
        now: Instant,
    ) -> Self {
        Self {
            node: Node::new(mission, identity, settings, seed, now),
            endpoint: Endpoint::new(identity.network, identity.index),
            deframers: [Deframer::new(), Deframer::new()],
            clock: MonotonicClock::new(now),
            endurance: [Endurance::default(); DEPARTURES as usize],
        }
    }

    const fn wiring(&self) -> Wiring {
        self.node.member().settings.wiring
    }

    #[inline(never)] // a session is built on the stack
    fn begin(&mut self, identity: Identity, seed: u32, now: Instant) {
        let settings = &self.node.member().settings;
        if let Some(auth) = settings.auth {
            let number = self.node.claim_number();
            self.endpoint.sign(auth, number, settings.dead_after);
        }
        self.node.begin(identity, seed, now);
    }

    /// Processes bytes received at `port`, in pieces of any length. Bytes at a port that does not exist with this
    /// `Settings::wiring` are dropped.
    ///
    /// Takes a dozen instructions per byte, and a CRC for at most one frame per 16 bytes. For at most one message per
    /// 19 bytes it computes positions for 16 target SIRs, and checks a tag if frames are signed. Longer computations
    /// are left to [`handle_timeout`](Self::handle_timeout).
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Instant, Port, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// // Bytes from a UART, split anywhere. Noise is counted and has no other effect.
    /// relay.handle_bytes(Instant::from_millis(5), Port::Upstream, &[0x11, 0x22, 0x33, 0]);
    /// assert_eq!(relay.stats().truncated, 1);
    /// ```
    pub fn handle_bytes(&mut self, now: Instant, port: Port, bytes: &[u8]) {
        let shared = self.wiring() == Wiring::Shared;
        if shared != (port == Port::Shared) {
            return;
        }
        let now = self.clock.advance(now);
        let [first, second] = &mut self.deframers;
        let deframer = if port == Port::Downstream {
            second
        } else {
            first
        };
        let mut rest = bytes;
        while let Some((&byte, after)) = deframer.push_run(rest).split_first() {
            rest = after;
            if let Some(decoded) = deframer.push(byte)
                && let Some(frame) = self.endpoint.open(decoded, self.node.stats_mut())
            {
                frames::receive(&mut self.node, &mut self.endpoint, now, port, &frame);
            }
        }
    }

    /// Handles timers that have expired by `now`, and does one step of a long computation.
    ///
    /// The step is bounded. The leader's prediction computes at most 12 hops, each for 16 target SIRs. The joint method
    /// computes the hops of at most 40 relays. Algorithm 2 tries at most 624 positions of this relay. Without a
    /// computation the call takes almost no time.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::Settings;
    ///
    /// let mut relay = relay(Settings::default());
    /// // Relay 1 starts by itself: call it for each portion of work until it has its position.
    /// while let (None, Some(due)) = (relay.setpoint(), relay.poll_timeout()) {
    ///     relay.handle_timeout(due);
    /// }
    /// assert!(relay.setpoint().is_some());
    /// ```
    #[inline(never)] // as `poll_transmit`
    pub fn handle_timeout(&mut self, now: Instant) {
        let now = self.clock.advance(now);
        self.node.handle_timeout(now);
        self.review_endurance(now, false);
    }

    /// Restarts the placement method from its beginning. Better positions can result if the relays have measured the
    /// interference at their present positions.
    ///
    /// Only the leader restarts; at other relays the call has no effect. The leader is relay 1, or relay N in a
    /// mission with an interference field.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Instant, Phase, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// relay.restart(Instant::from_millis(1_000));
    /// assert_eq!(relay.phase(), Phase::Planning);
    /// ```
    pub fn restart(&mut self, now: Instant) {
        self.node.restart(self.clock.advance(now));
    }

    /// Writes the next frame to send into `frame`, and returns its port and length. Call it until it returns `None`.
    ///
    /// Returns `None` while a [`ViewRecord`] is [not stored](Self::unpersisted). The pending frames follow once it is
    /// stored.
    ///
    /// The work is linear in the frame's length. A signed frame also needs the computation of a tag.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::MAX_FRAME;
    /// use uav_relay::{Instant, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// let mut frame = [0; MAX_FRAME];
    /// while let Some(transmit) = relay.poll_transmit(Instant::ZERO, &mut frame) {
    ///     let bytes = &frame[..transmit.len];
    ///     assert_eq!(bytes.last(), Some(&0), "the delimiter; out through `transmit.port`");
    /// }
    /// ```
    #[inline(never)] // its buffers would stay in the frame of a caller's main loop
    pub fn poll_transmit(&mut self, now: Instant, frame: &mut [u8; MAX_FRAME]) -> Option<Transmit> {
        let now = self.clock.advance(now);
        if self.node.unpersisted().is_some() {
            return None;
        }
        let sent = frames::poll_transmit(&mut self.node, &mut self.endpoint, now, frame)?;
        let port = match self.wiring() {
            Wiring::Shared => Port::Shared,
            Wiring::Pair if sent.to < self.node.member().node => Port::Upstream,
            Wiring::Pair => Port::Downstream,
        };
        Some(Transmit {
            port,
            len: sent.len,
        })
    }

    /// Returns the next event for the firmware, if there is one. Call this method until it returns `None`. Takes
    /// constant time.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Event, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// while relay.setpoint().is_none() {
    ///     let due = relay.poll_timeout().expect("it has work to do");
    ///     relay.handle_timeout(due);
    /// }
    /// let mut places = Vec::new();
    /// while let Some(event) = relay.poll_event() {
    ///     if event == Event::SetpointChanged {
    ///         places.extend(relay.setpoint());
    ///     }
    /// }
    /// assert_eq!(places.len(), 1, "fly there");
    /// ```
    pub fn poll_event(&mut self) -> Option<Event> {
        self.node.poll_event()
    }

    /// Returns the time by which [`Relay::handle_timeout`] must be called; `None` if no timer runs. Right after a call
    /// of `handle_timeout` the result is later than that call's `now`, or `None`.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Instant, Settings};
    ///
    /// let relay = relay(Settings::default());
    /// assert!(relay.poll_timeout().is_some_and(|due| due >= Instant::ZERO), "sleep until then, or the next byte");
    /// ```
    pub fn poll_timeout(&self) -> Option<Instant> {
        let due = [self.node.poll_timeout(), self.endurance_timeout()];
        let due = due.into_iter().flatten().min()?;
        Some(self.clock.external(due))
    }
}

impl Relay {
    /// Returns this relay's votes on views (lists of members) if they have changed and must be stored. Otherwise
    /// returns `None`.
    ///
    /// [`poll_transmit`](Self::poll_transmit) returns no frame until the firmware has confirmed by
    /// [`persisted`](Self::persisted) that they are stored. A relay without its votes after a restart could vote twice,
    /// and the chain could split. Takes constant time.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// # use uav_relay::{Settings, ViewRecord};
    /// # let mut relay = relay(Settings::default());
    /// # let mut flash = [0; ViewRecord::LENGTH];
    /// if let Some(record) = relay.unpersisted() {
    ///     flash = record.to_bytes();
    ///     relay.persisted(&record);
    /// }
    /// assert_eq!(relay.unpersisted(), None);
    /// ```
    pub fn unpersisted(&self) -> Option<ViewRecord> {
        self.node.unpersisted()
    }

    /// Returns this relay's current votes on views (lists of the chain's members), stored or not.
    ///
    /// A firmware can store them at the start, so that a fault of the storage shows before flight. Takes constant time.
    pub const fn view_record(&self) -> ViewRecord {
        self.node.view_record()
    }

    /// Confirms that `record`, returned by [`unpersisted`](Self::unpersisted), is stored. Takes constant time.
    ///
    /// A firmware without storage confirms each record at once. After a reboot the relay of such a firmware must stay
    /// off for the rest of the flight. If the votes have changed meanwhile, `unpersisted` returns the newer record.
    pub const fn persisted(&mut self, record: &ViewRecord) {
        self.node.persisted(record);
    }

    /// Passes this relay's votes on views (lists of members) to `store` if they are not stored yet. If `store` returns
    /// true, the votes count as stored.
    ///
    /// See [`unpersisted`](Self::unpersisted).
    pub fn persist(&mut self, mut store: impl FnMut(&ViewRecord) -> bool) {
        if let Some(record) = self.unpersisted()
            && store(&record)
        {
            self.persisted(&record);
        }
    }

    /// Restores the votes on views that were stored before the relay was switched off in flight.
    ///
    /// Call it right after the relay was created; only `Relay::resume` is allowed before. Takes constant time.
    ///
    /// # Errors
    /// Returns [`RecordError::Base`] if the record is of a relay that had loaded a different mission. Returns
    /// [`RecordError::Begun`] if the relay has already sent, received or computed something. The relay is then
    /// unchanged.
    pub fn resume_view(&mut self, now: Instant, record: &ViewRecord) -> Result<(), RecordError> {
        self.node.resume_view(self.clock.advance(now), record)
    }
}

#[cfg(feature = "upload")]
impl Relay {
    /// Restores `upload`, the newest mission uploaded before the relay was switched off. The firmware stored it at
    /// [`Event::Uploaded`](crate::Event::Uploaded).
    ///
    /// Call it right after the relay was created, before any other input. [`Relay::new`] still gets the mission that
    /// was loaded before flight. Takes constant time.
    ///
    /// # Errors
    /// Returns [`UploadError::Base`] if the upload is for relays that loaded a different mission. Returns
    /// [`UploadError::Line`] if it contradicts the positions of Tx and Rx or the geofence. Returns
    /// [`UploadError::Begun`] if the relay has already started. The relay is then unchanged.
    pub fn resume(&mut self, upload: &Upload) -> Result<(), UploadError> {
        self.node.resume(upload)
    }

    /// Accepts an uploaded mission that the firmware has received by other means than the relay's ports. The chain
    /// adopts it like any other upload. Takes constant time.
    ///
    /// # Errors
    /// Returns [`UploadError::Unsigned`] without `Settings::auth`, and [`UploadError::Base`] if the upload is for
    /// relays that loaded a different mission. Returns [`UploadError::Line`] if it contradicts the positions of Tx and
    /// Rx or the geofence. Returns [`UploadError::Old`] if the relay has already stored this mission or a newer one.
    pub fn handle_upload(&mut self, now: Instant, upload: &Upload) -> Result<(), UploadError> {
        self.node.handle_upload(self.clock.advance(now), upload)
    }

    /// Returns the newest mission that was uploaded to this relay, active or not; `None` without an upload.
    pub fn upload(&self) -> Option<&Upload> {
        self.node.upload()
    }

    /// Returns the version of the active mission; 0 for the mission that was loaded before flight.
    pub fn version(&self) -> u16 {
        self.node.member().active.version
    }
}

impl Relay {
    /// Returns the current setpoint, m in the mission's frame; `None` before the first agreement.
    ///
    /// Without a guard it is the position that the chain has agreed on. With `Settings::guard` (collision avoidance) it
    /// is the safe position closest to it.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::Settings;
    ///
    /// let relay = relay(Settings::default());
    /// assert_eq!(relay.setpoint(), None, "before the first agreement: stay where you are");
    /// ```
    pub fn setpoint(&self) -> Option<Placement> {
        self.node.setpoint()
    }

    /// Returns the position that the chain has agreed on for this relay; `None` before the first agreement.
    ///
    /// The guard (collision avoidance) does not limit this position, only the setpoint.
    pub fn agreed_place(&self) -> Option<Placement> {
        self.node.agreed_place()
    }

    /// Returns false if the drone and a neighbour are in the wrong order along x.
    ///
    /// Only a neighbour that flies to setpoints counts. The pilot must first fly the drone past that neighbour along x.
    /// `Autopilot::exchange` passes this value to the autopilot link.
    pub fn is_ready(&self) -> bool {
        let wrong = |side| self.hold_reason(side) == Some(HoldReason::Order);
        !(wrong(Side::Upstream) || wrong(Side::Downstream))
    }

    /// Returns the reason on the side `side` that keeps the setpoint from the agreed position, if any.
    ///
    /// `None` as well without a guard (collision avoidance). While the drone does not fly to setpoints, only
    /// [`HoldReason::Order`] is possible.
    pub fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.node.hold_reason(side)
    }

    /// Returns the direction from the setpoint to the next node at `side`: a relay, Tx or Rx.
    ///
    /// `None` without a setpoint, and while the next node is a relay of unknown position. Relays send their positions
    /// only if they have a guard.
    pub fn bearing(&self, side: Side) -> Option<Bearing> {
        Bearing::between(self.setpoint()?, self.node.place_toward(side)?)
    }

    /// Returns the target SIR that every hop of the agreed chain meets, linear. `None` before an agreement, and while
    /// the interference is unknown.
    pub fn target(&self) -> Option<f32> {
        let known = !matches!(self.mission().interference(), Interference::Unknown);
        self.node.round().target().filter(|_| known)
    }

    /// Returns the begin and end of this relay's time slots, as fractions of the frame (slot cycle). The slots are
    /// those of the agreed positions.
    ///
    /// `None` unless the mission has slots fitted to the need of each hop (`fitted_gap` above 0). Also `None` after the
    /// lease has expired, without a quorum, and after the acceptance of a view (another mission or other relays) until
    /// the agreement in it.
    ///
    /// The slots of all hops fill the frame. They change when the result of an agreement reaches this relay: from the
    /// last relay to the leader, hop by hop. Until it has passed all relays, some relays have the new slots, and the
    /// remaining relays have the old slots or none. [`Event::Converged`] reports that this relay has agreed.
    pub fn slot_shares(&self) -> Option<SlotShares> {
        self.node.slot_shares()
    }

    /// Returns an upper bound, linear, of the chain's worst hop SIR, whatever x the relays take. The bound is for the
    /// relays' current altitudes.
    ///
    /// The leader (the relay that starts the search) knows it after Algorithm 1 or 4. `None` at all other relays, and
    /// with the paper's fixed-step schedule, which gives no such bound.
    pub fn bound(&self) -> Option<f32> {
        self.node.round().bound()
    }

    /// Returns the protocol phase of the relay.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Phase, Settings};
    ///
    /// assert_eq!(relay(Settings::default()).phase(), Phase::Planning);
    /// ```
    pub fn phase(&self) -> Phase {
        self.node.phase()
    }

    /// Returns true while this relay is passive, because a second node with its number has precedence.
    ///
    /// Each node draws a random claim number at its start. Of two nodes with the same node number, the one with the
    /// larger epoch (start counter) has precedence, then the one with the larger claim number. A passive relay has no
    /// setpoint and takes no part in the protocol. It becomes active once the other node has been silent for twice
    /// `Settings::dead_after`, or when [`clear_duplicate_index`](Self::clear_duplicate_index) is called.
    pub fn is_passive(&self) -> bool {
        self.node.is_passive()
    }

    /// Returns the counters since the relay was switched on.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Settings, Stats};
    ///
    /// let relay = relay(Settings::default());
    /// assert_eq!(relay.stats(), &Stats::default(), "nothing has been heard or sent yet");
    /// ```
    pub fn stats(&self) -> &Stats {
        self.node.stats()
    }

    /// Returns the relay's index in the accepted view: 1 next to Tx, up to the number of relays.
    ///
    /// [`mission`](Self::mission) has the number of relays.
    pub fn index(&self) -> u16 {
        self.node.member().index
    }

    /// Returns the identifier of the last accepted view (list of the chain's members).
    pub fn view(&self) -> ViewId {
        self.node.member().view
    }

    /// Returns the time at which this relay's lease expires; `None` while there is no lease.
    ///
    /// Until that time no other relay uses positions of a later view. If the lease is not renewed by then, the relay
    /// requests a new view (list of the chain's members), and keeps its setpoint.
    pub fn lease(&self) -> Option<Instant> {
        let until = self.node.lease()?;
        Some(self.clock.external(until))
    }

    /// Returns the node numbers of the neighbours toward Tx and toward Rx; `None` for no neighbour.
    ///
    /// A node number is the index with which a relay was configured. View changes do not alter this number.
    pub fn neighbours(&self) -> [Option<u16>; 2] {
        self.node.neighbours()
    }

    /// Returns the active mission. The number of relays in this mission is that of the accepted view.
    pub fn mission(&self) -> &Mission {
        &self.node.member().mission
    }

    /// Returns the positions of Tx and Rx in the active mission; `None` if the configured positions apply.
    ///
    /// The x of all relays is measured along the line from Tx to Rx. After a change of Tx or Rx, use the new line to
    /// convert positions to latitude and longitude.
    pub fn sites(&self) -> Option<Sites> {
        self.node.sites()
    }

    /// Returns the interference at this relay's position, as estimated from its measurements. Only for missions whose
    /// interference is known as a function of x (a field). `None` before there are enough measurements.
    pub fn estimate(&self) -> Option<Estimate> {
        self.node.round().meter().estimate()
    }

    /// Returns Upsilon = E[1/I], 1/W, of the interference power I that this relay has measured.
    ///
    /// `None` before there are enough measurements. Until then the relay uses the interference field of the mission.
    pub fn measured_per_w(&self) -> Option<f32> {
        self.node.round().meter().published()
    }

    /// Returns the chain's newest estimate of the interferer, and its number.
    ///
    /// Before the first estimate, the result is the interferer that the mission configures.
    pub fn interference_estimate(&self) -> NumberedEstimate {
        self.node.round().sensing().estimate()
    }

    /// Returns the mean interference power measured at Tx (`Upstream`) or Rx (`Downstream`), W.
    ///
    /// The receiver's noise is subtracted. `None` before a report, or without
    /// [`Settings::listen`](crate::Settings::listen).
    pub fn level_w(&self, side: Side) -> Option<f32> {
        self.node.round().sensing().level_w(side)
    }

    /// Returns the reason why the last collected measurements gave no estimate of the interferer. `None` if they gave
    /// an estimate, and at all relays except the leader (the relay that starts the search).
    pub fn unfit(&self) -> Option<Unfit> {
        self.node.round().sensing().unfit()
    }

    /// Returns the number of completed rounds of Algorithm 2, and the worst hop's SIR after them, linear.
    ///
    /// `None` unless this relay is the leader and the algorithm is running.
    pub fn rounds(&self) -> Option<(u16, f32)> {
        self.node.round().rounds()
    }

    /// Returns the relay's transmit power, and the altitude that the chain agreed on last.
    pub fn profile(&self) -> Profile {
        self.node.round().profile()
    }
}

impl Relay {
    /// Processes a measurement of the interference. Samples of the kinds `Interference` and `FirstHop` need
    /// `Settings::measure`, all other kinds need `Settings::listen`.
    ///
    /// Takes constant time. Unusable samples are counted as
    /// [`Stats::samples_rejected`](crate::Stats::samples_rejected).
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Instant, Listen, Placement, Sample, Settings};
    ///
    /// # #[cfg(feature = "sensing")] {
    /// let mut relay = relay(Settings { listen: Some(Listen::default()), ..Settings::default() });
    /// let at = Placement { x_m: 350.0, y_m: 0.0, altitude_m: 20.0 };
    /// relay.handle_sample(Instant::from_millis(1_000), Sample::Heard { at, power_w: 2.5e-8 });
    /// assert_eq!(relay.stats().samples_rejected, 0);
    /// # }
    /// ```
    pub fn handle_sample(&mut self, now: Instant, sample: Sample) {
        self.node.handle_sample(self.clock.advance(now), sample);
    }

    /// Processes the drone's position `place`, measured at time `measured_at`. Takes constant time.
    ///
    /// A guard (collision avoidance) gives no setpoint before the first position. A position is ignored if it is not a
    /// number or farther than 1e7 m away.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::GuardConfig;
    /// use uav_relay::{Instant, Placement, Settings};
    ///
    /// # #[cfg(feature = "guard")] {
    /// let guard = GuardConfig::of(&MISSION, MISSION.config().common);
    /// let mut relay = relay(Settings { guard: Some(guard), ..Settings::default() });
    /// let (measured, now) = (Instant::from_millis(990), Instant::from_millis(1_000));
    /// relay.handle_position(now, Placement { x_m: 10.0, y_m: 0.0, altitude_m: 20.0 }, measured);
    /// # }
    /// ```
    pub fn handle_position(&mut self, now: Instant, place: Placement, measured_at: Instant) {
        let now = self.clock.advance(now);
        self.node
            .handle_position(now, place, self.clock.internal(measured_at));
    }

    /// Records whether the drone flies to the setpoints from now on (`flown`); initially true. Takes constant time.
    ///
    /// Pass false while a pilot controls the drone or it is on the ground. With `Settings::guard`, the relay then has
    /// no setpoint. Its neighbours are informed that the drone can be anywhere, and come no nearer to it. Once `flown`
    /// is true again, the relay starts as after power-up, with the next position from
    /// [`handle_position`](Self::handle_position). A repeated call with the same value has no effect.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Instant, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// // The pilot has taken control; later the autopilot follows setpoints again.
    /// relay.handle_control(Instant::from_millis(1_000), false);
    /// relay.handle_control(Instant::from_millis(9_000), true);
    /// ```
    pub fn handle_control(&mut self, now: Instant, flown: bool) {
        self.control(now, flown);
    }

    /// Records if the drone flies to the setpoints (`flown`). See [`handle_control`](Self::handle_control).
    ///
    /// Returns true if the call changes the state of the guard (collision avoidance).
    pub(crate) fn control(&mut self, now: Instant, flown: bool) -> bool {
        let now = self.clock.advance(now);
        self.review_endurance(now, flown);
        self.node.handle_control(now, flown)
    }

    /// Records the control state of the drone, for the reports to a ground station.
    ///
    /// `refuses` is true while the autopilot flies to a target other than the setpoint.
    #[cfg(feature = "telemetry")]
    #[doc(hidden)]
    pub fn report_control(&mut self, state: crate::flight::autopilot::state::State, refuses: bool) {
        let is_refused = state.is_flown() && refuses;
        let control = if is_refused {
            crate::wire::message::Entry::REFUSED
        } else {
            state as u16 + 1
        };
        self.node.report_control(control);
    }

    /// Reports that relays on `side` that were lost or under a pilot's control are no longer in the air. See
    /// [`handle_control`](Self::handle_control).
    ///
    /// The guard (collision avoidance) no longer keeps clear of these relays. If other relays of the view remain on
    /// that side, the drone does not move toward them until the guard has received a message from the nearest of them.
    /// If this nearest relay is lost before it sends a message, call the function again. Takes constant time.
    pub fn clear_lost(&mut self, now: Instant, side: Side) {
        self.node.clear_lost(self.clock.advance(now), side);
    }

    /// Reports that the duplicate of this relay's node number is gone. See
    /// [`Event::DuplicateIndex`](crate::Event::DuplicateIndex).
    ///
    /// If this relay is [passive](Self::is_passive), it becomes active, and raises its claim number above the
    /// duplicate's. Of two nodes with the same number, only the one with the larger claim number may have a setpoint.
    /// Takes constant time.
    pub fn clear_duplicate_index(&mut self, now: Instant) {
        self.node.clear_duplicate(self.clock.advance(now));
    }
}

#[cfg(feature = "departures")]
impl Relay {
    /// Requests to leave the chain, because the drone has to land soon. `endurance_s` is the remaining endurance of the
    /// drone, s; `None` if it is unknown. Call it again when the endurance changes.
    ///
    /// The relay keeps its position until [`Event::MayLeave`]. A departure needs a guard, or
    /// [`Settings::leave_without_guard`](crate::Settings::leave_without_guard). If `leave` is called right after a
    /// start, the relay joins the chain only if the chain needs it. See [`docs::batteries`](crate::docs::batteries).
    /// Takes constant time.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Departure, Instant, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// relay.leave(Instant::from_millis(1_000), Some(240));
    /// assert_eq!(relay.departure(Instant::from_millis(1_000)), Departure::NeedsChannel, "two wires per relay");
    /// ```
    pub fn leave(&mut self, now: Instant, endurance_s: Option<u16>) {
        let now = self.clock.advance(now);
        self.override_endurance(now, false);
        self.node.leave(now, endurance_s);
    }

    /// Makes this relay a spare, which waits outside of the chain until the leader calls it.
    ///
    /// Call it right after the start and [`resume_view`](Self::resume_view): it has no effect once the relay has taken
    /// part in a pass (message along the chain) or in a view change (vote on the members). A relay with two wires
    /// cannot be a spare. No guard (collision avoidance) knows the position of a waiting spare: the spare must stay at
    /// least the minimum separation away from all positions of the chain. A relay that restarts as a member of the
    /// chain becomes a member again at once. Takes constant time.
    pub fn wait_as_spare(&mut self, now: Instant) {
        let now = self.clock.advance(now);
        self.node.wait_as_spare(now);
    }

    /// Cancels the request to leave the chain, or joins the chain again. Takes constant time.
    ///
    /// From now on the relay requests to leave only if the firmware calls [`leave`](Self::leave), or if the margin
    /// becomes too small. The margin is the remaining flight time minus the time of the way home (`handle_endurance`).
    /// The margin is too small if it is below the usual limit, and also below half of the margin at this call.
    pub fn stay(&mut self, now: Instant) {
        let now = self.clock.advance(now);
        self.override_endurance(now, true);
        self.node.stay(now);
    }

    /// Returns the state of this relay's departure from the chain at `now`. Takes constant time.
    pub fn departure(&self, now: Instant) -> crate::Departure {
        self.node.departure(now)
    }
}
