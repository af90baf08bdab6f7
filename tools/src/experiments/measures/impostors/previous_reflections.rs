//! Older ways to what mirrors, stones and matte surfaces show, as pictures beside the path tracer's of the same light paths: the ray engine, virtual vertices, second eyes behind facets, views blended by their depths,
//! and light in harmonics and wavelets.
//!
//! Oracles: the path tracer, whose own noise stands beside and is taken away, and exact rays through the same samples, which tell what a way loses from what samples leave at edges. All surfaces shine and reflect nothing but the
//! one that is looked at, so that its light paths are those of one scattering.

use std::f64::consts::FRAC_1_PI;

use clerestory::Result;
use clerestory::accel::Ray;
use clerestory::accel::yardstick::ray_engine::RayEngine;
use clerestory::gpu::Gpu;
use clerestory::maps::gather::GatherPoint;
use clerestory::maps::gather::lit_room::LitRoom;
use clerestory::maps::harmonics::HarmonicLight;
use clerestory::maps::impostor::room::{BoxRoom, ShinySphere};
use clerestory::maps::impostor::views::{BlendedViews, DepthView};
use clerestory::maps::impostor::{ImpostorRay, ImpostorSettings, SearchMethod};
use clerestory::maps::irradiance::IrradianceSource;
use clerestory::maps::wavelets::WaveletLight;
use clerestory::maps::{MapImage, Parametrization};
use clerestory::raster::curved_mirror::{SphereMirror, VirtualTriangle};
use clerestory::scene::{Camera, Material, Scene};
use glam::{DVec3, UVec2, Vec3};

use super::cut_stone::{self, SecondEyes, StonePoint};
use super::judged_pictures::{EXACT, Judge, Row, Samples, Subject, camera_of, mirrored_rays};
use super::mirrored_rooms::color;
use super::shining_rooms::{checkered, lit, place_sphere, scene_of, view, wall_color};
use super::virtual_images::{MAP, PLACES, triangles, walls};
use crate::experiments::findings::{Bound, Criterion, Findings, Study, largest};
use crate::experiments::measures::Context;

/// Cells along a side of each wall that is drawn by virtual vertices, two triangles each.
const CELLS: [u32; 3] = [8, 16, 32];
const FINEST: u32 = CELLS[CELLS.len() - 1];
/// Parts along a side of each facet, a second eye each.
const PARTS: [u32; 3] = [1, 2, 4];
const VIEWS: [usize; 3] = [1, 2, 4];
/// Orders of harmonics of matte surfaces, and the one of mirrors.
const ORDERS: [u32; 2] = [2, 4];
const SHARP: u32 = 8;
/// Radius of a sphere beside which all else is far away.
const SMALL: f64 = 0.01;
/// Reflectance of matte spheres.
const ALBEDO: f32 = 0.5;
/// Who looks at the stone, at which point, and the field of view, radians.
const STONE_EYE: DVec3 = DVec3::new(0.15, 1.7, 0.3);
const STONE_MIDDLE: DVec3 = DVec3::new(0.0, 0.2, 0.0);
const STONE_FIELD: f32 = 1.3;

const MIRRORED: &str = "LSE";
const THROUGH: &str = "LStE";
const MATTE: &str = "LDE";

/// Sizes of a run.
#[derive(Clone, Copy)]
struct Sizes {
    /// Pixels along a side.
    pixels: u32,
    /// Samples along a side of a pixel where there are edges, and where there are none.
    samples: [u32; 2],
    /// Samples of a pixel of the path tracer.
    spp: u32,
    /// Parts of an edge of the icosahedron that spheres are made of.
    frequency: u32,
    /// Texels along a side of views, and of faces of the lit room's map.
    texels: [u32; 2],
}

const FULL: Sizes = Sizes {
    pixels: 64,
    samples: [8, 2],
    spp: 1024,
    frequency: 48,
    texels: [192, 32],
};
const SMOKE: Sizes = Sizes {
    pixels: 16,
    samples: [4, 1],
    spp: 4,
    frequency: 8,
    texels: [32, 16],
};

