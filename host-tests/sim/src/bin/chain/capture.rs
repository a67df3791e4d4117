//! Capture file of `--capture`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::Duration;

use uav_relay_capture::{Capture, Direction, Frame, Interface};
use uav_relay_sim::command::Failure;
use uav_relay_sim::simulator::chain::Chain;
use uav_relay_sim::simulator::record::{Link, OnAir};
use uav_relay_sim::simulator::setup::Setup;

/// Capture of a run, with virtual times.
pub(crate) struct AirCapture {
    file: PathBuf,
    capture: Capture<BufWriter<File>>,
    interfaces: BTreeMap<Link, Interface>,
    relays: u16,
}

impl AirCapture {
    /// Creates `file` for a run of `setup`.
    pub(crate) fn begin(file: &Path, setup: &Setup) -> Result<Self, Failure> {
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

    /// Writes the frames that have ended by now, or all frames if `to_the_end` is true.
    pub(crate) fn follow(&mut self, chain: &mut Chain, to_the_end: bool) -> Result<(), Failure> {
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

    pub(crate) fn finish(self) -> Result<(), Failure> {
        let ended = self.capture.finish();
        ended.map(drop).map_err(|error| failed(&self.file, &error))
    }
}

fn failed(file: &Path, error: &io::Error) -> Failure {
    let line = format!("{}: --capture cannot be written: {error}", file.display());
    Failure::input(line)
}
