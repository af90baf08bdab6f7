//! What the parallel lines of a bundle meet: a list for each texel, by count, scan, second drawing and sort.
//!
//! Guarantees: every fragment that the rasterizer makes is in a list, once; lists are in the order of the depths, of equal ones of the triangles' numbers, on any number of threads; a second drawing with
//! other fragments than the first is an error, and so are lists that the device has no room for.

use glam::{DVec2, Vec3};

use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::constants::BUNDLE_ALONG;
use crate::gpu::shaders::sets::RasterSet;
use crate::gpu::shaders::techniques::ray_bundles::{bundle_frag, bundle_hop, bundle_sort, bundle_vert};
use crate::gpu::shaders::types::{BundleEntry, BundleFragment, RasterView};
use crate::gpu::{
    Access, Area, Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, GraphicsDesc, GraphicsPipeline, Pass,
    PipelineInfo, Recorder, SOFTWARE_LOOP_CAP, Targets, wide_counter,
};
use crate::kernels::{Count, Form, Operation, ReduceWords, Scan, ScanBuffers, ScanOptions};
use crate::raster::{Coverage, DrawPart, Surfaces, View};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// Entries of a list at most: half of what software devices' loops allow, for the sort's loop over a list.
pub const LIST_MAX: u32 = SOFTWARE_LOOP_CAP / 2;

/// What kernels do with lists, memory or pictures, any earlier use of it, and any later one.
const ANY: Access = Access::COMPUTE
    .union(Access::TRANSFER)
    .union(Access::VERTEX_READ)
    .union(Access::FRAGMENT_READ)
    .union(Access::FRAGMENT_WRITE);

/// Keeps what follows from beginning before all that was recorded has ended, and shows it that.
pub(super) fn after_all(pass: &mut Pass<'_>) {
    pass.memory_barrier(ANY, ANY);
}

/// An entry of a list: a triangle that the line meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineHit {
    /// Distance from where the line begins, metres.
    pub depth: f32,
    /// Number of the triangle.
    pub triangle: u32,
    /// Its normal goes along the line.
    pub along: bool,
}

/// Twin of `bundle_texel`: the number of a texel of a square of `side` texels.
pub fn bundle_texel([x, y]: [u32; 2], side: u32) -> u32 {
    y * side + x
}

/// Twin of `bundle_is_before`: whether an entry comes before another of its list.
pub fn bundle_is_before(a: &LineHit, b: &LineHit) -> bool {
    (a.depth.to_bits(), a.triangle) < (b.depth.to_bits(), b.triangle)
}

/// The lists of a bundle on the host.
#[derive(Debug, Clone)]
pub struct BundleLists {
    /// The rays of its lines: [`View::ray`] of the texels' middles.
    pub view: View,
    /// Texels along a side.
    pub side: u32,
    /// Where the list of each texel begins in [`entries`](Self::entries), by row; and where the last one ends.
    pub starts: Vec<u32>,
    /// All lists, one behind the other.
    pub entries: Vec<LineHit>,
}

impl BundleLists {
    /// The list of a texel, from the left and from above.
    pub fn list(&self, texel: [u32; 2]) -> &[LineHit] {
        let number = bundle_texel(texel, self.side) as usize;
        &self.entries[self.starts[number] as usize..self.starts[number + 1] as usize]
    }
}

/// What the first drawing of a bundle has counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Counted {
    /// Entries of all lists.
    pub entries: u32,
    /// Of the longest one.
    pub longest: u32,
}

type Draws = GraphicsPipeline<bundle_vert::Shader, bundle_frag::Shader>;

/// Words of what the host reads, two for each: the longest list, all entries, what the second drawing has left.
const READ_WORDS: u64 = 6;
const LONGEST: u64 = 0;
const ENTRIES: u64 = 2;
const LEFT: u64 = 4;
const WORD: u64 = size_of::<u32>() as u64;
/// What a fragment that counts and writes itself takes, over one of a picture: software devices draw some fifty million of them a second.
const FRAGMENT_COST: f64 = 60.0;

