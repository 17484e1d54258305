//! The inputs of a board whose pins are compiled in.
use crate::{
    chip::Bank,
    fast_memory::placed,
    gpio::Input,
    profile::{MOTORS, PROFILE},
};
use leadscrew_machine::board::Switches;
use leadscrew_stepper::MotorMask;

/// All inputs that are not limit switches.
const BUTTONS: [Option<Input>; 5] = [
    PROFILE.probe,
    PROFILE.reset,
    PROFILE.hold,
    PROFILE.start,
    PROFILE.door,
];
const INPUTS: usize = MOTORS + BUTTONS.len();
/// All inputs, limit switches first.
const ALL: [Option<Input>; INPUTS] = {
    let (mut all, mut place) = ([None; INPUTS], 0);
    while place < INPUTS {
        all[place] = if place < MOTORS {
            PROFILE.limits[place]
        } else {
            BUTTONS[place - MOTORS]
        };
        place += 1;
    }
    all
};
placed! { ".fast_code.banks";
    /// The port of the input on each line of EXTI. A pin has the number of its line.
    static BANKS: [Bank; 16] = WIRED.0;
}
/// Lines of EXTI in use, one bit a line.
const LINES: u16 = WIRED.1;
/// Lines whose input is inverted, one bit a line.
const INVERTED: u16 = WIRED.2;
const WIRED: ([Bank; 16], u16, u16) = {
    let (mut banks, mut lines, mut inverted, mut place) = ([Bank::A; 16], 0, 0, 0);
    while place < INPUTS {
        if let Some(input) = ALL[place] {
            assert!(lines & input.line() == 0, "two inputs on one line of EXTI");
            lines |= input.line();
            banks[input.pin.number as usize] = input.pin.bank;
            if input.inverted {
                inverted |= input.line();
            }
        }
        place += 1;
    }
    (banks, lines, inverted)
};

/// Does nothing: the compiler has made the tables. Start-up.
#[inline(always)]
pub(super) fn prepare() {}

/// All inputs.
pub(super) fn all() -> [Option<Input>; INPUTS] {
    ALL
}

/// Lines of EXTI in use, one bit a line.
#[inline(always)]
pub(super) fn lines() -> u16 {
    LINES
}

/// Lines whose input is inverted, one bit a line.
#[inline(always)]
pub(super) fn inverted() -> u16 {
    INVERTED
}

/// The line of the probe, as a bit; 0 if there is no probe.
#[inline(always)]
pub(super) fn probe_line() -> u16 {
    PROFILE.probe.map_or(0, Input::line)
}

/// The levels at the port of the input on a line.
#[inline(always)]
pub(super) fn levels(line: usize) -> u32 {
    BANKS[line % 16].levels()
}

/// All switches, with these levels; one that the board does not have is open.
#[inline(always)]
pub(super) fn switches_at(levels: u16) -> Switches {
    let level = |input: Option<Input>| input.is_none_or(|input| levels & input.line() != 0);
    let limits = (0u8..).zip(PROFILE.limits).map(|(motor, input)| {
        let open = u8::from(level(input));
        open << motor
    });
    Switches {
        limits: MotorMask::from_bits(limits.fold(0, |all, one| all | one)),
        probe: level(PROFILE.probe),
        reset: level(PROFILE.reset),
        hold: level(PROFILE.hold),
        start: level(PROFILE.start),
        door: level(PROFILE.door),
    }
}
