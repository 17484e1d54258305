//! Fits a board to one machine: its parts, and the sockets that the machine uses.
use crate::{Axis, Board, Kinematics, Motor, MotorSocket, Sockets};
use std::fmt;

/// A board's socket for a motor driver, with the limit switch beside it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Socket {
    /// The first motor of the board's file.
    X,
    /// The second motor of the board's file.
    Y,
    /// The third motor of the board's file.
    Z,
    /// The first of `sockets.motors`.
    Spare,
    /// The second of `sockets.motors`.
    Spare2,
    /// The third of `sockets.motors`.
    Spare3,
}

impl fmt::Display for Socket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Spare => "spare",
            Self::Spare2 => "spare-2",
            Self::Spare3 => "spare-3",
        })
    }
}

/// The sockets of a machine's motors if its file does not name them.
const USUAL: [Socket; 6] = [
    Socket::X,
    Socket::Y,
    Socket::Z,
    Socket::Spare,
    Socket::Spare2,
    Socket::Spare3,
];

/// The parts of a board that a machine needs besides those that every machine needs.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Needs {
    /// The socket of each motor, for 3 motors or more. `None`: the next one in the order X, Y, Z,
    /// and the spare ones.
    pub motors: Vec<Option<Socket>>,
    /// The number of outputs that M62 to M65 switch.
    pub outputs: usize,
    /// True if it needs the switches at the ends of a tool's travel.
    pub tool: bool,
    /// The number of heaters.
    pub heaters: usize,
    /// True if it needs a relay that supplies all heaters.
    pub heater_supply: bool,
    /// True if it needs an input for heater faults that another device reports.
    pub heater_fault: bool,
    /// True if it needs a fan.
    pub fan: bool,
}

/// The number of axes that a board has without a machine's file. It has one motor for each axis,
/// and may have second motors.
const THREE: usize = 3;

/// The reason why a board does not fit a machine.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Unfit {
    /// The board drives fewer motors.
    Motors {
        /// Motors of the machine.
        needs: usize,
        /// Motors that the board drives.
        has: usize,
    },
    /// Two motors of the machine are in one socket.
    Shared(Socket),
    /// The board has fewer outputs for M62 to M65.
    Outputs {
        /// Outputs of the machine.
        needs: usize,
        /// Outputs of the board.
        has: usize,
    },
    /// The board has no inputs for the two switches of a tool.
    Tool,
    /// The board has fewer switches and sensors for heaters.
    Heaters {
        /// Heaters of the machine.
        needs: usize,
        /// Heaters of the board.
        has: usize,
    },
    /// The board has no output for the relay that supplies the heaters.
    HeaterSupply,
    /// The board has no input for faults of the heaters.
    HeaterFault,
    /// The board has no output for a fan.
    Fan,
    /// The kinematics or the second motors in the board's file belong to another machine.
    Kinematics,
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Motors { needs, has } => {
                write!(f, "the machine has {needs} motors, the board drives {has}")
            }
            Self::Shared(socket) => write!(f, "two motors of the machine are in the board's socket `{socket}`"),
            Self::Outputs { needs, has } => write!(
                f,
                "the machine has {needs} outputs, `sockets.outputs` of the board {has}"
            ),
            Self::Tool => f.write_str(
                "the machine has a tool between two switches, the board no `sockets.tool`",
            ),
            Self::Heaters { needs, has } => write!(
                f,
                "the machine has {needs} heaters, `sockets.heaters` of the board {has}"
            ),
            Self::HeaterSupply => f.write_str(
                "the machine has a relay that supplies its heaters, the board no `sockets.heater-supply`",
            ),
            Self::HeaterFault => f.write_str(
                "the machine has an input for faults of its heaters, the board no `sockets.heater-fault`",
            ),
            Self::Fan => f.write_str("the machine has a fan, the board no `sockets.fan`"),
            Self::Kinematics => {
                f.write_str("the board's file says how motors move axes, and so does the machine's")
            }
        }
    }
}

impl std::error::Error for Unfit {}

impl Board {
    /// Returns the board without its sockets.
    #[must_use]
    pub fn bare(&self) -> Self {
        Self {
            sockets: Sockets::default(),
            ..self.clone()
        }
    }

    /// Returns the board with the sockets that a machine uses, and no others. Settings and the
    /// order of homing then come from the machine's file.
    ///
    /// # Errors
    /// A part that the board lacks.
    pub fn fitted(&self, needs: &Needs) -> Result<Self, Unfit> {
        if self.kinematics != Kinematics::Cartesian || self.motor.len() > THREE {
            return Err(Unfit::Kinematics);
        }
        let motors = self.motors_at(&needs.motors)?;
        let outputs = self.sockets.outputs.get(..needs.outputs);
        let outputs = outputs.ok_or(Unfit::Outputs {
            needs: needs.outputs,
            has: self.sockets.outputs.len(),
        })?;
        if needs.tool && self.sockets.tool.is_none() {
            return Err(Unfit::Tool);
        }
        let heaters = self.sockets.heaters.get(..needs.heaters);
        let heaters = heaters.ok_or(Unfit::Heaters {
            needs: needs.heaters,
            has: self.sockets.heaters.len(),
        })?;
        if needs.heater_supply && self.sockets.heater_supply.is_none() {
            return Err(Unfit::HeaterSupply);
        }
        if needs.heater_fault && self.sockets.heater_fault.is_none() {
            return Err(Unfit::HeaterFault);
        }
        if needs.fan && self.sockets.fan.is_none() {
            return Err(Unfit::Fan);
        }
        let axes = [Axis::X, Axis::Y, Axis::Z].into_iter();
        let of_axis = |(axis, socket)| Motor { axis, socket };
        let sockets = Sockets {
            motors: motors.iter().skip(THREE).copied().collect(),
            outputs: outputs.to_vec(),
            tool: self.sockets.tool.filter(|_| needs.tool),
            heaters: heaters.to_vec(),
            heater_supply: self.sockets.heater_supply.filter(|_| needs.heater_supply),
            heater_fault: self.sockets.heater_fault.filter(|_| needs.heater_fault),
            fan: self.sockets.fan.filter(|_| needs.fan),
            reference: self.sockets.reference,
        };
        Ok(Self {
            motor: axes.zip(motors).map(of_axis).collect(),
            sockets,
            ..self.clone()
        })
    }

    /// The board's socket for each of the machine's motors.
    fn motors_at(&self, asked: &[Option<Socket>]) -> Result<Vec<MotorSocket>, Unfit> {
        let has = self.motor_sockets().count();
        let needs = asked.len();
        let lacks = Unfit::Motors { needs, has };
        let usual = USUAL.map(Some).into_iter().chain(std::iter::repeat(None));
        let sockets = asked
            .iter()
            .zip(usual)
            .map(|(asked, usual)| asked.or(usual));
        let sockets: Vec<Socket> = sockets.collect::<Option<_>>().ok_or(lacks)?;
        for (index, socket) in sockets.iter().enumerate() {
            if sockets[..index].contains(socket) {
                return Err(Unfit::Shared(*socket));
            }
        }
        let has = |socket| self.motor_sockets().nth(socket as usize);
        sockets
            .into_iter()
            .map(has)
            .collect::<Option<_>>()
            .ok_or(lacks)
    }
}
