//! How much the kernels of photons in media are to be dampened: the error of one pass by the dampening, in the source's nine scenes and for its three sets of photons.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.3.2 and Table 7.2, whose choices by eye stand beside the
//! errors. Oracle: the path tracer; where a mirror throws light into a medium, which no path from the eye finds, bidirectional path tracing. The variance of either is subtracted.

use std::sync::Arc;

use clerestory::film::Picture;
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::techniques::photon_mapping::PhotonMapper;
use clerestory::{Result, scene};
use serde_json::json;

use super::scenarios::{Depths, SCENARIOS, Scenario};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::finished;
use crate::experiments::reference::SEED;
use crate::experiments::unbiased;
use crate::experiments::watch::render;

/// Units that are tried beside the source's own, m; 0 for none.
const TRIED: [f32; 6] = [0.0, 1.0, 1.5, 2.5, 4.0, 10.0];
const SMOKE_TRIED: usize = 2;
/// What is measured.
const FULL: Form = Form {
    size: [32, 24],
    share: 8,
    turns: 5,
    spp: 1024,
};
const SMOKE: Form = Form {
    size: [8, 6],
    share: 1024,
    turns: 2,
    spp: 16,
};
/// A medium that scatters 98 % of what collides, and one that scatters a quarter.
const DENSER: [&str; 2] = ["ring, point light", "atrium, neutral"];
/// Scenes of which the second wants a weaker dampening, as the source has it, and what they differ in.
const WEAKER: [(&str, [&str; 2]); 3] = [
    ("a point light, with a spot", ["ring, point light", "ring, spot"]),
    (
        "an even medium, with an uneven one",
        ["atrium, coloured", "atrium, uneven"],
    ),
    (
        "even scattering, with forward scattering",
        ["cathedral, k = 0", "cathedral, k = 0.5"],
    ),
];

/// Sizes of a run.
#[derive(Clone, Copy)]
struct Form {
    size: [u32; 2],
    /// The source's photons over those of a picture.
    share: u32,
    /// Pictures of each dampening.
    turns: u32,
    /// Samples a pixel of references.
    spp: u32,
}

rows! {
    /// A dampening.
    struct Row = "Error by the dampening" by [scene, depths, dampening] {
        scene: String = "scene",
        depths: String = "scatterings before",
        dampening: f64 = "dampening (m), 0 for none",
        is_source: bool = "the source's",
        error: Repeats = "relative RMSE of a pass",
        kernels: f64 = "k, contributions per query",
    }
}

rows! {
    /// The dampening of least error.
    struct Least = "Dampening of least error" by [scene, depths] {
        scene: String = "scene",
        depths: String = "scatterings before",
        least: String = "dampening (m)",
        source: f64 = "source: dampening (m)",
        strength: Repeats = "its reciprocal, turn by turn (1/m), 0 for none",
        over_none: Repeats = "relative RMSE at the source's dampening over that without",
        over_least: Repeats = "relative RMSE at the source's dampening over the least",
    }
}

rows! {
    /// Two sets of photons.
    struct Trend = "How much stronger the dampening of least error is" by [compared, of] {
        compared: String = "compared",
        of: String = "of",
        stronger: Repeats = "reciprocal of the first less that of the second (1/m)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    errors: Vec<Row>,
}

const BY_DEPTH: &str = "photons that were scattered once or twice before, with those scattered once";
const BY_MEDIUM: &str = "the medium that scatters nearly all, with the one that scatters a quarter";

const OF_LEAST: &[Criterion<Least>] = &[Criterion::each(
    "the source's dampening errs no more than none: relative RMSE over that without",
    Bound::AtMost(1.0),
    |row: &Least| (&row.over_none).into(),
)
.because("it is there to lessen errors")];
const OF_TREND: &[Criterion<Trend>] = &[
    Criterion::each(
        "deeper photons want a dampening as strong or stronger: its reciprocal, less that of the others (1/m)",
        Bound::AtLeast(0.0),
        |row: &Trend| (&row.stronger).into(),
    )
    .among(|row| row.compared == BY_DEPTH),
    Criterion::each(
        "a medium that scatters more wants a dampening as strong or stronger: its reciprocal, less that of the other (1/m)",
        Bound::AtLeast(0.0),
        |row: &Trend| (&row.stronger).into(),
    )
    .among(|row| row.compared == BY_MEDIUM),
    Criterion::each(
        "a spot, an uneven medium and forward scattering want a dampening as weak or weaker: the others' reciprocal, less theirs (1/m)",
        Bound::AtLeast(0.0),
        |row: &Trend| (&row.stronger).into(),
    )
    .among(|row| WEAKER.iter().any(|(compared, _)| row.compared == *compared)),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let cases: Vec<(&Scenario, Depths)> = SCENARIOS
            .iter()
            .flat_map(|scenario| Depths::ALL.map(|depths| (scenario, depths)))
            .filter(|(scenario, depths)| !context.smoke || is_of_smoke_run(scenario, *depths))
            .collect();
        let name = |(scenario, depths): &(&Scenario, Depths)| format!("{}, {}", scenario.name, depths.words());
        let errors = context.each_kept(&gpu, &cases, name, |(scenario, depths)| {
            rows(context, &gpu, scenario, *depths)
        })?;
        Ok(Self { errors })
    }

    fn findings(&self) -> Findings {
        let least = least(&self.errors);
        let trends = trends(&least);
        Findings::of(&least, OF_LEAST)
            .headline(
                "relative RMSE at the source's dampening over that without, geometric mean",
                geometric_mean(least.iter().map(|row| row.over_none.measured())),
            )
            .note(format!(
                "Light that is seen in a medium of one pass of an eighth of the source's photons, under its kernels, which are wider than its own by two; {} × {} pixels, one sample each, {} \
                 pictures, each with the same photons for all that are tried: {} m, and the source's. Dampening begins at that size of a footprint, so that the less it is the stronger it is. \
                 The source's were chosen by eye.",
                FULL.size[0],
                FULL.size[1],
                FULL.turns,
                TRIED.map(|tried| tried.to_string()).join(", "),
            ))
            .and(Findings::of(&trends, OF_TREND))
            .and(Findings::of(&self.errors, &[]).long())
    }
}

