//! Statistics over the whole run.

use std::fmt::Write as _;

use serde::Serialize;

use super::timeline::seconds;
use crate::simulator::watch::Watched;

/// Statistics over the whole run; all absent if not recorded.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct AvailabilityReport {
    /// Time of the first agreement, s: all relays of a view hold their positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_agreement_s: Option<f64>,
    /// Share of the time since then in which a longest possible chain held its optimum.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub availability: Option<f64>,
    /// Longest continuous time since then without that, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_outage_s: Option<f64>,
    /// Largest number of groups that held separate agreements at the same time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_flying: Option<usize>,
    /// Smallest distance of two relays, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_separation_m: Option<f64>,
}

impl AvailabilityReport {
    /// Report of `watched`.
    pub fn of(watched: Watched) -> Self {
        let longest = watched.longest_wrong;
        Self {
            first_agreement_s: watched.first_agreement.map(seconds),
            availability: watched.availability,
            longest_outage_s: longest.map(|span| span.as_micros() as f64 / 1e6),
            most_flying: Some(watched.most_flying),
            least_separation_m: watched.least_separation_m.filter(|least| least.is_finite()),
        }
    }

    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        if let Some(availability) = self.availability {
            let outage = self.longest_outage_s.unwrap_or(0.0);
            _ = match self.first_agreement_s {
                Some(first) => writeln!(
                    text,
                    "availability: {availability:.6} since the first agreement at {first:.3} s; the longest outage took {outage:.3} s"
                ),
                None => writeln!(
                    text,
                    "availability: {availability:.6}, because there was no agreement"
                ),
            };
        }
        if let Some(most) = self.most_flying {
            _ = writeln!(
                text,
                "most groups with separate agreements at the same time: {most}"
            );
        }
        if let Some(least) = self.least_separation_m {
            _ = writeln!(text, "least separation of two relays: {least:.3} m");
        }
        text
    }
}
