//! Interleaved pixels: the device's places and parts of lights are those of the twin, to the number.

use super::*;
use clerestory::techniques::instant_radiosity::many_light::Interleaving;
use clerestory_tests::with_gpu;

const INTERLEAVE: u32 = 15;

#[test]
fn interleaved_pixels_agree_with_their_twins() {
    with_gpu(|gpu| {
        let mut random = Random(77);
        let (mut table, mut expected) = (Vec::new(), Vec::new());
        for number in 0..CASES {
            let size = match number % 4 {
                0 => [13, 7],
                1 => [64, 48],
                _ => [1 + random.below(300) as u32, 1 + random.below(300) as u32],
            };
            let n = 1 + random.below(16) as u32;
            let twin = Interleaving::new(size, n);
            let place = random.below(twin.places() as usize) as u32;
            let pixel = size.map(|side| random.below(side as usize) as u32);
            let subset = random.below((n * n) as usize) as u32;
            let magnitude = random.below(17);
            let lights = random.below(1 << magnitude) as u32;
            let subsets = if number % 5 == 0 { 1 } else { n * n };
            let first = random.below(subsets as usize) as u32;
            let words = [
                size[0], size[1], n, place, pixel[0], pixel[1], subset, lights, first, subsets,
            ];
            table.push(Case::new(&words.map(f32::from_bits)));
            let part = Interleaving::lights(subset, n * n, lights);
            let last = Interleaving::subset(part.start, n * n, lights.max(1));
            let turned = Interleaving::subset_of_tile(subset, first, subsets);
            expected.push((twin.merge(place), twin.split(pixel), part, [last, turned]));
        }
        let results = twin_math(gpu, INTERLEAVE, &table, &[]);
        let mut inside = 0;
        for (result, (pixel, place, part, subsets)) in results.iter().zip(&expected) {
            let words = result.0.map(f32::to_bits);
            assert_eq!(words[0], u32::from(pixel.is_some()));
            if let Some(pixel) = pixel {
                assert_eq!(words[1..3], *pixel);
                inside += 1;
            }
            assert_eq!(
                (words[3], words[4]..words[5], [words[6], words[7]]),
                (*place, part.clone(), *subsets)
            );
        }
        assert!(inside > CASES / 4 && inside < CASES, "{inside}");
    });
}
