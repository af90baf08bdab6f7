//! Density grids from files of nothing but numbers, x fastest and z slowest; who reads them says how many and of what type.
//!
//! Whole numbers stand for [0, 1], as in textures. Guarantees: memory is bounded by the file's size, and every fault has its place.

use std::path::Path;

use glam::DAffine3;

use super::{DensityGrid, MAX_DENSITY_CELLS};
use crate::input::{InputLimits, read_file};
use crate::{Error, Result};

/// The type of a grid's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberType {
    /// 8 bits, 255 for density 1.
    U8,
    /// 16 bits, 65535 for density 1.
    U16,
    /// IEEE 754 binary16.
    F16,
    /// IEEE 754 binary32.
    F32,
    /// IEEE 754 binary64; rounded to binary32.
    F64,
}

impl NumberType {
    /// All of them by their names in files.
    pub const ALL: [(&str, Self); 5] = [
        ("uint8", Self::U8),
        ("uint16", Self::U16),
        ("float16", Self::F16),
        ("float32", Self::F32),
        ("float64", Self::F64),
    ];

    /// Bytes of one number.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 | Self::F16 => 2,
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// How the numbers lie in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawLayout {
    /// Cells along x, y and z.
    pub size: [u32; 3],
    /// Type of the numbers.
    pub number: NumberType,
    /// The most significant byte comes first.
    pub big_endian: bool,
    /// Bytes before the first number.
    pub offset: u64,
}

/// What is wrong, and where.
pub(super) type Fault = (String, String);

/// Reads a file as a grid at the unit cube.
///
/// # Errors
/// [`Error::Io`] when it cannot be read; [`Error::Scene`] when it is not exactly as long as the layout says, or a number cannot be a density.
pub fn read(path: &Path, layout: &RawLayout) -> Result<DensityGrid> {
    let bytes = read_file(path, InputLimits::default().file)?;
    parse(&bytes, layout).map_err(|(at, cause)| Error::scene(path.display().to_string(), at, cause))
}

/// A grid at the unit cube from a file's bytes; the place and cause of what is wrong otherwise.
///
/// # Errors
/// As [`read`], without the file's name.
pub fn parse(bytes: &[u8], layout: &RawLayout) -> Result<DensityGrid, Fault> {
    let [x, y, z] = layout.size;
    let cells = u128::from(x) * u128::from(y) * u128::from(z);
    if cells == 0 || cells > u128::from(MAX_DENSITY_CELLS) {
        let cause = format!("{x} × {y} × {z} is not between 1 and {MAX_DENSITY_CELLS} cells");
        return Err(("size".into(), cause));
    }
    let wanted = cells * layout.number.bytes() as u128 + u128::from(layout.offset);
    if wanted != bytes.len() as u128 {
        let cause = format!(
            "{wanted} bytes are wanted for {x} × {y} × {z} numbers; there are {}",
            bytes.len()
        );
        return Err(("length".into(), cause));
    }
    let body = bytes.get(layout.offset as usize..).unwrap_or_default();
    let values: Vec<f32> = body
        .chunks_exact(layout.number.bytes())
        .map(|chunk| number(chunk, layout.number, layout.big_endian))
        .collect();
    if let Some(i) = values.iter().position(|v| !v.is_finite() || *v < 0.0) {
        let place = layout.offset + i as u64 * layout.number.bytes() as u64;
        let cause = format!("{} is not a density: negative or not finite in f32", values[i]);
        return Err((format!("byte {place} (number {i})"), cause));
    }
    Ok(DensityGrid {
        size: layout.size,
        values,
        to_world: DAffine3::IDENTITY,
    })
}

