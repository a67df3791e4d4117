//! Commands and counters of one relay as plain data, and rules that no relay may break on its own.

use proptest::{prop_assert, prop_assert_eq};
use uav_relay::wire::message::Message;
use uav_relay::{
    Duration, Event, Instant, Method, Phase, Placement, Profile, Relay, Settings, Side, Stats,
    ViewId, ViewRecord,
};
use uav_relay_oracle::reference::joint::Place;

use super::Checked;
use super::accepted_frames::{AcceptedFrames, accepted_count, refused_count};
use super::scenario::Scenario;
use super::signs::{LONGEST, QUESTIONS, Signs};
use super::wires::{Ended, Flying, message};

/// Maximum number of frames that a relay sends in one turn of its main loop.
///
/// These are a pass (a message that travels along the chain), a `Busy`, a decision, two frames for a lease renewal,
/// and a heartbeat and a hello on each side.
pub(crate) const MOST_FRAMES: u32 = 9;

/// Model of one relay: its state as observed since it was switched on.
#[derive(Debug)]
pub(crate) struct Ledger {
    /// Last setpoint of the relay; `None` before the first.
    pub(crate) place: Option<Place>,
    pub(crate) target: Option<f32>,
    pub(crate) holding: bool,
    stats: Stats,
    sent: u32,
    ended: Ended,
    refused: u32,
    signs: [Signs; 2],
    /// Longest lease granted to the relay so far; at least `dead_after`.
    longest: Duration,
    /// Membership view that the relay has accepted; 0 after each start.
    pub(crate) view: ViewId,
    /// Number of the last pass (round of messages along the chain) accepted in this membership view. `None` before
    /// the first.
    pub(crate) pass: Option<u16>,
    /// Number of the last pass (round of messages along the chain) of the relay before each of its reboots.
    pub(crate) passes_before: Vec<u16>,
    /// Largest Upsilon = E[1/I] (I is the interference power) that the relay has ever measured, 1/W.
    ///
    /// `None` before the first measurement. Measurements from before its reboots count, too.
    pub(crate) measured_per_w: Option<f64>,
    /// Epoch of the relay since its last start: at least 1, increasing, different for all relays.
    pub(crate) epoch: u32,
    /// Record of the relay's votes in its flash, after the last vote; `None` before the first vote.
    pub(crate) record: Option<ViewRecord>,
    /// Signed frames that the relay has accepted since its last start.
    accepted: AcceptedFrames,
}

/// Returns the shortest interval of heartbeat requests to a neighbour. The channel's capacity limits it.
fn tick(settings: &Settings, relays: usize) -> Duration {
    let span = settings.dead_after.as_micros() - settings.probe_after.as_micros();
    let round = 2 * relays as u64 * settings.hop_time.as_micros();
    Duration::from_micros(round.clamp(span / 64 + 1, span / QUESTIONS as u64))
}

/// Returns the longest interval of heartbeat requests to a neighbour, from the shortest one, `tick`.
fn spread(tick: Duration) -> Duration {
    Duration::from_micros(tick.as_micros() + tick.as_micros() / 8 + 1)
}

/// Outputs of one turn of a relay's main loop.
pub(crate) struct Turn<'a> {
    pub(crate) now: Instant,
    pub(crate) relay: &'a Relay,
    pub(crate) sent: u32,
    pub(crate) events: &'a [Event],
    /// Largest Upsilon = E[1/I] (I is the interference power) that any relay has measured, if any, 1/W.
    pub(crate) measured_per_w: Option<f64>,
}

fn side(of: Side) -> usize {
    usize::from(of == Side::Downstream)
}

fn to_f64(place: Placement) -> Place {
    Place::in_plane(f64::from(place.x_m), f64::from(place.altitude_m))
}

impl Ledger {
    pub(crate) fn new(now: Instant, epoch: u32) -> Self {
        Self {
            place: None,
            target: None,
            holding: false,
            stats: Stats::default(),
            sent: 0,
            ended: Ended::default(),
            refused: 0,
            signs: [now; 2].map(Signs::new),
            longest: Duration::from_micros(0),
            view: ViewId::LOADED,
            pass: None,
            passes_before: Vec::new(),
            measured_per_w: None,
            epoch,
            record: None,
            accepted: AcceptedFrames::default(),
        }
    }

    /// Resets the model of a relay after a reboot, in which the relay loses all but its flash.
    pub(crate) fn reboot(&mut self, now: Instant, epoch: u32) {
        let mut passes_before = core::mem::take(&mut self.passes_before);
        passes_before.extend(self.pass);
        *self = Self {
            passes_before,
            measured_per_w: self.measured_per_w,
            record: self.record,
            ..Self::new(now, epoch)
        };
    }

