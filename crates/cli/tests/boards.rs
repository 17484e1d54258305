//! Tests of `leadscrew board` with boards that are right, wrong and unknown.
use std::fs;
use std::process::{Command, Output};

fn board(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
    command.arg("board").args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn every_board_that_is_listed_is_right() {
    let listed = text(&board(&["list"]).stdout);
    assert!(listed.lines().count() >= 7, "{listed}");
    for line in listed.lines() {
        let name = line.split(' ').next().unwrap();
        let checked = board(&["check", name]);
        assert!(checked.status.success());
        assert_eq!(text(&checked.stdout), format!("{name}: right\n"));
    }
}

#[test]
fn a_file_that_was_begun_and_broken_is_told_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    let file = path.to_str().unwrap();
    assert!(board(&["new", "--like", "skr-2", "-o", file])
        .status
        .success());
    let again = board(&["new", "-o", file]);
    assert_eq!(again.status.code(), Some(2), "it is there already");
    // The laser is on a channel that its pin does not have, and two switches share an interrupt
    // line.
    let right = fs::read_to_string(&path).unwrap();
    let wrong = right.replace("channel = 1", "channel = 3");
    let wrong = wrong.replace(r#"probe = { pin = "PE4" }"#, r#"probe = { pin = "PE3" }"#);
    fs::write(&path, wrong).unwrap();
    let checked = board(&["check", file]);
    assert_eq!(checked.status.code(), Some(1));
    let said = text(&checked.stdout);
    for expected in [
        "PE5 cannot be channel 3 of TIM9",
        "line 3 of EXTI",
        "PE4: in `at`",
    ] {
        assert!(said.contains(expected), "{expected}: {said}");
    }
}

#[test]
fn a_dash_is_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let here = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
        command.current_dir(folder.path()).args(arguments);
        command.output().unwrap()
    };
    let file = text(&here(&["machine", "new", "-o", "-"]).stdout);
    assert_eq!(file, text(&here(&["machine", "new"]).stdout));
    let file = text(&here(&["board", "new", "-o", "-"]).stdout);
    assert_eq!(file, text(&here(&["board", "new"]).stdout));
    let packed = here(&["board", "pack", "discovery", "-o", "-"]);
    assert!(packed.status.success());
    let record = leadscrew_record::Record::read(&packed.stdout);
    assert!(record.is_ok(), "{}", text(&packed.stdout));
    assert!(text(&packed.stderr).contains("-: a record of"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn pins_are_listed_with_their_places() {
    let said = text(&board(&["pins", "fly-407zg"]).stdout);
    assert!(
        said.contains("PB9   step of motor 1                  socket 0, step"),
        "{said}"
    );
}

#[test]
fn what_is_no_board_is_unusable() {
    for arguments in [["check", "nowhere.toml"], ["pins", "Cargo.toml"]] {
        let output = board(&arguments);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(arguments[1]));
    }
}

#[test]
fn a_machine_s_pins_are_those_of_its_board() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    let pins = |machine: &str, more: &[&str]| {
        fs::write(&path, machine).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
        command.args(["machine", "pins"]).arg(&path).args(more);
        command.output().unwrap()
    };
    let swapped = "board = \"skr-2\"\n[axes.x]\nsocket = \"y\"\n[axes.y]\nsocket = \"x\"\n";
    let said = text(&pins(swapped, &[]).stdout);
    assert!(
        said.starts_with("motor 1 X, motor 2 Y, motor 3 Z\nBIGTREETECH"),
        "{said}"
    );
    // The step pin of the SKR 2's Y socket.
    assert!(said.contains("PD5   step of motor 1"), "{said}");
    let own = text(&board(&["new"]).stdout);
    fs::write(folder.path().join("own.toml"), own).unwrap();
    let beside = "board = \"own.toml\"\n[fan]\nfitted = true\n";
    assert!(text(&pins(beside, &[]).stdout).contains("PB7   fan"));
    let lacks = pins(beside, &["--board", "skr-2"]);
    assert_eq!(lacks.status.code(), Some(2));
    assert!(text(&lacks.stderr).contains("no `sockets.fan`"));
    let nobody = pins("board = \"nosuch\"\n", &[]);
    assert!(text(&nobody.stderr).contains("nosuch: is no board of the firmware"));
    let shared = pins("[axes.x]\nsocket = \"y\"\n", &[]);
    assert!(
        text(&shared.stderr).contains("two motors of the machine are in the board's socket `y`")
    );
}

