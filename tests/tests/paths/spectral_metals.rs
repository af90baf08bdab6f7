//! Metals in bins of wavelengths, against closed forms: a trough of two smooth planes under a white sky, where each ray is reflected twice at 45 degrees.

use clerestory::gpu::Gpu;
use clerestory::render::spectral::{SpectralMetal, render_spectral};
use clerestory::render::{RenderOptions, render};
use clerestory::scene::metals::bins::Bins;
use clerestory::scene::metals::{self, IndexSpectrum};
use clerestory::scene::{Camera, Environment, Light, LightKind, Material, Medium, Mesh, Projection, Scene};
use clerestory::transport::fresnel::fresnel_conductor;
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3, Vec4};

/// Two planes of a metal at a right angle, seen from above, from afar, under a sky of radiance 1.
fn trough(spectrum: &IndexSpectrum, roughness: f32) -> Scene {
    let mut scene = Scene::default();
    let metal = scene.add_material(Material {
        roughness,
        conductor: Some(spectrum.channels()),
        ..Material::mirror("metal", Vec3::ONE)
    });
    let corner = |x: f32, z: f32| Vec3::new(x, x.abs(), z);
    scene.place(Mesh {
        name: "trough".into(),
        positions: [
            (-1.0, -1.0),
            (0.0, -1.0),
            (1.0, -1.0),
            (-1.0, 1.0),
            (0.0, 1.0),
            (1.0, 1.0),
        ]
        .map(|(x, z)| corner(x, z))
        .into(),
        triangles: vec![[0, 3, 1], [1, 3, 4], [1, 4, 2], [2, 4, 5]],
        material: Some(metal),
        ..Mesh::default()
    });
    scene.environment = Some(Environment::uniform(Vec3::ONE));
    scene.cameras.push(Camera {
        projection: Projection::Orthographic { half_height: 0.4 },
        ..Camera::look_at("main", DVec3::new(0.0, 3.0, 0.0), DVec3::ZERO, DVec3::NEG_Z, 1.0)
    });
    scene
}

fn options(spp: u32) -> RenderOptions {
    RenderOptions {
        size: [8, 4],
        spp,
        ..RenderOptions::default()
    }
}

/// All pixels of the picture in bins, and of the one in channels.
fn pictures(gpu: &Gpu, spectrum: &IndexSpectrum, roughness: f32, count: u32, spp: u32) -> [Vec<DVec3>; 2] {
    let scene = trough(spectrum, roughness);
    let metal = SpectralMetal {
        material: 0,
        spectrum: spectrum.clone(),
    };
    let bins = Bins::new(count).unwrap();
    let spectral = render_spectral(gpu, &scene, &[metal], &bins, &options(spp)).unwrap();
    assert_eq!(spectral.reports.len() as u32, count.div_ceil(3));
    assert_eq!(spectral.picture.metadata.other["bins"], count.to_string());
    let channels = render(gpu, &scene, &options(spp)).unwrap();
    [&spectral.picture, &channels.picture].map(|picture| {
        let pixels = picture.require("radiance").unwrap().pixels();
        pixels.map(|pixel| Vec3::from_array(pixel).as_dvec3()).collect()
    })
}

#[test]
fn bins_are_summed_to_the_colour_of_two_reflections() {
    with_gpu(|gpu| {
        for (name, count, channels_lose) in [
            ("copper", 8, 0.03..0.06),
            ("copper", 16, 0.03..0.06),
            ("silver", 8, 0.0..0.003),
        ] {
            let spectrum = metals::spectrum(name).unwrap();
            let twice = |wavelength: f64| {
                let [n, k] = spectrum.at(wavelength);
                let factor = fresnel_conductor(0.5f64.sqrt(), DVec3::splat(n), DVec3::splat(k)).x;
                factor * factor
            };
            let [spectral, channels] = pictures(gpu, &spectrum, 0.0, count, 2);
            let expected = Bins::new(count).unwrap().color(twice);
            for pixel in &spectral {
                let gap = (*pixel - expected).abs().max_element();
                assert!(gap < 2e-5, "{name}, {count}: {pixel}, not {expected}");
            }
            // What all bins of the observer's tables make of it.
            let truth = Bins::new(41).unwrap().color(twice);
            let lost = (channels[0] - truth).abs().max_element();
            assert!(channels_lose.contains(&lost), "{name}: channels lose {lost}");
            assert!((spectral[0] - truth).abs().max_element() < 0.02, "{name}, {count}");
        }
    });
}

#[test]
fn grey_metals_have_no_colour_in_bins() {
    with_gpu(|gpu| {
        let grey = IndexSpectrum::parse("380 1.4 6.2\n780 1.4 6.2").unwrap();
        // Rough: paths are chosen at random, by the same numbers in each pass.
        let [spectral, channels] = pictures(gpu, &grey, 0.4, 8, 4);
        for (spectral, channels) in spectral.iter().zip(&channels) {
            assert!(
                (*spectral - *channels).abs().max_element() < 1e-6,
                "{spectral} {channels}"
            );
        }
    });
}

#[test]
fn colours_without_a_spectrum_are_refused() {
    let spectrum = metals::spectrum("gold").unwrap();
    let metal = |material| SpectralMetal {
        material,
        spectrum: spectrum.clone(),
    };
    let scene = trough(&spectrum, 0.0);
    let tinted = Vec3::new(1.0, 0.9, 1.0);
    type Change<'a> = &'a dyn Fn(&mut Scene);
    let cases: [(&str, Change<'_>, &[SpectralMetal]); 9] = [
        ("materials[1]: is not there", &|_| (), &[metal(1)]),
        ("has two spectra", &|_| (), &[metal(0), metal(0)]),
        ("(metal): the conductor, which has no spectrum", &|_| (), &[]),
        (
            "(wall): has a spectrum, and no conductor",
            &|scene| {
                scene.add_material(Material::lambert("wall", Vec3::ONE));
            },
            &[metal(0), metal(1)],
        ),
        (
            "(wall): the base colour has a colour",
            &|scene| {
                scene.add_material(Material::lambert("wall", tinted));
            },
            &[metal(0)],
        ),
        (
            "lights[0] (lamp): has a colour",
            &|scene| {
                scene.lights.push(Light {
                    name: "lamp".into(),
                    kind: LightKind::Point {
                        position: Vec3::Y,
                        intensity: tinted,
                    },
                })
            },
            &[metal(0)],
        ),
        (
            "(uniform): has a colour",
            &|scene| scene.environment = Some(Environment::uniform(tinted)),
            &[metal(0)],
        ),
        (
            "meshes[0] (trough): a vertex has a colour",
            &|scene| scene.meshes[0].colors = vec![Vec4::new(1.0, 1.0, 0.5, 1.0); 6],
            &[metal(0)],
        ),
        (
            "media[0] (fog): has a colour",
            &|scene| {
                scene.media.push(Medium {
                    name: "fog".into(),
                    sigma_s: tinted,
                    ..Medium::default()
                })
            },
            &[metal(0)],
        ),
    ];
    with_gpu(|gpu| {
        let bins = Bins::new(8).unwrap();
        for (words, change, metals) in cases {
            let mut scene = scene.clone();
            change(&mut scene);
            let error = render_spectral(gpu, &scene, metals, &bins, &options(1)).unwrap_err();
            assert!(error.to_string().contains(words), "{words}: {error}");
        }
    });
}
