//! Report of a plan.

use std::fmt;
use std::fmt::Write as _;

use serde::Serialize;
use uav_relay_scenario::fleet::FleetSize;
use uav_relay_scenario::link::{Access, Radio};
use uav_relay_scenario::{Noise, Scenario};
use uav_relay_sim::report::{
    HopSlots, RelayReport, WorstBack, counted, db, direction_words, hops_table, relays,
};
use uav_relay_terrain::report::TerrainReport;

use super::area::AreaReport;
use super::locating::Locating;
use super::over_terrain::OverTerrain;
use super::rate::{BestRate, Rate, RateOf};
use super::terrain_flight::Flight;
use super::{Number, Plan, Unit, Why};

/// Hypothetical interferer that replaces several, with its error and its effect on the plan.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct HypotheticalReport {
    /// Transmit power of the hypothetical interferer, W.
    pub power_w: f64,
    /// Position of the hypothetical interferer along the line Tx-Rx, m.
    pub x_m: f64,
    /// Lateral position of the hypothetical interferer, m; positive to the right as seen from Tx.
    pub y_m: f64,
    /// Mean absolute error of the interference power, W, compared with the sum of all interferers.
    ///
    /// The mean is over the positions that relays may take.
    pub mean_abs_error_w: f64,
    /// Mean absolute error divided by the mean interference power.
    pub relative_error: f64,
    /// SIR against all interferers at the best positions for the hypothetical interferer, linear.
    ///
    /// Absent if no such positions were found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir: Option<f64>,
    /// True if the plan has the positions for the hypothetical interferer.
    ///
    /// False if it has the best positions found against all interferers.
    pub kept: bool,
    /// Loss of SIR at the positions for the hypothetical interferer, relative to the plan's SIR.
    ///
    /// 0 if the plan has these positions. If the slots are fitted, it is the loss of data rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<f64>,
    /// SIR of the plan divided by the SIR at the positions for the hypothetical interferer, minus 1.
    ///
    /// If the slots are fitted, it is the same ratio of the data rates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain: Option<f64>,
    /// True if the data rate decides which positions are better, because the time slots are fitted.
    #[serde(skip)]
    by_rate: bool,
}

/// Data rates of a planned chain, and of chains with different numbers of relays.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RateReport {
    /// Data rate of the chain, bit/s; absent without a plan.
    ///
    /// A plan for data in both directions also has the rate toward Tx.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_bps: Option<Rate>,
    /// Data rate of the worst hop during its time slot, bit/s.
    ///
    /// A plan for data in both directions also has the rate toward Tx.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hop_rate_bps: Option<Rate>,
    /// Number of time slots that the hops share.
    ///
    /// On one frequency, each hop has a slot for each direction of data. If each hop has its own frequency, there is
    /// one slot for each direction of data, in which all hops send.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slots: Option<u32>,
    /// Time slot of each hop and direction; empty unless `link.access` is `fitted`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hop_slots: Vec<HopSlots>,
    /// Value of the scenario's `link.access`: how the hops share the radio.
    pub access: &'static str,
    /// Bandwidth of one frequency, Hz.
    pub bandwidth_hz: f64,
    /// Requested data rate of the chain, bit/s; absent without a request.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_rate_bps: Option<f64>,
    /// Number of relays with the largest data rate, and that rate.
    #[serde(flatten)]
    pub best: BestRate,
    /// Data rate for each number of relays tried; empty unless the user requests the list.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rates: Vec<RateOf>,
    /// Number of relays in the plan; 0 without a plan.
    #[serde(skip)]
    relays: u16,
    /// Required rate to Tx as a fraction of the rate to Rx; 0 for one direction.
    #[serde(skip)]
    reverse: f64,
    /// Text about how the plan's hops share the radio.
    #[serde(skip)]
    sharing: String,
}

