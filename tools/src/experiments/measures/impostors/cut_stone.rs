//! A clear stone cut in a step, on a checkered floor that shines into it: a level table and a slope towards each side, seen from above.
//!
//! It stands on the square [−1, 1]² of the plane y = 0, and is convex: what is refracted into it ends on the floor, or at another facet.

use clerestory::maps::impostor::proxy::refracted;
use clerestory::raster::facet::Facet;
use clerestory::scene::{Material, Mesh, Scene};
use clerestory::transport::fresnel::fresnel_dielectric;
use glam::DVec3;

use super::shining_rooms::{Panel, scene_of, squares, wall_color};
use super::virtual_images::INDEX;

/// Height of the table, and half its width.
const HEIGHT: f64 = 0.45;
const TABLE: f64 = 0.55;
/// By how much a point may lie before a facet and still be on it.
const ROUNDING: f64 = 1e-9;
const FACETS: usize = 5;

/// A facet.
#[derive(Debug, Clone, Copy)]
struct StoneFacet {
    /// Where a slope faces, level; 0 of the table.
    outward: DVec3,
    /// Unit normal, out of the stone.
    normal: DVec3,
}

impl StoneFacet {
    /// The table, and a slope for each side.
    fn all() -> [Self; FACETS] {
        [DVec3::ZERO, DVec3::X, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Z].map(|outward| Self {
            outward,
            normal: (HEIGHT * outward + (1.0 - TABLE) * DVec3::Y).normalize(),
        })
    }

    /// How far its plane is from the middle of the floor.
    fn offset(&self) -> f64 {
        self.normal.dot(self.place([0.0, 0.5]))
    }

    fn across(&self) -> DVec3 {
        DVec3::Y.cross(self.outward)
    }

    /// The place of coordinates: from −1 to 1 across, and from 0 to 1 up a slope or along the table.
    fn place(&self, [u, v]: [f64; 2]) -> DVec3 {
        if self.outward == DVec3::ZERO {
            return DVec3::new(TABLE * u, HEIGHT, TABLE * (2.0 * v - 1.0));
        }
        let half = 1.0 - (1.0 - TABLE) * v;
        half * (self.outward + u * self.across()) + HEIGHT * v * DVec3::Y
    }

    /// The coordinates of a place.
    fn coordinates(&self, place: DVec3) -> [f64; 2] {
        if self.outward == DVec3::ZERO {
            return [place.x / TABLE, 0.5 * (place.z / TABLE + 1.0)];
        }
        let v = place.y / HEIGHT;
        [place.dot(self.across()) / (1.0 - (1.0 - TABLE) * v), v]
    }
}

/// A point of the stone that an eye's ray meets.
#[derive(Debug, Clone, Copy)]
pub(super) struct StonePoint {
    facet: usize,
    place: DVec3,
}

/// Where a ray from outside meets the stone.
pub(super) fn met(eye: DVec3, direction: DVec3) -> Option<StonePoint> {
    let facets = StoneFacet::all();
    let mut entered: Option<(f64, usize)> = None;
    for (number, facet) in facets.iter().enumerate() {
        let towards = direction.dot(facet.normal);
        if towards < 0.0 {
            let distance = (facet.offset() - eye.dot(facet.normal)) / towards;
            if entered.is_none_or(|(last, _)| distance > last) {
                entered = Some((distance, number));
            }
        }
    }
    let (distance, facet) = entered.filter(|(distance, _)| *distance > 0.0)?;
    let place = eye + distance * direction;
    let is_behind = |facet: &StoneFacet| place.dot(facet.normal) <= facet.offset() + ROUNDING;
    (place.y >= 0.0 && facets.iter().all(is_behind)).then_some(StonePoint { facet, place })
}

/// What an eye sees at a point of the stone, by the unit direction within: what shines from the floor there.
fn seen(eye: DVec3, point: &StonePoint, normal: DVec3, within: DVec3) -> DVec3 {
    if within.y >= 0.0 {
        return DVec3::ZERO;
    }
    let floor = point.place - point.place.y / within.y * within;
    // What leaves the stone elsewhere comes from another facet.
    if floor.x.abs() >= 1.0 || floor.z.abs() >= 1.0 {
        return DVec3::ZERO;
    }
    let cosine = (eye - point.place).normalize().dot(normal);
    (1.0 - fresnel_dielectric(cosine, INDEX)) / (INDEX * INDEX) * floor_color(floor)
}

fn floor_color(point: DVec3) -> DVec3 {
    wall_color(DVec3::new(point.x, 1.0, point.z))
}

/// What an eye sees at a point, by the exact refracted ray.
pub(super) fn exact(eye: DVec3, point: &StonePoint) -> DVec3 {
    let normal = StoneFacet::all()[point.facet].normal;
    let within = refracted((point.place - eye).normalize(), normal, 1.0 / INDEX);
    seen(eye, point, normal, within)
}

/// A second eye for each part of each facet, `parts`² of each.
pub(super) struct SecondEyes {
    eye: DVec3,
    parts: u32,
    /// Facet by facet, part by part; `None` where the eye does not see one.
    eyes: Vec<Option<DVec3>>,
}

