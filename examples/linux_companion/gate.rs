//! Whether the ports toward other relays may send: not while what they would say is on its way to the disk.

use std::cell::Cell;
use std::rc::Rc;

/// The same gate wherever it is cloned to; open at first.
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
