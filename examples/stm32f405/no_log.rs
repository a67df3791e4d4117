//! Replacement of `log.rs` without `--features defmt`: it logs nothing.

use uav_relay::SetupError;
#[cfg(feature = "flight")]
use uav_relay::flight::autopilot::AutopilotEvent;
#[cfg(feature = "flight")]
use uav_relay::flight::course::{Course, CourseError};
use uav_relay::serial::SerialStats;
use uav_relay::{Event, Relay};

use super::chip::Begun;
use super::config::{Config, ConfigError};

pub(crate) const fn asked() -> bool {
    false
}

pub(crate) const fn started(_: &Begun) {}

pub(crate) const fn begins(_: &Config) {}

pub(crate) const fn unguarded() {}

#[cfg(feature = "flight")]
pub(crate) const fn flies(_: &Course) {}

#[cfg(feature = "flight")]
pub(crate) const fn off_course(_: CourseError) {}

#[cfg(feature = "mavlink-signing")]
pub(crate) const fn signs_to_autopilot() {}

#[cfg(all(feature = "flight", not(feature = "mavlink-signing")))]
pub(crate) const fn cannot_sign_to_autopilot() {}

#[allow(dead_code, reason = "for an image that tells no autopilot")]
pub(crate) const fn no_flight() {}

#[cfg(feature = "flight")]
pub(crate) const fn autopilot(_: AutopilotEvent) {}

pub(crate) const fn refused(_: ConfigError) {}

#[cfg(feature = "auth")]
pub(crate) const fn signs(_: u32, _: bool) {}

#[cfg(feature = "auth")]
pub(crate) const fn unsigned() {}

#[cfg(feature = "auth")]
pub(crate) const fn no_epoch() {}

#[cfg(feature = "upload")]
pub(crate) const fn resumes(_: u16) {}

#[cfg(feature = "upload")]
pub(crate) const fn uploaded(_: u16, _: bool) {}

pub(crate) const fn stands_by(_: bool) {}

pub(crate) const fn votes(_: bool) {}

#[cfg(not(feature = "auth"))]
pub(crate) const fn cannot_sign() {}

pub(crate) const fn cannot_fly(_: SetupError) {}

pub(crate) const fn event(_: Event, _: &Relay) {}

pub(crate) const fn counters(_: &Relay) {}

pub(crate) const fn link_counters(_: &SerialStats) {}