impl SecondEyes {
    /// Those of an eye.
    pub fn new(eye: DVec3, parts: u32) -> Self {
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(parts);
        let of_part = |facet: &StoneFacet, part: u32| {
            let middle = facet.place([2.0 * at(part % parts) - 1.0, at(part / parts)]);
            let normal = facet.normal;
            Facet { middle, normal }.virtual_eye(eye, INDEX)
        };
        let all = StoneFacet::all();
        let eyes = all
            .iter()
            .flat_map(|facet| (0..parts * parts).map(move |part| of_part(facet, part)));
        Self {
            eye,
            parts,
            eyes: eyes.collect(),
        }
    }

    /// What is seen at a point by the second eye of its part.
    pub fn seen(&self, point: &StonePoint) -> DVec3 {
        let facet = &StoneFacet::all()[point.facet];
        let [u, v] = facet.coordinates(point.place);
        let parts = f64::from(self.parts);
        let part = |share: f64| (share * parts).floor().clamp(0.0, parts - 1.0) as usize;
        let (across, up) = (part(0.5 * (u + 1.0)), part(v));
        let parts = self.parts as usize;
        let second = self.eyes.get((point.facet * parts + up) * parts + across);
        second.copied().flatten().map_or(DVec3::ZERO, |from| {
            seen(self.eye, point, facet.normal, (point.place - from).normalize())
        })
    }
}

/// The stone and its floor.
pub(super) fn scene() -> Scene {
    let (middles, half) = squares();
    let panels: Vec<Panel> = middles
        .map(|[x, z]| {
            let middle = DVec3::new(x, 0.0, z);
            Panel::new(middle, [half * DVec3::X, half * DVec3::Z], floor_color(middle))
        })
        .collect();
    let mut scene = scene_of(&panels);
    let mut mesh = Mesh {
        name: "stone".into(),
        material: Some(scene.add_material(Material::glass("stone", INDEX as f32))),
        ..Mesh::default()
    };
    // Counter-clockwise from outside.
    for facet in StoneFacet::all() {
        let corners = if facet.outward == DVec3::ZERO {
            [[-1.0, 1.0], [1.0, 1.0], [1.0, 0.0], [-1.0, 0.0]]
        } else {
            [[-1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [-1.0, 1.0]]
        };
        let first = mesh.positions.len() as u32;
        mesh.positions
            .extend(corners.map(|corner| facet.place(corner).as_vec3()));
        mesh.triangles
            .extend([[0, 1, 2], [0, 2, 3]].map(|triangle| triangle.map(|corner| first + corner)));
    }
    scene.place(mesh);
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    const EYE: DVec3 = DVec3::new(0.15, 1.7, 0.3);

    #[test]
    fn facets_face_outwards_and_close_the_stone() {
        let scene = scene();
        let stone = scene.meshes.last().unwrap();
        let facets = StoneFacet::all();
        for (triangle, facet) in stone
            .triangles
            .iter()
            .zip(facets.iter().flat_map(|facet| [facet, facet]))
        {
            let [a, b, c] = triangle.map(|corner| stone.positions[corner as usize].as_dvec3());
            let normal = (b - a).cross(c - a).normalize();
            assert!((normal - facet.normal).length() < 1e-6, "{normal} {}", facet.normal);
            assert!(
                [a, b, c]
                    .iter()
                    .all(|p| (p.dot(facet.normal) - facet.offset()).abs() < 1e-6)
            );
            for other in &facets {
                assert!([a, b, c].iter().all(|p| p.dot(other.normal) < other.offset() + 1e-6));
            }
        }
    }

    #[test]
    fn coordinates_are_those_of_places() {
        for facet in StoneFacet::all() {
            for at in [[0.0, 0.5], [-0.7, 0.1], [0.4, 0.9]] {
                let found = facet.coordinates(facet.place(at));
                assert!(
                    found.iter().zip(at).all(|(a, b)| (a - b).abs() < 1e-12),
                    "{found:?} {at:?}"
                );
            }
            let place = facet.place([0.3, 0.4]);
            let point = met(EYE, (place - EYE).normalize()).unwrap();
            assert!((point.place - place).length() < 1e-12);
            assert_eq!(StoneFacet::all()[point.facet].normal, facet.normal);
        }
        assert!(met(EYE, DVec3::Y).is_none());
        assert!(met(EYE, (DVec3::new(1.6, 0.0, 0.0) - EYE).normalize()).is_none());
    }

    #[test]
    fn smaller_parts_are_nearer_to_refracted_rays() {
        let off = |parts: u32| {
            let eyes = SecondEyes::new(EYE, parts);
            let mut sum = 0.0;
            for facet in StoneFacet::all() {
                for i in 0..400 {
                    let at = [f64::from(i % 20) * 0.095 - 0.9, f64::from(i / 20) * 0.0475 + 0.05];
                    let place = facet.place(at);
                    let point = met(EYE, (place - EYE).normalize()).unwrap();
                    sum += (eyes.seen(&point) - exact(EYE, &point)).length();
                }
            }
            sum
        };
        let [whole, fourth, sixteenth] = [1, 2, 4].map(off);
        println!("{whole} {fourth} {sixteenth}");
        assert!(fourth < 0.8 * whole && sixteenth < 0.8 * fourth && sixteenth > 0.0);
    }
}
