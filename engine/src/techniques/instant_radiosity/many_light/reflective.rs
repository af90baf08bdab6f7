//! Virtual lights from reflective shadow maps: views from the lights, what their texels reflect, and points that are warped by it.
//!
//! Sources: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005; C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel
//! Octree", Master's thesis, WPI, 2015, §4.7 and §4.8. Lights that have an area, and the environment, are stood for by points and directions of theirs, chosen anew each
//! frame: primary virtual lights (A. Keller, "Instant Radiosity", SIGGRAPH 1997).
//!
//! A point light has the six faces of a cube, a point of a surface those of them that it lights, a spot of up to 60° a square about its cone, parallel light a square about
//! the scene. Biased by texels: what a texel's middle meets stands for all of it.

use glam::Vec3;

use super::records::LightRecord;
use super::settings::{ManyLightSettings, RsmSequence};
use crate::gpu::ash::vk;
use crate::gpu::interface::SampledView;
use crate::gpu::shaders::constants::{RSM_HALTON, RSM_HAMMERSLEY, RSM_POINT, RSM_RANDOM, RSM_SPOT, RSM_SURFACE};
use crate::gpu::shaders::techniques::instant_radiosity::{rsm_emitters, rsm_flux, rsm_lights};
use crate::gpu::shaders::types::{RsmEmitter, RsmTexel, RsmView, SeenFrom};
use crate::gpu::{
    Access, Area, Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, Sampler, SamplerDesc,
    TexelView,
};
use crate::maps::cube::{CUBE_FACES, cube_axes};
use crate::raster::reflective::FluxPyramids;
use crate::raster::{Coverage, DrawPart, GBuffer, GBufferDesc, Layering, Output, Surfaces, View};
use crate::transport::{GpuScene, surface_spec};
use crate::{Error, Result};

/// Half angle up to which a spot has one view, radians: 60°.
const SPOT_HALF_ANGLE_MAX: f32 = std::f32::consts::FRAC_PI_3;
/// A view's half angle over a spot's, so that the cone's rim lies within it.
const SPOT_MARGIN: f32 = 1.01;
/// Tells the numbers of emitters and of the lights on their maps from those of other samplers.
const EMITTER_SEED: u32 = 0x656d_6974;
const LIGHT_SEED: u32 = 0x7273_6d6c;

/// A view of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LightView {
    pub emitter: u32,
    pub view: View,
}

/// Maps of the lights of a scene, and virtual lights on them.
pub(super) struct Reflective {
    gbuffer: GBuffer,
    coverage: Coverage,
    sampler: Sampler,
    emit: ComputePipeline<rsm_emitters::Kernel>,
    flux: ComputePipeline<rsm_flux::Kernel>,
    choose: ComputePipeline<rsm_lights::Kernel>,
    pyramids: FluxPyramids,
    /// Of the choice among lights, where that is not by the scene's own table.
    choice: Option<TexelView>,
    emitters: Buffer,
    texels: Buffer,
    views: Buffer,
    total: Buffer,
    records: TexelView,
    side: u32,
    emitter_count: u32,
    lights: u32,
    /// Of the lights, that pixels gather by themselves.
    subsets: u32,
    seed: u32,
}

