//! A campaign: workers one after the other, each with some hundred cases of a reader, until the time is over.
//!
//! A worker that dies or does not end is no loss: its progress names the culprit, the next one begins behind it. A culprit is then read alone; what
//! breaks alone is made as small as it gets and kept below `findings/`, once for everything that breaks in the same place.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use clerestory::fingerprint::Fingerprint;
use clerestory::{Error, Result};

use super::case::{self, Case, Stream};
use super::mutation::mutated;
use super::readers::{READERS, Reader};
use super::totals::{Kind, Totals, Way};
use super::worker::{self, Found, Progress, Task};
use super::{kept, kept_folder};

/// What a case may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Bytes beyond what its process had. Grids that a sidecar asks for may have 512 MiB.
    pub memory: u64,
    /// Bytes of addresses of its whole process, where the system bounds them: what is asked for counts even if it is never touched.
    pub addresses: u64,
    /// Seconds by the clock on the wall. Cases take a millisecond; it is generous, so that a loaded machine is no finding.
    pub seconds: f64,
}

impl Limits {
    /// Of reading.
    pub const READ: Self = Self {
        memory: 1 << 30,
        addresses: 3 << 30,
        seconds: 20.0,
    };
    /// Of a step, for which a software driver compiles kernels.
    pub const STEP: Self = Self {
        memory: 2 << 30,
        addresses: 16 << 30,
        seconds: 180.0,
    };
}

/// Cases of a worker that reads, times the reader's share.
const READ_BATCH: u32 = 50;
/// Cases of a worker that renders, times the reader's share.
const STEP_BATCH: u32 = 50;
/// Seconds of steps for each of reading.
const STEP_SHARE: f64 = 1.0;
/// Smaller cases tried of one that breaks.
const TRIALS: usize = 400;
/// As many where each takes long.
const FEW_TRIALS: usize = 12;
/// How often a worker is looked at.
const LOOK: Duration = Duration::from_millis(5);
/// Folder of what was found, in that of the run.
pub const FINDINGS: &str = "findings";

/// A run.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// The program with the subcommand `worker`.
    pub program: PathBuf,
    /// Where totals and findings are kept.
    pub folder: PathBuf,
    /// The seed of all cases.
    pub seed: u32,
    /// Seconds after which no worker is started.
    pub seconds: f64,
    /// Cases of each reader after which none is started for it; `None` without such an end.
    pub inputs: Option<u32>,
    /// Readers by name; all without any.
    pub readers: Vec<&'static Reader>,
    /// Whether what is accepted goes through a step on a device.
    pub steps: bool,
    /// Limits of reading.
    pub limits: Limits,
}

/// How a worker ended.
struct Batch {
    progress: Progress,
    found: Vec<Found>,
}

impl Campaign {
    /// Runs, and gives the totals of all runs, which it keeps after each round.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Setting`] where the folder's totals are of another seed, and what workers cannot do: open a device, say.
    pub fn run(&self, say: &dyn Fn(&str)) -> Result<Totals> {
        let mut totals = Totals::read(&self.folder)?.unwrap_or(Totals {
            seed: self.seed,
            ..Totals::default()
        });
        if totals.seed != self.seed {
            let cause = format!(
                "is not that of the totals in {}, which is {}; give another seed a --folder of its own",
                self.folder.display(),
                totals.seed
            );
            return Err(Error::setting("seed", self.seed, cause));
        }
        totals.runs += 1;
        let readers: Vec<&Reader> = match self.readers.as_slice() {
            [] => READERS.iter().collect(),
            chosen => chosen.to_vec(),
        };
        let begun = Instant::now();
        let left = || (self.seconds - begun.elapsed().as_secs_f64()).max(0.0);
        let is_over = || left() <= 0.0;
        let (mut reading, mut stepping, mut next_step) = (0.0, 0.0, 0);
        let steps: Vec<&Reader> = readers.iter().copied().filter(|reader| reader.has_step()).collect();
        loop {
            let mut did = false;
            for reader in readers.iter().copied().filter(|reader| !reader.is_on_device()) {
                if is_over() {
                    break;
                }
                let way = &mut totals.readers.entry(reader.name.into()).or_default().read;
                let seconds = self.batch(reader, way, READ_BATCH, false, left(), say)?;
                did |= seconds.is_some();
                reading += seconds.unwrap_or(0.0);
            }
            let mut waiting = steps.len();
            while self.steps && waiting > 0 && stepping <= STEP_SHARE * reading && !is_over() {
                let reader = steps[next_step % steps.len()];
                next_step += 1;
                let all = totals.readers.entry(reader.name.into()).or_default();
                // What only a device reads is read, and renders nothing.
                let way = if reader.is_on_device() {
                    &mut all.read
                } else {
                    &mut all.step
                };
                match self.batch(reader, way, STEP_BATCH, true, left(), say)? {
                    Some(seconds) => {
                        stepping += seconds;
                        did = true;
                    }
                    None => waiting -= 1,
                }
            }
            totals.write(&self.folder)?;
            if !did || is_over() {
                return Ok(totals);
            }
        }
    }

