//! An impostor on the device, and batches of rays through it.

use glam::DVec3;

use super::super::Parametrization;
use super::super::directional_map::kind;
use super::search::is_ray;
use super::settings::{ImpostorSettings, ImpostorTexels};
use super::{ImpostorHit, ImpostorImage, ImpostorRay};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{
    IMPOSTOR_HOLDS_DISTANCE, IMPOSTOR_HOLDS_NORMAL, IMPOSTOR_HOLDS_PLANE, IMPOSTOR_QUERY_TEXELS,
};
use crate::gpu::shaders::maps::impostor_search as kernel;
use crate::gpu::shaders::sets::ImpostorSet;
use crate::gpu::shaders::types::{ImpostorHit as DeviceHit, ImpostorQuery, ImpostorShape};
use crate::gpu::{Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, Pass, PipelineInfo, TexelView};
use crate::maps::is_unit;
use crate::{Error, Result};

// Rays are one type where kernels read them by texels and where they read them whole.
const _: () = assert!(
    size_of::<ImpostorQuery>() == 24
        && size_of::<ImpostorQuery>() == IMPOSTOR_QUERY_TEXELS as usize * size_of::<[f32; 2]>()
);

/// An [`ImpostorImage`] in the device's memory: four bytes a texel and layer for distances alone, with normals sixteen or eight where they are kept ([`ImpostorTexels`]).
#[derive(Debug)]
pub struct Impostor {
    gpu: Gpu,
    map: Parametrization,
    kind: u32,
    layers: u32,
    holds: u32,
    is_open: bool,
    shape: Buffer,
    texels: TexelView,
}

impl Impostor {
    /// What its texels are called among buffers. They are read as texels, so that their number is bound, and not their bytes.
    pub(crate) const TEXELS_NAME: &'static str = "impostor: texels";

    /// Uploads an image, with normals as planes.
    ///
    /// # Errors
    /// As [`Impostor::with_texels`].
    pub fn new(gpu: &Gpu, image: &ImpostorImage) -> Result<Self> {
        Self::with_texels(gpu, image, ImpostorTexels::default())
    }

    /// Uploads an image, whose texels hold what is said where it has normals.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for one of more texels than a texel buffer has; [`Error::Setting`] for a map that no kernel looks up;
    /// [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn with_texels(gpu: &Gpu, image: &ImpostorImage, texels: ImpostorTexels) -> Result<Self> {
        let kind =
            kind(image.map()).ok_or_else(|| Error::setting("map", image.map(), "has no impostors on the device"))?;
        let shape = ImpostorShape {
            size: image.size().as_ivec2().to_array(),
            extent: image.extent(),
        };
        let name = Self::TEXELS_NAME;
        let (planes, normals) = match texels {
            ImpostorTexels::Planes => (image.planes(), None),
            ImpostorTexels::Normals => (None, image.normals()),
            ImpostorTexels::Distances => (None, None),
        };
        let (holds, texels) = match (planes, normals) {
            (Some(planes), _) => {
                let texels = gpu.texels_with(name, Category::Light, vk::Format::R32G32B32A32_UINT, &planes);
                (IMPOSTOR_HOLDS_PLANE, texels)
            }
            (None, Some(normals)) => {
                let pairs = image.inverses().into_iter().zip(normals);
                let pairs: Vec<[u32; 2]> = pairs.map(|(inverse, normal)| [inverse.to_bits(), *normal]).collect();
                let texels = gpu.texels_with(name, Category::Light, vk::Format::R32G32_UINT, &pairs);
                (IMPOSTOR_HOLDS_NORMAL, texels)
            }
            (None, None) => {
                let texels = gpu.texels_with(name, Category::Light, vk::Format::R32_UINT, &image.inverses());
                (IMPOSTOR_HOLDS_DISTANCE, texels)
            }
        };
        Ok(Self {
            gpu: gpu.clone(),
            map: image.map(),
            kind,
            layers: image.layers(),
            holds,
            is_open: image.is_open(),
            shape: gpu.buffer_with("impostor: shape", Category::Light, &[shape])?,
            texels: texels?,
        })
    }

    /// Its parametrization.
    pub fn map(&self) -> Parametrization {
        self.map
    }

    /// Layers of surfaces.
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// What a texel holds, the kernels' specialization constant `IMPOSTOR_HOLDS`.
    pub fn holds(&self) -> u32 {
        self.holds
    }

    /// Bytes of all texels.
    pub fn bytes(&self) -> u64 {
        self.texels.buffer().bytes()
    }

    /// Whether some texel of some layer has no surface.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// The set that `maps/impostor_set.glsl` reads.
    pub fn set(&self) -> ImpostorSet<'_> {
        ImpostorSet {
            impostor_shapes: self.shape.view(),
            impostor_texels: &self.texels,
        }
    }

    /// What rays meet, in their order: twin [`ImpostorImage::search`].
    ///
    /// # Errors
    /// [`Error::Setting`] for settings out of range, for a ray whose direction is no unit vector, and for one that does not begin nearer than
    /// [`ImpostorImage::NOTHING`]; [`Error::LimitExceeded`] for more rays than a texel buffer has; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn search(&self, rays: &[ImpostorRay], settings: &ImpostorSettings) -> Result<Vec<ImpostorHit>> {
        let search = ImpostorSearch::new(&self.gpu, self, settings)?;
        search.search_timed(self, rays).map(|(hits, _)| hits)
    }
}

