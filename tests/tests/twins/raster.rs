//! Cuts of triangles along the planes of octants, and pieces of triangles. Their twins are of the same precision: what may differ is a
//! quotient's last digits, and what follows from them.

use clerestory::raster::octants::{OctantPolygon, octant_half, octant_of, octant_outline, octant_strip_corner};
use clerestory::raster::tessellation::{MAX_LEVEL, tessellation_point, tessellation_weights};
use clerestory_tests::random::Random;
use clerestory_tests::twin::Case;
use clerestory_tests::{twin_kernel, with_gpu};
use glam::{Vec2, Vec3};

use crate::cases;

twin_kernel!(twin_raster);

/// Quotients may be off by 2.5 ulp, sums are of eight corners times up to eight: of coordinates below 4.
const TOLERANCE: f32 = 64.0 / 16_777_216.0 * 36.0;

fn corners(case: &Case) -> [Vec3; 3] {
    [0, 3, 6].map(|i| Vec3::from_slice(&case.0[i..]))
}

/// Generic ones, and others on a lattice.
fn triangle(random: &mut Random) -> Vec<f32> {
    let is_generic = random.below(2) == 0;
    let mut corner = || {
        let p = random.vector();
        if is_generic { p } else { (3.0 * p).round() }.to_array()
    };
    [corner(), corner(), corner()].concat()
}

fn with(mut numbers: Vec<f32>, words: &[u32]) -> Vec<f32> {
    numbers.extend(words.iter().map(|word| f32::from_bits(*word)));
    numbers
}

fn digest(polygon: &OctantPolygon) -> (u32, Vec3, Vec2) {
    let count = polygon.corners.len();
    let (mut p, mut weights) = (Vec3::ZERO, Vec2::ZERO);
    for place in 0..count {
        let corner = polygon.corners[octant_strip_corner(place, count)];
        p += (place + 1) as f32 * corner.p;
        weights += (place + 1) as f32 * corner.weights;
    }
    (count as u32, p, weights)
}

fn judge(what: &str, function: u32, table: &[Case], twin: impl Fn(&Case) -> OctantPolygon) {
    with_gpu(|gpu| {
        for (case, result) in table.iter().zip(twin_raster(gpu, function, table, &[])) {
            let (count, p, weights) = digest(&twin(case));
            assert_eq!(result.bits(0), count, "{what}: {case:?}");
            let found = Vec3::from_slice(&result.0[1..]);
            assert!(
                (found - p).abs().max_element() <= TOLERANCE,
                "{what}: {found} {p} {case:?}"
            );
            let found = Vec2::from_slice(&result.0[4..]);
            assert!(
                (found - weights).abs().max_element() <= TOLERANCE,
                "{what}: {found} {weights} {case:?}"
            );
            if function == 0 {
                assert_eq!(result.bits(6), octant_of(corners(case)[0]), "{case:?}");
            }
        }
    });
}

#[test]
fn pieces_of_octants_agree_with_their_twins() {
    let table = cases(50, |r| with(triangle(r), &[r.below(8) as u32]));
    judge("pieces", 0, &table, |case| {
        let octant = case.0[9].to_bits();
        (0..3).fold(OctantPolygon::triangle(corners(case)), |piece, axis| {
            octant_half(&piece, axis, octant >> axis & 1 == 1)
        })
    });
}

#[test]
fn outlines_agree_with_their_twins() {
    let table = cases(51, |r| with(triangle(r), &[r.below(2) as u32]));
    judge("outlines", 1, &table, |case| {
        let whole = OctantPolygon::triangle(corners(case));
        octant_outline(&octant_half(&whole, 2, case.0[9].to_bits() == 1))
    });
}

#[test]
fn pieces_of_triangles_agree_with_their_twins() {
    let mut table = cases(52, |r| {
        let level = 1 + r.below(MAX_LEVEL as usize) as u32;
        let piece = r.below((level * level) as usize) as u32;
        with(triangle(r), &[level, piece, r.below(3) as u32])
    });
    // Where rows begin and end.
    for (row, case) in (0..MAX_LEVEL).zip(&mut table) {
        case.0[9] = f32::from_bits(MAX_LEVEL);
        case.0[10] = f32::from_bits(row * row + if row % 2 == 0 { 0 } else { 2 * row });
    }
    with_gpu(|gpu| {
        for (case, result) in table.iter().zip(twin_raster(gpu, 2, &table, &[])) {
            let [level, piece, corner] = [9, 10, 11].map(|i: usize| case.0[i].to_bits());
            let weights = tessellation_weights(level, piece, corner);
            assert_eq!(result.0[..3], weights.map(|w| w as f32), "{case:?}");
            let point = tessellation_point(weights, level, corners(case));
            let found = Vec3::from_slice(&result.0[3..]);
            assert!(
                (found - point).abs().max_element() <= TOLERANCE,
                "{found} {point} {case:?}"
            );
        }
    });
}
