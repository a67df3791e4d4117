//! Test bench: a drone with the application as relay 1.
//!
//! The drone is wired to relay 2 of 2, or has a radio channel with relays 2 and 3 of 3.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::poll_fn;
use std::pin::Pin;
use std::rc::Rc;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use embassy_time::MockDriver;
use embedded_hal::digital::{ErrorType as PinType, OutputPin};
use embedded_io_async::{ErrorType, Read, Write};
use relay_app::EmbassyClock;
use relay_app::board::Board;
use relay_app::drone::{DroneStorage, Refused};
use uav_relay::MAX_FRAME;
use uav_relay::asynch::Clock as _;
use uav_relay::channel::AirGround;
use uav_relay::{
    Auth, Band, Event, Identity, Instant, Interference, Interferer, Key, Method, Mission,
    MissionConfig, Placement, Port, Profile, Relay, Settings, Wiring,
};
use uav_relay_block::{Block, ChannelNumbers, Config, Secret, Sites, write};

use crate::ram::Ram;
use crate::vehicle::Vehicle;

pub(crate) const KEY: [u8; 32] = [7; 32];

/// Lock that lets one test run at a time, because all share the mock clock.
static CLOCK: Mutex<()> = Mutex::new(());

#[derive(Clone, Debug, Default)]
pub(crate) struct Pipe {
    bytes: Rc<RefCell<VecDeque<u8>>>,
    /// Simulated duration of each poll of a hanging UART writer, ms; 0 while the writer works.
    stall_ms: Rc<Cell<u64>>,
}

impl ErrorType for Pipe {
    type Error = Infallible;
}

impl Read for Pipe {
    /// Reads the available bytes, or waits. No waker is needed, because the test bench polls every millisecond.
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        poll_fn(|_| match self.take(into) {
            0 => Poll::Pending,
            count => Poll::Ready(Ok(count)),
        })
        .await
    }
}

