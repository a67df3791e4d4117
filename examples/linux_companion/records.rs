//! Records that survive a restart in flight: the relay's votes on views, and the newest upload.
//!
//! A vote is on the disk before it is sent, because a relay that forgets a promise could split the chain. While a
//! thread writes the votes, the relay sends nothing; everything else continues. Remove the file before a new flight.
//!
//! Without a valid upload a relay starts with the mission of its options, and receives the newer one from the chain.

use std::path::Path;

use uav_relay::{Instant, Mission, RecordError, Relay, Upload, ViewRecord};
use uav_relay_linux::log::Log;
use uav_relay_linux::stored::{StoredFile, load, record};

use crate::relay::Refusal;

const VIEWS: &str = "--view-file";
const UPLOADS: &str = "--upload-file";

/// Restores into `relay` the votes on the chain's members that an earlier start of the program stored.
///
/// Returns the file of the votes, and true if the file had votes.
///
/// # Errors
/// One line with the file, the fault and the remedy. The reason for the error is that a relay that has lost its votes
/// must not vote again in the same flight.
pub(crate) fn resume_views(
    file: &Path,
    relay: &mut Relay,
    now: Instant,
) -> Result<(StoredFile, bool), Refusal> {
    let refused = |why: &str| Refusal {
        line: format!("{VIEWS} {}: {why}", file.display()),
        is_final: true,
    };
    let bytes = load(VIEWS, file)?;
    let mut stored = None;
    if let Some(bytes) = &bytes {
        stored = record(bytes, ViewRecord::LENGTH);
        let votes = stored.and_then(ViewRecord::from_bytes).ok_or_else(|| {
            refused("the file is damaged, or has no record of votes on the chain's membership. Before a new flight, delete the file and start again. In the same flight, the relay cannot rejoin the chain")
        })?;
        relay.resume_view(now, &votes).map_err(|error| match error {
            RecordError::Base => refused(&format!(
                "{error}. Before a new flight, delete this file and start again. In the same flight, start the relay with the mission that it had before"
            )),
            _ => refused(&error.to_string()),
        })?;
    }
    Ok((StoredFile::new(VIEWS, file, stored)?, stored.is_some()))
}

/// Restores into `relay` the mission uploaded before this start; returns true if there was one.
///
/// `mission` is the mission of the relay's options, on which the upload is based.
///
/// An unusable file is logged and ignored.
pub(crate) fn resume_upload(file: &Path, mission: &Mission, relay: &mut Relay, log: &Log) -> bool {
    let resumed = load_upload(file, mission).and_then(|upload| match upload {
        Some(upload) => match relay.resume(&upload) {
            Ok(()) => Ok(true),
            Err(error) => Err(format!("{UPLOADS} {}: {error}", file.display())),
        },
        None => Ok(false),
    });
    resumed.unwrap_or_else(|why| {
        log.line(
            Instant::ZERO,
            "file",
            format_args!(
                "{why}; the relay ignores the file and starts with the mission of its options"
            ),
        );
        false
    })
}

/// Reads from `file` the mission that was uploaded before this start, if any.
///
/// # Errors
/// A line that names the file and the fault.
pub(crate) fn load_upload(file: &Path, mission: &Mission) -> Result<Option<Upload>, String> {
    let named = |error: &str| format!("{UPLOADS} {}: {error}", file.display());
    let Some(bytes) = load(UPLOADS, file)? else {
        return Ok(None);
    };
    let upload = record(&bytes, Upload::LENGTH).and_then(Upload::decode);
    let upload = upload.ok_or_else(|| named("the file is damaged, or not an uploaded mission"))?;
    let (base, loaded) = (upload.base(), mission.digest());
    if base != loaded || upload.config().relays != mission.relays() {
        return Err(named(&format!(
            "the uploaded mission in this file is for relays with a loaded mission of digest 0x{base:04x}, but the loaded mission of this relay has digest 0x{loaded:04x}"
        )));
    }
    Ok(Some(upload))
}

/// Starts the writer thread of `file`, which stores the uploaded missions passed to [`store_upload`].
pub(crate) fn uploads(file: &Path) -> Result<StoredFile, String> {
    StoredFile::new(UPLOADS, file, None)
}

/// Begins to store an uploaded mission. If that fails, the relay flies the mission all the same.
pub(crate) fn store_upload(file: &mut StoredFile, upload: &Upload) {
    let mut bytes = [0; Upload::LENGTH];
    // The buffer is large enough for any upload.
    upload.encode(&mut bytes);
    file.store(&bytes);
}
