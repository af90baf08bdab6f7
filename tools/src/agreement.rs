//! Agreement with an independent renderer: converged pictures of [`mitsuba::scenes`] by this engine and by Mitsuba 3, compared within their
//! noise.
//!
//! Every scene is exported, rendered by `tools/mitsuba/reference.py` in independent passes, rendered here with independent (PCG) samples and
//! Mitsuba's rough surfaces (single scattering, separable masking), in media with an integrator of Mitsuba's that has no bias, and compared
//! by [`film::z_test`]: value by value and by blocks of 8 × 8 pixels, whose means show eight times smaller differences (the worse of both
//! verdicts counts), and as a whole. Then, scene by scene again, both renderers take turns at pictures with each of their samplers, and are compared by time to equal error: [`Race`].
//! Guarantees: pictures and errors depend on the options and the drivers alone; times are wall-clock and processor seconds, medians.
//!
//! [`mitsuba::scenes`]: crate::mitsuba::scenes
//! [`film::z_test`]: fn@clerestory::film::z_test

mod chosen;
mod peer;
mod race;
mod report;
pub(crate) mod spread;
mod summary;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clerestory::film::z_test::{RELATIVE_DEVIATION_FLOOR, SIGNIFICANCE};
use clerestory::film::{CompareOptions, Picture, ToneMap, compare, exr, png, z_test};
use clerestory::gpu::Gpu;
use clerestory::scene::Camera;
use clerestory::techniques::path::Adaptive;
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory::transport::GpuScene;
use clerestory::transport::random::SamplerKind;
use clerestory::{Error, Result};

use crate::experiments::watch::Watch;
use crate::mitsuba::scenes::{ComparedScene, scenes};
use crate::mitsuba::{Exported, export};
pub use chosen::Chosen;
pub use peer::mitsuba_version;
use peer::{Integrator, Peer, Rendered, Request, Variant};
use race::RaceSetup;
pub use race::{Contender, EqualError, Lead, Race};
pub(crate) use report::BIAS_Z_MAX;
#[cfg(test)]
pub(crate) use report::tests::made_up;
pub use report::{AgreementReport, Machine, SceneAgreement, Uncompared};

/// What to compare, and how long to work at it.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AgreementOptions {
    /// Names of the scenes; empty: all of them.
    pub scenes: Vec<String>,
    /// Width and height of the compared pictures, pixels.
    pub size: u32,
    /// Independent passes of Mitsuba: 100 or more, so that their variance is known well enough.
    pub passes: u32,
    /// Samples per pixel in each pass; this engine takes `passes` times as many.
    pub samples_per_pass: u32,
    /// Seed of both renderers.
    pub seed: u32,
    /// Rounds of the timed pictures, in each of which every renderer has its turn with each of its samplers; 0 times nothing.
    pub timing_rounds: u32,
    /// Independent timed pictures per turn, 2 or more; with the rounds 3 or more.
    pub timing_pictures: u32,
    /// Samples per pixel of a timed picture, a square number for Mitsuba's multijittered sampler; a power of four suits Sobol' points too.
    pub timing_samples: u32,
    /// Whether pixels of this engine's pictures get samples by their noise.
    #[serde(default)]
    pub adaptive: Adaptive,
    /// The Python that has Mitsuba.
    #[serde(skip)]
    pub python: PathBuf,
    /// Folder for scenes and pictures, made if need be.
    #[serde(skip)]
    pub output: PathBuf,
}

impl Default for AgreementOptions {
    /// All scenes at 64², 128 passes of 16 samples; timed are three rounds of two pictures of 256 samples, with which Mitsuba's LLVM variant
    /// loses less than 5 % of its speed to fixed costs. Python comes from `CLERESTORY_MITSUBA_PYTHON`, else `python3`.
    fn default() -> Self {
        Self {
            scenes: Vec::new(),
            size: 64,
            passes: 128,
            samples_per_pass: 16,
            seed: 2,
            timing_rounds: 3,
            timing_pictures: 2,
            timing_samples: 256,
            adaptive: Adaptive::Off,
            python: python_of_environment(),
            output: "out/agreement".into(),
        }
    }
}

