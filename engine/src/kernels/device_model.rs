//! The cost model of a device, measured: latency of dependent loads by the size of what they lie in, bandwidth of copies, tickets per second
//! from one counter, and what a boundary between dispatches costs.
//!
//! Sources: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §2.2.2 to §2.2.4, whose figures for a GPU of
//! 2008 explain its choices; H. Wong et al., "Demystifying GPU Microarchitecture through Microbenchmarking", ISPASS 2010 (pointer
//! chasing). The kernels are `shaders/kernels/model_*.comp`.
//!
//! Guarantees: what is done is exact (each place of a chain is visited once per round, each ticket is given once, copies are equal, which
//! the tests check); the seconds are measured.

use std::time::Instant;

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::kernels::{model_chain, model_copy, model_queue};
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, compute_to_transfer, rw_compute_to_compute,
    transfer_to_compute,
};
use crate::{Error, Result};

/// Bytes between places of a [`Chain`]: no two share a line of a cache.
pub const STRIDE: u32 = 64;
/// Words between places.
const STRIDE_WORDS: u32 = STRIDE / 4;
/// Most steps or tickets of an invocation in a dispatch, below the cap of software drivers on iterations.
pub const MAX_ITERATIONS: u32 = 32_768;
/// Bytes that an invocation copies.
const COPIED: u64 = 16;

/// Measures a device.
#[derive(Debug)]
pub struct DeviceModel {
    gpu: Gpu,
    chain: ComputePipeline<model_chain::Kernel>,
    copy: ComputePipeline<model_copy::Kernel>,
    queues: [ComputePipeline<model_queue::Kernel>; 2],
}

/// A walk over all places of a working set in random order, again and again.
#[derive(Debug)]
pub struct Chain<'a> {
    model: &'a DeviceModel,
    links: Buffer,
    place: Buffer,
}

/// One cycle through `places` numbers in random order, each times the stride (Sattolo's shuffle, of fixed seed).
pub fn cycle(places: u32) -> Vec<u32> {
    let mut order: Vec<u32> = (0..places).collect();
    let mut state = 1_u64;
    for i in (1..places as usize).rev() {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        order.swap(i, ((state >> 33) % i as u64) as usize);
    }
    let mut links = vec![0; places as usize * STRIDE_WORDS as usize];
    for (place, next) in order.into_iter().enumerate() {
        links[place * STRIDE_WORDS as usize] = next * STRIDE_WORDS;
    }
    links
}

