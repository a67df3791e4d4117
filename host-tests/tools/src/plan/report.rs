//! The report of a plan.

use std::fmt::{self, Write as _};

use serde::Serialize;

use uav_relay_scenario::Noise;
use uav_relay_sim::report::{RelayReport, db, hops_table, relays};

use super::ask::Number;
use super::found::{Plan, Why};
use super::noise::NoiseReport;
use super::rate::{self, BestRate};
use super::unit::Unit;

/// The one interferer that stands for several.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct HypotheticalReport {
    /// Its transmit power, W.
    pub power_w: f64,
    /// Its place along x, m.
    pub x_m: f64,
    /// Its distance from that line, m: to its right above 0.
    pub y_m: f64,
    /// How far the interference that a relay receives from it is from that of all, on average over where relays may be, W.
    pub mean_abs_error_w: f64,
    /// The same as a part of the average interference of all.
    pub relative_error: f64,
    /// SIR against all of the places that are best against it alone, linear; absent where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir: Option<f64>,
    /// Whether these places are the plan's. If not, the plan's are the best that were found against all.
    pub kept: bool,
    /// What these places lose to the plan's, as a part of its SIR: 0 for nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<f64>,
    /// By how much the plan's SIR is above theirs, as a part of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain: Option<f64>,
}

/// The data rates of a chain whose hops share one frequency in time slots of equal length.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct RateReport {
    /// The data rate of the chain, bit/s: that of the worst hop over the number of slots. Absent where there is no plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_bps: Option<f64>,
    /// The data rate of the worst hop while it sends, bit/s: bandwidth x log2(1 + SIR).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hop_rate_bps: Option<f64>,
    /// Number of time slots: one for each hop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slots: Option<u32>,
    /// The target, bit/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_rate_bps: Option<f64>,
    /// The number of relays that carries most.
    #[serde(flatten)]
    pub best: BestRate,
}

impl RateReport {
    /// The rates of `plan` over `bandwidth_hz`; without a plan only the largest.
    pub fn new(
        plan: Option<&Plan>,
        bandwidth_hz: f64,
        target_rate_bps: Option<f64>,
        best: BestRate,
    ) -> Self {
        let relays = |plan: &Plan| u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
        Self {
            rate_bps: plan.map(|plan| rate::chain_bps(bandwidth_hz, relays(plan), plan.sir())),
            hop_rate_bps: plan.map(|plan| rate::hop_bps(bandwidth_hz, plan.sir())),
            slots: plan.map(|plan| rate::slots(relays(plan))),
            target_rate_bps,
            best,
        }
    }

    fn describe(&self, text: &mut String) {
        if let (Some(rate_bps), Some(hop_bps), Some(slots)) =
            (self.rate_bps, self.hop_rate_bps, self.slots)
        {
            _ = writeln!(
                text,
                "data rate: {rate_bps:.6e} bit/s: {slots} hops share one frequency in {slots} equal time slots, and the worst hop carries \
                 {hop_bps:.6e} bit/s while it sends"
            );
        }
        if let Some(target_bps) = self.target_rate_bps {
            _ = writeln!(
                text,
                "target: {target_bps:.6e} bit/s; no fewer relays carry it"
            );
        }
        _ = writeln!(text, "{}", self.best);
    }
}

impl fmt::Display for BestRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            best_uavs,
            best_rate_bps,
            tried_uavs,
            best_is_proven,
        } = self;
        let (relays, verb) = if *best_uavs == 1 {
            ("relay", "carries")
        } else {
            ("relays", "carry")
        };
        write!(
            f,
            "largest data rate: {best_uavs} {relays} {verb} {best_rate_bps:.6e} bit/s"
        )?;
        if *best_is_proven {
            f.write_str("; no other number carries more")
        } else {
            write!(f, ", of 1 to {tried_uavs} relays")
        }
    }
}

/// What the model leaves out.
const NOT_MODELLED: &str = "not modelled: terrain and obstacles, and the link from Rx back to Tx";

