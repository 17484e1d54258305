//! A machine with a vacuum on M10 and M11, its run-up time as `$800`, and `Vac:` in status reports.
//!
//! `cargo run -p leadscrew-machine --example vacuum` sends it a few lines and prints the
//! conversation. A firmware does the same with its own board and the pin of its relay.

mod extension;

use embedded_hal::digital::{ErrorType, OutputPin};
use extension::Vacuum;
use leadscrew_machine::board::{
    Board, ChannelId, CoolantOutput, Duration, Instant, PortConfig, SpindleOutput, Switches,
};
use leadscrew_machine::config::{MachineConfig, MoveQueues, RowPixels, SegmentQueue};
use leadscrew_machine::inputs::Inputs;
use leadscrew_machine::machine::{Links, Machine};
use leadscrew_machine::protocol::serial::SerialQueue;
use leadscrew_planner::Cartesian;
use leadscrew_stepper::{Power, Shared};
use std::convert::Infallible;

/// A relay that prints its state.
struct Relay;

impl ErrorType for Relay {
    type Error = Infallible;
}

impl OutputPin for Relay {
    fn set_low(&mut self) -> Result<(), Infallible> {
        println!("  relay off");
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        println!("  relay on");
        Ok(())
    }
}

/// A board without motors, which prints all that it is to send.
struct Desk;

impl Board for Desk {
    fn start_stepping(&mut self, now: Instant) -> Instant {
        now
    }

    fn write(&mut self, _: ChannelId, bytes: &[u8]) -> usize {
        print!("{}", String::from_utf8_lossy(bytes));
        bytes.len()
    }

    fn switches(&self) -> Switches {
        Switches::OPEN
    }

    fn enable_motors(&mut self, _: bool) {}
    fn set_spindle(&mut self, _: SpindleOutput) {}
    fn set_power(&mut self, _: Power) {}
    fn set_coolant(&mut self, _: CoolantOutput) {}
    fn configure(&mut self, _: &PortConfig) {}
}

fn main() {
    let mut moves = Box::<MoveQueues<3, 3, 16>>::default();
    let mut pixels = Box::<RowPixels>::default();
    let (mut queue, mut serial) = (SegmentQueue::<3>::new(), SerialQueue::<129>::new());
    let (shared, inputs) = (Shared::new(), Inputs::new());
    let (segments, _) = queue.split();
    let (mut receiver, inbox) = serial.split();
    let links = Links {
        moves: &mut moves,
        pixels: &mut pixels,
        segments,
        shared: &shared,
        inputs: &inputs,
        inboxes: [inbox].into_iter().collect(),
    };
    let config = MachineConfig::grbl();
    let mut machine = Machine::with_extension(config, Cartesian, links, Vacuum::new(Relay))
        .expect("the machine can be built");
    let mut now = Instant::from_ticks(0);
    for line in [
        "M10", "?", "M11", "$800", "$800=250", "M10 P0.1", "M30", "?",
    ] {
        println!("{line}");
        line.bytes().chain([b'\n']).for_each(|byte| {
            receiver.receive(byte);
        });
        let end = now + Duration::from_ticks(1_000_000);
        while now < end {
            let next = machine.poll(&mut Desk, now);
            let idle = next.when.unwrap_or(end).min(end);
            now = if next.busy {
                now + Duration::from_ticks(1)
            } else {
                idle
            };
        }
    }
}
