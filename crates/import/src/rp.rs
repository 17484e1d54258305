//! RP code: the files of an extruding prototyping machine.
//!
//! ```text
//! RPcode.V.1.0.0          the version
//! 1  0.5  20.0  0.25      extruder (1 on, 0 off), X, Y, Z in mm, apart by tabs or blanks
//! ```
//!
//! Some files have no column for the extruder; it is then always on. X and Y move together, then Z
//! alone, as on the original machine.

use crate::decimal::{self, NANOS_PER_MM};
use crate::gcode_text::{comment, ABSOLUTE_MM};
use crate::{Fault, Faults, Job, Mm, Point};

/// The way in which a part is made.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Options {
    /// Feed of X and Y with the extruder on, mm/min.
    pub feed: Mm,
    /// Feed of Z with the extruder on, mm/min.
    pub lift: Mm,
    /// The line that switches the extruder on.
    pub on: String,
    /// The line that switches the extruder off.
    pub off: String,
    /// True if rows are ways from the point before, and not places.
    pub is_incremental: bool,
    /// The temperature of the nozzle, °C; `None` if something else heats it.
    pub nozzle: Option<u16>,
    /// The temperature of the bed, °C; `None` if something else heats it.
    pub bed: Option<u16>,
}

impl Default for Options {
    /// The feeds and lines of `import rp`; nothing is heated.
    fn default() -> Self {
        Self {
            feed: Mm::from_nanos(1_005_000_000_000),
            lift: Mm::from_nanos(192_000_000_000),
            on: "M3 S1000".to_owned(),
            off: "M5".to_owned(),
            is_incremental: false,
            nozzle: None,
            bed: None,
        }
    }
}

impl Options {
    /// The lines that heat: they set both targets, and then wait for each.
    fn heat(&self) -> impl Iterator<Item = String> {
        let both = [(self.bed, 140, 190), (self.nozzle, 104, 109)];
        let set = both.map(|(celsius, set, _)| celsius.map(|celsius| format!("M{set} S{celsius}")));
        let wait =
            both.map(|(celsius, _, wait)| celsius.map(|celsius| format!("M{wait} S{celsius}")));
        set.into_iter().chain(wait).flatten()
    }
}

/// One row of a file.
struct Row {
    is_on: bool,
    place: [Mm; 3],
}

/// Makes the job of a part.
///
/// # Errors
/// All that was not understood.
pub fn job(text: &str, options: &Options) -> Result<Job, Faults> {
    let (rows, has_flag) = rows(text)?;
    let mut part = Part::new(options);
    for row in rows {
        part.row(&row);
    }
    part.lines.extend([options.off.clone(), "M30".to_owned()]);
    let assumed = "the rows have no column for the extruder: it is on in all of them".to_owned();
    Ok(Job {
        lines: part.lines,
        notes: if has_flag { Vec::new() } else { vec![assumed] },
    })
}

struct Part<'a> {
    options: &'a Options,
    lines: Vec<String>,
    is_on: bool,
    at: [Mm; 3],
}

impl<'a> Part<'a> {
    fn new(options: &'a Options) -> Self {
        let is_cold = options.nozzle.is_none() && options.bed.is_none();
        let hint = if is_cold {
            " Heat nozzle and bed first."
        } else {
            ""
        };
        let mut lines = vec![
            comment(&format!("X0 Y0 Z0: the start point of the part.{hint}")),
            ABSOLUTE_MM.to_owned(),
            options.off.clone(),
        ];
        lines.extend(options.heat());
        Self {
            options,
            lines,
            is_on: false,
            at: [Mm::ZERO; 3],
        }
    }

    fn row(&mut self, row: &Row) {
        let Options { on, off, .. } = self.options;
        if self.is_on != row.is_on {
            self.is_on = row.is_on;
            self.lines.push(if row.is_on { on } else { off }.clone());
        }
        let [x, y, z] = match self.options.is_incremental {
            true => std::array::from_fn(|axis| self.at[axis] + row.place[axis]),
            false => row.place,
        };
        self.go(Point { x, y }, z);
        self.at = [x, y, z];
    }

    /// Moves X and Y, then Z; a coordinate that stays the same is left out.
    fn go(&mut self, Point { x, y }: Point, z: Mm) {
        let Options { feed, lift, .. } = self.options;
        let (code, feed, lift) = match self.is_on {
            true => ("G1", format!(" F{feed}"), format!(" F{lift}")),
            false => ("G0", String::new(), String::new()),
        };
        if [x, y] != [self.at[0], self.at[1]] {
            self.lines.push(format!("{code} X{x} Y{y}{feed}"));
        }
        if z != self.at[2] {
            self.lines.push(format!("{code} Z{z}{lift}"));
        }
    }
}

/// All rows, and whether they have a column for the extruder.
fn rows(text: &str) -> Result<(Vec<Row>, bool), Faults> {
    let mut lines = text.lines().enumerate();
    let header = lines.next().map_or("", |(_, line)| line).trim();
    let mut faults = Vec::new();
    if !is_version(header) {
        faults.push(Fault::new(
            1,
            1,
            "expected a version, such as RPcode.V.1.0.0",
        ));
    }
    let mut columns = None;
    let mut rows = Vec::new();
    for (index, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        match row(line, &mut columns) {
            Ok(row) => rows.push(row),
            Err((column, message)) => faults.push(Fault::new(index + 1, column, message)),
        }
    }
    if faults.is_empty() {
        Ok((rows, columns != Some(WITHOUT_FLAG)))
    } else {
        Err(Faults(faults))
    }
}

