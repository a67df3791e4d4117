//! Output of `tshark` in PDML.

use std::path::Path;
use std::process::Command;

use roxmltree::{Document, Node};
use uav_relay_decode::format::Kind;
use uav_relay_decode::value::{Fields, Value};

#[derive(Debug)]
pub(crate) struct Shown {
    name: String,
    show: String,
    bytes: String,
}

#[derive(Debug)]
pub(crate) struct Packet(Vec<Shown>);

impl Packet {
    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        let mut all = self.0.iter();
        all.find(|shown| shown.name == name)
            .map(|shown| shown.show.as_str())
    }

    pub(crate) fn of<'p>(&'p self, message: &str) -> impl Iterator<Item = &'p Shown> {
        let prefix = format!("{message}.");
        self.0
            .iter()
            .filter(move |shown| shown.name.starts_with(&prefix))
    }
}

pub(crate) fn packets(file: &Path, dissector: &Path) -> Vec<Packet> {
    let output = Command::new("tshark")
        .arg("-X")
        .arg(format!("lua_script:{}", dissector.display()))
        .args(["-T", "pdml", "-r"])
        .arg(file)
        .output()
        .unwrap_or_else(|error| panic!("tshark: {error}; type: sudo apt-get install --yes tshark"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && !errors.contains("Lua"),
        "{errors}"
    );
    let text = String::from_utf8(output.stdout).unwrap();
    let options = roxmltree::ParsingOptions {
        allow_dtd: true,
        nodes_limit: u32::MAX,
        ..Default::default()
    };
    let document = Document::parse_with_options(&text, options).unwrap();
    let packets = document
        .descendants()
        .filter(|node| node.has_tag_name("packet"));
    packets.map(|packet| Packet(fields(packet))).collect()
}

fn fields(packet: Node<'_, '_>) -> Vec<Shown> {
    let attribute = |node: Node<'_, '_>, name| node.attribute(name).unwrap_or_default().to_owned();
    let all = packet.descendants().filter_map(|node| {
        let name = node.attribute("name")?.strip_prefix("uav_relay.")?;
        Some(Shown {
            name: name.to_owned(),
            show: attribute(node, "show"),
            bytes: attribute(node, "value"),
        })
    });
    all.collect()
}

#[derive(Debug)]
pub(crate) struct Wanted<'f> {
    name: String,
    value: Value<'f>,
}

/// Returns the fields that Wireshark should show for a message, in order. The fields' names begin with `prefix`.
///
/// The count of a list is a field as well, and so is each flag of a flags byte.
pub(crate) fn flat<'f>(prefix: &str, fields: &Fields<'f>) -> Vec<Wanted<'f>> {
    let mut all = Vec::new();
    for (field, value) in &fields.0 {
        let name = format!("{prefix}.{}", field.name);
        if let (Kind::List(..), Value::List(values)) = (&field.kind, value) {
            all.push(Wanted {
                name: format!("{name}_count"),
                value: Value::Word(u8::try_from(values.len()).unwrap(), None),
            });
        }
        one(&name, value, &mut all);
    }
    all
}

fn one<'f>(name: &str, value: &Value<'f>, all: &mut Vec<Wanted<'f>>) {
    match value {
        Value::None => {}
        Value::Group(fields) => all.extend(flat(name, fields)),
        Value::List(values) => values.iter().for_each(|value| one(name, value, all)),
        value => all.push(Wanted {
            name: name.to_owned(),
            value: value.clone(),
        }),
    }
    if let Value::Flags(bits, names) = value {
        for (bit, flag) in (0..).zip(*names) {
            all.push(Wanted {
                name: format!("{name}.{flag}"),
                value: Value::Bool(bits >> bit & 1 == 1),
            });
        }
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes
        .iter()
        .fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

impl Wanted<'_> {
    /// Asserts that Wireshark shows this field.
    ///
    /// The bytes of floating-point numbers are compared, too, because Wireshark rounds their text to six digits.
    pub(crate) fn is(&self, shown: &Shown) {
        assert_eq!(shown.name, self.name);
        let show = shown.show.as_str();
        match &self.value {
            Value::Single(number) => {
                assert_eq!(shown.bytes, hex(&number.to_le_bytes()), "{}", self.name);
                near(show, f64::from(*number), 1e-5, &self.name);
            }
            Value::Double(number) => {
                assert_eq!(shown.bytes, hex(&number.to_le_bytes()), "{}", self.name);
                near(show, *number, 1e-5, &self.name);
            }
            Value::Bool(said) => {
                let said = if *said { ["1", "True"] } else { ["0", "False"] };
                assert!(said.contains(&show), "{}: {show}", self.name);
            }
            Value::Digest(digest) => assert_eq!(show, format!("0x{digest:04x}"), "{}", self.name),
            Value::Flags(bits, _) => assert_eq!(show, format!("0x{bits:02x}"), "{}", self.name),
            Value::Word(value, _) => assert_eq!(show, value.to_string(), "{}", self.name),
            Value::View(view) => assert_eq!(show, view.to_string(), "{}", self.name),
            Value::Unsigned(number) => assert_eq!(show, number.to_string(), "{}", self.name),
            Value::Signed(number) => assert_eq!(show, number.to_string(), "{}", self.name),
            Value::None | Value::List(_) | Value::Group(_) => panic!("{self:?}"),
        }
    }
}

fn near(show: &str, number: f64, relative: f64, name: &str) {
    let shown: f64 = show.trim_start_matches('-').parse().unwrap();
    let number = number.abs();
    let same = shown == number || shown.is_nan() && number.is_nan();
    assert!(
        same || (shown - number).abs() <= relative * number,
        "{name}: {show} {number}"
    );
}
