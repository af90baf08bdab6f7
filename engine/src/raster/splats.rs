//! Octahedron maps of points: every point goes to the texel of its centre, and holes are filled from coarser levels.
//!
//! Sources: T. Engelhardt, "Efficient From-Point Visibility for Global Illumination in Virtual Scenes with Participating
//! Media", PhD thesis, KIT, 2013, §7.4 (OEM-4f, octahedra for the shadows of virtual point lights); T. Ritschel et al., "Imperfect Shadow Maps for Efficient Computation of Indirect Illumination", SIGGRAPH Asia 2008
//! (splats, pull and push). Numbers come by a second run over the points in place of 64-bit atomics.
//!
//! Guarantees: deterministic, whatever the order of invocations; of equally near points the least number stays; no texel is empty after the
//! fill unless all are. Biased: holes, and points in front of others, are as wide as texels. Twin: [`splat_levels`].

use glam::{DVec2, DVec3, UVec2, Vec3};

use crate::accel::MAX_COORDINATE;
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{SPLAT_NOTHING, SPLAT_SAME_SURFACE};
use crate::gpu::shaders::raster::{splat_points, splat_pull, splat_push};
use crate::gpu::shaders::types::{SplatLevel, SplatTexel, Surfel};
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferDesc, Category, ComputePipeline, Gpu, Pass, Recorder, rw_compute_to_compute,
};
use crate::maps::octahedron::{OctahedronLayout, octahedron_encode, octahedron_rectangular_encode};
use crate::{Error, Result};

/// The nearest point of a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Splat {
    /// Distance from the map's middle, metres.
    pub distance: f32,
    /// Its number.
    pub number: u32,
}

/// An octahedron map on the device that points are splatted into.
#[derive(Debug)]
pub struct SplatMap {
    layout: OctahedronLayout,
    levels: Vec<SplatLevel>,
    texels: Buffer,
    nearest: ComputePipeline<splat_points::Kernel>,
    numbers: ComputePipeline<splat_points::Kernel>,
    pull: ComputePipeline<splat_pull::Kernel>,
    push: ComputePipeline<splat_push::Kernel>,
}

/// Levels of a map down to a single texel, sizes rounded up.
fn levels_of(size: UVec2) -> Vec<SplatLevel> {
    let (mut all, mut first, mut size) = (Vec::new(), 0, size);
    loop {
        all.push(SplatLevel {
            first,
            size: size.to_array(),
        });
        if size == UVec2::ONE {
            return all;
        }
        first += size.element_product();
        size = (size + 1) / 2;
    }
}

fn texels_of(level: &SplatLevel) -> u32 {
    level.size[0] * level.size[1]
}

