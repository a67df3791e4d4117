//! Uploaded missions, kept across a reboot.
//!
//! They are in a [`Journal`](uav_relay_kept::journal::Journal) of their own, whose key is the check sequence of the configuration block: with
//! another block a drone has forgotten what was uploaded before, and flies what the block says.
//!
//! Nothing is erased for an upload in flight, since an erase of these sectors stops the CPU for a second or two. A sector of 128 KiB has
//! room for 1092 records, so at least as many uploads are kept from one start to the next; what comes after them is flown all the same.

use uav_relay::Upload;

use uav_relay_kept::journal::{pack, unpack};

/// Where the two sectors begin: sectors 7 and 8 of an STM32F405.
pub const SECTORS: [u32; 2] = [0x0806_0000, 0x0808_0000];

/// Words of a record that are kept.
pub const WORDS: usize = Upload::LENGTH.div_ceil(4);

/// As it is kept.
pub fn kept(upload: &Upload) -> [u32; WORDS] {
    let mut bytes = [0; Upload::LENGTH];
    // What was held was checked: it always fits.
    upload.encode(&mut bytes);
    pack(&bytes)
}

/// What was kept, if it is of this format.
pub fn upload(kept: &[u32]) -> Option<Upload> {
    Upload::decode(&unpack::<{ Upload::LENGTH }>(kept))
}
