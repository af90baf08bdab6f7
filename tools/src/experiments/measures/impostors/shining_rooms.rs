//! Rooms whose surfaces shine and reflect nothing: as scenes that are rendered, as colours of points, and as views with depths.
//!
//! A path of one scattering in them is what a mirror, a matte sphere or the facet of a stone shows of its surroundings, and nothing else.

use clerestory::maps::gather::lit_room::LitRoom;
use clerestory::maps::impostor::ImpostorImage;
use clerestory::maps::impostor::room::{BoxRoom, ShinySphere};
use clerestory::maps::impostor::views::DepthView;
use clerestory::maps::{MapImage, Parametrization};
use clerestory::scene::{Material, Mesh, Scene, load};
use clerestory::{Error, Result};
use clerestory_hard_cases::scenes::lamp;
use glam::{DVec3, UVec2, Vec3};

use super::mirrored_rooms::{SQUARES, color};

/// A piece of a surface that shines evenly.
#[derive(Debug, Clone, Copy)]
pub(super) struct Panel {
    /// Corners that follow each other.
    corners: [DVec3; 4],
    /// What it shines with.
    pub radiance: DVec3,
}

impl Panel {
    /// About its middle, with the halves of its sides.
    pub fn new(middle: DVec3, [u, v]: [DVec3; 2], radiance: DVec3) -> Self {
        Self {
            corners: [middle - u - v, middle + u - v, middle + u + v, middle - u + v],
            radiance,
        }
    }

    /// Its two triangles.
    pub fn triangles(&self) -> [[Vec3; 3]; 2] {
        let [a, b, c, d] = self.corners.map(|corner| corner.as_vec3());
        [[a, b, c], [a, c, d]]
    }
}

/// The radiance of a point of the walls.
pub(super) fn wall_color(point: DVec3) -> DVec3 {
    color(point, point)
}

/// The two axes across one.
fn across(axis: usize) -> [DVec3; 2] {
    [DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]]
}

/// Middles of the squares of a checkered square of half width 1, along both sides, and half the width of one.
pub(super) fn squares() -> (impl Iterator<Item = [f64; 2]>, f64) {
    let count = 2 * SQUARES as u32;
    let at = |i: u32| (f64::from(i) + 0.5) / SQUARES - 1.0;
    let middles = (0..count * count).map(move |i| [at(i % count), at(i / count)]);
    (middles, 0.5 / SQUARES)
}

/// Checkered walls, and the sides of what stands in the room.
pub(super) fn checkered(room: BoxRoom) -> Vec<Panel> {
    let mut all = Vec::new();
    for axis in 0..3 {
        let [u, v] = across(axis);
        for side in [1.0, -1.0] {
            let normal = side * DVec3::AXES[axis];
            let (middles, half) = squares();
            for [a, b] in middles {
                let middle = normal + a * u + b * v;
                all.push(Panel::new(middle, [half * u, half * v], wall_color(middle)));
            }
            let Some([low, high]) = room.obstacle else { continue };
            let (middle, half) = (low.midpoint(high), 0.5 * (high - low));
            let middle = middle + half[axis] * normal;
            // Where it stands at a wall nobody sees it.
            if middle.abs().max_element() < 1.0 {
                let sides = [half.dot(u) * u, half.dot(v) * v];
                all.push(Panel::new(middle, sides, color(middle, normal)));
            }
        }
    }
    all
}

/// Walls of different radiance and a bright patch on the floor.
pub(super) fn lit(room: &LitRoom) -> Vec<Panel> {
    let mut all = Vec::new();
    for (i, radiance) in room.walls.into_iter().enumerate() {
        let side = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let middle = side * DVec3::AXES[i / 2];
        if middle != DVec3::NEG_Y {
            all.push(Panel::new(middle, across(i / 2), DVec3::splat(radiance)));
        }
    }
    // The floor about the patch in the middle of nine.
    let [x, z, half] = room.patch_at;
    let ends = |at: f64| [[-1.0, at - half], [at - half, at + half], [at + half, 1.0]];
    for along_x in ends(x) {
        for along_z in ends(z) {
            let [x, z] = [along_x, along_z].map(|[low, high]| (f64::midpoint(low, high), 0.5 * (high - low)));
            let middle = DVec3::new(x.0, -1.0, z.0);
            let radiance = DVec3::splat(room.radiance(middle));
            all.push(Panel::new(middle, [x.1 * DVec3::X, z.1 * DVec3::Z], radiance));
        }
    }
    all
}

