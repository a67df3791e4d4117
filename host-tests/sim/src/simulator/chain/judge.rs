//! Updates of the run's statistics after each event.

use std::ops::Range;

use uav_relay::{Event, Instant, Method, Phase, Placement, Side, Wiring};

use super::{Chain, ChangedRelays, Member, QueuedEvent, Station};
use crate::simulator::drones::point;
use crate::simulator::outcome::{Ending, Moment, TimelineEvent};
use crate::simulator::route::RelayState;
use crate::simulator::watch::{ObservedState, Run, Watch, longest};

impl Chain {
    /// Starts the statistics of the run.
    ///
    /// `run` simulates a fault-free chain, whose positions are the reference for the statistics.
    pub(super) fn begin_watch(&mut self, run: Run) {
        let seen = self.members.iter().map(observed_state).collect();
        self.watch = Some(Watch::new(seen, run));
    }

    /// Updates the run's records and statistics after an event that may have changed the relays `changed`. The data
    /// traffic and the availability are computed from them.
    pub(super) fn update_statistics(&mut self, changed: ChangedRelays) {
        if changed == ChangedRelays::None {
            return;
        }
        self.track(changed);
        let Some(mut watch) = self.watch.take() else {
            return;
        };
        self.update_watch(&mut watch, changed);
        self.watch = Some(watch);
    }

    /// Records the present states of the relays `changed`. The data traffic is computed from these records after the
    /// run.
    fn track(&mut self, changed: ChangedRelays) {
        let Some(mut track) = self.outcome.track.take() else {
            return;
        };
        let range = self.changed_indices(changed);
        let changed = self.members.get(range.clone()).unwrap_or_default();
        for (index, member) in range.zip(changed) {
            let setpoint = member.relay.setpoint().map(point);
            let drone = self.drone(index);
            let state = RelayState {
                observed: ObservedState {
                    place: setpoint.map(|setpoint| drone.unwrap_or(setpoint)),
                    ..observed_state(member)
                },
                agreed: member.relay.agreed_place().map(point),
            };
            track.see(self.now, index, state);
        }
        self.outcome.track = Some(track);
    }

    /// Returns the indices, from 0, of the relays that an event may have changed.
    fn changed_indices(&self, changed: ChangedRelays) -> Range<usize> {
        match changed {
            ChangedRelays::One(index) => index..index + 1,
            _ => 0..self.members.len(),
        }
    }

    fn update_watch(&self, watch: &mut Watch, changed: ChangedRelays) {
        let range = self.changed_indices(changed);
        let mut is_new = changed == ChangedRelays::All;
        let fresh = self.members.get(range.clone()).unwrap_or_default();
        for (at, member) in range.zip(fresh) {
            is_new |= watch.record_state(at, observed_state(member));
        }
        if !is_new {
            return;
        }
        watch.count_time(self.now);
        watch.count_groups(self.now);
        if self.setup.soak.is_some() && self.setup.rotation.is_none() {
            let is_right = self.is_right(watch);
            watch.set_available(is_right);
        }
    }

    /// Returns true if the chain is available, which means at the positions of a run without faults.
    ///
    /// One of the longest chains that living relays can form must be at the positions that this chain reaches without
    /// faults. A chain too small for a quorum has no positions, and is not available.
    fn is_right(&self, watch: &mut Watch) -> bool {
        let on = |at: &usize| self.members.get(*at).is_some_and(|it| it.killed.is_none());
        let on: Vec<usize> = (0..self.members.len()).filter(on).collect();
        let links = |one, other| self.are_linked(one, other);
        let holds = |at: usize| {
            let seen = watch.states.get(at);
            seen.is_some_and(|one| one.place.is_some())
        };
        let (_, chains) = longest(&on, links, holds);
        for chain in chains {
            let seen: Vec<ObservedState> = chain
                .iter()
                .filter_map(|at| watch.states.get(*at).copied())
                .collect();
            let nodes: Vec<u16> = chain
                .iter()
                .map(|at| u16::try_from(at + 1).unwrap_or(u16::MAX))
                .collect();
            let places: Vec<_> = seen.iter().map(|one| one.place).collect();
            let version = seen.iter().map(|one| one.version).max().unwrap_or(0);
            if watch.optima.is_met(&self.setup, &nodes, version, &places) {
                return true;
            }
        }
        false
    }
}

fn observed_state(member: &Member) -> ObservedState {
    ObservedState::of(&member.relay, member.killed.is_none())
}

