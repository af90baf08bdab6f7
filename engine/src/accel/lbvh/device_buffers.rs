//! Memory of the linear hierarchy's build on the device.

use crate::Result;
use crate::accel::bvh2::{NODE_QUARTERS, TRIANGLE_QUARTERS};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{LBVH_BOX_QUARTERS, LBVH_NODE_QUARTERS};
use crate::gpu::shaders::types::LbvhState;
use crate::gpu::{Buffer, BufferDesc, Category, Gpu, TexelView};
use crate::kernels::{RadixSort, Scan};

/// Memory of a build: input, what the stages hand on, and the finished index. What later stages only read they read by texels, which
/// software drivers fetch for all lanes at once.
#[derive(Debug)]
pub struct LbvhBuffers {
    pub(in crate::accel) count: u32,
    /// Corners of the triangles, three vectors each, metres; every one can be met by rays.
    pub corners: Buffer,
    /// How hits name each triangle.
    pub indices: Buffer,
    /// The finished index: nodes, then triangles, as [`RayIndex::texels`](crate::accel::RayIndex::texels) has them.
    pub quarters: TexelView,
    pub(super) boxes: TexelView,
    pub(in crate::accel) state: Buffer,
    pub(super) keys: [TexelView; 2],
    pub(super) order: [TexelView; 2],
    pub(super) sort_scratch: Buffer,
    pub(super) nodes: TexelView,
    pub(super) summaries: Buffer,
    pub(super) pending: Buffer,
    pub(super) arrival_counters: Buffer,
    /// Of the dispatches that make a tree again: three words each.
    pub(super) arguments: Buffer,
    pub(super) retained: TexelView,
    pub(super) ranks: TexelView,
    pub(super) scan_scratch: Buffer,
}

impl LbvhBuffers {
    /// For `count` triangles, at least two, in runs of `run`.
    pub(super) fn new(gpu: &Gpu, sort: &RadixSort, ranks: &Scan, run: u32, count: u32) -> Result<Self> {
        let (n, inner) = (u64::from(count), u64::from(count.saturating_sub(1)));
        let runs = u64::from(count.div_ceil(run));
        let buffer = |name, bytes: u64| gpu.buffer(&BufferDesc::storage(name, bytes.max(4), Category::Index));
        let words = |name, texels| gpu.storage_texels(name, Category::Index, vk::Format::R32_UINT, texels);
        let quarters = |name, texels| gpu.storage_texels(name, Category::Index, vk::Format::R32G32B32A32_UINT, texels);
        Ok(Self {
            count,
            corners: buffer("lbvh corners", 36 * n)?,
            indices: buffer("lbvh indices", 4 * n)?,
            quarters: quarters("lbvh", NODE_QUARTERS as u64 * inner + TRIANGLE_QUARTERS as u64 * n)?,
            boxes: quarters("lbvh boxes", u64::from(LBVH_BOX_QUARTERS) * n)?,
            state: buffer("lbvh state", size_of::<LbvhState>() as u64)?,
            keys: [sort.keys("lbvh codes", count)?, sort.keys("lbvh sorted codes", count)?],
            order: [
                sort.values("lbvh order", count)?,
                sort.values("lbvh sorted order", count)?,
            ],
            sort_scratch: buffer("lbvh sort", sort.scratch_bytes(count))?,
            nodes: quarters("lbvh nodes", u64::from(LBVH_NODE_QUARTERS) * inner)?,
            summaries: buffer("lbvh summaries", 24 * inner)?,
            pending: buffer("lbvh pending", 4 * runs * u64::from(1 + run))?,
            arrival_counters: buffer("lbvh arrival counters", 4 * inner)?,
            arguments: buffer("lbvh arguments", 24)?,
            retained: words("lbvh retained", inner)?,
            ranks: words("lbvh ranks", inner)?,
            scan_scratch: buffer("lbvh scan", ranks.scratch_bytes(count))?,
        })
    }

    /// Bytes of everything.
    pub fn bytes(&self) -> u64 {
        let texels = [&self.quarters, &self.boxes, &self.nodes, &self.retained, &self.ranks];
        let buffers = [
            &self.corners,
            &self.indices,
            &self.state,
            &self.sort_scratch,
            &self.summaries,
            &self.pending,
            &self.arrival_counters,
            &self.arguments,
            &self.scan_scratch,
        ];
        let texels = texels.into_iter().chain(&self.keys).chain(&self.order);
        let texels: u64 = texels.map(|t| t.buffer().bytes()).sum();
        texels + buffers.iter().map(|b| b.bytes()).sum::<u64>()
    }
}
