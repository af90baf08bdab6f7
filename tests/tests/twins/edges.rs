//! The geometry term between two points and its bounds: twins, and the closed forms that sums over virtual lights must have, on the device and in f64.

use std::f64::consts::{FRAC_PI_2, PI};

use super::*;
use clerestory::gpu::shaders::constants::{EDGE_DISTANCE, EDGE_GEOMETRY, EDGE_UNBOUNDED};
use clerestory::transport::edge_bound::{EdgeBound, bounded_share, geometry_term};
use clerestory_tests::with_gpu;

const EDGES: u32 = 14;
/// Edges of a case, and where their bound stands.
const PER_CASE: usize = 8;
const KIND: usize = 3 * PER_CASE;
const BOUND: usize = KIND + 1;

/// Cosines at both ends and the squared distance.
type Edge = [f64; 3];

fn words(bound: EdgeBound) -> [f32; 2] {
    let (kind, value) = match bound {
        EdgeBound::Unbounded => (EDGE_UNBOUNDED, 0.0),
        EdgeBound::Geometry(value) => (EDGE_GEOMETRY, value),
        EdgeBound::Distance(value) => (EDGE_DISTANCE, value),
    };
    [f32::from_bits(kind), value as f32]
}

/// Geometry terms and shares of edges, as the device has them, and as their twins do.
fn edges(gpu: &Gpu, bound: EdgeBound, all: &[Edge]) -> [Vec<[f64; 2]>; 2] {
    let case = |edges: &[Edge]| {
        let mut numbers = [0f32; BOUND + 1];
        // Those that fill up the last case stand far apart.
        for i in 0..PER_CASE {
            let edge = edges.get(i).unwrap_or(&[1.0, 1.0, 1e6]);
            (0..3).for_each(|k| numbers[3 * i + k] = edge[k] as f32);
        }
        numbers[KIND..].copy_from_slice(&words(bound));
        Case::new(&numbers)
    };
    let table: Vec<Case> = all.chunks(PER_CASE).map(case).collect();
    let results = twin_math(gpu, EDGES, &table, &[]);
    let on_device = all.iter().enumerate().map(|(i, _)| {
        let result = &results[i / PER_CASE].0;
        [result[i % PER_CASE], result[PER_CASE + i % PER_CASE]].map(f64::from)
    });
    let twin = all
        .iter()
        .map(|&[a, b, squared]| [geometry_term(a, b, squared), bounded_share(bound, a, b, squared)]);
    [on_device.collect(), twin.collect()]
}

/// Checks a weighted sum over edges, on the device and in f64.
fn expect_sum(
    gpu: &Gpu,
    what: &str,
    bound: EdgeBound,
    weighted: &[(Edge, f64)],
    of: impl Fn([f64; 2]) -> f64,
    expected: f64,
    allowed: f64,
) {
    let all: Vec<Edge> = weighted.iter().map(|(edge, _)| *edge).collect();
    for (who, values) in ["device", "twin"].iter().zip(edges(gpu, bound, &all)) {
        let sum: f64 = values
            .iter()
            .zip(weighted)
            .map(|(value, (_, weight))| of(*value) * weight)
            .sum();
        println!("{what}, {who}: {sum:.6}, expected {expected}");
        assert!(
            (sum - expected).abs() <= allowed,
            "{what}, {who}: {sum} instead of {expected}"
        );
    }
}

#[test]
fn edges_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(31, |r| {
            let mut all = Vec::new();
            for _ in 0..PER_CASE {
                let squared = r.choose(&[1e-12, 1e-4, 1.0, 1e6]) * (r.unit() + 0.1);
                all.extend([unit(r), unit(r), squared]);
            }
            let kind = r.choose(&[EDGE_UNBOUNDED, EDGE_GEOMETRY, EDGE_DISTANCE]);
            all.extend([f32::from_bits(kind), r.choose(&[1e-6, 1.0, 1e6])]);
            all
        });
        check(gpu, "edges", EDGES, &table, ulps(4.0, 2.0, 0.0), 3 * PER_CASE, |x| {
            let bound = match (x[KIND] as f32).to_bits() {
                EDGE_GEOMETRY => EdgeBound::Geometry(x[BOUND]),
                EDGE_DISTANCE => EdgeBound::Distance(x[BOUND]),
                _ => EdgeBound::Unbounded,
            };
            let edge = |i: usize| (x[3 * i], x[3 * i + 1], x[3 * i + 2]);
            let terms = (0..PER_CASE).map(|i| {
                let (a, b, squared) = edge(i);
                geometry_term(a, b, squared)
            });
            let shares = (0..PER_CASE).map(|i| {
                let (a, b, squared) = edge(i);
                bounded_share(bound, a, b, squared)
            });
            terms.chain(shares).collect()
        });
    });
}

