//! Tests of the lines with real sockets and pseudo-terminals.

use super::line::{LineError, LineSpec, What};
use super::lines::Lines;
use super::web::Allowed;
use leadscrew_page::Outlet;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_secs(5);

fn open_lines(specs: &[LineSpec]) -> Lines {
    Lines::open(specs, &Allowed::default())
}

/// The next event of line 0.
fn next(lines: &Lines) -> What {
    lines.next(PATIENCE).expect("an event within 5 s").what
}

fn ready(lines: &Lines) -> String {
    match next(lines) {
        What::Ready(address) => address,
        other => panic!("not ready: {other:?}"),
    }
}

fn opened(lines: &Lines) -> Outlet {
    match next(lines) {
        What::Opened { outlet, .. } => outlet,
        other => panic!("not opened: {other:?}"),
    }
}

/// Collects bytes until there are as many as expected, and compares them.
fn expect_bytes(lines: &Lines, expected: &[u8]) {
    let mut got = Vec::new();
    while got.len() < expected.len() {
        match next(lines) {
            What::Bytes(bytes) => {
                lines.taken(0, bytes.len());
                got.extend(bytes);
            }
            other => panic!("{other:?} after {got:?}"),
        }
    }
    assert_eq!(got, expected);
}

fn expect_closed(lines: &Lines) {
    let what = next(lines);
    assert!(matches!(what, What::Closed), "{what:?}");
}

fn read_exactly(mut from: impl Read, expected: &[u8]) {
    let mut got = vec![0; expected.len()];
    from.read_exact(&mut got).unwrap();
    assert_eq!(got, expected);
}

fn any_tcp() -> (Lines, String) {
    let lines = open_lines(&[LineSpec::Tcp("127.0.0.1:0".into())]);
    let address = ready(&lines);
    (lines, address)
}

#[test]
fn tcp_passes_bytes_both_ways_and_takes_the_next_client_at_once() {
    let (lines, address) = any_tcp();
    for _ in 0..20 {
        let mut client = TcpStream::connect(&address).unwrap();
        let outlet = opened(&lines);
        client.write_all(b"$$\n\x85").unwrap();
        expect_bytes(&lines, b"$$\n\x85");
        assert!(outlet.send(b"ok\r\n".to_vec()));
        read_exactly(&client, b"ok\r\n");
        drop(client);
        expect_closed(&lines);
    }
}

#[test]
fn a_client_that_comes_back_before_its_end_was_seen_is_let_in() {
    let (lines, address) = any_tcp();
    let mut first = TcpStream::connect(&address).unwrap();
    // If two clients came at once, the first one heard would get the line, so the second comes
    // later.
    opened(&lines);
    first.write_all(b"\r\n").unwrap();
    drop(first);
    let mut second = TcpStream::connect(&address).unwrap();
    second.write_all(b"?").unwrap();
    expect_bytes(&lines, b"\r\n");
    expect_closed(&lines);
    opened(&lines);
    expect_bytes(&lines, b"?");
}

#[test]
fn a_second_client_is_turned_away_and_the_first_does_not_notice() {
    let (lines, address) = any_tcp();
    let mut first = TcpStream::connect(&address).unwrap();
    opened(&lines);
    let mut second = TcpStream::connect(&address).unwrap();
    assert!(matches!(next(&lines), What::TurnedAway(_)));
    assert_eq!(second.read(&mut [0]).unwrap(), 0);
    first.write_all(b"?").unwrap();
    expect_bytes(&lines, b"?");
}

#[test]
fn a_port_in_use_is_said_once_and_taken_once_it_is_free() {
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = holder.local_addr().unwrap().to_string();
    let lines = open_lines(&[LineSpec::Tcp(address.clone())]);
    let what = next(&lines);
    assert!(
        matches!(what, What::Unavailable(LineError::Listen(_))),
        "{what:?}"
    );
    assert!(lines.next(Duration::from_millis(1500)).is_none());
    drop(holder);
    assert_eq!(ready(&lines), address);
    TcpStream::connect(&address).unwrap();
    opened(&lines);
}

#[test]
fn a_client_that_does_not_read_costs_nobody_else_anything() {
    let (lines, address) = any_tcp();
    let client = TcpStream::connect(&address).unwrap();
    let outlet = opened(&lines);
    let begun = Instant::now();
    let mut taken = 0;
    while outlet.send(vec![b'x'; 100_000]) {
        taken += 1;
        assert!(taken < 100_000, "the outlet never fills up");
    }
    assert!(begun.elapsed() < PATIENCE);
    drop(client);
    expect_closed(&lines);
    TcpStream::connect(&address).unwrap();
    opened(&lines);
}

