//! Ground stations of a run: uploads, measurements and telemetry.

use rand::RngExt;
use uav_relay::sensing::estimate::NumberedEstimate;
use uav_relay::{
    Duration, Instant, MAX_FRAME, Phase, Placement, Port, Report, Sample, Side, Wiring,
};
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::Scene;

use super::air::{Receiver, link};
use super::{Chain, Member, QueuedEvent};
use crate::simulator::attack::{
    AttackKind, Attacker, ForgedRoute, destination, forge, incremented_counter,
};
use crate::simulator::drones::{Drone, Point, placement};
use crate::simulator::fleet::Vehicle;
use crate::simulator::outcome::{Link, Moment, TimelineEvent};
use crate::simulator::true_interference::{Snapshot, TrueInterference};

/// Largest number of a station's reports that wait for [`Chain::arrived`].
const ARRIVED: usize = 64;

impl Chain {
    pub(super) fn begin_upload(&mut self, which: usize) {
        let Some(spec) = self.setup.uploads.get(which).copied() else {
            return;
        };
        let Some(at) = self
            .stations
            .iter()
            .position(|station| station.end == spec.end)
        else {
            return;
        };
        if let Some(station) = self.stations.get_mut(at)
            && station.ground.upload(self.now, spec.upload).is_ok()
        {
            self.log_ground(spec.end, TimelineEvent::Offered(spec.upload.version()));
        }
        self.drain_station(at);
    }

    pub(super) fn begin_watching(&mut self, which: usize) {
        let Some((end, _)) = self.setup.watches.get(which).copied() else {
            return;
        };
        let at = self.stations.iter().position(|station| station.end == end);
        if let Some(at) = at
            && let Some(station) = self.stations.get_mut(at)
        {
            station.ground.watch(self.now, true);
            self.drain_station(at);
        }
    }

    /// Returns the newest reports that have reached the ground station at `end`, by relay.
    pub fn reports(&self, end: Side) -> Vec<Report> {
        let mut stations = self.stations.iter();
        let station = stations.find(|station| station.end == end);
        station.map_or(Vec::new(), |it| it.reports.values().copied().collect())
    }

    /// Returns the reports that have reached the ground station at `end` since the last call.
    ///
    /// The second list has the relays of which the station has received frames. Of more than 64 reports the newest are missing.
    pub fn arrived(&mut self, end: Side) -> (Vec<Report>, Vec<u16>) {
        let mut stations = self.stations.iter_mut();
        let Some(station) = stations.find(|station| station.end == end) else {
            return (Vec::new(), Vec::new());
        };
        let overheard = station.ground.poll_overheard().collect();
        (std::mem::take(&mut station.arrived), overheard)
    }

    /// Passes received bytes to the ground station `at` (from 0) and sends its replies.
    pub(super) fn station_receive(&mut self, at: usize, bytes: &[u8]) {
        if let Some(station) = self.stations.get_mut(at) {
            station.ground.handle_bytes(bytes);
            if !self.setup.watches.is_empty() {
                station.ground.handle_timeout(self.now);
            }
            while let Some(report) = station.ground.poll_report(self.now) {
                let newest = station.reports.entry(report.relay).or_insert(report);
                newest.update(report);
                if station.arrived.len() < ARRIVED {
                    station.arrived.push(report);
                }
            }
        }
        self.drain_station(at);
    }

    /// Handles an expired timer of the ground station `at` (from 0) and sends its frames.
    pub(super) fn station_timeout(&mut self, at: usize) {
        let now = self.now;
        if let Some(station) = self.stations.get_mut(at)
            && station.wake == Some(now)
        {
            station.wake = None;
            station.ground.handle_timeout(now);
        }
        self.drain_station(at);
    }

    /// Measures the interference at the ground stations at Tx and Rx. The stations send the results to the relays.
    pub(super) fn measure_at_ends(&mut self, true_interference: &TrueInterference, scene: &Scene) {
        for at in 0..self.stations.len() {
            if let Some(station) = self.stations.get_mut(at) {
                let power_w = match station.end {
                    Side::Upstream => {
                        true_interference.transmitter_w(scene, self.now, &mut self.rng)
                    }
                    Side::Downstream => {
                        let relays = self.setup.mission.relays();
                        true_interference.receiver_w(scene, self.now, relays, &mut self.rng)
                    }
                };
                station.ground.measured(narrow(power_w));
            }
            self.drain_station(at);
        }
    }