/// A diffuse sphere of radius R with a light of power Φ at its centre: the irradiance of light reflected once is ρΦ/(4πR²) everywhere, from one virtual light
/// anywhere, as from many.
#[test]
fn in_a_sphere_every_virtual_light_brings_the_same() {
    with_gpu(|gpu| {
        let (rho, power) = (0.7, 3.0);
        let mut random = Random(17);
        for radius in [1e-3, 1.0, 1e3] {
            for lights in [1, 7, 64] {
                let receiver = random.direction().as_dvec3().normalize();
                let weighted: Vec<(Edge, f64)> = (0..lights)
                    .map(|_| {
                        let place = random.direction().as_dvec3().normalize();
                        let way = (receiver - place) * radius;
                        let (squared, unit) = (way.length_squared(), way.normalize());
                        // Normals point inwards.
                        let edge = [-place.dot(unit), receiver.dot(unit), squared];
                        (edge.map(f64::abs), rho * power / f64::from(lights) / PI)
                    })
                    .collect();
                let expected = rho * power / (4.0 * PI * radius * radius);
                let what = format!("radius {radius}, {lights} lights");
                expect_sum(
                    gpu,
                    &what,
                    EdgeBound::Unbounded,
                    &weighted,
                    |[g, _]| g,
                    expected,
                    1e-4 * expected,
                );
            }
        }
    });
}

/// Edges of a sphere of radius 1 whose squared lengths are spread evenly, as those between evenly distributed points are.
fn sphere_edges(count: u32) -> Vec<(Edge, f64)> {
    let edge = |i: u32| {
        let squared = 4.0 * (f64::from(i) + 0.5) / f64::from(count);
        let cos = 0.5 * squared.sqrt();
        // Over the term that all of them have.
        ([cos, cos, squared], 4.0 / f64::from(count))
    };
    (0..count).map(edge).collect()
}

#[test]
fn distances_that_are_bounded_lose_what_the_sphere_says() {
    with_gpu(|gpu| {
        let weighted = sphere_edges(1 << 15);
        for (least, lost) in [(0.01, 0.001_25), (0.1, 0.0125), (0.5, 0.0625)] {
            let bound = EdgeBound::Distance(least);
            expect_sum(
                gpu,
                &format!("lost to {least} m²"),
                bound,
                &weighted,
                |[g, share]| g * (1.0 - share),
                lost,
                1e-3 * lost,
            );
        }
        // A bound of the term loses nothing, or the same of each edge.
        for (most, lost) in [(0.3, 0.0), (0.125, 0.5), (0.025, 0.9)] {
            let bound = EdgeBound::Geometry(most);
            let what = format!("lost to {most} 1/m²");
            expect_sum(gpu, &what, bound, &weighted, |[g, share]| g * (1.0 - share), lost, 1e-5);
        }
    });
}

/// The part of the irradiance from an endless wall of even radiance that min(G, 1) leaves out, at a distance from the wall of so many 1/√b.
#[test]
fn what_a_bound_leaves_of_a_wall_is_the_published_table() {
    const ACROSS: u32 = 256;
    const AROUND: u32 = 128;
    with_gpu(|gpu| {
        for (h, residual) in [
            (0.02, 0.4214),
            (0.05, 0.3565),
            (0.1, 0.2763),
            (0.2, 0.1615),
            (0.3, 0.0831),
            (0.4, 0.0322),
            (0.5, 0.005_36),
            (0.56, 0.000_106),
            (0.57, 0.0),
            (0.8, 0.0),
        ] {
            // About the foot of the point on the wall: nothing farther than 1/√b is left out. Even in the angle under which the point sees the wall.
            let widest = (1.0f64 / h).atan();
            let weighted: Vec<(Edge, f64)> = (0..ACROSS * AROUND)
                .map(|i| {
                    let [across, around] = [i % ACROSS, i / ACROSS].map(|i| f64::from(i) + 0.5);
                    let angle = widest * across / f64::from(ACROSS);
                    let turn = PI * around / f64::from(AROUND);
                    let r = h * angle.tan();
                    let squared = h * h + r * r;
                    let distance = squared.sqrt();
                    let slope = h / angle.cos().powi(2);
                    let area = r * slope * (widest / f64::from(ACROSS)) * (PI / f64::from(AROUND));
                    ([r * turn.sin() / distance, h / distance, squared], area / PI)
                })
                .collect();
            expect_sum(
                gpu,
                &format!("h √b = {h}"),
                EdgeBound::Geometry(1.0),
                &weighted,
                |[g, share]| g * (1.0 - share),
                residual,
                // Half a unit of the table's last digit, and what so many points err by.
                6e-5_f64.max(2e-3 * residual),
            );
        }
    });
}

