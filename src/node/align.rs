//! Algorithm 1 on board: what a relay does with a sweep and with its verdict.
//!
//! | phase | a new sweep comes | the same sweep again | its verdict comes | work is due |
//! | --- | --- | --- | --- | --- |
//! | `Idle` | reach, hand on: `Waiting` | - | stale | - |
//! | `Planning` (head) | - | - | stale | solve on; then begin a sweep: `Waiting` |
//! | `Waiting` | reach, hand on | say busy | no commit: hand back, `Answered`; commit: take the place, hand back, `Holding` | - |
//! | `Answered` | reach, hand on: `Waiting` | hand the verdict back again | stale | (head) begin a sweep: `Waiting` |
//! | `Holding` | reach, hand on: `Waiting` | hand the verdict back again | stale | - |
//! | `Infeasible` (head) | - | - | stale | - |
//!
//! The tail gives the verdict itself and skips `Waiting`. The head has nobody to hand a verdict back to: without a commit it
//! has work to do. A sweep whose number is just behind the current one is stale wherever it comes. The setpoint is touched
//! by a commit alone, so a relay holds its place through everything else.

use super::settings::Settings;
use crate::mission::{Mission, Profile};
use crate::placement::PerTarget;
use crate::placement::ladder::Ladder;
use crate::placement::plan::{Planner, origins};
use crate::placement::search::{Infeasible, Schedule, Search};
use crate::placement::spacing::Hop;
use crate::placement::verdict::Verdict;
use crate::sir::{Placement, Sender};
use crate::wire::message::{Answer, Sweep};

/// Where a relay is in the protocol.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Phase {
    /// No sweep has come yet.
    Idle,
    /// The head is solving the chain from the mission.
    Planning,
    /// A sweep is under way downstream.
    Waiting,
    /// The verdict on the last sweep was no commit.
    Answered,
    /// The chain has agreed; the relay holds its place.
    Holding,
    /// The head has found that no target can be met.
    Infeasible,
}

/// What the node has to do now.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Next {
    Nothing,
    /// Count a message of a sweep that is over.
    Stale,
    /// Call `work` after a pause.
    Work,
    /// Send the sweep downstream, and again until it is answered.
    Forward,
    /// Tell upstream that its sweep has arrived.
    Busy,
    /// Send the verdict upstream again.
    Repeat,
    /// A verdict is known: send it upstream.
    Answer {
        /// Whether a place was taken with it.
        committed: bool,
    },
    /// No target can be met.
    Infeasible,
}

/// Hops of the prediction in one call of `work`: 16 reaches each.
const HOPS_AT_ONCE: u16 = 16;

/// A sweep that is this many numbers or fewer behind the current one is a straggler; farther off, its head was rebooted.
const STRAGGLERS: u16 = 64;

/// What the head has beyond every other relay.
#[derive(Clone, Debug)]
enum Head {
    /// Not the head, or nothing begun yet.
    No,
    Predicting(Planner),
    Searching(Search),
}

/// A relay's share of Algorithm 1.
#[derive(Clone, Debug)]
pub(crate) struct Align {
    phase: Phase,
    number: u16,
    ladder: Ladder,
    /// This relay's place for each target of the current sweep.
    reaches: PerTarget,
    verdict: Verdict,
    head: Head,
    sweeps: u32,
    setpoint: Option<Placement>,
    target: Option<f32>,
}

impl Align {
    /// A relay that has just been switched on. The head numbers its sweeps from `number` on, and has work to do.
    pub(crate) const fn new(head: bool, number: u16) -> Self {
        Self {
            phase: if head { Phase::Planning } else { Phase::Idle },
            number,
            ladder: Ladder::single(1.0),
            reaches: PerTarget::new(),
            verdict: Verdict {
                commit: None,
                slacks: PerTarget::new(),
            },
            head: Head::No,
            sweeps: 0,
            setpoint: None,
            target: None,
        }
    }

    /// What the head begins with: its prediction, if it may, or the search itself.
    #[inline(never)] // a planner is built here once; its stack is not for every call of `work`
    fn begin(&mut self, mission: &Mission, profile: Profile, settings: &Settings) -> Next {
        let head = if settings.predict && settings.schedule == Schedule::Bracketed {
            Planner::new(mission, profile, settings.schedule).map(Head::Predicting)
        } else {
            Search::new(mission, profile, settings.schedule).map(Head::Searching)
        };
        match head {
            Ok(head) => {
                self.head = head;
                Next::Work
            }
            Err(Infeasible) => self.give_up(),
        }
    }

    fn give_up(&mut self) -> Next {
        self.phase = Phase::Infeasible;
        Next::Infeasible
    }

