//! Gives what libFuzzer makes to `ts3100_fuzz::lsp`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| ts3100_fuzz::lsp::check(data));
