//! Interference measurements of the relays.

use uav_relay::sensing::belief::Told;
use uav_relay::{Instant, Phase, Placement, Sample};

use super::super::drones::{Drone, placement};
use super::super::fleet::Vehicle;
use super::super::queue::QueuedEvent;
use super::super::true_interference::Stand;
use super::state::Chain;

impl Chain {
    /// Measures at every living relay and takes a snapshot of the positions.
    pub(super) fn measure_all(&mut self) {
        let Some(sky) = self.setup.sky.clone() else {
            return;
        };
        let now = self.now;
        let scene = sky.scene_at(now);
        let (mut nodes, mut places) = (Vec::new(), Vec::new());
        if now == Instant::ZERO + sky.period {
            for (node, sample) in &sky.handed {
                let mut members = self.members.iter_mut();
                if let Some(member) = members.find(|member| member.node == *node) {
                    member.relay.handle_sample(now, *sample);
                }
            }
        }
        for index in 0..self.members.len() {
            let flown = self
                .flight
                .as_ref()
                .and_then(|flight| flight.drones.get(index))
                .map(Drone::taken)
                .or_else(|| self.fleet.get(index).map(Vehicle::at))
                .map(placement);
            let Some(member) = self.members.get_mut(index) else {
                continue;
            };
            if member.killed.is_some() {
                continue;
            }
            nodes.push(member.node);
            let Some(at) = flown.or(member.relay.setpoint()) else {
                continue;
            };
            places.push(at);
            if !sky.handed.is_empty() || sky.once && member.measured == Some(at) {
                continue;
            }
            member.measured = Some(at);
            let power_w = sky.heard_w(&scene, member.node, now, at, &mut self.rng);
            member.relay.handle_sample(
                now,
                Sample::Heard {
                    at,
                    power_w: uav_relay_scenario::number::narrow(power_w),
                },
            );
            if sky.ends_measure(now)
                && !self.setup.auth
                && member.node == self.setup.mission.relays()
            {
                let power_w = uav_relay_scenario::number::narrow(sky.receiver_w(
                    &scene,
                    now,
                    member.node,
                    &mut self.rng,
                ));
                member
                    .relay
                    .handle_sample(now, Sample::Receiver { power_w });
            }
        }
        if sky.ends_measure(now) && sky.handed.is_empty() {
            self.measure_at_ends(&sky, &scene);
        }
        self.stand(nodes, places);
        if now < sky.until {
            self.queue.put(now + sky.period, 0, QueuedEvent::Listen);
        } else {
            self.listened = true;
        }
    }

    fn stand(&mut self, nodes: Vec<u16>, places: Vec<Placement>) {
        let agreed = self
            .members
            .iter()
            .filter(|member| member.killed.is_none())
            .all(|member| member.relay.phase() == Phase::Holding);
        let goals = self.setpoints();
        if agreed && goals.is_some() && goals != self.agreed {
            self.agreed.clone_from(&goals);
            self.agreements += 1;
        }
        let leader = self.members.first();
        self.outcome.stands.push(Stand {
            believed: leader.map_or_else(Told::default, |leader| leader.relay.belief()),
            at: self.now,
            nodes,
            places,
            goals,
            agreements: self.agreements,
        });
    }
}
