//! Barriers: whether the check of debug builds finds every missing one and complains of no right one, how many a picture has, and what
//! recording them costs.
//!
//! Oracle: the hazards of random sequences of fills and copies, found by comparing every command with all since the last barrier.

use std::sync::Arc;

use clerestory::gpu::{Access, Buffer, BufferDesc, Category, Gpu, Pass};
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result, scene};

use crate::experiments::measures::Context;
use crate::experiments::table::Table;
use crate::random::Random;
use crate::timing::{median, repeated, timed};

/// Buffers of a sequence and its commands.
const BUFFERS: usize = 4;
const COMMANDS: usize = 24;

/// A command: fills a buffer, or copies one to another.
#[derive(Clone, Copy)]
enum Command {
    Fill(usize),
    Copy(usize, usize),
}

impl Command {
    fn random(random: &mut Random) -> Self {
        let mut index = |n: usize| (random.unit() * n as f64) as usize;
        let to = index(BUFFERS);
        match index(2) {
            0 => Self::Fill(to),
            // Another buffer than the target.
            _ => Self::Copy((to + 1 + index(BUFFERS - 1)) % BUFFERS, to),
        }
    }

    fn written(self) -> usize {
        match self {
            Self::Fill(to) | Self::Copy(_, to) => to,
        }
    }

    fn touches(self, buffer: usize) -> bool {
        self.written() == buffer || matches!(self, Self::Copy(from, _) if from == buffer)
    }

    /// Whether the order of the two matters.
    fn conflicts(self, other: Self) -> bool {
        other.touches(self.written()) || self.touches(other.written())
    }
}

/// The commands before which a barrier is needed, when each is put as late as possible.
fn needed(commands: &[Command]) -> Vec<usize> {
    let mut barriers = Vec::new();
    let mut since = 0;
    for (i, command) in commands.iter().enumerate() {
        if commands[since..i].iter().any(|earlier| earlier.conflicts(*command)) {
            barriers.push(i);
            since = i;
        }
    }
    barriers
}

/// Records the commands with barriers before some of them; `false` when the recorder misses one.
fn accepted(gpu: &Gpu, buffers: &[Buffer], commands: &[Command], barriers: &[usize]) -> Result<bool> {
    let mut recorder = gpu.recorder("hazards")?;
    let recorded = recorder.pass("hazards", |pass| {
        for (i, command) in commands.iter().enumerate() {
            if barriers.contains(&i) {
                pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
            }
            match *command {
                Command::Fill(to) => pass.fill(buffers[to].view(), 0)?,
                Command::Copy(from, to) => pass.copy(buffers[from].view(), buffers[to].view())?,
            }
        }
        Ok(())
    });
    match recorded {
        Ok(()) => Ok(true),
        Err(Error::MissingBarrier { .. }) => Ok(false),
        Err(other) => Err(other),
    }
}

fn hazards(gpu: &Gpu, buffers: &[Buffer], sequences: usize) -> Result<Table> {
    let mut random = Random::new(10);
    let (mut right, mut false_alarms, mut planted, mut overlooked) = (0_u64, 0_u64, 0_u64, 0_u64);
    for _ in 0..sequences {
        let commands: Vec<Command> = (0..COMMANDS).map(|_| Command::random(&mut random)).collect();
        let barriers = needed(&commands);
        right += 1;
        false_alarms += u64::from(!accepted(gpu, buffers, &commands, &barriers)?);
        if !cfg!(debug_assertions) {
            continue;
        }
        for left_out in 0..barriers.len() {
            let mut fewer = barriers.clone();
            fewer.remove(left_out);
            planted += 1;
            overlooked += u64::from(accepted(gpu, buffers, &commands, &fewer)?);
        }
    }
    let mut table = Table::new(
        "The check for missing barriers",
        &[
            "check",
            "right sequences",
            "false alarms",
            "sequences without one of their barriers",
            "overlooked",
        ],
    );
    let build = if cfg!(debug_assertions) {
        "in this build"
    } else {
        "not in this build"
    };
    table.row([
        build.into(),
        right.into(),
        false_alarms.into(),
        planted.into(),
        overlooked.into(),
    ]);
    table.note(format!(
        "Random sequences of {COMMANDS} fills and copies among {BUFFERS} buffers. The check is compiled into builds with debug assertions; \
         others run only the right sequences."
    ));
    Ok(table)
}

