//! The parts of the planner that a build may leave out, by feature. A check of such a constant stands
//! where a part begins, so that the compiler leaves out all that only this part runs.

/// [`CornerRule::Limits`](crate::CornerRule): limits of the axes on curves.
pub(crate) const CURVES: bool = cfg!(feature = "curves");

/// Rows of pixels as one move, and the lead of a laser's power.
pub(crate) const RASTERS: bool = cfg!(feature = "rasters");

/// The limit of the jerk.
pub(crate) const JERK: bool = cfg!(feature = "jerk");

/// Held by what only a limit of the jerk makes: without the feature there is no such value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Jerk {
    /// The build has the limit.
    #[cfg(feature = "jerk")]
    Built,
}

impl Jerk {
    /// The one value, if there is one.
    #[cfg(feature = "jerk")]
    pub(crate) const FOUND: Option<Self> = Some(Self::Built);
    /// The one value, if there is one.
    #[cfg(not(feature = "jerk"))]
    pub(crate) const FOUND: Option<Self> = None;
}
