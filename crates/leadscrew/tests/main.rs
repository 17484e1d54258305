//! Machines on pins that note their edges, in virtual time.

mod adapters;
mod bench;
mod lines;
mod pins;
mod settings;
