//! Files of other machines that are checked, timed and run as they are: the job that `leadscrew
//! import` makes of them, with its defaults.

use crate::machine::Machine;
use leadscrew_import::drill::{jobs, Options as BoardOptions, Speeds};
use leadscrew_import::excellon::{self, Known};
use leadscrew_import::{print, rows, rp, Faults, Job as Made, Mm};
use leadscrew_machine::home;
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_sim::profile::{DrillTable, End};

/// The kind of a file of another machine, as its first lines show it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Foreign {
    /// Holes of a circuit board.
    Drill,
    /// RP code of an extruding prototyping machine.
    Rp,
    /// Rows of an engraver.
    Rows,
    /// A printer's file, as slicers write it for Marlin.
    Print,
}

impl Foreign {
    /// Returns the kind of a file with these first bytes, 4096 at least unless it is shorter;
    /// `None` for G-code.
    pub fn of(head: &[u8]) -> Option<Self> {
        kind(&String::from_utf8_lossy(head))
    }

    /// Makes the job of the file called `name` with this text, for a machine. Its notes say first
    /// how the file was taken.
    ///
    /// # Errors
    /// In words: what was not understood and where, or what the machine file lacks.
    pub fn job(self, name: &str, bytes: &[u8], machine: &Machine) -> Result<Made, String> {
        let made = self.made(name, bytes, machine);
        made.map_err(|said| match said.contains("--") {
            true => {
                let import = format!("leadscrew import {} FILE -o JOB.nc", self.command());
                format!("{said}\n  `{import}` has these options, and makes a job of the file")
            }
            false => said,
        })
    }

    /// The name of the import.
    fn command(self) -> &'static str {
        match self {
            Self::Drill => "drill",
            Self::Rp => "rp",
            Self::Rows => "rows",
            Self::Print => "print",
        }
    }

    fn made(self, name: &str, bytes: &[u8], machine: &Machine) -> Result<Made, String> {
        let text = unix_lines(bytes);
        let faulty = |faults: Faults| faults.show(name, &text);
        let home = home_of(machine);
        let (what, made) = match self {
            Self::Drill => ("an Excellon file", board(&text, machine, faulty)?),
            Self::Rp => (
                "RP code",
                rp::job(&text, &rp::Options::default()).map_err(faulty)?,
            ),
            Self::Rows => (
                "an engraver's rows",
                rows::job(&text, &rows::Options::default()).map_err(faulty)?,
            ),
            Self::Print => (
                "a slicer's file for a printer",
                print::job(&text, &print::Options { home }).map_err(faulty)?,
            ),
        };
        let at = home
            .filter(|_| self == Self::Print)
            .map(|[x, y, z]| format!(" --home {},{},{}", x.to_f64(), y.to_f64(), z.to_f64()));
        let at = at.unwrap_or_default();
        let command = self.command();
        let taken = format!("{what}, taken as `leadscrew import {command}{at}` takes it");
        Ok(Made {
            notes: std::iter::once(taken).chain(made.notes).collect(),
            ..made
        })
    }
}

/// The one job of a board, with M6 between its tools.
fn board(text: &str, machine: &Machine, faulty: impl Fn(Faults) -> String) -> Result<Made, String> {
    let options = board_options(&machine.file.drill, None, None)?;
    let drawing = excellon::read(text, &Known::default()).map_err(faulty)?;
    let notes = drawing.notes.clone();
    let made = jobs(&[drawing], &options, &board_speeds(machine))?;
    let job = made.into_iter().next().map(|one| one.job);
    let job = job.unwrap_or_default();
    Ok(Made {
        notes: notes.into_iter().chain(job.notes).collect(),
        lines: job.lines,
    })
}

/// Z between holes if neither an option nor the machine file gives it.
const CLEARANCE: Mm = Mm::from_nanos(2_000_000_000);

