//! OpenEXR files: multi-layer pictures with their metadata, lossless and reproducible.
//!
//! Written are single-part scan-line files, f32, ZIP (16 lines per block). The `radiance` layer takes the plain channels R, G, B (Y when it has one
//! channel), which every reader shows; other layers are named as in the OpenEXR technical introduction ("layers"): `albedo.R`, `normal.X`,
//! `depth.Z`, `samples.Y`. Metadata are string attributes, UTF-8; the standard attribute `software` names the engine.
//! Guarantees: equal pictures give equal bytes (attributes stand in the order of their names); values round-trip to the bit; files appear as a whole.
//! Read are flat files of any part, channel and pixel type; deep data and subsampled channels are refused. Reading takes memory in proportion to the
//! file's length, whatever its header says, and time in proportion to its channels.

use std::collections::HashMap;
use std::io::{BufRead, Cursor, Seek, SeekFrom};
use std::path::Path;

use exr::meta::attribute::AttributeValue;
use exr::prelude::*;

use super::mark::SOFTWARE;
use super::picture::{DEPTH, Metadata, NORMAL, POSITION, Picture, RADIANCE};
use crate::Error as EngineError;
use crate::Result as EngineResult;
use crate::catalogue::{Role, Row, sources};
use crate::input::{InputLimits, open_regular};

/// Samples (values, not pixels) that a file may hold in all; a header asking for more is refused before anything is allocated.
const MAX_SAMPLES: usize = 1 << 29;

/// Bytes in memory for each byte of a file, beyond [`InputLimits::decoded_base`]: the deflate format packs no more than 1032 into one.
const MEMORY_PER_BYTE: u64 = 1024;

/// Attributes that writing sets and that are not metadata of a picture's making.
const LIBRARY_ATTRIBUTES: [&str; 1] = ["software"];

/// Writes all layers and the metadata, as a whole or not at all.
///
/// # Errors
/// [`crate::Error::Picture`] when the picture has no layer or cannot be encoded; [`crate::Error::Io`] when the file cannot be written.
pub fn write(path: impl AsRef<Path>, picture: &Picture) -> EngineResult<()> {
    let path = path.as_ref();
    let bytes = to_bytes(picture, &path.display().to_string())?;
    crate::atomic::write(path, &bytes)
}

/// The file's bytes; `name` is for messages.
///
/// # Errors
/// [`crate::Error::Picture`] as for [`write()`].
pub fn to_bytes(picture: &Picture, name: &str) -> EngineResult<Vec<u8>> {
    let wrong = |cause: String| EngineError::Picture {
        path: name.to_owned(),
        cause,
    };
    let mut channels = Vec::new();
    for layer in picture.layers() {
        for (index, suffix) in channel_suffixes(layer.name(), layer.channels()).iter().enumerate() {
            let channel = if layer.name() == RADIANCE {
                (*suffix).to_owned()
            } else {
                format!("{}.{suffix}", layer.name())
            };
            let channel = Text::new_or_none(&channel)
                .ok_or_else(|| wrong(format!("layer name {:?} is not Latin-1", layer.name())))?;
            let values = layer
                .values()
                .iter()
                .skip(index)
                .step_by(layer.channels())
                .copied()
                .collect();
            channels.push(AnyChannel::new(channel, FlatSamples::F32(values)));
        }
    }
    if channels.is_empty() {
        return Err(wrong("has no layer to write".into()));
    }
    let mut attributes = LayerAttributes {
        software_name: Text::new_or_none(SOFTWARE),
        ..LayerAttributes::default()
    };
    for (key, value) in picture.metadata.entries() {
        if key.is_empty() || !key.is_ascii() || key.len() > 255 || key.contains('\0') {
            return Err(wrong(format!("metadata key {key:?} is not 1 to 255 ASCII characters")));
        }
        let text = Text::from_slice_unchecked(value.as_bytes());
        let key = Text::from_slice_unchecked(key.as_bytes());
        attributes.other.insert(key, AttributeValue::Text(text));
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = (picture.width() as usize, picture.height() as usize);
    let layer = Layer::new(
        size,
        attributes,
        encoding,
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|e| wrong(e.to_string()))?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).ok_or_else(|| wrong("the encoder wrote a header that cannot be read".into()))?;
    Ok(bytes)
}

