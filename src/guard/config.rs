//! The box that no setpoint leaves, and what else is set before flight.

use crate::mission::{MAX_RELAYS, Mission, Profile};
use crate::place::{CrossSection, Placement};
use crate::root::sqrt;
use crate::time::Duration;
use crate::without_quorum::WithoutQuorum;

use super::fence::is_place;

/// Default time that a relay may fly away from a new setpoint: the stopping time of the autopilot link's default pace.
const LAG: Duration = Duration::from_millis(9_800);

/// Greatest distance from the box, m in each coordinate, at which a relay may begin.
pub const BEGIN_WITHIN_M: f32 = 5_000.0;

/// Where setpoints may be.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Geofence {
    /// The least x, m from Tx: -1e7 to `most_x_m`.
    pub least_x_m: f32,
    /// The largest x, m: to 1e7.
    pub most_x_m: f32,
    /// The least y, m from the line: -1e7 to `most_y_m`.
    pub least_y_m: f32,
    /// The largest y, m: to 1e7.
    pub most_y_m: f32,
    /// The least altitude, m: -1e7 to `most_altitude_m`.
    pub least_altitude_m: f32,
    /// The largest altitude, m: to 1e7.
    pub most_altitude_m: f32,
}

impl Geofence {
    /// Whether `place` is in the box.
    pub fn contains(&self, place: Placement) -> bool {
        (self.least_x_m..=self.most_x_m).contains(&place.x_m)
            && (self.least_y_m..=self.most_y_m).contains(&place.y_m)
            && (self.least_altitude_m..=self.most_altitude_m).contains(&place.altitude_m)
    }
}

/// What a guard is told before flight.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GuardConfig {
    /// The box that no setpoint leaves.
    pub fence: Geofence,
    /// How far apart relays are kept, m: 0 to 1e5; the same on all relays.
    pub separation_m: f32,
    /// Number of relays of the mission, 1 to 1000; the same on all relays.
    pub relays: u16,
    /// How far off its setpoint a relay may be reported that hovers there, m in each coordinate: 0 to 1e3. This much is taken from the separation at
    /// each of two relays.
    pub hover_m: f32,
    /// Time after `Guard::steer` gave a setpoint within which the relay flies toward it: the way of the setpoint to
    /// the flight controller, and the time to stop from the greatest speed. With the autopilot link it is
    /// [`Pace::stopping_time`](crate::flight::autopilot::carrot::Pace::stopping_time).
    pub lag: Duration,
}

impl GuardConfig {
    /// Those of a mission: its separation, its distance, and its band of altitudes, widened to the one that this relay holds.
    ///
    /// Where relays leave the line without a quorum ([`Settings::without_quorum`](crate::Settings)), the box needs
    /// [room](Self::with_room_for) for that: they go no farther than it.
    ///
    /// `hover_m` is 0 and `lag` 9.8 s, the [stopping time](crate::flight::autopilot::carrot::Pace::stopping_time) of the default pace.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::GuardConfig;
    ///
    /// let guard = GuardConfig::of(&MISSION, MISSION.config().common);
    /// assert!(guard.is_valid());
    /// assert_eq!(guard.separation_m, MISSION.config().min_separation_m);
    /// ```
    pub fn of(mission: &Mission, profile: Profile) -> Self {
        let config = mission.config();
        Self {
            fence: Geofence {
                least_x_m: 0.0,
                most_x_m: config.distance_m,
                least_y_m: config.lateral.least_m,
                most_y_m: config.lateral.most_m,
                least_altitude_m: config.band.least_m.min(profile.altitude_m),
                most_altitude_m: config.band.most_m.max(profile.altitude_m),
            },
            separation_m: config.min_separation_m,
            relays: config.relays,
            hover_m: 0.0,
            lag: LAG,
        }
    }

