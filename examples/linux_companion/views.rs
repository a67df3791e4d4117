//! What the relay has said in the votes on views, in a file: [`ViewRecord::to_bytes`], and a CRC-32C behind it.
//!
//! It is on the disk before the others are told: a promise that is forgotten is none, and two parts of a chain could fly one view each.
//! It is of one flight. Before another one the file is removed.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use uav_relay::wire::crc::CRC_32C;
use uav_relay::{Relay, ViewRecord};

use crate::keep::keep;

/// The file, and what stands in it.
pub(crate) struct Views {
    file: Option<PathBuf>,
    stored: Option<ViewRecord>,
}

impl Views {
    /// What was said before this start; nothing without a `file`, or if there is none yet.
    ///
    /// # Errors
    /// One line that names the file and what is wrong: who has said something and forgotten it had better not vote.
    pub(crate) fn load(file: Option<&Path>) -> Result<Self, String> {
        let stored = match file {
            None => None,
            Some(file) => match std::fs::read(file) {
                Ok(bytes) => Some(parse(&bytes).ok_or_else(|| {
                    named(
                        file,
                        "is damaged, or no record; remove it before another flight",
                    )
                })?),
                Err(error) if error.kind() == ErrorKind::NotFound => None,
                Err(error) => return Err(named(file, &format!("cannot be read: {error}"))),
            },
        };
        Ok(Self {
            file: file.map(Path::to_owned),
            stored,
        })
    }

    /// What was stored before this start.
    pub(crate) const fn stored(&self) -> Option<&ViewRecord> {
        self.stored.as_ref()
    }

    /// One line about a record that the relay does not take.
    pub(crate) fn refused(&self, error: &str) -> String {
        let file = self.file.as_deref().unwrap_or(Path::new(""));
        named(file, error)
    }

    /// Writes down what `relay` has said, if that has changed. Where it cannot be written it is tried again at the next call, and the
    /// relay flies on: a drone in the air is not to be switched off for it.
    pub(crate) fn keep(&mut self, relay: &Relay) {
        let Some(file) = &self.file else { return };
        let record = relay.view_record();
        if self.stored == Some(record) {
            return;
        }
        let body = record.to_bytes();
        let bytes = [&body[..], &sum(&body)].concat();
        match keep(file, &bytes) {
            Ok(()) => self.stored = Some(record),
            Err(error) => eprintln!("{}", named(file, &format!("cannot be written: {error}"))),
        }
    }
}

fn parse(bytes: &[u8]) -> Option<ViewRecord> {
    let (record, check) = bytes.split_at_checked(ViewRecord::LENGTH)?;
    ViewRecord::from_bytes(record).filter(|_| *check == sum(record))
}

fn named(file: &Path, error: &str) -> String {
    format!("--view-file {}: {error}", file.display())
}

fn sum(bytes: &[u8]) -> [u8; 4] {
    CRC_32C.checksum(bytes).to_le_bytes()
}
