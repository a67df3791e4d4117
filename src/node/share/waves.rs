//! A relay's share of a wave of altitude levels, and of what was chosen of it.

use super::super::exchange::{Next, Phase};
use super::super::lead::Lead;
use super::{LEVELS_AT_ONCE, Own, Pass, Share};
use crate::placement::levels::{Gained, Levels, TUBE};
use crate::placement::wave::{Choice, Rungs};
use crate::sir::Placement;
use crate::wire::message::{self, Trace};

impl Share {
    /// The levels that this relay weighs in a pass of `count`.
    pub(super) fn levels(&self, own: Own<'_>, count: u8) -> Levels {
        if own.settings.hold_altitude || count == 1 {
            Levels::held(self.altitude_m, count)
        } else if count == TUBE {
            self.tube
        } else {
            Levels::even(own.mission.config().band, count)
        }
    }

    /// A wave from the relay before.
    pub(crate) fn on_wave(&mut self, own: Own<'_>, wave: &message::Wave<'_>) -> Next {
        if own.mission.interferer().is_none() {
            return Next::Stale;
        }
        let same = matches!(self.pass, Pass::Wave) && self.wave.is_of(wave.rungs);
        let arrival = self.exchange.arrival(wave.number, same);
        if let Some(next) = arrival.refused(self.exchange) {
            return next;
        }
        self.exchange.take(wave.number);
        self.exchange.phase = Phase::Waiting;
        self.pass = Pass::Wave;
        let levels = self.levels(own, wave.levels.count());
        self.wave.take(
            own.mission,
            wave.rungs,
            wave.levels,
            wave.power_w,
            wave.reaches,
            levels,
        );
        Next::Work { moved: false }
    }

    /// Works out some more of this relay's share of a wave.
    pub(super) fn go_on_with_wave(&mut self, own: Own<'_>) -> Next {
        self.exchange.phase = Phase::Waiting;
        let Some(interferer) = own.mission.interferer() else {
            return Next::Stale;
        };
        if !self
            .wave
            .step(own.mission, interferer, own.index, LEVELS_AT_ONCE)
        {
            return Next::Work { moved: false };
        }
        if !own.is_last() {
            return Next::Forward { moved: false };
        }
        let choice = self.wave.choose(own.mission, self.profile.power_w);
        self.conclude_wave(own, choice)
    }

    /// What was chosen of a wave, from the relay after.
    pub(crate) fn on_trace(&mut self, own: Own<'_>, trace: Trace) -> Next {
        let fits = trace
            .choice
            .is_none_or(|choice| self.wave.start_of(choice).is_some());
        if matches!(self.pass, Pass::Wave)
            && self.wave.is_worked_out()
            && self.exchange.awaits(trace.number)
            && fits
        {
            self.conclude_wave(own, trace.choice)
        } else {
            Next::Stale
        }
    }

    /// What was chosen of the current wave is known.
    pub(super) fn conclude_wave(&mut self, own: Own<'_>, choice: Option<Choice>) -> Next {
        let (rungs, levels) = (self.wave.rungs(), self.wave.levels());
        let last = levels.count() == 1;
        self.choice = choice.and_then(|choice| self.wave.start_of(choice));
        self.exchange.phase = Phase::Answered;
        match choice {
            Some(choice) if last => {
                self.setpoint = self.wave.place(own.mission, choice).map(|x_m| Placement {
                    x_m,
                    altitude_m: self.altitude_m,
                });
                self.target = Some(rungs.target(choice.target));
                self.exchange.phase = Phase::Holding;
                self.lead = Lead::No;
                return Next::Answer {
                    moved: true,
                    agreed: true,
                };
            }
            _ => self.weigh(own, rungs, levels, choice),
        }
        let Lead::Climbing(climb) = &mut self.lead else {
            return Next::Answer {
                moved: false,
                agreed: false,
            };
        };
        if last {
            // The chain does not meet any more what it met at these altitudes: a relay has changed. Find out what it meets now.
            if self.search_with(own, None, true).is_err() {
                return self.give_up();
            }
        } else {
            climb.advance(rungs, choice);
        }
        Next::Work { moved: false }
    }

    /// Takes the altitude that was chosen, if any was, and finds out which to weigh next.
    pub(super) fn weigh(
        &mut self,
        own: Own<'_>,
        rungs: Rungs,
        levels: Levels,
        choice: Option<Choice>,
    ) {
        let band = own.band(self.altitude_m);
        match choice {
            Some(choice) => {
                let gain = if choice.target > 0 {
                    Gained::Something
                } else if rungs.rise(1) <= own.mission.config().tolerance {
                    Gained::Nothing
                } else {
                    Gained::Unknown
                };
                self.tube = levels.about(band, choice.level, gain);
                self.altitude_m = levels.altitude(band, choice.level);
            }
            None if levels.count() == TUBE => self.tube = levels.narrowed(),
            // Nothing came of the whole band: look about where the relay stands.
            None => self.tube = Levels::about_held(band, self.altitude_m, levels.count()),
        }
    }
}
