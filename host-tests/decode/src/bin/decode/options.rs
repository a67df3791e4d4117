use std::path::PathBuf;

use clap::Parser;

/// Prints the frames of a capture or of a byte stream field by field. A frame is printed as soon as it is complete; a
/// rejected frame is printed with the reason.
#[derive(Parser, Debug)]
#[command(
    name = "decode",
    bin_name = "cargo decode",
    disable_version_flag = true
)]
pub(crate) struct Options {
    /// Capture file (pcapng), or file with the bytes that a port received. Without FILE, or with `-`, they are read from standard
    /// input, for example `cat /dev/ttyUSB0 | cargo decode`
    #[arg(value_name = "FILE")]
    pub(crate) file: Option<PathBuf>,
    /// Print one JSON object per frame and line. Numbers are as on the wire
    #[arg(long)]
    pub(crate) json: bool,
    /// File with the network key, 64 hexadecimal digits. Tags of two nodes are checked once their handshake was
    /// captured
    #[arg(long, value_name = "FILE")]
    pub(crate) key: Option<PathBuf>,
    /// Write the dissector for Wireshark to this file instead, or with `-` to standard output
    #[arg(long, value_name = "FILE", conflicts_with_all = ["file", "json", "key"])]
    pub(crate) dissector: Option<PathBuf>,
}
