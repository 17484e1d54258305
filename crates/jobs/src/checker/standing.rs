//! The way in which a program has come to its place: by which words each axis got its place, and
//! what else the machine has been told. From this a program is begun in its middle
//! ([`crate::rest`]).
//!
//! ```text
//!   G0 X5       work coordinates of G54: any machine finds X5 again
//!   G53 X-5     machine coordinates
//!   G28         the stored place
//!   G38.2 X9    lost: only that machine knows the probe's place
//! ```

use leadscrew_gcode::{words, Letter, Number, Word};
use leadscrew_machine::extension::Call;
use leadscrew_machine::interpreter::{
    Command, Commands, Distance, Interpreter, Motion, OffsetId, Retract, WorkSystem,
};
use leadscrew_planner::Coordinate;

/// The words by which an axis is found again.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Frame {
    /// It is where it was when the program began.
    Untouched,
    /// By coordinates of this work system, without G92 and tool length.
    Work(WorkSystem),
    /// By machine coordinates.
    Machine,
    /// By G28 or G30.
    Stored(u8),
    /// By none.
    Lost(Loss),
}

/// The line since which an axis cannot be found again.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Loss {
    pub(super) line: u64,
    /// It counts from the place at which the program began.
    pub(super) from_start: bool,
}

/// The way in which a program has come to its place.
pub(super) struct Standing<const AXES: usize> {
    pub(super) frames: [Frame; AXES],
    /// Axes whose G92 offset counts from a place that is not known.
    pub(super) g92_lost: [Option<Loss>; AXES],
    /// The highest Z in coordinates of a work system.
    pub(super) highest: Option<Coordinate>,
    /// The last call of each M code of an extension, by P, in the order of the program.
    pub(super) calls: Vec<Call>,
    /// The last T word.
    pub(super) tool: Option<Number>,
    /// The last line that named its motion.
    pub(super) motion_line: u64,
    /// The zeros that the program sets itself; the rest are as it was before the program.
    pub(super) sets: Sets,
}

/// The zeros that a machine keeps between programs: says which of them a program sets itself.
#[derive(Clone, Copy, Default)]
pub(super) struct Sets {
    /// It names a work system.
    pub(super) system: bool,
    /// G92 or G52, of an axis that is no filament's.
    pub(super) shift: bool,
    /// The length of the tool.
    pub(super) length: bool,
}

impl<const AXES: usize> Standing<AXES> {
    /// Begins a program whose place is known if it `begins` at a place in work coordinates.
    pub(super) fn new(begins: bool) -> Self {
        let frame = match begins {
            true => Frame::Work(WorkSystem::default()),
            false => Frame::Untouched,
        };
        Self {
            frames: [frame; AXES],
            g92_lost: [None; AXES],
            highest: None,
            calls: Vec::new(),
            tool: None,
            motion_line: 0,
            sets: Sets::default(),
        }
    }

    /// A work system's word and a blank; nothing if the program leaves it to who runs it.
    pub(super) fn system(&self, system: WorkSystem) -> String {
        match self.sets.system {
            true => format!("{system} "),
            false => String::new(),
        }
    }

