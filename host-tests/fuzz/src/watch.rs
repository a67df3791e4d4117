//! Relay under test. After every input its output is collected, and the documented guarantees are checked.

mod frames;
mod number;

use uav_relay::GuardConfig;
use uav_relay::MAX_FRAME;
use uav_relay::Upload;
use uav_relay::{
    Event, Identity, Instant, Method, Mission, MissionConfig, Placement, Port, Relay, Sample,
    Settings, Side, Sites, Stats, ViewId,
};

use super::counted::{all, intact};
use super::heap;
use frames::Frames;

pub use frames::NETWORK;

/// Maximum number of frames that a relay may have ready to send at the same time.
///
/// The terms, as in FORMAT.md: message along the chain and busy notice; view decision; lease renewal and its answer;
/// eight messages for each side; claim to a node number and its answer; handshakes for eight nodes.
const MOST_FRAMES: usize = 2 + 1 + 2 + 2 * (1 + 4 + 1 + 2) + 2 + 8;

const MOST_EVENTS: usize = 14;

/// Minimum length of a frame whose CRC a relay computes, bytes on the wire: header and CRC only.
const LEAST_CHECKED: usize = 16;

/// Minimum length of a frame with a message (a Busy message), bytes on the wire.
const LEAST_MESSAGE: usize = 19;

/// Frame sent by a relay.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sent {
    /// Port through which the frame was sent.
    pub port: Port,
    /// Bytes of the frame, with its delimiter.
    pub bytes: Vec<u8>,
}

/// Relay under test, and its state at the last check.
#[derive(Clone, Debug)]
pub struct Watched {
    relay: Relay,
    /// Node number of the relay under test.
    node: u16,
    /// Number of relays in the mission.
    all: u16,
    settings: Settings,
    stats: Stats,
    view: ViewId,
    agreed: Option<Placement>,
    setpoint: Option<Placement>,
    /// Tx and Rx positions in the mission in use, if the mission has any.
    sites: Option<Sites>,
    /// Distance from Tx to Rx in the mission loaded before flight, m.
    loaded_m: f32,
    frames: Frames,
    /// Number of bytes received at each port since the last delimiter.
    begun: [usize; 3],
    /// View and number of the pass from which the relay's agreed position comes; `None` if unknown.
    ///
    /// A view is a membership of the chain. A pass is a message along the chain and back.
    held: Option<(ViewId, u16)>,
    flown: MissionConfig,
}

impl Watched {
    /// Creates the relay `index` of `mission`, started at `now`; `None` if a setting is refused.
    pub fn new(
        mission: Mission,
        index: u16,
        settings: Settings,
        seed: u32,
        now: Instant,
    ) -> Option<Self> {
        let identity = Identity {
            network: NETWORK,
            index,
        };
        let relay =
            heap::without_allocation(|| Relay::new(mission, identity, settings, seed, now)).ok()?;
        Some(Self {
            relay,
            node: index,
            all: mission.relays(),
            settings,
            stats: Stats::default(),
            view: ViewId::LOADED,
            agreed: None,
            setpoint: None,
            sites: None,
            loaded_m: mission.config().distance_m,
            frames: Frames::new(index, mission.relays()),
            begun: [0; 3],
            held: None,
            flown: *mission.config(),
        })
    }

    /// Returns the relay under test.
    pub const fn relay(&self) -> &Relay {
        &self.relay
    }

    /// Returns the settings of the relay under test.
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the number of the last pass (message along the chain and back) in the relay's frames.
    pub const fn number(&self) -> u16 {
        self.frames.number
    }

    /// Returns the session number in the relay's last fence (collision-guard message), 0 for none.
    pub const fn association(&self) -> u16 {
        self.frames.association
    }

    /// Returns the number in the relay's last hello, 0 for none. A mission offer must repeat this number.
    pub const fn offer_number(&self) -> u16 {
        self.frames.asked
    }

    /// Returns view and number of the pass that gave the agreed position.
    ///
    /// A pass is a message along the chain and back.
    ///
    /// `None` if unknown, as always for a relay with a collision guard.
    pub const fn held(&self) -> Option<(ViewId, u16)> {
        self.held
    }

    /// Forgets which pass has given the relay its position. Called when a relay restarts.
    ///
    /// A restarted leader numbers its passes anew, so two passes may have the same number.
    pub const fn forget_pass(&mut self) {
        self.held = None;
    }

