//! The stages of a frame of photon mapping with media, by the passes that their kernels run in; and those that one kernel may do, by a kernel each and fused.

use clerestory::Result;
use clerestory::gpu::Timings;
use clerestory::techniques::photon_mapping::{MapStages, PhotonMapper};

use super::frames::milliseconds;
use super::scenarios::Scenario;
use crate::experiments::findings::{Bound, Criterion, Repeats, rows};

/// How passes of rays' queries begin, with what finds and collects those that ask, and these alone.
const RAY_PASSES: &str = "photon: beam";
const COLLECTING_PASSES: [&str; 2] = ["photon: beam ways", "photon: beam queue"];
/// Where a bounce begins, and where it does with the fused kernel.
const BOUNCE_PASS: &str = "path: extend";
const FUSED_PASS: &str = "photon: rays and beams";

/// The stages of a frame, each by how its passes begin: the first that fits.
pub const STAGES: [(&str, &[&str]); 7] = [
    (RAYS, &[BOUNCE_PASS]),
    (FUSED, &[FUSED_PASS]),
    (ESTIMATION, &[RAY_PASSES]),
    (SURFACES, &["photon: gather"]),
    (SCATTERING, &["path: medium", "path: shade"]),
    (SHADOWS, &["path: shadow"]),
    ("starts, compaction, film", &["path: "]),
];
pub const RAYS: &str = "closest hits of rays";
pub const FUSED: &str = "closest hits and density estimation along rays";
pub const ESTIMATION: &str = "density estimation along rays";
pub const SURFACES: &str = "density estimation on surfaces";
pub const SCATTERING: &str = "ways through media and scattering";
pub const SHADOWS: &str = "shadow rays";

/// What the fused kernel does, by whatever kernels.
const FUSIBLE: [&str; 3] = [RAYS, FUSED, ESTIMATION];
/// How these kernels are called.
const EACH: &str = "a kernel each";
const ONE: &str = "one kernel";
/// Rays of a path: which of them stand in a row, the first one and those after it.
const PARTS: [(&str, [f64; 2]); 3] = [
    ("first of a path", [1.0, 0.0]),
    ("after it", [0.0, 1.0]),
    (ALL_RAYS, [1.0, 1.0]),
];
const ALL_RAYS: &str = "all";

rows! {
    /// What a kernel each does, or the fused one.
    struct Fusion = "Closest hits and density estimation along rays, by a kernel each and fused" by [scene, kernels, rays] {
        scene: String = "scene",
        kernels: String = "kernels",
        rays: String = "rays",
        jobs: f64 = "jobs per frame",
        passes: f64 = "passes of a bounce, compaction aside",
        time: Repeats = "time (ms)",
        share: Repeats = "share of the frame (%)",
        change: Option<Repeats> = "over a kernel each (%)",
    }
}

/// What is asked of these rows.
pub const OF_FUSIONS: &[Criterion<Fusion>] = &[Criterion::each(
    "a kernel each, the default, takes no longer than one: what one takes over it (%)",
    Bound::AtLeast(0.0),
    |row: &Fusion| row.change.as_ref().map_or(f64::NAN.into(), Repeats::measured),
)
.among(|row| row.change.is_some() && row.rays == ALL_RAYS)
.because("the default is to be the faster one; the source has no fused form")];

/// Milliseconds of a frame, by stage: of its first bounce, and of the others.
#[derive(Debug, Clone, Copy, Default)]
pub struct Frame {
    /// In the order of [`STAGES`].
    pub stages: [[f64; 2]; STAGES.len()],
    /// Of density estimation along rays, what comes before queries.
    pub collecting: f64,
    /// Bounces that were recorded, and passes of all stages but the last.
    bounces: u32,
    passes: u32,
}

impl Frame {
    /// The mapper's next sample of each pixel, up to so many.
    pub fn of(mapper: &mut PhotonMapper, samples: u32) -> Result<Self> {
        let mut frame = Self::default();
        let begins = match mapper.settings().stages {
            MapStages::Stream => BOUNCE_PASS,
            MapStages::Fused => FUSED_PASS,
        };
        while let Some(step) = mapper.step(samples)? {
            step.timings.iter().for_each(|timings| frame.add(timings, begins));
        }
        Ok(frame)
    }

    /// Bounces begin by the pass `begins`.
    fn add(&mut self, timings: &Timings, begins: &str) {
        for pass in &timings.passes {
            self.bounces += u32::from(pass.name == begins);
            let milliseconds = milliseconds(pass);
            let fits = |(_, names): &(&str, &[&str])| names.iter().any(|name| pass.name.starts_with(name));
            if let Some(stage) = STAGES.iter().position(fits) {
                self.stages[stage][usize::from(self.bounces > 1)] += milliseconds;
                self.passes += u32::from(stage + 1 < STAGES.len());
            }
            if COLLECTING_PASSES.contains(&pass.name.as_str()) {
                self.collecting += milliseconds;
            }
        }
    }

    /// Of the stage that is called so.
    pub fn stage(&self, name: &str) -> f64 {
        let place = STAGES.iter().position(|(stage, _)| *stage == name);
        place.map_or(0.0, |place| self.stages[place].iter().sum())
    }

    /// Of all stages.
    pub fn all(&self) -> f64 {
        self.stages.as_flattened().iter().sum()
    }

    /// What the fused kernel does, of a part of the rays.
    fn fusible(&self, [first, later]: [f64; 2]) -> f64 {
        let stages = STAGES.iter().zip(&self.stages);
        let fusible = stages.filter(|((stage, _), _)| FUSIBLE.contains(stage));
        fusible.map(|(_, times)| first * times[0] + later * times[1]).sum()
    }
}

/// Rows of what is fused and what is not, from frames of both and the jobs of the first rays and of others.
pub fn fusions(scenario: &Scenario, [each, one]: [&[Frame]; 2], jobs: [f64; 2]) -> Vec<Fusion> {
    let row = |frames: &[Frame], kernels: &str, (rays, part): (&str, [f64; 2])| Fusion {
        scene: scenario.name.into(),
        kernels: kernels.into(),
        rays: rays.into(),
        jobs: part[0] * jobs[0] + part[1] * jobs[1],
        passes: frames.first().map_or(f64::NAN, |frame| {
            f64::from(frame.passes) / f64::from(frame.bounces.max(1))
        }),
        time: repeats(frames, |frame| frame.fusible(part)),
        share: repeats(frames, |frame| 1e2 * frame.fusible(part) / frame.all()),
        change: None,
    };
    let pair = |part| {
        let (each, one) = (row(each, EACH, part), row(one, ONE, part));
        let change = Some(one.time.change_from(&each.time));
        [each, Fusion { change, ..one }]
    };
    PARTS.into_iter().flat_map(pair).collect()
}

/// What each of these frames has.
pub fn repeats(frames: &[Frame], of: impl Fn(&Frame) -> f64) -> Repeats {
    frames.iter().map(of).collect()
}
