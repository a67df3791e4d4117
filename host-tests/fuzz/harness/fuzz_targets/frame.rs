#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| uav_relay_fuzz::frame(data));
