//! Glossy reflections of a map under glossiness that varies from pixel to pixel: one and several boxes of a summed-area table and prefiltered
//! levels against the lobe's own integral; what tables cost, and how exact their numbers are.
//!
//! Source: T. Engelhardt, PhD thesis, KIT, 2013, §7.2.2 and Fig. 7.6. Oracle: the sum over all texels in f64, and means of boxes in f64.

use clerestory::Result;
use clerestory::film::png::{self, Rgb8};
use clerestory::film::{Picture, ToneMap};
use clerestory::gpu::{Gpu, compute_to_transfer, rw_compute_to_compute};
use clerestory::maps::box_lobe::{Lobe, RING_BOXES, WeightedBox, box_lobe, ring_lobe};
use clerestory::maps::directional_map::DirectionalMap;
use clerestory::maps::prefilter::{PrefilterGgx, ggx_mean, ggx_solid_angle, weighted_texels};
use clerestory::maps::spherical_sat::{SatImage, SatNumbers, SatRange, SphericalSat, sat_half_width};
use clerestory::maps::{MapImage, Parametrization};
use clerestory::techniques::preview::probe::probe_level;
use glam::{DVec3, DVec4, UVec2, Vec3, Vec4};
use rayon::prelude::*;
use std::f64::consts::PI;

use super::sphere::{Sphere, sheet};
use crate::experiments::measures::{Context, clock};
use crate::experiments::table::{Cell, Table};
use crate::random::Random;

const MAP: Parametrization = Parametrization::OctahedronQuadratic;
/// Rows of the map that is reflected, and of those of which tables are timed.
const TEXELS: u32 = 128;
const SIZES: [u32; 4] = [64, 128, 256, 512];
/// Prefiltered maps: evenly spaced in roughness √α.
const LEVELS: u32 = 6;
/// Least texels along a side of one.
const LEAST_FILTERED: u32 = 32;
const LEAST_ALPHA: f64 = 0.02;
const EYE: DVec3 = DVec3::new(1.0, 0.3, -0.35);
/// Steps of lobes whose boxes are about one middle.
const NESTED: [usize; 4] = [1, 2, 4, 8];
/// Steps of lobes of rings.
const RINGS: [usize; 4] = [1, 2, 3, 4];
/// Lobes between the least roughness and the greatest, of which each pixel takes the nearest.
const LOBES: usize = 65;
/// Milliseconds of the document for a table of 512² texels.
const STATED_MS: f64 = 3.3;

/// A sky with a sun, over ground of squares.
fn environment(d: DVec3) -> DVec3 {
    let sun = DVec3::new(0.8, 0.5, 0.35).normalize();
    let glow = (600.0 * (sun.dot(d) - 1.0)).exp();
    if d.z > 0.0 {
        return DVec3::new(0.25, 0.45, 0.9).lerp(DVec3::splat(0.9), (1.0 - d.z).powi(3))
            + 300.0 * glow * DVec3::new(1.0, 0.9, 0.7);
    }
    let ground = d.truncate() / (0.05 - d.z);
    let cell = (1.5 * ground).floor();
    let square = (cell.x + cell.y).rem_euclid(2.0);
    DVec3::new(0.6, 0.35, 0.15).lerp(DVec3::new(0.1, 0.25, 0.1), square)
}

fn image(rows: u32) -> Result<MapImage> {
    let size = UVec2::splat(rows);
    MapImage::from_fn(MAP, size, |texel| {
        MAP.texel_direction(size, texel).map_or(DVec3::ZERO, environment)
    })
}

fn filled(gpu: &Gpu, image: &MapImage, border: u32) -> Result<DirectionalMap> {
    let map = DirectionalMap::new(gpu, image.map(), image.size(), 1, border)?;
    map.upload(0, image)?;
    map.fill_levels()?;
    Ok(map)
}

/// Maps filtered by lobes of growing width.
struct Filtered {
    alphas: Vec<f32>,
    maps: Vec<DirectionalMap>,
}

impl Filtered {
    fn new(gpu: &Gpu, rows: u32) -> Result<Self> {
        let alpha = |level: u32| (f64::from(level) / f64::from(LEVELS - 1)).powi(2).max(LEAST_ALPHA);
        let alphas: Vec<f64> = (0..LEVELS).map(alpha).collect();
        let maps = alphas.iter().map(|alpha| {
            // Texels of at most half the lobe's width, as far as the source has so fine ones.
            let side = (2.0 * (4.0 * PI).sqrt() / alpha).ceil() as u32;
            let side = side.next_power_of_two().max(LEAST_FILTERED).min(rows);
            DirectionalMap::new(gpu, MAP, UVec2::splat(side), 1, 1)
        });
        Ok(Self {
            maps: maps.collect::<Result<_>>()?,
            alphas: alphas.iter().map(|alpha| *alpha as f32).collect(),
        })
    }

