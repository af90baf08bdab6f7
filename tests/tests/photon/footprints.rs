//! Footprints of photons behind mirrors, glass and coats, as the device has them in the kernels of its records.
//!
//! A photon's way from a point light by horizontal planes is followed back in double precision: the direction that leads to where it landed, how
//! the landing point moves with that direction, by finite differences, and how probable the way is, by Fresnel's and Schlick's formulas written
//! out here. Of n photons each then has 4π/n of that movement's area over the probability to itself.

use super::*;
use clerestory::techniques::photon_mapping::MappedPhoton;
use clerestory::techniques::photon_mapping::kernel::kernel_area;
use clerestory::transport::differentials::{
    Differentials, emission_differentials, footprint_side, global_step, transfer_differentials,
};
use clerestory::transport::warp::{UNIFORM_SPHERE_PDF, orthonormal_basis};
use clerestory_tests::render::{cuboid, point_triangle};
use clerestory_tests::with_gpu;
use glam::{DMat2, DVec2, DVec3, Vec4};

const PHOTONS: u32 = 1 << 15;
const LIGHT: Vec3 = Vec3::new(0.1, 1.0, 0.05);
const CEILING: f64 = 2.0;
const IOR: f64 = 1.5;
/// Reflectance of the mirror at normal incidence.
const REFLECTANCE: f64 = 0.8;
/// Footprints in single precision after at most four surfaces, whose areas are products of two lengths: thousands of rounding units.
const TOLERANCE: f64 = 1e-3;

/// What a photon does at a plane.
#[derive(Clone, Copy, PartialEq)]
enum Event {
    Reflected,
    /// With the index before over the index behind.
    Refracted(f64),
    Straight,
}

/// A photon at a horizontal plane.
#[derive(Clone, Copy)]
struct Meeting {
    height: f64,
    event: Event,
    /// The normal about which it is reflected or refracted.
    normal: fn(DVec3) -> DVec3,
    /// Probability of the event, from the cosine of incidence at that normal and the ratio of cosines by which its power falls short there.
    chance: fn(f64, f64) -> f64,
}

/// A class of photons: their ways and where they land.
struct Class {
    name: &'static str,
    way: Vec<Meeting>,
    catcher: f64,
    /// Radius of a disk of the catcher about the y axis that is lit all over.
    lit: f64,
}

/// Fresnel's reflectance; `eta`: index behind over index before.
pub(super) fn fresnel(cos: f64, eta: f64) -> f64 {
    let refracted = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let across = (cos - eta * refracted) / (cos + eta * refracted);
    let along = (eta * cos - refracted) / (eta * cos + refracted);
    0.5 * (across * across + along * along)
}

fn flat(_: DVec3) -> DVec3 {
    DVec3::Y
}

/// A triangle at y = 0 whose normals lean together.
const BENT: [Vec3; 3] = [
    Vec3::new(-1.5, 0.0, 1.5),
    Vec3::new(1.5, 0.0, 1.2),
    Vec3::new(0.1, 0.0, -1.6),
];

fn bent_normals() -> [Vec3; 3] {
    BENT.map(|p| Vec3::new(-0.3 * p.x, 1.0, -0.3 * p.z).normalize())
}

/// The normal interpolated over [`BENT`].
fn bent(x: DVec3) -> DVec3 {
    let [a, b, c] = BENT.map(|p| p.as_dvec3());
    let [n0, n1, n2] = bent_normals().map(|n| n.as_dvec3());
    let area = |p: DVec3, q: DVec3| p.z * q.x - p.x * q.z;
    let whole = area(b - a, c - a);
    let (u, v) = (area(x - a, c - a) / whole, area(b - a, x - a) / whole);
    (n0 + u * (n1 - n0) + v * (n2 - n0)).normalize()
}

/// A followed photon.
struct Followed {
    landed: DVec3,
    chance: f64,
    /// Its differentials, had it met no surface: distances alone change them.
    unbent: Differentials,
}

