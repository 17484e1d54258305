//! Clients that vanish, flood the line, do not count bytes, or ask for reports.

use crate::client::Client;
use crate::served::{one_line, Served, FAST};
use leadscrew_serve::{LineSpec, Service, WireLog};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The time that a message that has been sent may take.
const SOON: Duration = Duration::from_secs(2);

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

/// When a client vanishes, M5 takes effect at once, without the dead-man's time-out (`$707`) that
/// waits for a silent sender. So the next client's moves do not burn.
#[test]
fn a_client_that_vanishes_leaves_no_laser_on() {
    let served = Served::tcp(FAST, 1.0);
    let mut first = TcpStream::connect(&served.ready[0]).unwrap();
    first.write_all(b"$32=1\nM3S500\nG1X1F6000\n").unwrap();
    let mut answers = [0; 12];
    first.read_exact(&mut answers).unwrap();
    assert_eq!(&answers, b"ok\r\nok\r\nok\r\n");
    drop(first);
    let mut second = served.connect();
    let report = second.wait_for("Idle");
    assert!(report.contains("|FS:0,0"), "{report}");
    let modes = second.say("$G").concat();
    assert!(modes.contains(" M5 "), "{modes}");
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
        // Writing may fail: there may be no room for the bytes.
        let _ = flood.write_all(&[b'X'; 4096]);
        client.ask();
    }
    drop(flood);
    client.wait_for("Idle");
}

/// Counted by the log, however slow the computer is: between a byte of one line and its effect, a
/// line that floods the machine brings no more than its share of the turn at hand and of the next.
#[test]
fn a_flood_of_realtime_bytes_delays_another_line_by_two_turns() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wire.log");
    let tcp = || LineSpec::Tcp("127.0.0.1:0".into());
    let served = Served::start(Service {
        log: Some(WireLog::new(std::fs::File::create(&file).unwrap())),
        lines: vec![tcp(), tcp()],
        ..one_line()
    });
    let mut flood = TcpStream::connect(&served.ready[0]).unwrap();
    let mut unread = flood.try_clone().unwrap();
    let reading =
        std::thread::spawn(
            move || while unread.read(&mut [0; 65536]).is_ok_and(|count| count > 0) {},
        );
    let writing =
        std::thread::spawn(move || while flood.write_all(&[b'?', 0x91].repeat(2048)).is_ok() {});
    let stream = TcpStream::connect(&served.ready[1]).unwrap();
    let mut client = Client::new(stream.try_clone().unwrap(), stream);
    for _ in 0..10 {
        assert_eq!(client.say("G91 G1 X0.5 F600"), [""; 0]);
        client.send(b"!");
        client.wait_for("Hold:0");
        client.send(b"~");
        client.wait_for("Idle");
    }
    drop((client, served));
    reading.join().unwrap();
    writing.join().unwrap();
    let (mut since, mut holds) = (0, 0);
    for row in std::fs::read_to_string(file).unwrap().lines() {
        let (_, what) = row.trim().split_once(' ').unwrap();
        match what {
            "1 < ?" => since = 0,
            "0 > ok" => {}
            what if what.starts_with("0 > <") => since += 1,
            what if what.starts_with("1 > <") => {
                holds += 1;
                assert!(since <= 2 * 256, "{since} answers to the flood came first");
            }
            _ => {}
        }
    }
    assert!(holds >= 20, "{holds}");
}

#[test]
fn a_sender_that_does_not_count_is_named_once_when_bytes_are_lost() {
    let served = Served::tcp(FAST, 1.0);
    let mut client = served.connect();
    // The machine takes no bytes for a second; its buffer is smaller than the flood that follows.
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

/// Measured in simulated time, by the log: a turn of the server is at most 2 ms, however slow the
/// computer is.
#[test]
fn an_answer_to_a_realtime_byte_takes_no_longer_than_a_turn_of_the_server() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wire.log");
    let log = WireLog::new(std::fs::File::create(&file).unwrap());
    {
        let served = Served::start(Service {
            log: Some(log),
            ..one_line()
        });
        let mut client = served.connect();
        (0..50).for_each(|_| drop(client.ask()));
    }
    let log = std::fs::read_to_string(file).unwrap();
    let (mut asked, mut longest) = (Vec::new(), 0.0f64);
    for row in log.lines() {
        let (time, what) = row.split_once(" 0 ").unwrap();
        let time: f64 = time.trim().parse().unwrap();
        match what {
            "< ?" => asked.push(time),
            what if what.starts_with("> <Idle|") => {
                longest = longest.max(time - asked.last().unwrap());
            }
            _ => {}
        }
    }
    assert_eq!(asked.len(), 50);
    assert!(longest < 0.002_002, "{longest} s");
}
