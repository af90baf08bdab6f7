//! What a place sees in all directions: distances and normals by rasterization, and radiance by rasterization or by rays.
//!
//! Sources: L. Szirmay-Kalos, B. Aszódi, I. Lazányi, M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3), 2005 (maps of radiance
//! and distance); T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", VMV 2008 (drawn as one picture).
//!
//! The map is an octahedron in the world's axes. Objects can be left out: the eight octants are drawn without them, and paths begin behind them. They go on to cast
//! shadows. Radiance is that at the middles of texels, towards the place.
//!
//! - [`CaptureBy::Raster`]: the preview's shading with its shadow maps, one pass; light of points, spots and directions alone.
//! - [`CaptureBy::Rays`]: the path tracer on a range of bounces; all light, with noise.
//!
//! Bias: shadows of the former are those of [`OmniShadowMaps`](crate::raster::OmniShadowMaps), directional lights cast none. Surfaces nearer than 2⁻¹⁴ of the way to the farthest one are not
//! drawn. Deterministic.

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, UVec2, Vec3};

use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::constants::PACKED_NORMAL_BITS;
use crate::gpu::shaders::raster::{surface_frag, surface_octant_vert};
use crate::gpu::shaders::techniques::path::path_directions;
use crate::gpu::shaders::techniques::preview::preview_shade;
use crate::gpu::shaders::types::SceneTriangle;
use crate::gpu::{Area, Buffer, BufferDesc, Category, Gpu, PipelineInfo, Timings};
use crate::maps::impostor::ImpostorImage;
use crate::maps::octahedron::OctahedronLayout;
use crate::maps::packed_direction::unpack_octahedral;
use crate::maps::{MapImage, Parametrization};
use crate::raster::{DrawPart, GBuffer, GBufferDesc, Layering, OctantCut, Output, SHADOW_MAPS_MAX, Surfaces, View};
use crate::techniques::preview::{
    Eye, LightRoom, PreviewLights, PreviewPart, PreviewShadows, SHADED_OUTPUTS, Seen, Shade, Target,
};
use crate::techniques::{PathTracer, PathTracerSettings, reasons};
use crate::transport::path_set::PATH_SET_LOBES;
use crate::transport::random::SamplerKind;
use crate::transport::{GpuScene, PathSet};
use crate::{Error, Result};

/// How radiance comes into a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CaptureBy {
    /// By rasterization where points and spots alone emit light and nothing is there in part, by rays elsewhere.
    #[default]
    Auto,
    /// By rasterization with shadow maps: light of points, spots and directions, scattered once.
    Raster,
    /// By the path tracer: light of every kind, scattered as often as is asked for.
    Rays,
}

/// What the device of a map offers: octants are cut by clip distances.
pub(in crate::techniques) const NEEDS: &[&str] = &["VK_QUEUE_GRAPHICS_BIT", "shaderClipDistance"];

/// What a map may take, beside what eye paths do.
pub(in crate::techniques) const KERNELS: [&ShaderInfo; 4] = [
    &path_directions::INFO,
    &preview_shade::INFO,
    &surface_octant_vert::INFO,
    &surface_frag::INFO,
];

/// By how much paths begin in front of what a texel shows, as a part of its distance.
const LEAD: f32 = 1.0 / 1024.0;
/// Of the paths of all maps: their noise is the same in all samples and in pictures of all seeds, so that pilot pictures show it as the bias that it is.
const CAPTURE_SEED: u32 = 0x6d61_7021;
/// Lights that are drawn, at most: their records go into the command buffer.
const LIGHTS_MAX: usize = 1024;

impl CaptureBy {
    /// What it is for a scene and the number of bounces that are wanted.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for rasterization of light that it does not bring.
    pub(in crate::techniques) fn resolved(self, technique: &str, scene: &GpuScene, most_bounces: u32) -> Result<Self> {
        let profile = scene.profile();
        let placed = profile.lights.point + profile.lights.spot;
        let reasons = reasons(&[
            (
                scene.has_area_lights() || profile.has_unlit,
                "surfaces emit light, which a rasterized map does not bring to others; capture by rays does",
            ),
            (
                profile.has_environment(),
                "the environment's light is not brought to surfaces of a rasterized map; capture by rays does",
            ),
            (
                most_bounces != 1,
                "surfaces of a rasterized map scatter light once; capture by rays scatters it as often as is asked for",
            ),
            (
                placed > SHADOW_MAPS_MAX as usize || placed + profile.lights.directional > LIGHTS_MAX,
                "there are more lights than rasterized maps have; capture by rays takes all",
            ),
        ]);
        // What it draws otherwise than it is.
        let is_off = profile.lights.directional > 0 || profile.alpha.blend;
        match self {
            Self::Auto if reasons.is_empty() && !is_off => Ok(Self::Raster),
            Self::Auto => Ok(Self::Rays),
            Self::Raster if !reasons.is_empty() => Err(Error::Unsupported {
                technique: technique.into(),
                reasons,
            }),
            other => Ok(other),
        }
    }
}

