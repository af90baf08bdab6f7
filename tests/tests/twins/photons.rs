//! Photon differentials, kernels of photons and their records.

use clerestory::gpu::shaders::constants::{
    EVENT_LEAF_END, PHOTON_BOUNCE_SHIFT, PHOTON_DIRECTION_BITS, PHOTON_LEAF_END, PHOTON_NORMAL_BITS, WAY_STEPS,
};
use clerestory::techniques::photon_mapping::kernel::{
    KernelProfile, KernelSettings, KernelShape, PhotonKernel, PhotonRecord, kernel_area, kernel_extent, kernel_profile,
    kernel_weight, pack_photon, photon_ends_leaf, photon_kernel, photon_weight, unpack_photon,
};
use clerestory::techniques::photon_mapping::volume::event::{
    PhotonBeam, PhotonEvent, ball_profile, event_ends_leaf, line_profile, meet_beam, pack_beam, pack_event,
    point_share, unpack_beam, unpack_event,
};
use clerestory::techniques::photon_mapping::volume::footprint::{
    EventKernelSettings, event_radius, footprint_across, log_of_one_plus, passed_differentials, scattered_in_medium,
};
use clerestory::techniques::photon_mapping::volume::plane::{
    PhotonPlane, is_plane, least_extinction, meet_plane, pack_plane, plane_extinction, unpack_plane,
};
use clerestory::techniques::photon_mapping::volume::transmittance::attenuate;
use clerestory::techniques::photon_mapping::volume::ways::short_way_extinction;
use clerestory::transport::differentials::{
    Differentials, area_light_differentials, camera_differentials, diffuse_reemission, emission_differentials,
    guard_differentials, normal_derivatives, parallel_beam_differentials, reflect_differentials, refract_differentials,
    rough_reemission, roulette_differentials, transfer_differentials,
};
use clerestory::transport::photon_share::{
    across_of_planes, carried_distance2, distance2_in_plane, even_distance2, even_distance2_across, evened_distance2,
    eye_share, photon_share, placeless_distance2,
};
use clerestory_tests::random::Random;
use clerestory_tests::twin::{Case, Results, Tolerance, U, compare};
use clerestory_tests::{twin_kernel, with_gpu};
use glam::Vec3;

use crate::{cases, direction, list, shift, ulps, v2, v3};

twin_kernel!(twin_photons);

const PROFILES: [KernelProfile; 3] = [KernelProfile::Uniform, KernelProfile::Cone, KernelProfile::Epanechnikov];
const SHAPES: [KernelShape; 4] = [
    KernelShape::Skewed,
    KernelShape::Principal,
    KernelShape::Isotropic,
    KernelShape::Fixed,
];

fn differentials(x: &[f64], i: usize) -> Differentials {
    Differentials {
        z1: v3(x, i),
        z2: v3(x, i + 3),
        w1: v3(x, i + 6),
        w2: v3(x, i + 9),
    }
}

fn numbers(d: &Differentials) -> Vec<f64> {
    list![d.z1.to_array(), d.z2.to_array(), d.w1.to_array(), d.w2.to_array()]
}

fn kind(x: &[f64], i: usize) -> usize {
    (x[i] as f32).to_bits() as usize
}

/// As floats, since f64 keeps the bits of what is below 2²⁴ as a subnormal f32.
fn code(n: usize) -> f32 {
    f32::from_bits(n as u32)
}

fn judge(
    what: &str,
    table: &[Case],
    results: &[Results],
    tolerance: Tolerance,
    inputs: usize,
    twin: impl Fn(&[f64]) -> Vec<f64>,
) {
    let worst = compare(what, table, results, tolerance, 0..inputs, twin);
    println!("{what}: worst error {worst:.3} of what is allowed");
}

