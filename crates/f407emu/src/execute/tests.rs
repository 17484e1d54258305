//! Short programs in SRAM, and the registers after them.
use crate::{
    instruction::Width,
    machine::Machine,
    memory::SRAM,
    timing::FlashTiming,
    trap::{Stop, Trap},
};
use proptest::prelude::*;

const DATA: u32 = SRAM + 0x1000;

/// A machine about to run a program, with the floating-point unit on.
fn machine(program: &[u16]) -> Box<Machine> {
    let mut machine = Machine::new(8_000_000);
    for (index, half) in program.iter().enumerate() {
        let address = SRAM + 2 * index as u32;
        machine
            .write(address, Width::Half, u32::from(*half))
            .unwrap();
    }
    machine.cpu.next = SRAM;
    machine.cpu.r[13] = SRAM + 0x2000;
    machine.scb.cpacr = 0xF << 20;
    machine.timing.flash = FlashTiming::ZeroWait;
    machine
}

/// Runs `steps` instructions of a program that starts with these values in r0 to r3.
fn run(program: &[u16], steps: usize, registers: [u32; 4]) -> Box<Machine> {
    let mut machine = machine(program);
    machine.cpu.r[..4].copy_from_slice(&registers);
    for _ in 0..steps {
        machine.step().unwrap();
    }
    machine
}

#[test]
fn a_sum_of_64_bits_takes_the_carry_along() {
    // adds r0, r0, r2; adcs r1, r3
    let machine = run(&[0x1880, 0x4159], 2, [u32::MAX, 1, 2, 3]);
    assert_eq!(machine.cpu.r[..2], [1, 5]);
}

#[test]
fn an_it_block_carries_out_one_side() {
    // cmp r0, r1; ite lt; movlt r2, #1; movge r2, #2
    let program = [0x4288, 0xBFB4, 0x2201, 0x2202];
    assert_eq!(run(&program, 4, [1, 2, 0, 0]).cpu.r[2], 1);
    assert_eq!(run(&program, 4, [2, 2, 0, 0]).cpu.r[2], 2);
}

#[test]
fn sixteen_bit_instructions_in_an_it_block_leave_the_flags() {
    // cmp r0, r0; it eq; adds (addeq) r0, #1
    let machine = run(&[0x4280, 0xBF08, 0x3001], 3, [u32::MAX, 0, 0, 0]);
    assert!(machine.cpu.flags.zero && machine.cpu.flags.carry);
}

#[test]
fn a_loop_counts_down() {
    // adds r1, r1, r0; subs r0, #1; bne .-4
    let machine = run(&[0x1809, 0x3801, 0xD1FC], 3 * 10, [10, 0, 0, 0]);
    assert_eq!(machine.cpu.r[1], 55);
}

#[test]
fn push_and_pop_return_to_the_caller() {
    // bl f; nop; f: push {r4, lr}; pop {r4, pc}
    let mut machine = run(&[0xF000, 0xF801, 0xBF00, 0xB510, 0xBD10], 3, [0; 4]);
    assert_eq!(machine.pc(), SRAM + 4);
    assert_eq!(machine.cpu.r[13], SRAM + 0x2000);
    assert_eq!(machine.read_word(SRAM + 0x1FFC), Ok(SRAM + 5));
}

#[test]
fn loads_extend_and_write_back() {
    // strh r1, [r0]; ldrsb r2, [r0], #1; ldrb r3, [r0]
    let machine = run(&[0x8001, 0xF910, 0x2B01, 0x7803], 3, [DATA, 0x12F0, 0, 0]);
    assert_eq!(machine.cpu.r[2..4], [0xFFFF_FFF0, 0x12]);
    assert_eq!(machine.cpu.r[0], DATA + 1);
}

#[test]
fn an_exclusive_store_fails_once_the_mark_is_gone() {
    // ldrex r2, [r0]; strex r3, r1, [r0]; strex r1, r1, [r0]
    let program = [0xE850, 0x2F00, 0xE840, 0x1300, 0xE840, 0x1100];
    let mut machine = run(&program, 3, [DATA, 7, 0, 9]);
    assert_eq!((machine.cpu.r[3], machine.cpu.r[1]), (0, 1));
    assert_eq!(machine.read_word(DATA), Ok(7));
}

#[test]
fn a_table_branch_skips_by_its_entry() {
    // tbb [pc, r0]; .byte 1, 2; nop; mov r1, #..
    let machine = run(&[0xE8DF, 0xF000, 0x0201, 0x2101, 0x2102], 2, [1, 0, 0, 0]);
    assert_eq!(machine.cpu.r[1], 2);
}

