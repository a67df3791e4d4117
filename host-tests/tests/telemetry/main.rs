//! Telemetry: age, truth and cost of the reports that reach a ground station through the chain.
//!
//! `cargo test --test telemetry -- --nocapture` prints the figures.

mod alarms;
mod changes;

use host_tests::fixtures::paper;
use uav_relay::{Duration, GuardConfig, Instant, Mission, Phase, Placement, Side};
use uav_relay_decode::envelope::unstuffed;
use uav_relay_sim::simulator::chain::Chain;
use uav_relay_sim::simulator::drones::{FlightSpec, Point};
use uav_relay_sim::simulator::faults::LinkSpec;
use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::outcome::OnAir;
use uav_relay_sim::simulator::setup::Setup;

/// Data rate of the shared channel, and of a wire, in bytes per second.
const RATE: f64 = 5_760.0;

const fn s(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}

/// Returns the setup of `relays` signing relays with the paper's mission, and a station at Tx.
///
/// The station watches from the time `from` on.
fn setup(relays: u16, access: Option<Access>, from: Instant, until: Instant) -> Setup {
    let mission = Mission::try_new(paper(relays)).unwrap();
    let mut setup = access.map_or_else(
        || Setup::new(mission),
        |access| Setup::on_air(mission, access),
    );
    setup.link = LinkSpec {
        baud: 57_600,
        latency: Duration::from_millis(2),
    };
    // All relays are in range of each other.
    setup.radio_reach = usize::from(relays);
    setup.auth = true;
    setup.watches = vec![(Side::Upstream, from)];
    setup.record = true;
    setup.soaked(until)
}

/// Returns positions of the drones, evenly spaced on the line from Tx to Rx.
fn evenly(setup: &Setup) -> Vec<Point> {
    let (relays, config) = (setup.mission.relays(), setup.mission.config());
    let place = |index: u16| -> Point {
        let share = f64::from(index) / f64::from(relays + 1);
        [
            share * f64::from(config.distance_m),
            0.0,
            config.common.altitude_m.into(),
        ]
    };
    (1..=relays).map(place).collect()
}

/// Returns the setup with drones that start 20 m beside their positions and fly to them.
fn flown(mut setup: Setup) -> Setup {
    let common = setup.mission.config().common;
    setup.settings.guard = Some(GuardConfig::of(&setup.mission, common));
    setup.flight = Some(FlightSpec::multicopters(evenly(&setup), 0.0, 0.0));
    setup
}

/// Figures of a telemetry run: ages of the relays' reports, position errors, and bytes on the links.
#[derive(Default)]
struct Figures {
    ages_s: Vec<Vec<f64>>,
    errors_m: Vec<f64>,
    frames: Vec<OnAir>,
    /// First time at which all relays hold their agreed positions.
    agreed: Option<Instant>,
}

impl Figures {
    /// Advances `chain` to `until` in steps of 0.1 s. From `from` on it records the ages of the reports of `relays`
    /// that the station at `end` has.
    fn watch(&mut self, chain: &mut Chain, end: Side, relays: &[u16], [from, until]: [Instant; 2]) {
        let mut tracks: Vec<Vec<(Instant, Placement)>> = vec![Vec::new(); relays.len()];
        self.ages_s.resize(relays.len(), Vec::new());
        let mut now = chain.progress().1;
        while now < until {
            now = now + Duration::from_millis(100);
            chain.advance(now);
            self.frames.extend(chain.frames(now));
            let live: Vec<_> = chain.live(now).collect();
            let mut on = live.iter().filter(|relay| relay.is_on);
            if self.agreed.is_none() && on.all(|relay| relay.report.phase == Phase::Holding) {
                self.agreed = Some(now);
            }
            let reports = chain.reports(end);
            for (at, number) in relays.iter().enumerate() {
                let truth = live
                    .iter()
                    .find(|relay| relay.report.relay == *number)
                    .unwrap();
                tracks[at].extend(truth.report.position.map(|place| (now, place)));
                if now < from {
                    continue;
                }
                let report = reports.iter().find(|report| report.relay == *number);
                let age = report.map_or(f64::INFINITY, |report| seconds(now.since(report.at)));
                self.ages_s[at].push(age);
                if let Some((place, at_time)) = report.and_then(|it| Some((it.position?, it.at))) {
                    self.errors_m.push(error(&tracks[at], at_time, place));
                }
            }
        }
    }

