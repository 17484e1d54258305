//! The event loop: what happens next, and who pays for it.
//!
//! ```text
//!             due                         then                                charged
//!  timer      compare 1 or 2              step interrupt, end of a pulse      step*, pulse_end
//!  switches   a carriage passed one       Inputs::on_switches                 switches
//!  lines      a byte's last bit           Receiver::receive, Host::receive    byte_in, byte_out
//!  main loop  woken, and the CPU is free  Machine::poll                       poll and what Work counts
//! ```
//!
//! At one instant they come in this order. The main loop is woken by a byte, a switch edge, a segment taken,
//! motion at rest, its own deadline, or because it said that it is busy; turns that would find nothing are
//! left out.
//!
//! What a poll does is seen at its start, and its time passes after it: the next poll begins when that time
//! is over, later by all interrupts in between. A poll is short (one line, a few segments), so that its
//! effects come too early by some tens of microseconds at most; two milliseconds of segments lie in the queue.

use crate::board::SimBoard;
use crate::clock::{cycles_of_micros, Cycle};
use crate::cost::Costs;
use crate::link::{Host, LinkEvent, Links, PACKET};
use crate::load::Cpu;
use crate::observer::Observer;
use crate::plant::{Pin, Plant, Switch};
use crate::position::PositionCheck;
use crate::setup::{Memory, Setup};
use crate::stepping::Stepping;
use crate::trouble::Violation;
use leadscrew_machine::board::ChannelId;
use leadscrew_machine::config::CHANNELS;
use leadscrew_machine::inputs::Inputs;
use leadscrew_machine::machine::{Links as MachineLinks, Machine, Next};
use leadscrew_machine::protocol::serial::Receiver;
use leadscrew_machine::work::Work;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::Shared;

/// Why a simulation came back.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stopped {
    /// The instant asked for was reached.
    Reached,
    /// Nothing will ever happen again unless something comes from outside.
    Quiet,
    /// The caller's condition was met.
    Condition,
}

/// A machine on its board, with a plant around it.
pub struct Simulation<'a, K, O, const AXES: usize, const MOTORS: usize, const MOVES: usize> {
    machine: Machine<'a, K, AXES, MOTORS, MOVES>,
    pub(crate) board: SimBoard<O, MOTORS>,
    stepping: Stepping<'a, MOTORS>,
    pub(crate) cpu: Cpu,
    costs: Costs,
    receivers: heapless::Vec<Receiver<'a>, CHANNELS>,
    shared: &'a Shared<MOTORS>,
    inputs: &'a Inputs<MOTORS>,
    position: PositionCheck<MOTORS>,
    work: Work,
    now: Cycle,
    /// Since when the main loop has reason to run; never: it has none.
    wake: Cycle,
    /// When it wants to run at the latest.
    deadline: Cycle,
    pub(crate) first_byte: Cycle,
    pub(crate) last_byte: Cycle,
}

