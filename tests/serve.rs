//! Clients of `serve` in real time: jobs streamed by character counting over TCP and a pty, with polls in between.

use leadscrew_sim::profile::Profile;
use leadscrew_sim::serve::{
    serve, Key, LineSpec, Note, Panel, Service, Snapshot, StateFile, Surroundings,
};
use leadscrew_sim::Rate;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Bytes that a sender has on the way at most, as Grbl's senders count.
const WINDOW: usize = 128;

/// How often a sender asks for a report.
const POLL: Duration = Duration::from_millis(40);

const PATIENCE: Duration = Duration::from_secs(60);

/// How long a message that is on its way may take.
const SOON: Duration = Duration::from_secs(2);

/// Passes all messages on.
struct Ear(Sender<String>);

impl Panel for Ear {
    fn note(&mut self, note: &Note<'_>) {
        // The test may have heard enough.
        let _ = self.0.send(note.to_string());
    }
    fn show(&mut self, _: &Snapshot) {}
    fn key(&mut self) -> Option<Key> {
        None
    }
}

/// A server in a thread of its own; ends when dropped.
struct Served {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// Where the lines are.
    ready: Vec<String>,
    /// What else was said until all lines were ready.
    said: Vec<String>,
    /// What is said from then on.
    heard: Receiver<String>,
}

impl Served {
    fn new(profile: &str, lines: Vec<LineSpec>, speed: f64) -> Self {
        Self::start(Service {
            profile: Profile::parse(Path::new("test.toml"), profile).unwrap(),
            rate: Rate::NeverWaits,
            speed,
            state: None,
            log: None,
            lines,
        })
    }

    fn start(service: Service) -> Self {
        let (told, heard) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let count = service.lines.len();
        let end = stop.clone();
        let thread = std::thread::spawn(move || {
            let begun = Instant::now();
            let clock = || begun.elapsed();
            let panel = &mut Ear(told);
            serve(
                service,
                Surroundings {
                    clock: &clock,
                    stop: &end,
                    panel,
                },
            );
        });
        let mut served = Self {
            stop,
            thread: Some(thread),
            ready: Vec::new(),
            said: Vec::new(),
            heard,
        };
        while served.ready.len() < count {
            let note = served.heard.recv_timeout(PATIENCE).unwrap();
            match note.split_once(": ready at ") {
                Some((_, at)) => served.ready.push(at.into()),
                None => served.said.push(note),
            }
        }
        served
    }

    /// Serves a machine whose settings survive in `file`.
    fn remembering(file: &Path) -> Self {
        Self::start(Service {
            profile: Profile::parse(Path::new("test.toml"), FAST).unwrap(),
            rate: Rate::NeverWaits,
            speed: 1.0,
            state: Some(StateFile::new(file.into())),
            log: None,
            lines: vec![LineSpec::Tcp("127.0.0.1:0".into())],
        })
    }

    fn tcp(profile: &str, speed: f64) -> Self {
        Self::new(profile, vec![LineSpec::Tcp("127.0.0.1:0".into())], speed)
    }

    fn connect(&self) -> Client {
        let stream = TcpStream::connect(&self.ready[0]).unwrap();
        stream.set_nodelay(true).unwrap();
        Client::new(stream.try_clone().unwrap(), stream)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(
                ended.is_ok() || std::thread::panicking(),
                "the server has panicked"
            );
        }
    }
}

/// A program at the other end of a line.
struct Client {
    to: Box<dyn Write>,
    lines: Receiver<String>,
    reports: Vec<String>,
}

