//! Bilateral upsampling of indirect light: what it errs, what it leaves to be worked out, and what it takes, beside plain bilinear upsampling.
//!
//! Source: T. Engelhardt, "Efficient From-Point Visibility for Global Illumination in Virtual Scenes with Participating Media", PhD thesis, KIT, 2013, §8.2.3. Oracle: the same light at
//! all pixels.

use std::sync::Arc;

use clerestory::film::picture;
use clerestory::gpu::ash::vk;
use clerestory::gpu::{Access, Area, Category, Gpu};
use clerestory::raster::upsample::{UpsampleDesc, UpsampledPicture, Upsampler};
use clerestory::raster::{GBuffer, GBufferDesc, Layering, Output, View};
use clerestory::scene::{Scene, SceneProfile};
use clerestory::techniques::instant_radiosity::many_light::{ManyLight, ManyLightSettings};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::DVec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{Panel, finished, light_panel, mean_of, tiled};
use crate::experiments::reference::short_name;

const SCENES: [&str; 3] = ["builtin:cornell-box", "builtin:box-room", "builtin:conference"];
/// Pixels of the large picture along a side over those of the small one.
const FACTORS: [u32; 3] = [2, 4, 8];
const SIDE: u32 = 96;
const SMOKE_SIDE: u32 = 16;
const LIGHTS: u32 = 256;
const SMOKE_LIGHTS: u32 = 32;
/// Frames of a picture, each at other places in the pixels.
const FRAMES: u32 = 16;
const TURNS: usize = 5;
/// Distance from the tangent plane up to which a neighbour counts, over the diagonal of the scene, and the least cosine of its normal.
const PLANE: f64 = 0.01;
const NORMAL: f32 = 0.9;
/// Pictures by factor, with what is defective of them in a color of its own, beside the same light at all pixels.
const SHOWN: &str = "defective.png";
const DEFECTIVE: [u8; 3] = [255, 0, 255];
/// Pixels along a side that show one.
const ENLARGED: u32 = 2;
/// What is white in a picture, over its mean.
const WHITE: f64 = 3.0;
const INDIRECT: &str = "bounces=2,lobes=diffuse+glossy";

rows! {
    /// A factor in a scene.
    struct Row = "Indirect light at few pixels, upsampled" by [scene, factor] {
        scene: String = "scene",
        factor: u64 = "pixels along a side over those of the small picture",
        error: f64 = "relative RMSE",
        bilinear: f64 = "relative RMSE, bilinear",
        over: f64 = "RMSE over that of bilinear",
        defective: f64 = "defective pixels (%)",
        time: Repeats = "time of the device (ms)",
    }
}

/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "neighbours on the same surface err less than all neighbours: ratio",
        Bound::AtMost(1.0),
        |row: &Row| row.over.into(),
    ),
    Criterion::each(
        "a twentieth of the pixels at most has no neighbours at half of the side: share (%)",
        Bound::AtMost(5.0),
        |row: &Row| row.defective.into(),
    )
    .among(|row| row.factor == 2),
];

/// A scene on the device.
struct Subject {
    scene: Scene,
    on_device: Arc<GpuScene>,
    /// Of the box around it, m.
    diagonal: f64,
}

impl Subject {
    fn new(gpu: &Gpu, address: &str) -> Result<Self> {
        let scene = scene::load(address)?;
        let bounds = SceneProfile::of(&scene).bounds.unwrap_or_default();
        let [lower, upper] = bounds.map(DVec3::from_array);
        Ok(Self {
            on_device: Arc::new(GpuScene::new(gpu, &scene)?),
            scene,
            diagonal: (upper - lower).length(),
        })
    }

    fn gbuffer(&self, gpu: &Gpu, side: u32) -> Result<(GBuffer, View)> {
        let surfaces = self.on_device.surfaces();
        let desc = GBufferDesc {
            size: [side; 2],
            layering: Layering::One,
            outputs: &[Output::Position, Output::Normals],
        };
        let view = View::of_camera(&self.scene.cameras[0], &surfaces, Area::whole([side; 2]))?;
        Ok((GBuffer::new(gpu, &surfaces, &desc)?, view))
    }

    /// Indirect light of all of the same virtual lights at each pixel.
    fn light(&self, gpu: &Gpu, side: u32, lights: u32) -> Result<Vec<[f32; 3]>> {
        let settings = ManyLightSettings {
            lights,
            interleave: 1,
            filter: false,
            path_set: INDIRECT.parse()?,
            ..ManyLightSettings::default()
        };
        let scene = Arc::clone(&self.on_device);
        let mut renderer = ManyLight::new(gpu, scene, &self.scene.cameras[0], [side; 2], settings)?;
        let picture = finished(&mut renderer, FRAMES)?;
        let values = picture.require(picture::RADIANCE)?.values();
        Ok(values.as_chunks::<3>().0.to_vec())
    }
}