impl<'a, K, O, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Simulation<'a, K, O, AXES, MOTORS, MOVES>
where
    K: Kinematics<AXES, MOTORS>,
    O: Observer,
{
    /// Puts a machine on a board, at power-up. Its main loop runs for the first time in [`Simulation::run_until`].
    pub fn new(
        memory: &'a mut Memory<MOTORS>,
        setup: &Setup<AXES>,
        kinematics: K,
        observer: O,
    ) -> Self {
        let (producer, consumer) = memory.segments.split();
        let (shared, inputs) = (&memory.shared, &memory.inputs);
        let (receivers, inboxes) = memory.serial.iter_mut().map(|queue| queue.split()).unzip();
        let links = MachineLinks {
            segments: producer,
            shared,
            inputs,
            inboxes,
        };
        Self {
            machine: Machine::new(setup.machine, kinematics, links),
            board: SimBoard::new(
                setup.costs,
                Links::new(&setup.lines),
                Plant::new(),
                observer,
            ),
            stepping: Stepping::new(consumer, shared, setup.costs),
            cpu: Cpu::new(),
            costs: setup.costs,
            receivers,
            shared,
            inputs,
            position: PositionCheck::default(),
            work: Work::default(),
            now: Cycle::ZERO,
            wake: Cycle::ZERO,
            deadline: Cycle::NEVER,
            first_byte: Cycle::NEVER,
            last_byte: Cycle::ZERO,
        }
    }

    /// Lets time pass up to `end`, or until nothing is left to happen.
    pub fn run_until<H: Host>(&mut self, host: &mut H, end: Cycle) -> Stopped {
        self.run_while(host, end, |_| true)
    }

    /// Lets time pass up to `end`, until nothing is left to happen, or until `going` says no after a byte or a poll.
    pub fn run_while<H: Host>(
        &mut self,
        host: &mut H,
        end: Cycle,
        going: impl Fn(&H) -> bool,
    ) -> Stopped {
        self.exchange(host);
        loop {
            self.run_timer(end.min(self.board.links.due()));
            let (main, line) = (self.main_due(), self.board.links.due());
            let next = main.min(line);
            if next > end || next == Cycle::NEVER {
                return self.stop(next, end);
            }
            self.now = next;
            if line <= main {
                self.byte(host);
            } else {
                self.poll(host);
            }
            if !going(host) {
                return Stopped::Condition;
            }
        }
    }

    /// The present.
    pub fn now(&self) -> Cycle {
        self.now
    }

    /// The machine.
    pub fn machine(&self) -> &Machine<'a, K, AXES, MOTORS, MOVES> {
        &self.machine
    }

    /// The board, with the plant and its switches.
    pub fn board(&self) -> &SimBoard<O, MOTORS> {
        &self.board
    }

    /// Position as the step interrupt counts it.
    pub fn counted_position(&self) -> [i32; MOTORS] {
        self.shared.position()
    }

    /// Sets the level of an input; buttons act by their edges.
    pub fn set_pin(&mut self, pin: Pin, high: bool) {
        self.board.plant.set_pin(pin, high);
        self.report_switches(self.now);
    }

    /// Holds an input at a level whatever its switch does; `None` lets it go.
    pub fn force_pin(&mut self, pin: Pin, level: Option<bool>) {
        self.board.plant.force(pin, level);
        self.report_switches(self.now);
    }

    /// Adds a switch that a carriage works.
    pub fn add_switch(&mut self, switch: Switch) {
        self.board.plant.add_switch(switch);
        self.report_switches(self.now);
    }

    /// Removes all switches that carriages work; the pins keep their levels.
    pub fn remove_switches(&mut self) {
        self.board.plant.remove_switches();
    }

    /// Puts the carriages somewhere else; the machine does not learn of it.
    pub fn place(&mut self, position: [i32; MOTORS]) {
        self.board.plant.place(position);
        self.board.rewired = true;
        self.report_switches(self.now);
    }

    /// Handles the timer's interrupts up to `limit`, or until the main loop can run.
    #[inline]
    fn run_timer(&mut self, limit: Cycle) {
        loop {
            let due = self.board.timer_due();
            if due > limit.min(self.main_due()) || due == Cycle::NEVER {
                return;
            }
            self.now = self.now.max(due);
            if self.stepping.handle(&mut self.board, &mut self.cpu) {
                self.wake = self.wake.min(due);
            }
            if self.board.switches_moved {
                self.board.switches_moved = false;
                if self.board.plant.update_switches() {
                    self.report_switches(due);
                }
            }
        }
    }

    /// When the main loop runs next.
    #[inline]
    fn main_due(&self) -> Cycle {
        self.cpu.main_start(self.wake.min(self.deadline))
    }

    fn stop(&mut self, next: Cycle, end: Cycle) -> Stopped {
        let timer = self.board.timer_due();
        if end != Cycle::NEVER {
            self.now = self.now.max(end);
        }
        if next.min(timer) == Cycle::NEVER {
            Stopped::Quiet
        } else {
            Stopped::Reached
        }
    }

    fn report_switches(&mut self, now: Cycle) {
        self.inputs
            .on_switches(self.board.plant.levels(), self.shared);
        self.cpu.charge_interrupt(now, self.costs.switches);
        self.wake = self.wake.min(now);
    }

    fn byte<H: Host>(&mut self, host: &mut H) {
        while let Some((channel, event)) = self.board.links.take(self.now) {
            match event {
                LinkEvent::Arrived(byte) => self.receive(channel, byte),
                LinkEvent::Sent(byte) => {
                    self.cpu.charge_interrupt(self.now, self.costs.byte_out);
                    self.wake = self.wake.min(self.now);
                    self.last_byte = self.now;
                    host.receive(channel, byte, self.now);
                }
            }
        }
        self.exchange(host);
    }

    fn receive(&mut self, channel: ChannelId, byte: u8) {
        self.first_byte = self.first_byte.min(self.now);
        if let Some(receiver) = self.receivers.get_mut(usize::from(channel.0)) {
            receiver.receive(byte);
        }
        self.cpu.charge_interrupt(self.now, self.costs.byte_in);
        self.wake = self.wake.min(self.now);
    }

    /// Brings to the host what needs no time, and asks it for what it has to send.
    fn exchange<H: Host>(&mut self, host: &mut H) {
        for channel in (0..self.board.links.count()).map(|number| ChannelId(number as u8)) {
            while let Some(byte) = self.board.links.take_written(channel) {
                self.last_byte = self.now;
                host.receive(channel, byte, self.now);
            }
            if !self.board.links.never_waits(channel) {
                self.board.links.feed(channel, host, self.now);
                continue;
            }
            for _ in 0..PACKET {
                match host.next_byte(channel) {
                    Some(byte) => self.receive(channel, byte),
                    None => break,
                }
            }
        }
    }

    fn poll<H: Host>(&mut self, host: &mut H) {
        let counted = self.shared.position();
        self.board.begin_poll(self.now);
        let next = self.machine.poll(&mut self.board, self.now.instant());
        self.stepping.refilled();
        self.charge_poll();
        self.check(&counted);
        self.schedule(&next);
        self.exchange(host);
    }

    fn schedule(&mut self, next: &Next) {
        let soonest = self.now + cycles_of_micros(1);
        let deadline = next.when.map(Cycle::from_instant);
        self.deadline = deadline.map_or(Cycle::NEVER, |deadline| deadline.max(soonest));
        self.wake = if next.busy { self.now } else { Cycle::NEVER };
    }

    /// Charges the CPU for the poll just made.
    fn charge_poll(&mut self) {
        let work = *self.machine.work();
        let cycles = self.costs.of_poll(&self.work, &work);
        self.work = work;
        self.cpu.charge_main(self.now, cycles);
    }

    /// Checks what must hold whenever the main loop has run. `counted` is the position before the poll.
    fn check(&mut self, counted: &[i32; MOTORS]) {
        let (now, after) = (self.now, self.shared.position());
        let made = self.board.plant.position();
        let invert = self.board.port.direction_invert;
        if after != *counted || std::mem::take(&mut self.board.rewired) {
            self.position.compare_from_now(after, made);
        }
        if let Some((motor, counted, made)) = self.position.difference(after, made, invert) {
            self.board.violate(Violation::Position {
                cycle: now,
                motor,
                counted,
                made,
            });
            self.position
                .compare_from_now(after, self.board.plant.position());
        }
    }
}
