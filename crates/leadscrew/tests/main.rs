//! Machines on pins that note their edges, in virtual time.

mod adapters;
mod bench;
mod gripper;
mod lines;
mod motion;
mod motion_switches;
mod pins;
mod settings;
