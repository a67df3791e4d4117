//! Positions of the relays and SIR of every hop.

use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::place::Station;
use uav_relay::sir::{Sender, at_receiver, at_transmitter};
use uav_relay::{Mission, Placement, Profile};

/// Position and SIR of a relay.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RelayReport {
    /// Index in the chain, from 1.
    pub index: u16,
    /// Distance from the transmitter, m.
    pub x_m: f64,
    /// Distance from the line, m, positive to the right as seen toward the receiver.
    pub y_m: f64,
    /// Altitude, m.
    pub h_m: f64,
    /// SIR of the hop that ends at the relay, linear.
    pub sir: f64,
    /// SIR of the hop that ends at the relay, dB.
    pub sir_db: f64,
    /// SIR of the same hop on the way back, at the node before this relay, linear.
    ///
    /// Absent if it is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir_back: Option<f64>,
    /// Version of the relay's mission, 0 for the loaded mission; absent without uploads.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
}

/// Relay that is no longer in the chain.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct LostReport {
    /// Relay number in the mission, from 1.
    pub index: u16,
    /// Last setpoint: distance from the transmitter, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_m: Option<f64>,
    /// Last setpoint: distance from the line, m, positive to the right.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_m: Option<f64>,
    /// Last setpoint: altitude, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub h_m: Option<f64>,
    /// Last version of the relay's mission; absent without uploads.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Reason: `silent`; `apart` (alive, cannot reach the others); `no quorum` (alive, no chain is left).
    pub why: &'static str,
}

/// Converts a linear power ratio to dB.
pub fn db(linear: f64) -> f64 {
    // `libm` gives the same result on every machine, and in a browser.
    10.0 * libm::log10(linear)
}

/// Returns the SIR of every hop, from the transmitter to the receiver, for relays at `places`.
///
/// Uses the crate's formulas, as on board; limited to the largest f32 for nearly coincident positions.
pub fn hop_sirs(mission: &Mission, places: &[(Placement, Profile)]) -> Vec<f64> {
    let mut sender = Sender::transmitter(mission);
    let mut from_m = 0.0;
    let mut sirs = Vec::with_capacity(places.len() + 1);
    for (place, profile) in places {
        sirs.push(f64::from(
            sender.sir_at(mission, from_m, *place).min(f32::MAX),
        ));
        let relay = Station {
            cross_section: place.cross_section(),
            power_w: profile.power_w,
        };
        sender = Sender::relay(mission, relay);
        from_m = place.x_m;
    }
    if let Some((place, profile)) = places.last() {
        sirs.push(f64::from(at_receiver(mission, *place, profile.power_w)));
    }
    sirs
}

/// Returns the SIR of every hop on the way back from Rx to Tx. Hop k is received by node k - 1.
///
/// Uses the crate's formulas, limited as [`hop_sirs`]. Empty unless the mission has one known interferer, or a way back in a field.
pub fn hop_sirs_back(mission: &Mission, places: &[(Placement, Profile)]) -> Vec<f64> {
    let is_known = mission.known_source().is_some();
    let is_both_ways = mission.config().reverse > 0.0 && mission.field().is_some();
    let Some((first, profile)) = places.first().filter(|_| is_known || is_both_ways) else {
        return Vec::new();
    };
    let limited = |sir: f32| f64::from(sir.min(f32::MAX));
    let mut sirs = vec![limited(at_transmitter(mission, *first, profile.power_w))];
    let senders = places.iter().skip(1).map(|(place, profile)| {
        let relay = Station {
            cross_section: place.cross_section(),
            power_w: profile.power_w,
        };
        (Sender::relay(mission, relay), place.x_m)
    });
    let rx = (Sender::receiver(mission), mission.config().distance_m);
    let hops = places.iter().zip(senders.chain([rx]));
    sirs.extend(hops.map(|((to, _), (sender, x_m))| limited(sender.sir_at(mission, x_m, *to))));
    sirs
}

