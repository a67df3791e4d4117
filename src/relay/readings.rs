//! Getters of a relay, and inputs besides bytes. Measurements, position, control state, lost relays out of the way.

use super::facade::Relay;
use crate::field::estimate::Estimate;
use crate::geodetic::Sites;
use crate::guard::HoldReason;
use crate::mission::{Interference, Mission, Profile};
use crate::node::round::state::Phase;
use crate::node::sample::Sample;
use crate::place::Placement;
use crate::sensing::belief::Told;
use crate::sensing::fit::Unfit;
use crate::side::Side;
use crate::stats::Stats;
use crate::time::Instant;
use crate::view::ViewId;

impl Relay {
    /// Returns the current setpoint in metres in the mission's frame; `None` before the first agreement.
    ///
    /// It is the agreed position, or with `Settings::guard` a position as close to it as is safe now.
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

    /// Returns the agreed position, before the guard limits it; `None` before the first agreement.
    pub fn final_setpoint(&self) -> Option<Placement> {
        self.node.final_setpoint()
    }

    /// Returns true unless the drone is known to be out of order with a flown neighbour.
    ///
    /// If false, its pilot must fly it to its own side along the line before engaging. `Autopilot::exchange` passes the value on.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::Settings;
    ///
    /// assert!(relay(Settings::default()).is_ready());
    /// ```
    pub fn is_ready(&self) -> bool {
        let wrong = |side| self.hold_reason(side) == Some(HoldReason::Order);
        !(wrong(Side::Upstream) || wrong(Side::Downstream))
    }

    /// Returns the reason why the guard holds the drone back on `side`; `None` without a guard.
    ///
    /// While the drone is not flown only [`HoldReason::Order`] is possible.
    pub fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.node.hold_reason(side)
    }

    /// Returns the linear SIR of every hop of the agreed chain. `None` before an agreement or without known interference.
    pub fn target(&self) -> Option<f32> {
        let known = !matches!(self.mission().interference(), Interference::Unknown);
        self.node.round().target().filter(|_| known)
    }

    /// Returns an upper bound of the linear SIR at the current altitudes. The leader has it after Algorithm 1 or 4.
    ///
    /// No chain reaches it. `None` at other relays, and with the paper's fixed step, which omits chains.
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

    /// Returns true while this relay is passive. Another relay with the larger claim then uses its index.
    ///
    /// It has no setpoint and takes no part in the protocol until the other relay has been silent for twice
    /// `Settings::dead_after`, or until [`clear_index_taken`](Self::clear_index_taken) is called.
    pub fn stands_down(&self) -> bool {
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

    /// Returns the relay's place in the agreed view. 1 (next to the transmitter) to the relays of [`mission`](Self::mission).
    pub fn index(&self) -> u16 {
        self.node.member().index
    }

    /// Returns the last accepted view, to which all positions refer.
    pub fn view(&self) -> ViewId {
        self.node.member().view
    }

    /// Returns the expiry time of the lease; `None` before the first lease and after its expiry.
    ///
    /// Without a renewal the relay drops the agreement at that time; no other relay uses another agreement before.
    pub fn lease(&self) -> Option<Instant> {
        let until = self.node.lease()?;
        Some(self.clock.external(until))
    }

    /// Returns the node numbers of the neighbours toward the transmitter and toward the receiver. `None` for none.
    ///
    /// A node number is the index that a relay was configured with; no view changes it.
    pub fn neighbours(&self) -> [Option<u16>; 2] {
        self.node.neighbours()
    }

    /// Returns the active mission, with the number of relays in the view.
    pub fn mission(&self) -> &Mission {
        &self.node.member().mission
    }

    /// Returns the sites of the active mission; `None` for the ones configured before flight.
    ///
    /// They define the line of all positions: once they change, convert latitude and longitude by the new ones only.
    pub fn sites(&self) -> Option<Sites> {
        self.node.member().sites()
    }

    /// Returns the estimate from the measurements at this position; `None` before there are enough.
    pub fn estimate(&self) -> Option<Estimate> {
        self.node.round().meter().estimate()
    }

    /// Returns the measured Upsilon that this relay uses, 1/W. It replaces the agreed field's once this relay has measured enough.
    pub fn measured_per_w(&self) -> Option<f32> {
        self.node.round().meter().published()
    }

    /// Returns the estimate of the interference and its number. The mission's until the chain has estimated another.
    pub fn belief(&self) -> Told {
        self.node.round().sensing().told()
    }

    /// Returns the interference measured at the transmitter (upstream) or the receiver (downstream), W.
    ///
    /// The mean without noise; `None` before a report or without [`Settings::listen`](crate::Settings::listen).
    pub fn level_w(&self, side: Side) -> Option<f32> {
        self.node.round().sensing().level_w(side)
    }

    /// Returns the reason why the last collected measurements gave no estimate, at the leader.
    pub fn unfit(&self) -> Option<Unfit> {
        self.node.round().sensing().unfit()
    }

    /// Returns the completed rounds of Algorithm 2 while it runs, at the leader. The second value is the chain's linear SIR after
    /// the last round.
    pub fn rounds(&self) -> Option<(u16, f32)> {
        self.node.round().rounds()
    }

    /// Returns the relay's profile; its altitude is the one chosen last.
    pub fn profile(&self) -> Profile {
        self.node.round().profile()
    }
}

