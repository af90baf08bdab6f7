//! Omnidirectional shadow maps: what is nearest to a point light in every direction, and which places its light does not reach.
//!
//! Sources: L. Williams, "Casting Curved Shadows on Curved Surfaces", SIGGRAPH 1978 (shadow maps); P. Gerasimov, "Omnidirectional Shadow
//! Mapping", GPU Gems, 2004 (cube maps of distances); T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", VMV 2008 (octahedra);
//! W. Reeves, D. Salesin, R. Cook, "Rendering Antialiased Shadows with Depth Maps", SIGGRAPH 1987 (filtering of comparisons); D. Holbert,
//! "Saying Goodbye to Shadow Acne", GDC 2011 (receivers moved along their normal); J. Isidoro, "Shadow Mapping: GPU-based Tips and
//! Techniques", GDC 2006 (the receiver's plane). Maps hold Euclidean distances from the light, of texel centres, in metres.
//!
//! No constant has a unit of length. A place is compared with texels so:
//!
//! 1. *Threshold.* Along the direction of a texel's centre a place is in shadow of what is nearer than the place's own plane there, or than the
//!    place itself where that is nearer ([`shadow_threshold`]): a plane never shades itself, at any slope, with any filter.
//! 2. *Move of the plane.* So that surfaces which fold towards the light do not shade each other, the plane is moved to the light's side by a
//!    texel's diagonal at that distance ([`shadow_texel_radius`]) times one more than the filter's width in texels, by an eighth of the light's
//!    height over it at most; and, whatever that height, by how far rounding may take the position off its plane ([`ShadowPlace::slack`]). Where the
//!    light is no higher than that nothing shades the place: on which side of the plane it is nobody knows.
//! 3. *Move of the look-up.* The map is looked up for the place half a diagonal off its surface, where a texel more often holds what is in front of
//!    the surface than the surface itself.
//!
//! Filters are percentage-closer filtering (PCF): shares of a square of texels that are not nearer than the threshold, `width` texels wide about the
//! place, with the texels at its rim weighted by how much of them it covers.
//!
//! # Bias
//!
//! - The border of a shadow is that of texels, off by half of one on average: errors fall as one over the texels along a side, as long as what
//!   casts and what receives shadows is larger than texels at its distance.
//! - What is smaller, such as furniture close to the floor of a wide room, is wrong as a whole: in `builtin:conference` a third of the places that face the
//!   light with 6,000 texels, 7 % in a cube and 9 % in an octahedron with 6.3 million, and errors fall by less than the root of the texels along a side
//!   (experiment `shadow-maps`).
//! - What lies within the move of the plane off a surface casts no shadow on it: contact shadows begin `width + 1` texel diagonals late.
//! - Folds whose other side light grazes stay darker within a texel.
//! - Far sides of walls thinner than the move count as lit where they are asked for; who shades sees that light comes from behind.
//! - What is nearer to the light than the near plane ([`View::near_plane`]) casts no shadow.
//! - Filtered borders are as wide as the filter, whatever the light's size.
//! - All that is drawn is opaque: partial alpha and glass cast full shadows.
//!
//! Deterministic. GLSL: `raster/omni_shadow.glsl` and `raster/omni_shadow_set.glsl`; the twin of a look-up is [`OmniShadowImage::visibility`].

use glam::{DVec3, IVec2, UVec2, Vec3};

use super::coverage::DrawPart;
use super::{GBuffer, GBufferDesc, Layering, OctantCut, Output, Surfaces, View};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{SHADOW_CUBE, SHADOW_FOLD, SHADOW_MOVE_MAX, SHADOW_OCTAHEDRON, SHADOW_ROUNDING};
use crate::gpu::shaders::raster::omni_shadow_look_up as kernel;
use crate::gpu::shaders::sets::OmniShadowSet;
use crate::gpu::shaders::types::ShadowQuery;
use crate::gpu::{Access, Area, Buffer, BufferBarrier, BufferDesc, Category, Gpu, PipelineInfo, Recorder, Timings};
use crate::maps::cube::{CUBE_FACES, cube_decode, cube_encode};
use crate::maps::octahedron::OctahedronLayout;
use crate::maps::topology::octahedron_wrap;
use crate::maps::{Parametrization, Texel};
use crate::{Error, Result};

