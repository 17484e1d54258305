//! Excellon files of several programs: each file of `drl/` is compared with the way a person reads
//! it.

use leadscrew_import::excellon::{read, Drawing, Known, Shape, Units};
use leadscrew_import::Point;
use std::path::Path;

/// Reads a file of `drl/`.
fn drawing(name: &str) -> Drawing {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/drl")
        .join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    read(&text, &Known::default()).unwrap_or_else(|faults| panic!("{}", faults.show(name, &text)))
}

/// The shapes of a file, as text with their tool's diameter: `0.8: 12.7 5.08`, and `1: 5 5 to 6 5`
/// for slots and routes.
fn shown(name: &str) -> Vec<String> {
    shapes(&drawing(name))
}

fn shapes(drawing: &Drawing) -> Vec<String> {
    let hits = drawing.hits.iter().map(|hit| {
        let diameter = drawing.tools[&hit.tool].diameter;
        let diameter = diameter.map_or("?".to_owned(), |diameter| diameter.to_string());
        format!("{diameter}: {}", shape(&hit.shape))
    });
    hits.collect()
}

fn shape(shape: &Shape) -> String {
    let place = |point: &Point| format!("{} {}", point.x, point.y);
    match shape {
        Shape::Hole(at) => place(at),
        Shape::Slot { from, to } => format!("{} to {}", place(from), place(to)),
        Shape::Route(route) => {
            let cuts = route.cuts.iter().map(|cut| match cut.arc {
                None => format!(" cut {}", place(&cut.to)),
                Some(arc) => {
                    let way = if arc.is_clockwise { "right" } else { "left" };
                    format!(" {way} {}", place(&cut.to))
                }
            });
            place(&route.from) + &cuts.collect::<String>()
        }
    }
}

#[test]
fn kicad_decimals_with_negative_y() {
    assert_eq!(
        shown("kicad_decimal_mm.drl"),
        [
            "0.3: 104.025 -66.45",
            "0.3: 110 -70.5",
            "1: 98.3 -60.1",
            "3.2: 95 -55"
        ]
    );
}

#[test]
fn kicad_inches_without_leading_zeros() {
    assert_eq!(
        shown("kicad_inch_tz.drl"),
        [
            "0.29972: 26.67 -16.51",
            "0.29972: 1.016 0.635",
            "1.00076: 0 -30.48"
        ]
    );
}

#[test]
fn kicad_millimetres_without_trailing_zeros() {
    assert_eq!(
        shown("kicad_mm_lz.drl"),
        ["0.8: 12.7 5.08", "0.8: 102 -0.3"]
    );
}

#[test]
fn kicad_slots_by_g85() {
    assert_eq!(
        shown("kicad_g85.drl"),
        [
            "1.00076: 25.4 38.1",
            "1.00076: 50.8 25.4 to 53.34 25.4",
            "1.00076: 76.2 -25.4 to 76.2 -26.67"
        ]
    );
}

#[test]
fn kicad_slots_as_routes() {
    assert_eq!(
        shown("kicad_routes.drl"),
        [
            "1: 5 5",
            "1: 98.3 -60.1 cut 98.3 -61.1",
            "1: 20 10 cut 22 10 cut 22 12.5"
        ]
    );
}

#[test]
fn eagle_says_nothing_of_zeros_and_its_numbers_show_them() {
    assert_eq!(
        shown("eagle_m72.drl"),
        [
            "0.59944: 34.925 7.62",
            "0.59944: 1.27 26.035",
            "1.016: 7.62 11.43"
        ]
    );
    let notes = drawing("eagle_m72.drl").notes;
    assert!(
        notes.iter().any(|note| note.contains("line 8 shows")),
        "{notes:?}"
    );
}

#[test]
fn eagle_with_a_picture_of_its_digits() {
    assert_eq!(
        shown("eagle_xnc.drl"),
        ["3.2: 3.5 3.5", "0.35: 15.24 22.86", "0.35: 7.62 -1.27"]
    );
}

#[test]
fn altium_digits_in_a_comment_and_lines_of_one_coordinate() {
    assert_eq!(
        shown("altium_inch_lz.drl"),
        [
            "0.700024: 31.242 11.557",
            "0.700024: 31.242 11.684",
            "0.700024: 25.019 11.684",
            "0.999998: 34.04997 30.988",
            "3.199892: 3.175 3.175",
        ]
    );
    assert_eq!(
        shown("altium_mm_lz.drl"),
        ["0.7: 31.242 11.5", "0.7: 25.16 -0.254"]
    );
}

#[test]
fn flatcam_writes_lz_and_decimals() {
    assert_eq!(
        shown("flatcam.drl"),
        [
            "0.8: 10.16 7.62",
            "0.8: 12.7 7.62",
            "1.1: 40.64 3.81",
            "1.1: 20.32 10.16 to 22.86 10.16"
        ]
    );
}

