//! The bytes on a sender's line, from the server's log.

/// The lines and bytes of both sides, in order.
#[derive(Default, Debug)]
pub(super) struct Wire {
    /// The lines of the sender, without realtime bytes.
    pub(super) sent: Vec<String>,
    /// The realtime bytes of the sender, as the log spells them.
    pub(super) realtime: Vec<String>,
    /// The lines of the machine while a sender was connected.
    pub(super) answers: Vec<String>,
}

impl Wire {
    /// Reads the entries of the line with this number from a log.
    ///
    /// ```text
    ///     12.034567 0 < G1X10F600          seconds, line, to or from the machine
    /// ```
    pub(super) fn read(log: &str, number: &str) -> Self {
        let mut wire = Self::default();
        for row in log.lines() {
            let mut parts = row.trim_start().splitn(4, ' ');
            let (_, line) = (parts.next(), parts.next().unwrap_or_default());
            let (way, text) = (parts.next(), parts.next().unwrap_or_default().to_owned());
            if line != number {
                continue;
            }
            match way {
                Some("<") if is_realtime(&text) => wire.realtime.push(text),
                Some("<") => wire.sent.push(text),
                Some(">") => wire.answers.push(text),
                Some(_) | None => {}
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

/// Whether a text is a realtime byte: `?`, `!`, `~`, or a byte that the log spells like `\x18`.
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
    fn the_last_target_is_put_together_from_the_lines_that_move() {
        assert_eq!(Wire::read(LOG, "1").last_target(), [1.5, 3.0]);
    }
}
