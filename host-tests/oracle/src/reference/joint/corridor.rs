//! Corridor open to relays, and positions in it.

/// Region open to relays, seen along Tx-Rx.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corridor {
    /// Lowest altitude above the ground of Tx, Rx and the interferer, m, > 0.
    pub least_m: f64,
    /// Highest altitude, m, >= `least_m`.
    pub most_m: f64,
    /// Least y, m; seldom > 0.
    pub left_m: f64,
    /// Largest y, m, >= `left_m`.
    pub right_m: f64,
}

impl Corridor {
    /// Creates the plane above Tx-Rx, within a band of altitudes.
    pub const fn plane(least_m: f64, most_m: f64) -> Self {
        Self {
            least_m,
            most_m,
            left_m: 0.0,
            right_m: 0.0,
        }
    }

    /// Returns true if a position is inside, with a tolerance of `slack_m`.
    pub fn contains(&self, place: &Place, slack_m: f64) -> bool {
        let within =
            |low: f64, value: f64, high: f64| (low - slack_m..=high + slack_m).contains(&value);
        within(self.least_m, place.altitude_m, self.most_m)
            && within(self.left_m, place.y_m, self.right_m)
    }
}

/// A relay with a fixed lateral position and altitude, inside the corridor or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// Index of the relay in the link, from 0.
    pub relay: usize,
    /// Offset from the Tx-Rx plane, m.
    pub y_m: f64,
    /// Altitude, m, > 0.
    pub altitude_m: f64,
}

impl Hold {
    /// Returns the corridor of one relay: a single point if its cross-section is fixed.
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

/// Position of a relay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Coordinate along the line from Tx to Rx, m, in [0, D].
    pub x_m: f64,
    /// Offset from the Tx-Rx plane, m, with the sign of the interferer's `y_i`.
    pub y_m: f64,
    /// Altitude, m.
    pub altitude_m: f64,
}

impl Place {
    /// Creates a position in the plane above Tx-Rx.
    pub const fn in_plane(x_m: f64, altitude_m: f64) -> Self {
        Self {
            x_m,
            y_m: 0.0,
            altitude_m,
        }
    }

    /// Returns the distance to another position, m.
    pub fn distance_m(&self, other: &Self) -> f64 {
        let aside = (self.y_m - other.y_m).hypot(self.altitude_m - other.altitude_m);
        (self.x_m - other.x_m).hypot(aside)
    }
}
