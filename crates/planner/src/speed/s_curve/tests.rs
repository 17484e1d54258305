use super::*;
use proptest::prelude::*;
use std::vec::Vec;

fn ten_to(exponent: std::ops::Range<f32>) -> impl Strategy<Value = f32> {
    exponent.prop_map(|e| 10f32.powf(e))
}

#[derive(Clone, Copy, Debug)]
struct Case {
    plan: Plan,
    jerk: f32,
}

fn cases() -> impl Strategy<Value = Case> {
    (
        ten_to(0.0..4.5),
        0.0f32..1.0,
        0.0f32..1.0,
        ten_to(1.0..5.4),
        ten_to(2.5..6.5),
        ten_to(-2.0..2.0),
        prop_oneof![Just(0.0f32), ten_to(0.0..4.5)],
    )
        .prop_map(
            |(events, entry, exit, cruise, acceleration, seconds, beyond)| {
                let (entry, exit) = (
                    (entry - 0.3).max(0.0) * cruise,
                    (exit - 0.3).max(0.0) * cruise,
                );
                let plan = Plan {
                    start: Place::at(0),
                    end: events as u32,
                    beyond,
                    entry_v2: entry * entry,
                    cruise,
                    exit_v2: exit * exit,
                    up: acceleration,
                    down: acceleration,
                };
                Case {
                    plan,
                    jerk: acceleration / seconds,
                }
            },
        )
}

impl Case {
    /// The profile; where its end cannot be reached, the profile to rest or one that goes on as
    /// fast as it begins.
    fn profile(&self) -> Option<SCurve> {
        let exits = [self.plan.exit_v2, 0.0, self.plan.entry_v2];
        exits.into_iter().find_map(|exit_v2| {
            let plan = Plan {
                exit_v2,
                ..self.plan
            };
            SCurve::new(&plan, 0.0, self.jerk)
        })
    }
}

/// Times of all steps by the profile, in `f64` seconds.
fn times(profile: &SCurve) -> Vec<f64> {
    let mut at = 0.0;
    (profile.start().step()..profile.end())
        .map(|step| {
            at += f64::from(profile.time_over(Place::at(step), 1.0).0);
            at
        })
        .collect()
}

