//! Positions of the drone, read from a FIFO.
//!
//! A line has one of three forms. `x_m y_m altitude_m` is a position; the interference measured there may follow, as
//! `1.2e-12` in W or as `-95 dBm`. `receiver POWER` is the interference at the ground receiver. `endurance SECONDS
//! HOME` has the remaining flight time and the time to fly home.

use std::os::fd::BorrowedFd;
use std::path::Path;

use uav_relay::{Duration, Instant, Placement, Sample};
use uav_relay_linux::lines::{self, Fifo, InvalidLines};
use uav_relay_linux::log::Log;

const STALE: Duration = Duration::from_millis(3_000);

#[derive(Debug)]
pub(crate) struct Positions {
    fifo: Fifo,
    listens: bool,
    bad: InvalidLines,
    newest: Option<(Instant, Placement)>,
}

impl Positions {
    /// Opens the FIFO `path`. If `listens` is true, lines with a measured interference are permitted.
    pub(crate) fn open(path: &Path, listens: bool) -> Result<Self, String> {
        Ok(Self {
            fifo: Fifo::open("--positions", path)?,
            listens,
            bad: InvalidLines::default(),
            newest: None,
        })
    }

    pub(crate) fn fd(&self) -> BorrowedFd<'_> {
        self.fifo.fd()
    }

    /// Returns the drone's newest position, and its newest times, since the last call; `None` if missing.
    ///
    /// The times are the remaining flight time and the time to fly home, s; NaN if invalid. Measurements of
    /// interference are passed to `on_sample`, and the first invalid line is logged. One call has the work of one
    /// [`Fifo::read`].
    pub(crate) fn newest(
        &mut self,
        now: Instant,
        log: &Log,
        on_sample: &mut impl FnMut(Sample),
    ) -> (Option<Placement>, Option<[f32; 2]>) {
        let (mut newest, mut endurance_s) = (None, None);
        let Self {
            fifo, listens, bad, ..
        } = self;
        fifo.read(|line| match parse_line(line, *listens) {
            Ok(Line::Position(place, sample)) => {
                newest = place.or(newest);
                sample.into_iter().for_each(&mut *on_sample);
            }
            Ok(Line::Endurance(times)) => endurance_s = Some(times),
            Err(why) => {
                let expected = if *listens {
                    "one of `x_m y_m altitude_m [POWER]`, `receiver POWER`, `endurance SECONDS HOME` (remaining time of flight, and time of the way home, both in s)"
                } else {
                    "one of `x_m y_m altitude_m`, `endurance SECONDS HOME` (remaining time of flight, and time of the way home, both in s)"
                };
                bad.refuse(
                    now,
                    log,
                    "position",
                    line,
                    ["--positions", why.as_str(), expected],
                );
            }
        });
        self.newest = newest.map(|place| (now, place)).or(self.newest);
        (newest, endurance_s)
    }

    /// Returns the drone's newest position; `None` if the position is older than 3 s.
    pub(crate) fn place(&self, now: Instant) -> Option<Placement> {
        let fresh = self.newest.filter(|(at, _)| now.since(*at) < STALE);
        fresh.map(|(_, place)| place)
    }

    pub(crate) const fn invalid_lines(&self) -> u64 {
        self.bad.count()
    }

    pub(crate) fn stopped(&self, now: Instant, log: &Log) {
        let bad = self.invalid_lines();
        if bad > 0 {
            log.line(
                now,
                "position",
                format_args!("{bad} lines of --positions were invalid, and ignored"),
            );
        }
    }
}

/// Logs, for a relay without an autopilot, if the guard (collision avoidance) is on.
///
/// The guard keeps drones apart in flight. It is off without `positions`.
pub(crate) fn started(log: &Log, positions: Option<&Positions>) {
    let now = Instant::ZERO;
    if let Some(Positions { fifo, .. }) = positions {
        let what = format_args!(
            "drones are kept apart while they move; this drone's positions are read from {fifo}"
        );
        log.line(now, "guarded", what);
    } else {
        let what = "no --positions and no --autopilot: drones are not kept apart while they move";
        log.line(now, "unguarded", what);
    }
}

/// Parsed line: a position and a measurement, or the remaining flight time and the time to fly home, s.
///
/// An invalid time is NaN.
enum Line {
    Position(Option<Placement>, Option<Sample>),
    Endurance([f32; 2]),
}

/// Parses a line with a position, a measured interference power, or times of flight.
///
/// The forms are `X Y ALTITUDE [POWER]`, `receiver POWER` and `endurance SECONDS HOME`. Returns the reason as an error
/// if the line is invalid, or has a power although `listens` is false.
fn parse_line(text: &[u8], listens: bool) -> Result<Line, String> {
    let words = lines::words(text)?;
    let number = |word: &str| {
        let number = word.parse::<f32>().ok().filter(|it| it.is_finite());
        number.ok_or_else(|| format!("{word:?} is not a number"))
    };
    let measured_w = |power: &[&str]| {
        if listens {
            lines::power_w(power)
        } else {
            let power = power.join(" ");
            Err(format!("the power {power:?} needs the option --listen"))
        }
    };
    if let ["receiver", power @ ..] = words.as_slice() {
        let power_w = measured_w(power)?;
        return Ok(Line::Position(None, Some(Sample::Receiver { power_w })));
    }
    // An invalid time counts as unknown, and the relay reports an unknown endurance as an event.
    if let ["endurance", times @ ..] = words.as_slice() {
        let time = |word: &str| word.parse().unwrap_or(f32::NAN);
        return Ok(Line::Endurance(match times {
            [left, home] => [time(left), time(home)],
            _ => [f32::NAN; 2],
        }));
    }
    let [x, y, altitude, rest @ ..] = &words[..] else {
        return Err("the line must have at least three numbers".to_owned());
    };
    let at = Placement {
        x_m: number(x)?,
        y_m: number(y)?,
        altitude_m: number(altitude)?,
    };
    let sample = match rest {
        [] => None,
        power => Some(Sample::Heard {
            at,
            power_w: measured_w(power)?,
        }),
    };
    Ok(Line::Position(Some(at), sample))
}
