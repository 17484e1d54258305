//! The acceptance tests, a module a subject: `cargo test -p leadscrew-tests laser` runs the tests
//! of one subject.
#![forbid(unsafe_code)]

mod answers;
mod bounce;
mod checks;
mod conformance;
mod cycles;
mod dark;
mod examples;
mod facade;
mod flood;
mod golden_steps;
mod inputs;
mod interruptions;
mod laser;
mod latency;
mod lumps;
mod outlines;
mod pins;
mod position;
mod prompt;
mod realtime;
mod resets;
mod shape;
mod silence;
mod step_rate;
mod streams;
mod tables;
mod told;
mod traces;
