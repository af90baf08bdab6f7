//! Imperfect shadow maps: small octahedron maps of distances about many places, all drawn at once from points of the surfaces.
//!
//! Sources: T. Ritschel et al., "Imperfect Shadow Maps for Efficient Computation of Indirect Illumination", SIGGRAPH Asia 2008 (each map has points of its own of all
//! surfaces, splats as large as their share of the area, pull and push); M. Botsch et al., "High-Quality Surface Splatting on Today's GPUs", PBG 2005 (discs that are met
//! by the ray of each pixel). Departures: maps are octahedra of all directions, so that look-ups are those of exact maps; a splat is a disc in its surface's plane, and
//! a texel has the distance at which its ray meets it, not that of the disc's middle.
//!
//! 1. *Once.* Points lie on the triangles by area, [`STRATA`] for each point of a map, stored by triangle and weights, so that they move with what they lie on.
//! 2. *A frame.* Points come to their places; for every map and stratum one of its points is splatted, to [`ATLAS_REACH`] texels from its middle at most; the least distance
//!    of a texel stays, by integer atomics.
//! 3. *Pull.* A coarser texel has the mean of the nearest of four and of those of its surface, within [`ATLAS_SAME_SURFACE`] of its distance.
//! 4. *Push.* An empty texel takes what lies between the coarser ones about it, of the surface of the one that it lies in.
//!
//! # Bias
//!
//! Against maps of all triangles ([`OmniShadowMaps`](super::OmniShadowMaps)): discs hang over edges by their radius, so that silhouettes are too wide by as much, by half a texel's
//! diagonal at least; where no disc lies, surfaces behind show through; fills are as far as their neighbours, and spread over what sees nothing, where no receiver is either.
//! Planes through the origin, within what packed normals tell, are left out: of a light's own surface only what lies behind it would see it. Cut-outs are opaque. In a closed
//! room and maps of 32² texels 22, 9, 5 and 3 % of texels are off by a tenth at 128, 1,024, 4,096 and 16,384 points: errors fall by the power −0.4 of the points, until
//! what is left is half a texel about silhouettes.
//!
//! Guarantees: deterministic, in whatever order invocations come; which points a place has depends on its number alone, not on how maps are parted among
//! records. Twin: [`atlas_map`].

use glam::{DVec3, IVec2, Vec2, Vec3};

use super::splats::places_on;
use super::{OmniShadowImage, ShadowLayout, Surfaces, shadow_texel_radius};
use crate::accel::MAX_COORDINATE;
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{
    ATLAS_EMPTY, ATLAS_LEAST_ANGLE, ATLAS_NORMAL_ERROR, ATLAS_POSITION_ERROR, ATLAS_REACH, ATLAS_SAME_SURFACE,
    PACKED_NORMAL_BITS,
};
use crate::gpu::shaders::raster::{atlas_pull, atlas_push, atlas_splat, atlas_surfels};
use crate::gpu::shaders::sets::OmniShadowSet;
use crate::gpu::shaders::types::{AtlasLevel, OrientedSurfel, SceneTriangle, SurfelPlace};
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder,
    rw_compute_to_compute,
};
use crate::maps::octahedron::octahedron_encode;
use crate::maps::packed_direction::unpack_octahedral;
use crate::maps::topology::octahedron_wrap;
use crate::maps::{Parametrization, Texel};
pub use crate::scene::builtin::noise::hash as atlas_hash;
use crate::{Error, Result};

/// Points that a map's each is one of: so many maps have no point in common, about.
pub const STRATA: u32 = 16;
/// Area of a disc over its share of all surfaces: half of them again, so that fewer places lie under none. Larger ones fill maps better, and shade what is beside small things.
const OVERLAP: f64 = 1.5;

/// What a [`SplatAtlas`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SplatAtlasDesc {
    /// Texels across and down of a map.
    pub side: u32,
    /// Maps that are there at the same time.
    pub maps: u32,
    /// Points of a map, on all surfaces together.
    pub points: u32,
    /// Coarser levels that holes are filled from: as many as have whole texels, at most.
    pub fill_levels: u32,
}

