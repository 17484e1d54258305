//! Where planned moves are kept: the planner's large part, which its caller owns.
//!
//! 1024 moves and the pixels of rows take 100 KB. If the planner owned them, the compiler might
//! build it on the stack and copy it to its place, and a microcontroller has no stack of that size.
//! A queue is a constant at first, so a `static` of it costs neither stack nor flash; the planner
//! borrows it. The borrow does not name the queue's size, so planners with queues of different
//! sizes share their code. Moves and pixels are separate, because the memory of a microcontroller
//! is in several pieces.

use crate::ahead::lookahead::{most_moves, Block, USUAL_BLOCKS};
use crate::emit::pixel::Packed;
use crate::moves::PlannedMove;
use crate::path::Window;
use heapless::deque::DequeView;
use heapless::Deque;

/// Room for `MOVES` planned moves of `AXES` axes and `MOTORS` motors: the memory of a
/// [`Planner`](crate::Planner).
///
/// The look-ahead divides the moves into blocks. `BLOCKS` is a power of two; a block takes 20
/// bytes, and half of the blocks are in use. Where there are enough of them, a block has sixteen
/// moves, otherwise up to 64, and a line takes longer to plan. 2 blocks are enough for 16 moves.
///
/// The planner's maker owns it: a `static` on a microcontroller, where it lies in zeroed memory.
#[derive(Debug)]
pub struct Queue<
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const BLOCKS: usize = USUAL_BLOCKS,
> {
    pub(crate) moves: Deque<PlannedMove<AXES, MOTORS>, MOVES>,
    /// The blocks of the look-ahead.
    pub(crate) blocks: [Block; BLOCKS],
    /// The last pieces of the path.
    pub(crate) window: Window<AXES>,
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize>
    Queue<AXES, MOTORS, MOVES, BLOCKS>
{
    /// Compile-time check: `BLOCKS` are enough for `MOVES` moves.
    const FITS: () = assert!(BLOCKS.is_power_of_two() && MOVES > 0 && MOVES <= most_moves(BLOCKS));

    /// An empty queue.
    pub const fn new() -> Self {
        let () = Self::FITS;
        Self {
            moves: Deque::new(),
            blocks: [Block::EMPTY; BLOCKS],
            window: Window::new(),
        }
    }
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize> Default
    for Queue<AXES, MOTORS, MOVES, BLOCKS>
{
    fn default() -> Self {
        Self::new()
    }
}

/// A [`Queue`] for up to sixteen lines, planned by [`CornerRule::Grbl`](crate::CornerRule) whatever
/// the settings: for homing, parking and the like. It remembers no path, so there is no curvature
/// to measure.
#[derive(Debug)]
pub struct SmallQueue<const AXES: usize, const MOTORS: usize, const MOVES: usize> {
    moves: Deque<PlannedMove<AXES, MOTORS>, MOVES>,
    blocks: [Block; 2],
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize> SmallQueue<AXES, MOTORS, MOVES> {
    /// Compile-time check: two blocks hold all moves, wherever the first one begins.
    const FITS: () = assert!(MOVES > 0 && MOVES <= 16);

    /// An empty queue.
    pub const fn new() -> Self {
        let () = Self::FITS;
        Self {
            moves: Deque::new(),
            blocks: [Block::EMPTY; 2],
        }
    }
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize> Default
    for SmallQueue<AXES, MOTORS, MOVES>
{
    fn default() -> Self {
        Self::new()
    }
}

/// A [`Queue`] or a [`SmallQueue`], borrowed without its size.
#[derive(Debug)]
pub struct Room<'q, const AXES: usize, const MOTORS: usize> {
    pub(crate) moves: &'q mut DequeView<PlannedMove<AXES, MOTORS>>,
    pub(crate) blocks: &'q mut [Block],
    pub(crate) window: Option<&'q mut Window<AXES>>,
}

impl<'q, const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize>
    From<&'q mut Queue<AXES, MOTORS, MOVES, BLOCKS>> for Room<'q, AXES, MOTORS>
{
    fn from(queue: &'q mut Queue<AXES, MOTORS, MOVES, BLOCKS>) -> Self {
        Self {
            moves: queue.moves.as_mut_view(),
            blocks: &mut queue.blocks,
            window: Some(&mut queue.window),
        }
    }
}

impl<'q, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    From<&'q mut SmallQueue<AXES, MOTORS, MOVES>> for Room<'q, AXES, MOTORS>
{
    fn from(queue: &'q mut SmallQueue<AXES, MOTORS, MOVES>) -> Self {
        Self {
            moves: queue.moves.as_mut_view(),
            blocks: &mut queue.blocks,
            window: None,
        }
    }
}

/// Room for `PIXELS` changes of power within the moves of a [`Queue`]. The planner's maker owns it,
/// as it owns the queue.
#[derive(Debug)]
pub struct PixelQueue<const PIXELS: usize>(pub(crate) Deque<Packed, PIXELS>);

impl<const PIXELS: usize> PixelQueue<PIXELS> {
    /// An empty queue.
    pub const fn new() -> Self {
        Self(Deque::new())
    }
}

impl<const PIXELS: usize> Default for PixelQueue<PIXELS> {
    fn default() -> Self {
        Self::new()
    }
}
