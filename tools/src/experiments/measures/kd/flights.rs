//! Flights of a camera through the scenes that kd-trees are compared in, and the rays of their frames.
//!
//! Source of what the scenes stand for: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, table 2.1 and
//! §4.1.4: five scenes, camera flights, up to four rays a pixel (camera, reflections at mirrors, a shadow ray from where each ends). The
//! models but the first are not to be had by package; generated scenes of the same kind and number of triangles stand in for them.
//!
//! Guarantee: deterministic.

use clerestory::accel::trace::{Query, RayTracer, TraceSettings};
use clerestory::accel::{Aabb, Ray, RayIndex};
use clerestory::gpu::Gpu;
use clerestory::scene::Camera;
use clerestory::{Error, Result, scene};
use glam::{DAffine3, DQuat, Vec3};

use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;
use crate::geometry;
use crate::timing::{median, timed};

/// A scene with a light, and what it stands for in the source's tables.
pub struct Case {
    /// Address of the scene.
    pub scene: &'static str,
    /// The source's scene.
    pub counterpart: &'static str,
    /// A light among the surfaces, metres.
    pub light: Vec3,
}

/// The source's five scenes.
pub static CASES: [Case; 5] = [
    Case {
        scene: "builtin:box-room?source=point",
        counterpart: "Scene 6",
        light: Vec3::new(3.0, 2.5, 3.0),
    },
    Case {
        scene: "builtin:atrium?source=point",
        counterpart: "Sponza",
        light: Vec3::new(0.0, 4.0, 0.0),
    },
    Case {
        scene: "builtin:cathedral?source=point",
        counterpart: "Sibenik",
        light: Vec3::new(0.0, 7.0, 20.0),
    },
    Case {
        scene: "builtin:forest?source=point",
        counterpart: "Fairy",
        light: Vec3::new(0.0, 3.0, 0.0),
    },
    Case {
        scene: "builtin:conference?source=point",
        counterpart: "Conference",
        light: Vec3::new(6.0, 2.6, 4.0),
    },
];

impl Case {
    /// The scene's name.
    pub fn name(&self) -> &'static str {
        let query = self.scene.find('?').unwrap_or(self.scene.len());
        self.scene[..query].trim_start_matches("builtin:")
    }
}

