//! Maps from the squared speed at the end of a move to the squared speed at its start, and their
//! composition (see `lookahead`).

/// The highest speed at which a move may end, and by how much it can brake before that. Squared
/// speeds in units.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Ends {
    /// The highest squared speed at the move's end.
    pub(crate) top: u32,
    /// The amount by which the squared speed can be higher at the start than at the end: for an end
    /// at rest, and for an end at `top`.
    pub(crate) gains: [u32; 2],
}

/// `x_in = min(cap, share·x_out + plus)`: squared speeds in units.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Map {
    cap: u32,
    /// In units of 2⁻³⁰.
    share: u32,
    plus: u32,
}

/// A squared speed at the start of a move.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Reach {
    /// The squared speed, in units.
    pub(super) v2: u32,
    /// True if it would be higher if motion could go on after the last planned move.
    pub(super) bound_by_end: bool,
}

impl Reach {
    /// The squared speed `v2`, or `cap` if that is less: then the end bounds nothing.
    pub(super) fn bounded(v2: u64, cap: u32, bound_by_end: bool) -> Self {
        match u32::try_from(v2) {
            Ok(v2) if v2 < cap => Self { v2, bound_by_end },
            Ok(_) | Err(_) => Self {
                v2: cap,
                bound_by_end: false,
            },
        }
    }
}

const ONE_BITS: u32 = 30;
const ONE: u32 = 1 << ONE_BITS;

/// `x` times `share`, which is in units of 2⁻³⁰.
fn scaled(share: u32, x: u32) -> u64 {
    (u64::from(share) * u64::from(x)) >> ONE_BITS
}

/// The nearest number of 32 bits.
fn clamp(x: u64) -> u32 {
    u32::try_from(x).unwrap_or(u32::MAX)
}

impl Map {
    pub(super) const NONE: Self = Self {
        cap: 0,
        share: 0,
        plus: 0,
    };

    /// The map of a move that brakes by `plus` at every speed.
    fn parallel(cap: u32, plus: u32) -> Self {
        Self {
            cap,
            share: ONE,
            plus,
        }
    }

    /// The line through the gains at rest and at the squared speed `ends.top`.
    pub(super) fn new(cap: u32, ends: Ends) -> Self {
        let (top, [at_rest, at_top]) = (ends.top, ends.gains);
        if at_rest == at_top || top == 0 {
            return Self::parallel(cap, at_rest);
        }
        // The most that the products in [`scaled`] may be rounded up or down, in units.
        const ROUNDED: u32 = 4;
        let slope = at_rest.abs_diff(at_top) as f32 / top as f32 * ONE as f32;
        // Rounding of `f32` may only make the line lower, whether it rises or falls.
        const DOWN: f32 = 1.0 - 4.0 * f32::EPSILON;
        const UP: f32 = 1.0 + 4.0 * f32::EPSILON;
        Self {
            cap,
            share: if at_top > at_rest {
                ONE.saturating_add(ONE.min((slope * DOWN) as u32))
            } else {
                ONE.saturating_sub((slope * UP) as u32).saturating_sub(1)
            },
            plus: at_rest.saturating_sub(ROUNDED),
        }
    }

    /// The map of this block and the move `after` it together.
    pub(super) fn before(self, after: Self) -> Self {
        let share = scaled(self.share, after.share).min(u32::MAX.into()) as u32;
        Self {
            cap: self
                .cap
                .min(clamp(scaled(self.share, after.cap) + u64::from(self.plus))),
            share,
            plus: clamp(scaled(self.share, after.plus) + u64::from(self.plus)),
        }
    }

    /// The squared speed at the start, if the one at the end is `after`.
    pub(super) fn reach(self, after: Reach) -> Reach {
        let v2 = scaled(self.share, after.v2) + u64::from(self.plus);
        Reach::bounded(v2, self.cap, after.bound_by_end)
    }
}
