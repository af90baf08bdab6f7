//! `clerestory index --peers`: build times, surface area cost and rays per second of our indexes beside those of other libraries, and where our
//! rays' time goes.
//!
//! Ours are traced by the device's kernel, whether the processor has built them or the device, theirs on the processor with all threads; on a software device both share the same cores. The driver's own
//! acceleration structure is a peer where the device has ray queries.
//! Primary rays go through the pixels of the scene's first camera; diffuse ones leave what these meet by the cosine. All tracers see the
//! same rays in the same order, take turns, and medians count. Their hits are compared ray by ray with ours of the binned index, which are
//! those of trying all triangles.

mod crates;
mod embree;
mod files;
mod ours;
mod verdicts;
mod work;

pub use files::{FILES, files, markdown};

use std::process::ExitCode;

use clerestory::accel::box_test::BOX_SLACK;
use clerestory::accel::{NO_HIT, Ray, RayIndex};
use clerestory::gpu::Gpu;
use clerestory::transport::random::{pcg3d, unit_float};
use clerestory::transport::warp::square_to_sphere;
use clerestory::{Error, Result, scene};
use clerestory_tools::geometry::{camera_rays, triangles};
use clerestory_tools::machine;
use clerestory_tools::timing::{Spread, repeated, timed};
use glam::{DVec2, UVec3, Vec3};
use rayon::prelude::*;

use self::embree::Embree;
use self::work::Work;
use super::check_validation;
use crate::failure::{Failure, Outcome};
use crate::output;
use crate::outputs::{OutputFolder, OutputPage, Written};

/// Rays of a task of a thread.
const CHUNK: usize = 1024;
/// Rays begin that far from surfaces, relative to the scene's extent.
const RELATIVE_OFFSET: f32 = 1e-5;
/// Kinds of rays.
pub const KINDS: [&str; 2] = ["primary", "diffuse"];
/// The wide tree that rates are compared with.
pub const BASE: &str = "obvhs CWBVH, medium";
/// Two triangles are met at the same place when their parameters differ by less than this share of the farthest corner's distance: what
/// our test may err by, for both tests.
const SAME_PLACE: f32 = 2.0 * BOX_SLACK;

/// What to compare.
pub struct Settings<'a> {
    /// Addresses.
    pub scenes: &'a [String],
    /// Primary rays, about.
    pub rays: u32,
    /// Measured runs.
    pub repeat: u32,
}

/// What a ray met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intersection {
    /// Ray parameter.
    t: f32,
    /// Index of the triangle, or [`NO_HIT`].
    triangle: u32,
}

impl Intersection {
    const NONE: Self = Self {
        t: f32::INFINITY,
        triangle: NO_HIT,
    };
}

/// Rays whose hits are not ours, by how they differ.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Disagreement {
    /// Another triangle at the same place: a shared edge or corner, or one triangle in another.
    ties: usize,
    /// Nothing where we met something.
    lost: usize,
    /// Something where we met nothing.
    gained: usize,
    /// A triangle elsewhere.
    elsewhere: usize,
}

impl Disagreement {
    fn of(ours: &[Intersection], theirs: &[Intersection], reaches: &[f32]) -> Self {
        let mut found = Self::default();
        for ((ours, theirs), reach) in ours.iter().zip(theirs).zip(reaches) {
            match (ours.triangle, theirs.triangle) {
                (a, b) if a == b => {}
                (_, NO_HIT) => found.lost += 1,
                (NO_HIT, _) => found.gained += 1,
                _ if (ours.t - theirs.t).abs() <= SAME_PLACE * reach => found.ties += 1,
                _ => found.elsewhere += 1,
            }
        }
        found
    }

    /// All of them.
    fn rays(&self) -> usize {
        self.ties + self.lost + self.gained + self.elsewhere
    }
}

impl std::fmt::Display for Disagreement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kinds = [
            (self.ties, "same place"),
            (self.lost, "lost"),
            (self.gained, "gained"),
            (self.elsewhere, "elsewhere"),
        ];
        let named = kinds.iter().filter(|(count, _)| *count > 0);
        let named: Vec<String> = named.map(|(count, name)| format!("{count} {name}")).collect();
        match named[..] {
            [] => f.write_str("0"),
            _ => write!(f, "{} ({})", self.rays(), named.join(", ")),
        }
    }
}