#[test]
fn emissions_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(30, |r| {
            let rest = [
                r.magnitude(-6, 12),
                r.magnitude(-20, 20),
                r.range(0.1, 6.3),
                0.0,
                0.0,
                0.0,
            ];
            [&direction(r).to_array()[..], &rest, &[code(r.below(3))]].concat()
        });
        let results = twin_photons(gpu, 0, &table, &[]);
        judge("emissions", &table, &results, ulps(16.0, 4.0, 0.0), 9, |x| {
            numbers(&match kind(x, 9) {
                0 => emission_differentials(v3(x, 0), x[3]),
                1 => area_light_differentials(v3(x, 0), x[3], x[4], x[5]),
                _ => parallel_beam_differentials(v3(x, 0), x[4]),
            })
        });
        // Steps of length 1, of which the part across the direction is taken: some rounding units of 1.
        let table = cases(37, |r| {
            list32(&[r.vector() + 2.0 * Vec3::X, r.direction(), r.direction()], &[code(3)])
        });
        let results = twin_photons(gpu, 0, &table, &[]);
        judge("cameras", &table, &results, ulps(8.0, 4.0, 8.0 * U), 9, |x| {
            numbers(&camera_differentials(v3(x, 0), v3(x, 3), v3(x, 6)))
        });
    });
}

fn list32(vectors: &[Vec3], rest: &[f32]) -> Vec<f32> {
    let mut all: Vec<f32> = vectors.iter().flat_map(|v| v.to_array()).collect();
    all.extend_from_slice(rest);
    all
}

/// Differentials whose positions have the size of a scene.
fn random_differentials(r: &mut Random, size: f32) -> [Vec3; 4] {
    [size * r.vector(), size * r.vector(), r.vector(), r.vector()]
}

#[test]
fn events_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(31, |r| {
            let size = r.choose(&[1e-3, 1.0, 1e3]);
            let d = random_differentials(r, size);
            let w = direction(r);
            // Refraction needs a normal that faces the photon, away from the critical angle where the twin, too, is ill-conditioned.
            let n = loop {
                let n = r.direction();
                if n.dot(w) < -0.05 {
                    break n;
                }
            };
            let s = n.dot(w);
            let eta = loop {
                let eta = r.range(0.5, 2.0);
                if (1.0 - eta * eta * (1.0 - s * s)).abs() > 0.02 {
                    break eta;
                }
            };
            let choice = r.below(6);
            list32(
                &[d[0], d[1], d[2], d[3], w, n, r.vector(), r.vector()],
                &[
                    size * r.range(0.1, 3.0),
                    eta,
                    r.magnitude(-6, 8),
                    r.range(0.05, 1.0),
                    code(choice),
                ],
            )
        });
        let results = twin_photons(gpu, 1, &table, &[]);
        // Sums of some products of vectors of length √3: their rounding stands by that of inputs moved by some units.
        judge("events", &table, &results, ulps(32.0, 8.0, 0.0), 28, |x| {
            let d = differentials(x, 0);
            let (w, n, dn) = (v3(x, 12), v3(x, 15), [v3(x, 18), v3(x, 21)]);
            numbers(&match kind(x, 28) {
                0 => transfer_differentials(&d, x[24], w, n),
                1 => reflect_differentials(&d, w, n, dn),
                2 => refract_differentials(&d, w, n, x[25], dn),
                3 => diffuse_reemission(&d, w, x[26]),
                4 => rough_reemission(&d, w, x[26]),
                _ => roulette_differentials(&d, x[27]),
            })
        });
    });
}

#[test]
fn guards_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(32, |r| {
            let mut d = random_differentials(r, 1e3);
            let bad = r.choose(&[f32::NAN, f32::INFINITY, -f32::INFINITY, 2e6, -2e6, 9e5, 2e9, 0.0]);
            d[r.below(4)][r.below(3)] = bad;
            let unit = r.choose(&[1e-3, 1.0, 1e3]);
            let mut all = list32(&d, &[0.0; 15]);
            all.extend([unit, code(6)]);
            all
        });
        let mut zeroed = 0;
        for (case, result) in table.iter().zip(twin_photons(gpu, 1, &table, &[])) {
            let x = case.0.map(f64::from);
            let (d, fit) = guard_differentials(&differentials(&x, 0), x[27]);
            assert_eq!(result.bits(12) == 1, fit, "{:?}", case.0);
            let device = [0, 3, 6, 9].map(|i| result.vector(i));
            assert_eq!(device, [d.z1, d.z2, d.w1, d.w2]);
            zeroed += u32::from(!fit);
        }
        assert!(zeroed > 500 && zeroed < 1400, "{zeroed}");
    });
}

