//! `cargo chain`: simulated relays run the on-board code and find their positions over simulated links.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser as _;
use uav_relay_capture::{Capture, Direction, Frame, Interface};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::deployment::Deployment;
use uav_relay_screen::Screen;
use uav_relay_sim::cli::{Options, Prepared, Refused};
use uav_relay_sim::command::Failure;
use uav_relay_sim::live::LiveView;
use uav_relay_sim::report::{AttackReport, ChainReport, seconds};
use uav_relay_sim::simulator::chain::Chain;
use uav_relay_sim::simulator::outcome::{Link, OnAir, Outcome};
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::{command, svg};

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => command::ended(with_flying(options).and_then(|it| run(&it.settled()))),
        Err(error) => command::usage(&error),
    }
}

/// Returns the options, with `--flying` from `fleet.flying` of the scenario if only `--fleet` is given.
fn with_flying(mut options: Options) -> Result<Options, Failure> {
    let rotation = &mut options.hostile.flight.rotation;
    if let (Some(fleet), None, Some(file)) = (rotation.fleet, rotation.flying, &options.scenario) {
        let loaded = Deployment::load(file).map_err(|error| Failure::input(error.to_string()))?;
        rotation.flying = loaded.1.fleet.flying;
        let least = fleet / 2 + 1;
        if let Some(flying) = rotation.flying.filter(|it| !(least..=fleet).contains(it)) {
            return Err(Failure::input(format!(
                "{}: fleet.flying = {flying}: must be within {least} to {fleet}, more than half of --fleet {fleet}; or give --flying",
                file.display()
            )));
        }
    }
    Ok(options)
}

fn run(options: &Options) -> Result<(), Failure> {
    let (scenario, name) = match &options.scenario {
        Some(file) => {
            let scenario =
                Scenario::load(file).map_err(|error| Failure::input(error.to_string()))?;
            (scenario, Some(file.display().to_string()))
        }
        None => (Scenario::default(), None),
    };
    let mut run = match Prepared::new(options, scenario, name.as_deref()) {
        Ok(prepared) => prepared,
        Err(Refused::Failed(failure)) => return Err(failure),
        Err(Refused::Reported(report, None)) => return show(options, &report),
        Err(Refused::Reported(report, Some(failure))) => {
            if options.json {
                command::print(&command::json(&*report)?);
            }
            return Err(failure);
        }
    };
    if let Some(count) = options.hostile.flight.rotation.seeds {
        let runs = run.rotations(count)?;
        command::print(&if options.json {
            command::json(&runs)?
        } else {
            runs.table()
        });
        return Ok(());
    }
    if let Some(screen) = screen(options)? {
        let setup = run.setup.clone();
        let mut view = LiveView::new(&setup);
        let chain = run.fly(setup, |chain| {
            fly_live(chain, &mut view, &screen, options.web.speed());
            Ok(())
        })?;
        return show(options, &run.report(&chain.finish()));
    }
    let mut capture = match &options.capture {
        Some(file) => Some(AirCapture::begin(file, &run.setup)?),
        None => None,
    };
    let recorded = Setup {
        record: capture.is_some(),
        ..run.setup.clone()
    };
    let outcome = fly(&run, recorded, capture.as_mut())?;
    capture.map_or(Ok(()), AirCapture::finish)?;
    let mut report = run.report(&outcome);
    report.traffic = run.traffic(&outcome)?;
    if run.setup.attack.is_some() {
        let quiet = Setup {
            attack: None,
            ..run.setup.clone()
        };
        let attack = AttackReport::new(run.setup.auth, &outcome, &fly(&run, quiet, None)?);
        report.error = report.error.or_else(|| attack.harm());
        report.attack = Some(attack);
    }
    if let Some(file) = &options.svg {
        command::write(file, &svg::draw(&run.picture(&outcome, &report)))?;
    }
    report.rotation = run.rotation(&outcome)?;
    if report.rotation.is_some() {
        // The availability would count drones on the ground as missing, so it is left out.
        report.watched = uav_relay_sim::report::chain::AvailabilityReport::default();
    }
    show(options, &report)
}

/// Starts the web page that shows the flight, if the options request it, and prints the page's address.
fn screen(options: &Options) -> Result<Option<Screen>, Failure> {
    let Some(address) = options.web.address else {
        return Ok(None);
    };
    let screen = Screen::start(address)
        .map_err(|error| Failure::input(format!("--web {address}: {error}")))?;
    let public = if screen.is_public() {
        "; every computer that reaches this address can see it"
    } else {
        ""
    };
    command::print_line(&format!(
        "open {} in a browser{public}; Ctrl-C ends the run",
        screen.url()
    ));
    Ok(Some(screen))
}

/// Time between two snapshots of the chain on the web page, in real time.
const FRAME: Duration = Duration::from_millis(100);