impl Write for Pipe {
    /// Writes all bytes; never completes while the simulated writer hangs.
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        poll_fn(|_| match self.stall_ms.get() {
            0 => Poll::Ready(()),
            millis => {
                MockDriver::get().advance(embassy_time::Duration::from_millis(millis));
                Poll::Pending
            }
        })
        .await;
        self.bytes.borrow_mut().extend(bytes);
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl Pipe {
    /// Moves as many received bytes to `into` as fit; returns their number.
    pub(crate) fn take(&self, into: &mut [u8]) -> usize {
        let mut bytes = self.bytes.borrow_mut();
        let count = bytes.len().min(into.len());
        for (place, byte) in into.iter_mut().zip(bytes.drain(..count)) {
            *place = byte;
        }
        count
    }
}

struct Enable;

impl PinType for Enable {
    type Error = Infallible;
}

impl OutputPin for Enable {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

type Running = Pin<Box<dyn Future<Output = Result<Infallible, Refused>>>>;

pub(crate) struct Bench {
    wiring: Wiring,
    others: Vec<Relay>,
    pub(crate) events: Vec<Event>,
    /// Bytes in transit: entry 0 from the drone to the other relays, entry 1 to the drone.
    wire: [Pipe; 2],
    drone: Option<Running>,
    vehicle: Option<Vehicle>,
    _clock: MutexGuard<'static, ()>,
}

fn numbers() -> ChannelNumbers {
    ChannelNumbers {
        carrier_hz: 2e9,
        excess_los: 1.023_293,
        excess_nlos: 125.892_54,
        los_weight: 1.0,
    }
}

fn config(relays: u16, index: u16, sites: Option<Sites>) -> Config {
    let common = Profile {
        altitude_m: 20.0,
        power_w: 1.0,
    };
    let channel = uav_relay::Channel::new(2e9, 1.023_293, 125.892_54, AirGround::Los);
    let mission = Mission::try_new(MissionConfig {
        relays,
        distance_m: 1343.795,
        min_separation_m: 4.0,
        tx_power_w: 80.0,
        common,
        channel: channel.unwrap(),
        band: Band::at(20.0),
        lateral: Band::NONE,
        interference: Interference::Source(Interferer {
            power_w: 80.0,
            x_m: 500.0,
            y_m: 400.0,
        }),
        noise_w: 0.0,
        reverse: 0.0,
        rx_power_w: 80.0,
        fitted_gap: 0.0,
        tolerance: 1e-4,
    });
    Config {
        identity: Identity { network: 7, index },
        mission: mission.unwrap(),
        profile: common,
        hold_altitude: false,
        method: Method::Align,
        measure: None,
        listen: None,
        probe_after_ms: 0,
        sites,
        flying: 0,
        spare: false,
    }
}

/// Returns the configuration block of relay 1 of 2, with a signing key if `epoch` is given.
pub(crate) fn block(epoch: Option<u32>, sites: Option<Sites>) -> Block {
    let secret = epoch.map(|epoch| Secret { key: KEY, epoch });
    write(&config(2, 1, sites), &numbers(), secret, None)
}

/// Returns the configuration block of relay 1 of 3, with a signing key.
pub(crate) fn block_of_three() -> Block {
    let secret = Secret { key: KEY, epoch: 1 };
    write(&config(3, 1, None), &numbers(), Some(secret), None)
}

/// Returns the configuration block of a chain's only relay, with these Tx and Rx positions.
pub(crate) fn block_alone(sites: Sites) -> Block {
    write(&config(1, 1, Some(sites)), &numbers(), None, None)
}

/// Returns the position that the only relay of a chain chooses, with these Tx and Rx positions.
pub(crate) fn alone(sites: Sites) -> Placement {
    let parsed = config(1, 1, Some(sites));
    let now = Instant::ZERO;
    let mut relay =
        Relay::new(parsed.mission, parsed.identity, Settings::default(), 1, now).unwrap();
    for millis in (0..30_000).step_by(10) {
        relay.handle_timeout(Instant::from_millis(millis));
    }
    relay.setpoint().unwrap()
}

/// Tx and Rx positions for the tests, at the test mission's distance of 1343.795 m.
pub(crate) const SITES: Sites = Sites {
    ends: [
        [474_000_000, 85_400_000, 420_000],
        [474_100_000, 85_500_000, 431_000],
    ],
    speed_m_s: 0.0,
};

/// Starts a board without a port to an autopilot; returns the reason why it does not join the chain.
pub(crate) fn refused(board: Board<Ram>) -> Refused {
    why(board, None)
}

pub(crate) fn refused_with_autopilot(board: Board<Ram>) -> Refused {
    why(board, Some((Pipe::default(), Pipe::default())))
}

fn why(board: Board<Ram>, autopilot: Option<(Pipe, Pipe)>) -> Refused {
    let _clock = CLOCK.lock().unwrap_or_else(PoisonError::into_inner);
    let [up, down] = [Pipe::default(), Pipe::default()];
    let mut running = running(board, up, down, autopilot);
    match running
        .as_mut()
        .poll(&mut Context::from_waker(Waker::noop()))
    {
        Poll::Ready(Err(why)) => why,
        _ => panic!("it takes part"),
    }
}

thread_local! {
    /// Times at which the watchdog of the test's drone has been fed.
    pub(crate) static FED: RefCell<Vec<Instant>> = const { RefCell::new(Vec::new()) };
}

fn feed() -> impl FnMut() {
    || FED.with_borrow_mut(|fed| fed.push(EmbassyClock.now()))
}

fn running(board: Board<Ram>, rx: Pipe, tx: Pipe, autopilot: Option<(Pipe, Pipe)>) -> Running {
    let storage = Box::leak(Box::new(DroneStorage::new()));
    let nobody = (Pipe::default(), Pipe::default());
    Box::pin(async move {
        let mut feed = feed();
        relay_app::fly(storage, board, nobody, (rx, tx), autopilot, &mut feed).await
    })
}

impl Bench {
    /// Creates a test bench whose drone is wired to relay 2. Relay 2 has just started.
    pub(crate) fn new() -> Self {
        Self::wired(Wiring::Pair, 2)
    }

    /// Creates a test bench whose drone shares a radio channel with relays 2 and 3. Both have just started.
    pub(crate) fn radio() -> Self {
        Self::wired(Wiring::Shared, 3)
    }

