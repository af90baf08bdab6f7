//! Omnidirectional shadow maps as cubes and as octahedra: how often they are wrong by how many texels they have, and what they cost, beside
//! shadow rays for the same places in the same run.
//!
//! Sources: L. Williams, SIGGRAPH 1978; T. Engelhardt and C. Dachsbacher, VMV 2008. Oracle: a ray from each place to the light.

use clerestory::Result;
use clerestory::gpu::Gpu;
use clerestory::raster::{OmniShadowDesc, OmniShadowMaps, ShadowLayout};
use glam::Vec3;

use super::shadow_places::Subject;
use crate::experiments::findings::{
    Axes, Bound, Criterion, Findings, Measured, Repeats, Study, curves, geometric_mean, rows,
};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::{ERRORS, log_of_share, mean_ratio_of_shares};
use crate::experiments::reference::short_name;
use crate::experiments::slope::least_squares;

/// Scenes, and the light's place as a share of the box around each.
const SCENES: [(&str, Vec3); 5] = [
    ("builtin:triangle-soup?n=400", Vec3::new(0.51, 0.49, 0.52)),
    ("builtin:box-city?n=60", Vec3::new(0.55, 0.6, 0.52)),
    ("builtin:divider-room", Vec3::new(0.3, 0.5, 0.4)),
    ("builtin:cornell-box", Vec3::new(0.5, 0.9, 0.55)),
    ("builtin:conference", Vec3::new(0.45, 0.85, 0.55)),
];
/// The light's place in scenes that are told.
const TOLD: Vec3 = Vec3::new(0.5, 0.6, 0.5);
/// Texels along a side of a cube's faces; octahedra have as many in all.
const SIDES: [u32; 6] = [32, 64, 128, 256, 512, 1024];
const PLACES: usize = 200_000;
const TURNS: usize = 5;
/// Width of the filter that is compared with none.
const WIDTH: u32 = 2;

rows! {
    /// A shadow map.
    struct Row = "Shadow maps of one light" by [scene, layout, side] {
        scene: String = "scene",
        layout: String = "layout",
        side: u64 = "side of the cube's faces (texels)",
        texels: u64 = "texels",
        places: u64 = "places",
        lit: f64 = "share of lit places",
        wrong: f64 = "share of wrong places",
        filtered: f64 = "mean difference, filtered",
        draw: Repeats = "draw (ms)",
        look_up: Repeats = "look-up (ns)",
        filter: Repeats = "filtered look-up (ns)",
        ray: Repeats = "shadow ray (ns)",
    }
}

rows! {
    /// How a layout's errors fall in a scene.
    struct Rate = "Rates of errors" by [scene, layout] {
        scene: String = "scene",
        layout: String = "layout",
        exponent: Measured = "power of texels along a side by which errors grow",
        coarsest: f64 = "wrong places, coarsest map (%)",
        finest: f64 = "wrong places, finest map (%)",
    }
}

rows! {
    /// An octahedron beside a cube.
    struct Pair = "Octahedra beside cubes of as many texels (geometric means over sides)" by [scene] {
        scene: String = "scene",
        wrong: Measured = "octahedron's error over the cube's",
        draw: Measured = "octahedron's time to draw over the cube's",
    }
}

/// What was found.
pub type Found = Vec<Row>;

const OF_RATES: &[Criterion<Rate>] = &[
    Criterion::each(
        "errors fall as one over the texels along a side: their exponent",
        Bound::Between(-1.1, -0.9),
        |row: &Rate| row.exponent,
    )
    .because("a tenth is four standard errors of 200,000 places"),
    Criterion::each(
        "the finest maps are wrong at borders of shadows alone: wrong places (%)",
        Bound::AtMost(1.0),
        |row: &Rate| row.finest.into(),
    )
    .because("of 1024 texels along a side, borders ten sides long, a texel wide"),
];
const OF_PAIRS: &[Criterion<Pair>] = &[Criterion::each(
    "an octahedron's error is within a fifth of the cube's: their ratio",
    Bound::Between(0.8, 1.2),
    |row: &Pair| row.wrong,
)
.because("intervals of 95 % by the number of places")];

