//! Means over a picture with their standard errors, by sums over square tiles: neighbouring pixels may share their noise.

/// Tiles that a picture is divided into, where it has the pixels, and sides of a tile.
const TILES: f64 = 64.0;
const TILE_SIDES: std::ops::RangeInclusive<usize> = 2..=32;

/// Sums over tiles.
pub struct Tiles {
    width: usize,
    side: usize,
    across: usize,
    /// Sum and count of each.
    tiles: Vec<(f64, f64)>,
}

impl Tiles {
    /// Of a picture of so many pixels.
    pub fn new(width: usize, height: usize) -> Self {
        let side = ((width * height) as f64 / TILES).sqrt() as usize;
        let side = side.clamp(*TILE_SIDES.start(), *TILE_SIDES.end());
        let across = width.div_ceil(side);
        Self {
            width,
            side,
            across,
            tiles: vec![(0.0, 0.0); across * height.div_ceil(side)],
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.tiles.len()
    }

    /// The tile of a pixel.
    pub fn of(&self, pixel: usize) -> usize {
        pixel / self.width / self.side * self.across + pixel % self.width / self.side
    }

    /// Adds a value of a pixel.
    pub fn add(&mut self, pixel: usize, value: f64) {
        let tile = self.of(pixel);
        self.tiles[tile].0 += value;
        self.tiles[tile].1 += 1.0;
    }

    /// The sum over each tile.
    pub fn sums(&self) -> impl Iterator<Item = f64> {
        self.tiles.iter().map(|(sum, _)| *sum)
    }

    /// The mean of all values, and its standard error. What is uneven over the picture counts as noise, so that it is rather too large. A single
    /// tile tells nothing of its own spread.
    pub fn mean(&self) -> (f64, f64) {
        let (sum, count) = self
            .tiles
            .iter()
            .fold((0.0, 0.0), |(sum, count), tile| (sum + tile.0, count + tile.1));
        let mean = sum / f64::max(count, 1.0);
        let deviations = self.tiles.iter().map(|(sum, count)| sum - count * mean);
        let squares: f64 = deviations.map(|deviation| deviation * deviation).sum();
        let number = self.tiles.len() as f64;
        let deviation = if number > 1.0 {
            (squares * number / (number - 1.0)).sqrt() / f64::max(count, 1.0)
        } else {
            f64::INFINITY
        };
        (mean, deviation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_64_tiles_and_a_small_one_fewer() {
        assert_eq!(Tiles::new(32, 32).count(), 64);
        assert_eq!(Tiles::new(8, 8).count(), 16);
        let mut one = Tiles::new(2, 2);
        one.add(3, 5.0);
        assert_eq!(one.count(), 1);
        assert_eq!(one.mean(), (5.0, f64::INFINITY));
        // Four tiles with sums 1, 2, 3, 4 of one value each: a spread of √(5/3), over 2.
        let mut four = Tiles::new(4, 4);
        for (pixel, value) in [(0, 1.0), (3, 2.0), (12, 3.0), (15, 4.0)] {
            four.add(pixel, value);
        }
        let (mean, deviation) = four.mean();
        assert_eq!(four.sums().collect::<Vec<_>>(), [1.0, 2.0, 3.0, 4.0]);
        assert!((mean - 2.5).abs() < 1e-15 && (deviation - (5.0_f64 / 3.0).sqrt() / 2.0).abs() < 1e-15);
    }
}
