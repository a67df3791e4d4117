//! Where a sampled function crosses a level.

/// Halvings after which any f64 interval in metres has collapsed to neighbours, with room to spare.
const HALVINGS: u32 = 200;

/// One crossing of a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// Where, metres.
    pub(super) at: f64,
    /// Whether the function is below the level before it and not below it after.
    pub(super) rising: bool,
}

/// The crossings of `level` by `exact`, known by its `values` at the rising `nodes`, in rising order.
///
/// Two crossings within one cell go unseen. One evaluation a node was spent on the values; a crossing costs about 60 more.
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

/// The last place on the way from `inside` to `outside` (either direction) at which `holds` is still true.
///
/// `holds` is taken to be true at `inside` and false at `outside`; where it changes more than once, one of the changes is found.
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
