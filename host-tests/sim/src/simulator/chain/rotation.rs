//! Replacement of drones whose batteries run low: pilots, spares, returns, and the measured SIR.

use rand::RngExt;
use uav_relay::wire::message::AT_ONCE;
use uav_relay::{Departure, Duration, HoldReason, Instant, Relay, Side};
use uav_relay_scenario::fleet::FleetSize;

use super::{Chain, ChangedRelays, QueuedEvent, undisturbed};
use crate::report::{hop_sirs, hop_sirs_back};
use crate::simulator::drones::{
    Drone, Flight, FlightSpec, Nearest, Point, apart, placement, point,
};
use crate::simulator::outcome::TimelineEvent;
use crate::simulator::rotation::{
    Battery, CLIMB_MPS, DipCause, DipState, Duty, Encounter, GOOD, MOVING, NearDrone, Rotated,
    Rotation, RotationSpec, SPEED_MPS, duration,
};
use crate::simulator::watch::{ObservedState, has_agreed};

/// Time step of the simulation while a drone moves.
const STEP: Duration = Duration::from_millis(100);

/// Time step of the simulation while all drones hover.
const IDLE: Duration = Duration::from_millis(1_000);

/// Period of the pilots' decisions.
const PILOTS: Duration = Duration::from_millis(1_000);

/// Least time between two take-offs.
const TAKE_OFFS: Duration = Duration::from_millis(8_000);

/// Distance of a drone from a point of its path, m, below which the drone has reached this point.
const ARRIVED_M: f64 = 0.5;

/// Time, s, from a spare's arrival beside the line to the latest time for a request to leave.
const EARLY_S: f64 = 40.0;

/// Time, s, from a request to leave, made while a spare is ready, to the latest time for it.
const MARGIN_S: f64 = 60.0;

/// Time left to a drone at which its relay requests to leave even if no spare waits.
///
/// It is a part of the longest recent time from a request to the permission. A departure without a spare takes less time.
const DEADLINE: f64 = 0.5;

/// Time for which a drone must hover beside the line before it counts as a spare that is ready to join. A relay
/// requests to leave early only if such a spare is ready.
const HOVERS: Duration = Duration::from_millis(13_000);

/// Converts an endurance to whole seconds within 0 to 60 000.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "within the range of u16"
)]
fn whole(endurance_s: f64) -> u16 {
    endurance_s.clamp(0.0, 6e4) as u16
}

fn seconds(span: Duration) -> f64 {
    span.as_micros() as f64 / 1e6
}

impl Chain {
    /// Creates the drones of `spec`: the first drones at their best positions, the others on the ground.
    pub(super) fn begin_rotation(&mut self, spec: &RotationSpec) {
        let all = self.setup.mission.relays();
        let flying = spec.flying.clamp(1, all);
        let size = FleetSize {
            relays: all,
            flying,
        };
        let first: Vec<u16> = size.first().collect();
        let places = undisturbed(&self.setup, &first, 0).unwrap_or_default();
        let altitude_m = f64::from(self.setup.mission.config().common.altitude_m);
        let separation_m = f64::from(self.setup.mission.config().min_separation_m);
        let mut start = vec![[0.0, 0.0, 0.0]; usize::from(all)];
        for (node, at) in first.iter().zip(&places) {
            if let Some(start) = start.get_mut(usize::from(*node) - 1) {
                *start = [at[0], at[1], altitude_m];
            }
        }
        let flight = FlightSpec::multicopters(start, spec.bias_m, spec.noise_m);
        let flight = Flight::new(&flight, self.setup.seed);
        let mut drones = Vec::new();
        for index in 0..self.members.len() {
            let is_first = first.iter().any(|node| usize::from(*node) == index + 1);
            let spread = spec.spread * self.rng.random_range(-1.0..=1.0);
            drones.push(Battery {
                duty: if is_first {
                    Duty::Serving
                } else {
                    Duty::Ground(Instant::ZERO)
                },
                capacity_s: spec.endurance_s * (1.0 + spread),
                // The pilots start with batteries of different charge, so that not all are tired at the same time.
                used_s: {
                    let rank = first
                        .iter()
                        .position(|node| usize::from(*node) == index + 1);
                    let share = rank.map_or(0.0, |rank| rank as f64 / first.len() as f64);
                    0.6 * share * spec.endurance_s
                },
                requested: None,
                tube: None,
                hovers_since: Instant::ZERO,
                is_settled: true,
                is_reported: false,
            });
            if let Some(member) = self.members.get_mut(index)
                && !is_first
            {
                member.killed = Some(Instant::ZERO);
            }
        }
        let since = drones
            .iter()
            .map(|drone| (drone.duty == Duty::Serving).then_some(Instant::ZERO));
        let mut rotation = Rotation {
            since: since.collect(),
            spec: spec.clone(),
            drones,
            best: 1.0,
            at: Instant::ZERO,
            next: Instant::ZERO,
            pilots_at: Instant::ZERO,
            last_take_off: Instant::ZERO,
            slot_s: SLOT_S,
            spacing_m: (separation_m + 2.0 * (spec.bias_m + spec.noise_m) + 2.0).max(8.0),
            record: Rotated::default(),
        };
        (rotation.best, _) = self.worst_hop(&places);
        self.flight = Some(flight);
        self.rotation = Some(rotation);
        self.queue.put(Instant::ZERO, 0, QueuedEvent::Fly);
    }

