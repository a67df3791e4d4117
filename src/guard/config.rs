//! Configuration of the guard: geofence, separation and delays.

use crate::mission::{MAX_RELAYS, Mission, Profile};
use crate::place::{CrossSection, Placement, WithoutQuorum};
use crate::root::sqrt;
use crate::time::Duration;

/// Default of [`GuardConfig::lag`]: the stopping time at the autopilot link's default speed limit.
const LAG: Duration = Duration::from_millis(9_800);

/// Maximum distance from the geofence at which a relay may start, m: the same for x, y and altitude.
pub const BEGIN_WITHIN_M: f32 = 5_000.0;

/// Geofence: box in which all setpoints must be. The x axis is the line from Tx to Rx.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Geofence {
    /// Lower limit of the geofence along x, m from Tx toward Rx: -1e7 to `most_x_m`.
    pub least_x_m: f32,
    /// Upper limit of the geofence along x, m from Tx toward Rx: `least_x_m` to 1e7.
    pub most_x_m: f32,
    /// Smallest y, m to the right of the line as seen from Tx (negative: left): -1e7 to `most_y_m`.
    pub least_y_m: f32,
    /// Largest y, m to the right of the line as seen from Tx (negative: left): `least_y_m` to 1e7.
    pub most_y_m: f32,
    /// Lowest altitude, m above ground: -1e7 to `most_altitude_m`.
    pub least_altitude_m: f32,
    /// Highest altitude, m above ground: `least_altitude_m` to 1e7.
    pub most_altitude_m: f32,
}

impl Geofence {
    /// Returns true if the position `place` is inside the geofence.
    pub fn contains(&self, place: Placement) -> bool {
        (self.least_x_m..=self.most_x_m).contains(&place.x_m)
            && (self.least_y_m..=self.most_y_m).contains(&place.y_m)
            && (self.least_altitude_m..=self.most_altitude_m).contains(&place.altitude_m)
    }
}

/// Configuration of a relay's guard (collision avoidance), set before flight.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GuardConfig {
    /// Geofence of the setpoints. A relay that starts outside of the geofence flies into it. Once inside, all its
    /// setpoints are inside.
    pub geofence: Geofence,
    /// Minimum distance between relays, m: 0 to 1e5. The same at all relays.
    pub separation_m: f32,
    /// Number of relays of the mission, 1 to 1000. The same at all relays.
    pub relays: u16,
    /// Maximum position error of a hovering relay, m per coordinate: 0 to 1e3.
    ///
    /// Because of this error, two relays can come up to twice `hover_m` closer to each other than `separation_m`.
    pub hover_m: f32,
    /// Maximum time from `Guard::steer` until the drone flies toward the new setpoint.
    ///
    /// It is the latency to the flight controller plus the stopping time from maximum speed. With the autopilot link it
    /// is [`Pace::stopping_time`](crate::flight::autopilot::carrot::Pace::stopping_time).
    pub lag: Duration,
}

