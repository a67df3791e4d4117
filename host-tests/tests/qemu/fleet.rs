//! Emulated drones of one mission, and their logs.

use std::io::Write as _;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use defmt_decoder::Table;
use host_tests::firmware::emulator::{Emulator, Kept, Life};
use host_tests::firmware::image;
use host_tests::firmware::medium::Medium;
use host_tests::firmware::network::{self, Network};
use uav_relay_sim::simulator::faults::{Faults, Injected, LinkSpec};
use uav_relay_tools::provision::block::Flight;

use crate::log::{self, Line};

/// First log lines of every firmware image. The emulated chip reports no reset cause and has no PLL, as these lines state.
pub(crate) const OF_THE_CHIP: [&str; 2] = [
    "started, cause of the reset: unknown",
    "clock 16 MHz, from the internal oscillator: the PLL did not start; do not fly, baud rates may be wrong by 8 %",
];

/// Timeout of any step of a test with emulated drones. Each drone adds `PATIENCE_A_DRONE`.
pub(crate) const PATIENCE: Duration = Duration::from_secs(180);

/// Longest time until a drone has logged its first lines.
const START: Duration = Duration::from_secs(30);

/// Addition to a step's timeout for each drone, since all drones share this machine.
const PATIENCE_A_DRONE: Duration = Duration::from_secs(10);

/// Firmware image of an emulated drone.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Image {
    /// Firmware with a UART to each neighbour.
    Wires,
    /// Firmware with one UART, to a radio on a shared channel.
    Radio,
    /// Firmware with a UART to each neighbour, and with Algorithm 1 only.
    Smallest,
    /// Firmware with asynchronous ports.
    Asynchronous,
}

impl Image {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Wires => "stm32f405",
            Self::Radio => "stm32f405_radio",
            Self::Smallest => "smallest_stm32f405",
            Self::Asynchronous => "stm32f405_async",
        }
    }
}

/// Returns the image file of an example. The first call builds the images of all examples.
pub(crate) fn image(example: &str) -> PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let build = |names: &[&str], smallest| {
            image::build(names, smallest).unwrap_or_else(|error| panic!("{error}"))
        };
        let wires = Image::Wires.name();
        build(&[wires], true);
        let asynchronous = Image::Asynchronous.name();
        build(&[wires, Image::Radio.name(), asynchronous, "golden"], false)
    });
    folder.join(example)
}

/// Returns the log strings of a firmware image, which are needed to decode its log.
fn table(which: Image) -> &'static Table {
    static TABLES: [OnceLock<Table>; 4] = [const { OnceLock::new() }; 4];
    TABLES[which as usize].get_or_init(|| log::table(&image(which.name())))
}

fn blocks(flight: &Flight) -> Vec<Vec<u8>> {
    let all = 1..=flight.mission().relays();
    all.map(|index| flight.block(index).unwrap().to_vec())
        .collect()
}

fn lines_of(lines: &[Line], drone: u16) -> usize {
    lines.iter().filter(|line| line.drone == drone).count()
}

/// Lock that permits one fleet at a time, so that the drones' clocks keep up with real time.
static AIR: Mutex<()> = Mutex::new(());

/// Running emulated drones of one flight.
pub(crate) struct Fleet {
    // The drop order matters: without drones the network and log threads end.
    drones: Vec<Emulator>,
    network: Network,
    consoles: Vec<UnixStream>,
    /// Sockets at the serial ports to which the drones' autopilots are connected.
    pub(crate) autopilots: Vec<UnixStream>,
    new: Receiver<Line>,
    pub(crate) lines: Vec<Line>,
    _folder: tempfile::TempDir,
    _air: MutexGuard<'static, ()>,
}

impl Fleet {
    /// Starts one drone with `image` for each configuration block. `faults` and `seed` are for the simulated medium.
    pub(crate) fn start(which: Image, blocks: &[Vec<u8>], faults: Faults, seed: u64) -> Self {
        Self::begin(which, blocks, &[], None, faults, seed, Life::Fast)
    }

