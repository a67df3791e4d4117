//! Random messages from the tables, for the wire tests, the fuzz targets and the dissector's test.
//!
//! Valid messages cover the whole range of every field, and often its bounds. Arbitrary messages are well-formed, but
//! their numbers may be out of range.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    reason = "numbers are drawn as f64 or u64 and stored in the type of their field, and whole ones are compared"
)]

use crate::format::{Field, Kind, Layout};
use crate::range::{Numbers, bounds, has_room, targets};
use crate::value::{Fields, Value};

/// Fields of messages, each with its usual range. Half of a field's values are drawn from this range.
const ORDINARY: [(&str, f64, f64); 13] = [
    ("anchor", 0.25, 4.0),
    ("altitude_m", 15.0, 400.0),
    ("power_w", 0.1, 10.0),
    ("reach_m", 0.0, 1e3),
    ("slack_m", -1e3, 1e3),
    ("required_x_m", 0.0, 1e3),
    ("x_m", 0.0, 1e3),
    ("target_m", 0.0, 1e3),
    ("y_m", -100.0, 100.0),
    ("sir", 0.0, 10.0),
    ("worst_sir", 0.0, 10.0),
    ("interferer_x_m", -2e3, 2e3),
    ("interferer_y_m", -2e3, 2e3),
];

/// Function that may choose the value of a field. If it returns `None`, the value is random.
pub type Hint<'a> = dyn FnMut(&mut Draw<'_>, &Field) -> Option<Value<'static>> + 'a;

/// Generator of random messages from bytes: from a random generator or a fuzzer.
pub struct Draw<'s> {
    source: &'s mut dyn FnMut() -> u8,
}

impl std::fmt::Debug for Draw<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Draw").finish_non_exhaustive()
    }
}

impl<'s> Draw<'s> {
    /// Creates a generator of random messages with the random bytes of `source`.
    pub fn new(source: &'s mut dyn FnMut() -> u8) -> Self {
        Self { source }
    }

    /// Draws one random byte from the source.
    pub fn byte(&mut self) -> u8 {
        (self.source)()
    }

