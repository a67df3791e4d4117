//! Facade of a relay: bytes and time in, frames and events out. It also has the records that a firmware keeps across a reboot.

use super::frames;
use super::port::{Port, Transmit};
use crate::event::Event;
use crate::mission::Mission;
use crate::node::Node;
use crate::node::view::record::{RecordError, ViewRecord};
use crate::settings::{Identity, Settings, SetupError, Wiring, check};
use crate::time::{Instant, MonotonicClock};
use crate::wire::deframe::Deframer;
use crate::wire::endpoint::Endpoint;
use crate::wire::frame::MAX_FRAME;
#[cfg(feature = "upload")]
use crate::wire::upload::{Upload, UploadError};

/// A relay of the chain: the whole protocol, without input or output of its own (sans-IO).
///
/// # Contract
/// - *Inputs*: [`handle_bytes`](Self::handle_bytes) and [`handle_timeout`](Self::handle_timeout) accept anything, never fail
///   and do a bounded amount of work; [`stats`](Self::stats) counts invalid input.
/// - *Time* is an argument; the relay never reads a clock. Use a monotonic clock. After a backward step, timers and the lease
///   continue as if no time had passed between the two calls; after a forward step they expire. A forward step while a part of
///   the chain is out of reach ends the wait for that part's leases early: two chains may then fly until these have expired.
/// - *Getters* take constant time and return values of the last agreement. Positions are in metres in the frame of
///   [`MissionConfig`](crate::MissionConfig).
/// - *Outputs* are built from the state on request, so no queue can overflow. After every input, call
///   [`poll_transmit`](Self::poll_transmit) until it returns `None`, then [`poll_event`](Self::poll_event) until `None`,
///   then sleep until [`poll_timeout`](Self::poll_timeout) or the next byte.
/// - After that, `poll_timeout` is `None` or later than `now`: the loop cannot spin.
/// - *Setpoints* are finite, within [0, D] along the line, at the relay's altitude or one of the mission's band, and at least
///   the mission's separation from the neighbours' setpoints of the same pass. There is none before the first agreement. Only
///   a new agreement or the relay's own turn in Algorithm 2 changes it. A new mission keeps it until the chain has agreed in
///   that mission, even outside the new limits; a mission between other sites removes it until then.
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
    /// Deframers of the upstream or shared port, and of the downstream port.
    deframers: [Deframer; 2],
    pub(super) clock: MonotonicClock,
}

impl Relay {
    /// Creates a relay that is switched on at `now`; relay 1 (in a field relay N) starts by itself.
    ///
    /// `seed` must differ between boards, even if their image and configuration are the same, and should differ between starts:
    /// use a chip's unique number, a random number generator, or the noise of RAM after power-up. It lets two relays with the
    /// same index distinguish each other, so that at most one has a setpoint. It also affects retransmission timing, sweep
    /// numbers and the frames that a guard considers old, but no position.
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

