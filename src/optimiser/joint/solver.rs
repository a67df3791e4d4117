//! A whole chain by the joint method, without a message: what every relay that holds the mission works out by itself.
//!
//! Differential dynamic programming keeps a policy for every relay between the pass back and the pass forward. Here a relay takes six
//! bytes: the chain is cut into segments, of each of which only the outlook at its end is kept, and the policies of one segment are
//! worked out again when the pass forward comes to it.

use core::task::Poll;

use super::ascent::{Ascent, AscentStep};
use super::axis::Triple;
use super::cells::Cell;
use super::link::{self, MARGIN, Room, Site, minus, triple};
use super::outlook::Outlook;
use super::policy::Brief;
use super::seek::Seek;
use super::starts::Start;
use crate::mission::{Interferer, Mission, Profile};
use crate::optimiser::search::Infeasible;
use crate::optimiser::spacing::Hop;
use crate::optimiser::spacing::Stand;
use crate::place::{CrossSection, Placement};
use crate::power_ratio::PowerRatio;
use crate::root::sqrt;
use crate::sir::Sender;

/// Relays in a segment.
const SEGMENT: usize = 10;
/// How many of them are held; without the feature `altitude` nobody solves a chain.
const STAGES: usize = if cfg!(feature = "altitude") {
    SEGMENT
} else {
    0
};
/// The same number as of a segment, to count relays by.
const SEGMENT_RELAYS: u16 = 10;

/// Relays in one portion of a pass that changes nothing.
const PLAIN: u16 = 20;

/// How close to the optimum a start is judged, in ln gamma.
const JUDGED: f32 = 4e-6;

/// What penalty a chain may have that is judged, in parts of D.
const FORGIVEN: f32 = 5e-5;

/// How close to the ceiling of the first or the last hop is close enough, in ln gamma.
const CEILING: f32 = 5e-5;

/// How far above that ceiling the other hops are when a chain is probed first, in ln gamma.
const PROBED: f32 = 3e-4;

/// Most relays of a chain that is polished, but where some keep to an altitude: the way of the others has kinks there.
const POLISHED: u16 = 5;

/// How often the moves of a polish are halved, and the first of them, as a part of the room.
const HALVINGS: u16 = 12;
const FIRST_MOVE: f32 = 0.25;

/// What a move has to gain, in ln gamma, and how many are taken.
const GAIN: f32 = 2e-5;
const MOVES: u8 = 200;

/// What one relay brings along, as far as it is known.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Seat {
    /// Where it may fly across the line.
    pub room: Room,
    /// Its transmit power, W.
    pub power_w: f32,
}

impl Seat {
    /// That of a relay which was given nothing of its own.
    pub const fn common(mission: &Mission) -> Self {
        Self {
            room: Room::of(mission),
            power_w: mission.config().common.power_w,
        }
    }

    /// That of a relay which holds `own`, and its altitude if it `holds` that.
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

/// The chain up to the end of a segment.
#[derive(Clone, Copy, Debug, Default)]
struct Mark {
    /// Where the relay before the segment is along x, m.
    x_m: f32,
    /// What the last relay of the segment sees, but for what a pass back alone has to know.
    slope: Triple,
    bend: [f32; 6],
}

impl Mark {
    fn look(&mut self, outlook: &Outlook) {
        let [[xx, xy, xh], [_, yy, yh], [_, _, hh]] = outlook.bend;
        self.slope = outlook.slope;
        self.bend = [xx, xy, xh, yy, yh, hh];
    }