/// Returns how a board is drilled by the machine file; depth and feed may be told in its place.
///
/// # Errors
/// In words, if a depth or a feed is neither told nor in the file.
pub fn board_options(
    file: &DrillTable,
    depth: Option<Mm>,
    feed: Option<Mm>,
) -> Result<BoardOptions, String> {
    let mm = |mm: f64| Mm::from_nanos((mm * 1e9).round() as i64);
    let needed = |value: Option<Mm>, name: &str, key: &str| {
        let said = format!("expected {name}, or `{key}` in [drill] of the machine file");
        value.ok_or(said)
    };
    let depth = depth.or(file.depth_mm.map(|of| mm(of.mm())));
    let feed = feed.or(file.feed_mm_min.map(|of| mm(of.get())));
    Ok(BoardOptions {
        depth: needed(depth, "--depth", "depth_mm")?,
        clearance: file.clearance_mm.map_or(CLEARANCE, |of| mm(of.mm())),
        feed: needed(feed, "--feed", "feed_mm_min")?,
        mill_feed: file.mill_feed_mm_min.map(|of| mm(of.get())),
        peck: file.peck_mm.map(|of| mm(of.get())),
        tool_feeds: false,
        spindle: None,
        mirror: None,
        from_corner: false,
        bits: Vec::new(),
        mills_slots: false,
        job_a_bit: false,
        cycles: false,
    })
}

/// Returns how fast a machine drills.
pub fn board_speeds(machine: &Machine) -> Speeds {
    let of = |setting| {
        let all = machine.of_axes(setting);
        [all[0], all[1], all[2]]
    };
    Speeds {
        rates: of(AxisSetting::MaxRate),
        accelerations: of(AxisSetting::Acceleration),
        spindle: machine.settings.value(Setting::MaxSpeed).nanos() as f64 / 1e9,
    }
}

/// The place of a printer's tool after homing, in its files' coordinates: their zero is at the
/// home switches. `None` for a machine that does not home X, Y and Z at their low ends.
fn home_of(machine: &Machine) -> Option<[Mm; 3]> {
    let axes = &machine.file.axes;
    let pull_off = |axis| Mm::from_nanos(home::pull_off(&machine.settings, axis).nanos());
    let place = |(axis, end)| match end {
        End::Low => Some(pull_off(axis)),
        End::Zero | End::High => None,
    };
    let homes = machine.settings.is_on(Setting::Homing);
    let places = [(0, axes.x.home), (1, axes.y.home), (2, axes.z.home)];
    let places = places.map(|axis| place(axis).filter(|_| homes));
    let [Some(x), Some(y), Some(z)] = places else {
        return None;
    };
    Some([x, y, z])
}

/// Returns the text of a file, with all lines ended by LF and without a byte order mark.
pub fn unix_lines(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{FEFF}');
    text.replace("\r\n", "\n").replace('\r', "\n")
}

/// Returns the kind of a file with these first bytes, if it is a drawing or a text that no machine
/// follows.
pub fn drawing(head: &[u8]) -> Option<&'static str> {
    let text = String::from_utf8_lossy(head);
    let text = text.trim_start_matches('\u{FEFF}').trim_start();
    let lower = text
        .get(..text.floor_char_boundary(512))
        .unwrap_or_default();
    let lower = lower.to_ascii_lowercase();
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let is_gerber = |line: &str| line.starts_with("%FS") || matches!(line, "%MOIN*%" | "%MOMM*%");
    if lower.starts_with('<') {
        Some(match (lower.contains("<svg"), lower.contains("<html")) {
            (true, _) => "an SVG drawing",
            (_, true) => "a web page",
            _ => "an XML file",
        })
    } else if lower.starts_with("%pdf") || lower.starts_with("%!ps") {
        Some("a document to be printed")
    } else if lower.starts_with("iso-10303-21") || lower.starts_with("solid ") {
        Some("a model in three dimensions")
    } else if lower.starts_with("in;") {
        Some("an HPGL plot")
    } else if ["pa;", "^in;", ";;^in;"]
        .iter()
        .any(|begin| lower.starts_with(begin))
    {
        Some("a program in Roland's RML")
    } else if lower
        .split_ascii_whitespace()
        .take(3)
        .eq(["0", "begin", "pgm"])
    {
        Some("a program in Heidenhain's language")
    } else if lower.starts_with("imf_pbl") {
        Some("a program in isel's NCP")
    } else if lower.starts_with('\'') && lower.contains("shopbot") {
        Some("a program of a ShopBot")
    } else if text.lines().any(|line| is_gerber(line.trim())) {
        Some("a Gerber drawing; the holes of its board are in a drill file")
    } else if lines.any(|line| line == "SECTION") && lower.contains("header") {
        Some("a DXF drawing")
    } else {
        None
    }
}

