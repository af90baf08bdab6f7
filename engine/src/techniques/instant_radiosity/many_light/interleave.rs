//! Interleaved sampling: a picture's pixels, by tiles whose pixels share a part of the lights. Twin of `interleave.glsl`.
//!
//! Sources: A. Keller and W. Heidrich, "Interleaved Sampling", EGWR 2001; B. Segovia et al., "Non-interleaved Deferred Shading of Interleaved Sample Patterns",
//! Graphics Hardware 2006. Of each n × n pixels one goes to each of n × n tiles, so that those of a tile, which have the same lights, lie next to each other, and a window of n × n
//! pixels has all lights. Pictures of any size: tiles are as large as the largest, and their places are filled up to whole workgroups, so that a workgroup has one part of the
//! lights. Parts are consecutive lights, since every n² th of a low-discrepancy sequence is a stripe of it.

use std::ops::Range;

use crate::gpu::shaders::constants::INTERLEAVE_GROUP;

/// How the pixels of a picture go to tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interleaving {
    size: [u32; 2],
    tiles: u32,
}

impl Interleaving {
    /// Of a picture of `size` pixels, one at least along each side, with so many tiles along each side, one at least.
    pub fn new(size: [u32; 2], tiles: u32) -> Self {
        Self {
            size,
            tiles: tiles.max(1),
        }
    }

    /// Pixels across and down of a tile, of the largest ones where their number divides no side.
    pub fn tile(&self) -> [u32; 2] {
        self.size.map(|side| side.div_ceil(self.tiles))
    }

    /// Places of a tile: its pixels in whole workgroups.
    pub fn stride(&self) -> u32 {
        let [width, height] = self.tile();
        (width * height).next_multiple_of(INTERLEAVE_GROUP)
    }

    /// Places of all tiles.
    pub fn places(&self) -> u64 {
        u64::from(self.stride()) * u64::from(self.tiles) * u64::from(self.tiles)
    }

    /// The place of a pixel.
    pub fn split(&self, [x, y]: [u32; 2]) -> u32 {
        let n = self.tiles;
        (y % n * n + x % n) * self.stride() + y / n * self.tile()[0] + x / n
    }

    /// The pixel of a place; `None` where it fills up a tile.
    pub fn merge(&self, place: u32) -> Option<[u32; 2]> {
        let (n, [width, height]) = (self.tiles, self.tile());
        let (tile, within) = (place / self.stride(), place % self.stride());
        let pixel = [within % width * n + tile % n, within / width * n + tile / n];
        let is_inside = within / width < height && pixel[0] < self.size[0] && pixel[1] < self.size[1];
        is_inside.then_some(pixel)
    }

    /// The part of the lights that a tile has, where the first tile has the part `first`.
    pub fn subset_of_tile(tile: u32, first: u32, subsets: u32) -> u32 {
        (tile % subsets + first) % subsets
    }

    /// By how much the part of a tile goes on from frame to frame, so that few frames in a row have parts from all over: about as the golden ratio cuts them, and without a common factor,
    /// so that as many frames as there are parts have each once.
    pub fn part_step(subsets: u32) -> u32 {
        let gcd = |mut a: u32, mut b: u32| {
            while b > 0 {
                (a, b) = (b, a % b);
            }
            a
        };
        let golden = (f64::from(subsets) / (0.5 * (1.0 + 5f64.sqrt()))).round() as u32;
        (golden..=subsets).find(|step| gcd(*step, subsets) == 1).unwrap_or(1)
    }

    /// The lights of a part of them: consecutive ones, at least one where there are any. Where there are no fewer lights than parts, each is in one part.
    pub fn lights(subset: u32, subsets: u32, lights: u32) -> Range<u32> {
        let first = subset * lights / subsets;
        first..((subset + 1) * lights / subsets).max(first + 1).min(lights)
    }

