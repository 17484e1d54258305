//! Records are read as they were made; one that is wrong is refused by its fault.
use leadscrew_record::{
    Content, Image, Motor, Outputs, PinCode, Power, Record, Refusal, SafeTable, Serial, Setting,
    Shape, ENABLES, NAME, SETTINGS, SLOT,
};
use proptest::prelude::*;

/// A pin or none.
fn pin() -> impl Strategy<Value = PinCode> {
    (0..8u8, 0..16u8, any::<bool>())
        .prop_map(|(port, number, high)| PinCode::new(port, number, high).unwrap_or(PinCode::NONE))
}

fn pins<const N: usize>() -> impl Strategy<Value = [PinCode; N]> {
    proptest::array::uniform(pin())
}

prop_compose! {
    fn content()(
        hz in any::<[u32; 2]>(),
        bytes in any::<[u8; 12]>(),
        all in pins::<12>(),
        enables in pins::<ENABLES>(),
        others in pins::<12>(),
        name in any::<[u8; NAME]>(),
        safe in proptest::collection::vec((0..7u8, 0..16u8, any::<bool>()), 0..40),
        defaults in 0..=SETTINGS as u8,
    ) -> Content {
        let mut other = others.into_iter();
        let mut next = || other.next().unwrap();
        let motor = |at: usize| Motor { step: all[at], direction: all[at + 1], limit: all[at + 2] };
        Content {
            crystal_hz: hz[0].into(),
            power_hz: hz[1].into(),
            safe: SafeTable::new(safe.into_iter()),
            shape: Shape { axes: bytes[0], motors: bytes[1], kinematics: bytes[2], defaults },
            settings: [bytes[3], bytes[4]],
            serial: Serial { usart: bytes[5], transmit: next(), receive: next() },
            power: Power { pin: next(), function: bytes[6], timer: bytes[7], channel: bytes[8] },
            motors: [0, 3, 6, 9].map(motor),
            enables,
            outputs: Outputs {
                spindle: next(),
                spindle_reverse: next(),
                flood: next(),
                mist: next(),
            },
            buttons: [0; 5].map(|_| next()),
            homing: [bytes[9], bytes[10], bytes[11], 0],
            name,
            rotary: bytes[9],
            without_switch: bytes[10],
            reserved: [0; 4],
        }
    }
}

fn settings(count: u8) -> Vec<Setting> {
    let setting = |number: u8| Setting {
        number: u16::from(number).into(),
        reserved: [0; 6],
        nanos: (i64::from(number) * -1_234_567_891).into(),
    };
    (0..count).map(setting).collect()
}

proptest! {
    #[test]
    fn a_record_is_read_as_it_was_made(content in content()) {
        let defaults = settings(content.shape.defaults);
        let mut bytes = [0; SLOT];
        let length = Record::pack(&content, &defaults, &mut bytes).unwrap();
        let (record, read) = Record::read(&bytes).unwrap();
        prop_assert_eq!((record.content, read), (content, &defaults[..]));
        prop_assert!(Record::read(&bytes[..length]).is_ok());
        prop_assert!(bytes[length..].iter().all(|byte| *byte == 0xFF));
    }

    #[test]
    fn a_record_with_a_wrong_bit_is_refused(content in content(), at in any::<usize>(), bit in 0..8) {
        let mut bytes = [0; SLOT];
        let defaults = settings(content.shape.defaults);
        let length = Record::pack(&content, &defaults, &mut bytes).unwrap();
        bytes[at % length] ^= 1u8 << bit;
        prop_assert!(Record::read(&bytes).is_err());
    }

    #[test]
    fn no_bytes_are_too_strange(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(Record::read(&bytes).is_err());
        let magic = [b"LSBR".as_slice(), &bytes].concat();
        prop_assert!(Record::read(&magic).is_err());
    }
}

