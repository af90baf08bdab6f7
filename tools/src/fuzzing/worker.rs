//! A worker: reads many cases in a process of its own.
//!
//! Before each case it writes its number and its counts so far into a file, which stands when the process dies: whoever runs it goes on behind
//! that number. Panics it catches itself, and goes on; after a case that took too much memory it ends, since the most that a process ever had
//! tells nothing of what comes after.

use std::io::{Seek, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use clerestory::{Error, Result};

use super::case::{Case, Stream};
use super::mutation::mutated;
use super::readers::{self, Reader, Stage};
use super::totals::Kind;

/// The file that says how far it is.
pub const PROGRESS: &str = "progress";
/// The file that says what it found, a line each.
pub const FOUND: &str = "found";

/// What a worker does.
#[derive(Debug, Clone)]
pub struct Task {
    /// The reader's name.
    pub reader: String,
    /// The seed of all cases.
    pub seed: u32,
    /// Its first case.
    pub from: u32,
    /// The case behind its last.
    pub to: u32,
    /// Whether accepted scenes go through a step.
    pub steps: bool,
    /// Most bytes that a case may take.
    pub memory: u64,
    /// Seconds after which it begins no case, however many are left.
    pub seconds: f64,
    /// A folder of its own, which is empty.
    pub folder: PathBuf,
    /// The folder of one case that is read in place of those.
    pub case: Option<PathBuf>,
}

/// How far it is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Progress {
    /// The number of the case that has begun; behind the last, all are done.
    pub next: u32,
    /// Cases that were accepted.
    pub accepted: u64,
    /// Most bytes that a case took.
    pub peak: u64,
    /// Microseconds of the slowest case.
    pub slowest: u64,
}

/// What broke.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Found {
    /// The case.
    pub number: u32,
    /// How.
    pub kind: Kind,
    /// What was said of it.
    pub words: String,
}

impl Progress {
    /// That of a worker's folder; `None` before it has begun.
    pub fn read(folder: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(folder.join(PROGRESS)).ok()?;
        let numbers: Vec<u64> = text.split_whitespace().map_while(|word| word.parse().ok()).collect();
        let [next, accepted, peak, slowest] = numbers.try_into().ok()?;
        Some(Self {
            next: u32::try_from(next).ok()?,
            accepted,
            peak,
            slowest,
        })
    }

    /// As long whatever the numbers, so that one is written over the other.
    fn text(&self) -> String {
        let Self {
            next,
            accepted,
            peak,
            slowest,
        } = self;
        format!("{next:010} {accepted:020} {peak:020} {slowest:020}\n")
    }
}

/// Bytes of memory of this process: what it has, and the most it ever had; `None` where the system does not tell.
fn memory() -> Option<[u64; 2]> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let of = |name: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(name))?;
        let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
        Some(kibibytes << 10)
    };
    Some([of("VmRSS:")?, of("VmHWM:")?])
}

/// What the last panic said.
static SAID: Mutex<String> = Mutex::new(String::new());

/// What became of a case: whether it was accepted, or how it broke.
pub type Attempt = std::result::Result<bool, (Kind, String)>;

/// Reads a case, and takes what breaks.
pub fn attempt(reader: &Reader, case: &Case, stage: Option<&mut Stage>, folder: &Path) -> Attempt {
    let read = || match stage {
        Some(stage) => stage.step(case, folder),
        None => Ok(reader.read(case, folder).is_ok()),
    };
    match catch_unwind(AssertUnwindSafe(read)) {
        Ok(Ok(is_accepted)) => Ok(is_accepted),
        Ok(Err(error)) => Err((Kind::Abort, error.to_string())),
        Err(payload) => {
            let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
            let payload = payload.downcast_ref::<String>().cloned().or(text);
            let said = std::mem::take(&mut *SAID.lock().unwrap_or_else(PoisonError::into_inner));
            let words = if said.is_empty() {
                payload.unwrap_or_default()
            } else {
                said
            };
            Err((Kind::Panic, words))
        }
    }
}

