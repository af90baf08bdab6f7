//! Radiance of what rays meet, with distances in a buffer of their own or as the fourth number of each texel. What layouts are measured by, and what searches
//! cost beside the classical look-up, which is one fetch of radiance. Not for rendering: texels are the nearest, of one layer without normals.
//!
//! Source: L. Szirmay-Kalos, B. Aszódi, I. Lazányi, M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3), 2005.
//! Guarantee: both layouts give the same bits.

use glam::{DVec3, UVec2};

use super::super::directional_map::kind;
use super::device::queries;
use super::{ImpostorImage, ImpostorRay, ImpostorSettings};
use crate::gpu::ash::vk;
use crate::gpu::shaders::maps::impostor_layouts as kernel;
use crate::gpu::{BufferDesc, Category, ComputePipeline, Gpu, TexelView};
use crate::maps::MapImage;
use crate::{Error, Result};

/// Where distances are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ImpostorLayout {
    /// In a buffer of their own.
    Split,
    /// Beside the radiance of each texel.
    Packed,
}

/// Radiance and distances of a map on the device in both layouts.
#[derive(Debug)]
pub struct ImpostorLayouts {
    gpu: Gpu,
    kind: u32,
    size: UVec2,
    extent: [f32; 2],
    texels: TexelView,
    inverses: TexelView,
    is_open: bool,
}

impl ImpostorLayouts {
    /// Uploads radiance and distances of the same map.
    ///
    /// # Errors
    /// [`Error::Setting`] for maps that differ, and for impostors of several layers or with normals; [`Error::LimitExceeded`] for more texels than a texel buffer
    /// has; [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn new(gpu: &Gpu, radiance: &MapImage, image: &ImpostorImage) -> Result<Self> {
        let (map, size) = (image.map(), image.size());
        if radiance.map() != map || radiance.size() != size {
            let value = format!("{} of {}", radiance.map(), radiance.size());
            return Err(Error::setting("radiance", value, format!("is not {map} of {size}")));
        }
        if image.layers() != 1 || image.normals().is_some() {
            let cause = "has several layers, or normals";
            return Err(Error::setting("impostor", map, cause));
        }
        let kind = kind(map).ok_or_else(|| Error::setting("map", map, "has no impostors on the device"))?;
        let inverses = image.inverses();
        let both = radiance.texels().iter().zip(&inverses);
        let texels: Vec<[f32; 4]> = both
            .map(|(radiance, inverse)| radiance.extend(*inverse).to_array())
            .collect();
        let upload = |name, format, values: &[f32]| gpu.texels_with(name, Category::Light, format, values);
        Ok(Self {
            gpu: gpu.clone(),
            kind,
            size,
            extent: image.extent(),
            texels: upload(
                "impostor: texels",
                vk::Format::R32G32B32A32_SFLOAT,
                bytemuck::cast_slice(&texels),
            )?,
            inverses: upload("impostor: distances", vk::Format::R32_SFLOAT, &inverses)?,
            is_open: image.is_open(),
        })
    }

    /// Makes the kernel of a search in a layout.
    ///
    /// # Errors
    /// As [`ImpostorSettings::check`]; [`Error::OutOfMemory`].
    pub fn look_up(&self, settings: &ImpostorSettings, layout: ImpostorLayout) -> Result<ImpostorLookUp<'_>> {
        settings.check(1)?;
        let pipeline = self.gpu.compute_pipeline(&kernel::Spec {
            directional_kind: self.kind,
            impostor_method: settings.method.number(),
            impostor_steps: settings.steps,
            impostor_bisections: settings.bisections,
            directional_border: 0,
            impostor_layers: 1,
            impostor_is_open: self.is_open,
            impostor_packed: layout == ImpostorLayout::Packed,
        })?;
        Ok(ImpostorLookUp {
            layouts: self,
            tolerance: settings.tolerance,
            pipeline,
        })
    }
}

/// A search in one layout, with the radiance of what it finds.
#[derive(Debug)]
pub struct ImpostorLookUp<'a> {
    layouts: &'a ImpostorLayouts,
    tolerance: f32,
    pipeline: ComputePipeline<kernel::Kernel>,
}

impl ImpostorLookUp<'_> {
    /// Radiance of what rays meet, in their order, and the time on the device in seconds: twin [`ImpostorImage::search`] and the texel in its direction. A
    /// software device compiles the kernel within the first one.
    ///
    /// # Errors
    /// As [`Impostor::search`](super::Impostor::search).
    pub fn look_up_timed(&self, rays: &[ImpostorRay]) -> Result<(Vec<DVec3>, f64)> {
        let queries = queries(rays)?;
        if rays.is_empty() {
            return Ok((Vec::new(), 0.0));
        }
        let (layouts, gpu, pipeline) = (self.layouts, &self.layouts.gpu, &self.pipeline);
        let queries = gpu.buffer_with("impostor: rays", Category::Work, &queries)?;
        let bytes = (rays.len() * size_of::<[f32; 3]>()) as u64;
        let values = gpu.buffer(&BufferDesc::storage("impostor: values", bytes, Category::Work))?;
        let set = kernel::Set0 {
            queries: queries.view(),
            texels: &layouts.texels,
            inverses: &layouts.inverses,
            values: values.view(),
        };
        let push = kernel::Push {
            size: layouts.size.as_ivec2().to_array(),
            extent: layouts.extent,
            count: rays.len() as u32,
            tolerance: self.tolerance,
        };
        let mut recorder = gpu.recorder("impostor layouts")?;
        recorder.pass("impostor: look-up", |pass| {
            pass.dispatch(pipeline, &[&set], &push, pipeline.groups_over(push.count))
        })?;
        let seconds = recorder.submit()?.wait()?.seconds();
        let values: Vec<[f32; 3]> = gpu.read(values.view(), rays.len())?;
        let values = values.into_iter().map(|value| DVec3::from_array(value.map(f64::from)));
        Ok((values.collect(), seconds))
    }
}