#[test]
fn a_file_without_header_counts_inches_and_has_its_diameters_elsewhere() {
    assert_eq!(
        shown("headerless_rack.drl"),
        [
            "?: 1548.384 574.1924",
            "?: 1264.5136 367.7412",
            "?: 1264.5136 174.1932",
            "?: 1270.9652 174.1932"
        ]
    );
}

#[test]
fn a_repeat_is_as_many_holes() {
    let holes = shown("repeats.drl");
    assert_eq!(holes.len(), 17);
    assert_eq!(holes[6..8], ["0.8: 17.78 5.08", "0.8: 17.78 12.7"]);
    assert_eq!(
        holes[13..],
        ["0.8: 2.54 12.7", "1: 50 50", "1: 51 49", "1: 52 48"]
    );
}

#[test]
fn increments_add_up() {
    assert_eq!(
        shown("incremental.drl"),
        [
            "0.8636: 7.62 7.62",
            "0.8636: 10.16 7.62",
            "0.8636: 12.7 6.35",
            "0.8636: 7.62 15.24",
            "0.8636: 7.62 12.7",
        ]
    );
}

#[test]
fn routed_arcs_by_radius_and_by_centre() {
    assert_eq!(
        shown("arcs.drl"),
        [
            "2: 10 10 cut 20 10 right 25 5 left 30 0",
            "2: 50 50",
            "2: 1 1"
        ]
    );
}

#[test]
fn a_unit_may_change_within_the_file() {
    assert_eq!(
        shown("two_units.drl"),
        ["0.9: 1.5 2.5", "0.89916: 2.54 5.08", "0.89916: 25.4 0"]
    );
}

#[test]
fn a_header_without_end_numbered_lines_and_small_letters() {
    assert_eq!(
        shown("no_header_end.drl"),
        ["0.8001: 25.4 50.8", "0.8001: 76.2 50.8"]
    );
    let drawing = drawing("no_header_end.drl");
    let tool = drawing.tools[&1];
    assert_eq!(
        (tool.feed.unwrap().to_string(), tool.speed),
        ("5080".to_owned(), Some(65_000))
    );
}

/// Line, column and a part of the message of each fault.
fn faults(text: &str) -> Vec<(u32, u32, String)> {
    let faults = read(text, &Known::default()).expect_err("has no fault").0;
    faults
        .into_iter()
        .map(|fault| (fault.line, fault.column, fault.message))
        .collect()
}

#[test]
fn what_is_not_understood_is_named_with_its_place() {
    let body = |line: &str| format!("M48\nMETRIC,TZ\nT1C0.8\n%\nT1\nX1000Y1000\n{line}\nM30\n");
    for (line, column, part) in [
        ("G82X1000Y1000", 1, "G82: not understood"),
        ("X1000Y10.0.0", 6, "expected a number"),
        ("X1000Z5", 6, "Z5: not understood here"),
        ("X1000X2000", 6, "stands twice"),
        ("X1000Y1000G85", 11, "needs its other end"),
        ("X1000 Y1000 ?", 13, "not understood"),
        ("T7", 1, "T7: is not defined"),
        ("T1C0.9", 1, "a second time"),
        ("T2C0", 3, "needs a point"),
        ("R5", 1, "needs its step"),
        ("R5X99999999", 3, "has 8 digits"),
        ("R999999X1", 1, "more than 100000"),
        ("G01X1000", 1, "before G00"),
        ("M15", 1, "not above a path"),
        ("M25", 1, "patterns"),
        ("G92X1000Y0", 1, "another zero"),
        ("FMAT,1", 6, "is not understood"),
        ("METRIC,XZ", 8, "expected LZ, TZ"),
        ("/X1000", 1, "not understood"),
        ("TOOL", 1, "not understood"),
        ("X1234567", 1, "has 7 digits where 3.3 has room for 6"),
        ("G42", 1, "width"),
    ] {
        let found = faults(&body(line));
        assert_eq!(found.len(), 1, "{line}: {found:?}");
        let (at, from, message) = &found[0];
        assert_eq!((*at, *from), (7, column), "{line}: {message}");
        assert!(message.contains(part), "{line}: {message}");
    }
}

