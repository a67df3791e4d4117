//! What the chain flies by, and when something else takes its place.
//!
//! | what the sums say | what is believed | what follows |
//! | --- | --- | --- |
//! | a source | nothing yet | it is believed |
//! | a source | another one, and more than 1 % of the SIR hangs on it | it is believed if chance would not make it so, or if a quarter more is known than when the last one was |
//! | a source | nearly the same | nothing |
//! | too few places | nothing yet | the next spread: the relays hear other places |
//! | too few places, or no source | a source that what is heard contradicts | the relays spread evenly |
//! | too few places, or no source | a source | it is kept |

use super::ends::{judge, v_at_end};
use super::fit::{Fit, FoundSource, Unfit, misfit};
use super::level::{EndsOff, Level, Levels, is_level};
use super::sums::Sums;
use super::terms::{coefficients, expected_v, terms};
use super::track::Track;
use crate::mission::{Interferer, Mission};
use crate::place::Placement;
use crate::settings::Listen;
use crate::time::{Duration, Instant};

/// What the chain believes of the interference.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Belief {
    /// What the mission says.
    #[default]
    Mission,
    /// Nothing: the relays spread along the line, to hear.
    Unknown(Spread),
    /// One source.
    Source {
        /// Where, and how strong.
        source: Interferer,
        /// What the receiver hears of it, W; 0 where it has not said, and the source's path loss over the ground is taken.
        receiver_w: f32,
    },
}

/// How relays spread that know nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Spread {
    /// Evenly.
    #[default]
    Even,
    /// The first hop half as long as the others.
    TowardTx,
    /// The last hop half as long as the others.
    TowardRx,
}

impl Spread {
    const fn next(self) -> Self {
        match self {
            Self::Even => Self::TowardTx,
            Self::TowardTx => Self::TowardRx,
            Self::TowardRx => Self::Even,
        }
    }
}

/// A belief and its number, which counts up at the leader and wraps.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Told {
    /// Its number, 0 for what was loaded.
    pub number: u16,
    /// What is believed.
    pub belief: Belief,
}

/// Relative, as a mean square: what is not worth an agreement, though more is known,
const WORTH: f64 = 1e-5;

/// and what is a change of the interference,
const CHANGE: f64 = 1e-4;

/// if it is so many times what chance would make: where nothing is seen to move, and where something is.
const BEYOND_CHANCE: f64 = 8.0;
const FOLLOWED: f64 = 1.5;

/// Once a chain has settled, only what is beyond so many times is followed: then it is another world, of which all is to be learned again.
const ANOTHER: f64 = 64.0;

/// The same for the receiver alone.
const LOUDER: f64 = 0.025;

/// How many times what chance would make the track may be off what is heard.
const ASTRAY: f64 = 4.0;

/// How much more has to be known for the same again, and how many other beliefs there are until a chain has settled: a world that is
/// still becomes silent.
const LEARNED: f64 = 1.1;
const REFINED: u8 = 4;

/// How long drones take to follow by a few metres.
const FLIGHT: Duration = Duration::from_millis(1_000);

/// A mean square of relative errors above which a belief is contradicted.
const CONTRADICTED: f64 = 0.25;

/// The same of what the mission says, in times what is expected of a measurement.
const GUESSED: f64 = 16.0;

/// How much was known when a belief was taken up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Knowledge {
    /// Places over the variance of one.
    information: f64,
    /// How far off it may be by chance, relative, as a mean square.
    chance: f64,
    /// How often another one was taken up in the same world; of an interferer that moves, because more was known.
    refined: u8,
    /// Which way the interferer goes.
    track: Track,
}

impl Knowledge {
    pub(crate) const NOTHING: Self = Self {
        information: 0.0,
        chance: 0.0,
        refined: 0,
        track: Track::NONE,
    };
}

/// What sums make of a belief.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Review {
    /// What is to be believed instead.
    pub(crate) adopt: Option<Belief>,
    /// How much was known by then.
    pub(crate) known: Knowledge,
    /// Why there is no source.
    pub(crate) unfit: Option<Unfit>,
    /// Which ends measure something else than follows from what the relays hear.
    pub(crate) ends: EndsOff,
}

