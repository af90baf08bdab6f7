//! Pictures in memory: named layers of f32 values with the facts of how they came to be.
//!
//! Guarantees: every layer holds exactly width × height pixels, the top row first; names are unique; non-finite values are kept as they
//! are and can be counted.

use std::collections::{BTreeMap, HashMap};

use crate::{Error, Result};

/// Linear RGB radiance, W·m⁻²·sr⁻¹ (or relative units, where the metadata says so).
pub const RADIANCE: &str = "radiance";
/// World-space shading normal at the first hit, mean over the samples; zero where nothing is hit.
pub const NORMAL: &str = "normal";
/// Linear base colour at the first hit.
pub const ALBEDO: &str = "albedo";
/// Mean distance from the camera to the first hit, metres.
pub const DEPTH: &str = "depth";
/// World-space position of the first hit, metres.
pub const POSITION: &str = "position";
/// Variance of the radiance layer's mean, per channel.
pub const VARIANCE: &str = "variance";
/// Samples that went into each pixel.
pub const SAMPLES: &str = "samples";

/// One layer: one or three f32 channels for every pixel of its picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    name: String,
    channels: usize,
    values: Vec<f32>,
}

impl Layer {
    /// The layer's name, such as [`RADIANCE`].
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Channels a pixel, 1 or 3.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// All values, channels interleaved, the top row first.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// All values, to change.
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }

    /// The pixels as RGB (or XYZ) triples; a one-channel layer is repeated in all three.
    pub fn pixels(&self) -> impl ExactSizeIterator<Item = [f32; 3]> + '_ {
        self.values.chunks_exact(self.channels).map(|pixel| match *pixel {
            [r, g, b] => [r, g, b],
            _ => [pixel[0]; 3],
        })
    }

    /// How many values are NaN and how many infinite.
    pub fn count_non_finite(&self) -> NonFinite {
        let count = |test: fn(&&f32) -> bool| self.values.iter().filter(test).count() as u64;
        NonFinite {
            layer: self.name.clone(),
            nan: count(|v| v.is_nan()),
            infinite: count(|v| v.is_infinite()),
        }
    }
}

/// How many values of a layer are not finite numbers.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct NonFinite {
    /// The layer's name.
    pub layer: String,
    /// Values that are NaN.
    pub nan: u64,
    /// Values that are +∞ or −∞.
    pub infinite: u64,
}

/// Samples that were left out of a picture since a channel of theirs was not a finite number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct NonFiniteSamples {
    /// Samples with a NaN.
    pub nan: u64,
    /// Samples with an infinity and no NaN.
    pub infinite: u64,
}

impl NonFiniteSamples {
    /// Samples of both kinds.
    pub fn total(self) -> u64 {
        self.nan + self.infinite
    }
}

/// The facts of a picture's making. All of them travel with EXR files as string attributes.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Metadata {
    /// File or `builtin:` address of the scene.
    pub scene: Option<String>,
    /// The technique's id.
    pub technique: Option<String>,
    /// Which light paths the picture contains.
    pub path_set: Option<String>,
    /// The technique's settings as JSON text.
    pub settings: Option<String>,
    /// Seed of the random numbers.
    pub seed: Option<u64>,
    /// Samples per pixel.
    pub spp: Option<u64>,
    /// The device's name.
    pub device: Option<String>,
    /// The driver's name and version.
    pub driver: Option<String>,
    /// The engine's version.
    pub engine_version: Option<String>,
    /// When the picture was finished, ISO 8601 in UTC.
    pub time: Option<String>,
    /// Seconds of rendering.
    pub seconds: Option<f64>,
    /// Everything else, ordered by key.
    pub other: BTreeMap<String, String>,
}

/// What the typed keys begin with in files, so that they do not meet anybody else's attributes.
const PREFIX: &str = "clerestory.";