impl Class {
    fn follow(&self, mut w: DVec3) -> Followed {
        let (mut x, mut chance) = (LIGHT.as_dvec3(), 1.0);
        let mut unbent = emission_differentials(w, UNIFORM_SPHERE_PDF);
        for meeting in &self.way {
            let t = (meeting.height - x.y) / w.y;
            unbent = transfer_differentials(&unbent, t, w, DVec3::Y);
            x += t * w;
            let n = (meeting.normal)(x);
            let n = if n.dot(w) > 0.0 { -n } else { n };
            let c = n.dot(w);
            let out = match meeting.event {
                Event::Reflected => w - 2.0 * c * n,
                Event::Refracted(eta) => eta * w - (eta * c + (1.0 - eta * eta * (1.0 - c * c)).sqrt()) * n,
                Event::Straight => w,
            };
            chance *= (meeting.chance)(-c, (c * out.y / (w.y * n.dot(out))).abs());
            w = out;
        }
        let t = (self.catcher - x.y) / w.y;
        Followed {
            landed: x + t * w,
            chance,
            unbent: transfer_differentials(&unbent, t, w, DVec3::Y),
        }
    }

    /// The direction that leads to `place`: by Newton's method over where the first plane is met.
    fn direction_to(&self, place: DVec3) -> DVec3 {
        let direction = |q: DVec2| (DVec3::new(q.x, self.way[0].height, q.y) - LIGHT.as_dvec3()).normalize();
        let landed = |q: DVec2| {
            let x = self.follow(direction(q)).landed;
            DVec2::new(x.x, x.z)
        };
        let (mut q, step) = (DVec2::ZERO, 1e-6f64);
        for _ in 0..40 {
            let slope = |axis: DVec2| (landed(q + step * axis) - landed(q - step * axis)) / (2.0 * step);
            let slopes = DMat2::from_cols(slope(DVec2::X), slope(DVec2::Y));
            q -= slopes.inverse() * (landed(q) - DVec2::new(place.x, place.z));
        }
        let miss = (landed(q) - DVec2::new(place.x, place.z)).length();
        assert!(miss < 1e-7, "{}: {miss} off {place}", self.name);
        direction(q)
    }

    /// Fails unless the footprints of the class's photons are those that finite differences give.
    fn expect(&self, photons: &[MappedPhoton]) {
        let of_class: Vec<&MappedPhoton> = photons
            .iter()
            .filter(|p| {
                let height = f64::from(p.record.position.y);
                !p.diffused && p.bounce as usize == self.way.len() && (height - self.catcher).abs() < 1e-3
            })
            .collect();
        assert!(of_class.len() > 100, "{}: {} photons", self.name, of_class.len());
        let step = global_step(f64::from(PHOTONS));
        let (mut worst, mut told) = ([0.0f64; 2], 0);
        let (mut covered, mut variance) = (0.0f64, 0.0f64);
        for photon in &of_class {
            let place = photon.record.position.as_dvec3();
            let w = self.direction_to(place);
            let (t, b) = orthonormal_basis(w);
            let moved = |axis: DVec3| {
                let h = 1e-5;
                let at = |h: f64| self.follow((w + h * axis).normalize()).landed;
                (at(h) - at(-h)) / (2.0 * h)
            };
            let (x1, x2) = (moved(t), moved(b));
            let followed = self.follow(w);
            let area = x1.cross(x2).length();
            let longer = x1.length().max(x2.length());
            let found = kernel_area(&photon.record.kernel()) / (step * step) * followed.chance;
            let found_longer = f64::from(photon.record.along.length()) / step * followed.chance.sqrt();
            worst[0] = worst[0].max((found / area - 1.0).abs());
            worst[1] = worst[1].max((found_longer / longer - 1.0).abs());
            let unbent = footprint_side(&followed.unbent).powi(2);
            told += usize::from((unbent / area - 1.0).abs() > 10.0 * TOLERANCE);
            // The footprints of photons on the disk are as large as the disk, on average.
            if DVec2::new(place.x, place.z).length() < self.lit {
                let of_photon = kernel_area(&photon.record.kernel());
                covered += of_photon;
                variance += of_photon * of_photon;
            }
        }
        println!(
            "{}: {} photons, areas within {:.1e}, longer axes within {:.1e}, {told} unlike unbent ones, cover {:.3} ± {:.3}",
            self.name,
            of_class.len(),
            worst[0],
            worst[1],
            covered / (PI * self.lit * self.lit),
            variance.sqrt() / (PI * self.lit * self.lit)
        );
        assert!(worst.iter().all(|error| *error < TOLERANCE), "{}: {worst:?}", self.name);
        // A tracer that leaves specular directions' differentials as they were would be seen.
        let bends = self.way.iter().any(|meeting| meeting.event != Event::Straight);
        assert!(!bends || told * 10 > of_class.len() * 9, "{}: {told}", self.name);
        expect_mean(self.name, covered, variance, PI * self.lit * self.lit, 0.0);
    }
}

