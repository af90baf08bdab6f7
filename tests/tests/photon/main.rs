//! Photon mapping against closed forms, exact counts, and the path tracer on equal path sets.
//!
//! Photons are shared by all pixels of a pass, so pixels are correlated and the film's variance says nothing of a mean over the picture.
//! Means are judged from passes instead, which are independent of each other (PCG, one eye path per pixel and pass) and, with kernels that do not
//! shrink, alike: the picture is read after each pass, and means over parts of it are tested by Student's t over the passes, at a false-alarm
//! rate of 10⁻⁶ a channel and part. Where a difference is allowed besides, its reason stands with it. Each test prints what it found, for
//! `--nocapture`.

mod convergence;
mod determinism;
mod flux;
mod footprints;
mod furnace;
mod glow;
mod grid_transmittance;
mod lights;
mod maps;
mod materials;
mod neighbours;
mod planes;
mod queues;
mod scale;
mod settings;
mod shared_paths;
mod short_beams;
mod sphere;
mod traps;
mod unified;
mod volume;
mod volume_counts;
mod volume_extremes;
mod volume_footprints;
mod volume_kernels;
mod volume_queues;
mod volume_refusals;
mod volume_stages;
mod volume_truths;
mod without;

use std::f64::consts::PI;

use clerestory::gpu::Gpu;
use clerestory::scene::{LightKind, Material, Mesh, Scene};
use clerestory::techniques::photon_mapping::kernel::{KernelProfile, KernelShape};
use clerestory::techniques::photon_mapping::{MapQuery, MapperCounts, PhotonMapper, PhotonSettings};
use clerestory::transport::PathSet;
use clerestory::transport::random::SamplerKind;
use clerestory_tests::render::{Rendered, camera_down, floor, paths, render, upload};
use clerestory_tests::statistics::{expect_mean, normal_of_t};
use glam::Vec3;

/// Pixels per side.
const SIDE: u32 = 16;
const SIZE: [u32; 2] = [SIDE; 2];

/// Kernels that do not shrink, independent samples, a path set.
fn settings(set: &str) -> PhotonSettings {
    PhotonSettings {
        path_set: set.parse::<PathSet>().unwrap_or_else(|error| panic!("{error}")),
        photons: 1 << 13,
        reduction: 1.0,
        sampler: SamplerKind::Pcg,
        seed: 11,
        ..PhotonSettings::default()
    }
}

/// [`settings`] with fixed kernels of a radius.
fn fixed(set: &str, radius: f32) -> PhotonSettings {
    PhotonSettings {
        radius,
        ..settings(set)
    }
}

fn mapper(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings) -> PhotonMapper {
    match PhotonMapper::new(gpu, upload(gpu, scene), &scene.cameras[0], SIZE, settings.clone()) {
        Ok(mapper) => mapper,
        Err(error) => panic!("{}: {error}", scene.name),
    }
}

/// Goes on to that many samples per pixel, and reads radiance.
fn advance(mapper: &mut PhotonMapper, samples: u32) -> Vec<f32> {
    while mapper.step(samples).unwrap_or_else(|error| panic!("{error}")).is_some() {}
    let (picture, non_finite) = mapper.picture().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(non_finite.total(), 0, "samples that are not finite");
    let radiance = picture
        .layer("radiance")
        .map_or_else(Vec::new, |layer| layer.values().to_vec());
    assert!(
        radiance.len() == 3 * (SIDE * SIDE) as usize && radiance.iter().all(|v| v.is_finite() && *v >= 0.0),
        "radiance"
    );
    radiance
}

/// A picture of so many passes.
fn photons(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, passes: u32) -> Vec<f32> {
    advance(&mut mapper(gpu, scene, settings), passes)
}

/// Bits of a picture.
fn bits(radiance: &[f32]) -> Vec<u32> {
    radiance.iter().map(|v| v.to_bits()).collect()
}

/// Parts of a picture: all of it, and its quarters.
const PARTS: [&str; 5] = ["all", "upper left", "upper right", "lower left", "lower right"];

