//! The colours of paths: the same as on the page of `serve`.

/// Colours of depth, from the top of the material down, equally spaced. Each differs clearly from
/// white and from black.
const DEPTH: [[f64; 3]; 5] = [
    [0.93, 0.64, 0.10],
    [0.88, 0.34, 0.18],
    [0.72, 0.22, 0.50],
    [0.42, 0.36, 0.80],
    [0.16, 0.52, 0.85],
];
const TRAVEL: [f64; 3] = [0.62, 0.69, 0.76];
const POWER_OFF: [f64; 3] = [0.78, 0.81, 0.85];
const POWER_FULL: [f64; 3] = [0.08, 0.09, 0.11];
/// The share of white in a pale colour.
const PALE: f64 = 0.65;

/// The colour of moves that do not cut.
pub(super) fn travel() -> String {
    hex(TRAVEL)
}

/// The colour of the box of the axes' travel.
pub(super) fn travel_box() -> &'static str {
    "#7a8794"
}

/// The colour of a laser at `share` of full power, 0 to 1.
pub(super) fn power(share: f64) -> String {
    hex(mixed(POWER_OFF, POWER_FULL, share))
}

/// The laser's colour as a grey level, 0 black to 255 white.
pub(super) fn grey(share: f64) -> u8 {
    byte(mixed(POWER_OFF, POWER_FULL, share)[1])
}

/// The colour of a cut at `share` of the job's depth, from 0 (highest) to 1 (lowest).
pub(super) fn depth(share: f64) -> String {
    hex(depth_colour(share))
}

/// The pale colour of the material that a tool takes away, at `share` of the job's depth.
pub(super) fn pale_depth(share: f64) -> String {
    hex(mixed(depth_colour(share), [1.0; 3], PALE))
}

fn depth_colour(share: f64) -> [f64; 3] {
    let at = share.clamp(0.0, 1.0) * (DEPTH.len() - 1) as f64;
    let below = (at as usize).min(DEPTH.len() - 2);
    mixed(DEPTH[below], DEPTH[below + 1], at - below as f64)
}

fn mixed(from: [f64; 3], to: [f64; 3], share: f64) -> [f64; 3] {
    [0, 1, 2].map(|part: usize| from[part] + (to[part] - from[part]) * share)
}

fn byte(part: f64) -> u8 {
    (part * 255.0).round() as u8
}

fn hex(colour: [f64; 3]) -> String {
    let [r, g, b] = colour.map(byte);
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_the_same_colours() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../page/web/colours.js");
        let page = std::fs::read_to_string(file).unwrap();
        let listed =
            |colour: [f64; 3]| format!("[{:.2}, {:.2}, {:.2}]", colour[0], colour[1], colour[2]);
        for colour in DEPTH.into_iter().chain([TRAVEL, POWER_OFF, POWER_FULL]) {
            assert!(page.contains(&listed(colour)), "{colour:?}");
        }
    }

    /// The contrast of a colour with white, as WCAG 2 measures it.
    fn contrast(colour: [f64; 3]) -> f64 {
        let linear = colour.map(|part| match part <= 0.04045 {
            true => part / 12.92,
            false => ((part + 0.055) / 1.055).powf(2.4),
        });
        let light = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
        1.05 / (light + 0.05)
    }

    #[test]
    fn every_colour_is_told_from_the_grid() {
        let grid = contrast([228.0 / 255.0; 3]);
        for colour in DEPTH.into_iter().chain([TRAVEL, POWER_OFF, POWER_FULL]) {
            assert!(contrast(colour) > 1.2 * grid, "{colour:?}");
        }
    }

    #[test]
    fn the_ends_of_a_ramp_are_its_first_and_its_last_colour() {
        assert_eq!(depth(0.0), hex(DEPTH[0]));
        assert_eq!(depth(1.0), hex(DEPTH[4]));
        assert_eq!(power(1.0), hex(POWER_FULL));
        assert!(grey(0.0) > grey(0.5) && grey(0.5) > grey(1.0));
    }
}