/// How directions lie in the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShadowLayout {
    /// Six square faces.
    Cube,
    /// One square.
    Octahedron,
}

impl ShadowLayout {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Cube, Self::Octahedron];

    /// Its name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cube => "cube",
            Self::Octahedron => "octahedron",
        }
    }

    /// The map of directions.
    pub const fn map(self) -> Parametrization {
        match self {
            Self::Cube => Parametrization::Cube,
            Self::Octahedron => Parametrization::OctahedronQuadratic,
        }
    }

    /// Layers of `side` × `side` texels.
    pub const fn layers(self) -> u32 {
        match self {
            Self::Cube => CUBE_FACES,
            Self::Octahedron => 1,
        }
    }

    /// The even side with as many texels, nearly, as that.
    pub fn side_for(self, texels: u64) -> u32 {
        let side = (texels as f64 / f64::from(self.layers())).sqrt();
        2 * ((0.5 * side).round() as u32).max(1)
    }

    /// The number by which kernels know it.
    pub const fn kind(self) -> u32 {
        match self {
            Self::Cube => SHADOW_CUBE,
            Self::Octahedron => SHADOW_OCTAHEDRON,
        }
    }
}

/// What [`OmniShadowMaps`] are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OmniShadowDesc {
    /// How directions lie in each map.
    pub layout: ShadowLayout,
    /// Texels across and down of each layer.
    pub side: u32,
    /// Lights that have a map, at most; [`SHADOW_MAPS_MAX`] at most.
    pub maps: u32,
}

impl OmniShadowDesc {
    /// Texels of one map.
    pub fn texels(&self) -> u64 {
        u64::from(self.layout.layers()) * u64::from(self.side) * u64::from(self.side)
    }

    /// Refuses what [`OmniShadowMaps::new`] does before it allocates anything; gives the bytes of all maps.
    pub(crate) fn check(&self, gpu: &Gpu) -> Result<u64> {
        if self.side == 0 || self.maps == 0 {
            let value = format!("{} of side {}", self.maps, self.side);
            return Err(Error::setting("shadow maps", value, "are none"));
        }
        if self.maps > SHADOW_MAPS_MAX {
            let cause = format!("are more than {SHADOW_MAPS_MAX}, of which each takes two passes");
            return Err(Error::setting("shadow maps", self.maps, cause));
        }
        let bytes = (self.texels())
            .saturating_mul(u64::from(self.maps))
            .saturating_mul(size_of::<f32>() as u64);
        gpu.caps().check_storage("shadow maps", bytes)?;
        Ok(bytes)
    }
}

/// Width of a filter at most, texels: wider ones blur more than what they are wrong by, and cost its square.
pub const SHADOW_WIDTH_MAX: u32 = 8;
/// Maps at most: two passes each take half of those that a command buffer times.
pub const SHADOW_MAPS_MAX: u32 = 256;

/// Refuses filters that are wider than [`SHADOW_WIDTH_MAX`] or than a map: what lies beyond the edges is known for one side's length.
pub(crate) fn check_width(width: u32, side: u32) -> Result<()> {
    let most = SHADOW_WIDTH_MAX.min(side);
    if width <= most {
        return Ok(());
    }
    Err(Error::setting(
        "shadow width",
        width,
        format!("is more than {most} texels"),
    ))
}

/// Iterations of the loops over a filter's texels, for one light.
pub(crate) fn filter_iterations(width: u32) -> u64 {
    let count = u64::from(width) + 1;
    if width == 0 { 0 } else { count * (count + 1) }
}

/// A place on a surface, as light may reach it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowPlace {
    /// Metres.
    pub position: Vec3,
    /// Geometric normal, of length 1, of either side.
    pub normal: Vec3,
    /// How far the position may be off its surface, metres: `|normal|·error` of a [`SurfacePoint`](crate::accel::offset::SurfacePoint).
    pub slack: f32,
}

impl ShadowPlace {
    /// What kernels that look up are asked.
    pub(super) fn query(&self) -> ShadowQuery {
        ShadowQuery {
            position: self.position.to_array(),
            slack: self.slack,
            normal: self.normal.to_array(),
        }
    }
}

