//! Raster preview: a picture per frame, of surfaces from a G-buffer, lights with shadow maps, and light probes.
//!
//! Sources: M. Deering et al., "The Triangle Processor and Normal Vector Shader", SIGGRAPH 1988 (deferred shading); T. Saito and T. Takahashi,
//! "Comprehensible Rendering of 3-D Shapes", SIGGRAPH 1990 (G-buffers); those of [`OmniShadowMaps`](crate::raster::OmniShadowMaps) and of
//! [`LightProbe`]. One compute pass shades what is seen: surfaces and their scattering functions are the path tracer's own.
//!
//! What it shows: emission; point, spot and directional lights, through shadow maps; light of a [`LightProbe`] by two
//! look-ups, the diffuse lobes' and the microfacets' albedos times filtered light. In a uniform environment every opaque material has its exact albedo,
//! but for rough metals by another factor than Schlick's. A [`LiveProbe`] is drawn in the scene itself, so that objects that move reflect what is around them, each frame, or as a [`FadingProbe`] now and then;
//! a [`ReflectionMap`] is drawn likewise, for kernels of hosts that look mirrors and glossy reflections up by a summed-area table; a [`PlanarMirror`] is a second picture,
//! of what a plane shows; and [`SearchedReflections`] find in the distances of a live probe what a body mirrors, which then depends on where it is mirrored.
//!
//! Bias, all of it:
//!
//! - Emitting surfaces light others only through a live map.
//! - Shadows have the bias of [`OmniShadowMaps`](crate::raster::OmniShadowMaps), and those of directional lights of [`ViewShadowMaps`](crate::raster::ViewShadowMaps), whose texels are parts of all of the
//!   scene's width; a host's directional lights cast none unless it asks for maps of them.
//! - A probe's light is neither occluded nor nearer than infinity, and interreflection is limited to what a probe holds.
//! - Microfacet reflections are filtered by a round lobe, mixed of two for roughnesses between those of a probe's levels ([`probe`]), without what the lobe's own Fresnel factors and masking do to its shape.
//! - Rough metals reflect a probe's light by Schlick's factor from their reflectance at normal incidence, whatever the form that they name: without the dip of
//!   Fresnel's equations near grazing angles, which is up to 18 % of aluminium's red. Smooth metals have their form.
//! - Nothing is seen through materials that transmit, and glass casts full shadows.
//! - Partial alpha is drawn opaque, in the picture, in shadow maps and in live maps.
//!
//! Deterministic: the same bits for the same frame.
//!
//! There are two ways to use it: [`Preview`], for hosts that move lights and surfaces, light parts by probes of their own and show one frame each time; and [`PreviewMethod`],
//! a [`FrameMethod`](super::FrameMethod), which is the technique `preview`. That one sees each frame through another place of its pixels, and of the lens,
//! so that edges and what is out of focus converge as frames add up; the environment is its probe. It refuses scenes whose light it would leave out:
//! those where surfaces emit light, those with media, and those where light passes through surfaces; and those with classical microfacets or modified Phong
//! surfaces, which both ways refuse where there are probes, since these are filtered by GGX lobes.

mod card;
mod drawing;
mod fading;
mod lights;
mod live;
mod method;
mod planar;
pub mod probe;
mod reflection;
mod search;
mod shade;

pub(super) use card::CARD;
pub use fading::{FadingProbe, Refresh, RefreshStep};
pub use lights::{PreviewLights, PreviewShadows};
pub use live::LiveProbe;
pub use method::{PreviewMethod, PreviewSettings};
pub use planar::{MirrorPlane, PlanarMirror};
pub use probe::{LightProbe, LightProbeDesc, ProbeMap};
pub use reflection::{ReflectionMap, ReflectionMapDesc};
pub use search::SearchedReflections;
pub use shade::{PARTS_MAX, PreviewPart};

pub(in crate::techniques) use lights::{LightMap, LightRoom};
pub(in crate::techniques) use shade::{Eye, OUTPUTS as SHADED_OUTPUTS, Seen, Shade, Target};

use self::drawing::Drawing;
use crate::film::{Picture, PixelFormat};
use crate::gpu::shaders::techniques::preview::preview_display;
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, Recorder, rw_compute_to_compute};
use crate::raster::Surfaces;
use crate::scene::camera_frame::CameraFrame;
use crate::scene::{Camera, LightKind};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// What a [`Preview`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PreviewDesc {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Samples along each side of a pixel, 1 to 8; their mean is shown.
    pub samples: u32,
    /// Lights at most, up to 1024; with shadow maps up to [`SHADOW_MAPS_MAX`](crate::raster::SHADOW_MAPS_MAX).
    pub lights: u32,
    /// Shadow maps of lights that have a place, and of directional ones as far as they are asked for; `None` for none.
    pub shadows: Option<PreviewShadows>,
    /// Which maps the probes are that surfaces are lit by; `None` where none light them.
    pub probes: Option<ProbeMap>,
}

/// Samples along a side of a pixel at most.
const SAMPLES_MAX: u32 = 8;
/// A picture of a scene, and what draws it.
#[derive(Debug)]
pub struct Preview {
    gpu: Gpu,
    desc: PreviewDesc,
    drawing: Drawing,
    display: ComputePipeline<preview_display::Kernel>,
    /// Of samples, row by row.
    radiance: Buffer,
}

