//! A frame as a line of JSON.

use serde::Serialize;
use uav_relay_capture::Direction;

use super::{Shown, hex};
use crate::value::Fields;

/// JSON object that describes a frame. Numbers are as on the wire; a field's name ends in its unit.
#[derive(Serialize)]
struct Line<'a> {
    frame: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_s: Option<f64>,
    #[serde(skip_serializing_if = "str::is_empty")]
    interface: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<&'static str>,
    #[serde(skip_serializing_if = "str::is_empty")]
    comment: &'a str,
    bytes: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<Refused>,
    #[serde(flatten)]
    header: Option<Head>,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tag: Option<Tag>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fields: Option<&'a Fields<'a>>,
}

#[derive(Serialize)]
struct Head {
    network: u16,
    sender: u16,
    destination: u16,
    counter: u32,
}

#[derive(Serialize)]
struct Refused {
    why: &'static str,
    what: String,
    wire: String,
}

#[derive(Serialize)]
struct Tag {
    bytes: String,
    check: &'static str,
}

/// Returns the frame as a line of JSON.
///
/// # Errors
/// A number cannot be represented in JSON.
pub fn json(shown: &Shown<'_>) -> Result<String, serde_json::Error> {
    let Shown {
        number,
        packet,
        frame,
        tag,
    } = *shown;
    let line = Line {
        frame: number,
        time_s: packet.at.map(|at| at.as_secs_f64()),
        interface: packet.interface,
        direction: match packet.direction {
            Direction::Unknown => None,
            Direction::In => Some("in"),
            Direction::Out => Some("out"),
        },
        comment: packet.comment,
        bytes: frame.len,
        refused: frame.refusal.as_ref().map(|refusal| Refused {
            why: refusal.word(),
            what: refusal.to_string(),
            wire: hex(packet.wire),
        }),
        header: frame.header.map(|header| Head {
            network: header.network,
            sender: header.sender,
            destination: header.destination,
            counter: header.counter,
        }),
        message: frame.name,
        tag: frame.tag.as_ref().zip(tag).map(|((_, bytes), check)| Tag {
            bytes: hex(bytes),
            check: check.word(),
        }),
        fields: frame.name.map(|_| &frame.fields),
    };
    serde_json::to_string(&line).map(|line| line + "\n")
}
