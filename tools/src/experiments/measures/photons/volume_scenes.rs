//! The source's nine scenes of photons in media, light that falls through a passage into haze, a cloud and wax: the media of the first beside its table, and the light of all by photons beside the
//! path tracer's, in its mean and in its error at equal time.
//!
//! Source of the table: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 7.1.

use std::time::Duration;

use clerestory::film::{Picture, ToneCurve, ToneMap, png};
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{DensityGrid, LightKind, Phase};
use clerestory::{Error, Result, scene};
use glam::Vec3;
use serde_json::json;

use super::scenarios::{PublishedMedium, SCENARIOS, Scenario, by_name};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::{greatest, mean_with_error};
use crate::experiments::measures::pictures::mean;
use crate::experiments::reference::SEED;
use crate::experiments::sweep::SPP_MAX;
use crate::experiments::unbiased;
use crate::experiments::watch::render;

/// Light that was scattered once or twice, in a medium at least once. What a mirror throws into a medium is not among it: no path from the eye finds a lamp without area there.
const PATHS: &str = "L(V|[DGV]V|V.)E";
/// Light that was scattered in a medium, however often: what is seen of a body behind its surface.
const OF_BODIES: &str = "L.*V.*E";
/// Pixels, and samples a pixel of references, and of each picture of a smoke run.
const FULL: ([u32; 2], u32) = ([32, 24], 16384);
const SMOKE: ([u32; 2], u32) = ([8, 6], 16);
const SMOKE_SPP: u32 = 2;
/// Seconds of a picture.
const SECONDS: f64 = 1.5;
/// Pictures of each technique.
const TURNS: usize = 5;
const TECHNIQUES: [&str; 2] = ["path", "photon"];
/// Scenes of a smoke run.
const SMOKE_SCENES: usize = 1;
/// What the source has not, with its name and light paths: light that falls through a passage, a dense grid that scatters forward, and a solid whose inside scatters.
const OWN: [(&str, &str, &str); 3] = [
    ("passage, haze", HAZE, PATHS),
    ("cloud", "builtin:cloud?size=32", PATHS),
    ("wax", "builtin:wax", OF_BODIES),
];
const HAZE: &str = "builtin:passage?sigma_a=0.05&sigma_s=0.5&g=0.6";
/// The picture of shafts of light in haze: its pixels, and samples of each; the same of a smoke run.
const SHAFTS: &str = "haze.png";
const SHAFTS_FORM: ([u32; 2], u32) = ([160, 120], 64);
const SHAFTS_SMOKE_FORM: ([u32; 2], u32) = ([16, 12], 1);
/// Means may differ by that much, relatively, or by so many standard errors.
const ALLOWED: f64 = 0.01;
const DEVIATIONS: f64 = 3.0;

rows! {
    /// A scene's medium.
    struct MediumRow = "Media as rendered, beside the source's" by [scene] {
        scene: String = "scene",
        light: String = "light",
        sigma_a: String = "σₐ (1/m)",
        sigma_s: String = "σₛ (1/m)",
        density: String = "density",
        k: f64 = "k",
        difference: f64 = "greatest difference of a number from the source's, relative",
        alike: bool = "light, phase function and evenness are the source's",
    }
    beside "source: σₐ (1/m)" = |row| published(&row.scene, |medium| bands(medium.sigma_a)).into();
    beside "source: σₛ (1/m)" = |row| published(&row.scene, |medium| bands(medium.sigma_s)).into();
    beside "source: k" = |row| published(&row.scene, |medium| medium.k).into();
}

