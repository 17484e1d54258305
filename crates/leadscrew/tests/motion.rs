//! Motion without G-code, on pins that note their edges.

use crate::bench::{Pin, Timer, World};
use leadscrew::{
    motion, Actuators, Cartesian, Fault, Motion, MotionConfig, MotionError, MotionFault,
    MotionResources, MotionStatus, NoPin, Outputs, PinStepping, Speed, StepDir, Turn,
};
use std::rc::Rc;

struct Plotter {
    world: Rc<World>,
    motion: Motion<'static, Cartesian, 2, 2>,
    steps: PinStepping<StepDir<Pin, Pin, 2>, Timer, 2>,
}

/// No pins: only what makes the step interrupt come.
fn pend(world: &Rc<World>) -> impl Actuators {
    let world = world.clone();
    Outputs::<_, NoPin>::without_enable(move || world.pend())
}

fn config() -> MotionConfig<2> {
    MotionConfig::new()
        .timer_hz(1_000_000)
        .with_steps_per_mm([100.0, 100.0])
        .with_max_speed_mm_s([100.0, 100.0])
        .with_acceleration_mm_s2([1000.0, 1000.0])
        .with_travel_mm([[-50.0, 100.0], [-50.0, 100.0]])
}

impl Plotter {
    fn new() -> Self {
        let world = World::new();
        let resources = Box::leak(Box::new(MotionResources::<2, 2, 128>::new()));
        let (motion, steps, _) = motion(resources, config(), Cartesian).unwrap();
        let pin = |name| world.pin(name);
        let pins = StepDir::new([
            (pin("step x"), pin("direction x")),
            (pin("step y"), pin("direction y")),
        ]);
        Self {
            steps: steps.on(pins, Timer(world.clone())),
            motion,
            world,
        }
    }

    /// Lets a millisecond pass, with polls as the handlers ask for them.
    fn pass(&mut self) -> MotionStatus {
        let end = self.world.now.get() + 1000;
        let mut outputs = pend(&self.world);
        let status = self.motion.poll(&mut outputs);
        while let Some(at) = self.world.next_ring().filter(|at| *at <= end) {
            self.world.now.set(at.max(self.world.now.get()));
            if self.steps.tick() {
                self.motion.poll(&mut outputs);
            }
        }
        self.world.now.set(end);
        status
    }

    fn run(&mut self) -> MotionStatus {
        for _ in 0..60_000 {
            let status = self.pass();
            if !matches!(status, MotionStatus::Moving | MotionStatus::Stopping) {
                return status;
            }
        }
        panic!("it moves for ever");
    }
}

#[test]
fn moves_and_arcs_end_where_they_were_sent_with_exactly_their_steps() {
    let mut plotter = Plotter::new();
    let speed = Speed::mm_s(50.0);
    plotter.motion.move_to([10.0, 5.0], speed).unwrap();
    plotter.motion.move_to([20.0, 0.0], Speed::RAPID).unwrap();
    assert_eq!(plotter.run(), MotionStatus::Idle);
    assert_eq!(plotter.motion.position(), [20.0, 0.0]);
    assert_eq!(plotter.world.rises("step x").len(), 2000);
    assert_eq!(plotter.world.rises("step y").len(), 1000);

    // Half a circle of 10 mm to the left, through Y 10: there and back in Y.
    let turn = Turn::CounterClockwise;
    plotter
        .motion
        .arc_to([0.0, 0.0], [10.0, 0.0], turn, speed)
        .unwrap();
    let mut highest = 0.0f32;
    while plotter.pass() != MotionStatus::Idle {
        let [x, y] = plotter.motion.position();
        highest = highest.max(y);
        let radius = ((x - 10.0).powi(2) + y * y).sqrt();
        assert!((radius - 10.0).abs() < 0.03, "{radius} at {x} {y}");
    }
    assert_eq!(plotter.motion.position(), [0.0, 0.0]);
    assert!((9.95..=10.01).contains(&highest), "{highest}");
}