    /// A worker's cases; their seconds, or `None` where the reader has had its own.
    fn batch(
        &self,
        reader: &'static Reader,
        way: &mut Way,
        batch: u32,
        steps: bool,
        left: f64,
        say: &dyn Fn(&str),
    ) -> Result<Option<f64>> {
        let size = (batch * reader.share).min(self.inputs.map_or(u32::MAX, |inputs| inputs.saturating_sub(way.next)));
        if size == 0 {
            return Ok(None);
        }
        let limits = if steps { Limits::STEP } else { self.limits };
        let task = Task {
            reader: reader.name.into(),
            seed: self.seed,
            from: way.next,
            to: way.next.saturating_add(size),
            steps,
            memory: limits.memory,
            seconds: left,
            folder: self.folder.join("work"),
            case: None,
        };
        let start = Instant::now();
        let Batch { progress, found } = self.work(&task, &limits)?;
        let seconds = start.elapsed().as_secs_f64();
        way.inputs += u64::from(progress.next.saturating_sub(way.next));
        way.next = progress.next;
        way.accepted += progress.accepted;
        way.seconds += seconds;
        way.slowest = way.slowest.max(progress.slowest as f64 * 1e-6);
        way.peak = way.peak.max(progress.peak);
        for found in &found {
            let breaks_alone = self.keep(reader, found, steps, &limits, say)?;
            // One slow moment of the machine is no finding: what takes too long does so alone, too.
            if found.kind != Kind::Time || breaks_alone {
                *way.found.entry(found.kind).or_default() += 1;
            }
        }
        Ok(Some(seconds))
    }

    /// Runs a worker to its end, its death or the end of its time.
    fn work(&self, task: &Task, limits: &Limits) -> Result<Batch> {
        let folder = &task.folder;
        if folder.exists() {
            std::fs::remove_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        }
        std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        let said = folder.join("said");
        let file = std::fs::File::create(&said).map_err(|error| Error::io(&said, error))?;
        let mut child = self.start(task, limits, file)?;
        let (status, is_late) = watch(&mut child, folder, limits.seconds)?;
        let mut found = worker::found(folder);
        let Some(mut progress) = Progress::read(folder) else {
            let words = std::fs::read_to_string(&said).unwrap_or_default();
            return Err(Error::setting(
                "worker",
                &task.reader,
                format!("did not begin: {}", words.trim()),
            ));
        };
        if is_late || !status.success() {
            let words = std::fs::read_to_string(&said).unwrap_or_default();
            let words = words
                .lines()
                .find(|line| !line.trim().is_empty())
                .unwrap_or_default()
                .trim();
            let kind = if is_late {
                Kind::Time
            } else if words.contains("memory allocation of") {
                Kind::Memory
            } else {
                Kind::Abort
            };
            let words = match kind {
                Kind::Time => format!("took more than {} s", limits.seconds),
                _ => format!("{words} ({status})"),
            };
            found.push(Found {
                number: progress.next,
                kind,
                words,
            });
            progress.next += 1;
        }
        Ok(Batch { progress, found })
    }

