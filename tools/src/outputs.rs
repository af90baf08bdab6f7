//! The one door for what commands write: a plan of all files, checked before the work begins, and their writing, which loses nothing.
//!
//! Guarantees: a file that the command reads is never written; a file that this program did not write, or that is write-protected, is replaced with
//! `--overwrite` alone. The same holds for what came to the place while the command worked, and for better pictures: the new files are written
//! beside them then. What cannot be written at its place in the end goes to the system's temporary folder, which is an error that says where.

mod checks;
mod folder;
mod lock;
mod page;
mod repeated;

pub use checks::{Inputs, check_folder};
pub use folder::{NamedFile, OutputFolder};
pub use page::OutputPage;
pub use repeated::Repeated;

use std::fs::DirBuilder;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;
use clerestory::{Error, Result, atomic};

use self::checks::{check_old, is_ours, probe, refuse_input, refuse_one_twice};
use self::lock::Lock;
use crate::failure::{Code, Failure, Outcome};
use crate::output;

/// An option of every command that writes.
#[derive(Debug, Clone, Copy, Args)]
pub struct Overwriting {
    /// Replaces files that this program did not write, too, and better pictures; never a file that the command reads
    #[arg(long)]
    pub overwrite: bool,
}

/// Files that are written together.
#[derive(Debug)]
pub struct Outputs {
    files: Vec<Planned>,
    overwrite: bool,
}

#[derive(Debug)]
struct Planned {
    path: PathBuf,
    /// What was there when the plan was made.
    seen: Option<Seen>,
}

/// By what a file is known to be the one that was there before: its size, and the time of its last change.
type Seen = (u64, Option<SystemTime>);

/// A file to write.
#[derive(Debug, Clone, Copy)]
struct New<'a> {
    path: &'a Path,
    bytes: &'a [u8],
}

/// What became of files.
#[derive(Debug, Default)]
pub struct Written {
    /// Where they are now; none where they could not be written anywhere.
    pub paths: Vec<PathBuf>,
    /// Why they are not where they should be.
    pub failure: Option<Failure>,
}

impl Written {
    /// All names, for a message.
    pub fn names(&self) -> String {
        let names: Vec<String> = self.paths.iter().map(|path| path.display().to_string()).collect();
        if names.is_empty() {
            "nothing".into()
        } else {
            names.join(", ")
        }
    }

    /// Fails where the files are not where they should be.
    pub fn check(self) -> Outcome {
        self.failure.map_or(Ok(()), Err)
    }

    /// As [`Written::check`], of several; the first failure counts, the others are said.
    pub fn check_all(all: impl IntoIterator<Item = Self>) -> Outcome {
        let mut failures = all.into_iter().filter_map(|written| written.failure);
        let first = failures.next();
        failures.for_each(|failure| failure.report());
        first.map_or(Ok(()), Err)
    }
}

impl Outputs {
    /// Checks that all the files can be written, and may be. Nothing on the disk changes; missing folders are made, and said, when files are written.
    ///
    /// What has no mark of its own (`.md`, `.csv`, `.svg`, further `.json`) is this program's where the first JSON file among the same files is.
    pub fn plan<P: AsRef<Path>>(paths: &[P], inputs: &Inputs, overwrite: bool) -> Outcome<Self> {
        let paths: Vec<&Path> = paths.iter().map(AsRef::as_ref).collect();
        Self::plan_known(&paths, inputs, overwrite, |path| is_ours(path, &paths))
    }

    /// As [`Outputs::plan`], of files all of which are known to be this program's.
    pub fn of_ours(paths: &[PathBuf], inputs: &Inputs, overwrite: bool) -> Outcome<Self> {
        let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
        Self::plan_known(&paths, inputs, overwrite, |_| Ok(true))
    }

    fn plan_known(
        paths: &[&Path],
        inputs: &Inputs,
        overwrite: bool,
        is_ours: impl Fn(&Path) -> Result<bool>,
    ) -> Outcome<Self> {
        for path in paths {
            refuse_input(path, inputs)?;
        }
        refuse_one_twice(paths)?;
        let files = paths.iter().map(|path| Planned::now(path)).collect();
        for path in paths {
            check_old(path, overwrite, || is_ours(path))?;
        }
        for path in paths {
            probe(path)?;
        }
        Ok(Self { files, overwrite })
    }

    /// As [`Outputs::plan`], of one file.
    pub fn one(path: &Path, inputs: &Inputs, overwrite: bool) -> Outcome<Self> {
        Self::plan(&[path], inputs, overwrite)
    }