#[test]
fn dropping_the_lines_frees_the_port_even_under_a_flood() {
    let (lines, address) = any_tcp();
    let mut client = TcpStream::connect(&address).unwrap();
    client
        .set_write_timeout(Some(Duration::from_millis(200)))
        .unwrap();
    // Nobody takes the events, so the channel fills first, then the sockets' buffers.
    while client.write_all(&[b'x'; 65536]).is_ok() {}
    drop(lines);
    TcpListener::bind(&address).unwrap();
}

#[test]
fn a_flood_is_held_back_until_the_machine_takes_it() {
    let (lines, address) = any_tcp();
    let mut client = TcpStream::connect(&address).unwrap();
    opened(&lines);
    let writing = std::thread::spawn(move || client.write_all(&[b'G'; 1 << 20]).unwrap());
    let mut waiting = 0;
    while let Some(event) = lines.next(Duration::from_millis(300)) {
        match event.what {
            What::Bytes(bytes) => waiting += bytes.len(),
            other => panic!("{other:?}"),
        }
    }
    assert!((64 << 10..100 << 10).contains(&waiting), "{waiting}");
    lines.taken(0, waiting);
    expect_bytes(&lines, &vec![b'G'; (1 << 20) - waiting]);
    writing.join().unwrap();
}

mod websocket {
    use super::*;
    use tungstenite::client::IntoClientRequest;
    use tungstenite::http::header::{HeaderValue, SEC_WEBSOCKET_PROTOCOL};
    use tungstenite::protocol::frame::coding::{Data, OpCode};
    use tungstenite::protocol::frame::Frame;
    use tungstenite::{Bytes, Message, WebSocket};

    fn connected() -> (Lines, String, WebSocket<TcpStream>, Outlet) {
        let lines = open_lines(&[LineSpec::WebSocket("127.0.0.1:0".into())]);
        let address = ready(&lines);
        let client = connect(&address);
        let outlet = opened(&lines);
        (lines, address, client, outlet)
    }

    fn connect(address: &str) -> WebSocket<TcpStream> {
        let stream = TcpStream::connect(address).unwrap();
        tungstenite::client(format!("ws://{address}/"), stream)
            .unwrap()
            .0
    }

    #[test]
    fn a_second_client_is_told_why_it_is_turned_away() {
        let (lines, address, _client, _outlet) = connected();
        lines.set_busy(true);
        let stream = TcpStream::connect(&address).unwrap();
        let second = tungstenite::client(format!("ws://{address}/"), stream);
        let Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) = second
        else {
            panic!("{second:?}");
        };
        assert_eq!(answer.status().as_u16(), 503);
        let words = answer.body().as_deref().unwrap_or_default();
        assert!(words.starts_with(b"Another client"), "{words:?}");
        assert!(matches!(next(&lines), What::TurnedAway(_)));
    }

    #[test]
    fn text_and_binary_go_in_and_whole_lines_of_text_come_out() {
        let (lines, _, mut client, outlet) = connected();
        client.send(Message::text("$I\n")).unwrap();
        expect_bytes(&lines, b"$I\n");
        client.send(Message::text("\u{91}")).unwrap();
        expect_bytes(&lines, &[0xC2, 0x91]);
        client.send(Message::binary(&b"\x85?"[..])).unwrap();
        expect_bytes(&lines, b"\x85?");
        assert!(outlet.send(b"\r\nGrbl 1.1h ['$' for help]\r\no".to_vec()));
        assert!(outlet.send(b"k\r\n".to_vec()));
        assert_eq!(
            client.read().unwrap(),
            Message::text("\r\nGrbl 1.1h ['$' for help]\r\n")
        );
        assert_eq!(client.read().unwrap(), Message::text("ok\r\n"));
    }

    #[test]
    fn fragments_act_before_their_message_ends_and_need_not_be_utf_8() {
        let (lines, _, mut client, _outlet) = connected();
        let fragment = |bytes: &'static [u8], data| {
            Message::Frame(Frame::message(
                Bytes::from_static(bytes),
                OpCode::Data(data),
                false,
            ))
        };
        client.send(fragment(b"?", Data::Text)).unwrap();
        expect_bytes(&lines, b"?");
        client.send(fragment(b"\x91", Data::Text)).unwrap();
        expect_bytes(&lines, b"\x91");
        client.send(fragment(b"G0X1\n", Data::Continue)).unwrap();
        expect_bytes(&lines, b"G0X1\n");
    }

    #[test]
    fn a_ping_is_answered_and_so_is_goodbye() {
        let (lines, address, mut client, _outlet) = connected();
        client
            .send(Message::Ping(Bytes::from_static(b"there?")))
            .unwrap();
        assert_eq!(
            client.read().unwrap(),
            Message::Pong(Bytes::from_static(b"there?"))
        );
        client.close(None).unwrap();
        while client.read().is_ok() {}
        expect_closed(&lines);
        connect(&address);
        opened(&lines);
    }

    #[test]
    fn a_client_that_offers_subprotocols_gets_the_first_and_another_gets_none() {
        let lines = open_lines(&[LineSpec::WebSocket("127.0.0.1:0".into())]);
        let address = ready(&lines);
        for (offered, chosen) in [(Some("arduino, binary"), Some("arduino")), (None, None)] {
            let stream = TcpStream::connect(&address).unwrap();
            let mut request = format!("ws://{address}/").into_client_request().unwrap();
            let offered = offered.map(HeaderValue::from_static);
            let headers = request.headers_mut();
            offered.map(|names| headers.insert(SEC_WEBSOCKET_PROTOCOL, names));
            let (client, response) = tungstenite::client(request, stream).unwrap();
            let answered = response.headers().get(SEC_WEBSOCKET_PROTOCOL);
            assert_eq!(answered.map(|name| name.to_str().unwrap()), chosen);
            opened(&lines);
            drop(client);
            expect_closed(&lines);
        }
    }

    #[test]
    fn a_request_without_the_token_is_answered_401_and_the_next_client_let_in() {
        let lines = open_lines(&[LineSpec::WebSocket("127.0.0.1:0".into())]);
        let address = ready(&lines);
        let mut browser = TcpStream::connect(&address).unwrap();
        browser
            .write_all(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
            .unwrap();
        let mut answer = String::new();
        browser.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 401 "), "{answer}");
        connect(&address);
        opened(&lines);
    }
}

