//! Live maps: what is seen from a point in all directions, drawn anew each frame and kept as a light probe.
//!
//! Sources: N. Greene, "Environment Mapping and Other Applications of World Projections", IEEE CG&A 6(11), 1986 (maps of a scene from an object's
//! middle); T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", VMV 2008 (drawn live, one picture). The eight octants are drawn side
//! by side, or the six faces of a cube one after the other, shaded as a camera's picture is, and filtered ([`LightProbe`]).
//!
//! Bias: radiance at texel centres stands for its mean over the texel; what light does among surfaces beyond direct light is in it as far as a
//! probe that lights them says, which may be this one of the frame before. Seen from elsewhere than its point, a reflection shows what lies in the same
//! *direction*: for a mirror at offset o the place it shows is off by |o|, an angle of up to asin(|o|/d) at distance d (parallax),
//! but for what is [searched for](super::SearchedReflections) in the map's distances.

use glam::Vec3;

use super::probe::{LightProbe, LightProbeDesc, ProbeMap};
use super::shade::{Eye, OUTPUTS, PreviewPart, Seen, Shade, Target};
use super::{Preview, PreviewLights};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::{Area, Gpu, Recorder};
use crate::maps::cube::CUBE_FACES;
use crate::maps::directional_map::DirectionalMap;
use crate::maps::octahedron::OctahedronLayout;
use crate::raster::{GBuffer, GBufferDesc, Layering, OctantCut, Output, Surfaces, View};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// What draws a scene around a place into a map.
#[derive(Debug)]
pub(super) struct LiveDrawing {
    map: ProbeMap,
    /// Of an octahedron, or of one face of a cube.
    gbuffer: GBuffer,
    shade: Shade,
}

impl LiveDrawing {
    /// For a map of so many texels along a side; its surfaces are lit as those of the preview, and by probes where there are some. `outputs` are drawn beside what shading reads.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        lights: &PreviewLights,
        (map, side, outputs): (ProbeMap, u32, &[Output]),
        probes: Option<ProbeMap>,
    ) -> Result<Self> {
        let layering = match map {
            ProbeMap::Octahedron => Layering::Octants(OctantCut::default()),
            ProbeMap::Cube => Layering::One,
        };
        let gbuffer = GBuffer::new(
            gpu,
            &scene.surfaces(),
            &GBufferDesc {
                size: [side; 2],
                layering,
                outputs: &[&OUTPUTS[..], outputs].concat(),
            },
        )?;
        Ok(Self {
            map,
            gbuffer,
            shade: Shade::new(gpu, scene, lights, map == ProbeMap::Octahedron, probes)?,
        })
    }

    pub fn bytes(&self) -> u64 {
        self.gbuffer.bytes()
    }

    /// Records two passes, for each face of a cube: what of `surfaces` is seen from a place (metres), and its shading by the preview's lights and by a probe, into level 0 of a
    /// map, which is visible to compute shaders afterwards.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        surfaces: &Surfaces<'_>,
        preview: &Preview,
        (place, by): (Vec3, Option<&LightProbe>),
        map: &DirectionalMap,
    ) -> Result<()> {
        if !place.is_finite() {
            return Err(Error::setting("place", place, "is not finite"));
        }
        let side = self.gbuffer.size()[0];
        let near = View::near_plane(place, surfaces);
        let area = Area::whole([side; 2]);
        let level = map.level(0)?;
        let mut draw = |views: &[View], eye, first, stride| {
            self.gbuffer.record(recorder, surfaces, views)?;
            recorder.pass("preview: shade live map", |pass| {
                let part = PreviewPart {
                    triangles: 0..surfaces.triangles,
                    background: true,
                    probe: by,
                };
                let seen = Seen {
                    scene,
                    gbuffer: &self.gbuffer,
                    lights: preview.lights(),
                    eye,
                    target: Target {
                        buffer: map.texels(),
                        first,
                        stride,
                    },
                };
                self.shade.record(pass, &seen, &[part])
            })
        };
        match self.map {
            ProbeMap::Octahedron => {
                let border = map.border();
                let stride = side + 2 * border;
                let views = View::of_octants(place, OctahedronLayout::Quadratic, near, area)?;
                let first = level.first + border * (stride + 1);
                draw(&views, Eye::AllDirections(place), first, stride)
            }
            ProbeMap::Cube => (0..CUBE_FACES).try_for_each(|face| {
                let view = View::of_cube_face(place, face, near, area)?;
                let first = level.first + face * side * side;
                draw(&[view], Eye::CubeFace(place, face), first, side)
            }),
        }
    }
}

/// A light probe of a scene, drawn on the device.
#[derive(Debug)]
pub struct LiveProbe {
    probe: LightProbe,
    drawing: LiveDrawing,
}

impl LiveProbe {
    /// Allocates a probe and what draws it; its surfaces are lit as those of the preview, and by probes of the same map where `has_probes` says so.
    ///
    /// # Errors
    /// As [`LightProbe::new`]; [`Error::MissingFeature`] for octahedra where clip distances are missing.
    pub fn new(gpu: &Gpu, scene: &GpuScene, preview: &Preview, desc: LightProbeDesc, has_probes: bool) -> Result<Self> {
        Self::make(gpu, scene, preview, (desc, &[]), has_probes)
    }

