//! Compares the connections of the chip with ST's data, as in the crate `stm32-metapac`: the
//! interrupt of a peripheral, its DMA streams, the alternate functions of the pins, and the bit of
//! RCC that switches its clock on.
use crate::{
    devices::USARTS,
    machine::Machine,
    peripheral::{
        adc, dma, exti,
        nvic::Exception,
        pin_map::{signal, Signal},
        timer_map::{output, Route, INSTANCES},
    },
    record::Cause,
    wiring::serial::{USART_IRQS, USART_RECEIVE, USART_TRANSMIT, USB_IRQ},
};
use stm32_metapac::metadata::{ir::BitOffset, Peripheral, METADATA};

const USART_NAMES: [&str; 4] = ["USART1", "USART2", "USART3", "USART6"];

fn peripheral(name: &str) -> &'static Peripheral {
    let found = METADATA.peripherals.iter().find(|one| one.name == name);
    found.unwrap_or_else(|| panic!("ST's data have no {name}"))
}

/// The interrupt of a peripheral's signal.
fn irq(name: &str, signal: &str) -> Exception {
    let of_signal = peripheral(name).interrupts.iter();
    let interrupt = of_signal.clone().find(|one| one.signal == signal);
    numbered(
        interrupt
            .unwrap_or_else(|| panic!("{name} has no {signal}"))
            .interrupt,
    )
}

fn numbered(name: &str) -> Exception {
    let found = METADATA.interrupts.iter().find(|one| one.name == name);
    Exception::irq(found.unwrap_or_else(|| panic!("no {name}")).number as u8)
}

/// The DMA streams that serve a signal of a peripheral, as controller, stream, channel.
fn routes(name: &str, signal: &str) -> Vec<(u8, u8, u8)> {
    let ours = peripheral(name).dma_channels.iter();
    let mut found: Vec<_> = ours
        .filter(|one| one.signal == signal)
        .filter_map(|one| {
            let (controller, stream) = one.channel?.strip_prefix("DMA")?.split_once("_CH")?;
            let controller: u8 = controller.parse().ok()?;
            Some((controller - 1, stream.parse().ok()?, one.request? as u8))
        })
        .collect();
    found.sort_unstable();
    found
}

fn sorted(routes: &[Route]) -> Vec<(u8, u8, u8)> {
    let mut ours: Vec<_> = routes
        .iter()
        .map(|one| (one.controller, one.stream, one.channel))
        .collect();
    ours.sort_unstable();
    ours
}

#[test]
fn peripherals_are_where_sts_data_have_them() {
    for (name, base) in USART_NAMES.iter().zip(USARTS) {
        assert_eq!(peripheral(name).address, u64::from(base), "{name}");
    }
    for (number, instance) in (1..).zip(&INSTANCES) {
        let name = format!("TIM{number}");
        assert_eq!(peripheral(&name).address, u64::from(instance.base));
    }
}

#[test]
fn each_peripheral_has_the_interrupt_of_sts_data() {
    for (number, instance) in (1..).zip(&INSTANCES) {
        let name = format!("TIM{number}");
        assert_eq!(Exception::irq(instance.update_irq), irq(&name, "UP"));
        if instance.channels > 0 {
            let compare = Exception::irq(instance.compare_irq);
            assert_eq!(compare, irq(&name, "CC"), "{name}");
        }
    }
    for (name, number) in USART_NAMES.iter().zip(USART_IRQS) {
        assert_eq!(Exception::irq(number), irq(name, "GLOBAL"), "{name}");
    }
    for controller in 0..2 {
        for stream in 0..8 {
            let name = format!("DMA{}_STREAM{stream}", controller + 1);
            assert_eq!(dma::exception(controller, stream), numbered(&name));
        }
    }
    assert_eq!(Exception::irq(USB_IRQ), numbered("OTG_FS"));
}

#[test]
fn the_lines_of_exti_have_the_interrupts_of_sts_data() {
    let names = [
        "EXTI0",
        "EXTI1",
        "EXTI2",
        "EXTI3",
        "EXTI4",
        "EXTI9_5",
        "EXTI15_10",
        "PVD",
    ];
    let ours = exti::Exti::default().interrupts();
    for ((exception, _), name) in ours.into_iter().zip(names) {
        assert_eq!(exception, numbered(name), "{name}");
    }
}

#[test]
fn requests_reach_the_dma_streams_of_sts_data() {
    for (number, instance) in (1..).zip(&INSTANCES) {
        let name = format!("TIM{number}");
        assert_eq!(
            sorted(instance.update_dma),
            routes(&name, "UP"),
            "{name} UP"
        );
        for (channel, ours) in (1..).zip(instance.compare_dma) {
            let signal = format!("CH{channel}");
            assert_eq!(sorted(ours), routes(&name, &signal), "{name} {signal}");
        }
    }
    let usarts = USART_NAMES
        .iter()
        .zip(USART_RECEIVE.iter().zip(&USART_TRANSMIT));
    for (name, (receive, transmit)) in usarts {
        assert_eq!(sorted(receive), routes(name, "RX"), "{name} RX");
        assert_eq!(sorted(transmit), routes(name, "TX"), "{name} TX");
    }
}