    /// Returns the quantile `share` of the age of a relay's reports, s, for the worst relay.
    fn age_s(&self, share: f64) -> f64 {
        let all = self.ages_s.iter().map(|ages| quantile(ages, share));
        all.fold(0.0, f64::max)
    }

    /// Returns the highest rate of Watches and Reports on one link, bytes/s, as a mean over any 30 s.
    fn most_bytes(&self, between: [Instant; 2]) -> f64 {
        let mut most: f64 = 0.0;
        let links: std::collections::BTreeSet<String> = self
            .frames
            .iter()
            .map(|frame| format!("{:?}", frame.link))
            .collect();
        for link in links {
            let all = self.frames.iter().filter(|frame| {
                format!("{:?}", frame.link) == link
                    && (between[0]..=between[1]).contains(&frame.at)
                    && is_telemetry(&frame.bytes)
            });
            let all: Vec<(Instant, usize)> =
                all.map(|frame| (frame.at, frame.bytes.len())).collect();
            for (index, (first, _)) in all.iter().enumerate() {
                let within = all[index..]
                    .iter()
                    .take_while(|(at, _)| at.since(*first) < Duration::from_millis(30_000));
                let bytes: usize = within.map(|(_, bytes)| bytes).sum();
                most = most.max(bytes as f64 / 30.0);
            }
        }
        most
    }

    /// Prints the figures. `most_bytes` is the largest number of telemetry bytes per second on one link.
    fn print(&self, name: &str, most_bytes: f64) {
        let per_relay: Vec<String> = self
            .ages_s
            .iter()
            .map(|ages| format!("{:.1}", quantile(ages, 0.95)))
            .collect();
        let shown = if per_relay.len() > 12 {
            String::new()
        } else {
            format!(", by relay {}", per_relay.join(" "))
        };
        println!(
            "{name}: age 50 % {:.2} s, 95 % {:.2} s, 99 % {:.2} s{shown}; position error at most {:.2} m; {:.1} % of the rate",
            self.age_s(0.5),
            self.age_s(0.95),
            self.age_s(0.99),
            self.errors_m.iter().copied().fold(0.0, f64::max),
            100.0 * most_bytes / RATE,
        );
    }
}

fn seconds(span: Duration) -> f64 {
    span.as_micros() as f64 / 1e6
}

fn quantile(numbers: &[f64], share: f64) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    let index = (share * sorted.len() as f64) as usize;
    sorted[index.min(sorted.len() - 1)]
}

fn is_telemetry(wire: &[u8]) -> bool {
    let (plain, _) = unstuffed(wire);
    let is_message = plain.get(3).is_some_and(|byte| byte >> 4 == 1);
    is_message && matches!(plain.get(10), Some(0x15 | 0x16))
}

/// Returns the least distance of `place` from the positions of a drone within 0.4 s of `at`, m.
///
/// Each hop rounds the time of a report to tenths of a second, and positions are reported every 0.2 s.
fn error(track: &[(Instant, Placement)], at: Instant, place: Placement) -> f64 {
    let near = Duration::from_millis(400);
    let axes = |of: Placement| [of.x_m, of.y_m, of.altitude_m].map(f64::from);
    if track
        .first()
        .is_none_or(|(first, _)| at.since(*first) <= near)
    {
        return 0.0; // the drone's place before the record
    }
    let mut least = f64::INFINITY;
    for (then, true_place) in track {
        if then.since(at) <= near && at.since(*then) <= near {
            let squares = axes(*true_place)
                .into_iter()
                .zip(axes(place))
                .map(|(a, b)| (a - b) * (a - b));
            least = least.min(squares.sum::<f64>().sqrt());
        }
    }
    if least.is_infinite() { 0.0 } else { least }
}

