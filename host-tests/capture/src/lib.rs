//! Writes frames as a pcapng capture, for Wireshark and `cargo decode`.
//!
//! A packet is one frame as on the wire, with COBS and delimiter, under LINKTYPE_USER0 (147). [`Capture`] writes
//! frames; [`FrameSplitter`] splits the byte stream of a port into frames.
//!
//! ```
//! use std::time::Duration;
//! use uav_relay_capture::{Capture, Direction, Frame, FrameSplitter};
//!
//! let mut capture = Capture::new(Vec::new(), "an example", "")?;
//! let port = capture.interface("/dev/ttyUSB0", "toward Tx")?;
//! let mut splitter = FrameSplitter::default();
//! splitter.push(&[2, 7, 0, 3], |piece| {
//!     capture.frame(port, &Frame {
//!         at: Duration::from_millis(1_250),
//!         bytes: piece.bytes,
//!         len: piece.len,
//!         direction: Direction::In,
//!         comment: "",
//!     })
//! })?;
//! assert!(capture.finish()?.len() > 100);
//! # Ok::<(), std::io::Error>(())
//! ```

mod splitter;
mod write;

pub use splitter::{FrameSplitter, MOST, Piece};
pub use write::{Capture, Direction, Frame, Interface, LINK_TYPE};
