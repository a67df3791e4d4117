//! Readings of a relay, of its last agreement; and inputs besides bytes: measurements, the drone's position, who flies it, relays that are
//! out of the way. Constant work.

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
    /// Where to fly, once the chain has agreed, in metres in the mission's frame: to the relay's place, or with `Settings::guard` as
    /// far toward it as is safe by now.
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

    /// The place that the chain has agreed on for this relay, where it is to be in the end; `None` before the first agreement.
    pub fn final_setpoint(&self) -> Option<Placement> {
        self.node.final_setpoint()
    }

    /// Returns true unless the drone is known to be out of order with a flown neighbour: it must not be engaged before its pilot has flown
    /// it to its own side along the line. Hand it to `Autopilot::handle_ready`.
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

    /// Returns what keeps the drone from the agreed place on `side`, where `Settings::guard` is set. While the drone is not flown only
    /// [`HoldReason::Order`] is possible.
    pub fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.node.hold_reason(side)
    }

    /// The SIR (linear) that every hop of the agreed chain meets; `None` before the first agreement, and while nothing is known of the
    /// interference.
    pub fn target(&self) -> Option<f32> {
        let known = !matches!(self.mission().interference(), Interference::Unknown);
        self.node.round().target().filter(|_| known)
    }

    /// At the leader, after Algorithm 1 or 4: at the altitudes held no chain has an SIR of this or more, linear. `None` elsewhere, and
    /// with the paper's fixed step, which leaves chains out.
    pub fn bound(&self) -> Option<f32> {
        self.node.round().bound()
    }

    /// Where the relay is in the protocol.
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

    /// Returns true while this relay is passive: it has no setpoint and takes part in nothing, because another relay uses its number and
    /// has the larger claim to it. It becomes active with [`clear_index_taken`](Self::clear_index_taken), or once nothing was received
    /// of the other relay for twice `Settings::dead_after`, and has a place again once the chain has agreed anew.
    pub fn stands_down(&self) -> bool {
        self.node.is_passive()
    }

    /// What has been counted since the relay was switched on.
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

    /// Its place in the chain by the view agreed on, 1 (next to the transmitter) to the relays of [`mission`](Self::mission).
    pub fn index(&self) -> u16 {
        self.node.member().index
    }

    /// The view of the chain that it is in, which it has accepted last: all that it says of places is of that view.
    pub fn view(&self) -> ViewId {
        self.node.member().view
    }

    /// Until when it may hold what was agreed on without hearing more: by then nobody else flies anything else. `None` before that is
    /// known, and when the time is over.
    pub fn lease(&self) -> Option<Instant> {
        let until = self.node.lease()?;
        Some(self.clock.external(until))
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

    /// Between which sites the mission is flown; `None` for those that the relay was loaded with. Places are along the line between these:
    /// a firmware turns them into latitudes and longitudes, and back, by no other from the call on in which this changed.
    pub fn sites(&self) -> Option<Sites> {
        self.node.member().sites()
    }

    /// What the measurements at this place say so far, and `None` before they say anything.
    pub fn estimate(&self) -> Option<Estimate> {
        self.node.round().meter().estimate()
    }

    /// Upsilon that this relay uses instead of the agreed field's, 1/W, once it has measured enough.
    pub fn measured_per_w(&self) -> Option<f32> {
        self.node.round().meter().published()
    }

    /// What it believes of the interference, and the number of that: of the mission before the chain has found anything else.
    pub fn belief(&self) -> Told {
        self.node.round().sensing().told()
    }

    /// What the transmitter (upstream) or the receiver (downstream) has told this relay of the interference there: the mean of its
    /// measurements, W, the receiver's noise taken off; `None` before it has, and in a relay that does not listen
    /// ([`Settings::listen`](crate::Settings::listen)).
    pub fn level_w(&self, side: Side) -> Option<f32> {
        self.node.round().sensing().level_w(side)
    }

    /// At the leader: why nothing was made of what was heard last.
    pub fn unfit(&self) -> Option<Unfit> {
        self.node.round().sensing().unfit()
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

impl Relay {
    /// Takes one measurement of the interference, W or linear SIR, where `Settings::measure` asks for them.
    ///
    /// Constant work. What is no use is counted as [`Stats::samples_refused`](crate::Stats::samples_refused).
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

    /// Takes in where the drone was at time `at`, `x_m` and altitude: when that was measured, not when it was read. Where
    /// `Settings::guard` is set there is no setpoint before the first of these.
    ///
    /// Constant work. A place that is no number, or farther than 1e7 m, has no effect.
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

    /// Whether the drone flies to the setpoints from now on: not while its pilot has it, or it is on the ground. A relay is taken to be
    /// flown until this says otherwise.
    ///
    /// Where `Settings::guard` is set, a relay that is not flown has no setpoint, and its neighbours are told that it may be anywhere: they
    /// stay where they are toward it. Flown again it begins as after a start, with the next place that
    /// [`handle_position`](Self::handle_position) takes in.
    ///
    /// Constant work. To say the same again has no effect.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Instant, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// // The pilot has taken the sticks; later the autopilot follows set-points again.
    /// relay.handle_control(Instant::from_millis(1_000), false);
    /// relay.handle_control(Instant::from_millis(9_000), true);
    /// ```
    pub fn handle_control(&mut self, now: Instant, flown: bool) {
        self.node.handle_control(self.clock.advance(now), flown);
    }

    /// Relays at `side` that fell silent, or are not flown ([`handle_control`](Self::handle_control)), have landed, or were taken away: the
    /// guard need not keep clear of them any more.
    ///
    /// Constant work.
    pub fn clear_lost(&mut self, now: Instant, side: Side) {
        self.node.clear_lost(self.clock.advance(now), side);
    }

    /// Reports that the other relay with this one's number ([`Event::IndexTaken`](crate::Event::IndexTaken)) has landed, or has another number
    /// now: a relay that is [passive](Self::stands_down) becomes active, with a larger claim than the other one had.
    ///
    /// Constant work.
    pub fn clear_index_taken(&mut self, now: Instant) {
        self.node.clear_duplicate(self.clock.advance(now));
    }
}
