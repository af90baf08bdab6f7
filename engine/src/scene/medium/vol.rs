//! Mitsuba's `.vol` grids, version 3: read for densities, and written for export.
//!
//! Format: documentation of Mitsuba 3, plugin `gridvolume`; encodings 2 and 3 after that of Mitsuba 0.6. Little-endian: `VOL`, the version, the
//! encoding (1: float32, 2: float16, 3: uint8), cells along x, y and z, channels, the bounds as six float32, and the values, x fastest.
//! Guarantees: memory is bounded by the file's size, and every fault has its place.

use std::path::Path;

use glam::{DVec3, Vec3};

use super::DensityGrid;
use super::raw::{self, Fault, NumberType, RawLayout};
use crate::input::{InputLimits, read_file};
use crate::{Error, Result};

const MAGIC: [u8; 3] = *b"VOL";
const VERSION: u8 = 3;
/// Bytes before the values.
const HEADER: usize = 48;
const FLOAT32: u32 = 1;
const FLOAT16: u32 = 2;
const UINT8: u32 = 3;

/// Reads a file; the grid stands where the file's bounds say, metres.
///
/// # Errors
/// [`Error::Io`] when it cannot be read; [`Error::Scene`] with the place in it for everything else.
pub fn read(path: &Path) -> Result<DensityGrid> {
    let bytes = read_file(path, InputLimits::default().file)?;
    parse(&bytes).map_err(|(at, cause)| Error::scene(path.display().to_string(), at, cause))
}

/// The cells along x, y and z that a file says it has; `None` for what is no such file or too short.
pub(in crate::scene) fn size(bytes: &[u8]) -> Option<[u32; 3]> {
    if !bytes.starts_with(&MAGIC) || bytes.get(MAGIC.len()) != Some(&VERSION) {
        return None;
    }
    let (words, _) = bytes.get(8..20)?.as_chunks::<4>();
    Some([0, 1, 2].map(|axis| u32::from_le_bytes(words[axis])))
}

/// A grid from a file's bytes; the place and cause of what is wrong otherwise.
///
/// # Errors
/// As [`read`], without the file's name.
pub fn parse(bytes: &[u8]) -> Result<DensityGrid, Fault> {
    let fault = |at: &str, cause: String| Err((at.to_string(), cause));
    let Some((header, _)) = bytes.split_first_chunk::<HEADER>() else {
        return fault("header", format!("is cut: {} of {HEADER} bytes", bytes.len()));
    };
    if header[..3] != MAGIC || header[3] != VERSION {
        return fault("bytes 0 to 3", "are not VOL and version 3".into());
    }
    let word = |at: usize| {
        let bytes = [header[at], header[at + 1], header[at + 2], header[at + 3]];
        u32::from_le_bytes(bytes)
    };
    let number = match word(4) {
        FLOAT32 => NumberType::F32,
        FLOAT16 => NumberType::F16,
        UINT8 => NumberType::U8,
        other => {
            let cause = format!("{other} is not known; known: 1 (float32), 2 (float16), 3 (uint8)");
            return fault("encoding (byte 4)", cause);
        }
    };
    let channels = word(20);
    if channels != 1 {
        return fault("channels (byte 20)", format!("are {channels}; a density has 1"));
    }
    let corner = |at: usize| Vec3::from_array([0, 4, 8].map(|i| f32::from_bits(word(at + i)))).as_dvec3();
    let (low, high) = (corner(24), corner(36));
    if !low.is_finite() || !high.is_finite() || !low.cmplt(high).all() {
        return fault("bounds (byte 24)", format!("{low} … {high} enclose nothing"));
    }
    let layout = RawLayout {
        size: [word(8), word(12), word(16)],
        number,
        big_endian: false,
        offset: HEADER as u64,
    };
    raw::parse(bytes, &layout).map(|grid| grid.in_box(low, high))
}

/// A grid as a float32 file with a channel for each of the factors that densities are multiplied by: `[1.0]` for the densities themselves.
/// `low` and `high` are the file's bounds, metres, rounded to f32; the grid's own place is not looked at.
pub fn to_bytes(grid: &DensityGrid, factors: &[f32], low: DVec3, high: DVec3) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER + 4 * grid.values.len() * factors.len());
    bytes.extend(MAGIC);
    bytes.push(VERSION);
    let words = [FLOAT32, grid.size[0], grid.size[1], grid.size[2], factors.len() as u32];
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    let corners = [low.as_vec3(), high.as_vec3()];
    bytes.extend(
        corners
            .iter()
            .flat_map(|corner| corner.to_array())
            .flat_map(f32::to_le_bytes),
    );
    for value in &grid.values {
        bytes.extend(factors.iter().flat_map(|factor| (value * factor).to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::medium::generate::Generator;

    fn file() -> (DensityGrid, Vec<u8>) {
        let (low, high) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 3.0, 2.5));
        let grid = Generator::Gradient.grid([3, 2, 4], 0).in_box(low, high);
        let bytes = to_bytes(&grid, &[1.0], low, high);
        (grid, bytes)
    }

    #[test]
    fn what_is_written_is_read() {
        let (grid, bytes) = file();
        assert_eq!(parse(&bytes).expect("grid"), grid);
        assert_eq!(grid.density(DVec3::new(0.0, 1.0, 2.2)), f64::from(grid.values[1]));
        assert_eq!(&bytes[..8], b"VOL\x03\x01\0\0\0");
        let colored = to_bytes(&grid, &[1.0, 2.0, 4.0], DVec3::ZERO, DVec3::ONE);
        assert_eq!(colored.len(), HEADER + 3 * (bytes.len() - HEADER));
        assert_eq!(colored[HEADER + 8..HEADER + 12], (4.0 * grid.values[0]).to_le_bytes());
    }

    #[test]
    fn every_cut_and_every_wrong_field_is_an_error() {
        let (_, bytes) = file();
        for cut in 0..bytes.len() {
            parse(&bytes[..cut]).expect_err("cut");
        }
        for (at, word, place) in [
            (0, 0x0056_4F4C, "bytes 0"),
            (4, 4, "encoding"),
            (8, 0, "size"),
            (8, u32::MAX, "size"),
            (16, 5, "length"),
            (20, 3, "channels"),
            (24, 1.0f32.to_bits(), "bounds"),
            (40, f32::NAN.to_bits(), "bounds"),
            (52, (-1.0f32).to_bits(), "byte 52"),
        ] {
            let mut changed = bytes.clone();
            changed[at..at + 4].copy_from_slice(&word.to_le_bytes());
            let (found, cause) = parse(&changed).expect_err(place);
            assert!(found.contains(place), "{place}: {found}: {cause}");
        }
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig {
            cases: 256,
            rng_seed: proptest::test_runner::RngSeed::Fixed(21),
            failure_persistence: None,
            ..proptest::prelude::ProptestConfig::default()
        })]

        #[test]
        fn changed_bytes_never_panic(changes in proptest::collection::vec((0usize..144, proptest::num::u8::ANY), 1..8)) {
            let (_, mut bytes) = file();
            for (at, value) in changes {
                bytes[at] = value;
            }
            let _ = parse(&bytes);
        }
    }
}
