//! The memory of planned moves: the large part of a planner, which the caller owns.
//!
//! 1024 moves and the pixels of rows take 100 KB. If the planner owned them, the compiler might
//! build it on the stack and copy it to its place, and a microcontroller has no stack of that size.
//! [`Queue::new`] is a constant, so a `static` queue costs neither stack nor flash. The planner
//! borrows the queue. The borrow does not name the queue's size, so planners with queues of
//! different sizes share their code. Moves and pixels are separate, because the memory of a
//! microcontroller is in several pieces.

use crate::ahead::lookahead::{most_moves, Block, USUAL_BLOCKS};
use crate::built::CURVES;
use crate::emit::pixel::Packed;
use crate::moves::PlannedMove;
use crate::path::Window;
use heapless::deque::DequeView;
use heapless::Deque;

/// Room for `MOVES` planned moves of `AXES` axes and `MOTORS` motors: the memory of a
/// [`Planner`](crate::Planner).
///
/// The look-ahead divides the moves into blocks. `BLOCKS` is a power of two, at least `MOVES / 32`.
/// A block takes 20 bytes, and half of the blocks are in use. With `MOVES / 8` blocks, a block has
/// sixteen moves. With fewer blocks, a block has up to 64 moves, and a line takes longer to plan.
///
/// The queue is the large part of a planner. The code that makes the planner owns the queue: on a
/// microcontroller as a `static` in zeroed memory.
#[derive(Debug)]
pub struct Queue<
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const BLOCKS: usize = USUAL_BLOCKS,
> {
    moves: Deque<PlannedMove<AXES, MOTORS>, MOVES>,
    /// The blocks of the look-ahead.
    blocks: [Block; BLOCKS],
    /// The last pieces of the path.
    window: Window<AXES>,
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize>
    Queue<AXES, MOTORS, MOVES, BLOCKS>
{
    /// Compile-time check: `BLOCKS` are enough for `MOVES` moves.
    const FITS: () = assert!(BLOCKS.is_power_of_two() && MOVES > 0 && MOVES <= most_moves(BLOCKS));

    /// Makes an empty queue.
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

/// A [`Queue`] for up to sixteen moves, planned by [`CornerRule::Grbl`](crate::CornerRule) whatever
/// the settings: for homing, parking and the like. It remembers no path, so the planner cannot
/// measure curvature.
#[derive(Debug)]
pub struct SmallQueue<const AXES: usize, const MOTORS: usize, const MOVES: usize> {
    moves: Deque<PlannedMove<AXES, MOTORS>, MOVES>,
    blocks: [Block; 2],
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize> SmallQueue<AXES, MOTORS, MOVES> {
    /// Compile-time check: two blocks hold all moves, wherever in its block the first move lies.
    const FITS: () = assert!(MOVES > 0 && MOVES <= 16);

    /// Makes an empty queue.
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
    pub(crate) window: Lent<'q, AXES>,
}

/// The window of a [`Queue`], borrowed: none of a [`SmallQueue`], and none in a build without the
/// feature `curves`.
#[derive(Debug)]
pub(crate) struct Lent<'q, const AXES: usize>(Option<&'q mut Window<AXES>>);

impl<const AXES: usize> Lent<'_, AXES> {
    /// The window.
    pub(crate) fn get(&self) -> Option<&Window<AXES>> {
        match CURVES {
            true => self.0.as_deref(),
            false => None,
        }
    }

    /// The window, to be changed.
    pub(crate) fn get_mut(&mut self) -> Option<&mut Window<AXES>> {
        match CURVES {
            true => self.0.as_deref_mut(),
            false => None,
        }
    }
}

impl<'q, const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize>
    From<&'q mut Queue<AXES, MOTORS, MOVES, BLOCKS>> for Room<'q, AXES, MOTORS>
{
    fn from(queue: &'q mut Queue<AXES, MOTORS, MOVES, BLOCKS>) -> Self {
        Self {
            moves: queue.moves.as_mut_view(),
            blocks: &mut queue.blocks,
            window: Lent(Some(&mut queue.window)),
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
            window: Lent(None),
        }
    }
}

/// Room for `PIXELS` changes of power within the moves of a [`Queue`]. The code that makes the
/// planner owns both.
#[derive(Debug)]
pub struct PixelQueue<const PIXELS: usize>(pub(crate) Deque<Packed, PIXELS>);

impl<const PIXELS: usize> PixelQueue<PIXELS> {
    /// Makes an empty queue.
    pub const fn new() -> Self {
        Self(Deque::new())
    }
}

impl<const PIXELS: usize> Default for PixelQueue<PIXELS> {
    fn default() -> Self {
        Self::new()
    }
}