impl SplatAtlasDesc {
    /// The map itself, and the coarser levels that holes are filled from; all maps of a level are one behind the other.
    fn levels(&self) -> Vec<AtlasLevel> {
        let coarser = self.fill_levels.min(self.side.trailing_zeros());
        let mut first = 0;
        (0..=coarser)
            .map(|level| {
                let side = self.side >> level;
                let this = AtlasLevel { first, side };
                first = first.saturating_add(self.maps.saturating_mul(side.saturating_mul(side)));
                this
            })
            .collect()
    }

    /// Bytes of a map with its coarser levels.
    pub fn map_bytes(&self) -> u64 {
        let one = Self { maps: 1, ..*self };
        let sides = one.levels().into_iter().map(|level| u64::from(level.side));
        sides.map(|side| side * side * size_of::<u32>() as u64).sum()
    }
}

/// Maps about many places, and the points that they are drawn from.
#[derive(Debug)]
pub struct SplatAtlas {
    gpu: Gpu,
    desc: SplatAtlasDesc,
    levels: Vec<AtlasLevel>,
    /// Of a disc, metres.
    radius: f32,
    /// None where no surface has an area.
    count: u32,
    places: Buffer,
    surfels: Buffer,
    texels: Buffer,
    move_surfels: ComputePipeline<atlas_surfels::Kernel>,
    splat: ComputePipeline<atlas_splat::Kernel>,
    pull: ComputePipeline<atlas_pull::Kernel>,
    push: ComputePipeline<atlas_push::Kernel>,
}

