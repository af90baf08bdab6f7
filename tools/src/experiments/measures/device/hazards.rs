//! Random sequences of fills and copies, where they need barriers, and whether a recorder takes them.

use clerestory::gpu::{Access, Buffer, Gpu};
use clerestory::{Error, Result};

use crate::random::Random;

/// Buffers of a sequence.
pub const BUFFERS: usize = 4;
/// Commands of a sequence.
pub const COMMANDS: usize = 24;

/// A command: fills a buffer, or copies one to another.
#[derive(Clone, Copy)]
pub enum Command {
    /// Which buffer.
    Fill(usize),
    /// From which to which.
    Copy(usize, usize),
}

impl Command {
    /// Any of them.
    pub fn random(random: &mut Random) -> Self {
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
pub fn needed(commands: &[Command]) -> Vec<usize> {
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
pub fn accepted(gpu: &Gpu, buffers: &[Buffer], commands: &[Command], barriers: &[usize]) -> Result<bool> {
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