    /// Returns the linear SIR of the worst hop over relays at `places`, and the number of that hop.
    ///
    /// The places are in order from Tx, and the hops have the numbers from 0. The SIR is 0 without any relay.
    fn worst_hop(&self, places: &[Point]) -> (f64, usize) {
        let mission = &self.setup.mission;
        let common = mission.config().common;
        let route: Vec<_> = places.iter().map(|at| (placement(*at), common)).collect();
        if route.is_empty() {
            return (0.0, 0);
        }
        let reverse = f64::from(mission.reverse());
        let back = if reverse > 0.0 {
            hop_sirs_back(mission, &route)
        } else {
            Vec::new()
        };
        let sirs = hop_sirs(mission, &route);
        let back = back.into_iter().map(|sir| sir / reverse);
        let all = sirs.into_iter().enumerate().chain(back.enumerate());
        let all = all.map(|(hop, sir)| (sir, hop));
        all.min_by(|one, other| one.0.total_cmp(&other.0))
            .unwrap_or((0.0, 0))
    }

    /// Returns the linear SIR of the chain's worst hop at present, if the data take the best route.
    ///
    /// The route may leave out up to six relays that are about to leave or have just joined. Constant position errors
    /// do not count: the positions are the drones' own estimates, without noise. The second value is the worst hop: the
    /// numbers of its two nodes.
    fn served(&self, rotation: &Rotation, flight: &Flight) -> (f64, [usize; 2]) {
        let mut fixed = Vec::new();
        let mut optional = Vec::new();
        for (index, (member, drone)) in self.members.iter().zip(&rotation.drones).enumerate() {
            let Some(at) = flight.drones.get(index).map(Drone::estimated_position) else {
                continue;
            };
            if drone.duty != Duty::Serving || member.killed.is_some() {
                continue;
            }
            let stays = member.relay.departure(self.now) == Departure::Member;
            if stays && drone.is_settled {
                fixed.push((index, at));
            } else if optional.len() < 6 {
                optional.push((index, at));
            }
        }
        let routes = (0..1_u32 << optional.len()).map(|left_out| {
            let some = optional.iter().enumerate();
            let some = some.filter(|(which, _)| left_out >> which & 1 == 0);
            let mut route = fixed.clone();
            route.extend(some.map(|(_, one)| *one));
            route.sort_by_key(|(index, _)| *index);
            let places: Vec<Point> = route.iter().map(|(_, at)| *at).collect();
            let (sir, hop) = self.worst_hop(&places);
            let end = rotation.drones.len() + 1;
            let node = |at: usize| match at.checked_sub(1) {
                None => 0,
                Some(at) => route.get(at).map_or(end, |(index, _)| index + 1),
            };
            (sir, [hop, hop + 1].map(node))
        });
        routes.fold(
            (0.0, [0; 2]),
            |best, route| {
                if route.0 > best.0 { route } else { best }
            },
        )
    }

