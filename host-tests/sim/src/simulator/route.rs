//! Route of the data through the chain over time: hops, their true data rates, and their time slots.
//!
//! The simulated relays are recorded as they change ([`Track`]). A [`Stage`] is a period without changes:
//!
//! | item | rule |
//! | --- | --- |
//! | route | relays of the view that most living relays have accepted, in the order of their indices in it |
//! | rate of a hop | B b(SINR) with the SINR against all true interferers and noise at the true positions of the drones |
//! | dead hop | rate 0: its sender or receiver is silent, has no position, or has not accepted the view |
//! | slots | set at an agreement, from the rates at the agreed positions, and kept until the next one or until a new view |
//!
//! A frame has one slot for each hop, in the order of the hops, so a packet can pass the whole chain in one frame. With equal slots
//! a slot is the time of one packet on the worst hop, and with fitted slots the time of one packet on its own hop. With a frequency
//! for each hop all hops send all the time. If data goes both ways, the first half of each frame is for data to Rx, and
//! the second half for data back to Tx. The slots are then as long as the faster direction needs for one packet. In a
//! chain planned for both directions, a fitted slot has the time of one packet to Rx, or of r packets back to Tx.
//!
//! Times are whole picoseconds since the start of the run, so slots do not drift.

use std::collections::BTreeMap;

use uav_relay::{Instant, Mission, Phase, Profile, ViewId};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::link::{Access, Radio};
use uav_relay_scenario::scene::{Place, Relay, Scene};

use super::drones::{Point, apart, placement};
use super::observed::ObservedState;
use super::setup::Setup;
use crate::report::hop_sirs;

/// Virtual time or duration, picoseconds.
pub type Ps = u64;

/// Number of picoseconds in a microsecond.
const MICRO: Ps = 1_000_000;

/// Number of picoseconds in a second.
pub const SECOND: f64 = 1e12;

/// Longest time that a hop may take for one packet, ps: 1000 s. A slower hop counts as broken.
const SLOWEST: f64 = 1e15;

/// Distance, m, that a drone must have moved before its new position is recorded.
const MOVED_M: f64 = 0.1;

/// Distance, m, within which a drone has arrived at its agreed position.
const THERE_M: f64 = 5.0;

/// Duration of the periods within which a moving interferer is taken to be at rest, ps: 1 s.
const FIXED: Ps = 1_000_000 * MICRO;

/// Converts a virtual time to picoseconds since the start of the run.
pub const fn ps(instant: Instant) -> Ps {
    instant.as_micros().saturating_mul(MICRO)
}

/// State of a relay, from which the route of the data and its rates are computed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RelayState {
    /// State of the relay. Its `place` is the position of the drone or, if no drones are simulated, the setpoint.
    ///
    /// The position is `None` while the relay has no setpoint.
    pub observed: ObservedState,
    /// Agreed position of the relay: x, y and altitude, m; `None` without an agreement.
    pub agreed: Option<Point>,
}

impl RelayState {
    /// Returns true if the two states are equal except for details that do not affect the route.
    ///
    /// Movements below [`MOVED_M`] and the lease do not affect it.
    fn is_like(&self, other: &Self) -> bool {
        let near = match (self.observed.place, other.observed.place) {
            (Some(one), Some(other)) => apart(one, other) < MOVED_M,
            (one, other) => one.is_none() && other.is_none(),
        };
        let rest = |state: &Self| {
            let seen = ObservedState {
                place: None,
                leased: false,
                ..state.observed
            };
            (seen, state.agreed)
        };
        near && rest(self) == rest(other)
    }
}

/// States of all relays over a run, as needed for the data traffic.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Track {
    latest: BTreeMap<usize, RelayState>,
    changes: Vec<(Instant, usize, RelayState)>,
}