/// A picture that is taken by several ways.
struct Taken {
    name: &'static str,
    file: &'static str,
    words: &'static str,
    take: fn(&Gpu, &'static str, &Sizes) -> Result<Judge>,
}

const SPHERE: &str = "a room in a mirror sphere";
const STONE: &str = "a clear stone on a checkered floor";
const PILLAR: &str = "a mirror sphere behind a pillar";
const SMALL_MATTE: &str = "a small matte sphere in a lit room";
const LARGE_MATTE: &str = "a matte sphere of radius 0.15";
const SMALL_MIRROR: &str = "a small mirror sphere in a lit room";
const TAKEN: [Taken; 6] = [
    Taken {
        name: SPHERE,
        file: "sphere.png",
        words: "A checkered room in a mirror sphere, from the left by the path tracer, exact rays, the ray engine, and virtual vertices of 768, 3,072 and 12,288 triangles",
        take: sphere,
    },
    Taken {
        name: STONE,
        file: "stone.png",
        words: "A clear stone on a checkered floor, from the left by the path tracer, exact rays, and a second eye for each facet, for each quarter and for each sixteenth of one",
        take: stone,
    },
    Taken {
        name: PILLAR,
        file: "pillar.png",
        words: "A room in a mirror sphere behind a pillar, from the left by the path tracer, exact rays, and views of one, two and four places",
        take: pillar,
    },
    Taken {
        name: SMALL_MATTE,
        file: "matte.png",
        words: "A small matte sphere in a lit room, from the left by the path tracer, exact irradiance, harmonics of 9 and 25 numbers, and as many wavelets",
        take: |gpu, name, sizes| matte(gpu, name, SMALL, sizes),
    },
    Taken {
        name: LARGE_MATTE,
        file: "large-matte.png",
        words: "A matte sphere of radius 0.15 in the same room by the same ways",
        take: |gpu, name, sizes| matte(gpu, name, LitRoom::RADIUS, sizes),
    },
    Taken {
        name: SMALL_MIRROR,
        file: "mirror.png",
        words: "A small mirror sphere in that room, from the left by the path tracer, exact rays, the map itself, 81 numbers of harmonics, and as many wavelets",
        take: mirror,
    },
];

/// What was found.
pub type Found = Vec<Row>;

const ENGINE: &str = "the ray engine";
const MAP_ITSELF: &str = "the map itself";

fn virtual_vertices(cells: u32) -> String {
    format!("virtual vertices, {} triangles", triangles(cells))
}

fn second_eyes(parts: u32) -> String {
    match parts {
        1 => "a second eye for each facet".into(),
        parts => format!("{} second eyes for each facet", parts * parts),
    }
}

fn views(count: usize) -> String {
    match count {
        1 => "a view of one place".into(),
        count => format!("views of {count} places"),
    }
}

fn harmonics(numbers: usize) -> String {
    format!("harmonics, {numbers} numbers")
}

fn wavelets(numbers: usize) -> String {
    format!("wavelets, {numbers} terms")
}

impl Row {
    fn is(&self, picture: &str, way: &str) -> bool {
        self.picture == picture && self.way == way
    }
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "exact rays are the path tracer's but for edges: RMS without its noise (%)",
        Bound::AtMost(4.0),
        |row: &Row| row.without_noise.into(),
    )
    .among(|row| row.way == EXACT && [SPHERE, STONE, PILLAR].contains(&row.picture.as_str()))
    .because("an edge among 8² samples of a pixel is off by a 28th of its contrast, which is about the mean"),
    Criterion::each(
        "exact irradiance is the path tracer's: RMS without its noise (%)",
        Bound::AtMost(1.0),
        |row: &Row| row.without_noise.into(),
    )
    .among(|row| row.way == EXACT && [SMALL_MATTE, LARGE_MATTE].contains(&row.picture.as_str()))
    .because("noise of 3 % is known to a fiftieth, so that its squares leave half a percent"),
    Criterion::each(
        "the ray engine shows what exact rays do: RMS beside them (%)",
        Bound::AtMost(0.1),
        |row: &Row| row.beside_rays.into(),
    )
    .among(|row| row.way == ENGINE)
    .in_every_form(),
    Criterion::each(
        "virtual vertices of triangles half as large are nearer: RMS beside exact rays over that of larger ones",
        Bound::AtMost(0.5),
        |row: &Row| row.over_other.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.picture == SPHERE && row.over_other.is_some())
    .because("images bend by the square of a triangle's size, and a picture of edges is off by the root of where they are"),
    Criterion::each(
        "the finest virtual vertices add less to what samples leave at edges than that is: RMS beside exact rays (%)",
        Bound::AtMost(4.0),
        |row: &Row| row.beside_rays.into(),
    )
    .among(|row| row.is(SPHERE, &virtual_vertices(FINEST)))
    .because("the same bound"),
    Criterion::each(
        "second eyes for parts of facets half as wide are nearer: RMS beside exact rays over that of wider ones",
        Bound::AtMost(0.75),
        |row: &Row| row.over_other.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.picture == STONE && row.over_other.is_some())
    .because("refracted rays are off by no more than in proportion to a part's width, and a picture of edges by the root of that"),
    Criterion::each(
        "views of twice as many places are nearer: RMS beside exact rays over that of fewer",
        Bound::AtMost(1.0),
        |row: &Row| row.over_other.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.picture == PILLAR && row.over_other.is_some()),
    Criterion::each(
        "nine numbers are near a small sphere's irradiance: RMS without the path tracer's noise (%)",
        Bound::AtMost(9.0),
        |row: &Row| row.without_noise.into(),
    )
    .among(|row| row.is(SMALL_MATTE, &harmonics(numbers_of(ORDERS[0]))))
    .because("no light is off by more, as was published"),
    Criterion::each(
        "wavelets hold edges that harmonics blur: RMS beside exact rays over that of as many harmonics",
        Bound::AtMost(0.78),
        |row: &Row| row.over_other.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.is(SMALL_MIRROR, &wavelets(numbers_of(SHARP))))
    .because("they were to lose six tenths of the squares that harmonics do"),
];

