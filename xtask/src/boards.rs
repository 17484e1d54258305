//! `cargo xtask boards`: the example boards that are not an F407.
//!
//! These boards are compiled, and run in an emulator: QEMU, or `rp2040js` from the registry of npm.
//! They get a job over their serial lines. The emulator's trace of their ports must show the steps
//! that `leadscrew run` makes of this job.
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
const BOARDS: [(&str, &str); 3] = [
    ("lm3s6965", "thumbv7m-none-eabi"),
    ("rp2040", "thumbv6m-none-eabi"),
    ("riscv", "riscv32imac-unknown-none-elf"),
];

/// What runs a board. Emulated time is counted in instructions, so that a busy computer causes no
/// delays.
enum Emulator {
    Qemu {
        /// The program of QEMU, and the machine.
        machine: [&'static str; 2],
        /// Further arguments; the first two are the length of an instruction.
        arguments: &'static [&'static str],
        /// The events that QEMU has to trace: each change of a pin.
        events: &'static str,
    },
    /// [`PICO`], under Node.js.
    Pico,
}

/// The folder of the emulated Pico.
const PICO: &str = "tests/rp2040";

/// A board that is emulated.
struct Emulated {
    /// Its place in [`BOARDS`].
    board: usize,
    emulator: Emulator,
    /// The edges of a trace.
    edges: fn(&str) -> Vec<Edge>,
    /// Lines of parts that its build leaves out, and their answers.
    refuses: &'static [(&'static str, &'static str)],
}

const EMULATED: [Emulated; 3] = [
    Emulated {
        board: 0,
        emulator: Emulator::Qemu {
            machine: ["qemu-system-arm", "lm3s6965evb"],
            arguments: &["-icount", "shift=4,sleep=off"], // 16 ns; the chip takes 20
            events: "pl061_set_output",
        },
        edges: pl061_edges,
        refuses: &[
            ("G81Z-1R1F100", "error:20\r\n"), // cycles
            ("$704=1", "error:3\r\n"),        // curves
            ("$705=1000", "error:3\r\n"),     // jerk
            ("$ES", "error:3\r\n"),           // listings
            ("$703=10", "error:3\r\n"),       // rasters
            ("$I", "ok\r\n"),
        ],
    },
    Emulated {
        board: 1,
        emulator: Emulator::Pico,
        edges: pico_edges,
        refuses: &[],
    },
    Emulated {
        board: 2,
        emulator: Emulator::Qemu {
            machine: ["qemu-system-riscv32", "sifive_u"],
            arguments: &["-icount", "shift=4,sleep=off", "-bios", "none"], // 16 ns; the chip takes 1
            events: "sifive_gpio_write",
        },
        edges: sifive_edges,
        refuses: &[],
    },
];