#[test]
fn derivatives_of_normals_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(33, |r| {
            // Small edges whose squares of areas vanish in f32.
            let size = r.choose(&[1e-12, 1e-3, 1.0, 1e6]);
            let edges = loop {
                let edges = [r.vector(), r.vector()];
                if edges[0].cross(edges[1]).length() > 0.1 {
                    break edges.map(|e| size * e);
                }
            };
            let n = r.direction();
            let normals = [0; 3].map(|_| n + 0.4 * r.vector());
            let (u, v) = (r.unit(), r.unit());
            let mut all = list32(&[edges[0], edges[1], normals[0], normals[1], normals[2]], &[u, v]);
            for _ in 0..2 {
                all.extend((r.signed() * edges[0] + r.signed() * edges[1]).to_array());
            }
            all
        });
        let results = twin_photons(gpu, 2, &table, &[]);
        judge(
            "derivatives of normals",
            &table,
            &results,
            ulps(32.0, 8.0, 0.0),
            23,
            |x| {
                let d = Differentials {
                    z1: v3(x, 17),
                    z2: v3(x, 20),
                    ..Differentials::default()
                };
                let dn = normal_derivatives([v3(x, 0), v3(x, 3)], [v3(x, 6), v3(x, 9), v3(x, 12)], v2(x, 15), &d);
                list![dn[0].to_array(), dn[1].to_array()]
            },
        );
    });
}

fn settings(x: &[f64]) -> KernelSettings {
    KernelSettings {
        shape: SHAPES[kind(x, 18)],
        spread: x[9],
        exponent: x[10],
        unit_length: x[11],
        length_min: x[12],
        length_max: x[13],
        flatness: x[14],
        widens_flat: x[15] > 0.0,
    }
}

#[test]
fn kernels_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(34, |r| {
            let unit = r.choose(&[1e-3, 1.0, 1e3]);
            // In the plane z = 0, turned with the normal: exactly across it, as after a transfer.
            let axis = r.below(3);
            let mut n = Vec3::ZERO;
            n[axis] = r.choose(&[1.0, -1.0]);
            let shape = r.below(4);
            let [mut z1, mut z2] = loop {
                let mut z = [r.vector(), r.vector()].map(|z| unit * z);
                z[0][axis] = 0.0;
                z[1][axis] = 0.0;
                let ratio = z[0].cross(z[1]).length() / z[0].length_squared().max(z[1].length_squared());
                // Clear of the limit, and of lengths where the choice of the longer one turns on rounding.
                let even = (z[0].length() / z[1].length() - 1.0).abs() < 1e-4;
                let limit = (0.049..0.051).contains(&ratio) || (4e-4..2.2e-3).contains(&ratio);
                if !(limit || even || (shape == 1 && (0.02..0.06).contains(&ratio))) {
                    break z;
                }
            };
            let exponent = r.choose(&[1.0, 0.5, 0.25]);
            // 0 stands for the least one.
            let flatness = r.choose(&[0.05, 0.0]);
            let widens = r.choose(&[0.0, 1.0]);
            match r.below(12) {
                0 => z2 = r.choose(&[0.5, -2.0]) * z1,
                1 => z2 = Vec3::ZERO,
                2 => (z1, z2) = (Vec3::ZERO, Vec3::ZERO),
                _ => {}
            }
            let mut all = list32(
                &[z1, z2, n],
                &[r.range(0.1, 2.0), exponent, unit, 0.01, 1.0, flatness, widens, 0.0, 0.0],
            );
            all.push(code(shape));
            all
        });
        let results = twin_photons(gpu, 3, &table, &[]);
        let mut kept = 0;
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let twin = photon_kernel(&settings(&x), &differentials(&x, 0), v3(&x, 6));
            assert_eq!(result.bits(10) == 1, twin.is_some(), "{:?}", case.0);
            kept += u32::from(twin.is_some());
        }
        assert!((1000..table.len() as u32 - 50).contains(&kept), "{kept}");
        // In units of length, as components of the axes are sums whose rounding is that of the axes' length, 1 at most.
        let scaled: Vec<Results> = table
            .iter()
            .zip(&results)
            .map(|(case, result)| {
                let mut scaled = *result;
                let unit = case.0[11];
                (0..9).for_each(|i| scaled.0[i] /= unit);
                scaled.0[9] /= unit * unit;
                scaled
            })
            .collect();
        judge("kernels", &table, &scaled, ulps(32.0, 8.0, 16.0 * U), 9, |x| {
            photon_kernel(&settings(x), &differentials(x, 0), v3(x, 6)).map_or(vec![0.0; 10], |k| {
                let [along, across, extent] = [k.along, k.across, kernel_extent(&k)].map(|v| (v / x[11]).to_array());
                list![along, across, extent, [kernel_area(&k) / (x[11] * x[11])]]
            })
        });
    });
}

