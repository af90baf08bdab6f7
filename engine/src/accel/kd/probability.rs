//! How probable it is that a ray visits a node of a kd-tree: what the greedy construction weighs its children by.
//!
//! Sources: J. MacDonald and K. Booth, "Heuristics for Ray Tracing Using Space Subdivision", The Visual Computer 6(3), 1990 (surface
//! area); B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §4.1 (origins inside the scene: the integral,
//! its 26 regions, and the overlapping slabs of SIROH); A. Van Oosterom and J. Strackee, "The Solid Angle of a Plane Triangle", IEEE
//! TBME 30(2), 1983; C. Hoer and C. Love, "Exact Inductance Equations for Rectangular Conductors", J. Res. NBS 69C, 1965 (the integral of
//! 1/r over two parallel rectangles).
//!
//! The exact probability has a closed form, which Fabianowski does not have (§4.1.1 expects elliptic integrals): a side of the node is seen
//! from all of the box between its plane and the scene's parallel side, so the solid angle ∫ h/r³ dA is integrated over whole boxes; along
//! the depth that is 1/r, and over both rectangles it is the function of Hoer and Love. See [`exact`].

use std::f64::consts::PI;

use super::bounds::Bounds;
use crate::catalogue::{Role, Row, sources};
use glam::DVec3;

/// The measure of how probable a visit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Heuristic {
    /// Ratio of surface areas (SAH): right for lines from outside.
    SurfaceArea,
    /// Origins uniform in the scene, the solid angle in each of up to 26 regions as at its centre.
    Regions,
    /// Origins uniform in the scene, the solid angle as a ratio of areas over six overlapping slabs (SIROH).
    #[default]
    InteriorOrigin,
    /// Origins uniform in the scene, exactly: a reference, some hundred times slower a candidate.
    Exact,
}

impl Heuristic {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::SurfaceArea, Self::Regions, Self::InteriorOrigin, Self::Exact];

    /// As reports name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::SurfaceArea => "sah",
            Self::Regions => "regions",
            Self::InteriorOrigin => "siroh",
            Self::Exact => "exact",
        }
    }

    /// Probability that a ray visits `node`, a part of `scene`, which must have a volume. 1 for the scene itself; SIROH may exceed the
    /// surface area heuristic.
    pub fn probability(self, node: &Bounds, scene: &Bounds) -> f64 {
        match self {
            Self::SurfaceArea => node.half_area() / scene.half_area(),
            Self::Regions => regions(node, scene),
            Self::InteriorOrigin => InteriorOrigin::new(node, scene).sum(),
            Self::Exact => exact(node, scene),
        }
    }
}

/// The two axes across one.
fn across(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// Distance from a side of the node to the scene's side beyond it; `upper` names the side at the greater coordinate.
fn depth(node: &Bounds, scene: &Bounds, axis: usize, upper: bool) -> f64 {
    if upper {
        scene.upper[axis] - node.upper[axis]
    } else {
        node.lower[axis] - scene.lower[axis]
    }
}

/// Area of a cross-section.
fn section(bounds: &Bounds, axis: usize) -> f64 {
    let [a, b] = across(axis);
    bounds.extent()[a] * bounds.extent()[b]
}

/// Perimeter of a cross-section.
fn perimeter(bounds: &Bounds, axis: usize) -> f64 {
    let [a, b] = across(axis);
    2.0 * (bounds.extent()[a] + bounds.extent()[b])
}

/// Of one axis of a parent, what the surface area heuristic of its children shares wherever it is split.
#[derive(Debug, Clone, Copy)]
pub struct AreaTerms {
    axis: usize,
    /// Extents of the two axes that follow, in cyclic order, and the area of the cross-section.
    extents: [f64; 2],
    section: f64,
    /// Half the scene's surface area.
    scene: f64,
}

impl AreaTerms {
    /// What candidates on `axis` of `node` share.
    pub fn new(node: &Bounds, scene: &Bounds, axis: usize) -> Self {
        Self {
            axis,
            extents: across(axis).map(|a| node.extent()[a]),
            section: section(node, axis),
            scene: scene.half_area(),
        }
    }

    /// Probabilities of the children below and above a split, by their extents, to the bit those of [`Heuristic::probability`]: terms are
    /// added in the order of [`Bounds::half_area`]. Each takes two products, two additions and a division.
    pub fn split(&self, extents: [f64; 2]) -> [f64; 2] {
        extents.map(|extent| {
            let [a, b] = self.extents.map(|side| side * extent);
            let half_area = match self.axis {
                0 => a + self.section + b,
                1 => b + a + self.section,
                _ => self.section + b + a,
            };
            half_area / self.scene
        })
    }
}

/// The scene-interior ray origin heuristic of a node, part by part, as it is handed down to children.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InteriorOrigin {
    /// Origins inside the node: its share of the volume.
    inside: f64,
    /// Origins beyond each side: lower and upper, by axis.
    sides: [[f64; 2]; 3],
}