    /// Draws `N` random bytes from the source.
    pub fn bytes<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.byte())
    }

    fn chance(&mut self, parts: u8) -> bool {
        self.byte().is_multiple_of(parts)
    }

    /// Draws a number from 0 to 1 inclusive.
    fn part(&mut self) -> f64 {
        f64::from(u32::from_le_bytes(self.bytes())) / f64::from(u32::MAX)
    }

    /// Draws the fields of a valid message.
    pub fn valid<'f>(&mut self, layout: &'f Layout) -> Fields<'f> {
        self.hinted(layout, &mut |_, _| None)
    }

    /// Draws the fields of a message. `hint` may choose the number of a field, even one out of range.
    ///
    /// If `hint` returns `None`, the field gets a random number in its permitted range.
    pub fn hinted<'f>(&mut self, layout: &'f Layout, hint: &mut Hint<'_>) -> Fields<'f> {
        let mut fields = self.fields(&layout.fields, hint);
        obey_rules(&layout.name, &mut fields);
        fields
    }

    fn fields<'f>(&mut self, fields: &'f [Field], hint: &mut Hint<'_>) -> Fields<'f> {
        let draw = fields
            .iter()
            .map(|field| (field, self.one(field, &field.kind, hint)));
        Fields(draw.collect())
    }

    fn one<'f>(&mut self, field: &'f Field, kind: &'f Kind, hint: &mut Hint<'_>) -> Value<'f> {
        match kind {
            Kind::Bool => Value::Bool(self.chance(2)),
            Kind::Option(_) if self.chance(2) => Value::None,
            Kind::Option(of) => self.one(field, of, hint),
            Kind::Array(count, of) => {
                Value::List((0..*count).map(|_| self.one(field, of, hint)).collect())
            }
            Kind::List(most, of) => {
                let count = match self.byte() % 4 {
                    0 => 1,
                    1 => *most,
                    _ => u64::from(self.byte()) % (most + 1),
                };
                Value::List((0..count).map(|_| self.one(field, of, hint)).collect())
            }
            Kind::Group(fields) => Value::Group(self.fields(fields, hint)),
            kind => hint(self, field).unwrap_or_else(|| self.number(field, kind)),
        }
    }

    /// Draws a number within the permitted range of its field.
    pub fn number<'f>(&mut self, field: &Field, kind: &'f Kind) -> Value<'f> {
        let (zero, least, most) = bounds(&field.range);
        let whole = |draw: &mut Self, top: f64| {
            let (least, most) = (least.max(0.0) as u64, most.min(top) as u64);
            match draw.byte() % 8 {
                _ if zero && draw.chance(4) => 0,
                0 => least,
                1 => most,
                2..6 => (least + u64::from(draw.byte() % 9)).min(most),
                _ => least + u64::from_le_bytes(draw.bytes()) % (most - least + 1),
            }
        };
        match kind {
            Kind::U8 => Value::Unsigned(whole(self, u8::MAX.into())),
            Kind::U16 => Value::Unsigned(whole(self, u16::MAX.into())),
            Kind::U32 => Value::Unsigned(whole(self, u32::MAX.into())),
            Kind::Flags(names) => Value::Flags(whole(self, u8::MAX.into()) as u8, names),
            Kind::Words(_) => Value::Word(whole(self, u8::MAX.into()) as u8, None),
            Kind::View => Value::View(match field.range.split(';').next() {
                Some("any") if self.chance(4) => u32::from_le_bytes(self.bytes()),
                Some("a proposed view") => self.view(),
                _ if self.chance(4) => 0,
                _ => self.view(),
            }),
            Kind::I24 | Kind::I32 => {
                let top = if *kind == Kind::I24 {
                    8_388_607.0
                } else {
                    i32::MAX.into()
                };
                let (least, most) = (least.max(-top - 1.0), most.min(top));
                let number = match self.byte() % 8 {
                    0 => least,
                    1 => most,
                    2..5 => 0.0,
                    _ => least + self.part() * (most - least),
                };
                Value::Signed(number as i64)
            }
            Kind::F32 if zero && self.chance(3) => Value::Single(0.0),
            Kind::F32 => {
                // The bounds are rounded to f32.
                let (least, most) = (least as f32, most as f32);
                let (least, most) = (least.max(f32::MIN), most.min(f32::MAX));
                let number = self.real(&field.name, least.into(), most.into()) as f32;
                Value::Single(number.clamp(least, most))
            }
            Kind::F64 => Value::Double(self.real(&field.name, least, most).clamp(least, most)),
            kind => self.any_number(kind),
        }
    }

    fn real(&mut self, name: &str, least: f64, most: f64) -> f64 {
        let ordinary = ORDINARY.iter().find(|(of, ..)| *of == name);
        if let Some((_, low, high)) = ordinary
            && self.chance(2)
        {
            return (low + self.part() * (high - low)).clamp(least, most);
        }
        match self.byte() % 12 {
            0 => least,
            1 => most,
            2 => 0.0,
            3 => -0.0,
            4 => f32::from_bits(1).into(),
            5..8 => least + self.part() * (most - least),
            side => {
                // Any magnitude, positive or negative as far as the range permits.
                let bottom = least.max(-most).max(1e-40).log10();
                let top = most.abs().max(least.abs()).log10();
                let number = 10_f64.powf(bottom + self.part() * (top - bottom));
                if least < 0.0 && (side == 8 || most <= 0.0) {
                    -number
                } else {
                    number
                }
            }
        }
    }

    /// Draws the 32-bit name of a proposed view (membership of the chain).
    ///
    /// The name has the view's number, at least 1, and the node number of its proposer.
    fn view(&mut self) -> u32 {
        let most = 0x003F_FFFF;
        let number = match self.byte() % 8 {
            0 => most,
            1 => 1 + u32::from_le_bytes(self.bytes()) % most,
            _ => 1 + u32::from(self.byte() % 8),
        };
        let node = match self.byte() % 8 {
            0 => 1000,
            1 => 1 + u32::from(u16::from_le_bytes(self.bytes())) % 1000,
            _ => 1 + u32::from(self.byte() % 9),
        };
        number << 10 | node
    }

    /// Draws fields with arbitrary values that fit into the bytes of the fields.
    ///
    /// The fields can always be encoded, but a receiver may reject a value as out of its range.
    pub fn arbitrary<'f>(&mut self, fields: &'f [Field]) -> Fields<'f> {
        let draw = fields.iter().map(|field| (field, self.any(&field.kind)));
        Fields(draw.collect())
    }

    fn any<'f>(&mut self, kind: &'f Kind) -> Value<'f> {
        match kind {
            Kind::Option(_) if self.chance(2) => Value::None,
            Kind::Option(of) => self.any(of),
            Kind::Array(count, of) => Value::List((0..*count).map(|_| self.any(of)).collect()),
            Kind::List(most, of) => {
                let count = u64::from(self.byte()) % (most + 1);
                Value::List((0..count).map(|_| self.any(of)).collect())
            }
            Kind::Group(fields) => Value::Group(self.arbitrary(fields)),
            Kind::F32 if self.chance(2) => Value::Single((self.part() * 4e3 - 2e3) as f32),
            // In half of the draws the value is one that has a name.
            Kind::Words(words) if self.chance(2) => {
                let word = usize::from(self.byte()) % words.len().max(1);
                Value::Word(word as u8, None)
            }
            kind => self.any_number(kind),
        }
    }

    /// Draws any number of this type, including NaN and the infinities.
    pub fn any_number<'f>(&mut self, kind: &'f Kind) -> Value<'f> {
        let bytes: [u8; 8] = self.bytes();
        let long = u64::from_le_bytes(bytes);
        match kind {
            Kind::U8 => Value::Unsigned(long & 0xFF),
            Kind::U16 => Value::Unsigned(long & 0xFFFF),
            Kind::U32 => Value::Unsigned(long & 0xFFFF_FFFF),
            Kind::I24 => Value::Signed((long as i32 >> 8).into()),
            Kind::I32 => Value::Signed((long as i32).into()),
            Kind::F32 => Value::Single(f32::from_bits(long as u32)),
            Kind::F64 => Value::Double(f64::from_bits(long)),
            Kind::Bool => Value::Bool(long % 2 == 1),
            Kind::Digest => Value::Digest(long as u16),
            Kind::View => Value::View(long as u32),
            Kind::Flags(names) => {
                Value::Flags(long as u8 & ((1_u16 << names.len()) - 1) as u8, names)
            }
            Kind::Words(_) => Value::Word(long as u8, None),
            _ => Value::Unsigned(long),
        }
    }
}

