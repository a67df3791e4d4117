#![no_main]

#[global_allocator]
static HEAP: uav_relay_fuzz::heap::Counting = uav_relay_fuzz::heap::Counting;

libfuzzer_sys::fuzz_target!(|data: &[u8]| uav_relay_fuzz::mavlink(data));
