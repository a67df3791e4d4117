//! The facade a firmware uses: bytes in, bytes and setpoints out, and no input or output of its own.

mod incoming;
mod port;
#[cfg(feature = "auth")]
pub(crate) mod signed;
#[cfg(feature = "upload")]
mod uploads;

use crate::event::Event;
use crate::field::estimate::Estimate;
use crate::guard::HoldReason;
use crate::mission::{Mission, Profile};
use crate::node::Node;
use crate::node::round::state::Phase;
use crate::node::sample::Sample;
use crate::node::view::record::{RecordError, ViewRecord};
use crate::place::Placement;
use crate::settings::{Identity, Settings, SetupError, Wiring, check};
use crate::side::Side;
use crate::stats::{Stats, bump};
use crate::time::Instant;
use crate::view::ViewId;
use crate::wire::deframe::{DeframeError, Deframer};
use crate::wire::frame::{self, FrameBuf, Header};
#[cfg(feature = "auth")]
use crate::wire::session::Session;
pub use port::{Port, Transmit};

use incoming::Addressed;

/// One relay's share of the placement, sans-IO.
///
/// # Contract
/// - *Inputs* [`handle_bytes`](Self::handle_bytes) and [`handle_timeout`](Self::handle_timeout) take anything, never fail
///   and do a bounded amount of work; what is wrong with it is counted in [`stats`](Self::stats).
/// - *Time* is an argument and should not run backward. The relay never reads a clock.
/// - *Getters* take constant work, and their numbers are those of the last agreement. Places are in metres in the frame of
///   [`MissionConfig`](crate::MissionConfig).
/// - *Output* is made from the state when it is asked for, so nothing can overflow. After every input, call
///   [`poll_transmit`](Self::poll_transmit) until it gives `None`, then [`poll_event`](Self::poll_event) until `None`,
///   then sleep until [`poll_timeout`](Self::poll_timeout) or the next byte.
/// - Once drained, `poll_timeout` is `None` or later than `now`: the loop cannot spin.
/// - *Setpoints* are finite, inside [0, D], at the altitude the relay holds or one of the mission's band, and at least the
///   mission's separation from those of its neighbours for the same pass. There is none before the first agreement, and
///   nothing moves it but a new agreement or the relay's own turn in Algorithm 2: a new mission does not, though the place that is
///   held may be outside its limits, until the chain has agreed in it.
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
    node: Node,
    network: u16,
    wiring: Wiring,
    /// Upstream or shared, and downstream.
    deframers: [Deframer; 2],
    counter: u32,
    #[cfg(feature = "auth")]
    session: Option<Session>,
}

