use super::*;
use proptest::prelude::*;

fn ten_to(exponent: std::ops::Range<f32>) -> impl Strategy<Value = f32> {
    exponent.prop_map(|e| 10f32.powf(e))
}

fn limits() -> impl Strategy<Value = Limits> {
    (ten_to(2.0..6.6), ten_to(3.0..9.0))
        .prop_map(|(acceleration, jerk)| Limits { acceleration, jerk })
}

fn speed() -> impl Strategy<Value = f32> {
    prop_oneof![Just(0.0f32), ten_to(0.0..5.5)]
}

fn exact(ramp: &Ramp, t: f64) -> (f64, f64) {
    ramp.exact(t)
}

proptest! {
    #[test]
    fn a_ramp_keeps_both_limits_and_ends_where_it_should(v0 in speed(), v1 in speed(), limits in limits()) {
        let ramp = Ramp::between(v0, v1, limits);
        prop_assert!(ramp.peak() <= limits.acceleration && ramp.jerk.abs() <= limits.jerk, "{:?}", ramp);
        let (x, v) = exact(&ramp, f64::from(ramp.duration()));
        let scale = f64::from(v0.max(v1));
        prop_assert!((v - f64::from(v1)).abs() <= 1e-6 * scale, "{} {}", v, v1);
        prop_assert!((x - f64::from(ramp.length())).abs() <= 1e-6 * x, "{} {}", x, ramp.length());
        prop_assert_eq!(ramp.length(), length(v0, v1, limits));
    }

    #[test]
    fn the_time_of_a_place_is_exact(v0 in speed(), v1 in speed(), limits in limits(), share in 0.0f32..1.0) {
        let ramp = Ramp::between(v0, v1, limits);
        let x = share * ramp.length();
        let t = ramp.time(0.0, x);
        let (at, v) = exact(&ramp, t.into());
        // A place is as exact as an f32 can say it.
        let slack = 4e-7 * f64::from(ramp.length()) + 2e-6 * f64::from(x);
        let time = 4e-7 * f64::from(ramp.duration()) * v;
        prop_assert!((at - f64::from(x)).abs() <= slack + time, "{} {} {:?}", at, x, ramp);
    }

    #[test]
    fn places_further_on_are_reached_later(v0 in speed(), v1 in speed(), limits in limits()) {
        let ramp = Ramp::between(v0, v1, limits);
        let mut last = 0.0;
        // The last place is beyond the end by rounding.
        let places = (0..=200).map(|k| ramp.length() * k as f32 / 200.0);
        for (k, x) in places.chain([ramp.length().next_up()]).enumerate() {
            let time = ramp.time(0.0, x);
            prop_assert!(time >= last * (1.0 - 1e-6), "{} {} {}", k, time, last);
            last = time;
        }
    }

    /// Leaving a ramp half-way and joining it again changes nothing.
    #[test]
    fn a_ramp_that_is_joined_goes_on_as_before(v0 in speed(), v1 in speed(), limits in limits(), share in 0.05f32..0.95) {
        let ramp = Ramp::between(v0, v1, limits);
        let grown = share * ramp.ease;
        let x = ramp.place(grown);
        let (speed, acceleration) = ramp.motion(x);
        if (speed - v0).abs() <= 1e-3 * speed {
            return Ok(()); // it has hardly begun
        }
        let rest = Ramp::joined(speed, acceleration, v1, limits).unwrap();
        let due = ramp.length() - x;
        prop_assert!((rest.length() - due).abs() <= 1e-3 * ramp.length(), "{} {}", rest.length(), due);
        let (now, a) = rest.motion(0.0);
        prop_assert!((now - speed).abs() <= 1e-3 * speed && (a - acceleration).abs() <= 1e-2 * ramp.peak());
    }

    #[test]
    fn an_easing_ramp_begins_as_it_is_and_ends_level(v in ten_to(2.0..5.5), share in -0.9f32..0.9, limits in limits()) {
        let most = (limits.jerk * v).sqrt().min(limits.acceleration);
        let acceleration = share * most;
        let ramp = Ramp::easing(v, acceleration, limits);
        let (speed, a) = ramp.motion(0.0);
        prop_assert!((speed - v).abs() <= 1e-3 * v && (a - acceleration).abs() <= 1e-2 * most, "{:?}", ramp);
        prop_assert!(ramp.motion(ramp.length()).1.abs() <= 1e-2 * most);
    }
}

#[test]
fn a_small_change_never_reaches_the_acceleration() {
    let limits = Limits {
        acceleration: 1000.0,
        jerk: 1000.0,
    };
    let ramp = Ramp::between(10.0, 20.0, limits);
    assert!(ramp.peak() <= 100.001 && ramp.peak() > 99.99);
    assert_eq!(ramp.steady, 0.0);
}

#[test]
fn no_change_is_no_ramp() {
    let limits = Limits {
        acceleration: 1000.0,
        jerk: 1000.0,
    };
    assert_eq!(Ramp::between(5.0, 5.0, limits), Ramp::none(5.0));
}
