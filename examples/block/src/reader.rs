//! Numbers from bytes.

use uav_relay::{
    Adjust, Band, Duration, Field, FieldPoint, Interference, Interferer, Listen, Local, Measure,
    Method, Profile,
};

use super::{ConfigError, Room, Sites};

/// Bytes not read yet. Reads past the end return zeros; the table never causes any.
pub(super) struct Reader<'a>(pub(super) &'a [u8]);

impl Reader<'_> {
    pub(super) fn take<const N: usize>(&mut self) -> [u8; N] {
        let Some((bytes, rest)) = self.0.split_first_chunk::<N>() else {
            return [0; N];
        };
        self.0 = rest;
        *bytes
    }

    pub(super) fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    pub(super) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    pub(super) fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    pub(super) fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }

    pub(super) fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    pub(super) fn profile(&mut self) -> Profile {
        Profile {
            altitude_m: self.f32(),
            power_w: self.f32(),
        }
    }

    pub(super) fn band(&mut self) -> Band {
        Band {
            least_m: self.f32(),
            most_m: self.f32(),
        }
    }

    /// Reads the parameters of method `number`; those of adjust must be 0 for the others.
    pub(super) fn method(&mut self, number: u8) -> Result<Method, ConfigError> {
        let explore_m = self.f32();
        let rounds = self.u16();
        let unused = explore_m.to_bits() == 0 && rounds == 0;
        match number {
            0 if unused => Ok(Method::Align),
            1 if unused => Ok(Method::Joint),
            2 if rounds > 0 && (0.0..=1e5).contains(&explore_m) => Ok(Method::Adjust(Adjust {
                rounds,
                explore_m,
                local: Local::Fine,
            })),
            0..=2 => Err(ConfigError::Adjust),
            _ => Err(ConfigError::Method),
        }
    }

    pub(super) fn measure(&mut self) -> Result<Option<Measure>, ConfigError> {
        let i_max_w = self.f32();
        match self.u32() {
            0 if i_max_w.to_bits() == 0 => Ok(None),
            samples @ 100..=1_000_000 if (1e-30..=1e6).contains(&i_max_w) => {
                Ok(Some(Measure { i_max_w, samples }))
            }
            _ => Err(ConfigError::Measure),
        }
    }

    /// Reads the sensing settings; `None` if all are 0.
    pub(super) fn listen(&mut self) -> Result<Option<Listen>, ConfigError> {
        let listen = Listen {
            every: Duration::from_micros(self.u64()),
            half_life: Duration::from_micros(self.u64()),
            relative_error: self.f32(),
        };
        match (listen.every.as_micros(), listen.half_life.as_micros()) {
            (0, 0) if listen.relative_error.to_bits() == 0 => Ok(None),
            _ if listen.is_valid() => Ok(Some(listen)),
            _ => Err(ConfigError::Listen),
        }
    }

    /// Reads the sites and the speed; `None` if all are 0, without an autopilot.
    pub(super) fn sites(&mut self) -> Result<Option<Sites>, ConfigError> {
        let mut site = || core::array::from_fn(|_| i32::from_le_bytes(self.take()));
        let ends: [[i32; 3]; 2] = [site(), site()];
        let speed_m_s = self.f32();
        let is_default = speed_m_s.to_bits() == 0;
        match ends {
            [[0, 0, 0], [0, 0, 0]] if is_default => Ok(None),
            [[0, 0, 0], [0, 0, 0]] => Err(ConfigError::Speed),
            _ if is_default || (0.1..=20.0).contains(&speed_m_s) => {
                Ok(Some(Sites { ends, speed_m_s }))
            }
            _ => Err(ConfigError::Speed),
        }
    }

    /// Reads a field of `count` points. Without points it returns `interferer`, which if all 0 is unknown to relays that listen.
    pub(super) fn interference(
        &mut self,
        count: u16,
        interferer: Interferer,
        listens: bool,
        room: &'static mut Room,
    ) -> Result<Interference, ConfigError> {
        for place in &mut *room {
            *place = FieldPoint {
                x_m: self.f32(),
                upsilon_per_w: self.f32(),
            };
        }
        let room: &'static Room = room;
        let (points, unused) = room
            .split_at_checked(count.into())
            .ok_or(ConfigError::Points)?;
        let is_zero = |numbers: &[f32]| numbers.iter().all(|number| number.to_bits() == 0);
        if !unused
            .iter()
            .all(|point| is_zero(&[point.x_m, point.upsilon_per_w]))
        {
            return Err(ConfigError::Unused);
        }
        let Interferer { power_w, x_m, y_m } = interferer;
        let is_none = is_zero(&[power_w, x_m, y_m]);
        if points.is_empty() {
            return Ok(if is_none && listens {
                Interference::Unknown
            } else {
                Interference::Source(interferer)
            });
        }
        if !is_none {
            return Err(ConfigError::Interferer);
        }
        let field = Field::try_new(points).map_err(ConfigError::Field)?;
        Ok(Interference::Field(field))
    }
}
