//! What the firmware tells a relay of the world: what was measured, where the drone is, who flies it, who is out of the way.

use super::facade::Relay;
use crate::node::sample::Sample;
use crate::place::Placement;
use crate::side::Side;
use crate::time::Instant;

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
