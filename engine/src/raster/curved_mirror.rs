//! Mirror images of points in a sphere, as vertices that a rasterizer draws: what a curved mirror shows without rays.
//!
//! Source: E. Ofek, A. Rappoport, "Interactive Reflections on Curved Objects", SIGGRAPH 1998 (virtual vertices behind the mirror, drawn as triangles with the scene's own connections). For a sphere the
//! point of reflection lies in the plane of eye, middle and vertex, and is found by bisection of the angle at which both are seen under equal angles from its normal.
//!
//! A virtual vertex lies on the eye's ray through the point of reflection, as far behind that as the vertex is before it: in a plane, the limit of large spheres, that is the mirror image. Exact at vertices; between
//! them triangles stay flat where images bend, so that the error falls with the square of their size. Vertices that the eye does not see in the sphere have no image, and triangles that miss one are not
//! drawn: bodies have frayed edges until their triangles are small. Deterministic. A yardstick for look-ups in maps.

use glam::DVec3;

use crate::catalogue::{Bias, Role, Row, Source};

/// Bisections: those that f64 tells apart.
const BISECTIONS: u32 = 52;
/// How far beside a line, relatively, a point counts as on it.
const LINE: f64 = 1e-12;

/// A sphere that mirrors on its outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereMirror {
    /// Middle, metres.
    pub centre: DVec3,
    /// Radius, metres.
    pub radius: f64,
}

impl SphereMirror {
    /// Where an eye sees a point in the sphere; `None` where one of both lies within it or is hidden by it from the other's image.
    pub fn reflection_point(&self, eye: DVec3, point: DVec3) -> Option<DVec3> {
        let [to_eye, to_point] = [eye, point].map(|place| place - self.centre);
        if !(to_eye.length() > self.radius && to_point.length() > self.radius) {
            return None;
        }
        let first = to_eye.normalize();
        // Any direction across where both lie on one line but for rounding.
        let across = Some(to_point.reject_from_normalized(first)).filter(|v| v.length() > LINE * to_point.length());
        let across = across.map_or_else(|| first.any_orthonormal_vector(), DVec3::normalize);
        let at = |turn: f64| {
            let normal = turn.cos() * first + turn.sin() * across;
            (self.centre + self.radius * normal, normal)
        };
        // By how much the eye is seen more obliquely than the point.
        let tilt = |turn: f64| {
            let (place, normal) = at(turn);
            angle(eye - place, normal) - angle(point - place, normal)
        };
        let (mut low, mut high) = (0.0, to_point.dot(across).atan2(to_point.dot(first)));
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if tilt(middle) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        let (place, normal) = at(0.5 * (low + high));
        let is_before = |other: DVec3| (other - place).dot(normal) > 0.0;
        (is_before(eye) && is_before(point)).then_some(place)
    }

    /// The virtual vertex of a point: behind the place where the eye sees it, as far as it is before that. `None` as above.
    pub fn virtual_vertex(&self, eye: DVec3, point: DVec3) -> Option<DVec3> {
        let place = self.reflection_point(eye, point)?;
        Some(place + place.distance(point) * (place - eye).normalize())
    }
}

/// Between two vectors, radians, to the last digits where it is small.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

/// A triangle as it is drawn in place of its mirror image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VirtualTriangle {
    /// Its corners.
    pub corners: [DVec3; 3],
    /// Their virtual vertices.
    pub images: [DVec3; 3],
}

impl VirtualTriangle {
    /// Of a triangle all of whose corners have an image.
    pub fn new(mirror: &SphereMirror, eye: DVec3, corners: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|corner| mirror.virtual_vertex(eye, corner));
        Some(Self {
            corners,
            images: [a?, b?, c?],
        })
    }

    /// What an eye's ray shows: how far its image is along the ray, and the triangle's point.
    pub fn shown(&self, eye: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
        let [a, b, c] = self.images;
        let (ab, ac) = (b - a, c - a);
        let across = direction.cross(ac);
        let determinant = ab.dot(across);
        if determinant == 0.0 {
            return None;
        }
        let from = eye - a;
        let u = from.dot(across) / determinant;
        let turned = from.cross(ab);
        let v = direction.dot(turned) / determinant;
        let t = ac.dot(turned) / determinant;
        let [first, second, third] = self.corners;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then(|| (t, (1.0 - u - v) * first + u * second + v * third))
    }
}