impl RateReport {
    /// Creates the report of the rates of `plan`. `best` is the largest rate, and `rates` are the rates to list.
    ///
    /// Without a plan the report has only `best` and `rates`.
    pub fn new(
        plan: Option<&Plan>,
        (scenario, radio): (&Scenario, &Radio),
        target_rate_bps: Option<f64>,
        best: BestRate,
        rates: Vec<RateOf>,
    ) -> Self {
        let relays = plan.map(|plan| u16::try_from(plan.places.len()).unwrap_or(u16::MAX));
        let relays = relays.unwrap_or(0);
        let is_both = scenario.reverse > 0.0;
        let sharing = radio.sharing(usize::from(relays) + 1);
        let ways = match radio.link.access {
            _ if !is_both => "",
            Access::Fitted => ", both ways",
            Access::Slots | Access::Channels => ", each way half of the time",
        };
        Self {
            rate_bps: plan.map(|plan| Rate::of(plan, scenario, radio)),
            hop_rate_bps: plan.map(|plan| Rate::of_hop(plan, scenario, radio)),
            slots: plan.map(|_| radio.link.access.slots(relays, is_both)),
            hop_slots: plan.map_or_else(Vec::new, |plan| Rate::hop_slots(plan, scenario, radio)),
            sharing: sharing + ways,
            reverse: scenario.reverse,
            access: radio.link.access.name(),
            bandwidth_hz: radio.bandwidth_hz,
            target_rate_bps,
            best,
            rates,
            relays,
        }
    }

    fn describe(&self, text: &mut String) {
        *text += &HopSlots::table(&self.hop_slots);
        if let (Some(rate_bps), Some(hop_bps)) = (self.rate_bps, self.hop_rate_bps) {
            _ = writeln!(
                text,
                "data rate: {}: {}; worst hop while it transmits (without its pauses): {}",
                bps(rate_bps),
                self.sharing,
                bps(hop_bps)
            );
        }
        if let Some(target_bps) = self.target_rate_bps {
            let back = if self.reverse > 0.0 {
                format!(" to Rx and {:.6e} bit/s back", self.reverse * target_bps)
            } else {
                String::new()
            };
            _ = writeln!(
                text,
                "target: {target_bps:.6e} bit/s{back}; fewer relays do not carry it"
            );
        }
        let mut before = None;
        for RateOf { uavs, rate_bps } in &self.rates {
            // With rate steps many numbers of relays have the same rate. The first is listed.
            if before != Some(*rate_bps) {
                let (relays, verb) = relays_carry(*uavs);
                _ = writeln!(text, "{uavs:5} {relays} {verb} {}", bps(*rate_bps));
            }
            before = Some(*rate_bps);
        }
        _ = writeln!(text, "{}", self.largest());
    }

    /// Returns the sentence about the largest data rate and its number of relays.
    pub fn largest(&self) -> String {
        let BestRate {
            best_uavs,
            best_rate_bps,
            tried_uavs,
            best_is_proven,
        } = self.best;
        if !(best_rate_bps > 0.0) {
            let any = if best_is_proven {
                "any number of".to_owned()
            } else {
                format!("1 to {tried_uavs}")
            };
            return format!(
                "largest data rate: 0 bit/s: the SINR of the worst hop with {any} relays is below the lowest SINR in link.steps"
            );
        }
        let (relays, verb) = relays_carry(best_uavs);
        let other = self.relays;
        let fewer = if best_uavs < other {
            let do_so = if other == 1 { "does" } else { "do" };
            format!(", more than {} {do_so}", counted(other.into()))
        } else {
            String::new()
        };
        let among = if best_is_proven {
            "; no other number of relays carries a larger rate".to_owned()
        } else {
            format!(", of 1 to {tried_uavs} relays")
        };
        let counted = if self.reverse > 0.0 {
            format!(
                " to Rx, and at least {:?} times this rate back (link.reverse)",
                self.reverse
            )
        } else {
            String::new()
        };
        format!(
            "largest data rate: {best_uavs} {relays} {verb} {best_rate_bps:.6e} bit/s{counted}{fewer}{among}"
        )
    }
}