    /// Returns the cause of a low SIR now, and the state of the chain. `hop` is the worst hop.
    fn dip(&self, rotation: &Rotation, flight: &Flight, hop: [usize; 2]) -> (DipCause, DipState) {
        let on: Vec<(usize, &Duty)> = self
            .members
            .iter()
            .zip(&rotation.drones)
            .enumerate()
            .filter(|(_, (member, _))| member.killed.is_none())
            .map(|(index, (_, drone))| (index, &drone.duty))
            .collect();
        let serving = || {
            let serving = on.iter().filter(|(_, duty)| **duty == Duty::Serving);
            serving.filter_map(|(index, _)| Some((*index, &self.members.get(*index)?.relay)))
        };
        let stays = |relay: &Relay| {
            let departure = relay.departure(self.now);
            departure != Departure::Outside && departure != Departure::Free
        };
        let is_off = |index: usize, relay: &Relay| {
            let at = flight.drones.get(index).map(Drone::estimated_position);
            let agreed = relay.agreed_place().map(point);
            at.zip(agreed)
                .is_none_or(|(at, agreed)| apart(at, agreed) > ARRIVED_M)
        };
        let is_held = |relay: &Relay| {
            let sides = [Side::Upstream, Side::Downstream];
            sides.iter().any(|side| relay.hold_reason(*side).is_some())
        };
        let in_chain = serving().filter(|(_, relay)| stays(relay)).count();
        let cause = if in_chain < usize::from(rotation.spec.flying) {
            if on.iter().any(|(_, duty)| **duty == Duty::Standby) {
                DipCause::SpareWaits
            } else {
                DipCause::NoSpare
            }
        } else if !self.is_whole(rotation) {
            DipCause::Agreement
        } else if serving().any(|(index, relay)| is_held(relay) && is_off(index, relay)) {
            DipCause::Guard
        } else if serving().any(|(index, relay)| is_off(index, relay)) {
            DipCause::Motion
        } else {
            DipCause::Positions
        };
        let drones = on
            .iter()
            .filter(|(_, duty)| !matches!(duty, Duty::Home { .. }))
            .map(|(index, _)| self.near_drone(rotation, flight, *index))
            .collect();
        (cause, DipState { hop, drones })
    }

    /// Brings forward the next step of the flight if the setpoint of relay `index` (from 0) has changed.
    pub(super) fn on_setpoint(&mut self, index: usize) {
        let soon = self.now + STEP;
        let (Some(rotation), Some(flight)) = (&mut self.rotation, &self.flight) else {
            return;
        };
        let (Some(drone), Some(battery), Some(member)) = (
            flight.drones.get(index),
            rotation.drones.get(index),
            self.members.get(index),
        ) else {
            return;
        };
        if rotation.next > soon
            && battery.duty == Duty::Serving
            && member
                .relay
                .setpoint()
                .is_some_and(|to| apart(point(to), drone.goal) > 0.0)
        {
            rotation.next = soon;
            self.queue.put(soon, 0, QueuedEvent::Fly);
        }
    }

    /// Moves all drones up to the present time, records the chain's SIR, and makes the pilots' decisions.
    pub(super) fn rotate(&mut self) {
        let now = self.now;
        let (Some(mut rotation), Some(mut flight)) = (self.rotation.take(), self.flight.take())
        else {
            return;
        };
        if now < rotation.next {
            self.rotation = Some(rotation);
            self.flight = Some(flight);
            return;
        }
        let span = now.since(rotation.at);
        rotation.at = now;
        let span_s = seconds(span);
        for (drone, battery) in flight.drones.iter_mut().zip(&mut rotation.drones) {
            if !matches!(battery.duty, Duty::Ground(_)) && span_s > 0.0 {
                let moves = drone.moves();
                drone.fly(span_s);
                battery.used_s += span_s * if moves { MOVING } else { 1.0 };
            }
        }
        self.record(&mut rotation, &flight, span);
        if rotation.pilots_at <= now {
            rotation.pilots_at = now + PILOTS;
            self.decide(&mut rotation, &flight);
        }
        self.put_on_pads(&mut flight);
        let distance_m = f64::from(self.setup.mission.config().distance_m);
        for index in 0..rotation.drones.len() {
            let waits = rotation
                .drones
                .get(index)
                .is_some_and(|it| it.duty == Duty::Standby);
            let gap = Self::gap(&rotation, index);
            let [from_m, to_m] = Self::gap_m(&rotation, &flight, gap, distance_m);
            let part_m = 5.0_f64.min((to_m - from_m) / 4.0);
            // A pilot keeps a spare beside its gap.
            if let Some(drone) = flight.drones.get_mut(index)
                && waits
                && !(from_m + part_m..to_m - part_m).contains(&drone.goal[0])
            {
                drone.goal[0] = f64::midpoint(from_m, to_m);
                if let Some(battery) = rotation.drones.get_mut(index) {
                    battery.hovers_since = now;
                }
            }
        }
        let mut moves = false;
        for index in 0..rotation.drones.len() {
            moves |= self.steer_drone(&mut rotation, &mut flight, index);
        }
        rotation.next = now + if moves { STEP } else { IDLE };
        self.queue.put(rotation.next, 0, QueuedEvent::Fly);
        self.rotation = Some(rotation);
        self.flight = Some(flight);
        self.update_statistics(ChangedRelays::All);
    }

