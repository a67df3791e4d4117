//! Overshoot and speed of drones modelled on real ones.

use uav_relay::Duration;
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::flight::autopilot::{Autopilot, FlightMode, Release, ReleaseCause};

use super::real::{Body, Mode, Point, Real};
use super::vehicle::axis;
use super::*;

const STEP: Duration = Duration::from_millis(20);

pub(crate) struct Rig {
    pub(crate) now: Instant,
    pub(crate) real: Real,
    pub(crate) link: Autopilot,
    pub(crate) setpoint: Option<Placement>,
    pub(crate) events: Vec<AutopilotEvent>,
    pub(crate) texts: Vec<(Instant, String)>,
    pub(crate) targets: u32,
    pub(crate) fastest_m_s: f64,
    pub(crate) farthest_x_m: f64,
    pub(crate) is_cut: bool,
}

impl Rig {
    /// Creates a drone in the air at x = 100 m along the line, flown by its pilot.
    pub(crate) fn new(kind: Kind) -> Self {
        let now = Instant::from_millis(1_000_000);
        let mut rig = Self {
            now,
            real: Real::new(kind, axis(), [100.0, 0.0, 20.0], now),
            link: Autopilot::new(axis(), Pace::default(), now),
            setpoint: None,
            events: Vec::new(),
            texts: Vec::new(),
            targets: 0,
            fastest_m_s: 0.0,
            farthest_x_m: 0.0,
            is_cut: false,
        };
        rig.run(2_000);
        rig.real.take_off();
        rig.run(4_000);
        rig
    }

    pub(crate) fn choose(&mut self, mode: Mode) -> bool {
        self.real.choose(self.now, mode)
    }

    pub(crate) fn restart(&mut self) {
        self.link = Autopilot::new(axis(), Pace::default(), self.now);
    }

    pub(crate) fn run(&mut self, ms: u64) {
        for _ in 0..ms / 20 {
            self.step();
        }
    }

    pub(crate) fn step(&mut self) {
        self.now = self.now + STEP;
        let said = self.real.step(self.now);
        let [x, y, h] = self.real.body.velocity;
        let speed = (x * x + y * y + h * h).sqrt();
        self.fastest_m_s = self.fastest_m_s.max(speed);
        self.farthest_x_m = self.farthest_x_m.max(self.real.body.at[0]);
        self.drive(&said);
    }

    pub(crate) fn drive(&mut self, said: &[u8]) {
        if !self.is_cut {
            self.link.handle_bytes(self.now, said);
        }
        self.link.handle_timeout(self.now);
        self.link.handle_setpoint(self.now, self.setpoint);
        while let Some(frame) = self.link.poll_transmit(self.now) {
            if self.is_cut {
                continue;
            }
            match frame[7] {
                86 => self.targets += 1,
                253 => {
                    let end = frame.len() - 2;
                    let text = String::from_utf8_lossy(&frame[11..end]).into_owned();
                    self.texts
                        .push((self.now, text.trim_end_matches('\0').to_owned()));
                }
                _ => {}
            }
            let answer = self.real.handle_frame(self.now, self.now, &frame);
            self.link.handle_bytes(self.now, &answer);
        }
        while self.link.poll_position().is_some() {}
        while let Some(event) = self.link.poll_event() {
            self.events.push(event);
        }
    }

    pub(crate) fn text_count(&self, text: &str) -> usize {
        self.texts.iter().filter(|(_, said)| said == text).count()
    }

    fn at(&self) -> Point {
        self.real.body.at
    }
}

/// Checks that the PX4 model overshoots a target that stops dead from 5 m/s by 2.1 to 2.7 m.
///
/// A real PX4 does the same.
#[test]
fn the_simulated_px4_overshoots_a_stop_like_a_real_one() {
    let mut body = Body::default();
    let mut most: f64 = 0.0;
    for i in 0..3_000 {
        let t = f64::from(i / 5) * 0.1;
        let (to, velocity) = if t < 20.0 {
            (5.0 * t, 5.0)
        } else {
            (100.0, 0.0)
        };
        body.follow_as_px4([to, 0.0, 0.0], [velocity, 0.0, 0.0]);
        most = most.max(body.at[0] - 100.0);
    }
    println!("{most:.2} m past a dead stop");
    assert!((2.1..=2.7).contains(&most), "{most}");
}