impl SplatAtlas {
    /// Chooses points of the surfaces as they are now, and allocates the maps. Reads the triangles once; waits for the device.
    ///
    /// # Errors
    /// [`Error::Setting`] for no texels, maps or points; [`Error::LimitExceeded`] for more than a storage buffer holds; [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn new(gpu: &Gpu, surfaces: &Surfaces<'_>, desc: SplatAtlasDesc) -> Result<Self> {
        if desc.side == 0 || desc.maps == 0 || desc.points == 0 {
            let value = format!("{} of side {} with {} points", desc.maps, desc.side, desc.points);
            return Err(Error::setting("imperfect shadow maps", value, "are none"));
        }
        let bytes = desc.map_bytes().saturating_mul(u64::from(desc.maps));
        gpu.caps().check_storage("imperfect shadow maps", bytes)?;
        let pool = u64::from(desc.points) * u64::from(STRATA);
        let of_points = pool * size_of::<OrientedSurfel>() as u64;
        gpu.caps().check_storage("points of imperfect shadow maps", of_points)?;
        let triangles = surfaces.set.scene_triangles.buffer().view();
        let triangles: Vec<SceneTriangle> = gpu.read(triangles, surfaces.triangles as usize)?;
        let corners: Vec<_> = triangles
            .iter()
            .map(|t| [t.a, t.b, t.c].map(Vec3::from_array))
            .collect();
        let (mut places, area) = surfel_places(&corners, pool as u32);
        let count = places.len() as u32;
        // A buffer has at least one.
        places.resize(places.len().max(1), SurfelPlace::default());
        let storage = |name, bytes| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Light));
        Ok(Self {
            gpu: gpu.clone(),
            desc,
            levels: desc.levels(),
            radius: disc_radius(area, desc.points),
            count,
            surfels: storage("surfels", (places.len() * size_of::<OrientedSurfel>()) as u64)?,
            places: gpu.buffer_with("places of surfels", Category::Light, &places)?,
            texels: storage("imperfect shadow maps", bytes)?,
            move_surfels: gpu.compute_pipeline(&())?,
            splat: gpu.compute_pipeline(&())?,
            pull: gpu.compute_pipeline(&())?,
            push: gpu.compute_pipeline(&())?,
        })
    }

    /// What they are.
    pub fn desc(&self) -> SplatAtlasDesc {
        self.desc
    }

    /// Radius of discs, metres.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Points that are splatted into a map: none where no surface has an area.
    pub fn points(&self) -> u32 {
        self.count / STRATA
    }

    /// Bytes of the maps with their coarser levels, and of the points.
    pub fn bytes(&self) -> u64 {
        self.texels.bytes() + self.surfels.bytes() + self.places.bytes()
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = vec![self.move_surfels.info(), self.splat.info()];
        if self.levels.len() > 1 {
            all.extend([self.pull.info(), self.push.info()]);
        }
        all
    }

    /// The set that `raster/omni_shadow_set.glsl` reads, for [`ShadowLayout::Octahedron`].
    pub fn set(&self) -> OmniShadowSet<'_> {
        OmniShadowSet {
            shadow_distances: self.texels.view(),
        }
    }

    /// Records a pass that takes the points to where the surfaces are now. Before maps are drawn; the surfaces are those that the atlas was made for, in whatever places.
    ///
    /// # Errors
    /// As [`Pass::dispatch`](crate::gpu::Pass::dispatch).
    pub fn record_surfels(&self, recorder: &mut Recorder, surfaces: &Surfaces<'_>) -> Result<()> {
        recorder.pass("imperfect maps: points", |pass| {
            let barrier = |from, to| BufferBarrier {
                buffer: &self.surfels,
                from,
                to,
            };
            pass.barrier(&[barrier(Access::COMPUTE, Access::COMPUTE)]);
            let set = atlas_surfels::Set0 {
                surfel_places: self.places.view(),
                oriented_surfels: self.surfels.view(),
            };
            let groups = self.move_surfels.groups_over(self.count.max(1));
            let push = atlas_surfels::Push { count: self.count };
            pass.dispatch(&self.move_surfels, &[&set, &surfaces.set], &push, groups)?;
            pass.barrier(&[barrier(Access::COMPUTE, Access::COMPUTE_READ | Access::TRANSFER_READ)]);
            Ok(())
        })
    }

    /// Records passes that draw the maps of `maps` places, those of the atlas from `first_map` on, all at once: place `number` of the buffer of four words each comes first.
    /// Other maps stay as they are.
    ///
    /// Barriers: the places must have been made visible to [`Access::COMPUTE`], and earlier uses of the maps by compute shaders and copies are waited for; afterwards
    /// maps are visible to compute shaders and copies.
    ///
    /// # Errors
    /// [`Error::Setting`] for more maps than there are; as [`Pass::dispatch`](crate::gpu::Pass::dispatch).
    pub fn record(&self, recorder: &mut Recorder, origins: &Buffer, [number, first_map, maps]: [u32; 3]) -> Result<()> {
        if first_map.saturating_add(maps) > self.desc.maps {
            let cause = format!("are more than the {} imperfect shadow maps", self.desc.maps);
            return Err(Error::setting("maps", first_map.saturating_add(maps), cause));
        }
        if maps == 0 {
            return Ok(());
        }
        let barrier = |from, to| BufferBarrier {
            buffer: &self.texels,
            from,
            to,
        };
        recorder.pass("imperfect maps: splats", |pass| {
            let texels = u64::from(self.desc.side).pow(2);
            let bytes = texels * size_of::<u32>() as u64;
            let drawn = self.texels.slice(u64::from(first_map) * bytes, u64::from(maps) * bytes);
            pass.barrier(&[barrier(Access::COMPUTE | Access::TRANSFER, Access::TRANSFER_WRITE)]);
            pass.fill(drawn, ATLAS_EMPTY)?;
            pass.barrier(&[barrier(Access::TRANSFER_WRITE, Access::COMPUTE)]);
            let set = atlas_splat::Set0 {
                oriented_surfels: self.surfels.view(),
                map_origins: origins.view(),
                atlas_texels: self.texels.view(),
            };
            let points = self.points();
            if points > 0 {
                let push = atlas_splat::Push {
                    level: self.levels[0],
                    first_map,
                    maps,
                    number,
                    points,
                    strata: STRATA,
                    radius: self.radius,
                };
                let groups = self.splat.groups_over(maps * points);
                pass.dispatch(&self.splat, &[&set], &push, groups)?;
            }
            pass.barrier(&[rw_compute_to_compute(&self.texels)]);
            Ok(())
        })?;
        recorder.pass("imperfect maps: fill", |pass| {
            for pair in self.levels.windows(2) {
                let (fine, coarse) = (pair[0], pair[1]);
                let set = atlas_pull::Set0 {
                    atlas_texels: self.texels.view(),
                };
                let push = atlas_pull::Push {
                    fine,
                    coarse,
                    first_map,
                    maps,
                };
                let groups = self.pull.groups_over(maps * coarse.side * coarse.side);
                pass.dispatch(&self.pull, &[&set], &push, groups)?;
                pass.barrier(&[rw_compute_to_compute(&self.texels)]);
            }
            for pair in self.levels.windows(2).rev() {
                let (fine, coarse) = (pair[0], pair[1]);
                let set = atlas_push::Set0 {
                    atlas_texels: self.texels.view(),
                };
                let push = atlas_push::Push {
                    fine,
                    coarse,
                    first_map,
                    maps,
                };
                let groups = self.push.groups_over(maps * fine.side * fine.side);
                pass.dispatch(&self.push, &[&set], &push, groups)?;
                pass.barrier(&[rw_compute_to_compute(&self.texels)]);
            }
            pass.barrier(&[barrier(Access::COMPUTE, Access::COMPUTE_READ | Access::TRANSFER_READ)]);
            Ok(())
        })
    }

    /// Where the points are now, on the host: [`STRATA`] for each point of a map, one behind the other.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read_surfels(&self) -> Result<Vec<OrientedSurfel>> {
        self.gpu.read(self.surfels.view(), self.count as usize)
    }

    /// A map on the host.
    ///
    /// # Errors
    /// [`Error::Setting`] for one that does not exist; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read(&self, map: u32) -> Result<OmniShadowImage> {
        if map >= self.desc.maps {
            let cause = format!("is not among {}", self.desc.maps);
            return Err(Error::setting("imperfect shadow map", map, cause));
        }
        let texels = u64::from(self.desc.side).pow(2);
        let bytes = texels * size_of::<f32>() as u64;
        let slice = self.texels.slice(u64::from(map) * bytes, bytes);
        Ok(OmniShadowImage {
            layout: ShadowLayout::Octahedron,
            side: self.desc.side,
            distances: self.gpu.read(slice, texels as usize)?,
        })
    }
}

