//! The interrupt controller (DDI 0403, B3.4; priorities B1.5.4; RM0090 section 12.1 and its table
//! 62 for the numbers).
//!
//! Not modelled: NMIPENDSET of ICSR other than through the clock security system; SEVONPEND.
use crate::cpu::Masks;

/// The number of exceptions: 16 of the core, and 82 interrupts of the chip.
pub(crate) const EXCEPTIONS: u8 = 16 + 82;
/// STM32F4 implements the upper four bits of a priority.
const PRIORITY_BITS: u8 = 0xF0;
/// The priority when no exception is under way.
const THREAD: i32 = 256;

/// An exception or interrupt, by its number in the vector table.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct Exception(pub(crate) u8);

impl Exception {
    /// The NMI, which the clock security system uses (RM0090 section 7.2.7).
    pub const NMI: Exception = Exception(2);
    /// HardFault: all faults without a handler of their own.
    pub const HARD_FAULT: Exception = Exception(3);
    /// MemManage: an instruction was fetched from a region that is never executable.
    pub const MEMORY_FAULT: Exception = Exception(4);
    /// BusFault: an access to an address at which nothing answers.
    pub const BUS_FAULT: Exception = Exception(5);
    /// UsageFault: undefined instructions and similar faults.
    pub const USAGE_FAULT: Exception = Exception(6);
    /// SVCall: the instruction SVC.
    pub const SUPERVISOR_CALL: Exception = Exception(11);
    /// PendSV: a program asked for it.
    pub const PEND_SV: Exception = Exception(14);
    /// The system timer.
    pub const SYSTICK: Exception = Exception(15);

    /// Returns an interrupt of a peripheral, by its position in RM0090 table 62: 28 is TIM2.
    ///
    /// # Panics
    /// When there is no such interrupt: the last one is 81.
    pub const fn irq(position: u8) -> Exception {
        assert!(position < EXCEPTIONS - 16);
        Exception(16 + position)
    }

    /// Returns the number in the vector table.
    pub fn number(self) -> u8 {
        self.0
    }

    fn mask(self) -> u128 {
        1 << self.0
    }
}

/// The state of all exceptions in the controller.
#[derive(Clone, Debug)]
pub(crate) struct Nvic {
    priority: [u8; EXCEPTIONS as usize],
    enabled: u128,
    pending: u128,
    active: u128,
    /// The interrupt lines that peripherals hold active.
    lines: u128,
    /// The split of priorities into group and subpriority, AIRCR.PRIGROUP.
    pub(crate) group: u8,
    /// True if the next exception may have changed.
    pub(crate) changed: bool,
}

impl Nvic {
    /// The state after a reset: the exceptions that cannot be disabled are enabled.
    pub(crate) fn new() -> Self {
        Nvic {
            priority: [0; EXCEPTIONS as usize],
            enabled: 0xFFFF & !(7 << 4),
            pending: 0,
            active: 0,
            lines: 0,
            group: 0,
            changed: true,
        }
    }

    /// Sets the interrupt line of a peripheral. A rising edge makes the interrupt pending.
    pub(crate) fn set_line(&mut self, exception: Exception, up: bool) {
        let mask = exception.mask();
        if !up {
            self.lines &= !mask;
        } else if self.lines & mask == 0 {
            self.lines |= mask;
            self.pend(exception);
        }
    }

    /// Makes an exception pending.
    pub(crate) fn pend(&mut self, exception: Exception) {
        self.pending |= exception.mask();
        self.changed = true;
    }

    /// Clears the pending state of an exception.
    pub(crate) fn unpend(&mut self, exception: Exception) {
        self.pending &= !exception.mask();
    }

    /// Returns true if an exception is pending.
    pub(crate) fn is_pending(&self, exception: Exception) -> bool {
        self.pending & exception.mask() != 0
    }

    /// Returns true if an exception is enabled.
    pub(crate) fn is_enabled(&self, exception: Exception) -> bool {
        self.enabled & exception.mask() != 0
    }

