//! Tests of `serve` as a process of its own, also when its output is not read.

use crate::program::interrupt;
use std::io::{pipe, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_secs(30);

/// A process that is ended with the test.
struct Process(Child);

impl Process {
    /// Asks the process to end, as Ctrl-C does, and waits until it has ended.
    fn interrupt(&mut self) -> Option<i32> {
        interrupt(self.0.id());
        let until = Instant::now() + PATIENCE;
        loop {
            match self.0.try_wait().unwrap() {
                Some(status) => return status.code(),
                None => assert!(Instant::now() < until, "it does not end"),
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn connect(address: &str) -> TcpStream {
    let until = Instant::now() + PATIENCE;
    loop {
        match TcpStream::connect(address) {
            Ok(stream) => return stream,
            Err(error) => assert!(Instant::now() < until, "{error}"),
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A pipe that is full, so that writing to it blocks.
fn full_pipe() -> (std::io::PipeReader, std::io::PipeWriter) {
    let (unread, to) = pipe().unwrap();
    let mut more = to.try_clone().unwrap();
    let written = Arc::new(AtomicUsize::new(0));
    let count = written.clone();
    std::thread::spawn(move || {
        while more.write_all(&[b'x'; 512]).is_ok() {
            count.fetch_add(512, Ordering::Relaxed);
        }
    });
    let mut before = usize::MAX;
    while before != written.load(Ordering::Relaxed) {
        before = written.load(Ordering::Relaxed);
        std::thread::sleep(Duration::from_millis(200));
    }
    assert!(before > 0);
    (unread, to)
}

#[cfg(unix)]
#[test]
fn a_machine_whose_messages_nobody_reads_answers_is_reset_and_ends() {
    let folder = tempfile::tempdir().unwrap();
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = free.local_addr().unwrap().to_string();
    drop(free);
    let (_unread, to) = full_pipe();
    let mut serve = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
    serve
        .args(["serve", "--tcp", &address, "--state"])
        .arg(folder.path().join("state"));
    let serve = serve.stdin(Stdio::null()).stdout(to).spawn().unwrap();
    let mut serve = Process(serve);
    let mut client = connect(&address);
    client.set_read_timeout(Some(PATIENCE)).unwrap();
    client.write_all(b"\x18?").unwrap();
    let mut heard = String::new();
    while !(heard.contains("Grbl 1.1h") && heard.contains("<Idle|")) {
        let mut chunk = [0; 512];
        let count = client.read(&mut chunk).unwrap();
        assert!(count > 0, "{heard}");
        heard += std::str::from_utf8(&chunk[..count]).unwrap();
    }
    assert_eq!(serve.interrupt(), Some(0));
}