/// Makes the lists of one bundle at a time.
pub(super) struct Lists {
    gpu: Gpu,
    side: u32,
    coverage: Coverage,
    count: Draws,
    write: Draws,
    scan: Scan,
    most: ReduceWords,
    sum: ReduceWords,
    sort: ComputePipeline<bundle_sort::Kernel>,
    hop: ComputePipeline<bundle_hop::Kernel>,
    views: Buffer,
    counts: Buffer,
    starts: Buffer,
    fragments: Buffer,
    entries: Buffer,
    scan_scratch: Buffer,
    reduce_scratch: Buffer,
    result: Buffer,
    readback: Buffer,
    /// The bundle that was sorted last, and its entries.
    last: Option<(View, u32)>,
}

impl Lists {
    /// The kernels that it may take.
    pub const KERNELS: [&'static ShaderInfo; 4] = [
        &bundle_vert::INFO,
        &bundle_frag::INFO,
        &bundle_sort::INFO,
        &bundle_hop::INFO,
    ];

    pub fn new(gpu: &Gpu, side: u32) -> Result<Self> {
        let draws = |writes| {
            gpu.graphics_pipeline(&GraphicsDesc::<bundle_vert::Shader, bundle_frag::Shader> {
                fragment: bundle_frag::Spec {
                    writes,
                    bundle_side: side,
                },
                ..GraphicsDesc::default()
            })
        };
        let scan = Scan::new(gpu, ScanOptions::default())?;
        let reduce = |operation| ReduceWords::new(gpu, operation, Form::default());
        let (most, sum) = (reduce(Operation::Max)?, reduce(Operation::Sum)?);
        let words = words_of(side);
        let buffer = |name, bytes| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        Ok(Self {
            gpu: gpu.clone(),
            side,
            coverage: Coverage::new(gpu)?,
            count: draws(false)?,
            write: draws(true)?,
            sort: gpu.compute_pipeline(&())?,
            hop: gpu.compute_pipeline(&())?,
            views: buffer("bundle view", size_of::<RasterView>() as u64)?,
            counts: buffer("bundle counts", WORD * u64::from(words))?,
            starts: buffer("bundle starts", WORD * u64::from(words))?,
            fragments: buffer("bundle fragments", 0)?,
            entries: buffer("bundle entries", 0)?,
            scan_scratch: buffer("bundle scan", scan.scratch_bytes(words))?,
            reduce_scratch: buffer(
                "bundle reduction",
                most.scratch_bytes(words).max(sum.scratch_bytes(words)),
            )?,
            result: buffer("bundle counted", 2 * WORD)?,
            readback: gpu.buffer(&BufferDesc::readback("bundle counted", READ_WORDS * WORD))?,
            scan,
            most,
            sum,
            last: None,
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.count.info();
        all.extend(self.write.info());
        all.extend(self.scan.pipelines());
        all.extend([&self.most, &self.sum].into_iter().flat_map(ReduceWords::pipelines));
        all.extend([self.sort.info(), self.hop.info()]);
        all
    }

    /// Bytes of the lists and of what makes them.
    pub fn bytes(&self) -> u64 {
        let all = [
            &self.counts,
            &self.starts,
            &self.fragments,
            &self.entries,
            &self.scan_scratch,
            &self.reduce_scratch,
        ];
        all.map(Buffer::bytes).iter().sum()
    }

    /// The bundle of a direction of length 1, moved by a part of a texel.
    pub fn view(&self, direction: Vec3, surfaces: &Surfaces<'_>, shift: DVec2) -> Result<View> {
        View::of_shifted_beam(direction, surfaces.bounds, self.side, shift)
    }

    /// Parts that each of the drawings of a bundle falls in.
    pub fn parts(&self, surfaces: &Surfaces<'_>, view: &View) -> Result<Vec<DrawPart>> {
        self.coverage
            .parts_at(FRAGMENT_COST, surfaces, std::slice::from_ref(view), [self.side; 2])
    }

    fn raster_set<'a>(&'a self, surfaces: &Surfaces<'a>) -> RasterSet<'a> {
        RasterSet {
            raster_views: self.views.view(),
            // No object is asked for.
            raster_objects: surfaces.set.scene_triangles,
        }
    }

    /// Records a part of a drawing.
    fn record_draw(
        &self,
        pass: &mut Pass<'_>,
        pipeline: &Draws,
        surfaces: &Surfaces<'_>,
        part: &DrawPart,
    ) -> Result<()> {
        let set = bundle_frag::Set1 {
            bundle_counts: self.counts.view(),
            bundle_starts: self.starts.view(),
            bundle_fragments: self.fragments.view(),
        };
        let raster = self.raster_set(surfaces);
        let targets = Targets {
            area: Some(Area::whole([self.side; 2])),
            ..Targets::default()
        };
        let push = bundle_vert::Push { first_view: 0 };
        let corner = |triangle: u32| {
            triangle.checked_mul(3).ok_or_else(|| Error::LimitExceeded {
                name: "surfaces".into(),
                value: 3 * u64::from(triangle),
                limit_name: "vertices of a draw",
                limit: u64::from(u32::MAX),
            })
        };
        let corners = corner(part.triangles.start)?..corner(part.triangles.end)?;
        pass.render(&targets, |render| {
            render.draw_range(pipeline, &[&raster, &set, &surfaces.set], &push, corners, 1)
        })
    }

    /// Records what a reduction makes of the counts, for the host to read from that word on.
    fn record_reduced(&self, pass: &mut Pass<'_>, reduce: &ReduceWords, word: u64) -> Result<()> {
        let (words, result) = (Count::Host(words_of(self.side)), self.result.view());
        reduce.record(pass, self.counts.view(), result, words, &self.reduce_scratch)?;
        after_all(pass);
        pass.copy(
            self.result.slice(0, 2 * WORD),
            self.readback.slice(word * WORD, 2 * WORD),
        )
    }

    /// Records a part of the first drawing, and behind the last one the scan of the counts.
    pub fn record_count(
        &self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        view: &View,
        part: &DrawPart,
    ) -> Result<()> {
        recorder.pass("ray-bundles: count", |pass| {
            after_all(pass);
            if part.begins {
                pass.update(self.views.view(), &[view.record()])?;
                pass.fill(self.counts.view(), 0)?;
                after_all(pass);
            }
            self.record_draw(pass, &self.count, surfaces, part)
        })?;
        if !part.ends {
            return Ok(());
        }
        recorder.pass("ray-bundles: scan", |pass| {
            after_all(pass);
            let buffers = ScanBuffers {
                input: self.counts.view(),
                heads: None,
                output: self.starts.view(),
            };
            let words = words_of(self.side);
            self.scan
                .record(pass, &buffers, Count::Host(words), &self.scan_scratch)?;
            after_all(pass);
            self.record_reduced(pass, &self.most, LONGEST)?;
            after_all(pass);
            self.record_reduced(pass, &self.sum, ENTRIES)
        })
    }

    /// What the drawing whose submission is over has counted.
    ///
    /// # Errors
    /// [`Error::Overflow`] for a list that is longer than [`LIST_MAX`], or more entries than a storage buffer of the device holds.
    pub fn counted(&self) -> Result<Counted> {
        let words: Vec<u32> = self.readback.read(0, READ_WORDS as usize)?;
        let word = |place: u64| words[place as usize];
        let counted = Counted {
            entries: word(ENTRIES),
            longest: word(LONGEST),
        };
        self.check_entries(wide_counter([word(ENTRIES), word(ENTRIES + 1)]))?;
        if counted.longest > LIST_MAX {
            return Err(Error::Overflow {
                kernel: bundle_sort::INFO.name.into(),
                what: "triangles along a line of a bundle".into(),
                needed: counted.longest.into(),
                capacity: LIST_MAX.into(),
                instead: "use a technique that traces rays".into(),
            });
        }
        Ok(counted)
    }

    /// Fails for more entries than there can be room for.
    fn check_entries(&self, needed: u64) -> Result<()> {
        let capacity = self.entries_max();
        if needed <= capacity {
            return Ok(());
        }
        Err(Error::Overflow {
            kernel: bundle_frag::INFO.name.into(),
            what: "entries of a bundle's lists".into(),
            needed,
            capacity,
            instead: "set a smaller `raster`".into(),
        })
    }

    /// Entries that a storage buffer of the device holds, each as it is drawn.
    fn entries_max(&self) -> u64 {
        let most = self.gpu.caps().max_storage_buffer_range / size_of::<BundleFragment>() as u64;
        most.min(u32::MAX.into())
    }

    /// Makes room for so many entries, which are counted; true where there was none before.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn make_room(&mut self, entries: u32) -> Result<bool> {
        let each = size_of::<BundleFragment>() as u64;
        let (needed, has) = (u64::from(entries), self.fragments.bytes() / each);
        if needed <= has {
            return Ok(false);
        }
        // Bundles of other directions have more.
        let room = (needed + needed / 4).min(self.entries_max());
        let buffer = |name, each| self.gpu.buffer(&BufferDesc::storage(name, room * each, Category::Work));
        self.fragments = buffer("bundle fragments", each)?;
        self.entries = buffer("bundle entries", size_of::<BundleEntry>() as u64)?;
        Ok(true)
    }

    /// Records a part of the second drawing, and behind the last one what tells whether it had the fragments of the first.
    pub fn record_write(&self, recorder: &mut Recorder, surfaces: &Surfaces<'_>, part: &DrawPart) -> Result<()> {
        recorder.pass("ray-bundles: write", |pass| {
            after_all(pass);
            self.record_draw(pass, &self.write, surfaces, part)?;
            if part.ends {
                after_all(pass);
                self.record_reduced(pass, &self.most, LEFT)?;
            }
            Ok(())
        })
    }

    /// Fails where the second drawing whose submission is over had other fragments than the first.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn check_written(&self) -> Result<()> {
        let left: Vec<u32> = self.readback.read(LEFT * WORD, 1)?;
        if left[0] == 0 {
            return Ok(());
        }
        Err(Error::Internal {
            what: "the second drawing of a bundle".into(),
            fault: "has other fragments than the first".into(),
        })
    }