/// Channel names of a layer, in the order of its values.
fn channel_suffixes(layer: &str, channels: usize) -> &'static [&'static str] {
    match (layer, channels) {
        (NORMAL | POSITION, 3) => &["X", "Y", "Z"],
        (_, 3) => &["R", "G", "B"],
        (DEPTH, _) => &["Z"],
        _ => &["Y"],
    }
}

/// Puts the attributes of a single-part file's header in the order of their names. The encoder keeps its own in a hash map, so that
/// their order differs from run to run; a permutation moves no other byte of the file.
fn sort_attributes(bytes: &mut [u8]) -> Option<()> {
    const MAGIC_AND_VERSION: usize = 8;
    let mut attributes = Vec::new();
    let mut at = MAGIC_AND_VERSION;
    while *bytes.get(at)? != 0 {
        let start = at;
        let mut string = || -> Option<std::ops::Range<usize>> {
            let length = bytes.get(at..)?.iter().position(|b| *b == 0)?;
            at += length + 1;
            Some(at - length - 1..at - 1)
        };
        let name = string()?;
        string()?;
        let size = u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?);
        at += 4 + size as usize;
        attributes.push((bytes[name].to_vec(), bytes.get(start..at)?.to_vec()));
    }
    attributes.sort();
    let sorted: Vec<u8> = attributes.into_iter().flat_map(|(_, attribute)| attribute).collect();
    bytes.get_mut(MAGIC_AND_VERSION..at)?.copy_from_slice(&sorted);
    Some(())
}

/// Reads all layers of an EXR file, this engine's or another program's.
///
/// Channels R, G, B (or X, Y, Z) of one prefix make a layer of that name; other channels make layers of their own (`prefix`, when the channel
/// is alone, else `prefix.channel`; a plain A is `alpha`). Without a prefix the first such group is `radiance`; in multi-part files the part's
/// name stands for a missing prefix. f16 and u32 values become f32. Text attributes become metadata.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be opened, is not a regular file or is longer than [`InputLimits::file`];
/// [`crate::Error::Picture`] when it is not a flat EXR file, holds more than 2²⁹ values or more than its length can say, has subsampled channels or
/// parts of different sizes.
pub fn read(path: impl AsRef<Path>) -> EngineResult<Picture> {
    let path = path.as_ref();
    let opened = open_regular(path, InputLimits::default().file);
    let (file, _) = opened.map_err(|cause| EngineError::io(path, cause))?;
    read_from(std::io::BufReader::new(file), &path.display().to_string())
}

