//! Bodies that hold media or absorb: which one a point is in, and which one each body and each light is in.
//!
//! A body is an instance of a solid that refracts or of an invisible boundary. Method: the winding number of its surface about the point, by the
//! solid angles of its triangles (Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983), in f64. Of bodies around a point
//! the one of least volume counts, so bodies may lie in bodies as long as their surfaces do not cross; a body is placed by one point of
//! its surface, and so is a lamp, of which triangles that share a corner are one. Only scenes with media have any, and those with lights that have a place where solids absorb.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::geometry::{Geometry, corners_of, numbered_instances};
use crate::gpu::shaders::constants::{LIGHT_POINT, LIGHT_SPOT, LIGHT_TRIANGLE, NO_MEDIUM};
use crate::gpu::shaders::types::{GlowBody, SceneLight};
use crate::scene::{Instance, LightKind, Material, Mesh, Scene, SceneProfile};

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

/// Whether it matters which body a point is in: for media, or for lights inside bodies that absorb.
pub(super) fn matter(scene: &Scene, profile: &SceneProfile) -> bool {
    profile.media.any() || profile.has_absorption && !lamp_boxes(scene).is_empty()
}

/// Where there are lights that have a place: points, spots and what emits, each by the corners of a box around it.
pub(super) fn lamp_boxes(scene: &Scene) -> Vec<[DVec3; 2]> {
    let points = scene.lights.iter().filter_map(|light| match light.kind {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some([position.as_dvec3(); 2]),
        LightKind::Directional { .. } => None,
    });
    let emits = |mesh: &Mesh| {
        let material = mesh.material.map(|index| &scene.materials[index as usize]);
        material.is_some_and(|material| material.emission.max_element() > 0.0)
    };
    let lamps = scene.instances.iter().filter_map(|instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        emits(mesh).then(|| placed_box(mesh, instance))
    });
    points.chain(lamps).collect()
}

/// A box around an instance of a mesh.
pub(super) fn placed_box(mesh: &Mesh, instance: &Instance) -> [DVec3; 2] {
    let ends = mesh.bounds().map(|p| p.as_dvec3());
    let corner = |i: usize| {
        let end = |axis: usize| ends[(i >> axis) & 1][axis];
        instance.transform.transform_point3(DVec3::new(end(0), end(1), end(2)))
    };
    (1..8)
        .map(corner)
        .fold([corner(0); 2], |[lower, upper], p| [lower.min(p), upper.max(p)])
}

