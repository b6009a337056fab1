//! Hostile files for the reader of this name; see the library.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| treewright_fuzz::try_as("mat", bytes));