    /// Enables or disables an exception.
    pub(crate) fn enable(&mut self, exception: Exception, enabled: bool) {
        if enabled {
            self.enabled |= exception.mask();
        } else {
            self.enabled &= !exception.mask();
        }
        self.changed = true;
    }

    /// Notes that the handler begins.
    pub(crate) fn activate(&mut self, exception: Exception) {
        self.pending &= !exception.mask();
        self.active |= exception.mask();
    }

    /// Notes that the handler has returned. A line that is still active makes its interrupt pending
    /// again.
    pub(crate) fn deactivate(&mut self, exception: Exception) {
        let mask = exception.mask();
        self.active &= !mask;
        self.pending |= self.lines & mask;
        self.changed = true;
    }

    /// The number of active exceptions.
    pub(crate) fn active_count(&self) -> u32 {
        self.active.count_ones()
    }

    /// The group priority, which decides about preemption: lower is more urgent.
    pub(crate) fn group_priority(&self, exception: Exception) -> i32 {
        match exception.0 {
            number @ 0..=3 => i32::from(number) - 4,
            number => self.group_of(self.priority[usize::from(number)]),
        }
    }

    fn group_of(&self, priority: u8) -> i32 {
        i32::from(u16::from(priority) >> (self.group + 1))
    }

    /// The priority at which the core runs (B1.5.4, ExecutionPriority).
    pub(crate) fn execution_priority(&self, masks: Masks) -> i32 {
        let mut priority = members(self.active)
            .map(|exception| self.group_priority(exception))
            .min()
            .unwrap_or(THREAD);
        if masks.basepri != 0 {
            priority = priority.min(self.group_of(masks.basepri));
        }
        if masks.primask {
            priority = priority.min(0);
        }
        if masks.faultmask {
            priority = priority.min(-1);
        }
        priority
    }

    /// The pending exception that may interrupt the core now.
    pub(crate) fn next(&self, masks: Masks) -> Option<Exception> {
        let current = self.execution_priority(masks);
        let ready = self.pending & self.enabled;
        if ready == 0 {
            return None;
        }
        members(ready)
            .map(|exception| {
                (
                    self.group_priority(exception),
                    self.priority_of(exception),
                    exception,
                )
            })
            .min()
            .filter(|&(priority, ..)| priority < current)
            .map(|(.., exception)| exception)
    }

    fn priority_of(&self, exception: Exception) -> u8 {
        self.priority[usize::from(exception.0)]
    }

    /// Reads a byte of the priority registers, by exception number.
    pub(crate) fn priority(&self, number: u32) -> u8 {
        self.priority.get(number as usize).copied().unwrap_or(0)
    }

    /// Writes a byte of the priority registers, by exception number.
    pub(crate) fn set_priority(&mut self, number: u32, value: u8) {
        if let Some(priority) = self.priority.get_mut(number as usize) {
            *priority = value & PRIORITY_BITS;
        }
        self.changed = true;
    }

    /// Reads a register of the controller at `offset` from 0xE000E000 (B3.4.3): enable, pending,
    /// active or priority bits.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x100..=0x11F | 0x180..=0x19F => word(self.enabled, offset),
            0x200..=0x21F | 0x280..=0x29F => word(self.pending, offset),
            0x300..=0x31F => word(self.active, offset),
            0x400..=0x4EF => {
                let first = 16 + offset - 0x400;
                (0..4).fold(0, |all, k| {
                    all | u32::from(self.priority(first + k)) << (8 * k)
                })
            }
            _ => 0,
        }
    }

    /// Writes a register of the controller. Priorities are written byte by byte with
    /// [`Nvic::set_priority`].
    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        let mask = mask_of(value, offset);
        match offset {
            0x100..=0x11F => self.enabled |= mask,
            0x180..=0x19F => self.enabled &= !mask,
            0x200..=0x21F => self.pending |= mask,
            0x280..=0x29F => self.pending = self.pending & !mask | self.lines & self.pending & mask,
            0xF00 => self.pending |= 1u128.checked_shl(16 + (value & 0x1FF)).unwrap_or(0) & ALL,
            _ => {}
        }
        self.changed = true;
    }
}

