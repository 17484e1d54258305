//! The folders in which senders are installed, and the start of senders and server.

use super::observer::Observer;
use super::runs::{Run, Sender};
use super::wire::Wire;
use crate::{failure::Failure, shell};
use std::{
    fs, io,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// The number of lines of the server: a pty, two for TCP, a WebSocket.
const LINES: usize = 4;

/// The observer's line, under another host name than the senders'.
const OBSERVERS: &str = "localhost:0";

/// The folders and the program.
pub(super) struct Place {
    /// The folder `tests/senders`.
    scripts: PathBuf,
    /// The folder `target/senders`.
    installed: PathBuf,
    /// The program under test.
    leadscrew: PathBuf,
}

impl Place {
    /// Finds the folders, and makes those that are missing.
    pub(super) fn new() -> Result<Self, Failure> {
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

    /// Installs the Python packages.
    pub(super) fn install_python(&self) -> Result<(), Failure> {
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
        let install = |options: &[&str], name: &str| {
            let mut command = Command::new(self.python());
            let list = self.scripts.join(name);
            shell::run(command.args(pip).args(options).arg("-r").arg(list))
        };
        install(&[], "requirements.txt")?;
        // bCNC would also install OpenCV, for a camera.
        install(&["--no-deps"], "requirements-bcnc.txt")
    }

    /// Installs the Node.js packages and their dependencies in the versions of `package-lock.json`.
    /// They are installed beside a copy of the script, because Node.js looks for packages there.
    pub(super) fn install_node(&self) -> Result<(), Failure> {
        let folder = self.installed.join("cncjs");
        fs::create_dir_all(&folder).map_err(Failure::file(&folder))?;
        let lock = folder.join("package-lock.json");
        let before = fs::read(&lock).ok();
        for name in ["cncjs_stream.js", "package.json", "package-lock.json"] {
            let from = self.scripts.join(name);
            fs::copy(&from, folder.join(name)).map_err(Failure::file(&from))?;
        }
        let installed = folder.join("node_modules/.package-lock.json").exists();
        if installed && before == fs::read(&lock).ok() {
            return Ok(());
        }
        let mut npm = Command::new("npm");
        npm.args(["ci", "--no-audit", "--no-fund", "--loglevel=error"]);
        shell::run(npm.current_dir(&folder))
    }

    /// Runs the job of a sender, and checks the result.
    ///
    /// # Errors
    /// When the job did not end as it should.
    pub(super) fn perform(&self, run: &Run) -> Result<(), Failure> {
        let title = format!("{:?} {}", run.sender, run.arguments.join(" "));
        let begun = Instant::now();
        let served = self.serve(run)?;
        let observer = Observer::start(&served.for_observer)?;
        let output = self.command(run, &served).output();
        let output = output.map_err(Failure::file(&self.scripts))?;
        let rest = observer.finish()?;
        // The server writes the log to its file ten times a second.
        thread::sleep(Duration::from_millis(300));
        let log = self.installed.join("wire.log");
        let text = fs::read_to_string(&log).map_err(Failure::file(&log))?;
        let wire = Wire::read(&text, run.sender.line());
        let mut faults: Vec<String> = (run.checks.iter())
            .filter_map(|check| check.fault(&wire, &rest))
            .collect();
        if output.status.code() != Some(run.code) {
            faults.insert(0, format!("{}, not {}", output.status, run.code));
        }
        if faults.is_empty() {
            let seconds = begun.elapsed().as_secs_f32();
            println!("{title}: as it should, {seconds:.1} s");
            return Ok(());
        }
        print!("{}", String::from_utf8_lossy(&output.stdout));
        eprint!("{}", String::from_utf8_lossy(&output.stderr));
        self.keep_log(&log, &text)?;
        Err(Failure::finding(format!("{title}: {}", faults.join("; "))))
    }

    /// Keeps the wire log of a run that has failed, which the next run would overwrite, and prints
    /// its end.
    fn keep_log(&self, log: &Path, text: &str) -> Result<(), Failure> {
        const ROWS: usize = 60;
        let kept = self.installed.join("failed.log");
        fs::rename(log, &kept).map_err(Failure::file(&kept))?;
        println!("the last rows of {}:", kept.display());
        let rows = text.lines().count();
        for row in text.lines().skip(rows.saturating_sub(ROWS)) {
            println!("{row}");
        }
        Ok(())
    }

    fn serve(&self, run: &Run) -> Result<Served, Failure> {
        let link = self.installed.join("port");
        let mut command = Command::new(&self.leadscrew);
        command
            .args(["serve", "--tcp", "127.0.0.1:0", "--tcp", OBSERVERS])
            .args(["--ws", "127.0.0.1:0", "--pty"])
            .arg(&link);
        command.arg("--machine").arg(self.scripts.join(run.machine));
        command.arg("--state").arg(self.installed.join("state"));
        command.arg("--log").arg(self.installed.join("wire.log"));
        // Removes the settings of an earlier run.
        let _ = fs::remove_file(self.installed.join("state"));
        let spawned = command.stdout(Stdio::piped()).spawn();
        let child = spawned.map_err(Failure::file(&self.leadscrew))?;
        Served::new(child, link).map_err(Failure::file(&self.leadscrew))
    }

    fn command(&self, run: &Run, served: &Served) -> Command {
        let (host, port) = served.tcp.rsplit_once(':').unwrap_or_default();
        let mut command = match run.sender {
            Sender::MeerK40tOverTcp
            | Sender::MeerK40tOverPty
            | Sender::GrblStreamer
            | Sender::Websockets
            | Sender::Bcnc => Command::new(self.python()),
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
            Sender::Bcnc => command
                .arg(self.scripts.join("bcnc_stream.py"))
                .arg(&served.link),
            Sender::Websockets => command
                .arg(self.scripts.join("websockets_stream.py"))
                .arg(&served.ws),
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
    tcp: String,
    for_observer: String,
    /// The WebSocket's URL.
    ws: String,
}

impl Served {
    /// Waits until all lines are ready.
    fn new(mut child: Child, link: PathBuf) -> io::Result<Self> {
        let stdout = child.stdout.take().ok_or(io::ErrorKind::BrokenPipe)?;
        let mut lines = BufReader::new(stdout).lines();
        let mut served = Self {
            child,
            link,
            tcp: String::new(),
            for_observer: String::new(),
            ws: String::new(),
        };
        let mut ready = 0;
        while ready < LINES {
            let line = lines.next().ok_or(io::ErrorKind::UnexpectedEof)??;
            if line.starts_with("page: ") {
                continue;
            }
            let (name, at) = (line.split_once(": ready at ")).ok_or(io::Error::other(&*line))?;
            ready += 1;
            if name.starts_with("ws") {
                served.ws = format!("ws://{at}/");
            } else if name.ends_with(OBSERVERS) {
                at.clone_into(&mut served.for_observer);
            } else if name.starts_with("tcp") {
                at.clone_into(&mut served.tcp);
            }
        }
        // Keep reading: a full pipe would stop the server.
        thread::spawn(move || lines.for_each(drop));
        Ok(served)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // If the program has ended already, there is nothing to stop. The next server replaces a
        // link that leads nowhere.
        let _ = self.child.kill().and_then(|()| self.child.wait());
    }
}
