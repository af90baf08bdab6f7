//! Live maps: what a frame's map costs by its size and its parts, and how wrong reflections of several widths by it are.
//!
//! Sources: T. Engelhardt and C. Dachsbacher, VMV 2008; B. Karis, SIGGRAPH 2013. Oracle: a map of 2048² texels, and sums of the lobes over it in f64.

use clerestory::Result;
use clerestory::techniques::preview::{LightProbeDesc, LiveProbe, ProbeMap};
use glam::Vec3;

use super::live_stages::{DIRECTIONS, FINEST, IRRADIANCE, MIRROR, MIRRORS, REFERENCE, Reference, SUMMED, Stage};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Repeats, Study, curves, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;
use crate::experiments::slope::least_squares;

/// Scenes, and the map's place as a share of the box around each.
const SCENES: [(&str, Vec3); 4] = [
    ("builtin:box-room?source=point", Vec3::new(0.45, 0.4, 0.55)),
    ("builtin:conference?source=point", Vec3::new(0.4, 0.5, 0.45)),
    ("builtin:cathedral?source=point", Vec3::new(0.5, 0.25, 0.55)),
    ("builtin:divider-room", Vec3::new(0.3, 0.5, 0.4)),
];
const SIDES: [u32; 3] = [128, 256, 512];
/// Texels along a side of the reference over those of maps whose mirrors it judges: its own error is about a third of theirs, and adds a
/// twentieth to them, where errors fall as −½.
const FINER: u64 = 8;
const TURNS: usize = 5;
/// The size that one number tells of.
const TYPICAL: u64 = 256;

rows! {
    /// Frames of a map.
    struct Row = "Live maps" by [scene, side] {
        scene: String = "scene",
        side: u64 = "texels a side",
        draw: Repeats = "draw (ms)",
        shade: Repeats = "shade (ms)",
        levels: Repeats = "levels, borders (ms)",
        copy: Repeats = "copy (ms)",
        filter: Repeats = "filter (ms)",
        all: Repeats = "all parts (ms)",
        size: f64 = "MiB",
    }
}

rows! {
    /// Look-ups of one width in a map.
    struct LookUp = "RMS error of look-ups over the mean" by [scene, side, lobe] {
        scene: String = "scene",
        side: u64 = "texels a side",
        lobe: String = "lobe",
        error: f64 = "RMS error over the mean",
    }
}

