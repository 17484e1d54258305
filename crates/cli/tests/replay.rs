//! Tests of `leadscrew replay` as a script calls it. Every recorded conversation is replayed; a
//! file that is no conversation is refused with one message.

use leadscrew_sim::replay::{replay, Case};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn leadscrew_replay(file: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
    command.arg("replay").arg(file).output().unwrap()
}

/// The files of all recordings.
fn recordings() -> Vec<PathBuf> {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/conformance/cases");
    let groups = fs::read_dir(cases).unwrap();
    let files = groups.flat_map(|group| fs::read_dir(group.unwrap().path()).unwrap());
    files.map(|file| file.unwrap().path()).collect()
}

#[test]
fn every_recording_is_printed_with_what_it_was_and_with_this_machine_s_lines() {
    let files = recordings();
    assert_eq!(files.len(), 159);
    for file in files {
        let recorded: Case = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
        let output = leadscrew_replay(&file);
        assert_eq!(output.status.code(), Some(0), "{}", file.display());
        let replayed = serde_json::to_string_pretty(&replay(&recorded).unwrap()).unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text.trim_end(), replayed, "{}", file.display());
        let printed: Case = serde_json::from_str(&text).unwrap();
        assert_eq!(printed.other, recorded.other, "{}", file.display());
        let ops = |case: &Case| -> Vec<String> {
            let ops = case.exchanges.iter().map(|exchange| exchange.op.clone());
            ops.collect()
        };
        assert_eq!(ops(&printed), ops(&recorded), "{}", file.display());
    }
}

#[test]
fn what_is_no_conversation_is_refused_with_one_message() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("case.json");
    let long = format!("{}0{}", "[".repeat(100_000), "]".repeat(100_000));
    for (text, expected) in [
        ("", "not a conversation"),
        ("{\"exchanges\":[", "not a conversation"),
        ("[1,2]", "expected an object with `exchanges`"),
        ("{\"name\":\"x\"}", "missing field `exchanges`"),
        (
            "{\"exchanges\":[],\"build\":\"v2\"}",
            "unknown variant `v2`",
        ),
        ("{\"exchanges\":[{\"recv\":[]}]}", "missing field `op`"),
        (
            "{\"exchanges\":[{\"op\":\"fly 5\"}]}",
            "exchange 0, `fly 5`",
        ),
        (
            "{\"exchanges\":[{\"op\":\"wait 1e308\"}]}",
            "expected milliseconds",
        ),
        (
            "{\"exchanges\":[{\"op\":\"wait -1\"}]}",
            "expected milliseconds",
        ),
        (
            "{\"exchanges\":[{\"op\":\"resp 99999999999\"}]}",
            "expected a whole number",
        ),
        (
            "{\"exchanges\":[{\"op\":\"pin limit_q 0\"}]}",
            "expected limit_x",
        ),
        (long.as_str(), "not a conversation"),
    ] {
        fs::write(&file, text).unwrap();
        let output = leadscrew_replay(&file);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(output.stdout.is_empty());
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(message.contains("case.json: "), "{message}");
        assert!(message.contains(expected), "{message}, not {expected}");
    }
}

/// A valid but huge conversation: a line of a megabyte takes longer than the 20 s that `cmd` waits.
#[test]
fn a_huge_conversation_is_held_to_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("case.json");
    let boot = serde_json::json!({"op": "(boot)"});
    let long = serde_json::json!({"op": format!("cmd {}", "G".repeat(1 << 20))});
    let many = (0..2_000).map(|_| serde_json::json!({"op": "cmd G21"}));
    let exchanges: Vec<_> = std::iter::once(boot).chain(many).chain([long]).collect();
    let case = serde_json::json!({"format": 99, "exchanges": exchanges});
    fs::write(&file, case.to_string()).unwrap();
    let output = leadscrew_replay(&file);
    assert_eq!(output.status.code(), Some(0));
    let printed: Case = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed.other["format"], 99);
    let oks = printed
        .exchanges
        .iter()
        .filter(|exchange| exchange.recv == ["ok"]);
    assert_eq!(oks.count(), 2_000);
}