impl Preview {
    /// Allocates a picture, and makes the pipelines for a scene.
    ///
    /// # Errors
    /// [`Error::Setting`] for numbers out of range, which for software devices those of lights times texels of the shadows' filter are, too, where
    /// loops would end early; [`Error::Unsupported`] for a scene with participating media; [`Error::LimitExceeded`] for
    /// sizes; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, scene: &GpuScene, desc: PreviewDesc) -> Result<Self> {
        if !(1..=SAMPLES_MAX).contains(&desc.samples) {
            let cause = format!("is not from 1 to {SAMPLES_MAX}");
            return Err(Error::setting("samples", desc.samples, cause));
        }
        let size = desc.size.map(|side| side.saturating_mul(desc.samples));
        let bytes = u64::from(size[0]) * u64::from(size[1]) * size_of::<[f32; 3]>() as u64;
        gpu.caps().check_storage("preview: samples", bytes)?;
        // Any of the lights that hosts give may have a place.
        let room = LightRoom {
            all: desc.lights,
            placed: desc.lights,
            suns: desc.shadows.map_or(0, |shadows| shadows.suns.min(desc.lights)),
        };
        Ok(Self {
            gpu: gpu.clone(),
            desc,
            drawing: Drawing::new(gpu, scene, size, room, desc.shadows, desc.probes)?,
            display: gpu.compute_pipeline(&())?,
            radiance: gpu.buffer(&BufferDesc::storage("preview radiance", bytes, Category::Film))?,
        })
    }

    /// What it is.
    pub fn desc(&self) -> PreviewDesc {
        self.desc
    }

    /// The lights and their shadow maps.
    pub fn lights(&self) -> &PreviewLights {
        &self.drawing.lights
    }

    /// Records the lights that pictures are lit by from here on: their records, and shadow maps of `surfaces`. To be recorded
    /// anew when lights or surfaces have moved.
    ///
    /// # Errors
    /// [`Error::Setting`] for more lights than there is room for, or one that holds wrong numbers; [`Error::MissingBarrier`] in debug builds.
    pub fn record_lights(
        &mut self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        lights: &[LightKind],
    ) -> Result<()> {
        self.drawing.lights.record(recorder, surfaces, lights)
    }

    /// Records two passes: what a camera sees of `surfaces`, and its shading part by part. Pixels of triangles that belong to no part stay as
    /// they were.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, too many parts, a scene with other features than that which the preview was made for, or
    /// probes where it was made for none or for other maps;
    /// [`Error::MissingBarrier`] in debug builds.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        surfaces: &Surfaces<'_>,
        camera: &Camera,
        parts: &[PreviewPart<'_>],
    ) -> Result<()> {
        let size = self.drawing.size();
        let frame = CameraFrame::new(camera, size)?;
        let target = Target {
            buffer: &self.radiance,
            first: 0,
            stride: size[0],
        };
        self.drawing.record(recorder, scene, surfaces, &frame, target, parts)
    }

    /// Records the way to the screen: four bytes per pixel, rows from the top, exposed by `exposure` stops, clipped and sRGB-encoded.
    /// Earlier uses of the target by compute shaders and copies must have ended.
    ///
    /// # Errors
    /// [`Error::Setting`] when the target is too small; [`Error::MissingBarrier`] in debug builds.
    pub fn record_display(
        &self,
        recorder: &mut Recorder,
        target: &Buffer,
        exposure: f32,
        format: PixelFormat,
    ) -> Result<()> {
        let [width, height] = self.desc.size;
        let bytes = 4 * u64::from(width) * u64::from(height);
        if target.bytes() < bytes {
            let cause = format!("has {} bytes; the picture needs {bytes}", target.bytes());
            return Err(Error::setting("target", target.name(), cause));
        }
        recorder.pass("preview: display", |pass| {
            let set = preview_display::Set0 {
                radiance: self.radiance.view(),
                display_pixels: target.view(),
            };
            let push = preview_display::Push {
                width,
                height,
                samples: self.desc.samples,
                scale: exposure.exp2(),
                bgra: format.blue_first(),
            };
            let groups = self.display.groups_over(width * height);
            pass.dispatch(&self.display, &[&set], &push, groups)?;
            pass.barrier(&[rw_compute_to_compute(target)]);
            Ok(())
        })
    }

    /// The picture as it is: mean radiance of each pixel's samples. Its last recording must have been submitted.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&self) -> Result<Picture> {
        mean_of_samples(&self.gpu, &self.radiance, self.desc.size, self.desc.samples)
    }

    /// Bytes of its pictures and of the shadow maps.
    pub fn bytes(&self) -> u64 {
        self.drawing.bytes() + self.radiance.bytes()
    }
}

/// The picture of samples that lie row by row: means of each pixel's.
fn mean_of_samples(gpu: &Gpu, radiance: &Buffer, [width, height]: [u32; 2], samples: u32) -> Result<Picture> {
    let across = (width * samples) as usize;
    let all: Vec<[f32; 3]> = gpu.read(radiance.view(), across * (height * samples) as usize)?;
    let mut values = Vec::with_capacity(3 * width as usize * height as usize);
    for y in (0..height * samples).step_by(samples as usize) {
        for x in 0..width {
            let mut sum = glam::DVec3::ZERO;
            for row in y..y + samples {
                let first = row as usize * across + (x * samples) as usize;
                let of_row = all[first..first + samples as usize].iter();
                sum += of_row
                    .map(|v| glam::Vec3::from_array(*v).as_dvec3())
                    .sum::<glam::DVec3>();
            }
            values.extend((sum / f64::from(samples * samples)).as_vec3().to_array());
        }
    }
    Picture::from_radiance(width, height, values)
}
