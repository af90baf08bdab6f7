use super::*;
use crate::test_random::Random;

fn bounds(lower: [f64; 3], upper: [f64; 3]) -> Bounds {
    Bounds {
        lower: lower.into(),
        upper: upper.into(),
    }
}

const CUBE: Bounds = Bounds {
    lower: DVec3::ZERO,
    upper: DVec3::ONE,
};

const ROOM: Bounds = Bounds {
    lower: DVec3::ZERO,
    upper: DVec3::new(10.0, 6.0, 3.0),
};

/// Scene, node, and probabilities: exact (by 4·10⁶ samples, ±2·10⁻⁴), 26 regions, SIROH, surface areas.
fn table() -> [(Bounds, Bounds, [f64; 4]); 12] {
    let cube = |lower, upper, of| (CUBE, bounds(lower, upper), of);
    let room = |lower, upper, of| (ROOM, bounds(lower, upper), of);
    [
        cube([0.0; 3], [1.0; 3], [1.0; 4]),
        cube([0.0; 3], [0.5, 1.0, 1.0], [0.6240, 0.6476, 0.6250, 0.6667]),
        cube([0.0; 3], [0.1, 1.0, 1.0], [0.2605, 0.2677, 0.2607, 0.4000]),
        cube([0.0; 3], [0.5; 3], [0.2180, 0.2179, 0.2188, 0.2500]),
        cube([0.25; 3], [0.75; 3], [0.2683, 0.2901, 0.2500, 0.2500]),
        cube([0.45; 3], [0.55; 3], [0.00971, 0.00773, 0.00811, 0.0100]),
        cube([0.0; 3], [0.1; 3], [0.00412, 0.00301, 0.00582, 0.0100]),
        cube([0.5, 0.0, 0.0], [0.5, 1.0, 1.0], [0.2480, 0.2952, 0.2500, 0.3333]),
        cube([0.0; 3], [0.0, 1.0, 1.0], [0.16667, 0.16667, 0.16667, 0.3333]),
        room([4.5, 2.5, 1.0], [5.5, 3.5, 2.0], [0.0277, 0.0208, 0.0243, 0.0278]),
        room([0.0; 3], [5.0, 6.0, 3.0], [0.5719, 0.5647, 0.5714, 0.5833]),
        room([0.0; 3], [10.0, 6.0, 0.3], [0.3576, 0.4085, 0.3616, 0.6000]),
    ]
}

#[test]
fn probabilities_are_those_of_the_reference_table() {
    for (scene, node, expected) in table() {
        let order = [
            Heuristic::Exact,
            Heuristic::Regions,
            Heuristic::InteriorOrigin,
            Heuristic::SurfaceArea,
        ];
        for (heuristic, expected) in order.into_iter().zip(expected) {
            let found = heuristic.probability(&node, &scene);
            // The samples' error, or the digits of the table.
            let bound = if heuristic == Heuristic::Exact { 4e-4 } else { 6e-5 };
            assert!(
                (found - expected).abs() < bound,
                "{heuristic:?} {node:?}: {found} for {expected}"
            );
        }
    }
}

/// Nodes and weights of Gauss and Legendre with five points on [0, 1].
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_095),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683),
    (0.5, 0.284_444_444_444_444),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683),
    (0.953_089_922_969_332, 0.118_463_442_528_095),
];

/// Ends of the parts into which a range is cut, ever smaller ones towards the given places, where the solid angle has no derivative.
fn graded(range: [f64; 2], towards: &[f64]) -> Vec<f64> {
    const RATIO: f64 = 0.35;
    const PARTS: i32 = 9;
    let mut ends = range.to_vec();
    let inside = towards.iter().copied().filter(|at| (range[0]..=range[1]).contains(at));
    let mut corners: Vec<f64> = inside.chain(range).collect();
    corners.sort_by(f64::total_cmp);
    for pair in corners.windows(2) {
        let length = pair[1] - pair[0];
        for part in 0..PARTS {
            let share = 0.5 * length * RATIO.powi(part);
            if towards.contains(&pair[0]) {
                ends.push(pair[0] + share);
            }
            if towards.contains(&pair[1]) {
                ends.push(pair[1] - share);
            }
        }
    }
    ends.extend(corners);
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    ends
}

