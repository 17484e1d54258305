//! Homing and probes without G-code: a pick-and-place whose switches close at places of its own.

use crate::bench::{Pin, Timer, World};
use leadscrew::{
    motion, CoreXy, End, Fault, Ganged, Instant, Kinematics, Motion, MotionConfig, MotionError,
    MotionFault, MotionResources, MotionStatus, Outputs, PinStepping, Speed, StepDir, SwitchPins,
    Watch,
};
use std::rc::Rc;

/// Steps of each motor to a millimetre.
const SCALE: f64 = 100.0;

const STEPS: [&str; 4] = ["step 0", "step 1", "step 2", "step 3"];
const DIRECTIONS: [&str; 4] = ["direction 0", "direction 1", "direction 2", "direction 3"];
const LIMITS: [&str; 4] = ["limit 0", "limit 1", "limit 2", "limit 3"];

/// The machine around the board: where the motors really stand, in steps, and which switches are
/// closed there.
struct Rig<K: Kinematics<3, 4>> {
    world: Rc<World>,
    motion: Motion<'static, K, 3, 4>,
    steps: PinStepping<StepDir<Pin, Pin, 4>, Timer, 4>,
    watch: Watch<'static, Pin, 4>,
    outputs: Outputs<Box<dyn FnMut()>, Pin>,
    motors: [i32; 4],
    seen: usize,
    /// Whether the switch of each motor, and the probe, are closed.
    closed: fn([i32; 4]) -> [bool; 5],
}

/// X and Y have switches at their lowest places, Z at its highest.
fn config() -> MotionConfig<3> {
    MotionConfig::new()
        .timer_hz(1_000_000)
        .with_steps_per_mm([100.0; 3])
        .with_max_speed_mm_s([100.0; 3])
        .with_acceleration_mm_s2([1000.0; 3])
        .with_travel_mm([[0.0, 60.0], [-20.0, 20.0], [-30.0, 0.0]])
        .with_homing_mm_s(20.0, 2.0)
        .with_pull_off_mm(1.5)
}

/// The second motor of Y is the fourth.
const GANGED: Ganged<1> = Ganged { axis_of: [1] };

impl<K: Kinematics<3, 4> + 'static> Rig<K> {
    fn new(
        config: MotionConfig<3>,
        kinematics: K,
        motors: [i32; 4],
        closed: fn([i32; 4]) -> [bool; 5],
    ) -> Self {
        let world = World::new();
        let resources = Box::leak(Box::new(MotionResources::<3, 4, 64>::new()));
        let (motion, steps, switches) = motion(resources, config, kinematics).unwrap();
        let pins = |motor| (world.pin(STEPS[motor]), world.pin(DIRECTIONS[motor]));
        let steps = steps.on(StepDir::new([0, 1, 2, 3].map(pins)), Timer(world.clone()));
        set_switches(&world, closed(motors));
        let limits = LIMITS.map(|name| Some(world.pin(name)));
        let watch = switches.on(SwitchPins::new(limits).with_probe(world.pin("probe")));
        let start = world.clone();
        let pend: Box<dyn FnMut()> = Box::new(move || start.pend());
        Self {
            outputs: Outputs::new(pend, world.pin("enable")),
            world,
            motion,
            steps,
            watch,
            motors,
            seen: 0,
            closed,
        }
    }

    /// The motors follow the new edges, the switches follow the motors.
    fn follow(&mut self) {
        let edges = self.world.edges.borrow();
        for edge in &edges[self.seen..] {
            let Some(motor) = STEPS.iter().position(|pin| *pin == edge.pin) else {
                continue;
            };
            let back = self.world.level(DIRECTIONS[motor]) == Some(true);
            self.motors[motor] += i32::from(edge.high) * if back { -1 } else { 1 };
        }
        self.seen = edges.len();
        drop(edges);
        set_switches(&self.world, (self.closed)(self.motors));
        self.watch.look(Instant::from_ticks(self.world.now.get()));
    }

    fn poll(&mut self) -> MotionStatus {
        self.motion.poll(&mut self.outputs)
    }

    fn run(&mut self) -> MotionStatus {
        for _ in 0..20_000 {
            let end = self.world.now.get() + 1000;
            let status = self.poll();
            if !matches!(status, MotionStatus::Moving | MotionStatus::Stopping) {
                return status;
            }
            while let Some(at) = self.world.next_ring().filter(|at| *at <= end) {
                self.world.now.set(at.max(self.world.now.get()));
                let looked = self.steps.tick();
                self.follow();
                if looked || self.motion.is_woken() {
                    self.poll();
                }
            }
            self.world.now.set(end);
        }
        panic!("it moves for ever");
    }

    /// Lets the step interrupt come as long as it wants to.
    fn come_to_rest(&mut self) {
        while let Some(at) = self.world.next_ring() {
            self.world.now.set(at.max(self.world.now.get()));
            self.steps.tick();
            self.follow();
        }
    }

    fn fault(&mut self) -> MotionFault {
        match self.run() {
            MotionStatus::Failed(fault) => fault,
            status => panic!("{status:?}"),
        }
    }
}

