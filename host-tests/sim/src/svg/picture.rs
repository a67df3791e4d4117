//! Contents of a picture, and the layout of its plots.

use uav_relay::Mission;

/// Width of a picture, in picture units. At half a page width the smallest text is about 5 pt.
pub(super) const WIDTH: f64 = 480.0;
/// Height of a picture without a view from above and without events, in picture units.
pub(super) const HEIGHT: f64 = 330.0;

/// Left edge of the side view, in picture units. It leaves space for the vertical axis.
pub(super) const LEFT: f64 = 54.0;
/// Right edge of the side view, in picture units.
pub(super) const RIGHT: f64 = WIDTH - 14.0;
/// Upper edge of the side view, in picture units. It leaves space for the title.
pub(super) const TOP: f64 = 46.0;
/// Lower edge of the side view, in picture units. It leaves space for the legend.
pub(super) const BOTTOM: f64 = HEIGHT - 80.0;

/// Additional height of a picture with a view from above, in picture units.
pub(super) const ABOVE: f64 = 232.0;

/// Contents of a picture of a chain of N relays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// Name of the planning method, as text for the title.
    pub title_method: String,
    /// Distance from Tx to Rx, m, above 0.
    pub distance_m: f64,
    /// Interferers: transmit power, W, x from Tx toward Rx, m, and y to the right as seen from Tx, m.
    pub interferers: Vec<(f64, f64, f64)>,
    /// Earlier or estimated interferers, in the format of `interferers`. They are drawn faintly.
    pub others: Vec<(f64, f64, f64)>,
    /// Kind of the interferers in `others`: of the mission before an upload, or estimated.
    pub others_are: OtherInterferers,
    /// Relays from Tx to Rx: x along the line and altitude, m. A position that is not finite is not drawn.
    pub nodes: Vec<(f64, f64)>,
    /// Lateral limits and offsets of the relays. If given, the picture has a view from above.
    pub lateral_view: Option<LateralView>,
    /// Linear SIR of every hop from Tx to Rx. A hop is grey if its value is not finite and positive.
    pub hop_sir: Vec<f64>,
    /// Linear SIR of every hop for data toward Tx, the hop next to Tx first. Empty if there are only data toward Rx.
    pub hop_sir_back: Vec<f64>,
    /// SIR that hops need toward Tx, as a fraction (0 to 1) of the SIR that they need toward Rx.
    pub reverse: f64,
    /// Numbers, 1 to N, of silent relays. They are crossed out, and their hops are dashed.
    pub lost: Vec<usize>,
    /// Numbers, 1 to N, of relays that are not in the chain. They are crossed out, and have no hops.
    pub left_out: Vec<usize>,
    /// Events of the run in order of time: the time, s, and a short description.
    pub events: Vec<(f64, String)>,
}

/// Kind of the faintly drawn interferers in a picture: of the mission before an upload, or estimated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum OtherInterferers {
    /// Interferers of the mission that the relays had before an upload.
    #[default]
    Before,
    /// Interferer that the relays have estimated from measurements.
    NewEstimate,
}

impl OtherInterferers {
    /// Returns the label of the interferer's symbol.
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::NewEstimate => "believed",
        }
    }

    /// Returns the beginning of the tooltip for the interferer's symbol.
    pub(super) const fn tip(self) -> &'static str {
        match self {
            Self::Before => "interferer of the previous mission",
            Self::NewEstimate => "estimated interferer",
        }
    }
}

/// Lateral limits of the relays and their lateral offsets, for the view from above.
///
/// Offsets are in m, positive to the right of the line from Tx to Rx.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LateralView {
    /// Lateral limit of the relays to the left of the line, m, 0 or less.
    pub least_m: f64,
    /// Lateral limit of the relays to the right of the line, m, 0 or more.
    pub most_m: f64,
    /// Lateral offset y of each relay, from Tx to Rx, m.
    pub y_m: Vec<f64>,
}

impl LateralView {
    /// Returns true if relays must stay on the line. The view from above then shows only the interferers.
    pub(super) const fn is_line(&self) -> bool {
        self.least_m == 0.0 && self.most_m == 0.0
    }
}

/// Returns the contents of a view from above; `None` if it would show only the line from Tx to Rx.
///
/// The contents are the lateral limits in `mission` and the relays' lateral offsets `y_m`, m. `None` if relays must
/// stay on the line and no near interferer is beside it.
pub fn lateral_view(
    mission: &Mission,
    y_m: impl IntoIterator<Item = f64>,
    interferers: &[(f64, f64, f64)],
) -> Option<LateralView> {
    let lateral = mission.config().lateral;
    let distance_m = f64::from(mission.config().distance_m);
    let is_beside = |(_, x_m, y_m): &(f64, f64, f64)| near(*x_m, distance_m) && *y_m != 0.0;
    let is_seen = !lateral.is_single() || interferers.iter().any(is_beside);
    is_seen.then(|| LateralView {
        least_m: f64::from(lateral.least_m),
        most_m: f64::from(lateral.most_m),
        y_m: y_m.into_iter().collect(),
    })
}

/// Returns the coordinate of the lower edge of the legend, in picture units.
pub(super) fn bottom(picture: &Picture) -> f64 {
    if picture.lateral_view.is_some() {
        HEIGHT + ABOVE
    } else {
        HEIGHT
    }
}

/// Returns the distance from Tx to Rx, m; 1 m if it is not finite and positive and cannot be drawn.
pub(super) fn length(picture: &Picture) -> f64 {
    let distance = picture.distance_m;
    if distance.is_finite() && distance > 0.0 {
        distance
    } else {
        1.0
    }
}

/// Returns the number, from 1, and the position, m, of each relay whose position is finite.
pub(super) fn placed(picture: &Picture) -> impl Iterator<Item = (usize, (f64, f64))> {
    let nodes = picture.nodes.iter().copied();
    (1..)
        .zip(nodes)
        .filter(|(_, (x, h))| x.is_finite() && h.is_finite())
}

/// Converts a linear SIR to dB; `None` unless it is finite and positive.
pub(super) fn decibels(sir: f64) -> Option<f64> {
    (sir.is_finite() && sir > 0.0).then(|| 10.0 * sir.log10())
}

/// Returns the linear SIR of hop `number`, from 1, in its worse direction; `None` without such a hop. SIRs for data
/// toward Tx are divided by `reverse` before they are compared.
pub(super) fn counted(picture: &Picture, number: usize) -> Option<f64> {
    let at = number.checked_sub(1)?;
    let there = picture.hop_sir.get(at).copied()?;
    match picture.hop_sir_back.get(at) {
        // NaN stays NaN, which is drawn as unknown.
        Some(back) if !(back / picture.reverse >= there) => Some(back / picture.reverse),
        _ => Some(there),
    }
}

/// Returns the lowest linear SIR of all hops, each in its worse direction; `None` if no SIR is known.
pub(super) fn worst(picture: &Picture) -> Option<f64> {
    let sirs = (1..=picture.hop_sir.len())
        .filter_map(|number| counted(picture, number))
        .filter(|sir| decibels(*sir).is_some());
    sirs.reduce(f64::min)
}

/// Returns true if the relay with this number, from 1, is silent or not in the chain.
pub(super) fn is_gone(picture: &Picture, number: usize) -> bool {
    picture.lost.contains(&number) || picture.left_out.contains(&number)
}

/// Returns true if `x` is from -0.2 to 1.2 times `distance`, the distance from Tx to Rx, m.
///
/// The x axis of the picture then includes it.
pub(super) fn near(x: f64, distance: f64) -> bool {
    x >= -0.2 * distance && x <= 1.2 * distance
}