    fn record(&mut self, rotation: &mut Rotation, flight: &Flight, span: Duration) {
        let now = self.now;
        let (sir, hop) = self.served(rotation, flight);
        let share = sir / rotation.best;
        let serving = rotation.drones.iter().filter(|it| it.duty == Duty::Serving);
        if rotation.record.complete_at.is_none()
            && serving.count() >= usize::from(rotation.spec.flying)
            && share > 0.999
            && self.is_whole(rotation)
        {
            rotation.record.complete_at = Some(now);
        }
        let dip = (share < GOOD).then(|| self.dip(rotation, flight, hop));
        rotation.count(now, span, share, dip);
        if rotation.record.complete_at.is_some() {
            let serving = rotation.drones.iter().filter(|it| it.duty == Duty::Serving);
            rotation.record.served_s += serving.count() as f64 * seconds(span);
        }
        let air = rotation.drones.iter().zip(&flight.drones).enumerate();
        let air: Vec<(usize, Point)> = air
            .filter(|(_, (battery, _))| !matches!(battery.duty, Duty::Ground(_)))
            .map(|(index, (_, drone))| (index, drone.at()))
            .collect();
        let places: Vec<Point> = air.iter().map(|(_, at)| *at).collect();
        let least_m = rotation
            .record
            .nearest
            .as_ref()
            .map_or(f64::INFINITY, |it| it.apart_m);
        if let Some(nearest) = Nearest::of(&places, now).filter(|it| it.apart_m < least_m) {
            let pair = nearest
                .pair
                .map(|at| air.get(at - 1).map_or(0, |(index, _)| *index));
            rotation.record.nearest = Some(Encounter {
                apart_m: nearest.apart_m,
                at: now,
                drones: pair.map(|index| self.near_drone(rotation, flight, index)),
            });
        }
    }

    /// Describes drone `index` (from 0) for the record of a closest approach or a low SIR.
    fn near_drone(&self, rotation: &Rotation, flight: &Flight, index: usize) -> NearDrone {
        let duty = match rotation.drones.get(index).map(|it| &it.duty) {
            Some(Duty::Rising { .. }) => "on its way to its place beside the line",
            Some(Duty::Standby) => "spare beside the line",
            Some(Duty::Home { .. }) => "on its way home",
            Some(Duty::Serving) => "flown by its relay",
            Some(Duty::Ground(_)) | None => "on the ground",
        };
        let relay = self.members.get(index).filter(|it| it.killed.is_none());
        let relay = relay.map_or("relay off".to_owned(), |member| {
            let relay = &member.relay;
            let holds = [Side::Upstream, Side::Downstream].map(|side| {
                relay
                    .hold_reason(side)
                    .map_or("none".to_owned(), |it| format!("{it:?}"))
            });
            let [up, down] = holds;
            let seen = ObservedState::of(relay, true);
            let lease = if seen.leased { "lease" } else { "no lease" };
            format!(
                "{:?}; view {} of {} relays, {:?}, {lease}; reason to wait: {up} toward Tx, {down} toward Rx",
                relay.departure(self.now),
                seen.view.number(),
                seen.relays,
                seen.phase,
            )
        });
        let drone = flight.drones.get(index);
        NearDrone {
            relay: index + 1,
            state: format!("{duty}; {relay}"),
            at_m: drone.map_or([f64::NAN; 3], Drone::at),
            goal_m: drone.map_or([f64::NAN; 3], |it| it.goal),
        }
    }

    /// Returns true if the relays that serve are all relays of one view, with leases and agreed positions.
    ///
    /// A view is an agreed set of the chain's members. Relays that have left the chain do not serve.
    fn is_whole(&self, rotation: &Rotation) -> bool {
        let members = self.members.iter().zip(&rotation.drones);
        let on: Vec<_> = members
            .filter(|(member, drone)| {
                drone.duty == Duty::Serving
                    && member.killed.is_none()
                    && member.relay.departure(self.now) != Departure::Outside
            })
            .map(|(member, _)| ObservedState::of(&member.relay, true))
            .collect();
        let leased = on.iter().all(|one| one.leased);
        let same = on.windows(2).all(|pair| match pair {
            [one, other] => one.view == other.view,
            _ => true,
        });
        let count = on
            .first()
            .is_some_and(|one| usize::from(one.relays) == on.len());
        leased && same && count && has_agreed(&on)
    }