fn set_switches(world: &World, closed: [bool; 5]) {
    for (name, closed) in LIMITS.into_iter().chain(["probe"]).zip(closed) {
        world.set(name, !closed);
    }
}

/// Steps in mm.
fn steps(mm: f64) -> i32 {
    (mm * SCALE).round() as i32
}

/// Switches at X = -3, Y = 7 and 7.4 (its motors), Z = 12; a part that the probe meets at Z = -8.25.
fn closed([x, y, z, y2]: [i32; 4]) -> [bool; 5] {
    [x <= -300, y <= 700, z >= 1200, y2 <= 740, z <= -825]
}

fn rig() -> Rig<Ganged<1>> {
    Rig::new(config(), GANGED, [2000, 3000, -400, 3000], closed)
}

#[test]
fn axes_home_to_the_step_and_a_probe_tells_where_it_touched() {
    let mut rig = rig();
    assert_eq!(
        rig.world.level("enable"),
        None,
        "the drivers wait for motion"
    );
    rig.motion.home([None, None, Some(End::High)]).unwrap();
    assert_eq!(rig.run(), MotionStatus::Idle);
    assert_eq!(rig.world.level("enable"), Some(false), "the drivers are on");
    assert_eq!(rig.motors, [2000, 3000, 1200 - 150, 3000]);
    assert_eq!(rig.motion.position(), [0.0, 0.0, -1.5]);

    let ends = [Some(End::Low), Some(End::Low), None];
    rig.motion.home(ends).unwrap();
    assert_eq!(rig.run(), MotionStatus::Idle);
    // Each motor of Y stands off its own switch: the gantry is square.
    assert_eq!(rig.motors, [-300 + 150, 700 + 150, 1050, 740 + 150]);
    assert_eq!(rig.motion.position(), [1.5, -18.5, -1.5]);

    rig.motion
        .probe_to([1.5, -18.5, -30.0], Speed::mm_s(5.0))
        .unwrap();
    assert_eq!(rig.motion.touched(), None);
    assert_eq!(rig.run(), MotionStatus::Idle);
    let [x, y, z] = rig.motion.touched().unwrap();
    let expected = -1.5 - (1050.0 + 825.0) / SCALE;
    assert_eq!((x, y), (1.5, -18.5));
    assert!((f64::from(z) - expected).abs() < 1e-4, "{z} and {expected}");
    // It slowed down behind it: v²/2a is 12.5 µm. Its position is counted from steps.
    let [.., rest] = rig.motion.position();
    assert_eq!(steps(f64::from(rest)), steps(-1.5) + rig.motors[2] - 1050);
    assert!((z - rest) < 0.1 && z >= rest, "{z} {rest}");

    rig.motion.move_to([10.0, 0.0, 0.0], Speed::RAPID).unwrap();
    assert_eq!(rig.run(), MotionStatus::Idle);
    assert_eq!(rig.motors, [700, 700 + 2000, 1200, 740 + 2000]);
}

