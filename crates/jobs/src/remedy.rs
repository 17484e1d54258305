//! The user's remedy for a refused word: the lines that a machine file needs, or the plain answer
//! that the word is not supported.
//!
//! One table for the command line, the page and Python. A test applies every remedy to the word
//! that it is for.

use leadscrew_machine::protocol::status::Status;

/// A word that a machine refuses, and what helps.
struct Remedy {
    /// The word: a letter, or a letter and the number of its code.
    word: &'static str,
    /// The text that says what the word needs.
    text: &'static str,
}

/// A macro, since the lines of a machine file stand behind their sentence.
macro_rules! add {
    ($what:literal, $lines:literal) => {
        concat!($what, " Add to the machine file (--machine):\n", $lines)
    };
}

const A: &str = add!(
    "This machine has no such axis.",
    "[axes.a]\nrotary = true    # leave it out for a straight axis"
);
const B: &str = add!(
    "This machine has no such axis.",
    "[axes.a]\nrotary = true\n[axes.b]\nrotary = true"
);
const C: &str = add!(
    "This machine has no such axis.",
    "[axes.a]\nrotary = true\n[axes.b]\nrotary = true\n[axes.c]\nrotary = true"
);
const EXTRUDER: &str = add!(
    "This is a 3D printer's word. `leadscrew import print` makes a job of a printer's file.",
    "[axes.e]"
);
const NOZZLE: &str = add!(
    "This is a 3D printer's word. `leadscrew import print` makes a job of a printer's file.",
    "[heaters.nozzle]\nsensor = { thermistor = { ohms_25 = 100000, beta = 3950, pull_up_ohms = 4700 } }"
);
const BED: &str = add!(
    "This is a 3D printer's word. `leadscrew import print` makes a job of a printer's file.",
    "[heaters.nozzle]\nsensor = { thermistor = { ohms_25 = 100000, beta = 3950, pull_up_ohms = 4700 } }\n\
     [heaters.bed]\nsensor = { thermistor = { ohms_25 = 100000, beta = 3950, pull_up_ohms = 4700 } }"
);
const FAN: &str = add!(
    "This is a 3D printer's word. `leadscrew import print` makes a job of a printer's file.",
    "[fan]\nfitted = true"
);
const PRINTER: &str =
    "This is a 3D printer's word. `leadscrew import print` makes a job of a printer's file.";
const TOOLS: &str = add!("This machine changes no tools.", "[tool_change]");
const MIST: &str = add!(
    "This machine has no mist coolant.",
    "[options]\nmist = true"
);
const PARKING: &str = add!(
    "This machine does not park.",
    "[options]\nparking = true\nparking_override = true"
);
const OUTPUTS: &str = add!("This machine has no such outputs.", "[outputs]\ncount = 8");
const COMPENSATION: &str =
    "Compensation for the cutter's radius is not supported: let the CAM program work it out.";
const PROGRAMS: &str = "A line alone has no parameters, expressions, O words or calls: they need \
                        the whole program in a file, which `leadscrew run`, `check` and the page \
                        take (docs/programs.md).";
const THREADS: &str = "Threading is not supported: it needs an encoder on the spindle.";
const SPLINES: &str = "Splines are not supported: let the CAM program write arcs or lines.";
const COMMA: &str =
    "A comma is no decimal point. Write X1.5 for X1,5, or choose points in the CAM \
                     program.";
const POLAR: &str = "Polar coordinates are not supported: write X and Y.";
const UNSUPPORTED: &str = "This word is not supported. Leave it out, or choose the GRBL \
                           post-processor in the CAM program.";