impl Track {
    /// Records the state of relay `relay` (from 0) at time `at`. Does nothing if the state equals the relay's last recorded state.
    pub fn see(&mut self, at: Instant, relay: usize, state: RelayState) {
        let known = self.latest.get(&relay);
        if known.is_none_or(|known| !known.is_like(&state)) {
            self.latest.insert(relay, state);
            self.changes.push((at, relay, state));
        }
    }

    /// Returns this record with new positions: relay 1 gets the first of `places`, relay 2 the second.
    ///
    /// The further relays follow in order. Positions are x, y and altitude, m. A state in which a relay has no position
    /// is not changed.
    #[must_use]
    pub fn moved_to(mut self, places: &[Point]) -> Self {
        let states = self
            .changes
            .iter_mut()
            .map(|(_, relay, state)| (*relay, state));
        for (relay, state) in states.chain(self.latest.iter_mut().map(|(at, state)| (*at, state))) {
            let at = places.get(relay).copied();
            state.observed.place = state.observed.place.and(at);
            state.agreed = state.agreed.and(at);
        }
        self
    }
}

/// Computation of the true SIR of every hop, from the true interference.
#[derive(Debug)]
pub struct TrueHops {
    /// Relays and interferers at time 0, and the interferers' velocity along x and y, m/s.
    ///
    /// `None` if the interference is a random field (distributions of its power along the line), or with uploads.
    scene: Option<(Scene, [f64; 2])>,
    /// Missions by version, used if `scene` is `None`. Version 0 is the mission at the start of the run.
    missions: Vec<(u16, Mission)>,
    /// Altitude and power of each relay, from relay 1.
    profiles: Vec<Profile>,
}

impl TrueHops {
    /// Prepares the computation of true SIRs for a run of `setup` whose relays have `mission` at the start.
    ///
    /// The interference is from all interferers of `scenario`, which may move. In a random field (distributions of the
    /// interference power along the line), and in a run with uploads, it is the interference of the mission that the
    /// chain flies.
    pub fn new(scenario: &Scenario, setup: &Setup, mission: &Mission) -> Self {
        let relays = mission.relays();
        let moved = setup
            .true_interference
            .as_ref()
            .map_or([0.0; 2], |true_interference| true_interference.velocity_mps);
        let scene = Scene::new(scenario, relays).map(|scene| (scene, moved));
        let uploads = setup.uploads.iter().filter_map(|spec| {
            let mission = Mission::try_new(*spec.upload.config()).ok()?;
            Some((spec.upload.version(), mission))
        });
        let own = |index: u16| setup.profiles.iter().find(|(of, _)| *of == index);
        Self {
            scene: scene.filter(|_| setup.uploads.is_empty()),
            missions: [(0, *mission)].into_iter().chain(uploads).collect(),
            profiles: (1..=relays)
                .map(|index| own(index).map_or(mission.config().common, |(_, profile)| *profile))
                .collect(),
        }
    }

    fn are_moving(&self) -> bool {
        let moves = |(_, [vx, vy]): &(Scene, [f64; 2])| vx.abs() + vy.abs() > 0.0;
        self.scene.as_ref().is_some_and(moves)
    }

    /// Returns the linear SIR of each hop from Tx to Rx and, if `back` is true, of each hop from Rx to Tx.
    ///
    /// The SIRs are those at the time `at`, for the mission `version`. `relays` has the index, from 0, and the
    /// position of each relay in the chain. The hops of a direction are in the order in which a packet passes them.
    fn sirs(&self, at: Ps, version: u16, relays: &[(usize, Point)], back: bool) -> Vec<Vec<f64>> {
        let Some((scene, [vx, vy])) = &self.scene else {
            let mut missions = self.missions.iter();
            let known = missions.find(|(of, _)| *of == version);
            let Some((_, mission)) = known.or_else(|| self.missions.first()) else {
                return Vec::new();
            };
            let places: Vec<_> = relays
                .iter()
                .filter_map(|(relay, at)| Some((placement(*at), *self.profiles.get(*relay)?)))
                .collect();
            return vec![hop_sirs(mission, &places)];
        };
        let seconds = at as f64 / SECOND;
        let mut sources = scene.sources.clone();
        for source in &mut sources {
            source.x_m += vx * seconds;
            source.y_m += vy * seconds;
        }
        let of = |(relay, _): &(usize, Point)| scene.relays.get(*relay).copied();
        let here = Scene {
            sources,
            relays: relays.iter().filter_map(of).collect::<Vec<Relay>>(),
            ..scene.clone()
        };
        let places: Vec<Place> = relays
            .iter()
            .map(|(_, [x, y, h])| Place {
                x: *x,
                y: *y,
                h: *h,
            })
            .collect();
        let mut sirs = vec![here.hop_sirs(&places)];
        if back {
            let back = here.hop_sirs_back(&places);
            sirs.push(back.into_iter().rev().collect());
        }
        sirs
    }
}