const OFEK_RAPPOPORT_1998: Source = Source {
    key: "ofek-rappoport-1998",
    authors: "E. Ofek, A. Rappoport",
    title: "Interactive Reflections on Curved Objects",
    venue: "SIGGRAPH",
    year: 1998,
};

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-P4",
    name: "mirror images in a sphere by virtual vertices",
    role: Role::Yardstick,
    limits: "Spheres; exact at vertices alone, so that walls take many triangles, and triangles with a vertex that is not seen in the sphere are missing.",
    sources: &[OFEK_RAPPOPORT_1998.whole()],
    bias: Some(Bias::Biased("triangles are flat where their images bend")),
    tests: &[
        "engine/src/raster/curved_mirror.rs::points_are_seen_where_light_is_mirrored",
        "engine/src/raster/curved_mirror.rs::large_spheres_are_planes",
        "engine/src/raster/curved_mirror.rs::finer_walls_err_by_the_square_less",
    ],
    api: &["clerestory::raster::curved_mirror::SphereMirror"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::impostor::proxy::mirrored;

    const MIRROR: SphereMirror = SphereMirror {
        centre: DVec3::new(0.5, 0.0, 0.0),
        radius: 0.3,
    };
    const EYE: DVec3 = DVec3::new(-0.8, 0.1, -0.7);

    #[test]
    fn points_are_seen_where_light_is_mirrored() {
        let mut hidden = 0;
        for i in 0..200 {
            let turn = 2.4 * f64::from(i);
            let point = DVec3::new(turn.cos(), (0.7 * turn).sin(), (1.3 * turn).sin());
            let Some(place) = MIRROR.reflection_point(EYE, point) else {
                hidden += 1;
                continue;
            };
            let normal = (place - MIRROR.centre) / MIRROR.radius;
            assert!((normal.length() - 1.0).abs() < 1e-12);
            let arrives = mirrored((place - EYE).normalize(), normal);
            let to = (point - place).normalize();
            assert!((arrives - to).length() < 1e-9, "{point}: {arrives} {to}");
            // As far as light goes.
            let image = MIRROR.virtual_vertex(EYE, point).expect("an image");
            let way = EYE.distance(place) + place.distance(point);
            assert!((image.distance(EYE) - way).abs() < 1e-12, "{image}");
            assert!((image - EYE).angle_between(place - EYE) < 1e-7);
        }
        assert!((1..100).contains(&hidden), "{hidden}");
        // Straight behind the sphere, in it, and in one line with the eye before it.
        let away = (MIRROR.centre - EYE).normalize();
        assert_eq!(MIRROR.reflection_point(EYE, MIRROR.centre + away), None);
        assert_eq!(MIRROR.reflection_point(EYE, MIRROR.centre + 0.1 * away), None);
        let before = MIRROR.reflection_point(EYE, MIRROR.centre - 0.5 * away).expect("seen");
        assert!((before - (MIRROR.centre - 0.3 * away)).length() < 1e-7, "{before}");
    }

    #[test]
    fn large_spheres_are_planes() {
        // The plane z = 0 in the limit.
        let (eye, point) = (DVec3::new(0.3, 0.2, 1.0), DVec3::new(-0.6, 0.5, 0.7));
        let mut last = f64::INFINITY;
        for radius in [10.0, 100.0, 1000.0] {
            let mirror = SphereMirror {
                centre: DVec3::new(0.0, 0.0, -radius),
                radius,
            };
            let off = mirror.virtual_vertex(eye, point).expect("seen") - DVec3::new(-0.6, 0.5, -0.7);
            assert!(off.length() < 0.2 * last, "{radius}: {off}");
            last = off.length();
        }
        assert!(last < 0.01, "{last}");
    }

    #[test]
    fn finer_walls_err_by_the_square_less() {
        // A wall of which the eye sees all in the sphere, and a wall that goes behind it.
        let across = |u: f64, v: f64| DVec3::new(-1.0, u, v);
        let mean = |cells: u32| {
            let at = |i: u32| 2.0 * f64::from(i) / f64::from(cells) - 1.0;
            let cell = |i: u32, j: u32| {
                let corner = |i: u32, j: u32| across(at(i), at(j));
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                [[a, b, c], [a, c, d]]
            };
            let all = (0..cells).flat_map(|i| (0..cells).flat_map(move |j| cell(i, j)));
            let drawn: Vec<VirtualTriangle> = all
                .map(|corners| VirtualTriangle::new(&MIRROR, EYE, corners).expect("seen"))
                .collect();
            let mut errors = Vec::new();
            for i in 0..11 {
                for j in 0..11 {
                    let point = across(0.16 * f64::from(i) - 0.83, 0.16 * f64::from(j) - 0.83);
                    let place = MIRROR.reflection_point(EYE, point).expect("seen");
                    let direction = (place - EYE).normalize();
                    let shown = drawn.iter().filter_map(|triangle| triangle.shown(EYE, direction));
                    let nearest = shown.min_by(|a, b| a.0.total_cmp(&b.0)).expect("no hole").1;
                    errors.push((nearest - place).angle_between(point - place).to_degrees());
                }
            }
            errors.iter().sum::<f64>() / errors.len() as f64
        };
        let [coarse, middle, fine] = [2, 4, 8].map(mean);
        println!("{coarse:.3}°, {middle:.3}°, {fine:.3}°");
        assert!(
            coarse > 0.3 && middle < 0.4 * coarse && fine < 0.4 * middle,
            "{coarse} {middle} {fine}"
        );
        assert!(fine > 0.05 * middle, "flat triangles are not exact: {fine}");
    }
}
