//! The pipelines of surfaces, one for each way to several views.

use std::ops::Range;

use super::octahedron::OCTANTS;
use super::octants::OctantCut;
use super::output::Output;
use super::surfaces::{SurfaceFeatures, Surfaces};
use super::tessellation::MAX_LEVEL;
use super::view::View;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::interface::VertexShader;
use crate::gpu::shaders::raster::{
    surface_frag, surface_halves_geom, surface_instance_vert, surface_layer_geom, surface_layer_vert,
    surface_octant_vert, surface_outlines_geom, surface_paraboloid_vert, surface_split_geom, surface_unsplit_vert,
    surface_vert, surface_view_vert, surface_world_vert,
};
use crate::gpu::shaders::sets::RasterSet;
use crate::gpu::{Caps, GeometryStage, Gpu, GraphicsDesc, GraphicsPipeline, NoGeometry, PipelineInfo, Render};
use crate::maps::cube::CUBE_FACES;
use crate::maps::octahedron::OctahedronLayout;
use crate::{Error, Result};

/// Format of depths, see [`View`](super::View).
pub(super) const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// In how many views surfaces are drawn, and how they get there. All ways to the same linear views give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layering {
    /// One view into one picture.
    One,
    /// So many views, each into its own layer by draws of its own. Runs everywhere.
    Passes(u32),
    /// So many views, each into its own layer, by one draw that the device repeats (`multiview`). Mesa's software driver of version 22.3 puts
    /// triangles that it clips into wrong views: a test knows.
    Views(u32),
    /// So many views, each into its own layer, an instance of one draw for each (`shaderOutputLayer`).
    Instances(u32),
    /// Up to six views with one origin, each into its own layer, to which a geometry shader takes each triangle that they can see.
    Geometry(u32),
    /// The octants of an octahedron, all into one picture.
    Octants(OctantCut),
    /// The two halves of a dual paraboloid map, each into its own layer by a draw of its own (`shaderClipDistance`). Corners are mapped and
    /// joined by straight edges: right in the limit of small pieces (S. Brabec, T. Annen and H.-P. Seidel, "Shadow Mapping for Hemispherical and
    /// Omnidirectional Light Sources", CGI 2002). Each triangle is drawn as `level`² pieces, as [`OctantCut::Unsplit`] does.
    Paraboloids {
        /// Pieces along an edge.
        level: u32,
    },
}

/// Halves of a dual paraboloid map.
const PARABOLOIDS: u32 = 2;

impl Layering {
    /// A way to so many layers that the device has.
    pub fn of_layers(caps: &Caps, layers: u32) -> Self {
        if caps.vertex_layer {
            Self::Instances(layers)
        } else if caps.max_views >= layers {
            Self::Views(layers)
        } else if caps.geometry_shader && layers <= CUBE_FACES {
            Self::Geometry(layers)
        } else {
            Self::Passes(layers)
        }
    }

    /// How many views it takes.
    pub fn views(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Passes(views) | Self::Views(views) | Self::Instances(views) | Self::Geometry(views) => views,
            Self::Octants(_) => OCTANTS,
            Self::Paraboloids { .. } => PARABOLOIDS,
        }
    }

    /// How many layers its pictures have.
    pub fn layers(self) -> u32 {
        match self {
            Self::One | Self::Octants(_) => 1,
            other => other.views(),
        }
    }

    /// The views of the rendering, by bits.
    pub(super) fn view_mask(self) -> u32 {
        match self {
            Self::Views(views) => u32::MAX >> (u32::BITS - views),
            _ => 0,
        }
    }

    /// How often targets are rendered into, a layer each time; once into all of them otherwise.
    pub(super) fn renderings(self) -> Option<u32> {
        match self {
            Self::Passes(views) => Some(views),
            Self::Paraboloids { .. } => Some(PARABOLOIDS),
            _ => None,
        }
    }

    /// Whether a pixel's ray goes through what is drawn there.
    pub(super) fn has_rays(self) -> bool {
        match self {
            Self::Octants(cut) => cut.is_exact(),
            Self::Paraboloids { .. } => false,
            _ => true,
        }
    }

    /// Refuses views that it cannot draw in.
    pub(super) fn check_views(self, views: &[View]) -> Result<()> {
        let wanted = self.views();
        if views.len() != wanted as usize {
            return Err(Error::setting("views", views.len(), format!("is not {wanted}")));
        }
        let is_rectangular = |view: &View| view.layout == Some(OctahedronLayout::Rectangular);
        if let Self::Octants(cut @ (OctantCut::Halves | OctantCut::Outlines)) = self
            && !views.iter().all(is_rectangular)
        {
            let cause = "are not those of the rectangular layout, which the cut is for";
            return Err(Error::setting("views", format!("{cut:?}"), cause));
        }
        Ok(())
    }

    fn check(self) -> Result<()> {
        let most = match self {
            Self::Views(_) => u32::BITS,
            Self::Geometry(_) => CUBE_FACES,
            _ => u32::MAX,
        };
        if self.views() == 0 || self.views() > most {
            return Err(Error::setting(
                "views",
                self.views(),
                format!("is not from 1 to {most}"),
            ));
        }
        let (Self::Octants(OctantCut::Unsplit { level }) | Self::Paraboloids { level }) = self else {
            return Ok(());
        };
        if level == 0 || level > MAX_LEVEL {
            return Err(Error::setting("level", level, format!("is not from 1 to {MAX_LEVEL}")));
        }
        Ok(())
    }
}

