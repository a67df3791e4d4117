#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| host_tests::fuzzing::scenario(data));
