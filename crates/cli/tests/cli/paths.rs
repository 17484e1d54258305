//! Every path of every command, and every kind of thing that may be there. Nothing hangs, nothing
//! is read for ever, and what was there before a refusal is there after it.
#![cfg(unix)]

use crate::program::{stderr, Folder};
use std::fs;
use std::os::unix::fs::{symlink, FileTypeExt, PermissionsExt};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const JOB: &str = "G1 X1 Y0 F600\n";
const DRILL: &str = "M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n";

/// Runs the program. It has to end within seconds.
fn run(words: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
    program.args(words).stdin(Stdio::null());
    ended(&mut program, words)
}

fn ended(program: &mut Command, words: &[&str]) -> Output {
    program.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = program.spawn().unwrap();
    let until = Instant::now() + Duration::from_secs(20);
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > until {
            let _ = child.kill();
            panic!("{words:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

/// Runs a command, in whose words `@` is `path`; expects a refusal that names the path.
fn refused(command: &str, path: &str) {
    let words: Vec<String> = command
        .split(' ')
        .map(|word| word.replace('@', path))
        .collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let output = run(&words);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {message}");
    assert!(message.contains(path), "{words:?}: {message}");
}

/// Commands that read the path `@`. `job.nc` is in the folder `%`.
const READERS: [&str; 16] = [
    "run @",
    "check @",
    "profile @",
    "replay @",
    "import drill @ --depth=-1 --feed 60",
    "import rp @",
    "import rows @",
    "import print @",
    "align @ --ref 0,0 --measured 0,0 --ref 1,0 --measured 1,0",
    "run %/job.nc --machine @",
    "check %/job.nc --settings @",
    "machine pins @",
    "board check @",
    "board pack discovery --into @ -o %/new.bin",
    "serve --tcp 0 --state %/state --machine @",
    "serve --tcp 0 --state @",
];

#[test]
fn nothing_but_files_and_pipes_is_read() {
    let folder = Folder::new();
    folder.file("job.nc", JOB);
    symlink("circle", folder.path("circle")).unwrap();
    let _socket = UnixListener::bind(folder.path("socket")).unwrap();
    let here = folder
        .path("")
        .to_str()
        .unwrap()
        .trim_end_matches('/')
        .to_owned();
    fs::create_dir(folder.path("empty")).unwrap();
    let kinds = ["missing/file", "empty", "socket", "circle"].map(|name| format!("{here}/{name}"));
    let devices = ["/dev/zero", "/dev/urandom"].map(str::to_owned);
    for reader in READERS {
        for kind in kinds.iter().chain(&devices) {
            // A state file that is not there is made.
            if reader.ends_with("--state @") && kind.ends_with("missing/file") {
                continue;
            }
            refused(&reader.replace('%', &here), kind);
        }
    }
    assert!(devices.iter().all(|name| is_device(name)));
    assert!(!folder.path("new.bin").exists());
}

fn is_device(name: &str) -> bool {
    fs::symlink_metadata(name)
        .unwrap()
        .file_type()
        .is_char_device()
}

/// Commands that write the path `@`, and whether it must be a new file.
const WRITERS: [(&str, bool); 14] = [
    ("run %/job.nc --svg @", false),
    ("run %/job.nc --html @", false),
    ("run %/job.nc --vcd @", false),
    ("run %/job.nc --steps @", false),
    ("check %/job.nc --svg @", false),
    ("profile --no-trials %/job.nc --svg @", false),
    ("profile --no-trials %/job.nc --csv @", false),
    ("import drill %/holes.drl --depth=-1 --feed 60 -o @", false),
    (
        "align %/job.nc --ref 0,0 --measured 0,0 --ref 1,0 --measured 1,0 -o @",
        false,
    ),
    ("machine new -o @", true),
    ("board new -o @", true),
    ("board pack discovery -o @", true),
    ("board pack discovery --lines -o @", true),
    ("board pack discovery --machine %/machine.toml -o @", true),
];

/// A folder with all that the commands read.
fn place() -> (Folder, String) {
    let folder = Folder::new();
    folder.file("job.nc", JOB);
    folder.file("holes.drl", DRILL);
    folder.file("machine.toml", "");
    let here = folder
        .path("")
        .to_str()
        .unwrap()
        .trim_end_matches('/')
        .to_owned();
    (folder, here)
}

fn names(folder: &Path) -> Vec<String> {
    let all = fs::read_dir(folder).unwrap();
    let mut all: Vec<String> = all
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    all.sort();
    all
}

#[test]
fn an_output_replaces_files_alone_follows_links_and_keeps_modes() {
    let (folder, here) = place();
    fs::create_dir(folder.path("folder")).unwrap();
    symlink("circle", folder.path("circle")).unwrap();
    symlink("real", folder.path("link")).unwrap();
    let _socket = UnixListener::bind(folder.path("socket")).unwrap();
    for (writer, is_new) in WRITERS {
        let writer = writer.replace('%', &here);
        for kind in ["missing/file", "folder", "socket", "circle"] {
            refused(&writer, &format!("{here}/{kind}"));
        }
        let real = folder.file("real", "before");
        fs::set_permissions(&real, fs::Permissions::from_mode(0o600)).unwrap();
        let link = format!("{here}/link");
        let words = writer.replace('@', &link);
        let output = run(&words.split(' ').collect::<Vec<_>>());
        let expected = if is_new { 2 } else { 0 };
        assert_eq!(
            output.status.code(),
            Some(expected),
            "{writer}: {}",
            stderr(&output)
        );
        assert_eq!(fs::read(&real).unwrap() == b"before", is_new, "{writer}");
        assert!(Path::new(&link).is_symlink(), "{writer}");
        let mode = fs::metadata(&real).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600, "{writer}");
        let words = writer.replace('@', "/dev/null");
        let output = run(&words.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(expected), "{writer}");
        assert!(is_device("/dev/null"), "{writer}");
    }
}

#[test]
fn a_full_disk_leaves_no_file() {
    let (folder, here) = place();
    fs::create_dir(folder.path("full")).unwrap();
    for (writer, _) in WRITERS {
        let name = format!("{here}/full/new");
        let words = writer.replace('%', &here).replace('@', &name);
        // No file may grow: as on a full disk, the first byte is refused.
        let script = "trap '' XFSZ; ulimit -f 0; exec \"$0\" \"$@\"";
        let mut program = Command::new("sh");
        program.args(["-c", script, env!("CARGO_BIN_EXE_leadscrew")]);
        program.args(words.split(' '));
        let output = ended(&mut program, &[&words]);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{words}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains("cannot be written"),
            "{words}: {}",
            stderr(&output)
        );
        assert_eq!(names(&folder.path("full")), [""; 0], "{words}");
    }
}

#[test]
fn manual_pages_make_their_folder() {
    let folder = Folder::new();
    let deep = folder.path("new/folder");
    let output = run(&["man", "--folder", deep.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(names(&deep).contains(&"leadscrew-run.1".to_owned()));
    refused("man --folder @", "/dev/null");
}

#[test]
fn a_state_file_takes_the_place_of_nothing_else() {
    let (folder, here) = place();
    fs::create_dir(folder.path("folder")).unwrap();
    folder.file("empty", "");
    folder.file("begun", "LEADSCREW");
    let fifo = Command::new("mkfifo")
        .arg(folder.path("fifo"))
        .status()
        .unwrap();
    assert!(fifo.success());
    symlink("job.nc", folder.path("link")).unwrap();
    let before = names(&folder.path(""));
    for name in ["job.nc", "folder", "empty", "begun", "fifo", "link"] {
        refused("serve --tcp 0 --state @", &format!("{here}/{name}"));
    }
    for device in ["/dev/null", "/dev/full"] {
        refused("serve --tcp 0 --state @", device);
        assert!(is_device(device));
    }
    assert_eq!(fs::read_to_string(folder.path("job.nc")).unwrap(), JOB);
    assert_eq!(names(&folder.path("")), before);
}

#[test]
fn a_log_replaces_neither_the_machine_nor_the_state() {
    let (folder, here) = place();
    let machine = folder.file("machine.toml", "# mine\n");
    let read = format!("serve --tcp 0 --state {here}/state --machine {machine} --log @");
    refused(&read, &machine);
    refused(&read, &format!("{here}/state"));
    refused(&read, &format!("{here}/missing/log"));
    assert_eq!(fs::read_to_string(&machine).unwrap(), "# mine\n");
}

/// Characters that XML 1.0 allows (section 2.2).
fn is_xml(one: char) -> bool {
    matches!(one, '\t' | '\n' | '\r' | ' '..='\u{D7FF}' | '\u{E000}'..='\u{FFFD}' | '\u{10000}'..)
}

#[test]
fn a_name_does_nothing_but_name() {
    let folder = Folder::new();
    let names = [
        "\u{1b}[2Jclear.nc",
        "line\n::error::forged.nc",
        "::error::forged.nc",
        "\u{FFFE}.nc",
    ];
    for name in names {
        for content in [JOB, "G1 X1\n", ""] {
            folder.file(name, content);
            for words in [
                ["check", "--github", name].as_slice(),
                &["check", name],
                &["check", "--svg", "out.svg", name],
                &["check", "--machine", name, "--github", name],
                &["run", "--svg", "out.svg", "--html", "out.html", name],
                &["run", "--settings", name, name],
                &["run", "--json", name],
                &["profile", "--no-trials", "--svg", "out.svg", name],
                &["import", "drill", name, "--depth=-1", "--feed", "60"],
                &["import", "rp", name],
                &["replay", "--judge", name],
                &["board", "check", name],
                &["serve", "--tcp", "0", "--state", name],
            ] {
                let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
                let output = ended(program.args(words).current_dir(folder.path("")), words);
                for said in [output.stdout, output.stderr] {
                    let said = String::from_utf8(said).unwrap();
                    let acts = |one: char| one.is_control() && !matches!(one, '\n' | '\t');
                    assert!(!said.contains(acts), "{words:?}: {said:?}");
                    let forged = said
                        .lines()
                        .find(|line| line.trim().starts_with("::error::"));
                    assert_eq!(forged, None, "{words:?}: {said:?}");
                }
                for picture in ["out.svg", "out.html"] {
                    let drawn = fs::read_to_string(folder.path(picture)).unwrap_or_default();
                    assert!(drawn.chars().all(is_xml), "{words:?}: {picture}");
                }
            }
        }
    }
}