#[test]
fn commands_of_a_header_do_not_contradict_each_other() {
    let file = |head: &str| format!("M48\n{head}\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n");
    for (head, column, part) in [
        (
            "INCH\nMETRIC",
            1,
            "mm contradicts line 2, which says inch; --units",
        ),
        ("METRIC,TZ\nT2C1.0\nM72", 1, "inch contradicts line 2"),
        ("M71\n\nINCH", 1, "inch contradicts line 2"),
        (
            "METRIC,LZ\nMETRIC,TZ",
            8,
            "TZ contradicts line 2, which says LZ; --zeros",
        ),
        ("METRIC\nMETRIC,LZ,TZ", 8, "TZ contradicts line 3"),
        (
            "METRIC,00.00\nMETRIC,000.000",
            8,
            "3.3 contradicts line 2, which says 2.2; --format",
        ),
    ] {
        let found = faults(&file(head));
        let line = head.lines().count() as u32 + 1;
        assert_eq!(found.len(), 1, "{head}: {found:?}");
        assert_eq!((found[0].0, found[0].1), (line, column), "{head}");
        assert!(found[0].2.contains(part), "{head}: {found:?}");
    }
    for head in ["METRIC\nMETRIC,TZ\nM71", "; FORMAT={3:3/ metric}\nMETRIC"] {
        let drawing = read(&file(head), &Known::default()).unwrap();
        assert_eq!(drawing.notes, [""; 0], "{head}");
    }
    // The user decides.
    let known = Known {
        units: Some(Units::Mm),
        ..Known::default()
    };
    assert_eq!(read(&file("INCH\nMETRIC"), &known).unwrap().notes, [""; 0]);
}

#[test]
fn a_command_counts_more_than_a_comment_and_that_is_said() {
    let inch = "; FORMAT={2:4/ absolute / inch / suppress leading zeros}";
    for (head, numbers) in [
        (format!("{inch}\nMETRIC,TZ"), [2, 3]),
        (format!("METRIC,TZ\n{inch}"), [3, 2]),
    ] {
        let text = format!("M48\n{head}\nT1C0.8\n%\nT1\nX1000Y2000\nM30\n");
        let drawing = read(&text, &Known::default()).unwrap();
        let hole = Point {
            x: "1".parse().unwrap(),
            y: "2".parse().unwrap(),
        };
        assert_eq!(drawing.hits[0].shape, Shape::Hole(hole), "{head}");
        let [comment, command] = numbers;
        let note = format!(
            "the comment in line {comment} says inch, and the command in line {command} says mm: \
             the command counts"
        );
        assert_eq!(drawing.notes[0], note);
    }
    let zeros = ";FILE_FORMAT=2:5\nINCH,LZ,00.0000\nT1C.03\n%\nT1\nX010000Y020000\nM30\n";
    let drawing = read(zeros, &Known::default()).unwrap();
    assert!(
        drawing.notes[0].contains("line 1 says 2.5"),
        "{:?}",
        drawing.notes
    );
}

#[test]
fn numbers_that_could_be_two_are_refused_each() {
    // There are zeros on both sides, and one number is too short for its format: nobody can know
    // the meaning.
    let text = "M48\nINCH\nT1C0.03\n%\nT1\nX004000Y022000\nX4Y022000\nX5Y5\nM30\n";
    let found = faults(text);
    let lines: Vec<u32> = found.iter().map(|fault| fault.0).collect();
    assert_eq!(lines, [7, 8]);
    assert!(found[0].2.contains("--zeros"), "{found:?}");
}

#[test]
fn a_file_that_ends_too_early_or_too_late_is_refused() {
    assert!(faults("M48\nINCH\nT1C.03\n%\nT1\nX1.0Y1.0\n")[0]
        .2
        .contains("is it whole"));
    let late = faults("M48\nINCH\nT1C.03\n%\nT1\nM30\nX1.0Y1.0\n");
    assert_eq!((late[0].0, late[0].1), (7, 1));
    let routed = faults("M48\nINCH\nT1C.03\n%\nT1\nG00X1.0Y1.0\nM15\nG01X2.0\nT1\nM30\n");
    assert!(routed[0].2.contains("M16 has to lift it"), "{routed:?}");
}

#[test]
fn an_arc_that_cannot_exist_is_refused() {
    let path = |arc: &str| {
        format!("M48\nMETRIC\nT1C2.0\n%\nT1\nG00X0.0Y0.0\nM15\n{arc}\nG01X9.0\nM16\nM30\n")
    };
    for (arc, column, part) in [
        ("G02X10.0Y0.0A4.9", 13, "two radii"),
        ("G02X10.0Y0.0A0.0", 13, "more than 0"),
        ("G03X0.0Y0.0A5.0", 12, "whole circle"),
        ("G03X10.0Y0.0I4.0J0.0", 13, "as far from"),
    ] {
        let found = faults(&path(arc));
        assert_eq!(found.len(), 1, "{arc}: {found:?}");
        assert_eq!((found[0].0, found[0].1), (8, column), "{arc}: {found:?}");
        assert!(found[0].2.contains(part), "{arc}: {found:?}");
    }
}

