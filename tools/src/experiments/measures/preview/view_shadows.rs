//! Shadow maps of spots and of parallel light: how often they are wrong about the shadow of a square, where, and how wide filtered borders are.
//!
//! Sources: L. Williams, SIGGRAPH 1978; W. Reeves et al., SIGGRAPH 1987. Oracle: the square's shadow on a floor, in closed form.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::raster::{ShadowPlace, ViewShadowDesc, ViewShadowMaps};
use clerestory::scene::{LightKind, Material, Scene, SceneProfile};
use clerestory::transport::GpuScene;
use clerestory_hard_cases::random::Random;
use clerestory_hard_cases::scenes::floor;
use glam::{DVec3, Vec3};

use crate::experiments::findings::{Bound, Criterion, Findings, Study, rows};
use crate::experiments::measures::Context;

/// Texels along a side.
const SIDES: [u32; 4] = [64, 128, 256, 512];
const PLACES: usize = 200_000;
const PLACES_OF_SMOKE: usize = 5_000;
/// Width of the filter, texels, and steps of a texel across a border.
const WIDTH: u32 = 5;
const STEPS: i32 = 40;
/// Half of the floor's side and of the part of it that is asked about, and the spot's height and half angle; m, radians.
const FLOOR: f32 = 3.0;
const REACH: f32 = 1.3;
const HEIGHT: f32 = 3.0;
const OUTER: f32 = 0.6;
/// Of the view about a spot, over its half angle.
const MARGIN: f32 = 1.01;

rows! {
    /// A light's map of so many texels.
    struct Row = "The shadow of a square" by [light, side] {
        light: String = "light",
        side: u64 = "texels along a side",
        wrong: f64 = "share of wrong places",
        beyond: u64 = "wrong places more than a texel off the border",
        wide: f64 = "width of a border over that of its filter of 5 texels",
    }
}

/// What was found.
pub type Found = Vec<Row>;

const OF_ROWS: &[Criterion<Row>] = &[
    Criterion::each(
        "no place more than a texel off the border is wrong: places",
        Bound::AtMost(0.0),
        |row: &Row| row.beyond.into(),
    )
    .in_every_form(),
    Criterion::each(
        "borders are as wide as their filter within a tenth: ratio",
        Bound::Between(0.9, 1.1),
        |row: &Row| row.wide.into(),
    )
    .in_every_form(),
];

/// A floor and a square of 1 m as far above its middle.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(floor("floor", white, FLOOR, 0.0));
    scene.place(floor("square", white, 0.5, 1.0));
    scene
}

/// A light straight down, how far its map shows at the floor's height, and half a side of the square's shadow; m.
fn lights(diagonal: f32) -> [(&'static str, LightKind, f32, f32); 2] {
    let spot = LightKind::Spot {
        position: HEIGHT * Vec3::Y,
        direction: Vec3::NEG_Y,
        intensity: Vec3::ONE,
        inner: 0.5 * OUTER,
        outer: OUTER,
    };
    let parallel = LightKind::Directional {
        direction: Vec3::NEG_Y,
        irradiance: Vec3::ONE,
    };
    [
        ("parallel", parallel, diagonal, 0.5),
        (
            "spot",
            spot,
            2.0 * (MARGIN * OUTER).tan() * HEIGHT,
            0.5 * HEIGHT / (HEIGHT - 1.0),
        ),
    ]
}

fn on_floor(x: f32, z: f32) -> ShadowPlace {
    ShadowPlace {
        position: Vec3::new(x, 0.0, z),
        normal: Vec3::Y,
        slack: 1e-6,
    }
}

fn row(
    gpu: &Gpu,
    on_device: &GpuScene,
    (name, light, shows, half): (&str, LightKind, f32, f32),
    side: u32,
    places: usize,
) -> Result<Row> {
    let surfaces = on_device.surfaces();
    let maps = ViewShadowMaps::new(gpu, &surfaces, ViewShadowDesc { side, maps: 1 })?;
    let mut recorder = gpu.recorder("shadow of a square")?;
    maps.record(&mut recorder, &surfaces, &[light])?;
    recorder.submit()?.wait()?;
    let texel = shows / side as f32;
    let mut random = Random(11);
    let asked: Vec<ShadowPlace> = (0..places)
        .map(|_| on_floor(REACH * random.signed(), REACH * random.signed()))
        .collect();
    let shares = maps.look_up(&surfaces, (0, &light), 0, &asked)?;
    let (mut wrong, mut beyond) = (0u64, 0);
    for (place, share) in asked.iter().zip(shares) {
        let off = place.position.x.abs().max(place.position.z.abs()) - half;
        if (share > 0.5) != (off > 0.0) {
            wrong += 1;
            beyond += u64::from(off.abs() > texel);
        }
    }
    // The filter and a texel, so that coarse maps do not come to the shadow's other border.
    let steps = (WIDTH.div_ceil(2) + 1) as i32 * STEPS;
    let across: Vec<ShadowPlace> = (-steps..steps)
        .map(|step| on_floor(half + (step as f32 + 0.5) / STEPS as f32 * texel, 0.1))
        .collect();
    let shares = maps.look_up(&surfaces, (0, &light), WIDTH, &across)?;
    let partly = shares.iter().filter(|share| **share > 1e-3 && **share < 1.0 - 1e-3);
    Ok(Row {
        light: name.into(),
        side: side.into(),
        wrong: wrong as f64 / places as f64,
        beyond,
        wide: partly.count() as f64 / f64::from(STEPS * WIDTH as i32),
    })
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let scene = scene();
        let on_device = GpuScene::new(&gpu, &scene)?;
        let [lower, upper] = SceneProfile::of(&scene)
            .bounds
            .unwrap_or_default()
            .map(DVec3::from_array);
        let all = lights((upper - lower).length() as f32);
        let places = context.pick(PLACES, PLACES_OF_SMOKE);
        context.each(
            &all,
            |(name, ..)| (*name).to_owned(),
            |light| {
                let sides = context.first(&SIDES, 2).iter();
                sides.map(|side| row(&gpu, &on_device, *light, *side, places)).collect()
            },
        )
    }

    fn findings(&self) -> Findings {
        let finest = self.iter().rfind(|row| row.light == "spot");
        Findings::of(self, OF_ROWS)
            .headline(
                "share of wrong places about the shadow of a square, under a spot with the finest map (%)",
                finest.map(|row| (100.0 * row.wrong).into()),
            )
            .note(format!(
                "A square of 1 m, 1 m over a floor, {PLACES} places within {REACH} m of the floor's middle, under parallel light straight down and a spot {HEIGHT} m above."
            ))
    }
}