    /// Delivers bytes to the relay at `port`.
    ///
    /// # Panics
    /// The relay exceeds its bounds on work: one CRC per 16 received bytes, one decoded message per 19.
    pub fn bytes(&mut self, now: Instant, port: Port, bytes: &[u8]) {
        let before = *self.relay.stats();
        heap::without_allocation(|| self.relay.handle_bytes(now, port, bytes));
        let after = self.relay.stats();
        let Some(begun) = self.begun.get_mut(port as usize) else {
            return;
        };
        let there = *begun + bytes.len();
        let key = self.settings.auth.is_some();
        let checked = intact(after, key) + after.crc - intact(&before, key) - before.crc;
        let received = after.received - before.received;
        assert!(
            LEAST_CHECKED * checked as usize <= there && LEAST_MESSAGE * received as usize <= there,
            "{checked} frames, {received} messages in {there} bytes"
        );
        let ended = bytes.iter().rposition(|&byte| byte == 0);
        *begun = ended.map_or(there, |at| bytes.len() - 1 - at);
    }

    /// Delivers a measurement to the relay, `count` times.
    pub fn sample(&mut self, now: Instant, sample: Sample, count: u8) {
        heap::without_allocation(|| {
            for _ in 0..count {
                self.relay.handle_sample(now, sample);
            }
        });
    }

    /// Reports to the relay at `now` that its drone was at `place` at the time `at`.
    pub fn position(&mut self, now: Instant, at: Instant, place: Placement) {
        heap::without_allocation(|| self.relay.handle_position(now, place, at));
    }

    /// Reports that all lost relays on this `side` of the relay have landed.
    pub fn forget(&mut self, now: Instant, side: Side) {
        heap::without_allocation(|| self.relay.clear_lost(now, side));
    }

    /// Uploads a mission to the relay, which may refuse it.
    pub fn upload(&mut self, now: Instant, upload: &Upload) {
        // The relay refuses an older mission, and without a key any mission.
        _ = heap::without_allocation(|| self.relay.handle_upload(now, upload));
    }

    /// Makes the relay start a new agreement on positions, if it leads the chain.
    pub fn restart(&mut self, now: Instant) {
        heap::without_allocation(|| self.relay.restart(now));
    }

    /// Handles the relay's timeouts, returns its frames and events, and checks its rules.
    ///
    /// # Panics
    /// The relay breaks a rule.
    pub fn settle(&mut self, now: Instant) -> (Vec<Sent>, Vec<Event>) {
        heap::without_allocation(|| self.relay.handle_timeout(now));
        let mut sent = Vec::with_capacity(MOST_FRAMES);
        let mut buffer = [0; MAX_FRAME];
        self.relay.persist(|_| true);
        while let Some(transmit) =
            heap::without_allocation(|| self.relay.poll_transmit(now, &mut buffer))
        {
            let bytes = buffer.get(..transmit.len).unwrap_or_default().to_vec();
            let port = transmit.port;
            self.frames.look(&self.relay, &self.settings, port, &bytes);
            sent.push(Sent { port, bytes });
            assert!(
                sent.len() <= MOST_FRAMES,
                "a relay that never stops sending"
            );
        }
        let more = self.relay.poll_transmit(now, &mut buffer);
        assert_eq!(more, None, "a frame after the last one");
        let mut events = Vec::with_capacity(MOST_EVENTS);
        while let Some(event) = heap::without_allocation(|| self.relay.poll_event()) {
            events.push(event);
            assert!(events.len() <= MOST_EVENTS, "events without end");
        }
        let next = self.relay.poll_timeout();
        assert!(
            next.is_none_or(|at| at > now),
            "{next:?} at {now:?}: it spins"
        );
        self.look_at_view(&events);
        self.look_at_counters();
        self.look_at_setpoint(&events);
        self.look_at_agreed(&events);
        self.look_at_numbers();
        (sent, events)
    }

    /// Checks the relay's view (membership of the chain) and its number.
    ///
    /// View numbers must rise, and each new view must be reported and counted. The relay's index must be in the view.
    /// Node numbers must rise from the upstream neighbour over the relay to the downstream neighbour.
    fn look_at_view(&mut self, events: &[Event]) {
        let (relay, node) = (&self.relay, self.node);
        let (view, left) = (relay.view(), relay.mission().relays());
        assert!(view >= self.view, "{view:?} after {:?}", self.view);
        let counted = relay.stats().views > self.stats.views;
        assert_eq!(counted, view > self.view, "{view:?} in silence");
        let told = events.contains(&Event::ViewAccepted);
        assert_eq!(told, view > self.view, "{view:?}, {events:?}");
        let index = relay.index();
        assert!((1..=left).contains(&index), "place {index} of {left}");
        assert!(left <= self.all, "{left} of {}", self.all);
        let [before, after] = relay.neighbours();
        assert!(before.is_none_or(|before| (1..node).contains(&before)));
        assert!(after.is_none_or(|after| after > node && after <= self.all));
        self.view = view;
    }

    fn look_at_counters(&mut self) {
        let stats = *self.relay.stats();
        let pairs = all(&stats).into_iter().zip(all(&self.stats));
        for (now, before) in pairs {
            assert!(now >= before, "{stats:?} after {:?}", self.stats);
        }
        assert_eq!(stats.sent, self.frames.sent);
        self.stats = stats;
    }

