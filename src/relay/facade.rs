//! The relay: bytes and time in, frames and events out, and records of votes and uploads that a firmware keeps over a reboot.

use super::incoming;
use super::incoming::Addressed;
use super::port::{Port, Transmit};
#[cfg(feature = "auth")]
use super::signed;
use crate::event::Event;
use crate::mission::Mission;
use crate::node::Node;
use crate::node::view::record::{RecordError, ViewRecord};
use crate::settings::{Identity, Settings, SetupError, Wiring, check};
use crate::side::Side;
use crate::stats::bump;
use crate::time::{Instant, MonotonicClock};
use crate::wire::deframe::{DeframeError, Deframer};
use crate::wire::frame;
use crate::wire::frame::{Header, MAX_FRAME};
#[cfg(feature = "auth")]
use crate::wire::session::Session;
#[cfg(feature = "upload")]
use crate::wire::upload::{Upload, UploadError};

/// One relay's share of the placement, sans-IO.
///
/// # Contract
/// - *Inputs* [`handle_bytes`](Self::handle_bytes) and [`handle_timeout`](Self::handle_timeout) take anything, never fail
///   and do a bounded amount of work; what is wrong with it is counted in [`stats`](Self::stats).
/// - *Time* is an argument; the relay never reads a clock. After a backward step of the caller's clock timers and lease go on as if no time had
///   passed between the two calls, after a forward step they expire. Give it a monotonic clock: a forward step while a part of the chain is out of reach ends the wait for the
///   leases of that part early, so two chains may fly until these have expired.
/// - *Getters* take constant work, and their numbers are those of the last agreement. Places are in metres in the frame of
///   [`MissionConfig`](crate::MissionConfig).
/// - *Output* is made from the state when it is asked for, so nothing can overflow. After every input, call
///   [`poll_transmit`](Self::poll_transmit) until it gives `None`, then [`poll_event`](Self::poll_event) until `None`,
///   then sleep until [`poll_timeout`](Self::poll_timeout) or the next byte.
/// - Once drained, `poll_timeout` is `None` or later than `now`: the loop cannot spin.
/// - *Setpoints* are finite, inside [0, D], at the altitude the relay holds or one of the mission's band, and at least the
///   mission's separation from those of its neighbours for the same pass. There is none before the first agreement, and
///   nothing moves it but a new agreement or the relay's own turn in Algorithm 2: a new mission does not, though the place that is
///   held may be outside its limits, until the chain has agreed in it. One between other sites leaves none until then.
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
    network: u16,
    wiring: Wiring,
    /// Upstream or shared, and downstream.
    deframers: [Deframer; 2],
    pub(super) counter: u32,
    pub(super) clock: MonotonicClock,
    #[cfg(feature = "auth")]
    session: Option<Session>,
}

impl Relay {
    /// A relay that has just been switched on at `now`; relay 1 (in a field relay N) begins by itself.
    ///
    /// `seed` must differ from board to board, also where image and configuration are copies of each other, and should differ from one
    /// start to the next: a chip's unique number, a random number generator, the noise of RAM after power-up. Two relays with one index tell
    /// each other apart by it, so that at most one of them has a setpoint. The timing of repetitions, the numbering of sweeps and
    /// which frames a guard takes for old ones depend on it, too, but no placement.
    ///
    /// # Errors
    /// [`SetupError`] names the part of `identity` or `settings` that does not fit.
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