fn recording(gpu: &Gpu, buffers: &[Buffer], smoke: bool) -> Result<Table> {
    let (commands, repeats) = if smoke { (64, 3) } else { (4096, 15) };
    let time = |barriers: bool| -> Result<f64> {
        let record = |pass: &mut Pass<'_>| {
            for i in 0..commands {
                // With barriers one buffer, without them each its own: neither has a hazard.
                if barriers {
                    pass.fill(buffers[0].view(), 0)?;
                    pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
                } else {
                    if i % buffers.len() == 0 && i > 0 {
                        pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
                    }
                    pass.fill(buffers[i % buffers.len()].view(), 0)?;
                }
            }
            Ok(())
        };
        let (_, seconds) = repeated(repeats, || {
            let mut recorder = gpu.recorder("cost")?;
            let (recorded, seconds) = timed(|| recorder.pass("cost", record));
            recorded.map(|()| (recorder, seconds))
        })?;
        Ok(1e9 * median(seconds) / commands as f64)
    };
    let mut table = Table::new("Recording", &["commands", "check", "barriers a fill", "host ns a fill"]);
    let build = if cfg!(debug_assertions) {
        "in this build"
    } else {
        "not in this build"
    };
    for (name, barriers, share) in [
        ("fills of one buffer", true, 1.0),
        ("fills of buffers in turn", false, 1.0 / buffers.len() as f64),
    ] {
        table.row([name.into(), build.into(), share.into(), time(barriers)?.into()]);
    }
    table.note("Time on the host to record, not to run; median of repeats.");
    Ok(table)
}

fn frames(gpu: &Gpu, smoke: bool) -> Result<Table> {
    let (size, samples) = if smoke { (8, 1) } else { (64, 4) };
    let mut table = Table::new(
        "Passes and barriers of one wave of the path tracer",
        &["scene", "pass", "passes", "barriers", "barriers a pass"],
    );
    let addresses = ["builtin:cornell-box", "builtin:materials"];
    for address in &addresses[..if smoke { 1 } else { 2 }] {
        let scene = scene::load(address)?;
        let camera = scene.require_camera(None)?;
        let uploaded = Arc::new(GpuScene::new(gpu, &scene)?);
        let mut tracer = PathTracer::new(gpu, uploaded, camera, [size; 2], PathTracerSettings::default())?;
        let Some(step) = tracer.step(samples)? else {
            continue;
        };
        let mut rows: Vec<(String, u64, u64)> = Vec::new();
        for pass in step.timings.iter().flat_map(|timings| &timings.passes) {
            let at = rows
                .iter()
                .position(|(name, ..)| *name == pass.name)
                .unwrap_or(rows.len());
            if at == rows.len() {
                rows.push((pass.name.clone(), 0, 0));
            }
            rows[at].1 += 1;
            rows[at].2 += u64::from(pass.barriers);
        }
        let sum = |value: fn(&(String, u64, u64)) -> u64| rows.iter().map(value).sum();
        rows.push(("all".into(), sum(|row| row.1), sum(|row| row.2)));
        for (pass, passes, barriers) in rows {
            table.row([
                address.trim_start_matches("builtin:").into(),
                pass.into(),
                passes.into(),
                barriers.into(),
                (barriers as f64 / passes.max(1) as f64).into(),
            ]);
        }
    }
    table.note(format!(
        "{size} × {size} pixels, {samples} samples each; counts are exact."
    ));
    Ok(table)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let buffers: Result<Vec<Buffer>> = (0..BUFFERS)
        .map(|_| gpu.buffer(&BufferDesc::storage("hazards", 256, Category::Work)))
        .collect();
    let buffers = buffers?;
    let sequences = if context.smoke { 5 } else { 300 };
    Ok(vec![
        hazards(&gpu, &buffers, sequences)?,
        recording(&gpu, &buffers, context.smoke)?,
        frames(&gpu, context.smoke)?,
    ])
}
