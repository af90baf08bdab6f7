//! What many lamps cost beside one: time to equal error where each place has a lamp that outshines all others, by the tree of lights and by power; and
//! from how many lights on the tree wins.
//!
//! Oracle: a picture of many more samples. The hall, its desks and the view are the same; all of its lamps shine, or that of the desk in view alone.

use clerestory::film::Picture;
use clerestory::film::metrics::{CompareOptions, compare};
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::techniques::path::LightTreeUse;
use clerestory::{Result, scene};
use serde_json::json;

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;

/// Lamps of a hall, and in a smoke run.
const LAMPS: [u32; 2] = [4096, 25];
/// Halls: what their lamps are, by a name and the parameters of the generated scene.
const HALLS: [(&str, &str); 3] = [
    ("panels", "source=panel"),
    ("shaded lamps", "source=spot"),
    ("bare lamps between walls", "source=point&walls=yes"),
];
/// Of what shines, and by what lamps are chosen.
const WAYS: [(&str, &str, &str); 3] = [(ONE, "one", "off"), (TREE, "all", "on"), (POWER, "all", "off")];
const ONE: &str = "one lamp";
const TREE: &str = "all by the tree";
const POWER: &str = "all by power";
/// Lamps of smaller halls, and scenes whose lamps are of many triangles.
const FEW: [u32; 5] = [2, 4, 9, 16, 36];
const MESHES: [&str; 1] = ["builtin:sphere-light"];
/// Side of pictures, samples per pixel, and those of references; the same of a smoke run.
const WORK: [(u32, u32, u32); 2] = [(48, 32, 4096), (8, 4, 16)];
/// The reference's seed; pictures have those after it.
const SEED: u32 = 1;

rows! {
    /// A hall with its lamps chosen in one way.
    struct Row = "Time to equal error" by [hall, lamps] {
        hall: String = "hall",
        lamps: String = "lamps",
        shining: u64 = "lamps that shine",
        samples: u64 = "samples per pixel",
        error: Repeats = "relative MSE",
        time: Repeats = "GPU time (s)",
        cost: Repeats = "relative MSE × GPU time (s)",
        time_over: Repeats = "GPU time over one lamp's",
        cost_over: Repeats = "time to equal error over one lamp's",
    }
}
rows! {
    /// A scene of fewer lights, by the tree and by power.
    struct Few = "From few lights on" by [scene, lights] {
        scene: String = "scene",
        lights: u64 = "lights with a place",
        tree: Repeats = "by the tree: relative MSE × GPU time (s)",
        power: Repeats = "by power: relative MSE × GPU time (s)",
        tree_over: Repeats = "time to equal error by the tree over that by power",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    halls: Vec<Row>,
    few: Vec<Few>,
}

const OF_HALLS: &[Criterion<Row>] = &[
    Criterion::each(
        "many lamps by the tree take at most twice one lamp's time to equal error: over one lamp's",
        Bound::AtMost(2.0),
        |row: &Row| (&row.cost_over).into(),
    )
    .among(|row| row.lamps == TREE),
    Criterion::each("power does not: over one lamp's", Bound::AtLeast(2.0), |row: &Row| {
        (&row.cost_over).into()
    })
    .among(|row| row.lamps == POWER)
    .because("else there would be nothing to gain by a tree"),
];
const OF_FEW: &[Criterion<Few>] = &[Criterion::each(
    "where the path tracer takes the tree by itself, above 16 lights, it loses nothing: time to equal error over that by power",
    Bound::AtMost(1.0),
    |row: &Few| (&row.tree_over).into(),
)
.among(|row| LightTreeUse::Auto.is_for(row.lights as usize))];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let name = |hall: &(&str, &str)| hall.0.to_owned();
        let sizes = context.pick(&FEW[..], &FEW[FEW.len() - 1..]);
        let of_halls = HALLS.iter().flat_map(|(_, parameters)| {
            let address = move |n: &u32| format!("builtin:lamp-hall?n={n}&{parameters}");
            sizes.iter().map(address)
        });
        let few: Vec<String> = of_halls.chain(MESHES.map(str::to_owned)).collect();
        Ok(Self {
            halls: context.each_kept(&gpu, context.first(&HALLS, 1), name, |hall| {
                of_hall(context, &gpu, hall)
            })?,
            few: context.each_kept(&gpu, context.first(&few, 2), String::clone, |address| {
                of_few(context, &gpu, address)
            })?,
        })
    }

    fn findings(&self) -> Findings {
        let by_tree = self.halls.iter().filter(|row| row.lamps == TREE);
        Findings::of(&self.halls, OF_HALLS)
            .headline(
                "time to equal error of many lamps by the tree over one lamp's, geometric mean",
                geometric_mean(by_tree.map(|row| row.cost_over.measured())),
            )
            .note(
                "The mean squared error falls as the number of samples grows, so that its product with the time is the time to equal error. Pictures in turns, a \
                 seed for each turn; the relative MSE is that of `clerestory compare`. By power the rare samples that find the lamp in view carry most of the \
                 error, so that few pictures show less of it than there is. Between walls the tree favours near lamps that walls hide: it knows distances and \
                 cones, and nothing of what stands between. It loses shadow rays on them; a single lamp loses none.",
            )
            .bars(
                "cost",
                "Time to equal error over one lamp's",
                &self.halls,
                |row| [row.hall.clone(), row.lamps.clone()],
                |row| row.cost_over.measured(),
            )
            .and(Findings::of(&self.few, OF_FEW))
    }
}

