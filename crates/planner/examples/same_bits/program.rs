//! Random programs through the planner, and a checksum of all that comes out: moves, segments,
//! power.
//!
//! Compiled for the host and for the microcontroller; nothing in it depends on either.

use fixed::types::U1F31;
use heapless::Deque;
use leadscrew_planner::{
    Cartesian, Config, Coordinate, CornerRule, Feed, Move, MoveKind, MovePower, Overrides,
    PixelQueue, Planner, PowerLead, Pushed, Queue, Segmenter, StepsPerMm, THREE_DECIMALS,
};
use leadscrew_stepper::{LineStart, OutputChange, Power, Segment, Ticks};

/// Programs, moves in each, and segments taken of each at most.
const PROGRAMS: u32 = 120;
const MOVES: u32 = 60;
const SEGMENTS: u32 = 6_000;

type ThePlanner<'q> = Planner<'q, Cartesian, 3, 3>;

/// FNV-1a, 64 bits (G. Fowler, L. C. Noll, P. Vo).
struct Checksum(u64);

impl Checksum {
    fn add(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3);
        }
    }

    fn add_signed(&mut self, word: i64) {
        self.add(u64::from_le_bytes(word.to_le_bytes()));
    }

    fn add_real(&mut self, real: f32) {
        self.add(real.to_bits().into());
    }

    fn add_segment(&mut self, segment: &Segment<3>) {
        if let Some(line) = segment.line.as_ref().map(LineStart::line) {
            self.add(line.direction().bits().into());
            line.steps()
                .iter()
                .for_each(|steps| self.add((*steps).into()));
        }
        self.add(segment.ticks.get().into());
        self.add(segment.smoothing.level().into());
        self.add(segment.motors.bits().into());
        self.add(segment.early.bits().into());
        self.add(segment.interval.to_bits());
        self.add_signed(segment.interval_change.to_bits());
        self.add(segment.power.share().to_bits().into());
        self.add_signed(segment.power_change.to_bits().into());
        self.add(
            segment
                .at_rest
                .map_or(1, |power| power.share().to_bits().into()),
        );
    }
}

/// xorshift64 (G. Marsaglia, *Xorshift RNGs*, 2003).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u32
    }

    fn below(&mut self, end: u32) -> u32 {
        self.bits() % end
    }

    /// Over `decades` powers of ten from `least` on.
    fn ten_to(&mut self, least: f32, decades: u32) -> f32 {
        let decade = (0..self.below(decades)).fold(least, |all, _| all * 10.0);
        decade * (1.0 + 9.0 * self.share())
    }

    /// 0 to 1.
    fn share(&mut self) -> f32 {
        self.below(1 << 24) as f32 / (1 << 24) as f32
    }
}

fn config(random: &mut Random) -> Config<3> {
    let rate = random.ten_to(1.0, 3);
    let acceleration = random.ten_to(10.0, 3);
    let scale = i64::from(10 + random.below(500)) * 1_000_000_000 + i64::from(random.below(999));
    Config {
        steps_per_mm: [StepsPerMm::from_nanos(scale); 3],
        max_rate: [rate, 0.8 * rate, 0.1 * rate],
        acceleration: [acceleration, 0.7 * acceleration, 0.2 * acceleration],
        jerk: if random.below(3) == 0 {
            random.ten_to(1e3, 3)
        } else {
            0.0
        },
        junction_deviation: 0.001 + 0.1 * random.share(),
        corner_rule: if random.below(3) == 0 {
            CornerRule::Grbl
        } else {
            CornerRule::default()
        },
        shortest_tick: Ticks(336 + random.below(600)),
        longest_segment: 475e-6,
        ..Config::default()
    }
}

fn next_move(random: &mut Random, at: &mut [i64; 3], row: bool) -> Move<3> {
    let size = random.ten_to(0.01, 4) * 1e6;
    for (axis, place) in at.iter_mut().enumerate() {
        let way = (2.0 * random.share() - 1.0) * size;
        *place += match (row, axis) {
            (true, 0) => 100_000,
            (true, _) => 0,
            (false, _) => way as i64,
        };
    }
    let share = U1F31::from_bits(random.below(1 << 31));
    let power = Power::from_share(share);
    Move {
        target: at.map(Coordinate::from_nanos),
        feed: match random.below(8) {
            _ if row => Feed::PerMinute(40.0),
            0 => Feed::Rapid,
            1 => Feed::InverseTime(random.ten_to(0.1, 2)),
            _ => Feed::PerMinute(random.ten_to(0.1, 4)),
        },
        power: match random.below(4) {
            0 if !row => MovePower::Off,
            1 if !row => MovePower::Constant { power },
            _ => MovePower::Dynamic { power },
        },
        curve: None,
        rounding: THREE_DECIMALS,
        outputs: OutputChange::NONE,
        line_number: None,
        kind: MoveKind::Feed,
    }
}

/// Holds, resumes and overrides now and then.
fn meddle(random: &mut Random, planner: &mut ThePlanner<'_>, segmenter: &mut Segmenter<3, 3>) {
    match random.below(60) {
        0 => segmenter.hold(),
        1 => segmenter.resume(),
        2 => planner
            .set_overrides(Overrides {
                feed: 10 + random.below(190) as u8,
                rapid: 50,
            })
            .unwrap(),
        _ if segmenter.is_held() => segmenter.resume(),
        _ => {}
    }
}

/// Runs one program.
fn run(seed: u32, sum: &mut Checksum) {
    let random = &mut Random(u64::from(seed) << 24 | 0x9E_3779);
    (0..8).for_each(|_| {
        random.bits();
    });
    let config = config(random);
    let (mut queue, mut pixels) = (Queue::<3, 3, 32>::new(), PixelQueue::<64>::new());
    let mut planner = Planner::new(config, Cartesian, &mut queue, &mut pixels).unwrap();
    let mut waiting = Deque::<_, 16>::new();
    let (mut segmenter, mut lead) = (Segmenter::new(), PowerLead::new(&mut waiting));
    lead.set(random.below(4) * 300, config.timer_hz);
    let (mut at, mut moves, mut segments) = ([0; 3], 0, 0);
    while segments < SEGMENTS {
        while moves < MOVES && planner.has_room() {
            let row = seed & 3 == 0 && moves % 20 > 4;
            let next = next_move(random, &mut at, row);
            moves += 1;
            if let Ok(Pushed::Queued | Pushed::Merged) = planner.push(&next) {
                let newest = planner.newest();
                for of in newest.iter() {
                    for real in [of.length, of.acceleration, of.rate, of.feed] {
                        sum.add_real(real);
                    }
                }
            }
        }
        meddle(random, &mut planner, &mut segmenter);
        match lead.next(u64::MAX, || segmenter.next(&mut planner)) {
            Some(segment) => sum.add_segment(&segment),
            None if segmenter.is_held() => segmenter.resume(),
            None => break,
        }
        segments += 1;
    }
    sum.add_real(segmenter.speed());
    sum.add(segments.into());
}

/// The checksum of all programs.
pub(crate) fn checksum() -> u64 {
    let mut sum = Checksum(0xCBF2_9CE4_8422_2325);
    (0..PROGRAMS).for_each(|seed| run(seed, &mut sum));
    sum.0
}
