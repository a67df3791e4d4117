//! Allocation counter of this thread, to show that the crate never allocates.
//!
//! It counts only if [`Counting`] is the global allocator: in the fuzz targets of relays and in `tests/fuzz/main.rs`.
//! Elsewhere [`without_allocation`] checks nothing.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static ASKED: Cell<u64> = const { Cell::new(0) };
}

/// System allocator that counts the allocations of each thread.
#[derive(Clone, Copy, Debug)]
pub struct Counting;

fn count() {
    // A thread that ends no longer has a counter.
    _ = ASKED.try_with(|asked| asked.set(asked.get().wrapping_add(1)));
}

// SAFETY: every call is forwarded to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: guaranteed by the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: guaranteed by the caller.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: guaranteed by the caller.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: guaranteed by the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Returns the number of allocations by this thread so far.
pub fn allocations() -> u64 {
    ASKED.get()
}

/// Runs `work`, which must not allocate.
///
/// # Panics
/// `work` allocates memory.
pub fn without_allocation<T>(work: impl FnOnce() -> T) -> T {
    let before = allocations();
    let done = work();
    assert!(allocations() == before, "the crate has asked for memory");
    done
}