    fn outlook(&self) -> Outlook {
        let [xx, xy, xh, yy, yh, hh] = self.bend;
        Outlook {
            slope: self.slope,
            bend: [[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]],
            ..Outlook::default()
        }
    }
}

/// A relay of the segment at hand.
#[derive(Clone, Copy, Debug, Default)]
struct Stage {
    x_m: f32,
    policy: Brief,
}

/// A pass forward.
#[derive(Clone, Copy, Debug, Default)]
struct ForwardPass {
    /// Relays that are behind it.
    done: u16,
    /// Where the last of them is, and where it was.
    from: Placement,
    old: Placement,
    penalty: f32,
    /// The last place that the next relay may take, m.
    end_m: f32,
    /// Whether a relay has to hold back.
    holds_back: bool,
}

/// What is being worked out.
#[derive(Clone, Copy, Debug)]
enum Work {
    /// The next start.
    Begin,
    /// The highest target of the chain as it is, and what for.
    Seek(Seek, Purpose),
    /// The chain as it is for one target, to be kept.
    Settle(f32, Purpose),
    /// Whether the relays of this segment, the last of which is to stand there, can hold back as a target is met.
    Stand(u8, f32, Seek, Purpose),
    /// The next move of a chain that meets this.
    Polish(f32),
    /// A pass back, at this segment.
    Back(u8),
    /// A pass forward with a part of the step and a target; to be kept if `true`.
    Forward(f32, f32, bool),
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Purpose {
    /// A chain to begin with, of the shape of the start.
    Start,
    /// A higher target during an ascent.
    Raise,
    /// The slack where less of it counts.
    Tighten,
    /// What an ascent has come to.
    Judge,
    /// What that comes to by the rules of the sweep.
    Last,
    /// Whether the chain has all that can be had, by the same rules.
    Probe,
    /// Whether one relay's move gains something, by the same rules.
    Move,
}

impl Purpose {
    /// Whether relays go by the rules of the sweep.
    const fn is_sweep(self) -> bool {
        matches!(self, Self::Last | Self::Probe | Self::Move)
    }
}

/// A chain being solved, for at most `RELAYS` relays; `SEGMENTS` is at least a tenth of that.
#[derive(Clone, Debug)]
pub struct Solver<const RELAYS: usize, const SEGMENTS: usize> {
    number: u8,
    start: Start,
    /// The best so far: its target in ln gamma, and the number of its start.
    best: Option<(f32, u8)>,
    /// Whether the best start is done once more, since the chain that is kept came of another.
    again: bool,
    ascent: Ascent,
    work: Work,
    pass: ForwardPass,
    /// Whether relays have to hold back for what was found.
    holds_back: bool,
    /// Whether any start came up against the least separation.
    walled: bool,
    /// Which move of the polish is tried, how many were taken, and where its relay was.
    moving: u16,
    moved: u8,
    kept: Cell,
    /// The segment whose policies are at hand.
    held: Option<u8>,
    stages: [Stage; STAGES],
    marks: [Mark; SEGMENTS],
    cells: [Cell; RELAYS],
}

/// What the passes have in common.
#[derive(Clone, Copy)]
struct SolverContext<'a, F> {
    mission: &'a Mission,
    interferer: &'a Interferer,
    seat_of: &'a F,
    /// What the power is worth that the mission has all relays hold.
    gain: PowerRatio,
}

impl<'a, F: Fn(u16) -> Seat> SolverContext<'a, F> {
    fn distance_m(&self) -> f32 {
        self.mission.config().distance_m
    }

    /// The sender of relay `index`, which stands at `from`.
    fn sender(&self, index: u16, from: Placement) -> Sender {
        if index <= 1 {
            return Sender::transmitter(self.mission);
        }
        let power_w = (self.seat_of)(index - 1).power_w;
        let common = power_w.to_bits() == self.mission.config().common.power_w.to_bits();
        Sender {
            at: from.cross_section(),
            gain: if common {
                self.gain
            } else {
                self.mission.relay_gain(power_w)
            },
        }
    }

    /// The altitude that relay `index` keeps to, if it keeps to one while others choose.
    fn held_at(&self, index: u16) -> Option<f32> {
        let Room { band, .. } = (self.seat_of)(index).room;
        let free = !self.mission.config().band.is_single();
        (free && band.is_single()).then_some(band.least_m)
    }

    /// Whether any relay does.
    fn holds(&self) -> bool {
        (1..=self.mission.relays()).any(|index| self.held_at(index).is_some())
    }

    /// The altitude at relay `index` on the way from one that does to the next.
    fn altitude_between(&self, index: u16, level: bool) -> f32 {
        let relays = self.mission.relays();
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

    /// Relay `index`, fed from `from`.
    fn link(&self, index: u16, from: Placement, room: Room) -> Site<'a> {
        let sender = self.sender(index, from);
        Site::new(self.mission, self.interferer, sender, index <= 1, room)
    }

    /// The slack of the last relay at `at`, and its outlook.
    fn tail(&self, target: f32, at: Placement) -> (f32, Outlook) {
        let Seat { room, power_w } = (self.seat_of)(self.mission.relays());
        link::tail(self.mission, power_w, room, target, at)
    }

    /// No chain meets more than the first hop or the last one can have.
    fn ceiling(&self) -> f32 {
        let Seat { room, power_w } = (self.seat_of)(self.mission.relays());
        let first = (self.seat_of)(1).room;
        let first = link::first_most(self.mission, self.interferer, first);
        let last = link::last_most(self.mission, power_w, room);
        libm::logf(first.min(last).clamp(1e-30, 1e30))
    }