/// The exponent of errors against texels along a side, by least squares in logarithms, with its margin by chance: that of counts of places.
fn exponent(rows: &[&Row]) -> Measured {
    let shares: Vec<[f64; 2]> = rows.iter().map(|row| log_of_share(row.wrong, row.places)).collect();
    let texels = rows.iter().map(|row| 0.5 * (row.texels as f64).ln());
    let points: Vec<(f64, f64)> = texels.zip(&shares).map(|(x, [y, _])| (x, *y)).collect();
    let mean = points.iter().map(|(x, _)| x).sum::<f64>() / points.len() as f64;
    let spread: f64 = points.iter().map(|(x, _)| (x - mean).powi(2)).sum();
    let variance = |([_, variance], (x, _)): (&[f64; 2], &(f64, f64))| ((x - mean) / spread).powi(2) * variance;
    let variance: f64 = shares.iter().zip(&points).map(variance).sum();
    Measured::within(least_squares(&points).unwrap_or(f64::NAN), ERRORS * variance.sqrt())
}

fn rates(rows: &[Row]) -> Vec<Rate> {
    let mut rates: Vec<Rate> = Vec::new();
    for row in rows {
        let is_same = |rate: &Rate| (&rate.scene, &rate.layout) == (&row.scene, &row.layout);
        if rates.iter().any(is_same) {
            continue;
        }
        let same = rows
            .iter()
            .filter(|other| (&other.scene, &other.layout) == (&row.scene, &row.layout));
        let same: Vec<&Row> = same.collect();
        let wrong = |row: Option<&&Row>| row.map_or(f64::NAN, |row| 1e2 * row.wrong);
        rates.push(Rate {
            scene: row.scene.clone(),
            layout: row.layout.clone(),
            exponent: exponent(&same),
            coarsest: wrong(same.first()),
            finest: wrong(same.last()),
        });
    }
    rates
}

/// Octahedra beside the cubes of as many texels, by scene.
fn pairs(rows: &[Row]) -> Vec<Pair> {
    let [cube, octahedron] = ShadowLayout::ALL.map(ShadowLayout::name);
    let mut scenes: Vec<&str> = rows.iter().map(|row| row.scene.as_str()).collect();
    scenes.dedup();
    let pair = |scene: &&str| {
        let of = |layout: &'static str| {
            rows.iter()
                .filter(move |row| row.scene == *scene && row.layout == layout)
        };
        let both: Vec<(&Row, &Row)> = of(octahedron).zip(of(cube)).collect();
        let wrong = both.iter().map(|(a, b)| ([a.wrong, b.wrong], a.places));
        let draw = geometric_mean(both.iter().map(|(a, b)| a.draw.over(&b.draw).measured()));
        Pair {
            scene: (*scene).into(),
            wrong: mean_ratio_of_shares(wrong),
            draw: draw.unwrap_or(Measured::exact(f64::NAN)),
        }
    };
    scenes.iter().map(pair).collect()
}

/// Seconds of the device: to draw a map, for a look-up and for a filtered one.
fn seconds(gpu: &Gpu, subject: &Subject, maps: &OmniShadowMaps) -> Result<[f64; 3]> {
    let mut recorder = gpu.recorder("shadow map")?;
    maps.record(&mut recorder, &subject.scene.surfaces(), &[subject.light])?;
    let draw = recorder.submit()?.wait()?.seconds();
    let look_up = |width| -> Result<f64> {
        let (_, timings) = maps.look_up_timed(0, subject.light, width, &subject.places)?;
        Ok(timings.seconds() / subject.places.len() as f64)
    };
    Ok([draw, look_up(0)?, look_up(WIDTH)?])
}

