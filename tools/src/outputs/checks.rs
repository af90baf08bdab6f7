//! What is checked before the work begins: whether files may be written, and can be.

use std::io::Read;
use std::path::{Component, Path, PathBuf};

use clerestory::film::mark;
use clerestory::input::{InputFile, open_regular};
use clerestory::scene::builtin;
use clerestory::{Error, Result, atomic};
use serde_json::Value;

use crate::failure::{Failure, Outcome};
use crate::pictures;

/// The files that a command reads.
#[derive(Debug, Default)]
pub struct Inputs(Vec<PathBuf>);

impl Inputs {
    /// These files.
    pub fn of<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Self {
        let mut inputs = Self::default();
        for path in paths {
            inputs.add(path);
        }
        inputs
    }

    /// Another file; one that is not there cannot be overwritten.
    pub fn add(&mut self, path: impl AsRef<Path>) {
        self.0.extend(path.as_ref().canonicalize());
    }

    /// A scene's file, and the sidecar beside it.
    pub fn add_address(&mut self, address: &str) {
        if !address.starts_with(builtin::PREFIX) {
            self.add(address);
            self.add(Path::new(address).with_extension("scene.toml"));
        }
    }

    /// As [`Inputs::add_address`], with all files that the scene was read from.
    pub fn add_scene(&mut self, address: &str, files: &[InputFile]) {
        self.add_address(address);
        for file in files {
            self.add(&file.path);
        }
    }

    /// A file that is read and written, whether it is there or not: no other output may take its place.
    pub(super) fn add_place(&mut self, path: &Path) {
        self.0.push(place(path));
    }

    fn hold(&self, path: &Path) -> bool {
        self.0.contains(&place(path))
    }
}

/// Checks a folder of a command's own, which gets files of many names: it can be written to, and no file that the command reads lies in it.
pub fn check_folder(folder: &Path, inputs: &Inputs) -> Outcome {
    if let Ok(folder) = folder.canonicalize()
        && let Some(inside) = inputs.0.iter().find(|input| input.starts_with(&folder))
    {
        let message = format!("{} lies in the folder that this command writes to", inside.display());
        return Err(Failure::usage(message).hint("name another folder"));
    }
    probe(&folder.join(".clerestory"))
}

pub(super) fn refuse_input(path: &Path, inputs: &Inputs) -> Outcome {
    if inputs.hold(path) {
        let message = format!("{}: this command reads it, so it will not write it", path.display());
        return Err(
            Failure::usage(message).hint("name another output; a .exr picture takes .png and .json beside it, too")
        );
    }
    Ok(())
}

/// Refuses outputs that links lead to one file: the second would take the first one's place.
pub(super) fn refuse_one_twice(paths: &[&Path]) -> Outcome {
    let places: Vec<PathBuf> = paths.iter().map(|path| place(path)).collect();
    for (later, place) in places.iter().enumerate() {
        if let Some(earlier) = places[..later].iter().position(|other| other == place) {
            let [one, other] = [earlier, later].map(|index| paths[index].display().to_string());
            return Err(
                Failure::usage(format!("{one} and {other} are one file, and both would be written"))
                    .hint("remove the link, or name another output"),
            );
        }
    }
    Ok(())
}

/// Where a file would be written: behind its links, and in its folder without any. Folders that are not there yet have none.
fn place(path: &Path) -> PathBuf {
    let end = atomic::end_of_links(path).unwrap_or_else(|_| path.to_owned());
    for there in end.ancestors() {
        let (Ok(mut place), Ok(rest)) = (named(there).canonicalize(), end.strip_prefix(there)) else {
            continue;
        };
        let mut went_up = false;
        for part in rest.components() {
            if part == Component::ParentDir {
                went_up = true;
                place.pop();
            } else {
                place.push(part);
            }
        }
        // Above what is not there yet may be links again.
        return if went_up { self::place(&place) } else { place };
    }
    end
}

