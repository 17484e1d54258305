//! Serial lines, and the machine as a task.

use crate::bench::{Timer, World};
use crate::pins::step_dir;
use embassy_futures::{block_on, select::select};
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};
use leadscrew::{
    Cartesian, Clock, Config, Instant, LineError, Outputs, Resources, Serial, Stepping,
};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::future::{poll_fn, Future};
use std::rc::Rc;
use std::task::{Poll, Waker};

/// A line in memory: bytes from the sender, and bytes to it.
#[derive(Default)]
struct Wire {
    /// `None`: an error of the line.
    from: RefCell<VecDeque<Option<u8>>>,
    to: RefCell<Vec<u8>>,
    /// Bytes that the line takes before it has no room.
    room: Cell<usize>,
    ends: Cell<bool>,
    breaks: Cell<bool>,
    reader: RefCell<Option<Waker>>,
}

impl Wire {
    fn new() -> Rc<Self> {
        let wire = Self::default();
        wire.room.set(usize::MAX);
        Rc::new(wire)
    }
    fn send(&self, text: &str) {
        self.from.borrow_mut().extend(text.bytes().map(Some));
        if let Some(reader) = self.reader.borrow_mut().take() {
            reader.wake();
        }
    }
    fn heard(&self) -> String {
        String::from_utf8(self.to.borrow().clone()).unwrap()
    }
}

struct Half(Rc<Wire>);

impl ErrorType for Half {
    type Error = ErrorKind;
}
impl Read for Half {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        let mut from = self.0.from.borrow_mut();
        let mut count = 0;
        while let Some(byte) = from.front().copied().filter(|_| count < bytes.len()) {
            let Some(byte) = byte else {
                if count == 0 {
                    from.pop_front();
                    return Err(ErrorKind::InvalidData);
                }
                break;
            };
            from.pop_front();
            bytes[count] = byte;
            count += 1;
        }
        Ok(count)
    }
}
impl ReadReady for Half {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.0.from.borrow().is_empty())
    }
}
impl Write for Half {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        if self.0.breaks.get() {
            return Err(ErrorKind::BrokenPipe);
        }
        let count = bytes.len().min(self.0.room.get());
        self.0.room.set(self.0.room.get() - count);
        self.0.to.borrow_mut().extend_from_slice(&bytes[..count]);
        Ok(count)
    }
    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}
impl WriteReady for Half {
    fn write_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(self.0.room.get() > 0)
    }
}

/// The same for a task: reading awaits bytes.
struct Task(Half);

impl ErrorType for Task {
    type Error = ErrorKind;
}
impl embedded_io_async::Read for Task {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        poll_fn(|context| {
            let wire = self.0 .0.clone();
            if wire.from.borrow().is_empty() && !wire.ends.get() {
                *wire.reader.borrow_mut() = Some(context.waker().clone());
                return Poll::Pending;
            }
            Poll::Ready(self.0.read(bytes))
        })
        .await
    }
}
impl embedded_io_async::Write for Task {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        // A line that takes few bytes at once.
        let count = bytes.len().min(7);
        self.0.write(&bytes[..count])
    }
    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

fn config() -> Config<3> {
    Config::new().timer_hz(1_000_000)
}

#[test]
fn a_line_that_is_asked_gets_every_answer_however_little_it_takes_at_once() {
    let (world, wire) = (World::new(), Wire::new());
    let resources = Box::leak(Box::new(Resources::<3, 3, 16>::new()));
    let (mut machine, steps, mut serial, _) =
        leadscrew::new(resources, config(), Cartesian).unwrap();
    let mut steps = steps.on(step_dir(&world), Timer(world.clone()));
    let mut outputs = Outputs::new(|| {}, world.pin("enable"));
    let mut line = Half(wire.clone());
    wire.room.set(0);
    wire.send("$X\n$$\n");
    for turn in 0..20_000u64 {
        wire.room.set(3);
        serial.exchange(&mut line).unwrap();
        steps.tick();
        machine.poll(&mut outputs, Instant::from_ticks(turn));
    }
    let heard = wire.heard();
    assert!(
        heard.contains("$0=10\r\n") && heard.contains("$132="),
        "{heard}"
    );
    assert!(heard.ends_with("ok\r\n"), "{heard}");
    assert_eq!(heard.matches("ok\r\n").count(), 2);
}

#[test]
fn a_byte_that_cannot_be_read_is_an_error_and_counts_as_lost() {
    let wire = Wire::new();
    let resources = Box::leak(Box::new(Resources::<3, 3, 16>::new()));
    let (.., mut serial, _) = leadscrew::new(resources, config(), Cartesian).unwrap();
    wire.send("G1");
    wire.from.borrow_mut().push_back(None);
    wire.send("X\n");
    let mut line = Half(wire.clone());
    assert_eq!(serial.exchange(&mut line), Err(ErrorKind::InvalidData));
    assert_eq!(serial.exchange(&mut line), Ok(()));
    assert!(wire.from.borrow().is_empty());
}

#[test]
fn a_pump_ends_with_the_lines_own_error_and_says_what_to_do() {
    let spoil: [fn(&Wire); 2] = [
        |wire| wire.ends.set(true),
        |wire| wire.from.borrow_mut().push_back(None),
    ];
    let ends = [
        (LineError::End, "await a new one"),
        (
            LineError::Read(ErrorKind::InvalidData),
            "cannot be read: InvalidData; pump again",
        ),
    ];
    for (spoil, (error, words)) in spoil.into_iter().zip(ends) {
        let wire = Wire::new();
        let resources = Box::leak(Box::new(Resources::<3, 3, 16>::new()));
        let (.., mut serial, _) = leadscrew::new(resources, config(), Cartesian).unwrap();
        spoil(&wire);
        let (mut reader, mut writer) = (Task(Half(wire.clone())), Task(Half(wire.clone())));
        let end = block_on(serial.pump(&mut reader, &mut writer));
        assert_eq!(end, Err(error));
        assert!(error.to_string().contains(words), "{error}");
    }
}