    /// Records frames that the relay received from the neighbour at `from`. `taken` is the frame that the relay
    /// accepted, if any.
    pub(crate) fn on_received(
        &mut self,
        from: Side,
        ended: Ended,
        taken: Option<&Flying>,
        (settings, relays): (&Settings, usize),
        now: Instant,
    ) -> Checked {
        self.ended.intact += ended.intact;
        self.ended.broken += ended.broken;
        let Some(frame) = taken else {
            return Ok(());
        };
        let Flying { bytes, seal, .. } = frame;
        prop_assert!(ended.intact > 0, "a broken frame is taken");
        let tick = tick(settings, relays);
        if settings.auth.is_some() {
            self.accepted.accept(side(from), bytes, *seal, self.epoch)?;
        }
        if let Some(message) = message(bytes) {
            self.signs[side(from)].on_received(&message, tick, now);
            self.leased(&message);
        }
        Ok(())
    }

    /// Records a message that the relay sends to its neighbour at `to`.
    pub(crate) fn on_sent(&mut self, to: Side, message: &Message, now: Instant) {
        if let Message::Heartbeat { request: 1.., .. } = message {
            self.signs[side(to)].on_request(message, now);
        }
        self.leased(message);
    }

    fn leased(&mut self, message: &Message) {
        if let Message::Pulse(pulse) = message {
            let lease = Duration::from_millis(100 * u64::from(pulse.lease));
            self.longest = self.longest.max(lease);
        }
    }

    /// Counts `samples` interference samples that the relay received but does not use.
    pub(crate) fn refuses(&mut self, samples: u32) {
        self.refused += samples;
    }

    /// Checks a turn of the main loop of relay `at`, from 0. Returns true if its setpoint, target or phase has
    /// changed.
    pub(crate) fn audit(&mut self, scenario: &Scenario, at: usize, turn: &Turn) -> Checked<bool> {
        let before = (self.place, self.target, self.holding);
        self.sent += turn.sent;
        self.form(scenario, at, turn)?;
        self.measure(turn.relay);
        self.follow(turn)?;
        self.bounds(scenario, at)?;
        self.check_target(scenario, turn)?;
        self.count(scenario, turn.relay.stats())?;
        self.miss(scenario, at, turn)?;
        Ok(before != (self.place, self.target, self.holding))
    }

    /// Checks that every membership view of the relay contains all relays of the mission. The relay must report each
    /// new view.
    fn form(&self, scenario: &Scenario, at: usize, turn: &Turn) -> Checked {
        let Turn { relay, events, .. } = turn;
        let own = at as u16 + 1;
        let all = scenario.mission.relays();
        prop_assert_eq!((relay.index(), relay.mission().relays()), (own, all));
        let next_to = [own.checked_sub(1).filter(|&node| node > 0), Some(own + 1)];
        let [before, after] = next_to;
        let beside = [before, after.filter(|&node| node <= all)];
        prop_assert_eq!(relay.neighbours(), beside);
        let views = relay.stats().views;
        let told = events.contains(&Event::ViewAccepted);
        prop_assert_eq!(told, views > self.stats.views, "a view in silence");
        prop_assert!(relay.view().number() >= views);
        prop_assert!(!events.contains(&Event::NoQuorum), "everybody is there");
        Ok(())
    }

    fn measure(&mut self, relay: &Relay) {
        let measured = relay.measured_per_w().map(f64::from);
        self.measured_per_w = measured
            .into_iter()
            .chain(self.measured_per_w)
            .reduce(f64::max);
    }

    /// Checks that a relay never loses its setpoint, and reports each change of the setpoint by an event.
    fn follow(&mut self, turn: &Turn) -> Checked {
        let place = turn.relay.setpoint().map(to_f64);
        let told = turn.events.contains(&Event::SetpointChanged);
        prop_assert!(
            place.is_some() || self.place.is_none(),
            "a setpoint is lost"
        );
        prop_assert!(
            told || place == self.place,
            "moved to {place:?}, and said nothing"
        );
        prop_assert!(place.is_some() || !told, "told to fly nowhere");
        self.place = place;
        Ok(())
    }

    /// Checks that the setpoint is finite, between Tx and Rx, and within the relay's altitude limits.
    fn bounds(&self, scenario: &Scenario, at: usize) -> Checked {
        let Some(place) = self.place else {
            return Ok(());
        };
        let config = scenario.mission.config();
        let Settings {
            profile,
            method,
            hold_altitude,
            ..
        } = scenario.settings[at];
        let Profile { altitude_m, .. } = profile.unwrap_or(config.common);
        let given = place.altitude_m.total_cmp(&f64::from(altitude_m)).is_eq();
        let band = f64::from(config.band.least_m)..=f64::from(config.band.most_m);
        let chosen = method != Method::Align && !hold_altitude && band.contains(&place.altitude_m);
        prop_assert!(
            (0.0..=f64::from(config.distance_m)).contains(&place.x_m),
            "relay {} flies to {place:?}",
            at + 1
        );
        prop_assert!(given || chosen, "relay {} flies to {place:?}", at + 1);
        Ok(())
    }