    /// Takes line `number`, which the interpreter has read, and its commands.
    pub(super) fn take<'c>(
        &mut self,
        number: u64,
        line: &[u8],
        letters: &[char],
        commands: impl Iterator<Item = &'c Command<AXES>> + Clone,
        interpreter: &Interpreter<AXES>,
    ) {
        let words: Vec<Word> = words(line).flatten().collect();
        let line = Line {
            number,
            words,
            letters,
        };
        if line.names_motion() {
            self.motion_line = number;
        }
        line.note_zeros(&mut self.sets);
        if let Some(tool) = line.value(Letter::T) {
            self.tool = Some(tool);
        }
        for command in commands.clone() {
            if let Command::Own(call) = command {
                self.call(*call);
            }
        }
        let moves = commands.clone().any(|command| {
            matches!(
                command,
                Command::Line(_)
                    | Command::Arc { .. }
                    | Command::Cycle { .. }
                    | Command::Probe { .. }
            )
        });
        if line.has(G10) {
            self.store(&line, interpreter);
        } else if line.has(G92) {
            self.shift(&line, interpreter);
        } else if line.has(G92_1) {
            self.g92_lost = [None; AXES];
        } else if moves {
            self.go(&line, interpreter);
        }
        self.rise(interpreter);
    }

    /// Takes a jog, whose text stands behind `$J=`.
    pub(super) fn jog(
        &mut self,
        number: u64,
        text: &[u8],
        letters: &[char],
        modes: &Interpreter<AXES>,
    ) {
        let words: Vec<Word> = words(text).flatten().collect();
        self.go(
            &Line {
                number,
                words,
                letters,
            },
            modes,
        );
    }

    /// Notes that homing has taken these axes to their switches.
    pub(super) fn home(&mut self, mask: u8) {
        for (axis, frame) in self.frames.iter_mut().enumerate() {
            if mask >> axis & 1 == 1 {
                *frame = Frame::Machine;
            }
        }
    }

    fn call(&mut self, call: Call) {
        let key = |call: &Call| (call.code, call.words.get(Letter::P));
        self.calls.retain(|other| key(other) != key(&call));
        self.calls.push(call);
    }

    /// G10: L20 gives the place coordinates, L2 moves the zero from which they count.
    fn store(&mut self, line: &Line<'_>, interpreter: &Interpreter<AXES>) {
        let Some(system) = line.system(interpreter.modal().system) else {
            return;
        };
        let here = line.value(Letter::L) == Some(Number::from_int(20));
        for axis in line.axes::<AXES>() {
            if here {
                self.frames[axis] = Frame::Work(system);
            } else if self.frames[axis] == Frame::Work(system) {
                self.frames[axis] = line.lost();
            }
        }
    }

    /// G92: the place gets coordinates until the next reset.
    fn shift(&mut self, line: &Line<'_>, interpreter: &Interpreter<AXES>) {
        let counts = Frame::Work(interpreter.modal().system);
        for axis in line.axes::<AXES>() {
            let is_known = self.frames[axis] == counts;
            self.g92_lost[axis] = (!is_known).then_some(Loss {
                line: line.number,
                from_start: self.frames[axis] == Frame::Untouched,
            });
        }
    }

    fn go(&mut self, line: &Line<'_>, interpreter: &Interpreter<AXES>) {
        let stored = [28, 30]
            .into_iter()
            .find(|code| line.has(Number::from_int(*code)));
        let modal = interpreter.modal();
        let jogs_by = |code| line.has(Number::from_int(code));
        let counts = match modal.distance {
            Distance::Absolute => !jogs_by(91),
            Distance::Incremental => jogs_by(90),
        };
        let named: Vec<usize> = line.axes::<AXES>().collect();
        let all = stored.is_some() && named.is_empty();
        let axes = match all {
            true => (0..AXES).collect(),
            false => named,
        };
        for axis in axes {
            let is_extruder = line.letters.get(axis) == Some(&'E');
            let counts = match modal.extrusion {
                Some(extrusion) if is_extruder => extrusion == Distance::Absolute,
                _ => counts,
            };
            let frame = &mut self.frames[axis];
            *frame = match (stored, *frame) {
                (Some(code), _) => Frame::Stored(code as u8),
                _ if jogs_by(53) => Frame::Machine,
                _ if line.probes() => line.lost(),
                _ if counts => Frame::Work(modal.system),
                (None, Frame::Untouched) => Frame::Lost(Loss {
                    line: line.number,
                    from_start: true,
                }),
                (None, Frame::Stored(_)) => line.lost(),
                (None, known) => known,
            };
        }
        // A canned cycle ends at its R plane, or where it began.
        let is_cycle = matches!(modal.motion, Motion::Cycle(_));
        let drills = is_cycle && line.value(Letter::R).is_some();
        if drills && counts && modal.retract == Retract::Clear {
            self.frames[modal.plane.across().min(AXES - 1)] = Frame::Work(modal.system);
        }
    }

    fn rise(&mut self, interpreter: &Interpreter<AXES>) {
        if let Some(z) = base(interpreter, &self.frames, 2) {
            self.highest = Some(self.highest.map_or(z, |highest| highest.max(z)));
        }
    }
}

