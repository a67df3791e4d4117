//! Autopilot link and relay as futures of one task that is polled only after a wake-up.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::{pending, poll_fn};
use std::rc::Rc;
use std::task::{Poll, Waker};

use embassy_futures::join::join4;
use embedded_io_async::{ErrorType, Read, Write};
use futures_executor::LocalPool;
use futures_util::task::LocalSpawnExt as _;
use host_tests::fixtures;
use host_tests::make;
use mavlink::dialects::common::{
    COMMAND_LONG_DATA, EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA,
    MavAutopilot, MavCmd, MavLandedState, MavMessage, MavModeFlag, MavState, MavType,
    SET_POSITION_TARGET_GLOBAL_INT_DATA, TIMESYNC_DATA,
};
use mavlink::{MAVLinkV2MessageRaw, MavHeader};
use uav_relay::GuardConfig;
use uav_relay::asynch::{AsyncAutopilot, AsyncLink, AsyncPair, AsyncRelay, Clock};
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::flight::autopilot::state::State;
use uav_relay::flight::autopilot::{
    Autopilot, AutopilotEvent, FlightMode, Kind, Release, ReleaseCause,
};
use uav_relay::flight::axis::Axis;
use uav_relay::{Duration, Geodetic, Instant, Mission, Placement, Relay, Settings, Side, Sites};

use crate::time::Time;
use crate::wire::BAUD;

const START: Placement = Placement::on_line(100.0, 20.0);

/// In-memory serial line: a queue of bytes, and the wakers of the tasks that wait to read them.
#[derive(Clone, Default)]
struct Uart(Rc<Queue>);

#[derive(Default)]
struct Queue {
    bytes: RefCell<VecDeque<u8>>,
    waits: RefCell<Option<Waker>>,
    /// True while writes to this queue never complete.
    stuck: Cell<bool>,
}

impl ErrorType for Uart {
    type Error = Infallible;
}

impl Read for Uart {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        poll_fn(|cx| {
            let mut bytes = self.0.bytes.borrow_mut();
            let count = bytes.len().min(into.len());
            if count == 0 {
                *self.0.waits.borrow_mut() = Some(cx.waker().clone());
                return Poll::Pending;
            }
            into.iter_mut()
                .zip(bytes.drain(..count))
                .for_each(|(place, byte)| *place = byte);
            Poll::Ready(Ok(count))
        })
        .await
    }
}