impl Client {
    fn new(from: impl Read + Send + 'static, to: impl Write + 'static) -> Self {
        let (line_in, lines) = mpsc::channel();
        std::thread::spawn(move || {
            for line in BufReader::new(from).lines().map_while(Result::ok) {
                if line_in.send(line).is_err() {
                    return;
                }
            }
        });
        Self {
            to: Box::new(to),
            lines,
            reports: Vec::new(),
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        self.to.write_all(bytes).unwrap();
        self.to.flush().unwrap();
    }

    /// The next line that is neither empty nor a report; `None` when none comes in time.
    fn hear(&mut self, patience: Duration) -> Option<String> {
        let until = Instant::now() + patience;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                Ok(line) if line.is_empty() => {}
                Ok(line) if line.starts_with('<') => {
                    assert!(line.ends_with('>'), "{line}");
                    self.reports.push(line);
                }
                Ok(line) => return Some(line),
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => panic!("the server has hung up"),
            }
        }
    }

    fn expect(&mut self, expected: &str) {
        assert_eq!(self.hear(PATIENCE).as_deref(), Some(expected));
    }

    fn ask(&mut self) -> String {
        self.send(b"?");
        let heard = self.reports.len();
        let until = Instant::now() + PATIENCE;
        while self.reports.len() == heard {
            assert!(Instant::now() < until, "no report");
            assert_eq!(self.hear(Duration::from_millis(2)), None);
        }
        self.reports[heard].clone()
    }

    /// What is heard before the `ok` to a line.
    fn say(&mut self, line: &str) -> Vec<String> {
        self.send(format!("{line}\n").as_bytes());
        std::iter::from_fn(|| self.hear(PATIENCE).filter(|heard| heard != "ok")).collect()
    }

    /// The row of `$$` for a setting.
    fn setting(&mut self, name: &str) -> Option<String> {
        let begins = format!("{name}=");
        let mut rows = self.say("$$").into_iter();
        rows.rfind(|row| row.starts_with(&begins))
    }

    fn wait_for(&mut self, state: &str) -> String {
        let until = Instant::now() + PATIENCE;
        loop {
            let report = self.ask();
            if report.starts_with(&format!("<{state}|")) {
                return report;
            }
            assert!(Instant::now() < until, "no {state}, but {report}");
        }
    }

    /// Streams a job by character counting and asks for reports all the while.
    fn stream(&mut self, job: &str) {
        let mut waiting: VecDeque<&str> = job.lines().collect();
        let mut on_the_way: VecDeque<&str> = VecDeque::new();
        let mut next_poll = Instant::now();
        while !(waiting.is_empty() && on_the_way.is_empty()) {
            let used: usize = on_the_way.iter().map(|line| line.len() + 1).sum();
            match waiting.front() {
                Some(line) if used + line.len() < WINDOW => {
                    self.send(format!("{line}\n").as_bytes());
                    on_the_way.extend(waiting.pop_front());
                    continue;
                }
                Some(_) | None => {}
            }
            if Instant::now() >= next_poll {
                self.send(b"?");
                next_poll += POLL;
            }
            match self.hear(POLL / 4).as_deref() {
                None => {}
                Some("ok") => assert!(on_the_way.pop_front().is_some(), "an ok too many"),
                Some(message) if message.starts_with('[') => {}
                Some(answer) => panic!("{answer} to {:?}", on_the_way.front()),
            }
        }
        assert_eq!(self.hear(POLL), None);
    }
}

const FAST: &str = "[settings]\n\"$110\"=6000\n\"$111\"=6000\n\"$112\"=3000\n\"$120\"=800\n\"$121\"=800\n\"$122\"=800\n";

fn example(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    std::fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn a_job_streamed_over_tcp_ends_where_it_should() {
    let served = Served::tcp(FAST, 20.0);
    let mut client = served.connect();
    client.send(b"\x18");
    client.expect("Grbl 1.1h ['$' for help]");
    client.stream(&example("heart.nc"));
    client.send(b"G90 G0 X12.5 Y-3.2 Z1\n");
    client.expect("ok");
    let report = client.wait_for("Idle");
    assert!(report.contains("|MPos:12.500,-3.200,1.000|"), "{report}");
    let running = client
        .reports
        .iter()
        .filter(|report| report.starts_with("<Run|"));
    assert!(running.count() > 5, "{:?}", client.reports);
}

#[cfg(unix)]
#[test]
fn a_job_streamed_over_a_pty_ends_where_it_should() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("ttyGRBL");
    let spec = LineSpec::Pty {
        link: link.clone(),
        reset_on_open: true,
    };
    let _served = Served::new(FAST, vec![spec], 20.0);
    let port = || {
        std::fs::OpenOptions::new()
            .read(true)
            .write(true)
            .open(&link)
            .unwrap()
    };
    let (from, to) = (port(), port());
    let mut client = Client::new(from, to);
    client.expect("Grbl 1.1h ['$' for help]");
    client.stream(&example("pocket.nc"));
    client.send(b"G90 G0 X0 Y0 Z0\n");
    client.expect("ok");
    let report = client.wait_for("Idle");
    assert!(report.contains("|MPos:0.000,0.000,0.000|"), "{report}");
}

#[test]
fn a_client_that_vanishes_in_mid_line_leaves_no_trace_for_the_next() {
    let served = Served::tcp(FAST, 1.0);
    let mut first = TcpStream::connect(&served.ready[0]).unwrap();
    first.write_all(b"G0X1\nG0X99").unwrap();
    let mut answer = [0; 4];
    first.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"ok\r\n");
    drop(first);
    let mut second = served.connect();
    second.send(b"G0X2\n");
    second.expect("ok");
    let report = second.wait_for("Idle");
    assert!(report.contains("|MPos:2.000,0.000,0.000|"), "{report}");
}

