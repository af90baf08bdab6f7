//! Barriers: whether the check of debug builds finds every missing one and complains of no right one, how many a picture has, and what
//! recording them costs.
//!
//! Oracle: the hazards of random sequences of fills and copies, found by comparing every command with all since the last barrier.

use std::sync::Arc;

use clerestory::gpu::{Access, Buffer, BufferDesc, Category, Gpu, Pass};
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};

use super::hazards::{BUFFERS, COMMANDS, Command, accepted, needed};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;
use crate::random::Random;
use crate::timing::timed;

rows! {
    /// Random sequences.
    struct Sequences = "The check for missing barriers" by [right] {
        right: u64 = "right sequences",
        false_alarms: u64 = "false alarms",
        planted: u64 = "sequences without one of their barriers",
        overlooked: u64 = "overlooked",
    }
}

rows! {
    /// A way to fill buffers.
    struct Recording = "Recording" by [commands] {
        commands: String = "commands",
        barriers: f64 = "barriers per fill",
        time: Repeats = "host time per fill (ns)",
    }
}

rows! {
    /// A pass of a picture.
    struct Passes = "Passes and barriers of one wave of the path tracer" by [scene, pass] {
        scene: String = "scene",
        pass: String = "pass",
        passes: u64 = "passes",
        barriers: u64 = "barriers",
        pixels: u64 = "pixels",
        samples: u64 = "samples per pixel",
    }
    beside "barriers per pass" = |row| (row.barriers as f64 / row.passes.max(1) as f64).into();
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    sequences: Vec<Sequences>,
    recording: Vec<Recording>,
    passes: Vec<Passes>,
}

const OF_SEQUENCES: &[Criterion<Sequences>] = &[
    Criterion::each(
        "every missing barrier is found",
        Bound::AtMost(0.0),
        |row: &Sequences| row.overlooked.into(),
    )
    .among(|row| row.planted > 0)
    .needs("a build with debug assertions, which has the check")
    .in_every_form(),
    Criterion::each("no right sequence is refused", Bound::AtMost(0.0), |row: &Sequences| {
        row.false_alarms.into()
    })
    .in_every_form(),
];

const OF_RECORDING: &[Criterion<Recording>] = &[Criterion::each(
    "they take little time to record: ns per fill with its barrier",
    Bound::AtMost(1000.0),
    |row: &Recording| (&row.time).into(),
)
.because("a thousand of them are a millisecond of a frame")];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let buffers: Result<Vec<Buffer>> = (0..BUFFERS)
            .map(|_| gpu.buffer(&BufferDesc::storage("hazards", 256, Category::Work)))
            .collect();
        let buffers = buffers?;
        Ok(Self {
            sequences: vec![sequences(&gpu, &buffers, context.pick(300, 5))?],
            recording: recording(context, &gpu, &buffers)?,
            passes: context.each(
                context.first(&["builtin:cornell-box", "builtin:materials"], 1),
                |address| short_name(address).to_owned(),
                |address| passes(&gpu, address, context.pick((64, 4), (8, 1))),
            )?,
        })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.sequences, OF_SEQUENCES)
            .note(format!(
                "Random sequences of {COMMANDS} fills and copies among {BUFFERS} buffers. The check is compiled into builds with debug assertions; \
                 others run only the right sequences."
            ))
            .and(Findings::of(&self.recording, OF_RECORDING))
            .note("Time on the host to record, not to run, in turns; with the check where the build has it.")
            .headline(
                "host time to record a fill with its barrier (ns)",
                self.recording.first().map(|row| (&row.time).into()),
            )
            .and(Findings::of(&self.passes, &[]))
            .note("Counts are exact.")
    }
}

/// Runs right sequences and, where there is a check, the same without one of their barriers.
fn sequences(gpu: &Gpu, buffers: &[Buffer], count: usize) -> Result<Sequences> {
    let mut random = Random::new(10);
    let mut found = Sequences::default();
    for _ in 0..count {
        let commands: Vec<Command> = (0..COMMANDS).map(|_| Command::random(&mut random)).collect();
        let barriers = needed(&commands);
        found.right += 1;
        found.false_alarms += u64::from(!accepted(gpu, buffers, &commands, &barriers)?);
        if !cfg!(debug_assertions) {
            continue;
        }
        for left_out in 0..barriers.len() {
            let mut fewer = barriers.clone();
            fewer.remove(left_out);
            found.planted += 1;
            found.overlooked += u64::from(accepted(gpu, buffers, &commands, &fewer)?);
        }
    }
    Ok(found)
}

/// Fills of one buffer with a barrier each, and of buffers in turn with one a round: neither has a hazard.
fn recording(context: &Context<'_>, gpu: &Gpu, buffers: &[Buffer]) -> Result<Vec<Recording>> {
    let commands = context.pick(4096, 64);
    let forms = [("fills of one buffer", 1), ("fills of buffers in turn", buffers.len())];
    let times = context.in_turns(15, forms.len(), |form| {
        let round = forms[form].1;
        let record = |pass: &mut Pass<'_>| {
            for i in 0..commands {
                if i > 0 && i % round == 0 {
                    pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
                }
                pass.fill(buffers[i % round].view(), 0)?;
            }
            Ok(())
        };
        let mut recorder = gpu.recorder("cost")?;
        let (recorded, seconds) = timed(|| recorder.pass("cost", record));
        recorded.map(|()| 1e9 * seconds / commands as f64)
    })?;
    let of = |((commands, round), time): ((&str, usize), Vec<f64>)| Recording {
        commands: commands.into(),
        barriers: 1.0 / round as f64,
        time: Repeats(time),
    };
    Ok(forms.into_iter().zip(times).map(of).collect())
}

/// Passes and barriers of a wave, by the names of passes and in all.
fn passes(gpu: &Gpu, address: &str, (size, samples): (u32, u32)) -> Result<Vec<Passes>> {
    let scene = scene::load(address)?;
    let camera = scene.require_camera(None)?;
    let uploaded = Arc::new(GpuScene::new(gpu, &scene)?);
    let mut tracer = PathTracer::new(gpu, uploaded, camera, [size; 2], PathTracerSettings::default())?;
    // Its wave may take several submissions, a step each.
    let mut submissions = Vec::new();
    while tracer.counters().waves == 0
        && let Some(step) = tracer.step(samples)?
    {
        submissions.extend(step.timings);
    }
    let row = |pass: &str| Passes {
        scene: short_name(address).into(),
        pass: pass.into(),
        pixels: u64::from(size * size),
        samples: samples.into(),
        ..Passes::default()
    };
    let (mut rows, mut all): (Vec<Passes>, Passes) = (Vec::new(), row("all"));
    for pass in submissions.iter().flat_map(|timings| &timings.passes) {
        let at = rows.iter().position(|row| row.pass == pass.name);
        let at = at.unwrap_or_else(|| {
            rows.push(row(&pass.name));
            rows.len() - 1
        });
        for row in [&mut rows[at], &mut all] {
            row.passes += 1;
            row.barriers += u64::from(pass.barriers);
        }
    }
    rows.push(all);
    Ok(rows)
}