    /// Checks the relay's setpoint, and that each of its changes is reported.
    ///
    /// Without a collision guard the setpoint must be the agreed position. With a guard it must be in the geofence, or
    /// no farther outside than the previous setpoint.
    fn look_at_setpoint(&mut self, events: &[Event]) {
        let setpoint = self.relay.setpoint();
        let told = events.contains(&Event::SetpointChanged);
        assert!(told || setpoint == self.setpoint, "moved in silence");
        // A relay has no setpoint while it is passive, and after its Tx and Rx positions have changed since the last
        // agreement.
        let moved = self.sites != self.relay.sites();
        let silent = self.relay.is_passive() || moved;
        let before = self.setpoint;
        self.setpoint = setpoint.or(self.setpoint.filter(|_| !silent));
        assert_eq!(setpoint, self.setpoint, "a place that was taken away");
        let Some(place) = setpoint else {
            assert!(!told || silent, "told to fly nowhere");
            return;
        };
        if let Some(GuardConfig { mut geofence, .. }) = self.settings.guard {
            if self.relay.sites().is_some() {
                // If the receiver moves away from Tx, the geofence becomes longer.
                let longer_m = self.relay.mission().config().distance_m - self.loaded_m;
                geofence.most_x_m += longer_m;
            }
            // The first setpoint may be anywhere. A setpoint outside of the geofence must not move farther out.
            let before = before.unwrap_or(place);
            for (is, was, least, most) in [
                (place.x_m, before.x_m, geofence.least_x_m, geofence.most_x_m),
                (place.y_m, before.y_m, geofence.least_y_m, geofence.most_y_m),
                (
                    place.altitude_m,
                    before.altitude_m,
                    geofence.least_altitude_m,
                    geofence.most_altitude_m,
                ),
            ] {
                assert!(
                    (least.min(was)..=most.max(was)).contains(&is),
                    "{place:?} outside of {geofence:?}, and before at {before:?}"
                );
            }
        } else {
            assert_eq!(setpoint, self.relay.agreed_place());
        }
    }

    /// Checks the relay's agreed position.
    ///
    /// The position must be between Tx and Rx, in the lateral range, and at an altitude permitted for this relay.
    fn look_at_agreed(&mut self, events: &[Event]) {
        let agreed = self.relay.agreed_place();
        if self.settings.guard.is_none() && events.contains(&Event::SetpointChanged) {
            self.held = Some((self.view, self.frames.number));
        }
        let moved = core::mem::replace(&mut self.sites, self.relay.sites()) != self.relay.sites();
        assert!(
            agreed.is_some() || self.agreed.is_none() || moved,
            "taken away"
        );
        self.agreed = self.agreed.filter(|_| !moved);
        // A position of the previous mission is valid until the next agreement; it may still arrive when the mission
        // changes.
        let flown = core::mem::replace(&mut self.flown, *self.relay.mission().config());
        let Some(place) = agreed.filter(|_| agreed != self.agreed) else {
            return;
        };
        self.agreed = agreed;
        let sound = [flown, self.flown].iter().any(|config| {
            let given = self.settings.profile.unwrap_or(config.common);
            let held = place.altitude_m.to_bits() == given.altitude_m.to_bits();
            let band = config.band.least_m..=config.band.most_m;
            let chosen = !self.settings.hold_altitude && band.contains(&place.altitude_m);
            let beside = config.lateral.least_m..=config.lateral.most_m;
            let on_link = (0.0..=config.distance_m).contains(&place.x_m);
            on_link && beside.contains(&place.y_m) && (held || chosen)
        });
        assert!(sound, "{place:?} in {:?}", self.flown);
    }

    fn look_at_numbers(&self) {
        let sir = |sir: f32| (0.0..=f32::MAX).contains(&sir);
        assert!(
            self.relay.target().is_none_or(sir),
            "{:?}",
            self.relay.target()
        );
        let rounds = self.relay.rounds();
        assert!(rounds.is_none_or(|(_, worst)| sir(worst)), "{rounds:?}");
        if let (Some((done, _)), Method::Adjust(adjust)) = (rounds, self.settings.method) {
            assert!(done <= adjust.rounds.max(1), "{done} rounds");
        }
        assert!(
            self.relay.profile().is_valid(),
            "{:?}",
            self.relay.profile()
        );
        if let Some(estimate) = self.relay.estimate() {
            assert!(estimate.alpha > 1.0 && estimate.alpha.is_finite());
            assert!(estimate.beta > 0.0 && estimate.beta.is_finite());
        }
        let measured = self.relay.measured_per_w();
        assert!(measured.is_none_or(|upsilon| (1e-9..=1e32).contains(&upsilon)));
    }
}
