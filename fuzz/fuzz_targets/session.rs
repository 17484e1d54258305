//! Any bytes, switches and times as a session of a whole machine on its board: see
//! [`leadscrew_tests::abuse`].

#![no_main]

use leadscrew_tests::abuse::endure;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|script: &[u8]| endure(script));
