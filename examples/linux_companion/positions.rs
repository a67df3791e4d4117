//! Positions of the drone, read from a FIFO. Each line is `x_m y_m altitude_m`, optionally followed by the interference measured
//! there, `1.2e-12` in W or `-95 dBm`; or `receiver POWER`, measured at the ground receiver; or `endurance SECONDS`, the remaining time of flight.

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
    /// First position, to which the drone returns.
    home: Option<Placement>,
    speed_m_s: f32,
}

impl Positions {
    /// Opens the FIFO `path` with the drone's positions. `listens` permits lines with a measured interference power.
    /// `speed_m_s` is that of the way home.
    pub(crate) fn open(path: &Path, listens: bool, speed_m_s: f32) -> Result<Self, String> {
        Ok(Self {
            fifo: Fifo::open("--positions", path)?,
            listens,
            bad: InvalidLines::default(),
            newest: None,
            home: None,
            speed_m_s,
        })
    }

    pub(crate) fn fd(&self) -> BorrowedFd<'_> {
        self.fifo.fd()
    }

    /// Returns the newest position and remaining time of flight, s, received since the last call.
    ///
    /// The time is NaN if it is invalid. Passes measurements to `on_sample` and logs the first invalid line. Work: that of [`Fifo::read`].
    pub(crate) fn newest(
        &mut self,
        now: Instant,
        log: &Log,
        on_sample: &mut impl FnMut(Sample),
    ) -> (Option<Placement>, Option<f32>) {
        let (mut newest, mut endurance_s) = (None, None);
        let Self {
            fifo, listens, bad, ..
        } = self;
        fifo.read(|line| match parse_line(line, *listens) {
            Ok(Line::Position(place, sample)) => {
                newest = place.or(newest);
                sample.into_iter().for_each(&mut *on_sample);
            }
            Ok(Line::Endurance(left_s)) => endurance_s = Some(left_s),
            Err(why) => {
                let expected = if *listens {
                    "x_m y_m altitude_m [POWER], receiver POWER or endurance SECONDS"
                } else {
                    "x_m y_m altitude_m or endurance SECONDS"
                };
                bad.refuse(now, log, "position", line, [why.as_str(), expected]);
            }
        });
        self.newest = newest.map(|place| (now, place)).or(self.newest);
        self.home = self.home.or(newest);
        (newest, endurance_s)
    }

    /// Returns the time of the way home, s; NaN before the first position.
    pub(crate) fn home_s(&self) -> f32 {
        self.newest
            .zip(self.home)
            .map_or(f32::NAN, |((_, at), to)| {
                let level_m = (at.x_m - to.x_m).hypot(at.y_m - to.y_m);
                (level_m + (at.altitude_m - to.altitude_m).abs()) / self.speed_m_s
            })
    }

    /// Returns the drone's newest position, unless it is older than 3 s.
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

/// Logs whether the drones are kept apart while they move, which requires `positions`.
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

/// Parsed line: position, measurement, and remaining time of flight, s (NaN if it is no number).
enum Line {
    Position(Option<Placement>, Option<Sample>),
    Endurance(f32),
}

/// Parses a line: position with or without power, `receiver` and a power, or `endurance` and a time.
///
/// Returns the reason as an error if the line is invalid, or if it has a power without `listens`.
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
    // An invalid time counts as unknown, which is an event of the relay.
    if let ["endurance", left @ ..] = words.as_slice() {
        let left_s = match left {
            [left] => left.parse().unwrap_or(f32::NAN),
            _ => f32::NAN,
        };
        return Ok(Line::Endurance(left_s));
    }
    let [x, y, altitude, rest @ ..] = &words[..] else {
        return Err("it has fewer than three numbers".to_owned());
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
