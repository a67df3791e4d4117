//! Lock-free ring of atomic cells with one producer and one consumer.
//!
//! heapless's `spsc` is not used: it cannot be shown to be free of panics, because its ends do not know its length and so divide
//! and index by a possible zero, and its cells are accessed by unsafe code.

use core::sync::atomic::{AtomicU8, AtomicU16, AtomicUsize, Ordering};

/// Cell of one item. The indices synchronise access, so its own ordering is relaxed.
pub(super) trait Place {
    type Item: Copy;

    fn load(&self) -> Self::Item;
    fn store(&self, item: Self::Item);
}

impl Place for AtomicU8 {
    type Item = u8;

    fn load(&self) -> u8 {
        self.load(Ordering::Relaxed)
    }

    fn store(&self, item: u8) {
        self.store(item, Ordering::Relaxed);
    }
}

impl Place for AtomicU16 {
    type Item = u16;

    fn load(&self) -> u16 {
        self.load(Ordering::Relaxed)
    }

    fn store(&self, item: u16) {
        self.store(item, Ordering::Relaxed);
    }
}

/// Indices of both sides. The ring is empty if they are equal, so one cell is never used.
#[derive(Debug)]
pub(super) struct Marks {
    first: AtomicUsize,
    end: AtomicUsize,
}

impl Marks {
    pub(super) const fn new() -> Self {
        Self {
            first: AtomicUsize::new(0),
            end: AtomicUsize::new(0),
        }
    }
}

#[derive(Debug)]
struct Side<'q, P> {
    places: &'q [P],
    marks: &'q Marks,
}

/// Producer.
#[derive(Debug)]
pub(super) struct Filler<'q, P>(Side<'q, P>);

/// Consumer.
#[derive(Debug)]
pub(super) struct Emptier<'q, P>(Side<'q, P>);

/// Returns both sides; the exclusive borrow of the marks makes them the only ones.
pub(super) fn sides<'q, P>(
    places: &'q [P],
    marks: &'q mut Marks,
) -> (Filler<'q, P>, Emptier<'q, P>) {
    let marks = &*marks;
    (
        Filler(Side { places, marks }),
        Emptier(Side { places, marks }),
    )
}

impl<P> Side<'_, P> {
    const fn behind(&self, at: usize) -> usize {
        let next = at.saturating_add(1);
        if next < self.places.len() { next } else { 0 }
    }
}

impl<P: Place> Filler<'_, P> {
    /// Appends an item; returns false if the ring is full.
    pub(super) fn put(&mut self, item: P::Item) -> bool {
        let Side { places, marks } = &self.0;
        let end = marks.end.load(Ordering::Relaxed);
        let next = self.0.behind(end);
        if next == marks.first.load(Ordering::Acquire) {
            return false;
        }
        let Some(place) = places.get(end) else {
            return false;
        };
        place.store(item);
        marks.end.store(next, Ordering::Release);
        true
    }

    pub(super) fn room(&self) -> usize {
        let Side { places, marks } = &self.0;
        let end = marks.end.load(Ordering::Relaxed);
        let first = marks.first.load(Ordering::Acquire);
        let used = if end >= first {
            end.saturating_sub(first)
        } else {
            places.len().saturating_sub(first.saturating_sub(end))
        };
        places.len().saturating_sub(1).saturating_sub(used)
    }
}

impl<P: Place> Emptier<'_, P> {
    /// Returns the first item without removing it.
    pub(super) fn peek(&self) -> Option<P::Item> {
        let Side { places, marks } = &self.0;
        let first = marks.first.load(Ordering::Relaxed);
        if first == marks.end.load(Ordering::Acquire) {
            return None;
        }
        places.get(first).map(P::load)
    }

    /// Removes the first item, if there is one.
    pub(super) fn pop(&mut self) {
        let marks = self.0.marks;
        let first = marks.first.load(Ordering::Relaxed);
        if first != marks.end.load(Ordering::Acquire) {
            marks.first.store(self.0.behind(first), Ordering::Release);
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::{AtomicU16, Marks, sides};

    #[test]
    fn it_holds_one_less_than_its_places_in_order() {
        let places = [const { AtomicU16::new(0) }; 4];
        let mut marks = Marks::new();
        let (mut filler, mut emptier) = sides(&places, &mut marks);
        for round in 0..9 {
            for item in 0..3 {
                assert_eq!(filler.room(), 3 - usize::from(item));
                assert!(filler.put(10 * round + item));
            }
            assert!(!filler.put(99));
            for item in 0..3 {
                assert_eq!(emptier.peek(), Some(10 * round + item));
                emptier.pop();
            }
            assert_eq!(emptier.peek(), None);
            emptier.pop();
        }
    }

    #[test]
    fn of_no_places_it_takes_nothing() {
        let mut marks = Marks::new();
        let (mut filler, mut emptier) = sides::<AtomicU16>(&[], &mut marks);
        assert!(!filler.put(1));
        emptier.pop();
        assert_eq!((filler.room(), emptier.peek()), (0, None));
    }

    #[test]
    fn two_threads_lose_nothing_and_keep_the_order() {
        let places = [const { AtomicU16::new(0) }; 7];
        let mut marks = Marks::new();
        let (mut filler, mut emptier) = sides(&places, &mut marks);
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for item in 0..2_000 {
                    while !filler.put(item) {
                        std::thread::yield_now();
                    }
                }
            });
            for item in 0..2_000 {
                let got = loop {
                    if let Some(got) = emptier.peek() {
                        break got;
                    }
                    std::thread::yield_now();
                };
                assert_eq!(got, item);
                emptier.pop();
            }
        });
    }
}