    fn fill(&self, gpu: &Gpu, source: &DirectionalMap) -> Result<()> {
        let filter = PrefilterGgx::new(gpu, source)?;
        for (map, alpha) in self.maps.iter().zip(&self.alphas) {
            let mut recorder = gpu.recorder("prefilter")?;
            recorder.pass("prefilter", |pass| {
                filter.record(pass, (source, 0), (map, 0), *alpha)?;
                pass.barrier(&[rw_compute_to_compute(map.texels())]);
                map.record_border(pass, 0)?;
                pass.barrier(&[compute_to_transfer(map.texels())]);
                Ok(())
            })?;
            recorder.submit()?.wait()?;
        }
        Ok(())
    }

    /// Mixtures of the two maps whose lobes are next to each pixel's.
    fn look_up(&self, pixels: &[Pixel]) -> Result<Vec<Vec3>> {
        let queries: Vec<Vec4> = pixels
            .iter()
            .map(|pixel| pixel.direction.as_vec3().extend(0.0))
            .collect();
        let held: Vec<Vec<Vec3>> = self
            .maps
            .iter()
            .map(|map| map.look_up(&queries))
            .collect::<Result<_>>()?;
        let last = self.maps.len() - 1;
        let mixed = pixels.iter().enumerate().map(|(at, pixel)| {
            let level = probe_level(&self.alphas, pixel.alpha);
            let fine = (level as usize).min(last);
            held[fine][at].lerp(held[(fine + 1).min(last)][at], level.fract() as f32)
        });
        Ok(mixed.collect())
    }

    /// Sides and widths in words.
    fn sizes(&self) -> String {
        let of = |(map, alpha): (&DirectionalMap, &f32)| {
            let side = map.size(0).map_or(0, |size| size.x);
            format!("{side}² for α = {}", Cell::from(f64::from(*alpha)))
        };
        let all: Vec<String> = self.maps.iter().zip(&self.alphas).map(of).collect();
        all.join(", ")
    }
}

/// A pixel of the sphere: where it looks, and how rough it is.
struct Pixel {
    at: usize,
    direction: DVec3,
    alpha: f64,
}

/// Roughness √α grows from left to right.
fn pixels(sphere: &Sphere) -> Vec<Pixel> {
    let all = (0..sphere.side).flat_map(|y| (0..sphere.side).map(move |x| (x, y)));
    all.filter_map(|(x, y)| {
        let p = sphere.place(x, y);
        Some(Pixel {
            at: (y * sphere.side + x) as usize,
            direction: sphere.mirrored(p)?,
            alpha: (0.5 + 0.5 * p.x).powi(2).max(LEAST_ALPHA),
        })
    })
    .collect()
}

fn truth(image: &MapImage, pixels: &[Pixel]) -> Vec<Vec3> {
    let texels = weighted_texels(image);
    let of = |pixel: &Pixel| ggx_mean(&texels, pixel.direction, pixel.alpha).as_vec3();
    pixels.par_iter().map(of).collect()
}

fn shown(side: u32, pixels: &[Pixel], values: &[Vec3]) -> Result<Rgb8> {
    let mut radiance = vec![1.0; 3 * (side * side) as usize];
    for (pixel, value) in pixels.iter().zip(values) {
        radiance[3 * pixel.at..3 * pixel.at + 3].copy_from_slice(&value.to_array());
    }
    let picture = Picture::from_radiance(side, side, radiance)?;
    Ok(png::tone_mapped(picture.main_layer()?, side, &ToneMap::default()))
}

/// RMS and mean of differences over the mean.
fn errors(values: &[Vec3], truth: &[Vec3]) -> [f64; 2] {
    let mean = truth.iter().map(|v| v.as_dvec3()).sum::<DVec3>().element_sum();
    let (mut squares, mut signed) = (0.0, 0.0);
    for (value, right) in values.iter().zip(truth) {
        let off = (*value - *right).as_dvec3();
        squares += off.length_squared();
        signed += off.element_sum();
    }
    let count = 3.0 * truth.len() as f64;
    let mean = mean / count;
    [(squares / count).sqrt() / mean, signed / count / mean]
}