    /// Starts drones whose flash has the contents `kept` in addition to their configuration blocks.
    pub(crate) fn with_flash(
        which: Image,
        blocks: &[Vec<u8>],
        kept: &[Vec<Kept>],
        faults: Faults,
        seed: u64,
    ) -> Self {
        Self::begin(which, blocks, kept, None, faults, seed, Life::Fast)
    }

    /// Starts drones, with a ground station at the transmitter on the other end of `socket`.
    pub(crate) fn with_transmitter(
        which: Image,
        blocks: &[Vec<u8>],
        socket: UnixStream,
        faults: Faults,
        seed: u64,
    ) -> Self {
        Self::begin(which, blocks, &[], Some(socket), faults, seed, Life::Fast)
    }

    fn begin(
        which: Image,
        blocks: &[Vec<u8>],
        kept: &[Vec<Kept>],
        transmitter: Option<UnixStream>,
        faults: Faults,
        seed: u64,
        life: Life,
    ) -> Self {
        let air = AIR.lock().unwrap_or_else(PoisonError::into_inner);
        let (file, table) = (image(which.name()), table(which));
        let folder = tempfile::Builder::new().prefix("fleet").tempdir().unwrap();
        let (lines, new) = channel();
        let (mut drones, mut consoles, mut ports) = (Vec::new(), Vec::new(), Vec::new());
        let mut autopilots = Vec::new();
        for (drone, block) in (1..).zip(blocks) {
            let kept = kept.get(drones.len()).map_or(&[][..], Vec::as_slice);
            let name = format!("drone{drone}");
            let (emulator, [usart1, usart2, usart3, console]) =
                Emulator::start(&file, block, kept, folder.path(), &name, life)
                    .unwrap_or_else(|error| panic!("{error}"));
            drones.push(emulator);
            autopilots.push(usart1);
            ports.push(usart2);
            if which != Image::Radio {
                ports.push(usart3);
            }
            consoles.push(console.try_clone().unwrap());
            let lines = lines.clone();
            std::thread::spawn(move || log::listen(console, drone, table, &lines));
        }
        let (mut hearers, in_range) = match which {
            Image::Wires | Image::Smallest | Image::Asynchronous => {
                (network::chain(blocks.len()), 1)
            }
            Image::Radio => (network::radio(blocks.len(), 2), 2),
        };
        if let Some(socket) = transmitter {
            for hearers in hearers.iter_mut().take(in_range) {
                hearers.push(ports.len());
            }
            hearers.push((0..in_range).collect());
            ports.push(socket);
        }
        // A serial port drops bytes until its firmware has enabled it, so a frame on its way would be truncated. The ports are
        // enabled before the line after those about the chip.
        let mut begun = Vec::new();
        let started = Instant::now();
        while (1..)
            .zip(&drones)
            .any(|(drone, _)| lines_of(&begun, drone) <= OF_THE_CHIP.len())
        {
            match new.recv_timeout(START.saturating_sub(started.elapsed())) {
                Ok(line) => begun.push(line),
                Err(error) => panic!("not every drone has started ({error}): {begun:?}"),
            }
        }
        let medium = Medium::new(
            ports.len(),
            LinkSpec::default(),
            faults,
            seed,
            Instant::now(),
        );
        Self {
            drones,
            network: Network::connect(ports, hearers, medium).unwrap(),
            consoles,
            autopilots,
            new,
            lines: begun,
            _folder: folder,
            _air: air,
        }
    }

    /// Starts every drone of `flight`, with clocks 10.5 times as fast as real time.
    pub(crate) fn of(which: Image, flight: &Flight, faults: Faults, seed: u64) -> Self {
        Self::start(which, &blocks(flight), faults, seed)
    }

    /// Starts every drone of `flight` in real time, on wires without faults.
    pub(crate) fn in_real_time(flight: &Flight) -> Self {
        let blocks = blocks(flight);
        let (which, faults) = (Image::Wires, Faults::default());
        Self::begin(which, &blocks, &[], None, faults, 1, Life::Real)
    }