/// Numbers of harmonics up to an order.
const fn numbers_of(order: u32) -> usize {
    ((order + 1) * (order + 1)) as usize
}

/// A sphere of a material in a scene, as it is seen.
fn subject(
    name: &'static str,
    (mut scene, sphere): (Scene, &ShinySphere),
    (material, paths): (Material, &'static str),
    (sizes, samples): (&Sizes, u32),
) -> Result<Subject> {
    place_sphere(&mut scene, sphere, material, sizes.frequency)?;
    Ok(Subject {
        name,
        scene,
        camera: camera_of(sphere),
        paths,
        grid: [sizes.pixels, samples],
        spp: sizes.spp,
    })
}

/// What rays meet in a checkered room.
fn met(room: BoxRoom, ray: &ImpostorRay) -> DVec3 {
    let surface = room.surface_from(ray.origin, ray.direction);
    color(ray.origin + surface.distance * ray.direction, surface.normal)
}

/// What a way shows of each ray; black where there is none.
fn shown(rays: &[Option<ImpostorRay>], of: impl Fn(&ImpostorRay) -> DVec3) -> Vec<DVec3> {
    rays.iter().map(|ray| ray.as_ref().map_or(DVec3::ZERO, &of)).collect()
}

/// The ray engine and virtual vertices.
fn sphere(gpu: &Gpu, name: &'static str, sizes: &Sizes) -> Result<Judge> {
    let (sphere, samples) = (ShinySphere::B, sizes.samples[0]);
    let panels = checkered(sphere.room);
    let mirror = (Material::mirror("mirror", Vec3::ONE), MIRRORED);
    let subject = subject(name, (scene_of(&panels), &sphere), mirror, (sizes, samples))?;
    let (camera, grid) = (subject.camera.clone(), subject.grid);
    let rays = mirrored_rays(&sphere, grid);
    let exact = || rays.iter().map(|ray| ray.map(|ray| met(sphere.room, &ray))).collect();
    let mut judge = Judge::new(gpu, subject, exact)?;

    let engine = RayEngine::new(gpu)?;
    let of_panels: Vec<[Vec3; 3]> = panels.iter().flat_map(|panel| panel.triangles()).collect();
    judge.add(ENGINE, None, || {
        let single = |ray: &ImpostorRay| Ray::new(ray.origin.as_vec3(), ray.direction.as_vec3());
        let asked: Vec<Ray> = rays.iter().flatten().map(single).collect();
        let (hits, _) = engine.trace(&of_panels, &asked)?;
        let mut hits = hits.into_iter();
        let of_ray = |ray: &Option<ImpostorRay>| {
            let hit = ray.and_then(|_| hits.next()).filter(|hit| hit.is_hit());
            hit.map_or(DVec3::ZERO, |hit| panels[hit.triangle as usize / 2].radiance)
        };
        Ok(rays.iter().map(of_ray).collect())
    })?;

    let field = 2.0 * (sphere.radius / sphere.centre.distance(sphere.camera)).asin();
    let all = Samples::new(&camera, field, grid);
    let mirror = SphereMirror {
        centre: sphere.centre,
        radius: sphere.radius,
    };
    let mut coarser: Option<String> = None;
    for cells in CELLS {
        judge.add(virtual_vertices(cells), coarser.as_deref(), || {
            let seen = |corners| VirtualTriangle::new(&mirror, sphere.camera, corners);
            let drawn: Vec<VirtualTriangle> = walls(cells).into_iter().filter_map(seen).collect();
            Ok(all.drawn(&drawn, wall_color))
        })?;
        coarser = Some(virtual_vertices(cells));
    }
    Ok(judge)
}

/// Second eyes behind facets.
fn stone(gpu: &Gpu, name: &'static str, sizes: &Sizes) -> Result<Judge> {
    let camera = Camera::look_at("stone", STONE_EYE, STONE_MIDDLE, DVec3::Y, STONE_FIELD);
    let grid = [sizes.pixels, sizes.samples[0]];
    let directions = Samples::new(&camera, STONE_FIELD.into(), grid).directions();
    let points: Vec<Option<StonePoint>> = directions
        .into_iter()
        .map(|direction| cut_stone::met(STONE_EYE, direction))
        .collect();
    let subject = Subject {
        name,
        scene: cut_stone::scene(),
        camera,
        paths: THROUGH,
        grid,
        spp: sizes.spp,
    };
    let exact = || {
        let of_point = |point: &Option<StonePoint>| point.map(|point| cut_stone::exact(STONE_EYE, &point));
        points.iter().map(of_point).collect()
    };
    let mut judge = Judge::new(gpu, subject, exact)?;
    let mut wider: Option<String> = None;
    for parts in PARTS {
        judge.add(second_eyes(parts), wider.as_deref(), || {
            let eyes = SecondEyes::new(STONE_EYE, parts);
            let of_point = |point: &Option<StonePoint>| point.map_or(DVec3::ZERO, |point| eyes.seen(&point));
            Ok(points.iter().map(of_point).collect())
        })?;
        wider = Some(second_eyes(parts));
    }
    Ok(judge)
}

/// Views blended by their depths.
fn pillar(gpu: &Gpu, name: &'static str, sizes: &Sizes) -> Result<Judge> {
    let (sphere, samples) = (ShinySphere::P2, sizes.samples[0]);
    let mirror = (Material::mirror("mirror", Vec3::ONE), MIRRORED);
    let scene = scene_of(&checkered(sphere.room));
    let subject = subject(name, (scene, &sphere), mirror, (sizes, samples))?;
    let rays = mirrored_rays(&sphere, subject.grid);
    let exact = || rays.iter().map(|ray| ray.map(|ray| met(sphere.room, &ray))).collect();
    let mut judge = Judge::new(gpu, subject, exact)?;
    let settings = ImpostorSettings {
        tolerance: 5e-3,
        ..ImpostorSettings::of(SearchMethod::March, 64)
    };
    let size = UVec2::splat(sizes.texels[0]);
    let mut fewer: Option<String> = None;
    for count in VIEWS {
        let all: Result<Vec<DepthView>> = PLACES[..count]
            .iter()
            .map(|place| view(sphere.room, *place, MAP, size))
            .collect();
        let all = BlendedViews::new(all?, settings)?;
        let shown = || Ok(shown(&rays, |ray| all.look_up(ray).radiance));
        judge.add(views(count), fewer.as_deref(), shown)?;
        fewer = Some(views(count));
    }
    Ok(judge)
}

/// A sphere in the middle of the lit room.
fn in_the_middle(radius: f64) -> ShinySphere {
    ShinySphere {
        radius,
        ..ShinySphere::A
    }
}

/// The lit room from its middle.
fn map_of_the_room(sizes: &Sizes) -> Result<MapImage> {
    Ok(LitRoom::PUBLISHED.maps(Parametrization::Cube, sizes.texels[1])?.0)
}

/// Irradiance by harmonics and by wavelets.
fn matte(gpu: &Gpu, name: &'static str, radius: f64, sizes: &Sizes) -> Result<Judge> {
    let (room, sphere) = (LitRoom::PUBLISHED, in_the_middle(radius));
    let material = (Material::lambert("matte", Vec3::splat(ALBEDO)), MATTE);
    let scene = scene_of(&lit(&room));
    let subject = subject(name, (scene, &sphere), material, (sizes, sizes.samples[1]))?;
    let rays = mirrored_rays(&sphere, subject.grid);
    let normal = |ray: &ImpostorRay| (ray.origin - sphere.centre) / sphere.radius;
    let reflected = |irradiance: DVec3| f64::from(ALBEDO) * FRAC_1_PI * irradiance;
    let exact = || {
        let of_ray = |ray: ImpostorRay| {
            let (position, axis) = (ray.origin, normal(&ray));
            reflected(DVec3::splat(room.irradiance(&GatherPoint { position, axis })))
        };
        rays.iter().map(|ray| ray.map(of_ray)).collect()
    };
    let mut judge = Judge::new(gpu, subject, exact)?;
    let map = map_of_the_room(sizes)?;
    for order in ORDERS {
        let light = HarmonicLight::new(&map, order)?;
        let shown = || Ok(shown(&rays, |ray| reflected(light.irradiance(normal(ray)))));
        judge.add(harmonics(light.numbers()), None, shown)?;
    }
    for order in ORDERS {
        let numbers = numbers_of(order);
        let source = IrradianceSource::new(&WaveletLight::new(&map, numbers)?.image()?);
        let irradiance = |ray: &ImpostorRay| source.irradiance(normal(ray)).unwrap_or(DVec3::ZERO);
        let shown = || Ok(shown(&rays, |ray| reflected(irradiance(ray))));
        judge.add(wavelets(numbers), Some(&harmonics(numbers)), shown)?;
    }
    Ok(judge)
}

/// Radiance by harmonics and by wavelets.
fn mirror(gpu: &Gpu, name: &'static str, sizes: &Sizes) -> Result<Judge> {
    let (room, sphere) = (LitRoom::PUBLISHED, in_the_middle(SMALL));
    let material = (Material::mirror("mirror", Vec3::ONE), MIRRORED);
    let scene = scene_of(&lit(&room));
    let subject = subject(name, (scene, &sphere), material, (sizes, sizes.samples[0]))?;
    let rays = mirrored_rays(&sphere, subject.grid);
    let of_ray = |ray: ImpostorRay| {
        let hit = ray.origin + sphere.room.hit(ray.origin, ray.direction) * ray.direction;
        DVec3::splat(room.radiance(hit))
    };
    let exact = || rays.iter().map(|ray| ray.map(of_ray)).collect();
    let mut judge = Judge::new(gpu, subject, exact)?;
    let map = map_of_the_room(sizes)?;
    let look_up = |map: &MapImage, ray: &ImpostorRay| map.look_up(ray.direction).unwrap_or(DVec3::ZERO);
    judge.add(MAP_ITSELF, None, || Ok(shown(&rays, |ray| look_up(&map, ray))))?;
    let light = HarmonicLight::new(&map, SHARP)?;
    let numbers = light.numbers();
    judge.add(harmonics(numbers), None, || {
        Ok(shown(&rays, |ray| light.radiance(ray.direction)))
    })?;
    let kept = WaveletLight::new(&map, numbers)?.image()?;
    judge.add(wavelets(numbers), Some(&harmonics(numbers)), || {
        Ok(shown(&rays, |ray| look_up(&kept, ray)))
    })?;
    Ok(judge)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let sizes = context.pick(FULL, SMOKE);
        context.each(
            &TAKEN,
            |taken| taken.name.into(),
            |taken| {
                let judge = (taken.take)(&gpu, taken.name, &sizes)?;
                context.picture(taken.file, &judge.sheet());
                Ok(judge.rows)
            },
        )
    }

    fn findings(&self) -> Findings {
        let finest = |row: &Row| row.is(SPHERE, &virtual_vertices(FINEST));
        let findings = Findings::of(self, CRITERIA)
            .headline(
                "RMS of a room in a sphere by the finest virtual vertices, beside the path tracer (%)",
                largest(self, finest, |row| row.beside_paths),
            )
            .note(format!(
                "{0} × {0} pixels of {1}² samples, of matte spheres {2}², beside {3} paths a pixel; judged are pixels that show nothing but the sphere within {4} of its radius, or the stone. Times are those of a thread of the \
                 host, but for the ray engine's and the path tracer's, and without maps, which are there before. What is compared with another way shows it in fewer triangles, parts or views, or in as many numbers.",
                FULL.pixels, FULL.samples[0], FULL.samples[1], FULL.spp, super::judged_pictures::RIM
            ));
        if self.is_empty() {
            return findings;
        }
        let findings = findings.bars(
            "ways",
            "RMS beside the path tracer, over the mean (%)",
            self,
            |row| [row.picture.clone(), row.way.clone()],
            |row| row.beside_paths.into(),
        );
        let there = TAKEN
            .iter()
            .filter(|taken| self.iter().any(|row| row.picture == taken.name));
        there.fold(findings, |findings, taken| findings.picture(taken.file, taken.words))
    }
}
