//! `leadscrew board`: its answers about boards that are right, wrong and unknown.
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
    // The laser where the channel is not, and two switches on one line.
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
fn pins_are_listed_with_their_places() {
    let said = text(&board(&["pins", "fly-407zg"]).stdout);
    assert!(
        said.contains("PB9   step of motor 1        socket 0, step"),
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