#[test]
fn holes_without_a_tool_or_a_unit_are_refused() {
    assert!(faults("%\nX010000Y010000\nM30\n")[0].2.contains("no tool"));
    assert!(faults("M48\nT1C0.8\n%\nM30\n")[0].2.contains("--units"));
    assert!(faults("M48\nINCH\nT1C.03\n%\nT1\nT0\nX1.0Y1.0\nM30\n")[0]
        .2
        .contains("no tool"));
}

#[test]
fn altium_lifts_twice_at_the_end_of_its_slots() {
    let text =
        "M48\nMETRIC,LZ\n;FILE_FORMAT=4:4\nT1C1.2\n%\nT1\nG00X002Y001\nM15\nG01X0022\nM16\nM17\n\
                G00X003Y001\nM15\nG01X0032\nM17\nG05\nM30\n";
    let drawing = read(text, &Known::default()).unwrap();
    let shapes: Vec<String> = drawing.hits.iter().map(|hit| shape(&hit.shape)).collect();
    assert_eq!(shapes, ["20 10 cut 22 10", "30 10 cut 32 10"]);
}

#[test]
fn a_tool_without_diameter_and_holes_is_left_out_and_its_hole_is_an_error() {
    let text = "M48\nMETRIC\nT1C0.000\nT2C0.8\n%\nT1\nT2\nX1.0Y2.0\nM30\n";
    let drawing = read(text, &Known::default()).unwrap();
    assert_eq!(drawing.hits.len(), 1);
    assert!(drawing
        .notes
        .iter()
        .any(|note| note.starts_with("T1 has a diameter of 0")));
    let hole = text.replace("T1\n", "T1\nX5.0Y5.0\n");
    let faults = read(&hole, &Known::default()).unwrap_err().0;
    assert_eq!((faults.len(), faults[0].line), (1, 7));
    assert!(faults[0].message.contains("T1C0.8"), "{faults:?}");
    assert!(read(&text.replace("C0.000", "C-0.1"), &Known::default()).is_err());
}

#[test]
fn mentor_names_its_unit_below_its_tools() {
    let text = "M48\nT01C.9\nT02C1.1\nR,H\n/\n%\nG90\nM71\nG93X000000Y000000\nG05\nT01\nX12500Y6200\nY3700\nT02\nX10000Y20000\nT00\nM30\n";
    assert_eq!(
        shapes(&read(text, &Known::default()).unwrap()),
        ["0.9: 12.5 6.2", "0.9: 12.5 3.7", "1.1: 10 20"]
    );
    let inch = text.replace("M71", "M72");
    let found = read(&inch, &Known::default()).unwrap();
    assert_eq!(shapes(&found)[2], "27.94: 25.4 50.8");
    assert!(
        found.notes[0].contains("as inch, which line 8"),
        "{found:?}"
    );
    // Two units above the first hole: nobody can know which one the tools have.
    let two = text.replace("M71\n", "M71\nM72\n");
    assert!(faults(&two)[0].2.contains("--units"));
}

#[test]
fn allegro_has_its_diameters_in_comments() {
    let text = ";LEADER: 12\n\
        ;T01 Holesize 1. = 12.000000 Tolerance = +0.000000/-0.000000 PLATED MILS Quantity = 2\n\
        ;T02 Holesize 2. = 1.016000 Tolerance = +0.000000/-0.000000 PLATED MM Quantity = 1\n\
        %\nG90\nT01\nX004450Y000210\nR01X-000300\nT02\nX015250Y003500\nM30\n";
    let found = read(text, &Known::default()).unwrap();
    assert_eq!(
        shapes(&found),
        [
            "0.3048: 11.303 0.5334",
            "0.3048: 10.541 0.5334",
            "1.016: 38.735 8.89"
        ]
    );
    let note = "T1: 0.3048 mm, as the comment in line 2 says";
    assert!(found.notes.iter().any(|one| one == note), "{found:?}");
    // A diameter of the header counts more, and a comment without one says nothing.
    let told = text.replace("%\n", "%\nT01C0.02\nT02C0.04\n");
    assert_eq!(
        shapes(&read(&told, &Known::default()).unwrap())[0],
        "0.508: 11.303 0.5334"
    );
    let none = text
        .replace("Holesize 1. =", "Holesize 1.")
        .replace(" 1.016000", " 0.000000");
    assert_eq!(
        shapes(&read(&none, &Known::default()).unwrap())[0],
        "?: 11.303 0.5334"
    );
}

#[test]
fn a_tool_that_is_up_is_lifted_once_more_and_nothing_happens() {
    let text = "%\nG90\nF1\nM16\nT01\nM16\nG00X029100Y011200\nG40\nM15\nG01X029100Y013600\nM16\nG40\nM30\n";
    assert_eq!(
        shapes(&read(text, &Known::default()).unwrap()),
        ["?: 73.914 28.448 cut 73.914 34.544"]
    );
}
