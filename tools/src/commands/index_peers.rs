//! `clerestory index --peers`: build times, surface area cost and rays a second of our indexes beside those of the crate obvhs.
//!
//! Ours are traced by the device's kernel, theirs on the processor with all threads; on a software device both share the same cores.
//! Primary rays go through the pixels of the scene's first camera; diffuse ones leave what these meet by the cosine. All tracers see the
//! same rays in the same order, take turns, and medians count.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::lbvh::{self, BuildQuality, LbvhSettings};
use clerestory::accel::{Hit, Ray, RayIndex};
use clerestory::gpu::ash::vk::Format;
use clerestory::gpu::shaders::accel::trace_closest;
use clerestory::gpu::shaders::sets::Bvh2Set;
use clerestory::gpu::{Category, Gpu, rw_compute_to_compute, transfer_to_compute};
use clerestory::transport::random::{pcg3d, unit_float};
use clerestory::transport::warp::square_to_sphere;
use clerestory::{Error, Result, scene};
use clerestory_tools::geometry::{camera_rays, triangles};
use clerestory_tools::machine::{self, median};
use glam::{DVec2, UVec3, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2 as PeerBvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray as PeerRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use rayon::prelude::*;

use super::check_validation;
use crate::failure::{Failure, Outcome};
use crate::output::{self, Table};

/// Steps of a ray in one dispatch: few enough for software devices, which end long loops, and more than these rays need.
const QUOTA: u32 = 50_000;
/// Rays of a task of a thread.
const CHUNK: usize = 1024;
/// Rays begin that far from surfaces, relative to the scene's extent.
const RELATIVE_OFFSET: f32 = 1e-5;
/// Kinds of rays.
const KINDS: [&str; 2] = ["primary", "diffuse"];

/// One index of one scene.
#[derive(Debug, serde::Serialize)]
struct Measured {
    scene: String,
    index: &'static str,
    triangles: usize,
    build_seconds: f64,
    /// With unit costs; none for wide nodes.
    sah_cost: Option<f64>,
    /// Millions of rays a second: primary, diffuse.
    mrays_per_second: [f64; 2],
    /// Rates over those of the peer's wide tree of the better build.
    ratios: [f64; 2],
    /// Rays that meet something.
    hits: [usize; 2],
}

/// Builds an index of ours.
type Build = fn(&[[Vec3; 3]]) -> Result<Bvh2>;

/// Traces rays of one of two kinds: seconds and number of hits.
type Trace<'a> = Box<dyn FnMut(usize) -> Result<(f64, usize)> + 'a>;

struct Contender<'a> {
    name: &'static str,
    build_seconds: f64,
    sah_cost: Option<f64>,
    trace: Trace<'a>,
}

/// The wide tree that rates are compared with.
const BASE: &str = "obvhs CWBVH, medium";

