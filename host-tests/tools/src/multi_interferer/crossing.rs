//! Level crossings of a sampled function.

/// Bisection steps: more than enough to collapse any f64 interval in metres to adjacent numbers.
const HALVINGS: u32 = 200;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub(super) at: f64,
    /// True if the function is below the level before the crossing and not below it after.
    pub(super) rising: bool,
}

/// Returns the crossings of `level` by `exact` in rising order. `values` are those at the rising `nodes`.
///
/// Two crossings within one cell are missed. Work: about 60 evaluations per crossing.
pub(super) fn crossings(
    nodes: &[f64],
    values: &[f64],
    level: f64,
    exact: impl Fn(f64) -> f64,
) -> Vec<Crossing> {
    let samples = nodes.iter().zip(values);
    let cells = samples.clone().zip(samples.skip(1));
    cells
        .filter(|((_, left), (_, right))| (**left < level) != (**right < level))
        .map(|((&low, &left), (&high, _))| {
            let below = left < level;
            Crossing {
                at: boundary(low, high, |x| (exact(x) < level) == below),
                rising: below,
            }
        })
        .collect()
}

/// Returns the last point from `inside` towards `outside` at which `holds` is still true. Either direction.
///
/// `holds` must be true at `inside` and false at `outside`; if it changes more than once, one of the changes is found.
pub(super) fn boundary(mut inside: f64, mut outside: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = inside.midpoint(outside);
        if middle.total_cmp(&inside).is_eq() || middle.total_cmp(&outside).is_eq() {
            break;
        }
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}
