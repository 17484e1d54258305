//! The boards that come with the firmware have no mistakes; one mistake in a board is found.
use leadscrew_boards::{Board, Drive, MotorSocket, Needs, NoRecord, Socket, Unfit, BOARDS};

/// The step pin of a motor with a driver.
fn step(motor: &MotorSocket) -> String {
    match motor.drive {
        Drive::Driver { step, .. } => step.to_string(),
        Drive::Windings(_) => panic!("{motor:?} has no driver"),
    }
}

fn board(name: &str) -> &'static str {
    BOARDS.iter().find(|(one, _)| *one == name).unwrap().1
}

/// The findings on a board in which one text was replaced by another.
fn findings(name: &str, from: &str, to: &str) -> Vec<String> {
    let text = board(name);
    assert!(text.contains(from), "{name} has no {from}");
    match Board::read(&text.replacen(from, to, 1)) {
        Ok(board) => board.check().iter().map(ToString::to_string).collect(),
        Err(error) => vec![error],
    }
}

#[test]
fn every_board_that_comes_with_the_firmware_is_right() {
    for (name, text) in BOARDS {
        let board = Board::read(text).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(board.check(), [], "{name}");
        assert!(board.sources.iter().all(|source| !source.is_empty()));
    }
    assert!(BOARDS.is_sorted_by_key(|(name, _)| name));
}

#[test]
fn settings_may_lie_at_the_end_of_the_flash() {
    let found = findings("discovery", "settings = [1, 2]", "settings = [10, 11]");
    assert_eq!(found, [""; 0]);
}

/// The findings on a Discovery with its serial line on USART1 and these wires. The pins for
/// captures are listed in `at`.
fn wired(wires: &[(&str, &str)]) -> Vec<String> {
    let tables = wires
        .iter()
        .map(|(from, to)| format!("[[wire]]\nfrom = \"{from}\"\nto = \"{to}\"\n"));
    let serial = "usart = 1\ntransmit = \"PA9\"\nreceive = \"PA10\"";
    let text = board("discovery")
        .replacen(
            "usart = 2\ntransmit = \"PA2\"\nreceive = \"PA3\"",
            serial,
            1,
        )
        .replacen(
            "PA2 = \"header P1\"\nPA3 =",
            "PA9 = \"P2\"\nPA10 = \"P2\"\nPA3 =",
            1,
        );
    let at = text.find("[at]").unwrap();
    let text = format!(
        "{}{}{}",
        &text[..at],
        tables.collect::<String>(),
        &text[at..]
    );
    let board = Board::read(&text).unwrap();
    board.check().iter().map(ToString::to_string).collect()
}

#[test]
fn a_wire_leads_from_an_output_to_a_capture_or_to_an_input() {
    let right = [("PE7", "PA3"), ("PD15", "PC8")];
    assert_eq!(wired(&right), [""; 0]);
    let cases = [
        (("PC1", "PA3"), "PC1 is no output of the board"),
        (
            ("PE7", "PE2"),
            "PE2 is neither an input nor channel 2, 3 or 4 of TIM2",
        ),
        (
            ("PE7", "PA1"),
            "`at` does not say where PA1 is on the board",
        ),
    ];
    for (wire, expected) in cases {
        let found = wired(&[("PE8", "PA3"), wire]);
        assert!(found.iter().any(|one| one.contains(expected)), "{found:?}");
    }
    let seven = wired(&[("PE7", "PC8"); 7]);
    assert!(seven.iter().any(|one| one.contains("7 of them, 6 at most")));
    let beside_usart_2 = findings(
        "discovery",
        "[at]",
        "[[wire]]\nfrom = \"PE7\"\nto = \"PB11\"\n[at]\nPB11 = \"P1\"",
    );
    assert_eq!(beside_usart_2.len(), 1);
    assert!(beside_usart_2[0].contains("stream 6 of DMA1 is the serial line's"));
}

