//! Shadow maps of lights that one view covers: what is nearest to a spot in a square about its cone, and to parallel light in a square about the scene.
//!
//! Sources: L. Williams, "Casting Curved Shadows on Curved Surfaces", SIGGRAPH 1978 (shadow maps); W. Reeves, D. Salesin, R. Cook, "Rendering Antialiased Shadows with Depth
//! Maps", SIGGRAPH 1987 (percentage-closer filtering); C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", Master's thesis, WPI, 2015, §4.4 and §4.9.
//!
//! Maps hold distances along rays from where these begin, of texels' centres, in metres. A place is compared with texels as in [`OmniShadowMaps`](super::OmniShadowMaps), by its own plane
//! along each texel's ray, which is moved for folds by texels at its distance, so that no constant has a unit of length; and biases are the same. Filters are as wide as
//! there, in texels, and cost their square. What a map does not show is lit: beyond a spot's cone there is no light, and a beam's square holds all of the scene.
//!
//! Deterministic. GLSL: `raster/view_shadow.glsl` and `raster/view_shadow_set.glsl`; the twin of a look-up is [`ViewShadowImage::visibility`].

use glam::{DVec2, DVec3, IVec2, Vec3};

use super::coverage::DrawPart;
use super::omni_shadow::{ShadowPlace, check_width};
use super::{GBuffer, GBufferDesc, Layering, Output, SHADOW_MAPS_MAX, SHADOW_WIDTH_MAX, Surfaces, View};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{SHADOW_FOLD, SHADOW_MOVE_MAX, SHADOW_ROUNDING};
use crate::gpu::shaders::raster::view_shadow_look_up as kernel;
use crate::gpu::shaders::types::{ShadowQuery, ShadowView};
use crate::gpu::{Access, Area, Buffer, BufferBarrier, BufferDesc, BufferView, Category, Gpu, PipelineInfo, Recorder};
use crate::scene::LightKind;
use crate::{Error, Result};

/// Half angle up to which a spot has one view, radians: 60°.
const HALF_ANGLE_MAX: f32 = std::f32::consts::FRAC_PI_3;
/// The view's half angle over the spot's, so that texels at its rim lie within it.
const MARGIN: f32 = 1.01;
/// A narrower spot has a view as wide as one of this half angle, radians.
const HALF_ANGLE_MIN: f32 = 1e-4;

/// What [`ViewShadowMaps`] are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewShadowDesc {
    /// Texels across and down.
    pub side: u32,
    /// Lights that have a map, at most; [`SHADOW_MAPS_MAX`] at most.
    pub maps: u32,
}

impl ViewShadowDesc {
    fn texels(&self) -> u64 {
        u64::from(self.side) * u64::from(self.side)
    }

    /// Bytes of all maps.
    ///
    /// # Errors
    /// As [`ViewShadowMaps::new`].
    pub(crate) fn check(&self, gpu: &Gpu) -> Result<u64> {
        if self.side == 0 || self.maps == 0 || self.maps > SHADOW_MAPS_MAX {
            let value = format!("{} of side {}", self.maps, self.side);
            let cause = format!("are none, or more than {SHADOW_MAPS_MAX}");
            return Err(Error::setting("shadow maps", value, cause));
        }
        let bytes = (self.texels())
            .saturating_mul(u64::from(self.maps))
            .saturating_mul(size_of::<f32>() as u64);
        gpu.caps().check_storage("shadow maps of views", bytes)?;
        Ok(bytes)
    }
}

/// Shadow maps of spots and of parallel light, all of one size, in one buffer.
#[derive(Debug)]
pub struct ViewShadowMaps {
    gpu: Gpu,
    desc: ViewShadowDesc,
    gbuffer: GBuffer,
    distances: Buffer,
}

/// From where the map of a light is drawn, with `side` × `side` texels.
fn view_of(light: &LightKind, surfaces: &Surfaces<'_>, side: u32) -> Result<View> {
    let area = Area::whole([side; 2]);
    match *light {
        LightKind::Spot {
            position,
            direction,
            outer,
            ..
        } if outer <= HALF_ANGLE_MAX => {
            let half_angle = (MARGIN * outer).max(HALF_ANGLE_MIN);
            View::of_square(
                position,
                direction,
                half_angle,
                View::near_plane(position, surfaces),
                area,
            )
        }
        LightKind::Directional { direction, .. } => View::of_beam(direction, surfaces, area),
        _ => Err(Error::setting(
            "light",
            format!("{light:?}"),
            "shines wider than 60° about an axis, which one view does not cover: OmniShadowMaps do",
        )),
    }
}

