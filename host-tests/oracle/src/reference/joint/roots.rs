//! Sign intervals of a polynomial, by the roots of its derivatives, between which it is monotone.

/// Bisection steps to the resolution of f64.
const HALVINGS: usize = 80;

/// Returns the intervals of [`low`, `high`] where the polynomial is <= 0. Coefficients are from the constant up.
pub(super) fn not_positive(coefficients: &[f64], low: f64, high: f64) -> Vec<(f64, f64)> {
    if !(low <= high) {
        return Vec::new();
    }
    let at = |z: f64| value(coefficients, z);
    let mut corners = vec![low];
    corners.extend(roots(coefficients, low, high));
    corners.push(high);
    let mut found: Vec<(f64, f64)> = Vec::new();
    for (&from, &to) in corners.iter().zip(corners.iter().skip(1)) {
        if at(from.midpoint(to)) <= 0.0 {
            match found.last_mut() {
                Some(last) if last.1 >= from => last.1 = to,
                _ => found.push((from, to)),
            }
        }
    }
    found
}

/// Returns the roots in (`low`, `high`) where the sign changes, rising.
fn roots(coefficients: &[f64], low: f64, high: f64) -> Vec<f64> {
    let Some((_, rest)) = coefficients.split_first() else {
        return Vec::new();
    };
    if rest.is_empty() {
        return Vec::new();
    }
    let slope: Vec<f64> = (1..).zip(rest).map(|(n, c)| f64::from(n) * c).collect();
    let mut corners = vec![low];
    corners.extend(roots(&slope, low, high));
    corners.push(high);
    let at = |z: f64| value(coefficients, z);
    let pairs = corners.iter().zip(corners.iter().skip(1));
    let changes = pairs.filter(|&(&from, &to)| (at(from) > 0.0) != (at(to) > 0.0));
    changes
        .map(|(&from, &to)| {
            let (mut from, mut to) = (from, to);
            let first = at(from) > 0.0;
            for _ in 0..HALVINGS {
                let middle = from.midpoint(to);
                if (at(middle) > 0.0) == first {
                    from = middle;
                } else {
                    to = middle;
                }
            }
            from
        })
        .collect()
}

fn value(coefficients: &[f64], z: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * z + c)
}