#[test]
fn homing_keeps_its_two_speeds() {
    let mut rig = rig();
    rig.motion.home([Some(End::Low), None, None]).unwrap();
    assert_eq!(rig.run(), MotionStatus::Idle);
    let rises = rig.world.rises("step 0");
    let waits: Vec<u64> = rises.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert_eq!(waits.iter().min(), Some(&500), "100 steps/mm at 20 mm/s");
    // From the first contact: 150 steps back, 150 steps slowly, 150 back.
    let slow = waits.len() - 150 - 100..waits.len() - 150 - 50;
    for wait in &waits[slow] {
        assert!(wait.abs_diff(5000) <= 1, "100 steps/mm at 2 mm/s: {wait}");
    }
}

#[test]
fn an_axis_on_its_switch_comes_off_it_and_homes() {
    let mut rig = Rig::new(config(), GANGED, [-310, 3000, 0, 3000], closed);
    rig.motion.home([Some(End::Low), None, None]).unwrap();
    assert_eq!(rig.run(), MotionStatus::Idle);
    assert_eq!(rig.motors[0], -300 + 150);
    assert_eq!(rig.motion.position()[0], 1.5);
}

#[test]
fn crossed_belts_home_one_axis_after_the_other() {
    #[derive(Clone, Copy)]
    struct Belts;
    impl Kinematics<3, 4> for Belts {
        fn sharing(&self) -> leadscrew::MotorMask {
            Kinematics::<4, 4>::sharing(&CoreXy)
        }
        fn motors(&self, axes: &[leadscrew::Coordinate; 3]) -> [leadscrew::Coordinate; 4] {
            let [x, y, z] = *axes;
            CoreXy.motors(&[x, y, z, leadscrew::Coordinate::ZERO])
        }
        fn axes_mm(&self, motors: &[f32; 4]) -> [f32; 3] {
            let [x, y, z, _]: [f32; 4] = CoreXy.axes_mm(motors);
            [x, y, z]
        }
        fn axes(&self, motors: &[leadscrew::Coordinate; 4]) -> [leadscrew::Coordinate; 3] {
            let [x, y, z, _]: [leadscrew::Coordinate; 4] = CoreXy.axes(motors);
            [x, y, z]
        }
    }
    // The motors' counts add up to twice the place of X, and differ by twice the place of Y.
    let closed = |[a, b, ..]: [i32; 4]| [a + b <= -600, a - b <= -1400, false, false, false];
    let mut rig = Rig::new(config(), Belts, [1000, 500, 0, 0], closed);
    rig.motion
        .home([Some(End::Low), Some(End::Low), None])
        .unwrap();
    assert_eq!(rig.run(), MotionStatus::Idle);
    let [a, b, ..] = rig.motors;
    assert_eq!([a + b, a - b], [2 * (-300 + 150), 2 * (-700 + 150)]);
    assert_eq!(rig.motion.position(), [1.5, -18.5, 0.0]);
}

#[test]
fn a_home_that_cannot_be_counted_in_steps_is_refused_before_anything_moves() {
    let far = config().with_travel_mm([[-3e7, 0.0], [-20.0, 20.0], [-30.0, 0.0]]);
    let mut rig = Rig::new(far, GANGED, [0; 4], |_| [false; 5]);
    let refused = rig.motion.home([Some(End::Low), None, None]);
    assert_eq!(refused, Err(MotionError::TooFar));
    assert_eq!(rig.motion.home([None, Some(End::High), None]), Ok(()));
}

