//! Programs and their plain lines; faults and their places.

mod common;

use common::{run, run_files, run_in, Files, Ran};
use leadscrew_program::{ErrorKind, Expected, Item, Math, Value, World};

/// The lines of a program that has no fault.
fn lines(text: &str) -> Vec<String> {
    let ran = run(text);
    assert_eq!(ran.error, None, "{text}");
    ran.lines
}

/// The value that an expression writes.
fn value(expression: &str) -> String {
    let lines = lines(&format!("X{expression}\n"));
    lines[0].strip_prefix('X').unwrap().to_owned()
}

/// Line, column from 1, and kind of a program's fault.
fn fault(text: &str) -> (u32, usize, ErrorKind) {
    let error = run(text).error.expect(text);
    (error.line, error.column + 1, error.kind)
}

#[test]
fn operators_bind_as_in_linuxcnc() {
    for (expression, result) in [
        ("[2+3*4]", "14"),
        ("[2**3**2]", "64"),
        ("[-2**2]", "4"),
        ("[10/4*2]", "5"),
        ("[2*3 MOD 4]", "2"),
        ("[-7 MOD 3]", "2"),
        ("[7 MOD -3]", "1"),
        ("[2+3*4 GT 13]", "1"),
        ("[1 LT 2 EQ 1]", "1"),
        ("[1 OR 0 AND 0]", "0"),
        ("[1 AND 0 OR 1]", "1"),
        ("[1 XOR 1]", "0"),
        ("[0.00001 AND 2]", "1"),
        ("[5 - -3]", "8"),
        ("[--3]", "3"),
        ("-[1+2]", "-3"),
        ("-SIN[30]", "-0.5"),
        ("[0**0]", "1"),
        ("[2**-1]", "0.5"),
        ("[1 EQ 1.00009]", "1"),
        ("[1 NE 1.0001]", "1"),
        ("[1.00005 GT 1]", "1"),
        ("[1 GE 1.00005]", "0"),
    ] {
        assert_eq!(value(expression), result, "{expression}");
    }
}

#[test]
fn functions_give_what_linuxcnc_gives() {
    for (expression, result) in [
        ("FIX[-2.8]", "-3"),
        ("FUP[-2.8]", "-2"),
        ("FUP[2.2]", "3"),
        ("ROUND[2.5]", "3"),
        ("ROUND[-2.5]", "-3"),
        ("ABS[-3]", "3"),
        ("ATAN[1]/[0]", "90"),
        ("ATAN[-1]/[-1]", "-135"),
        ("EXP[1]", "2.718282"),
        ("LN[10]", "2.302585"),
        ("SQRT[2]", "1.414214"),
        ("EXISTS[#<nothing>]", "0"),
        ("EXISTS[#7]", "1"),
    ] {
        assert_eq!(value(expression), result, "{expression}");
    }
}

#[test]
fn decimals_are_exact_and_fix_does_not_see_rounding() {
    assert_eq!(value("[0.1+0.2]"), "0.3");
    assert_eq!(value("FIX[0.3/0.1]"), "3", "a double finds 2");
    assert_eq!(value("FIX[10/3*3]"), "10");
    assert_eq!(value("[1/3*3000 GE 1000]"), "1");
    assert_eq!(value("0.123456789"), "0.123456789", "as it stands");
    assert_eq!(value("[0.123456789]"), "0.123457");
}

#[test]
fn an_assignment_counts_from_the_next_line_on() {
    let text = "#3=6\n#3=15 G1 X#3\nX#3\n#1=3\n#2=#3\nX##1 Y#[1+1]\n";
    assert_eq!(lines(text), ["G1 X6", "X15", "X15 Y15"]);
}

#[test]
fn blanks_comments_and_small_letters_mean_nothing() {
    let text = "#<_Tool Size> = 2 (mm)\ng 1 x [ #<_toolsize> * (twice) 1 0 ] ; far\n";
    assert_eq!(lines(text), ["G1 X20 ; far"]);
    assert_eq!(
        lines("G1 X1 (#1 [) Y2\n(only this)\n\n%\n"),
        ["G1 X1 (#1 [) Y2", "(only this)"]
    );
}

