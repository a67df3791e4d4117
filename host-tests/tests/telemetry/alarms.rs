//! Alarms on a station's page while frames are lost: false ones, and that of a lost relay.

use std::collections::BTreeMap;

use uav_relay::flight::autopilot::state::State;
use uav_relay::{Duration, Instant, Mission, Phase, Side};
use uav_relay_screen::station::{Frames, StationView};
use uav_relay_screen::{Alarm, chain};
use uav_relay_sim::simulator::chain::Chain;
use uav_relay_sim::simulator::medium::Access;

use crate::{flown, quantile, s, seconds, setup};

/// Number of relays of the chain.
const RELAYS: u16 = 8;

/// Time without a lease after which the page shows an alarm.
const EXPIRED: Duration = Duration::from_millis(5_000);

/// Longest time from a state of a relay to the alarm about it: the largest age of a report.
const LATE: Duration = Duration::from_millis(10_000);

/// Flight of eight relays with engaged drones, and the page of the station at Tx.
struct Flight {
    chain: Chain,
    mission: Mission,
    view: StationView,
    frames: Frames,
    now: Instant,
    /// Number of the newest alarm so far.
    known: u32,
}

impl Flight {
    fn new(seed: u64, loss: f64, kills: Vec<(u16, Instant)>, until: Instant) -> Self {
        let mut setup = flown(setup(RELAYS, Some(Access::Csma), s(1), until));
        setup.faults.loss = loss;
        setup.seed = seed;
        setup.kills = kills;
        setup.record = false;
        let mission = setup.mission;
        let mut chain = Chain::new(setup).unwrap();
        let now = s(1);
        chain.advance(now);
        for relay in 1..=RELAYS {
            chain.input(now, relay, |it| it.report_control(State::Engaged, false));
        }
        Self {
            chain,
            mission,
            view: StationView::default(),
            frames: Frames::default(),
            now,
            known: 0,
        }
    }

    /// Continues the flight until the next update of the page. Returns the alarms that have begun.
    fn step(&mut self) -> Vec<Alarm> {
        self.now = self.now + Duration::from_millis(200);
        self.chain.advance(self.now);
        let (reports, overheard) = self.chain.arrived(Side::Upstream);
        self.frames.received += u32::try_from(reports.len()).unwrap();
        self.view.overhear(self.now, overheard);
        let shown = chain::Chain {
            mission: Some(&self.mission),
            end: Side::Upstream,
            relays: RELAYS,
            flying: None,
            profiles: &[],
            is_estimated: false,
            axis: None,
            geofence: None,
        };
        let snapshot = self.view.snapshot(self.now, &shown, &reports, self.frames);
        let mut new = snapshot.alarms;
        new.retain(|it| it.number > self.known);
        self.known = new.iter().map(|it| it.number).fold(self.known, u32::max);
        new
    }
}

/// Times of a relay's own states that are alarms.
#[derive(Clone, Copy, Default)]
struct Own {
    /// Time since which the relay has an agreed position but no lease.
    leaseless_at: Option<Instant>,
    /// Last time at which the relay had no lease for long, or no quorum.
    alarmed_at: Option<Instant>,
}

/// Counts the false alarms of a flight without faults from `span[0]` on, by their texts.
///
/// An alarm about a lease or a quorum is true if a relay is in that state.
fn false_alarms(seed: u64, loss: f64, span: [Instant; 2]) -> BTreeMap<String, u32> {
    let mut flight = Flight::new(seed, loss, Vec::new(), span[1]);
    let (mut own, mut counts) = ([Own::default(); RELAYS as usize], BTreeMap::new());
    while flight.now < span[1] {
        let new = flight.step();
        let now = flight.now;
        for (relay, own) in flight.chain.live(now).zip(&mut own) {
            let is_leaseless = relay.report.agreed.is_some() && !relay.report.holds_lease;
            own.leaseless_at = is_leaseless.then(|| own.leaseless_at.unwrap_or(now));
            let has_expired = own.leaseless_at.is_some_and(|at| now.since(at) >= EXPIRED);
            if has_expired || relay.report.phase == Phase::NoQuorum {
                own.alarmed_at = Some(now);
            }
        }
        let is_near = |it: &Own| it.alarmed_at.is_some_and(|at| now.since(at) < LATE);
        for alarm in new.into_iter().filter(|_| now > span[0]) {
            let is_own = alarm.text.contains("expired") || alarm.text.contains("no quorum");
            if is_own && own.iter().any(is_near) {
                println!(
                    "seed {seed}, {:.1} s, true: {}",
                    seconds(now.since(s(0))),
                    alarm.text
                );
                continue;
            }
            let text = alarm.text.replace(|it: char| it.is_ascii_digit(), "#");
            *counts.entry(text).or_default() += 1;
        }
    }
    counts
}

#[test]
fn lost_frames_raise_few_false_alarms() {
    let number = |name, default| {
        std::env::var(name).map_or(default, |it: String| it.parse::<u64>().unwrap())
    };
    let (count, seed) = (number("COUNT", 4), number("SEED", 1));
    let span = [s(60), s(660)];
    let flight_h = f64::from(RELAYS) * seconds(span[1].since(span[0])) / 3_600.0;
    for (loss, most) in [(0.1, 0.0), (0.3, 0.3), (0.5, 1.0)] {
        let mut all = BTreeMap::<String, u32>::new();
        for seed in seed..seed + count {
            for (text, times) in false_alarms(seed, loss, span) {
                *all.entry(text).or_default() += times;
            }
        }
        let hours = flight_h * count as f64;
        let rate = f64::from(all.values().sum::<u32>()) / hours;
        println!(
            "{loss} of all frames lost, {hours:.1} relay-hours: {rate:.2} false alarms per relay-hour {all:?}"
        );
        assert!(rate <= most, "{loss}: {rate}");
    }
}

/// Checks that lost frames delay the alarm of a lost relay by 10 s at most.
#[test]
fn a_lost_relay_is_an_alarm_in_time_although_frames_are_lost() {
    // Usually the alarm takes 5 s. With losses the station waits for up to 15 s after the last report.
    for (loss, most_s) in [(0.0, 10.0), (0.3, 15.2), (0.5, 15.2)] {
        let mut took_s = Vec::new();
        for (relay, seed) in (1..=RELAYS).cycle().zip(1..=16) {
            let killed = s(100);
            let mut flight = Flight::new(seed, loss, vec![(relay, killed)], s(150));
            let (lost, silent) = (format!("relay {relay} lost"), format!("relay {relay}: no"));
            let is_its = |it: &Alarm| it.text.starts_with(&lost) || it.text.starts_with(&silent);
            while !flight.step().iter().any(is_its) || flight.now < killed {
                assert!(flight.now < s(149), "relay {relay}, loss {loss}: no alarm");
            }
            took_s.push(seconds(flight.now.since(killed)));
        }
        let took_s = [0.5, 0.95, 1.0].map(|share| quantile(&took_s, share));
        println!("relay lost, loss {loss}: alarm after (50 %, 95 %, most) {took_s:.1?} s");
        assert!(took_s[2] <= most_s, "{loss}: {took_s:?}");
    }
}