/// What kernels know of a view.
pub(crate) fn shadow_view(view: &View) -> ShadowView {
    let [right, down, forward] = view.axes().map(|axis| axis.to_array());
    ShadowView {
        origin: view.origin().to_array(),
        is_parallel: view.is_parallel().into(),
        right,
        down,
        forward,
    }
}

impl ViewShadowMaps {
    /// Allocates the maps, and makes the pipeline that draws these surfaces. Nothing is in shadow before [`ViewShadowMaps::record`].
    ///
    /// # Errors
    /// [`Error::Setting`] for no texels, or maps other than 1 to [`SHADOW_MAPS_MAX`] in number; [`Error::LimitExceeded`] for more than a storage buffer or an image holds;
    /// [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, surfaces: &Surfaces<'_>, desc: ViewShadowDesc) -> Result<Self> {
        let bytes = desc.check(gpu)?;
        let distances = gpu.buffer(&BufferDesc::storage("shadow maps of views", bytes, Category::Light))?;
        let gbuffer = GBuffer::new(
            gpu,
            surfaces,
            &GBufferDesc {
                size: [desc.side; 2],
                layering: Layering::One,
                outputs: &[Output::Distance],
            },
        )?;
        let mut recorder = gpu.recorder("shadow maps of views")?;
        recorder.pass("shadow maps of views: clear", |pass| {
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
    pub fn desc(&self) -> ViewShadowDesc {
        self.desc
    }

    /// The shaders that draw them, with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        self.gbuffer.pipelines()
    }

    /// Bytes of the maps and of the picture that they are drawn in.
    pub fn bytes(&self) -> u64 {
        self.gbuffer.bytes() + self.distances.bytes()
    }

    /// Records two passes a light: the surfaces from there, and their distances into its map, in the order of `lights`. Other maps stay as they are. Earlier uses of the maps by compute
    /// shaders are waited for; afterwards they are visible to compute shaders.
    ///
    /// # Errors
    /// [`Error::Setting`] for more lights than maps, points and spots of more than 60° to each side, places that are not finite, or surfaces with other features than those they were
    /// made for; [`Error::MissingBarrier`] in debug builds.
    pub fn record(&self, recorder: &mut Recorder, surfaces: &Surfaces<'_>, lights: &[LightKind]) -> Result<()> {
        if lights.len() > self.desc.maps as usize {
            let cause = format!("are more than the {} shadow maps", self.desc.maps);
            return Err(Error::setting("lights", lights.len(), cause));
        }
        for (map, light) in (0..).zip(lights) {
            let view = self.view(surfaces, light)?;
            self.record_part(recorder, surfaces, map, &view, &DrawPart::whole(surfaces))?;
        }
        Ok(())
    }

    /// From where the map of a light is drawn.
    ///
    /// # Errors
    /// As [`ViewShadowMaps::record`].
    pub(crate) fn view(&self, surfaces: &Surfaces<'_>, light: &LightKind) -> Result<View> {
        view_of(light, surfaces, self.desc.side)
    }

    /// As [`ViewShadowMaps::record`], a part of one map, which is there after the last part.
    pub(crate) fn record_part(
        &self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        map: u32,
        view: &View,
        part: &DrawPart,
    ) -> Result<()> {
        self.check(map)?;
        self.gbuffer
            .record_part(recorder, surfaces, std::slice::from_ref(view), part)?;
        if !part.ends {
            return Ok(());
        }
        let barrier = |from, to| BufferBarrier {
            buffer: &self.distances,
            from,
            to,
        };
        let bytes = self.desc.texels() * size_of::<f32>() as u64;
        recorder.pass("shadow maps of views: distances", |pass| {
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

    /// What kernels that look up read.
    pub(crate) fn distances(&self) -> BufferView<'_> {
        self.distances.view()
    }

    /// Shares of a light's light that reach places, by the device: the number of its map, and the filter's width in texels (0 for none, [`SHADOW_WIDTH_MAX`] and the map's side at
    /// most).
    ///
    /// # Errors
    /// As [`ViewShadowMaps::record`] for the light; [`Error::Setting`] for a map that does not exist or a filter that is too wide; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn look_up(
        &self,
        surfaces: &Surfaces<'_>,
        (map, light): (u32, &LightKind),
        width: u32,
        places: &[ShadowPlace],
    ) -> Result<Vec<f32>> {
        self.check(map)?;
        check_width(width, self.desc.side)?;
        let view = view_of(light, surfaces, self.desc.side)?;
        if places.is_empty() {
            return Ok(Vec::new());
        }
        let pipeline = self.gpu.compute_pipeline::<kernel::Kernel>(&())?;
        let queries: Vec<ShadowQuery> = places.iter().map(ShadowPlace::query).collect();
        let queries = self.gpu.buffer_with("shadow queries", Category::Work, &queries)?;
        let bytes = size_of::<f32>() as u64 * places.len() as u64;
        let desc = BufferDesc::storage("shadow shares", bytes, Category::Work);
        let shares = self.gpu.buffer(&desc)?;
        let mut recorder = self.gpu.recorder("shadow maps of views")?;
        recorder.pass("shadow maps of views: look-ups", |pass| {
            let set = kernel::Set0 {
                queries: queries.view(),
                shares: shares.view(),
                view_distances: self.distances.view(),
            };
            let count = places.len() as u32;
            let push = kernel::Push {
                view: shadow_view(&view),
                count,
                map,
                side: self.desc.side as i32,
                width: width as i32,
            };
            pass.dispatch(&pipeline, &[&set], &push, pipeline.groups_over(count))
        })?;
        recorder.submit()?.wait()?;
        self.gpu.read(shares.view(), places.len())
    }

    /// The map of a light on the host.
    ///
    /// # Errors
    /// As [`ViewShadowMaps::look_up`].
    pub fn read(&self, surfaces: &Surfaces<'_>, (map, light): (u32, &LightKind)) -> Result<ViewShadowImage> {
        self.check(map)?;
        let view = view_of(light, surfaces, self.desc.side)?;
        let texels = self.desc.texels();
        let bytes = texels * size_of::<f32>() as u64;
        let of_map = self.distances.slice(u64::from(map) * bytes, bytes);
        Ok(ViewShadowImage {
            view: shadow_view(&view),
            side: self.desc.side,
            distances: self.gpu.read(of_map, texels as usize)?,
        })
    }

    fn check(&self, map: u32) -> Result<()> {
        if map < self.desc.maps {
            return Ok(());
        }
        let cause = format!("is not among {}", self.desc.maps);
        Err(Error::setting("shadow map", map, cause))
    }
}

/// A place that light reaches or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewReceiver {
    /// Where it is looked up, from (−1, −1) to (1, 1).
    pub place: DVec2,
    /// Metres.
    pub position: DVec3,
    /// Of the surface, to the side of the light.
    pub normal: DVec3,
    /// Of the plane towards the light, metres.
    pub moved: f64,
    /// From where its ray begins, metres; below 0 behind the light.
    pub distance: f64,
}

fn vector(v: [f32; 3]) -> DVec3 {
    Vec3::from_array(v).as_dvec3()
}

/// Where the ray through a place of a map begins, and its unit direction.
pub fn shadow_view_ray(view: &ShadowView, place: DVec2) -> [DVec3; 2] {
    let across = place.x * vector(view.right) + place.y * vector(view.down);
    let (origin, forward) = (vector(view.origin), vector(view.forward));
    if view.is_parallel != 0 {
        [origin + across, forward.normalize()]
    } else {
        [origin, (forward + across).normalize()]
    }
}

/// Where a point is in a map, and how far along its axis, metres.
pub fn shadow_view_place(view: &ShadowView, point: DVec3) -> (DVec2, f64) {
    let to = point - vector(view.origin);
    let (right, down) = (vector(view.right), vector(view.down));
    let depth = to.dot(vector(view.forward));
    let place = DVec2::new(
        to.dot(right) / right.length_squared(),
        to.dot(down) / down.length_squared(),
    );
    (if view.is_parallel != 0 { place } else { place / depth }, depth)
}

/// The receiver at a position with a normal (unit, of either side) that may be off its plane by `slack`, for a filter `width` texels wide, in a map of `side` × `side`
/// texels.
pub fn shadow_view_receiver(
    view: &ShadowView,
    side: u32,
    width: u32,
    [position, normal]: [DVec3; 2],
    slack: f64,
) -> ViewReceiver {
    let (_, depth) = shadow_view_place(view, position);
    let is_parallel = view.is_parallel != 0;
    let to = if is_parallel {
        depth * vector(view.forward)
    } else {
        position - vector(view.origin)
    };
    let normal = if normal.dot(to) > 0.0 { -normal } else { normal };
    let diagonal = (vector(view.right).length_squared() + vector(view.down).length_squared()).sqrt();
    let half_texel = diagonal / f64::from(side) * if is_parallel { 1.0 } else { depth };
    let height = -normal.dot(to);
    let fold = f64::from(SHADOW_FOLD) * half_texel * (f64::from(width) + 1.0);
    ViewReceiver {
        place: shadow_view_place(view, position + half_texel * normal).0,
        position,
        normal,
        moved: fold.min(f64::from(SHADOW_MOVE_MAX) * height) + slack,
        distance: if depth > 0.0 { to.length() } else { -1.0 },
    }
}

/// What is nearer than this along the ray through a place of a map shades the receiver: its moved plane, or its distance where that is nearer, metres; 0 where the ray may
/// begin in the plane.
pub fn shadow_view_threshold(view: &ShadowView, r: &ViewReceiver, place: DVec2) -> f64 {
    let [start, direction] = shadow_view_ray(view, place);
    let height = r.normal.dot(start - r.position) - r.moved;
    if height <= 0.0 {
        return 0.0;
    }
    let fall = -r.normal.dot(direction);
    let is_met = height < fall * r.distance;
    let plane = if is_met { height / fall } else { r.distance };
    plane * (1.0 - f64::from(SHADOW_ROUNDING))
}

/// A shadow map on the host.
#[derive(Debug, Clone)]
pub struct ViewShadowImage {
    /// From where it is drawn.
    pub view: ShadowView,
    /// Texels across and down.
    pub side: u32,
    /// Metres along each texel's ray, row by row; infinite where there is nothing.
    pub distances: Vec<f32>,
}

impl ViewShadowImage {
    /// Share of the light that reaches a place on a surface: the twin of the device's look-up. The filter's width, texels, is [`SHADOW_WIDTH_MAX`] and the map's side at most; greater
    /// counts as that.
    pub fn visibility(&self, width: u32, place: &ShadowPlace) -> f64 {
        let width = width.min(SHADOW_WIDTH_MAX).min(self.side);
        let surface = [place.position, place.normal].map(|v| v.as_dvec3());
        let r = shadow_view_receiver(&self.view, self.side, width, surface, place.slack.into());
        let (shown, _) = shadow_view_place(&self.view, r.position);
        if r.distance <= 0.0 || shown.abs().max_element() > 1.0 {
            return 1.0;
        }
        let at = (0.5 * r.place + 0.5) * f64::from(self.side);
        if width == 0 {
            return self.tap(&r, at.floor().as_ivec2());
        }
        let low = at - 0.5 * f64::from(width);
        let (first, part) = (low.floor().as_ivec2(), low - low.floor());
        let weight = |i: u32, part: f64| match i {
            0 => 1.0 - part,
            last if last == width => part,
            _ => 1.0,
        };
        let (mut sum, mut weights) = (0.0, 0.0);
        for y in 0..=width {
            for x in 0..=width {
                let share = weight(x, part.x) * weight(y, part.y);
                sum += share * self.tap(&r, first + IVec2::new(x as i32, y as i32));
                weights += share;
            }
        }
        sum / weights
    }

