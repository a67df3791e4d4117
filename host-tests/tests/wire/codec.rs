//! A second codec, written from the rules in `FORMAT.md` and not from the crate's code. It holds no postcard, and takes CRC
//! and COBS from other crates.

use crc::{CRC_32_ISCSI, Crc};
use serde::Deserialize;
use uav_relay::guard::Fence;
use uav_relay::optimiser::PerTarget;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::optimiser::verdict::Verdict;
use uav_relay::place::{CrossSection, Station};
use uav_relay::wire::digest::MissionId;
use uav_relay::wire::frame::Header;
use uav_relay::wire::message::{
    AdjustStep, Answer, Decision, Hello, Message, MessageError, Moved, OwnSeat, Poll, Proposal,
    Pulse, Pulsed, Roster, Successor, Sweep, Token,
};
use uav_relay::{Local, Placement, View, ViewId};

use super::offer::Offer;

/// What a body says, field by field.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) enum Said {
    Sweep(Swept),
    Verdict {
        number: u16,
        mission: u16,
        own: bool,
        commit: Option<u8>,
        slacks: Vec<f32>,
        stand: Option<f32>,
    },
    Busy {
        number: u16,
    },
    Heartbeat {
        mission: u16,
        /// The number of its own question, and that of the one it answers; 0 for none.
        ask: u16,
        answer: u16,
    },
    Measured {
        sweep: Swept,
        upsilon_per_w: f32,
    },
    Aside {
        sweep: Swept,
        y_m: f32,
    },
    Gather(Seats),
    Gathered(Seats),
    Token {
        number: u16,
        mission: u16,
        x_m: f32,
        altitude_m: f32,
        power_w: f32,
        turn: u8,
        explore_m: f32,
        columns: u8,
        rows: u8,
        sir: f32,
    },
    Moved {
        number: u16,
        mission: u16,
        x_m: f32,
        altitude_m: f32,
        any: bool,
        worst: f32,
    },
    Hello(Greeting),
    Proposal(Proposed),
    Decision(Decided),
    Fence {
        number: u16,
        mission: u16,
        echo: u16,
        fence: u16,
        /// Where the fence is, where its sender is bound for, y and altitude, how far before the fence, m.
        places: [f32; 5],
        flags: u8,
    },
    Offer(Offer),
    Pulse {
        number: u16,
        mission: u16,
        lease: u16,
    },
    Pulsed {
        number: u16,
        mission: u16,
        done: bool,
    },
}

/// What a gathering says, and its answer.
#[expect(clippy::struct_field_names, reason = "the vectors name it so")]
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Seats {
    pub(crate) number: u16,
    pub(crate) mission: u16,
    pub(crate) after: u16,
    /// Place, altitude or 0, power of each.
    pub(crate) seats: Vec<(u16, f32, f32)>,
}

/// What every sweep says.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Swept {
    pub(crate) number: u16,
    pub(crate) mission: u16,
    /// Below zero in a plain pass.
    pub(crate) anchor: f32,
    pub(crate) gap: u8,
    pub(crate) growth: u8,
    pub(crate) altitude_m: f32,
    pub(crate) power_w: f32,
    pub(crate) reaches: Vec<f32>,
}

impl Swept {
    /// The body; what some sweeps say more stands before the reaches.
    fn body(&self, tag: u8, more: &[f32]) -> Vec<u8> {
        let mut out = pass(tag, [self.number, self.mission]);
        reals(&mut out, &[self.anchor]);
        out.extend([self.gap, self.growth]);
        reals(&mut out, &[self.altitude_m, self.power_w]);
        reals(&mut out, more);
        list(&mut out, &self.reaches);
        out
    }

    /// The message: from beside the line, where that is chosen; with what is measured.
    fn message(&self, chosen_y_m: Option<f32>, measured_per_w: Option<f32>) -> Message {
        let ladder = Ladder::from_parts(self.anchor.abs(), self.gap, self.growth).unwrap();
        Message::Sweep(Sweep {
            number: self.number,
            mission: self.mission,
            ladder: ladder.plainly(self.anchor < 0.0),
            relay: Station {
                at: CrossSection {
                    y_m: chosen_y_m.unwrap_or(0.0),
                    altitude_m: self.altitude_m,
                },
                power_w: self.power_w,
            },
            chosen: chosen_y_m.is_some(),
            measured_per_w,
            reaches: PerTarget::from_slice(&self.reaches).unwrap(),
        })
    }

