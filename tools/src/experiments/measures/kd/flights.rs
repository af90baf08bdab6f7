//! Flights of a camera through the scenes that kd-trees are compared in, and the rays of their frames.
//!
//! Source of what the scenes stand for: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, table 2.1 and
//! §4.1.4: five scenes, camera flights, up to four rays per pixel (camera, reflections at mirrors, a shadow ray from where each ends). The
//! models but the first are not to be had by package; generated scenes of the same kind and number of triangles stand in for them.
//!
//! Guarantee: deterministic.

use std::borrow::Cow;
use std::path::Path;

use clerestory::accel::kd::{KdCaches, KdCounters, KdSettings, KdTraversal, KdTree, Scheme};
use clerestory::accel::trace::{Query, RayTracer, TraceSettings};
use clerestory::accel::{Aabb, Hit, Ray, RayIndex};
use clerestory::gpu::ash::vk;
use clerestory::gpu::{Category, DeviceKind, Gpu, TexelView};
use clerestory::scene::Camera;
use clerestory::{Error, Result, scene};
use glam::{DAffine3, DQuat, Vec3};

use crate::experiments::findings::Repeats;
use crate::experiments::measures::Context;
use crate::experiments::measures::photon_maps::photon_scenes::Surfaces;
use crate::geometry;
use crate::timing::timed;

/// A scene with a light, and what it stands for in the source's tables.
#[derive(Clone)]
pub struct Case {
    /// Address of the scene.
    pub scene: Cow<'static, str>,
    /// The source's scene.
    pub counterpart: &'static str,
    /// A light among the surfaces, metres; `None` for one [`outside`] of them.
    pub light: Option<Vec3>,
}

const fn case(scene: &'static str, counterpart: &'static str, light: Vec3) -> Case {
    Case {
        scene: Cow::Borrowed(scene),
        counterpart,
        light: Some(light),
    }
}

/// The source's five scenes.
pub static CASES: [Case; 5] = [
    case("builtin:box-room?source=point", "Scene 6", Vec3::new(3.0, 2.5, 3.0)),
    case("builtin:atrium?source=point", "Sponza", Vec3::new(0.0, 4.0, 0.0)),
    case("builtin:cathedral?source=point", "Sibenik", Vec3::new(0.0, 7.0, 20.0)),
    case("builtin:forest?source=point", "Fairy", Vec3::new(0.0, 3.0, 0.0)),
    case(
        "builtin:conference?source=point",
        "Conference",
        Vec3::new(6.0, 2.6, 4.0),
    ),
];

impl Case {
    /// One of the engine's scenes that stands for none of the source's.
    pub const fn of_our_own(scene: &'static str, light: Vec3) -> Self {
        case(scene, "none", light)
    }

    /// A scene of any address, lit from outside; where it has one camera, that flies around it.
    pub fn at(address: &str) -> Self {
        Self {
            scene: Cow::Owned(address.to_owned()),
            counterpart: "none",
            light: None,
        }
    }

    /// The scene's name, with its parameters but for the light; of a file the name alone.
    pub fn name(&self) -> &str {
        match self.scene.strip_prefix("builtin:") {
            Some(name) => name.trim_end_matches("?source=point"),
            None => {
                let file = Path::new(self.scene.as_ref()).file_name();
                file.and_then(|name| name.to_str()).unwrap_or(&self.scene)
            }
        }
    }

    /// Where its light is.
    pub fn light(&self, surfaces: &Surfaces) -> Vec3 {
        self.light.unwrap_or_else(|| outside(surfaces))
    }
}

/// The scenes that a run looks at: those that it was told, or the source's, in a smoke run the first alone.
pub fn cases(context: &Context<'_>) -> Vec<Case> {
    told(context).unwrap_or_else(|| context.first(&CASES, 1).to_vec())
}

/// The scenes that a run was told to look at.
pub fn told(context: &Context<'_>) -> Option<Vec<Case>> {
    let told = context.scenes.iter().map(|address| Case::at(address));
    (!context.scenes.is_empty()).then(|| told.collect())
}

/// Loads each scene and flies through it: rows of all, until it is stopped.
///
/// # Errors
/// Those of scenes, and the first of `rows`.
pub fn each_flight<R>(
    context: &Context<'_>,
    cases: &[Case],
    mut rows: impl FnMut(&Case, &Surfaces, &Flight) -> Result<Vec<R>>,
) -> Result<Vec<R>> {
    let name = |case: &Case| case.name().to_owned();
    context.each(cases, name, |case| {
        let surfaces = Surfaces::load(&case.scene)?;
        let flight = fly(context, case, &surfaces, case.light(&surfaces))?;
        rows(case, &surfaces, &flight)
    })
}