    /// The largest gain of any hop, in ln gamma: above it nobody leaps to the far side of the interferer.
    fn floor(&self) -> f32 {
        let own = (1..self.mission.relays()).map(|index| (self.seat_of)(index).power_w);
        let relay = own.fold(0.0, f32::max);
        let gain = self.mission.relay_gain(relay).value();
        libm::logf(self.mission.tx_gain().value().max(gain)) + 0.01
    }
}

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    /// Begins; `None` in a field, where the chain has more than `RELAYS` relays, or without the feature `altitude`.
    pub fn new(mission: &Mission) -> Option<Self> {
        let fits = usize::from(mission.relays()) <= RELAYS.min(STAGES * SEGMENTS);
        (fits && mission.interferer().is_some()).then(|| Self {
            number: 0,
            start: Start::Far,
            best: None,
            again: false,
            ascent: Ascent::new(1.0, 0.0, 0.0, 0.0),
            work: Work::Begin,
            pass: ForwardPass::default(),
            holds_back: false,
            walled: false,
            moving: 0,
            moved: 0,
            kept: Cell::default(),
            held: None,
            stages: [Stage::default(); STAGES],
            marks: [Mark::default(); SEGMENTS],
            cells: [Cell::default(); RELAYS],
        })
    }

    /// Where relay `index` is to fly across the line, once the chain is solved.
    pub fn at(&self, index: u16, seat: Seat) -> CrossSection {
        self.cell(index).place(seat.room)
    }

    fn cell(&self, index: u16) -> Cell {
        let at = usize::from(index).wrapping_sub(1);
        self.cells.get(at).copied().unwrap_or_default()
    }

    /// Goes on for one portion: ten relays back and forward, or twenty without a change. The target, linear SIR, once the chain is
    /// solved; `seat_of` gives what relay 1..=N brings along, and must answer the same every time.
    ///
    /// # Errors
    /// [`Infeasible`] when no target can be met.
    pub fn step(
        &mut self,
        mission: &Mission,
        seat_of: impl Fn(u16) -> Seat,
    ) -> Poll<Result<f32, Infeasible>> {
        let Some(interferer) = mission.interferer() else {
            return Poll::Ready(Err(Infeasible));
        };
        let chain = SolverContext {
            mission,
            interferer,
            seat_of: &seat_of,
            gain: mission.relay_gain(mission.config().common.power_w),
        };
        match self.work {
            Work::Begin => self.begin(&chain),
            Work::Seek(seek, purpose) => self.seek(&chain, seek, purpose),
            Work::Settle(sigma, purpose) => self.settle(&chain, sigma, purpose),
            Work::Stand(segment, place_m, seek, purpose) => {
                self.stand(&chain, segment, place_m, seek, purpose)
            }
            Work::Polish(sigma) => self.polish(&chain, sigma),
            Work::Back(segment) => {
                self.back(&chain, segment);
                Poll::Pending
            }
            Work::Forward(share, sigma, kept) => {
                self.forward(&chain, share, sigma, kept);
                Poll::Pending
            }
        }
    }

    /// The next start, or the end.
    fn begin(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
    ) -> Poll<Result<f32, Infeasible>> {
        let Some(start) = Start::number(self.number, Room::of(chain.mission)) else {
            // All have been tried.
            let Some((_, number)) = self.best else {
                return Poll::Ready(Err(Infeasible));
            };
            (self.number, self.again) = (number, true);
            return Poll::Pending;
        };
        let Some(start) = start else {
            self.number += 1;
            return Poll::Pending;
        };
        let floor = chain.floor();
        if matches!(start, Start::Near)
            && !self.again
            && self.best.is_some_and(|(best, _)| best > floor)
        {
            self.number += 1;
            return Poll::Pending;
        }
        if matches!(start, Start::Through { .. } | Start::Turns) && !self.walled {
            self.number += 1;
            return Poll::Pending;
        }
        if matches!(start, Start::Held { .. }) && !chain.holds() {
            self.number += 1;
            return Poll::Pending;
        }
        self.start = start;
        self.ascent = Ascent::new(chain.distance_m(), 0.0, 0.0, 0.0);
        self.restart();
        self.work = match start {
            Start::Near => Work::Settle(floor + 0.04, Purpose::Start),
            Start::Turns => {
                for index in 1..=chain.mission.relays() {
                    let room = (chain.seat_of)(index).room;
                    let apart_m = MARGIN * chain.mission.config().min_separation_m;
                    let at = Start::in_turn(index, chain.interferer, room, apart_m);
                    self.keep(index, 0.0, Cell::of(at, room));
                }
                let sigma = chain.ceiling() + 2.0 * CEILING;
                Work::Seek(Seek::down(sigma, 0.1, 1.5, JUDGED), Purpose::Last)
            }
            Start::Arch { .. }
            | Start::Around { .. }
            | Start::Far
            | Start::Through { .. }
            | Start::Held { .. } => {
                Work::Seek(Seek::down(chain.ceiling(), 0.5, 1.5, 0.02), Purpose::Start)
            }
        };
        Poll::Pending
    }