/// Radius of discs, metres, that so many points have on surfaces of that area, m².
fn disc_radius(area: f64, points: u32) -> f32 {
    (OVERLAP * area / (std::f64::consts::PI * f64::from(points))).sqrt() as f32
}

/// Points of triangles by area, as many as `count`, and that area, m².
fn surfel_places(triangles: &[[Vec3; 3]], count: u32) -> (Vec<SurfelPlace>, f64) {
    let (places, area) = places_on(triangles, count);
    let place = |(triangle, uv): (u32, glam::DVec2)| SurfelPlace {
        triangle,
        weights: uv.as_vec2().max(Vec2::ZERO).to_array(),
    };
    (places.map(place).collect(), area)
}

/// Which surfel of its stratum is the so many-th point of a map.
pub fn atlas_stratum(map: u32, point: u32, strata: u32) -> u32 {
    atlas_hash(atlas_hash(map).wrapping_add(point)) % strata
}

/// Texels from its middle that the disc of a surfel reaches, where texels have that half diagonal, radians; lengths in metres.
pub fn atlas_reach(distance: f64, radius: f64, half_diagonal: f64) -> i32 {
    let texels = (radius / (distance * half_diagonal * std::f64::consts::SQRT_2)).ceil();
    if texels < f64::from(ATLAS_REACH) {
        texels as i32
    } else {
        ATLAS_REACH
    }
}

/// Radius of a disc in the texel that its middle lies in, metres, for that height of the origin over its plane, metres, and half the texel's diagonal, radians.
pub fn atlas_middle_radius(distance: f64, height: f64, radius: f64, half_diagonal: f64) -> f64 {
    let cosine = (height / distance).max(f64::from(ATLAS_LEAST_ANGLE) * half_diagonal);
    radius.max(distance * half_diagonal / cosine)
}

/// Height over the plane of a point, metres, up to which the plane counts as one through the origin, from which nothing of it is seen: what packed normals and positions
/// err. Without it a light's own surface stood before the light, or behind, by chance.
pub fn atlas_slack(position: DVec3, distance: f64) -> f64 {
    f64::from(ATLAS_NORMAL_ERROR) * distance + f64::from(ATLAS_POSITION_ERROR) * position.abs().max_element()
}

