//! Tests of peripherals that work together.
use crate::{
    devices::{SerialLine, SerialPort},
    instruction::Width,
    machine::Machine,
    peripheral::{nvic::Exception, rcc::ResetCause},
    record::{Cause, Edge, Pin},
    warning::Warning,
};

const RCC: u32 = 0x4002_3800;
pub(super) const GPIOD: u32 = 0x4002_0C00;
pub(super) const TIM4: u32 = 0x4000_0800;
/// USART2 at PA2 and PA3, and the words that give these pins their function.
const LINE: SerialLine = SerialLine {
    port: SerialPort::Usart2,
    output: Pin::new('A', 2),
    input: Pin::new('A', 3),
};
const LINE_MODES: (u32, u32) = (0x4002_0000, 0xA800_0000 | 0b1010 << 4);
const LINE_FUNCTIONS: (u32, u32) = (0x4002_0020, 0x77 << 8);
pub(super) const LASER: Pin = Pin::new('D', 12);

/// A machine whose core sleeps in a `wfi; b .-2` at the start of SRAM, with these registers
/// written.
pub(super) fn machine(registers: &[(u32, u32)]) -> Box<Machine> {
    let mut machine = Machine::with_clocks();
    machine.plug_serial(LINE);
    machine.write_word(0x2000_0000, 0xE7FD_BF30).unwrap();
    machine.cpu.next = 0x2000_0000;
    for &(address, value) in registers {
        machine.write_word(address, value).unwrap();
    }
    machine.clear_records();
    machine
}

/// TIM4 channel 1 on PD12: 1000 counts, `high` of them high.
fn pwm(high: u32, preload: u32) -> Box<Machine> {
    machine(&[
        (GPIOD, 2 << 24),
        (GPIOD + 0x24, 2 << 16),
        (TIM4 + 0x2C, 999),
        (TIM4 + 0x34, high),
        (TIM4 + 0x18, 6 << 4 | preload << 3),
        (TIM4 + 0x20, 1),
        (TIM4 + 0x14, 1),
        (TIM4, 1),
    ])
}

fn edges(machine: &Machine) -> Vec<(u64, bool)> {
    let start = machine.edges()[0].cycle;
    let relative = |edge: &Edge| (edge.cycle - start, edge.level);
    machine.edges_of(LASER).map(relative).collect()
}

#[test]
fn a_timers_pwm_makes_edges_on_its_pin() {
    let mut machine = pwm(250, 0);
    machine.run_until(3_100).unwrap();
    let expected = [
        (0, false),
        (750, true),
        (1000, false),
        (1750, true),
        (2000, false),
    ];
    assert_eq!(edges(&machine)[..5], expected);
    assert_eq!(machine.edges()[1].cause, Cause::Timer(4));
}

#[test]
fn the_matches_of_a_watched_channel_are_recorded_with_their_origin() {
    let mut machine = machine(&[(TIM4 + 0x34, 100)]);
    machine.watch_channel(4, 1);
    machine.write_word(TIM4, 1).unwrap();
    let start = machine.cycle();
    machine.run_until(start + 150).unwrap();
    machine.write_word(TIM4 + 0x14, 1 << 1).unwrap();
    let matches = machine.matches().iter();
    let found: Vec<_> = matches
        .map(|found| (found.cycle - start, found.forced))
        .collect();
    assert_eq!(found, [(100, false), (machine.cycle() - start, true)]);
    assert_eq!(
        (machine.matches()[0].timer, machine.matches()[0].channel),
        (4, 1)
    );
}

#[test]
fn no_match_is_lost_while_a_store_to_the_timer_waits() {
    // The program stores to a register, which fills the store buffer, and then to SR, which waits.
    // The match comes before, during and after that wait.
    for compare in 1..60 {
        let mut machine = machine(&[(TIM4 + 0x34, compare), (TIM4, 1)]);
        machine.watch_channel(4, 1);
        machine.clear_records();
        let program = [0x6041_6001, 0xE7FD_BF30]; // str r1, [r0]; str r1, [r0, #4]; wfi; b .-2
        for (place, word) in (0x2000_0000..).step_by(4).zip(program) {
            machine.write_word(place, word).unwrap();
        }
        machine.cpu.r[0] = TIM4 + 0x0C; // DIER, then SR
        machine.cpu.r[1] = 0x1E5F & !(1 << 2);
        let start = machine.cycle();
        machine.run_until(start + 100).unwrap();
        let matched = machine.matches().len();
        assert_eq!(matched, 1, "compare {compare}");
        let flag = machine.read_word(TIM4 + 0x10).unwrap() & 1 << 1;
        assert_ne!(flag, 0, "compare {compare}");
    }
}

