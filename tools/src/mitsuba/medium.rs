//! Participating media as Mitsuba plugins, and which of them is on the outer side of a body, around the camera and around a light.
//!
//! Here a body lies where it lies; there each one names the media on both of its sides. So bodies are nested by asking which of them hold a
//! vertex of the others: sums of signed crossings of a ray with a body's faces (the winding number). Bodies must be closed, and nested or apart.

use clerestory::scene::medium::vol;
use clerestory::scene::{DensityGrid, LightKind, Material, Medium, Phase, Scene};
use glam::{DVec3, Vec3};

use super::mesh::WorldMesh;
use super::{rgb, transform_xml};

/// A medium's element and, for a grid, its file.
pub(super) struct Described {
    pub(super) xml: String,
    pub(super) file: Option<(String, Vec<u8>)>,
}

/// The `id` of a medium's element.
fn id(index: u32) -> String {
    format!("medium_{index:04}")
}

/// A `<ref>` to a medium: as `interior`, `exterior` or `medium`.
pub(super) fn reference(name: &str, index: u32) -> String {
    format!("<ref name=\"{name}\" id=\"{}\"/>", id(index))
}

/// Whether the inside of a mesh differs from its outside in a way that paths follow.
fn is_body(material: &Material) -> bool {
    material.interior.is_some() || (material.transmission > 0.0 && material.thickness > 0.0)
}

/// Describes a medium, or says why it has no counterpart.
pub(super) fn describe(index: u32, medium: &Medium) -> Result<Described, String> {
    if medium.emission != Vec3::ZERO {
        return Err("Mitsuba's media do not emit".into());
    }
    let sigma_t = medium.sigma_t();
    let albedo = Vec3::from_array([0, 1, 2].map(|i| {
        let share = medium.sigma_s[i] / sigma_t[i];
        if sigma_t[i] > 0.0 { share } else { 0.0 }
    }));
    let phase = phase_xml(medium.phase)?;
    // Colours there lie in [0, 1]; the scale carries the size.
    let scale = sigma_t.max_element();
    let color = if scale > 0.0 { sigma_t / scale } else { Vec3::ZERO };
    let (kind, extinction, file) = match &medium.density {
        None => ("homogeneous", rgb("sigma_t", color), None),
        Some(grid) => {
            let name = format!("{}.vol", id(index));
            let (xml, bytes) = grid_xml(grid, color, &name)?;
            ("heterogeneous", xml, Some((name, bytes)))
        }
    };
    let xml = format!(
        "  <medium type=\"{kind}\" id=\"{}\">\n    {}\n    {extinction}\n    <float name=\"scale\" value=\"{scale}\"/>\n    {phase}\n  </medium>\n",
        id(index),
        rgb("albedo", albedo),
    );
    Ok(Described { xml, file })
}

fn phase_xml(phase: Phase) -> Result<String, String> {
    match phase {
        Phase::HenyeyGreenstein { g: value } | Phase::Schlick { k: value } if value == 0.0 => {
            phase_xml(Phase::Isotropic)
        }
        Phase::Isotropic => Ok("<phase type=\"isotropic\"/>".into()),
        Phase::HenyeyGreenstein { g } => Ok(format!("<phase type=\"hg\"><float name=\"g\" value=\"{g}\"/></phase>")),
        Phase::Rayleigh => Ok("<phase type=\"rayleigh\"/>".into()),
        Phase::Schlick { .. } => Err("Schlick's phase function has no counterpart".into()),
    }
}

/// The volume of a grid: of one channel when the bands are alike, else of three.
fn grid_xml(grid: &DensityGrid, color: Vec3, file: &str) -> Result<(String, Vec<u8>), String> {
    let m = grid.to_world.matrix3;
    let off_axes = [m.x_axis.y, m.x_axis.z, m.y_axis.x, m.y_axis.z, m.z_axis.x, m.z_axis.y];
    if off_axes.iter().any(|x| *x != 0.0) && !is_zero_at_faces(grid) {
        // There the medium ends at the axis-parallel box around the grid, and holds the outermost values up to it.
        return Err("a turned grid whose outermost cells are not 0 ends differently".into());
    }
    let grey = color == Vec3::splat(color.x);
    let channels = if grey {
        &color.to_array()[..1]
    } else {
        &color.to_array()[..]
    };
    let bytes = vol::to_bytes(grid, channels, DVec3::ZERO, DVec3::ONE);
    let xml = format!(
        "<volume name=\"sigma_t\" type=\"gridvolume\">\n      <string name=\"filename\" value=\"{file}\"/>\n      \
         <boolean name=\"raw\" value=\"true\"/>\n{}    </volume>",
        transform_xml("      ", grid.to_world)
    );
    Ok((xml, bytes))
}

