//! Places on the surfaces of a scene, and what rays say of the light that they get from a point.

use clerestory::accel::bvh2::Bvh2;
use clerestory::accel::offset::{offset_ray_origin, scene_reach, surface_point};
use clerestory::accel::trace::{Query, RayTracer, TraceSettings};
use clerestory::accel::{NO_HIT, Ray};
use clerestory::gpu::Gpu;
use clerestory::gpu::shaders::types::SceneTriangle;
use clerestory::raster::ShadowPlace;
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::Vec3;

use crate::random::Random;

/// Draws a place, until one faces the light.
const DRAWS: usize = 100;

/// A scene, places on its surfaces and what rays say of them.
pub struct Subject {
    /// The scene.
    pub scene: GpuScene,
    /// Places that turn their outer side to the light.
    pub places: Vec<ShadowPlace>,
    /// Where the light is.
    pub light: Vec3,
    lit: Vec<bool>,
    rays: Vec<Ray>,
    tracer: RayTracer,
}

/// Places evenly over what turns its outer side to the light: bottoms and insides, which no light reaches, would dilute errors. Fewer than `count` where
/// that is next to nothing.
fn places(corners: &[[Vec3; 3]], bounds: [Vec3; 2], light: Vec3, count: usize) -> Vec<ShadowPlace> {
    let mut random = Random::new(77);
    let mut sum = 0.0;
    let areas: Vec<f64> = corners
        .iter()
        .map(|[a, b, c]| {
            sum += f64::from((*b - *a).cross(*c - *a).length());
            sum
        })
        .collect();
    (0..DRAWS * count)
        .map(|_| {
            let wanted = sum * random.unit();
            let triangle = areas.partition_point(|area| *area <= wanted).min(corners.len() - 1);
            let (mut u, mut v) = (random.unit() as f32, random.unit() as f32);
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [a, b, c] = corners[triangle];
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let reach = scene_reach(a + u * (b - a) + v * (c - a), bounds[0], bounds[1]);
            let point = surface_point(&corners[triangle], [u, v], reach);
            ShadowPlace {
                position: point.position,
                normal,
                slack: normal.abs().dot(point.error),
            }
        })
        .filter(|place| place.normal.dot(light - place.position) > 0.0)
        .take(count)
        .collect()
}

fn shadow_ray(place: &ShadowPlace, light: Vec3) -> Ray {
    let error = Vec3::splat(place.slack / place.normal.abs().element_sum().max(f32::MIN_POSITIVE));
    let start = offset_ray_origin(place.position, error, place.normal, light - place.position);
    Ray {
        origin: start.to_array(),
        t_min: 0.0,
        direction: (light - start).to_array(),
        t_max: 1.0,
    }
}

impl Subject {
    /// A scene with a light at a place in the box around it, given as a share of it, and so many places.
    ///
    /// # Errors
    /// Those of the scene and the device, and a scene that turns next to nothing towards the light.
    pub fn new(gpu: &Gpu, address: &str, share: Vec3, count: usize) -> Result<Self> {
        let scene = GpuScene::new(gpu, &scene::load(address)?)?;
        let surfaces = scene.surfaces();
        let triangles: Vec<SceneTriangle> = gpu.read(
            surfaces.set.scene_triangles.buffer().view(),
            surfaces.triangles as usize,
        )?;
        let corners: Vec<_> = triangles
            .iter()
            .map(|t| [t.a, t.b, t.c].map(Vec3::from_array))
            .collect();
        let bounds = scene.bounds();
        let light = bounds[0] + share * (bounds[1] - bounds[0]);
        let places = places(&corners, bounds, light, count);
        if places.len() < count {
            let cause = "turns next to nothing towards the light";
            return Err(clerestory::Error::setting("scene", address, cause));
        }
        let index = Bvh2::build(&corners, &Default::default())?;
        let settings = TraceSettings {
            query: Query::Any,
            ..TraceSettings::ray_per_thread()
        };
        let tracer = RayTracer::new(gpu, &index, &settings)?;
        let rays: Vec<Ray> = places.iter().map(|place| shadow_ray(place, light)).collect();
        let lit = tracer
            .trace(&rays)?
            .hits
            .iter()
            .map(|hit| hit.triangle == NO_HIT)
            .collect();
        Ok(Self {
            light,
            lit,
            rays,
            tracer,
            places,
            scene,
        })
    }

    /// Share of places that light reaches.
    pub fn lit_share(&self) -> f64 {
        self.lit.iter().filter(|lit| **lit).count() as f64 / self.lit.len() as f64
    }

    /// Seconds of the device for a shadow ray.
    ///
    /// # Errors
    /// Those of the device.
    pub fn ray_seconds(&self) -> Result<f64> {
        Ok(self.tracer.trace(&self.rays)?.seconds() / self.rays.len() as f64)
    }

    /// Mean difference of shares of light from what rays say.
    pub fn error(&self, shares: &[f32]) -> f64 {
        let pairs = shares.iter().zip(&self.lit);
        let sum: f64 = pairs
            .map(|(share, lit)| (f64::from(*share) - f64::from(u8::from(*lit))).abs())
            .sum();
        sum / self.lit.len() as f64
    }
}
