//! Compares `crates/boards/data/stm32f407.txt` with ST's data in the crate `stm32-metapac`.
//! `LEADSCREW_WRITE=1 cargo test -p leadscrew-f407emu --features st-data --test chip` writes the
//! file anew.
use std::{collections::BTreeMap, env, fmt::Write, fs};
use stm32_metapac::metadata::METADATA;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../boards/data/stm32f407.txt");
const HEAD: &str = "# Made by `crates/f407emu/tests/chip.rs` from ST's data (the crate stm32-metapac, MIT or Apache-2.0): for each pin of the STM32F407ZG
# the signals that it can be with the number of the function, its channel of ADC1, and for each request of a USART and of TIM2 the DMA
# streams that hear it, as controller, stream and channel.
";

/// The port and the number of a pin, by which pins are sorted.
fn place(pin: &str) -> (char, u8) {
    let port = pin.chars().nth(1).unwrap();
    (port, pin[2..].parse().unwrap())
}

fn expected() -> String {
    let mut pins: BTreeMap<(char, u8), Vec<String>> = BTreeMap::new();
    for pin in METADATA.pins.iter().filter(|pin| pin.name < "PH") {
        pins.entry(place(pin.name)).or_default();
    }
    let mut requests = String::new();
    for one in METADATA.peripherals {
        for at in one.pins {
            let name = format!("{}_{}", one.name, at.signal);
            let word = match at.af {
                Some(number) => format!("{name}={number}"),
                // A channel of the ADC has no alternate function: its pin is analog.
                None if one.name == "ADC1" => name,
                None => continue,
            };
            if at.pin < "PH" {
                pins.entry(place(at.pin)).or_default().push(word);
            }
        }
        let signals: &[&str] = match one.name {
            "TIM2" => &["CH2", "CH3", "CH4"],
            name if name.starts_with("USART") => &["RX", "TX"],
            _ => continue,
        };
        for signal in signals {
            let ours = one.dma_channels.iter().filter(|at| at.signal == *signal);
            let streams: Vec<String> = ours
                .filter_map(|at| {
                    Some(format!("{}.{}", at.channel?, at.request?).replace("_CH", "."))
                })
                .collect();
            writeln!(requests, "{}_{signal}: {}", one.name, streams.join(" ")).unwrap();
        }
    }
    let mut text = HEAD.to_owned();
    for ((port, number), mut words) in pins {
        words.sort();
        writeln!(text, "P{port}{number} {}", words.join(" ")).unwrap();
    }
    text + &requests
}

#[test]
fn functions_and_requests_are_those_of_sts_data() {
    let expected = expected();
    if env::var_os("LEADSCREW_WRITE").is_some() {
        fs::write(FILE, &expected).unwrap();
    }
    assert_eq!(fs::read_to_string(FILE).unwrap(), expected);
}
