//! Switch inputs: an edge is noted at once, and believed once its level has lasted.
//!
//! ```text
//!            edge: position latched            level looked at: still there? then it counts
//!  input  ____|‾|_|‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾|‾‾‾‾‾‾‾‾‾
//!             |<----- the filter's time, $706 -->|
//! ```
//!
//! Each input is on a line of EXTI of its own: its pin's number, whatever the port (RM0090 section 12.2.5). Further edges
//! within the time change nothing, so that a switch that bounces, or noise that goes on, is answered after exactly that
//! time; a shorter spike is forgotten. TIM5, which counts microseconds, keeps the time.
use crate::{
    clock,
    gpio::{Bank, Input},
    profile::{MOTORS, PROFILE},
    pwm,
    wake::wake,
};
use core::sync::atomic::{AtomicU16, AtomicU32, Ordering::Relaxed};
use leadscrew_machine::{board::Switches, inputs::Inputs};
use leadscrew_stepper::{MotorMask, Power, Shared};
use stm32f4::stm32f407::{EXTI, SYSCFG};

/// All that are not limit switches.
const BUTTONS: [Option<Input>; 5] = [
    PROFILE.probe,
    PROFILE.reset,
    PROFILE.hold,
    PROFILE.start,
    PROFILE.door,
];
/// Lines of EXTI in use, one bit a line.
const LINES: u16 = {
    let (mut lines, mut place) = (0, 0);
    while place < MOTORS + BUTTONS.len() {
        let input = if place < MOTORS {
            PROFILE.limits[place]
        } else {
            BUTTONS[place - MOTORS]
        };
        if let Some(input) = input {
            assert!(lines & input.line() == 0, "two inputs on one line of EXTI");
            lines |= input.line();
        }
        place += 1;
    }
    lines
};

/// The levels that are believed, one bit a line. Written by the switch interrupts.
static LEVELS: AtomicU16 = AtomicU16::new(0);
/// How long a level has to last, in microseconds. Written by the main loop at rest.
static TIME_US: AtomicU32 = AtomicU32::new(0);

/// Sets the filter's time. Main loop, at rest: at start-up before the machine listens, and after a change of `$706`.
pub(crate) fn set_filter(microseconds: u32) {
    TIME_US.store(microseconds, Relaxed);
}

fn all() -> impl Iterator<Item = Input> {
    PROFILE.limits.into_iter().chain(BUTTONS).flatten()
}

/// What the switch interrupts keep: those of EXTI and that of the timer, all of one priority.
#[allow(unreachable_pub)] // RTIC hands it out in a public type
pub struct Filter {
    exti: EXTI,
    /// Lines whose level is being waited for.
    settling: u16,
    /// When each of them is looked at, in counts of the clock.
    due: [u32; 16],
    /// Where the motors stood at the edge of the probe.
    at_probe: [i32; MOTORS],
}

impl Filter {
    /// Makes inputs of the pins, takes their levels as they are, and listens from here on.
    pub(crate) fn new(exti: EXTI, syscfg: &SYSCFG) -> Self {
        for input in all() {
            input.pin.make_input(input.pull);
            select_port(syscfg, input.pin.number, input.pin.bank);
        }
        // The pulls have to charge the cables: 40 kΩ and a nanofarad or two are 0.1 ms.
        cortex_m::asm::delay(20_000);
        let levels = all().filter(|input| input.level());
        LEVELS.store(levels.fold(0, |all, input| all | input.line()), Relaxed);
        // SAFETY: bits 0 to 15 are the pins' lines in these registers; those above stay.
        #[allow(unsafe_code)]
        unsafe {
            let lines = u32::from(LINES);
            exti.rtsr().modify(|r, w| w.bits(r.bits() | lines));
            exti.ftsr().modify(|r, w| w.bits(r.bits() | lines));
            exti.pr().write(|w| w.bits(lines));
            exti.imr().modify(|r, w| w.bits(r.bits() | lines));
        }
        Self {
            exti,
            settling: 0,
            due: [0; 16],
            at_probe: [0; MOTORS],
        }
    }

    /// Notes edges. Interrupts of EXTI.
    pub(crate) fn on_edge(&mut self, shared: &Shared<MOTORS>) {
        let pending = self.exti.pr().read().bits() & u32::from(LINES);
        // SAFETY: a one clears a flag, zeros leave the others.
        #[allow(unsafe_code)]
        self.exti.pr().write(|w| unsafe { w.bits(pending) });
        let fresh = pending as u16 & !self.settling;
        if fresh == 0 {
            return;
        }
        if PROFILE.probe.is_some_and(|probe| fresh & probe.line() != 0) {
            self.at_probe = shared.position();
        }
        let due = clock::count().wrapping_add(TIME_US.load(Relaxed));
        for (line, when) in self.due.iter_mut().enumerate() {
            if fresh >> line & 1 == 1 {
                *when = due;
            }
        }
        if self.settling == 0 {
            clock::set_filter_alarm(due);
        }
        self.settling |= fresh;
    }

    /// Looks at the lines whose time is over, and acts on those that have changed. Interrupt of TIM5.
    pub(crate) fn on_time(&mut self, inputs: &Inputs<MOTORS>, shared: &Shared<MOTORS>) {
        let before = LEVELS.load(Relaxed);
        let mut levels = before;
        let now = clock::count();
        let waiting = self.settling;
        for input in all().filter(|input| waiting & input.line() != 0) {
            let due = self.due.get(usize::from(input.pin.number)).copied();
            if due.is_none_or(|due| now.wrapping_sub(due).cast_signed() >= 0) {
                self.settling &= !input.line();
                levels = levels & !input.line() | if input.level() { input.line() } else { 0 };
            }
        }
        if levels != before {
            LEVELS.store(levels, Relaxed);
            inputs.on_switches_at(&switches(), shared, &self.at_probe);
            if shared.is_stopped() {
                // No later tick switches it on again.
                pwm::set(Power::OFF);
            }
            wake();
        }
        let waiting = all().filter(|input| self.settling & input.line() != 0);
        let dues = waiting.filter_map(|input| self.due.get(usize::from(input.pin.number)));
        if let Some(next) = dues.min_by_key(|due| due.wrapping_sub(now)) {
            clock::set_filter_alarm(*next);
        }
    }
}

/// The levels of all switches, as they are believed; one that the board does not have is open. Any context.
pub(crate) fn switches() -> Switches {
    let levels = LEVELS.load(Relaxed);
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

/// Which port's pin a line looks at (RM0090 section 9.2.3): four bits a line, four lines a register.
fn select_port(syscfg: &SYSCFG, line: u8, bank: Bank) {
    let shift = line % 4 * 4;
    let word = |before: u32| before & !(0xF << shift) | (bank as u32) << shift;
    // SAFETY: the port is one of those that the chip has.
    #[allow(unsafe_code)]
    match line / 4 {
        0 => syscfg
            .exticr1()
            .modify(|r, w| unsafe { w.bits(word(r.bits())) }),
        1 => syscfg
            .exticr2()
            .modify(|r, w| unsafe { w.bits(word(r.bits())) }),
        2 => syscfg
            .exticr3()
            .modify(|r, w| unsafe { w.bits(word(r.bits())) }),
        _ => syscfg
            .exticr4()
            .modify(|r, w| unsafe { w.bits(word(r.bits())) }),
    };
}
