//! Log lines, with `--features defmt`. Their output is `sink_uart.rs`, or `sink_rtt.rs` with `--features rtt`.

use uav_relay::SetupError;
#[cfg(feature = "flight")]
use uav_relay::flight::autopilot::AutopilotEvent;
#[cfg(feature = "flight")]
use uav_relay::flight::autopilot::state::State;
#[cfg(feature = "flight")]
use uav_relay::flight::autopilot::trust::Mistrust;
#[cfg(feature = "flight")]
use uav_relay::flight::course::{Course, CourseError};
use uav_relay::sensing::belief::Belief;
use uav_relay::serial::SerialStats;
use uav_relay::{Event, Relay};
use uav_relay_chip::clock::Source;
use uav_relay_chip::reset::Reset;

use super::chip::Begun;
use super::clock;
use super::config::{Config, ConfigError};

#[cfg_attr(feature = "rtt", path = "sink_rtt.rs")]
#[cfg_attr(not(feature = "rtt"), path = "sink_uart.rs")]
mod sink;

pub(crate) use sink::*;

defmt::timestamp!("{=u64:us}", clock::micros());

pub(crate) fn begins(config: &Config) {
    defmt::info!(
        "relay {=u16} of {=u16}, network {=u16}",
        config.identity.index,
        config.mission.relays(),
        config.identity.network,
    );
}

pub(crate) fn started(begun: &Begun) {
    match begun.reset {
        Reset::Watchdog => {
            defmt::error!("started by the watchdog: the loop hung, or the clock stopped");
        }
        reset => defmt::info!("started: {=str}", reset.text()),
    }
    let mhz = begun.clocks.core_hz / 1_000_000;
    match begun.clocks.pll {
        Some(Source::Crystal) => defmt::info!("clock {=u32} MHz, from the crystal", mhz),
        Some(Source::Internal) => defmt::warn!("clock {=u32} MHz, no crystal of 8 MHz", mhz),
        None => defmt::warn!("clock {=u32} MHz, no PLL", mhz),
    }
}

pub(crate) fn unguarded() {
    defmt::warn!(
        "no sites: no autopilot is told where to fly, and nothing keeps drones apart on their way"
    );
}

/// Logs the line and the speed limit of the autopilot.
#[cfg(feature = "flight")]
pub(crate) fn flies(course: &Course) {
    defmt::info!(
        "the autopilot flies along {=f64} m at {=f32} m/s or less",
        course.axis.distance_m(),
        course.pace.speed_m_s
    );
}

#[cfg(feature = "flight")]
pub(crate) fn off_course(error: CourseError) {
    match error {
        CourseError::Axis(error) => defmt::error!("configuration refused: sites, {}", error),
        CourseError::Distance(along) => defmt::error!(
            "configuration refused: the sites are {=f64} m apart, the mission's distance is another",
            along
        ),
        other => defmt::error!("configuration refused: sites, {}", other),
    }
}

#[allow(dead_code, reason = "for an image that tells no autopilot")]
pub(crate) fn no_flight() {
    defmt::error!("configuration refused: it has sites, and this image was built without flight");
}

#[cfg(feature = "mavlink-signing")]
pub(crate) fn signs_to_autopilot() {
    defmt::info!("frames to the autopilot are signed, and only what is signed with its key counts");
}

#[cfg(all(feature = "flight", not(feature = "mavlink-signing")))]
pub(crate) fn cannot_sign_to_autopilot() {
    defmt::error!(
        "configuration refused: it has an autopilot's key, and this image was built without mavlink-signing"
    );
}

#[cfg(feature = "flight")]
pub(crate) fn autopilot(event: AutopilotEvent) {
    match event {
        AutopilotEvent::Found(kind) => defmt::info!("autopilot: found, {}", kind),
        AutopilotEvent::Restarted => defmt::warn!("autopilot: was switched off and on"),
        AutopilotEvent::Refused => defmt::warn!(
            "autopilot: does not fly where it is told to; is the place outside its fence?"
        ),
        AutopilotEvent::Released(release) => defmt::warn!("autopilot: released, {}", release),
        AutopilotEvent::Waits(reason) => {
            defmt::warn!("autopilot: cannot be engaged, {}", reason);
        }
        AutopilotEvent::LostCleared { relays, from, .. } => {
            defmt::warn!("relays {} are cleared, by MAVLink {}", relays, from);
        }
        AutopilotEvent::ClearRefused { relays, from } => defmt::warn!(
            "relays {} are not cleared: name all lost relays of one side; by MAVLink {}",
            relays,
            from
        ),
        AutopilotEvent::FenceBreached => defmt::warn!("autopilot: its fence is breached"),
        AutopilotEvent::State(State::Silent) => {
            defmt::warn!("autopilot: silent; look at the cable, the baud rate and MAVLink 2");
        }
        AutopilotEvent::State(State::Grounded) => {
            defmt::info!("autopilot: on the ground, or not armed");
        }
        AutopilotEvent::State(State::Standby) => {
            defmt::info!("autopilot: in the air, not flown by the relay");
        }
        AutopilotEvent::State(State::Engaged) => {
            defmt::info!("autopilot: flies to the relay's setpoints");
        }
        AutopilotEvent::State(State::Blind) => {
            defmt::warn!("autopilot: no position; keeps its last target");
        }
        AutopilotEvent::Mistrusted(Mistrust::NoKey) => {
            defmt::error!(
                "autopilot: signs, and answers nothing that is not signed; no key in the block"
            );
        }
        AutopilotEvent::Mistrusted(Mistrust::SignsOnly) => {
            defmt::info!("autopilot: signs, and answers what is not signed; no key in the block");
        }
        AutopilotEvent::Mistrusted(Mistrust::Unsigned) => {
            defmt::error!("autopilot: does not sign, and is not heard; a key in the block");
        }
        AutopilotEvent::Mistrusted(Mistrust::OtherKey) => {
            defmt::error!("autopilot: signs with another key than the block's, and is not heard");
        }
        AutopilotEvent::Mistrusted(Mistrust::Old) => {
            defmt::error!("autopilot: signs with a time of the past, and is not heard");
        }
        other => defmt::info!("autopilot: {}", other),
    }
}

