//! The limits, their names, and the settings that set them.

use leadscrew_machine::explain::Ahead;

/// The limit of a move's speed if it neither speeds up nor slows down.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum SpeedLimit {
    /// The program's `F`.
    Feed,
    /// The highest rate of an axis.
    Rate(usize),
    /// An arc: the acceleration towards its centre.
    Arc,
    /// A limit that the planner found along the path: a curve that consists of short lines.
    Curve,
    /// The highest rate of steps that the board makes.
    StepRate,
}

/// A place that has to be passed slowly.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Slow {
    /// A corner: junction deviation.
    Corner,
    /// The start or the end of a rest that the program asks for.
    Stop,
    /// The end of the look-ahead: no more moves fit the queue.
    LookAhead,
    /// The next line did not come in time: the serial line or the machine's CPU was too slow.
    NoLine,
    /// A slower move, whose speed has this limit.
    Move(SpeedLimit),
}

/// The limit that keeps the speed from being higher.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Limit {
    /// A limit of the move itself.
    Speed(SpeedLimit),
    /// The acceleration of an axis, on the way to or from a slow place.
    Acceleration(usize, Slow),
    /// Slow places all along the move: there is no room to speed up between them.
    Slow(Slow),
    /// The machine has nothing to move: a dwell, a pause, waiting for lines.
    Rest,
    /// The machine moves on its own (homing).
    Cycle,
}

impl Slow {
    /// The reason to slow down; `curve` if the curvature of the path limits the speed. The limit
    /// of a slower move is filled in later, once that move has come.
    pub(super) fn new(ahead: Ahead, curve: SpeedLimit) -> Self {
        match ahead {
            Ahead::Stop => Self::Stop,
            Ahead::LookAhead => Self::LookAhead,
            Ahead::NoLine => Self::NoLine,
            Ahead::Corner => Self::Corner,
            Ahead::Curve => Self::Move(curve),
            Ahead::SlowerMove => Self::Move(SpeedLimit::Feed),
        }
    }
}

/// The letter of an axis in `letters`; `?` if there is none.
fn letter(axis: usize, letters: &[char]) -> char {
    letters.get(axis).copied().unwrap_or('?')
}

impl SpeedLimit {
    /// Returns the limit's name, on a machine whose axes have these letters.
    pub fn name(self, letters: &[char]) -> String {
        match self {
            Self::Feed => "feed".to_owned(),
            Self::Rate(axis) => format!("rate {}", letter(axis, letters)),
            Self::Arc => "arc".to_owned(),
            Self::Curve => "curve".to_owned(),
            Self::StepRate => "step rate".to_owned(),
        }
    }
}

impl Slow {
    /// Returns the place's name, on a machine whose axes have these letters.
    pub fn name(self, letters: &[char]) -> String {
        match self {
            Self::Corner => "corner".to_owned(),
            Self::Stop => "stop".to_owned(),
            Self::LookAhead => "look-ahead".to_owned(),
            Self::NoLine => "no line".to_owned(),
            Self::Move(limit) => format!("slower move: {}", limit.name(letters)),
        }
    }
}

impl Limit {
    /// Returns the limit's name in a list, on a machine whose axes have these letters.
    pub fn name(self, letters: &[char]) -> String {
        match self {
            Self::Speed(limit) => limit.name(letters),
            Self::Acceleration(axis, _) => format!("acceleration {}", letter(axis, letters)),
            Self::Slow(slow) => slow.name(letters),
            Self::Rest => "rest".to_owned(),
            Self::Cycle => "cycle".to_owned(),
        }
    }

    /// Returns the slow place for which a ramp speeds up or slows down; empty for other limits.
    pub fn because(self, letters: &[char]) -> String {
        match self {
            Self::Acceleration(_, slow) => slow.name(letters),
            Self::Speed(_) | Self::Slow(_) | Self::Rest | Self::Cycle => String::new(),
        }
    }

    /// Returns the settings and words of the program that can raise this limit.
    pub fn held_by(self) -> String {
        match self {
            Self::Speed(limit) => limit.held_by(),
            Self::Acceleration(axis, slow) => match slow {
                Slow::Corner => format!("${} $11", 120 + axis),
                Slow::Stop | Slow::LookAhead | Slow::NoLine => format!("${}", 120 + axis),
                Slow::Move(limit) => join(&format!("${}", 120 + axis), &limit.held_by()),
            },
            Self::Slow(slow) => match slow {
                Slow::Corner => "$11".to_owned(),
                Slow::Stop | Slow::LookAhead | Slow::NoLine => String::new(),
                Slow::Move(limit) => limit.held_by(),
            },
            Self::Rest | Self::Cycle => String::new(),
        }
    }
}

