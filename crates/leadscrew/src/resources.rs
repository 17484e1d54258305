//! All memory of a machine, and its parts.

use crate::config::{Config, Error};
use crate::machine::Machine;
use crate::serial::Serial;
use crate::steps::Steps;
use crate::switches::Switches;
use crate::words::Words;
use heapless::spsc::Queue;
use leadscrew_machine::config::{MoveQueues, SegmentQueue, PIXELS as MOST_PIXELS};
use leadscrew_machine::extension::Extension;
use leadscrew_machine::machine::{Links, Machine as Inner};
use leadscrew_machine::protocol::serial::{SerialQueue, DEFAULT_REALTIME, DEFAULT_RX, DEFAULT_TX};
use leadscrew_planner::{Kinematics, PixelQueue, USUAL_BLOCKS};

/// Slots of the queue to the serial line; one of them stays empty. A packet of USB has 64 bytes.
const WIRE: usize = 65;

/// All memory that a machine shares with its interrupts: one `static`.
///
/// | number | means |
/// |---|---|
/// | `AXES`, `MOTORS` | letters; drivers |
/// | `MOVES` | the look-ahead: 16 are Grbl's, 1024 keep speed on dense curves |
/// | `PIXELS` | changes of power in rows of a raster: 1 if nothing burns, 4608 at full speed |
/// | `BLOCKS` | blocks of moves in the look-ahead; 2 are enough for 16 moves |
/// | `SLOTS`, `LEAD` | segments on their way, and those that wait for their power: 9 and 1 if nothing burns |
/// | `RX`, `TX`, `REALTIME` | bytes received, bytes to send, realtime commands: 129, 512, 8 at 115 200 baud |
///
/// [`SmallResources`] has the least of all but the first three.
pub struct Resources<
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const PIXELS: usize = 1,
    const BLOCKS: usize = USUAL_BLOCKS,
    const SLOTS: usize = 17,
    const LEAD: usize = 16,
    const RX: usize = DEFAULT_RX,
    const TX: usize = DEFAULT_TX,
    const REALTIME: usize = DEFAULT_REALTIME,
> {
    moves: MoveQueues<AXES, MOTORS, MOVES, BLOCKS>,
    pixels: PixelQueue<PIXELS>,
    segments: SegmentQueue<MOTORS, SLOTS, LEAD>,
    serial: SerialQueue<RX, TX, REALTIME>,
    wire: Queue<u8, WIRE>,
    words: Words<MOTORS>,
}

/// [`Resources`] for a small chip without a laser: up to 16 moves, Grbl's buffers.
pub type SmallResources<const AXES: usize, const MOTORS: usize, const MOVES: usize> =
    Resources<AXES, MOTORS, MOVES, 1, 2, 9, 1, 129, 512, 8>;

impl<
        const AXES: usize,
        const MOTORS: usize,
        const MOVES: usize,
        const PIXELS: usize,
        const BLOCKS: usize,
        const SLOTS: usize,
        const LEAD: usize,
        const RX: usize,
        const TX: usize,
        const REALTIME: usize,
    > Resources<AXES, MOTORS, MOVES, PIXELS, BLOCKS, SLOTS, LEAD, RX, TX, REALTIME>
{
    /// Makes empty queues, for a `static`: built on the stack they would overflow it.
    pub const fn new() -> Self {
        Self {
            moves: MoveQueues::new(),
            pixels: PixelQueue::new(),
            segments: SegmentQueue::new(),
            serial: SerialQueue::new(),
            wire: Queue::new(),
            words: Words::new(),
        }
    }
}

impl<
        const AXES: usize,
        const MOTORS: usize,
        const MOVES: usize,
        const PIXELS: usize,
        const BLOCKS: usize,
        const SLOTS: usize,
        const LEAD: usize,
        const RX: usize,
        const TX: usize,
        const REALTIME: usize,
    > Default for Resources<AXES, MOTORS, MOVES, PIXELS, BLOCKS, SLOTS, LEAD, RX, TX, REALTIME>
{
    fn default() -> Self {
        Self::new()
    }
}

/// A machine and its three interrupts: see [`new`].
pub type Parts<'a, K, const AXES: usize, const MOTORS: usize, X = ()> = (
    Machine<'a, K, AXES, MOTORS, X>,
    Steps<'a, MOTORS>,
    Serial<'a>,
    Switches<'a, MOTORS>,
);

/// Makes a machine of its memory, its build and its kinematics. Returns what belongs to the main
/// loop, to the step interrupt, to the serial line, and to the switch interrupt.
///
/// # Errors
/// [`Config::validate`] refuses the build, or nothing can be planned with it.
pub fn new<
    'a,
    K: Kinematics<AXES, MOTORS> + Clone,
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const PIXELS: usize,
    const BLOCKS: usize,
    const SLOTS: usize,
    const LEAD: usize,
    const RX: usize,
    const TX: usize,
    const REALTIME: usize,
>(
    resources: &'a mut Resources<
        AXES,
        MOTORS,
        MOVES,
        PIXELS,
        BLOCKS,
        SLOTS,
        LEAD,
        RX,
        TX,
        REALTIME,
    >,
    config: Config<AXES>,
    kinematics: K,
) -> Result<Parts<'a, K, AXES, MOTORS>, Error> {
    with_extension(resources, config, kinematics, ())
}

/// As [`new`], with M codes, settings and report fields of your own.
///
/// # Errors
/// As [`new`].
pub fn with_extension<
    'a,
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const PIXELS: usize,
    const BLOCKS: usize,
    const SLOTS: usize,
    const LEAD: usize,
    const RX: usize,
    const TX: usize,
    const REALTIME: usize,
>(
    resources: &'a mut Resources<
        AXES,
        MOTORS,
        MOVES,
        PIXELS,
        BLOCKS,
        SLOTS,
        LEAD,
        RX,
        TX,
        REALTIME,
    >,
    config: Config<AXES>,
    kinematics: K,
    extension: X,
) -> Result<Parts<'a, K, AXES, MOTORS, X>, Error> {
    config.validate()?;
    let mut build = config.machine;
    build.moves = MOVES;
    // One pixel is no row: each line is a move of its own then.
    build.pixels = if PIXELS > 1 {
        PIXELS.min(MOST_PIXELS)
    } else {
        0
    };
    build.receive_size = u16::try_from(RX - 1).unwrap_or(u16::MAX);
    let (sender, segments) = resources.segments.split();
    let (receiver, inbox) = resources.serial.split();
    let (wire, to_send) = resources.wire.split();
    let words = &resources.words;
    let links = Links {
        moves: &mut resources.moves,
        pixels: &mut resources.pixels,
        segments: sender,
        shared: &words.shared,
        inputs: &words.inputs,
        inboxes: core::iter::once(inbox).collect(),
    };
    let inner = Inner::with_extension(build, kinematics, links, extension)?;
    Ok((
        Machine::new(inner, words, wire),
        Steps::new(segments, words, build.timer_hz),
        Serial::new(receiver, to_send, &words.bells),
        Switches::new(words),
    ))
}
