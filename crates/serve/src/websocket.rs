//! WebSocket (RFC 6455). The handshake and the frames' format are tungstenite's; frames are read by
//! [`FrameReader`].
//!
//! tungstenite hands out whole messages, or at best whole frames. But a sender may put a realtime
//! command into the first fragment of a message that it never ends, and this command must act at
//! once. Text frames may also hold bytes that are not UTF-8. So [`FrameReader`] passes on each byte
//! of payload as it arrives. Answers are sent as text frames of whole lines: one of the senders
//! accepts nothing else.

use super::frame_reader::{Control, FrameReader};
use super::line::{Refusal, What};
use super::listener::{Client, Protocol};
use super::request;
use super::seat::{Guest, Seated, Ticket};
use super::tcp;
use super::uplink::Uplink;
use super::web::Allowed;
use leadscrew_page::{Nonsense, Outlet, PageAction, PageEvent, SaidReader};
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tungstenite::handshake::server::{
    create_response, write_response, ErrorResponse, Request, Response,
};
use tungstenite::http::header::{
    HeaderValue, CONNECTION, CONTENT_LENGTH, CONTENT_TYPE, SEC_WEBSOCKET_PROTOCOL,
};
use tungstenite::http::StatusCode;
use tungstenite::protocol::frame::coding::{CloseCode, Data, OpCode};
use tungstenite::protocol::frame::{CloseFrame, Frame};

/// The time that a client's whole handshake may take.
const HANDSHAKE: Duration = Duration::from_secs(3);

/// The time between two checks of whether the line is free for a waiting client.
const POLL: Duration = Duration::from_millis(5);

/// The socket's sending end, used by the writer and for the answers to control frames. Each sends
/// whole frames.
type Sink = Arc<Mutex<TcpStream>>;

pub(super) const PROTOCOL: Protocol = Protocol {
    newcomer: Guest::Stranger,
    serve,
};

/// Answers a request: with the document, as a page, or as a sender's line. Ends when the client
/// disconnects.
fn serve(client: Client, allowed: &Allowed, uplink: &Uplink) {
    let Client {
        stream,
        peer,
        ticket,
    } = client;
    let outcome = meet(&stream, ticket, allowed, uplink);
    match outcome {
        Ok(Met::Answered) => {}
        Ok(Met::Page(reader, writer)) => serve_page(&reader, writer, uplink),
        Ok(Met::Sender(seated, reader, writer)) => {
            serve_sender(peer, &seated, &reader, writer, uplink);
        }
        Err(Away::Held) => uplink.tell(What::TurnedAway(peer)),
        Err(Away::Refused(why)) => uplink.tell(What::Refused(peer, why)),
    }
}

/// Passes bytes between a sender and the server until the sender disconnects.
fn serve_sender(
    peer: String,
    seated: &Seated,
    reader: &TcpStream,
    writer: TcpStream,
    uplink: &Uplink,
) {
    let sink: Sink = Arc::new(Mutex::new(writer));
    let (outlet, pieces) = Outlet::new();
    uplink.tell(What::Opened { peer, outlet });
    let for_writer = sink.clone();
    // The writer's thread ends when the server drops the outlet.
    std::thread::spawn(move || write_lines(&for_writer, &pieces));
    read_frames(reader, &sink, uplink, |bytes| {
        seated.heard();
        if !bytes.is_empty() {
            uplink.pass(bytes);
        }
        Ok(())
    });
    // The writer may be waiting for a client that does not read.
    let _ = reader.shutdown(Shutdown::Both);
    uplink.tell(What::Closed);
}

/// Passes frames between a page and the server until the page disconnects.
fn serve_page(reader: &TcpStream, writer: TcpStream, uplink: &Uplink) {
    let sink: Sink = Arc::new(Mutex::new(writer));
    let (outlet, frames) = Outlet::new();
    let page = uplink.number_page();
    let tell = |action| uplink.tell_of_page(PageEvent { page, action });
    tell(PageAction::Opened(outlet));
    let for_writer = sink.clone();
    std::thread::spawn(move || {
        for frame in frames {
            let data = OpCode::Data(Data::Binary);
            send(&for_writer, Frame::message(frame, data, true));
        }
    });
    let mut said = SaidReader::default();
    read_frames(reader, &sink, uplink, |bytes| {
        said.read(bytes, |said| tell(PageAction::Said(said)))
    });
    let _ = reader.shutdown(Shutdown::Both);
    tell(PageAction::Closed);
}