/// The world's clock. Awaiting lets the step interrupt come, as a chip's would.
struct Ticking<'s, P>(Rc<World>, RefCell<Stepping<'s, P, 3>>);

impl<P: leadscrew::Port> Ticking<'_, P> {
    /// Lets the world go on to the next interrupt, or by a tenth of a millisecond.
    fn go_on(&self) {
        let now = self.0.now.get();
        let ring = self.0.next_ring().filter(|at| *at <= now + 100);
        self.0.now.set(ring.unwrap_or(now + 100).max(now));
        if ring.is_some() {
            self.1.borrow_mut().tick();
        }
    }
}

impl<P: leadscrew::Port> Clock for Ticking<'_, P> {
    fn now(&self) -> Instant {
        Instant::from_ticks(self.0.now.get())
    }
    fn until(&self, instant: Instant) -> impl Future<Output = ()> {
        poll_fn(move |_| match self.now() >= instant {
            true => Poll::Ready(()),
            false => Poll::Pending,
        })
    }
}

/// A job over a pumped line, with the machine as a task that sleeps. `turns` counts its polls.
#[test]
fn a_machine_and_its_line_are_two_tasks_that_sleep_until_they_are_woken() {
    let (world, wire) = (World::new(), Wire::new());
    let resources = Box::leak(Box::new(Resources::<3, 3, 16>::new()));
    let (mut machine, steps, mut serial, _) =
        leadscrew::new(resources, config(), Cartesian).unwrap();
    let steps = steps.on(step_dir(&world), Timer(world.clone()));
    let clock = Ticking(world.clone(), RefCell::new(steps));
    let start = world.clone();
    let mut outputs = Outputs::new(move || start.pend(), world.pin("enable"));
    let (mut reader, mut writer) = (Task(Half(wire.clone())), Task(Half(wire.clone())));
    wire.send("$X\nG1X1F300\nG1Y-0.5\n");

    let passing = poll_fn(|context| {
        clock.go_on();
        if wire.heard().contains("<Idle|MPos:1.000,-0.500") {
            return Poll::Ready(());
        }
        if world.now.get() % 50_000 < 100 {
            wire.send("?");
        }
        assert!(world.now.get() < 60_000_000, "{}", wire.heard());
        context.waker().wake_by_ref();
        Poll::Pending
    });
    let tasks = select(
        machine.run_without_store(&mut outputs, &clock),
        serial.pump(&mut reader, &mut writer),
    );
    block_on(select(tasks, passing));
    assert_eq!(world.rises("step x").len(), 250);
    assert_eq!(world.rises("step y").len(), 125);
    assert_eq!(wire.heard().matches("ok\r\n").count(), 3);
}

#[test]
fn a_resting_machine_asks_for_no_poll_and_each_handler_wakes_it() {
    let world = World::new();
    let resources = Box::leak(Box::new(Resources::<3, 3, 16>::new()));
    let (mut machine, steps, mut serial, switches) =
        leadscrew::new(resources, config(), Cartesian).unwrap();
    let mut steps = steps.on(step_dir(&world), Timer(world.clone()));
    let pins = leadscrew::SwitchPins::new([Some(world.pin("limit x")), None, None]);
    let mut watch = switches.on(pins);
    let start = world.clone();
    let mut outputs = Outputs::new(move || start.pend(), world.pin("enable"));
    let mut now = 0;
    let mut settle = |machine: &mut leadscrew::Machine<'_, _, 3, 3>, serial: &mut Serial<'_>| {
        // Motion begins a while after its first line.
        for _ in 0..300 {
            now += 100;
            machine.poll(&mut outputs, Instant::from_ticks(now));
            while serial.next_to_send().is_some() {}
        }
        assert!(!machine.is_woken());
        machine.poll(&mut outputs, Instant::from_ticks(now)).when
    };
    assert_eq!(
        settle(&mut machine, &mut serial),
        None,
        "time alone needs no poll"
    );
    steps.tick();

    serial.receive(b'?');
    assert!(machine.is_woken(), "a byte");
    settle(&mut machine, &mut serial);

    world.set("limit x", false);
    let again = watch.look(Instant::from_ticks(2)).unwrap();
    assert!(!machine.is_woken(), "the level has to last");
    watch.look(again);
    assert!(machine.is_woken(), "an edge");
    world.set("limit x", true);
    while let Some(again) = watch.look(Instant::from_ticks(100_000)) {
        watch.look(again);
    }
    settle(&mut machine, &mut serial);

    "$X\nG1X1F300\n".bytes().for_each(|byte| {
        serial.receive(byte);
    });
    settle(&mut machine, &mut serial);
    assert!(steps.tick(), "the first tick takes a segment");
    assert!(machine.is_woken(), "a taken segment");
}

#[cfg(feature = "embassy")]
#[test]
fn embassys_clock_waits_until_its_instant() {
    let clock = leadscrew::EmbassyClock;
    let due = Instant::from_ticks(clock.now().ticks() + 2000);
    block_on(clock.until(due));
    assert!(clock.now() >= due);
}
