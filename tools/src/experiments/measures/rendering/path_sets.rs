//! Pictures of parts of the light paths: does their sum show what the whole shows, and what do the parts cost?
//!
//! Oracle: the whole picture, by a z-test of every pixel.

use clerestory::gpu::Gpu;
use clerestory::render::Renderer;
use clerestory::{Result, scene};

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows, z_most};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::Image;
use crate::experiments::reference::short_name;

/// Paths of a whole picture and the parts that they divide into.
struct Division {
    name: &'static str,
    scene: &'static str,
    whole: &'static str,
    parts: &'static [&'static str],
}

const DIVISIONS: [Division; 3] = [
    Division {
        name: "by bounces",
        scene: "builtin:cornell-box",
        whole: "all",
        parts: &["emitted", "direct", "bounces=2..3", "bounces=4.."],
    },
    Division {
        name: "direct and indirect",
        scene: "builtin:cornell-box",
        whole: "all",
        parts: &["bounces=0..1", "indirect"],
    },
    Division {
        name: "by lobes",
        scene: "builtin:white-furnace?frequency=8&roughness=0.5",
        whole: "direct",
        parts: &["direct,lobes=diffuse+reflection", "direct,lobes=glossy+reflection"],
    },
];

/// A seed for the whole, and the first one of its parts, each of which has its own.
const SEEDS: [u32; 2] = [1, 100];
/// Channels of a pixel are correlated: the z of the mean is up to so many times a standard normal one, √3.
const CHANNELS_VARY_AS_ONE: f64 = 1.732_050_807_568_877_2;

rows! {
    /// The sum of a division's parts beside the whole picture.
    struct Sum = "Sums of pictures of parts of the light paths" by [scene, division] {
        scene: String = "scene",
        division: String = "division",
        error: f64 = "mean over the whole's − 1",
        z: f64 = "z of the mean",
        accepted: f64 = "accepted share of the values",
        worst_z: f64 = "worst z",
        rays: f64 = "rays over the whole's",
        time: Repeats = "GPU time over the whole's",
    }
}

rows! {
    /// A picture of a division.
    struct Part = "Their parts" by [scene, division, paths] {
        scene: String = "scene",
        division: String = "division",
        paths: String = "paths",
        mean: f64 = "mean",
        variance: f64 = "mean variance",
        pixels: u64 = "pixels",
        samples: u64 = "samples per pixel",
        rays: u64 = "rays",
        time: Repeats = "GPU time (s)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    sums: Vec<Sum>,
    parts: Vec<Part>,
}

const CRITERIA: &[Criterion<Sum>] = &[
    Criterion::each(
        "the sum is accepted: share of its values",
        Bound::AtLeast(1.0),
        |row: &Sum| row.accepted.into(),
    )
    .because("one value of a right sum is refused once in a hundred pictures, by Šidák"),
    Criterion::each(
        "the sum's mean is right: |z| over what chance exceeds in one of the divisions once in a hundred runs",
        Bound::AtMost(1.0),
        |row: &Sum| (row.z.abs() / CHANNELS_VARY_AS_ONE / z_most(DIVISIONS.len())).into(),
    )
    .because("by Šidák, when channels vary as one"),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let name = |division: &Division| format!("{}, {}", short_name(division.scene), division.name);
        let mut parts = Vec::new();
        let sums = context.each(&DIVISIONS, name, |division| {
            let (sum, of_division) = of_division(context, &gpu, division)?;
            parts.extend(of_division);
            Ok(vec![sum])
        })?;
        Ok(Self { sums, parts })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.sums, CRITERIA)
            .headline(
                "rays of all parts over the whole's, geometric mean",
                geometric_mean(self.sums.iter().map(|row| row.rays.into())),
            )
            .note(
                "The z-tests compare the sum with the whole, with Šidák's correction for the number of values. Channels of a pixel are \
                 correlated: the z of the mean is up to √3 times a standard normal one.",
            )
            .and(Findings::of(&self.parts, &[]))
            .note("The first of each division is the whole. Independent samples, a seed for each picture; GPU times in turns.")
    }
}

/// The sum of a division, and its pictures.
fn of_division(context: &Context<'_>, gpu: &Gpu, division: &Division) -> Result<(Sum, Vec<Part>)> {
    let (size, samples): (u32, u32) = context.pick((48, 256), (8, 32));
    let renderer = Renderer::new(gpu, &scene::load(division.scene)?)?;
    let [of_whole, of_parts] = SEEDS;
    let parts = division.parts.iter().copied().zip(of_parts..);
    let paths: Vec<(&str, u32)> = [(division.whole, of_whole)].into_iter().chain(parts).collect();
    let mut images: Vec<Option<Image>> = paths.iter().map(|_| None).collect();
    let seconds = context.in_turns(5, paths.len(), |i| {
        let (paths, seed) = paths[i];
        let image = Image::render(&renderer, size, samples, seed, paths)?;
        let seconds = image.report.gpu_seconds;
        // The same in each turn.
        images[i] = Some(image);
        Ok(seconds)
    })?;
    let images: Vec<Image> = images.into_iter().flatten().collect();
    let rows = paths
        .iter()
        .zip(&images)
        .zip(&seconds)
        .map(|(((paths, _), image), seconds)| {
            let variances = image.variance.iter().map(|v| f64::from(*v)).sum::<f64>();
            Part {
                scene: short_name(division.scene).into(),
                division: division.name.into(),
                paths: (*paths).into(),
                mean: mean(image),
                variance: variances / image.variance.len() as f64,
                pixels: u64::from(size * size),
                samples: samples.into(),
                rays: image.count("rays"),
                time: Repeats(seconds.clone()),
            }
        });
    let rows: Vec<Part> = rows.collect();
    let mut images = images.into_iter();
    let (whole, sum) = (
        images.next(),
        images.reduce(|mut sum, part| {
            sum.add(&part);
            sum
        }),
    );
    let Some((whole, sum)) = whole.zip(sum) else {
        return Err(clerestory::Error::setting("division", division.name, "has no parts"));
    };
    let test = sum.z_test(&whole)?;
    let of_turn = |turn: usize| seconds[1..].iter().map(|of_part| of_part[turn]).sum::<f64>();
    let all: Repeats = (0..seconds[0].len()).map(of_turn).collect();
    let rays: u64 = rows[1..].iter().map(|part| part.rays).sum();
    let row = Sum {
        scene: short_name(division.scene).into(),
        division: division.name.into(),
        error: mean(&sum) / mean(&whole) - 1.0,
        z: test.bias_z,
        accepted: test.accepted_fraction,
        worst_z: test.worst_z,
        rays: rays as f64 / rows[0].rays as f64,
        time: all.over(&rows[0].time),
    };
    Ok((row, rows))
}

/// Of all pixels and channels.
fn mean(image: &Image) -> f64 {
    [0, 1, 2].map(|channel| image.mean(channel).0).iter().sum::<f64>() / 3.0
}
