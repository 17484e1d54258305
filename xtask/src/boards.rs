//! `cargo xtask boards`: the example boards that are not an F407.
//!
//! All of these boards are compiled. The one that QEMU emulates gets a job over its serial line.
//! QEMU's trace of its ports must show the steps and directions of the job.
use crate::{
    failure::Failure,
    shell,
    toolchain::{self, Toolchain},
};
use std::{
    fs,
    io::{Read, Write},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, Command, Stdio},
    sync::mpsc::{self, Receiver},
    thread,
    time::{Duration, Instant},
};

/// For each board its folder in `examples/boards`, which is also the program's name, and its
/// target.
const BOARDS: [(&str, &str); 2] = [
    ("lm3s6965", "thumbv7m-none-eabi"),
    ("rp2040", "thumbv6m-none-eabi"),
];

/// At Grbl's 250 steps/mm: 250 steps of X, then 125 of Y in the negative direction.
const JOB: &str = "$X\nG1X1F300\nG1Y-0.5\n";
const END: &str = "<Idle|MPos:1.000,-0.500,0.000|";

/// The edges that the pins must show: port, pin, level, and how often.
///
/// Port E (its device is number 12 in QEMU's list) has the steps, port D the directions.
const EDGES: [(&str, usize); 6] = [
    ("device[12] setting output 0 to 1", 250),
    ("device[12] setting output 0 to 0", 250),
    ("device[12] setting output 1 to 1", 125),
    ("device[12] setting output 1 to 0", 125),
    ("device[12] setting output 2 to 1", 0),
    ("device[11] setting output 1 to 1", 1),
];
const FIRST_STEP_OF_Y: &str = "device[12] setting output 1 to 1";
const Y_TURNS_BACK: &str = "device[11] setting output 1 to 1";

/// The longest time that QEMU may take for the job.
const TIME_LIMIT: Duration = Duration::from_secs(120);

/// Builds every board, and runs the one that QEMU emulates.
pub(crate) fn run() -> Result<(), Failure> {
    for (board, target) in BOARDS {
        build(board, target)?;
        println!("{board}: {} bytes of flash", flash(&elf(board, target))?);
    }
    let (board, target) = BOARDS[0];
    let elf = elf(board, target);
    ensure_documented(flash(&elf)?)?;
    let trace = target_dir().join("pins.log");
    let answers = run_job(&elf, &trace)?;
    println!("{board}: {}", answers.trim().replace("\r\n", " / "));
    compare(&fs::read_to_string(&trace).map_err(Failure::file(&trace))?)
}

/// The document that says how much flash the first board takes, and how it says so.
const DOCUMENT: &str = "docs/embedding.md";
const FLASH: &str = "\nFlash: ";
/// The most by which the document may be off, KB.
const DOCUMENT_OFF: u64 = 7;

/// Bytes of flash that a program takes: code and constants, and the first values of variables.
fn flash(elf: &Path) -> Result<u64, Failure> {
    let table = shell::output(Command::new("arm-none-eabi-size").arg(elf))?;
    let sizes = table.lines().nth(1).map(|line| {
        let mut words = line.split_whitespace();
        let mut size = || words.next()?.parse::<u64>().ok();
        Some(size()? + size()?)
    });
    let unreadable = || Failure::unreadable("size", &table);
    sizes.flatten().ok_or_else(unreadable)
}

/// Checks the figure of the document, in KB, against the program's bytes.
fn ensure_documented(bytes: u64) -> Result<(), Failure> {
    let path = toolchain::root().join(DOCUMENT);
    let text = fs::read_to_string(&path).map_err(Failure::file(&path))?;
    let said = documented(&text).ok_or_else(|| Failure::unreadable(DOCUMENT, FLASH))?;
    let measured = bytes.div_ceil(1000);
    if measured.abs_diff(said) <= DOCUMENT_OFF {
        return Ok(());
    }
    Err(Failure::finding(format!(
        "{DOCUMENT}: says {said} KB of flash, measured are {measured}"
    )))
}

/// The figure in a text, KB.
fn documented(text: &str) -> Option<u64> {
    let (_, rest) = text.split_once(FLASH)?;
    rest.split_whitespace().next()?.parse().ok()
}

fn target_dir() -> PathBuf {
    toolchain::target_dir().join("boards")
}

fn elf(board: &str, target: &str) -> PathBuf {
    target_dir().join(target).join("release").join(board)
}

