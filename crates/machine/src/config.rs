//! Everything about a machine that is fixed when it is built: sizes, wiring that no setting knows,
//! options that Grbl chooses when it is compiled.

use crate::board::Duration;
use crate::protocol::line_reader::GRBL_LINE_LENGTH;
use crate::protocol::report::fields;
use crate::settings::table::Setting;
use crate::settings::values::{Entry, Settings};
use crate::step_timing::StepTiming;
use core::cmp::Ordering;
use leadscrew_gcode::Number;
use leadscrew_interpreter::{ArcMismatch, Context, OwnCodes, ToolTable};
use leadscrew_planner::{Coordinate, PixelQueue, Queue, SmallQueue, USUAL_BLOCKS};

pub use crate::segment_queue::{SegmentQueue, SegmentSender, SEGMENTS};
pub(crate) use leadscrew_interpreter::axes::WITHOUT_EXTRUDER;
pub use leadscrew_interpreter::axes::{extruder, AxisKind};
pub use leadscrew_interpreter::Dialect;

/// Changes of power that all planned rows of a raster may hold together. They take 36 KB. Stopping
/// from 450 mm/s at 500 mm/s² takes 202 mm, 4050 pixels of 0.05 mm; this is a little more.
pub const PIXELS: usize = 4608;

/// The memory of the pixels of the program's rows. Borrowed as [`MoveQueues`] are, but apart from
/// them: the two can be in different memories of a microcontroller.
pub type RowPixels = PixelQueue<PIXELS>;

/// Moves that the machine's own motions, such as homing and parking, may have planned at once.
pub(crate) const ASIDE_MOVES: usize = 4;

/// The memory of planned moves, `MOVES` of the program: by far the largest part of a machine. A
/// machine borrows it, so that it can be a `static` and need not be built on a stack. `BLOCKS` is
/// for small queues: see [`Queue`].
#[derive(Debug)]
pub struct MoveQueues<
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const BLOCKS: usize = USUAL_BLOCKS,
> {
    pub(crate) program: Queue<AXES, MOTORS, MOVES, BLOCKS>,
    pub(crate) aside: SmallQueue<AXES, MOTORS, ASIDE_MOVES>,
    pub(crate) aside_pixels: PixelQueue<1>,
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize>
    MoveQueues<AXES, MOTORS, MOVES, BLOCKS>
{
    /// Makes empty queues.
    pub const fn new() -> Self {
        Self {
            program: Queue::new(),
            aside: SmallQueue::new(),
            aside_pixels: PixelQueue::new(),
        }
    }
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize> Default
    for MoveQueues<AXES, MOTORS, MOVES, BLOCKS>
{
    fn default() -> Self {
        Self::new()
    }
}

/// Serial lines that one machine can serve.
pub const CHANNELS: usize = 4;

/// The longest motion that may be committed to the segment queue: a hold, a cancel or an override
/// acts after this time at most.
pub const COMMITTED: Duration = Duration::from_ticks(if cfg!(feature = "without-fpu") {
    4_800
} else {
    2_000
});

/// A set of axes, one bit for each axis.
pub type AxisMask = u8;

/// The way in which the spindle axis gets out of the way while the door is open.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ParkingConfig {
    /// The axis that parks: the spindle's, Z.
    pub axis: usize,
    /// Machine position to park at, mm.
    pub target_mm: f32,
    /// Speed from the pull-out height to the target and back, mm/min.
    pub rate: f32,
    /// Speed out of the work and back into it, mm/min.
    pub pull_out_rate: f32,
    /// Distance out of the work, mm.
    pub pull_out_mm: f32,
}

impl ParkingConfig {
    /// Grbl's parking of Z.
    pub const GRBL: Self = Self {
        axis: 2,
        target_mm: -5.0,
        rate: 500.0,
        pull_out_rate: 100.0,
        pull_out_mm: 5.0,
    };
}

/// The distance by which the two switches of an axis with two motors may be apart when it is
/// squared while homing.
///
/// The kinematics say which axis has two motors: see [`leadscrew_planner::Ganged`].
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Squaring {
    /// The distance that one of the two motors may go on without its switch once the other one has
    /// met its own, as a share of the axis's travel: farther is ALARM:10.
    pub tolerance: f32,
    /// The least distance that is allowed, mm.
    pub least_mm: f32,
    /// The greatest distance that is allowed, mm.
    pub most_mm: f32,
}

impl Squaring {
    /// 5 % of the travel may be between the two switches, at least 2.5 mm and at most 25 mm.
    pub const GRBL: Self = Self {
        tolerance: 0.05,
        least_mm: 2.5,
        most_mm: 25.0,
    };

    /// Returns how far apart the two switches of an axis with this travel may be, mm.
    pub fn allowance(&self, travel_mm: f32) -> f32 {
        (travel_mm * self.tolerance)
            .max(self.least_mm)
            .min(self.most_mm)
    }
}

/// The choices that Grbl fixes when it is compiled.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Options {
    /// A safety door switch.
    pub door: bool,
    /// Line numbers in status reports (`Ln:`).
    pub line_numbers: bool,
    /// True if single axes may be homed: `$HX`, `$HY`, `$HZ`.
    pub single_axis_homing: bool,
    /// Parking on an open door.
    pub parking: Option<ParkingConfig>,
}

