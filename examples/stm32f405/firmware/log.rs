//! Log lines, with `--features defmt`. Their output is `uart_log.rs` or, with `--features rtt`, the debug probe: `probe-rs run` prints
//! it. That is written to RAM without blocking; the probe can not request the counters, and frames that it reads too slowly are lost
//! uncounted.
#![allow(
    clippy::match_same_arms,
    clippy::if_same_then_else,
    reason = "it does not compare the texts of lines"
)]

use uav_relay::SetupError;
#[cfg(feature = "flight")]
use uav_relay::flight::autopilot::AutopilotEvent;
#[cfg(feature = "flight")]
use uav_relay::flight::autopilot::state::State;
#[cfg(feature = "flight")]
use uav_relay::flight::autopilot::trust::Mistrust;
#[cfg(feature = "flight")]
use uav_relay::flight::course::{Course, CourseError};
use uav_relay::sensing::estimate::InterferenceEstimate;
use uav_relay::serial::SerialStats;
use uav_relay::{Event, Relay};
use uav_relay_chip::clock::Source;
use uav_relay_chip::reset::Reset;

use super::chip::Begun;
use super::config::{Config, ConfigError};

#[cfg(all(feature = "defmt", not(feature = "rtt")))]
pub(crate) use super::uart_log::asked;
#[cfg(all(feature = "defmt", not(feature = "rtt")))]
use super::uart_log::lost;
#[cfg(feature = "rtt")]
use defmt_rtt as _;

/// Returns true if the counters are requested: never.
#[cfg(not(all(feature = "defmt", not(feature = "rtt"))))]
pub(crate) const fn asked() -> bool {
    false
}

/// Returns the number of dropped frames.
#[cfg(not(all(feature = "defmt", not(feature = "rtt"))))]
const fn lost() -> u32 {
    0
}

#[cfg(feature = "defmt")]
defmt::timestamp!("{=u64:us}", super::clock::micros());

/// Logs a line at a level of defmt; does nothing without `--features defmt`.
macro_rules! line {
    ($level:ident, $text:literal $(, $value:expr)* $(,)?) => {{
        #[cfg(feature = "defmt")]
        defmt::$level!($text $(, $value)*);
        #[cfg(not(feature = "defmt"))]
        {
            $(let _ = &$value;)*
        }
    }};
}

macro_rules! info {
    ($($line:tt)*) => { line!(info, $($line)*) };
}

macro_rules! warn {
    ($($line:tt)*) => { line!(warn, $($line)*) };
}

macro_rules! error {
    ($($line:tt)*) => { line!(error, $($line)*) };
}

pub(crate) fn begins(config: &Config) {
    info!(
        "relay {=u16} of {=u16}, network {=u16}",
        config.identity.index,
        config.mission.relays(),
        config.identity.network,
    );
}

pub(crate) fn started(begun: &Begun) {
    match begun.reset {
        Reset::Watchdog => {
            error!("started by the watchdog: the loop hung, or the clock stopped");
        }
        reset => info!("started: {=str}", reset.text()),
    }
    let mhz = begun.clocks.core_hz / 1_000_000;
    match begun.clocks.pll {
        Some(Source::Crystal) => info!("clock {=u32} MHz, from the crystal", mhz),
        Some(Source::Internal) => warn!("clock {=u32} MHz, no crystal of 8 MHz", mhz),
        None => warn!("clock {=u32} MHz, no PLL", mhz),
    }
}

pub(crate) fn unguarded() {
    warn!("no sites: no autopilot is controlled, and drones are not kept apart while they move");
}

/// Logs the line and the speed limit of the autopilot.
#[cfg(feature = "flight")]
pub(crate) fn flies(course: &Course) {
    info!(
        "autopilot: line of {=f64} m, at most {=f32} m/s",
        course.axis.distance_m(),
        course.pace.speed_m_s
    );
}