fn build(board: &str, target: &str) -> Result<(), Failure> {
    let mut build = Toolchain::find_for(target)?.cargo("build", target, &target_dir())?;
    build
        .args(["--release", "--locked"])
        .current_dir(toolchain::root().join("examples/boards").join(board));
    shell::run(&mut build)
}

/// Sends the job, and asks for the state until the machine reports the end of the job. Returns the
/// text heard.
fn run_job(elf: &Path, trace: &Path) -> Result<String, Failure> {
    let mut qemu = start(elf, trace)?;
    let done = converse(&mut qemu);
    // QEMU does not end by itself; if it has ended, there is nothing to stop.
    let _ = qemu.kill();
    let _ = qemu.wait();
    done
}

fn start(elf: &Path, trace: &Path) -> Result<Child, Failure> {
    let mut command = Command::new("qemu-system-arm");
    command
        .args(["-M", "lm3s6965evb", "-nographic", "-monitor", "none"])
        // Emulated time is counted in instructions, 16 ns each, so that a busy computer causes no
        // delays.
        .args(["-serial", "stdio", "-icount", "shift=4,sleep=off"])
        .args(["-trace", "pl061_set_output", "-D"])
        .arg(trace)
        .arg("-kernel")
        .arg(elf)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    command.spawn().map_err(|error| Failure::NotStarted {
        program: "qemu-system-arm".to_owned(),
        error,
    })
}

fn converse(qemu: &mut Child) -> Result<String, Failure> {
    let (Some(mut to), Some(from)) = (qemu.stdin.take(), qemu.stdout.take()) else {
        return Err(Failure::finding("QEMU has no serial line"));
    };
    let answers = listen(from);
    let begin = Instant::now();
    let mut heard = String::new();
    await_text(&answers, &mut heard, "help]", begin)?;
    send(&mut to, JOB)?;
    while !heard.contains(END) {
        send(&mut to, "?")?;
        await_text(&answers, &mut heard, ">\r\n", begin)?;
        thread::sleep(Duration::from_millis(50));
    }
    Ok(heard)
}

fn send(to: &mut ChildStdin, text: &str) -> Result<(), Failure> {
    to.write_all(text.as_bytes())
        .and_then(|()| to.flush())
        .map_err(|error| Failure::finding(format!("QEMU's serial line: {error}")))
}

/// Waits until `text` comes once more than it has so far.
fn await_text(
    answers: &Receiver<String>,
    heard: &mut String,
    text: &str,
    begin: Instant,
) -> Result<(), Failure> {
    let before = heard.matches(text).count();
    while heard.matches(text).count() == before {
        let left = TIME_LIMIT.saturating_sub(begin.elapsed());
        match answers.recv_timeout(left) {
            Ok(more) => *heard += &more,
            Err(_) => {
                let seconds = TIME_LIMIT.as_secs();
                let words = format!("no {END} within {seconds} s; the board said: {heard}");
                return Err(Failure::finding(words));
            }
        }
    }
    Ok(())
}

/// Reads on a thread of its own, so that waiting for text can time out.
fn listen(mut from: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut bytes = [0; 256];
        while let Ok(count @ 1..) = from.read(&mut bytes) {
            let text = String::from_utf8_lossy(&bytes[..count]).into_owned();
            if sender.send(text).is_err() {
                return;
            }
        }
    });
    receiver
}

/// Compares QEMU's trace with the job's pin levels.
fn compare(trace: &str) -> Result<(), Failure> {
    let mut findings = Vec::new();
    for (edge, expected) in EDGES {
        let seen = trace.lines().filter(|line| line.ends_with(edge)).count();
        println!("    {seen:>4} x {edge}");
        if seen != expected {
            findings.push(format!("{edge}: {seen} times, not {expected}"));
        }
    }
    if trace.find(Y_TURNS_BACK) > trace.find(FIRST_STEP_OF_Y) {
        findings.push("Y steps before its direction has changed".to_owned());
    }
    if findings.is_empty() {
        Ok(())
    } else {
        Err(Failure::Findings(findings))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_document_says_how_much_flash_it_takes() {
        assert_eq!(documented("a\nFlash: 141 KB on a board"), Some(141));
        assert_eq!(documented("a Flash: 141 KB"), None);
        let path = toolchain::root().join(DOCUMENT);
        assert!(documented(&fs::read_to_string(path).unwrap()).is_some());
    }
}
