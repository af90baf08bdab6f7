//! What queues of queries cost and gain: milliseconds of a gather with the stages of its queue, by themselves and by packets.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.4 and Table 7.5, of rays through
//! photons in media, on a GPU of its time; points on surfaces are queued here.

use clerestory::gpu::Gpu;
use clerestory::techniques::photon_mapping::{MapQuery, MapQueue, PhotonMapper, PhotonSettings};
use clerestory::{Result, scene};

use super::cases::{mapper, settings};
use super::frames::milliseconds;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;

const SIZE: [u32; 2] = [128, 96];
const SMOKE_SIZE: [u32; 2] = [16, 12];
/// Frames of each form that count, after one that compiles kernels.
const TURNS: u32 = 7;
/// How passes of queries and their queues are called.
const GATHER_PASSES: &str = "photon: gather";
/// And their queues alone.
const QUEUE_PASSES: &str = "photon: gather queue";

/// What is seen of a scene, its address, photons, and the spread of their kernels.
const SCENES: [(&str, &str, u32, f32); 4] = [
    ("closed rooms", "builtin:passage", 1 << 17, 15.0),
    ("a metal ring on a floor", "builtin:ring", 1 << 17, 10.0),
    ("trees under the open sky", "builtin:forest?source=point", 1 << 17, 25.0),
    ("mirrors and glass", "builtin:materials", 1 << 17, 20.0),
];

const SLOTS: &str = "I, slots";
const COMPACTED: &str = "II, compacted";
const BLOCKS: &str = "III, blocks";

/// A queue with a query, and what they are called.
struct Form {
    queue: MapQueue,
    query: MapQuery,
    name: &'static str,
    /// The form with the same queue without packets.
    single: usize,
    /// The source's mean over nine scenes in media, % over type I without packets; the fourth as computed from its rows, which its own mean is not.
    published: f64,
}

const fn form(queue: MapQueue, query: MapQuery, name: &'static str, single: usize, published: f64) -> Form {
    Form {
        queue,
        query,
        name,
        single,
        published,
    }
}

const FORMS: [Form; 6] = [
    form(MapQueue::Slots, MapQuery::Single, SLOTS, 0, 0.0),
    form(MapQueue::Compacted, MapQuery::Single, COMPACTED, 1, 2.1),
    form(MapQueue::Blocks, MapQuery::Single, BLOCKS, 2, 27.2),
    form(MapQueue::Slots, MapQuery::Packet, "packets, I", 0, -71.9),
    form(MapQueue::Compacted, MapQuery::Packet, "packets, II", 1, -69.3),
    form(MapQueue::Blocks, MapQuery::Packet, "packets, III", 2, -66.8),
];

rows! {
    /// A scene.
    struct Seen = "Scenes and their queries" by [scene] {
        scene: String = "scene",
        seen: String = "seen",
        rays: f64 = "eye's rays per frame",
        ask: f64 = "of them ask (%)",
        contributions: f64 = "k, contributions per query",
        different: u64 = "forms with other counts than the first",
        subgroup: u64 = "lanes of a subgroup",
    }
}

rows! {
    /// A form on a scene.
    struct Row = "GPU milliseconds of queries with their queues" by [scene, form] {
        scene: String = "scene",
        form: String = "form",
        gather: Repeats = "queries with their queue (ms)",
        queue: Repeats = "the queue's stages alone (ms)",
        over_first: Repeats = "over type I by itself (%)",
        over_single: Option<Repeats> = "packets over the same queue by itself (%)",
    }
    beside "source: over type I by itself, rays through media (%)" = |row| {
        FORMS.iter().find(|form| form.name == row.form).map(|form| form.published).into()
    };
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    scenes: Vec<Seen>,
    times: Vec<Row>,
}

const OF_SCENES: &[Criterion<Seen>] = &[Criterion::each(
    "counts of queries and contributions are equal in all forms: forms with others",
    Bound::AtMost(0.0),
    |row: &Seen| row.different.into(),
)
.in_every_form()];
const LITTLE_MORE: Bound = Bound::AtMost(5.0);
const LITTLE: &str = "the aim: little is a few per cent; the source's means are 2.1 compacted and 27.2 in blocks";
const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "packets take no more time than queries by themselves in any scene and queue (%)",
        Bound::AtMost(0.0),
        |row: &Row| row.over_single.as_ref().map_or(f64::NAN.into(), Repeats::measured),
    )
    .among(|row| row.over_single.is_some()),
    Criterion::each(
        "a compacted queue costs little more than it gains (%)",
        LITTLE_MORE,
        |row: &Row| (&row.over_first).into(),
    )
    .among(|row| row.form == COMPACTED)
    .because(LITTLE),
    Criterion::each(
        "a queue in blocks costs little more than it gains (%)",
        LITTLE_MORE,
        |row: &Row| (&row.over_first).into(),
    )
    .among(|row| row.form == BLOCKS)
    .because(LITTLE),
];