fn all(relays: u16) -> Vec<u16> {
    (1..=relays).collect()
}

#[test]
fn eight_relays_on_a_channel_report_within_two_seconds() {
    let span = [s(40), s(160)];
    let mut chain = Chain::new(flown(setup(8, Some(Access::Ideal), s(1), span[1]))).unwrap();
    // The drones fly to their positions.
    let mut moving = Figures::default();
    moving.watch(&mut chain, Side::Upstream, &all(8), [s(15), s(40)]);
    moving.print(
        "the same while the drones fly",
        moving.most_bytes([s(1), s(40)]),
    );
    assert!(moving.errors_m.iter().all(|error| *error <= 1.0));
    let far = chain
        .live(s(40))
        .map(|it| it.report.position.unwrap().x_m)
        .fold(0.0, f32::max);
    assert!(far < 800.0, "the last drone has left its place at 889 m");
    let mut figures = Figures::default();
    figures.watch(&mut chain, Side::Upstream, &all(8), span);
    figures.print(
        "8 relays, 57 600 baud, no collisions",
        figures.most_bytes([s(1), span[1]]),
    );
    assert!(figures.age_s(0.95) <= 2.0, "{}", figures.age_s(0.95));
    assert!(figures.errors_m.iter().all(|error| *error <= 1.0));
    assert!(figures.most_bytes([s(1), span[1]]) <= 0.1 * RATE);
    let reports = chain.reports(Side::Upstream);
    let live = chain.live(span[1]).map(|it| it.report);
    for (report, truth) in reports.iter().zip(live) {
        assert_eq!(report.relay, truth.relay);
        assert_eq!(report.neighbours, truth.neighbours);
        assert_eq!(report.phase, truth.phase);
        let apart = |a: Option<Placement>, b: Option<Placement>| {
            let (a, b) = (a.unwrap(), b.unwrap());
            (a.x_m - b.x_m)
                .abs()
                .max((a.y_m - b.y_m).abs())
                .max((a.altitude_m - b.altitude_m).abs())
        };
        assert!(apart(report.agreed, truth.agreed) <= 0.13);
        assert!(apart(report.setpoint, truth.setpoint) <= 0.13);
    }
}

/// Returns the figures of all seeds together, and the most bytes per second of any run.
fn runs(seeds: u64, span: [Instant; 2], end: Side, change: impl Fn(&mut Setup)) -> (Figures, f64) {
    let mut all_runs = Figures::default();
    let mut most = 0.0_f64;
    for seed in 1..=seeds {
        let mut setup = setup(8, Some(Access::Csma), s(1), span[1]);
        change(&mut setup);
        setup.seed = seed;
        let mut chain = Chain::new(flown(setup)).unwrap();
        let mut figures = Figures::default();
        figures.watch(&mut chain, end, &all(8), span);
        most = most.max(figures.most_bytes([s(1), span[1]]));
        all_runs.errors_m.append(&mut figures.errors_m);
        all_runs.ages_s.resize(8, Vec::new());
        for (ages, more) in all_runs.ages_s.iter_mut().zip(&mut figures.ages_s) {
            ages.append(more);
        }
    }
    (all_runs, most)
}

#[test]
fn radios_that_collide() {
    // With hidden nodes the aim, 2 s, is missed: more reports collide.
    for (reach, name, limit_s) in [(8, "all in range", 2.0), (4, "hidden nodes", 2.9)] {
        let change = |setup: &mut Setup| setup.radio_reach = reach;
        let (figures, most) = runs(30, [s(40), s(280)], Side::Upstream, change);
        figures.print(&format!("8 relays, 57 600 baud, CSMA, {name}"), most);
        assert!(figures.age_s(0.95) <= limit_s, "{}", figures.age_s(0.95));
        assert!(most <= 0.1 * RATE, "{most}");
    }
}