impl Reflective {
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: &ManyLightSettings) -> Result<Self> {
        let (profile, surfaces) = (scene.profile(), scene.surfaces());
        let has_extent = profile.has_environment() || scene.has_area_lights();
        let lights = scene.light_count();
        let chooses = has_extent || lights > settings.emitters;
        let emitter_count = if chooses { settings.emitters } else { lights.max(1) };
        let side = settings.rsm_side;
        let views = emitter_count * CUBE_FACES;
        let has_alpha = profile.has_alpha();
        let emit = surface_spec!(rsm_emitters, scene, {
            chooses,
            has_alpha,
            has_environment: profile.has_environment(),
            has_area_lights: scene.has_area_lights(),
            has_punctual_lights: scene.has_punctual_lights(),
            has_light_tree: false,
            sampler_kind: settings.sampler as u32,
            ..Default::default()
        });
        let flux = surface_spec!(rsm_flux, scene, {
            has_multiple_scattering: false,
            has_alpha: false,
            ..Default::default()
        });
        let choose = surface_spec!(rsm_lights, scene, {
            rsm_sequence: settings.rsm_sequence.kind(),
            has_multiple_scattering: false,
            has_alpha: false,
            ..Default::default()
        });
        let texels = u64::from(views) * u64::from(side).pow(2);
        let bytes = texels * size_of::<RsmTexel>() as u64;
        gpu.caps().check_storage("texels of reflective shadow maps", bytes)?;
        let storage = |name, bytes| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Light));
        Ok(Self {
            gbuffer: GBuffer::new(
                gpu,
                &surfaces,
                &GBufferDesc {
                    size: [side; 2],
                    layering: Layering::One,
                    outputs: &[Output::Triangle, Output::Weights],
                },
            )?,
            coverage: Coverage::new(gpu)?,
            sampler: gpu.sampler(&SamplerDesc {
                name: "texels of lights' views",
                filter: vk::Filter::NEAREST,
                address: vk::SamplerAddressMode::CLAMP_TO_EDGE,
            })?,
            emit: gpu.compute_pipeline(&emit)?,
            flux: gpu.compute_pipeline(&flux)?,
            choose: gpu.compute_pipeline(&choose)?,
            pyramids: FluxPyramids::new(gpu, side, views)?,
            choice: scene.emission_choice(gpu)?,
            emitters: storage("emitters", u64::from(emitter_count) * size_of::<RsmEmitter>() as u64)?,
            texels: storage("texels of lights' views", bytes)?,
            views: storage("lights' views", u64::from(views) * size_of::<RsmView>() as u64)?,
            total: storage("luminance of lights' views", size_of::<f32>() as u64)?,
            records: LightRecord::texels(gpu, settings.lights)?,
            side,
            emitter_count,
            lights: settings.lights,
            subsets: settings.subsets(),
            seed: settings.seed,
        })
    }

    pub fn set_seed(&mut self, seed: u32) {
        self.seed = seed;
    }

    pub fn records(&self) -> &TexelView {
        &self.records
    }

    pub fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    /// Texels along a side of a view.
    pub fn side(&self) -> u32 {
        self.side
    }

    /// Bytes of the views and of what their texels have; not the records of virtual lights.
    pub fn bytes(&self) -> u64 {
        self.gbuffer.bytes() + self.texels.bytes() + self.pyramids.sums().bytes() + self.emitters.bytes()
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.gbuffer.pipelines();
        all.extend([
            self.emit.info(),
            self.flux.info(),
            self.pyramids.pipeline(),
            self.choose.info(),
        ]);
        all
    }

    /// Records what the maps of a frame are drawn from.
    pub fn record_emitters(&self, recorder: &mut Recorder, scene: &GpuScene, frame: u32) -> Result<()> {
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        let push = rsm_emitters::Push {
            scene_lower: lower,
            emitters: self.emitter_count,
            scene_upper: upper,
            frame,
            seed: self.seed ^ EMITTER_SEED,
        };
        recorder.pass("many-light: emitters", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            let set = rsm_emitters::Set0 {
                rsm_emitters: self.emitters.view(),
            };
            let groups = self.emit.groups_over(self.emitter_count);
            let lights = scene.emission_set(self.choice.as_ref());
            pass.dispatch(&self.emit, &[&set, &lights], &push, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
            Ok(())
        })
    }

    /// The views of a frame's emitters, and who each is of. Waits for the device.
    pub fn views(&self, gpu: &Gpu, surfaces: &Surfaces<'_>) -> Result<Vec<LightView>> {
        let emitters: Vec<RsmEmitter> = gpu.read(self.emitters.view(), self.emitter_count as usize)?;
        let mut views = Vec::new();
        for (number, emitter) in (0..).zip(&emitters) {
            // What sends nothing is not drawn.
            if Vec3::from_array(emitter.strength).max_element() > 0.0 {
                let of_one = views_of(emitter, surfaces, self.side)?;
                views.extend(of_one.into_iter().map(|view| LightView { emitter: number, view }));
            }
        }
        let records: Vec<RsmView> = views.iter().map(|view| self.record_of(view)).collect();
        if !records.is_empty() {
            gpu.upload(&self.views, 0, &records)?;
        }
        Ok(views)
    }

    fn record_of(&self, view: &LightView) -> RsmView {
        let [right, down, forward] = view.view.axes().map(|axis| axis.to_array());
        RsmView {
            seen: SeenFrom {
                origin: view.view.origin().to_array(),
                width: self.side,
                right,
                height: self.side,
                down,
                is_parallel: view.view.is_parallel().into(),
                forward,
            },
            emitter: view.emitter,
        }
    }

    /// Emitters, views and what the texels of these have, for kernels that gather from texels.
    pub fn texels(&self) -> [&Buffer; 3] {
        [&self.emitters, &self.views, &self.texels]
    }

    /// Records a part of a view, behind the last one what its texels have.
    pub fn record_view(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        (number, view): (u32, &LightView),
        part: &DrawPart,
    ) -> Result<()> {
        let surfaces = scene.surfaces();
        let views = std::slice::from_ref(&view.view);
        self.gbuffer.record_part(recorder, &surfaces, views, part)?;
        if !part.ends {
            return Ok(());
        }
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        let seen = |output| {
            let image = self.gbuffer.image(output).ok_or_else(|| Error::Picture {
                path: output.name().into(),
                cause: "was not asked for".into(),
            })?;
            Ok::<_, Error>(SampledView {
                image,
                sampler: &self.sampler,
            })
        };
        recorder.pass("many-light: flux of a view", |pass| {
            let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
            self.gbuffer.barrier_to(pass, Access::COMPUTE_READ, layout);
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            let push = rsm_flux::Push {
                scene_lower: lower,
                view: number,
                scene_upper: upper,
            };
            let set = rsm_flux::Set0 {
                seen_triangles: seen(Output::Triangle)?,
                seen_weights: seen(Output::Weights)?,
                rsm_emitters: self.emitters.view(),
                rsm_views: self.views.view(),
                rsm_texels: self.texels.view(),
                flux_sums: self.pyramids.sums().view(),
            };
            let groups = self.flux.groups_over(self.side * self.side);
            pass.dispatch(&self.flux, &[&set, &scene.scene_set()], &push, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            Ok(())
        })
    }

    /// Records virtual lights on the first `views` views of a frame, one or more.
    pub fn record_lights(&self, recorder: &mut Recorder, scene: &GpuScene, views: u32, frame: u32) -> Result<()> {
        recorder.pass("many-light: sums of views", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            self.pyramids.record(pass, views)
        })?;
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        recorder.pass("many-light: lights of views", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            let push = rsm_lights::Push {
                scene_lower: lower,
                lights: self.lights,
                scene_upper: upper,
                views,
                top: self.pyramids.top(),
                capacity: self.pyramids.maps(),
                side: self.side,
                frame,
                seed: self.seed ^ LIGHT_SEED,
                subsets: self.subsets,
            };
            let set = rsm_lights::Set0 {
                rsm_emitters: self.emitters.view(),
                rsm_texels: self.texels.view(),
                flux_sums: self.pyramids.sums().view(),
                rsm_views: self.views.view(),
                virtual_light_records: self.records.buffer().view(),
                rsm_total: self.total.view(),
            };
            let groups = self.choose.groups_over(self.lights);
            pass.dispatch(&self.choose, &[&set, &scene.scene_set()], &push, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
            Ok(())
        })
    }

    /// Luminance that the views of the last lights reflect, W: without any there are no lights. Waits for the device.
    pub fn total(&self, gpu: &Gpu) -> Result<f32> {
        let total: Vec<f32> = gpu.read(self.total.view(), 1)?;
        Ok(total[0])
    }

    /// Virtual lights of a frame that has light.
    pub fn lights(&self) -> u32 {
        self.lights
    }
}

