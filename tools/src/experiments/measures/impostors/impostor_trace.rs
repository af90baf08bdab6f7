//! Frames of a game in which a mirror moves, and the map that it shows is drawn at some frames alone: what that takes when it is spread over all, and
//! what is wrong with pictures by maps that are old.
//!
//! Source of the comparison: L. Szirmay-Kalos, B. Aszódi, I. Lazányi, M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3) (Eurographics), 2005, whose game draws a
//! map each 150 ms. Oracles: pictures by a map of each frame, and the path tracer's of the same light paths.

use clerestory::Result;

use super::moving_mirror::{Deviation, Game, Quality, STEPS};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Repeats, Study, curves, largest, rows};
use crate::experiments::measures::Context;
use crate::timing::median;

/// Frames from one map to the next.
const PERIODS: [u32; 5] = [1, 2, 5, 10, 30];
const SMOKE_PERIODS: [u32; 2] = [1, JUDGED];
/// 150 ms at 66 frames a second.
const JUDGED: u32 = 10;
/// Frames whose pictures are compared with the path tracer's: the last ones before a map is drawn.
const TRACED: [u32; 3] = [9, 29, 59];
const TURNS: usize = 5;
/// The map is an octahedron whose side, a power of two, is nearest to the root of six times 256².
const FULL: Quality = Quality {
    frames: 60,
    size: 192,
    samples: 2,
    map: 512,
    shadows: 512,
    spp: 256,
};
const SMOKE: Quality = Quality {
    frames: 12,
    size: 16,
    samples: 1,
    map: 64,
    shadows: 64,
    spp: 16,
};

