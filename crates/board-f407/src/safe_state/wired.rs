//! The pins of a board that are compiled in.
use super::{Store, FRESH};
use crate::{
    chip::Bank,
    gpio::Pin,
    profile::{banks, MotorPins, MOTORS, PROFILE},
};
use core::arch::global_asm;

/// The pins that could do harm, their harmless levels, and the number of these pins. The power pin
/// comes first.
const PINS: ([Pin; MOST], [bool; MOST], usize) = {
    let (mut pins, mut levels, mut count) = ([PROFILE.power.pin; MOST], [false; MOST], 1);
    let mut motor = 0;
    while motor < MOTORS {
        let of_motor = PROFILE.motors[motor].all();
        let mut pin = 0;
        while pin < of_motor.len() {
            pins[count] = of_motor[pin];
            count += 1;
            pin += 1;
        }
        motor += 1;
    }
    let mut high = 0;
    while high < PROFILE.high.len() {
        (pins[count], levels[count]) = (PROFILE.high[high], true);
        count += 1;
        high += 1;
    }
    let outputs = [
        PROFILE.spindle,
        PROFILE.spindle_reverse,
        PROFILE.flood,
        PROFILE.mist,
        PROFILE.heater_supply,
        PROFILE.fan,
    ];
    let mut output = 0;
    while output < outputs.len() {
        if let Some(found) = outputs[output] {
            (pins[count], levels[count]) = (found.pin, !found.active_high);
            count += 1;
        }
        output += 1;
    }
    let lists = [PROFILE.synchronised, PROFILE.heaters];
    let mut list = 0;
    while list < lists.len() {
        let mut output = 0;
        while output < lists[list].len() {
            let found = lists[list][output];
            (pins[count], levels[count]) = (found.pin, !found.active_high);
            count += 1;
            output += 1;
        }
        list += 1;
    }
    (pins, levels, count)
};
const MOST: usize = 1 + MotorPins::COUNT * MOTORS + PROFILE.high.len() + SINGLE + LISTED;
/// Outputs of `PROFILE` that a board may have or not: spindle, its reverse, flood, mist, the
/// heaters' supply, fan.
const SINGLE: usize = 6;
/// Outputs in the lists of `PROFILE`.
const LISTED: usize = PROFILE.synchronised.len() + PROFILE.heaters.len();
/// The ports of these pins, and the number of ports.
const PORTS: ([Bank; MOST], usize) = banks(PINS.0);

/// The changes that make the pins of a port safe. The pins get their levels, then they become
/// push-pull outputs with edges of 10 ns in place of 100 (RM0090 section 8.4; data sheet, table
/// 50).
const fn of_port(bank: Bank) -> [Store; 4] {
    let (mut levels, mut modes, mut outputs, mut types) = (0, 0, 0, 0);
    let mut place = 0;
    while place < PINS.2 {
        let pin = PINS.0[place];
        if pin.bank as u8 == bank as u8 {
            levels |= pin.word(PINS.1[place]);
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
const SAFE: [Store; 4 * PORTS.1] = {
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

const STORES: usize = 1 + SAFE.len() + FRESH.len();
/// All changes at reset, in this order.
static AT_RESET: [Store; STORES] = {
    let mut stores = [PORTS_ON; STORES];
    let mut place = 0;
    while place < SAFE.len() {
        stores[1 + place] = SAFE[place];
        place += 1;
    }
    let mut place = 0;
    while place < FRESH.len() {
        stores[1 + SAFE.len() + place] = FRESH[place];
        place += 1;
    }
    stores
};

/// Makes the pins safe. Any context.
pub(super) fn make_safe() {
    for store in &SAFE {
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