impl GuardConfig {
    /// Returns the configuration with a mission's separation, distance and altitude band.
    ///
    /// If the altitude of `profile` is outside of the mission's altitude band, the band is extended to it.
    ///
    /// If relays leave the line Tx-Rx while they have no quorum ([`Settings::without_quorum`](crate::Settings)), the
    /// geofence must be [enlarged](Self::with_room_for) for their positions, because it limits all setpoints.
    ///
    /// `hover_m` is 0 and `lag` is 9.8 s, the [stopping time](crate::flight::autopilot::carrot::Pace::stopping_time) of
    /// the default pace.
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
            geofence: Geofence {
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

    /// Returns this configuration with a geofence enlarged for relays that leave the line Tx-Rx. With
    /// [`WithoutQuorum::Leave`] relays leave the line while they have no quorum.
    pub fn with_room_for(mut self, without_quorum: WithoutQuorum) -> Self {
        if let WithoutQuorum::Leave { y_m, up_m } = without_quorum {
            let fence = &mut self.geofence;
            fence.least_y_m += y_m.min(0.0);
            fence.most_y_m += y_m.max(0.0);
            fence.most_altitude_m += up_m;
        }
        self
    }

    /// Returns true if every number of this configuration is within its range.
    pub fn is_valid(&self) -> bool {
        let fence = &self.geofence;
        is_coordinate(fence.least_x_m)
            && is_coordinate(fence.most_x_m)
            && fence.least_x_m <= fence.most_x_m
            && is_coordinate(fence.least_y_m)
            && is_coordinate(fence.most_y_m)
            && fence.least_y_m <= fence.most_y_m
            && is_coordinate(fence.least_altitude_m)
            && is_coordinate(fence.most_altitude_m)
            && fence.least_altitude_m <= fence.most_altitude_m
            && (0.0..=1e5).contains(&self.separation_m)
            && (1..=MAX_RELAYS).contains(&self.relays)
            && (0.0..=1e3).contains(&self.hover_m)
    }

    /// Returns the position in the geofence that is nearest to `place`.
    #[inline(never)] // called from several places
    pub(super) fn clamp(&self, place: Placement) -> Placement {
        let fence = &self.geofence;
        Placement {
            x_m: place.x_m.max(fence.least_x_m).min(fence.most_x_m),
            y_m: place.y_m.max(fence.least_y_m).min(fence.most_y_m),
            altitude_m: place
                .altitude_m
                .max(fence.least_altitude_m)
                .min(fence.most_altitude_m),
        }
    }

    /// Returns the position nearest to `place` that is no farther outside of the geofence than `before`. Each
    /// coordinate is limited separately. If `before` is inside the geofence, so is the result.
    pub(super) fn clamp_toward(&self, place: Placement, before: Placement) -> Placement {
        let fence = &self.geofence;
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

    /// Returns true if a relay may start at `place`, at most 5 km from the geofence in each coordinate. Farther away
    /// the coordinates would be rounded too much.
    pub(super) fn may_begin_at(&self, place: Placement) -> bool {
        let (near, box_place) = (BEGIN_WITHIN_M, self.clamp(place));
        (place.x_m - box_place.x_m).abs() <= near
            && (place.y_m - box_place.y_m).abs() <= near
            && (place.altitude_m - box_place.altitude_m).abs() <= near
    }

    /// Returns the x to which relay `node` flies while the chain is open, m. `x_m` is its agreed x.
    ///
    /// In an open chain all relays keep their order and are at least the minimum separation apart along x. This
    /// requires that the geofence is long enough for all relays of the mission.
    #[inline(never)] // called from several places
    pub(super) fn open_chain_x(&self, node: u16, x_m: f32) -> f32 {
        let least_m = self.geofence.least_x_m;
        let span_m = self.geofence.most_x_m - least_m;
        let step_m = self.separation_m + self.rounding();
        let taken_m = f32::from(self.relays.saturating_sub(1)) * step_m;
        let left = (span_m - taken_m).max(0.0) / span_m.max(f32::MIN_POSITIVE);
        let before = f32::from(node.saturating_sub(1)) * step_m;
        (least_m + before + left * (x_m - least_m)).min(self.geofence.most_x_m)
    }

    /// Returns the smallest difference in x that keeps two relays the minimum separation apart, m. `one` and `other`
    /// are the lateral offset and altitude of each relay. The result is 0 if lateral offset and altitude alone keep the
    /// relays apart.
    pub(super) fn least_step(&self, one: CrossSection, other: CrossSection) -> f32 {
        let apart = self.separation_m;
        sqrt((apart * apart - one.apart_squared(other)).max(0.0))
    }

    /// Returns the maximum rounding error of an x in the geofence, m: `4.0 * f32::EPSILON * |x|`.
    pub(super) fn rounding(&self) -> f32 {
        let fence = &self.geofence;
        4.0 * f32::EPSILON * fence.most_x_m.abs().max(fence.least_x_m.abs())
    }
}

/// Maximum absolute value of a coordinate of a position, m.
const FARTHEST_M: f32 = 1e7;

/// Returns true if `x_m` is a number within ±1e7 m.
pub(super) fn is_coordinate(x_m: f32) -> bool {
    x_m.abs() <= FARTHEST_M
}