impl SplatMap {
    /// A map of that many texels.
    ///
    /// # Errors
    /// [`Error::Setting`] for no texels; [`Error::LimitExceeded`] for more than a buffer takes; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, layout: OctahedronLayout, size: UVec2) -> Result<Self> {
        const NAME: &str = "splat map";
        // All levels together are less than twice the first and a row and a column.
        let bytes = 2 * (size.as_u64vec2() + 1).element_product() * size_of::<SplatTexel>() as u64;
        if size.min_element() == 0 {
            return Err(Error::setting("size", size, "has no texels"));
        }
        gpu.caps().check_storage(NAME, bytes)?;
        let levels = levels_of(size);
        let texels: u32 = levels.iter().map(texels_of).sum();
        let bytes = u64::from(texels) * size_of::<SplatTexel>() as u64;
        let points = |numbers| {
            gpu.compute_pipeline(&splat_points::Spec {
                rectangular: layout == OctahedronLayout::Rectangular,
                numbers,
            })
        };
        Ok(Self {
            layout,
            levels,
            texels: gpu.buffer(&BufferDesc::storage(NAME, bytes, Category::Light))?,
            nearest: points(false)?,
            numbers: points(true)?,
            pull: gpu.compute_pipeline(&())?,
            push: gpu.compute_pipeline(&())?,
        })
    }

    /// Its layout.
    pub fn layout(&self) -> OctahedronLayout {
        self.layout
    }

    /// Texels of all levels, the map itself first: distances by their bits and numbers, all bits set where there is nothing.
    pub fn texels(&self) -> &Buffer {
        &self.texels
    }

    /// Records passes that clear the map, splat `count` points of a buffer as they are seen from `origin` and, if wanted, fill holes. Points
    /// out of the range of rays and those at the origin are left out.
    ///
    /// Barriers: the points must have been made visible to [`Access::COMPUTE`], and earlier uses of the texels by compute shaders and copies
    /// are waited for. After it texels are visible to compute shaders and copies.
    ///
    /// # Errors
    /// As [`Pass::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        origin: Vec3,
        points: &Buffer,
        count: u32,
        fills: bool,
    ) -> Result<()> {
        let barrier = |from, to| BufferBarrier {
            buffer: &self.texels,
            from,
            to,
        };
        recorder.pass("raster: splats", |pass| {
            pass.barrier(&[barrier(Access::COMPUTE | Access::TRANSFER, Access::TRANSFER_WRITE)]);
            pass.fill(self.texels.view(), SPLAT_NOTHING)?;
            pass.barrier(&[barrier(Access::TRANSFER_WRITE, Access::COMPUTE)]);
            for pipeline in [&self.nearest, &self.numbers] {
                self.record_points(pass, pipeline, origin, points, count)?;
                pass.barrier(&[rw_compute_to_compute(&self.texels)]);
            }
            Ok(())
        })?;
        if fills {
            recorder.pass("raster: fill of splats", |pass| self.record_fill(pass))?;
        }
        recorder.pass("raster: splats to readers", |pass| {
            pass.barrier(&[barrier(Access::COMPUTE, Access::COMPUTE_READ | Access::TRANSFER_READ)]);
            Ok(())
        })
    }

    fn record_points(
        &self,
        pass: &mut Pass<'_>,
        pipeline: &ComputePipeline<splat_points::Kernel>,
        origin: Vec3,
        points: &Buffer,
        count: u32,
    ) -> Result<()> {
        let set = splat_points::Set0 {
            surfels: points.view(),
            texels: self.texels.view(),
        };
        let push = splat_points::Push {
            origin: origin.to_array(),
            count,
            size: self.levels[0].size,
        };
        pass.dispatch(pipeline, &[&set], &push, [pipeline.groups_for(count), 1, 1])
    }

    fn record_fill(&self, pass: &mut Pass<'_>) -> Result<()> {
        for pair in self.levels.windows(2) {
            let (fine, coarse) = (pair[0], pair[1]);
            let set = splat_pull::Set0 {
                texels: self.texels.view(),
            };
            let groups = [self.pull.groups_for(texels_of(&coarse)), 1, 1];
            pass.dispatch(&self.pull, &[&set], &splat_pull::Push { fine, coarse }, groups)?;
            pass.barrier(&[rw_compute_to_compute(&self.texels)]);
        }
        for pair in self.levels.windows(2).rev() {
            let (fine, coarse) = (pair[0], pair[1]);
            let set = splat_push::Set0 {
                texels: self.texels.view(),
            };
            let groups = [self.push.groups_for(texels_of(&fine)), 1, 1];
            pass.dispatch(&self.push, &[&set], &splat_push::Push { fine, coarse }, groups)?;
            pass.barrier(&[rw_compute_to_compute(&self.texels)]);
        }
        Ok(())
    }

    /// Splats points and reads the map's first level, row by row; `None` where nothing is.
    ///
    /// # Errors
    /// As [`SplatMap::record`], [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn splat(&self, gpu: &Gpu, origin: Vec3, points: &[Surfel], fills: bool) -> Result<Vec<Option<Splat>>> {
        // A buffer has at least one.
        let none = [Surfel::default()];
        let held = if points.is_empty() { &none[..] } else { points };
        let buffer = gpu.buffer_with("surfels", Category::Geometry, held)?;
        let mut recorder = gpu.recorder("splats")?;
        self.record(&mut recorder, origin, &buffer, points.len() as u32, fills)?;
        recorder.submit()?.wait()?;
        let texels: Vec<SplatTexel> = gpu.read(self.texels.view(), texels_of(&self.levels[0]) as usize)?;
        Ok(texels.into_iter().map(splat_of).collect())
    }
}

