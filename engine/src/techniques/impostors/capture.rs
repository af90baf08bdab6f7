//! What a place sees in all directions: distances and normals by rasterization, and radiance by rasterization or by rays.
//!
//! Sources: L. Szirmay-Kalos, B. Aszódi, I. Lazányi, M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3), 2005 (maps of radiance
//! and distance); T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", VMV 2008 (drawn as one picture).
//!
//! The map is an octahedron in the world's axes. Objects can be left out: the eight octants are drawn without them, and paths begin behind them. They go on to cast
//! shadows. Radiance is that at the middles of texels, towards the place.
//!
//! - [`CaptureBy::Raster`]: the preview's shading with its shadow maps, one pass; light of points, spots and directions alone.
//! - [`CaptureBy::Rays`]: the path tracer on a range of bounces; all light, with noise. It has further layers of surfaces behind the first where they are asked for (`peel.rs`).
//!
//! Bias: shadows of the former are those of [`OmniShadowMaps`](crate::raster::OmniShadowMaps), of directional lights of [`ViewShadowMaps`](crate::raster::ViewShadowMaps). Surfaces nearer than 2⁻¹⁴ of the way to the farthest one are not
//! drawn. Deterministic.

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, UVec2, Vec3};

use super::draw::{MapDrawing, shadows_of_side};
use super::peel::Layers;
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::constants::PACKED_NORMAL_BITS;
use crate::gpu::shaders::maps::{directional_border, directional_coarser};
use crate::gpu::shaders::raster::{surface_frag, surface_octant_vert, surface_vert};
use crate::gpu::shaders::techniques::path::path_directions;
use crate::gpu::shaders::techniques::preview::preview_shade;
use crate::gpu::shaders::types::SceneTriangle;
use crate::gpu::{Buffer, BufferDesc, Category, Gpu, PipelineInfo, Timings};
use crate::maps::impostor::ImpostorImage;
use crate::maps::packed_direction::unpack_octahedral;
use crate::maps::{MapImage, Parametrization};
use crate::raster::{Output, SHADOW_MAPS_MAX};
use crate::techniques::preview::LightRoom;
use crate::techniques::{PathTracer, PathTracerSettings, reasons};
use crate::transport::path_set::PATH_SET_LOBES;
use crate::transport::random::SamplerKind;
use crate::transport::{GpuScene, PathSet};
use crate::{Error, Result};

/// How radiance comes into a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CaptureBy {
    /// By rasterization where points, spots and directional lights alone emit light, nothing is there in part and shadow maps fit, by rays elsewhere.
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
pub(in crate::techniques) const KERNELS: [&ShaderInfo; 7] = [
    &path_directions::INFO,
    &preview_shade::INFO,
    &surface_octant_vert::INFO,
    &surface_vert::INFO,
    &surface_frag::INFO,
    &directional_coarser::INFO,
    &directional_border::INFO,
];

/// Of the paths of all maps: their noise is the same in all samples and in pictures of all seeds, so that pilot pictures show it as the bias that it is.
const CAPTURE_SEED: u32 = 0x6d61_7021;

impl CaptureBy {
    /// What it is for a scene, the numbers of bounces and of layers that are wanted, and a side of shadow maps.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for rasterization of light that it does not bring; [`Error::Setting`] and [`Error::LimitExceeded`] for rasterization with shadow maps that do not fit.
    pub(in crate::techniques) fn resolved(
        self,
        technique: &str,
        (gpu, scene): (&Gpu, &GpuScene),
        [most_bounces, layers]: [u32; 2],
        shadow_side: u32,
    ) -> Result<Self> {
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
                layers != 1,
                "a rasterized map has one layer of surfaces; capture by rays finds those behind it",
            ),
            (
                placed.max(profile.lights.directional) > SHADOW_MAPS_MAX as usize,
                "there are more lights than rasterized maps have; capture by rays takes all",
            ),
        ]);
        // What it draws otherwise than it is.
        let is_off = profile.alpha.blend;
        let fit = || shadows_of_side(shadow_side).fit(gpu, LightRoom::of(&scene.lights_without_area()));
        match self {
            Self::Auto if reasons.is_empty() && !is_off && fit().is_ok() => Ok(Self::Raster),
            Self::Auto => Ok(Self::Rays),
            Self::Raster if !reasons.is_empty() => Err(Error::Unsupported {
                technique: technique.into(),
                reasons,
            }),
            Self::Raster => fit().map(|()| Self::Raster),
            Self::Rays => Ok(Self::Rays),
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
    /// Whether distances are wanted.
    pub with_distances: bool,
    /// Whether normals are wanted beside them.
    pub with_normals: bool,
    /// Layers of surfaces; 1 without distances, and of a drawn map.
    pub layers: u32,
    /// Triangles that are left out, in their order.
    pub left_out: Vec<Range<u32>>,
    /// Texels along a side of the shadow maps.
    pub shadow_side: u32,
    /// Paths of a texel.
    pub samples: u32,
    /// Of paths.
    pub sampler: SamplerKind,
}

