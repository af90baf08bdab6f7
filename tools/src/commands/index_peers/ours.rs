//! Our indexes in the comparison: built on the processor or on the device, traced by the device's kernel with an invocation per ray. And the driver's, traced by the
//! same kernel with ray queries.

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::driver::DriverIndex;
use clerestory::accel::lbvh::{self, BuildQuality, LbvhSettings};
use clerestory::accel::trace::TraceSettings;
use clerestory::accel::wide::{LEAF_SIZE, WideBuilder, WideBvh, WideSettings};
use clerestory::accel::{DeviceTraversal, Hit, IndexBinding, IndexKind, Ray, RayIndex};
use clerestory::gpu::ash::vk::Format;
use clerestory::gpu::shaders::accel::trace_rays;
use clerestory::gpu::{
    AccelerationStructure, Buffer, BufferDesc, Category, ComputePipeline, Gpu, TexelView, rw_compute_to_compute,
    transfer_to_compute,
};
use clerestory::{Error, Result};
use clerestory_tools::timing::timed;
use glam::Vec3;

use super::{Contender, Intersection, Spread, Trace, built_in};

/// An index of ours, whose traversal can be watched step by step.
#[derive(Debug)]
pub enum Ours {
    /// Two children a node.
    Binary(Bvh2),
    /// Eight.
    Wide(WideBvh),
}

impl Ours {
    /// As any index.
    pub fn index(&self) -> &dyn RayIndex {
        match self {
            Self::Binary(index) => index,
            Self::Wide(index) => index,
        }
    }
}

/// Builds an index of ours.
pub type Build = fn(&[[Vec3; 3]]) -> Result<Ours>;

/// Our indexes; the first one's hits are those that others are compared with.
pub const INDEXES: [(&str, Build); 5] = [
    ("bvh2, binned", |t| {
        Bvh2::build(t, &Bvh2Settings::default()).map(Ours::Binary)
    }),
    ("lbvh, fast", |t| {
        let settings = LbvhSettings {
            quality: BuildQuality::Fast,
            ..LbvhSettings::default()
        };
        lbvh::build(t, &settings).map(Ours::Binary)
    }),
    ("lbvh, high", |t| {
        lbvh::build(t, &LbvhSettings::default()).map(Ours::Binary)
    }),
    ("wide, of binned", |t| {
        let settings = Bvh2Settings {
            leaf_size: LEAF_SIZE,
            ..Bvh2Settings::default()
        };
        WideBvh::collapse(&Bvh2::build(t, &settings)?, &WideSettings::default()).map(Ours::Wide)
    }),
    ("wide, of lbvh, high", |t| {
        WideBvh::build(t, &WideSettings::default()).map(Ours::Wide)
    }),
];

/// An index that was built, with its seconds.
pub struct Built {
    /// Its name.
    pub name: &'static str,
    /// The index.
    pub index: Ours,
    /// Seconds of its build.
    pub build: Spread,
}

/// Builds all of them.
pub fn build_all(triangles: &[[Vec3; 3]], repeat: u32) -> Result<Vec<Built>> {
    let built = INDEXES.iter().map(|(name, build)| {
        let (index, build) = built_in(repeat, || build(triangles))?;
        Ok(Built { name, index, build })
    });
    built.collect()
}

struct Buffers {
    rays: Buffer,
    hits: Buffer,
    resume: Buffer,
    status: Buffer,
    count: u32,
}

/// An index and rays of several sets on the device.
pub struct Kernel<'a> {
    gpu: &'a Gpu,
    pipeline: ComputePipeline<trace_rays::Kernel>,
    texels: TexelView,
    /// The driver's.
    structure: Option<AccelerationStructure>,
    sets: Vec<Buffers>,
}

impl<'a> Kernel<'a> {
    /// Uploads them.
    pub fn new(gpu: &'a Gpu, index: &dyn RayIndex, sets: &[&[Ray]]) -> Result<Self> {
        let format = Format::R32G32B32A32_UINT;
        let texels = gpu.texels_with(index.name(), Category::Index, format, index.texels())?;
        Self::of(gpu, texels, None, index.device_traversal(), sets)
    }

    fn of(
        gpu: &'a Gpu,
        texels: TexelView,
        structure: Option<AccelerationStructure>,
        traversal: DeviceTraversal,
        sets: &[&[Ray]],
    ) -> Result<Self> {
        // Few enough steps in one dispatch for software devices, which end long loops, and more than these rays need.
        let settings = TraceSettings::ray_per_thread().fitted(gpu.caps(), traversal);
        let spec = trace_rays::Spec {
            index_quota: settings.ray_quota,
            index_count: false,
            index_kind: traversal.kind(),
            ..Default::default()
        };
        let buffers = |rays: &&[Ray]| {
            Ok(Buffers {
                rays: gpu.buffer_with("rays", Category::Work, rays)?,
                hits: gpu.buffer_with("hits", Category::Work, &vec![0_u32; 4 * rays.len()])?,
                resume: gpu.buffer_with("resume", Category::Work, &vec![0_u32; rays.len()])?,
                status: gpu.buffer(&BufferDesc::storage(
                    "status",
                    size_of::<trace_rays::TraceStatus>() as u64,
                    Category::Work,
                ))?,
                count: rays.len() as u32,
            })
        };
        Ok(Self {
            gpu,
            pipeline: traversal.pipeline(gpu, &spec)?,
            texels,
            structure,
            sets: sets.iter().map(buffers).collect::<Result<_>>()?,
        })
    }

