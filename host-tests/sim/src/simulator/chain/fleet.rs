//! Drones with autopilots: time steps, MAVLink exchange with the relays, and distances.

use uav_relay::flight::autopilot::AutopilotEvent;
use uav_relay::flight::autopilot::state::State;
use uav_relay::{Departure, Duration, HoldReason, Instant, Side};

use super::{Chain, LANDS_AFTER, Member, QueuedEvent};
use crate::simulator::drones::{Flight, Nearest, Point, apart, placement, point};
use crate::simulator::fleet::Vehicle;
use crate::simulator::outcome::TimelineEvent;

/// Time step of the simulation of drones with autopilots.
const STEP: Duration = Duration::from_millis(50);

/// Distance of a drone from its agreed position below which it counts as arrived, m.
const ARRIVED_M: f64 = 1.0;

/// Period of the simulated operator's checks for landed drones whose relays were lost.
const LOOKS: Duration = Duration::from_millis(5_000);

/// Least distance from moving drones at a hand-over, m, in addition to the mission's separation.
///
/// A pilot hands a drone over to its relay only if no moving drone is nearer than the sum of the two distances.
const TRAFFIC_M: f64 = 30.0;

impl Chain {
    /// Creates the setup's drones with autopilots, if any, on the ground. Schedules their first time step.
    pub(super) fn line_up(&mut self) {
        if let Some(spec) = &self.setup.fleet {
            let all = 0..self.members.len();
            self.fleet = all
                .map(|index| Vehicle::new(spec, index, self.setup.seed))
                .collect();
            self.queue.put(Instant::ZERO, 0, QueuedEvent::Fly);
        }
    }

    pub(super) fn fly_fleet(&mut self) {
        self.update_traffic();
        for index in 0..self.fleet.len() {
            self.drive(index);
        }
        let flying = self.fleet.iter().filter(|vehicle| vehicle.flies());
        let places: Vec<Point> = flying.map(Vehicle::at).collect();
        self.keep(Nearest::of(&places, self.now));
        let controlled = self
            .fleet
            .iter()
            .filter(|vehicle| vehicle.is_automatic(self.now));
        let places: Vec<Point> = controlled.map(Vehicle::at).collect();
        let nearest = Nearest::of(&places, self.now);
        let least = |known: Option<Nearest>| known.map_or(f64::INFINITY, |it| it.apart_m);
        if least(nearest) < least(self.outcome.nearest_lent) {
            self.outcome.nearest_lent = nearest;
        }
        self.measure_pairs();
        self.outcome.stray_targets = self.fleet.iter().map(|vehicle| vehicle.strays).sum();
        if self.now.as_micros().is_multiple_of(LOOKS.as_micros()) {
            self.clear_lost_neighbours();
        }
        self.queue.put(self.now + STEP, 0, QueuedEvent::Fly);
    }

    /// Updates `margin_m` of the outcome: the smallest margin of the distance between two drones.
    ///
    /// The margin is the distance minus the mission's separation, or minus the distance at which both drones came under
    /// automatic control, if that is smaller. Only flying drones that no pilot controls count.
    fn measure_pairs(&mut self) {
        let separation_m = f64::from(self.setup.mission.config().min_separation_m);
        let count = self.fleet.len();
        self.handed_over_m.resize(count * count, None);
        for (index, one) in self.fleet.iter().enumerate() {
            for (other, beside) in self.fleet.iter().enumerate().skip(index + 1) {
                let Some(begun) = self.handed_over_m.get_mut(index * count + other) else {
                    continue;
                };
                if !one.is_automatic(self.now) || !beside.is_automatic(self.now) {
                    *begun = None;
                    continue;
                }
                let apart_m = apart(one.at(), beside.at());
                let least_m = begun.get_or_insert(apart_m).min(separation_m);
                if apart_m - least_m < self.outcome.margin_m {
                    self.outcome.margin_m = apart_m - least_m;
                    self.outcome.margin_at = Some(Nearest {
                        apart_m,
                        pair: [index + 1, other + 1],
                        at: self.now,
                    });
                }
            }
        }
    }