/// The result of `cargo plan`.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct PlanReport {
    /// Number of relays; absent where no number meets the target.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uavs: Option<u16>,
    /// What went wrong, if anything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The most that was found, linear SIR, where what was asked for cannot be had.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best_sir: Option<f64>,
    /// The same in dB, where it is above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best_sir_db: Option<f64>,
    /// SIR of the worst hop, linear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir: Option<f64>,
    /// The same in dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir_db: Option<f64>,
    /// The data rates over the bandwidth that was given.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub rates: Option<RateReport>,
    /// The target, linear SIR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_sir: Option<f64>,
    /// The same in dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_sir_db: Option<f64>,
    /// With a target: the most that so many relays can have, linear SIR.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_sir: Option<f64>,
    /// The same in dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_sir_db: Option<f64>,
    /// How the places were found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub how: Option<&'static str>,
    /// Whether no places are better, and no fewer relays enough. False means that it is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proven: Option<bool>,
    /// The theorem that placed the only relay, 1 to 3; 4 for one relay aside.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theorem: Option<u8>,
    /// Its case as the paper counts them; 0 for one that the paper leaves out. For Theorem 3 the edge of the box: 1 lowest, 2
    /// highest, 3 above Rx. For one relay aside: 1 where the circles of equal SIR touch, 2 on the hill of the first hop, 3 above
    /// Rx, 4 to 6 on an edge of the corridor along x, along y or upward, 7 and 8 with the interferer at Tx or Rx.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub case: Option<u8>,
    /// What the case means for the drone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub case_words: Option<String>,
    /// The relays, from the transmitter on.
    pub relays: Vec<RelayReport>,
    /// SIR at the receiver, linear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rx_sir: Option<f64>,
    /// The same in dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rx_sir_db: Option<f64>,
    /// The noise that a bandwidth and a noise figure make.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseReport>,
    /// For several interferers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hypothetical: Option<HypotheticalReport>,
    /// Whether there is room beside the line: the table then says where in it a relay is.
    #[serde(skip)]
    pub room: bool,
    /// The unit that SIRs were asked for in.
    #[serde(skip)]
    pub unit: Unit,
}

impl PlanReport {
    /// The report of a plan for `number` relays.
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
                loss: fitted.sir.map(|by_one| (1.0 - by_one / sir).max(0.0)),
                gain: fitted
                    .sir
                    .filter(|by_one| *by_one > 0.0)
                    .map(|by_one| sir / by_one - 1.0),
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
            room: !plan.mission.config().lateral.is_single(),
            unit,
        }
    }

    /// The report of what could not be had: why, and the most that was found (linear SIR).
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

    /// The same, with data rates.
    #[must_use]
    pub fn with_rates(self, rates: Option<RateReport>) -> Self {
        Self { rates, ..self }
    }

    /// The same, of a scenario with that noise.
    #[must_use]
    pub fn in_noise(self, noise: &Noise) -> Self {
        Self {
            noise: NoiseReport::of(noise),
            ..self
        }
    }

    /// The report as a table to read.
    pub fn table(&self) -> String {
        let mut text = hops_table(&self.relays, &[], self.rx_sir, self.room);
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
        if let (Some(case), Some(words)) = (self.case, &self.case_words) {
            let theorem = self.how.unwrap_or_default();
            _ = writeln!(text, "{words} ({theorem}, case {case})");
        }
        if let Some(rates) = &self.rates {
            rates.describe(&mut text);
        }
        if let (Some(target), Some(most)) = (self.target_sir, self.most_sir) {
            let target = unit.asked(target);
            let most = unit.say(most);
            _ = writeln!(
                text,
                "target: SIR {target}; so many relays can have up to {most} (--uavs {uavs})"
            );
        }
        _ = writeln!(text, "{}; {NOT_MODELLED}", self.certainty());
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
            (Some(true), Some(_)) => "in this model no fewer relays meet the target",
            (Some(true), None) => "in this model no places are better",
            (_, Some(_)) => {
                "in this model whether fewer relays could meet the target is not certain"
            }
            (_, None) => "in this model whether other places could be better is not certain",
        }
    }
}

impl HypotheticalReport {
    fn describe(&self, text: &mut String, unit: Unit) {
        _ = writeln!(
            text,
            "hypothetical interferer: {:.6} W at x = {:.3} m, y = {:.3} m; it is off by {:.3} % of the interference, {:.3e} W on average",
            self.power_w,
            self.x_m,
            self.y_m,
            100.0 * self.relative_error,
            self.mean_abs_error_w
        );
        let gain = self.gain.map_or_else(String::new, |gain| {
            format!(", a gain of {:.2} %", 100.0 * gain)
        });
        _ = match (self.kept, self.sir) {
            (true, _) => writeln!(
                text,
                "its places are good enough against all interferers, and kept"
            ),
            (false, Some(sir)) => writeln!(
                text,
                "its places are not good enough: {} against all interferers; these are the best found against all{gain}. Relays by \
                 themselves fly the first: `cargo provision` refuses them, and `cargo chain --listen` has relays find their own",
                unit.both(sir)
            ),
            (false, None) => writeln!(
                text,
                "no places are good against it; these are the best found against all"
            ),
        };
    }
}