    fn drain_station(&mut self, at: usize) {
        let now = self.now;
        let mut frame = [0; MAX_FRAME];
        while let Some(station) = self.stations.get_mut(at)
            && let Some(len) = station.ground.poll_transmit(&mut frame)
        {
            let bytes = frame.get(..len).unwrap_or_default();
            if self.broadcast(self.members.len() + at, bytes) {
                continue;
            }
            let Some(station) = self.stations.get_mut(at) else {
                return;
            };
            let end = station.end;
            let arrives = station.line.send(now, len, &self.setup.link);
            self.outcome.messages += 1;
            self.outcome.bytes += len as u64;
            let relays = self.members.len();
            let reach = self.reach();
            let (receivers, port) = match end {
                Side::Upstream => (0..reach.min(relays), Port::Upstream),
                Side::Downstream => (relays.saturating_sub(reach)..relays, Port::Downstream),
            };
            let into = match self.setup.settings.wiring {
                Wiring::Pair => port,
                Wiring::Shared => Port::Shared,
            };
            let from = relays + at;
            self.overhear(bytes, into, arrives);
            let link = match (into, end) {
                (Port::Shared, _) => Link::Shared,
                (_, Side::Upstream) => Link::After(0),
                (_, Side::Downstream) => Link::After(self.setup.mission.relays()),
            };
            let note = self.send(from, bytes, into, arrives, receivers.map(Receiver::Relay));
            self.keep_frame(self.sent_at(arrives), link, bytes, note);
        }
        if let Some(station) = self.stations.get_mut(at)
            && let Some(again) = station.ground.poll_timeout()
            && station.wake.is_none_or(|wake| again < wake)
        {
            assert!(
                again > now,
                "the ground node asks for the next call without an advance of time (endless loop)"
            );
            station.wake = Some(again);
            self.queue.put(again, at, QueuedEvent::StationTimeout);
        }
    }

    /// Returns true if the ground station `at` receives frames that relay `index` sends through `port`.
    ///
    /// Both count from 0.
    pub(super) fn reaches_ground(&self, index: usize, port: Port, at: usize) -> bool {
        let Some(station) = self.stations.get(at) else {
            return false;
        };
        let (off, side) = match station.end {
            Side::Upstream => (index + 1, Port::Upstream),
            Side::Downstream => (self.members.len() - index, Port::Downstream),
        };
        match port {
            Port::Shared => off <= self.setup.radio_reach,
            _ => off == 1 && port == side,
        }
    }

    fn log_ground(&mut self, end: Side, what: TimelineEvent) {
        self.outcome.moments.push(Moment {
            at: self.now,
            relay: match end {
                Side::Upstream => 0,
                Side::Downstream => self.setup.mission.relays() + 1,
            },
            what,
            other: None,
            target: None,
            sweeps: 0,
        });
    }
}

impl Chain {
    /// Returns the position of the drone of relay `index` (from 0), m; `None` if no drones are simulated.
    ///
    /// With a simulated autopilot it is the true position. Without one it is the drone's own position estimate.
    pub(super) fn drone(&self, index: usize) -> Option<Point> {
        let flight = self.flight.as_ref();
        flight
            .and_then(|flight| flight.drones.get(index))
            .map(Drone::estimated_position)
            .or_else(|| self.fleet.get(index).map(Vehicle::at))
    }

    /// Lets every relay that is on measure the interference, and records the relays' positions.
    pub(super) fn measure_all(&mut self) {
        let Some(true_interference) = self.setup.true_interference.clone() else {
            return;
        };
        let now = self.now;
        let scene = true_interference.scene_at(now);
        let (mut nodes, mut places) = (Vec::new(), Vec::new());
        if now == Instant::ZERO + true_interference.period {
            for (node, sample) in &true_interference.handed {
                let mut members = self.members.iter_mut();
                if let Some(member) = members.find(|member| member.node == *node) {
                    member.relay.handle_sample(now, *sample);
                }
            }
        }
        for index in 0..self.members.len() {
            let flown = self.drone(index).map(placement);
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
            if !true_interference.handed.is_empty()
                || true_interference.once && member.measured == Some(at)
            {
                continue;
            }
            member.measured = Some(at);
            let power_w = true_interference.relay_w(&scene, member.node, now, at, &mut self.rng);
            member.relay.handle_sample(
                now,
                Sample::Heard {
                    at,
                    power_w: narrow(power_w),
                },
            );
            if true_interference.ends_measure(now)
                && !self.setup.auth
                && member.node == self.setup.mission.relays()
            {
                let power_w =
                    narrow(true_interference.receiver_w(&scene, now, member.node, &mut self.rng));
                member
                    .relay
                    .handle_sample(now, Sample::Receiver { power_w });
            }
        }
        if true_interference.ends_measure(now) && true_interference.handed.is_empty() {
            self.measure_at_ends(&true_interference, &scene);
        }
        self.record_snapshot(nodes, places);
        if now < true_interference.until {
            self.queue
                .put(now + true_interference.period, 0, QueuedEvent::Measure);
        } else {
            self.measurements_done = true;
        }
    }

