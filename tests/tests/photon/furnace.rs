//! A closed furnace, where light is even: a map seen directly is flat but for what kernels lose at edges, and behind a final gather every place
//! lacks the mean of that loss over what it sees. Both have closed forms.

use super::*;
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::render::builtin;
use clerestory_tests::statistics::expect_mean_of;
use clerestory_tests::with_gpu;
use glam::{DVec2, DVec3};

/// Reflectance of a room of 2 m whose walls emit radiance 1.
const RHO: f64 = 0.5;
/// Of kernels, m: two pixels.
const RADIUS: f64 = 0.25;
const PASSES: u32 = 24;
/// Eye paths per pixel and pass.
const EYE_PATHS: u32 = 16;
/// Kernels' stored axes, and the sums below: a few thousandths.
const BIAS: f64 = 4e-3;

/// What of the kernel about a place lies on its wall: the place is so far, m, from the nearest two edges, which meet at a right angle.
fn coverage(to_edges: DVec2) -> f64 {
    const STEPS: u32 = 64;
    let [x, y] = (to_edges / RADIUS).clamp(DVec2::ZERO, DVec2::ONE).to_array();
    if x.min(y) >= 1.0 {
        return 1.0;
    }
    // Of 2/π (1 − u² − v²) over the unit disk: along v in closed form.
    let width = (x + 1.0) / f64::from(STEPS);
    let column = |step: u32| {
        let u = -1.0 + (f64::from(step) + 0.5) * width;
        let half = (1.0 - u * u).max(0.0).sqrt();
        let primitive = |v: f64| (1.0 - u * u) * v - v * v * v / 3.0;
        2.0 / PI * (primitive(y.min(half)) - primitive(-half)) * width
    };
    (0..STEPS).map(column).sum()
}

/// Mean by the cosine of what a place of the wall z = −1 sees of the coverage of the other walls.
fn gathered(place: DVec2) -> f64 {
    const STRATA: u32 = 48;
    let from = place.extend(-1.0);
    let of = |i: u32| {
        let squared = (f64::from(i / STRATA) + 0.5) / f64::from(STRATA);
        let phi = 2.0 * PI * (f64::from(i % STRATA) + 0.5) / f64::from(STRATA);
        let radius = squared.sqrt();
        let d = DVec3::new(radius * phi.cos(), radius * phi.sin(), (1.0 - squared).sqrt());
        let to_planes = (d.signum() - from) / d;
        let distance = to_planes.min_element();
        let edges = (1.0 - (from + distance * d).abs()).max(DVec3::ZERO);
        // Off its own plane a hit is at none.
        let on_wall = if distance == to_planes.x {
            DVec2::new(edges.y, edges.z)
        } else if distance == to_planes.y {
            DVec2::new(edges.x, edges.z)
        } else {
            edges.truncate()
        };
        coverage(on_wall)
    };
    (0..STRATA * STRATA).map(of).sum::<f64>() / f64::from(STRATA * STRATA)
}

/// Corners of the picture, its other rim, and what is farther than a kernel from every edge; `None` between.
fn region(x: u32, y: u32) -> Option<usize> {
    let [across, down] = [x, y].map(|i| i.min(SIDE - 1 - i));
    match (across, down) {
        (0, 0) => Some(0),
        (0, _) | (_, 0) => Some(1),
        _ => (across.min(down) >= 2).then_some(2),
    }
}

const REGIONS: [&str; 3] = ["corners", "rim", "middle"];

/// Means over the regions of values of pixels.
fn means_of_regions(value: impl Fn(u32, u32) -> f64) -> [f64; 3] {
    let mut sums = [(0.0, 0.0); 3];
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        if let Some(region) = region(x, y) {
            sums[region].0 += value(x, y);
            sums[region].1 += 1.0;
        }
    }
    sums.map(|(sum, count)| sum / count)
}

/// The same of a function over the wall [−1, 1]², by so many points along a side of each pixel; the function is the same in all quarters.
fn expected(points: u32, of: impl Fn(DVec2) -> f64) -> [f64; 3] {
    let half = SIDE / 2;
    let pixel = |x: u32, y: u32| {
        let at =
            |i: u32, point: u32| (f64::from(i) + (f64::from(point) + 0.5) / f64::from(points)) / f64::from(half) - 1.0;
        let all = (0..points * points).map(|p| of(DVec2::new(at(x, p % points), at(y, p / points))));
        all.sum::<f64>() / f64::from(points * points)
    };
    let quarter: Vec<f64> = (0..half * half).map(|i| pixel(i % half, i / half)).collect();
    means_of_regions(|x, y| {
        let [x, y] = [x, y].map(|i| i.min(SIDE - 1 - i));
        quarter[(y * half + x) as usize]
    })
}

#[test]
fn maps_are_dark_at_edges_by_what_kernels_lose_and_a_gather_evens_it_out() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=1");
        // All of the wall z = −1.
        scene.cameras = vec![orthographic(DVec3::Z * 0.9, DVec3::ZERO, DVec3::Y, 1.0)];
        // Light of two reflections and more. A gather sees that of two by shadow rays, and the rest in the map.
        let whole = RHO * RHO / (1.0 - RHO);
        let seen = expected(8, |place| whole * coverage(1.0 - place.abs()));
        let behind = expected(3, |place| RHO * (RHO + whole * gathered(place)));
        println!("expected: {seen:?} seen directly, {behind:?} behind a gather");
        // What corners, which have half of their light seen directly, lack behind a gather is a third of that at most.
        assert!(seen[0] < 0.5 * seen[2] && behind[0] > 0.83 * behind[2]);
        for (final_gather, expected) in [(false, seen), (true, behind)] {
            let settings = PhotonSettings {
                final_gather,
                samples_per_pass: EYE_PATHS,
                ..fixed("bounces=2..", RADIUS as f32)
            };
            let mut mapper = mapper(gpu, &scene, &settings);
            let mut passes = vec![[0.0; 3]];
            for pass in 1..=PASSES {
                let picture = advance(&mut mapper, pass * EYE_PATHS);
                let mean = means_of_regions(|x, y| {
                    let first = 3 * (y * SIDE + x) as usize;
                    picture[first..first + 3].iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0
                });
                passes.push(mean.map(|mean| mean * f64::from(pass)));
            }
            for (region, name) in REGIONS.into_iter().enumerate() {
                let of_pass = |pair: &[[f64; 3]]| pair[1][region] - pair[0][region];
                let values: Vec<f64> = passes.windows(2).map(of_pass).collect();
                let what = format!("final gather {final_gather}, {name}");
                expect_mean_of(&what, &values, expected[region], 0.0, BIAS * expected[region]);
            }
        }
    });
}