    fn tap(&self, r: &ViewReceiver, at: IVec2) -> f64 {
        let at = at.clamp(IVec2::ZERO, IVec2::splat(self.side as i32 - 1));
        let seen = f64::from(self.distances[at.y as usize * self.side as usize + at.x as usize]);
        let place = (2.0 * at.as_dvec2() + 1.0) / f64::from(self.side) - 1.0;
        if seen < shadow_view_threshold(&self.view, r, place) {
            0.0
        } else {
            1.0
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "SVO-P5",
    name: "shadow maps of spots and of parallel light, a view each, with percentage-closer filtering",
    role: Role::Kernel,
    limits: "Spots of up to 60° to each side; borders follow texels, what is no larger than texels is wrong as a whole, contact shadows begin late, and partial alpha and glass cast full ones.",
    sources: &[
        sources::WILLIAMS_1978.whole(),
        sources::REEVES_1987.whole(),
        sources::SUN_2015.at("§4.4 and §4.9"),
    ],
    shaders: &[
        "shaders/raster/view_shadow.glsl",
        "shaders/raster/view_shadow_set.glsl",
        "shaders/raster/view_shadow_look_up.comp",
        "shaders/raster/shadow_query.glsl",
        "shaders/raster/surface.vert",
        "shaders/raster/surface.frag",
    ],
    bias: Some(Bias::Biased(
        "borders of shadows are those of texels; what is no larger than texels is wrong as a whole; contact shadows begin `width + 1` texel diagonals late",
    )),
    tests: &[
        "tests/tests/raster/view_shadows.rs::planes_alone_are_lit",
        "tests/tests/raster/view_shadows.rs::shadows_of_a_square_are_closed_forms",
        "tests/tests/raster/view_shadows.rs::filtered_borders_are_as_wide_as_the_filter",
        "tests/tests/raster/view_shadows.rs::look_ups_are_their_twins",
        "tests/tests/raster/view_shadows.rs::what_one_view_does_not_cover_is_refused",
    ],
    api: &["clerestory::raster::ViewShadowMaps"],
    settings: &["clerestory::raster::ViewShadowDesc"],
    ..Row::of(file!())
}];