/// Bytes that are all right but for what `change` does to them.
fn refusal(change: impl Fn(&mut Vec<u8>)) -> Option<Refusal> {
    let text = include_str!("discovery.hex");
    let hex = text.lines().filter_map(|line| line.split('#').next());
    let digits: String = hex.flat_map(str::split_whitespace).collect();
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap();
    let mut bytes: Vec<u8> = (0..digits.len()).step_by(2).map(byte).collect();
    change(&mut bytes);
    Record::read(&bytes).err()
}

#[test]
fn a_fault_is_told_by_its_name() {
    assert_eq!(refusal(|_| ()), None);
    for (place, value, expected) in [
        (0, b'X', Refusal::Missing),
        (8, 1, Refusal::Version),
        (8, 4, Refusal::Version),
        (10, 0xC1, Refusal::Length),
        (11, 0xFF, Refusal::Length),
        (111, 1, Refusal::Length),
        (4, 0, Refusal::Checksum),
        (122, 0x4F, Refusal::Checksum),
    ] {
        let found = refusal(|bytes| bytes[place] = value);
        assert_eq!(found, Some(expected), "byte {place}");
    }
    assert_eq!(refusal(|bytes| bytes.truncate(191)), Some(Refusal::Missing));
    assert_eq!(refusal(Vec::clear), Some(Refusal::Missing));
}

#[test]
fn only_a_power_that_is_on_while_low_needs_a_newer_reader() {
    let version = |high| {
        let mut content = discovery();
        content.power.pin = PinCode::new(3, 12, high).unwrap();
        let mut bytes = [0; SLOT];
        assert!(Record::pack(&content, &[], &mut bytes).is_some());
        assert_eq!(Record::read(&bytes).unwrap().0.content, content);
        u16::from_le_bytes([bytes[8], bytes[9]])
    };
    assert_eq!([version(true), version(false)], [2, 3]);
}

#[test]
fn another_machine_or_place_is_refused() {
    let mut bytes = [0; SLOT];
    let made = Record::pack(&discovery(), &[], &mut bytes);
    assert!(made.is_some());
    let content = Record::read(&bytes).unwrap().0.content;
    for image in [Image::Three, Image::Four] {
        assert_eq!(content.fits(image, 0, 6), Ok(()));
        assert_eq!(content.fits(image, 2, 6), Err(Refusal::Sectors));
    }
    for (axes, motors, kinematics) in [(3, 4, 3), (4, 4, 0), (3, 3, 1)] {
        let shape = Shape {
            axes,
            motors,
            kinematics,
            defaults: 0,
        };
        let other = Content { shape, ..content };
        assert_eq!(other.fits(Image::Three, 0, 6), Err(Refusal::Shape));
        assert_eq!(other.fits(Image::Four, 0, 6), Ok(()));
    }
}

#[test]
fn an_image_of_four_motors_takes_every_machine_that_they_can_move() {
    let takes = |axes, motors, kinematics| {
        let defaults = 7;
        Image::Four.takes(&Shape {
            axes,
            motors,
            kinematics,
            defaults,
        })
    };
    for (axes, motors, kinematics) in [(3, 3, 0), (3, 3, 1), (3, 4, 3), (4, 4, 0), (4, 4, 1)] {
        assert!(
            takes(axes, motors, kinematics),
            "{axes} {motors} {kinematics}"
        );
    }
    for (axes, motors, kinematics) in [
        (2, 2, 0),
        (3, 4, 0),
        (3, 3, 2),
        (3, 4, 5),
        (4, 3, 0),
        (4, 5, 2),
        (5, 5, 0),
        (255, 0, 2),
        (3, 4, 255),
    ] {
        assert!(
            !takes(axes, motors, kinematics),
            "{axes} {motors} {kinematics}"
        );
    }
}

/// Three motors and no pins; settings in sectors 1 and 2.
fn discovery() -> Content {
    Content {
        shape: Shape {
            axes: 3,
            motors: 3,
            kinematics: 0,
            defaults: 0,
        },
        settings: [1, 2],
        ..Content::NONE
    }
}
