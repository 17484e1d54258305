//! Writes the lines of the job.

use super::board::{Bit, Board, Group};
use super::{counted, levels, Options};
use crate::excellon::{Arc, Centre, Cut, Route, Shape};
use crate::gcode_text::{comment, ABSOLUTE_MM};
use crate::{Job, Mm, Point};

/// The height above the last bottom to which a rapid may go back down into a hole, mm: 0.25, but at
/// most half a peck.
const RELIEF: Mm = Mm::from_nanos(250_000_000);
/// The most holes in the row that makes a slot.
const MOST_HOLES: f64 = 10_000.0;

/// Writes the job of a board.
///
/// # Errors
/// If a slot cannot be drilled.
pub(super) fn job(board: &Board, options: &Options) -> Result<Job, String> {
    let mut writer = Writer {
        lines: Vec::new(),
        number: 0,
        levels: levels(options),
        in_cycle: false,
        options,
    };
    writer.begin(board);
    for group in &board.groups {
        writer.take(&group.bit, group.shapes.len(), board.groups.len() > 1);
        for shape in &group.shapes {
            writer.shape(shape, &group.bit)?;
        }
    }
    writer.end(board);
    Ok(Job {
        lines: writer.lines,
        notes: board.notes.clone(),
    })
}

struct Writer<'a> {
    lines: Vec<String>,
    /// The number of the hole that is being made, from 1.
    number: usize,
    levels: Vec<Mm>,
    /// True if a canned cycle is active, so that a line with only X and Y is a hole.
    in_cycle: bool,
    options: &'a Options,
}

impl Writer<'_> {
    fn say(&mut self, line: impl Into<String>) {
        self.lines.push(line.into());
    }

    /// Adds a line with its hole's number as the line number, so that `Ln:` in reports shows the
    /// progress of the job.
    fn cut(&mut self, line: String) {
        self.lines.push(format!("N{} {line}", self.number));
    }

    fn begin(&mut self, board: &Board) {
        let holes: usize = board.groups.iter().map(|group| group.shapes.len()).sum();
        let Options {
            depth, clearance, ..
        } = self.options;
        self.say(comment(&format!(
            "{} down to Z{depth}, clearance Z{clearance}",
            counted(holes, "hole")
        )));
        self.say(ABSOLUTE_MM);
        self.say(format!("G0 Z{clearance}"));
    }

    /// Changes to a bit and starts the spindle, unless its speed is 0: then it is switched by hand.
    /// If the job has only one bit, it is in the spindle from the start.
    fn take(&mut self, bit: &Bit, holes: usize, is_one_of_many: bool) {
        self.leave_cycle();
        self.say(comment(&format!(
            "{}: {}",
            name(bit),
            counted(holes, "hole")
        )));
        if is_one_of_many {
            self.say("M5");
            self.say(format!("T{} M6 {}", bit.number, comment(&name(bit))));
        }
        if bit.speed > 0 {
            self.say(format!("M3 S{}", bit.speed));
            self.say("G4 P1");
        }
        if is_one_of_many {
            self.say(format!("G0 Z{}", self.options.clearance));
        }
    }

    /// Goes to X0 Y0, and then down to Z0, at which the machine was set up. This last move is slow
    /// if Z0 is below the clearance.
    fn end(&mut self, board: &Board) {
        self.leave_cycle();
        self.say("M5");
        self.say("G0 X0 Y0");
        if self.options.clearance > Mm::ZERO {
            let feeds = board.groups.iter().map(|group: &Group| group.bit.feed);
            self.say(format!(
                "G1 Z0 F{}",
                feeds.min().unwrap_or(self.options.feed)
            ));
        } else {
            self.say("G0 Z0");
        }
        self.say("M30");
    }

    fn shape(&mut self, shape: &Shape, bit: &Bit) -> Result<(), String> {
        self.number += 1;
        match shape {
            Shape::Hole(at) => self.hole(*at, bit),
            Shape::Slot { from, to } if self.options.mills_slots => {
                let cuts = vec![Cut { to: *to, arc: None }];
                self.route(&Route { from: *from, cuts }, bit);
            }
            Shape::Slot { from, to } => {
                for at in row(*from, *to, bit)? {
                    self.hole(at, bit);
                }
            }
            Shape::Route(route) => self.route(route, bit),
        }
        Ok(())
    }

    /// Makes one hole. With pecks, the bit leaves the hole after each and returns to just above the
    /// last bottom.
    fn hole(&mut self, at: Point, bit: &Bit) {
        if self.options.cycles {
            return self.cycle(at, bit);
        }
        let clearance = self.options.clearance;
        self.cut(format!("G0 X{} Y{}", at.x, at.y));
        let mut bottom: Option<Mm> = None;
        for level in self.levels.clone() {
            if let Some(bottom) = bottom {
                self.cut(format!("G0 Z{clearance}"));
                self.cut(format!("G0 Z{}", bottom + self.relief()));
            }
            self.cut(format!("G1 Z{level} F{}", bit.feed));
            bottom = Some(level);
        }
        self.cut(format!("G0 Z{clearance}"));
    }

    /// Makes one hole by a canned cycle. The first hole's line has all parameters, the next ones
    /// only the place.
    fn cycle(&mut self, at: Point, bit: &Bit) {
        let Point { x, y } = at;
        if self.in_cycle {
            return self.cut(format!("X{x} Y{y}"));
        }
        self.in_cycle = true;
        let Options {
            depth, clearance, ..
        } = self.options;
        let (code, peck) = match self.options.peck {
            Some(peck) => ("G83", format!(" Q{peck}")),
            None => ("G81", String::new()),
        };
        let feed = bit.feed;
        self.cut(format!(
            "G98 {code} X{x} Y{y} Z{depth} R{clearance}{peck} F{feed}"
        ));
    }

    fn leave_cycle(&mut self) {
        if self.in_cycle {
            self.say("G80");
        }
        self.in_cycle = false;
    }

    fn relief(&self) -> Mm {
        let peck = self.options.peck.unwrap_or_default();
        RELIEF.min(Mm::from_nanos(peck.nanos() / 2))
    }

    /// Mills one path back and forth, a peck deeper each time.
    fn route(&mut self, route: &Route, bit: &Bit) {
        self.leave_cycle();
        self.cut(format!("G0 X{} Y{}", route.from.x, route.from.y));
        let back = route.reversed();
        for (index, level) in self.levels.clone().into_iter().enumerate() {
            self.cut(format!("G1 Z{level} F{}", bit.feed));
            let pass = if index % 2 == 0 { route } else { &back };
            self.cuts(&pass.cuts, self.options.mill_feed.unwrap_or(bit.feed));
        }
        self.cut(format!("G0 Z{}", self.options.clearance));
    }

    fn cuts(&mut self, cuts: &[Cut], feed: Mm) {
        for cut in cuts {
            let Point { x, y } = cut.to;
            let (code, centre) = cut.arc.map_or(("G1", String::new()), bend);
            self.cut(format!("{code} X{x} Y{y}{centre} F{feed}"));
        }
    }
}

