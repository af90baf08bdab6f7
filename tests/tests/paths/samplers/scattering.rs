//! What the scattering functions draw, against their densities.

use std::f64::consts::TAU;

use clerestory::gpu::Gpu;
use clerestory::transport::albedo::AlbedoTable;
use clerestory::transport::bsdf::{
    BSDF_EXACT_CONDUCTOR, Bsdf, BsdfContext, BsdfFeatures, GltfFactors, LOBE_ALL, LOBE_DIFFUSE, LOBE_GLOSSY,
    LOBE_REFLECTION, LOBE_SPECULAR, LOBE_TRANSMISSION, bsdf_gltf, bsdf_pdf,
};
use clerestory::transport::fresnel::{fresnel_conductor_average, fresnel_dielectric};
use clerestory::transport::phase::{henyey_greenstein, schlick_phase};
use clerestory::transport::phong::phong_pdf;
use clerestory::transport::random::SamplerKind;
use clerestory::transport::warp::orthonormal_basis;
use clerestory_tests::statistics::{FALSE_ALARM, chi_square_test, expect_counts};
use clerestory_tests::twin::Case;
use clerestory_tests::{twin_kernel, with_gpu};
use glam::{DVec3, Vec3};

use super::{DRAWS, pairs, turn, twin_math};

twin_kernel!(twin_bsdf);

/// Cells in height and in azimuth about the axis.
const ROWS: usize = 32;
const COLUMNS: usize = 16;
/// Points of the midpoint rule along each side of a cell.
const STEPS: usize = 16;

/// Fails when directions do not follow a density over the sphere, sr⁻¹.
fn expect_density(what: &str, axis: DVec3, directions: &[Option<DVec3>], density: impl Fn(DVec3) -> f64) {
    let p = density_test(what, axis, directions, density);
    assert!(p >= FALSE_ALARM, "{what}: chi-square p = {p:.3e}");
}

/// p-value of directions against a density over the sphere, by cells about `axis`; draws without a direction are a cell of their own.
fn density_test(what: &str, axis: DVec3, directions: &[Option<DVec3>], density: impl Fn(DVec3) -> f64) -> f64 {
    let (x, y) = orthonormal_basis(axis);
    let mut counts = vec![0.0; ROWS * COLUMNS + 1];
    for direction in directions {
        let cell = direction.map_or(ROWS * COLUMNS, |w| {
            let row = ((0.5 * (w.dot(axis) + 1.0) * ROWS as f64) as usize).min(ROWS - 1);
            let column = ((turn(w.dot(x), w.dot(y)) * COLUMNS as f64) as usize).min(COLUMNS - 1);
            row * COLUMNS + column
        });
        counts[cell] += 1.0;
    }
    let middle = |step: usize| (step as f64 + 0.5) / STEPS as f64;
    let mut expected: Vec<f64> = (0..ROWS * COLUMNS)
        .map(|cell| {
            // The angle, not its cosine, goes in even steps: densities are smooth in it near the poles.
            let theta = |row: usize| (2.0 * row as f64 / ROWS as f64 - 1.0).acos();
            let (first, last) = (theta(cell / COLUMNS), theta(cell / COLUMNS + 1));
            let at = |step: usize| {
                let (sin, cos) = (first + (last - first) * middle(step / STEPS)).sin_cos();
                let phi = TAU * ((cell % COLUMNS) as f64 + middle(step % STEPS)) / COLUMNS as f64;
                density(x * (sin * phi.cos()) + y * (sin * phi.sin()) + axis * cos) * sin
            };
            let area = (first - last) * TAU / (COLUMNS * STEPS * STEPS) as f64;
            (0..STEPS * STEPS).map(at).sum::<f64>() * area * DRAWS as f64
        })
        .collect();
    let total = expected.iter().sum::<f64>() / DRAWS as f64;
    assert!(total < 1.0 + 1e-3, "{what}: the density integrates to {total}");
    // What the quadrature leaves of one below its own error stands for no draw that fails.
    let missing = if 1.0 - total < 1e-3 && counts[ROWS * COLUMNS] == 0.0 {
        0.0
    } else {
        1.0 - total
    };
    expected.push(missing * DRAWS as f64);
    chi_square_test(&counts, &expected)
}