/// One index of one scene.
#[derive(Debug, serde::Serialize)]
pub struct Measured {
    scene: String,
    index: String,
    /// Whether it is one of the engine's.
    is_ours: bool,
    triangles: usize,
    /// Seconds.
    build: Spread,
    /// With unit costs; none for peers' wide nodes.
    sah_cost: Option<f64>,
    /// Millions of rays per second: primary, diffuse.
    mrays_per_second: [Spread; 2],
    /// Median rates over those of the peer's wide tree of the better build.
    ratios: [f64; 2],
    /// Rays.
    rays: [usize; 2],
    /// Rays that meet something.
    hits: [usize; 2],
    /// Rays whose hit is not that of our first index.
    disagreement: [Disagreement; 2],
}

/// All that was found.
#[derive(Debug, serde::Serialize)]
pub struct Found {
    device: String,
    driver: String,
    engine_version: &'static str,
    processor: String,
    threads: usize,
    load: Option<String>,
    repeat: u32,
    /// Peers that are not there, with the reason.
    absent: Vec<String>,
    indexes: Vec<Measured>,
    work: Vec<Work>,
}

/// Traces rays of one of two kinds: seconds and what they met.
pub type Trace<'a> = Box<dyn FnMut(usize) -> Result<(f64, Vec<Intersection>)> + 'a>;

/// An index that was built, and how rays are traced in it.
pub struct Contender<'a> {
    name: String,
    build: Spread,
    sah_cost: Option<f64>,
    trace: Trace<'a>,
}

/// Measures all scenes.
pub fn measure(gpu: &Gpu, settings: &Settings<'_>) -> Outcome<Found> {
    let (caps, load) = (gpu.caps(), machine::load());
    let mut found = Found {
        device: caps.device.clone(),
        driver: caps.driver.clone(),
        engine_version: env!("CARGO_PKG_VERSION"),
        processor: machine::processor(),
        threads: machine::threads(),
        load,
        repeat: settings.repeat,
        absent: Vec::new(),
        indexes: Vec::new(),
        work: Vec::new(),
    };
    let embree = Embree::load(machine::threads());
    if let Err(reason) = &embree {
        found.absent.push(format!("Embree: {reason}"));
    }
    let embree = embree.ok();
    if !caps.ray_query {
        let reason = "the device has no VK_KHR_ray_query";
        found
            .absent
            .push(format!("the driver's acceleration structure: {reason}"));
    }
    for address in settings.scenes {
        let scene = scene::load(address).map_err(Failure::scene)?;
        let triangles = triangles(&scene);
        let side = f64::from(settings.rays).sqrt() as u32;
        let primary = camera_rays(scene.require_camera(None)?, side.max(1))?;
        one_scene(gpu, embree.as_ref(), address, &triangles, &primary, &mut found)?;
    }
    Ok(found)
}

/// Runs the comparison, writes it where that is asked for and prints it, as JSON or as Markdown.
pub fn run(
    gpu: Gpu,
    settings: &Settings<'_>,
    folder: Option<&OutputFolder>,
    page: Option<&OutputPage>,
    json: bool,
) -> Outcome<ExitCode> {
    let found = measure(&gpu, settings)?;
    let log = gpu.validation_log();
    drop(gpu);
    check_validation(&log)?;
    let text = markdown(&found);
    // What was measured is printed whatever becomes of the files, and written whatever becomes of the printing.
    let printed = if json {
        output::print_json(&found)
    } else {
        output::print(&text)
    };
    let mut written = Vec::new();
    written.extend(page.map(|page| page.write(files::BLOCK, &text)));
    if let Some(folder) = folder {
        written.push(folder.write(&files(&found)?));
    }
    Written::check_all(written)?;
    printed?;
    Ok(ExitCode::SUCCESS)
}

