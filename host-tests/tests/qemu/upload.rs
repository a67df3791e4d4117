//! Emulated drones that receive a mission in flight, or have one stored in their flash.

use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use host_tests::firmware::emulator::{Kept, SPEED};
use host_tests::firmware::journal::{Journal, WhenFull};
use host_tests::firmware::ram::Ram;
use host_tests::firmware::uploads::{SECTORS, WORDS, pack_upload};
use host_tests::make;
use uav_relay::MAX_FRAME;
use uav_relay::{Ground, Progress, Side, Upload, Wiring};
use uav_relay_scenario::{Interference, Scenario};
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_tools::provision::block::Flight;
use uav_relay_tools::provision::config::Secret;

use crate::chain::{BAD_DAY, paper, simulated};
use crate::fleet::{Fleet, Image, PATIENCE};

/// Number of 32-bit words in a flash sector of 128 KiB.
const LARGE: usize = 32 * 1024;

const KEY: [u8; 32] = *b"three drones and one transmitter";

/// Returns the flight to upload. Its interferer, altitude and power differ from the mission before flight.
fn moved(uavs: u16) -> Flight {
    let scenario = Scenario {
        interference: Interference::Sources(vec![make::source(80.0, 700.0, -300.0)]),
        altitude_m: 30.0,
        altitude_min_m: 30.0,
        altitude_max_m: 30.0,
        uav_w: 1.5,
        ..Scenario::default()
    };
    Flight::new(&scenario, uavs, 1e-4, 7).unwrap()
}

fn upload(loaded: &Flight, version: u16) -> Upload {
    let uavs = loaded.mission().relays();
    Upload::new(loaded.mission(), version, *moved(uavs).mission().config()).unwrap()
}

fn blocks(loaded: &Flight) -> Vec<Vec<u8>> {
    let flight = loaded.clone().signed(Some(Secret {
        key: KEY,
        epoch: 77,
    }));
    (1..=loaded.mission().relays())
        .map(|index| flight.block(index).unwrap().to_vec())
        .collect()
}

/// Ground station at the transmitter, on a socket. Its clock is as fast as the drones' clocks.
struct Station {
    socket: UnixStream,
    ground: Ground,
    begun: Instant,
}

impl Station {
    fn new(loaded: &Flight, wiring: Wiring, socket: UnixStream) -> Self {
        let auth = make::auth(KEY, 5);
        let pause = Duration::from_millis(5);
        socket.set_read_timeout(Some(pause)).unwrap();
        Self {
            socket,
            ground: Ground::new(loaded.mission(), Side::Upstream, 7, wiring, auth),
            begun: Instant::now(),
        }
    }

    fn now(&self) -> uav_relay::Instant {
        let micros = self.begun.elapsed().mul_f64(SPEED).as_micros();
        uav_relay::Instant::from_micros(u64::try_from(micros).unwrap())
    }

    /// Uploads a mission. Returns the index of the relay that first reports that it flies the mission.
    fn upload(&mut self, upload: Upload) -> u16 {
        self.ground.upload(self.now(), upload).unwrap();
        let end = Instant::now() + PATIENCE;
        loop {
            let mut frame = [0; MAX_FRAME];
            self.ground.handle_timeout(self.now());
            while let Some(len) = self.ground.poll_transmit(&mut frame) {
                self.socket.write_all(&frame[..len]).unwrap();
            }
            let progress = self.ground.progress();
            if let Progress::Flown { by, .. } = progress {
                return by;
            }
            assert!(Instant::now() < end, "{progress:?}");
            let mut bytes = [0; 256];
            match self.socket.read(&mut bytes) {
                Ok(count) => self.ground.handle_bytes(&bytes[..count]),
                Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
            }
        }
    }
}

#[test]
fn three_drones_fly_the_transmitters_upload() {
    let loaded = paper(3);
    for (image, wiring, faults) in [
        (Image::Wires, Wiring::Pair, Faults::default()),
        (Image::Radio, Wiring::Shared, BAD_DAY),
    ] {
        let (ours, theirs) = UnixStream::pair().unwrap();
        let mut fleet = Fleet::with_transmitter(image, &blocks(&loaded), theirs, faults, 1);
        fleet.settle_at(&simulated(&loaded));
        let mut station = Station::new(&loaded, wiring, ours);
        let by = station.upload(upload(&loaded, 3));
        assert!((1..=2).contains(&by), "{image:?}: relay {by}");
        fleet.settle_at(&simulated(&moved(3)));
        for drone in 1..=3 {
            let said = |text: &str| fleet.of_drone(drone).any(|line| line.text == text);
            assert!(
                said("a newer mission has been received by an upload")
                    && said("mission version 3 adopted")
            );
            // The emulator's flash is read-only; the drone flies the mission nevertheless.
            assert!(said(
                "mission version 3 cannot be stored in flash: after a reboot it has to be uploaded again"
            ));
        }
    }
}

/// Checks that drones fly the newest mission stored in their flash. The flash has versions 2 and 3, and a version 4
/// that a power failure has truncated.
#[test]
fn three_drones_fly_a_stored_upload() {
    let loaded = paper(3);
    let blocks = blocks(&loaded);
    let flash: Vec<Vec<Kept>> = blocks
        .iter()
        .map(|block| {
            let check = u32::from_le_bytes(*block.last_chunk().unwrap());
            let mut flash = Ram::blank(LARGE, 1);
            let mut log = Journal::new(&mut flash, WORDS, check);
            for version in [2, 3] {
                assert!(log.append(&pack_upload(&upload(&loaded, version)), WhenFull::Refuse));
            }
            flash.power = Some(11);
            let mut log = Journal::new(&mut flash, WORDS, check);
            assert!(!log.append(&pack_upload(&upload(&loaded, 4)), WhenFull::Refuse));
            vec![(SECTORS[0], flash.bytes())]
        })
        .collect();
    let mut fleet = Fleet::with_flash(Image::Wires, &blocks, &flash, Faults::default(), 1);
    assert_eq!(fleet.places(), simulated(&moved(3)));
    for drone in 1..=3 {
        let said = fleet.after_start(drone).take(4);
        let told = said.filter(|line| {
            line.text == "mission version 3 restored, which was uploaded before this start"
        });
        assert_eq!(told.count(), 1);
    }
    drop(fleet);
    // Drones with other blocks do not use the stored mission.
    let fresh = paper(3).signed(Some(Secret {
        key: KEY,
        epoch: 78,
    }));
    let blocks: Vec<Vec<u8>> = (1..=3)
        .map(|index| fresh.block(index).unwrap().to_vec())
        .collect();
    let mut fleet = Fleet::with_flash(Image::Wires, &blocks, &flash, Faults::default(), 1);
    assert_eq!(fleet.places(), simulated(&loaded));
}
