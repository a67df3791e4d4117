//! What a relay is and flies, as every layer is handed it, and what a layer asks of the others.

use super::circulation::Path;
use super::timing::{longest_lease, tenths};
use super::view::electorate::Held;
#[cfg(feature = "upload")]
use crate::geodetic::LineError;
use crate::geodetic::Sites;
#[cfg(feature = "upload")]
use crate::guard::config::Geofence;
#[cfg(feature = "upload")]
use crate::mission::MissionConfig;
use crate::mission::{Band, Heading, Interference, Mission};
use crate::place::Placement;
use crate::settings::{Method, Settings};
use crate::time::Instant;
use crate::view::ViewId;
use crate::wire::digest::{MissionId, between, digest};

/// The relay as a member of its chain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    /// The mission that it flies, with as many relays as are in the view.
    pub(crate) mission: Mission,
    /// What that mission says of the interference, whatever is believed.
    pub(crate) interference: Interference,
    pub(crate) settings: Settings,
    /// Its own node number, from 1 next to Tx.
    pub(crate) node: u16,
    /// Relays of the mission as it was loaded.
    pub(crate) all: u16,
    /// The digest of that.
    pub(crate) digest: u16,
    /// The distance of that, m.
    #[cfg(feature = "upload")]
    pub(crate) loaded_m: f32,
    /// The altitudes of that, m.
    #[cfg(feature = "upload")]
    loaded_band: Band,
    /// The mission that it flies.
    pub(crate) active: MissionId,
    /// The sites of that, if it has its own: then places are along the line between these.
    #[cfg(feature = "upload")]
    sites: Option<Sites>,
    /// The view accepted last.
    pub(crate) view: ViewId,
    /// Its place in the view, from 1 next to Tx.
    pub(crate) index: u16,
}

impl Member {
    pub(crate) fn new(mission: Mission, settings: Settings, node: u16) -> Self {
        let digest = digest(&mission);
        Self {
            settings,
            node,
            all: mission.relays(),
            digest,
            #[cfg(feature = "upload")]
            loaded_m: mission.config().distance_m,
            #[cfg(feature = "upload")]
            loaded_band: altitudes_of(mission.config()),
            active: MissionId { version: 0, digest },
            #[cfg(feature = "upload")]
            sites: None,
            view: ViewId::LOADED,
            index: node,
            interference: *mission.interference(),
            mission,
        }
    }

    /// The sites of the mission that it flies, if it has its own.
    #[cfg(feature = "upload")]
    pub(crate) const fn sites(&self) -> Option<Sites> {
        self.sites
    }

    /// What is loaded has none, and nothing else is flown.
    #[cfg(not(feature = "upload"))]
    #[expect(clippy::unused_self, reason = "as with uploads")]
    pub(crate) const fn sites(&self) -> Option<Sites> {
        None
    }

    /// It flies a mission between `sites` from now on; whether places are along another line.
    #[cfg(feature = "upload")]
    pub(crate) fn fly_between(&mut self, sites: Option<Sites>) -> bool {
        core::mem::replace(&mut self.sites, sites) != sites
    }

    /// The digest of the line that its places are along.
    pub(crate) fn line(&self) -> u16 {
        between(self.digest, self.sites())
    }

    /// The box that its settings ask for, if they ask for a guard: it goes along with the distance between other sites.
    #[cfg(feature = "upload")]
    pub(crate) fn geofence(&self) -> Option<Geofence> {
        let mut fence = self.settings.guard?.fence;
        if self.sites.is_some() {
            let longer_m = self.mission.config().distance_m - self.loaded_m;
            fence.most_x_m = (fence.most_x_m + longer_m).max(fence.least_x_m);
        }
        Some(fence)
    }

