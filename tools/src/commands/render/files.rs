//! The files of a rendering: picture, picture to look at, report.

use std::path::{Path, PathBuf};

use clerestory::Error;
use clerestory::film::picture::RADIANCE;
use clerestory::film::{ErrorReport, Picture, ToneMap, atomic, exr, png};
use clerestory::render::FrameReport;

use super::choice::ChoiceReport;
use crate::failure::{Failure, Outcome};
use crate::{output, pictures};

/// The JSON file: the frame report with what the program adds.
#[derive(serde::Serialize)]
pub struct Document<'a> {
    /// How the picture came about.
    #[serde(flatten)]
    pub report: &'a FrameReport,
    /// True when Ctrl-C ended it.
    pub interrupted: bool,
    /// How the PNG was tone mapped.
    pub tone: ToneMap,
    /// What was asked for, predicted and reached, when technique and samples were chosen.
    pub choice: Option<ChoiceReport<'a>>,
    /// The error, when there was a reference.
    pub error: Option<ErrorAgainst>,
}

/// Error metrics with the reference that they were taken against.
#[derive(serde::Serialize)]
pub struct ErrorAgainst {
    /// The reference's file.
    pub reference: PathBuf,
    /// All metrics.
    #[serde(flatten)]
    pub metrics: ErrorReport,
}

/// Where everything goes.
#[derive(Debug, PartialEq, Eq)]
pub struct Files {
    exr: Option<PathBuf>,
    png: PathBuf,
    json: PathBuf,
}

impl Files {
    /// Whether one of the files is this one.
    pub fn write_over(&self, file: &Path) -> bool {
        let Ok(file) = file.canonicalize() else { return false };
        let own = [self.exr.as_ref(), Some(&self.png), Some(&self.json)];
        own.into_iter()
            .flatten()
            .any(|own| own.canonicalize().is_ok_and(|own| own == file))
    }

    /// From the output as given: a file `.exr` or `.png`, a folder, or nothing for `out/`.
    pub fn choose(wanted: Option<&Path>, scene_name: &str) -> Outcome<Self> {
        let name: String = scene_name
            .chars()
            .map(|c| if c.is_control() || "/\\:".contains(c) { '_' } else { c })
            .collect();
        let name = if name.is_empty() { "scene".into() } else { name } + ".exr";
        let file = match wanted {
            None => Path::new("out").join(name),
            Some(path) if path.is_dir() || path.as_os_str().to_string_lossy().ends_with('/') => path.join(name),
            Some(path) => path.to_owned(),
        };
        let with_exr = match pictures::extension(&file).as_str() {
            "exr" => true,
            "png" => false,
            _ => {
                return Err(
                    Failure::usage(format!("-o {}: pictures are written as .exr or .png", file.display()))
                        .hint("NAME.exr writes NAME.png and NAME.json too; a folder is named with a / at its end"),
                );
            }
        };
        Ok(Self {
            png: if with_exr {
                file.with_extension("png")
            } else {
                file.clone()
            },
            json: file.with_extension("json"),
            exr: with_exr.then_some(file),
        })
    }

    /// Makes the folder where there is none, and says so: a rendering is not to fail at its end, nor a slip of the pen to go unseen.
    pub fn prepare(&self) -> Outcome {
        match self.png.parent() {
            Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
                std::fs::create_dir_all(folder).map_err(|cause| Error::io(folder, cause))?;
                output::note(&format!("made folder {}", folder.display()));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Writes all files, each as a whole or not at all; the EXR gets radiance and the named layers.
    pub fn write(&self, picture: &Picture, layers: &[&str], document: &Document<'_>) -> Outcome {
        if let Some(path) = &self.exr {
            let mut chosen = Picture::new(picture.width(), picture.height())?;
            chosen.metadata = picture.metadata.clone();
            let kept = |name: &str| name == RADIANCE || layers.contains(&name);
            for layer in picture.layers().iter().filter(|layer| kept(layer.name())) {
                chosen.add_layer(layer.name(), layer.channels(), layer.values().to_vec())?;
            }
            exr::write(path, &chosen)?;
        }
        let shown = png::tone_mapped(picture.main_layer()?, picture.width(), &document.tone);
        png::write(&self.png, &shown)?;
        let text = output::json_text(&self.json.display().to_string(), document)? + "\n";
        Ok(atomic::write(&self.json, text.as_bytes())?)
    }

    /// All names, for a message.
    pub fn names(&self) -> String {
        let all = self.exr.iter().chain([&self.png, &self.json]);
        all.map(|path| path.display().to_string())
            .collect::<Vec<_>>()
            .join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_follow_the_output_as_given() -> Outcome {
        let names =
            |wanted: Option<&str>, scene| Files::choose(wanted.map(Path::new), scene).map(|files| files.names());
        assert_eq!(names(None, "ring")?, "out/ring.exr, out/ring.png, out/ring.json");
        assert_eq!(names(Some("a/b.exr"), "ring")?, "a/b.exr, a/b.png, a/b.json");
        assert_eq!(names(Some("b.PNG"), "ring")?, "b.PNG, b.json");
        assert_eq!(
            names(Some("new/"), "../x")?,
            "new/.._x.exr, new/.._x.png, new/.._x.json"
        );
        assert!(names(Some("b.jpg"), "ring").is_err() && names(Some("b"), "ring").is_err());
        Ok(())
    }
}