/// Runs the comparison.
pub fn run(gpu: Gpu, scenes: &[String], rays: u32, repeat: u32, json: bool) -> Outcome<ExitCode> {
    let mut all = Vec::new();
    for address in scenes {
        let scene = scene::load(address).map_err(Failure::scene)?;
        let triangles = triangles(&scene);
        let camera = scene.require_camera(None)?;
        let side = f64::from(rays).sqrt() as u32;
        all.extend(measure(
            &gpu,
            address,
            &triangles,
            &camera_rays(camera, side.max(1))?,
            repeat,
        )?);
    }
    let (caps, log) = (gpu.caps().clone(), gpu.validation_log());
    drop(gpu);
    check_validation(&log)?;
    if json {
        output::print_json(&serde_json::json!({
            "device": caps.device, "driver": caps.driver, "engine_version": env!("CARGO_PKG_VERSION"), "processor": machine::processor(),
            "threads": machine::threads(), "load": machine::load(), "repeat": repeat, "indexes": all,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let head = [
        "scene",
        "index",
        "triangles",
        "build ms",
        "SAH cost",
        "primary",
        "ratio",
        "diffuse",
        "ratio",
        "hits",
    ];
    let mut table = Table::new(&head, &[1]);
    for one in &all {
        table.row([
            one.scene.clone(),
            one.index.into(),
            one.triangles.to_string(),
            format!("{:.1}", 1e3 * one.build_seconds),
            one.sah_cost.map_or_else(|| "-".into(), |cost| format!("{cost:.2}")),
            format!("{:.3}", one.mrays_per_second[0]),
            format!("{:.3}", one.ratios[0]),
            format!("{:.3}", one.mrays_per_second[1]),
            format!("{:.3}", one.ratios[1]),
            format!("{} {}", one.hits[0], one.hits[1]),
        ]);
    }
    let head = output::one_line(&format!(
        "{}, driver {}; million rays a second and their ratio to {BASE}, medians of {repeat} runs in turns, load {}",
        caps.device,
        caps.driver,
        machine::load().unwrap_or_else(|| "unknown".into())
    ));
    output::print(&format!("{head}\n{}", table.text()))?;
    Ok(ExitCode::SUCCESS)
}

/// What a build gives, and the median of its seconds after one that warms up.
fn timed<T>(repeat: u32, mut build: impl FnMut() -> Result<T>) -> Result<(T, f64)> {
    let mut built = build()?;
    let mut seconds = Vec::new();
    for _ in 0..repeat {
        let start = Instant::now();
        built = build()?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    Ok((built, median(seconds)))
}

fn measure(
    gpu: &Gpu,
    address: &str,
    triangles: &[[Vec3; 3]],
    primary: &[(Vec3, Vec3)],
    repeat: u32,
) -> Result<Vec<Measured>> {
    let ours: [(&str, Build); 3] = [
        ("bvh2, binned", |t| Bvh2::build(t, &Bvh2Settings::default())),
        ("lbvh, fast", |t| {
            let quality = BuildQuality::Fast;
            lbvh::build(
                t,
                &LbvhSettings {
                    quality,
                    ..LbvhSettings::default()
                },
            )
        }),
        ("lbvh, high", |t| lbvh::build(t, &LbvhSettings::default())),
    ];
    let built = ours.map(|(name, build)| timed(repeat, || build(triangles)).map(|built| (name, built)));
    let built = built.into_iter().collect::<Result<Vec<_>>>()?;
    let rays = rays_of(&built[0].1.0, triangles, primary);
    let peer_rays = [&rays[0], &rays[1]].map(|rays| rays.iter().map(peer_ray).collect::<Vec<_>>());
    let peers: Vec<Triangle> = triangles.iter().map(peer_triangle).collect();
    let mut contenders = Vec::new();
    for (name, (index, build_seconds)) in &built {
        contenders.push(Contender {
            name,
            build_seconds: *build_seconds,
            sah_cost: Some(index.statistics().sah_cost),
            trace: by_kernel(gpu, index, &rays)?,
        });
    }
    for (names, settings) in [
        (["obvhs BVH2, fast", "obvhs CWBVH, fast"], BvhBuildParams::fast_build()),
        (["obvhs BVH2, medium", BASE], BvhBuildParams::medium_build()),
    ] {
        let (tree, seconds) = timed(repeat, || Ok(build_bvh2(&peers, settings, &mut Duration::default())))?;
        let cost = peer_cost(&tree);
        contenders.push(Contender {
            name: names[0],
            build_seconds: seconds,
            sah_cost: Some(cost),
            trace: by_peer_bvh2(tree, &peers, &peer_rays),
        });
        let (tree, seconds) = timed(repeat, || Ok(build_cwbvh(&peers, settings, &mut Duration::default())))?;
        contenders.push(Contender {
            name: names[1],
            build_seconds: seconds,
            sah_cost: None,
            trace: by_peer_cwbvh(tree, &peers, &peer_rays),
        });
    }
    let mut rates = vec![[Vec::new(), Vec::new()]; contenders.len()];
    let mut hits = vec![[0; 2]; contenders.len()];
    for round in 0..=repeat {
        for kind in 0..KINDS.len() {
            for (i, contender) in contenders.iter_mut().enumerate() {
                let (seconds, found) = (contender.trace)(kind)?;
                hits[i][kind] = found;
                // The first round compiles kernels and warms caches.
                if round > 0 {
                    rates[i][kind].push(1e-6 * rays[kind].len() as f64 / seconds);
                }
            }
        }
    }
    let rates: Vec<[f64; 2]> = rates.into_iter().map(|both| both.map(median)).collect();
    let base = contenders.iter().position(|contender| contender.name == BASE);
    let base = base.map_or([f64::NAN; 2], |i| rates[i]);
    let measured = contenders.iter().enumerate().map(|(i, contender)| Measured {
        scene: address.to_owned(),
        index: contender.name,
        triangles: triangles.len(),
        build_seconds: contender.build_seconds,
        sah_cost: contender.sah_cost,
        mrays_per_second: rates[i],
        ratios: [0, 1].map(|kind| rates[i][kind] / base[kind]),
        hits: hits[i],
    });
    Ok(measured.collect())
}

/// Primary rays, and one that leaves what each of them meets.
fn rays_of(index: &Bvh2, triangles: &[[Vec3; 3]], primary: &[(Vec3, Vec3)]) -> [Vec<Ray>; 2] {
    let ray = |origin: Vec3, direction: Vec3| Ray {
        origin: origin.into(),
        t_min: 0.0,
        direction: direction.into(),
        t_max: f32::INFINITY,
    };
    let corners = triangles.iter().flatten();
    let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), corner| {
        (low.min(*corner), high.max(*corner))
    });
    let offset = RELATIVE_OFFSET * (high - low).max_element();
    let primary: Vec<Ray> = primary.iter().map(|(o, d)| ray(*o, *d)).collect();
    let leave = |(i, from): (usize, &Ray)| {
        let hit = index.closest_hit(from);
        let [a, b, c] = *triangles.get(hit.triangle as usize)?;
        let direction = Vec3::from(from.direction);
        let normal = (b - a).cross(c - a).normalize_or(-direction);
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let hash = pcg3d(UVec3::new(i as u32, 0, 1));
        let around = square_to_sphere(DVec2::new(unit_float(hash.x), unit_float(hash.y))).as_vec3();
        let origin = Vec3::from(from.origin) + hit.t * direction + offset * normal;
        Some(ray(origin, (normal + around).normalize_or(normal)))
    };
    let diffuse = primary.par_iter().enumerate().filter_map(leave).collect();
    [primary, diffuse]
}

fn by_kernel<'a>(gpu: &'a Gpu, index: &Bvh2, rays: &[Vec<Ray>; 2]) -> Result<Trace<'a>> {
    let spec = trace_closest::Spec {
        bvh2_quota: QUOTA,
        bvh2_count: false,
    };
    let pipeline = gpu.compute_pipeline::<trace_closest::Kernel>(&spec)?;
    let format = Format::R32G32B32A32_UINT;
    let quarters = gpu.texels_with(index.name(), Category::Index, format, index.texels())?;
    let buffers = |rays: &Vec<Ray>| {
        Ok((
            gpu.buffer_with("rays", Category::Work, rays)?,
            gpu.buffer_with("hits", Category::Work, &vec![0_u32; 4 * rays.len()])?,
            gpu.buffer_with("resume", Category::Work, &vec![0_u32; rays.len()])?,
            gpu.buffer_with("status", Category::Work, &[0_u32; 4])?,
            rays.len(),
        ))
    };
    let kinds = [buffers(&rays[0])?, buffers(&rays[1])?];
    Ok(Box::new(move |kind| {
        let (ray_buffer, hits, resume, status, count) = &kinds[kind];
        let set = trace_closest::Set0 {
            trace_rays: ray_buffer.view(),
            trace_hits: hits.view(),
            trace_resume: resume.view(),
            trace_status: status.view(),
        };
        let bvh2 = Bvh2Set {
            bvh2_quarters: &quarters,
        };
        let mut recorder = gpu.recorder("trace")?;
        recorder.pass("trace", |pass| {
            pass.fill(status.view(), 0)?;
            pass.fill(resume.view(), 0)?;
            pass.barrier(&[transfer_to_compute(status), transfer_to_compute(resume)]);
            let push = trace_closest::Push {
                first_ray: 0,
                ray_count: *count as u32,
            };
            pass.dispatch(
                &pipeline,
                &[&set, &bvh2],
                &push,
                [pipeline.groups_for(push.ray_count), 1, 1],
            )?;
            pass.barrier(&[rw_compute_to_compute(hits)]);
            Ok(())
        })?;
        let start = Instant::now();
        recorder.submit()?.wait()?;
        let seconds = start.elapsed().as_secs_f64();
        let unfinished = gpu.read::<trace_closest::TraceStatus>(status.view(), 1)?[0].unfinished;
        if unfinished > 0 {
            return Err(Error::setting("rays", unfinished, "did not end in one dispatch"));
        }
        let found = gpu.read::<Hit>(hits.view(), *count)?;
        Ok((seconds, found.iter().filter(|hit| hit.is_hit()).count()))
    }))
}

fn peer_ray(ray: &Ray) -> PeerRay {
    PeerRay::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max)
}