impl Write for Uart {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        if self.0.stuck.get() {
            pending::<()>().await;
        }
        self.0.bytes.borrow_mut().extend(bytes);
        if let Some(waits) = self.0.waits.borrow_mut().take() {
            waits.wake();
        }
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Simulated PX4 that is at each target at once.
///
/// Its pilot flies it until `given_at`, and the companion flies it after that.
struct Vehicle {
    mute: Cell<bool>,
    given_at: Cell<Instant>,
    place: Cell<Placement>,
    told: RefCell<Vec<(Instant, Placement)>>,
    /// Commands of a ground station that the simulated autopilot has not forwarded to the companion yet.
    commands: RefCell<VecDeque<MavMessage>>,
    /// Results in the companion's answers to the ground station's commands.
    results: RefCell<Vec<u32>>,
}

fn sites() -> Sites {
    let site = |lat, lon, amsl| Geodetic::from_degrees(lat, lon, amsl).unwrap();
    Sites {
        tx: site(47.40, 8.54, 420.0),
        rx: site(47.41, 8.55, 431.0),
    }
}

fn axis() -> Axis {
    Axis::between(sites()).unwrap()
}

fn raw(number: u8, message: &MavMessage) -> Vec<u8> {
    let header = MavHeader {
        system_id: 1,
        component_id: 1,
        sequence: number,
    };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message(header, message);
    raw.raw_bytes().to_vec()
}

/// Runs the simulated autopilot: sends its state every 200 ms and flies to the received targets.
async fn fly(vehicle: &Vehicle, time: &Time, mut to: Uart, from: Uart) -> Infallible {
    let mut number = 0;
    let mut waiting: Vec<u8> = Vec::new();
    loop {
        time.sleep_until(time.now() + Duration::from_millis(200))
            .await;
        waiting.extend(from.0.bytes.borrow_mut().drain(..));
        while let Some(end) = waiting.get(1).map(|len| 12 + usize::from(*len))
            && waiting.len() >= end
        {
            let frame: Vec<u8> = waiting.drain(..end).collect();
            let mut reader = mavlink::MavlinkReader::new(&frame[..]);
            let read = reader.read_message::<MavMessage>(mavlink::MavlinkVersion::V2);
            match read.unwrap().1 {
                MavMessage::SET_POSITION_TARGET_GLOBAL_INT(target) => {
                    let place = axis().place(point(&target)).unwrap();
                    vehicle.told.borrow_mut().push((time.now(), place));
                    vehicle.place.set(place);
                }
                MavMessage::TIMESYNC(sync) if !vehicle.mute.get() => {
                    let answer = MavMessage::TIMESYNC(TIMESYNC_DATA {
                        tc1: 1,
                        ts1: sync.ts1,
                    });
                    let Ok(_) = to.write(&raw(number, &answer)).await;
                    number = number.wrapping_add(1);
                }
                MavMessage::COMMAND_ACK(ack) if ack.command == MavCmd::MAV_CMD_USER_1 => {
                    vehicle.results.borrow_mut().push(ack.result as u32);
                }
                _ => {}
            }
        }
        let command = vehicle.commands.borrow_mut().pop_front();
        if let Some(command) = command {
            let Ok(_) = to.write(&raw(number, &command)).await;
            number = number.wrapping_add(1);
        }
        if vehicle.mute.get() {
            continue;
        }
        let at = axis().point(vehicle.place.get()).unwrap();
        let is_given = time.now() >= vehicle.given_at.get();
        for message in [
            MavMessage::HEARTBEAT(HEARTBEAT_DATA {
                mavtype: MavType::MAV_TYPE_QUADROTOR,
                autopilot: MavAutopilot::MAV_AUTOPILOT_PX4,
                base_mode: MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
                    | MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
                custom_mode: if is_given { 6 << 16 } else { 3 << 16 },
                system_status: MavState::MAV_STATE_ACTIVE,
                ..HEARTBEAT_DATA::DEFAULT
            }),
            MavMessage::EXTENDED_SYS_STATE(EXTENDED_SYS_STATE_DATA {
                landed_state: MavLandedState::MAV_LANDED_STATE_IN_AIR,
                ..EXTENDED_SYS_STATE_DATA::DEFAULT
            }),
            MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
                time_boot_ms: (time.now().as_micros() / 1_000) as u32,
                lat: at.lat_e7,
                lon: at.lon_e7,
                alt: at.amsl_mm,
                ..GLOBAL_POSITION_INT_DATA::DEFAULT
            }),
        ] {
            let Ok(_) = to.write(&raw(number, &message)).await;
            number = number.wrapping_add(1);
        }
    }
}

fn point(target: &SET_POSITION_TARGET_GLOBAL_INT_DATA) -> Geodetic {
    make::geodetic(target.lat_int, target.lon_int, (target.alt * 1e3) as i32)
}

/// Creates relay 1 of `relays`, with surveyed positions of Tx and Rx.
///
/// The relay has a motion guard (collision avoidance).
fn relay(relays: u16) -> Relay {
    let mut config = fixtures::paper(relays);
    config.distance_m = 1343.795;
    let mission = Mission::try_new(config).unwrap();
    let guard = GuardConfig {
        hover_m: 1.5,
        ..GuardConfig::of(&mission, config.common)
    };
    let settings = Settings {
        guard: Some(guard),
        sited: true,
        ..Settings::default()
    };
    fixtures::relay(mission, 1, settings)
}

