//! The files of a rendering: picture, picture to look at, report.

use std::path::{Path, PathBuf};

use clerestory::film::picture::RADIANCE;
use clerestory::film::{ErrorReport, Picture, ToneMap, exr, png};
use clerestory::input::read_file;
use clerestory::render::FrameReport;

use super::choice::ChoiceReport;
use crate::failure::{Failure, Outcome};
use crate::outputs::{Outputs, Written};
use crate::{output, pictures};

/// Most bytes of a report that is looked at. A longer one counts as better, as whatever cannot be read does.
const MOST_REPORT: u64 = 1 << 28;

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

    /// All of them, in the order of their writing.
    pub fn all(&self) -> Vec<&Path> {
        let all = self.exr.iter().chain([&self.png, &self.json]);
        all.map(PathBuf::as_path).collect()
    }

    /// Writes all files, as their plan says; the EXR gets radiance and the named layers.
    pub fn write(
        &self,
        outputs: &Outputs,
        picture: &Picture,
        layers: &[&str],
        document: &Document<'_>,
    ) -> Outcome<Written> {
        let mut contents = Vec::new();
        if let Some(path) = &self.exr {
            let mut chosen = Picture::new(picture.width(), picture.height())?;
            chosen.metadata = picture.metadata.clone();
            let kept = |name: &str| name == RADIANCE || layers.contains(&name);
            for layer in picture.layers().iter().filter(|layer| kept(layer.name())) {
                chosen.add_layer(layer.name(), layer.channels(), layer.values().to_vec())?;
            }
            contents.push(exr::to_bytes(&chosen, &path.display().to_string())?);
        }
        let shown = png::tone_mapped(picture.main_layer()?, picture.width(), &document.tone);
        contents.push(png::to_bytes(&shown, &self.png.display().to_string())?);
        let text = output::json_text(&self.json.display().to_string(), document)? + "\n";
        contents.push(text.into_bytes());
        let better = || {
            let there = document.interrupted && self.all().iter().any(|path| path.exists());
            there.then(|| self.better_than(&Facts::of(document.report))).flatten()
        };
        Ok(outputs.write(&contents, better))
    }

    /// Why the picture that is there is worth more than one of these facts.
    fn better_than(&self, new: &Facts) -> Option<String> {
        let exr = self.exr.as_ref().filter(|path| path.exists()).map(|path| {
            let picture = exr::read(path).ok();
            (path, picture.and_then(|picture| Facts::of_picture(&picture)))
        });
        // The report may be of a later picture, which was written without an EXR.
        let report = (exr.is_none() || self.json.exists()).then(|| {
            let text = read_file(&self.json, MOST_REPORT).ok();
            (&self.png, text.and_then(|text| Facts::of_json(&text)))
        });
        let mut old = exr.into_iter().chain(report);
        old.find_map(|(path, old)| Self::better_old(path, old, new))
    }

    /// Why an old picture, by what is known of it, is worth more than a new one.
    fn better_old(path: &Path, old: Option<Facts>, new: &Facts) -> Option<String> {
        let name = path.display();
        match old {
            None => Some(format!("{name} may be better: it does not say how many samples it has")),
            Some(old) if !old.same_picture(new) => Some(format!("{name} is another picture")),
            Some(old) if old.samples > new.samples => Some(format!(
                "{name} has {} samples per pixel, the interrupted picture {}",
                old.samples, new.samples
            )),
            Some(_) => None,
        }
    }
}

/// What a picture is judged by against an older one.
#[derive(Debug, PartialEq, Eq)]
struct Facts {
    scene: String,
    camera: String,
    technique: String,
    path_set: String,
    size: [u64; 2],
    /// Samples per pixel: the fewest of a new picture, the most of an old one.
    samples: u64,
}

impl Facts {
    fn of(report: &FrameReport) -> Self {
        Self {
            scene: report.scene.clone(),
            camera: report.camera.clone(),
            technique: report.technique.clone(),
            path_set: report.path_set.clone(),
            size: report.size.map(u64::from),
            samples: report.samples[0].into(),
        }
    }