/// What a build gives, and the seconds of those after one that warms up.
fn built_in<T>(repeat: u32, mut build: impl FnMut() -> Result<T>) -> Result<(T, Spread)> {
    let (built, seconds) = repeated(repeat as usize, || {
        let (built, seconds) = timed(&mut build);
        built.map(|built| (built, seconds))
    })?;
    Ok((built, Spread::of(seconds)))
}

/// Lower and upper corner of all triangles.
fn bounds_of(triangles: &[[Vec3; 3]]) -> (Vec3, Vec3) {
    let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let corners = triangles.iter().flatten();
    corners.fold(nothing, |(low, high), corner| (low.min(*corner), high.max(*corner)))
}

fn one_scene(
    gpu: &Gpu,
    embree: Option<&Embree>,
    address: &str,
    triangles: &[[Vec3; 3]],
    primary: &[(Vec3, Vec3)],
    found: &mut Found,
) -> Result<()> {
    let repeat = found.repeat;
    let built = ours::build_all(triangles, repeat)?;
    let rays = rays_of(built[0].index.index(), triangles, primary);
    if rays.iter().any(Vec::is_empty) {
        return Err(Error::setting("scene", address, "is met by no ray of its camera"));
    }
    let (tested, peer_rays) = (crates::peer_triangles(triangles), crates::peer_rays(&rays));
    let mut contenders = Vec::new();
    for one in &built {
        contenders.push(ours::contender(gpu, one, &rays)?);
    }
    contenders.extend(ours::unwatched(gpu, triangles, &rays, repeat)?);
    let ours = contenders.len();
    if gpu.caps().ray_query {
        contenders.push(ours::by_driver(gpu, triangles, &rays, repeat)?);
    }
    contenders.extend(crates::of_obvhs(&tested, &peer_rays, repeat)?);
    contenders.push(crates::of_bvh(triangles, &tested, &rays, &peer_rays, repeat)?);
    if let Some(embree) = embree {
        for robust in [false, true] {
            contenders.push(by_embree(embree, triangles, &rays, robust, repeat)?);
        }
    }
    let (rates, met) = take_turns(&mut contenders, &rays, repeat)?;
    let (low, high) = bounds_of(triangles);
    let reach = |ray: &Ray| {
        let origin = Vec3::from(ray.origin);
        (low - origin).abs().max((high - origin).abs()).max_element()
    };
    let reaches = [0, 1].map(|kind: usize| rays[kind].iter().map(reach).collect::<Vec<f32>>());
    let base = contenders.iter().position(|contender| contender.name == BASE);
    let base = base.map_or([f64::NAN; 2], |i| rates[i].map(|rate| rate.median));
    for (i, contender) in contenders.iter().enumerate() {
        found.indexes.push(Measured {
            scene: address.to_owned(),
            index: contender.name.clone(),
            is_ours: i < ours,
            triangles: triangles.len(),
            build: contender.build,
            sah_cost: contender.sah_cost,
            mrays_per_second: rates[i],
            ratios: [0, 1].map(|kind| rates[i][kind].median / base[kind]),
            rays: [0, 1].map(|kind: usize| rays[kind].len()),
            hits: [0, 1].map(|kind| met[i][kind].iter().filter(|met| met.triangle != NO_HIT).count()),
            disagreement: [0, 1].map(|kind| Disagreement::of(&met[0][kind], &met[i][kind], &reaches[kind])),
        });
    }
    drop(contenders);
    found.work.extend(work::measure(gpu, address, &built, &rays, repeat)?);
    Ok(())
}

/// Rates of all contenders, and what their rays met, both by kind.
type Rates = (Vec<[Spread; 2]>, Vec<[Vec<Intersection>; 2]>);