#[test]
fn what_fails_at_a_switch_has_a_name_and_is_recovered_from() {
    type Switches = fn([i32; 4]) -> [bool; 5];
    let never: Switches = |_| [false; 5];
    let stuck: Switches = |[x, ..]| [x <= -300 || x < 1900, false, false, false, false];
    let skewed: Switches = |[_, y, ..]| [false, y <= 700, false, false, false];
    let x = [Some(End::Low), None, None];
    let y = [None, Some(End::Low), None];
    // 2.5 mm are allowed on an axis of 40 mm.
    let table = [
        (
            never,
            x,
            MotionFault::NoSwitch(0),
            "not met its limit switch",
        ),
        (stuck, x, MotionFault::SwitchStuck(0), "still closed"),
        (never, y, MotionFault::NoSwitch(1), "axis 1"),
        (skewed, y, MotionFault::Skewed(1), "too far apart"),
    ];
    for (closed, ends, fault, words) in table {
        let mut rig = Rig::new(config(), GANGED, [1700, 3000, 0, 3000], closed);
        rig.motion.home(ends).unwrap();
        assert_eq!(rig.fault(), fault);
        assert!(fault.to_string().contains(words), "{fault}");
        let refused = rig.motion.home(ends);
        assert_eq!(refused, Err(MotionError::Failed(fault)));
        rig.come_to_rest();
        if fault == MotionFault::Skewed(1) {
            assert!(rig.motors[1].abs_diff(rig.motors[3]) < 250 + 20);
        }
        assert!(rig.motion.recover());
        let before = rig.motors;
        rig.motion.set_position([10.0, 0.0, -1.0]).unwrap();
        rig.motion.move_to([12.0, 0.0, -1.0], Speed::RAPID).unwrap();
        assert_eq!(rig.run(), MotionStatus::Idle);
        assert_eq!(rig.motors[0], before[0] + 200);
    }
}

#[test]
fn a_probe_that_touches_nothing_or_too_early_has_a_name() {
    let mut rig = rig();
    rig.motion
        .probe_to([0.0, 0.0, -4.0], Speed::mm_s(10.0))
        .unwrap();
    let busy = rig.motion.move_to([0.0; 3], Speed::RAPID);
    assert_eq!(busy, Err(MotionError::NotIdle));
    assert_eq!(rig.fault(), MotionFault::NothingTouched);
    assert_eq!(rig.motion.touched(), None);
    assert!(rig.motion.recover());
    // Nothing was lost: it stands at the end of its way.
    assert_eq!(rig.motion.position(), [0.0, 0.0, -4.0]);
    assert_eq!(rig.motors[2], -800);

    rig.motion
        .probe_to([0.0, 0.0, -10.0], Speed::mm_s(10.0))
        .unwrap();
    assert_eq!(rig.run(), MotionStatus::Idle);
    assert_eq!(rig.motion.touched(), Some([0.0, 0.0, -4.25]));
    let again = rig.motion.probe_to([0.0, 0.0, -10.0], Speed::mm_s(10.0));
    assert_eq!(again, Err(MotionError::ProbeTouches));
    assert_eq!(rig.motion.status(), MotionStatus::Idle);
    let outside = rig.motion.probe_to([0.0, 0.0, -31.0], Speed::mm_s(10.0));
    assert_eq!(outside, Err(MotionError::OutOfTravel(2)));
    let without = MotionConfig::new().timer_hz(1_000_000);
    let mut rig = Rig::new(without, GANGED, [0; 4], |_| [false; 5]);
    let refused = rig.motion.home([Some(End::Low), None, None]);
    assert_eq!(refused, Err(MotionError::NoTravel(0)));
    assert_eq!(rig.motion.home([None; 3]), Ok(()));
    assert_eq!(rig.run(), MotionStatus::Idle);
}

#[test]
fn a_limit_switch_stops_motion_before_the_next_step_if_it_shall() {
    let closed = |[x, ..]: [i32; 4]| [x >= 1000, false, false, false, false];
    for hard in [false, true] {
        let config = if hard {
            config().with_hard_limits()
        } else {
            config()
        };
        let mut rig = Rig::new(config, GANGED, [0; 4], closed);
        rig.motion.move_to([20.0, 0.0, 0.0], Speed::RAPID).unwrap();
        if !hard {
            assert_eq!(rig.run(), MotionStatus::Idle);
            assert_eq!(rig.motors[0], 2000);
            continue;
        }
        assert_eq!(rig.fault(), MotionFault::LimitSwitch);
        assert_eq!(rig.motors[0], 1000);
        assert!(rig.motion.closed().limits.contains(0));
        rig.come_to_rest();
        assert!(rig.motion.recover());
        rig.motion.move_to([0.0; 3], Speed::RAPID).unwrap();
        assert_eq!(rig.run(), MotionStatus::Idle);
        assert_eq!(rig.motors[0], 0);
    }
}