type Shaders<V, G = NoGeometry> = GraphicsPipeline<V, surface_frag::Shader, G>;

/// The pipeline of a way to several views.
#[derive(Debug)]
pub(super) enum Pipeline {
    /// One view a draw.
    Plain(Shaders<surface_vert::Shader>),
    Views(Shaders<surface_view_vert::Shader>),
    Instances(Shaders<surface_layer_vert::Shader>, u32),
    Geometry(Shaders<surface_world_vert::Shader, surface_layer_geom::Shader>),
    ClipDistances(Shaders<surface_octant_vert::Shader>),
    Split(Shaders<surface_world_vert::Shader, surface_split_geom::Shader>),
    Halves(Shaders<surface_world_vert::Shader, surface_halves_geom::Shader>),
    Outlines(Shaders<surface_world_vert::Shader, surface_outlines_geom::Shader>),
    Mask(Shaders<surface_instance_vert::Shader>),
    /// The octants' rectangles.
    MaskInRectangles(Shaders<surface_vert::Shader>, [u32; 2]),
    Unsplit(Shaders<surface_unsplit_vert::Shader>, u32),
    Paraboloids(Shaders<surface_paraboloid_vert::Shader>, u32),
}

impl Pipeline {
    pub fn new(gpu: &Gpu, desc: &PipelineDesc<'_>) -> Result<Self> {
        desc.layering.check()?;
        Ok(match desc.layering {
            Layering::One | Layering::Passes(_) => Self::Plain(make(gpu, desc, (), ())?),
            Layering::Views(_) => Self::Views(make(gpu, desc, (), ())?),
            Layering::Instances(views) => Self::Instances(make(gpu, desc, (), ())?, views),
            Layering::Geometry(views) => {
                let geometry = surface_layer_geom::Spec { views: views as i32 };
                Self::Geometry(make(gpu, desc, (), geometry)?)
            }
            Layering::Octants(cut) => match cut {
                OctantCut::ClipDistances => Self::ClipDistances(make(gpu, desc, (), ())?),
                OctantCut::Split => Self::Split(make(gpu, desc, (), ())?),
                OctantCut::Halves => Self::Halves(make(gpu, desc, (), ())?),
                OctantCut::Outlines => Self::Outlines(make(gpu, desc, (), ())?),
                OctantCut::Mask => Self::Mask(make(gpu, desc, (), ())?),
                OctantCut::MaskInRectangles => Self::MaskInRectangles(make(gpu, desc, (), ())?, desc.size),
                OctantCut::Unsplit { level } => {
                    let vertex = surface_unsplit_vert::Spec { level: level as i32 };
                    Self::Unsplit(make(gpu, desc, vertex, ())?, level)
                }
            },
            Layering::Paraboloids { level } => {
                let vertex = surface_paraboloid_vert::Spec { level: level as i32 };
                Self::Paraboloids(make(gpu, desc, vertex, ())?, level)
            }
        })
    }

    /// The shaders with their specialization.
    pub fn info(&self) -> Vec<PipelineInfo> {
        match self {
            Self::Plain(pipeline) | Self::MaskInRectangles(pipeline, _) => pipeline.info(),
            Self::Views(pipeline) => pipeline.info(),
            Self::Instances(pipeline, _) => pipeline.info(),
            Self::Geometry(pipeline) => pipeline.info(),
            Self::ClipDistances(pipeline) => pipeline.info(),
            Self::Split(pipeline) => pipeline.info(),
            Self::Halves(pipeline) => pipeline.info(),
            Self::Outlines(pipeline) => pipeline.info(),
            Self::Mask(pipeline) => pipeline.info(),
            Self::Unsplit(pipeline, _) => pipeline.info(),
            Self::Paraboloids(pipeline, _) => pipeline.info(),
        }
    }