#[cfg(feature = "flight")]
pub(crate) fn off_course(error: CourseError) {
    match error {
        CourseError::Axis(error) => error!("configuration refused: sites, {}", error),
        CourseError::Distance(along) => error!(
            "configuration refused: the sites are {=f64} m apart: the mission's distance must be the same",
            along
        ),
        other => error!("configuration refused: sites, {}", other),
    }
}

#[allow(dead_code, reason = "for an image that tells no autopilot")]
pub(crate) fn no_flight() {
    error!("configuration refused: it has sites, and this image was built without flight");
}

#[cfg(feature = "mavlink-signing")]
pub(crate) fn signs_to_autopilot() {
    info!(
        "frames to the autopilot are signed, and frames that are not signed with its key are ignored"
    );
}

#[cfg(all(feature = "flight", not(feature = "mavlink-signing")))]
pub(crate) fn cannot_sign_to_autopilot() {
    error!(
        "configuration refused: it has an autopilot's key, and this image was built without mavlink-signing"
    );
}

#[cfg(feature = "flight")]
pub(crate) fn autopilot(event: AutopilotEvent) {
    match event {
        AutopilotEvent::Mistrusted(Mistrust::SignsOnly) => info!("autopilot: {}", event),
        AutopilotEvent::Mistrusted(_) => error!("autopilot: {}", event),
        AutopilotEvent::Restarted
        | AutopilotEvent::Refused
        | AutopilotEvent::Released(_)
        | AutopilotEvent::Waits(_)
        | AutopilotEvent::LostCleared { .. }
        | AutopilotEvent::ClearRefused { .. }
        | AutopilotEvent::FenceBreached
        | AutopilotEvent::OffLine(_)
        | AutopilotEvent::State(State::Silent | State::Blind) => warn!("autopilot: {}", event),
        _ => info!("autopilot: {}", event),
    }
}

pub(crate) fn refused(error: ConfigError) {
    match error {
        ConfigError::Blank => warn!("no configuration: the block is blank"),
        ConfigError::Magic => error!("configuration refused: the block does not begin with UAVR"),
        ConfigError::Version => {
            error!("configuration refused: another version or length of the block");
        }
        ConfigError::Crc => error!("configuration refused: damaged, the CRC does not match"),
        ConfigError::Index => {
            error!("configuration refused: the index exceeds the number of relays, or is 0");
        }
        ConfigError::Profile => {
            error!("configuration refused: altitude or power of this relay out of range");
        }
        ConfigError::Hold => error!("configuration refused: byte 15 is neither 0 nor 1"),
        ConfigError::Method => {
            error!("configuration refused: method unknown, or not for a field");
        }
        ConfigError::Adjust => {
            error!(
                "configuration refused: rounds or explore of adjust out of range, or not 0 for another method"
            );
        }
        ConfigError::Measure => {
            error!("configuration refused: samples or i_max_w of the measurement out of range");
        }
        ConfigError::Listen => {
            error!(
                "configuration refused: settings for measurements (listen) out of range, or in a field"
            );
        }
        ConfigError::Reverse => {
            error!("configuration refused: a way back needs align or adjust");
        }
        ConfigError::Interferer => {
            error!("configuration refused: it has both an interferer and a field");
        }
        ConfigError::Points => error!("configuration refused: too many points of the field"),
        ConfigError::Unused => {
            error!("configuration refused: bytes behind the last point are not 0");
        }
        ConfigError::Secret => {
            error!("configuration refused: key or epoch, without the other or out of range");
        }
        ConfigError::Speed => {
            error!("configuration refused: speed out of range, or without sites");
        }
        ConfigError::AutopilotKey => {
            error!("configuration refused: an autopilot's key without sites");
        }
        ConfigError::Silence => {
            error!("configuration refused: probe_after_ms above 1200000");
        }
        ConfigError::Field(error) => error!("configuration refused: field, {}", error),
        ConfigError::Channel(error) => error!("configuration refused: channel, {}", error),
        ConfigError::Mission(error) => error!("configuration refused: mission, {}", error),
    }
}