impl Chain {
    pub(super) fn ending(&self) -> Option<Ending> {
        if self.setup.true_interference.is_some() {
            return self.measurements_done.then_some(Ending::Soaked);
        }
        if self.pending_planned > 0 || self.setup.soak.is_some() {
            return None;
        }
        let killed = self.members.iter().any(|member| member.killed.is_some());
        if killed && self.setup.settings.wiring == Wiring::Pair {
            // Uploads cannot pass a silent relay on separate links.
            return self.all_noticed().then_some(Ending::Broken);
        }
        if self.stations.iter().any(Station::is_busy) {
            return None;
        }
        let phases = || {
            let living = self.members.iter().filter(|member| member.killed.is_none());
            living.map(|member| member.relay.phase())
        };
        let busy = |phase| {
            matches!(
                phase,
                Phase::Planning | Phase::Waiting | Phase::ViewChange | Phase::Idle
            )
        };
        if phases().any(busy) && !phases().any(|phase| phase == Phase::Infeasible) {
            return None;
        }
        let parts = self.parts();
        if is_cut(&parts) {
            return Some(Ending::NoQuorum);
        }
        let counted = parts.iter().filter(|part| is_counted(part));
        let largest = counted.max_by_key(|part| part.len())?;
        let is_in =
            |part: &[&Member], phase| part.iter().any(|member| member.relay.phase() == phase);
        if is_in(largest, Phase::Infeasible) {
            return Some(Ending::Infeasible);
        }
        let settled = self.accepted_positions >= largest.len()
            && holds(largest)
            && self.has_arrived()
            && self.all_hover();
        let others = parts
            .iter()
            .filter(|part| !std::ptr::eq(*part, largest))
            .all(|part| is_in(part, Phase::NoQuorum));
        (settled && others).then_some(Ending::Settled)
    }

    /// Ends the run at the time `soak` of the setup, if the next event, at the time `next`, is later.
    pub(super) fn end_soak(&mut self, next: Instant) {
        if let Some(until) = self.setup.soak
            && next > until
        {
            self.now = until;
            self.outcome.ending = Ending::Soaked;
        }
    }

    /// Groups the relays that are on into connected parts of the chain, in order from Tx.
    ///
    /// A part ends at a partition, and before a gap that is wider than the radio range.
    fn parts(&self) -> Vec<Vec<&Member>> {
        let mut parts: Vec<Vec<&Member>> = Vec::new();
        let mut last: Option<usize> = None;
        for (index, member) in self.members.iter().enumerate() {
            if member.killed.is_some() {
                continue;
            }
            match parts.last_mut() {
                Some(part)
                    if last.is_some_and(|last| {
                        index - last <= self.setup.radio_reach && !self.are_parted(last, index)
                    }) =>
                {
                    part.push(member);
                }
                _ => parts.push(vec![member]),
            }
            last = Some(index);
        }
        parts
    }

    /// Returns true if every relay that is off has been reported as lost by its neighbours that are on.
    fn all_noticed(&self) -> bool {
        let noticed = |by: usize, side| {
            let Some(member) = self.members.get(by) else {
                return true;
            };
            let key = (u16::try_from(by + 1).unwrap_or(u16::MAX), side);
            member.killed.is_some() || self.outcome.noticed.contains_key(&key)
        };
        self.members
            .iter()
            .enumerate()
            .filter(|(_, member)| member.killed.is_some())
            .all(|(silent, _)| {
                let before = silent
                    .checked_sub(1)
                    .is_none_or(|by| noticed(by, Side::Downstream));
                before && noticed(silent + 1, Side::Upstream)
            })
    }
}

/// Returns true if `part` is a complete view: all its relays, sorted by their indices in the view.
fn is_counted(part: &[&Member]) -> bool {
    part.iter().zip(1_u16..).all(|(member, index)| {
        member.relay.index() == index && usize::from(member.relay.mission().relays()) == part.len()
    })
}

/// Returns true if every part of the chain is too small for a quorum, and the relays know it.
///
/// They know it if each relay has detected its present neighbours, and one relay of each part has reported `NoQuorum`.
fn is_cut(parts: &[Vec<&Member>]) -> bool {
    parts.iter().all(|part| {
        let nodes = part.iter().map(|member| Some(member.node));
        let before = [None].into_iter().chain(nodes.clone());
        let after = nodes.skip(1).chain([None]);
        let closed = part
            .iter()
            .zip(before.zip(after))
            .all(|(member, (before, after))| member.relay.neighbours() == [before, after]);
        let cut = part
            .iter()
            .any(|member| member.relay.phase() == Phase::NoQuorum);
        let newest = part.iter().max_by_key(|member| member.relay.view());
        let before = newest.map_or(0, |member| member.relay.mission().relays());
        closed && cut && 2 * part.len() <= usize::from(before)
    })
}

