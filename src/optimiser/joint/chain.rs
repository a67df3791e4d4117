//! Chain that the joint method solves: senders, fixed altitudes, maximum SIRs of its end hops.
//!
//! A [`Seat`] has the power of a relay and its allowed lateral offsets and altitudes. A chain is stored in segments:
//! the value function at the end of each segment, and the policies of one.

use crate::features::ALTITUDE;
use crate::mission::{Interferer, Mission, Profile};
use crate::optimiser::joint::hop::Triple;
use crate::optimiser::joint::outlook::{Brief, Outlook};
use crate::optimiser::joint::site;
use crate::optimiser::joint::site::{Room, Site};
use crate::place::{CrossSection, Placement};
use crate::root::{PowerRatio, sqrt};
use crate::sir::{Sender, square, transmitter_gain};

/// Profiles of the relays of a chain: a function of a relay's index, 1 to N.
pub(super) trait SeatOf: Fn(u16) -> Seat {}

impl<F: Fn(u16) -> Seat> SeatOf for F {}

/// Chain to be solved: its mission, and the profiles of its relays.
#[derive(Clone, Copy)]
pub(super) struct Chain<'a, F> {
    pub(super) mission: &'a Mission,
    pub(super) interferer: &'a Interferer,
    seat_of: &'a F,
    gain: PowerRatio,
}

impl<'a, F: SeatOf> Chain<'a, F> {
    /// Creates the chain of `mission`; `None` for a mission with an interference field.
    pub(super) fn new(mission: &'a Mission, seat_of: &'a F) -> Option<Self> {
        Some(Self {
            mission,
            interferer: mission.interferer()?,
            seat_of,
            gain: mission.relay_gain(mission.config().common.power_w),
        })
    }

    pub(super) fn distance_m(&self) -> f32 {
        self.mission.config().distance_m
    }

    pub(super) const fn relays(&self) -> u16 {
        self.mission.relays()
    }

    pub(super) fn seat(&self, index: u16) -> Seat {
        (self.seat_of)(index)
    }

    pub(super) fn room(&self, index: u16) -> Room {
        self.seat(index).room
    }

    /// Returns the largest x of a relay, m, that leaves the relays toward Rx space for their separation.
    ///
    /// `end_m` is the same limit for the previous relay (toward Tx), m, and `step` the minimum difference in x between
    /// these two relays, m.
    pub(super) fn end_after(&self, end_m: f32, step: f32) -> f32 {
        (end_m + step).min(self.distance_m())
    }

    /// Returns the sender of the hop to relay `index`: Tx, or relay `index` - 1 at `from`.
    pub(super) fn sender(&self, index: u16, from: Placement) -> Sender {
        if index <= 1 {
            return Sender::transmitter(self.mission);
        }
        let power_w = self.seat(index - 1).power_w;
        let common = power_w.to_bits() == self.mission.config().common.power_w.to_bits();
        Sender {
            cross_section: from.cross_section(),
            gain: if common {
                self.gain
            } else {
                self.mission.relay_gain(power_w)
            },
        }
    }

    /// Returns c, the target SIR divided by the sender's gain, for the hop to relay `index`.
    ///
    /// The gain is the sender's power divided by the interferer's power. A larger c means a shorter hop. With noise, c
    /// includes the factor 1 + noise / interference at the sender's position `from`, because the position of relay
    /// `index` is not known yet.
    pub(super) fn loudness(&self, index: u16, from: Placement, target: f32) -> f32 {
        let m = self.interferer;
        let s = square(m.x_m - from.x_m) + square(m.y_m - from.y_m) + square(from.altitude_m);
        let noise = self.mission.noise_at_a_metre();
        self.sender(index, from).gain.ratio(target) * (1.0 + noise * s)
    }

    /// Returns the fixed altitude of relay `index`, m. `None` if the joint method chooses the altitude of this relay,
    /// or if the mission has a single altitude for all relays.
    pub(super) fn held_at(&self, index: u16) -> Option<f32> {
        let Room { band, .. } = self.room(index);
        let free = !self.mission.config().band.is_single();
        (free && band.is_single()).then_some(band.least_m)
    }

    pub(super) fn holds(&self) -> bool {
        (1..=self.relays()).any(|index| self.held_at(index).is_some())
    }

    /// Returns the altitude of relay `index`, m, interpolated between the relays with a fixed altitude.
    ///
    /// Between Tx and the first of these relays, and between the last one and Rx, the altitude is constant if `level`
    /// is true. Otherwise it falls to the lowest permitted altitude at Tx and at Rx.
    pub(super) fn altitude_between(&self, index: u16, level: bool) -> f32 {
        let relays = self.relays();
        let held = |index: u16| Some((index, self.held_at(index)?));
        let before = (1..=index).rev().find_map(held);
        let after = (index..=relays).find_map(held);
        let least_m = self.mission.config().band.least_m;
        let end = |at, other: Option<(u16, f32)>| {
            (at, other.filter(|_| level).map_or(least_m, |(_, h)| h))
        };
        let (from, low) = before.unwrap_or(end(0, after));
        let (to, high) = after.unwrap_or(end(relays + 1, before));
        let share = f32::from(index - from) / f32::from((to - from).max(1));
        low + share * (high - low)
    }

