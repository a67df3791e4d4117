//! Uploaded missions, persisted across a reboot.
//!
//! They are in a [`Journal`](uav_relay_kept::journal::Journal) whose key is the CRC of the configuration block. After a
//! change of the block they are ignored, and the drone flies the mission of the new block.
//!
//! An upload in flight erases nothing, because an erase of these sectors stops the CPU for 1 to 2 s. A sector of 128
//! KiB holds 1024 records, so at least as many uploads are stored between two starts. Further ones are flown but not
//! stored.

use uav_relay::Upload;

use uav_relay_kept::journal::{pack, unpack};

/// Addresses of the two flash sectors for uploads: sectors 7 and 8 of an STM32F405.
pub const SECTORS: [u32; 2] = [0x0806_0000, 0x0808_0000];

/// Length of an uploaded mission in the journal, words.
pub const WORDS: usize = Upload::LENGTH.div_ceil(4);

/// Packs an uploaded mission into words.
pub fn pack_upload(upload: &Upload) -> [u32; WORDS] {
    let mut bytes = [0; Upload::LENGTH];
    // The buffer has room for every checked upload.
    upload.encode(&mut bytes);
    pack(&bytes)
}

/// Unpacks a stored mission upload; `None` if the words are no valid upload.
pub fn unpack_upload(words: &[u32]) -> Option<Upload> {
    Upload::decode(&unpack::<{ Upload::LENGTH }>(words))
}
