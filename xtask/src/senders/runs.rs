//! The runs: the sender, its job, its machine, and the checks of the result.

use super::verdict::Check;

/// One run of one sender.
pub(super) struct Run {
    pub(super) sender: Sender,
    /// The machine: a profile in `tests/senders`.
    pub(super) machine: &'static str,
    /// The arguments that follow the line on the sender's command line. Names of jobs are files in
    /// `tests/senders/gcode`.
    pub(super) arguments: &'static [&'static str],
    /// The exit code that means success; it is 7 if the run ends in a stop.
    pub(super) code: i32,
    /// The checks of the result.
    pub(super) checks: &'static [Check],
}

/// A sender and the kind of line that it opens.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Sender {
    MeerK40tOverTcp,
    MeerK40tOverPty,
    GrblStreamer,
    /// Not a sender but a widespread WebSocket client.
    Websockets,
    Cncjs,
    Bcnc,
}

impl Sender {
    /// The name on the command line.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::MeerK40tOverTcp | Self::MeerK40tOverPty => "meerk40t",
            Self::GrblStreamer => "grbl-streamer",
            Self::Websockets => "websockets",
            Self::Cncjs => "cncjs",
            Self::Bcnc => "bcnc",
        }
    }

    /// The number of its line in the server's log.
    pub(super) fn line(self) -> &'static str {
        match self {
            Self::MeerK40tOverPty | Self::GrblStreamer | Self::Cncjs | Self::Bcnc => "0",
            Self::MeerK40tOverTcp => "1",
            Self::Websockets => "3",
        }
    }
}

const JOB: &[Check] = &[Check::AllOk, Check::Ran, Check::EndsWhereSent];
const HELD: &[Check] = &[
    Check::AllOk,
    Check::Ran,
    Check::HeldAndResumed,
    Check::EndsWhereSent,
];

const fn run(sender: Sender, arguments: &'static [&'static str], checks: &'static [Check]) -> Run {
    Run {
        sender,
        machine: "open.toml",
        arguments,
        code: 0,
        checks,
    }
}

/// All runs.
pub(super) const RUNS: [Run; 17] = [
    run(Sender::MeerK40tOverTcp, &[], JOB),
    run(Sender::MeerK40tOverTcp, &["--hold"], HELD),
    run(Sender::MeerK40tOverTcp, &["--gcode", "small.nc"], JOB),
    run(
        Sender::MeerK40tOverTcp,
        &["--gcode", "raster.nc", "--sync"],
        JOB,
    ),
    run(Sender::MeerK40tOverPty, &["--gcode", "raster.nc"], JOB),
    run(Sender::GrblStreamer, &["small.nc"], JOB),
    run(Sender::GrblStreamer, &["small.nc", "--incremental"], JOB),
    run(Sender::GrblStreamer, &["raster.nc"], JOB),
    run(
        Sender::GrblStreamer,
        &["raster.nc", "--hold-after", "40"],
        HELD,
    ),
    run(
        Sender::Websockets,
        &["raster.nc"],
        &[Check::Ran, Check::EndsWhereSent],
    ),
    run(
        Sender::Cncjs,
        &["small.nc", "--jog"],
        &[
            Check::AllOk,
            Check::JoggedTo(3.0),
            Check::Ran,
            Check::EndsWhereSent,
        ],
    ),
    run(Sender::Cncjs, &["raster.nc", "--hold-after", "40"], HELD),
    Run {
        machine: "homing.toml",
        ..run(
            Sender::Cncjs,
            &["small.nc", "--unlock"],
            &[
                Check::AllOk,
                Check::Unlocked,
                Check::Ran,
                Check::EndsWhereSent,
            ],
        )
    },
    Run {
        machine: "homing.toml",
        ..run(
            Sender::Cncjs,
            &["small.nc", "--home"],
            &[Check::AllOk, Check::Homed, Check::Ran, Check::EndsWhereSent],
        )
    },
    Run {
        machine: "bench.toml",
        ..run(
            Sender::Bcnc,
            &["change.nc", "--change"],
            &[
                Check::AllOk,
                Check::Ran,
                Check::ChangedTools(2),
                Check::EndsWhereSent,
            ],
        )
    },
    Run {
        machine: "bench.toml",
        ..run(
            Sender::Bcnc,
            &["flat.nc", "--level"],
            &[
                Check::AllOk,
                Check::Ran,
                Check::FollowsPlate,
                Check::EndsWhereSent,
            ],
        )
    },
    Run {
        code: 7,
        ..run(
            Sender::Cncjs,
            &["raster.nc", "--stop-after", "40"],
            &[Check::Ran, Check::StoppedInPlace],
        )
    },
];
