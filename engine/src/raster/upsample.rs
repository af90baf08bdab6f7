//! Bilateral upsampling: a picture of few pixels at those of a larger one of the same view, averaged over neighbours on the same surface alone.
//!
//! Source: T. Engelhardt, "Efficient From-Point Visibility for Global Illumination in Virtual Scenes with Participating Media", PhD thesis, KIT, 2013, §8.2.3 and §11.3. A neighbour counts by its bilinear weight where it lies in the
//! pixel's tangent plane, up to a distance, and has its normal, up to a cosine: what filters of interleaved light ask for, too (`raster/same_surface.glsl`). A depth alone would
//! take slopes for steps.
//!
//! Pixels whose neighbours have next to no weight together are defective: black, marked and counted, to be worked out themselves.
//!
//! Guarantees: deterministic; equal values stay as they are to the bit; nothing leaks over steps and edges that plane and normal tell apart. GLSL: `raster/upsample.comp`; the
//! twin of a pixel is [`upsampled`].

use glam::DVec3;

use super::{GBuffer, Output};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::interface::SampledView;
use crate::gpu::shaders::constants::UPSAMPLE_WEIGHT_MIN;
use crate::gpu::shaders::raster::upsample as kernel;
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, Image, PipelineInfo, Recorder, Sampler, SamplerDesc,
};
use crate::{Error, Result};

/// What an [`Upsampler`] is for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpsampleDesc {
    /// Pixels of the small picture.
    pub coarse: [u32; 2],
    /// Pixels of the large one, whatever their ratio.
    pub fine: [u32; 2],
    /// Distance from a pixel's tangent plane up to which a neighbour counts, metres.
    pub plane_max: f32,
    /// Cosine of the angle between normals above which it does.
    pub normal_min: f32,
}

/// Upsamples pictures on the device.
#[derive(Debug)]
pub struct Upsampler {
    desc: UpsampleDesc,
    pipeline: ComputePipeline<kernel::Kernel>,
    sampler: Sampler,
    values: Buffer,
    defective: Buffer,
    count: Buffer,
}

/// A large picture.
#[derive(Debug, Clone, PartialEq)]
pub struct UpsampledPicture {
    /// By pixel; zeros where nothing is seen, and where it is defective.
    pub values: Vec<[f32; 3]>,
    /// Pixels that have no neighbours.
    pub defective: Vec<bool>,
    /// How many these are.
    pub count: u32,
}

