//! The words shared by the step interrupt and all other contexts, besides the segment queue.
//!
//! Each word has one writer, so that plain loads and stores are enough (no compare-and-swap, which
//! a Cortex-M0 lacks):
//!
//! | word | written by | read by |
//! |---|---|---|
//! | stop, laser off | main loop and switch interrupts (store only) | step interrupt, when restricted |
//! | direction wait | main loop, at rest | step interrupt, when a line begins |
//! | motor lock | main loop; the switch interrupt alone while the limit switches are watched for homing | step interrupt, when restricted |
//! | position, running, counters | step interrupt | anybody |
//!
//! An ordinary tick looks at one word only, *restricted*: everybody who stops, locks or switches
//! off sets this word afterwards. The step interrupt clears it before it looks at the three other
//! words, and sets it again if one of them is still in force. So no request is lost, whichever
//! context interrupts the other in between.
//!
//! `running` has two writers that never meet: the main loop sets it before it starts the timer, the
//! interrupt clears it as it stops the timer.
//!
//! All contexts run on one core. An interrupt sees every store that came before it, so no memory
//! barrier (`dmb`) is needed; only the compiler could change the order. The words that a tick reads
//! or writes are independent of each other: their accesses are relaxed. `running` is different:
//! words set before the start are in force from the first tick on, and at rest the position is
//! final. So `running` is stored with release and loaded with acquire order.

use crate::{MotorMask, Ticks};
use core::sync::atomic::{compiler_fence, AtomicBool, AtomicI32, AtomicU32, AtomicU8, Ordering};

/// Words shared by the step interrupt, the switch interrupts and the main loop.
#[derive(Debug)]
pub struct Shared<const MOTORS: usize> {
    /// Set when one of the next three words may be in force: a stop, a laser that is held off, a
    /// locked motor.
    restricted: AtomicBool,
    stop: AtomicBool,
    laser_off: AtomicBool,
    /// The motors that may not step.
    locked_motors: AtomicU8,
    /// The least time from a tick to the next one after a change of direction, timer counts.
    direction_wait: AtomicU32,
    running: AtomicBool,
    underruns: AtomicU32,
    late_ticks: AtomicU32,
    position: [AtomicI32; MOTORS],
}

impl<const MOTORS: usize> Default for Shared<MOTORS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const MOTORS: usize> Shared<MOTORS> {
    /// Makes the words of a machine at rest at position 0, nothing locked.
    pub const fn new() -> Self {
        Self {
            restricted: AtomicBool::new(false),
            stop: AtomicBool::new(false),
            laser_off: AtomicBool::new(false),
            locked_motors: AtomicU8::new(0),
            direction_wait: AtomicU32::new(0),
            running: AtomicBool::new(false),
            underruns: AtomicU32::new(0),
            late_ticks: AtomicU32::new(0),
            position: [const { AtomicI32::new(0) }; MOTORS],
        }
    }

    /// Stops stepping before the next step (`true`), or allows it again (`false`). Any context.
    ///
    /// While stopped, each call of the step interrupt throws away one segment. When the queue is
    /// empty the interrupt rests. The laser is off.
    pub fn set_stop(&self, stop: bool) {
        self.stop.store(stop, Ordering::Relaxed);
        self.restrict();
    }

    /// Returns true if stepping is stopped. Any context.
    #[inline]
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Holds the laser off, whatever later ticks ask for (`true`), or releases it. Any context.
    ///
    /// The step interrupt obeys at its next tick. A caller that cannot wait for that tick, or finds
    /// the timer at rest, switches the laser off at the board as well. After this call no tick
    /// switches it on again.
    pub fn set_laser_off(&self, off: bool) {
        self.laser_off.store(off, Ordering::Relaxed);
        self.restrict();
    }

    /// Returns true if the laser is held off. Any context.
    #[inline]
    pub fn is_laser_off(&self) -> bool {
        self.laser_off.load(Ordering::Relaxed)
    }

    /// Keeps the motors of `lock` from stepping: their pulses are neither made nor counted. Any
    /// context, but one at a time: a context that adds a motor to the locked ones must not be
    /// interrupted by another one that does so.
    pub fn set_motor_lock(&self, lock: MotorMask) {
        self.locked_motors.store(lock.bits(), Ordering::Relaxed);
        self.restrict();
    }

    /// Returns the motors that are kept from stepping. Any context.
    #[inline]
    pub fn motor_lock(&self) -> MotorMask {
        MotorMask::from_bits(self.locked_motors.load(Ordering::Relaxed))
    }

    /// Sets the least time between the last tick of a line and the first tick of the next, if the
    /// next line reverses a motor: the pulse, the time to end it, and the time that the drivers ask
    /// for. Main loop, at rest.
    pub fn set_direction_wait(&self, wait: Ticks) {
        self.direction_wait.store(wait.0, Ordering::Relaxed);
    }

    /// The time of [`Shared::set_direction_wait`]. Step interrupt only.
    #[inline]
    pub(crate) fn direction_wait(&self) -> Ticks {
        Ticks(self.direction_wait.load(Ordering::Relaxed))
    }

    /// Makes the next tick look at stop, laser and motor lock.
    fn restrict(&self) {
        compiler_fence(Ordering::SeqCst);
        self.restricted.store(true, Ordering::Relaxed);
    }

