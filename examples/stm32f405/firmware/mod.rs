//! Parts of every image: the drone, its ports, its persistent state and its log.

pub(crate) mod board;
pub(crate) mod chip;
pub(crate) mod clock;
pub(crate) mod drone;
mod flash;
pub(crate) mod log;
pub(crate) mod persistent;
pub(crate) mod pins;
pub(crate) mod port;
#[cfg(all(feature = "defmt", not(feature = "rtt")))]
mod uart_log;
#[cfg(feature = "upload")]
#[expect(unreachable_pub, reason = "the tests on the ground have it public")]
mod uploads;

pub(crate) use uav_relay_block as config;
