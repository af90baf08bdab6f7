//! Live maps: what is seen from a point in all directions, drawn anew each frame and kept as a light probe.
//!
//! Sources: N. Greene, "Environment Mapping and Other Applications of World Projections", IEEE CG&A 6(11), 1986 (maps of a scene from an object's
//! middle); T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", VMV 2008 (drawn live, one picture). The eight octants are drawn side
//! by side, shaded as a camera's picture is, and filtered ([`LightProbe`]).
//!
//! Bias: radiance at texel centres stands for its mean over the texel; what light does among surfaces beyond direct light is in it as far as a
//! probe that lights them says, which may be this one of the frame before. Seen from elsewhere than its point, a reflection shows what lies in the same
//! *direction*: for a mirror at offset o the place it shows is off by |o|, an angle of up to asin(|o|/d) at distance d (parallax),
//! but for what is [searched for](super::SearchedReflections) in the map's distances.

use glam::Vec3;

use super::probe::{LightProbe, LightProbeDesc};
use super::shade::{Eye, OUTPUTS, PreviewPart, Seen, Shade, Target};
use super::{Preview, PreviewLights};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::{Area, Gpu, Recorder};
use crate::maps::directional_map::DirectionalMap;
use crate::maps::octahedron::OctahedronLayout;
use crate::raster::{GBuffer, GBufferDesc, Layering, OctantCut, Output, Surfaces, View};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// What draws a scene around a place into an octahedron map.
#[derive(Debug)]
pub(super) struct LiveDrawing {
    gbuffer: GBuffer,
    shade: Shade,
}

impl LiveDrawing {
    /// For a map of so many texels along a side; its surfaces are lit as those of the preview, and by probes where `has_probes` says so. `outputs` are drawn beside what shading reads.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        lights: &PreviewLights,
        (side, outputs): (u32, &[Output]),
        has_probes: bool,
    ) -> Result<Self> {
        let gbuffer = GBuffer::new(
            gpu,
            &scene.surfaces(),
            &GBufferDesc {
                size: [side; 2],
                layering: Layering::Octants(OctantCut::default()),
                outputs: &[&OUTPUTS[..], outputs].concat(),
            },
        )?;
        Ok(Self {
            gbuffer,
            shade: Shade::new(gpu, scene, lights, true, has_probes)?,
        })
    }

    pub fn bytes(&self) -> u64 {
        self.gbuffer.bytes()
    }

    /// Records two passes: what of `surfaces` is seen from a place (metres), and its shading by the preview's lights and by a probe, into level 0 of a
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
        let views = View::of_octants(place, OctahedronLayout::Quadratic, near, area)?;
        self.gbuffer.record(recorder, surfaces, &views)?;
        recorder.pass("preview: shade live map", |pass| {
            let level = map.level(0)?;
            let border = map.border();
            let stride = side + 2 * border;
            let target = Target {
                buffer: map.texels(),
                first: level.first + border * (stride + 1),
                stride,
            };
            let part = PreviewPart {
                triangles: 0..surfaces.triangles,
                background: true,
                probe: by,
            };
            let seen = Seen {
                scene,
                gbuffer: &self.gbuffer,
                lights: preview.lights(),
                eye: Eye::AllDirections(place),
                target,
            };
            self.shade.record(pass, &seen, &[part])
        })
    }
}

/// A light probe of a scene, drawn on the device.
#[derive(Debug)]
pub struct LiveProbe {
    probe: LightProbe,
    drawing: LiveDrawing,
}

impl LiveProbe {
    /// Allocates a probe and what draws it; its surfaces are lit as those of the preview, and by probes where `has_probes` says so.
    ///
    /// # Errors
    /// As [`LightProbe::new`]; [`Error::MissingFeature`] where clip distances are missing.
    pub fn new(gpu: &Gpu, scene: &GpuScene, preview: &Preview, desc: LightProbeDesc, has_probes: bool) -> Result<Self> {
        Self::make(gpu, scene, preview, (desc, &[]), has_probes)
    }

    /// As [`LiveProbe::new`], with distances and normals of what its place sees, 12 bytes a texel more, for [`SearchedReflections`](super::SearchedReflections).
    ///
    /// # Errors
    /// As [`LiveProbe::new`].
    pub fn with_distances(
        gpu: &Gpu,
        scene: &GpuScene,
        preview: &Preview,
        desc: LightProbeDesc,
        has_probes: bool,
    ) -> Result<Self> {
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
            drawing: LiveDrawing::new(gpu, scene, preview.lights(), (desc.side, outputs), has_probes)?,
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

    /// Records five passes: what of `surfaces` is seen from a place (metres), its shading by the preview's lights and by probes, levels and
    /// borders, and the filter. Probes may be this one itself, as it was before. Afterwards it is visible to compute shaders.
    ///
    /// # Errors
    /// [`Error::Setting`] for a place that is not finite, a preview with other shadow maps or a scene with other features than those that it was made
    /// for, or probes where it was made for none; [`Error::MissingBarrier`] in debug builds.
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
    name: "live maps: light at a place drawn each frame as an octahedron, for reflections of objects that move",
    role: Role::PartOf("CL-PREVIEW"),
    limits: "No parallax without a search: a reflection shows what lies in its direction from the map's own place, and a search finds what that place sees.",
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
