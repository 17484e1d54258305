//! QEMU as a process, with two connections besides the serial line: its debugger stub stops the
//! core, and its test protocol reaches the registers.
use crate::bench::{fail, Failure};
use std::{
    env,
    fs::{self, File},
    io::{self, BufRead, BufReader, Read, Write},
    os::unix::net::{UnixListener, UnixStream},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

/// The variable that names another QEMU than the one in the path.
const VARIABLE: &str = "LEADSCREW_QEMU";
/// The first major version that is known to have the core-coupled memory and RCC's registers.
const LEAST: u32 = 10;
/// The longest time that QEMU may take to connect.
const CONNECT: Duration = Duration::from_secs(20);
/// The time that the program may run before the stand-in stops it to see what it waits for.
const SLICE: Duration = Duration::from_millis(50);
/// The program counter's register number in the debugger's protocol.
pub(super) const PC: u8 = 15;

/// The reason why the core has stopped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Stop {
    /// At a place at which the program waits for an event.
    Waits,
    /// Before it reads a watched register.
    Reads,
    /// Before it writes a watched register.
    Writes,
    /// It ran for [`SLICE`] without any of these.
    Runs,
}

/// The process and its connections.
pub(super) struct Qemu {
    child: Child,
    debugger: BufReader<UnixStream>,
    test: BufReader<UnixStream>,
    pub(super) serial: UnixStream,
    log: File,
    folder: PathBuf,
    pub(super) version: String,
}