rows! {
    /// Mirrors in a scene.
    struct Fall = "Fall of the mirror's error with texels" by [scene] {
        scene: String = "scene",
        exponent: f64 = "power of texels along a side by which it grows",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    frames: Vec<Row>,
    look_ups: Vec<LookUp>,
}

const OF_LOOK_UPS: &[Criterion<LookUp>] = &[Criterion::each(
    "irradiance is within a hundredth",
    Bound::AtMost(0.01),
    |row: &LookUp| row.error.into(),
)
.among(|row| row.lobe == IRRADIANCE)];
const OF_FALLS: &[Criterion<Fall>] = &[Criterion::each(
    "the mirror's error falls with texels along a side: its exponent",
    Bound::AtMost(-0.4),
    |row: &Fall| row.exponent.into(),
)
.because("sharp edges fall as −½, and a tenth is left for texels that meet them by chance")];

impl Found {
    /// Adds a scene's maps, whose sizes take turns.
    fn add(&mut self, context: &Context<'_>, scene: &str, stage: &Stage<'_>) -> Result<()> {
        let reference = Reference::new(stage, context.pick((REFERENCE, SUMMED), (512, 64)))?;
        let sides = context.first(&SIDES, 2);
        let maps: Vec<LiveProbe> = sides
            .iter()
            .map(|side| {
                stage.live(LightProbeDesc {
                    map: ProbeMap::Octahedron,
                    side: *side,
                    finest: FINEST,
                })
            })
            .collect::<Result<_>>()?;
        let turns = context.in_turns(TURNS, maps.len(), |map| stage.milliseconds(&maps[map]))?;
        for ((side, live), turns) in sides.iter().zip(&maps).zip(&turns) {
            let side = u64::from(*side);
            let look_up = |(lobe, error): (&str, f64)| LookUp {
                scene: scene.into(),
                side,
                lobe: lobe.into(),
                error,
            };
            self.look_ups.extend(reference.errors(live)?.into_iter().map(look_up));
            let [draw, shade, levels, copy, filter, all] = Repeats::by_part(turns);
            self.frames.push(Row {
                scene: scene.into(),
                side,
                draw,
                shade,
                levels,
                copy,
                filter,
                all,
                size: live.bytes() as f64 / f64::from(1 << 20),
            });
        }
        Ok(())
    }

    fn mirrors(&self) -> Vec<LookUp> {
        let mirrors = self.look_ups.iter().filter(|row| row.lobe == MIRROR);
        mirrors.cloned().collect()
    }
}

/// How the mirror's error falls, by sizes of which the reference is far finer; not a number of fewer than two of these.
fn falls(mirrors: &[LookUp]) -> Vec<Fall> {
    let of_a_scene = mirrors.chunk_by(|a, b| a.scene == b.scene);
    let fall = |rows: &[LookUp]| {
        let points: Vec<(f64, f64)> = rows
            .iter()
            .filter(|row| FINER * row.side <= u64::from(REFERENCE))
            .map(|row| ((row.side as f64).ln(), row.error.ln()))
            .collect();
        Some(Fall {
            scene: rows.first()?.scene.clone(),
            exponent: least_squares(&points).unwrap_or(f64::NAN),
        })
    };
    of_a_scene.filter_map(fall).collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let own = context
            .first(&SCENES, 1)
            .iter()
            .map(|(address, share)| ((*address).to_owned(), *share));
        let told = context.scenes.iter().map(|address| (address.clone(), Vec3::splat(0.5)));
        let scenes: Vec<(String, Vec3)> = if context.scenes.is_empty() {
            own.collect()
        } else {
            told.collect()
        };
        let mut found = Self::default();
        context.each(
            &scenes,
            |(address, _)| short_name(address).to_owned(),
            |(address, share)| {
                found.add(context, short_name(address), &Stage::new(&gpu, address, *share)?)?;
                Ok(Vec::<()>::new())
            },
        )?;
        Ok(found)
    }

    fn findings(&self) -> Findings {
        let mirrors = self.mirrors();
        Findings::pivoted(&self.look_ups, "lobe", OF_LOOK_UPS)
            .headline(
                "GPU time of a map of 256² in the slowest scene (ms)",
                largest(&self.frames, |row| row.side == TYPICAL, |row| row.all.measured().value),
            )
            .curves(
                "mirrors",
                "Mirrors by live maps",
                Axes::falling("texels a side", "RMS error over the mean"),
                curves(&mirrors, |row| row.scene.clone(), |row| (row.side as f64, row.error.into())),
            )
            .note(format!(
                "Over {DIRECTIONS} directions: look-ups filtered by lobes of width α (irradiance is α = 1; 0.2 lies between two levels, and from 0.06 \
                 down between the finest filtered one and mirrors) against the sum of the lobe over a map of {REFERENCE}² texels, by means of {SUMMED}² \
                 in f64, whose texels are 0.014 wide: errors of lobes about as narrow hold the blur of those means. Unfiltered look-ups, over {MIRRORS} \
                 directions, stand against that map itself, where edges of surfaces lie between texels. The divider room's panel is no light of \
                 the preview: its map is dark but for that, the hardest light for lobes. Maps of {FINEST}² have no level between α = 0.35 and mirrors."
            ))
            .and(Findings::of(&falls(&mirrors), OF_FALLS))
            .note(format!("Over sizes of which the reference is at least {FINER} times as fine along a side."))
            .and(Findings::of(&self.frames, &[]))
            .note(
                "One map per frame at a place in each scene, an octahedron of that many texels a side, lit by the scene's lights through octahedron \
                 shadow maps of 1024². Times are of the device's timestamps; sizes take turns.",
            )
    }
}