    /// Collects the log lines that have arrived.
    pub(crate) fn listen(&mut self) {
        self.lines.extend(self.new.try_iter());
    }

    /// Collects log lines until `done` returns true for the lines so far. On a timeout the test fails and shows all lines.
    pub(crate) fn wait(&mut self, what: &str, mut done: impl FnMut(&[Line]) -> bool) {
        let started = Instant::now();
        let drones = u32::try_from(self.drones.len()).unwrap();
        let patience = PATIENCE + drones * PATIENCE_A_DRONE;
        while !done(&self.lines) {
            let left = patience.saturating_sub(started.elapsed());
            match self.new.recv_timeout(left) {
                Ok(line) => {
                    assert_ne!(line.text, "MALFORMED", "{line:?}");
                    self.lines.push(line);
                }
                Err(_) => self.give_up(what),
            }
        }
    }

    pub(crate) fn give_up(&mut self, what: &str) -> ! {
        for line in &self.lines {
            println!("{:2} {:>10} us  {}", line.drone, line.at, line.text);
        }
        for (drone, emulator) in (1..).zip(&mut self.drones) {
            let running = emulator.is_running();
            println!("drone {drone}: running {running} {}", emulator.complaint());
        }
        println!("injected: {:?}", self.network.injected());
        panic!("no {what} in time");
    }

    pub(crate) fn of_drone(&self, drone: u16) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(move |line| line.drone == drone)
    }

    /// Returns the log lines of one drone, without the first lines about the chip (see [`OF_THE_CHIP`]).
    pub(crate) fn after_start(&self, drone: u16) -> impl Iterator<Item = &Line> {
        self.of_drone(drone).skip(OF_THE_CHIP.len())
    }

    /// Waits until every drone has a setpoint. Returns the setpoints as f32 bits.
    pub(crate) fn places(&mut self) -> Vec<[u32; 3]> {
        let drones = u16::try_from(self.drones.len()).unwrap();
        let last = |lines: &[Line], drone| {
            let mut lines = lines.iter().rev().filter(|line| line.drone == drone);
            lines.find_map(Line::setpoint)
        };
        self.wait("setpoint of every drone", |lines| {
            (1..=drones).all(|drone| last(lines, drone).is_some())
        });
        (1..=drones)
            .map(|drone| last(&self.lines, drone).unwrap())
            .collect()
    }

    /// Waits until the chain has agreed on exactly `places`. Other agreements may come first.
    pub(crate) fn settle_at(&mut self, places: &[[u32; 3]]) {
        assert_eq!(self.drones.len(), places.len());
        self.wait("agreement on these places", |lines| {
            (1..).zip(places).all(|(drone, place)| {
                let mut back = lines.iter().rev().filter(|line| line.drone == drone);
                // An agreement is logged after its positions.
                let agreed = back.find(|line| {
                    line.setpoint().is_some() || line.text == "the relays have agreed on positions"
                });
                agreed.is_some_and(|line| line.text == "the relays have agreed on positions")
                    && back.find_map(Line::setpoint) == Some(*place)
            })
        });
    }

    /// Requests the statistics counters of a drone, and waits for the log line with them.
    pub(crate) fn counters(&mut self, drone: u16) -> Line {
        let before = self.lines.len();
        self.consoles[usize::from(drone) - 1]
            .write_all(b"s")
            .unwrap();
        let answer = |lines: &[Line]| {
            let mut new = lines[before..].iter();
            new.find(|line| line.drone == drone && line.text.starts_with("counters"))
                .cloned()
        };
        self.wait("counters", |lines| answer(lines).is_some());
        answer(&self.lines).unwrap()
    }

    pub(crate) fn kill(&mut self, drone: u16) {
        self.drones[usize::from(drone) - 1].kill();
    }

    /// Returns the numbers of faults that the medium has injected.
    pub(crate) fn injected(&self) -> Injected {
        self.network.injected()
    }
}