#[test]
fn a_move_keeps_its_speed_and_its_acceleration() {
    let mut plotter = Plotter::new();
    plotter
        .motion
        .move_to([50.0, 0.0], Speed::mm_s(50.0))
        .unwrap();
    plotter.run();
    let rises = plotter.world.rises("step x");
    let fastest = rises
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .min()
        .unwrap();
    assert_eq!(fastest, 200, "100 steps/mm at 50 mm/s");
    // 50 mm at 50 mm/s, and v/a = 50 ms more for the ramps.
    let ms = (rises[rises.len() - 1] - rises[0]) / 1000;
    assert!((1040..=1055).contains(&ms), "{ms}");

    let mut plotter = Plotter::new();
    plotter
        .motion
        .move_to([50.0, 0.0], Speed::mm_min(3000.0))
        .unwrap();
    plotter.run();
    assert_eq!(
        plotter.world.rises("step x"),
        rises,
        "3000 mm/min are 50 mm/s"
    );
}

#[test]
fn a_hold_waits_on_the_path_and_a_stop_forgets_the_rest() {
    let mut plotter = Plotter::new();
    plotter
        .motion
        .move_to([50.0, 25.0], Speed::mm_s(50.0))
        .unwrap();
    plotter
        .motion
        .move_to([0.0, 0.0], Speed::mm_s(50.0))
        .unwrap();
    for _ in 0..300 {
        plotter.pass();
    }
    plotter.motion.hold();
    assert_eq!(plotter.motion.status(), MotionStatus::Stopping);
    assert_eq!(plotter.run(), MotionStatus::Held);
    let [x, y] = plotter.motion.position();
    assert!(x > 5.0 && x < 40.0 && (x - 2.0 * y).abs() < 0.03, "{x} {y}");
    plotter.motion.resume();
    for _ in 0..100 {
        plotter.pass();
    }
    plotter.motion.stop();
    assert_eq!(plotter.run(), MotionStatus::Idle);
    let [further, _] = plotter.motion.position();
    assert!(further > x && further < 45.0, "{further}");
    plotter.motion.move_to([0.0, 0.0], Speed::RAPID).unwrap();
    assert_eq!(plotter.run(), MotionStatus::Idle);
    assert_eq!(plotter.motion.position(), [0.0, 0.0]);
}

#[test]
fn a_refused_move_says_why_and_changes_nothing() {
    let mut plotter = Plotter::new();
    let motion = &mut plotter.motion;
    let speed = Speed::mm_s(10.0);
    let left = Turn::CounterClockwise;
    let refused = [
        (
            motion.move_to([f32::NAN, 0.0], speed),
            MotionError::NoPlace(0),
            "axis 0 is no place",
        ),
        (
            motion.move_to([0.0, 100.1], speed),
            MotionError::OutOfTravel(1),
            "with_travel_mm",
        ),
        (
            motion.move_to([1.0, 0.0], Speed::mm_s(-1.0)),
            MotionError::Speed,
            "give mm/s",
        ),
        (
            motion.move_to([1.0, 0.0], Speed::mm_s(f32::NAN)),
            MotionError::Speed,
            "above 0",
        ),
        (
            // Its ends are within the travel, its highest place is not.
            motion.arc_to([60.0, 0.0], [30.0, 60.0], Turn::Clockwise, speed),
            MotionError::OutOfTravel(1),
            "axis 1 would leave",
        ),
    ];
    for (result, error, words) in refused {
        assert_eq!(result, Err(error));
        assert!(error.to_string().contains(words), "{error}");
    }
    let circle = motion.arc_to([0.0, 0.0], [25.0, 0.0], left, speed);
    let Err(error @ MotionError::ArcTooLong { chords, room: 128 }) = circle else {
        panic!("{circle:?}");
    };
    assert!(
        chords > 128 && error.to_string().contains("raise MOVES"),
        "{error}"
    );
    assert_eq!((motion.room(), motion.status()), (128, MotionStatus::Idle));
    let mut queued = 0u8;
    while motion.move_to([f32::from(queued % 2), 50.0], speed).is_ok() {
        queued += 1;
    }
    assert!((64..=128).contains(&queued), "{queued}");
    assert_eq!(motion.move_to([0.0, 1.0], speed), Err(MotionError::Full));
    let declared = motion.set_position([0.0, 0.0]);
    assert_eq!(declared, Err(MotionError::NotIdle));
}