    /// Updates the flag `is_clear` of each drone. The flag is true if no second drone moves near this drone.
    fn update_traffic(&mut self) {
        let separation_m = f64::from(self.setup.mission.config().min_separation_m);
        let seen: Vec<(Point, bool)> = self
            .fleet
            .iter()
            .map(|vehicle| (vehicle.at(), vehicle.flies() && vehicle.moves()))
            .collect();
        for (index, vehicle) in self.fleet.iter_mut().enumerate() {
            let near = |at: &Point| apart(vehicle.at(), *at) < separation_m + TRAFFIC_M;
            let traffic = seen
                .iter()
                .enumerate()
                .any(|(other, (at, moves))| other != index && *moves && near(at));
            vehicle.is_clear = !traffic;
        }
    }

    /// Moves drone `index` (from 0) for one time step, and lets its relay and autopilot exchange messages.
    ///
    /// If the relay is off, the pilot lands the drone after [`LANDS_AFTER`].
    fn drive(&mut self, index: usize) {
        let now = self.now;
        #[expect(clippy::cast_precision_loss, reason = "some milliseconds")]
        let step_s = STEP.as_micros() as f64 / 1e6;
        let (Some(vehicle), Some(member)) =
            (self.fleet.get_mut(index), self.members.get_mut(index))
        else {
            return;
        };
        vehicle.go_on(now, step_s);
        if let Some(at) = member.killed {
            if now.since(at) >= LANDS_AFTER || !vehicle.is_not_taken_over(now) {
                vehicle.land();
            }
            return;
        }
        vehicle.sites = member.relay.sites();
        let (is_news, _) = vehicle.link.exchange(&mut member.relay, now);
        let is_flown = vehicle.link.is_flown();
        while let Some(frame) = vehicle.link.poll_transmit(now) {
            vehicle.handle_frame(now, &frame);
        }
        let due = member.relay.poll_timeout();
        let is_sooner = due.is_some_and(|at| member.wake.is_none_or(|wake| at < wake));
        let mut turnings = Vec::new();
        while let Some(event) = vehicle.link.poll_event() {
            match event {
                AutopilotEvent::Restarted => turnings.push(TimelineEvent::Restarted),
                AutopilotEvent::State(State::Engaged) => turnings.push(TimelineEvent::Engaged),
                AutopilotEvent::State(State::Blind) => turnings.push(TimelineEvent::Blind),
                AutopilotEvent::State(State::Standby) if member.under_relay_control => {
                    turnings.push(TimelineEvent::Released);
                }
                _ => {}
            }
        }
        member.under_relay_control = is_flown;
        for turning in turnings {
            self.log(index, turning, None);
        }
        if is_news || is_sooner {
            self.drain(index);
        }
    }

    /// Simulates an operator who confirms to a relay that the drones of lost neighbours have landed.
    ///
    /// The relay then stops keeping away from these drones. The operator waits until the relay and, on the side of the
    /// lost neighbours, the nearest relay with a flying drone have controlled their drones for [`LANDS_AFTER`].
    fn clear_lost_neighbours(&mut self) {
        for index in 0..self.members.len() {
            if !self.is_long_under_relay_control(index) {
                continue;
            }
            for side in [Side::Upstream, Side::Downstream] {
                let is_up = |at: &usize| self.fleet.get(*at).is_some_and(Vehicle::flies);
                let beside = match side {
                    Side::Upstream => (0..index).rev().find(is_up),
                    Side::Downstream => (index + 1..self.members.len()).find(is_up),
                };
                // Skip a neighbour that was never lost: it may not have been received yet.
                let is_lost = match (side, beside) {
                    (Side::Upstream, at) => at.map_or(index > 0, |at| at + 1 < index),
                    (Side::Downstream, at) => at.unwrap_or(self.members.len()) > index + 1,
                };
                let is_free =
                    is_lost && beside.is_none_or(|at| self.is_long_under_relay_control(at));
                let now = self.now;
                if is_free
                    && let Some(member) = self.members.get_mut(index)
                    && member.killed.is_none()
                    && matches!(
                        member.relay.hold_reason(side),
                        Some(HoldReason::Lost | HoldReason::NotFlown)
                    )
                {
                    member.relay.clear_lost(now, side);
                    self.drain(index);
                }
            }
        }
    }

    /// Returns true if relay `index` (from 0) has controlled its drone for at least [`LANDS_AFTER`].
    fn is_long_under_relay_control(&self, index: usize) -> bool {
        let Some(member) = self
            .members
            .get(index)
            .filter(|it| it.under_relay_control && it.killed.is_none())
        else {
            return false;
        };
        let engaged = self.outcome.moments.iter().rev();
        engaged
            .filter(|moment| moment.relay == member.node && moment.what == TimelineEvent::Engaged)
            .map(|moment| moment.at)
            .next()
            .is_some_and(|at| self.now.since(at) >= LANDS_AFTER)
    }

