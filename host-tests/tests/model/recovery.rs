//! Recovery from any state to one agreement after the end of all faults and a restart of the leader.

use proptest::{prop_assert, prop_assert_eq};
use uav_relay::{Duration, Relay, ViewId};

use super::Checked;
use super::chain::{MISS, World};
use super::scenario::{Calm, Kind};

/// Longest time to an agreement of a chain without faults, ms of virtual time.
const LONGEST_MS: u64 = 20_000;

/// Largest permitted number of further membership views after an agreement.
const MOST_VIEWS: u32 = 2;

/// Time of observation after the agreement, ms, in which no relay may be lost or move.
const WATCH_MS: u64 = 16_000;

impl World<'_> {
    /// Runs a chain without faults until it agrees on positions. Returns the agreement.
    pub(crate) fn calm(&mut self) -> Checked<Calm> {
        let took = self.agree(Duration::from_millis(LONGEST_MS))?;
        let target = self.ledgers[0].target.unwrap_or_default();
        Ok(Calm {
            places: self.places(),
            target: target.to_bits(),
            took_us: took.as_micros(),
        })
    }

    fn places(&self) -> Vec<[u32; 3]> {
        let setpoints = self.relays.iter().filter_map(Relay::setpoint);
        setpoints
            .map(|place| [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits))
            .collect()
    }

    /// Runs the chain until every relay has an agreed position for the same target SIR. Returns the time taken.
    fn agree(&mut self, at_most: Duration) -> Checked<Duration> {
        let begun = self.now;
        while !self.agrees() {
            let goes_on = self.flow(begun + at_most)?;
            prop_assert!(
                goes_on,
                "no agreement within {} ms: {:?}",
                at_most.as_micros() / 1_000,
                self.ledgers
            );
        }
        Ok(self.now.since(begun))
    }

    /// Returns the longest time that the chain may take to agree after the leader restarts the agreement.
    ///
    /// The time allows for one lost message in each direction of each link. A relay that waits for a result over h hops
    /// retransmits after 9/8 of (2 h + 2) `hop_time`.
    fn patience(&self) -> Duration {
        let hop_us = self.scenario.settings[0].hop_time.as_micros();
        let hops = 1..self.relays.len() as u64;
        let waits: u64 = hops.map(|hops| (2 * hops + 2) * hop_us * 9 / 8).sum();
        // Lost handshakes are repeated after enough silence.
        let greets = if self.scenario.signs() { 2 } else { 0 };
        let probe_after_us = self.scenario.settings[0].probe_after.as_micros();
        let silence_us = greets * probe_after_us + 2 * self.view_request_time().as_micros();
        // A rebooted relay may have forgotten its view. New positions are used only after the lease of that view has
        // expired.
        let lease_us = self.scenario.settings[0].dead_after.as_micros();
        Duration::from_micros(self.scenario.calm.took_us + 4 * waits + silence_us + lease_us)
    }

    /// Returns the longest time that a request for a membership view takes to the leader. Each relay may wait for
    /// `probe_after` before it forwards the request.
    fn view_request_time(&self) -> Duration {
        let calls = self.relays.len() as u64 - 1;
        let probe_after_us = self.scenario.settings[0].probe_after.as_micros();
        Duration::from_micros(calls * probe_after_us)
    }

    /// Checks that the target SIR agreed by Algorithm 2 is the SIR of the chain's worst hop. By other methods, the
    /// worst hop may have a higher SIR than the target.
    fn check_stated_target(&self) -> Checked {
        if self.scenario.kind == Kind::Adjust
            && let Some(target) = self.ledgers[0].target
        {
            let places: Vec<_> = self.ledgers.iter().map(|ledger| ledger.place).collect();
            let hops = self.scenario.reference.hops(&places);
            let worst = hops.into_iter().fold(f64::INFINITY, f64::min);
            prop_assert!(
                (worst / f64::from(target) - 1.0).abs() <= MISS,
                "{target} is said of a chain that has {worst}"
            );
        }
        Ok(())
    }

    /// Waits for membership views that were requested before the agreement. After each view the chain agrees once more.
    fn settle(&mut self, at_most: Duration) -> Checked {
        for _ in 0..MOST_VIEWS {
            let views: Vec<ViewId> = self.relays.iter().map(Relay::view).collect();
            let until = self.now + self.view_request_time();
            while self.flow(until)? {}
            if self.relays.iter().map(Relay::view).eq(views) {
                return Ok(());
            }
            self.tally.add("views after an agreement");
            self.agree(at_most)?;
        }
        prop_assert!(false, "views without end");
        Ok(())
    }

    /// Ends a sequence of operations: repairs the chain, and checks that it agrees. Returns the time taken.
    pub(crate) fn recover(&mut self) -> Checked<Duration> {
        (0..self.wires.links()).for_each(|link| self.wires.join(link));
        self.wires.hurry_all(self.now);
        self.restart()?;
        let at_most = match self.scenario.kind {
            Kind::Measured => Duration::from_millis(LONGEST_MS),
            _ => self.patience(),
        };
        let took = self.agree(at_most)?;
        self.settle(at_most)?;
        let places = self.places();
        if self.scenario.kind != Kind::Measured {
            let target = self.relays[0].target().map(f32::to_bits);
            prop_assert_eq!(target, Some(self.scenario.calm.target), "another target");
            prop_assert_eq!(&places, &self.scenario.calm.places, "other places");
        }
        self.check_stated_target()?;
        let until = self.now + Duration::from_millis(WATCH_MS);
        while self.flow(until)? {}
        prop_assert_eq!(&self.places(), &places, "moved after the agreement");
        for ledger in &self.ledgers {
            prop_assert!(ledger.misses_nobody(), "{ledger:?}");
        }
        Ok(took)
    }
}