    /// Of what an EXR says; `None` where it leaves something out.
    fn of_picture(picture: &Picture) -> Option<Self> {
        let metadata = &picture.metadata;
        Some(Self {
            scene: metadata.scene.clone()?,
            camera: metadata.other.get("camera").cloned()?,
            technique: metadata.technique.clone()?,
            path_set: metadata.path_set.clone()?,
            size: [picture.width(), picture.height()].map(u64::from),
            samples: metadata.spp?,
        })
    }

    /// Of what the report beside a PNG says.
    fn of_json(text: &[u8]) -> Option<Self> {
        let report: serde_json::Value = serde_json::from_slice(text).ok()?;
        let word = |key: &str| report[key].as_str().map(str::to_owned);
        Some(Self {
            scene: word("scene")?,
            camera: word("camera")?,
            technique: word("technique")?,
            path_set: word("path_set")?,
            size: [report["size"][0].as_u64()?, report["size"][1].as_u64()?],
            samples: report["samples"][1].as_u64()?,
        })
    }

    fn same_picture(&self, other: &Self) -> bool {
        (&self.scene, &self.camera, &self.technique) == (&other.scene, &other.camera, &other.technique)
            && (&self.path_set, self.size) == (&other.path_set, other.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_follow_the_output_as_given() -> Outcome {
        let names = |wanted: Option<&str>, scene| {
            Files::choose(wanted.map(Path::new), scene).map(|files| {
                let names: Vec<String> = files.all().iter().map(|path| path.display().to_string()).collect();
                names.join(", ")
            })
        };
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

    fn facts(samples: u64) -> Facts {
        Facts {
            scene: "builtin:ring".into(),
            camera: "main".into(),
            technique: "path".into(),
            path_set: "all".into(),
            size: [1, 1],
            samples,
        }
    }

    #[test]
    fn better_is_what_has_more_samples_or_cannot_be_read_or_compared() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.exr");
        let files = Files::choose(Some(path.as_path()), "ring").map_err(|failure| failure.message)?;
        let reason = |new: Facts| files.better_than(&new).unwrap_or_default();
        let mut old = Picture::from_radiance(1, 1, vec![0.5; 3])?;
        let metadata = &mut old.metadata;
        metadata.scene = Some("builtin:ring".into());
        metadata.other.insert("camera".into(), "main".into());
        (metadata.technique, metadata.path_set) = (Some("path".into()), Some("all".into()));
        exr::write(&path, &old)?;
        assert!(reason(facts(1000)).contains("does not say how many samples"));
        old.metadata.spp = Some(16);
        exr::write(&path, &old)?;
        assert!(reason(facts(15)).contains("16 samples per pixel"));
        assert_eq!((reason(facts(16)), reason(facts(17))), (String::new(), String::new()));
        let larger = Facts {
            size: [2, 1],
            ..facts(17)
        };
        assert!(reason(larger).contains("another picture"));
        std::fs::write(&path, b"no picture")?;
        assert!(reason(facts(1000)).contains("does not say how many samples"));
        // Without an EXR the report counts.
        std::fs::remove_file(&path)?;
        let report = |samples: [u64; 2]| {
            serde_json::json!({
                "scene": "builtin:ring", "camera": "main", "technique": "path", "path_set": "all", "size": [1, 1], "samples": samples,
            })
            .to_string()
        };
        std::fs::write(path.with_extension("json"), report([3, 4]))?;
        assert!(reason(facts(3)).contains("4 samples per pixel") && reason(facts(4)).is_empty());
        // Beside an EXR it may be that of a better PNG.
        exr::write(&path, &old)?;
        assert!(reason(facts(16)).is_empty());
        std::fs::write(path.with_extension("json"), report([1000, 1000]))?;
        assert!(reason(facts(16)).contains("a.png has 1000 samples per pixel"));
        Ok(())
    }
}
