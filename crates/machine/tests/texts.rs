//! The texts of errors and alarms: no word in them that a sender takes for an answer.

use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::status::Status;

#[test]
fn texts_are_safe_to_send() {
    let errors = Status::ALL.iter();
    let errors = errors.map(|code| (code.number(), code.text(), code.explanation()));
    assert_is_a_good_table(&errors.collect::<Vec<_>>());
    let alarms = Alarm::ALL.iter();
    let alarms = alarms.map(|code| (code.number(), code.text(), code.explanation()));
    assert_is_a_good_table(&alarms.collect::<Vec<_>>());
}

/// Checks a table: numbers rise, texts fit a message line and hold no word that a sender takes for
/// an answer.
fn assert_is_a_good_table(rows: &[(u8, &str, &str)]) {
    assert!(!rows.is_empty());
    for pair in rows.windows(2) {
        assert!(pair[0].0 < pair[1].0, "{} is out of order", pair[1].0);
    }
    for (number, text, explanation) in rows {
        assert!(text.len() <= 60, "{number}: too long for a message");
        assert!(
            !text.ends_with('.') && explanation.ends_with('.'),
            "{number}"
        );
        for words in [text, explanation] {
            let words = words.to_ascii_lowercase();
            for answer in ["ok", "error", "alarm"] {
                assert!(!words.contains(answer), "{number} contains {answer}");
            }
        }
    }
}
