//! The part of HTTP that the server needs: it reads a request with tungstenite, and answers a
//! request for the page with the document.
//!
//! ```text
//!   GET /?token=...                        the document
//!   GET /                                  401, and where the address is printed
//!   GET /page?token=... (WebSocket)        a page: frames
//!   GET /... (WebSocket)                   a sender: bytes
//!   everything else                        404
//! ```

use super::token::Token;
use leadscrew_page::document;
use std::io::{self, Read, Write};
use tungstenite::handshake::machine::{HandshakeMachine, RoundResult, StageResult};
use tungstenite::handshake::server::{write_response, Request, Response};
use tungstenite::http::header::{
    HeaderName, CACHE_CONTROL, CONNECTION, CONTENT_LENGTH, CONTENT_SECURITY_POLICY, CONTENT_TYPE,
    REFERRER_POLICY, UPGRADE, X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use tungstenite::http::StatusCode;

/// Reads a request to the end of its headers.
///
/// # Errors
/// If it is no request, comes too slowly, or is followed by more bytes.
pub(super) fn read<S: Read + Write>(stream: S) -> io::Result<Request> {
    let none = |_| io::Error::from(io::ErrorKind::InvalidData);
    let mut machine = HandshakeMachine::start_read(stream);
    loop {
        machine = match machine.single_round::<Request>().map_err(none)? {
            RoundResult::Incomplete(machine) => machine,
            RoundResult::StageFinished(StageResult::DoneReading { result, tail, .. })
                if tail.is_empty() =>
            {
                return Ok(result);
            }
            RoundResult::WouldBlock(_) | RoundResult::StageFinished(_) => {
                return Err(io::ErrorKind::InvalidData.into());
            }
        };
    }
}

/// Returns true if the client asks for a WebSocket, and not for a document.
pub(super) fn wants_websocket(request: &Request) -> bool {
    request.headers().contains_key(UPGRADE)
}

/// Returns true if the client is a page that asks for a WebSocket.
pub(super) fn is_page(request: &Request) -> bool {
    request.uri().path() == "/page"
}

/// Returns true if the requested address contains the token.
pub(super) fn is_trusted(request: &Request, token: &Token) -> bool {
    request
        .uri()
        .query()
        .is_some_and(|query| token.is_in(query))
}

/// Answers a request for a document (RFC 9110, section 15).
///
/// # Errors
/// If the client does not take the answer.
pub(super) fn answer(mut to: impl Write, request: &Request, token: &Token) -> io::Result<()> {
    let is_root = request.uri().path() == "/";
    if is_root && is_trusted(request, token) {
        let nonce = Token::draw().to_string();
        return send(
            &mut to,
            StatusCode::OK,
            "text/html",
            &document(&nonce),
            &nonce,
        );
    }
    let (status, text) = match is_root {
        true => (
            StatusCode::UNAUTHORIZED,
            "Open the address that leadscrew has printed: it ends with a token.\r\n",
        ),
        false => (StatusCode::NOT_FOUND, "There is nothing here.\r\n"),
    };
    send(&mut to, status, "text/plain", text, "")
}

/// Sends a document with headers that forbid to frame it, cache it, name it to others, or fetch
/// anything from it.
fn send(
    to: &mut impl Write,
    status: StatusCode,
    kind: &str,
    text: &str,
    nonce: &str,
) -> io::Result<()> {
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}' data:; style-src 'unsafe-inline'; img-src data:; \
        connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    let headers: [(HeaderName, String); 8] = [
        (CONTENT_TYPE, format!("{kind}; charset=utf-8")),
        (CONTENT_LENGTH, text.len().to_string()),
        (CONTENT_SECURITY_POLICY, policy),
        (CACHE_CONTROL, "no-store".to_owned()),
        (REFERRER_POLICY, "no-referrer".to_owned()),
        (X_CONTENT_TYPE_OPTIONS, "nosniff".to_owned()),
        (X_FRAME_OPTIONS, "DENY".to_owned()),
        (CONNECTION, "close".to_owned()),
    ];
    let mut answer = Response::builder().status(status);
    for (name, value) in headers {
        answer = answer.header(name, value);
    }
    let invalid = |_| io::Error::from(io::ErrorKind::InvalidInput);
    let answer = answer
        .body(())
        .map_err(|_| io::Error::from(io::ErrorKind::InvalidInput))?;
    let mut bytes = Vec::new();
    write_response(&mut bytes, &answer).map_err(invalid)?;
    bytes.extend_from_slice(text.as_bytes());
    to.write_all(&bytes)?;
    to.flush()
}