/// The rules of limit switches beyond Grbl's.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SwitchRules {
    /// A switch that stops the machine is named with its end (`[MSG:X high]`); the position is
    /// kept, and `$X` unlocks ALARM:1.
    pub named: bool,
    /// With `named`: how far X and Y then go back, mm; 0: not at all. Z never does.
    pub back_off_mm: f32,
    /// Reports have `Sw:X+,Z-`: switches that are closed, and their ends as far as they are known.
    pub reported: bool,
    /// 0x18 in motion and the reset input switch the drivers off at once, not after `$1`.
    pub drops_drivers: bool,
    /// Axes without a switch: `$H` takes them to their zero once the others are home.
    pub without_switch: AxisMask,
    /// Axes whose limit switch serves homing alone: it never stops motion.
    pub homing_only: AxisMask,
    /// Axes whose limit switch stands at the low end and stops only motion towards that end. Motion
    /// away from it goes on, in programs too.
    pub towards_low: AxisMask,
    /// The same at the high end. An axis with a switch at each end on one input is in both masks:
    /// the input may not tell the ends apart.
    pub towards_high: AxisMask,
}

impl SwitchRules {
    /// The rules of Grbl.
    pub const GRBL: Self = Self {
        named: false,
        back_off_mm: 0.0,
        reported: false,
        drops_drivers: false,
        without_switch: 0,
        homing_only: 0,
        towards_low: 0,
        towards_high: 0,
    };

    /// Returns true if a switch stops fewer motions than in Grbl.
    pub(crate) const fn are_own(&self) -> bool {
        self.homing_only | self.towards_low | self.towards_high != 0
    }

    /// The end at which the only switch of an axis stands, if motion away from the switch goes
    /// on; `None` for all other axes.
    pub(crate) const fn only_end(&self, axis: usize) -> Option<Ordering> {
        match (self.towards_low >> axis & 1, self.towards_high >> axis & 1) {
            (1, 0) => Some(Ordering::Less),
            (0, 1) => Some(Ordering::Greater),
            _ => None,
        }
    }
}

/// A machine's build: the properties that no setting changes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MachineConfig<const AXES: usize> {
    /// The kind of each axis.
    pub axes: [AxisKind; AXES],
    /// Counts of the step timer a second.
    pub timer_hz: u32,
    /// The time that the board takes to make steps: faster motion is capped. A setting that the
    /// board cannot satisfy, whatever the other settings are, is refused.
    pub step_timing: StepTiming,
    /// The number of moves that may be planned ahead; at most as many as its [`MoveQueues`] has
    /// room for.
    pub moves: usize,
    /// The number of changes of power that the planned rows of a raster may hold together, at most
    /// [`PIXELS`]; 0: each line is a move of its own.
    pub pixels: usize,
    /// The number of unread bytes that the queue of each serial line takes, for whoever makes that
    /// queue: 128 as in Grbl, or more.
    pub receive_size: u16,
    /// Characters that a line may have after filtering.
    pub line_length: usize,
    /// The settings of a new machine that differ from the defaults of the settings' table.
    pub defaults: &'static [Entry],
    /// Axes that home together, in the order in which they home; 0 for the rest.
    pub homing_cycles: [AxisMask; 4],
    /// Spindle run-up time after the safety door was closed.
    pub spindle_delay: Duration,
    /// Coolant delay after the safety door was closed.
    pub coolant_delay: Duration,
    /// The squaring of an axis with two motors, if there is one.
    pub squaring: Squaring,
    /// The rules of limit switches beyond Grbl's.
    pub rules: SwitchRules,
    /// Bits of `$10` that have an effect; the others are kept and change nothing, as in Grbl.
    pub report_bits: u8,
    /// Options that Grbl chooses when it is compiled.
    pub options: Options,
    /// The words of programs that not every machine knows. With `mist` the machine has a mist
    /// valve.
    pub dialect: Dialect,
}