impl RsmSequence {
    /// The number by which kernels know it.
    const fn kind(self) -> u32 {
        match self {
            Self::Halton => RSM_HALTON,
            Self::Hammersley => RSM_HAMMERSLEY,
            Self::Random => RSM_RANDOM,
        }
    }
}

/// Whether a face of a cube has directions on an axis' side: one of its corners has.
fn is_before(axis: Vec3, face: u32) -> bool {
    let [s, t, normal] = cube_axes(face).map(|axis| axis.as_vec3());
    axis.dot(normal) + axis.dot(s).abs() + axis.dot(t).abs() > 0.0
}

/// What an emitter lights, in squares of so many texels.
fn views_of(emitter: &RsmEmitter, surfaces: &Surfaces<'_>, side: u32) -> Result<Vec<View>> {
    let (origin, direction) = (Vec3::from_array(emitter.position), Vec3::from_array(emitter.direction));
    let area = Area::whole([side; 2]);
    let near = View::near_plane(origin, surfaces);
    let half_angle = SPOT_MARGIN * emitter.cos_outer.clamp(-1.0, 1.0).acos();
    let faces = |lit: &dyn Fn(u32) -> bool| -> Result<Vec<View>> {
        (0..CUBE_FACES)
            .filter(|face| lit(*face))
            .map(|face| View::of_cube_face(origin, face, near, area))
            .collect()
    };
    match emitter.kind {
        RSM_POINT => faces(&|_| true),
        RSM_SURFACE => faces(&|face| is_before(direction, face)),
        RSM_SPOT if half_angle <= SPOT_HALF_ANGLE_MAX => Ok(vec![View::of_square(
            origin,
            direction,
            half_angle.max(1e-4),
            near,
            area,
        )?]),
        RSM_SPOT => faces(&|face| emitter.cos_outer < 0.0 || is_before(direction, face)),
        _ => Ok(vec![View::of_beam(direction, surfaces, area)?]),
    }
}
