//! Real senders against `leadscrew serve`: installs them under `target/senders`, then lets each run its jobs.
//!
//! The scripts in `tests/senders` drive the senders' own code and say by their exit code how it went.
use crate::{failure::Failure, shell};
use std::{
    fs, io,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::Instant,
};

/// Python packages, of the versions that the scripts were written for.
const PYTHON: [&str; 7] = [
    "meerk40t==0.9.9100",
    "grbl-streamer==2.0.2",
    "gcode-machine==1.0.3",
    "numpy==2.4.6",
    "pillow==13.0.0",
    "pyserial==3.5",
    "pyusb==1.3.1",
];

/// Packages for Node.js, likewise.
const NODE: [&str; 3] = [
    "cncjs@1.11.5",
    "socket.io-client@2.5.0",
    "jsonwebtoken@9.0.3",
];

/// One run of one sender.
struct Run {
    sender: Sender,
    /// The machine: a profile in `tests/senders`.
    machine: &'static str,
    /// What follows the line on the sender's command line; names of jobs are in `tests/senders/gcode`.
    arguments: &'static [&'static str],
    /// The exit code that means success: 7 where the run ends in a stop.
    code: i32,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Sender {
    MeerK40tOverTcp,
    MeerK40tOverPty,
    GrblStreamer,
    Cncjs,
}

const fn run(
    sender: Sender,
    machine: &'static str,
    arguments: &'static [&'static str],
    code: i32,
) -> Run {
    Run {
        sender,
        machine,
        arguments,
        code,
    }
}

const RUNS: [Run; 14] = [
    run(Sender::MeerK40tOverTcp, "open.toml", &[], 0),
    run(Sender::MeerK40tOverTcp, "open.toml", &["--hold"], 0),
    run(
        Sender::MeerK40tOverTcp,
        "open.toml",
        &["--gcode", "small.nc"],
        0,
    ),
    run(
        Sender::MeerK40tOverTcp,
        "open.toml",
        &["--gcode", "raster.nc", "--sync"],
        0,
    ),
    run(
        Sender::MeerK40tOverPty,
        "open.toml",
        &["--gcode", "raster.nc"],
        0,
    ),
    run(Sender::GrblStreamer, "open.toml", &["small.nc"], 0),
    run(
        Sender::GrblStreamer,
        "open.toml",
        &["small.nc", "--incremental"],
        0,
    ),
    run(Sender::GrblStreamer, "open.toml", &["raster.nc"], 0),
    run(
        Sender::GrblStreamer,
        "open.toml",
        &["raster.nc", "--hold-after", "40"],
        0,
    ),
    run(Sender::Cncjs, "open.toml", &["small.nc", "--jog"], 0),
    run(
        Sender::Cncjs,
        "open.toml",
        &["raster.nc", "--hold-after", "40"],
        0,
    ),
    run(Sender::Cncjs, "homing.toml", &["small.nc", "--unlock"], 0),
    run(Sender::Cncjs, "homing.toml", &["small.nc", "--home"], 0),
    run(
        Sender::Cncjs,
        "open.toml",
        &["raster.nc", "--stop-after", "40"],
        7,
    ),
];

impl Sender {
    /// The name on the command line.
    fn name(self) -> &'static str {
        match self {
            Self::MeerK40tOverTcp | Self::MeerK40tOverPty => "meerk40t",
            Self::GrblStreamer => "grbl-streamer",
            Self::Cncjs => "cncjs",
        }
    }
}

/// Runs the senders that are named, all where none is.
///
/// # Errors
/// When one cannot be installed, or a run does not end as it should.
pub(crate) fn run_all(names: &[String]) -> Result<(), Failure> {
    let wanted =
        |sender: Sender| names.is_empty() || names.iter().any(|name| name == sender.name());
    let runs: Vec<&Run> = RUNS.iter().filter(|run| wanted(run.sender)).collect();
    let place = Place::new()?;
    shell::run(Command::new("cargo").args(["build", "-p", "leadscrew-sim", "--bin", "leadscrew"]))?;
    if runs.iter().any(|run| run.sender != Sender::Cncjs) {
        place.install_python()?;
    }
    if runs.iter().any(|run| run.sender == Sender::Cncjs) {
        place.install_node()?;
    }
    let failures = runs.iter().filter_map(|run| place.perform(run).err());
    let findings: Vec<String> = failures.map(|failure| failure.to_string()).collect();
    if findings.is_empty() {
        return Ok(());
    }
    Err(Failure::Findings(findings))
}

/// Folders.
struct Place {
    /// `tests/senders`.
    scripts: PathBuf,
    /// `target/senders`.
    installed: PathBuf,
    /// The program under test.
    leadscrew: PathBuf,
}