fn reflections(context: &Context<'_>, gpu: &Gpu) -> Result<Table> {
    let (rows, side) = if context.smoke { (64, 24) } else { (TEXELS, 160) };
    let source = image(rows)?;
    let sphere = Sphere::new(EYE, side);
    let pixels = pixels(&sphere);
    let right = truth(&source, &pixels);
    let device = filled(gpu, &source, rows / 2)?;
    let table = SphericalSat::new(gpu, &device, SatNumbers::Fixed, SatRange::of(&source, true))?;
    table.fill(&device)?;
    let box_query = |pixel: &Pixel| {
        let half =
            sat_half_width(MAP, source.size(), pixel.direction, ggx_solid_angle(pixel.alpha)).unwrap_or_default();
        pixel.direction.as_vec3().extend(half as f32)
    };
    let boxes: Vec<Vec4> = pixels.iter().map(box_query).collect();
    let by_boxes = table.look_up(&boxes)?;
    let plain = filled(gpu, &source, 1)?;
    let levels = Filtered::new(gpu, rows)?;
    levels.fill(gpu, &plain)?;
    let by_levels = levels.look_up(&pixels)?;
    let [fill, filter] = [
        clock::seconds(context.smoke, || table.fill(&device))?,
        clock::seconds(true, || levels.fill(gpu, &plain))?,
    ];
    let mut found = Table::new(
        "Glossy reflections of one map",
        &[
            "look-up",
            "preparation (ms)",
            "RMS error over the mean",
            "mean error over it",
        ],
    );
    let mut row = vec![shown(side, &pixels, &right)?];
    let several: Vec<(Fit, Vec<Vec3>)> = fits()
        .map(|fit| Ok((fit, by_lobes(&table, &pixels, fit)?)))
        .collect::<Result<_>>()?;
    let mut ranking = Vec::new();
    let mut line = |name: String, seconds: f64, values: &[Vec3]| {
        let [rms, mean] = errors(values, &right);
        ranking.push((rms, name.clone()));
        found.row([name.into(), (1e3 * seconds).into(), rms.into(), mean.into()]);
    };
    line("one box of the lobe's variance".into(), fill, &by_boxes);
    for (fit, values) in &several {
        line(fit.name(), fill, values);
        if [SHOWN_NESTED, SHOWN_RINGS].contains(fit) {
            row.push(shown(side, &pixels, values)?);
        }
    }
    line("prefiltered levels".into(), filter, &by_levels);
    row.push(shown(side, &pixels, &by_levels)?);
    png::write(context.file("glossiness.png")?, &sheet(&[row]))?;
    found.note(format!(
        "A mirror sphere whose roughness √α grows from left to right (α from {LEAST_ALPHA} to 1) in an octahedron map of {rows} × {rows} texels with a \
         sun. Truth is the sum of the GGX lobe with n = v = r over all texels at each pixel; all look-ups stand for that lobe, and their error is that of \
         the boxes and of mixing two of {LEVELS} filtered maps, octahedra of {}, to the lobe that is nearest. One box holds the solid angle over which an even mean has the lobe's variance; several are \
         the staircase nearest to the lobe, of {LOBES} lobes even in roughness the nearest. The border is half the map. Times are by wall clock, medians, with submission; \
         all boxes need one table. Pictures beside this table, `glossiness.png`: truth, four boxes about one middle, four steps in rings, levels.",
        levels.sizes(),
    ));
    ranking.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ranking: Vec<String> = ranking
        .into_iter()
        .map(|(rms, name)| format!("{name} {}", Cell::from(rms)))
        .collect();
    found.note(format!("From the least RMS error: {}.", ranking.join("; ")));
    Ok(found)
}

/// The lobe of a number of all, even in roughness.
fn alpha_of_lobe(number: usize) -> f64 {
    (number as f64 / (LOBES - 1) as f64).powi(2).max(LEAST_ALPHA)
}

/// How a lobe is made of boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fit {
    /// So many about one middle.
    Nested(usize),
    /// So many steps, divided.
    Rings(usize),
}

const SHOWN_NESTED: Fit = Fit::Nested(4);
const SHOWN_RINGS: Fit = Fit::Rings(4);

fn fits() -> impl Iterator<Item = Fit> {
    NESTED
        .into_iter()
        .map(Fit::Nested)
        .chain(RINGS.into_iter().map(Fit::Rings))
}

impl Fit {
    fn boxes(self, lobe: Lobe) -> Result<Vec<WeightedBox>> {
        match self {
            Self::Nested(steps) => box_lobe(lobe, steps),
            Self::Rings(steps) => ring_lobe(lobe, steps),
        }
    }

