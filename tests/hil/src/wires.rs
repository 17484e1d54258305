//! The wires of the board's file. The build of the image and this program read the same file.
use crate::failure::{fail, Failure};
use leadscrew_boards::{Board, Pin, Wire};
use std::fmt;

/// The board's file.
const FILE: &str = include_str!("../discovery.toml");

/// The wires of the board's file.
pub(crate) struct Wires {
    board: Board,
    /// The wires that end at a channel of TIM2, in the order of their numbers.
    pub(crate) captures: Vec<Wire>,
    /// The wires that end at an input of the machine.
    pub(crate) others: Vec<Wire>,
}

/// The outputs whose edges are captured. The values are the numbers of their wires in the file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Signal {
    /// Step of X.
    StepX = 0,
    /// Step of Y.
    StepY = 1,
    /// Direction of X, high is negative.
    DirectionX = 2,
    /// Power, a PWM.
    Power = 3,
    /// Flood coolant.
    Flood = 4,
}

/// The name of a signal in messages and reports.
impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Signal::StepX => "step of X",
            Signal::StepY => "step of Y",
            Signal::DirectionX => "direction of X",
            Signal::Power => "power",
            Signal::Flood => "flood coolant",
        })
    }
}

impl Signal {
    /// The number of its wire.
    pub(crate) fn number(self) -> usize {
        self as usize
    }
}

impl Wires {
    /// Reads the board's file, and checks it against the chip.
    ///
    /// # Errors
    /// The file is wrong: the error has the first finding.
    pub(crate) fn read() -> Result<Self, Failure> {
        let board = Board::read(FILE).map_err(Failure)?;
        if let Some(finding) = board.check().first() {
            return fail(finding.to_string());
        }
        let captures: Vec<Wire> = board.captures().iter().map(|(wire, _)| *wire).collect();
        let is_capture = |wire: &&Wire| captures.contains(wire);
        let others = board.wire.iter().filter(|wire| !is_capture(wire));
        Ok(Wires {
            others: others.copied().collect(),
            captures,
            board,
        })
    }
}

/// Writes the table of wires as in docs/hil.md.
impl fmt::Display for Wires {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "| from | to |\n|---|---|")?;
        let mut all = self.captures.iter().chain(&self.others);
        all.try_for_each(|wire| {
            writeln!(f, "| {} | {} |", self.place(wire.from), self.place(wire.to))
        })
    }
}

impl Wires {
    /// The text for a pin: its name, its purpose, and its place on the board.
    fn place(&self, pin: Pin) -> String {
        let place = self.board.at.get(&pin).map_or("", String::as_str);
        let pins = self.board.pins();
        let purpose = pins.iter().find(|(_, one)| *one == pin);
        let purpose = purpose.map_or("", |(purpose, _)| purpose);
        format!("{pin}, {purpose} ({place})")
    }
}

/// The pins at which wires begin.
pub(crate) fn outputs(wires: &Wires) -> impl Iterator<Item = Pin> + '_ {
    let all = wires.captures.iter().chain(&wires.others);
    all.map(|wire| wire.from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_the_table_of_the_file() {
        let page = include_str!("../../../docs/hil.md");
        assert!(page.contains(&Wires::read().unwrap().to_string()));
    }

    #[test]
    fn the_boards_file_is_right_and_has_the_wires_of_all_signals() {
        let wires = Wires::read().unwrap();
        let from: Vec<String> = outputs(&wires).map(|pin| pin.to_string()).collect();
        assert_eq!(from, ["PE7", "PE8", "PE10", "PD12", "PD15", "PD15"]);
        let wrong = |from: &str, to: &str| {
            let board = Board::read(&FILE.replacen(from, to, 1)).unwrap();
            !board.check().is_empty()
        };
        assert!(wrong("to = \"PA1\"", "to = \"PA6\""));
        assert!(wrong("usart = 1", "usart = 2"));
        assert_eq!(Signal::Flood.number() + 1, wires.captures.len());
        assert_eq!(wires.others.len(), 1);
    }
}
