//! What is rasterized: the triangles of a scene in device memory.

use std::ops::Range;

use glam::Vec3;

use crate::gpu::shaders::sets::SceneSet;
use crate::scene::SceneProfile;

/// The triangles of one object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ObjectTriangles {
    /// Number of the object: of its instance in the scene.
    pub object: u32,
    /// Its triangles.
    pub triangles: Range<u32>,
    /// Its material's factors, whatever its textures, make it a mirror, or give it a smooth layer that mirrors in part.
    pub mirrors: bool,
    /// They let light through a smooth surface, one that mirrors or not.
    pub transmits: bool,
}

/// What of a scene its pixels depend on: what is absent is compiled out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SurfaceFeatures {
    /// Textures.
    pub textures: bool,
    /// Colours of vertices.
    pub vertex_colors: bool,
    /// Normals of vertices.
    pub shading_normals: bool,
    /// Normal maps.
    pub normal_maps: bool,
    /// Materials that are not there in part.
    pub alpha: bool,
}

impl SurfaceFeatures {
    /// What a scene has.
    pub fn of(profile: &SceneProfile) -> Self {
        Self {
            textures: profile.has_textures,
            vertex_colors: profile.has_vertex_colors,
            shading_normals: profile.has_shading_normals,
            normal_maps: profile.has_normal_maps,
            alpha: profile.has_alpha(),
        }
    }
}

/// Surfaces in device memory, such as those of [`GpuScene::surfaces`](crate::transport::GpuScene::surfaces).
#[derive(Debug, Clone, Copy)]
pub struct Surfaces<'a> {
    /// The scene's buffers.
    pub set: SceneSet<'a>,
    /// How many triangles are drawn: the first ones of the buffers.
    pub triangles: u32,
    /// Which triangles belong together.
    pub objects: &'a [ObjectTriangles],
    /// What pixels depend on.
    pub features: SurfaceFeatures,
    /// Least and greatest corner, metres.
    pub bounds: [Vec3; 2],
}

impl Surfaces<'_> {
    /// Distance of the farthest corner of the bounds from a point, metres.
    pub fn reach(&self, from: Vec3) -> f32 {
        let [lower, upper] = self.bounds;
        (lower - from).abs().max((upper - from).abs()).length()
    }

    /// The surfaces of the objects that come before that one; of all for one that is not among them.
    pub fn before(self, object: u32) -> Self {
        let place = self.objects.iter().position(|known| known.object == object);
        let end = place.map_or(self.triangles, |place| self.objects[place].triangles.start);
        Self {
            triangles: end,
            objects: &self.objects[..place.unwrap_or(self.objects.len())],
            ..self
        }
    }

    /// The triangles of an object; none of one that is not among them.
    pub fn triangles_of(&self, object: u32) -> Range<u32> {
        let found = self.objects.iter().find(|known| known.object == object);
        found.map_or(0..0, |known| known.triangles.clone())
    }

    /// The object of each triangle; `u32::MAX` without one.
    pub(super) fn object_of_triangles(&self) -> Vec<u32> {
        let mut objects = vec![u32::MAX; self.triangles as usize];
        for range in self.objects {
            let end = range.triangles.end.min(self.triangles);
            let start = range.triangles.start.min(end);
            objects[start as usize..end as usize].fill(range.object);
        }
        objects
    }
}