rows! {
    /// The light of a scene's medium.
    struct Light = "Light of the media, by photons and by the path tracer" by [scene] {
        scene: String = "scene",
        path: f64 = "mean radiance, path tracer",
        path_error: f64 = "its standard error (%)",
        photon: f64 = "mean radiance, photons",
        photon_error: f64 = "its standard error (%)",
        difference: f64 = "photons' difference from the path tracer (%)",
        over_allowed: f64 = "difference over what is allowed",
        path_rmse: Repeats = "relative RMSE, path tracer",
        photon_rmse: Repeats = "relative RMSE, photons",
        ratio: Repeats = "relative RMSE, photons over path tracer",
        path_seconds: Repeats = "seconds, path tracer",
        photon_seconds: Repeats = "seconds, photons",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    media: Vec<MediumRow>,
    light: Vec<Light>,
}

const OF_MEDIA: &[Criterion<MediumRow>] = &[
    Criterion::each(
        "coefficients are the source's: the greatest difference, relative",
        Bound::AtMost(1e-6),
        |row: &MediumRow| row.difference.into(),
    )
    .in_every_form()
    .because("they are f32, and averages of grids of such"),
    Criterion::each(
        "lights, phase functions and evenness are the source's",
        Bound::AtLeast(1.0),
        |row: &MediumRow| row.alike.into(),
    )
    .in_every_form(),
];
const OF_LIGHT: &[Criterion<Light>] = &[
    Criterion::each(
        "means agree within 1 % or three standard errors: difference over that",
        Bound::AtMost(1.0),
        |row: &Light| row.over_allowed.into(),
    ),
    Criterion::each(
        "means are known well enough: three standard errors of both together (%)",
        Bound::AtMost(100.0 * ALLOWED),
        |row: &Light| (DEVIATIONS * row.path_error.hypot(row.photon_error)).into(),
    ),
];

fn published<T>(scene: &str, of: fn(&PublishedMedium) -> T) -> Option<T> {
    by_name(scene).map(|scenario| of(&scenario.medium))
}

fn bands(values: [f64; 3]) -> String {
    let [red, green, blue] = values.map(|value| format!("{value:.2}"));
    if red == green && green == blue {
        red
    } else {
        format!("{red}, {green}, {blue}")
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let name = |scenario: &Scenario| scenario.name.to_owned();
        let media = context.each(&SCENARIOS, name, |scenario| Ok(vec![MediumRow::of(scenario)?]))?;
        let of_source = SCENARIOS.iter().map(|scenario| (scenario.name, scenario.scene, PATHS));
        let all: Vec<(&str, &str, &'static str)> = of_source.chain(OWN).collect();
        let name = |(name, ..): &(&str, &str, &'static str)| (*name).to_owned();
        let cases = context.first(&all, SMOKE_SCENES);
        let light = context.each_kept(&gpu, cases, name, |(name, address, paths)| {
            let stage = Stage::new(context, &gpu, address, paths)?;
            let row = stage.map(|stage| stage.row(context, name)).transpose()?;
            Ok(Vec::from_iter(row.flatten()))
        })?;
        show_shafts(context, &gpu)?;
        Ok(Self { media, light })
    }

    fn findings(&self) -> Findings {
        let found = Findings::of(&self.media, OF_MEDIA)
            .headline(
                "relative RMSE of photons over that of the path tracer at equal time, geometric mean",
                geometric_mean(self.light.iter().map(|row| row.ratio.measured())),
            )
            .note(
                "The source's is Table 7.1. Coefficients of the uneven medium are averages over its grid. The source lifts the ring into its medium and fills its hall partly; how \
                 high is not told: here the ring hangs 0.3 m above the floor, and the hall is filled 4.5 m high.",
            )
            .and(Findings::of(&self.light, OF_LIGHT))
            .note(format!(
                "Light that was scattered once or twice, in the medium at least once, and not by a mirror first; of wax all that was scattered in it. {} × {} pixels; {TURNS} pictures of {SECONDS} s by each \
                 technique, in turns, with default settings, beside a reference by the path tracer of {} samples a pixel, whose variance is subtracted from errors. Means are those of the reference and of \
                 all pictures of photons.",
                FULL.0[0], FULL.0[1], FULL.1,
            ));
        if self.light.is_empty() {
            return found;
        }
        found.picture(
            SHAFTS,
            &format!(
                "Light that falls through a passage into haze lies in shafts in the air: photons with default settings, {} passes.",
                SHAFTS_FORM.1
            ),
        )
    }
}

impl MediumRow {
    fn of(scenario: &Scenario) -> Result<Self> {
        let scene = scene::load(scenario.scene)?;
        let source = &scenario.medium;
        let (Some(medium), Some(light)) = (scene.media.first(), scene.lights.first()) else {
            return Err(Error::setting("scene", scenario.scene, "has no medium or no light"));
        };
        let mean = medium.density.as_ref().map_or(1.0, DensityGrid::mean);
        let average = |coefficient: Vec3| coefficient.to_array().map(|band| f64::from(band) * mean);
        let (sigma_a, sigma_s) = (average(medium.sigma_a), average(medium.sigma_s));
        let k = match medium.phase {
            Phase::Schlick { k } => Some(f64::from(k)),
            Phase::Isotropic => Some(0.0),
            // Of this one all are alike where the parameter is 0.
            Phase::HenyeyGreenstein { g } => (g == 0.0).then_some(0.0),
            Phase::Rayleigh => None,
        };
        let pairs = sigma_a.iter().zip(&source.sigma_a);
        let pairs = pairs.chain(sigma_s.iter().zip(&source.sigma_s));
        let off = pairs.map(|(found, expected)| (found / expected - 1.0).abs());
        let off_by_phase = (k.unwrap_or(f64::INFINITY) - source.k).abs();
        let is_spot = matches!(light.kind, LightKind::Spot { .. });
        Ok(Self {
            scene: scenario.name.into(),
            light: if is_spot { "spot" } else { "point" }.into(),
            sigma_a: bands(sigma_a),
            sigma_s: bands(sigma_s),
            density: medium.density.as_ref().map_or_else(
                || "even".into(),
                |grid| format!("a grid of {} × {} × {} cells", grid.size[0], grid.size[1], grid.size[2]),
            ),
            k: k.unwrap_or(f64::INFINITY),
            difference: greatest(off.chain([off_by_phase])),
            alike: is_spot == source.is_spot && medium.density.is_none() == source.is_even && scene.lights.len() == 1,
        })
    }
}

/// Renders haze behind a passage, for the page's picture.
fn show_shafts(context: &Context<'_>, gpu: &Gpu) -> Result<()> {
    let (size, spp) = context.pick(SHAFTS_FORM, SHAFTS_SMOKE_FORM);
    let renderer = Renderer::new(gpu, &scene::load(HAZE)?)?;
    let options = RenderOptions {
        technique: Some("photon".into()),
        size,
        spp,
        ..RenderOptions::default()
    };
    if let Some(rendered) = render(&renderer, &options, context.watch)? {
        let layer = rendered.picture.main_layer()?;
        let tone = ToneMap {
            exposure: -mean(&rendered.picture)?.max(f64::MIN_POSITIVE).log2(),
            curve: ToneCurve::Bands,
        };
        context.picture(SHAFTS, &png::tone_mapped(layer, size[0], &tone));
    }
    Ok(())
}

/// A scene with its reference.
struct Stage {
    renderer: Renderer,
    reference: Picture,
    paths: &'static str,
    base: RenderOptions,
}

/// A picture's mean, its relative RMSE and its seconds.
type Scored = [f64; 3];

impl Stage {
    /// Renders the reference; `None` when it was stopped.
    fn new(context: &Context<'_>, gpu: &Gpu, address: &str, paths: &'static str) -> Result<Option<Self>> {
        let renderer = Renderer::new(gpu, &scene::load(address)?)?;
        let (size, spp) = context.pick(FULL, SMOKE);
        let base = RenderOptions {
            size,
            ..RenderOptions::default()
        };
        let of_reference = RenderOptions {
            technique: Some("path".into()),
            spp,
            seed: SEED,
            settings: json!({ "path_set": paths, "sampler": "pcg" }).into(),
            ..base.clone()
        };
        let rendered = render(&renderer, &of_reference, context.watch)?;
        Ok(rendered.map(|rendered| Self {
            renderer,
            reference: rendered.picture,
            paths,
            base,
        }))
    }

    /// `None` when it was stopped.
    fn picture(&self, context: &Context<'_>, technique: &str, seed: u32) -> Result<Option<Scored>> {
        let options = RenderOptions {
            technique: Some(technique.into()),
            seed,
            // A smoke run has no time.
            spp: context.pick(SPP_MAX, SMOKE_SPP),
            time_budget: context.pick(Some(Duration::from_secs_f64(SECONDS)), None),
            settings: json!({ "path_set": self.paths }).into(),
            ..self.base.clone()
        };
        let Some(rendered) = render(&self.renderer, &options, context.watch)? else {
            return Ok(None);
        };
        let error = unbiased::measure(&rendered.picture, &self.reference)?;
        Ok(Some([
            mean(&rendered.picture)?,
            unbiased::relative_rmse(&error),
            rendered.report.render_seconds,
        ]))
    }

    /// `None` when it was stopped.
    fn row(&self, context: &Context<'_>, name: &str) -> Result<Option<Light>> {
        let mut seed = 0;
        let turns = context.in_turns(TURNS, TECHNIQUES.len(), |i| {
            seed += 1;
            self.picture(context, TECHNIQUES[i], seed)
        })?;
        let turns: Option<Vec<Vec<Scored>>> = turns.into_iter().map(|turns| turns.into_iter().collect()).collect();
        let Some([path, photons]) = turns.as_deref().and_then(<[Vec<Scored>]>::first_chunk::<2>) else {
            return Ok(None);
        };
        let ([_, path_rmse, path_seconds], [means, photon_rmse, photon_seconds]) =
            (Repeats::by_part(path), Repeats::by_part(photons));
        let (path, path_error) = (mean(&self.reference)?, unbiased::error_of_mean(&self.reference)?);
        let [photon, photon_error] = mean_with_error(&means.0);
        let off = photon / path - 1.0;
        let relative = photon_error / photon;
        let allowed = ALLOWED.max(DEVIATIONS * path_error.hypot(relative));
        Ok(Some(Light {
            scene: name.into(),
            path,
            path_error: 100.0 * path_error,
            photon,
            photon_error: 100.0 * relative,
            difference: 100.0 * off,
            over_allowed: off.abs() / allowed,
            ratio: photon_rmse.over(&path_rmse),
            path_rmse,
            photon_rmse,
            path_seconds,
            photon_seconds,
        }))
    }
}