/// The kind of a file that begins with `head`; `None` for G-code.
fn kind(head: &str) -> Option<Foreign> {
    let lines = head.lines().map(str::trim).filter(|line| !line.is_empty());
    let lines: Vec<&str> = lines.collect();
    let code = lines
        .iter()
        .find(|line| !line.starts_with([';', '%', '(']))
        .copied()
        .unwrap_or("");
    if code
        .get(..6)
        .is_some_and(|begin| begin.eq_ignore_ascii_case("rpcode"))
    {
        Some(Foreign::Rp)
    } else if code == "M48" || is_tool(code) || is_board(&lines) || is_allegro(&lines) {
        Some(Foreign::Drill)
    } else if names_columns(code) {
        Some(Foreign::Rows)
    } else if lines.iter().any(|line| is_slicers(line)) {
        Some(Foreign::Print)
    } else {
        None
    }
}

/// Returns true if a header of holes begins behind other lines.
fn is_board(lines: &[&str]) -> bool {
    let mut header = lines.iter().skip_while(|line| **line != "M48").skip(1);
    header.any(|line| is_tool(line))
}

/// Returns true if a file has the comments with which Allegro begins its drill and router files.
fn is_allegro(lines: &[&str]) -> bool {
    let is = |begin: &str| lines.iter().any(|line| line.starts_with(begin));
    is(";LEADER:") && is(";CODE  : ASCII")
}

/// Returns true if a line describes a drill, such as `T1C0.8`.
fn is_tool(line: &str) -> bool {
    let digits = |text: &str| {
        text.find(|c: char| !c.is_ascii_digit())
            .unwrap_or(text.len())
    };
    let Some(rest) = line.strip_prefix('T') else {
        return false;
    };
    let end = digits(rest);
    let size = rest.get(end..).and_then(|rest| rest.strip_prefix('C'));
    end > 0 && size.is_some_and(|size| size.starts_with(|c: char| c.is_ascii_digit() || c == '.'))
}

/// Returns true if a line names the columns of an engraver's rows.
fn names_columns(line: &str) -> bool {
    let line = line.to_ascii_lowercase();
    let names: Vec<&str> = line
        .split([',', ';', '\t', ' '])
        .map(str::trim)
        .filter(|name| !name.is_empty())
        .collect();
    let has = |either: [&str; 2]| names.iter().any(|name| either.contains(name));
    has(["dx", "x"]) && has(["dy", "y"]) && has(["engrave", "burn"])
}

/// Programs that write a printer's files for Marlin, as they name themselves in comments.
const SLICERS: [&str; 12] = [
    "generated by prusaslicer",
    "generated by slic3r",
    "generated by superslicer",
    "generated by orcaslicer",
    "flavor:marlin",
    "generated with cura",
    "simplify3d",
    "ideamaker",
    "bambustudio",
    "kisslicer",
    "generated by matterslice",
    "craftware",
];