fn bend(arc: Arc) -> (&'static str, String) {
    let code = if arc.is_clockwise { "G2" } else { "G3" };
    let centre = match arc.centre {
        Centre::Radius(radius) => format!(" R{radius}"),
        Centre::Offset(Point { x, y }) => format!(" I{x} J{y}"),
    };
    (code, centre)
}

fn name(bit: &Bit) -> String {
    match bit.diameter {
        Some(diameter) => format!(
            "T{} {diameter} mm, {:.4} inch",
            bit.number,
            diameter.to_f64() / 25.4
        ),
        None => format!("T{} of unknown diameter", bit.number),
    }
}

/// The holes of a slot: one at each end, and others between them with at most half the bit's
/// diameter from one to the next.
fn row(from: Point, to: Point, bit: &Bit) -> Result<Vec<Point>, String> {
    let Some(diameter) = bit.diameter else {
        return Err(format!(
            "T{}: a slot cannot be drilled with a bit of unknown diameter; --slots mill mills it",
            bit.number
        ));
    };
    let way = to - from;
    let length = way.x.to_f64().hypot(way.y.to_f64());
    let legs = (length / (diameter.to_f64() / 2.0)).ceil();
    if legs > MOST_HOLES {
        return Err(format!(
            "T{}: a slot of {length} mm would be {legs} holes",
            bit.number
        ));
    }
    let part = |leg: f64| -> Option<Point> {
        let share = leg / legs;
        Some(Point {
            x: from.x + Mm::computed(way.x.to_f64() * share)?,
            y: from.y + Mm::computed(way.y.to_f64() * share)?,
        })
    };
    let between = (1..legs as u32).filter_map(|leg| part(f64::from(leg)));
    let mut holes: Vec<Point> = std::iter::once(from).chain(between).collect();
    if from != to {
        holes.push(to);
    }
    Ok(holes)
}