/// Reorders the views (memberships of the chain) in a Decision message into ascending order.
///
/// The order is base view, accepted view, proposed view.
fn decision(fields: &mut Fields<'_>) {
    let get = |fields: &Fields<'_>, name: &str| Numbers(fields).get(name);
    let (base, view) = (get(fields, "base_view"), get(fields, "proposed_view"));
    if base > view {
        fields.set("base_view", Value::View(view as u32));
        fields.set("proposed_view", Value::View(base as u32));
    } else if base == view {
        fields.set("base_view", Value::View(0));
    }
    let proposed = get(fields, "proposed_view");
    if let Some(Value::Group(mut of)) = fields.get("accepted").cloned() {
        let least = Numbers(&of).get("view").min(proposed);
        of.set("view", Value::View(least as u32));
        fields.set("accepted", Value::Group(of));
    }
}

/// Changes fields so that they obey the rules between fields that [`range`](crate::range) checks.
fn obey_rules<'f>(message: &str, fields: &mut Fields<'f>) {
    let get = |fields: &Fields<'f>, name: &str| Numbers(fields).get(name);
    let single = |fields: &mut Fields<'f>, name: &str, number: f64| {
        fields.set(name, Value::Single(number as f32));
    };
    match message {
        "Sweep" | "Measured" | "Aside" => {
            let (gap, mut growth) = (get(fields, "gap") as u8, get(fields, "growth") as u8);
            let mut anchor = get(fields, "anchor") as f32;
            if gap == 0 {
                growth = 0;
            }
            let is_normal = |anchor: f32, growth| {
                let mut all = targets(anchor.abs(), gap, growth).into_iter();
                all.all(f32::is_normal)
            };
            while !is_normal(anchor, growth) && growth > 0 {
                growth /= 2;
            }
            if !is_normal(anchor, growth) {
                anchor = 1.0_f32.copysign(anchor);
            }
            single(fields, "anchor", anchor.into());
            fields.set("growth", Value::Unsigned(growth.into()));
            let most = targets(anchor.abs(), gap, growth).len();
            list(fields, "reach_m", |reaches| reaches.truncate(most));
        }
        "Gather" | "Gathered" => {
            let mut last = get(fields, "after") as u64;
            list(fields, "seats", |seats| {
                for seat in &mut *seats {
                    if let Value::Group(seat) = seat {
                        last += 1 + Numbers(seat).get("relay") as u64 % 8;
                        seat.set("relay", Value::Unsigned(last));
                    }
                }
                seats.retain(
                    |seat| matches!(seat, Value::Group(seat) if Numbers(seat).get("relay") <= 1e3),
                );
            });
        }
        "Token" => {
            if get(fields, "turn") != 2.0 {
                single(fields, "explore_m", 0.0);
                fields.set("columns", Value::Unsigned(0));
            }
            let rows = match (get(fields, "columns"), get(fields, "rows")) {
                (0.0, _) => 0,
                (_, 0.0) => 2,
                (_, rows) => rows as u64,
            };
            fields.set("rows", Value::Unsigned(rows));
        }
        "Proposal" => {
            let votes = get(fields, "votes").min(get(fields, "agreed_relays"));
            fields.set("votes", Value::Unsigned(votes as u64));
            proposal(fields);
        }
        "Decision" => decision(fields),
        "Sense" | "Sensed" => {
            list(fields, "sum_ab", |sums| {
                if let Some(Value::Single(first)) = sums.first_mut() {
                    *first = first.abs();
                }
            });
            if get(fields, "estimate") != 4.0 {
                for name in [
                    "source_power_w",
                    "source_x_m",
                    "source_y_m",
                    "source_at_rx_w",
                ] {
                    single(fields, name, 0.0);
                }
            } else if get(fields, "source_power_w") == 0.0 {
                single(fields, "source_power_w", 1.0);
            }
        }
        "Offer" => offer(fields),
        _ => {}
    }
}