/// A folder by a name that is not empty.
fn named(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    }
}

/// Refuses to replace what is no file, or should not be replaced unasked.
pub(super) fn check_old(path: &Path, overwrite: bool, is_ours: impl FnOnce() -> Result<bool>) -> Outcome {
    // What cannot be looked at is found out by writing beside it.
    let Ok(found) = std::fs::metadata(path) else {
        return Ok(());
    };
    if !found.is_file() {
        let what = if found.is_dir() {
            "a folder"
        } else {
            "not a regular file"
        };
        return Err(
            Failure::usage(format!("{}: is {what}, and would have to be replaced", path.display()))
                .hint("name another output; a .exr picture takes .png and .json beside it, too"),
        );
    }
    let cause = if overwrite {
        return Ok(());
    } else if found.permissions().readonly() {
        "is write-protected"
    } else if !is_ours()? {
        "is there, and this program did not write it"
    } else {
        return Ok(());
    };
    Err(Failure::usage(format!("{} {cause}", path.display()))
        .hint("name another output, or add --overwrite to replace it"))
}

pub(super) fn is_ours(path: &Path, all: &[&Path]) -> Result<bool> {
    match pictures::extension(path).as_str() {
        "exr" | "hdr" | "png" => mark::is_marked(path),
        _ => match all.iter().find(|other| pictures::extension(other) == "json") {
            Some(report) if report.is_file() => json_is_ours(report),
            _ => Ok(false),
        },
    }
}

/// Reports of this program name its version, the device and the driver; those of experiments hold verdicts.
fn json_is_ours(path: &Path) -> Result<bool> {
    const MOST_BYTES: u64 = 1 << 28;
    let mut bytes = Vec::new();
    let read = open_regular(path, u64::MAX).and_then(|(file, _)| file.take(MOST_BYTES).read_to_end(&mut bytes));
    read.map_err(|cause| Error::io(path, cause))?;
    let Ok(document) = serde_json::from_slice::<Value>(&bytes) else {
        return Ok(false);
    };
    let has = |pointers: &[&str]| {
        let mut values = pointers.iter().map(|pointer| document.pointer(pointer));
        values.all(|value| value.is_some_and(Value::is_string))
    };
    let of_experiment =
        document["verdicts"].is_array() && (document["tables"].is_array() || document["results"].is_object());
    Ok(of_experiment
        || has(&["/engine_version", "/device", "/driver"])
        || has(&["/machine/device", "/machine/driver", "/machine/mitsuba"]))
}