/// What is captured, and how.
#[derive(Debug, Clone)]
pub(in crate::techniques) struct CapturePlan {
    /// Where the map is seen from, metres.
    pub place: Vec3,
    /// Texels along a side of the octahedron.
    pub side: u32,
    /// [`CaptureBy::Raster`] or [`CaptureBy::Rays`].
    pub by: CaptureBy,
    /// Scatterings of the light in it, least and most.
    pub bounces: [u32; 2],
    /// Whether distances and normals are wanted.
    pub with_distances: bool,
    /// Triangles that are left out, in their order.
    pub left_out: Vec<Range<u32>>,
    /// Texels along a side of the shadow maps.
    pub shadow_side: u32,
    /// Paths of a texel.
    pub samples: u32,
    /// Of paths.
    pub sampler: SamplerKind,
}

/// A map of what a place sees.
pub(in crate::techniques) struct Captured {
    /// Texels along a side.
    pub side: u32,
    /// Radiance, three f32 a texel, row by row; visible to compute shaders.
    pub radiance: Buffer,
    /// Distances and normals, where they were wanted.
    pub impostor: Option<ImpostorImage>,
}

impl Captured {
    /// The radiance on the host.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn read(&self, gpu: &Gpu) -> Result<MapImage> {
        let size = UVec2::splat(self.side);
        let texels: Vec<[f32; 3]> = gpu.read(self.radiance.view(), size.element_product() as usize)?;
        MapImage::new(MAP, size, texels.into_iter().map(Vec3::from_array).collect())
    }
}

/// The map's parametrization.
pub(in crate::techniques) const MAP: Parametrization = Parametrization::OctahedronQuadratic;

/// A capture under way.
pub(in crate::techniques) struct Capture {
    plan: CapturePlan,
    gbuffer: GBuffer,
    by: By,
    radiance: Buffer,
    impostor: Option<ImpostorImage>,
    is_drawn: bool,
    is_done: bool,
}

enum By {
    Raster(Box<Shading>),
    Rays(Option<Box<PathTracer>>),
}

/// What shades a drawn map.
struct Shading {
    lights: PreviewLights,
    shade: Shade,
}