/// Formats a data rate in bit/s, or the rates to Rx and back.
fn bps(rate: Rate) -> String {
    match rate {
        Rate::There(rate_bps) => format!("{rate_bps:.6e} bit/s"),
        Rate::Both([there_bps, back_bps]) => {
            format!("{there_bps:.6e} bit/s to Rx and {back_bps:.6e} bit/s back")
        }
    }
}

const fn relays_carry(number: u16) -> (&'static str, &'static str) {
    if number == 1 {
        ("relay", "carries")
    } else {
        ("relays", "carry")
    }
}

/// SIRs of the hops in the direction from Rx to Tx.
///
/// `reverse`, `worst_both` and `worst_direction` are present if the relays are placed for data in both directions.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct WayBack {
    /// SIR of the hop from Rx to the last relay, linear.
    pub rx_sir_back: f64,
    /// SIR of the worst hop in the direction from Rx to Tx, linear.
    pub worst_back: f64,
    /// SIR of the worst hop in the direction from Rx to Tx, dB.
    pub worst_back_db: f64,
    /// Required SIR toward Tx, as a fraction of the SIR toward Rx; absent for data toward Rx only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reverse: Option<f64>,
    /// SIR of the worst hop toward Rx or Tx, linear; SIRs toward Tx are first divided by `reverse`.
    ///
    /// Absent in a plan for data toward Rx only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_both: Option<f64>,
    /// Direction of the worst hop: `forward` (from Tx to Rx), `backward`, or `both` if they are equal.
    ///
    /// SIRs toward Tx are first divided by `reverse`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_direction: Option<&'static str>,
    /// Receiver of the worst hop for data from Rx to Tx: 0 for Tx, otherwise the relay's index.
    #[serde(skip)]
    hop: usize,
    #[serde(skip)]
    relays: u16,
}

impl WayBack {
    fn describe(&self, unit: Unit) -> String {
        let receiver = match self.hop {
            0 => "Tx".to_owned(),
            relay => format!("relay {relay}"),
        };
        let sender = if self.hop == usize::from(self.relays) {
            "Rx".to_owned()
        } else {
            format!("relay {}", self.hop + 1)
        };
        let needed = self.reverse.map_or_else(String::new, |reverse| {
            format!(
                "; required: {reverse:?} times the SIR toward Rx (link.reverse); limiting direction: {}",
                self.worst_direction.map_or("unknown", direction_words)
            )
        });
        format!(
            "way back: worst hop {}, from {sender} to {receiver}{needed}",
            unit.both(self.worst_back)
        )
    }
}

/// Text at the end of each plan: effects that the model leaves out.
const NOT_MODELLED: &str = "not modelled: terrain and obstacles";

/// Text at the end of a plan with terrain: effects that the model leaves out.
const NOT_IN_TERRAIN: &str =
    "not modelled: buildings and trees, and terrain in front of the interferers";

/// Text at the end of a plan for data toward Rx only.
const ONE_WAY: &str = "; not optimised: the way back from Rx to Tx";

/// Fleet with more relays than the planned chain.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct FleetReport {
    /// Number of relays of the fleet.
    pub relays: u16,
    /// Number of relays that are meant to fly.
    pub flying: u16,
    /// Numbers of the relays that wait as spares at the start.
    pub spares: Vec<u16>,
}

impl FleetReport {
    /// Creates the report for a plan of `planned` relays.
    ///
    /// `None` without spares, or if the chain has another number of relays.
    pub fn new(size: Option<FleetSize>, planned: u16) -> Option<Self> {
        let FleetSize { relays, flying } =
            size.filter(|it| it.flying == planned && it.flying < it.relays)?;
        Some(Self {
            relays,
            flying,
            spares: size?.spares(),
        })
    }

    /// Returns the numbers of the spares as text.
    pub fn list(&self) -> String {
        let numbers: Vec<String> = self.spares.iter().map(u16::to_string).collect();
        numbers.join(", ")
    }
}

