//! Bytes of a block as a structure, and range checks of its numbers.

use uav_relay::{
    Adjust, Band, Duration, Field, FieldPoint, Interference, Interferer, Listen, Local, Measure,
    Method, Profile,
};
use zerocopy::little_endian::{F32, F64, I32, U16, U32, U64};
use zerocopy::{FromBytes, Immutable, IntoBytes, Unaligned};

use super::{ConfigError, FieldStorage, MAX_POINTS, Sites};

/// Bytes of a configuration block as a structure. Its fields are in the order of the table in `lib.rs`.
#[derive(FromBytes, IntoBytes, Immutable, Unaligned)]
#[repr(C)]
pub(super) struct Layout {
    pub(super) magic: [u8; 4],
    pub(super) version: U16,
    pub(super) length: U16,
    pub(super) index: U16,
    pub(super) network: U16,
    pub(super) relays: U16,
    pub(super) method: u8,
    pub(super) hold_altitude: u8,
    pub(super) distance_m: F32,
    pub(super) min_separation_m: F32,
    pub(super) tx_power_w: F32,
    /// Altitude (m) and transmit power (W) of relays without own values.
    pub(super) common: [F32; 2],
    pub(super) own: [F32; 2],
    /// Interferer's power (W), x and y (m). All are 0 if the interferer is unknown, or if the block gives the
    /// interference as a distribution along x.
    pub(super) interferer: [F32; 3],
    pub(super) tolerance: F32,
    /// Channel: carrier frequency (Hz), two excess losses (factors), and the line-of-sight weight (0 to 1).
    ///
    /// The first excess loss is for line of sight, the second for no line of sight.
    pub(super) channel: [F64; 4],
    pub(super) band: [F32; 2],
    pub(super) lateral: [F32; 2],
    pub(super) explore_m: F32,
    pub(super) rounds: U16,
    pub(super) points: U16,
    pub(super) i_max_w: F32,
    pub(super) samples: U32,
    pub(super) field: [[F32; 2]; MAX_POINTS],
    pub(super) epoch: U32,
    pub(super) key: [u8; 32],
    pub(super) ends: [[I32; 3]; 2],
    pub(super) speed_m_s: F32,
    pub(super) autopilot_key: [u8; 32],
    pub(super) noise_w: F32,
    pub(super) listen_us: [U64; 2],
    pub(super) relative_error: F32,
    pub(super) probe_after_ms: U32,
    pub(super) reverse: F32,
    pub(super) rx_power_w: F32,
    pub(super) fitted_gap: F32,
    pub(super) flying: U16,
    pub(super) spare: U16,
    pub(super) crc: U32,
}

pub(super) const fn profile([altitude_m, power_w]: [F32; 2]) -> Profile {
    Profile {
        altitude_m: altitude_m.get(),
        power_w: power_w.get(),
    }
}

pub(super) const fn band([least_m, most_m]: [F32; 2]) -> Band {
    Band {
        least_m: least_m.get(),
        most_m: most_m.get(),
    }
}

fn is_zero(numbers: &[F32]) -> bool {
    numbers.iter().all(|number| number.get().to_bits() == 0)
}

impl Layout {
    /// Returns the placement method. With methods other than `Adjust`, the parameters of `Adjust` must be 0.
    pub(super) fn method(&self) -> Result<Method, ConfigError> {
        let (explore_m, rounds) = (self.explore_m.get(), self.rounds.get());
        let unused = explore_m.to_bits() == 0 && rounds == 0;
        match self.method {
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

    pub(super) fn measure(&self) -> Result<Option<Measure>, ConfigError> {
        let i_max_w = self.i_max_w.get();
        match self.samples.get() {
            0 if i_max_w.to_bits() == 0 => Ok(None),
            samples @ 100..=1_000_000 if (1e-30..=1e6).contains(&i_max_w) => {
                Ok(Some(Measure { i_max_w, samples }))
            }
            _ => Err(ConfigError::Measure),
        }
    }

    /// Returns the settings for estimating an unknown interferer; `None` if all of these settings are 0.
    pub(super) fn listen(&self) -> Result<Option<Listen>, ConfigError> {
        let [every, half_life] = self.listen_us;
        let listen = Listen {
            every: Duration::from_micros(every.get()),
            half_life: Duration::from_micros(half_life.get()),
            relative_error: self.relative_error.get(),
        };
        match (every.get(), half_life.get()) {
            (0, 0) if is_zero(&[self.relative_error]) => Ok(None),
            _ if listen.is_valid() && self.points == 0 => Ok(Some(listen)),
            _ => Err(ConfigError::Listen),
        }
    }

    /// Returns the Tx and Rx positions and the drone's speed limit. `None` if all these numbers are 0, which means no
    /// autopilot.
    pub(super) fn sites(&self) -> Result<Option<Sites>, ConfigError> {
        let ends = self.ends.map(|site| site.map(I32::get));
        let speed_m_s = self.speed_m_s.get();
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

    /// Returns the interference in the block.
    ///
    /// If the block has points along x, they are copied to `storage` and used. Otherwise the interferer is used. If all
    /// its numbers are 0 and `listens` is true, the interference is `Unknown`: the relays estimate it.
    pub(super) fn interference(
        &self,
        listens: bool,
        storage: &'static mut FieldStorage,
    ) -> Result<Interference, ConfigError> {
        for (place, [x_m, upsilon_per_w]) in storage.iter_mut().zip(&self.field) {
            *place = FieldPoint {
                x_m: x_m.get(),
                upsilon_per_w: upsilon_per_w.get(),
            };
        }
        let storage: &'static FieldStorage = storage;
        let count = usize::from(self.points.get());
        let points = storage.get(..count).ok_or(ConfigError::Points)?;
        let unused = self.field.get(count..).unwrap_or_default();
        if !is_zero(unused.as_flattened()) {
            return Err(ConfigError::Unused);
        }
        let [power_w, x_m, y_m] = self.interferer.map(F32::get);
        let is_none = is_zero(&self.interferer);
        if points.is_empty() {
            return Ok(if is_none && listens {
                Interference::Unknown
            } else {
                Interference::Source(Interferer { power_w, x_m, y_m })
            });
        }
        if !is_none {
            return Err(ConfigError::Interferer);
        }
        let field = Field::try_new(points).map_err(ConfigError::Field)?;
        Ok(Interference::Field(field))
    }
}
