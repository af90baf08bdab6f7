//! Probes that are cubes, beside octahedra: with half as many texels along a side they have one and a half times as many.

use clerestory::Error;
use clerestory::maps::impostor::ImpostorSettings;
use clerestory::scene::Material;
use clerestory::techniques::preview::{
    LightProbe, LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewPart, ProbeMap, SearchedReflections,
};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3, Vec4};

use crate::light::{PROBE, normals, picture_by, pixels, sphere_under};
use crate::live::{face, is_at_edge, live, room};
use crate::subject::Subject;

/// The cube beside [`PROBE`].
const CUBE: LightProbeDesc = LightProbeDesc {
    map: ProbeMap::Cube,
    side: 128,
    finest: 64,
};

/// The greatest difference of two colours over the greater one's greatest channel.
fn difference(a: Vec3, b: Vec3) -> f32 {
    (a - b).abs().max_element() / a.max(b).max_element()
}

/// Drawn in a closed room, both show the same at all roughnesses: mirrors what rays meet, but for texels at edges, and rough ones light that differs by look-ups between their texels alone.
#[test]
fn live_cubes_show_what_octahedra_do() {
    with_gpu(|gpu| {
        let (scene, colors) = room();
        let subject = Subject::new(gpu, &scene);
        let place = Vec3::new(0.2, -0.3, 0.1);
        let [octahedron, cube] = [PROBE, CUBE].map(|desc| live(gpu, &subject, desc, place));
        let alphas = [&octahedron, &cube].map(|live| live.probe().alphas().to_vec());
        let levels = alphas[0].len();
        assert_eq!(levels, alphas[1].len());
        let mut random = Random(71);
        let directions: Vec<Vec3> = (0..2000).map(|_| random.direction()).collect();
        let look_up = |live: &LiveProbe, level: usize| {
            let queries: Vec<Vec4> = directions.iter().map(|d| d.extend(level as f32)).collect();
            live.probe().filtered().look_up(&queries).unwrap()
        };
        let mirrored = look_up(&cube, 0);
        let mut inside = 0;
        for (direction, value) in directions.iter().zip(&mirrored) {
            let (from, d) = (place.as_dvec3(), direction.as_dvec3());
            if is_at_edge(from, d, PROBE.side) {
                continue;
            }
            inside += 1;
            let exact = colors[face(from, d).0];
            assert!(
                (*value - exact).abs().max_element() < 1e-6,
                "{d}: {value} instead of {exact}"
            );
        }
        assert!(inside > 1500, "{inside}");
        // The finest level holds what one texel sees; those after it are filtered.
        assert_eq!(alphas[0][1..], alphas[1][1..]);
        for (level, alpha) in alphas[0].iter().enumerate().skip(1) {
            let [a, b] = [&octahedron, &cube].map(|live| look_up(live, level));
            let worst = a.iter().zip(&b).map(|(a, b)| difference(*a, *b)).fold(0.0, f32::max);
            println!("level {level}, alpha {alpha}: {worst:.4}");
            // Texels are up to 0.27 and 0.13 apart in the last level, and half as far at a third of the width in each one before.
            assert!(worst < 0.05, "level {level}: {worst}");
        }
    });
}

/// Under skies with closed forms: bounds are those of octahedra, and what a corner of the cube adds, where three texels share a look-up.
#[test]
fn cubes_light_surfaces_as_their_skies_do() {
    with_gpu(|gpu| {
        let albedo = DVec3::new(0.8, 0.5, 0.2);
        let scene = sphere_under(Material::lambert("matte", albedo.as_vec3()), |d| {
            Vec3::splat(d.y.max(0.0) as f32)
        });
        let found = pixels(&picture_by(gpu, &scene, 1, None, CUBE));
        let mut worst = 0.0f64;
        for (pixel, normal) in found.iter().zip(normals()) {
            let Some(n) = normal else { continue };
            let theta = n.y.acos();
            let irradiance = 2.0 / 3.0 * (theta.sin() + (std::f64::consts::PI - theta) * theta.cos());
            let expected = albedo * std::f64::consts::FRAC_1_PI * irradiance;
            worst = worst.max((*pixel - expected).abs().max_element());
        }
        println!("cosine sky: {worst:.2e}");
        assert!(worst < 5e-3, "{worst}");

        let radiance = |d: DVec3| (0.5 + 0.5 * d).as_vec3();
        let scene = sphere_under(Material::mirror("mirror", Vec3::ONE), radiance);
        let found = pixels(&picture_by(gpu, &scene, 1, None, CUBE));
        let mut worst = 0.0f64;
        for (pixel, normal) in found.iter().zip(normals()) {
            let Some(n) = normal else { continue };
            let direction = 2.0 * n.z * n - DVec3::Z;
            worst = worst.max((*pixel - radiance(direction).as_dvec3()).abs().max_element());
        }
        println!("mirror: {worst:.2e}");
        assert!(worst < 6e-3, "{worst}");
    });
}