/// Report of `cargo plan`, printed as a table or as JSON.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct PlanReport {
    /// Number of relays in the plan; absent if no number meets the target.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uavs: Option<u16>,
    /// Error message for the user; absent if there is a plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Best SIR found for the worst hop, linear; present only if the request cannot be met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best_sir: Option<f64>,
    /// Best SIR found for the worst hop, dB.
    ///
    /// Present only if the request cannot be met and the SIR is above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best_sir_db: Option<f64>,
    /// SIR of the plan's worst hop, linear.
    ///
    /// In a plan for data in both directions, hops toward Rx and hops toward Tx count. An SIR toward Tx is first
    /// divided by its required fraction of the SIR toward Rx.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir: Option<f64>,
    /// SIR of the plan's worst hop, dB.
    ///
    /// In a plan for data in both directions, hops toward Rx and hops toward Tx count. An SIR toward Tx is first
    /// divided by its required fraction of the SIR toward Rx.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir_db: Option<f64>,
    /// SIRs in the direction from Rx to Tx; absent if the interference at Tx is unknown.
    #[serde(flatten)]
    pub way_back: Option<WayBack>,
    /// Data rates over the data link; absent without a bandwidth.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub rates: Option<RateReport>,
    /// Requested SIR of every hop, linear; absent if the request is a number of relays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_sir: Option<f64>,
    /// Requested SIR of every hop, dB; absent if the request is a number of relays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_sir_db: Option<f64>,
    /// Best SIR that the plan's number of relays can have, linear; only for a requested SIR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_sir: Option<f64>,
    /// Best SIR that the plan's number of relays can have, dB; only for a requested SIR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_sir_db: Option<f64>,
    /// Name of the algorithm that found the relays' positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub how: Option<&'static str>,
    /// True if it is proven that no positions are better.
    ///
    /// For a requested SIR: that no fewer relays suffice. False if this is unknown. Absent if there is no plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proven: Option<bool>,
    /// Number of the theorem that placed the only relay, 1 to 3 as in the paper.
    ///
    /// 4 is one relay with a lateral offset, and 5 one relay for data in both directions. Neither is in the paper.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theorem: Option<u8>,
    /// Case number of the theorem in the paper; 0 for a case that the paper omits.
    ///
    /// For Theorem 3 it is the edge of the allowed positions: 1 lowest, 2 highest, 3 above Rx. For one relay with a
    /// lateral offset: 1 where the circles of equal SIR touch, 2 the maximum of the first hop's SIR, 3 above Rx, 4 to 6
    /// an edge of the allowed positions along x, along y or upward, 7 interferer at Tx, 8 interferer at Rx. For one
    /// relay and both directions: 1 above Tx, 2 above Rx, 3 where two SIRs are equal, 4 the maximum of one SIR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub case: Option<u8>,
    /// Explanation of the theorem's case for the user: why the relay goes to its position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub case_words: Option<String>,
    /// Reports of the relays, in order from Tx.
    pub relays: Vec<RelayReport>,
    /// SIR of the hop from the last relay to Rx, linear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rx_sir: Option<f64>,
    /// SIR of the hop from the last relay to Rx, dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rx_sir_db: Option<f64>,
    /// Receiver noise, if it is computed from a bandwidth and a noise figure; otherwise absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseReport>,
    /// Hypothetical interferer that replaces several; absent unless there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hypothetical: Option<HypotheticalReport>,
    /// Terrain below the chain; absent without elevation files.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub terrain: Option<TerrainReport>,
    /// Comparison with positions that ignore the terrain; absent if the plan ignores it, too.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub over_terrain: Option<OverTerrain>,
    /// Flight over the terrain, and the chain after the loss of each relay; absent without elevation files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flight: Option<Flight>,
    /// Reason why the flight over the terrain was not simulated; absent if it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flight_not_simulated: Option<String>,
    /// Fleet of the scenario; absent without spares, and if the chain has another number of relays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fleet: Option<FleetReport>,
    /// SIRs over the areas of the interferers; absent if none has an area.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<AreaReport>,
    /// Report on how well relays locate the interferer in its area.
    ///
    /// Absent without the scenario's section `[listen]`, with which relays estimate an interferer from measurements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub locating: Option<Locating>,
    /// True if relays may have a lateral position. The table then has a column for y.
    #[serde(skip)]
    pub room: bool,
    /// Unit of SIRs in the table, as in the user's request.
    #[serde(skip)]
    pub unit: Unit,
}

