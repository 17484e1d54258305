//! The checks, by name.
mod board_jobs;
mod boards;
mod bootloader;
pub(crate) mod costs;
mod endings;
mod floods;
mod homing;
mod interrupts;
mod late;
mod machines;
mod motion;
mod outputs;
mod planting;
mod polarity;
mod power_loss;
mod probe;
mod raster;
pub(crate) mod rate;
pub(crate) mod rates;
mod realtime;
mod records;
mod stall;
mod start_up;
mod stopping;
mod stores;
mod streams;
mod supplied;
mod switches;
mod timing;
mod together;
mod unattended;
mod update;
mod usb;
mod watchdog;

use crate::{bench::Failure, firmware::Firmware};
use std::fmt::{self, Write};

/// One check.
pub(crate) struct Check {
    pub(crate) name: &'static str,
    /// The rule that must hold.
    pub(crate) what: &'static str,
    /// The images that it runs, by their names: no other is built for it.
    pub(crate) needs: &'static [&'static str],
    pub(crate) run: fn(&Firmware) -> Result<Figures, Failure>,
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<16} {}", self.name, self.what)
    }
}

/// The figures that a check has measured: they are printed, and written down in
/// `docs/benchmarks.md`.
#[derive(Default)]
pub(crate) struct Figures(String);

