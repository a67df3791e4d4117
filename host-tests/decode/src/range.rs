//! Checks of the values in a body: ranges in the tables, and rules between fields.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    reason = "numbers are rounded to f32 and compared exactly, as the format says"
)]

use crate::format::{Field, Layout};
use crate::value::{Fields, Value};

/// Returns the name of the first field that is out of range or breaks a rule; `None` if all are right.
pub fn outside<'f>(layout: &'f Layout, fields: &Fields<'f>) -> Option<&'f str> {
    let alone = fields.0.iter();
    let mut alone = alone.filter(|(field, value)| !is_within(field, value));
    let wrong = alone.next().map(|(field, _)| field.name.as_str());
    wrong.or_else(|| check_rules(&layout.name, &Numbers(fields)))
}

/// Returns true if the value is in the field's range in `FORMAT.md`.
///
/// Rules between several fields, which may follow the range after a semicolon, are not checked here.
fn is_within(field: &Field, value: &Value<'_>) -> bool {
    let all = |values: &[Value<'_>]| values.iter().all(|value| is_within(field, value));
    match value {
        Value::None | Value::Bool(_) | Value::Digest(_) => true,
        Value::List(values) => all(values),
        Value::Group(fields) => fields
            .0
            .iter()
            .all(|(field, value)| is_within(field, value)),
        Value::Single(number) if !number.is_finite() => false,
        Value::Double(number) if !number.is_finite() => false,
        Value::View(view) => is_view(&field.range, *view),
        Value::Single(number) => {
            // The bounds are rounded to f32; 0 may be permitted in addition to the range.
            let (zero, least, most) = bounds(&field.range);
            let between = (least as f32..=most as f32).contains(number);
            between || zero && number.to_bits() == 0
        }
        Value::Double(number) => is_between(&field.range, *number),
        Value::Unsigned(number) => is_between(&field.range, *number as f64),
        Value::Signed(number) => is_between(&field.range, *number as f64),
        Value::Flags(bits, _) => is_between(&field.range, (*bits).into()),
        Value::Word(word, _) => is_between(&field.range, (*word).into()),
    }
}

fn is_between(range: &str, number: f64) -> bool {
    let (zero, least, most) = bounds(range);
    (least..=most).contains(&number) || zero && number == 0.0
}

/// Parses a range such as `0.1 to 1e5`, `1 or more`, `0 or 2 to 255` or `any`.
///
/// Returns a flag and the two bounds. The flag is true if 0 is permitted in addition to the range.
pub fn bounds(range: &str) -> (bool, f64, f64) {
    let first = range.split(';').next().unwrap_or_default();
    let (zero, rest) = ["`00000000` or ", "0 or "]
        .iter()
        .filter(|_| first != "0 or more")
        .find_map(|zero| first.strip_prefix(zero))
        .map_or((false, first), |rest| (true, rest));
    if let Some(least) = rest.strip_suffix(" or more") {
        return (zero, least.parse().unwrap_or(f64::NAN), f64::MAX);
    }
    match rest.split_once(" to ") {
        Some((least, most)) => {
            let number = |text: &str| text.parse().unwrap_or(f64::NAN);
            (zero, number(least), number(most))
        }
        None if rest == "any" => (zero, f64::MIN, f64::MAX),
        // If a range cannot be parsed, no value is permitted, so that a test finds the range.
        None => (false, f64::NAN, f64::NAN),
    }
}

fn is_view(range: &str, view: u32) -> bool {
    let first = range.split(';').next().unwrap_or_default();
    let proposed = view >> 10 >= 1 && (1..=1000).contains(&(view & 0x3FF));
    match first {
        "any" => true,
        "a proposed view" => proposed,
        "0 or a proposed view" => view == 0 || proposed,
        _ => false,
    }
}

/// Access to the numbers of a body by field name; NaN for a field that the body lacks.
pub(crate) struct Numbers<'a, 'f>(pub(crate) &'a Fields<'f>);

impl<'f> Numbers<'_, 'f> {
    pub(crate) fn get(&self, name: &str) -> f64 {
        match self.0.get(name) {
            Some(Value::Single(number)) => (*number).into(),
            Some(Value::Double(number)) => *number,
            Some(Value::Unsigned(number)) => *number as f64,
            Some(Value::Word(number, _)) => (*number).into(),
            Some(Value::View(number)) => (*number).into(),
            _ => f64::NAN,
        }
    }

    /// Returns true if the number of the field `name` is exactly 0; false for -0.0.
    fn is_zero(&self, name: &str) -> bool {
        let number = self.get(name);
        number == 0.0 && number.is_sign_positive()
    }

    fn list(&self, name: &str) -> &[Value<'f>] {
        match self.0.get(name) {
            Some(Value::List(values)) => values,
            _ => &[],
        }
    }

    fn group(&self, name: &str) -> Option<Numbers<'_, 'f>> {
        match self.0.get(name) {
            Some(Value::Group(fields)) => Some(Numbers(fields)),
            _ => None,
        }
    }
}