#[test]
fn a_flood_costs_its_sender_only() {
    let tcp = || LineSpec::Tcp("127.0.0.1:0".into());
    let served = Served::new(FAST, vec![tcp(), tcp()], 1.0);
    let mut flood = TcpStream::connect(&served.ready[0]).unwrap();
    let stream = TcpStream::connect(&served.ready[1]).unwrap();
    let mut client = Client::new(stream.try_clone().unwrap(), stream);
    flood
        .set_write_timeout(Some(Duration::from_millis(100)))
        .unwrap();
    let until = Instant::now() + Duration::from_secs(2);
    while Instant::now() < until {
        // What does not fit any more may fail.
        let _ = flood.write_all(&[b'X'; 4096]);
        client.ask();
    }
    drop(flood);
    client.wait_for("Idle");
}

#[test]
fn a_sender_that_does_not_count_is_named_once_when_bytes_are_lost() {
    let served = Served::tcp(FAST, 1.0);
    let mut client = served.connect();
    // The machine takes nothing for a second; its buffer is smaller than what follows.
    client.send(b"G4 P1\n");
    for _ in 0..2 {
        client.send(&[b'X'; 4096]);
        client.send(b"\n");
    }
    let said = |text: &str| text.contains("more than the receive buffer holds");
    let heard: Vec<String> = std::iter::from_fn(|| served.heard.recv_timeout(SOON).ok()).collect();
    assert_eq!(
        heard.iter().filter(|text| said(text)).count(),
        1,
        "{heard:?}"
    );
}

#[test]
fn an_answer_to_a_realtime_byte_takes_no_longer_than_a_loop_of_the_server() {
    let served = Served::tcp(FAST, 1.0);
    let mut client = served.connect();
    let mut times: Vec<Duration> = (0..50)
        .map(|_| {
            let begun = Instant::now();
            client.ask();
            begun.elapsed()
        })
        .collect();
    times.sort();
    assert!(times[25] < Duration::from_millis(20), "{times:?}");
}

#[test]
fn what_was_stored_survives_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("router.state");
    {
        let served = Served::remembering(&file);
        assert_eq!(served.said, [""; 0]);
        let mut client = served.connect();
        assert_eq!(client.setting("$110").as_deref(), Some("$110=6000.000"));
        for line in ["$110=4321.5", "$N0=G20", "G10 L2 P2 X5.25"] {
            assert_eq!(client.say(line), [""; 0]);
        }
    }
    let served = Served::remembering(&file);
    assert_eq!(served.said, [""; 0]);
    let mut client = served.connect();
    assert_eq!(client.setting("$110").as_deref(), Some("$110=4321.500"));
    assert_eq!(client.setting("$111").as_deref(), Some("$111=6000.000"));
    assert_eq!(client.say("$N"), ["$N0=G20", "$N1="]);
    assert_eq!(client.say("$#")[1], "[G55:5.250,0.000,0.000]");
}

#[test]
fn a_state_file_belongs_to_one_program_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("router.state");
    {
        let first = Served::remembering(&file);
        let second = Served::remembering(&file);
        assert!(second.said[0].contains("in use"), "{:?}", second.said);
        assert_eq!(second.connect().say("$110=1"), [""; 0]);
        assert_eq!(first.connect().say("$111=4321"), [""; 0]);
    }
    let third = Served::remembering(&file);
    assert_eq!(third.said, [""; 0]);
    let mut client = third.connect();
    assert_eq!(client.setting("$110").as_deref(), Some("$110=6000.000"));
    assert_eq!(client.setting("$111").as_deref(), Some("$111=4321.000"));
}

#[test]
fn a_state_file_that_cannot_be_used_is_kept_aside_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("router.state");
    Served::remembering(&file).connect().say("$110=4321.5");
    let sound = std::fs::read(&file).unwrap();
    let mut other_version = sound.clone();
    other_version[15] += 1;
    let half = sound[..sound.len() / 2].to_vec();
    let table: [(&[u8], &str); 3] = [
        (&half, "is cut short"),
        (&other_version, "has version 2, not 1"),
        (b"$110=4321.5\n", "is no state file"),
    ];
    for (count, (bytes, fault)) in (1..).zip(table) {
        std::fs::write(&file, bytes).unwrap();
        let served = Served::remembering(&file);
        let [said] = &served.said[..] else {
            panic!("{:?}", served.said)
        };
        let kept = folder.path().join(format!("router.state.kept-{count}"));
        assert!(said.contains(fault), "{said}");
        let told = format!("kept as {}, defaults loaded", kept.display());
        assert!(said.ends_with(&told), "{said}");
        assert_eq!(std::fs::read(kept).unwrap(), bytes);
        let mut client = served.connect();
        assert_eq!(client.setting("$110").as_deref(), Some("$110=6000.000"));
    }
}