    /// Writes the files, each as a whole or not at all, in the order of the plan. `better` says why what is there is worth more than what comes.
    pub fn write(&self, contents: &[Vec<u8>], better: impl FnOnce() -> Option<String>) -> Written {
        let files = self.files.iter().zip(contents);
        let files: Vec<New> = files
            .map(|(file, bytes)| New {
                path: &file.path,
                bytes,
            })
            .collect();
        self.write_files(&files, better)
    }

    /// As [`Outputs::write`], of some of the files and of others beside them.
    fn write_files(&self, files: &[New], better: impl FnOnce() -> Option<String>) -> Written {
        self.write_in_place(files, better)
            .unwrap_or_else(|cause| write_aside(files, &cause))
    }

    fn write_in_place(&self, files: &[New], better: impl FnOnce() -> Option<String>) -> Result<Written> {
        let Some(first) = files.first() else {
            return Ok(Written::default());
        };
        for file in files {
            make_folder_of(file.path)?;
        }
        // Of several processes with the same output each sees what those before it wrote.
        let _lock = Lock::of(first.path).map_err(|cause| Error::io(first.path, cause))?;
        if !self.overwrite
            && let Some(reason) = self.changed(files).or_else(better)
        {
            let paths = write_beside(files)?;
            output::warn(&format!("{reason}; written beside it instead, --overwrite replaces it"));
            return Ok(Written { paths, failure: None });
        }
        for file in files {
            atomic::write(file.path, file.bytes)?;
        }
        let paths = files.iter().map(|file| file.path.to_owned()).collect();
        Ok(Written { paths, failure: None })
    }

    /// A file that was written by somebody else since the plan was made; what the plan does not name was not there.
    fn changed(&self, files: &[New]) -> Option<String> {
        let before = |path: &Path| self.files.iter().find(|file| file.path == path)?.seen;
        let changed = |file: &&New| {
            let now = seen(file.path);
            now.is_some() && now != before(file.path)
        };
        let file = files.iter().find(changed)?;
        Some(format!("{} has changed since this command began", file.path.display()))
    }
}

impl Planned {
    fn now(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            seen: seen(path),
        }
    }
}

/// Writes all files by names that are free: `NAME-2.exr` and so on, the same number for all.
fn write_beside(files: &[New]) -> Result<Vec<PathBuf>> {
    const NUMBERS: std::ops::Range<u32> = 2..10_000;
    for number in NUMBERS {
        let paths: Vec<PathBuf> = files.iter().map(|file| numbered(file.path, number)).collect();
        if paths.iter().any(|path| path.symlink_metadata().is_ok()) {
            continue;
        }
        for (path, file) in paths.iter().zip(files) {
            atomic::write_new(path, file.bytes)?;
        }
        return Ok(paths);
    }
    let cause = io::Error::new(ErrorKind::AlreadyExists, "has no free name beside it");
    Err(Error::io(files[0].path, cause))
}

/// Writes all files to a new folder of the system's folder for temporary files; the failure says why, and where.
fn write_aside(files: &[New], cause: &Error) -> Written {
    let folder = std::env::temp_dir().join(format!("clerestory-{:016x}", atomic::random()));
    let mut paths = Vec::new();
    let mut write = || -> Result<()> {
        private_folder(&folder).map_err(|cause| Error::io(&folder, cause))?;
        for file in files {
            let path = folder.join(file.path.file_name().unwrap_or_default());
            atomic::write_new(&path, file.bytes)?;
            paths.push(path);
        }
        Ok(())
    };
    let written = write();
    let hint = match written {
        Ok(()) => format!("what was to be written is kept in {}", folder.display()),
        Err(second) if paths.is_empty() => {
            // It is empty, or was not made.
            let _ = std::fs::remove_dir(&folder);
            format!("nor could it be kept elsewhere: {second}")
        }
        // The first of them is the picture with all that is known, which is worth more than what goes with it.
        Err(second) => format!(
            "{} of {} files are kept in {}; the others could not be: {second}",
            paths.len(),
            files.len(),
            folder.display()
        ),
    };
    let failure = Failure {
        code: Code::Run,
        message: cause.to_string(),
        hint: Some(hint),
    };
    Written {
        paths,
        failure: Some(failure),
    }
}

fn seen(path: &Path) -> Option<Seen> {
    let found = std::fs::metadata(path).ok()?;
    Some((found.len(), found.modified().ok()))
}