impl Drop for Qemu {
    fn drop(&mut self) {
        // QEMU does not end by itself; if it has ended, there is nothing to stop. Files left in the
        // folder do no harm.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

impl Qemu {
    /// Starts QEMU, stopped at the first instruction of `elf`. Loads `images` into memory in
    /// addition: address and bytes.
    pub(super) fn start(elf: &[u8], images: &[(u32, Vec<u8>)]) -> Result<Self, Failure> {
        let program = env::var(VARIABLE).unwrap_or_else(|_| "qemu-system-arm".into());
        let version = version(&program)?;
        let folder = env::temp_dir().join(format!("leadscrew-qemu-{}", std::process::id()));
        fs::create_dir_all(&folder)?;
        let socket = |name: &str| {
            let listener = UnixListener::bind(folder.join(name))?;
            listener.set_nonblocking(true)?;
            io::Result::Ok((listener, format!("unix:{}", folder.join(name).display())))
        };
        let (debugger, test, serial) = (socket("debugger")?, socket("test")?, socket("serial")?);
        let log = folder.join("log");
        File::create(&log)?;
        let mut command = Command::new(&program);
        command
            .args(["-M", "netduinoplus2", "-nographic", "-monitor", "none"])
            .args(["-S", "-gdb", &debugger.1, "-qtest", &test.1])
            .args(["-qtest-log", "/dev/null", "-serial", &serial.1])
            .args(["-d", "unimp", "-D"])
            .arg(&log);
        for (address, bytes) in images {
            let path = write(&folder, &format!("{address:x}"), bytes)?;
            let loader = format!("loader,file={path},addr={address:#x},force-raw=on");
            command.args(["-device", &loader]);
        }
        command.args(["-kernel", &write(&folder, "elf", elf)?]);
        let child = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        let mut child = child.map_err(|error| Failure(format!("{program}: {error}")))?;
        // QEMU connects in this order, but a listener would accept any order.
        let mut lines = Vec::new();
        for (listener, _) in [&serial, &debugger, &test] {
            lines.push(accept(listener, &mut child)?);
        }
        let [serial, debugger, test] = <[UnixStream; 3]>::try_from(lines)
            .map_err(|_| Failure("QEMU has not connected".into()))?;
        serial.set_nonblocking(true)?;
        Ok(Qemu {
            child,
            debugger: BufReader::new(debugger),
            test: BufReader::new(test),
            serial,
            log: File::open(&log)?,
            folder,
            version,
        })
    }

    /// Lets the program run until something stops it.
    pub(super) fn go(&mut self) -> Result<Stop, Failure> {
        self.packet("c")?;
        self.debugger.get_ref().set_read_timeout(Some(SLICE))?;
        let reply = self.reply();
        self.debugger.get_ref().set_read_timeout(None)?;
        let reply = match reply {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                self.debugger.get_mut().write_all(&[3])?;
                self.reply()?
            }
            reply => reply?,
        };
        Ok(match reply {
            reply if reply.contains("rwatch:") => Stop::Reads,
            reply if reply.contains("watch:") => Stop::Writes,
            reply if reply.starts_with("T05") => Stop::Waits,
            reply if reply.starts_with("T02") => Stop::Runs,
            reply => return fail(format!("the core has stopped with {reply:?}")),
        })
    }

    /// Sets a breakpoint or watchpoint in the form of the debugger's protocol: `Z1,address,size`.
    pub(super) fn stop_at(&mut self, stop: &str) -> Result<(), Failure> {
        match self.debug(stop)?.as_str() {
            "OK" => Ok(()),
            other => fail(format!("{stop}: {other:?}")),
        }
    }

    /// The value of a core register.
    pub(super) fn core(&mut self, number: u8) -> Result<u32, Failure> {
        let word = self.debug(&format!("p{number:x}"))?;
        Ok(u32::from_str_radix(&word, 16)?.swap_bytes())
    }

    /// Sets a register of the core.
    pub(super) fn set_core(&mut self, number: u8, value: u32) -> Result<(), Failure> {
        self.stop_at(&format!("P{number:x}={:08x}", value.swap_bytes()))
    }

    /// The word at an address, which may be a register of a peripheral.
    pub(super) fn word(&mut self, address: u32) -> Result<u32, Failure> {
        let answer = self.ask(&format!("readl {address:#x}"))?;
        Ok(
            u32::from_str_radix(answer.trim_start_matches("0x").trim_start_matches('0'), 16)
                .unwrap_or(0),
        )
    }

    /// Sets a word at an address.
    pub(super) fn set_word(&mut self, address: u32, word: u32) -> Result<(), Failure> {
        self.ask(&format!("writel {address:#x} {word:#x}"))
            .map(drop)
    }

    /// Sets a half-word at an address.
    pub(super) fn set_half(&mut self, address: u32, half: u16) -> Result<(), Failure> {
        self.ask(&format!("writew {address:#x} {half:#x}"))
            .map(drop)
    }

    /// A byte at an address.
    pub(super) fn byte(&mut self, address: u32) -> Result<u8, Failure> {
        let word = self.word(address & !3)?;
        Ok(word.to_le_bytes()[(address & 3) as usize])
    }

    /// The lines of the log since the last call: every access to a peripheral that QEMU does not
    /// have.
    pub(super) fn log(&mut self) -> Result<String, Failure> {
        let mut text = String::new();
        self.log.read_to_string(&mut text)?;
        Ok(text)
    }

    fn ask(&mut self, question: &str) -> Result<String, Failure> {
        writeln!(self.test.get_mut(), "{question}")?;
        let mut line = String::new();
        self.test.read_line(&mut line)?;
        match line.trim_end().strip_prefix("OK") {
            Some(answer) => Ok(answer.trim().to_owned()),
            None => fail(format!("{question}: QEMU answers {line:?}")),
        }
    }

    fn debug(&mut self, packet: &str) -> Result<String, Failure> {
        self.packet(packet)?;
        Ok(self.reply()?)
    }

    fn packet(&mut self, packet: &str) -> io::Result<()> {
        let sum = packet.bytes().fold(0u8, u8::wrapping_add);
        write!(self.debugger.get_mut(), "${packet}#{sum:02x}")
    }

    /// The text of a packet, between `$` and `#`; a checksum follows it. Acknowledges the packet.
    fn reply(&mut self) -> io::Result<String> {
        let mut text = Vec::new();
        // Acknowledgements come before the packet. If the time is over here, no part of the reply
        // has come.
        self.debugger.skip_until(b'$')?;
        self.debugger.read_until(b'#', &mut text)?;
        self.debugger.read_exact(&mut [0; 2])?;
        self.debugger.get_mut().write_all(b"+")?;
        text.pop();
        Ok(String::from_utf8_lossy(&text).into_owned())
    }
}

fn write(folder: &Path, name: &str, bytes: &[u8]) -> Result<String, Failure> {
    let path = folder.join(name);
    fs::write(&path, bytes)?;
    Ok(path.display().to_string())
}

/// The first line of `--version`, if this QEMU is new enough.
fn version(program: &str) -> Result<String, Failure> {
    let output = Command::new(program).arg("--version").output();
    let output = output.map_err(|error| Failure(format!("{program}: {error}")))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().next().unwrap_or_default();
    match major(line) {
        Some(LEAST..) => Ok(line.to_owned()),
        _ => fail(format!(
            "{program} is {line:?}; QEMU {LEAST} or later has the F405's memory (Debian 12: \
             bookworm-backports), and {VARIABLE} names it where it is not in the path"
        )),
    }
}

/// The major version: 10 from `QEMU emulator version 10.0.2 (Debian ...)`.
fn major(line: &str) -> Option<u32> {
    let number = line.strip_prefix("QEMU emulator version ")?;
    number.split('.').next()?.parse().ok()
}

fn accept(listener: &UnixListener, child: &mut Child) -> Result<UnixStream, Failure> {
    let begin = Instant::now();
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false)?;
                return Ok(stream);
            }
            Err(error) if error.kind() != io::ErrorKind::WouldBlock => return Err(error.into()),
            Err(_) => thread::sleep(Duration::from_millis(5)),
        }
        if let Some(status) = child.try_wait()? {
            return fail(format!("QEMU has ended: {status}"));
        }
        if begin.elapsed() > CONNECT {
            return fail("QEMU does not connect");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_read_from_what_qemu_says() {
        let line = "QEMU emulator version 10.0.2 (Debian 1:10.0.2+ds-2+deb13u1~bpo12+1)";
        assert_eq!(major(line), Some(10));
        assert_eq!(major("QEMU emulator version 7.2.22"), Some(7));
        assert_eq!(major("emulator 7"), None);
    }
}
