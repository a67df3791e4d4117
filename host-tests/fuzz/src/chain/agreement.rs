//! Check that all relays agree, from any state, after the faults have ended.

use uav_relay::{Phase, Schedule, ViewId};

use super::{Chain, Member};

/// Maximum number of rounds until all relays agree. In a round each relay receives one frame.
///
/// In the slowest agreement, the relays at first avoid links that were lost repeatedly, for some minutes of virtual
/// time. Then 24 passes (messages along the chain and back) go along 4 relays.
const PATIENCE: usize = 40_000;

impl Chain {
    /// Runs the chain without faults until all relays agree in one view (membership of the chain).
    ///
    /// Panics if the agreement takes more than [`PATIENCE`] rounds. Returns at once if the leader finds that no target
    /// SIR can be met. Does nothing if a relay's schedule lowers the target SIR in fixed steps, which takes too long.
    pub(super) fn agree(&mut self) {
        let fixed = |member: &Member| member.settings.schedule != Schedule::Bracketed;
        if self.members.iter().any(fixed) {
            // A schedule of fixed steps takes ten thousand sweeps.
            return;
        }
        for member in &mut self.members {
            member.arriving.clear();
        }
        self.restart();
        for _ in 0..PATIENCE {
            self.round();
            if self.has_agreed() {
                return;
            }
        }
        let states: Vec<_> = self.members.iter().map(state).collect();
        unreachable!("the chain never agrees: {states:?} at {:?}", self.now);
    }

    fn has_agreed(&self) -> bool {
        let leader = self.members.get(self.leader());
        if leader.is_some_and(|leader| phase(leader) == Phase::Infeasible) {
            return true;
        }
        let quiet = self.members.iter().all(|member| member.arriving.is_empty());
        let target = leader.and_then(|leader| leader.watched.relay().target());
        let version = leader.map(|leader| leader.watched.relay().version());
        quiet
            && self.members.iter().all(|member| {
                let relay = member.watched.relay();
                let newest = relay
                    .upload()
                    .is_none_or(|held| held.version() == relay.version());
                phase(member) == Phase::Holding
                    && newest
                    && Some(relay.version()) == version
                    && member.watched.relay().mission().relays() == self.mission.relays()
                    && member.watched.relay().target().map(f32::to_bits) == target.map(f32::to_bits)
            })
    }
}

fn phase(member: &Member) -> Phase {
    member.watched.relay().phase()
}

/// Returns a relay's state for a failure message.
///
/// It has the phase, the view (membership of the chain), the index and number of relays in the view, and the
/// neighbours.
fn state(member: &Member) -> (Phase, ViewId, u16, u16, [Option<u16>; 2]) {
    let relay = member.watched.relay();
    let left = relay.mission().relays();
    let (view, index) = (relay.view(), relay.index());
    (relay.phase(), view, index, left, relay.neighbours())
}