/// Returns true if this is any version 1, such as `RPcode.V.1.0.0`.
fn is_version(header: &str) -> bool {
    let Some(numbers) = header.strip_prefix("RPcode.V.") else {
        return false;
    };
    let mut numbers = numbers.split('.');
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    numbers.next() == Some("1") && numbers.all(is_number)
}

/// The columns of a row without a column for the extruder, and with it.
const WITHOUT_FLAG: usize = 3;
const WITH_FLAG: usize = 4;

/// Reads a row; all rows have as many `columns` as the first.
fn row(line: &str, columns: &mut Option<usize>) -> Result<Row, (usize, String)> {
    let fields: Vec<(usize, &str)> = fields(line).collect();
    let count = fields.len();
    let end = line.trim_end().len() + 1;
    let (is_on, place) = match fields.as_slice() {
        [flag, place @ ..] if count == WITH_FLAG => (switch(flag)?, place),
        place if count == WITHOUT_FLAG => (true, place),
        _ => return Err((end, "expected extruder, X, Y and Z".to_owned())),
    };
    if *columns.get_or_insert(count) != count {
        return Err((
            end,
            "has another number of columns than the rows before".to_owned(),
        ));
    }
    let mut numbers = [Mm::ZERO; 3];
    for (number, (column, text)) in numbers.iter_mut().zip(place) {
        let length = decimal::length(text, NANOS_PER_MM);
        *number = length.map_err(|message| (*column, format!("{text}: {message}")))?;
    }
    Ok(Row {
        is_on,
        place: numbers,
    })
}

fn switch((column, text): &(usize, &str)) -> Result<bool, (usize, String)> {
    match *text {
        "0" => Ok(false),
        "1" => Ok(true),
        _ => Err((*column, format!("{text}: expected 1 (extruder on) or 0"))),
    }
}

/// Fields that are separated by tabs or blanks, with their columns in the line from 1.
fn fields(line: &str) -> impl Iterator<Item = (usize, &str)> {
    let start = line.as_ptr() as usize;
    line.split_ascii_whitespace()
        .map(move |field| (field.as_ptr() as usize - start + 1, field))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options() -> Options {
        Options {
            feed: Mm::from_nanos(1005 * NANOS_PER_MM),
            lift: Mm::from_nanos(192 * NANOS_PER_MM),
            on: "M3 S1000".to_owned(),
            off: "M5".to_owned(),
            is_incremental: false,
            nozzle: None,
            bed: None,
        }
    }

    /// The lines after the two of the opening.
    fn made(text: &str, options: &Options) -> Vec<String> {
        job(text, options).unwrap().lines.split_off(2)
    }

    #[test]
    fn z_follows_x_and_y_and_travels_are_rapids() {
        let lines = made(
            "RPcode.V.1.0.0 \n0 5 0 0\n1\t10.5\t0.0\t0.25\n0 0 0 0.25",
            &options(),
        );
        let wanted = [
            "M5",
            "G0 X5 Y0",
            "M3 S1000",
            "G1 X10.5 Y0 F1005",
            "G1 Z0.25 F192",
            "M5",
            "G0 X0 Y0",
            "M5",
            "M30",
        ];
        assert_eq!(lines, wanted);
    }

    #[test]
    fn nozzle_and_bed_are_heated_together_before_anything_moves() {
        let options = Options {
            nozzle: Some(255),
            bed: Some(205),
            ..options()
        };
        let lines = made("RPcode.V.1.0.0\n1 1 0 0", &options);
        let heat = ["M140 S205", "M104 S255", "M190 S205", "M109 S255"];
        assert_eq!(lines[1..5], heat);
        let job = job("RPcode.V.1.0.0\n1 1 0 0", &options).unwrap();
        assert!(!job.lines[0].contains("Heat"), "{}", job.lines[0]);
    }

    #[test]
    fn increments_add_up_exactly() {
        let options = Options {
            is_incremental: true,
            ..options()
        };
        let text = "RPcode.V.1.2.0\n".to_owned() + &"1 0.1 0.2 0\n".repeat(10);
        let lines = made(&text, &options);
        assert_eq!(lines[11], "G1 X1 Y2 F1005");
    }

    #[test]
    fn rows_without_the_extruder_are_extruded_and_said() {
        let job = job("RPcode.V.1.0.0\n1.0 2.0 0.5\n", &options()).unwrap();
        assert_eq!(job.lines[4], "G1 X1 Y2 F1005");
        assert_eq!(job.notes.len(), 1);
    }

    #[test]
    fn each_fault_has_its_place() {
        let text = "RPcode.V.2.0.0\n2 1 1 1\n1 1 1 1\n1 1 x 1\n1 1 1 1 1\n";
        let Faults(faults) = job(text, &options()).unwrap_err();
        let places: Vec<_> = faults
            .iter()
            .map(|fault| (fault.line, fault.column))
            .collect();
        assert_eq!(places, [(1, 1), (2, 1), (4, 5), (5, 10)]);
    }
}
