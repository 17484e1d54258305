//! The differences between the fourteen timers: addresses (RM0090 table 1), features (chapters 17
//! to 20), interrupts (table 62), DMA streams (tables 43 and 44) and pins (data sheet, table 9).
//! `crate::st_data` compares all of them except the widths with ST's data.
use super::timer_output::Output;

/// A DMA stream that serves a request.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Route {
    /// The index of the controller, 0 for DMA1.
    pub(crate) controller: u8,
    pub(crate) stream: u8,
    pub(crate) channel: u8,
}

/// A timer of the chip.
#[derive(Debug)]
pub(crate) struct Instance {
    pub(crate) base: u32,
    /// True if the counter has 32 bits.
    wide: bool,
    /// True if it has a main output enable and complementary outputs.
    pub(crate) advanced: bool,
    pub(crate) channels: u8,
    /// The positions of the update and the compare interrupt; most timers have one interrupt for
    /// both.
    pub(crate) update_irq: u8,
    pub(crate) compare_irq: u8,
    pub(crate) update_dma: &'static [Route],
    pub(crate) compare_dma: [&'static [Route]; 4],
}

impl Instance {
    /// The highest count.
    pub(crate) fn mask(&self) -> u32 {
        if self.wide {
            u32::MAX
        } else {
            0xFFFF
        }
    }

