//! The settings of the tool change, and the tool table: a setting for each tool's length.

use leadscrew_gcode::Number;
use leadscrew_machine::settings::group::Group;
use leadscrew_machine::settings::table::{Kind, Row};

/// The number of tools in the table.
pub const TOOLS: usize = 16;

/// `$860`: how far above the higher end of its way the tool crosses back to the program's place.
pub(crate) static CLEARANCE: Row = Row {
    number: 860,
    name: "Tool change clearance",
    unit: "mm",
    description:
        "After a tool change Z goes up by so much above the program's place before X and Y go back.",
    group: Group::Tool,
    kind: Kind::Decimal {
        places: 3,
        zero: true,
    },
    default: Number::from_int(0),
    listed: false,
};

/// `$861`: how long the spindle runs up before Z goes down.
pub(crate) static SPIN_UP: Row = Row {
    number: 861,
    name: "Tool change spin-up",
    unit: "ms",
    description: "After a tool change the spindle runs up for so long before Z goes down.",
    group: Group::Tool,
    kind: Kind::Whole { max: 60_000 },
    default: Number::from_int(0),
    listed: false,
};

/// `$862`: how fast the tool moves back.
pub(crate) static RETURN_RATE: Row = Row {
    number: 862,
    name: "Tool change rate",
    unit: "mm/min",
    description: "After a tool change the axes go back so fast.",
    group: Group::Tool,
    kind: Kind::Decimal {
        places: 3,
        zero: false,
    },
    default: Number::from_int(500),
    listed: false,
};

/// `$881`: the length of tool 1; the lengths of the other tools follow.
pub(crate) const FIRST_LENGTH: u16 = 881;

/// The longest tool, mm.
pub(crate) const LONGEST: u32 = 1_000;

const NAMES: [&str; TOOLS] = [
    "Tool 1 length",
    "Tool 2 length",
    "Tool 3 length",
    "Tool 4 length",
    "Tool 5 length",
    "Tool 6 length",
    "Tool 7 length",
    "Tool 8 length",
    "Tool 9 length",
    "Tool 10 length",
    "Tool 11 length",
    "Tool 12 length",
    "Tool 13 length",
    "Tool 14 length",
    "Tool 15 length",
    "Tool 16 length",
];

static LENGTHS: [Row; TOOLS] = {
    let mut rows = [length(FIRST_LENGTH, NAMES[0]); TOOLS];
    let mut index = 0;
    while index < TOOLS {
        rows[index] = length(FIRST_LENGTH + index as u16, NAMES[index]);
        index += 1;
    }
    rows
};

const fn length(number: u16, name: &'static str) -> Row {
    Row {
        number,
        name,
        unit: "mm",
        description: "The length that G43 adds to the work offset of Z; G10 L1 sets it.",
        group: Group::Tool,
        kind: Kind::Signed { most: LONGEST },
        default: Number::from_int(0),
        listed: false,
    }
}

/// All settings of the tool change.
pub(crate) fn all() -> impl Iterator<Item = &'static Row> {
    [&CLEARANCE, &SPIN_UP, &RETURN_RATE]
        .into_iter()
        .chain(&LENGTHS)
}

/// The index in the tool table of the length with this setting number.
pub(crate) fn tool_of(number: u16) -> Option<usize> {
    number.checked_sub(FIRST_LENGTH).map(usize::from)
}