/// The outcome of a request.
enum Met {
    /// It asked for a document, which has been sent.
    Answered,
    /// It came from a page: the two ends of its connection.
    Page(TcpStream, TcpStream),
    /// It came from a sender, which now has the line.
    Sender(Seated, TcpStream, TcpStream),
}

/// The reason why a client is not served.
enum Away {
    /// Another client has the line.
    Held,
    /// It is no client of this port, or not allowed.
    Refused(Refusal),
}

/// Reads a request, checks whether the client is allowed, and answers.
fn meet(
    stream: &TcpStream,
    ticket: Ticket,
    allowed: &Allowed,
    uplink: &Uplink,
) -> Result<Met, Away> {
    let unfit = |_: io::Error| Away::Refused(Refusal::NoWebSocket);
    let gone = |_: io::Error| Away::Refused(Refusal::Gone);
    let mut limited = Limited::new(stream.try_clone().map_err(unfit)?).map_err(unfit)?;
    // No bytes after the request can get lost: a client that sends more before the answer is
    // refused.
    let request = request::read(&mut limited).map_err(unfit)?;
    if let Err(foreign) = allowed.check(request.headers()) {
        return refuse(&mut limited, Away::Refused(Refusal::Foreign(foreign)));
    }
    if !request::wants_websocket(&request) {
        request::answer(&mut limited, &request, allowed.token()).map_err(gone)?;
        return Ok(Met::Answered);
    }
    let response = create_response(&request).map_err(|_| Away::Refused(Refusal::NoWebSocket))?;
    let response = agree(&request, response);
    if request::is_page(&request) {
        if !request::is_trusted(&request, allowed.token()) {
            return refuse(&mut limited, Away::Refused(Refusal::NoToken));
        }
        drop(ticket);
        write_response(&mut limited, &response).map_err(|_| Away::Refused(Refusal::Gone))?;
        let (reader, writer) = tcp::prepare(stream.try_clone().map_err(gone)?).map_err(gone)?;
        return Ok(Met::Page(reader, writer));
    }
    let Some(seated) = wait(stream, ticket, uplink) else {
        return refuse(&mut limited, Away::Held);
    };
    write_response(&mut limited, &response).map_err(|_| Away::Refused(Refusal::Gone))?;
    let (reader, writer) = tcp::prepare(stream.try_clone().map_err(gone)?).map_err(gone)?;
    Ok(Met::Sender(seated, reader, writer))
}

/// Waits for the line. A client that has sent a request counts as having sent a byte.
fn wait(stream: &TcpStream, ticket: Ticket, uplink: &Uplink) -> Option<Seated> {
    ticket.wait(stream, || {
        std::thread::sleep(POLL);
        match uplink.stopped() {
            true => Guest::Gone,
            false => Guest::Spoken,
        }
    })
}

/// Tells a client why it is not let in.
fn refuse(to: &mut Limited, away: Away) -> Result<Met, Away> {
    let answer = away.answer();
    let text = answer.body().clone().unwrap_or_default();
    // Head and text go out in one piece: many clients read only once and show the text that came
    // with the head.
    let mut bytes = Vec::new();
    if write_response(&mut bytes, &answer).is_ok() {
        bytes.extend(text.as_bytes());
        // If the client does not take the answer, it is gone anyway.
        let _ = to.write_all(&bytes);
    }
    Err(away)
}

