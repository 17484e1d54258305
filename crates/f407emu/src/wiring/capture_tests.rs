//! Edges that a wire brings to a timer's input (RM0090 section 18.3.5), and DMA transfers of the
//! captures.
use super::tests::{machine, GPIOD, LASER, TIM4};
use crate::{machine::Machine, peripheral::nvic::Exception, record::Pin, warning::Warning};

const GPIOB: u32 = 0x4002_0400;
const TIM2: u32 = 0x4000_0000;
/// TIM2_CH3 on PB10. Stream 1 of DMA1 serves its requests on channel 3.
const INPUT: Pin = Pin::new('B', 10);
const DMA1_S1: u32 = 0x4002_6000 + 0x10 + 0x18;
const RING: u32 = 0x2000_0100;
const CC3: u32 = 1 << 3;

/// TIM4 makes pulses on PD12 that are high for 250 of 1000 counts. A wire brings them to channel 3
/// of TIM2, whose bits in CCER are `edges`.
fn wired(edges: u32, delay: u64, others: &[(u32, u32)]) -> Box<Machine> {
    let mut machine = machine(&[
        (GPIOB, 2 << 20 | 0x280),
        (GPIOB + 0x24, 1 << 8),
        (TIM2 + 0x1C, 1),
        (TIM2 + 0x20, edges << 8),
        (TIM2, 1),
        (GPIOD, 2 << 24),
        (GPIOD + 0x24, 2 << 16),
        (TIM4 + 0x2C, 999),
        (TIM4 + 0x34, 250),
        (TIM4 + 0x18, 6 << 4),
        (TIM4 + 0x20, 1),
    ]);
    machine.connect(LASER, INPUT, delay);
    for &(address, value) in others {
        machine.write_word(address, value).unwrap();
    }
    machine.write_word(TIM4 + 0x14, 1).unwrap();
    machine.write_word(TIM4, 1).unwrap();
    machine
}

/// A ring of four words that DMA fills with captures.
const DMA: &[(u32, u32)] = &[
    (DMA1_S1 + 0x04, 4),
    (DMA1_S1 + 0x08, TIM2 + 0x3C),
    (DMA1_S1 + 0x0C, RING),
    (DMA1_S1, 3 << 25 | 2 << 13 | 2 << 11 | 1 << 10 | 1 << 8 | 1),
    (TIM2 + 0x0C, 1 << 11),
];

fn captured(machine: &mut Machine) -> [u32; 4] {
    core::array::from_fn(|place| machine.read_word(RING + 4 * place as u32).unwrap())
}

/// The count of TIM2 at a cycle.
fn count_at(machine: &mut Machine, cycle: u64) -> u32 {
    let now = machine.cycle();
    let count = machine.read_word(TIM2 + 0x24).unwrap();
    count.wrapping_sub((now - cycle) as u32)
}

#[test]
fn dma_keeps_the_count_of_both_edges_of_each_pulse() {
    let mut machine = wired(0b1011, 0, DMA);
    let begin = machine.cycle();
    machine.run_until(begin + 3_400).unwrap();
    let edges: Vec<(u64, bool)> = machine
        .edges_of(LASER)
        .map(|edge| (edge.cycle, edge.level))
        .collect();
    // The wire brought one edge when it was connected. The ring has come round: it holds the last
    // four, from its start.
    assert_eq!(edges.len(), 7, "{edges:?}");
    let expected: Vec<u32> = edges[3..]
        .iter()
        .map(|edge| count_at(&mut machine, edge.0))
        .collect();
    let found = captured(&mut machine);
    assert_eq!(found.map(|count| count - found[0]), {
        let first = expected[0];
        [0, 1, 2, 3].map(|place| expected[place] - first)
    });
    assert!(
        found[0].abs_diff(expected[0]) <= 1,
        "{found:?} {expected:?}"
    );
    assert_eq!(machine.warnings(), []);
    assert_eq!(machine.read_word(TIM2 + 0x10).unwrap() & 0x1E00, 0);
}

#[test]
fn polarity_selects_rising_or_falling_edges() {
    for (bits, period, after_edge) in [(0b0001, 1000, true), (0b0011, 1000, false)] {
        let mut machine = wired(bits, 0, DMA);
        machine.run_until(machine.cycle() + 4_100).unwrap();
        let found = captured(&mut machine);
        let edges = machine
            .edges_of(LASER)
            .filter(|edge| edge.level == after_edge);
        let last = edges.map(|edge| edge.cycle).last().unwrap();
        let newest = *found.iter().max().unwrap();
        assert!(newest.abs_diff(count_at(&mut machine, last)) <= 1);
        assert!(found
            .iter()
            .all(|count| newest.abs_diff(*count) % period == 0));
    }
}

#[test]
fn a_wire_with_a_fault_brings_its_edges_late() {
    let latest = |delay| {
        let mut machine = wired(0b0001, delay, DMA);
        machine.run_until(machine.cycle() + 1_500).unwrap();
        captured(&mut machine)[1]
    };
    assert_eq!(latest(77) - latest(0), 77);
}

#[test]
fn a_capture_that_nobody_has_read_is_replaced_and_the_loss_is_told() {
    const LOST: u32 = CC3 << 8;
    let mut machine = wired(0b0001, 0, &[(TIM2 + 0x0C, CC3)]);
    let mut after = |cycles: u64| {
        machine.run_until(machine.cycle() + cycles).unwrap();
        let flags = machine.read_word(TIM2 + 0x10).unwrap() & (CC3 | LOST);
        let pending = machine.nvic.is_pending(Exception::irq(28));
        let count = machine.read_word(TIM2 + 0x3C).unwrap();
        let left = machine.read_word(TIM2 + 0x10).unwrap() & (CC3 | LOST);
        (flags, pending, count, left)
    };
    after(100);
    let (flags, pending, first, left) = after(1_000);
    assert_eq!((flags, pending, left), (CC3, true, 0));
    let (flags, _, second, left) = after(3_000);
    assert_eq!((flags, second - first, left), (CC3 | LOST, 3_000, LOST));
    machine.write_word(TIM2 + 0x10, 0x1E5F & !LOST).unwrap();
    assert_eq!(machine.read_word(TIM2 + 0x10).unwrap() & LOST, 0);
}

#[test]
fn an_input_compares_nothing_drives_nothing_and_cannot_be_written() {
    let mut machine = wired(0, 0, &[(TIM2 + 0x3C, 5)]);
    machine.run_until(machine.cycle() + 600).unwrap();
    assert_eq!(machine.read_word(TIM2 + 0x10).unwrap() & CC3, 0);
    assert_eq!(machine.read_word(TIM2 + 0x3C), Ok(0));
    assert!(!machine.drives(INPUT));
}

#[test]
fn a_prescaler_or_a_filter_of_an_input_is_not_modelled_and_said_so() {
    let mut machine = wired(0, 0, &[]);
    assert_eq!(machine.warnings(), []);
    machine.write_word(TIM2 + 0x1C, 0x31).unwrap();
    assert_eq!(machine.warnings(), [Warning::TimerMode { base: TIM2 }]);
}