/// Recurring time slot of a hop: the same part of every TDMA frame. In each TDMA frame a hop has one slot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Window {
    /// Start of the first TDMA frame of the link, ps.
    anchor: Ps,
    /// Duration of a TDMA frame, ps.
    frame: Ps,
    /// Time from the start of a TDMA frame to the start of the slot, ps.
    opens: Ps,
    /// Duration of the time slot, ps, at least 1.
    open_for: Ps,
}

impl Window {
    /// Returns the end of the TDMA frame that contains the time `at`; `at` itself if a frame ends there.
    pub const fn frame_end(&self, at: Ps) -> Ps {
        let since = at.saturating_sub(self.anchor);
        self.anchor + since.div_ceil(self.frame) * self.frame
    }

    /// Returns the slot time, ps, until `at`: the total duration of slots since the first TDMA frame.
    fn elapsed(&self, at: Ps) -> Ps {
        let since = at.saturating_sub(self.anchor);
        let (frames, into) = (since / self.frame, since % self.frame);
        frames * self.open_for + into.saturating_sub(self.opens).min(self.open_for)
    }

    /// Returns the slot time, ps, from `from` to `until`: the total duration of slots in this period.
    pub fn between(&self, from: Ps, until: Ps) -> Ps {
        self.elapsed(until) - self.elapsed(from)
    }

    /// Returns the end of a transmission that begins at `from` and takes `duration` (> 0) within slots.
    pub fn ends(&self, from: Ps, duration: Ps) -> Ps {
        let due = u128::from(self.elapsed(from)) + u128::from(duration) - 1;
        let open_for = u128::from(self.open_for);
        let end = u128::from(self.anchor)
            + due / open_for * u128::from(self.frame)
            + u128::from(self.opens)
            + due % open_for
            + 1;
        Ps::try_from(end).unwrap_or(Ps::MAX)
    }
}

/// Hop of the route during one stage. Node 0 is Tx, and the node after the last relay is Rx.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Hop {
    /// Number of the node that sends over this hop.
    pub from: usize,
    /// Number of the node that receives over this hop.
    pub to: usize,
    /// Time that one packet takes on this hop at its present data rate, ps, above 0.
    pub packet: Ps,
    /// Time slots in which the hop may send.
    pub window: Window,
}

/// State of the chain with respect to the data traffic.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ChainState {
    /// The relays of the view (membership of the chain) are all at the positions of one agreement.
    Agreed,
    /// The relays can all send, but they have not agreed on positions yet, or drones are on their way.
    Pending,
    /// A relay of the view (membership of the chain) cannot send.
    ///
    /// It is silent, has no position, or has not accepted the view.
    Broken,
}

/// Period in which the chain's view, its state and the promised data rates are constant. The planner's formula gives
/// the promised rates.
#[derive(Clone, PartialEq, Debug)]
pub struct Period {
    /// Start of the period, ps. The period ends where the next period starts.
    pub from: Ps,
    /// Number of relays in the view (membership of the chain).
    pub relays: u16,
    /// Number of the view (membership of the chain).
    pub view: u32,
    /// State of the chain in this period of the traffic.
    pub state: ChainState,
    /// Data rates at the agreed positions by the planner's formula, bit/s: to Rx, then back to Tx.
    ///
    /// Empty if there is no agreement. The second value is absent if data goes only to Rx.
    pub promised_bps: Vec<f64>,
}

