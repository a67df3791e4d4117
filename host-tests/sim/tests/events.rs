//! Events for the operator name the node and the cause.
#![cfg(test)]
#![allow(clippy::unnecessary_wraps, clippy::redundant_closure_for_method_calls)]

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::{
    Auth, Event, Ground, Identity, Instant, Interference, Interferer, Key, MAX_FRAME, Mission,
    MissionConfig, Port, Progress, Relay, Settings, Side, Upload, Wiring,
};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission::mission as of_scenario;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::faults::OneWayFailure;
use uav_relay_sim::simulator::outcome::{Moment, Outcome, TimelineEvent};
use uav_relay_sim::simulator::setup::Setup;

fn at(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}

fn of(outcome: &Outcome, what: fn(TimelineEvent) -> bool) -> Vec<(u16, Option<u16>)> {
    let moments = outcome.moments.iter().filter(|moment| what(moment.what));
    moments
        .map(|&Moment { relay, other, .. }| (relay, other))
        .collect()
}

/// Checks the numbers in the reports of a lost neighbour and of the new neighbour in its place.
///
/// Relay 3 of five is switched off, so that relays 2 and 4 report the loss of 3, and then find each other.
#[test]
fn lost_and_found_relays_are_reported_by_index() {
    let mut setup = Setup::on_shared_channel(mission(5)).soaked(at(200));
    setup.kills = vec![(3, at(60))];
    let outcome = run(setup).unwrap();
    let mut lost = of(&outcome, |what| matches!(what, TimelineEvent::Lost(_)));
    lost.sort_unstable();
    assert_eq!(lost, [(2, Some(3)), (4, Some(3))]);
    let found = of(&outcome, |what| matches!(what, TimelineEvent::Found(_)));
    assert!(
        found.contains(&(2, Some(4))) && found.contains(&(4, Some(2))),
        "{found:?}"
    );
    assert!(
        found.iter().all(|(_, other)| *other != Some(3)),
        "{found:?}"
    );
}

/// Checks that a relay learns which neighbour does not receive it.
///
/// Relay 3 does not receive relay 2, but relay 2 receives relay 3. Relay 2 must report that relay 3 does not receive
/// it.
#[test]
fn a_relay_that_is_not_received_is_reported() {
    let mut setup = Setup::on_shared_channel(mission(4)).soaked(at(300));
    setup.deaf = vec![OneWayFailure {
        by: 3,
        of: 2,
        from: at(60),
        until: None,
    }];
    let outcome = run(setup).unwrap();
    assert_eq!(
        of(&outcome, |what| what == TimelineEvent::NotHeard),
        [(2, Some(3))]
    );
}

/// Checks that lost and corrupted frames cause no false reports about other nodes.
///
/// Such a report says that a node does not receive the reporting relay, has a different key or mission, or uses an old
/// epoch or a duplicate index.
#[test]
fn a_bad_channel_causes_no_false_reports() {
    for seed in 1..=3 {
        let mut setup = Setup::on_shared_channel(mission(5)).soaked(at(300));
        setup.faults.loss = 0.3;
        setup.faults.corrupt = 0.1;
        setup.auth = true;
        setup.seed = seed;
        let outcome = run(setup).unwrap();
        let told = of(&outcome, |what| {
            let causes = [
                TimelineEvent::NotHeard,
                TimelineEvent::MissionMismatch,
                TimelineEvent::KeyMismatch,
                TimelineEvent::EpochWentBack,
                TimelineEvent::DuplicateIndex,
            ];
            causes.contains(&what)
        });
        assert_eq!(told, [], "seed {seed}");
    }
}