fn number(chunk: &[u8], number: NumberType, big_endian: bool) -> f32 {
    let byte = |i: usize| {
        let place = if big_endian { chunk.len() - 1 - i } else { i };
        u64::from(chunk.get(place).copied().unwrap_or(0))
    };
    let bits = (0..chunk.len()).fold(0u64, |bits, i| bits | byte(i) << (8 * i));
    match number {
        NumberType::U8 => bits as f32 / 255.0,
        NumberType::U16 => bits as f32 / 65_535.0,
        NumberType::F16 => from_half(bits as u16),
        NumberType::F32 => f32::from_bits(bits as u32),
        NumberType::F64 => f64::from_bits(bits) as f32,
    }
}

/// IEEE 754 binary16 to binary32, exactly.
fn from_half(bits: u16) -> f32 {
    let sign = if bits >> 15 == 0 { 1.0 } else { -1.0 };
    let mantissa = f32::from(bits & 0x3FF);
    let magnitude = match bits >> 10 & 0x1F {
        0 => mantissa * f32::powi(2.0, -24),
        0x1F if mantissa == 0.0 => f32::INFINITY,
        0x1F => f32::NAN,
        exponent => (1024.0 + mantissa) * f32::powi(2.0, i32::from(exponent) - 25),
    };
    sign * magnitude
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_and_order_is_read() {
        let layout = |number, big_endian, offset| RawLayout {
            size: [2, 1, 1],
            number,
            big_endian,
            offset,
        };
        for (number, bytes, expected) in [
            (NumberType::U8, vec![0, 255], [0.0, 1.0]),
            (
                NumberType::U16,
                vec![0xFF, 0xFF, 0x00, 0x80],
                [1.0, 32_768.0 / 65_535.0],
            ),
            (NumberType::F16, vec![0x00, 0x3C, 0x01, 0x00], [1.0, 5.960_464_5e-8]),
            (
                NumberType::F32,
                [1.5f32.to_le_bytes(), 0.25f32.to_le_bytes()].concat(),
                [1.5, 0.25],
            ),
            (
                NumberType::F64,
                [1.5f64.to_le_bytes(), 0.1f64.to_le_bytes()].concat(),
                [1.5, 0.1],
            ),
        ] {
            let grid = parse(&bytes, &layout(number, false, 0)).expect("little");
            assert_eq!(grid.values, expected);
            let mut turned = vec![7; 3];
            for chunk in bytes.chunks(number.bytes()) {
                turned.extend(chunk.iter().rev());
            }
            assert_eq!(parse(&turned, &layout(number, true, 3)).expect("big").values, expected);
        }
    }

    #[test]
    fn halves_are_exact() {
        for (bits, value) in [
            (0x0000, 0.0),
            (0x0400, 6.103_515_6e-5),
            (0x3555, 0.333_251_95),
            (0x7BFF, 65_504.0),
            (0xC000, -2.0),
        ] {
            assert_eq!(from_half(bits), value);
        }
        assert!(from_half(0x7C00) == f32::INFINITY && from_half(0x7E00).is_nan());
        // Ordered as their bits are.
        assert!((0..0x7C00u16).all(|bits| from_half(bits) < from_half(bits + 1)));
    }

    #[test]
    fn wrong_lengths_and_numbers_have_their_place() {
        let layout = RawLayout {
            size: [2, 2, 1],
            number: NumberType::F32,
            big_endian: false,
            offset: 4,
        };
        let good: Vec<u8> = [0.0f32; 5].iter().flat_map(|v| v.to_le_bytes()).collect();
        parse(&good, &layout).expect("good");
        for cut in 0..good.len() {
            assert_eq!(parse(&good[..cut], &layout).expect_err("cut").0, "length");
        }
        let mut bad = good.clone();
        bad[12..16].copy_from_slice(&(-1.0f32).to_le_bytes());
        assert_eq!(parse(&bad, &layout).expect_err("negative").0, "byte 12 (number 2)");
        for size in [[0, 1, 1], [u32::MAX; 3]] {
            assert_eq!(parse(&good, &RawLayout { size, ..layout }).expect_err("size").0, "size");
        }
    }
}