/// `$10` in Grbl: 1 machine position, 2 `Bf:`. Bits 4 (`Ln:`) and 8 (`Fin:`) are our own.
const GRBL_REPORT_BITS: u8 = fields::MACHINE_POSITION | fields::ROOM;
const REPORT_BITS: u8 = GRBL_REPORT_BITS | fields::LINE | fields::TIME_LEFT;

/// `$704=1`: corners as in Grbl.
#[cfg(feature = "curves")]
const GRBL_CORNERS: Entry = Entry {
    number: Setting::GrblCorners.row().number,
    value: Number::from_int(1),
};

/// `$712=0`: no wait for the spindle after a hold.
const NO_SPIN_UP: Entry = Entry {
    number: Setting::SpinUp.row().number,
    value: Number::from_int(0),
};

/// Counts a second of the F407's timer: twice the frequency of APB1.
const TIMER_HZ: u32 = 84_000_000;

impl<const AXES: usize> MachineConfig<AXES> {
    /// Makes a machine for real work: deep look-ahead, large buffers.
    pub const fn new() -> Self {
        Self {
            axes: [AxisKind::Linear; AXES],
            timer_hz: TIMER_HZ,
            step_timing: StepTiming::F407,
            moves: 1024,
            pixels: PIXELS,
            receive_size: 1024,
            line_length: GRBL_LINE_LENGTH,
            defaults: &[],
            homing_cycles: [0b100, 0b011, 0, 0],
            spindle_delay: Duration::from_ticks(4_000_000),
            coolant_delay: Duration::from_ticks(1_000_000),
            squaring: Squaring::GRBL,
            rules: SwitchRules::GRBL,
            report_bits: REPORT_BITS,
            options: Options {
                door: false,
                line_numbers: false,
                single_axis_homing: false,
                parking: None,
            },
            dialect: Dialect {
                cycles: true,
                linuxcnc: true,
                ..Dialect::GRBL
            },
        }
    }

    /// Returns the context in which the machine's lines are interpreted: with the M codes of `own`,
    /// without a tool table. For `reach` see [`Context::reach`].
    pub fn context<'a>(
        &'a self,
        settings: &Settings<AXES>,
        reach: &'a [Coordinate; AXES],
        own: OwnCodes<'a>,
    ) -> Context<'a, AXES> {
        Context {
            axes: &self.axes,
            dialect: &self.dialect,
            laser_mode: settings.is_on(Setting::Laser),
            soft_limits: settings.is_on(Setting::SoftLimits),
            reach,
            arcs: ArcMismatch {
                length: settings.value(Setting::ArcMismatch),
                percent: settings.value(Setting::ArcMismatchShare),
            },
            own,
            tools: ToolTable::NONE,
        }
    }

    /// Makes a machine that answers as stock Grbl 1.1h does: 15 moves, 128 bytes, two bits of
    /// `$10`, its corners, no cycles or other words beyond its own, no wait for a spindle after a
    /// hold.
    pub const fn grbl() -> Self {
        let mut config = Self::new();
        config.step_timing = StepTiming::GRBL;
        config.dialect = Dialect::GRBL;
        config.moves = 15;
        config.pixels = 0;
        config.receive_size = 128;
        config.report_bits = GRBL_REPORT_BITS;
        config.defaults = &[
            #[cfg(feature = "curves")]
            GRBL_CORNERS,
            NO_SPIN_UP,
        ];
        config
    }
}

impl<const AXES: usize> Default for MachineConfig<AXES> {
    fn default() -> Self {
        Self::new()
    }
}
