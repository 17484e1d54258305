//! Fits the machine to its board.

use super::{Profile, Socket};
use leadscrew_boards::{Board, Needs, Socket as OfBoard, Unfit};

impl Profile {
    /// The board, cut down to the parts that the machine uses, with its motors at the sockets that
    /// the file names.
    ///
    /// # Errors
    /// A part that the board lacks, or a socket that two motors share.
    pub fn fitted(&self, board: &Board) -> Result<Board, Unfit> {
        board.fitted(&self.needs())
    }

    /// The parts of a board that the machine uses.
    fn needs(&self) -> Needs {
        let second = self.second_motor.iter().map(|second| second.socket);
        let sockets = self.all_axes().map(|axis| axis.socket).chain(second);
        Needs {
            motors: sockets.map(|socket| socket.map(Socket::of_board)).collect(),
            outputs: usize::from(self.outputs.config().count),
            tool: self.tool_switches.is_some(),
            heaters: self.heaters.configs().len(),
            heater_supply: self.heaters.supply_relay,
            heater_fault: self.heaters.fault_input,
            fan: self.fan.fitted,
        }
    }
}

impl Socket {
    fn of_board(self) -> OfBoard {
        match self {
            Self::X => OfBoard::X,
            Self::Y => OfBoard::Y,
            Self::Z => OfBoard::Z,
            Self::Spare => OfBoard::Spare,
        }
    }
}
