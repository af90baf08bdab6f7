//! Scenes with what rays say of them, and places on their surfaces.

use clerestory::accel::bvh2::Bvh2;
use clerestory::accel::offset::{offset_ray_origin, scene_reach, surface_point};
use clerestory::accel::{NO_HIT, Ray, RayIndex};
use clerestory::gpu::Gpu;
use clerestory::raster::ShadowPlace;
use clerestory::scene::{Material, Mesh, Scene};
use clerestory::transport::GpuScene;
use clerestory_tests::random::Random;
use glam::Vec3;

/// A scene on the device and for rays.
pub struct Subject {
    pub on_device: GpuScene,
    pub corners: Vec<[Vec3; 3]>,
    pub index: Bvh2,
    /// Cumulative areas.
    areas: Vec<f64>,
}

impl Subject {
    pub fn new(gpu: &Gpu, scene: &Scene) -> Self {
        let on_device = GpuScene::new(gpu, scene).unwrap();
        let surfaces = on_device.surfaces();
        let triangles: Vec<clerestory::gpu::shaders::types::SceneTriangle> = gpu
            .read(
                surfaces.set.scene_triangles.buffer().view(),
                surfaces.triangles as usize,
            )
            .unwrap();
        let corners: Vec<_> = triangles
            .iter()
            .map(|t| [t.a, t.b, t.c].map(Vec3::from_array))
            .collect();
        let mut sum = 0.0;
        let areas = corners
            .iter()
            .map(|[a, b, c]| {
                sum += 0.5 * f64::from((*b - *a).cross(*c - *a).length());
                sum
            })
            .collect();
        Self {
            index: Bvh2::build(&corners, &Default::default()).unwrap(),
            on_device,
            corners,
            areas,
        }
    }

    /// The place at shares of the box around the scene.
    pub fn at(&self, share: Vec3) -> Vec3 {
        let [lower, upper] = self.on_device.bounds();
        lower + share * (upper - lower)
    }

    /// Places evenly over all surfaces.
    pub fn places(&self, seed: u64, count: usize) -> Vec<ShadowPlace> {
        let mut random = Random(seed);
        let [lower, upper] = self.on_device.bounds();
        let whole = self.areas.last().copied().unwrap();
        (0..count)
            .map(|_| {
                let wanted = whole * f64::from(random.unit());
                let triangle = self.areas.partition_point(|area| *area <= wanted);
                let corners = &self.corners[triangle.min(self.corners.len() - 1)];
                let (mut u, mut v) = (random.unit(), random.unit());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                let [a, b, c] = *corners;
                let normal = (b - a).cross(c - a).normalize();
                let reach = scene_reach(a + u * (b - a) + v * (c - a), lower, upper);
                let point = surface_point(corners, [u, v], reach);
                ShadowPlace {
                    position: point.position,
                    normal,
                    slack: normal.abs().dot(point.error),
                }
            })
            .collect()
    }

    /// Whether nothing is between a place and a light: by a ray.
    pub fn is_lit(&self, light: Vec3, place: &ShadowPlace) -> bool {
        let along = light - place.position;
        let error = Vec3::splat(place.slack / place.normal.abs().element_sum());
        let start = offset_ray_origin(place.position, error, place.normal, along);
        !self.index.any_hit(&Ray {
            origin: start.to_array(),
            t_min: 0.0,
            direction: (light - start).to_array(),
            t_max: 1.0,
        })
    }

    /// How far off a place's plane the first thing is that is between it and a light, metres; `None` for nothing.
    pub fn height_of_blocker(&self, light: Vec3, place: &ShadowPlace) -> Option<f32> {
        let along = light - place.position;
        let error = Vec3::splat(place.slack / place.normal.abs().element_sum());
        let start = offset_ray_origin(place.position, error, place.normal, along);
        let hit = self.index.closest_hit(&Ray {
            origin: start.to_array(),
            t_min: 0.0,
            direction: (light - start).to_array(),
            t_max: 1.0,
        });
        (hit.triangle != NO_HIT).then(|| hit.t * place.normal.dot(along).abs())
    }

    /// Distance of what a light sees first in a direction; infinite for nothing.
    pub fn seen(&self, light: Vec3, direction: Vec3) -> f64 {
        let hit = self.index.closest_hit(&Ray::new(light, direction));
        f64::from(hit.t) * f64::from(direction.length())
    }
}

/// A sphere with normals, seen from outside counter-clockwise.
pub fn sphere(name: &str, material: u32, centre: Vec3, radius: f32, slices: u32) -> Mesh {
    let stacks = slices / 2;
    let mut mesh = Mesh {
        name: name.into(),
        material: Some(material),
        ..Mesh::default()
    };
    for stack in 0..=stacks {
        for slice in 0..=slices {
            let theta = std::f32::consts::PI * stack as f32 / stacks as f32;
            let phi = std::f32::consts::TAU * (slice % slices) as f32 / slices as f32;
            let n = Vec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos());
            mesh.positions.push(centre + radius * n);
            mesh.normals.push(n.normalize());
        }
    }
    let at = |stack: u32, slice: u32| stack * (slices + 1) + slice;
    for stack in 0..stacks {
        for slice in 0..slices {
            let [a, b, c, d] = [
                at(stack, slice),
                at(stack + 1, slice),
                at(stack + 1, slice + 1),
                at(stack, slice + 1),
            ];
            if stack > 0 {
                mesh.triangles.push([a, b, d]);
            }
            if stack + 1 < stacks {
                mesh.triangles.push([b, c, d]);
            }
        }
    }
    mesh
}

/// Triangles of a Lambert surface.
pub fn place(scene: &mut Scene, name: &str, corners: &[[Vec3; 3]]) {
    let material = scene.add_material(Material::lambert(name, Vec3::splat(0.5)));
    scene.place(Mesh {
        name: name.into(),
        positions: corners.as_flattened().to_vec(),
        triangles: (0..corners.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        material: Some(material),
        ..Mesh::default()
    });
}