fn join(one: &str, other: &str) -> String {
    if other.split(' ').any(|word| word == one) {
        return other.to_owned();
    }
    format!("{one} {other}").trim_end().to_owned()
}

impl SpeedLimit {
    fn held_by(self) -> String {
        match self {
            Self::Feed => "F".to_owned(),
            Self::Rate(axis) => format!("${}", 110 + axis),
            Self::Arc | Self::Curve => "$120 $121".to_owned(),
            Self::StepRate => String::new(),
        }
    }
}

/// The settings of each axis from which limits are found.
#[derive(Clone, PartialEq, Debug)]
pub struct Machine {
    /// Millimetres in a step.
    pub mm_per_step: Vec<f64>,
    /// Highest rate, mm/s.
    pub rate: Vec<f64>,
    /// Highest acceleration, mm/s².
    pub acceleration: Vec<f64>,
    /// Highest rate of steps that the board makes, steps/s.
    pub step_rate: f64,
    /// True if motors 0 and 1 turn X and Y together, by crossed belts.
    pub crossed: bool,
}

/// The data of a move that its limits depend on.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Limits {
    /// Steps of each motor, without their direction.
    pub(super) steps: Vec<u32>,
    /// Length of the path, mm.
    pub(super) length: f64,
    /// The speed if the move neither speeds up nor slows down, mm/s.
    pub(super) nominal: f64,
    /// The limit that sets `nominal`.
    pub(super) speed_limit: SpeedLimit,
    /// True if it is a chord of an arc.
    pub(super) is_arc: bool,
    /// The axis whose acceleration binds on ramps.
    pub(super) axis: usize,
}

/// The relative difference up to which two computations of a limit in `f32` count as equal.
const SAME: f64 = 1e-4;

impl Machine {
    /// The length of the path of a move with these steps, mm.
    pub(super) fn length(&self, steps: &[i32]) -> f64 {
        let ways = self.ways(steps).into_iter();
        ways.map(|mm| mm * mm).sum::<f64>().sqrt()
    }

    /// Returns how far each axis goes in a move with these steps of the motors, mm, without its
    /// direction.
    fn ways(&self, steps: &[i32]) -> Vec<f64> {
        let motors = steps.iter().zip(&self.mm_per_step);
        let mut ways: Vec<f64> = motors.map(|(steps, mm)| f64::from(*steps) * mm).collect();
        if let (true, [a, b, ..]) = (self.crossed, ways.as_mut_slice()) {
            (*a, *b) = (0.5 * (*a + *b), 0.5 * (*a - *b));
        }
        ways.into_iter().map(f64::abs).collect()
    }

    /// The limits of a move with these steps. It was planned with `rate` (the highest, mm/s),
    /// `feed` (the programmed one, mm/s; `None` for a rapid) and the limit of an arc.
    pub(super) fn limits(
        &self,
        steps: &[i32],
        rate: f64,
        feed: Option<f64>,
        arc: Option<f64>,
    ) -> Limits {
        let ways = self.ways(steps);
        let length = self.length(steps);
        let (rate_axis, by_axis) = least(&self.rate, &ways, length);
        let most_steps = steps.iter().map(|steps| steps.unsigned_abs()).max();
        let by_steps = self.step_rate * length / f64::from(most_steps.unwrap_or(1));
        let fastest = by_axis.min(by_steps);
        let (axis, _) = least(&self.acceleration, &ways, length);
        let below = |limit: f64| rate < limit * (1.0 - SAME);
        let speed_limit = match arc {
            _ if feed.is_some_and(|feed| feed <= rate) => SpeedLimit::Feed,
            Some(arc) if below(fastest) && !below(arc) => SpeedLimit::Arc,
            Some(_) | None if below(fastest) => SpeedLimit::Curve,
            Some(_) | None if by_steps < by_axis => SpeedLimit::StepRate,
            Some(_) | None => SpeedLimit::Rate(rate_axis),
        };
        Limits {
            steps: steps.iter().map(|steps| steps.unsigned_abs()).collect(),
            length,
            nominal: feed.map_or(rate, |feed| rate.min(feed)),
            speed_limit,
            is_arc: arc.is_some(),
            axis,
        }
    }
}

