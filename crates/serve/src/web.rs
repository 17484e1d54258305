//! Decides which web pages may talk to the machine.
//!
//! Every page that a browser shows can open a WebSocket to this computer, and can send a request to
//! any of its ports. The browser says who asks: `Origin` names the page, and `Host` is the name by
//! which it found this computer.
//!
//! ```text
//!   no Origin                     a sender that is no page             let in
//!   Origin is Host                a page that this port has served     let in
//!   Origin null or another        a page from elsewhere                refused, unless `--allow ORIGIN`
//!   Host is an address, localhost                                      let in
//!   Host is another name          it may be made to lead here by       refused, unless `--allow NAME`
//!                                 the owner of the name
//! ```

use crate::token::Token;
use std::fmt;
use std::net::IpAddr;
use tungstenite::http::header::{AsHeaderName, HOST, ORIGIN};
use tungstenite::http::uri::Authority;
use tungstenite::http::HeaderMap;

/// The first bytes of a browser's requests. No line of G-code and no realtime byte begins with
/// them.
const REQUESTS: [&[u8]; 10] = [
    b"GET ",
    b"HEAD ",
    b"POST ",
    b"PUT ",
    b"DELETE ",
    b"CONNECT ",
    b"OPTIONS ",
    b"TRACE ",
    b"PATCH ",
    b"PRI * HTTP/2",
];

/// The first bytes, among which text has no NUL. Behind the two bytes of a length, with which ICE
/// frames its messages on TCP (RFC 4571, section 2), STUN has one: its type is below 256 (RFC 8489,
/// section 5).
const FRAME: usize = 3;

/// The kind of a connection, by its first bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Beginning {
    /// The bytes of a sender.
    Sender,
    /// Those of something else: a browser's request, or what no sender begins with.
    Request,
    /// Could be either: more bytes are needed.
    Either,
}

/// Classifies the first bytes of a connection.
pub(super) fn beginning(bytes: &[u8]) -> Beginning {
    let head = &bytes[..bytes.len().min(FRAME)];
    let is_blank = |byte: &u8| byte.is_ascii_whitespace();
    if REQUESTS.iter().any(|request| bytes.starts_with(request))
        || bytes.first().is_some_and(|first| !may_begin(*first))
        || head.contains(&0)
    {
        Beginning::Request
    } else if head.len() < FRAME && head.first().is_none_or(is_blank) {
        // A frame whose length begins as a line end or a blank does.
        Beginning::Either
    } else if REQUESTS.iter().any(|request| request.starts_with(bytes)) {
        Beginning::Either
    } else {
        Beginning::Sender
    }
}

/// Returns true if a sender begins with this byte: text, a line end, 0x18 or another realtime byte.
/// TLS and most frames begin with another control byte.
fn may_begin(byte: u8) -> bool {
    !byte.is_ascii_control() || byte.is_ascii_whitespace() || byte == 0x18
}

/// The pages and names that the user allows in addition to the ones that are always allowed, and
/// the token for the server's own page.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Allowed {
    names: Vec<String>,
    token: Token,
}

impl Default for Allowed {
    fn default() -> Self {
        Self::new(Vec::new())
    }
}

/// The reason why a request is refused.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Foreign {
    /// The request comes from a page of another origin.
    Origin(String),
    /// The request uses a name of this computer that anybody may own; empty if it has none.
    Host(String),
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Origin(page) => write!(
                f,
                "a web page from elsewhere, {page:?}; `--allow {page}` lets it in"
            ),
            Self::Host(name) if name.is_empty() => {
                f.write_str("it does not say which computer it asks for (`Host`)")
            }
            Self::Host(name) => write!(
                f,
                "it asks for a computer called {name:?}; `--allow {name}` says that it is this one"
            ),
        }
    }
}

impl Allowed {
    /// Allows pages by their origins, such as `https://cnc.example`, and names of this computer,
    /// such as `cnc.local`.
    pub fn new(names: Vec<String>) -> Self {
        let token = Token::draw();
        Self { names, token }
    }

    /// Returns the same pages and names, with a token that the user has chosen.
    #[must_use]
    pub fn with_token(self, token: Token) -> Self {
        Self { token, ..self }
    }

    /// Returns the token at the end of the page's address.
    pub fn token(&self) -> &Token {
        &self.token
    }

    /// Checks the headers of a request, for a document or for a WebSocket.
    ///
    /// # Errors
    /// [`Foreign`], with the header that is the reason.
    pub(super) fn check(&self, headers: &HeaderMap) -> Result<(), Foreign> {
        let host = only(headers, HOST).map_err(Foreign::Host)?;
        let host = host.unwrap_or_default();
        match host.parse::<Authority>() {
            Ok(name) if is_this_computer(name.host()) || self.lists(name.host()) => {}
            Ok(name) => return Err(Foreign::Host(name.host().to_owned())),
            Err(_) => return Err(Foreign::Host(host)),
        }
        match only(headers, ORIGIN).map_err(Foreign::Origin)? {
            Some(page) if !is_served_by(&page, &host) && !self.lists(&page) => {
                Err(Foreign::Origin(page))
            }
            Some(_) | None => Ok(()),
        }
    }

    fn lists(&self, name: &str) -> bool {
        self.names
            .iter()
            .any(|listed| listed.eq_ignore_ascii_case(name))
    }
}

