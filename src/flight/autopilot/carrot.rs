//! The target that the autopilot is given: on its way from where the drone is to the setpoint, no faster than allowed.
//!
//! It starts with the drone's own position, gains speed and loses it again by the same acceleration a: at the distance s from the
//! setpoint it is no faster than sqrt(2 a s), from which it stops there.

use crate::place::Placement;
use crate::time::{Duration, Instant};

/// Nearer than this to the setpoint it is there, m.
const THERE_M: f32 = 0.01;

/// The longest step: after a gap it goes on from where it is.
const LONGEST_STEP: Duration = Duration::from_millis(500);

/// How targets move.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pace {
    /// The greatest speed, m/s: 0.1 to 20.
    pub speed_m_s: f32,
    /// How fast that changes, m/s²: 0.1 to 5.
    pub acceleration_m_s2: f32,
}

impl Default for Pace {
    /// 5 m/s and 1 m/s².
    fn default() -> Self {
        Self {
            speed_m_s: 5.0,
            acceleration_m_s2: 1.0,
        }
    }
}

impl Pace {
    /// Whether both are in their ranges.
    pub fn is_valid(self) -> bool {
        (0.1..=20.0).contains(&self.speed_m_s) && (0.1..=5.0).contains(&self.acceleration_m_s2)
    }
}

/// A target on its way.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Carrot {
    pub(super) place: Placement,
    /// Along x, y and up, m/s.
    pub(super) velocity_m_s: [f32; 3],
    stands: bool,
    moved_at: Instant,
}

impl Carrot {
    /// One that stands where the drone is.
    pub(super) const fn at(place: Placement, now: Instant) -> Self {
        Self {
            place,
            velocity_m_s: [0.0; 3],
            stands: true,
            moved_at: now,
        }
    }

    /// Whether it stands still.
    pub(super) const fn stands(&self) -> bool {
        self.stands
    }

    /// Moves on toward `setpoint` until `now`.
    pub(super) fn advance(&mut self, now: Instant, setpoint: Placement, pace: Pace) {
        let passed = now.since(self.moved_at).min(LONGEST_STEP);
        self.moved_at = now;
        #[expect(clippy::cast_precision_loss, reason = "half a second at most")]
        let dt = passed.as_micros() as f32 * 1e-6;
        let to = [
            setpoint.x_m - self.place.x_m,
            setpoint.y_m - self.place.y_m,
            setpoint.altitude_m - self.place.altitude_m,
        ];
        let left = length(to);
        if left <= THERE_M {
            *self = Self::at(setpoint, now);
            return;
        }
        let a = pace.acceleration_m_s2;
        // A new setpoint may be to the side of where it goes: only what goes toward it counts.
        let toward = dot(self.velocity_m_s, to) / left;
        let speed = (toward.max(0.0) + a * dt)
            .min(pace.speed_m_s)
            .min(libm::sqrtf(2.0 * a * left));
        let step = speed * dt;
        if step >= left {
            *self = Self::at(setpoint, now);
            return;
        }
        self.stands = false;
        let part = step / left;
        self.place = Placement {
            x_m: self.place.x_m + to[0] * part,
            y_m: self.place.y_m + to[1] * part,
            altitude_m: self.place.altitude_m + to[2] * part,
        };
        self.velocity_m_s = to.map(|to| to / left * speed);
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.into_iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length(a: [f32; 3]) -> f32 {
    libm::sqrtf(dot(a, a))
}

#[cfg(test)]
mod tests {
    use heapless::Vec;

    use super::{Carrot, Pace, length};
    use crate::place::Placement;
    use crate::time::Instant;

    /// The way of a carrot, every 100 ms, until it stands: places and speeds.
    fn fly(from: Placement, to: Placement, pace: Pace) -> Vec<(Placement, f32), 512> {
        let mut carrot = Carrot::at(from, Instant::ZERO);
        let mut way = Vec::new();
        for i in 1..5_000 {
            carrot.advance(Instant::from_millis(100 * i), to, pace);
            way.push((carrot.place, length(carrot.velocity_m_s)))
                .expect("room");
            if carrot.stands() {
                break;
            }
        }
        way
    }

    #[test]
    fn it_gets_there_no_faster_than_allowed_and_stops_gently() {
        let pace = Pace::default();
        let to = Placement {
            y_m: 40.0,
            ..Placement::on_line(130.0, 30.0)
        };
        let way = fly(Placement::on_line(100.0, 20.0), to, pace);
        assert_eq!(way.last().map(|(place, _)| *place), Some(to));
        let mut before = 0.0;
        for (_, speed) in &way {
            assert!(*speed <= 5.0 * (1.0 + 1e-6));
            assert!(
                speed - before <= 0.1 + 1e-4,
                "1 m/s² gains 0.1 m/s in a step"
            );
            before = *speed;
        }
        let fastest = way.iter().map(|(_, speed)| *speed).fold(0.0, f32::max);
        assert!(fastest > 4.9, "51 m are enough to reach 5 m/s: {fastest}");
        // 5 m/s² · 10 s in all: 51 m take 5 s up, 5 s down, and 5 s in between.
        assert!((140..175).contains(&way.len()), "{}", way.len());
        let last_moving = way[way.len() - 2].1;
        assert!(last_moving < 0.5, "{last_moving}");
    }

    #[test]
    fn a_gap_is_no_jump() {
        let mut carrot = Carrot::at(Placement::on_line(0.0, 20.0), Instant::ZERO);
        let to = Placement::on_line(1000.0, 20.0);
        carrot.advance(Instant::from_millis(60_000), to, Pace::default());
        assert!(
            carrot.place.x_m <= 2.5,
            "half a second at the greatest speed"
        );
    }

    #[test]
    fn a_setpoint_behind_turns_it_around() {
        let mut carrot = Carrot::at(Placement::on_line(0.0, 20.0), Instant::ZERO);
        for i in 1..50 {
            carrot.advance(
                Instant::from_millis(100 * i),
                Placement::on_line(1000.0, 20.0),
                Pace::default(),
            );
        }
        let turned = carrot.place.x_m;
        let back = Placement::on_line(-50.0, 20.0);
        carrot.advance(Instant::from_millis(5_000), back, Pace::default());
        assert!(carrot.place.x_m < turned && carrot.velocity_m_s[0] < 0.0);
    }
}