    /// Records the sort of a range of fragments.
    pub fn record_sort(&self, recorder: &mut Recorder, fragments: std::ops::Range<u32>) -> Result<()> {
        recorder.pass("ray-bundles: sort", |pass| {
            after_all(pass);
            let set = bundle_sort::Set0 {
                bundle_starts: self.starts.view(),
                bundle_fragments: self.fragments.view(),
                bundle_entries: self.entries.view(),
            };
            let push = bundle_sort::Push {
                first: fragments.start,
                end: fragments.end,
            };
            let groups = self.sort.groups_over(fragments.len() as u32);
            pass.dispatch(&self.sort, &[&set], &push, groups)
        })
    }

    /// Notes that the lists of a bundle are there, or that others are being made.
    pub fn keep(&mut self, bundle: Option<(View, u32)>) {
        self.last = bundle;
    }

    /// Records the way of eye paths along the lines of the bundle. `skipped`: distance from a surface's plane up to which entries are passed over, in texels.
    pub fn record_hop(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        (view, skipped): (&View, f32),
        vertices: BufferView<'_>,
        pixels: u32,
    ) -> Result<()> {
        let [right, ..] = view.axes();
        let texel = 2.0 * right.length() / self.side as f32;
        recorder.pass("ray-bundles: hop", |pass| {
            after_all(pass);
            let surfaces = scene.surfaces();
            let set = bundle_hop::Set1 {
                bundle_starts: self.starts.view(),
                bundle_entries: self.entries.view(),
                bundle_vertices: vertices,
            };
            let push = bundle_hop::Push {
                side: self.side,
                first_pixel: 0,
                end_pixel: pixels,
                skipped: skipped * texel,
                width: texel,
            };
            let raster = self.raster_set(&surfaces);
            let groups = self.hop.groups_over(pixels);
            pass.dispatch(&self.hop, &[&raster, &set, &surfaces.set], &push, groups)
        })
    }

    /// The lists that were made last; `None` before the first ones.
    pub fn read(&self) -> Result<Option<BundleLists>> {
        let Some((view, entries)) = self.last else {
            return Ok(None);
        };
        let starts = self.gpu.read(self.starts.view(), words_of(self.side) as usize)?;
        let entries: Vec<BundleEntry> = self.gpu.read(self.entries.view(), entries as usize)?;
        let hit = |entry: &BundleEntry| LineHit {
            depth: entry.depth,
            triangle: entry.triangle & !BUNDLE_ALONG,
            along: entry.triangle & BUNDLE_ALONG != 0,
        };
        Ok(Some(BundleLists {
            view,
            side: self.side,
            starts,
            entries: entries.iter().map(hit).collect(),
        }))
    }
}

/// Words of counts and starts: one for each texel, and one behind them.
fn words_of(side: u32) -> u32 {
    side * side + 1
}