/// The remedies against `error:20`. A word stands here if a machine file can teach it, or if many
/// files have it.
const UNKNOWN: [Remedy; 42] = [
    Remedy { word: "A", text: A },
    Remedy { word: "B", text: B },
    Remedy { word: "C", text: C },
    Remedy {
        word: "E",
        text: EXTRUDER,
    },
    Remedy {
        word: "M82",
        text: EXTRUDER,
    },
    Remedy {
        word: "M83",
        text: EXTRUDER,
    },
    Remedy {
        word: "M104",
        text: NOZZLE,
    },
    Remedy {
        word: "M105",
        text: NOZZLE,
    },
    Remedy {
        word: "M109",
        text: NOZZLE,
    },
    Remedy {
        word: "M116",
        text: NOZZLE,
    },
    Remedy {
        word: "M140",
        text: BED,
    },
    Remedy {
        word: "M190",
        text: BED,
    },
    Remedy {
        word: "M106",
        text: FAN,
    },
    Remedy {
        word: "M107",
        text: FAN,
    },
    Remedy {
        word: "M84",
        text: PRINTER,
    },
    Remedy {
        word: "M117",
        text: PRINTER,
    },
    Remedy {
        word: "M204",
        text: PRINTER,
    },
    Remedy {
        word: "M220",
        text: PRINTER,
    },
    Remedy {
        word: "M221",
        text: PRINTER,
    },
    Remedy {
        word: "G29",
        text: PRINTER,
    },
    Remedy {
        word: "M6",
        text: TOOLS,
    },
    Remedy {
        word: "G43",
        text: TOOLS,
    },
    Remedy {
        word: "H",
        text: TOOLS,
    },
    Remedy {
        word: "M7",
        text: MIST,
    },
    Remedy {
        word: "M56",
        text: PARKING,
    },
    Remedy {
        word: "M62",
        text: OUTPUTS,
    },
    Remedy {
        word: "M63",
        text: OUTPUTS,
    },
    Remedy {
        word: "M64",
        text: OUTPUTS,
    },
    Remedy {
        word: "M65",
        text: OUTPUTS,
    },
    Remedy {
        word: "G41",
        text: COMPENSATION,
    },
    Remedy {
        word: "G41.1",
        text: COMPENSATION,
    },
    Remedy {
        word: "G42",
        text: COMPENSATION,
    },
    Remedy {
        word: "G42.1",
        text: COMPENSATION,
    },
    Remedy {
        word: "G33",
        text: THREADS,
    },
    Remedy {
        word: "G33.1",
        text: THREADS,
    },
    Remedy {
        word: "G74",
        text: THREADS,
    },
    Remedy {
        word: "G76",
        text: THREADS,
    },
    Remedy {
        word: "G84",
        text: THREADS,
    },
    Remedy {
        word: "G95",
        text: THREADS,
    },
    Remedy {
        word: "G5",
        text: SPLINES,
    },
    Remedy {
        word: "G5.1",
        text: SPLINES,
    },
    Remedy {
        word: "G5.2",
        text: SPLINES,
    },
];

/// The user's remedy for a line that was refused with `status`; `rest` is the line from the fault's
/// column on. `None`: the text of the status says it.
pub(crate) fn remedy(status: Status, rest: &str) -> Option<&'static str> {
    let word = word(rest);
    match status {
        Status::UnsupportedCommand | Status::NotWhole => {
            let found = UNKNOWN.iter().find(|remedy| remedy.word == word);
            let letter = || {
                let letter = word.get(..1)?;
                UNKNOWN.iter().find(|remedy| remedy.word == letter)
            };
            let text = found.or_else(letter).map(|remedy| remedy.text);
            // A number above 255 is out of range for M; the word is not known all the same.
            let is_known =
                status == Status::NotWhole && !(word.starts_with('M') && is_whole(&word));
            text.or((!is_known).then_some(UNSUPPORTED))
        }
        Status::NeedsProgram | Status::Calculates => Some(PROGRAMS),
        Status::OutOfRange => out_of_range(rest),
        Status::ExpectedLetter if rest.starts_with(',') => Some(COMMA),
        Status::ExpectedLetter if rest.starts_with(['@', '^']) => Some(POLAR),
        _ => None,
    }
}

/// Returns true if the number of a word has no fraction.
fn is_whole(word: &str) -> bool {
    !word.contains('.')
}

/// `error:52` means something else at each word.
fn out_of_range(rest: &str) -> Option<&'static str> {
    match rest.chars().next()?.to_ascii_uppercase() {
        'L' => Some("A canned cycle is repeated 1 to 10000 times."),
        'Q' => Some("A peck is a depth above 0, and a hole has 10000 pecks at most."),
        'X' | 'Y' | 'Z' | 'A' | 'B' | 'C' => {
            Some("The target is farther away than the machine can count.")
        }
        _ => None,
    }
}