#[test]
fn half_of_all_frames_lost() {
    let change = |setup: &mut Setup| setup.faults.loss = 0.5;
    let (figures, most) = runs(20, [s(120), s(420)], Side::Upstream, change);
    figures.print("8 relays, 57 600 baud, 50 % lost", most);
    assert!(most <= 0.1 * RATE, "{most}");
    assert!(figures.age_s(0.95) <= 5.0, "{}", figures.age_s(0.95));
}

/// Checks that a relay is rarely without a report for 5 s, and for 4 s often.
///
/// The runs have 6.7 relay-hours. In 60 runs there were 8 times in 40 relay-hours. The station's alarms also count the
/// frames that it overhears: see `alarms`.
#[test]
fn silences_of_five_seconds_are_rare() {
    let change = |setup: &mut Setup| setup.faults.loss = 0.1;
    let (figures, _) = runs(10, [s(60), s(360)], Side::Upstream, change);
    // Number of silences of a relay that reach the limit.
    let reached = [3.0, 4.0, 5.0].map(|limit_s| {
        let steps = figures.ages_s.iter().flat_map(|ages| ages.windows(2));
        steps
            .filter(|it| it[0] < limit_s && it[1] >= limit_s)
            .count()
    });
    println!("10 % lost, 50 minutes: 3, 4 and 5 s without a report {reached:?} times");
    assert!(reached[1] > 10 && reached[2] <= 3, "{reached:?}");
}

#[test]
fn two_stations_watch() {
    let change = |setup: &mut Setup| setup.watches.push((Side::Downstream, s(1)));
    for end in [Side::Upstream, Side::Downstream] {
        let (figures, most) = runs(6, [s(40), s(160)], end, change);
        figures.print(&format!("two stations, that at the {end:?} end"), most);
        assert!(figures.age_s(0.95) <= 5.0, "{}", figures.age_s(0.95));
        assert!(most <= 0.1 * RATE, "{most}");
    }
}

/// Checks the table of SCREEN.md: bytes a second with and without telemetry on the busiest link.
#[test]
fn the_page_has_the_bytes_a_second() {
    let channel = Some(Access::Csma);
    let cases = [
        ("8 relays on one channel, one station", 8, channel, 0.0, 1),
        ("8 relays on one channel, two stations", 8, channel, 0.0, 2),
        (
            "8 relays on one channel, half of all frames lost",
            8,
            channel,
            0.5,
            1,
        ),
        ("8 relays on wires, one station", 8, None, 0.0, 1),
        ("100 relays on wires, one station", 100, None, 0.0, 1),
    ];
    let rows = cases.map(|(name, relays, access, loss, stations)| {
        // Bytes a second on the busiest link: all, and Watches and Reports.
        let rates = |stations: usize| {
            let span = [s(120), s(240)];
            let mut setup = setup(relays, access, s(1), span[1]);
            setup.faults.loss = loss;
            setup.watches.push((Side::Downstream, s(1)));
            setup.watches.truncate(stations);
            if stations == 0 {
                // A station without a request.
                setup.watches = vec![(Side::Upstream, s(1_000))];
            }
            let mut chain = Chain::new(setup).unwrap();
            chain.advance(span[1]);
            let mut links = std::collections::BTreeMap::<String, [usize; 2]>::new();
            for frame in chain.frames(span[1]).iter().filter(|it| it.at >= span[0]) {
                let sums = links.entry(format!("{:?}", frame.link)).or_default();
                sums[0] += frame.bytes.len();
                sums[1] += usize::from(is_telemetry(&frame.bytes)) * frame.bytes.len();
            }
            let most = links.into_values().max().unwrap();
            most.map(|bytes| bytes as f64 / seconds(span[1].since(span[0])))
        };
        let ([without, none], [with, reports]) = (rates(0), rates(stations));
        let share = 100.0 * reports / RATE;
        assert!(none == 0.0 && share <= 10.0, "{name}: {none}, {share}");
        format!("| {name} | {without:.0} | {with:.0} | {reports:.0} | {share:.1} % |")
    });
    let table = rows.join("\n");
    let page = include_str!("../../../examples/SCREEN.md");
    assert!(page.contains(&table), "SCREEN.md lacks:\n{table}");
}