/// Of one axis of a parent, what does not depend on where it is split.
#[derive(Debug, Clone, Copy)]
pub struct AxisTerms {
    /// The parent's own sides on the axis, lower and upper.
    ends: [f64; 2],
    /// Growth of the parts inside and beyond the lateral sides with the extent.
    slope: f64,
    /// The two constants of the part beyond the split.
    beyond: [f64; 2],
}

impl AxisTerms {
    /// Probabilities of the children below and above a split: `below` and `above` are their extents, `to_lower` and `to_upper` the
    /// distances from the split to the scene's sides. Each takes three additions, two products and a division.
    pub fn split(&self, [below, above]: [f64; 2], [to_lower, to_upper]: [f64; 2]) -> [f64; 2] {
        let part = |end: f64, extent: f64, distance: f64| {
            end + self.slope * extent + distance / (self.beyond[0] + self.beyond[1] * distance)
        };
        [part(self.ends[0], below, to_upper), part(self.ends[1], above, to_lower)]
    }
}

impl InteriorOrigin {
    /// Of any node of a scene with a volume.
    pub fn new(node: &Bounds, scene: &Bounds) -> Self {
        let side = |axis: usize, upper: bool| {
            let (d, area) = (depth(node, scene, axis, upper), section(scene, axis));
            let share = d * area / scene.volume();
            share * section(node, axis) / (2.0 * area + d * perimeter(scene, axis))
        };
        Self {
            inside: node.volume() / scene.volume(),
            sides: [0, 1, 2].map(|axis| [side(axis, false), side(axis, true)]),
        }
    }

    /// The probability.
    pub fn sum(&self) -> f64 {
        self.inside + self.sides.iter().flatten().sum::<f64>()
    }

    /// What candidates on `axis` of `node` share; the node must have an extent there.
    pub fn terms(&self, node: &Bounds, scene: &Bounds, axis: usize) -> AxisTerms {
        let lateral: f64 = across(axis).iter().flat_map(|a| self.sides[*a]).sum();
        let (area, volume) = (section(node, axis), scene.volume());
        AxisTerms {
            ends: self.sides[axis],
            slope: (self.inside + lateral) / node.extent()[axis],
            beyond: if area > 0.0 {
                [
                    2.0 * volume / area,
                    volume * perimeter(scene, axis) / (section(scene, axis) * area),
                ]
            } else {
                [f64::INFINITY, 0.0]
            },
        }
    }
}

/// Solid angle of a rectangle that faces along `axis`, seen from a point.
fn rectangle_solid_angle(node: &Bounds, axis: usize, upper: bool, from: DVec3) -> f64 {
    let [a, b] = across(axis);
    let corner = |along_a: bool, along_b: bool| {
        let pick = |bounds_upper: bool, axis: usize| {
            if bounds_upper {
                node.upper[axis]
            } else {
                node.lower[axis]
            }
        };
        let mut corner = DVec3::ZERO;
        corner[axis] = pick(upper, axis);
        corner[a] = pick(along_a, a);
        corner[b] = pick(along_b, b);
        corner - from
    };
    let triangle = |p: DVec3, q: DVec3, r: DVec3| {
        let (lp, lq, lr) = (p.length(), q.length(), r.length());
        let bottom = lp * lq * lr + p.dot(q) * lr + p.dot(r) * lq + q.dot(r) * lp;
        2.0 * p.dot(q.cross(r)).abs().atan2(bottom)
    };
    let (p, q, r, s) = (
        corner(false, false),
        corner(true, false),
        corner(true, true),
        corner(false, true),
    );
    triangle(p, q, r) + triangle(p, r, s)
}

/// By the solid angles at the centres of the regions into which the planes of the node's sides cut the scene.
fn regions(node: &Bounds, scene: &Bounds) -> f64 {
    // Below, beside and above the node on an axis.
    let slab = |axis: usize, place: usize| match place {
        0 => (scene.lower[axis], node.lower[axis]),
        1 => (node.lower[axis], node.upper[axis]),
        _ => (node.upper[axis], scene.upper[axis]),
    };
    let mut sum = node.volume();
    for region in 0..27 {
        let places = [region % 3, region / 3 % 3, region / 9];
        let slabs = [0, 1, 2].map(|axis| slab(axis, places[axis]));
        let bounds = Bounds {
            lower: slabs.map(|slab| slab.0).into(),
            upper: slabs.map(|slab| slab.1).into(),
        };
        if places == [1, 1, 1] || bounds.volume() <= 0.0 {
            continue;
        }
        let centre = 0.5 * (bounds.lower + bounds.upper);
        let seen: f64 = (0..3)
            .filter(|axis| places[*axis] != 1)
            .map(|axis| rectangle_solid_angle(node, axis, places[axis] == 2, centre))
            .sum();
        sum += bounds.volume() * seen / (4.0 * PI);
    }
    sum / scene.volume()
}