    /// Returns true if it is on APB2 rather than APB1.
    pub(crate) fn on_apb2(&self) -> bool {
        self.base >= 0x4001_0000
    }
}

const fn route(controller: u8, stream: u8, channel: u8) -> Route {
    Route {
        controller: controller - 1,
        stream,
        channel,
    }
}

/// A timer with neither 32 bits nor DMA.
const fn plain(base: u32, channels: u8, irq: u8) -> Instance {
    Instance {
        base,
        wide: false,
        advanced: false,
        channels,
        update_irq: irq,
        compare_irq: irq,
        update_dma: &[],
        compare_dma: [&[]; 4],
    }
}

/// The timers TIM1 to TIM14.
pub(crate) static INSTANCES: [Instance; 14] = [
    Instance {
        advanced: true,
        compare_irq: 27,
        update_dma: &[route(2, 5, 6)],
        compare_dma: [
            &[route(2, 1, 6), route(2, 3, 6), route(2, 6, 0)],
            &[route(2, 2, 6), route(2, 6, 0)],
            &[route(2, 6, 6), route(2, 6, 0)],
            &[route(2, 4, 6)],
        ],
        ..plain(0x4001_0000, 4, 25)
    },
    Instance {
        wide: true,
        update_dma: &[route(1, 1, 3), route(1, 7, 3)],
        compare_dma: [
            &[route(1, 5, 3)],
            &[route(1, 6, 3)],
            &[route(1, 1, 3)],
            &[route(1, 6, 3), route(1, 7, 3)],
        ],
        ..plain(0x4000_0000, 4, 28)
    },
    Instance {
        update_dma: &[route(1, 2, 5)],
        compare_dma: [
            &[route(1, 4, 5)],
            &[route(1, 5, 5)],
            &[route(1, 7, 5)],
            &[route(1, 2, 5)],
        ],
        ..plain(0x4000_0400, 4, 29)
    },
    Instance {
        update_dma: &[route(1, 6, 2)],
        compare_dma: [&[route(1, 0, 2)], &[route(1, 3, 2)], &[route(1, 7, 2)], &[]],
        ..plain(0x4000_0800, 4, 30)
    },
    Instance {
        wide: true,
        update_dma: &[route(1, 0, 6), route(1, 6, 6)],
        compare_dma: [
            &[route(1, 2, 6)],
            &[route(1, 4, 6)],
            &[route(1, 0, 6)],
            &[route(1, 1, 6), route(1, 3, 6)],
        ],
        ..plain(0x4000_0C00, 4, 50)
    },
    Instance {
        update_dma: &[route(1, 1, 7)],
        ..plain(0x4000_1000, 0, 54)
    },
    Instance {
        update_dma: &[route(1, 2, 1), route(1, 4, 1)],
        ..plain(0x4000_1400, 0, 55)
    },
    Instance {
        advanced: true,
        compare_irq: 46,
        update_dma: &[route(2, 1, 7)],
        compare_dma: [
            &[route(2, 2, 7), route(2, 2, 0)],
            &[route(2, 3, 7), route(2, 2, 0)],
            &[route(2, 4, 7), route(2, 2, 0)],
            &[route(2, 7, 7)],
        ],
        ..plain(0x4001_0400, 4, 44)
    },
    plain(0x4001_4000, 2, 24),
    plain(0x4001_4400, 1, 25),
    plain(0x4001_4800, 1, 26),
    plain(0x4000_1800, 2, 43),
    plain(0x4000_1C00, 1, 44),
    plain(0x4000_2000, 1, 45),
];

/// The timer output that an alternate function puts on a pin of port A to G: index into
/// [`INSTANCES`], and output.
pub(crate) fn output(port: usize, pin: u8, function: u8) -> Option<(usize, Output)> {
    let timer = |number: usize, channel: u8| {
        let output = Output {
            channel: channel - 1,
            complementary: false,
        };
        Some((number - 1, output))
    };
    let complement = |number: usize, channel: u8| {
        let output = Output {
            channel: channel - 1,
            complementary: true,
        };
        Some((number - 1, output))
    };
    match (function, port, pin) {
        (1, 0, 8..=11) => timer(1, pin - 7),
        (1, 4, 9) => timer(1, 1),
        (1, 4, 11) => timer(1, 2),
        (1, 4, 13 | 14) => timer(1, pin - 10),
        (1, 0, 7) | (1, 1, 13) | (1, 4, 8) => complement(1, 1),
        (1, 1, 0 | 14) | (1, 4, 10) => complement(1, 2),
        (1, 1, 1 | 15) | (1, 4, 12) => complement(1, 3),
        (1, 0, 0..=3) => timer(2, pin + 1),
        (1, 0, 5 | 15) => timer(2, 1),
        (1, 1, 3) => timer(2, 2),
        (1, 1, 10 | 11) => timer(2, pin - 7),
        (2, 0, 6 | 7) | (2, 2, 6 | 7) => timer(3, pin - 5),
        (2, 1, 4 | 5) => timer(3, pin - 3),
        (2, 1, 0 | 1) => timer(3, pin + 3),
        (2, 2, 8 | 9) => timer(3, pin - 5),
        (2, 1, 6..=9) => timer(4, pin - 5),
        (2, 3, 12..=15) => timer(4, pin - 11),
        (2, 0, 0..=3) => timer(5, pin + 1),
        (3, 2, 6..=9) => timer(8, pin - 5),
        (3, 0, 5 | 7) => complement(8, 1),
        (3, 1, 0 | 14) => complement(8, 2),
        (3, 1, 1 | 15) => complement(8, 3),
        (3, 0, 2 | 3) => timer(9, pin - 1),
        (3, 4, 5 | 6) => timer(9, pin - 4),
        (3, 1, 8) | (3, 5, 6) => timer(10, 1),
        (3, 1, 9) | (3, 5, 7) => timer(11, 1),
        (9, 1, 14 | 15) => timer(12, pin - 13),
        (9, 0, 6) | (9, 5, 8) => timer(13, 1),
        (9, 0, 7) | (9, 5, 9) => timer(14, 1),
        _ => None,
    }
}

/// The timer channel whose input an alternate function puts on a pin: index into [`INSTANCES`], and
/// channel, 0 for channel 1.
pub(crate) fn input(port: usize, pin: u8, function: u8) -> Option<(usize, usize)> {
    let (timer, same) = output(port, pin, function)?;
    (!same.complementary).then_some((timer, same.channel.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_discoverys_leds_are_the_channels_of_timer_4() {
        for pin in 12..16 {
            let (timer, output) = output(3, pin, 2).unwrap();
            assert_eq!((timer, output.channel), (3, pin - 12));
        }
    }

    #[test]
    fn outputs_are_channels_that_their_timer_has() {
        for (port, pin, function) in (0..7)
            .flat_map(|port| (0..16).flat_map(move |pin| (0..16).map(move |f| (port, pin, f))))
        {
            if let Some((timer, output)) = output(port, pin, function) {
                let instance = &INSTANCES[timer];
                assert!(output.channel < instance.channels);
                assert!(instance.advanced || !output.complementary);
            }
        }
    }

    #[test]
    fn timer_8_interrupts_apart_for_updates_and_matches() {
        assert_eq!(
            (INSTANCES[7].update_irq, INSTANCES[7].compare_irq),
            (44, 46)
        );
        assert!(INSTANCES[7].on_apb2() && !INSTANCES[1].on_apb2());
    }
}