/// State of relay and autopilot as the test's firmware task has last observed it.
#[derive(Default)]
struct Observed {
    events: Vec<AutopilotEvent>,
    setpoint: Option<Placement>,
    flown: bool,
}

struct Scene {
    time: Time,
    pool: LocalPool,
    vehicle: Rc<Vehicle>,
    from_link: Uart,
    seen: Rc<RefCell<Observed>>,
}

impl Scene {
    /// Creates a test scene with a single relay.
    ///
    /// If `tells` is true, the firmware passes the relay's events to the autopilot link.
    fn new(tells: bool) -> Self {
        Self::of(1, tells)
    }

    /// Creates a test scene with relay 1 of `relays`.
    ///
    /// If `tells` is true, the firmware passes the events of relay 1 to the autopilot link.
    fn of(relays: u16, tells: bool) -> Self {
        let time = Time::default();
        let pool = LocalPool::new();
        let [to_link, from_link] = [Uart::default(), Uart::default()];
        let vehicle = Rc::new(Vehicle {
            mute: Cell::new(false),
            given_at: Cell::new(Instant::from_millis(3_000)),
            place: Cell::new(START),
            told: RefCell::default(),
            commands: RefCell::default(),
            results: RefCell::default(),
        });
        let seen = Rc::<RefCell<Observed>>::default();
        let task = {
            let (time, vehicle, seen) = (time.clone(), Rc::clone(&vehicle), Rc::clone(&seen));
            let (mut rx, mut tx) = (to_link.clone(), from_link.clone());
            let (to, from) = (to_link, from_link.clone());
            async move {
                let mut relay = relay(relays);
                let relay = AsyncRelay::new(&mut relay);
                let link = || AsyncLink::new(Uart::default(), Uart::default(), BAUD);
                let mut ports = AsyncPair::new(link(), link());
                let link = Autopilot::new(axis(), Pace::default(), time.now());
                let autopilot = AsyncAutopilot::new(link);
                let relays = async {
                    loop {
                        let event = relay.next_event().await;
                        if tells {
                            autopilot.handle_event(event);
                        }
                        seen.borrow_mut().setpoint = relay.look(Relay::setpoint).flatten();
                    }
                };
                let autopilots = async {
                    loop {
                        let event = autopilot.next_event().await;
                        let mut seen = seen.borrow_mut();
                        seen.events.push(event);
                        seen.flown = autopilot.is_flown();
                    }
                };
                let flies = fly(&vehicle, &time, to, from);
                let runs = autopilot.run(&relay, &time, &mut rx, &mut tx);
                let both = embassy_futures::join::join(ports.run(&relay, &time, |_| true), runs);
                join4::<_, _, _, _>(both, relays, autopilots, flies).await
            }
        };
        let task = async move {
            // The future is boxed because it is large: it contains all relays and links.
            let _: ((Infallible, Infallible), (), (), Infallible) = Box::pin(task).await;
        };
        pool.spawner().spawn_local(task).unwrap();
        Self {
            time,
            pool,
            vehicle,
            from_link,
            seen,
        }
    }

    fn run(&mut self, millis: u64) {
        let until = self.time.now() + Duration::from_millis(millis);
        self.time.run(&mut self.pool, until);
    }
}

