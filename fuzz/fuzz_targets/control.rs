//! Gives what libFuzzer makes to `ts3100_fuzz::control`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| ts3100_fuzz::control::check(data));
