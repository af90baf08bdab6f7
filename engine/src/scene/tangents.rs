//! Tangents for normal maps, by the mikktspace algorithm that glTF 2.0 §3.7.2.1 prescribes.
//!
//! M. S. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008; the crate
//! `bevy_mikktspace`, which is free of unsafe code. Vertices whose corners disagree are split.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};

use super::Mesh;
use crate::catalogue::{Role, Row, sources};

struct Corners<'a> {
    mesh: &'a Mesh,
    uv: &'a [Vec2],
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }
}

impl bevy_mikktspace::Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)].to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.uv[self.vertex(face, corner)];
        // glTF images begin at the top: v grows downwards, the bitangent upwards.
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<bevy_mikktspace::TangentSpace>, face: usize, corner: usize) {
        if let Some(space) = space {
            self.tangents[3 * face + corner] = Vec4::from_array(space.tangent_encoded());
        }
    }
}

/// Generates tangents from texture coordinate set 0; see [`generate_from`].
pub fn generate(mesh: &mut Mesh) -> bool {
    generate_from(mesh, 0)
}

/// Generates tangents from a texture coordinate set; flat normals are made first when there are none, which splits all vertices.
///
/// Returns `false` and leaves the mesh without tangents when it has no texture coordinates or no triangles. Where texture coordinates
/// are degenerate, any unit vector perpendicular to the normal is taken. Deterministic.
pub fn generate_from(mesh: &mut Mesh, uv_set: u32) -> bool {
    mesh.tangents.clear();
    let present = if uv_set == 1 { &mesh.uv1 } else { &mesh.uv0 };
    if present.is_empty() || mesh.triangles.is_empty() {
        return false;
    }
    if mesh.normals.is_empty() {
        let corners: Vec<u32> = mesh.triangles.as_flattened().to_vec();
        rebuild(mesh, &corners);
        mesh.triangles = (0..corners.len() as u32 / 3)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect();
        mesh.normals = flat_normals(mesh);
    }
    let uv = if uv_set == 1 { &mesh.uv1 } else { &mesh.uv0 };
    let mut corners = Corners {
        mesh,
        uv,
        tangents: vec![Vec4::ZERO; 3 * mesh.triangles.len()],
    };
    if bevy_mikktspace::generate_tangents(&mut corners).is_err() {
        return false;
    }
    let tangents = corners.tangents;
    let mut split: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    let mut sources = Vec::new();
    let mut vertex_tangents = Vec::new();
    for face in 0..mesh.triangles.len() {
        for corner in 0..3 {
            let old = mesh.triangles[face][corner];
            let tangent = sound_tangent(tangents[3 * face + corner], mesh.normals[old as usize]);
            let key = (old, tangent.to_array().map(f32::to_bits));
            let new = *split.entry(key).or_insert_with(|| {
                sources.push(old);
                vertex_tangents.push(tangent);
                sources.len() as u32 - 1
            });
            mesh.triangles[face][corner] = new;
        }
    }
    rebuild(mesh, &sources);
    mesh.tangents = vertex_tangents;
    true
}

/// Makes each vertex of `mesh` a copy of the old vertex in `sources`; triangles are the caller's matter.
fn rebuild(mesh: &mut Mesh, sources: &[u32]) {
    fn pick<T: Copy>(values: &mut Vec<T>, sources: &[u32]) {
        if !values.is_empty() {
            *values = sources.iter().map(|&i| values[i as usize]).collect();
        }
    }
    pick(&mut mesh.positions, sources);
    pick(&mut mesh.normals, sources);
    pick(&mut mesh.uv0, sources);
    pick(&mut mesh.uv1, sources);
    pick(&mut mesh.colors, sources);
}

/// Flat normals of an unindexed mesh; +Y for a triangle without area.
fn flat_normals(mesh: &Mesh) -> Vec<Vec3> {
    let mut normals = Vec::with_capacity(mesh.positions.len());
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
        let normal = (b - a).cross(c - a).try_normalize().map_or(Vec3::Y, |n| n.as_vec3());
        normals.extend([normal; 3]);
    }
    normals
}

/// A unit tangent with sign ±1, whatever came in; perpendicular to the normal when it has to be made up.
pub fn sound_tangent(tangent: Vec4, normal: Vec3) -> Vec4 {
    let sign = if tangent.w < 0.0 { -1.0 } else { 1.0 };
    let direction = tangent.truncate();
    let unit = if direction.is_finite() {
        direction.try_normalize()
    } else {
        None
    };
    unit.unwrap_or_else(|| normal.any_orthonormal_vector()).extend(sign)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-TANGENT",
    name: "tangent frames of normal maps",
    role: Role::Service,
    limits: "Meshes without texture coordinates have none.",
    sources: &[sources::MIKKELSEN_2008.at("MikkTSpace")],
    tests: &[
        "engine/src/scene/tangents.rs::tangents_follow_u_and_the_sign_follows_mirroring",
        "engine/src/scene/tangents.rs::disagreeing_corners_split_vertices",
    ],
    api: &["clerestory::scene::tangents::generate"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(uv: [Vec2; 4]) -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
            uv0: uv.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn tangents_follow_u_and_the_sign_follows_mirroring() {
        let upright = [
            Vec2::new(0.0, 1.0),
            Vec2::new(1.0, 1.0),
            Vec2::new(1.0, 0.0),
            Vec2::ZERO,
        ];
        let mut mesh = quad(upright);
        assert!(generate(&mut mesh));
        assert_eq!(mesh.normals, vec![Vec3::Z; mesh.positions.len()]);
        assert!(
            mesh.tangents
                .iter()
                .all(|t| (*t - Vec4::new(1.0, 0.0, 0.0, 1.0)).length() < 1e-6)
        );
        // Mirrored in u: the tangent turns round and so does the sign.
        let mut mirrored = quad(upright.map(|uv| Vec2::new(1.0 - uv.x, uv.y)));
        assert!(generate(&mut mirrored));
        assert!(
            mirrored
                .tangents
                .iter()
                .all(|t| (*t - Vec4::new(-1.0, 0.0, 0.0, -1.0)).length() < 1e-6)
        );
    }

    #[test]
    fn disagreeing_corners_split_vertices() {
        // Second triangle mirrored against the first, sharing an edge with smooth normals.
        let mut mesh = quad([
            Vec2::new(0.0, 1.0),
            Vec2::new(1.0, 1.0),
            Vec2::new(1.0, 0.0),
            Vec2::new(2.0, 1.0),
        ]);
        mesh.normals = vec![Vec3::Z; 4];
        assert!(generate(&mut mesh));
        assert_eq!(mesh.tangents.len(), mesh.positions.len());
        assert!(mesh.positions.len() > 4);
        let signs: Vec<f32> = mesh.triangles.iter().map(|t| mesh.tangents[t[0] as usize].w).collect();
        assert_eq!(signs, [1.0, -1.0]);
    }

    #[test]
    fn degenerate_coordinates_still_give_unit_tangents() {
        let mut mesh = quad([Vec2::ZERO; 4]);
        assert!(generate(&mut mesh));
        for (t, n) in mesh.tangents.iter().zip(&mesh.normals) {
            assert!((t.truncate().length() - 1.0).abs() < 1e-6 && t.truncate().dot(*n).abs() < 1e-6);
        }
        let mut bare = quad([Vec2::ZERO; 4]);
        bare.uv0.clear();
        assert!(!generate(&mut bare));
    }
}