/// Period in which no hop of the data's route changes.
#[derive(Clone, PartialEq, Debug)]
pub struct Stage {
    /// Start of this stage of the route, ps.
    pub from: Ps,
    /// Index in [`Route::periods`] of the period that contains this stage. In a period the view, the chain's state
    /// and the promised data rates are constant.
    pub period: usize,
    /// State of each relay, from relay 1: true if it is switched on.
    pub on: Vec<bool>,
    /// Hops that can carry data, for each direction: to Rx, then back to Tx.
    pub hops: Vec<Vec<Hop>>,
}

/// Route of the data through the chain over time, beginning at the first agreement on positions.
#[derive(Clone, PartialEq, Debug)]
pub struct Route {
    /// Stages, in which no hop changes, in order of time; at least one.
    pub stages: Vec<Stage>,
    /// Periods with a constant view, state of the chain and promised data rate, in order of time. A view is a
    /// membership of the chain. At least one.
    pub periods: Vec<Period>,
    /// Data rates that the planner's formula gives at the first agreed positions, bit/s. First the rate from Tx to Rx; second, for data
    /// both ways, the rate from Rx to Tx.
    pub promised_bps: Vec<f64>,
}

/// Relays of the view (membership of the chain) that carries the data at present.
struct Members {
    view: ViewId,
    version: u16,
    /// Number (from 0) and state of each relay in the view, in the order of the view's indices.
    ///
    /// `None` for a relay that is off or has not accepted the view.
    relays: Vec<Option<(usize, RelayState)>>,
}

impl Members {
    /// Returns the relays of the view that the largest number of living relays have accepted. Of views with equal
    /// numbers, the newest is chosen.
    fn of(states: &BTreeMap<usize, RelayState>) -> Option<Self> {
        let on = || states.iter().filter(|(_, state)| state.observed.is_on);
        let mut counts: BTreeMap<(ViewId, u16), usize> = BTreeMap::new();
        for (_, state) in on() {
            let view = (state.observed.view, state.observed.relays);
            *counts.entry(view).or_default() += 1;
        }
        let (view, relays) = counts
            .into_iter()
            .max_by_key(|(view, count)| (*count, *view))?
            .0;
        let mut members = Self {
            view,
            version: 0,
            relays: vec![None; usize::from(relays)],
        };
        for (relay, state) in on() {
            let seen = state.observed;
            let place = usize::from(seen.index).checked_sub(1);
            if let Some(place) = place
                && (seen.view, seen.relays) == (view, relays)
                && let Some(member) = members.relays.get_mut(place)
            {
                members.version = members.version.max(seen.version);
                member.get_or_insert((*relay, *state));
            }
        }
        Some(members)
    }

    /// Returns the number (from 0) and the present position of each relay in the view.
    ///
    /// A relay without a position gets an arbitrary one. This position has no effect, because the relay's hops carry no
    /// data.
    fn places(&self) -> Vec<(usize, Point)> {
        let place = |(index, member): (usize, &Option<(usize, RelayState)>)| {
            let known = member.and_then(|(relay, state)| Some((relay, state.observed.place?)));
            known.unwrap_or((index, [0.0; 3]))
        };
        self.relays.iter().enumerate().map(place).collect()
    }

    /// Returns the numbers of the chain's nodes, from Tx (0) to Rx (`rx`). `None` stands for a node that cannot send.
    fn nodes(&self, rx: usize) -> Vec<Option<usize>> {
        let alive = self.relays.iter().map(|member| {
            let (relay, state) = (*member)?;
            state.observed.place.map(|_| relay + 1)
        });
        [Some(0)]
            .into_iter()
            .chain(alive)
            .chain([Some(rx)])
            .collect()
    }

