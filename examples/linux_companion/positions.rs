//! Where the drone is, line by line from a FIFO: the autopilot's side writes `x_m y_m altitude_m` as often as it knows better, and behind
//! that the interference that was heard there, if it was measured: `1.2e-12` in W, or `-95 dBm`. `receiver POWER` is what the ground receiver
//! hears.

use std::os::fd::BorrowedFd;
use std::path::Path;

use uav_relay::{Duration, Instant, Placement, Sample};
use uav_relay_linux::lines::{self, Fifo, LONGEST, POWER};
use uav_relay_linux::log::Log;

/// A position older than this is not the drone's place any more.
const STALE: Duration = Duration::from_millis(3_000);

/// The FIFO, and what its lines may say.
#[derive(Debug)]
pub(crate) struct Positions {
    fifo: Fifo,
    /// Whether a line may have a power, too.
    listens: bool,
    /// Lines that were none.
    bad: u64,
    /// The newest position, and when it came.
    newest: Option<(Instant, Placement)>,
}

impl Positions {
    /// Opens it.
    ///
    /// # Errors
    /// One line that says what does not work.
    pub(crate) fn open(path: &Path, listens: bool) -> Result<Self, String> {
        Ok(Self {
            fifo: Fifo::open("--positions", path)?,
            listens,
            bad: 0,
            newest: None,
        })
    }

    pub(crate) fn fd(&self) -> BorrowedFd<'_> {
        self.fifo.fd()
    }

    /// The newest of the positions that have come since, and every measurement is handed to `heard`; the first line that is neither is said.
    /// Work: that of [`Fifo::read`].
    pub(crate) fn newest(
        &mut self,
        now: Instant,
        log: &Log,
        heard: &mut impl FnMut(Sample),
    ) -> Option<Placement> {
        let mut newest = None;
        let Self {
            fifo, listens, bad, ..
        } = self;
        fifo.read(|line| match news(line) {
            Some((place, sample)) if *listens || sample.is_none() => {
                newest = place.or(newest);
                sample.into_iter().for_each(&mut *heard);
            }
            _ => refuse(now, log, *listens, bad, line),
        });
        self.newest = newest.map(|place| (now, place)).or(self.newest);
        newest
    }

    /// Returns the newest position, unless it is older than 3 s.
    pub(crate) fn place(&self, now: Instant) -> Option<Placement> {
        let fresh = self.newest.filter(|(at, _)| now.since(*at) < STALE);
        fresh.map(|(_, place)| place)
    }

    /// Lines that were none.
    pub(crate) const fn bad(&self) -> u64 {
        self.bad
    }

    /// How many lines were no position, if any were.
    pub(crate) fn stopped(&self, now: Instant, log: &Log) {
        if self.bad > 0 {
            log.tell(
                now,
                "position",
                format_args!("{} lines were none", self.bad),
            );
        }
    }
}

/// The first line that is none is said.
fn refuse(now: Instant, log: &Log, listens: bool, bad: &mut u64, line: &[u8]) {
    *bad += 1;
    if *bad > 1 {
        return;
    }
    let text = String::from_utf8_lossy(line);
    log.tell(
        now,
        "position",
        format_args!(
            "{text:?} is not x_m y_m altitude_m{}; more of these are only counted",
            if listens {
                format!(" [POWER] or receiver POWER, {POWER}")
            } else {
                String::new()
            }
        ),
    );
}

/// Says whether drones are kept apart.
pub(crate) fn started(log: &Log, positions: Option<&Positions>) {
    match positions {
        Some(positions) => log.tell(
            Instant::ZERO,
            "guarded",
            format_args!(
                "setpoints keep drones apart on their way, by {}",
                positions.fifo
            ),
        ),
        None => log.tell(
            Instant::ZERO,
            "unguarded",
            format_args!("no --positions, nothing keeps drones apart on their way"),
        ),
    }
}

/// Three numbers, a fourth where a power was measured there; or the word `receiver`, and the power that was measured at that.
fn news(text: &[u8]) -> Option<(Option<Placement>, Option<Sample>)> {
    let text = std::str::from_utf8(text)
        .ok()
        .filter(|_| text.len() <= LONGEST)?;
    let words: Vec<&str> = text.split_whitespace().collect();
    let number = |word: &str| word.parse::<f32>().ok().filter(|number| number.is_finite());
    if let ["receiver", power @ ..] = words.as_slice() {
        let power_w = lines::power_w(power)?;
        return Some((None, Some(Sample::Receiver { power_w })));
    }
    let [x, y, altitude, rest @ ..] = &words[..] else {
        return None;
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
            power_w: lines::power_w(power)?,
        }),
    };
    Some((Some(at), sample))
}
