//! Checks section `[network]` of a file against what the firmware supports.

use uav_relay::{Duration, Settings};
use uav_relay_scenario::deployment::Network;

use super::config::{BAUD, MOST_PROBE_AFTER_MS};

/// Returns the silence after which a neighbour is probed and that after which it is lost. 0 selects the default.
pub fn silence(probe_after_ms: u32) -> [Duration; 2] {
    let settings = match u64::from(probe_after_ms) {
        0 => Settings::default(),
        ms => Settings::default().with_probe_after(Duration::from_millis(ms)),
    };
    [settings.probe_after, settings.dead_after]
}

/// Returns `probe_after_ms` for the block: the command line's `given_ms`, else the section's. 0 for the firmware's default.
///
/// # Errors
/// A line that names a key whose value no block can express, the value and the allowed one.
pub fn probe_after_ms(section: &Network, given_ms: Option<u32>, name: &str) -> Result<u32, String> {
    let refuse = |key: &str, value: u32, own: u32, why: &str| {
        format!(
            "{name}: network.{key} = {value}: must be {own}, or left out: {why}, and no block changes it"
        )
    };
    let ms = |time: Duration| u32::try_from(time.as_micros() / 1_000).unwrap_or(u32::MAX);
    if let Some(baud) = section.baud.filter(|baud| *baud != BAUD) {
        let line = refuse("baud", baud, BAUD, "the firmware's ports run at that");
        return Err(format!("{line}; a radio's own data rate is --baud"));
    }
    let probe_after_ms = given_ms.or(section.probe_after_ms).unwrap_or(0);
    if probe_after_ms > MOST_PROBE_AFTER_MS {
        return Err(format!(
            "{name}: network.probe_after_ms = {probe_after_ms}: must be within 1 to {MOST_PROBE_AFTER_MS}"
        ));
    }
    let [_, dead_after] = silence(probe_after_ms);
    let dead = ms(dead_after);
    let own = section.dead_after_ms.filter(|_| given_ms.is_none());
    if let Some(after) = own.filter(|after| *after != dead) {
        let why = "three times probe_after_ms, as the firmware has it";
        return Err(refuse("dead_after_ms", after, dead, why));
    }
    // The explicit default and 0 give the same block.
    let [usual, _] = silence(0);
    let is_usual = Duration::from_millis(probe_after_ms.into()) == usual;
    Ok(if is_usual { 0 } else { probe_after_ms })
}