    /// Whether there is such a ladder, with no more reaches than it has targets, and all numbers are in range.
    fn in_range(&self) -> bool {
        let targets = targets(self.anchor.abs(), self.gap, self.growth);
        (self.gap > 0 || self.growth == 0)
            && targets[0] >= f32::MIN_POSITIVE
            && targets[targets.len() - 1] < f32::INFINITY
            && self.reaches.len() <= targets.len()
            && self.reaches.iter().all(|reach| (0.0..=2e9).contains(reach))
            && is_altitude(self.altitude_m)
            && is_power(self.power_w)
    }
}

/// What a hello says.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct Greeting {
    pub(crate) mission: u16,
    pub(crate) neighbour: u16,
    pub(crate) behind: u16,
    pub(crate) newest: u32,
    /// Digest and version of the mission held.
    pub(crate) holds: (u16, u16),
    pub(crate) nonce: u16,
    pub(crate) hears: u8,
    pub(crate) flags: u8,
}

impl Greeting {
    fn body(self) -> Vec<u8> {
        let mut out = pass(10, [self.mission, self.neighbour]);
        words(&mut out, &[self.behind]);
        out.extend(self.newest.to_le_bytes());
        words(&mut out, &[self.holds.0, self.holds.1, self.nonce]);
        out.extend([self.hears, self.flags]);
        out
    }

    fn flag(self, bit: u8) -> bool {
        self.flags >> bit & 1 == 1
    }
}

/// A view and how many relays it has.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct SizedView {
    pub(crate) id: u32,
    pub(crate) relays: u16,
}

impl SizedView {
    fn write(self, out: &mut Vec<u8>) {
        out.extend(self.id.to_le_bytes());
        words(out, &[self.relays]);
    }

    fn view(self) -> View {
        View {
            id: ViewId::from_bits(self.id),
            relays: self.relays,
        }
    }

    fn is_proposed(self) -> bool {
        is_proposed(self.id) && is_count(self.relays)
    }

    /// Whether it is a proposed one, or the chain as it was loaded.
    fn is_view(self) -> bool {
        (self.id == 0 || is_proposed(self.id)) && is_count(self.relays)
    }
}

/// What a proposal and the decision on it have in common: of which mission, which view, and the place of the sender.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct Call {
    /// Digest and version of the mission.
    pub(crate) of: (u16, u16),
    pub(crate) view: u32,
    pub(crate) place: u16,
}

impl Call {
    fn body(self, tag: u8) -> Vec<u8> {
        let mut out = pass(tag, [self.of.0, self.of.1]);
        out.extend(self.view.to_le_bytes());
        words(&mut out, &[self.place]);
        out
    }

    fn mission_id(self) -> MissionId {
        mission_id(self.of)
    }

    fn in_range(self) -> bool {
        is_proposed(self.view) && is_count(self.place)
    }
}

/// What a proposal says.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct Proposed {
    pub(crate) call: Call,
    pub(crate) agreed: SizedView,
    pub(crate) votes: u16,
    pub(crate) lease_left: u16,
    pub(crate) rest: u16,
    pub(crate) proposer: bool,
    /// The proposal that was decided on, and the view that was decided for.
    pub(crate) successor: Option<(u32, SizedView)>,
}

impl Proposed {
    fn body(self) -> Vec<u8> {
        let mut out = self.call.body(11);
        self.agreed.write(&mut out);
        words(&mut out, &[self.votes, self.lease_left, self.rest]);
        out.push(u8::from(self.proposer));
        out.push(u8::from(self.successor.is_some()));
        if let Some((proposal, view)) = self.successor {
            out.extend(proposal.to_le_bytes());
            view.write(&mut out);
        }
        out
    }

    fn message(self) -> Message {
        Message::Proposal(Proposal {
            mission_id: self.call.mission_id(),
            view: ViewId::from_bits(self.call.view),
            place: self.call.place,
            poll: Poll {
                agreed: self.agreed.view(),
                votes: self.votes,
                proposer: self.proposer,
                lease_left: self.lease_left,
                rest: self.rest,
                successor: self.successor.map(|(proposal, view)| Successor {
                    proposal: ViewId::from_bits(proposal),
                    view: view.view(),
                }),
            },
        })
    }

