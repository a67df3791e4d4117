//! Closed forms of the best x of one relay for both directions. The relay keeps its altitude, and y = 0.
//!
//! Let l1 and l2 be the squared lengths of the hops, s the relay's squared distance from the interferer, and nu = N eta
//! / P. The constants a, b, c and e depend on the powers and on the interference at Tx and Rx. The SIRs are
//!
//! ```text
//! F1 = a s / (l1 (1 + nu s))    F2 = b / l2    B1 / r = c / l1    B2 / r = e s / (l2 (1 + nu s))
//! ```
//!
//! The position with the largest minimum of these four functions is at Tx or Rx, where one of them has a maximum, or
//! where two are equal. Each of these conditions is a polynomial of degree 5 or less in x, of degree 3 or less without
//! noise:
//!
//! | condition | polynomial |
//! | --- | --- |
//! | F1 = F2 | a s l2 - b l1 (1 + nu s) |
//! | F1 = B1 | a s - c (1 + nu s) |
//! | F1 = B2 | a l2 - e l1 |
//! | F2 = B1 | b l1 - c l2 |
//! | F2 = B2 | b (1 + nu s) - e s |
//! | B1 = B2 | c l2 (1 + nu s) - e s l1 |
//! | F1 largest | s' l1 - s l1' (1 + nu s) |
//! | B2 largest | s' l2 - s l2' (1 + nu s) |
//!
//! F2 and B1 are monotonic. The best of all their real roots is the optimum. `one_relay_both_ways` in `host-tests/tools/tests`
//! compares it with a scan.

use uav_relay_scenario::scene::Scene;

/// Best position of a single relay, for data in both directions.
#[derive(Clone, PartialEq, Debug)]
pub struct Best {
    /// Distance of the relay from Tx toward Rx, m.
    pub x_m: f64,
    /// Number of the reason for the position: 1 above Tx, 2 above Rx, 3 and 4 between Tx and Rx.
    ///
    /// Reason 3: the smallest two of the four hop SIRs are equal there. Reason 4: the smallest hop SIR has its maximum
    /// there.
    pub case: u8,
    /// Explanation, for the user, of why the relay goes to its position.
    pub words: String,
}

/// Names of the four SIRs for the user: of the two hops to Rx, then of the two hops back to Tx.
const NAMES: [&str; 4] = [
    "the first hop",
    "the second hop",
    "the first hop on the way back",
    "the second hop on the way back",
];

/// Largest relative difference of two SIRs that count as equal in the explanation.
const EQUAL: f64 = 1e-6;

/// Coefficients of a polynomial, from the constant term to the highest power.
type Polynomial = Vec<f64>;

