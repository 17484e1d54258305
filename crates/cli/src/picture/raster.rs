//! Draws rows of pixels as one image: an engraving has as many moves as a photograph has pixels.

use super::ink;
use data_encoding::BASE64;
use leadscrew_sim::scene::{Drawn, Way};
use std::collections::BTreeSet;

/// The number of pixels from which rows are drawn as an image.
const LEAST: usize = 2000;

/// Pixels of the image per pixel of the picture, before the image is made smaller to fit [`MOST`].
const FINE: f64 = 2.0;

/// The largest size of an image, in bytes of base64 text.
const MOST: usize = 700_000;

/// The rows of a job.
pub(super) struct Raster {
    /// The corners of the box around all rows, X and Y in mm.
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
    rows: Vec<Row>,
    /// The distance from one row to the next, mm.
    pitch: f64,
}

/// A move along X at one power.
#[derive(Clone, Copy)]
struct Row {
    y: f64,
    from: f64,
    to: f64,
    power: f64,
}

impl Raster {
    /// Finds the rows of a laser's job; `None` if there are fewer than [`LEAST`].
    pub(super) fn of(moves: &[Drawn]) -> Option<Self> {
        let pairs = moves.windows(2).filter(|pair| is_pixel(pair));
        let rows: Vec<Row> = pairs.map(row).collect();
        if rows.len() < LEAST {
            return None;
        }
        let micrometres = |y: f64| (y * 1000.0).round() as i64;
        let places: BTreeSet<i64> = rows.iter().map(|row| micrometres(row.y)).collect();
        let (first, last) = (*places.first()?, *places.last()?);
        let pitch = (last - first) as f64 / 1000.0 / (places.len().max(2) - 1) as f64;
        let pitch = if pitch > 0.0 { pitch } else { 0.1 };
        let ends = || rows.iter().flat_map(|row| [row.from, row.to]);
        let low = ends().fold(f64::INFINITY, f64::min);
        let high = ends().fold(f64::NEG_INFINITY, f64::max);
        Some(Self {
            low: [low, first as f64 / 1000.0 - pitch / 2.0],
            high: [high, last as f64 / 1000.0 + pitch / 2.0],
            rows,
            pitch,
        })
    }

    /// Returns true if a move is one of the rows, or a travel between rows.
    pub(super) fn has(&self, pair: &[Drawn]) -> bool {
        let inside = |one: &Drawn| {
            (0..2).all(|axis| {
                let at = f64::from(one.to[axis]);
                at >= self.low[axis] - self.pitch && at <= self.high[axis] + self.pitch
            })
        };
        is_pixel(pair) || pair[1].way == Way::Travel && pair.iter().all(inside)
    }

    /// The image as a `data:` address; `per_mm` is the picture's pixels per millimetre.
    pub(super) fn address(&self, per_mm: f64) -> String {
        let mut scale = per_mm * FINE;
        loop {
            let address = self.png(scale);
            if address.len() <= MOST || scale < 0.1 {
                return address;
            }
            scale /= 1.5;
        }
    }

    fn png(&self, scale: f64) -> String {
        let size = [0, 1].map(|axis: usize| {
            (((self.high[axis] - self.low[axis]) * scale).round() as usize).clamp(1, 4000)
        });
        let [width, height] = size;
        let mut pixels = vec![u8::MAX; width * height];
        for row in &self.rows {
            let across = [row.from, row.to].map(|x| (x - self.low[0]) * scale);
            let up = [-0.5, 0.5].map(|half| (self.high[1] - row.y + half * self.pitch) * scale);
            let columns = span(across, width);
            for line in span(up, height) {
                for pixel in &mut pixels[line * width..][columns.clone()] {
                    *pixel = (*pixel).min(ink::grey(row.power));
                }
            }
        }
        let bytes = encoded(&pixels, width, height);
        format!("data:image/png;base64,{}", BASE64.encode(&bytes))
    }
}

/// The pixels that an extent covers, at least one.
fn span(ends: [f64; 2], most: usize) -> std::ops::Range<usize> {
    let low = ends[0].min(ends[1]).round().max(0.0) as usize;
    let high = ends[0].max(ends[1]).round().max(0.0) as usize;
    let low = low.min(most - 1);
    low..high.clamp(low + 1, most)
}

fn is_pixel(pair: &[Drawn]) -> bool {
    let flat = |axis: usize| (pair[0].to[axis] - pair[1].to[axis]).abs() < 1e-4;
    pair[1].way == Way::Cut && flat(1) && flat(2) && !flat(0)
}

fn row(pair: &[Drawn]) -> Row {
    Row {
        y: pair[1].to[1].into(),
        from: pair[0].to[0].into(),
        to: pair[1].to[0].into(),
        power: pair[1].power.into(),
    }
}

/// Grey pixels as PNG; empty if they cannot be encoded, which should not happen.
fn encoded(pixels: &[u8], width: usize, height: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    let written = encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(pixels));
    match written {
        Ok(()) => bytes,
        Err(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(x: f32, y: f32, power: f32) -> Drawn {
        Drawn {
            to: [x, y, 0.0],
            line: 0,
            way: Way::Cut,
            power,
            tool_mm: 0.0,
        }
    }

    /// Rows of 0.1 mm pixels: the left half is burnt, the right half is not.
    fn engraving(rows: usize) -> Vec<Drawn> {
        let mut moves = Vec::new();
        for row in 0..rows {
            let y = row as f32 * 0.1;
            moves.push(Drawn {
                way: Way::Travel,
                ..cut(0.0, y, 0.0)
            });
            moves
                .extend((1..=100).map(|k| cut(k as f32 * 0.1, y, if k <= 50 { 1.0 } else { 0.0 })));
        }
        moves
    }

    #[test]
    fn rows_are_found_with_their_extent_and_few_of_them_are_none() {
        let raster = Raster::of(&engraving(100)).unwrap();
        assert!((raster.low[1] + 0.05).abs() < 1e-3 && (raster.high[1] - 9.95).abs() < 1e-3);
        assert!((raster.high[0] - 10.0).abs() < 1e-3);
        assert!(Raster::of(&engraving(10)).is_none());
    }

    #[test]
    fn the_image_is_dark_where_the_laser_burns() {
        let raster = Raster::of(&engraving(100)).unwrap();
        let address = raster.address(5.0);
        let data = address.strip_prefix("data:image/png;base64,").unwrap();
        let bytes = BASE64.decode(data.as_bytes()).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((frame.width, frame.height), (100, 100));
        let middle = &pixels[50 * 100..51 * 100];
        assert!(middle[10] < 40 && middle[90] > 200, "{middle:?}");
    }
}
