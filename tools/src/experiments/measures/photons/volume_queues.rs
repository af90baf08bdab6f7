//! What queues and packets cost and gain where rays ask the volume map: time of density estimation, nodes fetched, and the stages of a frame with their jobs, by a kernel each and fused.
//!
//! Source of the comparison: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.4, Tables 7.4 and 7.5, of 512 × 512 pixels on a
//! GPU of its time; scenes and media are those of `scenarios`.

use clerestory::gpu::Gpu;
use clerestory::gpu::shaders::constants::BEAM_BOUNCES;
use clerestory::techniques::photon_mapping::{MapQuery, MapQueue, MapStages, PhotonMapper, PhotonSettings};
use clerestory::{Result, scene};

use super::cases::mapper;
use super::scenarios::{Depths, SCENARIOS, Scenario, TWO_BOUNCES};
use super::volume_queue_stages::{
    ESTIMATION, FUSED, Frame, Fusion, OF_FUSIONS, RAYS, SCATTERING, SHADOWS, STAGES, SURFACES, fusions, repeats,
};
use crate::experiments::findings::{
    Bound, Criterion, Findings, Measured, Repeats, Study, change, geometric_mean, rows,
};
use crate::experiments::measures::Context;

const SIZE: [u32; 2] = [64, 48];
const SMOKE_SIZE: [u32; 2] = [16, 12];
/// The source's photons over ours.
const SHARE: u32 = 16;
const SMOKE_SHARE: u32 = 256;
/// Frames of each form that count, after one that compiles kernels.
const TURNS: u32 = 7;
/// Loop iterations of a submission: more than a frame's, so that all rays of a subgroup begin together.
const SUBMISSION_WORK: u64 = 1 << 30;

const SLOTS: &str = "I, slots";
const COMPACTED: &str = "II, compacted";
const BLOCKS: &str = "III, blocks";
const PACKETS: &str = "packets, I";

/// A queue with a query, and what they are called.
struct Form {
    queue: MapQueue,
    query: MapQuery,
    name: &'static str,
    /// The form with the same queue without packets.
    single: usize,
}

const fn form(queue: MapQueue, query: MapQuery, name: &'static str, single: usize) -> Form {
    Form {
        queue,
        query,
        name,
        single,
    }
}

const FORMS: [Form; 6] = [
    form(MapQueue::Slots, MapQuery::Single, SLOTS, 0),
    form(MapQueue::Compacted, MapQuery::Single, COMPACTED, 1),
    form(MapQueue::Blocks, MapQuery::Single, BLOCKS, 2),
    form(MapQueue::Slots, MapQuery::Packet, PACKETS, 0),
    form(MapQueue::Compacted, MapQuery::Packet, "packets, II", 1),
    form(MapQueue::Blocks, MapQuery::Packet, "packets, III", 2),
];

/// The source's instructions of a ray (Table 7.4) and times (Table 7.5) over those of type I without packets, %, by scene in the order of the cases, and by form.
const PUBLISHED: [[[f64; 6]; 2]; 9] = [
    [
        [0.0, 8.6, 5.7, -62.7, -55.0, -60.0],
        [0.0, 3.1, 24.1, -74.7, -71.3, -67.4],
    ],
    [
        [0.0, 5.9, 4.0, -61.7, -55.1, -58.8],
        [0.0, 4.2, 23.0, -74.5, -68.7, -66.7],
    ],
    [
        [0.0, 4.9, 3.1, -61.7, -54.8, -59.0],
        [0.0, 4.1, 24.5, -72.8, -67.0, -64.7],
    ],
    [
        [0.0, 2.3, 1.3, -63.2, -60.4, -61.7],
        [0.0, 2.0, 34.7, -68.4, -65.8, -61.3],
    ],
    [
        [0.0, 2.3, 1.6, -63.6, -60.7, -62.4],
        [0.0, 1.9, 36.6, -68.6, -66.0, -61.8],
    ],
    [
        [0.0, 2.2, 0.9, -66.3, -63.8, -65.0],
        [0.0, 2.7, 38.2, -77.1, -75.5, -71.5],
    ],
    [
        [0.0, -0.3, 0.5, -64.1, -64.0, -63.8],
        [0.0, 0.5, 22.6, -70.9, -70.3, -69.9],
    ],
    [
        [0.0, 0.5, 0.3, -60.8, -60.5, -60.6],
        [0.0, 0.3, 19.6, -68.0, -67.5, -67.1],
    ],
    [
        [0.0, -0.4, 0.3, -64.3, -64.2, -64.1],
        [0.0, 0.3, 21.7, -71.9, -71.4, -71.1],
    ],
];
/// Places in its lines.
const INSTRUCTIONS: usize = 0;
const TIMES: usize = 1;