impl DeviceModel {
    /// Makes the kernels.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] and what pipelines may fail with.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let queue = |by_subgroup| gpu.compute_pipeline(&model_queue::Spec { by_subgroup });
        Ok(Self {
            gpu: gpu.clone(),
            chain: gpu.compute_pipeline(&())?,
            copy: gpu.compute_pipeline(&())?,
            queues: [queue(false)?, queue(true)?],
        })
    }

    /// Records and runs a pass; its seconds by timestamps, or by wall clock where there are none.
    fn run(&self, record: impl FnOnce(&mut Pass<'_>) -> Result<()>) -> Result<f64> {
        let mut recorder = self.gpu.recorder("device model")?;
        recorder.pass("device model", record)?;
        let start = Instant::now();
        let timings = recorder.submit()?.wait()?;
        let wall = start.elapsed().as_secs_f64();
        Ok(if timings.untimed.is_some() {
            wall
        } else {
            timings.seconds()
        })
    }

    fn buffer(&self, name: &str, bytes: u64) -> Result<Buffer> {
        self.gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
    }

    /// A chain through a working set, bytes.
    ///
    /// # Errors
    /// [`Error::Setting`] for less than two places or more than words can number, [`Error::LimitExceeded`], [`Error::OutOfMemory`].
    pub fn chain(&self, bytes: u64) -> Result<Chain<'_>> {
        let places = bytes / u64::from(STRIDE);
        if !(2..=1 << 26).contains(&places) {
            return Err(Error::setting(
                "bytes",
                bytes,
                format!("is not 2 to 2²⁶ places of {STRIDE} bytes"),
            ));
        }
        Ok(Chain {
            model: self,
            links: self.gpu.buffer_with("chain", Category::Work, &cycle(places as u32))?,
            place: self.gpu.buffer_with("place", Category::Work, &[0_u32])?,
        })
    }

    /// Two buffers of that many bytes, rounded down to whole invocations, to copy between.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`], [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn copies(&self, bytes: u64) -> Result<Copies<'_>> {
        let words: Vec<u32> = (0..(bytes / COPIED * 4) as u32).collect();
        Ok(Copies {
            model: self,
            from: self.gpu.buffer_with("from", Category::Work, &words)?,
            to: self.buffer("to", 4 * words.len() as u64)?,
            count: (bytes / COPIED) as u32,
        })
    }

    /// Lets `groups` workgroups of 64 fetch tickets, `fetches` an invocation, by themselves or a subgroup at once.
    ///
    /// # Errors
    /// [`Error::Setting`] for more than [`MAX_ITERATIONS`] fetches; else as [`Self::copies`].
    pub fn tickets(&self, groups: u32, fetches: u32, by_subgroup: bool) -> Result<Tickets> {
        check_iterations("fetches", fetches)?;
        let kernel = &self.queues[usize::from(by_subgroup)];
        let counter = self.buffer("counter", 4)?;
        let tickets = self.buffer("tickets", 4 * u64::from(groups) * u64::from(kernel.group_size()))?;
        self.run(|pass| pass.fill(counter.view(), 0))?;
        let set = model_queue::Set0 {
            model_counter: counter.view(),
            model_tickets: tickets.view(),
        };
        let seconds = self.run(|pass| {
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            pass.dispatch(kernel, &[&set], &model_queue::Push { fetches }, [groups, 1, 1])?;
            pass.barrier(&[compute_to_transfer(&counter), compute_to_transfer(&tickets)]);
            Ok(())
        })?;
        let given = self.gpu.read::<u32>(counter.view(), 1)?;
        let words = self
            .gpu
            .read::<u32>(tickets.view(), (groups * kernel.group_size()) as usize)?;
        Ok(Tickets {
            seconds,
            given: given.first().copied().unwrap_or(0),
            joined: words.into_iter().fold(0, |joined, word| joined ^ word),
        })
    }

    /// Seconds of `count` dispatches of one idle invocation in one submission, a barrier after each.
    ///
    /// # Errors
    /// As [`Self::copies`].
    pub fn boundaries(&self, count: u32) -> Result<f64> {
        let chain = self.chain(2 * u64::from(STRIDE))?;
        self.run(|pass| {
            for _ in 0..count {
                chain.record(pass, 0)?;
            }
            Ok(())
        })
    }

    /// Seconds of wall clock from the submission of one idle invocation to the end of waiting.
    ///
    /// # Errors
    /// As [`Self::copies`].
    pub fn submission(&self) -> Result<f64> {
        let chain = self.chain(2 * u64::from(STRIDE))?;
        let mut recorder = self.gpu.recorder("device model")?;
        recorder.pass("device model", |pass| chain.record(pass, 0))?;
        let start = Instant::now();
        recorder.submit()?.wait()?;
        Ok(start.elapsed().as_secs_f64())
    }
}

fn check_iterations(name: &'static str, count: u32) -> Result<()> {
    if count > MAX_ITERATIONS {
        return Err(Error::setting(name, count, format!("is above {MAX_ITERATIONS}")));
    }
    Ok(())
}

