//! All metals by their Fresnel factor: by Schlick's curve, by the compensated one, by the exact one in three channels, and in bins of wavelengths.
//!
//! `metals [FILE] [--size WxH] [--spp N] [--bins N] [--roughness NUMBER]`
//!
//! Nine rings, each about a sphere of its metal that is exact above and takes the rescaled curve below: where light grazes it there is a step. From left to right the rings' factor is
//! Schlick's, compensated and exact, and last both are rendered in bins of wavelengths, three at a time, and summed as an observer does. All that is no metal is grey. What each picture
//! differs from the last one by is printed.
//!
//! Source: I. Lazányi, L. Szirmay-Kalos, "Fresnel Term Approximations for Metals", WSCG 2005.

use std::path::Path;
use std::process::ExitCode;

use clerestory::Result;
use clerestory::film::tone::{ToneCurve, ToneMap};
use clerestory::film::{Picture, png};
use clerestory::gpu::{Gpu, GpuOptions};
use clerestory::render::spectral::{SpectralMetal, render_spectral};
use clerestory::render::{RenderOptions, render};
use clerestory::scene::metals::{self, bins::Bins};
use clerestory::scene::{Camera, Environment, FresnelForm, Material, Mesh, Scene};
use clerestory_samples::arguments::Arguments;
use clerestory_samples::solids::{knot, sphere};
use glam::{DAffine3, DVec3, Quat, Vec3};

const METALS: [&str; 9] = [
    "silver",
    "aluminium",
    "chromium",
    "gold",
    "copper",
    "nickel",
    "iron",
    "titanium",
    "cobalt",
];
/// Metals side by side.
const COLUMNS: usize = 3;
/// From one metal to the next, metres.
const SPACING: f64 = 1.2;
/// Pixels of each picture, unless told otherwise.
const SIZE: [u32; 2] = [240, 240];
const SAMPLES: u32 = 64;
const BINS: u32 = 12;
const ROUGHNESS: f32 = 0.12;

fn main() -> ExitCode {
    clerestory_samples::run_with("metals", &["--size", "--spp", "--bins", "--roughness"], sample)
}

fn sample(path: &Path, arguments: &Arguments) -> Result<()> {
    let gpu = Gpu::headless(&GpuOptions::default())?;
    let options = RenderOptions {
        size: arguments.size("--size")?.unwrap_or(SIZE),
        spp: arguments.value("--spp")?.unwrap_or(SAMPLES),
        ..RenderOptions::default()
    };
    let roughness = arguments.value("--roughness")?.unwrap_or(ROUGHNESS);
    let bins = Bins::new(arguments.value("--bins")?.unwrap_or(BINS))?;
    let mut pictures = Vec::new();
    for form in [FresnelForm::Schlick, FresnelForm::Compensated, FresnelForm::Exact] {
        let (scene, _) = rings(form, roughness);
        pictures.push((form.name().to_owned(), render(&gpu, &scene, &options)?.picture));
    }
    let (scene, spectra) = rings(FresnelForm::Exact, roughness);
    let spectral = render_spectral(&gpu, &scene, &spectra, &bins, &options)?;
    pictures.push((format!("{} bins", bins.wavelengths().len()), spectral.picture));

    let layers = pictures.iter().map(|(_, picture)| Ok(picture.main_layer()?.values()));
    let layers: Vec<&[f32]> = layers.collect::<Result<_>>()?;
    if let Some((last, others)) = layers.split_last() {
        for ((name, _), values) in pictures.iter().zip(others) {
            println!(
                "{name}: differs from bins of wavelengths by {:.2} % of their mean",
                100.0 * difference(values, last)
            );
        }
    }
    let [width, height] = options.size;
    let row = 3 * width as usize;
    let rows = (0..height as usize).flat_map(|y| layers.iter().map(move |values| &values[y * row..(y + 1) * row]));
    let strip: Vec<f32> = rows.flatten().copied().collect();
    let strip = Picture::from_radiance(layers.len() as u32 * width, height, strip)?;
    let tone = ToneMap {
        exposure: 0.0,
        curve: ToneCurve::PbrNeutral,
    };
    clerestory_samples::make_folder(path)?;
    png::write(path, &png::tone_mapped(strip.main_layer()?, strip.width(), &tone))?;
    clerestory_samples::check_messages(&gpu.validation_log())
}

