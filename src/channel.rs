//! Path loss of every kind of link.
//!
//! Received power is transmit power / (mu d^2), with d the distance in metres (the paper's path-loss exponent of 2) and mu = C (4
//! pi f / c)^2. C is the excess loss by shadowing and scattering; it has one value with line of sight and one without.

use core::f64::consts::PI;

/// Speed of light in vacuum, m/s.
const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// Radio propagation between a drone and a station on the ground: line of sight, obstructed, or a mix.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AirGround {
    /// Line of sight between drones and the ground. Their path-loss factor eta is `mu_los`, as between two drones.
    Los,
    /// Obstructed links between drones and the ground. Their path-loss factor eta is `mu_nlos`, as between two ground
    /// stations.
    Nlos,
    /// Partial line of sight with the weight w, 0 to 1. The path-loss factor of links to the ground is
    /// eta = w `mu_los` + (1 - w) `mu_nlos`.
    Weighted(f64),
}

/// Path-loss factors of the three kinds of link, 1/m^2 (loss = factor x distance^2, with metres).
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Channel {
    /// Path-loss factor between two drones, which have line of sight, 1/m^2.
    mu_los: f64,
    /// Path-loss factor without line of sight, 1/m^2. It applies to the path from the interferer to the ground
    /// receiver.
    mu_nlos: f64,
    /// Path-loss factor between a drone and a station on the ground, 1/m^2; the same in both directions.
    eta: f64,
}

/// Reason why the parameters of the radio channel model are rejected.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum ChannelError {
    /// The carrier frequency of the radio channel is not within 1 MHz to 1 THz.
    Carrier,
    /// An excess loss factor is not within 1 (0 dB) to 1e20 (200 dB).
    ExcessLoss,
    /// The excess loss without line of sight is smaller than the excess loss with line of sight.
    LossOrder,
    /// The weight of the line-of-sight path in the channel model is not within 0 to 1.
    Weight,
}

error_texts!(ChannelError {
    Carrier => "carrier frequency must be within 1e6 to 1e12 Hz",
    ExcessLoss => "excess losses, given as factors, must be within 1 to 1e20 (0 to 200 dB)",
    LossOrder => "the excess loss without line of sight must be at least the excess loss with line of sight",
    Weight => "the weight of the line-of-sight loss in the mean loss must be within 0 to 1",
});

impl Channel {
    /// Creates a channel at `carrier_hz`, 1e6 to 1e12. The excess losses `excess_los` and `excess_nlos` are *factors*, 1 to 1e20.
    ///
    /// # Errors
    /// [`ChannelError`] names the parameter that is outside its range.
    pub const fn new(
        carrier_hz: f64,
        excess_los: f64,
        excess_nlos: f64,
        air_ground: AirGround,
    ) -> Result<Self, ChannelError> {
        if !(carrier_hz >= 1e6 && carrier_hz <= 1e12) {
            return Err(ChannelError::Carrier);
        }
        if !(excess_los >= 1.0 && excess_los <= 1e20 && excess_nlos >= 1.0 && excess_nlos <= 1e20) {
            return Err(ChannelError::ExcessLoss);
        }
        if excess_nlos < excess_los {
            return Err(ChannelError::LossOrder);
        }
        let wave_number = 4.0 * PI * carrier_hz / SPEED_OF_LIGHT;
        let free_space = wave_number * wave_number;
        let mu_los = excess_los * free_space;
        let mu_nlos = excess_nlos * free_space;
        let eta = match air_ground {
            AirGround::Los => mu_los,
            AirGround::Nlos => mu_nlos,
            AirGround::Weighted(w) => {
                if !(w >= 0.0 && w <= 1.0) {
                    return Err(ChannelError::Weight);
                }
                w * mu_los + (1.0 - w) * mu_nlos
            }
        };
        Ok(Self {
            mu_los,
            mu_nlos,
            eta,
        })
    }

