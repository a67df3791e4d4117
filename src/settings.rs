//! Identity and settings of a relay, checked once at start-up.

use crate::channel_load::ChannelLoad;
use crate::features::{ADJUST, ALTITUDE, FIELD, GUARD, SENSING};
use crate::guard::config::GuardConfig;
use crate::mission::{Interference, Mission, MissionConfig, Profile};
use crate::optimiser::joint::MOST_SOLVED;
use crate::optimiser::local::Local;
use crate::optimiser::search::Schedule;
use crate::place::WithoutQuorum;
use crate::sensing::Listen;
use crate::time::Duration;
use crate::wire::auth::Auth;

/// Time for computation and link buffers that the presets include in `hop_time`. The presets are `Settings::wires` and
/// `Settings::radio`.
const LATENCY: Duration = Duration::from_millis(10);

/// Identity of a relay: its network's number, and its index in the chain.
///
/// ```
/// use uav_relay::Identity;
///
/// // The second relay of its chain, on network 7.
/// let identity = Identity { network: 7, index: 2 };
/// # assert_eq!(identity.index, 2);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity {
    /// Number of the network; frames of other networks are ignored.
    pub network: u16,
    /// Index of this relay in the chain, from 1 (next to the transmitter) to N.
    pub index: u16,
}

/// Kind of connection between a relay and its neighbours.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Wiring {
    /// Separate link to each neighbour: two serial ports.
    #[default]
    Pair,
    /// Single channel that both neighbours, and perhaps other relays, receive: one radio.
    Shared,
}

/// Placement algorithm that the leader runs.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Method {
    /// Optimise x at given lateral offsets and altitudes by the paper's Algorithm 1. If the mission gives the
    /// interference as a distribution along x (an interference field), use Algorithm 4.
    #[default]
    Align,
    /// Optimise x, y and altitude jointly, within the mission's ranges. This method is for up to 100 relays, and not
    /// for a mission that gives the interference as a distribution along x.
    Joint,
    /// Optimise x by the paper's Algorithm 1, then move the relays in turn by Algorithm 2. This method is not for a
    /// mission that gives the interference as a distribution along x.
    Adjust(Adjust),
}

/// Parameters of the paper's Algorithm 2, which moves the relays in turn to better positions.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Adjust {
    /// Maximum number of rounds, the paper's `Iter_max`. In a round each relay moves at most once. Algorithm 2 ends
    /// after a round in which no relay moves.
    pub rounds: u16,
    /// Maximum change of a relay's altitude in one move, m: 0 to 1e5; the paper's `epsilon_h`.
    pub explore_m: f32,
    /// Search method for a relay's better position.
    pub local: Local,
}

impl Default for Adjust {
    /// Returns the defaults: 500 rounds, altitude changes of up to 10 m, [`Local::Fine`].
    fn default() -> Self {
        Self {
            rounds: 500,
            explore_m: 10.0,
            local: Local::Fine,
        }
    }
}

/// Settings of a relay that measures the interference itself. Only for a mission that gives the interference as a
/// distribution along x.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Measure {
    /// Largest valid interference power of a sample, W: 1e-30 to 1e6. Samples with a larger power are rejected.
    pub i_max_w: f32,
    /// Number of samples at one position from which an estimate is made, 100 to 1 000 000.
    pub samples: u32,
}

