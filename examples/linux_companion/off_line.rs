//! Detects a drone that is far from its line Tx to Rx. Often latitude and longitude were swapped.
//!
//! | kind | position | reported |
//! | --- | --- | --- |
//! | off the line | over 5 km off: no position | on the ground once, in the air every 10 s; also to the operator |
//! | off the fence | more than [`FENCE_M`] outside the mission's geofence, horizontally | every 10 s in the air |

use std::fmt;

use serde_json::{Value, json};
use uav_relay::flight::autopilot::OffLine;
use uav_relay::flight::axis::Axis;
use uav_relay::{Band, Duration, Instant, Placement, Sites};
use uav_relay_linux::site::swapped;

const AGAIN: Duration = Duration::from_millis(10_000);

const STALE: Duration = Duration::from_millis(3_000);

/// Maximum distance outside the geofence, m, at which a drone is not reported yet.
const FENCE_M: f64 = 100.0;

/// Minimum ratio of two distances for the log to suggest swapped latitude and longitude.
///
/// The ratio is the drone's distance from the line, divided by its distance from the line with swapped coordinates.
const NEARER: f64 = 10.0;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Line,
    Fence,
}

/// Report that a drone is far from the line Tx to Rx, or outside its geofence.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct OffLineReport {
    kind: Kind,
    away_m: f64,
    outside_m: f64,
    /// True if the drone is near the line with swapped latitude and longitude.
    is_swapped: bool,
}

/// Monitor of the drone's distance from the line Tx to Rx and from its geofence.
#[derive(Debug, Default)]
pub(crate) struct OffLineMonitor {
    newest: Option<(Instant, Placement)>,
    lines: Option<Lines>,
    away_m: Option<f64>,
    report: Option<OffLineReport>,
    reported_at: Option<Instant>,
}

impl OffLineMonitor {
    pub(crate) const fn handle_place(&mut self, now: Instant, place: Placement) {
        self.newest = Some((now, place));
    }

    pub(crate) fn place(&self, now: Instant) -> Option<Placement> {
        let fresh = self.newest.filter(|(at, _)| now.since(*at) < STALE);
        fresh.map(|(_, place)| place)
    }

    /// Returns the report on a drone far from the line Tx to Rx. `off_line` has its position and distance.
    ///
    /// `sites` are the Tx and Rx positions.
    pub(crate) fn line_report(&mut self, sites: Sites, off_line: OffLine) -> Option<OffLineReport> {
        self.lines(sites).map(|lines| lines.off_line(off_line))
    }

    /// Returns the report on a drone outside its geofence, if one is due.
    ///
    /// `off_line` is the position of a drone far from the line; if it is `None`, the newest measured position is used.
    /// The geofence surrounds the line between `sites`; its width is the mission's `lateral` range.
    pub(crate) fn check(
        &mut self,
        now: Instant,
        sites: Sites,
        lateral: Band,
        off_line: Option<OffLine>,
        is_in_air: bool,
    ) -> Option<OffLineReport> {
        let fresh = self.newest.filter(|(at, _)| now.since(*at) < STALE);
        let lines = self.lines(sites)?;
        let (away_m, off) = match (off_line, fresh) {
            (Some(off_line), _) => {
                let off = lines.off_line(off_line);
                (Some(off.away_m), Some(off))
            }
            (None, Some((_, place))) => {
                (Some(lines.away_m(place)), lines.off_fence(place, lateral))
            }
            (None, None) => (None, None),
        };
        (self.away_m, self.report) = (away_m, off);
        let off = off.filter(|off| off.kind == Kind::Fence)?;
        // No report on the ground: a drone may start beside its line.
        let is_due = self.reported_at.is_none_or(|at| now.since(at) >= AGAIN);
        if !is_in_air || !is_due {
            return None;
        }
        self.reported_at = Some(now);
        Some(off)
    }

    fn lines(&mut self, sites: Sites) -> Option<&Lines> {
        if self.lines.as_ref().is_none_or(|lines| lines.sites != sites) {
            self.lines = Lines::between(sites);
        }
        self.lines.as_ref()
    }

