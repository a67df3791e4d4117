//! Log lines for an upload's changes: each value that differs, and the distance that each relay moves.

use serde_json::{Value, json};
use uav_relay::{Band, Instant, Interference, MissionConfig, Placement};
use uav_relay_linux::log::Log;
use uav_relay_linux::site::degrees;

use crate::forecast::Move;
use crate::new::Basis;

pub(crate) fn log_changes(log: &Log, now: Instant, before: &Basis, after: &Basis) {
    let mut is_same = true;
    for (name, old, new) in changes(before, after) {
        is_same = false;
        let fields = json!({ "value": name, "old": old, "new": new });
        let what = format_args!("new mission, {name}: {old} -> {new}");
        log.event(now, "change", fields, what);
    }
    if is_same {
        log.line(
            now,
            "change",
            "the new mission has the same values as the present one",
        );
    }
}

/// Returns each value that differs between the two missions, as text with its unit. The three texts are the name, the
/// value before, and the value after.
pub(crate) fn changes(
    before: &Basis,
    after: &Basis,
) -> impl Iterator<Item = (&'static str, String, String)> {
    let pairs = values(before).into_iter().zip(values(after));
    let pairs = pairs.map(|((name, old), (_, new))| (name, old, new));
    pairs.filter(|(_, old, new)| old != new)
}

/// Returns the values of a mission with their names, each value as text with its unit.
fn values(basis: &Basis) -> Vec<(&'static str, String)> {
    let MissionConfig {
        distance_m,
        min_separation_m,
        tx_power_w,
        common,
        band,
        lateral,
        interference,
        noise_w,
        reverse,
        rx_power_w,
        fitted_gap,
        ..
    } = basis.config;
    let range = |Band { least_m, most_m }| format!("{least_m} to {most_m} m");
    let site = |at: Option<_>| at.map_or("not known".to_owned(), degrees);
    vec![
        ("transmitter", site(basis.line.map(|line| line.tx))),
        ("receiver", site(basis.line.map(|line| line.rx))),
        (
            "distance from transmitter to receiver",
            format!("{distance_m} m"),
        ),
        ("altitude", format!("{} m", common.altitude_m)),
        ("range of altitudes", range(band)),
        ("lateral range", range(lateral)),
        ("power of the transmitter", format!("{tx_power_w} W")),
        ("power of a relay", format!("{} W", common.power_w)),
        (
            "interferer",
            match interference {
                Interference::Source(at) => {
                    format!("{} W at x {} m, y {} m", at.power_w, at.x_m, at.y_m)
                }
                Interference::Unknown => "measured by the relays".to_owned(),
                Interference::Field(_) => "a field (interference along the line)".to_owned(),
            },
        ),
        ("noise", format!("{noise_w} W")),
        (
            "required SIR from Rx to Tx",
            format!("{reverse} times the SIR from Tx to Rx"),
        ),
        ("power of the receiver", format!("{rx_power_w} W")),
        (
            "time slots",
            if fitted_gap > 0.0 {
                format!(
                    "of a length fitted to the data rate of each hop; SNR gap to the Shannon limit: factor {fitted_gap}"
                )
            } else {
                "equal for all hops".to_owned()
            },
        ),
        ("minimum separation", format!("{min_separation_m} m")),
    ]
}

/// Returns the move of one relay as JSON: its number, the distance, and the positions before and after.
pub(crate) fn fields(moved: &Move) -> Value {
    let place = |at: Placement| json!({ "x_m": at.x_m, "y_m": at.y_m, "h_m": at.altitude_m });
    let (from, to) = (place(moved.before), place(moved.after));
    json!({ "relay": moved.index, "metres": moved.metres, "from": from, "to": to })
}

pub(crate) fn log_moves(log: &Log, now: Instant, moves: Option<&[Move]>) {
    let Some(moves) = moves else {
        let what = "the moves of the relays cannot be computed in advance: either the relays measure the interference, or the new mission has no positions with an SIR above 0";
        log.line(now, "move", what);
        return;
    };
    for moved in moves {
        let Move {
            index,
            before,
            after,
            metres,
        } = moved;
        let at = |p: &Placement| {
            format!(
                "x {:.1} m, y {:.1} m, altitude {:.1} m",
                p.x_m, p.y_m, p.altitude_m
            )
        };
        let (from, to) = (at(before), at(after));
        let what = format_args!("relay {index} moves {metres:.1} m, from {from} to {to}");
        log.event(now, "move", fields(moved), what);
    }
}
