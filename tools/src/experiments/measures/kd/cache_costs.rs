//! What caches of kd-trees cost beside what they spare: nodes that each workgroup loads beforehand, and leaves that are fetched again since they have
//! waited; and queues for them, tuned on a scene that is not among those that are measured.

use clerestory::Result;
use clerestory::accel::kd::{KdCaches, KdCounters, KdTraversal, KdTree, Scheme, StackCache};
use clerestory::accel::trace::{Execution, RayTracer, TraceSettings};
use clerestory::accel::{Ray, RayIndex};
use clerestory::gpu::Gpu;

use super::flights::{Case, fly, source_tree};
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;

/// Where queues are tuned.
pub const TUNED_IN: &str = "builtin:materials";
/// Leaves of the tree there.
const TUNED_LEAVES: u32 = 1;

/// Settings of each of [`KdCaches::COMPARED`] in a queue, with the number of workgroups that is fastest in [`TUNED_IN`]; in a smoke run only the first
/// is tuned.
///
/// # Errors
/// Those of scenes and of submissions.
pub fn tuned(context: &Context<'_>, gpu: &Gpu) -> Result<Vec<TraceSettings>> {
    let case = Case::at(TUNED_IN);
    let surfaces = Surfaces::load(&case.scene)?;
    let rays = fly(context, &case, &surfaces, case.light(&surfaces))?.closest();
    let tree = source_tree(&surfaces, TUNED_LEAVES)?;
    let tuned = context.pick(KdCaches::COMPARED.len(), 1);
    let tune = |(form, caches): (usize, KdCaches)| {
        let mut settings = TraceSettings {
            caches,
            ..TraceSettings::persistent(gpu.caps())
        };
        if form >= tuned {
            return Ok(settings);
        }
        let fitted = settings.fitted(gpu.caps(), tree.device_traversal());
        let fastest = RayTracer::new(gpu, &tree, &fitted)?.tune(&rays)?;
        // Quotas are fitted anew to the trees that are measured.
        if let (Execution::Persistent(threads), Some(groups)) = (&mut settings.execution, fastest) {
            threads.groups = groups;
        }
        Ok(settings)
    };
    KdCaches::COMPARED.into_iter().enumerate().map(tune).collect()
}

/// Workgroups of a dispatch.
pub fn groups(settings: &TraceSettings) -> u64 {
    match settings.execution {
        Execution::RayPerThread => 0,
        Execution::Persistent(threads) => threads.groups.into(),
    }
}

/// Nodes that a workgroup fetches to fill its caches from a tree of so many, those on the way to each box among them.
pub fn fetched_beforehand(caches: KdCaches, nodes: usize) -> u64 {
    if caches.node_levels == 0 {
        return 0;
    }
    let kept = (1u64 << caches.node_levels).min(nodes as u64);
    let on_the_way: u64 = match caches.stack {
        StackCache::Bytes => (1..kept).map(|place| u64::from(place.ilog2())).sum(),
        StackCache::None | StackCache::Head => 0,
    };
    kept + on_the_way
}

/// How many leaves wait: of those that a ray visits the first of each two, and the last where it alone is left.
///
/// # Errors
/// As [`KdTraversal::with_caches`].
pub fn leaves_that_wait(tree: &KdTree, caches: KdCaches, [closest, any]: [&[Ray]; 2]) -> Result<u64> {
    if !caches.postpone {
        return Ok(0);
    }
    type Start = fn(Scheme, &Ray) -> KdTraversal;
    let starts: [(Start, &[Ray]); 2] = [(KdTraversal::closest, closest), (KdTraversal::any, any)];
    let mut waited = 0;
    for (start, rays) in starts {
        for ray in rays {
            let mut counters = KdCounters::default();
            let mut traversal = start(Scheme::Stack, ray).with_caches(caches)?;
            traversal.run(tree, ray, u64::MAX, &mut |_, _| true, &mut counters);
            waited += counters.leaves.div_ceil(2);
        }
    }
    Ok(waited)
}

#[cfg(test)]
mod tests {
    use clerestory::accel::kd::KdSettings;
    use glam::Vec3;

    use super::*;

    #[test]
    fn workgroups_load_the_top_of_the_tree() {
        let [none, nodes, head, _, both, boxes, _] = KdCaches::COMPARED;
        assert_eq!([none, head].map(|caches| fetched_beforehand(caches, 5000)), [0, 0]);
        assert_eq!([nodes, both].map(|caches| fetched_beforehand(caches, 5000)), [1024; 2]);
        assert_eq!(fetched_beforehand(nodes, 6), 6);
        // 256 nodes, and for the boxes 2 × 1, 4 × 2, 8 × 3 … 128 × 7 above them.
        assert_eq!(fetched_beforehand(boxes, 5000), 256 + 1538);
    }

    #[test]
    fn one_of_two_leaves_waits() {
        // One leaf: it waits, and nothing comes.
        let tree = KdTree::build(&[[Vec3::ZERO, Vec3::X, Vec3::Y]], &KdSettings::default()).unwrap();
        let ray = Ray {
            origin: [0.2, 0.2, 1.0],
            t_min: 0.0,
            direction: [0.0, 0.0, -1.0],
            t_max: f32::INFINITY,
        };
        let waits = |caches| leaves_that_wait(&tree, caches, [&[ray, ray], &[ray]]).unwrap();
        assert_eq!([KdCaches::COMPARED[0], KdCaches::COMPARED[3]].map(waits), [0, 3]);
    }
}