/// The word that a text begins with, as it is listed: `m06` is `M6`.
fn word(rest: &str) -> String {
    let mut chars = rest.chars().filter(|c| *c != ' ');
    let Some(letter) = chars.next() else {
        return String::new();
    };
    let digits: String = chars
        .take_while(|c| c.is_ascii_digit() || *c == '.')
        .collect();
    let short = digits.trim_start_matches('0');
    let zero = if short.is_empty() && !digits.is_empty() {
        "0"
    } else {
        ""
    };
    format!("{}{zero}{short}", letter.to_ascii_uppercase())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{follow, Machine};
    use leadscrew_sim::profile::Profile;
    use std::path::Path;

    /// The complaint about a program's only line, as text, on the machine of a file.
    fn told(file: &str, line: &str) -> Option<String> {
        let file = Profile::parse(Path::new("test.toml"), file).unwrap();
        let machine = Machine::new(file, &[]).unwrap();
        let complaint = follow("job.nc", &machine).check(1, line.as_bytes());
        complaint.map(|complaint| complaint.to_string())
    }

    /// A line that has the word, as a CAM program writes it.
    fn line(word: &str) -> String {
        match word {
            "A" | "B" | "C" | "E" => format!("G0 {word}5"),
            "H" => "G43 H1".to_owned(),
            "M6" => "T1 M06".to_owned(),
            "G43" => "G43 H1".to_owned(),
            "M62" | "M63" | "M64" | "M65" => format!("{word} P1"),
            "M104" | "M106" | "M140" => format!("{word} S60"),
            "M109" | "M190" => format!("{word} S60"),
            code => code.to_owned(),
        }
    }

    #[test]
    fn each_remedy_that_names_lines_makes_the_word_pass() {
        for Remedy { word, text } in &UNKNOWN {
            let line = line(word);
            let shown = told("", &line).unwrap_or_else(|| panic!("{line} passes"));
            let Some((_, file)) = text.split_once(":\n") else {
                let told = *text == PRINTER;
                assert!(text.contains("not supported") || told, "{text}");
                assert!(shown.contains(text), "{line}: {shown}");
                continue;
            };
            for added in file.lines() {
                assert!(shown.contains(added), "{line}: {shown}");
            }
            assert_eq!(told(file, &line), None, "{line} with\n{file}");
        }
    }

    #[test]
    fn programs_for_other_controllers_are_told_as_such() {
        for line in [
            "#100=5",
            "G1 X#1 F100",
            "G1 X[#1+2] F100",
            "o<a> sub",
            "G1 F[1]",
            "M98 P1",
        ] {
            let shown = told("", line).unwrap();
            assert!(shown.contains(PROGRAMS), "{line}: {shown}");
        }
        let shown = told("", "G1 X1.2.3").unwrap();
        assert!(!shown.contains(PROGRAMS), "{shown}");
    }

    #[test]
    fn a_comma_polar_words_and_a_servo_are_told_as_such() {
        for line in ["G1 @5 ^30 F100", "G91 G81 R.1 Z-.5 ^60 F10"] {
            let shown = told("", line).unwrap();
            assert!(shown.contains(POLAR), "{shown}");
        }
        let shown = told("", "G1 X1,5 F100").unwrap();
        assert!(shown.contains(COMMA), "{shown}");
        let shown = told("", "M280 P0 S90").unwrap();
        assert!(shown.contains(UNSUPPORTED), "{shown}");
        let shown = told("", "M3.5").unwrap();
        assert!(!shown.contains(UNSUPPORTED), "{shown}");
    }

    #[test]
    fn a_value_out_of_range_is_explained_by_its_word() {
        let tools = "[tool_change]";
        for (line, words) in [
            ("G43 H17", "1 to 16"),
            ("G81 X1 Z-1 R1 L0 F100", "1 to 10000 times"),
            ("G83 X1 Z-1 R1 Q0 F100", "above 0"),
            ("$100=0", "The setting does not take this value"),
        ] {
            let shown = told(tools, line).unwrap();
            assert!(shown.contains(words), "{line}: {shown}");
        }
    }
}
