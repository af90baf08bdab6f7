//! Triangle meshes of simple bodies, and a lamp, as the generated scenes need them.
//!
//! Every closed body has outward counter-clockwise faces and no T-junctions, so that a watertight ray test sees it closed.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{DVec3, Vec2, Vec3};

use crate::scene::{LightKind, Mesh, Scene};

/// A finger's breadth between what stands and what it stands on, so that no two faces coincide, m.
pub const REST: f32 = 0.005;

/// Collects faces into one mesh.
#[derive(Debug, Default)]
pub struct MeshBuilder {
    mesh: Mesh,
}

impl MeshBuilder {
    /// An empty mesh with a name and a material index.
    pub fn new(name: &str, material: u32) -> Self {
        Self {
            mesh: Mesh {
                name: name.into(),
                material: Some(material),
                ..Mesh::default()
            },
        }
    }

    /// Adds a planar (or skew) quadrilateral, counter-clockwise from its front, with its own four vertices.
    pub fn quad(&mut self, corners: [Vec3; 4]) -> &mut Self {
        self.fan(&corners)
    }

    /// Adds a convex polygon as a fan around its first corner.
    pub fn fan(&mut self, corners: &[Vec3]) -> &mut Self {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend_from_slice(corners);
        let last = first + corners.len() as u32;
        self.mesh
            .triangles
            .extend((first + 1..last.saturating_sub(1)).map(|i| [first, i, i + 1]));
        self
    }

    /// Adds an axis-parallel box with outward faces.
    pub fn cuboid(&mut self, low: Vec3, high: Vec3) -> &mut Self {
        for face in cuboid_faces(low, high) {
            self.quad(face);
        }
        self
    }

    /// Adds the inside of an axis-parallel box: faces towards its middle.
    pub fn room(&mut self, low: Vec3, high: Vec3) -> &mut Self {
        for [a, b, c, d] in cuboid_faces(low, high) {
            self.quad([a, d, c, b]);
        }
        self
    }

    /// Adds another mesh, moved by a function of its positions; normals are kept.
    pub fn append(&mut self, other: &Mesh, place: impl Fn(Vec3) -> Vec3) -> &mut Self {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(other.positions.iter().map(|&p| place(p)));
        self.mesh.normals.extend_from_slice(&other.normals);
        self.mesh.uv0.extend_from_slice(&other.uv0);
        self.mesh
            .triangles
            .extend(other.triangles.iter().map(|t| t.map(|i| first + i)));
        self
    }

    /// The mesh.
    pub fn build(&mut self) -> Mesh {
        std::mem::take(&mut self.mesh)
    }
}

/// The six faces of a box, outward: −x, +x, −y, +y, −z, +z.
pub fn cuboid_faces(low: Vec3, high: Vec3) -> [[Vec3; 4]; 6] {
    let corner = |x: u32, y: u32, z: u32| {
        let pick = |bit: u32, low: f32, high: f32| if bit == 0 { low } else { high };
        Vec3::new(pick(x, low.x, high.x), pick(y, low.y, high.y), pick(z, low.z, high.z))
    };
    [
        [corner(0, 0, 0), corner(0, 0, 1), corner(0, 1, 1), corner(0, 1, 0)],
        [corner(1, 0, 0), corner(1, 1, 0), corner(1, 1, 1), corner(1, 0, 1)],
        [corner(0, 0, 0), corner(1, 0, 0), corner(1, 0, 1), corner(0, 0, 1)],
        [corner(0, 1, 0), corner(0, 1, 1), corner(1, 1, 1), corner(1, 1, 0)],
        [corner(0, 0, 0), corner(0, 1, 0), corner(1, 1, 0), corner(1, 0, 0)],
        [corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1)],
    ]
}

/// A quadrilateral with texture coordinates that repeat `repeat` times along each side.
pub fn textured_quad(name: &str, material: u32, corners: [Vec3; 4], repeat: Vec2) -> Mesh {
    let mut mesh = MeshBuilder::new(name, material).quad(corners).build();
    mesh.uv0 = vec![Vec2::new(0.0, repeat.y), repeat, Vec2::new(repeat.x, 0.0), Vec2::ZERO];
    mesh
}