/// One set of photons of the scenes that are compared, and another of one of them.
fn is_of_smoke_run(scenario: &Scenario, depths: Depths) -> bool {
    let mut weaker = WEAKER.iter().flat_map(|(_, scenes)| scenes);
    let is_compared = DENSER.contains(&scenario.name) || weaker.any(|name| *name == scenario.name);
    match depths {
        Depths::One => is_compared,
        Depths::OneAndTwo => scenario.name == DENSER[0],
        Depths::UpToOne => false,
    }
}

/// What is tried, with the source's own in its place.
fn tried(context: &Context<'_>, source: f32) -> Vec<f32> {
    let mut all = context.first(&TRIED, SMOKE_TRIED).to_vec();
    if !all.contains(&source) {
        all.push(source);
    }
    all.sort_by(f32::total_cmp);
    all
}

fn rows(context: &Context<'_>, gpu: &Gpu, scenario: &Scenario, depths: Depths) -> Result<Vec<Row>> {
    let form = context.pick(FULL, SMOKE);
    let scene = scene::load(scenario.scene)?;
    let renderer = Renderer::new(gpu, &scene)?;
    let Some(reference) = reference(context, &renderer, scenario, depths)? else {
        return Ok(Vec::new());
    };
    let (camera, source) = (scene.require_camera(None)?, scenario.dampening(depths));
    let mut rows = Vec::new();
    for dampening in tried(context, source) {
        if context.watch.stopped() {
            break;
        }
        let settings = scenario.settings_dampened(depths.path_set(), depths, form.share, dampening)?;
        let mut mapper = PhotonMapper::new(gpu, Arc::clone(renderer.gpu_scene()), camera, form.size, settings)?;
        let mut error = Vec::new();
        for seed in 0..form.turns {
            mapper.restart(seed)?;
            let picture = finished(&mut mapper, 1)?;
            let found = unbiased::measure(&picture, &reference)?;
            error.push(unbiased::relative_rmse(&found));
        }
        let beams = mapper.counts().beams;
        rows.push(Row {
            scene: scenario.name.into(),
            depths: depths.words().into(),
            dampening: f64::from(dampening),
            is_source: dampening == source,
            error: Repeats(error),
            kernels: beams.photons as f64 / beams.queries.max(1) as f64,
        });
    }
    Ok(rows)
}

/// `None` when it was stopped.
fn reference(
    context: &Context<'_>,
    renderer: &Renderer,
    scenario: &Scenario,
    depths: Depths,
) -> Result<Option<Picture>> {
    let form = context.pick(FULL, SMOKE);
    let mut settings = json!({ "path_set": depths.path_set(), "sampler": "pcg" });
    let technique = if scenario.has_mirror {
        // So that the variance of samples that share no vertices is known.
        settings["samples_at_once"] = json!(1);
        "bdpt"
    } else {
        "path"
    };
    let options = RenderOptions {
        technique: Some(technique.into()),
        size: form.size,
        spp: form.spp,
        seed: SEED,
        settings: settings.into(),
        ..RenderOptions::default()
    };
    let rendered = render(renderer, &options, context.watch)?;
    Ok(rendered.map(|rendered| rendered.picture))
}

/// The dampening of least error of each scene and set of photons.
fn least(errors: &[Row]) -> Vec<Least> {
    let together = |a: &Row, b: &Row| a.scene == b.scene && a.depths == b.depths;
    errors.chunk_by(together).filter_map(least_of).collect()
}

