//! Pictures put together from panels, with words, frames and scales of colours.

use clerestory::film::PixelFormat;

use crate::lettering;

/// A picture of red, green and blue bytes.
#[derive(Debug, Clone)]
pub struct Sheet {
    size: [u32; 2],
    pixels: Vec<[u8; 3]>,
}

/// Linear steps from one colour to the next; the first is at 0 and the last at 1.
pub type Scale = &'static [[u8; 3]];

/// Dark to bright, told apart by its lightness alone: about that of viridis (S. van der Walt and N. Smith, 2015).
pub const SEQUENTIAL: Scale = &[
    [68, 1, 84],
    [65, 68, 135],
    [42, 120, 142],
    [34, 168, 132],
    [122, 209, 81],
    [253, 231, 37],
];
/// Blue below the middle, white in it, red above.
pub const DIVERGING: Scale = &[
    [33, 102, 172],
    [146, 197, 222],
    [247, 247, 247],
    [244, 165, 130],
    [178, 24, 43],
];
/// Black, then from dark red to white: for errors, of which there should be none.
pub const ERRORS: Scale = &[[0, 0, 0], [90, 0, 60], [200, 30, 30], [250, 160, 30], [255, 255, 220]];

/// The colour at a share of a scale.
pub fn color(scale: Scale, share: f64) -> [u8; 3] {
    let last = scale.len() - 1;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let at = (place as usize).min(last.saturating_sub(1));
    let part = place - at as f64;
    let (a, b) = (scale[at], scale[(at + 1).min(last)]);
    std::array::from_fn(|c| (f64::from(a[c]) + part * (f64::from(b[c]) - f64::from(a[c]))).round() as u8)
}

impl Sheet {
    /// A sheet of one colour.
    pub fn new(size: [u32; 2], background: [u8; 3]) -> Self {
        Self {
            size,
            pixels: vec![background; (size[0] * size[1]) as usize],
        }
    }

    /// Sets a pixel, if it is on the sheet.
    pub fn put(&mut self, x: u32, y: u32, color: [u8; 3]) {
        if x < self.size[0] && y < self.size[1] {
            self.pixels[(y * self.size[0] + x) as usize] = color;
        }
    }

    /// Fills a rectangle by the share of its sides at the middle of each pixel; `None` leaves the pixel.
    pub fn fill(&mut self, corner: [u32; 2], size: [u32; 2], color: impl Fn([f64; 2]) -> Option<[u8; 3]>) {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let share = [
                    (f64::from(x) + 0.5) / f64::from(size[0]),
                    (f64::from(y) + 0.5) / f64::from(size[1]),
                ];
                if let Some(color) = color(share) {
                    self.put(corner[0] + x, corner[1] + y, color);
                }
            }
        }
    }

    /// Writes a line of letters from its upper left corner.
    pub fn write(&mut self, text: &str, [left, top]: [u32; 2], dot: u32, color: [u8; 3]) {
        lettering::write(text, dot, |x, y| self.put(left + x, top + y, color));
    }

    /// Four bytes per pixel, rows from top to bottom.
    pub fn bytes(&self, format: PixelFormat) -> Vec<u8> {
        let of = |[r, g, b]: [u8; 3]| match format {
            PixelFormat::Rgba8 => [r, g, b, u8::MAX],
            PixelFormat::Bgra8 => [b, g, r, u8::MAX],
        };
        self.pixels.iter().flat_map(|pixel| of(*pixel)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_run_from_their_first_colour_to_their_last() {
        for scale in [SEQUENTIAL, DIVERGING, ERRORS] {
            assert_eq!(color(scale, -1.0), scale[0]);
            assert_eq!(color(scale, 2.0), scale[scale.len() - 1]);
        }
        assert_eq!(color(DIVERGING, 0.5), DIVERGING[2]);
        assert_eq!(color(ERRORS, 0.125), [45, 0, 30]);
    }

    #[test]
    fn letters_have_their_dots_and_stay_on_the_sheet() {
        let mut sheet = Sheet::new([20, 10], [0; 3]);
        sheet.write("i1", [1, 1], 1, [255; 3]);
        let dots = sheet.pixels.iter().filter(|pixel| pixel[0] == 255).count();
        assert_eq!(dots, 11 + 10);
        sheet.write("WWWWWWWW", [15, 8], 3, [9; 3]);
        assert_eq!(lettering::width("AB", 2), 22);
        assert_eq!(sheet.bytes(PixelFormat::Bgra8).len(), 800);
    }
}