/// Shadow maps of point lights, all of one layout and size, in one buffer.
#[derive(Debug)]
pub struct OmniShadowMaps {
    gpu: Gpu,
    desc: OmniShadowDesc,
    gbuffer: GBuffer,
    distances: Buffer,
}

impl OmniShadowMaps {
    /// Allocates the maps, and makes the pipeline that draws these surfaces. Nothing is in shadow before [`OmniShadowMaps::record`].
    ///
    /// # Errors
    /// [`Error::Setting`] for no texels, or maps other than 1 to [`SHADOW_MAPS_MAX`] in number; [`Error::LimitExceeded`] for more than a storage buffer or an image holds;
    /// [`Error::MissingFeature`] for octahedra where clip distances are missing; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, surfaces: &Surfaces<'_>, desc: OmniShadowDesc) -> Result<Self> {
        let bytes = desc.check(gpu)?;
        let gbuffer = GBuffer::new(
            gpu,
            surfaces,
            &GBufferDesc {
                size: [desc.side; 2],
                layering: match desc.layout {
                    ShadowLayout::Cube => Layering::of_layers(gpu.caps(), CUBE_FACES),
                    ShadowLayout::Octahedron => Layering::Octants(OctantCut::default()),
                },
                outputs: &[Output::Distance],
            },
        )?;
        let distances = gpu.buffer(&BufferDesc::storage("shadow maps", bytes, Category::Light))?;
        let mut recorder = gpu.recorder("shadow maps")?;
        recorder.pass("shadow maps: clear", |pass| {
            pass.fill(distances.view(), f32::INFINITY.to_bits())
        })?;
        recorder.submit()?.wait()?;
        Ok(Self {
            gpu: gpu.clone(),
            desc,
            gbuffer,
            distances,
        })
    }

    /// What they are.
    pub fn desc(&self) -> OmniShadowDesc {
        self.desc
    }

    /// The shaders that draw them, with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        self.gbuffer.pipelines()
    }

    /// Bytes of the maps and of the pictures that they are drawn in.
    pub fn bytes(&self) -> u64 {
        self.gbuffer.bytes() + self.distances.bytes()
    }

    /// The set that `raster/omni_shadow_set.glsl` reads.
    pub fn set(&self) -> OmniShadowSet<'_> {
        OmniShadowSet {
            shadow_distances: self.distances.view(),
        }
    }

    /// Records two passes a light: the surfaces from there, and their distances into its map, in the order of `lights` (places in metres). Other maps stay as
    /// they are. Earlier uses of the maps by compute shaders are waited for; afterwards they are visible to compute shaders.
    ///
    /// # Errors
    /// [`Error::Setting`] for more lights than maps, places that are not finite, or surfaces with other features than those they were made
    /// for; [`Error::MissingBarrier`] in debug builds.
    pub fn record(&self, recorder: &mut Recorder, surfaces: &Surfaces<'_>, lights: &[Vec3]) -> Result<()> {
        if lights.len() > self.desc.maps as usize {
            let cause = format!("are more than the {} shadow maps", self.desc.maps);
            return Err(Error::setting("lights", lights.len(), cause));
        }
        for (map, light) in (0..).zip(lights) {
            let views = self.views(surfaces, *light)?;
            self.record_part(recorder, surfaces, map, &views, &DrawPart::whole(surfaces))?;
        }
        Ok(())
    }

    /// As [`OmniShadowMaps::record`], a part of the triangles into the map of one light, which has its distances with the last part.
    ///
    /// # Errors
    /// As [`OmniShadowMaps::record`].
    pub(crate) fn record_part(
        &self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        map: u32,
        views: &[View],
        part: &DrawPart,
    ) -> Result<()> {
        self.check(map)?;
        self.gbuffer.record_part(recorder, surfaces, views, part)?;
        if !part.ends {
            return Ok(());
        }
        let bytes = self.desc.texels() * size_of::<f32>() as u64;
        let barrier = |from, to| BufferBarrier {
            buffer: &self.distances,
            from,
            to,
        };
        recorder.pass("shadow maps: distances", |pass| {
            let Some(image) = self.gbuffer.image(Output::Distance) else {
                return Ok(());
            };
            pass.barrier(&[barrier(Access::COMPUTE_READ, Access::TRANSFER_WRITE)]);
            let source = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
            self.gbuffer.barrier_to(pass, Access::TRANSFER_READ, source);
            pass.copy_image_to_buffer(image, self.distances.slice(u64::from(map) * bytes, bytes))?;
            pass.barrier(&[barrier(Access::TRANSFER_WRITE, Access::COMPUTE_READ)]);
            Ok(())
        })
    }

    /// From a light's place, as its map is drawn.
    pub(crate) fn views(&self, surfaces: &Surfaces<'_>, light: Vec3) -> Result<Vec<View>> {
        let near = View::near_plane(light, surfaces);
        let area = Area::whole([self.desc.side; 2]);
        match self.desc.layout {
            ShadowLayout::Cube => (0..CUBE_FACES)
                .map(|face| View::of_cube_face(light, face, near, area))
                .collect(),
            ShadowLayout::Octahedron => View::of_octants(light, OctahedronLayout::Quadratic, near, area),
        }
    }

    /// Shares of a light's light that reach places, by the device: the light's place and its map's number, and the filter's width in texels
    /// (0 for none, [`SHADOW_WIDTH_MAX`] and the map's side at most).
    ///
    /// # Errors
    /// [`Error::Setting`] for a map that does not exist or a filter that is too wide; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn look_up(&self, map: u32, light: Vec3, width: u32, places: &[ShadowPlace]) -> Result<Vec<f32>> {
        Ok(self.look_up_timed(map, light, width, places)?.0)
    }

    /// As [`OmniShadowMaps::look_up`], with the times of the one pass.
    ///
    /// # Errors
    /// As [`OmniShadowMaps::look_up`].
    pub fn look_up_timed(
        &self,
        map: u32,
        light: Vec3,
        width: u32,
        places: &[ShadowPlace],
    ) -> Result<(Vec<f32>, Timings)> {
        self.check(map)?;
        check_width(width, self.desc.side)?;
        if places.is_empty() {
            return Ok(Default::default());
        }
        let pipeline = self.gpu.compute_pipeline::<kernel::Kernel>(&kernel::Spec {
            shadow_kind: self.desc.layout.kind(),
            shadow_width: width as i32,
        })?;
        let queries: Vec<ShadowQuery> = places.iter().map(ShadowPlace::query).collect();
        let queries = self.gpu.buffer_with("shadow queries", Category::Work, &queries)?;
        let bytes = size_of::<f32>() as u64 * places.len() as u64;
        let shares = self
            .gpu
            .buffer(&BufferDesc::storage("shadow shares", bytes, Category::Work))?;
        let mut recorder = self.gpu.recorder("shadow maps")?;
        recorder.pass("shadow maps: look-ups", |pass| {
            let set = kernel::Set0 {
                queries: queries.view(),
                shares: shares.view(),
            };
            let count = places.len() as u32;
            let push = kernel::Push {
                light: light.to_array(),
                count,
                map,
                side: self.desc.side as i32,
            };
            let groups = pipeline.groups_over(count);
            pass.dispatch(&pipeline, &[&set, &self.set()], &push, groups)
        })?;
        let timings = recorder.submit()?.wait()?;
        Ok((self.gpu.read(shares.view(), places.len())?, timings))
    }

    /// A map on the host.
    ///
    /// # Errors
    /// [`Error::Setting`] for one that does not exist; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read(&self, map: u32) -> Result<OmniShadowImage> {
        self.check(map)?;
        let texels = self.desc.texels();
        let bytes = texels * size_of::<f32>() as u64;
        let distances = self
            .gpu
            .read(self.distances.slice(u64::from(map) * bytes, bytes), texels as usize)?;
        Ok(OmniShadowImage {
            layout: self.desc.layout,
            side: self.desc.side,
            distances,
        })
    }

    fn check(&self, map: u32) -> Result<()> {
        if map < self.desc.maps {
            return Ok(());
        }
        Err(Error::setting(
            "shadow map",
            map,
            format!("is not among {}", self.desc.maps),
        ))
    }
}