/// Settings of a relay, which its firmware chooses.
///
/// ```
/// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
/// # use paper::*;
/// use uav_relay::{Method, Settings, Wiring};
///
/// // One shared radio channel; joint optimum of x, y and altitude.
/// let settings = Settings { wiring: Wiring::Shared, method: Method::Joint, ..Settings::default() };
/// # #[cfg(feature = "altitude")]
/// assert!(relay(settings).setpoint().is_none());
/// ```
#[expect(clippy::struct_excessive_bools, reason = "settings, each for itself")]
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Altitude and power of this relay; `None` for the values that the mission gives.
    pub profile: Option<Profile>,
    /// True to keep this relay's altitude fixed, although the method optimises altitudes.
    pub hold_altitude: bool,
    /// Method that the leader runs; the other relays act on the leader's messages. The leader is relay 1, or relay N if
    /// the mission gives the interference as a distribution along x.
    pub method: Method,
    /// Measurement of the interference by this relay; `None` for no measurement. The measured interference replaces
    /// the distribution along x that the mission gives. Use `None` if the mission gives no such distribution.
    pub measure: Option<Measure>,
    /// Estimation of an unknown interferer from measurements; `None` for no estimation. Use `None` if the mission gives
    /// the interference as a distribution along x. Set it on all relays of a chain, or on none.
    pub listen: Option<Listen>,
    /// Schedule by which the leader tries target SIRs; the other relays act on the leader's messages.
    pub schedule: Schedule,
    /// True if the leader first predicts the chain's target SIR from the mission. If the prediction is correct, one
    /// round trip of messages along the chain is enough. This setting has an effect only with the bracketed schedule.
    pub predict: bool,
    /// Connection to the neighbours: two links or one shared channel.
    pub wiring: Wiring,
    /// Key and epoch for signing frames. A relay with a key accepts only signed frames; a relay without a key accepts
    /// frames from any sender. Give the key to all relays of a network, or to none.
    pub auth: Option<Auth>,
    /// Maximum time from `poll_transmit` at one relay to `poll_transmit` at the next relay; above 0. The time is for
    /// a message of 100 bytes (a sweep), and includes the computation. For longer messages it is scaled up.
    pub hop_time: Duration,
    /// Silence of a neighbour after which this relay requests heartbeats from it; above 0. Between `probe_after` and
    /// `dead_after` this relay sends 16 requests, and more on a channel that loses frames.
    pub probe_after: Duration,
    /// Minimum silence after which a neighbour counts as lost, and minimum duration of a lease. Above `probe_after`.
    pub dead_after: Duration,
    /// True if the relays need a quorum to continue after the chain has split. A quorum is more than half of the
    /// members of the last agreed view (list of members), or exactly half including the proposer of that view. Without
    /// this rule, the parts of a split chain would interfere with each other.
    pub quorum: bool,
    /// Behaviour of the relay while too few relays are reachable for a quorum.
    pub without_quorum: WithoutQuorum,
    /// Guard that keeps the drones separated while they move, and inside a geofence; `None` for no guard. With a guard
    /// the firmware has to report the drone's position: `Relay::handle_position`.
    pub guard: Option<GuardConfig>,
    /// Duration of the motion to a newly agreed position (feature `departures`). The setpoint moves to the new
    /// position in 32 steps, at most 1.5 times as fast as on average. All relays of a chain begin together. With 0 it
    /// moves in one step, at once.
    ///
    /// If all drones arrive together, no hop is worse during the move than before or after it
    /// ([`docs::batteries`](crate::docs::batteries)). The longest move is about the distance between two neighbours.
    /// Choose the duration so that drones fly it at their usual speed or slower. Use the same value for all relays of a
    /// chain, at most four times `dead_after`.
    #[cfg(feature = "departures")]
    pub respacing: Duration,
    /// True if a relay without a guard (collision avoidance) is allowed to leave (`Relay::leave`). The neighbours of
    /// the leaving relay then fly close to its drone, which still waits at its position. If that relay is the first or
    /// the last of the chain, a neighbour comes within a few metres of it.
    #[cfg(feature = "departures")]
    pub leave_without_guard: bool,
    /// Number of relays that the leader keeps in the chain; 0 for a fleet without such a number.
    ///
    /// While the chain has fewer relays, for example after losses, the leader calls a spare, also without a request to
    /// leave. With a guard, it calls none beside a lost drone that has not been reported as gone. Above half of the
    /// mission's relays, and at most all of them. Use the same value for all relays of a chain, because each of them may
    /// become the leader.
    #[cfg(feature = "departures")]
    pub flying: u16,
    /// True if the firmware converts setpoints to geodetic positions with surveyed Tx and Rx positions. An uploaded
    /// mission without Tx and Rx positions is then rejected if its distance from Tx to Rx differs from the distance
    /// between the surveyed positions. Set it on all relays of a chain, or on none.
    pub sited: bool,
}

