//! EXTI, which makes interrupts of edges at pins (RM0090 section 12.2), and SYSCFG, which selects
//! the port whose pin a line follows (section 9.2).
//!
//! A line's flag rises with its edge, masked or not: section 12.3.6 names no mask.
//!
//! `crate::registers` has SYSCFG's memory remapping. Not modelled, and warned of: events (EMR), and
//! internal lines, except for 16, the voltage detector.
use super::nvic::Exception;

/// The lines that exist.
const LINES: u32 = 0x007F_FFFF;

/// The registers of EXTI and SYSCFG.
#[derive(Clone, Debug, Default)]
pub(crate) struct Exti {
    interrupt_mask: u32,
    event_mask: u32,
    rising: u32,
    falling: u32,
    pending: u32,
    /// Lines that the program has made pending through SWIER, until their flags are cleared.
    software: u32,
    syscfg: [u32; 9],
}

impl Exti {
    /// Notes that a pin has changed; `port` is 0 for A.
    pub(crate) fn pin_changed(&mut self, port: usize, pin: u8, level: bool) {
        let pin_number = usize::from(pin);
        let register = self.syscfg[2 + pin_number / 4];
        if (register >> (4 * (pin_number % 4)) & 15) as usize == port {
            self.line_changed(pin, level);
        }
    }

    /// Notes that a line has changed.
    pub(crate) fn line_changed(&mut self, line: u8, level: bool) {
        let selected = if level { self.rising } else { self.falling };
        self.pending |= selected & 1 << line;
    }

    /// The interrupts of the lines, and whether each is active (RM0090 table 62).
    pub(crate) fn interrupts(&self) -> [(Exception, bool); 8] {
        let up = self.pending & self.interrupt_mask;
        [
            (Exception::irq(6), 1),
            (Exception::irq(7), 1 << 1),
            (Exception::irq(8), 1 << 2),
            (Exception::irq(9), 1 << 3),
            (Exception::irq(10), 1 << 4),
            (Exception::irq(23), 0x1F << 5),
            (Exception::irq(40), 0x3F << 10),
            (Exception::irq(1), 1 << 16),
        ]
        .map(|(exception, lines)| (exception, up & lines != 0))
    }

    /// Returns true if the lines that are in use are modelled.
    pub(crate) fn is_modelled(&self) -> bool {
        const MODELLED: u32 = 0x1_FFFF;
        self.event_mask == 0 && self.interrupt_mask & !MODELLED == 0
    }

    /// Reads EXTI's register at `offset` from 0x40013C00.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x00 => self.interrupt_mask,
            0x04 => self.event_mask,
            0x08 => self.rising,
            0x0C => self.falling,
            0x10 => self.software,
            0x14 => self.pending,
            _ => 0,
        }
    }

    /// Writes EXTI's register at `offset` from 0x40013C00.
    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        match offset {
            0x00 => self.interrupt_mask = value & LINES,
            0x04 => self.event_mask = value & LINES,
            0x08 => self.rising = value & LINES,
            0x0C => self.falling = value & LINES,
            // SWIER: a bit that goes from 0 to 1 makes its line pending, if the line is enabled
            // (section 12.3.5).
            0x10 => {
                self.pending |= value & !self.software & self.interrupt_mask;
                self.software |= value;
            }
            0x14 => {
                self.pending &= !value;
                self.software &= !value;
            }
            _ => {}
        }
    }

    /// Reads SYSCFG's register at `offset` from 0x40013800.
    pub(crate) fn read_syscfg(&self, offset: u32) -> u32 {
        let cell = self.syscfg[8];
        if offset == 0x20 {
            // The compensation cell is ready as soon as it is switched on (section 9.2.7).
            return cell << 8 | cell;
        }
        self.syscfg.get(offset as usize / 4).copied().unwrap_or(0)
    }

    /// Resets SYSCFG's registers.
    pub(crate) fn reset_syscfg(&mut self) {
        self.syscfg = [0; 9];
    }

    /// Writes SYSCFG's register at `offset` from 0x40013800.
    pub(crate) fn write_syscfg(&mut self, offset: u32, value: u32) {
        if let Some(register) = self.syscfg.get_mut(offset as usize / 4) {
            *register = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn up(exti: &Exti) -> Vec<Exception> {
        let interrupts = exti.interrupts();
        let up = interrupts.iter().filter(|(_, up)| *up);
        up.map(|&(exception, _)| exception).collect()
    }

    #[test]
    fn a_line_looks_at_the_port_that_syscfg_says() {
        let mut exti = Exti::default();
        exti.write(0x00, 1 << 5);
        exti.write(0x08, 1 << 5);
        exti.write_syscfg(0x0C, 2 << 4); // EXTICR2: line 5 from port C
        exti.pin_changed(0, 5, true);
        assert_eq!(up(&exti), []);
        exti.pin_changed(2, 5, true);
        assert_eq!(up(&exti), [Exception::irq(23)]);
    }

    #[test]
    fn only_selected_edges_count_and_a_one_clears_them() {
        let mut exti = Exti::default();
        exti.write(0x00, 1);
        exti.write(0x0C, 1); // falling
        exti.pin_changed(0, 0, true);
        assert_eq!(exti.read(0x14), 0);
        exti.pin_changed(0, 0, false);
        assert_eq!(up(&exti), [Exception::irq(6)]);
        exti.write(0x14, 1);
        assert_eq!(up(&exti), []);
    }

    #[test]
    fn an_edge_is_remembered_while_its_interrupt_is_masked() {
        let mut exti = Exti::default();
        exti.write(0x08, 1 << 16);
        exti.line_changed(16, true);
        assert_eq!(up(&exti), []);
        exti.write(0x00, 1 << 16);
        assert_eq!(up(&exti), [Exception::irq(1)]);
    }
}