    /// Sets the position to which drone `index` (from 0) flies. Returns true if the drone moves.
    ///
    /// The position is the relay's setpoint, or the next point of the path to or from the line. At the end of the path,
    /// the relay is switched on or off. A drone that has permission to leave flies home.
    fn steer_drone(&mut self, rotation: &mut Rotation, flight: &mut Flight, index: usize) -> bool {
        let now = self.now;
        let Some(drone) = flight.drones.get_mut(index) else {
            return false;
        };
        let (at, estimated) = (drone.at(), drone.estimated_position());
        let Some(battery) = rotation.drones.get_mut(index) else {
            return false;
        };
        let mut arrived = false;
        match &mut battery.duty {
            Duty::Ground(_) => return false,
            Duty::Standby | Duty::Serving => {}
            Duty::Rising { path } | Duty::Home { path, .. } => {
                if let Some(next) = path.front()
                    && apart(*next, estimated) < ARRIVED_M
                {
                    path.pop_front();
                }
                match path.front() {
                    Some(next) => {
                        let climbs = (next[2] - estimated[2]).abs() > ARRIVED_M;
                        drone.set_speed(if climbs { CLIMB_MPS } else { SPEED_MPS });
                        drone.goal = *next;
                    }
                    None => arrived = true,
                }
            }
        }
        if arrived && matches!(battery.duty, Duty::Home { .. }) {
            battery.duty = Duty::Ground(now + duration(rotation.spec.ground_s));
            self.switch_off(index);
            return false;
        }
        if arrived {
            battery.duty = Duty::Standby;
            battery.hovers_since = now;
            drone.set_speed(SPEED_MPS);
            if rotation.spec.announced {
                self.switch_on(index, true);
            }
        }
        let noisy = flight.reported(index).unwrap_or(at);
        let (Some(battery), Some(drone), Some(member)) = (
            rotation.drones.get_mut(index),
            flight.drones.get_mut(index),
            self.members.get_mut(index),
        ) else {
            return false;
        };
        if member.killed.is_none() {
            member.relay.handle_position(now, placement(noisy), now);
        }
        let departure = member.relay.departure(now);
        let mut joins = false;
        if battery.duty == Duty::Standby
            && member.killed.is_none()
            && departure == Departure::Member
        {
            joins = member.relay.setpoint().is_some();
            if joins {
                battery.duty = Duty::Serving;
                battery.is_settled = false;
            }
        }
        if battery.duty == Duty::Serving {
            if let Some(place) = member.relay.setpoint() {
                drone.goal = point(place);
            }
            let agreed = member.relay.agreed_place().map(point);
            battery.is_settled |= agreed.is_some_and(|place| apart(place, at) < 3.0);
            battery.tube = battery.tube.filter(|_| !battery.is_settled);
        }
        let leaves = battery.duty == Duty::Serving && departure == Departure::Free;
        let moves = drone.moves() || apart(drone.goal, estimated) > 0.01;
        if joins && let Some(since) = rotation.since.get_mut(index) {
            *since = Some(now);
        }
        if member.killed.is_none() {
            self.drain(index);
        }
        if leaves {
            self.go_home(rotation, flight, index, false);
        }
        moves
    }

    fn switch_off(&mut self, index: usize) {
        let now = self.now;
        if let Some(member) = self.members.get_mut(index) {
            member.killed = Some(now);
        }
        if let Some(medium) = &mut self.medium {
            medium.switch_off(index);
        }
    }

    /// Switches relay `index` (from 0) on. If `spare` is true, the relay waits outside of the chain. Otherwise it joins
    /// at once, like a relay that was lost and returns.
    fn switch_on(&mut self, index: usize, spare: bool) {
        let node = u16::try_from(index + 1).unwrap_or(u16::MAX);
        self.setup.spares.retain(|other| *other != node);
        if spare {
            self.setup.spares.push(node);
        }
        self.boot(index);
        self.drain(index);
    }

    /// Lets drone `index` (from 0) fly home. `forced` is true if its relay has no permission to leave the chain.
    fn go_home(&mut self, rotation: &mut Rotation, flight: &Flight, index: usize, forced: bool) {
        let now = self.now;
        let Some(at) = flight.drones.get(index).map(Drone::estimated_position) else {
            return;
        };
        let tube = rotation.free_tube(true);
        let path = rotation.way_home(at, tube);
        let left_s = rotation.left_s(index, at);
        let is_complete = rotation.record.complete_at.is_some();
        let joined = rotation.since.get_mut(index).and_then(Option::take);
        let Some(battery) = rotation.drones.get_mut(index) else {
            return;
        };
        battery.duty = Duty::Home { path, tube };
        battery.tube = None;
        battery.is_reported = false;
        let waited_s = battery
            .requested
            .take()
            .map_or(0.0, |at| seconds(now.since(at)));
        let record = &mut rotation.record;
        if is_complete {
            record.replaced += 1;
            record.forced += u32::from(forced);
            record.waits_s += waited_s;
            let served_s = joined.map_or(0.0, |from| seconds(now.since(from)));
            record.possible_s += served_s + left_s;
            record.longest_wait_s = record.longest_wait_s.max(waited_s);
            let least_s = record.least_left_s.unwrap_or(f64::INFINITY);
            record.least_left_s = Some(least_s.min(left_s + crate::simulator::rotation::RESERVE_S));
        }
        if waited_s > 0.0 {
            let lower_s = rotation.slot_s + (waited_s - rotation.slot_s) / 8.0;
            rotation.slot_s = waited_s.max(lower_s);
        }
        if forced || !rotation.spec.announced {
            self.switch_off(index);
            self.log(index, TimelineEvent::Silent, None);
        } else if let Some(member) = self.members.get_mut(index) {
            member.relay.handle_control(now, false);
            self.drain(index);
        }
    }

