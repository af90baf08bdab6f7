//! Reflection maps drawn each frame: what octahedra and latitude–longitude maps of as many texels cost by their parts, in bytes and in look-ups, and how
//! wrong mirrors and boxes of their tables are, everywhere and near the poles.
//!
//! Source: T. Engelhardt, PhD thesis, KIT, 2013, §7.3.2 and §7.3.3. Oracle: a far finer map, and its means over caps.

use clerestory::Result;
use clerestory::techniques::preview::ReflectionMap;
use glam::Vec3;

use super::live_stages::{REFERENCE, Stage};
use super::reflection_stages::{FORMS, FineMap, LOOK_UPS, NEAR_POLES, form, milliseconds, nanoseconds};
use crate::experiments::findings::{
    Axes, Bound, Criterion, Findings, Measured, Repeats, Study, curves, geometric_mean, rows,
};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;

/// Scenes, and the map's place as a share of the box around each.
const SCENES: [(&str, Vec3); 3] = [
    ("builtin:box-room?source=point", Vec3::new(0.45, 0.4, 0.55)),
    ("builtin:conference?source=point", Vec3::new(0.4, 0.5, 0.45)),
    ("builtin:cathedral?source=point", Vec3::new(0.5, 0.25, 0.55)),
];
const SIDES: [u32; 3] = [64, 128, 256];
const TURNS: usize = 5;
/// Means of the fine map that caps are summed over, texels along a side.
const SUMMED: u32 = 512;
/// Look-ups that are timed together.
const TIMED: u32 = 1 << 18;

rows! {
    /// Frames of a map.
    struct Frame = "Frames of reflection maps" by [scene, form, side] {
        scene: String = "scene",
        form: String = "form",
        side: u64 = "side of an octahedron of as many texels",
        made: Repeats = "draw and shade (ms)",
        convert: Repeats = "latitude and longitude (ms)",
        filled: Repeats = "border (ms)",
        table: Repeats = "table (ms)",
        all: Repeats = "all parts (ms)",
        border: u64 = "border (texels)",
        sums: f64 = "table (MiB)",
        size: f64 = "all (MiB)",
    }
}

rows! {
    /// Look-ups of one kind in a map.
    struct LookUp = "Look-ups in reflection maps" by [scene, form, side, look_up] {
        scene: String = "scene",
        form: String = "form",
        side: u64 = "side of an octahedron of as many texels",
        look_up: String = "look-up",
        time: Repeats = "time (ns)",
        everywhere: f64 = "RMS error over the mean",
        near_poles: f64 = "the same near the poles",
    }
}

