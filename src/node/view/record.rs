//! Stored votes on views. Without them a restarted relay could break its promises.

use super::electorate::{Electorate, VOTES};
use crate::mission::MAX_RELAYS;
use crate::view::{View, ViewId};
use crate::wire::message::Successor;

/// Version of the stored record's format. The version is the first byte of a record.
const FORMAT: u32 = 1;

/// Votes on views, which must survive a reboot in flight.
///
/// Without stored votes a restarted relay could vote twice, and two parts of a chain could each decide on a view.
///
/// | event | action of the firmware |
/// | --- | --- |
/// | after every input, before `Relay::poll_transmit` | if `Relay::unpersisted` returns a record, store it, then pass it to `Relay::persisted` |
/// | the relay is switched on in flight | pass the record to `Relay::resume_view` right after `Relay::new` |
/// | the relay is switched on before another flight | delete the record |
///
/// The relay transmits nothing until the firmware has confirmed that its record is stored. The record changes a few
/// times in a view change, and never otherwise.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ViewRecord {
    /// Digest of the mission that was loaded before flight.
    base: u16,
    /// Votes on views. The field `initial_leader` is 0, because it is not stored.
    electorate: Electorate,
}

/// Reason why a stored record of votes is rejected.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum RecordError {
    /// The relay that wrote the record had loaded a different mission.
    Base,
    /// The relay has already started, so the votes can no longer be restored.
    Begun,
}

error_texts!(RecordError {
    Base => "the record of votes was written by a relay that was loaded with another mission",
    Begun => "the record of votes must be restored before the relay starts",
});

/// Writer of numbers of one, two or four bytes, least significant byte first. It needs a third of the flash memory of
/// an encoder with an iterator over all bytes.
#[derive(Debug)]
struct RecordWriter<'a>(core::slice::IterMut<'a, u8>);

impl RecordWriter<'_> {
    #[inline(never)]
    fn put(&mut self, number: u32, length: usize) {
        for byte in number.to_le_bytes().into_iter().take(length) {
            if let Some(next) = self.0.next() {
                *next = byte;
            }
        }
    }

    fn put_view(&mut self, view: View) {
        self.put(view.id.bits(), 4);
        self.put(u32::from(view.relays), 2);
    }
}

/// Reader of the numbers written by [`RecordWriter`].
#[derive(Debug)]
struct Reader<'a>(core::slice::Iter<'a, u8>);

impl Reader<'_> {
    #[inline(never)]
    fn take(&mut self, length: usize) -> Option<u32> {
        let mut number = [0; 4];
        for byte in number.iter_mut().take(length) {
            *byte = *self.0.next()?;
        }
        Some(u32::from_le_bytes(number))
    }

    fn take_id(&mut self) -> Option<ViewId> {
        self.take(4).map(ViewId::from_bits)
    }

    fn take_size(&mut self) -> Option<u16> {
        u16::try_from(self.take(2)?).ok()
    }

    fn take_view(&mut self) -> Option<View> {
        let (id, relays) = (self.take_id()?, self.take_size()?);
        (1..=MAX_RELAYS)
            .contains(&relays)
            .then_some(View { id, relays })
    }

    fn take_flag(&mut self) -> Option<bool> {
        let flag = self.take(1)?;
        (flag <= 1).then_some(flag == 1)
    }
}

impl ViewRecord {
    /// Length of a stored record, bytes.
    pub const LENGTH: usize = 25 + 4 * VOTES;

    pub(crate) const fn new(base: u16, electorate: Electorate) -> Self {
        Self {
            base,
            electorate: Electorate {
                initial_leader: 0,
                ..electorate
            },
        }
    }

    /// Returns the votes in the record; `None` if it belongs to a different mission.
    ///
    /// The loaded mission has the digest `base`, `relays` relays and the leader `initial_leader`.
    pub(super) fn electorate(
        &self,
        base: u16,
        relays: u16,
        initial_leader: u16,
    ) -> Option<Electorate> {
        let Electorate { agreed, .. } = self.electorate;
        let fits = agreed.relays == relays || agreed.id > ViewId::LOADED && agreed.relays < relays;
        (self.base == base && fits).then_some(Electorate {
            initial_leader,
            ..self.electorate
        })
    }

    /// Encodes the record for storage, without a checksum.
    pub fn to_bytes(&self) -> [u8; Self::LENGTH] {
        let said = &self.electorate;
        let accepted = said.accepted.unwrap_or(nothing_after(said.agreed));
        let mut stored = [0; Self::LENGTH];
        let mut to = RecordWriter(stored.iter_mut());
        to.put(FORMAT, 1);
        to.put(u32::from(self.base), 2);
        to.put_view(said.agreed);
        to.put(u32::from(said.member), 1);
        to.put(said.promised.bits(), 4);
        to.put(u32::from(said.accepted.is_some()), 1);
        to.put(accepted.proposal.bits(), 4);
        to.put_view(accepted.view);
        for voted in &said.voted {
            to.put(voted.bits(), 4);
        }
        stored
    }

