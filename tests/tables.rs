//! The machine's description of itself: settings, groups, errors, alarms; and the documents made
//! from the same tables.
//!
//! After a change that is meant, `BLESS=1 cargo test -p leadscrew-tests tables` writes the
//! documents anew.

use leadscrew_machine::extension::{Extension, OwnCode};
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::settings::group::Group;
use leadscrew_machine::settings::table::{AxisSetting, Kind, Row, Setting};
use leadscrew_planner::Cartesian;
use leadscrew_sim::own::{extension, Own, OwnPins};
use leadscrew_sim::profile::Profile;
use leadscrew_sim::Memory;
use leadscrew_tests::{setup, Session};
use std::fs;
use std::path::{Path, PathBuf};

/// A machine with every extension.
const EVERYTHING: &str = "
[options]
expressions = true
[heaters.nozzle]
sensor = \"ad595\"
[outputs]
count = 8
[tool_change]
[tool_switches]
lower = 0
upper = 10
rate_mm_min = 100
most_mm = 20
";

/// All extensions, as the simulator composes them.
fn extensions() -> Own<3> {
    let profile = Profile::parse(Path::new("all.toml"), EVERYTHING).unwrap();
    extension(&profile, profile.outputs.config(), None, OwnPins::default())
}

/// Number, text and explanation of each code, by rising number.
type Codes = Vec<(u8, &'static str, &'static str)>;

fn with_own(mut codes: Codes, own: impl Iterator<Item = &'static OwnCode>) -> Codes {
    codes.extend(own.map(|code| (code.number, code.text, code.explanation)));
    codes.sort_by_key(|code| code.0);
    codes
}

/// The errors of the machine and of its extensions.
fn errors() -> Codes {
    let errors = Status::ALL.iter();
    let errors = errors.map(|code| (code.number(), code.text(), code.explanation()));
    with_own(errors.collect(), extensions().errors())
}

/// The alarms of the machine and of its extensions.
fn alarms() -> Codes {
    let alarms = Alarm::ALL.iter();
    let alarms = alarms.map(|code| (code.number(), code.text(), code.explanation()));
    with_own(alarms.collect(), extensions().alarms())
}

/// All rows of the table, by rising number.
fn rows() -> Vec<Row> {
    let machine = Setting::ALL.iter().map(|setting| setting.row());
    let axes = AxisSetting::ALL.iter().map(|setting| setting.row());
    let mut rows: Vec<Row> = machine.chain(axes).collect();
    rows.sort_by_key(|row| row.number);
    rows
}

fn is_axis(row: &Row) -> bool {
    row.group == Group::Axes
}

fn values(kind: Kind) -> String {
    match kind {
        Kind::Switch => "0 or 1".to_string(),
        Kind::AxisMask => "0 to 255, one bit an axis".to_string(),
        Kind::Bits(names) => {
            let names = names.split(',').enumerate();
            let bits: Vec<String> = names
                .map(|(bit, name)| format!("{} {}", 1 << bit, name.to_lowercase()))
                .collect();
            format!("sum of: {}", bits.join(", "))
        }
        Kind::Whole { max } => format!("whole, 0 to {max}"),
        Kind::Decimal { zero: true, .. } => "0 or more".to_string(),
        Kind::Decimal { zero: false, .. } => "more than 0".to_string(),
        Kind::Signed { most } => format!("-{most} to {most}"),
    }
}

fn default(row: &Row) -> String {
    (row.default.nanos() as f64 / 1e9).to_string()
}

fn settings_page() -> String {
    let mut page = String::from(SETTINGS_HEAD);
    for group in Group::ALL {
        page.push_str(&format!("\n## {}\n\n", group.name()));
        for row in rows().iter().filter(|row| row.group == group) {
            let number = row.number;
            let numbers = match is_axis(row) {
                true => format!("`${number}` X, `${}` Y, `${}` Z", number + 1, number + 2),
                false => format!("`${number}`"),
            };
            page.push_str(&line(&numbers, row.name, row));
        }
    }
    page.push_str(OWN_HEAD);
    let own: Vec<Row> = extensions().settings().copied().collect();
    for alike in own.chunk_by(|one, next| one.description == next.description) {
        let [first, .., last] = alike else {
            let row = &alike[0];
            page.push_str(&line(&format!("`${}`", row.number), row.name, row));
            continue;
        };
        let numbers = format!("`${}` to `${}`", first.number, last.number);
        let names = format!("{} to {}", first.name, last.name);
        page.push_str(&line(&numbers, &names, first));
    }
    page
}

/// The entry of a setting in a list.
fn line(numbers: &str, name: &str, row: &Row) -> String {
    let Row {
        unit, description, ..
    } = row;
    let (values, default) = (values(row.kind), default(row));
    let blank = if unit.is_empty() { "" } else { " " };
    wrapped(&format!(
        "* {numbers} **{name}**, {default}{blank}{unit} ({values}): {description}"
    ))
}

