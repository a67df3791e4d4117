//! State of a running chain, for a screen that shows the flight.

use uav_relay::flight::autopilot::state::State;
use uav_relay::{HoldReason, Instant, Mission, Phase, Placement, Profile, Side};

use super::{Chain, MAX_EVENTS};
use crate::simulator::drones::{Point, point};
use crate::simulator::outcome::Moment;

/// State of a relay during a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LiveRelay {
    /// Number of the relay in the mission, from 1.
    pub number: u16,
    /// True while the relay is switched on.
    pub is_on: bool,
    /// Position of the drone along the line of the relay's mission, m; without drones the setpoint. `None` before the first setpoint.
    pub position: Option<Point>,
    /// Setpoint of the relay.
    pub setpoint: Option<Placement>,
    /// Position on which the chain has agreed for this relay.
    pub agreed: Option<Placement>,
    /// Altitude and power of the relay.
    pub profile: Profile,
    /// Phase of the relay's protocol.
    pub phase: Phase,
    /// Control state of the drone; `None` without autopilots.
    pub control: Option<State>,
    /// Reasons to hold the position, because of the neighbour toward Tx and because of the one toward Rx.
    pub hold_reasons: [Option<HoldReason>; 2],
    /// Numbers of the neighbours, toward Tx and toward Rx.
    pub neighbours: [Option<u16>; 2],
    /// True while the relay is passive because another node has its number.
    pub is_passive: bool,
    /// True if the relay has an interference estimate of its own, instead of that of the mission.
    pub estimates: bool,
}

impl Chain {
    /// Processes all events up to the virtual time `until`, also after the chain has settled. Returns true at the setup's deadline.
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

    /// Returns the present state of every relay, from relay 1.
    pub fn live(&self) -> impl Iterator<Item = LiveRelay> {
        self.members.iter().enumerate().map(|(index, member)| {
            let (relay, vehicle) = (&member.relay, self.fleet.get(index));
            let simple = || self.drone(index).or_else(|| relay.setpoint().map(point));
            LiveRelay {
                number: member.node,
                is_on: member.killed.is_none(),
                position: vehicle.map_or_else(simple, |vehicle| Some(vehicle.along())),
                setpoint: relay.setpoint(),
                agreed: relay.agreed_place(),
                profile: relay.profile(),
                phase: relay.phase(),
                control: vehicle.map(|vehicle| vehicle.link.state()),
                hold_reasons: [Side::Upstream, Side::Downstream]
                    .map(|side| relay.hold_reason(side)),
                neighbours: relay.neighbours(),
                is_passive: relay.is_passive(),
                estimates: relay.interference_estimate().number > 0,
            }
        })
    }
}
