//! The pins of a board that are compiled in.
use super::{Store, FRESH};
use crate::{
    chip::Bank,
    profile::{banks, SAFE},
};
use core::arch::global_asm;

/// The ports of the pins that could do harm, and the number of ports.
const PORTS: ([Bank; SAFE.len()], usize) = banks({
    let (mut pins, mut place) = ([SAFE[0].0; SAFE.len()], 0);
    while place < SAFE.len() {
        pins[place] = SAFE[place].0;
        place += 1;
    }
    pins
});

/// The changes that make the pins of a port safe. The pins get their levels, then they become
/// push-pull outputs with edges of 10 ns in place of 100 (RM0090 section 8.4; data sheet, table
/// 50).
const fn of_port(bank: Bank) -> [Store; 4] {
    let (mut levels, mut modes, mut outputs, mut types) = (0, 0, 0, 0);
    let mut place = 0;
    while place < SAFE.len() {
        let (pin, high) = SAFE[place];
        if pin.bank as u8 == bank as u8 {
            levels |= pin.word(high);
            modes |= 0b11 << (2 * pin.number);
            outputs |= 0b01 << (2 * pin.number);
            types |= 1 << pin.number;
        }
        place += 1;
    }
    let port = 0x4002_0000 + 0x400 * bank as u32;
    [
        Store::whole(port + 0x18, levels),
        Store::new(port, modes, outputs),
        Store::new(port + 0x04, types, 0),
        Store::new(port + 0x08, modes, outputs),
    ]
}

/// The changes for all ports.
const OF_PINS: [Store; 4 * PORTS.1] = {
    let mut stores = [Store::whole(0, 0); 4 * PORTS.1];
    let mut port = 0;
    while port < PORTS.1 {
        let [levels, modes, types, speeds] = of_port(PORTS.0[port]);
        // First the pins of every port become outputs that are off. Their type and speed come after
        // that.
        stores[2 * port] = levels;
        stores[2 * port + 1] = modes;
        stores[2 * (PORTS.1 + port)] = types;
        stores[2 * (PORTS.1 + port) + 1] = speeds;
        port += 1;
    }
    stores
};

/// RCC_AHB1ENR with ports A to G on (RM0090 section 7.3.10).
const PORTS_ON: Store = Store::new(0x4002_3830, 0, 0x7F);

const STORES: usize = 1 + OF_PINS.len() + FRESH.len();
/// All changes at reset, in this order.
static AT_RESET: [Store; STORES] = {
    let mut stores = [PORTS_ON; STORES];
    let mut place = 0;
    while place < OF_PINS.len() {
        stores[1 + place] = OF_PINS[place];
        place += 1;
    }
    let mut place = 0;
    while place < FRESH.len() {
        stores[1 + OF_PINS.len() + place] = FRESH[place];
        place += 1;
    }
    stores
};

/// Makes the pins safe. Any context.
pub(super) fn make_safe() {
    for store in &OF_PINS {
        store.make();
    }
}

// The first instructions after a reset. They are called without a stack. They switch interrupts
// off, which `main` switches on again, set the stack pointer, and make the changes of the table.
// The barrier after each store is for the ports' clocks (ES0182, "Delay after an RCC peripheral
// clock enabling").
global_asm!(
    ".section .text.__pre_init, \"ax\"",
    ".global __pre_init",
    ".type __pre_init,%function",
    ".thumb_func",
    "__pre_init:",
    "cpsid i",
    "ldr r0, =__stack_top",
    "msr msp, r0",
    "ldr r0, ={stores}",
    "movs r5, #{count}",
    "1: ldm r0!, {{r1, r2, r3}}",
    "ldr r4, [r1]",
    "bics r4, r2",
    "orrs r4, r3",
    "str r4, [r1]",
    "dsb",
    "subs r5, #1",
    "bne 1b",
    "bx lr",
    ".ltorg",
    stores = sym AT_RESET,
    count = const STORES,
);
