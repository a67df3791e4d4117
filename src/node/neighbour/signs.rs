//! Signs of life that are owed to the neighbour.

/// What waits to be sent to the neighbour, apart from passes and what comes back of them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Signs {
    /// A question whether it is there.
    pub(super) ask: bool,
    /// The answer to its question of that number, 0 for none.
    pub(super) answer: u16,
}

impl Signs {
    pub(super) const NONE: Self = Self {
        ask: false,
        answer: 0,
    };
}