impl Relay {
    /// A relay that has just been switched on at `now`; relay 1 (in a field relay N) begins by itself.
    ///
    /// `seed` should differ from relay to relay and from one start to the next (a chip's number, a noisy ADC); the timing of
    /// repetitions, the numbering of sweeps and which frames a guard takes for old ones depend on it, never a placement.
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
            #[cfg(feature = "auth")]
            session: None,
        }
    }

    #[inline(never)] // a session is built on the stack
    fn begin(&mut self, identity: Identity, seed: u32, now: Instant) {
        #[cfg(feature = "auth")]
        {
            self.session = self.node.member().settings.auth.map(Session::new);
        }
        self.node.begin(identity, seed, now);
    }

    /// Takes in bytes received at `port`, however they are cut. Bytes at a port that `Settings::wiring` does not have are dropped.
    ///
    /// A dozen instructions a byte; a CRC for at most one frame in 16 bytes; a tag, where frames are signed, and a message, at most 16
    /// reaches, for at most one in 19. What takes longer is left to [`handle_timeout`](Self::handle_timeout).
    pub fn handle_bytes(&mut self, now: Instant, port: Port, bytes: &[u8]) {
        let shared = self.wiring == Wiring::Shared;
        if shared != (port == Port::Shared) {
            return;
        }
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
                        Some(Addressed::ByNamesake(frame)) => {
                            #[cfg(feature = "auth")]
                            let claim = match &self.session {
                                Some(session) => Some(signed::claim(session, &frame)),
                                None => incoming::claim(&frame),
                            };
                            #[cfg(not(feature = "auth"))]
                            let claim = incoming::claim(&frame);
                            if let Some(claim) = claim {
                                self.node.hear_namesake(now, claim);
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
    #[inline(never)] // as `poll_transmit`
    pub fn handle_timeout(&mut self, now: Instant) {
        self.node.handle_timeout(now);
    }

    /// Takes one measurement of the interference, W or linear SIR, where `Settings::measure` asks for them.
    ///
    /// Constant work. What is no use is counted as [`Stats::samples_refused`].
    pub fn handle_sample(&mut self, sample: Sample) {
        self.node.handle_sample(sample);
    }

    /// Takes in where the drone was at time `at`, `x_m` and altitude: when that was measured, not when it was read. Where
    /// `Settings::guard` is set there is no setpoint before the first of these.
    ///
    /// Constant work. A place that is no number, or farther than 1e7 m, has no effect.
    pub fn handle_position(&mut self, now: Instant, at: Instant, place: Placement) {
        self.node.handle_position(now, at, place);
    }

    /// Whether the drone flies to the setpoints from now on: not while its pilot has it, or it is on the ground. A relay is taken to be
    /// flown until this says otherwise.
    ///
    /// Where `Settings::guard` is set, a relay that is not flown has no setpoint, and its neighbours are told that it may be anywhere: they
    /// stay where they are toward it. Flown again it begins as after a start, with the next place that
    /// [`handle_position`](Self::handle_position) takes in.
    ///
    /// Constant work. To say the same again has no effect.
    pub fn handle_control(&mut self, now: Instant, flown: bool) {
        self.node.handle_control(now, flown);
    }

    /// Relays at `side` that fell silent, or are not flown ([`handle_control`](Self::handle_control)), have landed, or were taken away: the
    /// guard need not keep clear of them any more.
    ///
    /// Constant work.
    pub fn clear_lost(&mut self, now: Instant, side: Side) {
        self.node.clear_lost(now, side);
    }

    /// The other relay that used this one's number ([`Event::IndexTaken`]) has landed, or has another number now: this one takes part
    /// again, if it [stands down](Self::stands_down).
    ///
    /// Constant work.
    pub fn clear_index_taken(&mut self, now: Instant) {
        self.node.clear_namesake(now);
    }

    /// Has the chain agree again, from the beginning of its method: in a closed loop, once it has measured where it stands.
    ///
    /// Only the leader (relay 1; in a field relay N) has something to begin; with any other relay nothing happens.
    pub fn restart(&mut self, now: Instant) {
        self.node.restart(now);
    }

    /// Writes the next frame to be sent into `frame`, if there is one. Call until there is none.
    ///
    /// Linear in the length of the frame; a tag, where frames are signed.
    #[inline(never)] // its buffers would stay in the frame of a caller's main loop
    pub fn poll_transmit(&mut self, now: Instant, frame: &mut FrameBuf) -> Option<Transmit> {
        let sender = self.node.member().node;
        let mut header = Header {
            network: self.network,
            sender,
            destination: 0,
            counter: self.counter,
        };
        #[cfg(feature = "auth")]
        if let Some(session) = &mut self.session {
            if self.node.stands_down() {
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
    pub fn poll_event(&mut self) -> Option<Event> {
        self.node.poll_event()
    }

    /// When [`Relay::handle_timeout`] is to be called at the latest; after a call it is `None` or later than `now`.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.node.poll_timeout()
    }

    /// Where to fly, once the chain has agreed, in metres in the mission's frame: to the relay's place, or with `Settings::guard` as
    /// far toward it as is safe by now.
    pub fn setpoint(&self) -> Option<Placement> {
        self.node.setpoint()
    }

    /// The place that the chain has agreed on for this relay, where it is to be in the end; `None` before the first agreement.
    pub fn final_setpoint(&self) -> Option<Placement> {
        self.node.final_setpoint()
    }

    /// What keeps the drone from the agreed place at `side`, where `Settings::guard` is set.
    pub fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.node.hold_reason(side)
    }

    /// The SIR (linear) that every hop of the agreed chain meets; `None` before the first agreement.
    pub fn target(&self) -> Option<f32> {
        self.node.round().target()
    }

    /// At the leader, after Algorithm 1 or 4: at the altitudes held no chain has an SIR of this or more, linear. `None` elsewhere, and
    /// with the paper's fixed step, which leaves chains out.
    pub fn bound(&self) -> Option<f32> {
        self.node.round().bound()
    }

    /// Where the relay is in the protocol.
    pub fn phase(&self) -> Phase {
        self.node.phase()
    }

    /// Whether it takes part in nothing and has no set-point, because another relay that does take part uses its number. That is over
    /// with [`clear_index_taken`](Self::clear_index_taken), or once nothing was heard of the other for twice `Settings::dead_after`.
    pub fn stands_down(&self) -> bool {
        self.node.stands_down()
    }

    /// What has been counted since the relay was switched on.
    pub fn stats(&self) -> &Stats {
        self.node.stats()
    }

    /// Its place in the chain by the view agreed on, 1 (next to the transmitter) to the relays of [`mission`](Self::mission).
    pub fn index(&self) -> u16 {
        self.node.member().index
    }

    /// The view of the chain that it is in, which it has accepted last: all that it says of places is of that view.
    pub fn view(&self) -> ViewId {
        self.node.member().view
    }

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
        self.node.resume_view(now, record)
    }

    /// Until when it may hold what was agreed on without hearing more: by then nobody else flies anything else. `None` before that is
    /// known, and when the time is over.
    pub fn lease(&self) -> Option<Instant> {
        self.node.lease()
    }

    /// The node numbers of its neighbours toward the transmitter and toward the receiver, `None` where it has none. A node number is
    /// the index that a relay was given before flight; no view changes it.
    pub fn neighbours(&self) -> [Option<u16>; 2] {
        self.node.neighbours()
    }

    /// The mission the relay flies, with as many relays as are in its view.
    pub fn mission(&self) -> &Mission {
        &self.node.member().mission
    }

    /// What the measurements at this place say so far, and `None` before they say anything.
    pub fn estimate(&self) -> Option<Estimate> {
        self.node.round().meter().estimate()
    }

    /// Upsilon that this relay uses instead of the agreed field's, 1/W, once it has measured enough.
    pub fn measured_per_w(&self) -> Option<f32> {
        self.node.round().meter().published()
    }

    /// While Algorithm 2 goes on, at the leader: rounds that are over, and the SIR (linear) of the chain after the last.
    pub fn rounds(&self) -> Option<(u16, f32)> {
        self.node.round().rounds()
    }

    /// What the relay holds; its altitude is the one chosen last.
    pub fn profile(&self) -> Profile {
        self.node.round().profile()
    }
}

#[cfg(feature = "auth")]
#[cfg(test)]
mod tests;