#[test]
fn the_set_speed_and_position_are_not_exceeded() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut rig = Rig::new(kind);
        assert!(rig.choose(Mode::Companion));
        rig.run(2_000);
        rig.setpoint = Some(place(400.0));
        rig.run(110_000);
        let past_m = rig.farthest_x_m - 400.0;
        println!(
            "{kind:?}: {:.2} m/s at most of 5, {past_m:.2} m past its place",
            rig.fastest_m_s
        );
        assert_eq!(rig.link.state(), State::Engaged);
        assert!((rig.at()[0] - 400.0).abs() < 0.2, "{:?}", rig.at());
        assert!(rig.fastest_m_s < 5.05, "{kind:?} {} m/s", rig.fastest_m_s);
        assert!(past_m < 0.5, "{kind:?} {past_m} m");
    }
}

/// Checks that a drone stops smoothly when its setpoint is withdrawn in flight.
///
/// The drone passes the position at which it stops by less than 1 m, and the old setpoint by less than 0.5 m.
#[test]
fn a_drone_whose_setpoint_is_withdrawn_stops_gently_before_it() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        for after_ms in [3_000, 10_000, 20_000] {
            let mut rig = Rig::new(kind);
            assert!(rig.choose(Mode::Companion));
            rig.run(2_000);
            rig.setpoint = Some(place(200.0));
            rig.run(after_ms);
            rig.setpoint = None;
            rig.run(40_000);
            let (end, farthest) = (rig.at()[0], rig.farthest_x_m);
            println!(
                "{kind:?} {after_ms} ms: {:.2} m past its stop",
                farthest - end
            );
            assert!(
                // The limit is the position error configured in the guard.
                farthest - end < 1.0,
                "{kind:?} {after_ms}: {farthest}, {end}"
            );
            assert!(farthest < 200.5);
        }
    }
}

/// Checks that a drone has stopped after the stopping time that its motion guard assumes.
///
/// The drone flies on by less than 0.5 m after that time.
#[test]
fn a_drone_has_stopped_after_the_stopping_time() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        for (speed_m_s, to) in [(0.5, None), (5.0, None), (5.0, Some(60.0)), (12.0, None)] {
            let pace = Pace::of_speed(speed_m_s);
            let mut rig = Rig::new(kind);
            rig.link = Autopilot::new(axis(), pace, rig.now);
            rig.run(4_000);
            assert!(rig.choose(Mode::Companion));
            rig.run(2_000);
            rig.setpoint = Some(place(900.0));
            rig.run(30_000);
            rig.setpoint = to.map(place);
            rig.run(pace.stopping_time().as_micros() / 1_000);
            let stopped_m = rig.at()[0];
            rig.farthest_x_m = stopped_m;
            rig.run(40_000);
            let on_m = rig.farthest_x_m - stopped_m;
            println!("{kind:?} {speed_m_s} m/s, {to:?}: flies on {on_m:.2} m");
            assert!(stopped_m > 110.0, "it flew");
            assert!(on_m < 0.5, "{kind:?} {speed_m_s} m/s, {to:?}: {on_m} m");
        }
    }
}

/// Checks that a restarted companion does not control a drone in OFFBOARD, GUIDED or a failsafe. The pilot must choose another mode first.
#[test]
fn a_restarted_companion_engages_no_drone() {
    for (kind, away_ms) in [
        (Kind::Px4, 97_000),
        (Kind::Px4, 200),
        (Kind::ArduCopter, 97_000),
        (Kind::ArduCopter, 200),
    ] {
        let mut rig = Rig::new(kind);
        assert!(rig.choose(Mode::Companion));
        rig.run(5_000);
        assert_eq!(rig.link.state(), State::Engaged);
        rig.is_cut = true;
        rig.run(away_ms);
        rig.restart();
        rig.is_cut = false;
        let before = rig.targets;
        rig.run(30_000);
        assert_eq!((rig.targets, rig.real.resumed), (before, 0), "{kind:?}");
        assert_eq!(rig.link.state(), State::Standby);
        let reason = if kind == Kind::Px4 {
            "relay: waits, autopilot in failsafe"
        } else {
            "relay: waits, choose another mode first"
        };
        assert_eq!(rig.text_count(reason), 1, "{kind:?}: {:?}", rig.texts);
        assert!(rig.choose(Mode::Hold));
        rig.run(8_000);
        assert_eq!(rig.text_count("relay: ready, choose OFFBOARD or GUIDED"), 2);
        assert!(rig.choose(Mode::Companion));
        rig.run(2_000);
        assert_eq!(rig.link.state(), State::Engaged);
    }
}

