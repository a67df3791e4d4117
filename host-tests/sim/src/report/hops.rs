//! Positions of the relays and SIR of every hop.

use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::optimiser::pass::Walk;
use uav_relay::{Mission, Placement, Profile, SlotShares};
use uav_relay_scenario::number::shortest;
pub use uav_relay_screen::hops::{db, hop_sirs, hop_sirs_back};

/// Returns the position that relay `index` takes if the chain meets the target SIR `target`, linear.
///
/// This is the relay's farthest x in the direction of the pass, or an x before it if the relays after it in the pass
/// can meet the target only then. `None` if the chain cannot meet it. `profile_of` returns the profile of relay 1..=N.
pub fn place(
    mission: &Mission,
    target: f32,
    index: u16,
    profile_of: impl Fn(u16) -> Profile,
) -> Option<Placement> {
    [false, true].into_iter().find_map(|plain| {
        let chain = Walk::new(mission, target, plain, &profile_of);
        // Every relay must have a position, not only the relays between this one and the end of the pass.
        chain.place(0)?;
        let x_m = chain.place(index)?;
        Some(profile_of(index).on_line().cross_section.at(x_m))
    })
}

/// Position of a relay at the end of a run, and the SIRs of its hop to the previous node.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RelayReport {
    /// Number of the relay, from 1 next to Tx.
    pub index: u16,
    /// Distance of the relay from Tx along the line to Rx, m, measured on the ground.
    pub x_m: f64,
    /// Lateral offset of the relay from the line Tx to Rx, m; positive to the right as seen from Tx.
    pub y_m: f64,
    /// Altitude of the relay, m.
    pub h_m: f64,
    /// Linear SIR of the hop from the previous node to this relay.
    pub sir: f64,
    /// SIR of the hop from the previous node to this relay, dB.
    pub sir_db: f64,
    /// Linear SIR of the hop from this relay back to the previous node.
    ///
    /// Absent if it is unknown, or if the mission requires no SIR from Rx to Tx.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir_back: Option<f64>,
    /// Version of the relay's mission; 0 for the mission loaded before the start. Absent if no mission was uploaded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
}

/// Time slots of a hop, if the slots are fitted to the hops. Times are fractions of the TDMA frame, 0 to 1.
///
/// The TDMA frame begins with the slots toward Rx, from hop 1 to the last hop. Then the slots toward Tx follow, from
/// the last hop to hop 1.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct HopSlots {
    /// Number of the hop, from 1: hop k connects the nodes k - 1 and k of the chain. Node 0 is Tx.
    pub hop: usize,
    /// Start and end of the slot for data toward Rx.
    pub slot: [f64; 2],
    /// Start and end of the slot for data toward Tx; absent if there are no such data.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slot_back: Option<[f64; 2]>,
}

impl HopSlots {
    /// Computes the time slots of all hops. Each slot is proportional to the time that the hop's data needs.
    ///
    /// `there` has the times for data toward Rx, `back` those for data toward Tx; `back` is empty if there are only
    /// data toward Rx. The result is empty if a time is infinite, because the hop then carries no data.
    pub fn of(there: &[f64], back: &[f64]) -> Vec<Self> {
        let frame: f64 = there.iter().chain(back.iter().rev()).sum();
        let mut spent = 0.0;
        let mut next = |time: &f64| {
            let begin = spent / frame;
            spent += time;
            [begin, spent / frame]
        };
        let there: Vec<_> = there.iter().map(&mut next).collect();
        let mut back: Vec<_> = back.iter().rev().map(next).collect();
        back.reverse();
        let hops = (1..).zip(there).filter(|_| frame.is_finite());
        hops.map(|(hop, slot)| Self {
            hop,
            slot,
            slot_back: back.get(hop - 1).copied(),
        })
        .collect()
    }

    /// Collects the time slots of all hops from the slots that the relays have agreed on. `relays` has the slots of
    /// each relay in order, relay 1 first.
    pub fn agreed(relays: &[SlotShares]) -> Vec<Self> {
        let last = relays.last().map(|last| (last.to_rx, last.from_rx));
        let hops = relays.iter().map(|own| (own.from_tx, own.to_tx));
        (1..)
            .zip(hops.chain(last))
            .map(|(hop, (slot, [begin, end]))| Self {
                hop,
                slot: slot.map(f64::from),
                slot_back: (end > begin).then_some([begin, end].map(f64::from)),
            })
            .collect()
    }

    /// Formats the slots of all hops as a table; empty without slots.
    pub fn table(hops: &[Self]) -> String {
        let mut text = String::new();
        for Self {
            hop,
            slot,
            slot_back,
        } in hops
        {
            if *hop == 1 {
                let back = slot_back.map_or("", |_| "    back from         to");
                text += "time slots, as shares of the period of all slots:\n";
                _ = writeln!(text, "{:>6} {:>12} {:>10}{back}", "hop", "slot from", "to");
            }
            let back = slot_back.map(|[begin, end]| format!(" {begin:>12.6} {end:>10.6}"));
            let [begin, end] = slot;
            _ = writeln!(
                text,
                "{hop:>6} {begin:>12.6} {end:>10.6}{}",
                back.unwrap_or_default()
            );
        }
        text
    }
}

/// Relay that is not in the chain at the end of a run.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct LostReport {
    /// Number of the relay in the mission, from 1.
    pub index: u16,
    /// Last setpoint of the relay: distance from Tx along the line to Rx, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_m: Option<f64>,
    /// Last setpoint of the relay: lateral offset from the line Tx to Rx, m; positive to the right.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_m: Option<f64>,
    /// Last setpoint of the relay: altitude, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub h_m: Option<f64>,
    /// Last version of the relay's mission; absent without uploads.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Reason why the relay is not in the chain.
    ///
    /// `silent`: the relay is off. `apart`: the relay is on, but not in one view with the chain's relays. `no quorum`:
    /// the relay is on, but too few relays receive each other to form a chain.
    pub why: &'static str,
}