/// Returns true if each relay of `part` has an agreed position, and their target SIRs are equal.
fn holds(part: &[&Member]) -> bool {
    let target = |member: &&Member| member.relay.target().map(f32::to_bits);
    part.iter()
        .all(|member| member.relay.phase() == Phase::Holding)
        && part.windows(2).all(|pair| match pair {
            [one, other] => target(one) == target(other),
            _ => true,
        })
}

impl Chain {
    /// Checks that the setpoint of relay `index` (from 0) is within its limits, and counts violations.
    ///
    /// It also records the SIR after each round of Algorithm 2. In a round each relay in turn improves its position.
    pub(super) fn check(&mut self, index: usize) {
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        let by = member.node;
        if let Some(place) = member.relay.setpoint()
            && member.safe != Some(place)
        {
            let config = member.relay.mission().config();
            let end = config.distance_m;
            // Allowed altitude: the configured one, or any in the band.
            let given = self.setup.profiles.iter().find(|(of, _)| *of == by);
            let altitude = given.map_or(config.common, |(_, own)| *own).altitude_m;
            let chosen = self.setup.settings.method != Method::Align
                && !self.setup.held.contains(&by)
                && (config.band.least_m..=config.band.most_m).contains(&place.altitude_m);
            let beside = config.lateral.least_m..=config.lateral.most_m;
            let aside = if self.setup.settings.method == Method::Joint {
                beside.contains(&place.y_m)
            } else {
                place.y_m.to_bits() == 0
            };
            let chosen = (0.0..=end).contains(&place.x_m)
                && aside
                && (chosen || place.altitude_m.to_bits() == altitude.to_bits());
            // With a guard, a drone may come from anywhere and be halted anywhere on its path. Its setpoint may leave
            // the box no farther than since the drone was engaged.
            let [low, high] = member.setpoint_bounds.unwrap_or([place; 2]);
            let guard = self.setup.settings.guard;
            let inside = guard.map_or(chosen, |guard| {
                let fence = guard.geofence;
                // The box grows with the line of an uploaded mission.
                let longer_m = end - self.setup.mission.config().distance_m;
                let most_x_m = fence.most_x_m + longer_m;
                [
                    (place.x_m, low.x_m, high.x_m, fence.least_x_m, most_x_m),
                    (
                        place.y_m,
                        low.y_m,
                        high.y_m,
                        fence.least_y_m,
                        fence.most_y_m,
                    ),
                    (
                        place.altitude_m,
                        low.altitude_m,
                        high.altitude_m,
                        fence.least_altitude_m,
                        fence.most_altitude_m,
                    ),
                ]
                .iter()
                .all(|(is, low, high, least, most)| {
                    (least.min(*low)..=most.max(*high)).contains(is)
                })
            });
            self.outcome.unsafe_setpoints += u64::from(!inside);
            // After an upload, the drone keeps its position until the next agreement.
            member.safe = inside.then_some(place);
        }
        member.setpoint_bounds = member.relay.setpoint().map(|place| {
            let [low, high] = member.setpoint_bounds.unwrap_or([place; 2]);
            let of = |low: Placement, pick: fn(f32, f32) -> f32| Placement {
                x_m: pick(low.x_m, place.x_m),
                y_m: pick(low.y_m, place.y_m),
                altitude_m: pick(low.altitude_m, place.altitude_m),
            };
            [of(low, f32::min), of(high, f32::max)]
        });
        if let Some((done, sir)) = member.relay.rounds()
            && sir > 0.0
            && self.outcome.rounds.len() <= usize::from(done)
        {
            // Algorithm 2 moves a relay only if this improves the worse of its two hops.
            debug_assert!(
                self.attacker.is_some()
                    || self.outcome.rounds.last().is_none_or(|last| sir >= *last),
                "round {done} has made the chain worse"
            );
            self.outcome.rounds.push(sir);
        }
    }
}

