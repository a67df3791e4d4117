//! What one relay was told and has counted, as plain data, and what may never happen to a relay by itself.

use proptest::{prop_assert, prop_assert_eq};
use uav_relay::{Event, Instant, Method, Phase, Placement, Profile, Relay, Settings, Side, Stats};
use uav_relay_oracle::reference::joint::Place;

use super::Checked;
use super::scenario::Scenario;
use super::seal::{Taken, refused, taken};
use super::wires::{Ended, Flying};

/// The most frames that one drain may give: a pass or what came of one, "busy", and to each side a sign of life and a hello.
pub(crate) const MOST_FRAMES: u32 = 6;

/// One relay, by what it has said since it was switched on.
#[derive(Debug)]
pub(crate) struct Ledger {
    /// Where it was told to fly.
    pub(crate) place: Option<Place>,
    pub(crate) target: Option<f32>,
    pub(crate) holding: bool,
    stats: Stats,
    sent: u32,
    ended: Ended,
    refused: u32,
    heard: [Instant; 2],
    /// Neighbours that have been silent for too long, and those that the relay has said so of.
    missed: [bool; 2],
    noticed: [bool; 2],
    /// The view of the chain that it has agreed to, from 0 in every life.
    pub(crate) view: u16,
    /// The last pass of that view that it took part in.
    pub(crate) pass: Option<u16>,
    /// The last ones of its lives before.
    pub(crate) passes_before: Vec<u16>,
    /// The largest Upsilon that it has measured, 1/W, in this life or in one before.
    pub(crate) measured_per_w: Option<f64>,
    /// Of this life: 1 and up, larger in each, and no two relays' are the same.
    pub(crate) epoch: u32,
    /// The frames that it has taken.
    taken: Taken,
}

/// What one turn of a relay's main loop gave.
pub(crate) struct Turn<'a> {
    pub(crate) now: Instant,
    pub(crate) relay: &'a Relay,
    pub(crate) sent: u32,
    pub(crate) events: &'a [Event],
    /// The largest Upsilon that any other relay has measured, 1/W.
    pub(crate) measured_per_w: Option<f64>,
}

/// The number of a side in a pair.
fn side(of: Side) -> usize {
    usize::from(of == Side::Downstream)
}

fn as_told(place: Placement) -> Place {
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
            heard: [now; 2],
            missed: [false; 2],
            noticed: [false; 2],
            view: 0,
            pass: None,
            passes_before: Vec::new(),
            measured_per_w: None,
            epoch,
            taken: Taken::default(),
        }
    }

    /// The relay has been switched off and on again: it has forgotten everything.
    pub(crate) fn reboot(&mut self, now: Instant, epoch: u32) {
        let mut passes_before = core::mem::take(&mut self.passes_before);
        passes_before.extend(self.pass);
        *self = Self {
            passes_before,
            measured_per_w: self.measured_per_w,
            ..Self::new(now, epoch)
        };
    }

    /// Frames have ended at the relay that came from the neighbour at `from`, and perhaps one was taken.
    pub(crate) fn heard(
        &mut self,
        from: Side,
        ended: Ended,
        taken: Option<&Flying>,
        signs: bool,
        now: Instant,
    ) -> Checked {
        self.ended.intact += ended.intact;
        self.ended.broken += ended.broken;
        let Some(frame) = taken else {
            return Ok(());
        };
        let Flying { bytes, seal, .. } = frame;
        prop_assert!(ended.intact > 0, "a broken frame is taken");
        if !signs || self.taken.take(side(from), bytes, *seal, self.epoch)? {
            self.heard[side(from)] = now;
            self.missed[side(from)] = false;
        }
        Ok(())
    }

    /// Samples were given to a relay that has no use for them.
    pub(crate) fn refuses(&mut self, samples: u32) {
        self.refused += samples;
    }

    /// Holds a turn of relay `at`, from 0, against the rules; whether it stands, aims or holds otherwise than before it.
    pub(crate) fn audit(&mut self, scenario: &Scenario, at: usize, turn: &Turn) -> Checked<bool> {
        let before = (self.place, self.target, self.holding);
        self.sent += turn.sent;
        self.form(scenario, at, turn)?;
        self.measure(turn.relay);
        self.follow(turn)?;
        self.bounds(scenario, at)?;
        self.aim(scenario, turn)?;
        self.count(scenario, turn.relay.stats())?;
        self.miss(scenario, at, turn)?;
        Ok(before != (self.place, self.target, self.holding))
    }

    /// The chain has the same relays in every view: each knows its place, and tells of the views it comes to.
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
        let told = events.contains(&Event::Reformed);
        prop_assert_eq!(told, views > self.stats.views, "a view in silence");
        prop_assert!(u32::from(relay.view()) >= views);
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

    /// A setpoint is never lost, and moves only where the firmware is told.
    fn follow(&mut self, turn: &Turn) -> Checked {
        let place = turn.relay.setpoint().map(as_told);
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

    /// A setpoint is finite, between Tx and Rx, and at an altitude the relay may have.
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

    /// A relay holds a place for a target, one that the chain can meet, and says that it is agreed on only then.
    fn aim(&mut self, scenario: &Scenario, turn: &Turn) -> Checked {
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
                scenario.judge.may_meet(f64::from(target), measured),
                "no chain meets {target:e}"
            );
        }
        self.target = target;
        Ok(())
    }

    /// Counters never fall, and each frame that has ended is counted once.
    fn count(&mut self, scenario: &Scenario, stats: &Stats) -> Checked {
        let rising = [self.stats, *stats].map(|stats| {
            [
                stats.sent,
                stats.repeats,
                stats.sweeps,
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
        let refused = refused(stats);
        prop_assert_eq!(taken(stats) + refused, self.ended.intact, "intact frames");
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
        prop_assert_eq!(stats.samples_refused, self.refused);
        self.stats = *stats;
        Ok(())
    }

    /// A neighbour is missed from the moment it has been silent for `Settings::dead_after` until it is heard.
    fn miss(&mut self, scenario: &Scenario, at: usize, turn: &Turn) -> Checked {
        let there = [at > 0, at + 1 < scenario.relays()];
        for event in turn.events {
            match event {
                Event::NeighbourLost { side: of, .. } => self.noticed[side(*of)] = true,
                Event::NeighbourBack { side: of, .. } => self.noticed[side(*of)] = false,
                Event::MissionMismatch { .. } => prop_assert!(false, "all fly one mission"),
                _ => {}
            }
        }
        for of in [0, 1] {
            let silence = turn.now.since(self.heard[of]);
            self.missed[of] |= there[of] && silence >= scenario.settings[at].dead_after;
        }
        if scenario.settings[at].method == Method::Joint {
            // While it solves the chain, silence is excused: it misses nobody too soon.
            let soon = (self.noticed[0] && !self.missed[0]) || (self.noticed[1] && !self.missed[1]);
            prop_assert!(!soon, "neighbours of relay {}", at + 1);
        } else {
            prop_assert_eq!(self.noticed, self.missed, "neighbours of relay {}", at + 1);
        }
        Ok(())
    }

    pub(crate) fn misses_nobody(&self) -> bool {
        self.missed == [false; 2]
    }
}
