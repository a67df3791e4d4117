//! Contents of a picture, and the layout of its plots.

use uav_relay::Mission;

/// Size in picture units; at half a page width the smallest text is about 5 pt.
pub(super) const WIDTH: f64 = 480.0;
pub(super) const HEIGHT: f64 = 330.0;

/// Edges of the plot, inside the title, the vertical axis and the legend.
pub(super) const LEFT: f64 = 54.0;
pub(super) const RIGHT: f64 = WIDTH - 14.0;
pub(super) const TOP: f64 = 46.0;
pub(super) const BOTTOM: f64 = HEIGHT - 80.0;

/// Additional height of a picture with a top view.
pub(super) const ABOVE: f64 = 232.0;

/// Contents of a picture of N relays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// Planning method, for the title; any text.
    pub title_method: String,
    /// Distance from Tx to Rx, m, above 0.
    pub distance_m: f64,
    /// Interferers: transmit power, W, position x and offset y on the ground, m.
    pub interferers: Vec<(f64, f64, f64)>,
    /// Former or estimated interferers, drawn faint if they are in the plot's range.
    pub others: Vec<(f64, f64, f64)>,
    /// Meaning of the interferers in `others`: the previous mission, or the estimate.
    pub others_are: OtherInterferers,
    /// Relays from Tx to Rx: x and altitude, m; non-finite positions are omitted.
    pub nodes: Vec<(f64, f64)>,
    /// Room beside the line; adds a top view.
    pub room: Option<Room>,
    /// Linear SIR of every hop from Tx to Rx; values that are not finite and positive are drawn grey.
    pub hop_sir: Vec<f64>,
    /// Linear SIR of every hop on the way back, from Tx to Rx; empty if only the way to Rx counts.
    pub hop_sir_back: Vec<f64>,
    /// SIR that a hop needs on the way back relative to the way to Rx, 0 to 1.
    pub reverse: f64,
    /// Silent relays, each 1 to N: crossed out, with dashed hops.
    pub lost: Vec<usize>,
    /// Relays outside the chain, each 1 to N: crossed out, without hops.
    pub left_out: Vec<usize>,
    /// Events in order: time, s, and a short description.
    pub events: Vec<(f64, String)>,
}

/// Kind of interferers that are not actually present.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum OtherInterferers {
    /// Interferers of the previous mission.
    #[default]
    Before,
    /// Interferer estimated by the relays.
    NewEstimate,
}

impl OtherInterferers {
    /// Returns the label of the marker.
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::NewEstimate => "believed",
        }
    }

    /// Returns the tooltip of the marker.
    pub(super) const fn tip(self) -> &'static str {
        match self {
            Self::Before => "interferer of the previous mission",
            Self::NewEstimate => "estimated interferer",
        }
    }
}

/// Permitted range beside the line, and the relays' y, m, positive to the right of x in the top view.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Room {
    /// Left edge, m, 0 or less.
    pub least_m: f64,
    /// Right edge, m, 0 or more.
    pub most_m: f64,
    /// Lateral offset y of each relay, from Tx to Rx, m.
    pub y_m: Vec<f64>,
}

impl Room {
    /// Returns true if relays must stay on the line; the top view then only shows the interferers.
    pub(super) const fn is_line(&self) -> bool {
        self.least_m == 0.0 && self.most_m == 0.0
    }
}

/// Returns the room beside the line in `mission` with relays at `y_m`.
///
/// `None` if there is none and no near interferer is beside the line: then a top view would add nothing.
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

/// Returns the bottom of the legend.
pub(super) fn bottom(picture: &Picture) -> f64 {
    if picture.room.is_some() {
        HEIGHT + ABOVE
    } else {
        HEIGHT
    }
}

/// Returns the distance from Tx to Rx; 1 m if it is not finite and positive, to keep a width.
pub(super) fn length(picture: &Picture) -> f64 {
    let distance = picture.distance_m;
    if distance.is_finite() && distance > 0.0 {
        distance
    } else {
        1.0
    }
}

/// Returns the relays that have a position, with their numbers.
pub(super) fn placed(picture: &Picture) -> impl Iterator<Item = (usize, (f64, f64))> {
    let nodes = picture.nodes.iter().copied();
    (1..)
        .zip(nodes)
        .filter(|(_, (x, h))| x.is_finite() && h.is_finite())
}

/// Converts an SIR to dB; `None` unless it is finite and positive.
pub(super) fn decibels(sir: f64) -> Option<f64> {
    (sir.is_finite() && sir > 0.0).then(|| 10.0 * sir.log10())
}

/// Returns the linear SIR of hop `number`, from 1, that counts: the smaller of both directions, the way back divided by `reverse`.
pub(super) fn counted(picture: &Picture, number: usize) -> Option<f64> {
    let at = number.checked_sub(1)?;
    let there = picture.hop_sir.get(at).copied()?;
    match picture.hop_sir_back.get(at) {
        // NaN stays NaN, which is drawn as unknown.
        Some(back) if !(back / picture.reverse >= there) => Some(back / picture.reverse),
        _ => Some(there),
    }
}

/// Returns the lowest linear SIR that counts, of the hops with a known one.
pub(super) fn worst(picture: &Picture) -> Option<f64> {
    let sirs = (1..=picture.hop_sir.len())
        .filter_map(|number| counted(picture, number))
        .filter(|sir| decibels(*sir).is_some());
    sirs.reduce(f64::min)
}

/// Returns true if the relay is silent or outside the chain.
pub(super) fn is_gone(picture: &Picture, number: usize) -> bool {
    picture.lost.contains(&number) || picture.left_out.contains(&number)
}

/// Returns true if `x` is at most a fifth of the distance beyond the chain. The x axis then includes it.
pub(super) fn near(x: f64, distance: f64) -> bool {
    x >= -0.2 * distance && x <= 1.2 * distance
}