impl Away {
    /// The answer to a client that is not let in (RFC 9110, sections 15.5.4 and 15.6.4).
    fn answer(&self) -> ErrorResponse {
        let (status, why) = match self {
            Self::Held => (
                StatusCode::SERVICE_UNAVAILABLE,
                "Another client is connected: this line takes one at a time.".to_owned(),
            ),
            Self::Refused(why) => (StatusCode::FORBIDDEN, format!("Refused: {why}.")),
        };
        let text = why + "\r\n";
        let length = HeaderValue::from(text.len());
        let mut answer = ErrorResponse::new(Some(text));
        *answer.status_mut() = status;
        let headers = answer.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static("text/plain"));
        headers.insert(CONTENT_LENGTH, length);
        headers.insert(CONNECTION, HeaderValue::from_static("close"));
        answer
    }
}

/// Agrees to the first of the subprotocols that a client offers. A client that has offered
/// subprotocols hangs up if none is chosen (RFC 6455, section 4.1). Whichever is chosen, the bytes
/// stay the same.
fn agree(request: &Request, mut response: Response) -> Response {
    let offered = request.headers().get(SEC_WEBSOCKET_PROTOCOL);
    let names = offered.and_then(|names| names.to_str().ok());
    let first = names.and_then(|names| names.split(',').next());
    if let Some(Ok(first)) = first.map(|name| name.trim().parse()) {
        response.headers_mut().insert(SEC_WEBSOCKET_PROTOCOL, first);
    }
    response
}

/// A connection whose handshake has to end by `until`.
struct Limited {
    stream: TcpStream,
    until: Instant,
}

impl Limited {
    fn new(stream: TcpStream) -> io::Result<Self> {
        // An accepted socket inherits the listener's mode on some systems.
        stream.set_nonblocking(false)?;
        let until = Instant::now() + HANDSHAKE;
        Ok(Self { stream, until })
    }

    fn left(&self) -> io::Result<Option<Duration>> {
        let left = self.until.saturating_duration_since(Instant::now());
        match left.is_zero() {
            true => Err(io::ErrorKind::TimedOut.into()),
            false => Ok(Some(left)),
        }
    }
}

impl Read for Limited {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(self.left()?)?;
        self.stream.read(bytes)
    }
}

impl Write for Limited {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // Time spent waiting for the line does not count: the answer is short.
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

fn read_frames(
    reader: &TcpStream,
    sink: &Sink,
    uplink: &Uplink,
    mut take: impl FnMut(&[u8]) -> Result<(), Nonsense>,
) {
    let mut frames = FrameReader::new();
    tcp::read_all(reader, uplink, |bytes| {
        let mut payload = Vec::new();
        let mut answers = Vec::new();
        let read = frames.read(bytes, &mut payload, |control| answers.push(control));
        let taken = take(&payload);
        for control in answers {
            answer(control, sink, reader);
        }
        if read.is_err() || taken.is_err() {
            close(sink, reader, CloseCode::Protocol);
        }
    });
}

fn answer(control: Control, sink: &Sink, reader: &TcpStream) {
    match control {
        Control::Ping(payload) => send(sink, Frame::pong(payload)),
        Control::Pong => {}
        Control::Close => close(sink, reader, CloseCode::Normal),
    }
}

/// Sends a close frame and shuts the connection; the next read finds its end.
fn close(sink: &Sink, reader: &TcpStream, code: CloseCode) {
    let reason = "".into();
    send(sink, Frame::close(Some(CloseFrame { code, reason })));
    // If this fails, the connection is closed already.
    let _ = reader.shutdown(Shutdown::Both);
}

/// Sends a frame. If the connection has failed, the reader notices.
fn send(sink: &Sink, frame: Frame) {
    let mut bytes = Vec::new();
    let mut socket = sink.lock().unwrap_or_else(PoisonError::into_inner);
    if frame.format(&mut bytes).is_ok() && socket.write_all(&bytes).is_err() {
        let _ = socket.shutdown(Shutdown::Both);
    }
}

fn write_lines(sink: &Sink, pieces: &Receiver<Vec<u8>>) {
    let mut begun = Vec::new();
    for piece in pieces {
        begun.extend_from_slice(&piece);
        if let Some(end) = begun.iter().rposition(|byte| *byte == b'\n') {
            let rest = begun.split_off(end + 1);
            let lines = String::from_utf8_lossy(&begun).into_owned();
            begun = rest;
            send(sink, Frame::message(lines, OpCode::Data(Data::Text), true));
        }
    }
}