/// An axis's coordinate in the work system by which it is found, without G92 and tool length.
pub(super) fn base<const AXES: usize>(
    interpreter: &Interpreter<AXES>,
    frames: &[Frame; AXES],
    axis: usize,
) -> Option<Coordinate> {
    let Frame::Work(system) = frames.get(axis)? else {
        return None;
    };
    let zero = interpreter.offsets().get(OffsetId::Work(*system));
    Some(*interpreter.position().get(axis)? - *zero.get(axis)?)
}

const G10: Number = Number::from_int(10);
const G92: Number = Number::from_int(92);
const G92_1: Number = Number::from_nanos(92_100_000_000);

/// The words of a line, and the letters of the machine's axes.
struct Line<'a> {
    number: u64,
    words: Vec<Word>,
    letters: &'a [char],
}

impl Line<'_> {
    /// Returns true if it has this G word.
    fn has(&self, code: Number) -> bool {
        self.codes().any(|value| value == code)
    }

    fn codes(&self) -> impl Iterator<Item = Number> + '_ {
        let codes = self.words.iter().filter(|word| word.letter() == Letter::G);
        codes.map(Word::value)
    }

    fn value(&self, letter: Letter) -> Option<Number> {
        let word = self.words.iter().find(|word| word.letter() == letter);
        word.map(Word::value)
    }

    /// The axes that it names.
    fn axes<const AXES: usize>(&self) -> impl Iterator<Item = usize> + '_ {
        (0..AXES).filter(|axis| {
            let letter = self.letters.get(*axis);
            self.words
                .iter()
                .any(|word| Some(&word.letter().as_char()) == letter)
        })
    }

    /// Notes which zeros it sets.
    fn note_zeros(&self, sets: &mut Sets) {
        let places = |one: &Word| matches!(one.letter().as_char(), 'A'..='C' | 'U'..='Z');
        let names = self.words.iter().any(places);
        for code in self.codes() {
            match code.trunc() {
                54..=59 => sets.system = true,
                10 => {
                    sets.system |= self
                        .value(Letter::P)
                        .is_some_and(|system| system.trunc() > 0)
                }
                43 | 49 => sets.length = true,
                52 => sets.shift = true,
                // G92.1 and its like name no axis.
                92 => sets.shift |= code != G92 || names,
                _ => {}
            }
        }
    }

    fn lost(&self) -> Frame {
        Frame::Lost(Loss {
            line: self.number,
            from_start: false,
        })
    }

    fn probes(&self) -> bool {
        self.codes().any(|code| code.trunc() == 38)
    }

    fn names_motion(&self) -> bool {
        names_motion(&self.words)
    }

    /// The work system of a G10, by its P word; 0 is the one in force.
    fn system(&self, now: WorkSystem) -> Option<WorkSystem> {
        match self.value(Letter::P)?.trunc() {
            0 => Some(now),
            number => WorkSystem::ALL
                .get(usize::try_from(number - 1).ok()?)
                .copied(),
        }
    }
}

/// Returns true if a line says by a word of its own how it moves.
pub(crate) fn names_motion(words: &[Word]) -> bool {
    words.iter().any(|word| {
        let code = word.value().trunc();
        word.letter() == Letter::G && matches!(code, 0..=3 | 38 | 73 | 80..=89)
    })
}

impl<const AXES: usize> super::Checker<AXES> {
    /// Notes by which words the program has come to its place.
    pub(super) fn note_standing(
        &mut self,
        line: &[u8],
        first: &Commands<AXES>,
        rest: &Commands<AXES>,
    ) {
        if let Some(standing) = &mut self.standing {
            let commands = first.iter().chain(rest);
            standing.take(
                self.number,
                line,
                &self.letters,
                commands,
                &self.interpreter,
            );
        }
    }
}