#[test]
fn a_motion_that_was_not_fed_or_stopped_at_once_says_so_and_recovers() {
    let mut plotter = Plotter::new();
    plotter
        .motion
        .move_to([50.0, 0.0], Speed::mm_s(50.0))
        .unwrap();
    plotter.motion.poll(&mut pend(&plotter.world));
    while let Some(at) = plotter.world.next_ring() {
        plotter.world.now.set(at);
        plotter.steps.tick();
    }
    let fault = MotionFault::PollTooLate;
    let mut outputs = pend(&plotter.world);
    assert_eq!(
        plotter.motion.poll(&mut outputs),
        MotionStatus::Failed(fault)
    );
    let refused = plotter.motion.move_to([0.0, 0.0], Speed::RAPID);
    assert_eq!(refused, Err(MotionError::Failed(fault)));
    assert!(fault.to_string().contains("call it every 4 ms"));
    let [x, _] = plotter.motion.position();
    assert!(x > 0.0 && x < 1.0, "{x}");
    assert!(plotter.motion.recover());

    plotter
        .motion
        .move_to([50.0, 0.0], Speed::mm_s(50.0))
        .unwrap();
    for _ in 0..100 {
        plotter.pass();
    }
    let made = plotter.world.rises("step x").len();
    plotter.motion.stop_now();
    assert_eq!(plotter.run(), MotionStatus::Failed(MotionFault::StoppedNow));
    for _ in 0..5 {
        plotter.pass();
    }
    assert_eq!(
        plotter.world.rises("step x").len(),
        made,
        "no step after the call"
    );
    assert!(plotter.motion.recover());
    plotter.motion.set_position([7.0, 0.0]).unwrap();
    plotter
        .motion
        .move_to([0.0, 0.0], Speed::mm_s(50.0))
        .unwrap();
    assert_eq!(plotter.run(), MotionStatus::Idle);
    assert_eq!(plotter.world.rises("step x").len(), made + 700);

    plotter.world.broken.borrow_mut().insert("step x");
    plotter
        .motion
        .move_to([1.0, 0.0], Speed::mm_s(50.0))
        .unwrap();
    let broken = MotionStatus::Failed(MotionFault::Board(Fault::StepPin));
    assert_eq!(plotter.run(), broken);
    assert!(!plotter.motion.recover());
}

#[test]
fn a_build_that_cannot_move_is_refused_with_a_value_that_works() {
    let table = [
        (config().timer_hz(0), "timer_hz: 0; give"),
        (
            config().with_steps_per_mm([100.0, 0.0]),
            "with_steps_per_mm: axis 1",
        ),
        (
            config().with_steps_per_mm([f32::NAN, 1.0]),
            "with_steps_per_mm: axis 0",
        ),
        (
            config().with_steps_per_second(60_000),
            "60000; give 3000 to 50000",
        ),
        (
            config().with_travel_mm([[0.0, 1.0], [1.0, 0.0]]),
            "with_travel_mm: axis 1",
        ),
        (config().with_homing_mm_s(10.0, 0.0), "with_homing_mm_s"),
        (config().with_homing_mm_s(f32::NAN, 1.0), "with_homing_mm_s"),
        (config().with_pull_off_mm(f32::INFINITY), "with_pull_off_mm"),
        (config().with_max_speed_mm_s([0.0, 1.0]), "validate:"),
        (
            config().with_acceleration_mm_s2([1.0, f32::NAN]),
            "validate:",
        ),
    ];
    for (config, words) in table {
        let error = config.validate().unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    }
    assert_eq!(
        config()
            .with_pulse_us(5)
            .with_steps_per_second(100_000)
            .validate(),
        Ok(())
    );
}

#[test]
fn a_task_awaits_the_end_of_its_moves() {
    use std::{cell::RefCell, future::poll_fn, task::Poll};
    let Plotter {
        world,
        mut motion,
        steps,
    } = Plotter::new();
    let steps = RefCell::new(steps);
    motion.move_to([10.0, 0.0], Speed::mm_s(50.0)).unwrap();
    let passing = poll_fn::<(), _>(|context| {
        if let Some(at) = world.next_ring() {
            world.now.set(at.max(world.now.get()));
            steps.borrow_mut().tick();
        }
        context.waker().wake_by_ref();
        Poll::Pending
    });
    let mut outputs = pend(&world);
    let arriving = motion.arrive(&mut outputs);
    embassy_futures::block_on(embassy_futures::select::select(arriving, passing));
    assert_eq!(motion.position(), [10.0, 0.0]);
}