    fn record_snapshot(&mut self, nodes: Vec<u16>, places: Vec<Placement>) {
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
        self.outcome.snapshots.push(Snapshot {
            believed: leader.map_or_else(NumberedEstimate::default, |leader| {
                leader.relay.interference_estimate()
            }),
            at: self.now,
            nodes,
            places,
            goals,
            agreements: self.agreements,
        });
    }
}

/// Delay before an attacker without a recorded frame tries again to replay one.
const WAIT: Duration = Duration::from_millis(10);

impl Chain {
    /// Creates the attacker of the setup, if any, and queues the times of its frames.
    pub(super) fn schedule_attack(&mut self) {
        let Some(attack) = self.setup.attack else {
            return;
        };
        let mut attacker = Attacker::new(attack, self.setup.seed);
        for (at, kind) in attacker.plan(&self.setup.link) {
            self.queue.put(at, 0, QueuedEvent::Attack(kind));
            self.pending_planned += 1;
        }
        self.attacker = Some(attacker);
    }

    /// Sends one frame of the attacker to a living relay. If there is no frame to replay, the attacker tries again
    /// later.
    pub(super) fn send_attack(&mut self, kind: AttackKind) {
        let now = self.now;
        let Some(mut attacker) = self.attacker.take() else {
            return;
        };
        let frame = match kind {
            AttackKind::Forge => {
                let way = self.forged_route(&mut attacker);
                let heard = attacker.recall(now);
                let heard = heard.as_ref().map(|heard| heard.bytes.as_slice());
                let bytes = forge(&self.setup.mission, way, heard, &mut attacker.rng);
                Some((self.port(way), bytes))
            }
            AttackKind::Replay => attacker
                .recall(now)
                .map(|recorded| (recorded.port, recorded.bytes)),
        };
        match frame {
            Some((port, bytes)) => {
                let astray = kind == AttackKind::Replay && attacker.rng.random_range(0..4) == 0;
                let to = destination(&bytes).filter(|_| !astray);
                if let Some(to) = self.reached(to, &mut attacker) {
                    self.deliver_attack(to, kind, port, &bytes);
                }
            }
            None if now < attacker.attack.until => {
                self.queue.put(now + WAIT, 0, QueuedEvent::Attack(kind));
                self.pending_planned += 1;
            }
            None => {}
        }
        self.attacker = Some(attacker);
    }

    /// Draws the destination of a forged frame, and the node that the frame names as its sender.
    ///
    /// The destination is a relay, the sender a relay or ground station that can be the neighbour of this relay.
    fn forged_route(&self, attacker: &mut Attacker) -> ForgedRoute {
        let relays = self.setup.mission.relays();
        let reach = match self.setup.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => 4,
        };
        let to = attacker.rng.random_range(1..=relays);
        let off = attacker.rng.random_range(1..=reach);
        let before = attacker.rng.random::<bool>() && off <= to || to + off > relays + 1;
        ForgedRoute {
            from: if before {
                to.saturating_sub(off)
            } else {
                to + off
            },
            to,
        }
    }

    fn port(&self, way: ForgedRoute) -> Port {
        match self.setup.settings.wiring {
            Wiring::Shared => Port::Shared,
            Wiring::Pair if way.from < way.to => Port::Upstream,
            Wiring::Pair => Port::Downstream,
        }
    }

    /// Returns the index (from 0) of the relay that receives an attacker's frame for relay `to` (from 1).
    ///
    /// If relay `to` is off, or `to` is `None`, a random relay that is on receives the frame. `None` if all relays are
    /// off.
    fn reached(&self, to: Option<u16>, attacker: &mut Attacker) -> Option<usize> {
        let living = |member: &Member| member.killed.is_none();
        let meant = to.and_then(|to| usize::from(to).checked_sub(1));
        let meant = meant.filter(|index| self.members.get(*index).is_some_and(living));
        meant.or_else(|| {
            let count = self.members.iter().filter(|member| living(member)).count();
            let pick = attacker.rng.random_range(0..count.max(1));
            let all = self.members.iter().enumerate();
            let picked = |(_, member): &(usize, &Member)| living(member);
            all.filter(picked).nth(pick).map(|(index, _)| index)
        })
    }

    /// Passes a frame of the attacker to relay `index` (from 0) and counts how the relay classified it.
    fn deliver_attack(&mut self, index: usize, kind: AttackKind, port: Port, bytes: &[u8]) {
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        let before = *member.relay.stats();
        member.relay.handle_bytes(self.now, port, bytes);
        let name = incremented_counter(&before, member.relay.stats());
        *self
            .outcome
            .attack_counts
            .counted
            .entry((kind, name))
            .or_default() += 1;
        let note = match kind {
            AttackKind::Forge => "forged by the attacker",
            AttackKind::Replay => "replayed by the attacker",
        };
        self.keep_frame(self.now, link(index, port), bytes, note.to_owned());
        self.drain(index);
    }
}
