//! All memory of a motion without G-code, and its parts.

use crate::motion::Motion;
use crate::motion_config::{MotionConfig, MotionConfigError};
use crate::motion_course::Course;
use crate::steps::Steps;
use crate::switches::Switches;
use crate::words::Words;
use heapless::spsc::Queue;
use leadscrew_planner::{Coordinate, Kinematics, PixelQueue, Planner, Segmenter, USUAL_BLOCKS};
use leadscrew_stepper::{MotorMask, Segment, Ticks};

/// Slots for segments; one stays empty. Segments are a millisecond at most, so a hold acts 8 ms
/// later at most.
const SLOTS: usize = 9;

/// All memory of a motion: one `static`. `MOVES` may be queued at once.
pub struct MotionResources<
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const BLOCKS: usize = USUAL_BLOCKS,
> {
    moves: leadscrew_planner::Queue<AXES, MOTORS, MOVES, BLOCKS>,
    pixels: PixelQueue<1>,
    segments: Queue<Segment<MOTORS>, SLOTS>,
    words: Words<MOTORS>,
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize>
    MotionResources<AXES, MOTORS, MOVES, BLOCKS>
{
    /// Makes empty queues, for a `static`.
    pub const fn new() -> Self {
        Self {
            moves: leadscrew_planner::Queue::new(),
            pixels: PixelQueue::new(),
            segments: Queue::new(),
            words: Words::new(),
        }
    }
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize> Default
    for MotionResources<AXES, MOTORS, MOVES, BLOCKS>
{
    fn default() -> Self {
        Self::new()
    }
}

/// A motion and its interrupts: see [`motion()`].
pub type MotionParts<'a, K, const AXES: usize, const MOTORS: usize> = (
    Motion<'a, K, AXES, MOTORS>,
    Steps<'a, MOTORS>,
    Switches<'a, MOTORS>,
);

/// Makes a motion. Returns what belongs to the main loop, to the step interrupt and to the switch
/// interrupt.
///
/// # Errors
/// The first value of `config` with which nothing can be planned.
pub fn motion<
    K: Kinematics<AXES, MOTORS>,
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const BLOCKS: usize,
>(
    resources: &mut MotionResources<AXES, MOTORS, MOVES, BLOCKS>,
    config: MotionConfig<AXES>,
    kinematics: K,
) -> Result<MotionParts<'_, K, AXES, MOTORS>, MotionConfigError> {
    config.validate()?;
    let travel = config.travel()?;
    let planned = config.planner(MOVES)?;
    let (producer, segments) = resources.segments.split();
    let words = &resources.words;
    words.order_wiring(&config.wiring);
    words.inputs.configure(&config.inputs);
    let wait = planned.shortest_tick.0.saturating_mul(2);
    words.shared.set_direction_wait(Ticks(wait));
    let motors = core::array::from_fn(|axis| {
        let own = (0..MOTORS).filter(|motor| kinematics.axis_of(*motor) == axis);
        own.fold(MotorMask::NONE, |all, motor| {
            all.with(MotorMask::only(motor))
        })
    });
    let sharing = kinematics.sharing();
    let planner = Planner::new(
        planned,
        kinematics,
        &mut resources.moves,
        &mut resources.pixels,
    )?;
    let motion = Motion {
        planner,
        segmenter: Segmenter::new(),
        segments: producer,
        words,
        travel,
        homing: config.homing,
        motors,
        sharing,
        target: [Coordinate::ZERO; AXES],
        touched: None,
        room: MOVES,
        course: Course::Going,
        underruns: 0,
        edges: words.inputs.edges(),
        drivers: (false, config.wiring.enable_invert),
        fault: None,
    };
    let steps = Steps::new(segments, words, planned.timer_hz);
    Ok((motion, steps, Switches::new(words)))
}
