//! Damaged files through every reader: the totals of all runs of `tools/fuzz`.
//!
//! Oracle: the process itself, which must neither panic nor die, nor take more memory and time than a file may. Where there are no totals, and in smoke
//! runs, some files are read here, in this process, and none goes through a step.

use std::path::Path;
use std::time::Instant;

use clerestory::{Error, Result};

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows, total};
use crate::experiments::measures::Context;
use crate::fuzzing::FOLDER;
use crate::fuzzing::campaign::Limits;
use crate::fuzzing::case::Stream;
use crate::fuzzing::mutation::mutated;
use crate::fuzzing::readers::{READERS, Reader};
use crate::fuzzing::totals::{Kind, OfReader, Totals, Way};
use crate::fuzzing::worker::attempt;

/// Bytes of a MiB.
const MEBIBYTE: f64 = 1_048_576.0;
/// The seed of files that are read here.
const SEED: u32 = 1;

rows! {
    /// What was done with a reader.
    struct Row = "Damaged files by reader" by [reader] {
        reader: String = "reader",
        inputs: u64 = "files",
        accepted: u64 = "accepted",
        stepped: u64 = "accepted and put through a step",
        panics: u64 = "panics",
        aborts: u64 = "aborts",
        over_memory: u64 = "above their memory",
        over_time: u64 = "beyond their time",
        seconds: f64 = "reading (s)",
        rate: f64 = "files per second",
        peak: f64 = "most memory of a file (MiB)",
        slowest: f64 = "slowest file (s)",
        step_seconds: f64 = "steps (s)",
        step_peak: f64 = "most memory of a step (MiB)",
        step_slowest: f64 = "slowest step (s)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

/// A sum over all rows; `None` of none.
fn sum(rows: &[&Row], of: fn(&Row) -> u64) -> Option<Measured> {
    (!rows.is_empty()).then(|| rows.iter().map(|row| of(row)).sum::<u64>().into())
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each("no file makes a reader panic", Bound::AtMost(0.0), |row: &Row| {
        row.panics.into()
    })
    .in_every_form(),
    Criterion::each("no file ends the process", Bound::AtMost(0.0), |row: &Row| {
        row.aborts.into()
    })
    .in_every_form(),
    Criterion::each("no file takes more than its memory", Bound::AtMost(0.0), |row: &Row| {
        row.over_memory.into()
    })
    .because("1 GiB to read it, 2 GiB to read and render it: grids that a sidecar asks for may have 512 MiB")
    .in_every_form(),
    Criterion::each("no file takes more than its time", Bound::AtMost(0.0), |row: &Row| {
        row.over_time.into()
    })
    .because("20 s to read it, 3 minutes for a step, kernels compiled: an end that a loaded machine does not reach")
    .in_every_form(),
    Criterion::all("files that were read", Bound::AtLeast(1e6), |rows| {
        sum(rows, |row| row.inputs)
    }),
    Criterion::all("accepted files that went through a step", Bound::AtLeast(1e4), |rows| {
        sum(rows, |row| row.stepped)
    }),
];

impl Row {
    fn of(name: &str, OfReader { read, step }: &OfReader) -> Self {
        let both = |kind| read.found(kind) + step.found(kind);
        Self {
            reader: name.into(),
            inputs: read.inputs + step.inputs,
            accepted: read.accepted + step.accepted,
            stepped: step.accepted,
            panics: both(Kind::Panic),
            aborts: both(Kind::Abort),
            over_memory: both(Kind::Memory),
            over_time: both(Kind::Time),
            seconds: read.seconds,
            rate: if read.seconds > 0.0 {
                read.inputs as f64 / read.seconds
            } else {
                0.0
            },
            peak: read.peak as f64 / MEBIBYTE,
            slowest: read.slowest,
            step_seconds: step.seconds,
            step_peak: step.peak as f64 / MEBIBYTE,
            step_slowest: step.slowest,
        }
    }
}

/// Reads files in this process.
fn here(reader: &Reader, files: u32, folder: &Path) -> Result<Way> {
    let seeds = (reader.seeds)(folder)?;
    let mut way = Way {
        next: files,
        inputs: files.into(),
        ..Way::default()
    };
    let begun = Instant::now();
    for number in 0..files {
        let case = mutated(&seeds, reader.words, Stream::new(SEED, reader.name, number));
        let start = Instant::now();
        match attempt(reader, &case, None, folder) {
            Ok(is_accepted) => way.accepted += u64::from(is_accepted),
            Err((kind, _)) => *way.found.entry(kind).or_default() += 1,
        }
        let seconds = start.elapsed().as_secs_f64();
        way.slowest = way.slowest.max(seconds);
        if seconds > Limits::READ.seconds {
            *way.found.entry(Kind::Time).or_default() += 1;
        }
        for file in &case.files {
            // A case that was not written has none.
            let _ = std::fs::remove_file(folder.join(&file.name));
        }
    }
    way.seconds = begun.elapsed().as_secs_f64();
    Ok(way)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        if !context.smoke
            && let Some(totals) = Totals::read(Path::new(FOLDER))?
        {
            return Ok(totals
                .readers
                .iter()
                .map(|(name, reader)| Row::of(name, reader))
                .collect());
        }
        let readers: Vec<&Reader> = READERS.iter().filter(|reader| !reader.is_on_device()).collect();
        let folder = context.file("files")?;
        std::fs::create_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
        let files = context.pick(1000, 40);
        let rows = context.each(
            &readers,
            |reader| reader.name.to_owned(),
            |reader| {
                let read = here(reader, files, &folder)?;
                let all = OfReader {
                    read,
                    ..OfReader::default()
                };
                Ok(vec![Row::of(reader.name, &all)])
            },
        );
        // What stays are a few small files.
        let _ = std::fs::remove_dir_all(&folder);
        rows
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline(
                "damaged files that broke something",
                total(self, |_| true, |row| {
                    row.panics + row.aborts + row.over_memory + row.over_time
                }),
            )
            .note(
                "Files are sound ones of a few kilobytes with one to eight damages: bits, bytes, blocks, chunks, lengths, numbers, words of the \
                 formats, parts of other files; half of them have sums that fit again. Each is read in a process that has bounded memory; a step \
                 renders a sample of 12 × 8 pixels. Accepted are files that the reader takes. Memory is what the process has most beyond what it \
                 had, where a file raises it: that of the hungriest is exact. Pipeline caches are read with a device alone.",
            )
    }
}