    fn in_range(self) -> bool {
        let agreed = self.agreed;
        self.call.in_range()
            && agreed.is_view()
            && self.votes <= agreed.relays
            && self
                .successor
                .is_none_or(|(proposal, view)| is_proposed(proposal) && view.is_proposed())
            // All of that was proposed before.
            && agreed.id < self.call.view
            && self.successor.is_none_or(|(proposal, view)| {
                proposal < self.call.view && view.id <= proposal
            })
    }
}

/// What a decision says.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(crate) struct Decided {
    pub(crate) call: Call,
    /// What the decision follows.
    pub(crate) base: SizedView,
    pub(crate) view: Option<SizedView>,
    pub(crate) there: u16,
    pub(crate) lease_left: u16,
}

impl Decided {
    fn body(self) -> Vec<u8> {
        let mut out = self.call.body(12);
        self.base.write(&mut out);
        out.push(u8::from(self.view.is_some()));
        if let Some(view) = self.view {
            view.write(&mut out);
        }
        words(&mut out, &[self.there, self.lease_left]);
        out
    }

    fn in_range(self) -> bool {
        self.call.in_range()
            && self.base.is_view()
            && is_count(self.there)
            && self.view.is_none_or(SizedView::is_proposed)
    }
}

impl Said {
    /// The bytes of the body.
    #[expect(clippy::too_many_lines, reason = "an arm for each message")]
    pub(crate) fn body(&self) -> Vec<u8> {
        let mut out = Vec::new();
        match self {
            Self::Sweep(sweep) => out = sweep.body(0, &[]),
            Self::Verdict {
                number,
                mission,
                own,
                commit,
                slacks,
                stand,
            } => {
                out = pass(1, [*number, *mission]);
                out.push(u8::from(*own));
                option(&mut out, *commit);
                list(&mut out, slacks);
                match stand {
                    None => out.push(0),
                    Some(x_m) => {
                        out.push(1);
                        reals(&mut out, &[*x_m]);
                    }
                }
            }
            Self::Busy { number } => {
                out.push(2);
                out.extend(number.to_le_bytes());
            }
            Self::Heartbeat {
                mission,
                ask,
                answer,
            } => {
                out.push(3);
                words(&mut out, &[*mission, *ask, *answer]);
            }
            Self::Measured {
                sweep,
                upsilon_per_w,
            } => out = sweep.body(4, &[*upsilon_per_w]),
            Self::Aside { sweep, y_m } => out = sweep.body(5, &[*y_m]),
            Self::Gather(seats) => out = seats.body(6),
            Self::Gathered(seats) => out = seats.body(7),
            Self::Token {
                number,
                mission,
                x_m,
                altitude_m,
                power_w,
                turn,
                explore_m,
                columns,
                rows,
                sir,
            } => {
                out = pass(8, [*number, *mission]);
                reals(&mut out, &[*x_m, *altitude_m, *power_w]);
                out.push(*turn);
                reals(&mut out, &[*explore_m]);
                out.extend([*columns, *rows]);
                reals(&mut out, &[*sir]);
            }
            Self::Moved {
                number,
                mission,
                x_m,
                altitude_m,
                any,
                worst,
            } => {
                out = pass(9, [*number, *mission]);
                reals(&mut out, &[*x_m, *altitude_m]);
                out.push(u8::from(*any));
                reals(&mut out, &[*worst]);
            }
            Self::Hello(greeting) => out = greeting.body(),
            Self::Proposal(proposed) => out = proposed.body(),
            Self::Decision(decided) => out = decided.body(),
            Self::Fence {
                number,
                mission,
                echo,
                fence,
                places,
                flags,
            } => {
                out.push(13);
                for word in [number, mission, echo, fence] {
                    out.extend(word.to_le_bytes());
                }
                reals(&mut out, places);
                out.push(*flags);
            }
            Self::Offer(offer) => out = offer.body(),
            Self::Pulse {
                number,
                mission,
                lease,
            } => {
                out = pass(15, [*number, *mission]);
                words(&mut out, &[*lease]);
            }
            Self::Pulsed {
                number,
                mission,
                done,
            } => {
                out = pass(16, [*number, *mission]);
                out.push(u8::from(*done));
            }
        }
        out
    }