rows! {
    /// Frames with a map now and then.
    struct Trace = "Times of frames by how often the map is drawn" by [period] {
        period: u64 = "frames from one map to the next",
        median: Repeats = "median frame (ms)",
        longest: Repeats = "longest frame (ms)",
        map: Repeats = "drawing maps, spread over frames (ms)",
        rest: Repeats = "all else of a frame, mean (ms)",
        of_every: Repeats = "drawing maps, over that at each frame",
    }
}
rows! {
    /// Pictures by maps that are old.
    struct Stale = "Pictures of a moving mirror by how often the map is drawn" by [period, way] {
        period: u64 = "frames from one map to the next",
        way: String = "look-up",
        mean: f64 = "RMS beside a fresh map, over the mean",
        most: f64 = "the same of the worst frame",
        jump: f64 = "largest change of that difference from frame to frame",
        rays: f64 = "RMS beside rays, over the mean",
        of_classical: Option<f64> = "RMS beside a fresh map, over the classical look-up's",
        jump_of_classical: Option<f64> = "largest change, over the classical look-up's",
        rays_of_classical: Option<f64> = "RMS beside rays, over the classical look-up's",
    }
}
rows! {
    /// A frame.
    struct Moment = "Milliseconds of frames" by [period, frame] {
        period: u64 = "frames from one map to the next",
        frame: u64 = "frame",
        time: f64 = "time (ms)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    traces: Vec<Trace>,
    pictures: Vec<Stale>,
    moments: Vec<Moment>,
}

const CLASSICAL: &str = "in the ray's own direction";
const SEARCHED: &str = "searched, hybrid +3";

const OF_TRACES: &[Criterion<Trace>] = &[Criterion::each(
    "a map every tenth frame takes a tenth of one every frame: time of drawing maps over that",
    Bound::AtMost(0.15),
    |row: &Trace| (&row.of_every).into(),
)
.among(|row| row.period == u64::from(JUDGED))
.because("a tenth, and half of that for frames that differ; a map every 150 ms was published to cost next to nothing")];
const OF_PICTURES: &[Criterion<Stale>] = &[
    Criterion::each(
        "pictures searched in old maps are nearer to those by fresh ones than classical look-ups are: RMS over theirs",
        Bound::AtMost(1.0),
        |row: &Stale| row.of_classical.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.way == SEARCHED && row.period > 1),
    Criterion::each(
        "pictures searched in old maps change less when a map is drawn than classical look-ups do: largest change over theirs",
        Bound::AtMost(1.0),
        |row: &Stale| row.jump_of_classical.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.way == SEARCHED && row.period > 1)
    .because("none was published to be seen"),
    Criterion::each(
        "pictures searched in maps of any age are nearer to rays than classical look-ups are: RMS over theirs",
        Bound::AtMost(1.0),
        |row: &Stale| row.rays_of_classical.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.way == SEARCHED),
];

/// Pictures of all frames by classical look-ups and by searches, in maps of all ages.
fn pictures(context: &Context<'_>, game: &mut Game<'_>, frames: u32, periods: &[u32]) -> Result<Vec<Stale>> {
    let masks: Vec<Vec<bool>> = (0..frames).map(|number| game.mask(number)).collect();
    let fresh: Vec<Vec<f32>> = (0..frames)
        .map(|number| game.picture(number, 1, true))
        .collect::<Result<_>>()?;
    let numbers = TRACED.into_iter().filter(|number| *number < frames);
    let traced: Vec<(u32, Vec<f32>)> = numbers
        .map(|number| Ok((number, game.traced(number)?)))
        .collect::<Result<_>>()?;
    let mut classical: Vec<Stale> = Vec::new();
    let cases: Vec<(bool, u32)> = [false, true]
        .into_iter()
        .flat_map(|searches| periods.iter().map(move |period| (searches, *period)))
        .collect();
    context.each(
        &cases,
        |(searches, period)| {
            format!(
                "a map every {period} frames, {}",
                if *searches { SEARCHED } else { CLASSICAL }
            )
        },
        |(searches, period)| {
            let (mut sum, mut most, mut jump, mut rays) = (0.0, 0.0_f64, 0.0_f64, 0.0);
            let mut before: Option<Deviation> = None;
            for number in 0..frames {
                let found = game.picture(number, *period, *searches)?;
                let mask = &masks[number as usize];
                let deviation = Deviation::of(&found, &fresh[number as usize], mask);
                sum += deviation.size();
                most = most.max(deviation.size());
                jump = before.map_or(jump, |before| jump.max(deviation.since(&before)));
                before = Some(deviation);
                if let Some((_, truth)) = traced.iter().find(|(of, _)| *of == number) {
                    rays += Deviation::of(&found, truth, mask).size();
                }
            }
            let mut row = Stale {
                period: (*period).into(),
                way: if *searches { SEARCHED } else { CLASSICAL }.into(),
                mean: sum / f64::from(frames),
                most,
                jump,
                rays: rays / traced.len().max(1) as f64,
                of_classical: None,
                jump_of_classical: None,
                rays_of_classical: None,
            };
            if *searches {
                if let Some(other) = classical.iter().find(|other| other.period == row.period) {
                    row.of_classical = Some(row.mean / other.mean);
                    row.jump_of_classical = Some(row.jump / other.jump);
                    row.rays_of_classical = Some(row.rays / other.rays);
                }
            } else {
                classical.push(row.clone());
            }
            Ok(vec![row])
        },
    )
}

/// The row of a period, from its turns and from those of a map at each frame.
fn trace(period: u32, turns: &[Vec<[f64; 2]>], map_at_each: &Repeats) -> Trace {
    let of = |number: fn(&[[f64; 2]]) -> f64| -> Repeats { turns.iter().map(|turn| number(turn)).collect() };
    let map = of(mean_of_maps);
    Trace {
        period: period.into(),
        median: of(|frames| median(frames.iter().map(|[map, rest]| map + rest).collect())),
        longest: of(|frames| frames.iter().map(|[map, rest]| map + rest).fold(0.0, f64::max)),
        rest: of(|frames| frames.iter().map(|[_, rest]| rest).sum::<f64>() / frames.len().max(1) as f64),
        of_every: map.over(map_at_each),
        map,
    }
}

/// Milliseconds of maps, spread over all frames.
fn mean_of_maps(frames: &[[f64; 2]]) -> f64 {
    frames.iter().map(|[map, _]| map).sum::<f64>() / frames.len().max(1) as f64
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let periods = context.pick(&PERIODS[..], &SMOKE_PERIODS[..]);
        let quality = context.pick(FULL, SMOKE);
        let mut game = Game::new(&gpu, quality)?;
        let turns = context.in_turns(TURNS, periods.len(), |i| game.trace(periods[i]))?;
        let at_each = turns.first().map(Vec::as_slice).unwrap_or_default();
        let map_at_each: Repeats = at_each.iter().map(|frames| mean_of_maps(frames)).collect();
        let traces = periods.iter().zip(&turns);
        let traces: Vec<Trace> = traces
            .map(|(period, turns)| trace(*period, turns, &map_at_each))
            .collect();
        let mut moments = Vec::new();
        for (period, turns) in periods.iter().zip(&turns) {
            let is_shown = [1, JUDGED].contains(period);
            for (frame, [map, rest]) in (0u64..).zip(turns.last().into_iter().flatten().filter(|_| is_shown)) {
                moments.push(Moment {
                    period: (*period).into(),
                    frame,
                    time: map + rest,
                });
            }
        }
        Ok(Self {
            traces,
            pictures: pictures(context, &mut game, quality.frames, periods)?,
            moments,
        })
    }

    fn findings(&self) -> Findings {
        let judged = self.traces.iter().find(|row| row.period == u64::from(JUDGED));
        let most = largest(&self.moments, |_| true, |row| row.time).map_or(1.0, |most| most.value);
        Findings::of(&self.traces, OF_TRACES)
            .headline(
                "drawing a map at each tenth frame, spread over frames, over drawing it at each",
                judged.map(|row| row.of_every.measured()),
            )
            .curves(
                "trace",
                "Milliseconds of frames",
                Axes::even("frame", "time (ms)", 1.05 * most, (6, 10.0)),
                curves(
                    &self.moments,
                    |row| format!("a map every {} frames", row.period),
                    |row| (row.frame as f64, row.time.into()),
                ),
            )
            .note(format!(
                "{} frames of {2}² pixels with {3}² samples each, times of the device; a map is an octahedron of {1}², two thirds of the texels of six times 256². Shadow maps of three lamps are drawn \
                 anew at each frame, and the map in a submission of its own where it is due.",
                FULL.frames, FULL.map, FULL.size, FULL.samples,
            ))
            .and(Findings::of(&self.pictures, OF_PICTURES))
            .note(format!(
                "Of the sphere's pixels but its rim. A fresh map is one of each frame, searched by the hybrid of {STEPS} steps; rays are the path tracer's pictures of {} samples per pixel at frames {TRACED:?}, the last \
                 before a map is drawn. The sphere goes 1.2 to 1.8 cm a frame, its radius is 50 cm.",
                FULL.spp,
            ))
            .and(Findings::of(&self.moments, &[]).long())
    }
}