/// The large picture, and the milliseconds of its passes.
fn upsample(gpu: &Gpu, subject: &Subject, desc: UpsampleDesc, values: &[[f32; 3]]) -> Result<(UpsampledPicture, f64)> {
    let surfaces = subject.on_device.surfaces();
    let (coarse, of_coarse) = subject.gbuffer(gpu, desc.coarse[0])?;
    let (fine, of_fine) = subject.gbuffer(gpu, desc.fine[0])?;
    let input = gpu.buffer_with("few pixels", Category::Work, values)?;
    let upsampler = Upsampler::new(gpu, desc)?;
    let mut recorder = gpu.recorder("upsampling")?;
    coarse.record(&mut recorder, &surfaces, &[of_coarse])?;
    fine.record(&mut recorder, &surfaces, &[of_fine])?;
    recorder.pass("show", |pass| {
        let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        for gbuffer in [&coarse, &fine] {
            gbuffer.barrier_to(pass, Access::COMPUTE_READ, layout);
        }
        Ok(())
    })?;
    upsampler.record(&mut recorder, &coarse, &fine, &input)?;
    let timings = recorder.submit()?.wait()?;
    let passes = timings.passes.iter().filter(|pass| pass.name == "raster: upsample");
    let time = passes
        .map(|pass| pass.nanoseconds.map_or(f64::NAN, |ns| ns as f64 * 1e-6))
        .sum();
    Ok((upsampler.read(gpu)?, time))
}

/// Root of the mean squared difference where pixels are not defective, over the mean there.
fn error(found: &UpsampledPicture, sound: &[bool], truth: &[[f32; 3]]) -> f64 {
    let pixels = found.values.iter().zip(truth).zip(sound).filter(|(_, sound)| **sound);
    let values = pixels.flat_map(|((found, truth), _)| found.iter().zip(truth));
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for (found, truth) in values {
        squares += f64::from(found - truth).powi(2);
        sum += f64::from(*truth);
        count += 1.0;
    }
    (squares * count).sqrt() / sum
}

/// Light up to a brightness, with what is defective marked.
fn panel(values: &[[f32; 3]], defective: &[bool], white: f64) -> Panel {
    let mut panel = light_panel(values.as_flattened(), white);
    for (color, _) in panel.iter_mut().zip(defective).filter(|(_, defective)| **defective) {
        *color = DEFECTIVE;
    }
    panel
}

/// Rows, and panels of the factors.
fn of_scene(context: &Context<'_>, gpu: &Gpu, address: &str) -> Result<(Vec<Row>, Vec<Panel>)> {
    let (side, lights) = (context.pick(SIDE, SMOKE_SIDE), context.pick(LIGHTS, SMOKE_LIGHTS));
    let subject = Subject::new(gpu, address)?;
    let truth = subject.light(gpu, side, lights)?;
    let white = WHITE * mean_of(truth.as_flattened()).max(f64::MIN_POSITIVE);
    let mut panels = vec![panel(&truth, &[], white)];
    let mut rows = Vec::new();
    for factor in FACTORS {
        let values = subject.light(gpu, side / factor, lights)?;
        let desc = UpsampleDesc {
            coarse: [side / factor; 2],
            fine: [side; 2],
            plane_max: (PLANE * subject.diagonal) as f32,
            normal_min: NORMAL,
        };
        let (found, _) = upsample(gpu, &subject, desc, &values)?;
        let all = UpsampleDesc {
            plane_max: f32::MAX,
            normal_min: -1.0,
            ..desc
        };
        let (bilinear, _) = upsample(gpu, &subject, all, &values)?;
        let sound: Vec<bool> = found.defective.iter().map(|defective| !defective).collect();
        let time = context.in_turns(TURNS, 1, |_| Ok(upsample(gpu, &subject, desc, &values)?.1))?;
        panels.push(panel(&found.values, &found.defective, white));
        let (own, other) = (error(&found, &sound, &truth), error(&bilinear, &sound, &truth));
        rows.push(Row {
            scene: short_name(address).into(),
            factor: factor.into(),
            error: own,
            bilinear: other,
            over: own / other,
            defective: 100.0 * f64::from(found.count) / sound.len() as f64,
            time: Repeats(time.concat()),
        });
    }
    Ok((rows, panels))
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let name = |address: &&str| short_name(address).to_owned();
        let mut shown = Vec::new();
        let rows = context.each(context.first(&SCENES, 1), name, |address| {
            let (rows, panels) = of_scene(context, &gpu, address)?;
            shown.push(panels);
            Ok(rows)
        })?;
        let side = context.pick(SIDE, SMOKE_SIDE);
        context.picture(SHOWN, &tiled([side; 2], ENLARGED, &shown));
        Ok(rows)
    }

    fn findings(&self) -> Findings {
        let quarter = self.iter().filter(|row| row.factor == 4);
        let found = Findings::of(self, CRITERIA)
            .headline(
                "RMSE over that of bilinear upsampling, at a quarter of the side, geometric mean of three scenes",
                geometric_mean(quarter.map(|row| row.over.into())),
            )
            .note(format!(
                "{SIDE} × {SIDE} pixels, {LIGHTS} walks in each of {FRAMES} frames, the same for all; a neighbour counts within a hundredth of the scene's diagonal of the tangent plane, \
                 and with a cosine of its normal above {NORMAL}. Errors are those of pixels that are not defective. Pixels of both pictures are \
                 means over their areas, while what tells surfaces apart are their middles: at edges a mean over two surfaces stands for one, which all neighbours hide better. Defective are pixels that no neighbour shares a \
                 surface with: in the conference room legs and arms of chairs are thinner than a pixel of the small picture.",
            ));
        if self.is_empty() {
            return found;
        }
        found.picture(
            SHOWN,
            "Light at all pixels, and upsampled from a half, a quarter and an eighth of the side, a row a scene; what is defective is magenta.",
        )
    }
}