/// Logs the signing epoch; `kept` is true if it was stored.
#[cfg(feature = "auth")]
pub(crate) fn signs(epoch: u32, kept: bool) {
    if kept {
        info!("frames are signed, epoch {=u32}", epoch);
    } else {
        error!(
            "frames are signed, epoch {=u32}; it cannot be stored: raise the epoch of the block before the next start",
            epoch
        );
    }
}

#[cfg(feature = "auth")]
pub(crate) fn unsigned() {
    warn!("no key: frames are not signed, and anybody in range can send frames");
}

#[cfg(feature = "auth")]
pub(crate) fn no_epoch() {
    error!("no epoch is left to sign with");
}

/// Logs that a mission uploaded before this start was restored.
#[cfg(feature = "upload")]
pub(crate) fn resumes(version: u16) {
    info!(
        "mission version {=u16} restored: uploaded before this start",
        version
    );
}

/// Logs an uploaded mission; `kept` is true if it was stored.
#[cfg(feature = "upload")]
pub(crate) fn uploaded(version: u16, kept: bool) {
    if kept {
        info!("mission version {=u16} stored", version);
    } else {
        warn!(
            "mission version {=u16} cannot be stored: after a reboot it has to be uploaded again",
            version
        );
    }
}

/// Logs the votes restored after a reboot; `taken` is true if the relay accepts them.
pub(crate) fn stands_by(taken: bool) {
    if taken {
        info!("votes on views restored from flash");
    } else {
        error!("votes on views in flash are of another firmware, and ignored");
    }
}

/// Logs that storing the votes works again (`kept`) or fails.
pub(crate) fn votes(kept: bool) {
    if kept {
        info!("votes on views can be stored again");
    } else {
        error!("votes on views cannot be stored: a reboot in flight loses them");
    }
}

#[cfg(not(feature = "auth"))]
pub(crate) fn cannot_sign() {
    error!("configuration refused: it has a key, and this image was built without auth");
}

/// Logs that this image was built without the feature for the method, or for measuring.
pub(crate) fn cannot_fly(error: SetupError) {
    error!(
        "configuration refused: not supported by this image, {}",
        error
    );
}

pub(crate) fn event(event: Event, relay: &Relay) {
    if !cfg!(feature = "defmt") {
        return;
    }
    info!("{}", event);
    #[cfg(feature = "upload")]
    if event == Event::Adopted {
        info!("mission version {=u16} adopted", relay.version());
    }
    if event == Event::NewEstimate
        && let InterferenceEstimate::Source { source, .. } = relay.interference_estimate().estimate
    {
        info!(
            "estimate: interferer {=f32} W ({=u32:#010x}) x {=f32} m ({=u32:#010x}) y {=f32} m ({=u32:#010x})",
            source.power_w,
            source.power_w.to_bits(),
            source.x_m,
            source.x_m.to_bits(),
            source.y_m,
            source.y_m.to_bits(),
        );
    }
    if event == Event::SetpointChanged
        && let Some(place) = relay.setpoint()
    {
        let target = relay.target().unwrap_or_default();
        info!(
            "setpoint x {=f32} m ({=u32:#010x}) y {=f32} m ({=u32:#010x}) altitude {=f32} m ({=u32:#010x}) target {=f32} ({=u32:#010x})",
            place.x_m,
            place.x_m.to_bits(),
            place.y_m,
            place.y_m.to_bits(),
            place.altitude_m,
            place.altitude_m.to_bits(),
            target,
            target.to_bits(),
        );
    }
}

pub(crate) fn counters(relay: &Relay) {
    info!("counters {}", relay.stats());
    info!("log frames lost {=u32}", lost());
}

pub(crate) fn link_counters(link: &SerialStats) {
    info!("link {}", link);
}