#[test]
fn a_lost_relay_and_a_restarted_one() {
    let mut setup = flown(setup(8, Some(Access::Csma), s(1), s(200)));
    setup.kills = vec![(4, s(60)), (7, s(60))];
    setup.boots = vec![(7, s(62))];
    let mut chain = Chain::new(setup).unwrap();
    let mut figures = Figures::default();
    let others = [1, 2, 3, 5, 6, 7, 8];
    figures.watch(&mut chain, Side::Upstream, &others, [s(58), s(120)]);
    figures.print(
        "relay 4 lost, relay 7 restarted",
        figures.most_bytes([s(1), s(120)]),
    );
    let gap_s = figures.age_s(1.0);
    println!("longest age meanwhile: {gap_s:.1} s");
    assert!(gap_s <= 30.0);
    let mut later = Figures::default();
    later.watch(&mut chain, Side::Upstream, &others, [s(120), s(200)]);
    later.print(
        "after the chain has closed up",
        later.most_bytes([s(120), s(200)]),
    );
    assert!(later.age_s(0.95) <= 10.0, "{}", later.age_s(0.95));
}

/// Checks that relays resume their reports to a station after their restart.
///
/// A restarted relay has a new session with the station. On a channel it also has to be selected again by its
/// neighbours; in 2 to 4 of 24 runs it then reports after 15 to 27 s.
#[test]
fn relays_next_to_the_station_report_again_after_a_restart() {
    for (access, relay) in [(Some(Access::Csma), 1), (Some(Access::Csma), 2), (None, 1)] {
        let mut late = 0;
        for seed in 1..=12 {
            let mut setup = setup(8, access, s(1), s(100));
            setup.seed = seed;
            setup.boots = vec![(relay, s(60))];
            let mut chain = Chain::new(flown(setup)).unwrap();
            let mut figures = Figures::default();
            figures.watch(&mut chain, Side::Upstream, &all(8), [s(75), s(100)]);
            let age_s = figures.age_s(1.0);
            assert!(
                age_s <= 30.0,
                "{access:?}: relay {relay}, seed {seed}: {age_s}"
            );
            late += usize::from(age_s > 5.0);
        }
        println!("{access:?}: relay {relay} restarted, later than after 20 s in {late} of 12 runs");
        assert!(
            late <= if access.is_some() { 4 } else { 0 },
            "{access:?}: relay {relay}"
        );
    }
}

#[test]
fn a_hundred_relays_on_wires() {
    let span = [s(120), s(240)];
    let setup = setup(100, None, s(1), span[1]);
    let mut chain = Chain::new(setup).unwrap();
    let mut figures = Figures::default();
    figures.watch(&mut chain, Side::Upstream, &all(100), span);
    figures.print(
        "100 relays, wires of 57 600 baud",
        figures.most_bytes([s(1), span[1]]),
    );
    assert!(figures.age_s(0.95) <= 40.0, "{}", figures.age_s(0.95));
    assert!(figures.most_bytes([s(1), span[1]]) <= 0.1 * RATE);
}

#[test]
fn agreements_take_no_longer() {
    let times = |watch: bool| -> Vec<f64> {
        let times = (1..=100).map(|seed| {
            let mut setup = setup(8, Some(Access::Csma), s(0), s(20));
            if !watch {
                // A station without a request.
                setup.watches = vec![(Side::Upstream, s(1_000))];
            }
            setup.record = false;
            setup.soak = None;
            setup.seed = seed;
            let mut chain = Chain::new(setup).unwrap();
            while !chain
                .live(s(0))
                .all(|relay| relay.report.phase == Phase::Holding)
            {
                assert!(!chain.step(1));
            }
            seconds(chain.progress().1.since(s(0)))
        });
        times.collect()
    };
    let (without, with) = (times(false), times(true));
    for share in [0.5, 0.99] {
        let [a, b] = [&without, &with].map(|times| quantile(times, share));
        println!(
            "first agreement, {:.0} % of 100 runs: {a:.3} s without, {b:.3} s with telemetry",
            100.0 * share
        );
        assert!(b <= 1.05 * a);
    }
}
