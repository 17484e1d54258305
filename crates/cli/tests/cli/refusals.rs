//! Options, files and outputs that cannot be used: each is refused with one message.

use crate::program::{leadscrew, stderr, unusable, Folder, SQUARE};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the program; expects exit status 2 and a message about its options that contains `part`.
fn unusable_usage(args: &[&str], part: &str) {
    let output = leadscrew(args);
    assert_eq!(output.status.code(), Some(2), "{args:?}");
    assert!(stderr(&output).contains(part), "{}", stderr(&output));
}

#[test]
fn serve_says_what_is_wrong_with_its_options() {
    unusable_usage(&["serve"], "--pty <LINK>|--tcp <ADDRESS>|--ws <ADDRESS>");
    unusable_usage(&["serve", "--tcp", "99999"], "expected a port, 0 to 65535");
    let folder = Folder::new();
    let profile = folder.file("bad.toml", "[axes.x]\ntravel = -1\n");
    unusable(
        &["serve", "--tcp", "0", "--machine", &profile],
        &["bad.toml:2: axes.x.travel: expected a number above 0"],
    );
}

#[test]
fn unreadable_jobs_are_refused_with_one_message() {
    let folder = Folder::new();
    let file = |name: &str, content: &[u8]| folder.file(name, content);
    unusable(
        &["run", "no/such/file.nc"],
        &["no/such/file.nc", "cannot be read"],
    );
    unusable(&["run", &file("empty.nc", b"")], &["empty.nc", "is empty"]);
    unusable(
        &["check", &file("empty.nc", b"")],
        &["empty.nc", "is empty"],
    );
    unusable(&["run", env!("CARGO_BIN_EXE_leadscrew")], &["is not text"]);
    unusable(
        &["profile", folder.path("").to_str().unwrap()],
        &["is a directory"],
    );
}

#[test]
fn a_job_is_never_written_over() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let same = folder.path("./job.nc").to_str().unwrap().to_owned();
    for [command, output] in [
        ["run", "--svg"],
        ["run", "--html"],
        ["run", "--vcd"],
        ["run", "--steps"],
        ["check", "--svg"],
        ["profile", "--svg"],
        ["profile", "--csv"],
    ] {
        unusable(&[command, &job, output, &same], &["job.nc", "another name"]);
        assert_eq!(fs::read_to_string(&job).unwrap(), SQUARE, "{command}");
    }
    // A device may be both.
    #[cfg(unix)]
    unusable(&["run", "/dev/null", "--svg", "/dev/null"], &["is empty"]);
}

#[test]
fn a_part_that_is_to_fail_has_to_be_there() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    for (fault, part) in [
        ("open@1", "the machine has no `heaters.nozzle`"),
        ("external@1", "the machine has no `heaters.fault_input`"),
    ] {
        unusable(&["run", &job, "--heat-fault", fault], &[part]);
    }
}

#[test]
fn an_output_replaces_neither_the_machine_nor_another_output() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let machine = folder.file("m.toml", "");
    let settings = folder.file("s.txt", "$110=500\n");
    let [new, same] = ["new", "./new"].map(|name| folder.path(name).to_str().unwrap().to_owned());
    for command in ["run", "check", "profile"] {
        let read = ["--machine", &machine, "--settings", &settings];
        for file in [&machine, &settings] {
            unusable(
                &[&[command, &job, "--svg", file], &read[..]].concat(),
                &["another name"],
            );
        }
    }
    unusable(
        &["run", &job, "--svg", &new, "--html", &same],
        &["new", "two outputs"],
    );
    unusable(
        &["profile", &job, "--svg", &new, "--csv", &new],
        &["new", "two outputs"],
    );
    assert!(!folder.path("new").exists());
    #[cfg(unix)]
    {
        let nothing = ["run", &job, "--svg", "/dev/null", "--html", "/dev/null"];
        assert_eq!(leadscrew(&nothing).status.code(), Some(0));
    }
}