    /// Checks that a relay has an agreed position only for a target SIR that the chain can meet.
    fn check_target(&mut self, scenario: &Scenario, turn: &Turn) -> Checked {
        let Turn { relay, events, .. } = turn;
        let target = relay.target();
        prop_assert_eq!(
            target.is_some(),
            self.place.is_some(),
            "a target without a place"
        );
        self.holding = relay.phase() == Phase::Holding;
        prop_assert!(target.is_some() || !self.holding, "holds, but nothing");
        let altitude = relay.setpoint().map(|place| place.altitude_m.to_bits());
        prop_assert!(
            !self.holding || altitude == Some(relay.profile().altitude_m.to_bits()),
            "holds a place at another altitude than its own"
        );
        prop_assert!(
            target.is_some() || !events.contains(&Event::Converged),
            "converged on nothing"
        );
        prop_assert!(
            !events.contains(&Event::Infeasible),
            "gave up, with something to meet"
        );
        if target != self.target
            && let Some(target) = target
        {
            let measured = [self.measured_per_w, turn.measured_per_w];
            let measured = measured.into_iter().flatten().reduce(f64::max);
            prop_assert!(
                scenario.reference.can_meet(f64::from(target), measured),
                "no chain meets {target:e}"
            );
        }
        self.target = target;
        Ok(())
    }

    /// Checks that statistics counters never fall, and that each complete frame is counted once.
    fn count(&mut self, scenario: &Scenario, stats: &Stats) -> Checked {
        let rising = [self.stats, *stats].map(|stats| {
            [
                stats.sent,
                stats.repeats,
                stats.passes_begun,
                stats.received,
                stats.repeated,
                stats.view,
                stats.views,
                stats.stale,
                stats.rejected(),
            ]
        });
        prop_assert!(
            rising[0]
                .iter()
                .zip(&rising[1])
                .all(|(old, new)| old <= new),
            "a counter has fallen: {rising:?}"
        );
        prop_assert_eq!(stats.sent, self.sent);
        let refused = refused_count(stats);
        prop_assert_eq!(
            accepted_count(stats) + refused,
            self.ended.intact,
            "intact frames"
        );
        prop_assert!(scenario.signs() || refused == 0, "refused: {}", refused);
        prop_assert_eq!(
            stats.oversized + stats.truncated + stats.crc,
            self.ended.broken,
            "broken frames"
        );
        let never = [
            stats.overheard,
            stats.version,
            stats.unsigned,
            stats.malformed,
            stats.foreign,
            stats.misaddressed,
            stats.misdirected,
            stats.mission,
        ];
        prop_assert_eq!(
            never,
            [0; 8],
            "from neighbours of the same mission on links of their own"
        );
        prop_assert!(stats.repeated + stats.view + stats.stale <= stats.received);
        prop_assert_eq!(stats.samples_rejected, self.refused);
        self.stats = *stats;
        Ok(())
    }

    /// Checks that a relay sends heartbeat requests to a neighbour that is silent for `probe_after`. A neighbour must
    /// be reported as lost after enough unanswered requests, or after a silence as long as the longest possible lease.
    fn miss(&mut self, scenario: &Scenario, at: usize, turn: &Turn) -> Checked {
        let there = [at > 0, at + 1 < scenario.relays()];
        for event in turn.events {
            match event {
                Event::NeighbourLost { side: of, .. } => {
                    let signs = &mut self.signs[side(*of)];
                    let silence = turn.now.since(signs.certainly_alive);
                    prop_assert!(
                        silence >= scenario.settings[at].dead_after,
                        "missed too soon by relay {}",
                        at + 1
                    );
                    signs.missed = true;
                }
                Event::NeighbourBack { side: of, .. } => self.signs[side(*of)].missed = false,
                Event::MissionMismatch { .. } => prop_assert!(false, "all fly one mission"),
                _ => {}
            }
        }
        let settings = &scenario.settings[at];
        let tick = spread(tick(settings, scenario.relays()));
        let longest = settings.dead_after.times(LONGEST);
        let most = self.longest.max(settings.dead_after);
        for (signs, there) in self.signs.iter().zip(there) {
            // Silence is excused while the relay solves the chain.
            let looks = there && settings.method != Method::Joint;
            let idle = !looks || signs.missed;
            let asked = signs.asked.last().map_or(signs.last, |(_, asked)| *asked);
            // A relay checks once per tick whether a request is due. A late request shows only in a turn for another
            // reason.
            let due = (signs.possibly_alive + settings.probe_after).max(signs.last) + tick;
            // Signed requests wait for the handshake.
            prop_assert!(
                idle || scenario.signs() || turn.now <= due.max(asked + tick),
                "not asked by relay {}: {signs:?}",
                at + 1
            );
            let last = (signs.possibly_alive + longest.max(most)).max(signs.last + tick) + tick;
            let misses = turn.now >= last || signs.is_to_be_missed(most, longest);
            prop_assert!(idle || !misses, "not missed by relay {}: {signs:?}", at + 1);
        }
        Ok(())
    }

    pub(crate) fn misses_nobody(&self) -> bool {
        self.signs.iter().all(|signs| !signs.missed)
    }
}