#[test]
fn a_stop_ends_homing_and_a_driver_pin_that_fails_is_a_fault() {
    let mut rig = rig();
    rig.motion.home([Some(End::Low), None, None]).unwrap();
    for _ in 0..20 {
        rig.poll();
        let end = rig.world.now.get() + 1000;
        while let Some(at) = rig.world.next_ring().filter(|at| *at <= end) {
            rig.world.now.set(at);
            rig.steps.tick();
            rig.follow();
        }
    }
    rig.motion.hold();
    assert_eq!(
        rig.motion.status(),
        MotionStatus::Moving,
        "homing is not held"
    );
    rig.motion.stop();
    assert_eq!(rig.run(), MotionStatus::Idle);
    assert!(rig.motors[0] > -300, "{}", rig.motors[0]);
    let place = 2000 + steps(f64::from(rig.motion.position()[0]));
    assert_eq!(place, rig.motors[0]);

    let world = rig.world.clone();
    let mut outputs = Outputs::new(|| {}, world.pin("enable"));
    rig.motion.set_drivers(&mut outputs, false).unwrap();
    assert_eq!(world.level("enable"), Some(true), "off");
    world.broken.borrow_mut().insert("enable");
    rig.motion.move_to([0.0; 3], Speed::RAPID).unwrap();
    let before = world.rises("step 0").len();
    assert_eq!(rig.fault(), MotionFault::Board(Fault::Output));
    assert_eq!(world.rises("step 0").len(), before, "nothing moves");
}

#[test]
fn buttons_hold_resume_and_stop_a_motion_without_g_code() {
    let world = World::new();
    let resources = Box::leak(Box::new(MotionResources::<3, 4, 64>::new()));
    let config = config().with_drivers_enabled_high();
    let (mut motion, mut steps, switches) = {
        let (motion, steps, switches) = motion(resources, config, GANGED).unwrap();
        let pins = |motor| (world.pin(STEPS[motor]), world.pin(DIRECTIONS[motor]));
        let pins = StepDir::new([0, 1, 2, 3].map(pins));
        (motion, steps.on(pins, Timer(world.clone())), switches)
    };
    let none = [const { None }; 4];
    let pins = SwitchPins::new(none)
        .with_hold(world.pin("hold"))
        .with_start(world.pin("start"))
        .with_reset(world.pin("reset"));
    let mut watch = switches.on(pins);
    let start = world.clone();
    let mut outputs = Outputs::new(move || start.pend(), world.pin("enable"));
    motion.move_to([50.0, 0.0, 0.0], Speed::mm_s(10.0)).unwrap();
    let mut pass = |motion: &mut Motion<'_, _, 3, 4>, button: Option<&'static str>| {
        for high in [false, true] {
            if let Some(button) = button {
                world.set(button, high);
                watch.look(Instant::from_ticks(world.now.get()));
            }
        }
        let mut status = motion.status();
        for _ in 0..400 {
            status = motion.poll(&mut outputs);
            let end = world.now.get() + 1000;
            while let Some(at) = world.next_ring().filter(|at| *at <= end) {
                world.now.set(at.max(world.now.get()));
                steps.tick();
            }
            world.now.set(end);
        }
        status
    };
    assert_eq!(pass(&mut motion, None), MotionStatus::Moving);
    assert_eq!(pass(&mut motion, Some("hold")), MotionStatus::Held);
    assert_eq!(pass(&mut motion, Some("start")), MotionStatus::Moving);
    let stopped = MotionStatus::Failed(MotionFault::StoppedNow);
    assert_eq!(pass(&mut motion, Some("reset")), stopped);
    assert!(motion.recover());
    assert_eq!(world.level("enable"), Some(true), "a high level enables");
}