/// A shadow map on the host.
#[derive(Debug, Clone, PartialEq)]
pub struct OmniShadowImage {
    /// How directions lie in it.
    pub layout: ShadowLayout,
    /// Texels across and down of each layer.
    pub side: u32,
    /// Metres, layer by layer, row by row; infinite where there is nothing.
    pub distances: Vec<f32>,
}

/// A place that light reaches or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowReceiver {
    /// From the light to where it is looked up, metres.
    pub to: DVec3,
    /// From the light, metres.
    pub distance: f64,
    /// Of the surface, to the side of the light.
    pub normal: DVec3,
    /// Of the light over the surface's plane, which is moved towards the light, metres; 0 where the light may be in the plane.
    pub height: f64,
}

/// Half the diagonal of a square as large as the texel about a direction, radians, in a map of `side` × `side` texels per layer.
pub fn shadow_texel_radius(layout: ShadowLayout, d: DVec3, side: u32) -> f64 {
    let map = layout.map();
    let density = map.encode(d).map_or(0.0, |at| map.solid_angle_density(at.uv));
    (0.5 * density).sqrt() / f64::from(side)
}

/// The receiver at a position with a normal (unit, of either side) that may be off its plane by `slack`, for a filter `width` texels wide.
pub fn shadow_receiver(
    layout: ShadowLayout,
    side: u32,
    width: u32,
    light: DVec3,
    [position, normal]: [DVec3; 2],
    slack: f64,
) -> ShadowReceiver {
    let to = position - light;
    let normal = if normal.dot(to) > 0.0 { -normal } else { normal };
    let distance = to.length();
    let half_texel = distance * shadow_texel_radius(layout, to, side);
    let height = -normal.dot(to);
    let fold = f64::from(SHADOW_FOLD) * half_texel * (f64::from(width) + 1.0);
    let fold = fold.min(f64::from(SHADOW_MOVE_MAX) * height);
    ShadowReceiver {
        to: to + half_texel * normal,
        distance,
        normal,
        height: (height - fold - slack).max(0.0),
    }
}