    pub(super) fn restart_autopilot(&mut self, index: usize) {
        self.pending_planned -= 1;
        if let Some(vehicle) = self.fleet.get_mut(index) {
            vehicle.restart(self.now);
        }
    }

    /// Returns true if all drones hover at their relays' agreed positions, each under its relay's control.
    ///
    /// Drones of relays that are off, and drones that their pilots have taken over, do not count.
    pub(super) fn all_hover(&self) -> bool {
        let controlled = self.members.iter().zip(&self.fleet);
        controlled
            .filter(|(member, vehicle)| {
                member.killed.is_none() && vehicle.is_not_taken_over(self.now)
            })
            .all(|(member, vehicle)| {
                let agreed = member.relay.agreed_place();
                let there = agreed.and_then(|place| vehicle.in_run_coordinates(place));
                let there = there.is_some_and(|place| apart(place, vehicle.at()) < ARRIVED_M);
                vehicle.link.is_flown() && there
            })
    }
}

impl Chain {
    /// Creates the setup's drones, if any, and schedules their first time step. Drones without autopilots start in
    /// the air.
    pub(super) fn take_off(&mut self) {
        if let Some(spec) = self.setup.rotation.clone() {
            return self.begin_rotation(&spec);
        }
        if let Some(spec) = &self.setup.flight {
            self.flight = Some(Flight::new(spec, self.setup.seed));
            self.queue.put(Instant::ZERO, 0, QueuedEvent::Fly);
        }
        self.line_up();
    }

    /// Moves all drones without autopilots for one time step. Relays that are on get the reported positions of their
    /// drones.
    pub(super) fn fly(&mut self) {
        let now = self.now;
        let Some(mut flight) = self.flight.take() else {
            return;
        };
        let reports = flight.go_on();
        for index in 0..flight.drones.len() {
            let at = if reports {
                flight.reported(index)
            } else {
                None
            };
            let Some(member) = self.members.get_mut(index) else {
                continue;
            };
            if member.killed.is_some() {
                continue;
            }
            if let Some(at) = at {
                member.relay.handle_position(now, placement(at), now);
            }
            if let Some(place) = member.relay.setpoint()
                && let Some(drone) = flight.drones.get_mut(index)
            {
                drone.goal = point(place);
            }
            if reports {
                self.drain(index);
            }
        }
        self.keep(flight.nearest(now));
        if self.setup.track {
            let serving = self.serving(&flight);
            self.outcome.serving.push((now, serving));
        }
        self.queue.put(now + flight.step, 0, QueuedEvent::Fly);
        self.flight = Some(flight);
    }

    /// Returns the relays that forward data now, by number from 1, with the true positions of their drones.
    fn serving(&self, flight: &Flight) -> Vec<(u16, Point)> {
        let serves = |member: &Member| {
            let is_out = matches!(
                member.relay.departure(self.now),
                Departure::Spare | Departure::Free
            );
            member.killed.is_none() && member.relay.setpoint().is_some() && !is_out
        };
        let serving = self.members.iter().enumerate();
        serving
            .filter(|(_, member)| serves(member))
            .filter_map(|(index, member)| Some((member.node, flight.true_position(index)?)))
            .collect()
    }

    /// Records `nearest` (two drones and their distance) if it is the smallest distance of the run so far.
    pub(super) fn keep(&mut self, nearest: Option<Nearest>) {
        let known = self.outcome.nearest;
        if nearest.is_some_and(|it| known.is_none_or(|known| it.apart_m < known.apart_m)) {
            self.outcome.nearest = nearest;
        }
    }

    /// Returns true if each drone without a simulated autopilot has reached its relay's agreed position.
    ///
    /// Drones of relays that are off do not count. The comparison uses each drone's position estimate. If the run has
    /// no drones without autopilot, the result is true.
    pub(super) fn has_arrived(&self) -> bool {
        let Some(flight) = &self.flight else {
            return true;
        };
        let living = self.members.iter().zip(&flight.drones);
        living
            .filter(|(member, _)| member.killed.is_none())
            .all(|(member, drone)| {
                let agreed = member.relay.agreed_place();
                agreed.is_some_and(|place| apart(point(place), drone.estimated_position()) < 1e-3)
            })
    }
}