    /// Traces a set; seconds by wall clock from submission to the end of waiting.
    pub fn trace(&self, set: usize) -> Result<f64> {
        let buffers = &self.sets[set];
        let set = trace_rays::Set0 {
            trace_rays: buffers.rays.view(),
            trace_hits: buffers.hits.view(),
            trace_resume: buffers.resume.view(),
            trace_status: buffers.status.view(),
        };
        let index = IndexBinding::new(&self.texels, self.structure.as_ref());
        let mut recorder = self.gpu.recorder("trace")?;
        recorder.pass("trace", |pass| {
            pass.fill(buffers.status.view(), 0)?;
            pass.fill(buffers.resume.view(), 0)?;
            pass.barrier(&[
                transfer_to_compute(&buffers.status),
                transfer_to_compute(&buffers.resume),
            ]);
            let push = trace_rays::Push {
                first_ray: 0,
                ray_count: buffers.count,
            };
            let groups = [self.pipeline.groups_for(push.ray_count), 1, 1];
            pass.dispatch(&self.pipeline, &[&set, &index], &push, groups)?;
            pass.barrier(&[rw_compute_to_compute(&buffers.hits)]);
            Ok(())
        })?;
        let (waited, seconds) = timed(|| recorder.submit()?.wait());
        waited?;
        let status = self.gpu.read::<trace_rays::TraceStatus>(buffers.status.view(), 1)?;
        match status.first().map_or(0, |status| status.unfinished) {
            0 => Ok(seconds),
            unfinished => Err(Error::setting("rays", unfinished, "did not end in one dispatch")),
        }
    }

    /// What a set met when it was traced last.
    pub fn met(&self, set: usize) -> Result<Vec<Intersection>> {
        let buffers = &self.sets[set];
        let hits = self.gpu.read::<Hit>(buffers.hits.view(), buffers.count as usize)?;
        let met = |hit: &Hit| {
            if hit.is_hit() {
                Intersection {
                    t: hit.t,
                    triangle: hit.triangle,
                }
            } else {
                Intersection::NONE
            }
        };
        Ok(hits.iter().map(met).collect())
    }
}

/// An index of ours that traces both kinds of rays.
pub fn contender<'a>(gpu: &'a Gpu, built: &Built, rays: &[Vec<Ray>; 2]) -> Result<Contender<'a>> {
    let kernel = Kernel::new(gpu, built.index.index(), &[&rays[0], &rays[1]])?;
    Ok(Contender {
        name: built.name.into(),
        build: built.build,
        sah_cost: Some(built.index.index().statistics().sah_cost),
        trace: traced_by(kernel),
    })
}

/// Our indexes whose rays are not watched step by step, beside [`INDEXES`]: two levels of one instance, which shows what the level above costs where there is nothing to
/// share, and the wide tree that the device builds, uploads included; none of the latter of fewer than two triangles.
pub fn unwatched<'a>(
    gpu: &'a Gpu,
    triangles: &[[Vec3; 3]],
    rays: &[Vec<Ray>; 2],
    repeat: u32,
) -> Result<Vec<Contender<'a>>> {
    let sets: [&[Ray]; 2] = [&rays[0], &rays[1]];
    let settings = WideSettings::default();
    let kind = IndexKind::TwoLevel(settings);
    let (two_level, build) = built_in(repeat, || kind.build(triangles))?;
    let mut all = vec![Contender {
        name: format!("{}, one instance", kind.name()),
        build,
        sah_cost: Some(two_level.statistics().sah_cost),
        trace: traced_by(Kernel::new(gpu, two_level.as_ref(), &sets)?),
    }];
    let builder = WideBuilder::new(gpu, &settings)?;
    let (resident, build) = built_in(repeat, || builder.build_resident(triangles))?;
    if let Some(resident) = resident {
        let kernel = Kernel::of(gpu, resident.texels, None, DeviceTraversal::Wide, &sets)?;
        all.push(Contender {
            name: IndexKind::WideOnDevice(settings).name().into(),
            build,
            sah_cost: Some(resident.statistics.sah_cost),
            trace: traced_by(kernel),
        });
    }
    Ok(all)
}

/// The driver's acceleration structure, built on the device, boxes and uploads included.
pub fn by_driver<'a>(
    gpu: &'a Gpu,
    triangles: &[[Vec3; 3]],
    rays: &[Vec<Ray>; 2],
    repeat: u32,
) -> Result<Contender<'a>> {
    let (index, build) = built_in(repeat, || DriverIndex::build(gpu, triangles))?;
    let DriverIndex {
        structure, triangles, ..
    } = index;
    let traversal = DeviceTraversal::Driver;
    let kernel = Kernel::of(gpu, triangles, Some(structure), traversal, &[&rays[0], &rays[1]])?;
    Ok(Contender {
        name: "driver, ray queries".into(),
        build,
        sah_cost: None,
        trace: traced_by(kernel),
    })
}

fn traced_by(kernel: Kernel<'_>) -> Trace<'_> {
    Box::new(move |kind| {
        let seconds = kernel.trace(kind)?;
        Ok((seconds, kernel.met(kind)?))
    })
}