/// What is nearer than this along a unit direction shades the receiver: its moved plane, or its distance where that is nearer, metres; 0 where the
/// light may be in the plane.
pub fn shadow_threshold(r: &ShadowReceiver, direction: DVec3) -> f64 {
    if r.height <= 0.0 {
        return 0.0;
    }
    let fall = -r.normal.dot(direction);
    let is_met = r.height < fall * r.distance;
    let plane = if is_met { r.height / fall } else { r.distance };
    plane * (1.0 - f64::from(SHADOW_ROUNDING))
}

impl OmniShadowImage {
    /// Share of the light that reaches a place on a surface: the twin of `omni_shadow_visibility`. The filter's width, texels, is
    /// [`SHADOW_WIDTH_MAX`] and the map's side at most; greater counts as that.
    pub fn visibility(&self, light: Vec3, width: u32, place: &ShadowPlace) -> f64 {
        let width = width.min(SHADOW_WIDTH_MAX).min(self.side);
        let surface = [place.position, place.normal].map(|v| v.as_dvec3());
        let slack = f64::from(place.slack);
        let r = shadow_receiver(self.layout, self.side, width, light.as_dvec3(), surface, slack);
        let Some(at) = self.layout.map().encode(r.to) else {
            return 1.0;
        };
        let at_texel = at.uv * f64::from(self.side);
        if width == 0 {
            let nearest = at_texel.as_ivec2().min(IVec2::splat(self.side as i32 - 1));
            return self.tap(&r, at.layer, nearest);
        }
        let low = at_texel - 0.5 * f64::from(width);
        let (first, part) = (low.floor(), low - low.floor());
        let weight = |i: u32, part: f64| match i {
            0 => 1.0 - part,
            last if last == width => part,
            _ => 1.0,
        };
        let all = (0..=width).flat_map(|y| (0..=width).map(move |x| UVec2::new(x, y)));
        let sum: f64 = all
            .map(|step| {
                let share = weight(step.x, part.x) * weight(step.y, part.y);
                share * self.tap(&r, at.layer, first.as_ivec2() + step.as_ivec2())
            })
            .sum();
        sum / f64::from(width * width)
    }

