//! State of a running chain, for a screen that shows the flight.

use uav_relay::{Instant, Mission, Profile, Relay, Report, Side};

use super::{Chain, MAX_EVENTS};
use crate::simulator::drones::{placement, point};
use crate::simulator::outcome::Moment;

/// State of a relay during a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LiveRelay {
    /// Present state of the relay in the form of a telemetry report. If no drones are simulated, the setpoint is given
    /// as the position.
    pub report: Report,
    /// True while the relay is switched on.
    pub is_on: bool,
    /// True while the relay is passive because a second node uses its number.
    pub is_passive: bool,
    /// Altitude and power of the relay.
    pub profile: Profile,
    /// True if the relay uses an estimate of the interference instead of the mission's interference.
    pub estimates: bool,
}

impl Chain {
    /// Processes all events up to the virtual time `until`, also after relays have agreed on positions. Returns true
    /// once the run has reached the setup's deadline or the limit on the number of events.
    pub fn advance(&mut self, until: Instant) -> bool {
        let by = until.min(self.setup.deadline);
        while self.events < MAX_EVENTS
            && let Some((at, relay, event)) = self.queue.take_by(by)
        {
            self.process(at, relay, event);
        }
        let has_ended = until >= self.setup.deadline || self.events >= MAX_EVENTS;
        if has_ended {
            self.end_soak(Instant::from_micros(u64::MAX));
        }
        has_ended
    }

    /// Applies `input` to relay `number` (from 1) at the time `now`, and handles the relay's outputs.
    ///
    /// This simulates an input by the relay's firmware. The chain must have been advanced to `now`.
    pub fn input(&mut self, now: Instant, number: u16, input: impl FnOnce(&mut Relay)) {
        self.now = now;
        let index = usize::from(number).saturating_sub(1);
        if let Some(member) = self.members.get_mut(index) {
            input(&mut member.relay);
        }
        self.drain(index);
    }

    /// Returns the log of the run so far.
    pub fn moments(&self) -> &[Moment] {
        &self.outcome.moments
    }

    /// Returns the mission that the chain flies.
    ///
    /// It is the mission of the first relay that is on and has an agreed position.
    ///
    /// Without such a relay it is the mission loaded at the start.
    pub fn mission(&self) -> &Mission {
        let on = self.members.iter().filter(|member| member.killed.is_none());
        let mut agreed = on.filter(|member| member.relay.agreed_place().is_some());
        agreed
            .next()
            .map_or(&self.setup.mission, |member| member.relay.mission())
    }

    /// Returns the state of every relay at the present time `now`, from relay 1.
    pub fn live(&self, now: Instant) -> impl Iterator<Item = LiveRelay> {
        self.members.iter().enumerate().map(move |(index, member)| {
            let (relay, vehicle) = (&member.relay, self.fleet.get(index));
            let simple = || self.drone(index).or_else(|| relay.setpoint().map(point));
            let report = Report {
                relay: member.node,
                at: now,
                position: vehicle
                    .map_or_else(simple, |vehicle| Some(vehicle.along()))
                    .map(placement),
                setpoint: relay.setpoint(),
                agreed: relay.agreed_place(),
                phase: relay.phase(),
                holds_lease: relay.lease().is_some(),
                control: vehicle.map(|vehicle| vehicle.link.state()),
                hold_reasons: [Side::Upstream, Side::Downstream]
                    .map(|side| relay.hold_reason(side)),
                neighbours: relay.neighbours(),
                silent: [false; 2],
                is_duplicated: false,
                refuses_setpoint: false,
                other_mission: None,
                other_key: None,
                old_epoch: None,
                interference_w: None,
                version: Some(relay.version()),
            };
            LiveRelay {
                report,
                is_on: member.killed.is_none(),
                is_passive: relay.is_passive(),
                profile: relay.profile(),
                estimates: relay.interference_estimate().number > 0,
            }
        })
    }
}