/// Does the task.
///
/// # Errors
/// [`Error::Io`] where it cannot write to its folder, and faults of the seeds or of the device.
pub fn run(task: &Task) -> Result<()> {
    std::panic::set_hook(Box::new(|info| {
        *SAID.lock().unwrap_or_else(PoisonError::into_inner) = info.to_string();
    }));
    let reader = readers::by_name(&task.reader)?;
    let files = task.folder.join("files");
    std::fs::create_dir_all(&files).map_err(|error| Error::io(&files, error))?;
    let one = task.case.as_deref().map(Case::read).transpose()?;
    let seeds = match one {
        Some(_) => Vec::new(),
        None => (reader.seeds)(&task.folder)?,
    };
    let mut stage = if task.steps && !reader.is_on_device() {
        Some(Stage::open()?)
    } else {
        None
    };
    let mut log = Log::open(&task.folder)?;
    let mut progress = Progress::default();
    let mut before = memory();
    let begun = Instant::now();
    for number in task.from..task.to {
        progress.next = number;
        log.progress(&progress)?;
        if number > task.from && begun.elapsed().as_secs_f64() >= task.seconds {
            return Ok(());
        }
        let case = match &one {
            Some(case) => case.clone(),
            None => mutated(&seeds, reader.words, Stream::new(task.seed, reader.name, number)),
        };
        let start = Instant::now();
        let attempt = attempt(reader, &case, stage.as_mut(), &files);
        progress.slowest = progress.slowest.max(start.elapsed().as_micros() as u64);
        for file in &case.files {
            // A case that was not written has none.
            let _ = std::fs::remove_file(files.join(&file.name));
        }
        let after = memory();
        let taken = match (before, after) {
            (Some([had, most]), Some([_, now_most])) if now_most > most => now_most.saturating_sub(had),
            _ => 0,
        };
        before = after;
        progress.peak = progress.peak.max(taken);
        let is_dead = matches!(attempt, Err((Kind::Abort, _)));
        match attempt {
            Ok(is_accepted) => progress.accepted += u64::from(is_accepted),
            Err((kind, words)) => log.found(&Found { number, kind, words })?,
        }
        if taken > task.memory {
            let words = format!("took {} MiB", taken >> 20);
            let kind = Kind::Memory;
            log.found(&Found { number, kind, words })?;
        }
        if taken > task.memory || is_dead {
            progress.next = number + 1;
            return log.progress(&progress);
        }
    }
    progress.next = task.to;
    log.progress(&progress)
}

/// The two files of a worker.
struct Log {
    progress: std::fs::File,
    found: std::fs::File,
    folder: PathBuf,
}

impl Log {
    fn open(folder: &Path) -> Result<Self> {
        let wrong = |error| Error::io(folder, error);
        let [progress, found] = [PROGRESS, FOUND].map(|name| std::fs::File::create(folder.join(name)));
        Ok(Self {
            progress: progress.map_err(wrong)?,
            found: found.map_err(wrong)?,
            folder: folder.into(),
        })
    }

    fn progress(&mut self, progress: &Progress) -> Result<()> {
        let written = self
            .progress
            .rewind()
            .and_then(|()| self.progress.write_all(progress.text().as_bytes()));
        written.map_err(|error| Error::io(&self.folder, error))
    }

    fn found(&mut self, found: &Found) -> Result<()> {
        let line = serde_json::to_string(found).unwrap_or_default() + "\n";
        let written = self.found.write_all(line.as_bytes());
        written.map_err(|error| Error::io(&self.folder, error))
    }
}

/// What a worker says that it found.
pub fn found(folder: &Path) -> Vec<Found> {
    let text = std::fs::read_to_string(folder.join(FOUND)).unwrap_or_default();
    text.lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_as_long_whatever_it_says() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Progress::read(folder.path()), None);
        let [small, large] = [
            Progress::default(),
            Progress {
                next: u32::MAX,
                accepted: 1 << 60,
                peak: u64::MAX,
                slowest: 9,
            },
        ];
        assert_eq!(small.text().len(), large.text().len());
        for progress in [large, small] {
            std::fs::write(folder.path().join(PROGRESS), progress.text()).unwrap();
            assert_eq!(Progress::read(folder.path()), Some(progress));
        }
    }

    #[test]
    fn memory_that_is_taken_is_seen() {
        let Some([_, before]) = memory() else {
            return;
        };
        let taken = vec![1u8; 64 << 20];
        let [has, most] = memory().unwrap();
        assert!(most >= has && most >= before && most >= taken.len() as u64);
    }
}