impl Capture {
    /// Allocates a map and what makes it.
    ///
    /// # Errors
    /// [`Error::Setting`] for a place that is not finite, sizes, and lights that shadow maps cannot serve; [`Error::MissingFeature`] where clip distances are missing;
    /// [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, scene: &GpuScene, plan: CapturePlan) -> Result<Self> {
        if !plan.place.is_finite() {
            return Err(Error::setting("place", plan.place, "is not finite"));
        }
        let surfaces = scene.surfaces();
        let is_drawn = plan.by == CaptureBy::Raster;
        let mut outputs = Vec::new();
        if is_drawn {
            outputs.extend(SHADED_OUTPUTS);
        }
        // Paths begin by distances, whoever else wants them.
        if plan.with_distances || !is_drawn {
            outputs.extend([Output::Distance, Output::Normals]);
        }
        let gbuffer = GBuffer::new(
            gpu,
            &surfaces,
            &GBufferDesc {
                size: [plan.side; 2],
                layering: Layering::Octants(OctantCut::default()),
                outputs: &outputs,
            },
        )?;
        let shading = || -> Result<_> {
            let room = LightRoom::of(&scene.lights_without_area());
            let shadows = (room.placed > 0).then_some(PreviewShadows {
                side: plan.shadow_side,
                ..PreviewShadows::default()
            });
            let lights = PreviewLights::new(gpu, &surfaces, room, shadows)?;
            let shade = Shade::new(gpu, scene, &lights, true, false)?;
            Ok(Box::new(Shading { lights, shade }))
        };
        let bytes = u64::from(plan.side) * u64::from(plan.side) * size_of::<[f32; 3]>() as u64;
        Ok(Self {
            by: if is_drawn {
                By::Raster(shading()?)
            } else {
                By::Rays(None)
            },
            gbuffer,
            radiance: gpu.buffer(&BufferDesc::storage("captured radiance", bytes, Category::Light))?,
            impostor: None,
            is_drawn: false,
            is_done: false,
            plan,
        })
    }

    /// What draws and shades it, or traces its paths once they are under way.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.gbuffer.pipelines();
        match &self.by {
            By::Raster(shading) => all.extend(shading.shade.pipelines()),
            By::Rays(tracer) => all.extend(tracer.iter().flat_map(|tracer| tracer.pipelines())),
        }
        all
    }

    /// Whether the map is there.
    pub fn is_done(&self) -> bool {
        self.is_done
    }

    /// The map.
    pub fn into_captured(self) -> Captured {
        Captured {
            side: self.plan.side,
            radiance: self.radiance,
            impostor: self.impostor.filter(|_| self.plan.with_distances),
        }
    }

    /// A piece of the work: the drawing, with its shading, or a submission of paths.
    ///
    /// # Errors
    /// [`Error::Setting`] for a place on a surface; [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn advance(&mut self, gpu: &Gpu, scene: &Arc<GpuScene>) -> Result<Vec<Timings>> {
        if !self.is_drawn {
            let timings = self.draw(gpu, scene)?;
            self.is_drawn = true;
            self.is_done = matches!(self.by, By::Raster(_));
            return Ok(timings);
        }
        let By::Rays(tracer) = &mut self.by else {
            return Ok(Vec::new());
        };
        let tracer = match tracer {
            Some(tracer) => tracer,
            None => tracer.insert(Box::new(paths(gpu, scene, &self.plan, self.impostor.as_ref())?)),
        };
        if let Some(step) = tracer.step(self.plan.samples)? {
            return Ok(step.timings);
        }
        let (picture, _) = tracer.picture()?;
        let radiance = picture.layer("radiance").map_or(&[][..], |layer| layer.values());
        gpu.upload(&self.radiance, 0, radiance)?;
        self.by = By::Rays(None);
        self.is_done = true;
        Ok(Vec::new())
    }

    /// What the place sees, and its shading where that is drawn.
    fn draw(&mut self, gpu: &Gpu, scene: &GpuScene) -> Result<Vec<Timings>> {
        let plan = &self.plan;
        let surfaces = scene.surfaces();
        let near = View::near_plane(plan.place, &surfaces);
        let views = View::of_octants(
            plan.place,
            OctahedronLayout::Quadratic,
            near,
            Area::whole([plan.side; 2]),
        )?;
        let mut timings = Vec::new();
        let mut recorder = gpu.recorder("capture")?;
        for part in parts_without(&surfaces, &plan.left_out) {
            if recorder.passes_left() == 0 {
                timings.push(
                    std::mem::replace(&mut recorder, gpu.recorder("capture")?)
                        .submit()?
                        .wait()?,
                );
            }
            self.gbuffer.record_part(&mut recorder, &surfaces, &views, &part)?;
        }
        timings.push(recorder.submit()?.wait()?);
        if self.gbuffer.image(Output::Distance).is_some() {
            self.impostor = Some(self.read_impostor(gpu)?);
        }
        if let By::Raster(shading) = &mut self.by {
            let Shading { lights, shade } = &mut **shading;
            let mut recorder = gpu.recorder("capture")?;
            lights.record(&mut recorder, &surfaces, &scene.lights_without_area())?;
            recorder.pass("capture: shade", |pass| {
                let seen = Seen {
                    scene,
                    gbuffer: &self.gbuffer,
                    lights: &*lights,
                    eye: Eye::AllDirections(plan.place),
                    target: Target {
                        buffer: &self.radiance,
                        first: 0,
                        stride: plan.side,
                    },
                };
                let part = PreviewPart {
                    triangles: 0..surfaces.triangles,
                    background: true,
                    probe: None,
                };
                shade.record(pass, &seen, &[part])
            })?;
            timings.push(recorder.submit()?.wait()?);
        }
        Ok(timings)
    }

    fn read_impostor(&self, gpu: &Gpu) -> Result<ImpostorImage> {
        let distances: Vec<f32> = self.gbuffer.read(gpu, Output::Distance)?;
        if distances.iter().any(|distance| distance.is_nan() || *distance <= 0.0) {
            return Err(Error::setting("place", self.plan.place, "lies on a surface"));
        }
        let words: Vec<[u32; 2]> = self.gbuffer.read(gpu, Output::Normals)?;
        let normals: Vec<DVec3> = words
            .iter()
            .map(|[geometric, _]| unpack_octahedral(*geometric, PACKED_NORMAL_BITS))
            .collect();
        let nothing = ImpostorImage::NOTHING;
        let distances = distances.into_iter().map(|distance| distance.min(nothing)).collect();
        ImpostorImage::new(MAP, UVec2::splat(self.plan.side), 1, distances, Some(&normals))
    }
}