    /// The message that says this.
    #[expect(clippy::too_many_lines, reason = "an arm for each message")]
    pub(crate) fn message(&self) -> Message {
        let per_target = |numbers: &[f32]| PerTarget::from_slice(numbers).unwrap();
        match *self {
            Self::Sweep(ref sweep) => sweep.message(None, None),
            Self::Measured {
                ref sweep,
                upsilon_per_w,
            } => sweep.message(None, Some(upsilon_per_w)),
            Self::Aside { ref sweep, y_m } => sweep.message(Some(y_m), None),
            Self::Verdict {
                number,
                mission,
                own,
                commit,
                ref slacks,
                stand,
            } => Message::Verdict(Answer {
                number,
                mission,
                verdict: Verdict {
                    commit,
                    slacks: per_target(slacks),
                },
                stand,
                own,
            }),
            Self::Busy { number } => Message::Busy { sweep: number },
            Self::Heartbeat {
                mission,
                ask,
                answer,
            } => Message::Heartbeat {
                mission,
                ask,
                answer,
            },
            Self::Gather(ref seats) => Message::Gather(seats.roster()),
            Self::Gathered(ref seats) => Message::Gathered(seats.roster()),
            Self::Token {
                number,
                mission,
                x_m,
                altitude_m,
                power_w,
                turn,
                explore_m,
                columns,
                rows,
                sir,
            } => Message::Token(Token {
                number,
                mission,
                place: Placement::on_line(x_m, altitude_m),
                power_w,
                turn: match (turn, columns) {
                    (0, _) => AdjustStep::Look,
                    (1, _) => AdjustStep::Stop,
                    (_, 0) => AdjustStep::Move {
                        explore_m,
                        local: Local::Fine,
                    },
                    _ => AdjustStep::Move {
                        explore_m,
                        local: Local::Grid { columns, rows },
                    },
                },
                sir,
            }),
            Self::Moved {
                number,
                mission,
                x_m,
                altitude_m,
                any,
                worst,
            } => Message::Moved(Moved {
                number,
                mission,
                place: Placement::on_line(x_m, altitude_m),
                any,
                worst,
            }),
            Self::Hello(greeting) => Message::Hello(Hello {
                mission: greeting.mission,
                newest: ViewId::from_bits(greeting.newest),
                neighbour: greeting.neighbour,
                ask: greeting.flag(0),
                form: greeting.flag(1),
                fresh: greeting.flag(2),
                ready: greeting.flag(3),
                behind: greeting.behind,
                hears: greeting.hears,
                holds: mission_id(greeting.holds),
                nonce: greeting.nonce,
                flies: greeting.flag(4),
            }),
            Self::Proposal(proposed) => proposed.message(),
            Self::Decision(decided) => Message::Decision(Decision {
                mission_id: decided.call.mission_id(),
                proposal: ViewId::from_bits(decided.call.view),
                place: decided.call.place,
                there: decided.there,
                base: decided.base.view(),
                view: decided.view.map(SizedView::view),
                lease_left: decided.lease_left,
            }),
            Self::Pulse {
                number,
                mission,
                lease,
            } => Message::Pulse(Pulse {
                number,
                mission,
                lease,
            }),
            Self::Pulsed {
                number,
                mission,
                done,
            } => Message::Pulsed(Pulsed {
                number,
                mission,
                done,
            }),
            Self::Fence {
                number,
                mission,
                echo,
                fence,
                places: [x_m, target_m, y_m, altitude_m, apart_m],
                flags,
            } => Message::Fence {
                mission,
                fence: Fence {
                    association: number,
                    echo,
                    number: fence,
                    x_m,
                    target_m,
                    across: CrossSection { y_m, altitude_m },
                    apart_m,
                    flags,
                },
            },
            Self::Offer(offer) => offer.message(),
        }
    }

    /// What a body says, or why it is refused.
    pub(crate) fn read(body: &[u8]) -> Result<Self, MessageError> {
        let mut rest = Reader(body);
        let said = rest.said().ok_or(MessageError::Encoding)?;
        if !rest.0.is_empty() {
            return Err(MessageError::Encoding);
        }
        if said.in_range() {
            Ok(said)
        } else {
            Err(MessageError::Value)
        }
    }