    /// A pass begins at Tx.
    fn restart(&mut self) {
        self.pass = ForwardPass::default();
    }

    /// Where relay `index` is wanted on a pass that changes nothing, or gives the chain its first shape.
    fn shaped(
        &self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        index: u16,
        room: Room,
        target: f32,
        purpose: Purpose,
    ) -> CrossSection {
        if purpose != Purpose::Start {
            return self.cell(index).place(room);
        }
        let wanted = match self.start {
            Start::Far => {
                let top = far_off(chain, room);
                let relays = f32::from(chain.mission.relays().saturating_sub(1).max(1));
                let down = f32::from(index - 1) / relays;
                CrossSection {
                    y_m: top.y_m * (1.0 - down),
                    altitude_m: top.altitude_m + down * (room.band.least_m - top.altitude_m),
                }
            }
            start @ Start::Around { .. } => {
                let c = chain.sender(index, self.pass.from).gain.ratio(target);
                start.around(
                    chain.distance_m(),
                    chain.interferer,
                    self.pass.from,
                    c,
                    room,
                )
            }
            start @ Start::Held { level, .. } => CrossSection {
                altitude_m: chain.altitude_between(index, level),
                ..start.across(chain.distance_m(), self.pass.from.x_m, room)
            },
            start => start.across(chain.distance_m(), self.pass.from.x_m, room),
        };
        Cell::of(wanted, room).place(room)
    }

    /// Goes on with a pass for `sigma`; ready with the slack at its end, `None` if a hop cannot meet the target.
    fn plain(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        sigma: f32,
        purpose: Purpose,
        kept: bool,
    ) -> Poll<Option<f32>> {
        let target = libm::expf(sigma);
        let relays = chain.mission.relays();
        if purpose.is_sweep() && self.pass.done == 0 {
            self.pass.end_m = self.end_m(chain.mission, chain.seat_of, 0);
        }
        for _ in 0..PLAIN {
            let index = self.pass.done + 1;
            if index > relays {
                if purpose.is_sweep() {
                    let power_w = (chain.seat_of)(relays).power_w;
                    let reach_m = sqrt(chain.mission.receiver_gain(power_w) / target);
                    let (slack, _) = Outlook::tail(reach_m, chain.distance_m(), self.pass.from);
                    return Poll::Ready(Some(slack));
                }
                let (slack, _) = chain.tail(target, self.pass.from);
                let penalty = self.pass.penalty;
                if purpose == Purpose::Judge && penalty > FORGIVEN * chain.distance_m() {
                    return Poll::Ready(Some(-penalty));
                }
                return Poll::Ready(Some(slack.min(self.ascent.spare_m()) - penalty));
            }
            let room = (chain.seat_of)(index).room;
            let wanted = self.shaped(chain, index, room, target, purpose);
            let from = self.pass.from;
            let place = if purpose.is_sweep() {
                let step = self.least_step(chain.mission, chain.seat_of, index);
                self.pass.end_m = Self::end_after(chain.mission, self.pass.end_m, step);
                if let Some(mark) = self.mark(index) {
                    // From one pass back to the next nobody sees anything, and there is room.
                    mark.slope = [from.x_m, 0.0, 0.0];
                }
                let hop = self.hop(chain, index, self.pass.end_m);
                let reach = hop.reach(target, from.x_m);
                self.pass.holds_back |= reach.is_none();
                reach
                    .or_else(|| hop.outermost(target, from.x_m))
                    .map(|x_m| wanted.at(x_m))
            } else {
                let link = self.link(chain, index, from, room);
                link.at(target, from.x_m, wanted).inspect(|at| {
                    self.pass.penalty += link.penalty(target, *at);
                })
            };
            let Some(place) = place else {
                return Poll::Ready(None);
            };
            if kept {
                self.keep(index, from.x_m, Cell::of(place.cross_section(), room));
            }
            self.pass.from = place;
            self.pass.done = index;
        }
        Poll::Pending
    }

    /// Keeps the `cell` of relay `index`, which comes after one at `x_m`.
    fn keep(&mut self, index: u16, x_m: f32, cell: Cell) {
        if let Some(mark) = self.mark(index) {
            mark.x_m = x_m;
        }
        let at = usize::from(index).wrapping_sub(1);
        if let Some(kept) = self.cells.get_mut(at) {
            *kept = cell;
        }
    }