/// Checks that a PX4 that lands in a GPS outage does not return to OFFBOARD afterwards.
///
/// The outage lasts 30 s.
#[test]
fn a_px4_with_gps_again_does_not_resume_its_flight() {
    let mut rig = Rig::new(Kind::Px4);
    assert!(rig.choose(Mode::Companion));
    rig.run(5_000);
    rig.real.lose_gps(rig.now);
    rig.run(30_000);
    rig.real.gps = true;
    let before = rig.targets;
    rig.run(30_000);
    assert_eq!((rig.targets, rig.real.resumed), (before, 0));
    let failsafe = |event: &AutopilotEvent| matches!(event, AutopilotEvent::Released(it) if it.cause == ReleaseCause::Failsafe);
    assert!(rig.events.iter().any(failsafe), "{:?}", rig.events);
}

/// Checks that setpoint control survives an autopilot clock that is slow or loses time.
///
/// The clock is 1 % slow, or loses up to 1.5 s. The autopilot's positions may then be invalid for a few seconds.
#[test]
fn a_wrong_clock_stops_positions_for_seconds_at_most() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        for echoes in [true, false] {
            for (slow, lost_us) in [(0.01, 0), (0.0, 1_000_000), (0.0, 1_500_000)] {
                let mut rig = Rig::new(kind);
                rig.real.echoes = echoes;
                rig.real.slow = 0.0;
                rig.restart();
                rig.run(15_000);
                rig.choose(Mode::Hold);
                rig.run(5_000);
                assert!(rig.choose(Mode::Companion), "{kind:?} {echoes}");
                rig.run(5_000);
                assert_eq!(rig.link.state(), State::Engaged, "{kind:?} {echoes}");
                rig.events.clear();
                rig.texts.clear();
                rig.real.lost_us = lost_us;
                rig.real.slow_clock(rig.now, slow);
                rig.run(120_000);
                let states = rig
                    .events
                    .iter()
                    .filter(|it| matches!(it, AutopilotEvent::State(_)));
                let states = states.count();
                println!(
                    "{kind:?} {echoes} {slow} {lost_us}: {states} states, {} texts",
                    rig.texts.len()
                );
                assert_eq!(
                    rig.link.state(),
                    State::Engaged,
                    "{kind:?} {echoes} {slow} {lost_us}: {:?}",
                    rig.events
                );
                assert!(states <= 2 && rig.texts.len() <= 4, "{:?}", rig.texts);
            }
        }
    }
}

/// Checks that the relay keeps control of the drone when the autopilot halts for 1.5 s.
///
/// The autopilot's clock stops for that time, and is 1.5 s slow afterwards.
#[test]
fn a_short_pause_of_the_autopilot_ends_no_flight() {
    for echoes in [true, false] {
        let mut rig = Rig::new(Kind::ArduCopter);
        rig.real.echoes = echoes;
        rig.restart();
        rig.run(15_000);
        rig.choose(Mode::Hold);
        rig.run(5_000);
        assert!(rig.choose(Mode::Companion));
        rig.run(12_000);
        rig.events.clear();
        rig.texts.clear();
        rig.real.lost_us = 1_500_000;
        for _ in 0..75 {
            rig.now = rig.now + STEP;
            rig.link.handle_timeout(rig.now);
            while rig.link.poll_transmit(rig.now).is_some() {}
        }
        rig.run(60_000);
        let states = rig.events.iter();
        let states = states.filter(|it| matches!(it, AutopilotEvent::State(_)));
        assert_eq!(states.count(), 2, "blind, and flown on: {:?}", rig.events);
        assert_eq!(rig.link.state(), State::Engaged);
        // The other text was lost during the silence.
        assert_eq!(rig.texts.len(), 1, "{:?}", rig.texts);
    }
}