impl Chain<'_> {
    fn record(&self, pass: &mut Pass<'_>, steps: u32) -> Result<()> {
        let set = model_chain::Set0 {
            model_chain: self.links.view(),
            model_place: self.place.view(),
        };
        pass.dispatch(&self.model.chain, &[&set], &model_chain::Push { steps }, [1, 1, 1])?;
        pass.barrier(&[rw_compute_to_compute(&self.place)]);
        Ok(())
    }

    /// Seconds of that many steps from where the last ones ended.
    ///
    /// # Errors
    /// [`Error::Setting`] for more than [`MAX_ITERATIONS`] steps, [`Error::DeviceLost`].
    pub fn walk(&self, steps: u32) -> Result<f64> {
        check_iterations("steps", steps)?;
        self.model.run(|pass| self.record(pass, steps))
    }

    /// The number of the place where the walk stands.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn place(&self) -> Result<u32> {
        let words = self.model.gpu.read::<u32>(self.place.view(), 1)?;
        Ok(words.first().map_or(0, |word| word / STRIDE_WORDS))
    }
}

/// Tickets that were given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tickets {
    /// Seconds it took.
    pub seconds: f64,
    /// How many: where the counter stands.
    pub given: u32,
    /// All tickets that invocations got, joined by exclusive or.
    pub joined: u32,
}

/// Two buffers, one of which is copied to the other.
#[derive(Debug)]
pub struct Copies<'a> {
    model: &'a DeviceModel,
    from: Buffer,
    to: Buffer,
    count: u32,
}

impl Copies<'_> {
    /// Bytes that are copied.
    pub fn bytes(&self) -> u64 {
        COPIED * u64::from(self.count)
    }

    /// Seconds of the kernel.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn by_kernel(&self) -> Result<f64> {
        let kernel = &self.model.copy;
        let set = model_copy::Set0 {
            model_from: self.from.view(),
            model_to: self.to.view(),
        };
        let push = model_copy::Push { count: self.count };
        self.model.run(|pass| {
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            pass.dispatch(kernel, &[&set], &push, [kernel.groups_for(self.count), 1, 1])?;
            pass.barrier(&[compute_to_transfer(&self.to)]);
            Ok(())
        })
    }

    /// Seconds of the copy command.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn by_command(&self) -> Result<f64> {
        self.model.run(|pass| {
            pass.memory_barrier(Access::COMPUTE, Access::TRANSFER);
            pass.copy(self.from.view(), self.to.view())?;
            pass.barrier(&[transfer_to_compute(&self.to)]);
            Ok(())
        })
    }

    /// Whether both buffers hold the same.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn are_equal(&self) -> Result<bool> {
        let read = |buffer: &Buffer| self.model.gpu.read::<u32>(buffer.view(), 4 * self.count as usize);
        Ok(read(&self.from)? == read(&self.to)?)
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-X-0",
    name: "cost model of the device: dependent loads, copies, tickets of a queue, boundaries",
    role: Role::Yardstick,
    limits: "Seconds are those of one device while nothing else runs there.",
    sources: &[
        sources::FABIANOWSKI_2011.at("§2.2.2 to §2.2.4"),
        sources::WONG_2010.whole(),
    ],
    shaders: &[
        "shaders/kernels/model_chain.comp",
        "shaders/kernels/model_copy.comp",
        "shaders/kernels/model_queue.comp",
    ],
    tests: &[
        "engine/src/kernels/device_model.rs::chains_visit_every_place_before_they_come_back",
        "tests/tests/kernels/device_model.rs::timed_runs_have_walked_copied_and_counted_what_was_asked",
    ],
    api: &["clerestory::kernels::device_model::DeviceModel"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_visit_every_place_before_they_come_back() {
        for places in [2, 3, 64, 1000] {
            let links = cycle(places);
            let (mut place, mut seen) = (0, vec![false; places as usize]);
            for _ in 0..places {
                let number = place as usize / STRIDE_WORDS as usize;
                assert!(!std::mem::replace(&mut seen[number], true), "{places}: {number} twice");
                place = links[place as usize];
            }
            assert_eq!(place, 0);
        }
    }
}
