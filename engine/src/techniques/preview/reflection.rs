//! Reflection maps: what is seen from a point in all directions, drawn anew each frame on one rectangle, with a summed-area table, so that any
//! stage looks mirrors and reflections of any glossiness up.
//!
//! Sources: T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", VMV 2008, §5; T. Engelhardt, PhD thesis, KIT, 2013, §7.3.2 and §7.3.3;
//! J. Blinn and M. Newell, "Texture and Reflection in Computer Generated Images", CACM 1976 (the latitude–longitude map, the other single rectangle).
//! The octahedron is drawn; a latitude–longitude map is made of it ([`to_lat_long`](crate::maps::to_lat_long)), which costs a pass more, and an arc
//! tangent in each look-up. Axes are the world's, with the pole along z.
//!
//! A mirror is a look-up of the map (`maps/directional_map_set.glsl`, at level 0), a glossy reflection one of boxes of the table
//! (`maps/spherical_sat.glsl`, [`box_lobe`](crate::maps::box_lobe)): where a [`LightProbe`] has few lobes, filtered beforehand, a table has boxes of
//! all sizes. Its numbers are pairs of f32, which take light of any brightness.
//!
//! Bias: radiance at texel centres stands for its mean over the texel; no parallax, as of [`LiveProbe`](super::LiveProbe). Boxes are squares of
//! the map: near the poles of the latitude–longitude map they are no caps but wedges across the pole, several times as wrong there as boxes of the
//! octahedron. Deterministic.

use glam::{UVec2, Vec3};

use super::Preview;
use super::live::LiveDrawing;
use super::probe::{LightProbe, ProbeMap};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::{Access, Gpu, Recorder};
use crate::maps::Parametrization;
use crate::maps::directional_map::DirectionalMap;
use crate::maps::spherical_sat::{SatNumbers, SatRange, SphericalSat};
use crate::maps::to_lat_long::ToLatLong;
use crate::raster::Surfaces;
use crate::transport::GpuScene;
use crate::{Error, Result};

/// Samples along a side of a latitude–longitude map's texel: two of the octahedron's texels are about as wide as one of as many texels.
const SAMPLES: u32 = 2;
/// Border of an octahedron that a latitude–longitude map is made of: bilinear look-ups.
const BILINEAR: u32 = 1;
/// Texels along a side at most.
const SIDE_MAX: u32 = 4096;

/// What a [`ReflectionMap`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReflectionMapDesc {
    /// Texels along a side of the octahedron that is drawn, 2 to 4096.
    pub side: u32,
    /// Rows of a latitude–longitude map that is made of it, twice as wide, and looked up in its place; `None` for the octahedron itself.
    pub lat_long: Option<u32>,
    /// Texels about the map that is looked up, 1 to its rows: what boxes reach beyond its edges
    /// ([`sat_border`](crate::maps::box_lobe::sat_border)).
    pub border: u32,
}

impl ReflectionMapDesc {
    fn check(self) -> Result<()> {
        let is_size = |texels: u32| (2..=SIDE_MAX).contains(&texels);
        if !is_size(self.side) {
            return Err(Error::setting("side", self.side, format!("is not 2 to {SIDE_MAX}")));
        }
        if let Some(rows) = self.lat_long
            && !is_size(rows)
        {
            return Err(Error::setting("lat_long", rows, format!("is not 2 to {SIDE_MAX}")));
        }
        let rows = self.lat_long.unwrap_or(self.side);
        if !(1..=rows).contains(&self.border) {
            return Err(Error::setting("border", self.border, format!("is not 1 to {rows}")));
        }
        Ok(())
    }
}

/// The latitude–longitude map, and what makes it.
#[derive(Debug)]
struct LatLong {
    map: DirectionalMap,
    of_octahedron: ToLatLong,
}

/// A reflection map of a scene, drawn on the device.
#[derive(Debug)]
pub struct ReflectionMap {
    desc: ReflectionMapDesc,
    drawing: LiveDrawing,
    octahedron: DirectionalMap,
    lat_long: Option<LatLong>,
    table: SphericalSat,
}