/// Reviews `told`, of which `mission` is made, by `sums` along the chain and what its ends hear. `before` is what was
/// known when it was taken up.
pub(crate) fn review(
    mission: &Mission,
    belief: &Belief,
    sums: &Sums,
    levels: &Levels,
    listen: &Listen,
    before: Knowledge,
    now: Instant,
) -> Review {
    let known = mission.known_source();
    let mut levels = *levels;
    let (fit, found) = match fitted(mission, sums, &mut levels, listen) {
        Ok(found) => found,
        Err(unfit) => {
            return Review {
                ends: levels.off,
                ..at_a_loss(mission, belief, sums, listen, before, unfit)
            };
        }
    };
    let ends = levels.off;
    let unfit = if found.is_one {
        ends.unknown.then_some(Unfit::Contradiction)
    } else {
        Some(Unfit::NoSource)
    };
    let still = listen.is_for_one_that_stands();
    let mut track = before.track;
    let heard = Instant::from_micros(now.as_micros().saturating_sub(sums.age_us()));
    let ahead = (found.is_one && !still)
        .then(|| followed(mission, &fit, &found, &mut track, [heard, now], listen))
        .flatten();
    let (source, moves) = (ahead.unwrap_or(found.source), ahead.is_some());
    let receiver_w = at_receiver(
        mission,
        &fit,
        &source,
        levels.receiver,
        listen.relative_error,
    );
    let information = fit.information();
    let before = Knowledge { track, ..before };
    let keep = |unfit| Review {
        adopt: None,
        known: before,
        unfit,
        ends,
    };
    let adopt = |refined| Review {
        adopt: Some(Belief::Source { source, receiver_w }),
        known: Knowledge {
            information,
            chance: fit.chance(),
            refined,
            track,
        },
        unfit,
        ends,
    };
    let Some(known) = known else { return adopt(0) };
    let chance = fit.chance();
    let off = fit.off(
        &coefficients(mission, &source),
        &coefficients(mission, &known),
    );
    let receiver = match belief {
        Belief::Source {
            receiver_w: before, ..
        } if receiver_w > 0.0 || *before > 0.0 => {
            // Where only one of the two says anything, all of it is new.
            let ratio = f64::from(before - receiver_w) / f64::from(receiver_w);
            ratio * ratio
        }
        _ => 0.0,
    };
    let by_chance = chance + before.chance;
    let settled = before.refined >= REFINED;
    let again = if settled { 0 } else { before.refined + 1 };
    let times = match (moves, still && settled) {
        (true, _) => FOLLOWED,
        (false, false) => BEYOND_CHANCE,
        (false, true) => ANOTHER,
    };
    if off > CHANGE && off > times * by_chance || receiver > LOUDER {
        adopt(if still { again } else { 0 })
    } else if (off > WORTH || receiver > 4.0 * WORTH)
        && information > LEARNED * before.information
        && !settled
    {
        adopt(again)
    } else {
        keep(unfit)
    }
}

/// The fit of all that is heard, and the source that it speaks of; and which ends are off, whose levels are taken away.
fn fitted(
    mission: &Mission,
    sums: &Sums,
    levels: &mut Levels,
    listen: &Listen,
) -> Result<(Fit, FoundSource), Unfit> {
    let mut fit = Fit::of(sums, listen.relative_error)?;
    levels.off = judge(mission, &fit, levels, listen.relative_error);
    if levels.off.transmitter {
        levels.transmitter = Level::default();
    }
    if levels.off.receiver {
        levels.receiver = Level::default();
    }
    let mut sums = *sums;
    let ends = [
        (0.0, levels.transmitter),
        (mission.config().distance_m, levels.receiver),
    ];
    for (x_m, level) in ends {
        fit = with_end(mission, fit, &mut sums, x_m, level, listen.relative_error);
    }
    let side_m = mission.known_source().map_or(1.0, |source| source.y_m);
    Ok((fit, fit.source(mission, side_m)?))
}