proptest! {
    /// Checks speed, acceleration and jerk from step to step.
    #[test]
    fn no_limit_is_passed(case in cases()) {
        let Case { plan, jerk } = case;
        let Some(profile) = case.profile() else { return Ok(()) };
        let fastest = plan.cruise.max(plan.entry_v2.sqrt());
        let mut last = profile.motion(Place::at(0));
        for step in 1..=plan.end {
            let (speed, acceleration) = profile.motion(Place::at(step));
            prop_assert!(speed <= fastest * 1.000_001, "{} at {}", speed, step);
            prop_assert!(acceleration.abs() <= plan.up * 1.000_001);
            let seconds = profile.time_over(Place::at(step - 1), 1.0).0;
            let change = (acceleration - last.1).abs();
            let slack = 1e-4 * plan.up + 1e-6 * jerk;
            prop_assert!(change <= jerk * seconds * 1.001 + slack, "jerk {} {} {:?}", change / seconds, jerk, profile);
            last = (speed, acceleration);
        }
        prop_assert!(plan.beyond > 0.0 || last.1.abs() <= 1e-2 * plan.up + 1e-6 * jerk, "{:?}", last);
    }

    /// The profile agrees with itself: its times follow from its speeds.
    #[test]
    fn time_and_speed_agree(case in cases()) {
        let Some(profile) = case.profile() else { return Ok(()) };
        for step in 0..case.plan.end {
            let (v0, v1) = (profile.motion(Place::at(step)).0, profile.motion(Place::at(step + 1)).0);
            let seconds = profile.time_over(Place::at(step), 1.0).0;
            prop_assert!(seconds > 0.0);
            let mean = 1.0 / seconds;
            let peak = profile.motion(Place::at(step)).1 * profile.motion(Place::at(step + 1)).1 <= 0.0;
            // Places are known to some 10⁻⁷ of the ramp: 10⁻³ of a step.
            let most = v0.max(v1).max(if peak { profile.level } else { 0.0 });
            prop_assert!(mean <= most * 1.001, "{} {} {}", v0, mean, v1);
            // A step out of rest takes three times as long as its end speed says, at most.
            prop_assert!(mean >= 0.3 * v0.min(v1).max(0.3 * v0.max(v1)), "{} {} {}", v0, mean, v1);
        }
    }

    /// A profile that begins in the middle of another one has its speed and acceleration there.
    #[test]
    fn a_plan_that_changes_half_way_is_smooth(case in cases(), share in 0.0f32..1.0, lower in 0.1f32..2.0) {
        let Case { plan, jerk } = case;
        let Some(before) = case.profile() else { return Ok(()) };
        let step = (share * plan.end as f32) as u32;
        prop_assume!(step < plan.end);
        let (speed, acceleration) = before.motion(Place::at(step));
        let changed = Plan { start: Place::at(step), entry_v2: speed * speed, cruise: lower * plan.cruise, ..plan };
        let Some(after) = SCurve::new(&changed, acceleration, jerk) else { return Ok(()) };
        let (v, a) = after.motion(Place::at(step));
        let slack = 1e-3 * plan.up + 1e-6 * jerk;
        prop_assert!((v - speed).abs() <= 1e-3 * speed + 1e-6, "{} {}", v, speed);
        prop_assert!((a - acceleration).abs() <= slack + 0.05 * acceleration.abs(), "{} {} {:?}", a, acceleration, after);
    }

    #[test]
    fn the_next_move_begins_as_the_one_before_ends(
        case in cases(), events in 1u32..100, ratio in 0.5f32..2.0,
    ) {
        let Some(before) = case.profile() else { return Ok(()) };
        let (speed, acceleration) = before.motion(Place::at(case.plan.end));
        let Some(after) = before.go_on(events, ratio) else {
            prop_assert_eq!(acceleration, 0.0);
            return Ok(());
        };
        let left = before.ends(Place::at(case.plan.end)).1 * ratio;
        if (left - left.round().max(1.0)).abs() <= 0.011 {
            return Ok(()); // it ends with a step, as far as the end of a move is known
        }
        let (v, a) = after.motion(Place::at(0));
        let (slack, jump) = (1e-3 * case.plan.up * ratio, (a - acceleration * ratio).abs());
        prop_assert!((v - speed * ratio).abs() <= 1e-3 * v, "{} {} {:?}", v, speed, before);
        prop_assert!(jump <= slack, "{} {} {:?}", a, acceleration, before);
    }

    #[test]
    fn the_shortest_stop_is_a_plan_that_ends_at_rest(case in cases(), share in 0.0f32..1.0) {
        let Case { plan, jerk } = case;
        let Some(before) = case.profile() else { return Ok(()) };
        let step = (share * plan.end as f32) as u32;
        let (speed, acceleration) = before.motion(Place::at(step));
        prop_assume!(speed > 1.0);
        let steps = SCurve::stop(speed, acceleration, plan.up, jerk).ceil() as u32;
        let stop = Plan { start: Place::at(step), end: step + steps, beyond: 0.0, entry_v2: speed * speed, cruise: speed, exit_v2: 0.0, ..plan };
        let profile = SCurve::new(&stop, acceleration, jerk).unwrap();
        prop_assert_eq!(profile.exit_v2(), 0.0);
    }
}

#[test]
fn a_long_move_reaches_its_cruise_and_takes_the_time_of_the_formula() {
    let plan = Plan {
        start: Place::at(0),
        end: 100_000,
        beyond: 0.0,
        entry_v2: 0.0,
        cruise: 10_000.0,
        exit_v2: 0.0,
        up: 20_000.0,
        down: 20_000.0,
    };
    let profile = SCurve::new(&plan, 0.0, 100_000.0).unwrap();
    assert_eq!(profile.cruise(), 10_000.0);
    // Each ramp: v/a + a/jerk = 0.7 s at the mean speed; the rest at the cruise.
    let due = 2.0 * 0.7 + (100_000.0 - 2.0 * 0.7 * 5000.0) / 10_000.0;
    let time = *times(&profile).last().unwrap();
    assert!((time - due).abs() < 1e-4, "{time} {due}");
}
