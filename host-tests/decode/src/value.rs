//! Values of fields.

use serde::de::value::{MapDeserializer, SeqDeserializer};
use serde::de::{self, Deserializer, IntoDeserializer, Visitor};
use serde::forward_to_deserialize_any;
use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::format::Field;

/// Value of a message field.
#[derive(Clone, PartialEq, Debug)]
pub enum Value<'f> {
    /// Unsigned integer of any size.
    Unsigned(u64),
    /// Signed integer.
    Signed(i64),
    /// Digest of a mission, of a view, or of the line between the Tx and Rx positions.
    Digest(u16),
    /// Name of a view (membership of the chain): the view's number and its proposer's node number.
    View(u32),
    /// Floating-point number, f32.
    Single(f32),
    /// Floating-point number, f64.
    Double(f64),
    /// Boolean value.
    Bool(bool),
    /// Flags: one byte, and the names of its bits.
    Flags(u8, &'f [String]),
    /// Enumeration: value, and its name, if any.
    Word(u8, Option<&'f str>),
    /// Absent optional value.
    None,
    /// List or array of values.
    List(Vec<Value<'f>>),
    /// Group of fields with their values.
    Group(Fields<'f>),
}

/// Fields of a message with their values, in order.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Fields<'f>(pub Vec<(&'f Field, Value<'f>)>);

impl<'f> Fields<'f> {
    /// Returns the value of the field with this name.
    pub fn get(&self, name: &str) -> Option<&Value<'f>> {
        let mut all = self.0.iter();
        all.find(|(field, _)| field.name == name)
            .map(|(_, value)| value)
    }

    /// Replaces the value of the field with this name, if there is one.
    pub fn set(&mut self, name: &str, value: Value<'f>) {
        if let Some((_, old)) = self.0.iter_mut().find(|(field, _)| field.name == name) {
            *old = value;
        }
    }
}

/// Conversion of a value to a Rust type by serde, where digests and flags are numbers, as on the wire.
impl<'de> Deserializer<'de> for &Value<'_> {
    type Error = de::value::Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Self::Error> {
        match self {
            Value::Unsigned(number) => visitor.visit_u64(*number),
            Value::Signed(number) => visitor.visit_i64(*number),
            Value::Digest(digest) => visitor.visit_u16(*digest),
            Value::View(view) => visitor.visit_u32(*view),
            Value::Single(number) => visitor.visit_f32(*number),
            Value::Double(number) => visitor.visit_f64(*number),
            Value::Bool(said) => visitor.visit_bool(*said),
            Value::Flags(bits, _) => visitor.visit_u8(*bits),
            Value::Word(value, _) => visitor.visit_u8(*value),
            Value::None => visitor.visit_none(),
            Value::List(values) => visitor.visit_seq(SeqDeserializer::new(values.iter())),
            Value::Group(fields) => fields.into_deserializer().deserialize_map(visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Self::Error> {
        match self {
            Value::None => visitor.visit_none(),
            value => visitor.visit_some(value),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf unit unit_struct newtype_struct seq tuple
        tuple_struct map struct enum identifier ignored_any
    }
}

impl IntoDeserializer<'_> for &Value<'_> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'a, 'de> IntoDeserializer<'de> for &'a Fields<'_> {
    type Deserializer = MapDeserializer<
        'de,
        Box<dyn Iterator<Item = (&'a str, &'a Value<'a>)> + 'a>,
        de::value::Error,
    >;

    fn into_deserializer(self) -> Self::Deserializer {
        let fields = self.0.iter();
        let named = fields.map(|(field, value)| (field.name.as_str(), value));
        MapDeserializer::new(Box::new(named))
    }
}

/// Returns the names of the flags that are set in `bits`. A flag without a name is named `bit 7`, for example.
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
