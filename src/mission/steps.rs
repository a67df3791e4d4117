//! The least steps between the relays of a mission, and the room that they leave one another along x.

use super::config::{FINEST_STEP, ROUNDING};
use super::parts::Heading;
use super::validated::Mission;
use crate::root::sqrt;

impl Mission {
    /// The least step in x between neighbours that are `across_squared` m^2 apart across the line: what keeps the separation
    /// asked for.
    pub(crate) fn least_step(&self, across_squared: f32) -> f32 {
        let apart = self.config.min_separation_m;
        if !(across_squared > 0.0) {
            return apart;
        }
        sqrt(apart * apart - across_squared)
    }

    /// The same with room for rounding.
    pub(crate) fn step_with_room(&self, across_squared: f32) -> f32 {
        self.step_of(self.least_step(across_squared))
    }

    /// The last place on its way that leaves the relays after `index` room to stand `min_separation_m` apart, m.
    ///
    /// `across_squared` is how far apart across the line two neighbours among them may be, m^2: that much they need not be along
    /// x.
    pub(crate) fn end_for(&self, index: u16, across_squared: f32) -> f32 {
        self.end_after(self.behind(index), self.least_step(across_squared))
    }

    /// The same where whoever comes after may stand as close as they like.
    pub(crate) fn end_freely(&self, index: u16) -> f32 {
        self.end_after(self.behind(index), 0.0)
    }

    /// How many relays come after `index` on the way of a pass.
    fn behind(&self, index: u16) -> f32 {
        f32::from(match self.heading() {
            Heading::TowardRx => self.config.relays.saturating_sub(index),
            Heading::TowardTx => index.saturating_sub(1),
        })
    }

    /// The last place of relay `index` toward Rx that leaves those after it their separation, m.
    pub(crate) fn latest(&self, index: u16) -> f32 {
        self.latest_at(index, self.config.min_separation_m)
    }

    /// The same where those may stand as close as they like.
    pub(crate) fn latest_freely(&self, index: u16) -> f32 {
        self.latest_at(index, 0.0)
    }

    fn latest_at(&self, index: u16, least: f32) -> f32 {
        let after = f32::from(self.config.relays.saturating_sub(index));
        self.config.distance_m - after * self.step_of(least)
    }

    /// What a step between two that must be `least` apart takes with its rounding, m.
    fn step_of(&self, least: f32) -> f32 {
        let distance_m = self.config.distance_m;
        if least > 0.0 {
            least + distance_m * ROUNDING
        } else {
            distance_m * FINEST_STEP
        }
    }

    fn end_after(&self, behind: f32, least: f32) -> f32 {
        let (distance_m, step) = (self.config.distance_m, self.step_of(least));
        match self.heading() {
            Heading::TowardRx => (distance_m - behind * step).max(0.0),
            Heading::TowardTx => (behind * step).min(distance_m),
        }
    }
}
