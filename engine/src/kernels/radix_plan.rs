//! Pipelines of the radix sort's stages, and what they are tuned to: see [`radix_sort`](super::radix_sort).

use std::ops::Range;

use super::form::{
    self, BLOCK_ITERATIONS, Form, LEAST_SUBGROUP, SERIAL_LANES, SERIAL_TEAMS, SERIAL_TILE, Shape, WORKGROUP_TEAMS,
};
use super::radix_sort::{RadixSortOptions, SortBuffers};
use super::stream::Stream;
use crate::Result;
use crate::gpu::shaders::constants::KEYS_PER_READ;
use crate::gpu::shaders::kernels::{
    radix_count_serial, radix_count_subgroup, radix_scan, radix_scatter_serial, radix_scatter_subgroup,
};
use crate::gpu::shaders::sets::{RadixSerialSet, RadixSubgroupSet};
use crate::gpu::{Caps, ComputePipeline, DeviceKind, Gpu, Pass, PipelineInfo};

/// Pipelines for one width of digits.
#[derive(Debug)]
pub(super) struct Plan {
    /// The most keys that it is for.
    pub up_to: u32,
    pub shape: Shape,
    digit_bits: u32,
    scan_groups: u32,
    scan: ComputePipeline<radix_scan::Kernel>,
    kernels: Kernels,
}

#[derive(Debug)]
enum Kernels {
    Serial {
        count: ComputePipeline<radix_count_serial::Kernel>,
        scatter: ComputePipeline<radix_scatter_serial::Kernel>,
    },
    Subgroup {
        count: ComputePipeline<radix_count_subgroup::Kernel>,
        scatter: ComputePipeline<radix_scatter_subgroup::Kernel>,
    },
}

/// The digits of a form, by measurement.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tuning {
    up_to: u32,
    digit_bits: u32,
    shape: Shape,
    lanes: u32,
    /// Scatters read the memory ahead that they will write.
    reads_ahead: bool,
}

/// Keys that an invocation of the subgroup form holds at once.
const KEYS_PER_INVOCATION: u32 = 8;
/// Subgroups of a workgroup at most: each has a row of counters in the subgroup form.
const SUBGROUP_ROWS: u32 = 16;

/// Bits of a digit; fewer in the serial form on devices with lanes of their own, each of which then keeps fewer counters.
const DIGIT_BITS: u32 = 8;
const SERIAL_DIGIT_BITS: u32 = 4;

/// On software devices: the most keys that count as few, and keys that blocks are a multiple of, by measurement.
const FEW_KEYS: u32 = 1 << 17;
const FEW_KEYS_TILE: u32 = 128;
const MANY_KEYS_TILE: u32 = 2048;

impl Tuning {
    /// For few keys, and for many.
    pub fn of(caps: &Caps, form: Form) -> [Self; 2] {
        if form == Form::Subgroup {
            // As `Form::on` has it, no more subgroups than rows.
            let lanes = SUBGROUP_ROWS * caps.subgroup_size.min(LEAST_SUBGROUP);
            let tile = lanes * KEYS_PER_INVOCATION;
            let tuning = Self {
                up_to: u32::MAX,
                digit_bits: DIGIT_BITS,
                shape: Shape {
                    tile,
                    quota: u32::MAX / tile * tile,
                    teams_per_group: 1,
                    teams: WORKGROUP_TEAMS,
                },
                lanes,
                reads_ahead: false,
            };
            return [tuning; 2];
        }
        let serial = |up_to, digit_bits, tile, teams: u32, lanes| Self {
            up_to,
            digit_bits,
            shape: Shape {
                tile,
                quota: BLOCK_ITERATIONS * KEYS_PER_READ,
                teams_per_group: lanes,
                teams,
            },
            lanes,
            reads_ahead: false,
        };
        if caps.kind == DeviceKind::Cpu {
            let lanes = caps.subgroup_size.max(1);
            let teams = form::serial_groups() * lanes;
            // Few counters for few keys; and for many, groups that end at about the same time on a busy machine.
            let few = serial(FEW_KEYS, DIGIT_BITS, FEW_KEYS_TILE, (teams / 2).max(1), lanes);
            let many = serial(u32::MAX, DIGIT_BITS, MANY_KEYS_TILE, 2 * teams, lanes);
            [
                few,
                Self {
                    reads_ahead: true,
                    ..many
                },
            ]
        } else {
            [serial(u32::MAX, SERIAL_DIGIT_BITS, SERIAL_TILE, SERIAL_TEAMS, SERIAL_LANES); 2]
        }
    }
}

