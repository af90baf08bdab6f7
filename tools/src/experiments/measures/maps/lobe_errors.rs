//! Lobes of boxes in a map, against sums of the lobe over all texels; and what of their error is the staircase alone.

use clerestory::Result;
use clerestory::maps::MapImage;
use clerestory::maps::box_lobe::{Lobe, WeightedBox, box_lobe};
use clerestory::maps::prefilter::weighted_texels;
use clerestory::maps::spherical_sat::SatImage;
use glam::{DVec3, DVec4, Vec3};
use rayon::prelude::*;

use super::glossy_look_ups::{Fit, MAP, NESTED, errors, fits};

/// A source of look-ups.
pub struct LobeSource {
    image: MapImage,
    table: SatImage,
    texels: Vec<(DVec3, DVec4)>,
}

impl LobeSource {
    /// That of an image, with a border as far as boxes may reach at all.
    ///
    /// # Errors
    /// Those of the table.
    pub fn new(image: MapImage) -> Result<Self> {
        Ok(Self {
            table: SatImage::new(&image, image.size().y)?,
            texels: weighted_texels(&image),
            image,
        })
    }

    /// RMS errors over the mean, by the names of fits and of their caps: what lies within each box's cap, round on the sphere and as large.
    ///
    /// # Errors
    /// Those of lobes.
    pub fn errors(&self, lobe: Lobe, directions: &[DVec3]) -> Result<Vec<(String, f64)>> {
        let nested: Vec<Vec<WeightedBox>> = NESTED
            .iter()
            .map(|count| box_lobe(lobe, *count))
            .collect::<Result<_>>()?;
        let all_boxes: Vec<Vec<WeightedBox>> = fits().map(|fit| fit.boxes(lobe)).collect::<Result<_>>()?;
        let of = |d: &DVec3| -> Vec<Vec3> {
            // By t = 1 − cos.
            let mut sums = vec![DVec4::ZERO; 1 + nested.iter().map(Vec::len).sum::<usize>()];
            for (other, value) in &self.texels {
                let t = 0.5 * (*d - *other).length_squared();
                sums[0] += lobe.value(t) * *value;
                let caps = nested
                    .iter()
                    .flatten()
                    .map(|one| one.solid_angle / std::f64::consts::TAU);
                for (sum, cap) in sums[1..].iter_mut().zip(caps) {
                    *sum += if t < cap { *value } else { DVec4::ZERO };
                }
            }
            let mean = |sum: DVec4| {
                // A cap without a texel's middle is one of the texel at its own.
                let held = self.image.nearest(*d).map_or(DVec3::ZERO, |value| value.as_dvec3());
                if sum.w > 0.0 { sum.truncate() / sum.w } else { held }
            };
            let mut found = vec![mean(sums[0]).as_vec3()];
            let boxes = all_boxes
                .iter()
                .map(|fit| self.table.sat_lobe(MAP, *d, fit).unwrap_or_default().as_vec3());
            found.extend(boxes);
            let mut next = 1;
            for fit in &nested {
                let parts = fit.iter().zip(&sums[next..]).map(|(one, sum)| one.weight * mean(*sum));
                found.push(parts.sum::<DVec3>().as_vec3());
                next += fit.len();
            }
            found
        };
        let all: Vec<Vec<Vec3>> = directions.par_iter().map(of).collect();
        let column = |at: usize| -> Vec<Vec3> { all.iter().map(|found| found[at]).collect() };
        let right = column(0);
        let caps = NESTED
            .iter()
            .map(|steps| format!("caps of {}", Fit::Nested(*steps).name()));
        let names = fits().map(Fit::name).chain(caps).enumerate();
        Ok(names
            .map(|(at, name)| (name, errors(&column(at + 1), &right)[0]))
            .collect())
    }
}

/// The angle from a lobe's middle within which half of it lies.
pub fn half_angle(lobe: Lobe) -> f64 {
    const STEPS: u32 = 100_000;
    let at = |i: u32| (f64::from(i) / f64::from(STEPS)).powi(4);
    let parts = |i: u32| (at(i + 1) - at(i)) * lobe.value(0.5 * (at(i) + at(i + 1)));
    let whole: f64 = (0..STEPS).map(parts).sum();
    let mut sum = 0.0;
    let end = (0..STEPS).find(|i| {
        sum += parts(*i);
        sum >= 0.5 * whole
    });
    (1.0 - at(end.unwrap_or(STEPS))).acos()
}
