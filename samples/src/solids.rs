//! Smooth solids: spheres, rings and knots, with normals.

use std::f64::consts::TAU;

use clerestory::scene::Mesh;
use glam::DVec3;

/// A closed surface over a grid that repeats in both directions: places and normals by two turns.
fn closed_grid(name: &str, cells: [u32; 2], at: impl Fn(f64, f64) -> [DVec3; 2]) -> Mesh {
    let [along, around] = cells;
    let mut mesh = Mesh {
        name: name.into(),
        ..Mesh::default()
    };
    for i in 0..along {
        for j in 0..around {
            let [place, normal] = at(
                TAU * f64::from(i) / f64::from(along),
                TAU * f64::from(j) / f64::from(around),
            );
            mesh.positions.push(place.as_vec3());
            mesh.normals.push(normal.normalize_or_zero().as_vec3());
        }
    }
    let index = |i: u32, j: u32| i % along * around + j % around;
    for i in 0..along {
        for j in 0..around {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            mesh.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    mesh
}

/// A sphere about the origin, metres.
pub fn sphere(radius: f64, slices: u32) -> Mesh {
    let stacks = slices / 2;
    let mut mesh = Mesh {
        name: "sphere".into(),
        ..Mesh::default()
    };
    for stack in 0..=stacks {
        for slice in 0..slices {
            let theta = 0.5 * TAU * f64::from(stack) / f64::from(stacks);
            let phi = TAU * f64::from(slice) / f64::from(slices);
            let normal = DVec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos());
            mesh.positions.push((radius * normal).as_vec3());
            mesh.normals.push(normal.as_vec3().normalize());
        }
    }
    let index = |stack: u32, slice: u32| stack * slices + slice % slices;
    for stack in 0..stacks {
        for slice in 0..slices {
            let [a, b, c, d] = [
                index(stack, slice),
                index(stack + 1, slice),
                index(stack + 1, slice + 1),
                index(stack, slice + 1),
            ];
            if stack > 0 {
                mesh.triangles.push([a, b, d]);
            }
            if stack + 1 < stacks {
                mesh.triangles.push([b, c, d]);
            }
        }
    }
    mesh
}

/// A tube of radius `tube` along the curve that goes `p` times around the axis y and `q` times around the ring of radius `ring` at `winding` from
/// it, metres: a ring for q = 0, a trefoil for (2, 3).
pub fn knot([p, q]: [u32; 2], ring: f64, winding: f64, tube: f64, cells: [u32; 2]) -> Mesh {
    let [p, q] = [p, q].map(f64::from);
    let on_curve = |t: f64| {
        let (turn, wind) = (p * t, q * t);
        let out = ring + winding * wind.cos();
        DVec3::new(out * turn.cos(), winding * wind.sin(), out * turn.sin())
    };
    // The normal of the ring's own surface, which turns evenly with the curve.
    let outward = |t: f64| {
        let (turn, wind) = (p * t, q * t);
        DVec3::new(wind.cos() * turn.cos(), wind.sin(), wind.cos() * turn.sin())
    };
    closed_grid("knot", cells, |t, around| {
        const STEP: f64 = 1e-4;
        let tangent = (on_curve(t + STEP) - on_curve(t - STEP)).normalize();
        let across = tangent.cross(outward(t)).normalize();
        let normal = around.cos() * across.cross(tangent) + around.sin() * across;
        [on_curve(t) + tube * normal, normal]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume by the divergence theorem: positive where triangles are seen from outside counter-clockwise.
    fn volume(mesh: &Mesh) -> f64 {
        let at = |i: u32| mesh.positions[i as usize].as_dvec3();
        let parts = mesh
            .triangles
            .iter()
            .map(|[a, b, c]| at(*a).dot(at(*b).cross(at(*c))) / 6.0);
        parts.sum()
    }

    #[test]
    fn solids_are_closed_and_face_outwards() {
        let ball = volume(&sphere(1.0, 96));
        assert!((ball / (2.0 / 3.0 * TAU) - 1.0).abs() < 3e-3, "{ball}");
        // Pappus: the tube's cross-section times the length of its middle.
        let ring = volume(&knot([1, 0], 1.0, 0.0, 0.25, [128, 64]));
        assert!((ring / (0.5 * TAU * 0.0625 * TAU) - 1.0).abs() < 3e-3, "{ring}");
        let trefoil = knot([2, 3], 1.0, 0.4, 0.15, [256, 24]);
        assert!(volume(&trefoil) > 0.0);
        for mesh in [&trefoil, &sphere(0.5, 24)] {
            for [a, b, c] in &mesh.triangles {
                let [pa, pb, pc] = [a, b, c].map(|i| mesh.positions[*i as usize]);
                let flat = (pb - pa).cross(pc - pa);
                assert!(flat.dot(mesh.normals[*a as usize]) > 0.0, "{}", mesh.name);
            }
        }
    }
}
