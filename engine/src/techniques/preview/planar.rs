//! Planar mirrors: what a plane shows, drawn as a second picture by the camera that it mirrors.
//!
//! Sources: P. Diefenbach, N. Badler, "Multi-Pass Pipeline Rendering: Realism for Dynamic Environments", I3D 1997 (a pass a mirror); E. Lengyel, "Oblique View Frustum
//! Depth Projection and Clipping", Journal of Game Development 1(2), 2005 (the mirror's plane as the near plane). Mirrored are the camera's place and axes, whose frame is
//! left-handed then; surfaces are drawn with both sides, so that nothing else changes.
//!
//! A pixel of the picture is what the ray mirrored at the plane meets, for the same pixel of the camera: where that sees the mirror, a host adds it times what the mirror reflects there. Hosts with several
//! mirrors draw a picture each, and mirrors in mirrors by the camera that the first one mirrors.
//!
//! Bias: the preview's; surfaces nearer to the plane than 2⁻¹⁴ of the distance from it to the farthest of them are not drawn, so that the mirror itself is not. Deterministic.

use glam::Vec3;

use super::shade::{Eye, OUTPUTS, PreviewPart, Seen, Shade, Target};
use super::{Preview, mean_of_samples};
use crate::catalogue::{Bias, Role, Row, Source, sources};
use crate::film::Picture;
use crate::gpu::{Area, Buffer, BufferDesc, Category, Gpu, Recorder};
use crate::raster::{GBuffer, GBufferDesc, Layering, Surfaces, View};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::transport::GpuScene;
use crate::{Error, Result};

/// A plane that mirrors, on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MirrorPlane {
    /// A point of it, metres.
    pub point: Vec3,
    /// Its direction; of any length but 0.
    pub normal: Vec3,
}

impl MirrorPlane {
    /// Its unit normal towards a place, and how far that is, metres.
    fn towards(&self, place: Vec3) -> Result<(Vec3, f32)> {
        let refuse = |cause: &str| Err(Error::setting("plane of a mirror", format!("{self:?}"), cause));
        let Some(normal) = self.normal.try_normalize().filter(|_| self.point.is_finite()) else {
            return refuse("has a point that is not finite, or no direction");
        };
        let height = normal.dot(place - self.point);
        if height == 0.0 || !height.is_finite() {
            return refuse("is one in which the camera lies");
        }
        Ok(if height > 0.0 {
            (normal, height)
        } else {
            (-normal, -height)
        })
    }

    /// The frame of the camera that is seen in the mirror.
    fn mirrored(normal: Vec3, height: f32, frame: &CameraFrame) -> CameraFrame {
        let turned = |axis: [f32; 3]| {
            let axis = Vec3::from_array(axis);
            (axis - 2.0 * normal.dot(axis) * normal).to_array()
        };
        CameraFrame {
            origin: (Vec3::from_array(frame.origin) - 2.0 * height * normal).to_array(),
            right: turned(frame.right),
            up: turned(frame.up),
            forward: turned(frame.forward),
            ..*frame
        }
    }
}

/// A picture of what a plane mirrors, and what draws it.
#[derive(Debug)]
pub struct PlanarMirror {
    gpu: Gpu,
    gbuffer: GBuffer,
    shade: Shade,
    samples: u32,
    radiance: Buffer,
}