fn belongs(part: usize, pixel: usize) -> bool {
    let half = (SIDE / 2) as usize;
    let (right, lower) = (pixel % SIDE as usize >= half, pixel / SIDE as usize >= half);
    part == 0 || part - 1 == usize::from(right) + 2 * usize::from(lower)
}

/// Sums over parts of a picture, by part and channel.
fn sums(values: &[f32]) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0; 3]; PARTS.len()];
    for (pixel, value) in values.chunks(3).enumerate() {
        for (part, sum) in sums.iter_mut().enumerate() {
            if belongs(part, pixel) {
                (0..3).for_each(|c| sum[c] += f64::from(value[c]));
            }
        }
    }
    sums
}

fn pixels(part: usize) -> f64 {
    (0..(SIDE * SIDE) as usize)
        .filter(|pixel| belongs(part, *pixel))
        .count() as f64
}

/// A mean with the variance of it.
#[derive(Debug, Clone, Copy)]
struct Mean {
    value: f64,
    variance: f64,
}

/// Means over the parts of a picture.
struct Means {
    parts: Vec<[Mean; 3]>,
    counts: MapperCounts,
    /// Degrees of freedom of the variances.
    degrees: f64,
}

/// Standard errors that a mean of a fixed seed may be off by where a test says how large they are: one right estimate in 370 is, of a normal distribution.
const STANDARD_ERRORS: f64 = 3.0;

/// Means over parts from passes of one rendering.
fn means(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, passes: u32) -> Means {
    assert!(settings.samples_per_pass == 1 && settings.reduction == 1.0);
    let mut mapper = mapper(gpu, scene, settings);
    let mut before = vec![[0.0; 3]; PARTS.len()];
    let mut seen = vec![[(0.0, 0.0); 3]; PARTS.len()];
    for pass in 1..=passes {
        let now: Vec<[f64; 3]> = sums(&advance(&mut mapper, pass));
        for (part, seen) in seen.iter_mut().enumerate() {
            for c in 0..3 {
                let total = now[part][c] * f64::from(pass);
                let mean = (total - before[part][c]) / pixels(part);
                before[part][c] = total;
                seen[c].0 += mean;
                seen[c].1 += mean * mean;
            }
        }
    }
    let n = f64::from(passes);
    let mean = |(sum, squares): (f64, f64)| Mean {
        value: sum / n,
        variance: ((squares - sum * sum / n) / (n * (n - 1.0))).max(0.0),
    };
    Means {
        parts: seen.iter().map(|channels| channels.map(mean)).collect(),
        counts: mapper.counts(),
        degrees: n - 1.0,
    }
}

impl Means {
    /// Fails unless a part has the expectation `expected` up to a relative bias; `noise` is the variance of the expectation.
    ///
    /// The variance of the passes' mean is taken wider, such that Student's t of its degrees of freedom becomes standard normal.
    fn expect(&self, what: &str, part: usize, channel: usize, expected: Mean, bias: f64) {
        let mean = self.parts[part][channel];
        let what = format!("{what}, {}, channel {channel}", PARTS[part]);
        let allowed = bias * expected.value;
        let deviation = (mean.variance + expected.variance).sqrt();
        let excess = ((mean.value - expected.value).abs() - allowed).max(0.0);
        println!(
            "{what}: {:.6} ± {:.1e}, expected {:.6} ± {:.1e}, ratio {:.4}, {:.2} sigma beyond {bias:.1e}",
            mean.value,
            mean.variance.sqrt(),
            expected.value,
            expected.variance.sqrt(),
            mean.value / expected.value,
            excess / deviation,
        );
        let t = excess / deviation;
        if t > 0.0 {
            expect_mean(&what, normal_of_t(t, self.degrees), 1.0, 0.0, 0.0);
        }
    }

