//! Reductions: the sum, minimum or maximum of 32-bit words, and the bounding box of points or boxes.
//!
//! Each team reduces its block, then one workgroup reduces what they found. Guarantees: sums are 64-bit and exact; boxes are exact, subnormals
//! included, since floats are compared as integers of the same order (Herf, "Radix tricks", 2001); equal to [`reduce_words`] and
//! [`reduce_box`], the twins, on every device and in every form.

use super::form::{Form, Teams};
use super::operation::Operation;
use super::stream::{self, Count, Prepare};
use crate::gpu::interface::{BindingSet, ComputeShader};
use crate::gpu::shaders::constants::{FLOAT_INFINITY_BITS, FLOAT_SIGN_BIT};
use crate::gpu::shaders::kernels::{reduce_box as box_kernel, reduce_words as words_kernel};
use crate::gpu::shaders::types::StreamPlan;
use crate::gpu::{Buffer, BufferView, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::{Error, Result};

/// A reduction of the stream by teams, then of what they found by one workgroup.
#[derive(Debug)]
struct Stages<K> {
    /// For errors.
    kernel: &'static str,
    teams: Teams,
    prepare: Prepare,
    /// Over the stream, then over the parts.
    pipelines: [ComputePipeline<K>; 2],
    /// Of what is found.
    result_words: u64,
}

/// What a reduction goes between.
struct Ends<'a> {
    input: BufferView<'a>,
    input_words: u64,
    result: BufferView<'a>,
}

impl<K: ComputeShader> Stages<K> {
    fn scratch_bytes(&self, capacity: u32) -> u64 {
        stream::scratch_bytes(self.result_words * u64::from(self.teams.shape.max_teams(capacity)))
    }

    fn record(
        &self,
        pass: &mut Pass<'_>,
        ends: &Ends<'_>,
        count: Count<'_>,
        scratch: &Buffer,
        set: &dyn BindingSet<'_>,
        push: impl Fn(StreamPlan) -> K::Push,
    ) -> Result<()> {
        let capacity = count.capacity();
        stream::check_count(self.kernel, capacity)?;
        stream::check_words(ends.input, ends.input_words)?;
        stream::check_words(ends.result, self.result_words)?;
        stream::check_size(scratch, self.scratch_bytes(capacity))?;
        let stream = self.prepare.begin(pass, &self.teams.shape, count, scratch)?;
        let push = push(stream.plan);
        stream.dispatch(pass, &self.pipelines[0], set, &push)?;
        // Both stages have the binding.
        stream.between_stages(pass, &[ends.result.buffer]);
        pass.dispatch(&self.pipelines[1], &[set], &push, [1, 1, 1])
    }
}

/// The sum, minimum or maximum of words.
///
/// Barriers: the input must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and earlier uses of the result and the
/// scratch memory must have ended. After it the result has been written, and the scratch memory read and written, by compute shaders.
#[derive(Debug)]
pub struct ReduceWords {
    stages: Stages<words_kernel::Kernel>,
}

impl ReduceWords {
    /// Makes the pipelines. [`Form::Subgroup`] is as [`Form::Shared`] here.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] as [`Form::on`], [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, operation: Operation, form: Form) -> Result<Self> {
        let teams = Teams::new(gpu.caps(), form, "reduce")?;
        let stage = |last| {
            gpu.compute_pipeline(&words_kernel::Spec {
                local_size_x: teams.lanes,
                operation: operation.code(),
                serial: teams.serial(),
                last,
            })
        };
        Ok(Self {
            stages: Stages {
                kernel: "reduce",
                teams,
                prepare: Prepare::new(gpu)?,
                pipelines: [stage(false)?, stage(true)?],
                result_words: 2,
            },
        })
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = vec![self.stages.prepare.info()];
        all.extend(self.stages.pipelines.iter().map(ComputePipeline::info));
        all
    }

    /// Bytes of scratch memory for up to `capacity` words.
    pub fn scratch_bytes(&self, capacity: u32) -> u64 {
        self.stages.scratch_bytes(capacity)
    }

    /// Records a reduction of `input` to `result`: two words, the low one of the 64-bit result first.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when there are more than 2³¹ words or a range is too small; and as [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        input: BufferView<'_>,
        result: BufferView<'_>,
        count: Count<'_>,
        scratch: &Buffer,
    ) -> Result<()> {
        let ends = Ends {
            input,
            input_words: count.capacity().into(),
            result,
        };
        let set = words_kernel::Set0 {
            stream_scratch: scratch.view(),
            reduce_words: input,
            reduce_result: result,
        };
        self.stages
            .record(pass, &ends, count, scratch, &set, |plan| words_kernel::Push { plan })
    }
}

/// What the elements of a [`ReduceBox`] are: 32-bit floats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoxElements {
    /// Words from one element to the next.
    pub stride: u32,
    /// The word of an element where its upper corner begins; 0 where elements are points. The lower corner is its first three words.
    pub upper: u32,
}