/// Whether two boxes have a point in common.
pub(super) fn boxes_meet(a: &[DVec3; 2], b: &[DVec3; 2]) -> bool {
    a[0].cmple(b[1]).all() && b[0].cmple(a[1]).all()
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
            let around = bodies
                .innermost(middle(&body.triangles[0]), body.volume)
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

    /// A box around the bodies of these materials; `None` without any.
    pub(super) fn bounds_of(&self, is_one: impl Fn(u32) -> bool) -> Option<[DVec3; 2]> {
        let bounds = self.0.iter().filter(|body| is_one(body.material)).map(Body::bounds);
        bounds.reduce(|[a, b], [lower, upper]| [a.min(lower), b.max(upper)])
    }

    /// The bodies whose boxes are `reached`, from the least one on, as photons of media that emit read them, and nine numbers for each of their triangles.
    pub(super) fn glow_bodies(
        &self,
        scene: &Scene,
        reached: impl Fn(&[DVec3; 2]) -> bool,
    ) -> (Vec<GlowBody>, Vec<f32>) {
        let with_volume = self.0.iter().filter(|body| body.volume > 0.0);
        let mut found: Vec<&Body> = with_volume.filter(|body| reached(&body.bounds())).collect();
        found.sort_by(|a, b| a.volume.total_cmp(&b.volume));
        let (mut records, mut corners) = (Vec::new(), Vec::new());
        for body in found {
            records.push(GlowBody {
                lower: body.lower.as_vec3().to_array(),
                first: (corners.len() / 9) as u32,
                upper: body.upper.as_vec3().to_array(),
                triangles: body.triangles.len() as u32,
                material: body.material,
                medium: scene.materials[body.material as usize].interior.unwrap_or(NO_MEDIUM),
                ..GlowBody::default()
            });
            corners.extend(body.triangles.iter().flatten().flat_map(Vec3::to_array));
        }
        (records, corners)
    }

    /// Writes to a light without area which body is around it.
    pub(super) fn enclose_point(&self, light: &mut SceneLight) {
        if matches!(light.kind, LIGHT_POINT | LIGHT_SPOT) {
            let point = Vec3::from_array(light.position).as_dvec3();
            light.around = self.around(point).map_or(0, |material| material + 1);
        }
    }

    /// Writes to all lights that have a place which body is around them; those on the surface of a body are where that is.
    pub(super) fn enclose(&self, scene: &Scene, lights: &mut [SceneLight], geometry: &Geometry) {
        if self.0.is_empty() {
            return;
        }
        lights.par_iter_mut().for_each(|light| self.enclose_point(light));
        let (mut inside, mut corners) = (Vec::new(), Vec::new());
        for (index, triangle) in geometry.triangles[..geometry.in_world()].iter().enumerate() {
            let Some(light) = lights.get_mut(triangle.light as usize) else {
                continue;
            };
            // Of triangles in one place one is the light.
            if light.kind != LIGHT_TRIANGLE || light.triangle != geometry.name(index) {
                continue;
            }
            let own = scene.materials.get(triangle.material as usize);
            if own.is_some_and(bounds_body) {
                light.around = triangle.around;
                continue;
            }
            let of_triangle = corners_of(triangle);
            let point = middle(&of_triangle);
            if self.0.iter().any(|body| body.is_near(point)) {
                inside.push(triangle.light as usize);
                corners.push(of_triangle);
            }
        }
        for (light, found) in inside.into_iter().zip(self.around_pieces(&corners)) {
            lights[light].around = found.map_or(0, |material| material + 1);
        }
    }

    /// Material of the smallest body around each triangle, if any: that of one point for all triangles that hang together by common corners.
    fn around_pieces(&self, triangles: &[[Vec3; 3]]) -> Vec<Option<u32>> {
        let mut before: Vec<usize> = (0..triangles.len()).collect();
        let mut at_corner = HashMap::new();
        for (i, corners) in triangles.iter().enumerate() {
            for corner in corners {
                // Adding zero makes both zeros one.
                match at_corner.entry((*corner + Vec3::ZERO).to_array().map(f32::to_bits)) {
                    Entry::Vacant(entry) => _ = entry.insert(i),
                    Entry::Occupied(entry) => {
                        let (a, b) = (first_of(&mut before, i), first_of(&mut before, *entry.get()));
                        before[a.max(b)] = a.min(b);
                    }
                }
            }
        }
        let firsts: Vec<usize> = (0..triangles.len()).map(|i| first_of(&mut before, i)).collect();
        let ask = |(i, first): (usize, &usize)| (i == *first).then(|| self.around(middle(&triangles[i]))).flatten();
        let found: Vec<Option<u32>> = firsts.par_iter().enumerate().map(ask).collect();
        firsts.iter().map(|first| found[*first]).collect()
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

    fn bounds(&self) -> [DVec3; 2] {
        [self.lower, self.upper]
    }

    /// Whether a point is in the box around it.
    fn is_near(&self, point: DVec3) -> bool {
        point.cmpge(self.lower).all() && point.cmple(self.upper).all()
    }

    fn contains(&self, point: DVec3) -> bool {
        // Once around is 4 pi; half of that tells points on the surface from those inside.
        self.is_near(point)
            && self.triangles.iter().map(|t| solid_angle(t, point)).sum::<f64>().abs() > std::f64::consts::TAU
    }
}

/// The first triangle of a piece, where each of its triangles names one before it, or itself.
fn first_of(before: &mut [usize], mut triangle: usize) -> usize {
    while before[triangle] != triangle {
        before[triangle] = before[before[triangle]];
        triangle = before[triangle];
    }
    triangle
}

fn middle(corners: &[Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (a + b + c) / 3.0
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
    use super::super::light_record;
    use super::*;
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

    fn glass(scene: &mut Scene, name: &str) -> u32 {
        scene.add_material(Material {
            attenuation_color: Vec3::splat(0.5),
            attenuation_distance: 1.0,
            ..Material::glass(name, 1.5)
        })
    }

    fn put(scene: &mut Scene, mesh: Mesh, place: DVec3) {
        let mesh = scene.add_mesh(mesh);
        scene.instances.push(Instance {
            mesh,
            transform: DAffine3::from_translation(place),
            name: String::new(),
        });
    }

    #[test]
    fn lights_know_which_body_is_around_them() {
        let mut scene = Scene::default();
        let (outer, inner) = (glass(&mut scene, "outer"), glass(&mut scene, "inner"));
        let shining = scene.add_material(Material {
            emission: Vec3::ONE,
            ..Material::default()
        });
        let glowing = scene.add_material(Material {
            emission: Vec3::ONE,
            ..Material::glass("glowing", 1.5)
        });
        put(&mut scene, octahedron(outer, 2.0), DVec3::ZERO);
        put(&mut scene, octahedron(inner, 0.5), DVec3::X);
        // A lamp of two pieces, one in either body, one that is a body itself, and one beside all.
        let mut pieces = octahedron(shining, 0.1);
        let other = octahedron(shining, 0.1);
        pieces.positions.extend(other.positions.iter().map(|p| *p + Vec3::X));
        pieces
            .triangles
            .extend(other.triangles.iter().map(|t| t.map(|i| i + 6)));
        put(&mut scene, pieces, DVec3::ZERO);
        put(&mut scene, octahedron(glowing, 0.1), DVec3::new(-0.8, 0.0, 0.0));
        put(&mut scene, octahedron(shining, 0.1), DVec3::Y * 3.0);
        for x in [0.3, 1.2, 3.0] {
            let position = Vec3::new(x, 0.01, 0.02);
            let intensity = Vec3::ONE;
            scene.add_light("point", LightKind::Point { position, intensity });
        }
        let profile = SceneProfile::of(&scene);
        assert!(matter(&scene, &profile));
        let mut geometry = Geometry::flatten(&scene, &profile).unwrap();
        let bodies = Bodies::place(&scene, &mut geometry);
        let mut lights: Vec<SceneLight> = scene.lights.iter().map(|light| light_record(&light.kind)).collect();
        for index in 16..geometry.triangles.len() {
            geometry.triangles[index].light = lights.len() as u32;
            lights.push(SceneLight {
                kind: LIGHT_TRIANGLE,
                triangle: geometry.name(index),
                ..SceneLight::default()
            });
        }
        bodies.enclose(&scene, &mut lights, &geometry);
        let around: Vec<u32> = lights.iter().map(|light| light.around).collect();
        let expected = [
            (1, outer + 1),
            (1, inner + 1),
            (1, 0),
            (8, outer + 1),
            (8, inner + 1),
            (8, outer + 1),
            (8, 0),
        ];
        let expected: Vec<u32> = expected.iter().flat_map(|(count, body)| vec![*body; *count]).collect();
        assert_eq!(around, expected);
        // A piece is where its first triangle is, also beyond a body's surface.
        let piece = [[Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::X, Vec3::Y, Vec3::ONE * 9.0]];
        assert_eq!(bodies.around_pieces(&piece), [Some(outer); 2]);
        // Nothing asks without absorption, or without a light that has a place.
        for material in &mut scene.materials {
            material.attenuation_color = Vec3::ONE;
        }
        assert!(!matter(&scene, &SceneProfile::of(&scene)));
        let mut lit = Scene::default();
        let tinted = glass(&mut lit, "tinted");
        put(&mut lit, octahedron(tinted, 1.0), DVec3::ZERO);
        let (direction, irradiance) = (Vec3::Y, Vec3::ONE);
        lit.add_light("sun", LightKind::Directional { direction, irradiance });
        assert!(!matter(&lit, &SceneProfile::of(&lit)));
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