    /// As [`LiveProbe::new`], with distances and normals of what its place sees, 12 bytes a texel more, for [`SearchedReflections`](super::SearchedReflections).
    ///
    /// # Errors
    /// As [`LiveProbe::new`]; [`Error::Setting`] for a cube, whose distances nothing searches here.
    pub fn with_distances(
        gpu: &Gpu,
        scene: &GpuScene,
        preview: &Preview,
        desc: LightProbeDesc,
        has_probes: bool,
    ) -> Result<Self> {
        if desc.map != ProbeMap::Octahedron {
            let cause = "has no distances here; an octahedron has, and maps::impostor searches cubes";
            return Err(Error::setting("map of a live probe", format!("{:?}", desc.map), cause));
        }
        let outputs = [Output::Distance, Output::Normals];
        Self::make(gpu, scene, preview, (desc, &outputs), has_probes)
    }

    fn make(
        gpu: &Gpu,
        scene: &GpuScene,
        preview: &Preview,
        (desc, outputs): (LightProbeDesc, &[Output]),
        has_probes: bool,
    ) -> Result<Self> {
        Ok(Self {
            probe: LightProbe::new(gpu, desc)?,
            drawing: LiveDrawing::new(
                gpu,
                scene,
                preview.lights(),
                (desc.map, desc.side, outputs),
                has_probes.then_some(desc.map),
            )?,
        })
    }

    /// Pictures of what its place sees.
    pub(super) fn gbuffer(&self) -> &GBuffer {
        &self.drawing.gbuffer
    }

    /// The probe.
    pub fn probe(&self) -> &LightProbe {
        &self.probe
    }

    /// Bytes of its maps and pictures.
    pub fn bytes(&self) -> u64 {
        self.probe.bytes() + self.drawing.bytes()
    }

    /// Records five passes, of a cube fifteen: what of `surfaces` is seen from a place (metres), its shading by the preview's lights and by probes, levels and
    /// borders, and the filter. Probes may be this one itself, as it was before. Afterwards it is visible to compute shaders.
    ///
    /// # Errors
    /// [`Error::Setting`] for a place that is not finite, a preview with other shadow maps or a scene with other features than those that it was made
    /// for, or probes where it was made for none or of another map; [`Error::MissingBarrier`] in debug builds.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        surfaces: &Surfaces<'_>,
        preview: &Preview,
        place: Vec3,
        by: Option<&LightProbe>,
    ) -> Result<()> {
        let map = self.probe.map();
        self.drawing
            .record(recorder, scene, surfaces, preview, (place, by), map)?;
        self.probe.record(recorder)
    }
}

/// Rows of the catalogue.
pub(super) const ROWS: &[Row] = &[Row {
    id: "CL-LIVE-MAP",
    name: "live maps: light at a place drawn each frame as an octahedron or a cube, for reflections of objects that move",
    role: Role::PartOf("CL-PREVIEW"),
    limits: "No parallax without a search, which is in octahedra: a reflection shows what lies in its direction from the map's own place, and a search finds what that place sees.",
    sources: &[
        sources::BLINN_NEWELL_1976.whole(),
        sources::GREENE_1986.whole(),
        sources::ENGELHARDT_DACHSBACHER_2008.whole(),
        sources::SZIRMAY_KALOS_2005.whole(),
    ],
    shaders: &[
        "shaders/techniques/preview/probe.glsl",
        "shaders/techniques/preview/preview_shade.comp",
        "shaders/techniques/preview/preview_search.comp",
        "shaders/maps/impostor.glsl",
        "shaders/raster/surface_octant.vert",
        "shaders/raster/surface.vert",
        "shaders/maps/directional_coarser.comp",
        "shaders/maps/directional_border.comp",
        "shaders/maps/prefilter_ggx.comp",
    ],
    bias: Some(Bias::Biased(
        "radiance at texel centres; parallax beside its place, or what a search takes for it",
    )),
    tests: &[
        "tests/tests/preview/live.rs::irradiance_in_a_closed_room_is_that_of_rays",
        "tests/tests/preview/live.rs::reflections_at_the_middle_are_those_of_rays",
        "tests/tests/preview/cubes.rs::live_cubes_show_what_octahedra_do",
        "tests/tests/preview/live.rs::deviations_beside_the_middle_are_parallax",
        "tests/tests/preview/moving.rs::objects_are_left_out_of_their_own_maps",
        "tests/tests/preview/search.rs::a_search_takes_parallax_away",
        "tests/tests/preview/search.rs::searches_that_cannot_be_are_refused",
    ],
    api: &[
        "clerestory::techniques::preview::LiveProbe",
        "clerestory::techniques::preview::SearchedReflections",
    ],
    settings: &[
        "clerestory::techniques::preview::LightProbeDesc",
        "clerestory::maps::impostor::ImpostorSettings",
    ],
    ..Row::of(file!())
}];