/// Checks that the link requests messages that never arrive only a few times in ten minutes of flight.
#[test]
fn requests_of_absent_messages_end() {
    for (kind, most) in [(Kind::Px4, 2), (Kind::ArduCopter, 9)] {
        let mut rig = Rig::new(kind);
        assert!(rig.choose(Mode::Companion));
        rig.setpoint = Some(place(200.0));
        rig.run(600_000);
        println!(
            "{kind:?}: {} requests in 10 minutes",
            rig.real.requests.len()
        );
        assert!(rig.real.requests.len() <= most, "{:?}", rig.real.requests);
        assert!(kind == Kind::ArduCopter || !rig.real.requests.contains(&87));
    }
}

/// Checks that the link reports an ArduCopter that has breached its geofence and returns to launch.
///
/// The drone breaches the geofence because it follows a moving target.
#[test]
fn a_fence_breach_by_a_moving_target_is_named() {
    let mut rig = Rig::new(Kind::ArduCopter);
    rig.real.fence_x_m = 150.0;
    assert!(rig.choose(Mode::Companion));
    rig.run(2_000);
    rig.setpoint = Some(place(400.0));
    rig.run(60_000);
    assert_eq!(rig.link.state(), State::Standby);
    let returns = AutopilotEvent::Released(Release {
        cause: ReleaseCause::Fence,
        mode: FlightMode::Return,
    });
    assert!(rig.events.contains(&returns), "{:?}", rig.events);
    assert!(rig.events.contains(&AutopilotEvent::FenceBreached));
    assert_eq!(rig.text_count("relay: released, returns (RTL): fence"), 1);
}

/// Checks that a drone stops within 40 m if its pilot hands control to the relay at full speed.
#[test]
fn a_drone_handed_back_at_full_speed_stops() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut rig = Rig::new(kind);
        rig.run(2_000);
        for _ in 0..500 {
            rig.real.shove([10.0, 0.0, 0.0]);
            rig.step();
        }
        let given = rig.at()[0];
        assert!(rig.choose(Mode::Companion));
        rig.run(60_000);
        let past_m = rig.farthest_x_m - given;
        println!(
            "{kind:?}: {past_m:.1} m past where it was given back at 10 m/s; ends at {:.1}",
            rig.at()[0] - given
        );
        assert!(past_m < 40.0, "{kind:?} {past_m}");
        assert!(rig.real.body.velocity[0].abs() < 0.1);
    }
}

/// Checks that a drone keeps its speed limit if its positions are 0.5 s older than their time stamps.
#[test]
fn late_positions_do_not_disturb_the_flight() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut rig = Rig::new(kind);
        rig.real.hidden_lag = 25;
        assert!(rig.choose(Mode::Companion));
        rig.run(2_000);
        rig.setpoint = Some(place(300.0));
        rig.run(120_000);
        println!(
            "{kind:?}: {:.2} m/s with positions 0.5 s late",
            rig.fastest_m_s
        );
        assert!((rig.at()[0] - 300.0).abs() < 0.3, "{kind:?} {:?}", rig.at());
        assert!(rig.fastest_m_s < 5.05, "{kind:?} {}", rig.fastest_m_s);
    }
}

/// Checks that the link leads a drone from its true position after the drone has drifted.
///
/// The drone drifts while the link receives no position. The next targets must begin at the drone's new position.
#[test]
fn a_drone_that_drifted_is_led_from_its_true_position() {
    let mut rig = Rig::new(Kind::ArduCopter);
    assert!(rig.choose(Mode::Companion));
    rig.run(4_000);
    rig.real.is_mute_of_positions = true;
    rig.run(4_000);
    assert_eq!(rig.link.state(), State::Blind);
    rig.real.body.at[0] += 20.0;
    rig.real.is_mute_of_positions = false;
    // The autopilot's own controller flies back for a moment.
    rig.run(1_300);
    let at = rig.at()[0];
    rig.run(20_000);
    let off = rig.at()[0] - at;
    println!("{off:.1} m from where it was when the position was back");
    assert_eq!(rig.link.state(), State::Engaged);
}