impl Plan {
    /// Makes the pipelines.
    pub fn new(gpu: &Gpu, options: &RadixSortOptions, form: Form, tuning: Tuning) -> Result<Self> {
        // Digits of equal width need the fewest counters for their number.
        let count = (options.bits.len() as u32).div_ceil(tuning.digit_bits);
        let digit_bits = (options.bits.len() as u32).div_ceil(count);
        let (lanes, key_words, has_values) = (tuning.lanes, options.key.words(), options.values);
        let (serial, bins) = (form == Form::Serial, 1 << digit_bits);
        let kernels = if serial {
            Kernels::Serial {
                count: gpu.compute_pipeline(&radix_count_serial::Spec {
                    local_size_x: lanes,
                    bins,
                    key_words,
                    has_values,
                })?,
                scatter: gpu.compute_pipeline(&radix_scatter_serial::Spec {
                    local_size_x: lanes,
                    bins,
                    key_words,
                    has_values,
                    reads_ahead: tuning.reads_ahead,
                })?,
            }
        } else {
            Kernels::Subgroup {
                count: gpu.compute_pipeline(&radix_count_subgroup::Spec {
                    local_size_x: lanes,
                    bins,
                    key_words,
                    has_values,
                })?,
                scatter: gpu.compute_pipeline(&radix_scatter_subgroup::Spec {
                    local_size_x: lanes,
                    bins,
                    key_words,
                    has_values,
                    keys_per_invocation: KEYS_PER_INVOCATION,
                    max_subgroups: SUBGROUP_ROWS,
                })?,
            }
        };
        let scan = gpu.compute_pipeline(&radix_scan::Spec {
            local_size_x: lanes,
            bins,
            serial,
            ..Default::default()
        })?;
        Ok(Self {
            up_to: tuning.up_to,
            shape: tuning.shape,
            digit_bits,
            scan_groups: bins.div_ceil(if serial { lanes } else { 1 }),
            scan,
            kernels,
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let [count, scatter] = match &self.kernels {
            Kernels::Serial { count, scatter } => [count.info(), scatter.info()],
            Kernels::Subgroup { count, scatter } => [count.info(), scatter.info()],
        };
        vec![count, self.scan.info(), scatter]
    }

    /// Words of scratch memory for up to `capacity` keys.
    pub fn counters(&self, capacity: u32) -> u64 {
        (1 + u64::from(self.shape.max_teams(capacity))) << self.digit_bits
    }

    /// The bits of each digit, the lowest first.
    pub fn digits(&self, bits: &Range<u32>) -> Vec<Range<u32>> {
        let starts = bits.clone().step_by(self.digit_bits as usize);
        starts
            .map(|start| start..(start + self.digit_bits).min(bits.end))
            .collect()
    }

    /// The three stages of one digit.
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        stream: &Stream<'_>,
        buffers: &SortBuffers<'_>,
        from: usize,
        push: radix_scan::Push,
    ) -> Result<()> {
        let (from, to) = (from, 1 - from);
        // Kernels without values have the bindings nevertheless.
        let values = buffers.values.unwrap_or(buffers.keys);
        let serial_set = RadixSerialSet {
            stream_scratch: stream.scratch.view(),
            radix_keys_in: buffers.keys[from],
            radix_keys_out: buffers.keys[to].buffer().view(),
            radix_values_in: values[from],
            radix_values_out: values[to].buffer().view(),
        };
        let subgroup_set = RadixSubgroupSet {
            stream_scratch: stream.scratch.view(),
            radix_keys_from: buffers.keys[from].buffer().view(),
            radix_keys_to: buffers.keys[to].buffer().view(),
            radix_values_from: values[from].buffer().view(),
            radix_values_to: values[to].buffer().view(),
        };
        let radix_scan::Push {
            plan,
            shift,
            mask,
            flip,
        } = push;
        match &self.kernels {
            Kernels::Serial { count, .. } => {
                let push = radix_count_serial::Push {
                    plan,
                    shift,
                    mask,
                    flip,
                };
                stream.dispatch(pass, count, &serial_set, &push)?;
            }
            Kernels::Subgroup { count, .. } => {
                let push = radix_count_subgroup::Push {
                    plan,
                    shift,
                    mask,
                    flip,
                };
                stream.dispatch(pass, count, &subgroup_set, &push)?;
            }
        }
        stream.between_stages(pass, &[]);
        let set = radix_scan::Set0 {
            stream_scratch: stream.scratch.view(),
        };
        pass.dispatch(&self.scan, &[&set], &push, [self.scan_groups, 1, 1])?;
        stream.between_stages(pass, &[]);
        match &self.kernels {
            Kernels::Serial { scatter, .. } => {
                let push = radix_scatter_serial::Push {
                    plan,
                    shift,
                    mask,
                    flip,
                };
                stream.dispatch(pass, scatter, &serial_set, &push)
            }
            Kernels::Subgroup { scatter, .. } => {
                let push = radix_scatter_subgroup::Push {
                    plan,
                    shift,
                    mask,
                    flip,
                };
                stream.dispatch(pass, scatter, &subgroup_set, &push)
            }
        }
    }
}