/// Returns the best position of a single relay for data in both directions; `None` if every SIR is 0.
///
/// The SIR toward Tx needs to be only `reverse` (above 0) times the SIR toward Rx.
pub fn best(scene: &Scene, reverse: f64) -> Option<Best> {
    let ([relay], [source]) = (scene.relays.as_slice(), scene.sources.as_slice()) else {
        return None;
    };
    let (d, h) = (scene.distance_m, relay.altitude_m);
    let squared = |at: f64, aside: f64| vec![at * at + aside, -2.0 * at, 1.0];
    let l1 = squared(0.0, h * h);
    let l2 = squared(d, h * h);
    let s = squared(source.x_m, source.y_m * source.y_m + h * h);
    let nu = scene.noise_w * scene.eta / source.power_w;
    let noisy = sum(&scaled(&s, nu), &[1.0]);
    let received = |ground_w: f64| relay.power_w / (scene.eta * (ground_w + scene.noise_w));
    let a = scene.tx_w / source.power_w;
    let b = received(scene.interference_rx_w());
    let c = received(scene.interference_on_ground_w(0.0)) / reverse;
    let e = scene.rx_w / source.power_w / reverse;
    let less = |one: Polynomial, other: Polynomial| sum(&one, &scaled(&other, -1.0));
    let hill = |l: &Polynomial| {
        less(
            product(&slope(&s), l),
            product(&product(&s, &slope(l)), &noisy),
        )
    };
    let conditions = [
        less(
            scaled(&product(&s, &l2), a),
            scaled(&product(&l1, &noisy), b),
        ),
        less(scaled(&s, a), scaled(&noisy, c)),
        less(scaled(&l2, a), scaled(&l1, e)),
        less(scaled(&l1, b), scaled(&l2, c)),
        less(scaled(&noisy, b), scaled(&s, e)),
        less(
            scaled(&product(&l2, &noisy), c),
            scaled(&product(&s, &l1), e),
        ),
        hill(&l1),
        hill(&l2),
    ];
    let sirs = |x: f64| {
        let [l1, l2, s, noisy] = [&l1, &l2, &s, &noisy].map(|of| value(of, x));
        [a * s / (l1 * noisy), b / l2, c / l1, e * s / (l2 * noisy)]
    };
    let worst = |x: f64| sirs(x).into_iter().fold(f64::INFINITY, f64::min);
    let inside = conditions.iter().flat_map(|condition| roots(condition, d));
    let x_m = [0.0, d]
        .into_iter()
        .chain(inside)
        .max_by(|one, other| worst(*one).total_cmp(&worst(*other)))?;
    let sir = worst(x_m);
    if !(sir > 0.0) {
        return None;
    }
    let limits: Vec<&str> = sirs(x_m)
        .into_iter()
        .zip(NAMES)
        .filter(|(own, _)| *own <= sir * (1.0 + EQUAL))
        .map(|(_, name)| name)
        .collect();
    let limit = limits.first().copied().unwrap_or_default();
    let (case, words) = if x_m <= 0.0 {
        let words =
            format!("the drone stays directly above Tx: even there {limit} is the weakest hop");
        (1, words)
    } else if x_m >= d {
        let words =
            format!("the drone goes directly above Rx: even there {limit} is the weakest hop");
        (2, words)
    } else if limits.len() > 1 {
        let words = format!(
            "the drone goes to where {} are equally good: to either side one of them would be worse",
            limits.join(" and ")
        );
        (3, words)
    } else {
        let words =
            format!("the drone goes to where {limit} is best: even there it is the weakest hop");
        (4, words)
    };
    Some(Best { x_m, case, words })
}

fn value(of: &[f64], x: f64) -> f64 {
    of.iter()
        .rev()
        .fold(0.0, |sum, coefficient| sum * x + coefficient)
}

fn scaled(of: &[f64], by: f64) -> Polynomial {
    of.iter().map(|coefficient| coefficient * by).collect()
}

fn sum(one: &[f64], other: &[f64]) -> Polynomial {
    let of = |of: &[f64], at: usize| of.get(at).copied().unwrap_or_default();
    let terms = one.len().max(other.len());
    (0..terms).map(|at| of(one, at) + of(other, at)).collect()
}

fn product(one: &[f64], other: &[f64]) -> Polynomial {
    let mut terms = vec![0.0; one.len() + other.len()];
    for (at, left) in one.iter().enumerate() {
        for (to, right) in other.iter().enumerate() {
            if let Some(term) = terms.get_mut(at + to) {
                *term += left * right;
            }
        }
    }
    terms
}

fn slope(of: &[f64]) -> Polynomial {
    let terms = (0_u32..).zip(of).skip(1);
    terms
        .map(|(power, coefficient)| f64::from(power) * coefficient)
        .collect()
}

/// Returns the real roots of the polynomial `of` within 0 to `end`.
///
/// They are searched between the roots of the derivative.
fn roots(of: &[f64], end: f64) -> Vec<f64> {
    let size = of.iter().rposition(|coefficient| *coefficient != 0.0);
    let Some(of) = size.and_then(|degree| of.get(..=degree)) else {
        return Vec::new();
    };
    if of.len() < 2 {
        return Vec::new();
    }
    let turns = roots(&slope(of), end);
    let mut edges = vec![0.0];
    edges.extend(turns);
    edges.push(end);
    let mut found = Vec::new();
    for pair in edges.windows(2) {
        let &[mut low, mut high] = pair else { continue };
        let rises = value(of, high) > value(of, low);
        // At a double root the sign does not change. The extremum itself is then a candidate.
        found.push(high);
        if value(of, low) * value(of, high) > 0.0 {
            continue;
        }
        for _ in 0..200 {
            let middle = f64::midpoint(low, high);
            if !(middle > low && middle < high) {
                break;
            }
            if (value(of, middle) > 0.0) == rises {
                high = middle;
            } else {
                low = middle;
            }
        }
        found.push(low);
        found.push(high);
    }
    found.sort_by(f64::total_cmp);
    found
}
