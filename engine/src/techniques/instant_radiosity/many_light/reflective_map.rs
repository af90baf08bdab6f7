//! Reflective shadow maps read back to the host: where each view of a light is seen from, and what light its texels have.

use glam::Vec3;

use super::renderer::ManyLight;
use crate::Result;
use crate::gpu::shaders::types::{RsmTexel, RsmView, SceneTriangle, SeenFrom};

/// A view of a light, and the light that its texels have.
///
/// A point shows at a texel's middle where the ray through that meets it: of central views from `origin` along `forward` + x `right` + y `down`, of parallel light from `origin` + x `right` +
/// y `down` along `forward`, for x and y from -1 to 1 over the picture.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ReflectiveMap {
    /// Place, m.
    pub origin: Vec3,
    /// From the middle of the picture to its right side, at distance 1 along `forward`; of parallel light in m.
    pub right: Vec3,
    /// From the middle to the lower side, likewise.
    pub down: Vec3,
    /// Unit direction of the picture's middle.
    pub forward: Vec3,
    /// Of parallel light.
    pub is_parallel: bool,
    /// Texels along a side.
    pub side: u32,
    /// Row by row, from the upper left; `None` where nothing is met that scatters light on.
    pub texels: Vec<Option<PixelLight>>,
}

/// The light of a texel of a [`ReflectiveMap`].
///
/// Source: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelLight {
    /// Place, m.
    pub position: Vec3,
    /// Geometric normal, to the side that the light comes from.
    pub normal: Vec3,
    /// Power that arrives there, W.
    pub power: Vec3,
}

impl ReflectiveMap {
    fn of(seen: &SeenFrom, texels: &[RsmTexel], triangles: &[SceneTriangle]) -> Self {
        let [origin, right, down, forward] = [seen.origin, seen.right, seen.down, seen.forward].map(Vec3::from_array);
        let is_parallel = seen.is_parallel != 0;
        let light = |texel: &RsmTexel| {
            let power = Vec3::from_array(texel.power);
            let triangle = triangles.get(texel.triangle as usize);
            let triangle = triangle.filter(|_| power != Vec3::ZERO)?;
            let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(Vec3::from_array);
            let [to_b, to_c] = texel.weights;
            let position = a + to_b * (b - a) + to_c * (c - a);
            let way = if is_parallel { forward } else { position - origin };
            let front = (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize().as_vec3();
            let normal = if front.dot(way) > 0.0 { -front } else { front };
            Some(PixelLight {
                position,
                normal,
                power,
            })
        };
        Self {
            origin,
            right,
            down,
            forward,
            is_parallel,
            side: seen.width,
            texels: texels.iter().map(light).collect(),
        }
    }
}

impl ManyLight {
    /// The reflective shadow maps that a frame has drawn last, in the order of its lights and of their views; none where virtual lights do not come from such, or before the first frame. Waits for the
    /// device.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn reflective_maps(&self) -> Result<Vec<ReflectiveMap>> {
        let Some(reflective) = self.reflective() else {
            return Ok(Vec::new());
        };
        let surfaces = self.scene.surfaces();
        let records = surfaces.set.scene_triangles.buffer().view();
        let triangles: Vec<SceneTriangle> = self.gpu.read(records, surfaces.triangles as usize)?;
        let [_, views, texels] = reflective.texels();
        let views: Vec<RsmView> = self.gpu.read(views.view(), self.viewed as usize)?;
        let of_view = reflective.side().pow(2) as usize;
        let texels: Vec<RsmTexel> = self.gpu.read(texels.view(), of_view * views.len())?;
        let pairs = views.iter().zip(texels.chunks(of_view));
        Ok(pairs
            .map(|(view, texels)| ReflectiveMap::of(&view.seen, texels, &triangles))
            .collect())
    }
}