    /// Decodes a stored record; `None` if its format or its content is invalid.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != Self::LENGTH {
            return None;
        }
        let mut from = Reader(bytes.iter());
        if from.take(1)? != FORMAT {
            return None;
        }
        let base = from.take_size()?;
        let agreed = from.take_view()?;
        let member = from.take_flag()?;
        let promised = from.take_id()?;
        let known = from.take_flag()?;
        let (proposal, view) = (from.take_id()?, from.take_view()?);
        let accepted = Successor { proposal, view };
        let mut voted = [ViewId::LOADED; VOTES];
        for voted in &mut voted {
            *voted = from.take_id()?;
        }
        let electorate = Electorate {
            agreed,
            member,
            promised,
            accepted: known.then_some(accepted),
            voted,
            initial_leader: 0,
        };
        let sound = (known || accepted == nothing_after(agreed)) && is_sound(&electorate);
        sound.then_some(Self { base, electorate })
    }
}

/// Returns the stored value for "no accepted view". `agreed` is the relay's newest agreed view.
const fn nothing_after(agreed: View) -> Successor {
    Successor {
        proposal: ViewId::LOADED,
        view: agreed,
    }
}

/// Returns true if a relay can have the acceptor state `kept`. Any other stored state is invalid.
fn is_sound(kept: &Electorate) -> bool {
    let Electorate {
        agreed, promised, ..
    } = *kept;
    let is_between = |id: ViewId| id.is_proposed() && agreed.id < id && id <= promised;
    let accepted = kept.accepted.is_none_or(|accepted| {
        accepted.view.id <= accepted.proposal
            && [accepted.view.id, accepted.proposal]
                .into_iter()
                .all(is_between)
    });
    let mut later = None;
    for &id in &kept.voted {
        let falls = later.is_none_or(|later| later > id);
        if id != ViewId::LOADED && !(falls && is_between(id)) {
            return false;
        }
        later = Some(id);
    }
    let known = |id: ViewId| id == ViewId::LOADED || id.is_proposed();
    let loaded = agreed.id != ViewId::LOADED || kept.member;
    known(agreed.id) && agreed.id <= promised && known(promised) && loaded && accepted
}

#[cfg(test)]
mod tests {
    use super::{Electorate, RecordError, ViewRecord};
    use crate::mission::Mission;
    use crate::mission::tests::paper;
    use crate::node::context::OtherLeases;
    use crate::relay::Relay;
    use crate::settings::{Identity, Settings, Wiring};
    use crate::time::Instant;
    use crate::view::{View, ViewId};
    use crate::wire::digest::digest;

    fn view(number: u32, node: u32) -> ViewId {
        ViewId::from_bits(number << 10 | node)
    }

    /// Returns the voting state of a relay that has accepted a view and then voted on two proposals.
    fn busy() -> Electorate {
        let mut electorate = Electorate::new(3, 1);
        let first = view(1, 1);
        electorate.vote(2, first, None, OtherLeases::NONE).unwrap();
        let relays = 3;
        let base = electorate.agreed();
        assert!(electorate.accept(first, base, Some(View { id: first, relays })));
        electorate
            .vote(2, view(2, 3), None, OtherLeases::NONE)
            .unwrap();
        electorate
            .vote(2, view(3, 1), None, OtherLeases::NONE)
            .unwrap();
        electorate
    }

    fn stored() -> [u8; ViewRecord::LENGTH] {
        ViewRecord::new(7, busy()).to_bytes()
    }

    #[test]
    fn a_record_is_read_back_unchanged() {
        let mut later = busy();
        later.commit();
        for electorate in [Electorate::new(1000, 1), busy(), later] {
            let record = ViewRecord::new(7, electorate);
            assert_eq!(ViewRecord::from_bytes(&record.to_bytes()), Some(record));
        }
        let relays = busy().agreed().relays;
        let record = ViewRecord::from_bytes(&stored()).unwrap();
        assert_eq!(record.electorate(7, relays, 1), Some(busy()));
    }

    #[test]
    fn another_length_and_another_format_are_refused() {
        let bytes = stored();
        for length in 0..bytes.len() {
            assert_eq!(ViewRecord::from_bytes(&bytes[..length]), None, "{length}");
        }
        let mut longer = [0; ViewRecord::LENGTH + 1];
        longer[..bytes.len()].copy_from_slice(&bytes);
        assert_eq!(ViewRecord::from_bytes(&longer), None);
        assert_eq!(ViewRecord::from_bytes(&[0xFF; ViewRecord::LENGTH]), None);
        assert_eq!(ViewRecord::from_bytes(&[0; ViewRecord::LENGTH]), None);
    }