/// The peripheral and the signal of an output, by their names in ST's data.
fn output_name(timer: usize, channel: u8, complementary: bool) -> (String, String) {
    let complement = if complementary { "N" } else { "" };
    let signal = format!("CH{}{complement}", channel + 1);
    (format!("TIM{}", timer + 1), signal)
}

#[test]
fn pins_become_the_outputs_of_timers_that_sts_data_name() {
    for (port, letter) in ('A'..='G').enumerate() {
        for (pin, function) in (0..16).flat_map(|pin| (0..16).map(move |f| (pin, f))) {
            let name = format!("P{letter}{pin}");
            let theirs = METADATA.peripherals.iter().find_map(|one| {
                let is_timer = one.name.starts_with("TIM");
                let mut signals = one.pins.iter().filter(|_| is_timer);
                let found = signals.find(|at| {
                    at.pin == name && at.af == Some(function) && at.signal.starts_with("CH")
                })?;
                Some((one.name.to_owned(), found.signal.to_owned()))
            });
            let ours = output(port, pin, function)
                .map(|(timer, output)| output_name(timer, output.channel, output.complementary));
            assert_eq!(ours, theirs, "{name} by function {function}");
        }
    }
}

/// The peripheral and the name of a signal in ST's data.
fn signal_name(signal: Signal) -> (&'static str, &'static str) {
    match signal {
        Signal::Transmit(index) => (USART_NAMES[index], "TX"),
        Signal::Receive(index) => (USART_NAMES[index], "RX"),
        Signal::UsbMinus => ("USB_OTG_FS", "DM"),
        Signal::UsbPlus => ("USB_OTG_FS", "DP"),
    }
}

#[test]
fn pins_become_the_signals_of_serial_ports_and_usb_that_sts_data_name() {
    let mut found = 0;
    for (port, letter) in ('A'..='G').enumerate() {
        for (pin, function) in (0..16).flat_map(|pin| (0..16).map(move |f| (pin, f))) {
            let name = format!("P{letter}{pin}");
            let theirs = METADATA.peripherals.iter().find_map(|one| {
                let names = USART_NAMES.iter().chain(&["USB_OTG_FS"]);
                let name_of_ours = names.copied().find(|name| *name == one.name)?;
                let at = one.pins.iter().find(|at| {
                    let is_modelled = matches!(at.signal, "TX" | "RX" | "DM" | "DP");
                    is_modelled && at.pin == name && at.af == Some(function)
                })?;
                Some((name_of_ours, at.signal))
            });
            let ours = signal(port, pin, function).map(signal_name);
            assert_eq!(ours, theirs, "{name} by function {function}");
            found += usize::from(ours.is_some());
        }
    }
    assert_eq!(found, 4 + 4 + 6 + 4 + 2);
}

/// The address of an enable register of RCC, and the bit of a field in it.
fn enable(register: &str, field: &str) -> (u32, u32) {
    let is = |name: &str, wanted: &str| name.eq_ignore_ascii_case(wanted);
    let rcc = peripheral("RCC").registers.as_ref().unwrap().ir;
    let mut items = rcc.blocks.iter().flat_map(|block| block.items);
    let item = items.find(|item| is(item.name, register)).unwrap();
    let mut sets = rcc.fieldsets.iter();
    let fields = sets.find(|one| is(one.name, register)).unwrap().fields;
    match fields
        .iter()
        .find(|one| is(one.name, field))
        .map(|one| &one.bit_offset)
    {
        Some(BitOffset::Regular(place)) => (0x4002_3800 + item.byte_offset, place.offset),
        other => panic!("{register}.{field} is {other:?}"),
    }
}

#[test]
fn each_modelled_peripheral_has_the_clock_of_sts_data() {
    let modelled = |one: &&Peripheral| {
        let names = ["GPIO", "DMA", "TIM", "USART"];
        let alone = ["SYSCFG", "PWR", "USB_OTG_FS"];
        let numbered = |name: &&str| one.name.starts_with(*name);
        names.iter().any(numbered) || alone.contains(&one.name)
    };
    let mut seen = 0;
    for one in METADATA.peripherals.iter().filter(modelled) {
        let Some(at) = one.rcc.as_ref().and_then(|rcc| rcc.enable.as_ref()) else {
            continue;
        };
        let (register, bit) = enable(at.register, at.field);
        let mut machine = Machine::new(8_000_000);
        let (address, now) = (one.address as u32, machine.cycle());
        assert_eq!(machine.devices.rcc.clock_of(address), None, "{}", one.name);
        machine.register_write(register, 1 << bit, u32::MAX, now, Cause::Core(0));
        let on = machine.devices.rcc.clock_of(address);
        assert!(on.is_some(), "{} by {}.{}", one.name, at.register, at.field);
        seen += 1;
    }
    assert!(seen >= 9 + 2 + 14 + 4 + 3, "only {seen}");
}

#[test]
fn the_converters_channels_are_at_sts_pins() {
    let mut found = 0;
    for pin in peripheral("ADC1").pins {
        let Some(number) = pin.signal.strip_prefix("IN") else {
            continue;
        };
        let port = pin.pin.as_bytes()[1] - b'A';
        let place = pin.pin[2..].parse().unwrap();
        assert_eq!(
            adc::channel(port, place),
            number.parse().ok(),
            "{}",
            pin.pin
        );
        found += 1;
    }
    assert_eq!(found, 16);
    assert_eq!(adc::channel(1, 2), None);
}
