//! The memory of segments on their way to the step interrupt.
//!
//! ```text
//!   planner --> lead: wait until their power is known --> ready --> step interrupt
//! ```

use heapless::spsc::{Consumer, Producer, Queue};
use heapless::Deque;
use leadscrew_planner::PowerLead;
use leadscrew_stepper::Segment;

/// Segments that a [`SegmentQueue`], between the main loop and the step interrupt, holds by
/// default, and the most that it may hold.
pub const SEGMENTS: usize = 16;

/// Segments on their way to the step interrupt.
///
/// `SLOTS` is the number of segments that may be ready, and one more, which a ring keeps free. With
/// few slots a machine cannot burn small pixels at speed: each pixel takes a segment, and all
/// segments together last 2 ms at most. `LEAD` is the number that may wait for the power's lead
/// (`$703`), at least 1: choose 1 on a machine without a laser.
///
/// ```
/// use leadscrew_machine::config::SegmentQueue;
///
/// type Small = SegmentQueue<3, 9, 1>;
/// let mut queue = Small::new();
/// let (sender, segments) = queue.split(); // for `Links`, and for the step interrupt
/// assert_eq!(segments.capacity(), 8);
/// assert!(size_of::<Small>() < size_of::<SegmentQueue<3>>() / 2);
/// # drop(sender);
/// ```
#[derive(Debug)]
pub struct SegmentQueue<
    const MOTORS: usize,
    const SLOTS: usize = { SEGMENTS + 1 },
    const LEAD: usize = SEGMENTS,
> {
    lead: Deque<Segment<MOTORS>, LEAD>,
    ready: Queue<Segment<MOTORS>, SLOTS>,
}

/// The main loop's end of a [`SegmentQueue`].
pub struct SegmentSender<'a, const MOTORS: usize> {
    pub(crate) lead: PowerLead<'a, MOTORS>,
    pub(crate) ready: Producer<'a, Segment<MOTORS>>,
}

impl<const MOTORS: usize, const SLOTS: usize, const LEAD: usize> SegmentQueue<MOTORS, SLOTS, LEAD> {
    /// Makes an empty queue.
    pub const fn new() -> Self {
        const {
            assert!(SLOTS <= SEGMENTS + 1, "more slots than are ever used");
            assert!(LEAD > 0, "one segment must be able to wait");
        }
        Self {
            lead: Deque::new(),
            ready: Queue::new(),
        }
    }

    /// Parts the queue into the main loop's end and the step interrupt's.
    pub fn split(&mut self) -> (SegmentSender<'_, MOTORS>, Consumer<'_, Segment<MOTORS>>) {
        let (ready, segments) = self.ready.split();
        let lead = PowerLead::new(&mut self.lead);
        (SegmentSender { lead, ready }, segments)
    }
}

impl<const MOTORS: usize, const SLOTS: usize, const LEAD: usize> Default
    for SegmentQueue<MOTORS, SLOTS, LEAD>
{
    fn default() -> Self {
        Self::new()
    }
}