fn published(scene: &str, form: &str, what: usize) -> Option<f64> {
    let scene = SCENARIOS.iter().position(|scenario| scenario.name == scene)?;
    let form = FORMS.iter().position(|known| known.name == form)?;
    Some(PUBLISHED[scene][what][form])
}

rows! {
    /// A scene.
    struct Seen = "Scenes and their rays" by [scene] {
        scene: String = "scene",
        photons: u64 = "photons",
        events: u64 = "collisions that were stored",
        rays: f64 = "rays that ask per frame",
        contributions: f64 = "k, contributions per ray",
        different: u64 = "forms with other counts than the first",
        along_rays: Repeats = "million contributions/s along rays",
        on_surfaces: Repeats = "million contributions/s on surfaces",
        ratio: Repeats = "along rays over on surfaces",
        subgroup: u64 = "lanes of a subgroup",
    }
}

rows! {
    /// A form on a scene.
    struct Row = "Density estimation along rays" by [scene, form] {
        scene: String = "scene",
        form: String = "form",
        time: Repeats = "queries with their queue (ms)",
        collecting: Repeats = "ways and queue, part of it (ms)",
        over_first: Repeats = "over type I by itself (%)",
        over_compacted: Option<Repeats> = "type III over type II (%)",
        nodes: f64 = "nodes fetched per ray",
        records: f64 = "records fetched per ray",
        tests: f64 = "tests per ray",
        fewer_nodes: Option<f64> = "nodes by themselves over nodes by packets",
    }
    beside "source: over type I by itself (%)" = |row| published(&row.scene, &row.form, TIMES).into();
}

rows! {
    /// A form on a scene, over the first form.
    struct Change = "Rates against what is executed and what is moved, over type I by itself" by [scene, form] {
        scene: String = "scene",
        form: String = "form",
        rate: Repeats = "rays/s (%)",
        time: Repeats = "time (%)",
        tests: f64 = "tests per ray (%)",
        nodes: f64 = "nodes fetched (%)",
        bytes: f64 = "bytes fetched and handed on (%)",
    }
    beside "source: instructions per ray (%)" = |row| published(&row.scene, &row.form, INSTRUCTIONS).into();
}