fn list<'f>(fields: &mut Fields<'f>, name: &str, change: impl FnOnce(&mut Vec<Value<'f>>)) {
    if let Some(Value::List(values)) = fields.get(name) {
        let mut values = values.clone();
        change(&mut values);
        fields.set(name, Value::List(values));
    }
}

/// Reorders the four views (memberships of the chain) in a Proposal into the format's ascending order.
///
/// The order: view agreed on, view accepted after it, proposal of the accepted view, proposed view.
fn proposal(fields: &mut Fields<'_>) {
    let view = |fields: &Fields<'_>, name| Numbers(fields).get(name) as u32;
    let mut order = vec![view(fields, "agreed_view"), view(fields, "proposed_view")];
    let mut successor = fields.get("successor").cloned();
    if let Some(Value::Group(of)) = &successor {
        order.extend(["view", "proposal"].map(|name| view(of, name)));
    }
    order.sort_unstable();
    let last = order.pop().unwrap_or_default();
    if order.contains(&last) {
        // No view is older than the proposed one, so no view is agreed on or accepted.
        order = vec![0];
        successor = Some(Value::None);
    }
    if let (Some(Value::Group(of)), [_, accepted, decided]) = (&mut successor, &*order) {
        of.set("view", Value::View(*accepted));
        of.set("proposal", Value::View(*decided));
    }
    fields.set("proposed_view", Value::View(last));
    fields.set(
        "agreed_view",
        Value::View(order.first().copied().unwrap_or_default()),
    );
    if let Some(successor) = successor {
        fields.set("successor", successor);
    }
}

/// Changes the fields of an Offer so that they form one valid mission.
fn offer(fields: &mut Fields<'_>) {
    let get = |fields: &Fields<'_>, name| Numbers(fields).get(name);
    let single = |fields: &mut Fields<'_>, name: &str, number: f64| {
        fields.set(name, Value::Single(number as f32));
    };
    let ends = ["altitude_min_m", "altitude_max_m"].map(|name| get(fields, name));
    let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let altitude = get(fields, "altitude_m").clamp(least, most);
    single(fields, "altitude_min_m", least);
    single(fields, "altitude_max_m", most);
    single(fields, "altitude_m", altitude);
    let los = get(fields, "mu_los");
    let nlos = get(fields, "mu_nlos").clamp(los, 1e20 * los);
    let eta = get(fields, "eta").clamp(los, nlos);
    fields.set("mu_nlos", Value::Double(nlos));
    fields.set("eta", Value::Double(eta));
    let power = get(fields, "interferer_power_w");
    if power == 0.0 {
        single(fields, "interferer_x_m", 0.0);
        single(fields, "interferer_y_m", 0.0);
    } else if get(fields, "noise_w") * eta / power > 1e12 {
        single(fields, "noise_w", 9e11 * power / eta);
    }
    if !has_room(&Numbers(fields)) {
        let apart = 0.9 * get(fields, "distance_m") / get(fields, "relays");
        single(fields, "min_separation_m", apart.min(1e5));
    }
}