/// A geodesic sphere: each edge of an icosahedron cut into `frequency` parts, 20·frequency² triangles, outward.
///
/// Vertices lie on the sphere of `radius` around the origin; `smooth` adds their exact normals.
pub fn geodesic_sphere(name: &str, material: u32, radius: f64, frequency: u32, smooth: bool) -> Mesh {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut corners = Vec::with_capacity(12);
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        corners.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    let mut directions: Vec<DVec3> = Vec::new();
    let mut triangles = Vec::new();
    // Vertices are shared by their exact integer barycentric key, so that neighbouring faces meet without a seam.
    let mut known: HashMap<[(usize, u32); 3], u32> = HashMap::new();
    let n = frequency.max(1);
    for face in icosahedron_faces(&corners) {
        let mut vertex = |i: u32, j: u32| {
            let mut key = [(face[0], n - i - j), (face[1], i), (face[2], j)];
            for part in &mut key {
                if part.1 == 0 {
                    *part = (usize::MAX, 0);
                }
            }
            key.sort_unstable();
            *known.entry(key).or_insert_with(|| {
                let sum: DVec3 = key
                    .iter()
                    .filter(|part| part.1 > 0)
                    .map(|&(corner, weight)| corners[corner] * f64::from(weight))
                    .sum();
                directions.push(sum.normalize());
                directions.len() as u32 - 1
            })
        };
        for i in 0..n {
            for j in 0..n - i {
                triangles.push([vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)]);
                if i + j + 1 < n {
                    triangles.push([vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)]);
                }
            }
        }
    }
    Mesh {
        name: name.into(),
        positions: directions.iter().map(|d| (*d * radius).as_vec3()).collect(),
        normals: if smooth {
            directions.iter().map(|d| d.as_vec3()).collect()
        } else {
            Vec::new()
        },
        triangles,
        material: Some(material),
        ..Mesh::default()
    }
}

