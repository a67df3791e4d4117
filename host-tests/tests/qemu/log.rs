//! Log of a drone: defmt frames from its UART, decoded by the strings in the ELF.

use std::io::Read as _;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::mpsc::Sender;

use defmt_decoder::{DecodeError, Table};

#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Line {
    /// Number of the drone that logged the line, 1 to N.
    pub(crate) drone: u16,
    /// Time of the log line on the drone's clock, µs.
    pub(crate) at: u64,
    pub(crate) text: String,
}

impl Line {
    /// Returns the text after `label` in the line; `None` if the line has no such label.
    pub(crate) fn after(&self, label: &str) -> Option<&str> {
        self.text
            .split_once(label)
            .map(|(_, rest)| rest.trim_start())
    }

    /// Returns the f32 bits that the line has in parentheses after `label`. `None` if the line has no such label.
    fn bits(&self, label: &str) -> Option<u32> {
        let (_, rest) = self.after(label)?.split_once("(0x")?;
        u32::from_str_radix(rest.split_once(')')?.0, 16).ok()
    }

    /// Returns the f32 bits of x, y and altitude in a line about a setpoint; `None` for other lines.
    pub(crate) fn setpoint(&self) -> Option<[u32; 3]> {
        self.text
            .starts_with("setpoint")
            .then(|| [" x ", " y ", " altitude "].map(|label| self.bits(label).unwrap()))
    }

    pub(crate) fn counter(&self, name: &str) -> Option<u64> {
        let rest = self.after(&format!(" {name}: "))?;
        let end = rest.find(|c: char| !c.is_ascii_digit())?;
        rest[..end].parse().ok()
    }
}

pub(crate) fn table(image: &Path) -> Table {
    let elf = std::fs::read(image).unwrap();
    Table::parse(&elf)
        .unwrap()
        .expect("an image with a defmt table")
}

/// Decodes log lines until the drone is switched off. Data that cannot be decoded becomes a line, too.
pub(crate) fn listen(
    mut port: UnixStream,
    drone: u16,
    table: &'static Table,
    lines: &Sender<Line>,
) {
    let mut decoder = table.new_stream_decoder();
    let mut buffer = [0; 1024];
    while let Ok(count @ 1..) = port.read(&mut buffer) {
        decoder.received(&buffer[..count]);
        loop {
            let line = match decoder.decode() {
                Ok(frame) => {
                    let at = frame.display_timestamp().unwrap().to_string();
                    Line {
                        drone,
                        at: micros(&at),
                        text: frame.display_message().to_string(),
                    }
                }
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) => Line {
                    drone,
                    at: 0,
                    text: "MALFORMED".into(),
                },
            };
            if lines.send(line).is_err() {
                return;
            }
        }
    }
}

/// Converts seconds with six decimals to microseconds.
fn micros(text: &str) -> u64 {
    let (seconds, fraction) = text.trim().split_once('.').unwrap();
    assert_eq!(fraction.len(), 6, "{text}");
    seconds.parse::<u64>().unwrap() * 1_000_000 + fraction.parse::<u64>().unwrap()
}