    /// Returns relay `index` as the receiver of a hop from `from`. `room` has the relay's permitted lateral offsets and
    /// altitudes.
    pub(super) fn link(&self, index: u16, from: Placement, room: Room) -> Site<'a> {
        let sender = self.sender(index, from);
        Site::new(self.mission, self.interferer, sender, index <= 1, room)
    }

    /// Returns the chain's slack for `target`, m, with its derivatives by the last relay's position `at`.
    ///
    /// The slack is the maximum length of the last hop for `target`, minus the length of the hop from `at` to Rx.
    pub(super) fn tail(&self, target: f32, at: Placement) -> (f32, Outlook) {
        let Seat { room, power_w } = self.seat(self.relays());
        let most = site::last_most(self.mission, power_w, room);
        let reach_m = sqrt(self.mission.receiver_gain(power_w) / target.min(most));
        let (slack, mut outlook) = Outlook::tail(reach_m, self.distance_m(), at);
        if target > most {
            outlook.by_target = 0.0;
        }
        (slack, outlook)
    }

    /// Returns an upper bound on the chain's SIR, in ln(SIR). It is the smaller of the maximum SIRs of the first and
    /// the last hop.
    pub(super) fn ceiling(&self) -> f32 {
        let Seat { room, power_w } = self.seat(self.relays());
        let first = self.room(1);
        let first = site::first_most(self.mission, self.interferer, first);
        let last = site::last_most(self.mission, power_w, room);
        libm::logf(first.min(last).clamp(1e-30, 1e30))
    }

    /// Returns the lowest target, in ln(SIR), at which every hop has a finite maximum length. This target is just above
    /// the largest gain of a hop. At a lower target, the maximum length of a hop that starts beyond the interferer
    /// could be infinite.
    pub(super) fn floor(&self) -> f32 {
        let own = (1..self.relays()).map(|index| self.seat(index).power_w);
        let relay = own.fold(0.0, f32::max);
        let gain = self.mission.relay_gain(relay).value();
        libm::logf(self.mission.tx_gain().value().max(gain)) + 0.01
    }
}

/// Gains of all hops of a chain, toward Rx and toward Tx. The SIR of a hop is its gain, times the inverse interference
/// at the receiver, divided by the squared length of the hop. For a hop to Rx or to Tx, the gain includes the inverse
/// interference.
///
/// Lengths are in units of the distance D from Tx to Rx. The gains can also be stored as logarithms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    /// Position (x, y, h) of the interferer, in units of the distance from Tx to Rx.
    pub(super) source: Triple,
    /// Receiver noise divided by the interferer's power received at the distance D (nu).
    pub(super) noise: f32,
    relay: f32,
    to_rx: f32,
    to_tx: f32,
    from_tx: f32,
    from_rx: f32,
}

impl Gains {
    pub(super) const NONE: Self = Self {
        source: [0.0; 3],
        noise: 0.0,
        relay: 0.0,
        to_rx: 0.0,
        to_tx: 0.0,
        from_tx: 0.0,
        from_rx: 0.0,
    };

    /// Returns the gains for relays of `power_w` watts. `stored` converts each gain to the form in which it is stored,
    /// for example its logarithm.
    pub(super) fn new(
        chain: &Chain<'_, impl SeatOf>,
        power_w: f32,
        stored: impl Fn(f32) -> f32,
    ) -> Self {
        let (mission, interferer, d) = (chain.mission, chain.interferer, chain.distance_m());
        let on_ground = |gain: f32| stored(gain / d / d);
        Self {
            source: [interferer.x_m / d, interferer.y_m / d, 0.0],
            noise: mission.noise_at_a_metre() * d * d,
            relay: stored(mission.relay_gain(power_w).value()),
            to_rx: on_ground(mission.receiver_gain(power_w)),
            to_tx: on_ground(transmitter_gain(mission, power_w)),
            from_tx: stored(mission.tx_gain().value()),
            from_rx: stored(Sender::receiver(mission).gain.value()),
        }
    }

    /// Returns the gains of hop `k` for data toward Rx and toward Tx. `k` is 1 (hop from Tx) to N + 1 (hop to Rx), and
    /// `relays` is N. `sent_by` gets a gain and the index of the sending relay, and returns the gain for that relay's
    /// transmit power.
    pub(super) fn of(&self, k: u16, relays: u16, sent_by: impl Fn(f32, u16) -> f32) -> [f32; 2] {
        let there = match k {
            1 => self.from_tx,
            _ if k > relays => sent_by(self.to_rx, k - 1),
            _ => sent_by(self.relay, k - 1),
        };
        let back = match k {
            _ if k > relays => self.from_rx,
            1 => sent_by(self.to_tx, k),
            _ => sent_by(self.relay, k),
        };
        [there, back]
    }
}