/// A text in the Discovery's file, the text that replaces it, and a part of the expected message.
const WRONG: &[(&str, &str, &str)] = &[
    (
        "reference = 3.0",
        "reference = nan",
        "reference: NaN V, expected a finite number",
    ),
    (
        "reference = 3.0",
        "reference = -3.0",
        "reference: -3 V, expected a finite number",
    ),
    // A pin that is used twice, one that the chip lacks, one of USB, one of the debug port, and
    // one without a place on the board.
    (
        r#"step = "PE8""#,
        r#"step = "PE7""#,
        "PE7: step of motor 1, and step of motor 2",
    ),
    (r#"step = "PE8""#, r#"step = "PF8""#, "the chip has no PF8"),
    (r#"step = "PE8""#, r#"step = "PA11""#, "PA11 is USB's"),
    (
        r#"step = "PE8""#,
        r#"step = "PA14""#,
        "PA14 is the debug port's",
    ),
    (
        r#"step = "PE8""#,
        r#"step = "PB2""#,
        "`at` does not say where PB2 is",
    ),
    // Two inputs on one EXTI line; a function that the pin does not have.
    (
        r#"probe = { pin = "PC1" }"#,
        r#"probe = { pin = "PC4" }"#,
        "on line 4 of EXTI",
    ),
    (
        r#"transmit = "PA2""#,
        r#"transmit = "PA9""#,
        "PA9 cannot be USART2_TX",
    ),
    ("usart = 2", "usart = 3", "USART3 is not 1 or 2"),
    (
        r#"pin = "PB5", sensor = "PB0""#,
        r#"pin = "PB5", sensor = "PB2""#,
        "PB2 is no channel of ADC1",
    ),
    (
        "channel = 1",
        "channel = 2",
        "PD12 cannot be channel 2 of TIM4",
    ),
    ("timer = 4", "timer = 2", "TIM2 is not one of"),
    (
        "frequency = 10_000",
        "frequency = 200_000",
        "200000 Hz are not",
    ),
    // Mistakes in clock and flash.
    (
        "crystal = 8_000_000",
        "crystal = 11_059_200",
        "do not make 168 MHz",
    ),
    (
        "settings = [1, 2]",
        "settings = [1, 3]",
        "one behind the other",
    ),
    (
        "start = 0x0800_0000",
        "start = 0x0800_1000",
        "no sector begins",
    ),
    // Motors of two kinds; a motor of neither kind; the lines of a motor on two ports.
    (
        r#"step = "PE8"
direction = "PE11""#,
        r#"lines = ["PE8", "PE11", "PE2", "PE3", "PE1"]"#,
        "motor 1: a driver, and others have lines",
    ),
    (
        r#"direction = "PE11""#,
        "",
        "a motor has `step` and `direction`, or `lines`",
    ),
    (
        r#"step = "PE8"
direction = "PE11""#,
        r#"lines = ["PE8", "PE11", "PA3", "PE3", "PE1"]"#,
        "motor 2: its lines are on more than one port",
    ),
    // Texts that do not describe a board.
    (r#"step = "PE8""#, r#"step = "E8""#, "is no pin"),
    ("crystal", "cristal", "unknown field `cristal`"),
];

#[test]
fn a_wrong_board_is_told_what_is_wrong() {
    for (from, to, expected) in WRONG {
        let found = findings("discovery", from, to);
        let told = found.iter().any(|finding| finding.contains(expected));
        assert!(told, "{to}: {found:?}");
    }
}

#[test]
fn settings_inside_a_bootloader_are_refused() {
    let found = findings("skr-2", "settings = [10, 11]", "settings = [0, 1]");
    assert!(
        found.iter().any(|one| one.contains("bootloader")),
        "{found:?}"
    );
}

#[test]
fn a_second_motor_is_ganged_and_crossed_belts_have_none() {
    let dual = Board::read(board("skr-2-dual-y")).unwrap();
    let dual = dual.machine_module();
    assert!(
        dual.contains("Ganged<1>") && dual.contains("axis_of: [1]"),
        "{dual}"
    );
    let found = findings(
        "skr-2-dual-y",
        "[serial]",
        "kinematics = \"core-xy\"\n[serial]",
    );
    let refused = |one: &String| one.contains("crossed belts") || one.contains("kinematics");
    assert!(found.iter().any(refused), "{found:?}");
}

#[test]
fn the_program_goes_where_the_settings_are_not() {
    let memory = |name| Board::read(board(name)).unwrap().memory();
    let discovery = memory("discovery");
    assert!(
        discovery.contains("0x08000000, LENGTH = 1024K"),
        "{discovery}"
    );
    assert!(discovery.contains("_stext = ORIGIN(FLASH) + 0xC000;"));
    let skr = memory("skr-2");
    assert!(
        skr.contains("0x08008000, LENGTH = 736K") && !skr.contains("_stext"),
        "{skr}"
    );
    let nano = memory("robin-nano-v3");
    assert!(
        nano.contains("0x0800C000, LENGTH = 720K") && !nano.contains("_stext"),
        "{nano}"
    );
}

#[test]
fn the_debug_port_can_be_given_up_with_a_warning() {
    // As the X end stop of an MKS Monster8.
    let text = board("discovery")
        .replace("limit = { pin = \"PE4\" }", "limit = { pin = \"PA14\" }")
        .replace("PE4 = \"header P2\"", "PA14 = \"header P2\"");
    let kept = Board::read(&text).unwrap();
    let findings: Vec<String> = kept.check().iter().map(ToString::to_string).collect();
    assert_eq!(findings.len(), 1, "{findings:?}");
    assert!(findings[0].contains("gives-up-debug-port = true"));
    let text = text.replace("[1, 2]", "[1, 2]\ngives-up-debug-port = true");
    let given_up = Board::read(&text).unwrap();
    assert_eq!(given_up.check(), []);
    let warnings: Vec<String> = given_up
        .warnings()
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].starts_with("limit of motor 1: PA14 is the debug port's"));
    // USB's pins cannot be given up.
    let usb = Board::read(&text.replace("PA14", "PA11")).unwrap();
    let first = usb.check().first().map(ToString::to_string);
    assert_eq!(first.as_deref(), Some("limit of motor 1: PA11 is USB's"));
}

#[test]
fn the_room_for_a_program_follows_from_the_sectors() {
    for (name, end, chip, pins) in [
        ("discovery", "0x08100000", "0x100000", 100),
        ("skr-2", "0x080C0000", "0x100000", 100),
        ("robin-nano-v3", "0x080C0000", "0x100000", 100),
        ("octopus", "0x08040000", "0x80000", 144),
        ("spider", "0x08040000", "0x80000", 100),
        ("black-f407ve", "0x08080000", "0x80000", 100),
        ("fly-super8", "0x080C0000", "0x100000", 144),
    ] {
        let board = Board::read(board(name)).unwrap();
        let ends = |memory: String| {
            let says = |line: String| assert!(memory.contains(&line), "{name}: {line} {memory}");
            says(format!("__flash_end = {end};"));
            says(format!("__chip_flash = {chip};"));
            says(format!("__chip_pins = {pins};"));
        };
        ends(board.memory());
        ends(board.record_memory(false).unwrap());
        ends(board.record_memory(true).unwrap());
    }
    let behind_32 = Board::read(board("octopus")).unwrap();
    let [three, four] = [false, true].map(|four| behind_32.record_memory(four).unwrap());
    let front = "FRONT    : ORIGIN = 0x08008200, LENGTH = 15872";
    assert!(three.contains(front), "{three}");
    assert!(!four.contains("FRONT"), "{four}");
}

#[test]
fn each_output_is_safe_at_the_level_at_which_it_is_off() {
    let outputs = [
        ("PD12", "pin = \"PD12\"", "active"),
        ("PD13", "spindle = { pin = \"PD13\"", "on"),
        ("PD14", "spindle-reverse = { pin = \"PD14\"", "on"),
        ("PD15", "flood = { pin = \"PD15\"", "on"),
        ("PD11", "mist = { pin = \"PD11\"", "on"),
        ("PB12", "outputs = [{ pin = \"PB12\"", "on"),
        ("PB13", "{ pin = \"PB13\"", "on"),
        ("PB5", "heaters = [{ pin = \"PB5\"", "on"),
        ("PB8", "{ pin = \"PB8\"", "on"),
        ("PD9", "heater-supply = { pin = \"PD9\"", "on"),
        ("PB7", "fan = { pin = \"PB7\"", "on"),
    ];
    for (pin, words, key) in outputs {
        for (on, safe) in [("high", "low"), ("low", "high")] {
            let with = match key {
                "active" => format!("{words}\n{key} = \"{on}\""),
                _ => format!("{words}, {key} = \"{on}\""),
            };
            let text = board("discovery");
            assert_eq!(text.matches(words).count(), 1, "{words}");
            let board = Board::read(&text.replace(words, &with)).unwrap();
            assert_eq!(board.check(), [], "{with}");
            let levels = board.safe_levels();
            let found = levels.iter().filter(|(one, _)| one.to_string() == pin);
            let found: Vec<String> = found.map(|(_, level)| format!("{level:?}")).collect();
            assert_eq!(found.join(" ").to_lowercase(), safe, "{with}");
        }
    }
    // Motors: six with step and direction, low; nothing else.
    let board = Board::read(board("discovery")).unwrap();
    assert_eq!(board.safe_levels().len(), outputs.len() + 12);
}

#[test]
fn a_record_says_at_which_level_power_is_on() {
    let power = |active: &str| {
        let text = board("discovery").replace("pin = \"PD12\"", active);
        let record = Board::read(&text).unwrap().record().unwrap();
        let (record, _) = leadscrew_record::Record::read(&record).unwrap();
        let content = record.content;
        let port = content.safe.ports().iter().find(|one| one.port.get() == 3);
        let is_safe_high = port.unwrap().levels.get() >> 12 & 1 == 1;
        (content.power.pin.high(), is_safe_high)
    };
    assert_eq!(power("pin = \"PD12\""), (true, false));
    assert_eq!(power("pin = \"PD12\"\nactive = \"low\""), (false, true));
}

/// An Octopus with one output for M62 to M65, and spare motors.
fn with_an_output() -> Board {
    let text = board("octopus")
        .replace("[sockets]", "[sockets]\noutputs = [{ pin = \"PG12\" }]")
        .replace("[at]", "[at]\nPG12 = \"stop 4\"");
    Board::read(&text).unwrap()
}

#[test]
fn a_machine_uses_sockets_that_are_there() {
    let one = Needs {
        motors: vec![None; 3],
        outputs: 1,
        ..Needs::default()
    };
    let board = with_an_output();
    assert_eq!(board.check(), []);
    let used = board.fitted(&one).unwrap().pins_module();
    assert!(used.contains("synchronised: &[crate::gpio::Output { pin: Pin::new(Bank::G, 12)"));
    assert!(board.bare().pins_module().contains("synchronised: &[],"));
    let refused = |change: fn(&mut Needs), words: &str| {
        let mut needs = one.clone();
        change(&mut needs);
        let why = board.fitted(&needs).unwrap_err().to_string();
        assert!(why.contains(words), "{why}");
    };
    refused(
        |needs| needs.motors = vec![None; 7],
        "the machine has 7 motors, the board drives 6",
    );
    refused(|needs| needs.outputs = 2, "the machine has 2 outputs");
    refused(|needs| needs.tool = true, "no `sockets.tool`");
    refused(|needs| needs.heaters = 1, "the machine has 1 heaters");
    refused(
        |needs| needs.heater_supply = true,
        "no `sockets.heater-supply`",
    );
    refused(
        |needs| needs.heater_fault = true,
        "no `sockets.heater-fault`",
    );
    refused(|needs| needs.fan = true, "no `sockets.fan`");
}

#[test]
fn a_machine_s_motors_are_plugged_in_where_its_file_says() {
    let board = Board::read(board("discovery")).unwrap();
    let at = |motors: Vec<Option<Socket>>| {
        let fitted = board.fitted(&Needs {
            motors,
            ..Needs::default()
        });
        fitted.map(|board| {
            let sockets = board.motor_sockets().collect::<Vec<MotorSocket>>();
            sockets.iter().map(step).collect::<Vec<String>>()
        })
    };
    assert_eq!(at(vec![None; 3]).unwrap(), ["PE7", "PE8", "PE9"]);
    let swapped = vec![Some(Socket::Spare), None, None, Some(Socket::X)];
    assert_eq!(at(swapped).unwrap(), ["PE14", "PE8", "PE9", "PE7"]);
    let shared = at(vec![Some(Socket::Y), None, None]).unwrap_err();
    assert_eq!(shared, Unfit::Shared(Socket::Y));
    let six = ["PE7", "PE8", "PE9", "PE14", "PD0", "PD2"];
    assert_eq!(at(vec![None; 6]).unwrap(), six);
    assert!(matches!(
        at(vec![None; 7]),
        Err(Unfit::Motors { needs: 7, has: 6 })
    ));
}

#[test]
fn a_printer_s_four_motors_and_two_heaters_fit_the_robin_nano() {
    let board = Board::read(board("robin-nano-v3")).unwrap();
    let needs = Needs {
        motors: vec![None; 4],
        heaters: 2,
        ..Needs::default()
    };
    let printer = board.fitted(&needs).unwrap();
    assert_eq!(step(&printer.sockets.motors[0]), "PD6");
    let heaters = printer.sockets.heaters.iter();
    let pins = heaters.map(|one| (one.pin.to_string(), one.sensor.to_string()));
    assert_eq!(
        pins.collect::<Vec<(String, String)>>(),
        [("PE5", "PC1"), ("PA0", "PC0")].map(|(pin, sensor)| (pin.into(), sensor.into()))
    );
}

#[test]
fn a_board_with_motors_of_its_own_kind_takes_no_machine() {
    let dual = Board::read(board("skr-2-dual-y")).unwrap();
    let needs = Needs {
        motors: vec![None; 3],
        ..Needs::default()
    };
    assert_eq!(dual.fitted(&needs).unwrap_err(), Unfit::Kinematics);
}

#[test]
fn motors_without_drivers_and_a_fifth_motor_have_no_record() {
    let windings = Board::read(board("machine-001")).unwrap();
    assert!(windings.switches_windings());
    assert_eq!(windings.record(), Err(NoRecord::Motors));
    let needs = Needs {
        motors: vec![None; 5],
        ..Needs::default()
    };
    let discovery = Board::read(board("discovery")).unwrap();
    let five = discovery.fitted(&needs).unwrap();
    assert_eq!(five.record_for(&five.machine()), Err(NoRecord::Motors));
}

#[test]
fn a_record_is_the_one_that_was_worked_out_by_hand() {
    let text = include_str!("../../record/tests/discovery.hex");
    let hex = text.lines().filter_map(|line| line.split('#').next());
    let expected: Vec<u8> = hex
        .flat_map(str::split_whitespace)
        .map(|byte| u8::from_str_radix(byte, 16).unwrap())
        .collect();
    let board = Board::read(board("discovery")).unwrap();
    assert_eq!(board.record().unwrap(), expected);
}

#[test]
fn every_board_with_drivers_has_a_record_in_a_sector_of_its_own() {
    let boards = BOARDS.map(|(name, text)| (name, Board::read(text).unwrap()));
    let with_drivers = boards.iter().filter(|(_, one)| !one.switches_windings());
    assert_eq!(with_drivers.clone().count(), BOARDS.len() - 1);
    for (name, board) in with_drivers {
        let record = board.record().unwrap();
        assert!(leadscrew_record::Record::read(&record).is_ok(), "{name}");
        let begin = match board.start {
            0x0800_C000 => 0x0801_0000,
            _ => 0x0800_C000,
        };
        assert_eq!(board.record_sector().unwrap().begin, begin, "{name}");
        let end = match *name {
            "discovery" | "machine-003" => 0x0810_0000,
            "black-f407ve" => 0x0808_0000,
            "octopus" | "spider" => 0x0804_0000,
            _ => 0x080C_0000,
        };
        assert_eq!(board.record_end(), Some(end), "{name}");
    }
    let with = |settings: &str| board("discovery").replace("settings = [1, 2]", settings);
    for (settings, end) in [
        ("settings = [1, 2]", Some(0x0810_0000)),
        ("settings = [2, 3]", None),
        ("settings = [4, 5]", None),
        ("settings = [5, 6]", None),
        ("settings = [6, 7]", Some(0x0804_0000)),
        ("settings = [10, 11]", Some(0x080C_0000)),
        ("settings = [12, 13]", None),
    ] {
        let board = Board::read(&with(settings)).unwrap();
        assert_eq!(board.record_end(), end, "{settings}");
    }
}