/// SIR of the worst hop in the direction from Rx to Tx.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct WorstBack {
    /// Required ratio of SIRs: hops toward Tx need `reverse` times the SIR that hops toward Rx need.
    pub reverse: f64,
    /// Linear SIR of the worst hop from Rx to Tx.
    pub worst_back: f64,
    /// SIR of the worst hop from Rx to Tx, dB.
    pub worst_back_db: f64,
    /// Linear SIR of the hop from Rx to the last relay.
    pub rx_sir_back: f64,
    /// Linear SIR of the worst hop in both directions. SIRs of hops toward Tx are first divided by `reverse`.
    pub worst_both: f64,
    /// Direction of the worst hop: `forward` (from Tx to Rx), `backward`, or `both` if equal. SIRs from Rx to Tx are
    /// divided by `reverse` before they are compared.
    pub worst_direction: &'static str,
}

impl WorstBack {
    /// Finds the worst hop in each direction. `there` has the linear SIRs of the hops toward Rx, `back` those of the
    /// hops toward Tx.
    ///
    /// `None` if the mission requires no SIR from Rx to Tx, or if there are no hops.
    pub fn of(mission: &Mission, there: &[f64], back: &[f64]) -> Option<Self> {
        let reverse = shortest(mission.config().reverse);
        if reverse > 0.0 {
            Self::with(reverse, there, back)
        } else {
            None
        }
    }

    /// Finds the worst hop in each direction. `there` has the linear SIRs of the hops toward Rx, `back` those of the
    /// hops toward Tx.
    ///
    /// Hops toward Tx need `reverse` times the SIR that hops toward Rx need. `None` if there are no hops.
    pub fn with(reverse: f64, there: &[f64], back: &[f64]) -> Option<Self> {
        let worst = |sirs: &[f64]| sirs.iter().copied().reduce(f64::min);
        let (worst_there, worst_back) = (worst(there)?, worst(back)?);
        let compared = worst_back / reverse;
        Some(Self {
            reverse,
            worst_back,
            worst_back_db: db(worst_back),
            rx_sir_back: back.last().copied()?,
            worst_both: worst_there.min(compared),
            worst_direction: direction(worst_there, compared),
        })
    }
}

/// Relative difference up to which the worst SIR toward Rx and that toward Tx count as equal. The difference is 0.004
/// dB, more than the rounding errors.
const EQUAL: f64 = 1e-3;

/// Returns the name of the direction with the lower SIR: `forward`, `backward`, or `both` if equal. `there` is the
/// SIR toward Rx, `back` the SIR toward Tx divided by `reverse`.
pub const fn direction(there: f64, back: f64) -> &'static str {
    if back < there * (1.0 - EQUAL) {
        "backward"
    } else if there < back * (1.0 - EQUAL) {
        "forward"
    } else {
        "both"
    }
}

/// Returns a result of [`direction`] in words, for text after `limiting direction`.
pub fn direction_words(direction: &str) -> &'static str {
    match direction {
        "forward" => "toward Rx",
        "backward" => "toward Tx",
        _ => "both equally",
    }
}

/// Creates a report of each relay, numbered from 1, with its position and received SIR. `sirs` has the linear SIR at
/// which each relay receives the previous node.
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

/// Formats a table of the chain's relays, lost relays, and Rx. If `room` is true, it has a column for y.
///
/// If `rx_sir_back` is given, the table has columns for the hops toward Tx. The row of a relay then has the SIR at
/// which the previous node, nearer to Tx, receives this relay.
pub fn hops_table(
    relays: &[RelayReport],
    lost: &[LostReport],
    (rx_sir, rx_sir_back): (Option<f64>, Option<f64>),
    room: bool,
) -> String {
    let way_back = |sir: Option<f64>| {
        sir.filter(|_| rx_sir_back.is_some())
            .map_or_else(String::new, |sir| format!(" {sir:>12.6} {:>9.3}", db(sir)))
    };
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
            "{:>6} {:>12}{} {:>10} {:>12} {:>9}{}",
            "relay",
            "x [m]",
            aside(&|| "y [m]".to_owned()),
            "h [m]",
            "SIR received",
            "SIR [dB]",
            rx_sir_back.map_or_else(String::new, |_| format!(
                " {:>12} {:>9}",
                "SIR way back", "back [dB]"
            ))
        );
        let kept = relays.iter().map(|relay| {
            let line = format!(
                "{:>6} {:>12.3}{} {:>10.2} {:>12.6} {:>9.3}{}",
                relay.index,
                relay.x_m,
                aside(&|| format!("{:.3}", relay.y_m)),
                relay.h_m,
                relay.sir,
                relay.sir_db,
                way_back(relay.sir_back)
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
            "{:>6} {:>12}{} {:>10} {:>12.6} {:>9.3}{}",
            "Rx",
            "",
            aside(&String::new),
            "",
            rx_sir,
            db(rx_sir),
            way_back(rx_sir_back)
        );
    }
    text
}

fn lost_line(relay: &LostReport, aside: &str) -> String {
    let place = relay.x_m.zip(relay.h_m).map_or_else(
        || format!("{:>12}{aside} {:>10}", "-", "-"),
        |(x_m, h_m)| format!("{x_m:>12.3}{aside} {h_m:>10.2}"),
    );
    let why = if relay.why == "apart" {
        "not in chain"
    } else {
        relay.why
    };
    format!("{:>6} {place} {why:>12}", relay.index)
}
