//! Latitude–longitude maps of maps of other kinds, on the device.
//!
//! The rasterizer draws straight edges, which no latitude–longitude map has: what is drawn live is an octahedron or a cube, and this turns it
//! into the other single rectangle (T. Engelhardt, PhD thesis, KIT, 2013, §7.3.3: "rendering to latitude-longitude maps is not possible on GPUs
//! without severe errors or high tessellation").
//!
//! Bias: a texel is the mean of bilinear look-ups at the middles of samples² rectangles of it, weighted by the density there, so that it has the
//! blur of the source's texels beside its own. Guarantees: constant radiance stays constant but for rounding; deterministic. GLSL:
//! `maps/lat_long_of_map.comp`; twin: [`to_lat_long`].

use super::directional_map::{DirectionalConstants, DirectionalMap};
use super::lat_long::{lat_long_decode, lat_long_density};
use super::{MapImage, Parametrization, Texel};
use crate::gpu::shaders::maps::lat_long_of_map as kernel;
use crate::gpu::{ComputePipeline, Gpu, Pass, PipelineInfo, rw_compute_to_compute};
use crate::{Error, Result};
use glam::{DVec2, DVec3, UVec2};

/// Samples along each side of a texel at most.
pub const MAX_SAMPLES: u32 = 16;

fn check(samples: u32) -> Result<()> {
    if (1..=MAX_SAMPLES).contains(&samples) {
        Ok(())
    } else {
        Err(Error::setting(
            "samples",
            samples,
            format!("are not 1 to {MAX_SAMPLES}"),
        ))
    }
}

/// The kernel, for maps of one kind and border to those of another.
#[derive(Debug)]
pub struct ToLatLong {
    source: DirectionalConstants,
    border: u32,
    samples: u32,
    pipeline: ComputePipeline<kernel::Kernel>,
}

impl ToLatLong {
    /// Makes the pipeline for a source and a target as these.
    ///
    /// # Errors
    /// [`Error::Setting`] for a target that is no latitude–longitude map, or for a number of samples that is not in 1 to [`MAX_SAMPLES`];
    /// [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, source: &DirectionalMap, target: &DirectionalMap, samples: u32) -> Result<Self> {
        check(samples)?;
        if target.map() != Parametrization::LatLong {
            return Err(Error::setting("map", target.map(), "is no latitude–longitude map"));
        }
        let (constants, border) = (source.constants(), target.border());
        Ok(Self {
            source: constants,
            border,
            samples,
            pipeline: gpu.compute_pipeline(&kernel::Spec {
                directional_kind: constants.kind,
                directional_border: constants.border,
                lat_long_border: border.cast_signed(),
            })?,
        })
    }

    /// The kernel with its specialization.
    pub fn info(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// Records the filling of the target's level 0 from that of the source; the border is left to [`DirectionalMap::record_border`].
    ///
    /// Barriers: the source's texels, borders included, must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and
    /// earlier uses of the target must have ended. After it the target's texels are visible to compute shaders.
    ///
    /// # Errors
    /// [`Error::Setting`] for maps of other kinds or borders than it was made for, and as [`Pass::dispatch`].
    pub fn record(&self, pass: &mut Pass<'_>, source: &DirectionalMap, target: &DirectionalMap) -> Result<()> {
        if source.constants() != self.source {
            return Err(Error::setting("source", source.map(), "is of another kind or border"));
        }
        if target.map() != Parametrization::LatLong || target.border() != self.border {
            return Err(Error::setting("target", target.map(), "is of another kind or border"));
        }
        let lat_long = target.level(0)?;
        let count = (lat_long.size[0] * lat_long.size[1]).cast_unsigned();
        let set = kernel::Set0 {
            lat_long_texels: target.texels().view(),
        };
        let push = kernel::Push {
            lat_long,
            samples: self.samples.cast_signed(),
        };
        let groups = self.pipeline.groups_over(count);
        pass.dispatch(&self.pipeline, &[&set, &source.set()], &push, groups)?;
        pass.barrier(&[rw_compute_to_compute(target.texels())]);
        Ok(())
    }
}

/// Twin of `lat_long_texel` of `maps/lat_long_of_map.comp`: the mean over a texel of a latitude–longitude map of that size.
pub fn lat_long_texel(source: &MapImage, texel: Texel, size: UVec2, samples: u32) -> DVec3 {
    let (mut sum, mut whole) = (DVec3::ZERO, 0.0);
    for i in 0..samples * samples {
        let part = (UVec2::new(i % samples, i / samples).as_dvec2() + 0.5) / f64::from(samples);
        let uv: DVec2 = (UVec2::new(texel.x, texel.y).as_dvec2() + part) / size.as_dvec2();
        let weight = lat_long_density(uv);
        sum += weight * source.look_up(lat_long_decode(uv)).unwrap_or_default();
        whole += weight;
    }
    sum / whole
}

/// Twin of [`ToLatLong`].
///
/// # Errors
/// [`Error::Setting`] for a size that the map cannot have, or a number of samples that is not in 1 to [`MAX_SAMPLES`].
pub fn to_lat_long(source: &MapImage, size: UVec2, samples: u32) -> Result<MapImage> {
    check(samples)?;
    MapImage::from_fn(Parametrization::LatLong, size, |texel| {
        lat_long_texel(source, texel, size, samples)
    })
}