    /// Makes the pilots' decisions: they send spares, request departures, and report drones that have left.
    fn decide(&mut self, rotation: &mut Rotation, flight: &Flight) {
        let now = self.now;
        let mut tired: Vec<(usize, f64)> = Vec::new();
        for index in 0..rotation.drones.len() {
            if let Some(drone) = rotation.drones.get(index)
                && drone.duty == Duty::Serving
                && let Some(at) = flight.true_position(index)
            {
                tired.push((index, rotation.left_s(index, at)));
            }
        }
        tired.sort_by(|one, other| one.1.total_cmp(&other.1));
        // The latest time of each request. Departures follow each other. In a long chain several drones depart in one slot,
        // if they are far enough apart. With n spares the n-th next departure needs the drone that this departure frees:
        // after its way home, its time on the ground and its way out.
        let at_once = (usize::from(rotation.spec.flying) / APART).clamp(1, AT_ONCE);
        let (slot_s, queue_s) = match at_once {
            1 => (rotation.slot_s, 0.0),
            _ => (
                SLOT_S / at_once as f64,
                QUEUE_S.min(0.1 * rotation.spec.endurance_s),
            ),
        };
        let all = usize::from(self.setup.mission.relays());
        let spares = all.saturating_sub(usize::from(rotation.spec.flying)).max(1);
        let distance_m = f64::from(self.setup.mission.config().distance_m);
        let altitude_m = f64::from(self.setup.mission.config().common.altitude_m);
        let far_out = rotation.way_out(distance_m, altitude_m, 0);
        let flight_s = 2.0 * Rotation::time_s([-20.0, 0.0, 0.0], &far_out);
        let cycle_s = rotation.slot_s + rotation.spec.ground_s + flight_s;
        let mut starts: Vec<(usize, f64, f64)> = Vec::new();
        for (index, left_s) in tired.iter().rev() {
            let after_s = |count: usize| {
                let later = starts
                    .len()
                    .checked_sub(count)
                    .and_then(|at| starts.get(at));
                later.map_or(f64::INFINITY, |(_, start_s, _)| start_s + queue_s)
            };
            let latest_s = left_s.min(after_s(1)) - slot_s;
            let latest_s = latest_s.min(after_s(spares) - cycle_s);
            starts.push((*index, latest_s - queue_s, *left_s));
        }
        starts.reverse();
        let serving = starts.len();
        self.send_spares(rotation, flight, &starts, serving);
        let standby = rotation.drones.iter().filter(|it| it.duty == Duty::Standby);
        let (waiting, moving): (Vec<_>, Vec<_>) =
            standby.partition(|it| now.since(it.hovers_since) >= HOVERS);
        let ready = moving.is_empty() || at_once > 1;
        let spares = if ready { waiting.len() } else { 0 };
        // Spares that the chain needs in any case are not there for a departure.
        let present = self.members.iter().zip(&rotation.drones);
        let present = present.filter(|(member, drone)| {
            let departure = member.relay.departure(now);
            let stays = !matches!(departure, Departure::Outside | Departure::Free);
            drone.duty == Duty::Serving && member.killed.is_none() && stays
        });
        let missing = usize::from(rotation.spec.flying).saturating_sub(present.count());
        let spares = spares.saturating_sub(missing);
        let mut requests = 0;
        for (at, (index, start_s, left_s)) in starts.into_iter().enumerate() {
            let Some(drone) = rotation.drones.get_mut(index) else {
                continue;
            };
            if !rotation.spec.announced {
                if left_s <= 0.0 {
                    self.go_home(rotation, flight, index, false);
                    self.join_as_lost(rotation);
                }
                continue;
            }
            requests += usize::from(drone.requested.is_some());
            let deadline_s = DEADLINE * if at_once > 1 { SLOT_S } else { slot_s };
            let is_due = left_s <= deadline_s || start_s <= MARGIN_S && spares > requests;
            let is_due =
                is_due && at < (at_once * at_once).max(2) && rotation.record.complete_at.is_some();
            if drone.requested.is_none() && is_due {
                drone.requested = Some(now);
                requests += 1;
            }
            let requested = rotation.drones.get(index).and_then(|drone| drone.requested);
            if requested.is_some()
                && let Some(member) = self.members.get_mut(index)
            {
                member.relay.leave(now, Some(whole(left_s)));
                self.drain(index);
            }
            if left_s < -RETREAT_S {
                self.go_home(rotation, flight, index, true);
            }
        }
        self.call_spare(rotation);
        self.report_gone(rotation, flight);
    }

