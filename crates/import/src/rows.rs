//! Converts the rows of an engraver, `dx, dy, burn`. Each row is a straight way from the end of the
//! row before, and is cut if `burn` is 1.
//!
//! A first line may name the columns (`dx` or `x`, `dy` or `y`, `engrave` or `burn`); other columns
//! are then ignored. Without it a row has the three columns above. Columns are separated by commas,
//! semicolons, tabs or blanks.

use crate::decimal;
use crate::gcode_text::comment;
use crate::{Fault, Faults, Job, Mm, Point};

/// The way in which rows are engraved.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Options {
    /// The length of the rows' unit, mm: rows have no scale of their own.
    pub scale: Mm,
    /// The feed along the rows, mm/min.
    pub feed: Mm,
    /// The feed downwards, mm/min.
    pub plunge: Mm,
    /// The height by which the tool is lifted between cuts, mm.
    pub lift: Mm,
    /// Speed of the spindle, 1/min.
    pub spindle: u32,
    /// True if the tool moves down and up between two switches (M3, M5), and not by a plunge and a
    /// lift of Z.
    pub has_switches: bool,
}

impl Default for Options {
    /// The scale, feeds and speed of `import rows`.
    fn default() -> Self {
        Self {
            scale: Mm::from_nanos(1_000_000_000),
            feed: Mm::from_nanos(600_000_000_000),
            plunge: Mm::from_nanos(200_000_000_000),
            lift: Mm::from_nanos(2_000_000_000),
            spindle: 1000,
            has_switches: false,
        }
    }
}

struct Row {
    way: Point,
    burns: bool,
}

/// Makes the job of some rows. At its start the tool must be on the surface, at the first point.
///
/// # Errors
/// All that was not understood.
pub fn job(text: &str, options: &Options) -> Result<Job, Faults> {
    let rows = rows(text, options.scale)?;
    let Options {
        lift,
        spindle,
        scale,
        ..
    } = options;
    let mut lines =
        vec![
            comment(&format!(
            "Starts with the tool {}at the first point. {scale} mm a unit: the rows have no scale.",
            if options.has_switches { "" } else { "on the surface, " },
        )),
            "G21 G91 G94 G17".to_owned(),
        ];
    lines.extend(match options.has_switches {
        true => vec!["M5".to_owned()],
        false => vec![format!("G0 Z{lift}")],
    });
    if !options.has_switches && *spindle > 0 {
        lines.extend([format!("M3 S{spindle}"), "G4 P1".to_owned()]);
    }
    let mut is_down = false;
    for Row { way, burns } in rows {
        if is_down != burns {
            is_down = burns;
            lines.extend(tool(is_down, options));
        }
        lines.extend(leg(way, is_down));
    }
    if is_down {
        lines.extend(tool(false, options));
    }
    lines.extend(["M5", "G90", "M30"].map(str::to_owned));
    Ok(Job {
        lines,
        notes: Vec::new(),
    })
}

/// Lifts the tool; or lowers it to the surface, and sets the feed of the rows that follow.
fn tool(down: bool, options: &Options) -> Vec<String> {
    let Options {
        lift, plunge, feed, ..
    } = options;
    if options.has_switches {
        let code = if down { "M3" } else { "M5" };
        let feed = down.then(|| format!("F{feed}"));
        [code.to_owned()].into_iter().chain(feed).collect()
    } else if down {
        vec![format!("G1 Z{} F{plunge}", -*lift), format!("F{feed}")]
    } else {
        vec![format!("G0 Z{lift}")]
    }
}

fn leg(way: Point, is_down: bool) -> Option<String> {
    let code = if is_down { "G1" } else { "G0" };
    let word = |letter, length| (length != Mm::ZERO).then(|| format!(" {letter}{length}"));
    let words: Vec<String> = [word('X', way.x), word('Y', way.y)]
        .into_iter()
        .flatten()
        .collect();
    (!words.is_empty()).then(|| format!("{code}{}", words.concat()))
}

/// The mistake in a line, and its column, from 1.
type Wrong = (usize, String);

/// The columns of the rows.
#[derive(Clone, Copy)]
struct Table {
    /// The positions of X, Y and burn in a row.
    columns: [usize; 3],
    /// The most columns of a row.
    count: usize,
    /// True if a first line names the columns.
    is_named: bool,
}

fn rows(text: &str, scale: Mm) -> Result<Vec<Row>, Faults> {
    let mut lines = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty())
        .peekable();
    let (mut rows, mut faults) = (Vec::new(), Vec::new());
    let mut table = Table::UNNAMED;
    if let Some((index, named)) = lines.peek().and_then(|(i, line)| Some((*i, names(line)?))) {
        lines.next();
        match named {
            Ok(named) => table = named,
            Err((column, message)) => {
                return Err(Faults(vec![Fault::new(index + 1, column, message)]))
            }
        }
    }
    for (index, line) in lines {
        match table.row(&fields(line), scale) {
            Ok(row) => rows.push(row),
            Err((column, message)) => faults.push(Fault::new(index + 1, column, message)),
        }
    }
    if faults.is_empty() {
        Ok(rows)
    } else {
        Err(Faults(faults))
    }
}