impl ReflectionMap {
    /// Allocates a map and what draws it; its surfaces are lit as those of the preview, and by probes that are octahedra where `has_probes` says so.
    ///
    /// # Errors
    /// [`Error::Setting`] for sizes out of range; [`Error::LimitExceeded`] for a map with its border wider than 4096 texels or beyond what buffers
    /// hold; [`Error::MissingFeature`] where clip distances are missing; [`Error::OutOfMemory`].
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        preview: &Preview,
        desc: ReflectionMapDesc,
        has_probes: bool,
    ) -> Result<Self> {
        desc.check()?;
        let drawn = Parametrization::OctahedronQuadratic;
        let border = desc.lat_long.map_or(desc.border, |_| BILINEAR);
        let octahedron = DirectionalMap::new(gpu, drawn, UVec2::splat(desc.side), 1, border)?;
        let lat_long = match desc.lat_long {
            None => None,
            Some(rows) => {
                let map = DirectionalMap::new(
                    gpu,
                    Parametrization::LatLong,
                    UVec2::new(2 * rows, rows),
                    1,
                    desc.border,
                )?;
                let of_octahedron = ToLatLong::new(gpu, &octahedron, &map, SAMPLES)?;
                Some(LatLong { map, of_octahedron })
            }
        };
        // Pairs of floats need to know nothing of the radiance.
        let range = SatRange {
            offset: Vec3::ZERO,
            deviation: 1.0,
        };
        let of = lat_long.as_ref().map_or(&octahedron, |lat_long| &lat_long.map);
        let table = SphericalSat::new(gpu, of, SatNumbers::TwoFloat, range)?;
        Ok(Self {
            desc,
            drawing: LiveDrawing::new(
                gpu,
                scene,
                preview.lights(),
                (ProbeMap::Octahedron, desc.side, &[]),
                has_probes.then_some(ProbeMap::Octahedron),
            )?,
            octahedron,
            lat_long,
            table,
        })
    }

    /// What it is.
    pub fn desc(&self) -> ReflectionMapDesc {
        self.desc
    }

    /// The map that is looked up.
    pub fn map(&self) -> &DirectionalMap {
        self.lat_long
            .as_ref()
            .map_or(&self.octahedron, |lat_long| &lat_long.map)
    }

    /// Its summed-area table.
    pub fn table(&self) -> &SphericalSat {
        &self.table
    }

    /// Bytes of its maps, of the table, and of the pictures that it is drawn by.
    pub fn bytes(&self) -> u64 {
        let lat_long = self
            .lat_long
            .as_ref()
            .map_or(0, |lat_long| lat_long.map.texels().bytes());
        self.octahedron.texels().bytes() + lat_long + self.table.bytes() + self.drawing.bytes()
    }

    /// Records what of `surfaces` is seen from a place (metres), its shading by the preview's lights and by a probe, the latitude–longitude map where
    /// there is one, the border, and the table: a pass each. Afterwards map and table are visible to compute shaders.
    ///
    /// # Errors
    /// As [`LiveProbe::record`](super::LiveProbe::record).
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        surfaces: &Surfaces<'_>,
        preview: &Preview,
        place: Vec3,
        by: Option<&LightProbe>,
    ) -> Result<()> {
        self.drawing
            .record(recorder, scene, surfaces, preview, (place, by), &self.octahedron)?;
        if let Some(LatLong { map, of_octahedron }) = &self.lat_long {
            recorder.pass("reflection: latitude and longitude", |pass| {
                self.octahedron.record_border(pass, 0)?;
                // What looked the frame before up has ended.
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
                of_octahedron.record(pass, &self.octahedron, map)
            })?;
        }
        recorder.pass("reflection: border", |pass| self.map().record_border(pass, 0))?;
        recorder.pass("reflection: table", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            self.table.record(pass, self.map())
        })
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "OEM-7",
    name: "reflection maps drawn each frame on one rectangle with a summed-area table: octahedra, and latitude–longitude maps made of them",
    role: Role::PartOf("CL-PREVIEW"),
    limits: "No parallax; within 15° of the poles of a latitude–longitude map boxes of a hundredth to a twentieth of a steradian are 3 to 10 times as far from caps as those of an octahedron of as many texels, under smooth light; tables take 32 bytes per texel, with a border as wide as the largest box.",
    sources: &[
        sources::ENGELHARDT_DACHSBACHER_2008.whole(),
        sources::ENGELHARDT_2013.at("7.3.2 and 7.3.3"),
        sources::BLINN_NEWELL_1976.whole(),
        sources::CROW_1984.whole(),
    ],
    shaders: &[
        "shaders/maps/lat_long_of_map.comp",
        "shaders/maps/sat_rows.comp",
        "shaders/maps/sat_columns.comp",
        "shaders/techniques/preview/preview_shade.comp",
        "shaders/raster/surface_octant.vert",
    ],
    bias: Some(Bias::Biased(
        "radiance at texel centres; parallax beside its place; boxes of the map for caps",
    )),
    needs: &["shaderClipDistance"],
    tests: &[
        "tests/tests/preview/reflections.rs::mirrors_show_what_rays_meet_in_either_form",
        "tests/tests/preview/reflections.rs::maps_of_a_frame_have_no_seams",
        "tests/tests/preview/reflections.rs::each_frame_is_drawn_anew",
        "tests/tests/preview/reflections.rs::tables_hold_the_means_of_boxes_of_the_frame",
        "tests/tests/preview/reflections.rs::sizes_that_cannot_be_are_refused",
        "tests/tests/maps/directional_maps.rs::latitude_longitude_maps_of_others_are_their_twins",
        "engine/src/maps/tests/places.rs::edges_are_straight_in_octants_and_bent_in_the_latitude_longitude_map",
        "engine/src/maps/tests/glossy.rs::boxes_near_the_poles_of_the_latitude_longitude_map_are_no_caps",
    ],
    api: &[
        "clerestory::techniques::preview::ReflectionMap",
        "clerestory::maps::to_lat_long::ToLatLong",
    ],
    settings: &["clerestory::techniques::preview::ReflectionMapDesc"],
    ..Row::of(file!())
}];
