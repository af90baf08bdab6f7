//! Meshes in world space, as binary PLY files (Turk, *The PLY Polygon File Format*, 1994).

use clerestory::scene::{Instance, Material, Mesh, Scene};
use glam::{DMat3, Vec3};

/// A flat-shaded mesh's normals may differ from its faces' by this much, in length of the difference: f32 rounding of both.
const FLAT_TOLERANCE: f64 = 1e-5;

/// One instance in world space.
pub(crate) struct WorldMesh {
    pub(crate) positions: Vec<Vec3>,
    /// Empty for flat shading.
    pub(super) normals: Vec<Vec3>,
    /// Counter-clockwise seen from the front; none without area.
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) material: Material,
}

/// An instance's mesh in world space, or why it cannot be exported.
pub(crate) fn world_mesh(scene: &Scene, instance: &Instance, shading_normals: bool) -> Result<WorldMesh, String> {
    let mesh = scene
        .meshes
        .get(instance.mesh as usize)
        .ok_or_else(|| format!("instance {:?}: mesh {} is not there", instance.name, instance.mesh))?;
    let wrong = |cause: &str| Err(format!("mesh {:?}: {cause}", mesh.name));
    let material = match mesh.material {
        None => Material::default(),
        Some(index) => match scene.materials.get(index as usize) {
            Some(material) => material.clone(),
            None => return wrong("its material is not there"),
        },
    };
    if mesh.colors.iter().any(|color| *color != glam::Vec4::ONE) {
        return wrong("vertex colours have no counterpart");
    }
    if mesh
        .triangles
        .iter()
        .flatten()
        .any(|index| *index as usize >= mesh.positions.len())
    {
        return wrong("a triangle's vertex is not there");
    }
    let to_world = instance.transform;
    let world = |p: &Vec3| to_world.transform_point3(p.as_dvec3()).as_vec3();
    let positions: Vec<Vec3> = mesh.positions.iter().map(world).collect();
    if !positions.iter().all(|p| p.is_finite()) {
        return wrong("a position is not finite");
    }
    let normals = if has_flat_normals(mesh) {
        Vec::new()
    } else if shading_normals && mesh.normals.len() == positions.len() {
        let to_normal = cofactors(to_world.matrix3);
        let turn = |n: &Vec3| (to_normal * n.as_dvec3()).normalize_or_zero().as_vec3();
        mesh.normals.iter().map(turn).collect()
    } else {
        return wrong("interpolated shading normals are bent differently");
    };
    let mirrored = to_world.matrix3.determinant() < 0.0;
    let has_area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize].as_dvec3());
        (b - a).cross(c - a) != glam::DVec3::ZERO
    };
    let turn = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    let triangles = mesh.triangles.iter().copied().filter(has_area).map(turn).collect();
    Ok(WorldMesh {
        positions,
        normals,
        triangles,
        material,
    })
}

/// Normals transform by the matrix of cofactors, whose sign keeps the outside outside under mirroring.
fn cofactors(m: DMat3) -> DMat3 {
    let sign = m.determinant().signum();
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis) * sign,
        m.z_axis.cross(m.x_axis) * sign,
        m.x_axis.cross(m.y_axis) * sign,
    )
}

/// Whether every vertex normal is the normal of each of its faces.
fn has_flat_normals(mesh: &Mesh) -> bool {
    mesh.normals.is_empty()
        || mesh.triangles.iter().all(|triangle| {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
            let normal = (b - a).cross(c - a).normalize_or_zero();
            triangle.iter().all(|i| {
                let given = mesh
                    .normals
                    .get(*i as usize)
                    .map_or(glam::DVec3::ZERO, |n| n.as_dvec3());
                normal == glam::DVec3::ZERO || given.distance(normal) <= FLAT_TOLERANCE
            })
        })
}

/// A mesh as a little-endian binary PLY file.
pub(super) fn to_ply(mesh: &WorldMesh) -> Vec<u8> {
    let mut header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n",
        mesh.positions.len()
    );
    let with_normals = !mesh.normals.is_empty();
    if with_normals {
        header.push_str("property float nx\nproperty float ny\nproperty float nz\n");
    }
    header.push_str(&format!(
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.triangles.len()
    ));
    let mut bytes = header.into_bytes();
    for (index, position) in mesh.positions.iter().enumerate() {
        let normal = mesh.normals.get(index).filter(|_| with_normals);
        for value in position
            .to_array()
            .into_iter()
            .chain(normal.into_iter().flat_map(|n| n.to_array()))
        {
            bytes.extend(value.to_le_bytes());
        }
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        for index in triangle {
            bytes.extend(index.to_le_bytes());
        }
    }
    bytes
}
