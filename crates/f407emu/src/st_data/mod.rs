//! Compares the peripherals' registers with ST's data: address, access, reserved bits, value after
//! a reset, bits that are cleared by writing. Each difference must have a reason in `reasons.rs`,
//! and each reason there must explain a difference.
#[cfg(feature = "st-data")]
mod connections;
mod reasons;
mod source;

use crate::{
    machine::Machine,
    peripheral::register_map::{self, find, is_modelled},
    record::Cause,
};
use reasons::{PLAIN, RESETS, ROWS};
use source::Register;
use std::collections::BTreeMap;

/// The registers of the modelled peripherals: USB without host mode.
fn st_registers() -> BTreeMap<u32, Register> {
    source::registers(|name, base| is_modelled(base) && name != "OTG_FS_HOST")
}

impl Machine {
    fn see(&mut self, address: u32) -> u32 {
        self.register_read(address, self.cycle)
    }

    fn tell(&mut self, address: u32, value: u32) {
        self.register_write(address, value, u32::MAX, self.cycle, Cause::Core(0));
    }
}

/// Checks that each difference has a reason, and that each reason explains a difference. A
/// difference is the name of a register, and the property that differs. In a reason's name `*` stands for any text.
fn explain(differences: &[(String, String)], reasons: &[(&str, &str)]) {
    let fits = |name: &str, pattern: &str| match pattern.split_once('*') {
        Some((begin, end)) => name.starts_with(begin) && name.ends_with(end),
        None => name == pattern,
    };
    let unexplained: Vec<String> = differences
        .iter()
        .filter(|(name, _)| !reasons.iter().any(|(pattern, _)| fits(name, pattern)))
        .map(|(name, difference)| format!("{name}: {difference}"))
        .collect();
    assert!(
        unexplained.is_empty(),
        "{} without a reason:\n{}",
        unexplained.len(),
        unexplained.join("\n")
    );
    for (pattern, reason) in reasons {
        let needed = differences.iter().any(|(name, _)| fits(name, pattern));
        assert!(needed, "no difference for the reason {pattern}: {reason}");
    }
}

#[test]
fn each_register_has_the_address_and_the_bits_of_sts_data() {
    let registers = st_registers();
    assert!(registers.len() > 460, "only {} found", registers.len());
    let mut differences = Vec::new();
    for (&address, st) in &registers {
        let ours = find(address).map(|ours| (ours.read, ours.write));
        if ours != Some((st.read, st.write)) {
            let difference = format!("{:08x?}, {ours:08x?} here", (st.read, st.write));
            differences.push((st.name.clone(), difference));
        }
    }
    for (address, _) in register_map::all().filter(|(address, _)| !registers.contains_key(address))
    {
        differences.push((format!("{address:#x}"), "not in ST's data".into()));
    }
    explain(&differences, ROWS);
}

#[test]
fn each_register_has_the_value_of_sts_data_after_a_reset() {
    let machine = Machine::with_clocks();
    let mut differences = Vec::new();
    for (address, st) in st_registers() {
        let Some(ours) = find(address).filter(|ours| ours.read != 0) else {
            continue;
        };
        // The enable registers differ: this test has switched the clocks on.
        let enables = matches!(address, 0x4002_3830..=0x4002_3844);
        let (seen, reset) = (
            machine.clone().see(address),
            st.reset & (ours.read | ours.ones),
        );
        if seen != reset && !enables {
            differences.push((st.name, format!("{reset:08x}, {seen:08x} here")));
        }
    }
    explain(&differences, RESETS);
}

#[test]
fn what_is_written_to_bits_of_both_ways_reads_back() {
    let machine = Machine::with_clocks();
    let mut differences = Vec::new();
    for (address, st) in st_registers() {
        let Some(ours) = find(address) else { continue };
        let both = ours.read & ours.write & !st.cleared_by_one & !st.cleared_by_zero;
        let mut machine = machine.clone();
        machine.tell(address, both | ours.ones);
        let seen = machine.see(address) & both;
        if seen != both {
            differences.push((st.name, format!("{both:08x} written, {seen:08x} read")));
        }
    }
    explain(&differences, PLAIN);
}

#[test]
fn a_write_to_a_reserved_bit_ends_the_run() {
    let machine = Machine::with_clocks();
    for (address, st) in st_registers() {
        let Some(ours) = find(address).filter(|ours| !ours.allows(!ours.ones, ours.reserved()))
        else {
            continue;
        };
        let lowest = ours.reserved() & ours.reserved().wrapping_neg();
        let mut machine = machine.clone();
        machine.tell(address, ours.ones ^ lowest);
        assert!(machine.stray.is_some(), "{}", st.name);
    }
}

/// The test covers the flags that a timer's own events raise.
#[test]
fn a_timers_flags_are_cleared_by_zeros_and_left_by_ones() {
    let registers = st_registers();
    for (&address, st) in registers
        .iter()
        .filter(|(_, st)| st.name.ends_with(".SR") && st.name.starts_with("TIM"))
    {
        let mut machine = Machine::with_clocks();
        let events = registers[&(address + 4)].write;
        machine.tell(address + 4, events);
        let raised = machine.see(address);
        assert_ne!(raised, 0, "{}", st.name);
        assert_eq!(raised & !st.cleared_by_zero, 0, "{}", st.name);
        for bit in (0..32).map(|bit| 1 << bit).filter(|bit| raised & bit != 0) {
            let mut machine = machine.clone();
            machine.tell(address, st.cleared_by_zero & !bit);
            assert_eq!(machine.see(address), raised & !bit, "{}", st.name);
        }
    }
}

#[test]
fn lines_of_exti_are_cleared_by_ones_and_left_by_zeros() {
    let registers = st_registers();
    let pending = registers.values().find(|st| st.name == "EXTI.PR").unwrap();
    let mut machine = Machine::with_clocks();
    machine.tell(0x4001_3C00, pending.cleared_by_one);
    machine.tell(0x4001_3C10, pending.cleared_by_one);
    assert_eq!(machine.see(0x4001_3C14), pending.cleared_by_one);
    machine.tell(0x4001_3C14, 0x5);
    assert_eq!(machine.see(0x4001_3C14), pending.cleared_by_one & !0x5);
}

#[test]
fn errors_of_the_flash_are_cleared_by_ones_and_left_by_zeros() {
    let registers = st_registers();
    let status = registers.values().find(|st| st.name == "FLASH.SR").unwrap();
    for bit in (0..32)
        .map(|bit| 1 << bit)
        .filter(|bit| status.cleared_by_one & bit != 0)
    {
        let mut machine = Machine::with_clocks();
        machine.devices.flash.raise(status.cleared_by_one);
        machine.tell(0x4002_3C0C, 0);
        assert_eq!(machine.see(0x4002_3C0C), status.cleared_by_one);
        machine.tell(0x4002_3C0C, bit);
        assert_eq!(machine.see(0x4002_3C0C), status.cleared_by_one & !bit);
    }
}