#[test]
fn a_match_that_is_due_when_the_clock_changes_is_not_passed_over() {
    const CFGR: u32 = RCC + 8;
    let mut machine = machine(&[(TIM4 + 0x34, 100), (TIM4, 1)]);
    machine.watch_channel(4, 1);
    let start = machine.cycle();
    // The store comes in the cycle of the match, before the event has been handled.
    machine.cycle = start + 101;
    machine.write_word(CFGR, 4 << 10).unwrap(); // APB1 at half of HCLK: the timers go on as fast
    assert_eq!(machine.matches().len(), 1);
    assert_eq!(machine.read_word(TIM4 + 0x10).unwrap() & 2, 2);
}

#[test]
fn clocks_that_the_prescaler_has_counted_stay_counted_when_the_clock_changes() {
    const CFGR: u32 = RCC + 8;
    let mut machine = machine(&[(TIM4 + 0x28, 9), (TIM4 + 0x14, 1), (TIM4, 1)]);
    let start = machine.devices.timers[3].read(0x24, machine.cycle());
    let began = machine.cycle();
    machine.cycle += 38;
    machine.write_word(CFGR, 5 << 10).unwrap(); // APB1 at a quarter, its timers at a half
    let count = |machine: &Machine, after: u64| machine.devices.timers[3].read(0x24, began + after);
    assert_eq!(start, 0);
    assert_eq!(count(&machine, 38), 3);
    assert_eq!(count(&machine, 38 + 2 * 3), 4);
}

#[test]
fn a_planted_fault_changes_or_loses_what_the_program_writes() {
    let mut machine = machine(&[]);
    machine.tamper_with(TIM4 + 0x34, |value| Some(value + 1));
    machine.write_word(TIM4 + 0x34, 100).unwrap();
    assert_eq!(machine.read_word(TIM4 + 0x34), Ok(101));
    machine.tamper_with(TIM4 + 0x34, |_| None);
    machine.write_word(TIM4 + 0x34, 7).unwrap();
    assert_eq!(machine.read_word(TIM4 + 0x34), Ok(101));
}

#[test]
fn a_clone_goes_on_by_itself() {
    let mut one = machine(&[(TIM4 + 0x34, 100), (TIM4, 1)]);
    one.watch_channel(4, 1);
    let mut other = one.clone();
    one.run_until(one.cycle() + 150).unwrap();
    assert_eq!((one.matches().len(), other.matches().len()), (1, 0));
    other.run_until(one.cycle()).unwrap();
    assert_eq!(one.matches(), other.matches());
}

#[test]
fn a_preloaded_duty_changes_at_the_end_of_the_period() {
    let mut machine = pwm(250, 1);
    machine.run_until(1_100).unwrap();
    let start = machine.cycle();
    machine.write_word(TIM4 + 0x34, 500).unwrap();
    machine.run_until(3_100).unwrap();
    let last = machine.duties().last().unwrap();
    assert_eq!((last.high, last.period), (500, 1000));
    assert!(last.cycle > start + 500);
}

#[test]
fn a_laser_forced_off_is_off_at_once() {
    let mut machine = pwm(900, 1);
    machine.run_until(1_100).unwrap();
    assert!(machine.level(LASER));
    let now = machine.cycle();
    machine.write_word(TIM4 + 0x18, 4 << 4 | 1 << 3).unwrap();
    assert!(!machine.level(LASER));
    assert_eq!(machine.edges().last().unwrap().cycle, now);
    assert_eq!(machine.duties().last().unwrap().high, 0);
}

