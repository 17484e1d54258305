//! The bytes on a sender's line, and the machine's states, from the server's log.

use super::observer::Sight;

/// The lines and bytes of both sides, in order.
#[derive(Default, Debug)]
pub(super) struct Wire {
    /// The lines of the sender, without realtime bytes.
    pub(super) sent: Vec<String>,
    /// The realtime bytes of the sender, as the log spells them.
    pub(super) realtime: Vec<String>,
    /// The lines of the machine while a sender was connected.
    pub(super) answers: Vec<String>,
    /// The reports to every line, the observer's with them, until the sender had gone. A computer
    /// that is busy may keep one client waiting for a second; two see more.
    pub(super) sights: Vec<Sight>,
}

/// A row of the log.
struct Row<'a> {
    line: &'a str,
    way: &'a str,
    text: &'a str,
}

impl Wire {
    /// Reads a log. The sender's line has this number.
    ///
    /// ```text
    ///     12.034567 0 < G1X10F600          seconds, line, to or from the machine
    /// ```
    pub(super) fn read(log: &str, number: &str) -> Self {
        let rows: Vec<Row<'_>> = log.lines().filter_map(Row::read).collect();
        let last = rows.iter().rposition(|row| row.line == number);
        let rows = &rows[..last.map_or(0, |last| last + 1)];
        let sights = rows.iter().filter(|row| row.way == ">");
        let mut wire = Self {
            sights: sights.filter_map(|row| Sight::read(row.text)).collect(),
            ..Self::default()
        };
        for row in rows.iter().filter(|row| row.line == number) {
            let text = row.text.to_owned();
            match row.way {
                "<" if is_realtime(&text) => wire.realtime.push(text),
                "<" => wire.sent.push(text),
                ">" => wire.answers.push(text),
                _ => {}
            }
        }
        wire
    }

    /// The X and Y of the last line that moves. An axis without a word keeps its earlier value.
    pub(super) fn last_target(&self) -> [f64; 2] {
        let mut target = [0.0; 2];
        let moves = |line: &&String| !line.starts_with('$');
        for line in self.sent.iter().filter(moves) {
            for (letter, place) in ['X', 'Y'].into_iter().zip(&mut target) {
                *place = word(line, letter).unwrap_or(*place);
            }
        }
        target
    }
}

impl<'a> Row<'a> {
    fn read(row: &'a str) -> Option<Self> {
        let mut parts = row.trim_start().splitn(4, ' ').skip(1);
        let (line, way) = (parts.next()?, parts.next()?);
        let text = parts.next().unwrap_or_default();
        Some(Self { line, way, text })
    }
}

/// Returns true if a text is a realtime byte: `?`, `!`, `~`, or a byte that the log spells like
/// `\x18`.
fn is_realtime(text: &str) -> bool {
    matches!(text, "?" | "!" | "~") || (text.len() == 4 && text.starts_with("\\x"))
}

/// The value of a word.
pub(super) fn word(line: &str, letter: char) -> Option<f64> {
    let (_, rest) = line.split_once(letter)?;
    let end = rest.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-')));
    rest[..end.unwrap_or(rest.len())].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &str = "     0.001097 0 > Grbl 1.1h ['$' for help]
     1.954605 1 < G1 X1.5Y-2 S0\\r
     1.954605 1 < \\x91
     1.954605 1 < ?
     1.954912 2 > <Idle|MPos:0.000,0.000,0.000>
     1.954912 1 > ok
     1.954912 1 < \\r
     1.954912 1 < $J=G91 X9
     1.954912 1 < G1 Y3
     1.954912 1 . the client has gone
     1.964912 2 > <Run|MPos:0.000,0.000,0.000>
";

    #[test]
    fn lines_realtime_bytes_and_answers_are_told_apart() {
        let wire = Wire::read(LOG, "1");
        let sent = ["G1 X1.5Y-2 S0\\r", "\\r", "$J=G91 X9", "G1 Y3"];
        assert_eq!(wire.sent, sent);
        assert_eq!(wire.realtime, ["\\x91", "?"]);
        assert_eq!(wire.answers, ["ok"]);
    }

    #[test]
    fn reports_to_another_line_are_seen_until_the_sender_has_gone() {
        let sights = Wire::read(LOG, "1").sights;
        let states: Vec<&str> = sights.iter().map(|sight| &*sight.state).collect();
        assert_eq!(states, ["Idle"]);
    }

    #[test]
    fn the_last_target_is_put_together_from_the_lines_that_move() {
        assert_eq!(Wire::read(LOG, "1").last_target(), [1.5, 3.0]);
    }
}
