//! Nelder-Mead simplex search in the plane, near a minimum of a function without usable derivatives.

#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub(super) at: (f64, f64),
    pub(super) value: f64,
}

/// Returns the best corner found from `start` with initial `steps`; never worse than `start`.
///
/// Ends when the values at the corners agree to `tolerance` (relative), or after `most` steps of at most four evaluations.
pub(super) fn minimise(
    f: impl Fn((f64, f64)) -> f64,
    start: (f64, f64),
    steps: (f64, f64),
    tolerance: f64,
    most: u32,
) -> Corner {
    let corner = |at| Corner { at, value: f(at) };
    let sorted = |mut corners: [Corner; 3]| {
        corners.sort_by(|a, b| a.value.total_cmp(&b.value));
        corners
    };
    let beside = (start.0 + steps.0, start.1);
    let above = (start.0, start.1 + steps.1);
    let mut corners = sorted([start, beside, above].map(corner));
    for _ in 0..most {
        let [best, middle, worst] = corners;
        if worst.value - best.value <= tolerance * best.value.abs() {
            break;
        }
        let along = |share| corner(between(worst.at, between(best.at, middle.at, 0.5), share));
        let mirrored = along(2.0);
        let tried = if mirrored.value < best.value {
            let beyond = along(3.0);
            if beyond.value < mirrored.value {
                beyond
            } else {
                mirrored
            }
        } else if mirrored.value < middle.value {
            mirrored
        } else if mirrored.value < worst.value {
            along(1.5)
        } else {
            along(0.5)
        };
        corners = sorted(if tried.value < worst.value {
            [best, middle, tried]
        } else {
            // No improvement along that line: shrinks the simplex toward the best corner.
            let drawn = |other: Corner| corner(between(best.at, other.at, 0.5));
            [best, drawn(middle), drawn(worst)]
        });
    }
    let [best, ..] = corners;
    best
}

/// Interpolates from `from` to `to`; extrapolates for a share above 1.
fn between(from: (f64, f64), to: (f64, f64), share: f64) -> (f64, f64) {
    (
        from.0 + share * (to.0 - from.0),
        from.1 + share * (to.1 - from.1),
    )
}

#[cfg(test)]
mod tests {
    use super::minimise;

    /// Checks a narrow pit, which only shrinking reaches. Everything between the corners is higher than they are.
    #[test]
    fn a_simplex_that_is_too_large_shrinks() {
        let pit = |(x, y): (f64, f64)| {
            let r = x.hypot(y);
            if r < 1.0 { r } else { 10.0 - 1e-3 * r }
        };
        let found = minimise(pit, (0.5, 0.0), (90.0, 70.0), 0.0, 120);
        assert!(found.value < 1e-9, "{found:?}");
    }

    #[test]
    fn the_bottom_of_a_bent_valley_is_found() {
        let valley = |(x, y): (f64, f64)| 1.0 + (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2);
        let found = minimise(valley, (-1.2, 1.0), (0.1, 0.1), 1e-15, 500);
        assert!(
            (found.at.0 - 1.0).abs() < 1e-5 && (found.at.1 - 1.0).abs() < 1e-5,
            "{found:?}"
        );
        assert!(found.value < 1.0 + 1e-12, "{found:?}");
    }
}
