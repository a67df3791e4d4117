//! Values of fields.

use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::format::Field;

/// Value of a field.
#[derive(Clone, PartialEq, Debug)]
pub enum Value<'f> {
    /// An unsigned integer.
    Unsigned(u64),
    /// A signed integer.
    Signed(i64),
    /// A digest.
    Digest(u16),
    /// A view: its number and its proposer.
    View(u32),
    /// An f32.
    Single(f32),
    /// An f64.
    Double(f64),
    /// A Boolean.
    Bool(bool),
    /// Flags that are set, and the names of all.
    Flags(u8, &'f [String]),
    /// A value, and the word for it.
    Word(u8, Option<&'f str>),
    /// An empty Option.
    None,
    /// A list or array.
    List(Vec<Value<'f>>),
    /// A group of fields.
    Group(Fields<'f>),
}

/// Fields with their values, in order.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Fields<'f>(pub Vec<(&'f Field, Value<'f>)>);

impl<'f> Fields<'f> {
    /// Returns the value of the field with this name.
    pub fn get(&self, name: &str) -> Option<&Value<'f>> {
        let mut all = self.0.iter();
        all.find(|(field, _)| field.name == name)
            .map(|(_, value)| value)
    }
}

/// Returns the names of the bits that are set; `bit 7` for one without a name.
pub(crate) fn set(bits: u8, names: &[String]) -> Vec<String> {
    let set = (0..8).filter(|bit| bits >> bit & 1 == 1);
    let name = |bit: usize| match names.get(bit) {
        Some(name) => name.clone(),
        None => format!("bit {bit}"),
    };
    set.map(name).collect()
}

impl Serialize for Value<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Unsigned(number) => serializer.serialize_u64(*number),
            Self::Signed(number) => serializer.serialize_i64(*number),
            Self::Digest(digest) => serializer.serialize_str(&format!("{digest:04x}")),
            Self::View(view) => serializer.serialize_u32(*view),
            Self::Single(number) => serializer.serialize_f32(*number),
            Self::Double(number) => serializer.serialize_f64(*number),
            Self::Bool(said) => serializer.serialize_bool(*said),
            Self::Flags(bits, names) => set(*bits, names).serialize(serializer),
            Self::Word(value, _) => serializer.serialize_u8(*value),
            Self::None => serializer.serialize_none(),
            Self::List(values) => values.serialize(serializer),
            Self::Group(fields) => fields.serialize(serializer),
        }
    }
}

impl Serialize for Fields<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (field, value) in &self.0 {
            map.serialize_entry(&field.name, value)?;
        }
        map.end()
    }
}
