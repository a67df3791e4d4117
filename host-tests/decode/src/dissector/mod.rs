//! Wireshark dissector in Lua: the tables as data, and an engine that reads them.

use std::fmt::Write as _;

use crate::format::{Field, Format, Kind, Layout};

const ENGINE: &str = include_str!("engine.lua");

const HEAD: &str = "\
-- Frames of uav-relay in Wireshark. Written by `cargo decode --dissector` from the tables of FORMAT.md: do not edit it.
--
-- wireshark -X lua_script:examples/wireshark/uav_relay.lua FILE
-- or copy it to the folder that Help > About Wireshark > Folders calls `Personal Lua Plugins`.
";

/// Returns the Wireshark dissector as a Lua program.
pub fn lua(format: &Format) -> String {
    let mut out = HEAD.to_owned();
    out.push_str("\nlocal messages = {\n");
    for (tag, message) in (0_u8..).zip(&format.messages) {
        _ = write!(out, "    [0x{tag:02x}] = ");
        layout(message, 4, &mut out);
        out.push_str(",\n");
    }
    out.push_str("}\n\nlocal handshake = ");
    layout(&format.handshake, 0, &mut out);
    out.push('\n');
    out.push_str(ENGINE);
    out
}

fn layout(layout: &Layout, indent: usize, out: &mut String) {
    _ = writeln!(out, "{{ name = {}, fields = {{", string(&layout.name));
    fields(&layout.fields, indent + 4, out);
    _ = write!(out, "{:indent$}}} }}", "");
}

fn fields(fields: &[Field], indent: usize, out: &mut String) {
    for field in fields {
        _ = write!(out, "{:indent$}{{ name = {}, ", "", string(&field.name));
        kind(&field.kind, indent, out);
        _ = write!(
            out,
            ", unit = {}, text = {}",
            string(&field.unit),
            string(&field.meaning)
        );
        if let Some((per, base)) = field.scale() {
            _ = write!(out, ", per = {per}, base = {}", string(base));
        }
        out.push_str(" },\n");
    }
}

fn kind(kind: &Kind, indent: usize, out: &mut String) {
    let plain = match kind {
        Kind::U8 => "u8",
        Kind::U16 => "u16",
        Kind::U64 => "u64",
        Kind::U32 => "u32",
        Kind::I24 => "i24",
        Kind::I32 => "i32",
        Kind::F32 => "f32",
        Kind::F64 => "f64",
        Kind::Bool => "bool",
        Kind::Digest => "digest",
        Kind::View => "view",
        Kind::Flags(names) => {
            let names: Vec<String> = names.iter().map(|name| string(name)).collect();
            _ = write!(out, "kind = \"flags\", words = {{ {} }}", names.join(", "));
            return;
        }
        Kind::Words(words) => {
            let words = (0..).zip(words);
            let words: Vec<String> = words
                .map(|(value, word): (u8, _)| format!("[{value}] = {}", string(word)))
                .collect();
            _ = write!(out, "kind = \"words\", words = {{ {} }}", words.join(", "));
            return;
        }
        Kind::Array(size, of) => {
            return inner("array", &format!("size = {size}, "), of, indent, out);
        }
        Kind::Option(of) => return inner("option", "", of, indent, out),
        Kind::List(most, of) => return inner("list", &format!("most = {most}, "), of, indent, out),
        Kind::Group(group) => {
            out.push_str("kind = \"group\", fields = {\n");
            fields(group, indent + 4, out);
            _ = write!(out, "{:indent$}}}", "");
            return;
        }
    };
    _ = write!(out, "kind = \"{plain}\"");
}

fn inner(name: &str, more: &str, of: &Kind, indent: usize, out: &mut String) {
    _ = write!(out, "kind = \"{name}\", {more}of = {{ ");
    kind(of, indent, out);
    out.push_str(" }");
}

fn string(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
