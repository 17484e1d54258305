//! Switch inputs: an edge is noted at once, and its level is believed once it has lasted.
//!
//! ```text
//!            edge: position latched            level looked at: still there? then it counts
//!  input  ____|‾|_|‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾|‾‾‾‾‾‾‾‾‾
//!             |<----- the filter's time, $706 -->|
//! ```
//!
//! Each input is on a line of EXTI of its own. The line has the number of the input's pin, whatever
//! the port (RM0090 section 12.2.5). Further edges within the time change nothing, so that a switch
//! that bounces, or noise that goes on, is answered after exactly that time. A shorter spike is
//! forgotten. The line is masked during the time, so that noise causes no more than two interrupts
//! in each such time. TIM5, which counts microseconds, keeps the time.
#[cfg(record)]
mod recorded;
#[cfg(not(record))]
mod wired;

use crate::{
    chip::Bank,
    clock::{self, wake},
    fast_memory::placed,
    profile::MOTORS,
    pwm,
    registers::Word,
};
use core::sync::atomic::{AtomicU16, AtomicU32, Ordering::Relaxed};
use leadscrew_machine::{board::Switches, inputs::Inputs};
use leadscrew_stepper::{Power, Shared};
use stm32f4::stm32f407::{EXTI, SYSCFG};

#[cfg(record)]
use recorded as board;
#[cfg(not(record))]
use wired as board;

placed! { ".bss.ccm.levels";
    /// The levels that are believed, one bit a line. Written by the switch interrupts.
    static LEVELS: AtomicU16 = AtomicU16::new(0);
}
/// The time for which a level has to last, in microseconds. Written by the main loop at rest.
static TIME_US: AtomicU32 = AtomicU32::new(0);

/// Sets the filter's time, in microseconds. Main loop, at rest: at start-up before the machine
/// listens, and after a change of `$706`.
pub(crate) fn set_filter(microseconds: u32) {
    TIME_US.store(microseconds, Relaxed);
}

/// Waits until each edge that has come so far is believed or forgotten, 10 ms at most. Main loop,
/// at rest.
pub(crate) fn let_settle() {
    /// A generous estimate of the time that interrupts take besides.
    const INTERRUPTS_US: u32 = 20;
    let microseconds = TIME_US.load(Relaxed) + INTERRUPTS_US;
    cortex_m::asm::delay(microseconds * (clock::CPU_HZ / 1_000_000));
}

/// The state of the switch interrupts, of EXTI and of the timer. The tasks share it without a lock,
/// since RTIC refuses to build them unless all have one priority.
pub(crate) struct Filter {
    exti: EXTI,
    /// Lines whose level is being waited for.
    settling: u16,
    /// The time at which each of these lines is looked at, in counts of the clock, microseconds.
    due: [u32; 16],
    /// The instant for which the alarm is set.
    alarm: u32,
    /// The motors' places at the edge of the probe.
    at_probe: [i32; MOTORS],
    power: pwm::Channel,
}

impl Filter {
    /// Makes inputs of the pins, takes their levels as they are, and listens from here on. Before
    /// the interrupts are on.
    pub(crate) fn new(exti: EXTI, syscfg: &SYSCFG) -> Self {
        board::prepare();
        let inputs = board::all();
        for input in inputs.iter().flatten() {
            input.pin.make_input(input.pull);
            select_port(syscfg, input.pin.number, input.pin.bank);
        }
        // The pulls have to charge the cables: 40 kΩ and a nanofarad or two are 0.1 ms.
        cortex_m::asm::delay(20_000);
        let mut levels = 0;
        for input in inputs.iter().flatten().filter(|input| input.level()) {
            levels |= input.line();
        }
        LEVELS.store(levels, Relaxed);
        // Bits 0 to 15 are the pins' lines in these registers; those above stay.
        let lines = u32::from(board::lines());
        exti.rtsr().change(|all| all | lines);
        exti.ftsr().change(|all| all | lines);
        exti.pr().put(lines);
        exti.imr().change(|all| all | lines);
        Self {
            exti,
            settling: 0,
            due: [0; 16],
            alarm: 0,
            at_probe: [0; MOTORS],
            power: pwm::Channel::new(),
        }
    }

    /// Notes edges. Interrupts of EXTI.
    pub(crate) fn on_edge(&mut self, shared: &Shared<MOTORS>) {
        let pending = self.exti.pr().read().bits() & u32::from(board::lines());
        // A one clears a flag, zeros leave the others.
        self.exti.pr().put(pending);
        let fresh = pending as u16 & !self.settling;
        if fresh == 0 {
            return;
        }
        if fresh & board::probe_line() != 0 {
            self.at_probe = shared.position();
        }
        let due = clock::count().wrapping_add(TIME_US.load(Relaxed));
        for (line, when) in self.due.iter_mut().enumerate() {
            if fresh >> line & 1 == 1 {
                *when = due;
            }
        }
        if self.settling == 0 {
            self.set_alarm(due);
        }
        self.settling |= fresh;
        self.mask(fresh);
    }