    /// Fails unless the first part's first channel is within [`STANDARD_ERRORS`] of what is expected, beside a relative bias, with standard errors below a share of that. Returns
    /// the mean and its standard error.
    fn expect_closely(&self, what: &str, expected: f64, bias: f64, most: f64) -> (f64, f64) {
        let (mean, error) = (self.parts[0][0].value, self.parts[0][0].variance.sqrt());
        let off = ((mean - expected).abs() - bias * expected).max(0.0);
        let said = format!(
            "{what}: {mean:.7} ± {error:.1e}, expected {expected:.7}, ratio {:.4} ± {:.4}, {:.2} standard errors beyond {bias:.1e}",
            mean / expected,
            error / expected,
            off / error,
        );
        println!("{said}");
        assert!(off < STANDARD_ERRORS * error, "{said}");
        assert!(error < most * expected, "{said}: more than {most} of it");
        (mean, error)
    }

    /// Fails unless all parts have this expectation.
    fn expect_uniform(&self, what: &str, expected: f64, bias: f64) {
        let expected = Mean {
            value: expected,
            variance: 0.0,
        };
        for part in 0..PARTS.len() {
            (0..3).for_each(|channel| self.expect(what, part, channel, expected, bias));
        }
    }

    /// Fails unless all parts agree with a picture of the path tracer, whose pixels are independent.
    fn expect_same_as(&self, what: &str, reference: &Rendered, bias: [f64; 3]) {
        let (values, variances) = (sums(&reference.radiance), sums(&reference.variance));
        for part in 0..PARTS.len() {
            for channel in 0..3 {
                let expected = Mean {
                    value: values[part][channel] / pixels(part),
                    variance: variances[part][channel] / (pixels(part) * pixels(part)),
                };
                self.expect(what, part, channel, expected, bias[channel]);
            }
        }
    }
}

/// The path tracer's picture of a path set.
fn traced(gpu: &Gpu, scene: &Scene, set: &str, samples: u32) -> Rendered {
    render(gpu, scene, SIZE, samples, &paths(set))
}

/// Fails unless the picture of a path set agrees with the path tracer's.
fn expect_agreement(
    gpu: &Gpu,
    scene: &Scene,
    settings: &PhotonSettings,
    [passes, samples]: [u32; 2],
    bias: [f64; 3],
) -> MapperCounts {
    let set = settings.path_set.to_string();
    let found = means(gpu, scene, settings, passes);
    found.expect_same_as(
        &format!("{}, {set}", scene.name),
        &traced(gpu, scene, &set, samples),
        bias,
    );
    found.counts
}

/// A floor of 4 m × 4 m seen from straight above over 1.6 m × 1.6 m, with a wall of another colour beside what is seen, 3 m long and 1 m high.
fn floor_and_wall(name: &str, floor_material: Material, wall: Material) -> Scene {
    let mut scene = Scene {
        name: name.into(),
        ..Scene::default()
    };
    let under = scene.add_material(floor_material);
    let beside = scene.add_material(wall);
    scene.place(floor("floor", under, 2.0, 0.0));
    scene.place(upright("wall", beside, -1.0, 1.5));
    scene.cameras.push(camera_down(0.8, 5.0));
    scene
}

/// A wall across x, from the floor to 1 m, `half` long on both sides of z = 0, facing +x.
fn upright(name: &str, material: u32, x: f32, half: f32) -> Mesh {
    Mesh {
        name: name.into(),
        positions: vec![
            Vec3::new(x, 0.0, half),
            Vec3::new(x, 0.0, -half),
            Vec3::new(x, 1.0, -half),
            Vec3::new(x, 1.0, half),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(material),
        ..Mesh::default()
    }
}

/// A square at `centre` across the axis −y (or +y), `half` to each side.
fn ceiling(name: &str, material: u32, centre: Vec3, half: f32, down: bool) -> Mesh {
    let mut mesh = floor(name, material, half, 0.0);
    for position in &mut mesh.positions {
        *position += centre;
    }
    if down {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    mesh
}

/// Adds a point light of a power in W.
fn add_point(scene: &mut Scene, position: Vec3, power: Vec3) {
    let intensity = power * (0.25 / PI) as f32;
    scene.add_light("point", LightKind::Point { position, intensity });
}