    /// Returns the drone's distance from the line Tx to Rx, and the limit that the drone exceeds, as JSON.
    ///
    /// The limit is `line` or `geofence`, or `null` if the drone exceeds none.
    pub(crate) fn status(&self) -> Value {
        json!({
            "from_line_m": self.away_m,
            "outside": self.report.map(|off| match off.kind {
                Kind::Line => "line",
                Kind::Fence => "geofence",
            }),
            "sites_look_swapped": self.report.is_some_and(|off| off.is_swapped),
        })
    }
}

/// Line from Tx to Rx, and the same line with latitude and longitude swapped (`None` if invalid).
#[derive(Debug)]
struct Lines {
    sites: Sites,
    axis: Axis,
    swapped: Option<Axis>,
}

impl Lines {
    fn between(sites: Sites) -> Option<Self> {
        Some(Self {
            sites,
            axis: Axis::between(sites).ok()?,
            swapped: Axis::try_new(swapped(sites.tx), swapped(sites.rx)).ok(),
        })
    }

    fn off_line(&self, OffLine { at, away_m }: OffLine) -> OffLineReport {
        let away_m = f64::from(away_m);
        let swapped = self.swapped.as_ref().and_then(|axis| axis.away_m(at));
        OffLineReport {
            kind: Kind::Line,
            away_m,
            outside_m: away_m,
            is_swapped: swapped.is_some_and(|swapped_m| swapped_m * NEARER < away_m),
        }
    }

    /// Returns the horizontal distance of a position from the line Tx to Rx, m.
    fn away_m(&self, place: Placement) -> f64 {
        let along_m = beyond(place.x_m.into(), 0.0, self.axis.distance_m());
        along_m.hypot(place.y_m.into())
    }

    /// Returns a report if `place` is more than [`FENCE_M`] outside the geofence.
    fn off_fence(&self, place: Placement, lateral: Band) -> Option<OffLineReport> {
        let along_m = beyond(place.x_m.into(), 0.0, self.axis.distance_m());
        let aside_m = beyond(
            place.y_m.into(),
            lateral.least_m.into(),
            lateral.most_m.into(),
        );
        let outside_m = along_m.hypot(aside_m);
        (outside_m > FENCE_M).then_some(OffLineReport {
            kind: Kind::Fence,
            away_m: self.away_m(place),
            outside_m,
            is_swapped: false,
        })
    }
}

/// Returns the distance of `value` from the range `least` to `most`; 0 if `value` is inside the range.
fn beyond(value: f64, least: f64, most: f64) -> f64 {
    (least - value).max(value - most).max(0.0)
}

impl OffLineReport {
    /// Returns the text for the operator, at most 50 bytes; `None` for reports that are only logged.
    pub(crate) fn for_operator(&self) -> Option<String> {
        (self.kind == Kind::Line).then(|| {
            format!(
                "relay: drone is {} off the line Tx-Rx",
                RoundedDistance(self.away_m)
            )
        })
    }

    pub(crate) fn fields(&self) -> Value {
        json!({ "from_line_m": self.away_m, "outside_m": self.outside_m })
    }
}

impl fmt::Display for OffLineReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let away = RoundedDistance(self.away_m);
        write!(
            f,
            "the drone is {away} from the line between transmitter and receiver"
        )?;
        match (self.kind, self.is_swapped) {
            (Kind::Line, true) => f.write_str(": are latitude and longitude swapped?"),
            (Kind::Line, false) => f.write_str(
                ": check the mission's sites (positions of Tx and Rx), and the drone's position",
            ),
            (Kind::Fence, _) => {
                write!(
                    f,
                    ", {} outside the mission's geofence",
                    RoundedDistance(self.outside_m)
                )
            }
        }
    }
}

/// Distance, m, displayed in m or km and rounded.
struct RoundedDistance(f64);