#[cfg(unix)]
mod pty {
    use super::*;
    use std::fs::{File, OpenOptions};
    use std::path::{Path, PathBuf};

    fn open(link: &Path) -> File {
        OpenOptions::new()
            .read(true)
            .write(true)
            .open(link)
            .unwrap()
    }

    fn spec(link: &Path) -> [LineSpec; 1] {
        [LineSpec::Pty {
            link: link.to_owned(),
            reset_on_open: false,
        }]
    }

    fn port() -> (tempfile::TempDir, PathBuf, Lines) {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("ttyGRBL");
        let lines = open_lines(&spec(&link));
        ready(&lines);
        (folder, link, lines)
    }

    #[test]
    fn it_is_a_raw_serial_port_that_can_be_opened_again_and_again() {
        let (_folder, link, lines) = port();
        for _ in 0..5 {
            let mut client = open(&link);
            let outlet = opened(&lines);
            client.write_all(b"G21\r\n\x03\x18\x04?").unwrap();
            expect_bytes(&lines, b"G21\r\n\x03\x18\x04?");
            assert!(outlet.send(b"ok\r\nok\r\n".to_vec()));
            read_exactly(&client, b"ok\r\nok\r\n");
            drop(client);
            expect_closed(&lines);
        }
    }

    #[test]
    fn a_program_does_not_get_what_the_one_before_left_unread() {
        let (_folder, link, lines) = port();
        let client = open(&link);
        let outlet = opened(&lines);
        assert!(outlet.send(b"old\r\n".to_vec()));
        std::thread::sleep(Duration::from_millis(50));
        drop(client);
        expect_closed(&lines);
        let client = open(&link);
        let outlet = opened(&lines);
        assert!(outlet.send(b"new\r\n".to_vec()));
        read_exactly(&client, b"new\r\n");
    }

    #[test]
    fn bytes_arrive_even_if_the_port_is_closed_right_after_them() {
        let (_folder, link, lines) = port();
        for _ in 0..20 {
            open(&link).write_all(b"$X\n").unwrap();
            opened(&lines);
            expect_bytes(&lines, b"$X\n");
            expect_closed(&lines);
        }
    }

    #[test]
    fn the_link_goes_with_the_server() {
        let (_folder, link, lines) = port();
        assert!(link.is_symlink());
        drop(lines);
        assert!(!link.is_symlink());
    }

    #[test]
    fn what_is_at_the_path_already_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("precious");
        std::fs::write(&link, "mine").unwrap();
        let lines = open_lines(&spec(&link));
        assert!(matches!(
            next(&lines),
            What::Unavailable(LineError::LinkExists)
        ));
        drop(lines);
        assert_eq!(std::fs::read_to_string(&link).unwrap(), "mine");
    }

    #[test]
    fn a_link_that_leads_nowhere_any_more_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("stale");
        std::os::unix::fs::symlink("/dev/pts/none", &link).unwrap();
        let lines = open_lines(&spec(&link));
        ready(&lines);
        let _client = open(&link);
        opened(&lines);
    }
}