/// A light between a ceiling and a floor, with materials of all kinds standing by, so that all scenes share their kernels.
fn hall(name: &str, floor_height: f32) -> Scene {
    let mut scene = Scene {
        name: name.into(),
        ..Scene::default()
    };
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    scene.place(floor("floor", grey, 2.0, floor_height));
    scene.place(ceiling("ceiling", grey, Vec3::Y * CEILING as f32, 2.0, true));
    add_point(&mut scene, LIGHT, Vec3::ONE);
    scene.cameras.push(camera_down(1.0, 5.0));
    for material in [mirror(), coat(), glass(), thin()] {
        point_triangle(&mut scene, material, Vec3::ZERO);
    }
    if let Some(mesh) = scene.meshes.last_mut() {
        mesh.normals = vec![Vec3::Y; 3];
    }
    scene
}

fn mirror() -> Material {
    Material::mirror("mirror", Vec3::splat(REFLECTANCE as f32))
}

/// A smooth coat over a diffuse base.
fn coat() -> Material {
    Material {
        base_color: Vec4::new(0.5, 0.5, 0.5, 1.0),
        metallic: 0.0,
        roughness: 0.0,
        ior: IOR as f32,
        double_sided: true,
        ..Material::default()
    }
}

fn glass() -> Material {
    Material::glass("glass", IOR as f32)
}

fn thin() -> Material {
    Material {
        thickness: 0.0,
        ..glass()
    }
}

/// [`BENT`] of a material, facing up.
fn bent_triangle(material: u32) -> Mesh {
    Mesh {
        name: "bent".into(),
        positions: BENT.to_vec(),
        normals: bent_normals().to_vec(),
        triangles: vec![[0, 1, 2]],
        material: Some(material),
        ..Mesh::default()
    }
}

/// Photons of a pass that have been scattered at least once, with kernels that are their footprints.
fn photons_of(gpu: &Gpu, scene: &Scene) -> Vec<MappedPhoton> {
    let settings = PhotonSettings {
        photons: PHOTONS,
        shape: KernelShape::Skewed,
        dampening: 1.0,
        spread: 1.0,
        unit_length: 0.01,
        radius: 1e3,
        flatness: 1e-3,
        widen_flat: false,
        // Tells what has been scattered specularly alone.
        final_gather: true,
        ..settings("bounces=1..4")
    };
    let photons = mapper(gpu, scene, &settings).photons(0);
    photons.unwrap_or_else(|error| panic!("{}: {error}", scene.name))
}

fn meeting(height: f64, event: Event, chance: fn(f64, f64) -> f64) -> Meeting {
    Meeting {
        height,
        event,
        normal: flat,
        chance,
    }
}

/// At [`BENT`].
fn bent_meeting(event: Event, chance: fn(f64, f64) -> f64) -> Meeting {
    Meeting {
        normal: bent,
        ..meeting(0.0, event, chance)
    }
}