/// The faces of a cube of 2 m that emit and reflect nothing, as virtual lights of what their parts emit: anywhere inside, and whichever way a surface faces there, as much arrives as
/// they emit.
#[test]
fn faces_that_emit_bring_their_own_emission_inside() {
    const PARTS: u32 = 64;
    with_gpu(|gpu| {
        let emission = 3.0;
        let part = 2.0 / f64::from(PARTS);
        let middle = |i: u32| (f64::from(i) + 0.5) * part - 1.0;
        let mut random = Random(23);
        let mut receivers: Vec<(DVec3, DVec3)> = (0..3)
            .map(|_| {
                let place = 0.5 * random.vector().as_dvec3();
                (place, random.direction().as_dvec3())
            })
            .collect();
        // In the middle of a face, which sees the five others.
        receivers.push((DVec3::Y, DVec3::NEG_Y));
        for (place, normal) in receivers {
            let mut weighted = Vec::new();
            for axis in 0..3 {
                for side in [-1.0, 1.0] {
                    for i in 0..PARTS * PARTS {
                        let mut light = DVec3::ZERO;
                        light[axis] = side;
                        let inwards = -light;
                        light[(axis + 1) % 3] = middle(i % PARTS);
                        light[(axis + 2) % 3] = middle(i / PARTS);
                        let way = place - light;
                        let squared = way.length_squared();
                        let unit = way / squared.sqrt();
                        let (leaves, arrives) = (inwards.dot(unit), -normal.dot(unit));
                        if leaves > 0.0 && arrives > 0.0 {
                            weighted.push(([leaves, arrives, squared], emission * part * part / PI));
                        }
                    }
                }
            }
            expect_sum(
                gpu,
                &format!("faces that emit {emission} W/m², at {place} towards {normal}"),
                EdgeBound::Unbounded,
                &weighted,
                |[g, _]| g,
                emission,
                0.01 * emission,
            );
        }
    });
}

/// Virtual lights of a flux of 1 in all, evenly over a unit square: what they bring to another one is the form factor.
#[test]
fn squares_have_their_form_factors() {
    with_gpu(|gpu| {
        // Places on two squares matter by their differences alone.
        let centre = |i: u32, of: u32| (f64::from(i) + 0.5) / f64::from(of);
        const SIDE: u32 = 128;
        for (apart, factor) in [(1.0f64, 0.199_825), (0.5, 0.415_253), (2.0, 0.068_590)] {
            let weighted: Vec<(Edge, f64)> = (0..SIDE * SIDE)
                .map(|i| {
                    let [u, v] = [i % SIDE, i / SIDE].map(|i| centre(i, SIDE));
                    let squared = u * u + v * v + apart * apart;
                    let cos = apart / squared.sqrt();
                    // Both signs of either difference.
                    let weight = 4.0 * (1.0 - u) * (1.0 - v) / f64::from(SIDE * SIDE) / PI;
                    ([cos, cos, squared], weight)
                })
                .collect();
            let what = format!("parallel squares {apart} m apart");
            expect_sum(gpu, &what, EdgeBound::Unbounded, &weighted, |[g, _]| g, factor, 2e-5);
        }
        // Around their common edge: how far away, in which direction, and how far along.
        const PARTS: u32 = 48;
        let mut weighted = Vec::new();
        for i in 0..PARTS * PARTS * PARTS {
            let [far, turn, along] = [i % PARTS, i / PARTS % PARTS, i / PARTS / PARTS].map(|i| centre(i, PARTS));
            // Denser towards the edge.
            let (turn, along) = (FRAC_PI_2 * turn, along * along);
            let longest = 1.0 / turn.sin().max(turn.cos());
            let r = longest * far * far;
            let (x, z) = (r * turn.cos(), r * turn.sin());
            let squared = r * r + along * along;
            let distance = squared.sqrt();
            let volume = r * (2.0 * longest * far) * FRAC_PI_2 * (2.0 * along.sqrt()) / f64::from(PARTS.pow(3));
            weighted.push(([z / distance, x / distance, squared], 2.0 * (1.0 - along) * volume / PI));
        }
        let what = "squares with a common edge";
        expect_sum(gpu, what, EdgeBound::Unbounded, &weighted, |[g, _]| g, 0.200_044, 2e-4);
    });
}