/// A pin, and its new level.
type Edge = (&'static str, bool);

/// Lines, a diagonal of all motors, and a circle, which takes X and Y both ways.
const JOB: &str = "G1X1F300\nG1Y-0.5\nG1X0.2Y0.3Z0.4\nG2X0.2Y0.3I0.2\n";
const END: &str = "<Idle|MPos:0.200,0.300,0.400|";

/// The steps of a motor in their order: true if a step goes in the negative direction.
type Steps = Vec<bool>;

const STEPS: [&str; 3] = ["step X", "step Y", "step Z"];
const DIRECTIONS: [&str; 3] = ["direction X", "direction Y", "direction Z"];

/// The edges in QEMU's trace of the LM3S6965's ports: port E (its device is number 12 in QEMU's
/// list) has the steps, port D the directions.
fn pl061_edges(trace: &str) -> Vec<Edge> {
    let edge = |line: &str| {
        let (_, rest) = line.split_once("device[")?;
        let (device, rest) = rest.split_once("] setting output ")?;
        let (pin, level) = rest.split_once(" to ")?;
        let pins = match device {
            "12" => STEPS,
            "11" => DIRECTIONS,
            _ => return None,
        };
        let pin = *pins.get(pin.parse::<usize>().ok()?)?;
        Some((pin, level.trim() == "1"))
    };
    trace.lines().filter_map(edge).collect()
}

/// The edges in QEMU's trace of the FU540's GPIO: writes of the word that has all levels.
fn sifive_edges(trace: &str) -> Vec<Edge> {
    let mut before = 0;
    let mut edges = Vec::new();
    for line in trace.lines() {
        let Some((_, value)) = line.split_once("offset 0xc value 0x") else {
            continue;
        };
        let levels = u32::from_str_radix(value.trim(), 16).unwrap_or(before);
        for (bit, pin) in STEPS.into_iter().chain(DIRECTIONS).enumerate() {
            if (before ^ levels) >> bit & 1 == 1 {
                edges.push((pin, levels >> bit & 1 == 1));
            }
        }
        before = levels;
    }
    edges
}

/// The edges of a Pico's pins: steps on GPIO 2 to 4, directions on GPIO 5 to 7.
fn pico_edges(trace: &str) -> Vec<Edge> {
    let edge = |line: &str| {
        let (pin, level) = line.split_once(' ')?;
        let mut pins = STEPS.into_iter().chain(DIRECTIONS);
        let pin = pins.nth(pin.parse::<usize>().ok()?.checked_sub(2)?)?;
        Some((pin, level == "1"))
    };
    trace.lines().filter_map(edge).collect()
}

/// The steps that edges make, motor by motor. A board must set a direction before the step.
///
/// # Errors
/// The pin that does not fall before it rises again.
fn steps(edges: &[Edge]) -> Result<[Steps; 3], &'static str> {
    let mut steps = [const { Steps::new() }; 3];
    let (mut stepping, mut negative) = ([false; 3], [false; 3]);
    for (pin, high) in edges {
        if let Some(motor) = DIRECTIONS.iter().position(|direction| direction == pin) {
            negative[motor] = *high;
        } else if let Some(motor) = STEPS.iter().position(|step| step == pin) {
            if *high == std::mem::replace(&mut stepping[motor], *high) {
                return Err(STEPS[motor]);
            }
            if *high {
                steps[motor].push(negative[motor]);
            }
        }
    }
    match stepping.iter().position(|high| *high) {
        Some(motor) => Err(STEPS[motor]),
        None => Ok(steps),
    }
}

/// The steps that the simulator makes of the job.
fn simulated() -> Result<[Steps; 3], Failure> {
    let job = target_dir().join("job.nc");
    fs::write(&job, JOB).map_err(Failure::file(&job))?;
    let mut simulator = Command::new("cargo");
    simulator
        .args(["run", "--quiet", "-p", "leadscrew-cli", "--"])
        .args(["run", "--quiet", "--steps", "-"])
        .arg(&job);
    let table = shell::output(&mut simulator)?;
    listed(&table).ok_or_else(|| Failure::unreadable("leadscrew run --steps", &table))
}

/// The steps of a table of `leadscrew run --steps`.
fn listed(table: &str) -> Option<[Steps; 3]> {
    let mut steps = [const { Steps::new() }; 3];
    for line in table.strip_prefix("cycle,step,dir,power\n")?.lines() {
        let mut words = line.split(',').skip(1);
        let mut mask = || words.next()?.parse::<u8>().ok();
        let (stepping, negative) = (mask()?, mask()?);
        for (motor, steps) in steps.iter_mut().enumerate() {
            if stepping >> motor & 1 == 1 {
                steps.push(negative >> motor & 1 == 1);
            }
        }
    }
    Some(steps)
}

/// The longest time that an emulator may take for the job.
const TIME_LIMIT: Duration = Duration::from_secs(120);

/// Builds every board, and runs it.
pub(crate) fn run() -> Result<(), Failure> {
    for (board, target) in BOARDS {
        build(board, target, &[])?;
        println!("{board}: {} bytes of flash", flash(&elf(board, target))?);
    }
    let (board, target) = BOARDS[0];
    ensure_documented(flash(&elf(board, target))?)?;
    let expected = simulated()?;
    EMULATED
        .iter()
        .try_for_each(|emulated| watch(emulated, &expected))
}

/// The parts that a small chip may leave out.
const PARTS: [&str; 9] = [
    "arcs",
    "probing",
    "cycles",
    "listings",
    "rasters",
    "jerk",
    "curves",
    "linuxcnc",
    "descriptions",
];

/// Prints the flash of the first board: without any of [`PARTS`], and what each of them adds.
pub(crate) fn parts() -> Result<(), Failure> {
    let (board, target) = BOARDS[0];
    let bytes = |arguments: &[&str]| {
        build(board, target, arguments)?;
        flash(&elf(board, target))
    };
    let none = bytes(&["--no-default-features"])?;
    println!("none: {none} bytes of flash");
    for part in PARTS {
        let feature = format!("leadscrew/{part}");
        let all = bytes(&["--no-default-features", "--features", &feature])?;
        println!("{part}: {} bytes more", all.saturating_sub(none));
    }
    Ok(())
}

