//! Log lines, with `--features defmt`. They go to a UART (`uart_log.rs`) or to the debug probe.
//!
//! With `--features rtt`, `probe-rs run` prints them. They are then written to RAM without blocking. The probe cannot
//! request the counters. Frames that it reads too late are lost and not counted.
#![allow(
    clippy::match_same_arms,
    clippy::if_same_then_else,
    reason = "the arms have different log texts, which the lints do not see"
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
pub(crate) use super::uart_log::counters_requested;
#[cfg(all(feature = "defmt", not(feature = "rtt")))]
use super::uart_log::lost;
#[cfg(feature = "rtt")]
use defmt_rtt as _;

/// Returns false, because the counters can be requested only with a log over a UART.
#[cfg(not(all(feature = "defmt", not(feature = "rtt"))))]
pub(crate) const fn counters_requested() -> bool {
    false
}

/// Returns 0: dropped log frames are counted only for a UART.
#[cfg(not(all(feature = "defmt", not(feature = "rtt"))))]
const fn lost() -> u32 {
    0
}

#[cfg(feature = "defmt")]
defmt::timestamp!("{=u64:us}", super::clock::micros());

/// Logs a line at a level of defmt, such as `info`. Does nothing without `--features defmt`.
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
            error!("restarted by the watchdog: the main loop hung, or the clock stopped");
        }
        reset => info!("started, cause of the reset: {=str}", reset.text()),
    }
    let mhz = begun.clocks.core_hz / 1_000_000;
    match begun.clocks.pll {
        Some(Source::Crystal) => info!("clock {=u32} MHz, from the 8 MHz crystal", mhz),
        Some(Source::Internal) => warn!(
            "clock {=u32} MHz, from the internal oscillator: no 8 MHz crystal found; do not fly, baud rates may be wrong by 8 %",
            mhz
        ),
        None => warn!(
            "clock {=u32} MHz, from the internal oscillator: the PLL did not start; do not fly, baud rates may be wrong by 8 %",
            mhz
        ),
    }
}

pub(crate) fn unguarded() {
    warn!(
        "no sites (positions of Tx and Rx on earth): no autopilot is controlled, and drones are not kept apart while they move"
    );
}

/// Logs the length of the line from Tx to Rx, and the drone's speed limit.
#[cfg(feature = "flight")]
pub(crate) fn flies(course: &Course) {
    info!(
        "autopilot: {=f64} m from transmitter to receiver, maximum speed {=f32} m/s",
        course.axis.distance_m(),
        course.pace.speed_m_s
    );
}

#[cfg(feature = "flight")]
pub(crate) fn off_course(error: CourseError) {
    match error {
        CourseError::Axis(error) => error!("configuration refused: sites: {}", error),
        CourseError::Distance(along) => error!(
            "configuration refused: Tx and Rx are {=f64} m apart: the mission's distance must be the same",
            along
        ),
        other => error!("configuration refused: sites: {}", other),
    }
}

#[allow(dead_code, reason = "for an image that tells no autopilot")]
pub(crate) fn no_flight() {
    error!(
        "configuration refused: it has sites (positions of Tx and Rx), but this image was built without the cargo feature flight"
    );
}

#[cfg(feature = "mavlink-signing")]
pub(crate) fn signs_to_autopilot() {
    info!(
        "frames to the autopilot are signed; frames from the autopilot that are not signed with the same key are ignored"
    );
}