#[test]
fn a_job_that_cannot_be_read_does_not_keep_the_others_from_their_turn() {
    let folder = Folder::new();
    let empty = folder.file("a.nc", "");
    let bad = folder.file("b.nc", "G77\n");
    let missing = folder.path("c.nc").to_str().unwrap().to_owned();
    for command in ["run", "check"] {
        let done = leadscrew(&[command, &empty, &bad, &missing]);
        assert_eq!(done.status.code(), Some(2), "{command}");
        let said = stderr(&done);
        assert!(said.contains("a.nc: is empty"), "{said}");
        assert!(said.contains("b.nc:1:1: error:20"), "{said}");
        assert!(said.contains("c.nc: cannot be read"), "{said}");
        let json = leadscrew(&[command, "--json", &empty, &bad, &missing]);
        assert_eq!(json.status.code(), Some(2), "{command}");
        let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
        assert_eq!(json.as_array().unwrap().len(), 1, "{command}");
    }
}

#[test]
fn bad_settings_are_refused_with_their_place() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let nonsense = folder.file("bad.txt", "$100=80\nhello\n");
    unusable(
        &["run", &job, "--settings", &nonsense],
        &["bad.txt:2", "hello", "expected a setting"],
    );
    unusable(
        &["run", &job, "--settings", "missing.txt"],
        &["missing.txt", "cannot be read"],
    );
    unusable(&["run", &job, "--set", "$999=1"], &["$999=1", "error:3"]);
    unusable(&["run", &job, "--set", "$0=0.9"], &["$0=0.9", "error:6"]);
    unusable(
        &["run", &job, "--set", "110"],
        &["--set '110'", "expected a setting"],
    );
    let binary = folder.file("bin.txt", [0xFF, 0xFE, 0x00]);
    unusable(
        &["run", &job, "--settings", &binary],
        &["bin.txt", "not a text file"],
    );
}

#[test]
fn outputs_that_cannot_be_written_are_named() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    for option in ["--svg", "--vcd", "--steps"] {
        unusable(
            &["run", &job, option, "no/such/folder/x"],
            &["no/such/folder/x", "cannot be written"],
        );
    }
    if Path::new("/dev/full").exists() {
        unusable(
            &["run", &job, "--steps", "/dev/full"],
            &["/dev/full", "cannot be written"],
        );
    }
}

#[test]
fn bad_usage_is_explained() {
    for args in [
        &["run"][..],
        &["fly", "x.nc"],
        &["run", "x.nc", "--baud", "5"],
        &[],
    ] {
        let output = leadscrew(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(stderr(&output).contains("Usage") || stderr(&output).contains("--help"));
    }
}

/// Runs the program with its standard output closed, as `leadscrew run job.nc | head -1` does.
fn unread(args: &[&str]) -> Output {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
    program.args(args).stdout(writer).output().unwrap()
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1 X1 F600\n");
    for args in [
        ["run", &job].as_slice(),
        &["run", "--json", &job],
        &["check", &job],
        &["profile", "--no-trials", &job],
        &["check", "--svg", "-", &job],
        &["run", "--steps", "-", &job],
        &["run", "--vcd", "-", &job],
        &["profile", "--no-trials", "--csv", "-", &job],
    ] {
        let output = unread(args);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{args:?}: {}",
            stderr(&output)
        );
    }
    let wrong = unread(&["check", "--github", &folder.file("wrong.nc", "G1 X1\n")]);
    assert_eq!(wrong.status.code(), Some(1), "{}", stderr(&wrong));
}

#[cfg(target_os = "linux")]
#[test]
fn an_output_that_cannot_be_written_is_said() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1 X1 F600\n");
    let wrong = folder.file("wrong.nc", "G1 X1\n");
    let full = || fs::File::options().write(true).open("/dev/full").unwrap();
    for args in [["run", &job].as_slice(), &["check", "--github", &wrong]] {
        let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
        let output = program.args(args).stdout(full()).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(stderr(&output).contains("standard output: "), "{args:?}");
    }
    for command in ["run", "check", "profile"] {
        let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
        let status = program.args([command, &wrong]).stderr(full()).output();
        assert_eq!(status.unwrap().status.code(), Some(1), "{command}");
    }
}
