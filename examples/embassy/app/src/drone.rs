//! Drone as defined by its configuration block, with wires or a radio.

use embedded_storage::nor_flash::NorFlash;
use uav_relay::GuardConfig;
use uav_relay::asynch::AsyncAutopilot;
use uav_relay::flight::autopilot::Autopilot;
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::flight::autopilot::{Signing, Stamp};
use uav_relay::flight::course::{Course, CourseError};
use uav_relay::{Auth, Instant, Key, Relay, Settings, SetupError, Wiring};
use uav_relay_block as config;
use uav_relay_block::ConfigError;
use uav_relay_chip::reset::Reset;
use uav_relay_kept::epoch;
use uav_relay_kept::journal::Journal;
use uav_relay_kept::nor::Nor;

use crate::board::{Board, Storage};
use crate::log;
use crate::votes::Votes;

/// Maximum position error of a hovering drone, m.
const POSITION_ERROR_M: f32 = 1.5;

/// Storage for the relay and the interference points of its mission. This storage is a `static`, because the stack is
/// too small.
#[derive(Debug)]
pub struct DroneStorage {
    field: config::FieldStorage,
    relay: Option<Relay>,
}

impl DroneStorage {
    /// Creates storage for a drone whose relay has not been created yet.
    pub const fn new() -> Self {
        Self {
            field: config::EMPTY,
            relay: None,
        }
    }
}

impl Default for DroneStorage {
    fn default() -> Self {
        Self::new()
    }
}

/// Reason why a drone does not join the chain.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Refused {
    /// The configuration block is invalid.
    Block(ConfigError),
    /// The configuration block has a signing key, but the board has no flash for the signing epoch.
    NoFlash,
    /// The signing epoch, a number that rises at every start, cannot rise further. So frames cannot be signed.
    NoEpoch,
    /// The configuration block has Tx and Rx positions, but the board has no port to an autopilot.
    NoAutopilot,
    /// The Tx and Rx positions form no valid line, or their distance differs from the mission's.
    Course(CourseError),
    /// The relay rejects the settings.
    ///
    /// This build lacks a feature, or the joint method has more than 100 relays.
    Setup(SetupError),
}

#[derive(Debug)]
pub(crate) struct Drone<F> {
    pub(crate) relay: &'static mut Relay,
    /// Flash storage of the relay's votes on the chain's membership; `None` without such flash.
    pub(crate) votes: Option<Votes<F>>,
    pub(crate) autopilot: Option<AsyncAutopilot>,
}

/// Starts the drone of `board`, and stores its relay in `storage`.
///
/// `flies` is true if the board has a port to an autopilot.
pub(crate) fn begin<F: NorFlash>(
    storage: &'static mut DroneStorage,
    mut board: Board<F>,
    wiring: Wiring,
    flies: bool,
    now: Instant,
) -> Result<Drone<F>, Refused> {
    log::started(board.reset);
    let parsed = config::read(&board.block, &mut storage.field).map_err(Refused::Block)?;
    log::begins(&parsed);
    if parsed.flying > 0 {
        // This firmware is built without departures.
        return Err(Refused::Setup(SetupError::Flying));
    }
    let auth = sign(&mut board)?;
    let autopilot = match &parsed.sites {
        Some(_) if !flies => return Err(Refused::NoAutopilot),
        Some(sites) => {
            let course = Course::try_new(sites.on_earth(), sites.speed_m_s, &parsed.mission);
            let Course { axis, pace } = course.map_err(Refused::Course)?;
            log::flies(axis.distance_m(), pace.speed_m_s);
            let mut link = Autopilot::new(axis, pace, now);
            link.set_seed(board.seed);
            if let Some(key) = config::autopilot_key(&board.block) {
                // Without a clock, the link takes the time from received timestamps.
                link.sign(Signing::new(key, 0, Stamp::UNKNOWN, now));
                log::signs_to_autopilot();
            }
            if board.reset == Reset::Watchdog {
                // The queue is still empty, so it has room for this text.
                let _ = link.send_text("relay: restarted by its watchdog");
            }
            Some(AsyncAutopilot::new(link))
        }
        None => {
            log::unguarded();
            None
        }
    };
    let settings = Settings {
        auth,
        guard: parsed.sites.map(|sites| GuardConfig {
            hover_m: POSITION_ERROR_M,
            lag: Pace::of_speed(sites.speed_m_s).stopping_time(),
            ..GuardConfig::of(&parsed.mission, parsed.profile)
        }),
        ..parsed.settings(wiring)
    };
    let (slot, identity) = (&mut storage.relay, parsed.identity);
    let relay = Relay::new_in(slot, &parsed.mission, identity, &settings, board.seed, now);
    let relay = relay.map_err(Refused::Setup)?;
    let votes = (board.storage).map(|storage| Votes::resume(storage, &board.block, relay, now));
    Ok(Drone {
        relay,
        votes,
        autopilot,
    })
}

/// Returns the signing key and this start's epoch; `None` if the configuration block has no key.
fn sign<F: NorFlash>(board: &mut Board<F>) -> Result<Option<Auth>, Refused> {
    let Some(secret) = config::secret(&board.block).map_err(Refused::Block)? else {
        log::unsigned();
        return Ok(None);
    };
    let Storage { flash, epochs, .. } = board.storage.as_mut().ok_or(Refused::NoFlash)?;
    let flash = Nor::new(flash, epochs.clone());
    let mut entries = Journal::new(flash, epoch::WORDS, epoch::KEY);
    let (epoch, kept) = epoch::begin(&mut entries, secret.epoch).ok_or(Refused::NoEpoch)?;
    log::signs(epoch, kept);
    Ok(Some(Auth {
        key: Key::new(secret.key),
        epoch,
    }))
}