impl PlanReport {
    /// Creates the report of `plan`. `number` is the request, and `unit` the unit of SIRs in the table.
    pub fn new(plan: &Plan, number: Number, unit: Unit) -> Self {
        let sir = plan.sir();
        let rx_sir = plan.sirs.last().copied();
        let target_sir = match number {
            Number::Of(_) => None,
            Number::Meeting(target) => Some(target),
        };
        let hypothetical = plan.fitted.as_ref().map(|fitted| {
            let one = &fitted.hypothetical;
            HypotheticalReport {
                power_w: one.power_w,
                x_m: one.x_m,
                y_m: one.y_m,
                mean_abs_error_w: one.mean_abs_error_w,
                relative_error: one.relative_error,
                sir: fitted.sir,
                kept: fitted.kept,
                loss: fitted.loss,
                gain: fitted
                    .loss
                    .filter(|loss| *loss < 1.0)
                    .map(|loss| 1.0 / (1.0 - loss) - 1.0),
                by_rate: fitted.by_rate,
            }
        });
        Self {
            uavs: u16::try_from(plan.places.len()).ok(),
            error: None,
            best_sir: None,
            best_sir_db: None,
            sir: Some(sir),
            sir_db: Some(db(sir)),
            rates: None,
            way_back: None,
            target_sir,
            target_sir_db: target_sir.map(db),
            most_sir: plan.most,
            most_sir_db: plan.most.map(db),
            how: Some(plan.how),
            proven: Some(plan.proven),
            theorem: plan.theorem.as_ref().map(|theorem| theorem.number),
            case: plan.theorem.as_ref().map(|theorem| theorem.case),
            case_words: plan.theorem.as_ref().map(|theorem| theorem.words.clone()),
            relays: relays(&plan.places, &plan.sirs),
            rx_sir,
            rx_sir_db: rx_sir.map(db),
            noise: None,
            hypothetical,
            terrain: None,
            over_terrain: None,
            flight: None,
            flight_not_simulated: None,
            area: None,
            fleet: None,
            locating: None,
            room: !plan.mission.config().lateral.is_single(),
            unit,
        }
    }

    /// Creates the report of a request that cannot be met, with the reason and the best SIR (linear).
    pub fn unmet(why: &Why, best_sir: Option<f64>, number: Number, unit: Unit) -> Self {
        let (uavs, target_sir) = match number {
            Number::Of(relays) => (Some(relays), None),
            Number::Meeting(target) => (None, Some(target)),
        };
        Self {
            uavs,
            error: Some(why.say(unit)),
            best_sir,
            best_sir_db: best_sir.filter(|best| *best > 0.0).map(db),
            target_sir,
            target_sir_db: target_sir.map(db),
            unit,
            ..Self::default()
        }
    }

    /// Adds the SIRs of the hops from Rx to Tx, if the interference at Tx is known.
    #[must_use]
    pub fn with_way_back(mut self, scenario: &Scenario, plan: &Plan) -> Self {
        let relays = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
        let sirs = plan.sirs_back(scenario);
        for (relay, sir) in self.relays.iter_mut().zip(&sirs) {
            // Relays at the same position have an infinite SIR, which JSON cannot express.
            relay.sir_back = Some(sir.min(f64::from(f32::MAX)));
        }
        let worst = sirs
            .iter()
            .copied()
            .enumerate()
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let both = Some(scenario.reverse)
            .filter(|reverse| *reverse > 0.0)
            .and_then(|reverse| WorstBack::with(reverse, &plan.sirs, &sirs));
        self.way_back = worst.zip(sirs.last()).map(|((hop, sir), rx_sir)| WayBack {
            rx_sir_back: *rx_sir,
            worst_back: sir,
            worst_back_db: db(sir),
            reverse: both.map(|both| both.reverse),
            worst_both: both.map(|both| both.worst_both),
            worst_direction: both.map(|both| both.worst_direction),
            hop,
            relays,
        });
        self
    }