/// Rays as kernels read them; refuses those that no search follows, by name.
pub(super) fn queries(rays: &[ImpostorRay]) -> Result<Vec<ImpostorQuery>> {
    let query = |(i, ray): (usize, &ImpostorRay)| {
        if is_unit(ray.direction) && is_ray(ray) {
            return Ok(ImpostorQuery {
                origin: ray.origin.as_vec3().to_array(),
                direction: ray.direction.as_vec3().to_array(),
            });
        }
        let cause = if is_unit(ray.direction) {
            format!("does not begin nearer than {:e}", ImpostorImage::NOTHING)
        } else {
            "has a direction that is no unit vector".into()
        };
        Err(Error::setting(format!("ray {i}"), format!("{ray:?}"), cause))
    };
    rays.iter().enumerate().map(query).collect()
}

/// A search on the device: a kernel over rays, specialized by the method, its steps, the map, its layers, what its texels hold, and whether it has places without a surface.
#[derive(Debug)]
pub struct ImpostorSearch {
    spec: kernel::Spec,
    tolerance: f32,
    pipeline: ComputePipeline<kernel::Kernel>,
}

impl ImpostorSearch {
    /// The texels of rays, so many a ray that they are an [`ImpostorQuery`].
    pub const RAY_FORMAT: vk::Format = vk::Format::R32G32_SFLOAT;

    /// Makes the pipeline for impostors as this one.
    ///
    /// # Errors
    /// As [`ImpostorSettings::check`]; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, impostor: &Impostor, settings: &ImpostorSettings) -> Result<Self> {
        settings.check(impostor.layers)?;
        let spec = Self::spec(impostor, settings);
        Ok(Self {
            spec,
            tolerance: settings.tolerance,
            pipeline: gpu.compute_pipeline(&spec)?,
        })
    }

    fn spec(impostor: &Impostor, settings: &ImpostorSettings) -> kernel::Spec {
        kernel::Spec {
            directional_kind: impostor.kind,
            directional_border: 0,
            impostor_method: settings.method.number(),
            impostor_steps: settings.steps,
            impostor_bisections: settings.bisections,
            impostor_layers: impostor.layers,
            impostor_holds: impostor.holds,
            impostor_is_open: impostor.is_open,
        }
    }

    /// The kernel with its specialization.
    pub fn info(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// What rays meet, in their order, with the time of the search on the device in seconds. A software device compiles its kernel within the first one.
    ///
    /// # Errors
    /// As [`Impostor::search`] and [`ImpostorSearch::record`]; [`Error::LimitExceeded`] for more rays than a texel buffer has.
    pub fn search_timed(&self, impostor: &Impostor, rays: &[ImpostorRay]) -> Result<(Vec<ImpostorHit>, f64)> {
        let queries = queries(rays)?;
        if rays.is_empty() {
            return Ok((Vec::new(), 0.0));
        }
        let gpu = &impostor.gpu;
        let queries = gpu.texels_with("impostor: rays", Category::Work, Self::RAY_FORMAT, &queries)?;
        let bytes = (rays.len() * size_of::<DeviceHit>()) as u64;
        let hits = gpu.buffer(&BufferDesc::storage("impostor: hits", bytes, Category::Work))?;
        let mut recorder = gpu.recorder("impostor")?;
        recorder.pass("impostor: search", |pass| {
            self.record(pass, impostor, &queries, hits.view(), rays.len() as u32)
        })?;
        let seconds = recorder.submit()?.wait()?.seconds();
        let hits: Vec<DeviceHit> = gpu.read(hits.view(), rays.len())?;
        let hit = |hit: DeviceHit| ImpostorHit {
            direction: DVec3::from_array(hit.direction.map(f64::from)),
            distance: hit.distance.into(),
            residual: hit.residual.into(),
            layer: hit.layer,
        };
        Ok((hits.into_iter().map(hit).collect(), seconds))
    }

    /// Records the search for `count` rays of the type [`ImpostorQuery`], which are read by texels of the format [`RAY_FORMAT`](Self::RAY_FORMAT), into hits of the type
    /// [`DeviceHit`](crate::gpu::shaders::types::ImpostorHit), in the rays' order.
    ///
    /// Barriers: the rays must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and earlier uses of the hits must have
    /// ended. After it the hits have been written by a compute shader.
    ///
    /// # Errors
    /// [`Error::Setting`] for an impostor of another map, other layers, whose texels hold something else, or with places without a surface where the one before had
    /// none; and as [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        impostor: &Impostor,
        rays: &TexelView,
        hits: BufferView<'_>,
        count: u32,
    ) -> Result<()> {
        let same = impostor.kind == self.spec.directional_kind
            && impostor.layers == self.spec.impostor_layers
            && impostor.holds == self.spec.impostor_holds
            && (self.spec.impostor_is_open || !impostor.is_open);
        if !same {
            return Err(Error::setting(
                "impostor",
                impostor.map,
                "differs in map, layers, what texels hold or places without a surface",
            ));
        }
        let set = kernel::Set0 { queries: rays, hits };
        let push = kernel::Push {
            count,
            tolerance: self.tolerance,
        };
        let groups = self.pipeline.groups_over(count);
        pass.dispatch(&self.pipeline, &[&set, &impostor.set()], &push, groups)
    }
}