    fn name(self) -> String {
        match self {
            Self::Nested(1) => "1 box".into(),
            Self::Nested(steps) => format!("{steps} boxes"),
            Self::Rings(steps) => format!("{} boxes in rings", RING_BOXES[0] + (steps - 1) * RING_BOXES[1]),
        }
    }
}

fn by_lobes(table: &SphericalSat, pixels: &[Pixel], fit: Fit) -> Result<Vec<Vec3>> {
    let lobes: Vec<Vec<WeightedBox>> = (0..LOBES)
        .map(|number| {
            fit.boxes(Lobe::Ggx {
                alpha: alpha_of_lobe(number),
            })
        })
        .collect::<Result<_>>()?;
    let query = |pixel: &Pixel| {
        let number = (pixel.alpha.sqrt() * (LOBES - 1) as f64).round() as usize;
        (pixel.direction.as_vec3(), number.min(LOBES - 1))
    };
    let queries: Vec<(Vec3, usize)> = pixels.iter().map(query).collect();
    table.look_up_lobes(&queries, &lobes)
}

/// Error of lobes by number of boxes and glossiness; and what of it is the staircase alone, with the caps that boxes stand for.
fn lobes(context: &Context<'_>) -> Result<Table> {
    let (rows, count) = if context.smoke { (48, 40) } else { (TEXELS, 1500) };
    let source = image(rows)?;
    // As far as boxes may reach at all.
    let sat = SatImage::new(&source, rows)?;
    let held = weighted_texels(&source);
    let mut random = Random::new(23);
    let directions: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
    let mut heads = vec!["lobe".to_owned(), "half of it within (degrees)".into()];
    heads.extend(fits().map(Fit::name));
    heads.extend(
        NESTED
            .iter()
            .map(|steps| format!("caps of {}", Fit::Nested(*steps).name())),
    );
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let mut table = Table::new("RMS error of lobes of boxes over the mean", &heads);
    let kinds = [0.03, 0.1, 0.2, 0.4, 0.7, 1.0].map(|alpha| (format!("GGX α = {alpha}"), Lobe::Ggx { alpha }));
    let others = [10.0, 100.0].map(|exponent| (format!("Phong n = {exponent}"), Lobe::Phong { exponent }));
    let all_lobes = kinds.len() + others.len();
    let asked = if context.smoke { 2 } else { all_lobes };
    for (done, (name, lobe)) in kinds.into_iter().chain(others).take(asked).enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(&name, done, asked);
        // By t = 1 − cos: what lies within each box's cap.
        let nested: Vec<Vec<WeightedBox>> = NESTED
            .iter()
            .map(|count| box_lobe(lobe, *count))
            .collect::<Result<_>>()?;
        let all_boxes: Vec<Vec<WeightedBox>> = fits().map(|fit| fit.boxes(lobe)).collect::<Result<_>>()?;
        let of = |d: &DVec3| -> Vec<Vec3> {
            let mut sums = vec![DVec4::ZERO; 1 + nested.iter().map(Vec::len).sum::<usize>()];
            for (other, value) in &held {
                let t = 0.5 * (*d - *other).length_squared();
                sums[0] += lobe.value(t) * *value;
                let caps = nested
                    .iter()
                    .flatten()
                    .map(|one| one.solid_angle / std::f64::consts::TAU);
                for (sum, cap) in sums[1..].iter_mut().zip(caps) {
                    *sum += if t < cap { *value } else { DVec4::ZERO };
                }
            }
            let mean = |sum: DVec4| {
                // A cap without a texel's middle is one of the texel at its own.
                let held = source.nearest(*d).map_or(DVec3::ZERO, |value| value.as_dvec3());
                if sum.w > 0.0 { sum.truncate() / sum.w } else { held }
            };
            let mut found = vec![mean(sums[0]).as_vec3()];
            let boxes = all_boxes
                .iter()
                .map(|fit| sat.sat_lobe(MAP, *d, fit).unwrap_or_default().as_vec3());
            found.extend(boxes);
            let mut next = 1;
            for fit in &nested {
                let parts = fit.iter().zip(&sums[next..]).map(|(one, sum)| one.weight * mean(*sum));
                found.push(parts.sum::<DVec3>().as_vec3());
                next += fit.len();
            }
            found
        };
        let all: Vec<Vec<Vec3>> = directions.par_iter().map(of).collect();
        let column = |at: usize| -> Vec<Vec3> { all.iter().map(|found| found[at]).collect() };
        let right = column(0);
        let mut row = vec![name.into(), half_angle(lobe).to_degrees().into()];
        row.extend((1..=all_boxes.len() + NESTED.len()).map(|at| errors(&column(at), &right)[0].into()));
        table.row(row);
    }
    table.note(format!(
        "At {count} uniform directions in the same environment, on {rows} × {rows} texels; f64 throughout. Truth is the lobe's sum over all texels, each by its middle. \
         Caps are round on the sphere and as large as the boxes: their error is that of the staircase alone, and what boxes have beyond it is that they are squares of \
         the map. A border as wide as the map holds every box."
    ));
    Ok(table)
}