    /// Goes on with the head's computation: at most 16 hops of 16 reaches.
    pub(crate) fn work(
        &mut self,
        mission: &Mission,
        profile: Profile,
        settings: &Settings,
    ) -> Next {
        if matches!(self.head, Head::No) {
            return self.begin(mission, profile, settings);
        }
        if let Head::Predicting(planner) = &mut self.head {
            // The head knows its own profile; of the others it can only assume what the mission has in common.
            let profile_of = |index| {
                if index == 1 {
                    profile
                } else {
                    mission.config().common
                }
            };
            let agreed = planner.step(mission, profile_of, HOPS_AT_ONCE);
            let search = match agreed {
                Ok(None) => return Next::Work,
                Ok(Some(agreed)) => {
                    Search::new(mission, profile, Schedule::Bracketed).map(|mut search| {
                        search.begin_with(agreed.ladder);
                        search
                    })
                }
                // The others may hold something else: let their answers decide.
                Err(Infeasible) => Search::new(mission, profile, Schedule::Bracketed),
            };
            match search {
                Ok(search) => self.head = Head::Searching(search),
                Err(Infeasible) => return self.give_up(),
            }
        }
        self.begin_sweep(mission, profile)
    }

    /// The head begins the sweep its search asks for.
    fn begin_sweep(&mut self, mission: &Mission, profile: Profile) -> Next {
        let Head::Searching(search) = &self.head else {
            return Next::Nothing;
        };
        self.ladder = *search.ladder();
        self.number = self.number.wrapping_add(1);
        self.sweeps = self.sweeps.saturating_add(1);
        self.reach(
            mission,
            Sender::transmitter(mission),
            1,
            profile,
            &origins(),
        )
    }

    /// Works out this relay's reaches; the tail goes on to the verdict.
    fn reach(
        &mut self,
        mission: &Mission,
        sender: Sender,
        index: u16,
        profile: Profile,
        from: &PerTarget,
    ) -> Next {
        let hop = Hop::new(mission, sender, index, profile.altitude_m);
        hop.extend(&self.ladder.targets(), from, &mut self.reaches);
        if index < mission.relays() {
            self.phase = Phase::Waiting;
            return Next::Forward;
        }
        let verdict = Verdict::reach(mission, profile, &self.ladder, &self.reaches);
        self.conclude(profile, verdict)
    }

    /// A sweep from upstream.
    pub(crate) fn on_sweep(
        &mut self,
        mission: &Mission,
        index: u16,
        profile: Profile,
        sweep: &Sweep,
    ) -> Next {
        if self.phase != Phase::Idle {
            let behind = self.number.wrapping_sub(sweep.number);
            if behind == 0 && self.ladder == sweep.ladder {
                return if self.phase == Phase::Waiting {
                    Next::Busy
                } else {
                    Next::Repeat
                };
            }
            if (1..=STRAGGLERS).contains(&behind) {
                return Next::Stale;
            }
        }
        self.number = sweep.number;
        self.ladder = sweep.ladder;
        let sender = Sender::relay(mission, sweep.profile);
        self.reach(mission, sender, index, profile, &sweep.reaches)
    }

    /// A verdict from downstream.
    pub(crate) fn on_verdict(&mut self, profile: Profile, answer: Answer) -> Next {
        let slacks = &answer.verdict.slacks;
        // What is committed must be met, by a target that this relay has a place for.
        let met = |target: u8| {
            slacks
                .get(usize::from(target))
                .is_some_and(|slack| *slack >= 0.0)
        };
        let fits = slacks.len() <= self.reaches.len() && answer.verdict.commit.is_none_or(met);
        if self.phase == Phase::Waiting && answer.number == self.number && fits {
            self.conclude(profile, answer.verdict)
        } else {
            Next::Stale
        }
    }

    /// The verdict on the current sweep is known. `Next::Work` at the head, if it has to try other targets.
    fn conclude(&mut self, profile: Profile, verdict: Verdict) -> Next {
        self.verdict = verdict;
        if let Some(commit) = self.verdict.commit
            && let Some(&x_m) = self.reaches.get(usize::from(commit))
        {
            self.phase = Phase::Holding;
            self.setpoint = Some(Placement {
                x_m,
                altitude_m: profile.altitude_m,
            });
            self.target = self.ladder.targets().get(usize::from(commit)).copied();
            return Next::Answer { committed: true };
        }
        self.phase = Phase::Answered;
        let Head::Searching(search) = &mut self.head else {
            return Next::Answer { committed: false };
        };
        if search.advance(&self.verdict.slacks).is_err() {
            return self.give_up();
        }
        Next::Work
    }

    /// What to send downstream, while an answer is awaited, by a relay that holds `profile`.
    pub(crate) fn sweep(&self, mission: u16, profile: Profile) -> Option<Sweep> {
        (self.phase == Phase::Waiting).then(|| Sweep {
            number: self.number,
            mission,
            ladder: self.ladder,
            profile,
            reaches: self.reaches.clone(),
        })
    }

    /// What to send upstream, once it is known.
    pub(crate) fn answer(&self, mission: u16) -> Option<Answer> {
        let known = matches!(self.phase, Phase::Answered | Phase::Holding);
        known.then(|| Answer {
            number: self.number,
            mission,
            verdict: self.verdict.clone(),
        })
    }

    pub(crate) const fn number(&self) -> u16 {
        self.number
    }

    pub(crate) const fn sweeps(&self) -> u32 {
        self.sweeps
    }

    pub(crate) const fn phase(&self) -> Phase {
        self.phase
    }

    pub(crate) const fn setpoint(&self) -> Option<Placement> {
        self.setpoint
    }

    pub(crate) const fn target(&self) -> Option<f32> {
        self.target
    }
}
