//! Explanations of the theorems' cases for the user.

use uav_relay::planning::single::{aside, theorems};

/// Explanation for an interferer at Rx.
const DROWNED: &str =
    "the interferer stands at Rx, where no signal is received wherever the drone is";

/// Explanation for an interferer at Tx.
const LEVEL: &str = "the drone goes right above Rx: the interferer stands at Tx, so the first hop is the same everywhere, and the \
                     second is best there";

/// Explains a case of Theorem 1.
pub(super) fn along_x(case: theorems::PlaceCase) -> &'static str {
    use theorems::PlaceCase;
    match case {
        PlaceCase::AboveTx => {
            "the drone stays right above Tx: its first hop is the weaker one even there, and weaker anywhere else"
        }
        PlaceCase::Crossing => {
            "the drone goes where both hops are equally good: nearer to Tx the second would be worse, nearer to Rx the first"
        }
        PlaceCase::AboveRx => {
            "the drone goes right above Rx: its first hop is the better one even there, and only the second has to improve"
        }
        PlaceCase::BeforeValley => {
            "the drone goes to where both hops are equally good, before the interference is worst, or past it all to right above Rx, \
             whichever is better"
        }
        PlaceCase::OverValley => {
            "the drone goes right above Rx: its first hop is the better one even where the interference is worst"
        }
        PlaceCase::Hilltop => {
            "the drone goes where its first hop is best: that is the weaker one even there"
        }
        PlaceCase::BeyondHill => {
            "the drone goes beyond the best place of its first hop, to where both hops are equally good"
        }
        PlaceCase::HillAboveRx => {
            "the drone goes right above Rx: the interferer is behind Tx, and the first hop the better one all the way"
        }
        PlaceCase::Level => LEVEL,
        PlaceCase::SecondHill => {
            "the drone goes past the worst interference: to where its first hop is best again, or both hops are equally good"
        }
        PlaceCase::Drowned => DROWNED,
    }
}

/// Explains a case of Theorem 2.
pub(super) fn upward(case: theorems::AltitudeCase) -> &'static str {
    use theorems::AltitudeCase;
    match case {
        AltitudeCase::BothFall => {
            "the drone flies as low as it may: both hops get worse with the altitude"
        }
        AltitudeCase::Crossing => {
            "the drone climbs until both hops are equally good: lower the interference harms the first, higher the way to Rx the second"
        }
        AltitudeCase::End => {
            "the drone flies as low or as high as it may, whichever is better: nowhere between are both hops equally good"
        }
        AltitudeCase::Drowned => DROWNED,
    }
}

/// Returns the number and explanation of a case of Theorem 3.
pub(super) fn anywhere_above(case: theorems::FreeCase) -> (u8, String) {
    match case {
        theorems::FreeCase::Lowest(case) => (1, format!("as low as may be, {}", along_x(case))),
        theorems::FreeCase::Highest(case) => (2, format!("as high as may be, {}", along_x(case))),
        theorems::FreeCase::AboveRx(case) => (3, format!("right above Rx, {}", upward(case))),
        theorems::FreeCase::Touching => (
            4,
            "the drone goes between the lowest and the highest altitude, to where any step that helps one hop harms the other"
                .to_owned(),
        ),
    }
}

/// Explains a case of one relay beside the line.
pub(super) fn sideways(case: aside::AsideCase) -> &'static str {
    use aside::{AsideCase, EdgeCoordinate};
    match case {
        AsideCase::Touching => {
            "the drone flies low and goes aside, away from the interferer, to where any step that helps one hop harms the other"
        }
        AsideCase::Hilltop => {
            "the drone flies low and goes where its first hop is best: that is the weaker one even there"
        }
        AsideCase::AboveRx => {
            "the drone goes right above Rx, as low as it may: its first hop is the better one even there"
        }
        AsideCase::Edge(EdgeCoordinate::Along) => {
            "the drone goes as far aside, and as high or low, as it may, and along the line to where both hops are best together"
        }
        AsideCase::Edge(EdgeCoordinate::Across) => {
            "the drone stays at Tx or Rx, as high or low as it may, and goes aside to where both hops are best together"
        }
        AsideCase::Edge(EdgeCoordinate::Upward) => {
            "the drone stays at Tx or Rx, as far aside as it may, and climbs to where both hops are best together"
        }
        AsideCase::Level => LEVEL,
        AsideCase::Inside => {
            "the drone goes to the best place within its room that a search finds, as low or as high as it may"
        }
        AsideCase::Wall => {
            "the drone goes to a wall of its room, to where any step along it that helps one hop harms the other"
        }
        AsideCase::Drowned => DROWNED,
    }
}
