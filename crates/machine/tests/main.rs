//! The machine as its main loop and its serial lines see it: a module for each subject.

mod bench;
mod commands;
mod extension;
mod gates;
mod homing;
mod impossible;
mod linuxcnc;
mod nonsense;
mod owners;
mod reports;
mod rotary;
mod rules;
mod session;
mod silent_interrupt;
mod small;
mod spin_up;
mod storing;
mod texts;