/// Numbers of triangles, up to a count, but those that are left out; an empty range where none is left.
fn ranges_without(count: u32, left_out: &[Range<u32>]) -> Vec<Range<u32>> {
    let mut kept = Vec::new();
    let mut start = 0;
    for range in left_out {
        if start < range.start {
            kept.push(start..range.start);
        }
        start = start.max(range.end);
    }
    if start < count || kept.is_empty() {
        kept.push(start.min(count)..count);
    }
    kept
}

/// The draws of all triangles but those that are left out: an empty picture is drawn, too.
fn parts_without(surfaces: &Surfaces<'_>, left_out: &[Range<u32>]) -> Vec<DrawPart> {
    let drawn = ranges_without(surfaces.triangles, left_out);
    let last = drawn.len() - 1;
    let part = |(number, triangles)| DrawPart {
        triangles,
        begins: number == 0,
        ends: number == last,
    };
    drawn.into_iter().enumerate().map(part).collect()
}

/// The paths of a map: each begins in front of what its texel shows, or outside of the scene.
fn paths(gpu: &Gpu, scene: &Arc<GpuScene>, plan: &CapturePlan, impostor: Option<&ImpostorImage>) -> Result<PathTracer> {
    // Finite, so that origins are.
    let outside = (2.0 * scene.surfaces().reach(plan.place)).min(ImpostorImage::NOTHING);
    let start = |distance: &f32| {
        if *distance < ImpostorImage::NOTHING {
            (1.0 - LEAD) * distance
        } else {
            outside
        }
    };
    let starts: Vec<f32> = impostor
        .map_or(&[][..], ImpostorImage::distances)
        .iter()
        .map(start)
        .collect();
    let starts = gpu.buffer_with("capture: starts", Category::Work, &starts)?;
    let [least, most] = plan.bounces;
    let settings = PathTracerSettings {
        path_set: PathSet::new(least, Some(most), PATH_SET_LOBES)?,
        sampler: plan.sampler,
        seed: CAPTURE_SEED,
        ..PathTracerSettings::default()
    };
    PathTracer::of_directions(gpu, Arc::clone(scene), (plan.place, plan.side), starts, settings)
}

/// The middle of the box about triangles as the device has them, metres; `None` without any.
///
/// # Errors
/// [`Error::OutOfMemory`], [`Error::DeviceLost`].
pub(in crate::techniques) fn middle_of(gpu: &Gpu, scene: &GpuScene, ranges: &[Range<u32>]) -> Result<Option<Vec3>> {
    let size = size_of::<SceneTriangle>() as u64;
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for range in ranges.iter().filter(|range| !range.is_empty()) {
        let triangles = scene.surfaces().set.scene_triangles.buffer();
        let part = triangles.slice(u64::from(range.start) * size, range.len() as u64 * size);
        let triangles: Vec<SceneTriangle> = gpu.read(part, range.len())?;
        for corner in triangles.iter().flat_map(|t| [t.a, t.b, t.c]).map(Vec3::from_array) {
            (low, high) = (low.min(corner), high.max(corner));
        }
    }
    Ok((low.x <= high.x).then(|| low + 0.5 * (high - low)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[expect(clippy::single_range_in_vec_init, reason = "ranges of triangles, not their numbers")]
    fn parts_are_all_but_what_is_left_out() {
        let drawn = |count: u32, left_out: &[Range<u32>]| -> Vec<Range<u32>> {
            let parts = ranges_without(count, left_out);
            assert!(parts.iter().all(|range| range.end <= count));
            parts
        };
        assert_eq!(drawn(10, &[]), [0..10]);
        assert_eq!(drawn(10, &[2..4, 4..5, 7..10]), [0..2, 5..7]);
        assert_eq!(drawn(10, &[0..3]), [3..10]);
        assert_eq!(drawn(4, &[0..4]), [4..4]);
        assert_eq!(drawn(0, &[]), [0..0]);
    }
}
