//! `cargo decode`: prints frames field by field, from a capture, a byte file or a port.

mod options;

use std::fs::File;
use std::io::{self, BufWriter, IsTerminal as _, Read, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::Parser as _;
use uav_relay_command::{Failure, ended, usage};
use uav_relay_decode::dissector;
use uav_relay_decode::format::Format;
use uav_relay_decode::frame;
use uav_relay_decode::shown::{Shown, json, text};
use uav_relay_decode::source::{self, Item, Packet, SourceError};
use uav_relay_decode::tags::TagVerifier;
use uav_relay_scenario::key;

use options::Options;

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => ended(run(&options)),
        Err(error) => usage(&error),
    }
}

fn run(options: &Options) -> Result<(), Failure> {
    let format = Format::load().map_err(Failure::input)?;
    if let Some(file) = &options.dissector {
        return write_dissector(file, &format);
    }
    let key = options.key.as_deref();
    let key = key.map(|file| key::load("--key", file)).transpose();
    let mut printer = Printer {
        format: &format,
        tags: TagVerifier::new(key.map_err(Failure::input)?),
        json: options.json,
        number: 0,
        out: BufWriter::new(io::stdout().lock()),
    };
    let (name, input) = open(options.file.as_deref())?;
    match source::read(input, |item| printer.take(item)) {
        Ok(()) => Ok(()),
        // If the reader has closed the pipe, as `head` does, this is no error.
        Err(SourceError::Taken(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(SourceError::Taken(error)) => {
            let line = format!("standard output: cannot be written: {error}");
            Err(Failure::input(line))
        }
        Err(SourceError::Read(error)) => {
            Err(Failure::input(format!("{name}: cannot be read: {error}")))
        }
        Err(SourceError::Capture(error)) => Err(Failure::input(format!(
            "{name}: is not a valid capture: {error}"
        ))),
    }
}

/// Returns the signing key at the end of the capture's comment, if any. A simulation writes the key there.
fn of_comment(comment: &str) -> Option<[u8; 32]> {
    let (_, digits) = comment.rsplit_once(", key ")?;
    key::parse(digits).ok()
}

fn open(file: Option<&Path>) -> Result<(String, Box<dyn Read>), Failure> {
    match file.filter(|file| *file != Path::new("-")) {
        Some(file) => {
            let name = file.display().to_string();
            match File::open(file) {
                Ok(input) => Ok((name, Box::new(input))),
                Err(error) => Err(Failure::input(format!("{name}: cannot be read: {error}"))),
            }
        }
        None if io::stdin().is_terminal() => Err(Failure::input(
            "FILE: is missing: must be a capture (pcapng) or a file of raw bytes, unless a pipe supplies the bytes",
        )),
        None => Ok(("standard input".to_owned(), Box::new(io::stdin()))),
    }
}

struct Printer<'f, W: Write> {
    format: &'f Format,
    tags: TagVerifier,
    json: bool,
    number: u64,
    out: W,
}

impl<W: Write> Printer<'_, W> {
    fn take(&mut self, item: Item<'_>) -> io::Result<()> {
        match item {
            Item::Comment(comment) => {
                // A simulation writes the key into the capture's comment.
                if let Some(key) = of_comment(comment)
                    && !self.tags.has_key()
                {
                    self.tags = TagVerifier::new(Some(key));
                }
                if !self.json {
                    writeln!(self.out, "{comment}")?;
                }
                self.out.flush()
            }
            Item::Packet(packet) => self.packet(&packet),
        }
    }

    fn packet(&mut self, packet: &Packet<'_>) -> io::Result<()> {
        self.number += 1;
        let frame = frame::read(self.format, packet.wire, packet.len);
        let tag = self.tags.check(&frame);
        let shown = Shown {
            number: self.number,
            packet,
            frame: &frame,
            tag,
        };
        let said = if self.json {
            json(&shown)?
        } else {
            text(&shown)
        };
        self.out.write_all(said.as_bytes())?;
        self.out.flush()
    }
}

fn write_dissector(file: &Path, format: &Format) -> Result<(), Failure> {
    let text = dissector::lua(format);
    if file == Path::new("-") {
        uav_relay_command::print(&text);
        return Ok(());
    }
    std::fs::write(file, text).map_err(|error| {
        let line = format!("{}: --dissector cannot be written: {error}", file.display());
        Failure::input(line)
    })
}