impl Default for Settings {
    /// Returns the default settings, for a link of 57 600 baud or faster to each neighbour.
    ///
    /// The relays compute their positions by [`Method::Align`], the paper's Algorithm 1. The leader predicts the
    /// highest target SIR that the chain can meet, and searches by [`Schedule::Bracketed`] if the prediction is
    /// wrong. A neighbour is lost after 15 s of silence.
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Settings {
    /// Returns true if a relay with these settings can fly a mission with the time slots of `config`.
    ///
    /// Equal slots are always allowed. Fitted slots (as long as each hop needs) need the method `Joint` and a known
    /// interferer.
    pub(crate) fn allow_slots_of(&self, config: &MissionConfig) -> bool {
        let is_known = matches!(config.interference, Interference::Source(_));
        let may_fit = self.method == Method::Joint && self.listen.is_none() && is_known;
        !(ALTITUDE && config.fitted_gap > 0.0) || may_fit
    }

    /// Default settings, as a constant for `const` functions.
    const DEFAULT: Self = Self {
        profile: None,
        hold_altitude: false,
        method: Method::Align,
        measure: None,
        listen: None,
        schedule: Schedule::Bracketed,
        predict: true,
        wiring: Wiring::Pair,
        auth: None,
        hop_time: Duration::from_millis(30),
        probe_after: Duration::from_millis(5_000),
        dead_after: Duration::from_millis(15_000),
        quorum: true,
        without_quorum: WithoutQuorum::Hold,
        guard: None,
        #[cfg(feature = "departures")]
        respacing: Duration::from_micros(0),
        #[cfg(feature = "departures")]
        leave_without_guard: false,
        #[cfg(feature = "departures")]
        flying: 0,
        sited: false,
    };

    /// Returns settings for a UART of `baud` bit/s to each neighbour. Below 57 600 bit/s `hop_time` is longer than
    /// the default.
    ///
    /// `hop_time` includes 10 ms for the computation and the buffers of the link. Set a longer time for a slower
    /// link, such as a USB adapter.
    ///
    /// ```
    /// use uav_relay::{Method, Settings};
    ///
    /// const SETTINGS: Settings = Settings { method: Method::Joint, ..Settings::wires(115_200) };
    /// assert_eq!(SETTINGS.hop_time, Settings::default().hop_time);
    /// ```
    pub const fn wires(baud: u32) -> Self {
        let alone = ChannelLoad {
            in_range: 1,
            overhead: 0,
        };
        Self::DEFAULT.with_hop_time(alone, baud)
    }

    /// Returns settings for relays that share one half-duplex radio channel of `baud` bit/s. `load` has the number of
    /// relays in range of each other, and the overhead of a frame.
    ///
    /// `probe_after` is 5 s, or longer if the channel would be overloaded with 5 s ([`ChannelLoad::carried`]).
    /// `dead_after` is three times `probe_after`. `hop_time` is the value of [`ChannelLoad::hop_time`] with a latency
    /// of 10 ms, but at least 30 ms. Set a longer `hop_time` for a radio that buffers frames longer. All relays of a
    /// chain need the same settings.
    ///
    /// ```
    /// use uav_relay::{ChannelLoad, Duration, Settings, Wiring};
    ///
    /// // Thirty relays in range of each other, on 57 600 bit/s.
    /// const SETTINGS: Settings = Settings::radio(57_600, ChannelLoad::of_radios(30));
    /// assert_eq!(SETTINGS.wiring, Wiring::Shared);
    /// assert_eq!(SETTINGS.probe_after, Duration::from_millis(11_815));
    /// assert_eq!(SETTINGS.dead_after, SETTINGS.probe_after.times(3));
    /// ```
    pub const fn radio(baud: u32, load: ChannelLoad) -> Self {
        let probe_after = match load.carried(baud, Self::DEFAULT.probe_after) {
            Ok(()) => Self::DEFAULT.probe_after,
            Err(full) => full.least_probe_after,
        };
        let shared = Self {
            wiring: Wiring::Shared,
            ..Self::DEFAULT
        };
        shared
            .with_hop_time(load, baud)
            .with_probe_after(probe_after)
    }

    /// Returns the settings with this `probe_after`, and with three times this value as `dead_after`.
    #[must_use]
    pub const fn with_probe_after(self, probe_after: Duration) -> Self {
        Self {
            probe_after,
            dead_after: probe_after.times(3),
            ..self
        }
    }

    /// Returns the settings with a `hop_time` long enough for `load` and a channel of `baud` bit/s.
    const fn with_hop_time(self, load: ChannelLoad, baud: u32) -> Self {
        let needed = load.hop_time(baud, LATENCY);
        let hop_time = if needed.as_micros() > self.hop_time.as_micros() {
            needed
        } else {
            self.hop_time
        };
        Self { hop_time, ..self }
    }
}

/// Error: a parameter of an [`Identity`] or of [`Settings`] is out of its range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum SetupError {
    /// The identity's `index` is not within 1 to the mission's number of relays.
    Index,
    /// `profile.altitude_m` is not within 0.1 to 1e5, or `profile.power_w` not within 1e-6 to 1e6.
    Profile,
    /// The step of the fixed-step schedule is not a number above 0.
    Step,
    /// `method` cannot be used. Either the mission gives the interference as a distribution along x, and the method is
    /// not [`Method::Align`]. Or the method is [`Method::Joint`], and the chain has more than 100 relays. Or the method
    /// needs a feature that the crate was built without.
    Method,
    /// The method Joint is used with `listen`, although the mission has data from Rx to Tx (`reverse`). For data in
    /// both directions this method needs a known interferer.
    Reverse,
    /// The mission has fitted slots (`fitted_gap` above 0), but the method is not Joint. Or `listen` is set, or the
    /// interferer is unknown.
    Fitted,
    /// `method.explore_m` is not within 0 to 1e5, or its search grid has fewer than 2 columns or rows.
    Adjust,
    /// `measure.i_max_w` is not within 1e-30 to 1e6, or `measure.samples` not within 100 to 1 000 000. Or the crate was built
    /// without the feature `field`.
    Measure,
    /// `listen.every` or `listen.half_life` is zero, or `listen.relative_error` not within 1e-3 to 1. Or the mission
    /// gives the interference as a distribution along x, or the crate was built without the feature `sensing`.
    Listen,
    /// `hop_time` is zero.
    HopTime,
    /// `auth.epoch` is zero.
    Epoch,
    /// `probe_after` is zero, or `dead_after` is not longer than `probe_after`.
    Silence,
    /// `without_quorum.y_m` is not within -1e4 to 1e4, or `without_quorum.up_m` not within 0 to 1e4.
    WithoutQuorum,
    /// A number of `guard` is out of range, or the crate was built without the feature `guard`.
    Guard,
    /// `respacing` is longer than four times `dead_after`.
    Respacing,
    /// `flying` is above 0, but not within more than half of the mission's relays and all of them. Or a firmware has such
    /// a number, and the crate was built without the feature `departures`.
    Flying,
}