    /// Simulates an operator who lets a waiting spare join if the chain has too few relays. Does nothing while a relay
    /// is leaving or joining.
    fn call_spare(&mut self, rotation: &Rotation) {
        let now = self.now;
        let mut present = 0;
        let mut waiting = None;
        for (index, (member, drone)) in self.members.iter().zip(&rotation.drones).enumerate() {
            let departure = member.relay.departure(now);
            let is_on = member.killed.is_none();
            match drone.duty {
                // One after the other: a spare joins once no drone is about to leave.
                Duty::Serving if departure == Departure::Outside => return,
                Duty::Serving => present += u16::from(is_on && departure != Departure::Free),
                Duty::Standby if is_on && departure == Departure::Member => return,
                Duty::Standby if is_on && now.since(drone.hovers_since) >= HOVERS => {
                    waiting = waiting.or(Some(index));
                }
                _ => {}
            }
        }
        if rotation.spec.announced
            && present < rotation.spec.flying
            && let Some(index) = waiting
            && let Some(member) = self.members.get_mut(index)
        {
            member.relay.stay(now);
            self.drain(index);
        }
    }

    /// Sends at most one spare to its place beside the line, if too few spares are in the air.
    ///
    /// A spare is needed for each drone that has to leave soon, and for each missing drone.
    fn send_spares(
        &mut self,
        rotation: &mut Rotation,
        flight: &Flight,
        starts: &[(usize, f64, f64)],
        serving: usize,
    ) {
        let now = self.now;
        let is_up = |duty: &Duty| matches!(duty, Duty::Rising { .. } | Duty::Standby);
        let up = rotation
            .drones
            .iter()
            .filter(|drone| is_up(&drone.duty))
            .count();
        let missing = usize::from(rotation.spec.flying).saturating_sub(serving);
        let altitude_m = f64::from(self.setup.mission.config().common.altitude_m);
        let distance_m = f64::from(self.setup.mission.config().distance_m);
        let lead_s = |x_m: f64| {
            let path = rotation.way_out(x_m, altitude_m, 0);
            Rotation::time_s([-20.0, 0.0, 0.0], &path) + EARLY_S
        };
        let wanted = starts.iter().filter(|(index, start_s, _)| {
            let x_m = flight.true_position(*index).map_or(0.0, |at| at[0]);
            *start_s <= lead_s(x_m)
        });
        let wanted: Vec<usize> = wanted.map(|(index, ..)| *index).collect();
        if up >= wanted.len() + missing || now.since(rotation.last_take_off) < TAKE_OFFS {
            return;
        }
        let near = wanted.get(up.saturating_sub(missing)).copied();
        let near = near
            .or(starts.first().map(|(index, ..)| *index))
            .unwrap_or(0);
        let ready = rotation.drones.iter().enumerate();
        let ready = ready.filter(|(_, drone)| matches!(drone.duty, Duty::Ground(at) if at <= now));
        let mut ready: Vec<usize> = ready.map(|(index, _)| index).collect();
        ready.sort_by_key(|index| index.abs_diff(near));
        for index in ready {
            let gap = Self::gap(rotation, index);
            let is_taken = rotation
                .drones
                .iter()
                .enumerate()
                .any(|(other, drone)| is_up(&drone.duty) && Self::gap(rotation, other) == gap);
            if is_taken {
                continue;
            }
            let [from_m, to_m] = Self::gap_m(rotation, flight, gap, distance_m);
            let tube = rotation.free_tube(false);
            let mut path = rotation.way_out(f64::midpoint(from_m, to_m), altitude_m, tube);
            if let Some(drone) = rotation.drones.get_mut(index)
                && let Some(pad) = path.pop_front()
            {
                drone.used_s = 0.0;
                drone.requested = None;
                drone.duty = Duty::Rising { path };
                drone.tube = Some(tube);
                rotation.last_take_off = now;
                self.take_off_from.push((index, pad));
            }
            return;
        }
    }

    /// Returns the nearest drones in the chain with a lower and with a higher number than drone `index`.
    ///
    /// The first is toward Tx, the second toward Rx; all numbers are from 0. `None` if there is no such drone on that
    /// side.
    fn gap(rotation: &Rotation, index: usize) -> [Option<usize>; 2] {
        let serves = |other: &usize| {
            rotation
                .drones
                .get(*other)
                .is_some_and(|drone| drone.duty == Duty::Serving)
        };
        [
            (0..index).rev().find(serves),
            (index + 1..rotation.drones.len()).find(serves),
        ]
    }