    fn tap(&self, r: &ShadowReceiver, layer: u32, at: IVec2) -> f64 {
        let (map, size) = (self.layout.map(), UVec2::splat(self.side));
        let texel = self.wrap(layer, at);
        let direction = map.texel_direction(size, texel).unwrap_or(DVec3::Z);
        let index = (texel.layer * self.side + texel.y) * self.side + texel.x;
        let seen = f64::from(self.distances[index as usize]);
        if seen < shadow_threshold(r, direction) {
            0.0
        } else {
            1.0
        }
    }

    /// The texel that one beyond the edges repeats: of a cube the one that holds the direction of its centre.
    fn wrap(&self, layer: u32, at: IVec2) -> Texel {
        let side = self.side as i32;
        let is_inside = at.min_element() >= 0 && at.max_element() < side;
        let (layer, at) = match self.layout {
            ShadowLayout::Octahedron => (0, octahedron_wrap(at, IVec2::splat(side))),
            ShadowLayout::Cube if is_inside => (layer, at),
            ShadowLayout::Cube => {
                let uv = (2.0 * at.as_dvec2() + 1.0) / f64::from(side) - 1.0;
                let (face, uv) = cube_encode(cube_decode(layer, uv));
                let place = (0.5 * uv + 0.5) * f64::from(side);
                (
                    face,
                    place.floor().as_ivec2().clamp(IVec2::ZERO, IVec2::splat(side - 1)),
                )
            }
        };
        let at = at.as_uvec2();
        Texel {
            layer,
            x: at.x,
            y: at.y,
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "BG-10",
    name: "omnidirectional shadow maps of point lights, as cubes or octahedra",
    role: Role::PartOf("CL-PREVIEW"),
    limits: "Borders follow texels, and what is no larger than texels is wrong as a whole: a third of the places in the conference room with 6,000 texels, 7 to 9 % with 6.3 million; contact shadows begin late, whatever is nearer than the near plane casts none, and partial alpha and glass cast full ones.",
    sources: &[
        sources::WILLIAMS_1978.whole(),
        sources::GERASIMOV_2004.whole(),
        sources::ENGELHARDT_DACHSBACHER_2008.whole(),
        sources::HOLBERT_2011.whole(),
    ],
    shaders: &[
        "shaders/raster/omni_shadow.glsl",
        "shaders/raster/omni_shadow_look_up.comp",
        "shaders/raster/surface_layer.vert",
        "shaders/raster/surface_octant.vert",
        "shaders/raster/surface.frag",
    ],
    bias: Some(Bias::Biased(
        "borders of shadows are those of texels; what is no larger than texels is wrong as a whole; contact shadows begin `width + 1` texel diagonals late",
    )),
    tests: &[
        "engine/src/raster/omni_shadow/tests.rs::radii_are_those_of_texels",
        "engine/src/raster/omni_shadow/tests.rs::planes_do_not_shade_themselves",
        "engine/src/raster/omni_shadow/tests.rs::planes_do_not_shade_themselves_where_positions_are_rounded",
        "tests/tests/preview/shadows.rs::maps_agree_with_rays_but_for_the_borders_of_shadows",
        "tests/tests/preview/shadows.rs::lights_close_to_surfaces_and_in_planes_of_geometry_are_wrong_at_borders_alone",
        "tests/tests/preview/shadows.rs::shadows_do_not_depend_on_the_scale",
        "tests/tests/preview/shadows.rs::look_ups_are_their_twins",
        "tests/tests/preview/shadows.rs::filters_keep_the_mean",
        "tests/tests/preview/shadows.rs::convex_rooms_have_no_shadows",
        "tests/tests/preview/penumbra.rs::filtered_edges_are_ramps_about_the_edge",
        "tests/tests/twins/shadows.rs::shadow_maps_agree_with_their_twins",
    ],
    api: &["clerestory::raster::OmniShadowMaps"],
    settings: &[
        "clerestory::raster::OmniShadowDesc",
        "shadow_layout",
        "shadow_side",
        "shadow_width",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests;
