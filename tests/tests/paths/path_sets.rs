//! Parts of the light by path expressions: those of a partition sum to the whole.
//!
//! Acceptance: blocks of 4 × 4 pixels by the z-test of `film::z_test` (Šidák at 1 %; 99.75 % accepted where tails are heavy) and the test of the sum of all
//! differences, from the pictures' own variances; parts have seeds of their own, so that they are independent. Blocks, since a pixel's
//! mean of the rare bright samples of a caustic is far from normal.

use std::sync::Arc;

use clerestory::gpu::Gpu;
use clerestory::scene::Scene;
use clerestory::techniques::PathTracerSettings;
use clerestory::transport::{GpuScene, PathSet};
use clerestory_tests::render::{Rendered, builtin, finish, paths, tracer_of, upload};
use clerestory_tests::with_gpu;

const SIZE: usize = 24;
const BLOCK: usize = 4;
const SAMPLES: u32 = 96;

/// Means over blocks, and the variances of these.
fn blocks(picture: &Rendered) -> Rendered {
    let average = |values: &[f32], divisor: usize| -> Vec<f32> {
        let count = SIZE / BLOCK;
        let mut sums = vec![0.0f64; count * count * 3];
        for (i, value) in values.iter().enumerate() {
            let (pixel, channel) = (i / 3, i % 3);
            let block = pixel / SIZE / BLOCK * count + pixel % SIZE / BLOCK;
            sums[block * 3 + channel] += f64::from(*value);
        }
        sums.iter().map(|sum| (sum / divisor as f64) as f32).collect()
    };
    let pixels = BLOCK * BLOCK;
    Rendered {
        radiance: average(&picture.radiance, pixels),
        variance: average(&picture.variance, pixels * pixels),
        ..picture.clone()
    }
}

/// A scene on the device, whose pictures are compared.
struct Subject<'a> {
    gpu: &'a Gpu,
    scene: Scene,
    uploaded: Arc<GpuScene>,
}

impl<'a> Subject<'a> {
    fn new(gpu: &'a Gpu, address: &str) -> Self {
        let scene = builtin(address);
        let uploaded = upload(gpu, &scene);
        Self { gpu, scene, uploaded }
    }

    fn part(&self, set: &str, seed: u32) -> Rendered {
        // Roulette begins where most paths are over: what it adds to the variance is rare and bright.
        let settings = PathTracerSettings {
            seed,
            roulette_start: 6,
            ..paths(set)
        };
        let camera = &self.scene.cameras[0];
        let picture = finish(
            &mut tracer_of(self.gpu, &self.uploaded, camera, [SIZE as u32; 2], &settings),
            SAMPLES,
        );
        picture.expect_sound(&format!("{}: {set}", self.scene.name), SAMPLES);
        picture
    }

    /// Fails unless the parts sum to the whole and none of them is black.
    fn expect_sum(&self, what: &str, whole: &Rendered, parts: &[&str]) {
        let mut radiance = vec![0.0f32; whole.radiance.len()];
        let mut variance = radiance.clone();
        for (i, set) in parts.iter().enumerate() {
            let picture = blocks(&self.part(set, 100 + i as u32));
            assert!(
                picture.mean().iter().any(|(mean, _)| *mean > 1e-6),
                "{what}: {set} is black"
            );
            for (sum, value) in
                (radiance.iter_mut().zip(&picture.radiance)).chain(variance.iter_mut().zip(&picture.variance))
            {
                *sum += value;
            }
        }
        whole.expect_same_as(what, &radiance, &variance);
    }

    /// Fails unless the sets are a partition of `whole`, in the algebra and in pictures; `there` holds the paths that the scene has.
    fn expect_partition(&self, [whole, there]: [&str; 2], partitions: &[&[&str]]) {
        let picture = blocks(&self.part(whole, 7));
        for parts in partitions {
            let what = format!("{}: {whole} = {}", self.scene.name, parts.join(" + "));
            let union = parts.iter().fold(PathSet::EMPTY, |union, text| {
                let set = parsed(text)
                    .intersection(&parsed(whole))
                    .unwrap_or_else(|error| panic!("{what}: {error}"));
                assert!(
                    set.intersection(&union).is_ok_and(|both| both.is_empty()),
                    "{what}: {text} overlaps"
                );
                union.union(&set).unwrap_or_else(|error| panic!("{what}: {error}"))
            });
            let needed = parsed(there)
                .intersection(&parsed(whole))
                .unwrap_or_else(|error| panic!("{what}: {error}"));
            assert!(needed.is_subset_of(&union), "{what}: {union} is not all");
            self.expect_sum(&what, &picture, parts);
        }
    }