    /// Returns each relay's number (from 0) and agreed position; `None` unless their target SIRs are equal.
    ///
    /// `None` also while relays are at positions that serve only to measure an unknown interferer: these have no target
    /// SIR.
    fn agreed(&self) -> Option<Vec<(usize, Point)>> {
        let target = |state: &RelayState| state.observed.target.map(f32::to_bits);
        let (_, first) = self.relays.first().copied().flatten()?;
        let first = target(&first)?;
        let held = self.relays.iter().map(|member| {
            let (relay, state) = (*member)?;
            let is_held = state.observed.phase == Phase::Holding && state.observed.place.is_some();
            (is_held && target(&state) == Some(first)).then_some((relay, state.agreed?))
        });
        held.collect()
    }

    /// Returns true if every drone is at its agreed position.
    fn are_there(&self, agreed: &[(usize, Point)]) -> bool {
        let mut pairs = self.places().into_iter().zip(agreed);
        pairs.all(|((_, at), (_, goal))| apart(at, *goal) < THERE_M)
    }
}

/// Time slots of all hops, for each direction. The slots are assigned anew at each agreement and for each new view
/// (membership).
struct Layout {
    view: ViewId,
    agreed: Option<Vec<(usize, Point)>>,
    promised_bps: Vec<f64>,
    windows: Vec<Vec<Window>>,
}

/// Parameters of the data link over which the packets go.
#[derive(Clone, PartialEq, Debug)]
pub struct DataLink {
    /// Medium access, spectral efficiency and bandwidth.
    pub radio: Radio,
    /// Size of a packet, bits, above 0.
    pub packet_bits: f64,
    /// True if data goes from Tx to Rx and from Rx to Tx; false if only to Rx.
    pub both: bool,
    /// Planned data rate to Tx, as a fraction (0 to 1) of the planned rate to Rx. It is 0 if only the direction to Rx
    /// is planned.
    pub reverse: f64,
}

