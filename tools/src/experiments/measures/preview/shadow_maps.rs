//! Omnidirectional shadow maps as cubes and as octahedra: how often they are wrong by how many texels they have, and what they cost, beside
//! shadow rays for the same places in the same run.
//!
//! Sources: L. Williams, SIGGRAPH 1978; T. Engelhardt and C. Dachsbacher, VMV 2008. Oracle: a ray from each place to the light.

use clerestory::accel::bvh2::Bvh2;
use clerestory::accel::offset::{offset_ray_origin, scene_reach, surface_point};
use clerestory::accel::trace::{Query, RayTracer, TraceSettings};
use clerestory::accel::{NO_HIT, Ray};
use clerestory::gpu::Gpu;
use clerestory::gpu::shaders::types::SceneTriangle;
use clerestory::raster::{OmniShadowDesc, OmniShadowMaps, ShadowLayout, ShadowPlace};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::Vec3;

use crate::experiments::measures::Context;
use crate::experiments::table::Table;
use crate::random::Random;
use crate::timing::{median, repeated};

/// Scenes, and the light's place as a share of the box around each.
const SCENES: [(&str, Vec3); 5] = [
    ("builtin:triangle-soup?n=400", Vec3::new(0.51, 0.49, 0.52)),
    ("builtin:box-city?n=60", Vec3::new(0.55, 0.6, 0.52)),
    ("builtin:divider-room", Vec3::new(0.3, 0.5, 0.4)),
    ("builtin:cornell-box", Vec3::new(0.5, 0.9, 0.55)),
    ("builtin:conference", Vec3::new(0.45, 0.85, 0.55)),
];
/// Texels along a side of a cube's faces; octahedra have as many in all.
const SIDES: [u32; 6] = [32, 64, 128, 256, 512, 1024];
const PLACES: usize = 200_000;
/// Draws a place, until one faces the light.
const DRAWS: usize = 100;
const REPEATS: usize = 5;
/// Width of the filter that is compared with none.
const WIDTH: u32 = 2;

/// A scene, places on its surfaces and what rays say of them.
struct Subject {
    scene: GpuScene,
    places: Vec<ShadowPlace>,
    light: Vec3,
    lit: Vec<bool>,
    /// Seconds of a ray.
    ray: f64,
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
    fn new(gpu: &Gpu, address: &str, share: Vec3, context: &Context<'_>) -> Result<Self> {
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
        let count = if context.smoke { 2000 } else { PLACES };
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
        let (hits, seconds) = repeated(if context.smoke { 1 } else { REPEATS }, || {
            let traced = tracer.trace(&rays)?;
            let seconds = traced.seconds();
            Ok::<_, clerestory::Error>((traced.hits, seconds))
        })?;
        Ok(Self {
            light,
            lit: hits.iter().map(|hit| hit.triangle == NO_HIT).collect(),
            ray: median(seconds) / places.len() as f64,
            places,
            scene,
        })
    }

    /// Share of places that light reaches.
    fn lit_share(&self) -> f64 {
        self.lit.iter().filter(|lit| **lit).count() as f64 / self.lit.len() as f64
    }
}

/// What a map is worth and costs.
struct Found {
    texels: u64,
    /// Share of places that are wrong.
    wrong: f64,
    /// Mean difference of the filtered share.
    filtered: f64,
    /// Seconds.
    draw: f64,
    look_up: f64,
    filter: f64,
}

fn run(gpu: &Gpu, subject: &Subject, layout: ShadowLayout, side: u32, repeats: usize) -> Result<Found> {
    let surfaces = subject.scene.surfaces();
    let desc = OmniShadowDesc { layout, side, maps: 1 };
    let maps = OmniShadowMaps::new(gpu, &surfaces, desc)?;
    let ((), draws) = repeated(repeats, || {
        let mut recorder = gpu.recorder("shadow map")?;
        maps.record(&mut recorder, &surfaces, &[subject.light])?;
        let seconds = recorder.submit()?.wait()?.seconds();
        Ok::<_, clerestory::Error>(((), seconds))
    })?;
    let look_ups = |width| {
        repeated(repeats, || {
            let (shares, timings) = maps.look_up_timed(0, subject.light, width, &subject.places)?;
            Ok::<_, clerestory::Error>((shares, timings.seconds()))
        })
    };
    let (plain, plain_seconds) = look_ups(0)?;
    let (smooth, smooth_seconds) = look_ups(WIDTH)?;
    let count = subject.places.len() as f64;
    let off = |shares: &[f32]| {
        let pairs = shares.iter().zip(&subject.lit);
        let sum: f64 = pairs
            .map(|(share, lit)| (f64::from(*share) - f64::from(u8::from(*lit))).abs())
            .sum();
        sum / count
    };
    Ok(Found {
        texels: desc.texels(),
        wrong: off(&plain),
        filtered: off(&smooth),
        draw: median(draws),
        look_up: median(plain_seconds) / count,
        filter: median(smooth_seconds) / count,
    })
}