/// Runs the simulated chain `speed` times faster than real time, and shows it on `screen`.
///
/// On a computer that is too slow, the virtual time falls behind.
fn fly_live(chain: &mut Chain, view: &mut LiveView, screen: &Screen, speed: f64) {
    let micros = FRAME.mul_f64(speed).as_micros();
    let frame = uav_relay::Duration::from_micros(u64::try_from(micros).unwrap_or(u64::MAX));
    let mut now = uav_relay::Instant::ZERO;
    let mut due = Instant::now();
    loop {
        // A late snapshot does not delay the next one, unless the computer is too slow for all of them.
        due = (due + FRAME).max(Instant::now());
        now = now + frame;
        let has_ended = chain.advance(now);
        screen.show(view.snapshot(chain, now));
        if has_ended {
            return;
        }
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
}

fn fly(
    run: &Prepared<'_>,
    setup: Setup,
    mut capture: Option<&mut AirCapture>,
) -> Result<Outcome, Failure> {
    let mut chain = run.fly(setup, |chain| watch(chain, &mut capture))?;
    if let Some(capture) = capture {
        capture.follow(&mut chain, true)?;
    }
    Ok(chain.finish())
}

/// Runs the simulated chain until its run ends, and shows the progress on the terminal. Meanwhile the frames of the
/// chain are written to `capture`, if there is one.
fn watch(chain: &mut Chain, capture: &mut Option<&mut AirCapture>) -> Result<(), Failure> {
    let mut line = Progress::begin();
    while !chain.step(20_000) {
        if let Some(capture) = capture {
            capture.follow(chain, false)?;
        }
        line.show(|| {
            let (sweeps, now) = chain.progress();
            format!("sweep {sweeps}, {:.0} s of virtual time", seconds(now))
        });
    }
    Ok(())
}

/// Prints the report as a table or as JSON; returns the error in the report, if any, as a failure.
fn show(options: &Options, report: &ChainReport) -> Result<(), Failure> {
    command::print(&if options.json {
        command::json(report)?
    } else {
        report.table()
    });
    match &report.error {
        None => Ok(()),
        Some(error) => Err(Failure::unmet(error.clone())),
    }
}

/// Time from the start of a run until its progress line appears.
const SILENT: Duration = Duration::from_secs(1);

/// Minimum time between two updates of the progress line.
const EVERY: Duration = Duration::from_millis(100);

const ERASE: &str = "\r\u{1b}[K";

/// Progress line of a run on standard error, if that is a terminal. It is erased at the end of the run.
struct Progress {
    started: Instant,
    shown: Option<Instant>,
    is_terminal: bool,
}

impl Progress {
    fn begin() -> Self {
        Self {
            started: Instant::now(),
            shown: None,
            is_terminal: io::stderr().is_terminal(),
        }
    }

    /// Writes `text` to the progress line. Does nothing within the time [`SILENT`] from the start of the run, or within
    /// the time [`EVERY`] from the last update.
    fn show(&mut self, text: impl FnOnce() -> String) {
        let elapsed = self.started.elapsed();
        let is_due = self.shown.is_none_or(|shown| shown.elapsed() >= EVERY);
        if self.is_terminal && elapsed > SILENT && is_due {
            write(&format!("{ERASE}{} s: {}", elapsed.as_secs(), text()));
            self.shown = Some(Instant::now());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.shown.is_some() {
            write(ERASE);
        }
    }
}

/// Writes `text` to standard error. Errors are ignored, because a closed terminal is not an error of the run.
fn write(text: &str) {
    let mut out = io::stderr();
    _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Capture file (pcapng) of the frames of a run, with their virtual times.
struct AirCapture {
    file: PathBuf,
    capture: Capture<BufWriter<File>>,
    interfaces: BTreeMap<Link, Interface>,
    relays: u16,
}

impl AirCapture {
    /// Creates the capture file `file`. The comment in the file has the number of relays, the seed and the key of
    /// `setup`.
    fn begin(file: &Path, setup: &Setup) -> Result<Self, Failure> {
        // The key is not secret: it is drawn from the seed, for this run only.
        let key = setup.secret().map_or_else(String::new, |key| {
            key.iter().fold(", key ".to_owned(), |mut text, byte| {
                _ = write!(text, "{byte:02x}");
                text
            })
        });
        let relays = setup.mission.relays();
        let comment = format!("{relays} simulated relays, seed {}{key}", setup.seed);
        let begun = File::create(file).and_then(|out| {
            Capture::new(BufWriter::new(out), "cargo chain of uav-relay", &comment)
        });
        Ok(Self {
            capture: begun.map_err(|error| failed(file, &error))?,
            file: file.to_owned(),
            interfaces: BTreeMap::new(),
            relays,
        })
    }

    /// Writes the frames whose transmission has ended to the capture file. If `to_the_end` is true, it writes all
    /// frames.
    fn follow(&mut self, chain: &mut Chain, to_the_end: bool) -> Result<(), Failure> {
        let until = if to_the_end {
            uav_relay::Instant::from_micros(u64::MAX)
        } else {
            chain.progress().1
        };
        for frame in chain.frames(until) {
            let written = self.write(&frame);
            written.map_err(|error| failed(&self.file, &error))?;
        }
        Ok(())
    }

    fn write(&mut self, frame: &OnAir) -> io::Result<()> {
        let interface = match self.interfaces.get(&frame.link) {
            Some(known) => *known,
            None => self.open(frame.link)?,
        };
        let frame = Frame {
            at: Duration::from_micros(frame.at.as_micros()),
            bytes: &frame.bytes,
            len: frame.bytes.len(),
            direction: Direction::Unknown,
            comment: &frame.note,
        };
        self.capture.frame(interface, &frame)
    }

    fn open(&mut self, link: Link) -> io::Result<Interface> {
        let node = |number| match number {
            0 => "Tx".to_owned(),
            number if number > self.relays => "Rx".to_owned(),
            number => format!("{number}"),
        };
        let name = match link {
            Link::Shared => "channel".to_owned(),
            Link::After(before) => format!("{}-{}", node(before), node(before + 1)),
        };
        let interface = self.capture.interface(&name, "")?;
        self.interfaces.insert(link, interface);
        Ok(interface)
    }

    fn finish(self) -> Result<(), Failure> {
        let ended = self.capture.finish();
        ended.map(drop).map_err(|error| failed(&self.file, &error))
    }
}

fn failed(file: &Path, error: &io::Error) -> Failure {
    let line = format!("{}: --capture cannot be written: {error}", file.display());
    Failure::input(line)
}