/// Where an interferer that is seen to move will be when the chain stands for it. `heard` is when what is heard was, on average.
fn followed(
    mission: &Mission,
    fit: &Fit,
    found: &FoundSource,
    track: &mut Track,
    [heard, now]: [Instant; 2],
    listen: &Listen,
) -> Option<Interferer> {
    track.take(found, heard, listen.half_life);
    // What is agreed on now holds until the next look, and the drones have to fly there.
    let ahead = Duration::from_micros(listen.every.as_micros() / 2);
    let [was, will] = track.ahead(now + ahead + FLIGHT)?;
    let power_w = fit.power_w(mission, was)?;
    let at = |[x_m, y_m]: [f32; 2]| Interferer { power_w, x_m, y_m };
    if fit.off_by(&coefficients(mission, &at(was))) <= ASTRAY * fit.chance() {
        return Some(at(will));
    }
    *track = Track::NONE;
    track.take(found, heard, listen.half_life);
    None
}

/// The fit that counts the end at `x_m` as one place more, as far as what it hears is in line with the others: then the path loss over the
/// ground is what the mission says.
#[expect(
    clippy::large_types_passed_by_value,
    reason = "it is what comes of it, too"
)]
fn with_end(
    mission: &Mission,
    fit: Fit,
    sums: &mut Sums,
    x_m: f32,
    level: Level,
    relative_error: f32,
) -> Fit {
    if !level.is_heard() {
        return fit;
    }
    let config = mission.config();
    let there = terms(config.distance_m, Placement::on_line(x_m, 0.0));
    let v = v_at_end(mission, level);
    let expected = fit.value(&there);
    let off = v / expected - 1.0;
    let chance = 25.0 * (fit.variance() + fit.relative_variance(&there));
    let (Some(v), Some(expected)) = (expected_v(v), expected_v(expected)) else {
        return fit;
    };
    if !(off * off < chance) {
        return fit;
    }
    sums.add(&there, v, expected, 1.0, level.count);
    Fit::of(sums, relative_error).unwrap_or(fit)
}

/// What the receiver hears, W: what it says, and, as far as that is in line with it, what the source makes of it over the ground. Both count
/// by how sure they are. 0 where the receiver has said nothing.
#[expect(clippy::cast_possible_truncation, reason = "checked")]
fn at_receiver(
    mission: &Mission,
    fit: &Fit,
    source: &Interferer,
    receiver: Level,
    relative_error: f32,
) -> f32 {
    if !receiver.is_heard() {
        return 0.0;
    }
    let heard = f64::from(receiver.power_w);
    let chance = f64::from(relative_error) * f64::from(relative_error) / f64::from(receiver.count);
    let config = mission.config();
    let (beyond, aside) = (source.x_m - config.distance_m, source.y_m);
    let (beyond, aside) = (f64::from(beyond), f64::from(aside));
    let squared = beyond * beyond + aside * aside;
    let made = f64::from(source.power_w) / (config.channel.mu_nlos() * squared);
    let unsure = fit.relative_variance(&terms(
        config.distance_m,
        Placement::on_line(config.distance_m, 0.0),
    ));
    let off = made / heard - 1.0;
    if !(off * off < 25.0 * (chance + unsure)) {
        return receiver.power_w;
    }
    let both_w = (heard * (1.0 + off * chance / (chance + unsure))) as f32;
    if is_level(both_w) {
        both_w
    } else {
        receiver.power_w
    }
}

fn at_a_loss(
    mission: &Mission,
    belief: &Belief,
    sums: &Sums,
    listen: &Listen,
    before: Knowledge,
    unfit: Unfit,
) -> Review {
    let known = mission.known_source();
    let expected = f64::from(listen.relative_error) * f64::from(listen.relative_error);
    let allowed = match belief {
        // What nobody has heard is believed no more than what is heard bears out.
        Belief::Mission => GUESSED * expected,
        _ => CONTRADICTED,
    };
    let contradicted =
        known.is_none_or(|known| misfit(sums, &coefficients(mission, &known)) > allowed);
    let spread = match belief {
        Belief::Unknown(spread) => spread.next(),
        Belief::Mission if known.is_none() => Spread::Even.next(),
        _ => Spread::Even,
    };
    let heard = sums.count() > 0.0;
    Review {
        adopt: (heard && contradicted).then_some(Belief::Unknown(spread)),
        known: if contradicted {
            Knowledge::NOTHING
        } else {
            before
        },
        unfit: Some(unfit),
        ends: EndsOff::NONE,
    }
}