    fn gap_m(
        rotation: &Rotation,
        flight: &Flight,
        [before, after]: [Option<usize>; 2],
        distance_m: f64,
    ) -> [f64; 2] {
        let x_m = |index: Option<usize>| Some(flight.true_position(index?)?[0]);
        // Beyond an end of the chain: a spacing of the chain.
        let serves = |index: &usize| {
            rotation
                .drones
                .get(*index)
                .is_some_and(|it| it.duty == Duty::Serving)
        };
        let spacing_m =
            |end: f64, next: Option<f64>| next.map_or(distance_m, |next| (next - end).abs());
        match (x_m(before), x_m(after)) {
            (Some(from), Some(to)) => [from, to],
            (Some(from), None) => {
                let next = x_m(before.and_then(|at| (0..at).rev().find(serves)));
                [from, distance_m.min(from + spacing_m(from, next))]
            }
            (None, Some(to)) => {
                let next = x_m(after.and_then(|at| (at + 1..rotation.drones.len()).find(serves)));
                [(to - spacing_m(to, next)).max(0.0), to]
            }
            (None, None) => [0.0, distance_m],
        }
    }

    /// Switches on the relay of one waiting spare after a drone has left without announcement. It joins at once, like a
    /// relay that was lost and returns.
    fn join_as_lost(&mut self, rotation: &Rotation) {
        let waits = |index: &usize| {
            let off = self
                .members
                .get(*index)
                .is_some_and(|it| it.killed.is_some());
            off && rotation
                .drones
                .get(*index)
                .is_some_and(|it| it.duty == Duty::Standby)
        };
        if let Some(index) = (0..rotation.drones.len()).find(waits) {
            self.switch_on(index, false);
        }
    }

    /// Simulates operators who report to neighbouring relays that a drone has left the line.
    ///
    /// They report it once when it has left, and again to a relay whose setpoint is held because of the drone.
    fn report_gone(&mut self, rotation: &mut Rotation, flight: &Flight) {
        let now = self.now;
        let is_clear = |index: usize| {
            flight
                .true_position(index)
                .is_some_and(|at| at[1].abs() >= rotation.spacing_m)
        };
        let drones = rotation.drones.iter().enumerate();
        let seen: Vec<(bool, bool)> = drones
            .map(|(index, drone)| match drone.duty {
                Duty::Ground(_) | Duty::Rising { .. } | Duty::Standby => (false, false),
                Duty::Serving => (true, false),
                Duty::Home { .. } => {
                    let is_clear = is_clear(index);
                    (!is_clear, is_clear && !drone.is_reported)
                }
            })
            .collect();
        for (drone, (_, has_left)) in rotation.drones.iter_mut().zip(&seen) {
            drone.is_reported |= has_left;
        }
        for index in 0..self.members.len() {
            for side in [Side::Upstream, Side::Downstream] {
                let Some(member) = self.members.get(index).filter(|it| it.killed.is_none()) else {
                    continue;
                };
                let [before, after] = member.relay.neighbours();
                let (from, to) = match side {
                    Side::Upstream => (before.map_or(0, usize::from), index),
                    Side::Downstream => (
                        index + 1,
                        after.map_or(self.members.len(), |it| usize::from(it) - 1),
                    ),
                };
                let between = seen.get(from..to).unwrap_or_default();
                let reason = member.relay.hold_reason(side);
                let waits = matches!(reason, Some(HoldReason::Lost | HoldReason::NotFlown));
                if (waits || between.iter().any(|(_, has_left)| *has_left))
                    && !between.iter().any(|(is_on_line, _)| *is_on_line)
                    && let Some(member) = self.members.get_mut(index)
                {
                    member.relay.clear_lost(now, side);
                    self.drain(index);
                }
            }
        }
    }

    /// Puts the drones that take off at this step on the ground at their starting places.
    fn put_on_pads(&mut self, flight: &mut Flight) {
        for (index, pad) in std::mem::take(&mut self.take_off_from) {
            if let Some(drone) = flight.drones.get_mut(index) {
                drone.put(pad);
            }
        }
    }
}

/// Number of relays of a chain for each drone that departs at the same time.
const APART: usize = 6;

/// Time of a replacement, s, as far as a pilot knows it before the first one.
const SLOT_S: f64 = 90.0;

/// Time, s, by which requests to leave are earlier in a chain in which drones depart together. The
/// leader then has several to choose from, and selects those that are far enough apart.
const QUEUE_S: f64 = 270.0;

/// Time, s, for which a drone without permission stays after it should have started home. Then it flies home without
/// permission.
const RETREAT_S: f64 = 60.0;
