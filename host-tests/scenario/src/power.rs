//! Powers as in data sheets, in W or dBm and with antenna gains, and their form in the model.
//!
//! The channel model has only a path loss: P / (mu d^2) is received of P. With antennas of gains `G_t` and `G_r` (Friis) it is
//! `P G_t G_r / (mu d^2)`. With the interferers' `P_i G_i` and the receiver's noise N, the SINR is
//!
//! ```text
//! P G_t G_r / (mu d^2)                      P G_t / (mu d^2)
//! --------------------------------  =  ------------------------------
//! sum P_i G_i G_r / (mu_i d_i^2) + N   sum P_i G_i / (mu_i d_i^2) + N / G_r
//! ```
//!
//! so a sender's gain is included in its power (its EIRP counts), and a receiver's gain, which signal and interference share,
//! divides its noise. Without noise it has no effect.
//!
//! A mission has one N for all receivers. If the gains of the relays and of Rx differ, the lower one is used: exact for receivers
//! with that gain, and a lower bound on the SINR at the others.
//!
//! An antenna has the same gain in all directions; a null toward the interferer is not modelled.

use serde::Deserialize;

use crate::check::mistake;
use crate::error::{Problem, ScenarioError};
use crate::keys::number;
use crate::number::{factor, watts};

/// EIRPs that a mission accepts for Tx and relays, W, and for interferers.
const EIRP: [f64; 2] = [1e-6, 1e6];
const SOURCE_EIRP: [f64; 2] = [1e-6, 1e9];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPower {
    tx_w: Option<f64>,
    tx_dbm: Option<f64>,
    tx_gain_dbi: Option<f64>,
    tx_eirp_dbm: Option<f64>,
    uav_w: Option<f64>,
    uav_dbm: Option<f64>,
    uav_gain_dbi: Option<f64>,
    rx_gain_dbi: Option<f64>,
}

pub(super) struct Powers {
    pub(super) tx_w: f64,
    pub(super) uav_w: f64,
    pub(super) uav_gain_dbi: f64,
    pub(super) rx_gain_dbi: f64,
}

/// A sender's power in one of the forms that a table allows.
pub(super) struct Said<'a> {
    /// Name of the table, such as `interferer[0].`, and the keys in it.
    pub(super) table: &'a str,
    pub(super) in_w: (&'a str, Option<f64>),
    pub(super) in_dbm: (&'a str, Option<f64>),
    pub(super) eirp: (&'a str, Option<f64>),
    /// Key and value of the antenna gain.
    pub(super) gain: (&'a str, Option<f64>),
}

impl Said<'_> {
    fn eirp_w(&self, file: &str, [least, most]: [f64; 2]) -> Result<Option<f64>, ScenarioError> {
        let gain = self.gain.1.map_or(1.0, factor);
        let ((key, given), eirp_w) = match (self.in_w, self.in_dbm, self.eirp) {
            (said @ (_, Some(power_w)), _, _) => (said, power_w * gain),
            (_, said @ (_, Some(dbm)), _) => (said, watts(dbm) * gain),
            (_, _, said @ (_, Some(dbm))) => (said, watts(dbm)),
            _ => return Ok(None),
        };
        // The ranges of the keys have the same limits, apart from rounding of powers of ten.
        if (least * (1.0 - 1e-9)..=most * (1.0 + 1e-9)).contains(&eirp_w) {
            return Ok(Some(eirp_w.clamp(least, most)));
        }
        let (antenna, gain) = self.gain;
        let said = format!(
            "{} with {antenna} = {}, an EIRP of {eirp_w:.3e} W,",
            number(given.unwrap_or_default()),
            number(gain.unwrap_or_default())
        );
        let allowed = format!("an EIRP of {} to {} W", number(least), number(most));
        let key = format!("{}{key}", self.table);
        Err(mistake(
            file,
            &key,
            Some(said),
            Problem::OutOfRange,
            allowed,
        ))
    }

    pub(super) fn of_ours(&self, file: &str) -> Result<Option<f64>, ScenarioError> {
        self.eirp_w(file, EIRP)
    }

    pub(super) fn of_source(&self, file: &str) -> Result<Option<f64>, ScenarioError> {
        self.eirp_w(file, SOURCE_EIRP)
    }
}

pub(super) fn powers(file: &str, raw: &RawPower) -> Result<Powers, ScenarioError> {
    let table = "power.";
    let tx = Said {
        table,
        in_w: ("tx_w", raw.tx_w),
        in_dbm: ("tx_dbm", raw.tx_dbm),
        eirp: ("tx_eirp_dbm", raw.tx_eirp_dbm),
        gain: ("tx_gain_dbi", raw.tx_gain_dbi),
    };
    let uav = Said {
        table,
        in_w: ("uav_w", raw.uav_w),
        in_dbm: ("uav_dbm", raw.uav_dbm),
        eirp: ("", None),
        gain: ("uav_gain_dbi", raw.uav_gain_dbi),
    };
    Ok(Powers {
        tx_w: tx.of_ours(file)?.unwrap_or_default(),
        uav_w: uav.of_ours(file)?.unwrap_or_default(),
        uav_gain_dbi: raw.uav_gain_dbi.unwrap_or_default(),
        rx_gain_dbi: raw.rx_gain_dbi.unwrap_or_default(),
    })
}