impl PlanarMirror {
    /// Allocates a picture of the preview's size and samples; its surfaces are lit as those of the preview, without probes.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for sizes; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, scene: &GpuScene, preview: &Preview) -> Result<Self> {
        let samples = preview.desc().samples;
        let size = preview.desc().size.map(|side| side * samples);
        let gbuffer = GBuffer::new(
            gpu,
            &scene.surfaces(),
            &GBufferDesc {
                size,
                layering: Layering::One,
                outputs: &OUTPUTS,
            },
        )?;
        let bytes = u64::from(size[0]) * u64::from(size[1]) * size_of::<[f32; 3]>() as u64;
        Ok(Self {
            gpu: gpu.clone(),
            gbuffer,
            shade: Shade::new(gpu, scene, preview.lights(), false, None)?,
            samples,
            radiance: gpu.buffer(&BufferDesc::storage("planar mirror", bytes, Category::Film))?,
        })
    }

    /// Records two passes: what of `surfaces` a camera sees in a plane, and its shading by the preview's lights. Afterwards [`radiance`](Self::radiance) is visible to compute shaders.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used or that lies in the plane, a plane without a direction, a preview with other shadow maps or a scene with other features than those that it was
    /// made for; [`Error::MissingBarrier`] in debug builds.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        surfaces: &Surfaces<'_>,
        preview: &Preview,
        camera: &Camera,
        plane: &MirrorPlane,
    ) -> Result<()> {
        let size = self.gbuffer.size();
        let frame = CameraFrame::new(camera, size)?;
        let (normal, height) = plane.towards(Vec3::from_array(frame.origin))?;
        let frame = MirrorPlane::mirrored(normal, height, &frame);
        let view = View::of_frame(&frame, surfaces, Area::whole(size))?;
        let reach = surfaces.reach(view.origin());
        let view = view.cut_by(reach, normal, height);
        self.gbuffer.record(recorder, surfaces, &[view])?;
        recorder.pass("planar mirror: shade", |pass| {
            let seen = Seen {
                scene,
                gbuffer: &self.gbuffer,
                lights: preview.lights(),
                eye: Eye::Camera(&frame),
                target: Target {
                    buffer: &self.radiance,
                    first: 0,
                    stride: size[0],
                },
            };
            let part = PreviewPart {
                triangles: 0..surfaces.triangles,
                background: true,
                probe: None,
            };
            self.shade.record(pass, &seen, &[part])
        })
    }

    /// Radiance of the samples, three f32 each, row by row; pixels lie as those of the camera do.
    pub fn radiance(&self) -> &Buffer {
        &self.radiance
    }

    /// The picture as it is: mean radiance of each pixel's samples. Its last recording must have been submitted.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&self) -> Result<Picture> {
        let size = self.gbuffer.size().map(|side| side / self.samples);
        mean_of_samples(&self.gpu, &self.radiance, size, self.samples)
    }

    /// Bytes of its pictures.
    pub fn bytes(&self) -> u64 {
        self.gbuffer.bytes() + self.radiance.bytes()
    }
}

const DIEFENBACH_BADLER_1997: Source = Source {
    key: "diefenbach-badler-1997",
    authors: "P. Diefenbach, N. Badler",
    title: "Multi-Pass Pipeline Rendering: Realism for Dynamic Environments",
    venue: "I3D",
    year: 1997,
};
const LENGYEL_2005: Source = Source {
    key: "lengyel-2005",
    authors: "E. Lengyel",
    title: "Oblique View Frustum Depth Projection and Clipping",
    venue: "Journal of Game Development 1(2)",
    year: 2005,
};

/// Rows of the catalogue.
pub(super) const ROWS: &[Row] = &[Row {
    id: "MET-E6",
    name: "planar mirrors: a picture by the camera that the plane mirrors, cut off at the plane (MET-P3)",
    role: Role::PartOf("CL-PREVIEW"),
    limits: "A pass for each plane, and for each mirror in a mirror; hosts multiply by what the surface mirrors and put the pictures together.",
    sources: &[
        DIEFENBACH_BADLER_1997.whole(),
        LENGYEL_2005.whole(),
        sources::SZIRMAY_KALOS_2009.whole(),
    ],
    shaders: &[
        "shaders/techniques/preview/preview_shade.comp",
        "shaders/raster/surface.vert",
    ],
    bias: Some(Bias::Biased(
        "the preview's shadows; what touches the plane is not drawn",
    )),
    tests: &[
        "tests/tests/preview/planar.rs::a_planar_mirror_is_the_path_tracers",
        "tests/tests/preview/planar.rs::planes_that_cannot_be_are_refused",
        "engine/src/raster/view.rs::oblique_near_planes_keep_pixels_and_the_order_of_depths",
    ],
    api: &[
        "clerestory::techniques::preview::PlanarMirror",
        "clerestory::techniques::preview::MirrorPlane",
    ],
    ..Row::of(file!())
}];