    /// Creates a relay as [`new`](Self::new) does, but in `slot`, so that the stack need not hold it.
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
        }
    }

    const fn wiring(&self) -> Wiring {
        self.node.member().settings.wiring
    }

    #[inline(never)] // a session is built on the stack
    fn begin(&mut self, identity: Identity, seed: u32, now: Instant) {
        #[cfg(feature = "auth")]
        {
            let number = self.node.claim_number();
            let Settings {
                auth, dead_after, ..
            } = self.node.member().settings;
            if let Some(auth) = auth {
                self.endpoint.sign(auth, number, dead_after);
            }
        }
        self.node.begin(identity, seed, now);
    }

    /// Processes bytes received at `port`, split anywhere. Bytes at a port that `Settings::wiring` lacks are dropped.
    ///
    /// Takes a dozen instructions per byte; a CRC for at most one frame per 16 bytes; a message of at most 16 reaches, with a tag
    /// if frames are signed, for at most one per 19 bytes. Longer work is left to [`handle_timeout`](Self::handle_timeout).
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
        for &byte in bytes {
            if let Some(decoded) = deframer.push(byte)
                && let Some(frame) = self.endpoint.open(decoded, self.node.stats_mut())
            {
                frames::receive(&mut self.node, &mut self.endpoint, now, port, &frame);
            }
        }
    }

    /// Handles timers that have expired by `now`, and one portion of a computation.
    ///
    /// The portion is bounded: 256 reaches while the leader predicts, the chain's hops over ten relays (over forty where nothing
    /// changes) of the joint method, 624 positions of Algorithm 2; almost nothing otherwise.
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
        self.node.handle_timeout(self.clock.advance(now));
    }

    /// Restarts the method from its beginning: use it in a closed loop after measuring the actual position.
    ///
    /// Only the leader (relay 1; in a field relay N) restarts; at other relays the call has no effect.
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

    /// Writes the next frame to send into `frame`, if there is one. Call it until it returns `None`.
    ///
    /// The work is linear in the frame's length, plus a tag if frames are signed.
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

    /// Returns the next event for the firmware, if there is one. Call it until it returns `None`. Takes constant time.
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

    /// Returns the latest time of the next [`Relay::handle_timeout`] call. After that call it is `None` or later than `now`.
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
        let due = self.node.poll_timeout()?;
        Some(self.clock.external(due))
    }
}

impl Relay {
    /// Returns the acceptor state. Persist it after every change and *before* [`poll_transmit`](Self::poll_transmit).
    ///
    /// Without it a restarted relay breaks its promises, and the chain can split. Takes constant time.
    pub const fn view_record(&self) -> ViewRecord {
        self.node.view_record()
    }

    /// Restores the [`view_record`](Self::view_record) stored before the relay was switched off in flight.
    ///
    /// Call it right after the relay was created; only `Relay::resume` may come before. Takes constant time.
    ///
    /// # Errors
    /// Returns [`RecordError::Base`] if the record is of a relay with another loaded mission, and [`RecordError::Begun`] if the
    /// relay has already sent, received or computed something. The relay is then unchanged.
    pub fn resume_view(&mut self, now: Instant, record: &ViewRecord) -> Result<(), RecordError> {
        self.node.resume_view(self.clock.advance(now), record)
    }
}

#[cfg(feature = "upload")]
impl Relay {
    /// Restores `upload`, the newest one stored before the relay was switched off. It was stored on
    /// [`Event::Uploaded`](crate::Event::Uploaded).
    ///
    /// Call it right after the relay was created, before any other input. [`Relay::new`] still takes the mission that was loaded
    /// before flight. Takes constant time.
    ///
    /// # Errors
    /// Returns [`UploadError::Base`] if the upload was stored for another loaded mission, [`UploadError::Line`] if there is no
    /// line on earth for it, and [`UploadError::Begun`] if the relay has already started. The relay is then unchanged.
    pub fn resume(&mut self, upload: &Upload) -> Result<(), UploadError> {
        self.node.resume(upload)
    }

    /// Accepts a new mission that was not received over the link. The chain adopts it like any other upload. Constant time.
    ///
    /// # Errors
    /// Returns [`UploadError::Unsigned`] without `Settings::auth`, [`UploadError::Base`] if it is for other relays,
    /// [`UploadError::Line`] without a line on earth for it, and [`UploadError::Old`] if the relay holds a mission that is as
    /// new.
    pub fn handle_upload(&mut self, now: Instant, upload: &Upload) -> Result<(), UploadError> {
        self.node.handle_upload(self.clock.advance(now), upload)
    }

    /// Returns the newest mission of this relay, active or not, if it was uploaded.
    pub fn upload(&self) -> Option<&Upload> {
        self.node.upload()
    }

    /// Returns the version of the active mission: 0 for the one that was loaded before flight.
    pub fn version(&self) -> u16 {
        self.node.member().active.version
    }
}