#[test]
fn division_by_zero_is_zero_unless_it_is_trapped() {
    let program = [0xFBB0, 0xF0F1]; // udiv r0, r0, r1
    assert_eq!(run(&program, 1, [7, 0, 0, 0]).cpu.r[0], 0);
    let mut trapping = machine(&program);
    trapping.scb.ccr |= 1 << 4;
    trapping.cpu.masks.faultmask = true;
    let stop = trapping.step().unwrap_err();
    assert!(matches!(
        stop,
        Stop::Lockup {
            trap: Trap::DivideByZero,
            ..
        }
    ));
}

#[test]
fn saturation_sets_q() {
    let machine = run(&[0xFA81, 0xF080], 1, [i32::MAX as u32, 1, 0, 0]); // qadd r0, r0, r1
    assert_eq!(machine.cpu.r[0], i32::MAX as u32);
    assert!(machine.cpu.flags.saturated);
}

#[test]
fn bytes_are_added_side_by_side_and_selected_by_their_carries() {
    // uadd8 r2, r0, r1; sel r3, r0, r1
    let machine = run(
        &[0xFA80, 0xF241, 0xFAA0, 0xF381],
        2,
        [0xFF01_FF01, 0x0101_0101, 0, 0],
    );
    assert_eq!(machine.cpu.r[2], 0x0002_0002);
    assert_eq!(machine.cpu.ge, 0b1010);
    assert_eq!(machine.cpu.r[3], 0xFF01_FF01);
}

#[test]
fn floats_are_calculated_compared_and_converted() {
    // vmov s0, r0; vmov s1, r1; vdiv.f32 s2, s0, s1; vcvt.s32.f32 s3, s2; vmov r2, s3
    let program = [
        0xEE00, 0x0A10, 0xEE00, 0x1A90, 0xEE80, 0x1A20, 0xEEFD, 0x1AC1, 0xEE11, 0x2A90,
    ];
    let machine = run(&program, 5, [(-7f32).to_bits(), 2f32.to_bits(), 0, 0]);
    assert_eq!(machine.cpu.s[2], (-3.5f32).to_bits());
    assert_eq!(machine.cpu.r[2] as i32, -3);
}

#[test]
fn a_float_with_the_unit_off_is_a_trap() {
    let mut machine = machine(&[0xEE30, 0x0A00]);
    machine.scb.cpacr = 0;
    machine.cpu.masks.faultmask = true;
    let stop = machine.step().unwrap_err();
    assert!(matches!(
        stop,
        Stop::Lockup {
            trap: Trap::NoCoprocessor,
            ..
        }
    ));
}

#[test]
fn a_load_behind_a_load_costs_one_cycle_unless_it_needs_the_first() {
    let cycles = |program: &[u16]| {
        let fetches = 2; // from SRAM: one for each instruction
        run(program, 2, [DATA, DATA, DATA, 0]).cycle() - fetches
    };
    assert_eq!(cycles(&[0x6802, 0x680B]), 3); // ldr r2, [r0]; ldr r3, [r1]
    assert_eq!(cycles(&[0x6802, 0x6813]), 4); // ldr r2, [r0]; ldr r3, [r2] (that is 0: flash)
}

proptest! {
    #[test]
    fn long_products_are_those_of_64_bits(n: u32, m: u32, low: u32, high: u32) {
        // umlal r0, r1, r2, r3
        let machine = run(&[0xFBE2, 0x0103], 1, [low, high, n, m]);
        let sum = u64::from(high) << 32 | u64::from(low);
        let expected = sum.wrapping_add(u64::from(n) * u64::from(m));
        prop_assert_eq!(machine.cpu.r[0], expected as u32);
        prop_assert_eq!(machine.cpu.r[1], (expected >> 32) as u32);
    }

    #[test]
    fn comparisons_order_signed_and_unsigned_numbers(a: u32, b: u32) {
        let machine = run(&[0x4288], 1, [a, b, 0, 0]); // cmp r0, r1
        prop_assert_eq!(machine.cpu.holds(2), a >= b);
        prop_assert_eq!(machine.cpu.holds(8), a > b);
        prop_assert_eq!(machine.cpu.holds(10), a as i32 >= b as i32);
        prop_assert_eq!(machine.cpu.holds(13), a as i32 <= b as i32);
    }

    #[test]
    fn bit_fields_go_in_and_come_out(value: u32, other: u32) {
        // bfi r0, r1, #5, #9; ubfx r2, r0, #5, #9
        let machine = run(&[0xF361, 0x104D, 0xF3C0, 0x1248], 2, [other, value, 0, 0]);
        prop_assert_eq!(machine.cpu.r[2], value & 0x1FF);
        prop_assert_eq!(machine.cpu.r[0] & !(0x1FF << 5), other & !(0x1FF << 5));
    }
}
