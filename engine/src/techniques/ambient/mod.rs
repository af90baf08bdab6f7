//! Ambient occlusion, the smallest frame method: light of a uniform sky, scattered once and diffusely.
//! Two rays per pixel and frame: from the eye, and one distributed by the cosine. Unbiased on `LE|LDE`. A ray that its quota stops makes its sample NaN, which the film counts and leaves out.

use std::sync::Arc;

use crate::Result;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::techniques::ambient::ambient as kernel;
use crate::gpu::{ComputePipeline, Gpu, PipelineInfo, Recorder, SOFTWARE_LOOP_CAP};
use crate::scene::{Camera, EnvironmentUse, camera_frame::CameraFrame};
use crate::settings::SettingsDecl;
use crate::techniques::{Accumulated, Bias, Card, Foresight, Frame, FrameMethod, FrameTarget, Part, Variant, reasons};
use crate::transport::{GpuScene, PathSet, surface_spec};

const ROW: Row = Row {
    id: "CL-AMBIENT",
    name: "technique `ambient`: ambient occlusion under a uniform sky",
    role: Role::Technique,
    limits: "Light of a uniform sky, scattered once and diffusely: nothing else may emit light, and nothing be seen through.",
    sources: &[sources::ZHUKOV_1998.whole()],
    shaders: &["shaders/techniques/ambient/"],
    path_set: Some("bounces=0..1,lobes=diffuse+reflection+transmission"),
    bias: Some(Bias::Unbiased),
    tests: &["tests/tests/ambient.rs::pictures_are_the_path_tracers"],
    api: &["clerestory::techniques::ambient::Ambient"],
    ..Row::of(file!())
};

pub(super) const CARD: Card = Card {
    id: "ambient",
    summary: "ambient occlusion: what a uniform sky sends to surfaces directly, by a ray over the hemisphere for each pixel and frame",
    rows: &[&[ROW]],
    bias: Bias::Unbiased,
    needs: &[],
    kernels: &[&[&kernel::INFO]],
    path_set: PathSet::UP_TO_DIFFUSE,
    refusals: |scene| {
        reasons(&[
            (scene.environment != EnvironmentUse::Constant, "the sky is not uniform"),
            (scene.shines() || scene.has_unlit, "there are emitters besides the sky"),
            (!scene.is_opaque(), "surfaces let light through"),
            (scene.media.any(), "it has participating media"),
        ])
    },
    settings: SettingsDecl::NONE,
    variants: &[Variant::DEFAULTS],
    foresight: Foresight::FRAMES,
    create: |gpu, scene, view, _| Accumulated::boxed(gpu, view, Ambient::new(gpu, scene)?),
};

/// The kernel, for a scene.
#[derive(Debug)]
pub struct Ambient {
    scene: Arc<GpuScene>,
    pipeline: ComputePipeline<kernel::Kernel>,
    /// Steps that a ray takes at most.
    steps: u64,
}

impl Ambient {
    /// Specializes the kernel.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`](crate::Error::LimitExceeded) for an index whose leaves are too long for a software device.
    pub fn new(gpu: &Gpu, scene: Arc<GpuScene>) -> Result<Self> {
        let index = scene.index_within(gpu, SOFTWARE_LOOP_CAP / 2)?; // each of the two rays
        let spec = surface_spec!(kernel, scene, {
            index_quota: index.quota, index_kind: index.kind, ..Default::default()
        });
        let pipeline = scene.index_traversal().pipeline(gpu, &spec)?;
        let steps = index.steps;
        Ok(Self { scene, pipeline, steps })
    }
}

impl FrameMethod for Ambient {
    fn parts(&mut self, gpu: &Gpu, _: &Camera, [width, height]: [u32; 2]) -> Result<u32> {
        Ok(Part::count(gpu, 2 * self.steps * u64::from(width) * u64::from(height)))
    }

    fn record(&mut self, recorder: &mut Recorder, frame: &Frame<'_>, target: &FrameTarget<'_>) -> Result<()> {
        let [lower, upper] = self.scene.bounds().map(|corner| corner.to_array());
        let camera = CameraFrame::new(frame.camera, target.size)?.rays(target.size);
        let (part, radiance) = (frame.part.range(target.pixels()?), target.radiance.view());
        let push = kernel::Push {
            camera,
            frame: frame.number,
            seed: frame.seed,
            first: part.start,
            lower,
            upper,
        };
        let groups = self.pipeline.groups_over(part.len() as u32);
        recorder.pass("ambient: shade", |pass| {
            let set = kernel::Set0 { radiance };
            let (index, scene) = (self.scene.index_set(), self.scene.scene_set());
            pass.dispatch(&self.pipeline, &[&set, &index, &scene], &push, groups)
        })
    }

    fn path_set(&self) -> PathSet {
        PathSet::UP_TO_DIFFUSE
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        vec![self.pipeline.info()]
    }
}