/// Checks that the autopilot link flies the drone to the position of a single relay. This must hold with and without a firmware that passes
/// the relay's events to the link.
#[test]
fn the_drone_is_engaged_and_led_to_its_position() {
    for tells in [true, false] {
        let mut scene = Scene::new(tells);
        scene.run(120_000);
        let seen = scene.seen.borrow();
        let expected = [
            AutopilotEvent::Found(Kind::Px4),
            AutopilotEvent::State(State::Standby),
            AutopilotEvent::Ready,
            AutopilotEvent::State(State::Engaged),
        ];
        // If the state changes several times between two polls, only the last state is reported.
        assert_eq!(seen.events, expected);
        assert!(seen.flown);
        let (place, setpoint) = (scene.vehicle.place.get(), seen.setpoint.unwrap());
        println!("at {place:?}, to {setpoint:?}");
        assert!(
            (place.x_m - setpoint.x_m).abs() < 0.05,
            "{place:?}, {setpoint:?}"
        );
        assert!(place.x_m > START.x_m + 200.0, "{place:?}");
        let told = scene.vehicle.told.borrow();
        let gaps = told.windows(2).map(|pair| pair[1].0.since(pair[0].0));
        let longest = gaps.max().unwrap().as_micros() / 1_000;
        assert!(
            longest <= 400,
            "a PX4 leaves its mode behind a second: {longest} ms"
        );
    }
}

/// Checks that setpoint control ends if the autopilot falls silent.
///
/// Setpoint control returns only after the pilot has chosen OFFBOARD again.
#[test]
fn a_silent_autopilot_is_found_again() {
    let mut scene = Scene::new(true);
    scene.run(30_000);
    assert!(scene.seen.borrow().flown);
    scene.vehicle.mute.set(true);
    scene.run(5_000);
    let last = scene.seen.borrow().events.last().copied();
    assert_eq!(last, Some(AutopilotEvent::State(State::Silent)));
    assert!(!scene.seen.borrow().flown);
    let before = scene.vehicle.told.borrow().len();
    scene.run(5_000);
    assert_eq!(scene.vehicle.told.borrow().len(), before, "nobody is told");
    scene.vehicle.mute.set(false);
    scene.run(5_000);
    // The autopilot is in OFFBOARD, which the pilot has not chosen again.
    assert!(!scene.seen.borrow().flown);
    assert_eq!(scene.vehicle.told.borrow().len(), before, "nobody is told");
    let now = scene.time.now();
    scene
        .vehicle
        .given_at
        .set(now + Duration::from_millis(3_000));
    scene.run(10_000);
    assert!(scene.seen.borrow().flown);
    assert!(scene.vehicle.told.borrow().len() > before + 20);
}

/// Checks that a blocked writer to the autopilot stops neither the reception of messages nor the relay.
#[test]
fn a_stuck_writer_does_not_stop_the_readers() {
    let mut scene = Scene::new(true);
    scene.run(10_000);
    scene.from_link.0.stuck.set(true);
    scene.run(10_000);
    // Without targets the autopilot enters its failsafe, and the drone is released.
    let seen = scene.seen.borrow();
    let release = Release {
        cause: ReleaseCause::Link,
        mode: FlightMode::Companion,
    };
    assert!(seen.events.contains(&AutopilotEvent::Released(release)));
    assert!(!seen.flown);
    let before = seen.events.len();
    drop(seen);
    scene.vehicle.mute.set(true);
    scene.run(10_000);
    let seen = scene.seen.borrow();
    assert_eq!(
        seen.events[before..],
        [AutopilotEvent::State(State::Silent)]
    );
}

/// Checks that a relay forgets its lost neighbour on an operator's command.
///
/// The operator sends the command because the neighbour's drone is gone. The firmware gives the relay's events to the
/// autopilot link.
#[test]
fn an_operator_clears_a_lost_relay() {
    let mut scene = Scene::of(2, true);
    scene.run(60_000);
    let command = MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        param1: 2.0,
        command: MavCmd::MAV_CMD_USER_1,
        target_system: 1,
        target_component: 191,
        ..COMMAND_LONG_DATA::DEFAULT
    });
    scene.vehicle.commands.borrow_mut().push_back(command);
    scene.run(2_000);
    assert_eq!(*scene.vehicle.results.borrow(), [0]);
    let seen = scene.seen.borrow();
    let is_cleared = |event: &AutopilotEvent| matches!(event, AutopilotEvent::LostCleared { side: Side::Downstream, relays, .. } if relays[0] == 2);
    assert!(seen.events.iter().any(is_cleared), "{:?}", seen.events);
}
