//! The shapes that tools make: holes, slots and routed paths.

use crate::{Mm, Point};

/// A shape that one tool makes in one place.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Shape {
    /// A hole.
    Hole(Point),
    /// A slot as wide as the tool (`G85`).
    Slot {
        /// Centre of one end.
        from: Point,
        /// Centre of the other end.
        to: Point,
    },
    /// A path that the tool mills (`M15` to `M16`).
    Route(Route),
}

/// A milled path.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Route {
    /// The point at which the tool goes down.
    pub from: Point,
    /// The cuts from there; never empty.
    pub cuts: Vec<Cut>,
}

/// A piece of a milled path.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Cut {
    /// The end of the cut.
    pub to: Point,
    /// The arc of the cut; `None` if it is straight.
    pub arc: Option<Arc>,
}

/// The arc of a cut.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Arc {
    /// True if the arc is clockwise (`G02`).
    pub is_clockwise: bool,
    /// The centre of the arc.
    pub centre: Centre,
}

/// The way in which an arc's centre is given.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Centre {
    /// The distance of the centre from both ends (`A`); the arc is at most half a circle.
    Radius(Mm),
    /// The way from the start to the centre (`I`, `J`).
    Offset(Point),
}

impl Shape {
    /// Returns the point at which the tool first goes down.
    pub fn from(&self) -> Point {
        match self {
            Self::Hole(at) => *at,
            Self::Slot { from, .. } | Self::Route(Route { from, .. }) => *from,
        }
    }

    /// Returns the point at which the tool last comes up.
    pub fn to(&self) -> Point {
        match self {
            Self::Hole(at) => *at,
            Self::Slot { to, .. } => *to,
            Self::Route(route) => route.to(),
        }
    }

    /// Returns the same shape, made from its other end. The result is the same, since slots and
    /// paths without compensation are as wide as the tool.
    pub fn reversed(&self) -> Self {
        match self {
            Self::Hole(at) => Self::Hole(*at),
            Self::Slot { from, to } => Self::Slot {
                from: *to,
                to: *from,
            },
            Self::Route(route) => Self::Route(route.reversed()),
        }
    }

    /// The shape with all its points mapped by `place`, which must keep lengths. `mirrors` tells
    /// whether it mirrors shapes.
    pub(crate) fn placed(&self, place: impl Fn(Point) -> Point, mirrors: bool) -> Self {
        match self {
            Self::Hole(at) => Self::Hole(place(*at)),
            Self::Slot { from, to } => Self::Slot {
                from: place(*from),
                to: place(*to),
            },
            Self::Route(route) => Self::Route(route.placed(&place, mirrors)),
        }
    }

    /// Every point in the shape's data: ends of cuts, but not the bulges of arcs.
    pub(crate) fn points(&self) -> Vec<Point> {
        match self {
            Self::Hole(at) => vec![*at],
            Self::Slot { from, to } => vec![*from, *to],
            Self::Route(route) => {
                let ends = route.cuts.iter().map(|cut| cut.to);
                std::iter::once(route.from).chain(ends).collect()
            }
        }
    }
}

impl Route {
    fn to(&self) -> Point {
        self.cuts.last().map_or(self.from, |cut| cut.to)
    }

    /// The path from its end to its start.
    pub(crate) fn reversed(&self) -> Self {
        let starts = std::iter::once(self.from).chain(self.cuts.iter().map(|cut| cut.to));
        let pieces: Vec<(Point, &Cut)> = starts.zip(&self.cuts).collect();
        let cuts = pieces.iter().rev().map(|(start, cut)| Cut {
            to: *start,
            arc: cut.arc.map(|arc| arc.reversed(*start, cut.to)),
        });
        Self {
            from: self.to(),
            cuts: cuts.collect(),
        }
    }

    fn placed(&self, place: &impl Fn(Point) -> Point, mirrors: bool) -> Self {
        let zero = place(Point::ORIGIN);
        let cut = |cut: &Cut| Cut {
            to: place(cut.to),
            arc: cut.arc.map(|arc| Arc {
                is_clockwise: arc.is_clockwise != mirrors,
                centre: match arc.centre {
                    Centre::Radius(radius) => Centre::Radius(radius),
                    Centre::Offset(offset) => Centre::Offset(place(offset) - zero),
                },
            }),
        };
        Self {
            from: place(self.from),
            cuts: self.cuts.iter().map(cut).collect(),
        }
    }
}

impl Arc {
    fn reversed(self, start: Point, end: Point) -> Self {
        Self {
            is_clockwise: !self.is_clockwise,
            centre: match self.centre {
                Centre::Radius(radius) => Centre::Radius(radius),
                Centre::Offset(offset) => Centre::Offset(start + offset - end),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: i64, y: i64) -> Point {
        let mm = |n: i64| Mm::from_nanos(n * 1_000_000_000);
        Point { x: mm(x), y: mm(y) }
    }

    #[test]
    fn an_arc_from_its_other_end_has_the_same_centre() {
        let arc = Arc {
            is_clockwise: true,
            centre: Centre::Offset(point(5, 0)),
        };
        let cut = |to, arc| Cut { to, arc };
        let route = Shape::Route(Route {
            from: point(0, 0),
            cuts: vec![cut(point(10, 0), Some(arc)), cut(point(10, 3), None)],
        });
        let Shape::Route(back) = route.reversed() else {
            panic!("no route")
        };
        assert_eq!((back.from, back.cuts[0].to), (point(10, 3), point(10, 0)));
        let arc = back.cuts[1].arc.unwrap();
        assert_eq!(back.cuts[1].to, point(0, 0));
        assert!(!arc.is_clockwise);
        assert_eq!(arc.centre, Centre::Offset(point(-5, 0)));
        assert_eq!(route.reversed().reversed(), route);
    }
}
