//! Exchange of data between the link and the relay in each turn of a main loop, in a fixed order.

use super::link::Autopilot;
use super::vehicle::Position;
use crate::flight::axis::Axis;
use crate::relay::Relay;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::upload::UPLOAD;

impl Autopilot {
    /// Exchanges data with the relay of the same drone and handles the link's timeouts. Data go in both directions.
    ///
    /// | step | from | to | data | why at this point |
    /// | --- | --- | --- | --- | --- |
    /// | 1 | relay | link | line between the sites of an adopted mission | the positions and the setpoint of later steps are along it |
    /// | 2 | | link | timeouts that are due by `now` | an overdue link releases the drone |
    /// | 3 | link | relay | control state | an engaged relay starts from the first position that it receives afterwards |
    /// | 4 | link | relay | position, sample of the radio's noise, side with cleared lost relays | the relay computes its setpoint from them |
    /// | 5 | relay | link | readiness, hold reasons, setpoint, values for the operator | the link sends the newest ones |
    ///
    /// Call it in each turn of the main loop, after [`handle_bytes`](Self::handle_bytes) and before
    /// [`poll_transmit`](Self::poll_transmit). The relay sends the position in the same turn if its ports are served afterwards. A loop
    /// may call it a second time once they have been served: the link then sends a new setpoint in the same turn. A call that has
    /// nothing new to hand over has no effect.
    ///
    /// Returns true if the relay was handed anything that it did not know, so that its frames, its events and its next timeout may have
    /// changed; and the drone's position, if a new one was handed over. A loop that serves the relay's ports after each call ignores both.
    ///
    /// The caller still hands events of the relay to [`handle_event`](Self::handle_event), because [`Relay::poll_event`] returns each event
    /// once, and [`handle_bearing`](Self::handle_bearing) the bearing of an antenna. The first line is that of [`new`](Self::new); an
    /// exchange replaces a line of [`fly_along`](Self::fly_along).
    ///
    /// Constant work: one call of each input of the relay and of the link, and a new [`Axis`](crate::flight::axis::Axis) when the sites have changed.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::flight::autopilot::carrot::Pace;
    /// use uav_relay::flight::autopilot::{Autopilot, FrameBytes};
    /// use uav_relay::flight::axis::Axis;
    /// use uav_relay::{Geodetic, Instant, Relay, Settings};
    ///
    /// /// Runs one turn of the main loop. Returns the time of the next turn.
    /// fn turn(
    ///     link: &mut Autopilot,
    ///     relay: &mut Relay,
    ///     now: Instant,
    ///     received: &[u8],
    ///     mut send: impl FnMut(FrameBytes),
    /// ) -> Instant {
    ///     link.handle_bytes(now, received);
    ///     link.exchange(relay, now);
    ///     while let Some(frame) = link.poll_transmit(now) {
    ///         send(frame);
    ///     }
    ///     link.poll_timeout(now)
    /// }
    ///
    /// let site = |lat, lon, amsl| Geodetic::from_degrees(lat, lon, amsl).expect("a place on earth");
    /// let axis = Axis::try_new(site(47.40, 8.54, 420.0), site(47.41, 8.55, 431.0))?;
    /// let (mut link, mut relay) = (Autopilot::new(axis, Pace::default(), Instant::ZERO), relay(Settings::default()));
    /// let mut frames = 0;
    /// let next = turn(&mut link, &mut relay, Instant::ZERO, &[], |_| frames += 1);
    /// assert_eq!(frames, 1, "a heartbeat");
    /// assert!(next > Instant::ZERO);
    /// # Ok::<(), uav_relay::flight::axis::AxisError>(())
    /// ```
    #[inline(never)] // called from two places of a firmware's loop; its stack frame is released
    pub fn exchange(&mut self, relay: &mut Relay, now: Instant) -> (bool, Option<Position>) {
        self.follow(relay, now);
        self.handle_timeout(now);
        let mut is_news = relay.control(now, self.is_flown());
        let position = self.poll_position();
        if let Some(Position { at, place, .. }) = position {
            relay.handle_position(now, at, place);
            is_news = true;
        }
        if let Some(sample) = self.poll_sample() {
            relay.handle_sample(now, sample);
            is_news = true;
        }
        if let Some(side) = self.poll_cleared() {
            relay.clear_lost(now, side);
            is_news = true;
        }
        let setpoint = relay.setpoint();
        self.handle_ready(now, relay.is_ready());
        let holds = [Side::Upstream, Side::Downstream].map(|side| relay.hold_reason(side));
        self.handle_hold(now, holds);
        self.handle_setpoint(now, setpoint);
        let sir_db = relay.target().map(|target| 10.0 * libm::log10f(target));
        self.handle_values(now, sir_db, setpoint);
        (is_news, position)
    }

    /// Switches to the line between the sites of the relay's mission.
    #[inline(never)] // its stack frame is released
    fn follow(&mut self, relay: &Relay, now: Instant) {
        let sites = relay.sites().unwrap_or(self.loaded);
        // The relay has checked that its sites form a valid line.
        if UPLOAD
            && sites != self.axis.sites()
            && let Ok(axis) = Axis::between(sites)
        {
            self.fly_along(now, axis);
        }
    }
}
