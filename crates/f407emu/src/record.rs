//! The record of a run: edges of pins, changes of PWM, statistics of exceptions.
use crate::peripheral::nvic::{Exception, EXCEPTIONS};
use core::fmt;

/// A pin.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct Pin {
    /// 0 for port A.
    pub(crate) port: u8,
    pub(crate) number: u8,
}

impl Pin {
    /// Returns a pin by its port's letter, `'A'` to `'I'`, and its number, 0 to 15.
    ///
    /// # Panics
    /// When there is no such pin.
    pub const fn new(port: char, number: u8) -> Pin {
        let index = (port as u32).wrapping_sub('A' as u32);
        assert!(index < 9 && number < 16, "no such pin");
        Pin {
            port: index as u8,
            number,
        }
    }
}

impl fmt::Display for Pin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "P{}{}", char::from(b'A' + self.port), self.number)
    }
}

/// The cause of a pin's change.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Cause {
    /// The core, with the instruction at this address.
    Core(u32),
    /// A stream of a DMA controller (1 or 2).
    Dma {
        /// The number of the controller, 1 or 2.
        controller: u8,
        /// The number of the stream, 0 to 7.
        stream: u8,
    },
    /// A timer's output, by the timer's number.
    Timer(u8),
    /// The world outside.
    Input,
    /// A reset.
    Reset,
}

/// A pin's change.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Edge {
    /// Cycle of HCLK since power-on.
    pub cycle: u64,
    /// The pin.
    pub pin: Pin,
    /// Its new level.
    pub level: bool,
    /// The cause.
    pub cause: Cause,
}

/// A timer's count has met a compare register: the instant that a program has set.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Match {
    /// Cycle of HCLK since power-on.
    pub cycle: u64,
    /// The timer's number, from 1.
    pub timer: u8,
    /// The channel's number, from 1.
    pub channel: u8,
    /// True if the program has forced it (TIMx_EGR.CCxG), rather than the count.
    pub forced: bool,
}

/// An operation of the flash: a unit that is programmed, or a sector that is erased.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FlashOperation {
    /// Cycle of HCLK since power-on at which it begins.
    pub begin: u64,
    /// The cycle at which it ends.
    pub end: u64,
    /// The address of its first byte.
    pub address: u32,
    /// True if a sector is erased, rather than a unit programmed.
    pub erases: bool,
}

/// The change of a word on its way to a register; `None` if the word is dropped.
pub type Tamper = fn(u32) -> Option<u32>;

/// A change of the share of time during which a timer drives a pin high.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Duty {
    /// Cycle of HCLK since power-on.
    pub cycle: u64,
    /// The pin.
    pub pin: Pin,
    /// The HCLK cycles of a period for which the pin is high.
    pub high: u64,
    /// The HCLK cycles of a period; 0 while the timer is stopped.
    pub period: u64,
}

/// Statistics of one exception. A service lasts from entry to the end of the return, without the
/// exceptions nested in it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Profile {
    /// The number of times that it was served.
    pub count: u64,
    /// The fewest cycles of a service.
    pub min: u64,
    /// The most cycles of a service.
    pub max: u64,
    /// The cycles of all services.
    pub total: u64,
    /// The instructions of all services.
    pub instructions: u64,
    /// The most instructions of a service.
    pub max_instructions: u64,
    /// The most cycles of a service, with the exceptions nested in it.
    pub max_with_nested: u64,
}

impl Profile {
    fn add(&mut self, cycles: u64, instructions: u64, with_nested: u64) {
        self.min = if self.count == 0 {
            cycles
        } else {
            self.min.min(cycles)
        };
        self.count += 1;
        self.max = self.max.max(cycles);
        self.total += cycles;
        self.instructions += instructions;
        self.max_instructions = self.max_instructions.max(instructions);
        self.max_with_nested = self.max_with_nested.max(with_nested);
    }
}

/// One service of an exception.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Service {
    /// The exception.
    pub exception: Exception,
    /// Cycle at which its entry began.
    pub entry: u64,
    /// Cycle at which its return ended.
    pub exit: u64,
}

/// The handlers under way, and the measurements of finished ones.
#[derive(Clone, Debug)]
pub(crate) struct Profiler {
    profiles: Vec<Profile>,
    running: Vec<Running>,
    /// Cycles and instructions of all finished handlers since power-on.
    pub(crate) cycles: u64,
    pub(crate) instructions: u64,
    /// Every service, if services are recorded.
    pub(crate) services: Option<Vec<Service>>,
}

#[derive(Clone, Debug)]
struct Running {
    exception: Exception,
    entry: u64,
    instructions: u64,
    nested_cycles: u64,
    nested_instructions: u64,
}

impl Profiler {
    pub(crate) fn new() -> Self {
        Profiler {
            profiles: vec![Profile::default(); usize::from(EXCEPTIONS)],
            running: Vec::new(),
            cycles: 0,
            instructions: 0,
            services: None,
        }
    }

    /// The statistics of an exception.
    pub(crate) fn profile(&self, exception: Exception) -> &Profile {
        &self.profiles[usize::from(exception.number())]
    }

    /// Forgets the measurements; handlers under way are still measured.
    pub(crate) fn clear(&mut self) {
        self.profiles.fill(Profile::default());
    }

    /// A reset: no handler is under way any more.
    pub(crate) fn abandon(&mut self) {
        self.running.clear();
    }

    /// A handler begins.
    pub(crate) fn enter(&mut self, exception: Exception, entry: u64, instructions: u64) {
        self.running.push(Running {
            exception,
            entry,
            instructions,
            nested_cycles: 0,
            nested_instructions: 0,
        });
    }

    /// The handler that began last ends.
    pub(crate) fn leave(&mut self, exit: u64, instructions: u64) {
        let Some(running) = self.running.pop() else {
            return;
        };
        let cycles = exit - running.entry;
        let instructions = instructions - running.instructions;
        self.cycles += cycles - running.nested_cycles;
        self.instructions += instructions - running.nested_instructions;
        if let Some(outer) = self.running.last_mut() {
            outer.nested_cycles += cycles;
            outer.nested_instructions += instructions;
        }
        self.profiles[usize::from(running.exception.number())].add(
            cycles - running.nested_cycles,
            instructions - running.nested_instructions,
            cycles,
        );
        if let Some(services) = &mut self.services {
            services.push(Service {
                exception: running.exception,
                entry: running.entry,
                exit,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nested_handler_is_not_charged_to_the_one_it_interrupts() {
        let mut profiler = Profiler::new();
        profiler.enter(Exception::irq(38), 100, 10);
        profiler.enter(Exception::irq(28), 120, 15);
        profiler.leave(220, 40);
        profiler.leave(250, 50);
        let outer = profiler.profile(Exception::irq(38));
        assert_eq!((outer.max, outer.instructions), (50, 15));
        assert_eq!(outer.max_with_nested, 150);
        assert_eq!(profiler.profile(Exception::irq(28)).min, 100);
        assert_eq!((profiler.cycles, profiler.instructions), (150, 40));
    }

    #[test]
    fn pins_are_written_as_in_the_data_sheet() {
        assert_eq!(Pin::new('E', 10).to_string(), "PE10");
    }
}