#[test]
fn a_timer_moves_words_from_memory_to_a_port_without_the_core() {
    const DMA2_S1: u32 = 0x4002_6400 + 0x10 + 0x18;
    const TIM8: u32 = 0x4001_0400;
    let mut machine = machine(&[
        (GPIOD, 1 << 24),
        (0x2000_0100, 1 << 12),
        (0x2000_0104, 1 << 28),
        (DMA2_S1 + 0x04, 2),
        (DMA2_S1 + 0x08, GPIOD + 0x18),
        (DMA2_S1 + 0x0C, 0x2000_0100),
        (DMA2_S1, 7 << 25 | 10 << 11 | 1 << 10 | 1 << 8 | 1 << 6 | 1),
        (TIM8 + 0x2C, 99),
        (TIM8 + 0x0C, 1 << 8),
        (TIM8, 1),
    ]);
    machine.run_until(450).unwrap();
    let expected = [(0, true), (100, false), (200, true), (300, false)];
    assert_eq!(edges(&machine)[..4], expected);
    let (controller, stream) = (2, 1);
    assert_eq!(machine.edges()[0].cause, Cause::Dma { controller, stream });
}

#[test]
fn dma1_has_no_way_to_a_port() {
    const DMA1_S7: u32 = 0x4002_6000 + 0x10 + 7 * 0x18;
    let machine = machine(&[
        (DMA1_S7 + 0x04, 1),
        (DMA1_S7 + 0x08, GPIOD + 0x18),
        (DMA1_S7, 3 << 25 | 10 << 11 | 1 << 6 | 1),
        (0x4000_000C, 1 << 8),
        (0x4000_0014, 1),
    ]);
    let address = GPIOD + 0x18;
    let unreachable = Warning::DmaUnreachable { address };
    // The memory address is 0, which is the flash.
    assert_eq!(machine.warnings(), [unreachable]);
}

#[test]
fn a_switch_makes_its_line_pending_at_its_cycle() {
    let mut machine = machine(&[
        (0x4001_3808, 2), // EXTICR1: line 0 from port C
        (0x4001_3C00, 1),
        (0x4001_3C0C, 1), // falling
    ]);
    let switch = Pin::new('C', 0);
    machine.pin_at(500, switch, true);
    machine.pin_at(900, switch, false);
    machine.run_until(890).unwrap();
    assert!(!machine.nvic.is_pending(Exception::irq(6)));
    machine.run_until(910).unwrap();
    assert!(machine.nvic.is_pending(Exception::irq(6)));
    assert_eq!(machine.edges().last().unwrap().cycle, 900);
}

#[test]
fn bytes_come_one_after_the_other_at_the_rate_of_the_port() {
    let mut machine = machine(&[
        LINE_MODES,
        LINE_FUNCTIONS,
        (USART2 + 0x08, 16),
        (USART2 + 0x0C, 0x200C),
    ]);
    let sent_at = machine.cycle();
    machine.uart_send(LINE, b"ab");
    machine.run_until(sent_at + 159).unwrap();
    assert_eq!(machine.read_word(USART2).unwrap() & 1 << 5, 0);
    machine.run_until(sent_at + 200).unwrap();
    assert_eq!(machine.read_word(USART2 + 4), Ok(u32::from(b'a')));
    machine.run_until(sent_at + 330).unwrap();
    assert_eq!(machine.read_word(USART2 + 4), Ok(u32::from(b'b')));
    assert_eq!(machine.uart_overruns(LINE), 0);
}

const USART2: u32 = 0x4000_4400;
const DMA1_S5: u32 = 0x4002_6000 + 0x10 + 5 * 0x18;
const DMA1_S6: u32 = 0x4002_6000 + 0x10 + 6 * 0x18;

