//! Maps filtered by the GGX lobe: what a rough mirror sees in each direction, a map for each roughness.
//!
//! Sources: J. Kautz, P.-P. Vázquez, W. Heidrich, H.-P. Seidel, "A Unified Approach to Prefiltered Environment Maps", EGWR 2000;
//! B. Karis, "Real Shading in Unreal Engine 4", SIGGRAPH course notes, 2013 (GGX, and the weight n·l); B. Walter et al., "Microfacet
//! Models for Refraction through Rough Surfaces", EGSR 2007 (the distribution).
//!
//! Bias: normal, view and mirror direction are taken as one, n = v = r, so that the lobe is round: real ones are longer towards grazing
//! angles, and neither masking nor Fresnel is in it. With n = v the density of the reflected direction is D(h)/4, and
//! with weight n·l the lobe is (n·l) D(h), divided by its own sum over the texels: constant radiance stays constant. The sum is over all texels
//! of the source by solid angle, no samples: what is left is that a texel has one direction, so lobes should be wider than texels (α above the
//! texel's side in radians); narrower ones interpolate between texel centres. Deterministic. GLSL: `maps/ggx_lobe.glsl`; twins: [`ggx_lobe`],
//! [`prefilter_ggx`].
//!
//! With α = 1 the lobe is n·l: the filtered map times π is the irradiance ([`irradiance`](super::irradiance)).