/// The environment variable that names the Python.
pub const PYTHON_VARIABLE: &str = "CLERESTORY_MITSUBA_PYTHON";

/// The Python that [`PYTHON_VARIABLE`] names, else `python3`.
pub(crate) fn python_of_environment() -> PathBuf {
    std::env::var_os(PYTHON_VARIABLE).map_or_else(|| "python3".into(), PathBuf::from)
}

/// First bounce of Russian roulette: that of Mitsuba's path integrator with `rr_depth` 5.
const ROULETTE_START: u32 = 5;
/// Edge of the blocks whose means are tested too, pixels.
pub(crate) const BLOCK: u32 = 8;
/// Radiance difference shown as full white in the difference pictures, in units of its standard deviation.
const FULL_SCALE_Z: f32 = 5.0;

/// Why a scene was not compared.
#[derive(Debug)]
enum Fault {
    /// Somebody asked to stop.
    Stopped,
    /// A picture of Mitsuba's has values that are not finite: the scene's own fault, others can be compared.
    NotFinite(String),
    Other(Error),
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::Other(error)
    }
}

impl Fault {
    /// As an error about `path`.
    fn into_error(self, path: &str) -> Error {
        let cause = match self {
            Self::Other(error) => return error,
            Self::NotFinite(cause) => cause,
            Self::Stopped => "was stopped".into(),
        };
        Error::Picture {
            path: path.into(),
            cause,
        }
    }
}

/// Compares all wanted scenes of a report that was begun, on a device, then races them, until `watch` says to stop, and gives `keep` the report after each.
/// The scenes that it holds stay in it, and so do their races; without a selection only the others are compared. A scene of which Mitsuba makes a picture that is
/// not finite is noted and left out.
///
/// # Errors
/// [`Error::Setting`] for options out of range, an unknown scene, or a Python that cannot be run or has no Mitsuba; those of the device, the
/// exporter and the files. A picture that disagrees and one that is not finite are not errors: see [`AgreementReport::passes`]; nor is what
/// fails after a stop request.
pub fn run_with(
    gpu: &Gpu,
    mut report: AgreementReport,
    watch: &dyn Watch,
    keep: &mut dyn FnMut(&AgreementReport) -> Result<()>,
) -> Result<AgreementReport> {
    let options = &report.options.clone();
    let wanted = selected(options)?;
    let order: Vec<&str> = scenes()?.iter().map(|one| one.name).collect();
    let place = |name: &str| order.iter().position(|known| *known == name);
    let is_kept = |report: &AgreementReport, one: &ComparedScene| {
        options.scenes.is_empty() && report.scenes.iter().any(|kept| kept.name == one.name)
    };
    let compared: Vec<&ComparedScene> = wanted.iter().filter(|one| !is_kept(&report, one)).collect();
    for (done, one) in compared.iter().enumerate() {
        watch.begin(&format!("{}: {}", one.name, one.shows), done, compared.len());
        let scene = match unless_stopped(compare_scene(gpu, one, options, watch), watch) {
            Ok(Some(scene)) => Ok(scene),
            Ok(None) => return Ok(report),
            Err(Fault::NotFinite(cause)) => Err(cause),
            Err(fault) => return Err(fault.into_error(one.name)),
        };
        watch.note(&format!("{}: {}", one.name, one.shows));
        report.scenes.retain(|kept| kept.name != one.name);
        match scene {
            Ok(scene) => {
                scene.to_string().lines().for_each(|line| watch.note(line));
                report.scenes.push(scene);
                report.scenes.sort_by_key(|scene| place(&scene.name));
            }
            Err(cause) => {
                watch.note(&format!("  not compared: {cause}"));
                let name = one.name.to_owned();
                report.uncompared.push(Uncompared { name, cause });
            }
        }
        // After every scene, so that a run that is cut short leaves what it has found.
        keep(&report)?;
    }
    if options.timing_rounds == 0 {
        return Ok(report);
    }
    // One after the other, so that all races are run by a machine in the same state.
    let is_raced = |scene: &SceneAgreement| scene.race.is_some() && !compared.iter().any(|one| one.name == scene.name);
    let raced: Vec<usize> = (0..report.scenes.len())
        .filter(|index| !is_raced(&report.scenes[*index]))
        .collect();
    for (done, index) in raced.iter().enumerate() {
        let scene = &report.scenes[*index];
        let Some(one) = wanted.iter().find(|one| one.name == scene.name) else {
            continue;
        };
        watch.begin(&format!("{}: race", one.name), done, raced.len());
        match unless_stopped(race_scene(gpu, one, scene, options, watch), watch) {
            Ok(Some((race, chosen))) => (report.scenes[*index].race, report.scenes[*index].chosen) = (race, chosen),
            Ok(None) => return Ok(report),
            Err(fault) => return Err(fault.into_error(one.name)),
        }
        keep(&report)?;
    }
    Ok(report)
}