fn take_turns(contenders: &mut [Contender<'_>], rays: &[Vec<Ray>; 2], repeat: u32) -> Result<Rates> {
    let mut rates = vec![[Vec::new(), Vec::new()]; contenders.len()];
    let mut all_met = vec![[Vec::new(), Vec::new()]; contenders.len()];
    for round in 0..=repeat {
        for (kind, rays) in rays.iter().enumerate() {
            for (i, contender) in contenders.iter_mut().enumerate() {
                let (seconds, met) = (contender.trace)(kind)?;
                all_met[i][kind] = met;
                // The first round compiles kernels and warms caches.
                if round > 0 {
                    rates[i][kind].push(1e-6 * rays.len() as f64 / seconds);
                }
            }
        }
    }
    Ok((rates.into_iter().map(|both| both.map(Spread::of)).collect(), all_met))
}

/// Primary rays, and one that leaves what each of them meets.
fn rays_of(index: &dyn RayIndex, triangles: &[[Vec3; 3]], primary: &[(Vec3, Vec3)]) -> [Vec<Ray>; 2] {
    let (low, high) = bounds_of(triangles);
    let offset = RELATIVE_OFFSET * (high - low).max_element();
    let primary: Vec<Ray> = primary.iter().map(|(o, d)| Ray::new(*o, *d)).collect();
    let leave = |(i, from): (usize, &Ray)| {
        let hit = index.closest_hit(from);
        let [a, b, c] = *triangles.get(hit.triangle as usize)?;
        let direction = Vec3::from(from.direction);
        let normal = (b - a).cross(c - a).normalize_or(-direction);
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let hash = pcg3d(UVec3::new(i as u32, 0, 1));
        let around = square_to_sphere(DVec2::new(unit_float(hash.x), unit_float(hash.y))).as_vec3();
        let origin = Vec3::from(from.origin) + hit.t * direction + offset * normal;
        Some(Ray::new(origin, (normal + around).normalize_or(normal)))
    };
    let diffuse = primary.par_iter().enumerate().filter_map(leave).collect();
    [primary, diffuse]
}

/// Traces all rays with all threads, each with a state of its own.
fn in_parallel<R: Sync, S>(
    rays: &[R],
    state: impl Fn() -> S + Sync + Send,
    trace: impl Fn(&mut S, &R) -> Intersection + Sync,
) -> (f64, Vec<Intersection>) {
    let mut met = vec![Intersection::NONE; rays.len()];
    let chunks = met.par_chunks_mut(CHUNK).zip(rays.par_chunks(CHUNK));
    let trace_all = |state: &mut S, (met, rays): (&mut [Intersection], &[R])| {
        for (met, ray) in met.iter_mut().zip(rays) {
            *met = trace(state, ray);
        }
    };
    let ((), seconds) = timed(|| chunks.for_each_init(state, trace_all));
    (seconds, met)
}

fn by_embree<'a>(
    embree: &'a Embree,
    triangles: &[[Vec3; 3]],
    rays: &'a [Vec<Ray>; 2],
    robust: bool,
    repeat: u32,
) -> Result<Contender<'a>> {
    let (tree, seconds) = repeated(repeat as usize, || embree.build(triangles, robust))?;
    let form = if robust { ", robust" } else { "" };
    Ok(Contender {
        name: format!("Embree {}{form}", embree.version()),
        build: Spread::of(seconds),
        sah_cost: None,
        trace: Box::new(move |kind| {
            Ok(in_parallel(
                &rays[kind],
                || (),
                |(): &mut (), ray| tree.closest_hit(ray),
            ))
        }),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disagreements_are_told_apart() {
        let met = |t: f32, triangle: u32| Intersection { t, triangle };
        let ours = [
            met(1.0, 4),
            met(1.0, 4),
            met(1.0, 4),
            Intersection::NONE,
            Intersection::NONE,
            met(1.0, 4),
        ];
        let theirs = [
            met(1.1, 4),
            met(1.0, 5),
            Intersection::NONE,
            met(3.0, 1),
            Intersection::NONE,
            met(1.1, 5),
        ];
        let found = Disagreement::of(&ours, &theirs, &[10.0; 6]);
        let expected = Disagreement {
            ties: 1,
            lost: 1,
            gained: 1,
            elsewhere: 1,
        };
        assert_eq!((found, found.rays()), (expected, 4));
        assert_eq!(found.to_string(), "4 (1 same place, 1 lost, 1 gained, 1 elsewhere)");
        assert_eq!(Disagreement::default().to_string(), "0");
    }
}