    /// The mark before relay `index`, the first of its segment.
    fn mark(&mut self, index: u16) -> Option<&mut Mark> {
        let at = usize::from(index).wrapping_sub(1);
        self.marks
            .get_mut(at / SEGMENT)
            .filter(|_| at.is_multiple_of(SEGMENT))
    }

    /// Relay `index`, fed from `from`, as the start has it.
    fn link<'a>(
        &self,
        chain: &SolverContext<'a, impl Fn(u16) -> Seat>,
        index: u16,
        from: Placement,
        room: Room,
    ) -> Site<'a> {
        let link = chain.link(index, from, room);
        match self.start {
            Start::Through { .. } => link.unparted(),
            _ => link,
        }
    }

    /// The hop to relay `index` of the chain as it is, by the rules of the sweep; no farther than `end_m`.
    fn hop(&self, chain: &SolverContext<'_, impl Fn(u16) -> Seat>, index: u16, end_m: f32) -> Hop {
        let at = |index| self.at(index, (chain.seat_of)(index));
        let before = if index > 1 {
            at(index - 1)
        } else {
            CrossSection::default()
        };
        let sender = chain.sender(index, before.at(0.0));
        Hop::new(
            chain.mission,
            chain.interferer,
            sender,
            index,
            at(index),
            0.0,
        )
        .ending(end_m)
    }

    /// Whether relays have to hold back for the target that was found.
    pub const fn holds_back(&self) -> bool {
        self.holds_back
    }

    /// The least step along x between relay `index` and the one before it, which keep their separation.
    fn least_step(&self, mission: &Mission, seat_of: &impl Fn(u16) -> Seat, index: u16) -> f32 {
        if index <= 1 {
            return 0.0;
        }
        let at = |index| self.at(index, seat_of(index));
        let across = at(index).apart_squared(at(index - 1));
        mission.step_with_room(across)
    }

    /// The last place along x that leaves the relays after `index` of a solved chain their room, m: to the bit what the passes
    /// by the rules of the sweep go by.
    pub fn end_m(&self, mission: &Mission, seat_of: &impl Fn(u16) -> Seat, index: u16) -> f32 {
        let steps = (1..=mission.relays()).map(|at| self.least_step(mission, seat_of, at));
        let first = mission.config().distance_m - steps.clone().sum::<f32>();
        steps
            .take(index.into())
            .fold(first, |end_m, step| Self::end_after(mission, end_m, step))
    }

    fn end_after(mission: &Mission, end_m: f32, step: f32) -> f32 {
        (end_m + step).min(mission.config().distance_m)
    }

    fn seek(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        seek: Seek,
        purpose: Purpose,
    ) -> Poll<Result<f32, Infeasible>> {
        let Poll::Ready(slack) = self.plain(chain, seek.sigma, purpose, false) else {
            return Poll::Pending;
        };
        let met = slack.is_some_and(|slack| slack >= 0.0);
        if met && self.pass.holds_back {
            let place_m = self.pass.from.x_m;
            self.work = Work::Stand(Self::last_of(chain.mission), place_m, seek, purpose);
            return Poll::Pending;
        }
        self.tried(chain, seek, purpose, met.then_some(false))
    }

    /// One segment less till it is known whether all relays can stand where those after them need it; the last of this one is to
    /// stand at `place_m`. Bounded by twenty relays.
    fn stand(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        segment: u8,
        place_m: f32,
        seek: Seek,
        purpose: Purpose,
    ) -> Poll<Result<f32, Infeasible>> {
        match (
            self.stands(chain, segment, place_m, libm::expf(seek.sigma)),
            segment.checked_sub(1),
        ) {
            (Some(place_m), Some(before)) => {
                self.work = Work::Stand(before, place_m, seek, purpose);
                Poll::Pending
            }
            (place_m, _) => self.tried(chain, seek, purpose, place_m.map(|_| true)),
        }
    }

    /// Where the relay before `segment` is to stand.
    fn stands(
        &self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        segment: u8,
        mut place_m: f32,
        target: f32,
    ) -> Option<f32> {
        let relays = chain.mission.relays();
        let [mut x_m, ..] = self.marks.get(usize::from(segment))?.slope;
        let mut end_m = self.end_m(
            chain.mission,
            chain.seat_of,
            u16::from(segment) * SEGMENT_RELAYS,
        );
        let mut before = [(0.0, 0.0); SEGMENT];
        for (k, index) in Self::relays_of(segment, relays) {
            let step = self.least_step(chain.mission, chain.seat_of, index);
            end_m = Self::end_after(chain.mission, end_m, step);
            *before.get_mut(k)? = (x_m, end_m);
            x_m = self.hop(chain, index, end_m).outermost(target, x_m)?;
        }
        for (k, index) in Self::relays_of(segment, relays).rev() {
            let (from_m, end_m) = *before.get(k)?;
            place_m = match self
                .hop(chain, index, end_m)
                .stand(target, from_m, place_m)?
            {
                Stand::AtReach => from_m,
                Stand::At(x_m) => x_m,
            };
        }
        Some(place_m)
    }

    /// What came of a target: that it is `met`, and whether relays have to hold back.
    fn tried(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        mut seek: Seek,
        purpose: Purpose,
        met: Option<bool>,
    ) -> Poll<Result<f32, Infeasible>> {
        self.restart();
        if purpose == Purpose::Probe {
            // If it does not meet the ceiling, its other hops have to be shorter.
            self.work = if met.is_some() {
                self.again = true;
                let sigma = chain.ceiling() + 2.0 * CEILING;
                Work::Seek(Seek::down(sigma, 1e-5, 2.0, 1e-6), Purpose::Last)
            } else {
                let turn = self.ascent.probed();
                self.next(turn, chain)
            };
            return Poll::Pending;
        }
        if purpose == Purpose::Move {
            self.work = if let Some(holds_back) = met {
                self.moved = self.moved.saturating_add(1);
                Work::Seek(Seek::up(seek.sigma, holds_back, GAIN, 1e-6), Purpose::Last)
            } else {
                let (index, _, _) = self.move_of(chain.mission);
                self.keep(index, 0.0, self.kept);
                self.moving += 1;
                Work::Polish(seek.sigma - GAIN)
            };
            return Poll::Pending;
        }
        self.work = if seek.tried(met) {
            Work::Seek(seek, purpose)
        } else {
            match (seek.found(), purpose) {
                (Some((sigma, holds_back)), Purpose::Last) if self.again => {
                    self.holds_back = holds_back;
                    Work::Polish(sigma)
                }
                (Some((sigma, _)), Purpose::Last) => {
                    if self.best.is_none_or(|(best, _)| sigma > best) {
                        self.best = Some((sigma, self.number));
                    }
                    self.given_up()
                }
                (Some((sigma, _)), Purpose::Raise) => {
                    Work::Settle(sigma.min(self.ascent.limit()), purpose)
                }
                (Some((sigma, _)), _) => Work::Settle(sigma, purpose),
                (None, Purpose::Last) if self.again => return Poll::Ready(Err(Infeasible)),
                (None, _) => self.given_up(),
            }
        };
        Poll::Pending
    }

    /// Whose move is tried, which of four ways, and how often it is halved.
    fn move_of(&self, mission: &Mission) -> (u16, u16, u16) {
        // A mission has relays; the compiler does not know that.
        let relays = mission.relays().max(1);
        let tried = self.moving / 6;
        (tried % relays + 1, self.moving % 6, tried / relays)
    }

    /// Tries the next move of a chain that is polished and meets `sigma`: each alone by a part of its room, and by less and less. What
    /// the derivatives do not see, since something else binds there, it may.
    fn polish(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        sigma: f32,
    ) -> Poll<Result<f32, Infeasible>> {
        let (index, way, halved) = self.move_of(chain.mission);
        let polished = chain.mission.relays() <= POLISHED || chain.holds();
        if !polished || halved > HALVINGS || self.moved >= MOVES {
            return Poll::Ready(Ok(libm::expf(sigma)));
        }
        let room = (chain.seat_of)(index).room;
        self.kept = self.cell(index);
        let part = FIRST_MOVE
            * libm::ldexpf(1.0, -i32::from(halved))
            * if way % 2 > 0 { 1.0 } else { -1.0 };
        let mut at = self.kept.place(room);
        if way < 2 {
            at.altitude_m += part * room.band.span_m();
        } else {
            at.y_m += part * room.lateral.span_m();
        }
        let mut moved = Cell::of(at, room);
        if way > 3 {
            let other = if way == 4 {
                index + 2
            } else {
                index.saturating_sub(2)
            };
            if other < 1 || other > chain.mission.relays() {
                self.moving += 1;
                return Poll::Pending;
            }
            moved = Cell::of(self.cell(other).place((chain.seat_of)(other).room), room);
        }
        if moved == self.kept {
            self.moving += 1;
            return Poll::Pending;
        }
        self.keep(index, 0.0, moved);
        self.work = Work::Seek(Seek::down(sigma + GAIN, GAIN, 1.0, GAIN), Purpose::Move);
        Poll::Pending
    }

    /// Nothing came of the start.
    fn given_up(&mut self) -> Work {
        self.number += 1;
        Work::Begin
    }

    fn settle(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        sigma: f32,
        purpose: Purpose,
    ) -> Poll<Result<f32, Infeasible>> {
        let Poll::Ready(slack) = self.plain(chain, sigma, purpose, true) else {
            return Poll::Pending;
        };
        self.ascent.penalty = self.pass.penalty;
        self.restart();
        self.held = None;
        let Some(slack) = slack else {
            self.work = self.given_up();
            return Poll::Pending;
        };
        self.work = match purpose {
            Purpose::Start => {
                let floor = match self.start {
                    Start::Near => chain.floor(),
                    _ => f32::NEG_INFINITY,
                };
                let penalty = self.ascent.penalty;
                self.ascent = Ascent::new(chain.distance_m(), sigma, slack, floor)
                    .probed_at(chain.ceiling() + PROBED);
                self.ascent.penalty = penalty;
                self.look_back(chain.mission)
            }
            Purpose::Raise => {
                let turn = self.ascent.raised(sigma, slack);
                self.next(turn, chain)
            }
            Purpose::Tighten => {
                let turn = self.ascent.tightened(slack);
                self.next(turn, chain)
            }
            Purpose::Judge | Purpose::Last | Purpose::Probe | Purpose::Move => {
                self.judged(sigma, chain.ceiling())
            }
        };
        Poll::Pending
    }

    /// An ascent has come to `sigma`: by the rules of the sweep.
    fn judged(&self, sigma: f32, ceiling: f32) -> Work {
        let sigma = sigma.min(ceiling + CEILING);
        let seek = if self.again {
            Seek::down(sigma + 2e-5, 1e-5, 2.0, 1e-6)
        } else {
            Seek::down(sigma + JUDGED, JUDGED, 3.0, JUDGED)
        };
        Work::Seek(seek, Purpose::Last)
    }

    /// Whether the start may still be the best.
    fn is_promising(&self) -> bool {
        self.again || self.best.is_none_or(|(best, _)| self.ascent.sigma > best)
    }

    fn look_back(&mut self, mission: &Mission) -> Work {
        self.ascent.look_back();
        Work::Back(Self::last_of(mission))
    }

    /// The last segment.
    fn last_of(mission: &Mission) -> u8 {
        let last = (usize::from(mission.relays()) - 1) / SEGMENT;
        u8::try_from(last).unwrap_or(u8::MAX)
    }

    fn next(&mut self, turn: AscentStep, chain: &SolverContext<'_, impl Fn(u16) -> Seat>) -> Work {
        self.restart();
        match turn {
            AscentStep::Try { share, sigma } => Work::Forward(share, sigma, false),
            AscentStep::Raise if self.ascent.at_limit() => {
                let sigma = chain.ceiling() - CEILING;
                Work::Seek(Seek::down(sigma, 1e-5, 2.0, 1e-6), Purpose::Probe)
            }
            AscentStep::Raise => {
                let Ascent { sigma, .. } = self.ascent;
                Work::Seek(Seek::up(sigma, false, 0.02, 1e-5), Purpose::Raise)
            }
            AscentStep::Again => self.look_back(chain.mission),
            AscentStep::Over if self.is_promising() && self.ascent.tighten() => {
                Work::Settle(self.ascent.sigma, Purpose::Tighten)
            }
            AscentStep::Over => {
                self.walled |= self.ascent.penalty > 0.0;
                let sigma = self.ascent.sigma;
                Work::Seek(
                    Seek::down(sigma + JUDGED, JUDGED, 3.0, JUDGED),
                    Purpose::Judge,
                )
            }
        }
    }

    /// The numbers of the relays in `segment`.
    fn relays_of(segment: u8, relays: u16) -> impl DoubleEndedIterator<Item = (usize, u16)> {
        let first = u16::from(segment) * SEGMENT_RELAYS;
        // Counted in u16, which both are: to zip two ranges backward may panic.
        (0..SEGMENT_RELAYS)
            .map(move |k| (usize::from(k), first + 1 + k))
            .filter(move |(_, index)| *index <= relays)
    }

    /// Works out the policies of `segment`, whose relays come after one at `before`; what that one sees. Bounded by ten relays.
    fn recall(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        segment: u8,
        before: Placement,
    ) -> Option<Outlook> {
        let target = libm::expf(self.ascent.sigma);
        let relays = chain.mission.relays();
        let mut places = [before; SEGMENT];
        let mut from = before;
        for (k, index) in Self::relays_of(segment, relays) {
            let room = (chain.seat_of)(index).room;
            let wanted = self.cell(index).place(room);
            let to = self
                .link(chain, index, from, room)
                .at(target, from.x_m, wanted)?;
            *places.get_mut(k)? = from;
            self.stages.get_mut(k)?.x_m = to.x_m;
            from = to;
        }
        let is_last = (usize::from(segment) + 1) * SEGMENT >= usize::from(relays);
        let mut outlook = if is_last {
            let (slack, outlook) = chain.tail(target, from);
            if slack > self.ascent.spare_m() {
                Outlook::default()
            } else {
                outlook
            }
        } else {
            self.marks.get(usize::from(segment))?.outlook()
        };
        let mut to = from;
        for (k, index) in Self::relays_of(segment, relays).rev() {
            let from = *places.get(k)?;
            let room = (chain.seat_of)(index).room;
            let link = self.link(chain, index, from, room);
            let policy = link.weigh(target, self.ascent.trust, from, to, &mut outlook);
            self.stages.get_mut(k)?.policy = Brief::of(&policy);
            to = from;
        }
        self.held = Some(segment);
        Some(outlook)
    }

    fn back(&mut self, chain: &SolverContext<'_, impl Fn(u16) -> Seat>, segment: u8) {
        let before = self.nominal_before(chain, segment);
        let Some(outlook) = self.recall(chain, segment, before) else {
            self.work = self.next(AscentStep::Over, chain);
            return;
        };
        self.ascent.add(&outlook);
        self.work = if let Some(next) = segment.checked_sub(1) {
            if let Some(mark) = self.marks.get_mut(usize::from(next)) {
                mark.look(&outlook);
            }
            Work::Back(next)
        } else {
            let turn = self.ascent.weighed();
            self.next(turn, chain)
        };
    }

    /// Where the relay before `segment` is.
    fn nominal_before(
        &self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        segment: u8,
    ) -> Placement {
        let index = u16::from(segment) * SEGMENT_RELAYS;
        if index == 0 {
            return Placement::default();
        }
        let x_m = self
            .marks
            .get(usize::from(segment))
            .map_or(0.0, |mark| mark.x_m);
        self.at(index, (chain.seat_of)(index)).at(x_m)
    }

    /// One segment more of a pass with the policies, or what is needed for it.
    fn forward(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        share: f32,
        sigma: f32,
        kept: bool,
    ) {
        let relays = chain.mission.relays();
        let target = libm::expf(sigma);
        if self.pass.done >= relays {
            let (slack, _) = chain.tail(target, self.pass.from);
            let slack = slack.min(self.ascent.spare_m()) - self.pass.penalty;
            let turn = if kept {
                self.ascent.penalty = self.pass.penalty;
                self.held = None;
                self.ascent.taken(share, sigma, slack)
            } else if self.ascent.is_gain(sigma, slack) {
                self.restart();
                self.work = Work::Forward(share, sigma, true);
                return;
            } else {
                self.ascent.failed()
            };
            self.work = self.next(turn, chain);
            return;
        }
        let segment = u8::try_from(usize::from(self.pass.done) / SEGMENT).unwrap_or(u8::MAX);
        if self.held != Some(segment) {
            if self.recall(chain, segment, self.pass.old).is_none() {
                self.work = self.next(AscentStep::Over, chain);
            }
            return;
        }
        if self.follow(chain, segment, target, share, kept).is_none() {
            // Only of a trial: what is kept has been tried.
            let turn = self.ascent.failed();
            self.work = self.next(turn, chain);
        }
    }

    /// The relays of `segment` take `share` of their steps.
    fn follow(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        segment: u8,
        target: f32,
        share: f32,
        kept: bool,
    ) -> Option<()> {
        for (k, index) in Self::relays_of(segment, chain.mission.relays()) {
            let ForwardPass { from, old, .. } = self.pass;
            let Seat { room, .. } = (chain.seat_of)(index);
            let Stage { x_m, policy } = *self.stages.get(k)?;
            let policy = policy.policy();
            let nominal = self.cell(index).place(room).at(x_m);
            let change: Triple = minus(triple(from), triple(old));
            let link = self.link(chain, index, from, room);
            let wanted = link.wanted(target, from, nominal, &policy, share, change);
            let cell = Cell::of(link.at(target, from.x_m, wanted)?.cross_section(), room);
            let place = link.at(target, from.x_m, cell.place(room))?;
            if kept {
                self.keep(index, from.x_m, cell);
            }
            self.pass = ForwardPass {
                done: index,
                from: place,
                old: nominal,
                penalty: self.pass.penalty + link.penalty(target, place),
                ..self.pass
            };
        }
        Some(())
    }
}

/// Where in `room`, right above Rx, a relay hears Tx best.
fn far_off(chain: &SolverContext<'_, impl Fn(u16) -> Seat>, room: Room) -> CrossSection {
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