    fn start(&self, task: &Task, limits: &Limits, said: std::fs::File) -> Result<Child> {
        let mut command = if cfg!(unix) {
            // The shell bounds what the program that takes its place may ask for, and leaves no files of memory behind.
            let mut shell = Command::new("sh");
            shell.args(["-c", "ulimit -c 0; ulimit -v \"$1\"; shift; exec \"$@\"", "sh"]);
            shell.arg((limits.addresses >> 10).to_string()).arg(&self.program);
            shell
        } else {
            Command::new(&self.program)
        };
        command.args(["worker", "--reader", &task.reader]);
        command.args(["--seed", &task.seed.to_string()]);
        command.args(["--from", &task.from.to_string(), "--to", &task.to.to_string()]);
        command.args([
            "--memory",
            &task.memory.to_string(),
            "--seconds",
            &task.seconds.to_string(),
        ]);
        command.arg("--folder").arg(&task.folder);
        if let Some(case) = &task.case {
            command.arg("--case").arg(case);
        }
        if task.steps {
            command.arg("--steps");
        }
        command
            .env("CLERESTORY_VALIDATION", "off")
            .env("RUST_BACKTRACE", "0")
            // Each thread's arena takes addresses that nobody asked for.
            .env("MALLOC_ARENA_MAX", "2")
            .env("RAYON_NUM_THREADS", "2")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(said);
        command.spawn().map_err(|error| Error::io(&self.program, error))
    }

    /// Reads a case alone; how it broke.
    fn alone(&self, reader: &Reader, case: &Case, steps: bool, limits: &Limits) -> Result<Option<Found>> {
        let folder = self.folder.join("alone");
        if folder.exists() {
            std::fs::remove_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
        }
        std::fs::create_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
        case.write(&folder)?;
        self.alone_in(reader, &folder, steps, limits)
    }

    /// Reads the case of a folder alone; how it broke.
    ///
    /// # Errors
    /// As [`Campaign::run`].
    pub fn alone_in(&self, reader: &Reader, folder: &Path, steps: bool, limits: &Limits) -> Result<Option<Found>> {
        let task = Task {
            reader: reader.name.into(),
            seed: self.seed,
            from: 0,
            to: 1,
            steps,
            memory: limits.memory,
            seconds: f64::INFINITY,
            folder: self.folder.join("work"),
            case: Some(folder.into()),
        };
        Ok(self.work(&task, limits)?.found.into_iter().next())
    }

    /// Makes what was found small and keeps it, unless there is one of its kind; says whether it breaks alone.
    fn keep(
        &self,
        reader: &'static Reader,
        found: &Found,
        steps: bool,
        limits: &Limits,
        say: &dyn Fn(&str),
    ) -> Result<bool> {
        let scratch = self.folder.join("scratch");
        std::fs::create_dir_all(&scratch).map_err(|error| Error::io(&scratch, error))?;
        let seeds = (reader.seeds)(&scratch)?;
        let case = mutated(&seeds, reader.words, Stream::new(self.seed, reader.name, found.number));
        let name = name(reader, found);
        let folder = self.folder.join(FINDINGS).join(&name);
        if folder.exists() && found.kind != Kind::Time {
            return Ok(true);
        }
        let alone = self.alone(reader, &case, steps, limits)?;
        let breaks_alone = alone.as_ref().is_some_and(|alone| alone.kind == found.kind);
        if found.kind == Kind::Time && (!breaks_alone || folder.exists()) {
            return Ok(breaks_alone);
        }
        let small = if breaks_alone {
            self.smallest(reader, case, found.kind, steps, limits)?
        } else {
            case
        };
        std::fs::create_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
        small.write(&folder)?;
        let text = format!(
            "# {}: {}\n\n{}\n\nFile number {} of the seed {}{}, made smaller. {}\n",
            reader.name,
            found.kind.word(),
            found.words,
            found.number,
            self.seed,
            if steps { ", in a step" } else { "" },
            if breaks_alone {
                "It breaks alone."
            } else {
                "It breaks only after others."
            }
        );
        let path = folder.join(case::README);
        std::fs::write(&path, text).map_err(|error| Error::io(&path, error))?;
        say(&format!(
            "{}: {}: {}",
            folder.display(),
            found.kind.word(),
            found.words.lines().next().unwrap_or_default()
        ));
        Ok(breaks_alone)
    }

    /// The case without whatever it breaks without. Source: parts are left out as in delta debugging (Zeller and Hildebrandt, "Simplifying and
    /// Isolating Failure-Inducing Input", 2002), halves first.
    fn smallest(&self, reader: &Reader, case: Case, kind: Kind, steps: bool, limits: &Limits) -> Result<Case> {
        let mut left = if steps || kind == Kind::Time {
            FEW_TRIALS
        } else {
            TRIALS
        };
        smallest(case, |case| {
            if left == 0 {
                return Ok(false);
            }
            left -= 1;
            Ok(self
                .alone(reader, case, steps, limits)?
                .is_some_and(|found| found.kind == kind))
        })
    }

