//! Fleet with more relays than its chain: the relays of the first chain, and the spares.

/// Number of relays of a fleet, and the number of them that are meant to fly in the chain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FleetSize {
    /// Number of relays of the fleet, 1 to 1000.
    pub relays: u16,
    /// Number of relays in the chain: more than half of `relays`, and at most all.
    pub flying: u16,
}

impl FleetSize {
    /// Returns the numbers of the relays of the first chain, from Tx to Rx.
    ///
    /// The spares are spread evenly over the numbers, so that each can join beside relays with close numbers. Relay 1 is
    /// never a spare, because it is the first leader.
    pub fn first(self) -> impl Iterator<Item = u16> {
        let [relays, flying] = [self.relays, self.flying].map(u32::from);
        let numbers = (0..flying).map(move |rank| 1 + rank * relays / flying);
        numbers.filter_map(|it| u16::try_from(it).ok())
    }

    /// Returns the rank of relay `index` in the first chain, from 0 next to Tx; `None` for a spare.
    ///
    /// The work is proportional to `flying`.
    pub fn rank(self, index: u16) -> Option<usize> {
        self.first().position(|it| it == index)
    }

    /// Returns the numbers of the relays that wait as spares at the start, in increasing order.
    pub fn spares(self) -> Vec<u16> {
        let mut all: Vec<u16> = (1..=self.relays).collect();
        all.retain(|index| self.rank(*index).is_none());
        all
    }
}