    /// Checks that a stored record with one changed byte is rejected, or encodes to the same bytes.
    #[test]
    fn impossible_votes_are_not_read() {
        let mut taken = 0;
        for at in 0..ViewRecord::LENGTH {
            for value in 0..=u8::MAX {
                let mut bytes = stored();
                bytes[at] = value;
                if let Some(record) = ViewRecord::from_bytes(&bytes) {
                    assert_eq!(record.to_bytes(), bytes);
                    taken += 1;
                }
            }
        }
        assert!(taken < ViewRecord::LENGTH * 128, "{taken}");
        let small = ViewRecord::LENGTH - 4;
        for (at, value) in [(7, 0), (8, 4), (9, 2), (9, 0), (10, 0), (14, 2), (small, 1)] {
            let mut bytes = stored();
            bytes[at] = value;
            assert_eq!(ViewRecord::from_bytes(&bytes), None, "byte {at}");
        }
    }

    /// Returns the stored votes of a relay that has just started, in a chain of three.
    fn fresh() -> ViewRecord {
        ViewRecord::new(digest(relay(3).mission()), Electorate::new(3, 1))
    }

    fn relay(relays: u16) -> Relay {
        relay_with(relays, 2, Settings::default())
    }

    fn relay_with(relays: u16, index: u16, settings: Settings) -> Relay {
        let mission = Mission::try_new(paper(relays)).unwrap();
        let identity = Identity { network: 1, index };
        Relay::new(mission, identity, settings, 1, Instant::ZERO).unwrap()
    }

    #[test]
    fn a_restarted_relay_has_its_stored_votes() {
        let mut first = relay(3);
        assert_eq!(first.unpersisted(), None);
        let record = ViewRecord::new(digest(first.mission()), busy());
        assert_eq!(first.resume_view(Instant::ZERO, &record), Ok(()));
        assert_eq!(first.unpersisted(), None);
        first.persisted(&fresh());
        assert_eq!(first.unpersisted(), Some(record));
        let same = ViewRecord::from_bytes(&record.to_bytes()).unwrap();
        first.persisted(&same);
        assert_eq!(first.unpersisted(), None);
    }

    /// Checks that a relay sends nothing before its record is stored. The tested relay is number 2 of 3 on a shared
    /// channel, with silent neighbours.
    #[test]
    fn nothing_is_sent_before_the_record_is_stored() {
        let settings = Settings {
            wiring: Wiring::Shared,
            ..Settings::default()
        };
        let mut relay = relay_with(3, 2, settings);
        let other = ViewRecord::new(digest(relay.mission()), busy());
        relay.persisted(&other);
        let mut frame = [0; crate::wire::frame::MAX_FRAME];
        let mut now = Instant::ZERO;
        for _ in 0..100 {
            now = now.max(relay.poll_timeout().unwrap());
            relay.handle_timeout(now);
            assert_eq!(relay.poll_transmit(now, &mut frame), None);
        }
        let record = relay.unpersisted().unwrap();
        relay.persist(|_| false);
        assert_eq!(relay.poll_transmit(now, &mut frame), None);
        relay.persist(|stored| *stored == record);
        assert!(relay.poll_transmit(now, &mut frame).is_some());
    }

    #[test]
    fn a_record_restores_only_an_unstarted_relay_of_its_mission() {
        let record = fresh();
        let mut other = relay(4);
        assert_eq!(
            other.resume_view(Instant::ZERO, &record),
            Err(RecordError::Base)
        );
        let digest = digest(relay(3).mission());
        let stray = ViewRecord::new(digest.wrapping_add(1), busy());
        assert_eq!(
            relay(3).resume_view(Instant::ZERO, &stray),
            Err(RecordError::Base)
        );
        let mut twice = relay(3);
        let busy = ViewRecord::new(digest, busy());
        assert_eq!(twice.resume_view(Instant::ZERO, &busy), Ok(()));
        assert_eq!(
            twice.resume_view(Instant::ZERO, &busy),
            Err(RecordError::Begun)
        );
        // A leader starts without a received message.
        let mut leader = relay_with(3, 1, Settings::default());
        let soon = Instant::from_millis(1);
        while let Some(at) = leader.poll_timeout().filter(|at| *at < soon) {
            leader.handle_timeout(at);
        }
        assert_eq!(
            leader.resume_view(Instant::ZERO, &record),
            Err(RecordError::Begun)
        );
    }
}