    /// Adds the data rates to the report, if there are any.
    #[must_use]
    pub fn with_rates(self, rates: Option<RateReport>) -> Self {
        Self { rates, ..self }
    }

    /// Adds the scenario's receiver noise to the report.
    #[must_use]
    pub fn in_noise(self, noise: &Noise) -> Self {
        Self {
            noise: NoiseReport::of(noise),
            ..self
        }
    }

    /// Adds the terrain below the chain, if it is known.
    ///
    /// `error` states why the plan cannot be flown.
    #[must_use]
    pub fn above(self, terrain: Option<TerrainReport>, error: Option<String>) -> Self {
        Self {
            error,
            terrain,
            ..self
        }
    }

    /// Returns the report as a table for the terminal.
    pub fn table(&self) -> String {
        let rx_sir_back = self
            .way_back
            .and_then(|back| back.reverse.map(|_| back.rx_sir_back));
        let rx = (self.rx_sir, rx_sir_back);
        let mut text = hops_table(&self.relays, &[], rx, self.room);
        let (Some(uavs), Some(sir)) = (self.uavs, self.sir) else {
            return text;
        };
        let relays = if uavs == 1 { "relay" } else { "relays" };
        let unit = self.unit;
        _ = write!(text, "worst hop: {}", unit.both(sir));
        _ = writeln!(
            text,
            " with {uavs} {relays}, by {}",
            self.how.unwrap_or("nothing")
        );
        if let Some(fleet) = &self.fleet {
            let FleetReport { relays, flying, .. } = fleet;
            _ = writeln!(
                text,
                "fleet: {relays} relays, {flying} are meant to fly, {} in reserve; spares at the start: {}",
                fleet.spares.len(),
                fleet.list()
            );
        }
        if let (Some(case), Some(words)) = (self.case, &self.case_words) {
            let theorem = self.how.unwrap_or_default();
            _ = writeln!(text, "{words} ({theorem}, case {case})");
        }
        if let Some(way_back) = &self.way_back {
            _ = writeln!(text, "{}", way_back.describe(unit));
        }
        if let Some(rates) = &self.rates {
            rates.describe(&mut text);
        }
        if let (Some(target), Some(most)) = (self.target_sir, self.most_sir) {
            let target = unit.asked(target);
            let most = unit.say(most);
            _ = writeln!(
                text,
                "target: SIR {target}; the highest SIR of this number of relays is {most} (--uavs {uavs})"
            );
        }
        if let Some(area) = &self.area {
            text.push_str(&area.describe());
        }
        if let Some(locating) = &self.locating {
            text.push_str(&locating.to_string());
        }
        let is_for_both = self.way_back.is_some_and(|back| back.reverse.is_some());
        let one_way = if is_for_both { "" } else { ONE_WAY };
        if let Some(terrain) = &self.terrain {
            text.push_str(&terrain.table());
        }
        if let Some(over) = &self.over_terrain {
            _ = writeln!(text, "{over}");
        }
        if let Some(flight) = &self.flight {
            _ = writeln!(text, "{flight}");
        } else if let Some(why) = &self.flight_not_simulated {
            _ = writeln!(text, "flight over the terrain not simulated: {why}");
        }
        let not_modelled = self
            .terrain
            .as_ref()
            .map_or(NOT_MODELLED, |_| NOT_IN_TERRAIN);
        _ = writeln!(text, "{}; {not_modelled}{one_way}", self.certainty());
        if let Some(noise) = &self.noise {
            _ = writeln!(text, "{noise}");
        }
        if let Some(one) = &self.hypothetical {
            one.describe(&mut text, unit);
        }
        text
    }

