//! Where relays may fly, and where one does.

/// Where relays may fly, seen along Tx-Rx.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corridor {
    /// Lowest altitude above the ground of Tx, Rx and the interferer, metres, > 0.
    pub least_m: f64,
    /// Highest altitude, metres, >= `least_m`.
    pub most_m: f64,
    /// Least y, metres; seldom > 0.
    pub left_m: f64,
    /// Largest y, metres, >= `left_m`.
    pub right_m: f64,
}

impl Corridor {
    /// The plane above Tx-Rx, within a band of altitudes.
    pub const fn plane(least_m: f64, most_m: f64) -> Self {
        Self {
            least_m,
            most_m,
            left_m: 0.0,
            right_m: 0.0,
        }
    }

    /// Whether a place is within, `slack_m` forgiven.
    pub fn contains(&self, place: &Place, slack_m: f64) -> bool {
        let within =
            |low: f64, value: f64, high: f64| (low - slack_m..=high + slack_m).contains(&value);
        within(self.least_m, place.altitude_m, self.most_m)
            && within(self.left_m, place.y_m, self.right_m)
    }
}

/// A relay that holds its place in the cross-section, within the corridor or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// Its number in the link, from 0.
    pub relay: usize,
    /// Its offset from the Tx-Rx plane, metres.
    pub y_m: f64,
    /// Its altitude, metres, > 0.
    pub altitude_m: f64,
}

impl Hold {
    /// The corridor of one relay: of no width if it holds its place.
    pub(super) fn room(held: &[Self], relay: usize, corridor: Corridor) -> Corridor {
        let own = held.iter().find(|hold| hold.relay == relay);
        own.map_or(corridor, |hold| Corridor {
            least_m: hold.altitude_m,
            most_m: hold.altitude_m,
            left_m: hold.y_m,
            right_m: hold.y_m,
        })
    }
}

/// Where one relay flies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Coordinate along Tx-Rx, metres, in [0, D].
    pub x_m: f64,
    /// Offset from the Tx-Rx plane, to the side on which the interferer's is positive, metres.
    pub y_m: f64,
    /// Altitude, metres.
    pub altitude_m: f64,
}

impl Place {
    /// A place in the plane above Tx-Rx.
    pub const fn in_plane(x_m: f64, altitude_m: f64) -> Self {
        Self {
            x_m,
            y_m: 0.0,
            altitude_m,
        }
    }

    /// Distance from another place, metres.
    pub fn distance_m(&self, other: &Self) -> f64 {
        let aside = (self.y_m - other.y_m).hypot(self.altitude_m - other.altitude_m);
        (self.x_m - other.x_m).hypot(aside)
    }
}