/// The only header of this name, `None` if there is none. `Err` with the texts of all if there are
/// several.
fn only(headers: &HeaderMap, name: impl AsHeaderName) -> Result<Option<String>, String> {
    let text = |value: &[u8]| String::from_utf8_lossy(value).into_owned();
    let mut all = headers.get_all(name).iter();
    let all = all.by_ref().map(|value| text(value.as_bytes()));
    let all: Vec<String> = all.collect();
    match &all[..] {
        [] => Ok(None),
        [one] => Ok(Some(one.clone())),
        [..] => Err(all.join(", ")),
    }
}

/// Returns true if nobody else can own this host name: it is an address, or a name that means this
/// computer everywhere (RFC 6761, section 6.3).
fn is_this_computer(host: &str) -> bool {
    let bare = host
        .strip_prefix('[')
        .and_then(|host| host.strip_suffix(']'));
    let name = host.strip_suffix('.').unwrap_or(host).to_ascii_lowercase();
    bare.unwrap_or(host).parse::<IpAddr>().is_ok()
        || name == "localhost"
        || name.ends_with(".localhost")
}

/// Returns true if the port that a page sends its request to has served this page.
fn is_served_by(page: &str, host: &str) -> bool {
    let authority = page
        .strip_prefix("http://")
        .or(page.strip_prefix("https://"));
    authority.is_some_and(|authority| authority.eq_ignore_ascii_case(host))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tungstenite::http::header::{HeaderName, HeaderValue};

    fn check(allowed: &[&str], headers: &[(HeaderName, &str)]) -> Result<(), Foreign> {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(name, HeaderValue::from_str(value).unwrap());
        }
        Allowed::new(allowed.iter().map(ToString::to_string).collect()).check(&map)
    }

    #[test]
    fn a_sender_is_let_in_by_every_address_and_no_name_but_localhost() {
        let names = [
            "127.0.0.1:81",
            "[::1]:81",
            "192.168.1.7",
            "LocalHost:81",
            "a.localhost.",
        ];
        for name in names {
            assert_eq!(check(&[], &[(HOST, name)]), Ok(()), "{name}");
        }
        for name in [
            "attacker.example",
            "127.0.0.1.example",
            "localhost.example",
            "",
        ] {
            assert_eq!(check(&[], &[(HOST, name)]), Err(Foreign::Host(name.into())));
        }
        assert_eq!(check(&["cnc.local"], &[(HOST, "CNC.local:81")]), Ok(()));
        assert!(check(&[], &[(HOST, "localhost"), (HOST, "attacker.example")]).is_err());
        let nameless = check(&[], &[]).unwrap_err().to_string();
        assert!(!nameless.contains("--allow"), "{nameless}");
        // The message names what `--allow` takes.
        let foreign = check(&[], &[(HOST, "cnc.local:81")])
            .unwrap_err()
            .to_string();
        assert!(foreign.contains("`--allow cnc.local`"), "{foreign}");
    }

    #[test]
    fn a_page_is_let_in_where_this_port_has_served_it_or_it_is_listed() {
        let host = (HOST, "127.0.0.1:81");
        let from = |page, allowed: &[&str]| check(allowed, &[host.clone(), (ORIGIN, page)]);
        assert_eq!(from("http://127.0.0.1:81", &[]), Ok(()));
        let foreign = [
            "https://evil.example",
            "null",
            "http://127.0.0.1:82",
            "http://127.0.0.1:81.evil.example",
            "ftp://127.0.0.1:81",
            "",
        ];
        for page in foreign {
            assert_eq!(from(page, &[]), Err(Foreign::Origin(page.into())));
            assert_eq!(from(page, &[page]), Ok(()));
        }
        let two = [
            host.clone(),
            (ORIGIN, "http://127.0.0.1:81"),
            (ORIGIN, "null"),
        ];
        assert!(check(&[], &two).is_err());
    }

    #[test]
    fn a_request_is_told_from_a_line_as_soon_as_it_can_be() {
        let stun = b"\x00\x01\x00\x3C\x21\x12\xA4\x42";
        let framed = |length: u16| [&length.to_be_bytes(), &stun[..]].concat();
        let frames: Vec<Vec<u8>> = [0x50, 0x0A21, 0x0D0A, 0x2020, 0x4721].map(framed).into();
        let requests = [
            &b"GET /?a=!~ HTTP/1.1"[..],
            b"POST / HTTP/1.1",
            b"\x16\x03\x01\x02",
            stun,
            b"\x03!",
            b"\x7F",
        ];
        for request in requests.into_iter().chain(frames.iter().map(Vec::as_slice)) {
            assert_eq!(beginning(request), Beginning::Request, "{request:?}");
        }
        for line in [
            "G1X10",
            "$$",
            "?",
            "\x18",
            "GE",
            "PO?",
            "GETX ",
            "\r\n",
            "TR!",
            "\n$I\n",
            "\u{91}",
            "\u{FEFF}G0",
            "%",
            "\r\n\r\n",
            "(a",
        ] {
            let expected = match line {
                "GE" | "\r\n" => Beginning::Either,
                _ => Beginning::Sender,
            };
            assert_eq!(beginning(line.as_bytes()), expected, "{line:?}");
        }
    }
}