    fn set_alarm(&mut self, due: u32) {
        self.alarm = due;
        clock::set_filter_alarm(due);
    }

    /// Looks at the lines whose time is over, and acts on the lines that have changed. It takes the
    /// alarm's instant for the present, since to ask the timer takes 20 cycles. Interrupt of TIM5.
    #[inline(always)]
    pub(crate) fn on_time(&mut self, inputs: &Inputs<MOTORS>, shared: &Shared<MOTORS>) {
        let (before, waiting) = (LEVELS.load(Relaxed), self.settling);
        let levels = self.settle(before);
        if levels != before {
            // First of all: a beam that stands still burns.
            if inputs.would_stop(&board::switches_at(levels)) {
                self.power.set(Power::OFF);
            }
            self.act(levels, inputs, shared);
        }
        self.listen_again(waiting & !self.settling, levels);
        if self.settling != 0 {
            self.set_next_alarm();
        }
    }

    /// The levels that are believed now that the time of some lines is over.
    #[inline(always)]
    fn settle(&mut self, before: u16) -> u16 {
        let mut levels = u32::from(before);
        for line in lines(self.settling) {
            // A line is below 16, and the compiler sees it.
            let due = self.due[line % 16];
            if self.alarm.wrapping_sub(due).cast_signed() >= 0 {
                let bit = 1 << line;
                self.settling &= !(bit as u16);
                let level = board::levels(line) ^ u32::from(board::inverted());
                levels = levels & !bit | level & bit;
            }
        }
        levels as u16
    }

    /// Masks some lines.
    fn mask(&self, lines: u16) {
        self.exti.imr().change(|all| all & !u32::from(lines));
    }

    /// Listens again to some lines. Their believed levels are in `levels`; a line that has another
    /// level by now counts as having an edge. Edges that came while the lines were masked are
    /// cleared before the levels are read, so that no change is lost.
    #[inline(never)]
    fn listen_again(&self, over: u16, levels: u16) {
        let over = u32::from(over);
        // A zero changes nothing in PR and SWIER.
        self.exti.pr().put(over);
        self.exti.imr().change(|all| all | over);
        let changed = over & (levels_of(over as u16) ^ u32::from(levels));
        self.exti.swier().put(changed);
    }

    /// Believes new levels.
    #[inline(never)]
    fn act(&self, levels: u16, inputs: &Inputs<MOTORS>, shared: &Shared<MOTORS>) {
        LEVELS.store(levels, Relaxed);
        inputs.on_switches_at(&board::switches_at(levels), shared, &self.at_probe);
        if shared.is_laser_off() {
            // A tick in between may have set the power anew; no later tick does.
            self.power.set(Power::OFF);
        }
        wake();
    }

    #[inline(never)]
    fn set_next_alarm(&mut self) {
        let alarm = self.alarm;
        let dues = lines(self.settling).filter_map(|line| self.due.get(line).copied());
        if let Some(next) = dues.min_by_key(|due| due.wrapping_sub(alarm)) {
            self.set_alarm(next);
        }
    }
}

/// The levels at the pins of some lines, one bit a line, as the machine is told them.
fn levels_of(set: u16) -> u32 {
    lines(set).fold(0, |all, line| {
        let level = board::levels(line) ^ u32::from(board::inverted());
        all | level & 1 << line
    })
}

/// The numbers of the lines in a set, from 0.
#[inline(always)]
fn lines(set: u16) -> impl Iterator<Item = usize> {
    let mut left = u32::from(set);
    core::iter::from_fn(move || {
        let line = (left != 0).then_some(left.trailing_zeros() as usize);
        left &= left.wrapping_sub(1);
        line
    })
}

/// The levels of all switches, as they are believed; one that the board does not have is open. Any
/// context.
pub(crate) fn switches() -> Switches {
    board::switches_at(LEVELS.load(Relaxed))
}

/// Selects the port whose pin a line listens to (RM0090 section 9.2.3): four bits a line, four
/// lines a register.
fn select_port(syscfg: &SYSCFG, line: u8, bank: Bank) {
    let shift = line % 4 * 4;
    let word = |before: u32| before & !(0xF << shift) | (bank as u32) << shift;
    match line / 4 {
        0 => syscfg.exticr1().change(word),
        1 => syscfg.exticr2().change(word),
        2 => syscfg.exticr3().change(word),
        _ => syscfg.exticr4().change(word),
    };
}