/// The twenty faces as corner triples, outward: all triples at mutual edge distance.
fn icosahedron_faces(corners: &[DVec3]) -> Vec<[usize; 3]> {
    // Edges of this icosahedron have length 2; the next distance is 2·golden.
    let near = |a: usize, b: usize| corners[a].distance(corners[b]) < 2.5;
    let mut faces = Vec::with_capacity(20);
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outward = (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(corners[a]) > 0.0;
                    faces.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    faces
}

/// A latitude–longitude sphere with texture coordinates and exact normals: 2·slices·(stacks − 1) triangles, outward.
///
/// The seam and the poles have their own vertices, so that texture coordinates do not run backwards.
pub fn lat_long_sphere(name: &str, material: u32, radius: f64, slices: u32, stacks: u32) -> Mesh {
    let (slices, stacks) = (slices.max(3), stacks.max(2));
    let mut mesh = Mesh {
        name: name.into(),
        material: Some(material),
        ..Mesh::default()
    };
    for stack in 0..=stacks {
        let theta = std::f64::consts::PI * f64::from(stack) / f64::from(stacks);
        let polar = stack == 0 || stack == stacks;
        for slice in 0..=slices {
            // The column past the last repeats the first bit for bit, and the poles are exact points.
            let phi = TAU * f64::from(slice % slices) / f64::from(slices);
            let ring = if polar { 0.0 } else { theta.sin() };
            let direction = DVec3::new(ring * phi.cos(), theta.cos(), -ring * phi.sin());
            mesh.positions.push((direction * radius).as_vec3());
            mesh.normals.push(direction.as_vec3());
            let across = if polar {
                f64::from(slice) + 0.5
            } else {
                f64::from(slice)
            };
            mesh.uv0.push(Vec2::new(
                (across / f64::from(slices)) as f32,
                (f64::from(stack) / f64::from(stacks)) as f32,
            ));
        }
    }
    let at = |stack: u32, slice: u32| stack * (slices + 1) + slice;
    for stack in 0..stacks {
        for slice in 0..slices {
            let (a, b) = (at(stack, slice), at(stack + 1, slice));
            if stack + 1 < stacks {
                mesh.triangles.push([a, b, b + 1]);
            } else {
                mesh.triangles.push([a, b, a + 1]);
            }
            if stack > 0 && stack + 1 < stacks {
                mesh.triangles.push([a, b + 1, a + 1]);
            }
        }
    }
    mesh
}

/// A cylinder wall around +Y from y = 0, without caps, faces outward: 2·segments triangles.
pub fn cylinder_wall(name: &str, material: u32, radius: f64, height: f64, segments: u32, smooth: bool) -> Mesh {
    let segments = segments.max(3);
    let mut mesh = Mesh {
        name: name.into(),
        material: Some(material),
        ..Mesh::default()
    };
    for segment in 0..segments {
        let phi = TAU * f64::from(segment) / f64::from(segments);
        let outward = DVec3::new(phi.cos(), 0.0, -phi.sin());
        for y in [0.0, height] {
            mesh.positions.push((outward * radius + DVec3::Y * y).as_vec3());
            if smooth {
                mesh.normals.push(outward.as_vec3());
            }
        }
        let next = (segment + 1) % segments;
        mesh.triangles.push([2 * segment, 2 * next, 2 * next + 1]);
        mesh.triangles.push([2 * segment, 2 * next + 1, 2 * segment + 1]);
    }
    mesh
}

/// A body of revolution around +Y: its outline as pairs of radius and height, from below upward, closed where it begins and ends with
/// radius 0; flat faces, outward. 2·segments triangles between two points of the outline, half of them where one has radius 0.
pub fn lathe(name: &str, material: u32, outline: &[(f64, f64)], segments: u32) -> Mesh {
    let segments = segments.max(3);
    let mut mesh = Mesh {
        name: name.into(),
        material: Some(material),
        ..Mesh::default()
    };
    for (radius, height) in outline {
        for segment in 0..segments {
            let phi = TAU * f64::from(segment) / f64::from(segments);
            let position = DVec3::new(radius * phi.cos(), *height, -radius * phi.sin());
            mesh.positions.push(position.as_vec3());
        }
    }
    for (ring, pair) in (0..).zip(outline.windows(2)) {
        for segment in 0..segments {
            let next = (segment + 1) % segments;
            let [a, b] = [segment, next].map(|s| ring * segments + s);
            let [c, d] = [a, b].map(|below| below + segments);
            if pair[0].0 > 0.0 {
                mesh.triangles.push([a, b, d]);
            }
            if pair[1].0 > 0.0 {
                mesh.triangles.push([a, d, c]);
            }
        }
    }
    mesh
}

/// Half a ring that stands on the plane y = 0 around the z axis: between two radii, `depth` thick about z = 0, with its feet closed;
/// 8·segments + 4 triangles, outward. `rise` stretches its height: 1 for a round arch, more for one that is steeper.
pub fn arch(name: &str, material: u32, [inner, outer]: [f64; 2], depth: f64, rise: f64, segments: u32) -> Mesh {
    let segments = segments.max(1);
    let mut builder = MeshBuilder::new(name, material);
    let corner = |segment: u32, radius: f64, side: f64| {
        let angle = std::f64::consts::PI * f64::from(segment) / f64::from(segments);
        // The second foot stands exactly as high as the first.
        let sine = if segment == segments { 0.0 } else { angle.sin() };
        DVec3::new(radius * angle.cos(), rise * radius * sine, side * depth / 2.0).as_vec3()
    };
    let ring = |segment: u32| {
        let at = |radius, side| corner(segment, radius, side);
        [at(inner, -1.0), at(outer, -1.0), at(outer, 1.0), at(inner, 1.0)]
    };
    for segment in 0..segments {
        let (from, to) = (ring(segment), ring(segment + 1));
        for side in 0..4 {
            let next = (side + 1) % 4;
            builder.quad([from[side], to[side], to[next], from[next]]);
        }
    }
    builder.quad(ring(0));
    let [a, b, c, d] = ring(segments);
    builder.quad([d, c, b, a]);
    builder.build()
}

/// A box around the origin with round edges: each face a grid of `cells`², whose points lie `radius` away from a smaller box;
/// 12·cells² triangles, outward.
pub fn rounded_box(name: &str, material: u32, half: Vec3, radius: f32, cells: u32) -> Mesh {
    let cells = cells.max(1);
    let core = half - Vec3::splat(radius);
    let mut builder = MeshBuilder::new(name, material);
    for [a, b, _, d] in cuboid_faces(-half, half) {
        let point = |i: u32, j: u32| {
            let mut on_box = a;
            for axis in 0..3 {
                let steps = |corner: Vec3, k: u32| {
                    let difference = corner[axis] - a[axis];
                    (difference != 0.0).then_some(if difference > 0.0 { k } else { cells - k })
                };
                // Counted from the low side on every face, so that neighbours share their points to the bit.
                if let Some(k) = steps(b, i).or(steps(d, j)) {
                    on_box[axis] = half[axis] * ((2.0 * k as f32 - cells as f32) / cells as f32);
                }
            }
            let middle = on_box.clamp(-core, core);
            middle + (on_box - middle).normalize() * radius
        };
        for i in 0..cells {
            for j in 0..cells {
                builder.quad([point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]);
            }
        }
    }
    builder.build()
}

/// A sheet of `columns` × `rows` cells over the unit square, each point where `place` puts it; counter-clockwise as the square is when
/// its second axis points up; 2·columns·rows triangles that share their corners.
pub fn sheet(name: &str, material: u32, columns: u32, rows: u32, place: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let mut mesh = Mesh {
        name: name.into(),
        material: Some(material),
        ..Mesh::default()
    };
    for row in 0..=rows {
        for column in 0..=columns {
            mesh.positions
                .push(place(column as f32 / columns as f32, row as f32 / rows as f32));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let above = a + columns + 1;
            mesh.triangles.extend([[a, a + 1, above + 1], [a, above + 1, above]]);
        }
    }
    mesh
}

/// Adds a point light named `lamp`; intensity in W/sr.
pub fn point_lamp(scene: &mut Scene, position: Vec3, intensity: Vec3) {
    scene.add_light("lamp", LightKind::Point { position, intensity });
}

/// Turns a mesh inside out: faces and normals point the other way.
pub fn inverted(mut mesh: Mesh) -> Mesh {
    for triangle in &mut mesh.triangles {
        triangle.swap(1, 2);
    }
    for normal in &mut mesh.normals {
        *normal = -*normal;
    }
    mesh
}

/// The sum of a mesh's triangle areas in its own space, square metres.
pub fn area(mesh: &Mesh) -> f64 {
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
            (b - a).cross(c - a).length() / 2.0
        })
        .sum()
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// The directed edges (by exact position) that are not met by their opposites: none for a closed, consistently wound mesh.
    pub fn open_edges(mesh: &Mesh) -> usize {
        let key = |i: u32| mesh.positions[i as usize].to_array().map(|x| (x + 0.0).to_bits());
        let mut edges: BTreeMap<_, i64> = BTreeMap::new();
        for t in &mesh.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let (a, b) = (key(a), key(b));
                if a != b {
                    *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
                }
            }
        }
        edges.values().filter(|&&n| n != 0).count()
    }

    /// Signed volume by the divergence theorem; positive for outward faces.
    pub fn volume(mesh: &Mesh) -> f64 {
        mesh.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    #[test]
    fn bodies_are_closed_and_face_outward() {
        let cuboid = MeshBuilder::new("", 0)
            .cuboid(Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 4.0, 6.0))
            .build();
        assert_eq!((open_edges(&cuboid), cuboid.triangles.len()), (0, 12));
        assert_eq!(volume(&cuboid), 6.0);
        assert_eq!(area(&cuboid), 22.0);
        for frequency in [1, 2, 3, 7] {
            let sphere = geodesic_sphere("", 0, 2.0, frequency, true);
            assert_eq!(sphere.triangles.len() as u32, 20 * frequency * frequency);
            assert_eq!(sphere.positions.len() as u32, 10 * frequency * frequency + 2);
            assert_eq!(open_edges(&sphere), 0);
            let ball = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
            // The inscribed body is smaller by O(edge²); an icosahedron fills 0.605 of its ball.
            assert!(volume(&sphere) > 0.6 * ball && volume(&sphere) < ball);
        }
        let globe = lat_long_sphere("", 0, 1.0, 31, 12);
        assert_eq!((open_edges(&globe), globe.triangles.len()), (0, 682));
        assert!(volume(&globe) > 3.9);
        assert!(volume(&inverted(globe)) < -3.9);
    }

    #[test]
    fn sphere_triangles_have_area() {
        for mesh in [
            geodesic_sphere("", 0, 1.0, 5, false),
            lat_long_sphere("", 0, 1.0, 16, 8),
        ] {
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                assert!((b - a).cross(c - a).length() > 1e-4);
            }
        }
    }

    #[test]
    fn turned_arched_and_rounded_bodies_are_closed_and_face_outward() {
        let vase = lathe("", 0, &[(0.0, 0.0), (0.5, 0.0), (0.3, 1.0), (0.0, 1.5)], 24);
        assert_eq!((vase.triangles.len(), open_edges(&vase)), (24 * 4, 0));
        assert!(volume(&vase) > 0.5 && volume(&vase) < 0.7);
        let half_ring = arch("", 0, [1.0, 1.2], 0.5, 1.5, 16);
        assert_eq!((half_ring.triangles.len(), open_edges(&half_ring)), (8 * 16 + 4, 0));
        let smooth = 0.5 * 0.5 * std::f64::consts::PI * 1.5 * (1.2 * 1.2 - 1.0);
        assert!(volume(&half_ring) > 0.98 * smooth && volume(&half_ring) < smooth);
        let cushion = rounded_box("", 0, Vec3::new(0.3, 0.05, 0.25), 0.04, 9);
        assert_eq!((cushion.triangles.len(), open_edges(&cushion)), (12 * 81, 0));
        assert!(volume(&cushion) > 0.8 * 0.03 && volume(&cushion) < 0.03);
        let cloth = sheet("", 0, 5, 3, |u, v| Vec3::new(u, v, 0.0));
        assert_eq!((cloth.triangles.len(), open_edges(&cloth)), (30, 16));
        assert!((area(&cloth) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_cylinder_wall_is_open_at_both_rims_only() {
        let wall = cylinder_wall("", 0, 1.0, 0.5, 64, true);
        assert_eq!((wall.triangles.len(), open_edges(&wall)), (128, 128));
    }
}