/// `None` where somebody asked to stop: what fails after a stop request may have been reached by it.
fn unless_stopped<T>(result: Result<T, Fault>, watch: &dyn Watch) -> Result<Option<T>, Fault> {
    match result {
        Err(Fault::Stopped) => Ok(None),
        Err(Fault::Other(_)) if watch.stopped() => Ok(None),
        result => result.map(Some),
    }
}

impl AgreementOptions {
    /// Checks all that can be checked before work begins.
    ///
    /// # Errors
    /// [`Error::Setting`] for options out of range and for an unknown scene.
    pub fn check(&self) -> Result<()> {
        selected(self).map(|_| ())
    }
}

fn selected(options: &AgreementOptions) -> Result<Vec<ComparedScene>> {
    let refuse = |name: &str, value: String, cause: String| {
        Err(Error::Setting {
            name: name.into(),
            value,
            cause,
        })
    };
    // Named as on the command line.
    for (name, value, least) in [
        ("--size", options.size, BLOCK),
        ("--passes", options.passes, 2),
        ("--spp", options.samples_per_pass, 1),
        ("--timing-pictures", options.timing_pictures, 2),
        ("--timing-spp", options.timing_samples, 1),
    ] {
        if value < least {
            return refuse(name, value.to_string(), format!("is below {least}"));
        }
    }
    if !options.size.is_multiple_of(BLOCK) {
        return refuse(
            "--size",
            options.size.to_string(),
            format!("is not a multiple of {BLOCK}"),
        );
    }
    if options.timing_samples.isqrt().pow(2) != options.timing_samples {
        return refuse(
            "--timing-spp",
            options.timing_samples.to_string(),
            "is not a square".into(),
        );
    }
    let pictures = u64::from(options.timing_rounds) * u64::from(options.timing_pictures);
    if options.timing_rounds > 0 && pictures < spread::PICTURES_MIN as u64 {
        let cause = format!(
            "times {} pictures are {pictures}, below {}: take more rounds or pictures",
            options.timing_pictures,
            spread::PICTURES_MIN
        );
        return refuse("--timing-rounds", options.timing_rounds.to_string(), cause);
    }
    if options.passes.checked_mul(options.samples_per_pass).is_none() {
        let cause = format!("times {} samples per pixel are too many", options.samples_per_pass);
        return refuse("--passes", options.passes.to_string(), cause);
    }
    // Every picture has a seed of its own, and so has the one that warms up before each turn.
    let turns = u64::from(options.timing_rounds).checked_mul(u64::from(options.timing_pictures) + 1);
    let seeds = turns.and_then(|turns| turns.checked_add(u64::from(options.passes) + 1));
    if seeds.is_none_or(|seeds| seeds > u64::from(u32::MAX)) {
        let cause = format!(
            "times {} pictures, with {} passes, need more seeds than there are",
            options.timing_pictures, options.passes
        );
        return refuse("--timing-rounds", options.timing_rounds.to_string(), cause);
    }
    let all = scenes()?;
    let names: Vec<_> = all.iter().map(|one| one.name).collect();
    if let Some(unknown) = options.scenes.iter().find(|name| !names.contains(&name.as_str())) {
        let cause = format!("is not compared; there are: {}", names.join(", "));
        return refuse("scenes", unknown.clone(), cause);
    }
    let is_wanted = |one: &ComparedScene| options.scenes.is_empty() || options.scenes.iter().any(|n| n == one.name);
    Ok(all.into_iter().filter(is_wanted).collect())
}

