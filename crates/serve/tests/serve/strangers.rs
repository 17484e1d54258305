//! Clients that may drive the machine, and others that may not: web pages, clients that send
//! nothing, clients that are gone.

use crate::client::Client;
use crate::served::{one_line, Served, FAST};
use leadscrew_serve::{Allowed, LineSpec, Service};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The time within which an expected event comes, even on a busy computer.
const SOON: Duration = Duration::from_secs(10);

fn websocket(allowed: &[&str]) -> Served {
    Served::start(Service {
        lines: vec![LineSpec::WebSocket("127.0.0.1:0".into())],
        allowed: Allowed::new(allowed.iter().map(ToString::to_string).collect()),
        ..one_line()
    })
}

/// The first line of the answer to a handshake with these headers.
fn shake_hands(served: &Served, headers: &str) -> (TcpStream, String) {
    let mut stream = TcpStream::connect(&served.ready[0]).unwrap();
    stream.set_read_timeout(Some(SOON)).unwrap();
    let request = format!(
        "GET / HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n{headers}\r\n"
    );
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = Vec::new();
    while !answer.ends_with(b"\r\n") {
        let mut byte = [0];
        assert_eq!(stream.read(&mut byte).unwrap(), 1, "{answer:?}");
        answer.push(byte[0]);
    }
    (stream, String::from_utf8(answer).unwrap())
}

fn is_let_in(served: &Served, headers: &str) -> bool {
    let (_, answer) = shake_hands(served, headers);
    let status = answer.split(' ').nth(1).unwrap();
    assert!(["101", "403"].contains(&status), "{headers}: {answer}");
    status == "101"
}

#[test]
fn a_web_page_from_elsewhere_gets_no_websocket() {
    let served = websocket(&[]);
    let at = &served.ready[0];
    let host = format!("Host: {at}\r\n");
    assert!(is_let_in(&served, &host));
    assert!(is_let_in(
        &served,
        &format!("{host}Origin: http://{at}\r\n")
    ));
    assert!(is_let_in(&served, "Host: localhost:1\r\n"));
    for refused in [
        format!("{host}Origin: https://evil.example\r\n"),
        format!("{host}Origin: null\r\n"),
        format!("{host}Origin: http://localhost\r\n"),
        "Host: attacker.example\r\nOrigin: http://attacker.example\r\n".to_owned(),
        "Host: attacker.example\r\n".to_owned(),
    ] {
        assert!(!is_let_in(&served, &refused), "{refused}");
    }
    let said: Vec<String> = served.heard.try_iter().collect();
    let help = "`--allow https://evil.example` lets it in";
    assert!(said.iter().any(|note| note.contains(help)), "{said:?}");
}

#[test]
fn a_page_and_a_name_that_are_listed_are_let_in() {
    let served = websocket(&["https://cnc.example", "cnc.local"]);
    assert!(is_let_in(
        &served,
        "Host: cnc.local:81\r\nOrigin: https://cnc.example\r\n"
    ));
    assert!(!is_let_in(
        &served,
        "Host: cnc.local:81\r\nOrigin: https://evil.example\r\n"
    ));
}

/// Sends a browser's request in pieces to the port for G-code. The connection is then closed.
fn ask_as_a_browser(served: &Served, pieces: &[&str]) {
    let mut browser = TcpStream::connect(&served.ready[0]).unwrap();
    browser.set_nodelay(true).unwrap();
    browser.set_read_timeout(Some(SOON)).unwrap();
    for piece in pieces {
        // The server may have closed the connection already.
        let _ = browser.write_all(piece.as_bytes());
        std::thread::sleep(Duration::from_millis(20));
    }
    let heard = browser.read(&mut [0; 100]);
    assert!(!matches!(heard, Ok(1..)), "{heard:?}");
}

#[test]
fn the_request_of_a_web_page_moves_and_holds_nothing() {
    let served = Served::tcp(FAST, 1.0);
    let post = "POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\n\r\n\
                \nG91G1X5F1000\nM3S1000\n!";
    ask_as_a_browser(&served, &[post]);
    ask_as_a_browser(&served, &["PO", "ST", " /?!", "\x18\nG91G0X3\n"]);
    ask_as_a_browser(&served, &["GET /?a=!\u{18} HTTP/1.1\r\n\r\n"]);
    // What a page can send by WebRTC: STUN behind the two bytes of its length, here with a user's
    // name that the page chooses.
    let stun = "\0\x01\0\x40!\x12\x24\x42aaaaaaaaaaaa\0\x06\0\x08a:!\x18\nG0X9\n";
    ask_as_a_browser(&served, &[&format!("\0\x54{stun}")]);
    ask_as_a_browser(&served, &["\n", &format!("\x20{stun}")]);
    let mut client = served.connect();
    let report = client.ask();
    assert!(
        report.starts_with("<Idle|MPos:0.000,0.000,0.000|"),
        "{report}"
    );
    assert!(client.say("$G")[0].contains(" M5 "));
    client.send(b"\x18");
    // The machine was not reset before: this is its first banner.
    assert_eq!(
        client.hear(SOON).as_deref(),
        Some("Grbl 1.1h ['$' for help]")
    );
}

#[test]
fn a_line_that_begins_as_a_request_does_is_taken_after_a_moment() {
    let served = Served::tcp(FAST, 1.0);
    let mut client = served.connect();
    client.send(b"G");
    std::thread::sleep(Duration::from_millis(300));
    client.send(b"91G0X1\n");
    client.expect("ok");
    // Only the first bytes of a connection can be a request.
    client.send(b"GET \n");
    assert!(client.hear(SOON).unwrap().starts_with("error:"));
}