impl CapturePlan {
    /// Texels of all layers.
    pub fn texels(&self) -> u64 {
        u64::from(self.layers) * u64::from(self.side) * u64::from(self.side)
    }

    /// Bytes of a layer's radiance.
    fn layer_bytes(&self) -> u64 {
        u64::from(self.side) * u64::from(self.side) * size_of::<[f32; 3]>() as u64
    }
}

/// A map of what a place sees.
pub(in crate::techniques) struct Captured {
    /// Texels along a side.
    pub side: u32,
    /// Radiance, three f32 a texel, row by row, layer of surfaces by layer; visible to compute shaders.
    pub radiance: Buffer,
    /// Distances, where they were wanted, with normals where those were.
    pub impostor: Option<ImpostorImage>,
}

impl Captured {
    /// The radiance of the first layer on the host.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn read(&self, gpu: &Gpu) -> Result<MapImage> {
        let size = UVec2::splat(self.side);
        let texels: Vec<[f32; 3]> = gpu.read(self.radiance.view(), size.element_product() as usize)?;
        MapImage::new(MAP, size, texels.into_iter().map(Vec3::from_array).collect())
    }

    /// Bytes of radiance, distances and normals.
    pub fn bytes(&self) -> u64 {
        let of_image = |image: &ImpostorImage| {
            let normals = image.normals().unwrap_or_default();
            (size_of_val(image.distances()) + size_of_val(normals)) as u64
        };
        self.radiance.bytes() + self.impostor.as_ref().map_or(0, of_image)
    }
}

/// What the radiance is called among buffers.
const RADIANCE: &str = "captured radiance";
/// The map's parametrization.
pub(in crate::techniques) const MAP: Parametrization = Parametrization::OctahedronQuadratic;

/// A capture under way.
pub(in crate::techniques) struct Capture {
    plan: CapturePlan,
    drawing: MapDrawing,
    /// Of the layer whose paths are traced.
    tracer: Option<Box<PathTracer>>,
    /// Layers whose radiance is there.
    layers_done: u32,
    radiance: Buffer,
    /// What was drawn, and found behind it, until it is an impostor.
    layers: Option<Layers>,
    impostor: Option<ImpostorImage>,
    counts: CaptureCounts,
    /// What has traced its paths, and found its further layers.
    traced_by: Vec<PipelineInfo>,
    is_read: bool,
    is_done: bool,
}

