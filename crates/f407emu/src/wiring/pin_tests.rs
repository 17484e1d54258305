//! Tests of pins and the peripherals that use them.
use super::tests::machine;
use crate::{
    devices::{SerialLine, SerialPort, USARTS},
    machine::Machine,
    record::Pin,
    warning::Warning,
};

/// The mode of a pin with an alternate function (RM0090 section 8.4.1).
const ALTERNATE: u32 = 2;

/// All lines that the F407 can have: output, input, and the number of their function (data sheet
/// DocID022152, table 9).
const LINES: [(SerialPort, &str, &str, u32); 9] = [
    (SerialPort::Usart1, "A9", "A10", 7),
    (SerialPort::Usart1, "B6", "B7", 7),
    (SerialPort::Usart2, "A2", "A3", 7),
    (SerialPort::Usart2, "D5", "D6", 7),
    (SerialPort::Usart3, "B10", "B11", 7),
    (SerialPort::Usart3, "C10", "C11", 7),
    (SerialPort::Usart3, "D8", "D9", 7),
    (SerialPort::Usart6, "C6", "C7", 8),
    (SerialPort::Usart6, "G14", "G9", 8),
];

fn pin(name: &str) -> Pin {
    Pin::new(name.chars().next().unwrap(), name[1..].parse().unwrap())
}

/// Gives a pin a mode and an alternate function.
fn set(machine: &mut Machine, pin: Pin, mode: u32, function: u32) {
    let (base, number) = (
        0x4002_0000 + 0x400 * u32::from(pin.port),
        u32::from(pin.number),
    );
    let mut put = |register: u32, place: u32, bits: u32, value: u32| {
        let word = machine.read_word(register).unwrap() & !(bits << place);
        machine.write_word(register, word | value << place).unwrap();
    };
    put(
        base + 0x20 + 4 * (number / 8),
        number % 8 * 4,
        0xF,
        function,
    );
    put(base, 2 * number, 3, mode);
}

/// The bytes that come out and arrive, one each way, if both pins of a line have this mode and
/// this function.
fn moved(line: SerialLine, mode: u32, function: u32) -> (usize, bool) {
    let mut machine = machine(&[]);
    machine.plug_serial(line);
    for pin in [line.output, line.input] {
        set(&mut machine, pin, mode, function);
    }
    let usart = USARTS[line.port as usize];
    machine.write_word(usart + 0x08, 16).unwrap();
    machine.write_word(usart + 0x0C, 0x200C).unwrap();
    machine.uart_send(line, b"?");
    machine.write_word(usart + 0x04, 0x21).unwrap();
    machine.run_until(machine.cycle() + 1000).unwrap();
    let arrived = machine.read_word(usart).unwrap() & 1 << 5 != 0;
    (machine.uart_out(line).len(), arrived)
}

#[test]
fn bytes_move_only_at_pins_with_the_function_of_their_port() {
    for (port, output, input, right) in LINES {
        let line = SerialLine {
            port,
            output: pin(output),
            input: pin(input),
        };
        for (mode, function) in (0..4).flat_map(|mode| (0..16).map(move |f| (mode, f))) {
            let expected = mode == ALTERNATE && function == right;
            assert_eq!(
                moved(line, mode, function),
                (usize::from(expected), expected),
                "{port:?} at {output} and {input}, mode {mode}, function {function}"
            );
        }
    }
}

#[test]
fn bytes_do_not_come_to_another_pin_of_the_port() {
    for (port, output, input, right) in LINES {
        for (_, other_output, other_input, _) in LINES.iter().filter(|line| line.0 == port) {
            let mut machine = machine(&[]);
            let line = SerialLine {
                port,
                output: pin(output),
                input: pin(input),
            };
            machine.plug_serial(line);
            set(&mut machine, pin(other_output), ALTERNATE, right);
            set(&mut machine, pin(other_input), ALTERNATE, right);
            let usart = USARTS[port as usize];
            machine.write_word(usart + 0x08, 16).unwrap();
            machine.write_word(usart + 0x0C, 0x200C).unwrap();
            machine.uart_send(line, b"?");
            machine.write_word(usart + 0x04, 0x21).unwrap();
            machine.run_until(machine.cycle() + 1000).unwrap();
            let arrived = machine.read_word(usart).unwrap() & 1 << 5 != 0;
            let sent = machine.uart_out(line).len() == 1;
            let same = (*other_output == output, *other_input == input);
            assert_eq!((sent, arrived), same);
        }
    }
}

#[test]
fn an_output_that_cannot_rise_sends_nothing_and_two_inputs_hear_nothing() {
    let (output, input, second) = (pin("A9"), pin("A10"), pin("B7"));
    let mut machine = machine(&[]);
    machine.plug_serial(SerialLine {
        port: SerialPort::Usart1,
        output,
        input,
    });
    let sees = |machine: &Machine| {
        let usart = &machine.devices.usarts[0];
        (usart.connected().output, usart.connected().input)
    };
    set(&mut machine, output, ALTERNATE, 7);
    set(&mut machine, input, ALTERNATE, 7);
    assert_eq!(sees(&machine), (true, true));
    machine.write_word(0x4002_0004, 1 << 9).unwrap();
    assert_eq!(sees(&machine), (false, true), "open drain");
    machine
        .write_word(0x4002_000C, 0x6400_0000 | 1 << 18)
        .unwrap();
    assert_eq!(sees(&machine), (true, true), "with a pull-up");
    set(&mut machine, second, ALTERNATE, 7);
    assert_eq!(sees(&machine), (true, false));
}

#[test]
fn usb_needs_both_of_its_pins() {
    let mut machine = machine(&[]);
    let [minus, plus] = [pin("A11"), pin("A12")];
    set(&mut machine, minus, ALTERNATE, 10);
    assert!(!machine.devices.usb.connected);
    set(&mut machine, plus, ALTERNATE, 10);
    assert!(machine.devices.usb.connected);
    for (mode, function) in [(0, 10), (1, 10), (3, 10), (ALTERNATE, 9)] {
        set(&mut machine, minus, mode, function);
        assert!(!machine.devices.usb.connected, "{mode} {function}");
        set(&mut machine, minus, ALTERNATE, 10);
    }
}

#[test]
fn a_converted_pin_has_to_be_analog() {
    let sensor = pin("B0");
    let mut machine = machine(&[]);
    machine.analog(sensor, 1.0);
    let convert = |machine: &mut Machine| {
        for (register, value) in [(0x38, 8 << 15), (0x08, 1), (0x08, 1)] {
            machine.write_word(0x4001_2000 + register, value).unwrap();
        }
        machine.run_until(machine.cycle() + 1000).unwrap();
        machine.write_word(0x4001_2008, 1 | 1 << 22).unwrap();
        machine.run_until(machine.cycle() + 1000).unwrap();
        machine.read_word(0x4001_203C).unwrap()
    };
    set(&mut machine, sensor, 3, 0);
    assert_eq!(convert(&mut machine), 4095);
    assert_eq!(machine.warnings(), []);
    set(&mut machine, sensor, 0, 0);
    assert_eq!(convert(&mut machine), 0);
    assert_eq!(machine.warnings(), [Warning::PinNotAnalog]);
}