impl fmt::Display for RoundedDistance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let km = self.0 / 1e3;
        match km {
            ..0.999_5 => write!(f, "{:.0} m", self.0),
            ..9.95 => write!(f, "{km:.1} km"),
            ..999.5 => write!(f, "{km:.0} km"),
            _ => {
                // The longest distance on earth has five digits in km.
                let (thousands, rest) = ((km.round() / 1e3).floor(), km.round() % 1e3);
                write!(f, "{thousands:.0} {rest:03.0} km")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Kind, Lines, OffLine, OffLineReport, RoundedDistance};
    use uav_relay::{Band, Geodetic, Sites};

    fn site(lat_deg: f64, lon_deg: f64) -> Geodetic {
        Geodetic::from_degrees(lat_deg, lon_deg, 420.0).expect("on earth")
    }

    fn off(tx: Geodetic, rx: Geodetic, drone: Geodetic) -> Option<OffLineReport> {
        let lateral = Band {
            least_m: -50.0,
            most_m: 0.0,
        };
        let lines = Lines::between(Sites { tx, rx })?;
        let Some(place) = lines.axis.place(drone) else {
            return Some(lines.off_line(OffLine::new(drone, &lines.axis)?));
        };
        lines.off_fence(place, lateral)
    }

    #[test]
    fn a_distance_is_rounded_to_two_digits_or_km() {
        for (m, text) in [
            (0.4, "0 m"),
            (312.4, "312 m"),
            (999.4, "999 m"),
            (999.6, "1.0 km"),
            (9_949.0, "9.9 km"),
            (9_951.0, "10 km"),
            (999_400.0, "999 km"),
            (999_600.0, "1 000 km"),
            (5_012_345.0, "5 012 km"),
            (20_003_900.0, "20 004 km"),
        ] {
            assert_eq!(RoundedDistance(m).to_string(), text);
        }
    }

    #[test]
    fn only_swapped_sites_are_reported_as_swapped() {
        let drone = site(47.405, 8.545);
        let swapped = off(site(8.54, 47.40), site(8.55, 47.41), drone).expect("off");
        assert!(swapped.kind == Kind::Line && swapped.is_swapped);
        let text = swapped.to_string();
        assert!(text.ends_with("km from the line between transmitter and receiver: are latitude and longitude swapped?"), "{text}");
        // The line from Tx to Rx is in a different valley.
        let other = off(site(46.54, 7.40), site(46.55, 7.41), drone).expect("off");
        assert!(other.kind == Kind::Line && !other.is_swapped);
        assert!(other.to_string().ends_with(
            ": check the mission's sites (positions of Tx and Rx), and the drone's position"
        ));
        // A longitude above 90 degrees cannot be a latitude, so the swapped line does not exist.
        let far = off(site(47.40, 138.54), site(47.41, 138.55), drone).expect("off");
        assert!(!far.is_swapped);
        for off in [swapped, other, far] {
            let text = off.for_operator().expect("the operator reads it");
            assert!(text.len() <= 50, "{text}");
        }
    }

    #[test]
    fn nothing_is_reported_up_to_100_m_outside_the_geofence() {
        let (tx, rx) = (site(47.40, 8.54), site(47.40, 8.55));
        // The line points east, so its left side is north: 50 m in the mission and 100 m of tolerance. 0.01 degrees
        // of latitude are 1112 m.
        for (lat, lon, outside) in [
            (47.400, 8.545, None),
            (47.4013, 8.545, None),
            (47.4015, 8.545, Some(117.0)),
            (47.3992, 8.545, None),
            (47.3990, 8.545, Some(111.0)),
            (47.400, 8.5512, None),
            (47.400, 8.5515, Some(113.0)),
            (47.400, 8.5385, Some(113.0)),
        ] {
            let off = off(tx, rx, site(lat, lon));
            let is = off.map(|off| off.outside_m);
            match (is, outside) {
                (None, None) => {}
                (Some(is), Some(outside)) => {
                    assert!((is - outside).abs() < 1.0, "{lat} {lon}: {is}");
                }
                _ => panic!("{lat} {lon}: {is:?}"),
            }
            assert!(off.is_none_or(|off| off.for_operator().is_none()));
        }
    }
}
