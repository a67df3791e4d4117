#![no_main]

#[global_allocator]
static HEAP: host_tests::fuzzing::heap::Counting = host_tests::fuzzing::heap::Counting;

libfuzzer_sys::fuzz_target!(|data: &[u8]| host_tests::fuzzing::chain(data));
