//! Compares the steps at the pins with the simulator's.
use crate::{
    bench::{ensure, Failure},
    desk::Planned,
    pins::{CPU_HZ, CYCLES_PER_COUNT},
    steps::Step,
};
use std::array::from_fn;

/// Checks that every step event is there, in the same order, with the same motors and directions,
/// and that every interval in motion is the same number of timer counts.
pub(crate) fn to_the_tick(ours: &[Step], planned: &[Planned]) -> Result<(), Failure> {
    let mut last: Option<(&Step, &Planned)> = None;
    for (index, (our, plan)) in ours.iter().zip(planned).enumerate() {
        ensure(
            (our.motors, our.negative) == (plan.motors, plan.negative),
            || format!("step event {index}: {our:?}, planned {plan:?}"),
        )?;
        if let (Some((before, planned_before)), false) = (last, plan.first) {
            let interval = our.due - before.due;
            let expected = plan.due - planned_before.due;
            ensure(interval == expected, || {
                format!("step event {index}: {interval} counts after the one before, planned {expected}")
            })?;
        }
        ensure(!our.late, || format!("step event {index} is late: {our:?}"))?;
        last = Some((our, plan));
    }
    ensure(ours.len() == planned.len(), || {
        format!("{} step events, planned {}", ours.len(), planned.len())
    })
}

/// Checks that every motor makes the same steps in the same directions, at whatever times.
pub(crate) fn same_ways(ours: &[Step], planned: &[Planned]) -> Result<(), Failure> {
    let paths = ways(ours).into_iter().zip(planned_ways(planned));
    for (motor, (path, expected)) in paths.enumerate() {
        ensure(path == expected, || {
            let differs = path.iter().zip(&expected).position(|(a, b)| a != b);
            let runs = expected.len();
            format!("motor {motor}: its steps differ in run {differs:?} of {runs}")
        })?;
    }
    Ok(())
}

/// Checks that every motor makes the same steps in the same directions, and that motion takes as
/// long within the share `tolerance`. Returns the ratio of the times.
pub(crate) fn in_path(ours: &[Step], planned: &[Planned], tolerance: f64) -> Result<f64, Failure> {
    same_ways(ours, planned)?;
    let time = span(ours.iter().map(|step| step.due));
    let expected = span(planned.iter().map(|step| step.due));
    let ratio = time / expected;
    ensure((ratio - 1.0).abs() <= tolerance, || {
        format!("motion takes {time:.4} s, planned {expected:.4} s")
    })?;
    Ok(ratio)
}

/// The steps of a motor as runs in one direction: the signed number of steps of each run.
fn runs(steps: impl Iterator<Item = (u8, u8)>, motor: usize) -> Vec<i64> {
    let mut runs: Vec<i64> = Vec::new();
    for (motors, negative) in steps {
        if motors >> motor & 1 == 0 {
            continue;
        }
        let step = 1 - 2 * i64::from(negative >> motor & 1);
        match runs.last_mut() {
            Some(run) if run.signum() == step => *run += step,
            _ => runs.push(step),
        }
    }
    runs
}

/// The runs of each motor at the pins, from reversal to reversal, signed steps.
pub(crate) fn ways(ours: &[Step]) -> [Vec<i64>; 4] {
    from_fn(|motor| runs(ours.iter().map(|step| (step.motors, step.negative)), motor))
}

/// The runs of each motor in the planned steps, signed steps.
pub(crate) fn planned_ways(planned: &[Planned]) -> [Vec<i64>; 4] {
    let steps = || planned.iter().map(|step| (step.motors, step.negative));
    from_fn(|motor| runs(steps(), motor))
}

/// The time from the first of some instants to the last, s.
fn span(mut dues: impl Iterator<Item = u64>) -> f64 {
    let first = dues.next().unwrap_or(0);
    let last = dues.last().unwrap_or(first);
    ((last - first) * CYCLES_PER_COUNT) as f64 / CPU_HZ as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planned() -> Vec<Planned> {
        let step = |due, motors, first| Planned {
            due,
            motors,
            negative: 0,
            first,
        };
        vec![
            step(1000, 1, true),
            step(1100, 3, false),
            step(1250, 1, false),
            step(9000, 1, true),
        ]
    }

    fn made(planned: &[Planned]) -> Vec<Step> {
        let step = |plan: &Planned| Step {
            due: plan.due + 77,
            latency: 60,
            late: false,
            motors: plan.motors,
            negative: plan.negative,
        };
        planned.iter().map(step).collect()
    }

    #[test]
    fn the_same_steps_at_another_time_are_the_same() {
        to_the_tick(&made(&planned()), &planned()).unwrap();
        assert_eq!(in_path(&made(&planned()), &planned(), 0.0).unwrap(), 1.0);
    }

    #[test]
    fn the_main_loop_says_when_motion_starts_again() {
        let mut ours = made(&planned());
        ours[3].due += 500;
        to_the_tick(&ours, &planned()).unwrap();
        assert!(in_path(&ours, &planned(), 0.01).is_err());
    }

    #[test]
    fn one_count_one_motor_one_direction_or_one_step_too_many_is_found() {
        let faults: [fn(&mut Vec<Step>); 5] = [
            |steps| steps[2].due += 1,
            |steps| steps[1].motors = 2,
            |steps| steps[1].negative = 2,
            |steps| steps.push(steps[3]),
            |steps| steps[0].late = true,
        ];
        for (number, fault) in faults.into_iter().enumerate() {
            let mut ours = made(&planned());
            fault(&mut ours);
            assert!(to_the_tick(&ours, &planned()).is_err(), "fault {number}");
        }
        let mut ours = made(&planned());
        ours[1].negative = 2;
        assert!(in_path(&ours, &planned(), 1.0).is_err());
    }
}