impl Figures {
    /// Adds a row.
    pub(crate) fn add(&mut self, name: impl fmt::Display, value: impl fmt::Display) {
        // Writing to a string does not fail.
        let _ = writeln!(self.0, "    {name}: {value}");
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The Discovery's image at 115200 baud, and at 2 Mbaud.
const USUAL: &[&str] = &["usual"];
const FAST: &[&str] = &["fast"];

/// All checks.
pub(crate) const CHECKS: &[Check] = &[
    Check {
        name: "queued-traces",
        what: "recorded programs, wholly queued: every interval equal to the tick",
        needs: USUAL,
        run: motion::queued_traces,
    },
    Check {
        name: "queued-examples",
        what: "example jobs and a circle with a jerk limit, wholly queued: the same",
        needs: USUAL,
        run: motion::queued_examples,
    },
    Check {
        name: "full-queue",
        what: "jobs longer than the queue on a line that keeps it full: the same",
        needs: FAST,
        run: streams::full_queue,
    },
    Check {
        name: "stream-short",
        what: "recorded programs at 115200 baud: the same path, time within 1 %",
        needs: USUAL,
        run: streams::short,
    },
    Check {
        name: "stream-traces",
        what: "all recorded programs: the same",
        needs: USUAL,
        run: streams::traces,
    },
    Check {
        name: "stream-examples",
        what: "example jobs: the same",
        needs: USUAL,
        run: streams::examples,
    },
    Check {
        name: "stream-fast",
        what: "example jobs at 2 Mbaud: the same",
        needs: FAST,
        run: streams::fast_examples,
    },
    Check {
        name: "silent-sender",
        what: "a sender falls silent in mid-job for nine tenths of $710: the job takes no longer",
        needs: FAST,
        run: streams::silent_sender,
    },
    Check {
        name: "step-interrupt",
        what: "three motors, cold flash caches: a tick takes at most 230 cycles, one in twenty, which loads a segment, 480",
        needs: USUAL,
        run: timing::step_interrupt,
    },
    Check {
        name: "costs",
        what: "what the simulator charges its CPU is what the firmware takes, within 10 %",
        needs: &["usual", "fast"],
        run: costs::costs,
    },
    Check {
        name: "jitter",
        what: "step edges against the schedule at every ratio of period to pulse: at most 40 cycles",
        needs: USUAL,
        run: timing::jitter_at_every_ratio,
    },
    Check {
        name: "together",
        what: "USB, the serial line, loads, flash and glitches of switches at once: the same, at most 42; priorities as documented",
        needs: &["fast", "skr-2"],
        run: together::together,
    },
    Check {
        name: "rate",
        what: "three motors at 370 kHz: no late event; faster settings are told so",
        needs: FAST,
        run: rate::at_the_cap,
    },
    Check {
        name: "direction",
        what: "a direction is there as long before a step as $709 asks for, on the board as in the simulator",
        needs: USUAL,
        run: motion::direction_setup,
    },
    Check {
        name: "late-arm",
        what: "the core stands still in a tick, past the next tick: motion goes on, no step is lost",
        needs: USUAL,
        run: late::late_arm,
    },
    Check {
        name: "long-rest",
        what: "52 s of rest, in which the step timer comes round: the next line begins as the one before",
        needs: USUAL,
        run: late::long_rest,
    },
    Check {
        name: "reset-byte",
        what: "0x18 in motion: last step edge within 1 ms, power off",
        needs: USUAL,
        run: realtime::reset_byte,
    },
    Check {
        name: "realtime",
        what: "? and 0x18 in the midst of a full line at 2 Mbaud: acted on within 0.3 ms",
        needs: FAST,
        run: realtime::on_a_full_line,
    },
    Check {
        name: "report-in-list",
        what: "? while $$ goes out at 115200 baud: a report within 5 ms, between two rows",
        needs: USUAL,
        run: realtime::in_a_list,
    },
    Check {
        name: "limits",
        what: "a limit switch: alarm, last step edge within 10 us after the filter's time, laser off",
        needs: USUAL,
        run: switches::limit_switches,
    },
    Check {
        name: "reset-button",
        what: "the reset button: the same",
        needs: USUAL,
        run: switches::reset_button,
    },
    Check {
        name: "dark-at-rest",
        what: "reset button and limit switch put out a laser at rest, also while a sector is erased",
        needs: &["usual", "fast"],
        run: switches::at_rest,
    },
    Check {
        name: "filter",
        what: "inputs: what is shorter than the filter's time changes nothing, what is longer does",
        needs: USUAL,
        run: switches::filter,
    },
    Check {
        name: "noise",
        what: "noise of 1.7 MHz on a switch's line: the machine answers, and motion goes on",
        needs: USUAL,
        run: switches::noise,
    },
    Check {
        name: "buttons",
        what: "hold, start, door and reset in a job, which ends at its last step",
        needs: USUAL,
        run: switches::buttons,
    },
    Check {
        name: "outputs",
        what: "spindle, coolant and enable pins follow their words",
        needs: USUAL,
        run: outputs::outputs,
    },
    Check {
        name: "probe",
        what: "the probe's position is that of the simulator",
        needs: USUAL,
        run: probe::probe,
    },
    Check {
        name: "homing",
        what: "homing finds the limit switches and pulls off",
        needs: USUAL,
        run: homing::homing,
    },
    Check {
        name: "start-up",
        what: "every pin that could do harm is off within 20 us after reset, up to the banner",
        needs: &["usual", "machine-003", "dual-y", "machine-file-001", "machine-file-004"],
        run: start_up::pins,
    },
    Check {
        name: "bootloader",
        what: "bootloaders after ST's template start it, and nothing that one leaves behind goes on",
        needs: &["usual", "skr-2"],
        run: bootloader::bootloaders,
    },
    Check {
        name: "loader",
        what: "$DFU goes to ST's loader, from rest alone, with a fresh chip whose outputs are off",
        needs: USUAL,
        run: bootloader::loader,
    },
    Check {
        name: "edge-speed",
        what: "step, power, serial and USB pins have edges as fast as their rates ask for",
        needs: USUAL,
        run: bootloader::edges,
    },
    Check {
        name: "crystal",
        what: "a crystal that does not start, or is another one: said so, and all works",
        needs: USUAL,
        run: start_up::crystal,
    },
    Check {
        name: "log",
        what: "the log over RTT says something at start-up",
        needs: USUAL,
        run: start_up::log,
    },
    Check {
        name: "sleep",
        what: "at rest the core sleeps",
        needs: USUAL,
        run: start_up::sleep,
    },
    Check {
        name: "update",
        what: "an update of the firmware leaves the settings as they are",
        needs: &["usual", "skr-2"],
        run: update::update,
    },
    Check {
        name: "boards",
        what: "other boards: boot, a recorded program to the tick, homing, power at 50 Hz to 100 kHz, an engraved row, a reset in motion",
        needs: &["machine-003", "skr-2", "core-xy", "dual-y"],
        run: boards::boards,
    },
    Check {
        name: "more-boards",
        what: "boards that came later, and six axes on the Discovery: the same, and every pin is safe at once",
        needs: &["octopus", "fly-407zg", "spider", "robin-nano-v3", "six-axes"],
        run: boards::more,
    },
    Check {
        name: "records",
        what: "builds without pins run with the records of nine boards: pins safe within 50 us, 150 with 64 settings; then as `boards`",
        needs: &["record", "record-behind", "record-behind-48"],
        run: records::records,
    },
    Check {
        name: "record-machines",
        what: "the image for four motors runs with four records of an SKR 2, each as the build with these pins",
        needs: &["record-four", "skr-2", "dual-y", "core-xy"],
        run: records::machines,
    },
    Check {
        name: "no-record",
        what: "no record, or a wrong one: locked, one message, $I, ? and $$ answer, no pin is driven, nothing is stored",
        needs: &["record", "record-behind"],
        run: records::none,
    },
    Check {
        name: "record-lines",
        what: "a record over the serial line, power lost at every write: the old or the new one; wrong ones and a ninth are refused",
        needs: &["record", "record-behind"],
        run: records::lines,
    },
    Check {
        name: "record-interrupt",
        what: "builds without pins: a tick takes at most a tenth more than with pins compiled in, one that loads a segment 554 cycles, with four motors 722",
        needs: &["usual", "skr-2", "dual-y", "record", "record-behind", "record-four"],
        run: records::interrupt,
    },
    Check {
        name: "machines",
        what: "machines 000 to 004: steps as in the simulator; heaters go off with a broken sensor or a hung main loop",
        needs: &["machine-file-000", "machine-file-001", "machine-file-002", "machine-file-003", "machine-file-004"],
        run: machines::machines,
    },
    Check {
        name: "supplied-jobs",
        what: "machines 001 to 004 make each job of their READMEs",
        needs: &["machine-file-001", "machine-file-002", "machine-file-003", "machine-file-004"],
        run: supplied::supplied_jobs,
    },
    Check {
        name: "heaters",
        what: "heaters go off when their sender is silent for $722, and at 0x18: at rest, in M0, at the door",
        needs: &["machine-file-004"],
        run: unattended::heaters,
    },
    Check {
        name: "no-interrupt",
        what: "the step interrupt does not come: an alarm that says so within 130 ms",
        needs: USUAL,
        run: unattended::no_step_interrupt,
    },
    Check {
        name: "endings",
        what: "panic, faults, full stack, crystal, supply: safe within 10 us, then a reset, and the next boot says why",
        needs: USUAL,
        run: endings::endings,
    },
    Check {
        name: "polarity",
        what: "every output, of either polarity, is off at power-up, reset, alarm, panic and watchdog",
        needs: &["machine-file-004", "inverted"],
        run: polarity::polarity,
    },
    Check {
        name: "another-chip",
        what: "a chip of another number: safe levels and the serial line, and nothing else is driven",
        needs: USUAL,
        run: start_up::another_chip,
    },
    Check {
        name: "resets",
        what: "reset pin, power and brown-out in full motion: safe at once",
        needs: USUAL,
        run: endings::resets,
    },
    Check {
        name: "watchdog",
        what: "main loop or step interrupt hung, LSI at 17 kHz: safe within 50 ms, and the next boot says why",
        needs: USUAL,
        run: watchdog::watchdog,
    },
    Check {
        name: "debugger",
        what: "a debugger halts the core in motion: safe within 50 ms, LSI at 17 kHz",
        needs: USUAL,
        run: watchdog::halted,
    },
    Check {
        name: "normal-work",
        what: "everything that keeps the main loop busy, LSI at 47 kHz: no reset",
        needs: FAST,
        run: watchdog::normal_work,
    },
    Check {
        name: "power-loss",
        what: "power lost at every operation of the flash for a record: the old or the new value",
        needs: FAST,
        run: power_loss::power_loss,
    },
    Check {
        name: "sector-change",
        what: "the same for the change to the other sector",
        needs: FAST,
        run: power_loss::sector_change,
    },
    Check {
        name: "flash-stall",
        what: "a record: at most 2 ms, and nothing that comes meanwhile is lost",
        needs: FAST,
        run: stall::flash_stall,
    },
    Check {
        name: "usb",
        what: "a host sets the device up; jobs to the step, both lines at once, 0x18 within 1 ms, the cable pulled; while one line is flooded, a job on the other runs on and ! acts within 5 ms",
        needs: &["usual", "fast"],
        run: usb::usb,
    },
    Check {
        name: "raster",
        what: "burns at least 8200 lines of 14 bytes a second",
        needs: FAST,
        run: raster::raster_lines,
    },
    Check {
        name: "stores",
        what: "each store of the step interrupt is left out in turn: found",
        needs: USUAL,
        run: stores::left_out,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_readme_lists_every_check() {
        let readme = include_str!("../../README.md");
        for check in CHECKS {
            assert!(
                readme.lines().any(|line| line == check.to_string()),
                "{check}"
            );
        }
    }
}
