//! The web pages and computer names that the user lets in, spelled as in a browser's request.

use std::fmt;
use std::net::Ipv6Addr;

/// Ports that an origin leaves out (RFC 6454, section 6.2).
const USUAL_PORTS: [(&str, u16); 4] = [("http", 80), ("https", 443), ("ws", 80), ("wss", 443)];

/// A text that is neither an origin nor a name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoAllowance;

impl fmt::Display for NoAllowance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "expected an origin such as https://cnc.example or http://10.0.0.5:8000, without a \
             path; `null`; or a name such as cnc.local, without a port",
        )
    }
}

impl std::error::Error for NoAllowance {}

/// Reads an origin, `null`, or a name of this computer, as a browser sends it: without a slash at
/// its end, and without the usual port of its scheme.
///
/// # Errors
/// The text is none of these, so no request can have it.
pub fn allowance(text: &str) -> Result<String, NoAllowance> {
    let text = text.to_ascii_lowercase();
    let Some((scheme, rest)) = text.split_once("://") else {
        return if is_name(&text) {
            Ok(text)
        } else {
            Err(NoAllowance)
        };
    };
    let rest = rest.strip_suffix('/').unwrap_or(rest);
    if !is_scheme(scheme) {
        return Err(NoAllowance);
    }
    if scheme == "file" && rest.is_empty() {
        return Ok("file://".to_owned());
    }
    let (host, port) = match rest.rsplit_once(':') {
        Some((host, port)) if !port.ends_with(']') => (host, Some(port)),
        _ => (rest, None),
    };
    let port = port.map(str::parse::<u16>).transpose();
    match (is_host(host), port) {
        (true, Ok(Some(port))) if !USUAL_PORTS.contains(&(scheme, port)) => {
            Ok(format!("{scheme}://{host}:{port}"))
        }
        (true, Ok(_)) => Ok(format!("{scheme}://{host}")),
        _ => Err(NoAllowance),
    }
}

fn is_scheme(text: &str) -> bool {
    let more = |c: char| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.');
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(more)
}

fn is_host(text: &str) -> bool {
    let bare = text
        .strip_prefix('[')
        .and_then(|text| text.strip_suffix(']'));
    match bare {
        Some(address) => address.parse::<Ipv6Addr>().is_ok(),
        None => is_name(text),
    }
}

fn is_name(text: &str) -> bool {
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    !text.is_empty() && text.chars().all(fits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_origin_is_read_as_a_browser_sends_it() {
        for (text, read) in [
            ("http://host:1234/", "http://host:1234"),
            ("http://host:1234", "http://host:1234"),
            ("HTTPS://Cnc.Example/", "https://cnc.example"),
            ("https://cnc.example:443", "https://cnc.example"),
            ("http://cnc.example:443", "http://cnc.example:443"),
            ("http://[::1]:81/", "http://[::1]:81"),
            ("http://[::1]", "http://[::1]"),
            ("chrome-extension://abc", "chrome-extension://abc"),
            ("file:///", "file://"),
            ("null", "null"),
            ("cnc.local", "cnc.local"),
        ] {
            assert_eq!(allowance(text).as_deref(), Ok(read));
        }
    }

    #[test]
    fn what_no_request_can_have_is_refused() {
        for text in [
            "",
            "http://",
            "http:///",
            "http://host/page",
            "http://host//",
            "http://host?a",
            "http://me@host",
            "http://host:99999",
            "http://host:",
            "http://[::1",
            "://host",
            "*",
            "https://*.example",
            "cnc.local:8081",
            "cnc local",
            "h\u{f6}st",
        ] {
            assert_eq!(allowance(text), Err(NoAllowance), "{text}");
        }
    }
}
