//! A map of directions on the device: levels of detail, each a tile with its own border, and seamless look-ups.
//!
//! Sources: T. Engelhardt, C. Dachsbacher, "Octahedron Environment Maps", VMV 2008 (borders); L. Williams, "Pyramidal Parametrics", SIGGRAPH
//! 1983 (levels), here with means by solid angle, which keep ∫ L dω, as plain means of four do not. A border at level 0 alone serves
//! log₂ of its width in levels; here each level has one, so that one texel is enough for bilinear look-ups in all. Without borders
//! look-ups find their way over edges by the topology. The cube and the discs have no borders: beyond a corner of the cube's face no texel
//! repeats, and discs end at their rim. There the texels that are there share the weight of those that are not.
//!
//! Guarantees: bits of a border are those of the inside; deterministic; constant radiance stays constant but for the rounding of a mean of
//! four. Levels are filled in f32: a level's texels are off by at most 8·2⁻²⁴ relatively against its own children. GLSL: `maps/directional_map_set.glsl`;
//! the twin of a look-up is [`MapImage::look_up`], that of a level [`MapImage::coarser`].

use super::{MapImage, Parametrization};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants::{
    DIRECTIONAL_CUBE, DIRECTIONAL_EQUAL_AREA, DIRECTIONAL_LAT_LONG, DIRECTIONAL_NUSSELT, DIRECTIONAL_OCTAHEDRON,
    DIRECTIONAL_OCTAHEDRON_RECTANGULAR, DIRECTIONAL_PARABOLOID, DIRECTIONAL_SPHERE,
};
use crate::gpu::shaders::maps::{directional_border, directional_coarser, directional_look_up};
use crate::gpu::shaders::sets::DirectionalMapSet;
use crate::gpu::shaders::types::MapLevel;
use crate::gpu::{
    Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, compute_to_transfer, rw_compute_to_compute,
    transfer_to_compute,
};
use crate::{Error, Result};
use glam::{DVec3, UVec2, Vec3, Vec4};

/// A map in levels.
#[derive(Debug)]
pub struct DirectionalMap {
    gpu: Gpu,
    map: Parametrization,
    border: u32,
    levels: Vec<MapLevel>,
    greatest_solid_angle: f64,
    /// The levels on the device.
    table: Buffer,
    texels: Buffer,
    solid_angles: Buffer,
    coarser: ComputePipeline<directional_coarser::Kernel>,
    borders: ComputePipeline<directional_border::Kernel>,
}

/// The number by which kernels know a map; `None` for those that they have no look-ups of.
pub(super) fn kind(map: Parametrization) -> Option<u32> {
    match map {
        Parametrization::OctahedronQuadratic => Some(DIRECTIONAL_OCTAHEDRON),
        Parametrization::OctahedronRectangular => Some(DIRECTIONAL_OCTAHEDRON_RECTANGULAR),
        Parametrization::EqualArea => Some(DIRECTIONAL_EQUAL_AREA),
        Parametrization::LatLong => Some(DIRECTIONAL_LAT_LONG),
        Parametrization::Cube => Some(DIRECTIONAL_CUBE),
        Parametrization::DualParaboloid => Some(DIRECTIONAL_PARABOLOID),
        Parametrization::Sphere => Some(DIRECTIONAL_SPHERE),
        Parametrization::Nusselt => Some(DIRECTIONAL_NUSSELT),
        Parametrization::OctahedronPerspective { .. } => None,
    }
}

/// Whether texels of a map's borders are texels of its one layer.
fn has_borders(map: Parametrization) -> bool {
    map.layers() == 1 && !map.is_disc()
}

/// The specialization constants of kernels that look maps up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DirectionalConstants {
    /// `DIRECTIONAL_KIND`.
    pub kind: u32,
    /// `DIRECTIONAL_BORDER`.
    pub border: i32,
}