/// A kernel in f32 with a point about it.
fn random_kernel(r: &mut Random, size: f32) -> (Vec3, Vec3, Vec3, Vec3) {
    loop {
        let n = r.direction();
        let (a, b) = (r.vector().cross(n), r.vector().cross(n));
        let (a, b) = if a.length() < b.length() { (b, a) } else { (a, b) };
        let across = b.cross(n);
        let across = if across.dot(a) < 0.0 { -across } else { across };
        if across.dot(a) > 0.05 * a.length_squared() {
            let delta = r.signed() * a + r.signed() * b + 0.3 * r.signed() * b.length() * n;
            return (size * a, size * across, size * delta, n);
        }
    }
}

#[test]
fn weights_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(35, |r| {
            let size = r.choose(&[1e-3, 1.0, 1e3]);
            let (along, across, delta) = loop {
                let (along, across, delta, _) = random_kernel(r, size);
                let k = PhotonKernel {
                    along: along.as_dvec3(),
                    across: across.as_dvec3(),
                };
                // Clear of the rim, where the uniform profile jumps.
                let inside = |s: f64| kernel_weight(KernelProfile::Uniform, &k, s * delta.as_dvec3()) > 0.0;
                if inside(0.999) == inside(1.001) {
                    break (along, across, delta);
                }
            };
            let profile = code(r.below(3));
            list32(
                &[along, across, delta],
                &[profile, r.choose(&[0.0, 0.3, 0.9, 1.0, 2.0])],
            )
        });
        let results = twin_photons(gpu, 4, &table, &[]);
        judge("weights", &table, &results, ulps(16.0, 8.0, 0.0), 9, |x| {
            let k = PhotonKernel {
                along: v3(x, 0),
                across: v3(x, 3),
            };
            let profile = PROFILES[kind(x, 9)];
            vec![kernel_weight(profile, &k, v3(x, 6)), kernel_profile(profile, x[10])]
        });
    });
}

