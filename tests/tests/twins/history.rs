//! Light of the frame before: places, weights and confidences of the device are those of the twin.

use super::*;
use clerestory::techniques::instant_radiosity::many_light::history::{
    HistoryView, history_bound, history_change, history_confidence, history_place, history_weights,
};
use clerestory_tests::with_gpu;

const HISTORY: u32 = 17;
/// Numbers of a case, then three integers.
const NUMBERS: usize = 29;
/// Rounding units that inputs may have moved by.
const MOVED: f64 = 8.0;

fn view(x: &[f64]) -> HistoryView {
    let bits = |i: usize| (x[NUMBERS + i] as f32).to_bits();
    HistoryView {
        origin: v3(x, 0),
        right: v3(x, 3),
        down: v3(x, 6),
        forward: v3(x, 9),
        is_parallel: bits(0) != 0,
        size: [bits(1), bits(2)],
    }
}

/// A view, a point before or behind it, and numbers of the other functions with their edges.
fn case(random: &mut Random, depth: f32) -> Vec<f32> {
    let size = [1 + random.below(2000) as u32, 1 + random.below(2000) as u32];
    let (forward, other) = (random.direction(), random.direction());
    let right = forward.any_orthonormal_vector() * (0.1 + random.unit());
    let down = forward.cross(right).normalize() * (0.1 + random.unit());
    // Through a lens the middle of the picture lies aside.
    let forward = forward + 0.2 * (random.unit() * right + random.unit() * down);
    let origin = 10.0 * other;
    let across = (3.0 * random.unit() - 1.5) * right + (3.0 * random.unit() - 1.5) * down;
    let is_parallel = random.below(3) == 0;
    let point = if is_parallel {
        origin + across + depth * forward
    } else {
        origin + depth * (forward + across)
    };
    let mut place = [0, 1].map(|i| random.unit() * size[i] as f32);
    if random.below(3) == 0 {
        // The middle of a pixel, or close to it.
        let off = random.choose(&[0.0, 0.001, -0.004, 0.01, -0.02]);
        place = place.map(|x| x.floor() + 0.5 + off);
    }
    let amount = |random: &mut Random| random.choose(&[0.0, 1e-4, 0.1, 1.0, 50.0]) * random.unit();
    let mut all = [origin, right, down, forward, point].map(|v| v.to_array()).concat();
    all.extend(place);
    all.push(unit(random));
    (0..6).for_each(|_| all.push(amount(random)));
    all.extend([amount(random), amount(random)]);
    all.extend([random.choose(&[0.0, 1.0, 8.0]), amount(random), amount(random)]);
    all.extend([u32::from(is_parallel), size[0], size[1]].map(f32::from_bits));
    all
}

#[test]
fn histories_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(91, |random| {
            let depth = random.choose(&[0.1, 1.0, 40.0]);
            case(random, depth)
        });
        let results = twin_math(gpu, HISTORY, &table, &[]);
        let worst = compare("history", &table, &results, ulps(8.0, MOVED, 0.0), 0..NUMBERS, |x| {
            let place = history_place(&view(x), v3(x, 12)).expect("in front of the camera");
            let (_, weights) = history_weights(v2(x, 15));
            let others = [
                history_change(x[24], x[25]),
                history_confidence(x[17], v3(x, 18), v3(x, 21)),
                history_bound(x[26], x[27], x[28]),
            ];
            list![[place.x, place.y], weights, others]
        });
        println!("history: worst error {worst:.3} of what is allowed");
        for (case, result) in table.iter().zip(&results) {
            assert_eq!(result.bits(9), 1, "{case:?}");
            let found = [10, 11].map(|i| result.bits(i) as i32);
            for axis in 0..2 {
                // Where rounding decides which pixel is first, either is right.
                let moved = |by: f64| {
                    let mut place = v2(&case.0.map(f64::from), 15);
                    place[axis] *= 1.0 + by * MOVED / 16_777_216.0;
                    history_weights(place).0[axis]
                };
                assert!((moved(-1.0)..=moved(1.0)).contains(&found[axis]), "{case:?}");
            }
        }
        let behind = cases(92, |random| case(random, -1.0));
        for result in twin_math(gpu, HISTORY, &behind, &[]) {
            assert_eq!(result.bits(9), 0);
        }
    });
}