/// Of one scene and set; `None` where not all was measured.
fn least_of(group: &[Row]) -> Option<Least> {
    let by = |error: &dyn Fn(&Row) -> f64| group.iter().min_by(|a, b| error(a).total_cmp(&error(b)));
    let (first, best) = (group.first()?, by(&|row| row.error.measured().value)?);
    let source = group.iter().find(|row| row.is_source)?;
    let none = group.iter().find(|row| row.dampening == 0.0)?;
    let of_turn = |turn: usize| by(&|row| row.error.0[turn]).map(strength);
    let strength = (0..first.error.0.len()).map(of_turn).collect::<Option<Repeats>>()?;
    Some(Least {
        scene: first.scene.clone(),
        depths: first.depths.clone(),
        least: if best.dampening == 0.0 {
            "none".into()
        } else {
            best.dampening.to_string()
        },
        source: source.dampening,
        strength,
        over_none: source.error.over(&none.error),
        over_least: source.error.over(&best.error),
    })
}

/// The stronger a dampening, the greater; 0 for none, 1/m.
fn strength(row: &Row) -> f64 {
    if row.dampening == 0.0 { 0.0 } else { 1.0 / row.dampening }
}

/// The deeper set of each scene beside the other, and of each set the denser medium, and what the source dampens less.
fn trends(least: &[Least]) -> Vec<Trend> {
    let of = |scene: &str, depths: Depths| {
        least
            .iter()
            .find(|row| row.scene == scene && row.depths == depths.words())
    };
    let trend = |compared: &str, of: &str, first: Option<&Least>, second: Option<&Least>| {
        let (first, second) = (&first?.strength, &second?.strength);
        Some(Trend {
            compared: compared.into(),
            of: of.into(),
            stronger: first.0.iter().zip(&second.0).map(|(a, b)| a - b).collect(),
        })
    };
    let by_depth = SCENARIOS.iter().filter_map(|scenario| {
        let [deeper, once] = [Depths::OneAndTwo, Depths::One].map(|depths| of(scenario.name, depths));
        trend(BY_DEPTH, scenario.name, deeper, once)
    });
    let by_medium = Depths::ALL.into_iter().filter_map(|depths| {
        let [dense, thin] = DENSER.map(|scene| of(scene, depths));
        trend(
            BY_MEDIUM,
            &format!("scatterings before: {}", depths.words()),
            dense,
            thin,
        )
    });
    let by_scene = WEAKER.iter().flat_map(|(compared, scenes)| {
        Depths::ALL.into_iter().filter_map(move |depths| {
            let [stronger, weaker] = scenes.map(|scene| of(scene, depths));
            trend(
                compared,
                &format!("scatterings before: {}", depths.words()),
                stronger,
                weaker,
            )
        })
    });
    by_depth.chain(by_medium).chain(by_scene).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(scene: &str, depths: Depths, dampening: f64, error: [f64; 2]) -> Row {
        Row {
            scene: scene.into(),
            depths: depths.words().into(),
            dampening,
            is_source: dampening == 2.5,
            error: Repeats(error.to_vec()),
            kernels: 0.0,
        }
    }

    #[test]
    fn the_least_of_each_turn_is_found_and_compared() {
        let [ring, atrium] = DENSER;
        let mut errors = Vec::new();
        for (scene, depths, of_none) in [
            (ring, Depths::One, 0.125),
            (ring, Depths::OneAndTwo, 0.5),
            (atrium, Depths::One, 0.125),
        ] {
            errors.push(row(scene, depths, 0.0, [of_none, of_none]));
            errors.push(row(scene, depths, 1.0, [0.375, 0.25]));
            errors.push(row(scene, depths, 2.5, [0.25, 0.375]));
        }
        let least = least(&errors);
        assert_eq!(least.len(), 3);
        // Turn by turn 2.5 and 1 are best.
        assert_eq!((&least[1].strength.0, least[1].source), (&vec![0.4, 1.0], 2.5));
        assert_eq!(least[1].over_none.0, [0.5, 0.75]);
        assert_eq!(
            (least[0].least.as_str(), &least[0].strength.0),
            ("none", &vec![0.0, 0.0])
        );
        let trends = trends(&least);
        let found: Vec<(&str, &Vec<f64>)> = trends
            .iter()
            .map(|row| (row.compared.as_str(), &row.stronger.0))
            .collect();
        assert_eq!(found, [(BY_DEPTH, &vec![0.4, 1.0]), (BY_MEDIUM, &vec![0.0, 0.0])]);
        // A set that lacks the source's own says nothing.
        assert!(super::least(&errors[..2]).is_empty());
    }

    #[test]
    fn smoke_runs_have_a_row_of_each_trend() {
        let mut errors = Vec::new();
        for scenario in &SCENARIOS {
            for depths in Depths::ALL {
                if is_of_smoke_run(scenario, depths) {
                    errors.push(row(scenario.name, depths, 0.0, [0.5, 0.5]));
                    errors.push(row(scenario.name, depths, 2.5, [0.25, 0.25]));
                }
            }
        }
        let trends = trends(&least(&errors));
        let compared: Vec<&str> = trends.iter().map(|row| row.compared.as_str()).collect();
        let all = [BY_DEPTH, BY_MEDIUM]
            .into_iter()
            .chain(WEAKER.map(|(compared, _)| compared));
        assert_eq!(compared, all.collect::<Vec<_>>());
    }
}