    /// The last part that has a light, of one or more.
    pub fn subset(light: u32, subsets: u32, lights: u32) -> u32 {
        ((light + 1) * subsets - 1) / lights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes that no number of tiles divides among them.
    const SIZES: [[u32; 2]; 7] = [[64, 48], [13, 7], [5, 4], [1, 1], [30, 33], [1, 17], [96, 2]];

    #[test]
    fn merging_what_was_split_is_exact() {
        for size in SIZES {
            for tiles in [1, 2, 3, 4, 7, 16] {
                let split = Interleaving::new(size, tiles);
                let mut places = vec![None; split.places() as usize];
                for y in 0..size[1] {
                    for x in 0..size[0] {
                        let place = split.split([x, y]);
                        assert_eq!(split.merge(place), Some([x, y]), "{size:?} {tiles}");
                        assert_eq!(places[place as usize].replace([x, y]), None, "{size:?} {tiles}");
                    }
                }
                for (place, pixel) in places.iter().enumerate() {
                    assert_eq!(split.merge(place as u32), *pixel, "{size:?} {tiles}");
                }
            }
        }
    }

    #[test]
    fn windows_have_every_tile_once_and_workgroups_have_one_tile() {
        let (size, n) = ([19, 11], 4);
        let split = Interleaving::new(size, n);
        let tile = |x, y| split.split([x, y]) / split.stride();
        for (left, top) in [(0, 0), (3, 2), (15, 7)] {
            let mut seen: Vec<_> = (0..n * n).map(|i| tile(left + i % n, top + i / n)).collect();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..n * n), "{left} {top}");
        }
        assert_eq!(split.stride() % INTERLEAVE_GROUP, 0);
        // Neighbours of a tile are neighbours there.
        assert_eq!(split.split([5, 2]) + 1, split.split([9, 2]));
    }

    #[test]
    fn frames_in_a_row_have_parts_from_all_over() {
        for tiles in 1..=16u32 {
            let subsets = tiles * tiles;
            let step = Interleaving::part_step(subsets);
            let part = |frame: u32| frame % subsets * step % subsets;
            let mut all: Vec<u32> = (0..subsets).map(part).collect();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..subsets), "{subsets}");
            if tiles >= 4 {
                let mut few: Vec<u32> = (0..4).map(part).collect();
                few.sort_unstable();
                let gaps = few.windows(2).map(|pair| pair[1] - pair[0]);
                let widest = gaps.chain([subsets - few[3] + few[0]]).max();
                assert!(widest.is_some_and(|gap| 20 * gap < 11 * subsets), "{subsets}: {few:?}");
            }
        }
    }

    #[test]
    fn parts_have_every_light_once() {
        for (lights, subsets) in [
            (512, 16),
            (500, 16),
            (17, 16),
            (16, 16),
            (65_536, 256),
            (300, 256),
            (9, 1),
        ] {
            let mut end = 0;
            for subset in 0..subsets {
                let part = Interleaving::lights(subset, subsets, lights);
                assert_eq!(part.start, end, "{lights} {subset}");
                assert!(part.len() as u32 >= lights / subsets && part.len() as u32 <= lights.div_ceil(subsets));
                end = part.end;
                for light in part {
                    assert_eq!(Interleaving::subset(light, subsets, lights), subset, "{lights} {light}");
                }
            }
            assert_eq!(end, lights);
        }
        // Fewer lights than parts: each part has one, none is left out, and they have about as many parts each.
        let parts: Vec<_> = (0..16).map(|subset| Interleaving::lights(subset, 16, 3)).collect();
        assert!(parts.iter().all(|part| part.len() == 1 && part.end <= 3), "{parts:?}");
        for light in 0..3 {
            let count = parts.iter().filter(|part| part.start == light).count();
            assert!((5..=6).contains(&count), "{light}: {count}");
        }
        assert!(Interleaving::lights(3, 16, 0).is_empty());
    }
}