/// Reads from memory or any other source; `name` is for messages.
///
/// # Errors
/// As [`read()`].
pub fn read_from(mut source: impl BufRead + Seek + Send, name: &str) -> EngineResult<Picture> {
    let wrong = |cause: String| EngineError::Picture {
        path: name.to_owned(),
        cause,
    };
    let length = source.seek(SeekFrom::End(0)).map_err(|e| wrong(e.to_string()))?;
    source.rewind().map_err(|e| wrong(e.to_string()))?;
    let meta = MetaData::read_from_buffered(&mut source, false).map_err(|e| wrong(e.to_string()))?;
    let (mut samples, mut memory) = (0usize, 0u64);
    for header in &meta.headers {
        if header
            .channels
            .list
            .iter()
            .any(|channel| channel.sampling != Vec2(1, 1))
        {
            return Err(wrong("has subsampled channels, which are not supported".into()));
        }
        let count = header.layer_size.0.checked_mul(header.layer_size.1);
        let count = count.and_then(|pixels| pixels.checked_mul(header.channels.list.len()));
        samples = samples.saturating_add(count.unwrap_or(usize::MAX));
        // Values as they are in the file, and as f32.
        for channel in &header.channels.list {
            let bytes = channel.sample_type.bytes_per_sample() + size_of::<f32>();
            let bytes = header
                .layer_size
                .0
                .saturating_mul(header.layer_size.1)
                .saturating_mul(bytes);
            memory = memory.saturating_add(bytes as u64);
        }
    }
    if samples > MAX_SAMPLES {
        return Err(wrong(format!("holds {samples} values; {MAX_SAMPLES} can be read")));
    }
    let limits = InputLimits {
        decoded_per_byte: MEMORY_PER_BYTE,
        ..InputLimits::default()
    };
    limits.check_decoded(memory, length).map_err(wrong)?;
    source.rewind().map_err(|e| wrong(e.to_string()))?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(source)
        .map_err(|e| wrong(e.to_string()))?;
    let first = image.layer_data.first().ok_or_else(|| wrong("has no parts".into()))?;
    let (size, position) = (first.size, first.attributes.layer_position);
    let side = |length: usize| u32::try_from(length).map_err(|_| wrong(format!("has a side of {length} pixels")));
    let mut picture = Picture::new(side(size.0)?, side(size.1)?)?;
    let many = image.layer_data.len() > 1;
    let (mut entries, mut names) = (Vec::new(), Names::default());
    collect_text(&image.attributes.other, &mut entries);
    for part in &image.layer_data {
        if part.size != size || part.attributes.layer_position != position {
            return Err(wrong(
                "has parts with different data windows, which are not supported".into(),
            ));
        }
        collect_text(&part.attributes.other, &mut entries);
        let part_name = part.attributes.layer_name.as_ref().map(ToString::to_string);
        add_part(
            &mut picture,
            &mut names,
            part,
            &part_name.filter(|_| many).unwrap_or_default(),
        )?;
    }
    // Maps have no order of their own; where two parts disagree the result must not depend on it.
    entries.sort();
    picture.metadata = Metadata::from_entries(entries);
    Ok(picture)
}

/// Text attributes as metadata entries; bytes that are not UTF-8 are taken as Latin-1.
fn collect_text(attributes: &std::collections::HashMap<Text, AttributeValue>, entries: &mut Vec<(String, String)>) {
    for (key, value) in attributes {
        let key = key.to_string();
        if let (AttributeValue::Text(text), false) = (value, LIBRARY_ATTRIBUTES.contains(&key.as_str())) {
            let value = std::str::from_utf8(text.as_slice()).map_or_else(|_| text.to_string(), str::to_owned);
            entries.push((key, value));
        }
    }
}

/// Groups the channels of one part by their prefix and adds them as layers.
fn add_part(
    picture: &mut Picture,
    names: &mut Names,
    part: &Layer<AnyChannels<FlatSamples>>,
    part_name: &str,
) -> EngineResult<()> {
    let mut groups: Vec<(String, Vec<(String, &FlatSamples)>)> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    for channel in &part.channel_data.list {
        let full = channel.name.to_string();
        let (prefix, suffix) = full.rsplit_once('.').unwrap_or(("", &full));
        let prefix = if prefix.is_empty() { part_name } else { prefix };
        let entry = (suffix.to_owned(), &channel.sample_data);
        match places.get(prefix) {
            Some(&place) => groups[place].1.push(entry),
            None => {
                places.insert(prefix.to_owned(), groups.len());
                groups.push((prefix.to_owned(), vec![entry]));
            }
        }
    }
    for (prefix, mut channels) in groups {
        for triple in [["R", "G", "B"], ["X", "Y", "Z"]] {
            let found = triple.map(|wanted| {
                channels
                    .iter()
                    .position(|(suffix, _)| suffix.eq_ignore_ascii_case(wanted))
            });
            if let [Some(r), Some(g), Some(b)] = found {
                let [r, g, b] = [r, g, b].map(|index| channels[index].1.values_as_f32());
                let values = r.zip(g).zip(b).flat_map(|((r, g), b)| [r, g, b]).collect();
                let shown = prefix.is_empty() && picture.layer(RADIANCE).is_none() && triple[0] == "R";
                let name = if shown { RADIANCE } else { &prefix };
                names.add(picture, name, 3, values)?;
                channels.retain(|(suffix, _)| !triple.iter().any(|wanted| suffix.eq_ignore_ascii_case(wanted)));
            }
        }
        let alone = channels.len() == 1;
        for (suffix, samples) in &channels {
            let is_short = alone && matches!(suffix.as_str(), "Y" | "Z" | "V" | "A");
            let name = match (prefix.as_str(), suffix.as_str()) {
                ("", "Y") => RADIANCE.to_owned(),
                ("", "A") => "alpha".to_owned(),
                ("", "Z") => DEPTH.to_owned(),
                ("", other) => other.to_owned(),
                (prefix, _) if is_short && picture.layer(prefix).is_none() => prefix.to_owned(),
                (prefix, other) => format!("{prefix}.{other}"),
            };
            names.add(picture, &name, 1, samples.values_as_f32().collect())?;
        }
    }
    Ok(())
}

