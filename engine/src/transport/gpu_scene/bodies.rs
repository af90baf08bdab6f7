//! Bodies that hold media: which one a point is in, and which one each body is in.
//!
//! A body is an instance of a solid that refracts or of an invisible boundary. Method: the winding number of its surface about the point, by the
//! solid angles of its triangles (Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983), in f64. Of bodies around a point
//! the one of least volume counts, so bodies may lie in bodies as long as their surfaces do not cross; a body is placed by one point of
//! its surface. Only scenes with media have any.

use glam::{DVec3, Vec3};

use super::geometry::{Geometry, corners_of, numbered_instances};
use crate::scene::{Material, Scene};

/// The bodies of a scene.
#[derive(Debug, Default)]
pub(super) struct Bodies(Vec<Body>);

#[derive(Debug)]
struct Body {
    material: u32,
    first_triangle: usize,
    triangles: Vec<[Vec3; 3]>,
    lower: DVec3,
    upper: DVec3,
    volume: f64,
}

/// Whether light goes in and out of what the material bounds.
pub(super) fn bounds_body(material: &Material) -> bool {
    material.boundary || (material.transmission > 0.0 && material.thickness > 0.0)
}

impl Bodies {
    /// Finds the bodies of a scene, and writes to their triangles which body is around them.
    pub(super) fn place(scene: &Scene, geometry: &mut Geometry) -> Self {
        let mut bodies = Self::default();
        let mut first_triangle = 0;
        let kept = |object: usize| geometry.kept.as_ref().is_some_and(|kept| kept.keeps(object));
        // Those that are kept are none.
        for (_, instance) in numbered_instances(scene).filter(|(object, _)| !kept(*object)) {
            let mesh = &scene.meshes[instance.mesh as usize];
            let end = first_triangle + mesh.triangles.len();
            let material = mesh
                .material
                .filter(|&index| bounds_body(&scene.materials[index as usize]));
            if let Some(material) = material.filter(|_| end > first_triangle) {
                let triangles = geometry.triangles[first_triangle..end].iter().map(corners_of);
                bodies.0.push(Body::new(material, first_triangle, triangles.collect()));
            }
            first_triangle = end;
        }
        for body in &bodies.0 {
            let [a, b, c] = body.triangles[0].map(|p| p.as_dvec3());
            let around = bodies
                .innermost((a + b + c) / 3.0, body.volume)
                .map_or(0, |material| material + 1);
            for triangle in &mut geometry.triangles[body.first_triangle..][..body.triangles.len()] {
                triangle.around = around;
            }
        }
        bodies
    }

    /// Material of the smallest body around a point, if any.
    pub(super) fn around(&self, point: DVec3) -> Option<u32> {
        self.innermost(point, 0.0)
    }

    /// As [`Bodies::around`], among those with more than a volume.
    fn innermost(&self, point: DVec3, least: f64) -> Option<u32> {
        let around = self.0.iter().filter(|body| body.volume > least && body.contains(point));
        around
            .min_by(|a, b| a.volume.total_cmp(&b.volume))
            .map(|body| body.material)
    }
}

impl Body {
    fn new(material: u32, first_triangle: usize, triangles: Vec<[Vec3; 3]>) -> Self {
        let points = || triangles.iter().flatten().map(|p| p.as_dvec3());
        let lower = points().fold(DVec3::INFINITY, DVec3::min);
        let upper = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let six_volumes = |corners: &[Vec3; 3]| {
            let [a, b, c] = corners.map(|p| p.as_dvec3() - lower);
            a.cross(b).dot(c)
        };
        let volume = triangles.iter().map(six_volumes).sum::<f64>().abs() / 6.0;
        Self {
            material,
            first_triangle,
            triangles,
            lower,
            upper,
            volume,
        }
    }

    fn contains(&self, point: DVec3) -> bool {
        let inside_bounds = point.cmpge(self.lower).all() && point.cmple(self.upper).all();
        // Once around is 4 pi; half of that tells points on the surface from those inside.
        inside_bounds && self.triangles.iter().map(|t| solid_angle(t, point)).sum::<f64>().abs() > std::f64::consts::TAU
    }
}

/// Signed solid angle of a triangle seen from a point, sr.
fn solid_angle(corners: &[Vec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = corners.map(|p| p.as_dvec3() - point);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.cross(b).dot(c).atan2(below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Mesh, Scene, SceneProfile};
    use glam::DAffine3;

    /// The surface of an octahedron of half the diagonal `r`.
    fn octahedron(material: u32, r: f32) -> Mesh {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        Mesh {
            positions: axes.map(|axis| axis * r).into(),
            triangles: vec![
                [0, 1, 2],
                [1, 3, 2],
                [3, 4, 2],
                [4, 0, 2],
                [1, 0, 5],
                [3, 1, 5],
                [4, 3, 5],
                [0, 4, 5],
            ],
            material: Some(material),
            ..Mesh::default()
        }
    }

    #[test]
    fn bodies_know_what_is_around_them() {
        let mut scene = Scene::default();
        let fog = |name: &str| Material {
            name: name.into(),
            boundary: true,
            ..Material::default()
        };
        let (outer, inner) = (scene.add_material(fog("outer")), scene.add_material(fog("inner")));
        let (big, small) = (
            scene.add_mesh(octahedron(outer, 2.0)),
            scene.add_mesh(octahedron(inner, 0.5)),
        );
        for (mesh, x, scale) in [(big, 0.0, 1.0), (small, 1.0, 1.0), (small, 5.0, -1.0)] {
            scene.instances.push(Instance {
                mesh,
                transform: DAffine3::from_translation(DVec3::X * x) * DAffine3::from_scale(DVec3::splat(scale)),
                name: String::new(),
            });
        }
        let mut geometry = Geometry::flatten(&scene, &SceneProfile::of(&scene)).unwrap();
        let bodies = Bodies::place(&scene, &mut geometry);
        for (x, expected) in [
            (0.0, Some(outer)),
            (1.0, Some(inner)),
            (1.4, Some(inner)),
            (1.6, Some(outer)),
            (3.0, None),
            (5.2, Some(inner)),
        ] {
            assert_eq!(bodies.around(DVec3::new(x, 0.01, 0.02)), expected, "{x}");
        }
        let around: Vec<u32> = geometry.triangles.iter().map(|t| t.around).collect();
        let (n, m) = (scene.meshes[0].triangles.len(), scene.meshes[1].triangles.len());
        assert!(around[..n].iter().all(|a| *a == 0));
        assert!(around[n..n + m].iter().all(|a| *a == outer + 1));
        assert!(around[n + m..].iter().all(|a| *a == 0));
    }
}