impl DirectionalMap {
    /// A black map of `levels` levels, each half the last, with `border` texels about each.
    ///
    /// # Errors
    /// [`Error::Setting`] for an octahedron with c other than 1, for a size that the map cannot have or that cannot be halved as often, for
    /// one of odd width over poles, for a border of the cube or of discs, or for one wider than the last level; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, map: Parametrization, size: UVec2, levels: u32, border: u32) -> Result<Self> {
        let wrong = |name: &str, value: String, cause: &str| Err(Error::setting(name, value, cause));
        let Some(kind) = kind(map) else {
            return wrong(
                "map",
                map.to_string(),
                "has no look-ups on the device; octahedra with c = 1 and all others have",
            );
        };
        map.check_size(size)?;
        let halvings = levels.wrapping_sub(1);
        let least = size.min_element();
        if halvings > least.trailing_zeros().min(size.max_element().trailing_zeros()) {
            return wrong(
                "levels",
                levels.to_string(),
                "are none, or more than the size can be halved",
            );
        }
        if map == Parametrization::LatLong && !(size.x >> halvings).is_multiple_of(2) {
            return wrong(
                "levels",
                levels.to_string(),
                "end in an odd width, whose texels have none opposite at the poles",
            );
        }
        if border > least >> halvings {
            return wrong("border", border.to_string(), "is wider than the last level");
        }
        if border > 0 && !has_borders(map) {
            return wrong("border", border.to_string(), "is none that the cube and discs have");
        }
        let tile = (size + 2 * border).as_u64vec2().element_product() * u64::from(map.layers());
        // All levels together are at most twice the first, borders included.
        let bytes = 2 * tile * size_of::<[f32; 3]>() as u64;
        gpu.caps().check_storage("directional map: texels", bytes)?;
        let (mut all, mut solid_angles) = (Vec::new(), Vec::new());
        let mut first = 0;
        for level in 0..levels {
            let size = size >> level;
            all.push(MapLevel {
                first,
                first_angle: solid_angles.len() as u32,
                size: size.as_ivec2().to_array(),
            });
            let of = MapImage::from_fn(map, size, |texel| DVec3::splat(map.texel_solid_angle(size, texel)))?;
            // Layers are alike.
            let layer = size.element_product() as usize;
            solid_angles.extend(of.texels()[..layer].iter().map(|angle| angle.x));
            first += (size + 2 * border).element_product() * map.layers();
        }
        let bytes = u64::from(first) * size_of::<[f32; 3]>() as u64;
        let constants = DirectionalConstants {
            kind,
            border: border as i32,
        };
        let this = Self {
            gpu: gpu.clone(),
            map,
            border,
            levels: all.clone(),
            greatest_solid_angle: solid_angles[..size.element_product() as usize]
                .iter()
                .fold(0.0, |most, angle| most.max(f64::from(*angle))),
            table: gpu.buffer_with("directional map: levels", Category::Light, &all)?,
            texels: gpu.buffer(&BufferDesc::storage("directional map: texels", bytes, Category::Light))?,
            solid_angles: gpu.buffer_with("directional map: solid angles", Category::Light, &solid_angles)?,
            coarser: gpu.compute_pipeline(&directional_coarser::Spec {
                directional_kind: constants.kind,
                directional_border: constants.border,
            })?,
            borders: gpu.compute_pipeline(&directional_border::Spec {
                directional_kind: constants.kind,
                directional_border: constants.border,
            })?,
        };
        let mut recorder = gpu.recorder("directional map")?;
        recorder.pass("directional map: clear", |pass| pass.fill(this.texels.view(), 0))?;
        recorder.submit()?.wait()?;
        Ok(this)
    }

    /// Its parametrization.
    pub fn map(&self) -> Parametrization {
        self.map
    }

    /// Texels about each level.
    pub fn border(&self) -> u32 {
        self.border
    }

    /// Number of levels.
    pub fn levels(&self) -> u32 {
        self.levels.len() as u32
    }

    /// Texels of a level; `None` beyond the last.
    pub fn size(&self, level: u32) -> Option<UVec2> {
        let level = self.levels.get(level as usize)?;
        Some(UVec2::from_array(level.size.map(i32::cast_unsigned)))
    }

    /// Texels of all levels: three floats each, in the order of the levels' tiles.
    pub fn texels(&self) -> &Buffer {
        &self.texels
    }

    /// Where a level lies in the buffers.
    ///
    /// # Errors
    /// [`Error::Setting`] beyond the last.
    pub fn level(&self, level: u32) -> Result<MapLevel> {
        let beyond = || Error::setting("level", level, format!("is not among {}", self.levels.len()));
        self.levels.get(level as usize).copied().ok_or_else(beyond)
    }

    /// The kernels of its levels and borders, with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        vec![self.coarser.info(), self.borders.info()]
    }

    /// The specialization constants for kernels that look this map up.
    pub fn constants(&self) -> DirectionalConstants {
        DirectionalConstants {
            kind: kind(self.map).unwrap_or_default(),
            border: self.border as i32,
        }
    }

    /// Refuses maps of several layers or of discs, for what cannot do with them.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub(super) fn check_one_layer(&self) -> Result<()> {
        if has_borders(self.map) {
            return Ok(());
        }
        Err(Error::setting("map", self.map, "has several layers, or discs"))
    }

    /// Solid angle of the map's texels at level 0 at most, sr.
    pub(super) fn greatest_solid_angle(&self) -> f64 {
        self.greatest_solid_angle
    }

    /// The set that `maps/directional_map_set.glsl` reads.
    pub fn set(&self) -> DirectionalMapSet<'_> {
        DirectionalMapSet {
            map_levels: self.table.view(),
            map_texels: self.texels.view(),
            map_angles: self.solid_angles.view(),
        }
    }

    /// Puts an image of the level's size there; borders and other levels stay as they were.
    ///
    /// # Errors
    /// [`Error::Setting`] when map or size differ or there is no such level; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn upload(&self, level: u32, image: &MapImage) -> Result<()> {
        let at = self.level(level)?;
        let size = UVec2::from_array(at.size.map(i32::cast_unsigned));
        if image.map() != self.map || image.size() != size {
            let value = format!("{} of {}", image.map(), image.size());
            return Err(Error::setting("image", value, format!("is not {} of {size}", self.map)));
        }
        if self.border == 0 {
            let texels: Vec<[f32; 3]> = image.texels().iter().map(Vec3::to_array).collect();
            return self.gpu.upload(&self.texels, self.tile_view(at).offset, &texels);
        }
        let mut tile: Vec<[f32; 3]> = self.gpu.read(self.tile_view(at), self.tile_texels(at))?;
        for (y, row) in image.texels().chunks_exact(size.x as usize).enumerate() {
            let from = (y + self.border as usize) * (size.x + 2 * self.border) as usize + self.border as usize;
            for (to, texel) in tile[from..].iter_mut().zip(row) {
                *to = texel.to_array();
            }
        }
        self.gpu.upload(&self.texels, self.tile_view(at).offset, &tile)
    }

    fn tile_texels(&self, level: MapLevel) -> usize {
        let [x, y] = level.size.map(|side| side as usize + 2 * self.border as usize);
        x * y * self.map.layers() as usize
    }

    fn tile_view(&self, level: MapLevel) -> crate::gpu::BufferView<'_> {
        let bytes = size_of::<[f32; 3]>() as u64;
        self.texels
            .slice(bytes * u64::from(level.first), bytes * self.tile_texels(level) as u64)
    }

    /// A level with its border: extent and texels row by row, layers one below the other.
    ///
    /// # Errors
    /// [`Error::Setting`] beyond the last level; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read_tile(&self, level: u32) -> Result<(UVec2, Vec<Vec3>)> {
        let at = self.level(level)?;
        let texels: Vec<[f32; 3]> = self.gpu.read(self.tile_view(at), self.tile_texels(at))?;
        let mut extent = UVec2::from_array(at.size.map(i32::cast_unsigned)) + 2 * self.border;
        extent.y *= self.map.layers();
        Ok((extent, texels.into_iter().map(Vec3::from_array).collect()))
    }

    /// A level without its border.
    ///
    /// # Errors
    /// As [`DirectionalMap::read_tile`].
    pub fn read(&self, level: u32) -> Result<MapImage> {
        let (extent, texels) = self.read_tile(level)?;
        if self.border == 0 {
            let rows = extent.y / self.map.layers();
            return MapImage::new(self.map, UVec2::new(extent.x, rows), texels);
        }
        MapImage::from_strip(self.map, extent, self.border, &texels)
    }

    /// Records all levels from the first and the borders of all.
    ///
    /// Barriers: texels of level 0 must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and earlier uses must have
    /// ended. After it the texels are visible to compute shaders.
    ///
    /// # Errors
    /// As [`Pass::dispatch`].
    pub fn record_levels(&self, pass: &mut Pass<'_>) -> Result<()> {
        for pair in self.levels.windows(2) {
            let (fine, coarse) = (pair[0], pair[1]);
            let set = directional_coarser::Set0 {
                texels: self.texels.view(),
                solid_angles: self.solid_angles.view(),
            };
            let layers = self.map.layers();
            let count = (coarse.size[0] * coarse.size[1]).cast_unsigned() * layers;
            let push = directional_coarser::Push {
                fine,
                coarse,
                layers: layers.cast_signed(),
            };
            pass.dispatch(&self.coarser, &[&set], &push, self.coarser.groups_over(count))?;
            pass.barrier(&[rw_compute_to_compute(&self.texels)]);
        }
        for level in 0..self.levels() {
            self.record_border(pass, level)?;
        }
        Ok(())
    }

    /// Records the border of one level. Barriers: as [`DirectionalMap::record_levels`].
    ///
    /// # Errors
    /// [`Error::Setting`] beyond the last level, and as [`Pass::dispatch`].
    pub fn record_border(&self, pass: &mut Pass<'_>, level: u32) -> Result<()> {
        let level = self.level(level)?;
        let [width, height] = level.size.map(i32::cast_unsigned);
        let count = 2 * self.border * (width + 2 * self.border + height);
        if count == 0 {
            return Ok(());
        }
        let set = directional_border::Set0 {
            texels: self.texels.view(),
        };
        let groups = [self.borders.groups_for(count), 1, 1];
        pass.dispatch(&self.borders, &[&set], &directional_border::Push { level }, groups)?;
        // Levels share the buffer, not their texels.
        pass.barrier(&[rw_compute_to_compute(&self.texels)]);
        Ok(())
    }

    /// Fills all levels and borders from level 0, and waits.
    ///
    /// # Errors
    /// As [`DirectionalMap::record_levels`], [`Error::DeviceLost`].
    pub fn fill_levels(&self) -> Result<()> {
        let mut recorder = self.gpu.recorder("directional map")?;
        recorder.pass("directional map: levels and borders", |pass| {
            pass.barrier(&[transfer_to_compute(&self.texels)]);
            self.record_levels(pass)?;
            pass.barrier(&[compute_to_transfer(&self.texels)]);
            Ok(())
        })?;
        recorder.submit()?.wait()?;
        Ok(())
    }

    /// Radiance from unit directions (x, y, z of the map's axes) at levels of detail (w), trilinear, by the device. Black where the map holds
    /// none.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], and as [`Pass::dispatch`].
    pub fn look_up(&self, queries: &[Vec4]) -> Result<Vec<Vec3>> {
        let constants = self.constants();
        let pipeline = self
            .gpu
            .compute_pipeline::<directional_look_up::Kernel>(&directional_look_up::Spec {
                directional_kind: constants.kind,
                directional_border: constants.border,
            })?;
        answer(&self.gpu, queries, |pass, queries, values, count| {
            let set = directional_look_up::Set0 {
                queries: queries.view(),
                values: values.view(),
            };
            let groups = pipeline.groups_over(count);
            pass.dispatch(
                &pipeline,
                &[&set, &self.set()],
                &directional_look_up::Push { count },
                groups,
            )
        })
    }
}