    fn in_range(&self) -> bool {
        match self {
            Self::Sweep(sweep) => sweep.in_range(),
            Self::Measured {
                sweep,
                upsilon_per_w,
            } => sweep.in_range() && (1e-9..=1e32).contains(upsilon_per_w),
            Self::Aside { sweep, y_m } => sweep.in_range() && is_beside(*y_m),
            Self::Verdict {
                commit,
                slacks,
                stand,
                ..
            } => {
                commit.is_none_or(|target| target <= 15)
                    && slacks.iter().all(|slack| (-2e9..=2e9).contains(slack))
                    && stand.is_none_or(is_place)
            }
            Self::Busy { .. } | Self::Heartbeat { .. } | Self::Pulsed { .. } => true,
            Self::Pulse { lease, .. } => *lease > 0,
            Self::Gather(seats) | Self::Gathered(seats) => seats.in_range(),
            Self::Token {
                x_m,
                altitude_m,
                power_w,
                turn,
                explore_m,
                columns,
                rows,
                sir,
                ..
            } => {
                let fine = (*columns, *rows) == (0, 0);
                let turn = match turn {
                    0 | 1 => explore_m.to_bits() == 0 && fine,
                    2 => (0.0..=1e5).contains(explore_m) && (fine || *columns.min(rows) >= 2),
                    _ => false,
                };
                turn && is_place(*x_m)
                    && is_altitude(*altitude_m)
                    && is_power(*power_w)
                    && is_sir(*sir)
            }
            Self::Moved {
                x_m,
                altitude_m,
                worst,
                ..
            } => is_place(*x_m) && is_altitude(*altitude_m) && is_sir(*worst),
            Self::Hello(greeting) => {
                greeting.neighbour <= 1000
                    && is_count(greeting.behind)
                    && greeting.hears <= 15
                    && greeting.flags <= 31
            }
            Self::Proposal(proposed) => proposed.in_range(),
            Self::Decision(decided) => decided.in_range(),
            Self::Fence {
                number,
                places: [places @ .., apart_m],
                flags,
                ..
            } => {
                let within = places.iter().all(|place| place.abs() <= 1e7);
                *number != 0 && within && (0.0..=1e5).contains(apart_m) && *flags < 16
            }
            Self::Offer(offer) => offer.in_range(),
        }
    }
}

fn mission_id((digest, version): (u16, u16)) -> MissionId {
    MissionId { version, digest }
}

fn is_count(relays: u16) -> bool {
    (1..=1000).contains(&relays)
}

/// Whether a node may have proposed that: its number is in the low ten bits, the number of the view above.
fn is_proposed(view: u32) -> bool {
    (1..=1000).contains(&(view % 1024)) && view >= 1024
}

fn is_altitude(altitude_m: f32) -> bool {
    (0.1..=1e5).contains(&altitude_m)
}

fn is_power(power_w: f32) -> bool {
    (1e-6..=1e6).contains(&power_w)
}

fn is_place(x_m: f32) -> bool {
    (0.0..=1e6).contains(&x_m)
}

fn is_beside(y_m: f32) -> bool {
    (-1e5..=1e5).contains(&y_m)
}

fn is_sir(sir: f32) -> bool {
    (0.0..f32::INFINITY).contains(&sir)
}

impl Seats {
    fn body(&self, tag: u8) -> Vec<u8> {
        let mut out = pass(tag, [self.number, self.mission]);
        out.extend(self.after.to_le_bytes());
        out.push(u8::try_from(self.seats.len()).unwrap());
        for &(index, altitude_m, power_w) in &self.seats {
            out.extend(index.to_le_bytes());
            reals(&mut out, &[altitude_m, power_w]);
        }
        out
    }

    fn roster(&self) -> Roster {
        let seat = |&(index, held_m, power_w): &(u16, f32, f32)| OwnSeat {
            index,
            held_m,
            power_w,
        };
        Roster {
            number: self.number,
            mission: self.mission,
            after: self.after,
            seats: self.seats.iter().map(seat).collect(),
        }
    }

    fn in_range(&self) -> bool {
        let mut before = self.after;
        self.seats.iter().all(|&(index, held_m, power_w)| {
            let later = index > before && index <= 1000;
            before = index;
            later && (held_m.to_bits() == 0 || is_altitude(held_m)) && is_power(power_w)
        })
    }
}

