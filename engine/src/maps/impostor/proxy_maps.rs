//! Maps without distances on the device, at one place or several, with a simple shape in place of the surroundings.
//!
//! Sources: those of [`proxy`](super::proxy) and [`places`](super::places). The map of the nearest place is looked up, or those of the two nearest are blended by their weights, each in the
//! direction in which a ray leaves the shape. What these maps are measured by; texels are the nearest.
//!
//! Guarantees: deterministic, each ray by itself. Bias: that of the shape, and half a texel. GLSL: `maps/proxy_look_up.comp`, by `maps/proxy.glsl` and `maps/map_places.glsl`.

use glam::{DVec3, UVec2};

use super::super::directional_map::kind;
use super::device::queries;
use super::places::blended_maps;
use super::proxy::{box_proxy, hemisphere_proxy, sphere_proxy};
use super::{ImpostorImage, ImpostorRay};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{PROXY_BOX, PROXY_HEMISPHERE, PROXY_NONE, PROXY_SPHERE};
use crate::gpu::shaders::maps::proxy_look_up as kernel;
use crate::gpu::shaders::types::ProxyHit as DeviceHit;
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, TexelView};
use crate::maps::{MapImage, Parametrization, is_unit};
use crate::{Error, Result};

/// What stands in for the surroundings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProxyShape {
    /// Nothing: all is infinitely far.
    None,
    /// A sphere about each map's place.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// A box, in the axes of the places.
    Box {
        /// Its least corner.
        low: DVec3,
        /// Its greatest corner.
        high: DVec3,
    },
    /// The height of a hemisphere about each map's place, for all rays of a point.
    Hemisphere {
        /// Unit normal of its ground.
        up: DVec3,
        /// Its radius.
        radius: f64,
    },
}

impl ProxyShape {
    /// In which direction, of any length but 0, a map at a place shows what a ray meets; the ray's own at the map's place itself.
    pub fn direction(&self, place: DVec3, ray: &ImpostorRay) -> DVec3 {
        let (x, r) = (ray.origin - place, ray.direction);
        let l = match *self {
            Self::None => r,
            Self::Sphere { radius } => x + sphere_proxy(x, r, radius) * r,
            Self::Box { low, high } => x + box_proxy(x, r, low - place, high - place) * r,
            Self::Hemisphere { up, radius } => x + hemisphere_proxy(x, up, radius) * r,
        };
        if l == DVec3::ZERO { r } else { l }
    }

    fn number(&self) -> u32 {
        match self {
            Self::None => PROXY_NONE,
            Self::Sphere { .. } => PROXY_SPHERE,
            Self::Box { .. } => PROXY_BOX,
            Self::Hemisphere { .. } => PROXY_HEMISPHERE,
        }
    }

    /// Refuses shapes that are none in single precision, in which kernels look them up: squares of their lengths are finite.
    fn check(&self) -> Result<()> {
        let wrong = |cause: &str| {
            Err(Error::setting(
                "shape in place of the surroundings",
                format!("{self:?}"),
                cause,
            ))
        };
        let is_radius = |radius: f64| {
            let radius = radius as f32;
            radius > 0.0 && (radius * radius).is_finite()
        };
        let is_corner = |corner: DVec3| corner.as_vec3().length_squared().is_finite();
        match *self {
            Self::Sphere { radius } | Self::Hemisphere { radius, .. } if !is_radius(radius) => {
                wrong("has no radius above 0 whose square is finite in single precision")
            }
            Self::Hemisphere { up, .. } if !is_unit(up) => wrong("has a normal that is no unit vector"),
            Self::Box { low, high } if !(is_corner(low) && is_corner(high)) => {
                wrong("has a corner whose squared distance is not finite in single precision")
            }
            Self::Box { low, high } if !low.as_vec3().cmplt(high.as_vec3()).all() => {
                wrong("has no corner below the other one")
            }
            _ => Ok(()),
        }
    }
}

/// What was looked up for a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProxyHit {
    /// The direction, of any length, in which the nearest map was looked up.
    pub direction: DVec3,
    /// The radiance there, of one map or of two.
    pub radiance: DVec3,
}

/// Maps of one size and one parametrization on the device, with their places.
#[derive(Debug)]
pub struct ProxyMaps {
    gpu: Gpu,
    kind: u32,
    size: UVec2,
    count: u32,
    places: Buffer,
    texels: TexelView,
}