/// Checks that relays report a missing quorum only once, although they keep requesting a view.
///
/// Two of five relays are too few for a quorum.
#[test]
fn a_lost_quorum_is_reported_once() {
    let mut setup = Setup::on_shared_channel(mission(5)).soaked(at(600));
    setup.kills = vec![(1, at(60)), (2, at(60)), (3, at(60))];
    let outcome = run(setup).unwrap();
    for what in [TimelineEvent::NoQuorum, TimelineEvent::LeaseLapsed] {
        let mut told = outcome.moments.clone();
        told.retain(|moment| moment.what == what);
        let mut by: Vec<u16> = told.iter().map(|moment| moment.relay).collect();
        by.sort_unstable();
        assert_eq!(by, [4, 5], "{what:?}");
    }
}

/// Time step of the simulated channel, ms. A frame arrives one step after it was sent.
const STEP_MS: u64 = 10;

pub(crate) const KEY: [u8; 32] = [7; 32];

pub(crate) fn auth(key: [u8; 32], epoch: u32) -> Option<Auth> {
    let key = Key::new(key);
    Some(Auth { key, epoch })
}

pub(crate) struct Air {
    pub(crate) relays: Vec<Relay>,
    /// State of each relay, by index from 0: true if it is switched off.
    pub(crate) off: Vec<bool>,
    pub(crate) ground: Option<Ground>,
    /// Probability that a receiver loses a frame.
    pub(crate) loss: f64,
    pub(crate) now: Instant,
    /// Events reported so far, each with the index (from 0) of the relay that reported it.
    pub(crate) told: Vec<(usize, Event)>,
    /// Frames that the ground station sent and the attacker has withheld. The function `withheld` selects them.
    pub(crate) recorded: Vec<Vec<u8>>,
    pub(crate) withheld: fn(&[u8]) -> bool,
    /// Frames on the air, each with the index (from 0) of its sender; `usize::MAX` if that is no relay.
    flying: Vec<(usize, Vec<u8>)>,
    rng: ChaCha8Rng,
}

