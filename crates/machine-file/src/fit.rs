//! Fits the machine to its board, or to the board's record: data in the board's flash from which a
//! firmware learns its pins and its machine (`docs/boards.md`).

use super::{Profile, Socket, MOST_AXES};
use leadscrew_boards::{Board, Machine, Needs, Socket as OfBoard, Unfit, RECORDED_MOTORS};
use leadscrew_machine::config::{Dialect, MachineConfig, Options, SwitchRules};
use leadscrew_planner::Train;
use std::fmt;

/// The key of a machine's file for which a board's record has no field.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NotInRecord(&'static str);

impl fmt::Display for NotInRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let key = self.0;
        write!(
            f,
            "{key}: no board's record says this; build the firmware with `cargo fw --machine`"
        )
    }
}

impl std::error::Error for NotInRecord {}

impl Profile {
    /// The board, cut down to the parts that the machine uses, with its motors at the sockets that
    /// the file names.
    ///
    /// # Errors
    /// A part that the board lacks, or a socket that two motors share.
    pub fn fitted(&self, board: &Board) -> Result<Board, Unfit> {
        board.fitted(&self.needs())
    }

    /// The machine, as the record of its board describes it.
    ///
    /// # Errors
    /// The file has a key that a record has no field for.
    pub fn recorded(&self) -> Result<Machine, NotInRecord> {
        let config = self.bare_config::<MOST_AXES>();
        if let Some(key) = self.beyond_a_record(&config) {
            return Err(NotInRecord(key));
        }
        let turns = self.all_axes().enumerate();
        let settings = self.first_settings().into_iter();
        Ok(Machine {
            axes: self.axis_count() as u8, // 4 at most
            kinematics: match self.train() {
                Train::Straight => 0,
                Train::Crossed => 1,
                Train::Ganged(axis) => 2 + axis as u8, // X or Y
            },
            rotary: turns.fold(0, |all, (axis, of)| all | u8::from(of.rotary) << axis),
            without_switch: config.rules.without_switch,
            homing: config.homing_cycles,
            settings: settings
                .map(|entry| (entry.number, entry.value.nanos()))
                .collect(),
        })
    }

    /// A key of the machine's file that is not in a record.
    fn beyond_a_record(&self, config: &MachineConfig<MOST_AXES>) -> Option<&'static str> {
        let plain = MachineConfig::<MOST_AXES>::new();
        let rules = SwitchRules {
            without_switch: config.rules.without_switch,
            ..plain.rules
        };
        // The board's pins decide about the door and the mist valve.
        let options = Options {
            door: config.options.door,
            ..plain.options
        };
        let dialect = Dialect {
            mist: config.dialect.mist,
            ..plain.dialect
        };
        let has_options = config.options != options || config.dialect != dialect;
        let keys = [
            ("axes.e", self.axes.e.is_some()),
            ("a fifth motor", self.motor_count() > RECORDED_MOTORS),
            ("heaters", self.heaters.is_any()),
            ("fan", self.fan.fitted),
            ("outputs", self.outputs.config().count > 0),
            ("tool_switches", self.tool_switches.is_some()),
            ("tool_change", self.tool_change.is_some()),
            ("look_ahead", config.moves != plain.moves),
            ("second_motor's squaring", config.squaring != plain.squaring),
            ("switches, or `stops` of an axis", config.rules != rules),
            ("options", has_options || self.options.expressions),
        ];
        keys.into_iter()
            .find_map(|(key, is_there)| is_there.then_some(key))
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
            Self::Spare2 => OfBoard::Spare2,
            Self::Spare3 => OfBoard::Spare3,
        }
    }
}
