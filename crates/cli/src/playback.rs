//! A job as a page with a slider along its time. This module joins the path, which has no times,
//! with the course of the speed, which has no places.

use super::watchers::{Sketch, Way};
use crate::picture::Caption;
use leadscrew_files::{Output, OutputError};
use leadscrew_page::Playback;
use leadscrew_sim::clock::seconds;
use leadscrew_sim::speed_profile::Stretch;
use std::io::Write;

/// Writes the page. The lines in `stretches` are the machine's line counts.
///
/// # Errors
/// If it cannot be written.
pub(super) fn write(
    output: Output,
    sketch: &Sketch,
    stretches: &[Stretch],
    caption: &Caption,
) -> Result<(), OutputError> {
    let mut moves = Vec::new();
    for one in sketch.path.moves() {
        one.write(&mut moves);
    }
    let fitted = Fitted::new(&sketch.ways, stretches);
    let playback = Playback {
        title: &caption.title,
        summary: &caption.summary,
        work: caption.work,
        is_laser: caption.full_power_s.is_some(),
        moves: &moves,
        lengths: &bytes(&fitted.lengths),
        course: &bytes(&fitted.course),
    };
    let written = output.pen().write_all(playback.document().as_bytes());
    output.complete(written)
}

/// Moves and stretches whose lengths agree line by line. Without a correction they differ, because
/// steps are rounded and the machine also moves on its own.
#[derive(PartialEq, Debug)]
struct Fitted {
    /// The length of each move, mm; 0 for the start of the path.
    lengths: Vec<f32>,
    /// For each stretch: time in s, length in mm, and speed at its start in mm/s.
    course: Vec<f32>,
}

impl Fitted {
    fn new(ways: &[Way], stretches: &[Stretch]) -> Self {
        let mut fitted = Self {
            lengths: Vec::with_capacity(ways.len() + 1),
            course: Vec::with_capacity(3 * stretches.len()),
        };
        fitted.lengths.push(0.0);
        let mut ways = ways;
        for of_line in stretches.chunk_by(|one, next| one.line == next.line) {
            let line = of_line.first().map_or(0, |first| first.line);
            // Planned moves that were joined have the line of the last of them.
            let count = ways.iter().take_while(|way| way.line <= line).count();
            let (passed, rest) = ways.split_at(count);
            ways = rest;
            fitted.add(passed, of_line);
        }
        // These moves were never begun.
        fitted.lengths.extend(ways.iter().map(|_| 0.0));
        fitted
    }

    fn add(&mut self, ways: &[Way], stretches: &[Stretch]) {
        let programmed: f64 = ways.iter().map(|way| way.mm).sum();
        let gone: f64 = stretches.iter().map(|stretch| stretch.length).sum();
        let scale = if programmed > 0.0 {
            gone / programmed
        } else {
            0.0
        };
        let lengths = ways.iter().map(|way| (way.mm * scale) as f32);
        self.lengths.extend(lengths);
        for stretch in stretches {
            // Stretches without a move of the path are motion that the machine makes on its own:
            // homing, a tool change.
            let has_place = programmed > 0.0;
            let length = if has_place { stretch.length } else { 0.0 };
            let speed = if has_place { stretch.speed[0] } else { 0.0 };
            let numbers = [seconds(stretch.cycles()), length, speed];
            self.course.extend(numbers.map(|number| number as f32));
        }
    }
}

fn bytes(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_sim::clock::{Cycle, CPU_HZ};
    use leadscrew_sim::speed_profile::{Limit, Phase, SpeedLimit};

    fn stretch(line: u64, length: f64) -> Stretch {
        Stretch {
            begin: Cycle(line * CPU_HZ),
            end: Cycle((line + 1) * CPU_HZ),
            line,
            phase: Phase::Cruise,
            length,
            speed: [length; 2],
            power: [0.0; 2],
            limit: Limit::Speed(SpeedLimit::Feed),
        }
    }

    fn way(line: u64, mm: f64) -> Way {
        Way { line, mm }
    }

    #[test]
    fn moves_are_as_long_as_their_lines_take_and_pixels_that_were_joined_share() {
        let ways = [way(1, 10.0), way(2, 1.0), way(3, 1.0), way(4, 2.0)];
        let fitted = Fitted::new(&ways, &[stretch(1, 5.0), stretch(4, 8.0)]);
        assert_eq!(fitted.lengths, [0.0, 5.0, 2.0, 2.0, 4.0]);
        assert_eq!(fitted.course, [1.0, 5.0, 5.0, 1.0, 8.0, 8.0]);
    }

    #[test]
    fn the_tool_stands_while_the_machine_moves_by_itself() {
        let ways = [way(1, 10.0), way(2, 10.0)];
        let homing = Stretch {
            line: 0,
            ..stretch(1, 300.0)
        };
        let fitted = Fitted::new(&ways, &[stretch(1, 10.0), homing, stretch(2, 12.0)]);
        assert_eq!(fitted.lengths, [0.0, 10.0, 12.0]);
        assert_eq!(fitted.course[3..6], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn moves_that_an_alarm_has_taken_back_have_no_length() {
        let fitted = Fitted::new(&[way(1, 10.0), way(2, 10.0)], &[stretch(1, 10.0)]);
        assert_eq!(fitted.lengths, [0.0, 10.0, 0.0]);
    }
}