impl Relay {
    /// Processes one measurement of the interference, W or linear SIR. It is used if `Settings::measure` requires measurements.
    ///
    /// Takes constant time. Unusable samples are counted as [`Stats::samples_refused`](crate::Stats::samples_refused).
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
    /// assert_eq!(relay.stats().samples_refused, 0);
    /// # }
    /// ```
    pub fn handle_sample(&mut self, now: Instant, sample: Sample) {
        self.node.handle_sample(self.clock.advance(now), sample);
    }

    /// Processes the drone's position, `x_m` and altitude, at the time `at` of its measurement. Takes constant time.
    ///
    /// A guard needs it before the first setpoint. A position that is not a number, or farther than 1e7 m, is ignored.
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
    /// relay.handle_position(now, measured, Placement { x_m: 10.0, y_m: 0.0, altitude_m: 20.0 });
    /// # }
    /// ```
    pub fn handle_position(&mut self, now: Instant, at: Instant, place: Placement) {
        let now = self.clock.advance(now);
        self.node
            .handle_position(now, self.clock.internal(at), place);
    }

    /// Reports whether the drone flies to the setpoints from now on; initially true. Takes constant time.
    ///
    /// Report false while a pilot controls the drone or it is on the ground. With `Settings::guard`, a relay that is not flown
    /// has no setpoint, and its neighbours are informed that it may be anywhere: they keep their positions toward it. When flown
    /// again, it starts as after power-up, with the next position from [`handle_position`](Self::handle_position). A repeated
    /// report has no effect.
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

    /// Handles the control state, as [`handle_control`](Self::handle_control). Returns true if the relay has a guard that did not know this control state.
    pub(crate) fn control(&mut self, now: Instant, flown: bool) -> bool {
        self.node.handle_control(self.clock.advance(now), flown)
    }

    /// Reports that lost or unflown relays on `side` have landed or were removed. See [`handle_control`](Self::handle_control).
    ///
    /// The guard no longer keeps clear of them. It keeps clear of the other relays of the view on that side until it has heard the
    /// nearest one; if that one is lost before, clear again. Takes constant time.
    pub fn clear_lost(&mut self, now: Instant, side: Side) {
        self.node.clear_lost(self.clock.advance(now), side);
    }

    /// Reports that the other relay with this index is gone. See [`Event::IndexTaken`](crate::Event::IndexTaken).
    ///
    /// A [passive](Self::stands_down) relay becomes active, with a larger claim than the other had. Takes constant time.
    pub fn clear_index_taken(&mut self, now: Instant) {
        self.node.clear_duplicate(self.clock.advance(now));
    }
}
