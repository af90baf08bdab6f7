//! Kernels from footprints behind boundaries and panes of glass, as the device has them in the records of collisions.
//!
//! A photon's way from a point light through layers across z has a closed form: where it is at a height by the sine of its first direction, how that changes by the sine, and who has come
//! as far, by Beer's law and Fresnel's formula. Of n photons each then has the volume to itself that the density of collisions leaves it.

use super::footprints::fresnel;
use super::volume::direct;
use super::*;
use clerestory::scene::Phase;
use clerestory::techniques::photon_mapping::volume::VolumeKernel;
use clerestory::techniques::photon_mapping::volume::event::PhotonEvent;
use clerestory_tests::render::{cuboid, medium};
use clerestory_tests::with_gpu;
use glam::{DVec2, DVec3};

const PHOTONS: u32 = 1 << 14;
const IOR: f64 = 1.5;
/// Half of what all bodies measure across z, m.
const HALF: f64 = 4.0;
/// Radii in single precision behind at most two surfaces; those beside steep ways are products of small cosines.
const TOLERANCE: f64 = 1e-3;

/// What lies above the one before, as far as its height.
#[derive(Clone, Copy)]
struct Layer {
    /// m, from the light, which is at 0 in the first layer.
    upper: f64,
    index: f64,
    /// Extinction, 1/m.
    sigma: f64,
}

const fn layer(upper: f64, index: f64, sigma: f64) -> Layer {
    Layer { upper, index, sigma }
}

/// A photon that is followed.
struct Followed {
    /// Distance off the z axis, and its derivative by the sine of the first direction.
    off: f64,
    slope: f64,
    /// Cosine of the last direction.
    cos: f64,
    /// Share of photons that come there, and of those that choose the way.
    passed: f64,
    chosen: f64,
}

/// The photon at a height in the last layer, by the sine of its first direction.
fn follow(layers: &[Layer], sine: f64, height: f64) -> Followed {
    let mut f = Followed {
        off: 0.0,
        slope: 0.0,
        cos: 1.0,
        passed: 1.0,
        chosen: 1.0,
    };
    let mut lower = 0.0;
    let mut before: Option<(f64, f64)> = None;
    for layer in layers {
        let thickness = layer.upper.min(height) - lower;
        let sin = sine / layer.index;
        f.cos = (1.0 - sin * sin).sqrt();
        f.off += thickness * sin / f.cos;
        f.slope += thickness / (layer.index * f.cos.powi(3));
        f.passed *= (-layer.sigma * thickness / f.cos).exp();
        if let Some((index, cos)) = before
            && index != layer.index
        {
            f.chosen *= 1.0 - fresnel(cos, layer.index / index);
        }
        before = Some((layer.index, f.cos));
        lower = layer.upper;
    }
    f
}