/// GPU milliseconds of a frame's queries with their queues, and of the queues alone.
fn frame(mapper: &mut PhotonMapper, samples: u32) -> Result<[f64; 2]> {
    let mut sums = [0.0; 2];
    while let Some(step) = mapper.step(samples)? {
        for pass in step.timings.iter().flat_map(|timings| &timings.passes) {
            for (sum, name) in sums.iter_mut().zip([GATHER_PASSES, QUEUE_PASSES]) {
                if pass.name.starts_with(name) {
                    *sum += milliseconds(pass);
                }
            }
        }
    }
    Ok(sums)
}

/// All forms on one scene, with their frames taken in turns: samples of one pass, so that all have the same map.
fn scene_of_forms(
    context: &Context<'_>,
    gpu: &Gpu,
    (seen, address, photons, spread): (&str, &str, u32, f32),
) -> Result<(Seen, Vec<Row>)> {
    let scene = scene::load(address)?;
    let settings = settings(photons, spread, context.smoke)?;
    let with = |form: &Form| {
        let settings = PhotonSettings {
            queue: form.queue,
            query: form.query,
            samples_per_pass: TURNS + 1,
            ..settings.clone()
        };
        mapper(gpu, &scene, context.pick(SIZE, SMOKE_SIZE), settings)
    };
    let mut mappers: Vec<PhotonMapper> = FORMS.iter().map(with).collect::<Result<_>>()?;
    let mut frames = [0; FORMS.len()];
    let turns = context.in_turns(TURNS as usize, mappers.len(), |i| {
        frames[i] += 1;
        frame(&mut mappers[i], frames[i])
    })?;
    let (rays, counts) = (mappers[0].eye_counters().extend_rays as f64, mappers[0].counts().gather);
    let differs = |mapper: &&PhotonMapper| mapper.counts().gather != counts;
    let queries = counts.queries as f64;
    let name = short_name(address);
    let row = Seen {
        scene: name.into(),
        seen: seen.into(),
        rays: rays / f64::from(frames[0]),
        ask: 1e2 * queries / rays,
        contributions: counts.photons as f64 / queries.max(1.0),
        different: mappers.iter().filter(differs).count() as u64,
        subgroup: gpu.caps().subgroup_size.into(),
    };
    let parts: Vec<[Repeats; 2]> = turns.iter().map(|turns| Repeats::by_part(turns)).collect();
    let times = FORMS.iter().zip(&parts).map(|(form, [gather, queue])| Row {
        scene: name.into(),
        form: form.name.into(),
        gather: gather.clone(),
        queue: queue.clone(),
        over_first: gather.change_from(&parts[0][0]),
        over_single: (form.query == MapQuery::Packet).then(|| gather.change_from(&parts[form.single][0])),
    });
    Ok((row, times.collect()))
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let mut times = Vec::new();
        let name = |scene: &(&str, &str, u32, f32)| short_name(scene.1).to_owned();
        let scenes = context.each(context.first(&SCENES, 1), name, |scene| {
            let (row, of_forms) = scene_of_forms(context, &gpu, *scene)?;
            times.extend(of_forms);
            Ok(vec![row])
        })?;
        Ok(Self { scenes, times })
    }

    fn findings(&self) -> Findings {
        let changes = self.times.iter().filter_map(|row| row.over_single.as_ref());
        let ratio = |changes: &Repeats| {
            let Measured { value, low, high } = changes.measured();
            let [value, low, high] = [value, low, high].map(|change| 1.0 + change / 1e2);
            Measured { value, low, high }
        };
        Findings::of(&self.times, CRITERIA)
            .headline(
                "time of queries by packets over that of queries by themselves, geometric mean over scenes and queues",
                geometric_mean(changes.map(ratio)),
            )
            .bars(
                "times",
                "GPU milliseconds of queries with their queues",
                &self.times,
                |row| [row.scene.clone(), row.form.clone()],
                |row| row.gather.measured(),
            )
            .note(format!(
                "{} × {} pixels, a sample each; frames of the same map, one of each form in turn. Types II and III look at the surface once \
                 more to see who asks, which in the source the kernels do that trace rays.",
                SIZE[0], SIZE[1],
            ))
            .note(
                "Source: milliseconds of density estimation by rays through photons in media, 512 × 512 pixels, means of nine scenes, on a GPU \
                 of 2008; its printed mean for packets with type I is −74.7, its rows give −71.9.",
            )
            .and(Findings::of(&self.scenes, OF_SCENES))
    }
}
