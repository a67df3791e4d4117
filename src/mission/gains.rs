//! What transmit powers are worth on the hops of a mission.

use super::validated::Mission;
use crate::power_ratio::PowerRatio;

impl Mission {
    /// What multiplies the inverse interference of a place ([`crate::sir::quiet`]) on the first hop: `p_t` / `p_MSI`, in a field
    /// `p_t` `Upsilon_max` / eta.
    #[doc(hidden)]
    pub const fn tx_gain(&self) -> PowerRatio {
        self.tx_gain
    }

    /// What multiplies it on a hop that a relay of `power_w` watts feeds: (`p_u` / `p_MSI`)(eta / `mu_los`), in a field
    /// `p_u` `Upsilon_max` / `mu_los`.
    #[doc(hidden)]
    pub const fn relay_gain(&self, power_w: f32) -> PowerRatio {
        PowerRatio::new(power_w as f64 * self.relay_gain_per_w)
    }

    /// K of the last hop, m^2: SIR at the receiver = K / squared distance to the relay of `power_w` watts that feeds it.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float that fits by the ranges of the mission"
    )]
    #[inline(never)] // called from many places
    pub const fn receiver_gain(&self, power_w: f32) -> f32 {
        (power_w as f64 * self.receiver_gain_per_w) as f32
    }

    /// What the last hop's K is worth against the first hop's gain, m^2: (`p_u` / `p_t`)(`mu_nlos` / eta)((X - D)^2 + Y^2).
    pub(crate) fn last_to_first(&self, power_w: f32) -> f64 {
        f64::from(power_w) * self.receiver_gain_per_w / self.tx_gain.wide()
    }

    /// Power that Tx's signal has at a relay whose squared distance is `squared_m2`, W.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float that fits by the ranges of the mission"
    )]
    pub(crate) fn first_hop_power_w(&self, squared_m2: f32) -> f32 {
        let loss = self.config.channel.eta() * f64::from(squared_m2);
        (f64::from(self.config.tx_power_w) / loss) as f32
    }
}