/// How far a unit `direction` goes to the disc of that radius about a point, metres; infinite where it misses, and of planes no more than `slack` off, metres.
pub fn atlas_distance(p: DVec3, normal: DVec3, radius: f64, slack: f64, direction: DVec3) -> f64 {
    let height = normal.dot(p);
    let fall = height.signum() * normal.dot(direction);
    if fall <= 0.0 || height.abs() <= slack {
        return f64::INFINITY;
    }
    let along = height.abs() / fall;
    if (along * direction - p).length_squared() <= radius * radius {
        along
    } else {
        f64::INFINITY
    }
}

/// Twin of [`SplatAtlas`]: the map of a place by its number, in f64, row by row; infinite where nothing is.
pub fn atlas_map(
    surfels: &[OrientedSurfel],
    radius: f32,
    (number, origin): (u32, Vec3),
    side: u32,
    fill_levels: u32,
) -> Vec<f64> {
    let (map, size) = (Parametrization::OctahedronQuadratic, IVec2::splat(side as i32));
    let direction = |at: IVec2| {
        let [x, y] = at.as_uvec2().to_array();
        map.texel_direction(size.as_uvec2(), Texel { layer: 0, x, y })
            .unwrap_or(DVec3::Z)
    };
    let mut texels = vec![f64::INFINITY; (side * side) as usize];
    let radius = f64::from(radius);
    for (point, stratum) in (0..).zip(surfels.chunks_exact(STRATA as usize)) {
        let surfel = &stratum[atlas_stratum(number, point, STRATA) as usize];
        let p = (Vec3::from_array(surfel.position) - origin).as_dvec3();
        let distance = p.length();
        // Comparisons are false for NaN.
        if !(p.abs().max_element() <= f64::from(MAX_COORDINATE) && distance > 0.0) {
            continue;
        }
        let normal = unpack_octahedral(surfel.normal, PACKED_NORMAL_BITS);
        let half_diagonal = shadow_texel_radius(ShadowLayout::Octahedron, p, side);
        let reach = atlas_reach(distance, radius, half_diagonal);
        let slack = atlas_slack(Vec3::from_array(surfel.position).as_dvec3(), distance);
        let middle_radius = atlas_middle_radius(distance, normal.dot(p).abs(), radius, half_diagonal);
        let place = (0.5 + 0.5 * octahedron_encode(p)) * f64::from(side);
        let middle = place.as_ivec2().min(size - 1);
        for y in -reach..=reach {
            for x in -reach..=reach {
                let at = octahedron_wrap(middle + IVec2::new(x, y), size);
                let radius = if (x, y) == (0, 0) { middle_radius } else { radius };
                let found = atlas_distance(p, normal, radius, slack, direction(at));
                let texel = &mut texels[(at.y * size.x + at.x) as usize];
                *texel = texel.min(found);
            }
        }
    }
    let coarser = fill_levels.min(side.trailing_zeros());
    let mut levels = vec![texels];
    for level in 0..coarser {
        levels.push(atlas_pulled(&levels[level as usize], (side >> level) as usize));
    }
    while let Some(coarse) = levels.pop() {
        match levels.last_mut() {
            Some(fine) => atlas_pushed(fine, &coarse),
            None => return coarse,
        }
    }
    Vec::new()
}

/// Whether a distance is that of the surface of a nearer one, or about.
fn is_same_surface(distance: f64, of: f64) -> bool {
    (distance - of).abs() <= f64::from(ATLAS_SAME_SURFACE) * of
}

fn atlas_pulled(fine: &[f64], side: usize) -> Vec<f64> {
    let half = side / 2;
    let places = (0..half).flat_map(|y| (0..half).map(move |x| [x, y]));
    let pulled = places.map(|[x, y]| {
        let four = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| fine[(2 * y + j) * side + 2 * x + i]);
        let nearest = four.into_iter().fold(f64::INFINITY, f64::min);
        if nearest == f64::INFINITY {
            return nearest;
        }
        let same = four.into_iter().filter(|distance| is_same_surface(*distance, nearest));
        let (sum, count) = same.fold((0.0, 0.0), |(sum, count), distance| (sum + distance, count + 1.0));
        sum / count
    });
    pulled.collect()
}

