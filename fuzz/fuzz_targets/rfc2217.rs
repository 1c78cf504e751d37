//! Gives what libFuzzer makes to `ts3100_fuzz::rfc2217`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| ts3100_fuzz::rfc2217::check(data));