pub(crate) fn refused(error: ConfigError) {
    match error {
        ConfigError::Blank => defmt::warn!("no configuration: the block is blank"),
        ConfigError::Magic => defmt::error!("configuration refused: no block"),
        ConfigError::Version => defmt::error!("configuration refused: version or length"),
        ConfigError::Crc => defmt::error!("configuration refused: damaged, the CRC does not match"),
        ConfigError::Index => defmt::error!("configuration refused: index"),
        ConfigError::Profile => defmt::error!("configuration refused: own altitude or power"),
        ConfigError::Hold => defmt::error!("configuration refused: byte 15 is neither 0 nor 1"),
        ConfigError::Method => {
            defmt::error!("configuration refused: method unknown, or not for a field");
        }
        ConfigError::Adjust => {
            defmt::error!("configuration refused: rounds or altitudes of adjust");
        }
        ConfigError::Measure => {
            defmt::error!("configuration refused: samples or most interference");
        }
        ConfigError::Listen => {
            defmt::error!("configuration refused: how it listens, out of range or in a field");
        }
        ConfigError::Interferer => {
            defmt::error!("configuration refused: interferer and field at once");
        }
        ConfigError::Points => defmt::error!("configuration refused: too many points of the field"),
        ConfigError::Unused => {
            defmt::error!("configuration refused: bytes behind the last point are not 0");
        }
        ConfigError::Secret => {
            defmt::error!("configuration refused: key or epoch, without the other or out of range");
        }
        ConfigError::Speed => {
            defmt::error!("configuration refused: greatest speed out of range, or without sites");
        }
        ConfigError::AutopilotKey => {
            defmt::error!("configuration refused: an autopilot's key without sites");
        }
        ConfigError::Silence => {
            defmt::error!("configuration refused: silence before a question, over 1200000 ms");
        }
        ConfigError::Field(error) => defmt::error!("configuration refused: field, {}", error),
        ConfigError::Channel(error) => defmt::error!("configuration refused: channel, {}", error),
        ConfigError::Mission(error) => defmt::error!("configuration refused: mission, {}", error),
    }
}

/// Logs the signing epoch; `kept` is true if it was stored.
#[cfg(feature = "auth")]
pub(crate) fn signs(epoch: u32, kept: bool) {
    if kept {
        defmt::info!("frames are signed, epoch {=u32}", epoch);
    } else {
        defmt::error!(
            "frames are signed, epoch {=u32}; it cannot be kept: raise the epoch of the block before the next start",
            epoch
        );
    }
}

#[cfg(feature = "auth")]
pub(crate) fn unsigned() {
    defmt::warn!("no key: frames are not signed, and anybody can send some");
}

#[cfg(feature = "auth")]
pub(crate) fn no_epoch() {
    defmt::error!("no epoch is left to sign with");
}

/// Logs that a mission uploaded before this start was restored.
#[cfg(feature = "upload")]
pub(crate) fn resumes(version: u16) {
    defmt::info!("mission version {=u16} was uploaded before", version);
}

/// Logs an uploaded mission; `kept` is true if it was stored.
#[cfg(feature = "upload")]
pub(crate) fn uploaded(version: u16, kept: bool) {
    if kept {
        defmt::info!("mission version {=u16} is kept", version);
    } else {
        defmt::warn!(
            "mission version {=u16} cannot be kept: after a reboot it has to come again",
            version
        );
    }
}

/// Logs the votes restored after a reboot; `taken` is true if the relay accepts them.
pub(crate) fn stands_by(taken: bool) {
    if taken {
        defmt::info!("what was said in the votes on views before holds");
    } else {
        defmt::error!("what was said in the votes on views before is of another firmware");
    }
}

/// Logs that storing the votes works again (`kept`) or fails.
pub(crate) fn votes(kept: bool) {
    if kept {
        defmt::info!("what is said in the votes on views is kept again");
    } else {
        defmt::error!(
            "what is said in the votes on views cannot be kept: a reboot in flight forgets it"
        );
    }
}

#[cfg(not(feature = "auth"))]
pub(crate) fn cannot_sign() {
    defmt::error!("configuration refused: it has a key, and this image was built without auth");
}

/// Logs that this image was built without the feature for the method, or for measuring.
pub(crate) fn cannot_fly(error: SetupError) {
    defmt::error!("configuration refused: this image cannot do it, {}", error);
}

pub(crate) fn event(event: Event, relay: &Relay) {
    defmt::info!("event {}", event);
    #[cfg(feature = "upload")]
    if event == Event::Adopted {
        defmt::info!("mission version {=u16} is flown", relay.version());
    }
    if event == Event::Believed
        && let Belief::Source { source, .. } = relay.belief().belief
    {
        defmt::info!(
            "believed: interferer {=f32} W ({=u32:#010x}) x {=f32} m ({=u32:#010x}) y {=f32} m ({=u32:#010x})",
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
        defmt::info!(
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
    defmt::info!("counters {}", relay.stats());
    defmt::info!("log frames lost {=u32}", lost());
}

pub(crate) fn link_counters(link: &SerialStats) {
    defmt::info!("link {}", link);
}