fn is_slicers(line: &str) -> bool {
    let line = line.to_ascii_lowercase();
    line.starts_with(';') && SLICERS.iter().any(|name| line.contains(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_recognised_by_its_first_lines() {
        for (head, expected) in [
            ("M48\nMETRIC,TZ\nT1C0.800\n%\n", Some(Foreign::Drill)),
            ("; FILE_FORMAT=2:4\n\nM48\nINCH\n", Some(Foreign::Drill)),
            (
                "%\nT2C0.034F200S100\nX004000Y022000\n",
                Some(Foreign::Drill),
            ),
            (
                "G90\nM72\nM48\nT0C0.006\nT1C0.012\n%\n",
                Some(Foreign::Drill),
            ),
            (
                ";LEADER: 12 \n;CODE  : ASCII \n%\nG90\nT01\nX004450Y000200\n",
                Some(Foreign::Drill),
            ),
            ("RPcode.V.1.0.0 \n1\t0.5\t0.0\t0.25\n", Some(Foreign::Rp)),
            (
                "row,dx,dy,engrave,cum_x\n1,10,-10,1,10\n",
                Some(Foreign::Rows),
            ),
            ("x y burn\n1 2 1\n", Some(Foreign::Rows)),
            (
                "; generated by PrusaSlicer 2.5.0\nM107\n",
                Some(Foreign::Print),
            ),
            ("; KISSlicer - FREE\nM104 S200\n", Some(Foreign::Print)),
            (
                "; HEADER_BLOCK_START\n; BambuStudio 01.06.02.04\nM73 P0\n",
                Some(Foreign::Print),
            ),
            (
                "; Generated by MatterSlice 2.20.1\nM109 S210\n",
                Some(Foreign::Print),
            ),
            (";FLAVOR:Marlin\n;TIME:66\nM140 S60\n", Some(Foreign::Print)),
        ] {
            assert_eq!(kind(head), expected, "{head}");
        }
    }

    #[test]
    fn a_drawing_is_called_by_its_name() {
        for (head, expected) in [
            ("<svg xmlns='http://www.w3.org/2000/svg'/>\n", "SVG"),
            ("\u{FEFF}<?xml version='1.0'?>\n<svg/>\n", "SVG"),
            ("<!DOCTYPE html>\n<html>\n", "web page"),
            ("%PDF-1.4\n", "printed"),
            ("solid cube\n facet normal 0 0 1\n", "three dimensions"),
            ("IN;SP1;PU0,0;PD1000,0;\n", "HPGL"),
            (";;^IN;!MC1;V15.0;\n", "Roland"),
            ("PA;PA;!PZ0,100;VS10;!VZ10;!MC1;\n", "Roland"),
            ("0  BEGIN PGM PART MM\n1 L X+10\n", "Heidenhain"),
            ("IMF_PBL_V1.0\nN10 FASTABS X0\n", "isel"),
            ("'----\n'SHOPBOT FILE IN MM\nSA\nM3,1,2,3\n", "ShopBot"),
            ("G04 made by KiCad*\n%FSLAX46Y46*%\n%MOMM*%\n", "Gerber"),
            ("  0\nSECTION\n  2\nHEADER\n", "DXF"),
        ] {
            let told = drawing(head.as_bytes());
            assert!(told.is_some_and(|told| told.contains(expected)), "{head}");
        }
        for head in [
            "",
            "%\nO1\n",
            "(section)\nG0 X1\n",
            "G04 P1\n",
            "in inches\n",
            "'quoted\n",
            "P1\n",
            "M48\n",
        ] {
            assert_eq!(drawing(head.as_bytes()), None, "{head}");
        }
    }

    #[test]
    fn g_code_is_taken_as_it_is() {
        for head in [
            "",
            "%\nO1000 (part)\nT1 M6\n",
            "T1\nM6\nG0 X1\n",
            "G1 X1 Y2 (x y burn)\n",
            "(generated by PrusaSlicer 2.5.0)\n$H\nM104 S200\n",
            "M3 S1000\nM48\n",
            "TC1\n",
            "T1C\n",
        ] {
            assert_eq!(kind(head), None, "{head}");
        }
    }
}