fn atlas_pushed(fine: &mut [f64], coarse: &[f64]) {
    let half = (coarse.len() as f64).sqrt() as i32;
    for (index, texel) in (0..).zip(fine.iter_mut()) {
        let at = IVec2::new(index % (2 * half), index / (2 * half));
        let parent = at / 2;
        let own = coarse[(parent.y * half + parent.x) as usize];
        if *texel < f64::INFINITY || own == f64::INFINITY {
            continue;
        }
        let beside = 2 * (at % 2) - 1;
        let (mut sum, mut weights) = (0.0, 0.0);
        for offset in [IVec2::ZERO, IVec2::X, IVec2::Y, IVec2::ONE] {
            let other = octahedron_wrap(parent + offset * beside, IVec2::splat(half));
            let found = coarse[(other.y * half + other.x) as usize];
            let weight = [0.75, 0.25][offset.x as usize] * [0.75, 0.25][offset.y as usize];
            if is_same_surface(found, own) {
                sum += weight * found;
                weights += weight;
            }
        }
        *texel = sum / weights;
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "SVO-G3",
    name: "imperfect shadow maps: octahedra about many places at once, of discs about points of the surfaces, with holes filled (BG-11)",
    role: Role::PartOf("SVO-P12"),
    limits: "For visibility alone: further bounces come by walks, not from what points are seen; silhouettes are too wide by the radius of discs, surfaces show through where no disc lies, and cut-outs are opaque; texels off by a tenth fall by the power −0.4 of the points, from 22 % of 32² in a room with 128 to 3 % with 16,384; octahedra have both sides of a light's surface.",
    sources: &[
        sources::RITSCHEL_2008.whole(),
        sources::BOTSCH_2005.whole(),
        sources::JARZYNSKI_OLANO_2020.whole(),
        sources::SUN_2015.at("§2.2.3"),
    ],
    shaders: &[
        "shaders/raster/splat_atlas.glsl",
        "shaders/raster/atlas_surfels.comp",
        "shaders/raster/atlas_splat.comp",
        "shaders/raster/atlas_pull.comp",
        "shaders/raster/atlas_push.comp",
    ],
    bias: Some(Bias::Biased(
        "discs hang over silhouettes, surfaces show through between them, and holes are filled with what is about them",
    )),
    tests: &[
        "engine/src/raster/splat_atlas.rs::holes_take_what_is_of_their_surface",
        "engine/src/raster/splat_atlas.rs::points_are_stratified_by_area_and_differ_from_map_to_map",
        "tests/tests/raster/splat_atlas.rs::imperfect_maps_are_those_of_the_twin",
        "engine/src/raster/splat_atlas.rs::discs_are_met_in_their_plane",
        "tests/tests/raster/splat_atlas.rs::imperfect_maps_come_to_exact_ones_with_more_points",
        "tests/tests/raster/splat_atlas.rs::surfaces_do_not_stand_before_lights_on_them",
        "tests/tests/raster/splat_atlas.rs::maps_do_not_depend_on_how_they_are_parted",
        "tests/tests/instant_radiosity/many_light.rs::errors_of_visibility_fall_from_none_over_maps_to_rays",
    ],
    api: &["clerestory::raster::splat_atlas::SplatAtlas"],
    settings: &["visibility", "map_points", "map_fill"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_behind_each_other_and_end_with_whole_texels() {
        let desc = SplatAtlasDesc {
            side: 24,
            maps: 5,
            points: 1,
            fill_levels: 9,
        };
        let levels: Vec<_> = desc.levels().iter().map(|level| [level.first, level.side]).collect();
        let texels = [0, 576, 144, 36].map(|texels: u32| 5 * texels);
        assert_eq!(
            levels,
            [
                [0, 24],
                [texels[1], 12],
                [texels[1] + texels[2], 6],
                [texels[1] + texels[2] + texels[3], 3]
            ]
        );
        assert_eq!(desc.map_bytes(), 4 * (576 + 144 + 36 + 9));
    }

    #[test]
    fn holes_take_what_is_of_their_surface() {
        let nothing = f64::INFINITY;
        // Two of one surface, one behind it, and a hole.
        assert_eq!(atlas_pulled(&[1.0, 1.04, 2.0, nothing], 2), [1.02]);
        assert_eq!(atlas_pulled(&[nothing; 4], 2), [nothing]);
        // A coarse map with one texel empty and one far one.
        let coarse = [1.0, 1.04, nothing, 3.0];
        let mut fine = vec![nothing; 16];
        fine[5] = 7.0;
        atlas_pushed(&mut fine, &coarse);
        assert_eq!(fine[5], 7.0, "what is there stays");
        // Between the first and the second, which are of one surface, and the far one beside them has no weight.
        // Beyond the edge the map is turned about the edge's middle.
        let expected = (9.0 + 1.0 + (3.0 + 3.0) * 1.04) / 16.0;
        assert!((fine[1] - expected).abs() < 1e-12, "{}", fine[1]);
        assert!([8, 9, 12, 13].iter().all(|hole| fine[*hole] == nothing));
        assert_eq!(fine[10], 3.0);
    }

    #[test]
    fn points_are_stratified_by_area_and_differ_from_map_to_map() {
        let v = Vec3::new;
        let triangles = [
            [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)],
            [v(0.0, 0.0, 1.0), v(3.0, 0.0, 1.0), v(0.0, 1.0, 1.0)],
        ];
        let points = 400;
        let (places, area) = surfel_places(&triangles, points * STRATA);
        assert!((area - 2.0).abs() < 1e-12);
        let of_map = |map: u32| -> Vec<u32> {
            let point = |point| point * STRATA + atlas_stratum(map, point, STRATA);
            (0..points).map(point).collect()
        };
        for map in [0, 1, 77] {
            let on_first = of_map(map)
                .iter()
                .filter(|at| places[**at as usize].triangle == 0)
                .count();
            assert_eq!(on_first, 100, "a quarter of the area");
        }
        let common = of_map(3).iter().zip(of_map(4)).filter(|(a, b)| **a == *b).count();
        // One in STRATA by chance: 25 with a deviation of 4.8.
        assert!(common < 50, "{common}");
        let discs = std::f64::consts::PI * f64::from(disc_radius(area, points)).powi(2) * f64::from(points);
        assert!((discs / area - OVERLAP).abs() < 1e-5, "{discs}");
    }

    #[test]
    fn discs_are_met_in_their_plane() {
        let (p, slanted) = (DVec3::new(0.1, 0.0, 2.0), DVec3::new(0.6, 0.0, 0.8));
        let height = slanted.dot(p);
        for normal in [slanted, -slanted] {
            let found = atlas_distance(p, normal, 0.2, 0.01, DVec3::Z);
            assert!((found - height / 0.8).abs() < 1e-12);
            // 0.1 along x is 0.125 along the plane.
            assert_eq!(atlas_distance(p, normal, 0.12, 0.01, DVec3::Z), f64::INFINITY);
            assert_eq!(atlas_distance(p, normal, 0.2, 0.01, -DVec3::Z), f64::INFINITY);
            // A plane that is no farther off than errors stands before nothing.
            assert_eq!(atlas_distance(p, normal, 9.0, height, DVec3::Z), f64::INFINITY);
        }
        // In the texel of its middle a small disc is half a diagonal wide, more where its plane is slanted, up to half of its distance.
        for (height, radius) in [(2.0, 0.2), (1.0, 0.4), (0.0, 1.0)] {
            assert!(
                (atlas_middle_radius(2.0, height, 0.001, 0.1) - radius).abs() < 1e-9,
                "{height}"
            );
        }
        assert_eq!(atlas_middle_radius(2.0, 2.0, 0.3, 0.1), 0.3);
        assert_eq!(
            [0.001, 0.12, 5.0].map(|radius| atlas_reach(1.0, radius, 0.1)),
            [1, 1, ATLAS_REACH]
        );
        assert_eq!(
            atlas_reach(0.0, 0.0, 0.1),
            ATLAS_REACH,
            "a quotient that is not a number"
        );
    }
}