#[test]
fn a_record_has_the_machine_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (machine, output) = (path("machine.toml"), path("record.bin"));
    let pack = |board_name: &str, text: &str| {
        fs::write(&machine, text).unwrap();
        let _ = fs::remove_file(&output);
        board(&["pack", board_name, "--machine", &machine, "-o", &output])
    };
    let turning = "[homing]\non = true\norder = [\"z\", \"xy\"]\n[axes.x]\nsteps_per_mm = 12.5\n\
        [axes.a]\nrotary = true\nhome = \"zero\"\n";
    let packed = pack("skr-2", turning);
    let said = text(&packed.stdout);
    assert!(said.contains("`cargo fw --record --motors 4`"), "{said}");
    let record = fs::read(&output).unwrap();
    let (record, settings) = leadscrew_record::Record::read(&record).unwrap();
    let content = &record.content;
    assert_eq!((content.shape.axes, content.shape.motors), (4, 4));
    assert_eq!((content.rotary, content.without_switch), (0b1000, 0b1000));
    assert_eq!(content.homing, [0b1100, 0b0011, 0, 0]);
    // PD15 and PD14, the socket of the SKR 2's fourth motor, are safe from the start, too.
    let motor = &content.motors[3];
    assert_eq!(
        (motor.step.pin(), motor.direction.pin()),
        (Some((3, 15)), Some((3, 14)))
    );
    let d = content
        .safe
        .ports()
        .iter()
        .find(|port| port.port.get() == 3);
    assert_eq!(d.unwrap().pins.get() >> 14, 0b11);
    let scale = settings.iter().find(|setting| setting.number.get() == 100);
    assert_eq!(scale.unwrap().nanos.get(), 12_500_000_000);

    let ganged = pack("skr-2", "[second_motor]\naxis = \"y\"\nstart = 0\n");
    assert!(ganged.status.success(), "{}", text(&ganged.stderr));
    let record = fs::read(&output).unwrap();
    let content = &leadscrew_record::Record::read(&record).unwrap().0.content;
    assert_eq!((content.shape.axes, content.shape.kinematics), (3, 3));

    for (board_name, text_of_it, why) in [
        ("skr-2", "[axes.e]\n", "axes.e"),
        ("skr-2", "[axes.a]\n[axes.b]\n", "a fifth motor"),
        ("skr-2", "look_ahead = 15\n", "look_ahead"),
        ("skr-2", "[options]\nparking = true\n", "options"),
        (
            "skr-2",
            "[axes.x]\nstops = \"homing\"\n",
            "`stops` of an axis",
        ),
        ("machine-003", "[axes.a]\n", "the board drives 3"),
    ] {
        let refused = pack(board_name, text_of_it);
        assert_eq!(refused.status.code(), Some(2));
        let said = text(&refused.stderr);
        assert!(said.contains(why), "{why}: {said}");
    }
}

#[test]
fn a_record_is_packed_alone_or_into_an_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let [alone, image, whole] = ["alone.bin", "image.bin", "whole.bin"].map(path);
    let packed = board(&["pack", "skr-2", "-o", &alone]);
    let said = text(&packed.stdout);
    assert!(
        said.contains("192 bytes, to be flashed at 0x0800c000"),
        "{said}"
    );
    let record = fs::read(&alone).unwrap();
    assert!(record.starts_with(b"LSBR"));
    let lines = path("lines.txt");
    let sent = board(&["pack", "skr-2", "--lines", "-o", &lines]);
    assert!(text(&sent.stdout).contains("13 lines"));
    let mut incoming = leadscrew_record::Incoming::new();
    for line in fs::read_to_string(&lines).unwrap().lines() {
        match line.strip_prefix("$B=").unwrap() {
            "" => assert_eq!(incoming.bytes(), record),
            part => incoming.take(part.as_bytes()).unwrap(),
        }
    }
    // An image behind the SKR 2's bootloader; another one that has code in the record's place.
    let joins = |bytes: &[u8], output: &str| {
        fs::write(&image, bytes).unwrap();
        board(&["pack", "skr-2", "--into", &image, "-o", output])
    };
    let mut empty = vec![0x55; 0x4000];
    empty.resize(0x8000, 0xFF);
    empty.resize(0xA000, 0x55);
    let joined = joins(&empty, &whole);
    assert!(text(&joined.stdout).contains("at 0x08008000"));
    let bytes = fs::read(&whole).unwrap();
    assert_eq!(bytes.len(), empty.len());
    assert_eq!(bytes[0x4000..0x4000 + record.len()], record);
    assert_eq!(bytes[0x8000..], empty[0x8000..]);
    assert_eq!(bytes[..0x4000], empty[..0x4000]);
    let code = joins(&[0x55; 0xA000], &path("none.bin"));
    assert_eq!(code.status.code(), Some(2));
    assert!(text(&code.stderr).contains("no place for a record"));
}

#[test]
fn an_image_that_would_reach_the_settings_takes_no_record() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // Behind 32 KiB; the Octopus has its settings from 256 KiB on, the SKR 2 from 768 KiB on.
    let fits = |name: &str, length: usize| {
        let (image, whole) = (path("image.bin"), path(&format!("{name}-{length}.bin")));
        fs::write(&image, vec![0xFF; length]).unwrap();
        let packed = board(&["pack", name, "--into", &image, "-o", &whole]);
        let said = text(&packed.stderr);
        assert_eq!(fs::exists(whole).unwrap(), packed.status.success());
        assert!(
            packed.status.success() || said.contains("less flash"),
            "{said}"
        );
        packed.status.success()
    };
    for (name, room) in [("octopus", 224 << 10), ("skr-2", 736 << 10)] {
        assert!(fits(name, room), "{name}");
        assert!(!fits(name, room + 1), "{name}");
    }
}