impl Metadata {
    /// All facts that are there as (key, value) strings: typed ones first, under `clerestory.`, then the others ordered by key.
    pub fn entries(&self) -> Vec<(String, String)> {
        let typed = [
            ("scene", self.scene.clone()),
            ("technique", self.technique.clone()),
            ("path_set", self.path_set.clone()),
            ("settings", self.settings.clone()),
            ("seed", self.seed.map(|v| v.to_string())),
            ("spp", self.spp.map(|v| v.to_string())),
            ("device", self.device.clone()),
            ("driver", self.driver.clone()),
            ("engine_version", self.engine_version.clone()),
            ("time", self.time.clone()),
            ("seconds", self.seconds.map(|v| v.to_string())),
        ];
        let typed = typed
            .into_iter()
            .filter_map(|(key, value)| value.map(|value| (format!("{PREFIX}{key}"), value)));
        let other = self.other.iter().map(|(key, value)| (key.clone(), value.clone()));
        typed.chain(other).collect()
    }

    /// The inverse of [`Metadata::entries`], in any order; a typed entry that does not parse stays among the others, so nothing is lost.
    pub fn from_entries(entries: impl IntoIterator<Item = (String, String)>) -> Self {
        let mut metadata = Self::default();
        for (key, value) in entries {
            if !metadata.set_typed(&key, &value) {
                metadata.other.insert(key, value);
            }
        }
        metadata
    }

    fn set_typed(&mut self, key: &str, value: &str) -> bool {
        let text = Some(value.to_owned());
        match key.strip_prefix(PREFIX) {
            Some("scene") => self.scene = text,
            Some("technique") => self.technique = text,
            Some("path_set") => self.path_set = text,
            Some("settings") => self.settings = text,
            Some("device") => self.device = text,
            Some("driver") => self.driver = text,
            Some("engine_version") => self.engine_version = text,
            Some("time") => self.time = text,
            Some("seed") => return parse_into(&mut self.seed, value),
            Some("spp") => return parse_into(&mut self.spp, value),
            Some("seconds") => return parse_into(&mut self.seconds, value),
            _ => return false,
        }
        true
    }
}

fn parse_into<T: std::str::FromStr>(slot: &mut Option<T>, value: &str) -> bool {
    *slot = value.parse().ok();
    slot.is_some()
}

/// Named layers of one size, with metadata.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    width: u32,
    height: u32,
    layers: Vec<Layer>,
    /// Where each name is among the layers: files may have thousands of them.
    places: HashMap<String, usize>,
    /// How the picture came to be.
    pub metadata: Metadata,
}

impl Picture {
    /// A picture without layers.
    ///
    /// # Errors
    /// [`Error::Picture`] when a side is zero or the pixels cannot be counted in 32 bits.
    pub fn new(width: u32, height: u32) -> Result<Self> {
        if width == 0 || height == 0 || width.checked_mul(height).is_none() {
            return Err(Error::Picture {
                path: format!("{width}×{height} picture"),
                cause: "sides must be at least 1, and their product below 2³²".into(),
            });
        }
        Ok(Self {
            width,
            height,
            layers: Vec::new(),
            places: HashMap::new(),
            metadata: Metadata::default(),
        })
    }

    /// A picture of RGB radiance alone: `width × height × 3` values, the top row first.
    ///
    /// # Errors
    /// As [`Picture::new`] and [`Picture::add_layer`].
    pub fn from_radiance(width: u32, height: u32, values: Vec<f32>) -> Result<Self> {
        let mut picture = Self::new(width, height)?;
        picture.add_layer(RADIANCE, 3, values)?;
        Ok(picture)
    }

    /// Pixels across.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels down.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Adds a layer of one or three channels, interleaved, the top row first.
    ///
    /// # Errors
    /// [`Error::Picture`] when the count of values or channels is wrong or the name is empty or taken.
    pub fn add_layer(&mut self, name: &str, channels: usize, values: Vec<f32>) -> Result<()> {
        let cause = if !matches!(channels, 1 | 3) {
            Some(format!("has {channels} channels; 1 or 3 are possible"))
        } else if values.len() != self.pixel_count() * channels {
            let wanted = self.pixel_count() * channels;
            Some(format!("holds {} values in place of {wanted}", values.len()))
        } else if name.is_empty() || self.layer(name).is_some() {
            Some("needs a name of its own".to_owned())
        } else {
            None
        };
        if let Some(cause) = cause {
            return Err(Error::Picture {
                path: format!("layer {name:?}"),
                cause,
            });
        }
        self.places.insert(name.to_owned(), self.layers.len());
        self.layers.push(Layer {
            name: name.to_owned(),
            channels,
            values,
        });
        Ok(())
    }

