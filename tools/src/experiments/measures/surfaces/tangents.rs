//! Tangents from texture coordinates on surfaces whose tangents are known.
//!
//! Oracle: ∂P/∂u of the parametric surface.

use std::f32::consts::{PI, TAU};

use clerestory::Result;
use clerestory::scene::Mesh;
use clerestory::scene::tangents::generate;
use glam::{Vec2, Vec3};

use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds;
use crate::experiments::measures::errors::Errors;
use crate::experiments::table::Table;

/// A closed surface over [0, 1]²: position, normal and direction of growing u.
struct Surface {
    name: &'static str,
    at: fn(f32, f32) -> [Vec3; 3],
    /// Left out at both ends of v, where the tangent is not defined.
    poles: f32,
    /// Texture coordinates of a place.
    uv: fn(f32, f32) -> Vec2,
    /// Sign of the bitangent, which points to smaller v as glTF has it.
    sign: f32,
}

fn sphere(u: f32, v: f32) -> [Vec3; 3] {
    let ((s, c), (st, ct)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
    let normal = Vec3::new(st * c, ct, -st * s);
    [normal, normal, Vec3::new(-s, 0.0, -c)]
}

fn torus(u: f32, v: f32) -> [Vec3; 3] {
    let ((s, c), (st, ct)) = ((TAU * u).sin_cos(), (-TAU * v).sin_cos());
    let normal = Vec3::new(ct * c, st, -ct * s);
    let centre = Vec3::new(c, 0.0, -s);
    [centre + 0.4 * normal, normal, Vec3::new(-s, 0.0, -c)]
}

const SURFACES: [Surface; 3] = [
    Surface {
        name: "sphere without its poles",
        at: sphere,
        poles: 0.1,
        uv: Vec2::new,
        sign: 1.0,
    },
    Surface {
        name: "torus",
        at: torus,
        poles: 0.0,
        uv: Vec2::new,
        sign: 1.0,
    },
    Surface {
        name: "torus, u mirrored",
        at: torus,
        poles: 0.0,
        uv: |u, v| Vec2::new(-u, v),
        sign: -1.0,
    },
];

fn mesh(surface: &Surface, steps: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=steps {
        for i in 0..=steps {
            let u = i as f32 / steps as f32;
            let v = surface.poles + (1.0 - 2.0 * surface.poles) * j as f32 / steps as f32;
            let [position, normal, _] = (surface.at)(u, v);
            mesh.positions.push(position);
            mesh.normals.push(normal);
            mesh.uv0.push((surface.uv)(u, v));
        }
    }
    for j in 0..steps {
        for i in 0..steps {
            let corner = |di: u32, dj: u32| (j + dj) * (steps + 1) + i + di;
            let [a, b, c, d] = [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let steps: &[u32] = if context.smoke { &[8] } else { &[16, 64, 256] };
    let mut table = Table::new(
        "Tangents",
        &[
            "surface",
            "triangles",
            "mean error (degrees)",
            "worst error (degrees)",
            "wrong signs",
            "vertices",
            "vertices after",
            "ns a triangle",
        ],
    );
    for surface in &SURFACES {
        for &steps in steps {
            let source = mesh(surface, steps);
            let mut made = source.clone();
            generate(&mut made);
            let (mut errors, mut wrong) = (Errors::default(), 0_u64);
            for ((tangent, uv), normal) in made.tangents.iter().zip(&made.uv0).zip(&made.normals) {
                // Texture coordinates are the parameters up to a mirror.
                let [_, _, along] = (surface.at)(uv.x.abs(), uv.y);
                let along = if uv.x < 0.0 || (surface.uv)(1.0, 0.0).x < 0.0 {
                    -along
                } else {
                    along
                };
                let found = tangent.truncate().as_dvec3();
                let along = along.as_dvec3();
                errors.add(found.cross(along).length().atan2(found.dot(along)).to_degrees());
                wrong += u64::from(tangent.w != surface.sign);
                debug_assert!(normal.is_normalized());
            }
            let triangles = source.triangles.len();
            let time = nanoseconds(context.smoke, std::slice::from_ref(&source), |source| {
                let mut copy = source.clone();
                generate(&mut copy);
                copy
            });
            table.row([
                surface.name.into(),
                (triangles as u64).into(),
                errors.mean().into(),
                errors.worst().into(),
                wrong.into(),
                (source.positions.len() as u64).into(),
                (made.positions.len() as u64).into(),
                (time / triangles as f64).into(),
            ]);
        }
    }
    table.note(
        "Exact: ∂P/∂u of the surface. Triangles are flat, so their tangents differ from it by about the angle that one of them spans; vertices \
         take the mean of theirs, one-sided along the seam of the coordinates. The speed includes the copy of the mesh.",
    );
    Ok(vec![table])
}