/// Makes the folder of a file where there is none, and says so: a slip of the pen is not to go unseen.
fn make_folder_of(path: &Path) -> Result<()> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            std::fs::create_dir_all(folder).map_err(|cause| Error::io(folder, cause))?;
            output::note(&format!("made folder {}", folder.display()));
            Ok(())
        }
        _ => Ok(()),
    }
}

/// `NAME-2.exr` for `NAME.exr`.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Makes a folder that must not be there, which nobody else may enter.
fn private_folder(path: &Path) -> io::Result<()> {
    let mut builder = DirBuilder::new();
    close_to_others(&mut builder);
    builder.create(path)
}

#[cfg(unix)]
fn close_to_others(builder: &mut DirBuilder) {
    use std::os::unix::fs::DirBuilderExt;
    builder.mode(0o700);
}

#[cfg(not(unix))]
fn close_to_others(_: &mut DirBuilder) {}

#[cfg(test)]
mod tests {
    use super::*;
    use clerestory::film::{Picture, exr};

    pub(super) type Tested = std::result::Result<(), Box<dyn std::error::Error>>;

    pub(super) fn said<T>(outcome: Outcome<T>) -> (Option<Code>, String) {
        match outcome {
            Ok(_) => (None, String::new()),
            Err(failure) => (Some(failure.code), failure.message),
        }
    }

    fn never() -> Option<String> {
        None
    }

    pub(super) fn mine(value: f32) -> std::result::Result<Vec<u8>, Error> {
        exr::to_bytes(&Picture::from_radiance(1, 1, vec![value; 3])?, "a picture")
    }

    #[test]
    fn what_has_no_mark_is_ours_where_the_report_is() -> Tested {
        let folder = tempfile::tempdir()?;
        let names = ["report.json", "rows.json", "1.csv"];
        let plan = || {
            OutputFolder::plan(
                folder.path(),
                &names,
                &Inputs::default(),
                Overwriting { overwrite: false },
            )
        };
        for name in &names[1..] {
            std::fs::write(folder.path().join(name), "[1, 2]")?;
            assert_eq!(said(plan()).0, Some(Code::Usage), "{name}");
            std::fs::remove_file(folder.path().join(name))?;
        }
        std::fs::write(folder.path().join(names[0]), "{\"verdicts\": [], \"tables\": []}")?;
        for name in &names[1..] {
            std::fs::write(folder.path().join(name), "[1, 2]")?;
        }
        let planned = plan().map_err(|failure| failure.message)?;
        // One that is not in the plan came meanwhile.
        std::fs::write(folder.path().join("2.csv"), "somebody's")?;
        let files = ["report.json", "2.csv"].map(|name| NamedFile::new(name, "{}"));
        let written = planned.write(&files);
        assert_eq!(
            written.paths,
            ["report-2.json", "2-2.csv"].map(|name| folder.path().join(name))
        );
        assert_eq!(std::fs::read(folder.path().join("2.csv"))?, b"somebody's");
        Ok(())
    }