    /// Reads all files that once broke something; those that break again.
    ///
    /// # Errors
    /// As [`Campaign::run`].
    pub fn kept(&self) -> Result<Vec<(PathBuf, Found)>> {
        let mut broken = Vec::new();
        for (reader, folder) in kept::cases(&kept_folder())? {
            if let Some(found) = self.alone_in(reader, &folder, false, &self.limits)? {
                broken.push((folder, found));
            }
        }
        Ok(broken)
    }
}

/// The case without whatever it still breaks without, as long as `breaks` says so.
fn smallest(mut case: Case, mut breaks: impl FnMut(&Case) -> Result<bool>) -> Result<Case> {
    for place in 0..case.files.len() {
        let mut part = case.files[place].bytes.len().div_ceil(2);
        while part > 0 {
            let mut at = 0;
            while at < case.files[place].bytes.len() {
                let mut without = case.clone();
                let bytes = &mut without.files[place].bytes;
                let end = (at + part).min(bytes.len());
                bytes.drain(at..end);
                if breaks(&without)? {
                    case = without;
                } else {
                    at += part;
                }
            }
            part = if part == 1 { 0 } else { part.div_ceil(2) };
        }
    }
    Ok(case)
}

/// Waits for the end; kills a worker that stays at one case for too long. Its status, and whether it was killed.
fn watch(child: &mut Child, folder: &Path, seconds: f64) -> Result<(ExitStatus, bool)> {
    let wrong = |error| Error::io(folder, error);
    let (mut last, mut since) = (None, Instant::now());
    loop {
        if let Some(status) = child.try_wait().map_err(wrong)? {
            return Ok((status, false));
        }
        let next = Progress::read(folder).map(|progress| progress.next);
        if next != last {
            (last, since) = (next, Instant::now());
        } else if since.elapsed().as_secs_f64() > seconds {
            child.kill().map_err(wrong)?;
            return Ok((child.wait().map_err(wrong)?, true));
        }
        std::thread::sleep(LOOK);
    }
}

/// The folder of a finding: what breaks in the same place has the same.
fn name(reader: &Reader, found: &Found) -> String {
    // Numbers of bytes and of seconds are of one file; places in code are the same for all.
    let place: String = match found.kind {
        Kind::Panic => found.words.lines().next().unwrap_or_default().into(),
        Kind::Abort | Kind::Memory | Kind::Time => found.words.chars().filter(|c| !c.is_ascii_digit()).collect(),
    };
    let print = Fingerprint::of(place.as_bytes());
    format!("{}-{}-{}", kept::folder_of(reader), found.kind.word(), &print[..8])
}

/// Readers by their names; all names once.
///
/// # Errors
/// [`Error::Setting`] when there is none of a name.
pub fn readers(names: &[String]) -> Result<Vec<&'static Reader>> {
    let names: BTreeSet<&String> = names.iter().collect();
    names.into_iter().map(|name| super::readers::by_name(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_are_made_as_small_as_they_break() {
        let case = Case::of("main.txt", "some words, a fault, and more words").with("other", "nothing of it");
        let mut trials = 0;
        let has_fault = |case: &Case| {
            trials += 1;
            Ok(case.main().windows(5).any(|part| part == b"fault"))
        };
        let small = smallest(case, has_fault).unwrap();
        assert_eq!((small.main(), small.files[1].bytes.len()), (&b"fault"[..], 0));
        assert!(trials < 200, "{trials}");
    }

    #[test]
    fn what_breaks_in_one_place_has_one_name() {
        let found = |kind, words: &str| {
            name(
                &READERS[0],
                &Found {
                    number: 1,
                    kind,
                    words: words.into(),
                },
            )
        };
        let first = found(Kind::Panic, "panicked at a.rs:1:2:\nindex 7");
        assert_eq!(first, found(Kind::Panic, "panicked at a.rs:1:2:\nindex 9"));
        assert_ne!(first, found(Kind::Panic, "panicked at a.rs:2:2:\nindex 7"));
        assert_eq!(found(Kind::Memory, "took 5 MiB"), found(Kind::Memory, "took 81 MiB"));
        assert!(first.starts_with("glTF-panic-"), "{first}");
    }
}