#[test]
fn phase_functions_follow_their_densities() {
    with_gpu(|gpu| {
        let points = pairs(gpu, SamplerKind::Pcg, 21, false);
        let w = DVec3::new(0.48, -0.6, 0.64);
        let check = |what: &str, parameter: f32, output: usize, density: &dyn Fn(f64) -> f64| {
            let cases: Vec<Case> = (points.iter())
                .map(|u| Case::new(&[0.0, parameter, parameter, u[0]]))
                .collect();
            let cosines = twin_math(gpu, 5, &cases, &[]);
            let [x, y, z] = w.as_vec3().to_array();
            let cases: Vec<Case> = (cosines.iter().zip(&points))
                .map(|(c, u)| Case::new(&[c.0[output], 0.0, 0.0, 0.0, u[1], x, y, z]))
                .collect();
            let directions: Vec<_> = (twin_math(gpu, 5, &cases, &[]).iter())
                .map(|r| Some(r.vector(4)))
                .collect();
            expect_density(&format!("{what} {parameter}"), w, &directions, |v| density(v.dot(w)));
        };
        for g in [0.75f32, -0.5, 0.0005] {
            check("Henyey-Greenstein", g, 1, &|c| henyey_greenstein(c, g.into()));
        }
        for k in [0.75f32, -0.6] {
            check("Schlick", k, 3, &|c| schlick_phase(c, k.into()));
        }
    });
}

#[test]
fn phong_lobes_follow_their_density() {
    with_gpu(|gpu| {
        let points = pairs(gpu, SamplerKind::Pcg, 23, false);
        let wo = DVec3::new(0.6, 0.0, 0.8);
        let [x, y, z] = wo.as_vec3().to_array();
        for exponent in [0.0f32, 1.0, 20.0] {
            let cases: Vec<Case> = (points.iter())
                .map(|u| Case::new(&[1.0, 1.0, 1.0, exponent, x, y, z, 0.0, 0.0, 1.0, u[0], u[1]]))
                .collect();
            let directions: Vec<_> = (twin_math(gpu, 6, &cases, &[]).iter())
                .map(|r| Some(r.vector(4)))
                .collect();
            let mirror = DVec3::new(-wo.x, -wo.y, wo.z);
            expect_density(&format!("exponent {exponent}"), mirror, &directions, |wi| {
                phong_pdf(exponent.into(), wo, wi)
            });
            // The test tells exponents apart.
            let other = density_test("another exponent", mirror, &directions, |wi| {
                phong_pdf(1.05 * f64::from(exponent) + 0.05, wo, wi)
            });
            assert!(other < FALSE_ALARM, "exponent {exponent}: {other}");
        }
    });
}

/// A surface of glTF's factors.
#[derive(Clone, Copy)]
struct Surface {
    metallic: f32,
    roughness: f32,
    transmission: f32,
    ior: f32,
    specular: f32,
    thickness: f32,
    conductor: bool,
}

const ROUGH: Surface = Surface {
    metallic: 0.0,
    roughness: 0.7,
    transmission: 0.0,
    ior: 1.5,
    specular: 1.0,
    thickness: 0.0,
    conductor: false,
};
const GLASS: Surface = Surface {
    transmission: 1.0,
    thickness: 1.0,
    ..ROUGH
};

const CONDUCTOR: [DVec3; 2] = [DVec3::new(0.2, 0.4, 1.4), DVec3::new(4.0, 2.4, 1.6)];

impl Surface {
    fn flags(&self) -> u32 {
        if self.conductor { BSDF_EXACT_CONDUCTOR } else { 0 }
    }

    fn bsdf(&self) -> Bsdf {
        let b = bsdf_gltf(&GltfFactors {
            base_color: DVec3::ONE,
            metallic: self.metallic.into(),
            roughness: self.roughness.into(),
            transmission: self.transmission.into(),
            ior: self.ior.into(),
            specular: self.specular.into(),
            specular_color: DVec3::ONE,
            thickness: self.thickness.into(),
        });
        let [eta, k] = CONDUCTOR;
        Bsdf {
            conductor_a: eta,
            conductor_b: k,
            conductor_c: fresnel_conductor_average(eta, k),
            flags: b.flags | self.flags(),
            ..b
        }
    }

