//! Random positions in the cross-section for the search.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::scene::{Room, Scene};
use super::space::Across;

/// Part of the corridor for random levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Any,
    /// Positions with y at most the interferer's.
    Left,
    /// Positions with y at least the interferer's.
    Right,
}

impl Side {
    /// Returns the part of the corridor on this side of the interferer; `None` if there is none.
    pub(super) fn part(self, scene: &Scene) -> Option<Room> {
        let (mut room, y_i) = (scene.corridor, scene.interferer.y);
        match self {
            Self::Any => {}
            Self::Left => room.high.y = room.high.y.min(y_i),
            Self::Right => room.low.y = room.low.y.max(y_i),
        }
        let is_part = self == Self::Any || scene.corridor.free().y > 0.0;
        (is_part && room.low.y <= room.high.y).then_some(room)
    }
}

/// Returns a jittered grid of `columns` x `rows` levels with walls and corners. As many in all if the room has no width or height.
pub(super) fn levels(room: &Room, rng: &mut ChaCha8Rng, columns: u32, rows: u32) -> Vec<Across> {
    let free = room.free();
    let (columns, rows) = match (free.y > 0.0, free.h > 0.0) {
        (true, true) => (columns, rows),
        (true, false) => (3 * columns, 1),
        (false, true) => (1, 3 * rows),
        (false, false) => (1, 1),
    };
    let skew = rng.random_range(1.0..=2.0);
    let mut levels = Vec::new();
    for y in shares(rng, columns, 1.0) {
        levels.extend(
            shares(rng, rows, skew)
                .into_iter()
                .map(|h| room.within(y, h)),
        );
    }
    // The plane of Tx and Rx has the shortest hops.
    if room.low.y < 0.0 && room.high.y > 0.0 {
        levels.extend((0..3).map(|i| {
            room.nearest(
                Across::new(0.0, room.within(0.0, 0.5 * f64::from(i)).h),
                0.0,
            )
        }));
    }
    levels
}

/// Returns `count` shares from 0 to 1 with some jitter, both ends included.
fn shares(rng: &mut ChaCha8Rng, count: u32, skew: f64) -> Vec<f64> {
    let last = f64::from(count.max(2) - 1);
    let mut jitter = |i: u32| match i {
        0 => 0.0,
        i if i + 1 == count => 0.0,
        _ => rng.random_range(-0.3..=0.3),
    };
    (0..count)
        .map(|i| ((f64::from(i) + jitter(i)) / last).powf(skew))
        .collect()
}

/// Draws a position: in each direction on a wall half of the time.
pub(super) fn place(room: &Room, rng: &mut ChaCha8Rng) -> Across {
    let mut share = || match rng.random_range(0..4) {
        0 => 0.0,
        1 => 1.0,
        _ => rng.random(),
    };
    room.within(share(), share())
}

/// Draws a bent chain in the cross-section: straight from a start to a bend, then straight to an end.
pub(super) fn bow(room: &Room, rng: &mut ChaCha8Rng, relays: usize) -> Vec<Across> {
    let [start, bend, end] = [(); 3].map(|()| place(room, rng));
    let turn: f64 = rng.random_range(0.05..=0.95);
    let step = 1.0 / (relays as f64 + 1.0);
    let mut share = 0.0;
    (0..relays)
        .map(|_| {
            share += step;
            let (from, to, part) = if share < turn {
                (start, bend, share / turn)
            } else {
                (bend, end, (share - turn) / (1.0 - turn))
            };
            Across::new(
                from.y + part * (to.y - from.y),
                from.h + part * (to.h - from.h),
            )
        })
        .collect()
}
