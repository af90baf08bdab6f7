//! What the kernels of bidirectional paths have in common on the host: quotas of their rays, the set that they share, and sweeps over what a quota has stopped.

use super::settings::BidirectionalSettings;
use crate::gpu::shaders::constants::INSTANCE_SEARCH_STEPS;
use crate::gpu::shaders::sets::BidirectionalSet;
use crate::gpu::shaders::techniques::bidirectional::bdpt_camera;
use crate::gpu::{Buffer, BufferDesc, Category, DeviceKind, Gpu, SOFTWARE_LOOP_CAP, TexelView};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// What kernels count.
pub(super) type Counters = bdpt_camera::BidirectionalCounters;

/// Loop iterations of a connection beside those of its ray: its loops over look-ups, and itself.
const CONNECTION_ITERATIONS: u32 = 6;
/// Searches for an instance of a connection, beside those of its ray.
const SEARCHES: u32 = 3 * INSTANCE_SEARCH_STEPS;
/// Sweeps over what has stopped before its rays count as endless.
const SWEEPS_MAX: u64 = 1 << 16;
/// Rays of a submission that a kernel of many at once makes: a second or less on two cores.
const SOFTWARE_RAYS: u32 = 1 << 19;
const DEVICE_RAYS: u32 = 1 << 24;

/// Loop iterations after which a ray goes on in a later dispatch, of an invocation with `rays` of them: together they stay below what software drivers run.
///
/// # Errors
/// [`Error::LimitExceeded`] where a leaf of the scene's index alone takes too many.
pub(super) fn quota_of(gpu: &Gpu, scene: &GpuScene, settings: &BidirectionalSettings, rays: u32) -> Result<u32> {
    let filters = scene.profile().has_alpha();
    let searches = if scene.profile().keeps_instances { SEARCHES } else { 0 };
    let each = (SOFTWARE_LOOP_CAP / rays.max(1)).saturating_sub(CONNECTION_ITERATIONS + searches);
    let lanes = if filters { gpu.caps().subgroup_size.max(1) } else { 1 };
    let quota = settings.quota().min(each / lanes);
    scene.index_traversal().quota_within(gpu.caps(), quota, each, filters)
}

/// Rays of a submission, in whole workgroups.
pub(super) fn rays_of_submission(gpu: &Gpu) -> u32 {
    match gpu.caps().kind {
        DeviceKind::Cpu => SOFTWARE_RAYS,
        _ => DEVICE_RAYS,
    }
}

/// Refuses rays that never end, by the number of sweeps over what has stopped.
pub(super) fn check_sweeps(kernel: &str, sweeps: u64) -> Result<()> {
    if sweeps <= SWEEPS_MAX {
        return Ok(());
    }
    Err(Error::Overflow {
        kernel: kernel.into(),
        what: "sweeps over rays that were stopped".into(),
        needed: sweeps,
        capacity: SWEEPS_MAX,
        instead: "choose another ray index".into(),
    })
}

/// A buffer of working memory.
pub(super) fn work(gpu: &Gpu, name: &str, bytes: usize, count: u32) -> Result<Buffer> {
    let bytes = bytes as u64 * u64::from(count);
    gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
}

/// Counters on the device and where the host reads them.
pub(super) struct Counts {
    pub device: Buffer,
    pub readback: Buffer,
}

impl Counts {
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let bytes = size_of::<Counters>() as u64;
        Ok(Self {
            device: work(gpu, "bidirectional counters", size_of::<Counters>(), 1)?,
            readback: gpu.buffer(&BufferDesc::readback("bidirectional counters", bytes))?,
        })
    }

    pub fn read(&self) -> Result<Counters> {
        Ok(self.readback.read::<Counters>(0, 1)?[0])
    }
}

/// The set with `other` in every place but that of the vertices, for whoever puts in place of it what its kernels use.
pub(super) fn set_of<'a>(vertices: &'a TexelView, other: &'a Buffer) -> BidirectionalSet<'a> {
    BidirectionalSet {
        light_vertex_texels: vertices,
        light_vertices: vertices.buffer().view(),
        subpath_weights: other.view(),
        connection_states: other.view(),
        bdpt_counters: other.view(),
        light_splats: other.view(),
        splat_sums: other.view(),
    }
}
