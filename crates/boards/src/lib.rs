#![forbid(unsafe_code)]
#![doc = include_str!("../README.md")]

mod board;
mod check;
mod chip;
mod fit;
mod flash;
mod motor;
mod pin;
mod record;
mod source;

pub use board::{
    Board, HeaterSocket, Inputs, Kinematics, Level, Output, Outputs, Power, Serial, Sockets,
    ToolSwitches, Wire,
};
pub use check::Finding;
pub use chip::Chip;
pub use fit::{Needs, Socket, Unfit};
pub use flash::Sector;
pub use leadscrew_record::MOTORS as RECORDED_MOTORS;
pub use motor::{Axis, Drive, Motor, MotorSocket};
pub use pin::{Closes, Input, Pin, UnknownPin};
pub use record::{Machine, NoRecord};

/// The boards that come with the firmware: the name that `cargo fw --board` takes, and the file's
/// text.
pub const BOARDS: [(&str, &str); 12] = [
    ("black-f407ve", include_str!("../boards/black-f407ve.toml")),
    ("discovery", include_str!("../boards/discovery.toml")),
    ("fly-407zg", include_str!("../boards/fly-407zg.toml")),
    ("fly-super8", include_str!("../boards/fly-super8.toml")),
    ("machine-001", include_str!("../boards/machine-001.toml")),
    ("machine-003", include_str!("../boards/machine-003.toml")),
    ("octopus", include_str!("../boards/octopus.toml")),
    (
        "robin-nano-v3",
        include_str!("../boards/robin-nano-v3.toml"),
    ),
    ("skr-2", include_str!("../boards/skr-2.toml")),
    (
        "skr-2-core-xy",
        include_str!("../boards/skr-2-core-xy.toml"),
    ),
    ("skr-2-dual-y", include_str!("../boards/skr-2-dual-y.toml")),
    ("spider", include_str!("../boards/spider.toml")),
];