fn is_zero_at_faces(grid: &DensityGrid) -> bool {
    let [nx, ny, nz] = grid.size;
    (0..nz).all(|z| {
        (0..ny).all(|y| {
            let ends = z == 0 || z + 1 == nz || y == 0 || y + 1 == ny;
            let step = if ends { 1 } else { nx.max(2) as usize - 1 };
            (0..nx).step_by(step).all(|x| grid.cell(x, y, z) == 0.0)
        })
    })
}

/// The media of a scene around its shapes.
pub(super) struct Surroundings<'a> {
    scene: &'a Scene,
    bodies: Vec<&'a WorldMesh>,
}

impl<'a> Surroundings<'a> {
    pub(super) fn new(scene: &'a Scene, shapes: &'a [WorldMesh]) -> Self {
        let bodies = shapes.iter().filter(|shape| is_body(&shape.material)).collect();
        Self { scene, bodies }
    }

    /// The medium at a point that is on no body's surface.
    pub(super) fn at(&self, point: DVec3) -> Option<u32> {
        let around: Vec<&WorldMesh> = self.bodies.iter().copied().filter(|body| holds(body, point)).collect();
        self.innermost(&around)
    }

    /// `<ref>` elements of a shape's two sides; none for one that paths do not enter.
    pub(super) fn of(&self, shape: &WorldMesh) -> String {
        if !is_body(&shape.material) {
            return String::new();
        }
        let Some(vertex) = shape.triangles.first().map(|t| shape.positions[t[0] as usize]) else {
            return String::new();
        };
        let others = self.bodies.iter().copied().filter(|body| !std::ptr::eq(*body, shape));
        let around: Vec<&WorldMesh> = others.filter(|body| holds(body, vertex.as_dvec3())).collect();
        let inside = shape.material.interior.map(|index| reference("interior", index));
        let outside = self.innermost(&around).map(|index| reference("exterior", index));
        let both: String = inside.into_iter().chain(outside).collect();
        if both.is_empty() { both } else { format!("    {both}\n") }
    }

    /// The medium inside the one of these bodies that all others hold; that of the scene without any.
    fn innermost(&self, around: &[&WorldMesh]) -> Option<u32> {
        let depth = |body: &WorldMesh| {
            let vertex = body
                .triangles
                .first()
                .map_or(DVec3::ZERO, |t| body.positions[t[0] as usize].as_dvec3());
            around
                .iter()
                .filter(|other| !std::ptr::eq(**other, body) && holds(other, vertex))
                .count()
        };
        match around.iter().max_by_key(|body| depth(body)) {
            Some(body) => body.material.interior,
            None => self.scene.surrounding,
        }
    }

    /// Why light from infinity cannot be exported with a medium around everything.
    pub(super) fn refusals(&self) -> Vec<String> {
        let filled = self
            .scene
            .surrounding
            .and_then(|i| self.scene.media.get(i as usize))
            .is_some_and(|m| m.density.is_none());
        let far = self.scene.environment.is_some()
            || self
                .scene
                .lights
                .iter()
                .any(|light| matches!(light.kind, LightKind::Directional { .. }));
        let reason = "surrounding medium: light from infinity comes through endless extinction here, through the scene's bounding sphere there";
        (filled && far).then(|| reason.to_string()).into_iter().collect()
    }
}

