//! What the kernels of bidirectional paths have in common on the host: quotas of their rays, the sets that they share, and sweeps over what a quota has stopped.

use super::settings::BidirectionalSettings;
use crate::gpu::shaders::constants::{
    CONNECTION_GRID_QUOTA, GRID_WALK_QUOTA, INSTANCE_SEARCH_STEPS, OUTSIDE, PATH_SET_LOBE_COUNT,
};
use crate::gpu::shaders::sets::{BidirectionalMediaSet, BidirectionalSet};
use crate::gpu::shaders::techniques::bidirectional::bdpt_camera;
use crate::gpu::{Buffer, BufferDesc, Category, DeviceKind, Gpu, SOFTWARE_LOOP_CAP, TexelView};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::transport::GpuScene;
use crate::walk::grid_walk_iterations;
use crate::{Error, Result};

/// What kernels count.
pub(super) type Counters = bdpt_camera::BidirectionalCounters;

/// Loop iterations of a connection beside those of its ray: its loops over look-ups, and itself.
const CONNECTION_ITERATIONS: u32 = 6;
/// And those that tell the lobes of its ends apart, of path sets with an automaton: of two classes of lobes, and two look-ups more.
const STATE_ITERATIONS: u32 = 2 * (PATH_SET_LOBE_COUNT + 1) + 2;
/// Searches for an instance of a connection, beside those of its ray.
const SEARCHES: u32 = 3 * INSTANCE_SEARCH_STEPS;
/// And those for what an invocation looks up once: the surface that its way has come to, the body that it was in, and the material.
const SEARCHES_ONCE: u32 = 3 * INSTANCE_SEARCH_STEPS;
/// Stretches of shadow rays through media that a place or a vertex takes in a dispatch, at most.
const STRETCHES: u32 = 8;
/// Loop iterations of a ray in one dispatch that are worth fewer stretches in it.
const QUOTA_WANTED: u32 = 256;
/// Sweeps over what has stopped before its rays count as endless.
const SWEEPS_MAX: u64 = 1 << 16;
/// Lanes of the widest software devices.
const LANES_MAX: u32 = 16;
/// A stretch has room beside what an invocation does once.
const _: () = assert!(
    grid_walk_iterations(LANES_MAX, GRID_WALK_QUOTA)
        + SEARCHES_ONCE
        + CONNECTION_ITERATIONS
        + STATE_ITERATIONS
        + SEARCHES
        + INSTANCE_SEARCH_STEPS
        + 2 * grid_walk_iterations(LANES_MAX, CONNECTION_GRID_QUOTA)
        < SOFTWARE_LOOP_CAP
);

/// Loop iterations after which a ray goes on in a later dispatch, of an invocation with `rays` of them: together they stay below what software drivers run.
///
/// # Errors
/// [`Error::LimitExceeded`] where a leaf of the scene's index alone takes too many.
pub(super) fn quota_of(gpu: &Gpu, scene: &GpuScene, settings: &BidirectionalSettings, rays: u32) -> Result<u32> {
    let filters = scene.profile().has_alpha();
    let searches = if scene.profile().keeps_instances { SEARCHES } else { 0 };
    let each = (SOFTWARE_LOOP_CAP / rays.max(1)).saturating_sub(beside(settings) + searches);
    let lanes = if filters { gpu.caps().subgroup_size.max(1) } else { 1 };
    let quota = settings.quota().min(each / lanes);
    scene.index_traversal().quota_within(gpu.caps(), quota, each, filters)
}

/// Loop iterations of a connection beside those of its ray and of searches.
fn beside(settings: &BidirectionalSettings) -> u32 {
    let of_states = if settings.has_states() { STATE_ITERATIONS } else { 0 };
    CONNECTION_ITERATIONS + of_states
}

/// Stretches of shadow rays through media that an invocation takes in a dispatch, and loop iterations after which the search of one goes on in the next: together they stay below what
/// software drivers run. `flies` says whether the invocation walks through a grid once besides.
///
/// # Errors
/// As [`quota_of`].
pub(super) fn stretches_of(
    gpu: &Gpu,
    scene: &GpuScene,
    settings: &BidirectionalSettings,
    flies: bool,
) -> Result<(u32, u32)> {
    let profile = scene.profile();
    let filters = profile.has_alpha();
    let lanes = match gpu.caps().kind {
        DeviceKind::Cpu => gpu.caps().subgroup_size.max(1),
        _ => 1,
    };
    let walk = |quota| {
        if profile.media.heterogeneous {
            grid_walk_iterations(lanes, quota)
        } else {
            0
        }
    };
    // With each stretch a boundary is looked up, too.
    let (searches_once, searches) = if profile.keeps_instances {
        (SEARCHES_ONCE, SEARCHES + INSTANCE_SEARCH_STEPS)
    } else {
        (0, 0)
    };
    let once = searches_once + if flies { walk(GRID_WALK_QUOTA) } else { 0 };
    let beside = beside(settings) + searches + walk(CONNECTION_GRID_QUOTA);
    let mut stretches = STRETCHES;
    loop {
        let each = (SOFTWARE_LOOP_CAP.saturating_sub(once) / stretches).saturating_sub(beside);
        let quota = settings.quota().min(if filters { each / lanes } else { each });
        match scene.index_traversal().quota_within(gpu.caps(), quota, each, filters) {
            Ok(quota) if quota >= QUOTA_WANTED.min(settings.quota()) || stretches == 1 => {
                return Ok((stretches, quota));
            }
            Err(error) if stretches == 1 => return Err(error),
            _ => stretches /= 2,
        }
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
        bidirectional_states: other.view(),
    }
}

/// What kernels have besides in scenes with media, with `other` in place of what is kept of rays.
pub(super) fn media_set_of<'a>(scene: &'a GpuScene, other: &'a Buffer) -> BidirectionalMediaSet<'a> {
    let media = scene.media_set();
    BidirectionalMediaSet {
        media_records: media.media_records,
        media_densities: media.media_densities,
        media_majorants: media.media_majorants,
        medium_connection_states: other.view(),
        medium_splat_rays: other.view(),
    }
}

/// The automaton of the path set, where kernels have to tell its paths apart: successors of each state, and the accepting ones.
pub(super) fn path_states(gpu: &Gpu, settings: &BidirectionalSettings) -> Result<Option<Buffer>> {
    if !settings.has_states() {
        return Ok(None);
    }
    let set = &settings.path_set;
    let words: Vec<u32> = set.successors().into_iter().chain([set.accepting()]).collect();
    gpu.buffer_with("bidirectional states", Category::Work, &words)
        .map(Some)
}

/// Where a picture is seen from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewpoint {
    pub frame: CameraFrame,
    /// Material of the innermost body around the camera, or `OUTSIDE`; known in scenes with media alone.
    pub interior: u32,
}

impl Viewpoint {
    /// # Errors
    /// As [`CameraFrame::new`].
    pub fn new(scene: &GpuScene, camera: &Camera, size: [u32; 2]) -> Result<Self> {
        let eye = camera.transform.translation;
        Ok(Self {
            frame: CameraFrame::new(camera, size)?,
            interior: scene.body_around(eye).unwrap_or(OUTSIDE),
        })
    }
}