    /// As [`new`](Self::new), in `slot`, which stands in a place of its own: the stack need not hold a relay.
    ///
    /// # Errors
    /// As there; `slot` is left as it was.
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
            network: identity.network,
            wiring: settings.wiring,
            deframers: [Deframer::new(), Deframer::new()],
            counter: 0,
            clock: MonotonicClock::new(now),
            #[cfg(feature = "auth")]
            session: None,
        }
    }

    #[inline(never)] // a session is built on the stack
    fn begin(&mut self, identity: Identity, seed: u32, now: Instant) {
        #[cfg(feature = "auth")]
        {
            let number = self.node.claim_number();
            let Settings {
                auth, dead_after, ..
            } = self.node.member().settings;
            self.session = auth.map(|auth| Session::new(auth, number, dead_after));
        }
        self.node.begin(identity, seed, now);
    }

    /// Takes in bytes received at `port`, however they are cut. Bytes at a port that `Settings::wiring` does not have are dropped.
    ///
    /// A dozen instructions a byte; a CRC for at most one frame in 16 bytes; a tag, where frames are signed, and a message, at most 16
    /// reaches, for at most one in 19. What takes longer is left to [`handle_timeout`](Self::handle_timeout).
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Instant, Port, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// // What a UART has received, however it is cut. Noise is counted, and nothing else comes of it.
    /// relay.handle_bytes(Instant::from_millis(5), Port::Upstream, &[0x11, 0x22, 0x33, 0]);
    /// assert_eq!(relay.stats().truncated, 1);
    /// ```
    pub fn handle_bytes(&mut self, now: Instant, port: Port, bytes: &[u8]) {
        let shared = self.wiring == Wiring::Shared;
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
            match deframer.push(byte) {
                None => {}
                Some(Err(error)) => {
                    let stats = self.node.stats_mut();
                    let counter = match error {
                        DeframeError::Oversized => &mut stats.oversized,
                        DeframeError::Truncated => &mut stats.truncated,
                    };
                    bump(counter);
                }
                Some(Ok(plain)) => {
                    let addressed =
                        incoming::addressed(&mut self.node, now, self.network, port, plain);
                    let (side, frame) = match addressed {
                        Some(Addressed::By(side, frame)) => (side, frame),
                        Some(Addressed::ByDuplicate(frame)) => {
                            #[cfg(feature = "auth")]
                            let sender = match &self.session {
                                Some(session) => Some(session.sender(&frame)),
                                None => incoming::sender(&self.node, &frame),
                            };
                            #[cfg(not(feature = "auth"))]
                            let sender = incoming::sender(&self.node, &frame);
                            if let Some(sender) = sender {
                                self.node.hear_duplicate(now, sender);
                            }
                            continue;
                        }
                        None => continue,
                    };
                    #[cfg(feature = "auth")]
                    if let Some(session) = &mut self.session {
                        signed::receive(&mut self.node, session, now, side, &frame);
                        continue;
                    }
                    incoming::receive(&mut self.node, now, side, &frame);
                }
            }
        }
    }

    /// Handles what is due by `now`: timers that have run out, and one portion of a computation.
    ///
    /// Bounded by that portion: 256 reaches while the leader predicts, the chain's hops over ten relays (or over forty where nothing
    /// changes) of the joint method, 624 places of Algorithm 2; next to nothing otherwise.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::Settings;
    ///
    /// let mut relay = relay(Settings::default());
    /// // Relay 1 begins by itself: it wants to be called, portion by portion, until it has its place.
    /// while let (None, Some(due)) = (relay.setpoint(), relay.poll_timeout()) {
    ///     relay.handle_timeout(due);
    /// }
    /// assert!(relay.setpoint().is_some());
    /// ```
    #[inline(never)] // as `poll_transmit`
    pub fn handle_timeout(&mut self, now: Instant) {
        self.node.handle_timeout(self.clock.advance(now));
    }

    /// Has the chain agree again, from the beginning of its method: in a closed loop, once it has measured where it stands.
    ///
    /// Only the leader (relay 1; in a field relay N) has something to begin; with any other relay nothing happens.
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

    /// Writes the next frame to be sent into `frame`, if there is one. Call until there is none.
    ///
    /// Linear in the length of the frame; a tag, where frames are signed.
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
        let sender = self.node.member().node;
        let mut header = Header {
            network: self.network,
            sender,
            destination: 0,
            counter: self.counter,
        };
        #[cfg(feature = "auth")]
        if let Some(session) = &mut self.session {
            if self.node.is_passive() {
                return None;
            }
            // A counter is never used twice: after four billion frames a new epoch is due.
            if self.counter == u32::MAX {
                return None;
            }
            let (side, len) = signed::next(&mut self.node, session, now, &mut header, frame)?;
            return Some(self.sent(side, len));
        }
        let (side, to, message) = self.node.poll_message(now)?;
        header.destination = to;
        let len = frame::encode(header, &message, frame);
        Some(self.sent(side, len))
    }

    /// One more frame has gone out.
    fn sent(&mut self, side: Side, len: usize) -> Transmit {
        self.counter = self.counter.wrapping_add(1);
        bump(&mut self.node.stats_mut().sent);
        let port = match (self.wiring, side) {
            (Wiring::Shared, _) => Port::Shared,
            (Wiring::Pair, Side::Upstream) => Port::Upstream,
            (Wiring::Pair, Side::Downstream) => Port::Downstream,
        };
        Transmit { port, len }
    }

    /// The next thing the firmware should know of, if there is one. Call until there is none. Constant work.
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

    /// When [`Relay::handle_timeout`] is to be called at the latest; after a call it is `None` or later than `now`.
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
    /// What it has said in the votes on views, to be stored whenever it has changed, *before* [`poll_transmit`](Self::poll_transmit) is
    /// called: a promise that is forgotten is none. Constant work.
    pub const fn view_record(&self) -> ViewRecord {
        self.node.view_record()
    }

    /// Has a relay that has just been made, and was handed nothing but an upload yet, stand by what it had said before it was
    /// switched off in flight: the [`view_record`](Self::view_record) that was stored last.
    ///
    /// Constant work.
    ///
    /// # Errors
    /// [`RecordError::Base`] if it was stored by a relay that was loaded with another mission, [`RecordError::Begun`] if the relay
    /// has begun to talk or to compute. Nothing has changed then.
    pub fn resume_view(&mut self, now: Instant, record: &ViewRecord) -> Result<(), RecordError> {
        self.node.resume_view(self.clock.advance(now), record)
    }
}

#[cfg(feature = "upload")]
impl Relay {
    /// Has a relay that has just been made, and was handed nothing yet, fly `upload`: the newest that it had stored on
    /// [`Event::Uploaded`](crate::Event::Uploaded) before it was switched off. [`Relay::new`] still takes the mission that was loaded
    /// before flight.
    ///
    /// Constant work.
    ///
    /// # Errors
    /// [`UploadError::Base`] if it was stored for another mission than the one that was loaded, [`UploadError::Line`] if there is no
    /// line on earth for it, [`UploadError::Begun`] if the relay has begun to talk or to compute. Nothing has changed then.
    pub fn resume(&mut self, upload: &Upload) -> Result<(), UploadError> {
        self.node.resume(upload)
    }

    /// Takes a new mission that has come another way than over the link; the chain adopts it as one that has.
    ///
    /// Constant work.
    ///
    /// # Errors
    /// [`UploadError::Unsigned`] without `Settings::auth`, [`UploadError::Base`] if it is for other relays, [`UploadError::Line`] if
    /// there is no line on earth for it, [`UploadError::Old`] if a mission as new as that is held.
    pub fn handle_upload(&mut self, now: Instant, upload: &Upload) -> Result<(), UploadError> {
        self.node.handle_upload(self.clock.advance(now), upload)
    }

    /// The newest mission held, flown or not yet, if it was uploaded.
    pub fn upload(&self) -> Option<&Upload> {
        self.node.upload()
    }

    /// The version of the mission that it flies: 0 for the one that was loaded before flight.
    pub fn version(&self) -> u16 {
        self.node.member().active.version
    }
}