    /// Fails unless two sets of one class a vertex have the sum of their union, which allows two classes at a vertex and has to tell
    /// afterwards by a drawn label which of them it was.
    fn expect_drawn_labels_agree(&self, parts: [&str; 2]) {
        let both = parts.join("|");
        assert!(parsed(&both).tells_reflections_apart(), "{both}");
        let labelled = blocks(&self.part(&both, 7));
        self.expect_sum(&format!("{}: {both}", self.scene.name), &labelled, &parts);
    }
}

fn parsed(text: &str) -> PathSet {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[test]
fn glass_casts_caustics_that_are_a_part() {
    with_gpu(|gpu| {
        let subject = Subject::new(gpu, "builtin:cornell-box?sphere=glass");
        subject.expect_partition(
            ["bounces=0..5", "L[DS]*E"],
            &[
                // By caustics; by what is scattered first, at the light; last, at the eye.
                &["bounces=0..5,LS+DE", "bounces=0..5,!LS+DE"],
                &["LE", "bounces=0..5,LD.*E", "bounces=0..5,LSr.*E", "bounces=0..5,LSt.*E"],
                &["LE", "bounces=0..5,L.*DE", "bounces=0..5,L.*SE"],
                // One within the other.
                &[
                    "bounces=0..5,L[^S]*E",
                    "bounces=0..5,LS+DE",
                    "bounces=0..5,L.*S.*E,!LS+DE",
                ],
            ],
        );
    });
}

#[test]
fn coats_over_diffuse_bases_are_told_apart() {
    with_gpu(|gpu| {
        let subject = Subject::new(gpu, "builtin:materials");
        subject.expect_partition(
            ["bounces=0..4", "L[^V]*E"],
            &[
                &[
                    "bounces=0..4,L[^G]*E",
                    "bounces=0..4,L[^G]*G[^G]*E",
                    "bounces=0..4,L.*G.*G.*E",
                ],
                &["bounces=0..4,L[^D]*E", "bounces=0..4,L.*D[^D]*E"],
                &[
                    "LE",
                    "bounces=0..4,L.*Gt.*E",
                    "bounces=1..4,L[^Gt]*E".replace("[^Gt]", "[DGrSV]").as_str(),
                ],
            ],
        );
        subject.expect_drawn_labels_agree(["LDDE", "LGGE"]);
        subject.expect_drawn_labels_agree(["LDGE", "LGDE"]);
    });
}

#[test]
fn rough_metal_is_a_part() {
    with_gpu(|gpu| {
        let subject = Subject::new(gpu, "builtin:divider-room?roughness=0.3");
        subject.expect_partition(
            ["bounces=0..4", "L[^V]*E"],
            &[
                &["bounces=0..4,LD*E", "bounces=0..4,L.*[^D].*E"],
                &["bounces=0..4,LDG.*E", "bounces=0..4,!LDG.*E"],
            ],
        );
        subject.expect_drawn_labels_agree(["LDGE", "LGDE"]);
    });
}

#[test]
fn the_empty_set_is_black_and_plain_sets_compile_no_automaton() {
    with_gpu(|gpu| {
        let glass = Subject::new(gpu, "builtin:cornell-box?sphere=glass");
        let coats = Subject::new(gpu, "builtin:materials");
        for set in ["none", "LVE", "LDE,LSE"] {
            let picture = glass.part(set, 7);
            assert!(picture.radiance.iter().all(|v| *v == 0.0), "{set}");
        }
        for (set, automaton, labels) in [
            ("all", 0, 0),
            ("LDE", 0, 0),
            ("L[DrGt]{0,9}E", 0, 0),
            ("LS+DE", 1, 0),
            ("L.*D.*E", 1, 1),
        ] {
            let Subject { scene, uploaded, .. } = if labels == 1 { &coats } else { &glass };
            let tracer = tracer_of(gpu, uploaded, &scene.cameras[0], [8, 8], &paths(set));
            let pipelines = tracer.pipelines();
            let value = |name: &str| {
                let constants = pipelines.iter().flat_map(|pipeline| &pipeline.specialization);
                constants
                    .filter(|(known, _)| *known == name)
                    .map(|(_, value)| *value)
                    .max()
            };
            assert_eq!(value("has_path_automaton"), Some(automaton), "{set}");
            assert_eq!(value("has_lobe_labels"), Some(labels), "{set}");
        }
    });
}