    fn certainty(&self) -> &'static str {
        match (self.proven, self.target_sir) {
            (Some(true), Some(_)) => "proven for this model: fewer relays do not meet the target",
            (Some(true), None) => "proven for this model: no positions are better",
            (_, Some(_)) => "not proven: in this model fewer relays might meet the target, too",
            (_, None) => "not proven: in this model other positions might be better",
        }
    }
}

impl HypotheticalReport {
    fn describe(&self, text: &mut String, unit: Unit) {
        _ = writeln!(
            text,
            "hypothetical interferer: {:.6} W at x = {:.3} m, y = {:.3} m; its interference differs from that of all interferers by {:.3} % or {:.3e} W on average",
            self.power_w,
            self.x_m,
            self.y_m,
            100.0 * self.relative_error,
            self.mean_abs_error_w
        );
        let gain = self.gain.map_or_else(String::new, |gain| {
            let of = if self.by_rate { " in data rate" } else { "" };
            format!(", a gain of {:.2} %{of}", 100.0 * gain)
        });
        let listen = if self.by_rate {
            ""
        } else {
            "; with `cargo chain --listen` the relays estimate the interferer themselves"
        };
        _ = match (self.kept, self.sir) {
            (true, _) => writeln!(
                text,
                "the positions for the hypothetical interferer are good enough against all interferers, and are kept"
            ),
            (false, Some(sir)) => writeln!(
                text,
                "the positions for the hypothetical interferer are not good enough: {} against all interferers. Shown are the best positions found against all{gain}. Relays would fly those for the hypothetical interferer, so `cargo provision` refuses this scenario{listen}",
                unit.both(sir)
            ),
            (false, None) => writeln!(
                text,
                "no positions are good against the hypothetical interferer; shown are the best positions found against all interferers"
            ),
        };
    }
}

/// Receiver noise k T0 B F: Boltzmann constant, temperature, bandwidth and noise figure.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct NoiseReport {
    /// Noise power at the input of every receiver, W.
    pub power_w: f64,
    /// Noise power at the input of every receiver, dBm.
    pub power_dbm: f64,
    /// Bandwidth B of the receivers, Hz.
    pub bandwidth_hz: f64,
    /// Noise figure F of the receivers, dB.
    pub figure_db: f64,
    /// Reference temperature T0 of the noise, K.
    pub temperature_k: f64,
    /// Noise power divided by the receive antenna gain, W, as the SIRs use it.
    ///
    /// If the antenna gains differ, the lower gain is used.
    pub effective_w: f64,
}

impl NoiseReport {
    /// Returns the noise of a scenario with its parameters.
    ///
    /// `None` if there is no noise, or if the scenario gives the noise power itself.
    pub fn of(noise: &Noise) -> Option<Self> {
        let power_w = noise.receiver_w();
        let is_made = noise.power_dbm.is_none() && power_w > 0.0;
        is_made.then(|| Self {
            power_w,
            power_dbm: 10.0 * (1e3 * power_w).log10(),
            bandwidth_hz: noise.bandwidth_hz,
            figure_db: noise.figure_db,
            temperature_k: Noise::STANDARD_K,
            effective_w: noise.power_w(),
        })
    }
}

impl fmt::Display for NoiseReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            power_w,
            power_dbm,
            bandwidth_hz,
            figure_db,
            temperature_k,
            effective_w,
        } = *self;
        write!(
            f,
            "noise: {power_dbm:.3} dBm, {power_w:.6e} W, at every receiver: k T0 B F with T0 = {temperature_k} K, B = {bandwidth_hz} Hz, F = {figure_db} dB"
        )?;
        if effective_w.total_cmp(&power_w).is_ne() {
            write!(
                f,
                "; divided by the antenna gain of the receivers (the lowest, if they differ) it is {effective_w:.6e} W"
            )?;
        }
        Ok(())
    }
}