/// The axis with the smallest limit along the path, and this limit: `limit_i / |u_i|`.
fn least(limits: &[f64], ways: &[f64], length: f64) -> (usize, f64) {
    let along = limits
        .iter()
        .zip(ways)
        .map(|(limit, way)| limit * length / way);
    along
        .enumerate()
        .filter(|(_, limit)| limit.is_finite())
        .fold((0, f64::INFINITY), |best, next| {
            if next.1 < best.1 {
                next
            } else {
                best
            }
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine() -> Machine {
        Machine {
            mm_per_step: vec![0.01; 2],
            rate: vec![10.0, 5.0],
            acceleration: vec![100.0, 300.0],
            step_rate: 1e4,
            crossed: false,
        }
    }

    fn speed_limit(steps: [i32; 2], rate: f64, feed: f64, arc: Option<f64>) -> SpeedLimit {
        machine().limits(&steps, rate, Some(feed), arc).speed_limit
    }

    #[test]
    fn the_least_of_feed_rate_and_curve_is_named() {
        assert_eq!(speed_limit([100, 0], 10.0, 4.0, None), SpeedLimit::Feed);
        assert_eq!(
            speed_limit([-100, 0], 10.0, 40.0, None),
            SpeedLimit::Rate(0)
        );
        assert_eq!(
            speed_limit([100, 100], 7.071, 40.0, None),
            SpeedLimit::Rate(1)
        );
        assert_eq!(speed_limit([100, 0], 3.0, 40.0, Some(3.0)), SpeedLimit::Arc);
        assert_eq!(
            speed_limit([100, 0], 10.0, 40.0, Some(30.0)),
            SpeedLimit::Rate(0)
        );
        assert_eq!(speed_limit([100, 0], 3.0, 40.0, None), SpeedLimit::Curve);
        let rapid = machine().limits(&[100, 0], 10.0, None, None);
        assert_eq!(
            (rapid.speed_limit, rapid.nominal),
            (SpeedLimit::Rate(0), 10.0)
        );
    }

    #[test]
    fn the_board_s_step_rate_is_named_where_it_is_less_than_the_axis_s() {
        let slow = Machine {
            step_rate: 400.0, // 4 mm/s of one axis
            ..machine()
        };
        let limit = |steps: [i32; 2], rate| slow.limits(&steps, rate, Some(40.0), None).speed_limit;
        assert_eq!(limit([100, 0], 4.0), SpeedLimit::StepRate);
        assert_eq!(limit([100, 100], 4.0 * 2f64.sqrt()), SpeedLimit::StepRate);
        assert_eq!(limit([100, 0], 3.0), SpeedLimit::Curve);
    }

    #[test]
    fn the_axis_that_allows_least_acceleration_along_the_path_is_named() {
        let axis = |steps: [i32; 2]| machine().limits(&steps, 1.0, None, None).axis;
        assert_eq!((axis([100, 100]), axis([10, 100]), axis([0, 5])), (0, 1, 1));
    }

    #[test]
    fn crossed_belts_have_the_limits_and_the_length_of_their_axes() {
        let crossed = Machine {
            crossed: true,
            ..machine()
        };
        // Both motors make 100 steps: in the same direction they move X alone by 1 mm, in opposite
        // directions Y alone.
        let of = |steps: [i32; 2]| crossed.limits(&steps, 1.0, None, None);
        assert_eq!((of([100, 100]).length, of([100, 100]).axis), (1.0, 0));
        assert_eq!((of([-100, 100]).length, of([-100, 100]).axis), (1.0, 1));
        // One motor alone moves both axes, each half as far.
        assert!((of([200, 0]).length - 2f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn what_to_change_names_each_setting_once() {
        let arc = Limit::Acceleration(0, Slow::Move(SpeedLimit::Arc));
        assert_eq!(arc.held_by(), "$120 $121");
        let feed = Limit::Acceleration(1, Slow::Move(SpeedLimit::Feed));
        assert_eq!(feed.held_by(), "$121 F");
        assert_eq!(Limit::Acceleration(2, Slow::Stop).held_by(), "$122");
    }
}