impl BoxElements {
    /// Points of three words.
    pub const POINTS: Self = Self { stride: 3, upper: 0 };
    /// Boxes of six words: the lower corner, then the upper.
    pub const BOXES: Self = Self { stride: 6, upper: 3 };
}

/// The bounding box of points or boxes.
///
/// NaN coordinates are left out, each for itself; without any number an axis is (∞, -∞). Infinities count, and -0 lies below +0. Barriers as
/// for [`ReduceWords`].
#[derive(Debug)]
pub struct ReduceBox {
    elements: BoxElements,
    stages: Stages<box_kernel::Kernel>,
}

impl ReduceBox {
    /// Makes the pipelines. [`Form::Subgroup`] is as [`Form::Shared`] here.
    ///
    /// # Errors
    /// [`Error::Setting`] when corners pass the stride, [`Error::MissingFeature`] as [`Form::on`], [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, elements: BoxElements, form: Form) -> Result<Self> {
        if elements.stride > MAX_STRIDE || elements.upper > elements.stride.saturating_sub(3) || elements.stride < 3 {
            let value = format!("{} words, upper corner at {}", elements.stride, elements.upper);
            return Err(Error::setting(
                "elements",
                value,
                "does not hold its corners, or passes 64 words",
            ));
        }
        let mut teams = Teams::new(gpu.caps(), form, "reduce box")?;
        // Each element takes four iterations.
        teams.shape.quota = (teams.shape.quota / 4).next_multiple_of(teams.shape.tile);
        let stage = |last| {
            gpu.compute_pipeline(&box_kernel::Spec {
                local_size_x: teams.lanes,
                serial: teams.serial(),
                last,
                stride: elements.stride,
                upper: elements.upper,
                ..Default::default()
            })
        };
        Ok(Self {
            elements,
            stages: Stages {
                kernel: "reduce box",
                teams,
                prepare: Prepare::new(gpu)?,
                pipelines: [stage(false)?, stage(true)?],
                result_words: 6,
            },
        })
    }

    /// Bytes of scratch memory for up to `capacity` elements.
    pub fn scratch_bytes(&self, capacity: u32) -> u64 {
        self.stages.scratch_bytes(capacity)
    }

    /// Records a reduction of `input` to `result`: six floats, the lower corner first.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when there are more than 2³¹ elements or a range is too small; and as [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        input: BufferView<'_>,
        result: BufferView<'_>,
        count: Count<'_>,
        scratch: &Buffer,
    ) -> Result<()> {
        let ends = Ends {
            input,
            input_words: u64::from(count.capacity()) * u64::from(self.elements.stride),
            result,
        };
        let set = box_kernel::Set0 {
            stream_scratch: scratch.view(),
            reduce_elements: input,
            reduce_box: result,
        };
        self.stages
            .record(pass, &ends, count, scratch, &set, |plan| box_kernel::Push { plan })
    }
}

/// Words of an element of a [`ReduceBox`] at most.
const MAX_STRIDE: u32 = 64;

/// Twin of [`ReduceWords`].
pub fn reduce_words(words: &[u32], operation: Operation) -> u64 {
    let words = words.iter().map(|word| u64::from(*word));
    match operation {
        Operation::Sum => words.sum(),
        Operation::Min => words.min().unwrap_or(operation.identity().into()),
        Operation::Max => words.max().unwrap_or(0),
    }
}

/// Twin of [`ReduceBox`] over points or boxes as pairs of corners.
pub fn reduce_box(elements: impl IntoIterator<Item = [[f32; 3]; 2]>) -> [[f32; 3]; 2] {
    let infinity = ordered_float(FLOAT_INFINITY_BITS);
    let mut corners = [[infinity; 3], [ordered_float(FLOAT_INFINITY_BITS | FLOAT_SIGN_BIT); 3]];
    for element in elements {
        for axis in 0..3 {
            let [lower, upper] = element.map(|corner| corner[axis].to_bits());
            if !nan_bits(lower) {
                corners[0][axis] = corners[0][axis].min(ordered_float(lower));
            }
            if !nan_bits(upper) {
                corners[1][axis] = corners[1][axis].max(ordered_float(upper));
            }
        }
    }
    corners.map(|corner| corner.map(|ordered| f32::from_bits(float_of_ordered(ordered))))
}

/// The bits of a float as an unsigned integer of the same order: keys for sorts of floats. -0 comes before +0, NaNs at both ends. Twin of
/// the GLSL function.
pub fn ordered_float(bits: u32) -> u32 {
    if bits & FLOAT_SIGN_BIT != 0 {
        !bits
    } else {
        bits | FLOAT_SIGN_BIT
    }
}

/// Undoes [`ordered_float`]. Twin of the GLSL function.
pub fn float_of_ordered(ordered: u32) -> u32 {
    if ordered & FLOAT_SIGN_BIT != 0 {
        ordered ^ FLOAT_SIGN_BIT
    } else {
        !ordered
    }
}

/// True for the bits of NaNs. Twin of the GLSL function.
pub fn nan_bits(bits: u32) -> bool {
    bits & !FLOAT_SIGN_BIT > FLOAT_INFINITY_BITS
}