fn peer_triangle([a, b, c]: &[Vec3; 3]) -> Triangle {
    Triangle {
        v0: Vec3A::from(*a),
        v1: Vec3A::from(*b),
        v2: Vec3A::from(*c),
    }
}

/// The surface area cost as [`clerestory::accel::IndexStatistics`] has it.
fn peer_cost(tree: &PeerBvh2) -> f64 {
    let Some(root) = tree.nodes.first() else {
        return 0.0;
    };
    let weight = |count: u32| f64::from(count.max(1));
    let area = |node: &obvhs::bvh2::node::Bvh2Node| f64::from(node.aabb().half_area());
    let sum: f64 = tree.nodes.iter().map(|node| area(node) * weight(node.prim_count)).sum();
    sum / area(root)
}

/// All rays of a kind with all threads, and the number of hits.
fn in_parallel(rays: &[PeerRay], trace: impl Fn(&PeerRay) -> RayHit + Sync) -> (f64, usize) {
    let mut hits = vec![RayHit::none(); rays.len()];
    let start = Instant::now();
    hits.par_chunks_mut(CHUNK)
        .zip(rays.par_chunks(CHUNK))
        .for_each(|(hits, rays)| {
            for (hit, ray) in hits.iter_mut().zip(rays) {
                *hit = trace(ray);
            }
        });
    let seconds = start.elapsed().as_secs_f64();
    (seconds, hits.iter().filter(|hit| hit.t.is_finite()).count())
}