#[test]
fn records_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(36, |r| {
            let (along, across, delta, n) = random_kernel(r, 1.0);
            let position = 10.0 * r.vector();
            let normal = if r.below(8) == 0 {
                r.choose(&[Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y])
            } else {
                n
            };
            let color = r.magnitude(-12, 8) * Vec3::new(r.unit(), r.unit(), r.unit());
            let mut all = list32(
                &[position, normal, direction(r), color, along, across, position + delta],
                &[r.choose(&[0.0, f32::from_bits(PHOTON_LEAF_END)]), code(r.below(3))],
            );
            all.extend((if r.below(4) == 0 { -normal } else { normal }).to_array());
            all.push(0.0);
            all
        });
        let results = twin_photons(gpu, 5, &table, &[]);
        let mut seen = [0; 2];
        for (case, result) in table.iter().zip(&results) {
            let at = |i: usize| Vec3::from_slice(&case.0[i..]);
            let record = PhotonRecord {
                position: at(0),
                normal: at(3),
                direction: at(6),
                flux: at(9),
                along: at(12),
                across: at(15),
            };
            let mut words = pack_photon(&record);
            // Divisions may round otherwise than the twin's: a step of one coordinate.
            for (i, bits) in [(0usize, PHOTON_NORMAL_BITS), (1, PHOTON_DIRECTION_BITS)] {
                let coordinate = |word: u32, k: u32| i64::from((word >> (k * bits)) & ((1 << bits) - 1));
                for k in 0..2 {
                    let step = (coordinate(result.bits(i), k) - coordinate(words[i][3], k)).abs();
                    assert!(step <= 1, "{:?}", case.0);
                }
                words[i][3] = result.bits(i);
            }
            assert_eq!(result.bits(2), words[2][3], "{:?}", case.0);
            let back = unpack_photon(&words);
            for (i, value) in [(3, back.normal), (6, back.direction), (9, back.flux)] {
                let error = (result.vector(i) - value.as_dvec3()).abs().max_element();
                // A coordinate is a quotient of up to 2, good to 2.5 units in its last place, less one; normalised it errs by √3 of that.
                assert!(
                    error <= 24.0 * U * f64::from(value.abs().max_element()),
                    "{i}: {:?}",
                    case.0
                );
            }
            words[0][3] |= case.0[21].to_bits();
            assert_eq!(result.bits(13) == 1, photon_ends_leaf(&words));
            let facing = u32::from(at(23).dot(at(3)) > 0.0);
            seen[facing as usize] += 1;
            let weight = photon_weight(
                PROFILES[case.0[22].to_bits() as usize],
                &words,
                at(18).as_dvec3(),
                at(23).as_dvec3(),
                0.0,
            );
            if facing == 0 {
                assert_eq!((result.0[12], weight), (0.0, 0.0));
            }
        }
        assert!(seen[0] > 100 && seen[1] > 500);
        let weights: Vec<Results> = results.iter().map(|r| shift(r, 12)).collect();
        // The cone is continuous at its rim.
        let cones: Vec<usize> = (0..table.len()).filter(|i| table[*i].0[22].to_bits() == 1).collect();
        let chosen = |all: &[Results]| cones.iter().map(|i| all[*i]).collect::<Vec<_>>();
        let cone_table: Vec<Case> = cones.iter().map(|i| table[*i]).collect();
        judge(
            "photons",
            &cone_table,
            &chosen(&weights),
            ulps(16.0, 8.0, 0.0),
            21,
            |x| {
                let k = PhotonKernel {
                    along: v3(x, 12),
                    across: v3(x, 15),
                };
                let facing = v3(x, 3).dot(v3(x, 23)) > 0.0;
                let weight = kernel_weight(KernelProfile::Cone, &k, v3(x, 18) - v3(x, 0));
                vec![if facing { weight } else { 0.0 }]
            },
        );
    });
}

#[test]
fn records_of_events_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(38, |r| {
            let color = r.magnitude(-12, 8) * Vec3::new(r.unit(), r.unit(), r.unit());
            // Clear of the rim, where the uniform profile jumps.
            let d2 = r.choose(&[0.0, 0.2, 0.7, 0.98, 1.0, 1.5]);
            let rest = [
                r.magnitude(-10, 4),
                code(r.below(1 << 20)),
                code(r.below(80)),
                r.choose(&[0.0, f32::from_bits(EVENT_LEAF_END)]),
                code(r.below(3)),
                d2,
            ];
            list32(&[10.0 * r.vector(), direction(r), color], &rest)
        });
        let results = twin_photons(gpu, 6, &table, &[]);
        for (case, result) in table.iter().zip(&results) {
            let at = |i: usize| Vec3::from_slice(&case.0[i..]);
            let x = case.0.map(f64::from);
            let event = PhotonEvent {
                position: at(0),
                direction: at(3),
                flux: at(6),
                radius: case.0[9],
                medium: case.0[10].to_bits(),
                bounce: case.0[11].to_bits(),
            };
            let mut words = pack_event(&event);
            // Divisions may round otherwise than the twin's: a step of one coordinate.
            for k in 0..2 {
                let coordinate =
                    |word: u32| i64::from((word >> (k * PHOTON_DIRECTION_BITS)) & ((1 << PHOTON_DIRECTION_BITS) - 1));
                let step = (coordinate(result.bits(0)) - coordinate(words[1][2])).abs();
                assert!(step <= 1, "{:?}", case.0);
            }
            assert_eq!(
                result.bits(0) >> PHOTON_BOUNCE_SHIFT,
                words[1][2] >> PHOTON_BOUNCE_SHIFT
            );
            assert_eq!(result.bits(1), words[1][0], "{:?}", case.0);
            words[1][2] = result.bits(0);
            words[0][3] |= case.0[12].to_bits();
            let back = unpack_event(&words);
            for (i, value) in [(2, back.direction), (5, back.flux)] {
                let off = (result.vector(i) - value.as_dvec3()).abs().max_element();
                // Directions are decoded by a division and a normalization.
                assert!(
                    off <= 16.0 * U * f64::from(value.abs().max_element()),
                    "{:?}: {off} of {value}",
                    case.0
                );
            }
            assert_eq!((result.bits(8), result.bits(9)), (event.radius.to_bits(), event.medium));
            assert_eq!(
                (result.bits(10), result.bits(11) == 1),
                (back.bounce, event_ends_leaf(&words))
            );
            let ball = ball_profile(PROFILES[case.0[13].to_bits() as usize], x[14]);
            assert!((f64::from(result.0[12]) - ball).abs() <= 8.0 * U, "{:?}", case.0);
        }
    });
}

