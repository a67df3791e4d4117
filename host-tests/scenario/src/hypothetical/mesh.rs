//! Graded mesh on a line: cells are smaller near points of rapid change.

/// A point of rapid change, at a scale of about `width`.
#[derive(Debug, Clone, Copy)]
pub struct Centre {
    /// Position.
    pub at: f64,
    /// Scale of the finest cells.
    pub width: f64,
}

impl Centre {
    /// Returns the length scale of changes at `x` caused by this centre.
    fn scale(&self, x: f64) -> f64 {
        (x - self.at).hypot(self.width)
    }
}

/// Returns the cell ends from `low` to `high`, rising.
///
/// Cells are at most 1.5 times `widest` wide, and at most about 1.5 times `step` (below 1) of the distance to a centre. About
/// (high - low) / widest ends, and 2 ln(2 (high - low) / width) / step more per centre.
pub fn graded(low: f64, high: f64, centres: &[Centre], step: f64, widest: f64) -> Vec<f64> {
    let mut ends = vec![low];
    let mut at = low;
    while at < high {
        let width = centres
            .iter()
            .map(|centre| step * centre.scale(at))
            .fold(widest, f64::min);
        // A remainder of less than half a cell is merged with the last cell.
        at = if at + 1.5 * width < high {
            at + width
        } else {
            high
        };
        ends.push(at);
    }
    ends
}