/// Finds out whether a file can be written, or a folder be made for it in the nearest one that is there.
pub(super) fn probe(path: &Path) -> Outcome {
    let mut above = path.ancestors().skip(1).map(named);
    let nearest = above.find(|folder| folder.symlink_metadata().is_ok());
    let probed = match nearest {
        Some(folder) if path.parent().map(named) != Some(folder) => atomic::probe(&folder.join(".clerestory")),
        _ => atomic::probe(path),
    };
    probed.map_err(|error| match error {
        Error::Io { source, .. } => Error::io(path, source).into(),
        other => other.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::Outputs;
    use super::super::tests::{Tested, mine, said};
    use super::*;
    use crate::failure::Code;

    #[test]
    fn plans_refuse_inputs_foreign_files_and_folders() -> Tested {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        let (input, ours, foreign) = (at("input.exr"), at("ours.exr"), at("foreign.exr"));
        std::fs::write(&input, mine(1.0)?)?;
        std::fs::write(&ours, mine(2.0)?)?;
        std::fs::write(&foreign, b"somebody else's")?;
        std::fs::create_dir(at("folder.json"))?;
        let inputs = Inputs::of([&input]);
        let usage = |path: &Path, overwrite, word: &str| {
            let (code, message) = said(Outputs::one(path, &inputs, overwrite));
            assert!(
                code == Some(Code::Usage) && message.contains(word),
                "{}: {message}",
                path.display()
            );
        };
        for overwrite in [false, true] {
            usage(&input, overwrite, "reads it");
            usage(&at("./folder.json/../input.exr"), overwrite, "reads it");
            usage(&at("folder.json"), overwrite, "is a folder");
        }
        usage(&foreign, false, "did not write it");
        assert!(Outputs::one(&foreign, &inputs, true).is_ok());
        let both = [at("new/a.exr"), foreign.clone()];
        assert_eq!(said(Outputs::plan(&both, &inputs, false)).0, Some(Code::Usage));
        assert!(Outputs::one(&ours, &inputs, false).is_ok() && Outputs::one(&at("new/a.exr"), &inputs, false).is_ok());
        // Plans leave nothing.
        assert_eq!(std::fs::read_dir(folder.path())?.count(), 4);
        // A folder that cannot be made, since a file stands there.
        let (code, _) = said(Outputs::one(&at("ours.exr/a.exr"), &inputs, false));
        assert_eq!(code, Some(Code::Run));
        let mut protected = ours.metadata()?.permissions();
        protected.set_readonly(true);
        std::fs::set_permissions(&ours, protected)?;
        usage(&ours, false, "write-protected");
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_an_input_is_the_input() -> Tested {
        let folder = tempfile::tempdir()?;
        let (input, link) = (folder.path().join("input.exr"), folder.path().join("link.exr"));
        std::fs::write(&input, mine(1.0)?)?;
        std::os::unix::fs::symlink("input.exr", &link)?;
        for (read, written) in [(&input, &link), (&link, &input)] {
            let (code, message) = said(Outputs::one(written, &Inputs::of([read]), true));
            assert!(code == Some(Code::Usage) && message.contains("reads it"), "{message}");
        }
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    fn outputs_that_are_one_file_by_links_are_refused() -> Tested {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        std::os::unix::fs::symlink("a.exr", at("a.png"))?;
        let paths = [at("a.exr"), at("a.png")];
        // Before there is a file, and with one.
        for there in [false, true] {
            if there {
                std::fs::write(&paths[0], mine(1.0)?)?;
            }
            let (code, message) = said(Outputs::plan(&paths, &Inputs::default(), true));
            assert!(code == Some(Code::Usage) && message.contains("one file"), "{message}");
        }
        std::fs::create_dir(at("folder"))?;
        let same = [at("b.exr"), at("folder/../b.exr")];
        let (code, message) = said(Outputs::plan(&same, &Inputs::default(), true));
        assert!(code == Some(Code::Usage) && message.contains("one file"), "{message}");
        assert!(Outputs::plan(&[at("b.exr"), at("b.png")], &Inputs::default(), true).is_ok());
        Ok(())
    }

    #[test]
    fn reports_are_known_by_what_they_say() -> Tested {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        let package = "{\"name\": \"x\", \"version\": \"1.0\", \"device\": \"d\"}";
        let report = "{\"device\": \"d\", \"driver\": \"e\", \"engine_version\": \"0.1.0\", \"samples\": [1, 2]}";
        let agreement = "{\"machine\": {\"device\": \"d\", \"driver\": \"e\", \"mitsuba\": \"m\"}}";
        let experiment = "{\"headline\": null, \"verdicts\": [], \"tables\": []}";
        for (text, ours) in [
            (package, false),
            (report, true),
            (agreement, true),
            (experiment, true),
            ("[1]", false),
            ("", false),
        ] {
            let paths = [at("a.json"), at("a.csv")];
            std::fs::write(&paths[0], text)?;
            std::fs::write(&paths[1], "1,2\n")?;
            assert_eq!(Outputs::plan(&paths, &Inputs::default(), false).is_ok(), ours, "{text}");
            // A table without its report could be anybody's.
            assert!(Outputs::one(&paths[1], &Inputs::default(), false).is_err());
        }
        Ok(())
    }
}