impl Place {
    fn new() -> Result<Self, Failure> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let target = std::env::var_os("CARGO_TARGET_DIR");
        let target = target.map_or_else(|| root.join("target"), PathBuf::from);
        let installed = target.join("senders");
        fs::create_dir_all(&installed).map_err(Failure::file(&installed))?;
        Ok(Self {
            scripts: root.join("tests/senders"),
            leadscrew: target.join("debug/leadscrew"),
            installed,
        })
    }

    fn python(&self) -> PathBuf {
        self.installed.join("venv/bin/python")
    }

    fn install_python(&self) -> Result<(), Failure> {
        let venv = self.installed.join("venv");
        if !venv.exists() {
            shell::run(Command::new("python3").args(["-m", "venv"]).arg(&venv))?;
        }
        let pip = [
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
        ];
        shell::run(Command::new(self.python()).args(pip).args(PYTHON))
    }

    /// Installs beside a copy of the script: Node.js looks for packages there.
    fn install_node(&self) -> Result<(), Failure> {
        let folder = self.installed.join("cncjs");
        fs::create_dir_all(&folder).map_err(Failure::file(&folder))?;
        let script = folder.join("cncjs_stream.js");
        fs::copy(self.scripts.join("cncjs_stream.js"), &script).map_err(Failure::file(&script))?;
        if folder.join("node_modules/cncjs").exists() {
            return Ok(());
        }
        let mut npm = Command::new("npm");
        npm.args(["install", "--no-audit", "--no-fund", "--loglevel=error"]);
        shell::run(npm.args(NODE).current_dir(&folder))
    }

    fn perform(&self, run: &Run) -> Result<(), Failure> {
        let title = format!("{:?} {}", run.sender, run.arguments.join(" "));
        let begun = Instant::now();
        let served = self.serve(run)?;
        let output = self.command(run, &served).output();
        let output = output.map_err(Failure::file(&self.scripts))?;
        if output.status.code() == Some(run.code) {
            let seconds = begun.elapsed().as_secs_f32();
            println!("{title}: as it should, {seconds:.1} s");
            return Ok(());
        }
        print!("{}", String::from_utf8_lossy(&output.stdout));
        Err(Failure::NotDone {
            program: title,
            status: output.status,
            words: String::from_utf8_lossy(&output.stderr).into_owned(),
        })
    }

    fn serve(&self, run: &Run) -> Result<Served, Failure> {
        let link = self.installed.join("port");
        let mut command = Command::new(&self.leadscrew);
        command
            .args(["serve", "--tcp", "127.0.0.1:0", "--pty"])
            .arg(&link);
        command.arg("--machine").arg(self.scripts.join(run.machine));
        command.arg("--state").arg(self.installed.join("state"));
        command.arg("--log").arg(self.installed.join("wire.log"));
        // No settings of an earlier run.
        let _ = fs::remove_file(self.installed.join("state"));
        let spawned = command.stdout(Stdio::piped()).spawn();
        let child = spawned.map_err(Failure::file(&self.leadscrew))?;
        Served::new(child, link).map_err(Failure::file(&self.leadscrew))
    }

    fn command(&self, run: &Run, served: &Served) -> Command {
        let (host, port) = served.address.rsplit_once(':').unwrap_or_default();
        let mut command = match run.sender {
            Sender::MeerK40tOverTcp | Sender::MeerK40tOverPty | Sender::GrblStreamer => {
                Command::new(self.python())
            }
            Sender::Cncjs => Command::new("node"),
        };
        match run.sender {
            Sender::MeerK40tOverTcp => command
                .arg(self.scripts.join("mk_stream.py"))
                .args(["tcp", host, port]),
            Sender::MeerK40tOverPty => command
                .arg(self.scripts.join("mk_stream.py"))
                .arg("serial")
                .arg(&served.link),
            Sender::GrblStreamer => command
                .arg(self.scripts.join("grblstreamer_stream.py"))
                .arg(&served.link),
            Sender::Cncjs => command
                .arg(self.installed.join("cncjs/cncjs_stream.js"))
                .arg(&served.link),
        };
        for argument in run.arguments {
            if argument.ends_with(".nc") {
                command.arg(self.scripts.join("gcode").join(argument));
            } else {
                command.arg(argument);
            }
        }
        command
    }
}

/// A running server; killed when dropped.
struct Served {
    child: Child,
    link: PathBuf,
    address: String,
}

impl Served {
    /// Waits until both lines are ready.
    fn new(mut child: Child, link: PathBuf) -> io::Result<Self> {
        let stdout = child.stdout.take().ok_or(io::ErrorKind::BrokenPipe)?;
        let mut served = Self {
            child,
            link,
            address: String::new(),
        };
        let mut lines = BufReader::new(stdout).lines();
        let mut ready = 0;
        while ready < 2 {
            let line = lines.next().ok_or(io::ErrorKind::UnexpectedEof)??;
            let Some((name, at)) = line.split_once(": ready at ") else {
                return Err(io::Error::other(line));
            };
            ready += 1;
            if name.starts_with("tcp") {
                at.clone_into(&mut served.address);
            }
        }
        // A full pipe would stop the server.
        thread::spawn(move || lines.for_each(drop));
        Ok(served)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // What has ended already needs no end; a link that leads nowhere is replaced by the next server.
        let _ = self.child.kill().and_then(|()| self.child.wait());
    }
}