    /// Returns what is wrong where a relay that flies `config` could be sent outside of the box of its settings. With sites of its own
    /// the box is as much longer as the line.
    ///
    /// The room of a mission is the same at all relays. So that they decide alike, the box counts without what it was widened by to the
    /// altitude that this relay alone holds.
    #[cfg(feature = "upload")]
    pub(crate) fn encloses(&self, config: &MissionConfig, sited: bool) -> Result<(), LineError> {
        let Some(guard) = self.settings.guard else {
            return Ok(());
        };
        let fence = guard.fence;
        let own_m = self.settings.profile.map(|own| own.altitude_m);
        let edge = |edge_m: f32, loaded_m: f32| match own_m {
            Some(own_m) if own_m.to_bits() == edge_m.to_bits() => loaded_m,
            _ => edge_m,
        };
        let altitudes_m = Band {
            least_m: edge(fence.least_altitude_m, self.loaded_band.least_m),
            most_m: edge(fence.most_altitude_m, self.loaded_band.most_m),
        };
        let is_within = |inner: Band, outer: Band| {
            inner.least_m >= outer.least_m && inner.most_m <= outer.most_m
        };
        let sides_m = Band {
            least_m: fence.least_y_m,
            most_m: fence.most_y_m,
        };
        if !is_within(altitudes_of(config), altitudes_m) {
            Err(LineError::Altitude)
        } else if !is_within(config.lateral, sides_m) {
            Err(LineError::Lateral)
        } else if !sited && config.distance_m > fence.most_x_m.max(self.loaded_m) {
            Err(LineError::Length)
        } else {
            Ok(())
        }
    }

    /// Its place from the leader on, from 1, and how many there are, while nothing was counted.
    pub(crate) const fn place_in_all(&self) -> (u16, u16) {
        let place = match self.mission.heading() {
            Heading::TowardRx => self.node,
            Heading::TowardTx => self.all.saturating_sub(self.node).saturating_add(1),
        };
        (place, self.all)
    }

    /// The digest that passes bear in the view agreed on.
    pub(crate) const fn pass_digest(&self) -> u16 {
        self.active.digest.wrapping_add(self.view.mark())
    }
}

/// The altitudes of a mission, m: its band, and the one that the relays have in common.
#[cfg(feature = "upload")]
fn altitudes_of(config: &MissionConfig) -> Band {
    let common_m = config.common.altitude_m;
    Band {
        least_m: config.band.least_m.min(common_m),
        most_m: config.band.most_m.max(common_m),
    }
}

/// What every layer is handed.
#[derive(Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(crate) now: Instant,
    pub(crate) member: &'a Member,
    /// The newest mission that the relay holds.
    pub(crate) latest: MissionId,
    /// Whether nobody comes after it on a pass.
    pub(crate) end: bool,
    /// For how long what was agreed on may be held elsewhere.
    pub(crate) held: Held,
}