impl Chain {
    /// Takes all pending events from relay `index` (from 0) and logs them.
    pub(super) fn drain_events(&mut self, index: usize) {
        while let Some(member) = self.members.get_mut(index)
            && let Some(event) = member.relay.poll_event()
        {
            let by = member.node;
            let (what, other) = match event {
                Event::NeighbourLost { side, node } => {
                    self.outcome.noticed.insert((by, side), self.now);
                    (TimelineEvent::Lost(side), Some(node))
                }
                Event::NeighbourBack { side, node } => {
                    self.outcome.noticed.remove(&(by, side));
                    (TimelineEvent::Found(side), Some(node))
                }
                Event::NotHeard { node } => (TimelineEvent::NotHeard, Some(node)),
                Event::MissionMismatch { node } => (TimelineEvent::MissionMismatch, Some(node)),
                Event::KeyMismatch { node } => (TimelineEvent::KeyMismatch, Some(node)),
                Event::EpochWentBack { node } => (TimelineEvent::EpochWentBack, Some(node)),
                Event::DuplicateIndex { node } => (TimelineEvent::DuplicateIndex, Some(node)),
                Event::NewEstimate => (TimelineEvent::NewEstimate, None),
                Event::InterfererUnclear => (TimelineEvent::InterfererUnclear, None),
                Event::MayLeave => {
                    self.queue.put(self.now, index, QueuedEvent::Kill);
                    self.pending_planned += 1;
                    (TimelineEvent::MayLeave, None)
                }
                Event::MayLeaveTold { node, .. } => (TimelineEvent::MayLeaveTold, Some(node)),
                Event::SensorOff { node } => (TimelineEvent::SensorOff, Some(node)),
                Event::LeaseLapsed => (TimelineEvent::LeaseLapsed, None),
                Event::Converged => {
                    self.accepted_positions += 1;
                    (TimelineEvent::Converged, None)
                }
                Event::ViewAccepted => {
                    // The rounds so far belong to the previous view.
                    self.outcome.rounds.clear();
                    let what = TimelineEvent::ViewAccepted {
                        view: member.relay.view().number(),
                        index: member.relay.index(),
                        relays: member.relay.mission().relays(),
                        version: member.relay.version(),
                    };
                    (what, None)
                }
                Event::Uploaded => {
                    let upload = member.relay.upload().copied();
                    if !self.setup.forgetful.contains(&by) {
                        member.stored = upload;
                    }
                    let version = upload.map_or(0, |upload| upload.version());
                    (TimelineEvent::Uploaded(version), None)
                }
                Event::Adopted => (TimelineEvent::Adopted(member.relay.version()), None),
                Event::NoQuorum => (TimelineEvent::NoQuorum, None),
                Event::Infeasible => (TimelineEvent::Infeasible, None),
                _ => continue,
            };
            self.log(index, what, other);
        }
    }

    /// Adds an entry about relay `index` (from 0) to the log of the run. `other` is the second node that the entry
    /// concerns.
    pub(super) fn log(&mut self, index: usize, what: TimelineEvent, other: Option<u16>) {
        let Some(member) = self.members.get(index) else {
            return;
        };
        self.outcome.moments.push(Moment {
            at: self.now,
            relay: member.node,
            what,
            other,
            target: member.relay.target(),
            sweeps: member.begun(),
        });
    }

    /// Logs the partitions and one-way link failures that begin or end at the present time.
    pub(super) fn log_partitions(&mut self) {
        for deaf in self.setup.deaf.clone() {
            let by = usize::from(deaf.by).saturating_sub(1);
            if deaf.from == self.now {
                self.log(by, TimelineEvent::Deaf, Some(deaf.of));
            } else if deaf.until == Some(self.now) {
                self.log(by, TimelineEvent::Hears, Some(deaf.of));
            }
        }
        let relays = self.setup.mission.relays();
        for partition in self.setup.partitions.clone() {
            if !(1..relays).contains(&partition.after) {
                // This partition separates no relays.
                continue;
            }
            let last = usize::from(partition.after).saturating_sub(1);
            if partition.from == self.now {
                self.log(last, TimelineEvent::Partitioned, None);
            } else if partition.until == Some(self.now) {
                self.log(last, TimelineEvent::PartitionEnded, None);
            }
        }
    }

    pub(super) fn sweeps(&self) -> u32 {
        self.members.iter().map(Member::begun).sum()
    }
}

impl Member {
    /// Returns the number of passes and view proposals of this relay, those before its reboots included.
    ///
    /// A pass is a message that relays forward along the whole chain.
    fn begun(&self) -> u32 {
        self.swept + self.relay.stats().passes_begun
    }
}