/// Rough reflections of a bright window by both maps.
#[test]
fn rough_reflections_by_cubes_are_those_by_octahedra() {
    with_gpu(|gpu| {
        for roughness in [0.35f32, 0.6, 1.0] {
            let material = Material {
                roughness,
                ..Material::mirror("metal", Vec3::new(0.9, 0.7, 0.4))
            };
            let scene = sphere_under(material, |d| {
                let window = (12.0 * (d.dot(DVec3::new(0.5, 0.6, 0.624)) - 1.0)).exp();
                Vec3::new(0.2, 0.3, 0.5) + 4.0 * window as f32
            });
            let [octahedron, cube] = [PROBE, CUBE].map(|desc| pixels(&picture_by(gpu, &scene, 1, None, desc)));
            let pairs = || octahedron.iter().zip(&cube);
            let off: f64 = pairs().map(|(a, b)| (*a - *b).length_squared()).sum();
            let sum: f64 = pairs().map(|(a, _)| a.length_squared()).sum();
            let relative = (off / sum).sqrt();
            println!("roughness {roughness}: {relative:.4}");
            assert!(relative > 0.0 && relative < 0.02, "roughness {roughness}: {relative}");
        }
    });
}

#[test]
fn maps_that_do_not_fit_are_refused() {
    with_gpu(|gpu| {
        let (scene, _) = room();
        let subject = Subject::new(gpu, &scene);
        let on_device = &subject.on_device;
        let desc = PreviewDesc {
            size: [8, 8],
            samples: 1,
            lights: 0,
            shadows: None,
            probes: Some(ProbeMap::Octahedron),
        };
        let preview = Preview::new(gpu, on_device, desc).unwrap();
        let small = LightProbeDesc {
            map: ProbeMap::Cube,
            side: 32,
            finest: 16,
        };
        let cause = |error: Error| match error {
            Error::Setting { cause, .. } => cause,
            other => panic!("{other}"),
        };
        let probe = LightProbe::new(gpu, small).unwrap();
        let part = PreviewPart {
            triangles: 0..1,
            background: true,
            probe: Some(&probe),
        };
        let camera = clerestory::scene::Camera::look_at("main", DVec3::ZERO, DVec3::X, DVec3::Y, 1.0);
        let mut recorder = gpu.recorder("refused").unwrap();
        let refused = preview.record(&mut recorder, on_device, &on_device.surfaces(), &camera, &[part]);
        let words = cause(refused.unwrap_err());
        assert!(words.contains("the preview was made for"), "{words}");
        let refused = LiveProbe::with_distances(gpu, on_device, &preview, small, false);
        let words = cause(refused.unwrap_err());
        assert!(words.contains("has no distances here"), "{words}");
        // A search is for what an octahedron has shown.
        let desc_of_cubes = PreviewDesc {
            probes: Some(ProbeMap::Cube),
            ..preview.desc()
        };
        let by_cubes = Preview::new(gpu, on_device, desc_of_cubes).unwrap();
        let live = LiveProbe::with_distances(gpu, on_device, &preview, PROBE, false).unwrap();
        let searched = SearchedReflections::new(gpu, on_device, live.probe(), &ImpostorSettings::default()).unwrap();
        let refused = searched.record(&mut recorder, on_device, &by_cubes, &camera, 0..1, (&live, Vec3::ZERO));
        let words = cause(refused.unwrap_err());
        assert!(words.contains("lights by cubes"), "{words}");
        for (side, finest) in [(16, 16), (48, 16), (4096, 16), (64, 8), (64, 256)] {
            let map = ProbeMap::Cube;
            let refused = LightProbe::new(gpu, LightProbeDesc { map, side, finest });
            assert!(refused.is_err(), "{side}, {finest}");
        }
    });
}