/// Both layouts of as many texels, in turns with shadow rays.
fn beside_each_other(context: &Context<'_>, gpu: &Gpu, scene: &str, subject: &Subject, side: u32) -> Result<Vec<Row>> {
    let texels = 6 * u64::from(side) * u64::from(side);
    let descs = ShadowLayout::ALL.map(|layout| OmniShadowDesc {
        layout,
        side: layout.side_for(texels),
        maps: 1,
    });
    let maps: Vec<OmniShadowMaps> = descs
        .iter()
        .map(|desc| OmniShadowMaps::new(gpu, &subject.scene.surfaces(), *desc))
        .collect::<Result<_>>()?;
    let turns = context.in_turns(TURNS, maps.len() + 1, |contender| match maps.get(contender) {
        Some(maps) => seconds(gpu, subject, maps),
        None => Ok([subject.ray_seconds()?; 3]),
    })?;
    let times: Vec<[Repeats; 3]> = turns.iter().map(|turns| Repeats::by_part(turns)).collect();
    let row = |(at, desc): (usize, &OmniShadowDesc)| {
        let off = |width| -> Result<f64> {
            let (shares, _) = maps[at].look_up_timed(0, subject.light, width, &subject.places)?;
            Ok(subject.error(&shares))
        };
        let [draw, look_up, filter] = &times[at];
        Ok(Row {
            scene: scene.into(),
            layout: desc.layout.name().into(),
            side: side.into(),
            texels: desc.texels(),
            places: subject.places.len() as u64,
            lit: subject.lit_share(),
            wrong: off(0)?,
            filtered: off(WIDTH)?,
            draw: draw.scaled(1e3),
            look_up: look_up.scaled(1e9),
            filter: filter.scaled(1e9),
            ray: times[maps.len()][0].scaled(1e9),
        })
    };
    descs.iter().enumerate().map(row).collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let own = context
            .first(&SCENES, 1)
            .iter()
            .map(|(address, share)| ((*address).to_owned(), *share));
        let told = context.scenes.iter().map(|address| (address.clone(), TOLD));
        let scenes: Vec<(String, Vec3)> = if context.scenes.is_empty() {
            own.collect()
        } else {
            told.collect()
        };
        context.each(
            &scenes,
            |(address, _)| short_name(address).to_owned(),
            |(address, share)| {
                let subject = Subject::new(&gpu, address, *share, context.pick(PLACES, 2000))?;
                let scene = short_name(address).to_owned();
                let mut rows = Vec::new();
                for side in context.first(&SIDES, 2) {
                    rows.extend(beside_each_other(context, &gpu, &scene, &subject, *side)?);
                }
                Ok(rows)
            },
        )
    }

    fn findings(&self) -> Findings {
        let pairs = pairs(self);
        Findings::of(&rates(self), OF_RATES)
            .headline(
                "an octahedron's error over the cube's (geometric mean over scenes)",
                geometric_mean(pairs.iter().map(|pair| pair.wrong)),
            )
            .curves(
                "wrong",
                "Places that shadow maps get wrong",
                Axes::rates("texels along a side", "share of wrong places"),
                curves(
                    self,
                    |row| format!("{}, {}", row.scene, row.layout),
                    |row| ((row.texels as f64).sqrt(), row.wrong.into()),
                ),
            )
            .note(
                "Exponents by least squares over all sizes; intervals of 95 % by the number of places that are wrong, those of sizes and layouts taken \
                 as independent. Each number counts half a place more, so that none is left out that is wrong nowhere.",
            )
            .and(Findings::of(&pairs, OF_PAIRS))
            .and(Findings::of(self, &[]))
            .note(format!(
                "Places are spread evenly over what turns its outer side to the light (bottoms and insides of bodies are none). A place is wrong where \
                 the nearest texel says otherwise than the ray from it to the light. The filter averages {WIDTH} texels each way. Times are of the \
                 device's timestamps; cube, octahedron and rays take turns, each for the same places, one ray per invocation through the binary \
                 hierarchy. A cube is drawn by one draw of six instances where the device can, an octahedron by one draw of eight."
            ))
    }
}
