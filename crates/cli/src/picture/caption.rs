//! The data that a picture is given beside the path.

/// The words around the picture.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Caption {
    /// The job's name.
    pub(crate) title: String,
    /// One line of figures: time, distance, lines.
    pub(crate) summary: String,
    /// The tool's work on the material: `cut` or `extruded`.
    pub(crate) work: &'static str,
    /// The S value of a laser's full power (`$30`), at the dark end of the scale; `None` if S is
    /// a spindle's speed.
    pub(crate) full_power_s: Option<f64>,
    /// The ends of the travel of X and Y, mm; `None` if the path's place in it is not known.
    pub(crate) travel: Option<[[f32; 2]; 2]>,
}