fn settings(options: &AgreementOptions) -> PathTracerSettings {
    PathTracerSettings {
        // The variance within a pixel is that of its mean only where samples are independent.
        sampler: SamplerKind::Pcg,
        seed: options.seed,
        roulette_start: ROULETTE_START,
        multiple_scattering: false,
        separable_masking: true,
        adaptive: options.adaptive,
        ..PathTracerSettings::default()
    }
}

fn compare_scene(
    gpu: &Gpu,
    one: &ComparedScene,
    options: &AgreementOptions,
    watch: &dyn Watch,
) -> Result<SceneAgreement, Fault> {
    let folder = options.output.join(one.name);
    let exported = export(&one.scene, "", [options.size; 2], &folder)?;
    let theirs = converged(one, &exported, &Peer::new(options, &folder)?, options, watch)?;
    let scene = Arc::new(GpuScene::new(gpu, &one.scene)?);
    let mut tracer = PathTracer::new(gpu, scene, camera(one)?, [options.size; 2], settings(options))?;
    tracer.render(options.passes * options.samples_per_pass)?;
    let (ours, non_finite) = tracer.picture()?;
    drop(tracer);
    let reference = exr::read(&theirs.picture)?;
    write_pictures(&folder, &ours, &reference)?;

    let (a, a_var) = (ours.require("radiance")?.values(), ours.require("variance")?.values());
    let (b, b_var) = (
        reference.main_layer()?.values(),
        reference.require("variance")?.values(),
    );
    let values = z_test(a, a_var, b, b_var, SIGNIFICANCE)?;
    let [a_block, a_block_var, b_block, b_block_var] =
        [(a, 1), (a_var, 2), (b, 1), (b_var, 2)].map(|(values, power)| block_means(values, options.size, power));
    let blocks = z_test(&a_block, &a_block_var, &b_block, &b_block_var, SIGNIFICANCE)?;
    let errors = compare(&ours, &reference, &CompareOptions::default())?;
    Ok(SceneAgreement {
        name: one.name.into(),
        shows: one.shows.into(),
        triangles: exported.triangles as u64,
        variant: theirs.variant,
        mean_squared_z: mean_squared_z(a, a_var, b, b_var),
        mean_squared_z_blocks: mean_squared_z(&a_block, &a_block_var, &b_block, &b_block_var),
        relative_mse: errors.relative_mse,
        relative_bias: errors.relative_bias,
        values,
        blocks,
        non_finite: non_finite.total(),
        race: None,
        chosen: None,
    })
}

/// Name of Mitsuba's converged picture in a scene's folder.
const CONVERGED: &str = "mitsuba";

/// Mitsuba's converged picture.
fn converged(
    one: &ComparedScene,
    exported: &Exported,
    peer: &Peer,
    options: &AgreementOptions,
    watch: &dyn Watch,
) -> Result<Rendered, Fault> {
    let request = Request {
        scene: &exported.scene,
        name: CONVERGED,
        variant: Variant::Auto,
        sampler: "independent",
        integrator: Integrator::of_reference(&one.scene),
        passes: options.passes,
        samples: options.samples_per_pass,
        seed: options.seed,
        each: false,
    };
    peer.render(&request, watch)
}