rows! {
    /// A stage of a frame.
    struct Stage = "Stages of a frame, type I by itself" by [scene, stage] {
        scene: String = "scene",
        stage: String = "stage",
        jobs: Option<f64> = "jobs per frame",
        later_jobs: Option<f64> = "of them after the first ray of a path",
        second_jobs: Option<f64> = "of its second ray",
        third_jobs: Option<f64> = "of its third",
        further_jobs: Option<f64> = "of its fourth and later ones",
        first: Repeats = "first ray of a path (ms)",
        later: Repeats = "after it (ms)",
        share: Repeats = "share of the frame (%)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    scenes: Vec<Seen>,
    forms: Vec<Row>,
    changes: Vec<Change>,
    stages: Vec<Stage>,
    #[serde(default)]
    fusions: Vec<Fusion>,
}

const OF_SCENES: &[Criterion<Seen>] = &[
    Criterion::each(
        "counts of rays that ask and of contributions are equal in all forms: forms with others",
        Bound::AtMost(0.0),
        |row: &Seen| row.different.into(),
    )
    .in_every_form(),
    Criterion::each(
        "rays give at least half as many contributions a second as surfaces in the same frames: ratio",
        Bound::AtLeast(0.5),
        |row: &Seen| (&row.ratio).into(),
    ),
];
const OF_FORMS: &[Criterion<Row>] = &[
    Criterion::each(
        "packets fetch half the nodes at most: nodes of rays by themselves over theirs",
        Bound::AtLeast(2.0),
        |row: &Row| row.fewer_nodes.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.fewer_nodes.is_some()),
    Criterion::each(
        "a compacted queue takes as long as slots at least (%)",
        Bound::AtLeast(0.0),
        |row: &Row| (&row.over_first).into(),
    )
    .among(|row| row.form == COMPACTED),
    Criterion::each(
        "a queue in blocks takes longer than a compacted one (%)",
        Bound::AtLeast(0.0),
        |row: &Row| row.over_compacted.as_ref().map_or(f64::NAN.into(), Repeats::measured),
    )
    .among(|row| row.over_compacted.is_some()),
    Criterion::each(
        "packets of type I take 72 % less time than rays by themselves (%)",
        Bound::AtMost(-72.0),
        |row: &Row| (&row.over_first).into(),
    )
    .among(|row| row.form == PACKETS)
    .because("the source's mean over nine scenes, from its rows"),
];
const OF_CHANGES: &[Criterion<Change>] = &[Criterion::all(
    "time follows tests rather than bytes: how far its change is from that of tests, over how far from that of bytes",
    Bound::AtMost(1.0),
    |rows: &[&Change]| {
        let distance = |of: fn(&Change) -> f64| -> f64 {
            rows.iter().map(|row| (row.time.measured().value - of(row)).abs()).sum()
        };
        (!rows.is_empty()).then(|| (distance(|row| row.tests) / distance(|row| row.bytes)).into())
    },
)
.among(|row| row.form != SLOTS && row.form != BLOCKS)
.because("the source's claim leaves out its queue of type III")];

/// What a ray takes of the map, on average.
#[derive(Debug, Clone, Copy, Default)]
struct Taken {
    nodes: f64,
    records: f64,
    tests: f64,
    /// Fetched, and handed from the kernels that find rays' ways to their queries.
    bytes: f64,
}

/// Bytes of a node of the map, half a pair, and of a record without planes or collisions.
const NODE_BYTES: f64 = 16.0;
const RECORD_BYTES: f64 = 32.0;
/// Bytes of a way that a queue hands on, written and read, and of its place.
const WAY_BYTES: f64 = 2.0 * 32.0;
const PLACE_BYTES: f64 = 2.0 * 4.0;

impl Taken {
    /// By a mapper that counts.
    fn of(mapper: &PhotonMapper, form: &Form) -> Self {
        let (counts, rays) = (mapper.counts().ray_fetches, mapper.counts().beams.queries.max(1) as f64);
        let [nodes, records, tests] = [counts.nodes, counts.records, counts.tests].map(|count| count as f64 / rays);
        let handed_on = if form.queue == MapQueue::Slots {
            0.0
        } else {
            WAY_BYTES + PLACE_BYTES
        };
        Self {
            nodes,
            records,
            tests,
            bytes: NODE_BYTES * nodes + RECORD_BYTES * records + handed_on,
        }
    }
}

/// All forms on one scene, with their frames taken in turns: samples of one pass, so that all have the same map. What they take is counted beside, by other kernels.
fn scene_of_forms(context: &Context<'_>, gpu: &Gpu, scenario: &Scenario) -> Result<Found> {
    let scene = scene::load(scenario.scene)?;
    let size = context.pick(SIZE, SMOKE_SIZE);
    let settings = scenario.settings(TWO_BOUNCES, Depths::UpToOne, context.pick(SHARE, SMOKE_SHARE))?;
    let with = |form: &Form, stages: MapStages, count_fetches: bool| {
        let settings = PhotonSettings {
            queue: form.queue,
            query: form.query,
            stages,
            samples_per_pass: TURNS + 1,
            submission_work: SUBMISSION_WORK,
            count_fetches,
            ..settings.clone()
        };
        mapper(gpu, &scene, size, settings)
    };
    let mut taken = Vec::new();
    let mut by_bounce = [0; BEAM_BOUNCES as usize];
    for form in &FORMS {
        let mut counting = with(form, MapStages::Stream, true)?;
        Frame::of(&mut counting, 1)?;
        taken.push(Taken::of(&counting, form));
        by_bounce = counting.counts().ray_fetches.queries_by_bounce;
    }
    let mut mappers: Vec<PhotonMapper> = FORMS
        .iter()
        .map(|form| (form, MapStages::Stream))
        .chain([(&FORMS[0], MapStages::Fused)])
        .map(|(form, stages)| with(form, stages, false))
        .collect::<Result<_>>()?;
    let mut frames = vec![0; mappers.len()];
    let turns = context.in_turns(TURNS as usize, mappers.len(), |i| {
        frames[i] += 1;
        Frame::of(&mut mappers[i], frames[i])
    })?;
    let plain = &mappers[0];
    let (counts, eye, per_frame) = (plain.counts(), plain.eye_counters(), 1.0 / f64::from(frames[0]));
    let differs = |mapper: &&PhotonMapper| {
        let other = mapper.counts();
        (other.beams, other.gather) != (counts.beams, counts.gather)
    };
    let rate = |contributions: u64, stage: &str| {
        let each = 1e-3 * contributions as f64 * per_frame;
        repeats(&turns[0], |frame| each / frame.stage(stage))
    };
    let along_rays = rate(counts.beams.photons, ESTIMATION);
    let on_surfaces = rate(counts.gather.photons, SURFACES);
    let seen = Seen {
        scene: scenario.name.into(),
        photons: settings.photons.into(),
        events: counts.events,
        rays: counts.beams.queries as f64 * per_frame,
        contributions: counts.beams.photons as f64 / counts.beams.queries.max(1) as f64,
        different: mappers.iter().filter(differs).count() as u64,
        ratio: along_rays.over(&on_surfaces),
        along_rays,
        on_surfaces,
        subgroup: gpu.caps().subgroup_size.into(),
    };
    let times: Vec<Repeats> = turns
        .iter()
        .map(|frames| repeats(frames, |frame| frame.stage(ESTIMATION)))
        .collect();
    let pixels = f64::from(size[0] * size[1]);
    // In all, after the first ray of a path, and bounce by bounce, where that is counted.
    let jobs = |stage: &str| {
        let rays = eye.extend_rays as f64 * per_frame;
        match stage {
            RAYS | SCATTERING => (Some(rays), Some(rays - pixels), None),
            ESTIMATION => {
                let later: u64 = by_bounce[1..].iter().sum();
                let asked = counts.beams.queries as f64 * per_frame;
                (Some(asked), Some(later as f64), Some(by_bounce.map(|jobs| jobs as f64)))
            }
            SURFACES => (Some(counts.gather.queries as f64 * per_frame), None, None),
            SHADOWS => (Some(eye.shadow_rays as f64 * per_frame), None, None),
            _ => (None, None, None),
        }
    };
    let mut found = Found {
        scenes: vec![seen],
        ..Found::default()
    };
    for (i, form) in FORMS.iter().enumerate() {
        found.forms.push(Row {
            scene: scenario.name.into(),
            form: form.name.into(),
            time: times[i].clone(),
            collecting: repeats(&turns[i], |frame| frame.collecting),
            over_first: times[i].change_from(&times[0]),
            over_compacted: (form.name == BLOCKS).then(|| times[i].change_from(&times[1])),
            nodes: taken[i].nodes,
            records: taken[i].records,
            tests: taken[i].tests,
            fewer_nodes: (form.query == MapQuery::Packet).then(|| taken[form.single].nodes / taken[i].nodes),
        });
        found.changes.push(Change {
            scene: scenario.name.into(),
            form: form.name.into(),
            rate: times[0].change_from(&times[i]),
            time: times[i].change_from(&times[0]),
            tests: change(taken[i].tests, taken[0].tests),
            nodes: change(taken[i].nodes, taken[0].nodes),
            bytes: change(taken[i].bytes, taken[0].bytes),
        });
    }
    let rays = eye.extend_rays as f64 * per_frame;
    found.fusions = fusions(scenario, [&turns[0], &turns[FORMS.len()]], [pixels, rays - pixels]);
    for (place, (stage, _)) in STAGES.iter().enumerate().filter(|(_, (stage, _))| *stage != FUSED) {
        let (jobs, later_jobs, by_bounce) = jobs(stage);
        let of_bounce = |bounce: usize| by_bounce.map(|jobs| jobs[bounce]);
        found.stages.push(Stage {
            scene: scenario.name.into(),
            stage: (*stage).into(),
            jobs,
            later_jobs,
            second_jobs: of_bounce(1),
            third_jobs: of_bounce(2),
            further_jobs: of_bounce(3),
            first: repeats(&turns[0], |frame| frame.stages[place][0]),
            later: repeats(&turns[0], |frame| frame.stages[place][1]),
            share: repeats(&turns[0], |frame| 1e2 * frame.stage(stage) / frame.all()),
        });
    }
    Ok(found)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let mut all = Self::default();
        let scenarios: Vec<&Scenario> = context.first(&SCENARIOS, 1).iter().collect();
        let scenes = context.each(
            &scenarios,
            |scenario| scenario.name.to_owned(),
            |scenario| {
                let of_scene = scene_of_forms(context, &gpu, scenario)?;
                all.forms.extend(of_scene.forms);
                all.changes.extend(of_scene.changes);
                all.stages.extend(of_scene.stages);
                all.fusions.extend(of_scene.fusions);
                Ok(of_scene.scenes)
            },
        )?;
        Ok(Self { scenes, ..all })
    }

    fn findings(&self) -> Findings {
        let fewer = self.forms.iter().filter_map(|row| row.fewer_nodes);
        Findings::of(&self.forms, OF_FORMS)
            .headline(
                "nodes that rays fetch by themselves over those that packets fetch, geometric mean over scenes and queues",
                geometric_mean(fewer.map(Measured::from)),
            )
            .bars(
                "times",
                "GPU milliseconds of density estimation along rays, with their queue",
                &self.forms,
                |row| [row.scene.clone(), row.form.clone()],
                |row| row.time.measured(),
            )
            .note(format!(
                "{} × {} pixels, a sample each; frames of the same map, one of each form in turn. Nodes and records are counted once for all rays of a subgroup that go through \
                 the map together, by kernels of their own; tests are pairs of nodes, and records, that each ray goes through, with others or alone. Types II and III find rays' \
                 ways in a kernel before the queue, type I in that of the query.",
                SIZE[0], SIZE[1],
            ))
            .note(
                "Source: milliseconds of density estimation by rays through photons in media, 512 × 512 pixels, on a GPU of 2008; its printed mean for packets with type I is −74.7 %, \
                 its rows give −71.9 %. Photons are a 16th of its own, and kernels wider by ∛16.",
            )
            .and(Findings::of(&self.changes, OF_CHANGES))
            .note(
                "Tests stand for instructions. Bytes are those of nodes and records that are fetched, and of ways and places that a queue hands on; rates are reciprocals of times.",
            )
            .and(Findings::of(&self.stages, &[]))
            .note(
                "A stage is one kernel or a few, over the jobs of a bounce. Of density estimation along rays the jobs of each bounce are counted, by the kernels that count what they fetch; of the other stages \
                 those of the first bounce, a pixel each, and of all.",
            )
            .and(Findings::of(&self.fusions, OF_FUSIONS))
            .note(
                "Type I by itself, by a kernel for the closest hits of rays and one for their ways through media and the queries along them, or by one for all that, whose pictures have the same bits; passes are \
                 those between the start of a bounce and its compaction, and shadow rays. Surfaces, scattering and shadow rays are stages of their own in both.",
            )
            .and(Findings::of(&self.scenes, OF_SCENES))
    }
}
