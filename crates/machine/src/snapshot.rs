//! Reports: plain values taken from the machine's parts at one instant.

use crate::board::{Board, SpindleOutput};
use crate::config::extruder;
use crate::extension::Extension;
use crate::inputs::ActiveSwitches;
use crate::interpreter::{
    Coordinate, Distance, FeedMode, Motion, OffsetId, Plane, Retract, Rotation, Turn, Units,
    WorkSystem,
};
use crate::machine::Machine;
use crate::motion::measure::{is_plain, Measure};
use crate::protocol::decimal;
use crate::protocol::report::{
    self, Accessories, ModesReport, OptionsLine, OverridePercents, Parameters, Pins, ProbeReport,
    Room, StatusReport, Turning,
};
use crate::rules::ClosedSwitches;
use crate::settings::table::Setting;
use crate::state::State;
use core::fmt;
use leadscrew_gcode::Number;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::Power;

/// Bit of `$10` that asks for the time to finish.
const TIME_LEFT: u8 = StatusReport::<0>::TIME_LEFT;

/// Moves whose times are added up in one poll: some 0.12 ms of the F407.
const TIMED_A_POLL: usize = 8;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Answers every `?` that waits and whose channel has room, once its values are known. Main
    /// loop.
    pub(crate) fn report<B: Board>(&mut self, board: &B) {
        if !self.console.reports_now() || self.reports(TIME_LEFT) && self.adds_time() {
            return;
        }
        let active = self.switches.inputs.active(&board.switches());
        for index in 0..self.console.count() {
            let id = crate::board::ChannelId(index);
            let free = match self.console.channel(id) {
                Some(channel) if channel.report_due && channel.has_room() => {
                    channel.report_due = false;
                    channel.free()
                }
                Some(_) | None => continue,
            };
            let report = self.status_report(&active, free);
            let closed = self.closed_switches(&active);
            let extension = &self.extension;
            self.console.line(
                id,
                WithOwn {
                    report,
                    closed,
                    extension,
                },
            );
            self.work.reports = self.work.reports.wrapping_add(1);
        }
        self.console.time_left = None;
        self.state_is_shown();
    }

    /// Returns true if `$10` has this bit, and the machine knows the bit.
    pub(crate) fn reports(&self, bit: u8) -> bool {
        self.settings.mask(Setting::ReportMask) & self.config.report_bits & bit != 0
    }

    /// Goes on adding up the time to finish; returns whether moves are left.
    fn adds_time(&mut self) -> bool {
        let mut left = self
            .console
            .time_left
            .unwrap_or_else(|| self.motion.time_left());
        let more = self.motion.add_time(&mut left);
        self.console.time_left = Some(left);
        self.work.timed = self.work.timed.wrapping_add(TIMED_A_POLL as u32);
        more
    }

    fn status_report(&mut self, active: &ActiveSwitches, free: usize) -> StatusReport<AXES> {
        let extra = self.console.cadence.next(self.is_moving_about());
        let coolant = self.tool.coolant.output();
        let speed = self.reported_speed();
        StatusReport {
            state: self.reported_state(active.door),
            position: numbers(&self.motion.position()),
            work_offset: numbers(&self.program.work_offset),
            mask: self.settings.mask(Setting::ReportMask),
            room: Room {
                moves: self.motion.room(),
                bytes: free,
            },
            line_number: self.line_number(),
            time_left: self
                .console
                .time_left
                .map(|left| decimal::from_f32(left.seconds())),
            feed: decimal::from_f32(self.reported_feed()),
            speed: decimal::from_f32(speed),
            pins: self.pins(active),
            overrides: OverridePercents {
                feed: self.overrides.feed,
                rapid: self.overrides.rapid,
                spindle: self.overrides.spindle,
            },
            accessories: Accessories {
                spindle: match self.tool.spindle.turning_at(speed) {
                    SpindleOutput::Off => Turning::Not,
                    SpindleOutput::Clockwise => Turning::Clockwise,
                    SpindleOutput::CounterClockwise => Turning::Counterclockwise,
                },
                flood: coolant.flood,
                mist: coolant.mist,
            },
            extra,
            units: self.report_units(),
        }
    }

    /// Returns the state as `?` reports it; `ajar`: whether the door is open now. Programs that
    /// show the machine beside its wire ask for it.
    pub fn reported_state(&self, ajar: bool) -> &'static str {
        match (self.shown_state(), &self.activity.aside) {
            (State::Idle, Some(aside)) if self.is_aside() => aside.shown.name(),
            (state, _) => state.name(ajar),
        }
    }

    /// Returns the fields that extensions add to reports, such as `|T:2`.
    pub fn own_fields(&self) -> impl fmt::Display + '_ {
        OwnFields::<X, AXES>(&self.extension)
    }

    /// The speed as reports show it, in the unit of F: mm/min, or degrees/min while axes turn and
    /// no length changes. As in GRBL, 0 on the way to sleep.
    fn reported_feed(&self) -> f32 {
        match self.state {
            State::Sleep => 0.0,
            State::Idle
            | State::Run
            | State::Jog(_)
            | State::Hold(_)
            | State::Home
            | State::Door(_)
            | State::Alarm(_)
            | State::Check => self.motion.speed() * 60.0 / self.stretch_of_report(),
        }
    }

    /// The speed along the path divided by the speed in the unit of F. Reports divide by 25.4 if
    /// they are in inches, which degrees never are.
    fn stretch_of_report(&self) -> f32 {
        let ways = self.motion.running_ways();
        let Some(ways) = ways.filter(|_| !is_plain(&self.config.axes)) else {
            return 1.0;
        };
        let Measure { stretch, is_turn } = Measure::of(&self.config.axes, &ways);
        match is_turn && self.report_units().inches {
            true => stretch / 25.4,
            false => stretch,
        }
    }

    /// The spindle's speed as reports show it, RPM.
    pub(crate) fn reported_speed(&self) -> f32 {
        let out = match self.motion.power() {
            Some(power) if !self.motion.shared.is_laser_off() => power,
            Some(_) => Power::OFF,
            None => self.power_at_rest(),
        };
        self.tool.spindle.reported_speed(out)
    }

    /// The active inputs, as reports show them. Reports know axes only: the switch of a second
    /// motor counts as its axis's.
    fn pins(&self, active: &ActiveSwitches) -> Pins {
        Pins {
            probe: active.probe,
            limits: self.switches.axes_at_limits(active).bits(),
            door: active.door,
            reset: active.reset,
            hold: active.hold,
            start: active.start,
        }
    }

    /// The state as reports show it. It is `Run` if planned moves have not begun: a sender that
    /// has had an `ok` for a move is not to take the machine for done.
    fn shown_state(&self) -> State {
        match self.is_about_to_move() {
            true => State::Run,
            false => self.state,
        }
    }

    /// Returns true if reports take the cadence of a busy machine.
    fn is_moving_about(&self) -> bool {
        match self.shown_state() {
            State::Run | State::Jog(_) | State::Hold(_) | State::Home | State::Door(_) => true,
            State::Idle | State::Alarm(_) | State::Check | State::Sleep => false,
        }
    }

    fn line_number(&self) -> Option<u32> {
        let number = self.motion.line_number();
        let shown = self.config.options.line_numbers || self.reports(StatusReport::<AXES>::LINE);
        number.filter(|number| shown && *number != 0)
    }

    /// Sends `[PRB:` on all channels.
    pub(crate) fn report_probe(&mut self) {
        let report = self.probe_report();
        self.console.broadcast(report);
    }

    /// The answer to `$G`.
    pub(crate) fn modes(&self) -> ModesReport {
        let modal = self.program.interpreter.modal();
        ModesReport {
            motion: motion_word(modal.motion),
            coordinate_system: 54 + modal.system as u8,
            plane: match modal.plane {
                Plane::Xy => 17,
                Plane::Zx => 18,
                Plane::Yz => 19,
            },
            units: match modal.units {
                Units::Inches => 20,
                Units::Millimetres => 21,
            },
            distance: match modal.distance {
                Distance::Absolute => 90,
                Distance::Incremental => 91,
            },
            feed_mode: match modal.feed_mode {
                FeedMode::InverseTime => 93,
                FeedMode::PerMinute => 94,
            },
            back_to_r: modal.retract == Retract::Clear,
            spindle: match modal.rotation {
                Rotation::Clockwise => 3,
                Rotation::Counterclockwise => 4,
                Rotation::Off => 5,
            },
            mist: modal.coolant.mist,
            flood: modal.coolant.flood,
            parking: self.config.dialect.parking_override && self.program.parking_allowed,
            extrusion: extruder(&self.config.axes).map(|_| {
                match modal.extrusion.unwrap_or(modal.distance) {
                    Distance::Absolute => 82,
                    Distance::Incremental => 83,
                }
            }),
            tool: modal.tool,
            feed: modal.feed,
            speed: modal.speed,
            inches: self.settings.is_on(Setting::Inches),
        }
    }

    /// The second line of `$I`.
    pub(crate) fn options_line(&self, bytes: usize) -> OptionsLine {
        let (options, dialect) = (&self.config.options, &self.config.dialect);
        OptionsLine {
            line_numbers: options.line_numbers,
            mist: dialect.mist,
            crossed_belts: !self.motion.sharing().is_empty(),
            parking: options.parking.is_some(),
            single_axis_homing: options.single_axis_homing,
            parking_override: dialect.parking_override,
            door: options.door,
            two_motors: self.switches.dual.is_some(),
            moves: self.config.moves,
            bytes,
        }
    }

    /// The values of `$#`.
    pub(crate) fn parameters(&self) -> Parameters<AXES> {
        let offsets = self.program.interpreter.offsets();
        let system = |system: WorkSystem| numbers(offsets.get(OffsetId::Work(system)));
        Parameters {
            systems: WorkSystem::ALL.map(system),
            nine: self.config.dialect.has_linuxcnc(),
            home: numbers(offsets.get(OffsetId::G28)),
            second_home: numbers(offsets.get(OffsetId::G30)),
            temporary: numbers(offsets.g92()),
            tool_length: number(offsets.tool_length()),
            probed: self.probe_report(),
            units: self.report_units(),
        }
    }

    fn probe_report(&self) -> ProbeReport<AXES> {
        ProbeReport {
            position: numbers(&self.program.probed.position),
            success: self.program.probed.contact,
            units: self.report_units(),
        }
    }

    pub(crate) fn report_units(&self) -> report::Units<AXES> {
        report::Units {
            inches: self.settings.is_on(Setting::Inches),
            axes: self.config.axes,
        }
    }
}