    /// The same with a box that has room for relays that leave the line without a quorum.
    pub fn with_room_for(mut self, without_quorum: WithoutQuorum) -> Self {
        if let WithoutQuorum::Leave { y_m, up_m } = without_quorum {
            let fence = &mut self.fence;
            fence.least_y_m += y_m.min(0.0);
            fence.most_y_m += y_m.max(0.0);
            fence.most_altitude_m += up_m;
        }
        self
    }

    /// Whether every number is within its range.
    pub fn is_valid(&self) -> bool {
        let fence = &self.fence;
        is_place(fence.least_x_m)
            && is_place(fence.most_x_m)
            && fence.least_x_m <= fence.most_x_m
            && is_place(fence.least_y_m)
            && is_place(fence.most_y_m)
            && fence.least_y_m <= fence.most_y_m
            && is_place(fence.least_altitude_m)
            && is_place(fence.most_altitude_m)
            && fence.least_altitude_m <= fence.most_altitude_m
            && (0.0..=1e5).contains(&self.separation_m)
            && (1..=MAX_RELAYS).contains(&self.relays)
            && (0.0..=1e3).contains(&self.hover_m)
    }

    /// Returns the place in the box that is nearest to `place`.
    #[inline(never)] // called from several places
    pub(super) fn cut(&self, place: Placement) -> Placement {
        let fence = &self.fence;
        Placement {
            x_m: place.x_m.max(fence.least_x_m).min(fence.most_x_m),
            y_m: place.y_m.max(fence.least_y_m).min(fence.most_y_m),
            altitude_m: place
                .altitude_m
                .max(fence.least_altitude_m)
                .min(fence.most_altitude_m),
        }
    }

    /// Returns the place nearest to `place` that is no farther outside the box than `before`.
    pub(super) fn cut_toward(&self, place: Placement, before: Placement) -> Placement {
        let fence = &self.fence;
        let cut = |is: f32, before: f32, least: f32, most: f32| {
            is.max(least.min(before)).min(most.max(before))
        };
        Placement {
            x_m: cut(place.x_m, before.x_m, fence.least_x_m, fence.most_x_m),
            y_m: cut(place.y_m, before.y_m, fence.least_y_m, fence.most_y_m),
            altitude_m: cut(
                place.altitude_m,
                before.altitude_m,
                fence.least_altitude_m,
                fence.most_altitude_m,
            ),
        }
    }

    /// Returns true if a relay may begin at `place`: near enough to the box that no number is too large to be exact.
    pub(super) fn may_begin_at(&self, place: Placement) -> bool {
        let (near, box_place) = (BEGIN_WITHIN_M, self.cut(place));
        (place.x_m - box_place.x_m).abs() <= near
            && (place.y_m - box_place.y_m).abs() <= near
            && (place.altitude_m - box_place.altitude_m).abs() <= near
    }

    /// Where node `node`, which is to be at `x_m`, waits while the chain is open: places in order stay in order, and come to be the
    /// separation apart wherever the relays of the mission fit the box so.
    #[inline(never)] // called from several places
    pub(super) fn open_place(&self, node: u16, x_m: f32) -> f32 {
        let least_m = self.fence.least_x_m;
        let span_m = self.fence.most_x_m - least_m;
        let step_m = self.separation_m + self.rounding();
        let taken_m = f32::from(self.relays.saturating_sub(1)) * step_m;
        let left = (span_m - taken_m).max(0.0) / span_m.max(f32::MIN_POSITIVE);
        let before = f32::from(node.saturating_sub(1)) * step_m;
        (least_m + before + left * (x_m - least_m)).min(self.fence.most_x_m)
    }

    /// How far apart along x two relays have to be at least that are at `one` and `other` across the line, m.
    pub(super) fn least_step(&self, one: CrossSection, other: CrossSection) -> f32 {
        let apart = self.separation_m;
        sqrt((apart * apart - one.apart_squared(other)).max(0.0))
    }

    /// What rounding may make of a place, m: four steps of an f32 at the far end of the box.
    pub(super) fn rounding(&self) -> f32 {
        4.0 * f32::EPSILON * self.fence.most_x_m.abs().max(self.fence.least_x_m.abs())
    }
}