#[test]
fn footprints_in_media_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(39, |r| {
            let w = direction(r);
            // Steps across the way, clear of flat footprints, whose product cancels.
            let [z1, z2, w1, w2] = loop {
                let across = [0; 2].map(|_| r.vector().cross(w));
                if across[0].cross(across[1]).length() > 0.2 * across[0].length() * across[1].length() {
                    let further = r.range(0.1, 2.0);
                    break [across[0], across[1], further * across[0], further * across[1]];
                }
            };
            let size = r.choose(&[1e-3, 1.0, 1e3]);
            let rest = [
                r.magnitude(-8, 2),
                r.choose(&[0.0, 1.5, 10.0]),
                size,
                size * 1e-4,
                size * r.choose(&[0.3, 1e6]),
                size * r.range(0.1, 3.0),
            ];
            let densities = [
                r.magnitude(-8, 4) / size,
                r.magnitude(-4, 4) / size,
                r.range(1e-5, 1.0),
                r.range(0.01, 2.0),
                r.magnitude(-16, 4),
            ];
            let mut all = list32(&[size * z1, size * z2, w1, w2], &rest);
            all.extend(w.to_array());
            all.extend(densities);
            all
        });
        let results = twin_photons(gpu, 7, &table, &[]);
        // Powers of a third and logarithms; the area across a way cancels where edges are nearly along it.
        judge("footprints in media", &table, &results, ulps(64.0, 16.0, U), 26, |x| {
            let d = differentials(x, 0);
            let settings = EventKernelSettings {
                spread: x[12],
                dampening: x[13],
                unit_length: x[14],
                length_min: x[15],
                length_max: x[16],
            };
            let across = footprint_across(&d, x[17], v3(x, 18));
            let scattered = scattered_in_medium(across, x[21], x[22], x[23], v3(x, 18), x[24]);
            list![
                [
                    event_radius(&settings, across, x[21], x[22]),
                    scattered.z1.length(),
                    scattered.w2.length()
                ],
                passed_differentials(&d, x[23]).z2.to_array(),
                [across, log_of_one_plus(x[25])]
            ]
        });
    });
}

#[test]
fn beams_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(40, |r| {
            let color = r.magnitude(-12, 8) * Vec3::new(r.unit(), r.unit(), r.unit());
            // Clear of parallel ones, where the product cancels.
            let [ray, way] = loop {
                let [ray, way] = [direction(r), direction(r)];
                if ray.cross(way).length() > 0.1 {
                    break [ray, way];
                }
            };
            let start = 4.0 * r.vector();
            let rest = [code(r.below(1 << 20)), code(r.below(80))];
            let mut all = list32(&[start, start + way, color], &rest);
            all.extend(list32(
                &[4.0 * r.vector(), ray, way],
                &[
                    code(r.below(3)),
                    r.choose(&[0.0, 0.3, 0.98, 1.0]),
                    r.range(0.1, 10.0),
                    r.range(0.0, 2.0),
                    r.range(0.01, 1.0),
                    r.range(0.01, 1.0),
                ],
            ));
            all
        });
        let results = twin_photons(gpu, 8, &table, &[]);
        for (case, result) in table.iter().zip(&results) {
            let at = |i: usize| Vec3::from_slice(&case.0[i..]);
            let x = case.0.map(f64::from);
            let beam = PhotonBeam {
                start: at(0),
                end: at(3),
                flux: at(6),
                medium: case.0[9].to_bits(),
                bounce: case.0[10].to_bits(),
            };
            let words = pack_beam(&beam);
            assert_eq!([result.bits(0), result.bits(1)], [words[0][3], words[1][3]]);
            let back = unpack_beam(&words);
            assert_eq!([result.bits(2), result.bits(3)], [back.medium, back.bounce]);
            let meeting = meet_beam(v3(&x, 11), v3(&x, 14), v3(&x, 0), v3(&x, 17));
            // Products of lengths up to some metres over the sine's square, of at least a hundredth.
            let near = |i: usize, value: f64| (f64::from(result.0[i]) - value).abs() <= 4e4 * U;
            assert!(
                near(4, meeting.t) && near(5, meeting.along) && near(6, meeting.squared),
                "{:?}",
                case.0
            );
            assert!(
                (f64::from(result.0[7]) - meeting.sine).abs() <= 16.0 * U,
                "{:?}",
                case.0
            );
            let share = point_share(x[22], x[23], x[24], x[25], meeting.sine);
            // An exponential of up to twenty, and the sine of an angle above a tenth.
            assert!(
                (f64::from(result.0[9]) / share - 1.0).abs() <= 512.0 * U,
                "{:?}",
                case.0
            );
            let profile = PROFILES[case.0[20].to_bits() as usize];
            assert!(
                (f64::from(result.0[8]) - line_profile(profile, x[21])).abs() <= 8.0 * U,
                "{:?}",
                case.0
            );
        }
    });
}