    /// Draws triangles in the views from `first_view` on.
    pub fn draw(
        &self,
        render: &mut Render<'_, '_>,
        raster: &RasterSet<'_>,
        (surfaces, triangles): (&Surfaces<'_>, &Range<u32>),
        views: &[View],
        first_view: u32,
    ) -> Result<()> {
        macro_rules! draw {
            ($shader:ident, $pipeline:expr, $pieces:expr, $instances:expr, $first_view:expr) => {
                render.draw_range(
                    $pipeline,
                    &[raster, &surfaces.set],
                    &$shader::Push {
                        first_view: $first_view,
                    },
                    corners(triangles, $pieces)?,
                    $instances,
                )
            };
            ($shader:ident, $pipeline:expr, $instances:expr) => {
                draw!($shader, $pipeline, 1, $instances, first_view)
            };
        }
        match self {
            Self::Plain(pipeline) => draw!(surface_vert, pipeline, 1),
            Self::Views(pipeline) => draw!(surface_view_vert, pipeline, 1),
            Self::Instances(pipeline, views) => draw!(surface_layer_vert, pipeline, *views),
            Self::Geometry(pipeline) => draw!(surface_world_vert, pipeline, 1),
            Self::ClipDistances(pipeline) => draw!(surface_octant_vert, pipeline, OCTANTS),
            Self::Split(pipeline) => draw!(surface_world_vert, pipeline, 1),
            Self::Halves(pipeline) => draw!(surface_world_vert, pipeline, 1),
            Self::Outlines(pipeline) => draw!(surface_world_vert, pipeline, 1),
            Self::Mask(pipeline) => draw!(surface_instance_vert, pipeline, OCTANTS),
            Self::MaskInRectangles(pipeline, size) => (0..).zip(views).try_for_each(|(number, view)| {
                render.set_scissor(view.octant_area(*size))?;
                draw!(surface_vert, pipeline, 1, 1, first_view + number)
            }),
            Self::Unsplit(pipeline, level) => {
                draw!(surface_unsplit_vert, pipeline, level * level, 1, first_view)
            }
            Self::Paraboloids(pipeline, level) => {
                draw!(surface_paraboloid_vert, pipeline, level * level, 1, first_view)
            }
        }
    }
}

/// Vertices of all pieces.
fn corners(triangles: &Range<u32>, pieces: u32) -> Result<Range<u32>> {
    let corners = |triangles: u32| {
        let corners = 3 * u64::from(triangles) * u64::from(pieces);
        u32::try_from(corners).map_err(|_| Error::LimitExceeded {
            name: "surfaces".into(),
            value: corners,
            limit_name: "vertices of a draw",
            limit: u64::from(u32::MAX),
        })
    };
    Ok(corners(triangles.start)?..corners(triangles.end)?)
}

/// What a pipeline is made for.
#[derive(Debug, Clone, Copy)]
pub(super) struct PipelineDesc<'a> {
    pub size: [u32; 2],
    pub layering: Layering,
    pub outputs: &'a [Output],
    pub features: SurfaceFeatures,
    pub interpolates: bool,
}

fn make<V: VertexShader, G: GeometryStage>(
    gpu: &Gpu,
    desc: &PipelineDesc<'_>,
    vertex: V::Spec,
    geometry: G::Spec,
) -> Result<Shaders<V, G>> {
    let &PipelineDesc {
        layering,
        outputs,
        features,
        ..
    } = desc;
    let has = |output| outputs.contains(&output);
    let uvs = has(Output::TextureCoordinates);
    let has_normal_maps = features.normal_maps && has(Output::Normals);
    // Attributes are read where a picture or a material's coverage wants them.
    let fragment = surface_frag::Spec {
        write_distance: has(Output::Distance),
        write_position: has(Output::Position),
        write_normals: has(Output::Normals),
        write_weights: has(Output::Weights),
        write_texture_coordinates: uvs,
        write_object: has(Output::Object),
        has_textures: features.textures && (uvs || features.alpha || has_normal_maps),
        has_vertex_colors: features.vertex_colors && features.alpha,
        has_shading_normals: features.shading_normals && has(Output::Normals),
        has_alpha: features.alpha,
        has_normal_maps,
        interpolated: desc.interpolates,
        masked: matches!(
            layering,
            Layering::Octants(OctantCut::Mask | OctantCut::MaskInRectangles)
        ),
    };
    let format = |output: Output| {
        if has(output) {
            output.format()
        } else {
            vk::Format::UNDEFINED
        }
    };
    let mut colors = Output::ALL.map(format).to_vec();
    colors.truncate(used_locations(outputs));
    gpu.graphics_pipeline(&GraphicsDesc {
        vertex,
        geometry,
        fragment,
        colors: &colors,
        depth: Some(DEPTH),
        // Depth is stored reversed; of equal depths the first triangle stays, as it does among hits of rays.
        depth_compare: vk::CompareOp::GREATER,
        view_mask: layering.view_mask(),
        ..GraphicsDesc::default()
    })
}

/// How many locations of the fragment shader there must be for these outputs.
pub(super) fn used_locations(outputs: &[Output]) -> usize {
    outputs.iter().map(|output| *output as usize + 1).max().unwrap_or(0)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "OEM-4d",
    name: "octahedron maps rendered live: mask of each octant",
    role: Role::Kernel,
    limits: "Exact, but fragments of all other octants are made and discarded.",
    sources: &[sources::ENGELHARDT_2013.at("7.2.1 and 7.3.2")],
    shaders: &["shaders/raster/surface_instance.vert"],
    tests: &[
        "tests/tests/raster/directions.rs::octahedra_are_as_rays_see_them_and_have_no_holes",
        "tests/tests/raster/cuts.rs::exact_cuts_interpolate_what_rays_meet",
        "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
        "tests/tests/raster/cuts.rs::masks_shade_more_than_clipping_where_fragments_are_counted",
    ],
    api: &["clerestory::raster::OctantCut", "clerestory::raster::GBuffer"],
    settings: &["clerestory::raster::Layering", "clerestory::raster::GBufferDesc"],
    ..Row::of(file!())
}];