impl ProxyMaps {
    /// Uploads maps, each with the place that it was made at.
    ///
    /// # Errors
    /// [`Error::Setting`] for no maps or more than 16, for maps that differ in size or parametrization or that no kernel looks up, and for places that are not
    /// finite; [`Error::LimitExceeded`] for more texels than a texel buffer has; [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn new(gpu: &Gpu, maps: &[(DVec3, MapImage)]) -> Result<Self> {
        let places: Vec<DVec3> = maps.iter().map(|(place, _)| *place).collect();
        blended_maps(&places, DVec3::ZERO)?;
        let Some((_, first)) = maps.first() else {
            return Err(Error::setting("maps", 0, "are none"));
        };
        let (map, size) = (first.map(), first.size());
        if let Some((_, other)) = maps
            .iter()
            .find(|(_, other)| (other.map(), other.size()) != (map, size))
        {
            let value = format!("{} of {}", other.map(), other.size());
            return Err(Error::setting("map", value, format!("is not {map} of {size}")));
        }
        let kind = looked_up(map).ok_or_else(|| Error::setting("map", map, "has no look-ups with proxies"))?;
        let texels = maps.iter().flat_map(|(_, image)| image.texels());
        let texels: Vec<[f32; 4]> = texels.map(|radiance| radiance.extend(0.0).to_array()).collect();
        let format = vk::Format::R32G32B32A32_SFLOAT;
        let places: Vec<[f32; 3]> = places.iter().map(|place| place.as_vec3().to_array()).collect();
        Ok(Self {
            gpu: gpu.clone(),
            kind,
            size,
            count: maps.len() as u32,
            places: gpu.buffer_with("places of maps", Category::Light, &places)?,
            texels: gpu.texels_with("maps without distances", Category::Light, format, &texels)?,
        })
    }

    /// What rays meet by a shape, in their order; `blends` the two nearest maps, where there are two, or takes the nearest alone. Rays begin in the axes of the places.
    ///
    /// # Errors
    /// [`Error::Setting`] for shapes that are none, and as [`Impostor::search`](super::Impostor::search).
    pub fn look_up(&self, rays: &[ImpostorRay], shape: &ProxyShape, blends: bool) -> Result<Vec<ProxyHit>> {
        shape.check()?;
        let queries = queries(rays)?;
        if rays.is_empty() {
            return Ok(Vec::new());
        }
        let gpu = &self.gpu;
        let pipeline: ComputePipeline<kernel::Kernel> = gpu.compute_pipeline(&kernel::Spec {
            directional_kind: self.kind,
            directional_border: 0,
            proxy_shape: shape.number(),
            proxy_blends: blends,
        })?;
        let queries = gpu.buffer_with("proxies: rays", Category::Work, &queries)?;
        let bytes = (rays.len() * size_of::<DeviceHit>()) as u64;
        let hits = gpu.buffer(&BufferDesc::storage("proxies: hits", bytes, Category::Work))?;
        let set = kernel::Set0 {
            queries: queries.view(),
            places: self.places.view(),
            texels: &self.texels,
            hits: hits.view(),
        };
        let (low, high) = match *shape {
            ProxyShape::Box { low, high } => (low, high),
            _ => (DVec3::ZERO, DVec3::ZERO),
        };
        let (up, radius) = match *shape {
            ProxyShape::Sphere { radius } => (DVec3::ZERO, radius),
            ProxyShape::Hemisphere { up, radius } => (up, radius),
            ProxyShape::None | ProxyShape::Box { .. } => (DVec3::ZERO, 0.0),
        };
        let push = kernel::Push {
            size: self.size.as_ivec2().to_array(),
            count: rays.len() as u32,
            maps: self.count,
            radius: radius as f32,
            low: low.as_vec3().to_array(),
            high: high.as_vec3().to_array(),
            up: up.as_vec3().to_array(),
        };
        let mut recorder = gpu.recorder("proxies")?;
        recorder.pass("proxies: look-up", |pass| {
            pass.dispatch(&pipeline, &[&set], &push, pipeline.groups_over(push.count))
        })?;
        recorder.submit()?.wait()?;
        let hits: Vec<DeviceHit> = gpu.read(hits.view(), rays.len())?;
        let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        let hit = |hit: DeviceHit| ProxyHit {
            direction: wide(hit.direction),
            radiance: wide(hit.radiance),
        };
        Ok(hits.into_iter().map(hit).collect())
    }
}

/// The number by which the kernel knows a map: those that impostors have.
fn looked_up(map: Parametrization) -> Option<u32> {
    kind(map).filter(|_| ImpostorImage::has_texels(map))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_beyond_single_precision_are_refused() {
        let up = DVec3::Y;
        let cube = |half: f64| ProxyShape::Box {
            low: DVec3::splat(-half),
            high: DVec3::splat(half),
        };
        for length in [1e-30, 1.0, 1e18] {
            for shape in [
                ProxyShape::Sphere { radius: length },
                ProxyShape::Hemisphere { up, radius: length },
                cube(length),
            ] {
                assert!(shape.check().is_ok(), "{shape:?}");
            }
        }
        // Nothing in single precision, squares that are infinite, lengths that are, and none.
        for length in [1e-60, 1e20, 1e39, f64::INFINITY, f64::NAN] {
            for (shape, words) in [
                (ProxyShape::Sphere { radius: length }, "radius"),
                (ProxyShape::Hemisphere { up, radius: length }, "radius"),
                (cube(length), "corner"),
            ] {
                let error = shape.check().unwrap_err().to_string();
                assert!(error.contains(words), "{error}");
            }
        }
        let up = DVec3::new(0.0, f64::NAN, 0.0);
        assert!(ProxyShape::Hemisphere { up, radius: 1.0 }.check().is_err());
        assert!(ProxyShape::None.check().is_ok());
    }
}