/// Whether the device is one of its own: then times say what its memories and its scheduler gain, and its divisions need not be exact.
pub fn on_hardware(gpu: &Gpu) -> bool {
    gpu.caps().kind != DeviceKind::Cpu
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

    /// A count of all rays, per ray.
    pub fn per_ray(&self, count: u64) -> f64 {
        count as f64 / self.rays().max(1) as f64
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

/// Once around what the surfaces fill, on a circle about the vertical.
fn around(camera: &Camera, surfaces: &Surfaces, count: u32) -> Vec<Camera> {
    let bounds = bounds(surfaces);
    let centre = (0.5 * (bounds.lower + bounds.upper)).as_dvec3();
    let frame = |i: u32| {
        let turn = DAffine3::from_rotation_y(std::f64::consts::TAU * f64::from(i) / f64::from(count));
        let about_centre = DAffine3::from_translation(centre) * turn * DAffine3::from_translation(-centre);
        Camera {
            transform: about_centre * camera.transform,
            ..camera.clone()
        }
    };
    (0..count).map(frame).collect()
}

/// The rays of a flight with the light in this place: 10 frames of 96 × 96 pixels, 2 of 8 × 8 in a smoke run.
///
/// # Errors
/// Those of scenes, and [`Error::Setting`] for one without a camera.
pub fn fly(context: &Context<'_>, case: &Case, surfaces: &Surfaces, light: Vec3) -> Result<Flight> {
    let (count, side) = context.pick((10, 96), (2, 8));
    let scene = scene::load(&case.scene)?;
    let mut flight = Flight::default();
    let cameras = match &scene.cameras[..] {
        // A model stands free.
        [only] if case.light.is_none() => around(only, surfaces, count),
        cameras => frames(cameras, count)?,
    };
    for camera in cameras {
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

fn bounds(surfaces: &Surfaces) -> Aabb {
    let corners = surfaces.triangles.iter().flatten();
    corners.fold(Aabb::EMPTY, |bounds, corner| bounds.with_point(*corner))
}

/// A light far outside of what the surfaces fill, above it.
pub fn outside(surfaces: &Surfaces) -> Vec3 {
    let bounds = bounds(surfaces);
    let extent = bounds.upper - bounds.lower;
    0.5 * (bounds.lower + bounds.upper) + extent.length() * Vec3::new(0.9, 2.0, 0.7)
}

/// Trees like the source's, by the least number of triangles that they split: SIROH over the triangles' boxes. Its text has leaves of 4; its
/// numbers of nodes are nearer to those of leaves of 1.
pub const SOURCE_LEAVES: [u32; 2] = [4, 1];

/// One of them.
///
/// # Errors
/// As [`KdTree::build`].
pub fn source_tree(surfaces: &Surfaces, leaf_size: u32) -> Result<KdTree> {
    let settings = KdSettings {
        clip: false,
        leaf_size,
        ..KdSettings::default()
    };
    KdTree::build(&surfaces.triangles, &settings)
}

/// Hits of the rays that ask for the closest and of those that ask for any, and the exact work of all, on the host.
///
/// # Errors
/// [`Error::Setting`] for caches that do not go with the scheme.
pub fn trace(
    tree: &KdTree,
    scheme: Scheme,
    caches: KdCaches,
    [closest, any]: [&[Ray]; 2],
) -> Result<([Vec<Hit>; 2], KdCounters)> {
    let mut counters = KdCounters::default();
    let mut run = |traversal: KdTraversal, ray: &Ray| {
        let mut traversal = traversal.with_caches(caches)?;
        traversal.run(tree, ray, u64::MAX, &mut |_, _| true, &mut counters);
        Ok(traversal.hit)
    };
    let hits = closest.iter().map(|ray| run(KdTraversal::closest(scheme, ray), ray));
    let closest = hits.collect::<Result<_>>()?;
    let hits = any.iter().map(|ray| run(KdTraversal::any(scheme, ray), ray));
    let any = hits.collect::<Result<_>>()?;
    Ok(([closest, any], counters))
}

fn bits(hit: &Hit) -> [u32; 4] {
    let [u, v] = hit.barycentrics.map(f32::to_bits);
    [hit.t.to_bits(), u, v, hit.triangle]
}

/// How many of the hits are not those expected, to the bit; those that are missing too.
pub fn different(hits: &[Hit], expected: &[Hit]) -> u64 {
    let pairs = hits.iter().zip(expected);
    let missing = hits.len().abs_diff(expected.len());
    (pairs.filter(|(a, b)| bits(a) != bits(b)).count() + missing) as u64
}

/// How many of the hits answer otherwise than those expected whether there is one; those that are missing too.
pub fn other_answers(hits: &[Hit], expected: &[Hit]) -> u64 {
    let pairs = hits.iter().zip(expected);
    let missing = hits.len().abs_diff(expected.len());
    (pairs.filter(|(a, b)| a.is_hit() != b.is_hit()).count() + missing) as u64
}

/// [`different`] of both kinds of rays.
pub fn different_of_both(hits: &[Vec<Hit>; 2], expected: &[Vec<Hit>; 2]) -> u64 {
    let pairs = hits.iter().zip(expected);
    pairs.map(|(hits, expected)| different(hits, expected)).sum()
}
/// Turns of a race.
pub const TURNS: usize = 5;

/// What a race found of one index.
pub struct Raced {
    /// Millions of rays per second: closest hits, any hits, both together.
    pub rates: [Repeats; 3],
    /// What the last of the timed turns found, closest hits and any hits.
    pub hits: [Vec<Hit>; 2],
    /// Workgroups that both kinds of rays together took in it, all dispatches; 0 without a queue.
    pub workgroups: u64,
}

/// Tracers of closest and of any hits with these settings but for the query; an index that takes part with several is on the device once.
fn tracers<'a>(
    gpu: &Gpu,
    indexes: impl IntoIterator<Item = (&'a dyn RayIndex, TraceSettings)>,
) -> Result<Vec<[RayTracer; 2]>> {
    let mut uploaded: Vec<(&dyn RayIndex, TexelView)> = Vec::new();
    let mut tracers = Vec::new();
    for (index, settings) in indexes {
        let known = uploaded.iter().find(|(other, _)| std::ptr::addr_eq(*other, index));
        let texels = match known {
            Some((_, texels)) => texels.clone(),
            None => {
                let format = vk::Format::R32G32B32A32_UINT;
                let texels = gpu.texels_with(index.name(), Category::Index, format, index.texels())?;
                uploaded.push((index, texels.clone()));
                texels
            }
        };
        let of = |query| {
            let traversal = index.device_traversal();
            let settings = TraceSettings { query, ..settings }.fitted(gpu.caps(), traversal);
            RayTracer::with_texels(gpu, texels.clone(), traversal, &settings)
        };
        tracers.push([of(Query::Closest)?, of(Query::Any)?]);
    }
    Ok(tracers)
}

/// Lets the device trace the same rays in several indexes in so many turns, with settings but for the query.
///
/// # Errors
/// Those of uploads and of submissions.
pub fn race<'a>(
    context: &Context<'_>,
    gpu: &Gpu,
    flight: &Flight,
    turns: usize,
    indexes: impl IntoIterator<Item = (&'a dyn RayIndex, TraceSettings)>,
) -> Result<Vec<Raced>> {
    let tracers = tracers(gpu, indexes)?;
    let mut hits = vec![[Vec::new(), Vec::new()]; tracers.len()];
    let mut workgroups = vec![[0; 2]; tracers.len()];
    let rays = [&flight.closest(), &flight.shadow];
    let seconds = context.in_turns(turns, tracers.len(), |contender| {
        let mut seconds = [0.0; 2];
        for (query, rays) in rays.into_iter().enumerate() {
            let tracer = &tracers[contender][query];
            let (traced, wall) = timed(|| tracer.trace(rays));
            let traced = traced?;
            let on_device = traced.seconds();
            workgroups[contender][query] = u64::from(traced.dispatches) * u64::from(tracer.groups().unwrap_or(0));
            seconds[query] = if on_device > 0.0 { on_device } else { wall };
            hits[contender][query] = traced.hits;
        }
        Ok(seconds)
    })?;
    let [closest, any] = rays.map(|rays| 1e-6 * rays.len() as f64);
    let found = hits.into_iter().zip(workgroups);
    let raced = seconds.into_iter().zip(found).map(|(turns, (hits, workgroups))| {
        let rate = |of: &dyn Fn([f64; 2]) -> f64| -> Repeats { turns.iter().copied().map(of).collect() };
        let rates = [
            rate(&|[of_closest, _]| closest / of_closest),
            rate(&|[_, of_any]| any / of_any),
            rate(&|[of_closest, of_any]| (closest + any) / (of_closest + of_any)),
        ];
        Raced {
            rates,
            hits,
            workgroups: workgroups.iter().sum(),
        }
    });
    Ok(raced.collect())
}