/// The exact probability: V(N)/V(S) + Σ over sides of (J(0) − J(d)) / (4π V(S)), where J(h) integrates 1/r over the node's side and the
/// scene's cross-section at distance h.
pub fn exact(node: &Bounds, scene: &Bounds) -> f64 {
    let mut sum = node.volume();
    for axis in 0..3 {
        let [a, b] = across(axis);
        let ranges = [a, b].map(|axis| {
            [
                [scene.lower[axis], scene.upper[axis]],
                [node.lower[axis], node.upper[axis]],
            ]
        });
        let near = inverse_distance_integral(ranges, 0.0);
        for upper in [false, true] {
            let far = inverse_distance_integral(ranges, depth(node, scene, axis, upper));
            sum += (near - far) / (4.0 * PI);
        }
    }
    sum / scene.volume()
}

/// ∫∫ 1/r over two parallel rectangles at distance `h`; for each of two axes the range of the first and of the second.
fn inverse_distance_integral([first, second]: [[[f64; 2]; 2]; 2], h: f64) -> f64 {
    let differences = |[a, b]: [[f64; 2]; 2]| {
        [
            (a[1] - b[0], 1.0),
            (a[0] - b[1], 1.0),
            (a[1] - b[1], -1.0),
            (a[0] - b[0], -1.0),
        ]
    };
    let mut sum = 0.0;
    for (u, sign_u) in differences(first) {
        for (v, sign_v) in differences(second) {
            sum += sign_u * sign_v * inverse_distance_antiderivative(u, v, h);
        }
    }
    sum
}

/// A function whose fourth derivative, twice by `u` and twice by `v`, is 1/r with r² = u² + v² + h². The logarithms of Hoer and Love are
/// written as hyperbolic sines: they differ by terms that are linear in one of the variables, and stay finite where r meets an axis.
fn inverse_distance_antiderivative(u: f64, v: f64, h: f64) -> f64 {
    let r = (u * u + v * v + h * h).sqrt();
    let logarithm = |a: f64, other: f64| {
        let across = other.hypot(h);
        if across > 0.0 { (a / across).asinh() } else { 0.0 }
    };
    let angle = if h > 0.0 && r > 0.0 {
        u * v * h * (u * v / (h * r)).atan()
    } else {
        0.0
    };
    0.5 * (u * u - h * h) * v * logarithm(v, u) + 0.5 * (v * v - h * h) * u * logarithm(u, v)
        - (u * u - 2.0 * h * h + v * v) * r / 6.0
        - angle
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-KD-2",
        name: "exact probability of a visit from inside the scene, in closed form",
        role: Role::PartOf("PM-KD-1"),
        limits: "Assumes origins spread evenly over the scene's box, and that nothing hides a node; some hundred times slower per candidate than the surface area.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.1.1"), sources::HOER_LOVE_1965.whole()],
        tests: &[
            "engine/src/accel/kd/probability/tests.rs::the_closed_form_is_the_integral_of_solid_angles",
            "engine/src/accel/kd/probability/tests.rs::probabilities_are_those_of_the_reference_table",
        ],
        api: &[
            "clerestory::accel::kd::probability::exact",
            "clerestory::accel::kd::Heuristic",
        ],
        settings: &["clerestory::accel::kd::KdSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-KD-3",
        name: "probability of a visit from inside the scene by 26 regions",
        role: Role::PartOf("PM-KD-1"),
        limits: "The solid angle in each region is that at its centre, wrong where the node is near.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.1.2")],
        tests: &["engine/src/accel/kd/probability/tests.rs::probabilities_are_those_of_the_reference_table"],
        api: &["clerestory::accel::kd::Heuristic"],
        settings: &["clerestory::accel::kd::KdSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-KD-4",
        name: "probability of a visit from inside the scene by overlapping slabs (SIROH), incrementally",
        role: Role::PartOf("PM-KD-1"),
        limits: "Rays visit fewer inner nodes than in trees by surface area and test more triangles in most scenes; solid angles are ratios of areas over overlapping slabs, which can exceed the surface area heuristic.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.1.3")],
        tests: &[
            "engine/src/accel/kd/probability/tests.rs::parts_handed_down_are_those_of_the_children",
            "engine/src/accel/kd/probability/tests.rs::every_heuristic_gives_the_scene_itself_one",
        ],
        api: &[
            "clerestory::accel::kd::Heuristic",
            "clerestory::accel::kd::probability::InteriorOrigin",
        ],
        settings: &["clerestory::accel::kd::KdSettings"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-KD-5",
        name: "SIROH beside the surface area heuristic in other tracers: a queue with caches, and rays with a short stack",
        role: Role::PartOf("PM-KD-1"),
        limits: "Tracers of the engine alone, which share the test of triangles: the source's RT² and Radius-CUDA are not at hand.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.1.4")],
        tests: &[
            "tools/src/experiments/measures/kd/kd_hosts.rs::siroh_visits_fewer_nodes_from_inside_a_scene_in_every_tracer",
        ],
        api: &["clerestory::accel::kd::Heuristic"],
        settings: &["clerestory::accel::kd::KdSettings"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests;
