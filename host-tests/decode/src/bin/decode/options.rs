//! The options of `cargo decode`.

use std::path::PathBuf;

use clap::Parser;

/// Prints the frames of a capture or of a stream of bytes field by field, each as soon as it is whole, and says of one that is refused why.
#[derive(Parser, Debug)]
#[command(
    name = "decode",
    bin_name = "cargo decode",
    disable_version_flag = true
)]
pub(crate) struct Options {
    /// A capture (pcapng), or the bytes of a port; without it or with `-` standard input, as of `cat /dev/ttyUSB0`
    #[arg(value_name = "FILE")]
    pub(crate) file: Option<PathBuf>,
    /// One JSON object for each frame, on a line of its own. Numbers are as on the wire
    #[arg(long)]
    pub(crate) json: bool,
    /// The key of the network, 64 hexadecimal digits: of tags it is said whether they are right, once the handshake of the two was seen
    #[arg(long, value_name = "FILE")]
    pub(crate) key: Option<PathBuf>,
    /// Write the dissector for Wireshark to this file instead, or with `-` to standard output
    #[arg(long, value_name = "FILE", conflicts_with_all = ["file", "json", "key"])]
    pub(crate) dissector: Option<PathBuf>,
}
