//! WebSocket (RFC 6455): the handshake and the frames' format are tungstenite's, the reading is not.
//!
//! tungstenite hands out whole messages, or whole frames at best. A realtime command that a sender puts into the first
//! fragment of a message that it never ends must act at once, and text frames may hold bytes that are no UTF-8. So
//! [`FrameReader`] passes on each byte of payload as it arrives. The answers go out as text, whole lines to a frame:
//! one of the senders listens to nothing else.

use super::frame_reader::{Control, FrameReader};
use super::line::{Outlet, Uplink, What, CHUNK};
use super::listener::Protocol;
use super::tcp;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::header::SEC_WEBSOCKET_PROTOCOL;
use tungstenite::protocol::frame::coding::{CloseCode, Data, OpCode};
use tungstenite::protocol::frame::{CloseFrame, Frame};

/// How long a client may take for its handshake.
const HANDSHAKE: Duration = Duration::from_secs(3);

/// The socket's sending end, used by the writer and by the answers to control frames: whole frames each.
type Sink = Arc<Mutex<TcpStream>>;

pub(super) const PROTOCOL: Protocol = Protocol { serve, turn_away };

/// What a client is told that comes while another is there.
const BUSY: &str = "Another client is connected: this line takes one at a time.\r\n";

/// Passes bytes between a client and the server until the client goes.
fn serve(stream: TcpStream, peer: String, uplink: &Uplink) {
    let Some((reader, writer)) = shake_hands(stream) else {
        return uplink.tell(What::Refused(peer));
    };
    let sink: Sink = Arc::new(Mutex::new(writer));
    let (outlet, pieces) = Outlet::new();
    uplink.tell(What::Opened { peer, outlet });
    let for_writer = sink.clone();
    // Ends when the server drops the outlet.
    std::thread::spawn(move || write_lines(&for_writer, &pieces));
    read_frames(&reader, &sink, uplink);
    // The writer may be stuck with a client that does not read.
    let _ = reader.shutdown(Shutdown::Both);
    uplink.tell(What::Closed);
}

/// Answers the handshake with what is the matter.
fn turn_away(mut stream: TcpStream) {
    let prepared = stream.set_nonblocking(false);
    let prepared = prepared.and_then(|()| stream.set_read_timeout(Some(HANDSHAKE)));
    // The request is read first: a connection closed upon unread bytes loses its answer.
    if prepared.is_ok() && stream.read(&mut [0; CHUNK]).is_ok() {
        // RFC 9110, section 15.6.4; in one piece, as some clients read no further.
        let answer = format!(
            "HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\nContent-Length: {}\r\n\
             Connection: close\r\n\r\n{BUSY}",
            BUSY.len()
        );
        // A client that has gone wants no answer.
        let _ = stream.write_all(answer.as_bytes());
    }
}

fn shake_hands(stream: TcpStream) -> Option<(TcpStream, TcpStream)> {
    stream.set_nonblocking(false).ok()?;
    stream.set_read_timeout(Some(HANDSHAKE)).ok()?;
    let shaken = tungstenite::accept_hdr(stream, agree).ok()?;
    // Nothing can be lost in tungstenite's buffer: it refuses a client that sends more before it was answered.
    tcp::prepare(shaken.get_ref().try_clone().ok()?).ok()
}

/// Agrees to the first of the subprotocols that a client offers: one that has offered some hangs up where none of them
/// is chosen (RFC 6455, section 4.1). They say nothing about the bytes.
#[allow(
    clippy::result_large_err,
    reason = "the callback's type is tungstenite's"
)]
fn agree(request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
    let offered = request.headers().get(SEC_WEBSOCKET_PROTOCOL);
    let names = offered.and_then(|names| names.to_str().ok());
    let first = names.and_then(|names| names.split(',').next());
    if let Some(Ok(first)) = first.map(|name| name.trim().parse()) {
        response.headers_mut().insert(SEC_WEBSOCKET_PROTOCOL, first);
    }
    Ok(response)
}

fn read_frames(reader: &TcpStream, sink: &Sink, uplink: &Uplink) {
    let mut frames = FrameReader::new();
    tcp::read_all(reader, uplink, |bytes| {
        let mut payload = Vec::new();
        let mut answers = Vec::new();
        let read = frames.read(bytes, &mut payload, |control| answers.push(control));
        if !payload.is_empty() {
            uplink.pass(&payload);
        }
        for control in answers {
            answer(control, sink, reader);
        }
        if read.is_err() {
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

/// Says goodbye; the next read finds the end.
fn close(sink: &Sink, reader: &TcpStream, code: CloseCode) {
    let reason = "".into();
    send(sink, Frame::close(Some(CloseFrame { code, reason })));
    // What fails is closed already.
    let _ = reader.shutdown(Shutdown::Both);
}

/// Sends a frame; a connection that fails is seen by the reader.
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