#[test]
fn shares_with_eye_paths_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(42, |r| {
            let corners = [4.0 * r.vector(), 4.0 * r.vector()];
            list32(
                &corners,
                &[
                    r.magnitude(-6, 6),
                    r.unit(),
                    r.magnitude(-4, 6),
                    r.magnitude(-8, 2),
                    r.magnitude(0, 24),
                    code(r.below(2)),
                    r.choose(&[0.0, 0.01, 1.0, 30.0]),
                    r.choose(&[0.0, 2.5]),
                    code(r.below(3)),
                    r.range(0.0, 5.0),
                    code(r.below(2)),
                    r.choose(&[0.0, 3.0, -0.25, -f32::MIN_POSITIVE]),
                    r.magnitude(-8, 2),
                ],
            )
        });
        let results = twin_photons(gpu, 10, &table, &[]);
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let is = |i: usize| case.0[i].to_bits() != 0;
            let even2 = even_distance2(x[6], x[7], x[8], x[18], x[9], x[10], is(11));
            let placeless2 = placeless_distance2(v3(&x, 0), v3(&x, 3));
            let carried2 = carried_distance2(x[13], case.0[14].to_bits(), x[15], is(16));
            let twins = [
                even2,
                eye_share(x[12], even2),
                photon_share(x[12], even2),
                placeless2,
                carried2,
                even_distance2_across(across_of_planes(x[7], x[8]), x[6], x[10]),
                evened_distance2(x[12], x[6]),
                distance2_in_plane(x[17], x[15], x[6]),
            ];
            for (i, twin) in twins.into_iter().enumerate() {
                let found = f64::from(result.0[i]);
                assert!(
                    (found - twin).abs() <= 32.0 * U * twin,
                    "{i}: {found} {twin}, {:?}",
                    case.0
                );
            }
        }
    });
}