/// Rings of this form, each about a sphere that is exact above and rescaled below, on a grey floor under a grey sky; and the metals' spectra.
fn rings(form: FresnelForm, roughness: f32) -> (Scene, Vec<SpectralMetal>) {
    let mut scene = Scene {
        name: "metals".into(),
        source: "metals".into(),
        ..Scene::default()
    };
    let mut spectra = Vec::new();
    let ring = knot([1, 0], 0.46, 0.0, 0.09, [96, 32]);
    let halves = split(&sphere(0.3, 96));
    for (i, name) in METALS.into_iter().enumerate() {
        let Some(spectrum) = metals::spectrum(name) else {
            continue;
        };
        let place = DVec3::new((i % COLUMNS) as f64 - 1.0, 0.0, (i / COLUMNS) as f64 - 1.0) * SPACING;
        let parts = [
            (&ring, form, 0.09),
            (&halves[0], FresnelForm::Exact, 0.3),
            (&halves[1], FresnelForm::Rescaled, 0.3),
        ];
        for (mesh, fresnel, height) in parts {
            let material = scene.add_material(Material {
                roughness,
                fresnel,
                conductor: Some(spectrum.channels()),
                ..Material::mirror(format!("{name}, {fresnel}"), Vec3::ONE)
            });
            spectra.push(SpectralMetal {
                material,
                spectrum: spectrum.clone(),
            });
            scene.place(Mesh {
                material: Some(material),
                ..mesh.clone()
            });
            if let Some(instance) = scene.instances.last_mut() {
                instance.transform = DAffine3::from_translation(place + height * DVec3::Y);
            }
        }
    }
    let floor = scene.add_material(Material::lambert("floor", Vec3::splat(0.25)));
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    scene.place(Mesh {
        name: "floor".into(),
        positions: vec![
            corner(-6.0, 6.0),
            corner(6.0, 6.0),
            corner(6.0, -6.0),
            corner(-6.0, -6.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(floor),
        ..Mesh::default()
    });
    scene.environment = Some(sky());
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.0, 3.6, 4.6),
        DVec3::new(0.0, 0.1, 0.15),
        DVec3::Y,
        36f32.to_radians(),
    ));
    (scene, spectra)
}

/// Brighter above, and brightest in a window to the left: grey in all.
fn sky() -> Environment {
    const SIZE: [u32; 2] = [64, 32];
    let [width, height] = SIZE;
    let texel = |i: u32| {
        let [x, y] = [i % width, i / width];
        let is_window = (width / 8..width / 4).contains(&x) && (height / 8..3 * height / 8).contains(&y);
        let above = 1.0 - y as f32 / height as f32;
        Vec3::splat(if is_window { 9.0 } else { 0.2 + 0.6 * above * above })
    };
    Environment {
        name: "grey sky".into(),
        width,
        height,
        radiance: (0..width * height).map(texel).collect(),
        rotation: Quat::IDENTITY,
        strength: 1.0,
    }
}

/// The upper and the lower half of a mesh about the origin.
fn split(mesh: &Mesh) -> [Mesh; 2] {
    let height = |t: &[u32; 3]| t.iter().map(|i| mesh.positions[*i as usize].y).sum::<f32>();
    let half = |upper: bool| Mesh {
        triangles: mesh
            .triangles
            .iter()
            .filter(|t| (height(t) > 0.0) == upper)
            .copied()
            .collect(),
        ..mesh.clone()
    };
    [half(true), half(false)]
}

/// Mean size of the differences over the mean of what is expected.
fn difference(found: &[f32], expected: &[f32]) -> f64 {
    let sizes = found.iter().zip(expected).map(|(a, b)| f64::from((a - b).abs()));
    sizes.sum::<f64>() / expected.iter().map(|value| f64::from(*value)).sum::<f64>()
}