/// An entry of a list, in lines of 100 characters at most.
fn wrapped(entry: &str) -> String {
    let (mut text, mut length) = (String::new(), 0);
    for word in entry.split(' ') {
        let wanted = word.chars().count() + 1;
        if length + wanted > 101 {
            text.push_str("\n  ");
            length = 2;
        } else if length > 0 {
            text.push(' ');
        }
        text.push_str(word);
        length += wanted;
    }
    text + "\n"
}

const SETTINGS_HEAD: &str = "# Settings

For whoever sets a machine up. The page is made of `crates/settings/src/table.rs` by `BLESS=1 cargo
test -p leadscrew-tests tables`. An entry has the number, the name, the value in a new machine with
its unit, the range, and what the setting does.

* `$$`: Grbl's 34 settings, as Grbl lists them
* `$+`: all settings, also those from `$700` on, which are our own
* `$703`: one setting of our own; `$5` and the like stay `error:3`, as in Grbl
* `$703=120`: changes a setting: `ok` once it is stored
* `$ES`, `$EG`: settings and groups, as grblHAL's senders read them; `$SED=703`: one setting described
* `$EE`, `$EA`: what each number of an error or an alarm means
* `$RST=$`: all settings as in a new machine

A machine file or a board may bring values of its own for a new machine. In motion these lines are
`error:8`, as `$$` is in Grbl. Whole numbers lose their fraction. [csv/](csv) has errors, alarms and
settings for Universal Gcode Sender.
";

const OWN_HEAD: &str = "
## Tool change

A machine has these if its file has [`[tool_change]`](machine-file.md).

";

fn quoted(fields: &[&str]) -> String {
    let fields: Vec<String> = fields
        .iter()
        .map(|field| format!("\"{}\"", field.replace('"', "\"\"")))
        .collect();
    fields.join(",") + "\n"
}

fn code_csv(kind: &str, codes: &[(u8, &str, &str)]) -> String {
    let mut csv = quoted(&[
        &format!("{kind} Code in v1.1+"),
        &format!(" {kind} Message in v1.0-"),
        &format!(" {kind} Description"),
    ]);
    for (number, text, explanation) in codes {
        let words = format!("{text}. {explanation}").replace('`', "");
        csv.push_str(&quoted(&[&number.to_string(), text, &words]));
    }
    csv
}

fn settings_csv() -> String {
    let mut csv = quoted(&["$-Code", " Setting", " Units", " Setting Description"]);
    for row in rows() {
        let axes = if is_axis(&row) { "XYZ" } else { " " };
        for (number, letter) in (row.number..).zip(axes.chars()) {
            let name = format!("{letter}-axis {}", row.name);
            let name = if is_axis(&row) { &name } else { row.name };
            csv.push_str(&quoted(&[
                &number.to_string(),
                name,
                row.unit,
                row.description,
            ]));
        }
    }
    for row in extensions().settings() {
        let number = row.number.to_string();
        csv.push_str(&quoted(&[&number, row.name, row.unit, row.description]));
    }
    csv
}

fn documents() -> [(PathBuf, String); 4] {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    [
        (docs.join("settings.md"), settings_page()),
        (docs.join("csv/setting_codes_en_US.csv"), settings_csv()),
        (
            docs.join("csv/error_codes_en_US.csv"),
            code_csv("Error", &errors()),
        ),
        (
            docs.join("csv/alarm_codes_en_US.csv"),
            code_csv("Alarm", &alarms()),
        ),
    ]
}

#[test]
fn the_documents_say_what_the_tables_say() {
    for (path, text) in documents() {
        if std::env::var_os("BLESS").is_some() {
            fs::write(&path, &text).unwrap();
        }
        let there = fs::read_to_string(&path).unwrap_or_default();
        assert!(there == text, "{} is out of date", path.display());
    }
}

/// The words of heaters, tool change and tool switches are in the documents too.
#[test]
fn the_documents_have_what_extensions_add() {
    let [settings, setting_codes, error_codes, alarm_codes] = documents().map(|(_, text)| text);
    let own = extensions();
    for number in own.settings().map(|row| row.number) {
        assert!(setting_codes.contains(&format!("\n\"{number}\",")));
    }
    for number in [860, 861, 862, 881] {
        assert!(settings.contains(&format!("\n* `${number}` ")), "${number}");
    }
    for number in [220, 221, 222] {
        assert!(
            error_codes.contains(&format!("\n\"{number}\",")),
            "{number}"
        );
    }
    for number in [220, 221, 222, 223, 224, 225, 230] {
        assert!(
            alarm_codes.contains(&format!("\n\"{number}\",")),
            "{number}"
        );
    }
}