    fn wired(wiring: Wiring, relays: u16) -> Self {
        let clock = CLOCK.lock().unwrap_or_else(PoisonError::into_inner);
        let settings = Settings {
            auth: Some(Auth {
                key: Key::new(KEY),
                epoch: 1,
            }),
            wiring,
            ..Settings::default()
        };
        let now = EmbassyClock.now();
        let other = |index| {
            let parsed = config(relays, index, None);
            Relay::new(parsed.mission, parsed.identity, settings, index.into(), now).unwrap()
        };
        Self {
            wiring,
            others: (2..=relays).map(other).collect(),
            events: Vec::new(),
            wire: [Pipe::default(), Pipe::default()],
            drone: None,
            vehicle: None,
            _clock: clock,
        }
    }

    /// Restarts the drone with `board`. Bytes on the wires are lost.
    pub(crate) fn boot(&mut self, board: Board<Ram>) {
        for wire in &self.wire {
            wire.bytes.borrow_mut().clear();
        }
        let [there, back] = self.wire.clone();
        let autopilot = self.vehicle.as_ref().map(Vehicle::port);
        self.drone = Some(match self.wiring {
            Wiring::Pair => running(board, back, there, autopilot),
            Wiring::Shared => {
                let storage = Box::leak(Box::new(DroneStorage::new()));
                let radio = (back, there);
                Box::pin(async move {
                    let mut feed = feed();
                    relay_app::fly_shared(storage, board, radio, Enable, autopilot, &mut feed).await
                })
            }
        });
    }

    pub(crate) fn with(vehicle: Vehicle) -> Self {
        Self {
            vehicle: Some(vehicle),
            ..Self::new()
        }
    }

    pub(crate) fn vehicle(&mut self) -> &mut Vehicle {
        self.vehicle.as_mut().unwrap()
    }

    pub(crate) fn switch_off(&mut self) {
        self.drone = None;
    }

    /// Lets the drone's UART hang: each poll of its driver takes `millis` ms and sends nothing. With 0 the UART works
    /// again.
    pub(crate) fn stall_uart(&mut self, millis: u64) {
        self.wire[0].stall_ms.set(millis);
    }

    /// Simulates `millis` ms; returns the events of relay 2, the drone's neighbour.
    pub(crate) fn run(&mut self, millis: u32) -> Vec<Event> {
        self.events.clear();
        let mut cx = Context::from_waker(Waker::noop());
        for _ in 0..millis {
            MockDriver::get().advance(embassy_time::Duration::from_millis(1));
            if let Some(drone) = &mut self.drone {
                assert!(drone.as_mut().poll(&mut cx).is_pending(), "it takes part");
            }
            self.listen();
            if let Some(vehicle) = &mut self.vehicle {
                vehicle.step();
            }
        }
        self.events.clone()
    }

    /// Simulates `millis` ms in which the drone's task hangs; the other relays run.
    pub(crate) fn hang(&mut self, millis: u32) {
        for _ in 0..millis {
            MockDriver::get().advance(embassy_time::Duration::from_millis(1));
            self.listen();
        }
    }

    fn listen(&mut self) {
        let now = EmbassyClock.now();
        let port = match self.wiring {
            Wiring::Pair => Port::Upstream,
            Wiring::Shared => Port::Shared,
        };
        let mut bytes = [0; 256];
        let count = self.wire[0].take(&mut bytes);
        for other in &mut self.others {
            other.handle_bytes(now, port, &bytes[..count]);
            other.handle_timeout(now);
        }
        let mut frame = [0; MAX_FRAME];
        for from in 0..self.others.len() {
            self.others[from].persist(|_| true);
            while let Some(sent) = self.others[from].poll_transmit(now, &mut frame) {
                if sent.port != port {
                    continue;
                }
                let frame = &frame[..sent.len];
                self.wire[1].bytes.borrow_mut().extend(frame);
                for to in (0..self.others.len()).filter(|to| *to != from) {
                    self.others[to].handle_bytes(now, port, frame);
                }
            }
        }
        while let Some(event) = self.others[0].poll_event() {
            self.events.push(event);
        }
    }

    /// Returns the number of frames that relay 2 rejected for their signature.
    pub(crate) fn signature_rejections(&self) -> u32 {
        let stats = self.others[0].stats();
        stats.unsigned + stats.forged + stats.replayed
    }
}