/// Checks the rules between fields; returns the name of the first field that breaks a rule.
fn check_rules(message: &str, numbers: &Numbers<'_, '_>) -> Option<&'static str> {
    let get = |name| numbers.get(name);
    let zero = |name| numbers.is_zero(name);
    let rules: &[(&'static str, bool)] = match message {
        "Sweep" | "Measured" | "Aside" => {
            let (gap, growth) = (get("gap") as u8, get("growth") as u8);
            let targets = targets((get("anchor") as f32).abs(), gap, growth);
            let normal = targets.iter().all(|target| target.is_normal());
            &[
                ("growth", gap > 0 || growth == 0),
                ("anchor", normal),
                ("reach_m", numbers.list("reach_m").len() <= targets.len()),
            ]
        }
        "Gather" | "Gathered" => {
            let seats = numbers.list("seats").iter();
            let relays = seats.filter_map(|seat| match seat {
                Value::Group(seat) => Some(Numbers(seat).get("relay")),
                _ => None,
            });
            let order: Vec<f64> = [get("after")].into_iter().chain(relays).collect();
            &[("seats", order.is_sorted_by(|a, b| a < b))]
        }
        "Token" => {
            let moves = get("turn") == 2.0;
            &[
                ("explore_m", moves || zero("explore_m")),
                ("columns", moves || zero("columns")),
                ("rows", zero("rows") == zero("columns")),
            ]
        }
        "Proposal" => {
            let view = get("proposed_view");
            let decided = |of: Numbers<'_, '_>| {
                of.get("proposal") < view && of.get("view") <= of.get("proposal")
            };
            let successor = numbers.group("successor").is_none_or(decided);
            &[
                ("agreed_view", get("agreed_view") < view),
                ("votes", get("votes") <= get("agreed_relays")),
                ("successor", successor),
            ]
        }
        "Decision" => {
            let (view, accepted) = (get("proposed_view"), numbers.group("accepted"));
            let is_known = accepted.is_none_or(|of| of.get("view") <= view);
            &[
                ("base_view", get("base_view") < view),
                ("accepted", is_known),
            ]
        }
        "Sense" | "Sensed" => {
            let source = [
                "source_power_w",
                "source_x_m",
                "source_y_m",
                "source_at_rx_w",
            ];
            let is_source = get("estimate") == 4.0;
            let first = numbers.list("sum_ab").first();
            &[
                (
                    "estimate",
                    if is_source {
                        get("source_power_w") > 0.0
                    } else {
                        source.iter().all(|name| zero(name))
                    },
                ),
                (
                    "sum_ab",
                    matches!(first, Some(Value::Single(sum)) if *sum >= 0.0),
                ),
            ]
        }
        "Offer" => {
            let unknown = zero("interferer_power_w");
            let ratio = get("noise_w") * get("eta") / get("interferer_power_w");
            let band = get("altitude_min_m")..=get("altitude_max_m");
            let mu_los = get("mu_los");
            &[
                ("altitude_m", band.contains(&get("altitude_m"))),
                ("altitude_max_m", !band.is_empty()),
                (
                    "interferer_power_w",
                    !unknown || zero("interferer_x_m") && zero("interferer_y_m"),
                ),
                ("noise_w", unknown || ratio <= 1e12),
                (
                    "mu_nlos",
                    (mu_los..=1e20 * mu_los).contains(&get("mu_nlos")),
                ),
                ("eta", (mu_los..=get("mu_nlos")).contains(&get("eta"))),
                ("min_separation_m", has_room(numbers)),
            ]
        }
        _ => &[],
    };
    let mut rules = rules.iter();
    rules.find(|(_, holds)| !holds).map(|(name, _)| *name)
}

/// Returns true if the relays of an Offer (mission) fit between Tx and Rx at their minimum separation.
pub(crate) fn has_room(offer: &Numbers<'_, '_>) -> bool {
    let single = |number: f64| f64::from(number as f32);
    let distance = offer.get("distance_m");
    let step = single(offer.get("min_separation_m") + single(distance / 2_097_152.0));
    single((offer.get("relays") - 1.0) * step) <= distance
}

/// Returns the target SIRs (linear) that a sweep message lists in compact form, in ascending order.
///
/// `anchor` is one of the targets. `gap` encodes the gap from `anchor` to the next higher target, as a fraction of
/// `anchor`; with 0 there is a single target. `growth` encodes the factor from each gap to the next. Results are
/// rounded to f32, as in a relay.
pub fn targets(anchor: f32, gap: u8, growth: u8) -> Vec<f32> {
    if gap == 0 {
        return vec![anchor];
    }
    let wide = |number: f32| f64::from(number);
    let (e, m) = (i32::from(gap >> 3), f64::from(gap & 7));
    let ratio = 1.0 + f64::from(growth) / 16.0;
    let first = ((1.0 + m / 8.0) * 2_f64.powi(e - 25)) as f32;
    let gaps: Vec<f32> =
        std::iter::successors(Some(first), |gap| Some((wide(*gap) * ratio) as f32))
            .take(8)
            .collect();
    let upper = gaps.iter().scan(anchor, |target, gap| {
        let step = (wide(*target) * wide(*gap)) as f32;
        *target = (wide(*target) + wide(step)) as f32;
        Some(*target)
    });
    let lower = gaps.iter().skip(1).scan(anchor, |target, gap| {
        let factor = (1.0 + wide(*gap)) as f32;
        *target = (wide(*target) / wide(factor)) as f32;
        Some(*target)
    });
    let mut all: Vec<f32> = lower.collect();
    all.reverse();
    all.push(anchor);
    all.extend(upper);
    all
}