fn splat_of(texel: SplatTexel) -> Option<Splat> {
    (texel.distance_bits != SPLAT_NOTHING).then(|| Splat {
        distance: f32::from_bits(texel.distance_bits),
        number: texel.number,
    })
}

/// Twin of [`SplatMap`], in f64 but for the distances that it holds: its first level, row by row.
pub fn splat_levels(
    layout: OctahedronLayout,
    size: UVec2,
    origin: Vec3,
    points: &[Surfel],
    fills: bool,
) -> Vec<Option<Splat>> {
    let levels = levels_of(size);
    let mut texels = vec![None; levels.iter().map(|level| texels_of(level) as usize).sum()];
    for point in points {
        let p = Vec3::from_array(point.position) - origin;
        let distance = p.length();
        // Comparisons are false for NaN.
        if !(p.abs().max_element() <= MAX_COORDINATE && distance > 0.0) {
            continue;
        }
        let place = texel_of(layout, size, p.as_dvec3());
        let splat = Splat {
            distance,
            number: point.number,
        };
        let held: &mut Option<Splat> = &mut texels[(place.y * size.x + place.x) as usize];
        let is_nearer = |held: &Splat| (distance, splat.number) < (held.distance, held.number);
        if held.as_ref().is_none_or(is_nearer) {
            *held = Some(splat);
        }
    }
    if fills {
        levels
            .windows(2)
            .for_each(|pair| splat_pulled(&mut texels, pair[0], pair[1]));
        levels
            .windows(2)
            .rev()
            .for_each(|pair| splat_pushed(&mut texels, pair[0], pair[1]));
    }
    texels.truncate(texels_of(&levels[0]) as usize);
    texels
}

/// The texel that a direction of any length lies in.
pub fn texel_of(layout: OctahedronLayout, size: UVec2, p: DVec3) -> UVec2 {
    let place = match layout {
        OctahedronLayout::Quadratic => octahedron_encode(p),
        OctahedronLayout::Rectangular => octahedron_rectangular_encode(p) * DVec2::new(0.5, 1.0),
    };
    ((0.5 + 0.5 * place) * size.as_dvec2()).as_uvec2().min(size - 1)
}

fn index_of(level: SplatLevel, [x, y]: [u32; 2]) -> usize {
    (level.first + y * level.size[0] + x) as usize
}

fn places(level: SplatLevel) -> impl Iterator<Item = [u32; 2]> {
    (0..level.size[1]).flat_map(move |y| (0..level.size[0]).map(move |x| [x, y]))
}

fn splat_pulled(texels: &mut [Option<Splat>], fine: SplatLevel, coarse: SplatLevel) {
    for at in places(coarse) {
        let children = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| [2 * at[0] + x, 2 * at[1] + y]);
        let is_inside = |p: &[u32; 2]| p[0] < fine.size[0] && p[1] < fine.size[1];
        let found: Vec<Splat> = children
            .into_iter()
            .filter(is_inside)
            .filter_map(|place| texels[index_of(fine, place)])
            .collect();
        let nearest = found
            .iter()
            .copied()
            .reduce(|a, b| if b.distance < a.distance { b } else { a });
        texels[index_of(coarse, at)] = nearest.map(|nearest| {
            let farthest = (1.0 + SPLAT_SAME_SURFACE) * nearest.distance;
            let same = found.iter().map(|splat| splat.distance).filter(|d| *d <= farthest);
            let (sum, count) = same.fold((0.0, 0.0), |(sum, count), d| (sum + d, count + 1.0));
            Splat {
                distance: sum / count,
                number: nearest.number,
            }
        });
    }
}

fn splat_pushed(texels: &mut [Option<Splat>], fine: SplatLevel, coarse: SplatLevel) {
    for at in places(fine) {
        let index = index_of(fine, at);
        if texels[index].is_none() {
            texels[index] = texels[index_of(coarse, at.map(|x| x / 2))];
        }
    }
}