#[cfg(all(feature = "flight", not(feature = "mavlink-signing")))]
pub(crate) fn cannot_sign_to_autopilot() {
    error!(
        "configuration refused: it has an autopilot's key, but this image was built without the cargo feature mavlink-signing"
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
        ConfigError::Blank => warn!(
            "no configuration: the configuration block in flash is blank, so this relay does nothing: provision the drone"
        ),
        ConfigError::Magic => {
            error!(
                "configuration refused: the configuration block does not begin with UAVR: provision the drone again"
            );
        }
        ConfigError::Version => {
            error!(
                "configuration refused: the block has another version or length than this firmware reads: provision the drone again"
            );
        }
        ConfigError::Crc => {
            error!(
                "configuration refused: the block is damaged (its CRC does not match): provision the drone again"
            );
        }
        ConfigError::Index => {
            error!(
                "configuration refused: the relay's index must be within 1 to the number of relays"
            );
        }
        ConfigError::Profile => {
            error!(
                "configuration refused: this relay's altitude must be within 0.1 to 1e5 m, its power within 1e-6 to 1e6 W"
            );
        }
        ConfigError::Hold => {
            error!(
                "configuration refused: byte 15 of the block, which is 1 if the relay keeps its altitude, must be 0 or 1"
            );
        }
        ConfigError::Method => {
            error!(
                "configuration refused: the method must be align, joint or adjust; with an interference field it must be align"
            );
        }
        ConfigError::Adjust => {
            error!(
                "configuration refused: method adjust: rounds must be within 1 to 65535 and explore_m within 0 to 1e5 m; with another method both must be 0"
            );
        }
        ConfigError::Measure => {
            error!(
                "configuration refused: measured interference: samples (number for each estimate) must be within 100 to 1000000 and i_max_w (maximum power) within 1e-30 to 1e6 W; without measurements both must be 0"
            );
        }
        ConfigError::Listen => {
            error!(
                "configuration refused: listen (locating the interferer) needs times above 0, a relative_error within 1e-3 to 1, and no interference field"
            );
        }
        ConfigError::Reverse => {
            error!(
                "configuration refused: reverse above 0 (SIR required from Rx to Tx) together with listen needs the method align or adjust"
            );
        }
        ConfigError::Fitted => {
            error!(
                "configuration refused: a fitted_gap above 0 (time slots fitted to the hops) needs the method joint and a known interferer"
            );
        }
        ConfigError::Interferer => {
            error!(
                "configuration refused: it has both an interferer and an interference field: leave one out"
            );
        }
        ConfigError::Points => error!(
            "configuration refused: the interference field has more points than the block can hold"
        ),
        ConfigError::Unused => {
            error!(
                "configuration refused: the bytes after the last point of the interference field must be 0"
            );
        }
        ConfigError::Secret => {
            error!(
                "configuration refused: key and epoch must be given together, the epoch within 1 to 4294967294"
            );
        }
        ConfigError::Speed => {
            error!(
                "configuration refused: the maximum speed must be within 0.1 to 20 m/s, and needs sites (positions of Tx and Rx)"
            );
        }
        ConfigError::AutopilotKey => {
            error!(
                "configuration refused: an autopilot's key needs sites (positions of Tx and Rx)"
            );
        }
        ConfigError::Silence => error!("configuration refused: probe_after_ms above 1200000"),
        ConfigError::Spare => error!("configuration refused: spare must be 0 or 1"),
        ConfigError::Field(error) => error!("configuration refused: interference field: {}", error),
        ConfigError::Channel(error) => error!("configuration refused: channel: {}", error),
        ConfigError::Mission(error) => error!("configuration refused: mission: {}", error),
    }
}

/// Logs the signing epoch of this start, and whether it was stored.
#[cfg(feature = "auth")]
pub(crate) fn signs(epoch: u32, is_stored: bool) {
    if is_stored {
        info!(
            "frames are signed; epoch {=u32} (start counter, larger at every start)",
            epoch
        );
    } else {
        error!(
            "frames are signed; epoch {=u32} (start counter): this relay cannot store it, so increase the epoch in the configuration block before every start",
            epoch
        );
    }
}

#[cfg(feature = "auth")]
pub(crate) fn unsigned() {
    warn!("no key: frames are not signed, so anybody in range can forge them");
}

#[cfg(feature = "auth")]
pub(crate) fn no_epoch() {
    error!(
        "frames cannot be signed: the epoch (start counter) has reached its maximum: provision all drones with a new key"
    );
}

/// Logs that an uploaded mission was restored after a reboot.
#[cfg(feature = "upload")]
pub(crate) fn resumes(version: u16) {
    info!(
        "mission version {=u16} restored, which was uploaded before this start",
        version
    );
}

/// Logs that a mission was uploaded in flight, and whether it was stored.
#[cfg(feature = "upload")]
pub(crate) fn uploaded(version: u16, is_stored: bool) {
    if is_stored {
        info!("mission version {=u16} stored", version);
    } else {
        warn!(
            "mission version {=u16} cannot be stored in flash: after a reboot it has to be uploaded again",
            version
        );
    }
}

/// Logs that stored votes on the chain's members were found after a reboot.
///
/// `accepted` is true if the relay accepts these votes.
pub(crate) fn votes_restored(accepted: bool) {
    if accepted {
        info!("votes on the chain's members from before this start were read from flash");
    } else {
        error!(
            "votes on the chain's members in flash were written by another firmware, and are ignored: harmless before a flight; in flight land this drone, because it might vote twice"
        );
    }
}

/// Logs that storing the relay's votes on the chain's members works again (true) or fails (false).
pub(crate) fn votes(is_stored: bool) {
    if is_stored {
        info!("votes on the chain's members can be stored in flash again");
    } else {
        error!(
            "votes on the chain's members cannot be stored in flash, and a restart in flight would lose them: land this drone, and check its flash"
        );
    }
}

#[cfg(not(feature = "auth"))]
pub(crate) fn cannot_sign() {
    error!(
        "configuration refused: it has a key, but this image was built without the cargo feature auth"
    );
}

/// Logs that the relay rejects the configuration, usually because this image lacks a feature.
pub(crate) fn cannot_fly(error: SetupError) {
    error!(
        "configuration refused: not supported by this image: {}",
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
            "setpoint x {=f32} m ({=u32:#010x}) y {=f32} m ({=u32:#010x}) altitude {=f32} m ({=u32:#010x}) target SIR {=f32} ({=u32:#010x})",
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
    info!("log lines lost: {=u32}", lost());
}

pub(crate) fn link_counters(link: &SerialStats) {
    info!("link {}", link);
}