/// Runs a kernel over queries and reads its values.
pub(super) fn answer(
    gpu: &Gpu,
    queries: &[Vec4],
    record: impl FnOnce(&mut Pass<'_>, &Buffer, &Buffer, u32) -> Result<()>,
) -> Result<Vec<Vec3>> {
    let words: Vec<[f32; 4]> = queries.iter().map(Vec4::to_array).collect();
    answer_of(gpu, &words, record)
}

/// The same of queries of any kind.
pub(super) fn answer_of<Q: bytemuck::Pod>(
    gpu: &Gpu,
    queries: &[Q],
    record: impl FnOnce(&mut Pass<'_>, &Buffer, &Buffer, u32) -> Result<()>,
) -> Result<Vec<Vec3>> {
    if queries.is_empty() {
        return Ok(Vec::new());
    }
    let count = queries.len() as u32;
    let asked = gpu.buffer_with("directional map: queries", Category::Light, queries)?;
    let bytes = u64::from(count) * size_of::<[f32; 3]>() as u64;
    let values = gpu.buffer(&BufferDesc::storage("directional map: values", bytes, Category::Light))?;
    let mut recorder = gpu.recorder("directional map")?;
    recorder.pass("directional map: look-ups", |pass| record(pass, &asked, &values, count))?;
    recorder.submit()?.wait()?;
    let values: Vec<[f32; 3]> = gpu.read(values.view(), queries.len())?;
    Ok(values.into_iter().map(Vec3::from_array).collect())
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "OEM-5",
    name: "look-ups in octahedron maps: unfiltered, repaired levels of detail, borders at each level",
    role: Role::Kernel,
    limits: "Bilinear in the map, not on the sphere; cubes and discs have no borders, so texels there share the weight of missing ones.",
    sources: &[
        sources::ENGELHARDT_DACHSBACHER_2008.whole(),
        sources::ENGELHARDT_2013.at("7.2.2"),
    ],
    shaders: &[
        "shaders/maps/directional_border.comp",
        "shaders/maps/directional_coarser.comp",
        "shaders/maps/directional_look_up.comp",
    ],
    tests: &[
        "tests/tests/maps/directional_maps.rs::borders_are_texels_of_the_inside",
        "tests/tests/maps/directional_maps.rs::levels_keep_the_integral",
        "tests/tests/maps/directional_maps.rs::look_ups_are_seamless",
        "tests/tests/maps/directional_maps.rs::seams_hold_no_energy",
        "tests/tests/maps/directional_maps.rs::constant_radiance_stays_constant",
        "tests/tests/twins/maps.rs::levels_borders_and_words_agree_with_their_twins",
        "engine/src/maps/tests/levels.rs::the_mirrored_direction_repairs_the_lower_seams",
        "engine/src/maps/tests/levels.rs::the_octants_own_map_has_no_seams",
        "engine/src/maps/tests/seams.rs::border_texels_touch_what_they_repeat",
        "engine/src/maps/tests/seams.rs::look_ups_are_continuous_over_seams",
        "engine/src/maps/tests/glossy.rs::levels_keep_the_integral",
    ],
    api: &["clerestory::maps::directional_map::DirectionalMap"],
    ..Row::of(file!())
}];