fn camera(one: &ComparedScene) -> Result<&Camera> {
    one.scene.camera(None).ok_or_else(|| Error::Setting {
        name: "camera".into(),
        value: one.name.into(),
        cause: "has none".into(),
    })
}

/// Both renderers' times to equal error on a scene that was compared, and that of the technique that is chosen for our error.
fn race_scene(
    gpu: &Gpu,
    one: &ComparedScene,
    compared: &SceneAgreement,
    options: &AgreementOptions,
    watch: &dyn Watch,
) -> Result<(Option<Race>, Option<Chosen>), Fault> {
    let folder = options.output.join(one.name);
    let exported = export(&one.scene, "", [options.size; 2], &folder)?;
    let peer = Peer::new(options, &folder)?;
    // A scene that was kept from an earlier run may have lost its picture since.
    let picture = folder.join(CONVERGED).with_extension("exr");
    if !picture.exists() {
        converged(one, &exported, &peer, options, watch)?;
    }
    let reference = exr::read(&picture)?;
    let has_llvm = compared.variant == Variant::Llvm.name();
    if !has_llvm {
        watch.note(&format!(
            "{}: Mitsuba's LLVM variant not measured, none found",
            one.name
        ));
    }
    let setup = RaceSetup {
        gpu,
        scene: Arc::new(GpuScene::new(gpu, &one.scene)?),
        camera: camera(one)?,
        contenders: Integrator::contenders(&one.scene),
        peer: &peer,
        exported: &exported.scene,
        has_llvm,
        reference: reference.main_layer()?.values(),
    };
    let race = race::run(&setup, options, watch)?;
    let chosen = match &race {
        Some(race) => chosen::run(gpu, &one.scene, race, &reference, options, watch)?,
        None => None,
    };
    Ok((race, chosen))
}

/// Both pictures as EXR and PNG, and their difference in units of its standard deviation.
fn write_pictures(folder: &Path, ours: &Picture, reference: &Picture) -> Result<()> {
    exr::write(folder.join("clerestory.exr"), ours)?;
    let tone = ToneMap::default();
    let show = |picture: &Picture, name: &str| {
        let shown = png::tone_mapped(picture.main_layer()?, picture.width(), &tone);
        png::write(folder.join(name), &shown)
    };
    show(ours, "clerestory.png")?;
    show(reference, "mitsuba.png")?;
    let z = z_values(
        ours.main_layer()?.values(),
        ours.require("variance")?.values(),
        reference.main_layer()?.values(),
        reference.require("variance")?.values(),
    );
    let worst: Vec<f32> = z
        .chunks(3)
        .map(|pixel| pixel.iter().fold(0.0f64, |worst, z| worst.max(z.abs())) as f32)
        .collect();
    png::write(
        folder.join("z.png"),
        &png::false_color(&worst, ours.width(), FULL_SCALE_Z)?,
    )
}

/// z of each value, with the floor of [`z_test`](fn@z_test).
fn z_values(a: &[f32], a_var: &[f32], b: &[f32], b_var: &[f32]) -> Vec<f64> {
    let z = |i: usize| {
        let [a, a_var, b, b_var] = [a[i], a_var[i], b[i], b_var[i]].map(f64::from);
        let floor = RELATIVE_DEVIATION_FLOOR * a.abs().max(b.abs());
        let deviation = (a_var + b_var).max(floor * floor).sqrt();
        if a == b { 0.0 } else { (a - b) / deviation }
    };
    (0..a.len()).map(z).collect()
}

/// Mean of z² over the values that have noise: 1 for pictures that differ by noise alone, above 1 where differences are many but small, below 1
/// where a variance is over-estimated. NaN without noise.
pub(crate) fn mean_squared_z(a: &[f32], a_var: &[f32], b: &[f32], b_var: &[f32]) -> f64 {
    let z = z_values(a, a_var, b, b_var);
    let noisy = |i: &usize| {
        let floor = RELATIVE_DEVIATION_FLOOR * f64::from(a[*i].abs().max(b[*i].abs()));
        f64::from(a_var[*i] + b_var[*i]) > floor * floor
    };
    let squares: Vec<f64> = (0..a.len()).filter(noisy).map(|i| z[i] * z[i]).collect();
    squares.iter().sum::<f64>() / squares.len() as f64
}

