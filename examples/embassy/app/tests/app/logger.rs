//! Logger that discards everything, on a PC. The tests check that lines are built and that none panics.

#[defmt::global_logger]
struct Logger;

// SAFETY: nothing is written, so writes can not overlap.
unsafe impl defmt::Logger for Logger {
    fn acquire() {}
    unsafe fn flush() {}
    unsafe fn release() {}
    unsafe fn write(_: &[u8]) {}
}