/// Work of a map that is captured by rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::techniques) struct CaptureCounts {
    /// Paths begun.
    pub paths: u64,
    /// Rays of all kinds, those that find further layers among them.
    pub rays: u64,
    /// Paths that were left out since they brought no finite number.
    pub non_finite: u64,
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
        let bytes = plan.layer_bytes() * u64::from(plan.layers);
        gpu.caps().check_storage(RADIANCE, bytes)?;
        Ok(Self {
            drawing: MapDrawing::new(gpu, scene, &plan)?,
            tracer: None,
            layers_done: 0,
            radiance: gpu.buffer(&BufferDesc::storage(RADIANCE, bytes, Category::Light))?,
            layers: None,
            impostor: None,
            counts: CaptureCounts::default(),
            traced_by: Vec::new(),
            is_read: false,
            is_done: false,
            plan,
        })
    }

    /// What draws and shades it, and traces its paths once they are under way.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.drawing.pipelines();
        all.extend(self.layers.iter().flat_map(Layers::pipelines));
        all.extend(self.tracer.iter().flat_map(|tracer| tracer.pipelines()));
        all.extend(self.traced_by.iter().cloned());
        all
    }

    /// Its paths, once they have ended; none of a drawn map.
    pub fn counts(&self) -> CaptureCounts {
        self.counts
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

    /// A piece of the work, bounded whatever the scene: of the drawing, of a further layer, or a submission of paths.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn advance(&mut self, gpu: &Gpu, scene: &Arc<GpuScene>) -> Result<Vec<Timings>> {
        if !self.drawing.is_done() {
            let timings = self.drawing.advance(gpu, scene, &self.plan, &self.radiance)?;
            if self.drawing.is_drawn() && !self.is_read {
                self.layers = self.read_layer(gpu)?;
                self.is_read = true;
            }
            if self.drawing.is_done() && self.plan.by == CaptureBy::Raster {
                self.finish()?;
            }
            return Ok(timings);
        }
        let wanted = self.plan.layers;
        let Some(layers) = &mut self.layers else {
            return Ok(Vec::new());
        };
        if !layers.has(wanted) {
            return Ok(vec![layers.advance(gpu, scene)?]);
        }
        let done = self.layers_done;
        let tracer = match &mut self.tracer {
            Some(tracer) => tracer,
            None => {
                let tracer = paths(gpu, scene, &self.plan, layers, done)?;
                self.tracer.insert(Box::new(tracer))
            }
        };
        if let Some(step) = tracer.step(self.plan.samples)? {
            return Ok(step.timings);
        }
        let (picture, non_finite) = tracer.picture()?;
        let counters = tracer.counters();
        self.counts.paths += counters.paths;
        self.counts.rays += counters.extend_rays + counters.shadow_rays;
        self.counts.non_finite += non_finite.total();
        self.traced_by = tracer.pipelines();
        let radiance = picture.layer("radiance").map_or(&[][..], |layer| layer.values());
        gpu.upload(&self.radiance, u64::from(done) * self.plan.layer_bytes(), radiance)?;
        self.tracer = None;
        self.layers_done += 1;
        if self.layers_done == wanted {
            self.finish()?;
        }
        Ok(Vec::new())
    }

    /// Makes an impostor of the layers, where one is wanted.
    fn finish(&mut self) -> Result<()> {
        if let Some(layers) = self.layers.take() {
            self.counts.rays += layers.rays();
            self.traced_by.extend(layers.pipelines());
            if self.plan.with_distances {
                self.impostor = Some(layers.image()?);
            }
        }
        self.is_done = true;
        Ok(())
    }

    /// What was drawn, where distances are.
    fn read_layer(&self, gpu: &Gpu) -> Result<Option<Layers>> {
        let gbuffer = self.drawing.gbuffer();
        if gbuffer.image(Output::Distance).is_none() {
            return Ok(None);
        }
        let distances: Vec<f32> = gbuffer.read(gpu, Output::Distance)?;
        let normals = || -> Result<Vec<DVec3>> {
            let words: Vec<[u32; 2]> = gbuffer.read(gpu, Output::Normals)?;
            let unpack = |[geometric, _]: &[u32; 2]| unpack_octahedral(*geometric, PACKED_NORMAL_BITS);
            Ok(words.iter().map(unpack).collect())
        };
        let normals = self.plan.with_normals.then(normals).transpose()?;
        let nothing = ImpostorImage::NOTHING;
        let distances = distances.into_iter().map(|distance| distance.min(nothing)).collect();
        let triangles = match self.plan.layers {
            1 => Vec::new(),
            _ => gbuffer.read(gpu, Output::Triangle)?,
        };
        Ok(Some(Layers::new(&self.plan, distances, normals, triangles)))
    }
}

/// The paths of a layer of a map: each begins in front of what its texel shows, or behind it, or outside of the scene.
fn paths(gpu: &Gpu, scene: &Arc<GpuScene>, plan: &CapturePlan, layers: &Layers, layer: u32) -> Result<PathTracer> {
    // Finite, so that origins are.
    let outside = (2.0 * scene.surfaces().reach(plan.place)).min(ImpostorImage::NOTHING);
    let starts = gpu.buffer_with("capture: starts", Category::Work, &layers.starts(layer, outside))?;
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
    let bounds = bounds_of(gpu, scene, ranges)?;
    Ok(bounds.map(|[low, high]| low + 0.5 * (high - low)))
}

/// Least and greatest corner of that box.
fn bounds_of(gpu: &Gpu, scene: &GpuScene, ranges: &[Range<u32>]) -> Result<Option<[Vec3; 2]>> {
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
    Ok((low.x <= high.x).then_some([low, high]))
}
