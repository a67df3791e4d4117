//! Ground stations of a run: uploads and measurements.

use uav_relay::MAX_FRAME;
use uav_relay::{Port, Side, Wiring};
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::Scene;

use super::super::outcome::{Moment, TimelineEvent};
use super::super::queue::QueuedEvent;
use super::super::record::Link;
use super::super::true_interference::TrueInterference;
use super::receiver::Receiver;
use super::state::Chain;

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
            self.tell_of_ground(spec.end, TimelineEvent::Offered(spec.upload.version()));
        }
        self.drain_station(at);
    }

    /// Handles bytes received by station `at`.
    pub(super) fn hear(&mut self, at: usize, bytes: &[u8]) {
        if let Some(station) = self.stations.get_mut(at) {
            station.ground.handle_bytes(bytes);
        }
        self.drain_station(at);
    }

    /// Handles the timer of station `at`.
    pub(super) fn ask(&mut self, at: usize) {
        let now = self.now;
        if let Some(station) = self.stations.get_mut(at)
            && station.wake == Some(now)
        {
            station.wake = None;
            station.ground.handle_timeout(now);
        }
        self.drain_station(at);
    }

    /// Measures the interference at every station and sends the results.
    pub(super) fn measure_at_ends(&mut self, sky: &TrueInterference, scene: &Scene) {
        for at in 0..self.stations.len() {
            if let Some(station) = self.stations.get_mut(at) {
                let power_w = match station.end {
                    Side::Upstream => sky.transmitter_w(scene, self.now, &mut self.rng),
                    Side::Downstream => {
                        let relays = self.setup.mission.relays();
                        sky.receiver_w(scene, self.now, relays, &mut self.rng)
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
            assert!(again > now, "the ground would spin");
            station.wake = Some(again);
            self.queue.put(again, at, QueuedEvent::Ask);
        }
    }

    /// Returns true if station `at` receives what relay `index` (from 0) sends through `port`.
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

    fn tell_of_ground(&mut self, end: Side, what: TimelineEvent) {
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