impl Air {
    pub(crate) fn new(relays: Vec<Relay>, loss: f64, seed: u64) -> Self {
        Self {
            off: vec![false; relays.len()],
            relays,
            ground: None,
            loss,
            now: Instant::ZERO,
            told: Vec::new(),
            recorded: Vec::new(),
            withheld: |_| false,
            flying: Vec::new(),
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Creates a chain of relays with the keys and epochs that `auth` returns for each index, from 1.
    ///
    /// `loss` is the probability that a receiver loses a frame.
    pub(crate) fn of(mission: &Mission, auth: impl Fn(u16) -> Option<Auth>, loss: f64) -> Self {
        let relays = (1..=mission.relays())
            .map(|index| relay(mission, index, auth(index), Instant::ZERO))
            .collect();
        Self::new(relays, loss, 1)
    }

    pub(crate) fn join(&mut self, relay: Relay) -> usize {
        self.relays.push(relay);
        self.off.push(false);
        self.relays.len() - 1
    }

    pub(crate) fn run(&mut self, seconds: u64) {
        for _ in 0..seconds * 1_000 / STEP_MS {
            self.now = Instant::from_micros(self.now.as_micros() + 1_000 * STEP_MS);
            self.step();
        }
    }

    fn step(&mut self) {
        let now = self.now;
        let count = self.relays.len();
        for (from, bytes) in std::mem::take(&mut self.flying) {
            for (at, relay) in self.relays.iter_mut().enumerate() {
                if at != from && !self.off[at] && !self.rng.random_bool(self.loss) {
                    relay.handle_bytes(now, Port::Shared, &bytes);
                }
            }
            if from != usize::MAX
                && let Some(ground) = &mut self.ground
                && !self.rng.random_bool(self.loss)
            {
                ground.handle_bytes(&bytes);
            }
        }
        for at in 0..count {
            if self.off[at] {
                continue;
            }
            let relay = &mut self.relays[at];
            if relay.poll_timeout().is_some_and(|due| due <= now) {
                relay.handle_timeout(now);
            }
            let mut frame = [0; MAX_FRAME];
            relay.persist(|_| true);
            while let Some(transmit) = relay.poll_transmit(now, &mut frame) {
                self.flying.push((at, frame[..transmit.len].to_vec()));
            }
            while let Some(event) = relay.poll_event() {
                self.told.push((at, event));
            }
            assert!(relay.poll_timeout().is_none_or(|due| due > now), "it spins");
        }
        if let Some(ground) = &mut self.ground {
            ground.handle_timeout(now);
            let mut frame = [0; MAX_FRAME];
            while let Some(len) = ground.poll_transmit(&mut frame) {
                let bytes = frame[..len].to_vec();
                if (self.withheld)(&bytes) {
                    self.recorded.push(bytes);
                } else {
                    self.flying.push((usize::MAX, bytes));
                }
            }
        }
    }

    /// Sends `bytes` to all nodes, from a sender that is no relay.
    pub(crate) fn play(&mut self, bytes: &[u8]) {
        self.flying.push((usize::MAX, bytes.to_vec()));
    }

    /// Returns the index (from 0) of the reporting relay for each report of `event`.
    pub(crate) fn reporters(&self, event: Event) -> Vec<usize> {
        let told = self.told.iter().filter(|(_, told)| *told == event);
        told.map(|(by, _)| *by).collect()
    }
}

pub(crate) fn settings(auth: Option<Auth>) -> Settings {
    Settings {
        wiring: Wiring::Shared,
        auth,
        ..Settings::default()
    }
}

pub(crate) fn relay(mission: &Mission, index: u16, auth: Option<Auth>, now: Instant) -> Relay {
    let identity = Identity { network: 7, index };
    let seed = u32::from(index) + u32::try_from(now.as_micros() / 1_000).unwrap();
    Relay::new(*mission, identity, settings(auth), seed, now).unwrap()
}

pub(crate) fn mission(relays: u16) -> Mission {
    of_scenario(&Scenario::default(), relays, 1e-4).unwrap().0
}

const TAKEN: Event = Event::DuplicateIndex { node: 3 };

/// Returns a chain of five relays that have positions, and an added second relay with the number 3.
///
/// The second value is the index (from 0) of the added relay.
fn joined(loss: f64, seed: u64) -> (Air, usize) {
    let mission = mission(5);
    let begun = Instant::ZERO;
    let relays = (1..=5).map(|index| relay(&mission, index, None, begun));
    let mut air = Air::new(relays.collect(), loss, seed);
    // The second relay appears at a varying time between two passes.
    air.run(90 + seed % 7);
    assert!(air.relays.iter().all(|relay| relay.setpoint().is_some()));
    assert!(air.reporters(TAKEN).is_empty());
    let other = air.join(relay(&mission, 3, None, air.now));
    (air, other)
}

fn count() -> u64 {
    std::env::var("COUNT").map_or(20, |text| text.parse().unwrap())
}

/// Checks that the relay that joins with the number of an active relay gets no setpoint. Both relays must report the
/// duplicate.
///
/// Runs `COUNT` chains for each loss rate; `COUNT` is an environment variable.
#[test]
fn the_later_of_two_duplicates_gets_no_setpoint() {
    for loss in [0.0, 0.3, 0.5] {
        for seed in 0..count() {
            let (mut air, other) = joined(loss, seed);
            let places: Vec<_> = air.relays.iter().map(Relay::setpoint).collect();
            for _ in 0..120 {
                air.run(1);
                let given = air.relays[other].setpoint();
                assert_eq!(given, None, "loss {loss}, seed {seed}, {:?}", air.now);
            }
            assert!(air.relays[other].is_passive() && !air.relays[2].is_passive());
            let mut told = air.reporters(TAKEN);
            told.sort_unstable();
            told.dedup();
            assert_eq!(told, [2, other], "loss {loss}");
            if loss == 0.0 {
                let after: Vec<_> = air.relays.iter().map(Relay::setpoint).collect();
                assert_eq!(after[..5], places[..5]);
            }
        }
    }
}

#[test]
fn a_duplicate_joins_when_the_other_one_is_gone() {
    for by_hand in [false, true] {
        let (mut air, other) = joined(0.0, 1);
        air.run(10);
        assert!(air.relays[other].is_passive());
        air.off[2] = true;
        if by_hand {
            let now = air.now;
            air.relays[other].clear_duplicate_index(now);
            assert!(!air.relays[other].is_passive());
        }
        air.run(20);
        assert_eq!(air.relays[other].is_passive(), !by_hand);
        air.run(100);
        assert!(!air.relays[other].is_passive());
        assert!(air.relays[other].setpoint().is_some(), "it is relay 3 now");
    }
}

/// Checks that only one of two relays with the same number flies in the end. The two relays start at the same time. One
/// of them becomes passive, which means that it gets no setpoint.
#[test]
fn one_of_two_simultaneous_duplicates_flies() {
    for seed in 0..6 {
        let mission = mission(4);
        let mut air = Air::of(&mission, |_| None, 0.1 * (seed % 3) as f64);
        let mut other = relay(&mission, 3, None, Instant::from_millis(77 + seed));
        other.handle_timeout(air.now);
        let other = air.join(other);
        air.run(400);
        let down = [2, other].map(|at| air.relays[at].is_passive());
        assert_eq!(down[0], !down[1], "seed {seed}");
        let flies = if down[0] { other } else { 2 };
        assert!(air.relays[flies].setpoint().is_some());
        assert!(air.reporters(TAKEN).contains(&2) && air.reporters(TAKEN).contains(&other));
    }
}

/// Checks that of two relays with the same number, the one with the larger epoch stays active.
///
/// Both relays have the network key. The relay with the smaller epoch becomes passive: it gets no setpoint, and reports the duplicate.
#[test]
fn with_a_key_the_duplicate_with_the_larger_epoch_stays() {
    for (epoch, first_stays) in [(1, true), (9, false)] {
        let mission = mission(5);
        let mut air = Air::of(&mission, |_| auth(KEY, 5), 0.0);
        air.run(90);
        let other = air.join(relay(&mission, 3, auth(KEY, epoch), air.now));
        air.run(240);
        let silent = if first_stays { other } else { 2 };
        assert!(air.reporters(TAKEN).contains(&silent), "{epoch}");
        assert_eq!(air.relays[2].setpoint().is_some(), first_stays, "{epoch}");
        assert_eq!(air.relays[2].is_passive(), !first_stays, "{epoch}");
        assert_eq!(
            air.relays[other].setpoint().is_some(),
            !first_stays,
            "{epoch}"
        );
    }
}

/// Checks that an attacker without the key makes no relay passive. The attacker can make relays report a duplicate. A
/// passive relay gets no setpoint.
#[test]
fn forged_frames_make_no_relay_passive() {
    let mission = mission(3);
    let mut air = Air::of(&mission, |_| auth(KEY, 1), 0.0);
    air.run(60);
    let mut liar = relay(&mission, 2, auth([1; 32], 99), air.now);
    let mut frame = [0; MAX_FRAME];
    for _ in 0..60 {
        liar.persist(|_| true);
        while let Some(transmit) = liar.poll_transmit(air.now, &mut frame) {
            air.play(&frame[..transmit.len]);
        }
        air.run(1);
        liar.handle_timeout(air.now);
    }
    assert_eq!(air.reporters(Event::DuplicateIndex { node: 2 }), [1]);
    assert!(
        air.relays
            .iter()
            .all(|relay| relay.setpoint().is_some() && !relay.is_passive())
    );
}

/// Checks that a relay with a wrong key and its neighbours report each other once.
#[test]
fn a_key_mismatch_is_reported_with_the_node() {
    for loss in [0.0, 0.3] {
        let key = |index| if index == 2 { [1; 32] } else { KEY };
        let mut air = Air::of(&mission(3), |index| auth(key(index), 1), loss);
        air.run(60);
        let mut told = air.reporters(Event::KeyMismatch { node: 2 });
        told.sort_unstable();
        assert_eq!(told, [0, 2]);
        for node in [1, 3] {
            assert_eq!(air.reporters(Event::KeyMismatch { node }), [1]);
        }
    }
}

/// Checks that two handshakes with a wrong key cause no report. A relay reports a wrong key only after more of these handshakes.
#[test]
fn two_forged_handshakes_are_noise() {
    let mission = mission(3);
    let mut air = Air::of(&mission, |_| auth(KEY, 1), 0.0);
    let mut stranger = relay(&mission, 2, auth([1; 32], 9), air.now);
    let mut frame = [0; MAX_FRAME];
    air.run(30);
    for _ in 0..2 {
        let transmit = stranger.poll_transmit(air.now, &mut frame).unwrap();
        air.play(&frame[..transmit.len]);
        air.run(30);
    }
    assert!(air.relays[0].stats().forged > 0);
    assert!(air.reporters(Event::KeyMismatch { node: 2 }).is_empty());
}

/// Checks that a relay that restarts with an older epoch is rejected. The relay and its neighbours report it.
///
/// A newer epoch is accepted without a report.
#[test]
fn an_epoch_that_went_back_is_reported_with_the_node() {
    for (loss, again, back) in [(0.0, 1, true), (0.3, 1, true), (0.3, 6, false)] {
        let mission = mission(3);
        let epoch = |index| if index == 2 { 5 } else { 1 };
        let mut air = Air::of(&mission, |index| auth(KEY, epoch(index)), loss);
        air.run(60);
        assert!(air.relays.iter().all(|relay| relay.setpoint().is_some()));
        air.relays[1] = relay(&mission, 2, auth(KEY, again), air.now);
        air.run(90);
        let mut told = air.reporters(Event::EpochWentBack { node: 2 });
        told.sort_unstable();
        let expected: &[usize] = if back { &[0, 1, 2] } else { &[] };
        assert_eq!(told, expected, "epoch {again}, loss {loss}");
        assert_eq!(air.relays[1].setpoint().is_none(), back);
    }
}

/// Checks a relay that restarts with its old epoch. Its neighbours take it for a duplicate of relay 2.
///
/// At each start a relay draws a random claim number. If the new number is the larger one, the relay takes part at
/// once. Otherwise it reports a duplicate, and gets no setpoint until its neighbours have received nothing with the
/// claim number of its previous start for `dead_after`.
#[test]
fn with_a_reused_epoch_a_relay_joins_or_reports_and_waits() {
    let mut waited = 0;
    for seed in 1..=12 {
        let mission = mission(3);
        let mut air = Air::of(&mission, |_| auth(KEY, 5), 0.0);
        air.run(60);
        let identity = Identity {
            network: 7,
            index: 2,
        };
        let settings = settings(auth(KEY, 5));
        air.relays[1] = Relay::new(mission, identity, settings, 1_000 * seed, air.now).unwrap();
        let restarted = air.now;
        let reports = |air: &Air| {
            air.reporters(Event::DuplicateIndex { node: 2 })
                .contains(&1)
        };
        while air.relays[1].setpoint().is_none() {
            air.run(1);
            let seconds = air.now.since(restarted).as_micros() / 1_000_000;
            assert!(seconds < 90, "seed {seed}");
        }
        let waits = air.now.since(restarted) > settings.dead_after;
        assert_eq!(reports(&air), waits, "seed {seed}");
        waited += u32::from(waits);
    }
    assert!((1..12).contains(&waited), "{waited} of 12");
}

/// Checks that a relay with neighbours of the same number at both of its ports reports a duplicate.
#[test]
fn a_neighbour_received_at_both_ports_is_reported() {
    let mission = mission(3);
    let of = |index| {
        let identity = Identity { network: 7, index };
        Relay::new(mission, identity, Settings::default(), 1, Instant::ZERO).unwrap()
    };
    let (mut middle, mut head) = (of(2), of(1));
    let mut frame = [0; MAX_FRAME];
    let now = Instant::from_millis(6_000);
    while let Some(at) = head.poll_timeout().filter(|at| *at <= now) {
        head.handle_timeout(at);
    }
    let mut told = Vec::new();
    head.persist(|_| true);
    while let Some(transmit) = head.poll_transmit(now, &mut frame) {
        for port in [Port::Upstream, Port::Downstream] {
            middle.handle_bytes(now, port, &frame[..transmit.len]);
        }
        told.extend(std::iter::from_fn(|| middle.poll_event()));
    }
    assert_eq!(told, [Event::DuplicateIndex { node: 1 }]);
    assert!(!middle.is_passive());
}

fn moved(base: &Mission, version: u16) -> Upload {
    let interference = Interference::Source(Interferer {
        power_w: 80.0,
        x_m: 700.0,
        y_m: 100.0 * f32::from(version),
    });
    let config = MissionConfig {
        interference,
        ..*base.config()
    };
    Upload::new(base, version, config).unwrap()
}

/// Returns true for the offer of an upload. Offers are by far the longest frames of a ground station.
const fn is_offer(bytes: &[u8]) -> bool {
    bytes.len() > MAX_FRAME - 24
}

fn station(base: &Mission, epoch: u32) -> Ground {
    Ground::new(
        base,
        Side::Upstream,
        7,
        Wiring::Shared,
        auth(KEY, epoch).unwrap(),
    )
}

/// Returns a chain of relays that fly the mission `base`, and the withheld offers of an upload.
///
/// An attacker has kept these offers from the relays. The upload has version 1. The ground station has been switched
/// off. `loss` is the probability that a receiver loses a frame.
fn caught(base: &Mission, loss: f64) -> (Air, Vec<Vec<u8>>) {
    let mut air = Air::of(base, |_| auth(KEY, 1), loss);
    air.run(60);
    air.withheld = is_offer;
    begin_upload(&mut air, base, 1);
    while air.recorded.is_empty() {
        air.run(1);
    }
    air.ground = None;
    let offers = std::mem::take(&mut air.recorded);
    (air, offers)
}

fn begin_upload(air: &mut Air, base: &Mission, epoch: u32) {
    let mut ground = station(base, epoch);
    ground.upload(air.now, moved(base, 1)).unwrap();
    air.ground = Some(ground);
}

/// Checks that relays refuse an attacker's replay of withheld offers after the upload was given up.
///
/// The relays accept a new upload afterwards.
#[test]
fn a_withheld_offer_is_refused_and_the_new_one_flown() {
    let after = Settings::default().dead_after.times(2).as_micros() / 1_000_000;
    for (wait, loss) in [(after + 2, 0.0), (3_600, 0.0), (after + 2, 0.3)] {
        let base = mission(4);
        let (mut air, mut offers) = caught(&base, loss);
        air.run(wait);
        offers.append(&mut air.recorded);
        let stale = |air: &Air| {
            air.relays
                .iter()
                .map(|relay| relay.stats().stale)
                .sum::<u32>()
        };
        let before = stale(&air);
        for _ in 0..5 {
            for offer in &offers {
                air.play(offer);
            }
            air.run(1);
        }
        assert!(
            air.relays.iter().all(|relay| relay.upload().is_none()),
            "wait {wait}"
        );
        assert!(stale(&air) > before, "it is counted");
        // A new session of the ground station uploads the same mission.
        air.withheld = |_| false;
        begin_upload(&mut air, &base, 2);
        let mut seconds = 0;
        while air.relays.iter().any(|relay| relay.version() != 1) {
            air.run(1);
            seconds += 1;
            assert!(seconds < 300, "loss {loss}");
        }
        println!("flown by all {seconds} s after the upload began, loss {loss}");
        air.run(10);
        let progress = air.ground.as_ref().unwrap().progress();
        assert!(matches!(progress, Progress::Flown { .. }), "{progress:?}");
    }
}

/// Checks that a relay accepts a mission offer if an attacker delays it by less than the time limit.
#[test]
fn an_offer_without_delay_is_accepted() {
    let base = mission(4);
    let (mut air, offers) = caught(&base, 0.0);
    air.run(10);
    air.play(&offers[0]);
    air.run(1);
    assert!(air.relays[0].upload().is_some());
}
