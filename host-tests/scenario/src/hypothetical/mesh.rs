//! Places along a line, closer together the nearer they are to something sharp.

/// Something sharp: within about `width` of `at`, things change.
#[derive(Debug, Clone, Copy)]
pub struct Centre {
    /// Where it is.
    pub at: f64,
    /// How near to it the mesh is finest.
    pub width: f64,
}

impl Centre {
    /// The length over which what comes from this centre changes at `x`.
    fn scale(&self, x: f64) -> f64 {
        (x - self.at).hypot(self.width)
    }
}

/// The ends of the cells, rising from `low` to `high`: none is wider than 1.5 times `widest`, nor than about 1.5 times `step`
/// (below 1) of the distance to a centre.
///
/// About (high - low) / widest places, and 2 ln(2 (high - low) / width) / step more for every centre of its own.
pub fn graded(low: f64, high: f64, centres: &[Centre], step: f64, widest: f64) -> Vec<f64> {
    let mut ends = vec![low];
    let mut at = low;
    while at < high {
        let width = centres
            .iter()
            .map(|centre| step * centre.scale(at))
            .fold(widest, f64::min);
        // What is left is no cell of its own when it is less than half of one.
        at = if at + 1.5 * width < high {
            at + width
        } else {
            high
        };
        ends.push(at);
    }
    ends
}