/// Runs the job on an emulated board, and compares its pins.
fn watch(emulated: &Emulated, expected: &[Steps; 3]) -> Result<(), Failure> {
    let (board, target) = BOARDS[emulated.board];
    let trace = target_dir().join(format!("pins-{board}.log"));
    let answers = run_job(emulated, &elf(board, target), &trace)?;
    println!("{board}: {}", last_status(&answers));
    let trace = fs::read_to_string(&trace).map_err(Failure::file(&trace))?;
    compare(board, &(emulated.edges)(&trace), expected)
}

/// The last status report of a conversation.
fn last_status(answers: &str) -> &str {
    let mut lines = answers.lines();
    lines
        .rfind(|line| line.starts_with('<'))
        .unwrap_or_default()
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

pub(crate) fn target_dir() -> PathBuf {
    toolchain::target_dir().join("boards")
}

pub(crate) fn folder(board: &str) -> PathBuf {
    toolchain::root().join("examples/boards").join(board)
}

fn elf(board: &str, target: &str) -> PathBuf {
    target_dir().join(target).join("release").join(board)
}

/// Builds a board, with further `arguments`.
fn build(board: &str, target: &str, arguments: &[&str]) -> Result<(), Failure> {
    let mut build = Toolchain::find_for(target)?.cargo("build", target, &target_dir())?;
    build
        .args(["--release", "--locked"])
        .args(arguments)
        .current_dir(folder(board));
    shell::run(&mut build)
}

/// Sends the job, and asks for the state until the machine reports the end of the job. Returns the
/// text heard.
fn run_job(emulated: &Emulated, elf: &Path, trace: &Path) -> Result<String, Failure> {
    let mut running = start(emulated, elf, trace)?;
    let done = converse(&mut running, emulated.refuses);
    // An emulator does not end by itself; if it has ended, there is nothing to stop.
    let _ = running.kill();
    let _ = running.wait();
    done
}

fn start(emulated: &Emulated, elf: &Path, trace: &Path) -> Result<Child, Failure> {
    let mut command = match emulated.emulator {
        Emulator::Qemu {
            machine,
            arguments,
            events,
        } => qemu(machine, arguments, events, elf, trace),
        Emulator::Pico => pico(elf, trace)?,
    };
    command.stdin(Stdio::piped()).stdout(Stdio::piped());
    command.spawn().map_err(|error| Failure::NotStarted {
        program: command.get_program().to_string_lossy().into_owned(),
        error,
    })
}

fn qemu(
    [program, machine]: [&str; 2],
    arguments: &[&str],
    events: &str,
    elf: &Path,
    trace: &Path,
) -> Command {
    let mut command = Command::new(program);
    command
        .args(["-M", machine, "-nographic", "-monitor", "none"])
        .args(arguments)
        .args(["-serial", "stdio"])
        .args(["-trace", events, "-D"])
        .arg(trace)
        .arg("-kernel")
        .arg(elf)
        .stderr(Stdio::null());
    command
}

/// The emulated Pico with the bytes of `elf` in its flash. Its packages are installed if they are
/// missing.
fn pico(elf: &Path, trace: &Path) -> Result<Command, Failure> {
    let folder = toolchain::root().join(PICO);
    if !folder.join("node_modules").exists() {
        let mut install = Command::new("npm");
        install.args([
            "ci",
            "--silent",
            "--ignore-scripts",
            "--no-audit",
            "--no-fund",
        ]);
        shell::run(install.current_dir(&folder))?;
    }
    let image = elf.with_extension("bin");
    let mut copy = Command::new("arm-none-eabi-objcopy");
    shell::run(copy.args(["-O", "binary"]).arg(elf).arg(&image))?;
    let mut command = Command::new("node");
    command.arg(folder.join("run.js")).arg(&image).arg(trace);
    Ok(command)
}

fn converse(emulator: &mut Child, refuses: &[(&str, &str)]) -> Result<String, Failure> {
    let (Some(mut to), Some(from)) = (emulator.stdin.take(), emulator.stdout.take()) else {
        return Err(Failure::finding("the emulator has no serial line"));
    };
    let answers = listen(from);
    let begin = Instant::now();
    let mut heard = String::new();
    await_text(&answers, &mut heard, "help]", begin)?;
    send(&mut to, &format!("$X\n{JOB}"))?;
    while !heard.contains(END) {
        send(&mut to, "?")?;
        await_text(&answers, &mut heard, ">\r\n", begin)?;
        thread::sleep(Duration::from_millis(50));
    }
    for (line, answer) in refuses {
        send(&mut to, &format!("{line}\n"))?;
        await_text(&answers, &mut heard, answer, begin)?;
    }
    Ok(heard)
}

fn send(to: &mut ChildStdin, text: &str) -> Result<(), Failure> {
    to.write_all(text.as_bytes())
        .and_then(|()| to.flush())
        .map_err(|error| Failure::finding(format!("the emulator's serial line: {error}")))
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
                let words = format!("no {text:?} within {seconds} s; the board said: {heard}");
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

/// Compares the steps of a board's pins with the simulator's, motor by motor.
fn compare(board: &str, edges: &[Edge], expected: &[Steps; 3]) -> Result<(), Failure> {
    let seen = steps(edges)
        .map_err(|pin| Failure::finding(format!("{board}: {pin} does not fall after a step")))?;
    let mut findings = Vec::new();
    for (pin, (seen, expected)) in STEPS.iter().zip(seen.iter().zip(expected)) {
        let negative = seen.iter().filter(|negative| **negative).count();
        println!("    {:>4} x {pin}, {negative} of them back", seen.len());
        if let Some(place) = difference(seen, expected) {
            let (seen, expected) = (seen.len(), expected.len());
            findings.push(format!(
                "{board}: {pin}: {seen} steps, the simulator makes {expected}; number {place} is \
                 the first that differs"
            ));
        }
    }
    if findings.is_empty() {
        Ok(())
    } else {
        Err(Failure::Findings(findings))
    }
}

/// The first place at which two lists of steps differ, counted from 0.
fn difference(seen: &[bool], expected: &[bool]) -> Option<usize> {
    let together = seen.iter().zip(expected);
    let same = together.take_while(|(seen, expected)| seen == expected);
    let same = same.count();
    (same < seen.len().max(expected.len())).then_some(same)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_read_from_each_trace() {
        let pl061 = "pl061_set_output device[12] setting output 1 to 1\n\
                     pl061_set_output device[10] setting output 1 to 1\n\
                     pl061_set_output device[11] setting output 0 to 0";
        assert_eq!(
            pl061_edges(pl061),
            [("step Y", true), ("direction X", false)]
        );
        let sifive = "sifive_gpio_write offset 0xc value 0x41\n\
                      sifive_gpio_write offset 0x8 value 0x7f\n\
                      sifive_gpio_write offset 0xc value 0x50";
        assert_eq!(
            sifive_edges(sifive),
            [("step X", true), ("step X", false), ("direction Y", true)]
        );
        let pico = "0 1\n2 1\n2 0\n6 1\n8 0\n";
        assert_eq!(
            pico_edges(pico),
            [("step X", true), ("step X", false), ("direction Y", true)]
        );
    }

    #[test]
    fn a_board_that_steps_otherwise_than_the_simulator_is_a_finding() {
        let pulse = [("step X", true), ("step X", false)];
        let back = [&[("direction X", true)][..], &pulse].concat();
        let job = listed("cycle,step,dir,power\n9,1,0,0.000\n11,3,1,0.000\n").unwrap();
        assert_eq!(job, [vec![false, true], vec![false], vec![]]);
        let y = [("step Y", true), ("step Y", false)];
        let good = [&pulse[..], &back, &y].concat();
        assert!(compare("a board", &good, &job).is_ok());
        let late = [&pulse[..], &pulse, &[("direction X", true)], &y].concat();
        let bad = [&back[..], &pulse, &y].concat();
        for edges in [&good[2..], &late, &bad, &good[..5], &good[..6]] {
            assert!(compare("a board", edges, &job).is_err(), "{edges:?}");
        }
        assert_eq!(listed("step\n1\n"), None);
    }

    #[test]
    fn the_document_says_how_much_flash_it_takes() {
        assert_eq!(documented("a\nFlash: 141 KB on a board"), Some(141));
        assert_eq!(documented("a Flash: 141 KB"), None);
        let path = toolchain::root().join(DOCUMENT);
        assert!(documented(&fs::read_to_string(path).unwrap()).is_some());
    }
}
