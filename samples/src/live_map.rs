//! Maps of all directions that are rendered live: octahedra by their octants, cubes by their faces.

use clerestory::Result;
use clerestory::accel::Ray;
use clerestory::gpu::{Area, Gpu};
use clerestory::maps::cube::CUBE_FACES;
use clerestory::maps::octahedron::OctahedronLayout;
use clerestory::maps::{Parametrization, Texel};
use clerestory::raster::{GBuffer, GBufferDesc, Layering, OctantCut, Output, View};
use clerestory::transport::GpuScene;
use glam::{DVec3, UVec2, Vec3};

/// What is read of each texel.
const OUTPUTS: [Output; 3] = [Output::Triangle, Output::Object, Output::Distance];

/// Which map is rendered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// The octahedron in one square.
    Square,
    /// The octahedron in two squares side by side.
    Rectangle,
    /// Six faces.
    Cube,
}

impl Layout {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Square, Self::Rectangle, Self::Cube];

    /// As command lines have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Square => "square",
            Self::Rectangle => "rectangle",
            Self::Cube => "cube",
        }
    }

    /// Its parametrization.
    pub fn map(self) -> Parametrization {
        match self {
            Self::Square => Parametrization::OctahedronQuadratic,
            Self::Rectangle => Parametrization::OctahedronRectangular,
            Self::Cube => Parametrization::Cube,
        }
    }

    /// Columns and rows of layers in a picture, and where each layer is.
    pub fn faces(self) -> ([u32; 2], &'static [[u32; 2]]) {
        match self {
            // A cross: +x −x +y −y +z −z.
            Self::Cube => ([4, 3], &[[2, 1], [0, 1], [1, 0], [1, 2], [1, 1], [3, 1]]),
            _ => ([1, 1], &[[0, 0]]),
        }
    }
}

/// What is seen through a texel.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Number of the triangle; all bits set for none.
    pub triangle: u32,
    /// Number of the object; all bits set for none.
    pub object: u32,
    /// Metres; infinite for nothing.
    pub distance: f32,
}

/// A map that is rendered live.
#[derive(Debug)]
pub struct Live {
    /// Which map it is.
    pub layout: Layout,
    /// Texels of a layer.
    pub size: UVec2,
    gbuffer: GBuffer,
}

impl Live {
    /// A map of about `texels` squared texels.
    ///
    /// # Errors
    /// The G-buffer's.
    pub fn new(gpu: &Gpu, scene: &GpuScene, layout: Layout, texels: u32) -> Result<Self> {
        let map = layout.map();
        let size = map.size_for(f64::from(texels).powi(2));
        let layering = match layout {
            Layout::Cube => Layering::of_layers(gpu.caps(), CUBE_FACES),
            _ => Layering::Octants(OctantCut::default()),
        };
        let desc = GBufferDesc {
            size: size.to_array(),
            layering,
            outputs: &OUTPUTS,
        };
        Ok(Self {
            layout,
            size,
            gbuffer: GBuffer::new(gpu, &scene.surfaces(), &desc)?,
        })
    }

    /// What is seen from a place, octant by octant or face by face.
    ///
    /// # Errors
    /// [`clerestory::Error::Setting`] for a place that is not finite.
    pub fn views(&self, scene: &GpuScene, origin: Vec3) -> Result<Vec<View>> {
        let near = View::near_plane(origin, &scene.surfaces());
        let area = Area::whole(self.size.to_array());
        match self.layout {
            Layout::Square => View::of_octants(origin, OctahedronLayout::Quadratic, near, area),
            Layout::Rectangle => View::of_octants(origin, OctahedronLayout::Rectangular, near, area),
            Layout::Cube => (0..CUBE_FACES)
                .map(|face| View::of_cube_face(origin, face, near, area))
                .collect(),
        }
    }

    /// Renders it, waits, and reads all texels.
    ///
    /// # Errors
    /// The G-buffer's.
    pub fn render(&self, gpu: &Gpu, scene: &GpuScene, views: &[View]) -> Result<Vec<Seen>> {
        let mut recorder = gpu.recorder("octahedron lab")?;
        self.gbuffer.record(&mut recorder, &scene.surfaces(), views)?;
        recorder.submit()?.wait()?;
        let triangles: Vec<u32> = self.gbuffer.read(gpu, Output::Triangle)?;
        let objects: Vec<u32> = self.gbuffer.read(gpu, Output::Object)?;
        let distances: Vec<f32> = self.gbuffer.read(gpu, Output::Distance)?;
        let all = triangles.into_iter().zip(objects).zip(distances);
        Ok(all
            .map(|((triangle, object), distance)| Seen {
                triangle,
                object,
                distance,
            })
            .collect())
    }

    /// The ray through the middle of a texel, the same that the rasterizer's pixel has.
    pub fn ray(&self, views: &[View], texel: Texel, direction: DVec3) -> Ray {
        let view = match self.layout {
            Layout::Cube => texel.layer,
            _ => (0..3).map(|axis| u32::from(direction[axis] < 0.0) << axis).sum(),
        };
        views[view as usize].ray(texel.x as f32 + 0.5, texel.y as f32 + 0.5)
    }

    /// Where a texel is in a list of all.
    pub fn index(&self, texel: Texel) -> usize {
        ((texel.layer * self.size.y + texel.y) * self.size.x + texel.x) as usize
    }

    /// The texel that a direction belongs to.
    pub fn at(&self, direction: DVec3) -> Option<Texel> {
        let at = self.layout.map().encode(direction)?;
        let p = (at.uv * self.size.as_dvec2()).as_uvec2().min(self.size - 1);
        Some(Texel {
            layer: at.layer,
            x: p.x,
            y: p.y,
        })
    }
}
