//! File of the newest uploaded mission: [`Upload::encode`], followed by a CRC-32C.
//!
//! Without a valid file a relay starts with the mission of its options; the chain sends it the newer one.

use std::io::ErrorKind;
use std::path::Path;

use uav_relay::CRC_32C;

use uav_relay::{Instant, Mission, Upload};

use crate::stored::StoredFile;
use uav_relay_linux::log::Log;

const STORED: usize = Upload::LENGTH + 4;

/// Loads the mission uploaded to relays that were configured with `mission`. `None` if there is no `file`.
pub(crate) fn load(file: &Path, mission: &Mission) -> Result<Option<Upload>, String> {
    let named = |error: &str| format!("--upload-file {}: {error}", file.display());
    let bytes = match std::fs::read(file) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(named(&format!("cannot be read: {error}"))),
    };
    let upload = parse(&bytes).ok_or_else(|| named("is damaged, or no upload"))?;
    let loaded = mission.digest();
    if upload.base() != loaded || upload.config().relays != mission.relays() {
        let base = upload.base();
        return Err(named(&format!(
            "is for relays that were loaded with mission 0x{base:04x} and not 0x{loaded:04x}"
        )));
    }
    Ok(Some(upload))
}

fn parse(bytes: &[u8]) -> Option<Upload> {
    let (upload, check) = bytes.split_at_checked(Upload::LENGTH)?;
    Upload::decode(upload).filter(|_| *check == sum(upload))
}

#[derive(Debug)]
pub(crate) struct Uploads {
    kept: StoredFile,
    unstored: Option<[u8; STORED]>,
    writing: Option<[u8; STORED]>,
}

impl Uploads {
    /// Starts the writer thread; writes nothing yet.
    pub(crate) fn new(file: &Path) -> Result<Self, String> {
        Ok(Self {
            kept: StoredFile::new("--upload-file", file)?,
            unstored: None,
            writing: None,
        })
    }

    /// Stores an upload at the next [`tend`](Self::tend).
    pub(crate) fn take(&mut self, upload: &Upload) {
        let mut bytes = [0; STORED];
        let (body, check) = bytes.split_at_mut(Upload::LENGTH);
        // The buffer has room for every upload.
        upload.encode(body);
        check.copy_from_slice(&sum(body));
        self.unstored = Some(bytes);
    }

    /// Writes an unstored upload; returns the time of the next retry. A mission that can not be stored is flown all the same.
    pub(crate) fn tend(&mut self, now: Instant, log: &Log) -> Option<Instant> {
        if let Some(is_kept) = self.kept.tend(now, log) {
            let written = self.writing.take();
            self.unstored.take_if(|it| is_kept && Some(*it) == written);
        }
        if let Some(bytes) = &self.unstored
            && !self.kept.is_writing()
            && self.kept.is_due(now)
        {
            self.writing = Some(*bytes);
            self.kept.put(bytes.to_vec());
        }
        self.kept.wake()
    }

    pub(crate) const fn kept(&self) -> &StoredFile {
        &self.kept
    }

    pub(crate) fn finish(&mut self, now: Instant, log: &Log) {
        self.kept.finish(now, log);
    }
}

fn sum(bytes: &[u8]) -> [u8; 4] {
    CRC_32C.checksum(bytes).to_le_bytes()
}