/// SIR of the worst hop on the way back.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct WorstBack {
    /// SIR needed on the way back, relative to that on the way there: `link.reverse`.
    pub reverse: f64,
    /// SIR of the worst hop on the way back, linear.
    pub worst_back: f64,
    /// SIR of the worst hop on the way back, dB.
    pub worst_back_db: f64,
}

impl WorstBack {
    /// Returns the worst of `sirs`, if the mission has a way back.
    pub fn of(mission: &Mission, sirs: &[f64]) -> Option<Self> {
        let reverse = f64::from(mission.config().reverse);
        let worst_back = sirs.iter().copied().reduce(f64::min)?;
        (reverse > 0.0).then(|| Self {
            reverse,
            worst_back,
            worst_back_db: db(worst_back),
        })
    }

    /// Returns the worse of `sir`, that of the way there, and of the way back divided by `reverse`.
    pub fn both(&self, sir: f64) -> f64 {
        sir.min(self.worst_back / self.reverse)
    }
}

/// Reports the relays at `places` with the SIR of the hop that ends at each.
pub fn relays(places: &[(Placement, Profile)], sirs: &[f64]) -> Vec<RelayReport> {
    (1..)
        .zip(places.iter().zip(sirs))
        .map(|(index, ((place, _), &sir))| RelayReport {
            index,
            x_m: f64::from(place.x_m),
            y_m: f64::from(place.y_m),
            h_m: f64::from(place.altitude_m),
            sir,
            sir_db: db(sir),
            sir_back: None,
            version: None,
        })
        .collect()
}

/// Formats all relays, including lost relays, and Rx as a table; with a y column if `room` is true.
pub fn hops_table(
    relays: &[RelayReport],
    lost: &[LostReport],
    rx_sir: Option<f64>,
    room: bool,
) -> String {
    let aside = |words: &dyn Fn() -> String| {
        if room {
            format!(" {:>12}", words())
        } else {
            String::new()
        }
    };
    let mut text = String::new();
    if !(relays.is_empty() && lost.is_empty()) {
        _ = writeln!(
            text,
            "{:>6} {:>12}{} {:>10} {:>12} {:>9}",
            "relay",
            "x [m]",
            aside(&|| "y [m]".to_owned()),
            "h [m]",
            "SIR",
            "SIR [dB]"
        );
        let kept = relays.iter().map(|relay| {
            let line = format!(
                "{:>6} {:>12.3}{} {:>10.2} {:>12.6} {:>9.3}",
                relay.index,
                relay.x_m,
                aside(&|| format!("{:.3}", relay.y_m)),
                relay.h_m,
                relay.sir,
                relay.sir_db
            );
            (relay.index, line)
        });
        let gone = lost.iter().map(|relay| {
            let y = || {
                relay
                    .y_m
                    .map_or_else(|| "-".to_owned(), |y_m| format!("{y_m:.3}"))
            };
            (relay.index, lost_line(relay, &aside(&y)))
        });
        let mut lines: Vec<(u16, String)> = kept.chain(gone).collect();
        lines.sort_by_key(|(index, _)| *index);
        for (_, line) in lines {
            _ = writeln!(text, "{line}");
        }
    }
    if let Some(rx_sir) = rx_sir {
        _ = writeln!(
            text,
            "{:>6} {:>12}{} {:>10} {:>12.6} {:>9.3}",
            "Rx",
            "",
            aside(&String::new),
            "",
            rx_sir,
            db(rx_sir)
        );
    }
    text
}

fn lost_line(relay: &LostReport, aside: &str) -> String {
    let place = relay.x_m.zip(relay.h_m).map_or_else(
        || format!("{:>12}{aside} {:>10}", "-", "-"),
        |(x_m, h_m)| format!("{x_m:>12.3}{aside} {h_m:>10.2}"),
    );
    format!("{:>6} {place} {:>12}", relay.index, relay.why)
}
