//! Options of `leadscrew serve`.

use clap::{ArgGroup, Args};
use leadscrew_serve::{allowance, LineSpec, NoStateFile, StateFile, Token};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

/// Options of `serve`.
#[derive(Args, Debug)]
#[command(
    group(ArgGroup::new("line").required(true).multiple(true).args(["pty", "tcp", "ws"])),
    after_help = "Addresses without a host are this computer's own: --tcp 2323 is --tcp 127.0.0.1:2323.\n\
    Web pages from elsewhere cannot connect, unless --allow says so; see docs/serve.md.\n\
    Example: leadscrew serve --tcp 2323 --ws 8081 --machine examples/machines/router.toml"
)]
pub(super) struct ServeArgs {
    /// Make a serial port for local programs; senders open it by this link. May be repeated. Unix
    /// only.
    #[arg(long, value_name = "LINK")]
    pub(super) pty: Vec<PathBuf>,
    /// Reset the machine when a program opens the serial port, as an Arduino does.
    #[arg(long, requires = "pty")]
    pub(super) reset_on_open: bool,
    /// A port for raw TCP. May be repeated.
    #[arg(long, value_name = "ADDRESS", value_parser = address)]
    pub(super) tcp: Vec<String>,
    /// A port for WebSocket clients. May be repeated.
    #[arg(long, value_name = "ADDRESS", value_parser = address)]
    pub(super) ws: Vec<String>,
    /// A web page that may connect, by its origin (`https://cnc.example`), or a name by which this
    /// computer is reached (`cnc.local`). May be repeated. Senders that are not web pages can
    /// connect without it.
    #[arg(long, value_name = "ORIGIN|NAME", requires = "ws", value_parser = allowance)]
    pub(super) allow: Vec<String>,
    /// The token at the end of the page's address: 16 to 128 letters, digits, - or _. With this
    /// option the address is the same after a restart; without it each start makes a new token.
    #[arg(long, value_name = "TEXT", requires = "ws", value_parser = token, allow_hyphen_values = true)]
    pub(super) token: Option<Token>,
    /// The machine, a TOML file; without it a stock Grbl without switches. See examples/machines.
    #[arg(long, value_name = "FILE")]
    pub(super) machine: Option<PathBuf>,
    /// The file that keeps the settings for the next start; without it a file in the user's data
    /// directory, one for each machine.
    #[arg(long, value_name = "FILE")]
    pub(super) state: Option<PathBuf>,
    /// Write the bytes on the lines, with their times, to this file.
    #[arg(long, value_name = "FILE")]
    pub(super) log: Option<PathBuf>,
    /// How many times faster than real time the machine runs, 0.01 to 1000.
    #[arg(long, value_name = "N", default_value = "1", value_parser = speed)]
    pub(super) speed: f64,
    /// Speed of the lines in bits per second; without it they never wait.
    #[arg(long, value_name = "N", value_parser = super::baud::baud)]
    pub(super) baud: Option<NonZeroU32>,
}

impl ServeArgs {
    /// The lines on which programs can connect.
    pub(super) fn lines(&self) -> Vec<LineSpec> {
        let reset_on_open = self.reset_on_open;
        let pty = self.pty.iter().map(|link| LineSpec::Pty {
            link: link.clone(),
            reset_on_open,
        });
        let tcp = self.tcp.iter().map(|at| LineSpec::Tcp(at.clone()));
        let ws = self.ws.iter().map(|at| LineSpec::WebSocket(at.clone()));
        pty.chain(tcp).chain(ws).collect()
    }

    /// The state file: the one that the user named, or the machine's default one in the user's data
    /// directory.
    ///
    /// # Errors
    /// Something else has that place.
    pub(super) fn state_file(&self) -> Result<Option<StateFile>, NoStateFile> {
        if let Some(file) = &self.state {
            return StateFile::new(file).map(Some);
        }
        let stem = self.machine.as_deref().and_then(Path::file_stem);
        StateFile::of_user(&stem.map_or("default".into(), |stem| stem.to_string_lossy()))
    }
}

/// Reads an address. Without a host it is this computer's own.
fn address(text: &str) -> Result<String, String> {
    let (host, port) = text.rsplit_once(':').unwrap_or(("", text));
    if port.parse::<u16>().is_err() {
        return Err("expected a port, 0 to 65535, or HOST:PORT".to_owned());
    }
    let host = if host.is_empty() { "127.0.0.1" } else { host };
    Ok(format!("{host}:{port}"))
}

fn token(text: &str) -> Result<Token, String> {
    Token::chosen(text).ok_or_else(|| "expected 16 to 128 letters, digits, - or _".to_owned())
}

fn speed(text: &str) -> Result<f64, String> {
    let speed = text
        .parse::<f64>()
        .ok()
        .filter(|speed| (0.01..=1000.0).contains(speed));
    speed.ok_or_else(|| "expected a number from 0.01 to 1000".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        serve: ServeArgs,
    }

    fn parse(words: &[&str]) -> Result<ServeArgs, clap::Error> {
        Line::try_parse_from([&["serve"], words].concat()).map(|line| line.serve)
    }

    #[test]
    fn addresses_without_a_host_are_loopback() {
        let args = parse(&[
            "--tcp",
            "2323",
            "--tcp",
            ":24",
            "--ws",
            "0.0.0.0:81",
            "--pty",
            "/tmp/l",
        ]);
        let shown: Vec<String> = args
            .unwrap()
            .lines()
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(
            shown,
            [
                "pty /tmp/l",
                "tcp 127.0.0.1:2323",
                "tcp 127.0.0.1:24",
                "ws 0.0.0.0:81"
            ]
        );
    }

    #[test]
    fn some_line_is_required() {
        let usage = parse(&[]).unwrap_err().to_string();
        assert!(
            usage.contains("--pty <LINK>|--tcp <ADDRESS>|--ws <ADDRESS>"),
            "{usage}"
        );
        assert!(parse(&["--tcp", "1", "--reset-on-open"]).is_err());
    }

    #[test]
    fn what_is_no_address_is_refused() {
        for bad in ["99999", "localhost", "127.0.0.1:", "", "host:http"] {
            assert!(parse(&["--tcp", bad]).is_err(), "{bad}");
        }
        assert!(parse(&["--ws", "[::1]:81"]).is_ok());
    }

    #[test]
    fn pages_are_allowed_by_their_origin() {
        let allow = |text| parse(&["--ws", "1", "--allow", text]);
        assert_eq!(
            allow("http://host:1234/").unwrap().allow,
            ["http://host:1234"]
        );
        let refused = allow("http://host/page").unwrap_err().to_string();
        assert!(refused.contains("expected an origin such as"), "{refused}");
    }

    #[test]
    fn a_speed_is_a_positive_number() {
        assert_eq!(parse(&["--tcp", "1", "--speed", "2.5"]).unwrap().speed, 2.5);
        for bad in ["0", "-1", "fast", "inf"] {
            assert!(parse(&["--tcp", "1", "--speed", bad]).is_err(), "{bad}");
        }
    }
}