#[test]
fn planes_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(41, |r| {
            let color = r.magnitude(-12, 8) * Vec3::new(r.unit(), r.unit(), r.unit());
            // Clear of rays in the plane, where the product cancels.
            let [ray, first, second] = loop {
                let [ray, first, second] = [0; 3].map(|_| direction(r));
                if ray.dot(first.cross(second)).abs() > 0.1 {
                    break [ray, r.range(0.5, 2.0) * first, r.range(0.5, 2.0) * second];
                }
            };
            // Every fourth one is a beam.
            let second = if r.below(4) == 0 { Vec3::ZERO } else { second };
            let rest = [code(r.below(1 << 20)), code(r.below(80))];
            let mut all = list32(&[4.0 * r.vector(), first, second, color], &rest);
            let extinctions = [0; 3].map(|_| r.choose(&[0.0, 0.5, 1.0, 3.0]));
            let scatters = [0; 3].map(|_| r.choose(&[0.0, 0.25]));
            let media = [extinctions, scatters].map(Vec3::from_array);
            let light = r.choose(&[0.0, 2.5, -0.5]);
            all.extend(list32(&[4.0 * r.vector(), ray, media[0], media[1]], &[light]));
            all
        });
        let results = twin_photons(gpu, 9, &table, &[]);
        for (case, result) in table.iter().zip(&results) {
            let at = |i: usize| Vec3::from_slice(&case.0[i..]);
            let x = case.0.map(f64::from);
            let plane = PhotonPlane {
                start: at(0),
                first: at(3),
                second: at(6),
                flux: at(9),
                medium: case.0[12].to_bits(),
                bounce: case.0[13].to_bits(),
                light: case.0[26],
            };
            let words = pack_plane(&plane);
            assert_eq!([result.bits(0), result.bits(1)], [words[0][3], words[1][3]]);
            assert_eq!(result.bits(2), u32::from(is_plane(&words)));
            let back = unpack_plane(&words);
            assert_eq!([result.bits(3), result.bits(4)], [back.medium, back.bounce]);
            assert_eq!([result.0[14], back.light], [plane.light; 2]);
            // The end of the first flight was rounded.
            let off = Vec3::from_slice(&result.0[5..]) - back.first;
            assert!(f64::from(off.abs().max_element()) <= 16.0 * U, "{off}");
            let extinctions = [least_extinction(v3(&x, 20)), plane_extinction(v3(&x, 23), v3(&x, 20))];
            for (found, expected) in result.0[12..].iter().zip(extinctions) {
                assert!(
                    *found == expected as f32 || expected.is_infinite() && *found > 1e38,
                    "{found} {expected}"
                );
            }
            if !is_plane(&words) {
                assert_eq!(result.0[11], 0.0);
                continue;
            }
            let [start, first, second] = [back.start, back.first, back.second].map(|v| v.as_dvec3());
            let met = meet_plane(v3(&x, 14), v3(&x, 17), start, first, second);
            // Products of lengths up to some metres over a volume of at least a fortieth.
            let near = |i: usize, value: f64| (f64::from(result.0[i]) - value).abs() <= 4e4 * U;
            assert!(
                near(8, met.t) && near(9, met.along[0]) && near(10, met.along[1]),
                "{:?}",
                case.0
            );
            assert!(
                (f64::from(result.0[11]) - met.jacobian).abs() <= 64.0 * U,
                "{:?}",
                case.0
            );
        }
    });
}

#[test]
fn steps_through_grids_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(44, |r| {
            let real: [f32; 3] = std::array::from_fn(|_| r.choose(&[0.0, 0.02, 0.2, 0.7, 1.0]) * r.range(0.9, 1.0));
            let passed: [f32; 3] = std::array::from_fn(|_| r.choose(&[0.0, 0.05, 0.3, 1.0]) * r.range(0.9, 1.0));
            let mut all = real.to_vec();
            all.extend(passed);
            all.extend([code(r.below(WAY_STEPS as usize)), r.unit(), r.unit()]);
            all
        });
        let results = twin_photons(gpu, 11, &table, &[]);
        let mut steps = 0;
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let (is_step, passed) = attenuate(v3(&x, 0), case.0[6].to_bits(), [x[7], x[8]], v3(&x, 3));
            assert_eq!(result.bits(0), u32::from(is_step), "{:?}", case.0);
            steps += u32::from(is_step);
            for band in 0..3 {
                let found = f64::from(result.0[1 + band]);
                // A quotient taken from one, of what has passed at most, and doubled.
                assert!(
                    (found - passed[band]).abs() <= 16.0 * U,
                    "{:?}: {found}, {passed}",
                    case.0
                );
            }
        }
        assert!(steps > 300, "{steps}");
    });
}

#[test]
fn short_ways_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(43, |r| {
            let scatters: [f32; 3] = std::array::from_fn(|_| r.choose(&[0.0, 0.25, 0.5]));
            let mut all = scatters.to_vec();
            // One band at least.
            all[0] = all[0].max(0.25);
            all.extend(scatters.map(|sigma| sigma.max(0.25) + r.choose(&[0.0, 0.1, 3.0, 100.0])));
            all
        });
        let results = twin_photons(gpu, 12, &table, &[]);
        judge("short beams", &table, &results, ulps(2.0, 2.0, 0.0), 6, |x| {
            short_way_extinction(v3(x, 0), v3(x, 3)).to_array().to_vec()
        });
    });
}