impl<'a> Context<'a> {
    pub(crate) const fn mission(&self) -> &'a Mission {
        &self.member.mission
    }

    pub(crate) const fn settings(&self) -> &'a Settings {
        &self.member.settings
    }

    /// Its place among the relays of the view, 1 next to Tx.
    pub(crate) const fn index(&self) -> u16 {
        self.member.index
    }

    /// The digest that the passes of the view bear.
    pub(crate) const fn digest(&self) -> u16 {
        self.member.pass_digest()
    }

    /// Whether the joint method is asked for, and has something to choose.
    pub(crate) fn joins(&self) -> bool {
        let config = self.mission().config();
        let free = !(config.band.is_single() && config.lateral.is_single());
        cfg!(feature = "altitude") && self.settings().method == Method::Joint && free
    }

    /// The longest that anything is held, in tenths of a second.
    pub(crate) fn longest_lease(&self) -> u16 {
        tenths(longest_lease(self.settings()))
    }

    /// Whether passes begin here.
    pub(crate) fn leads(&self) -> bool {
        self.index() == self.mission().leader()
    }

    pub(crate) fn is_last(&self) -> bool {
        self.mission().after(self.index()).is_none()
    }

    /// Returns the path from this relay to the last relay of the view.
    pub(crate) fn path_to_last(&self) -> Path {
        let mission = self.mission();
        self.path(match mission.heading() {
            Heading::TowardRx => mission.relays().saturating_sub(self.index()),
            Heading::TowardTx => self.index().saturating_sub(1),
        })
    }

    /// Returns the path from this relay to the leader.
    pub(crate) fn path_to_leader(&self) -> Path {
        let relays = self.mission().relays();
        self.path(
            relays
                .saturating_sub(self.path_to_last().hops)
                .saturating_sub(1),
        )
    }

    /// Returns a path of `hops` hops on which no relay computes.
    pub(crate) const fn path(&self, hops: u16) -> Path {
        Path {
            hop_time: self.member.settings.hop_time,
            hops,
            slow: false,
        }
    }

    /// Whether a neighbour may stand at `place`.
    pub(crate) fn is_between(&self, place: Placement) -> bool {
        (0.0..=self.mission().config().distance_m).contains(&place.x_m)
    }

    /// The altitudes that this relay may choose from, when it holds `altitude_m`.
    pub(crate) fn band(&self, altitude_m: f32) -> Band {
        if self.settings().hold_altitude {
            Band::at(altitude_m)
        } else {
            self.mission().config().band
        }
    }
}

/// What a layer asks of the others, or has them know.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is one thing that happened or did not"
)]
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Effects {
    /// A message was of something that is over.
    pub(crate) stale: bool,
    /// A message had come before.
    pub(crate) repeated: bool,
    /// A message is sent again for want of an answer.
    pub(crate) resent: bool,
    /// A pass, or a proposal, begins here.
    pub(crate) began: bool,
    /// The chain has agreed on a target.
    pub(crate) converged: bool,
    /// No target can be met.
    pub(crate) infeasible: bool,
    /// A new view is needed.
    pub(crate) view_needed: bool,
    /// What was agreed on is not held any more.
    pub(crate) lapsed: bool,
    /// The neighbour onward, or the one back, was there at that time or later.
    pub(crate) heard_onward: Option<Instant>,
    pub(crate) heard_back: Option<Instant>,
    /// A proposal is under way: no pass goes on until it is decided.
    pub(crate) view_proposed: bool,
    /// It came from the neighbour before, or begins here.
    pub(crate) proposed_by: Option<Proposer>,
    /// The neighbour toward the leader is to be asked for a view.
    pub(crate) ask: bool,
    /// What came of a proposal.
    pub(crate) decided: Option<Decided>,
    /// Something else is believed of the interference.
    pub(crate) believes: bool,
    /// What is heard of it is not of one source.
    pub(crate) unclear: bool,
    /// The node that hears something else than all the others.
    pub(crate) off: Option<u16>,
}

/// What came of a proposal.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Decided {
    /// The view proposed, of so many relays; its places are not to be taken for so many tenths of a second.
    Granted { relays: u16, lease_left: u16 },
    /// An earlier view, of others perhaps: the next one follows it.
    Earlier,
    /// They are too few.
    Refused,
}

/// Who hands a proposal to a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Proposer {
    Itself,
    Neighbour,
}

impl Effects {
    pub(crate) const NONE: Self = Self {
        stale: false,
        repeated: false,
        resent: false,
        began: false,
        converged: false,
        infeasible: false,
        view_needed: false,
        lapsed: false,
        heard_onward: None,
        heard_back: None,
        view_proposed: false,
        proposed_by: None,
        ask: false,
        decided: None,
        believes: false,
        unclear: false,
        off: None,
    };

    pub(crate) const STALE: Self = Self {
        stale: true,
        ..Self::NONE
    };

    /// It cannot be taken part in: a new view is needed.
    pub(crate) const FOREIGN: Self = Self {
        stale: true,
        view_needed: true,
        ..Self::NONE
    };

    pub(crate) const REPEATED: Self = Self {
        repeated: true,
        ..Self::NONE
    };
}
