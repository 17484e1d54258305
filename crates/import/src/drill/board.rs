//! Joins the tools and holes of all files to one board.

use super::{counted, Mirror, Options, Speeds};
use crate::excellon::{Drawing, Shape, Tool, MOST_OF_MACHINES};
use crate::{Mm, Point};
use std::collections::HashSet;

/// A board: its bits in the order in which they are used.
pub(super) struct Board {
    pub(super) groups: Vec<Group>,
    pub(super) notes: Vec<String>,
}

/// A bit and its shapes.
pub(super) struct Group {
    pub(super) bit: Bit,
    pub(super) shapes: Vec<Shape>,
}

/// A bit in the spindle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Bit {
    /// Its number, `T`.
    pub(super) number: u32,
    pub(super) diameter: Option<Mm>,
    /// The speed at which the bit goes down, mm/min.
    pub(super) feed: Mm,
    /// The speed at which the bit turns, 1/min.
    pub(super) speed: u32,
}

impl Board {
    /// Joins the files.
    ///
    /// # Errors
    /// If the files have nothing to drill or mill, or more tools than a machine has numbers for.
    pub(super) fn new(
        files: &[Drawing],
        options: &Options,
        speeds: &Speeds,
    ) -> Result<Self, String> {
        let mut board = Self {
            groups: Vec::new(),
            notes: Vec::new(),
        };
        for file in files {
            for (number, tool) in &file.tools {
                let hits = file.hits.iter().filter(|hit| hit.tool == *number);
                let shapes: Vec<Shape> = hits.map(|hit| hit.shape.clone()).collect();
                if !shapes.is_empty() {
                    let bit = board.bit(*number, tool, options, speeds);
                    board.add(bit, shapes)?;
                }
            }
        }
        board.drop_doubles();
        if board.groups.is_empty() {
            return Err("no hole to drill was found in the files".to_owned());
        }
        if let Some(axis) = options.mirror {
            board.mirror(axis);
        }
        if options.from_corner {
            board.move_corner();
        }
        board.measure();
        Ok(board)
    }

    /// Drops shapes that a bit has made already: CAD programs write the holes of stacked pads twice.
    fn drop_doubles(&mut self) {
        for group in &mut self.groups {
            let mut made = HashSet::new();
            let before = group.shapes.len();
            group
                .shapes
                .retain(|shape| !made.contains(&shape.reversed()) && made.insert(shape.clone()));
            let doubles = before - group.shapes.len();
            if doubles > 0 {
                self.notes.push(format!(
                    "T{}: left out {} in the place of another one",
                    group.bit.number,
                    counted(doubles, "hole")
                ));
            }
        }
    }

    /// Notes the number of the holes, and their places.
    fn measure(&mut self) {
        let shapes = self.groups.iter().flat_map(|group| &group.shapes);
        let points: Vec<Point> = shapes.clone().flat_map(Shape::points).collect();
        let ends = |part: fn(&Point) -> Mm| {
            let parts = points.iter().map(part);
            let (least, most) = (parts.clone().min(), parts.max());
            (least.unwrap_or_default(), most.unwrap_or_default())
        };
        let ((left, right), (near, far)) = (ends(|point| point.x), ends(|point| point.y));
        let (holes, bits) = (shapes.count(), self.groups.len());
        self.notes.push(format!(
            "{} with {}, X{left} to X{right}, Y{near} to Y{far} mm",
            counted(holes, "hole"),
            counted(bits, "bit")
        ));
    }

    /// Splits the board into one board for each bit; the first has the notes.
    pub(super) fn apart(self) -> Vec<Self> {
        let mut notes = Some(self.notes);
        let one = |group| Self {
            groups: vec![group],
            notes: notes.take().unwrap_or_default(),
        };
        self.groups.into_iter().map(one).collect()
    }