/// The columns that a first line names; `None` if it is a row already.
fn names(line: &str) -> Option<Result<Table, Wrong>> {
    let fields = fields(line);
    let mut doubled = None;
    let mut find = |names: [&str; 2]| {
        let mut found = fields
            .iter()
            .enumerate()
            .filter(|(_, (_, field))| names.contains(&field.to_ascii_lowercase().as_str()));
        let (position, _) = found.next()?;
        doubled = doubled.or(found.next().map(|(_, field)| *field));
        Some(position)
    };
    let columns = [
        find(["dx", "x"])?,
        find(["dy", "y"])?,
        find(["engrave", "burn"])?,
    ];
    Some(match doubled {
        Some((column, name)) => Err((column, format!("{name}: another column has this meaning"))),
        None => Ok(Table {
            columns,
            count: fields.len(),
            is_named: true,
        }),
    })
}

impl Table {
    /// X, Y and burn.
    const UNNAMED: Self = Self {
        columns: [0, 1, 2],
        count: 3,
        is_named: false,
    };

    /// Reads a row. A row of more columns is refused: a comma may be meant as a decimal point.
    fn row(&self, fields: &[(usize, &str)], scale: Mm) -> Result<Row, Wrong> {
        match fields.get(self.count) {
            Some((column, _)) if self.is_named => Err((
                *column,
                "a column more than the first line names; decimals have a point".to_owned(),
            )),
            None if self.is_named || fields.len() == self.count => row(fields, self.columns, scale),
            Some(_) | None => Err((1, "expected X, Y and burn".to_owned())),
        }
    }
}

fn row(fields: &[(usize, &str)], columns: [usize; 3], scale: Mm) -> Result<Row, Wrong> {
    let [x, y, burn] = columns.map(|column| fields.get(column).copied());
    let missing = || (1, "a column is missing".to_owned());
    let (x, y, burn) = (
        x.ok_or_else(missing)?,
        y.ok_or_else(missing)?,
        burn.ok_or_else(missing)?,
    );
    let length = |(column, text): (usize, &str)| {
        decimal::length(text, scale.nanos())
            .map_err(|message| (column, format!("{text}: {message}")))
    };
    let way = Point {
        x: length(x)?,
        y: length(y)?,
    };
    match burn.1 {
        "0" => Ok(Row { way, burns: false }),
        "1" => Ok(Row { way, burns: true }),
        text => Err((burn.0, format!("{text}: expected 1 (cut) or 0 (travel)"))),
    }
}

/// Fields, each with its column in the line, from 1.
fn fields(line: &str) -> Vec<(usize, &str)> {
    let is_divided = line.contains([',', ';']);
    let divides = |c: char| matches!(c, ',' | ';') || (!is_divided && c.is_ascii_whitespace());
    let start = line.as_ptr() as usize;
    let fields = line.split(divides).map(str::trim);
    let placed = fields.map(|field| (field.as_ptr() as usize - start + 1, field));
    placed
        .filter(|(_, field)| is_divided || !field.is_empty())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decimal::NANOS_PER_MM;

    fn options(scale: &str) -> Options {
        let mm = |text: &str| decimal::length(text, NANOS_PER_MM).unwrap();
        Options {
            scale: mm(scale),
            feed: mm("600"),
            plunge: mm("200"),
            lift: mm("2"),
            spindle: 1000,
            has_switches: false,
        }
    }

    fn made(text: &str, scale: &str) -> Vec<String> {
        let mut lines = job(text, &options(scale)).unwrap().lines;
        lines.truncate(lines.len() - 3);
        lines.split_off(5)
    }

    #[test]
    fn a_spindle_of_speed_zero_is_not_started() {
        let by_hand = Options {
            spindle: 0,
            ..options("1")
        };
        let lines = job("10 0 1", &by_hand).unwrap().lines;
        assert!(
            !lines.iter().any(|line| line.starts_with("M3 ")),
            "{lines:?}"
        );
    }

    #[test]
    fn cuts_go_down_first_and_travels_up() {
        let lines = made(
            "row,dx,dy,engrave\n1,10,-10,1\n2,0,-2,1\n3,4,0,0\n4,0,0,0",
            "1",
        );
        assert_eq!(
            lines,
            [
                "G1 Z-2 F200",
                "F600",
                "G1 X10 Y-10",
                "G1 Y-2",
                "G0 Z2",
                "G0 X4"
            ]
        );
    }

    #[test]
    fn a_scale_is_exact_and_blanks_divide_too() {
        assert_eq!(made("3 -1 0\n", "0.1"), ["G0 X0.3 Y-0.1"]);
        assert_eq!(made("3; -1; 0\n", "25.4"), ["G0 X76.2 Y-25.4"]);
    }

    #[test]
    fn each_fault_has_its_place() {
        let Faults(faults) = job("1,2,3\n1,,0\n1,2\n7,x,0\n", &options("1")).unwrap_err();
        let places: Vec<_> = faults
            .iter()
            .map(|fault| (fault.line, fault.column))
            .collect();
        assert_eq!(places, [(1, 5), (2, 3), (3, 1), (4, 3)]);
    }

    #[test]
    fn a_row_of_more_columns_than_named_and_a_doubled_name_are_refused() {
        let places = |text| {
            let Faults(faults) = job(text, &options("1")).unwrap_err();
            let places = faults.iter().map(|fault| (fault.line, fault.column));
            places.collect::<Vec<_>>()
        };
        assert_eq!(
            places("dx;dy;burn\n1;5;1\n1,5;0,5;1\n"),
            [(3, 7)],
            "a comma is no decimal point"
        );
        assert_eq!(places("\ndx,note,dy,X,burn\n1,,2,3,1\n"), [(2, 12)]);
        assert_eq!(places("burn x y burn\n1 2 3 4\n"), [(1, 10)]);
        let lines = made("note,dx,dy,burn,note\n,1,2,0,\n", "1");
        assert_eq!(lines, ["G0 X1 Y2"], "other columns are ignored");
    }
}