/// Integral over a box of the solid angle of one side of the node.
fn integrate(node: &Bounds, axis: usize, upper: bool, part: &Bounds) -> f64 {
    let plane = if upper { node.upper[axis] } else { node.lower[axis] };
    let ends = [0, 1, 2].map(|a| {
        let towards = if a == axis {
            vec![plane]
        } else {
            vec![node.lower[a], node.upper[a]]
        };
        graded([part.lower[a], part.upper[a]], &towards)
    });
    let mut sum = 0.0;
    for x in ends[0].windows(2) {
        for y in ends[1].windows(2) {
            for z in ends[2].windows(2) {
                let lower = DVec3::new(x[0], y[0], z[0]);
                let extent = DVec3::new(x[1], y[1], z[1]) - lower;
                let volume = extent.x * extent.y * extent.z;
                for (u, wu) in GAUSS {
                    for (v, wv) in GAUSS {
                        for (w, ww) in GAUSS {
                            let at = lower + extent * DVec3::new(u, v, w);
                            sum += volume * wu * wv * ww * rectangle_solid_angle(node, axis, upper, at);
                        }
                    }
                }
            }
        }
    }
    sum
}

#[test]
fn the_closed_form_is_the_integral_of_solid_angles() {
    for (scene, node) in [
        (CUBE, bounds([0.2, 0.3, 0.1], [0.6, 0.5, 0.8])),
        (ROOM, bounds([0.0, 1.0, 0.0], [3.0, 6.0, 0.5])),
    ] {
        let mut integral = node.volume();
        for axis in 0..3 {
            for upper in [false, true] {
                let mut beyond = scene;
                if upper {
                    beyond.lower[axis] = node.upper[axis];
                } else {
                    beyond.upper[axis] = node.lower[axis];
                }
                if beyond.volume() > 0.0 {
                    integral += integrate(&node, axis, upper, &beyond) / (4.0 * PI);
                }
            }
        }
        let (integral, closed) = (integral / scene.volume(), exact(&node, &scene));
        assert!((integral - closed).abs() < 1e-6, "{node:?}: {integral} and {closed}");
    }
}

#[test]
fn parts_handed_down_are_those_of_the_children() {
    for (scene, node, _) in table() {
        let parent = InteriorOrigin::new(&node, &scene);
        for axis in 0..3 {
            let extent = node.extent()[axis];
            if extent <= 0.0 {
                continue;
            }
            let terms = parent.terms(&node, &scene, axis);
            for share in [0.0, 0.3, 0.5, 1.0] {
                let plane = node.lower[axis] + share * extent;
                let found = terms.split(
                    [plane - node.lower[axis], node.upper[axis] - plane],
                    [plane - scene.lower[axis], scene.upper[axis] - plane],
                );
                let expected = node
                    .split(axis, plane)
                    .map(|child| InteriorOrigin::new(&child, &scene).sum());
                for side in 0..2 {
                    assert!((found[side] - expected[side]).abs() < 1e-12, "{node:?} {axis} {share}");
                }
            }
        }
    }
}

#[test]
fn shared_terms_give_the_areas_of_the_children_to_the_bit() {
    let mut random = Random(74);
    for _ in 0..2000 {
        let mut corners = [(); 4].map(|()| (random.vector() * random.magnitude(-8, 8)).as_dvec3());
        // The scene, and the node within it; some have no extent.
        let whole = corners
            .iter()
            .fold((corners[0], corners[0]), |(a, b), c| (a.min(*c), b.max(*c)));
        let axis = random.below(3);
        if random.below(8) == 0 {
            corners[1][axis] = corners[0][axis];
        }
        let scene = bounds(whole.0.into(), whole.1.into());
        let node = bounds(corners[0].min(corners[1]).into(), corners[0].max(corners[1]).into());
        for axis in 0..3 {
            let terms = AreaTerms::new(&node, &scene, axis);
            for share in [0.0, random.unit(), random.unit(), 1.0] {
                let plane = node.lower[axis] + f64::from(share) * node.extent()[axis];
                let plane = plane.clamp(node.lower[axis], node.upper[axis]);
                let found = terms.split([plane - node.lower[axis], node.upper[axis] - plane]);
                let expected = node
                    .split(axis, plane)
                    .map(|child| Heuristic::SurfaceArea.probability(&child, &scene));
                assert_eq!(
                    found.map(f64::to_bits),
                    expected.map(f64::to_bits),
                    "{node:?} {axis} {plane}"
                );
            }
        }
    }
}

#[test]
fn every_heuristic_gives_the_scene_itself_one() {
    for heuristic in Heuristic::ALL {
        for scene in [CUBE, ROOM, bounds([-3.0, 5.0, 100.0], [1.0, 5.5, 101.0])] {
            let whole = heuristic.probability(&scene, &scene);
            assert!((whole - 1.0).abs() < 1e-9, "{heuristic:?}: {whole}");
        }
    }
}