impl DataLink {
    /// Returns the transmission time of one packet on a hop with the data rate `rate_bps`, ps. `None` if the hop carries no data.
    fn packet(&self, rate_bps: f64) -> Option<Ps> {
        let time = self.packet_bits / rate_bps * SECOND;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to 1e15"
        )]
        (time <= SLOWEST).then(|| (time.ceil() as Ps).max(1))
    }

    /// Returns the planner's data rate, bit/s, of each direction, from the linear SIRs of its hops.
    fn promised_bps(&self, sirs: &[Vec<f64>]) -> Vec<f64> {
        match sirs {
            [there, back] => self.radio.both_bps(there, back, self.reverse).to_vec(),
            _ => sirs.iter().map(|sirs| self.radio.chain_bps(sirs)).collect(),
        }
    }

    /// Returns true if the lengths of the slots are fitted to the hops' data rates toward Rx and toward Tx.
    pub fn is_fitted_to_both(&self) -> bool {
        self.radio.link.access == Access::Fitted && self.reverse > 0.0
    }

    /// Returns the time slots of each direction's hops, from time `anchor` on, for the hops' linear SIRs.
    fn windows(&self, anchor: Ps, sirs: &[Vec<f64>]) -> Vec<Vec<Window>> {
        let packets: Vec<Vec<Option<Ps>>> = sirs
            .iter()
            .map(|sirs| sirs.iter().map(|sir| self.packet(self.radio.hop_bps(*sir))))
            .map(Iterator::collect)
            .collect();
        let slowest = |packets: &Vec<Option<Ps>>| packets.iter().flatten().copied().max();
        let longest = packets.iter().filter_map(slowest).max().unwrap_or(1);
        // Of two directions the faster one sends one packet in a slot, so bursts stay short.
        let slot = packets.iter().filter_map(slowest).min().unwrap_or(1);
        // A hop that carries nothing has a slot as long as that of the worst hop.
        let own = |packet: &Option<Ps>| packet.unwrap_or(longest);
        let half = |packets: &Vec<Option<Ps>>| match self.radio.link.access {
            Access::Slots => slot * packets.len() as Ps,
            Access::Channels => slot,
            Access::Fitted => packets.iter().map(own).sum(),
        };
        let shortest = packets.iter().map(half).min().unwrap_or(1);
        let span = |(direction, packets): (usize, &Vec<Option<Ps>>)| match direction {
            _ if !self.is_fitted_to_both() => shortest,
            0 => half(packets),
            // This time is rounded up, and the slots are rounded down, so neither direction gets more than it is
            // promised.
            _ => part(half(packets), self.reverse) + 1,
        };
        let spans: Vec<Ps> = packets.iter().enumerate().map(span).collect();
        let frame = spans.iter().sum();
        let mut all = Vec::new();
        let mut begins = 0;
        for (direction, (packets, span)) in packets.iter().zip(spans).enumerate() {
            let fitted = |time: Ps| {
                if self.is_fitted_to_both() {
                    return part(time, if direction == 0 { 1.0 } else { self.reverse });
                }
                let share = u128::from(time) * u128::from(span) / u128::from(half(packets));
                Ps::try_from(share).unwrap_or(Ps::MAX)
            };
            let mut opens = begins;
            let windows = packets.iter().map(|packet| {
                let open_for = match self.radio.link.access {
                    Access::Fitted => fitted(own(packet)),
                    Access::Slots | Access::Channels => slot,
                };
                let window = Window {
                    anchor,
                    frame,
                    opens,
                    open_for: open_for.max(1),
                };
                if self.radio.link.access != Access::Channels {
                    opens += window.open_for;
                }
                window
            });
            all.push(windows.collect());
            begins += span;
        }
        all
    }
}

/// Returns a fraction of a time: `time` multiplied by `share`, 0 to 1, rounded down.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "0 to the time itself"
)]
fn part(time: Ps, share: f64) -> Ps {
    (time as f64 * share) as Ps
}

/// Returns the route of the data from the first agreement on positions to the time `until`.
///
/// `None` if there is no agreement. `relays` is the number of simulated relays.
pub fn route(
    track: &Track,
    true_hops: &TrueHops,
    link: &DataLink,
    relays: usize,
    until: Ps,
) -> Option<Route> {
    let mut states: BTreeMap<usize, RelayState> = BTreeMap::new();
    let mut layout: Option<Layout> = None;
    let mut route = Route {
        stages: Vec::new(),
        periods: Vec::new(),
        promised_bps: Vec::new(),
    };
    let mut changes = track
        .changes
        .chunk_by(|one, next| one.0 == next.0)
        .peekable();
    while let Some(same) = changes.next() {
        for (_, relay, state) in same {
            states.insert(*relay, *state);
        }
        let from = same.first().map_or(0, |(at, ..)| ps(*at));
        let next = changes.peek().and_then(|next| next.first());
        let next = next.map_or(until, |(at, ..)| ps(*at)).min(until);
        let mut at = from;
        loop {
            if let Some(members) = Members::of(&states) {
                let stage = Stage {
                    from: at,
                    period: 0,
                    on: (0..relays)
                        .map(|relay| states.get(&relay).is_some_and(|state| state.observed.is_on))
                        .collect(),
                    hops: Vec::new(),
                };
                route.add(stage, &members, &mut layout, (true_hops, link));
            }
            at += FIXED;
            if !true_hops.are_moving() || at >= next {
                break;
            }
        }
    }
    (!route.stages.is_empty()).then_some(route)
}

