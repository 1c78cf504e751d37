//! Gives what libFuzzer makes to `ts3100_fuzz::program_test`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| ts3100_fuzz::program_test::check(data));