use super::directional_map::DirectionalMap;
use super::{MapImage, Parametrization};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants::PREFILTER_TEXELS_PER_INVOCATION;
use crate::gpu::shaders::maps::prefilter_ggx as kernel;
use crate::gpu::{ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::{Error, Result};
use glam::{DVec3, DVec4, UVec2};
use std::f64::consts::TAU;

/// The lobe between unit directions, that of the mirror and that from where light comes: not normalised, at most 1.
pub fn ggx_lobe(r: DVec3, d: DVec3, alpha: f64) -> f64 {
    lobe(0.25 * (r - d).length_squared(), alpha)
}

/// The same of 1 − (n·h)², the squared sine of half the angle.
pub(super) fn lobe(sine: f64, alpha: f64) -> f64 {
    let a = alpha * alpha;
    let shape = a / (a + (1.0 - a) * sine);
    (1.0 - 2.0 * sine).max(0.0) * shape * shape
}

/// The solid angle (sr) over which an even mean has the variance of one by the lobe: (∫ p)²/∫ p². What a box as wide as the lobe holds.
pub fn ggx_solid_angle(alpha: f64) -> f64 {
    // Steps even in ln(1 + q t) with t = 1 − cos: as fine in the lobe's middle as in its tail.
    const STEPS: u32 = 4096;
    let a = alpha * alpha;
    let q = ((1.0 - a) / (2.0 * a)).max(f64::EPSILON);
    let step = q.ln_1p() / f64::from(STEPS);
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..STEPS {
        let s = (f64::from(i) + 0.5) * step;
        let p = lobe(0.5 * s.exp_m1() / q, alpha);
        let width = s.exp() / q * step;
        sum += p * width;
        squares += p * p * width;
    }
    TAU * sum * sum / squares
}

fn check(alpha: f64) -> Result<()> {
    if alpha > 0.0 && alpha <= 1.0 {
        Ok(())
    } else {
        Err(Error::setting("alpha", alpha, "is not in (0, 1]"))
    }
}

/// What sums over a map take of each texel: its direction, and radiance times solid angle with the solid angle (sr) behind it.
pub fn weighted_texels(map: &MapImage) -> Vec<(DVec3, DVec4)> {
    let (kind, size) = (map.map(), map.size());
    let of = |texel| {
        let solid_angle = kind.texel_solid_angle(size, texel);
        let value = solid_angle * map.at(texel).as_dvec3();
        Some((kind.texel_direction(size, texel)?, value.extend(solid_angle)))
    };
    kind.texels(size).filter_map(of).collect()
}

/// The mean radiance by the lobe about the unit direction `r`, over all of the [`weighted_texels`] of a map.
pub fn ggx_mean(texels: &[(DVec3, DVec4)], r: DVec3, alpha: f64) -> DVec3 {
    let sum: DVec4 = texels.iter().map(|(d, value)| ggx_lobe(r, *d, alpha) * *value).sum();
    sum.truncate() / sum.w
}

/// Twin of [`PrefilterGgx`]: a map of the same kind, of `size`.
///
/// # Errors
/// [`Error::Setting`] for α outside (0, 1], or for a size that the map cannot have.
pub fn prefilter_ggx(source: &MapImage, size: UVec2, alpha: f64) -> Result<MapImage> {
    check(alpha)?;
    let map = source.map();
    let texels = weighted_texels(source);
    MapImage::from_fn(map, size, |texel| {
        let direction = map.texel_direction(size, texel);
        direction.map_or(DVec3::ZERO, |r| ggx_mean(&texels, r, alpha))
    })
}

/// Texels of a source at most: a loop takes each, and software drivers end loops after 65,535.
const MAX_TEXELS: u64 = 1 << 15;

/// The filter on the device: from a level of one map to a level of another of the same kind and border.
#[derive(Debug)]
pub struct PrefilterGgx {
    constants: super::directional_map::DirectionalConstants,
    pipeline: ComputePipeline<kernel::Kernel>,
}

impl PrefilterGgx {
    /// Makes the pipeline for maps as this one.
    ///
    /// # Errors
    /// [`Error::Setting`] for maps of discs; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, map: &DirectionalMap) -> Result<Self> {
        if map.map() != Parametrization::Cube {
            map.check_one_layer()?;
        }
        let constants = map.constants();
        let pipeline = gpu.compute_pipeline(&kernel::Spec {
            directional_kind: constants.kind,
            directional_border: constants.border,
        })?;
        Ok(Self { constants, pipeline })
    }

    /// The kernel with its specialization.
    pub fn info(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// Records the filtering of level `from` of `source` into level `to` of `target`, by a lobe of width α (the square of the material's roughness); the border is left to
    /// [`DirectionalMap::record_border`].
    ///
    /// Barriers: the source's texels must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and earlier uses of
    /// the target must have ended. After it the target has been written by a compute shader.
    ///
    /// # Errors
    /// [`Error::Setting`] for α outside (0, 1], levels that are not there or maps of other kinds or borders; [`Error::LimitExceeded`] for a
    /// source of more than 2¹⁵ texels, of which a coarser level serves; and as [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        (source, from): (&DirectionalMap, u32),
        (target, to): (&DirectionalMap, u32),
        alpha: f32,
    ) -> Result<()> {
        check(alpha.into())?;
        for map in [source, target] {
            if map.constants() != self.constants {
                return Err(Error::setting("map", map.map(), "is of another kind or border"));
            }
        }
        let layers = target.map().layers();
        let [width, height] = source.level(from)?.size.map(i64::from);
        let texels = (width * height).cast_unsigned() * u64::from(layers);
        if texels > MAX_TEXELS {
            return Err(Error::LimitExceeded {
                name: "prefilter".into(),
                value: texels,
                limit_name: "texels of the source's level",
                limit: MAX_TEXELS,
            });
        }
        let level = target.level(to)?;
        let push = kernel::Push {
            target: level,
            source: from,
            alpha,
            layers: layers.cast_signed(),
        };
        let set = kernel::Set0 {
            texels: target.texels().view(),
        };
        let count = (level.size[0] * level.size[1]).cast_unsigned() * layers;
        let groups = [
            self.pipeline
                .groups_for(count.div_ceil(PREFILTER_TEXELS_PER_INVOCATION)),
            1,
            1,
        ];
        pass.dispatch(&self.pipeline, &[&set, &source.set()], &push, groups)
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-PREFILTER",
    name: "environment maps filtered by the GGX lobe, a map for each roughness",
    role: Role::Kernel,
    limits: "Round lobes without masking and Fresnel factors; roughnesses narrower than texels interpolate between texels.",
    sources: &[sources::KAUTZ_2000.whole(), sources::KARIS_2013.whole()],
    shaders: &["shaders/maps/prefilter_ggx.comp"],
    tests: &[
        "tests/tests/maps/directional_maps.rs::filtered_maps_are_sums_over_the_lobe",
        "tests/tests/maps/directional_maps.rs::constant_radiance_stays_constant",
        "tests/tests/preview/light.rs::rough_reflections_are_close_to_the_path_tracers",
        "engine/src/maps/tests/glossy.rs::filtered_maps_are_integrals_of_the_lobe",
        "engine/src/maps/tests/glossy.rs::lobes_have_the_width_that_is_said",
    ],
    api: &[
        "clerestory::maps::prefilter::PrefilterGgx",
        "clerestory::maps::prefilter::prefilter_ggx",
    ],
    ..Row::of(file!())
}];