/// Points on triangles, as many to an area everywhere as `count` allows: the k-th lies where the sum of areas has reached (k + ½)/`count` of the
/// whole, at a place of the triangle by a low-discrepancy sequence (M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences",
/// 2018). Their numbers are those of the triangles. None without area.
pub fn surfels_of(triangles: &[[Vec3; 3]], count: u32) -> Vec<Surfel> {
    let (places, _) = places_on(triangles, count);
    places
        .map(|(number, uv)| {
            let [a, b, c] = triangles[number as usize].map(|corner| corner.as_dvec3());
            Surfel {
                position: (a + uv.x * (b - a) + uv.y * (c - a)).as_vec3().to_array(),
                number,
            }
        })
        .collect()
}

/// The triangles and the weights of corners 1 and 2 there of the points of [`surfels_of`], and the area of all triangles, m².
pub(super) fn places_on(triangles: &[[Vec3; 3]], count: u32) -> (impl Iterator<Item = (u32, DVec2)>, f64) {
    /// 1/g and 1/g² of the plastic number g.
    const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_2);
    let double_area = |t: &[Vec3; 3]| {
        let [a, b, c] = t.map(|corner| corner.as_dvec3());
        let double = (b - a).cross(c - a).length();
        if double.is_finite() { double } else { 0.0 }
    };
    let mut reached = 0.0;
    let sums: Vec<f64> = triangles
        .iter()
        .map(|t| {
            reached += double_area(t);
            reached
        })
        .collect();
    let count = if reached > 0.0 { count } else { 0 };
    let places = (0..count).map(move |k| {
        let at = (f64::from(k) + 0.5) / f64::from(count) * reached;
        let number = sums.partition_point(|sum| *sum <= at).min(sums.len() - 1);
        let place = (DVec2::splat(0.5) + f64::from(k) * STEP).fract_gl();
        // The square folded along its diagonal.
        let uv = if place.element_sum() > 1.0 { 1.0 - place } else { place };
        (number as u32, uv)
    });
    (places, 0.5 * reached)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "OEM-4f",
    name: "octahedron maps of points: splats, pull and push",
    role: Role::Kernel,
    limits: "Holes, and points in front of others, are as wide as texels.",
    sources: &[sources::ENGELHARDT_2013.at("7.4"), sources::RITSCHEL_2008.whole()],
    shaders: &[
        "shaders/raster/splat_points.comp",
        "shaders/raster/splat_pull.comp",
        "shaders/raster/splat_push.comp",
    ],
    bias: Some(Bias::Biased("holes and points as wide as texels")),
    tests: &[
        "tests/tests/raster/splats.rs::splats_and_their_fill_are_those_of_the_twin",
        "tests/tests/raster/splats.rs::rooms_of_splats_are_closed_and_as_far_as_rays_go",
        "engine/src/raster/splats.rs::surfels_share_the_area_evenly",
    ],
    api: &["clerestory::raster::splats::SplatMap"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfels_share_the_area_evenly() {
        let v = Vec3::new;
        let triangles = [
            [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)],
            [v(0.0, 0.0, 1.0), v(0.0, 0.0, 1.0), v(5.0, 0.0, 1.0)],
            [v(0.0, 0.0, 2.0), v(3.0, 0.0, 2.0), v(0.0, 1.0, 2.0)],
        ];
        let surfels = surfels_of(&triangles, 4000);
        let of = |number: u32| surfels.iter().filter(|s| s.number == number).count();
        assert_eq!([of(0), of(1), of(2)], [1000, 0, 3000]);
        for (number, mean) in [(0, v(1.0, 1.0, 0.0) / 3.0), (2, v(1.0, 1.0 / 3.0, 2.0))] {
            let places = surfels
                .iter()
                .filter(|s| s.number == number)
                .map(|s| Vec3::from_array(s.position));
            let found = places.fold(Vec3::ZERO, |sum, p| sum + p) / of(number) as f32;
            assert!((found - mean).abs().max_element() < 0.01, "{found} {mean}");
        }
        assert!(surfels_of(&triangles[1..2], 10).is_empty() && surfels_of(&[], 10).is_empty());
    }

    #[test]
    fn levels_end_with_one_texel() {
        let levels = levels_of(UVec2::new(5, 3));
        let sizes: Vec<_> = levels.iter().map(|level| level.size).collect();
        assert_eq!(sizes, [[5, 3], [3, 2], [2, 1], [1, 1]]);
        assert_eq!(levels[3].first, 15 + 6 + 2);
    }
}
