//! What the relay has said in the votes on views, in a file: [`ViewRecord::to_bytes`], and a CRC-32C behind it.
//!
//! It is on the disk before the others are told: a promise that is forgotten is none, and two parts of a chain could fly one view each. So while
//! it is being written, by a thread of its own, nothing is sent; all else goes on.
//! It is of one flight. Before another one the file is removed.

use std::io::ErrorKind;
use std::path::Path;

use uav_relay::CRC_32C;
use uav_relay::{Instant, RecordError, Relay, ViewRecord};

use crate::gate::Gate;
use crate::kept::Kept;
use crate::relay::Refusal;
use uav_relay_linux::log::Log;

const OPTION: &str = "--view-file";

/// The file, and what stands in it.
pub(crate) struct Views {
    kept: Option<Kept>,
    stored: Option<ViewRecord>,
    /// What is being written.
    writing: Option<ViewRecord>,
    /// What was written last, or could not be.
    tried: Option<ViewRecord>,
    /// Open where all that was said is stored.
    gate: Gate,
}

impl Views {
    /// What was said before this start; nothing without a `file`, or if there is none yet.
    ///
    /// # Errors
    /// One line that names the file, what is wrong and what to do: a relay that has lost its votes must not vote again in the same flight.
    pub(crate) fn load(file: Option<&Path>, gate: Gate) -> Result<Self, Refusal> {
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
            kept: file.map(|file| Kept::new(OPTION, file)).transpose()?,
            stored,
            writing: None,
            tried: None,
            gate,
        })
    }

    /// What was stored before this start.
    pub(crate) const fn stored(&self) -> Option<&ViewRecord> {
        self.stored.as_ref()
    }

    /// Has what `relay` has said written down, if that has changed; until it is, the gate is shut. Where it cannot be written it is tried again,
    /// and the relay flies on, and speaks: a drone in the air is not to be switched off for it.
    pub(crate) fn keep(&mut self, now: Instant, log: &Log, relay: &Relay) {
        let Some(kept) = &mut self.kept else { return };
        if let Some(is_kept) = kept.tend(now, log) {
            self.tried = self.writing.take();
            if is_kept {
                self.stored = self.tried;
            }
        }
        let record = relay.view_record();
        let (is_stored, is_tried) = (self.stored == Some(record), self.tried == Some(record));
        if !is_stored && !kept.is_writing() && (!is_tried || kept.is_due(now)) {
            let body = record.to_bytes();
            kept.put([&body[..], &sum(&body)].concat());
            self.writing = Some(record);
        }
        self.gate.set(is_stored || is_tried);
    }

    /// The file, if there is one.
    pub(crate) const fn kept(&self) -> Option<&Kept> {
        self.kept.as_ref()
    }

    /// Waits for the disk at the end, but not for long.
    pub(crate) fn finish(&mut self, now: Instant, log: &Log) {
        if let Some(kept) = &mut self.kept {
            kept.finish(now, log);
        }
    }
}

/// Returns the line about a record that the relay does not take.
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
