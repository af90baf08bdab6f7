//! Tangents from texture coordinates on surfaces whose tangents are known.
//!
//! Oracle: ∂P/∂u of the parametric surface.

use std::f32::consts::{PI, TAU};

use clerestory::Result;
use clerestory::scene::Mesh;
use clerestory::scene::tangents::generate;
use glam::{Vec2, Vec3};

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::Errors;

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

/// Steps around the finest meshes.
const FINEST: u32 = 256;

rows! {
    /// A mesh of a surface.
    struct Row = "Tangents" by [surface, steps] {
        surface: String = "surface",
        steps: u64 = "steps around",
        triangles: u64 = "triangles",
        mean: f64 = "mean error (degrees)",
        worst: f64 = "worst error (degrees)",
        wrong: u64 = "wrong signs",
        vertices: u64 = "vertices",
        vertices_after: u64 = "vertices after",
        time: Repeats = "a triangle (ns)",
    }
    beside "angle that a triangle spans (degrees)" = |row| row.angle().into();
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the worst error is no larger than the angle that a triangle spans: its share",
        Bound::AtMost(1.0),
        |row: &Row| (row.worst / row.angle()).into(),
    )
    .in_every_form(),
    Criterion::each("no sign is wrong", Bound::AtMost(0.0), |row: &Row| row.wrong.into()).in_every_form(),
];

impl Row {
    /// The angle that a triangle spans around the surface, degrees.
    fn angle(&self) -> f64 {
        360.0 / self.steps as f64
    }

    fn of(context: &Context<'_>, surface: &Surface, steps: u32) -> Result<Self> {
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
        let times = context.in_turns(9, 1, |_| {
            Ok(nanoseconds_once(std::slice::from_ref(&source), |source| {
                let mut copy = source.clone();
                generate(&mut copy);
                copy
            }))
        })?;
        let time: Repeats = times.into_iter().flatten().collect();
        let triangles = source.triangles.len();
        Ok(Self {
            surface: surface.name.into(),
            steps: steps.into(),
            triangles: triangles as u64,
            mean: errors.mean(),
            worst: errors.worst(),
            wrong,
            vertices: source.positions.len() as u64,
            vertices_after: made.positions.len() as u64,
            time: time.scaled(1.0 / triangles as f64),
        })
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let steps = context.pick::<&[u32]>(&[16, 64, FINEST], &[8]);
        let name = |surface: &Surface| surface.name.to_owned();
        context.each(&SURFACES, name, |surface| {
            steps.iter().map(|steps| Row::of(context, surface, *steps)).collect()
        })
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline(
                "mean error with 256 steps around, on the worst surface (degrees)",
                largest(self, |row| row.steps == u64::from(FINEST), |row| row.mean),
            )
            .note(
                "Exact: ∂P/∂u of the surface. Triangles are flat, so their tangents differ from it by about the angle that one of them spans; \
                 vertices take the mean of theirs, one-sided along the seam of the coordinates. The speed includes the copy of the mesh.",
            )
    }
}