/// Slope of errors against texels along a side, both in logarithms.
fn rate(line: &[Found]) -> f64 {
    let points: Vec<_> = line
        .iter()
        .filter(|found| found.wrong > 0.0)
        .map(|found| ((found.texels as f64).sqrt().ln(), found.wrong.ln()))
        .collect();
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |(xy, xx), p| {
        (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x).powi(2))
    });
    xy / xx
}

/// What was measured, beside what is expected of borders as wide as texels, and of the layouts.
fn slopes_and_ratios(slopes: &[f64], ratios: &[f64]) -> String {
    let range = |values: &[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        format!("from {low:.2} to {high:.2}")
    };
    let within = ratios.iter().filter(|ratio| (0.8..=1.2).contains(*ratio)).count();
    format!(
        "Slopes are {} (−1 is that of errors as wide as a texel); an octahedron's error is {} of that of the cube of as many texels, and within a fifth of it, \
         as the document expects, in {within} of {} scenes.",
        range(slopes),
        range(ratios),
        ratios.len()
    )
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let (sides, repeats) = if context.smoke {
        (&SIDES[..2], 1)
    } else {
        (&SIDES[..], REPEATS)
    };
    let own: Vec<(String, Vec3)> = if context.scenes.is_empty() {
        let count = if context.smoke { 1 } else { SCENES.len() };
        SCENES[..count]
            .iter()
            .map(|(address, share)| ((*address).to_owned(), *share))
            .collect()
    } else {
        let middle = Vec3::new(0.5, 0.6, 0.5);
        context.scenes.iter().map(|address| (address.clone(), middle)).collect()
    };
    let mut all = Table::new(
        "Shadow maps of one light",
        &[
            "scene",
            "layout",
            "texels",
            "lit places",
            "wrong places",
            "mean difference, filtered",
            "draw (ms)",
            "look-up (ns)",
            "filtered look-up (ns)",
            "shadow ray (ns)",
        ],
    );
    let mut rates = Table::new(
        "Rates of errors, and octahedra beside cubes",
        &[
            "scene",
            "slope by texels along a side, cube",
            "octahedron",
            "octahedron's error over the cube's (geometric mean)",
            "its time to draw over the cube's (geometric mean)",
        ],
    );
    let (mut slopes, mut ratios) = (Vec::new(), Vec::new());
    for (address, share) in &own {
        let subject = Subject::new(&gpu, address, *share, context)?;
        let mut lines = [Vec::new(), Vec::new()];
        for cube in sides {
            for (line, layout) in lines.iter_mut().zip(ShadowLayout::ALL) {
                let side = layout.side_for(6 * u64::from(*cube) * u64::from(*cube));
                let found = run(&gpu, &subject, layout, side, repeats)?;
                all.row([
                    address.as_str().into(),
                    layout.name().into(),
                    found.texels.into(),
                    subject.lit_share().into(),
                    found.wrong.into(),
                    found.filtered.into(),
                    (1e3 * found.draw).into(),
                    (1e9 * found.look_up).into(),
                    (1e9 * found.filter).into(),
                    (1e9 * subject.ray).into(),
                ]);
                line.push(found);
            }
        }
        let mean = |of: fn(&Found) -> f64| {
            let pairs = lines[0].iter().zip(&lines[1]);
            let logs: Vec<f64> = pairs
                .map(|(cube, octahedron)| (of(octahedron) / of(cube)).ln())
                .filter(|log| log.is_finite())
                .collect();
            (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp()
        };
        let both = [rate(&lines[0]), rate(&lines[1])];
        let ratio = mean(|found| found.wrong);
        slopes.extend(both);
        ratios.push(ratio);
        rates.row([
            address.as_str().into(),
            both[0].into(),
            both[1].into(),
            ratio.into(),
            mean(|found| found.draw).into(),
        ]);
    }
    all.note(format!(
        "Places are spread evenly over what turns its outer side to the light, {PLACES} a scene (bottoms and insides of bodies are none); light reaches the \
         share of them that is lit; a place is wrong where the nearest texel says otherwise than the ray from it to the light. \
         The filter averages {WIDTH} texels each way. Times are of the device's timestamps, medians of {REPEATS}; rays are traced by the same device, one an \
         invocation, through the binary hierarchy, and look-ups are of the same places. A cube is drawn by one draw of six instances where the device can, an \
         octahedron by one draw of eight."
    ));
    rates.note(slopes_and_ratios(&slopes, &ratios));
    Ok(vec![all, rates])
}
