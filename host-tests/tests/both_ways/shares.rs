//! Ratios of SIRs to the SIRs of a reference search: the worst, percentiles, and a table row.

/// Ratios of two SIRs, one ratio for each random scene. A ratio is the tested SIR divided by the SIR of the reference search.
#[derive(Debug, Default)]
pub(crate) struct Shares(Vec<f64>);

impl Shares {
    pub(crate) fn push(&mut self, share: f64) {
        assert!(share.is_finite(), "{share}");
        self.0.push(share);
    }

    /// Returns a percentile of the ratios: `percent` per cent of them are below it.
    pub(crate) fn percentile(&self, percent: f64) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let at = (sorted.len() as f64 * percent / 100.0) as usize;
        sorted
            .get(at.min(sorted.len().saturating_sub(1)))
            .copied()
            .unwrap_or(1.0)
    }

    pub(crate) fn worst(&self) -> f64 {
        self.percentile(0.0)
    }

    /// Prints the worst ratio, the first percentile and the median as a table row with the label `what`.
    pub(crate) fn report(&self, what: &str) {
        let [worst, first, median] = [0.0, 1.0, 50.0].map(|percent| self.percentile(percent));
        println!(
            "{what}: {} scenes, worst {worst:.6}, 1 % {first:.6}, median {median:.6}",
            self.0.len()
        );
    }
}