/// Triangles as the peer tests them fastest, in leaf order.
fn in_order(order: &[u32], triangles: &[Triangle]) -> Vec<RtTriangle> {
    order
        .iter()
        .map(|i| RtTriangle::from(&triangles[*i as usize]))
        .collect()
}

fn by_peer_bvh2<'a>(tree: PeerBvh2, triangles: &[Triangle], rays: &'a [Vec<PeerRay>; 2]) -> Trace<'a> {
    let ordered = in_order(&tree.primitive_indices, triangles);
    Box::new(move |kind| {
        Ok(in_parallel(&rays[kind], |ray| {
            let mut hit = RayHit::none();
            tree.ray_traverse(*ray, &mut hit, |ray, i| ordered[i].intersect(ray));
            hit
        }))
    })
}

fn by_peer_cwbvh<'a>(tree: CwBvh, triangles: &[Triangle], rays: &'a [Vec<PeerRay>; 2]) -> Trace<'a> {
    let ordered = in_order(&tree.primitive_indices, triangles);
    Box::new(move |kind| {
        Ok(in_parallel(&rays[kind], |ray| {
            let mut hit = RayHit::none();
            tree.ray_traverse(*ray, &mut hit, |ray, i| ordered[i].intersect(ray));
            hit
        }))
    })
}