impl Route {
    /// Adds `stage`, a period in which no hop changes, to the route. The stage gets the hops between the relays `members`. Does nothing
    /// before the first agreement on positions.
    fn add(
        &mut self,
        mut stage: Stage,
        members: &Members,
        layout: &mut Option<Layout>,
        (true_hops, link): (&TrueHops, &DataLink),
    ) {
        let agreed = members.agreed();
        if agreed.is_none() && self.stages.is_empty() {
            return;
        }
        let sirs = |places: &[(usize, Point)]| {
            true_hops.sirs(stage.from, members.version, places, link.both)
        };
        let present = sirs(&members.places());
        let is_current = layout.as_ref().is_some_and(|layout| {
            let same = agreed.is_none() || layout.agreed == agreed;
            layout.view == members.view && same && !(agreed.is_some() && true_hops.are_moving())
        });
        if !is_current {
            let at_agreed = agreed.as_ref().map(|places| sirs(places));
            *layout = Some(Layout {
                view: members.view,
                promised_bps: at_agreed
                    .as_ref()
                    .map_or_else(Vec::new, |sirs| link.promised_bps(sirs)),
                windows: link.windows(stage.from, at_agreed.as_ref().unwrap_or(&present)),
                agreed: agreed.clone(),
            });
        }
        let Some(layout) = layout else {
            return;
        };
        if self.stages.is_empty() {
            self.promised_bps.clone_from(&layout.promised_bps);
        }
        let nodes = members.nodes(stage.on.len() + 1);
        let is_whole = nodes.iter().all(Option::is_some);
        let state = match &agreed {
            Some(agreed) if members.are_there(agreed) => ChainState::Agreed,
            _ if is_whole => ChainState::Pending,
            _ => ChainState::Broken,
        };
        let period = Period {
            from: stage.from,
            relays: u16::try_from(members.relays.len()).unwrap_or(u16::MAX),
            view: members.view.number(),
            state,
            promised_bps: match state {
                ChainState::Agreed => layout.promised_bps.clone(),
                _ => Vec::new(),
            },
        };
        let is_same = |last: &Period| {
            let start = Period {
                from: last.from,
                ..period.clone()
            };
            start == *last
        };
        if !self.periods.last().is_some_and(is_same) {
            self.periods.push(period);
        }
        stage.period = self.periods.len() - 1;
        stage.hops = present
            .iter()
            .zip(&layout.windows)
            .enumerate()
            .map(|(direction, (sirs, windows))| {
                let ends: Vec<Option<usize>> = match direction {
                    0 => nodes.clone(),
                    _ => nodes.iter().rev().copied().collect(),
                };
                let pairs = ends.iter().zip(ends.iter().skip(1));
                let hops = pairs.zip(sirs.iter().zip(windows));
                hops.filter_map(|((from, to), (sir, window))| {
                    Some(Hop {
                        from: (*from)?,
                        to: (*to)?,
                        packet: link.packet(link.radio.hop_bps(*sir))?,
                        window: *window,
                    })
                })
                .collect()
            })
            .collect();
        self.stages.push(stage);
    }
}

#[cfg(test)]
mod tests {
    use super::Window;

    const WINDOW: Window = Window {
        anchor: 100,
        frame: 30,
        opens: 10,
        open_for: 7,
    };

    /// Counts the picoseconds within slots one by one, as the reference for the tests of `Window`.
    fn counted(from: u64, until: u64) -> u64 {
        let is_open = |at: &u64| (10..17).contains(&((at - 100) % 30));
        (from..until).filter(is_open).count() as u64
    }

    #[test]
    fn the_time_within_slots_is_counted() {
        for from in 100..180 {
            for until in from..240 {
                assert_eq!(WINDOW.between(from, until), counted(from, until));
            }
        }
    }

    #[test]
    fn a_transmission_ends_in_the_slot_in_which_its_time_is_over() {
        for from in 100..180 {
            for duration in 1..40 {
                let end = WINDOW.ends(from, duration);
                assert_eq!(counted(from, end), duration, "{from} {duration}");
                assert_eq!(counted(from, end - 1), duration - 1, "{from} {duration}");
            }
        }
    }
}