/// A scene of panels: a mesh for each radiance.
pub(super) fn scene_of(panels: &[Panel]) -> Scene {
    let mut scene = Scene {
        name: "shining room".into(),
        ..Scene::default()
    };
    let mut known: Vec<DVec3> = Vec::new();
    for panel in panels {
        if !known.contains(&panel.radiance) {
            known.push(panel.radiance);
        }
    }
    for radiance in known {
        let mut mesh = Mesh {
            name: "panels".into(),
            material: Some(scene.add_material(lamp(radiance.as_vec3()))),
            ..Mesh::default()
        };
        for panel in panels.iter().filter(|panel| panel.radiance == radiance) {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(panel.corners.map(|corner| corner.as_vec3()));
            mesh.triangles
                .extend([[0, 1, 2], [0, 2, 3]].map(|triangle| triangle.map(|corner| first + corner)));
        }
        scene.place(mesh);
    }
    scene
}

/// Puts a sphere of a material into a scene, each edge of its icosahedron in so many parts, with the sphere's own normals.
///
/// # Errors
/// None but for numbers of parts that the built-in scene does not take.
pub(super) fn place_sphere(scene: &mut Scene, sphere: &ShinySphere, material: Material, frequency: u32) -> Result<()> {
    let built_in = load(&format!("builtin:white-furnace?frequency={frequency}&smooth=yes"))?;
    let unit = built_in.meshes.into_iter().next();
    let mut mesh = unit.ok_or_else(|| Error::setting("sphere", "none", "is no mesh of the built-in scene"))?;
    for position in &mut mesh.positions {
        *position = (sphere.centre + sphere.radius * position.as_dvec3()).as_vec3();
    }
    mesh.material = Some(scene.add_material(material));
    scene.place(mesh);
    Ok(())
}

/// What a place in a checkered room sees, with depths.
///
/// # Errors
/// As [`ImpostorImage::from_fn`] and [`MapImage::from_fn`].
pub(super) fn view(room: BoxRoom, place: DVec3, map: Parametrization, size: UVec2) -> Result<DepthView> {
    Ok(DepthView {
        place,
        distances: ImpostorImage::from_fn(map, size, 1, true, |d| vec![room.surface_from(place, d)])?,
        radiance: MapImage::from_fn(map, size, |texel| {
            let d = map.texel_direction(size, texel).unwrap_or(DVec3::Z);
            let met = room.surface_from(place, d);
            color(place + met.distance * d, met.normal)
        })?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The panel that a ray meets first.
    fn met(panels: &[Panel], origin: DVec3, direction: DVec3) -> Option<DVec3> {
        let distance = |panel: &Panel| {
            let [a, b, _, d] = panel.corners;
            let (u, v) = (b - a, d - a);
            let normal = u.cross(v);
            let t = (a - origin).dot(normal) / direction.dot(normal);
            let at = origin + t * direction - a;
            let is_within = |side: DVec3| (0.0..=1.0).contains(&(at.dot(side) / side.length_squared()));
            (t > 0.0 && is_within(u) && is_within(v)).then_some((t, panel.radiance))
        };
        let all = panels.iter().filter_map(distance);
        all.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, radiance)| radiance)
    }

    #[test]
    fn panels_are_what_rays_meet() {
        let origin = DVec3::new(0.61, 0.13, -0.37);
        let direction = |i: u32| {
            let turn = 2.4 * f64::from(i) + 0.1;
            DVec3::new(turn.cos(), (0.73 * turn).sin(), (1.31 * turn).cos()).normalize()
        };
        for room in [BoxRoom::EMPTY, BoxRoom::BOX, BoxRoom::PILLAR] {
            let panels = checkered(room);
            for d in (0..300).map(direction) {
                let surface = room.surface_from(origin, d);
                let expected = color(origin + surface.distance * d, surface.normal);
                assert_eq!(met(&panels, origin, d), Some(expected), "{d}");
            }
        }
        let panels = lit(&LitRoom::PUBLISHED);
        assert_eq!(panels.len(), 5 + 9);
        for d in (0..300).map(direction) {
            let hit = origin + BoxRoom::EMPTY.hit(origin, d) * d;
            let expected = DVec3::splat(LitRoom::PUBLISHED.radiance(hit));
            assert_eq!(met(&panels, origin, d), Some(expected), "{d}");
        }
    }

    #[test]
    fn scenes_have_all_panels() {
        let panels = checkered(BoxRoom::PILLAR);
        // Four sides of the pillar beside 64 squares a wall.
        assert_eq!(panels.len(), 6 * 64 + 4);
        let mut scene = scene_of(&panels);
        assert_eq!(scene.triangles().count(), 2 * panels.len());
        place_sphere(&mut scene, &ShinySphere::P2, Material::mirror("mirror", Vec3::ONE), 4).unwrap();
        assert_eq!(scene.triangles().count(), 2 * panels.len() + 20 * 16);
        let [low, high] = scene.meshes.last().unwrap().bounds();
        let middle = low.midpoint(high).as_dvec3();
        assert!((middle - ShinySphere::P2.centre).length() < 0.01, "{middle}");
    }
}
