//! The pins of a board that are in its record.
//!
//! The first instructions check the whole record before they act on a pin of it. The chip's CRC
//! unit takes a word in four cycles (RM0090 section 4.3), so the pins do not float for long.
//! Without a sound record no pin is known, and none is driven.
use super::{Store, FRESH};
use crate::{
    chip::Bank,
    profile,
    registers::{port, Word},
};
use core::arch::global_asm;
use leadscrew_record::{
    FIXED, LONGEST, MAGIC, OLDEST, PORTS, SAFE, SLOT, SLOTS, UNPROTECTED, VERSION,
};

/// The changes of registers at reset, in this order. The changes of the pins are in the record.
static AT_RESET: [Store; FRESH.len()] = FRESH;

/// Makes the pins safe. Any context.
pub(super) fn make_safe() {
    for safe in profile::content().safe.ports() {
        let bank = Bank::numbered(safe.port.get() as u8);
        let (fields, pins) = (safe.fields.get(), u32::from(safe.pins.get()));
        let outputs = fields & 0x5555_5555;
        bank.write(safe.levels.get());
        let port = port(bank);
        port.moder().change(|bits| bits & !fields | outputs);
        port.otyper().change(|bits| bits & !pins);
        port.ospeedr().change(|bits| bits & !fields | outputs);
    }
}

// The first instructions after a reset. They are called without a stack. They switch interrupts
// off, which `main` switches on again, and set the stack pointer.
//
// `leadscrew_record::slot` and `Record::read` do the same in Rust. First the record in force is
// looked for: the last one in front of empty flash. Its version, its length and its checksum have
// to be right. Then the pins of each port get their levels, and become push-pull outputs with edges
// of 10 ns (RM0090 section 8.4). The barriers are for the clocks of peripherals (ES0182, "Delay
// after an RCC peripheral clock enabling").
global_asm!(
    ".section .text.__pre_init, \"ax\"",
    ".global __pre_init",
    ".type __pre_init,%function",
    ".thumb_func",
    "__pre_init:",
    "cpsid i",
    "ldr r0, =__stack_top",
    "msr msp, r0",
    // RCC_AHB1ENR: ports A to G, and the CRC unit.
    "ldr r0, =0x40023830",
    "ldr r1, [r0]",
    "ldr r2, =0x107F",
    "orrs r1, r2",
    "str r1, [r0]",
    "dsb",
    // r0: the record in force, or 0.
    "movs r0, #0",
    "ldr r1, =__record",
    "ldr r2, ={magic}",
    "movs r3, #{slots}",
    "1: ldr r4, [r1]",
    "cmp r4, #-1",
    "beq 2f",
    "cmp r4, r2",
    "it eq",
    "moveq r0, r1",
    "add r1, r1, #{slot}",
    "subs r3, #1",
    "bne 1b",
    "2: cbz r0, 7f",
    "ldrh r1, [r0, #8]",
    "subs r1, #{oldest}",
    "cmp r1, #{newer}",
    "bhi 7f",
    "ldrh r1, [r0, #10]",
    "cmp r1, #{fixed}",
    "blo 7f",
    "movw r2, #{longest}",
    "cmp r1, r2",
    "bhi 7f",
    // The words behind the checksum go through the unit: CRC_CR, then CRC_DR.
    "ldr r2, =0x40023000",
    "movs r3, #1",
    "str r3, [r2, #8]",
    "add r3, r0, #{unprotected}",
    "subs r1, #{unprotected}",
    "lsrs r1, r1, #2",
    "3: ldr r4, [r3], #4",
    "str r4, [r2]",
    "subs r1, #1",
    "bne 3b",
    "ldr r4, [r2]",
    "ldr r1, [r0, #4]",
    "cmp r1, r4",
    "bne 7f",
    // The pins, a port at a time: r1 ports are left, r2 their levels, r3 both bits of each pin, r4
    // a bit of each pin, r5 the port's registers.
    "add r0, r0, #{safe}",
    "ldr r1, [r0], #4",
    "cmp r1, #{ports}",
    "bhi 7f",
    "4: cbz r1, 7f",
    "subs r1, #1",
    "ldm r0!, {{r2, r3, r4}}",
    "ubfx r5, r4, #16, #3",
    "lsls r5, r5, #10",
    "add r5, r5, #0x40000000",
    "add r5, r5, #0x20000",
    "uxth r4, r4",
    "str r2, [r5, #0x18]",
    "and r2, r3, #0x55555555",
    "ldr r6, [r5]",
    "bics r6, r3",
    "orrs r6, r2",
    "str r6, [r5]",
    "ldr r6, [r5, #4]",
    "bics r6, r4",
    "str r6, [r5, #4]",
    "ldr r6, [r5, #8]",
    "bics r6, r3",
    "orrs r6, r2",
    "str r6, [r5, #8]",
    "b 4b",
    // This ends everything that a bootloader may have left running.
    "7: ldr r0, ={stores}",
    "movs r5, #{count}",
    "8: ldm r0!, {{r1, r2, r3}}",
    "ldr r4, [r1]",
    "bics r4, r2",
    "orrs r4, r3",
    "str r4, [r1]",
    "dsb",
    "subs r5, #1",
    "bne 8b",
    "bx lr",
    ".ltorg",
    magic = const MAGIC,
    slots = const SLOTS,
    slot = const SLOT,
    oldest = const OLDEST,
    newer = const VERSION - OLDEST,
    fixed = const FIXED,
    longest = const LONGEST,
    unprotected = const UNPROTECTED,
    safe = const SAFE,
    ports = const PORTS,
    stores = sym AT_RESET,
    count = const FRESH.len(),
);