#[test]
fn settings_whose_record_is_damaged_are_said_to_be_lost() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("router.state");
    Served::remembering(&file).connect().say("$110=4321.5");
    let mut damaged = std::fs::read(&file).unwrap();
    let last = damaged.iter().rposition(|&byte| byte != 0xFF).unwrap();
    damaged[last] ^= 1;
    std::fs::write(&file, &damaged).unwrap();
    let served = Served::remembering(&file);
    let kept = folder.path().join("router.state.kept-1");
    let told = format!("the file as it was is kept as {}", kept.display());
    assert_eq!(served.said.len(), 1, "{:?}", served.said);
    assert!(served.said[0].ends_with(&told), "{:?}", served.said);
    assert_eq!(std::fs::read(kept).unwrap(), damaged);
    let mut client = served.connect();
    assert_eq!(client.setting("$110").as_deref(), Some("$110=6000.000"));
}

/// A gantry that is square at power-up, and whose second switch closes `apart` mm below the first.
fn gantry(apart: f64, squaring: &str) -> String {
    format!(
        "homing = [\"y\"]\n[settings]\n\"$22\"=1\n\"$23\"=2\n\"$24\"=300\n\"$25\"=3000\n\"$26\"=10\n\"$27\"=2\n\
         \"$111\"=3000\n\"$121\"=500\n[axes.y]\nsteps_per_mm = 100\ntravel = 80\nstart = 10\nlimits = {{ low = 0 }}\n\
         [second_motor]\naxis = \"y\"\nstart = 10\nlimits = {{ low = -{apart} }}\n{squaring}\n"
    )
}

/// 5 % of the travel are 4 mm.
#[test]
fn a_gantry_is_squared_or_refused_as_its_profile_says() {
    let table = [
        (3.9, "", true),
        (4.2, "", false),
        (3.9, "squaring = { most = 3 }", false),
        (4.2, "squaring = { tolerance = 0.1 }", true),
        (4.2, "squaring = { least = 5 }", true),
    ];
    for (apart, squaring, is_square) in table {
        let served = Served::tcp(&gantry(apart, squaring), 20.0);
        let mut client = served.connect();
        let heard = client.say("$H");
        let alarm = heard.iter().any(|line| line == "ALARM:10");
        assert_eq!(alarm, !is_square, "{apart} mm, {squaring}: {heard:?}");
        if alarm {
            client.expect("Grbl 1.1h ['$' for help]");
            client.expect("[MSG:'$H'|'$X' to unlock]");
        }
        let report = client.wait_for(if is_square { "Idle" } else { "Alarm" });
        let home = report.contains("|MPos:0.000,-78.000,0.000|");
        assert_eq!(home, is_square, "{apart} mm, {squaring}: {report}");
        let build = client.say("$I");
        assert!(build[1].starts_with("[OPT:V2,"), "{build:?}");
    }
}

#[test]
fn crossed_belts_home_and_move_as_their_profile_says() {
    let belts = "kinematics = \"corexy\"\nhoming = [\"xy\"]\n[settings]\n\"$22\"=1\n\"$23\"=3\n\"$24\"=300\n\"$25\"=3000\n\
                 \"$26\"=10\n\"$27\"=2\n\"$110\"=3000\n\"$111\"=3000\n\"$120\"=500\n\"$121\"=500\n\
                 [axes.x]\nsteps_per_mm = 100\ntravel = 80\nstart = 10\nlimits = { low = 0 }\n\
                 [axes.y]\nsteps_per_mm = 100\ntravel = 60\nstart = 20\nlimits = { low = 0 }\n";
    let served = Served::tcp(belts, 20.0);
    let mut client = served.connect();
    assert_eq!(client.say("$H"), [""; 0]);
    let report = client.wait_for("Idle");
    assert!(report.contains("|MPos:-78.000,-58.000,0.000|"), "{report}");
    let build = client.say("$I");
    assert!(build[1].starts_with("[OPT:VC,"), "{build:?}");
    assert_eq!(client.say("$J=G91X5.5Y-1F2000"), [""; 0]);
    let report = client.wait_for("Idle");
    assert!(report.contains("|MPos:-72.500,-59.000,0.000|"), "{report}");
}