/// Grbl has errors 1 to 38 and alarms 1 to 10. grblHAL's wiki lists errors below 100 and alarms
/// below 30. We use only 52 of its additional numbers, with its meaning: a value out of range.
#[test]
fn our_own_errors_and_alarms_have_numbers_of_their_own() {
    let errors = Status::ALL.iter().map(|code| code.number());
    assert!(errors
        .clone()
        .all(|number| number <= 38 || number == 52 || number >= 200));
    assert!(Alarm::ALL
        .iter()
        .all(|code| code.number() <= 10 || code.number() >= 200));
}

fn ask(lines: &[&str]) -> Vec<String> {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session: Session<'_, Cartesian, 3> = Session::new(&mut memory, &setup, Cartesian);
    session.heard(0);
    lines.iter().flat_map(|line| session.say(line)).collect()
}

#[test]
fn a_setting_of_our_own_can_be_read_back() {
    assert_eq!(
        ask(&["$703=137\n", "$703\n", "$710\n", "$5\n", "$799\n"]),
        [
            "ok",
            "$703=137",
            "ok",
            "$710=1.000",
            "ok",
            "error:3",
            "error:3"
        ]
    );
}

#[test]
fn all_settings_come_back_as_lines_that_set_them() {
    let all = ask(&["$702=-0.25\n", "$+\n"]);
    let grbl = ask(&["$$\n"]);
    let (last, listed) = all[1..].split_last().unwrap();
    assert_eq!(last, "ok");
    assert!(grbl.iter().all(|line| all.contains(line)));
    assert!(listed.contains(&"$702=-0.250".to_string()));
    assert_eq!(
        listed.len(),
        Setting::ALL.len() + 3 * AxisSetting::ALL.len()
    );
    for line in listed {
        assert_eq!(ask(&[&format!("{line}\n")]), ["ok"], "{line}");
    }
}

/// The fields of a line as a sender for grblHAL reads them, separated by the colon and the bars.
fn fields<'a>(line: &'a str, kind: &str) -> Vec<&'a str> {
    let text = line
        .strip_prefix('[')
        .and_then(|line| line.strip_suffix(']'));
    let (name, rest) = text.and_then(|text| text.split_once(':')).expect(line);
    assert_eq!(name, kind);
    rest.split('|').collect()
}

#[test]
fn a_sender_of_grblhal_finds_names_groups_and_ranges() {
    let settings = ask(&["$ES\n"]);
    let groups = ask(&["$EG\n"]);
    let ids: Vec<&str> = groups[..groups.len() - 1]
        .iter()
        .map(|line| fields(line, "SETTINGGROUP")[0])
        .collect();
    let (last, settings) = settings.split_last().unwrap();
    assert_eq!(last, "ok");
    for line in settings {
        let fields = fields(line, "SETTING");
        assert_eq!(fields.len(), 10, "{line}");
        assert!(ids.contains(&fields[1]), "{line}");
        let described = ask(&[&format!("$SED={}\n", fields[0])]);
        assert!(described[0].starts_with(&format!("[SETTINGDESCR:{}|", fields[0])));
    }
    let lead = settings
        .iter()
        .find(|line| line.starts_with("[SETTING:703|"));
    let lead = fields(lead.unwrap(), "SETTING");
    assert_eq!(lead[2..8], ["Laser lead", "us", "5", "####0", "0", "1000"]);
}

/// A setting accepts exactly the range that the machine states.
#[test]
fn a_whole_setting_takes_its_least_and_its_most_and_no_more() {
    for line in ask(&["$ES\n"]).iter().filter(|line| line.starts_with('[')) {
        let fields = fields(line, "SETTING");
        if fields[4] != "5" {
            continue;
        }
        let (number, least, most) = (fields[0], fields[6], fields[7].parse::<u32>().unwrap());
        assert_eq!(ask(&[&format!("${number}={least}\n")]), ["ok"], "{line}");
        assert_eq!(ask(&[&format!("${number}={most}\n")]), ["ok"], "{line}");
        let beyond = ask(&[&format!("${number}={}\n", most + 1)]);
        assert_eq!(beyond, ["error:52"], "{line}");
    }
}

#[test]
fn errors_and_alarms_are_told_in_words() {
    let errors = ask(&["$EE\n"]);
    assert_eq!(errors.len(), Status::ALL.len() + 1);
    assert!(errors.contains(&"[ERRORCODE:22||The feed rate is not set]".to_string()));
    let alarms = ask(&["$EA\n"]);
    assert_eq!(alarms.len(), Alarm::ALL.len() + 1);
    assert_eq!(alarms[0], "[ALARMCODE:1||A limit switch was hit]");
}

#[test]
fn in_motion_nothing_is_listed() {
    let lines = ["$700=1\n", "$+\n", "$ES\n", "$SED=1\n", "$703\n"];
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session: Session<'_, Cartesian, 3> = Session::new(&mut memory, &setup, Cartesian);
    session.send(0, "G1X100F100\n");
    session.wait_us(500_000);
    session.heard(0);
    for line in lines {
        session.send(0, line);
        session.wait_us(100_000);
        assert_eq!(session.heard(0), ["error:8"], "{line}");
    }
}