    /// The layers in the order of their adding.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// A layer by name.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.get(*self.places.get(name)?)
    }

    /// A layer by name, to change its values.
    pub fn layer_mut(&mut self, name: &str) -> Option<&mut Layer> {
        self.layers.get_mut(*self.places.get(name)?)
    }

    /// A layer by name.
    ///
    /// # Errors
    /// [`Error::Picture`] that names the layers there are.
    pub fn require(&self, name: &str) -> Result<&Layer> {
        self.layer(name).ok_or_else(|| Error::Picture {
            path: format!("layer {name:?}"),
            cause: format!("is not there; there is: {}", self.layer_names()),
        })
    }

    /// The layer to look at and to compare: `radiance`, or without one (in pictures by other programs) the first of three channels.
    ///
    /// # Errors
    /// [`Error::Picture`] when there is neither.
    pub fn main_layer(&self) -> Result<&Layer> {
        self.layer(RADIANCE)
            .or_else(|| self.layers.iter().find(|layer| layer.channels == 3))
            .ok_or_else(|| Error::Picture {
                path: "picture".into(),
                cause: format!("has no colour layer; there is: {}", self.layer_names()),
            })
    }

    fn layer_names(&self) -> String {
        let names: Vec<_> = self.layers.iter().map(Layer::name).collect();
        if names.is_empty() {
            "nothing".into()
        } else {
            names.join(", ")
        }
    }

    /// NaN and infinite values of each layer that has any, in layer order; empty when all is well.
    pub fn count_non_finite(&self) -> Vec<NonFinite> {
        self.layers
            .iter()
            .map(Layer::count_non_finite)
            .filter(|count| count.nan + count.infinite > 0)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_does_not_fit() -> Result<()> {
        assert!(Picture::new(0, 4).is_err() && Picture::new(65_536, 65_536).is_err());
        let mut picture = Picture::new(2, 1)?;
        assert!(picture.add_layer(RADIANCE, 3, vec![0.0; 5]).is_err());
        assert!(picture.add_layer(RADIANCE, 2, vec![0.0; 4]).is_err());
        assert!(picture.main_layer().is_err());
        picture.add_layer(RADIANCE, 3, vec![0.0; 6])?;
        assert!(picture.add_layer(RADIANCE, 3, vec![0.0; 6]).is_err());
        let message = picture
            .require("depht")
            .map_err(|e| e.to_string())
            .err()
            .unwrap_or_default();
        assert!(message.contains("radiance"), "{message}");
        Ok(())
    }

    #[test]
    fn non_finite_values_are_counted_by_kind() -> Result<()> {
        let mut picture = Picture::new(2, 1)?;
        picture.add_layer(DEPTH, 1, vec![0.0, 1.0])?;
        picture.add_layer(
            RADIANCE,
            3,
            vec![f32::NAN, 0.0, f32::INFINITY, f32::NEG_INFINITY, 1.0, 2.0],
        )?;
        let expected = NonFinite {
            layer: RADIANCE.into(),
            nan: 1,
            infinite: 2,
        };
        assert_eq!(picture.count_non_finite(), [expected]);
        Ok(())
    }

    #[test]
    fn metadata_round_trips_and_keeps_what_does_not_parse() {
        let mut metadata = Metadata {
            scene: Some("builtin:cornell-box".into()),
            seed: Some(u64::MAX),
            seconds: Some(0.1),
            ..Metadata::default()
        };
        metadata.other.insert("zebra".into(), "é".into());
        metadata.other.insert("ant".into(), String::new());
        let entries = metadata.entries();
        assert_eq!(entries[0].0, "clerestory.scene");
        assert_eq!(Metadata::from_entries(entries.into_iter().rev()), metadata);
        let odd = Metadata::from_entries([("clerestory.spp".to_owned(), "many".to_owned())]);
        assert_eq!(odd.spp, None);
        assert_eq!(odd.other["clerestory.spp"], "many");
    }
}
