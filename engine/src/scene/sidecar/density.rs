//! Density grids in the sidecar: `density` of a medium.
//!
//! ```toml
//! density = { file = "smoke.vol" }                # a grid of Mitsuba's, which knows its own bounds
//! density = { file = "ct.raw", size = [64, 64, 32], type = "uint16", endian = "big", offset = 512, low = [0, 0, 0], high = [2, 2, 1] }
//! density = { generate = "smoke", size = 96, seed = 7, low = [-1, 0, -1], high = [1, 2, 1] }
//! ```
//!
//! A file whose ending is not `vol` holds nothing but numbers, x fastest and z slowest: `size` of them along x, y and z, of `type` uint8,
//! uint16, float16, float32 (the default) or float64, `endian` little (the default) or big, after `offset` bytes. Generated are constant, gradient,
//! ball, smoke and cloud, with `size` one number for all sides or three. All are multiplied by `factor` (default 1).
//!
//! A grid fills the box from `low` to `high`, metres; without them the file's own bounds or the unit cube. `scale` (one number or three), `rotate`
//! (degrees about x, then y, then z) and `translate` move it from there, in this order.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3, EulerRot};
use serde::Deserialize;

use super::{Budget, Sidecar};
use crate::input::InputFiles;
use crate::scene::medium::generate::{Generator, MAX_SIDE};
use crate::scene::medium::raw::{self, NumberType, RawLayout};
use crate::scene::medium::{MAX_DENSITY_CELLS, vol};
use crate::scene::{DensityGrid, files};
use crate::{Error, Result};

/// `density` of a medium.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DensityTable {
    file: Option<String>,
    generate: Option<String>,
    size: Option<OneOrThree<u32>>,
    #[serde(rename = "type")]
    number: Option<String>,
    endian: Option<String>,
    offset: Option<u64>,
    seed: Option<u32>,
    factor: Option<f32>,
    low: Option<[f64; 3]>,
    high: Option<[f64; 3]>,
    scale: Option<OneOrThree<f64>>,
    rotate: Option<[f64; 3]>,
    translate: Option<[f64; 3]>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "a number or three of them")]
enum OneOrThree<T> {
    One(T),
    Three([T; 3]),
}

impl<T: Copy> OneOrThree<T> {
    fn all(self) -> [T; 3] {
        match self {
            Self::One(value) => [value; 3],
            Self::Three(values) => values,
        }
    }
}

impl Sidecar {
    /// Reads or makes the grid of a table.
    pub(super) fn density(&self, key: &str, table: &DensityTable, budget: &mut Budget<'_>) -> Result<DensityGrid> {
        let mut grid = match (&table.file, &table.generate) {
            (Some(file), None) => self.density_file(key, table, file, budget)?,
            (None, Some(name)) => self.generated_density(key, table, name, budget)?,
            _ => return Err(self.fault(key, "needs either file or generate")),
        };
        let factor = table.factor.unwrap_or(1.0);
        let sound = factor.is_finite() && factor >= 0.0;
        self.require(sound, &format!("{key}.factor"), "must be finite and at least 0")?;
        grid.values.iter_mut().for_each(|value| *value *= factor);
        let grid = match (table.low, table.high) {
            (Some(low), Some(high)) => {
                let (low, high) = (DVec3::from_array(low), DVec3::from_array(high));
                let sound = low.is_finite() && high.is_finite() && low.cmplt(high).all();
                self.require(
                    sound,
                    &format!("{key}.low"),
                    "must be below high along x, y and z, both finite",
                )?;
                grid.in_box(low, high)
            }
            (None, None) => grid,
            _ => return Err(self.fault(key, "needs both low and high, or neither")),
        };
        let scale = DVec3::from_array(table.scale.map_or([1.0; 3], OneOrThree::all));
        let [x, y, z] = table.rotate.unwrap_or_default().map(f64::to_radians);
        let turn = DQuat::from_euler(EulerRot::ZYX, z, y, x);
        let translate = DVec3::from_array(table.translate.unwrap_or_default());
        let place = DAffine3::from_scale_rotation_translation(scale, turn, translate);
        self.require(
            place.is_finite() && scale.cmpne(DVec3::ZERO).all(),
            key,
            "scale must not be 0, and scale, rotate and translate must be finite",
        )?;
        Ok(DensityGrid {
            to_world: place * grid.to_world,
            ..grid
        })
    }

    /// Counts the cells of a grid before it is made: those of all grids of the scene are bounded.
    fn take_cells(&self, key: &str, size: [u32; 3], budget: &mut Budget<'_>) -> Result<u64> {
        let cells = size.iter().map(|side| u64::from(*side)).fold(1, u64::saturating_mul);
        *budget.cells = budget.cells.saturating_add(cells);
        let cause = format!(
            "the density grids of all media hold {} cells with this one; at most {MAX_DENSITY_CELLS} are allowed",
            budget.cells
        );
        self.require(*budget.cells <= MAX_DENSITY_CELLS, key, &cause)?;
        Ok(cells)
    }

