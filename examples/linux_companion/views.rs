//! File of the relay's votes on views: [`ViewRecord::to_bytes`], followed by a CRC-32C.
//!
//! A vote is on the disk before it is sent, because a relay that forgets a promise could split the chain into two views. While a
//! separate thread writes it nothing is sent; everything else continues. Remove the file before another flight.

use std::io::ErrorKind;
use std::path::Path;

use uav_relay::CRC_32C;
use uav_relay::{Instant, RecordError, ViewRecord};

use crate::relay::Refusal;
use crate::stored::StoredFile;
use uav_relay_linux::log::Log;

const OPTION: &str = "--view-file";

pub(crate) struct Views {
    kept: Option<StoredFile>,
    stored: Option<ViewRecord>,
    writing: Option<ViewRecord>,
    /// Record of the last write, successful or not.
    tried: Option<ViewRecord>,
}

impl Views {
    /// Loads the record of an earlier start; no record without a `file`, or if it does not exist yet.
    ///
    /// # Errors
    /// One line that names the file, the fault and the remedy: a relay that has lost its votes must not vote again in the same
    /// flight.
    pub(crate) fn load(file: Option<&Path>) -> Result<Self, Refusal> {
        let stored = match file {
            None => None,
            Some(file) => match std::fs::read(file) {
                Ok(bytes) => Some(parse(&bytes).ok_or_else(|| Refusal {
                    line: named(
                        file,
                        "is damaged, or no record of views: remove the file before the next flight, and start again",
                    ),
                    is_final: true,
                })?),
                Err(error) if error.kind() == ErrorKind::NotFound => None,
                Err(error) => return Err(named(file, &format!("cannot be read: {error}")).into()),
            },
        };
        Ok(Self {
            kept: file.map(|file| StoredFile::new(OPTION, file)).transpose()?,
            stored,
            writing: None,
            tried: None,
        })
    }

    /// Returns the stored record, at the start that of an earlier run.
    pub(crate) const fn stored(&self) -> Option<&ViewRecord> {
        self.stored.as_ref()
    }

    /// Finishes a write, and retries a failed one when it is due. Call it in each turn of the main loop.
    pub(crate) fn tend(&mut self, now: Instant, log: &Log) {
        let Some(kept) = &mut self.kept else { return };
        if let Some(is_kept) = kept.tend(now, log) {
            self.tried = self.writing.take();
            if is_kept {
                self.stored = self.tried;
            }
        }
        if self.tried != self.stored
            && kept.is_due(now)
            && let Some(record) = self.tried
        {
            self.write(record);
        }
    }

    /// Begins to write `record`. Returns true once it is written, or once the write has failed: a drone in the air must not fall
    /// silent for a full disk.
    pub(crate) fn store(&mut self, record: &ViewRecord) -> bool {
        let is_known = [self.stored, self.tried].contains(&Some(*record));
        if self.kept.is_some() && !is_known {
            self.write(*record);
        }
        self.kept.is_none() || is_known
    }

    /// Passes `record` to the thread that writes, unless that is busy with another one.
    fn write(&mut self, record: ViewRecord) {
        if let Some(kept) = &mut self.kept
            && !kept.is_writing()
        {
            let body = record.to_bytes();
            kept.put([&body[..], &sum(&body)].concat());
            self.writing = Some(record);
        }
    }

    pub(crate) const fn kept(&self) -> Option<&StoredFile> {
        self.kept.as_ref()
    }

    pub(crate) fn finish(&mut self, now: Instant, log: &Log) {
        if let Some(kept) = &mut self.kept {
            kept.finish(now, log);
        }
    }
}

pub(crate) fn refused(file: Option<&Path>, error: RecordError) -> Refusal {
    let what = match error {
        RecordError::Base => format!(
            "{error}: for a new flight remove the file, and start again; in the same flight start the relay with the mission that it had"
        ),
        _ => error.to_string(),
    };
    Refusal {
        line: named(file.unwrap_or(Path::new("")), &what),
        is_final: true,
    }
}

fn parse(bytes: &[u8]) -> Option<ViewRecord> {
    let (record, check) = bytes.split_at_checked(ViewRecord::LENGTH)?;
    ViewRecord::from_bytes(record).filter(|_| *check == sum(record))
}

fn named(file: &Path, error: &str) -> String {
    format!("{OPTION} {}: {error}", file.display())
}

fn sum(bytes: &[u8]) -> [u8; 4] {
    CRC_32C.checksum(bytes).to_le_bytes()
}
