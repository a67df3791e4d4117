//! What a mission is made of: interference, altitudes, what a relay brings along.

use crate::field::Field;
use crate::place::{CrossSection, Station};

/// The interferer (the paper's MSI), on the ground: a jammer, a base station, a licensed user.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Interferer {
    /// Transmit power, W.
    pub power_w: f32,
    /// Place along the line from Tx (0) to Rx (D), m; before Tx or beyond Rx too.
    pub x_m: f32,
    /// Distance from that line, m: to its right above 0, to its left below.
    pub y_m: f32,
}

impl Interferer {
    /// Whether it is of a power that is taken.
    pub(super) const fn is_powered(&self) -> bool {
        within(self.power_w, 1e-6, 1e9)
    }

    /// Whether it is at a place that is taken.
    pub(super) const fn is_placed(&self) -> bool {
        within(self.x_m, -1e7, 1e7) && within(self.y_m, -1e7, 1e7)
    }

    /// Whether all its numbers are within their ranges.
    pub const fn is_valid(&self) -> bool {
        self.is_powered() && self.is_placed()
    }
}

/// What degrades the hops.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Interference {
    /// One transmitter at a known place.
    Source(Interferer),
    /// Interference that is only known as a distribution along x.
    Field(Field),
    /// One transmitter, and nobody knows where. Until the relays have found it ([`crate::Settings::listen`]) they spread evenly.
    Unknown,
}

/// Which way the places of a chain are worked out, one relay after the other, and hence who begins.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Heading {
    /// From relay 1 on: Algorithm 1, where an interferer is known. The SIR of a hop tells where its *receiver* may stand.
    TowardRx,
    /// From relay N on: Algorithm 4, in a field. Where the receiver stands, its interference tells where the *sender* may.
    TowardTx,
}

/// What a relay may choose from: altitudes, or distances to the side.
///
/// ```
/// use uav_relay::Band;
///
/// let altitudes = Band { least_m: 20.0, most_m: 120.0 };
/// assert_eq!(altitudes.nearest(300.0), 120.0);
/// assert!(Band::at(20.0).is_single());
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Band {
    /// The lowest, m.
    pub least_m: f32,
    /// The highest, m: at least `least_m`.
    pub most_m: f32,
}

impl Band {
    /// No room to the side: relays stay in the vertical plane through transmitter and receiver, as in the paper.
    pub const NONE: Self = Self::at(0.0);

    /// The band that is a single number.
    pub const fn at(at_m: f32) -> Self {
        Self {
            least_m: at_m,
            most_m: at_m,
        }
    }

    /// The number in it that is nearest to `at_m`.
    pub const fn nearest(self, at_m: f32) -> f32 {
        if at_m >= self.most_m {
            self.most_m
        } else if at_m > self.least_m {
            at_m
        } else {
            self.least_m
        }
    }

    /// From the lowest to the highest, m.
    pub const fn span_m(self) -> f32 {
        self.most_m - self.least_m
    }

    /// Whether there is nothing to choose.
    pub const fn is_single(self) -> bool {
        !(self.least_m < self.most_m)
    }

    /// Whether it is a band of altitudes: in order, and within 0.1 to 1e5.
    pub(super) const fn is_of_altitudes(self) -> bool {
        within(self.least_m, 0.1, 1e5) && within(self.most_m, self.least_m, 1e5)
    }

    /// Whether it is room beside the line: in order, within -1e5 to 1e5, and the line itself in it.
    pub(super) const fn is_room_beside(self) -> bool {
        within(self.least_m, -1e5, 0.0) && within(self.most_m, 0.0, 1e5)
    }
}

/// What one relay brings along: its altitude and its transmit power.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Profile {
    /// Altitude above the ground plane that the relay holds, m: 0.1 to 1e5.
    pub altitude_m: f32,
    /// Transmit power, W: 1e-6 to 1e6.
    pub power_w: f32,
}

impl Profile {
    /// Whether both numbers are within their ranges.
    pub const fn is_valid(&self) -> bool {
        within(self.altitude_m, 0.1, 1e5) && within(self.power_w, 1e-6, 1e6)
    }

    /// The relay that flies at this altitude right above the line.
    pub const fn on_line(self) -> Station {
        Station {
            at: CrossSection::on_line(self.altitude_m),
            power_w: self.power_w,
        }
    }
}

/// Whether `value` is a number in [`least`, `most`].
pub(super) const fn within(value: f32, least: f32, most: f32) -> bool {
    value >= least && value <= most
}
