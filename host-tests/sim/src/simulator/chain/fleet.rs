//! Drones with autopilots: each step they fly on and talk with the links of their relays, which say where to fly and hear where they are.

use uav_relay::flight::autopilot::AutopilotEvent;
use uav_relay::flight::autopilot::state::State;
use uav_relay::guard::HoldReason;
use uav_relay::{Duration, Instant, Side};

use super::super::drones::{Nearest, Point, apart};
use super::super::fleet::Vehicle;
use super::super::outcome::Turning;
use super::super::queue::Happening;
use super::flight::point;
use super::state::Chain;

/// Between two steps of the flight.
const STEP: Duration = Duration::from_millis(50);

/// A drone is at its place if it is no farther from it than that, m.
const THERE_M: f64 = 1.0;

/// The pilot of a drone whose relay is silent lands it after so long.
const LANDS_AFTER: Duration = Duration::from_millis(30_000);

impl Chain {
    /// Puts the drones on the ground, where there are any.
    pub(super) fn line_up(&mut self) {
        if let Some(spec) = &self.setup.fleet {
            let all = 0..self.members.len();
            self.fleet = all
                .map(|index| Vehicle::new(spec, index, self.setup.seed))
                .collect();
            self.queue.put(Instant::ZERO, 0, Happening::Fly);
        }
    }

    /// All fly on for a step.
    pub(super) fn fly_fleet(&mut self) {
        for index in 0..self.fleet.len() {
            self.drive(index);
        }
        let flying = self.fleet.iter().filter(|vehicle| vehicle.flies());
        let places: Vec<Point> = flying.map(Vehicle::at).collect();
        self.keep(Nearest::of(&places, self.now));
        self.queue.put(self.now + STEP, 0, Happening::Fly);
    }

    /// One drone flies on, and talks with its relay's link: as a firmware's loop does, unless that is off.
    fn drive(&mut self, index: usize) {
        let now = self.now;
        #[expect(clippy::cast_precision_loss, reason = "some milliseconds")]
        let step_s = STEP.as_micros() as f64 / 1e6;
        let (Some(vehicle), Some(member)) =
            (self.fleet.get_mut(index), self.members.get_mut(index))
        else {
            return;
        };
        let flew = vehicle.flies();
        vehicle.go_on(now, step_s);
        if let Some(at) = member.killed {
            if now.since(at) >= LANDS_AFTER {
                vehicle.land();
            }
            if flew && !vehicle.flies() {
                self.clear_lost();
            }
            return;
        }
        vehicle.link.handle_setpoint(now, member.relay.setpoint());
        vehicle.link.handle_timeout(now);
        while let Some(frame) = vehicle.link.poll_transmit(now) {
            vehicle.hear(now, &frame);
        }
        let mut has_said = false;
        while let Some(position) = vehicle.link.poll_position() {
            member
                .relay
                .handle_position(now, position.at, position.place);
            has_said = true;
        }
        let mut turnings = Vec::new();
        while let Some(event) = vehicle.link.poll_event() {
            match event {
                AutopilotEvent::Restarted => turnings.push(Turning::Restarted),
                AutopilotEvent::State(State::Engaged) => turnings.push(Turning::Engaged),
                AutopilotEvent::State(State::Blind) => turnings.push(Turning::Blind),
                AutopilotEvent::State(State::Standby) if member.lent => {
                    turnings.push(Turning::Released);
                }
                _ => {}
            }
        }
        member.lent = vehicle.link.is_flown();
        for turning in turnings {
            self.tell(index, turning, None);
        }
        if has_said {
            self.drain(index);
        }
    }

    /// The drone of a silent relay has landed: an operator tells those that keep away from where it was.
    fn clear_lost(&mut self) {
        for index in 0..self.members.len() {
            for side in [Side::Upstream, Side::Downstream] {
                if let Some(member) = self.members.get_mut(index)
                    && member.relay.hold_reason(side) == Some(HoldReason::Lost)
                {
                    member.relay.clear_lost(self.now, side);
                }
            }
            self.drain(index);
        }
    }

    pub(super) fn restart_autopilot(&mut self, index: usize) {
        self.ahead -= 1;
        if let Some(vehicle) = self.fleet.get_mut(index) {
            vehicle.restart(self.now);
        }
    }

    /// Whether every drone that its pilot has lent to a relay that is on hovers at that relay's place.
    pub(super) fn all_hover(&self) -> bool {
        let lent = self.members.iter().zip(&self.fleet);
        lent.filter(|(member, vehicle)| member.killed.is_none() && vehicle.is_lent(self.now))
            .all(|(member, vehicle)| {
                let agreed = member.relay.final_setpoint();
                let there = agreed.is_some_and(|place| apart(point(place), vehicle.at()) < THERE_M);
                vehicle.link.is_flown() && there
            })
    }
}