rows! {
    /// A latitude–longitude map over the octahedron of as many texels.
    struct Ratio = "Latitude–longitude maps over octahedra of as many texels" by [scene, form, side, look_up] {
        scene: String = "scene",
        form: String = "form",
        side: u64 = "side of an octahedron of as many texels",
        look_up: String = "look-up",
        time: Repeats = "time",
        everywhere: f64 = "RMS error",
        near_poles: f64 = "RMS error near the poles",
        sums: f64 = "bytes of the table",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    frames: Vec<Frame>,
    look_ups: Vec<LookUp>,
}

const OF_FRAMES: &[Criterion<Frame>] = &[Criterion::each(
    "a frame spends most of its time on drawing the map: the share of drawing and shading",
    Bound::AtLeast(0.5),
    |row: &Frame| (&row.made.over(&row.all)).into(),
)
.among(|row| row.form == FORMS[0])
.because("more than all other parts together")];
const OF_RATIOS: &[Criterion<Ratio>] = &[
    Criterion::each(
        "boxes near the poles: the error of latitude–longitude maps over that of octahedra",
        Bound::AtLeast(2.0),
        |row: &Ratio| row.near_poles.into(),
    )
    .among(|row| is_fine(row) && row.look_up != LOOK_UPS[0]),
    Criterion::all(
        "mirrors: the error of latitude–longitude maps over that of octahedra, geometric mean",
        Bound::AtLeast(1.0),
        |rows: &[&Ratio]| geometric_mean(rows.iter().map(|row| row.everywhere.into())),
    )
    .among(|row| is_fine(row) && row.look_up == LOOK_UPS[0]),
    Criterion::each(
        "look-ups take longer in latitude–longitude maps",
        Bound::AtLeast(1.0),
        |row: &Ratio| (&row.time).into(),
    )
    .among(|row| is_fine(row) && row.look_up == LOOK_UPS[0])
    .because("arc tangents"),
    Criterion::each(
        "tables of latitude–longitude maps take more bytes, for the borders that their boxes need at poles",
        Bound::AtLeast(1.0),
        |row: &Ratio| row.sums.into(),
    )
    .among(is_fine)
    .in_every_form(),
];

/// Whether a map was made of an octahedron fine enough to add no blur of its own.
fn is_fine(row: &Ratio) -> bool {
    row.form == FORMS[2]
}

impl Found {
    /// Adds a scene's maps of one size, whose forms take turns.
    fn add(&mut self, context: &Context<'_>, scene: &str, stage: &Stage<'_>, fine: &FineMap, side: u32) -> Result<()> {
        let maps: Vec<ReflectionMap> = (0..FORMS.len())
            .map(|number| stage.reflection(form(number, side)?))
            .collect::<Result<_>>()?;
        let turns = context.in_turns(TURNS, maps.len(), |map| milliseconds(stage, &maps[map]))?;
        let contenders = maps.len() * LOOK_UPS.len();
        let timed = context.pick(TIMED, 1 << 10);
        let times = context.in_turns(TURNS, contenders, |at| {
            nanoseconds(stage.gpu(), &maps[at / LOOK_UPS.len()], at % LOOK_UPS.len(), timed)
        })?;
        let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        for (number, map) in maps.iter().enumerate() {
            let (form, side) = (FORMS[number].to_owned(), u64::from(side));
            let [made, convert, filled, table, all] = Repeats::by_part(&turns[number]);
            self.frames.push(Frame {
                scene: scene.into(),
                form: form.clone(),
                side,
                made,
                convert,
                filled,
                table,
                all,
                border: map.desc().border.into(),
                sums: mebibytes(map.table().bytes()),
                size: mebibytes(map.bytes()),
            });
            for (look_up, [everywhere, near_poles]) in fine.errors(map)?.into_iter().enumerate() {
                self.look_ups.push(LookUp {
                    scene: scene.into(),
                    form: form.clone(),
                    side,
                    look_up: LOOK_UPS[look_up].into(),
                    time: Repeats(times[number * LOOK_UPS.len() + look_up].clone()),
                    everywhere,
                    near_poles,
                });
            }
        }
        Ok(())
    }

    /// Latitude–longitude maps over the octahedra of their scene and size.
    fn ratios(&self) -> Vec<Ratio> {
        let bytes = |row: &LookUp| {
            let mut frames = self.frames.iter();
            frames
                .find(|frame| frame.scene == row.scene && frame.side == row.side && frame.form == row.form)
                .map_or(f64::NAN, |frame| frame.sums)
        };
        let ratio = |row: &LookUp| {
            let is_beside = |other: &&LookUp| {
                other.form == FORMS[0]
                    && other.scene == row.scene
                    && other.side == row.side
                    && other.look_up == row.look_up
            };
            let octahedron = self.look_ups.iter().find(is_beside)?;
            Some(Ratio {
                scene: row.scene.clone(),
                form: row.form.clone(),
                side: row.side,
                look_up: row.look_up.clone(),
                time: row.time.over(&octahedron.time),
                everywhere: row.everywhere / octahedron.everywhere,
                near_poles: row.near_poles / octahedron.near_poles,
                sums: bytes(row) / bytes(octahedron),
            })
        };
        let others = self.look_ups.iter().filter(|row| row.form != FORMS[0]);
        others.filter_map(ratio).collect()
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let mut found = Self::default();
        context.each(
            context.first(&SCENES, 1),
            |(address, _)| short_name(address).to_owned(),
            |(address, share)| {
                let stage = Stage::new(&gpu, address, *share)?;
                let fine = FineMap::new(&stage, context.pick((REFERENCE, SUMMED), (256, 128)))?;
                for side in context.first(&SIDES, 1) {
                    found.add(context, short_name(address), &stage, &fine, *side)?;
                }
                Ok(Vec::<()>::new())
            },
        )?;
        Ok(found)
    }

    fn findings(&self) -> Findings {
        let ratios = self.ratios();
        let boxes = ratios.iter().filter(|row| is_fine(row) && row.look_up != LOOK_UPS[0]);
        let mirrors: Vec<(&LookUp, Measured)> = self
            .look_ups
            .iter()
            .filter(|row| row.look_up == LOOK_UPS[0])
            .filter_map(|row| {
                let is_of =
                    |frame: &&Frame| frame.scene == row.scene && frame.side == row.side && frame.form == row.form;
                Some((row, self.frames.iter().find(is_of)?.all.measured()))
            })
            .collect();
        Findings::of(&ratios, OF_RATIOS)
            .headline(
                "RMS error of boxes near the poles of latitude–longitude maps over that of octahedra (geometric mean)",
                geometric_mean(boxes.map(|row| row.near_poles.into())),
            )
            .curves(
                "cost",
                "Error of mirrors against the time of a frame",
                Axes::rates("all parts of a frame (ms)", "RMS error over the mean"),
                curves(
                    &mirrors,
                    |(row, _)| format!("{}, {}", row.scene, row.form),
                    |(row, time)| (time.value, row.everywhere.into()),
                ),
            )
            .note("Octahedra are 1 in every column. Times are of the same turn.")
            .and(Findings::of(&self.frames, OF_FRAMES))
            .note(
                "Times are of the device's timestamps; forms take turns. Borders hold the largest box wherever it lies. Latitude–longitude maps are made \
                 of octahedra of as many texels, or of four times as many, by four look-ups for each texel.",
            )
            .and(Findings::of(&self.look_ups, &[]).long())
            .note(format!(
                "Over uniform directions, and over those within {NEAR_POLES}° of the z axis, against look-ups in an octahedron of {REFERENCE}² texels and its \
                 means over caps, of {SUMMED}². {TIMED} look-ups in random directions are timed together."
            ))
    }
}