    #[test]
    fn pages_are_inputs_that_no_other_file_may_replace() -> Tested {
        let folder = tempfile::tempdir()?;
        let page = folder.path().join("index.md");
        for there in [false, true] {
            let mut inputs = Inputs::default();
            let plan = OutputPage::plan(Some(&page), &mut inputs, Overwriting { overwrite: there });
            let plan = plan.map_err(|failure| failure.message)?.ok_or("no page")?;
            let (code, message) = said(Outputs::one(&folder.path().join("./index.md"), &inputs, true));
            assert!(code == Some(Code::Usage) && message.contains("reads it"), "{message}");
            let block = clerestory_tools::page::Block {
                name: "one",
                command: "test",
            };
            assert!(plan.write(block, "measured").check().is_ok());
            std::fs::write(&page, std::fs::read_to_string(&page)? + "words\n")?;
        }
        let text = std::fs::read_to_string(&page)?;
        assert_eq!(
            (text.matches("measured").count(), text.matches("words\n").count()),
            (1, 2)
        );
        let mut permissions = page.metadata()?.permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&page, permissions)?;
        let plan = |overwrite| OutputPage::plan(Some(&page), &mut Inputs::default(), Overwriting { overwrite });
        let (code, message) = said(plan(false));
        assert!(
            code == Some(Code::Usage) && message.contains("write-protected"),
            "{message}"
        );
        assert!(plan(true).is_ok());
        Ok(())
    }

    #[test]
    fn of_two_that_write_one_output_neither_loses_anything() -> Tested {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.exr");
        std::fs::write(&path, mine(0.0)?)?;
        let threads = 8;
        let plans: Vec<Outputs> = (0..threads)
            .map(|_| Outputs::one(&path, &Inputs::default(), false))
            .collect::<Outcome<_>>()
            .map_err(|failure| failure.message)?;
        // Sizes differ, so that the files do whatever the clock of the file system can tell apart.
        let contents: Vec<Vec<u8>> = (1..=threads).map(|count| vec![b'x'; count]).collect();
        let places: Vec<PathBuf> = std::thread::scope(|scope| {
            let write = |(plan, content): (&Outputs, &Vec<u8>)| plan.write(std::slice::from_ref(content), never);
            let running: Vec<_> = plans
                .iter()
                .zip(&contents)
                .map(|one| scope.spawn(move || write(one)))
                .collect();
            running
                .into_iter()
                .flat_map(|one| one.join().expect("no panic").paths)
                .collect()
        });
        assert_eq!(places.len(), threads);
        for (place, content) in places.iter().zip(&contents) {
            assert_eq!(&std::fs::read(place)?, content, "{}", place.display());
        }
        assert_eq!(places.iter().filter(|place| **place == path).count(), 1);
        // No lock and no temporary file stays.
        assert_eq!(std::fs::read_dir(folder.path())?.count(), threads);
        Ok(())
    }

    #[test]
    fn better_files_stay_unless_they_are_to_be_overwritten() -> Tested {
        let folder = tempfile::tempdir()?;
        let paths = [folder.path().join("a.exr"), folder.path().join("a.json")];
        std::fs::write(&paths[0], mine(1.0)?)?;
        let before = std::fs::read(&paths[0])?;
        let write = |overwrite, better: Option<&str>| {
            let plan = Outputs::plan(&paths, &Inputs::default(), overwrite).map_err(|failure| failure.message)?;
            Ok::<_, String>(plan.write(&[mine(2.0).unwrap_or_default(), b"{}".to_vec()], || {
                better.map(str::to_owned)
            }))
        };
        let beside = write(false, Some("it is better"))?;
        assert_eq!(
            beside.paths,
            ["a-2.exr", "a-2.json"].map(|name| folder.path().join(name))
        );
        assert!(beside.failure.is_none() && std::fs::read(&paths[0])? == before && !paths[1].exists());
        assert_eq!(write(false, Some("it is better"))?.names().matches("a-3").count(), 2);
        assert_eq!(write(true, Some("it is better"))?.paths, paths);
        assert_ne!(std::fs::read(&paths[0])?, before);
        Ok(())
    }

    #[test]
    fn what_has_no_place_goes_to_the_temporary_folder() -> Tested {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("new/a.exr");
        let plan = Outputs::one(&path, &Inputs::default(), false).map_err(|failure| failure.message)?;
        std::fs::write(folder.path().join("new"), "a file in place of the folder")?;
        let written = plan.write(&[mine(1.0)?], never);
        let failure = written.failure.as_ref().ok_or("no failure")?;
        let kept = written.paths.first().ok_or("no file")?;
        let hint = failure.hint.clone().unwrap_or_default();
        let inside = kept.parent().ok_or("no folder")?;
        assert_eq!((failure.code, std::fs::read(kept)?), (Code::Run, mine(1.0)?));
        assert!(hint.contains(&inside.display().to_string()), "{hint}");
        std::fs::remove_dir_all(inside)?;
        Ok(())
    }

    #[test]
    fn what_can_be_kept_elsewhere_is_kept_if_the_rest_cannot_be() -> Tested {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        // Files of one name, of which a folder has one.
        let paths = [at("new/a.exr"), at("other/a.exr")];
        let plan = Outputs::plan(&paths, &Inputs::default(), false).map_err(|failure| failure.message)?;
        std::fs::write(at("new"), "a file in place of the folder")?;
        let written = plan.write(&[mine(1.0)?, mine(2.0)?], never);
        let failure = written.failure.as_ref().ok_or("no failure")?;
        let hint = failure.hint.clone().unwrap_or_default();
        assert!(failure.code == Code::Run && hint.contains("1 of 2 files"), "{hint}");
        let kept = written.paths.first().ok_or("no file")?;
        assert_eq!((written.paths.len(), std::fs::read(kept)?), (1, mine(1.0)?));
        std::fs::remove_dir_all(kept.parent().ok_or("no folder")?)?;
        Ok(())
    }
}