/// Means of an RGB picture's blocks (`power` 1), or the variances of such means (`power` 2).
pub(crate) fn block_means(values: &[f32], size: u32, power: i32) -> Vec<f32> {
    let blocks = size / BLOCK;
    let mut sums = vec![0.0f64; (blocks * blocks * 3) as usize];
    for (i, value) in values.iter().enumerate() {
        let (pixel, channel) = (i as u32 / 3, i as u32 % 3);
        let block = (pixel / size / BLOCK) * blocks + pixel % size / BLOCK;
        sums[(block * 3 + channel) as usize] += f64::from(*value);
    }
    let scale = f64::from(BLOCK * BLOCK).powi(power);
    sums.iter().map(|sum| (sum / scale) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_means_of_their_pixels() {
        // Each value is its own block's number times 10 plus its channel.
        let values: Vec<f32> = (0..16 * 16)
            .flat_map(|pixel| {
                let block = (pixel / 16 / 8) * 2 + pixel % 16 / 8;
                [0, 1, 2].map(|channel| (block * 10 + channel) as f32)
            })
            .collect();
        let expected: Vec<f32> = (0..4).flat_map(|b| [0, 1, 2].map(|c| (b * 10 + c) as f32)).collect();
        assert_eq!(block_means(&values, 16, 1), expected);
        // 64 equal variances v give the mean's variance v/64.
        assert_eq!(block_means(&[64.0; 192], 8, 2), [1.0; 3]);
    }

    #[test]
    fn squared_z_counts_values_with_noise() {
        // z = 2 and 0 where there is noise; the value without noise does not count.
        let (a, b) = ([3.0, 1.0, 5.0], [1.0, 1.0, 5.0]);
        assert_eq!(mean_squared_z(&a, &[0.5, 0.5, 0.0], &b, &[0.5, 0.5, 0.0]), 2.0);
    }

    #[test]
    fn wrong_options_are_refused() {
        let refused = |options: AgreementOptions| selected(&options).is_err();
        assert!(refused(AgreementOptions {
            scenes: vec!["no such scene".into()],
            ..Default::default()
        }));
        assert!(refused(AgreementOptions {
            size: 60,
            ..Default::default()
        }));
        assert!(refused(AgreementOptions {
            passes: 1,
            ..Default::default()
        }));
        // Not a square, and fewer pictures than have a standard error.
        assert!(refused(AgreementOptions {
            timing_samples: 128,
            ..Default::default()
        }));
        assert!(refused(AgreementOptions {
            timing_rounds: 1,
            ..Default::default()
        }));
        // Products beyond 32 bits.
        assert!(refused(AgreementOptions {
            passes: 1 << 16,
            samples_per_pass: 1 << 16,
            ..Default::default()
        }));
        for (timing_rounds, timing_pictures) in [(1 << 20, 1 << 20), (u32::MAX, u32::MAX)] {
            assert!(refused(AgreementOptions {
                timing_rounds,
                timing_pictures,
                ..Default::default()
            }));
        }
        assert!(refused(AgreementOptions {
            passes: u32::MAX,
            samples_per_pass: 1,
            ..Default::default()
        }));
        assert!(!refused(AgreementOptions {
            timing_rounds: 0,
            ..Default::default()
        }));
        assert!(!refused(AgreementOptions::default()));
        let few = AgreementOptions {
            timing_rounds: 1,
            ..Default::default()
        };
        let cause = few.check().unwrap_err().to_string();
        assert_eq!(
            cause,
            "setting --timing-rounds: 1 times 2 pictures are 2, below 3: take more rounds or pictures"
        );
    }
}
