//! The pipelines of surfaces, one for each way to several views.

use super::octahedron::OCTANTS;
use super::output::Output;
use super::surfaces::{SurfaceFeatures, Surfaces};
use crate::gpu::ash::vk;
use crate::gpu::interface::VertexShader;
use crate::gpu::shaders::raster::{
    surface_frag, surface_layer_geom, surface_layer_vert, surface_octant_vert, surface_vert, surface_view_vert,
    surface_world_vert,
};
use crate::gpu::shaders::sets::RasterSet;
use crate::gpu::{Caps, GeometryStage, Gpu, GraphicsDesc, GraphicsPipeline, NoGeometry, Render};
use crate::maps::cube::CUBE_FACES;
use crate::{Error, Result};

/// Format of depths, see [`View`](super::View).
pub(super) const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// In how many views surfaces are drawn, and how they get there. All ways give the same bits.
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
    /// The octants of an octahedron, all into one picture (`shaderClipDistance`).
    Octants,
}

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
            Self::Octants => OCTANTS,
        }
    }

    /// How many layers its pictures have.
    pub fn layers(self) -> u32 {
        match self {
            Self::One | Self::Octants => 1,
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
        Ok(())
    }
}

/// The pipeline of a way to several views.
#[derive(Debug)]
pub(super) enum Pipeline {
    /// One view a draw.
    Plain(GraphicsPipeline<surface_vert::Shader, surface_frag::Shader>),
    Views(GraphicsPipeline<surface_view_vert::Shader, surface_frag::Shader>),
    Instances(GraphicsPipeline<surface_layer_vert::Shader, surface_frag::Shader>, u32),
    Geometry(GraphicsPipeline<surface_world_vert::Shader, surface_frag::Shader, surface_layer_geom::Shader>),
    Octants(GraphicsPipeline<surface_octant_vert::Shader, surface_frag::Shader>),
}

impl Pipeline {
    pub fn new(gpu: &Gpu, layering: Layering, outputs: &[Output], features: SurfaceFeatures) -> Result<Self> {
        layering.check()?;
        Ok(match layering {
            Layering::One | Layering::Passes(_) => {
                Self::Plain(make::<_, NoGeometry>(gpu, layering, outputs, features, ())?)
            }
            Layering::Views(_) => Self::Views(make::<_, NoGeometry>(gpu, layering, outputs, features, ())?),
            Layering::Instances(views) => {
                Self::Instances(make::<_, NoGeometry>(gpu, layering, outputs, features, ())?, views)
            }
            Layering::Geometry(views) => {
                let geometry = surface_layer_geom::Spec { views: views as i32 };
                Self::Geometry(make(gpu, layering, outputs, features, geometry)?)
            }
            Layering::Octants => Self::Octants(make::<_, NoGeometry>(gpu, layering, outputs, features, ())?),
        })
    }

    /// Draws all triangles in the views from `first_view` on.
    pub fn draw(
        &self,
        render: &mut Render<'_, '_>,
        raster: &RasterSet<'_>,
        surfaces: &Surfaces<'_>,
        first_view: u32,
    ) -> Result<()> {
        macro_rules! draw {
            ($shader:ident, $pipeline:expr, $instances:expr) => {
                render.draw(
                    $pipeline,
                    &[raster, &surfaces.set],
                    &$shader::Push { first_view },
                    3 * surfaces.triangles,
                    $instances,
                )
            };
        }
        match self {
            Self::Plain(pipeline) => draw!(surface_vert, pipeline, 1),
            Self::Views(pipeline) => draw!(surface_view_vert, pipeline, 1),
            Self::Instances(pipeline, views) => draw!(surface_layer_vert, pipeline, *views),
            Self::Geometry(pipeline) => draw!(surface_world_vert, pipeline, 1),
            Self::Octants(pipeline) => draw!(surface_octant_vert, pipeline, OCTANTS),
        }
    }
}

fn make<V: VertexShader, G: GeometryStage>(
    gpu: &Gpu,
    layering: Layering,
    outputs: &[Output],
    features: SurfaceFeatures,
    geometry: G::Spec,
) -> Result<GraphicsPipeline<V, surface_frag::Shader, G>> {
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