/// Whether a closed mesh winds around a point.
fn holds(body: &WorldMesh, point: DVec3) -> bool {
    // Along no axis and no face of the bodies there are: edges are met with probability 0.
    let along = DVec3::new(0.577_412_3, 0.211_893_7, 0.788_481_9);
    let winding: i32 = body
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| body.positions[i as usize].as_dvec3() - point);
            // Signed volumes of the ray with the edges (Plücker products).
            let [u, v, w] = [along.dot(a.cross(b)), along.dot(b.cross(c)), along.dot(c.cross(a))];
            let outward = u > 0.0 && v > 0.0 && w > 0.0;
            let inward = u < 0.0 && v < 0.0 && w < 0.0;
            if !outward && !inward {
                return 0;
            }
            let normal = (b - a).cross(c - a);
            let ahead = normal.dot(a) / normal.dot(along) > 0.0;
            i32::from(ahead) * if outward { 1 } else { -1 }
        })
        .sum();
    winding != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use clerestory::scene::medium::generate::Generator;
    use clerestory_hard_cases::scenes::cuboid;

    fn cube(half: f32, interior: Option<u32>) -> WorldMesh {
        let mesh = cuboid("cube", 0, Vec3::splat(-half), Vec3::splat(half));
        WorldMesh {
            positions: mesh.positions,
            normals: Vec::new(),
            triangles: mesh.triangles,
            material: Material {
                interior,
                boundary: interior.is_some(),
                ..Material::glass("cube", 1.5)
            },
        }
    }

    #[test]
    fn nested_bodies_name_the_media_of_both_sides() {
        let scene = Scene {
            surrounding: Some(9),
            ..Scene::default()
        };
        let shapes = [cube(1.0, Some(0)), cube(3.0, Some(1)), cube(2.0, None)];
        let media = Surroundings::new(&scene, &shapes);
        assert_eq!(media.at(DVec3::new(0.1, 0.2, 0.3)), Some(0));
        assert_eq!(media.at(DVec3::new(0.1, 1.2, 0.3)), None);
        assert_eq!(media.at(DVec3::new(0.1, 0.2, 2.3)), Some(1));
        assert_eq!(media.at(DVec3::new(-7.1, 0.2, 0.3)), Some(9));
        let [inner, outer, glass] = [0, 1, 2].map(|i| media.of(&shapes[i]));
        assert_eq!(inner.trim(), reference("interior", 0));
        assert_eq!(outer.trim(), reference("interior", 1) + &reference("exterior", 9));
        assert_eq!(glass.trim(), reference("exterior", 1));
    }

    #[test]
    fn media_are_described_or_refused() {
        let fog = Medium {
            sigma_a: Vec3::new(0.0, 1.0, 2.0),
            sigma_s: Vec3::new(4.0, 3.0, 0.0),
            phase: Phase::HenyeyGreenstein { g: -0.25 },
            ..Medium::default()
        };
        let text = |medium: &Medium| describe(3, medium).map(|d| d.xml);
        let xml = text(&fog).expect("fog");
        for part in [
            "<medium type=\"homogeneous\" id=\"medium_0003\">",
            "<rgb name=\"albedo\" value=\"1 0.75 0\"/>",
            "<rgb name=\"sigma_t\" value=\"1 1 0.5\"/>",
            "<float name=\"scale\" value=\"4\"/>",
            "<float name=\"g\" value=\"-0.25\"/>",
        ] {
            assert!(xml.contains(part), "{part} is missing in\n{xml}");
        }
        let smoke = Medium {
            sigma_s: Vec3::ONE,
            density: Some(Generator::Gradient.grid([4; 3], 0)),
            phase: Phase::Rayleigh,
            ..Medium::default()
        };
        let described = describe(0, &smoke).expect("smoke");
        assert!(described.xml.contains("gridvolume") && described.xml.contains("rayleigh"));
        let (name, bytes) = described.file.expect("file");
        assert_eq!((name.as_str(), bytes.len()), ("medium_0000.vol", 48 + 4 * 64));
        let change = |edit: fn(&mut Medium)| {
            let mut medium = smoke.clone();
            edit(&mut medium);
            text(&medium).err().unwrap_or_default()
        };
        assert!(change(|m| m.emission = Vec3::ONE).contains("emit"));
        assert!(change(|m| m.phase = Phase::Schlick { k: 0.5 }).contains("Schlick"));
        let turned = change(|m| {
            m.density = m.density.take().map(|g| DensityGrid {
                to_world: glam::DAffine3::from_rotation_y(0.5),
                ..g
            })
        });
        assert!(turned.contains("turned"), "{turned}");
        assert!(
            is_zero_at_faces(&Generator::Cloud.grid([8; 3], 0))
                && !is_zero_at_faces(&Generator::Gradient.grid([8; 3], 0))
        );
    }
}
