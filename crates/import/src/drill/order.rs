//! Puts holes in an order in which no exchange of two legs makes the way shorter.
//!
//! ```text
//! a -> b ... c -> d   becomes   a -> c ... b -> d     the part between is passed backwards
//! ```
//!
//! The way begins and ends at X0 Y0, and makes all holes of a bit before the next bit. At first
//! each leg goes to the nearest hole. Then legs are exchanged (2-opt) as long as that saves time at
//! the machine's speeds. Of two ways with equal time the shorter one is taken. Ways often have
//! equal time, because the slower axis alone sets the time of a leg.

use super::board::Group;
use super::speeds::{distance, place, Place, Speeds};
use super::{levels, Options};
use crate::excellon::Shape;
use crate::Point;

/// The least saving that counts, s or mm: sums of floats differ by less.
const SAVING: f64 = 1e-9;

/// A shape on the way.
struct Stop {
    shape: Shape,
    from: Place,
    to: Place,
}

impl Stop {
    fn new(shape: Shape, ends_at_start: bool) -> Self {
        let from = place(shape.from());
        let to = if ends_at_start {
            from
        } else {
            place(shape.to())
        };
        Self { shape, from, to }
    }

    /// Makes the shape from its other end. A shape that ends where it starts does not change.
    fn reverse(&mut self) {
        if self.from != self.to {
            *self = Self::new(self.shape.reversed(), false);
        }
    }
}

/// Puts the shapes of each bit in order.
pub(super) fn order(groups: &mut [Group], speeds: &Speeds, options: &Options) {
    let mills_back = levels(options).len().is_multiple_of(2);
    let ends_at_start = |shape: &Shape| match shape {
        Shape::Hole(_) => true,
        Shape::Slot { .. } => options.mills_slots && mills_back,
        Shape::Route(_) => mills_back,
    };
    let zero = place(Point::ORIGIN);
    let mut at = zero;
    let mut way: Vec<Vec<Stop>> = Vec::new();
    for group in groups.iter_mut() {
        let shapes = std::mem::take(&mut group.shapes).into_iter();
        let stops = shapes.map(|shape| {
            let back = ends_at_start(&shape);
            Stop::new(shape, back)
        });
        let stops = nearest_first(stops.collect(), at, speeds);
        at = stops.last().map_or(at, |stop| stop.to);
        way.push(stops);
    }
    while improve(&mut way, zero, speeds) {}
    for (group, stops) in groups.iter_mut().zip(way) {
        group.shapes = stops.into_iter().map(|stop| stop.shape).collect();
    }
}

/// Orders the shapes so that each leg goes to the nearest one.
fn nearest_first(mut left: Vec<Stop>, mut at: Place, speeds: &Speeds) -> Vec<Stop> {
    let mut way = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let costs = left
            .iter()
            .map(|stop| (speeds.travel(at, stop.from), distance(at, stop.from)));
        let nearest = costs.enumerate().min_by(|(_, a), (_, b)| {
            let times = a.0.total_cmp(&b.0);
            times.then(a.1.total_cmp(&b.1))
        });
        let stop = left.swap_remove(nearest.map_or(0, |(index, _)| index));
        at = stop.to;
        way.push(stop);
    }
    way
}

/// Goes once through the whole way and exchanges legs; returns whether any were exchanged.
fn improve(way: &mut [Vec<Stop>], zero: Place, speeds: &Speeds) -> bool {
    let mut has_improved = false;
    let mut before = zero;
    for group in 0..way.len() {
        let behind = way.get(group + 1).and_then(|next| next.first());
        let after = behind.map_or(zero, |stop| stop.from);
        let stops = &mut way[group];
        while exchange(stops, before, after, speeds) {
            has_improved = true;
        }
        before = stops.last().map_or(before, |stop| stop.to);
    }
    has_improved
}

/// Tries all pairs of legs of one bit's way, which leads from `before` to `after`.
fn exchange(stops: &mut [Stop], before: Place, after: Place, speeds: &Speeds) -> bool {
    let mut has_improved = false;
    for first in 0..stops.len() {
        let a = if first == 0 {
            before
        } else {
            stops[first - 1].to
        };
        for last in first..stops.len() {
            let (b, c) = (stops[first].from, stops[last].to);
            let d = stops.get(last + 1).map_or(after, |stop| stop.from);
            let saved = |cost: &dyn Fn(Place, Place) -> f64| {
                cost(a, b) + cost(c, d) - cost(a, c) - cost(b, d)
            };
            let time = saved(&|from, to| speeds.travel(from, to));
            if time > SAVING || time > -SAVING && saved(&distance) > SAVING {
                let part = &mut stops[first..=last];
                part.reverse();
                part.iter_mut().for_each(Stop::reverse);
                has_improved = true;
            }
        }
    }
    has_improved
}