#[test]
fn a_word_that_is_a_plain_number_stays_as_it_stands() {
    assert_eq!(
        lines("#1=2\nN10 G01 X-01.50 Y#1 (to)\n"),
        ["N10 G01 X-01.50 Y2 (to)"]
    );
}

#[test]
fn loops_and_conditions_run_as_in_linuxcnc() {
    for (text, result) in [
        ("o1 while [#1 lt 3]\n#1=[#1+1]\nX#1\no1 endwhile\n", "X1 X2 X3"),
        ("o1 do\n#1=[#1+1]\nX#1\no1 while [#1 lt 2]\nY1\n", "X1 X2 Y1"),
        ("o1 repeat [2.5]\nX1\no1 endrepeat\nY1\n", "X1 X1 Y1"),
        ("o1 repeat [2.6]\nX1\no1 endrepeat\n", "X1 X1 X1"),
        ("o1 repeat [-1]\nX1\no1 endrepeat\nY1\n", "Y1"),
        ("o1 if [0]\nX1\no1 elseif [2]\nX2\no1 elseif [1]\nX3\no1 else\nX4\no1 endif\nY1\n", "X2 Y1"),
        ("o1 if [0]\nX1\no1 elseif [0]\nX2\no1 else\nX4\no1 endif\nY1\n", "X4 Y1"),
        ("o1 while [#1 lt 3]\n#1=[#1+1]\no2 if [#1 eq 2]\no1 continue\no2 endif\nX#1\no1 endwhile\n", "X1 X3"),
        ("o1 do\n#1=[#1+1]\no2 if [#1 eq 2]\no1 continue\no2 endif\nX#1\no1 while [#1 lt 4]\n", "X1 X3 X4"),
        ("o1 do\n#1=[#1+1]\no2 if [#1 eq 2]\no1 break\no2 endif\nX#1\no1 while [#1 lt 4]\nY1\n", "X1 Y1"),
        ("o1 repeat [4]\n#1=[#1+1]\no2 if [#1 eq 2]\no1 continue\no2 endif\nX#1\no1 endrepeat\n", "X1 X3 X4"),
        ("o1 repeat [2]\n#1=[#1+1]\no2 if [#1 eq 2]\no1 continue\no2 endif\nX#1\no1 endrepeat\nY1\n", "X1 Y1"),
        ("o1 while [1]\no2 while [1]\no1 break\no2 endwhile\no1 endwhile\nY1\n", "Y1"),
    ] {
        assert_eq!(lines(text).join(" "), result, "{text}");
    }
}

#[test]
fn a_subprogram_has_parameters_of_its_own_and_returns_a_value() {
    let text = "#1=7\n#<a>=1\no<hole> sub\n#<a>=#1\n#1=99\no<hole> endsub [#<a>*2]\n\
                o<hole> call [4] [5]\nX#<_value> Y#1 Z#<a>\no<none> sub\no<none> endsub\n\
                o<none> call\nX#<_value_returned>\n";
    assert_eq!(lines(text), ["X8 Y7 Z1", "X0"]);
}

#[test]
fn a_subprogram_may_stand_behind_its_call_and_call_itself() {
    let text = "o1 call [5]\nX#<_value>\nM2\no1 sub\no2 if [#1 LE 1]\no1 return [1]\no2 endif\n\
                o1 call [#1-1]\no1 endsub [#<_value>*#1]\n";
    assert_eq!(lines(text), ["X120", "M2"]);
    let endless = "o1 sub\no1 call\no1 endsub\no1 call\n";
    assert_eq!(fault(endless), (2, 1, ErrorKind::DeepCalls));
}

#[test]
fn a_call_by_number_and_one_by_fanuc_find_the_same() {
    let text = "O0001 (part)\n#1=5\nM98 P100 L2\nX#1\nG65 P100 A1 Z3\n#9=100\no#9 call [8]\nM30\n\
                O100\nX#1 Z#26\n#1=[#1+1]\nM99\n";
    assert_eq!(
        lines(text),
        ["X5 Z0", "X6 Z0", "X7", "X1 Z3", "X8 Z0", "M30"]
    );
}

