//! Send gate of the neighbour ports. It is closed while the state that frames would report is being written to disk.

use std::cell::Cell;
use std::rc::Rc;

/// Shared gate: all clones have the same state, open at first.
#[derive(Clone, Debug)]
pub(crate) struct Gate(Rc<Cell<bool>>);

impl Gate {
    pub(crate) fn new() -> Self {
        Self(Rc::new(Cell::new(true)))
    }

    pub(crate) fn set(&self, is_open: bool) {
        self.0.set(is_open);
    }

    pub(crate) fn is_open(&self) -> bool {
        self.0.get()
    }
}