error_texts!(SetupError {
    Index => "the relay's index must be within 1 to the mission's number of relays",
    Profile => "profile.altitude_m must be within 0.1 to 1e5, profile.power_w within 1e-6 to 1e6",
    Step => "the fixed target step (linear SIR) must be above 0",
    Method => "the method cannot be used: a mission with an interference field needs Align; Joint needs the cargo feature `altitude` and at most 100 relays; Adjust needs the cargo feature `adjust`",
    Reverse => "a mission with reverse above 0 (data also toward Tx) needs a known interferer for the method Joint: set listen to None, or use the method Align or Adjust",
    Fitted => "a mission with fitted_gap above 0 (time slots fitted to the hops) needs the method Joint, listen None, and a known interferer (interference Source)",
    Adjust => "Adjust::explore_m (change of altitude per move, m) must be within 0 to 1e5, and the search grid Adjust::local at least 2 by 2",
    Measure => "measure: i_max_w (greatest interference power, W) must be within 1e-30 to 1e6, samples within 100 to 1000000; measure needs the cargo feature `field`",
    Listen => "listen: the times every and half_life must be above 0, relative_error (of a measurement) within 1e-3 to 1; listen needs the cargo feature `sensing`, and a mission without an interference field",
    HopTime => "hop_time must be above 0",
    Epoch => "auth.epoch must be above 0, and above the epoch of every earlier start",
    Silence => "probe_after must be above 0 and dead_after above probe_after",
    WithoutQuorum => "without_quorum.y_m must be within -1e4 to 1e4, without_quorum.up_m within 0 to 1e4",
    Guard => "guard: geofence limits must be within -1e7 to 1e7 m, each lower limit at most its upper limit; separation_m within 0 to 1e5, relays within 1 to 1000, hover_m (position error of a hovering drone) within 0 to 1e3; guard needs the cargo feature `guard`",
    Respacing => "respacing (duration of the motion to new positions) must be at most four times dead_after",
    Flying => "flying (number of relays kept in the chain) must be 0, or above half of the mission's relays and at most all of them; flying needs the cargo feature `departures`",
});

