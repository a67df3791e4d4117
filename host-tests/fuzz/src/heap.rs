//! How often this thread asks for memory, to show that the crate never does.
//!
//! It counts where [`Counting`] is the global allocator: in the fuzz targets of relays and in `tests/fuzz.rs`. Elsewhere
//! [`without`] looks on and sees nothing.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static ASKED: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, and a count of what is asked of it.
#[derive(Clone, Copy, Debug)]
pub struct Counting;

fn count() {
    // A thread that is ending has no counter any more, and nothing that would look at it.
    _ = ASKED.try_with(|asked| asked.set(asked.get().wrapping_add(1)));
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// How often this thread has asked for memory so far.
pub fn asked() -> u64 {
    ASKED.get()
}

/// Does `work`, which must not ask for memory.
///
/// # Panics
/// If it does.
pub fn without<T>(work: impl FnOnce() -> T) -> T {
    let before = asked();
    let done = work();
    assert!(asked() == before, "the crate has asked for memory");
    done
}