/// The sine of the direction that leads so far off the axis at a height.
fn sine_to(layers: &[Layer], off: f64, height: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0 - 1e-9);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if follow(layers, middle, height).off < off {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// A point light at the origin, and bodies that are given by their lowest and greatest heights.
fn layered(name: &str) -> Scene {
    let mut scene = Scene {
        name: name.into(),
        ..Scene::default()
    };
    let black = scene.add_material(Material::lambert("black", Vec3::ZERO));
    scene.place(floor("floor", black, 1.0, -20.0));
    scene.cameras.push(camera_down(1.0, 5.0));
    add_point(&mut scene, Vec3::ZERO, Vec3::ONE);
    scene
}

fn place(scene: &mut Scene, material: Material, half: f64, heights: [f64; 2]) {
    let material = scene.add_material(material);
    let corner = |side: f64, height: f64| Vec3::new((side * half) as f32, (side * half) as f32, height as f32);
    scene.place(cuboid(
        "body",
        material,
        corner(-1.0, heights[0]),
        corner(1.0, heights[1]),
    ));
}

/// An invisible body of a grey medium.
fn place_fog(scene: &mut Scene, sigma: f64, half: f64, heights: [f64; 2]) {
    let material = Material {
        name: "boundary".into(),
        boundary: true,
        interior: Some(scene.media.len() as u32),
        ..Material::default()
    };
    scene
        .media
        .push(medium(sigma as f32, 0.8, Phase::HenyeyGreenstein { g: 0.5 }));
    place(scene, material, half, heights);
}

fn glass() -> Material {
    Material::glass("glass", IOR as f32)
}

/// Fails unless collisions behind the layers have the radius that their volume asks for; `bends`: unlike that of a way without glass.
fn expect(gpu: &Gpu, scene: &Scene, settings: PhotonSettings, bounce: u32, layers: &[Layer], bends: bool) {
    let settings = PhotonSettings {
        volume_kernel: VolumeKernel::Footprint,
        volume_dampening: 0.0,
        volume_radius: 1e3,
        ..settings
    };
    let [.., behind, last] = layers else {
        panic!("{}: nothing is behind anything", scene.name)
    };
    let mut mapper = mapper(gpu, scene, &settings);
    let events = mapper.events(0).unwrap_or_else(|error| panic!("{error}"));
    let is_there = |e: &PhotonEvent| {
        let height = f64::from(e.position.z);
        e.bounce == bounce && height > behind.upper && height < last.upper
    };
    let (mut worst, mut count, mut told) = (0.0f64, 0, 0);
    for event in events.iter().map(|e| e.event).filter(is_there) {
        let place = event.position.as_dvec3();
        let off = DVec2::new(place.x, place.y).length();
        // Beside the bodies' edges ways may come in by other faces, and on the axis an angle has no size.
        if !(1e-2..=0.9 * HALF).contains(&off) {
            continue;
        }
        let sine = sine_to(layers, off, place.z);
        let f = follow(layers, sine, place.z);
        // Others have been scattered on a way past the bodies.
        let out = sine / last.index;
        let direct = DVec3::new(place.x / off * out, place.y / off * out, f.cos);
        if event.direction.as_dvec3().dot(direct) < 1.0 - 1e-6 {
            continue;
        }
        let across = f.off * f.slope * f.cos * (1.0 - sine * sine).sqrt() / sine;
        let density = f64::from(PHOTONS) / (4.0 * PI) * f.chosen * last.sigma * f.passed / across;
        let radius = 3.0 / density.cbrt();
        worst = worst.max((f64::from(event.radius) / radius - 1.0).abs());
        told += usize::from((place.length_squared() / across - 1.0).abs() > 10.0 * TOLERANCE);
        count += 1;
    }
    println!(
        "{}: {count} collisions, radii within {worst:.1e}, {told} unlike straight ones",
        scene.name
    );
    assert!(count > 200, "{}: {count} collisions", scene.name);
    assert!(worst < TOLERANCE, "{}: {worst:e}", scene.name);
    assert_eq!(told * 10 > count * 9, bends, "{}: {told} of {count}", scene.name);
}

#[test]
fn kernels_in_nested_bodies_are_those_of_all_that_photons_have_passed() {
    with_gpu(|gpu| {
        let mut scene = layered("nested bodies");
        place_fog(&mut scene, 0.3, HALF + 2.0, [-2.0, 4.0]);
        place_fog(&mut scene, 1.5, HALF + 1.0, [-1.0, 0.6]);
        let layers = [layer(0.6, 1.0, 1.5), layer(4.0, 1.0, 0.3)];
        expect(gpu, &scene, direct(PHOTONS), 0, &layers, false);
        // Three of them, with a gap of nothing.
        let mut scene = layered("bodies one behind the other");
        place_fog(&mut scene, 2.0, HALF + 1.0, [-1.0, 0.4]);
        place_fog(&mut scene, 0.5, HALF + 1.0, [0.8, 4.0]);
        let layers = [layer(0.4, 1.0, 2.0), layer(0.8, 1.0, 0.0), layer(4.0, 1.0, 0.5)];
        expect(gpu, &scene, direct(PHOTONS), 0, &layers, false);
    });
}

#[test]
fn kernels_behind_glass_are_those_of_refracted_footprints() {
    with_gpu(|gpu| {
        let mut scene = layered("behind a pane");
        place(&mut scene, glass(), HALF + 2.0, [0.5, 1.0]);
        place_fog(&mut scene, 0.7, HALF + 1.0, [1.3, 4.0]);
        let layers = [
            layer(0.5, 1.0, 0.0),
            layer(1.0, IOR, 0.0),
            layer(1.3, 1.0, 0.0),
            layer(4.0, 1.0, 0.7),
        ];
        expect(gpu, &scene, direct(PHOTONS), 2, &layers, true);

        let mut scene = layered("through a pane in fog");
        place_fog(&mut scene, 0.7, HALF + 2.0, [-1.0, 4.0]);
        place(&mut scene, glass(), HALF + 1.0, [0.5, 1.0]);
        let layers = [layer(0.5, 1.0, 0.7), layer(1.0, IOR, 0.0), layer(4.0, 1.0, 0.7)];
        expect(gpu, &scene, direct(PHOTONS), 2, &layers, true);

        let mut scene = layered("within glass");
        let filled = Material {
            interior: Some(0),
            ..glass()
        };
        scene.media.push(medium(0.7, 0.8, Phase::Isotropic));
        place(&mut scene, filled, HALF + 2.0, [0.5, 4.0]);
        let layers = [layer(0.5, 1.0, 0.0), layer(4.0, IOR, 0.7)];
        expect(gpu, &scene, direct(PHOTONS), 1, &layers, true);
    });
}
