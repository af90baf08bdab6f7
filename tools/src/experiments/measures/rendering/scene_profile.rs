//! What a scene pays for: the same picture by kernels and buffers made for the scene, and by ones that hold features which it does not use.
//!
//! Oracle: pictures must not differ in any bit.

use clerestory::Result;
use clerestory::gpu::Category;
use clerestory::render::Renderer;
use clerestory::scene::Scene;
use clerestory::{gpu::Gpu, scene};

use super::unseen_features::{CHANGES, Change, FULL};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::Image;
use crate::experiments::reference::short_name;

/// Device bytes of a scene alone: geometry, materials with textures and tables, lights.
fn bytes(gpu: &Gpu, scene: &Scene) -> Result<[u64; 3]> {
    let categories = [Category::Geometry, Category::Material, Category::Light];
    let before = gpu.memory_report();
    let renderer = Renderer::new(gpu, scene)?;
    let after = gpu.memory_report();
    drop(renderer);
    Ok(categories.map(|category| after.of(category).saturating_sub(before.of(category))))
}

fn features(image: &Image) -> u64 {
    let shade = image
        .report
        .pipelines
        .iter()
        .find(|p| p.shader.ends_with("path_shade.comp"));
    let constants = shade.map_or(&[][..], |p| &p.specialization[..]);
    let compiled = constants
        .iter()
        .filter(|(name, bits)| name.starts_with("has_") && *bits != 0);
    compiled.count() as u64
}

rows! {
    /// A scene with kernels and buffers for more than it uses.
    struct Row = "One picture, kernels made for the scene and for more" by [scene, change] {
        scene: String = "scene",
        change: String = "compiled for",
        differ: u64 = "values that differ",
        features: u64 = "features in the shading kernel",
        more_features: f64 = "features more than the scene's own",
        kernels: u64 = "kernels",
        passes: u64 = "passes of the picture",
        more_passes: f64 = "passes more than the scene's own",
        geometry: u64 = "geometry (bytes)",
        material: u64 = "materials (bytes)",
        light: u64 = "lights (bytes)",
        added: f64 = "bytes of what was added itself",
        more_bytes: f64 = "bytes more than the scene's own with what was added",
        rays: u64 = "rays",
        time: Repeats = "GPU time (s)",
        time_over: Repeats = "GPU time over the scene's own",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "pictures are equal bit by bit: values that differ",
        Bound::AtMost(0.0),
        |row: &Row| row.differ.into(),
    )
    .in_every_form(),
    Criterion::each(
        "a scene's own kernels leave features out: those more with everything unseen",
        Bound::AtLeast(1.0),
        |row: &Row| row.more_features.into(),
    )
    .among(Row::is_full)
    .in_every_form(),
    Criterion::each(
        "everything unseen takes more passes: those more than the scene's own",
        Bound::AtLeast(1.0),
        |row: &Row| row.more_passes.into(),
    )
    .among(Row::is_full),
    Criterion::each(
        "everything unseen takes more bytes than the scene with what was added: those more",
        Bound::AtLeast(1.0),
        |row: &Row| row.more_bytes.into(),
    )
    .among(Row::is_full)
    .because("what was added takes bytes in any engine: as many as when it is added once more"),
    Criterion::each(
        "everything unseen takes more time: over the scene's own",
        Bound::AtLeast(1.0),
        |row: &Row| (&row.time_over).into(),
    )
    .among(Row::is_full),
];

impl Row {
    fn is_full(&self) -> bool {
        self.change == FULL
    }

    fn bytes(&self) -> u64 {
        self.geometry + self.material + self.light
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let changes = context.pick(CHANGES.to_vec(), vec![CHANGES[0], CHANGES[CHANGES.len() - 1]]);
        let gpu = (context.gpu)()?;
        let scenes = ["builtin:cornell-box", "builtin:white-furnace?frequency=4&roughness=0.4"];
        let name = |address: &&str| short_name(address).to_owned();
        context.each(&scenes, name, |address| of_scene(context, &gpu, address, &changes))
    }

    fn findings(&self) -> Findings {
        let full = self.iter().filter(|row| row.is_full());
        Findings::of(self, CRITERIA)
            .headline(
                "GPU time with everything unseen over the scene's own, geometric mean",
                geometric_mean(full.map(|row| row.time_over.measured())),
            )
            .note(
                "Unseen: on a triangle without area, so that the kernels and buffers hold the feature and no ray meets it. In turns, each time \
                 after a sample that compiles the kernels. Bytes of what was added itself: those that the device takes more when it is added once \
                 more, the features being there.",
            )
            .bars(
                "time",
                "GPU time over that of kernels made for the scene",
                self,
                |row| [row.scene.clone(), row.change.clone()],
                |row| row.time_over.measured(),
            )
    }
}

/// Values and variances of a picture, as bits.
fn bits(image: &Image) -> Vec<u32> {
    let values = image.radiance.iter().chain(&image.variance);
    values.map(|v| v.to_bits()).collect()
}

/// By how much a count exceeds the scene's own; below zero where it is less.
fn more(value: u64, own: u64) -> f64 {
    value as f64 - own as f64
}

/// All changes of a scene.
fn of_scene(context: &Context<'_>, gpu: &Gpu, address: &str, changes: &[Change]) -> Result<Vec<Row>> {
    let (size, spp) = context.pick((64, 64), (8, 4));
    let lean = scene::load(address)?;
    let scenes: Vec<Scene> = changes
        .iter()
        .map(|(_, change)| {
            let mut scene = lean.clone();
            change(&mut scene);
            scene
        })
        .collect();
    let mut rows = Vec::new();
    // Before there is any other on the device, which might share some.
    for ((what, change), scene) in changes.iter().zip(&scenes) {
        let of_scene = bytes(gpu, scene)?;
        let mut again = scene.clone();
        change(&mut again);
        let of_both: u64 = bytes(gpu, &again)?.iter().sum();
        let [geometry, material, light] = of_scene;
        rows.push(Row {
            added: more(of_both, of_scene.iter().sum()),
            scene: short_name(address).into(),
            change: (*what).into(),
            geometry,
            material,
            light,
            ..Row::default()
        });
    }
    let renderers: Result<Vec<Renderer>> = scenes.iter().map(|scene| Renderer::new(gpu, scene)).collect();
    let renderers = renderers?;
    let mut images: Vec<Option<Image>> = changes.iter().map(|_| None).collect();
    let seconds = context.in_turns(5, changes.len(), |i| {
        let image = Image::render(&renderers[i], size, spp, 5, "all")?;
        let seconds = image.report.gpu_seconds;
        // The same in each turn.
        images[i] = Some(image);
        Ok(seconds)
    })?;
    let seconds: Vec<Repeats> = seconds.into_iter().map(Repeats).collect();
    let images: Vec<Image> = images.into_iter().flatten().collect();
    let first = bits(&images[0]);
    for ((row, image), time) in rows.iter_mut().zip(&images).zip(&seconds) {
        row.differ = bits(image).iter().zip(&first).filter(|(a, b)| a != b).count() as u64;
        row.features = features(image);
        row.kernels = image.report.pipelines.len() as u64;
        row.passes = image.report.passes.iter().map(|pass| pass.count).sum();
        row.rays = image.count("rays");
        row.time = time.clone();
        row.time_over = time.over(&seconds[0]);
    }
    let own = rows[0].clone();
    for row in &mut rows {
        row.more_features = more(row.features, own.features);
        row.more_passes = more(row.passes, own.passes);
        row.more_bytes = more(row.bytes(), own.bytes()) - row.added;
    }
    Ok(rows)
}