#[test]
fn a_subprogram_of_another_file_is_found_and_its_faults_name_the_file() {
    let file = "o<edge> sub\nX#1\nY[1/0]\no<edge> endsub\n".to_owned();
    let main = "o<Edge> call [2]\n".to_owned();
    let ran = run_files(Files(vec![("", main), ("edge", file)]), &());
    let error = ran.error.unwrap();
    assert_eq!(ran.lines, ["X2"]);
    assert_eq!((error.text, error.line, error.column), (1, 3, 3));
}

#[test]
fn branches_are_told() {
    let text = "o1 if [1]\no2 if [0]\no2 elseif [1]\no2 endif\no1 endif\n";
    assert_eq!(run(text).branches, [(1, true), (2, false), (3, true)]);
}

/// Knows X, F and the last probe.
struct Mill;

impl World for Mill {
    fn read(&self, item: Item) -> Option<Value> {
        match item {
            Item::Position(0) => Some(Value::from_int(12)),
            Item::Feed => Some(Value::from_int(300)),
            Item::Probed(2) => Some(Value::from_int(-4)),
            Item::ProbeState => Some(Value::from_int(1)),
            Item::Metric => Some(Value::from_int(1)),
            Item::System => Some(Value::from_int(2)),
            _ => None,
        }
    }
}

#[test]
fn a_program_reads_its_machine_and_cannot_write_it() {
    let text =
        "X#<_x> Y#5420 F#<_feed>\nZ#5063 P#<_probe_state>\nX#<_imperial> Y#<_coord_system>\n";
    let ran = run_in(text, &Mill);
    assert_eq!(ran.lines, ["X12 Y12 F300", "Z-4 P1", "X0 Y550"]);
    let refused = |line: &str| run_in(line, &Mill).error.unwrap().kind;
    assert_eq!(refused("X#5421\n"), ErrorKind::UnknownHere);
    for line in [
        "#5420=1\n",
        "#5221=1\n",
        "#<_x>=1\n",
        "#5063=1\n",
        "#<_value>=1\n",
    ] {
        assert_eq!(refused(line), ErrorKind::ReadOnly, "{line}");
    }
}

#[test]
fn a_fault_names_its_line_its_column_and_what_was_expected() {
    use ErrorKind as K;
    let expected = |expected, found| K::Expected(expected, found);
    for (text, line, column, kind) in [
        ("G1\nX[1+]\n", 2, 5, expected(Expected::Value, Some(b']'))),
        ("X[1\n", 1, 4, expected(Expected::Operator, None)),
        (
            "X[1 LX 2]\n",
            1,
            5,
            expected(Expected::Operator, Some(b'L')),
        ),
        ("#1 X\n", 1, 4, expected(Expected::Equals, Some(b'X'))),
        ("X#<a\n", 1, 5, expected(Expected::Name, None)),
        ("X#1 =\n", 1, 5, expected(Expected::Word, Some(b'='))),
        ("X ATAN[1]\n", 1, 10, expected(Expected::Slash, None)),
        ("X[1/0]\n", 1, 4, K::Math(Math::ByZero)),
        ("X [SQRT[-1]]\n", 1, 4, K::Math(Math::NegativeRoot)),
        ("X[5 MOD 0]\n", 1, 5, K::Math(Math::ByZero)),
        ("X[WEG[1]]\n", 1, 3, K::UnknownFunction),
        ("X#<never>\n", 1, 2, K::UnknownName),
        ("X#1.5\n", 1, 3, K::NotWhole),
        ("X#0\n", 1, 2, K::NoParameter),
        ("#6000=1\n", 1, 1, K::NoParameter),
        ("X[1e1]\n", 1, 4, expected(Expected::Operator, Some(b'E'))),
        ("X[9999999999*9]\n", 1, 2, K::TooLarge),
        ("o1 iff [1]\n", 1, 4, K::UnknownKeyword),
        ("o if [1]\n", 1, 3, expected(Expected::Label, Some(b'I'))),
        ("o1 if [1] X2\n", 1, 11, expected(Expected::End, Some(b'X'))),
        ("o1 if\n", 1, 6, expected(Expected::Bracket, None)),
        ("X1\no1 endif\n", 2, 1, K::NotOpen),
        ("o1 if [1]\no2 endif\n", 2, 1, K::NotOpen),
        ("o1 break\n", 1, 1, K::NotOpen),
        ("o1 return\n", 1, 1, K::NotOpen),
        ("M99\n", 1, 1, K::NotOpen),
        ("X1\no1 if [0]\nX1\n", 2, 1, K::NotClosed),
        ("X1\no1 if [1]\nX1\n", 2, 1, K::NotClosed),
        (
            "o1 sub\no2 if [1]\no1 endsub\no1 call\n",
            3,
            1,
            K::NotClosed,
        ),
        ("o1 sub\nX1\n", 1, 1, K::NotClosed),
        ("X1\n o7 call\n", 2, 2, K::NoSubprogram),
        ("M98\n", 1, 1, expected(Expected::Number, None)),
        ("M98 P1 X2\n", 1, 8, K::OtherWords),
        ("M98 P1.5\n", 1, 5, K::NotWhole),
        ("o1 while [1]\no1 endwhile\n", 1, 1, K::Endless),
    ] {
        let (at, place, found) = fault(text);
        assert_eq!((at, place, found), (line, column, kind), "{text}");
    }
}