/// What the message of a pass begins with: its tag, its number, the digest.
fn pass(tag: u8, numbers: [u16; 2]) -> Vec<u8> {
    let mut out = vec![tag];
    words(&mut out, &numbers);
    out
}

fn words(out: &mut Vec<u8>, numbers: &[u16]) {
    for number in numbers {
        out.extend(number.to_le_bytes());
    }
}

fn option(out: &mut Vec<u8>, byte: Option<u8>) {
    match byte {
        None => out.push(0),
        Some(byte) => out.extend([1, byte]),
    }
}

fn reals(out: &mut Vec<u8>, numbers: &[f32]) {
    for number in numbers {
        out.extend(number.to_le_bytes());
    }
}

fn list(out: &mut Vec<u8>, numbers: &[f32]) {
    out.push(u8::try_from(numbers.len()).unwrap());
    reals(out, numbers);
}

/// What is left of a body; every method is `None` where the bytes are no such thing.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*taken)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take().map(|[byte]| byte)
    }

    fn word(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn long(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn real(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    fn list(&mut self) -> Option<Vec<f32>> {
        let count = self.byte().filter(|&count| count <= 16)?;
        (0..count).map(|_| self.real()).collect()
    }

    fn seats(&mut self) -> Option<Seats> {
        let (number, mission, after) = (self.word()?, self.word()?, self.word()?);
        let count = self.byte().filter(|&count| count <= 8)?;
        let seats = (0..count).map(|_| Some((self.word()?, self.real()?, self.real()?)));
        let seats = seats.collect::<Option<_>>()?;
        Some(Seats {
            number,
            mission,
            after,
            seats,
        })
    }

    fn reals<const N: usize>(&mut self) -> Option<[f32; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.real()?;
        }
        Some(numbers)
    }

    fn bool(&mut self) -> Option<bool> {
        match self.byte()? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }

    #[expect(clippy::option_option, reason = "what it is, if it is an option")]
    fn option<T>(&mut self, value: fn(&mut Self) -> Option<T>) -> Option<Option<T>> {
        Some(if self.bool()? {
            Some(value(self)?)
        } else {
            None
        })
    }

    /// A sweep, and the numbers that stand before its reaches.
    fn sweep<const N: usize>(&mut self) -> Option<(Swept, [f32; N])> {
        let mut sweep = Swept {
            number: self.word()?,
            mission: self.word()?,
            anchor: self.real()?,
            gap: self.byte()?,
            growth: self.byte()?,
            altitude_m: self.real()?,
            power_w: self.real()?,
            reaches: Vec::new(),
        };
        let more = self.reals()?;
        sweep.reaches = self.list()?;
        Some((sweep, more))
    }

    fn said(&mut self) -> Option<Said> {
        Some(match self.byte()? {
            0 => {
                let (sweep, []) = self.sweep()?;
                Said::Sweep(sweep)
            }
            1 => Said::Verdict {
                number: self.word()?,
                mission: self.word()?,
                own: self.bool()?,
                commit: self.option(Self::byte)?,
                slacks: self.list()?,
                stand: self.option(Self::real)?,
            },
            2 => Said::Busy {
                number: self.word()?,
            },
            3 => Said::Heartbeat {
                mission: self.word()?,
                ask: self.word()?,
                answer: self.word()?,
            },
            4 => {
                let (sweep, [upsilon_per_w]) = self.sweep()?;
                Said::Measured {
                    sweep,
                    upsilon_per_w,
                }
            }
            5 => {
                let (sweep, [y_m]) = self.sweep()?;
                Said::Aside { sweep, y_m }
            }
            6 => Said::Gather(self.seats()?),
            7 => Said::Gathered(self.seats()?),
            8 => Said::Token {
                number: self.word()?,
                mission: self.word()?,
                x_m: self.real()?,
                altitude_m: self.real()?,
                power_w: self.real()?,
                turn: self.byte()?,
                explore_m: self.real()?,
                columns: self.byte()?,
                rows: self.byte()?,
                sir: self.real()?,
            },
            9 => Said::Moved {
                number: self.word()?,
                mission: self.word()?,
                x_m: self.real()?,
                altitude_m: self.real()?,
                any: self.bool()?,
                worst: self.real()?,
            },
            10 => Said::Hello(self.greeting()?),
            11 => Said::Proposal(self.proposed()?),
            12 => Said::Decision(self.decided()?),
            13 => Said::Fence {
                number: self.word()?,
                mission: self.word()?,
                echo: self.word()?,
                fence: self.word()?,
                places: self.reals()?,
                flags: self.byte()?,
            },
            14 => Said::Offer(self.offer()?),
            15 => Said::Pulse {
                number: self.word()?,
                mission: self.word()?,
                lease: self.word()?,
            },
            16 => Said::Pulsed {
                number: self.word()?,
                mission: self.word()?,
                done: self.bool()?,
            },
            _ => return None,
        })
    }

    fn greeting(&mut self) -> Option<Greeting> {
        Some(Greeting {
            mission: self.word()?,
            neighbour: self.word()?,
            behind: self.word()?,
            newest: self.long()?,
            holds: (self.word()?, self.word()?),
            nonce: self.word()?,
            hears: self.byte()?,
            flags: self.byte()?,
        })
    }

    fn sized(&mut self) -> Option<SizedView> {
        Some(SizedView {
            id: self.long()?,
            relays: self.word()?,
        })
    }

    fn call(&mut self) -> Option<Call> {
        Some(Call {
            of: (self.word()?, self.word()?),
            view: self.long()?,
            place: self.word()?,
        })
    }

    fn proposed(&mut self) -> Option<Proposed> {
        Some(Proposed {
            call: self.call()?,
            agreed: self.sized()?,
            votes: self.word()?,
            lease_left: self.word()?,
            rest: self.word()?,
            proposer: self.bool()?,
            successor: self.option(|rest| Some((rest.long()?, rest.sized()?)))?,
        })
    }

    fn decided(&mut self) -> Option<Decided> {
        Some(Decided {
            call: self.call()?,
            base: self.sized()?,
            view: self.option(Self::sized)?,
            there: self.word()?,
            lease_left: self.word()?,
        })
    }

    fn offer(&mut self) -> Option<Offer> {
        let (offer, rest) = Offer::read(self.0)?;
        self.0 = rest;
        Some(offer)
    }
}

/// A ladder's targets. Every step is worked out in f64, where sum, product and quotient of two f32 keep more than twice
/// their digits, and then rounded to f32: the same as one f32 operation, by another route.
pub(crate) fn targets(anchor: f32, gap: u8, growth: u8) -> Vec<f32> {
    if gap == 0 {
        return vec![anchor];
    }
    let (e, m) = (i32::from(gap >> 3), f64::from(gap & 7));
    let ratio = 1.0 + f64::from(growth) / 16.0;
    let mut gaps = [narrow((1.0 + m / 8.0) * 2_f64.powi(e - 25)); 8];
    let mut targets = vec![anchor; 16];
    for k in 0..7 {
        gaps[k + 1] = narrow(wide(gaps[k]) * ratio);
    }
    for k in 0..8 {
        let step = narrow(wide(targets[7 + k]) * wide(gaps[k]));
        targets[8 + k] = narrow(wide(targets[7 + k]) + wide(step));
    }
    for k in 1..8 {
        let factor = narrow(1.0 + wide(gaps[k]));
        targets[7 - k] = narrow(wide(targets[8 - k]) / wide(factor));
    }
    targets
}

pub(crate) fn wide(value: f32) -> f64 {
    value.into()
}

pub(crate) fn narrow(value: f64) -> f32 {
    value as f32
}

/// The ten bytes before the body.
pub(crate) fn header(header: Header) -> Vec<u8> {
    let mut out = Vec::new();
    out.extend((0x1000 | header.sender).to_le_bytes());
    out.extend(header.destination.to_le_bytes());
    out.extend(header.network.to_le_bytes());
    out.extend(header.counter.to_le_bytes());
    out
}

/// `bytes` and their CRC.
pub(crate) fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc = Crc::<u32>::new(&CRC_32_ISCSI).checksum(&bytes);
    bytes.extend(crc.to_le_bytes());
    bytes
}

/// A frame before COBS around any body.
pub(crate) fn plain(head: Header, body: &[u8]) -> Vec<u8> {
    sealed([&header(head), body].concat())
}

/// COBS and the delimiter.
pub(crate) fn wire(plain: &[u8]) -> Vec<u8> {
    let mut out = cobs::encode_vec(plain);
    out.push(0);
    out
}