/// Returns the lateral offset and altitude at which a relay above or beside Rx receives Tx best. The function tries the
/// lowest and the highest altitude in `room`, each with three lateral offsets: the two limits in `room`, and 0.
pub(super) fn far_off(chain: &Chain<'_, impl SeatOf>, room: Room) -> CrossSection {
    let tx = Sender::transmitter(chain.mission);
    let mut best = (0.0, CrossSection::default());
    for y_m in [room.lateral.least_m, 0.0, room.lateral.most_m] {
        for altitude_m in [room.band.least_m, room.band.most_m] {
            let at = room.nearest(CrossSection { y_m, altitude_m });
            let sir = tx.sir_at(chain.mission, 0.0, at.at(chain.distance_m()));
            if sir > best.0 {
                best = (sir, at);
            }
        }
    }
    best.1
}

pub(super) const SEGMENT: usize = 10;
/// Number of relays whose computed moves are in memory at one time. It is one segment, or 0 without the feature
/// `altitude`.
pub(super) const STAGES: usize = if ALTITUDE { SEGMENT } else { 0 };
pub(super) const SEGMENT_RELAYS: u16 = 10;

/// Stored state of the solver for one segment, which is ten consecutive relays. It has the x of the last relay before
/// the segment, and derivatives of the chain's slack (length by which it reaches beyond Rx). The derivatives are by the
/// position of the segment's last relay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    /// x of the last relay before this segment, m.
    pub(super) x_m: f32,
    /// First derivatives of the chain's slack (length by which it reaches beyond Rx), m/m. They are by the x, y and h
    /// of the segment's last relay.
    pub(super) slope: Triple,
    /// Second derivatives of the chain's slack (length by which it reaches beyond Rx), 1/m. They are by the coordinates
    /// of the segment's last relay. The order is xx, xy, xh, yy, yh, hh.
    pub(super) bend: [f32; 6],
}

impl Mark {
    pub(super) const NONE: Self = Self {
        x_m: 0.0,
        slope: [0.0; 3],
        bend: [0.0; 6],
    };

    pub(super) fn look(&mut self, outlook: &Outlook) {
        let [[xx, xy, xh], [_, yy, yh], [_, _, hh]] = outlook.bend;
        self.slope = outlook.slope;
        self.bend = [xx, xy, xh, yy, yh, hh];
    }

    pub(super) fn outlook(&self) -> Outlook {
        let [xx, xy, xh, yy, yh, hh] = self.bend;
        Outlook {
            slope: self.slope,
            bend: [[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]],
            ..Outlook::default()
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    pub(super) x_m: f32,
    pub(super) policy: Brief,
}

impl Stage {
    pub(super) const NONE: Self = Self {
        x_m: 0.0,
        policy: Brief::NONE,
    };
}

pub(super) fn last_of(mission: &Mission) -> u8 {
    let last = (usize::from(mission.relays()) - 1) / SEGMENT;
    u8::try_from(last).unwrap_or(u8::MAX)
}

/// Returns the relays of a segment. Each item has the relay's number within the segment, from 0, and its index in the
/// chain.
pub(super) fn relays_of(segment: u8, relays: u16) -> impl DoubleEndedIterator<Item = (usize, u16)> {
    let first = u16::from(segment) * SEGMENT_RELAYS;
    // Counted in u16 at both ends, since zipping two ranges backward may panic.
    (0..SEGMENT_RELAYS)
        .map(move |k| (usize::from(k), first + 1 + k))
        .filter(move |(_, index)| *index <= relays)
}

/// Profile of one relay for the joint method: power, permitted lateral offsets and permitted altitudes.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Seat {
    /// Permitted lateral offsets and altitudes of the relay.
    pub room: Room,
    /// Transmit power of the relay, W.
    pub power_w: f32,
}

impl Seat {
    /// Returns the profile that the mission gives to relays without a profile of their own.
    pub const fn common(mission: &Mission) -> Self {
        Self {
            room: Room::of(mission),
            power_w: mission.config().common.power_w,
        }
    }

    /// Returns the profile of a relay with the altitude and power `own`. The relay keeps this altitude if `holds` is
    /// true; otherwise its altitude is optimised.
    pub const fn of(mission: &Mission, own: Profile, holds: bool) -> Self {
        let room = Room::of(mission);
        Self {
            room: if holds {
                room.at_altitude(own.altitude_m)
            } else {
                room
            },
            power_w: own.power_w,
        }
    }
}