#[test]
fn messages_are_sentences_for_people() {
    let Ran { error, .. } = run("G1\nX[1+]\n");
    let told = "line 2, column 5: expected a number, a parameter, a function or `[`, found `]`";
    assert_eq!(error.unwrap().to_string(), told);
}

#[test]
fn bounds_are_told_and_not_passed() {
    use std::fmt::Write as _;
    let deep = |count: usize| format!("X{}1{}\n", "[".repeat(count), "]".repeat(count));
    assert_eq!(lines(&deep(31)), ["X1"]);
    assert_eq!(fault(&deep(32)).2, ErrorKind::DeepBrackets);
    let mut many = String::new();
    for number in 0..70 {
        writeln!(many, "#{}=1", 100 + number).unwrap();
    }
    assert_eq!(fault(&many), (65, 1, ErrorKind::ManyParameters));
    let mut names = String::new();
    for number in 0..40 {
        writeln!(names, "#<_a{number}>=1").unwrap();
    }
    assert_eq!(fault(&names), (33, 1, ErrorKind::ManyNames));
    let mut open = String::new();
    for number in 0..20 {
        writeln!(open, "o{number} if [1]").unwrap();
    }
    assert_eq!(fault(&open), (17, 1, ErrorKind::DeepLoops));
    let long = format!("X#<{}>\n", "a".repeat(33));
    assert_eq!(fault(&long).2, ErrorKind::LongName);
    let wide = format!("X#1 {}\n", "Y1".repeat(200));
    assert_eq!(fault(&wide).2, ErrorKind::LongLine);
    assert_eq!(lines(&format!("X#1 ({}) Y2\n", "b".repeat(300))), ["X0Y2"]);
}

#[test]
fn lines_of_programs_are_told_from_plain_ones() {
    use leadscrew_program::is_program;
    for line in [
        "#1=2",
        "G1 X#1",
        "X [1+2]",
        "o1 if [1]",
        "O0001 (PART)",
        "N5 o<a> sub",
        "M98 P1",
        "m098p2",
        "G65 P9 A1",
    ] {
        assert!(is_program(line.as_bytes()), "{line}");
    }
    for line in [
        "",
        "G1 X1 Y2 F300",
        "(tool #1 [flat])",
        "$#",
        "$N0=G54",
        "[ESP800]",
        "G4 P0.5",
        "; o1 if",
        "G10 L2 P1 X0",
        "%",
        "(OP 1) G0 X0",
    ] {
        assert!(!is_program(line.as_bytes()), "{line}");
    }
}