impl Upsampler {
    /// Makes the kernel and its buffers.
    ///
    /// # Errors
    /// [`Error::Setting`] for sizes or thresholds that are none, [`Error::LimitExceeded`] for a picture larger than a buffer of the device, [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, desc: UpsampleDesc) -> Result<Self> {
        let sound = [desc.coarse, desc.fine].iter().flatten().all(|side| *side > 0);
        let thresholds = (0.0..=f32::MAX).contains(&desc.plane_max) && (-1.0..=1.0).contains(&desc.normal_min);
        if !sound || !thresholds {
            let cause = "has no pixels, or thresholds that are none";
            return Err(Error::setting("upsampling", format!("{desc:?}"), cause));
        }
        let pixels = u64::from(desc.fine[0]) * u64::from(desc.fine[1]);
        let bytes = pixels * size_of::<[f32; 3]>() as u64;
        gpu.caps().check_storage("upsampled values", bytes)?;
        let storage = |name, bytes| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        Ok(Self {
            desc,
            pipeline: gpu.compute_pipeline(&())?,
            sampler: gpu.sampler(&SamplerDesc {
                name: "seen texels",
                filter: vk::Filter::NEAREST,
                address: vk::SamplerAddressMode::CLAMP_TO_EDGE,
            })?,
            values: storage("upsampled values", bytes)?,
            defective: storage("defective pixels", pixels * size_of::<u32>() as u64)?,
            count: storage("defective pixels' count", size_of::<u32>() as u64)?,
        })
    }

    /// The kernel.
    pub fn pipeline(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// Values of the large picture, three of 32 bits a pixel, for compute shaders behind [`Upsampler::record`].
    pub fn values(&self) -> &Buffer {
        &self.values
    }

    /// By pixel 1 where it is defective, else 0.
    pub fn defective(&self) -> &Buffer {
        &self.defective
    }

    /// Records the large picture of `input`, values of the small one as compute shaders have written them. Both G-buffers have positions and normals, in the layout for compute shaders
    /// ([`GBuffer::barrier_to`] with `SHADER_READ_ONLY_OPTIMAL`), which they keep.
    ///
    /// # Errors
    /// [`Error::Setting`] for pictures of other sizes, [`Error::Picture`] for a G-buffer that lacks something; those of recording.
    pub fn record(&self, recorder: &mut Recorder, coarse: &GBuffer, fine: &GBuffer, input: &Buffer) -> Result<()> {
        let least = u64::from(self.desc.coarse[0]) * u64::from(self.desc.coarse[1]) * size_of::<[f32; 3]>() as u64;
        if coarse.size() != self.desc.coarse || fine.size() != self.desc.fine || input.bytes() < least {
            let sizes = format!("{:?} to {:?}, {} bytes", coarse.size(), fine.size(), input.bytes());
            return Err(Error::setting("upsampling", sizes, "are not the sizes that it is for"));
        }
        let sampled = |image| SampledView {
            image,
            sampler: &self.sampler,
        };
        let set = kernel::Set0 {
            coarse_positions: sampled(view(coarse, Output::Position)?),
            coarse_normals: sampled(view(coarse, Output::Normals)?),
            fine_positions: sampled(view(fine, Output::Position)?),
            fine_normals: sampled(view(fine, Output::Normals)?),
            coarse_values: input.view(),
            fine_values: self.values.view(),
            defective: self.defective.view(),
            defective_count: self.count.view(),
        };
        let push = kernel::Push {
            coarse_size: self.desc.coarse,
            fine_size: self.desc.fine,
            plane_max: self.desc.plane_max,
            normal_min: self.desc.normal_min,
        };
        recorder.pass("raster: upsample", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_WRITE | Access::COMPUTE);
            pass.fill(self.count.view(), 0)?;
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            let groups = self.pipeline.groups_over(self.desc.fine[0] * self.desc.fine[1]);
            pass.dispatch(&self.pipeline, &[&set], &push, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
            Ok(())
        })
    }

    /// What the last recording has made. Waits for the device.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read(&self, gpu: &Gpu) -> Result<UpsampledPicture> {
        let pixels = self.desc.fine[0] as usize * self.desc.fine[1] as usize;
        let marks: Vec<u32> = gpu.read(self.defective.view(), pixels)?;
        Ok(UpsampledPicture {
            values: gpu.read(self.values.view(), pixels)?,
            defective: marks.into_iter().map(|mark| mark != 0).collect(),
            count: gpu.read::<u32>(self.count.view(), 1)?[0],
        })
    }
}

fn view(gbuffer: &GBuffer, output: Output) -> Result<&Image> {
    gbuffer.image(output).ok_or_else(|| Error::Picture {
        path: output.name().into(),
        cause: "was not asked for".into(),
    })
}

/// A point that a pixel sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenPoint {
    /// Place, metres.
    pub position: DVec3,
    /// Shading normal.
    pub normal: DVec3,
}

/// Whether another point lies in the tangent plane of a point, up to `plane_max` metres.
pub fn lies_in_plane(position: DVec3, normal: DVec3, other: DVec3, plane_max: f64) -> bool {
    normal.dot(other - position).abs() <= plane_max
}

/// Whether another normal is this one, up to a cosine.
pub fn is_same_normal(normal: DVec3, other: DVec3, normal_min: f64) -> bool {
    normal.dot(other) > normal_min
}