/// RM0090 section 30.3.13, reception using DMA: each byte is moved from DR to memory, here as
/// half-words, the width of DR.
#[test]
fn dma_takes_received_bytes_round_and_round() {
    let mut machine = machine(&[
        LINE_MODES,
        LINE_FUNCTIONS,
        (USART2 + 0x08, 16),
        (USART2 + 0x14, 1 << 6),
        (USART2 + 0x0C, 0x200C),
        (DMA1_S5 + 0x04, 4),
        (DMA1_S5 + 0x08, USART2 + 4),
        (DMA1_S5 + 0x0C, 0x2000_0100),
        (DMA1_S5, 4 << 25 | 5 << 11 | 1 << 10 | 1 << 8 | 1),
    ]);
    machine.uart_send(LINE, b"abcdef");
    machine.run_until(machine.cycle() + 1_200).unwrap();
    let places = (0x2000_0100..).step_by(2).take(4);
    let found: Vec<_> = places
        .map(|place| machine.read(place, Width::Half).unwrap())
        .collect();
    assert_eq!(found, b"efcd".map(u32::from));
    assert_eq!(machine.read_word(DMA1_S5 + 0x04), Ok(2));
    assert_eq!(machine.read_word(USART2).unwrap() & 1 << 5, 0);
    assert_eq!(machine.uart_overruns(LINE), 0);
}

/// RM0090 section 30.3.13, transmission using DMA: the request lasts while TXE and DMAT are set,
/// whichever of DMA and USART is enabled first.
#[test]
fn dma_sends_bytes_from_memory_and_says_when_the_last_is_in_the_port() {
    let mut machine = machine(&[
        LINE_MODES,
        LINE_FUNCTIONS,
        (USART2 + 0x08, 16),
        (USART2 + 0x14, 1 << 7),
        (USART2 + 0x0C, 0x200C),
        (0x2000_0100, u32::from_le_bytes(*b"ok\r\n")),
        (DMA1_S6 + 0x04, 4),
        (DMA1_S6 + 0x08, USART2 + 4),
        (DMA1_S6 + 0x0C, 0x2000_0100),
        (DMA1_S6, 4 << 25 | 1 << 10 | 1 << 6 | 1 << 4 | 1),
    ]);
    let (started, transfer_complete) = (machine.cycle(), Exception::irq(17));
    machine.run_until(started + 310).unwrap();
    assert!(!machine.nvic.is_pending(transfer_complete));
    machine.run_until(started + 330).unwrap();
    assert!(machine.nvic.is_pending(transfer_complete));
    assert_eq!(machine.read_word(DMA1_S6).unwrap() & 1, 0);
    machine.run_until(started + 650).unwrap();
    assert_eq!(machine.uart_out(LINE).as_slice(), b"ok\r\n");
}

#[test]
fn an_unfed_watchdog_resets_the_chip_and_its_outputs() {
    let mut machine = machine(&[
        (GPIOD, 1 << 24),
        (GPIOD + 0x18, 1 << 12),
        (0x4000_3000, 0xCCCC),
        (0x4000_3000, 0x5555),
        (0x4000_3008, 79), // 10 ms at 32 kHz
    ]);
    machine.run_until(5_000).unwrap();
    machine.write_word(0x4000_3000, 0xAAAA).unwrap();
    let _ = machine.run_until(170_000);
    let (cycle, cause) = machine.resets()[0];
    assert_eq!(cause, ResetCause::Watchdog);
    assert!((165_000..165_200).contains(&cycle), "{cycle}");
    assert_eq!(machine.edges().last().unwrap().cause, Cause::Reset);
}

#[test]
fn a_stopped_crystal_asks_for_the_nmi_where_it_is_watched() {
    let mut machine = machine(&[(RCC, 0x83 | 1 << 16 | 1 << 19), (RCC + 8, 1)]);
    assert_eq!(machine.clocks().hclk, 8_000_000);
    machine.crystal_stops_at(100);
    machine.cycle = 100;
    machine.run_events();
    assert_eq!(machine.clocks().hclk, 16_000_000);
    assert!(machine.nvic.is_pending(Exception::NMI));
}

#[test]
fn a_supply_that_sinks_is_an_edge_of_line_16() {
    let mut machine = machine(&[
        (0x4000_7000, 0x4010),
        (0x4001_3C00, 1 << 16),
        (0x4001_3C08, 1 << 16),
    ]);
    machine.supply_at(100, 2000);
    machine.run_until(120).unwrap();
    assert!(machine.nvic.is_pending(Exception::irq(1)));
}
