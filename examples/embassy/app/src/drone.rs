//! What a drone is by its configuration, whatever its ports are.

use embedded_storage::nor_flash::NorFlash;
use uav_relay::{Auth, Instant, Key, Relay, Settings, SetupError, Wiring};
use uav_relay_block as config;
use uav_relay_block::ConfigError;
use uav_relay_kept::epoch;
use uav_relay_kept::journal::Journal;
use uav_relay_kept::nor::Nor;

use crate::board::{Board, Storage};
use crate::log;

/// Room for the relay and its field, which the stack would have to hold.
#[derive(Debug)]
pub struct Room {
    field: config::Room,
    relay: Option<Relay>,
}

impl Room {
    /// With nobody in it.
    pub const fn new() -> Self {
        Self {
            field: config::EMPTY,
            relay: None,
        }
    }
}

impl Default for Room {
    fn default() -> Self {
        Self::new()
    }
}

/// Why a drone takes no part.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Refused {
    /// This is wrong with its block.
    Block(ConfigError),
    /// There is a key, and no flash to keep the epoch in.
    NoFlash,
    /// There is no epoch after the last one.
    NoEpoch,
    /// There are sites, and no port to an autopilot.
    NoAutopilot,
    /// The library was built without what the block asks for.
    Setup(SetupError),
}

/// The relay of a board, in `room`.
///
/// # Errors
/// Why it takes no part.
pub(crate) fn begin<F: NorFlash>(
    room: &'static mut Room,
    board: &mut Board<F>,
    wiring: Wiring,
    now: Instant,
) -> Result<&'static mut Relay, Refused> {
    let said = config::read(&board.block, &mut room.field).map_err(Refused::Block)?;
    log::begins(&said);
    let auth = sign(board)?;
    if said.sites.is_some() {
        return Err(Refused::NoAutopilot);
    }
    log::unguarded();
    let common = said.mission.config().common;
    let settings = Settings {
        auth,
        // What it has in common with the others may change with an upload.
        profile: Some(said.profile).filter(|own| said.hold_altitude || *own != common),
        hold_altitude: said.hold_altitude,
        method: said.method,
        measure: said.measure,
        listen: said.listen,
        wiring,
        ..Settings::default()
    };
    let (slot, identity) = (&mut room.relay, said.identity);
    Relay::new_in(slot, &said.mission, identity, &settings, board.seed, now).map_err(Refused::Setup)
}

/// What frames are signed with in this start, if they are.
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