    /// Returns true if a tick has to look at stop, laser and motor lock. Step interrupt only.
    #[inline]
    pub(crate) fn is_restricted(&self) -> bool {
        self.restricted.load(Ordering::Relaxed)
    }

    /// Makes later ticks look at stop, laser and motor lock only while one of them is in force.
    /// Step interrupt only.
    pub(crate) fn refresh_restricted(&self) {
        self.restricted.store(false, Ordering::Relaxed);
        compiler_fence(Ordering::SeqCst);
        if self.is_stopped() || self.is_laser_off() || !self.motor_lock().is_empty() {
            self.restricted.store(true, Ordering::Relaxed);
        }
    }

    /// The motors of `due` that are not kept from stepping. Step interrupt only.
    #[inline]
    pub(crate) fn free(&self, due: MotorMask) -> MotorMask {
        due.without(self.motor_lock())
    }

    /// Returns true if the step timer runs. Any context.
    pub fn is_running(&self) -> bool {
        self.running.load(Ordering::Acquire)
    }

    /// Notes that the step timer is being started. Main loop only, before the timer is started.
    pub fn set_running(&self) {
        self.running.store(true, Ordering::Release);
    }

    /// Returns how often segments ran out in the middle of motion, since power-up. Any context.
    pub fn underruns(&self) -> u32 {
        self.underruns.load(Ordering::Relaxed)
    }

    /// Returns how often a tick was due before the work of the tick before it was done, since
    /// power-up. Any context.
    pub fn late_ticks(&self) -> u32 {
        self.late_ticks.load(Ordering::Relaxed)
    }

    /// Returns the steps made by each motor since power-up, positive less negative. Any context.
    ///
    /// While motors run, each number is right by itself, but a step may come between the reading of
    /// two of them.
    pub fn position(&self) -> [i32; MOTORS] {
        core::array::from_fn(|motor| match self.position.get(motor) {
            Some(count) => count.load(Ordering::Relaxed),
            None => 0,
        })
    }

    /// Declares the present position to be `steps`. Main loop only, with the motors at rest
    /// (homing).
    pub fn set_position(&self, steps: [i32; MOTORS]) {
        for (count, value) in self.position.iter().zip(steps) {
            count.store(value, Ordering::Relaxed);
        }
    }

    /// Counts the steps of the motors in `stepped`: adds each motor's `sign` (1 or -1) to its
    /// position. Step interrupt only.
    #[inline]
    pub(crate) fn count(&self, stepped: MotorMask, sign: &[i32; MOTORS]) {
        for (motor, (count, sign)) in self.position.iter().zip(sign).enumerate() {
            // A multiplication with addition is cheaper than a branch.
            let step = i32::from(stepped.contains(motor)) * sign;
            count.store(
                count.load(Ordering::Relaxed).wrapping_add(step),
                Ordering::Relaxed,
            );
        }
    }

    /// As [`Shared::count`], for as many steps of each motor. Simulators only.
    pub(crate) fn count_many(&self, steps: &[u32; MOTORS], sign: &[i32; MOTORS]) {
        for (count, (steps, sign)) in self.position.iter().zip(steps.iter().zip(sign)) {
            let way = steps.cast_signed().wrapping_mul(*sign);
            count.store(
                count.load(Ordering::Relaxed).wrapping_add(way),
                Ordering::Relaxed,
            );
        }
    }

    /// Notes that the timer rests. Step interrupt only.
    pub(crate) fn rest(&self) {
        self.running.store(false, Ordering::Release);
    }

    /// Counts an underrun. Step interrupt only.
    pub(crate) fn count_underrun(&self) {
        self.underruns
            .store(self.underruns().wrapping_add(1), Ordering::Relaxed);
    }

    /// Counts a late tick. Step interrupt only.
    #[cold]
    #[inline(never)]
    pub(crate) fn count_late(&self) {
        self.late_ticks
            .store(self.late_ticks().wrapping_add(1), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_counted_up_and_down() {
        let shared = Shared::<3>::new();
        shared.count(MotorMask::from_bits(0b011), &[1, -1, 1]);
        shared.count(MotorMask::from_bits(0b110), &[1, -1, 1]);
        assert_eq!(shared.position(), [1, -2, 1]);
    }

    #[test]
    fn a_tick_is_restricted_from_the_first_asking_until_nothing_is_asked_for() {
        let shared = Shared::<2>::new();
        assert!(!shared.is_restricted());
        let ask: [fn(&Shared<2>, bool); 3] = [
            |shared, on| shared.set_stop(on),
            |shared, on| shared.set_laser_off(on),
            |shared, on| shared.set_motor_lock(MotorMask::from_bits(u8::from(on))),
        ];
        for ask in ask {
            ask(&shared, true);
            assert!(shared.is_restricted());
            shared.refresh_restricted();
            assert!(shared.is_restricted());
            ask(&shared, false);
            shared.refresh_restricted();
            assert!(!shared.is_restricted());
        }
    }

    #[test]
    fn position_wraps_instead_of_panicking() {
        let shared = Shared::<1>::new();
        shared.set_position([i32::MAX]);
        shared.count(MotorMask::only(0), &[1]);
        assert_eq!(shared.position(), [i32::MIN]);
    }
}