    /// Creates a channel with excess losses in dB (0 to 200), as in data sheets and the paper.
    ///
    /// The function computes a power of ten, so it cannot be used in a constant.
    ///
    /// ```
    /// use uav_relay::Channel;
    /// use uav_relay::channel::AirGround;
    ///
    /// let channel = Channel::from_db(2e9, 0.1, 21.0, AirGround::Los)?;
    /// assert!((channel.mu_nlos() / channel.mu_los() - 123.0).abs() < 0.1, "20.9 dB more");
    /// # Ok::<(), uav_relay::channel::ChannelError>(())
    /// ```
    ///
    /// # Errors
    /// [`ChannelError`] names the parameter that is outside its range.
    pub fn from_db(
        carrier_hz: f64,
        excess_los_db: f64,
        excess_nlos_db: f64,
        air_ground: AirGround,
    ) -> Result<Self, ChannelError> {
        let factor = |db: f64| libm::pow(10.0, db / 10.0);
        Self::new(
            carrier_hz,
            factor(excess_los_db),
            factor(excess_nlos_db),
            air_ground,
        )
    }

    /// Creates a channel from its path-loss factors, 1/m^2. Returns `None` unless `mu_los` is within 1e-3 to 1e30,
    /// `mu_nlos` within 1 to 1e20 times `mu_los`, and `eta` within `mu_los` to `mu_nlos`.
    pub(crate) fn from_factors(mu_los: f64, mu_nlos: f64, eta: f64) -> Option<Self> {
        let sound = (1e-3..=1e30).contains(&mu_los)
            && (mu_los..=1e20 * mu_los).contains(&mu_nlos)
            && (mu_los..=mu_nlos).contains(&eta);
        sound.then_some(Self {
            mu_los,
            mu_nlos,
            eta,
        })
    }

    /// Returns the channel with its factor `eta` clamped to the range from `mu_los` to `mu_nlos`.
    ///
    /// [`Channel::from_factors`] requires this range. Rounding can put `eta` slightly outside if `mu_los` and `mu_nlos`
    /// are equal.
    pub(crate) fn ordered(self) -> Self {
        Self {
            eta: self.eta.max(self.mu_los).min(self.mu_nlos),
            ..self
        }
    }

    /// Path-loss factor between two drones, 1/m^2. At a distance of d metres from a transmitter of P watts, a receiver
    /// receives P / (factor d^2) watts.
    pub const fn mu_los(&self) -> f64 {
        self.mu_los
    }

    /// Path-loss factor between two places on the ground, 1/m^2.
    pub const fn mu_nlos(&self) -> f64 {
        self.mu_nlos
    }

    /// Path-loss factor between a drone and a station on the ground, 1/m^2.
    pub const fn eta(&self) -> f64 {
        self.eta
    }
}

#[cfg(test)]
mod tests {
    use super::{AirGround, Channel, ChannelError};

    #[test]
    fn the_papers_channel() {
        let channel = Channel::from_db(2e9, 0.1, 21.0, AirGround::Los).unwrap();
        assert!((channel.mu_los() / 7_191.811_792_421_722 - 1.0).abs() < 1e-12);
        assert!((channel.mu_nlos() / 884_786.145_377_666_5 - 1.0).abs() < 1e-12);
        assert!((channel.eta() / channel.mu_los() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn eta_lies_between_the_two_losses() {
        let eta = |w| {
            Channel::new(2e9, 1.0, 100.0, AirGround::Weighted(w))
                .unwrap()
                .eta()
        };
        let ends = Channel::new(2e9, 1.0, 100.0, AirGround::Nlos).unwrap();
        assert!((eta(1.0) / ends.mu_los() - 1.0).abs() < 1e-15);
        assert!((eta(0.0) / ends.mu_nlos() - 1.0).abs() < 1e-15);
        assert!((eta(0.5) / ends.mu_los() - 50.5).abs() < 1e-12);
    }

    #[test]
    fn parameters_out_of_range_are_named() {
        let new = Channel::new;
        assert_eq!(
            new(f64::NAN, 1.0, 2.0, AirGround::Los),
            Err(ChannelError::Carrier)
        );
        assert_eq!(
            new(2e9, 0.9, 2.0, AirGround::Los),
            Err(ChannelError::ExcessLoss)
        );
        assert_eq!(
            new(2e9, 1.0, f64::INFINITY, AirGround::Los),
            Err(ChannelError::ExcessLoss)
        );
        assert_eq!(
            new(2e9, 3.0, 2.0, AirGround::Los),
            Err(ChannelError::LossOrder)
        );
        assert_eq!(
            new(2e9, 1.0, 2.0, AirGround::Weighted(-0.1)),
            Err(ChannelError::Weight)
        );
    }
}
