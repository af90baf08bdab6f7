//! References: converged pictures that are rendered once and kept as EXR, with the variance of every value.
//!
//! A reference is known by a fingerprint of all that it depends on (scene content, camera, size, technique with its settings and path set, seed,
//! samples, engine version), which is part of its file's name, and by the fingerprints of its kernels, which stand in its metadata. The
//! device is not part of it: pictures by different devices differ by rounding, far below the noise.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clerestory::film::picture::{RADIANCE, SAMPLES, VARIANCE};
use clerestory::film::{Picture, exr};
use clerestory::render::Rendered;
use clerestory::{Error, Result};

use super::fingerprint::{self, Fingerprint};

/// Far from the seeds of measured pictures.
pub const SEED: u32 = 1_000_003;

const KERNELS: &str = "kernels";
/// Digits of the fingerprint in the file's name.
const DIGITS: usize = 16;

/// What a reference depends on besides its kernels.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Identity<'a> {
    /// Fingerprint of the scene's content.
    pub scene: &'a str,
    /// Camera by name; `None` for the first.
    pub camera: Option<&'a str>,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// The technique's id.
    pub technique: &'a str,
    /// All of its settings, path set included.
    pub settings: &'a serde_json::Value,
    /// Samples per pixel.
    pub spp: u32,
    /// Seed.
    pub seed: u32,
    /// The engine's version.
    pub engine: &'a str,
}

impl Identity<'_> {
    /// The fingerprint.
    ///
    /// # Errors
    /// [`Error::Io`] when it cannot be written as JSON.
    pub fn key(&self) -> Result<String> {
        let text = serde_json::to_vec(self).map_err(|cause| Error::io("reference", cause.into()))?;
        Ok(Fingerprint::of(&text))
    }

    /// The reference's file, with words of the scene's address in its name.
    ///
    /// # Errors
    /// As [`Identity::key`].
    pub fn path(&self, folder: &Path, address: &str) -> Result<PathBuf> {
        let [width, height] = self.size;
        let key = self.key()?;
        let name = format!("{}-{width}x{height}-{}-{}.exr", slug(address), self.spp, &key[..DIGITS]);
        Ok(folder.join(name))
    }
}

/// An address without the word that all generated scenes begin with.
pub fn short_name(address: &str) -> &str {
    address.strip_prefix("builtin:").unwrap_or(address)
}

/// A name for files, with the letters and digits of an address.
pub fn slug(address: &str) -> String {
    let address = short_name(address);
    let dashed: String = address
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' })
        .collect();
    let words: Vec<&str> = dashed
        .split('-')
        .filter(|word| !word.trim_matches('.').is_empty())
        .collect();
    words.join("-")
}

/// The reference that is kept, if there is one by the kernels of this build.
///
/// # Errors
/// [`Error::Picture`] for a file that cannot be read.
pub fn kept(path: &Path) -> Result<Option<Picture>> {
    if !path.is_file() {
        return Ok(None);
    }
    let picture = exr::read(path)?;
    let kernels = picture
        .metadata
        .other
        .get(KERNELS)
        .map(String::as_str)
        .unwrap_or_default();
    let kernels: Option<BTreeMap<String, String>> = serde_json::from_str(kernels).ok();
    let current = kernels.is_some_and(|kernels| fingerprint::kernels_are_current(&kernels));
    Ok((current && picture.layer(VARIANCE).is_some()).then_some(picture))
}

/// Keeps a rendered reference: radiance, its variance and its samples.
///
/// # Errors
/// [`Error::Io`], [`Error::Picture`].
pub fn keep(path: &Path, key: &str, rendered: &Rendered) -> Result<Picture> {
    let mut picture = Picture::new(rendered.picture.width(), rendered.picture.height())?;
    picture.metadata = rendered.picture.metadata.clone();
    let kernels = fingerprint::kernels(&rendered.report.pipelines);
    let kernels = serde_json::to_string(&kernels).map_err(|cause| Error::io(path, cause.into()))?;
    picture.metadata.other.insert(KERNELS.into(), kernels);
    picture.metadata.other.insert("reference".into(), key.to_owned());
    for name in [RADIANCE, VARIANCE, SAMPLES] {
        let layer = rendered.picture.require(name)?;
        picture.add_layer(name, layer.channels(), layer.values().to_vec())?;
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    }
    exr::write(path, &picture)?;
    Ok(picture)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_that_matters_is_in_the_key() {
        let settings = serde_json::json!({"path_set": "all"});
        let other = serde_json::json!({"path_set": "direct"});
        let identity = Identity {
            scene: "s",
            camera: None,
            size: [8, 8],
            technique: "path",
            settings: &settings,
            spp: 64,
            seed: SEED,
            engine: "0.1.0",
        };
        let key = identity.key().unwrap();
        assert_eq!(key, identity.clone().key().unwrap());
        for changed in [
            Identity {
                scene: "t",
                ..identity.clone()
            },
            Identity {
                camera: Some("a"),
                ..identity.clone()
            },
            Identity {
                size: [8, 9],
                ..identity.clone()
            },
            Identity {
                technique: "light",
                ..identity.clone()
            },
            Identity {
                settings: &other,
                ..identity.clone()
            },
            Identity {
                spp: 65,
                ..identity.clone()
            },
            Identity {
                seed: 1,
                ..identity.clone()
            },
            Identity {
                engine: "0.2.0",
                ..identity.clone()
            },
        ] {
            assert_ne!(key, changed.key().unwrap(), "{changed:?}");
        }
        let path = identity
            .path(Path::new("r"), "builtin:cornell-box?light=1,2,3")
            .unwrap();
        assert_eq!(short_name("builtin:ring?roughness=0.2"), "ring?roughness=0.2");
        let start = "r/cornell-box-light-1-2-3-8x8-64-";
        assert!(path.to_string_lossy().starts_with(start), "{path:?}");
    }

    #[test]
    fn a_reference_without_its_facts_does_not_count() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.exr");
        assert!(kept(&path).unwrap().is_none());
        exr::write(&path, &Picture::from_radiance(1, 1, vec![1.0; 3]).unwrap()).unwrap();
        assert!(kept(&path).unwrap().is_none());
    }
}