/// The cases that a run looks at: of a quick look the first alone.
pub fn cases(context: &Context<'_>) -> &'static [Case] {
    if context.smoke { &CASES[..1] } else { &CASES }
}

/// Frames, and pixels across and down.
pub fn size(context: &Context<'_>) -> (u32, u32) {
    if context.smoke { (2, 8) } else { (10, 96) }
}

/// The rays of a flight.
#[derive(Default)]
pub struct Flight {
    /// Through the pixels.
    pub camera: Vec<Ray>,
    /// From mirrors.
    pub reflection: Vec<Ray>,
    /// To the light, from wherever one of the others ends on what is no mirror.
    pub shadow: Vec<Ray>,
}

impl Flight {
    /// All rays.
    pub fn rays(&self) -> usize {
        self.camera.len() + self.reflection.len() + self.shadow.len()
    }

    /// Those that ask for the closest hit.
    pub fn closest(&self) -> Vec<Ray> {
        [&self.camera[..], &self.reflection[..]].concat()
    }
}

fn ray((origin, direction): (Vec3, Vec3), t_max: f32) -> Ray {
    Ray {
        origin: origin.into(),
        t_min: 0.0,
        direction: direction.into(),
        t_max,
    }
}

/// From the scene's first camera to its second, evenly; one frame where there is no second.
fn frames(cameras: &[Camera], count: u32) -> Result<Vec<Camera>> {
    let (from, to, count) = match cameras {
        [] => return Err(Error::setting("scene", "", "has no camera")),
        [only] => (only, only, 1),
        [from, to, ..] => (from, to, count),
    };
    let turn = |camera: &Camera| DQuat::from_mat3(&camera.transform.matrix3);
    let frame = |i: u32| {
        let s = f64::from(i) / f64::from((count - 1).max(1));
        let place = from.transform.translation.lerp(to.transform.translation, s);
        Camera {
            transform: DAffine3::from_rotation_translation(turn(from).slerp(turn(to), s), place),
            ..from.clone()
        }
    };
    Ok((0..count).map(frame).collect())
}

/// The rays of a flight of so many frames and square pictures, lit from `light`.
///
/// # Errors
/// Those of scenes, and [`Error::Setting`] for one without a camera.
pub fn fly(address: &str, surfaces: &Surfaces, light: Vec3, (count, side): (u32, u32)) -> Result<Flight> {
    let scene = scene::load(address)?;
    let mut flight = Flight::default();
    for camera in frames(&scene.cameras, count)? {
        for (origin, direction) in geometry::camera_rays(&camera, side)? {
            for (bounce, (origin, direction, meeting)) in surfaces.follow(origin, direction).into_iter().enumerate() {
                let rays = if bounce == 0 {
                    &mut flight.camera
                } else {
                    &mut flight.reflection
                };
                rays.push(ray((origin, direction), f32::INFINITY));
                if let Some(end) = meeting.filter(|meeting| !meeting.is_mirror) {
                    let (origin, direction, distance) = surfaces.shadow_ray(&end, light);
                    flight.shadow.push(ray((origin, direction), distance));
                }
            }
        }
    }
    Ok(flight)
}

/// A light far outside of what the surfaces fill, above it.
pub fn outside(surfaces: &Surfaces) -> Vec3 {
    let corners = surfaces.triangles.iter().flatten();
    let bounds = corners.fold(Aabb::EMPTY, |bounds, corner| bounds.with_point(*corner));
    let extent = bounds.upper - bounds.lower;
    0.5 * (bounds.lower + bounds.upper) + extent.length() * Vec3::new(0.9, 2.0, 0.7)
}

/// An index on the device, for closest and for any hits, and its times.
pub struct Raced {
    closest: RayTracer,
    any: RayTracer,
    seconds: [Vec<f64>; 2],
}

impl Raced {
    /// Uploads an index twice, for closest hits and for any, with these settings but for the query.
    pub fn new(gpu: &Gpu, index: &dyn RayIndex, settings: TraceSettings) -> Result<Self> {
        let of = |query| {
            let settings = TraceSettings { query, ..settings };
            RayTracer::new(gpu, index, &settings.fitted(gpu.caps(), index.device_traversal()))
        };
        Ok(Self {
            closest: of(Query::Closest)?,
            any: of(Query::Any)?,
            seconds: [Vec::new(), Vec::new()],
        })
    }

    /// Millions of rays a second, medians: closest hits, any hits, both together.
    pub fn rates(&self, flight: &Flight) -> [f64; 3] {
        let seconds = [0, 1].map(|query| median(self.seconds[query].clone()));
        let counts =
            [flight.camera.len() + flight.reflection.len(), flight.shadow.len()].map(|count| 1e-6 * count as f64);
        [
            counts[0] / seconds[0],
            counts[1] / seconds[1],
            (counts[0] + counts[1]) / (seconds[0] + seconds[1]),
        ]
    }
}

/// Lets indexes trace the same rays in turns: so often after once to warm up.
///
/// # Errors
/// Those of submissions.
pub fn race(all: &mut [Raced], flight: &Flight, repeats: usize) -> Result<()> {
    let closest = flight.closest();
    for repeat in 0..=repeats {
        for one in &mut *all {
            for (query, (tracer, rays)) in [(&one.closest, &closest), (&one.any, &flight.shadow)]
                .into_iter()
                .enumerate()
            {
                let (traced, wall) = timed(|| tracer.trace(rays));
                let on_device = traced?.seconds();
                if repeat > 0 {
                    one.seconds[query].push(if on_device > 0.0 { on_device } else { wall });
                }
            }
        }
    }
    Ok(())
}