/// The angle from a lobe's middle within which half of it lies.
fn half_angle(lobe: Lobe) -> f64 {
    const STEPS: u32 = 100_000;
    let at = |i: u32| (f64::from(i) / f64::from(STEPS)).powi(4);
    let parts = |i: u32| (at(i + 1) - at(i)) * lobe.value(0.5 * (at(i) + at(i + 1)));
    let whole: f64 = (0..STEPS).map(parts).sum();
    let mut sum = 0.0;
    let end = (0..STEPS).find(|i| {
        sum += parts(*i);
        sum >= 0.5 * whole
    });
    (1.0 - at(end.unwrap_or(STEPS))).acos()
}

fn numbers(context: &Context<'_>, gpu: &Gpu) -> Result<Table> {
    let mut found = Table::new(
        "Numbers of summed-area tables",
        &[
            "texels",
            "with border",
            "sums",
            "mean taken off",
            "table (MiB)",
            "fill (ms)",
            "greatest relative error of small boxes",
            "of boxes of a tenth",
        ],
    );
    let sizes = if context.smoke { &SIZES[..1] } else { &SIZES[..] };
    for (done, rows) in sizes.iter().copied().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context
            .watch
            .begin(&format!("tables of {rows}² texels"), done, sizes.len());
        let source = image(rows)?;
        let border = rows / 4;
        let device = filled(gpu, &source, border)?;
        let exact = SatImage::new(&source, border)?;
        let mut random = Random::new(19);
        let queries: Vec<[Vec4; 2]> = (0..500)
            .map(|_| {
                let d = random.direction().as_vec3();
                [1.0 / f64::from(rows), 0.05].map(|half| d.extend(half as f32))
            })
            .collect();
        let asked: Vec<Vec4> = queries.into_iter().flatten().collect();
        for kind in SatNumbers::ALL {
            for subtract in [false, true] {
                let table = SphericalSat::new(gpu, &device, kind, SatRange::of(&source, subtract))?;
                let seconds = clock::seconds(context.smoke, || table.fill(&device))?;
                let values = table.look_up(&asked)?;
                let mut worst = [0.0f64; 2];
                for (i, (query, value)) in asked.iter().zip(&values).enumerate() {
                    let Some(at) = MAP.encode(query.truncate().as_dvec3()) else {
                        continue;
                    };
                    let right = exact.sat_mean(at.uv, query.w.into());
                    let off = ((value.as_dvec3() - right) / right).abs().max_element();
                    worst[i % 2] = worst[i % 2].max(off);
                }
                let tile = f64::from(rows + 2 * border + 1);
                let name = match kind {
                    SatNumbers::Float => "32-bit float",
                    SatNumbers::TwoFloat => "two floats",
                    SatNumbers::Fixed => "64-bit integer",
                };
                found.row([
                    format!("{rows} × {rows}").into(),
                    format!("{0} × {0}", rows + 2 * border).into(),
                    name.into(),
                    (if subtract { "yes" } else { "no" }).into(),
                    (tile * tile * 32.0 / f64::from(1 << 20)).into(),
                    (1e3 * seconds).into(),
                    worst[0].into(),
                    worst[1].into(),
                ]);
            }
        }
    }
    found.note(format!(
        "The same scene; errors against tables in f64, of 500 boxes two texels wide and 500 a tenth of the map wide. All keep eight bytes a channel. \
         Places in the map are f32 and off by a few 10⁻⁷ of it, which the sun's edges turn into the error that is left. The document states {STATED_MS} ms \
         for a table of 512² texels on its device; here an invocation sums a line, which suits the software driver and not many lanes."
    ));
    Ok(found)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    context.watch.begin("reflections of a sphere", 0, 1);
    Ok(vec![
        reflections(context, &gpu)?,
        lobes(context)?,
        numbers(context, &gpu)?,
    ])
}