/// Connects a second time and sends `first_bytes`. Returns a client if it has taken the line over;
/// `None` if its connection gets nothing.
fn second(served: &Served, first_bytes: &[u8]) -> Option<Client> {
    let stream = TcpStream::connect(&served.ready[0]).unwrap();
    stream.set_read_timeout(Some(SOON)).unwrap();
    (&stream).write_all(first_bytes).unwrap();
    match stream.peek(&mut [0]) {
        Ok(1) => {
            stream.set_read_timeout(None).unwrap();
            Some(Client::new(stream.try_clone().unwrap(), stream))
        }
        Ok(_) | Err(_) => None,
    }
}

#[test]
fn a_silent_client_loses_its_line_to_another_from_the_same_address_that_speaks() {
    let served = Served::tcp(FAST, 1.0);
    let mut silent = TcpStream::connect(&served.ready[0]).unwrap();
    let begun = Instant::now();
    assert!(second(&served, b"").is_none(), "it has sent nothing");
    let mut next = second(&served, b"?").expect("the line is free");
    assert!(begun.elapsed() < 2 * SOON);
    next.ask();
    assert_eq!(silent.read(&mut [0]).unwrap_or(0), 0);
}

#[test]
fn a_silent_websocket_loses_its_line_as_well() {
    let served = websocket(&[]);
    let host = format!("Host: {}\r\n", served.ready[0]);
    let (mut silent, answer) = shake_hands(&served, &host);
    assert!(answer.contains(" 101 "), "{answer}");
    assert!(is_let_in(&served, &host));
    while silent.read(&mut [0; 100]).unwrap_or(0) > 0 {}
}

/// Keeps everything that arrives from the client, even keepalive probes, as if its computer had
/// been switched off.
#[cfg(target_os = "linux")]
fn switch_off(client: &TcpStream) {
    // A BPF program that returns 0: it accepts no byte of any segment.
    let take_nothing = socket2::SockFilter::new(0x06, 0, 0, 0);
    let socket = socket2::SockRef::from(client);
    socket.attach_filter(&[take_nothing]).unwrap();
}

/// Waits until a client from another address gets the line; returns how long this took.
#[cfg(target_os = "linux")]
fn time_until_another_gets_in(served: &Served) -> Duration {
    use socket2::{Domain, Socket, Type};
    let begun = Instant::now();
    loop {
        // This address differs, so only the end of the first client can make room for it.
        let other = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
        let here: std::net::SocketAddr = "127.0.0.2:0".parse().unwrap();
        other.bind(&here.into()).unwrap();
        let there: std::net::SocketAddr = served.ready[0].parse().unwrap();
        other.connect(&there.into()).unwrap();
        let mut other = TcpStream::from(other);
        other.set_read_timeout(Some(SOON)).unwrap();
        other.write_all(b"?").unwrap();
        if matches!(other.read(&mut [0]), Ok(1)) {
            return begun.elapsed();
        }
        assert!(begun.elapsed() < 6 * SOON, "the line is held for ever");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_client_whose_computer_is_gone_frees_its_line_within_15_s() {
    // One client is at rest; for the other one an answer is on the way.
    std::thread::scope(|scope| {
        for last in [&b""[..], b"?"] {
            scope.spawn(move || {
                let served = Served::tcp(FAST, 1.0);
                let mut first = TcpStream::connect(&served.ready[0]).unwrap();
                first.write_all(b"?").unwrap();
                assert_eq!(first.read(&mut [0]).unwrap(), 1);
                std::thread::sleep(Duration::from_millis(200));
                switch_off(&first);
                first.write_all(last).unwrap();
                let time = time_until_another_gets_in(&served);
                assert!(time < Duration::from_millis(15_500), "{last:?}: {time:?}");
            });
        }
    });
}

#[test]
fn a_client_that_speaks_or_whose_job_runs_keeps_its_line() {
    let served = Served::tcp(FAST, 1.0);
    let mut first = served.connect();
    first.send(b"G91G1X20F100\nG4P0.01\n");
    first.expect("ok");
    first.wait_for("Run");
    std::thread::sleep(Duration::from_millis(2500));
    assert!(second(&served, b"\x18?").is_none(), "the job runs");
    first.send(b"!");
    first.wait_for("Hold:0");
    std::thread::sleep(Duration::from_millis(2500));
    assert!(second(&served, b"\x18?").is_none(), "the job is held");
    first.wait_for("Hold:0");
}

#[test]
fn idle_connections_do_not_keep_a_sender_out() {
    let served = Served::tcp(FAST, 1.0);
    let mut first = served.connect();
    first.ask();
    let connect = |_| TcpStream::connect(&served.ready[0]).unwrap();
    let idle: Vec<TcpStream> = (0..100).map(connect).collect();
    first.ask();
    drop(first);
    let begun = Instant::now();
    let mut sender = None;
    while sender.is_none() {
        sender = second(&served, b"?");
        assert!(begun.elapsed() < 2 * SOON, "no sender gets in");
    }
    sender.unwrap().ask();
    drop(idle);
}

#[test]
fn a_handshake_a_byte_at_a_time_holds_nobody_up() {
    let served = websocket(&[]);
    let mut slow = TcpStream::connect(&served.ready[0]).unwrap();
    slow.set_read_timeout(Some(Duration::from_millis(200)))
        .unwrap();
    let begun = Instant::now();
    let mut hung_up = false;
    while !hung_up {
        hung_up = slow.write_all(b"G").is_err() || slow.read(&mut [0]).is_ok();
        assert!(is_let_in(
            &served,
            &format!("Host: {}\r\n", served.ready[0])
        ));
        assert!(begun.elapsed() < SOON, "the handshake goes on for ever");
    }
}