pub(crate) fn check(
    mission: &Mission,
    identity: Identity,
    settings: &Settings,
) -> Result<(), SetupError> {
    if identity.index < 1 || identity.index > mission.relays() {
        return Err(SetupError::Index);
    }
    if settings.profile.is_some_and(|profile| !profile.is_valid()) {
        return Err(SetupError::Profile);
    }
    if let Schedule::FixedStep { step } = settings.schedule
        && !(step > 0.0 && step.is_finite())
    {
        return Err(SetupError::Step);
    }
    let able = match settings.method {
        Method::Align => true,
        Method::Joint => {
            MOST_SOLVED.checked_sub(mission.relays().into()).is_some()
                && mission.interferer().is_some()
        }
        Method::Adjust(_) => ADJUST && mission.interferer().is_some(),
    };
    if !able {
        return Err(SetupError::Method);
    }
    let is_listening_joint = settings.method == Method::Joint && settings.listen.is_some();
    if is_listening_joint && mission.config().reverse > 0.0 {
        return Err(SetupError::Reverse);
    }
    if !settings.allow_slots_of(mission.config()) {
        return Err(SetupError::Fitted);
    }
    if let Method::Adjust(Adjust {
        explore_m, local, ..
    }) = settings.method
    {
        let grid = match local {
            Local::Fine => true,
            Local::Grid { columns, rows } => columns >= 2 && rows >= 2,
        };
        if !((0.0..=1e5).contains(&explore_m) && grid) {
            return Err(SetupError::Adjust);
        }
    }
    if let Some(Measure { i_max_w, samples }) = settings.measure
        && !(FIELD && (1e-30..=1e6).contains(&i_max_w) && (100..=1_000_000).contains(&samples))
    {
        return Err(SetupError::Measure);
    }
    if let Some(listen) = settings.listen
        && !(SENSING && listen.is_valid() && mission.field().is_none())
    {
        return Err(SetupError::Listen);
    }
    if settings.hop_time.as_micros() == 0 {
        return Err(SetupError::HopTime);
    }
    if settings.auth.is_some_and(|auth| auth.parts().1 == 0) {
        return Err(SetupError::Epoch);
    }
    if settings.probe_after.as_micros() == 0 || settings.dead_after <= settings.probe_after {
        return Err(SetupError::Silence);
    }
    if !settings.without_quorum.is_valid() {
        return Err(SetupError::WithoutQuorum);
    }
    if settings
        .guard
        .is_some_and(|confines| !GUARD || !confines.is_valid())
    {
        return Err(SetupError::Guard);
    }
    #[cfg(feature = "departures")]
    if settings.respacing > settings.dead_after.times(4) {
        return Err(SetupError::Respacing);
    }
    #[cfg(feature = "departures")]
    if settings.flying > 0
        && !(mission.relays() / 2 + 1..=mission.relays()).contains(&settings.flying)
    {
        return Err(SetupError::Flying);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{LATENCY, Settings, Wiring};
    use crate::channel_load::ChannelLoad;
    use crate::features::AUTH;
    use crate::time::Duration;

    const RATES: [u32; 7] = [0, 300, 9_600, 57_600, 115_200, 250_000, 921_600];

    #[test]
    fn a_radio_preset_has_the_timing_that_provisioning_requires() {
        let usual = Settings::default();
        for baud in RATES {
            for in_range in [0, 1, 2, 5, 9, 10, 24, 25, 50, 100, 1_000] {
                let load = ChannelLoad::of_radios(in_range);
                let settings = Settings::radio(baud, load);
                let expected = match load.carried(baud, usual.probe_after) {
                    Ok(()) => usual.probe_after,
                    Err(full) => full.least_probe_after,
                };
                assert_eq!(settings.probe_after, expected, "{baud} {in_range}");
                assert_eq!(settings.dead_after, settings.probe_after.times(3));
                if baud > 0 {
                    assert_eq!(load.carried(baud, settings.probe_after), Ok(()));
                }
                let hop_time = load.hop_time(baud, LATENCY).max(usual.hop_time);
                let rest = Settings {
                    wiring: Wiring::Shared,
                    probe_after: settings.probe_after,
                    dead_after: settings.dead_after,
                    hop_time,
                    ..usual
                };
                assert_eq!(settings, rest);
            }
        }
    }

    #[test]
    fn a_preset_for_wires_is_the_default_from_57_600_baud_on() {
        for baud in RATES {
            let settings = Settings::wires(baud);
            let usual = Settings::default();
            assert_eq!(settings == usual, baud >= 57_600, "{baud}");
            assert_eq!(
                (settings.wiring, settings.probe_after),
                (usual.wiring, usual.probe_after)
            );
        }
        let sweep = if AUTH { 108 } else { 100 };
        let slow = Duration::from_micros((sweep * 1_000_000_u64).div_ceil(960) + 10_000);
        assert_eq!(Settings::wires(9_600).hop_time, slow);
    }
}