/// A status report with the fields of an extension.
struct WithOwn<'a, X, const AXES: usize> {
    report: StatusReport<AXES>,
    closed: ClosedSwitches<AXES>,
    extension: &'a X,
}

impl<X: Extension<AXES>, const AXES: usize> fmt::Display for WithOwn<'_, X, AXES> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.report.write(f, |f| {
            write!(f, "{}", self.closed)?;
            self.extension.report(f)
        })
    }
}

/// The fields of an extension.
struct OwnFields<'a, X, const AXES: usize>(&'a X);

impl<X: Extension<AXES>, const AXES: usize> fmt::Display for OwnFields<'_, X, AXES> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.report(f)
    }
}

fn number(coordinate: Coordinate) -> Number {
    Number::from_nanos(coordinate.nanos())
}

#[inline(never)] // machine 004 (`examples/machines/004`) takes 1508 bytes more if it is inlined
fn numbers<const AXES: usize>(coordinates: &[Coordinate; AXES]) -> [Number; AXES] {
    coordinates.map(number)
}

/// The number of a motion mode's G word.
fn motion_word(motion: Motion) -> Number {
    const TENTH: i64 = 100_000_000;
    let tenths = match motion {
        Motion::Rapid => 0,
        Motion::Feed => 10,
        Motion::Arc(Turn::Clockwise) => 20,
        Motion::Arc(Turn::Counterclockwise) => 30,
        Motion::Probe(kind) => match (kind.toward, kind.must_trigger) {
            (true, true) => 382,
            (true, false) => 383,
            (false, true) => 384,
            (false, false) => 385,
        },
        Motion::Cycle(kind) => 10 * i64::from(kind.code()),
        Motion::Cancelled => 800,
    };
    Number::from_nanos(tenths * TENTH)
}