    /// As [`Sidecar::take_cells`] for a grid from a file, whose cells take memory beside the file's bytes.
    fn take_file_cells(&self, key: &str, size: [u32; 3], budget: &mut Budget<'_>) -> Result<()> {
        let cells = self.take_cells(key, size, budget)?;
        let memory = cells * size_of::<f32>() as u64;
        let counted = budget.read.reserve(memory, memory);
        counted.map_err(|cause| self.fault(key, cause))
    }

    fn density_file(
        &self,
        key: &str,
        table: &DensityTable,
        file: &str,
        budget: &mut Budget<'_>,
    ) -> Result<DensityGrid> {
        let path = self.folder().join(file);
        let at = format!("{key}.file");
        self.require(
            table.seed.is_none(),
            &format!("{key}.seed"),
            "has no meaning for a file",
        )?;
        let ending = path
            .extension()
            .map(|e| e.to_string_lossy().to_lowercase())
            .unwrap_or_default();
        match ending.as_str() {
            "vol" => {
                let described = table.size.is_some() || table.number.is_some() || table.endian.is_some() || table.offset.is_some();
                self.require(!described, key, "a .vol file says itself what size, type, endian and offset are")?;
                let bytes = self.bytes(&path, &at, budget.read)?;
                // What is no .vol file is refused below, with its place.
                if let Some(size) = vol::size(&bytes) {
                    self.take_file_cells(&at, size, budget)?;
                }
                let grid = vol::parse(&bytes);
                grid.map_err(|(place, cause)| Error::scene(path.display().to_string(), place, cause))
            }
            "vdb" | "nvdb" => {
                let cause = "sparse grids of OpenVDB and NanoVDB are not read; convert the grid to a dense one: to .vol with Mitsuba's \
                             mitsuba2-vdb-converter, or to raw float32 with copyToArray of OpenVDB's Python module";
                return Err(self.fault(&at, cause));
            }
            _ => {
                let Some(size) = table.size else {
                    return Err(self.fault(key, "a file of nothing but numbers needs size = [x, y, z]"));
                };
                let layout = RawLayout {
                    size: size.all(),
                    number: self.number_type(key, table)?,
                    big_endian: self.big_endian(key, table)?,
                    offset: table.offset.unwrap_or(0),
                };
                let bytes = self.bytes(&path, &at, budget.read)?;
                self.take_file_cells(&at, layout.size, budget)?;
                let grid = raw::parse(&bytes, &layout);
                grid.map_err(|(place, cause)| Error::scene(path.display().to_string(), place, cause))
            }
        }
        .map_err(|error| self.in_file_of(&at, error))
    }

    fn bytes(&self, path: &Path, at: &str, read: &InputFiles<'_>) -> Result<Arc<Vec<u8>>> {
        files::read(path, read).map_err(|error| self.in_file_of(at, error))
    }

    fn number_type(&self, key: &str, table: &DensityTable) -> Result<NumberType> {
        let name = table.number.as_deref().unwrap_or("float32");
        let found = NumberType::ALL.iter().find(|(known, _)| *known == name);
        found.map(|(_, number)| *number).ok_or_else(|| {
            let known: Vec<&str> = NumberType::ALL.iter().map(|(known, _)| *known).collect();
            self.fault(
                &format!("{key}.type"),
                format!("{name:?} is not known; known: {}", known.join(", ")),
            )
        })
    }

    fn big_endian(&self, key: &str, table: &DensityTable) -> Result<bool> {
        match table.endian.as_deref() {
            None | Some("little") => Ok(false),
            Some("big") => Ok(true),
            Some(other) => Err(self.fault(&format!("{key}.endian"), format!("{other:?} is neither little nor big"))),
        }
    }

    fn generated_density(
        &self,
        key: &str,
        table: &DensityTable,
        name: &str,
        budget: &mut Budget<'_>,
    ) -> Result<DensityGrid> {
        const DEFAULT_SIDE: u32 = 64;
        let Some(generator) = Generator::by_name(name) else {
            let known: Vec<&str> = Generator::ALL.iter().map(|(known, _)| *known).collect();
            let cause = format!("{name:?} is not known; known: {}", known.join(", "));
            return Err(self.fault(&format!("{key}.generate"), cause));
        };
        let described = table.number.is_some() || table.endian.is_some() || table.offset.is_some();
        self.require(!described, key, "type, endian and offset have a meaning for files only")?;
        let size = table.size.map_or([DEFAULT_SIDE; 3], OneOrThree::all);
        let sound = size.iter().all(|side| (1..=MAX_SIDE).contains(side));
        self.require(
            sound,
            &format!("{key}.size"),
            &format!("must lie between 1 and {MAX_SIDE}"),
        )?;
        self.take_cells(&format!("{key}.size"), size, budget)?;
        Ok(generator.grid(size, table.seed.unwrap_or(0)))
    }
}