    /// The bit that makes a tool's holes, with its feed and speed.
    fn bit(&mut self, number: u32, tool: &Tool, options: &Options, speeds: &Speeds) -> Bit {
        let own = if options.tool_feeds {
            *tool
        } else {
            Tool::default()
        };
        let highest = speeds.spindle.clamp(0.0, f64::from(u32::MAX)) as u32;
        let speed = own.speed.or(options.spindle).unwrap_or(highest);
        let fastest = Mm::computed(speeds.rates[2]).unwrap_or(Mm::LIMIT);
        let feed = own.feed.unwrap_or(options.feed);
        if feed > fastest {
            self.notes.push(format!(
                "T{number}: {feed} mm/min is more than $112={fastest}, which is taken"
            ));
        }
        if speed > highest {
            self.notes.push(format!(
                "T{number}: {speed} rpm is more than $30={highest}, which is taken"
            ));
        }
        let (number, diameter) = self.choose(number, tool, &options.bits);
        Bit {
            number,
            diameter,
            feed: feed.min(fastest),
            speed: speed.min(highest),
        }
    }

    /// The available bit nearest to the tool's diameter; of two equally near ones, the larger.
    /// Without a list of bits, the tool itself.
    fn choose(&mut self, number: u32, tool: &Tool, bits: &[Mm]) -> (u32, Option<Mm>) {
        let Some(wanted) = tool.diameter else {
            return (number, None);
        };
        let numbered = (1..).zip(bits.iter().copied());
        let nearest = numbered.min_by_key(|(_, bit)| ((*bit - wanted).abs(), wanted > *bit));
        match nearest {
            Some((place, bit)) => {
                if bit != wanted {
                    self.notes.push(format!(
                        "T{number}: {wanted} mm is drilled with the bit of {bit} mm"
                    ));
                }
                (place, Some(bit))
            }
            None => (number, Some(wanted)),
        }
    }

    /// Adds shapes to their bit. Tools of one diameter share a bit, whatever their numbers in the
    /// files. The bit gets the slowest of their feeds and of their speeds.
    fn add(&mut self, bit: Bit, shapes: Vec<Shape>) -> Result<(), String> {
        let same = |group: &&mut Group| match bit.diameter {
            Some(_) => group.bit.diameter == bit.diameter,
            None => group.bit.diameter.is_none() && group.bit.number == bit.number,
        };
        if let Some(group) = self.groups.iter_mut().find(same) {
            group.bit.feed = group.bit.feed.min(bit.feed);
            group.bit.speed = group.bit.speed.min(bit.speed);
            group.shapes.extend(shapes);
            return Ok(());
        }
        let number = self.free_number(bit.number)?;
        if number != bit.number {
            let whose = match bit.number {
                0..=MOST_OF_MACHINES => " of another file",
                _ => "",
            };
            self.notes
                .push(format!("T{}{whose} is T{number} of the job", bit.number));
        }
        let bit = Bit { number, ..bit };
        self.groups.push(Group { bit, shapes });
        Ok(())
    }

    /// The number of a bit in the job: its own if it is free and machines take it, otherwise the
    /// one above all others, or else the lowest free one.
    fn free_number(&self, wanted: u32) -> Result<u32, String> {
        let numbers = || self.groups.iter().map(|group| group.bit.number);
        let above = numbers().max().map_or(1, |highest| highest + 1);
        let may_be =
            |number: &u32| *number <= MOST_OF_MACHINES && numbers().all(|taken| taken != *number);
        [wanted, above]
            .into_iter()
            .chain(1..=MOST_OF_MACHINES)
            .find(may_be)
            .ok_or_else(|| format!("more than {MOST_OF_MACHINES} tools: no machine has so many"))
    }

    fn mirror(&mut self, axis: Mirror) {
        let turned = |point: Point| match axis {
            Mirror::X => Point {
                x: -point.x,
                ..point
            },
            Mirror::Y => Point {
                y: -point.y,
                ..point
            },
        };
        self.place(turned, true);
    }

    fn move_corner(&mut self) {
        let shapes = self.groups.iter().flat_map(|group| &group.shapes);
        let points: Vec<Point> = shapes.flat_map(Shape::points).collect();
        let x = points.iter().map(|point| point.x).min().unwrap_or_default();
        let y = points.iter().map(|point| point.y).min().unwrap_or_default();
        self.notes
            .push(format!("X0 Y0 of the job is X{x} Y{y} of the board"));
        self.place(|point| point - Point { x, y }, false);
    }

    fn place(&mut self, place: impl Fn(Point) -> Point + Copy, mirrors: bool) {
        for shape in self.groups.iter_mut().flat_map(|group| &mut group.shapes) {
            *shape = shape.placed(place, mirrors);
        }
    }
}
