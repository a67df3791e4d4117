//! What a picture shows, and where in it the plot is.

use uav_relay::Mission;

/// Size of the picture in its own units; at half a page wide the smallest text is still about 5 pt.
pub(super) const WIDTH: f64 = 480.0;
pub(super) const HEIGHT: f64 = 330.0;

/// The plot inside it, edge by edge: room for the title, the vertical axis, and the legend.
pub(super) const LEFT: f64 = 54.0;
pub(super) const RIGHT: f64 = WIDTH - 14.0;
pub(super) const TOP: f64 = 46.0;
pub(super) const BOTTOM: f64 = HEIGHT - 80.0;

/// How much higher the view from above makes the picture.
pub(super) const ABOVE: f64 = 232.0;

/// What is shown of a chain of N relays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// How the places were found, for the title; any text.
    pub title_method: String,
    /// Distance from Tx to Rx, in metres, above 0.
    pub distance_m: f64,
    /// Every interferer: transmit power in watts, place along x and offset y on the ground, both in metres.
    pub interferers: Vec<(f64, f64, f64)>,
    /// Those that are not there: drawn faint, where the plot holds them.
    pub others: Vec<(f64, f64, f64)>,
    /// What these are.
    pub others_are: Others,
    /// The relays from Tx to Rx: place along x and altitude, both in metres. One that is not finite is left out.
    pub nodes: Vec<(f64, f64)>,
    /// Where relays may stand beside the line: the chain is drawn from above, too.
    pub room: Option<Room>,
    /// Linear SIR of every hop, one more than there are relays in the chain, above 0; any other value is drawn grey and without a number.
    pub hop_sir: Vec<f64>,
    /// The relays that went silent, each 1 to N: they are crossed out, and their hops are dashed.
    pub lost: Vec<usize>,
    /// The relays that are not in the chain any more, each 1 to N: they are crossed out, and the hops pass them by.
    pub left_out: Vec<usize>,
    /// What happened to the chain: when, s, and in a few words. In order.
    pub events: Vec<(f64, String)>,
}

/// Interferers that are not there.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Others {
    /// Those of the mission that was flown before.
    #[default]
    Before,
    /// The one that the relays believe in.
    Believed,
}

impl Others {
    /// What stands beside the marker.
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::Believed => "believed",
        }
    }

    /// What the marker says of itself.
    pub(super) const fn tip(self) -> &'static str {
        match self {
            Self::Before => "interferer of the mission before",
            Self::Believed => "interferer that the relays believe in",
        }
    }
}

/// The room beside the line, and who stands where in it; y is to the right of x as seen from above, in metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Room {
    /// Its left edge, 0 or less.
    pub least_m: f64,
    /// Its right edge, 0 or more.
    pub most_m: f64,
    /// y of each relay, from Tx to Rx.
    pub y_m: Vec<f64>,
}

impl Room {
    /// Returns true if relays are to stay on the line: then the view from above is there for the interferers.
    pub(super) const fn is_line(&self) -> bool {
        self.least_m == 0.0 && self.most_m == 0.0
    }
}

/// Returns the room beside the line in `mission`, with relays at these y, m. `None` where there is none and no interferer is beside the line
/// either: from the side each would seem to be below the chain.
pub fn room(
    mission: &Mission,
    y_m: impl IntoIterator<Item = f64>,
    interferers: &[(f64, f64, f64)],
) -> Option<Room> {
    let lateral = mission.config().lateral;
    let distance_m = f64::from(mission.config().distance_m);
    let is_beside = |(_, x_m, y_m): &(f64, f64, f64)| near(*x_m, distance_m) && *y_m != 0.0;
    let is_seen = !lateral.is_single() || interferers.iter().any(is_beside);
    is_seen.then(|| Room {
        least_m: f64::from(lateral.least_m),
        most_m: f64::from(lateral.most_m),
        y_m: y_m.into_iter().collect(),
    })
}

/// Where the legend ends.
pub(super) fn bottom(picture: &Picture) -> f64 {
    if picture.room.is_some() {
        HEIGHT + ABOVE
    } else {
        HEIGHT
    }
}

/// The distance from Tx to Rx, or 1 m where it makes no sense: a picture has to have a width.
pub(super) fn length(picture: &Picture) -> f64 {
    let distance = picture.distance_m;
    if distance.is_finite() && distance > 0.0 {
        distance
    } else {
        1.0
    }
}

/// The relays that have a place, each with its number.
pub(super) fn placed(picture: &Picture) -> impl Iterator<Item = (usize, (f64, f64))> {
    let nodes = picture.nodes.iter().copied();
    (1..)
        .zip(nodes)
        .filter(|(_, (x, h))| x.is_finite() && h.is_finite())
}

/// An SIR in dB, if it is one that has a logarithm.
pub(super) fn decibels(sir: f64) -> Option<f64> {
    (sir.is_finite() && sir > 0.0).then(|| 10.0 * sir.log10())
}

/// The SIR of the chain's worst hop, linear.
pub(super) fn worst(picture: &Picture) -> Option<f64> {
    let sirs = picture
        .hop_sir
        .iter()
        .copied()
        .filter(|sir| decibels(*sir).is_some());
    sirs.reduce(f64::min)
}

/// Whether a relay is crossed out.
pub(super) fn is_gone(picture: &Picture, number: usize) -> bool {
    picture.lost.contains(&number) || picture.left_out.contains(&number)
}

/// Returns true if the x axis is stretched to hold an interferer: it is no more than a fifth of the distance off the chain.
pub(super) fn near(x: f64, distance: f64) -> bool {
    x >= -0.2 * distance && x <= 1.2 * distance
}