/// A pixel of the large picture that sees `own`; `coarse` gives what a pixel of the small one sees, and its value. `None` where it is defective.
pub fn upsampled(
    desc: &UpsampleDesc,
    pixel: [u32; 2],
    own: &SeenPoint,
    coarse: impl Fn([u32; 2]) -> Option<(SeenPoint, DVec3)>,
) -> Option<DVec3> {
    let place = |i: usize| (f64::from(pixel[i]) + 0.5) * f64::from(desc.coarse[i]) / f64::from(desc.fine[i]) - 0.5;
    let (x, y) = (place(0), place(1));
    let (mut sum, mut middle, mut differences) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let other = [x.floor() + dx, y.floor() + dy];
        let is_inside = (0..2).all(|i| other[i] >= 0.0 && other[i] < f64::from(desc.coarse[i]));
        let weight = (1.0 - (x - other[0]).abs()) * (1.0 - (y - other[1]).abs());
        let found = (is_inside && weight > 0.0).then(|| coarse(other.map(|side| side as u32)));
        let is_same = |there: &SeenPoint| {
            lies_in_plane(own.position, own.normal, there.position, desc.plane_max.into())
                && is_same_normal(own.normal, there.normal, desc.normal_min.into())
        };
        if let Some((_, value)) = found.flatten().filter(|(there, _)| is_same(there)) {
            if sum == 0.0 {
                middle = value;
            }
            differences += weight * (value - middle);
            sum += weight;
        }
    }
    (sum >= f64::from(UPSAMPLE_WEIGHT_MIN)).then(|| middle + differences / sum)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "BG-13",
    name: "bilateral upsampling: pictures of few pixels at those of a larger one, over neighbours in the same plane with the same normal",
    role: Role::Kernel,
    limits: "No technique uses it yet; neighbours count or do not, by thresholds; borders of shadows on one surface are blurred, and pixels without neighbours are left to the caller.",
    sources: &[sources::ENGELHARDT_2013.at("§8.2.3 and §11.3")],
    shaders: &[
        "shaders/raster/upsample.comp",
        "shaders/raster/upsample.glsl",
        "shaders/raster/same_surface.glsl",
    ],
    bias: Some(Bias::Biased("light of neighbouring pixels on a surface is averaged")),
    tests: &[
        "engine/src/raster/upsample.rs::equal_values_stay_and_planes_are_told_apart",
        "tests/tests/raster/upsample.rs::steps_keep_both_values_and_what_has_no_neighbours_is_defective",
        "tests/tests/raster/upsample.rs::pictures_agree_with_their_twin",
        "tests/tests/raster/upsample.rs::mistakes_are_refused",
    ],
    api: &["clerestory::raster::upsample::Upsampler"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    const DESC: UpsampleDesc = UpsampleDesc {
        coarse: [4, 4],
        fine: [8, 8],
        plane_max: 0.1,
        normal_min: 0.9,
    };

    fn value_of(band: f64) -> DVec3 {
        DVec3::splat(band)
    }

    fn point(height: f64) -> SeenPoint {
        SeenPoint {
            position: DVec3::new(0.0, height, 0.0),
            normal: DVec3::Y,
        }
    }

    #[test]
    fn equal_values_stay_and_planes_are_told_apart() {
        let value = DVec3::new(0.3, 0.7, 1.9);
        for pixel in [[0, 0], [3, 4], [7, 7]] {
            let found = upsampled(&DESC, pixel, &point(0.0), |_| Some((point(0.05), value)));
            assert_eq!(found, Some(value));
            assert_eq!(
                upsampled(&DESC, pixel, &point(0.0), |_| Some((point(0.2), value))),
                None
            );
            assert_eq!(upsampled(&DESC, pixel, &point(0.0), |_| None), None);
        }
        // Between two columns, a quarter from the nearer one.
        let ramp = |[x, _]: [u32; 2]| Some((point(0.0), DVec3::splat(f64::from(x))));
        let found = upsampled(&DESC, [3, 4], &point(0.0), ramp).expect("neighbours");
        assert!((found.x - 1.25).abs() < 1e-15, "{found}");
        // Of the column beyond a step nothing counts.
        let step = |[x, _]: [u32; 2]| Some((point(if x < 2 { 0.0 } else { 1.0 }), DVec3::splat(f64::from(x))));
        assert_eq!(upsampled(&DESC, [3, 4], &point(0.0), step), Some(DVec3::splat(1.0)));
        let mut turned = point(0.0);
        turned.normal = DVec3::X;
        assert!(!is_same_normal(DVec3::Y, turned.normal, 0.9));
        assert_eq!(
            upsampled(&DESC, [3, 4], &point(0.0), |_| Some((turned, value_of(1.0)))),
            None
        );
    }
}