    /// Directions that the device draws, with their lobes; `None` where it found none.
    fn draw(&self, gpu: &Gpu, wo: DVec3, mask: u32) -> Vec<Option<(DVec3, u32)>> {
        let (points, lobes) = (
            pairs(gpu, SamplerKind::Pcg, 25, false),
            pairs(gpu, SamplerKind::Pcg, 26, false),
        );
        let [eta, k] = CONDUCTOR;
        let vectors = [eta, k, fresnel_conductor_average(eta, k)].map(|v| v.as_vec3().to_array());
        let mut numbers = vec![1.0, 1.0, 1.0, self.metallic, self.roughness, self.transmission];
        numbers.extend([self.ior, self.specular, 1.0, 1.0, 1.0, self.thickness]);
        numbers.extend(vectors.as_flattened());
        numbers.push(f32::from_bits(self.flags()));
        numbers.extend(wo.as_vec3().to_array());
        numbers.extend(Vec3::ZERO.to_array());
        let cases: Vec<Case> = (points.iter().zip(&lobes))
            .map(|(p, lobe)| {
                let drawn = [p[0], p[1], lobe[0], f32::from_bits(mask)];
                Case::new(&[&numbers[..], &drawn].concat())
            })
            .collect();
        twin_bsdf(gpu, 1, &cases, &AlbedoTable::shared().values)
            .iter()
            .map(|r| (r.bits(7) != 0).then(|| (r.vector(0), r.bits(7))))
            .collect()
    }
}

#[test]
fn surface_lobes_follow_their_densities() {
    with_gpu(|gpu| {
        let context = BsdfContext {
            features: BsdfFeatures::ALL,
            table: AlbedoTable::shared(),
        };
        let steep = DVec3::new(0.6, 0.0, 0.8);
        let flat = DVec3::new(0.0, 0.96, 0.28);
        let below = DVec3::new(0.28, 0.0, -0.96);
        let matt = Surface { specular: 0.0, ..ROUGH };
        let metal = Surface { metallic: 1.0, ..ROUGH };
        let conductor = Surface {
            conductor: true,
            ..metal
        };
        let thin = Surface {
            thickness: 0.0,
            ..GLASS
        };
        let mixed = Surface {
            metallic: 0.3,
            transmission: 0.5,
            ..thin
        };
        for (what, surface, wo, mask) in [
            ("diffuse", matt, flat, LOBE_ALL),
            ("layer over diffuse", ROUGH, flat, LOBE_ALL),
            ("glossy layer alone", ROUGH, steep, LOBE_GLOSSY & LOBE_REFLECTION),
            ("diffuse alone", ROUGH, steep, LOBE_DIFFUSE & LOBE_REFLECTION),
            ("metal", metal, steep, LOBE_ALL),
            ("exact conductor", conductor, flat, LOBE_ALL),
            ("solid from outside", GLASS, steep, LOBE_ALL),
            ("solid from inside", GLASS, below, LOBE_ALL),
            ("transmission alone", GLASS, steep, LOBE_GLOSSY & LOBE_TRANSMISSION),
            ("thin wall", thin, steep, LOBE_ALL),
            ("everything", mixed, flat, LOBE_ALL),
        ] {
            let directions: Vec<_> = surface.draw(gpu, wo, mask).iter().map(|d| d.map(|(w, _)| w)).collect();
            let bsdf = surface.bsdf();
            expect_density(what, DVec3::Z, &directions, |wi| {
                bsdf_pdf(&context, &bsdf, wo, wi, mask)
            });
        }
    });
}

#[test]
fn clear_glass_reflects_as_often_as_fresnel_says() {
    with_gpu(|gpu| {
        let clear = Surface {
            roughness: 0.0,
            ..GLASS
        };
        for (what, wo, eta) in [
            ("from outside", DVec3::new(0.96, 0.0, 0.28), 1.5),
            ("from inside", DVec3::new(0.6, 0.0, -0.8), 1.0 / 1.5),
        ] {
            let mut counts = [0.0; 2];
            for (_, flags) in clear.draw(gpu, wo, LOBE_ALL).into_iter().flatten() {
                assert_eq!(flags & !LOBE_SPECULAR, 0);
                counts[usize::from(flags & LOBE_TRANSMISSION != 0)] += 1.0;
            }
            let reflectance = fresnel_dielectric(wo.z.abs(), eta);
            let expected = [reflectance, 1.0 - reflectance].map(|p| p * DRAWS as f64);
            expect_counts(what, &counts, &expected);
        }
    });
}