/// A picture and its GPU time, s.
fn render(renderer: &Renderer, side: u32, spp: u32, seed: u32, light_tree: &str) -> Result<(Picture, f64)> {
    let rendered = renderer.render(&RenderOptions {
        technique: Some("path".into()),
        size: [side; 2],
        spp,
        seed,
        settings: json!({ "light_tree": light_tree }).into(),
        ..RenderOptions::default()
    })?;
    Ok((rendered.picture, rendered.report.gpu_seconds))
}

/// The relative MSE of a picture, its GPU time, s, and their product.
fn cost((picture, seconds): &(Picture, f64), reference: &Picture) -> Result<[f64; 3]> {
    let error = compare(picture, reference, &CompareOptions::default())?.relative_mse;
    Ok([error, *seconds, error * seconds])
}

/// The ways of a hall.
fn of_hall(context: &Context<'_>, gpu: &Gpu, (hall, parameters): &(&str, &str)) -> Result<Vec<Row>> {
    let (side, spp, of_reference) = context.pick(WORK[0], WORK[1]);
    let lamps = context.pick(LAMPS[0], LAMPS[1]);
    let mut renderers = Vec::new();
    let mut references = Vec::new();
    for shining in ["one", "all"] {
        let address = format!("builtin:lamp-hall?n={lamps}&lamps={shining}&{parameters}");
        let renderer = Renderer::new(gpu, &scene::load(&address)?)?;
        // By the tree in both, which finds what there is with the least error.
        references.push(render(&renderer, side, of_reference, SEED, "on")?.0);
        renderers.push(renderer);
    }
    let mut turns = [0; WAYS.len()];
    let found = context.in_turns(5, WAYS.len(), |i| {
        let (_, shining, light_tree) = WAYS[i];
        let which = usize::from(shining == "all");
        turns[i] += 1;
        let picture = render(&renderers[which], side, spp, SEED + turns[i], light_tree)?;
        cost(&picture, &references[which])
    })?;
    let parts: Vec<[Repeats; 3]> = found.iter().map(|turns| Repeats::by_part(turns)).collect();
    let rows = WAYS
        .iter()
        .zip(&parts)
        .map(|((way, shining, _), [error, time, cost])| Row {
            hall: (*hall).into(),
            lamps: (*way).into(),
            shining: if *shining == "all" { lamps.into() } else { 1 },
            samples: spp.into(),
            error: error.clone(),
            time: time.clone(),
            cost: cost.clone(),
            time_over: time.over(&parts[0][1]),
            cost_over: cost.over(&parts[0][2]),
        });
    Ok(rows.collect())
}

/// A scene by the tree and by power.
fn of_few(context: &Context<'_>, gpu: &Gpu, address: &str) -> Result<Vec<Few>> {
    let (side, spp, of_reference) = context.pick(WORK[0], WORK[1]);
    let renderer = Renderer::new(gpu, &scene::load(address)?)?;
    let reference = render(&renderer, side, of_reference, SEED, "on")?.0;
    let mut seed = SEED;
    let found = context.in_turns(5, 2, |i| {
        seed += 1;
        let picture = render(&renderer, side, spp, seed, ["on", "off"][i])?;
        cost(&picture, &reference)
    })?;
    let [tree, power] = [0, 1].map(|i| {
        let [_, _, cost] = Repeats::by_part(&found[i]);
        cost
    });
    Ok(vec![Few {
        scene: short_name(address).into(),
        lights: renderer.gpu_scene().near_light_count() as u64,
        tree_over: tree.over(&power),
        tree,
        power,
    }])
}
