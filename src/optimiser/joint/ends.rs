//! The ends of a chain: the most that its first and last hop can meet, and the slack at Rx.

use super::outlook::Outlook;
use super::site::Room;
use crate::mission::{Interferer, Mission};
use crate::place::{CrossSection, Placement};
use crate::root::sqrt;
use crate::sir::{Sender, square};

/// What of a ceiling is aimed at.
const LITTLE: f32 = 0.999_97;

/// Halvings of the way to where a first hop is best without noise.
const HALVINGS: u8 = 24;

/// The most that a first hop into `room` meets, but for a little that leaves the relay its choice.
///
/// That is straight away from the interferer, t times as far from Tx. With U and B the squared distances along that line and across it,
/// s = B + (1 + t)^2 U + h^2, and the slope of the SIR has the sign of h^2 - t (B + U) - t^2 U - nu t s^2, which falls with t: so
/// with noise it is best nearer to Tx, and there once.
pub(super) fn first_most(mission: &Mission, interferer: &Interferer, room: Room) -> f32 {
    let m = interferer;
    let squared = square(room.band.least_m);
    let behind = m.x_m.min(0.0);
    let sum = square(m.x_m) + square(m.y_m) + 2.0 * squared;
    let across = square(m.x_m - behind) + squared;
    let most = (sum + sqrt((square(sum) - 4.0 * squared * across).max(0.0))) / (2.0 * squared);
    let mut far = -1.0 / (most - 1.0).max(1e-6);
    let noise = mission.noise_at_a_metre();
    if noise > 0.0 {
        let along = square(behind) + square(m.y_m);
        let rises = |t: f32| {
            let s = across + square(1.0 + t) * along;
            squared - t * (across - squared + along) - square(t) * along > noise * t * s * s
        };
        let (mut low, mut high) = (0.0, -far);
        for _ in 0..HALVINGS {
            let t = 0.5 * (low + high);
            if rises(t) {
                low = t;
            } else {
                high = t;
            }
        }
        far = -low;
    }
    let at = room.nearest(CrossSection {
        y_m: far * m.y_m,
        altitude_m: 0.0,
    });
    let at = at.at((far * behind).min(mission.config().distance_m));
    LITTLE * Sender::transmitter(mission).sir_at(mission, 0.0, at)
}

/// The most that the hop from a relay of `power_w` in `room` to Rx meets, but for a little.
pub(super) fn last_most(mission: &Mission, power_w: f32, room: Room) -> f32 {
    let across = room
        .nearest(CrossSection::default())
        .apart_squared(CrossSection::default());
    LITTLE * mission.receiver_gain(power_w) / across
}

/// The slack of a last relay of `power_w` in `room`, which is `at`, for `target`, and its outlook.
pub(super) fn tail(
    mission: &Mission,
    power_w: f32,
    room: Room,
    target: f32,
    at: Placement,
) -> (f32, Outlook) {
    let most = last_most(mission, power_w, room);
    let reach_m = sqrt(mission.receiver_gain(power_w) / target.min(most));
    let (slack, outlook) = Outlook::tail(reach_m, mission.config().distance_m, at);
    if target > most {
        return (
            slack,
            Outlook {
                by_target: 0.0,
                ..outlook
            },
        );
    }
    (slack, outlook)
}