/// The set of all exceptions.
const ALL: u128 = (1 << EXCEPTIONS) - 1;

/// The exceptions of a set, by number.
fn members(mut set: u128) -> impl Iterator<Item = Exception> {
    core::iter::from_fn(move || {
        let number = set.trailing_zeros();
        set &= set.wrapping_sub(1);
        (number < 128).then_some(Exception(number as u8))
    })
}

/// The number of the first exception in a register: bits 2 to 4 of its address select 32
/// interrupts.
fn shift(offset: u32) -> u32 {
    16 + (offset >> 2 & 7) * 32
}

fn word(set: u128, offset: u32) -> u32 {
    set.checked_shr(shift(offset)).unwrap_or(0) as u32
}

fn mask_of(value: u32, offset: u32) -> u128 {
    let mask = u128::from(value).checked_shl(shift(offset)).unwrap_or(0);
    mask & ALL
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIM2: Exception = Exception::irq(28);
    const USART2: Exception = Exception::irq(38);

    fn both_enabled() -> Nvic {
        let mut nvic = Nvic::new();
        nvic.enable(TIM2, true);
        nvic.enable(USART2, true);
        nvic
    }

    #[test]
    fn of_two_pending_interrupts_the_more_urgent_comes_first_then_the_lower_number() {
        let mut nvic = both_enabled();
        nvic.pend(TIM2);
        nvic.pend(USART2);
        assert_eq!(nvic.next(Masks::default()), Some(TIM2));
        nvic.set_priority(u32::from(TIM2.number()), 0x40);
        assert_eq!(nvic.next(Masks::default()), Some(USART2));
    }

    #[test]
    fn a_handler_is_only_interrupted_by_a_more_urgent_group() {
        let mut nvic = both_enabled();
        nvic.set_priority(u32::from(TIM2.number()), 0x40);
        nvic.set_priority(u32::from(USART2.number()), 0x50);
        nvic.activate(USART2);
        nvic.pend(TIM2);
        assert_eq!(nvic.next(Masks::default()), Some(TIM2));
        nvic.group = 5; // two bits of group: 0x40 and 0x50 are in the same one
        assert_eq!(nvic.next(Masks::default()), None);
    }

    #[test]
    fn basepri_masks_its_own_level_and_below_and_primask_all_but_faults() {
        let mut nvic = both_enabled();
        nvic.set_priority(u32::from(TIM2.number()), 0x40);
        nvic.pend(TIM2);
        let basepri = |basepri| Masks {
            basepri,
            ..Masks::default()
        };
        assert_eq!(nvic.next(basepri(0x40)), None);
        assert_eq!(nvic.next(basepri(0x50)), Some(TIM2));
        let primask = Masks {
            primask: true,
            ..Masks::default()
        };
        assert_eq!(nvic.next(primask), None);
        nvic.pend(Exception::HARD_FAULT);
        assert_eq!(nvic.next(primask), Some(Exception::HARD_FAULT));
    }

    #[test]
    fn a_line_still_up_at_the_return_interrupts_again() {
        let mut nvic = both_enabled();
        nvic.set_line(TIM2, true);
        nvic.activate(TIM2);
        nvic.set_line(TIM2, true);
        assert!(!nvic.is_pending(TIM2), "a level is no new edge");
        nvic.deactivate(TIM2);
        assert!(nvic.is_pending(TIM2));
    }

    #[test]
    fn registers_have_a_bit_for_each_interrupt() {
        let mut nvic = Nvic::new();
        nvic.write(0x104, 1 << 6); // ISER1: interrupt 38
        assert!(nvic.is_enabled(USART2));
        assert_eq!(nvic.read(0x184), 1 << 6);
        nvic.write(0xF00, 28); // STIR
        assert_eq!(nvic.read(0x200), 1 << 28);
        nvic.write(0x280, 1 << 28);
        assert_eq!(nvic.read(0x200), 0);
    }

    #[test]
    fn only_the_upper_four_bits_of_a_priority_exist() {
        let mut nvic = Nvic::new();
        nvic.set_priority(16, 0xFF);
        assert_eq!(nvic.read(0x400), 0xF0);
    }
}