#[test]
fn footprints_behind_glass_are_those_of_finite_differences() {
    with_gpu(|gpu| {
        let top = 0.6;
        let into = meeting(top, Event::Refracted(1.0 / IOR), |c, _| 1.0 - fresnel(c, IOR));
        let out_of = |height| meeting(height, Event::Refracted(IOR), |c, _| 1.0 - fresnel(c, 1.0 / IOR));
        let mut scene = hall("slab", -0.5);
        let index = scene.add_material(glass());
        let (lower, upper) = (Vec3::new(-3.0, 0.0, -3.0), Vec3::new(3.0, top as f32, 3.0));
        scene.place(cuboid("slab", index, lower, upper));
        let photons = photons_of(gpu, &scene);
        for class in [
            Class {
                name: "off a slab",
                way: vec![meeting(top, Event::Reflected, |c, _| fresnel(c, IOR))],
                catcher: CEILING,
                lit: 1.2,
            },
            Class {
                name: "through a slab",
                way: vec![into, out_of(0.0)],
                catcher: -0.5,
                lit: 1.0,
            },
            Class {
                name: "off the back of a slab",
                way: vec![
                    into,
                    meeting(0.0, Event::Reflected, |c, _| fresnel(c, 1.0 / IOR)),
                    out_of(top),
                ],
                catcher: CEILING,
                lit: 1.4,
            },
        ] {
            class.expect(&photons);
        }

        let mut scene = hall("thin glass", -0.5);
        let index = scene.add_material(thin());
        scene.place(floor("sheet", index, 2.0, 0.25));
        let photons = photons_of(gpu, &scene);
        for class in [
            Class {
                name: "off thin glass",
                way: vec![meeting(0.25, Event::Reflected, |c, _| fresnel(c, IOR))],
                catcher: CEILING,
                lit: 1.2,
            },
            Class {
                name: "through thin glass",
                way: vec![meeting(0.25, Event::Straight, |c, _| 1.0 - fresnel(c, IOR))],
                catcher: -0.5,
                lit: 1.0,
            },
        ] {
            class.expect(&photons);
        }

        // Glass without an end, with normals that lean together.
        let mut scene = hall("bent glass", -1.5);
        let index = scene.add_material(glass());
        scene.place(bent_triangle(index));
        let photons = photons_of(gpu, &scene);
        for class in [
            Class {
                name: "off bent glass",
                way: vec![bent_meeting(Event::Reflected, |c, ratio| {
                    fresnel(c, IOR) * ratio.min(1.0)
                })],
                catcher: CEILING,
                lit: 0.6,
            },
            Class {
                name: "into bent glass",
                way: vec![bent_meeting(Event::Refracted(1.0 / IOR), |c, ratio| {
                    (1.0 - fresnel(c, IOR)) * ratio.min(1.0)
                })],
                catcher: -1.5,
                lit: 0.6,
            },
        ] {
            class.expect(&photons);
        }
    });
}

#[test]
fn footprints_behind_mirrors_and_coats_are_those_of_finite_differences() {
    with_gpu(|gpu| {
        let mut scene = hall("coat", -0.5);
        let index = scene.add_material(coat());
        scene.place(floor("coat", index, 2.0, 0.0));
        let class = Class {
            name: "off a coat",
            way: vec![meeting(0.0, Event::Reflected, |c, _| fresnel(c, IOR))],
            catcher: CEILING,
            lit: 1.2,
        };
        class.expect(&photons_of(gpu, &scene));

        let mut scene = hall("bent mirror", -0.5);
        let index = scene.add_material(mirror());
        scene.place(bent_triangle(index));
        let class = Class {
            name: "off a bent mirror",
            way: vec![bent_meeting(Event::Reflected, |c, ratio| {
                ((REFLECTANCE + (1.0 - REFLECTANCE) * (1.0 - c).powi(5)) * ratio).min(1.0)
            })],
            catcher: CEILING,
            lit: 0.6,
        };
        class.expect(&photons_of(gpu, &scene));
    });
}