/// The numbers that layers of one name were given last.
#[derive(Default)]
struct Names {
    last: HashMap<String, u32>,
    /// Names that were looked up.
    tried: u64,
}

impl Names {
    /// Adds a layer under `name`, or `name 2` and so on when that is taken. Each number is tried once, since layers stay.
    fn add(&mut self, picture: &mut Picture, name: &str, channels: usize, values: Vec<f32>) -> EngineResult<()> {
        let name = if name.is_empty() { "layer" } else { name };
        let number = self.last.entry(name.to_owned()).or_insert(0);
        let unique = loop {
            *number += 1;
            self.tried += 1;
            let unique = match *number {
                1 => name.to_owned(),
                _ => format!("{name} {number}"),
            };
            if picture.layer(&unique).is_none() {
                break unique;
            }
        };
        picture.add_layer(&unique, channels, values)
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-EXR",
    name: "pictures as OpenEXR with layers and facts, Radiance HDR and PNG",
    role: Role::Service,
    limits: "Deep data and subsampled channels are refused; Radiance HDR keeps eight bits of a colour's mantissas, PNG eight of its display value.",
    sources: &[sources::OPENEXR.whole(), sources::WARD_1991.whole()],
    tests: &[
        "engine/src/film/exr.rs::every_bit_and_every_attribute_comes_back",
        "engine/src/film/hdr.rs::round_trip_errs_by_at_most_a_step_of_the_largest_channel",
        "engine/src/film/png.rs::a_written_file_reads_back_to_the_byte",
        "engine/src/film/mark.rs::every_format_bears_the_mark",
        "engine/src/atomic.rs::modes_and_links_stay",
    ],
    api: &["clerestory::film::exr::write", "clerestory::film::exr::read"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::picture::{ALBEDO, SAMPLES};
    use exr::prelude::f16;

    fn sample_picture() -> EngineResult<Picture> {
        let (width, height) = (19, 37);
        let mut picture = Picture::new(width, height)?;
        let values = |channels: u32, seed: u32| -> Vec<f32> {
            (0..width * height * channels)
                .map(|i| f32::from_bits((i + 1).wrapping_mul(747_796_405).wrapping_add(seed)))
                .collect()
        };
        picture.add_layer(RADIANCE, 3, values(3, 1))?;
        picture.add_layer(NORMAL, 3, values(3, 2))?;
        picture.add_layer(ALBEDO, 3, values(3, 3))?;
        picture.add_layer(DEPTH, 1, values(1, 4))?;
        picture.add_layer(SAMPLES, 1, values(1, 5))?;
        picture.metadata = Metadata {
            scene: Some("builtin:cornell-box?width=5".into()),
            settings: Some("{\"spp\":64,\"name\":\"Überprüfung ∞\"}".into()),
            seed: Some(7),
            ..Metadata::default()
        };
        for key in ["a", "b", "c", "d", "e"] {
            picture.metadata.other.insert(format!("host.{key}"), "x".repeat(500));
        }
        Ok(picture)
    }

    fn bits(picture: &Picture) -> Vec<(String, Vec<u32>)> {
        let mut layers: Vec<_> = picture
            .layers()
            .iter()
            .map(|l| (l.name().to_owned(), l.values().iter().map(|v| v.to_bits()).collect()))
            .collect();
        layers.sort();
        layers
    }

    #[test]
    fn every_bit_and_every_attribute_comes_back() -> EngineResult<()> {
        let folder = tempfile::tempdir().map_err(|e| EngineError::io("temporary folder", e))?;
        let path = folder.path().join("a.exr");
        let picture = sample_picture()?;
        write(&path, &picture)?;
        let back = read(&path)?;
        assert_eq!(bits(&back), bits(&picture));
        assert_eq!(back.metadata, picture.metadata);
        assert_eq!(back.main_layer()?.name(), RADIANCE);
        Ok(())
    }

    #[test]
    fn equal_pictures_give_equal_bytes() -> EngineResult<()> {
        // Each encoding uses fresh hash maps, so ten agreeing by chance with 8 attributes has a probability far below 1e-9.
        let first = to_bytes(&sample_picture()?, "a")?;
        for _ in 0..10 {
            assert_eq!(to_bytes(&sample_picture()?, "a")?, first);
        }
        Ok(())
    }

    fn channel(name: &str, samples: FlatSamples) -> AnyChannel<FlatSamples> {
        AnyChannel::new(name, samples)
    }

    fn encode<L>(image: Image<L>) -> EngineResult<Vec<u8>>
    where
        L: for<'a> exr::image::write::layers::WritableLayers<'a>,
    {
        let mut bytes = Cursor::new(Vec::new());
        image
            .write()
            .to_buffered(&mut bytes)
            .map_err(|e| EngineError::Picture {
                path: "test".into(),
                cause: e.to_string(),
            })?;
        Ok(bytes.into_inner())
    }

    #[test]
    fn reads_half_alpha_and_integer_channels() -> EngineResult<()> {
        let half = |v: [f32; 2]| FlatSamples::F16(v.map(f16::from_f32).to_vec());
        let list = [
            channel("R", half([0.5, 1.0])),
            channel("G", half([0.25, 2.0])),
            channel("B", FlatSamples::F32(vec![0.1, 3.0])),
            channel("A", half([1.0, 0.0])),
            channel("Z", FlatSamples::F32(vec![10.0, 11.0])),
            channel("id", FlatSamples::U32(vec![3, 70_000])),
            channel("ViewLayer.Normal.X", half([0.0, 1.0])),
            channel("ViewLayer.Normal.Y", half([1.0, 0.0])),
            channel("ViewLayer.Normal.Z", half([0.0, 0.0])),
        ];
        let channels = AnyChannels::sort(list.into_iter().collect());
        let bytes = encode(Image::from_channels((2, 1), channels))?;
        let picture = read_from(Cursor::new(bytes), "test")?;
        let values = |name: &str| picture.require(name).map(|l| l.values().to_vec());
        assert_eq!(values(RADIANCE)?, [0.5, 0.25, 0.1, 1.0, 2.0, 3.0]);
        assert_eq!(values("alpha")?, [1.0, 0.0]);
        assert_eq!(values(DEPTH)?, [10.0, 11.0]);
        assert_eq!(values("id")?, [3.0, 70_000.0]);
        assert_eq!(values("ViewLayer.Normal")?, [0.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
        Ok(())
    }

    #[test]
    fn reads_the_parts_of_a_multi_part_file_by_name() -> EngineResult<()> {
        let part = |name: &str, v: f32| {
            let list = ["B", "G", "R"].map(|c| channel(c, FlatSamples::F32(vec![v; 4])));
            let channels = AnyChannels::sort(list.into_iter().collect());
            Layer::new((2, 2), LayerAttributes::named(name), Encoding::SMALL_LOSSLESS, channels)
        };
        let image = Image::from_layers(
            ImageAttributes::with_size((2, 2)),
            [part("beauty", 1.0), part("albedo", 2.0)]
                .into_iter()
                .collect::<Layers<_>>(),
        );
        let picture = read_from(Cursor::new(encode(image)?), "test")?;
        assert_eq!(picture.main_layer()?.values()[0], 1.0);
        assert_eq!(picture.require(ALBEDO)?.values()[0], 2.0);
        Ok(())
    }

    #[test]
    fn layers_of_one_name_are_numbered_in_as_many_steps_as_there_are() -> EngineResult<()> {
        const COUNT: u64 = 3000;
        let mut picture = Picture::new(1, 1)?;
        let mut names = Names::default();
        for name in ["a 3", "a"] {
            names.add(&mut picture, name, 1, vec![0.0])?;
        }
        for _ in 2..COUNT {
            names.add(&mut picture, "a", 1, vec![0.0])?;
        }
        names.add(&mut picture, "", 1, vec![0.0])?;
        let found: Vec<&str> = picture.layers()[..5].iter().map(|layer| layer.name()).collect();
        assert_eq!(found, ["a 3", "a", "a 2", "a 4", "a 5"]);
        assert_eq!(picture.layers().len() as u64, COUNT + 1);
        // One more for the name that was taken.
        assert_eq!(names.tried, COUNT + 2);
        Ok(())
    }

    #[test]
    fn thousands_of_channels_and_parts_keep_their_names() -> EngineResult<()> {
        let prefixes = 2000;
        let list = (0..prefixes).map(|i| channel(&format!("p{i:04}.x"), FlatSamples::F32(vec![i as f32])));
        let channels = AnyChannels::sort(list.collect());
        let picture = read_from(Cursor::new(encode(Image::from_channels((1, 1), channels))?), "test")?;
        assert_eq!(picture.layers().len(), prefixes);
        assert_eq!(picture.require("p1234.x")?.values(), [1234.0]);
        let part = |i: usize| {
            let list = [channel("p.x", FlatSamples::F32(vec![i as f32]))];
            let channels = AnyChannels::sort(list.into_iter().collect());
            Layer::new(
                (1, 1),
                LayerAttributes::named(format!("{i}").as_str()),
                Encoding::UNCOMPRESSED,
                channels,
            )
        };
        let image = Image::from_layers(
            ImageAttributes::with_size((1, 1)),
            (0..300).map(part).collect::<Layers<_>>(),
        );
        let picture = read_from(Cursor::new(encode(image)?), "test")?;
        assert_eq!(picture.layers().len(), 300);
        assert_eq!(picture.require("p.x 300")?.values(), [299.0]);
        Ok(())
    }

    #[test]
    fn a_header_that_promises_more_than_the_file_can_hold_is_refused() -> EngineResult<()> {
        let mut bytes = to_bytes(&Picture::from_radiance(2, 2, vec![0.5; 12])?, "a")?;
        // The windows' last pixel: 13000² pixels of three f32 would take 4 GB. As many values as that may be read from files that hold them.
        for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
            let place = bytes
                .windows(name.len())
                .position(|window| window == name)
                .expect("attribute");
            // Behind the value's length and the first pixel.
            let corner = place + name.len() + 4 + 8;
            bytes[corner..corner + 4].copy_from_slice(&12_999i32.to_le_bytes());
            bytes[corner + 4..corner + 8].copy_from_slice(&12_999i32.to_le_bytes());
        }
        let read = read_from(Cursor::new(bytes), "small");
        let message = read.expect_err("huge").to_string();
        assert!(message.contains("takes 4056000000 bytes of memory"), "{message}");
        Ok(())
    }

    #[test]
    fn malformed_files_are_errors_and_never_panic() -> EngineResult<()> {
        let mut small = Picture::from_radiance(3, 2, vec![0.5; 18])?;
        small.metadata.scene = Some("s".into());
        let good = to_bytes(&small, "a")?;
        for end in 0..good.len() {
            assert!(read_from(Cursor::new(&good[..end]), "cut").is_err(), "cut at {end}");
        }
        for at in 0..good.len() {
            for flip in [0x01, 0x80, 0xff] {
                let mut bad = good.clone();
                bad[at] ^= flip;
                // A changed sample or attribute is a file too; what matters is that reading ends.
                let _ = read_from(Cursor::new(bad), "flipped");
            }
        }
        Ok(())
    }
}
