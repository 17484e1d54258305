//! The demands of a strict host on a device's descriptors (USB 2.0 chapter 9, CDC 1.2 section 5):
//! an operating system that believes a wrong length reads past the end, or refuses the device.

/// Types of descriptors (USB 2.0 table 9-5, the ECN for interface associations, CDC 1.2 table 12).
const DEVICE: u8 = 1;
const CONFIGURATION: u8 = 2;
const STRING: u8 = 3;
const INTERFACE: u8 = 4;
const ENDPOINT: u8 = 5;
const ASSOCIATION: u8 = 11;
const FUNCTIONAL: u8 = 0x24;
/// The largest packet of a full-speed bulk or interrupt endpoint, bytes (sections 5.7.3 and 5.8.3).
const LARGEST_PACKET: u16 = 64;

/// The fault that was found, if there is one.
pub(super) type Fault = Option<&'static str>;

fn word(bytes: &[u8], at: usize) -> Option<u16> {
    let pair = bytes.get(at..at + 2)?;
    Some(u16::from_le_bytes([pair[0], pair[1]]))
}

/// The first fault of a list of rules that must hold.
fn broken(rules: &[(bool, &'static str)]) -> Fault {
    let first = rules.iter().find(|(holds, _)| !holds);
    first.map(|(_, rule)| *rule)
}

/// Checks a device descriptor (table 9-8).
pub(super) fn device(bytes: &[u8]) -> Fault {
    let at = |place: usize| bytes.get(place).copied().unwrap_or(0);
    broken(&[
        (bytes.len() == 18, "18 bytes of device descriptor"),
        (at(0) == 18, "bLength of the device descriptor"),
        (at(1) == DEVICE, "bDescriptorType of the device descriptor"),
        (
            matches!(at(7), 8 | 16 | 32 | 64),
            "bMaxPacketSize0 of 8, 16, 32 or 64",
        ),
        (at(17) >= 1, "bNumConfigurations"),
    ])
}

/// The numbers of the strings that a device descriptor names: maker, product, serial number.
pub(super) fn strings(device: &[u8]) -> impl Iterator<Item = u8> + '_ {
    let named = device.get(14..17).unwrap_or(&[]);
    named.iter().copied().filter(|&number| number != 0)
}

/// Checks a string descriptor, or the list of languages (tables 9-15 and 9-16).
pub(super) fn string(bytes: &[u8]) -> Fault {
    let [length, kind, rest @ ..] = bytes else {
        return Some("a string descriptor");
    };
    broken(&[
        (
            usize::from(*length) == bytes.len(),
            "bLength of a string descriptor",
        ),
        (*kind == STRING, "bDescriptorType of a string descriptor"),
        (
            !rest.is_empty() && rest.len() % 2 == 0,
            "whole characters in a string",
        ),
    ])
}

/// An interface, as far as it has been read.
#[derive(Clone, Copy)]
struct Interface {
    number: u8,
    alternate: u8,
    /// The endpoints that it announces, and has still to describe.
    missing: u8,
}

/// The part of a configuration that has been read.
#[derive(Default)]
struct Reading {
    interfaces: Vec<Interface>,
    endpoints: Vec<u8>,
    associated: u8,
}

impl Reading {
    /// Takes a descriptor; `body` begins with its length and type.
    fn take(&mut self, body: &[u8]) -> Fault {
        match body[1] {
            INTERFACE => self.interface(body),
            ENDPOINT => self.endpoint(body),
            ASSOCIATION if body.len() == 8 => {
                self.associated = self.associated.max(body[2].saturating_add(body[3]));
                None
            }
            ASSOCIATION => Some("bLength of an interface association"),
            FUNCTIONAL => self.functional(body),
            _ => Some("a descriptor of a known type"),
        }
    }

    fn interface(&mut self, body: &[u8]) -> Fault {
        let [_, _, number, alternate, missing, _, _, _, _] = *body else {
            return Some("bLength of an interface");
        };
        let is_next = match self.interfaces.last() {
            None => (number, alternate) == (0, 0),
            Some(last) if last.missing > 0 => return Some("bNumEndpoints"),
            Some(last) if number == last.number => alternate == last.alternate + 1,
            Some(last) => (number, alternate) == (last.number + 1, 0),
        };
        self.interfaces.push(Interface {
            number,
            alternate,
            missing,
        });
        broken(&[(is_next, "interfaces and their settings numbered from 0")])
    }

    fn endpoint(&mut self, body: &[u8]) -> Fault {
        let [_, _, address, attributes, ..] = *body else {
            return Some("bLength of an endpoint");
        };
        let Some(interface) = self.interfaces.last_mut().filter(|one| one.missing > 0) else {
            return Some("bNumEndpoints");
        };
        interface.missing -= 1;
        let repeated = interface.alternate == 0 && self.endpoints.contains(&address);
        self.endpoints.push(address);
        let largest = word(body, 4).unwrap_or(0);
        let (is_bulk, is_interrupt) = (attributes & 3 == 2, attributes & 3 == 3);
        broken(&[
            (body.len() == 7, "bLength of an endpoint"),
            (address & 0x70 == 0 && address & 15 != 0, "bEndpointAddress"),
            (!repeated, "an endpoint described once"),
            (is_bulk || is_interrupt, "bmAttributes of an endpoint"),
            (
                !is_bulk || matches!(largest, 8 | 16 | 32 | LARGEST_PACKET),
                "wMaxPacketSize of a bulk endpoint",
            ),
            (
                !is_interrupt || (1..=LARGEST_PACKET).contains(&largest),
                "wMaxPacketSize of an interrupt endpoint",
            ),
            (
                !is_interrupt || body.get(6) != Some(&0),
                "bInterval of an interrupt endpoint",
            ),
        ])
    }

    /// The functional descriptors of a communications device (CDC 1.2 tables 15 to 18, PSTN 1.2
    /// tables 3 and 4).
    fn functional(&mut self, body: &[u8]) -> Fault {
        let length = match body.get(2) {
            Some(0) => Some(5), // header
            Some(1) => Some(5), // call management
            Some(2) => Some(4), // abstract control management
            _ => None,
        };
        let fits = length.is_none_or(|length| body.len() == length);
        broken(&[(fits, "bLength of a functional descriptor")])
    }
}

/// Checks a configuration with all that belongs to it (tables 9-10 to 9-13).
pub(super) fn configuration(bytes: &[u8]) -> Fault {
    let head = bytes.get(..9).unwrap_or(&[]);
    let at = |place: usize| head.get(place).copied().unwrap_or(0);
    let wrong_head = broken(&[
        (head.len() == 9, "9 bytes of configuration descriptor"),
        (at(0) == 9, "bLength of the configuration"),
        (
            at(1) == CONFIGURATION,
            "bDescriptorType of the configuration",
        ),
        (
            word(head, 2).map(usize::from) == Some(bytes.len()),
            "wTotalLength",
        ),
        (at(5) == 1, "bConfigurationValue of 1"),
        (at(7) & 0x9F == 0x80, "the reserved bits of bmAttributes"),
        (at(8) <= 250, "bMaxPower of 500 mA at most"),
    ]);
    let mut reading = Reading::default();
    let mut rest = bytes.get(9..).unwrap_or(&[]);
    while let (None, [length, ..]) = (wrong_head, rest) {
        let length = usize::from(*length);
        let Some(body) = rest.get(..length).filter(|body| body.len() >= 2) else {
            return Some("descriptors that fill wTotalLength");
        };
        if let Some(fault) = reading.take(body) {
            return Some(fault);
        }
        rest = &rest[length..];
    }
    let numbers = reading.interfaces.last().map_or(0, |last| last.number + 1);
    let missing = reading.interfaces.last().map_or(0, |last| last.missing);
    wrong_head.or(broken(&[
        (at(4) == numbers, "bNumInterfaces"),
        (missing == 0, "bNumEndpoints"),
        (reading.associated <= numbers, "bInterfaceCount"),
    ]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A serial device's configuration: an interface for control with an interrupt endpoint, and
    /// one for data with a bulk pair.
    fn serial() -> Vec<u8> {
        let parts: [&[u8]; 10] = [
            &[9, 2, 67, 0, 2, 1, 0, 0x80, 50],
            &[9, 4, 0, 0, 1, 2, 2, 1, 0],
            &[5, 0x24, 0, 0x10, 1],
            &[4, 0x24, 2, 2],
            &[5, 0x24, 6, 0, 1],
            &[5, 0x24, 1, 0, 1],
            &[7, 5, 0x82, 3, 8, 0, 255],
            &[9, 4, 1, 0, 2, 10, 0, 0, 0],
            &[7, 5, 0x01, 2, 64, 0, 0],
            &[7, 5, 0x81, 2, 64, 0, 0],
        ];
        parts.concat()
    }

    #[test]
    fn a_right_configuration_is_taken_and_each_wrong_length_or_count_in_it_is_not() {
        assert_eq!(configuration(&serial()), None);
        // The bytes whose change no rule of lengths and counts sees.
        let free = |place: usize| {
            let power_and_strings = [6, 8, 17, 52].contains(&place);
            let classes = [14, 15, 16, 49, 50, 51].contains(&place);
            let functional = (18..37).contains(&place) && ![18, 23, 27, 32].contains(&place);
            let endpoints = [39, 40, 41, 43, 55, 59, 66].contains(&place);
            power_and_strings || classes || functional || endpoints
        };
        for place in (0..serial().len()).filter(|place| !free(*place)) {
            for change in [1, u8::MAX] {
                let mut bytes = serial();
                bytes[place] = bytes[place].wrapping_add(change);
                assert_ne!(configuration(&bytes), None, "byte {place} by {change}");
            }
        }
        assert_ne!(configuration(&serial()[..60]), None);
        assert_ne!(configuration(&[serial(), vec![0]].concat()), None);
    }

    #[test]
    fn a_device_and_its_strings_state_their_lengths() {
        let device_of = |length, packet| {
            let mut bytes = vec![length, 1, 0x10, 2, 2, 0, 0, packet];
            bytes.extend([0xC0, 0x16, 0xDD, 0x27, 0, 1, 1, 2, 0, 1]);
            bytes
        };
        assert_eq!(device(&device_of(18, 64)), None);
        assert_eq!(strings(&device_of(18, 64)).collect::<Vec<_>>(), [1, 2]);
        assert!(device(&device_of(17, 64)).is_some());
        assert!(device(&device_of(18, 63)).is_some());
        assert!(device(&device_of(18, 64)[..17]).is_some());
        assert_eq!(string(&[4, 3, 9, 4]), None);
        assert!(string(&[6, 3, 9, 4]).is_some() && string(&[3, 3, 9]).is_some());
    }
}
